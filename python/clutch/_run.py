"""Simulation: a scenario in, samples, events and figures out."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from html import escape
from typing import TYPE_CHECKING, Any, Protocol

from clutch import _clutch
from clutch._clutch import Table, Tick
from clutch._metrics import FIGURES, Metrics
from clutch._model import Scenario

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy import float64
    from numpy.typing import NDArray

ScenarioLike = Scenario | str | os.PathLike[str]


def as_scenario(scenario: ScenarioLike, overrides: Mapping[str, object] | None = None) -> Scenario:
    """Take a scenario, a built-in scenario's name or a file, and override keys of it."""
    if isinstance(scenario, Scenario):
        return scenario.override(overrides) if overrides else scenario
    if isinstance(scenario, str | os.PathLike):
        return Scenario.load(scenario, overrides or {})
    kind = type(scenario).__name__
    raise TypeError(f"scenario is of type {kind}: expected a clutch.Scenario, a built-in name or a path")


class Result:
    """A finished run, as :func:`clutch.simulate` returns it.

    Attributes
    ----------
    scenario : Scenario
        The scenario that ran.
    metrics : Metrics
        Figures after the settling time.
    engine : str
        ``"exact_flow"``, ``"dormand_prince"`` or ``"bristle"``.
    samples : Table
        A row for each sample; SI units and radians, as docs/scenario.md says under CSV.
    events : Table
        Sticks and break-aways: time_s, kind (``"stick"``, ``"break_away"``), position_rad, torque_nm.
    sticks : Table
        Times at rest, from a stick to its break-away or the end of the run: from_s, to_s.

    Examples
    --------
    >>> import clutch
    >>> result = clutch.simulate("pd_2")
    >>> result.samples.columns[:3]
    ['time_s', 'target_position_rad', 'target_velocity_rad_s']
    >>> set(result.events["kind"])  == {"stick", "break_away"}
    True
    """

    def __init__(self, scenario: Scenario, run: _clutch.Run) -> None:
        self.scenario = scenario
        self.metrics = Metrics(**run.metrics)
        self.engine: str = run.engine
        self.samples: Table = run.samples
        self.events: Table = run.events
        self.sticks: Table = run.sticks
        self._window = run.window
        self._run: _clutch.Run | None = run

    def __getstate__(self) -> dict[str, Any]:
        # All but the run itself, whose memory is this process's; only `save` needs it.
        return {**self.__dict__, "_run": None}

    @property
    def time(self) -> NDArray[float64]:
        """Time of the samples, s, shape (N,)."""
        time: NDArray[float64] = self.samples["time_s"]
        return time

    @property
    def inputs(self) -> NDArray[float64]:
        """Voltage commanded, V, shape (1, N)."""
        return self._stacked("voltage_v")

    @property
    def states(self) -> NDArray[float64]:
        """True position (rad) and velocity (rad/s), shape (2, N)."""
        return self._stacked("position_rad", "velocity_rad_s")

    @property
    def outputs(self) -> NDArray[float64]:
        """True position, rad, shape (1, N)."""
        return self._stacked("position_rad")

    def _stacked(self, *names: str) -> NDArray[float64]:
        import numpy as np

        return np.stack([self.samples[name] for name in names])

    def to_pandas(self) -> pd.DataFrame:
        """Return the samples as a ``pandas.DataFrame``, without copying."""
        return self.samples.to_pandas()

    def to_polars(self) -> pl.DataFrame:
        """Return the samples as a ``polars.DataFrame``, without copying."""
        return self.samples.to_polars()

    def to_arrow(self) -> pa.Table:
        """Return the samples as a ``pyarrow.Table``, without copying."""
        return self.samples.to_arrow()

    def to_xarray(self) -> xr.Dataset:
        """Return the samples as an ``xarray.Dataset`` over ``time_s``; figures are its attributes."""
        data = self.samples.to_xarray("time_s")
        numbers = {name: getattr(self.metrics, name) for name in FIGURES}
        data.attrs = {"scenario": self.scenario.name, "engine": self.engine}
        data.attrs.update({name: value for name, value in numbers.items() if value is not None})
        return data

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """Give the samples as an Arrow C stream, which other libraries read."""
        return self.samples.__arrow_c_stream__(requested_schema)

    @property
    def window(self) -> tuple[float, float] | None:
        """Begin and end of the stretch that :meth:`plot` shows closely, s: around a stick, else the largest error."""
        return None if self._window is None else self._window[:2]

    def plot(self) -> Figure:
        """Draw the run closely around a stick, and whole: :func:`clutch.plot.run_overview`."""
        from clutch import plot

        return plot.run_overview(self)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the run as an MCAP log, the one that ``clutch sim --log`` writes.

        Parameters
        ----------
        path : str or path
            A new file; a log is never overwritten.

        Raises
        ------
        OSError
            The file is there already, or cannot be written.
        RuntimeError
            The result comes from another process.

        Notes
        -----
        A law that was written in Python is in the log by its name alone: give it to :func:`clutch.replay`.

        Examples
        --------
        >>> import clutch, tempfile, pathlib
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     log = pathlib.Path(folder) / "run.mcap"
        ...     clutch.simulate("smc_2").save(log)
        ...     clutch.replay(log).identical
        True
        """
        if self._run is None:
            raise RuntimeError("the result comes from another process, and can only be saved there")
        self._run.save(os.fspath(path))

    def __len__(self) -> int:
        return len(self.samples)

    def __repr__(self) -> str:
        m = self.metrics
        return (
            f"<Result {self.scenario.name!r}: {len(self)} samples, max error {m.max_error_rad:.6f} rad, "
            f"{m.stick_slip_cycles_per_s:.3g} stick-slip cycles/s>"
        )

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{name}</td><td>{'–' if value is None else format(value, '.6g')}</td></tr>"
            for name, value in ((name, getattr(self.metrics, name)) for name in FIGURES)
        )
        return f"<table><caption>{escape(self.scenario.name)}</caption>{rows}</table>"


def simulate(
    scenario: ScenarioLike,
    *,
    law: Law | None = None,
    overrides: Mapping[str, object] | None = None,
) -> Result:
    """Simulate a scenario: the same run as ``clutch sim``, bit for bit.

    Parameters
    ----------
    scenario : Scenario, str or path
        A scenario, the name of a built-in one, or a TOML file.
    law : callable or object, optional
        A law of your own in place of the scenario's: a function that is called with a :class:`clutch.Tick` each period
        and answers the voltage, V; or an object with such a method ``step`` and, if it has one, a method ``start``,
        which is called with the first tick before; or the class of such objects. The scenario's output stage (limits,
        bumpless start) follows it, and it runs in double precision. It keeps its own state.
    overrides : mapping, optional
        Values for dotted keys of the scenario, as ``{"law.smc.kp_v": 4}``.

    Returns
    -------
    Result
        Samples, events, figures.

    Raises
    ------
    ParamError
        A value that the scenario refuses; its ``field`` is the key.
    OSError
        The file cannot be read.

    Warns
    -----
    UserWarning
        The rig's friction has bristles that can give energy: docs/friction.md, passivity.

    Examples
    --------
    >>> import clutch
    >>> ours = clutch.simulate("pd_2")
    >>> own = clutch.simulate("pd_2", law=lambda tick: -80 * tick.error)
    >>> own.metrics.max_error_rad > ours.metrics.max_error_rad
    True
    """
    checked = as_scenario(scenario, overrides)
    return Result(checked, _clutch.simulate(checked, as_law(law)))


class SteppedLaw(Protocol):
    """A law as an object.

    Examples
    --------
    >>> import clutch
    >>> class Integral:
    ...     def start(self, tick):
    ...         self.volts = tick.applied
    ...
    ...     def step(self, tick):
    ...         self.volts -= 5.0 * tick.error
    ...         return self.volts - 2000.0 * tick.error - 20.0 * tick.error_rate
    >>> clutch.simulate("pd_2", law=Integral).metrics.max_error_rad < 0.003
    True
    """

    def step(self, tick: Tick, /) -> float:
        """Answer the voltage of the next period, V."""
        ...


#: A law of one's own: a function, an object with a method ``step``, or the class of one.
Law = Callable[[Tick], float] | SteppedLaw | type[SteppedLaw]


def as_law(law: Law | None) -> Callable[[Tick], float] | SteppedLaw | None:
    """The law itself, or an object of it if it is a class."""
    return law() if isinstance(law, type) else law
