"""Engines before the cases, and the table of what they made of them."""

from __future__ import annotations

import reprlib
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from clutch._errors import DoesNotApply
from clutch.referee._case import Case, Engine, Figure, Trajectory

__all__ = ["Own", "Score", "about", "compare", "others", "own", "table"]


ENGINES = ("system", "bristled_system", "dormand_prince", "exact_flow", "bristle")


class Own:
    """An engine of this package.

    Parameters
    ----------
    name
        Its name, as :func:`own` has it.

    Raises
    ------
    ValueError
        This package has no such engine.
    """

    def __init__(self, name: str) -> None:
        if name not in ENGINES:
            raise ValueError(f"name = {name!r}: expected one of {', '.join(ENGINES)}")
        self.name = name
        self.about = "this package"

    def missing(self) -> str | None:
        """Never missing."""
        return None

    def refuses(self, case: Case) -> str | None:
        """Known only once it is asked to run: a case that it does not take costs nothing."""
        return None

    def run(self, case: Case) -> Trajectory:
        """Run the case natively."""
        return case.run(self.name)


def own() -> list[Engine]:
    """The engines of this package."""
    return [Own(name) for name in ENGINES]


def others() -> list[Engine]:
    """Engines of other makes, and the straw men; some need a package that may not be installed."""
    from clutch.referee._kamino import Kamino
    from clutch.referee._mujoco import MuJoCo, MuJoCoLuGre
    from clutch.referee._scipy import SciPy
    from clutch.referee._straw_men import Armstrong, Karnopp, Makkar, Tanh

    return [SciPy(), MuJoCo(), MuJoCoLuGre(), Kamino(), Tanh(), Makkar(), Karnopp(), Armstrong()]


@dataclass(frozen=True)
class Score:
    """An engine's result of a case."""

    case: str
    engine: str
    figures: list[Figure] = field(default_factory=list)
    #: Time of the processor, s.
    seconds: float = 0.0
    #: Why there are no figures: the engine does not take the case, or gave up.
    refused: str | None = None
    failed: str | None = None

    @property
    def held(self) -> int:
        """Figures that are as near as they have to be."""
        return sum(figure.holds for figure in self.figures)


def compare(cases: Iterable[Case], engines: Sequence[Engine]) -> list[Score]:
    """Run each case on each engine.

    An engine that gives up is said to have failed; it does not end the comparison.

    Parameters
    ----------
    cases
        Cases, as :func:`cases` gives them.
    engines
        Engines, as :func:`own` and :func:`others` give them, or your own.

    Raises
    ------
    ValueError
        Two cases of one id, or two engines of one name; a trajectory that has not the length of its case.
    TypeError
        An engine that gives no trajectory.
    """
    cases, results = list(cases), []
    for what, names in (("case", [c.id for c in cases]), ("engine", [e.name for e in engines])):
        if twice := next((name for i, name in enumerate(names) if name in names[:i]), None):
            raise ValueError(f"{what} {twice}: given twice; a table distinguishes them by their names")
    for case in cases:
        for engine in engines:
            if (why := engine.missing() or engine.refuses(case)) is not None:
                results.append(Score(case.id, engine.name, refused=why))
                continue
            begin = time.process_time()
            try:
                trajectory = engine.run(case)
            except DoesNotApply as e:
                results.append(Score(case.id, engine.name, refused=str(e)))
                continue
            except (ArithmeticError, ValueError) as e:
                results.append(Score(case.id, engine.name, failed=str(e), seconds=time.process_time() - begin))
                continue
            seconds = time.process_time() - begin
            if not isinstance(trajectory, Trajectory):
                given = reprlib.repr(trajectory)
                raise TypeError(f"engine {engine.name}: run() gave {given}: expected a clutch.referee.Trajectory")
            results.append(Score(case.id, engine.name, case.judge(trajectory), seconds))
    return results


def _off(figure: Figure) -> str:
    if figure.measured is None:
        return "none !"
    away = figure.measured - figure.expected
    if away == 0:
        return "exact"
    return f"{away:+.0e}".replace("e-0", "e-").replace("e+0", "e+") + ("" if figure.holds else " !")


def table(cases: Iterable[Case], results: Sequence[Score]) -> str:
    """The results as text: for each case a line for each engine that takes it, a column for each figure.

    A number is what the engine is off the expected value; the mark ``!`` says that this is more than the case allows.
    """
    lines = []
    for case in cases:
        own_results = [r for r in results if r.case == case.id and r.refused is None]
        lines.append(f"{case.id}  {case.title}")
        if not own_results:
            lines += ["  no engine that was asked takes it", ""]
            continue
        figures = next((r.figures for r in own_results if r.figures), [])
        # As many columns as fit a line of 80.
        for first in range(0, max(len(figures), 1), 3):
            part = slice(first, first + 3)
            heads = "".join(f"{f.name[:17]:>18}" for f in figures[part])
            lines.append(f"  {'':15}{heads}" + (f"{'cpu, s':>9}" if first == 0 else ""))
            wanted = "".join(f"{f'{f.expected:.7g} {f.unit}'.strip():>18}" for f in figures[part])
            lines.append(f"  {'expected':15}{wanted}")
            for r in own_results:
                if r.failed is not None:
                    lines.append(f"  {r.engine:15}gave up: {r.failed}"[:80])
                    continue
                row = "".join(f"{_off(f):>18}" for f in r.figures[part])
                lines.append(f"  {r.engine:15}{row}" + (f"{r.seconds:>9.3f}" if first == 0 else ""))
        lines.append("")
    lines.append(f"{'engine':17}{'cases':>7}{'figures':>9}{'held':>7}{'cpu, s':>10}")
    for engine in dict.fromkeys(r.engine for r in results):
        all_of = [r for r in results if r.engine == engine]
        ran = [r for r in all_of if r.refused is None]
        if not ran:
            lines.append(f"{engine:17}skipped: {all_of[0].refused}")
            continue
        count, held = sum(len(r.figures) for r in ran), sum(r.held for r in ran)
        lines.append(f"{engine:17}{len(ran):>7}{count:>9}{held:>7}{sum(r.seconds for r in ran):>10.2f}")
    return "\n".join(lines)


def about(engines: Sequence[Engine]) -> str:
    """A line for each engine: its method and version."""
    return "\n".join(f"{engine.name:17}{engine.about}" for engine in engines)
