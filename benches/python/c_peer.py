"""Peer: RK4 with ten steps per sample in C, many gains side by side in vectors, compiled where it runs; on one core."""

import ctypes
import functools
import pathlib
import subprocess
import tempfile

import numpy as np

import job
from job import Figures, gains

#: Runs that go side by side in the widest vectors.
SIDE = 16


class Job(ctypes.Structure):
    """The numbers of the job, as brute/brute.c has them."""

    _fields_ = [
        *((name, ctypes.c_double) for name in ("inertia", "drive", "damping", "gain", "mu_s", "mu_d", "v_s")),
        *((name, ctypes.c_double) for name in ("smoothing", "counts_per_radian", "lowest", "highest")),
        *((name, ctypes.c_double) for name in ("period", "rate")),
        *((name, ctypes.c_int64) for name in ("ticks", "settled")),
    ]


def instructions() -> list[tuple[str, str, str]]:
    """Those of this processor that brute/brute.c takes, the widest first: their name, clutch's name of them, and the
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
def build(march: str) -> ctypes.CDLL:
    """Compiles brute/brute.c with the C compiler of the system and loads it."""
    source = pathlib.Path(__file__).parent / "brute/brute.c"
    with tempfile.TemporaryDirectory() as folder:
        library = pathlib.Path(folder) / "brute.so"
        # Not -ffast-math, to which 1.5·2^52 less itself is 0. Products and sums are fused all the same.
        flags = ["-O3", march, "-ffp-contract=fast", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
        subprocess.run(["cc", *flags, str(source), "-o", str(library), "-lm"], check=True)
        return ctypes.CDLL(str(library))


def run_many(name: str, n: int, march: str) -> Figures:
    """The job with `n` pairs of gains, a multiple of `SIDE`; the mean of the figures."""
    if n % SIDE:
        raise ValueError(f"n = {n}: expected a multiple of {SIDE}")
    of = Job(
        *(job.INERTIA, job.DRIVE, job.DAMPING, job.GAIN, job.MU_S, job.MU_D, job.V_S),
        *(job.SMOOTHING, job.COUNTS_PER_TURN / job.TURN, job.LOWEST, job.HIGHEST, job.PERIOD, job.RATES[name]),
        *(round(job.DURATION / job.PERIOD), round(job.SETTLE / job.PERIOD)),
    )
    kp, kd = np.array(gains(n)).T.copy()
    out = np.empty((n, 3))
    pointers = (array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (kp, kd, out))
    build(march).sweep(ctypes.byref(of), ctypes.c_int64(n), *pointers)
    return Figures(*map(float, out.mean(axis=0)))
