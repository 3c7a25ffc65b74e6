"""Sweeps: one scenario, many values of its keys, on all cores or on an executor."""

from __future__ import annotations

import copy
import importlib
import itertools
import json
import math
import operator
import sys
import time
import uuid
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence, Sized
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from clutch import _clutch, executors
from clutch._clutch import Table
from clutch._errors import ParamError
from clutch._extras import needed
from clutch._metrics import FIGURES
from clutch._model import Scenario, _as_table
from clutch._run import Law, Result, ScenarioLike, as_law, as_scenario, simulate
from clutch._units import attributes

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow
    import xarray
    from matplotlib.axes import Axes

__all__ = ["Samples", "SweepResult", "grid", "latin_hypercube", "samples", "sobol", "sweep"]

#: A range of values: lowest, highest, and "log" or "int" unless they are spread evenly as floats.
Range = tuple[float, float] | tuple[float, float, Literal["log", "int"]]

#: The result of a native job: a table of its finished rows, traces and refusals by row.
_Result = tuple[Table, dict[int, Table], list[tuple[int, ParamError]]]

#: The column of the verdict in continuous time.
_CERTIFIED = "certified_continuous_time"
#: Columns kept with ``traces=True``.
_TRACES = ("time_s", "error_rad", "voltage_v")
#: Rows of a chunk for an executor that does not report its number of workers.
_CHUNK = 64
#: Longest time between two checks for Ctrl-C, s.
_POLL_S = 0.05
#: A progress bar is shown for sweeps longer than this, s.
_SHOWN_AFTER_S = 1.0


# --- The runs ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Samples:
    """Keys of a scenario, and for each run a value of each.

    Made by `grid`, `sobol`, `latin_hypercube` and `samples`.

    Parameters
    ----------
    keys
        Dotted keys of the scenario, with their units, as ``"law.smc.kp_v"``.
    rows
        A tuple of values for each run, in the order of the keys.
    axes
        For a full grid: the values of each key, the last of which changes fastest.

    Examples
    --------
    >>> import clutch
    >>> clutch.grid({"law.smc.kp_v": [3.0, 4.0], "run.seed": [1, 2]}).rows
    ((3.0, 1), (3.0, 2), (4.0, 1), (4.0, 2))
    """

    keys: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...] = field(repr=False)
    axes: tuple[tuple[Any, ...], ...] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for key in self.keys:
            above = [other for other in self.keys if key.startswith(f"{other}.")]
            if above:
                raise ValueError(f"{key} lies within {above[0]}, which is swept, too; sweep one of them")
            if self.keys.count(key) > 1:
                raise ValueError(f"{key} is swept twice")
        for i, row in enumerate(self.rows):
            if len(row) != len(self.keys):
                raise ValueError(f"row {i} has {len(row)} values: expected {len(self.keys)}, one for each key")

    def __len__(self) -> int:
        return len(self.rows)

    def _distinct(self, key: str) -> list[dict[str, Any]]:
        """Each value of a key once, as an override; none if it is not swept."""
        if key not in self.keys:
            return []
        i = self.keys.index(key)
        values = {json.dumps(row[i], sort_keys=True): row[i] for row in self.rows}
        return [{key: value} for value in values.values()]

    def _crossed(self, key: str, values: tuple[Any, ...]) -> Samples:
        """Each row with each value of one more key."""
        if key in self.keys:
            raise ValueError(f"{key} is swept and given by seeds=; drop one of them")
        rows = tuple((*row, value) for row in self.rows for value in values)
        return Samples((*self.keys, key), rows, None if self.axes is None else (*self.axes, values))


def grid(parameters: Mapping[str, Iterable[Any]]) -> Samples:
    """Every combination of the values of each key.

    Parameters
    ----------
    parameters
        Dotted keys of the scenario and the values of each: numbers, choices, or whole tables, as model
        objects or dicts.

    Returns
    -------
    Samples
        The last key changes fastest.

    Raises
    ------
    ValueError
        No key, or a key without values.
    TypeError
        The values of a key are not a sequence, or one of them is missing.

    Examples
    --------
    >>> import clutch
    >>> len(clutch.grid({"law.smc.kp_v": [3.0, 4.0, 5.0], "rig.base": ["paper", "bench"]}))
    6
    """
    axes = {key: _values(key, values) for key, values in parameters.items()}
    if not axes:
        raise ValueError("a sweep needs at least one key, as {'law.smc.kp_v': [3.0, 4.0]}")
    _room("grid", math.prod(map(len, axes.values())))
    return Samples(tuple(axes), tuple(itertools.product(*axes.values())), tuple(axes.values()))


