"""The environment: Gymnasium's own checks, and the simulator's trajectory bit for bit."""

import math
import warnings

import numpy as np
import pytest

import clutch

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402

import clutch.gym  # noqa: E402
from clutch.gym import TrackingEnv, TrackingVectorEnv  # noqa: E402

IDS = ["clutch/Ramp-v0", "clutch/RampBench-v0", "clutch/MinimumJerk-v0"]


def run(env, seed, agent):
    """An episode under an agent that answers a voltage: observations, rewards, infos, and how it ended."""
    observation, info = env.reset(seed=seed)
    observations, rewards, infos = [observation], [], [info]
    ended = (False, False)
    while not any(ended):
        observation, reward, *ended, info = env.step(env.scales.action([agent(observation, info)]))
        observations.append(observation)
        rewards.append(reward)
        infos.append(info)
    return np.array(observations), np.array(rewards), infos, tuple(ended)


@pytest.mark.parametrize("name", IDS)
def test_gymnasiums_checks_pass(name):
    with warnings.catch_warnings():
        # Its advice, too: scaled actions, finite bounds.
        warnings.simplefilter("error")
        check_env(gymnasium.make(name, render_mode="rgb_array").unwrapped)


def test_observations_are_about_one_and_scales_take_them_into_units_and_back():
    env = TrackingEnv("bench_smc_2", overrides={"run.duration_s": 1.1})
    observations, _, infos, _ = run(env, 1, lambda _, info: info["law_voltage_v"])
    assert np.abs(observations[:, [0, 2, 3, 4]]).max() <= 1.0 and 0.5 < np.abs(observations[:, 1]).max() < 10.0
    physical = env.scales.physical(observations)
    for i, key in enumerate(clutch.gym._SEEN):
        np.testing.assert_allclose(physical[:, i], [info[key] for info in infos], rtol=1e-6, atol=1e-6, err_msg=key)
    scales = env.scales
    assert scales.velocity_rad_s == pytest.approx(math.radians(2.0))
    assert (scales.error_rad, scales.highest_v) == (math.radians(0.5), 10.0)
    # A law's voltage survives an action of single precision: the converter gives the same code.
    volts = np.arange(4096) * 20 / 4096 - 10
    back = scales.volts(scales.action(volts[volts >= 0]))
    assert np.abs(back - volts[volts >= 0]).max() < 1e-6
    # A motor pulls, too.
    assert TrackingEnv("motor_pid").scales.lowest_v < 0.0
    np.testing.assert_array_equal(scales.observation(np.array([9.0, 0, 0, 0, 5.0])), [100, 0, 0, 0, 0])


@pytest.mark.parametrize("scenario", ["smc_2", "bench_smc_2", "pd_2", "f32_smc_2"])
def test_an_agent_that_plays_the_law_moves_the_shaft_as_simulate_does(scenario):
    env = TrackingEnv(scenario, overrides={"run.duration_s": 1.5, "run.settle_s": 0.0})
    _, _, infos, ended = run(env, 5, lambda _, info: info["law_voltage_v"])
    result = clutch.simulate(env.scenario.override({"run.seed": 5}))
    samples = result.samples
    assert ended == (False, True) and len(infos) == len(samples)
    for key in ("position_rad", "velocity_rad_s", "counts", "time_s", "stuck", "error_rad"):
        np.testing.assert_array_equal([info[key] for info in infos], samples[key], err_msg=key)
    for key in ("measured_error_rad", "error_rate_rad_s", "target_velocity_rad_s", "target_acceleration_rad_s2"):
        np.testing.assert_array_equal([info[key] for info in infos], samples[key], err_msg=key)
    np.testing.assert_array_equal([info["voltage_v"] for info in infos[1:]], samples["voltage_v"][:-1])
    sticks = [t for t, kind in zip(result.events["time_s"], result.events["kind"], strict=True) if kind == "stick"]
    assert infos[-1]["sticks"] == sum(t <= infos[-1]["time_s"] for t in sticks)


def test_a_sensor_without_steps_gives_the_same_motion_up_to_the_rounding_of_actions():
    env = TrackingEnv("smc_2", overrides={"rig.base": "ideal", "run.duration_s": 0.5, "run.settle_s": 0.0})
    _, _, infos, _ = run(env, 2, lambda _, info: info["law_voltage_v"])
    samples = clutch.simulate(env.scenario.override({"run.seed": 2})).samples
    # An action is a float32, and nothing rounds it here to a step of the converter.
    np.testing.assert_allclose([i["position_rad"] for i in infos], samples["position_rad"], atol=1e-7)


def test_a_seed_is_the_scenarios_and_repeats_the_episode():
    env = TrackingEnv("bench_smc_2", overrides={"run.duration_s": 1.1})
    noise = np.random.default_rng(1).uniform(1.8, 2.6, 1100)

    def episode(seed):
        actions = iter(noise)
        return run(env, seed, lambda *_: next(actions))

    first, again, other = episode(3), episode(3), episode(4)
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    assert first[2] == again[2] and first[2][0]["seed"] == 3
    assert other[2][0]["position_rad"] != first[2][0]["position_rad"]


