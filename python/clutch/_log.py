"""Logs: the record of a loop or a simulation, and its replay."""

from __future__ import annotations

import os
import pathlib
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from clutch import _clutch
from clutch._clutch import Table
from clutch._extras import needed
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
        self._toml: str = log.scenario_toml
        self.scenario = Scenario.from_toml(self._toml)
        self.complete: bool = log.complete
        self.damaged: int = log.damaged

        self._pictured: tuple[tuple[float, float, str, bool] | None, Table] | None = None

    def _picture(self) -> tuple[tuple[float, float, str, bool] | None, Table]:
        """The stretch that a picture shows closely, and the times at rest."""
        if self._pictured is None:
            self._pictured = self._log.pictured()
        return self._pictured

    @property
    def window(self) -> tuple[float, float] | None:
        """Begin and end of the stretch that :meth:`plot` shows closely, s: around a stick, else the largest error."""
        window = self._picture()[0]
        return None if window is None else window[:2]

    @property
    def sticks(self) -> Table:
        """Times at rest, from_s and to_s: the shaft's own in a simulation's log, in a loop's the encoder's silences."""
        return self._picture()[1]

    def export(self, path: str | os.PathLike[str], channel: str = "command") -> None:
        """Write a channel as Parquet or Arrow: every number as it is in the log, each column with unit and meaning.

        Columns are those of ``channels``; a term that a record does not have is NaN. The fields' metadata are
        ``units`` and ``long_name``, the file's the log's own description and its scenario. For CSV there is
        ``clutch log export``.

        Parameters
        ----------
        path : str or path
            A new file; ``.parquet`` is compressed with zstd, ``.arrow`` is Arrow's own format, to be mapped into
            memory.
        channel : str, default "command"
            Name of the channel.

        Raises
        ------
        ValueError
            Another ending, or a channel without records.
        OSError
            The file is there already, or cannot be written.
        ModuleNotFoundError
            pyarrow is not installed: ``pip install 'clutch-control[pandas]'``.

        Examples
        --------
        >>> import clutch, pathlib, pyarrow.parquet, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder)
        ...     clutch.simulate("smc_2").save(path / "run.mcap")
        ...     clutch.read_log(path / "run.mcap").export(path / "run.parquet")
        ...     schema = pyarrow.parquet.read_schema(path / "run.parquet")
        >>> sorted(schema.field("voltage_v").metadata.items())
        [(b'long_name', b'Voltage of the code'), (b'units', b'V')]
        """
        with needed("pyarrow", "Log.export"):
            import pyarrow as pa
            import pyarrow.parquet as parquet

        file = pathlib.Path(path)
        ending = file.suffix.lower()
        if ending not in (".parquet", ".arrow"):
            raise ValueError(f"{file}: expected a name that ends with .parquet or .arrow; for CSV: clutch log export")
        if channel not in self.channels:
            raise ValueError(f"channel = {channel!r}: expected one with records, {', '.join(self.channels)}")
        if file.exists():
            raise FileExistsError(f"{file}: exists already")
        table = self.channels[channel].to_arrow()
        table = table.replace_schema_metadata({**self.metadata, "channel": channel, "scenario.toml": self._toml})
        # A table that is begun has another name, which nothing else has: half a table is none.
        part = file.with_name(f"{file.name}.{secrets.token_hex(4)}.part")
        try:
            if ending == ".parquet":
                parquet.write_table(table, part, compression="zstd")
            else:
                with pa.OSFile(os.fspath(part), "wb") as sink, pa.ipc.new_file(sink, table.schema) as writer:
                    writer.write_table(table)
            part.replace(file)
        finally:
            part.unlink(missing_ok=True)

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
    behind_gap : int
        Commands behind the log's first gap, which are not comparable: a damaged part, or records that were dropped.
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
    >>> clutch.Replay(ticks=0, behind_gap=0, first=None, commands=clutch.Table({}), drift={}).identical
    True
    """

    ticks: int
    behind_gap: int
    first: Difference | None
    commands: Table
    drift: dict[str, Any]

    @property
    def identical(self) -> bool:
        """True if every output agrees with the log, bit for bit, and none is behind a gap."""
        return self.first is None and self.behind_gap == 0


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
        counts: an open loop, which does not predict the motion of the shaft. With other bounds friction over
        load is held against those.
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
    commands, (ticks, behind_gap), first, drift = opened._log.replay(changed, as_law(law))
    difference = None
    if first is not None:
        tick, field, logged, replayed = first
        difference = Difference(tick=tick, field=field, logged=logged, replayed=replayed)
    return Replay(ticks=ticks, behind_gap=behind_gap, first=difference, commands=commands, drift=drift)
