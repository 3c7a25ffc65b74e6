"""Regularised friction models that people compare with: straw men, and labelled as such.

None of them holds a load exactly, or only within a band of velocity. They stand here so that a table shows what each
costs, and are no models of this package. All have the case's coefficients of rest and of sliding.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from clutch.referee._case import Case, Row, Trajectory
from clutch.referee._fixed_step import missing
from clutch.referee._scipy import level, sampled

__all__ = ["Armstrong", "Karnopp", "Makkar", "Tanh"]

_Vector = NDArray[np.float64]
#: Velocity over which friction is smoothed, and half the width of Karnopp's band, rad/s or m/s.
WIDTH = 1e-4
#: Bristle of Armstrong's model: deflection at break-away, rad or m.
DEFLECTION = 1e-5
#: Step of the models with modes, s, and steps after which a run is too long.
STEP, STEPS = 1e-4, 700_000


def _of_sliding(case: Case) -> str | None:
    if case.mechanism is None:
        return "a scenario has an encoder and a law"
    return "friction with bristles" if any(row.bristled for row in case.mechanism.rows) else None


def _rest(row: Row) -> float:
    return row.parameters["mu_static"]


class _Smooth(ABC):
    """Friction as a function of velocity, solved with LSODA."""

    name = ""
    formula = ""

    @property
    def about(self) -> str:
        """Its description."""
        return f"straw man: {self.formula}, v_t = {WIDTH} /s; SciPy's LSODA at 1e-8"

    def missing(self) -> str | None:
        """The package that is not here."""
        return missing("scipy")

    def refuses(self, case: Case) -> str | None:
        """Reason why it does not take a case."""
        if (why := _of_sliding(case)) is not None:
            return why
        return "an hour of a stiff model" if case.duration > 1000 else None

    @abstractmethod
    def coefficient(self, row: Row, slip: float) -> float:
        """Friction over the normal force."""

    def run(self, case: Case) -> Trajectory:
        """Solve the case."""
        m = case.mechanism
        assert m is not None
        n, inverse, joints = len(m.position), np.linalg.inv(m.inertia), np.array([row.joints for row in m.rows])
        base = np.array([row.base_velocity for row in m.rows])

        def rates(t: float, y: _Vector) -> _Vector:
            slip = joints @ y[n:] - base
            rubs = [
                self.coefficient(row, float(w)) * max(row.normal(t), 0.0) for row, w in zip(m.rows, slip, strict=True)
            ]
            force = m.applied(t, y[:n], y[n:]) - joints.T @ np.array(rubs)
            return np.concatenate((y[n:], inverse @ force))

        y = np.concatenate((m.position, m.velocity))
        states = sampled(case, rates, y, rtol=1e-8, atol=np.full(2 * n, 1e-12), longest=case.duration / 50)
        return Trajectory(states[:n], states[n:])


class Tanh(_Smooth):
    """`level(v) tanh(v / v_t)`."""

    name, formula = "tanh", "level(|v|) tanh(v/v_t)"

    def coefficient(self, row: Row, slip: float) -> float:
        """Friction over the normal force."""
        return level(row, abs(slip)) * math.tanh(slip / WIDTH) if row.friction == "stribeck" else _flat(row, slip)


def _flat(row: Row, slip: float) -> float:
    """A level at rest that falls within some widths."""
    low, high = row.parameters["mu_dynamic"], _rest(row)
    return (low + (high - low) * math.exp(-abs(slip) / (10 * WIDTH))) * math.tanh(slip / WIDTH)


class Makkar(_Smooth):
    """Makkar, Dixon, Sawyer, Hu (AIM 2005): three hyperbolic tangents."""

    name, formula = "makkar", "γ1 (tanh v/v_t - tanh v/10v_t) + γ4 tanh v/v_t"

    def coefficient(self, row: Row, slip: float) -> float:
        """Friction over the normal force."""
        low, high = row.parameters["mu_dynamic"], _rest(row)
        hump = math.tanh(slip / WIDTH) - math.tanh(slip / (10 * WIDTH))
        # The hump is 0.78 high at most.
        return (high - low) / 0.78 * hump + low * math.tanh(slip / WIDTH)


class _Modes(ABC):
    """A model with modes, for one joint with one row: fourth-order steps of 0.1 ms, as its users take them."""

    name = ""
    formula = ""

    @property
    def about(self) -> str:
        """Its description."""
        return f"straw man: {self.formula}; Runge and Kutta's steps of {STEP} s"

    def missing(self) -> str | None:
        """The package that is not here."""
        return None

    def refuses(self, case: Case) -> str | None:
        """Reason why it does not take a case."""
        if (why := _of_sliding(case)) is not None:
            return why
        assert case.mechanism is not None
        m = case.mechanism
        if len(m.position) > 1 or len(m.rows) > 1 or m.rows[0].joints[0] != 1.0:
            return "it needs one joint and one row of that joint"
        steps = case.duration / min(STEP, case.sample)
        return f"would take {steps:.0f} steps" if steps > STEPS else None

    @abstractmethod
    def friction(self, x: float, slip: float, normal: float, load: float) -> float:
        """Friction after a way `x` over the base; `load` is all other force."""

    def settled(self, x: float, slip: float, normal: float, load: float) -> float:
        """The slip rate after a step."""
        return slip

    def run(self, case: Case) -> Trajectory:
        """Step through the case."""
        m = case.mechanism
        assert m is not None
        row, inertia = m.rows[0], float(m.inertia[0, 0])
        stiffness, damping = float(m.stiffness[0, 0]), float(m.damping[0, 0])
        q0 = float(m.position[0])
        self.begin(row, q0, m.load[0](0.0) - stiffness * q0, max(row.normal(0.0), 0.0))
        steps = max(round(case.sample / STEP), 1)
        h = case.sample / steps
        q, v, t = float(m.position[0]), float(m.velocity[0]), 0.0
        positions, velocities = [q], [v]
        for k in range(case.samples * steps):
            t = k * h

            def rate(t: float, q: float, v: float) -> float:
                load = m.load[0](t) - stiffness * q - damping * v
                x, slip = q - row.base_velocity * t, v - row.base_velocity
                rubs = self.friction(x, slip, max(row.normal(t), 0.0), load)
                return (load - rubs) / inertia

            a1 = rate(t, q, v)
            a2 = rate(t + h / 2, q + h / 2 * v, v + h / 2 * a1)
            a3 = rate(t + h / 2, q + h / 2 * (v + h / 2 * a1), v + h / 2 * a2)
            a4 = rate(t + h, q + h * (v + h / 2 * a2), v + h * a3)
            q += h * v + h * h / 6 * (a1 + a2 + a3)
            v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            load = m.load[0](t + h) - stiffness * q - damping * v
            x, slip = q - row.base_velocity * (t + h), v - row.base_velocity
            slip = self.settled(x, slip, max(row.normal(t + h), 0.0), load)
            v = slip + row.base_velocity
            if (k + 1) % steps == 0:
                positions.append(q)
                velocities.append(v)
        return Trajectory(np.array([positions]), np.array([velocities]))

    def begin(self, row: Row, q: float, load: float, normal: float) -> None:
        """Begin a run under a load."""
        self.row = row


class Karnopp(_Modes):
    """Karnopp (J. Dyn. Sys. 1985): within a band of velocity, friction balances the load up to its level at rest."""

    name, formula = "karnopp", f"balance within {WIDTH} /s"

    def friction(self, x: float, slip: float, normal: float, load: float) -> float:
        """Friction after a way `x` over the base; `load` is all other force."""
        if abs(slip) < WIDTH:
            most = _rest(self.row) * normal
            return min(max(load, -most), most)
        return math.copysign(level(self.row, abs(slip)) * normal, slip)

    def settled(self, x: float, slip: float, normal: float, load: float) -> float:
        """Within the band, a load that friction bears leaves no slip."""
        return 0.0 if abs(slip) < WIDTH and abs(load) <= _rest(self.row) * normal else slip


class Armstrong(_Modes):
    """Armstrong-Hélouvry, Dupont, Canudas de Wit (Automatica 1994), without memory and dwell: a spring, or sliding."""

    name, formula = "armstrong", f"a spring up to {DEFLECTION}, or sliding"

    def begin(self, row: Row, q: float, load: float, normal: float) -> None:
        """Begin a run with the spring bent by the load that it bears."""
        super().begin(row, q, load, normal)
        most = _rest(self.row) * normal
        self.anchor: float | None = q - DEFLECTION * load / most if abs(load) < most else None
        self.last = 0.0

    def friction(self, x: float, slip: float, normal: float, load: float) -> float:
        """Friction after a way `x` over the base; `load` is all other force."""
        if self.anchor is None:
            return math.copysign(level(self.row, abs(slip)) * normal, slip)
        return _rest(self.row) * normal * (x - self.anchor) / DEFLECTION

    def settled(self, x: float, slip: float, normal: float, load: float) -> float:
        """The spring breaks at its deflection, and is made anew where the slip turns round."""
        if self.anchor is not None and abs(x - self.anchor) > DEFLECTION:
            self.anchor = None
        elif self.anchor is None and slip * self.last < 0:
            self.anchor = x
        self.last = slip
        return slip
