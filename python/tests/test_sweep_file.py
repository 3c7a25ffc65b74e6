"""Sweeps into files: the rows of `sweep`, what a kill leaves, and files of other sweeps."""

import csv
import math
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import clutch

GAINS = {"law.pd.kp_v_rad": [500.0, -1.0, 2000.0], "law.pd.kd_v_s_rad": [5.0, 20.0]}


@pytest.fixture
def short():
    return clutch.Scenario.load("pd_2", {"run.duration_s": 0.3, "run.settle_s": 0.1})


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_rows_are_those_of_the_sweep_bit_for_bit_refused_ones_included(short, tmp_path):
    out = tmp_path / "rows.csv"
    told = []
    done = clutch.sweep_to_file(out, short, GAINS, seeds=3, progress=lambda n, of: told.append((n, of)))
    assert (done.path, done.rows, done.total, done.before, done.refused) == (out, 18, 18, 0, 6)
    assert not done.interrupted and told[-1] == (18, 18)
    table = clutch.sweep(short, GAINS, seeds=3, errors="keep").table
    rows = rows_of(out)
    assert list(rows[0]) == table.columns[1:]
    for i, row in enumerate(rows):
        for name, text in row.items():
            expected = table[name][i]
            if name == "error":
                assert text == expected
            elif name == "certified_continuous_time":
                assert text == str(bool(expected)).lower()
            else:
                assert (text == "" and math.isnan(expected)) or float(text) == expected, (i, name)


def test_a_file_that_was_cut_off_anywhere_goes_on_and_is_the_same(short, tmp_path):
    out = tmp_path / "rows.csv"
    clutch.sweep_to_file(out, short, GAINS, metrics=["max_error_rad", "certified_continuous_time"])
    whole = out.read_bytes()
    head = whole.index(b"\n") + 1
    for length in (head, head + 4, whole.index(b"\n", head) + 1, len(whole) - 3, len(whole)):
        out.write_bytes(whole[:length])
        metrics = ["max_error_rad", "certified_continuous_time"]
        with ThreadPoolExecutor(2) as pool:
            done = clutch.sweep_to_file(out, short, GAINS, metrics=metrics, resume=True, executor=pool)
        assert out.read_bytes() == whole and (done.rows, done.refused) == (6, 2), length
    with pytest.raises(FileExistsError, match="resume=True goes on with it"):
        clutch.sweep_to_file(out, short, GAINS)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"parameters": {"law.pd.kp_v_rad": [9.0, 2000.0]}}, "row 0 has other values than this sweep gives it, 9.0"),
        ({"parameters": {"law.pd.kp_v_rad": [500.0]}}, "more rows than this sweep, 1"),
        ({"parameters": {"law.pd.kd_v_s_rad": [1.0, 2.0]}}, "other columns"),
        ({"base": "smc_2", "parameters": {"law": [{"pd": {}}]}}, "other columns"),
        ({"seeds": 2}, "other columns"),
    ],
)
def test_a_file_of_another_sweep_is_refused_and_stays(short, tmp_path, change, match):
    out = tmp_path / "rows.csv"
    parameters = {"law.pd.kp_v_rad": [500.0, 2000.0]}
    clutch.sweep_to_file(out, short, parameters)
    before = out.read_bytes()
    options = {"base": short, "parameters": parameters} | change
    with pytest.raises(ValueError, match=match):
        clutch.sweep_to_file(out, **options, resume=True)
    other = short.override({"rig.delay_ticks": 1})
    with pytest.raises(ValueError, match="is not what this sweep gives"):
        clutch.sweep_to_file(out, other, parameters, resume=True)
    assert out.read_bytes() == before
    with pytest.raises(ValueError, match=r"rows\.xlsx: expected a name that ends with \.csv or \.parquet"):
        clutch.sweep_to_file(tmp_path / "rows.xlsx", short, parameters)
    (tmp_path / "none.csv").write_bytes(b"")
    with pytest.raises(ValueError, match="no header"):
        clutch.sweep_to_file(tmp_path / "none.csv", short, parameters, resume=True)
    (tmp_path / "no_lines.csv").write_bytes(b"x" * 3_000_000)
    with pytest.raises(ValueError, match="a line of more than 1048576 bytes"):
        clutch.sweep_to_file(tmp_path / "no_lines.csv", short, parameters, resume=True)


def test_a_parquet_file_that_is_cut_off_while_it_is_made_is_made_again(short, tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "rows.parquet"
    with monkeypatch.context() as broken:

        def full(self, batch):
            raise OSError("no space left")

        broken.setattr(parquet.ParquetWriter, "write_batch", full)
        with pytest.raises(OSError, match="no space left"):
            clutch.sweep_to_file(out, short, GAINS)
    assert [path.name for path in tmp_path.iterdir()] == ["rows.parquet.part.csv"]
    done = clutch.sweep_to_file(out, short, GAINS, resume=True)
    assert (done.path, done.before, done.rows) == (out, 6, 6)
    assert parquet.read_table(out).num_rows == 6


def test_parquet_has_the_rows_their_kinds_and_units(short, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "rows.parquet"
    choices = {"run.engine": ["auto", "dormand_prince"], "run.seed": [1, 2], "law.pd.kp_v_rad": [1000.0, -1.0]}
    done = clutch.sweep_to_file(out, short, choices, metrics=["max_error_rad", "certified_continuous_time"])
    assert done.path == out and [path.name for path in tmp_path.iterdir()] == ["rows.parquet"]
    table = parquet.read_table(out)
    expected = clutch.sweep(short, choices, metrics=["max_error_rad", "certified_continuous_time"], errors="keep")
    assert table.column("run.engine").to_pylist() == list(expected.table["run.engine"])
    assert table.column("run.seed").to_pylist() == expected.table["run.seed"].tolist()
    found = table.column("max_error_rad").to_pylist()
    assert [x for x in found if x is not None] == [x for x in expected.table["max_error_rad"] if x == x]
    assert table.column("certified_continuous_time").to_pylist()[0] is True
    assert table.schema.field("max_error_rad").metadata[b"units"] == b"rad"
    for told in [table.schema.metadata, expected.to_arrow().schema.metadata]:
        assert clutch.Scenario.from_toml(told[b"scenario.toml"].decode()) == short and told[b"version"]
    with pytest.raises(FileExistsError):
        clutch.sweep_to_file(out, short, choices)


def test_a_sweep_that_is_killed_leaves_its_rows_and_goes_on(tmp_path):
    out = tmp_path / "rows.csv"
    program = (
        "import clutch, sys\n"
        "kp = [500.0 + i for i in range(4000)]\n"
        "clutch.sweep_to_file(sys.argv[1], 'bench_glide_2', {'law.glide.kp_1_s': kp}, metrics='max_error_rad', "
        "resume=len(sys.argv) > 2, threads=1)\n"
    )
    run = subprocess.Popen([sys.executable, "-c", program, str(out)])
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and (not out.exists() or out.read_bytes().count(b"\n") < 50):
        time.sleep(0.05)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    kept = out.read_bytes()
    rows = kept.count(b"\n") - 1
    assert 49 <= rows < 4000
    begun = {"law.glide.kp_1_s": [500.0 + i for i in range(rows + 3)]}
    done = clutch.sweep_to_file(out, "bench_glide_2", begun, metrics="max_error_rad", resume=True)
    assert (done.before, done.rows) == (rows, rows + 3)
    assert out.read_bytes().startswith(kept[: kept.rindex(b"\n") + 1])
