"""Figures that can be printed: tracking error, stick-slip, friction, gains, logs.

Each function takes what other functions of clutch return and draws it with matplotlib, 85 mm wide (one column
of a paper) or 170 mm wide. Functions with one panel take ``ax`` and return it; your own axes keeps its ticks, spines
and size. Functions with several panels return the figure. No function shows or saves anything: call
``figure.savefig("x.pdf")``, ``matplotlib.pyplot.show()``, or leave it to the notebook.

Angles are drawn in degrees. The keys of a scenario keep their units, so that you can write a value read from an axis
into a file. Colours are those of Okabe and Ito, which the colour-blind can distinguish.

matplotlib's settings are changed while a figure is drawn and at no other time. Use the same ones with
``with matplotlib.rc_context(clutch.plot.STYLE):``.

A run of more than 20 000 samples is thinned before it is drawn over time: the smallest and the largest of all samples
in a column of 1/600 inch remain, so that no stick, spike or stair is lost.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, ParamSpec, TypeVar

from clutch._clutch import identified_rows
from clutch._extras import needed
from clutch._metrics import FIGURES
from clutch._units import split

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType
    from numpy.typing import ArrayLike, NDArray

    from clutch._clutch import Table
    from clutch._log import Log
    from clutch._mixins import Friction
    from clutch._model import Scenario, StribeckFriction
    from clutch._paper import PaperFigure
    from clutch._run import Result
    from clutch._sweep import SweepResult
    from clutch._tune import Fell, Identified, Rode

__all__ = [
    "STYLE",
    "candidates",
    "certificate_region",
    "comparison",
    "friction",
    "identified",
    "log_overview",
    "paper_figure",
    "phase_plane",
    "run_overview",
    "stick_slip",
    "stribeck",
    "sweep_map",
    "tracking",
]

_BLUE, _RED, _GREEN, _ORANGE, _SKY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9"
_COLOURS = (_BLUE, _RED, _GREEN, _ORANGE, "#CC79A7", _SKY, "#000000")
_DASHES = ("-", "--", ":", "-.")
_GREY, _PALE = "0.55", "#CDE3F1"
_LONG_DASHES = (0, (6, 3))
_ABOVE: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "columnspacing": 1.2}

#: matplotlib's settings under which everything here is drawn.
STYLE: dict[RcKeyType, Any] = {
    "font.size": 8,
    "text.usetex": False,
    "axes.titlesize": 8,
    "axes.titlelocation": "left",
    "axes.labelsize": 8,
    "axes.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": False,
    "axes.xmargin": 0.0,
    "axes.formatter.useoffset": False,
    "axes.prop_cycle": f"cycler('color', {list(_COLOURS)})",
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "legend.handlelength": 1.5,
    "legend.borderaxespad": 0.2,
    "lines.linewidth": 0.5,
    "lines.solid_joinstyle": "round",
    "hatch.linewidth": 0.4,
    "figure.dpi": 200,
    "savefig.dpi": 300,
    "pdf.fonttype": 42,
}

_LONG = 20_000
_COLUMNS_PER_INCH = 600
_MM = 1 / 25.4
# Letters of a legend that fit into 85 mm beside the axis' own.
_ROW = 52

_MOST_PAIRS = 3600
_FINE = 256

P = ParamSpec("P")
T = TypeVar("T")


def _styled(draw: Callable[P, T]) -> Callable[P, T]:
    """Draw under STYLE, and leave matplotlib's settings as they were."""

    @functools.wraps(draw)
    def styled(*args: P.args, **kwargs: P.kwargs) -> T:
        with needed("matplotlib", f"clutch.plot.{draw.__name__}"):
            import matplotlib

        with matplotlib.rc_context(STYLE):
            drawn = draw(*args, **kwargs)
            # The first figure in a notebook makes its backend interactive: a setting to keep.
            interactive = matplotlib.is_interactive()
        matplotlib.interactive(interactive)
        return drawn

    return styled


def _panels(
    rows: int = 1, columns: int = 1, *, width_mm: float = 85, height_mm: float = 60, **more: Any
) -> tuple[Figure, list[list[Axes]]]:
    import matplotlib.pyplot as plt

    size = (width_mm * _MM, height_mm * _MM)
    figure, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **more)
    for ax in axes.flat:
        # Minor ticks are made when the figure is drawn, which is after STYLE has gone.
        ax.tick_params(which="minor", labelsize=STYLE["xtick.labelsize"], width=0.4, size=1.5)
    return figure, [list(row) for row in axes]


def _one(ax: Axes | None, height_mm: float = 60) -> Axes:
    return _panels(height_mm=height_mm)[1][0][0] if ax is None else ax


def _figure(ax: Axes) -> Figure:
    return ax.figure.canvas.figure  # the whole one, also where the axes is in a subfigure


def _label(key: str) -> str:
    """Axis label of a key of the scenario: ``law.smc.kp (V)``."""
    quantity, unit = split(key)
    return f"{quantity} ({unit})" if unit else quantity


def _metric(name: str) -> tuple[str, float]:
    """Label of a column of a sweep, and the factor that takes it into the label's unit."""
    figure = FIGURES.get(name)
    if figure is None:
        return _label(name), 1.0
    unit = f" ({figure.shown_unit})" if figure.shown_unit else ""
    return figure.label + unit, figure.factor


def _thin(x: NDArray[Any], y: NDArray[Any], columns: int) -> NDArray[np.intp]:
    """The samples to draw: the smallest and the largest of each column, the first and the last."""
    import numpy as np

    edges = np.linspace(x[0], x[-1], columns + 1)[1:-1]
    column = np.searchsorted(edges, x, side="right")
    unknown = np.isnan(y)
    first = np.flatnonzero(np.diff(column, prepend=-1))
    last = np.append(first[1:], len(x)) - 1
    lowest = np.lexsort((np.where(unknown, np.inf, y), column))[first]
    highest = np.lexsort((np.where(unknown, -np.inf, y), column))[last]
    return np.unique(np.concatenate(([0], lowest, highest, [len(x) - 1])))


def _line(ax: Axes, x: NDArray[Any], y: NDArray[Any], **more: Any) -> None:
    """A line over time, thinned if it is long."""
    if len(x) > _LONG:
        keep = _thin(x, y, int(_figure(ax).get_figwidth() * _COLUMNS_PER_INCH))
        x, y = x[keep], y[keep]
    ax.plot(x, y, **more)


def _zero(ax: Axes) -> None:
    ax.axhline(0.0, color="0.2", linewidth=0.4, linestyle=_LONG_DASHES, zorder=1)


def _legend_above(ax: Axes) -> None:
    """A legend that covers no data, in one row if its words fit into a column of a paper."""
    handles, labels = ax.get_legend_handles_labels()
    sizes = [len(label) + 5 for label in labels]
    columns = 2 if 2 * max(sizes, default=0) <= _ROW else 1
    if len(labels) <= 3 and sum(sizes) <= _ROW:
        columns = len(labels)
    ax.legend(handles, labels, ncols=columns, markerscale=2.0, **_ABOVE)


