"""The right answer: the tests' oracle, SciPy's DOP853 at 1e-12 written from the paper's equations alone."""

import math
import pathlib
import sys

import numpy as np

from job import DRIVE, DURATION, KD, KP, PERIOD, RATES, SETTLE, SMOOTHING, Figures

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python/tests"))
from oracle import Encoder, Loop, Pd, Plant, Weight


def loop(law: Pd, encoder: Encoder | None) -> Loop:
    """The job's loop with a law and an encoder, or none."""
    weight = Weight(mass=0.2, gravity=DRIVE / (0.2 * 0.024), radius=0.024)
    return Loop(law, Plant(drive=weight), encoder, None, SMOOTHING, at_rest=True)


def run(job: str, target: np.ndarray | None = None) -> Figures:
    """The job; `target` is the path's position at each sample, rad, if not the ramp itself."""
    ticks, settled = round(DURATION / PERIOD), round(SETTLE / PERIOD)
    path = RATES[job] * np.arange(ticks) * PERIOD if target is None else target
    result = loop(Pd(KP, KD), Encoder()).run(path, np.full(ticks, RATES[job]))
    error = (path - result["position"])[settled:]
    sticks = int(np.count_nonzero(result.times("stick") >= SETTLE))
    return Figures(math.sqrt(np.mean(error**2)), float(abs(error).max()), sticks)
