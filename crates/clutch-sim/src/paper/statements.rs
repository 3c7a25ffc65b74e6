//! The statements of the paper's section 4.

use super::Agrees::{self, Around, AtLeast, AtMost};
use super::Measure::{self, Arithmetic, ExperimentOverSimulation, Least, Most, Reduction, Setting};
use super::PaperLaw::{Ctc, Pd, Smc};
use super::Source::{Experiment, KnownFriction, Simulation};
use super::runs::Case;
use super::{TABLE3, reduction};
use crate::metrics::{self, Metrics};
use crate::rig::RigParams;
use clutch_core::PlantParams;

/// The place of a statement in section 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// At the description of the experiment.
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
    /// Its place.
    pub place: Place,
    /// The statement itself, with its value.
    pub says: &'static str,
    /// The quantity measured of it.
    pub measured: Measure,
    /// Measurements that agree with it.
    pub agrees: Agrees,
    /// Interval in which the measurement lies where the statement is known not to hold; the docs
    /// say why. None = the statement is expected to hold.
    pub deviation: Option<[f64; 2]>,
    /// True if the rig `bench` was fitted to it.
    pub fitted: bool,
    /// The way it is measured; the reason, if it does not hold.
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

/// A statement in three lines: its name, its place, whether the bench was fitted to it, and what it states; what
/// is measured, what agrees, and where the measurement lies if it does not; a note.
macro_rules! statements {
    ($(
        $id:literal $place:ident $(($number:literal))? $(, $fitted:ident)?: $says:literal,
        $measured:expr, $agrees:expr $(, deviates $deviation:expr)?,
        $note:literal;
    )+) => {
        /// Every statement, in the paper's order.
        pub const STATEMENTS: &[Statement] = &[$(Statement {
            id: $id,
            place: Place::$place $(($number))?,
            says: $says,
            measured: $measured,
            agrees: $agrees,
            deviation: statements!(@deviation $($deviation)?),
            fitted: statements!(@fitted $($fitted)?),
            note: $note,
        }),+];
    };
    (@deviation) => { None };
    (@deviation $range:expr) => { Some($range) };
    (@fitted) => { false };
    (@fitted fitted) => { true };
}

