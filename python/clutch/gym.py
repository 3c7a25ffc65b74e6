"""The tracking problem as a Gymnasium environment.

Importing this module registers ``clutch/Ramp-v0`` (the paper's rig, 2 °/s), ``clutch/RampBench-v0`` (the
stand-in for the paper's experiment) and ``clutch/MinimumJerk-v0`` (90° from rest to rest);
``gymnasium.make("clutch.gym:clutch/Ramp-v0")`` imports it by itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from clutch import _clutch
from clutch._run import ScenarioLike, as_scenario

__all__ = ["TrackingEnv", "register"]

_IDS = {
    "clutch/Ramp-v0": "smc_2",
    "clutch/RampBench-v0": "bench_smc_2",
    "clutch/MinimumJerk-v0": "minimum_jerk",
}


class TrackingEnv(gymnasium.Env[NDArray[np.float64], NDArray[np.float32]]):
    """An agent in the place of the law: each sampling period it sees what a law sees and answers with a voltage.

    Action: the voltage in V, from 0, or with a motor from ``output.lowest_v``, to ``output.highest_v``; the converter
    rounds it.

    Observation: measured error (rad), its rate (rad/s), the target's velocity (rad/s) and acceleration
    (rad/s²), and the voltage on its way to the brake (V). Errors and rates come from the encoder through the
    scenario's sampling and smoothing, as the scenario's own law gets them.

    Reward of a step: ``−error_weight (e/q)² − variation_weight |u − u_last|`` with the true error ``e`` at
    its end, the encoder's count ``q`` and the voltage ``u``. The episode is truncated at the scenario's
    duration, and ends where ``|e|`` exceeds ``max_error_deg``; the last reward then also charges each step
    that is left with the error at its limit, so that giving up never pays.

    The seed of ``reset`` is the scenario's ``run.seed``; without one it is drawn from the environment's
    generator.

    Info: ``error_rad`` (true), ``position_rad``, ``velocity_rad_s``, ``counts``, ``time_s``, ``stuck``,
    ``sticks`` (so far), ``seed``, and ``law_voltage_v``, the present answer of the scenario's own law.

    Parameters
    ----------
    scenario
        Scenario, name of a built-in one, or file. Its velocity must be the smoothed derivative: an observer would be
        given the law's voltages instead of the agent's.
    overrides
        Dotted keys of the scenario with other values.
    max_error_deg
        Error at which an episode ends, °, above 0.
    error_weight
        Weight of the squared error in counts, at least 0.
    variation_weight
        Weight of a change of the voltage, 1/V, at least 0.
    render_mode
        Only None: there is nothing to render; see `clutch.plot`.

    Raises
    ------
    ParamError
        A scenario that is refused.
    ValueError
        A scenario with an observer; a limit or weight out of range.

    Examples
    --------
    >>> import gymnasium, clutch.gym
    >>> env = gymnasium.make("clutch/Ramp-v0")
    >>> observation, info = env.reset(seed=1)
    >>> for _ in range(100):
    ...     observation, reward, terminated, truncated, info = env.step([info["law_voltage_v"]])
    >>> terminated, truncated, round(info["time_s"], 3)
    (False, False, 0.1)
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 (Gymnasium's declaration)

    def __init__(
        self,
        scenario: ScenarioLike = "smc_2",
        *,
        overrides: Mapping[str, Any] | None = None,
        max_error_deg: float = 5.0,
        error_weight: float = 1e-3,
        variation_weight: float = 1e-2,
        render_mode: None = None,
    ) -> None:
        self.scenario = as_scenario(scenario, overrides)
        if "observer" in self.scenario._tables()["velocity"]:
            raise ValueError("velocity.observer: expected velocity.smoothed_derivative in an environment")
        if not max_error_deg > 0.0:
            raise ValueError(f"max_error_deg = {max_error_deg}: expected an angle above 0°")
        if not (error_weight >= 0.0 and variation_weight >= 0.0):
            raise ValueError(f"weights of {error_weight} and {variation_weight}: expected at least 0")
        self.max_error_deg, self.render_mode = max_error_deg, render_mode
        self.error_weight, self.variation_weight = error_weight, variation_weight
        # The last sample is seen and not answered.
        self._steps = len(self.scenario.path()) - 1
        if self._steps < 1:
            raise ValueError("a scenario of one sample has no step: make run.duration_s longer")
        self._tick = self._steps  # no episode has begun
        self._count_rad = math.tau / self.scenario.rig.encoder.counts_per_rev
        # A pad can only push; a motor pulls, too.
        self._lowest = min(0.0, self.scenario.output.lowest_v)
        self.action_space = gymnasium.spaces.Box(self._lowest, self.scenario.output.highest_v, (1,), np.float32)
        low = np.array([-np.inf, -np.inf, -np.inf, -np.inf, self.scenario.rig.dac.lowest_v])
        high = np.array([np.inf, np.inf, np.inf, np.inf, self.scenario.rig.dac.highest_v])
        self.observation_space = gymnasium.spaces.Box(low, high, dtype=np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Begin a run.

        Parameters
        ----------
        seed
            The scenario's ``run.seed``; default: drawn.
        options
            None are known.

        Returns
        -------
        observation, info
            At the first sample.

        Examples
        --------
        >>> from clutch.gym import TrackingEnv
        >>> observation, info = TrackingEnv("smc_2").reset(seed=7)
        >>> info["seed"], info["time_s"], info["stuck"]
        (7, 0.0, False)
        """
        super().reset(seed=seed)
        self._seed = int(self.np_random.integers(1 << 31)) if seed is None else seed
        scenario = self.scenario.override({"run.seed": self._seed})
        self._plant, self._servo = _clutch.Plant(scenario), _clutch.Servo(scenario)
        self._path, self._tick = scenario.path(), 0
        return self._observe()

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """One sampling period under a voltage.

        Parameters
        ----------
        action
            Voltage in V, one element; beyond the limits it is cut.

        Returns
        -------
        observation, reward, terminated, truncated, info
            At the period's end.

        Raises
        ------
        ValueError
            A voltage that is not a number.
        gymnasium.error.ResetNeeded
            No episode has begun, or the last one has ended.

        Examples
        --------
        Let go, the shaft runs away:

        >>> from clutch.gym import TrackingEnv
        >>> env = TrackingEnv("smc_2")
        >>> _ = env.reset(seed=1)
        >>> while not env.step([0.0])[2]:
        ...     pass
        """
        if not self._tick < self._steps:
            raise gymnasium.error.ResetNeeded("call reset before the first step, and after an episode's last")
        before = self._plant.voltage
        volts = min(max(float(action[0]), self._lowest), self.scenario.output.highest_v)
        self._plant.step(volts)
        self._tick += 1
        observation, info = self._observe()
        error, limit = abs(info["error_rad"]), math.radians(self.max_error_deg)
        terminated, truncated = error > limit, self._tick >= self._steps
        reward = -self._cost(error) - self.variation_weight * abs(self._plant.voltage - before)
        if terminated:
            reward -= (self._steps - self._tick) * self._cost(limit)
            self._tick = self._steps
        return observation, reward, terminated, truncated and not terminated, info

    def _cost(self, error: float) -> float:
        return self.error_weight * (error / self._count_rad) ** 2

    def _observe(self) -> tuple[NDArray[np.float64], dict[str, Any]]:
        plant, servo, target = self._plant, self._servo, self._path.at(self._tick)
        law_voltage = servo.step(plant.counts, target)
        seen = (
            servo.error,
            servo.error_rate,
            target.velocity_rad_s,
            target.acceleration_rad_s2,
            plant.voltage,
        )
        return np.array(seen), {
            "error_rad": target.position_counts * self._count_rad - plant.position,
            "position_rad": plant.position,
            "velocity_rad_s": plant.velocity,
            "counts": plant.counts,
            "time_s": plant.time,
            "stuck": plant.stuck,
            "sticks": plant.sticks,
            "seed": self._seed,
            "law_voltage_v": law_voltage,
        }


def register() -> None:
    """Register the environments with Gymnasium; importing this module does it.

    Examples
    --------
    >>> import gymnasium, clutch.gym
    >>> clutch.gym.register()
    >>> gymnasium.spec("clutch/Ramp-v0").kwargs
    {'scenario': 'smc_2'}
    """
    for name, scenario in _IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, entry_point="clutch.gym:TrackingEnv", kwargs={"scenario": scenario})


register()
