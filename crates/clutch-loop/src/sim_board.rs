//! The simulated board: a rig that moves, the board's state machine, and broken hardware on
//! request. It knows no clock of its own: the times it is given are its time, ns.

use crate::faults::{Fault, FaultKind, StuckAt};
use clutch_core::{Counts, Dac, DacCode, FixedCounts, ParamError, SafeCodes};
use clutch_node::{BoardNode, BoardParams, Outbox};
use clutch_sim::engine::{EngineError, Event, Motion};
use clutch_sim::rig::Rig;
use clutch_sim::{MovingRig, RunError, Scenario, ScenarioError};
use clutch_wire::{BoardState, Decoder, ResetCause};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// The simulated board could not go on.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SimBoardError {
    /// The scenario does not say how a run on a board ends, or is wrong.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The rig cannot be simulated so.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A parameter of the board.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// The scenario's converter or period is one that no board has.
    #[error(transparent)]
    Board(#[from] clutch_node::BoardMisfit),
    /// A converter cannot be stuck at a voltage that it has not, V.
    #[error("fault dac-stuck = {0}: expected a voltage that the scenario's converter has, V")]
    Stuck(f64),
    /// There is no pad that could lose its contact.
    #[error(
        "fault {0}: expected a brake that lets go at 0 V, [rig.actuator.brake] with preload_nm = 0, or geometry"
    )]
    NoPad(String),
    /// The engine gave up.
    #[error(transparent)]
    Motion(#[from] EngineError),
}

/// Serial number of a simulated board whose clock waits for a controller that a busy machine
/// holds up.
pub const PATIENT_BOARD: u32 = 0;
/// Serial number of a simulated board that keeps real time.
pub const STRICT_BOARD: u32 = 1;

/// A board on a rig, both simulated.
pub struct SimBoard {
    params: BoardParams,
    node: BoardNode,
    line: Decoder,
    rig: MovingRig,
    dac: Dac<f64>,
    faults: Vec<Fault>,
    rng: Pcg64,
    /// Board time, ns, up to which the rig has moved; none before the first sample.
    moved_ns: Option<u64>,
    next_sample_ns: Option<u64>,
    started_ns: u64,
    samples: u64,
    armed_ns: Option<u64>,
    frozen: Option<Counts>,
    /// The counts when one channel died, or the scale changed.
    since: Option<Counts>,
    stuck_at: Option<f64>,
    scaled: Option<f64>,
    lever_broken: bool,
    /// Time by which the board's clock is behind, ns.
    behind_ns: i64,
    reset_done: bool,
    first_hit_ns: Option<u64>,
    events: Vec<Event>,
}

/// Events that wait to be asked for.
const MAX_EVENTS: usize = 1 << 12;

/// The converter in whole millivolts, as the wire carries it.
fn millivolts(volts: f64) -> i32 {
    (volts * 1000.0).round() as i32
}

impl SimBoard {
    /// A board at power-up on the scenario's rig, its shaft at rest under the safe state's
    /// voltage. A patient one reports to the controller that its clock may wait.
    ///
    /// # Errors
    /// The scenario has no safe state, or its rig cannot be simulated.
    pub fn new(
        scenario: &Scenario,
        faults: &[Fault],
        boot: u32,
        patient: bool,
    ) -> Result<Self, SimBoardError> {
        let spec = scenario.spec();
        let safety = scenario.safety()?;
        let rig = Rig::new(&spec.rig, spec.run.seed)?;
        let engine = spec.engine(&rig)?;
        let dac = Dac::new(&spec.rig.dac.converter)?;
        for fault in faults {
            if let FaultKind::DacStuck(StuckAt::Volts(volts)) = fault.kind
                && !(volts >= spec.rig.dac.converter.lowest && volts <= spec.rig.dac.converter.highest)
            {
                return Err(SimBoardError::Stuck(volts));
            }
            let actuator = rig.model.plant.actuator();
            if matches!(fault.kind, FaultKind::Contact(_) | FaultKind::Lever)
                && (actuator.motor_gain() > 0.0 || actuator.preload() > 0.0)
            {
                return Err(SimBoardError::NoPad(fault.kind.to_string()));
            }
        }
        let codes = SafeCodes::new(&safety.on_fault, &dac, spec.period, spec.model.actuator.kind())?;
        let params = BoardParams {
            board: if patient { PATIENT_BOARD } else { STRICT_BOARD },
            boot,
            counts_per_rev: spec.rig.encoder.sensor.counts_per_rev,
            dac_bits: spec.rig.dac.converter.bits,
            dac_lowest_mv: millivolts(spec.rig.dac.converter.lowest),
            dac_highest_mv: millivolts(spec.rig.dac.converter.highest),
            period_min_us: 100,
            period_max_us: 1_000_000,
            watchdog_max_us: 10_000_000,
            boot_code: codes.hold.0,
            started_by: ResetCause::Power,
            brown_out_low: false,
        };
        let node = BoardNode::new(&params)?;
        let start = spec.run.start_position().minus::<f64>(FixedCounts(0));
        let start = start * rig.encoder.radians_per_count::<f64>();
        let volts = dac.volts(codes.hold);
        Ok(SimBoard {
            params,
            node,
            line: Decoder::new(),
            rig: MovingRig::new(rig, engine, spec.run.seed, (start, 0.0), volts),
            dac,
            faults: faults.to_vec(),
            rng: Pcg64::seed_from_u64(spec.run.seed ^ 0x0062_6f61_7264),
            moved_ns: None,
            next_sample_ns: None,
            started_ns: 0,
            samples: 0,
            armed_ns: None,
            frozen: None,
            since: None,
            stuck_at: None,
            scaled: None,
            lever_broken: false,
            behind_ns: 0,
            reset_done: false,
            first_hit_ns: None,
            events: Vec::new(),
        })
    }

