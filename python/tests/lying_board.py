"""A board that lies, against the real `clutch loop`: what is found, after which time, and where the shaft rests.

Shaft, encoder, converter and protocol are written from docs/wire.md and Table 1 of the paper and share nothing with
the product. The board's time is its own: it takes a sample, waits for the code that answers it (`clutch loop
--patient`), and moves its shaft by a period. So a trial is the same on a busy machine, and takes a tenth of a second.

    python python/tests/lying_board.py CLUTCH TRIALS [SEED]

prints a table, and fails if a lie that has to be found was not, or too late.
"""

import math
import os
import random
import selectors
import socket
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import wire_decoder as wire

# The paper's shaft, Table 1.
INERTIA, DRIVE, DAMPING, GAIN = 0.0017, 0.047088, 0.001, 0.14
STATIC, KINETIC = 0.2, 0.15
COUNTS = 20_000
PERIOD = 0.001
RATE_DEG_S = 20.0
BOOT, READY, ARMED, RUNNING, STOPPED, FAULTED = range(6)
# docs/wire.md: the reason `Fault` of `Stop`; the kind of `Arm`, and the reason `Boot` for which it is refused.
STOP_FAULT, ARM, REFUSED_BOOT = 2, 3, 16


@dataclass
class Shaft:
    """A disc with a weight on it and a pad against it."""

    position: float = 0.0
    speed: float = 0.0

    def move(self, volts, time_s, steps=10, pad=1.0):
        """Moves under a voltage that presses with a share of its force, by small steps."""
        normal = GAIN * max(volts, 0.0) * pad
        step = time_s / steps
        for _ in range(steps):
            if self.speed <= 0.0 and STATIC * normal >= DRIVE:
                self.speed = 0.0
                continue
            torque = DRIVE - KINETIC * normal - DAMPING * self.speed
            self.speed = max(self.speed + torque / INERTIA * step, 0.0)
            self.position += self.speed * step


@dataclass
class Lie:
    """The words and deeds of a board from an onset on; each takes what is true, and its own memory."""

    name: str
    counts: object = None  # (true counts, those at the onset, memory) -> said
    volts: object = None  # (asked, that at the onset) -> given
    clock: object = None  # (µs since the onset, random) -> said
    boot: int = 0
    pad: object = None  # s since the onset -> share of the pad's force that is left
    found: bool = True
    within_ms: float = 10.0
    beyond_deg: float | None = None  # none: no brake can help
    causes: tuple = field(default=())


def dead_channel(channel):
    """The counts of a decoder one channel of which stays as it is."""

    def level(count):
        return int((count + (0 if channel else 1)) % 4 >= 2)  # of the other channel

    def said(count, onset, memory):
        # An edge of the channel that lives counts to the same place and back again.
        del memory
        return onset + level(count) - level(onset)

    return said


def intermittent(count, onset, memory):
    """Nine periods of ten show the last count that came through."""
    del onset
    if memory["random"].random() < 0.1 or "last" not in memory:
        memory["last"] = count
    return memory["last"]


def dither(count, onset, memory):
    """To and fro by one."""
    del count
    memory["up"] = not memory.get("up", False)
    return onset + int(memory["up"])


