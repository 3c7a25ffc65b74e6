"""The shaft as a function: against (1) written out, against the simulator, and in python-control."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import clutch
import clutch.dynamics
import oracle


def oracles_rate(plant, velocity, volts):
    """Acceleration by the oracle's formulas, rad/s²."""
    torque = plant.drive.torque(0.0, 0.0)
    if velocity == 0.0:
        held = plant.holds(volts)
        friction = torque if abs(torque) <= held else math.copysign(held, torque)
    else:
        sign = math.copysign(1.0, velocity)
        friction = sign * plant.mu(abs(velocity)) * plant.gain * max(volts, 0.0)
    return (torque - friction - plant.damping * velocity) / plant.inertia


@pytest.mark.parametrize("mu_s", [0.2, 0.3])
def test_the_derivative_is_the_oracles_equation(mu_s):
    f = clutch.dynamics.derivative(clutch.Scenario.load("smc_2", {"rig.friction.stribeck.mu_static": mu_s}))
    plant = oracle.Plant(mu_s=mu_s)
    for velocity in (-1.0, -1e-3, -1e-9, 0.0, 1e-9, 1e-4, 1e-3, 0.035, 0.35, 6.0):
        for volts in (-1.0, 0.0, 0.5, 1.1, 1.68, 1.69, 2.24, 9.0):
            rate = f(0.3, [0.7, velocity], [volts], None)
            assert rate[0] == velocity
            assert rate[1] == pytest.approx(oracles_rate(plant, velocity, volts), rel=1e-12, abs=1e-12)


def test_a_resting_shaft_stays_up_to_the_static_limit_and_not_beyond():
    f = clutch.dynamics.derivative("smc_2")
    limit = 0.2 * 9.81 * 0.024 / (0.2 * 0.14)
    assert f(0.0, [0.0, 0.0], [limit * (1 + 1e-12)], None)[1] == 0.0
    assert 0.0 < f(0.0, [0.0, 0.0], [limit * (1 - 1e-9)], None)[1] < 1e-6


def test_ripple_and_a_spring_depend_on_position_and_a_table_on_time():
    bench = clutch.dynamics.derivative("bench_smc_2")
    along = {round(bench(0.0, [x, 0.1], [2.0], None)[1], 9) for x in np.linspace(0.0, 0.05, 20)}
    assert len(along) == 20
    drive = {"spring": {"stiffness_nm_rad": 0.02, "rest_deg": 180.0}}
    spring = clutch.dynamics.derivative(clutch.Scenario.load("smc_2", {"rig.drive": drive}))
    assert spring(0.0, [0.5, 0.0], [0.0], None)[1] == pytest.approx(0.02 * (math.pi - 0.5) / 0.0017)
    drive = {"table": {"points_s_nm": [[0.0, 0.045], [2.0, 0.055]]}}
    table = clutch.dynamics.derivative(clutch.Scenario.load("smc_2", {"rig.drive": drive}))
    assert table(1.0, [0.0, 0.0], [0.0], None)[1] == pytest.approx(0.05 / 0.0017)


def test_a_run_out_adds_its_wave_to_a_ripple():
    bench = clutch.Scenario.load("bench_smc_2")
    runout = clutch.Runout(amplitude=0.2, waves_per_turn=3, phase_deg=30.0)

    def on(**disc):
        return clutch.dynamics.derivative(dataclasses.replace(bench, rig=dataclasses.replace(bench.rig, **disc)))

    rippled, both = on(), on(runout=runout)
    even, tilted = on(ripple=None), on(ripple=None, runout=runout)
    drive, wave = even(0.0, [0.0, 0.1], [0.0], None)[1], 0.2 * np.sin(3 * 0.7 + math.pi / 6)
    friction = even(0.0, [0.7, 0.1], [2.0], None)[1] - drive
    assert tilted(0.0, [0.7, 0.1], [2.0], None)[1] == pytest.approx(drive + friction * (1 + wave), rel=1e-12)
    assert both(0.0, [0.7, 0.1], [2.0], None)[1] - rippled(0.0, [0.7, 0.1], [2.0], None)[1] == pytest.approx(
        friction * wave, rel=1e-10
    )


