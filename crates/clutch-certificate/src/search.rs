//! A certificate for a box: cells of `μ_d`, and for each a set that no tick leaves.

use crate::checker;
use crate::coordinates::{E, P, S, Z};
use crate::invariant::{Effort, Open, Search};
use crate::modes::{Mode, modes};
use crate::pieces::{pieces, strips};
use crate::rows::{Fineness, rows};
use crate::setup::{Cell, Certificate, Contradiction, Ends, Form, Gains, Proof, Setup, USUAL_END, VERSION};
use crate::units::{LAW_ROUNDING, TARGET_STEP, Units};

/// Effort of a certificate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Widest cell: largest `μ_d` over smallest.
    pub widest: f64,
    /// Narrowest cell that is still split.
    pub narrowest: f64,
    /// Largest error worth proving, rad.
    pub error_limit: f64,
    /// Times that the cell with the largest bound is split, in the hope of a smaller one.
    pub refinements: usize,
    /// Most comparisons of a point with a constraint per attempt, about 1e9 a second; of an integral six times as many.
    pub work: u64,
    /// Looks on with finer directions: `false` leaves it at the coarse ones, of shells and of an integral, which take seconds
    /// and give a looser bound.
    pub patient: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            widest: 1.16,
            narrowest: 1.06,
            error_limit: 2.0_f64.to_radians(),
            refinements: 2,
            work: 1_000_000_000,
            patient: true,
        }
    }
}

/// A cell for which no set was found: not certified, and not shown unsafe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenCell {
    /// Its `μ_d`.
    pub sliding: Ends,
    /// `true` if the radii grew beyond all limits, `false` if the search ran out of patience.
    pub grew: bool,
}

/// Outcome of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The cells that are proven: a certificate of the whole box if none is open.
    pub certificate: Certificate,
    /// Cells without proof.
    pub open: Vec<OpenCell>,
}

impl Found {
    /// Every cell is proven.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.open.is_empty()
    }
}

/// Searches cell by cell; ends at the first that stays open, unless `all` is asked for.
#[must_use]
pub fn search(setup: &Setup, options: &Options, all: bool) -> Found {
    let mut certificate = Certificate { version: VERSION, setup: setup.clone(), cells: Vec::new() };
    let mut open = Vec::new();
    let mut waiting = split(setup.sliding, options.widest);
    waiting.reverse();
    while let Some(sliding) = waiting.pop() {
        match cell(setup, sliding, options) {
            Ok(cell) => certificate.cells.push(cell),
            Err(_) if sliding[1] / sliding[0] > options.narrowest => {
                let middle = (sliding[0] * sliding[1]).sqrt();
                waiting.extend([[middle, sliding[1]], [sliding[0], middle]]);
            }
            Err(why) => {
                open.push(OpenCell { sliding, grew: why == Open::Grows });
                if !all {
                    break;
                }
            }
        }
    }
    if open.is_empty() {
        for _ in 0..options.refinements {
            if !refine(&mut certificate, options) {
                break;
            }
        }
    }
    Found { certificate, open }
}

/// Halves the cell with the largest bound; `false` if that does not make it smaller.
fn refine(certificate: &mut Certificate, options: &Options) -> bool {
    let Certificate { setup, cells, .. } = certificate;
    let Some(worst) = (0..cells.len()).max_by(|a, b| cells[*a].error_bound.total_cmp(&cells[*b].error_bound))
    else {
        return false;
    };
    let [low, high] = cells[worst].sliding;
    if high / low <= options.narrowest {
        return false;
    }
    let middle = (low * high).sqrt();
    let (Ok(lower), Ok(upper)) = (cell(setup, [low, middle], options), cell(setup, [middle, high], options))
    else {
        return false;
    };
    let smaller = lower.error_bound.max(upper.error_bound) < 0.98 * cells[worst].error_bound;
    if smaller {
        cells.splice(worst..=worst, [lower, upper]);
    }
    smaller
}

/// Equal shares of an interval, none wider than asked.
fn split([low, high]: Ends, widest: f64) -> Vec<Ends> {
    let count = (libm::log(high / low) / libm::log(widest)).ceil().max(1.0);
    let edge = |k: f64| low * libm::pow(high / low, k / count);
    (0..count as u32)
        .map(|k| {
            let k = f64::from(k);
            [if k == 0.0 { low } else { edge(k) }, if k + 1.0 >= count { high } else { edge(k + 1.0) }]
        })
        .collect()
}

