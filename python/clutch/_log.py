"""Logs: the record of a loop or a simulation, and its replay."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from clutch import _clutch
from clutch._clutch import Table
from clutch._model import Scenario
from clutch._run import as_law

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from clutch._run import Law


class Log:
    """A log in memory, as :func:`clutch.read_log` returns it.

    Attributes
    ----------
    channels : dict of str to Table
        ``"sample"``, ``"command"``, ``"event"``, ``"link"``, ``"truth"``: those that have records. Columns are named as
        in docs/log.md, with ``time_s``, the time since the start of the run, before them.
    metadata : dict of str to str
        The log's description of itself: version, port, source, law hash …
    scenario : Scenario
        The scenario that ran.
    complete : bool
        Finished by its writer and without damage.
    damaged : int
        Damaged places that were skipped.

    Examples
    --------
    >>> import clutch, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "run.mcap"
    ...     clutch.simulate("smc_2").save(path)
    ...     log = clutch.read_log(path)
    >>> list(log.channels)
    ['sample', 'command', 'truth']
    >>> log.channels["command"]["voltage_v"].max().item() <= 10
    True
    """

    def __init__(self, log: _clutch.Log) -> None:
        self._log = log
        self.channels: dict[str, Table] = log.channels()
        self.metadata: dict[str, str] = log.metadata
        self.scenario = Scenario.from_toml(log.scenario_toml)
        self.complete: bool = log.complete
        self.damaged: int = log.damaged

    def plot(self) -> Figure:
        """Draw an overview: :func:`clutch.plot.log_overview`."""
        from clutch import plot

        return plot.log_overview(self)

    def __repr__(self) -> str:
        records = ", ".join(f"{name} {len(table)}" for name, table in self.channels.items())
        cut = "" if self.complete else ", not complete"
        return f"<Log of {self.scenario.name!r} ({self.metadata['source']}): {records}{cut}>"


@dataclass(frozen=True, kw_only=True)
class Difference:
    """The first tick and field in which a replay differs from its log.

    Attributes
    ----------
    tick : int
        Tick of the run, from 0.
    field : str
        Column of the channel ``command``.
    logged, replayed : float
        Both values.

    Examples
    --------
    >>> import clutch
    >>> clutch.Difference(tick=3, field="code", logged=2507.0, replayed=2508.0).tick
    3
    """

    tick: int
    field: str
    logged: float
    replayed: float


@dataclass(frozen=True, kw_only=True)
class Replay:
    """A log's counts run through a law again.

    Attributes
    ----------
    ticks : int
        Commands compared.
    first : Difference or None
        The first difference, if there is one.
    commands : Table
        The law's commands in the replay, a row for each command of the log.
    drift : dict
        Friction over load in the log against the bounds of the scenario, as :class:`clutch.LoopResult` has it.

    Examples
    --------
    See :func:`clutch.replay`.

    >>> import clutch
    >>> clutch.Replay(ticks=0, first=None, commands=clutch.Table({}), drift={}).identical
    True
    """

    ticks: int
    first: Difference | None
    commands: Table
    drift: dict[str, Any]

    @property
    def identical(self) -> bool:
        """True if every output agrees with the log, bit for bit."""
        return self.first is None


def read_log(path: str | os.PathLike[str]) -> Log:
    """Read an MCAP log of ``clutch loop``, ``clutch sim --log`` or :meth:`clutch.Result.save`.

    A log that was cut, by a crash or a full disk, is read too: ``complete`` is then false.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    Log
        Its channels as tables.

    Raises
    ------
    OSError
        The file cannot be read.
    ValueError
        It is not a log of clutch, or its header is damaged.

    Examples
    --------
    >>> import clutch
    >>> clutch.read_log("no_such.mcap")
    Traceback (most recent call last):
    FileNotFoundError: [Errno 2] no_such.mcap: cannot open: No such file or directory (os error 2): 'no_such.mcap'
    """
    return Log(_clutch.read_log(os.fspath(path)))


def replay(
    log: Log | str | os.PathLike[str], overrides: Mapping[str, object] | None = None, *, law: Law | None = None
) -> Replay:
    """Feed a log's encoder counts to its law again, and compare every output bit for bit.

    Parameters
    ----------
    log : Log, str or path
        The log, or its file.
    overrides : mapping, optional
        Values for dotted keys of its scenario. The law then gives the commands that it would have given on the same
        counts: an open loop, which does not predict the motion of the shaft. Other bounds are those against which
        friction over load is held.
    law : callable or object, optional
        The law of a simulation whose law was written in Python, as for :func:`clutch.simulate`.

    Returns
    -------
    Replay
        The commands, and the first difference.

    Raises
    ------
    OSError
        The file cannot be read.
    ValueError
        The log cannot be replayed: it is damaged, or of a run with an ideal sensor, or of a law written in Python,
        which was not given.

    Examples
    --------
    >>> import clutch, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "run.mcap"
    ...     clutch.simulate("smc_2").save(path)
    ...     log = clutch.read_log(path)
    >>> clutch.replay(log).identical
    True
    >>> clutch.replay(log, {"law.smc.kp_v": 4}).first.field
    'switching_v'
    """
    opened = log if isinstance(log, Log) else read_log(log)
    changed = opened.scenario.override(overrides)._native if overrides else None
    commands, ticks, first, drift = opened._log.replay(changed, as_law(law))
    difference = None
    if first is not None:
        tick, field, logged, replayed = first
        difference = Difference(tick=tick, field=field, logged=logged, replayed=replayed)
    return Replay(ticks=ticks, first=difference, commands=commands, drift=drift)
