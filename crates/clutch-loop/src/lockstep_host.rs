//! The host of a board controller that is asked in lockstep.

use crate::build_error::BuildError;
use crate::from_scenario::{self, BuiltRun};
use crate::lockstep_board::LockstepBoard;
use crate::station::{ALIVE_NS, BOARD_SILENCE_NS, HOST_SILENCE, Station, StationNotice};
use clutch_core::law::LawTerms;
use clutch_core::{Dac, DacCode, Encoder, FixedCounts, Micros, Planned};
use clutch_node::controller_lockstep::Exchange;
use clutch_node::{ControllerNode, HostNode, LinkCounts, Notice, Outbox, Standing};
use clutch_settings::Settings;
use clutch_sim::Scenario;
use clutch_wire::{Arm, Configure, Refused, StopReason};
use std::convert::Infallible;

/// A board controller that is asked in lockstep, and its host.
pub struct LockstepHost<L, P> {
    host: HostNode,
    link: L,
    settings: Settings,
    path: P,
    to_board: Outbox,
    now_ns: u64,
    lateness: Micros,
    poll_at: Option<u64>,
    failure: Option<String>,
}

/// For a scenario in single precision, whose run takes so many ticks.
///
/// # Errors
/// The scenario has no safe state, or asks for what boards do not have.
pub fn lockstep_host<'a, L: LockstepBoard>(
    scenario: &'a Scenario,
    built: &BuiltRun<f32>,
    link: L,
    ticks: u64,
) -> Result<LockstepHost<L, impl Planned<f32> + 'a>, BuildError> {
    let configure = ControllerNode::new(built.controller, built.servo, built.supervisor).configuration();
    Ok(LockstepHost {
        host: HostNode::new(built.servo, configure, ALIVE_NS, BOARD_SILENCE_NS),
        link,
        // A board that keeps its own time waits as long for the host as for encoder and converter.
        settings: from_scenario::settings(
            scenario,
            built,
            HOST_SILENCE.max(built.controller.silence),
            ticks,
        )?,
        path: from_scenario::path::<f32>(scenario)?,
        to_board: Outbox::default(),
        now_ns: 0,
        lateness: Micros(0),
        poll_at: None,
        failure: None,
    })
}

impl<L: LockstepBoard, P: Planned<f32>> LockstepHost<L, P> {
    /// The link.
    pub fn link(&mut self) -> &mut L {
        &mut self.link
    }

    /// The host's frames and these bytes go to the board; the board's frames come back.
    fn turn(&mut self, daq: &[u8], out: &mut Outbox, notices: &mut impl FnMut(Notice<f32, LawTerms<f32>>)) {
        if self.failure.is_some() {
            return;
        }
        let request = Exchange {
            time_ns: self.now_ns,
            lateness_us: std::mem::take(&mut self.lateness).0,
            host: self.to_board.as_bytes(),
            daq,
        };
        match self.link.exchange(&request) {
            Ok(answer) => {
                self.poll_at = (answer.time_ns != u64::MAX).then_some(answer.time_ns);
                out.append(answer.daq);
                self.host.receive(self.now_ns, answer.host, &self.path, notices);
            }
            Err(why) => self.failure = Some(why),
        }
        self.to_board.clear();
    }

    /// Sends a request that the board itself may refuse.
    fn request(&mut self, kind: u8, what: &str, out: &mut Outbox) {
        let mut refused = None;
        self.turn(&[], out, &mut |n| {
            if let Notice::Refused(m) = n
                && m.request == kind
            {
                refused = Some(m);
            }
        });
        if let Some(m) = refused {
            self.failure = Some(format!(
                "the board refused to {what}: {}",
                crate::cause_words::why(&m, Some(&self.settings))
            ));
        }
    }

    /// The settings, one by one: the board's answer to each is waited for.
    fn upload(&mut self, out: &mut Outbox) {
        let mut all = Vec::new();
        self.settings.each(|key, value| all.push((key, value)));
        for (key, value) in all {
            self.host.set(key, value, &mut self.to_board);
            let (mut taken, mut refused) = (false, None);
            self.turn(&[], out, &mut |n| match n {
                Notice::Taken(m) => taken |= (m.key, m.value) == (key, value),
                Notice::Refused(m) => refused = Some(m),
                _ => {}
            });
            if !taken && self.failure.is_none() {
                let why = |m: &Refused| crate::cause_words::why(m, Some(&self.settings));
                let why = refused.as_ref().map_or("it did not answer".to_owned(), why);
                self.failure = Some(format!("the board did not take the setting {key:#06x}: {why}"));
            }
        }
    }
}

impl<L: LockstepBoard, P: Planned<f32>> Station for LockstepHost<L, P> {
    type Scalar = f32;
    type Terms = LawTerms<f32>;
    type Servo = Infallible;
    const LOOKS_ON: bool = true;

    fn discover(&mut self, nonce: u32, out: &mut Outbox) {
        self.host.discover(nonce, &mut self.to_board);
        self.turn(&[], out, &mut |_| ());
    }
    fn configure(&mut self, _: DacCode, out: &mut Outbox) {
        self.upload(out);
        self.host.configure(&mut self.to_board);
        self.request(Configure::KIND, "be configured", out);
    }
    fn arm(&mut self, out: &mut Outbox) {
        self.host.arm(&mut self.to_board);
        self.request(Arm::KIND, "be armed", out);
    }
    fn ping(&mut self, nonce: u32, out: &mut Outbox) {
        self.host.ping(nonce, &mut self.to_board);
        self.turn(&[], out, &mut |_| ());
    }
    fn stop(&mut self, reason: StopReason, _: &mut Outbox) {
        // It goes with the next turn, whose notices are heard: the board itself says that control has ended.
        self.host.stop(reason, &mut self.to_board);
    }
    fn disconnect(&mut self) {
        self.host.disconnect();
    }
    fn answered(&mut self, lateness: Micros) {
        self.lateness = lateness;
    }
    fn poll_at(&self) -> Option<u64> {
        [self.host.poll_at(), self.poll_at].into_iter().flatten().min()
    }
    fn poll(&mut self, now_ns: u64, out: &mut Outbox, notices: &mut impl FnMut(StationNotice<Self>)) {
        self.now_ns = now_ns;
        self.host.poll(now_ns, &mut self.to_board, notices);
        if !self.to_board.is_empty() || self.poll_at.is_some_and(|t| now_ns >= t) {
            self.turn(&[], out, notices);
        }
    }
    fn receive(
        &mut self,
        now_ns: u64,
        bytes: &[u8],
        out: &mut Outbox,
        notices: &mut impl FnMut(StationNotice<Self>),
    ) {
        self.now_ns = now_ns;
        self.turn(bytes, out, notices);
    }
    fn tune(&mut self, never: Infallible) {
        match never {}
    }
    fn standing(&self) -> Standing<f32> {
        *self.host.standing()
    }
    fn counts(&self) -> &LinkCounts {
        self.host.counts()
    }
    fn origin(&self) -> FixedCounts {
        self.host.origin()
    }
    fn encoder(&self) -> Encoder {
        self.host.servo().encoder()
    }
    fn dac(&self) -> &Dac<f32> {
        self.host.servo().dac()
    }
    fn period(&self) -> Micros {
        self.host.servo().period()
    }
    fn failure(&self) -> Option<String> {
        self.failure.clone()
    }
}