statements! {
    "s4-resolution" Setup: "20 000 counts/rev give a resolution of 0.018°",
        Arithmetic(|| 360.0 / f64::from(RigParams::paper().encoder.sensor.counts_per_rev), "°"), Around(RESOLUTION_DEG, 1e-9),
        "360° over the counts per revolution";
    "s4-torque" Setup: "A constant driving torque of 0.047 N m is used",
        Setting(|| PlantParams::<f64>::default().drive_torque, "N m"), Around(0.047, 0.0005),
        "M g R_p of Table 1, which the text rounds";
    "s4-sampling" Setup: "The sample frequency is 1 kHz",
        Setting(|| 1e6 / f64::from(Case::new(Simulation, Pd, 2.0).spec(1).period.0), "Hz"), Around(1000.0, 1e-9),
        "the period of every run";
    "s4-converter" Setup: "The output goes through a 12-bit converter",
        Setting(|| f64::from(RigParams::paper().dac.converter.bits), "bits"), Around(12.0, 0.0),
        "both rigs; over ±10 V, which the paper does not print";
    "pd-smooth-sim" Figure(8): "PD, simulation: no stick-slip from 20 °/s up",
        Most(CYCLES, Simulation, Pd, &[100.0, 20.0]), NONE,
        "maximum over ten seeds at 100 and 20 °/s";
    "pd-smooth-exp" Figure(8), fitted: "PD, experiment: no stick-slip from 20 °/s up",
        Most(CYCLES, Experiment, Pd, &[100.0, 20.0]), NONE,
        "maximum over ten seeds at 100 and 20 °/s";
    "pd-error-sim" Figure(8): "PD, simulation: error under 0.12° from 20 °/s up",
        Most(ERROR, Simulation, Pd, &[100.0, 20.0]), AtMost(0.12),
        "maximum over ten seeds at 100 and 20 °/s";
    "pd-error-exp" Figure(8), fitted: "PD, experiment: error under 0.12° from 20 °/s up",
        Most(ERROR, Experiment, Pd, &[100.0, 20.0]), AtMost(0.12),
        "maximum over ten seeds at 100 and 20 °/s";
    "pd-slow-sim" Figure(8): "PD, simulation: stick-slip below 20 °/s",
        Least(CYCLES, Simulation, Pd, &[10.0, 6.0, 2.0]), OCCURS, deviates [0.0, 0.0],
        "minimum over 10, 6 and 2 °/s, mean of ten seeds. On the paper's own model PD begins to stick between 6 and 7 °/s, depending on where the path lies between the encoder's edges (docs/theory.md); the paper shows 2 °/s only";
    "pd-2-sim" Figure(8): "PD, simulation: stick-slip at 2 °/s (Fig. 8a)",
        Least(CYCLES, Simulation, Pd, &[2.0]), OCCURS,
        "mean of ten seeds";
    "pd-slow-exp" Figure(8), fitted: "PD, experiment: highly noticeable stick-slip below 20 °/s (Fig. 8b)",
        Least(CYCLES, Experiment, Pd, &[10.0, 6.0, 2.0]), OCCURS,
        "minimum over 10, 6 and 2 °/s; mean of ten seeds";
    "pd-15-exp" Figure(8): "PD, experiment: stick-slip at any rate below 20 °/s",
        Least(CYCLES, Experiment, Pd, &[15.0]), OCCURS, deviates [0.01, 0.99],
        "mean of ten seeds at 15 °/s. It sticks there on few discs, and less than once a second on the whole";
    "pd-error-2-sim" Figure(8): "PD, simulation: error 0.04° at 2 °/s",
        Least(ERROR, Simulation, Pd, &[2.0]), Around(0.04, 0.02),
        "largest error, mean of ten seeds";
    "pd-error-2-exp" Figure(8), fitted: "PD, experiment: error 0.08° at 2 °/s",
        Least(ERROR, Experiment, Pd, &[2.0]), Around(0.08, 0.02),
        "largest error, mean of ten seeds";
    "pd-stairs-sim" Figure(8): "PD, simulation: the motion at 2 °/s is discontinuous",
        Least(STAIR, Simulation, Pd, &[2.0]), AtLeast(RESOLUTION_DEG),
        "largest stair between two sticks, at least a count; mean of ten seeds";
    "pd-stairs-exp" Figure(8): "PD, experiment: the motion at 2 °/s is discontinuous",
        Least(STAIR, Experiment, Pd, &[2.0]), AtLeast(RESOLUTION_DEG),
        "largest stair between two sticks, at least a count; mean of ten seeds";
    "ctc-2-sim" Figure(9): "CTC, simulation: no stick-slip at 2 °/s (Fig. 9a)",
        Most(CYCLES, Simulation, Ctc, &[2.0]), NONE,
        "maximum over ten seeds";
    "ctc-error-2-sim" Figure(9): "CTC, simulation: error at the encoder's resolution at 2 °/s",
        Most(ERROR, Simulation, Ctc, &[2.0]), AtMost(RESOLUTION_DEG),
        "maximum over ten seeds";
    "ctc-above-2-sim" Figure(9): "CTC, simulation: no stick-slip at any rate above 2 °/s",
        Most(CYCLES, Simulation, Ctc, &[100.0, 50.0, 20.0, 10.0, 6.0, 4.0]), NONE,
        "maximum over ten seeds at 4, 6, 10, 20, 50, 100 °/s";
    "ctc-error-above-2-sim" Figure(9): "CTC, simulation: error at the resolution at any rate above 2 °/s",
        Most(ERROR, Simulation, Ctc, &[100.0, 50.0, 20.0, 10.0, 6.0, 4.0]), AtMost(RESOLUTION_DEG),
        "maximum over ten seeds at 4, 6, 10, 20, 50, 100 °/s";
    "ctc-2-exp" Figure(9): "CTC, experiment: stick-slip at 2 °/s (Fig. 9b)",
        Least(CYCLES, Experiment, Ctc, &[2.0]), OCCURS,
        "mean of ten seeds";
    "ctc-slow-exp" Figure(9): "CTC, experiment: stick-slip below 20 °/s",
        Least(CYCLES, Experiment, Ctc, &[10.0, 6.0, 2.0]), OCCURS,
        "minimum over 10, 6 and 2 °/s; mean of ten seeds";
    "ctc-15-exp" Figure(9), fitted: "CTC, experiment: stick-slip at any rate below 20 °/s",
        Least(CYCLES, Experiment, Ctc, &[15.0]), OCCURS, deviates [0.01, 0.99],
        "mean of ten seeds at 15 °/s. It sticks there on some discs and not on others, and less than once a second on the whole: on the rougher disc that was tried it sticks more, and PD leaves its 0.12°";
    "ctc-error-exp" Figure(9): "CTC, experiment: error much higher than in simulation",
        ExperimentOverSimulation(ERROR, Ctc, 2.0), AtLeast(3.0),
        "largest error at 2 °/s, experiment over simulation";
    "ctc-known-sticks" Figure(9): "CTC with friction exactly known: no stick-slip down to 2 °/s",
        Most(CYCLES, KnownFriction, Ctc, &[20.0, 2.0]), NONE,
        "the bench's friction, even along the disc and given to the law; maximum over ten seeds at 20 and 2 °/s";
    "ctc-known-error" Figure(9): "CTC with friction exactly known: minimum error",
        Most(ERROR, KnownFriction, Ctc, &[20.0, 2.0]), AtMost(RESOLUTION_DEG),
        "the same runs; a count at most";
    "smc-reduces-sim" Figure(10): "SMC, simulation: stick-slip reduced at 2 °/s (Fig. 10a)",
        Reduction(Simulation, &[2.0]), AtLeast(50.0),
        "against PD; means of ten seeds. From seed to seed the path lies otherwise between the encoder's edges, which changes the count";
    "smc-smooth-sim" Figure(10): "SMC, simulation: stick-slip reduced at 20 and 6 °/s",
        Most(CYCLES, Simulation, Smc, &[20.0, 6.0]), NONE,
        "maximum over ten seeds; nothing is left to reduce";
    "smc-error-sim" Figure(10): "SMC, simulation: error below 0.15°",
        Most(ERROR, Simulation, Smc, &[20.0, 6.0, 2.0]), AtMost(0.15),
        "maximum over ten seeds at 20, 6, 2 °/s";
    "smc-6-exp" Figure(10): "SMC, experiment: stick-slip occurs at 6 °/s (Fig. 10b)",
        Least(CYCLES, Experiment, Smc, &[6.0]), OCCURS,
        "mean of ten seeds";
    "smc-2-exp" Figure(10): "SMC, experiment: stick-slip occurs at 2 °/s (Fig. 10b)",
        Least(CYCLES, Experiment, Smc, &[2.0]), OCCURS,
        "mean of ten seeds";
    "smc-much-less-exp" Figure(10), fitted: "SMC, experiment: stick-slip at 2 and 6 °/s is much reduced against PD",
        Reduction(Experiment, &[6.0, 2.0]), AtLeast(50.0),
        "the lesser of the two reductions; means of ten seeds";
    "eq32-example" Equation(32): "100 cycles with PD and 11 with SMC are a reduction of 89 %",
        Arithmetic(|| reduction(11.0, 100.0), "%"), Around(89.0, 0.5),
        "(32) prints the ratio, 11 %; its example and Table 3 are the reduction";
    "table3-10" Table(3), fitted: "Table 3: 88.6 % less stick-slip with SMC at 10 °/s",
        Reduction(Experiment, &[10.0]), Around(TABLE3[0].1, 5.0),
        "means of ten seeds";
    "table3-6" Table(3), fitted: "Table 3: 88.9 % less stick-slip with SMC at 6 °/s",
        Reduction(Experiment, &[6.0]), Around(TABLE3[1].1, 5.0),
        "means of ten seeds";
    "table3-2" Table(3), fitted: "Table 3: 83.8 % less stick-slip with SMC at 2 °/s",
        Reduction(Experiment, &[2.0]), Around(TABLE3[2].1, 5.0),
        "means of ten seeds";
}
