//! Servo, supervisor and path of a shaft: what a program of one's own calls once a period.

use crate::memory::{clutch_result, input, kept, object, outcome, output, room};
use crate::path::{Planned, clutch_target};
use crate::safe::clutch_safe_codes;
use crate::servo::clutch_output;
use crate::settings::{build, clutch_misfit, clutch_run};
use clutch_core::law::LawState;
use clutch_core::supervisor::{BoardMode, Cause, Cycle, Sample, State, SupervisorState};
use clutch_core::{BeginningAt, Counts, Dac, DacCode, FixedCounts, Micros, Servo, Supervisor};

/// A sample of the encoder. Fill it with zeros, then set what you know.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct clutch_sample {
    /// Running number of the periods; wraps. A number left out is a lost sample.
    pub sequence: u16,
    /// The state of the converter's side, one of `CLUTCH_BOARD_*`: `CLUTCH_BOARD_DRIVING` while it takes codes.
    pub board: u8,
    /// Not 0: there is no encoder.
    pub encoder_fault: u8,
    /// Not 0: the converter does not do what it is told.
    pub converter_fault: u8,
    /// Not 0: the code before came too late and was refused.
    pub command_late: u8,
    /// Not 0: a newer sample is there already, and this one is not to be answered.
    pub superseded: u8,
    /// Time of the sample, us; wraps.
    pub time_us: u32,
    /// Counts of the encoder; wrap.
    pub counts: i32,
    /// Time that the answer to the sample before took, us.
    pub lateness_us: u32,
}

/// The converter's side is ready and its output as it was.
pub const CLUTCH_BOARD_READY: u8 = 0;
/// It takes codes.
pub const CLUTCH_BOARD_DRIVING: u8 = 1;
/// It is in its safe state, or as it was at power-up.
pub const CLUTCH_BOARD_SAFE: u8 = 2;

/// The outcome of a sample.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct clutch_cycle {
    /// Period of the run, from 0 at the first answer.
    pub tick: u64,
    /// The code that the converter has or is to have: an answer of the law, or the safe state's. Write it if `answered` or
    /// if control has ended.
    pub code: u16,
    /// 1 if the law has answered this sample.
    pub answered: u8,
    /// The fate of the sample, one of `CLUTCH_ARRIVAL_*`.
    pub arrival: u8,
    /// The state before, one of `CLUTCH_STATE_*`.
    pub from: u8,
    /// The state after.
    pub state: u8,
    /// The cause of the end of control, one of `CLUTCH_CAUSE_*`.
    pub cause: u8,
    /// 1 if the law was asked: `target` and `output` hold.
    pub asked: u8,
    /// The quantity that the check saw which ended control, in its unit: events, counts, us, rad or V.
    pub value: f32,
    /// The target, with the start of the run added.
    pub target: clutch_target,
    /// The servo's output.
    pub output: clutch_output,
}

/// An axis and its state.
pub(crate) struct Kept {
    servo: Servo<f32>,
    supervisor: Supervisor<f32>,
    planned: Planned,
    state: SupervisorState<f32, LawState<f32>>,
    /// The position at which the path begins: the counts of the first sample that is answered.
    origin: FixedCounts,
    ticks: u64,
}

/// Memory of an axis.
#[repr(C)]
pub struct clutch_axis {
    opaque: [u64; 384],
}

kept!(clutch_axis, Kept, b"cl_axis ");

/// Builds the axis of a run, without consent to drive it. The points of a table are borrowed: they stay where they are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_build(
    axis: *mut clutch_axis,
    run: *const clutch_run,
    misfit: *mut clutch_misfit,
) -> clutch_result {
    // SAFETY: the caller's promise.
    unsafe {
        build(axis, run, misfit, |built, knots| {
            let mut kept = Kept {
                servo: built.servo,
                supervisor: built.supervisor,
                planned: Planned { path: built.path, knots },
                state: SupervisorState::default(),
                origin: FixedCounts(0),
                ticks: built.ticks,
            };
            kept.supervisor.connect(&mut kept.state);
            Ok(kept)
        })
    }
}

/// Consent: the next sample starts the law. `present` is the code that the converter has now. `CLUTCH_WRONG_STATE` if the axis
/// is not ready: after an end it wants `clutch_axis_acknowledge` first.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_consent(axis: *mut clutch_axis, present: u16) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let kept = unsafe { object::<Kept>(axis)? };
        let armed = kept.supervisor.arm(&mut kept.state, DacCode(present));
        if armed { Ok(()) } else { Err(clutch_result::CLUTCH_WRONG_STATE) }
    })
}

/// One period: a sample in, what to do out. The law answers the run's last tick, too; the axis has ended then, as if stopped, and
/// `clutch_axis_state` and the next sample say so.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_sample(
    axis: *mut clutch_axis,
    sample: *const clutch_sample,
    cycle: *mut clutch_cycle,
) -> clutch_result {
    outcome(|| {
        room(cycle)?;
        // SAFETY: the caller's promise.
        let (kept, sample) = unsafe { (object::<Kept>(axis)?, input(sample)?) };
        let done = kept.sample(&sample.sample());
        // SAFETY: the caller's promise.
        unsafe { output(cycle, done) }
    })
}

