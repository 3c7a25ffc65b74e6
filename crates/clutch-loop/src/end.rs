//! The controller's end of a run: a controller in this process, or a board that is one.
//!
//! Both are asked and told the same, so that pre-flight, loop and virtual time need not know which
//! of the two it is.

use clutch_core::law::{Controller, LawTerms, Terms};
use clutch_core::{Dac, DacCode, Encoder, FixedCounts, Micros, Real, Target};
use clutch_node::{ControlNode, LinkCounts, Notice, Outbox, RemoteNode, Told};
use clutch_wire::StopReason;

/// What an end tells.
pub type Tells<E> = Notice<<E as End>::Scalar, <E as End>::Terms>;

/// The controller's end. Times are this machine's monotonic clock, or a computed one, ns.
pub trait End {
    /// The scalar of its law.
    type Scalar: Real;
    /// The terms of its law.
    type Terms: Terms<Self::Scalar>;
    /// Whether a board closes the loop. Then what comes over the line are reports, each with a time of its
    /// own, and the board ends the run by itself; samples are heard together, as the newest of them counts.
    const IS_CONTROLLER: bool;

    /// Asks who is there.
    fn discover(&mut self, nonce: u32, out: &mut Outbox);
    /// Tells the board of the run; `present` is the code that its converter has now.
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
    /// When [`End::poll`] has to be called at the latest, ns.
    fn poll_at(&self) -> Option<u64>;
    /// Looks at the clock.
    fn poll(&mut self, now_ns: u64, out: &mut Outbox, notices: &mut impl FnMut(Tells<Self>));
    /// Bytes from the line.
    fn receive(&mut self, now_ns: u64, bytes: &[u8], out: &mut Outbox, notices: &mut impl FnMut(Tells<Self>));

    /// Where control stands.
    fn told(&self) -> Told<Self::Scalar>;
    /// What the line to encoder and converter has carried.
    fn counts(&self) -> &LinkCounts;
    /// Where the path begins.
    fn origin(&self) -> FixedCounts;
    /// The encoder.
    fn encoder(&self) -> Encoder;
    /// The converter.
    fn dac(&self) -> &Dac<Self::Scalar>;
    /// The sampling period.
    fn period(&self) -> Micros;
    /// Why it cannot go on, if it cannot.
    fn failure(&self) -> Option<String> {
        None
    }
}

/// A controller in this process, with its path.
pub struct Local<T: Real, C: Controller<T>, P> {
    /// The controller.
    pub node: ControlNode<T, C>,
    /// The path, from position 0 on.
    pub path: P,
}

impl<T: Real, C: Controller<T>, P: Fn(u64) -> Target<T>> End for Local<T, C, P> {
    type Scalar = T;
    type Terms = C::Terms;
    const IS_CONTROLLER: bool = false;

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
    fn poll(&mut self, now_ns: u64, out: &mut Outbox, notices: &mut impl FnMut(Tells<Self>)) {
        self.node.poll(now_ns, out, notices);
    }
    fn receive(
        &mut self,
        now_ns: u64,
        bytes: &[u8],
        out: &mut Outbox,
        notices: &mut impl FnMut(Tells<Self>),
    ) {
        self.node.receive(now_ns, bytes, &self.path, out, notices);
    }
    fn told(&self) -> Told<T> {
        let s = self.node.state();
        Told {
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

/// A board in the controller role, with the path that it follows.
pub struct Remote<P> {
    /// What hears the board.
    pub node: RemoteNode,
    /// The path, from position 0 on.
    pub path: P,
}

impl<P: Fn(u64) -> Target<f32>> End for Remote<P> {
    type Scalar = f32;
    type Terms = LawTerms<f32>;
    const IS_CONTROLLER: bool = true;

    fn discover(&mut self, nonce: u32, out: &mut Outbox) {
        self.node.discover(nonce, out);
    }
    fn configure(&mut self, _: DacCode, out: &mut Outbox) {
        self.node.configure(out);
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
    fn poll(&mut self, now_ns: u64, out: &mut Outbox, notices: &mut impl FnMut(Tells<Self>)) {
        self.node.poll(now_ns, out, notices);
    }
    fn receive(&mut self, now_ns: u64, bytes: &[u8], _: &mut Outbox, notices: &mut impl FnMut(Tells<Self>)) {
        self.node.receive(now_ns, bytes, &self.path, notices);
    }
    fn told(&self) -> Told<f32> {
        *self.node.told()
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
}
