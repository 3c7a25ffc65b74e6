"""Sweeps whose rows go into a file as they are done, and go on where they have ended."""

from __future__ import annotations

import csv
import io
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clutch._extras import needed
from clutch._model import Scenario
from clutch._run import Law, ScenarioLike, as_scenario
from clutch._sweep import _CERTIFIED, Samples, _chosen, _column, _known_metrics, _origin, _Progress, _text, sweep
from clutch._units import attributes

__all__ = ["SweptFile", "sweep_to_file"]

#: Rows between two times that the file is written: at first and at least, and at most.
_ROWS = (16, 65_536)
#: Bytes that a line of a sweep never has.
_LONGEST = 1 << 20
#: Time between two of them, s.
_PAUSE_S = 1.0


@dataclass(frozen=True)
class SweptFile:
    """A file with the rows of a sweep.

    Parameters
    ----------
    path : pathlib.Path
        The file; of a Parquet file that is not whole, the CSV beside it, in which the rows are.
    rows, total : int
        Rows in it, and rows of the sweep.
    before : int
        Rows that it had before.
    refused : int
        Rows that the scenario refuses, each with the reason in its column ``error``.
    interrupted : bool
        True if Ctrl-C has ended the sweep.

    Examples
    --------
    >>> import clutch, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = clutch.sweep_to_file(pathlib.Path(folder, "pd.csv"), "pd_2", {"law.pd.kp_v_rad": [1000.0, 2000.0]})
    >>> done.rows, done.total, done.refused
    (2, 2, 0)
    """

    path: Path
    rows: int
    total: int
    before: int
    refused: int
    interrupted: bool


def sweep_to_file(
    out: str | os.PathLike[str],
    base: ScenarioLike,
    parameters: Any,
    *,
    resume: bool = False,
    law: Law | None = None,
    metrics: str | Sequence[str] | None = None,
    seeds: int | Iterable[int] | None = None,
    threads: int | None = None,
    executor: Any = None,
    progress: bool | Callable[[int, int], object] | None = None,
) -> SweptFile:
    """Simulate a scenario with many values of its keys, and write the rows to a file as they are done.

    The rows are those of `sweep` with ``errors="keep"``, bit for bit, in their order. They are written about each
    second, so that a sweep that is killed loses no more, and figures of no more are in memory. Ctrl-C keeps what has
    ended.

    Parameters
    ----------
    out
        The table: CSV, or Parquet if it ends so, which is made at the end, of a CSV beside it.
    base, parameters, law, metrics, seeds, threads, executor, progress
        As for `sweep`.
    resume
        True to go on with a file that an earlier sweep of the same rows has begun. Each row's values are held against
        the sweep's own, and its last row is run again.

    Returns
    -------
    SweptFile
        The contents of the file.

    Raises
    ------
    FileExistsError
        The file is there already, and ``resume`` is False.
    ValueError
        A file of another sweep, or of another kind than CSV and Parquet; keys, metrics or options that do not exist.

    Examples
    --------
    >>> import clutch, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     out = pathlib.Path(folder, "rates.csv")
    ...     _ = clutch.sweep_to_file(out, "pd_2", {"reference.ramp.rate_deg_s": [2.0, 20.0]}, metrics="max_error_rad")
    ...     print(out.read_text().splitlines()[0])
    reference.ramp.rate_deg_s,max_error_rad,error
    """
    out = Path(out)
    scenario = as_scenario(base)
    chosen, _ = _chosen(parameters, seeds)
    names = _known_metrics(metrics)
    whole = out.suffix.lower() == ".parquet"
    if not whole and out.suffix.lower() != ".csv":
        raise ValueError(f"{out}: expected a name that ends with .csv or .parquet")
    if whole:
        with needed("pyarrow", "sweep_to_file with Parquet"):
            import pyarrow.csv  # noqa: F401  # before the sweep, and not at its end
        if out.exists():
            raise FileExistsError(f"{out}: is there already; name another file")
    lines = out.with_name(f"{out.name}.part.csv") if whole else out
    table = _Lines(lines, chosen, names)

    def run(rows: range) -> list[bytes]:
        """The lines of some rows, up to the first that Ctrl-C has kept from its end."""
        part = Samples(chosen.keys, chosen.rows[rows.start : rows.stop])
        found = sweep(
            scenario, part, law=law, metrics=names, threads=threads, executor=executor, progress=False, errors="keep"
        )
        columns = [*(found.table[name].tolist() for name in names), list(found.table["error"])]
        whole_rows = (i for i, row in enumerate(found.table["row"].tolist()) if i == row)
        return [table.line(rows.start + i, [column[i] for column in columns]) for i in whole_rows]

    before, refused = table.begin(resume, run)
    done, size, interrupted = before, _ROWS[0], False
    with _Progress(len(chosen), progress) as show:
        while done < len(chosen) and not interrupted:
            begun = time.monotonic()
            rows = range(done, min(done + size, len(chosen)))
            # Within its runs a sweep gives those that have ended; before and behind them there are none.
            try:
                new = run(rows)
            except KeyboardInterrupt:
                new = []
            interrupted = len(new) < len(rows)
            refused += sum(_is_refused(line) for line in new)
            table.add(new)
            done += len(new)
            show(done)
            growth = _PAUSE_S / max(time.monotonic() - begun, 1e-3)
            size = min(max(int(size * min(max(growth, 0.25), 4.0)), _ROWS[0]), _ROWS[1])
    if whole and done == len(chosen):
        _to_parquet(lines, out, scenario, chosen, names)
        lines.unlink()
        lines = out
    return SweptFile(lines, done, len(chosen), before, refused, interrupted)


