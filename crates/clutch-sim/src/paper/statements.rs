//! The statements of the paper's section 4.

use super::Agrees::{self, Around, AtLeast, AtMost};
use super::Measure::{self, Arithmetic, ExperimentOverSimulation, Least, Most, Reduction, Setting};
use super::PaperLaw::{Ctc, Pd, Smc};
use super::Source::{Experiment, KnownFriction, Simulation};
use super::runs::Case;
use super::{TABLE3, reduction};
use crate::metrics::{self, Metrics};
use crate::rig::RigParams;
use Place::{Equation, Figure, Setup, Table};
use clutch_core::PlantParams;

/// Where in section 4 a statement stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Where the experiment is described.
    Setup,
    /// At the figure of this number.
    Figure(u32),
    /// At the table of this number.
    Table(u32),
    /// At the equation of this number.
    Equation(u32),
}

/// One statement of the paper.
#[derive(Clone, Copy, Debug)]
pub struct Statement {
    /// Short name, stable from version to version.
    pub id: &'static str,
    /// Where it stands.
    pub place: Place,
    /// What it states, with its value.
    pub says: &'static str,
    /// What is measured of it.
    pub measured: Measure,
    /// Which measurements agree with it.
    pub agrees: Agrees,
    /// Interval in which the measurement lies where the statement is known not to hold; the docs
    /// say why. None = the statement is expected to hold.
    pub deviation: Option<[f64; 2]>,
    /// Whether the rig `bench` was fitted to it.
    pub fitted: bool,
    /// How it is measured; why it does not hold, if it does not.
    pub note: &'static str,
}

const CYCLES: &metrics::Figure<Metrics> = &Metrics::STICK_SLIP;
const ERROR: &metrics::Figure<Metrics> = &Metrics::MAX_ERROR;
const STAIR: &metrics::Figure<Metrics> = &Metrics::STAIR_HEIGHT;
/// One encoder count, °.
const RESOLUTION_DEG: f64 = 0.018;
/// A cycle per second is what one sees in a second of a plot: below it, "no stick-slip"; the
/// statements that it occurs ask for it.
const OCCURS: Agrees = AtLeast(1.0);
const NONE: Agrees = AtMost(0.0);

