//! Glide on a brake with bristles: the table `bristles` of docs/smooth.md.

use super::laws::GLIDE;
use super::{FRESH, Outcome, Summary, runs_of, shown};

/// Way on which the bristles bend at the friction of rest, counts.
const BEND: [f64; 5] = [0.2, 0.5, 1.0, 2.0, 5.0];
/// Rates of the paths, °/s.
const RATES: [f64; 2] = [2.0, 4.0];
/// Friction of `bench` at rest.
const AT_REST: f64 = 0.203;
/// Angle of a count, rad.
const COUNT: f64 = core::f64::consts::TAU / 20_000.0;

/// The scenario at a rate, with bristles of that length, from rest: friction of `bench`, and damped as the defaults are.
fn scenario(rate: f64, counts: f64) -> String {
    let stiffness = AT_REST / (counts * COUNT);
    let damping = 5.0 * (stiffness / 2000.0).sqrt();
    format!(
        "[rig]\nbase = \"bench\"\n\n[rig.friction.lugre]\nmu_static = {AT_REST:?}\nmu_dynamic = 0.104\n\
         stribeck_velocity_rad_s = 0.00144\nstribeck_exponent = 1.0\nstiffness_1_rad = {stiffness:?}\n\
         damping_s_rad = {damping:?}\n\n{GLIDE}\n\n[reference.ramp]\nrate_deg_s = {rate:?}\n\n\
         [run]\nstart = \"rest\"\n"
    )
}

pub(super) fn bristles() -> Outcome<()> {
    println!(
        "| bristles bend by | rate | cycles/s | discs of 40 | most in 4 s | largest error | RMS | time stuck | V/s | sticks in the first second, mean | most |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for counts in BEND {
        for rate in RATES {
            let scenario = scenario(rate, counts);
            let s = Summary::of(&runs_of(&scenario, &[], FRESH)?);
            let first = [("run.duration_s", 1.0), ("run.settle_s", 0.0)];
            let first = Summary::of(&runs_of(&scenario, &first, FRESH)?);
            println!(
                "| {counts} counts | {rate} °/s | {} | {} | {:.0} | {:.3}° | {:.4}° | {} % | {:.0} | {} | {:.0} |",
                shown(s.cycles),
                s.discs,
                s.most,
                s.error,
                s.rms,
                shown(100.0 * s.stuck),
                s.travel,
                shown(first.cycles),
                first.most
            );
        }
    }
    Ok(())
}