/// Fineness of the directions, and share by which radii grow, from quick to patient.
const QUICK: (Fineness, f64) = (Fineness { steps: 16, apart: 0.05, spread: 1.0, saturated: false }, 0.001);
const USUAL: (Fineness, f64) = (Fineness { steps: 30, apart: 0.03, spread: 1.0, saturated: false }, 0.001);
const LONG: (Fineness, f64) = (Fineness { steps: 60, apart: 0.02, spread: 1.0, saturated: false }, 0.0003);
/// For an integral, which takes a hundred ticks.
const SLOW: (Fineness, f64) = (Fineness { steps: 120, apart: 0.012, spread: 1.0, saturated: false }, 0.0003);
const PATIENT: (Fineness, f64) = (Fineness { steps: 40, apart: 0.02, spread: 1.0, saturated: false }, 0.0001);

/// Where a count asks for several times the output, so that the loop is at one limit or the other in most ticks.
const SATURATED: (Fineness, f64) = (Fineness { steps: 30, apart: 0.04, spread: 1.0, saturated: true }, 0.001);
const SATURATED_SMC: (Fineness, f64) =
    (Fineness { steps: 30, apart: 0.03, spread: 1.0, saturated: true }, 0.001);

/// For shells: few directions, of brakes far apart, which a voltage of any size asks for.
const COARSE: (Fineness, f64) = (Fineness { steps: 30, apart: 0.1, spread: 1.4, saturated: false }, 0.001);

/// Counts by which a bound may be above the steady error with the weakest brake, before directions of a saturated loop are
/// tried, too.
const USUAL_COUNTS: f64 = 4.0;

/// The attempt that is worth its time where a bound is far above the steady error.
fn second(setup: &Setup, bound: f64) -> Option<(Form, (Fineness, f64))> {
    let u = Units::new(setup, setup.sliding, USUAL_END, 0.0);
    let count = u.count;
    let holds = match &setup.motor {
        Some(motor) => {
            let torque = setup.sliding[1] * motor.preload - setup.drive_torque[0];
            setup.counted_from() - torque / motor.gain[0]
        }
        None => setup.drive_torque[1] / (setup.sliding[0] * setup.brake_gain[0]),
    };
    let (attempt, steady) = match u.law {
        Gains::Linear { kp, forward, .. } => ((Form::Exact, SATURATED), (holds - forward).abs() / kp),
        Gains::Layer { kp, slope, boundary, .. } => {
            ((Form::Noise, SATURATED_SMC), holds * boundary / (kp * slope))
        }
        Gains::Integral { .. } | Gains::Shell { .. } => return None,
    };
    (bound > steady + USUAL_COUNTS * count).then_some(attempt)
}

/// The best of the first attempts, or the first of the later ones that is proven.
fn cell(setup: &Setup, sliding: Ends, options: &Options) -> Result<Cell, Open> {
    let (first, later): (&[_], &[_]) = match setup.law {
        Gains::Shell { .. } if !options.patient => (&[(Form::Exact, COARSE)], &[]),
        Gains::Shell { .. } => (&[(Form::Exact, COARSE), (Form::Exact, USUAL)], &[(Form::Exact, PATIENT)]),
        Gains::Integral { .. } if !options.patient => (&[(Form::Noise, LONG)], &[(Form::Exact, USUAL)]),
        Gains::Integral { .. } => (&[(Form::Noise, SLOW), (Form::Exact, USUAL)], &[(Form::Exact, PATIENT)]),
        Gains::Linear { .. } => (&[(Form::Noise, LONG), (Form::Exact, USUAL)], &[(Form::Exact, PATIENT)]),
        // (31) has hundreds of modes, times the counts of the exact form.
        Gains::Layer { .. } => (&[(Form::Noise, QUICK), (Form::Noise, USUAL)], &[(Form::Noise, PATIENT)]),
    };
    let slow = setup.slow_exponents();
    let quick = slow[0];
    let slow = if options.patient { &slow[..] } else { &slow[..1] };
    let tried = |slow: f64, (form, (fineness, growth)): (Form, (Fineness, f64))| {
        let cell = attempt(&Parts { setup, sliding, slow, form, fineness, growth, options })?;
        // A cell that rounding has spoilt proves nothing.
        let alone =
            Certificate { version: VERSION, setup: Setup { sliding, ..setup.clone() }, cells: vec![cell] };
        if checker::check(&alone).is_err() {
            return Err(Open::Slow);
        }
        alone.cells.into_iter().next().ok_or(Open::Slow)
    };
    let mut open = Open::Slow;
    let mut best: Option<Cell> = None;
    for (slow, how) in slow.iter().flat_map(|slow| first.iter().map(move |how| (*slow, *how))) {
        match tried(slow, how) {
            Ok(cell) if best.as_ref().is_none_or(|best| cell.error_bound < best.error_bound) => {
                best = Some(cell)
            }
            Ok(_) => {}
            Err(why) => open = why,
        }
    }
    if let Some(best) = best {
        let again = second(setup, best.error_bound).map(|how| tried(quick, how));
        return Ok(match again {
            Some(Ok(cell)) if cell.error_bound < best.error_bound => cell,
            _ => best,
        });
    }
    for how in later {
        match tried(quick, *how) {
            Ok(cell) => return Ok(cell),
            Err(why) => open = why,
        }
    }
    Err(open)
}

