"""Peer: SciPy's solve_ivp, RK45 with an event at the stop, restarted at each sample."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from job import (
    DAMPING,
    DRIVE,
    GAIN,
    HIGHEST,
    INERTIA,
    LOWEST,
    MU_D,
    MU_S,
    PERIOD,
    SMOOTHING,
    TURN,
    V_S,
    Figures,
    Job,
)


def run(job: Job, seen: np.ndarray | None = None, **tolerances: float) -> Figures:
    """The job; `seen` gets the positions. `tolerances` are solve_ivp's `rtol` and `atol`, else its own defaults."""
    exp = math.exp
    rate, kp, kd = job.rate, job.kp, job.kd
    ticks, settled = job.ticks, job.settled
    counts_per_rad, rad_per_count = job.counts_per_turn / TURN, TURN / job.counts_per_turn

    def slip(t, y, brake):
        # Friction keeps the direction of the slip, also where a trial step looks beyond the stop.
        w = y[1]
        friction = (MU_D + (MU_S - MU_D) * exp(-abs(w) / V_S)) * brake
        return (w, (DRIVE - friction - DAMPING * w) / INERTIA)

    def stop(t, y, brake):
        return y[1]

    stop.terminal, stop.direction = True, -1.0

    position, velocity, stuck = 0.0, 0.0, True
    last, error_rate = 0.0, 0.0
    squares, worst, sticks = 0.0, 0.0, 0
    for k in range(ticks):
        target = rate * (k * PERIOD)
        if seen is not None:
            seen[k] = position
        if k >= settled:
            true_error = target - position
            squares += true_error * true_error
            worst = max(worst, abs(true_error))
        error = target - math.floor(position * counts_per_rad) * rad_per_count
        error_rate = (1.0 - SMOOTHING) * error_rate + SMOOTHING * (error - last) / PERIOD
        last = error
        volts = min(max(-(kp * error + kd * error_rate), LOWEST), HIGHEST)
        brake = GAIN * volts

        stuck = stuck and MU_S * brake >= DRIVE
        left = PERIOD
        while not stuck and left > 0.0:
            # One step is the first guess: the solver's own costs two more evaluations.
            options = {"events": stop, "args": (brake,), "first_step": left, **tolerances}
            piece = solve_ivp(slip, (0.0, left), (position, velocity), **options)
            left -= piece.t[-1]
            position, velocity = float(piece.y[0, -1]), float(piece.y[1, -1])
            if piece.status == 1:
                velocity = 0.0
                stuck = MU_S * brake >= DRIVE
                sticks += stuck and k >= settled
            elif piece.status < 0:
                raise RuntimeError(piece.message)
    return Figures(math.sqrt(squares / (ticks - settled)), worst, sticks)
