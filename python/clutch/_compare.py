"""Comparison: several runs side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from math import nan
from typing import TYPE_CHECKING

from clutch._clutch import Table
from clutch._metrics import FIGURES
from clutch._run import Result, ScenarioLike, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Comparison:
    """Several runs, as :func:`clutch.compare` returns them.

    Attributes
    ----------
    results : list of Result
        The runs.
    labels : list of str
        A name for each.

    Examples
    --------
    >>> import clutch
    >>> both = clutch.compare("pd_2", "smc_2", labels=["PD", "sliding mode"])
    >>> both["PD"].metrics.max_error_rad < both["sliding mode"].metrics.max_error_rad
    True
    """

    def __init__(self, results: Sequence[Result], labels: Sequence[str]) -> None:
        self.results = list(results)
        self.labels = list(labels)

    def __len__(self) -> int:
        return len(self.results)

    def __iter__(self) -> Iterator[Result]:
        return iter(self.results)

    def __getitem__(self, label: str) -> Result:
        """Return the run of that name."""
        if label not in self.labels:
            raise KeyError(f"{label}: no such run; there are {', '.join(self.labels)}")
        return self.results[self.labels.index(label)]

    @property
    def table(self) -> Table:
        """A row for each run: its name, column ``run``, and its figures, SI and radians; NaN where it has none."""
        columns: dict[str, list[str] | list[float]] = {"run": self.labels}
        for name in FIGURES:
            values = [getattr(result.metrics, name) for result in self.results]
            columns[name] = [nan if value is None else value for value in values]
        return Table(columns)

    def _rows(self) -> Iterator[tuple[str, str, list[str]]]:
        """Label, unit and values of each figure, as people are shown them."""
        for name, figure in FIGURES.items():
            values = (getattr(result.metrics, name) for result in self.results)
            yield figure.label, figure.shown_unit, ["–" if v is None else f"{v * figure.factor:.5g}" for v in values]

    def __repr__(self) -> str:
        return f"<Comparison of {', '.join(self.labels)}>"

    def __str__(self) -> str:
        """The figures side by side in at most 80 columns, a column for each run; runs that do not fit stand below."""
        rows = [(f"{label} ({unit})" if unit else label, values) for label, unit, values in self._rows()]
        wide = max(len(name) for name, _ in rows)
        # Long names stand above the table, and numbers over its columns.
        short = all(len(label) <= 12 for label in self.labels)
        heads = self.labels if short else [f"[{number}]" for number in range(1, len(self) + 1)]
        widths = [max(len(head), *(len(row[i]) for _, row in rows)) for i, head in enumerate(heads)]
        blocks: list[list[int]] = [[]]
        for i, width in enumerate(widths):
            if blocks[-1] and wide + sum(widths[j] + 2 for j in blocks[-1]) + width + 2 > 80:
                blocks.append([])
            blocks[-1].append(i)

        def line(name: str, cells: Sequence[str], block: Sequence[int]) -> str:
            return name.ljust(wide) + "".join(f"  {cells[i]:>{widths[i]}}" for i in block)

        legend = [] if short else [f"{head} {label}" for head, label in zip(heads, self.labels, strict=True)]
        tables = [[line("", heads, b), *(line(name, values, b) for name, values in rows)] for b in blocks]
        return "\n".join(legend + [text for table in tables for text in table])

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{escape(label)}</th>" for label in self.labels)
        rows = "".join(
            f"<tr><td>{escape(label)}</td>{''.join(f'<td>{value}</td>' for value in values)}<td>{unit}</td></tr>"
            for label, unit, values in self._rows()
        )
        return f"<table><tr><th></th>{head}<th></th></tr>{rows}</table>"

    def plot(self) -> Figure:
        """Draw the runs on common axes: :func:`clutch.plot.comparison`."""
        from clutch import plot

        return plot.comparison(self.results, labels=self.labels)


def compare(
    *runs: ScenarioLike | Result,
    labels: Sequence[str] | None = None,
    overrides: Mapping[str, object] | None = None,
) -> Comparison:
    """Run several scenarios and set them side by side, as ``clutch compare``.

    Parameters
    ----------
    *runs : Scenario, str, path or Result
        Two or more: scenarios, names of built-in ones, TOML files; or runs that there are already.
    labels : sequence of str, optional
        A name for each, all different; by default the scenarios' names, with a number where these are alike.
    overrides : mapping, optional
        Values for dotted keys of all scenarios, as ``{"reference.ramp.rate_deg_s": 6}``.

    Returns
    -------
    Comparison
        The runs, a table of their figures, and a picture on common axes.

    Raises
    ------
    ValueError
        Fewer than two runs; another number of labels, or two alike; overrides for a run that there is already.
    ParamError
        A value that a scenario refuses; its ``field`` is the key.
    OSError
        A file cannot be read.

    Examples
    --------
    >>> import clutch
    >>> both = clutch.compare("bench_pd_2", "bench_smc_2")
    >>> both.table["stick_slip_cycles_per_s"].tolist()
    [40.75, 9.0]
    """
    if len(runs) < 2:
        raise ValueError(f"compare: expected two runs or more, got {len(runs)}")
    if overrides and any(isinstance(run, Result) for run in runs):
        raise ValueError("compare: overrides: expected scenarios; a Result has run already")
    results = [run if isinstance(run, Result) else simulate(run, overrides=overrides) for run in runs]
    if labels is None:
        names = [result.scenario.name for result in results]
        labels = [f"{name} ({i + 1})" if names.count(name) > 1 else name for i, name in enumerate(names)]
    names = [str(label) for label in labels]
    if len(names) != len(results) or len(set(names)) < len(names):
        raise ValueError(f"compare: labels = {names!r}: expected {len(results)} different ones, one for each run")
    return Comparison(results, names)
