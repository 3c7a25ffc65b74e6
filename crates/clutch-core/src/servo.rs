//! The servo: encoder counts and target in, DAC code and terms out.
//!
//! ```text
//! counts ─► unwrap ─► e ─┬──────────► law ─► limits ─► DAC code
//! target ───────────────┴─► ė (5) ──┘
//! ```
//!
//! The same type runs in the simulator, in the loop on Linux and on a board. It owns no clock
//! and no I/O; [`Daq`] is the environment it needs.

use crate::error::{cast, require};
use crate::law::{Command, Controller, Law, LawParams, OutputParams, Tick};
use crate::velocity::{VelocityParams, VelocitySource, VelocityState};
use crate::{
    Counts, Dac, DacCode, DacParams, Encoder, FixedCounts, Micros, ParamError, Plant, PlantParams, Real,
    Target,
};

/// The data-acquisition board: one encoder, one converter.
pub trait Daq {
    /// What can go wrong.
    type Error;
    /// The encoder's counts now.
    ///
    /// # Errors
    /// The board's own.
    fn read(&mut self) -> Result<Counts, Self::Error>;
    /// Gives the converter a code.
    ///
    /// # Errors
    /// The board's own.
    fn write(&mut self, code: DacCode) -> Result<(), Self::Error>;
}

/// Everything a servo is built from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoParams<T = f64> {
    /// Sampling period `T`.
    pub period: Micros,
    /// The encoder.
    pub encoder: Encoder,
    /// The converter.
    pub dac: DacParams<T>,
    /// Where the error rate comes from.
    pub velocity: VelocityParams<T>,
    /// What the computed-torque law and an observer believe of the plant.
    pub model: PlantParams<T>,
    /// The law and its gains.
    pub law: LawParams<T>,
    /// Output limits and bumpless start.
    pub output: OutputParams<T>,
}

cast!(ServoParams { } keep { period, encoder } nested { dac, velocity, model, law, output });

impl<T: Real> ServoParams<T> {
    /// The paper's hardware with the given law: 1 ms, 20 000 counts/rev, 12 bit over ±10 V.
    #[must_use]
    pub fn paper(law: LawParams<T>) -> Self {
        ServoParams {
            period: Micros(1000),
            encoder: Encoder::PAPER,
            dac: DacParams::default(),
            velocity: VelocityParams::default(),
            model: PlantParams::default(),
            law,
            output: OutputParams::default(),
        }
    }
}

impl<T: Real> ServoParams<T> {
    /// Whether the converter reaches the output's limits.
    ///
    /// # Errors
    /// Field `lowest` or `highest` of the output.
    pub fn check_output(&self) -> Result<(), ParamError<T>> {
        let (out, dac) = (&self.output, &self.dac);
        let expected = "a voltage that the converter reaches: not above the top of its range, V";
        require("highest", out.highest, out.highest <= dac.highest, expected)?;
        let expected = "a voltage that the converter reaches: not below the bottom of its range, V";
        require("lowest", out.lowest, out.lowest >= dac.lowest, expected)?;
        Ok(())
    }
}

/// A checked servo; never changes in a tick.
///
/// ```
/// use clutch_core::{Counts, FixedCounts, Servo, ServoParams, Target};
/// use clutch_core::law::{LawParams, PdParams};
/// let servo = Servo::<f32>::new(&ServoParams::paper(LawParams::Pd(PdParams::default())))?;
/// let target = Target { position: FixedCounts::from_counts(100), velocity: 0.0, acceleration: 0.0 };
/// let mut state = servo.start(Counts(100), &target, 0.0);
/// let out = servo.tick(&mut state, Counts(101), &target); // one count ahead: brake
/// assert!(out.command.voltage > 0.0);
/// # Ok::<(), clutch_core::ParamError<f32>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servo<T, C = Law<T>> {
    law: C,
    velocity: VelocitySource<T>,
    encoder: Encoder,
    dac: Dac<T>,
    period: Micros,
    radians_per_count: T,
}

/// What a servo remembers; a clone is a snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoState<T, S> {
    /// Unwrapped position.
    position: FixedCounts,
    last: Counts,
    velocity: VelocityState<T>,
    law: S,
    applied: T,
}

/// What a tick gives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoOutput<T, Terms> {
    /// The code for the converter.
    pub code: DacCode,
    /// The voltage that the code stands for, V.
    pub voltage: T,
    /// What the law was given.
    pub tick: Tick<T>,
    /// What the law answered.
    pub command: Command<T, Terms>,
}

impl<T: Real> Servo<T> {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of range, by name; also output limits (`lowest`, `highest`) beyond
    /// the converter's range, at which it would clip unseen.
    pub fn new(p: &ServoParams<T>) -> Result<Self, ParamError<T>> {
        p.check_output()?;
        Servo::with_law(p, Law::new(&p.law, &p.model, &p.output, p.period)?)
    }
}

impl<T: Real, C: Controller<T>> Servo<T, C> {
    /// A servo around a law of your own; `p.law` and `p.output` are not used.
    ///
    /// # Errors
    /// The first parameter out of range, by name.
    pub fn with_law(p: &ServoParams<T>, law: C) -> Result<Self, ParamError<T>> {
        let model = Plant::new(&p.model)?;
        Ok(Servo {
            law,
            velocity: VelocitySource::new(&p.velocity, &model, p.encoder, p.period)?,
            encoder: p.encoder,
            dac: Dac::new(&p.dac)?,
            period: p.period,
            radians_per_count: p.encoder.radians_per_count(),
        })
    }

    /// The law.
    #[must_use]
    pub fn law(&self) -> &C {
        &self.law
    }

