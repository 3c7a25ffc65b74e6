"""Single intervals of the engines against SciPy's solvers, which share no code with them.

``python python/tests/intervals.py target/release/examples/intervals 6000`` prints the table of docs/theory.md;
``cargo xtask intervals`` builds the program and calls it. The reference integrates the equation of motion in units of
the Stribeck velocity, with the torque's excess over friction at rest as a number of its own, so that a break-away by
a bit keeps its digits. The engine of bristles has LuGre's friction; where that is stiff, LSODA is its reference.
"""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

ENGINES = ("exact_flow", "dormand_prince", "system")
KINDS = ("motion", "break-away", "soft break-away")
# Where friction is higher in motion, rest beyond its level at rest is an equilibrium, and not a stable one.
BRISTLES = ("bristles", "bristles that rise")
# Excess over friction at rest below which a system holds, as a share of that friction: docs/systems.md.
UNSEEN = 2.001e-12
# Error that it allows itself in a step, rad/s: slower than that it may be at rest, or not.
AT_REST = 1e-11
# Errors that docs/theory.md states, section 10.
BOUND = {
    "exact_flow": {"motion": 1e-9, "break-away": 1e-8, "soft break-away": 1e-6},
    "dormand_prince": {"motion": 1e-6, "break-away": 1e-6, "soft break-away": 3e-2},
    "system": {"motion": 1e-7, "break-away": 1e-6, "soft break-away": 3e-2},
    "bristle": dict(zip(BRISTLES, (1e-5, 0.3), strict=True)),
    "dormand_prince, δ": {"motion": 1e-6, "break-away": 1e-5, "soft break-away": 3e-2},
    "system, δ": {"motion": 1e-7, "break-away": 1e-4, "soft break-away": 3e-2},
}


@dataclass(frozen=True)
class Case:
    """A line of the program's input, SI."""

    inertia: float
    damping: float
    mu_static: float
    mu_dynamic: float
    stribeck_velocity: float
    torque: float
    volts: float
    brake_gain: float
    velocity: float
    seconds: float
    exponent: float | None = None
    stiffness: float | None = None
    bristle_damping: float | None = None

    @property
    def holds(self) -> float:
        """Torque that friction holds at rest, rounded as the program does it: near it each bit counts."""
        return self.mu_static * self.brake_gain * self.volts

    def kind(self) -> str:
        """Purpose of the case: a shaft that moves, one that breaks away, one that just does, one on bristles."""
        if self.stiffness is not None:
            return BRISTLES[self.mu_static < self.mu_dynamic]
        if self.velocity != 0 or abs(self.torque) <= self.holds:
            return "motion"
        return "break-away" if abs(self.torque) > self.holds * (1 + 1e-6) else "soft break-away"

    def line(self) -> str:
        numbers = (getattr(self, f.name) for f in fields(self))
        return " ".join(repr(float(x)) for x in numbers if x is not None)

    @property
    def bend(self) -> float:
        """Deflection of bristles at break-away, rad; 0 without."""
        return 0.0 if self.stiffness is None else self.mu_static / self.stiffness


