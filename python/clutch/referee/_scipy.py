"""SciPy's solvers on the cases: the reference that shares no code with this package.

Rows without bristles: DOP853 between events, which `solve_ivp` finds; at an event, a bounded least-squares problem
(`scipy.optimize.lsq_linear`) says which rows hold. Rows with bristles: LSODA.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clutch.referee._case import Case, Mechanism, Row, Trajectory
from clutch.referee._fixed_step import missing

__all__ = ["SciPy", "level", "sampled"]

_Vector = NDArray[np.float64]
#: Slip rate that counts as none after an event, relative to the fastest.
_AT_REST = 1e-9
#: Parts of a step in which an event is looked for that comes and goes.
_WITHIN = 4
#: Time after a break-away at which it shows which rows go, s.
_AHEAD = 1e-9


def level(row: Row, speed: float) -> float:
    """Coefficient of friction of steady sliding; at 0, its limit."""
    p = row.parameters
    low = p["mu_dynamic"]
    drop = p.get("mu_static", low) - low
    if row.friction == "coulomb" or drop == 0.0:
        return low
    return low + drop * math.exp(-((speed / p["stribeck_velocity_rad_s"]) ** p["stribeck_exponent"]))


def _at_rest(row: Row) -> float:
    return row.parameters.get("mu_static", row.parameters["mu_dynamic"])


class SciPy:
    """SciPy's `solve_ivp`: DOP853 at 1e-12 with events, LSODA at 1e-10 for bristles."""

    name = "scipy"

    @property
    def about(self) -> str:
        """Version and methods."""
        import scipy

        return f"SciPy {scipy.__version__}: DOP853 with events at 1e-12, LSODA at 1e-10 for bristles"

    def missing(self) -> str | None:
        """The package that is not here."""
        return missing("scipy")

    def refuses(self, case: Case) -> str | None:
        """Reason why it does not take a case."""
        if case.mechanism is None:
            return "a scenario has an encoder and a law"
        if any(row.friction == "maxwell" for row in case.mechanism.rows):
            return "elements beside other rows" if len(case.mechanism.rows) > 1 else None
        kinds = {row.bristled for row in case.mechanism.rows}
        if len(kinds) > 1:
            return "rows with and without bristles"
        known = {"coulomb", "stribeck", "lugre", "dahl", "elasto_plastic"}
        return next((f"friction {r.friction}" for r in case.mechanism.rows if r.friction not in known), None)

    def run(self, case: Case) -> Trajectory:
        """Solve the case."""
        assert case.mechanism is not None
        if case.mechanism.rows[0].friction == "maxwell":
            return _maxwell(case, case.mechanism)
        if case.mechanism.rows[0].bristled:
            return _bristled(case, case.mechanism)
        return _Rigid(case, case.mechanism).run()


def _bristled(case: Case, m: Mechanism) -> Trajectory:
    n, rows = len(m.position), m.rows
    inverse = np.linalg.inv(m.inertia)

    def rub(row: Row, z: float, slip: float, normal: float) -> tuple[float, float]:
        p = row.parameters
        stiffness, damping = p["stiffness_1_rad"], p.get("damping_s_rad", 0.0)
        g = level(row, abs(slip))
        share = 1.0
        if (elastic := p.get("mu_elastic")) is not None:
            bend = stiffness * abs(z)
            if z * slip < 0 or bend <= elastic:
                share = 0.0
            elif bend < g:
                share = 0.5 * (1 + math.sin(math.pi * ((bend - elastic) / (g - elastic) - 0.5)))
        rate = slip - share * stiffness * abs(slip) / g * z
        return rate, (stiffness * z + damping * rate) * normal

    def friction(t: float, y: _Vector) -> tuple[_Vector, _Vector]:
        both = [
            rub(row, y[2 * n + i], float(row.joints @ y[n : 2 * n]) - row.base_velocity, max(row.normal(t), 0.0))
            for i, row in enumerate(rows)
        ]
        return np.array([b[0] for b in both]), np.array([b[1] for b in both])

    joints = np.array([row.joints for row in rows])

    def rates(t: float, y: _Vector) -> _Vector:
        bends, torque = friction(t, y)
        force = m.applied(t, y[:n], y[n : 2 * n]) - joints.T @ torque
        return np.concatenate((y[n : 2 * n], inverse @ force, bends))

    y = np.concatenate((m.position, m.velocity, np.zeros(len(rows))))
    scale = min(_at_rest(row) / row.parameters["stiffness_1_rad"] for row in rows)
    atol = np.concatenate((np.full(n, 1e-9 * scale), np.full(n, 1e-8 * scale), np.full(len(rows), 1e-10 * scale)))
    states = sampled(case, rates, y, rtol=1e-10, atol=atol, longest=_longest(case, m, 50))
    times = np.linspace(0.0, case.duration, case.samples + 1)
    torque = np.array([friction(t, states[:, k])[1] for k, t in enumerate(times)]).T
    return Trajectory(states[:n], states[n : 2 * n], torque)


