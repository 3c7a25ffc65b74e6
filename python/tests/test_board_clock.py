"""Boards in real time whose clock is wrong, against the real `clutch loop`: refused before consent, in both roles.

The board shares no code with the product (lying_board.py, docs/wire.md). Its serial number is that of no simulated
board, but where a test gives it one: then its clock may be slow to a half.
"""

import re
import tempfile
import threading
import time
from pathlib import Path

import pytest

import lying_board

WIRE = Path(__file__).resolve().parents[2] / "docs" / "wire.md"
SETTINGS = int(re.search(r"settings, hash `0x([0-9a-f]+)`", WIRE.read_text(encoding="utf-8"))[1], 16)


class RealBoard(lying_board.Board):
    """A board whose time passes with the machine's, at a rate, and which samples at another. Nobody may drive it."""

    def __init__(self, path, time_rate, sample_rate, controller, serial):
        self.stamp, self.serial = None, serial
        super().__init__(lying_board.LIES[0], 1, path)
        self.time_rate, self.period, self.controller = time_rate, lying_board.PERIOD / sample_rate, controller
        self.began, self.asked_at, self.due = time.monotonic(), None, None

    @property
    def time(self):
        """The board's own time, s; of a sample that when it fell due."""
        now = time.monotonic() if self.stamp is None else self.stamp
        return (now - self.began) * self.time_rate

    @time.setter
    def time(self, value):
        """The clock goes by itself."""

    def catch_up(self):
        """Takes the samples that have fallen due: a timer takes them, whatever else there is to do."""
        while self.due is not None and self.due <= time.monotonic():
            self.stamp = self.due
            self.sample()
            self.stamp = None
            self.due += self.period

    def message(self, name, m):
        """The duties of a board; a controller has settings, too."""
        self.catch_up()
        if name == "Discover" and self.controller:
            hello = {"board": self.serial, "boot": 77, "clock_hz": 0, "knots": 256, "state": 0, "run": 0, "config": 0}
            said = {key: m[key] for key in ("nonce", "version", "schema")}
            self.send("ControllerHello", **said, settings=SETTINGS, **hello)
        if name == "Set":
            self.send("Taken", run=m["run"], key=m["key"], value=m["value"])
        elif name == "Configure":
            self.asked_at = time.monotonic()
            super().message(name, m)
            self.due = None if self.controller else self.asked_at
        elif name == "Arm":
            # Consent is all that is asked for here.
            self.armed_at = time.monotonic()
            self.line.close()
            raise EOFError
        else:
            super().message(name, m)

    def go_on(self):
        """A message or a sample, in real time."""
        self.hear(0.1 if self.due is None else max(self.due - time.monotonic(), 0.0))
        self.catch_up()


def meet(clutch, time_rate, sample_rate, controller, serial=4711, options=()):
    """A loop meets a board: the board, and what the loop says."""
    with tempfile.TemporaryDirectory() as folder:
        scenario, port = Path(folder, "clock.toml"), Path(folder, "port")
        text = lying_board.SCENARIO.format(law="smc", rate=20.0, hold=6.7)
        scenario.write_text(text, encoding="utf-8")
        board = RealBoard(port, time_rate, sample_rate, controller, serial)
        thread = threading.Thread(target=board.serve, daemon=True)
        thread.start()
        role = "--board" if controller else "--port"
        arguments = ["loop", scenario, role, f"unix://{port}", "--uncertified", "--thread-priority", "0"]
        done = clutch(*arguments, "--lock-memory", "false", *options, code=None)
        thread.join(10)
    if board.failure:
        raise board.failure
    return board, done


RATES = [1 / 155, 0.5, 0.9, 1.2, 2.0, 12.0]


@pytest.mark.parametrize("rate", RATES)
def test_a_board_whose_timer_alone_is_wrong_is_refused_before_consent(clutch, rate):
    board, done = meet(clutch, 1.0, rate, controller=False)
    assert done.returncode not in (0, 3) and board.armed_at is None, done.stderr
    said = re.search(r"takes ([0-9.]+) samples a second by this machine's clock, expected 1000 to 5 %", done.stderr)
    assert said and "sampling.period_us = 1000" in done.stderr, done.stderr
    assert float(said[1]) == pytest.approx(1000 * rate, rel=0.05, abs=5)


@pytest.mark.parametrize("controller", [False, True])
@pytest.mark.parametrize("rate", [*RATES, 0.0, -1.0])
def test_a_board_whose_time_passes_at_another_rate_is_refused_before_consent(clutch, rate, controller):
    # Its samples come in time, or as its time passes.
    for samples in (1.0, rate) if rate > 0.0 else (1.0,):
        board, done = meet(clutch, rate, samples, controller)
        assert done.returncode not in (0, 3) and board.armed_at is None, done.stderr
        said = re.search(r"the board's time_us passes (-?[0-9.]+) times as fast .* expected 1 to 5 %", done.stderr)
        late = samples == rate and "samples a second" in done.stderr
        assert late or (said and float(said[1]) == pytest.approx(rate, rel=0.05, abs=0.01)), done.stderr


@pytest.mark.parametrize("controller", [False, True])
@pytest.mark.parametrize("drift", [0.99, 1.0, 1.01])
def test_a_board_that_is_right_is_asked_to_drive_soon(clutch, drift, controller):
    board, done = meet(clutch, drift, drift, controller)
    assert board.armed_at is not None, done.stdout + done.stderr
    print(f"consent {1e3 * (board.armed_at - board.asked_at):.0f} ms after the configuration")


@pytest.mark.parametrize("serial", [0, 1])
@pytest.mark.parametrize("rate", [1 / 155, 0.4, 1.2, 12.0])
def test_a_board_that_calls_itself_simulated_is_refused_at_a_rate_that_no_slip_explains(clutch, rate, serial):
    board, done = meet(clutch, 1.0, rate, controller=False, serial=serial)
    assert done.returncode not in (0, 3) and board.armed_at is None, done.stderr
    said = re.search(r"takes ([0-9.]+) samples a second .*, expected 500 to 1050 of one whose serial", done.stderr)
    assert said and float(said[1]) == pytest.approx(1000 * rate, rel=0.05, abs=5), done.stderr


@pytest.mark.parametrize("serial", [0, 1])
@pytest.mark.parametrize("controller", [False, True])
@pytest.mark.parametrize("rate", [0.4, 1.2, 0.0, -1.0])
def test_a_board_that_calls_itself_simulated_is_refused_with_a_time_that_no_slip_explains(
    clutch, rate, controller, serial
):
    board, done = meet(clutch, rate, 1.0, controller, serial)
    assert done.returncode not in (0, 3) and board.armed_at is None, done.stderr
    said = re.search(r"time_us passes (-?[0-9.]+) times as fast .* expected 0.5 to 1.05 of one whose", done.stderr)
    assert said and float(said[1]) == pytest.approx(rate, rel=0.05, abs=0.01), done.stderr


@pytest.mark.parametrize("serial", [0, 1])
@pytest.mark.parametrize("controller", [False, True])
@pytest.mark.parametrize("rate", [0.6, 0.9, 1.0])
def test_a_board_that_calls_itself_simulated_may_slip(clutch, rate, controller, serial):
    board, done = meet(clutch, rate, rate, controller, serial)
    assert board.armed_at is not None, done.stdout + done.stderr


def test_a_clock_that_may_wait_by_an_option_of_the_host_is_not_judged(clutch):
    board, done = meet(clutch, 1.2, 1.2, controller=False, serial=0, options=["--patient"])
    assert board.armed_at is not None, done.stdout + done.stderr
