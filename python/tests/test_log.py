"""A log as the public Python packages for MCAP see it: names, units, enums, numbers.

The log is written by the example `write_demo` of clutch-log: ``CLUTCH_LOG_DEMO``, else
``target/release/examples/write_demo``, built with cargo if it is not there.
"""

import math
import os
import subprocess
import zlib
from pathlib import Path

import pytest
from google.protobuf.descriptor import FieldDescriptor
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap_protobuf.decoder import DecoderFactory

ROOT = Path(__file__).resolve().parents[2]
START_NS = 1_700_000_000_000_000_000
TICKS = 1000


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A finished log of one second."""
    path = tmp_path_factory.mktemp("log") / "demo.mcap"
    chosen = os.environ.get("CLUTCH_LOG_DEMO")
    demo = Path(chosen) if chosen else ROOT / "target" / "release" / "examples" / "write_demo"
    if not demo.is_file():
        build = ["cargo", "build", "--quiet", "--release", "-p", "clutch-log", "--example", "write_demo"]
        subprocess.run([*build, "--target-dir", ROOT / "target"], cwd=ROOT, check=True)
    subprocess.run([demo, path, str(TICKS)], check=True, stdout=subprocess.DEVNULL)
    return path


def messages(path, topic):
    """Envelope and decoded message of each record on a topic."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [(m, d) for _, _, m, d in reader.iter_decoded_messages(topics=[topic])]


def test_the_summary_counts_every_channel_and_names_the_run(log):
    with log.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        (scenario,) = reader.iter_attachments()
    counts = {summary.channels[i].topic: n for i, n in summary.statistics.channel_message_counts.items()}
    assert counts == {
        "/sample": TICKS,
        "/command": TICKS,
        "/truth": TICKS,
        "/link": TICKS // 100,
        "/event": 1,
        "/parameters": 2,
    }
    assert all(s.encoding == "protobuf" and s.name.startswith("clutch.") for s in summary.schemas.values())
    run = metadata["clutch"]
    assert (run["law_hash"], run["source"], run["port"]) == ("0123456789abcdef", "simulation", "/dev/ttyUSB0")
    assert (run["scalar"], run["period_us"], run["scenario_name"]) == ("f64", "1000", "demo")
    assert int(run["started_unix_ns"]) == START_NS
    # Each record has a checksum over its name and its other pairs in order, each text behind its length.
    for name, pairs in metadata.items():
        saved = pairs.pop("crc32")
        texts = [name, *(text for pair in sorted(pairs.items()) for text in pair)]
        packed = b"".join(len(t.encode()).to_bytes(4, "little") + t.encode() for t in texts)
        assert int(saved, 16) == zlib.crc32(packed), name
    assert metadata["clutch.extra"] == {"operator": "nobody"}
    assert (scenario.name, scenario.data) == ("scenario.toml", b'name = "demo"\n')
    # A chunk each 100 ms, and one with schemas and parameters.
    assert len(summary.chunk_indexes) == 11
    assert all(c.message_end_time - c.message_start_time < 100_000_000 for c in summary.chunk_indexes)


def test_samples_have_their_numbers_and_the_arrival_by_name(log):
    samples = messages(log, "/sample")
    assert len(samples) == TICKS
    for tick, (envelope, s) in enumerate(samples):
        assert envelope.log_time == envelope.publish_time == START_NS + tick * 1_000_000
        assert envelope.sequence == s.tick == tick
        assert (s.sequence, s.board_time_us, s.counts) == (tick, tick * 1000, tick * 3 - 500)
        assert (s.status, s.age_us, s.lateness_us) == (1, 120, tick % 7)
        assert s.position_rad == 0.25 * (tick * 1e-3) - 0.001
        assert s.Arrival.Name(s.arrival) == ("Missing" if tick % 100 == 99 else "Fresh")


def test_commands_have_units_in_their_names_and_the_laws_own_terms(log):
    commands = messages(log, "/command")
    fields = commands[0][1].DESCRIPTOR.fields
    assert [f.name for f in fields][5:] == [
        "voltage_v",
        "demand_v",
        "target_counts_x65536",
        "target_position_rad",
        "target_velocity_rad_s",
        "target_acceleration_rad_s2",
        "error_rad",
        "error_rate_rad_s",
        "surface_rad_s",
        "equivalent_v",
        "switching_v",
    ]
    assert [f.number for f in fields] == list(range(1, 17)), "a field's number changed"
    doubles = {f.name for f in fields if f.type == FieldDescriptor.TYPE_DOUBLE}
    assert len(doubles) == 10, doubles
    for tick, (_, c) in enumerate(commands):
        t = tick * 1e-3
        assert (c.tick, c.code, c.target_counts_x65536) == (tick, tick % 4096, tick * 3 * 65536)
        assert (c.voltage_v, c.demand_v, c.target_position_rad) == (5.0 * t, 5.0 * t + 0.001, 0.25 * t)
        assert math.copysign(1.0, c.target_acceleration_rad_s2) == -1.0, "−0 became 0"
        assert c.error_rad == pytest.approx(1e-3 * math.sin(6 * t), abs=1e-18)
        assert c.error_rate_rad_s == pytest.approx(6e-3 * math.cos(6 * t), abs=1e-17)
        assert (c.surface_rad_s, c.equivalent_v) == (t, -t)
        assert math.isnan(c.switching_v) if tick == 0 else c.switching_v == 1.0 / t
        assert c.State.Name(c.state) == "Running"
        assert c.Limit.Name(c.limit) == "Unlimited"
        assert c.Source.Name(c.source) == ("Unanswered" if tick % 100 == 99 else "Law")


def test_events_links_truth_and_parameters_are_readable(log):
    ((_, event),) = messages(log, "/event")
    assert (event.tick, event.value) == (500, 42.5)
    assert event.Kind.Name(event.kind) == "StateChange"
    assert (event.State.Name(event.from_state), event.State.Name(event.to_state)) == ("Running", "Holding")
    assert event.Cause.Name(event.cause) == "Jump"
    links = [d for _, d in messages(log, "/link")]
    assert [(x.received, x.lost) for x in links] == [(99 * k, k) for k in range(10)]
    truth = [d for _, d in messages(log, "/truth")]
    assert [d.stuck for d in truth] == [True] * 10 + [False] * (TICKS - 10)
    assert truth[400].position_rad == 0.25 * (400 * 1e-3)
    assert [(d.key, d.value) for _, d in messages(log, "/parameters")] == [
        ("law.kp", "12.5"),
        ("plant.inertia", "0.0042"),
    ]


def test_a_cut_log_is_readable_up_to_its_last_whole_chunk(log, tmp_path):
    whole = log.read_bytes()
    with log.open("rb") as file:
        chunks = sorted(make_reader(file).get_summary().chunk_indexes, key=lambda c: c.chunk_start_offset)
    # Inside the sixth chunk with records: five of 100 ms are whole.
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: chunks[6].chunk_start_offset + chunks[6].chunk_length // 2])
    ticks = []
    with cut.open("rb") as file:
        reader = NonSeekingReader(file, decoder_factories=[DecoderFactory()])
        with pytest.raises(McapError):
            for _, _, _, sample in reader.iter_decoded_messages(topics=["/sample"], log_time_order=False):
                ticks.append(sample.tick)
    assert ticks == list(range(500))
