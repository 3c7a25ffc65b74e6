//! The checker of a certificate: multiplications with outward rounding, in one sweep.
//!
//! It derives the model from [`Setup`] by itself and shares no code with the search, only the plain data of
//! [`crate::setup`]: types and the version, of which it calls nothing. For every row `c` of a cell's set and everything that can happen in a tick it holds the claim
//!
//! ```text
//! c·x⁺ ≤ F·y + f₀ = Σ λ_j a_j·y + (F − Σ λ_j a_j)·y + f₀ ≤ Σ λ_j b_j + |F − Σ λ_j a_j|·|y| + f₀ ≤ r
//! ```
//!
//! with the multipliers `λ ≥ 0` of the file, the constraints `a_j·y ≤ b_j` of the set and of the mode, and `|y|` from the set's
//! own walls. A certificate that passes bounds the error, whoever made the multipliers.

mod interval;
mod law;
mod mode;
mod shaft;

use crate::setup::{Case, Cell, Certificate, Form, Gains, ModeId, Motor, Setup, VERSION};
use interval::{Interval, at};
use mode::Mode;
use shaft::Shaft;
use std::collections::HashMap;

/// The statement of a certificate that holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checked {
    /// Bound on `|e|` of every run of every plant of the box, rad.
    pub error_bound: f64,
    /// `μ_d` of the cell that has it.
    pub limiting: [f64; 2],
    /// Programs whose bound was held against a radius.
    pub programs: usize,
}

/// The reason that a certificate is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refused {
    /// The format is another.
    #[error("version is {0}: expected {VERSION}")]
    Version(u32),
    /// A value that no certificate has.
    #[error("{key} is {value}: expected {expected}")]
    Value {
        /// Its key.
        key: String,
        /// The value.
        value: String,
        /// The values that it may have.
        expected: &'static str,
    },
    /// Part of the box is in no cell.
    #[error("cells: no cell holds μ_d from {0} to {1}: expected cells that cover setup.sliding")]
    Gap(f64, f64),
    /// Something wrong with a cell.
    #[error("cells[{cell}] (μ_d {} … {}): {flaw}", .sliding[0], .sliding[1])]
    Cell {
        /// Its number.
        cell: usize,
        /// Its `μ_d`.
        sliding: [f64; 2],
        /// Its flaw.
        flaw: Flaw,
    },
}

/// A flaw of a cell.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Flaw {
    /// A list is not what the others need.
    #[error("{0}")]
    Shape(String),
    /// The pieces of the law leave something out, or a line is on the wrong side of the demand.
    #[error("strips: {0}")]
    Strips(String),
    /// The set has no wall there.
    #[error("rows: no row bounds coordinate {0} on both sides")]
    Wall(usize),
    /// A run may begin outside.
    #[error("radii[{row}] is {radius}: a run may begin at {start}")]
    Start {
        /// The row.
        row: usize,
        /// Its radius.
        radius: f64,
        /// The largest at the start.
        start: f64,
    },
    /// The shaft may be faster than assumed.
    #[error("speed_cap is {cap}: the set lets the shaft reach {reached} counts per tick")]
    Speed {
        /// The speed assumed.
        cap: f64,
        /// The speed of the set.
        reached: f64,
    },
    /// Nothing is said of something that can happen.
    #[error("modes: piece {}, {:?}, {} counts is missing, and can happen", .0.piece, .0.case, .0.counts)]
    Mode(ModeId),
    /// No multipliers.
    #[error("proofs: none for row {row} in mode {mode}")]
    Proof {
        /// The row.
        row: usize,
        /// The mode.
        mode: usize,
    },
    /// The multipliers do not show the mode impossible.
    #[error("impossible: mode {mode}: the multipliers prove {proven}: expected a number below 0")]
    Possible {
        /// The mode.
        mode: usize,
        /// The sum that they prove.
        proven: f64,
    },
    /// The multipliers do not prove the row.
    #[error("row {row}, mode {mode}: the multipliers prove {proven}, above the radius {radius}")]
    Row {
        /// The row.
        row: usize,
        /// The mode.
        mode: usize,
        /// The bound that they prove.
        proven: f64,
        /// The radius.
        radius: f64,
    },
}