def _longest(case: Case, m: Mechanism, parts: int) -> float:
    """A step that passes over nothing: of the fastest sine, and of the whole."""
    fastest = max((t["frequency_hz"] for s in m.load for t in s.terms if t["amplitude"]), default=0.0)
    return min(0.02 / fastest if fastest else math.inf, case.duration / parts)


def sampled(
    case: Case,
    rates: Callable[[float, _Vector], _Vector],
    y: _Vector,
    *,
    rtol: float,
    atol: _Vector,
    longest: float,
) -> _Vector:
    """States at the samples of a case by LSODA, begun anew at each corner of a load."""
    from scipy.integrate import solve_ivp

    assert case.mechanism is not None
    times = np.linspace(0.0, case.duration, case.samples + 1)
    states, begin = np.empty((len(y), len(times))), 0.0
    for end in [*(t for t in case.mechanism.corners if t < case.duration), case.duration]:
        inside = (times >= begin - 1e-12) & (times <= end + 1e-12)
        wanted = np.unique(np.append(times[inside].clip(begin, end), end))
        done = solve_ivp(rates, (begin, end), y, "LSODA", wanted, rtol=rtol, atol=atol, max_step=longest)
        if not done.success:
            raise ArithmeticError(f"LSODA gave up: {done.message}")
        states[:, inside] = done.y[:, : int(inside.sum())]
        y, begin = done.y[:, -1], end
    return states


