"""
The native half of the package `clutch`.
"""

from collections.abc import Callable, Iterator, Sequence
from collections.abc import Mapping
from os import PathLike
from typing import Any, Final, SupportsFloat, SupportsIndex, final

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from typing_extensions import CapsuleType

from clutch import _model, _run
from clutch._errors import ParamError

__all__ = ["BUILD", "DEFAULT_PRIORITY", "RELEASE_DEG", "SPIN_US", "VERSION", "Log", "Paper", "Path", "Plant", "RefereeCase", "Run", "Scenario", "Servo", "Shafts", "StickSlip", "Sweep", "Table", "Target", "Tick", "_plant", "as_identified", "brake_gain", "check", "envelope", "friction_lab", "identified_rows", "identify", "lowest_smooth_speed", "main", "read_log", "referee_cases", "reproduce", "rig", "run_loop", "scenarios", "simulate", "steady_friction", "tune"]

BUILD: Final[str]
"""
Version and commit of the build, as logs record it.
"""

DEFAULT_PRIORITY: Final[int]
"""
Priority of the loop's control thread unless another is given.
"""

RELEASE_DEG: Final[float]
"""
Longest way of a shaft in the release test unless another is given, °.
"""

SPIN_US: Final[int]
"""
Time before a sample at which spinning begins unless another is given, µs.
"""

VERSION: Final[str]
"""
Version of the package.
"""

@final
class Log:
    """
    A log in memory; `clutch.Log` is its public form.
    """
    def channels(self, /) -> dict[str, Table]:
        """
        Channels that have records, as tables.
        """
    @property
    def complete(self, /) -> bool:
        """
        Finished by its writer and without damage.
        """
    @property
    def damaged(self, /) -> int:
        """
        Damaged places that were skipped.
        """
    @property
    def metadata(self, /) -> dict[str, str]:
        """
        The log's description of itself, as texts.
        """
    def pictured(self, /) -> tuple[tuple[float, float, str, bool] | None, Table]:
        """
        The stretch that a picture shows closely, as `Run.window`, and the times at rest, as `Run.sticks`.
        """
    def replay(self, /, scenario: Scenario | None = None, law: Callable[[Tick], float] | _run.SteppedLaw | None = None) -> tuple[Table, tuple[int, int], tuple[int, str, float, float] | None, Any]:
        """
        Feeds the recorded counts to the recorded law, to another scenario's, or to one written in Python: commands of the
        replay, ticks compared and ticks behind a gap, the first difference (tick, field, logged, replayed), and the drift of
        friction over load.
        """
    @property
    def scenario_toml(self, /) -> str:
        """
        The scenario's file.
        """

@final
class Paper:
    """
    Outcome of the paper's runs: claims and Table 3 as lists of dicts, and the figures: number, law,
    panels (rate in °/s, true for the experiment, time in s and error in °).
    """
    def as_documented(self, /) -> list[bool]:
        """
        True if each statement holds, or fails as documented.
        """
    def claims(self, /) -> list[dict[str, Any]]:
        """
        Statements of the paper and their results: a dict each.
        """
    def figures(self, /) -> list[tuple[int, str, list[tuple[float, bool, Table]]]]:
        """
        Figures 8, 9, 10: number, law, panels.
        """
    def table3(self, /) -> list[dict[str, float]]:
        """
        Rows of Table 3: a dict each.
        """

@final
class Path:
    """
    A scenario's path, sampled at its period.

    Examples
    --------
    >>> import clutch
    >>> path = clutch.Scenario.load("minimum_jerk").path()
    >>> path.at(0).velocity_rad_s
    0.0
    >>> len(path) == len(path.table())
    True
    """
    def __len__(self, /) -> int: ...
    def __repr__(self, /) -> str: ...
    def at(self, /, tick: SupportsIndex) -> Target:
        """
        The target at a tick of the run, from 0.
        """
    def table(self, /) -> Table:
        """
        Columns time_s, position_rad, velocity_rad_s, acceleration_rad_s2.
        """

