//! The paper's figures 8 to 10, its Table 3, and each statement of its section 4 held against
//! what comes out here.
//!
//! "Simulation" runs on the rig `paper`, "experiment" on the rig `bench`, a stand-in that was
//! fitted to some of these statements: [`Claim::fitted`] says to which. Ten seeds each, 5 s of
//! which the first second does not count.

use crate::metrics::Metrics;
use crate::progress::{Progress, Report};
use crate::rig::RigParams;
use crate::run::{RunError, RunSpec, simulate};
use clutch_core::PlantParams;
use clutch_core::law::{CtcParams, LawParams, PdParams, SmcParams};
use clutch_core::reference::ReferenceParams;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Seeds of every run.
pub const SEEDS: [u64; 10] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10];
/// Table 3: rate in °/s, reduction in per cent.
pub const TABLE3: [(f64, f64); 3] = [(10.0, 88.6), (6.0, 88.9), (2.0, 83.8)];
/// One encoder count, °.
const RESOLUTION_DEG: f64 = 0.018;

/// One statement of the paper and what comes out here.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// Short name, stable from version to version.
    pub id: &'static str,
    /// What the paper states, with its value.
    pub paper: &'static str,
    /// What came out.
    pub measured: f64,
    /// Unit of `measured` and `band`.
    pub unit: &'static str,
    /// Interval in which `measured` counts as agreeing with the statement; none = unbounded.
    pub band: [Option<f64>; 2],
    /// Whether the statement holds.
    pub holds: bool,
    /// Interval in which `measured` lies where the statement is known not to hold; the docs say
    /// why. None = the statement is expected to hold.
    pub deviation: Option<[f64; 2]>,
    /// Whether the rig `bench` was fitted to this statement.
    pub fitted: bool,
    /// How it was measured; why it does not hold, if it does not.
    pub note: &'static str,
}

impl Claim {
    /// The statement holds, or it fails just as documented.
    #[must_use]
    pub fn as_expected(&self) -> bool {
        match self.deviation {
            None => self.holds,
            Some([low, high]) => !self.holds && self.measured >= low && self.measured <= high,
        }
    }
}

/// The three laws of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PaperLaw {
    /// (4)
    Pd,
    /// (11)
    Ctc,
    /// (31)
    Smc,
}

impl PaperLaw {
    /// With the gains of Table 2.
    #[must_use]
    pub fn params(self) -> LawParams {
        match self {
            PaperLaw::Pd => LawParams::Pd(PdParams::default()),
            PaperLaw::Ctc => LawParams::Ctc(CtcParams::default()),
            PaperLaw::Smc => LawParams::Smc(SmcParams::default()),
        }
    }

    /// As the paper calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            PaperLaw::Pd => "PD controller",
            PaperLaw::Ctc => "computed-torque controller",
            PaperLaw::Smc => "sliding-mode controller",
        }
    }
}

/// The two columns of each figure, and the check on what CTC could do if friction were known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Column {
    Simulation,
    Experiment,
    /// The bench's friction, even along the disc and known to the law.
    KnownFriction,
}

/// One panel of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelData {
    /// Rate of the ramp, °/s.
    pub rate_deg_s: f64,
    /// Whether it is the experiment's column.
    pub experiment: bool,
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Position error, °.
    pub error_deg: Vec<f64>,
}

/// One of the paper's figures: panels by rows, simulation left and experiment right.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureData {
    /// Its number in the paper.
    pub number: u32,
    /// The law.
    pub law: PaperLaw,
    /// The panels.
    pub panels: Vec<PanelData>,
}

/// One row of Table 3.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table3Row {
    /// Rate, °/s.
    pub rate_deg_s: f64,
    /// Stick-slip cycles per second under PD, mean of the seeds.
    pub pd_cycles_per_s: f64,
    /// The same under SMC.
    pub smc_cycles_per_s: f64,
    /// Reduction, per cent: `100 (1 − SMC/PD)` of the means.
    pub reduction_percent: f64,
    /// Standard deviation of the reduction from seed to seed, percentage points.
    pub spread_points: f64,
    /// The paper's.
    pub paper_percent: f64,
}

/// Everything that `clutch reproduce` shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Figures 8, 9, 10.
    pub figures: Vec<FigureData>,
    /// Table 3.
    pub table3: Vec<Table3Row>,
    /// Claims.
    pub claims: Vec<Claim>,
}

