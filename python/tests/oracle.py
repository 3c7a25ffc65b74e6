"""An oracle for the simulator, written from the paper's equations alone.

The plant (1) with friction (2) and a true stuck state is integrated between samples by SciPy's
DOP853; laws, derivative (5), encoder and converter are sampled every period. Nothing here is
taken from the Rust code: method, tolerances and event handling are SciPy's.

Symbols and signs: ``e = target - position``; a positive voltage presses the pad.
"""

import math
from collections import deque
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

PERIOD = 1e-3
RTOL = 1e-12
ATOL = (1e-15, 1e-13)  # rad within one period, rad/s
TURN = 2.0 * math.pi


# --- Drives of the shaft -----------------------------------------------------------------------


@dataclass(frozen=True)
class Weight:
    """A weight on a pulley: ``M g R_p``."""

    mass: float = 0.2
    gravity: float = 9.81
    radius: float = 0.024

    def torque(self, t, position):
        return self.mass * self.gravity * self.radius

    def knots(self, t0, t1):
        return []


@dataclass(frozen=True)
class Spring:
    """``stiffness (rest - position)``, N m/rad and rad."""

    stiffness: float
    rest: float

    def torque(self, t, position):
        return self.stiffness * (self.rest - position)

    def knots(self, t0, t1):
        return []


@dataclass(frozen=True)
class Table:
    """(s, N m) with straight lines between."""

    points: tuple

    def torque(self, t, position):
        return float(np.interp(t, *zip(*self.points, strict=True)))

    def knots(self, t0, t1):
        return [t for t, _ in self.points if t0 < t < t1]


# --- The plant (1), (2) ------------------------------------------------------------------------


@dataclass(frozen=True)
class Plant:
    """Table 1 where nothing else is said."""

    inertia: float = 0.0017
    damping: float = 0.001
    gain: float = 0.14
    mu_s: float = 0.2
    mu_d: float = 0.15
    v_s: float = 0.001
    delta: float = 1.0
    drive: object = Weight()

    def mu(self, speed):
        """(2) without its sign, for a speed along the motion.

        Below zero, where only a trial step beyond the stop looks, the curve goes on smoothly
        (and is cut off far out), so that the stop lies inside a smooth piece.
        """
        ratio = speed / self.v_s
        ratio = max(ratio, -2.0) if self.delta == 1.0 else abs(ratio) ** self.delta
        return self.mu_d + (self.mu_s - self.mu_d) * math.exp(-ratio)

    def holds(self, volts):
        """Torque that a stuck shaft withstands, N m."""
        return self.mu_s * self.gain * max(volts, 0.0)

    def sliding_voltage(self, velocity):
        """Voltage that keeps a velocity, V."""
        return (self.drive.torque(0.0, 0.0) - self.damping * velocity) / (self.mu(abs(velocity)) * self.gain)


@dataclass(frozen=True)
class Brake:
    """Voltage within one period: a first-order lag towards the command, or the command."""

    start: float
    command: float
    lag: float | None = None

    def __call__(self, s):
        if self.lag is None:
            return self.command
        return self.command + (self.start - self.command) * math.exp(-s / self.lag)


def break_away(plant, brake, t0, position, s, period):
    """First instant from ``s`` at which the drive overcomes the stuck pad, or None."""

    def excess(x):
        return abs(plant.drive.torque(t0 + x, position)) - plant.holds(brake(x))

    if excess(s) > 0.0:
        return s
    if brake.lag is None and not isinstance(plant.drive, Table):
        return None
    grid = np.union1d(np.linspace(s, period, 41), [t - t0 for t in plant.drive.knots(t0 + s, t0 + period)])
    for a, b in pairwise(grid):
        if excess(b) > 0.0:
            return brentq(excess, a, b, xtol=1e-18, rtol=1e-15)
    return None


