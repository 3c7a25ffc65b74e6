//! A run before it is run: everything that it is made of, and why it may not be made.

use crate::engine::{EngineError, EngineKind};
use crate::moving_rig::MovingRig;
use crate::rig::{Rig, RigParams};
use clutch_core::friction::FrictionModel;
use clutch_core::law::{ControlLaw, LawParams, OutputParams, ShellParams};
use clutch_core::params::{Range, Table};
use clutch_core::reference::{Reference, ReferenceParams};
use clutch_core::{
    Encoder, FixedCounts, FrictionMap, Micros, ParamError, PlantParams, Real, Servo, ServoParams, ServoState,
    VelocityParams, params,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

clutch_core::words! {
    /// Motion of the shaft at the beginning.
    pub enum Start {
        /// On the path: at its velocity, the brake at the voltage that keeps it. (12) and (13) assume a path without
        /// jumps.
        OnPath = "on_path" default,
        /// Held at rest: by a brake with a quarter more than the voltage that this takes, by a motor with the voltage that
        /// balances the drive.
        Rest = "rest",
    }
}

params! {
    /// Length, beginning, seed and engine of a run.
    #[derive(Copy)]
    pub struct RunParams<f64>: Default {
        /// Length.
        duration: f64 = 5.0, "duration_s" "" S, Range::above(0.0);
        /// Time at the start that is left out of the figures.
        settle: f64 = 1.0, "settle_s" "" S, Range::at_least(0.0);
        /// Motion of the shaft at the beginning.
        start: Start = "on_path", "start" "" NONE, Range::ANY;
        /// Position at which shaft and path begin; absent: somewhere within the first count, drawn from the seed.
        /// The place of the path between the encoder's edges decides how often a slow shaft sticks, and nobody mounts
        /// an encoder to a fraction of a count.
        start_counts: Option<f64>, "start_counts" "" COUNTS, Range::above(-1e9).below(1e9);
        /// Seed of everything random: start, ripple phases, noise, a hand.
        seed: u64 = 1, "seed" "" NONE, Range::within(0.0, i64::MAX as f64);
        /// Engine that integrates the motion.
        engine: EngineKind = "auto", "engine" "" NONE, Range::ANY;
    }
    relations(p) {
        /// Samples fit the memory.
        FITS: duration, "a time of 1 to 10 million times sampling.period_us: a run keeps every sample";
        /// Figures have samples.
        SETTLES: settle, "a time that ends at least sampling.period_us before run.duration_s does";
    }
}

/// Samples that a run may have: it keeps each of them, about a hundred bytes.
const LONGEST: u64 = 10_000_000;
impl RunParams {
    /// The number of ticks.
    #[must_use]
    pub fn ticks(&self, period: Micros) -> u64 {
        libm::rint(self.duration / period.seconds::<f64>()) as u64
    }

    /// Position at which shaft and path begin.
    #[must_use]
    pub fn start_position(&self) -> FixedCounts {
        match self.start_counts {
            Some(counts) => FixedCounts::from_real(counts),
            None => FixedCounts(Pcg64::seed_from_u64(self.seed ^ 0x0073_7461_7274).random_range(0..1 << 16)),
        }
    }

    /// Checks duration and settling time against the period.
    ///
    /// # Errors
    /// The first parameter out of range, or one that does not fit the period.
    pub fn check(&self, period: Micros) -> Result<(), ParamError> {
        let shortest: f64 = period.period()?;
        self.check_rows()?;
        let fits = self.duration >= shortest && self.ticks(period) <= LONGEST;
        RunParams::FITS.require(self.duration, fits)?;
        RunParams::SETTLES.require(self.settle, self.settle <= self.duration - shortest)?;
        Ok(())
    }
}

/// Everything a run is made of, SI and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSpec<'a> {
    /// The rig.
    pub rig: RigParams,
    /// Sampling period.
    pub period: Micros,
    /// Source of the law's error rate.
    pub velocity: VelocityParams,
    /// The plant as law and observer believe it to be.
    pub model: PlantParams,
    /// The law.
    pub law: LawParams,
    /// Output limits and bumpless start.
    pub output: OutputParams,
    /// The shell around the law.
    pub shell: ShellParams,
    /// The path.
    pub reference: ReferenceParams<'a>,
    /// Friction along the disc, where there is a map.
    pub friction_map: Option<FrictionMap<'a>>,
    /// Length, beginning, seed and engine.
    pub run: RunParams,
}

impl<'a> RunSpec<'a> {
    /// The paper's sampling and filter, its nominal model, on a rig.
    #[must_use]
    pub fn new(rig: RigParams, law: LawParams, reference: ReferenceParams<'a>) -> Self {
        RunSpec {
            rig,
            period: Micros(1000),
            velocity: VelocityParams::default(),
            model: PlantParams::default(),
            law,
            output: OutputParams::default(),
            shell: ShellParams::default(),
            reference,
            friction_map: None,
            run: RunParams::default(),
        }
    }