/// Speed limits that are tried in an attempt, each above the speed that the last one's set has.
const CAPS: usize = 5;

/// Speed above the path's that a set is first looked for with, counts per period: a count in a period is an edge more, and under a fine
/// encoder, or in a long period, the same motion makes many.
fn beyond_path(setup: &Setup) -> f64 {
    0.8 * (f64::from(setup.counts_per_rev) / 20_000.0 * setup.period_s / 1e-3).max(1.0)
}

/// One attempt.
fn attempt(parts: &Parts<'_>) -> Result<Cell, Open> {
    let tried = |f: &dyn Fn(f64) -> Result<Cell, (Open, f64)>| {
        let units = Units::new(parts.setup, parts.sliding, parts.slow, 0.0);
        let mut cap = 1.3 * units.path + beyond_path(parts.setup);
        for _ in 0..CAPS {
            match f(cap) {
                Err((Open::Slow, speed)) if speed > cap => cap = 1.1 * speed,
                other => return other.map_err(|(why, _)| why),
            }
        }
        Err(Open::Grows)
    };
    tried(&|cap| match parts.setup.dimension() {
        4 => with_cap::<4>(parts, cap),
        5 => with_cap::<5>(parts, cap),
        6 => with_cap::<6>(parts, cap),
        7 => with_cap::<7>(parts, cap),
        8 => with_cap::<8>(parts, cap),
        _ => Err((Open::Slow, 0.0)),
    })
}

/// The ingredients of an attempt: a part of the box, an end of slow speeds, and form and fineness of the set.
struct Parts<'a> {
    setup: &'a Setup,
    sliding: Ends,
    slow: f64,
    form: Form,
    fineness: Fineness,
    growth: f64,
    options: &'a Options,
}

/// States whose hull runs begin in.
fn initial<const N: usize>(setup: &Setup, u: &Units, form: Form) -> Vec<[f64; N]> {
    let near = 1e-6 * (1.0 + u.path);
    let rates = [-near, if setup.from_rest { u.path } else { near }];
    let mut out = Vec::new();
    for e in [-TARGET_STEP, TARGET_STEP] {
        for s in rates {
            for rounding in [0.0, 1.0] {
                for (volts, off) in u.start_volts.into_iter().zip([-LAW_ROUNDING, LAW_ROUNDING]) {
                    let mut x = [0.0; N];
                    (x[E], x[S], x[Z]) = (e, s, e + rounding);
                    for p in &mut x[P..P + u.delay] {
                        *p = volts;
                    }
                    if let (Some(i), Gains::Integral { kp, ki, forward, .. }) = (u.memory(), u.law) {
                        // A start without a jump: the first demand is the voltage that the brake has.
                        x[i] = volts + off - forward + (kp + ki * u.period) * u.count * (e + rounding);
                    }
                    // No count has gone by before the first sample.
                    x[N - 1] = if form == Form::Exact { e + rounding - u.path } else { 0.0 };
                    out.push(x);
                }
            }
        }
    }
    out
}

/// Error beyond which a set is no more looked for, counts: several times the steady one and what a few counts make.
fn hopeless(u: &Units) -> f64 {
    let volts_per_count = match u.law {
        Gains::Linear { kp, .. } | Gains::Integral { kp, .. } => kp * u.count,
        Gains::Layer { kp, slope, boundary, .. } => kp * slope / boundary * u.count,
        // A law within a shell takes a wider set for its worst.
        Gains::Shell { slope, boundary } => u.volts[1] * slope / (6.0 * boundary) * u.count,
    };
    12.0 + 6.0 * u.drive[1] / u.brake[0] / volts_per_count.max(1e-6)
}

