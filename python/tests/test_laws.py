"""Laws written in Python (functions, objects, classes) in sweeps and logs; plants that are copied and pickled."""

import copy
import math
import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import pytest

import clutch

SHORT = {"run.duration_s": 0.5, "run.settle_s": 0.0}
#: A rig with all that a state may have: torque noise, delay, lag, ripple.
NOISY = clutch.Scenario.load("bench_pd_2").override(
    SHORT | {"rig.torque_noise_nm": 0.001, "rig.delay_ticks": 3, "rig.actuator_time_constant_s": 0.002}
)


@dataclass
class OwnPd:
    """The law (4), written again."""

    kp: float = 5000.0
    kd: float = 50.0
    ticks: int = 0
    began: tuple[float, ...] = ()

    def start(self, tick):
        self.began = (tick.time, tick.applied, tick.counts)

    def step(self, tick):
        self.ticks += 1
        return -(self.kp * tick.error) - self.kd * tick.error_rate


def own_pd(tick):
    return -(5000.0 * tick.error) - 50.0 * tick.error_rate


def test_a_law_as_function_object_and_class_runs_as_the_built_in_one():
    built_in = clutch.simulate("pd_2", overrides=SHORT)
    law = OwnPd()
    for own in (own_pd, law, OwnPd):
        run = clutch.simulate("pd_2", law=own, overrides=SHORT)
        assert run.samples["voltage_v"].tolist() == built_in.samples["voltage_v"].tolist()
    assert law.ticks == len(built_in)
    assert law.began[:2] == (0.0, built_in.scenario and clutch.Plant(built_in.scenario).start_voltage)


def test_a_tick_has_position_counts_and_the_voltage_before():
    seen = []

    def law(tick):
        seen.append(tick)
        return 2.0 + 0.3 * math.sin(50.0 * tick.time)

    run = clutch.simulate("pd_2", law=law, overrides=SHORT)
    counts = [tick.counts for tick in seen]
    assert counts == run.samples["counts"].tolist()
    assert [tick.position for tick in seen] == pytest.approx([c * 2 * math.pi / 20_000 for c in counts], abs=1e-15)
    applied = [tick.applied for tick in seen]
    assert applied[1:] == run.samples["voltage_v"].tolist()[:-1]
    assert [tick.time for tick in seen] == run.samples["time_s"].tolist()


@pytest.mark.parametrize("law", [3.0, "pd", object()])
def test_what_is_no_law_is_named(law):
    with pytest.raises(TypeError, match=r"law is of type .* expected a function"):
        clutch.simulate("pd_2", law=law)


def test_what_a_law_raises_comes_out_wherever_it_ran():
    class Breaks:
        def step(self, tick):
            raise ZeroDivisionError(f"at {tick.time}")

    with pytest.raises(ZeroDivisionError, match="at 0"):
        clutch.simulate("pd_2", law=Breaks())
    with pytest.raises(ZeroDivisionError, match="at 0"):
        clutch.sweep("pd_2", {"run.seed": [1, 2]}, law=Breaks())


def test_a_sweep_with_an_own_law_gives_each_run_a_fresh_copy():
    parameters = {"rig.base": ["paper", "bench"], "run.seed": [1, 2]}
    law = OwnPd()
    here = clutch.sweep("pd_2", parameters, law=law, traces=["error_rad"], every=10)
    assert law.ticks == 0
    for i, (base, seed) in enumerate(here.samples.rows):
        run = clutch.simulate("pd_2", law=OwnPd, overrides={"rig.base": base, "run.seed": seed})
        assert here.table["rms_error_rad"][i] == run.metrics.rms_error_rad
        assert here.traces[i]["error_rad"].tolist() == run.samples["error_rad"][::10].tolist()
    assert not here.table["certified_continuous_time"].any()
    with ProcessPoolExecutor(2) as pool:
        there = clutch.sweep("pd_2", parameters, law=law, executor=pool, chunk=1)
    assert there.table["rms_error_rad"].tolist() == here.table["rms_error_rad"].tolist()


def test_answers_that_are_no_numbers_are_told():
    def lost(tick):
        return math.nan if tick.error > 0 else 2.24

    with pytest.warns(UserWarning, match=r"lost answered no finite number in \d+ of 5000 periods: the output was"):
        clutch.simulate("pd_2", law=lost)


def test_a_refused_row_of_such_a_sweep_is_kept_or_raised():
    rows = {"run.duration_s": [2.0, -1.0]}
    with pytest.raises(clutch.ParamError, match="row 1: "):
        clutch.sweep("pd_2", rows, law=own_pd)
    kept = clutch.sweep("pd_2", rows, law=own_pd, errors="keep")
    assert np.isfinite(kept.table["rms_error_rad"][0]) and np.isnan(kept.table["rms_error_rad"][1])
    assert "run.duration_s" in kept.table["error"][1]


