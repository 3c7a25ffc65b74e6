//! The role of this machine at its line: the controller itself, or the host of a board that is the controller.
//!
//! Both are asked the same, and report the same, so that pre-flight, loop and virtual time need not know
//! which of the two it is.

use crate::cause_words::why;
use clutch_core::law::{ControlLaw, LawTerms, Terms};
use clutch_core::{Dac, DacCode, Encoder, FixedCounts, Micros, Planned, Real, Servo};
use clutch_node::{ControllerNode, HostNode, LinkCounts, Notice, Outbox, Standing};
use clutch_settings::Settings;
use clutch_wire::{Decoder, Set, StopReason};
use std::collections::VecDeque;
use std::convert::Infallible;

/// The interval at which the host shows that it lives, ns; [`HOST_SILENCE`] is the silence after which the board ends
/// a run.
pub const ALIVE_NS: u64 = 100_000_000;
/// See [`ALIVE_NS`].
pub const HOST_SILENCE: Micros = Micros(1_000_000);
/// After so long without a word of the board, control has ended for the host.
pub const BOARD_SILENCE_NS: u64 = 1_000_000_000;

/// A report of a station.
pub type StationNotice<S> = Notice<<S as Station>::Scalar, <S as Station>::Terms>;

/// A controller, or the host of one, at a line. Times are this machine's monotonic clock, or a computed one, ns.
pub trait Station {
    /// The scalar of its law.
    type Scalar: Real;
    /// The terms of its law.
    type Terms: Terms<Self::Scalar>;
    /// The servo that takes over where gains are changed while it runs.
    type Servo: Send;
    /// True if a board closes the loop, and this machine looks on. Then what comes over the line are reports, each with
    /// a time of its own, and the board ends the run by itself; samples are heard together, as the newest of them
    /// counts.
    const LOOKS_ON: bool;

    /// Asks who is there.
    fn discover(&mut self, nonce: u32, out: &mut Outbox);
    /// Sends the run to the board; `present` is the code that its converter has now.
    fn configure(&mut self, present: DacCode, out: &mut Outbox);
    /// Consent.
    fn arm(&mut self, out: &mut Outbox);
    /// Asks for the board's clock.
    fn ping(&mut self, nonce: u32, out: &mut Outbox);
    /// Ends control as wanted.
    fn stop(&mut self, reason: StopReason, out: &mut Outbox);
    /// The line is gone.
    fn disconnect(&mut self);
    /// Reports how long the last answer took, from sample to write.
    fn answered(&mut self, lateness: Micros);
    /// The latest time at which [`Station::poll`] has to be called, ns.
    fn poll_at(&self) -> Option<u64>;
    /// Looks at the clock.
    fn poll(&mut self, now_ns: u64, out: &mut Outbox, notices: &mut impl FnMut(StationNotice<Self>));
    /// Bytes from the line.
    fn receive(
        &mut self,
        now_ns: u64,
        bytes: &[u8],
        out: &mut Outbox,
        notices: &mut impl FnMut(StationNotice<Self>),
    );

    /// A servo with other gains takes over from the next sample on.
    fn tune(&mut self, servo: Self::Servo);
    /// The state of control.
    fn standing(&self) -> Standing<Self::Scalar>;
    /// Counts of what the line to encoder and converter has carried.
    fn counts(&self) -> &LinkCounts;
    /// The position at which the path begins.
    fn origin(&self) -> FixedCounts;
    /// The encoder.
    fn encoder(&self) -> Encoder;
    /// The converter.
    fn dac(&self) -> &Dac<Self::Scalar>;
    /// The sampling period.
    fn period(&self) -> Micros;
    /// The reason why it cannot go on, if it cannot.
    fn failure(&self) -> Option<String> {
        None
    }
}

/// A controller in this process, with its path.
pub struct ControllerStation<T: Real, C: ControlLaw<T>, P> {
    /// The controller.
    pub node: ControllerNode<T, C>,
    /// The path, from position 0 on, and the map of the disc.
    pub path: P,
    /// Reads the board's frames.
    line: Decoder,
}

impl<T: Real, C: ControlLaw<T>, P> ControllerStation<T, C, P> {
    /// A controller at a line that has carried nothing yet.
    pub fn new(node: ControllerNode<T, C>, path: P) -> Self {
        ControllerStation { node, path, line: Decoder::new() }
    }
}

impl<T: Real, C: ControlLaw<T> + Send, P: Planned<T>> Station for ControllerStation<T, C, P> {
    type Scalar = T;
    type Terms = C::Terms;
    type Servo = Servo<T, C>;
    const LOOKS_ON: bool = false;

