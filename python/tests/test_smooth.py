"""The lowest smooth rate: the command's figures, the runs that it stands for, refusals."""

import json
import subprocess
import sys

import pytest

import clutch

#: Few rates and discs, so that tests stay short.
FEW = {"rates_deg_s": [20, 2, 6], "discs": 2}


def test_the_function_gives_what_the_command_gives():
    gains = ["--x", "law.pd.kp_v_rad=5000", "--y", "law.pd.kd_v_s_rad=50"]
    few = ["--rates", "2,6,20", "--discs", "2", "--discs-above", "2", "--json"]
    command = [sys.executable, "-m", "clutch", "map", "bench_pd_2", *gains, *few]
    cell = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)["map"]["cells"][0][0]
    found = clutch.lowest_smooth_speed("bench_pd_2", **FEW)
    assert found == clutch.SmoothSpeed._build(cell)
    assert (found.rate_deg_s, found.cause, found.rates_deg_s) == (20.0, "sampled_loop", (2.0, 6.0, 20.0))
    assert found.evidence.causes[0] == found.cause
    assert found.evidence.rate_deg_s == found.below.rate_deg_s == 6.0


def test_the_run_below_sticks_and_those_at_the_rate_do_not():
    found = clutch.lowest_smooth_speed("bench_pd_2", **FEW)
    below = {"reference.ramp.rate_deg_s": found.below.rate_deg_s, "run.seed": found.below.seed}
    events = clutch.simulate("bench_pd_2", overrides=below).events
    times = [t for t, kind in zip(events["time_s"], events["kind"], strict=True) if kind == "stick" and t >= 1.0]
    assert times[0] == found.below.time_s
    for seed in (1, 2):
        smooth = {"reference.ramp.rate_deg_s": found.rate_deg_s, "run.seed": seed}
        assert clutch.simulate("bench_pd_2", overrides=smooth).metrics.stick_time_fraction == 0.0


def test_without_its_cause_it_is_slower_and_overrides_count():
    stable = clutch.lowest_smooth_speed("bench_pd_2", overrides={"rig.delay_ticks": 0}, **FEW)
    assert stable.rate_deg_s == 6.0 and stable.cause != "sampled_loop" and stable.evidence.spectral_radius < 1.0
    ideal = clutch.lowest_smooth_speed("bench_pd_2", overrides={"rig.encoder.quantised": False}, **FEW)
    assert ideal.rate_deg_s == 20.0
    assert ideal.evidence.edge_time_s is None and ideal.evidence.growth_between_edges is None


def test_ripple_is_the_cause_where_an_even_disc_is_smooth():
    soft = {"velocity.smoothed_derivative.smoothing": 0.712, "law.pd.kp_v_rad": 800, "law.pd.kd_v_s_rad": 7}
    rates = {"rates_deg_s": [2, 10, 15], "discs": 2}
    found = clutch.lowest_smooth_speed("bench_pd_2", overrides=soft, **rates)
    assert (found.rate_deg_s, found.cause, found.evidence.even_disc_smooth) == (15.0, "ripple", True)
    even = clutch.lowest_smooth_speed("bench_pd_2", overrides=soft | {"rig.ripple.rms": 0}, **rates)
    assert even.rate_deg_s == 10.0 and even.cause is None


def test_a_smooth_lowest_rate_has_no_cause():
    found = clutch.lowest_smooth_speed("bench_glide_2", rates_deg_s=[2.0], discs=1)
    assert (found.rate_deg_s, found.cause, found.below, found.runs) == (2.0, None, None, 1)
    assert found.evidence.spectral_radius is None and "glide" in found.evidence.not_covered


@pytest.mark.parametrize(
    ("scenario", "more", "field", "said"),
    [
        ("minimum_jerk", {}, "reference", "expected a ramp"),
        ("bench_pd_2", {"rates_deg_s": []}, "rates", "at least one rate"),
        ("bench_pd_2", {"rates_deg_s": [2, -1]}, "rates", "rates = -1: expected finite numbers above 0 °/s"),
        ("bench_pd_2", {"discs": 0}, "discs", "discs = 0: expected a whole number from 1 to 10000"),
        ("bench_pd_2", {"discs": -3}, "discs", "discs = -3"),
        ("bench_pd_2", {"rates_deg_s": [1e9]}, "reference.ramp.rate_deg_s", "expected a finite rate"),
        ("bench_pd_2", {"overrides": {"law.pd.kp_v_rad": -1}}, "law.pd.kp_v_rad", "-1"),
    ],
)
def test_what_cannot_be_searched_is_refused_by_key_and_value(scenario, more, field, said):
    with pytest.raises(clutch.ParamError) as refused:
        clutch.lowest_smooth_speed(scenario, **more)
    assert refused.value.field == field
    assert said in str(refused.value)