/// Checks a certificate.
///
/// # Errors
/// The first thing that is wrong.
pub fn check(certificate: &Certificate) -> Result<Checked, Refused> {
    if certificate.version != VERSION {
        return Err(Refused::Version(certificate.version));
    }
    let setup = &certificate.setup;
    values(setup)?;
    covered(certificate)?;
    let mut out = Checked { error_bound: 0.0, limiting: setup.sliding, programs: 0 };
    for (k, cell) in certificate.cells.iter().enumerate() {
        let flaw = |flaw| Refused::Cell { cell: k, sliding: cell.sliding, flaw };
        let (error, programs) = check_cell(setup, cell).map_err(flaw)?;
        out.programs += programs;
        if error > out.error_bound {
            (out.error_bound, out.limiting) = (error, cell.sliding);
        }
    }
    Ok(out)
}

/// Values of a setup that the model can be made of.
fn values(s: &Setup) -> Result<(), Refused> {
    let refuse = |key: &str, value: String, expected| {
        Err(Refused::Value { key: format!("setup.{key}"), value, expected })
    };
    let positive = [
        ("period_s", s.period_s),
        ("counts_per_rev", f64::from(s.counts_per_rev)),
        ("rate", s.rate),
        ("stribeck[0]", s.stribeck[0]),
        ("stribeck[1]", s.stribeck[1]),
        ("smoothing", s.smoothing),
    ];
    for (key, x) in positive {
        if !(x > 0.0 && x.is_finite()) {
            return refuse(key, x.to_string(), "a finite number above 0");
        }
    }
    if s.smoothing > 1.0 {
        return refuse("smoothing", s.smoothing.to_string(), "a number up to 1");
    }
    for (key, x) in [("converter_step", s.converter_step), ("torque_noise", s.torque_noise)] {
        if !(x >= 0.0 && x.is_finite()) {
            return refuse(key, x.to_string(), "a finite number of at least 0");
        }
    }
    // A shaft that is never driven backwards never runs back: all that follows rests on that.
    if s.motor.is_none() && s.torque_noise >= s.drive_torque[0] {
        return refuse("torque_noise", s.torque_noise.to_string(), "a number below setup.drive_torque[0]");
    }
    if !(s.ripple >= 0.0 && s.ripple < 1.0) {
        return refuse("ripple", s.ripple.to_string(), "a number from 0 to below 1");
    }
    // Beyond it a single-precision loop rounds σ by more than the edges of the shell overlap.
    if let Gains::Shell { boundary, .. } = s.law
        && boundary > 50.0
    {
        return refuse("law.boundary", boundary.to_string(), "at most 50 rad/s");
    }
    if s.delay_ticks > 3 {
        return refuse("delay_ticks", s.delay_ticks.to_string(), "at most 3");
    }
    let ends = [
        ("inertia", s.inertia, true),
        ("viscous_damping", s.viscous_damping, false),
        ("sliding", s.sliding, true),
        ("at_rest", s.at_rest, true),
    ];
    let of_a_brake = [
        ("drive_torque", s.drive_torque, true),
        ("brake_gain", s.brake_gain, true),
        ("volts", s.volts, false),
        ("start_volts", s.start_volts, false),
    ];
    let of_a_brake = of_a_brake.into_iter().filter(|_| s.motor.is_none());
    for (key, [low, high], above_0) in ends.into_iter().chain(of_a_brake) {
        let begins = if above_0 { low > 0.0 } else { low >= 0.0 };
        if !(begins && low <= high && high.is_finite()) {
            return refuse(
                key,
                format!("[{low}, {high}]"),
                "two finite numbers, the lower first, not below 0, and above 0 but for damping and volts",
            );
        }
    }
    if let Some(motor) = &s.motor {
        motor_values(s, motor)?;
    }
    if !sound(&s.law) {
        return refuse(
            "law",
            format!("{:?}", s.law),
            "finite gains of at least 0, finite voltages beside them, and a boundary and a tracking time above 0",
        );
    }
    Ok(())
}

