"""The tracking problem as Gymnasium environments, one shaft or many at once.

Importing this module registers ``clutch/Ramp-v0`` (the paper's rig, 2 °/s), ``clutch/RampBench-v0`` (the
stand-in for the paper's experiment) and ``clutch/MinimumJerk-v0`` (90° from rest to rest);
``gymnasium.make("clutch.gym:clutch/Ramp-v0")`` imports it by itself, ``gymnasium.make_vec`` likewise. (Gymnasium
from 1.0 on looks for no entry points of packages: the name of the module before the colon takes their place.)

Actions and observations are scaled to about −1 … 1; :class:`Scales` takes them into SI units and back.
"""

from __future__ import annotations

import collections
import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clutch import _clutch
from clutch._extras import needed
from clutch._model import Scenario
from clutch._run import ScenarioLike, as_scenario

with needed("gymnasium", "clutch.gym"):
    import gymnasium
    from gymnasium.vector.utils import batch_space

__all__ = ["Scales", "TrackingEnv", "TrackingVectorEnv", "register"]

_IDS = {
    "clutch/Ramp-v0": "smc_2",
    "clutch/RampBench-v0": "bench_smc_2",
    "clutch/MinimumJerk-v0": "minimum_jerk",
}
_ROW = {name: i for i, name in enumerate(_clutch.Shafts.QUANTITIES)}
#: The observation of an agent, in this order.
_SEEN = (
    "measured_error_rad",
    "error_rate_rad_s",
    "target_velocity_rad_s",
    "target_acceleration_rad_s2",
    "voltage_v",
)
_SEEN_ROWS = [_ROW[name] for name in _SEEN]
#: An observation further out is cut: the shaft has long left its path.
_LIMIT = 100.0
#: Time that a picture shows, s.
_SHOWN_S = 0.3

_Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scales:
    """The units of an environment: what −1, 0 and 1 stand for.

    An observation is error, its rate, the target's velocity and acceleration, and the voltage: each less its middle,
    over its scale, cut at ±100. An action is the voltage on the same scale.

    Attributes
    ----------
    error_rad : float
        Scale of the error: a tenth of the error at which an episode ends, rad.
    velocity_rad_s : float
        Scale of the error's rate and of the target's velocity: the path's highest speed, rad/s.
    acceleration_rad_s2 : float
        Scale of the target's acceleration: the path's highest, rad/s²; 1 for a path without.
    lowest_v, highest_v : float
        Voltages of the actions −1 and 1, V.

    Examples
    --------
    >>> from clutch.gym import TrackingEnv
    >>> scales = TrackingEnv("smc_2").scales
    >>> scales.volts(-1.0).item(), scales.volts(1.0).item(), scales.action(7.5).item()
    (0.0, 10.0, 0.5)
    """

    error_rad: float
    velocity_rad_s: float
    acceleration_rad_s2: float
    lowest_v: float
    highest_v: float

    @classmethod
    def of(cls, scenario: Scenario, max_error_deg: float) -> Scales:
        """The scales of a scenario."""
        path = scenario.path().table()
        acceleration = float(np.max(np.abs(path["acceleration_rad_s2"])))
        return cls(
            error_rad=math.radians(max_error_deg) / 10,
            velocity_rad_s=float(np.max(np.abs(path["velocity_rad_s"]))) or 1.0,
            acceleration_rad_s2=acceleration or 1.0,
            # A pad can only push; a motor pulls, too.
            lowest_v=min(0.0, scenario.output.lowest_v),
            highest_v=scenario.output.highest_v,
        )

    @functools.cached_property
    def _middle_and_scale(self) -> tuple[_Array, _Array]:
        middle, half = (self.lowest_v + self.highest_v) / 2, (self.highest_v - self.lowest_v) / 2
        scale = [self.error_rad, self.velocity_rad_s, self.velocity_rad_s, self.acceleration_rad_s2, half]
        return np.array([0.0, 0.0, 0.0, 0.0, middle]), np.array(scale)

    def physical(self, observation: NDArray[Any]) -> _Array:
        """An observation in rad, rad/s, rad/s, rad/s² and V; the last axis of an array of them."""
        middle, scale = self._middle_and_scale
        return np.asarray(observation, dtype=np.float64) * scale + middle

    def observation(self, physical: _Array) -> NDArray[np.float32]:
        """The inverse of :meth:`physical`, cut at ±100."""
        middle, scale = self._middle_and_scale
        return np.minimum(np.maximum((physical - middle) / scale, -_LIMIT), _LIMIT).astype(np.float32)

    def volts(self, action: Any) -> _Array:
        """The voltage of an action, V; beyond ±1 it is cut."""
        middle, scale = self._middle_and_scale
        volts: _Array = np.minimum(np.maximum(np.asarray(action, dtype=np.float64), -1.0), 1.0) * scale[4] + middle[4]
        return volts

    def action(self, volts: Any) -> NDArray[np.float32]:
        """The action of a voltage, V: what a law answers, for one."""
        middle, scale = self._middle_and_scale
        action: NDArray[np.float32] = ((np.asarray(volts, dtype=np.float64) - middle[4]) / scale[4]).astype(np.float32)
        return action


