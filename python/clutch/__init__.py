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

from clutch._names import TABLES

# As typing has it, without importing typing.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from clutch import dynamics, executors, gym, plot, referee
    from clutch._certificate import Certificate
    from clutch._clutch import VERSION as __version__
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
__all__ += TABLES

# Each name is imported when it is first asked for: a program that simulates does not wait for what sweeps or plots.
_MODULES = {
    "_certificate": ["Certificate"],
    "_clutch": ["Path", "Plant", "Servo", "StickSlip", "Table", "Target", "Tick", "scenarios"],
    "_compare": ["Comparison", "compare"],
    "_errors": ["LoopError", "ParamError"],
    "_log": ["Difference", "Log", "Replay", "read_log", "replay"],
    "_loop": ["LoopResult", "loop"],
    "_metrics": ["Metrics"],
    "_model": ["Scenario"],
    "_paper": ["PaperFigure", "PaperPanel", "Reproduction", "reproduce"],
    "_run": ["Result", "SteppedLaw", "simulate"],
    "_smooth": ["SmoothSpeed", "lowest_smooth_speed"],
    "_sweep": ["Samples", "SweepResult", "grid", "latin_hypercube", "samples", "sobol", "sweep"],
    "_tables": TABLES,
    "_tune": ["Candidate", "Estimate", "Identified", "Tuned", "identify", "tune"],
}
_WHERE = {name: (module, name) for module, names in _MODULES.items() for name in names}
_WHERE["__version__"] = ("_clutch", "VERSION")
_SUBMODULES = {"dynamics", "executors", "gym", "plot", "referee"}

if not TYPE_CHECKING:

    def __getattr__(name):
        if name in _SUBMODULES:
            return importlib.import_module(f"clutch.{name}")
        if name not in _WHERE:
            raise AttributeError(f"module 'clutch' has no attribute {name!r}")
        module, there = _WHERE[name]
        value = globals()[name] = getattr(importlib.import_module(f"clutch.{module}"), there)
        return value


def __dir__() -> list[str]:
    return __all__