def test_a_log_names_the_foreign_law_and_its_replay_takes_it(tmp_path):
    path = tmp_path / "own.mcap"
    clutch.simulate("pd_2", law=OwnPd, overrides=SHORT | {"sampling.scalar": "f32"}).save(path)
    log = clutch.read_log(path)
    assert log.metadata["foreign_law"].endswith("OwnPd") and "as_sampled" not in log.metadata
    # Verdicts are those of a law of clutch.
    clutch.simulate("pd_2", overrides=SHORT).save(tmp_path / "plain.mcap")
    told = clutch.read_log(tmp_path / "plain.mcap").metadata
    assert told["certified_continuous_time"] == "true" and "uncertified" in told["as_sampled"]
    assert "spectral radius" in told["linear_stability"] and told["sticks"].startswith("not excluded")
    with pytest.raises(ValueError, match="OwnPd"):
        clutch.replay(log)
    assert clutch.replay(log, law=OwnPd).identical
    other = clutch.replay(log, law=OwnPd(kd=49.0))
    assert not other.identical and other.first.field == "python_v"


def test_a_log_of_a_built_in_law_is_replayed_with_another(tmp_path):
    path = tmp_path / "pd.mcap"
    clutch.simulate("pd_2", overrides=SHORT).save(path)
    replayed = clutch.replay(path, law=own_pd)
    # Another law has other terms; its commands are the same.
    assert replayed.ticks == 500
    assert replayed.commands["voltage_v"].tolist() == clutch.read_log(path).channels["command"]["voltage_v"].tolist()


def drive(plant, n=150):
    return [plant.step(2.0 + 0.5 * math.sin(0.1 * i)) for i in range(n)], plant.position, plant.velocity


@pytest.mark.parametrize("scenario", [NOISY, clutch.Scenario.load("smc_2"), clutch.Scenario.load("motor_pid")])
@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, clutch.Plant.copy, lambda plant: pickle.loads(pickle.dumps(plant))]
)
def test_a_plant_goes_on_from_its_copy_bit_for_bit(scenario, again):
    plant = clutch.Plant(scenario)
    drive(plant, 77)
    other = again(plant)
    assert (other.time, other.voltage, other.sticks) == (plant.time, plant.voltage, plant.sticks)
    assert other.events().to_dict().keys() == plant.events().to_dict().keys()
    assert drive(other) == drive(plant)
    assert other.events()["time_s"].tolist() == plant.events()["time_s"].tolist()


def test_a_plant_is_put_somewhere_else():
    plant = clutch.Plant(clutch.Scenario.load("smc_2"))
    plant.place(1.0, -0.5)
    assert (plant.position, plant.velocity, plant.stuck) == (1.0, -0.5, False)
    plant.place(0.25)
    assert (plant.velocity, plant.stuck) == (0.0, True)
    assert plant.counts == math.floor(0.25 * 20_000 / (2 * math.pi))
    for bad in [{"position_rad": math.nan}, {"position_rad": 1e9}, {"position_rad": 0.0, "velocity_rad_s": math.inf}]:
        with pytest.raises(ValueError, match=rf"^{next(reversed(bad))} = .*: expected a finite"):
            plant.place(**bad)
    with pytest.raises(ValueError, match=r"voltage_v = 1\.1e1: expected a voltage of the converter, -10 to 10 V"):
        plant.place(0.0, voltage_v=11)


def test_a_plant_that_is_put_somewhere_with_a_voltage_has_forgotten_what_was_before():
    lags = {"rig.delay_ticks": 2, "rig.actuator_time_constant_s": 0.003}
    for rig in [{"rig.friction": {"lugre": {}}}, {"rig.friction": {"maxwell": {}}}, lags]:
        ends = set()
        for before in [0.5, 2.5, 8.0]:
            plant = clutch.Plant(clutch.Scenario.load("pd_2").override(rig))
            for _ in range(100):
                plant.step(before)
            plant.place(0.0, voltage_v=3.0)
            assert plant.voltage == 3.0
            for _ in range(100):
                plant.step(2.0)
            ends.add((plant.position, plant.velocity))
        assert len(ends) == 1, rig


def test_bristles_of_a_plant_that_is_put_somewhere_hold_what_pulls_there():
    # A spring pulls the more the farther behind the shaft is, and the disc's friction changes along it.
    spring = {"rig.drive": {"spring": {"stiffness_nm_rad": 0.05, "rest_deg": 57.3}}, "rig.friction": {"lugre": {}}}
    plant = clutch.Plant(clutch.Scenario.load("pd_2").override(spring))
    rippled = clutch.Plant(clutch.Scenario.load("bench_pd_2").override({"rig.friction": {"lugre": {}}}))
    for p, angles in [(plant, [0.0, 0.4, -0.5]), (rippled, [0.1, 0.9, 2.3])]:
        for angle in angles:
            p.place(angle, voltage_v=9.0)
            p.step(9.0)
            assert abs(p.position - angle) < 1e-8, angle
            assert abs(p.velocity) < 1e-5, angle


def test_a_spoilt_pickle_is_refused():
    rebuild, (scenario, words) = clutch.Plant(NOISY).__reduce__()
    for bad in [words[:-1], [], [*words[:-1], 2**63 - 1], [*words[:6], words[6] + 1, *words[7:]]]:
        with pytest.raises(ValueError, match="no pickled plant"):
            rebuild(scenario, bad)
