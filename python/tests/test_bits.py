"""The ticks of docs/bits.md once more, through the wheel: the same bits as natively and in the emulator.

``CLUTCH_BITS`` names the folder that ``cargo run --release -p clutch-tests --example bits -- FOLDER`` fills.
"""

import os
import zlib
from pathlib import Path

import numpy as np
import pytest

import clutch as package

FOLDER = os.environ.get("CLUTCH_BITS")


@pytest.fixture(scope="session")
def bits():
    """The folder, the list of runs (name: ticks, hash, hashed bytes of a record), and a record as NumPy's type."""
    if not FOLDER:
        if os.environ.get("CI"):
            pytest.fail("CLUTCH_BITS is not set: CI must not skip this test")
        pytest.skip("CLUTCH_BITS is not set: see docs/bits.md")
    folder = Path(FOLDER)
    fields = [tuple(line.split()) for line in (folder / "fields.txt").read_text(encoding="utf-8").splitlines()]
    runs = [line.split() for line in (folder / "runs.txt").read_text(encoding="utf-8").splitlines()]
    runs = {name: (int(ticks), int(crc, 16), int(hashed)) for name, ticks, crc, hashed in runs}
    return folder, runs, np.dtype(fields)


def stepped(scenario, counts, record):
    """The outputs of law and detector for the counts: a record each."""
    law, sticks, path = package.Servo(scenario), package.StickSlip(scenario), scenario.path()
    assert len(path) == len(counts)
    # A law has up to eight terms: three within a record, the others at its end, 0 beyond those that it has.
    rows, most = [], 8
    for tick, count in enumerate(counts.tolist()):
        target = path.at(tick)
        volts = law.step(count, target)
        sticks.update(count, target.velocity_rad_s)
        terms = list(law.terms.values())
        terms += [0.0] * (most - len(terms))
        rows.append(
            (
                int(target.position_counts * 65536),
                target.velocity_rad_s,
                target.acceleration_rad_s2,
                law.error,
                law.error_rate,
                *terms[:3],
                law.demand,
                volts,
                law.code,
                law.limit,
                sticks.stuck,
                sticks.cycles,
                sticks.stuck_ticks,
                sticks.stair,
                *terms[3:],
            )
        )
    assert len(rows[0]) == len(record.names), "the records have other fields than this test"
    return np.array(rows, dtype=record)


def difference(native, ours):
    """The first tick and field that differ, by their bits; none if nothing does."""
    size = native.dtype.itemsize
    rows = [records.view(np.uint8).reshape(-1, size) for records in (native, ours)]
    apart = np.flatnonzero((rows[0] != rows[1]).any(axis=1))
    if len(apart) == 0:
        return None
    tick = int(apart[0])
    name = next(n for n in native.dtype.names if native[n][tick].tobytes() != ours[n][tick].tobytes())
    return f"tick {tick}, {name}: {native[name][tick]!r} natively, {ours[name][tick]!r} in the wheel"


def test_the_wheel_gives_the_same_bits(bits):
    folder, runs, record = bits
    assert sum(ticks for ticks, _, _ in runs.values()) == 1_650_000
    wrong = []
    for name, (ticks, crc, hashed) in runs.items():
        counts = np.fromfile(folder / f"{name}.counts", "<i4")
        assert len(counts) == ticks
        ours = stepped(package.Scenario.load(folder / f"{name}.toml"), counts, record)
        if zlib.crc32(ours.view(np.uint8).reshape(-1, record.itemsize)[:, :hashed].tobytes()) != crc:
            native = np.fromfile(folder / f"{name}.records", record)
            wrong.append(f"{name}: {difference(native, ours)}")
    assert not wrong, "\n".join(wrong)


def test_one_bit_is_found_and_named(bits):
    folder, _, record = bits
    native = np.fromfile(folder / "pd_table_cubic.records", record)
    assert difference(native, native.copy()) is None
    spoiled = native.copy()
    # The lowest bit of a real number: no tolerance would see it.
    spoiled["error_rate"].view("<u4")[31_415] ^= 1
    assert difference(native, spoiled).startswith("tick 31415, error_rate: ")
