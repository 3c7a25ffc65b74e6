"""`clutch.loop`: the session of `clutch loop`, with the same refusals and the same summary."""

import contextlib
import json
import re
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest

import clutch as package

STILL = {"reference": {"hold": {}}, "run.duration_s": 1.5}
SET = [x for s in ("reference={ hold = {} }", "run.duration_s=1.5") for x in ("--set", s)]


def said(done):
    """The refusal of a command, as an exception has it."""
    assert done.stderr.startswith("clutch: "), done.stderr
    return done.stderr.removeprefix("clutch: ").rstrip("\n")


@contextlib.contextmanager
def a_board(clutch, *args):
    """`clutch daq` beside the test: where to connect."""
    process = subprocess.Popen([clutch.binary, "daq", "board_smc_2", *args], stdout=subprocess.PIPE, encoding="utf-8")
    try:
        yield process.stdout.readline().strip()
    finally:
        process.terminate()
        process.communicate()


def test_a_run_to_the_paths_end_is_done_and_its_log_replays(tmp_path):
    log = tmp_path / "run.mcap"
    result = package.loop("board_smc_2", duration=1.5, log=log)
    assert (result.verdict, result.state, result.cause, result.ticks) == ("done", "Holding", "Done", 1500)
    assert result.cause_text == "the path is done" and result.board_safe
    assert result.certified_continuous_time and result.sampled["stable"] and not result.sampled["sticks_excluded"]
    assert result.samples["lost"] == result.bad_frames == result.log_dropped == 0
    assert result.response["count"] == result.ticks and 0 < result.response["p50_us"] <= result.response["max_us"]
    assert result.scenario == package.Scenario.load("board_smc_2", {"run.duration_s": 1.5})
    assert result.log == log and package.replay(log).identical
    written = package.read_log(log)
    assert written.complete and written.metadata["certified_continuous_time"] == "true"
    text = str(result).splitlines()
    assert text[0] == result.scenario.name and text[-1] == "the path is done; the board is in its safe state"
    assert "  gains       certified in continuous time for the bounds given" in result.announcement.splitlines()
    assert repr(result).startswith("<LoopResult 'SMC at 2 °/s on a board': done, 1500 ticks, ")


def test_the_summary_is_the_commands(clutch):
    """On a shaft that stands still every figure of the run is the same each time."""
    command = json.loads(clutch("loop", "board_smc_2", "--json", *SET).stdout)
    result = package.loop("board_smc_2", overrides=STILL)
    ours = {**vars(result), "scenario": result.scenario.name}
    beside = {"scenario", "log", "announcement", "_text", "metrics"}
    assert set(ours) - beside == set(command) - {"scenario", "metrics", "detected"}
    same = "scenario verdict state cause cause_text value certified_continuous_time ticks bad_frames untold log_dropped"
    for name in (*same.split(), "cut_writes", "board_safe", "port_error", "tick_clock_cycles"):
        assert ours[name] == command[name], name
    # Outside of a checkout a build does not know the commit.
    assert command["version"].startswith(ours["version"])
    for name, value in command["metrics"].items():
        # A filter that has all but come to rest.
        assert getattr(result.metrics, name) == (value and pytest.approx(value, rel=1e-9, abs=1e-50)), name
    assert result.samples["lost"] == command["samples"]["lost"] == 0
    for name in ("samples", "response", "cycle"):
        assert ours[name].keys() == command[name].keys()


def test_the_text_is_the_commands_line_by_line(clutch):
    out = clutch("loop", "board_smc_2", *SET).stdout
    result = package.loop("board_smc_2", overrides=STILL)

    def names(text):
        # Without numbers, the port's path, what only a busy machine has to say, and the ends of broken lines.
        lines = [line.split("  ")[1:2] or [line] for line in text.splitlines() if not line.startswith("    ")]
        return [line[0].strip() for line in lines if "waited" not in line[0] and not line[0].startswith("note: ")]

    assert names(f"{result.announcement}\n{result}") == names(out)


def test_the_figures_are_those_of_the_log(tmp_path):
    import numpy as np

    result = package.loop("board_smc_2", duration=2, log=tmp_path / "run.mcap")
    command = package.read_log(result.log).channels["command"]
    law = np.array([source == "Law" for source in command["source"]])
    settled = law & (command["tick"] * 1e-3 >= 1.0)
    error = command["error_rad"][settled]
    assert settled.sum() == 1000
    assert result.metrics.max_error_rad == np.abs(error).max()
    assert result.metrics.rms_error_rad == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    assert result.metrics.detected_stick_slip_cycles_per_s == result.metrics.stick_slip_cycles_per_s


REFUSED = {
    "a port that is not there": (["--port", "/dev/ttyNOTHERE7"], {"port": "/dev/ttyNOTHERE7"}),
    "an address where nobody listens": (["--port", "tcp://127.0.0.1:9"], {"port": "tcp://127.0.0.1:9"}),
    "a file that is no port": (["--port", "/dev/null"], {"port": "/dev/null"}),
}


