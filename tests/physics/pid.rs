//! PID on the simulated rigs.

use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Metrics, Scenario};

fn metrics(set: &[(&str, String)]) -> Metrics {
    let text = clutch_sim::scenario::BUILT_IN.iter().find(|b| b.name == "bench_pid_2").unwrap().toml;
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    Scenario::parse("bench_pid_2", text, &set).unwrap().run(Keep::Figures, UNWATCHED).unwrap().metrics
}

#[test]
fn with_its_own_gains_it_hardly_sticks_at_2_deg_s_on_ten_discs_of_the_bench() {
    let discs: Vec<_> = (1..=10).map(|seed: u32| metrics(&[("run.seed", seed.to_string())])).collect();
    let cycles: Vec<f64> = discs.iter().map(|m| m.stick_slip_cycles_per_s).collect();
    let mean = cycles.iter().sum::<f64>() / 10.0;
    assert!(mean < 0.5, "{cycles:?}");
    assert!(discs.iter().all(|m| m.max_error_rad.to_degrees() < 0.2), "{discs:?}");
}

#[test]
fn an_integral_takes_away_the_mean_error_that_pd_keeps() {
    // A model that is wrong by a fifth leaves PD behind or ahead; here the drive is.
    let drive = ("rig.drive.weight.mass_kg", "0.24".to_owned());
    let pid = metrics(std::slice::from_ref(&drive)).mean_error_rad.abs();
    let pd =
        metrics(&[drive, ("law.pid.ki_v_rad_s", "0.0".to_owned()), ("law.pid.bias_v", "2.24".to_owned())]);
    assert!(pid.to_degrees() < 0.015, "{}°", pid.to_degrees());
    assert!(pd.mean_error_rad.abs() > 3.0 * pid, "{}°", pd.mean_error_rad.to_degrees());
}

#[test]
fn a_long_time_at_a_limit_winds_nothing_up() {
    // Half a second in which even a released shaft cannot follow, then a slow path: with an integral that winds up,
    // the brake would stay open.
    let points = "[[0.0, 0.0], [0.4, 60.0], [0.6, 60.6], [5.0, 69.4]]";
    let text = format!(
        "name = \"x\"\n[rig]\nbase = \"paper\"\nspeed_limit_deg_s = 3600.0\n\
         [law.pid]\n[reference.table]\ninterpolation = \"linear\"\npoints_s_deg = {points}\n[run]\nsettle_s = 1.5\n"
    );
    let error = |tracking: &str| {
        let set = [("law.pid.tracking_time_s".to_owned(), tracking.to_owned())];
        let m = Scenario::parse("x", &text, &set).unwrap().run(Keep::Figures, UNWATCHED).unwrap().metrics;
        m.max_error_rad.to_degrees()
    };
    // With tracking, and by the limit of the integral alone.
    for tracking in ["0.05", "1e6"] {
        assert!(error(tracking) < 0.3, "{}° with a tracking time of {tracking} s", error(tracking));
    }
}