/// Values of an axis with a motor, which no voltage that goes out turns round.
fn motor_values(s: &Setup, motor: &Motor) -> Result<(), Refused> {
    let refuse = |key: &str, value: String, expected| {
        Err(Refused::Value { key: format!("setup.{key}"), value, expected })
    };
    let ends = [
        ("drive_torque", s.drive_torque),
        ("volts", s.volts),
        ("start_volts", s.start_volts),
        ("motor.gain", motor.gain),
    ];
    for (key, [low, high]) in ends {
        if !(low <= high && low.is_finite() && high.is_finite() && high.abs().max(low.abs()) <= 1e6) {
            let expected = "two finite numbers, the lower first, none beyond a million";
            return refuse(key, format!("[{low}, {high}]"), expected);
        }
    }
    if motor.gain[0] <= 0.0 {
        return refuse("motor.gain", format!("[{}, {}]", motor.gain[0], motor.gain[1]), "numbers above 0");
    }
    if !(motor.preload >= 0.0 && motor.preload.is_finite()) {
        return refuse("motor.preload", motor.preload.to_string(), "a finite number of at least 0");
    }
    if s.converter_step > 1.0 {
        return refuse("converter_step", s.converter_step.to_string(), "at most 1 V with a motor");
    }
    if matches!(s.law, Gains::Layer { .. }) {
        return refuse("law", format!("{:?}", s.law), "linear, integral or a shell with a motor");
    }
    let off = at(0.5) * at(s.converter_step) + at(shaft::LAW_ROUNDING);
    let lowest = (at(s.volts[0]) - off).min(at(s.start_volts[0]));
    let gain = Interval { low: motor.gain[0], high: motor.gain[1] };
    let pushed = gain * lowest + at(s.drive_torque[0]) - at(s.torque_noise);
    let friction = at(s.at_rest[0].min(s.sliding[0])) * (at(1.0) - at(s.ripple)) * at(motor.preload);
    if above(-pushed.low, friction.low) {
        let expected = "a lowest voltage at which friction holds the shaft against running backwards";
        return refuse("volts", format!("[{}, {}]", s.volts[0], s.volts[1]), expected);
    }
    Ok(())
}

/// Gains that a law can have.
fn sound(law: &Gains) -> bool {
    // Gains, what has to be above 0, and voltages.
    let (gains, above_0, volts) = match *law {
        Gains::Linear { kp, kd, forward } => ([kp, 0.0, kd], 1.0, [forward; 3]),
        Gains::Integral { kp, ki, kd, forward, tracking, limits } => {
            ([kp, ki, kd], tracking, [forward, limits[0], limits[1]])
        }
        Gains::Layer { kp, kd, slope, boundary } => ([kp, kd, slope], boundary, [0.0; 3]),
        Gains::Shell { slope, boundary } => ([slope, 0.0, 0.0], boundary, [0.0; 3]),
    };
    let ordered = !matches!(law, Gains::Integral { limits, .. } if limits[0] > limits[1]);
    gains.iter().all(|g| *g >= 0.0 && g.is_finite())
        && above_0 > 0.0
        && above_0.is_finite()
        && volts.iter().all(|v| v.is_finite())
        && ordered
}

/// A number is above a limit, or none.
fn above(x: f64, limit: f64) -> bool {
    x > limit || x.is_nan() || limit.is_nan()
}

/// The cells cover the box.
fn covered(certificate: &Certificate) -> Result<(), Refused> {
    let [low, high] = certificate.setup.sliding;
    let mut cells: Vec<[f64; 2]> = certificate.cells.iter().map(|c| c.sliding).collect();
    cells.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut reached = low;
    let mut any = false;
    for [from, to] in cells {
        if !(from > 0.0 && from <= to && to.is_finite()) {
            return Err(Refused::Value {
                key: "cells.sliding".into(),
                value: format!("[{from}, {to}]"),
                expected: "two finite numbers above 0, the lower first",
            });
        }
        if from > reached {
            return Err(Refused::Gap(reached, from));
        }
        any |= from <= low && to >= low;
        reached = reached.max(to);
    }
    if !any || reached < high { Err(Refused::Gap(reached, high)) } else { Ok(()) }
}