    /// The engine that runs on a rig: the exact flow where `auto` may take it.
    ///
    /// # Errors
    /// The exact flow is asked for and cannot take the rig.
    pub fn engine(&self, rig: &Rig) -> Result<EngineKind, RunError> {
        let bends = rig.model.plant.friction().bristles().is_some();
        let asked = self.run.engine;
        let refused = |expected: String| Err(RunError::Engine { asked, expected });
        match (asked, bends) {
            (EngineKind::Auto | EngineKind::Bristle, true) => return Ok(EngineKind::Bristle),
            (EngineKind::Bristle, false) => {
                return refused(
                    "dormand_prince, exact_flow or auto: the rig's friction has no bristles".to_owned(),
                );
            }
            (_, true) => {
                return refused(
                    "bristle or auto: the rig's friction has bristles, which bend before it slides"
                        .to_owned(),
                );
            }
            _ => {}
        }
        match (asked, rig.refuses_exact_flow()) {
            (EngineKind::ExactFlow, Some(needs)) => {
                refused(format!("dormand_prince or auto: exact_flow needs {needs}"))
            }
            (EngineKind::DormandPrince | EngineKind::Bristle, _) | (EngineKind::Auto, Some(_)) => {
                Ok(EngineKind::DormandPrince)
            }
            (EngineKind::ExactFlow | EngineKind::Auto, None) => Ok(EngineKind::ExactFlow),
        }
    }

    /// The path from where the run begins, planned in the law's scalar: a board that computes in
    /// single precision has nothing else to plan in.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn path<T: Real>(&self) -> Result<Reference<'a, T>, ParamError> {
        let encoder = Encoder::new::<f64>(self.rig.encoder.sensor.counts_per_rev)?;
        let start = self.run.start_position();
        Reference::new(&self.reference.cast(), start, encoder, self.period).map_err(|e| e.cast())
    }

    /// Rig and path as a run in the scalar `T` begins.
    ///
    /// # Errors
    /// A parameter out of range; an engine that cannot take the rig.
    pub fn prepare<T: Real>(&self) -> Result<Prepared<'a, T>, RunError> {
        let p = &self.run;
        let rig = Rig::new(&self.rig, p.seed)?;
        let engine = self.engine(&rig)?;
        p.check(self.period)?;
        let encoder = rig.encoder;
        let reference = self.path::<T>()?;
        let first = reference.at(0);
        let begin = first.position.minus::<f64>(FixedCounts(0)) * encoder.radians_per_count::<f64>();
        if i32::try_from(first.position.0 >> FixedCounts::FRACTION_BITS).is_err() {
            return Err(RunError::Begin(begin));
        }
        let velocity = if p.start == Start::OnPath { first.velocity.to_f64() } else { 0.0 };
        let volts =
            if p.start == Start::Rest { rig.resting_voltage() } else { rig.sliding_voltage(velocity) };
        let moving = MovingRig::new(rig, engine, p.seed, (begin, velocity), volts);
        Ok(Prepared { reference, moving, volts, engine })
    }

    /// The servo's parameters.
    ///
    /// # Errors
    /// Field `counts_per_rev`.
    pub fn servo(&self) -> Result<ServoParams, ParamError> {
        Ok(ServoParams {
            period: self.period,
            encoder: Encoder::new(self.rig.encoder.sensor.counts_per_rev)?,
            dac: self.rig.dac.converter,
            velocity: self.velocity,
            model: self.model,
            law: self.law,
            output: self.output,
            shell: self.shell,
        })
    }
}

/// A run could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RunError {
    /// A parameter is out of range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// The path begins where no counter can be, rad.
    #[error("the path begins at {0} rad: expected a beginning within ±2³¹ counts")]
    Begin(f64),
    /// The servo is one of another run.
    #[error("the servo has another period or another encoder than the run")]
    OtherServo,
    /// The engine cannot take the rig.
    #[error("engine = {}: expected {expected}", .asked.name())]
    Engine {
        /// The engine that was asked for.
        asked: EngineKind,
        /// Those that can, and why that one cannot.
        expected: String,
    },
    /// The engine gave up.
    #[error(transparent)]
    Motion(#[from] EngineError),
    /// There is no room for so many samples.
    #[error("no memory for {0} samples, of about 130 bytes each; make the run shorter, or keep figures only")]
    Memory(u64),
    /// The watcher of the progress ended it.
    #[error("stopped before its end")]
    Stopped,
}

/// Parts that a run keeps besides its figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Every sample and event; the bounds on stick-slip by counts and voltage among the figures.
    Trace,
    /// Nothing: for sweeps, whose traces would fill the memory.
    Figures,
}

/// A rig and a path at the start of a run.
pub struct Prepared<'a, T> {
    /// The path.
    pub reference: Reference<'a, T>,
    /// The rig, at the path's beginning.
    pub moving: MovingRig,
    /// Voltage on the brake before the first tick, V.
    pub volts: f64,
    /// Engine that moves the rig.
    pub engine: EngineKind,
}

impl<T: Real> Prepared<'_, T> {
    /// The servo's state for the first tick.
    #[must_use]
    pub fn servo_state<C: ControlLaw<T>>(&self, servo: &Servo<T, C>) -> ServoState<T, C::State> {
        let (first, volts) = (self.reference.at(0), T::from_f64(self.volts));
        if self.moving.rig().params.encoder.quantised {
            servo.start(self.moving.counts(), &first, volts)
        } else {
            servo.start_at(self.moving.fine_counts(), &first, volts)
        }
    }
}
