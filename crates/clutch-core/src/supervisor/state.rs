//! Inputs, memory and answers of the supervisor.

use super::cause::Cause;
use super::envelope::EnvelopeState;
use super::pace::Pace;
use crate::law::LawTerms;
use crate::safe_state::SafeRun;
use crate::{Arithmetic, Counts, DacCode, FixedCounts, Micros, Real, ServoOutput, ServoState, Target};

/// The state of control; see the [module](super)'s diagram.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// No link.
    #[default]
    Disconnected = 0,
    /// Samples come; the board's output is not ours.
    Ready = 1,
    /// Consent is given; the next sample starts the law.
    Armed = 2,
    /// The law answers.
    Running = 3,
    /// Ended as wanted, brake on.
    Holding = 4,
    /// Ended as wanted, brake let go.
    Released = 5,
    /// Ended by a check, latched.
    Faulted = 6,
}

impl State {
    /// The one of this number; none if there is none.
    #[must_use]
    pub fn from_u8(number: u8) -> Option<State> {
        const ALL: [State; 7] = [
            State::Disconnected,
            State::Ready,
            State::Armed,
            State::Running,
            State::Holding,
            State::Released,
            State::Faulted,
        ];
        ALL.get(usize::from(number)).copied()
    }
}

/// The board's report of itself with a sample.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoardMode {
    /// Configured, output as it was.
    #[default]
    Ready,
    /// Armed or running: takes codes.
    Driving,
    /// In its safe state, or as it was at power-up.
    Safe,
}

/// A sample as it came over the link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// Running number of the board's periods; wraps.
    pub sequence: u16,
    /// Time of the measurement by the board's clock; wraps.
    pub time: Micros,
    /// Encoder counts.
    pub counts: Counts,
    /// The board's state.
    pub board: BoardMode,
    /// The board sees no encoder.
    pub encoder_fault: bool,
    /// The board's converter does not do what it is told.
    pub converter_fault: bool,
    /// The board refused the last code because it came too late.
    pub command_late: bool,
    /// A newer sample has arrived already: this one is not answered.
    pub superseded: bool,
    /// Time that the answer to the sample before took.
    pub lateness: Micros,
}

/// The fate of a sample.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Arrival {
    /// In order and in time.
    #[default]
    Fresh = 0,
    /// It did not come.
    Missing = 1,
    /// Came before.
    Duplicate = 2,
    /// Older than one that came before.
    Reordered = 3,
    /// A newer one was there already.
    Late = 4,
    /// Its counts are not believed.
    Implausible = 5,
}

impl Arrival {
    /// The one of this number; none if there is none.
    #[must_use]
    pub fn from_u8(number: u8) -> Option<Arrival> {
        const ALL: [Arrival; 6] = [
            Arrival::Fresh,
            Arrival::Missing,
            Arrival::Duplicate,
            Arrival::Reordered,
            Arrival::Late,
            Arrival::Implausible,
        ];
        ALL.get(usize::from(number)).copied()
    }

    /// True if a period of the board has passed with it.
    #[must_use]
    pub fn is_fresh(self) -> bool {
        matches!(self, Arrival::Fresh | Arrival::Late | Arrival::Implausible)
    }
}

/// The outcome of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cycle<T: Arithmetic, Terms = LawTerms<T>> {
    /// Period of the run, from 0 at the first answer.
    pub tick: u64,
    /// The fate of the sample.
    pub arrival: Arrival,
    /// State before.
    pub from: State,
    /// State after.
    pub state: State,
    /// The cause of the end of control, if it has ended.
    pub cause: Cause,
    /// The quantity that the check saw, in its unit: a count of events, counts, µs, rad or V.
    pub value: T,
    /// The code to send; none where a sample is not to be answered.
    pub answer: Option<DacCode>,
    /// The code that the converter has or is to have.
    pub code: DacCode,
    /// The path's target, where the law was asked.
    pub target: Target<T>,
    /// The servo's output, where it was asked.
    pub output: Option<ServoOutput<T, Terms>>,
}

/// The periods, of the last 128, in which something happened. `now` is the number of the present period.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct History {
    /// A bit for each period, the lowest for the newest with a mark; in two words, the lower one first, so that no state needs
    /// more alignment than a word of 64 bits has.
    marks: [u64; 2],
    /// The number of that one. So a period in which nothing happens costs nothing.
    newest: u64,
}