def samples(columns: Any) -> Samples:
    """The rows of a table, one run each.

    Parameters
    ----------
    columns
        A dict of columns of equal length, a `Table`, or a data frame of pandas or polars; the names of the
        columns are dotted keys.

    Returns
    -------
    Samples
        In the order of the table.

    Raises
    ------
    ValueError
        No column, or columns of unequal length.
    TypeError
        No table, or a row without a value.

    Examples
    --------
    >>> import clutch
    >>> clutch.samples({"law.smc.kp_v": [3.0, 4.0], "law.smc.boundary_rad_s": [0.1, 0.15]}).rows
    ((3.0, 0.1), (4.0, 0.15))
    """
    if not isinstance(columns, Mapping) and not hasattr(columns, "columns"):
        kind = type(columns).__name__
        raise TypeError(f"parameters is of type {kind}: expected a dict of sequences, a table or a data frame")
    names = list(columns) if isinstance(columns, Mapping) else list(columns.columns)
    values = {name: _values(name, columns[name]) for name in names}
    lengths = {name: len(column) for name, column in values.items()}
    if not lengths:
        raise ValueError("a sweep needs at least one column, as {'law.smc.kp_v': [3.0, 4.0]}")
    if len(set(lengths.values())) > 1:
        raise ValueError(f"columns of unequal length: {lengths}")
    return Samples(tuple(values), tuple(zip(*values.values(), strict=True)))


def sobol(ranges: Mapping[str, Range], n: int, *, seed: int = 1) -> Samples:
    """Points of a scrambled Sobol sequence, which fill the ranges more evenly than random ones.

    Parameters
    ----------
    ranges
        For each dotted key ``(lowest, highest)``, ``(lowest, highest, "log")`` for values spread evenly over
        orders of magnitude, or ``(lowest, highest, "int")`` for whole numbers, both ends included.
    n
        Number of points. A power of two keeps the sequence's balance.
    seed
        Seed of the scrambling.

    Returns
    -------
    Samples
        The points; needs SciPy.

    Raises
    ------
    ValueError
        A range that is empty, or that reaches to 0 with "log".

    Examples
    --------
    >>> import clutch
    >>> points = clutch.sobol({"law.smc.kp_v": (2, 6), "law.smc.boundary_rad_s": (0.01, 1, "log")}, 4)
    >>> len(points), all(2 <= kp <= 6 and 0.01 <= layer <= 1 for kp, layer in points.rows)
    (4, True)
    """
    return _spread("sobol", "Sobol", ranges, n, seed)


def latin_hypercube(ranges: Mapping[str, Range], n: int, *, seed: int = 1) -> Samples:
    """Points of a Latin hypercube: each key's range is cut in ``n`` parts, and each part is hit once.

    Parameters
    ----------
    ranges
        As for `sobol`.
    n
        Number of points.
    seed
        Seed of the points.

    Returns
    -------
    Samples
        The points; needs SciPy.

    Raises
    ------
    ValueError
        A range that is empty, or that reaches to 0 with "log".

    Examples
    --------
    >>> import clutch
    >>> points = clutch.latin_hypercube({"rig.delay_ticks": (0, 3, "int")}, 4)
    >>> sorted(points.rows)
    [(0,), (1,), (2,), (3,)]
    """
    return _spread("latin_hypercube", "LatinHypercube", ranges, n, seed)


def _spread(by: str, name: str, ranges: Mapping[str, Range], n: int, seed: int) -> Samples:
    with needed("scipy", f"clutch.{by}"):
        qmc = importlib.import_module("scipy.stats.qmc")
    scales = [_scale(key, limits) for key, limits in ranges.items()]
    _room("n", n)
    points = getattr(qmc, name)(d=len(ranges), rng=seed).random(n).tolist()
    rows = (tuple(scale(x) for scale, x in zip(scales, point, strict=True)) for point in points)
    return Samples(tuple(ranges), tuple(rows))


def _scale(key: str, limits: Range) -> Callable[[float], float]:
    """The map from 0 … 1 to a range."""
    low, high = limits[:2]
    how = limits[2] if len(limits) == 3 else "linear"
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ValueError(f"{key}: expected a lowest value below the highest, got {low} and {high}")
    if how == "linear":
        return lambda x: low + (high - low) * x
    if how == "int":
        if low != math.floor(low) or high != math.floor(high):
            raise ValueError(f"{key}: a range with 'int' must have whole ends, got {low} and {high}")
        return lambda x: min(int(low) + math.floor((high - low + 1) * x), int(high))
    if how != "log":
        raise ValueError(f"{key}: expected 'log' or 'int' after the range, got {how!r}")
    if low <= 0.0:
        raise ValueError(f"{key}: a range with 'log' must begin above 0, got {low}")
    return lambda x: low * (high / low) ** x


