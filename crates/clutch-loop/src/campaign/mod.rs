//! The fault campaign: runs drawn by a [grammar], each held against an [oracle] that knows the physics of the rig and the
//! promises of `docs/safety.md`, and nothing of the supervisor.
//!
//! `cargo xtask campaign` runs it over as many seeds as you like and writes the table of `docs/safety.md`; the tests run its
//! first seeds, and show that it fails when any one of the supervisor's checks is taken out.

pub mod grammar;
pub(crate) mod healthy_run;
pub(crate) mod laws;
pub mod oracle;
pub mod table;

use crate::build_error::BuildError;
use crate::faults::{Direction, Fault, FaultKind};
use crate::from_scenario::{self, BuiltRun};
use crate::lockstep_board::LockstepBoard;
use crate::lockstep_host::lockstep_host;
use crate::sim_board::SimBoardError;
use crate::station::ControllerStation;
use crate::virtual_time::{Stall, VirtualError, VirtualLoop, VirtualOptions, VirtualReport};
use clutch_core::law::{Command, ControlLaw, Law, Seen, Tick};
use clutch_core::supervisor::Checks;
use clutch_core::{OnDisc, Planned, Real, Servo};
use clutch_node::ControllerNode;
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{Scenario, ScenarioError};
use grammar::{Draw, HealthyRun, PLAIN, PathKind, RigName, Safe, What};
use healthy_run::SINE_DEG_PER_DEG_S;
use std::fmt::{self, Write as _};
use std::str::FromStr;

/// A run of the campaign; everything follows from it.
///
/// Its name is its seed, and what its minimal form leaves out of the seed's draw: `4711-second-delay`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunId {
    /// Seed of the draw.
    pub seed: u64,
    /// The part that is left out, of [`PLAIN`].
    pub without: Vec<&'static str>,
}

impl fmt::Display for RunId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.seed)?;
        self.without.iter().try_for_each(|part| write!(f, "-{part}"))
    }
}

/// The reason why a run has no such name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("run \"{0}\": expected a seed and what is left out of it, as 4711 or 4711-second-delay; it may leave out {list}", list = PLAIN.join(", "))]
pub struct RunIdError(String);

impl FromStr for RunId {
    type Err = RunIdError;

    fn from_str(text: &str) -> Result<Self, RunIdError> {
        let bad = || RunIdError(text.to_owned());
        let mut parts = text.split('-');
        let seed = parts.next().and_then(|s| s.parse().ok()).ok_or_else(bad)?;
        let known = |part: &str| PLAIN.into_iter().find(|p| *p == part).ok_or_else(bad);
        Ok(RunId { seed, without: parts.map(known).collect::<Result<_, _>>()? })
    }
}

impl From<u64> for RunId {
    fn from(seed: u64) -> Self {
        RunId { seed, without: Vec::new() }
    }
}

