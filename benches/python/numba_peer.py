"""Peer: RK4 with ten steps per sample, compiled by numba; one run, or many on all cores."""

import math

import numpy as np
from numba import njit, prange

from job import (
    DAMPING,
    DRIVE,
    GAIN,
    HIGHEST,
    INERTIA,
    JOBS,
    LOWEST,
    MU_D,
    MU_S,
    PERIOD,
    SMOOTHING,
    TURN,
    V_S,
    Figures,
    Job,
    gains,
)

SUBSTEPS = 10
#: For positions that nobody wants.
NOWHERE = np.empty(0)


@njit(fastmath=True, error_model="numpy", inline="always")
def acceleration(w, brake):
    friction = (MU_D + (MU_S - MU_D) * math.exp(-abs(w) * (1.0 / V_S))) * brake
    return (DRIVE - friction - DAMPING * w) * (1.0 / INERTIA)


@njit(fastmath=True, error_model="numpy")
def loop(rate, kp, kd, counts_per_turn, ticks, settled, seen):
    h = PERIOD / SUBSTEPS
    position, velocity, stuck = 0.0, 0.0, True
    last, error_rate = 0.0, 0.0
    squares, worst, sticks = 0.0, 0.0, 0
    for k in range(ticks):
        target = rate * (k * PERIOD)
        if seen.size > 0:
            seen[k] = position
        if k >= settled:
            true_error = target - position
            squares += true_error * true_error
            worst = max(worst, abs(true_error))
        error = target - np.floor(position * (counts_per_turn / TURN)) * (TURN / counts_per_turn)
        error_rate = (1.0 - SMOOTHING) * error_rate + (SMOOTHING / PERIOD) * (error - last)
        last = error
        brake = GAIN * min(max(-(kp * error + kd * error_rate), LOWEST), HIGHEST)

        holds = MU_S * brake >= DRIVE
        if stuck and holds:
            continue  # nothing moves in this period
        stuck = False
        for _ in range(SUBSTEPS):
            a1 = acceleration(velocity, brake)
            w2 = velocity + 0.5 * h * a1
            a2 = acceleration(w2, brake)
            w3 = velocity + 0.5 * h * a2
            a3 = acceleration(w3, brake)
            w4 = velocity + h * a3
            a4 = acceleration(w4, brake)
            after = velocity + (h / 6.0) * (a1 + 2.0 * (a2 + a3) + a4)
            if after < 0.0:
                # The velocity went through 0: the instant by a straight line, the way up to it by the mean.
                part = velocity / (velocity - after)
                position += 0.5 * part * h * velocity
                velocity = 0.0
                if holds:
                    stuck = True
                    if k >= settled:
                        sticks += 1
                    break
            else:
                position += (h / 6.0) * (velocity + 2.0 * (w2 + w3) + w4)
                velocity = after
    return squares / (ticks - settled), worst, sticks


@njit(parallel=True, fastmath=True, error_model="numpy")
def sweep(rate, kp, kd, counts_per_turn, ticks, settled, nowhere, out):
    for i in prange(kp.shape[0]):
        square, worst, sticks = loop(rate, kp[i], kd[i], counts_per_turn, ticks, settled, nowhere)
        out[i, 0] = math.sqrt(square)
        out[i, 1] = worst
        out[i, 2] = sticks


def run(job: Job, seen: np.ndarray = NOWHERE) -> Figures:
    """The job, once; `seen` gets the positions."""
    square, worst, sticks = loop(job.rate, job.kp, job.kd, float(job.counts_per_turn), job.ticks, job.settled, seen)
    return Figures(math.sqrt(square), worst, sticks)


def run_many(job: Job, n: int) -> Figures:
    """The job with `n` pairs of gains; the mean of the figures."""
    kp, kd = np.array(gains(n)).T.copy()
    out = np.empty((n, 3))
    sweep(job.rate, kp, kd, float(job.counts_per_turn), job.ticks, job.settled, NOWHERE, out)
    return Figures(*map(float, out.mean(axis=0)))


def compile_all() -> None:
    """Compiles both, so that no measurement pays for it."""
    run(JOBS["J20"])
    run_many(JOBS["J20"], 4)
