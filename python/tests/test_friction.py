"""Friction models from Python; bristles against SciPy's implicit Runge–Kutta method, which shares no code with them."""

import math
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import clutch

MODELS = [
    clutch.StribeckFriction(),
    clutch.CoulombFriction(),
    clutch.LugreFriction(),
    clutch.DahlFriction(),
    clutch.ElastoPlasticFriction(),
    clutch.MaxwellFriction(),
]
INERTIA, DAMPING, NORMAL = 0.0017, 0.001, 0.14 * 2.0
SINE = {"mean_nm": 0.03, "amplitude_nm": 0.05, "frequency_hz": 3.0}


def named(friction):
    return type(friction).__name__


@pytest.mark.parametrize("friction", MODELS, ids=named)
def test_every_friction_has_a_coefficient_and_goes_through_the_laboratory(friction):
    velocities = np.array([-1.0, 0.0, 1.0])
    assert friction.coefficient(velocities).tolist() == [-friction.mu_dynamic, 0.0, friction.mu_dynamic]
    found = friction.examine()
    assert list(found) == ["steady", "pre_sliding", "lag", "break_away"]
    steady = found["steady"]
    assert friction.coefficient(steady["velocity_rad_s"]).tolist() == steady["coefficient"].tolist()
    most = getattr(friction, "mu_static", friction.mu_dynamic)
    assert 0.9 * friction.mu_dynamic < found["break_away"]["coefficient"][0] < 1.03 * most


@pytest.mark.filterwarnings("ignore:.*bristles of the friction can give energy")
@pytest.mark.parametrize("friction", MODELS, ids=named)
def test_a_rig_runs_with_every_friction(friction):
    overrides = {"run.duration_s": 1.0, "run.settle_s": 0.2}
    scenario = clutch.Scenario(
        law=clutch.Pd(), reference=clutch.Ramp(rate_deg_s=20), rig=clutch.Rig(friction=friction)
    ).override(overrides)
    assert clutch.simulate(scenario).metrics.max_error_rad < math.radians(0.3)


def curve(f, velocity):
    drop = f.mu_static - f.mu_dynamic
    return f.mu_dynamic + drop * math.exp(-((abs(velocity) / f.stribeck_velocity_rad_s) ** f.stribeck_exponent))


def bends(f, z, velocity):
    """The rate of the bristles, from the papers."""
    g = curve(f, velocity)
    share = 1.0
    if isinstance(f, clutch.ElastoPlasticFriction):
        bend = f.stiffness_1_rad * abs(z)
        if z * velocity < 0 or bend <= f.mu_elastic:
            share = 0.0
        elif bend < g:
            share = 0.5 + 0.5 * math.sin(math.pi * ((bend - f.mu_elastic) / (g - f.mu_elastic) - 0.5))
    return velocity - share * f.stiffness_1_rad * abs(velocity) * z / g


def oracle(f, times):
    def rate(t, state):
        _, velocity, z = state
        bend = bends(f, z, velocity)
        mu = f.stiffness_1_rad * z + f.damping_s_rad * bend
        torque = SINE["mean_nm"] + SINE["amplitude_nm"] * math.sin(2 * math.pi * SINE["frequency_hz"] * t)
        return [velocity, (torque - mu * NORMAL - DAMPING * velocity) / INERTIA, bend]

    # The brake of the start holds with a quarter more than it has to.
    z = f.mu_static / 1.25 / f.stiffness_1_rad
    found = solve_ivp(
        rate, (0.0, times[-1]), [0.0, 0.0, z], "Radau", times, rtol=1e-9, atol=[1e-13, 1e-11, 1e-14], max_step=1e-3
    )
    assert found.success
    return found.y


@pytest.mark.parametrize(
    "friction",
    [clutch.LugreFriction(damping_s_rad=1.0), clutch.LugreFriction(), clutch.ElastoPlasticFriction()],
    ids=named,
)
def test_bristles_move_as_scipy_says(friction):
    # Two volts on the brake, a torque that swings across break-away both ways.
    scenario = clutch.Scenario(
        law=clutch.Voltage(start_v=2.0),
        reference=clutch.Hold(),
        rig=clutch.Rig.ideal().replace(friction=friction, drive=clutch.SineDrive(**SINE)),
        run=clutch.RunOptions(duration_s=1.0, settle_s=0.0, start="rest", start_counts=0),
    )
    plant = clutch.Plant(scenario)
    positions, velocities = [], []
    for _ in range(1000):
        positions.append(plant.position)
        velocities.append(plant.velocity)
        plant.step(2.0)
    position, velocity, _ = oracle(friction, np.arange(1000) * 1e-3)
    reach = np.ptp(position)
    assert reach > 0.05, "it slides"
    assert np.abs(np.array(positions) - position).max() < 1e-5 * reach
    assert np.abs(np.array(velocities) - velocity).max() < 1e-4 * np.abs(velocity).max()


def test_of_bristles_that_can_give_energy_a_run_warns():
    scenario = {"law": clutch.Pd(), "reference": clutch.Ramp(rate_deg_s=20)}
    given = r"bristles of the friction can give energy: .* more of rig\.viscous_damping_nm_s_rad"
    with pytest.warns(UserWarning, match=given) as told:
        clutch.simulate(clutch.Scenario(**scenario, rig=clutch.Rig(friction=clutch.LugreFriction())))
    assert [warning.filename for warning in told] == [__file__]
    passive = clutch.Rig(friction=clutch.LugreFriction(damping_s_rad=0.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clutch.simulate(clutch.Scenario(**scenario, rig=passive))


def test_an_engine_that_cannot_take_a_friction_says_which_can():
    rig = clutch.Rig(friction=clutch.LugreFriction())
    scenario = {"law": clutch.Pd(), "reference": clutch.Ramp(rate_deg_s=2)}
    with pytest.raises(clutch.ParamError, match=r"run\.engine = \"dormand_prince\": expected bristle or auto"):
        clutch.Scenario(**scenario, rig=rig, run=clutch.RunOptions(engine="dormand_prince"))
    with pytest.raises(clutch.ParamError, match=r"run\.engine = \"bristle\": expected .*has no bristles"):
        clutch.Scenario(**scenario, run=clutch.RunOptions(engine="bristle"))