fn spec(column: Column, law: PaperLaw, rate_deg_s: f64, seed: u64) -> RunSpec<'static> {
    let bench = RigParams::bench();
    let rig = match column {
        Column::Simulation => RigParams::paper(),
        Column::Experiment => bench.clone(),
        Column::KnownFriction => RigParams { ripple: None, delay_ticks: 0, ..bench.clone() },
    };
    let mut spec = RunSpec::new(rig, law.params(), ReferenceParams::ramp(rate_deg_s.to_radians()));
    if column == Column::KnownFriction {
        spec.model = known_model(&bench);
    }
    spec.run.seed = seed;
    spec
}

/// The bench's plant as a law would know it after a perfect measurement.
fn known_model(bench: &RigParams) -> PlantParams {
    let friction = bench.friction;
    let drive = crate::drive::Drive::new(&bench.drive, 0).map_or(0.0, |d| d.torque(0.0, 0.0));
    PlantParams {
        inertia: bench.inertia,
        drive_torque: drive,
        viscous_damping: bench.viscous_damping,
        brake_gain: bench.gain().unwrap_or(f64::NAN),
        friction,
    }
}

const FIGURES: [(u32, PaperLaw, &[f64]); 3] = [
    (8, PaperLaw::Pd, &[100.0, 20.0, 2.0]),
    (9, PaperLaw::Ctc, &[20.0, 2.0]),
    (10, PaperLaw::Smc, &[20.0, 6.0, 2.0]),
];

const RUNS: [(Column, PaperLaw, &[f64]); 7] = [
    (Column::Simulation, PaperLaw::Pd, &[100.0, 20.0, 10.0, 6.0, 2.0]),
    (Column::Simulation, PaperLaw::Ctc, &[100.0, 50.0, 20.0, 10.0, 6.0, 4.0, 2.0]),
    (Column::Simulation, PaperLaw::Smc, &[20.0, 6.0, 2.0]),
    (Column::Experiment, PaperLaw::Pd, &[100.0, 20.0, 15.0, 10.0, 6.0, 2.0]),
    (Column::Experiment, PaperLaw::Ctc, &[20.0, 15.0, 10.0, 6.0, 2.0]),
    (Column::Experiment, PaperLaw::Smc, &[20.0, 10.0, 6.0, 2.0]),
    (Column::KnownFriction, PaperLaw::Ctc, &[20.0, 2.0]),
];

/// Metrics by what ran, one per seed. The rate is in thousandths of a °/s, to be a key.
struct Measured(BTreeMap<(Column, PaperLaw, u64), Vec<Metrics>>);

impl Measured {
    fn each(&self, column: Column, law: PaperLaw, rate: f64) -> &[Metrics] {
        self.0.get(&(column, law, key(rate))).map_or(&[], Vec::as_slice)
    }

    fn over<'a>(
        &'a self,
        column: Column,
        law: PaperLaw,
        rates: &'a [f64],
    ) -> impl Iterator<Item = &'a Metrics> + 'a {
        rates.iter().flat_map(move |r| self.each(column, law, *r))
    }

    /// Mean of the cycles per second over the seeds.
    fn cycles(&self, column: Column, law: PaperLaw, rate: f64) -> f64 {
        mean(self.each(column, law, rate).iter().map(|m| m.stick_slip_cycles_per_s))
    }

    fn most_cycles(&self, column: Column, law: PaperLaw, rates: &[f64]) -> f64 {
        most(self.over(column, law, rates).map(|m| m.stick_slip_cycles_per_s))
    }

    /// Least of the means: how often the shaft sticks at the rate where it does so least.
    fn least_cycles(&self, column: Column, law: PaperLaw, rates: &[f64]) -> f64 {
        rates.iter().map(|r| self.cycles(column, law, *r)).fold(f64::INFINITY, f64::min)
    }

    /// Largest error of all seeds, °.
    fn worst_error(&self, column: Column, law: PaperLaw, rates: &[f64]) -> f64 {
        most(self.over(column, law, rates).map(|m| m.max_error_rad.to_degrees()))
    }

    /// Mean over the seeds of the largest error, °.
    fn mean_error(&self, column: Column, law: PaperLaw, rate: f64) -> f64 {
        mean(self.each(column, law, rate).iter().map(|m| m.max_error_rad.to_degrees()))
    }

    fn stair(&self, column: Column, law: PaperLaw, rate: f64) -> f64 {
        mean(self.each(column, law, rate).iter().map(|m| m.stair_height_rad.to_degrees()))
    }

    fn reduction(&self, column: Column, rate: f64) -> f64 {
        reduction(self.cycles(column, PaperLaw::Smc, rate), self.cycles(column, PaperLaw::Pd, rate))
    }
}

