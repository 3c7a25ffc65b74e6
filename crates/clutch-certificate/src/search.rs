//! A certificate for a box: cells of `μ_d`, and for each a set that no tick leaves.

use crate::invariant::{Effort, Open, Search};
use crate::modes::{E, Mode, P, S, Z, modes};
use crate::pieces::{pieces, strips};
use crate::rows::{Fineness, rows};
use crate::setup::{Cell, Certificate, Ends, Form, Gains, Proof, Setup, VERSION};
use crate::units::{TARGET_STEP, Units};

/// Effort of a certificate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Widest cell: largest `μ_d` over smallest.
    pub widest: f64,
    /// Narrowest cell that is still split.
    pub narrowest: f64,
    /// Largest error worth proving, rad.
    pub error_limit: f64,
    /// Most comparisons of a point with a constraint per attempt, about 1e9 a second.
    pub work: u64,
}

impl Default for Options {
    fn default() -> Self {
        Options { widest: 1.16, narrowest: 1.04, error_limit: 2.0_f64.to_radians(), work: 4_000_000_000 }
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
    Found { certificate, open }
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

/// Forms and finenesses in the order in which they are tried.
fn attempts(law: &Gains) -> Vec<(Form, Fineness, f64)> {
    let (quick, fine) = (Fineness { steps: 16, apart: 0.05 }, Fineness { steps: 30, apart: 0.025 });
    match law {
        Gains::Pd { .. } => vec![
            (Form::Noise, quick, 0.003),
            (Form::Exact, quick, 0.003),
            (Form::Exact, fine, 0.001),
        ],
        Gains::Smc { .. } => vec![(Form::Noise, quick, 0.003), (Form::Noise, fine, 0.001)],
    }
}

fn cell(setup: &Setup, sliding: Ends, options: &Options) -> Result<Cell, Open> {
    let mut last = Open::Grows;
    if let Ok(t) = std::env::var("CERT_TRY") {
        let v: Vec<f64> = t.split(',').map(|x| x.parse().unwrap()).collect();
        let form = if v[0] == 0.0 { Form::Noise } else { Form::Exact };
        return attempt(setup, sliding, form, Fineness { steps: v[1] as usize, apart: v[2] }, v[3], options);
    }
    for (form, fineness, growth) in attempts(&setup.law) {
        let tried = attempt(setup, sliding, form, fineness, growth, options);
        match tried {
            Ok(cell) => return Ok(cell),
            Err(why) => last = why,
        }
    }
    Err(last)
}

/// One attempt, with one form and fineness.
pub(crate) fn attempt(
    setup: &Setup,
    sliding: Ends,
    form: Form,
    fineness: Fineness,
    growth: f64,
    options: &Options,
) -> Result<Cell, Open> {
    let tried = |f: &dyn Fn(f64) -> Result<Cell, (Open, f64)>| {
        let units = Units::new(setup, sliding, 0.0);
        let mut cap = 1.3 * units.path + 0.8;
        for _ in 0..3 {
            match f(cap) {
                Err((Open::Slow, speed)) if speed > cap => cap = 1.1 * speed,
                other => return other.map_err(|(why, _)| why),
            }
        }
        Err(Open::Grows)
    };
    let parts = Parts { setup, sliding, form, fineness, growth, options };
    tried(&|cap| match 4 + setup.delay_ticks {
        4 => with_cap::<4>(&parts, cap),
        5 => with_cap::<5>(&parts, cap),
        6 => with_cap::<6>(&parts, cap),
        7 => with_cap::<7>(&parts, cap),
        _ => Err((Open::Slow, 0.0)),
    })
}

struct Parts<'a> {
    setup: &'a Setup,
    sliding: Ends,
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
                for volts in setup.start_volts {
                    let mut x = [0.0; N];
                    (x[E], x[S], x[Z]) = (e, s, e + rounding);
                    for p in &mut x[P..P + u.delay] {
                        *p = volts;
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

/// A set for shafts that are no faster than a speed; `Slow` with the speed found if they are.
fn with_cap<const N: usize>(p: &Parts<'_>, cap: f64) -> Result<Cell, (Open, f64)> {
    let u = Units::new(p.setup, p.sliding, cap);
    if u.drive[0] <= 0.0 {
        return Err((Open::Grows, 0.0));
    }
    let strips = strips(&p.setup.law, u.volts);
    let most_counts = (cap + u.drive[1] + u.slow).ceil() as u32;
    let modes: Vec<Mode<N>> = modes(&u, &pieces(&u, &strips), p.form, most_counts);
    let rows = rows::<N>(&u, p.form, p.fineness);
    let mut search = Search::new(&u, &modes, p.form, &rows, &initial(p.setup, &u, p.form));
    let effort = Effort {
        growth: p.growth,
        sweeps: 400,
        shrinks: 40,
        error_limit: p.options.error_limit / u.count,
        work: p.options.work,
    };
    let result = search.run(&effort);
    if std::env::var_os("CERT_TRACE").is_some() {
        eprintln!(
            "  {:?} {:?} rows {} modes {} sweeps {} work {:.2e} -> {:?} {:.4}",
            p.sliding, p.form, rows.len(), modes.len(), search.swept, search.work() as f64, result,
            (search.error() * u.count).to_degrees()
        );
    }
    result.map_err(|why| (why, 0.0))?;
    if search.speed() > cap {
        return Err((Open::Slow, search.speed()));
    }
    // Between samples a shaft departs from the line through its ends by at most an eighth of its acceleration.
    let bend = u.drive[1].max(u.brake_any[1] * (u.volts[1] + u.volts_off) - u.drive[0]) / 8.0;
    let error = search.error() + bend;
    let proofs = search.proofs();
    let own = if p.form == Form::Exact { 2 * N } else { 2 * N - 2 };
    let (rows, radii, proofs) = needed(&rows, search.radii(), proofs, own);
    Ok(Cell {
        sliding: p.sliding,
        form: p.form,
        speed_cap: cap,
        strips,
        modes: modes.iter().map(|m| m.id).collect(),
        rows,
        radii,
        proofs,
        error_bound: error * u.count,
    })
}

/// The rows that the proofs of the state's own rows need, and their proofs.
fn needed<const N: usize>(
    rows: &[[f64; N]],
    radii: &[f64],
    proofs: Vec<Proof>,
    own: usize,
) -> (Vec<Vec<f64>>, Vec<f64>, Vec<Proof>) {
    let count = rows.len();
    let mut wanted = vec![false; count];
    wanted.iter_mut().take(own).for_each(|w| *w = true);
    loop {
        let mut more = false;
        for proof in proofs.iter().filter(|p| wanted[p.row as usize]).collect::<Vec<_>>() {
            for (j, _) in &proof.weights {
                if let Some(w) = wanted.get_mut(*j as usize) {
                    more |= !*w;
                    *w = true;
                }
            }
        }
        if !more {
            break;
        }
    }
    let mut number = vec![0; count];
    let mut next = 0;
    for (n, wanted) in number.iter_mut().zip(&wanted) {
        *n = next;
        next += u32::from(*wanted);
    }
    let kept = |j: u32| number.get(j as usize).map_or(j - count as u32 + next, |n| *n);
    let pick = |k: &usize| wanted[*k];
    let proofs = proofs
        .into_iter()
        .filter(|p| wanted[p.row as usize])
        .map(|p| Proof {
            row: kept(p.row),
            mode: p.mode,
            weights: p.weights.into_iter().map(|(j, w)| (kept(j), w)).collect(),
        })
        .collect();
    (
        (0..count).filter(pick).map(|k| rows[k].to_vec()).collect(),
        (0..count).filter(pick).map(|k| radii[k]).collect(),
        proofs,
    )
}