# Refused before memory is taken: these take some GB.
_MOST_ROWS = 10_000_000


def _room(what: str, rows: int) -> None:
    if rows > _MOST_ROWS:
        raise ValueError(f"{what}: {rows} rows, expected at most {_MOST_ROWS}")


def _values(key: str, values: Any) -> tuple[Any, ...]:
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        raise TypeError(f"{key}: expected a sequence of values, got {values!r}")
    if isinstance(values, Sized):
        _room(key, len(values))
    plain = tuple(_as_table(key, v) for v in itertools.islice(values, _MOST_ROWS + 1))
    _room(key, len(plain))
    for row, value in enumerate(plain):
        if value is None or type(value).__name__ == "NAType":  # the gap of a data frame
            raise TypeError(f"{key}: row {row} has no value ({value}): expected one in every row")
    if not plain:
        raise ValueError(f"{key}: no values")
    return plain


def _origin(scenario: Scenario) -> dict[str, str]:
    """The metadata of a file of rows, as those of the command's Parquet."""
    return {"scenario": scenario.name, "version": _clutch.BUILD, "scenario.toml": scenario.to_toml()}


# --- The sweep ---------------------------------------------------------------------------------


def sweep(
    base: ScenarioLike,
    parameters: Any,
    *,
    law: Law | None = None,
    metrics: str | Sequence[str] | None = None,
    seeds: int | Iterable[int] | None = None,
    traces: bool | Sequence[str] | None = None,
    every: int = 1,
    threads: int | None = None,
    executor: Any = None,
    chunk: int | None = None,
    progress: bool | Callable[[int, int], object] | None = None,
    errors: Literal["raise", "keep"] = "raise",
) -> SweepResult:
    """Simulate a scenario with many values of its keys.

    Each run is independent. The result is the same bit for bit on any number of threads, in chunks of any size and on
    any executor, and equals that of `simulate` for the scenario with these values.

    Ctrl-C ends the sweep within a fraction of a second and returns the finished rows, with ``interrupted=True``. If a
    worker dies, another runs its chunk; if the executor itself is gone, the remaining rows run in this process, with
    a warning. No row is lost.

    Parameters
    ----------
    base
        Scenario, name of a built-in one, or file.
    parameters
        A mapping of dotted keys to sequences of values: every combination of them, the last key changing
        fastest. Or `Samples` from `grid`, `sobol`, `latin_hypercube` or `samples`, or a table with a column
        for each key: `Table`, pandas or polars. Values may be numbers, choices (``"run.engine"``,
        ``"rig.base"``) and whole tables (``"law": [clutch.Pd(), clutch.Smc()]``, or as dicts).
    law
        A law of your own in place of the scenario's, as for `simulate`. An object is copied for each run, and a
        class makes one. A function is not copied: what it remembers in a closure or a global goes on from run to
        run, so give a law with memory as an object or a class. Python runs one such run at a time in a process: an
        executor of processes runs several, and needs a law that can be pickled. An exception of the law ends the
        sweep, with ``errors="keep"``, too.
    metrics
        Names of fields of `Metrics`, and "certified_continuous_time": true if the gains are certified so for the row's
        bounds. Default: all of them but the meter's bounds, which a sweep does not have.
    seeds
        A number n for the seeds 1 … n, or seeds: each row is run with each. One run is one draw; compare
        over several seeds.
    traces
        Columns of samples to keep of each run; True for time, error and voltage. Default: none.
    every
        Keep each `every`-th sample, from the first.
    threads
        Number of threads in this process, at most: few short runs take fewer. Default: one for each core.
    executor
        Runs chunks of rows, each on one thread: see `clutch.executors`. Default: threads of this process.
    chunk
        Rows of a chunk. Default: four chunks for each worker, or 64 rows if their number is not known.
    progress
        True: a progress bar; False: none; a function: called with the finished and all runs. Default: a bar
        if somebody watches, on a terminal or in a notebook, and the sweep takes more than a second.
    errors
        "raise": a row that the scenario refuses ends the sweep. "keep": it stays, with NaN for figures and
        the reason in the column "error".

    Returns
    -------
    SweepResult
        A table with a row for each run.

    Raises
    ------
    ParamError
        A row that the scenario refuses, with key, value and the row's number.
    ValueError
        Keys, metrics or options that do not exist.

    Examples
    --------
    >>> import clutch
    >>> result = clutch.sweep("pd_2", {"reference.ramp.rate_deg_s": [2.0, 20.0]})
    >>> result.table["stick_slip_cycles_per_s"].tolist()
    [55.5, 0.0]
    """
    scenario = as_scenario(base)
    chosen, each = _chosen(parameters, seeds)
    if progress is not None and not isinstance(progress, bool) and not callable(progress):
        raise TypeError(f"progress = {progress!r}: expected True, False, None or a function")
    if errors not in ("raise", "keep"):
        raise ValueError(f"errors: expected 'raise' or 'keep', got {errors!r}")
    if every < 1 or (chunk is not None and chunk < 1) or (threads is not None and threads < 1):
        raise ValueError(f"expected at least 1: every={every}, chunk={chunk}, threads={threads}")
    work = _Work(
        base=scenario,
        keys=chosen.keys,
        metrics=_known_metrics(metrics),
        traces=_known_traces(traces, scenario, chosen, law),
        every=every,
        keep=errors == "keep",
        name=uuid.uuid4().hex,
        law=law,
    )
    finished = _Finished(chosen)
    importlib.import_module("numpy")  # now, and not when Ctrl-C waits for an answer
    interrupted = False
    with _Progress(len(chosen), progress) as show:
        try:
            left = list(range(len(chosen)))
            if executor is not None:
                left = _run_there(work, finished, executor, chunk, show)
            if left:
                _run_here(work, finished, left, threads, show)
        except KeyboardInterrupt:
            interrupted = True
    if not work.keep and not interrupted:
        finished.check()
    return SweepResult(
        base=scenario,
        samples=chosen,
        table=finished.table(work.metrics),
        metrics=tuple(work.metrics),
        traces=dict(sorted(finished.traces().items())),
        seeds=each,
        interrupted=interrupted,
    )