LIES = [
    Lie("nothing", found=False),
    Lie("channel A dead", counts=dead_channel(0), beyond_deg=0.25),
    Lie("channel B dead", counts=dead_channel(1), beyond_deg=0.25),
    Lie("encoder frozen", counts=lambda c, o, m: o, beyond_deg=0.25),
    Lie("encoder to and fro by one", counts=dither, beyond_deg=0.25),
    # A period of ten is true, and the law acts on it: 5 of 1000 trials took 11 or 12 ms, the slowest of 4000 15 ms.
    Lie("encoder frozen in nine periods of ten", counts=intermittent, within_ms=20.0, beyond_deg=0.25),
    Lie("counts reversed", counts=lambda c, o, m: 2 * o - c, beyond_deg=0.25),
    Lie("counts doubled", counts=lambda c, o, m: 2 * c - o, within_ms=100.0, beyond_deg=0.25),
    Lie("counts halved", counts=lambda c, o, m: o + (c - o) // 2, found=None, within_ms=1000.0),
    Lie("converter at 0 V", volts=lambda v, o: 0.0, within_ms=15.0),
    Lie("converter stuck where it is", volts=lambda v, o: o, found=None, within_ms=1000.0),
    Lie("converter at half its voltage", volts=lambda v, o: v / 2, found=None, within_ms=1000.0),
    Lie("converter at twice its voltage", volts=lambda v, o: 2 * v, found=None, within_ms=1000.0),
    Lie("converter the wrong way round", volts=lambda v, o: -v, within_ms=15.0),
    Lie("lever broken", pad=lambda t: 0.0, within_ms=15.0),
    Lie("contact lost for 50 ms", pad=lambda t: float(t >= 0.05), within_ms=15.0),
    Lie("oil: a third of the pad's force is left", pad=lambda t: 1 / 3, found=None, within_ms=1000.0),
    Lie("time frozen", clock=lambda t, r: 0, within_ms=60.0, beyond_deg=0.25),
    Lie("time at half its rate", clock=lambda t, r: t // 2, within_ms=150.0, beyond_deg=0.25),
    Lie("time twice as fast", clock=lambda t, r: 2 * t, within_ms=150.0, beyond_deg=0.25),
    Lie("time 12 times as fast", clock=lambda t, r: 12 * t, within_ms=60.0, beyond_deg=0.25),
    Lie("time backwards", clock=lambda t, r: -t, within_ms=60.0, beyond_deg=0.25),
    Lie("time at random", clock=lambda t, r: r.getrandbits(32), within_ms=60.0, beyond_deg=0.25),
    Lie("another power-up in Configured", boot=1, within_ms=0.0),
]

SCENARIO = """\
name = "lies"
[rig]
base = "paper"
[law.{law}]
[reference.ramp]
rate_deg_s = {rate}
[run]
duration_s = 1.0
settle_s = 0.2
start = "rest"
[safety]
reason = "a weight drives the shaft"
[safety.on_fault.hold]
volts_v = {hold}
"""


@dataclass
class Outcome:
    """The course of a trial."""

    code: int | None = None
    text: str = ""
    lied: float | None = None  # s since consent, by the shaft's own time
    ended: float | None = None
    beyond_deg: float | None = None
    hold: float = 0.0  # V


class Board:
    """The board of one trial at a UNIX socket."""

    # A simulated board's, whose clock may wait.
    serial = 0

    def __init__(self, lie, seed, path):
        self.lie, self.random = lie, random.Random(seed)
        self.onset = self.random.uniform(0.25, 0.5)
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(str(path))
        self.listener.listen(1)
        self.listener.settimeout(30)
        self.state, self.run, self.config, self.code = BOOT, 0, 0, 4095
        self.sequence, self.shaft, self.time = 0, Shaft(), 0.0
        self.armed_at = self.answered = self.lied_from = None
        self.memory = {"random": self.random}
        self.outcome, self.received, self.failure = Outcome(), bytearray(), None

    def volts(self):
        """The voltage of the converter."""
        asked = -10.0 + 20.0 * self.code / 4096
        if self.lied_from is None or self.lie.volts is None:
            return asked
        return self.lie.volts(asked, self.lied_from[2])

    def pad(self, later=0.0):
        """The share of its force with which the pad presses, so many seconds from now."""
        if self.lied_from is None or self.lie.pad is None:
            return 1.0
        return self.lie.pad(self.time + later - self.outcome.lied)

    def send(self, name, **fields):
        """Puts a frame on the line."""
        self.line.sendall(wire.encode(name, **fields))

    def sample(self):
        """A period begins: what is true, and what is said."""
        counts = math.floor(self.shaft.position * COUNTS / math.tau)
        micros = round(self.time * 1e6)
        armed = self.armed_at is not None
        if armed and self.lied_from is None and self.time - self.armed_at >= self.onset:
            self.lied_from = (counts, micros, -10.0 + 20.0 * self.code / 4096)
            self.outcome.lied = self.time
        if self.lied_from is not None:
            if self.lie.counts:
                counts = self.lie.counts(counts, self.lied_from[0], self.memory)
            if self.lie.clock:
                micros = self.lied_from[1] + self.lie.clock(micros - self.lied_from[1], self.random)
        self.send(
            "Sample",
            run=self.run,
            sequence=self.sequence,
            time_us=micros % 2**32,
            counts=counts,
            status=self.state,
        )
        self.sequence = (self.sequence + 1) % 2**16

    def hear(self, timeout):
        """The frames that have come."""
        ready = self.poll.select(timeout)
        data = self.line.recv(4096) if ready else None
        if data == b"":
            raise EOFError
        self.received += data or b""
        *frames, rest = bytes(self.received).split(b"\0")
        self.received = bytearray(rest)
        for frame in filter(None, frames):
            try:
                self.message(*wire.parse(frame))
            except wire.FrameError:
                continue

    def message(self, name, m):
        """The duties of a board by docs/wire.md."""
        if name == "Discover":
            hello = {
                "board": self.serial,
                "boot": 77,
                "counts_per_rev": COUNTS,
                "dac_bits": 12,
                "dac_lowest_mv": -10_000,
            }
            hello |= {"dac_highest_mv": 10_000, "period_min_us": 100, "period_max_us": 1_000_000}
            hello |= {"watchdog_max_us": 10_000_000, "boot_code": self.code, "state": self.state}
            hello |= {"started_by": 1, "warnings": 0}
            self.send("Hello", nonce=m["nonce"], version=m["version"], schema=m["schema"], run=0, config=0, **hello)
        elif name == "Configure":
            self.run, self.config, self.state, self.sequence = m["run"], m["config"], READY, 0
            self.safe = m["hold_code"]
            self.send("Configured", run=self.run, config=self.config, boot=77 + self.lie.boot)
        elif name == "Arm" and m["run"] == self.run:
            if m["boot"] != 77:
                self.send("Refused", request=ARM, reason=REFUSED_BOOT, value=0)
                return
            self.state, self.armed_at, self.start = ARMED, self.time, self.shaft.position
            self.send("Armed", run=self.run, config=self.config)
        elif name == "Actuate" and m["run"] == self.run and self.state in (ARMED, RUNNING):
            self.state, self.code, self.answered = RUNNING, m["code"], m["sequence"]
        elif name == "Stop" and m["run"] == self.run:
            if self.state in (ARMED, RUNNING):
                self.make_safe(FAULTED if m["reason"] == STOP_FAULT else STOPPED)
            self.send("Stopped", run=self.run, reason=m["reason"], code=self.code)
        elif name == "Ping":
            self.send("Pong", run=m["run"], nonce=m["nonce"], time_us=round(self.time * 1e6) % 2**32)

    def make_safe(self, state):
        """The safe output, and where the shaft comes to rest under it."""
        self.state, self.code = state, self.safe
        self.outcome.ended = self.time
        path = self.start + math.radians(RATE_DEG_S) * (self.time - self.armed_at)
        rest = Shaft(self.shaft.position, self.shaft.speed)
        for period in range(300):
            rest.move(self.volts(), PERIOD, pad=self.pad(period * PERIOD))
        self.outcome.beyond_deg = math.degrees(rest.position - path)

    def serve(self):
        """Serves one controller to the end."""
        try:
            self.line, _ = self.listener.accept()
            self.poll = selectors.DefaultSelector()
            self.poll.register(self.line, selectors.EVENT_READ)
            while True:
                self.go_on()
        except (EOFError, ConnectionError, TimeoutError):
            pass
        except Exception as error:  # reported by the trial
            self.failure = error
        finally:
            self.listener.close()

    def go_on(self):
        """A period, in its own time; before it is set up, a message."""
        if self.state in (ARMED, RUNNING):
            wanted = self.sequence
            self.sample()
            until = time.monotonic() + 3.0
            while self.state in (ARMED, RUNNING) and self.answered != wanted and time.monotonic() < until:
                self.hear(0.2)
        elif self.state != BOOT:
            self.sample()
            self.hear(0.001)
        else:
            self.hear(1.0)
            return
        self.shaft.move(self.volts(), PERIOD, pad=self.pad())
        self.time += PERIOD


def trial(clutch, lie, seed):
    """A run of `clutch loop` on a board that tells this lie."""
    draw = random.Random(seed * 7919 + 1)
    law, hold = draw.choice(["pd", "ctc", "smc", "pid"]), draw.choice([6.7, 9.99])
    with tempfile.TemporaryDirectory() as folder:
        scenario, port = Path(folder, "lies.toml"), Path(folder, "port")
        scenario.write_text(SCENARIO.format(law=law, rate=RATE_DEG_S, hold=hold), encoding="utf-8")
        board = Board(lie, seed, port)
        thread = threading.Thread(target=board.serve, daemon=True)
        thread.start()
        command = [clutch, "loop", scenario, "--port", f"unix://{port}", "--patient", "--uncertified"]
        command += ["--thread-priority", "0", "--lock-memory", "false"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        thread.join(10)
        if board.failure:
            raise board.failure
    board.outcome.hold = hold
    board.outcome.code, board.outcome.text = done.returncode, done.stdout + done.stderr
    return board.outcome


def wrong(lie, outcome):
    """The fault of an outcome, if it has one."""
    if lie.boot:
        armed = outcome.lied is not None or outcome.ended is not None
        return "it was armed" if armed or outcome.code == 0 else None
    if outcome.code not in (0, 3):
        return f"exit code {outcome.code}: {outcome.text[-400:]}"
    found = outcome.code == 3
    if lie.found is False:
        return "a sound board was called broken" if found else None
    if not found:
        return "not found" if lie.found else None
    took = (outcome.ended - outcome.lied) * 1e3
    if took > lie.within_ms + 1e-6:
        return f"found after {took:.0f} ms instead of {lie.within_ms:.0f} ms"
    # The way to a stop goes with the voltage.
    if lie.beyond_deg is not None and outcome.beyond_deg > (allowed := lie.beyond_deg * 1.2 ** (outcome.hold < 9.0)):
        return f"{outcome.beyond_deg:.3f}° beyond the path instead of {allowed:.2f}°"
    return None


def campaign(clutch, trials, seed=1, workers=None):
    """So many trials, lie after lie; the outcomes of each lie, and what was wrong."""
    runs = [(LIES[n % len(LIES)], seed + n) for n in range(trials)]
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        outcomes = list(pool.map(lambda run: trial(clutch, *run), runs))
    told, failures = {lie.name: [] for lie in LIES}, []
    for (lie, number), outcome in zip(runs, outcomes, strict=True):
        told[lie.name].append(outcome)
        if what := wrong(lie, outcome):
            failures.append(f"{lie.name}, seed {number}: {what}")
    return told, failures


def table(told):
    """The table of docs/safety.md."""
    lines = [
        "| lie | trials | ended | after, at most, ms: median, most | beyond the path, most |",
        "|---|---|---|---|---|",
    ]
    for name, outcomes in told.items():
        ended = [o for o in outcomes if o.code == 3 and o.lied is not None and o.ended is not None]
        times = sorted((o.ended - o.lied) * 1e3 for o in ended)
        stopped = f"{times[len(times) // 2]:.0f}, {times[-1]:.0f}" if times else "–"
        beyond = f"{max(o.beyond_deg for o in ended):.3f}°" if ended else "–"
        refused = sum(o.code not in (0, 3) for o in outcomes)
        count = f"{refused} refused" if refused else len(ended)
        lines.append(f"| {name} | {len(outcomes)} | {count} | {stopped} | {beyond} |")
    return "\n".join(lines)


def main():
    """Prints the table."""
    clutch, trials, *seed = sys.argv[1:]
    told, failures = campaign(clutch, int(trials), int(seed[0]) if seed else 1)
    print(table(told))
    for failure in failures:
        print(failure, file=sys.stderr)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
