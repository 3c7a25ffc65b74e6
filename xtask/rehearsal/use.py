"""The additions of `cargo xtask rehearse` from Python; the argument is a log of `clutch loop` under one of its laws."""

import sys

import clutch

friction = clutch.LinearFriction(velocity_rad_s=0.02)
assert abs(friction.coefficient(0.01) - 0.175) < 1e-12
assert clutch.Pd(bias_v=1.0).bias_v == 1.0

for law in (clutch.Lead(), clutch.Banded()):
    scenario = clutch.Scenario(
        law=law,
        reference=clutch.Ramp(rate_deg_s=5),
        rig=clutch.Rig(friction=friction),
        model=clutch.Model(friction=friction),
        run=clutch.RunOptions(duration_s=2, settle_s=0.5),
    )
    run = clutch.simulate(scenario)
    assert 0 < run.metrics.mean_absolute_error_rad < run.metrics.max_error_rad
    # In lanes, each row with the bits of a run by itself.
    rows = clutch.sweep(scenario, {"run.seed": list(range(8))}).table
    alone = [clutch.simulate(scenario.override({"run.seed": seed})).metrics for seed in rows["run.seed"]]
    assert list(rows["mean_absolute_error_rad"]) == [metrics.mean_absolute_error_rad for metrics in alone]

log = clutch.read_log(sys.argv[1])
assert set(log.channels["link"]["foreign"]) == {0}
assert {"bias_v", "proportional_v", "lead_v", "slow_error_rad", "demand_v"} <= set(log.channels["command"])