def test_a_run_with_a_run_out_presses_where_the_disc_is_smooth():
    # At 20 °/s four turns of the wave take 4.5 s; the mean voltage over a slice of the disc goes as 1/(1 + wave).
    runout = {"amplitude": 0.2, "waves_per_turn": 16}
    changes = {"rig.runout": runout, "reference.ramp.rate_deg_s": 20.0, "run.duration_s": 5.5}
    result = clutch.simulate("smc_2", overrides=changes)
    time, position, volts = (result.samples[n] for n in ("time_s", "position_rad", "voltage_v"))
    late = time > 1.0
    assert np.ptp(position[late]) > 2 * 2 * math.pi / 16
    phase = np.mod(16 * position[late], 2 * math.pi)
    slices = np.digitize(phase, np.linspace(0, 2 * math.pi, 9)) - 1
    mean = np.array([volts[late][slices == i].mean() for i in range(8)])
    middle = (np.arange(8) + 0.5) * math.pi / 4
    expected = 0.047088 / (0.15 * 0.14) / (1 + 0.2 * np.sin(middle))
    assert mean == pytest.approx(expected, rel=0.06)


def test_the_derivative_vanishes_where_drive_friction_and_drag_balance():
    f = clutch.dynamics.derivative("smc_2")
    torque = 0.2 * 9.81 * 0.024
    for velocity in (0.035, 0.35, 3.5):
        mu = 0.15 + 0.05 * math.exp(-velocity / 0.001)
        volts = (torque - 0.001 * velocity) / (mu * 0.14)
        assert f(0.0, [0.0, velocity], [volts], None)[1] == pytest.approx(0.0, abs=1e-12)


def test_a_long_slide_ends_at_the_velocity_where_the_derivative_vanishes():
    # Braked with 2 V the shaft tends to (T_u − μ_d K_COF u)/C_d, with the time constant J/C_d = 1.7 s.
    scenario = clutch.Scenario.load("smc_2", {"run.duration_s": 40.0, "rig.dac.quantised": False})
    plant, f = clutch.Plant(scenario), clutch.dynamics.derivative(scenario)
    for _ in range(40_000):
        plant.step(2.0)
    steady = brentq(lambda v: f(0.0, [0.0, v], [2.0], None)[1], 0.1, 20.0)
    assert steady == pytest.approx((0.047088 - 0.15 * 0.14 * 2.0) / 0.001, rel=1e-9)
    assert plant.velocity == pytest.approx(steady, rel=1e-8)


def test_the_law_closed_around_the_derivative_slides_as_in_the_simulator():
    # On the ideal rig nothing is rounded: SciPy between the samples, the voltages of the run.
    overrides = {"rig.base": "ideal", "run.duration_s": 0.3, "run.settle_s": 0.0}
    scenario = clutch.Scenario.load("smc_2", overrides | {"run.engine": "dormand_prince"})
    samples, f = clutch.simulate(scenario).samples, clutch.dynamics.derivative(scenario)
    assert not samples["stuck"].any()
    x = [samples["position_rad"][0], samples["velocity_rad_s"][0]]
    for k, volts in enumerate(samples["voltage_v"][:-1]):
        piece = solve_ivp(f, (0.0, 1e-3), x, args=([volts], None), method="DOP853", rtol=1e-11, atol=1e-14)
        x = piece.y[:, -1]
        assert x[0] == pytest.approx(samples["position_rad"][k + 1], abs=1e-10)
        assert x[1] == pytest.approx(samples["velocity_rad_s"][k + 1], abs=1e-9)


# --- python-control ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def control():
    return pytest.importorskip("control")


def test_python_control_slides_as_the_plant_does(control):
    scenario = clutch.Scenario.load("smc_2", {"rig.dac.quantised": False})
    plant, shaft = clutch.Plant(scenario), clutch.dynamics.to_control(scenario)
    start, n = [plant.position, plant.velocity], 500
    stepped = [start]
    for _ in range(n):
        plant.step(1.9)
        stepped.append([plant.position, plant.velocity])
    assert len(plant.events()) == 0
    time = np.linspace(0.0, n * 1e-3, n + 1)
    options = {"max_step": 1e-3, "rtol": 1e-9, "atol": 1e-12}
    response = control.input_output_response(shaft, time, np.full(n + 1, 1.9), start, solve_ivp_kwargs=options)
    np.testing.assert_allclose(response.outputs.T, stepped, atol=1e-6, rtol=0)
    np.testing.assert_array_equal(response.states, response.outputs)