def advance(plant, brake, t0, state, period=PERIOD):
    """One period of motion: (position, velocity, direction) in and out, with the events.

    ``direction`` is 0 while stuck, else the sign of the slip.
    """
    position, velocity, direction = state
    events, s = [], 0.0
    while s < period:
        if direction == 0:
            instant = break_away(plant, brake, t0, position, s, period)
            if instant is None:
                break
            s = instant
            direction = 1 if plant.drive.torque(t0 + s, position) > 0.0 else -1
            events.append(("break-away", t0 + s, position))
        sign, origin = direction, position

        def rate(x, y, sign=sign, origin=origin):
            friction = sign * plant.mu(sign * y[1]) * plant.gain * max(brake(x), 0.0)
            torque = plant.drive.torque(t0 + x, origin + y[0])
            return (y[1], (torque - friction - plant.damping * y[1]) / plant.inertia)

        def stop(x, y):
            return y[1]

        stop.terminal, stop.direction = True, -sign
        # A corner in the driving torque ends a piece: within each, the motion is smooth.
        until = min([t - t0 for t in plant.drive.knots(t0 + s, t0 + period)], default=period)
        until = until if until - s > 1e-12 else period
        piece = solve_ivp(rate, (s, until), (0.0, velocity), method="DOP853", rtol=RTOL, atol=ATOL, events=stop)
        assert piece.status >= 0, piece.message
        s = piece.t[-1]
        position, velocity = origin + piece.y[0, -1], piece.y[1, -1]
        if piece.status == 1:
            velocity = 0.0
            torque = plant.drive.torque(t0 + s, position)
            if abs(torque) <= plant.holds(brake(s)):
                direction = 0
                events.append(("stick", t0 + s, position))
            else:
                direction = 1 if torque > 0.0 else -1
    return (position, velocity, direction), events


# --- The laws ----------------------------------------------------------------------------------


class Law:
    """A law with a memory, ``None`` unless it says otherwise."""

    def start(self, e, rate, target_velocity, applied):
        """The memory before the first tick; ``applied`` is the voltage that the brake has."""
        return

    def after(self, memory, e, demand, volts):
        """The memory after a tick that demanded one voltage and gave another."""
        return memory


@dataclass(frozen=True)
class Pd(Law):
    """(4), with a brake's sign."""

    kp: float = 5000.0
    kd: float = 50.0

    def demand(self, e, rate, target_velocity, memory=None):
        return -(self.kp * e + self.kd * rate)


@dataclass(frozen=True)
class Smc(Law):
    """(31)."""

    kp: float = 3.0
    kd: float = 400.0
    slope: float = 70.0
    boundary: float = 0.1

    def demand(self, e, rate, target_velocity, memory=None):
        surface = self.slope * e + rate

        def sat(x):
            return min(max(x / self.boundary, -1.0), 1.0)

        return -(self.kp * sat(surface) + self.kd * sat(surface * rate) * rate)


@dataclass(frozen=True)
class Ctc(Law):
    """(11) on a path without acceleration, believing in a plant."""

    model: Plant = Plant()
    outer: float = 90.0
    kp: float = 100.0
    kd: float = 0.7

    def demand(self, e, rate, target_velocity, memory=None):
        m, velocity = self.model, target_velocity - rate
        tau = -self.outer * (self.kp * e + self.kd * rate)
        friction = m.drive.torque(0.0, 0.0) + m.inertia * tau - m.damping * velocity
        return friction / (m.mu(abs(velocity)) * m.gain)


