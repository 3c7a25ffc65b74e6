"""Cases on Kamino, Newton's solver for constrained bodies, with its friction of joints."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clutch.referee._case import Case, Mechanism, Trajectory
from clutch.referee._fixed_step import Level, OneLevel, frame, missing, refuses_length, substeps, version

__all__ = ["Kamino"]

#: A run of more steps is refused: one takes 2 ms to 3 ms.
MOST_STEPS = 20_000

Vector = NDArray[np.float64]


class Kamino(OneLevel):
    """Newton's SolverKamino with the settings it comes with (PADMM), on the CPU, in steps of at most 1 ms.

    Each joint of a mechanism is a body that slides along one axis. Kamino's friction belongs to a joint between two
    bodies or a body and the world, so a row has to be the rate of one joint or the difference of two, and those have to
    form a tree. It has one level of friction: it is that of rest unless told otherwise. All other forces are those at
    the beginning of a step, damping too: the ``joint_damping`` of Kamino 1.8.0 agrees with theory in steps of 1 ms, but
    is ten times too strong in those of 0.1 ms that A2 takes. A base that moves is at rest in the frame that the run is
    in. Its numbers have 32 bit.
    """

    kind = "kamino"

    @property
    def about(self) -> str:
        """One line: which method, whose, which version."""
        what = "joint friction, default PADMM, 32 bit, at most 1 ms"
        return f"Newton {version('newton')}, Kamino: {what}; {self.told()}"

    def missing(self) -> str | None:
        """The package that is not here."""
        return missing("newton", "warp")

    def refuses(self, case: Case) -> str | None:
        """Reason why it does not take a case; None if it does."""
        if (m := case.mechanism) is None:
            return "a scenario has an encoder and a law"
        if any(row.bristled for row in m.rows):
            return "its joints have no bristles"
        if any(row.friction not in ("coulomb", "stribeck") for row in m.rows):
            return "the friction of its joints is Coulomb's"
        if np.count_nonzero(m.inertia - np.diag(np.diag(m.inertia))):
            return "an inertia between joints"
        if frame(m) is None:
            return "rows that move against each other have no common frame"
        if _tree(m) is None:
            return "rows that are not the joints of a tree of bodies"
        return refuses_length(case, MOST_STEPS)

    def run(self, case: Case) -> Trajectory:
        """The result of a case that it takes."""
        m = case.mechanism
        base, tree = (frame(m), _tree(m)) if m else (None, None)
        if m is None or base is None or tree is None:
            raise ValueError(f"{case.id}: {self.refuses(case)}")
        return _simulate(case, m, base, tree, self.level)


@dataclass(frozen=True)
class _Tree:
    """A joint for each body, parents first: its body, what that hangs on (-1 is the world), its row of friction."""

    bodies: tuple[int, ...]
    parents: tuple[int, ...]
    rows: tuple[int | None, ...]

    def absolute(self) -> Vector:
        """The matrix from the rates of the joints to those of the bodies."""
        matrix = np.zeros((len(self.bodies), len(self.bodies)))
        for joint, (body, parent) in enumerate(zip(self.bodies, self.parents, strict=True)):
            if parent >= 0:
                matrix[body] = matrix[parent]
            matrix[body, joint] = 1.0
        return matrix


def _tree(m: Mechanism) -> _Tree | None:
    """Bodies as the rows join them; None if a row is of another kind or closes a loop."""
    edges: list[tuple[int, int, int]] = []
    for number, row in enumerate(m.rows):
        moved = np.flatnonzero(row.joints)
        if len(moved) == 1:
            edges.append((-1, int(moved[0]), number))
        elif len(moved) == 2 and not row.joints.sum():
            edges.append((int(moved[0]), int(moved[1]), number))
        else:
            return None
    bodies: list[int] = []
    parents: list[int] = []
    rows: list[int | None] = []
    while True:
        reached = [edge for edge in edges if (edge[0] in (-1, *bodies)) or (edge[1] in bodies)]
        if reached:
            edge = reached[0]
            edges.remove(edge)
            parent, body = edge[:2] if edge[0] in (-1, *bodies) else (edge[1], edge[0])
            if body in bodies:
                return None
            row_of: int | None = edge[2]
        else:
            loose = [i for i in range(len(m.load)) if i not in bodies]
            if not loose:
                return _Tree(tuple(bodies), tuple(parents), tuple(rows))
            parent, body, row_of = -1, loose[0], None
        bodies.append(body)
        parents.append(parent)
        rows.append(row_of)


def _simulate(case: Case, m: Mechanism, base: Vector, tree: _Tree, level: Level) -> Trajectory:
    """Run a model through a case."""
    wp: Any = importlib.import_module("warp")
    # Its words on devices and on the kernels that it compiles are no part of a report.
    wp.config.log_level = wp.LOG_ERROR
    newton: Any = importlib.import_module("newton")
    many = substeps(case)
    step = case.sample / many
    absolute = tree.absolute()
    relative = np.linalg.inv(absolute)
    # A row's slip rate is that of the joint times this; a joint that carries none has no friction.
    scale = np.array([1.0 if i is None else float(np.abs(m.rows[i].joints).max()) for i in tree.rows])
    levels = np.array([0.0 if i is None else float(m.rows[i].parameters[level]) for i in tree.rows]) * scale

    with wp.ScopedDevice("cpu"):
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        newton.solvers.SolverKamino.register_custom_attributes(builder)
        builder.begin_world()
        links: dict[int, int] = {-1: -1}
        joints = []
        for body, parent, row in zip(tree.bodies, tree.parents, tree.rows, strict=True):
            mass = float(m.inertia[body, body])
            turning = [mass, 0.0, 0.0, 0.0, mass, 0.0, 0.0, 0.0, mass]
            links[body] = builder.add_link(mass=mass, inertia=turning, lock_inertia=True)
            # Kamino lays out a row of friction where it finds some when it is made; it may be 0 later.
            joints.append(
                builder.add_joint_prismatic(
                    links[parent],
                    links[body],
                    axis=newton.Axis.X,
                    friction=0.0 if row is None else 1.0,
                    damping=0.0,
                    armature=0.0,
                    target_ke=0.0,
                    target_kd=0.0,
                    limit_lower=-np.inf,
                    limit_upper=np.inf,
                    actuator_mode=newton.JointTargetMode.NONE,
                )
            )
        builder.add_articulation(joints)
        builder.end_world()
        model = builder.finalize()
        # Nothing touches. Left alone, Kamino makes room for a thousand contacts and goes through all of it in every
        # step, which takes twenty times as long and changes no figure. With room for none it would guess again.
        model.rigid_contact_max = 1
        model.joint_q.assign((relative @ m.position).astype(np.float32))
        model.joint_qd.assign((relative @ (m.velocity - base)).astype(np.float32))
        now, then, control = model.state(), model.state(), model.control()
        newton.eval_fk(model, model.joint_q, model.joint_qd, now)
        solver = newton.solvers.SolverKamino(model)

        position = np.empty((len(m.load), case.samples + 1))
        velocity = np.empty_like(position)
        for count in range(case.samples * many + 1):
            t = count * step
            # An array of Warp on the CPU shares its memory with that of NumPy.
            q = absolute @ now.joint_q.numpy().astype(np.float64) + base * t
            v = absolute @ now.joint_qd.numpy().astype(np.float64) + base
            if count % many == 0:
                position[:, count // many], velocity[:, count // many] = q, v
            if count == case.samples * many:
                break
            normal = np.array([0.0 if i is None else max(m.rows[i].normal(t), 0.0) for i in tree.rows])
            model.joint_friction.numpy()[:] = levels * normal
            control.joint_f.numpy()[:] = absolute.T @ m.applied(t, q, v)
            solver.step(now, then, control, None, step)
            now, then = then, now
    if not np.isfinite(velocity).all():
        raise ArithmeticError("Kamino's motion is no number")
    return Trajectory(position, velocity)