/// A run could not be made.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// Its scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// Its set-up.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// Its board.
    #[error(transparent)]
    Board(#[from] SimBoardError),
    /// Its controller, or the host of one.
    #[error(transparent)]
    VirtualLoop(#[from] VirtualError),
}

impl RunId {
    /// The draw.
    #[must_use]
    pub fn draw(&self) -> Draw {
        Draw::new(self.seed, &self.without)
    }

    /// The same without all that the failure does not need: what is left still fails.
    #[must_use]
    pub fn minimal(&self, fails: impl Fn(&RunId) -> bool) -> RunId {
        let mut run = self.clone();
        for part in PLAIN {
            let mut without = run.without.clone();
            without.push(part);
            let plainer = RunId { seed: run.seed, without };
            if plainer.draw() != run.draw() && fails(&plainer) {
                run = plainer;
            }
        }
        run
    }
}

/// Time for which a run goes on after its last trouble began, s: of one that shows at once, and of one that shows over a
/// time only.
const AFTER: (f64, f64) = (0.6, 1.8);
/// Time for which the safe state is watched, s.
const WATCHED: f64 = 0.25;

impl Draw {
    /// The scenario of the healthy run.
    ///
    /// # Errors
    /// None, unless the grammar is wrong.
    pub fn scenario(&self, seed: u64) -> Result<Scenario, ScenarioError> {
        let s = &self.healthy;
        let mut text = match s.rig {
            RigName::Motor => self.motor(),
            RigName::Paper | RigName::Bench => self.brake(),
        };
        let safe = match s.safe {
            Safe::Hold(v) => format!("hold = {{ volts_v = {v:?} }}"),
            Safe::Ramp(rate, v) => format!("ramp = {{ rate_v_s = {rate:?}, volts_v = {v:?} }}"),
            Safe::Release => "release = {}".to_owned(),
            Safe::HoldThenRelease(v, after) => {
                format!("hold_then_release = {{ volts_v = {v:?}, after_s = {after:?} }}")
            }
        };
        let (cycles, good) = (s.cycles, s.good_samples.min(s.cycles - 2));
        // A slow drift is to reach the limit of the voltage's time, not that of the error.
        let error = if self.load().is_some() { 3.0 } else { oracle::following_deg(s) };
        let saturation = laws::of(s.law).saturated_s;
        let scalar = if s.single { "f32" } else { "f64" };
        let _ = write!(
            text,
            "[sampling]\nscalar = \"{scalar}\"\n[safety]\nreason = \"a weight drives the shaft\"\n\
             [safety.on_fault]\n{safe}\n[safety.limits]\nwatchdog_cycles = {cycles}\nsilence_cycles = {cycles}\n\
             good_samples = {good}\nfollowing_error_deg = {error:?}\nsaturation_time_s = {saturation:?}\n\
             [run]\nduration_s = 5.0\nstart = \"rest\"\nseed = {}\n",
            seed % 1_000_000
        );
        if self.load().is_some() {
            text += "engine = \"dormand_prince\"\n";
        }
        Scenario::parse("campaign", &text, &[])
    }

    fn load(&self) -> Option<(f64, f64)> {
        self.troubles.iter().find_map(|t| if let What::Load(by) = t.what { Some((by, t.at)) } else { None })
    }

    /// Rig, law, path and bounds of a brake.
    fn brake(&self) -> String {
        let s = &self.healthy;
        let rig = if s.rig == RigName::Bench { "bench" } else { "paper" };
        let mut text = format!("name = \"campaign\"\n[rig]\nbase = \"{rig}\"\ndelay_ticks = {}\n", s.delay);
        if let Some((factor, at)) = self.load() {
            let before = clutch_core::PlantParams::<f64>::default().drive_torque;
            let (after, rises) = (factor * before, at + 1e-3);
            let _ = write!(
                text,
                "[rig.drive.table]\npoints_s_nm = [[{at:?}, {before:?}], [{rises:?}, {after:?}]]\n\
                 [output]\nhighest_v = 3.0\non_invalid_v = 3.0\n"
            );
        }
        // In one scalar with micro-steps, in the other without.
        let gains = (laws::of(s.law).brake)(s.rig, s.single, s.delay);
        let _ = writeln!(text, "[law.{}]\n{gains}", s.law);
        let _ = match s.path {
            PathKind::Ramp(v) => writeln!(text, "[reference.ramp]\nrate_deg_s = {v:?}"),
            PathKind::MinimumJerk(v) => {
                // 1.875 times its mean speed at most.
                writeln!(
                    text,
                    "[reference.minimum_jerk]\ndistance_deg = {:?}\nduration_s = 2.0",
                    v / 1.875 * 2.0
                )
            }
            PathKind::Sine(v) => writeln!(
                text,
                "[reference.sine]\nrate_deg_s = {v:?}\namplitude_deg = {:?}\nfrequency_hz = 2.0",
                v * SINE_DEG_PER_DEG_S
            ),
        };
        if s.observer {
            text += "[velocity.observer]\n";
        }
        if s.wide {
            text += "[bounds]\nfriction_percent = 20.0\ndrive_torque_percent = 10.0\ninertia_percent = 10.0\n\
                     brake_gain_percent = 10.0\n";
        }
        text
    }

    /// A geared motor axis with friction, to and fro; as the built-in ones.
    fn motor(&self) -> String {
        let HealthyRun { law, path, wide, .. } = self.healthy;
        let gains = laws::of(law).motor;
        let amplitude = path.top_deg_s() / (std::f64::consts::TAU * MOTOR_HZ);
        let axis = |of: &str| {
            format!(
                "[{of}.actuator.motor]\ngain_nm_v = 0.05\npreload_nm = 0.25\n\
                 [{of}.friction.stribeck]\nmu_static = 0.2\nmu_dynamic = 0.12\nstribeck_velocity_rad_s = 0.01\n"
            )
        };
        let bounds = if wide { "[bounds]\nfriction_percent = 20.0\nmotor_gain_percent = 5.0\n" } else { "" };
        format!(
            "name = \"campaign\"\n[rig]\nbase = \"paper\"\n{}[rig.drive.table]\npoints_s_nm = [[0.0, 0.0]]\n\
             [model]\ndrive_torque_nm = 0.0\n{}{bounds}[law.{law}]\n{gains}\
             [output]\nlowest_v = -10.0\non_invalid_v = 0.0\n\
             [reference.sine]\nrate_deg_s = 0.0\namplitude_deg = {amplitude:?}\nfrequency_hz = {MOTOR_HZ:?}\n",
            axis("rig"),
            axis("model"),
        )
    }

    /// Runs it, with some of the checks; `seed` decides what is random in rig and line.
    ///
    /// # Errors
    /// None, unless the grammar is wrong.
    pub fn run(&self, seed: u64, checks: Checks, record: bool) -> Result<VirtualReport, CampaignError> {
        let scenario = self.scenario(seed)?;
        match scenario.scalar() {
            ScalarKind::F32 => self.run_in::<f32>(&scenario, seed, checks, record),
            ScalarKind::F64 => self.run_in::<f64>(&scenario, seed, checks, record),
        }
    }

    /// True if a board that closes the loop can be broken so from outside, and can take the run: in single precision, without
    /// an observer, with its law and its path sound.
    #[must_use]
    pub fn is_outside(&self) -> bool {
        let inside = |what| {
            let broken = matches!(what, What::LawNotFinite | What::TargetNotFinite | What::TargetHuge);
            broken || matches!(what, What::StopLost | What::Overflow(_))
        };
        self.healthy.single && !self.healthy.observer && !self.troubles.iter().any(|t| inside(t.what))
    }

    /// Runs it against a board that closes the loop.
    ///
    /// # Errors
    /// The board failed.
    pub fn run_on(&self, seed: u64, link: impl LockstepBoard) -> Result<VirtualReport, CampaignError> {
        let scenario = self.scenario(seed)?;
        let built = BuiltRun::<f32>::new(&scenario, 7)?;
        let station = lockstep_host(&scenario, &built, link, u64::MAX)?;
        let path = from_scenario::path::<f32>(&scenario)?;
        let world = self.world(seed, built.servo.period().seconds(), false);
        Ok(VirtualLoop::new(&scenario, world, station)?.run(&path)?)
    }

    /// Options of the run, with the troubles in the world around the controller.
    fn world(&self, seed: u64, period: f64, record: bool) -> VirtualOptions {
        let stall = |t: &grammar::Trouble| {
            let (answer, until) = match t.what {
                What::Slow(answer) => (answer, f64::INFINITY),
                What::ControllerDies => (1e4, f64::INFINITY),
                // One answer, until half a period after the first sample that comes again.
                What::Overflow(lost) => ((f64::from(lost) + 1.5) * period, t.at + period),
                _ => return None,
            };
            Some(Stall { at: t.at, until, answer })
        };
        // Line of the troubles that have one beside something else.
        let line = |t: &grammar::Trouble| {
            let (direction, at, periods) = match t.what {
                What::StopLost => (Direction::Down, t.at - period, 4),
                // From the sample after the one that is answered so late on.
                What::Overflow(lost) => {
                    (Direction::Up, t.at + period - self.healthy.latency_ns as f64 / 1e9, lost)
                }
                _ => return None,
            };
            Some(Fault { lasting: f64::from(periods) * period, direction, ..Fault::new(FaultKind::Drop, at) })
        };
        let last = self.troubles.iter().map(|t| t.at).fold(0.0, f64::max);
        let after = if self.troubles.iter().any(grammar::Trouble::needs_time) { AFTER.1 } else { AFTER.0 };
        VirtualOptions {
            latency_ns: self.healthy.latency_ns,
            seed,
            record,
            duration: last + after,
            watched: WATCHED,
            faults: self.troubles.iter().flat_map(|t| [t.fault(period), line(t)]).flatten().collect(),
            // The longer one of two.
            stall: self.troubles.iter().filter_map(stall).max_by(|a, b| a.answer.total_cmp(&b.answer)),
            ..VirtualOptions::default()
        }
    }

    /// The tick from which on something inside of the controller is broken.
    fn broken_from(&self, period: f64, which: impl Fn(What) -> bool) -> Option<u64> {
        self.troubles.iter().filter(|t| which(t.what)).map(|t| (t.at / period) as u64).min()
    }

    fn run_in<T: Real>(
        &self,
        scenario: &Scenario,
        seed: u64,
        checks: Checks,
        record: bool,
    ) -> Result<VirtualReport, CampaignError> {
        let built = BuiltRun::<T>::with_checks(scenario, 7, checks)?;
        let period: f64 = built.servo.period().seconds();
        let params = self.world(seed, period, record);
        let path = from_scenario::path::<T>(scenario)?;
        let nan = T::from_f64(f64::NAN);
        let not_finite = self.broken_from(period, |what| what == What::TargetNotFinite);
        let huge = self.broken_from(period, |what| matches!(what, What::TargetHuge | What::StopLost));
        let map = path.map;
        let path = move |tick: u64| {
            let mut target = path.target(tick);
            if not_finite.is_some_and(|from| tick >= from) {
                target.velocity = nan;
            }
            if huge.is_some_and(|from| tick >= from) {
                target.position = clutch_core::FixedCounts(target.position.0.wrapping_add(1 << 46));
            }
            target
        };
        let path = OnDisc { path, map };
        if let Some(from) = self.broken_from(period, |what| what == What::LawNotFinite) {
            let law = BrokenLaw { law: *built.servo.law(), from };
            let servo = Servo::with_law(&built.params, law).map_err(|e| BuildError::Param(e.cast()))?;
            let node = ControllerNode::new(built.controller, servo, built.supervisor);
            Ok(VirtualLoop::new(scenario, params, ControllerStation::new(node, &path))?.run(&path)?)
        } else {
            let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
            Ok(VirtualLoop::new(scenario, params, ControllerStation::new(node, &path))?.run(&path)?)
        }
    }
}

/// Frequency of the motor axis's path, Hz.
const MOTOR_HZ: f64 = 0.25;

/// A law whose memory is corrupted at a tick: from then on it demands what is not a number.
#[derive(Clone, Copy, Debug)]
struct BrokenLaw<T> {
    law: Law<T>,
    from: u64,
}

impl<T: Real> ControlLaw<T> for BrokenLaw<T> {
    type State = (<Law<T> as ControlLaw<T>>::State, u64);
    type Terms = <Law<T> as ControlLaw<T>>::Terms;
    const TERMS: &'static [&'static str] = &[];

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        (self.law.start(tick, applied), 0)
    }

    fn sees(&self, state: &mut Self::State, seen: impl FnOnce() -> Seen<T>) {
        self.law.sees(&mut state.0, seen);
    }

    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        let broken = state.1 >= self.from;
        state.1 += 1;
        let nan = T::from_f64(f64::NAN);
        // A law may have errors of its own, and take the path's velocity only.
        let corrupt = Tick { error_rate: nan, error: nan, target_velocity: nan, ..*tick };
        self.law.update(&mut state.0, if broken { &corrupt } else { tick })
    }
}
