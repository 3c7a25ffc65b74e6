"""The shaft as functions ``(t, x, u, params)``, for python-control and for your own solvers.

The state is ``x = [position rad, velocity rad/s]``, the input ``u = [voltage V]``. This is the rig alone: equation
(1) with its friction and its actuator, without encoder, converter, delay and lag. Friction with bristles appears here
as its steady sliding: the state has no deflection. For bristles use :class:`clutch.Plant`.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from clutch._run import ScenarioLike, as_scenario

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["derivative", "output", "to_control"]

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
        python-control is not installed.
    ParamError
        A scenario that is refused.

    Examples
    --------
    >>> import clutch.dynamics
    >>> shaft = clutch.dynamics.to_control("smc_2")
    >>> shaft.state_labels, shaft.input_labels
    (['position', 'velocity'], ['voltage'])
    """
    control: Any = importlib.import_module("control")
    return control.nlsys(
        derivative(scenario),
        output,
        name=name,
        states=["position", "velocity"],
        inputs=["voltage"],
        outputs=["position", "velocity"],
    )
