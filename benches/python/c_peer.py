"""Peers in C, many gains side by side in vectors, compiled where they run; on one core.

`brute` is RK4 with ten steps per sample, `exact` the flow by quadrature.

    python benches/python/c_peer.py

prints how far `exact` is from SciPy's DOP853 where no encoder rounds, as a table in Markdown.
"""

import ctypes
import functools
import math
import pathlib
import subprocess
import tempfile

import numpy as np

import job
import reference
from job import Figures, gains

#: What each is called in a table.
NAMES = {"brute": "RK4, 10 steps a sample", "exact": "exact flow"}
#: Runs of `brute` that go side by side in the widest vectors.
SIDE = 16
DOUBLES = ctypes.POINTER(ctypes.c_double)


class Job(ctypes.Structure):
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


def numbers(rate: float, counts_per_radian: float, duration: float, settle: float) -> Job:
    """The job, with the rest as it is."""
    return Job(
        *(job.INERTIA, job.DRIVE, job.DAMPING, job.GAIN, job.MU_S, job.MU_D, job.V_S),
        *(job.SMOOTHING, counts_per_radian, job.LOWEST, job.HIGHEST, job.PERIOD, rate),
        *(round(duration / job.PERIOD), round(settle / job.PERIOD)),
    )


def run_many(peer: str, name: str, n: int, march: str) -> Figures:
    """The job with `n` pairs of gains, for `brute` a multiple of `SIDE`; the mean of the figures."""
    if peer == "brute" and n % SIDE:
        raise ValueError(f"n = {n}: expected a multiple of {SIDE}")
    of = numbers(job.RATES[name], job.COUNTS_PER_TURN / job.TURN, job.DURATION, job.SETTLE)
    kp, kd = np.array(gains(n)).T.copy()
    out = np.empty((n, 3))
    pointers = (array.ctypes.data_as(DOUBLES) for array in (kp, kd, out))
    build(peer, march).sweep(ctypes.byref(of), ctypes.c_int64(n), *pointers)
    return Figures(*map(float, out.mean(axis=0)))


def accuracy(march: str) -> list[tuple[float, float, float, int, float]]:
    """Rate in °/s, gains, sticks and the largest distance of `exact` from the oracle, rad; 0.5 s without an encoder."""
    found = []
    for rate, kp, kd in ((20.0, 5000.0, 50.0), (2.0, 5000.0, 50.0), (2.0, 5000.0, 5.0), (20.0, 20_000.0, 5.0)):
        radians = math.radians(rate)
        # Counts of 1e-15 rad are none.
        of = numbers(radians, 1e15, 0.5, 0.0)
        positions = np.empty(of.ticks)
        pointer = positions.ctypes.data_as(DOUBLES)
        build("exact", march).path(ctypes.byref(of), ctypes.c_double(kp), ctypes.c_double(kd), pointer)
        loop = reference.loop(reference.Pd(kp, kd), None)
        result = loop.run(radians * np.arange(of.ticks) * job.PERIOD, np.full(of.ticks, radians))
        worst = float(abs(positions - result["position"]).max())
        found.append((rate, kp, kd, len(result.times("stick")), worst))
    return found


def main() -> None:
    print("| instructions | °/s | K_p | K_d | sticks | largest distance, rad |\n|---|---|---|---|---|---|")
    for name, _, march in instructions():
        for rate, kp, kd, sticks, worst in accuracy(march):
            print(f"| {name} | {rate:g} | {kp:g} | {kd:g} | {sticks} | {worst:.1e} |")


if __name__ == "__main__":
    main()