def _runs(
    function: str, results: Result | Iterable[Result], labels: Sequence[str] | None
) -> tuple[list[Result], list[str]]:
    """One run or several, with a label each."""
    from clutch._run import Result

    runs = [results] if isinstance(results, Result) else list(results)
    if not runs:
        raise ValueError(f"{function}: there is no result to draw")
    for run in runs:
        if not isinstance(run, Result):
            raise TypeError(f"{function}: expected a Result of clutch.simulate, got {run!r}")
    if labels is None:
        names = [run.scenario.name for run in runs]
        if len(set(names)) < len(names):
            names = [f"{name}, seed {run.scenario.run.seed}" for name, run in zip(names, runs, strict=True)]
        return runs, names
    names = [labels] if isinstance(labels, str) else [str(label) for label in labels]
    if len(names) != len(runs):
        raise ValueError(f"{function}: labels = {names!r}: expected {len(runs)}, one for each result")
    return runs, names


def _end(runs: list[Result]) -> float:
    """End of the longest run, a period after its last sample, s."""
    return max(run.scenario.run.duration_s for run in runs)


def _error_deg(result: Result) -> NDArray[np.float64]:
    import numpy as np

    error: NDArray[np.float64] = np.degrees(result.samples["error_rad"])
    return error


def _sticks(result: Result) -> NDArray[np.float64]:
    """Begin and end of each time at rest, s."""
    import numpy as np

    return np.stack([result.sticks["from_s"], result.sticks["to_s"]], axis=1)


def _bars(spans: NDArray[np.float64]) -> list[tuple[float, float]]:
    return [(start, end - start) for start, end in spans.tolist()]