def _maxwell(case: Case, m: Mechanism) -> Trajectory:
    """One row of elements, each of which holds or slides: an event ends each stretch."""
    from scipy.integrate import solve_ivp

    n, row, inverse = len(m.position), m.rows[0], np.linalg.inv(m.inertia)
    p = row.parameters
    shares = {e: p[f"share_{e}"] for e in "abcefgh"}
    shares["d"] = 1 - sum(shares.values())
    # Those that bear something.
    elements = [e for e in sorted(shares) if shares[e] > 1e-9]
    stiff = np.array([p[f"stiffness_{e}_1_rad"] for e in elements])
    share = np.array([shares[e] for e in elements])
    count = len(elements)
    slides = np.zeros(count, dtype=bool)

    def bristles(t: float, y: _Vector) -> tuple[_Vector, float]:
        slip = float(row.joints @ y[n : 2 * n]) - row.base_velocity
        way, g, z = np.sign(slip), level(row, abs(slip)), y[2 * n :]
        sliding = way * np.minimum(p["attraction_1_s"] * (share - stiff * z * way / g) / stiff, abs(slip))
        bends = np.where(slides, sliding, slip)
        mu = float(stiff @ z) + p["damping_s_rad"] * float(share[~slides].sum()) * slip
        return bends, mu * max(row.normal(t), 0.0)

    def rates(t: float, y: _Vector) -> _Vector:
        bends, torque = bristles(t, y)
        force = m.applied(t, y[:n], y[n : 2 * n]) - row.joints * torque
        return np.concatenate((y[n : 2 * n], inverse @ force, bends))

    def spare(element: int, way: int) -> Callable[[float, _Vector], float]:
        def watched(t: float, y: _Vector) -> float:
            slip = float(row.joints @ y[n : 2 * n]) - row.base_velocity
            return float(share[element] * level(row, abs(slip)) - way * stiff[element] * y[2 * n + element])

        return _started(watched, begin)

    def turns(way: int) -> Callable[[float, _Vector], float]:
        return _started(lambda t, y: way * (float(row.joints @ y[n : 2 * n]) - row.base_velocity), begin)

    times = np.linspace(0.0, case.duration, case.samples + 1)
    y, begin, written = np.concatenate((m.position, m.velocity, np.zeros(count))), 0.0, 0
    states, torque = np.empty((len(y), len(times))), np.empty((1, len(times)))
    ends = [*(t for t in m.corners if t < case.duration), case.duration]
    least = float(np.min(share * _at_rest(row) / stiff))
    atol = np.concatenate((np.full(n, 1e-9 * least), np.full(n, 1e-9 * least), np.full(count, 1e-9 * least)))
    while begin < case.duration:
        end = next(t for t in ends if t > begin)
        slip = float(row.joints @ y[n : 2 * n]) - row.base_velocity
        # At rest the motion begins the way that the force goes.
        way = int(np.sign(slip)) or int(np.sign(row.joints @ rates(begin, y)[n : 2 * n])) or 1
        held = [e for e in range(count) if not slides[e]]
        watch = [turns(way)] + [spare(e, way) for e in held]
        done = solve_ivp(rates, (begin, end), y, "LSODA", dense_output=True, events=watch, rtol=1e-10, atol=atol)
        if not done.success:
            raise ArithmeticError(f"LSODA gave up: {done.message}")
        until = float(done.t[-1])
        while written < len(times) and times[written] <= until:
            states[:, written] = done.sol(times[written]) if times[written] < until else done.y[:, -1]
            torque[0, written] = bristles(times[written], states[:, written])[1]
            written += 1
        y, begin = done.y[:, -1], until
        happened = [i for i, at in enumerate(done.t_events) if len(at)]
        if 0 in happened:
            slides[:] = False
        slides[[held[i - 1] for i in happened if i]] = True
    return Trajectory(states[:n], states[n : 2 * n], torque)


