//! A slide of 2 kg, written as a shaft of which 1° is 1 mm.

use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Run, Scenario};

/// Newtons of a torque of 1 N m: one over the radius in metres.
const PER_NM: f64 = std::f64::consts::PI / 0.18;

fn slide(set: &[(&str, &str)]) -> Run {
    let text = clutch_sim::scenario::BUILT_IN.iter().find(|b| b.name == "slide_pid").unwrap().toml;
    let ideal = [("rig.dac.quantised", "false"), ("run.settle_s", "0")];
    let set: Vec<_> = ideal.iter().chain(set).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scenario::parse("slide_pid", text, &set).unwrap().run(Keep::Trace, UNWATCHED).unwrap()
}

#[test]
fn a_slide_stops_after_the_way_that_its_mass_and_friction_give() {
    let run = slide(&[
        ("law", "{voltage = {}}"),
        ("reference", "{ramp = {rate_deg_s = 100.0}}"),
        ("rig.friction", "{coulomb = {mu_static = 0.125, mu_dynamic = 0.125}}"),
        ("rig.viscous_damping_nm_s_rad", "0.0"),
        ("run.start", "on_path"),
        ("run.duration_s", "0.1"),
    ]);
    let stop = run.events.first().expect("it comes to rest");
    // m v²/2F and m v/F of 2 kg, 0.1 m/s, 5 N; the keys of the scenario have seven digits.
    let way = (stop.position - run.trace.position[0]).to_degrees();
    assert!((way - 2.0).abs() < 1e-6, "{way} mm");
    assert!((stop.time - 0.04).abs() < 1e-8, "{} s", stop.time);
    assert_eq!(run.trace.position.last(), Some(&stop.position), "it rests");
}

#[test]
fn a_slide_breaks_away_at_the_force_of_its_friction_at_rest() {
    let run = slide(&[
        ("law", "{voltage = {end_v = 2.0, rate_v_s = 0.2}}"),
        ("reference", "{hold = {}}"),
        ("run.duration_s", "6.0"),
    ]);
    let force = run.metrics.break_away_torque_nm.expect("it breaks away") * PER_NM;
    // A period's step of the voltage is 0.0002 V, of the force 0.002 N.
    assert!((8.0..8.0021).contains(&force), "{force} N");
}