/// Every statement, in the paper's order.
pub const STATEMENTS: &[Statement] = &[
    Statement {
        id: "s4-resolution",
        place: Setup,
        says: "20 000 counts/rev give a resolution of 0.018°",
        measured: Arithmetic(|| 360.0 / f64::from(RigParams::paper().encoder.sensor.counts_per_rev), "°"),
        agrees: Around(RESOLUTION_DEG, 1e-9),
        deviation: None,
        fitted: false,
        note: "360° over the counts per revolution",
    },
    Statement {
        id: "s4-torque",
        place: Setup,
        says: "A constant driving torque of 0.047 N m is used",
        measured: Setting(|| PlantParams::<f64>::default().drive_torque, "N m"),
        agrees: Around(0.047, 0.0005),
        deviation: None,
        fitted: false,
        note: "M g R_p of Table 1, which the text rounds",
    },
    Statement {
        id: "s4-sampling",
        place: Setup,
        says: "The sample frequency is 1 kHz",
        measured: Setting(|| 1e6 / f64::from(Case::new(Simulation, Pd, 2.0).spec(1).period.0), "Hz"),
        agrees: Around(1000.0, 1e-9),
        deviation: None,
        fitted: false,
        note: "the period of every run",
    },
    Statement {
        id: "s4-converter",
        place: Setup,
        says: "The output goes through a 12-bit converter",
        measured: Setting(|| f64::from(RigParams::paper().dac.converter.bits), "bits"),
        agrees: Around(12.0, 0.0),
        deviation: None,
        fitted: false,
        note: "both rigs; over ±10 V, which the paper does not print",
    },
    Statement {
        id: "pd-smooth-sim",
        place: Figure(8),
        says: "PD, simulation: no stick-slip from 20 °/s up",
        measured: Most(CYCLES, Simulation, Pd, &[100.0, 20.0]),
        agrees: NONE,
        deviation: None,
        fitted: false,
        note: "maximum over ten seeds at 100 and 20 °/s",
    },
    Statement {
        id: "pd-smooth-exp",
        place: Figure(8),
        says: "PD, experiment: no stick-slip from 20 °/s up",
        measured: Most(CYCLES, Experiment, Pd, &[100.0, 20.0]),
        agrees: NONE,
        deviation: None,
        fitted: true,
        note: "maximum over ten seeds at 100 and 20 °/s",
    },
    Statement {
        id: "pd-error-sim",
        place: Figure(8),
        says: "PD, simulation: error under 0.12° from 20 °/s up",
        measured: Most(ERROR, Simulation, Pd, &[100.0, 20.0]),
        agrees: AtMost(0.12),
        deviation: None,
        fitted: false,
        note: "maximum over ten seeds at 100 and 20 °/s",
    },
    Statement {
        id: "pd-error-exp",
        place: Figure(8),
        says: "PD, experiment: error under 0.12° from 20 °/s up",
        measured: Most(ERROR, Experiment, Pd, &[100.0, 20.0]),
        agrees: AtMost(0.12),
        deviation: None,
        fitted: true,
        note: "maximum over ten seeds at 100 and 20 °/s",
    },
    Statement {
        id: "pd-slow-sim",
        place: Figure(8),
        says: "PD, simulation: stick-slip below 20 °/s",
        measured: Least(CYCLES, Simulation, Pd, &[10.0, 6.0, 2.0]),
        agrees: OCCURS,
        deviation: Some([0.0, 0.0]),
        fitted: false,
        note: "minimum over 10, 6 and 2 °/s, mean of ten seeds. On the paper's own model PD begins to stick between 6 and 7 °/s, depending on where the path lies between the encoder's edges (docs/theory.md); the paper shows 2 °/s only",
    },
    Statement {
        id: "pd-2-sim",
        place: Figure(8),
        says: "PD, simulation: stick-slip at 2 °/s (Fig. 8a)",
        measured: Least(CYCLES, Simulation, Pd, &[2.0]),
        agrees: OCCURS,
        deviation: None,
        fitted: false,
        note: "mean of ten seeds",
    },
    Statement {
        id: "pd-slow-exp",
        place: Figure(8),
        says: "PD, experiment: highly noticeable stick-slip below 20 °/s (Fig. 8b)",
        measured: Least(CYCLES, Experiment, Pd, &[10.0, 6.0, 2.0]),
        agrees: OCCURS,
        deviation: None,
        fitted: true,
        note: "minimum over 10, 6 and 2 °/s; mean of ten seeds",
    },
    Statement {
        id: "pd-15-exp",
        place: Figure(8),
        says: "PD, experiment: stick-slip at any rate below 20 °/s",
        measured: Least(CYCLES, Experiment, Pd, &[15.0]),
        agrees: OCCURS,
        deviation: Some([0.01, 0.99]),
        fitted: false,
        note: "mean of ten seeds at 15 °/s. It sticks there on few discs, and less than once a second on the whole",
    },
    Statement {
        id: "pd-error-2-sim",
        place: Figure(8),
        says: "PD, simulation: error 0.04° at 2 °/s",
        measured: Least(ERROR, Simulation, Pd, &[2.0]),
        agrees: Around(0.04, 0.02),
        deviation: None,
        fitted: false,
        note: "largest error, mean of ten seeds",
    },
    Statement {
        id: "pd-error-2-exp",
        place: Figure(8),
        says: "PD, experiment: error 0.08° at 2 °/s",
        measured: Least(ERROR, Experiment, Pd, &[2.0]),
        agrees: Around(0.08, 0.02),
        deviation: None,
        fitted: true,
        note: "largest error, mean of ten seeds",
    },
    Statement {
        id: "pd-stairs-sim",
        place: Figure(8),
        says: "PD, simulation: the motion at 2 °/s is discontinuous",
        measured: Least(STAIR, Simulation, Pd, &[2.0]),
        agrees: AtLeast(RESOLUTION_DEG),
        deviation: None,
        fitted: false,
        note: "largest stair between two sticks, at least a count; mean of ten seeds",
    },
    Statement {
        id: "pd-stairs-exp",
        place: Figure(8),
        says: "PD, experiment: the motion at 2 °/s is discontinuous",
        measured: Least(STAIR, Experiment, Pd, &[2.0]),
        agrees: AtLeast(RESOLUTION_DEG),
        deviation: None,
        fitted: false,
        note: "largest stair between two sticks, at least a count; mean of ten seeds",
    },
    Statement {
        id: "ctc-2-sim",
        place: Figure(9),
        says: "CTC, simulation: no stick-slip at 2 °/s (Fig. 9a)",
        measured: Most(CYCLES, Simulation, Ctc, &[2.0]),
        agrees: NONE,
        deviation: None,
        fitted: false,
        note: "maximum over ten seeds",
    },
    Statement {
        id: "ctc-error-2-sim",
        place: Figure(9),
        says: "CTC, simulation: error at the encoder's resolution at 2 °/s",
        measured: Most(ERROR, Simulation, Ctc, &[2.0]),
        agrees: AtMost(RESOLUTION_DEG),
        deviation: None,
        fitted: false,
        note: "maximum over ten seeds",
    },
    Statement {
        id: "ctc-above-2-sim",
        place: Figure(9),
        says: "CTC, simulation: no stick-slip at any rate above 2 °/s",
        measured: Most(CYCLES, Simulation, Ctc, &[100.0, 50.0, 20.0, 10.0, 6.0, 4.0]),
        agrees: NONE,
        deviation: None,
        fitted: false,
        note: "maximum over ten seeds at 4, 6, 10, 20, 50, 100 °/s",
    },
    Statement {
        id: "ctc-error-above-2-sim",
        place: Figure(9),
        says: "CTC, simulation: error at the resolution at any rate above 2 °/s",
        measured: Most(ERROR, Simulation, Ctc, &[100.0, 50.0, 20.0, 10.0, 6.0, 4.0]),
        agrees: AtMost(RESOLUTION_DEG),
        deviation: None,
        fitted: false,
        note: "maximum over ten seeds at 4, 6, 10, 20, 50, 100 °/s",
    },
    Statement {
        id: "ctc-2-exp",
        place: Figure(9),
        says: "CTC, experiment: stick-slip at 2 °/s (Fig. 9b)",
        measured: Least(CYCLES, Experiment, Ctc, &[2.0]),
        agrees: OCCURS,
        deviation: None,
        fitted: false,
        note: "mean of ten seeds",
    },
    Statement {
        id: "ctc-slow-exp",
        place: Figure(9),
        says: "CTC, experiment: stick-slip below 20 °/s",
        measured: Least(CYCLES, Experiment, Ctc, &[10.0, 6.0, 2.0]),
        agrees: OCCURS,
        deviation: None,
        fitted: false,
        note: "minimum over 10, 6 and 2 °/s; mean of ten seeds",
    },
    Statement {
        id: "ctc-15-exp",
        place: Figure(9),
        says: "CTC, experiment: stick-slip at any rate below 20 °/s",
        measured: Least(CYCLES, Experiment, Ctc, &[15.0]),
        agrees: OCCURS,
        deviation: Some([0.01, 0.99]),
        fitted: true,
        note: "mean of ten seeds at 15 °/s. It sticks there on some discs and not on others, and less than once a second on the whole: on the rougher disc that was tried it sticks more, and PD leaves its 0.12°",
    },
    Statement {
        id: "ctc-error-exp",
        place: Figure(9),
        says: "CTC, experiment: error much higher than in simulation",
        measured: ExperimentOverSimulation(ERROR, Ctc, 2.0),
        agrees: AtLeast(3.0),
        deviation: None,
        fitted: false,
        note: "largest error at 2 °/s, experiment over simulation",
    },
    Statement {
        id: "ctc-known-sticks",
        place: Figure(9),
        says: "CTC with friction exactly known: no stick-slip down to 2 °/s",
        measured: Most(CYCLES, KnownFriction, Ctc, &[20.0, 2.0]),
        agrees: NONE,
        deviation: None,
        fitted: false,
        note: "the bench's friction, even along the disc and given to the law; maximum over ten seeds at 20 and 2 °/s",
    },
    Statement {
        id: "ctc-known-error",
        place: Figure(9),
        says: "CTC with friction exactly known: minimum error",
        measured: Most(ERROR, KnownFriction, Ctc, &[20.0, 2.0]),
        agrees: AtMost(RESOLUTION_DEG),
        deviation: None,
        fitted: false,
        note: "the same runs; a count at most",
    },
    Statement {
        id: "smc-reduces-sim",
        place: Figure(10),
        says: "SMC, simulation: stick-slip reduced at 2 °/s (Fig. 10a)",
        measured: Reduction(Simulation, &[2.0]),
        agrees: AtLeast(50.0),
        deviation: None,
        fitted: false,
        note: "against PD; means of ten seeds. From seed to seed the path lies otherwise between the encoder's edges, which changes the count",
    },
    Statement {
        id: "smc-smooth-sim",
        place: Figure(10),
        says: "SMC, simulation: stick-slip reduced at 20 and 6 °/s",
        measured: Most(CYCLES, Simulation, Smc, &[20.0, 6.0]),
        agrees: NONE,
        deviation: None,
        fitted: false,
        note: "maximum over ten seeds; nothing is left to reduce",
    },
    Statement {
        id: "smc-error-sim",
        place: Figure(10),
        says: "SMC, simulation: error below 0.15°",
        measured: Most(ERROR, Simulation, Smc, &[20.0, 6.0, 2.0]),
        agrees: AtMost(0.15),
        deviation: None,
        fitted: false,
        note: "maximum over ten seeds at 20, 6, 2 °/s",
    },
    Statement {
        id: "smc-6-exp",
        place: Figure(10),
        says: "SMC, experiment: stick-slip occurs at 6 °/s (Fig. 10b)",
        measured: Least(CYCLES, Experiment, Smc, &[6.0]),
        agrees: OCCURS,
        deviation: None,
        fitted: false,
        note: "mean of ten seeds",
    },
    Statement {
        id: "smc-2-exp",
        place: Figure(10),
        says: "SMC, experiment: stick-slip occurs at 2 °/s (Fig. 10b)",
        measured: Least(CYCLES, Experiment, Smc, &[2.0]),
        agrees: OCCURS,
        deviation: None,
        fitted: false,
        note: "mean of ten seeds",
    },
    Statement {
        id: "smc-much-less-exp",
        place: Figure(10),
        says: "SMC, experiment: stick-slip at 2 and 6 °/s is much reduced against PD",
        measured: Reduction(Experiment, &[6.0, 2.0]),
        agrees: AtLeast(50.0),
        deviation: None,
        fitted: true,
        note: "the lesser of the two reductions; means of ten seeds",
    },
    Statement {
        id: "eq32-example",
        place: Equation(32),
        says: "100 cycles with PD and 11 with SMC are a reduction of 89 %",
        measured: Arithmetic(|| reduction(11.0, 100.0), "%"),
        agrees: Around(89.0, 0.5),
        deviation: None,
        fitted: false,
        note: "(32) prints the ratio, 11 %; its example and Table 3 are the reduction",
    },
    Statement {
        id: "table3-10",
        place: Table(3),
        says: "Table 3: 88.6 % less stick-slip with SMC at 10 °/s",
        measured: Reduction(Experiment, &[10.0]),
        agrees: Around(TABLE3[0].1, 5.0),
        deviation: None,
        fitted: true,
        note: "means of ten seeds",
    },
    Statement {
        id: "table3-6",
        place: Table(3),
        says: "Table 3: 88.9 % less stick-slip with SMC at 6 °/s",
        measured: Reduction(Experiment, &[6.0]),
        agrees: Around(TABLE3[1].1, 5.0),
        deviation: None,
        fitted: true,
        note: "means of ten seeds",
    },
    Statement {
        id: "table3-2",
        place: Table(3),
        says: "Table 3: 83.8 % less stick-slip with SMC at 2 °/s",
        measured: Reduction(Experiment, &[2.0]),
        agrees: Around(TABLE3[2].1, 5.0),
        deviation: None,
        fitted: true,
        note: "means of ten seeds",
    },
];
