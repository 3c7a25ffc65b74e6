"""Cases on MuJoCo's dry friction (``frictionloss`` of joints and tendons)."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clutch.referee._case import Case, Mechanism, Trajectory
from clutch.referee._fixed_step import OneLevel, frame, missing, refuses_length, substeps, version

__all__ = ["MuJoCo", "MuJoCoLuGre"]

#: A run of more steps is refused.
MOST_STEPS = 200_000
#: Least mass for MuJoCo, kg: it refuses less than 1e-15.
LEAST_MASS = 1e-14

Vector = NDArray[np.float64]


class MuJoCo(OneLevel):
    """MuJoCo with the settings it comes with, in steps of at most 1 ms.

    Each joint of a mechanism is a body on a slide, an inertia between two joints the armature of a tendon. A row of one
    joint is the ``frictionloss`` of that joint, any other that of a fixed tendon; it is written into the model before
    each step, as the normal force changes. MuJoCo has one level of dry friction: it is that of rest unless told
    otherwise. Damping of a joint by itself is the joint's ``damping``, which MuJoCo integrates implicitly; all other
    forces are those at the beginning of a step. A base that moves is at rest in the frame that the run is in.
    """

    kind = "mujoco"

    @property
    def about(self) -> str:
        """One line: which method, whose, which version."""
        what = "frictionloss, default solver and impedance, semi-implicit Euler of at most 1 ms"
        return f"MuJoCo {version('mujoco')}: {what}; {self.told()}"

    def missing(self) -> str | None:
        """The package that is not here."""
        return missing("mujoco")

    def refuses(self, case: Case) -> str | None:
        """Reason why it does not take a case; None if it does."""
        if (why := refuses_length(case, MOST_STEPS)) or (m := case.mechanism) is None:
            return why
        if any(row.bristled for row in m.rows):
            return "its frictionloss has no bristles"
        if any(row.friction not in ("coulomb", "stribeck") for row in m.rows):
            return "its frictionloss is Coulomb's"
        if frame(m) is None:
            return "rows that move against each other have no common frame"
        if _own_inertia(m.inertia).min() <= 0.0:
            return "an inertia between joints that outweighs one of them"
        return None

    def run(self, case: Case) -> Trajectory:
        """The result of a case that it takes."""
        m, base = case.mechanism, frame(case.mechanism) if case.mechanism else None
        if m is None or base is None:
            raise ValueError(f"{case.id}: {self.refuses(case)}")
        plan = _plan(m)
        levels = np.array([row.parameters[self.level] for row in m.rows])

        def friction(model: Any, t: float) -> None:
            for row, (level, place) in zip(m.rows, zip(levels, plan.places, strict=True), strict=True):
                loss = level * max(row.normal(t), 0.0) * abs(place.coefficient)
                (model.tendon_frictionloss if place.tendon else model.dof_frictionloss)[place.index] = loss

        return _simulate(case, m, base, plan.xml, friction, plan.torque)


class MuJoCoLuGre:
    """MuJoCo's own LuGre friction: a passive ``dcmotor`` on the joint that rubs.

    For cases of bristled friction, with a constant normal force and rows of one joint. The exponent of its Stribeck
    curve is 2.
    """

    name = "mujoco_lugre"

    @property
    def about(self) -> str:
        """One line: which method, whose, which version."""
        return f"MuJoCo {version('mujoco')}: LuGre friction of its dcmotor, semi-implicit Euler of at most 1 ms"

    def missing(self) -> str | None:
        """The package that is not here."""
        return missing("mujoco")

    def refuses(self, case: Case) -> str | None:
        """Reason why it does not take a case; None if it does."""
        if (why := refuses_length(case, MOST_STEPS)) or (m := case.mechanism) is None:
            return why
        if any(row.friction != "lugre" for row in m.rows):
            return "its dcmotor has LuGre's friction only"
        if any(row.parameters["stribeck_exponent"] != 2.0 for row in m.rows):
            return "the Stribeck curve of its LuGre friction has the exponent 2"
        if any(np.count_nonzero(row.joints) != 1 for row in m.rows):
            return "a row of several joints"
        if any(term["rate"] or term["amplitude"] or term["from_s"] for row in m.rows for term in row.normal.terms):
            return "a normal force that changes"
        if frame(m) is None or _own_inertia(m.inertia).min() <= 0.0:
            return "an inertia or a base that it cannot have"
        return None

    def run(self, case: Case) -> Trajectory:
        """The result of a case that it takes."""
        m, base = case.mechanism, frame(case.mechanism) if case.mechanism else None
        if m is None or base is None:
            raise ValueError(f"{case.id}: {self.refuses(case)}")
        motors = []
        for row in m.rows:
            p, n = row.parameters, row.normal(0.0)
            i = int(np.flatnonzero(row.joints)[0])
            bristles = n * np.array([p["stiffness_1_rad"], p["damping_s_rad"], p["mu_dynamic"], p["mu_static"]])
            told = " ".join(map(repr, [*bristles.tolist(), p["stribeck_velocity_rad_s"]]))
            # Without a motor constant it has no electrical side left; the resistance only has to be positive.
            gear = float(row.joints[i])
            motors.append(f'<dcmotor joint="j{i}" gear="{gear!r}" input="none" resistance="1" lugre="{told}"/>')
        xml = _xml(m, [], motors)

        def torque(model: Any, data: Any) -> Vector:
            return np.asarray(-np.array(data.actuator_force))

        return _simulate(case, m, base, xml, lambda model, t: None, torque)


@dataclass(frozen=True)
class _Place:
    """The model's place for the friction of a row: a tendon or a joint, and how fast the row slips per rate of it."""

    tendon: bool
    index: int
    coefficient: float


