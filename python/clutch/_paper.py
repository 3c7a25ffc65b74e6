"""The paper, reproduced: its figures 8 to 10, its Table 3, and every statement of its section 4."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from clutch import _clutch
from clutch._clutch import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy import float64
    from numpy.typing import NDArray


TABLE3 = (
    "rate_deg_s",
    "pd_cycles_per_s",
    "smc_cycles_per_s",
    "reduction_percent",
    "spread_points",
    "counted_reduction_percent",
    "paper_percent",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class PaperPanel:
    """One panel of a figure.

    Attributes
    ----------
    rate_deg_s : float
        Rate of the ramp, °/s.
    experiment : bool
        On the rig ``bench``, the stand-in for the paper's experiment; else the paper's simulation.
    time_s, error_deg : array
        Time, s, and position error, °; shape (N,).

    Examples
    --------
    >>> import clutch
    >>> panel = clutch.reproduce(progress=False).figures[0].panels[0]
    >>> panel.experiment, len(panel.time_s) == len(panel.error_deg)
    (False, True)
    """

    rate_deg_s: float
    experiment: bool
    time_s: NDArray[float64]
    error_deg: NDArray[float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class PaperFigure:
    """One of the paper's figures: position errors with one law.

    Attributes
    ----------
    number : int
        8 (PD), 9 (computed torque) or 10 (sliding mode).
    law : str
        Its name in the paper.
    panels : tuple of PaperPanel
        A row for each rate, simulation and experiment.

    Examples
    --------
    >>> import clutch
    >>> clutch.PaperFigure(number=8, law="PD controller", panels=()).number
    8
    """

    number: int
    law: str
    panels: tuple[PaperPanel, ...]


class Reproduction:
    """The outcome: the object that :func:`clutch.reproduce` returns.

    Attributes
    ----------
    claims : Table
        A row for each statement: id, paper, measured, unit, low and high (the band in which it agrees; NaN is
        unbounded), holds, as_documented, fitted (true if the rig ``bench`` was fitted to it), note.
    table3 : Table
        rate_deg_s, pd_cycles_per_s, smc_cycles_per_s, reduction_percent, spread_points,
        counted_reduction_percent (of the cycles that the encoder's silences show), paper_percent.
    figures : tuple of PaperFigure
        Figures 8, 9 and 10.

    Examples
    --------
    >>> import clutch
    >>> paper = clutch.reproduce(progress=False)
    >>> paper.as_documented
    True
    >>> [figure.number for figure in paper.figures]
    [8, 9, 10]
    """

    def __init__(self, paper: _clutch.Paper) -> None:
        documented: list[bool] = paper.as_documented()
        claims: list[dict[str, Any]] = paper.claims()
        nan = float("nan")

        def end(claim: dict[str, Any], i: int) -> float:
            value = claim["band"][i]
            return nan if value is None else float(value)

        self.claims = Table(
            {
                "id": [c["id"] for c in claims],
                "paper": [c["paper"] for c in claims],
                "measured": [float(c["measured"]) for c in claims],
                "unit": [c["unit"] for c in claims],
                "low": [end(c, 0) for c in claims],
                "high": [end(c, 1) for c in claims],
                "holds": [c["holds"] for c in claims],
                "as_documented": documented,
                "fitted": [c["fitted"] for c in claims],
                "note": [c["note"] for c in claims],
            }
        )
        rows: list[dict[str, float]] = paper.table3()
        self.table3 = Table({name: [float(row[name]) for row in rows] for name in TABLE3})
        self.figures = tuple(
            PaperFigure(
                number=number,
                law=law,
                panels=tuple(
                    PaperPanel(rate_deg_s=r, experiment=e, time_s=s["time_s"], error_deg=s["error_deg"])
                    for r, e, s in panels
                ),
            )
            for number, law, panels in paper.figures()
        )

    @property
    def as_documented(self) -> bool:
        """True if every statement holds, or fails just as the documentation says."""
        return all(self.claims["as_documented"].tolist())

    def plot(self, number: int) -> Figure:
        """Draw figure 8, 9 or 10 in the paper's arrangement: :func:`clutch.plot.paper_figure`."""
        from clutch import plot

        for figure in self.figures:
            if figure.number == number:
                return plot.paper_figure(figure)
        raise ValueError(f"number = {number}: expected 8, 9 or 10")

    def __repr__(self) -> str:
        held = int(self.claims["holds"].sum())
        return f"<Reproduction: {held} of {len(self.claims)} statements hold>"

    def _repr_html_(self) -> str:
        c = self.claims
        rows = "".join(
            f"<tr><td>{'✓' if c['holds'][i] else '✗'}</td><td>{escape(c['paper'][i])}</td>"
            f"<td>{c['measured'][i]:.4g} {escape(c['unit'][i])}</td></tr>"
            for i in range(len(c))
        )
        return f"<table><tr><th></th><th>the paper</th><th>measured</th></tr>{rows}</table>"


def reproduce(*, progress: bool | None = None) -> Reproduction:
    """Run the paper: the runs of ``clutch reproduce``, some seconds on two cores.

    Parameters
    ----------
    progress : bool, optional
        True to show the progress; by default on a terminal only.

    Returns
    -------
    Reproduction
        Claims, Table 3, figures.

    Examples
    --------
    >>> import clutch
    >>> table3 = clutch.reproduce(progress=False).table3
    >>> bool((table3["reduction_percent"] > 80).all())
    True
    """
    shown = sys.stderr.isatty() if progress is None else progress

    def tell(finished: int, total: int) -> None:
        end = "\n" if finished == total else ""
        print(f"\rthe paper: {finished}/{total} runs", end=end, file=sys.stderr, flush=True)

    return Reproduction(_clutch.reproduce(tell if shown else None))
