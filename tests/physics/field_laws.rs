//! Laws that the field would take: super-twisting, SMC with an integral, PD with a disturbance observer.

use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Metrics, Scenario};

const LAWS: [&str; 3] = ["super_twisting", "smc_integral", "dob"];

fn metrics(text: &str, set: &[(&str, String)]) -> Metrics {
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    Scenario::parse("x", text, &set).unwrap().run(Keep::Figures, UNWATCHED).unwrap().metrics
}

/// A ramp on a rig under a law.
fn ramp(rig: &str, law: &str, rate: f64) -> String {
    format!("name = \"x\"\n[rig]\nbase = \"{rig}\"\n{law}\n[reference.ramp]\nrate_deg_s = {rate:?}\n")
}

#[test]
fn a_load_that_nobody_told_leaves_no_mean_error() {
    // A fifth more than the model's, and an ideal sensor: what is left is the law's.
    let set = [
        ("rig.drive.weight.mass_kg", "0.24".to_owned()),
        ("rig.encoder.quantised", "false".to_owned()),
        ("run.settle_s", "2.0".to_owned()),
    ];
    let error = |law: &str| metrics(&ramp("paper", law, 20.0), &set).mean_error_rad.abs().to_degrees();
    for law in LAWS {
        let error = error(&format!("[law.{law}]"));
        assert!(error < 1e-3, "{law}: {error}°");
    }
    // Those that remember nothing are off by their offset: theory, section 4.
    for law in ["pd", "smc"] {
        let error = error(&format!("[law.{law}]"));
        assert!(error > 0.02, "{law}: {error}°");
    }
}

#[test]
fn a_long_time_at_a_limit_winds_nothing_up() {
    // Half a second in which even a released shaft cannot follow, then a slow path, for which a shaft that has come 2° too
    // far has to wait; with an ideal sensor, so that nothing sticks later.
    let points = "[[0.0, 0.0], [0.4, 60.0], [0.6, 60.6], [5.0, 69.4]]";
    for law in LAWS {
        let text = format!(
            "name = \"x\"\n[rig]\nbase = \"paper\"\nspeed_limit_deg_s = 3600.0\n\
             [law.{law}]\n[reference.table]\ninterpolation = \"linear\"\npoints_s_deg = {points}\n[run]\nsettle_s = 2.0\n"
        );
        let set = [("rig.encoder.quantised", "false".to_owned())];
        let error = metrics(&text, &set).max_error_rad.to_degrees();
        assert!(error < 0.15, "{law}: {error}°");
    }
}