@final
class Plant:
    """
    The rig of a scenario, stepped by you: volts in, counts out.

    It begins where the scenario's run begins, at its position, velocity and voltage.

    Parameters
    ----------
    scenario : Scenario
        Rig, sampling, start, seed, engine.

    Examples
    --------
    Let go, the weight accelerates the shaft:

    >>> import clutch
    >>> plant = clutch.Plant(clutch.Scenario.load("smc_2"))
    >>> start = plant.velocity
    >>> for _ in range(10):
    ...     counts = plant.step(0.0)
    >>> plant.velocity > start
    True

    A copy goes its own way from where the plant is, and a plant can be pickled:

    >>> import copy
    >>> other = copy.copy(plant)
    >>> other.step(2.0) == plant.step(2.0)
    True
    """
    def __copy__(self, /) -> Plant: ...
    def __deepcopy__(self, /, _memo: object) -> Plant: ...
    def __new__(cls, /, scenario: _model.Scenario | Scenario) -> Plant: ...
    def __reduce__(self, /) -> tuple[Any, tuple[str, list[int]]]:
        """
        The scenario as TOML, the rig's state as bits, and the plant's own numbers.
        """
    def copy(self, /) -> Plant:
        """
        A plant in the same state, which goes its own way.
        """
    @property
    def counts(self, /) -> int | float:
        """
        The encoder's output: whole counts; a fraction if the scenario's sensor is ideal.
        """
    def events(self, /) -> Table:
        """
        Sticks and break-aways so far: columns time_s, kind, position_rad, torque_nm.
        """
    @property
    def fine_counts(self, /) -> float:
        """
        Position in counts to 2⁻¹⁶ of one, as an ideal sensor shows it.
        """
    def place(self, /, position_rad: SupportsFloat | SupportsIndex, velocity_rad_s: SupportsFloat | SupportsIndex = 0.0, voltage_v: SupportsFloat | SupportsIndex | None = None) -> None:
        """
        Puts the shaft somewhere else: its time and what is random go on.

        Bristles, if its friction has some, bend as in steady sliding, at rest as they have to under the voltage at the pad.

        Parameters
        ----------
        position_rad : float
            Position of the shaft, rad.
        velocity_rad_s : float, optional
            Its velocity, rad/s; 0 is at rest.
        voltage_v : float, optional
            Voltage that the converter has given since long, V; absent: the voltages go on, also those that are still on
            their way through delay and lag.

        Raises
        ------
        ValueError
            A number that is not finite, a position beyond the encoder's counts, a voltage beyond the converter's.
        """
    @property
    def position(self, /) -> float:
        """
        True position, rad.
        """
    @property
    def start_voltage(self, /) -> float:
        """
        Voltage at the start, V.
        """
    def step(self, /, voltage: SupportsFloat | SupportsIndex) -> int | float:
        """
        One sampling period with `voltage` commanded; the counts at its end (a fraction if the
        sensor is ideal).

        The rig's converter rounds and limits the voltage, its delay and lag come on top.
        """
    @property
    def sticks(self, /) -> int:
        """
        Number of sticks so far.
        """
    @property
    def stuck(self, /) -> bool:
        """
        True if friction holds the shaft.
        """
    @property
    def time(self, /) -> float:
        """
        Time since the start, s.
        """
    @property
    def velocity(self, /) -> float:
        """
        True velocity, rad/s; exactly 0 when stuck.
        """
    @property
    def voltage(self, /) -> float:
        """
        Voltage last commanded, as the converter gives it, V.
        """

@final
class RefereeCase:
    """
    A case of the referee; `text` is the contents of its file, `origin` what errors begin with.
    """
    def __new__(cls, /, origin: str, text: str) -> RefereeCase: ...
    def judge(self, /, position: NDArray[np.float64], velocity: NDArray[np.float64], torque: NDArray[np.float64] | None, events: Sequence[tuple[float, int, bool]] | None, metrics: dict[str, float]) -> list[tuple[str, float | None, float, float, str]]:
        """
        Holds a trajectory against the case: name, measured, expected, within, unit of each figure.
        """
    def run(self, /, engine: str, step: SupportsFloat | SupportsIndex | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64] | None, list[tuple[float, int, bool]] | None, dict[str, float]]:
        """
        Runs it on an engine of this package: positions and velocities (joints × samples), torques (rows × samples), events
        of time, row and "it holds", figures.
        """
    def told(self, /) -> dict[str, Any]:
        """
        All that the case says, as a dict.
        """