    /// The encoder.
    #[must_use]
    pub fn encoder(&self) -> Encoder {
        self.encoder
    }

    /// The converter.
    #[must_use]
    pub fn dac(&self) -> &Dac<T> {
        &self.dac
    }

    /// The sampling period.
    #[must_use]
    pub fn period(&self) -> Micros {
        self.period
    }

    /// The state for a start at `counts` (which becomes the unwrapped position) while the brake
    /// is at `applied` volts and the shaft moves with the target.
    #[must_use]
    pub fn start(&self, counts: Counts, target: &Target<T>, applied: T) -> ServoState<T, C::State> {
        let position = FixedCounts::from_counts(i64::from(counts.0));
        ServoState { last: counts, ..self.start_at(position, target, applied) }
    }

    /// As [`Servo::start`], for [`Servo::tick_at`].
    #[must_use]
    pub fn start_at(&self, position: FixedCounts, target: &Target<T>, applied: T) -> ServoState<T, C::State> {
        let tick = self.measure(position, target, T::ZERO);
        ServoState {
            position,
            last: Counts::default(),
            velocity: self.velocity.start(position, target),
            law: self.law.start(&tick, applied),
            applied,
        }
    }

    /// One period.
    #[inline]
    pub fn tick(
        &self,
        state: &mut ServoState<T, C::State>,
        counts: Counts,
        target: &Target<T>,
    ) -> ServoOutput<T, C::Terms> {
        let moved = FixedCounts::from_counts(i64::from(counts.since(state.last)));
        state.last = counts;
        self.tick_at(state, state.position.plus(moved), target)
    }

    /// One period with a position finer than a count: an interpolating encoder, or the ideal
    /// sensor of a simulation. Use this or [`Servo::tick`] on one state, not both in turn.
    #[inline]
    pub fn tick_at(
        &self,
        state: &mut ServoState<T, C::State>,
        position: FixedCounts,
        target: &Target<T>,
    ) -> ServoOutput<T, C::Terms> {
        state.position = position;
        let error_rate = self.velocity.update(&mut state.velocity, position, target, state.applied);
        let tick = self.measure(position, target, error_rate);
        let command = self.law.update(&mut state.law, &tick);
        let code = self.dac.code(command.voltage);
        state.applied = self.dac.volts(code);
        ServoOutput { code, voltage: state.applied, tick, command }
    }

    /// Reads the board, ticks, writes the board.
    ///
    /// # Errors
    /// The board's own. After a failed read nothing has changed; after a failed write the
    /// servo's state has moved on by the tick whose code was lost.
    pub fn run<D: Daq>(
        &self,
        state: &mut ServoState<T, C::State>,
        daq: &mut D,
        target: &Target<T>,
    ) -> Result<ServoOutput<T, C::Terms>, D::Error> {
        let counts = daq.read()?;
        let output = self.tick(state, counts, target);
        daq.write(output.code)?;
        Ok(output)
    }

    #[inline]
    fn measure(&self, position: FixedCounts, target: &Target<T>, error_rate: T) -> Tick<T> {
        let counts: T = target.position.minus(position);
        Tick {
            error: counts * self.radians_per_count,
            error_rate,
            target_velocity: target.velocity,
            target_acceleration: target.acceleration,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::PdParams;

    /// A board that gives counts and keeps codes, until it fails.
    struct Board {
        counts: Counts,
        code: Option<DacCode>,
        reads: bool,
        writes: bool,
    }

    impl Daq for Board {
        type Error = &'static str;
        fn read(&mut self) -> Result<Counts, &'static str> {
            if self.reads { Ok(self.counts) } else { Err("read") }
        }
        fn write(&mut self, code: DacCode) -> Result<(), &'static str> {
            if self.writes {
                self.code = Some(code);
                Ok(())
            } else {
                Err("write")
            }
        }
    }

    fn servo() -> Servo<f64> {
        Servo::new(&ServoParams::paper(LawParams::Pd(PdParams::default()))).unwrap()
    }

    fn target(counts: i64) -> Target<f64> {
        Target { position: FixedCounts::from_counts(counts), velocity: 0.0, acceleration: 0.0 }
    }

    #[test]
    fn a_board_gets_the_code_of_the_tick() {
        let servo = servo();
        let mut state = servo.start(Counts(0), &target(0), 0.0);
        let mut board = Board { counts: Counts(2), code: None, reads: true, writes: true };
        let out = servo.run(&mut state, &mut board, &target(0)).unwrap();
        assert_eq!(board.code, Some(out.code));
        // Two counts ahead: 5000 V/rad · 6.28e-4 rad + 50 V s/rad · 0.2 · 0.628 rad/s = 9.42 V.
        assert!((out.command.voltage - 9.424_777_960_769).abs() < 1e-9);
    }

    #[test]
    fn a_failed_read_changes_nothing_and_a_failed_write_is_told() {
        let servo = servo();
        let mut state = servo.start(Counts(0), &target(0), 0.0);
        let before = state;
        let mut board = Board { counts: Counts(2), code: None, reads: false, writes: false };
        assert_eq!(servo.run(&mut state, &mut board, &target(0)), Err("read"));
        assert_eq!(state, before);
        board.reads = true;
        assert_eq!(servo.run(&mut state, &mut board, &target(0)), Err("write"));
        assert_eq!(board.code, None);
    }

    #[test]
    fn counts_that_wrap_are_a_shaft_that_turns_on() {
        let servo = servo();
        let start = i64::from(i32::MAX);
        let mut state = servo.start(Counts(i32::MAX), &target(start), 0.0);
        let out = servo.tick(&mut state, Counts(i32::MIN), &target(start + 1));
        assert_eq!(out.tick.error, 0.0);
    }
}