/// A set for shafts that are no faster than a speed; `Slow` with the speed found if they are.
fn with_cap<const N: usize>(p: &Parts<'_>, cap: f64) -> Result<Cell, (Open, f64)> {
    let u = Units::new(p.setup, p.sliding, p.slow, cap);
    if u.drive[0] <= 0.0 {
        return Err((Open::Grows, 0.0));
    }
    let strips = strips(&p.setup.law, u.volts);
    let fastest = u.drive[1].max(u.drive_any[1]);
    let most_counts = (cap + fastest + u.slow).ceil() as u32;
    let modes: Vec<Mode<N>> = modes(&u, &pieces(&u, &strips), p.form, most_counts);
    let rows = rows::<N>(&u, p.form, p.fineness);
    let mut search = Search::new(&u, &modes, p.form, &rows, &initial(p.setup, &u, p.form));
    // A set of a slow loop grows and shrinks by as little per tick as the loop does.
    let (sweeps, shrinks, settled, work) = match p.setup.law {
        Gains::Integral { .. } => (1500, 400, 1e-5, 6 * p.options.work),
        Gains::Shell { .. } => (600, 40, 1e-4, p.options.work),
        // Four times the directions, and hundreds of modes.
        Gains::Layer { .. } if p.fineness.saturated => (300, 40, 1e-4, 8 * p.options.work),
        Gains::Linear { .. } | Gains::Layer { .. } => (300, 40, 1e-4, p.options.work),
    };
    let effort = Effort {
        growth: p.growth,
        sweeps,
        shrinks,
        settled,
        error_limit: (p.options.error_limit / u.count).min(hopeless(&u)),
        work,
    };
    let result = search.run(&effort);
    result.map_err(|why| (why, 0.0))?;
    if search.speed() > cap {
        return Err((Open::Slow, search.speed()));
    }
    // Between samples a shaft departs from the line through its ends by at most an eighth of its acceleration.
    let bend = fastest.max(u.brake_any[1] * u.most_volts - u.drive_any[0]) / 8.0;
    let error = search.error() + bend;
    let (impossible, proofs) = search.proofs();
    let own = if p.form == Form::Exact { 2 * N } else { 2 * N - 2 };
    let kept = Kept::new(rows.len(), &impossible, &proofs, own);
    Ok(Cell {
        sliding: p.sliding,
        form: p.form,
        speed_cap: cap,
        slow_exponent: p.slow,
        strips,
        modes: modes.iter().map(|m| m.id).collect(),
        rows: kept.pick(&rows).map(|row| row.to_vec()).collect(),
        radii: kept.pick(search.radii()).copied().collect(),
        impossible: impossible
            .into_iter()
            .map(|c| Contradiction { weights: kept.renumbered(c.weights), ..c })
            .collect(),
        proofs: proofs
            .into_iter()
            .filter(|p| kept.wanted[p.row as usize])
            .map(|p| Proof { row: kept.number[p.row as usize], weights: kept.renumbered(p.weights), ..p })
            .collect(),
        error_bound: error * u.count,
    })
}

/// The rows that the proofs of the state's own rows need, and their numbers among themselves.
struct Kept {
    wanted: Vec<bool>,
    number: Vec<u32>,
    count: u32,
}

impl Kept {
    fn new(rows: usize, impossible: &[Contradiction], proofs: &[Proof], own: usize) -> Kept {
        let mut wanted = vec![false; rows];
        wanted.iter_mut().take(own).for_each(|w| *w = true);
        let want = |wanted: &mut Vec<bool>, weights: &[(u32, f64)]| {
            let mut more = false;
            for (j, _) in weights {
                if let Some(w) = wanted.get_mut(*j as usize) {
                    more |= !*w;
                    *w = true;
                }
            }
            more
        };
        for c in impossible {
            want(&mut wanted, &c.weights);
        }
        let mut more = true;
        while more {
            more = false;
            for proof in proofs {
                if wanted[proof.row as usize] {
                    more |= want(&mut wanted, &proof.weights);
                }
            }
        }
        let mut count = 0;
        let number = wanted
            .iter()
            .map(|wanted| {
                count += u32::from(*wanted);
                count - u32::from(*wanted)
            })
            .collect();
        Kept { wanted, number, count }
    }

    fn pick<'a, T>(&'a self, all: &'a [T]) -> impl Iterator<Item = &'a T> {
        all.iter().zip(&self.wanted).filter(|(_, wanted)| **wanted).map(|(x, _)| x)
    }

    /// The mode's constraints follow the rows.
    fn renumbered(&self, weights: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
        let rows = self.number.len() as u32;
        let number = |j: u32| self.number.get(j as usize).map_or_else(|| j - rows + self.count, |n| *n);
        weights.into_iter().map(|(j, w)| (number(j), w)).collect()
    }
}