@final
class Run:
    """
    A finished run.
    """
    @property
    def engine(self, /) -> str:
        """
        Name of the engine that ran.
        """
    @property
    def events(self, /) -> Table:
        """
        Sticks and break-aways.
        """
    @property
    def metrics(self, /) -> dict[str, Any]:
        """
        Figures by name.
        """
    @property
    def samples(self, /) -> Table:
        """
        A row for each sample.
        """
    def save(self, /, path: str | PathLike[str]) -> None:
        """
        Writes the log that `clutch sim --log` writes.
        """
    @property
    def sticks(self, /) -> Table:
        """
        Times at rest: from a stick to its break-away, or to the end of the run.
        """
    @property
    def window(self, /) -> tuple[float, float, str, bool] | None:
        """
        The stretch that a picture shows closely: its begin and end, s; what is in its middle, in words; true if that is a
        stick.
        """

@final
class Scenario:
    """
    A checked scenario, as the simulator takes it; `clutch.Scenario` is its public form.
    """
    def __new__(cls, /, tables: dict[str, Any], origin: str = "Scenario") -> Scenario:
        """
        Checks the tables of a scenario.
        """
    def acceleration(self, /, time: SupportsFloat | SupportsIndex, position: SupportsFloat | SupportsIndex, velocity: SupportsFloat | SupportsIndex, voltage: SupportsFloat | SupportsIndex) -> float:
        """
        Acceleration of the plant (1) at time, position, velocity and brake voltage, rad/s²;
        0 at rest while friction holds.
        """
    def certificate(self, /, sampled: bool = False, save: str | PathLike[str] | None = None, check: str | PathLike[str] | None = None) -> dict[str, Any]:
        """
        The object that `clutch certify --json` prints; with a proof that is looked for, and written to a file, or with one
        that is read from a file.
        """
    @staticmethod
    def load(name: str | PathLike[str], overrides: Mapping[str, object] | None = None) -> Scenario:
        """
        Reads a scenario from a file or, if there is none, the built-in one of that name.
        """
    def meaning(self, /, key: str) -> str | None:
        """
        The meaning of a dotted key, in a few words; none of one that is no parameter.
        """
    @staticmethod
    def parse(origin: str, text: str, overrides: Mapping[str, object] | None = None) -> Scenario:
        """
        Reads a scenario from TOML; errors begin with `origin`.
        """
    def path(self, /) -> Path:
        """
        The path, sampled.
        """
    def surface(self, /) -> tuple[float, float] | None:
        """
        Slope, 1/s, and layer, rad/s, of the sliding surface of law or shell; none of a law without one, or of a path that cannot be
        followed.
        """
    def tables(self, /) -> dict[str, Any]:
        """
        Every table with its defaults filled in.
        """
    @property
    def ticks(self, /) -> int:
        """
        The number of ticks in a run.
        """
    def to_toml(self, /) -> str:
        """
        The scenario's file, defaults filled in.
        """

