"""Single intervals of the engines against SciPy's DOP853, which shares no code with them.

``python python/tests/intervals.py target/release/examples/intervals 6000`` prints the table of docs/theory.md;
``cargo xtask intervals`` builds the program and calls it. The reference integrates the equation of motion in units of
the Stribeck velocity, with the torque's excess over friction at rest as a number of its own, so that a break-away by
a bit keeps its digits.
"""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

ENGINES = ("exact_flow", "dormand_prince")
KINDS = ("motion", "break-away", "soft break-away")


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

    @property
    def holds(self) -> float:
        """Torque that friction holds at rest, rounded as the program does it: near it each bit counts."""
        return self.mu_static * self.brake_gain * self.volts

    def kind(self) -> str:
        """Purpose of the case: a shaft that moves, one that breaks away, one that just does."""
        if self.velocity != 0 or abs(self.torque) <= self.holds:
            return "motion"
        return "break-away" if abs(self.torque) > self.holds * (1 + 1e-6) else "soft break-away"

    def line(self) -> str:
        return " ".join(repr(float(getattr(self, f.name))) for f in fields(self))


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


def reference(c: Case) -> tuple[float, float]:
    """Position and velocity at the end."""
    unit = c.inertia * c.stribeck_velocity
    brake = c.brake_gain * c.volts
    drag, layer = c.damping / c.inertia, brake * (c.mu_static - c.mu_dynamic) / unit
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
                return [a - drag * s - layer * math.expm1(-max(s, -20)), s]
            return [b - drag * s - layer * math.exp(-min(s, 700)), s]

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


def compare(program: str | Path, engine: str, cases: list[Case], truths: list[tuple[float, float]]) -> dict:
    """Errors by kind, as a share of the fastest speed at an end and of the way at it; refusals; wrong ends."""
    text = "".join(case.line() + "\n" for case in cases)
    done = subprocess.run([program, engine], input=text, capture_output=True, text=True, check=True)
    found = {kind: {"errors": [], "refused": 0, "wrong": 0, "stuck": 0} for kind in KINDS}
    for case, truth, line in zip(cases, truths, done.stdout.splitlines(), strict=True):
        row = found[case.kind()]
        if line.startswith("error"):
            row["refused"] += 1
            continue
        position, velocity = (float(x) for x in line.split()[:2])
        row["wrong"] += (velocity == 0) != (truth[1] == 0)
        if case.velocity == velocity == truth[1] == 0:
            row["stuck"] += 1  # and says nothing of an error
            continue
        # The way that moves: even of a break-away that has only begun, however little that is.
        fastest = max(abs(truth[1]), abs(case.velocity), 1e-12 * case.stribeck_velocity)
        way = abs(position - truth[0]) / (fastest * case.seconds)
        row["errors"].append(max(way, abs(velocity - truth[1]) / fastest))
    return found


def main() -> None:
    program, count = sys.argv[1], int(sys.argv[2])
    print("| range | engine | kind | intervals | not followed | stuck throughout | wrong state", end=" ")
    print("| error: median | 99 % | most |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for extreme, name in ((False, "moderate"), (True, "extreme")):
        rng = np.random.default_rng(1)
        cases = [draw(rng, extreme) for _ in range(count // 2)]
        truths = [reference(case) for case in cases]
        for engine in ENGINES:
            for kind, row in compare(program, engine, cases, truths).items():
                median, most = (f"{np.quantile(row['errors'], q):.1e}" for q in (0.5, 1))
                late = f"{np.quantile(row['errors'], 0.99):.1e}"
                total = len(row["errors"]) + row["refused"] + row["stuck"]
                cells = (name, engine, kind, total, row["refused"], row["stuck"], row["wrong"], median, late, most)
                print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


if __name__ == "__main__":
    main()