@dataclass(frozen=True)
class _Plan:
    xml: str
    places: tuple[_Place, ...]

    def torque(self, model: Any, data: Any) -> Vector:
        """Friction of each row in the step last taken."""
        mujoco = importlib.import_module("mujoco")
        kinds = {
            int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF): False,
            int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON): True,
        }
        forces = {
            (kinds[int(kind)], int(index)): float(force)
            for kind, index, force in zip(data.efc_type, data.efc_id, data.efc_force, strict=True)
            if int(kind) in kinds
        }
        return np.array([-forces.get((p.tendon, p.index), 0.0) / p.coefficient for p in self.places])


def _own_inertia(inertia: Vector) -> Vector:
    """Inertia of each joint beyond what it shares with others."""
    return np.asarray(2.0 * np.diag(inertia) - np.abs(inertia).sum(axis=1))


def _plan(m: Mechanism) -> _Plan:
    """The model of a mechanism, and where it has the friction of its rows."""
    tendons: list[tuple[Vector, str]] = []
    for i in range(len(m.load)):
        for j in range(i):
            if shared := float(m.inertia[i, j]):
                arms = np.zeros(len(m.load))
                arms[i], arms[j] = 1.0, np.sign(shared)
                tendons.append((arms, f'armature="{abs(shared)!r}"'))
    places: list[_Place] = []
    for row in m.rows:
        moved = np.flatnonzero(row.joints)
        place = _Place(False, int(moved[0]), float(row.joints[moved[0]])) if len(moved) == 1 else None
        if place is None or any(not p.tendon and p.index == place.index for p in places):
            place = _Place(True, len(tendons), 1.0)
            tendons.append((row.joints, ""))
        places.append(place)
    return _Plan(_xml(m, tendons, []), tuple(places))


def _xml(m: Mechanism, tendons: Sequence[tuple[Vector, str]], motors: Sequence[str]) -> str:
    # The armature of a tendon couples joints only along one branch of bodies: between two branches MuJoCo 4.0.0 leaves
    # out what is off the diagonal, and says nothing. Bodies that share inertia are therefore nested, and next to
    # massless, as the mass of a nested body would be carried by those that it hangs on.
    nested = bool(np.count_nonzero(m.inertia - np.diag(np.diag(m.inertia))))
    bodies, ends = "", ""
    for i, own in enumerate(_own_inertia(m.inertia).tolist()):
        mass, armature = (LEAST_MASS, own) if nested else (own, 0.0)
        damping = max(float(m.damping[i, i]), 0.0)
        bodies += (
            f'<body><joint name="j{i}" type="slide" axis="1 0 0" damping="{damping!r}" armature="{armature!r}"/>'
            f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{mass!r} {mass!r} {mass!r}"/>'
        )
        bodies, ends = (bodies, ends + "</body>") if nested else (bodies + "</body>", "")
    fixed = []
    for arms, more in tendons:
        coefficients = "".join(f'<joint joint="j{i}" coef="{float(arms[i])!r}"/>' for i in np.flatnonzero(arms))
        fixed.append(f"<fixed {more}>{coefficients}</fixed>")
    return (
        f'<mujoco><option gravity="0 0 0"/><worldbody>{bodies}{ends}</worldbody>'
        f"<tendon>{''.join(fixed)}</tendon><actuator>{''.join(motors)}</actuator></mujoco>"
    )


def _simulate(case: Case, m: Mechanism, base: Vector, xml: str, friction: Any, torque: Any) -> Trajectory:
    """Run a model through a case."""
    mujoco = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(xml)
    many = substeps(case)
    step = model.opt.timestep = case.sample / many
    # The joints damp by -damping (v - base): the rest of it is for the applied forces.
    native = np.maximum(np.diag(m.damping), 0.0)
    applied = Mechanism(m.inertia, m.stiffness, m.damping - np.diag(native), m.position, m.velocity, m.load, m.rows)
    drag = native * base
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = m.position, m.velocity - base
    position = np.empty((len(m.load), case.samples + 1))
    velocity = np.empty_like(position)
    torques = np.empty((len(m.rows), case.samples + 1))

    def prepare(count: int) -> tuple[Vector, Vector]:
        t = count * step
        q, v = data.qpos + base * t, data.qvel + base
        data.qfrc_applied[:] = applied.applied(t, q, v) - drag
        friction(model, t)
        return q, v

    for count in range(case.samples * many):
        q, v = prepare(count)
        mujoco.mj_step(model, data)
        if count % many == 0:
            at = count // many
            position[:, at], velocity[:, at], torques[:, at] = q, v, torque(model, data)
    position[:, -1], velocity[:, -1] = prepare(case.samples * many)
    mujoco.mj_forward(model, data)
    torques[:, -1] = torque(model, data)
    # It answers a number that is none by a silent start from the beginning.
    bad = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
    if any(data.warning[kind].number for kind in bad):
        raise ArithmeticError("MuJoCo finds the motion unstable")
    return Trajectory(position, velocity, torques)