@final
class Servo:
    """
    The law of a scenario with its state, sampled by you: counts and target in, volts out.

    It is the servo that the simulator, the loop and the boards run, bit for bit. It begins as
    `clutch.simulate` does.

    Parameters
    ----------
    scenario : Scenario
        Law, gains, sampling, encoder, converter; its scalar, f32 or f64.

    Examples
    --------
    The loop of `clutch.simulate`, by hand:

    >>> import clutch
    >>> scenario = clutch.Scenario.load("smc_2").override({"run.duration_s": 2.0})
    >>> servo, plant, path = clutch.Servo(scenario), clutch.Plant(scenario), scenario.path()
    >>> volts = []
    >>> for tick in range(len(path)):
    ...     volts.append(servo.step(plant.counts, path.at(tick)))
    ...     counts = plant.step(volts[-1])
    >>> volts == clutch.simulate(scenario).samples["voltage_v"].tolist()
    True
    """
    def __copy__(self, /) -> Servo: ...
    def __deepcopy__(self, /, _memo: object) -> Servo: ...
    def __new__(cls, /, scenario: _model.Scenario | Scenario) -> Servo: ...
    @property
    def code(self, /) -> int:
        """
        Code for the converter at the last step.
        """
    def copy(self, /) -> Servo:
        """
        A snapshot: continues from here by itself.
        """
    @property
    def demand(self, /) -> float:
        """
        Voltage that the law demanded of the converter at the last step, V.
        """
    @property
    def error(self, /) -> float:
        """
        Position error of the last step as the law saw it, rad.
        """
    @property
    def error_rate(self, /) -> float:
        """
        Rate of the error as the law saw it, rad/s.
        """
    @property
    def limit(self, /) -> int:
        """
        The limit that decided the last voltage, as in a run's column `limit`: 0 the law, 1 the
        lowest voltage, 2 the highest, 3 a demand that was not a number.
        """
    @property
    def limited(self, /) -> bool:
        """
        True if a limit of the output decided the last voltage.
        """
    def start(self, /, counts: SupportsFloat | SupportsIndex, target: Target, voltage: SupportsFloat | SupportsIndex) -> None:
        """
        Begins anew: the shaft at `counts` moves with the target, the brake has been at `voltage`.
        """
    def step(self, /, counts: SupportsFloat | SupportsIndex, target: Target) -> float:
        """
        One sampling period: the encoder's counts and the target in, the brake's voltage out, V.

        Parameters
        ----------
        counts : int
            The encoder's counts; a fraction if the scenario's sensor is ideal.
        target : Target
            The path now.

        Returns
        -------
        float
            The voltage to command, V, as the converter gives it.
        """
    @property
    def terms(self, /) -> dict[str, float]:
        """
        The law's intermediate terms at the last step, by name with unit.
        """

