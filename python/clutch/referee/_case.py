"""Cases, trajectories, and what an engine has to offer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from clutch import _clutch

__all__ = ["Case", "Engine", "Figure", "Mechanism", "Row", "Signal", "Trajectory", "cases"]


@dataclass(frozen=True)
class Signal:
    """A load or a normal force over time: a sum of terms.

    Each term is ``constant + rate (t - from_s) + amplitude sin 2π(frequency_hz t + phase_turns)`` from ``from_s`` on.
    """

    terms: tuple[dict[str, float], ...]

    def __call__(self, t: float) -> float:
        """Its value at ``t`` s."""
        value = 0.0
        for term in self.terms:
            if t >= term["from_s"]:
                turns = term["frequency_hz"] * t + term["phase_turns"]
                value += term["constant"] + term["rate"] * (t - term["from_s"])
                value += term["amplitude"] * float(np.sin(2 * np.pi * turns))
        return value

    @property
    def corners(self) -> tuple[float, ...]:
        """Times after the start at which a term begins, s."""
        return tuple(sorted({term["from_s"] for term in self.terms} - {0.0}))


@dataclass(frozen=True)
class Row:
    """A place where something rubs.

    Its slip rate is ``joints @ velocities - base_velocity``; its friction is the model ``friction`` with the
    ``parameters`` that a scenario file gives it, times the normal force.
    """

    joints: NDArray[np.float64]
    base_velocity: float
    normal: Signal
    friction: str
    parameters: dict[str, float]

    @property
    def bristled(self) -> bool:
        """True if its friction has a state of its own."""
        return any(key.startswith("stiffness_") for key in self.parameters)


@dataclass(frozen=True)
class Mechanism:
    """``inertia @ a = load(t) - stiffness @ q - damping @ v - sum of joints_i * friction_i``."""

    inertia: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    load: tuple[Signal, ...]
    rows: tuple[Row, ...]

    def applied(self, t: float, q: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """All forces but friction at ``t`` s."""
        load = np.array([signal(t) for signal in self.load])
        return np.asarray(load - self.stiffness @ q - self.damping @ v)

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a load or a normal force jumps or has a corner, s."""
        signals = [*self.load, *(row.normal for row in self.rows)]
        return tuple(sorted({t for signal in signals for t in signal.corners}))


@dataclass
class Trajectory:
    """An engine's result of a case, sampled evenly from t = 0.

    ``position`` and ``velocity`` have a row for each joint; ``torque``, if the engine says it, one for each row of
    friction. ``events`` are ``(time in s, row from 0, holds from then on)``; None for an engine that has no such thing:
    a row then counts as holding while it slips slower than the case's ``still``.
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    torque: NDArray[np.float64] | None = None
    events: Sequence[tuple[float, int, bool]] | None = None
    metrics: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Figure:
    """A measured figure beside the expected one; ``measured`` is None if the trajectory does not have it."""

    name: str
    measured: float | None
    expected: float
    within: float
    unit: str

    @property
    def holds(self) -> bool:
        """True if it is as near as it has to be."""
        return self.measured is not None and abs(self.measured - self.expected) <= self.within


class Case:
    """A case whose answer is known from elsewhere.

    Parameters
    ----------
    text
        Contents of a case file.
    origin
        The beginning of error messages.

    Raises
    ------
    ValueError
        The key, its value, what is expected.

    Examples
    --------
    >>> from clutch import referee
    >>> belt = referee.cases()["A5"]
    >>> [figure.holds for figure in belt.judge(belt.run("system"))]
    [True, True, True, True]
    """

    def __init__(self, text: str, origin: str = "case") -> None:
        self._native = _clutch.RefereeCase(origin, text)
        told: dict[str, Any] = self._native.told()
        self.id: str = told["id"]
        self.title: str = told["title"]
        self.source: str = told["source"]
        self.duration: float = told["duration_s"]
        self.sample: float = told["sample_s"]
        self.still: float | None = told["still"]
        self._samples: int = told["samples"] if told["mechanism"] is not None else 0
        self.mechanism: Mechanism | None = None
        if (m := told["mechanism"]) is not None:
            rows = tuple(
                Row(
                    np.array(row["joints"]),
                    row["base_velocity"],
                    _signal(row["normal"]),
                    row["friction"],
                    row["parameters"],
                )
                for row in m["rows"]
            )
            lists = {key: np.array(m[key]) for key in ("inertia", "stiffness", "damping", "position", "velocity")}
            self.mechanism = Mechanism(**lists, load=tuple(_signal(s) for s in m["load"]), rows=rows)

    def __repr__(self) -> str:
        return f"<Case {self.id}: {self.title}>"

    @property
    def samples(self) -> int:
        """Samples of a trajectory after the first."""
        return self._samples

    def run(self, engine: str, *, step: float | None = None) -> Trajectory:
        """Run the case on an engine of this package.

        Parameters
        ----------
        engine
            ``system``, ``bristled_system``, ``dormand_prince``, ``exact_flow`` or ``bristle``.
        step
            Period in which a shaft engine is asked for the motion, s; none is the time between samples. Systems choose
            their steps themselves, and a scenario has its period: for these it says nothing.

        Raises
        ------
        DoesNotApply
            The engine does not take such a case.
        ValueError
            No such engine, a step that does not divide the sample, or a motion that cannot be followed.
        """
        return Trajectory(*self._native.run(engine, step))

    def judge(self, trajectory: Trajectory) -> list[Figure]:
        """Hold a trajectory against what the case expects.

        Raises
        ------
        ValueError
            A list that has not the length of the case, or a value that is no number.
        """
        t = trajectory
        for i, event in enumerate(t.events or ()):
            if event[1] < 0:
                raise ValueError(f"{self.id}: trajectory.events[{i}]: row {event[1]}: expected a number from 0 on")
        events = None if t.events is None else [(float(a), int(b), bool(c)) for a, b, c in t.events]
        torque = None if t.torque is None else _lists(t.torque)
        figures = self._native.judge(_lists(t.position), _lists(t.velocity), torque, events, t.metrics)
        return [Figure(*figure) for figure in figures]


def _lists(values: NDArray[np.float64]) -> NDArray[np.float64]:
    array = np.atleast_2d(np.asarray(values, dtype=np.float64))
    if array.ndim != 2:
        raise ValueError(
            f"an array of {array.ndim} dimensions: expected a row for each joint, a column for each sample"
        )
    return array


def _signal(terms: list[dict[str, float]]) -> Signal:
    return Signal(tuple(terms))


def cases() -> dict[str, Case]:
    """All built-in cases, by name."""
    return {name: Case(text, name) for name, text in _clutch.referee_cases()}


class Engine(Protocol):
    """An engine of another make: subclass it or not, it only has to look like this."""

    @property
    def name(self) -> str:
        """Its name in a table."""

    @property
    def about(self) -> str:
        """One line: which method, whose, which version."""

    def missing(self) -> str | None:
        """The package that it needs and that is not installed; None if all is there."""

    def refuses(self, case: Case) -> str | None:
        """Reason why it does not take a case; None if it does."""

    def run(self, case: Case) -> Trajectory:
        """The result of a case that it takes."""