fn key(rate_deg_s: f64) -> u64 {
    libm::rint(rate_deg_s * 1000.0) as u64
}

/// NaN of nothing: no statement holds of runs that were not made.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0_u32), |(s, n), x| (s + x, n + 1));
    sum / f64::from(n)
}

/// The largest; NaN of nothing.
fn most(values: impl Iterator<Item = f64>) -> f64 {
    values.reduce(f64::max).unwrap_or(f64::NAN)
}

/// Reduction of stick-slip, per cent: what (32) means, not the ratio that it prints.
#[must_use]
pub fn reduction(smc_cycles: f64, pd_cycles: f64) -> f64 {
    if pd_cycles > 0.0 { 100.0 * (1.0 - smc_cycles / pd_cycles) } else { 0.0 }
}

/// Runs everything, on all cores; `progress` is told of each finished run.
///
/// # Errors
/// [`RunError::Stopped`]; no other with the built-in rigs.
pub fn reproduce(progress: Report<'_>) -> Result<Outcome, RunError> {
    let jobs: Vec<(Column, PaperLaw, f64, u64)> = RUNS
        .iter()
        .flat_map(|(column, law, rates)| {
            rates.iter().flat_map(move |r| SEEDS.iter().map(move |s| (*column, *law, *r, *s)))
        })
        .collect();
    let total = jobs.len() as u64;
    let tell = |finished| match progress(Progress { total, finished }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(RunError::Stopped),
    };
    tell(0)?;
    let results: Vec<_> = jobs
        .par_iter()
        .map(|(column, law, rate, seed)| {
            let run = simulate::<f64>(&spec(*column, *law, *rate, *seed))?;
            tell(1)?;
            // The first seed's traces are the figures.
            let wanted = FIGURES.iter().any(|(_, l, rates)| l == law && rates.contains(rate));
            let panel =
                (wanted && *seed == SEEDS[0] && *column != Column::KnownFriction).then(|| PanelData {
                    rate_deg_s: *rate,
                    experiment: *column == Column::Experiment,
                    error_deg: run.trace.error.iter().map(|e| e.to_degrees()).collect(),
                    time_s: run.trace.time,
                });
            Ok((run.metrics, panel))
        })
        .collect::<Result<_, RunError>>()?;

    let mut measured = Measured(BTreeMap::new());
    let mut panels = Vec::new();
    for ((column, law, rate, _), (metrics, panel)) in jobs.into_iter().zip(results) {
        measured.0.entry((column, law, key(rate))).or_default().push(metrics);
        panels.extend(panel.map(|p| (law, p)));
    }
    let figures = FIGURES
        .iter()
        .map(|(number, law, rates)| {
            let panel = |rate: f64, experiment: bool| {
                let found = panels
                    .iter()
                    .find(|(l, p)| l == law && key(p.rate_deg_s) == key(rate) && p.experiment == experiment);
                found.map(|(_, p)| p.clone())
            };
            let panels = rates.iter().flat_map(|r| [panel(*r, false), panel(*r, true)]).flatten().collect();
            FigureData { number: *number, law: *law, panels }
        })
        .collect();
    let table3 = TABLE3.iter().map(|(rate, paper)| table3_row(&measured, *rate, *paper)).collect();
    Ok(Outcome { figures, table3, claims: claims(&measured) })
}