def test_the_linearised_shaft_is_the_derivative_of_1(control):
    shaft = clutch.dynamics.to_control("smc_2", name="brake")
    assert shaft.name == "brake"
    assert shaft.state_labels == shaft.output_labels == ["position", "velocity"]
    velocity, volts = 0.02, 2.24
    linear = control.linearize(shaft, [0.0, velocity], [volts])
    slope = -0.05 / 0.001 * math.exp(-velocity / 0.001)
    mu = 0.15 + 0.05 * math.exp(-velocity / 0.001)
    damping = (0.001 + slope * 0.14 * volts) / 0.0017
    np.testing.assert_allclose(linear.A, [[0, 1], [0, -damping]], rtol=1e-4, atol=1e-8)
    np.testing.assert_allclose(linear.B, [[0], [-mu * 0.14 / 0.0017]], rtol=1e-4)


def test_python_control_finds_the_voltage_that_keeps_a_velocity(control):
    shaft = clutch.dynamics.to_control("smc_2")
    target = [0.0, 0.0349]
    point = control.find_operating_point(shaft, target, [2.0], target, ix=[0], iy=[1], idx=[1], dx0=[0.0, 0.0])
    volts = float(np.ravel(point.inputs)[0])
    assert volts == pytest.approx((0.047088 - 0.001 * 0.0349) / (0.15 * 0.14), rel=1e-9)


# --- Discrete blocks over the exact engine -------------------------------------------------------


def closed(control, scenario):
    """Rig and law closed, with the path as input."""
    rig, law = clutch.dynamics.sampled_rig(scenario), clutch.dynamics.sampled_law(scenario)
    inputs = ["target_counts", "target_velocity", "target_acceleration"]
    outputs = ["position", "velocity", "counts", "stuck", "voltage"]
    return control.interconnect([rig, law], inputs=inputs, outputs=outputs, name="loop")


@pytest.mark.parametrize(
    "name", ["smc_2", "pd_2", "f32_smc_2", "bench_smc_2", "bench_glide_2", "motor_pid", "minimum_jerk"]
)
def test_blocks_of_rig_and_law_closed_in_python_control_are_the_simulators_run_bit_for_bit(control, name):
    scenario = clutch.Scenario.load(name, {"run.duration_s": 1.2, "run.settle_s": 0.0})
    loop = closed(control, scenario)
    assert loop.dt == pytest.approx(scenario.sampling.period_us * 1e-6)
    time, targets = clutch.dynamics.targets(scenario)
    response = control.input_output_response(loop, time, targets)
    samples = clutch.simulate(scenario).samples
    for row, column in enumerate(["position_rad", "velocity_rad_s", "counts", "stuck", "voltage_v"]):
        np.testing.assert_array_equal(response.outputs[row], samples[column], err_msg=column)


def test_a_block_that_is_asked_twice_answers_the_same_and_goes_on_where_it_was(control):
    rig = clutch.dynamics.sampled_rig("bench_smc_2")
    time, volts = rig.dt * np.arange(200), np.linspace(2.0, 3.0, 200)
    first, again = (control.input_output_response(rig, time, volts) for _ in range(2))
    np.testing.assert_array_equal(first.outputs, again.outputs)
    # The second half from the state that the first half ended in.
    rest = control.input_output_response(rig, time[:100], volts[100:], first.states[:, 100])
    np.testing.assert_array_equal(rest.outputs, first.outputs[:, 100:])
    # In two ways from the same state: the block itself does not change.
    x = first.states[:, 100]
    fast = slow = x
    for _ in range(3):  # the rig has a delay
        fast, slow = rig.dynamics(0.0, fast, [0.0]), rig.dynamics(0.0, slow, [9.0])
    assert rig.output(0.0, fast, [0.0])[2] > rig.output(0.0, slow, [0.0])[2]
    np.testing.assert_array_equal(rig.output(0.0, x, [0.0]), first.outputs[:, 100])


def test_a_state_that_is_none_is_refused(control):
    rig = clutch.dynamics.sampled_rig("smc_2")
    for x in (0.5, 7.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="rig: state"):
            rig.output(0.0, [x], [2.0])
    # Samples that lie long back are forgotten, but for the beginning.
    response = control.input_output_response(rig, rig.dt * np.arange(1500), np.full(1500, 2.3))
    with pytest.raises(ValueError, match="last 1024"):
        rig.output(0.0, response.states[:, 10], [2.0])
    assert rig.output(0.0, [0.0], [2.0])[0] == response.outputs[0, 0]
