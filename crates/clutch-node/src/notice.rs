//! The reports of a controller, or of the host of one, to its environment.

use clutch_core::supervisor::{Cause, Cycle, State};
use clutch_core::{Arithmetic, Micros};
use clutch_wire::{Configured, ControllerHello, Fault, FrameError, Hello, Refused, Sample, Stopped, Taken};

/// Counts of what the line has carried.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounts {
    /// Samples of this run.
    pub received: u64,
    /// Frames that were not whole.
    pub bad_frames: u64,
    /// Samples of another run.
    pub foreign: u64,
    /// Samples that a newer one had overtaken.
    pub late: u64,
    /// Samples that came twice.
    pub duplicated: u64,
    /// Samples that came after a newer one.
    pub reordered: u64,
}

/// A sample and what it led to.
#[derive(Clone, Copy, Debug)]
pub struct CycleNotice<T: Arithmetic, Terms> {
    /// The sample as it came.
    pub sample: Sample,
    /// True if a newer one was there already.
    pub superseded: bool,
    /// Time that the answer to the sample before took.
    pub lateness: Micros,
    /// Clock cycles of the tick before, where a board counts them; else 0.
    pub cycles: u32,
    /// The cycle that it led to.
    pub cycle: Cycle<T, Terms>,
}

/// A report of a controller, or of the host of one.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "lives on the stack for one call; nothing allocates here")]
pub enum Notice<T: Arithmetic, Terms> {
    /// A board answered.
    Hello(Hello),
    /// A board controller answered.
    ControllerHello(ControllerHello),
    /// The board took a setting.
    Taken(Taken),
    /// The board is configured for this run; samples follow.
    Configured,
    /// A board of another power-up than the one that said who it is: it was reset in between.
    OtherBoot(Configured),
    /// The board takes codes.
    Armed,
    /// The board refused a request.
    Refused(Refused),
    /// The board's clock: the nonce of the request, µs.
    Pong(u32, u32),
    /// The board has stopped.
    Stopped(Stopped),
    /// The board went to its safe state by itself.
    BoardFault(Fault),
    /// A frame that was not whole.
    BadFrame(FrameError),
    /// A controller's own kind of frame: the line echoes, or another controller is on it.
    Echo,
    /// A sample of this run.
    Cycle(CycleNotice<T, Terms>),
    /// The supervisor ended control without a sample.
    Ended(Ending<T>),
}

/// An end of control that no sample brought.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ending<T> {
    /// The supervisor's state before it.
    pub from: State,
    /// And after it.
    pub state: State,
    /// The cause of the end.
    pub cause: Cause,
    /// The value that the check saw.
    pub value: T,
    /// The run's tick.
    pub tick: u64,
}

/// The state of control: of a controller at once, of a board controller as it reported last.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standing<T> {
    /// The supervisor's state.
    pub state: State,
    /// The cause of the end of control.
    pub cause: Cause,
    /// The value seen by the check that ended control.
    pub value: T,
    /// The run's tick.
    pub tick: u64,
    /// Samples lost.
    pub lost: u64,
    /// Samples that were not believed.
    pub rejected: u64,
    /// Answers later than the deadline.
    pub deadline_misses: u64,
    /// Telemetry that did not come.
    pub untold: u64,
}

impl<T> Standing<T> {
    /// The same with another scalar.
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Standing<U> {
        let Standing { state, cause, value, tick, lost, rejected, deadline_misses, untold } = self;
        Standing { state, cause, value: f(value), tick, lost, rejected, deadline_misses, untold }
    }
}