def _is_refused(line: bytes) -> bool:
    """True if a line is of a row that was refused: its last column has the reason."""
    return not line.endswith(b",\n")


def _cell(value: Any) -> str:
    """A value as the file has it: numbers so that reading gives the same bits, nothing where there is none."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return "" if math.isnan(value) else repr(value)
    return " ".join(_text(value).splitlines())


def _joined(cells: Iterable[str]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


class _Lines:
    """The file that rows are added to."""

    def __init__(self, path: Path, chosen: Samples, metrics: Sequence[str]) -> None:
        self._path, self._chosen = path, chosen
        self._head = _joined([*chosen.keys, *metrics, "error"])

    def line(self, row: int, figures: Iterable[Any]) -> bytes:
        return _joined([*self._values(row), *map(_cell, figures)])

    def add(self, lines: Sequence[bytes]) -> None:
        with self._path.open("ab") as file:
            file.writelines(lines)

    def begin(self, resume: bool, run: Callable[[range], list[bytes]]) -> tuple[int, int]:
        """Rows that are there, and how many of them were refused; without any the file has its head alone."""
        if resume and self._path.exists():
            return self._go_on(run)
        try:
            with self._path.open("xb") as file:
                file.write(self._head)
        except FileExistsError:
            message = f"{self._path}: is there already; resume=True goes on with it, or name another file"
            raise FileExistsError(message) from None
        return 0, 0

    def _values(self, row: int) -> list[str]:
        return [_cell(value) for value in self._chosen.rows[row]]

    def _go_on(self, run: Callable[[range], list[bytes]]) -> tuple[int, int]:
        last, length, rows, refused = b"", 0, -1, 0
        for line in self._whole_lines():
            if rows < 0 and line != self._head:
                raise ValueError(f"{self._path}: has other columns than this sweep; name another file")
            if rows >= len(self._chosen):
                raise ValueError(f"{self._path}: has more rows than this sweep, {len(self._chosen)}; name another file")
            if rows >= 0:
                expected = self._values(rows)
                if not line.startswith(_joined(expected)[:-1] + b","):
                    raise ValueError(
                        f"{self._path}: its row {rows} has other values than this sweep gives it, "
                        f"{', '.join(expected)}; name another file"
                    )
                refused += _is_refused(line)
            last, length, rows = line, length + len(line), rows + 1
        if rows < 0:
            raise ValueError(f"{self._path}: has no header of a sweep; name another file")
        again = run(range(rows - 1, rows)) if rows > 0 else [last]
        if not again:
            raise KeyboardInterrupt
        if again != [last]:
            raise ValueError(
                f"{self._path}: its row {rows - 1} is not what this sweep gives: it is of another scenario or another "
                "version of clutch; name another file"
            )
        os.truncate(self._path, length)
        return rows, refused

    def _whole_lines(self) -> Iterator[bytes]:
        with self._path.open("rb") as file:
            for line in iter(lambda: file.readline(_LONGEST), b""):
                if not line.endswith(b"\n"):
                    if len(line) == _LONGEST:
                        raise ValueError(
                            f"{self._path}: has a line of more than {_LONGEST} bytes, as no sweep writes it; "
                            "name another file"
                        )
                    return  # a kill has cut it off
                yield line


def _to_parquet(lines: Path, out: Path, scenario: Scenario, chosen: Samples, metrics: Sequence[str]) -> None:
    """The same as Parquet, with units and labels in the fields, a part at a time."""
    import pyarrow
    from pyarrow import csv as reader
    from pyarrow import parquet

    kinds = {name: pyarrow.bool_() if name == _CERTIFIED else pyarrow.float64() for name in metrics}
    kinds["error"] = pyarrow.string()
    for i, key in enumerate(chosen.keys):
        of = _column([row[i] for row in chosen.rows]).dtype
        kinds[key] = pyarrow.string() if of.kind == "O" else pyarrow.from_numpy_dtype(of)
    names = [*chosen.keys, *metrics, "error"]
    fields = [pyarrow.field(name, kinds[name], metadata=attributes(name)) for name in names]
    schema = pyarrow.schema(fields, metadata=_origin(scenario))
    options = reader.ConvertOptions(column_types=kinds, strings_can_be_null=False)
    part = out.with_name(f"{out.name}.part")
    try:
        with reader.open_csv(lines, convert_options=options) as parts, parquet.ParquetWriter(part, schema) as file:
            for some in parts:
                file.write_batch(some.cast(schema))
        # It has its name once it is whole: until then the lines are what there is, and go on.
        part.replace(out)
    finally:
        part.unlink(missing_ok=True)