def test_without_a_seed_each_episode_is_another_one_and_the_series_repeats():
    env = TrackingEnv("smc_2")

    def seeds():
        return [env.reset(seed=1)[1]["seed"], *(env.reset()[1]["seed"] for _ in range(3))]

    first = seeds()
    assert first == seeds() and len(set(first)) == 4


def test_the_reward_is_what_its_formula_says():
    env = TrackingEnv("smc_2", error_weight=0.5, variation_weight=2.0, overrides={"run.duration_s": 1.01})
    _, rewards, infos, _ = run(env, 1, lambda _, info: info["law_voltage_v"])
    counts = np.array([i["error_rad"] for i in infos[1:]]) * 20_000 / math.tau
    variation = np.abs(np.diff([info["voltage_v"] for info in infos]))
    np.testing.assert_allclose(rewards, -0.5 * counts**2 - 2.0 * variation, rtol=1e-12)


def test_a_shaft_let_go_ends_the_episode_and_giving_up_never_pays():
    env = TrackingEnv("smc_2", max_error_deg=1.0, variation_weight=0.0)
    _, rewards, infos, ended = run(env, 1, lambda *_: 0.0)
    assert ended == (True, False)
    errors = np.abs([i["error_rad"] for i in infos])
    assert errors[-1] > math.radians(1.0) >= errors[-2]
    # As if the error had stayed at its limit to the end.
    at_limit = 1e-3 * (20_000 / 360.0) ** 2
    assert rewards.sum() < -at_limit * (5000 - len(infos))
    # A shaft that runs away for 1°: T_u/J (1 − C_d/J t/3 …) t²/2 beyond the ramp.
    assert infos[-1]["time_s"] == pytest.approx(math.sqrt(2 * math.radians(1.0) / 27.69882), abs=2e-3)


def test_voltages_beyond_the_limits_are_cut_and_those_that_are_no_numbers_refused():
    env = TrackingEnv("smc_2", overrides={"output.highest_v": 5.0, "output.on_invalid_v": 5.0})
    env.reset(seed=1)
    assert env.scales.highest_v == 5.0
    assert env.step([10.0])[4]["voltage_v"] == 5.0 and env.step([-3.0])[4]["voltage_v"] == 0.0
    assert env.step([0.0])[4]["voltage_v"] == pytest.approx(2.5, abs=0.0025)
    with pytest.raises(ValueError):
        env.step([math.nan])


def test_observations_are_new_arrays_of_the_space():
    env = TrackingEnv("minimum_jerk")
    first, _ = env.reset(seed=1)
    kept = first.copy()
    second = env.step([0.2])[0]
    assert first is not second and np.array_equal(first, kept)
    assert first in env.observation_space and second in env.observation_space


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match=r"velocity\.observer"):
        TrackingEnv("observer_smc_2")
    with pytest.raises(ValueError, match="max_error_deg"):
        TrackingEnv("smc_2", max_error_deg=0.0)
    with pytest.raises(ValueError, match=r"error_weight = -1\.0: expected at least 0"):
        TrackingEnv("smc_2", error_weight=-1.0)
    with pytest.raises(ValueError, match="render_mode = 'human'"):
        TrackingEnv("smc_2", render_mode="human")
    with pytest.raises(ValueError, match="num_envs = 0"):
        TrackingVectorEnv(0)
    with pytest.raises(ValueError, match="expected 2 seeds, got 1"):
        TrackingVectorEnv(2).reset(seed=[1])
    with pytest.raises(ValueError, match="seed = -3: expected at least 0"):
        TrackingVectorEnv(2).reset(seed=[1, -3])
    with pytest.raises(clutch.ParamError):
        TrackingEnv("smc_2", overrides={"law.smc.kp_v": -1})


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_vectors_of_environments_run(mode):
    envs = gymnasium.make_vec("clutch.gym:clutch/Ramp-v0", num_envs=2, vectorization_mode=mode)
    try:
        observations, infos = envs.reset(seed=3)
        assert observations.shape == (2, 5) and infos["seed"].tolist() == [3, 4]
        for _ in range(50):
            actions = TrackingEnv("smc_2").scales.action(infos["law_voltage_v"])[:, None]
            observations, _, terminated, _, infos = envs.step(actions)
        assert not terminated.any()
        alone = TrackingEnv("smc_2")
        _, info = alone.reset(seed=4)
        for _ in range(50):
            observation, *_, info = alone.step(alone.scales.action([info["law_voltage_v"]]))
        np.testing.assert_array_equal(observations[1], observation)
    finally:
        envs.close()


def test_registering_twice_changes_nothing():
    before = {name: gymnasium.spec(name) for name in IDS}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clutch.gym.register()
    assert before == {name: gymnasium.spec(name) for name in IDS}


def test_a_step_outside_of_an_episode_asks_for_a_reset():
    env = TrackingEnv("smc_2")
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step([0.2])
    env.reset(seed=1)
    while not env.step([-1.0])[2]:
        pass
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step([0.2])
    with pytest.raises(gymnasium.error.ResetNeeded):
        TrackingVectorEnv(2).step(np.zeros((2, 1), np.float32))