def _chosen(parameters: Any, seeds: int | Iterable[int] | None) -> tuple[Samples, int]:
    """The runs that parameters and seeds mean, and the number of seeds of each."""
    if isinstance(parameters, Samples):
        chosen = parameters
    else:
        chosen = grid(parameters) if isinstance(parameters, Mapping) else samples(parameters)
    drawn = () if seeds is None else _seeds(seeds)
    return chosen._crossed("run.seed", drawn) if drawn else chosen, max(1, len(drawn))


def _seeds(seeds: int | Iterable[int]) -> tuple[int, ...]:
    """The seeds 1 … n for a number n, or those given."""
    if isinstance(seeds, bool):
        raise TypeError(f"seeds = {seeds}: expected a number of seeds, or seeds")
    try:
        n = operator.index(seeds)  # type: ignore[arg-type]
    except TypeError:
        return _values("seeds", seeds)
    return _values("seeds", range(1, n + 1))


_OF_SAMPLES = {"detected_least_cycles_per_s", "detected_most_cycles_per_s", "detected_told_cycles_per_s"}


def _known_metrics(metrics: str | Sequence[str] | None) -> list[str]:
    # Those that a run has of which only figures are kept.
    known = [*(name for name in FIGURES if name not in _OF_SAMPLES), _CERTIFIED]
    chosen = [metrics] if isinstance(metrics, str) else known if metrics is None else list(metrics)
    unknown = [m for m in chosen if m not in known]
    if unknown:
        raise ValueError(f"unknown metrics {', '.join(unknown)}; there are {', '.join(known)}")
    return chosen


def _known_traces(
    traces: bool | Sequence[str] | None, scenario: Scenario, chosen: Samples, own: Law | None
) -> list[str]:
    names = _TRACES if traces is True else traces or ()
    wanted = [names] if isinstance(names, str) else list[str](names)
    if wanted:
        period = 1e-6 * scenario.sampling.period_us
        short = {"run.duration_s": period, "run.settle_s": 0.0}
        # Each law has columns of its own; a run has those that are its law's.
        laws = chosen._distinct("law") or [{}]
        known: dict[str, None] = {}
        for law in laws:
            one = simulate(scenario, law=copy.deepcopy(own), overrides=short | law)
            known |= dict.fromkeys(one.samples.columns)
        unknown = [name for name in wanted if name not in known]
        if unknown:
            raise ValueError(f"unknown traces {', '.join(unknown)}; there are {', '.join(known)}")
    return wanted


