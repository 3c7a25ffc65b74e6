//! The search for a set that no tick leaves.
//!
//! `r ← max(r, F(r))` from the initial states on, where `F_i(r)` is the largest that row `i` can be after a tick. Radii grow by a
//! little more than needed, so that the iteration ends; afterwards they shrink, `r_i ← F_i(r)`, and no proof is lost: `F` is
//! monotone.

use crate::coordinates::{E, S};
use crate::modes::{Affine, Mode};
use crate::setup::{Contradiction, Form, Proof};
use crate::simplex::{Constraints, Dual, Program};
use crate::units::Units;

/// Effort of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Share by which a radius grows beyond what is needed.
    pub(crate) growth: f64,
    /// Most sweeps upwards.
    pub(crate) sweeps: usize,
    /// Most sweeps downwards.
    pub(crate) shrinks: usize,
    /// They end where one makes the error smaller by a lesser share than this.
    pub(crate) settled: f64,
    /// Largest error worth looking for, counts.
    pub(crate) error_limit: f64,
    /// Most comparisons of a point with a constraint: about 1e9 a second.
    pub(crate) work: u64,
}

/// The reason that no set was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Open {
    /// The radii passed the limits.
    Grows,
    /// They still grew when the sweeps or the time ended.
    Slow,
}

pub(crate) struct Search<'a, const N: usize> {
    units: &'a Units,
    modes: &'a [Mode<N>],
    set: Constraints<N>,
    /// Radii of the initial states.
    start: Vec<f64>,
    /// By row, then mode.
    duals: Vec<Dual<N>>,
    /// Part of each program's value that no constraint bounds.
    constants: Vec<f64>,
    /// Constraints that programs have compared so far.
    compared: u64,
    /// Sweeps so far.
    swept: usize,
}

/// Margin by which radii hold more than needed, for the rounding of the check.
const MARGIN: f64 = 1e-6;

impl<'a, const N: usize> Search<'a, N> {
    /// `rows` begin with plus and minus each coordinate; `initial` are states whose hull runs begin in.
    pub(crate) fn new(
        units: &'a Units,
        modes: &'a [Mode<N>],
        form: Form,
        rows: &[[f64; N]],
        initial: &[[f64; N]],
    ) -> Self {
        let mut set = Constraints::new();
        let mut start = Vec::new();
        for row in rows {
            let at = |x: &[f64; N]| row.iter().zip(x).map(|(c, x)| c * x).sum::<f64>();
            let r = initial.iter().map(at).fold(f64::NEG_INFINITY, f64::max) + MARGIN;
            set.push(row, r);
            start.push(r);
        }
        let count = rows.len() as u32;
        let mut duals = Vec::new();
        let mut constants = Vec::new();
        for row in rows {
            for mode in modes {
                let next: Affine<N> = mode.next(units, row);
                let mut dual = Dual { basis: [0; N], weights: [0.0; N], ray: None };
                for (i, weight) in next.weights.iter().enumerate() {
                    let minus = u32::from(*weight < 0.0);
                    // The encoder's rounding is bounded by the mode's second and third inequality.
                    let noise = form == Form::Noise && i == N - 1;
                    let j = if noise { count + 1 + minus } else { 2 * i as u32 + minus };
                    let unit = if noise { 1.0 } else { rows[j as usize][i].abs() };
                    dual.basis[i] = j;
                    dual.weights[i] = weight.abs() / unit;
                }
                duals.push(dual);
                constants.push(next.constant);
            }
        }
        Search { units, modes, set, start, duals, constants, compared: 0, swept: 0 }
    }

    /// Bound of a row after a tick in a mode, good enough or best.
    fn bound(&mut self, row: usize, mode: usize, enough: f64) -> f64 {
        let at = row * self.modes.len() + mode;
        let program = Program { set: &self.set, mode: &self.modes[mode].within };
        let (dual, constant) = (&mut self.duals[at], self.constants[at]);
        let quick = program.bound(dual) + constant;
        if quick <= enough {
            return quick;
        }
        let c = self.modes[mode].next(self.units, &self.set.row(row)).weights;
        program.improve(&c, dual, enough - constant, &mut self.compared) + constant
    }