@_styled
def tracking(
    results: Result | Iterable[Result],
    *,
    labels: Sequence[str] | None = None,
    stretch: tuple[float, float] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the position error over time, as the paper's figures 8 to 10 do.

    The whole run is an envelope: a band from the lowest to the highest error in each of 120 parts, and the mean as a
    line. A stretch is drawn sample by sample, with the times at rest of a single run shaded.

    Parameters
    ----------
    results : Result or iterable of Result
        One run, or several to compare. The error is the target less the true position: below zero the shaft
        is ahead.
    labels : sequence of str, optional
        A name for each run; by default the scenarios' names, with the seeds if these are alike.
    stretch : tuple of float, optional
        Begin and end of what is drawn, s, as :attr:`clutch.Result.window` around a stick; by default the whole.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; by default a new figure.

    Returns
    -------
    matplotlib.axes.Axes
        Error in ° over time in s.

    Raises
    ------
    ValueError
        There is no result, the number of labels differs from that of the results, or no sample is in the stretch.
    TypeError
        Something is not a Result.

    Examples
    --------
    >>> from clutch import plot, simulate
    >>> ax = plot.tracking([simulate("pd_2"), simulate("smc_2")], labels=["PD", "sliding mode"])
    >>> ax.get_ylabel()
    'error (°)'
    >>> run = simulate("bench_pd_2")
    >>> ax = plot.tracking(run, stretch=run.window)
    """
    import numpy as np

    runs, names = _runs("tracking", results, labels)
    ax = _one(ax)
    _zero(ax)
    start, end = (0.0, _end(runs)) if stretch is None else stretch
    for i, (run, name) in enumerate(zip(runs, names, strict=True)):
        look: dict[str, Any] = {"color": _COLOURS[i % len(_COLOURS)], "linestyle": _DASHES[i // len(_COLOURS) % 4]}
        time, error = run.samples["time_s"], _error_deg(run)
        if stretch is None:
            _envelope(ax, time, error, look, label=name)
            continue
        part = slice(*np.searchsorted(time, [start, end]))
        if not len(time[part]):
            raise ValueError(f"tracking: stretch = {stretch}: expected times within the run, 0 to {_end(runs):g} s")
        ax.plot(time[part], error[part], label=name, linewidth=0.8, **look)
    if stretch is not None and len(runs) == 1:
        _rest(ax, _sticks(runs[0]), start, end, _COLOURS[0])
    ax.set(xlabel="time (s)", ylabel="error (°)", xlim=(start, end))
    if labels is not None or len(runs) > 1:
        _legend_above(ax)
    return ax


@_styled
def paper_figure(figure: PaperFigure) -> Figure:
    """Draw figure 8, 9 or 10 in the paper's arrangement: a row for each rate, simulation left, bench right.

    The band goes from the lowest to the highest error in each of 120 parts of the run, the line is the mean.

    Parameters
    ----------
    figure : PaperFigure
        One of ``clutch.reproduce().figures``.

    Returns
    -------
    matplotlib.figure.Figure
        Error in ° over time in s, 170 mm wide.

    Raises
    ------
    ValueError
        The figure has no panels.

    Examples
    --------
    >>> import clutch
    >>> figure = clutch.plot.paper_figure(clutch.reproduce(progress=False).figures[0])
    >>> len(figure.axes)
    6
    """
    import numpy as np

    rates = list(dict.fromkeys(panel.rate_deg_s for panel in figure.panels))
    if not rates:
        raise ValueError(f"paper_figure: figure {figure.number} has no panels")
    drawing, axes = _panels(len(rates), 2, width_mm=170, height_mm=12 + 46 * len(rates), sharex=True, sharey="row")
    title = f"Fig. {figure.number}: positional errors with the {figure.law}"
    drawing.suptitle(title, x=0.01, ha="left", size=9)
    for panel in figure.panels:
        time = np.asarray(panel.time_s)
        ax = axes[rates.index(panel.rate_deg_s)][panel.experiment]
        side = "(b) bench" if panel.experiment else "(a) simulation"
        ax.set_title(f"{side}, {panel.rate_deg_s:g} °/s")
        _zero(ax)
        _envelope(ax, time, np.asarray(panel.error_deg), {"color": _BLUE})
        ax.set(ylabel="error (°)", xlim=(0.0, 2 * time[-1] - time[-2]))
    for ax in axes[-1]:
        ax.set_xlabel("time (s)")
    drawing.align_ylabels()
    return drawing


@_styled
def stribeck(friction: StribeckFriction, *, velocity_rad_s: ArrayLike | None = None, ax: Axes | None = None) -> Axes:
    """Draw the friction coefficient over the velocity, equation (2), with its two levels and its velocity.

    Parameters
    ----------
    friction : StribeckFriction
        The curve, of a rig for one: ``scenario.rig.friction``.
    velocity_rad_s : array_like, optional
        Magnitudes of the velocity, rad/s, above 0; by default from 1/100 to 100 times the Stribeck velocity.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; by default a new figure.

    Returns
    -------
    matplotlib.axes.Axes
        μ (no unit) over the magnitude of the velocity in rad/s, which is logarithmic.

    Raises
    ------
    ValueError
        A velocity is not above 0.

    Examples
    --------
    >>> from clutch import StribeckFriction, plot
    >>> plot.stribeck(StribeckFriction()).get_xlabel()
    '|velocity| (rad/s)'
    """
    import numpy as np

    scale = friction.stribeck_velocity_rad_s
    if velocity_rad_s is None:
        velocity = scale * np.logspace(-2, 2, 201)
    else:
        velocity = np.sort(np.asarray(velocity_rad_s, dtype=np.float64).ravel())
        if not velocity.size or not velocity[0] > 0 or not np.isfinite(velocity).all():
            raise ValueError("stribeck: velocity_rad_s: expected velocities above 0: the axis is logarithmic")
    ax = _one(ax)
    ax.set_xscale("log")
    level: dict[str, Any] = {"color": _GREY, "linewidth": 0.5, "linestyle": _LONG_DASHES, "zorder": 1}
    for value in {friction.mu_static, friction.mu_dynamic}:
        ax.axhline(value, **level)
    ax.axvline(scale, **level)
    ax.plot(velocity, friction.coefficient(velocity), color=_BLUE, linewidth=1.0)
    # Each level is named at the end where the curve is far from it.
    left, right = velocity[0], velocity[-1]
    note: dict[str, Any] = {"textcoords": "offset points", "color": "0.3", "size": 7}
    ax.annotate(f"static {friction.mu_static:g}", (right, friction.mu_static), (-2, 2), ha="right", **note)
    ax.annotate(f"dynamic {friction.mu_dynamic:g}", (left, friction.mu_dynamic), (2, 2), **note)
    at: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "center"}
    ax.annotate(f"Stribeck velocity\n{scale:g} rad/s", (scale, 0.6), (4, 0), **at, **note)
    ax.set(xlabel="|velocity| (rad/s)", ylabel="friction coefficient μ", xlim=(left, right))
    ax.margins(y=0.12)
    return ax


@_styled
def phase_plane(result: Result, ax: Axes | None = None) -> Axes:
    """Draw the rate of the error over the error, with the samples at which the shaft was stuck.

    Both are the true ones, which the law sees only through the encoder. The sliding surface of law or shell,
    ``σ = f e + ė = 0``, is the dashed line, if it has one, and the layer around it, that of ``certificate().layer``, is
    shaded; a PD's is where its output ends. A run of more than 20 000 samples is drawn whole, as an image within the
    figure.

    Parameters
    ----------
    result : Result
        A run.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; by default a new figure.

    Returns
    -------
    matplotlib.axes.Axes
        Error rate in °/s over error in °.

    Examples
    --------
    >>> from clutch import plot, simulate
    >>> ax = plot.phase_plane(simulate("smc_2"))
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('error (°)', 'error rate (°/s)')
    """
    import numpy as np

    samples = result.samples
    error = _error_deg(result)
    rate = np.degrees(samples["target_velocity_rad_s"] - samples["velocity_rad_s"])
    stuck = np.asarray(samples["stuck"], dtype=bool)
    many = len(error) > _LONG
    ax = _one(ax, 70)
    ax.margins(x=0.04)
    ax.plot(error, rate, color=_BLUE, linewidth=0.4, label="path", rasterized=many)
    if stuck.any():
        dots: dict[str, Any] = {"marker": ".", "markersize": 2.5, "markeredgewidth": 0, "linestyle": "none"}
        ax.plot(error[stuck], rate[stuck], color=_RED, label="stuck", zorder=3, rasterized=many, **dots)
    surface = result.scenario._native.surface()
    if surface is not None:
        slope, boundary = surface
        x, y = np.array(ax.get_xlim()), ax.get_ylim()
        middle = -slope * x
        ax.plot(x, middle, color="0.2", linestyle=_LONG_DASHES, label="σ = 0", zorder=3)
        if boundary > 0:
            layer = np.degrees(boundary)
            edges = (middle - layer, middle + layer)
            words = f"|σ| ≤ {boundary:g} rad/s"
            ax.fill_between(x, *edges, color="0.92", linewidth=0, label=words, zorder=0)
            for edge in edges:
                ax.plot(x, edge, color=_GREY, zorder=1)
        ax.set(xlim=tuple(x), ylim=y)
    ax.set(xlabel="error (°)", ylabel="error rate (°/s)")
    _legend_above(ax)
    return ax


@_styled
def stick_slip(
    results: Result | Iterable[Result], *, labels: Sequence[str] | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the times at which the shaft was stuck: a row for each run, a bar from each stick to its break-away.

    Bars have a rim of 0.2 pt, so that a stick of a millisecond can be seen in a run of minutes. The number at
    the end of a row is the run's ``metrics.stick_slip_cycles_per_s``, which leaves the settling time out.

    Parameters
    ----------
    results : Result or iterable of Result
        Runs with other seeds, laws or rigs.
    labels : sequence of str, optional
        A name for each run; by default the scenarios' names, with the seeds if these are alike.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; by default a new figure, the higher the more runs there are.

    Returns
    -------
    matplotlib.axes.Axes
        Rows over time in s, the first run on top.

    Raises
    ------
    ValueError
        There is no result, or the number of labels differs from that of the results.
    TypeError
        Something is not a Result.

    Examples
    --------
    >>> from clutch import plot, simulate
    >>> runs = [simulate("smc_2", overrides={"run.seed": seed}) for seed in (1, 2)]
    >>> ax = plot.stick_slip(runs, labels=["seed 1", "seed 2"])
    >>> [text.get_text() for text in ax.get_yticklabels()]
    ['seed 1', 'seed 2']
    """
    runs, names = _runs("stick_slip", results, labels)
    if ax is None:
        ax = _one(ax, 16 + 6 * len(runs))
        ax.tick_params(axis="y", length=0)
        ax.spines["left"].set_visible(False)
    note: dict[str, Any] = {"textcoords": "offset points", "size": 7}
    for row, run in enumerate(runs):
        bars = _bars(_sticks(run))
        ax.broken_barh(bars, (row - 0.35, 0.7), facecolor=_BLUE, edgecolor=_BLUE, linewidth=0.2, snap=False)
        cycles = f"{run.metrics.stick_slip_cycles_per_s:.1f}"
        ax.annotate(cycles, (1, row), (3, 0), xycoords=("axes fraction", "data"), va="center", **note)
    ax.annotate("cycles/s", (1, 1), (3, 2), xycoords="axes fraction", **note)
    ax.set_yticks(range(len(runs)), names)
    ax.set(xlabel="time (s)", xlim=(0.0, _end(runs)), ylim=(len(runs) - 0.4, -0.6))
    return ax


def _swept(column: Any) -> tuple[NDArray[Any], NDArray[np.intp]]:
    """The values that were swept, in rising order or, for words, as they come; and the index of each row's value."""
    import numpy as np

    values = np.asarray(column)
    if values.dtype.kind in "biuf":
        return np.unique(values.astype(np.float64), return_inverse=True)
    words = [str(value) for value in values]
    places = {word: i for i, word in enumerate(dict.fromkeys(words))}
    return np.array(list(places)), np.array([places[word] for word in words], dtype=np.intp)


def _cells(values: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
    """Centres and edges of the cells on an axis, and true if they are more even on a logarithmic one."""
    import numpy as np

    if values.dtype.kind != "f":
        places = np.arange(len(values), dtype=np.float64)
        return places, np.append(places, len(values)) - 0.5, False
    if len(values) == 1:
        half = 0.05 * abs(values[0]) or 0.5
        return values, np.array([values[0] - half, values[0] + half]), False
    log = False
    if len(values) > 2 and values[0] > 0 and values[-1] >= 10 * values[0]:
        steps, ratios = np.diff(values), np.diff(np.log(values))
        log = bool(np.ptp(ratios) / ratios.mean() < np.ptp(steps) / steps.mean())
    at = np.log(values) if log else values
    inner = (at[1:] + at[:-1]) / 2
    edges = np.concatenate(([1.5 * at[0] - 0.5 * at[1]], inner, [1.5 * at[-1] - 0.5 * at[-2]]))
    return values, np.exp(edges) if log else edges, log


def _log(ax: Axes, which: Literal["x", "y"], low: float, high: float) -> None:
    """A logarithmic axis with plain numbers, 0.02 and not 2 × 10⁻², the more of them the shorter it is."""
    ax.set(**{f"{which}scale": "log"})
    axis = ax.xaxis if which == "x" else ax.yaxis
    labelled = "25" if high < 100 * low else ""
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in labelled else "")


@_styled
def sweep_map(
    sweep: SweepResult | Table,
    x: str,
    y: str,
    value: str,
    *,
    contours: str | None = "stick_slip_cycles_per_s",
    ax: Axes | None = None,
) -> Axes:
    """Draw a metric as a map over two swept keys, with lines of equal stick-slip.

    A cell is the mean over its rows, as of several seeds. Cells without a run, or whose runs were refused,
    are hatched. An axis is logarithmic where the swept values are spaced so.

    Parameters
    ----------
    sweep : SweepResult or Table
        A sweep over a grid, or a table with the columns named below. A data frame will do.
    x, y : str
        Swept keys of the scenario, as ``"law.smc.kp_v"``.
    value : str
        The metric to draw, as ``"max_error_rad"``, in words and in the unit of ``clutch sim``: errors in degrees.
    contours : str, optional
        The metric of the lines; None for none. The default is left out where the sweep does not have it.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; by default a new figure.

    Returns
    -------
    matplotlib.axes.Axes
        Axes in the keys' units; the colour bar has the metric's.

    Raises
    ------
    ValueError
        A column is missing; or another key but ``run.seed`` was swept too, and a mean over it would mean nothing; or
        the rows are not a grid.

    Examples
    --------
    >>> from clutch import plot, sweep
    >>> gains = {"law.smc.kp_v": [3.0, 4.0], "law.smc.boundary_rad_s": [0.1, 0.15]}
    >>> ax = plot.sweep_map(sweep("smc_2", gains), *gains, "max_error_rad")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('law.smc.kp (V)', 'law.smc.boundary (rad/s)')
    """
    import numpy as np

    from clutch._sweep import SweepResult

    table, keys = (sweep.table, sweep.keys) if isinstance(sweep, SweepResult) else (sweep, ())
    wanted = [x, y, value]
    if contours is not None and (contours != "stick_slip_cycles_per_s" or contours in table.columns):
        wanted.append(contours)
    for name in wanted:
        if name not in table.columns:
            raise ValueError(f"sweep_map: {name}: no such column; there are {', '.join(table.columns)}")
    for key in keys:
        if key not in (x, y, "run.seed") and len(_swept(table[key])[0]) > 1:
            raise ValueError(f"sweep_map: {key} was swept too; draw the rows of one of its values at a time")

    (xs, column), (ys, row) = _swept(table[x]), _swept(table[y])
    shape = (len(ys), len(xs))
    if shape[0] * shape[1] > 4 * len(set(zip(column.tolist(), row.tolist(), strict=True))):
        raise ValueError(f"sweep_map: the rows are not a grid over {x} and {y}: {shape[1]} by {shape[0]} values")

    def means(name: str, factor: float) -> np.ma.MaskedArray[Any, Any]:
        values = np.asarray(table[name], dtype=np.float64) * factor
        good = np.isfinite(values)
        cell = np.ravel_multi_index((row[good], column[good]), shape)
        count = np.bincount(cell, minlength=shape[0] * shape[1])
        total = np.bincount(cell, weights=values[good], minlength=shape[0] * shape[1])
        return np.ma.masked_invalid(np.where(count, total / np.maximum(count, 1), np.nan).reshape(shape))

    (x_at, x_edges, x_log), (y_at, y_edges, y_log) = _cells(xs), _cells(ys)
    ax = _one(ax, 70)
    if x_log:
        _log(ax, "x", x_edges[0], x_edges[-1])
    if y_log:
        _log(ax, "y", y_edges[0], y_edges[-1])
    ax.patch.set(facecolor="white", edgecolor="0.7", hatch="////")
    label, factor = _metric(value)
    # A rim in the cell's own colour closes the hairlines that viewers of PDF show between cells.
    rim: dict[str, Any] = {"edgecolors": "face", "linewidth": 0.1}
    mesh = ax.pcolormesh(x_edges, y_edges, means(value, factor), cmap="cividis", **rim)
    bar = _figure(ax).colorbar(mesh, ax=ax, label=label, pad=0.03)
    bar.ax.spines["outline"].set_visible(False)
    # Between words there is nothing.
    if len(wanted) > 3 and min(shape) > 1 and xs.dtype.kind == ys.dtype.kind == "f":
        _contours(ax, x_at, y_at, wanted[3], means)
    for axis, words in ((ax.xaxis, xs), (ax.yaxis, ys)):
        if words.dtype.kind != "f":
            axis.set_ticks(range(len(words)), _short(list(words)))
    ax.set(xlabel=_label(x), ylabel=_label(y))
    return ax


def _short(words: list[str]) -> list[str]:
    """Words of an axis; of alternatives with parameters, as laws, the name and what differs among those of a name."""
    parsed = []
    for word in words:
        try:
            ((name, rows),) = json.loads(word).items()
            parsed.append((name, dict(rows)))
        except (ValueError, TypeError, AttributeError):
            return words
    short = []
    for name, rows in parsed:
        alike = [other for own, other in parsed if own == name]
        differs = [key for key in rows if any(other.get(key) != rows[key] for other in alike)]
        short.append("\n".join([name, *(f"{key} {rows[key]}" for key in differs)]))
    return short


def _contours(ax: Axes, x: NDArray[Any], y: NDArray[Any], name: str, means: Callable[..., Any]) -> None:
    from matplotlib.patheffects import AbstractPathEffect, withStroke
    from matplotlib.ticker import MaxNLocator

    label, factor = _metric(name)
    grid = means(name, factor)
    if grid.count() == 0 or grid.min() == grid.max():
        return
    levels = MaxNLocator(5).tick_values(grid.min(), grid.max())
    lines = ax.contour(x, y, grid, levels=levels[1:-1], colors="white", linewidths=0.7)
    # White alone would be lost on the bright end of the colours.
    halo: list[AbstractPathEffect] = [withStroke(linewidth=1.4, foreground="0.25")]
    lines.set_path_effects(halo)
    for text in ax.clabel(lines, fontsize=6):
        text.set_path_effects(halo)
    ax.plot([], [], color=_GREY, linewidth=0.7, label=f"lines: {label}")
    _legend_above(ax)


@_styled
def certificate_region(
    scenario: Scenario, *, kp: ArrayLike | None = None, kd: ArrayLike | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the gains that are certified for every plant within the bounds, and the scenario's own.

    ``scenario.override(…).certificate().certified_continuous_time`` is evaluated for each pair of the gains
    given, so the border is known to half a step. By default the gains lie around the required ones and the scenario's
    own, 17 by 17, and more are evaluated along the border, down to 1/256 of an axis; a region narrower than 1/16 of it
    may be missed.

    Parameters
    ----------
    scenario : Scenario
        With a law that has two gains, ``kp_…`` and ``kd_…``, and a sliding surface.
    kp, kd : array_like, optional
        Gains to evaluate, rising, in the units of the law's keys, as ``law.smc.kp_v`` and ``law.smc.kd_v_s_rad``;
        both or neither; at most 3600 pairs.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; by default a new figure.

    Returns
    -------
    matplotlib.axes.Axes
        Derivative gain over proportional gain. The scenario's own gains are a full dot if they are certified
        and a ring if not.

    Raises
    ------
    ValueError
        The law is none such; or only one of `kp` and `kd` is given, they do not rise, or are too many.
    ParamError
        A gain is not allowed.

    Examples
    --------
    >>> from clutch import Scenario, plot
    >>> ax = plot.certificate_region(Scenario.load("smc_2"), kp=[2.0, 2.5, 3.0], kd=[4.0, 8.0, 16.0])
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('law.smc.kp (V)', 'law.smc.kd (V s/rad)')
    """
    import numpy as np
    from matplotlib.patches import Patch

    law = scenario.law
    names = [field.name for field in dataclasses.fields(law) if field.name.startswith(("kp_", "kd_"))]
    keys = [f"{law._key}.{name}" for name in names]
    own = [float(getattr(law, name)) for name in names]
    typical = {key: gain or 1.0 for key, gain in zip(keys, own, strict=True)}
    if len(keys) != 2 or scenario.override(typical).certificate().layer.slope_1_s == 0:
        raise ValueError(
            f"certificate_region: {law._key}: expected a law with two gains, kp_… and kd_…, and a sliding surface"
        )

    def certified(p: float, d: float) -> bool:
        return scenario.override({keys[0]: p, keys[1]: d}).certificate().certified_continuous_time

    if kp is None and kd is None:
        gains = _around(scenario, own)
        region = _refined(certified, *gains)
    elif kp is None or kd is None:
        raise ValueError("certificate_region: expected both kp and kd, or neither")
    else:
        gains = (np.asarray(kp, dtype=np.float64), np.asarray(kd, dtype=np.float64))
        for name, values in zip(("kp", "kd"), gains, strict=True):
            if values.ndim != 1 or len(values) < 2 or not (np.diff(values) > 0).all():
                raise ValueError(f"certificate_region: {name}: expected two or more gains that rise")
        if len(gains[0]) * len(gains[1]) > _MOST_PAIRS:
            pairs = f"{len(gains[0])} by {len(gains[1])}"
            raise ValueError(f"certificate_region: {pairs} gains: expected at most {_MOST_PAIRS} pairs")
        region = np.array([[certified(p, d) for p in gains[0].tolist()] for d in gains[1].tolist()])

    ax = _one(ax, 66)
    if region.any():
        ax.contourf(*gains, region, levels=[0.5, 1.5], colors=[_PALE])
        if not region.all():
            ax.contour(*gains, region, levels=[0.5], colors=[_BLUE], linewidths=0.7)
    named = ", ".join(f"{gain:g} {split(key)[1]}" for gain, key in zip(own, keys, strict=True))
    good = scenario.certificate().certified_continuous_time
    (dot,) = ax.plot(
        *([gain] for gain in own),
        marker="o",
        markersize=4,
        linestyle="none",
        color=_RED,
        markerfacecolor=_RED if good else "white",
        label=f"{named}: {'certified' if good else 'not certified'}",
    )
    patch = Patch(facecolor=_PALE, edgecolor=_BLUE, linewidth=0.7, label="certified")
    ax.legend(handles=[patch, dot], ncols=2, **_ABOVE)
    _gain_axis(ax, "x", keys[0], gains[0])
    _gain_axis(ax, "y", keys[1], gains[1])
    return ax


def _gain_axis(ax: Axes, which: Literal["x", "y"], key: str, gains: NDArray[np.float64]) -> None:
    if gains[0] > 0 and gains[-1] > 20 * gains[0]:
        _log(ax, which, gains[0], gains[-1])
    ax.set(**{f"{which}label": _label(key), f"{which}lim": (gains[0], gains[-1])})


def _around(scenario: Scenario, own: list[float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gains around the required ones and the scenario's own."""
    import numpy as np

    ahead = scenario.certificate().ahead
    if ahead.kd_required_v_s_rad == 0:  # the certificate requires volts, not a gain
        kp, kd = (np.geomspace((gain or 1.0) / 20, (gain or 1.0) * 20, _FINE + 1) for gain in own)
        return kp, kd
    kp = np.linspace(0.0, max(2.5 * ahead.kp_required_v, 1.3 * own[0]), _FINE + 1)
    lowest = max(ahead.kd_required_v_s_rad, 1e-3) / 4
    return kp, np.geomspace(min(lowest, (own[1] or lowest) / 2), max(40 * lowest, 2.5 * own[1]), _FINE + 1)


def _refined(
    certified: Callable[[float, float], bool], kp: NDArray[np.float64], kd: NDArray[np.float64]
) -> NDArray[np.int8]:
    """1 where gains are certified, 0 where not: a coarse grid, made finer where its corners differ."""
    import numpy as np

    step = _FINE // 16
    region = np.zeros((len(kd), len(kp)), dtype=np.int8)
    asked = np.zeros(region.shape, dtype=bool)
    wanted = np.ones((17, 17), dtype=bool)
    while True:
        now, known = region[::step, ::step], asked[::step, ::step]
        for row, column in np.argwhere(wanted & ~known):
            now[row, column] = certified(float(kp[column * step]), float(kd[row * step]))
        known |= wanted
        if step == 1:
            return region
        step //= 2
        finer, known = region[::step, ::step], asked[::step, ::step]
        # A pair that is not evaluated is taken to equal its neighbour, until a border turns up beside it.
        guess = np.repeat(np.repeat(now, 2, axis=0), 2, axis=1)[:-1, :-1]
        corners = np.stack([now[:-1, :-1], now[:-1, 1:], now[1:, :-1], now[1:, 1:]])
        wanted = np.zeros(finer.shape, dtype=bool)
        for row, column in 2 * np.argwhere(np.ptp(corners, axis=0)):
            wanted[row : row + 3, column : column + 3] = True
        finer[...] = np.where(known, finer, guess)


@_styled
def friction(*frictions: Friction, labels: Sequence[str] | None = None) -> Figure:
    """Draw frictions under the four experiments of the laboratory: the same figure as ``clutch friction plot``.

    Parameters
    ----------
    *frictions : StribeckFriction, CoulombFriction, LugreFriction, DahlFriction, …
        Frictions, as a rig has one; one curve each.
    labels : sequence of str, optional
        A name for each in the legend; by default those of the models.

    Returns
    -------
    matplotlib.figure.Figure
        Steady sliding over the velocity in rad/s, pre-sliding over the angle in mrad, lag over the velocity in mrad/s,
        the largest coefficient, at the break-away, over the rate of torque in N m/s.

    Raises
    ------
    TypeError
        Something else than a friction.
    ValueError
        No friction, or not a label for each.

    Examples
    --------
    >>> import clutch
    >>> from clutch import plot
    >>> figure = plot.friction(clutch.StribeckFriction(), clutch.LugreFriction())
    >>> [ax.get_xlabel() for ax in figure.axes]
    ['velocity (rad/s)', 'angle (mrad)', 'velocity (mrad/s)', 'rate of torque (N m/s)']
    """
    if not frictions:
        raise ValueError("expected at least one friction, as clutch.LugreFriction()")
    wrong = [one for one in frictions if not hasattr(one, "examine")]
    if wrong:
        raise TypeError(f"friction: {wrong[0]!r}: expected frictions, as clutch.LugreFriction()")
    names = [one._key.split(".")[-1] for one in frictions] if labels is None else list(labels)
    if len(names) != len(frictions):
        raise ValueError(f"labels: {len(names)} for {len(frictions)} frictions")
    figure, axes = _panels(2, columns=2, width_mm=170, height_mm=110)
    panels = {
        "steady": ("Steady sliding", "velocity (rad/s)", "log", 1.0),
        "pre_sliding": ("Pre-sliding", "angle (mrad)", "linear", 1e3),
        "lag": ("Lag behind the velocity", "velocity (mrad/s)", "linear", 1e3),
        "break_away": ("Break-away", "rate of torque (N m/s)", "log", 1.0),
    }
    flat = [ax for row in axes for ax in row]
    for ax, (title, label, scale, _) in zip(flat, panels.values(), strict=True):
        ax.set(title=title, xlabel=label, ylabel="coefficient", xscale=scale)
    for colour, one, label in zip(itertools.cycle(_COLOURS), frictions, names, strict=False):
        found = one.examine()
        for ax, (name, (*_, factor)) in zip(flat, panels.items(), strict=True):
            set_, mu = found[name].to_dict().values()
            ax.plot(factor * set_, mu, color=colour, linewidth=0.8, label=label)
    flat[0].legend()
    return figure


@_styled
def run_overview(result: Result) -> Figure:
    """Draw a run closely around a stick, and whole.

    The window on the left is ``result.window``, the one that ``clutch sim --plot`` shows; times at rest are shaded. The
    whole run on the right is an envelope: in each of its 120 parts the band goes from the lowest to the highest value,
    and the line is the mean.

    Parameters
    ----------
    result : Result
        A run.

    Returns
    -------
    matplotlib.figure.Figure
        Four panels over time in s: position by the encoder against the path, in counts, and velocity in °/s, both in
        the window; error in ° and voltage in V of the whole run.

    Examples
    --------
    >>> from clutch import plot, simulate
    >>> [ax.get_ylabel() for ax in plot.run_overview(simulate("smc_2")).axes]
    ['position (counts)', 'error (°)', 'velocity (°/s)', 'voltage (V)']
    """
    return _overview([result], [result.scenario.name])


@_styled
def comparison(results: Iterable[Result], *, labels: Sequence[str] | None = None) -> Figure:
    """Draw several runs on common axes: closely in one window, and whole.

    The panels are those of :func:`run_overview`. The window is that of the first run that sticks; positions are counted
    from where each path is at its begin. Strips on top show when each shaft is at rest.

    Parameters
    ----------
    results : iterable of Result
        Runs to compare, of other laws, gains or rigs.
    labels : sequence of str, optional
        A name for each run; by default the scenarios' names, with the seeds if these are alike.

    Returns
    -------
    matplotlib.figure.Figure
        Position, error, velocity and voltage over time in s.

    Raises
    ------
    ValueError
        There is no result, or the number of labels differs from that of the results.
    TypeError
        Something is not a Result.

    Examples
    --------
    >>> from clutch import plot, simulate
    >>> figure = plot.comparison([simulate("pd_2"), simulate("smc_2")], labels=["PD", "sliding mode"])
    >>> len(figure.axes)
    4
    """
    return _overview(*_runs("comparison", results, labels))


def _overview(runs: list[Result], names: list[str]) -> Figure:
    """One run or several: position and velocity in a window, error and voltage whole."""
    import numpy as np

    alone = len(runs) == 1
    figure, axes = _panels(2, 2, width_mm=170, height_mm=110 if alone else 116)
    (position, error), (velocity, voltage) = axes
    windows = [run._window for run in runs if run._window is not None]
    shown = next((w for w in windows if w[3]), windows[0] if windows else (0.0, _end(runs), "", False))
    start, end, words = shown[:3]
    counts = {run.scenario.rig.encoder.counts_per_rev for run in runs}
    paths: list[tuple[NDArray[Any], NDArray[Any], NDArray[Any]]] = []
    for i, (run, name) in enumerate(zip(runs, names, strict=True)):
        look: dict[str, Any] = {"color": _COLOURS[i % len(_COLOURS)], "linestyle": _DASHES[i // len(_COLOURS) % 4]}
        samples = run.samples
        time = samples["time_s"]
        part = slice(*np.searchsorted(time, [start, end]))
        per_rad = run.scenario.rig.encoder.counts_per_rev / (2 * np.pi)
        path = np.asarray(samples["target_position_rad"][part]) * per_rad
        origin = np.floor(path[0]) if len(path) else 0.0
        unit = 1.0 if len(counts) == 1 else np.degrees(1 / per_rad)
        stairs = (samples["counts"][part] - origin) * unit
        position.step(time[part], stairs, where="post", label="shaft" if alone else name, linewidth=0.8, **look)
        shaft = np.degrees(samples["velocity_rad_s"][part])
        velocity.plot(time[part], shaft, linewidth=0.8, **look)
        target = np.degrees(samples["target_velocity_rad_s"][part])
        # Paths that are the same are drawn once.
        guide = (time[part], (path - origin) * unit, target)
        if not any(np.array_equal(guide[1], other[1]) for other in paths):
            paths.append(guide)
        _envelope(error, time, _error_deg(run), look)
        _envelope(voltage, time, np.asarray(samples["voltage_v"]), look)
        rest = _sticks(run)
        rest = np.clip(rest[(rest[:, 1] > start) & (rest[:, 0] < end)], start, end)
        for ax in (position, velocity):
            # One run is shaded over the whole height, each of several in a strip on top.
            place = (0, 1) if alone else (1.0 - 0.035 * (i + 1), 0.028)
            shade: dict[str, Any] = {"facecolor": look["color"], "alpha": 0.2 if alone else 0.5}
            ax.broken_barh(
                _bars(rest),
                place,
                transform=ax.get_xaxis_transform(),
                linewidth=0,
                zorder=0,
                label="at rest" if alone else None,
                snap=False,
                **shade,
            )
    for i, (time, way, rate) in enumerate(paths):
        for ax, values in ((position, way), (velocity, rate)):
            ax.plot(time, values, color="0.1", linewidth=0.6, zorder=1.5, label=None if i else "path")
    _zero(error)
    for ax in (error, voltage):
        ax.axvspan(start, end, color="0.85", linewidth=0, zorder=0, label="the window")
        ax.set(xlim=(0.0, _end(runs)))
    position.set_title(f"{1e3 * (end - start):.0f} ms {words}", pad=4)
    velocity.set_title("The same: velocity" if alone else "The same: velocity; strips on top: at rest")
    error.set_title("Whole run: error, lowest to highest and mean")
    voltage.set_title("Whole run: voltage, lowest to highest and mean")
    position.set_ylabel("position (counts)" if len(counts) == 1 else "position (°)")
    error.set_ylabel("error (°)")
    velocity.set_ylabel("velocity (°/s)")
    voltage.set_ylabel("voltage (V)")
    for ax in (position, velocity):
        ax.set_xlim(start, end)
        if not alone:
            ax.margins(y=0.05 + 0.04 * len(runs))
    for ax in (position, error, velocity, voltage):
        ax.set_xlabel("time (s)")
    # One legend for all, which covers no data.
    handles, labels = position.get_legend_handles_labels()
    (mark,), (marked,) = error.get_legend_handles_labels()
    named = dict(zip(labels, handles, strict=True)) | {marked: mark}
    columns = min(len(named), 4 if max(map(len, named)) <= _ROW // 2 else 2)
    figure.legend(named.values(), named.keys(), loc="outside lower left", ncols=columns)
    return figure


def _rest(ax: Axes, sticks: NDArray[np.float64], start: float, end: float, colour: str) -> None:
    """Shade the times at rest in a stretch."""
    import numpy as np

    within = np.clip(sticks[(sticks[:, 1] > start) & (sticks[:, 0] < end)], start, end)
    place: dict[str, Any] = {"transform": ax.get_xaxis_transform(), "linewidth": 0, "zorder": 0, "snap": False}
    ax.broken_barh(_bars(within), (0, 1), facecolor=colour, alpha=0.2, label="at rest", **place)


def _envelope(
    ax: Axes, time: NDArray[Any], values: NDArray[Any], look: dict[str, Any], label: str | None = None
) -> None:
    """The means of a curve's parts, and the band from their lowest to their highest."""
    import numpy as np

    from clutch import _clutch

    parts = _clutch.envelope(np.ascontiguousarray(time), np.ascontiguousarray(values))
    ax.fill_between(parts["time_s"], parts["low"], parts["high"], color=look["color"], alpha=0.22, linewidth=0)
    ax.plot(parts["time_s"], parts["mean"], linewidth=0.8, label=label, **look)


_STATES = ("Disconnected", "Ready", "Armed", "Running", "Holding", "Released", "Faulted")


@_styled
def log_overview(log: Log) -> Figure:
    """Draw a log of a simulation or a loop: a stick closely, then measurements, commands and faults of the whole.

    On top is the stretch around a stick, :attr:`clutch.Log.window`: the encoder's stairs and the path. Below it is the
    whole; error and voltage are bands from the lowest to the highest of each of 120 parts, with the mean. Panels
    without records are left out, so a simulation has no latency and no link. Target and error are drawn where the law
    answered: a safe state has none. Events are marked through all panels of the whole, faults in red.

    Parameters
    ----------
    log : Log
        From `clutch.read_log`.

    Returns
    -------
    matplotlib.figure.Figure
        Panels over time in s: position closely, in counts; position in °, by the encoder; error in °, as the law saw
        it; voltage in V; the supervisor's state; the time that answers took in µs; the link's counters.

    Raises
    ------
    ValueError
        The log has no commands.

    Examples
    --------
    >>> import tempfile
    >>> from clutch import plot, read_log, simulate
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     simulate("smc_2").save(f"{folder}/run.mcap")
    ...     figure = plot.log_overview(read_log(f"{folder}/run.mcap"))
    >>> [ax.get_ylabel() for ax in figure.axes]
    ['position (counts)', 'position (°)', 'error (°)', 'voltage (V)', 'state']
    """
    import numpy as np

    command = log.channels.get("command")
    if command is None:
        raise ValueError("log_overview: the log has no records of commands: there is nothing to draw")
    sample, event, link = (log.channels.get(name) for name in ("sample", "event", "link"))
    answered = sample is not None and bool(np.any(sample["lateness_us"]))
    window, _ = log._picture()
    closely = window is not None and sample is not None
    heights = [2.4] * closely + [1.6, 2.0, 2.0, 1.1] + [1.2] * (answered + (link is not None))
    figure, rows = _panels(len(heights), height_mm=12 + 15 * sum(heights), height_ratios=heights)
    close, whole = [row[0] for row in rows[:closely]], [row[0] for row in rows[closely:]]
    for ax in whole[:-1]:
        ax.sharex(whole[-1])
        ax.tick_params(labelbottom=False)
    position, error, voltage, state, *others = whole

    time = command["time_s"]
    law = np.array(command["source"]) == "Law"
    scenario = log.scenario
    degrees = 360.0 / scenario.rig.encoder.counts_per_rev
    if sample is not None:
        seen = np.array(sample["arrival"]) != "Missing"
        counts = np.unwrap(np.asarray(sample["counts"], dtype=np.int64)[seen], period=2**32)
        _line(position, sample["time_s"][seen], counts * degrees, color=_BLUE, label="encoder")
        for ax in close:
            _closely(ax, log, sample["time_s"][seen], counts, np.where(law, command["target_counts_x65536"], np.nan))
    target = np.where(law, command["target_counts_x65536"] / 65536 * degrees, np.nan)
    _line(position, time, target, color=_RED, label="target")
    position.set_ylabel("position (°)")
    _legend_above(position)
    _zero(error)
    _envelope(error, time, np.where(law, np.degrees(command["error_rad"]), np.nan), {"color": _BLUE})
    error.set_ylabel("error (°)")
    _envelope(voltage, time, np.asarray(command["voltage_v"]), {"color": _BLUE})
    voltage.set_ylabel("voltage (V)")
    if window is not None and closely:
        for ax in (position, error, voltage):
            ax.axvspan(*window[:2], color="0.85", linewidth=0, zorder=0)
    _states(state, command, event)
    if answered and sample is not None:
        ax = others.pop(0)
        took = np.asarray(sample["lateness_us"], dtype=np.float64)
        _line(ax, sample["time_s"][took > 0], took[took > 0], color=_BLUE, label="answer")
        if scenario.safety is not None:
            deadline = scenario.safety.limits.deadline_us
            ax.axhline(deadline, color=_ORANGE, linestyle=_LONG_DASHES, label="deadline")
            _legend_above(ax)
        _log(ax, "y", *ax.get_ylim())
        ax.set_ylabel("answer (µs)")
    if link is not None:
        _counters(others.pop(0), link)
    if event is not None:
        _events(whole, event)
    end = whole[-1].get_xlim()[1]
    whole[-1].set(xlabel="time (s)", xlim=(0.0, 1.02 * end))
    figure.align_ylabels()
    return figure


def _closely(ax: Axes, log: Log, time: NDArray[Any], counts: NDArray[Any], target: NDArray[Any]) -> None:
    """The encoder's stairs and the path, 2⁻¹⁶ counts, in the window of a log."""
    import numpy as np

    window, sticks = log._picture()
    if window is None:
        return
    start, end, words, _ = window
    command = log.channels["command"]["time_s"]
    within, path = (slice(*np.searchsorted(t, [start, end])) for t in (time, command))
    target = target[path] / 65536
    origin = np.floor(target[0]) if len(target) else 0.0
    ax.step(time[within], counts[within] - origin, where="post", color=_BLUE, linewidth=0.8, label="encoder")
    ax.plot(command[path], target - origin, color="0.1", linewidth=0.6, zorder=1.5, label="path")
    _rest(ax, np.stack([sticks["from_s"], sticks["to_s"]], axis=1), start, end, _BLUE)
    ax.set(xlim=(start, end), xlabel="time (s)", ylabel="position (counts)")
    ax.set_title(f"{1e3 * (end - start):.0f} ms {words}".replace(", ", ",\n"), pad=18)
    _legend_above(ax)


def _states(ax: Axes, command: Table, event: Table | None) -> None:
    """The supervisor's state, also after the last command, which only the events record."""
    import numpy as np

    time, states = command["time_s"], list(command["state"])
    if event is not None:
        time = np.concatenate((time, event["time_s"]))
        states += list(event["to_state"])
    order = np.argsort(time, kind="stable")
    known = [name for name in _STATES if name in states]
    places = np.array([known.index(name) for name in states])[order]
    ax.step(time[order], places, where="post", color=_BLUE, linewidth=1.0)
    ax.set_yticks(range(len(known)), known)
    ax.set(ylabel="state", ylim=(-0.5, len(known) - 0.5))


def _counters(ax: Axes, link: Table) -> None:
    """Faults on the link, added up; only those that occurred."""
    from matplotlib.ticker import MaxNLocator

    # Each column of the record but when it was made, and what came as it should.
    bad = [name for name in link if name not in ("tick", "time_s", "received") and link[name].any()]
    for name, colour in zip(bad, _COLOURS + _COLOURS, strict=False):
        ax.step(link["time_s"], link[name], where="post", color=colour, label=name.replace("_", " "))
    if bad:
        _legend_above(ax)
        ax.yaxis.set_major_locator(MaxNLocator(3, integer=True))
    else:
        words = f"none lost, late or refused of {link['received'].max()}"
        ax.text(0.5, 0.5, words, transform=ax.transAxes, ha="center", va="center", size=7, color="0.3")
        ax.set_yticks([])
    ax.set_ylabel("link (count)")


def _events(axes: list[Axes], event: Table) -> None:
    """A line through all panels for each event, with its cause beside the state."""
    left, right = axes[3].get_xlim()
    columns = (event[name] for name in ("time_s", "kind", "to_state", "cause"))
    for time, kind, to, cause in zip(*columns, strict=True):
        bad = to == "Faulted" or kind in ("PortLost", "LogDropped", "Drift")
        for ax in axes:
            ax.axvline(time, color=_RED if bad else _GREY, linewidth=0.5, zorder=1)
        words = kind if cause == "None" else cause
        if words != "StateChange":
            late = time > (left + right) / 2
            axes[3].annotate(
                re.sub(r"(?<=[a-z])(?=[A-Z])", " ", words).lower(),
                (time, 0.5),
                (-2 if late else 2, 0),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="right" if late else "left",
                va="center",
                size=7,
                color=_RED if bad else "0.3",
            )


@_styled
def identified(found: Identified) -> Figure:
    """Draw what identification saw and what it believes.

    Parameters
    ----------
    found : Identified
        The findings of :func:`clutch.identify`.

    Returns
    -------
    matplotlib.figure.Figure
        Above what was seen, beside lines of what is believed: the releases of a brake, and the voltage that keeps the
        shaft at each rate, with two standard deviations. Below each interval, in per cent of its value, and friction
        along the disc, where the slowest ride went.

    Examples
    --------
    >>> import clutch
    >>> figure = clutch.plot.identified(clutch.identify("board_smc_2"))
    """
    import matplotlib.pyplot as plt
    import numpy as np

    # A motor axis has no releases, and more parameters.
    first = "falls" if found.falls else "intervals"
    figure = plt.figure(figsize=(180 * _MM, 130 * _MM), layout="constrained")
    axes = figure.subplot_mosaic([[first, "rides"], ["intervals", "map"]])
    left, right = axes["intervals"], axes["map"]
    if found.falls:
        _falls(axes["falls"], found.falls)
    _rides(axes["rides"], found.rides)
    told = [row for row in identified_rows() if row[0] in found.parameters]
    farthest = 1.0
    for row, (key, *_) in enumerate(reversed(told)):
        e = found.parameters[key]
        scale = 100 / e.value if e.value else 0.0
        ends = [(e.low - e.value) * scale, (e.high - e.value) * scale]
        farthest = max(farthest, *map(abs, ends))
        left.plot(ends, [row, row], lw=3, color=_BLUE, solid_capstyle="butt")
        left.plot([0], [row], "k|", ms=8)
    shown = ((label, found.parameters[key].value * factor, unit) for key, label, unit, factor in reversed(told))
    names = [f"{label}\n{value:.4g} {unit}".rstrip() for label, value, unit in shown]
    left.set_yticks(range(len(told)), names)
    left.set_ylim(-0.6, len(told) - 0.4)
    left.set_xscale("symlog", linthresh=1)
    ticks = [-100, -10, -1, 0, 1, 10, 100]
    left.set_xticks(ticks, [f"{tick}".replace("-", "−") for tick in ticks])
    left.set_xticks([], minor=True)
    left.set_xlim(-1.3 * farthest, 1.3 * farthest)
    left.axvline(0, lw=0.6, color="0.8", zorder=0)
    left.set_xlabel("interval around the value, %")
    if found.map:
        angle, factor = np.array(found.map).T
        right.plot(np.degrees(angle), factor)
    right.set_xlabel("angle, °")
    right.set_ylabel("friction over its mean")
    return figure


def _falls(ax: Axes, falls: Sequence[Fell]) -> None:
    """Draw releases as points, one beside the other, and the falls that are believed as lines."""
    import numpy as np

    end = 0.0
    for number, fell in enumerate(falls):
        time = 1e3 * fell.period_s * np.arange(len(fell.seen_rad)) + end
        seen = "seen, whole counts" if number == 0 else None
        ax.plot(time, np.degrees(fell.seen_rad), ".", ms=1.5, color=_BLUE, label=seen)
        believed = "believed" if number == 0 else None
        ax.plot(time, np.degrees(fell.believed_rad), lw=0.6, color=_RED, label=believed)
        end = time[-1] + 5
    ax.set_xlabel("time, ms, one release behind the other")
    ax.set_ylabel("way of the release, °")
    _legend_above(ax)


def _rides(ax: Axes, rides: Sequence[Rode]) -> None:
    """Draw the voltage that keeps the shaft at each rate, with two standard deviations, and as it is believed."""
    import numpy as np

    for number, rode in enumerate(rides):
        rate, way = np.degrees(abs(rode.rate_rad_s)), rode.rate_rad_s < 0
        label = {True: "backwards, seen", False: "seen"}[way]
        first = all((other.rate_rad_s < 0) != way for other in rides[:number])
        colour = _RED if way else _BLUE
        ax.errorbar(
            rate,
            rode.seen_v,
            2 * rode.deviation_v,
            fmt="o",
            ms=2.5,
            lw=0.8,
            color=colour,
            label=label if first else None,
        )
    for way in (False, True):
        line = [
            (np.degrees(abs(rode.rate_rad_s)), rode.believed_v)
            for rode in rides
            if (rode.rate_rad_s < 0) == way and rode.believed_v is not None
        ]
        if line:
            ax.plot(*zip(*sorted(line), strict=True), lw=0.6, color="0.2", label=None if way else "believed")
    ax.set_xlabel("rate, °/s")
    ax.set_ylabel("voltage at that rate, V")
    ax.margins(0.05)
    if rides:
        _legend_above(ax)


@_styled
def candidates(runs: Mapping[str, Result], chosen: str | None = None) -> Figure:
    """Draw the error of several runs below one another, on one scale: lowest to highest and mean of each part.

    Parameters
    ----------
    runs : mapping of str to Result
        Runs by their names.
    chosen : str, optional
        The name of the one to mark.

    Returns
    -------
    matplotlib.figure.Figure
        A row for each run: the error over time, in degrees, and the largest of it.

    Examples
    --------
    >>> import clutch
    >>> figure = clutch.plot.candidates({"SMC": clutch.simulate("smc_2")})
    """
    import matplotlib.pyplot as plt
    import numpy as np

    rows = max(len(runs), 1)
    size = (150 * _MM, (max(14 * rows, 56) + 12) * _MM)
    figure, grid = plt.subplots(rows, 1, figsize=size, sharex=True, squeeze=False, layout="constrained")
    most = max((float(np.max(np.abs(_error_deg(run)))) for run in runs.values()), default=1.0)
    scale = min(most, 0.5)
    for ax, (name, run) in zip(grid[:, 0], runs.items(), strict=False):
        _envelope(ax, np.asarray(run.samples["time_s"]), _error_deg(run), {"color": _BLUE})
        ax.set_ylim(-1.05 * scale, 1.05 * scale)
        marked = f"{name} (chosen)" if name == chosen else name
        ax.set_title(marked, loc="left", fontweight="bold" if name == chosen else "normal", pad=2)
        ax.set_title(f"up to {float(np.max(np.abs(_error_deg(run)))):.3f}°", loc="right", pad=2)
    figure.supylabel("error, °")
    grid[-1, 0].set_xlabel("t, s")
    return figure