@dataclass(frozen=True)
class _Work:
    """The common part of all runs of a sweep; it travels to the workers."""

    base: Scenario
    keys: tuple[str, ...]
    metrics: list[str]
    traces: list[str]
    every: int
    #: True if refused rows are kept.
    keep: bool
    #: Distinguishes this sweep from others.
    name: str
    #: A law in place of the scenario's.
    law: Law | None = None
    #: True in the sweep's own process; no longer once it has travelled.
    here: bool = True

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "here": False}

    def job(self, rows: Sequence[Sequence[Any]], threads: int | None) -> _clutch.Sweep | _OwnLaw:
        if self.law is not None:
            return _OwnLaw(self, rows)
        keys, values = list(self.keys), [list(row) for row in rows]
        if "rig.base" in keys:
            # As `Scenario.override`: the tables have every key of the rig, which would hide the base; and
            # the others change it.
            i = keys.index("rig.base")
            keys = ["rig", *keys[:i], *keys[i + 1 :]]
            values = [[{"base": row[i]}, *row[:i], *row[i + 1 :]] for row in values]
        return _clutch.Sweep(self.base, keys, values, self.metrics, self.traces, self.every, threads)


class _OwnLaw:
    """A job whose rows run here, one after the other, with a law written in Python."""

    def __init__(self, work: _Work, rows: Sequence[Sequence[Any]]) -> None:
        self._work, self._rows = work, rows
        self._done: list[Result | ParamError] = []
        self._stopped = False

    @property
    def finished(self) -> int:
        return len(self._done)

    @property
    def refused(self) -> int | None:
        """The first row that the scenario refuses."""
        return next((i for i, done in enumerate(self._done) if isinstance(done, ParamError)), None)

    def start(self) -> None:
        """Nothing: a row runs when it is waited for."""

    def cancel(self) -> None:
        self._stopped = True

    def wait(self, seconds: float) -> bool:
        """Run rows for a while; true if all are done."""
        until = time.monotonic() + seconds
        while not self._stopped and len(self._done) < len(self._rows):
            if time.monotonic() > until:
                return False
            overrides = dict(zip(self._work.keys, self._rows[len(self._done)], strict=True))
            try:
                law = as_law(copy.deepcopy(self._work.law))
                self._done.append(simulate(self._work.base, law=law, overrides=overrides))
            except ParamError as error:
                self._done.append(error)
        return True

    def result(self) -> _Result:
        import numpy as np

        runs = list(enumerate(self._done))
        columns: dict[str, Any] = {"row": np.arange(len(runs), dtype=np.int64)}
        for name in self._work.metrics:
            # A certificate is of the scenario's law, which did not run.
            kind, none = (bool, False) if name == _CERTIFIED else (float, math.nan)
            values = [getattr(done.metrics, name, none) if isinstance(done, Result) else none for _, done in runs]
            columns[name] = np.asarray([none if value is None else value for value in values], dtype=kind)
        errors = [str(done) if isinstance(done, ParamError) else "" for _, done in runs]
        columns["error"] = np.asarray(errors, dtype=object)
        traces = {
            i: Table({name: done.samples[name][:: self._work.every] for name in self._work.traces})
            for i, done in runs
            if isinstance(done, Result) and self._work.traces
        }
        return Table(columns), traces, [(i, done) for i, done in runs if isinstance(done, ParamError)]


class _Finished:
    """The finished rows, in the order in which they came."""

    def __init__(self, chosen: Samples) -> None:
        self.samples = chosen
        # One list, so that Ctrl-C finds a part wholly in it or not at all.
        self.parts: list[tuple[Sequence[int], _Result]] = []

    def __len__(self) -> int:
        return sum(len(result[0]) for _, result in self.parts)

    def add(self, numbers: Sequence[int], result: _Result) -> None:
        """All rows of a job, whose row i is the sweep's row ``numbers[i]``."""
        self.parts.append((numbers, result))

    def traces(self) -> dict[int, Table]:
        return {numbers[i]: trace for numbers, result in self.parts for i, trace in result[1].items()}

    def check(self) -> None:
        """Raise the refusal of the lowest row, if there is one."""
        refused = {numbers[i]: error for numbers, result in self.parts for i, error in result[2]}
        if refused:
            number = min(refused)
            error = refused[number]
            # The value as the user wrote it.
            value = dict(zip(self.samples.keys, self.samples.rows[number], strict=True)).get(error.field, error.value)
            raise ParamError(f"row {number}: {error}", error.field, value)

    def table(self, metrics: Sequence[str]) -> Table:
        import numpy as np

        tables = [(numbers, result[0]) for numbers, result in self.parts]
        numbers = [rows[i] for rows, table in tables for i in table["row"].tolist()]
        texts = [text for _, table in tables for text in table["error"]]
        order = np.argsort(np.asarray(numbers, dtype=np.int64), kind="stable")
        rows = np.asarray(numbers, dtype=np.int64)[order]
        columns: dict[str, Any] = {"row": rows}
        for i, key in enumerate(self.samples.keys):
            # From all rows, so that its type does not depend on which have finished.
            columns[key] = _column([row[i] for row in self.samples.rows])[rows]
        for name in metrics:
            parts = [table[name] for _, table in tables]
            nothing = np.empty(0, dtype=bool if name == _CERTIFIED else float)
            columns[name] = np.concatenate(parts)[order] if parts else nothing
        columns["error"] = np.asarray([texts[i] for i in order], dtype=object)
        return Table(columns)