class _Rigid:
    """Rows that hold exactly: a mode for each (0 holds, +1 and -1 slip), DOP853 in between."""

    def __init__(self, case: Case, m: Mechanism) -> None:
        self.case, self.m, self.n = case, m, len(m.position)
        self.joints = np.array([row.joints for row in m.rows])
        self.base = np.array([row.base_velocity for row in m.rows])
        self.rest = np.array([_at_rest(row) for row in m.rows])
        self.inverse = np.linalg.inv(m.inertia)
        self.root = np.linalg.inv(np.linalg.cholesky(m.inertia))
        self.modes = np.zeros(len(m.rows), dtype=int)

    def bounds(self, t: float) -> _Vector:
        return np.asarray(self.rest * np.array([max(row.normal(t), 0.0) for row in self.m.rows]))

    def slip(self, v: _Vector) -> _Vector:
        return np.asarray(self.joints @ v - self.base)

    def force(self, t: float, q: _Vector, v: _Vector) -> _Vector:
        """All but what holds."""
        slip = self.slip(v)
        rubs = [
            mode * level(row, max(mode * w, 0.0)) * max(row.normal(t), 0.0) if mode else 0.0
            for row, mode, w in zip(self.m.rows, self.modes, slip, strict=True)
        ]
        return np.asarray(self.m.applied(t, q, v) - self.joints.T @ np.array(rubs))

    def held(self, t: float, force: _Vector, stuck: NDArray[np.bool_]) -> _Vector:
        """Accelerations that stuck rows have left under the best torques within their bounds."""
        from scipy.optimize import lsq_linear

        j, h = self.joints[stuck], self.bounds(t)[stuck]
        torque = np.linalg.lstsq((self.root @ j.T), self.root @ force, rcond=None)[0]
        if (np.abs(torque) > h).any():
            # A bound of 0 leaves nothing to choose.
            free, torque = h > 0, np.zeros(len(h))
            if free.any():
                best = lsq_linear(self.root @ j[free].T, self.root @ force, (-h[free], h[free]), "bvls", tol=1e-15)
                torque[free] = best.x
        return np.asarray(j @ self.inverse @ (force - j.T @ torque))

    def rates(self, t: float, y: _Vector) -> _Vector:
        q, v = y[: self.n], y[self.n :]
        force = self.force(t, q, v)
        if (stuck := self.modes == 0).any():
            j = self.joints[stuck]
            if np.linalg.matrix_rank(j) == self.n:
                return np.asarray(np.concatenate((v, np.zeros(self.n))))
            inner = j @ self.inverse @ j.T
            force = force - j.T @ np.linalg.lstsq(inner, j @ self.inverse @ force, rcond=1e-12)[0]
        return np.concatenate((v, self.inverse @ force))

    def margin(self, t: float, y: _Vector) -> float:
        """Above 0 while friction holds what is stuck."""
        stuck = self.modes == 0
        force = self.force(t, y[: self.n], y[self.n :])
        j, h = self.joints[stuck], self.bounds(t)[stuck]
        torque, _, rank, _ = np.linalg.lstsq((self.root @ j.T), self.root @ force, rcond=None)
        spare = float(np.min(h - np.abs(torque)))
        if spare >= 0 or rank == len(h):
            return spare + 1e-15 * float(np.max(h))
        return 1e-10 * float(np.max(h)) - float(np.max(np.abs(self.held(t, force, stuck))))

    def turns(self, row: int, sign: int) -> Callable[[float, _Vector], float]:
        """Above 0 while a row slips its way."""
        return lambda t, y: sign * float(self.slip(y[self.n :])[row])

    def choose(self, t: float, y: _Vector, crossed: NDArray[np.bool_], ahead: float = 0.0) -> _Vector:
        """Modes at an instant; the state with what holds at rest.

        At a break-away, torque and bound are equal: a look ahead says which rows go.
        """
        slip = self.slip(y[self.n :])
        small = _AT_REST * max(1.0, float(np.max(np.abs(slip))))
        rest = crossed | ((self.modes == 0) & (np.abs(slip) <= small)) | (slip == 0)
        y = self.projected(y, rest)
        slip = self.slip(y[self.n :])
        rest |= np.abs(slip) <= small * _AT_REST
        self.modes = np.where(rest, 0, np.sign(slip)).astype(int)
        for _ in range(len(rest) + 1):
            stuck = self.modes == 0
            if not stuck.any():
                break
            later = y + ahead * np.concatenate((y[self.n :], np.zeros(self.n)))
            force = self.force(t + ahead, later[: self.n], later[self.n :])
            left = self.held(t + ahead, force, stuck)
            most = float(np.max(np.abs(self.inverse @ force))) + 1e-300
            goes = np.abs(left) > 1e-11 * most
            if not goes.any():
                break
            places = np.flatnonzero(stuck)[goes]
            self.modes[places] = np.sign(left[goes]).astype(int)
        return y

    def projected(self, y: _Vector, rest: NDArray[np.bool_]) -> _Vector:
        if not rest.any():
            return y
        j, v = self.joints[rest], y[self.n :]
        by = np.linalg.lstsq(j @ self.inverse @ j.T, j @ v - self.base[rest], rcond=1e-12)[0]
        v = v - self.inverse @ j.T @ by
        if np.linalg.matrix_rank(j) == self.n and not self.base[rest].any():
            v = np.zeros(self.n)
        return np.concatenate((y[: self.n], v))

    def run(self) -> Trajectory:
        from scipy.integrate import solve_ivp

        case, m, n = self.case, self.m, self.n
        times = np.linspace(0.0, case.duration, case.samples + 1)
        states = np.empty((2 * n, len(times)))
        events: list[tuple[float, int, bool]] = []
        y, t, none = np.concatenate((m.position, m.velocity)), 0.0, np.zeros(len(m.rows), dtype=bool)
        y = self.choose(t, y, none)
        longest = _longest(case, m, 20)
        ends = [*(x for x in m.corners if x < case.duration), case.duration]
        written = 0
        while t < case.duration:
            end = next(x for x in ends if x > t)
            slipping = [i for i in range(len(m.rows)) if self.modes[i]]
            watch = [self.turns(i, int(self.modes[i])) for i in slipping]
            if (self.modes == 0).any():
                watch.append(self.margin)
            done = solve_ivp(
                self.rates,
                (t, end),
                y,
                "DOP853",
                dense_output=True,
                events=[_started(event, t) for event in watch] or None,
                rtol=1e-12,
                atol=1e-16,
                max_step=longest,
            )
            if done.status < 0:
                raise ArithmeticError(f"DOP853 gave up: {done.message}")
            until, y = float(done.t[-1]), done.y[:, -1]
            happened = [i for i, at in enumerate(done.t_events or []) if len(at)]
            if (passed := _passed_over(done, watch)) is not None:
                until, which = passed
                y, happened = done.sol(until), [which]
            while written < len(times) and times[written] <= until:
                states[:, written] = done.sol(times[written]) if times[written] < until else y
                written += 1
            t, before = until, self.modes.copy()
            crossed = none.copy()
            crossed[[slipping[i] for i in happened if i < len(slipping)]] = True
            lets_go = any(i >= len(slipping) for i in happened)
            y = self.choose(t, y, crossed, _AHEAD if lets_go else 0.0)
            if written and times[written - 1] == t:
                states[:, written - 1] = y
            # A row that turns round slips on.
            events += [
                (t, int(i), bool(self.modes[i] == 0)) for i in np.flatnonzero((before == 0) != (self.modes == 0))
            ]
        return Trajectory(states[:n], states[n:], None, events)