def test_many_shafts_in_one_call_go_each_as_one_alone_and_begin_anew():
    """More than fit on one thread; some agents let go, and their episodes end early."""
    n, short = 40, {"run.duration_s": 1.2, "run.settle_s": 0.0}
    envs = gymnasium.make_vec("clutch.gym:clutch/RampBench-v0", num_envs=n, overrides=short)
    assert isinstance(envs, TrackingVectorEnv)
    observations, infos = envs.reset(seed=7)
    assert observations in envs.observation_space and observations.shape == (n, 5)
    lets_go = np.arange(n) % 3 == 0
    seen, paid, seeds = [observations], [], [infos["seed"]]
    for _ in range(1300):
        volts = np.where(lets_go & (infos["time_s"] > 0.2), 0.0, infos["law_voltage_v"])
        before = infos
        observations, rewards, terminated, truncated, infos = envs.step(envs.scales.action(volts)[:, None])
        seen.append(observations)
        paid.append(rewards)
        seeds.append(infos["seed"])
        assert not (terminated & truncated).any()
        again = infos["time_s"] < before["time_s"]
        assert (rewards[again] == 0.0).all() and (infos["sticks"][again] == 0).all()
    seen, paid, seeds = np.array(seen), np.array(paid), np.array(seeds)
    alone = TrackingEnv("bench_smc_2", overrides=short)
    for i in (0, 1, n - 1):
        tick = 0
        for _ in range(2):  # two episodes, one after the other
            observation, info = alone.reset(seed=int(seeds[tick, i]))
            np.testing.assert_array_equal(seen[tick, i], observation)
            ended = False
            while not ended and tick < 1300:
                volts = 0.0 if lets_go[i] and info["time_s"] > 0.2 else info["law_voltage_v"]
                observation, reward, *ends, info = alone.step(alone.scales.action([volts]))
                np.testing.assert_array_equal(seen[tick + 1, i], observation)
                assert paid[tick, i] == reward
                tick, ended = tick + 1, any(ends)
            tick += 1
    assert len(np.unique(seeds[-1])) == n


@pytest.mark.parametrize(
    ("scenario", "overrides"),
    [
        ("smc_2", {}),
        ("motor_pid", {"rig.delay_ticks": 2}),
        ("bench_pd_2", {"rig.actuator_time_constant_s": 0.002}),
        # A law without lanes, and a rig without.
        ("f32_smc_2", {}),
        ("smc_2", {"rig.torque_noise_nm": 0.001}),
    ],
)
def test_a_shaft_among_nine_has_the_observations_of_one_alone(scenario, overrides):
    envs = TrackingVectorEnv(9, scenario, overrides=overrides)
    observations, infos = envs.reset(seed=[5, 1, 5, 8, 2, 13, 3, 21, 34])
    others = [TrackingEnv(scenario, overrides=overrides) for _ in range(9)]
    begun = [env.reset(seed=int(seed)) for env, seed in zip(others, infos["seed"], strict=True)]
    np.testing.assert_array_equal(observations, [observation for observation, _ in begun])
    rng = np.random.default_rng(3)
    for _ in range(200):
        actions = envs.scales.action(infos["law_voltage_v"])[:, None] + rng.normal(0.0, 0.02, (9, 1))
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        alone = [env.step(action) for env, action in zip(others, actions, strict=True)]
        np.testing.assert_array_equal(observations, [step[0] for step in alone])
        np.testing.assert_array_equal(rewards, [step[1] for step in alone])
        assert not (terminated | truncated).any()
        for key, values in infos.items():
            np.testing.assert_array_equal(values, [step[4][key] for step in alone], err_msg=key)


def test_an_environment_is_drawn_and_told():
    env = TrackingEnv("bench_smc_2", overrides={"run.duration_s": 1.1}, render_mode="rgb_array")
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.render()
    run(env, 1, lambda _, info: info["law_voltage_v"])
    frame = env.render()
    assert frame.shape == (480, 640, 3) and frame.dtype == np.uint8 and len(np.unique(frame)) > 20
    told = TrackingEnv("smc_2", render_mode="ansi")
    told.reset(seed=1)
    told.step([-1.0])
    assert told.render() == "0.001 s  error -0.001°  0.00 V  slides     0 sticks"
    assert TrackingEnv("smc_2").render() is None


def test_the_smooth_law_is_a_yardstick_that_others_do_not_reach():
    def returns(scenario):
        envs = TrackingVectorEnv(6, scenario, overrides={"run.duration_s": 2.0})
        _, infos = envs.reset(seed=1)
        total, ended = np.zeros(6), False
        while not ended:
            _, rewards, _, truncated, infos = envs.step(envs.scales.action(infos["law_voltage_v"])[:, None])
            total, ended = total + rewards, truncated.all()
        return total

    glide, pd, smc = map(returns, ("bench_glide_2", "bench_pd_2", "bench_smc_2"))
    assert glide.min() > 5 * pd.max() and pd.min() > smc.max()