@dataclass(frozen=True)
class Pid(Law):
    """Textbook PID whose integral is taken back by what a limit cuts off (Åström and Hägglund 2006).

    The memory is the integral part of the voltage, ``-K_i ∫ e dt`` summed by rectangles.
    """

    kp: float = 1000.0
    ki: float = 10_000.0
    kd: float = 20.0
    tracking: float = 0.05
    lowest: float = 0.0
    highest: float = 10.0

    def start(self, e, rate, target_velocity, applied):
        # The first tick, which adds a rectangle of its own, demands what the brake has.
        return applied + self.kp * e + self.kd * rate + self.ki * PERIOD * e

    def demand(self, e, rate, target_velocity, memory=None):
        return memory - self.ki * PERIOD * e - self.kp * e - self.kd * rate

    def after(self, memory, e, demand, volts):
        cut_off = volts - demand if volts <= self.lowest or volts >= self.highest else 0.0
        integral = memory - self.ki * PERIOD * e + PERIOD / self.tracking * cut_off
        return min(max(integral, self.lowest), self.highest)


# --- Sensor and converter ----------------------------------------------------------------------


@dataclass(frozen=True)
class Encoder:
    """Floors to whole counts."""

    counts_per_turn: int = 20_000

    def read(self, position):
        return math.floor(position * self.counts_per_turn / TURN)

    def angle(self, counts):
        return counts * TURN / self.counts_per_turn


@dataclass(frozen=True)
class Dac:
    """Rounds to the nearest code."""

    bits: int = 12
    lowest: float = -10.0
    highest: float = 10.0

    def code(self, volts):
        codes = 2**self.bits
        x = math.floor((volts - self.lowest) * codes / (self.highest - self.lowest) + 0.5)
        return min(max(x, 0), codes - 1)

    def volts(self, code):
        return self.lowest + code * (self.highest - self.lowest) / 2**self.bits


# --- The closed loop ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Loop:
    """A sampled loop around the plant. ``encoder`` or ``dac`` None: perfect."""

    law: object
    plant: Plant = Plant()
    encoder: Encoder | None = None
    dac: Dac | None = None
    smoothing: float = 0.2
    lowest: float = 0.0
    highest: float = 10.0
    delay: int = 0
    lag: float | None = None
    at_rest: bool = False

    def run(self, target, target_velocity):
        """The loop along a path given at each tick; columns by name, and the events."""
        plant, law, dac = self.plant, self.law, self.dac
        velocity = 0.0 if self.at_rest else target_velocity[0]
        state = (target[0], velocity, 0 if velocity == 0.0 else 1)
        # Held at rest: a quarter above the static limit, which is the sliding voltage at rest.
        actual = (1.25 if self.at_rest else 1.0) * plant.sliding_voltage(velocity)
        waiting = deque([actual] * self.delay)
        rate, last, memory = 0.0, None, None
        rows, events = [], []
        for k, (goal, speed) in enumerate(zip(target, target_velocity, strict=True)):
            position = state[0]
            counts = self.encoder.read(position) if self.encoder else 0
            e = goal - (self.encoder.angle(counts) if self.encoder else position)
            difference = 0.0 if last is None else (e - last) / PERIOD
            rate = (1.0 - self.smoothing) * rate + self.smoothing * difference  # (5)
            if last is None:
                memory = law.start(e, rate, speed, actual)
            last = e
            demand = law.demand(e, rate, speed, memory)
            volts = min(max(demand, self.lowest), self.highest)
            memory = law.after(memory, e, demand, volts)
            code = dac.code(volts) if dac else 0
            volts = dac.volts(code) if dac else volts
            rows.append((k * PERIOD, position, state[1], state[2] == 0, counts, e, rate, code, volts))
            waiting.append(volts)
            brake = Brake(actual, waiting.popleft(), self.lag)
            state, seen = advance(plant, brake, k * PERIOD, state)
            actual = brake(PERIOD)
            events += seen
        names = ("time", "position", "velocity", "stuck", "counts", "error", "rate", "code", "voltage")
        columns = dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True))
        return Result(columns, events)


@dataclass(frozen=True)
class Result:
    """The record of a loop."""

    columns: dict
    events: list

    def __getitem__(self, name):
        return self.columns[name]

    def times(self, kind):
        """Instants of one kind of event, s."""
        return np.array([t for k, t, _ in self.events if k == kind])
