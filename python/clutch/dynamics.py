"""The shaft as functions ``(t, x, u, params)``, for python-control and for your own solvers.

The state is ``x = [position rad, velocity rad/s]``, the input ``u = [voltage V]``. This is the rig alone: equation
(1) with its friction and its actuator, without encoder, converter, delay and lag. Friction with bristles appears here
as its steady sliding: the state has no deflection. For bristles use :class:`clutch.Plant`, or the blocks of
:func:`sampled_rig` and :func:`sampled_law`, which are rig and law as ``clutch.simulate`` runs them.
"""

from __future__ import annotations

import copy
import importlib
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from clutch import _clutch
from clutch._extras import needed
from clutch._run import ScenarioLike, as_scenario

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["derivative", "output", "sampled_law", "sampled_rig", "targets", "to_control"]

_Stepped = TypeVar("_Stepped", _clutch.Plant, _clutch.Servo)
_Derivative = Callable[[float, Sequence[float], Sequence[float], Mapping[str, Any] | None], "NDArray[np.float64]"]


def derivative(scenario: ScenarioLike) -> _Derivative:
    """The right-hand side of the shaft's equation of motion (1).

    At rest the acceleration is 0 as long as static friction holds the drive: a held shaft never creeps.

    Parameters
    ----------
    scenario
        Scenario, name of a built-in one, or file. Its rig is used, with its drive and its friction.

    Returns
    -------
    callable
        ``f(t, x, u, params)`` with ``t`` in s, ``x = [rad, rad/s]``, ``u = [V]``; gives
        ``[rad/s, rad/s²]``. The last argument is not used and may be None.

    Raises
    ------
    ParamError
        A scenario that is refused.

    Examples
    --------
    Released, the paper's shaft accelerates by ``M g R_p/J``:

    >>> import clutch.dynamics
    >>> f = clutch.dynamics.derivative("smc_2")
    >>> [round(float(rate), 5) for rate in f(0.0, [0.0, 0.0], [0.0], None)]
    [0.0, 27.69882]

    A quarter above the static limit it rests:

    >>> [float(rate) for rate in f(0.0, [0.0, 0.0], [2.1], None)]
    [0.0, 0.0]
    """
    import numpy as np

    acceleration = as_scenario(scenario)._native.acceleration

    def rate(
        t: float, x: Sequence[float], u: Sequence[float], params: Mapping[str, Any] | None = None
    ) -> NDArray[np.float64]:
        velocity = float(x[1])
        return np.array([velocity, acceleration(float(t), float(x[0]), velocity, float(u[0]))])

    return rate


def output(
    t: float, x: Sequence[float], u: Sequence[float], params: Mapping[str, Any] | None = None
) -> NDArray[np.float64]:
    """The outputs: position and velocity.

    Parameters
    ----------
    t
        Time, s; not used.
    x
        ``[position rad, velocity rad/s]``.
    u
        ``[brake voltage V]``; not used.
    params
        Not used.

    Returns
    -------
    numpy.ndarray
        ``[position rad, velocity rad/s]``.

    Examples
    --------
    >>> import clutch.dynamics
    >>> clutch.dynamics.output(0.0, [0.5, 0.1], [2.0]).tolist()
    [0.5, 0.1]
    """
    import numpy as np

    return np.array(x, dtype=np.float64)


def to_control(scenario: ScenarioLike, *, name: str = "shaft") -> Any:
    """The shaft as a nonlinear system of python-control.

    Good for operating points, linearisation and motion without sticking. Dry friction is discontinuous
    where the velocity changes its sign: a solver with variable steps does not find the instant at which
    the shaft sticks, chatters about it with ever smaller steps, or steps over short inputs. Where the
    shaft may stick, give the solver a small ``max_step``
    (``solve_ivp_kwargs={"max_step": 1e-3}``) and mistrust its result, or use clutch's own engine, which
    locates each stick and break-away: `clutch.simulate`, or `clutch.Plant` step by step.

    Parameters
    ----------
    scenario
        Scenario, name of a built-in one, or file; its rig is used.
    name
        Name of the system.

    Returns
    -------
    control.NonlinearIOSystem
        States and outputs "position" (rad) and "velocity" (rad/s), input "voltage" (V).

    Raises
    ------
    ImportError
        python-control is not installed: ``pip install 'clutch-control[control]'``.
    ParamError
        A scenario that is refused.

    Examples
    --------
    >>> import clutch.dynamics
    >>> shaft = clutch.dynamics.to_control("smc_2")
    >>> shaft.state_labels, shaft.input_labels
    (['position', 'velocity'], ['voltage'])
    """
    return _control("to_control").nlsys(
        derivative(scenario),
        output,
        name=name,
        states=["position", "velocity"],
        inputs=["voltage"],
        outputs=["position", "velocity"],
    )