/// A period without a sample, once each: `cycles` periods, this one among them, since the last sample came. The safe
/// state takes its next step where control has ended. `clutch_axis_state` has the code to write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_silence(axis: *mut clutch_axis, cycles: u32) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let kept = unsafe { object::<Kept>(axis)? };
        kept.supervisor.pass(&mut kept.state);
        kept.supervisor.silence(&mut kept.state, cycles);
        Ok(())
    })
}

/// An operator's stop: the safe state, without a fault. Its steps come with the samples, or with `clutch_axis_silence`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_stop(axis: *mut clutch_axis) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let kept = unsafe { object::<Kept>(axis)? };
        kept.supervisor.stop(&mut kept.state, Cause::Operator);
        Ok(())
    })
}

/// Consent to leave the safe state: the axis is ready, everything is forgotten. The converter keeps its code, that of a ramp under
/// way, too.
/// `CLUTCH_WRONG_STATE` if control has not ended.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_acknowledge(axis: *mut clutch_axis) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let kept = unsafe { object::<Kept>(axis)? };
        if !matches!(kept.state.state(), State::Faulted | State::Holding | State::Released) {
            return Err(clutch_result::CLUTCH_WRONG_STATE);
        }
        kept.supervisor.acknowledge(&mut kept.state);
        Ok(())
    })
}

/// The state, one of `CLUTCH_STATE_*`, the cause of the end of control, one of `CLUTCH_CAUSE_*`, and the code that the
/// converter has or is to have. A pointer that is null is left out.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_state(
    axis: *mut clutch_axis,
    state: *mut u8,
    cause: *mut u8,
    code: *mut u16,
) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let kept = unsafe { object::<Kept>(axis)? };
        let s = &kept.state;
        if !state.is_null() {
            // SAFETY: the caller's promise.
            unsafe { output(state, s.state() as u8)? };
        }
        if !cause.is_null() {
            // SAFETY: the caller's promise.
            unsafe { output(cause, s.cause() as u8)? };
        }
        if !code.is_null() {
            // SAFETY: the caller's promise.
            unsafe { output(code, s.code().0)? };
        }
        Ok(())
    })
}

/// The voltage that a code stands for, V: for a converter of another kind than the settings'.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_volts(
    axis: *mut clutch_axis,
    code: u16,
    volts: *mut f32,
) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let kept = unsafe { object::<Kept>(axis)? };
        // SAFETY: the caller's promise.
        unsafe { output(volts, kept.servo.dac().volts(DacCode(code))) }
    })
}

/// The safe state of the axis, for a watchdog.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn clutch_axis_safe(
    axis: *mut clutch_axis,
    codes: *mut clutch_safe_codes,
) -> clutch_result {
    outcome(|| {
        // SAFETY: the caller's promise.
        let kept = unsafe { object::<Kept>(axis)? };
        // SAFETY: the caller's promise.
        unsafe { output(codes, clutch_safe_codes::of(kept.supervisor.safe_codes())) }
    })
}

impl clutch_sample {
    fn sample(&self) -> Sample {
        Sample {
            sequence: self.sequence,
            time: Micros(self.time_us),
            counts: Counts(self.counts),
            board: match self.board {
                CLUTCH_BOARD_READY => BoardMode::Ready,
                CLUTCH_BOARD_DRIVING => BoardMode::Driving,
                _ => BoardMode::Safe,
            },
            encoder_fault: self.encoder_fault != 0,
            converter_fault: self.converter_fault != 0,
            command_late: self.command_late != 0,
            superseded: self.superseded != 0,
            lateness: Micros(self.lateness_us),
        }
    }
}

impl Kept {
    fn sample(&mut self, sample: &Sample) -> clutch_cycle {
        if self.state.state() == State::Armed {
            self.origin = FixedCounts::from_counts(i64::from(sample.counts.0));
        }
        let planned = self.planned;
        let at = |tick: u64| planned.at(tick);
        let from_here = BeginningAt { planned: &at, origin: self.origin };
        let cycle = self.supervisor.sample(&self.servo, &mut self.state, sample, from_here);
        if self.state.state() == State::Running && self.state.tick().saturating_add(1) >= self.ticks {
            self.supervisor.stop(&mut self.state, Cause::Done);
        }
        told(&cycle, self.servo.dac())
    }
}

fn told(cycle: &Cycle<f32>, dac: &Dac<f32>) -> clutch_cycle {
    clutch_cycle {
        tick: cycle.tick,
        code: cycle.code.0,
        answered: cycle.answer.is_some().into(),
        arrival: cycle.arrival as u8,
        from: cycle.from as u8,
        state: cycle.state as u8,
        cause: cycle.cause as u8,
        asked: cycle.output.is_some().into(),
        value: cycle.value,
        target: clutch_target::of(&cycle.target),
        output: cycle.output.as_ref().map(|out| clutch_output::of(out, dac)).unwrap_or_default(),
    }
}