def _column(values: list[Any]) -> Any:
    """Values of a key as a column; a value that is neither number nor text is shown as JSON."""
    import numpy as np

    if values and all(isinstance(v, bool) for v in values):
        return np.asarray(values, dtype=bool)
    if all(isinstance(v, int) and not isinstance(v, bool) for v in values):
        return np.asarray(values, dtype=np.int64)
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return np.asarray(values, dtype=np.float64)
    return np.asarray([_text(v) for v in values], dtype=object)


def _text(value: Any) -> str:
    """A value that is neither number nor text as JSON."""
    return value if isinstance(value, str) else json.dumps(value)


def _run_here(work: _Work, finished: _Finished, numbers: list[int], threads: int | None, show: _Progress) -> None:
    before = len(finished)
    job = work.job([finished.samples.rows[i] for i in numbers], threads)
    try:
        job.start()
        while not job.wait(_POLL_S) and (work.keep or job.refused is None):
            show(before + job.finished)
    finally:
        job.cancel()
        finished.add(numbers, job.result())
    show(len(finished))


def _run_there(work: _Work, finished: _Finished, executor: Any, chunk: int | None, show: _Progress) -> list[int]:
    """Run chunks on an executor; return the rows that it could not run."""
    if not callable(getattr(executor, "submit", None)):
        kind = type(executor).__name__
        raise TypeError(
            f"executor is of type {kind}: expected one with submit(function, *arguments), as clutch.executors"
        )
    rows = finished.samples.rows
    work.job(rows, 1)  # an error in the request itself is raised here, not by a worker
    workers = executors._workers(executor)
    size = chunk or (max(1, math.ceil(len(rows) / (4 * workers))) if workers else _CHUNK)
    numbers = [range(i, min(i + size, len(rows))) for i in range(0, len(rows), size)]

    def done(chunk: int, result: _Result | Exception) -> None:
        if isinstance(result, Exception):
            raise result
        finished.add(numbers[chunk], result)
        show(len(finished))
        if not work.keep:
            finished.check()

    calls = [(work, rows[n.start : n.stop]) for n in numbers]
    try:
        failed = executors._run(executor, _run_chunk, calls, done)
    except BaseException:
        _abandoned.add(work.name)
        raise
    left = [i for chunk in sorted(failed) for i in numbers[chunk]]
    if failed:
        why = next(iter(failed.values()))
        warnings.warn(
            f"{len(left)} of {len(rows)} rows could not be run by the executor and run in this process instead"
            f" ({type(why).__name__}: {why})",
            RuntimeWarning,
            stacklevel=3,
        )
    return left


#: Sweeps that were ended: their chunks in threads of this process check this set.
_abandoned: set[str] = set()


def _run_chunk(work: _Work, rows: Sequence[Sequence[Any]], attempt: int) -> _Result | Exception:
    """Run a chunk on one thread of a worker."""
    job = work.job(rows, 1)
    try:
        job.start()
        while not job.wait(_POLL_S):
            if work.name in _abandoned:
                break
    except KeyboardInterrupt:
        if work.here:  # an executor that runs a chunk at once: the sweep itself must end
            raise
        # This worker alone was interrupted, or all: the caller decides which.
        raise RuntimeError("the worker was interrupted") from None
    except Exception as error:
        if work.law is None:
            raise
        return error  # the law's own: another attempt would end alike
    finally:
        job.cancel()
    return job.result()


class _Progress:
    """A progress bar where one is wanted."""

    def __init__(self, total: int, wanted: bool | Callable[[int, int], object] | None) -> None:
        self._total, self._call = total, wanted if callable(wanted) else None
        self._shown = wanted is True or (wanted is None and _watched())
        self._begin = time.monotonic() + (0.0 if wanted is True else _SHOWN_AFTER_S)
        self._bar: Any = None

    def __enter__(self) -> _Progress:
        return self

    def __call__(self, finished: int) -> None:
        if self._call is not None:
            self._call(finished, self._total)
        elif self._shown and (self._bar is not None or time.monotonic() >= self._begin):
            self._bar = self._bar or _bar(self._total, finished)
            self._bar.update(finished - self._bar.n)

    def __exit__(self, *exception: object) -> None:
        if self._bar is not None:
            self._bar.close()