def _control(by: str) -> Any:
    """The module of python-control."""
    with needed("control", f"clutch.dynamics.{by}"):
        return importlib.import_module("control")


#: Moments that a block remembers; a response needs the last one and the first.
_MOMENTS = 1024


class _Moments(Generic[_Stepped]):
    """Copies of something stepped, each under a number: the state of a block.

    A block of python-control must not change when it is asked: the same state and input give the same next state. So a
    state is the number of a moment, 0 for the first, and a step makes a new one.
    """

    def __init__(self, name: str, first: _Stepped) -> None:
        self._name = name
        self._first: _Stepped = first
        self._later: dict[int, _Stepped] = {}
        self._steps: dict[tuple[int, tuple[float, ...]], int] = {}
        self._numbers = itertools.count(1)

    def at(self, x: NDArray[np.float64]) -> tuple[int, _Stepped]:
        """The moment of a state; not to be stepped itself."""
        number = float(x[0])
        if number == 0:
            return 0, self._first
        moment = self._later.get(int(number)) if number.is_integer() else None
        if moment is None:
            expected = f"0, the beginning, or one of the last {_MOMENTS} states of a response"
            raise ValueError(f"{self._name}: state {number}: expected {expected}")
        return int(number), moment

    def after(self, x: NDArray[np.float64], u: NDArray[np.float64], step: Callable[[_Stepped], object]) -> list[float]:
        """The state a period later."""
        number, moment = self.at(x)
        done = (number, tuple(map(float, u)))
        if done not in self._steps:
            following = copy.copy(moment)
            step(following)
            new = self._steps[done] = next(self._numbers)
            self._later[new] = following
            if len(self._later) > _MOMENTS:
                old = next(iter(self._later))
                del self._later[old]
                self._steps.pop(next(key for key, made in self._steps.items() if made == old))
        return [float(self._steps[done])]


def sampled_rig(scenario: ScenarioLike, *, name: str = "rig") -> Any:
    """The rig behind its converter and its encoder, as a discrete block of python-control over the exact engine.

    A step is a sampling period: stick, break-away, friction with bristles, rounding, delay and lag are those of
    :func:`clutch.simulate`, and the response is its response, bit for bit. The voltage acts from its sample on.

    The only state is the number of a moment, 0 for the scenario's start: the shaft's own state is in outputs, and a
    linearisation by differences is none. A block remembers its first moment and its last 1024.

    Parameters
    ----------
    scenario
        Scenario, name of a built-in one, or file; its rig, sampling, start and seed are used.
    name
        Name of the system.

    Returns
    -------
    control.NonlinearIOSystem
        With ``dt`` the sampling period. Input "voltage" (V); outputs "counts" (of the encoder), "position" (rad),
        "velocity" (rad/s) and "stuck" (1 at rest).

    Raises
    ------
    ImportError
        python-control is not installed: ``pip install 'clutch-control[control]'``.
    ParamError
        A scenario that is refused.

    Examples
    --------
    Far above what holds it, the shaft stops, and rests:

    >>> import clutch.dynamics, control, numpy as np
    >>> rig = clutch.dynamics.sampled_rig("smc_2")
    >>> time = rig.dt * np.arange(100)
    >>> response = control.input_output_response(rig, time, np.full(100, 5.0))
    >>> response.outputs[3, -1].item(), response.outputs[2, -1].item()
    (1.0, 0.0)
    """
    given = as_scenario(scenario)
    moments = _Moments(name, _clutch.Plant(given))

    def rate(t: float, x: NDArray[np.float64], u: NDArray[np.float64], params: object = None) -> list[float]:
        return moments.after(x, u, lambda plant: plant.step(float(u[0])))

    def seen(t: float, x: NDArray[np.float64], u: NDArray[np.float64], params: object = None) -> list[float]:
        plant = moments.at(x)[1]
        return [float(plant.counts), plant.position, plant.velocity, float(plant.stuck)]

    return _control("sampled_rig").nlsys(
        rate,
        seen,
        name=name,
        states=["moment"],
        inputs=["voltage"],
        outputs=["counts", "position", "velocity", "stuck"],
        dt=given.sampling.period_us * 1e-6,
    )