class _Tracking:
    """The scenario, the spaces and the reward, which one environment and many of them share."""

    def __init__(
        self,
        scenario: ScenarioLike,
        overrides: Mapping[str, Any] | None,
        max_error_deg: float,
        error_weight: float,
        variation_weight: float,
    ) -> None:
        self.scenario = as_scenario(scenario, overrides)
        if "observer" in self.scenario._tables()["velocity"]:
            raise ValueError("velocity.observer: expected velocity.smoothed_derivative in an environment")
        if not max_error_deg > 0.0:
            raise ValueError(f"max_error_deg = {max_error_deg}: expected an angle above 0°")
        for key, value in (("error_weight", error_weight), ("variation_weight", variation_weight)):
            if not value >= 0.0:
                raise ValueError(f"{key} = {value}: expected at least 0")
        # The last sample is seen and not answered.
        self.steps = len(self.scenario.path()) - 1
        if self.steps < 1:
            raise ValueError("a scenario of one sample has no step: make run.duration_s longer")
        self.scales = Scales.of(self.scenario, max_error_deg)
        self.limit = math.radians(max_error_deg)
        self.error_weight, self.variation_weight = error_weight, variation_weight
        self.count_rad = math.tau / self.scenario.rig.encoder.counts_per_rev
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.observation_space = gymnasium.spaces.Box(-_LIMIT, _LIMIT, (len(_SEEN),), np.float32)

    def error(self, seen: _Array) -> _Array:
        """The true errors, rad."""
        error: _Array = seen[_ROW["target_counts"]] * self.count_rad - seen[_ROW["position_rad"]]
        return error

    def observation(self, seen: _Array) -> NDArray[np.float32]:
        return self.scales.observation(seen[_SEEN_ROWS].T)

    def cost(self, error: Any) -> Any:
        return self.error_weight * (error / self.count_rad) ** 2

    def judged(self, before: _Array, seen: _Array, tick: NDArray[np.int64]) -> tuple[_Array, NDArray[np.bool_]]:
        """Reward of a step that ended at that tick, and whether the episode ends with it."""
        error = np.abs(self.error(seen))
        terminated = error > self.limit
        variation = np.abs(seen[_ROW["voltage_v"]] - before[_ROW["voltage_v"]])
        reward = -self.cost(error) - self.variation_weight * variation
        # Giving up never pays: as if the error stayed at its limit to the end.
        return reward - np.where(terminated, (self.steps - tick) * self.cost(self.limit), 0.0), terminated

    def info(self, seen: _Array) -> dict[str, _Array]:
        named = ("position_rad", "velocity_rad_s", "counts", "time_s", "stuck", "sticks", "law_voltage_v", *_SEEN)
        return {"error_rad": self.error(seen)} | {name: seen[_ROW[name]] for name in named}


class TrackingEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """An agent in the place of the law: each sampling period it sees what a law sees and answers with a voltage.

    Action: the voltage, −1 for the lowest (0 V, or with a motor ``output.lowest_v``), 1 for ``output.highest_v``; the
    converter rounds it.

    Observation: measured error, its rate, the target's velocity and acceleration, and the voltage on its way to the
    brake, scaled to about −1 … 1 by ``scales``. Errors and rates come from the encoder through the scenario's sampling
    and smoothing, as the scenario's own law gets them.

    Reward of a step: ``−error_weight (e/q)² − variation_weight |u − u_last|`` with the true error ``e`` at
    its end, the encoder's count ``q`` and the voltage ``u`` in V. The episode is truncated at the scenario's
    duration, and ends where ``|e|`` exceeds ``max_error_deg``; the last reward then also charges each step
    that is left with the error at its limit, so that giving up never pays.

    The seed of ``reset`` is the scenario's ``run.seed``; without one it is drawn from the environment's
    generator.

    Info, in SI units: ``error_rad`` (true), ``position_rad``, ``velocity_rad_s``, ``counts``, ``time_s``, ``stuck``,
    ``sticks`` (so far), ``seed``, ``law_voltage_v``, the present answer of the scenario's own law, and what the
    observation is made of: ``measured_error_rad``, ``error_rate_rad_s``, ``target_velocity_rad_s``,
    ``target_acceleration_rad_s2``, ``voltage_v``.

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
        ``"rgb_array"`` draws the last 0.3 s, stairs and path, with matplotlib; ``"ansi"`` is a line of text.

    Raises
    ------
    ParamError
        A scenario that is refused.
    ValueError
        A scenario with an observer; a limit or weight out of range; another mode.

    Examples
    --------
    >>> import gymnasium, clutch.gym
    >>> env = gymnasium.make("clutch/Ramp-v0")
    >>> observation, info = env.reset(seed=1)
    >>> for _ in range(100):
    ...     action = env.unwrapped.scales.action([info["law_voltage_v"]])
    ...     observation, reward, terminated, truncated, info = env.step(action)
    >>> terminated, truncated, round(info["time_s"], 3)
    (False, False, 0.1)
    """

    # A frame is a period of the scenario; shown at this rate a second takes half a minute.
    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "ansi"], "render_fps": 30}  # noqa: RUF012

    def __init__(
        self,
        scenario: ScenarioLike = "smc_2",
        *,
        overrides: Mapping[str, Any] | None = None,
        max_error_deg: float = 5.0,
        error_weight: float = 1e-3,
        variation_weight: float = 1e-2,
        render_mode: str | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ValueError(f'render_mode = {render_mode!r}: expected "rgb_array", "ansi" or None')
        self._problem = _Tracking(scenario, overrides, max_error_deg, error_weight, variation_weight)
        self.scenario, self.scales = self._problem.scenario, self._problem.scales
        self.action_space, self.observation_space = self._problem.action_space, self._problem.observation_space
        self.render_mode = render_mode
        self._tick = self._problem.steps  # no episode has begun
        shown = 0 if render_mode is None else round(_SHOWN_S / (1e-6 * self.scenario.sampling.period_us))
        self._past: collections.deque[_Array] = collections.deque(maxlen=shown)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
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
        self._shafts = _clutch.Shafts(self.scenario, [self._seed])
        self._tick = 0
        self._past.clear()
        self._seen = self._shafts.seen()
        return self._observe()

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """One sampling period under a voltage.

        Parameters
        ----------
        action
            Voltage from −1 to 1, one element; beyond it is cut.

        Returns
        -------
        observation, reward, terminated, truncated, info
            At the period's end.

        Raises
        ------
        ValueError
            An action that is not a number.
        gymnasium.error.ResetNeeded
            No episode has begun, or the last one has ended.

        Examples
        --------
        Let go, the shaft runs away:

        >>> from clutch.gym import TrackingEnv
        >>> env = TrackingEnv("smc_2")
        >>> _ = env.reset(seed=1)
        >>> while not env.step([-1.0])[2]:
        ...     pass
        """
        problem = self._problem
        if not self._tick < problem.steps:
            raise gymnasium.error.ResetNeeded("call reset before the first step, and after an episode's last")
        volts = self.scales.volts(action).reshape(1)
        before, self._seen = self._seen, self._shafts.step(volts)
        self._tick += 1
        (reward,), (terminated,) = problem.judged(before, self._seen, np.array([self._tick]))
        truncated = self._tick >= problem.steps and not bool(terminated)
        if terminated:
            self._tick = problem.steps
        observation, info = self._observe()
        return observation, float(reward), bool(terminated), truncated, info

    def _observe(self) -> tuple[NDArray[np.float32], dict[str, Any]]:
        self._past.append(self._seen[:, 0])
        return self._problem.observation(self._seen)[0], self._info()

    def _info(self) -> dict[str, Any]:
        info: dict[str, Any] = {name: float(values[0]) for name, values in self._problem.info(self._seen).items()}
        whole = {"sticks": int(info["sticks"]), "stuck": bool(info["stuck"]), "seed": self._seed}
        counts = info["counts"]
        return info | whole | {"counts": int(counts) if counts.is_integer() else counts}

    def render(self) -> Any:
        """Draw the last 0.3 s, or give the present sample in a line.

        Returns
        -------
        numpy.ndarray or str or None
            Pixels, shape (height, width, 3), or the line; None without a mode.

        Examples
        --------
        >>> from clutch.gym import TrackingEnv
        >>> env = TrackingEnv("smc_2", render_mode="ansi")
        >>> _ = env.reset(seed=1)
        >>> env.render()
        '0.000 s  error +0.000°  2.24 V  slides    0 sticks'
        """
        if self.render_mode is None:
            return None
        if not self._past:
            raise gymnasium.error.ResetNeeded("call reset before render")
        if self.render_mode == "ansi":
            info = self._info()
            state = "at rest" if info["stuck"] else "slides "
            error, volts, sticks = math.degrees(info["error_rad"]), info["voltage_v"], info["sticks"]
            return f"{info['time_s']:.3f} s  error {error:+.3f}°  {volts:.2f} V  {state} {sticks:>4} sticks"
        return self._picture()

    def _picture(self) -> NDArray[np.uint8]:
        with needed("matplotlib", "rgb_array"):
            from matplotlib.backends.backend_agg import FigureCanvasAgg
            from matplotlib.figure import Figure

        past = np.array(self._past).T
        time, counts, target = (past[_ROW[name]] for name in ("time_s", "counts", "target_counts"))
        figure = Figure(figsize=(6.4, 4.8), dpi=100, layout="constrained")
        canvas: Any = FigureCanvasAgg(figure)
        position, voltage = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
        origin = math.floor(target[0])
        position.step(time, counts - origin, where="post", label="encoder")
        position.plot(time, target - origin, color="0.1", linewidth=0.8, label="path")
        at_rest = {"transform": position.get_xaxis_transform(), "alpha": 0.2, "step": "post", "linewidth": 0}
        position.fill_between(time, 0, 1, where=past[_ROW["stuck"]] > 0, label="at rest", **at_rest)
        position.set(ylabel="position (counts)", title=f"{time[-1]:.3f} s, {past[_ROW['sticks'], -1]:.0f} sticks")
        position.legend(loc="upper left")
        voltage.step(time, past[_ROW["voltage_v"]], where="post")
        end = max(time[0] + _SHOWN_S, time[-1])
        voltage.set(
            xlabel="time (s)",
            ylabel="voltage (V)",
            xlim=(end - _SHOWN_S, end),
            ylim=(self.scales.lowest_v - 0.5, self.scales.highest_v + 0.5),
        )
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()


class TrackingVectorEnv(gymnasium.vector.VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """Many shafts at once, each with an agent's voltage: the environments of :class:`TrackingEnv` in one call.

    A step computes a period of every shaft in the native module, eight shafts in the lanes of a vector, on all
    processors and without Python's lock; each goes its way bit for bit as in a :class:`TrackingEnv`. Rigs and laws
    that have no lanes are computed one by one. A shaft whose episode has ended is reset by the next step, which answers
    with its first sample and the reward 0: ``AutoresetMode.NEXT_STEP``.

    Parameters
    ----------
    num_envs
        Number of shafts.
    scenario, overrides, max_error_deg, error_weight, variation_weight
        As of :class:`TrackingEnv`.

    Raises
    ------
    ParamError, ValueError
        As of :class:`TrackingEnv`; a number below 1.

    Examples
    --------
    >>> import gymnasium, clutch.gym
    >>> envs = gymnasium.make_vec("clutch/Ramp-v0", num_envs=32)
    >>> observations, infos = envs.reset(seed=1)
    >>> for _ in range(100):
    ...     actions = envs.scales.action(infos["law_voltage_v"])[:, None]
    ...     observations, rewards, terminated, truncated, infos = envs.step(actions)
    >>> observations.shape, rewards.shape, bool(terminated.any())
    ((32, 5), (32,), False)
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (Gymnasium's declaration)
        "render_modes": [],
        "autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        scenario: ScenarioLike = "smc_2",
        *,
        overrides: Mapping[str, Any] | None = None,
        max_error_deg: float = 5.0,
        error_weight: float = 1e-3,
        variation_weight: float = 1e-2,
    ) -> None:
        if num_envs < 1:
            raise ValueError(f"num_envs = {num_envs}: expected at least 1")
        self._problem = _Tracking(scenario, overrides, max_error_deg, error_weight, variation_weight)
        self.num_envs = num_envs
        self.scenario, self.scales = self._problem.scenario, self._problem.scales
        self.single_action_space = self._problem.action_space
        self.single_observation_space = self._problem.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._shafts: _clutch.Shafts | None = None

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin a run of each shaft.

        Parameters
        ----------
        seed
            ``run.seed`` of the first shaft, the next ones for the others; or one of each. None: drawn.
        options
            None are known.

        Returns
        -------
        observations, infos
            At the first sample, a row for each shaft; infos are arrays.

        Examples
        --------
        >>> from clutch.gym import TrackingVectorEnv
        >>> TrackingVectorEnv(3).reset(seed=5)[1]["seed"].tolist()
        [5, 6, 7]
        """
        if isinstance(seed, np.integer):
            seed = int(seed)
        super().reset(seed=seed if isinstance(seed, int) else None)
        if seed is None or isinstance(seed, int):
            seeds: list[int | None] = [None if seed is None else seed + i for i in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed: expected {self.num_envs} seeds, got {len(seeds)}")
        if wrong := [s for s in seeds if s is not None and s < 0]:
            raise ValueError(f"seed = {wrong[0]}: expected at least 0")
        self._seeds = np.array([self._drawn() if s is None else s for s in seeds], dtype=np.int64)
        self._shafts = _clutch.Shafts(self.scenario, self._seeds.tolist())
        self._tick = np.zeros(self.num_envs, dtype=np.int64)
        self._ended = np.zeros(self.num_envs, dtype=bool)
        self._seen = self._shafts.seen()
        return self._problem.observation(self._seen), self._infos()

    def _drawn(self) -> int:
        return int(self.np_random.integers(1 << 31))

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One sampling period of each shaft; those whose episodes have ended begin anew.

        Parameters
        ----------
        actions
            Voltages from −1 to 1, shape (num_envs, 1).

        Returns
        -------
        observations, rewards, terminated, truncated, infos
            At the period's end.

        Raises
        ------
        ValueError
            An action that is not a number.
        gymnasium.error.ResetNeeded
            `reset` was not called.

        Examples
        --------
        >>> import numpy as np
        >>> from clutch.gym import TrackingVectorEnv
        >>> envs = TrackingVectorEnv(2)
        >>> _ = envs.reset(seed=1)
        >>> envs.step(np.zeros((2, 1), dtype=np.float32))[2].tolist()
        [False, False]
        """
        if self._shafts is None:
            raise gymnasium.error.ResetNeeded("call reset before the first step")
        problem, begins = self._problem, self._ended
        volts = self.scales.volts(actions).reshape(self.num_envs)
        # Before anything is drawn or reset: a refused step changes nothing.
        if np.isnan(volts).any():
            raise ValueError("actions: expected numbers, got NaN")
        for i in np.flatnonzero(begins):
            self._seeds[i] = self._drawn()
            self._shafts.reset(int(i), int(self._seeds[i]))
        before, self._seen = self._seen, self._shafts.step(volts)
        self._tick = np.where(begins, 0, self._tick + 1)
        rewards, terminated = problem.judged(before, self._seen, self._tick)
        rewards, terminated = np.where(begins, 0.0, rewards), terminated & ~begins
        truncated = (self._tick >= problem.steps) & ~terminated
        self._ended = terminated | truncated
        return problem.observation(self._seen), rewards, terminated, truncated, self._infos()

    def _infos(self) -> dict[str, Any]:
        infos = self._problem.info(self._seen.copy())
        whole = {"stuck": infos["stuck"] > 0, "sticks": infos["sticks"].astype(np.int64), "seed": self._seeds.copy()}
        return infos | whole


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
            gymnasium.register(
                name,
                entry_point="clutch.gym:TrackingEnv",
                vector_entry_point="clutch.gym:TrackingVectorEnv",
                kwargs={"scenario": scenario},
            )


register()
