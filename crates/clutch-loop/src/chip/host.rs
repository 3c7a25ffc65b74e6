//! The host of a board controller that sends the run's settings over its line, in virtual time.

use crate::preflight;
use crate::station::{HostStation, Station, StationNotice};
use clutch_core::law::LawTerms;
use clutch_core::{Dac, DacCode, Encoder, FixedCounts, Micros, Planned};
use clutch_node::{LinkCounts, Notice, Outbox, Settings, Standing};
use clutch_wire::{Refused, Set, StopReason};
use std::collections::VecDeque;

/// A host that has the board take its settings before it configures it, each once the one before was taken.
pub struct UploadingHost<P> {
    host: HostStation<P>,
    settings: Settings,
    /// Settings to be sent; the first is on its way.
    waiting: VecDeque<(u16, u64)>,
    failure: Option<String>,
}

impl<P: Planned<f32>> UploadingHost<P> {
    /// For a run with these settings.
    pub fn new(host: HostStation<P>, settings: Settings) -> Self {
        UploadingHost { host, settings, waiting: VecDeque::new(), failure: None }
    }

    /// Sends the next setting, and after the last one the configuration.
    fn next(&mut self, out: &mut Outbox) {
        match self.waiting.front() {
            Some((key, value)) => self.host.node.set(*key, *value, out),
            None => self.host.node.configure(out),
        }
    }
}

impl<P: Planned<f32>> Station for UploadingHost<P> {
    type Scalar = f32;
    type Terms = LawTerms<f32>;
    const LOOKS_ON: bool = true;

    fn discover(&mut self, nonce: u32, out: &mut Outbox) {
        self.host.discover(nonce, out);
    }
    fn configure(&mut self, _: DacCode, out: &mut Outbox) {
        self.waiting.clear();
        let waiting = &mut self.waiting;
        self.settings.each(|key, value| waiting.push_back((key, value)));
        self.next(out);
    }
    fn arm(&mut self, out: &mut Outbox) {
        self.host.arm(out);
    }
    fn ping(&mut self, nonce: u32, out: &mut Outbox) {
        self.host.ping(nonce, out);
    }
    fn stop(&mut self, reason: StopReason, out: &mut Outbox) {
        self.host.stop(reason, out);
    }
    fn disconnect(&mut self) {
        self.host.disconnect();
    }
    fn answered(&mut self, lateness: Micros) {
        self.host.answered(lateness);
    }
    fn poll_at(&self) -> Option<u64> {
        self.host.poll_at()
    }
    fn poll(&mut self, now_ns: u64, out: &mut Outbox, notices: &mut impl FnMut(StationNotice<Self>)) {
        self.host.poll(now_ns, out, notices);
    }
    fn receive(
        &mut self,
        now_ns: u64,
        bytes: &[u8],
        out: &mut Outbox,
        notices: &mut impl FnMut(StationNotice<Self>),
    ) {
        let first = self.waiting.front().copied();
        let (mut taken, mut refused) = (false, None::<Refused>);
        self.host.receive(now_ns, bytes, out, &mut |n| {
            match &n {
                Notice::Taken(m) => taken |= first == Some((m.key, m.value)),
                Notice::Refused(m) if m.request == Set::KIND => refused = Some(*m),
                _ => {}
            }
            notices(n);
        });
        if let Some(m) = refused {
            let why = preflight::why(&m, Some(&self.settings));
            self.failure = Some(format!("the board did not take a setting: {why}"));
        } else if taken {
            self.waiting.pop_front();
            self.next(out);
        }
    }
    fn standing(&self) -> Standing<f32> {
        self.host.standing()
    }
    fn counts(&self) -> &LinkCounts {
        self.host.counts()
    }
    fn origin(&self) -> FixedCounts {
        self.host.origin()
    }
    fn encoder(&self) -> Encoder {
        self.host.encoder()
    }
    fn dac(&self) -> &Dac<f32> {
        self.host.dac()
    }
    fn period(&self) -> Micros {
        self.host.period()
    }
    fn failure(&self) -> Option<String> {
        self.failure.clone()
    }
}