def _passed_over(done: Any, watch: list[Callable[[float, _Vector], float]]) -> tuple[float, int] | None:
    """Time, and place in the list, of the first event that came and went within a step: the solver sees none."""
    from scipy.optimize import brentq, minimize_scalar

    first: tuple[float, int] | None = None
    for which, event in enumerate(watch):

        def value(t: float, event: Callable[[float, _Vector], float] = event) -> float:
            return event(t, done.sol(t))

        for begin, end in itertools.pairwise(done.t):
            if first is not None and begin >= first[0]:
                break
            grid = np.linspace(begin, end, _WITHIN + 1)
            seen = [value(t) for t in grid]
            for i in range(1, _WITHIN):
                if not (0 < seen[i] <= min(seen[i - 1], seen[i + 1]) or seen[i] <= 0 < seen[i - 1]):
                    continue
                low = grid[i]
                if seen[i] > 0:
                    around = (float(grid[i - 1]), float(grid[i + 1]))
                    low = float(minimize_scalar(value, bounds=around, options={"xatol": 1e-12}).x)
                if value(low) < 0:
                    at = float(brentq(value, grid[i - 1], low, xtol=1e-15))
                    first = (at, which) if first is None or at < first[0] else first
                    break
    # The end that the solver found is no other.
    return first if first is not None and first[0] < done.t[-1] - 1e-12 else None


def _started(event: Callable[[float, _Vector], float], begin: float) -> Callable[[float, _Vector], float]:
    """An event that does not happen at its own start: there a row has just begun to slip."""

    def watched(t: float, y: _Vector) -> float:
        value = event(t, y)
        return max(value, 1e-300) if t == begin else value

    watched.terminal, watched.direction = True, -1  # type: ignore[attr-defined]
    return watched
