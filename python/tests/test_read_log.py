"""Logs in Python: export with units, and what hears Ctrl-C."""

import os
import pickle
import signal
import threading
import time
from pathlib import Path

import pytest

import clutch


@pytest.fixture(scope="module")
def smc_log(tmp_path_factory):
    """The log of a simulation of 5 s."""
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    clutch.simulate("smc_2").save(path)
    return path


# --- A channel as Parquet and Arrow --------------------------------------------------------------


@pytest.mark.parametrize("ending", ["parquet", "arrow"])
@pytest.mark.parametrize("channel", ["sample", "command", "truth"])
def test_an_exported_channel_has_every_number_with_its_unit_and_its_meaning(smc_log, tmp_path, channel, ending):
    parquet, ipc = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("pyarrow.ipc")
    log, file = clutch.read_log(smc_log), tmp_path / f"table.{ending}"
    log.export(file, channel)
    table = parquet.read_table(file) if ending == "parquet" else ipc.open_file(file).read_all()
    ours = log.channels[channel]
    assert table.column_names == ours.columns
    for name in ours.columns:
        there, here = table[name].to_pylist(), list(ours[name])
        # Bit for bit: repr distinguishes −0.0 from 0.0, and equals itself for a NaN.
        assert repr(there) == repr([x.item() if hasattr(x, "item") else x for x in here]), name
        metadata = {k.decode(): v.decode() for k, v in (table.schema.field(name).metadata or {}).items()}
        assert metadata == ours.attributes(name), name
    kept = {k.decode(): v.decode() for k, v in table.schema.metadata.items()}
    assert kept["channel"] == channel and kept["law_hash"] == log.metadata["law_hash"]
    assert clutch.Scenario.from_toml(kept["scenario.toml"]) == log.scenario
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("channel", ["sample", "command", "truth"])
def test_the_command_writes_the_same_parquet(smc_log, tmp_path, channel, clutch_with_parquet):
    parquet = pytest.importorskip("pyarrow.parquet")
    ours, its = tmp_path / "ours.parquet", tmp_path / "its.parquet"
    clutch.read_log(smc_log).export(ours, channel)
    clutch_with_parquet("log", "export", smc_log, "--channel", channel, "--out", its)
    ours, its = parquet.read_table(ours), parquet.read_table(its)
    # Names, types, units and meanings of the columns; the log's description of itself.
    assert its.schema.equals(ours.schema, check_metadata=True)
    assert its.schema.metadata == ours.schema.metadata
    assert repr(its.to_pydict()) == repr(ours.to_pydict())


def test_units_and_meanings_of_columns_come_from_the_tables_that_declare_them(smc_log):
    command = clutch.read_log(smc_log).channels["command"]
    rate = {"units": "rad/s", "long_name": "Rate of the error as the law saw it"}
    assert command.attributes("error_rate_rad_s") == rate
    assert command.attributes("time_s") == {"units": "s", "long_name": "time since the start of the run"}
    assert command.to_xarray("time_s")["voltage_v"].attrs == {"units": "V", "long_name": "Voltage of the code"}
    samples = clutch.simulate("smc_2").samples
    assert samples.attributes("error_rad") == {"units": "rad", "long_name": "true error, target less position"}
    described = clutch.Table({"u_v": [1.0]}, meanings={"u_v": "a voltage of mine"})
    assert described.attributes("u_v") == {"units": "V", "long_name": "a voltage of mine"}
    assert pickle.loads(pickle.dumps(described)).attributes("u_v") == described.attributes("u_v")
    with pytest.raises(ValueError, match="meanings: other"):
        clutch.Table({"u_v": [1.0]}, meanings={"other": "none"})
    with pytest.raises(KeyError, match="other"):
        described.attributes("other")


def test_an_export_that_cannot_be_is_refused_and_leaves_nothing(smc_log, tmp_path, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    log = clutch.read_log(smc_log)
    with pytest.raises(ValueError, match=r"clutch log export"):
        log.export(tmp_path / "a.csv")
    with pytest.raises(ValueError, match=r"channel = 'event': expected one with records, sample, command, truth"):
        log.export(tmp_path / "a.parquet", "event")

    def interrupted(table, file, **_):
        Path(file).write_bytes(b"PAR1")
        raise KeyboardInterrupt

    monkeypatch.setattr(parquet, "write_table", interrupted)
    with pytest.raises(KeyboardInterrupt):
        log.export(tmp_path / "a.parquet")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "a.parquet").write_text("mine")
    with pytest.raises(FileExistsError):
        log.export(tmp_path / "a.parquet")
    assert (tmp_path / "a.parquet").read_text() == "mine"


# --- Ctrl-C --------------------------------------------------------------------------------------


def test_a_replay_says_how_many_commands_are_behind_a_gap_and_is_then_not_identical(tmp_path):
    log = tmp_path / "run.mcap"
    clutch.simulate("smc_2").save(log)
    whole = clutch.replay(log)
    assert whole.identical and whole.behind_gap == 0
    damaged = bytearray(log.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    log.write_bytes(damaged)
    found = clutch.replay(log)
    assert found.first is None and not found.identical
    # A part of the log cannot be read: what is behind it can, and is not comparable.
    assert found.behind_gap > 0 and 0 < found.ticks < found.ticks + found.behind_gap < whole.ticks


def test_save_read_and_replay_hear_an_interrupt(tmp_path):
    run = clutch.simulate("bench_smc_2", overrides={"run.duration_s": 250.0})
    whole = tmp_path / "whole.mcap"
    run.save(whole)
    log = clutch.read_log(whole)
    for work in (lambda: run.save(tmp_path / "part.mcap"), lambda: clutch.read_log(whole), lambda: clutch.replay(log)):
        sent = []

        def send(sent=sent):
            sent.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(0.02, send)
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            work()
            timer.join(5.0)  # it was done before: the interrupt comes here, and no time is found
            sent.clear()
        heard = time.monotonic()
        timer.join()
        # Some 30 ms at most on an idle machine.
        assert sent and heard - sent[0] < 1.0
    assert list(tmp_path.iterdir()) == [whole], "half a log is not kept"
