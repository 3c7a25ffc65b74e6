//! Every law from rest, under a hand, at a step of the load and on a reversal: the table `troubles` of docs/smooth.md.

use super::laws::{GLIDE, LAWS};
use super::motor::{self, Axis};
use super::{FRESH, FRESH_MOTORS, Outcome, STEPS_BELOW, Summary, runs_of, shown};
use std::ops::Range;

/// The weight's torque on `bench`, N m, by 15 % more from 3 s on.
const LOAD_STEP: &str =
    "[rig.drive.table]\npoints_s_nm = [[0.0, 0.0493011], [3.0, 0.0493011], [3.001, 0.0566963]]";
/// When it comes, and the time after which the shaft is to be smooth again, s.
const STEP_AT: f64 = 3.0;
const AGAIN: f64 = 0.3;

/// A hand instead of the weight.
const HAND: &str =
    "[rig.drive.hand]\nmean_nm = 0.05\nrms_nm = 0.008\nlowest_frequency_hz = 0.2\nhighest_frequency_hz = 5.0";

/// Cells of a law on `bench`.
fn on_bench(law: &str, discs: &Range<i64>) -> Outcome<String> {
    let runs = |rate: f64, drive: &str, run: &str, keys: &[(&str, f64)]| -> Outcome<Summary> {
        let rig = format!("[rig]\nbase = \"bench\"\n\n{drive}\n\n{law}");
        let scenario = format!("{rig}\n\n[reference.ramp]\nrate_deg_s = {rate:?}\n\n[run]\n{run}\n");
        Ok(Summary::of(&runs_of(&scenario, keys, discs.clone())?))
    };
    let rest = runs(2.0, "", "start = \"rest\"\nduration_s = 1.0\nsettle_s = 0.0", &[])?;
    let hand = runs(4.0, HAND, "", &[])?;
    let step = |settle| runs(2.0, LOAD_STEP, "duration_s = 5.0", &[("run.settle_s", settle)]);
    let (hit, after) = (step(STEP_AT)?, step(STEP_AT + AGAIN)?);
    Ok(format!(
        "{}, {:.0}, {:.3}° | {} ({}), {:.3}° | {}, {:.3}°",
        shown(rest.cycles),
        rest.most,
        rest.error,
        shown(hand.cycles),
        hand.discs,
        hand.error,
        after.discs,
        hit.error
    ))
}

/// The cell of a law on the motor axis, to and fro at half a degree a second.
fn reversal(law: &str, steps: bool) -> Outcome<String> {
    let axis = Axis { counts: 20_000.0, stribeck: 0.003 };
    let (law, gains) = motor::of_brake(law)?;
    let mut keys: Vec<(&str, f64)> = gains.iter().map(|(key, value)| (&key[..], *value)).collect();
    keys.extend(steps.then_some(STEPS_BELOW));
    let s = Summary::of(&motor::runs(&axis, &law, motor::TO_AND_FRO, &keys, FRESH_MOTORS)?);
    Ok(format!("{}, {:.3}°", shown(s.cycles), s.error))
}

pub(super) fn troubles() -> Outcome<()> {
    println!(
        "| law, velocity from | from rest at 2 °/s: sticks in the first second, most, largest error | hand at 4 °/s: cycles/s (discs), largest error | load + 15 % at 2 °/s: discs that stick after 0.3 s, largest error | motor, 0.5 °/s to and fro: sticks/s, largest error |"
    );
    println!("|---|---|---|---|---|");
    for law in LAWS {
        println!(
            "| {} | {} | {} |",
            law.title,
            on_bench(law.scenario, &FRESH)?,
            reversal(law.scenario, false)?
        );
        if law.scenario == GLIDE {
            println!("| glide, micro-steps below 0.95 °/s | | | | {} |", reversal(GLIDE, true)?);
            println!("| glide, discs 1 to 40 | {} | |", on_bench(GLIDE, &(1..41))?);
        }
    }
    Ok(())
}