def draw(rng: np.random.Generator, extreme: bool) -> Case:
    """A random interval; a third of them begins with a break-away by 1e-14 to a tenth of the static limit."""

    def log(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    if extreme:
        inertia, v_s, seconds = log(1e-9, 1e3), log(1e-9, 100), log(1e-5, 0.1)
        ratio, drag = log(0.3, 100), log(1e-6, 1e2)
    else:
        inertia, v_s, seconds = log(1e-4, 0.1), log(1e-4, 1), log(1e-4, 1e-2)
        ratio, drag = rng.uniform(1, 2.5), rng.uniform(0, 0.3)
    mu_dynamic, gain, volts = log(0.02, 0.5), log(0.01, 10), log(0.1, 10)
    # The borders that formulas treat by themselves.
    mu_static = mu_dynamic * (1.0 if rng.random() < 0.05 else ratio)
    drag = 0.0 if rng.random() < 0.05 else drag
    holds = mu_static * gain * volts
    if rng.random() < 1 / 3:
        torque, velocity = max(holds * (1 + log(1e-14, 1e-1)), np.nextafter(holds, 1e9)), 0.0
    else:
        torque = rng.uniform(-1, 2) * holds
        # A torque that moves the shaft by a million Stribeck velocities tries nothing but straight lines.
        torque = 0.0 if abs(torque) * seconds > 1e6 * inertia * v_s else torque
        velocity = rng.choice([0.0, log(1e-3, 1e3) * v_s, -log(1e-3, 40) * v_s])
    damping = drag * inertia / seconds
    return Case(inertia, damping, mu_static, mu_dynamic, v_s, torque, volts, gain, float(velocity), seconds)


def with_exponent(rng: np.random.Generator, case: Case) -> Case:
    """The same with a Stribeck exponent of 0.3 to 3; below 1 friction falls infinitely fast from rest."""
    return replace(case, exponent=math.exp(rng.uniform(math.log(0.3), math.log(3))))


def on_bristles(rng: np.random.Generator, case: Case) -> Case:
    """The same with bristles that bend by a hundredth to a hundred times the way at the Stribeck velocity."""
    bend = case.stribeck_velocity * case.seconds * math.exp(rng.uniform(math.log(1e-2), math.log(1e2)))
    stiffness = case.mu_static / bend
    # 0.1 to 1 of critical.
    share = math.exp(rng.uniform(math.log(0.1), 0.0))
    damping = 2 * share * math.sqrt(stiffness * case.inertia / (case.brake_gain * case.volts))
    return replace(case, stiffness=stiffness, bristle_damping=damping)


class Costly(Exception):
    """SciPy takes too long over an interval."""


def reference_on_bristles(c: Case) -> tuple[float, float] | None:
    """Position and velocity at the end, of bristles that are not bent at the begin; None if that costs too much."""
    v_s, bend, normal = c.stribeck_velocity, c.bend, c.brake_gain * c.volts
    asked = 0

    def rate(_: float, state: np.ndarray) -> list[float]:
        nonlocal asked
        asked += 1
        if asked > 300_000:
            raise Costly
        # In units of the Stribeck velocity and of the deflection at break-away.
        speed, z = v_s * state[1], bend * state[2]
        level = c.mu_dynamic + (c.mu_static - c.mu_dynamic) * math.exp(-abs(state[1]))
        bends = speed - c.stiffness * abs(speed) * z / level
        friction = (c.stiffness * z + c.bristle_damping * bends) * normal
        return [state[1], (c.torque - friction - c.damping * speed) / (c.inertia * v_s), bends / bend]

    # Rates of the bristles as they slide, and of the mass on their spring.
    fastest = abs(c.velocity) + (abs(c.torque) + c.holds) * c.seconds / c.inertia
    slides, swings = c.stiffness * fastest / c.mu_dynamic, math.sqrt(c.stiffness * normal / c.inertia)
    method = "LSODA" if max(slides, swings) * c.seconds > 2e3 else "DOP853"
    try:
        with np.errstate(all="ignore"):  # far away in a trial that is refused
            run = solve_ivp(rate, (0, c.seconds), [0.0, c.velocity / v_s, 0.0], method=method, rtol=1e-12, atol=1e-14)
    except Costly:
        return None
    assert run.success, run.message
    return v_s * run.y[0, -1], v_s * run.y[1, -1]


def reference(c: Case) -> tuple[float, float]:
    """Position and velocity at the end."""
    unit = c.inertia * c.stribeck_velocity
    brake = c.brake_gain * c.volts
    drag, layer = c.damping / c.inertia, brake * (c.mu_static - c.mu_dynamic) / unit
    exponent = c.exponent or 1.0
    time, position, velocity = 0.0, 0.0, c.velocity
    sign = 0.0 if velocity == 0 else math.copysign(1, velocity)
    while True:
        if sign == 0:
            if abs(c.torque) <= c.holds:
                return position, 0.0
            sign = math.copysign(1, c.torque)
        excess, drive = (sign * c.torque - c.holds) / unit, (sign * c.torque - brake * c.mu_dynamic) / unit
        start, left = sign * velocity / c.stribeck_velocity, c.seconds - time

        def rate(_: float, state: np.ndarray, a=excess, b=drive) -> list[float]:
            s = state[0]
            if s < 1:  # below 0 only in trials of the solver
                falls = max(s, -20) if exponent == 1 else max(s, 0) ** exponent
                return [a - drag * s - layer * math.expm1(-falls), s]
            return [b - drag * s - layer * math.exp(-min(s**exponent, 700)), s]

        def stop(_: float, state: np.ndarray) -> float:
            return state[0]

        stop.terminal, stop.direction = True, -1
        floor = abs(excess) * 1e-10 * left if start == 0 else 1e-13 * max(1e-6, min(1, start))
        # Below μ_d at rest the layer is stable, and stiff.
        stiff = layer * left < -2e3
        run = solve_ivp(
            rate,
            (0, left),
            [start, 0.0],
            method="Radau" if stiff else "DOP853",
            rtol=1e-12 if stiff else 3e-14,
            atol=min(1e-14, floor),
            events=stop if start > 0 else None,
        )
        assert run.success, run.message
        position += sign * c.stribeck_velocity * run.y[1, -1]
        if run.status == 0:
            return position, sign * c.stribeck_velocity * run.y[0, -1]
        time, velocity, sign = time + run.t[-1], 0.0, 0.0


def compare(program: str | Path, engine: str, cases: Sequence[Case], truths: Sequence[tuple | None]) -> dict:
    """Errors by kind; refusals; shafts that stay stuck; wrong ends; intervals over which SciPy took too long.

    An error is a share of the fastest speed at an end and of the way at it. Systems hold rad and rad/s: theirs is in
    these, and a share above 1.
    """
    text = "".join(case.line() + "\n" for case in cases)
    done = subprocess.run([program, engine], input=text, capture_output=True, text=True, check=True)
    found: dict = {}
    for case, truth, line in zip(cases, truths, done.stdout.splitlines(), strict=True):
        start = {"errors": [], "refused": 0, "stuck": 0, "wrong": 0, "without": 0}
        row = found.setdefault(case.kind(), start)
        if line.startswith("error"):
            row["refused"] += 1
            continue
        if truth is None:
            row["without"] += 1
            continue
        position, velocity = (float(x) for x in line.split()[:2])
        unseen = engine == "system" and case.velocity == 0 and abs(case.torque) <= case.holds * (1 + UNSEEN)
        if case.velocity == velocity == 0 and (truth[1] == 0 or unseen):
            row["stuck"] += 1  # and says nothing of an error
            continue
        # Bristles never stand still.
        slow = AT_REST if engine == "system" else 0.0
        rests = case.stiffness is None and (velocity == 0) != (truth[1] == 0)
        row["wrong"] += rests and max(abs(velocity), abs(truth[1])) > slow
        ends = ((position, truth[0]), (velocity, truth[1]))
        if engine == "system":
            row["errors"].append(max(abs(a - b) / max(1, abs(b)) for a, b in ends))
            continue
        # The motion: of a break-away that has only begun, however little that is; of bristles, what bends them.
        least = max(1e-12 * case.stribeck_velocity, case.bend / case.seconds)
        fastest = max(abs(truth[1]), abs(case.velocity), least)
        way, speed = (abs(a - b) / fastest for a, b in ends)
        row["errors"].append(max(way / case.seconds, speed))
    return found


def beyond(engine: str, kind: str, row: dict) -> str | None:
    """A row's claim, of an engine in `BOUND`, that does not hold; None if all do."""
    most = max(row["errors"], default=0.0)
    if row["wrong"]:
        return f"{engine}, {kind}: {row['wrong']} end in the wrong state"
    return f"{engine}, {kind}: {most:.1e} is above {BOUND[engine][kind]:.0e}" if most > BOUND[engine][kind] else None


def report(
    program: str, name: str, engine: str, cases: Sequence[Case], truths: Sequence[tuple | None], of: str = ""
) -> list[str]:
    """Print a row of the table for each kind of case; claims that do not hold."""
    wrong = []
    for kind, row in compare(program, engine, cases, truths).items():
        total = len(row["errors"]) + row["refused"] + row["stuck"] + row["without"]
        counts = (row["refused"], row["stuck"], row["without"], row["wrong"])
        errors = (f"{np.quantile(row['errors'], q):.1e}" for q in (0.5, 0.99, 1))
        print("| " + " | ".join(str(cell) for cell in (name, engine, kind, total, *counts, *errors)) + " |", flush=True)
        wrong.append(beyond(engine + of, kind, row))
    return [claim for claim in wrong if claim]


def main() -> None:
    program, count = sys.argv[1], int(sys.argv[2])
    print(
        "| range | engine | kind | intervals | not followed | stuck throughout | without reference | wrong state",
        end="",
    )
    print(" | error: median | 99 % | most |\n|" + "---|" * 11)
    wrong = []
    for extreme, name in ((False, "moderate"), (True, "extreme")):
        rng = np.random.default_rng(1)
        cases = [draw(rng, extreme) for _ in range(count // 2)]
        truths = [reference(case) for case in cases]
        for engine in ENGINES:
            wrong += report(program, name, engine, cases, truths)
        if not extreme:  # SciPy takes hours over stiff layers that fall infinitely fast
            rng = np.random.default_rng(3)
            cases = [with_exponent(rng, draw(rng, extreme)) for _ in range(count // 2)]
            truths = [reference(case) for case in cases]
            for engine in ENGINES[1:]:
                wrong += report(program, f"{name}, δ 0.3 … 3", engine, cases, truths, ", δ")
        rng = np.random.default_rng(2)
        cases = [on_bristles(rng, draw(rng, extreme)) for _ in range(count // 2)]
        wrong += report(program, name, "bristle", cases, [reference_on_bristles(case) for case in cases])
    if wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
