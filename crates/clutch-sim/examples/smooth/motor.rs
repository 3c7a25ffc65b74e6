//! A motor axis, glide beside PID with feed-forward of Coulomb friction: the table `motor` of docs/smooth.md.

use super::laws::GLIDE;
use super::{FRESH_MOTORS, Outcome, STEPS_BELOW, Summary, runs_of, shown};
use clutch_sim::smooth_speed::law_keys;
use clutch_sim::{Metrics, Scenario};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::ops::Range;

/// Properties that an axis may have.
pub(super) struct Axis {
    /// Counts of the encoder per turn.
    pub(super) counts: f64,
    /// Stribeck velocity, rad/s.
    pub(super) stribeck: f64,
}

/// A geared axis: 50 and 30 mN m of friction, no load.
const AXIS: &str = include_str!("motor_axis.toml");

/// The Stribeck velocity of the model above, rad/s.
const BELIEVED: f64 = 0.003;

/// To and fro at 0.5 °/s at most, a period of 63 s, from rest.
pub(super) const TO_AND_FRO: &str = "[reference.sine]\nrate_deg_s = 0.0\namplitude_deg = 5.0\nfrequency_hz = 0.0159155\n\n[run]\nduration_s = 66.0\nsettle_s = 2.0\nstart = \"rest\"";
/// The same until after its first reversal, for the search.
const FIRST_REVERSAL: &str = "[reference.sine]\nrate_deg_s = 0.0\namplitude_deg = 5.0\nfrequency_hz = 0.0159155\n\n[run]\nduration_s = 20.0\nsettle_s = 2.0\nstart = \"rest\"";
const AT_2: &str = "[reference.ramp]\nrate_deg_s = 2.0";

/// PID with feed-forward of friction, gains from a text book: 17 N m/rad, 100 N m/(rad s), 0.3 N m s/rad.
pub(super) const TEXT_BOOK: &str =
    "[law.pid]\nkp_v_rad = 340.0\nki_v_rad_s = 2000.0\nkd_v_s_rad = 6.0\ncoulomb_v = 0.6";

/// Torque per volt of the motor over that of the brake on `bench`, whose friction in motion is 0.104 of 0.14 N m/V.
const STRONGER: f64 = 0.05 / (0.104 * 0.14);

/// Least gain of a law that switches, V: half as much again as friction at rest.
const LEAST_SWITCHED: f64 = 1.5;

/// A law of the brake for the motor, and the keys to set: gains in volts give the torque that they give there.
pub(super) fn of_brake(law: &str) -> Outcome<(String, Vec<(String, f64)>)> {
    // The voltage that holds the load becomes the one that overcomes friction.
    let law = law.replace("bias_v = 2.24", "coulomb_v = 0.6");
    let scenario = Scenario::parse("motor", &format!("name = \"motor\"\n\n{AXIS}\n{law}\n\n{AT_2}\n"), &[])?;
    let in_volts = |key: &str| {
        let name = key.rsplit('.').next().unwrap_or(key);
        name.split('_').skip(1).any(|unit| unit == "v") && name != "coulomb_v"
    };
    let gains = law_keys(&scenario).into_iter().filter(|(key, _)| in_volts(key));
    let of_motor = |(key, value): (String, f64)| {
        let value = value / STRONGER;
        let switches = key.ends_with(".kp_v");
        (key, if switches { value.max(LEAST_SWITCHED) } else { value })
    };
    Ok((law, gains.map(of_motor).collect()))
}

/// Runs on an axis, one for each seed.
pub(super) fn runs(
    axis: &Axis,
    law: &str,
    path: &str,
    more: &[(&str, f64)],
    seeds: Range<i64>,
) -> Outcome<Vec<Metrics>> {
    let mut keys = vec![
        ("rig.encoder.counts_per_rev", axis.counts),
        ("rig.friction.stribeck.stribeck_velocity_rad_s", axis.stribeck),
    ];
    keys.extend_from_slice(more);
    let found = runs_of(&format!("{AXIS}\n{law}\n\n{path}\n"), &keys, seeds)?;
    let finite = |m: &Metrics| m.max_error_rad.is_finite() && m.control_variation_v_s.is_finite();
    if found.iter().all(finite) { Ok(found) } else { Err(format!("a figure is no number: {law}").into()) }
}

