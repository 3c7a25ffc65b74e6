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

# As typing has it, without importing typing.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from clutch import dynamics as dynamics
    from clutch import executors as executors
    from clutch import gym as gym
    from clutch import plot as plot
    from clutch import referee as referee
    from clutch._certificate import Certificate as Certificate
    from clutch._clutch import Path as Path
    from clutch._clutch import Plant as Plant
    from clutch._clutch import Servo as Servo
    from clutch._clutch import StickSlip as StickSlip
    from clutch._clutch import Table as Table
    from clutch._clutch import Target as Target
    from clutch._clutch import Tick as Tick
    from clutch._clutch import scenarios as scenarios
    from clutch._compare import Comparison as Comparison
    from clutch._compare import compare as compare
    from clutch._errors import LoopError as LoopError
    from clutch._errors import ParamError as ParamError
    from clutch._log import Difference as Difference
    from clutch._log import Log as Log
    from clutch._log import Replay as Replay
    from clutch._log import read_log as read_log
    from clutch._log import replay as replay
    from clutch._loop import LoopResult as LoopResult
    from clutch._loop import loop as loop
    from clutch._metrics import Metrics as Metrics
    from clutch._model import Scenario as Scenario
    from clutch._paper import PaperFigure as PaperFigure
    from clutch._paper import PaperPanel as PaperPanel
    from clutch._paper import Reproduction as Reproduction
    from clutch._paper import reproduce as reproduce
    from clutch._run import Result as Result
    from clutch._run import SteppedLaw as SteppedLaw
    from clutch._run import simulate as simulate
    from clutch._smooth import SmoothSpeed as SmoothSpeed
    from clutch._smooth import lowest_smooth_speed as lowest_smooth_speed
    from clutch._sweep import Samples as Samples
    from clutch._sweep import SweepResult as SweepResult
    from clutch._sweep import grid as grid
    from clutch._sweep import latin_hypercube as latin_hypercube
    from clutch._sweep import samples as samples
    from clutch._sweep import sobol as sobol
    from clutch._sweep import sweep as sweep
    from clutch._sweep_file import SweptFile as SweptFile
    from clutch._sweep_file import sweep_to_file as sweep_to_file
    from clutch._tables import *  # noqa: F403
    from clutch._tune import Candidate as Candidate
    from clutch._tune import Estimate as Estimate
    from clutch._tune import Fell as Fell
    from clutch._tune import Identified as Identified
    from clutch._tune import Rode as Rode
    from clutch._tune import Tuned as Tuned
    from clutch._tune import identify as identify
    from clutch._tune import tune as tune

    __version__: str

# Each name is imported when it is first asked for: a program that simulates does not wait for what sweeps or plots. All
# other names are of a scenario's tables, which have a list of them.
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
    "_sweep_file": ["SweptFile", "sweep_to_file"],
    "_tune": ["Candidate", "Estimate", "Fell", "Identified", "Rode", "Tuned", "identify", "tune"],
}
_WHERE = {name: (module, name) for module, names in _MODULES.items() for name in names}
_WHERE["__version__"] = ("_clutch", "VERSION")
_SUBMODULES = {"dynamics", "executors", "gym", "plot", "referee"}

if not TYPE_CHECKING:

    def _of_tables():
        return importlib.import_module("clutch._tables")

    def __getattr__(name):
        if name in _SUBMODULES:
            return importlib.import_module(f"clutch.{name}")
        if name == "__all__":
            value = sorted([*_WHERE, *_SUBMODULES, *_of_tables().__all__])
        elif name in _WHERE:
            module, there = _WHERE[name]
            value = getattr(importlib.import_module(f"clutch.{module}"), there)
        elif not name.startswith("_") and name in _of_tables().__all__:
            value = getattr(_of_tables(), name)
        else:
            raise AttributeError(f"module 'clutch' has no attribute {name!r}")
        globals()[name] = value
        return value

    def __dir__():
        return __getattr__("__all__")