/// Bound on `|e|` of a cell, rad, and the programs it took.
fn check_cell(setup: &Setup, cell: &Cell) -> Result<(f64, usize), Flaw> {
    let n = numbers_of_a_row(setup);
    shape(cell, n)?;
    let shaft = Shaft::new(setup, cell);
    let walls = walls(cell, n)?;
    starts_inside(setup, cell, &shaft)?;
    let reached = (at(setup.rate) / shaft.speed + at(walls[1].0)).high;
    if above(reached, cell.speed_cap) {
        return Err(Flaw::Speed { cap: cell.speed_cap, reached });
    }

    let pieces = law::pieces(setup, cell, &shaft).map_err(Flaw::Strips)?;
    let mut numbers = HashMap::new();
    for (k, id) in cell.modes.iter().enumerate() {
        numbers.insert(*id, k);
    }
    let mut impossible = HashMap::new();
    for contradiction in &cell.impossible {
        impossible.insert(contradiction.mode as usize, contradiction.weights.as_slice());
    }
    let mut proofs = HashMap::new();
    for proof in &cell.proofs {
        proofs.insert((proof.row as usize, proof.mode as usize), proof.weights.as_slice());
    }
    let counts = if cell.form == Form::Exact {
        let too_fast = || Flaw::Shape("more than a million counts may go by in a tick".to_owned());
        shaft.most_counts().ok_or_else(too_fast)?
    } else {
        0
    };
    let mut programs = 0;
    for piece in &pieces {
        for case in [Case::Slides, Case::LetGo, Case::TouchesAndLeaves, Case::TouchesAndStays] {
            for gone in 0..=counts {
                let id = ModeId { piece: piece.id, case, counts: gone };
                let Some(mode) = Mode::possible(&shaft, piece, cell.form, id, n) else { continue };
                let number = *numbers.get(&id).ok_or(Flaw::Mode(id))?;
                if let Some(weights) = impossible.get(&number) {
                    let proven = combined(cell, &mode, None, weights, &walls)?;
                    if proven < 0.0 {
                        programs += 1;
                        continue;
                    }
                    return Err(Flaw::Possible { mode: number, proven });
                }
                for row in 0..cell.rows.len() {
                    let weights = proofs.get(&(row, number)).ok_or(Flaw::Proof { row, mode: number })?;
                    let next = mode.next(&shaft, &cell.rows[row]);
                    let proven = combined(cell, &mode, Some(next), weights, &walls)?;
                    let radius = cell.radii[row];
                    if above(proven, radius) {
                        return Err(Flaw::Row { row, mode: number, proven, radius });
                    }
                    programs += 1;
                }
            }
        }
    }
    let error = at(walls[0].0.max(walls[0].1)) + at(shaft.bend);
    Ok(((error * shaft.count).high, programs))
}

/// Numbers of the state `(e, ė, z, p₁ … p_d, I, m₋)`, `I` of an integral only.
fn numbers_of_a_row(setup: &Setup) -> usize {
    let integral = if let Gains::Integral { .. } = setup.law { 1 } else { 0 };
    3 + setup.delay_ticks as usize + integral + 1
}

fn shape(cell: &Cell, n: usize) -> Result<(), Flaw> {
    let no = |what: String| Err(Flaw::Shape(what));
    if cell.radii.len() != cell.rows.len() {
        return no(format!(
            "radii: {} numbers: expected one for each of {} rows",
            cell.radii.len(),
            cell.rows.len()
        ));
    }
    if let Some(row) = cell.rows.iter().position(|row| row.len() != n || row.iter().any(|x| !x.is_finite())) {
        return no(format!("rows[{row}]: expected {n} finite numbers"));
    }
    if cell.form == Form::Noise
        && let Some(row) = cell.rows.iter().position(|row| row[n - 1] != 0.0)
    {
        return no(format!("rows[{row}]: the last number of a row is 0 in the noise form"));
    }
    if let Some(row) = cell.radii.iter().position(|r| !r.is_finite()) {
        return no(format!("radii[{row}]: expected a finite number"));
    }
    if !(cell.speed_cap > 0.0 && cell.speed_cap <= 1e4) {
        return no(format!("speed_cap is {}: expected a number above 0, up to 10000", cell.speed_cap));
    }
    if !(cell.slow_exponent > 0.0 && cell.slow_exponent <= 100.0) {
        return no(format!("slow_exponent is {}: expected a number above 0, up to 100", cell.slow_exponent));
    }
    Ok(())
}

/// Bounds of each coordinate in the set, from its own walls: `y ≤ .0` and `−y ≤ .1`. In the noise form the last coordinate is the
/// rounding, 0 to 1.
///
/// The rate stands as `(−s, s)`, so that the first is how far the shaft is faster than the path.
fn walls(cell: &Cell, n: usize) -> Result<Vec<(f64, f64)>, Flaw> {
    let mut walls = vec![(f64::INFINITY, f64::INFINITY); n];
    for (row, r) in cell.rows.iter().zip(&cell.radii) {
        let mut others = row.iter().enumerate().filter(|(_, c)| **c != 0.0);
        let (Some((i, c)), None) = (others.next(), others.next()) else { continue };
        let bound = (at(*r) / at(c.abs())).high;
        let wall = if *c > 0.0 { &mut walls[i].0 } else { &mut walls[i].1 };
        *wall = wall.min(bound);
    }
    if cell.form == Form::Noise {
        walls[n - 1] = (1.0, 0.0);
    }
    walls[1] = (walls[1].1, walls[1].0);
    match walls.iter().position(|(a, b)| !a.is_finite() || !b.is_finite()) {
        Some(i) => Err(Flaw::Wall(i)),
        None => Ok(walls),
    }
}

