"""Peer: SciPy's solve_ivp, RK45 with an event at the stop, restarted at each sample."""

import math

from scipy.integrate import solve_ivp

from job import (
    COUNTS_PER_TURN,
    DAMPING,
    DRIVE,
    DURATION,
    GAIN,
    HIGHEST,
    INERTIA,
    KD,
    KP,
    LOWEST,
    MU_D,
    MU_S,
    PERIOD,
    RATES,
    SETTLE,
    SMOOTHING,
    TURN,
    V_S,
    Figures,
)


def run(job: str, **tolerances: float) -> Figures:
    """The job; `tolerances` are solve_ivp's `rtol` and `atol`, its own defaults if not given."""
    exp = math.exp
    rate = RATES[job]
    ticks, settled = round(DURATION / PERIOD), round(SETTLE / PERIOD)
    counts_per_rad, rad_per_count = COUNTS_PER_TURN / TURN, TURN / COUNTS_PER_TURN

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
        if k >= settled:
            true_error = target - position
            squares += true_error * true_error
            worst = max(worst, abs(true_error))
        error = target - math.floor(position * counts_per_rad) * rad_per_count
        error_rate = (1.0 - SMOOTHING) * error_rate + SMOOTHING * (error - last) / PERIOD
        last = error
        volts = min(max(-(KP * error + KD * error_rate), LOWEST), HIGHEST)
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