class _Line:
    """The progress bar without tqdm: a line that is overwritten."""

    def __init__(self, total: int) -> None:
        self.n, self._total = 0, total

    def update(self, more: int) -> None:
        self.n += more
        print(f"\r{self.n} of {self._total} runs", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        print(file=sys.stderr)


def _bar(total: int, finished: int) -> Any:
    try:
        with warnings.catch_warnings():
            # In a notebook without ipywidgets tqdm warns and falls back to text, which will do.
            warnings.simplefilter("ignore")
            tqdm = importlib.import_module("tqdm.auto").tqdm
    except ImportError:
        return _Line(total)
    return tqdm(total=total, initial=finished, unit="run")


def _watched() -> bool:
    """True if somebody watches: on a terminal, or in a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel") or (sys.stderr is not None and sys.stderr.isatty())


# --- The result --------------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class SweepResult:
    """The runs of a sweep.

    Parameters
    ----------
    base
        The scenario that was varied.
    samples
        The requested rows.
    table
        A row for each finished run: its number "row", its values of the swept keys, its metrics, and in
        "error" the reason why the scenario refused it ("" if it did not). Tables as values are shown as JSON.
    metrics
        Names of the metrics.
    traces
        The samples kept, by number of the run.
    seeds
        Number of seeds that each row of values was run with, one after the other.
    interrupted
        True if Ctrl-C ended it before all had run.

    Examples
    --------
    >>> import clutch
    >>> result = clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}, metrics=["max_error_rad"], seeds=2)
    >>> result
    <SweepResult: 4 runs over law.smc.kp_v, run.seed>
    >>> len(result), result.keys, result.table.columns
    (4, ('law.smc.kp_v', 'run.seed'), ['row', 'law.smc.kp_v', 'run.seed', 'max_error_rad', 'error'])
    """

    base: Scenario
    samples: Samples
    table: Table
    metrics: tuple[str, ...]
    traces: dict[int, Table]
    seeds: int = 1
    interrupted: bool = False

    @property
    def keys(self) -> tuple[str, ...]:
        """The swept keys, dotted.

        Examples
        --------
        >>> import clutch
        >>> clutch.sweep("smc_2", {"law.smc.kp_v": [3.0]}).keys
        ('law.smc.kp_v',)
        """
        return self.samples.keys

    @property
    def total(self) -> int:
        """Number of requested runs.

        Examples
        --------
        >>> import clutch
        >>> clutch.sweep("smc_2", {"law.smc.kp_v": [3.0]}, seeds=2).total
        2
        """
        return len(self.samples)

    def __len__(self) -> int:
        return len(self.table)

    def __repr__(self) -> str:
        return f"<SweepResult: {self._title()}>"

    def _title(self) -> str:
        n = f"interrupted, {len(self)} of {self.total}" if self.interrupted else f"{len(self)}"
        return f"{n} runs over {', '.join(self.keys)}"

    def _repr_html_(self) -> str:
        return f"<p>{self._title()}</p>{self.table._repr_html_()}"

    def scenario(self, i: int) -> Scenario:
        """The scenario of a row of the table.

        Parameters
        ----------
        i
            Row of `table`, from 0.

        Returns
        -------
        Scenario
            The base with the row's values.

        Raises
        ------
        IndexError
            There is no such row.
        ParamError
            The scenario refuses the row's values.

        Examples
        --------
        >>> import clutch
        >>> clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}).scenario(1).law.kp_v
        4.0
        """
        number = self.table["row"].tolist()[i]
        return self.base.override(dict(zip(self.keys, self.samples.rows[number], strict=True)))

    def best(self, metric: str) -> tuple[dict[str, Any], Scenario]:
        """The values with the lowest metric, by magnitude; over several seeds, with the lowest mean.

        Values of which a seed has not finished or was refused are left out, and so are those for which the
        metric is not a number.

        Parameters
        ----------
        metric
            One of `metrics`.

        Returns
        -------
        row : dict
            The keys' values, and each metric's mean over the seeds.
        scenario : Scenario
            The scenario with these values, with the first seed.

        Raises
        ------
        ValueError
            The metric was not taken, or there is no such row.

        Examples
        --------
        >>> import clutch
        >>> row, scenario = clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}).best("rms_error_rad")
        >>> row["law.smc.kp_v"], scenario.law.kp_v
        (4.0, 4.0)
        """
        if metric not in self.metrics:
            raise ValueError(f"metric {metric!r} was not taken; there are {', '.join(self.metrics)}")
        if metric == _CERTIFIED:
            raise ValueError(f"{_CERTIFIED} cannot be minimised; filter by it and rank by another metric")
        runs, texts = self.table["row"].tolist(), self.table["error"]
        columns = {name: self.table[name].tolist() for name in self.metrics}
        groups: dict[int, list[int]] = {}
        for i, (run, text) in enumerate(zip(runs, texts, strict=True)):
            if not text:
                groups.setdefault(run // self.seeds, []).append(i)
        means = {
            group: {name: math.fsum(column[i] for i in rows) / len(rows) for name, column in columns.items()}
            for group, rows in groups.items()
            if len(rows) == self.seeds
        }
        rated = [group for group, mean in means.items() if not math.isnan(mean[metric])]
        if not rated:
            raise ValueError(f"no values of which all {self.seeds} runs have finished with a {metric}")
        group = min(rated, key=lambda g: (abs(means[g][metric]), g))
        first = runs.index(group * self.seeds)
        keys = dict(zip(self.keys, self.samples.rows[runs[first]], strict=True))
        return keys | means[group], self.scenario(first)

    def plot(self, x: str, y: str, value: str, *, ax: Axes | None = None) -> Axes:
        """A map of a metric over two swept keys: `clutch.plot.sweep_map`.

        Parameters
        ----------
        x, y
            Swept keys.
        value
            A metric.
        ax
            Axes to draw on; default: a new figure.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Examples
        --------
        >>> import clutch
        >>> result = clutch.sweep("smc_2", {"law.smc.kp_v": [3, 4], "law.smc.boundary_rad_s": [0.1, 0.15]})
        >>> axes = result.plot("law.smc.kp_v", "law.smc.boundary_rad_s", "max_error_rad")
        """
        from clutch import plot

        return plot.sweep_map(self, x, y, value, ax=ax)

    def to_pandas(self) -> pandas.DataFrame:
        """The table as a data frame of pandas.

        Examples
        --------
        >>> import clutch
        >>> clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}).to_pandas().shape[0]
        2
        """
        return self.table.to_pandas()

    def to_polars(self) -> polars.DataFrame:
        """The table as a data frame of polars.

        Examples
        --------
        >>> import clutch
        >>> clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}).to_polars().height
        2
        """
        return self.table.to_polars()

    def to_arrow(self) -> pyarrow.Table:
        """The table as one of Arrow, with the scenario and the version of clutch in its metadata.

        Examples
        --------
        >>> import clutch
        >>> clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}).to_arrow().num_rows
        2
        """
        return self.table.to_arrow().replace_schema_metadata(_origin(self.base))

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self.table.__arrow_c_stream__(requested_schema)

    def to_xarray(self) -> xarray.Dataset:
        """The metrics with labelled dimensions: those of a full grid have the keys' names, else it is "row".

        Runs that have not finished are NaN. Each metric has its unit and its name in words as attributes, which
        xarray's plots show; each dimension has its unit.

        Examples
        --------
        >>> import clutch
        >>> result = clutch.sweep("smc_2", {"law.smc.kp_v": [3.0, 4.0]}, seeds=3)
        >>> dict(result.to_xarray()["max_error_rad"].sizes)
        {'law.smc.kp_v': 2, 'run.seed': 3}
        """
        import numpy as np

        with needed("xarray", "to_xarray"):
            import xarray

        def described(name: str) -> dict[str, str]:
            meaning = self.base._native.meaning(name)
            return attributes(name) | ({} if meaning is None else {"long_name": meaning})

        runs, names = self.table["row"], [*self.metrics, "error"]
        if self.samples.axes is None:
            coords = {key: ("row", np.asarray(self.table[key]), described(key)) for key in self.keys}
            columns = {name: ("row", np.asarray(self.table[name]), described(name)) for name in names}
            return xarray.Dataset(columns, coords={"row": runs} | coords)
        axes = [np.asarray(_column(list(axis))) for axis in self.samples.axes]
        shape = [len(axis) for axis in axes]
        values = {}
        for name in names:
            column = np.asarray(self.table[name], dtype=object if name == "error" else float)
            if len(self) < self.total:
                some, column = column, np.full(self.total, "" if name == "error" else math.nan, dtype=column.dtype)
                column[runs] = some
            values[name] = (self.keys, column.reshape(shape), described(name))
        coords = {key: (key, axis, described(key)) for key, axis in zip(self.keys, axes, strict=True)}
        return xarray.Dataset(values, coords=coords)