    fn discover(&mut self, nonce: u32, out: &mut Outbox) {
        self.node.discover(nonce, out);
    }
    fn configure(&mut self, present: DacCode, out: &mut Outbox) {
        self.node.configure(present, out);
    }
    fn arm(&mut self, out: &mut Outbox) {
        self.node.arm(out);
    }
    fn ping(&mut self, nonce: u32, out: &mut Outbox) {
        self.node.ping(nonce, out);
    }
    fn stop(&mut self, reason: StopReason, out: &mut Outbox) {
        self.node.stop(reason, out);
    }
    fn disconnect(&mut self) {
        self.node.disconnect();
    }
    fn answered(&mut self, lateness: Micros) {
        self.node.answered(lateness);
    }
    fn poll_at(&self) -> Option<u64> {
        self.node.poll_at()
    }
    fn poll(&mut self, now_ns: u64, out: &mut Outbox, notices: &mut impl FnMut(StationNotice<Self>)) {
        self.node.poll(now_ns, out, notices);
    }
    fn receive(
        &mut self,
        now_ns: u64,
        bytes: &[u8],
        out: &mut Outbox,
        notices: &mut impl FnMut(StationNotice<Self>),
    ) {
        self.node.receive(now_ns, &mut self.line, bytes, &self.path, out, notices);
    }
    fn tune(&mut self, servo: Servo<T, C>) {
        self.node.tune(servo);
    }
    fn standing(&self) -> Standing<T> {
        let s = self.node.state();
        Standing {
            state: s.state(),
            cause: s.cause(),
            value: s.value(),
            tick: s.tick(),
            lost: s.lost(),
            rejected: s.rejected(),
            deadline_misses: s.deadline_misses(),
            untold: 0,
        }
    }
    fn counts(&self) -> &LinkCounts {
        self.node.counts()
    }
    fn origin(&self) -> FixedCounts {
        self.node.origin()
    }
    fn encoder(&self) -> Encoder {
        self.node.servo().encoder()
    }
    fn dac(&self) -> &Dac<T> {
        self.node.servo().dac()
    }
    fn period(&self) -> Micros {
        self.node.servo().period()
    }
}

/// The host of a board controller, with the path that the board follows.
pub struct HostStation<P> {
    /// The host.
    pub node: HostNode,
    /// The path, from position 0 on.
    pub path: P,
    /// Settings that go to the board before it is configured, where nobody has sent them before.
    upload: Option<Upload>,
}

/// Settings on their way, each once the one before was taken. The line loses none: who fears for that sends them by the
/// pre-flight, which asks again.
struct Upload {
    settings: Settings,
    /// Those to be sent; the first is on its way.
    waiting: VecDeque<(u16, u64)>,
    failure: Option<String>,
}

impl<P> HostStation<P> {
    /// A host whose board has the run's settings when it is configured.
    pub fn new(node: HostNode, path: P) -> Self {
        HostStation { node, path, upload: None }
    }

    /// A host that sends the run's settings first.
    pub fn uploading(node: HostNode, path: P, settings: Settings) -> Self {
        let upload = Upload { settings, waiting: VecDeque::new(), failure: None };
        HostStation { upload: Some(upload), ..HostStation::new(node, path) }
    }

    /// The next setting, and after the last one the configuration.
    fn set_up(&mut self, out: &mut Outbox) {
        match self.upload.as_ref().and_then(|u| u.waiting.front()) {
            Some((key, value)) => self.node.set(*key, *value, out),
            None => self.node.configure(out),
        }
    }
}

impl<P: Planned<f32>> Station for HostStation<P> {
    type Scalar = f32;
    type Terms = LawTerms<f32>;
    type Servo = Infallible;
    const LOOKS_ON: bool = true;

    fn discover(&mut self, nonce: u32, out: &mut Outbox) {
        self.node.discover(nonce, out);
    }
    fn configure(&mut self, _: DacCode, out: &mut Outbox) {
        if let Some(Upload { settings, waiting, .. }) = &mut self.upload {
            waiting.clear();
            settings.each(|key, value| waiting.push_back((key, value)));
        }
        self.set_up(out);
    }
    fn arm(&mut self, out: &mut Outbox) {
        self.node.arm(out);
    }
    fn ping(&mut self, nonce: u32, out: &mut Outbox) {
        self.node.ping(nonce, out);
    }
    fn stop(&mut self, reason: StopReason, out: &mut Outbox) {
        self.node.stop(reason, out);
    }
    fn disconnect(&mut self) {
        self.node.disconnect();
    }
    fn answered(&mut self, _: Micros) {}
    fn poll_at(&self) -> Option<u64> {
        self.node.poll_at()
    }
    fn poll(&mut self, now_ns: u64, out: &mut Outbox, notices: &mut impl FnMut(StationNotice<Self>)) {
        self.node.poll(now_ns, out, notices);
    }
    fn receive(
        &mut self,
        now_ns: u64,
        bytes: &[u8],
        out: &mut Outbox,
        notices: &mut impl FnMut(StationNotice<Self>),
    ) {
        let mut taken = false;
        self.node.receive(now_ns, bytes, &self.path, &mut |n| {
            if let Some(Upload { settings, waiting, failure }) = &mut self.upload {
                match &n {
                    Notice::Taken(m) => taken |= waiting.front() == Some(&(m.key, m.value)),
                    Notice::Refused(m) if m.request == Set::KIND => {
                        let reason = why(m, Some(settings));
                        *failure = Some(format!("the board did not take a setting: {reason}"));
                    }
                    _ => {}
                }
            }
            notices(n);
        });
        if taken {
            if let Some(upload) = &mut self.upload {
                upload.waiting.pop_front();
            }
            self.set_up(out);
        }
    }
    fn tune(&mut self, never: Infallible) {
        match never {}
    }
    fn standing(&self) -> Standing<f32> {
        *self.node.standing()
    }
    fn counts(&self) -> &LinkCounts {
        self.node.counts()
    }
    fn origin(&self) -> FixedCounts {
        self.node.origin()
    }
    fn encoder(&self) -> Encoder {
        self.node.servo().encoder()
    }
    fn dac(&self) -> &Dac<f32> {
        self.node.servo().dac()
    }
    fn period(&self) -> Micros {
        self.node.servo().period()
    }
    fn failure(&self) -> Option<String> {
        self.upload.as_ref()?.failure.clone()
    }
}