impl History {
    /// The marks, the lowest bit that of the present period.
    fn seen(&self, now: u64) -> u128 {
        let passed = u32::try_from(now.wrapping_sub(self.newest)).unwrap_or(u32::MAX);
        let [low, high] = self.marks;
        (u128::from(high) << 64 | u128::from(low)).checked_shl(passed).unwrap_or(0)
    }

    /// Keeps marks, the lowest bit that of the present period; their number.
    fn keep(&mut self, marks: u128, now: u64) -> u32 {
        *self = History { marks: [marks as u64, (marks >> 64) as u64], newest: now };
        marks.count_ones()
    }

    /// Marks the present period; the number of marks.
    // A function of its own in machine code: there are six of them, and they are called seldom.
    #[cold]
    #[inline(never)]
    pub(super) fn mark(&mut self, now: u64) -> u32 {
        let seen = self.seen(now);
        // A period that has a mark already marks one before it: each event counts.
        self.keep(seen | seen.wrapping_add(1), now)
    }

    /// Marks the present period and those before it, so many in all, none of which has a mark; the number of marks.
    pub(super) fn mark_many(&mut self, periods: u32, now: u64) -> u32 {
        let many = 1_u128.checked_shl(periods).unwrap_or(0).wrapping_sub(1);
        self.keep(self.seen(now) | many, now)
    }

    /// True if there is a mark.
    #[inline]
    pub(super) fn any(&self, now: u64) -> bool {
        // The newest period with a mark has the lowest bit.
        self.marks[0] as u32 & 1 != 0 && now.wrapping_sub(self.newest) < 128
    }
}

/// Memory of the supervisor and its servo; a clone is a snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SupervisorState<T, S> {
    pub(super) state: State,
    pub(super) cause: Cause,
    pub(super) value: T,
    pub(super) code: DacCode,
    pub(super) safe: SafeRun,
    pub(super) servo: ServoState<T, S>,
    pub(super) tick: u64,
    /// The next tick, and its target, computed before its sample comes.
    pub(super) expected: Option<(u64, Target<T>)>,
    /// The tick that the law was last asked for.
    pub(super) served: Option<u64>,
    /// Position of the last target.
    pub(super) last_target: Option<FixedCounts>,
    pub(super) started: bool,
    pub(super) sequence: u16,
    /// Periods that have passed.
    pub(super) periods: u64,
    pub(super) time: Micros,
    pub(super) pace: Pace,
    pub(super) counts: Counts,
    pub(super) reckoned: bool,
    /// Counts per period between the last two samples that passed.
    pub(super) rate: i32,
    /// Periods since the last sample that passed.
    pub(super) unpassed: u32,
    pub(super) recovering: u32,
    pub(super) saturated: u32,
    pub(super) envelope: EnvelopeState<T>,
    pub(super) lost: History,
    pub(super) late: History,
    pub(super) duplicated: History,
    pub(super) reordered: History,
    pub(super) jump: History,
    pub(super) overrun: History,
    pub(super) lost_total: u64,
    pub(super) rejected_total: u64,
    pub(super) deadline_misses: u64,
}

impl<T: Real, S> SupervisorState<T, S> {
    /// True if the line has lost codes or samples, as seen from this period.
    #[inline]
    pub(super) fn losses(&self, now: u64) -> bool {
        self.lost.any(now) || self.late.any(now)
    }

    /// The state of control.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// The cause of the end of control, if it has ended.
    #[must_use]
    pub fn cause(&self) -> Cause {
        self.cause
    }

    /// The quantity that the check that ended it saw; see [`Cycle::value`].
    #[must_use]
    pub fn value(&self) -> T {
        self.value
    }

    /// The code that the converter has or is to have.
    #[must_use]
    pub fn code(&self) -> DacCode {
        self.code
    }

    /// Period of the run, from 0 at the first answer.
    #[must_use]
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Samples lost since the start.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost_total
    }

    /// Samples refused as implausible since the start.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected_total
    }

    /// Answers later than the deadline since the start.
    #[must_use]
    pub fn deadline_misses(&self) -> u64 {
        self.deadline_misses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_of_the_wire_names_what_it_was_made_of() {
        for n in 0..=u8::MAX {
            assert_eq!(State::from_u8(n).map(|s| s as u8), (n <= 6).then_some(n));
            assert_eq!(Cause::from_u8(n).map(|c| c as u8), (n <= 20).then_some(n));
            assert_eq!(Arrival::from_u8(n).map(|a| a as u8), (n <= 5).then_some(n));
        }
    }
}