@pytest.mark.parametrize(("args", "keywords"), REFUSED.values(), ids=REFUSED.keys())
def test_a_refusal_has_the_text_of_the_command(clutch, args, keywords):
    command = said(clutch("loop", "board_smc_2", *args, code=1))
    with pytest.raises(package.LoopError) as caught:
        package.loop("board_smc_2", **keywords)
    assert str(caught.value) == command


def test_gains_that_are_not_certified_are_refused_as_by_the_command(clutch):
    weak = {"law.smc.kp_v": 0.1}
    command = clutch("loop", "board_smc_2", "--set", "law.smc.kp_v=0.1", code=2).stdout
    with pytest.raises(package.LoopError) as caught:
        package.loop("board_smc_2", overrides=weak)
    # The command's lines are those of a terminal.
    refusal = str(caught.value).splitlines()[0]
    assert " ".join(command.split()).startswith(" ".join(refusal.split()))
    assert "uncertified=True runs it all the same" in str(caught.value)
    result = package.loop("board_smc_2", overrides=weak, uncertified=True, duration=1.2)
    assert not result.certified_continuous_time and "NOT certified" in result.announcement


@pytest.mark.parametrize(
    ("scenario", "setting"),
    [("pd_2", None), ("board_smc_2", ("run.duration_s", 0.5)), ("board_smc_2", ("law.smc.kp_v", -1))],
)
def test_a_scenario_that_is_refused_is_a_param_error_with_the_text_of_the_command(clutch, scenario, setting):
    args = ["--set", f"{setting[0]}={setting[1]}"] if setting else []
    command = said(clutch("loop", scenario, *args, code=1))
    with pytest.raises(package.ParamError) as caught:
        package.loop(scenario, overrides=dict([setting]) if setting else None)
    # An error found when it runs begins with the class, as everywhere in the package; the command has the file's name.
    assert str(caught.value).removeprefix("Scenario: ") == command.removeprefix("pd_2: ")
    if setting:
        assert caught.value.field in (setting[0], "run.settle_s")


def test_a_board_that_does_not_fit_is_refused_as_by_the_command(clutch):
    with a_board(clutch, "--patient", "--set", "rig.encoder.counts_per_rev=10000") as port:
        command = said(clutch("loop", "board_smc_2", "--port", port, code=1))
        with pytest.raises(package.LoopError) as caught:
            package.loop("board_smc_2", port=port)
        assert str(caught.value) == command and "the board has 10000" in command
        # It samples and obeys, and closes no loop.
        command = said(clutch("loop", "board_smc_2", "--board", port, code=1))
        with pytest.raises(package.LoopError) as caught:
            package.loop("board_smc_2", board=port)
        assert command.endswith(str(caught.value)) and "use --port instead of --board" in command


def test_the_loop_runs_on_a_board_in_another_process(clutch):
    with a_board(clutch, "--patient") as port:
        result = package.loop("board_smc_2", port=port, patient=True, duration=1.2)
    assert result.verdict == "done" and result.board_waits is None
    assert port in result.announcement


def test_a_log_is_never_written_over(tmp_path):
    log = tmp_path / "run.mcap"
    log.write_text("the only record of a run")
    with pytest.raises(FileExistsError, match="exists already; name a new file for the log"):
        package.loop("board_smc_2", log=log)
    assert log.read_text() == "the only record of a run"


def test_a_fault_is_a_verdict_and_no_exception():
    result = package.loop(duration=2, faults=["loss:at=0.5"])
    assert (result.verdict, result.state, result.cause) == ("fault", "Faulted", "Board")
    assert result.cause_text == "the board sees no encoder" and result.board_safe
    assert 400 <= result.ticks <= 600
    assert str(result).splitlines()[-1] == "FAULT: the board sees no encoder; the board is in its safe state"


def test_python_threads_run_beside_the_loop():
    counted, over = 0, threading.Event()

    def count():
        nonlocal counted
        while not over.is_set():
            counted += 1

    thread = threading.Thread(target=count)
    thread.start()
    try:
        before = counted
        result = package.loop(duration=1.2)
        during = counted - before
    finally:
        over.set()
        thread.join()
    assert result.verdict == "done" and during > 10_000, f"the thread counted to {during} only"


INTERRUPTED = """
import clutch
try:
    clutch.loop("board_smc_2", duration=60, log={log!r})
except KeyboardInterrupt as interrupt:
    print(interrupt.__notes__)
"""


