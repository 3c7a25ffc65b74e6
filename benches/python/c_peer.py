"""Peers in C, many gains side by side in vectors, compiled where they run; on one core.

`brute` is RK4 with ten steps per sample, `exact` the flow by quadrature.
"""

import ctypes
import functools
import math
import pathlib
import subprocess
import tempfile

import numpy as np

import job as numbers
from job import Figures, Job, gains

#: What each is called in a table.
NAMES = {"brute": "RK4, 10 steps a sample", "exact": "exact flow"}
#: Runs of `brute` that go side by side in the widest vectors.
SIDE = 16
DOUBLES = ctypes.POINTER(ctypes.c_double)


class Numbers(ctypes.Structure):
    """The numbers of the job, as vectors.h has them."""

    _fields_ = [
        *((name, ctypes.c_double) for name in ("inertia", "drive", "damping", "gain", "mu_s", "mu_d", "v_s")),
        *((name, ctypes.c_double) for name in ("smoothing", "counts_per_radian", "lowest", "highest")),
        *((name, ctypes.c_double) for name in ("period", "rate")),
        *((name, ctypes.c_int64) for name in ("ticks", "settled")),
    ]


def instructions() -> list[tuple[str, str, str]]:
    """Those of this processor that the peers take, the widest first: their name, clutch's name of them, and the
    compiler's flag. None on other kinds of processors."""
    try:
        flags = pathlib.Path("/proc/cpuinfo").read_text()
    except OSError:
        return []
    known = [
        ("avx512dq", "AVX-512", "avx512", "-march=x86-64-v4"),
        ("avx2", "AVX2", "avx2", "-march=x86-64-v3"),
    ]
    return [(name, ours, march) for feature, name, ours, march in known if feature in flags]


@functools.cache
def build(peer: str, march: str) -> ctypes.CDLL:
    """Compiles a peer with the C compiler of the system and loads it."""
    source = pathlib.Path(__file__).parent / peer / f"{peer}.c"
    with tempfile.TemporaryDirectory() as folder:
        library = pathlib.Path(folder) / f"{peer}.so"
        # Not -ffast-math, to which 1.5·2^52 less itself is 0. Products and sums are fused all the same.
        flags = ["-O3", march, "-ffp-contract=fast", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
        subprocess.run(["cc", *flags, str(source), "-o", str(library), "-lm"], check=True)
        return ctypes.CDLL(str(library))


def told(job: Job) -> Numbers:
    return Numbers(
        *(numbers.INERTIA, numbers.DRIVE, numbers.DAMPING, numbers.GAIN, numbers.MU_S, numbers.MU_D, numbers.V_S),
        *(numbers.SMOOTHING, job.counts_per_turn / numbers.TURN, numbers.LOWEST, numbers.HIGHEST),
        *(numbers.PERIOD, job.rate, job.ticks, job.settled),
    )


def run_many(peer: str, job: Job, n: int, march: str) -> Figures:
    """The job with `n` pairs of gains, for `brute` a multiple of `SIDE`; the mean of the figures."""
    if peer == "brute" and n % SIDE:
        raise ValueError(f"n = {n}: expected a multiple of {SIDE}")
    kp, kd = np.array(gains(n)).T.copy()
    out = np.empty((n, 3))
    pointers = (array.ctypes.data_as(DOUBLES) for array in (kp, kd, out))
    build(peer, march).sweep(ctypes.byref(told(job)), ctypes.c_int64(n), *pointers)
    return Figures(*map(float, out.mean(axis=0)))


def move(job: Job, march: str, seen: np.ndarray) -> Figures:
    """The job once by `exact`, whose sticks are not told; `seen` gets the positions."""
    pointer = seen.ctypes.data_as(DOUBLES)
    build("exact", march).path(ctypes.byref(told(job)), ctypes.c_double(job.kp), ctypes.c_double(job.kd), pointer)
    error = (job.rate * numbers.PERIOD * np.arange(job.ticks) - seen)[job.settled :]
    return Figures(float(np.sqrt(np.mean(error**2))), float(abs(error).max()), math.nan)