/// Every state in which a run may begin lies in the set.
fn starts_inside(setup: &Setup, cell: &Cell, shaft: &Shaft) -> Result<(), Flaw> {
    let path = shaft.path;
    // The shaft's velocity may differ so far from the path's by rounding, in either scalar.
    let near = at(1e-6) * (at(1.0) + path);
    let step = Interval { low: -shaft::TARGET_STEP, high: shaft::TARGET_STEP };
    let rate = Interval { low: -near.high, high: if setup.from_rest { path.high } else { near.high } };
    let rounding = Interval { low: 0.0, high: 1.0 };
    let [least, most] = shaft.ends(setup.start_volts);
    let volts = Interval { low: least.low, high: most.high };
    for (k, (row, radius)) in cell.rows.iter().zip(&cell.radii).enumerate() {
        let n = row.len();
        let (ce, cs, cz, cm) = (at(row[0]), at(row[1]), at(row[2]), at(row[n - 1]));
        // z = m₀, m₋ = m₀ − ω_d, m₀ = e + rounding. The first demand is the voltage that the brake has: what m₀ takes from it
        // stands in the integral.
        let ways = 3 + setup.delay_ticks as usize;
        let (mut of_m0, mut rest) = (cz + cm, cs * rate - cm * path);
        if let Gains::Integral { kp, ki, forward, .. } = setup.law {
            let off = Interval { low: -shaft::LAW_ROUNDING, high: shaft::LAW_ROUNDING };
            of_m0 = of_m0 + at(row[ways]) * (at(kp) + at(ki) * at(setup.period_s)) * shaft.count;
            rest = rest + at(row[ways]) * (volts + off - shaft.counted(forward));
        }
        let mut start = (ce + of_m0) * step + of_m0 * rounding + rest;
        for c in &row[3..ways] {
            start = start + at(*c) * volts;
        }
        if above(start.high, *radius) {
            return Err(Flaw::Start { row: k, radius: *radius, start: start.high });
        }
    }
    Ok(())
}

/// The bound that multipliers prove for a sum over the set in a mode; without a sum, for 0, so that a bound below 0 is a
/// contradiction.
fn combined(
    cell: &Cell,
    mode: &Mode,
    sum: Option<mode::Sum>,
    weights: &[(u32, f64)],
    walls: &[(f64, f64)],
) -> Result<f64, Flaw> {
    let mode::Sum { weights: mut left, constant: mut bound } =
        sum.unwrap_or(mode::Sum { weights: vec![at(0.0); walls.len()], constant: at(0.0) });
    for (j, weight) in weights {
        if !(*weight >= 0.0 && weight.is_finite()) {
            return Err(Flaw::Shape(format!(
                "proofs: a weight is {weight}: expected a finite number of at least 0"
            )));
        }
        let (j, weight) = (*j as usize, at(*weight));
        let rows = cell.rows.len();
        if j < rows {
            for (left, c) in left.iter_mut().zip(&cell.rows[j]) {
                *left = *left - weight * at(*c);
            }
            bound = bound + weight * at(cell.radii[j]);
        } else {
            let Some((a, b)) = mode.within.get(j - rows) else {
                return Err(Flaw::Shape(format!("proofs: constraint {j} is named, and there is none")));
            };
            for (left, c) in left.iter_mut().zip(a) {
                *left = *left - weight * *c;
            }
            bound = bound + weight * at(b.high);
        }
    }
    for (k, left) in left.iter().enumerate() {
        let (above, below) = if k == 1 { (walls[1].1, walls[1].0) } else { walls[k] };
        bound = bound + *left * Interval { low: -below, high: above.max(-below) };
    }
    Ok(bound.high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_and_the_volts_of_a_motor_are_numbered_as_the_search_does() {
        let linear = Gains::Linear { kp: 1.0, kd: 1.0, forward: 0.0 };
        let integral =
            Gains::Integral { kp: 1.0, ki: 1.0, kd: 1.0, forward: 0.0, tracking: 0.1, limits: [0.0, 1.0] };
        for (law, delay_ticks, numbers) in
            [(linear, 0, 4), (linear, 3, 7), (integral, 0, 5), (integral, 2, 7)]
        {
            let setup = Setup { delay_ticks, ..Setup::paper(law) };
            assert_eq!((numbers_of_a_row(&setup), setup.dimension()), (numbers, numbers));
        }
        for (highest, before, from) in [(4.0, 0.1, 5.0), (4.1, 0.1, 6.0), (4.0, 5.5, 7.0), (-0.5, -0.2, 1.0)]
        {
            let setup = Setup { volts: [-1.0, highest], start_volts: [-1.0, before], ..Setup::paper(linear) };
            assert_eq!((shaft::counted_from(&setup), setup.counted_from()), (from, from));
        }
    }
}