    /// Lets each radius grow to what a tick needs; `true` if none had to.
    fn grow(&mut self, growth: f64) -> bool {
        let mut closed = true;
        self.swept += 1;
        for row in (0..self.set.len()).rev() {
            for mode in 0..self.modes.len() {
                let now = self.set.rhs[row];
                let bound = self.bound(row, mode, now - 0.5 * MARGIN);
                if bound > now - 0.5 * MARGIN {
                    closed = false;
                    self.set.rhs[row] = bound + growth * (bound.abs() + 0.02) + MARGIN;
                }
            }
        }
        closed
    }

    /// Lets each radius shrink to what a tick needs.
    fn shrink(&mut self) {
        for row in (0..self.set.len()).rev() {
            let mut needed = self.start[row];
            for mode in 0..self.modes.len() {
                let bound = self.bound(row, mode, needed);
                needed = needed.max(bound + MARGIN);
            }
            self.set.rhs[row] = self.set.rhs[row].min(needed);
        }
    }

    /// Searches; `Ok` if the radii prove themselves.
    pub(crate) fn run(&mut self, effort: &Effort) -> Result<(), Open> {
        let mut closed = false;
        for _ in 0..effort.sweeps {
            let share = (1e-6 * 1.15_f64.powi(self.swept as i32)).min(1.0);
            closed = self.grow(effort.growth * share);
            if closed {
                break;
            }
            if self.error() > effort.error_limit || !self.error().is_finite() {
                return Err(Open::Grows);
            }
            if self.compared > effort.work {
                return Err(Open::Slow);
            }
        }
        if !closed {
            return Err(Open::Slow);
        }
        let mut error = self.error();
        for _ in 0..effort.shrinks {
            self.shrink();
            let less = self.error();
            if less > error * (1.0 - effort.settled) || self.compared > 2 * effort.work {
                break;
            }
            error = less;
        }
        Ok(())
    }

    fn radius(&self, coordinate: usize, minus: usize) -> f64 {
        let row = 2 * coordinate + minus;
        self.set.rhs[row] / self.set.row(row)[coordinate].abs()
    }

    /// Bound on `|e|` at samples, counts.
    pub(crate) fn error(&self) -> f64 {
        self.radius(E, 0).max(self.radius(E, 1))
    }

    /// Largest speed at samples, counts per tick.
    pub(crate) fn speed(&self) -> f64 {
        self.units.path + self.radius(S, 1)
    }

    pub(crate) fn radii(&self) -> &[f64] {
        &self.set.rhs
    }

    /// Modes that cannot happen, with what shows it.
    fn impossible(&self, mode: usize) -> Option<Contradiction> {
        let program = Program { set: &self.set, mode: &self.modes[mode].within };
        // The row's ray that contradicts itself most, for its size.
        let rays = (0..self.set.len())
            .filter_map(|row| program.contradiction(&self.duals[row * self.modes.len() + mode]));
        let (by, weights) = rays.max_by(|a, b| a.0.total_cmp(&b.0))?;
        (by > 1e2 * MARGIN)
            .then(|| Contradiction { mode: mode as u32, weights: weights.into_iter().map(short).collect() })
    }

    /// Modes that cannot happen, and multipliers of each row in each of the others: each bound at most its row's radius.
    pub(crate) fn proofs(&mut self) -> (Vec<Contradiction>, Vec<Proof>) {
        for row in 0..self.set.len() {
            for mode in 0..self.modes.len() {
                let radius = self.set.rhs[row];
                self.bound(row, mode, radius - 0.5 * MARGIN);
            }
        }
        let impossible: Vec<Option<Contradiction>> =
            (0..self.modes.len()).map(|mode| self.impossible(mode)).collect();
        let mut out = Vec::new();
        for row in 0..self.set.len() {
            for mode in (0..self.modes.len()).filter(|mode| impossible[*mode].is_none()) {
                let at = row * self.modes.len() + mode;
                let program = Program { set: &self.set, mode: &self.modes[mode].within };
                let enough = self.set.rhs[row] - self.constants[at];
                out.push(Proof {
                    row: row as u32,
                    mode: mode as u32,
                    weights: program
                        .weights(&self.duals[at], enough - 0.5 * MARGIN)
                        .into_iter()
                        .map(short)
                        .collect(),
                });
            }
        }
        (impossible.into_iter().flatten().collect(), out)
    }
}

/// A weight with as many digits as a proof needs.
fn short((j, weight): (u32, f64)) -> (u32, f64) {
    (j, format!("{weight:.10e}").parse().unwrap_or(weight))
}
