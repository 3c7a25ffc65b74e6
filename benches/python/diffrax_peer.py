"""Peer: diffrax's Tsit5 on JAX, compiled, with an event at the stop and a restart at each sample; where installed."""

import functools
import importlib.util
import math

import job as numbers
from job import Figures, Job

INSTALLED = importlib.util.find_spec("diffrax") is not None


@functools.cache
def compiled(job: Job):
    """The loop of the job, a function of the path's rate. Imports JAX, which takes seconds."""
    import diffrax
    import jax
    import jax.numpy as jnp
    import optimistix

    jax.config.update("jax_enable_x64", True)
    ticks, settled, counts = job.ticks, job.settled, job.counts_per_turn

    def rates(_, state, brake):
        velocity = state[1]
        friction = (numbers.MU_D + (numbers.MU_S - numbers.MU_D) * jnp.exp(-jnp.abs(velocity) / numbers.V_S)) * brake
        return jnp.stack([velocity, (numbers.DRIVE - friction - numbers.DAMPING * velocity) / numbers.INERTIA])

    stop = diffrax.Event(lambda t, y, args, **_: y[1], optimistix.Newton(1e-10, 1e-10), direction=False)
    control = diffrax.PIDController(rtol=1e-6, atol=1e-9)

    def moved(position, velocity, brake):
        start = jnp.stack([jnp.zeros_like(position), velocity])
        term, solver = diffrax.ODETerm(rates), diffrax.Tsit5()
        solution = diffrax.diffeqsolve(
            term, solver, 0.0, numbers.PERIOD, numbers.PERIOD, start, brake, stepsize_controller=control, event=stop
        )
        way, after = solution.ys[-1]
        return position + way, jnp.where(solution.event_mask, 0.0, after), solution.event_mask

    def tick(state, k, rate):
        position, velocity, stuck, last, error_rate = state
        target = rate * (k * numbers.PERIOD)
        error = target - jnp.floor(position * (counts / numbers.TURN)) * (numbers.TURN / counts)
        error_rate = (1.0 - numbers.SMOOTHING) * error_rate + (numbers.SMOOTHING / numbers.PERIOD) * (error - last)
        brake = numbers.GAIN * jnp.clip(-(job.kp * error + job.kd * error_rate), numbers.LOWEST, numbers.HIGHEST)
        holds = numbers.MU_S * brake >= numbers.DRIVE
        rests = stuck & holds
        after, speed, stops = jax.lax.cond(
            rests, lambda: (position, velocity, jnp.array(False)), lambda: moved(position, velocity, brake)
        )
        sticks = stops & holds
        return (after, speed, rests | sticks, error, error_rate), (target - position, sticks)

    @jax.jit
    def loop(rate):
        zero = jnp.zeros(())
        start = (zero, zero, jnp.array(True), zero, zero)
        _, (errors, sticks) = jax.lax.scan(lambda s, k: tick(s, k, rate), start, jnp.arange(ticks))
        errors, sticks = errors[settled:], sticks[settled:]
        return jnp.mean(errors**2), jnp.max(jnp.abs(errors)), jnp.sum(sticks)

    return loop


def run(job: Job) -> Figures:
    """The job, once."""
    square, worst, sticks = compiled(job)(job.rate)
    return Figures(math.sqrt(float(square)), float(worst), int(sticks))