@final
class Shafts:
    """
    Rigs with their laws, which agents step together.

    A period of all takes one call, in the lanes of vectors, on all processors and without Python's lock.
    """
    QUANTITIES: Final[list[str]]
    """
    Names of the rows of what is seen.
    """
    def __new__(cls, /, scenario: _model.Scenario | Scenario, seeds: Sequence[int]) -> Shafts:
        """
        A shaft for each seed, which takes the place of the scenario's.
        """
    def reset(self, /, index: int, seed: int) -> None:
        """
        One of them begins anew with the next step, which does not move it.
        """
    def seen(self, /) -> NDArray[np.float64]:
        """
        A row for each quantity, a column for each shaft.
        """
    def step(self, /, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        """
        A period of each shaft under its voltage, V; then as `seen`.
        """

@final
class StickSlip:
    """
    Stick-slip seen from the encoder's counts, sampled by you.

    The shaft counts as stuck when the encoder is silent while the path moves by more than a count.

    Parameters
    ----------
    scenario : Scenario
        Encoder and sampling period; its scalar, f32 or f64.

    Examples
    --------
    Three counts at once each 27 ms, where the path moves evenly:

    >>> import clutch
    >>> sticks = clutch.StickSlip(clutch.Scenario.load("pd_2"))
    >>> for tick in range(270):
    ...     begins = sticks.update(tick // 27 * 3, 0.035)
    >>> sticks.cycles, sticks.stair
    (10, 3)
    """
    def __new__(cls, /, scenario: _model.Scenario | Scenario) -> StickSlip: ...
    @property
    def cycles(self, /) -> int:
        """
        Stick-slip cycles so far.
        """
    @property
    def stair(self, /) -> int:
        """
        Largest movement between one stick and the next so far, counts.
        """
    @property
    def stuck(self, /) -> bool:
        """
        True if the shaft counts as stuck now.
        """
    @property
    def stuck_ticks(self, /) -> int:
        """
        Sampling periods spent stuck so far, with the silence before each detection.
        """
    def update(self, /, counts: SupportsFloat | SupportsIndex, velocity_rad_s: SupportsFloat | SupportsIndex) -> bool:
        """
        One sampling period: the encoder's counts and the path's velocity, rad/s.

        Parameters
        ----------
        counts : int
            The encoder's counts.
        velocity_rad_s : float
            Velocity of the path now, rad/s.

        Returns
        -------
        bool
            True if a stick is detected at this sample.
        """

@final
class Sweep:
    """
    A sweep that runs in threads of its own; `clutch.sweep` is its public form.
    """
    def __new__(cls, /, scenario: _model.Scenario | Scenario, keys: Sequence[str], rows: list[list[object]], metrics: Sequence[str], traces: Sequence[str] = ..., every: SupportsIndex = 1, threads: SupportsIndex | None = None, instructions: str | None = None) -> Sweep:
        """
        `rows` of values for the dotted `keys`, over a scenario. `instructions` are those of the lanes, for comparisons;
        else the widest that the processor has.
        """
    def cancel(self, /) -> None:
        """
        Ends the sweep: runs under way stop within milliseconds and leave nothing.
        """
    @property
    def finished(self, /) -> int:
        """
        Rows that are done.
        """
    @property
    def refused(self, /) -> int | None:
        """
        The lowest row so far that the scenario refused.
        """
    def result(self, /) -> tuple[Table, dict[int, Table], list[tuple[int, ParamError]]]:
        """
        Finished rows: a table (run, each metric, error), traces by row, and for each refused row its error.
        """
    def start(self, /) -> None:
        """
        Starts the threads; once only.
        """
    @property
    def total(self, /) -> int:
        """
        Rows in all.
        """
    def wait(self, /, seconds: SupportsFloat | SupportsIndex) -> bool:
        """
        Waits at most `seconds`; true if the sweep has ended.
        """

@final
class Table:
    """
    Named columns of equal length.

    Results, logs and sweeps are tables. Any library that reads Arrow streams takes one directly
    (`pyarrow.table(t)`, `polars.DataFrame(t)`, `pandas.DataFrame.from_arrow(t)`), numbers without
    copying.

    Parameters
    ----------
    columns : dict
        Name to one-dimensional array of numbers, bools or texts, all of one length.
    meanings : dict, optional
        Name of a column to its meaning in a few words, which xarray and Arrow get as `long_name`.

    Raises
    ------
    ValueError
        Columns of unequal length, of more than one dimension, or of another type; the meaning of none.

    Examples
    --------
    >>> import clutch
    >>> t = clutch.Table({"time_s": [0.0, 0.001], "counts": [0, 3]})
    >>> t
    Table(2 rows: time_s, counts)
    >>> int(t["counts"].sum())
    3
    >>> t.to_pandas()["time_s"].tolist()
    [0.0, 0.001]
    """
    def __arrow_c_stream__(self, /, requested_schema: Any | None = None) -> CapsuleType:
        """
        The table as an Arrow C stream, which other libraries read.
        """
    def __contains__(self, name: Any, /) -> bool: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __getitem__(self, name: str, /) -> Any:
        """
        A column: NumPy's array, read-only and not copied; texts as a list.
        """
    def __iter__(self, /) -> Iterator[str]: ...
    def __len__(self, /) -> int: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __new__(cls, /, columns: Mapping[str, ArrayLike], meanings: dict[str, str] | None = None) -> Table: ...
    def __reduce__(self, /) -> tuple[Any, tuple[dict[str, Any], dict[str, str]]]: ...
    def __repr__(self, /) -> str: ...
    def _repr_html_(self, /) -> str: ...
    def attributes(self, /, name: str) -> dict[str, str]:
        """
        Unit and meaning of a column, as xarray's attributes and Arrow's metadata have them: `units`, `long_name`; those
        that are known.
        """
    @property
    def columns(self, /) -> list[str]:
        """
        Names of the columns, in order.
        """
    def to_arrow(self, /) -> pa.Table:
        """
        As a `pyarrow.Table`, numbers without copying.
        """
    def to_dict(self, /) -> dict[str, Any]:
        """
        Columns by name, in a dict.
        """
    def to_pandas(self, /) -> pd.DataFrame:
        """
        As a `pandas.DataFrame`, numbers without copying.
        """
    def to_polars(self, /) -> pl.DataFrame:
        """
        As a `polars.DataFrame`, numbers without copying.
        """
    def to_xarray(self, /, index: str | None = None) -> xr.Dataset:
        """
        As an `xarray.Dataset` with one dimension; `index` is the column that becomes its
        coordinate.
        """

@final
class Target:
    """
    A point of a path: the law's target at one tick.

    Parameters
    ----------
    position_counts : float
        Target position, encoder counts from the encoder's zero; kept to 2⁻¹⁶ counts.
    velocity_rad_s : float
        Target velocity, rad/s.
    acceleration_rad_s2 : float
        Target acceleration, rad/s².

    Examples
    --------
    >>> import clutch
    >>> clutch.Target(12.5, 0.035)
    Target(12.5, 0.035, 0.0)
    """
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    def __new__(cls, /, position_counts: SupportsFloat | SupportsIndex, velocity_rad_s: SupportsFloat | SupportsIndex = 0.0, acceleration_rad_s2: SupportsFloat | SupportsIndex = 0.0) -> Target: ...
    def __reduce__(self, /) -> tuple[Any, tuple[float, float, float]]: ...
    def __repr__(self, /) -> str: ...
    @property
    def acceleration_rad_s2(self, /) -> float:
        """
        Target acceleration, rad/s².
        """
    @property
    def position_counts(self, /) -> float:
        """
        Target position, counts.
        """
    @property
    def velocity_rad_s(self, /) -> float:
        """
        Target velocity, rad/s.
        """

@final
class Tick:
    """
    The input of a law written in Python, each period.

    Parameters
    ----------
    error, error_rate : float
        Position error, target minus position, rad, and its rate, rad/s.
    target_velocity, target_acceleration : float
        Velocity and acceleration of the path, rad/s and rad/s².
    time : float
        Time since the start of the run, s.
    position : float
        Position that the encoder shows, unwrapped, rad.
    counts : float
        The same in counts; whole, unless the sensor is ideal.
    applied : float
        Voltage since the last tick, as the converter gave it, V.

    Examples
    --------
    >>> import clutch
    >>> def law(tick):
    ...     return 2.24 - 80.0 * tick.error
    >>> clutch.simulate("smc_2", law=law).metrics.max_error_rad < 0.01
    True
    """
    def __new__(cls, /, error: SupportsFloat | SupportsIndex, error_rate: SupportsFloat | SupportsIndex, target_velocity: SupportsFloat | SupportsIndex = 0.0, target_acceleration: SupportsFloat | SupportsIndex = 0.0, time: SupportsFloat | SupportsIndex = 0.0, position: SupportsFloat | SupportsIndex = 0.0, counts: SupportsFloat | SupportsIndex = 0.0, applied: SupportsFloat | SupportsIndex = 0.0) -> Tick: ...
    def __repr__(self, /) -> str: ...
    @property
    def applied(self, /) -> float:
        """
        Voltage since the last tick, as the converter gave it, V.
        """
    @property
    def counts(self, /) -> float:
        """
        The same in counts; whole, unless the sensor is ideal.
        """
    @property
    def error(self, /) -> float:
        """
        Position error, target minus position, rad.
        """
    @property
    def error_rate(self, /) -> float:
        """
        Its rate, from the scenario's derivative (5) or observer, rad/s.
        """
    @property
    def position(self, /) -> float:
        """
        Position that the encoder shows, unwrapped, rad.
        """
    @property
    def target_acceleration(self, /) -> float:
        """
        Target acceleration, rad/s².
        """
    @property
    def target_velocity(self, /) -> float:
        """
        Target velocity, rad/s.
        """
    @property
    def time(self, /) -> float:
        """
        Time since the start of the run, s.
        """
    @property
    def velocity(self, /) -> float:
        """
        Measured velocity, rad/s.
        """

def _plant(scenario: str, words: Sequence[int]) -> Plant:
    """
    A pickled plant.
    """

def as_identified(scenario: _model.Scenario | Scenario, file: str) -> str:
    """
    The scenario with the rig that it believes in, as TOML.
    """

def brake_gain(table: dict[str, Any]) -> float:
    """
    `K_COF` (18) of a brake's geometry, N m/V.
    """

def check(key: str, name: str, table: dict[str, Any]) -> dict[str, Any]:
    """
    Checks one table by itself: `key` as `law.smc`, `name` its name in errors. Gives the table
    back with its defaults filled in.
    """

def envelope(time: NDArray[np.float64], values: NDArray[np.float64]) -> Table:
    """
    A curve over time in parts of equal length: the middle of each, s, its lowest and highest value, and its mean.
    """

def friction_lab(scenario: Scenario) -> dict[str, Any]:
    """
    The experiments of the friction laboratory with the friction of a scenario's rig: by name, what was set and what was
    found.
    """

def identified_rows() -> list[tuple[str, str, str, float]]:
    """
    Key, name for readers, unit and the factor from SI to it, of each parameter that identification may determine, in the order in
    which they are shown.
    """

def identify(scenario: _model.Scenario | Scenario, logs: Sequence[str | PathLike[str]], columns: tuple[str, str], loaded: tuple[Sequence[str | PathLike[str]], SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex] | None, log: str | PathLike[str] | None, travel_deg: SupportsFloat | SupportsIndex | None, fastest_deg_s: SupportsFloat | SupportsIndex | None) -> tuple[dict[str, Any], str | None, str | None]:
    """
    Identifies a rig: the object that `clutch identify --json` prints, and the rig file, or why there is none. Without logs
    the scenario's simulated board is run, in virtual time. `loaded`: logs with a mass added, the mass (kg), its radius (m).
    """

def lowest_smooth_speed(scenario: _model.Scenario | Scenario, rates: Sequence[float] | None, discs: SupportsIndex) -> dict[str, Any]:
    """
    The lowest smooth rate of a scenario, of these rates or the usual ones: the object that `clutch map --json` has in a
    cell.
    """

def main(args: Sequence[str], images: str | PathLike[str]) -> int:
    """
    Runs the `clutch` command with these arguments, the program's name first; gives its exit code. The package's images of
    boards are in the folder `images`.
    """

def read_log(path: str | PathLike[str]) -> Log:
    """
    Reads a log, even one that was cut.
    """

def referee_cases() -> list[tuple[str, str]]:
    """
    Names and files of the built-in cases.
    """

def reproduce(progress: Callable[[int, int], object] | None = None) -> Paper:
    """
    Runs the paper; `progress`, if given, is called with finished and total runs.
    """

def rig(name: str) -> dict[str, Any]:
    """
    The table of a built-in rig: `ideal`, `paper`, `bench`.
    """

def run_loop(scenario: _model.Scenario | Scenario, *, port: str | None, board: str | None, baud: SupportsIndex | None, log: str | PathLike[str] | None, uncertified: bool, certificate: str | PathLike[str] | None, release_test: str, release_deg: SupportsFloat | SupportsIndex, on_drift: str, patient: bool, faults: Sequence[str], fault_seed: SupportsIndex, strict: bool, pace: str, wait: str, spin_us: SupportsIndex, thread_priority: SupportsIndex, lock_memory: bool, cpu_affinity: SupportsIndex | None, live: SupportsIndex | None) -> tuple[dict[str, Any], str, str, str | None]:
    """
    Runs a session; its summary, the same in words, what it had said it would do, and the scenario's text if that was
    changed for the board's sake.
    """

def scenarios() -> list[str]:
    """
    Names of the built-in scenarios.

    Examples
    --------
    >>> import clutch
    >>> "smc_2" in clutch.scenarios()
    True
    """

def simulate(scenario: _model.Scenario | Scenario, law: Callable[[Tick], float] | _run.SteppedLaw | None = None) -> Run:
    """
    Runs a scenario; `law`, a function of a `Tick` or an object with such a method `step`, takes the place of its law.
    """

def steady_friction(scenario: Scenario, velocity: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Coefficients of the steady friction of a scenario's rig at some velocities, rad/s, with their signs.
    """

def tune(scenario: _model.Scenario | Scenario, file: tuple[str, str] | None, rates_deg_s: Sequence[float], candidates: SupportsIndex, uncertified: bool) -> tuple[dict[str, Any], list[str | None], str, str | None]:
    """
    Tunes a scenario: the object that `clutch tune --json` prints, and what goes with it.
    """
