"""The right answer: the tests' oracle, SciPy's DOP853 at 1e-13 written from the paper's equations alone."""

import math
import pathlib
import sys

import numpy as np

from job import DRIVE, PERIOD, SMOOTHING, Figures, Job

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python/tests"))
import oracle
from oracle import Encoder, Loop, Pd, Plant, Weight

oracle.RTOL, oracle.ATOL = 1e-13, (1e-16, 1e-14)


def run(job: Job, target: np.ndarray | None = None, seen: np.ndarray | None = None) -> Figures:
    """The job; `target` is the path at each sample, rad, if not the ramp itself; `seen` gets the positions."""
    weight = Weight(mass=0.2, gravity=DRIVE / (0.2 * 0.024), radius=0.024)
    loop = Loop(Pd(job.kp, job.kd), Plant(drive=weight), Encoder(job.counts_per_turn), None, SMOOTHING, at_rest=True)
    path = job.rate * np.arange(job.ticks) * PERIOD if target is None else target
    result = loop.run(path, np.full(job.ticks, job.rate))
    if seen is not None:
        seen[:] = result["position"]
    error = (path - result["position"])[job.settled :]
    sticks = int(np.count_nonzero(result.times("stick") >= job.settle))
    return Figures(math.sqrt(np.mean(error**2)), float(abs(error).max()), sticks)
