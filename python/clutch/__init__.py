"""Slow, smooth motion of shafts restrained by friction.

A brake can only resist: a weight, a spring or a hand drives a shaft, and each millisecond a computer sets how hard a
pad presses on a disc. This package scripts experiments with it: simulate, certify, sweep, read logs, replay, plot.
The physics, the laws and the checks are in the Rust crates that drive the hardware; nothing of them is written again
here.

>>> import clutch
>>> result = clutch.simulate("smc_2")
>>> result.metrics.max_error_rad < 0.003
True
"""

import importlib
from types import ModuleType
from typing import TYPE_CHECKING

from clutch import _clutch, _tables
from clutch._certificate import Certificate
from clutch._clutch import Path, Plant, Servo, StickSlip, Table, Target, Tick, scenarios
from clutch._compare import Comparison, compare
from clutch._errors import LoopError, ParamError
from clutch._log import Difference, Log, Replay, read_log, replay
from clutch._loop import LoopResult, loop
from clutch._metrics import Metrics
from clutch._model import Scenario
from clutch._paper import PaperFigure, PaperPanel, Reproduction, reproduce
from clutch._run import Result, SteppedLaw, simulate
from clutch._smooth import SmoothSpeed, lowest_smooth_speed
from clutch._sweep import Samples, SweepResult, grid, latin_hypercube, samples, sobol, sweep
from clutch._tables import *  # noqa: F403
from clutch._tune import Candidate, Estimate, Identified, Tuned, identify, tune

if TYPE_CHECKING:
    from clutch import dynamics, executors, gym, plot, referee

__version__ = _clutch.VERSION

__all__ = [
    "Candidate",
    "Certificate",
    "Comparison",
    "Difference",
    "Estimate",
    "Identified",
    "Log",
    "LoopError",
    "LoopResult",
    "Metrics",
    "PaperFigure",
    "PaperPanel",
    "ParamError",
    "Path",
    "Plant",
    "Replay",
    "Reproduction",
    "Result",
    "Samples",
    "Scenario",
    "Servo",
    "SmoothSpeed",
    "SteppedLaw",
    "StickSlip",
    "SweepResult",
    "Table",
    "Target",
    "Tick",
    "Tuned",
    "__version__",
    "compare",
    "dynamics",
    "executors",
    "grid",
    "gym",
    "identify",
    "latin_hypercube",
    "loop",
    "lowest_smooth_speed",
    "plot",
    "read_log",
    "referee",
    "replay",
    "reproduce",
    "samples",
    "scenarios",
    "simulate",
    "sobol",
    "sweep",
    "tune",
]
__all__ += _tables.__all__

# Each imports a large library, so it is imported on request.
_LATER = {"dynamics", "executors", "gym", "plot", "referee"}


def __getattr__(name: str) -> ModuleType:
    if name in _LATER:
        return importlib.import_module(f"clutch.{name}")
    raise AttributeError(f"module 'clutch' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
