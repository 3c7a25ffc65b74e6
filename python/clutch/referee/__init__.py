"""The referee: cases whose answer is known from elsewhere, and what engines make of them.

Cases are data: a mechanism with friction, what is observed, the value expected, its tolerance and its source. The
engines of this package run them natively; engines of other makes come through small adapters, and all are judged from
their trajectories by the same code. ``python -m clutch.referee`` prints the table.

>>> from clutch import referee
>>> case = referee.cases()["P3"]
>>> case.title
'A brake that closes at 0.1 s stops a sliding mass'
>>> all(figure.holds for figure in case.judge(case.run("system")))
True

An engine of your own is any object with ``name``, ``about``, ``missing()``, ``refuses(case)`` and ``run(case)``:

>>> class Frictionless:
...     name, about = "frictionless", "no friction at all"
...     def missing(self):
...         return None
...     def refuses(self, case):
...         return None if case.mechanism else "a scenario"
...     def run(self, case):
...         import numpy as np
...         t = np.linspace(0, case.duration, case.samples + 1)
...         v0, q0 = case.mechanism.velocity[:, None], case.mechanism.position[:, None]
...         return referee.Trajectory(q0 + v0 * t, v0 + 0 * t)
>>> [result.held for result in referee.compare([case], [Frictionless()])]
[0]
"""

from __future__ import annotations

from clutch._errors import DoesNotApply
from clutch.referee._case import Case, Engine, Figure, Mechanism, Row, Signal, Trajectory, cases
from clutch.referee._compare import Own, Score, about, compare, others, own, table

__all__ = [
    "Case",
    "DoesNotApply",
    "Engine",
    "Figure",
    "Mechanism",
    "Own",
    "Row",
    "Score",
    "Signal",
    "Trajectory",
    "about",
    "cases",
    "compare",
    "others",
    "own",
    "table",
]