def sampled_law(scenario: ScenarioLike, *, name: str = "law") -> Any:
    """The law of a scenario, as a discrete block of python-control: the servo that the simulator and the boards run.

    It answers a sample at once: the voltage depends on the counts of the same period. Its state is the number of a
    moment, as that of :func:`sampled_rig`.

    Parameters
    ----------
    scenario
        Scenario, name of a built-in one, or file; its law, gains, sampling, encoder and converter are used.
    name
        Name of the system.

    Returns
    -------
    control.NonlinearIOSystem
        With ``dt`` the sampling period. Inputs "counts" (of the encoder), and the path's "target_counts",
        "target_velocity" (rad/s) and "target_acceleration" (rad/s²), which :func:`targets` gives; output "voltage" (V).

    Raises
    ------
    ImportError
        python-control is not installed: ``pip install 'clutch-control[control]'``.
    ParamError
        A scenario that is refused.

    Examples
    --------
    Rig and law closed, see docs/python/control.md. The law alone, with the shaft where the path is:

    >>> import clutch, clutch.dynamics, control, numpy as np
    >>> law = clutch.dynamics.sampled_law("pd_2")
    >>> time, targets = clutch.dynamics.targets("pd_2")
    >>> response = control.input_output_response(law, time[:50], [np.floor(targets[0, :50]), *targets[:, :50]])
    >>> response.outputs.size
    50
    """
    given = as_scenario(scenario)
    moments = _Moments(name, _clutch.Servo(given))

    def answer(servo: _clutch.Servo, u: NDArray[np.float64]) -> float:
        counts, *target = map(float, u)
        return servo.step(counts, _clutch.Target(*target))

    def rate(t: float, x: NDArray[np.float64], u: NDArray[np.float64], params: object = None) -> list[float]:
        return moments.after(x, u, lambda servo: answer(servo, u))

    def voltage(t: float, x: NDArray[np.float64], u: NDArray[np.float64], params: object = None) -> list[float]:
        return [answer(copy.copy(moments.at(x)[1]), u)]

    return _control("sampled_law").nlsys(
        rate,
        voltage,
        name=name,
        states=["moment"],
        inputs=["counts", "target_counts", "target_velocity", "target_acceleration"],
        outputs=["voltage"],
        dt=given.sampling.period_us * 1e-6,
    )


def targets(scenario: ScenarioLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The path of a scenario, as the inputs of :func:`sampled_law`.

    Parameters
    ----------
    scenario
        Scenario, name of a built-in one, or file.

    Returns
    -------
    time : numpy.ndarray
        Time of each sample, s, shape (N,).
    targets : numpy.ndarray
        Target position (counts), velocity (rad/s) and acceleration (rad/s²), shape (3, N).

    Raises
    ------
    ParamError
        A scenario that is refused.

    Examples
    --------
    >>> import clutch.dynamics
    >>> time, targets = clutch.dynamics.targets("smc_2")
    >>> time.shape, targets.shape
    ((5000,), (3, 5000))
    """
    import numpy as np

    given = as_scenario(scenario)
    path = given.path()
    points = (path.at(k) for k in range(len(path)))
    rows = [(t.position_counts, t.velocity_rad_s, t.acceleration_rad_s2) for t in points]
    time: NDArray[np.float64] = given.sampling.period_us * 1e-6 * np.arange(len(path), dtype=np.float64)
    return time, np.array(rows, dtype=np.float64).T