fn table3_row(m: &Measured, rate: f64, paper: f64) -> Table3Row {
    let pd = m.each(Column::Experiment, PaperLaw::Pd, rate);
    let smc = m.each(Column::Experiment, PaperLaw::Smc, rate);
    let each: Vec<f64> = pd
        .iter()
        .zip(smc)
        .map(|(p, s)| reduction(s.stick_slip_cycles_per_s, p.stick_slip_cycles_per_s))
        .collect();
    let centre = mean(each.iter().copied());
    Table3Row {
        rate_deg_s: rate,
        pd_cycles_per_s: m.cycles(Column::Experiment, PaperLaw::Pd, rate),
        smc_cycles_per_s: m.cycles(Column::Experiment, PaperLaw::Smc, rate),
        reduction_percent: m.reduction(Column::Experiment, rate),
        spread_points: libm::sqrt(mean(each.iter().map(|x| (x - centre) * (x - centre)))),
        paper_percent: paper,
    }
}

fn claims(m: &Measured) -> Vec<Claim> {
    use Column::{Experiment, KnownFriction, Simulation};
    use PaperLaw::{Ctc, Pd, Smc};
    let claim = |id, paper, measured: f64, unit, band: [Option<f64>; 2], note| Claim {
        id,
        paper,
        measured,
        unit,
        band,
        holds: band[0].is_none_or(|low| measured >= low) && band[1].is_none_or(|high| measured <= high),
        deviation: None,
        fitted: false,
        note,
    };
    let at_most = |x| [None, Some(x)];
    let at_least = |x| [Some(x), None];
    let around = |x: f64, by: f64| [Some(x - by), Some(x + by)];
    let fitted = |c: Claim| Claim { fitted: true, ..c };
    let deviates = |c: Claim, from: f64, to: f64| Claim { deviation: Some([from, to]), ..c };
    // A cycle per second is what one sees in a second of a plot: below it, "no stick-slip"; the
    // statements that it occurs ask for it.
    let occurs = at_least(1.0);
    let none = at_most(0.0);

    let sampled = RigParams::paper();
    let one_count = 360.0 / f64::from(sampled.encoder.sensor.counts_per_rev);
    let torque = PlantParams::<f64>::default().drive_torque;
    let slow = [10.0, 6.0, 2.0];

    vec![
        claim(
            "s4-resolution",
            "20 000 counts/rev give a resolution of 0.018°",
            one_count,
            "°",
            around(RESOLUTION_DEG, 1e-9),
            "360° over the counts per revolution",
        ),
        claim(
            "s4-torque",
            "A constant driving torque of 0.047 N m is used",
            torque,
            "N m",
            around(0.047, 0.0005),
            "M g R_p of Table 1, which the text rounds",
        ),
        claim(
            "s4-sampling",
            "The sample frequency is 1 kHz",
            1e6 / f64::from(spec(Simulation, Pd, 2.0, 1).period.0),
            "Hz",
            around(1000.0, 1e-9),
            "the period of every run",
        ),
        claim(
            "s4-converter",
            "The output goes through a 12-bit converter",
            f64::from(sampled.dac.converter.bits),
            "bits",
            around(12.0, 0.0),
            "both rigs; over ±10 V, which the paper does not print",
        ),
        claim(
            "pd-smooth-sim",
            "PD, simulation: no stick-slip from 20 °/s up",
            m.most_cycles(Simulation, Pd, &[100.0, 20.0]),
            "cycles/s",
            none,
            "maximum over ten seeds at 100 and 20 °/s",
        ),
        fitted(claim(
            "pd-smooth-exp",
            "PD, experiment: no stick-slip from 20 °/s up",
            m.most_cycles(Experiment, Pd, &[100.0, 20.0]),
            "cycles/s",
            none,
            "maximum over ten seeds at 100 and 20 °/s",
        )),
        claim(
            "pd-error-sim",
            "PD, simulation: error under 0.12° from 20 °/s up",
            m.worst_error(Simulation, Pd, &[100.0, 20.0]),
            "°",
            at_most(0.12),
            "maximum over ten seeds at 100 and 20 °/s",
        ),
        fitted(claim(
            "pd-error-exp",
            "PD, experiment: error under 0.12° from 20 °/s up",
            m.worst_error(Experiment, Pd, &[100.0, 20.0]),
            "°",
            at_most(0.12),
            "maximum over ten seeds at 100 and 20 °/s",
        )),
        deviates(
            claim(
                "pd-slow-sim",
                "PD, simulation: stick-slip below 20 °/s",
                m.least_cycles(Simulation, Pd, &slow),
                "cycles/s",
                occurs,
                "minimum over 10, 6 and 2 °/s, mean of ten seeds. On the paper's own model PD begins to stick between 6 and 7 °/s, depending on where the path lies between the encoder's edges (docs/theory.md); the paper shows 2 °/s only",
            ),
            0.0,
            0.0,
        ),
        claim(
            "pd-2-sim",
            "PD, simulation: stick-slip at 2 °/s (Fig. 8a)",
            m.cycles(Simulation, Pd, 2.0),
            "cycles/s",
            occurs,
            "mean of ten seeds",
        ),
        fitted(claim(
            "pd-slow-exp",
            "PD, experiment: highly noticeable stick-slip below 20 °/s (Fig. 8b)",
            m.least_cycles(Experiment, Pd, &slow),
            "cycles/s",
            occurs,
            "minimum over 10, 6 and 2 °/s; mean of ten seeds",
        )),
        deviates(
            claim(
                "pd-15-exp",
                "PD, experiment: stick-slip at any rate below 20 °/s",
                m.cycles(Experiment, Pd, 15.0),
                "cycles/s",
                occurs,
                "mean of ten seeds at 15 °/s. It sticks there on few discs, and less than once a second on the whole",
            ),
            0.01,
            0.99,
        ),
        claim(
            "pd-error-2-sim",
            "PD, simulation: error 0.04° at 2 °/s",
            m.mean_error(Simulation, Pd, 2.0),
            "°",
            around(0.04, 0.02),
            "largest error, mean of ten seeds",
        ),
        fitted(claim(
            "pd-error-2-exp",
            "PD, experiment: error 0.08° at 2 °/s",
            m.mean_error(Experiment, Pd, 2.0),
            "°",
            around(0.08, 0.02),
            "largest error, mean of ten seeds",
        )),
        claim(
            "pd-stairs-sim",
            "PD, simulation: the motion at 2 °/s is discontinuous",
            m.stair(Simulation, Pd, 2.0),
            "°",
            at_least(RESOLUTION_DEG),
            "largest stair between two sticks, at least a count; mean of ten seeds",
        ),
        claim(
            "pd-stairs-exp",
            "PD, experiment: the motion at 2 °/s is discontinuous",
            m.stair(Experiment, Pd, 2.0),
            "°",
            at_least(RESOLUTION_DEG),
            "largest stair between two sticks, at least a count; mean of ten seeds",
        ),
        claim(
            "ctc-2-sim",
            "CTC, simulation: no stick-slip at 2 °/s (Fig. 9a)",
            m.most_cycles(Simulation, Ctc, &[2.0]),
            "cycles/s",
            none,
            "maximum over ten seeds",
        ),
        claim(
            "ctc-error-2-sim",
            "CTC, simulation: error at the encoder's resolution at 2 °/s",
            m.worst_error(Simulation, Ctc, &[2.0]),
            "°",
            at_most(RESOLUTION_DEG),
            "maximum over ten seeds",
        ),
        claim(
            "ctc-above-2-sim",
            "CTC, simulation: no stick-slip at any rate above 2 °/s",
            m.most_cycles(Simulation, Ctc, &[100.0, 50.0, 20.0, 10.0, 6.0, 4.0]),
            "cycles/s",
            none,
            "maximum over ten seeds at 4, 6, 10, 20, 50, 100 °/s",
        ),
        claim(
            "ctc-error-above-2-sim",
            "CTC, simulation: error at the resolution at any rate above 2 °/s",
            m.worst_error(Simulation, Ctc, &[100.0, 50.0, 20.0, 10.0, 6.0, 4.0]),
            "°",
            at_most(RESOLUTION_DEG),
            "maximum over ten seeds at 4, 6, 10, 20, 50, 100 °/s",
        ),
        claim(
            "ctc-2-exp",
            "CTC, experiment: stick-slip at 2 °/s (Fig. 9b)",
            m.cycles(Experiment, Ctc, 2.0),
            "cycles/s",
            occurs,
            "mean of ten seeds",
        ),
        claim(
            "ctc-slow-exp",
            "CTC, experiment: stick-slip below 20 °/s",
            m.least_cycles(Experiment, Ctc, &slow),
            "cycles/s",
            occurs,
            "minimum over 10, 6 and 2 °/s; mean of ten seeds",
        ),
        fitted(deviates(
            claim(
                "ctc-15-exp",
                "CTC, experiment: stick-slip at any rate below 20 °/s",
                m.cycles(Experiment, Ctc, 15.0),
                "cycles/s",
                occurs,
                "mean of ten seeds at 15 °/s. It sticks there on some discs and not on others, and less than once a second on the whole: on the rougher disc that was tried it sticks more, and PD leaves its 0.12°",
            ),
            0.01,
            0.99,
        )),
        claim(
            "ctc-error-exp",
            "CTC, experiment: error much higher than in simulation",
            m.mean_error(Experiment, Ctc, 2.0) / m.mean_error(Simulation, Ctc, 2.0),
            "times",
            at_least(3.0),
            "largest error at 2 °/s, experiment over simulation",
        ),
        claim(
            "ctc-known-sticks",
            "CTC with friction exactly known: no stick-slip down to 2 °/s",
            m.most_cycles(KnownFriction, Ctc, &[20.0, 2.0]),
            "cycles/s",
            none,
            "the bench's friction, even along the disc and given to the law; maximum over ten seeds at 20 and 2 °/s",
        ),
        claim(
            "ctc-known-error",
            "CTC with friction exactly known: minimum error",
            m.worst_error(KnownFriction, Ctc, &[20.0, 2.0]),
            "°",
            at_most(RESOLUTION_DEG),
            "the same runs; a count at most",
        ),
        claim(
            "smc-reduces-sim",
            "SMC, simulation: stick-slip reduced at 2 °/s (Fig. 10a)",
            m.reduction(Simulation, 2.0),
            "%",
            at_least(50.0),
            "against PD; means of ten seeds. From seed to seed the path lies otherwise between the encoder's edges, which changes the count",
        ),
        claim(
            "smc-smooth-sim",
            "SMC, simulation: stick-slip reduced at 20 and 6 °/s",
            m.most_cycles(Simulation, Smc, &[20.0, 6.0]),
            "cycles/s",
            none,
            "maximum over ten seeds; nothing is left to reduce",
        ),
        claim(
            "smc-error-sim",
            "SMC, simulation: error below 0.15°",
            m.worst_error(Simulation, Smc, &[20.0, 6.0, 2.0]),
            "°",
            at_most(0.15),
            "maximum over ten seeds at 20, 6, 2 °/s",
        ),
        claim(
            "smc-6-exp",
            "SMC, experiment: stick-slip occurs at 6 °/s (Fig. 10b)",
            m.cycles(Experiment, Smc, 6.0),
            "cycles/s",
            occurs,
            "mean of ten seeds",
        ),
        claim(
            "smc-2-exp",
            "SMC, experiment: stick-slip occurs at 2 °/s (Fig. 10b)",
            m.cycles(Experiment, Smc, 2.0),
            "cycles/s",
            occurs,
            "mean of ten seeds",
        ),
        fitted(claim(
            "smc-much-less-exp",
            "SMC, experiment: stick-slip at 2 and 6 °/s is much reduced against PD",
            m.reduction(Experiment, 2.0).min(m.reduction(Experiment, 6.0)),
            "%",
            at_least(50.0),
            "the lesser of the two reductions; means of ten seeds",
        )),
        claim(
            "eq32-example",
            "100 cycles with PD and 11 with SMC are a reduction of 89 %",
            reduction(11.0, 100.0),
            "%",
            around(89.0, 0.5),
            "(32) prints the ratio, 11 %; its example and Table 3 are the reduction",
        ),
        fitted(claim(
            "table3-10",
            "Table 3: 88.6 % less stick-slip with SMC at 10 °/s",
            m.reduction(Experiment, 10.0),
            "%",
            around(88.6, 5.0),
            "means of ten seeds",
        )),
        fitted(claim(
            "table3-6",
            "Table 3: 88.9 % less stick-slip with SMC at 6 °/s",
            m.reduction(Experiment, 6.0),
            "%",
            around(88.9, 5.0),
            "means of ten seeds",
        )),
        fitted(claim(
            "table3-2",
            "Table 3: 83.8 % less stick-slip with SMC at 2 °/s",
            m.reduction(Experiment, 2.0),
            "%",
            around(83.8, 5.0),
            "means of ten seeds",
        )),
    ]
}