/// Candidates of the search, and discs that they are tried on.
const CANDIDATES: usize = 150;
const TRIED_ON: Range<i64> = 1..4;

/// PID with the least largest error of seeded candidates, each with a share of the feed-forward of friction.
fn tuned(axis: &Axis, path: &str) -> Outcome<String> {
    let mut random = Pcg64::seed_from_u64(13);
    #[allow(clippy::disallowed_methods, reason = "candidates of a search: no last bit of them matters")]
    let mut draw = |low: f64, high: f64| low * (high / low).powf(random.random::<f64>());
    let mut best = (f64::INFINITY, String::new());
    for _ in 0..CANDIDATES {
        let (kp, ki, kd) = (draw(34.0, 6800.0), draw(20.0, 400_000.0), draw(0.6, 60.0));
        let (coulomb, smoothing) = (0.6 * draw(0.1, 1.0), draw(0.1, 1.0));
        let law = format!(
            "[law.pid]\nkp_v_rad = {kp:?}\nki_v_rad_s = {ki:?}\nkd_v_s_rad = {kd:?}\ncoulomb_v = {coulomb:?}\n\n\
             [velocity.smoothed_derivative]\nsmoothing = {smoothing:?}"
        );
        let error = Summary::of(&runs(axis, &law, path, &[], TRIED_ON)?).error;
        if error < best.0 {
            best = (error, law);
        }
    }
    Ok(best.1)
}

pub(super) fn motor() -> Outcome<()> {
    println!(
        "| counts, v_s, law | 2 °/s: largest error | RMS | sticks/s (discs) | time stuck | V/s | 0.5 °/s to and fro: largest error | RMS | sticks/s | time stuck | V/s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let mut before: Vec<[String; 2]> = Vec::new();
    for counts in [20_000.0, 200_000.0] {
        let mut found = Vec::new();
        for (i, stribeck) in [0.001, 0.003, 0.01].into_iter().enumerate() {
            let axis = Axis { counts, stribeck };
            let print = |title: &str, [ramp, sine]: [&str; 2], more: &[(&str, f64)]| -> Outcome<()> {
                let a = Summary::of(&runs(&axis, ramp, AT_2, more, FRESH_MOTORS)?);
                let b = Summary::of(&runs(&axis, sine, TO_AND_FRO, more, FRESH_MOTORS)?);
                let figures = |s: &Summary| (format!("{:.4}° | {:.4}°", s.error, s.rms), shown(s.cycles));
                let ends = |s: &Summary| format!("{} % | {:.0}", shown(100.0 * s.stuck), s.travel);
                let ((errors, sticks), (errors_b, sticks_b)) = (figures(&a), figures(&b));
                println!(
                    "| {counts}, {stribeck} rad/s, {title} | {errors} | {sticks} ({}) | {} | {errors_b} | {sticks_b} | {} |",
                    a.discs,
                    ends(&a),
                    ends(&b)
                );
                Ok(())
            };
            let told = ("model.friction.stribeck.stribeck_velocity_rad_s", stribeck);
            print("glide", [GLIDE; 2], &[told])?;
            print("glide, steps below 0.95 °/s", [GLIDE; 2], &[told, STEPS_BELOW])?;
            if (stribeck - BELIEVED).abs() > 1e-9 {
                let title = format!("the same, believing {BELIEVED} rad/s");
                print(&title, [GLIDE; 2], &[STEPS_BELOW])?;
            }
            print("PID, text-book gains", [TEXT_BOOK; 2], &[])?;
            if let Some([ramp, sine]) = before.get(i) {
                print("PID, tuned for error with 20 000 counts", [ramp, sine], &[])?;
            }
            let tuned = [tuned(&axis, AT_2)?, tuned(&axis, FIRST_REVERSAL)?];
            print("PID, tuned for error", [&tuned[0], &tuned[1]], &[])?;
            found.push(tuned);
        }
        before = found;
    }
    Ok(())
}