    /// The shaft's events since the last call: it stuck, it broke away.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }

    /// The board's state machine.
    #[must_use]
    pub fn node(&self) -> &BoardNode {
        &self.node
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &MovingRig {
        &self.rig
    }

    /// True if the shaft is stuck now.
    #[must_use]
    pub fn stuck(&self) -> bool {
        self.rig.shaft().motion == Motion::Stuck
    }

    /// The voltage at the converter's output now, V; a stuck converter's own.
    #[must_use]
    pub fn volts(&self) -> f64 {
        self.stuck_at.unwrap_or_else(|| self.dac.volts(self.node.code()) * self.scaled.unwrap_or(1.0))
    }

    /// Seconds since the controller's consent; none before.
    #[must_use]
    pub fn armed_for(&self, now_ns: u64) -> Option<f64> {
        self.armed_ns.map(|t| now_ns.saturating_sub(t) as f64 / 1e9)
    }

    /// The time at which a fault of the board's hardware first showed, ns.
    #[must_use]
    pub fn first_hit_ns(&self) -> Option<u64> {
        self.first_hit_ns
    }

    /// Samples taken.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The time at which [`SimBoard::step`] has to be called next, ns.
    #[must_use]
    pub fn next_ns(&self) -> Option<u64> {
        let watchdog = self.node.watchdog_at().map(|at| self.unwrap_us(at));
        match (self.next_sample_ns, watchdog) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    /// The board's clock of 32 bits, near the time up to which the rig has moved.
    fn unwrap_us(&self, at_us: u32) -> u64 {
        let now_ns = self.moved_ns.unwrap_or(0);
        let ahead = at_us.wrapping_sub(self.clock_us(now_ns)) as i32;
        (now_ns as i64 / 1000 + i64::from(ahead)).max(0) as u64 * 1000
    }

    /// The board's clock.
    fn clock_us(&self, now_ns: u64) -> u32 {
        ((now_ns as i64).wrapping_sub(self.behind_ns) / 1000) as u32
    }

    /// Bytes from the controller arrive.
    ///
    /// # Errors
    /// The engine gave up.
    pub fn receive(&mut self, now_ns: u64, bytes: &[u8], out: &mut Outbox) -> Result<(), SimBoardError> {
        self.move_to(now_ns)?;
        let before = self.node.state();
        let now_us = self.clock_us(now_ns);
        self.node.receive(now_us, &mut self.line, bytes, out);
        if self.node.state() == BoardState::Armed && before != BoardState::Armed {
            self.armed_ns = Some(now_ns);
        }
        if before != self.node.state() && self.node.state() == BoardState::Ready {
            // Sampling starts, or starts anew.
            self.next_sample_ns = Some(now_ns);
            self.started_ns = now_ns;
            self.samples = 0;
            self.moved_ns = Some(now_ns);
        }
        Ok(())
    }

    /// Does what is due by now: a sample, the watchdog, a fault.
    ///
    /// # Errors
    /// The engine gave up.
    pub fn step(&mut self, now_ns: u64, out: &mut Outbox) -> Result<(), SimBoardError> {
        self.move_to(now_ns)?;
        self.node.poll(self.clock_us(now_ns), out);
        let Some(due) = self.next_sample_ns.filter(|t| *t <= now_ns) else { return Ok(()) };
        let Some(period_us) = self.node.period_us() else {
            self.next_sample_ns = None;
            return Ok(());
        };
        // Periods that a slow machine has left out stay out: a board does not catch up.
        self.samples += 1;
        let period_ns = f64::from(period_us) * 1000.0;
        // Factor on the period; share of it by which the reported time falls behind.
        let (mut longer, mut behind) = (1.0, 0.0);
        self.rig.set_time((due - self.started_ns) as f64 / 1e9);
        self.rig.begin_period();
        let time = self.armed_for(now_ns);
        let mut counts = self.rig.counts();
        let now_us = self.clock_us(now_ns);
        let (mut loss, mut freeze, mut stick, mut reset) = (false, false, None, false);
        self.scaled = None;
        let mut pressing = 1.0;
        for i in 0..self.faults.len() {
            let fault = self.faults[i];
            let active = time.is_some_and(|t| fault.active(t));
            let own = !fault.kind.silences() || fault.kind == FaultKind::Reset;
            if !own || !active || !self.rng.random_bool(fault.probability) {
                continue;
            }
            match fault.kind {
                FaultKind::EncoderFreeze => freeze = true,
                FaultKind::EncoderJump(n) => counts = Counts(counts.0.wrapping_add(n)),
                FaultKind::EncoderChannel(channel) => {
                    let since = *self.since.get_or_insert(counts);
                    counts = Counts(channel.dead(since.0, counts.0));
                }
                FaultKind::EncoderScale(factor) => {
                    let since = *self.since.get_or_insert(counts);
                    let moved = (f64::from(counts.since(since)) * factor).floor() as i32;
                    counts = Counts(since.0.wrapping_add(moved));
                }
                FaultKind::EncoderLoss => loss = true,
                FaultKind::DacStuck(at) => stick = Some(at),
                FaultKind::DacScale(factor) => self.scaled = Some(factor),
                FaultKind::Contact(share) => pressing = share.min(pressing),
                FaultKind::Lever => self.lever_broken = true,
                FaultKind::Clock(factor) => behind += 1.0 - factor,
                FaultKind::Prescaler(factor) => longer *= factor,
                FaultKind::Crystal(factor) => {
                    longer *= factor;
                    behind += factor - 1.0;
                }
                FaultKind::Reset => reset = true,
                _ => continue,
            }
            self.first_hit_ns.get_or_insert(now_ns);
        }
        self.rig.press(if self.lever_broken { 0.0 } else { pressing });
        self.next_sample_ns = Some(due + (period_ns * longer) as u64);
        self.stuck_at = match (stick, self.stuck_at) {
            (Some(StuckAt::Volts(v)), _) => Some(v),
            (Some(StuckAt::Last), None) => Some(self.dac.volts(self.node.code())),
            (Some(StuckAt::Last), already) => already,
            (None, _) => None,
        };
        self.frozen = if freeze { Some(self.frozen.unwrap_or(counts)) } else { None };
        if reset && !self.reset_done {
            self.reset_done = true;
            self.params.boot = self.params.boot.wrapping_add(1);
            self.node = BoardNode::new(&self.params)?;
            self.line = Decoder::new();
            self.next_sample_ns = None;
            self.rig.reset(self.volts());
            return Ok(());
        }
        let counts = if loss { Counts(0) } else { self.frozen.unwrap_or(counts) };
        self.node.sample(now_us, counts, loss, false, out);
        self.behind_ns += (period_ns * behind) as i64;
        self.apply();
        Ok(())
    }

    /// Moves the rig under the voltage that has been there, then sets the present one.
    fn move_to(&mut self, now_ns: u64) -> Result<(), SimBoardError> {
        self.apply();
        if let Some(since) = self.moved_ns
            && now_ns > since
        {
            let events = self.rig.advance((now_ns - since) as f64 / 1e9)?;
            // Nobody may ask for them: what waits is bounded.
            if self.events.len() < MAX_EVENTS {
                self.events.extend_from_slice(events);
            }
            self.moved_ns = Some(now_ns);
        }
        Ok(())
    }

    fn apply(&mut self) {
        let volts = self.volts();
        self.rig.command(volts);
    }

    /// The code that the converter has been given.
    #[must_use]
    pub fn code(&self) -> DacCode {
        self.node.code()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_pad_can_lose_its_contact_where_nothing_else_stops_or_drives() {
        let brake =
            ["rig", "model"].map(|of| (format!("{of}.actuator"), "{brake={gain_nm_v=0.14}}".to_owned()));
        let drags = ["rig", "model"].map(|of| (format!("{of}.actuator.brake.preload_nm"), "0.01".to_owned()));
        let dragging: Vec<_> = brake.iter().chain(&drags).cloned().collect();
        let cases =
            [("board_smc_2", &brake[..], true), ("board_smc_2", &dragging, false), ("motor_pid", &[], false)];
        for (name, set, has_a_pad) in cases {
            let scenario = Scenario::load(Path::new(name), set).unwrap();
            for fault in ["lever:at=0.5", "contact:at=0.5,factor=0.5"] {
                let board = SimBoard::new(&scenario, &[fault.parse().unwrap()], 1, false);
                let refused = matches!(board.err(), Some(SimBoardError::NoPad(_)));
                assert_eq!(refused, !has_a_pad, "{name} {set:?} {fault}");
            }
        }
    }
}