def test_ctrl_c_ends_in_the_safe_state_with_a_whole_log(tmp_path):
    log = tmp_path / "run.mcap"
    running = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED.format(log=str(log))], stdout=subprocess.PIPE, encoding="utf-8"
    )
    deadline = time.monotonic() + 60
    while not (log.exists() and log.stat().st_size > 20_000):
        assert running.poll() is None and time.monotonic() < deadline, "the loop did not get going"
        time.sleep(0.02)
    running.send_signal(signal.SIGINT)
    out, _ = running.communicate(timeout=60)
    assert running.returncode == 0
    assert out == "['stopped by the operator; the board is in its safe state']\n"
    written = package.read_log(log)
    assert written.complete and "Operator" in written.channels["event"]["cause"]
    assert package.replay(written).identical


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"pace": "fast"}, ['pace = "fast"', '"sample" or "clock"']),
        ({"wait": "idle"}, ['wait = "idle"', '"sleep" or "spin"']),
        ({"thread_priority": 120}, ["thread_priority = 120", "0 to 99"]),
        ({"faults": ["melt:at=1"]}, ['fault "melt:at=1"', "kinds: drop"]),
        ({"port": "ttyUSB0"}, ["did you mean /dev/ttyUSB0?"]),
        ({"port": "/dev/ttyS0", "strict": True}, ["expected one of: port; board; strict and faults"]),
        ({"port": "/dev/ttyS0", "board": "/dev/ttyS1"}, ["expected one of"]),
    ],
)
def test_an_option_that_means_nothing_is_a_value_error(keywords, words):
    with pytest.raises(ValueError) as caught:
        package.loop("board_smc_2", **keywords)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_release_test_comes_first_and_ends_what_is_wired_wrongly():
    tested = {"duration": 1.1, "release_test": "always", "release_deg": 0.3}
    with pytest.raises(package.LoopError, match="ahead of the fastest shaft"):
        package.loop(**tested, faults=["scale:at=0,factor=2"])
    result = package.loop(**tested)
    assert result.verdict == "done"
    assert "0 V for 12 periods, at most 0.27°" in result.announcement
    with pytest.raises(ValueError, match='release_test = "maybe": expected "auto" or "always" or "never"'):
        package.loop(release_test="maybe")
    with pytest.raises(package.LoopError, match="release_deg = 11: expected a number above 0 and at most 10 °"):
        package.loop(release_deg=11)


def test_friction_over_load_is_watched_and_may_end_the_run(tmp_path):
    fast = {"reference.ramp.rate_deg_s": 10, "bounds.friction_percent": 10}
    strong = ["dac-scale:at=2,factor=1.25"]
    result = package.loop(
        overrides=fast, duration=30, uncertified=True, faults=strong, on_drift="stop", log=tmp_path / "run.mcap"
    )
    assert result.verdict == "stopped" and result.ended_by_drift
    assert result.cause_text == "stopped as friction over load left the bounds"
    drift = result.drift
    first = drift["first_alarm"]
    assert drift["quantity"] == "friction over load" and drift["alarms"] == 1 and drift["windows"] > 0
    assert 2 < drift["first_alarm_s"] < 6 and first["friction"] > 1.15 and first["least"] > first["high"]
    assert first["low"] == pytest.approx(0.9, abs=2e-3) and first["high"] == pytest.approx(1.1, abs=2e-3)
    assert 0.9 < drift["lowest"] < first["friction"] <= drift["highest"]
    again = package.replay(result.log)
    assert again.identical and again.drift == drift
    event = package.read_log(result.log).channels["event"]
    row = list(event["kind"]).index("Drift")
    assert event["value"][row] == first["friction"]
    assert event["tick"][row] * 1e-3 == pytest.approx(drift["first_alarm_s"])
    assert package.replay(result.log, {"bounds.friction_percent": 40}).drift["alarms"] == 0


def test_a_shaft_that_stands_has_no_friction_to_be_told():
    result = package.loop("board_smc_2", overrides=STILL)
    assert result.drift["last"] is None and result.drift["lowest"] is None and result.drift["alarms"] == 0
    words = "not determined: too little motion without a stand, or hardly a friction beside the damping"
    assert result.drift["words"] == words and not result.ended_by_drift


def test_an_effect_of_a_drift_that_there_is_none_is_refused():
    with pytest.raises(ValueError, match="on_drift"):
        package.loop(on_drift="perhaps")


def test_a_loop_is_seen_in_a_browser(capsys):
    result = package.loop(duration=1.2, live=True)
    printed = capsys.readouterr().out
    assert re.fullmatch(r"live view: http://127\.0\.0\.1:\d+/\?token=[0-9a-f]{32}\n", printed)
    assert (result.verdict, result.gains_changed) == ("done", 0)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(OSError, match=f"live = {port}: no view can be served at this port"):
            package.loop(duration=1.2, live=port)


@pytest.mark.parametrize("port", [-1, 70000])
def test_a_port_that_is_none_is_refused(port):
    with pytest.raises(ValueError, match=f"live = {port}: expected True, False, or a port from 1 to 65535"):
        package.loop(duration=1.2, live=port)
