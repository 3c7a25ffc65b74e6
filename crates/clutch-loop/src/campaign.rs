//! The fault campaign: every fault, every law, several paths, random onsets, in virtual time.
//!
//! A case says what is broken, which causes may be named, and within which time the safe output
//! must be in force. `cargo run --release -p clutch-loop --example campaign` runs it and writes
//! the table of `docs/safety.md`; the tests run it with fewer seeds, and show that it fails when
//! any one of the supervisor's checks is taken out.

use crate::faults::{Channel, Direction, Fault, FaultKind, StuckAt};
use crate::from_scenario::{self, BuildError, BuiltRun};
use crate::lockstep_board::LockstepBoard;
use crate::lockstep_host::lockstep_host;
use crate::sim_board::SimBoardError;
use crate::station::ControllerStation;
use crate::virtual_time::{Stall, VirtualError, VirtualLoop, VirtualOptions, VirtualReport};
use clutch_core::law::{Command, ControlLaw, Law, Tick};
use clutch_core::supervisor::{Cause, Checks};
use clutch_core::{Real, Servo, Target};
use clutch_node::ControllerNode;
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{Scenario, ScenarioError};
use clutch_wire::BoardState;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// The defect, from an onset on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Broken {
    /// A fault of line or board.
    Fault(FaultKind, Direction),
    /// One frame of every few: `(kind, way, every)` periods.
    Periodic(FaultKind, Direction, u32),
    /// A fault that is over after one period.
    Once(FaultKind, Direction),
    /// Frames hit at random: probability.
    Random(FaultKind, Direction, f64),
    /// The drive is stronger by this factor, and the output limited to little more than its old self needs.
    Load(f64),
    /// The controller takes so long for an answer, s.
    Slow(f64),
    /// The law's memory is corrupted: its demand is not a number.
    LawNotFinite,
    /// The path's velocity is not a number.
    TargetNotFinite,
    /// The path's position jumps by a finite but huge distance.
    TargetHuge,
    /// The controller ends without a word.
    ControllerDies,
}

/// The outcome that the defect must have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// The safe output is in force within a time (s), with one of these causes.
    Safe {
        /// Longest time from the first effect of the fault, s.
        within: f64,
        /// Causes that may be named.
        causes: &'static [Cause],
        /// True if software can keep the shaft from running past the path.
        avoidable: bool,
    },
    /// The board alone is left to act; the controller is gone.
    BoardSafe {
        /// Longest time, s.
        within: f64,
    },
    /// Control goes on to the end of the path.
    Tolerated,
}

/// A row of the campaign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Its name in tables and messages.
    pub name: &'static str,
    /// Hazards of `docs/safety.md` that it stands for.
    pub hazards: &'static str,
    /// The defect.
    pub broken: Broken,
    /// The outcome that the defect must have.
    pub expected: Expected,
    /// Periods without an answer that board and supervisor wait.
    pub watchdog_cycles: u32,
    /// Only the PD law, on the ramp, on the paper's rig.
    pub narrow: bool,
    /// Only the paper's rig: what the bench's uneven friction can do hides the fault.
    pub paper: bool,
}

impl Case {
    /// Only on the paper's rig.
    const fn on_the_paper(self) -> Self {
        Case { paper: true, ..self }
    }

    /// Only with the PD law, on the ramp, on the paper's rig.
    const fn on_the_paper_with_pd(self) -> Self {
        Case { narrow: true, ..self }
    }
}

const UP: Direction = Direction::Up;
const DOWN: Direction = Direction::Down;
const BOTH: Direction = Direction::Both;

const fn safe(within_ms: f64, causes: &'static [Cause]) -> Expected {
    Expected::Safe { within: within_ms / 1000.0, causes, avoidable: true }
}

const fn detected(within_ms: f64, causes: &'static [Cause]) -> Expected {
    Expected::Safe { within: within_ms / 1000.0, causes, avoidable: false }
}

/// Every case.
pub const CASES: &[Case] = {
    use Broken::{Fault as F, Once, Periodic, Random};
    use Cause as C;
    const fn case(name: &'static str, hazards: &'static str, broken: Broken, expected: Expected) -> Case {
        Case { name, hazards, broken, expected, watchdog_cycles: 3, narrow: false, paper: false }
    }
    const SILENT: &[C] = &[C::Silence, C::Board];
    /// The first count back may be a dead channel's.
    const BACK: &[C] = &[C::Reversed, C::Channel];
    &[
        case("all frames dropped, both ways", "H6", F(FaultKind::Drop, BOTH), safe(3.0, &[C::Silence])),
        case("all frames from the board dropped", "H6", F(FaultKind::Drop, UP), safe(3.0, &[C::Silence])),
        case("all frames to the board dropped", "H6, H8", F(FaultKind::Drop, DOWN), safe(3.0, &[C::Board])),
        case(
            "one frame in three from the board dropped",
            "H6",
            Periodic(FaultKind::Drop, UP, 3),
            safe(90.0, &[C::Lost]),
        ),
        case("every frame duplicated", "H6", F(FaultKind::Duplicate, BOTH), safe(3.0, &[C::Duplicated])),
        case("every frame corrupted", "H7, H22", F(FaultKind::Corrupt, BOTH), safe(3.0, SILENT)),
        case("every frame reordered", "H6", F(FaultKind::Reorder, UP), safe(8.0, &[C::Reordered])),
        case("5 ms of delay", "H6, H8", F(FaultKind::Delay(0.005), BOTH), safe(3.0, SILENT)),
        case(
            "one code in four late by 1.95 ms",
            "H8, H11",
            Periodic(FaultKind::Delay(0.00195), DOWN, 4),
            safe(120.0, &[C::Late]),
        ),
        case(
            "jitter up to 8 ms",
            "H6",
            F(FaultKind::Jitter(0.008), BOTH),
            safe(30.0, &[C::Silence, C::Board, C::Late]),
        ),
        case("silence, both ways", "H15", F(FaultKind::Silence, BOTH), safe(3.0, &[C::Silence])),
        case("encoder frozen", "H1", F(FaultKind::EncoderFreeze, BOTH), safe(10.0, &[C::StandStill])),
        case("encoder off by 500 counts", "H2", F(FaultKind::EncoderJump(500), BOTH), safe(3.0, &[C::Jump])),
        case("encoder off by −20 counts", "H2", F(FaultKind::EncoderJump(-20), BOTH), safe(3.0, &[C::Jump])),
        case("encoder off by 3 counts", "H2", F(FaultKind::EncoderJump(3), BOTH), safe(3.0, &[C::TooFast]))
            .on_the_paper(),
        case(
            "encoder off by −3 counts",
            "H2",
            F(FaultKind::EncoderJump(-3), BOTH),
            safe(12.0, &[C::Reversed, C::Channel, C::TooFast]),
        )
        .on_the_paper(),
        case(
            "encoder's channel A dead",
            "H1",
            F(FaultKind::EncoderChannel(Channel::A), BOTH),
            safe(10.0, &[C::Channel]),
        ),
        case(
            "encoder's channel B dead",
            "H1",
            F(FaultKind::EncoderChannel(Channel::B), BOTH),
            safe(10.0, &[C::Channel]),
        ),
        case(
            "encoder frozen in nine periods of ten",
            "H1",
            Random(FaultKind::EncoderFreeze, BOTH, 0.9),
            safe(20.0, &[C::StandStill, C::TooSlow, C::TooFast, C::Jump]),
        ),
        case("counts doubled", "H2", F(FaultKind::EncoderScale(2.0), BOTH), safe(40.0, &[C::TooFast])),
        case("counts reversed", "H3", F(FaultKind::EncoderScale(-1.0), BOTH), safe(10.0, BACK)),
        // A shaft that seems faster by a fifth, or half as fast, may be none of the bounds.
        case(
            "periods 1.2 times as long",
            "H10",
            F(FaultKind::Prescaler(1.2), BOTH),
            safe(1400.0, &[C::Clock, C::TooFast]),
        )
        .on_the_paper(),
        case(
            "periods half as long",
            "H10",
            F(FaultKind::Prescaler(0.5), BOTH),
            safe(500.0, &[C::Clock, C::TooSlow, C::StandStill]),
        )
        .on_the_paper(),
        case("encoder lost", "H1", F(FaultKind::EncoderLoss, BOTH), safe(3.0, &[C::Board])),
        case(
            "DAC stuck at 0 V",
            "H5",
            F(FaultKind::DacStuck(StuckAt::Volts(0.0)), BOTH),
            detected(20.0, &[C::TooFast]),
        ),
        case(
            "DAC stuck at 10 V",
            "H5",
            F(FaultKind::DacStuck(StuckAt::Volts(10.0)), BOTH),
            safe(25.0, &[C::StandStill, C::TooSlow]),
        ),
        case(
            "DAC stuck where it is",
            "H5",
            F(FaultKind::DacStuck(StuckAt::Last), BOTH),
            detected(300.0, &[C::TooFast, C::TooSlow, C::StandStill, C::FollowingError]),
        ),
        case(
            "DAC at half its voltage",
            "H5",
            F(FaultKind::DacScale(0.5), BOTH),
            detected(40.0, &[C::TooFast]),
        )
        .on_the_paper(),
        case(
            "DAC the wrong way round",
            "H5",
            F(FaultKind::DacScale(-1.0), BOTH),
            detected(20.0, &[C::TooFast]),
        ),
        case(
            "load a little above what the output can brake",
            "H12, H13",
            Broken::Load(1.347),
            detected(600.0, &[C::Saturation]),
        )
        .on_the_paper_with_pd(),
        case(
            "load twice as heavy, above what the output can brake",
            "H12, H13",
            Broken::Load(2.0),
            detected(200.0, &[C::FollowingError]),
        )
        .on_the_paper_with_pd(),
        case("board reset", "H16", F(FaultKind::Reset, BOTH), safe(3.0, &[C::Silence])),
        case("law's demand not a number", "H4, H25", Broken::LawNotFinite, safe(3.0, &[C::NotFinite])),
        case("target not a number", "H4, H9", Broken::TargetNotFinite, safe(3.0, &[C::Target])),
        case("target jumps by 10⁹ counts", "H4, H9", Broken::TargetHuge, safe(3.0, &[C::Target])),
        case("each answer takes 0.7 ms", "H11", Broken::Slow(0.0007), safe(35.0, &[C::Deadline])),
        case(
            "controller dies",
            "H11, H15, H24",
            Broken::ControllerDies,
            Expected::BoardSafe { within: 0.0031 },
        ),
        case("one frame dropped", "H6", Once(FaultKind::Drop, UP), Expected::Tolerated),
        Case {
            watchdog_cycles: 8,
            ..case("one frame corrupted", "H7", Once(FaultKind::Corrupt, BOTH), Expected::Tolerated)
        },
        case(
            "one sample off by 500 counts",
            "H2",
            Once(FaultKind::EncoderJump(500), BOTH),
            Expected::Tolerated,
        ),
        Case {
            watchdog_cycles: 8,
            ..case("2 % of frames dropped", "H6", Random(FaultKind::Drop, BOTH, 0.02), Expected::Tolerated)
        },
        case("jitter up to 0.3 ms", "H6", F(FaultKind::Jitter(0.0003), BOTH), Expected::Tolerated),
        case("nothing broken", "", Random(FaultKind::Drop, BOTH, 0.0), Expected::Tolerated),
    ]
};

/// Laws of the campaign: the paper's, Table 2.
pub const LAWS: [&str; 3] = ["pd", "ctc", "smc"];

/// Paths of the campaign: name, tables, the part of the run in which faults begin (s), top speed (°/s).
pub const PATHS: [(&str, &str, (f64, f64), f64); 2] = [
    ("ramp at 20 °/s", "[reference.ramp]\nrate_deg_s = 20.0\n", (0.3, 0.6), 20.0),
    (
        "60° from rest to rest in 4 s",
        "[reference.minimum_jerk]\ndistance_deg = 60.0\nduration_s = 4.0\n",
        (1.2, 2.8),
        28.125,
    ),
];

/// One run of the campaign; everything follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunId {
    /// Index in [`CASES`].
    pub case: usize,
    /// Index in [`LAWS`].
    pub law: usize,
    /// Index in [`PATHS`].
    pub path: usize,
    /// Seed of onset, scalar, rig and line.
    pub seed: u64,
}

/// All runs for a number of seeds from a first one on.
pub fn runs(first_seed: u64, seeds: u64) -> impl Iterator<Item = RunId> {
    (first_seed..first_seed + seeds).flat_map(|seed| {
        (0..CASES.len()).flat_map(move |case| {
            (0..LAWS.len())
                .flat_map(move |law| (0..PATHS.len()).map(move |path| RunId { case, law, path, seed }))
                .filter(|run| !run.case().narrow || (run.law == 0 && run.path == 0))
        })
    })
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
    /// The case.
    #[must_use]
    pub fn case(&self) -> &'static Case {
        &CASES[self.case]
    }

    /// In words.
    #[must_use]
    pub fn name(&self) -> String {
        let path = PATHS[self.path].0;
        format!("{}, {}, {path}, seed {}", self.case().name, LAWS[self.law].to_uppercase(), self.seed)
    }

    fn rng(&self) -> Pcg64 {
        let id = (self.case * 100 + self.law * 10 + self.path) as u64;
        Pcg64::seed_from_u64(self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ id)
    }

    /// The scenario: law and path of the run, the paper's rig or, for every third seed, the bench.
    ///
    /// # Errors
    /// None, unless a row of the tables is wrong.
    pub fn scenario(&self) -> Result<Scenario, ScenarioError> {
        self.scenario_in(if self.rng().random_bool(0.5) { "f32" } else { "f64" })
    }

    fn scenario_in(&self, scalar: &str) -> Result<Scenario, ScenarioError> {
        let rig = if self.on_bench() { "bench" } else { "paper" };
        let cycles = self.case().watchdog_cycles;
        let load = match self.case().broken {
            Broken::Load(factor) => {
                let (before, at) = (clutch_core::PlantParams::<f64>::default().drive_torque, self.onset());
                let (after, rises) = (factor * before, at + 1e-3);
                format!(
                    "[rig.drive.table]\npoints_s_nm = [[{at:?}, {before:?}], [{rises:?}, {after:?}]]\n\
                     [output]\nhighest_v = 3.0\non_invalid_v = 3.0\n"
                )
            }
            _ => String::new(),
        };
        // A slow drift is to reach the limit of the voltage's time, not that of the error.
        let (engine, error) =
            if load.is_empty() { ("", "1.0") } else { ("engine = \"dormand_prince\"\n", "3.0") };
        let text = format!(
            "name = \"campaign\"\n[rig]\nbase = \"{rig}\"\n{load}[law.{}]\n{}[sampling]\nscalar = \"{scalar}\"\n\
             [run]\n{engine}duration_s = 5.0\nstart = \"rest\"\nseed = {}\n\
             [safety]\nreason = \"a weight drives the shaft\"\n[safety.on_fault.hold]\nvolts_v = 9.99\n\
             [safety.limits]\nwatchdog_cycles = {cycles}\nsilence_cycles = {cycles}\nfollowing_error_deg = {error}\n",
            LAWS[self.law], PATHS[self.path].1, self.seed
        );
        Scenario::parse("campaign", &text, &[])
    }

    /// True if the rig is the bench, whose friction is a third weaker and uneven.
    #[must_use]
    pub fn on_bench(&self) -> bool {
        self.seed.is_multiple_of(3) && !self.case().narrow && !self.case().paper
    }

    /// Largest overrun where software can help, °: 0.25° at 20 °/s, and with the square of the speed, as
    /// the way to a stop. The bench gets twice that for its weaker friction.
    #[must_use]
    pub fn overrun_deg(&self) -> f64 {
        let speed = PATHS[self.path].3 / 20.0;
        OVERRUN_DEG * speed * speed * if self.on_bench() { 2.0 } else { 1.0 }
    }

    /// The onset of the fault, s after arming.
    #[must_use]
    pub fn onset(&self) -> f64 {
        let (from, to) = PATHS[self.path].2;
        from + (to - from) * self.rng().random::<f64>()
    }

    /// Runs it, with some of the checks.
    ///
    /// # Errors
    /// None, unless a row of the tables is wrong.
    pub fn run(&self, checks: Checks, record: bool) -> Result<VirtualReport, CampaignError> {
        let scenario = self.scenario()?;
        match scenario.scalar() {
            ScalarKind::F32 => self.run_in::<f32>(&scenario, checks, record),
            ScalarKind::F64 => self.run_in::<f64>(&scenario, checks, record),
        }
    }

    /// True if a board that closes the loop can be broken so from outside: its law and its path cannot.
    #[must_use]
    pub fn is_outside(&self) -> bool {
        let broken = self.case().broken;
        !matches!(broken, Broken::LawNotFinite | Broken::TargetNotFinite | Broken::TargetHuge)
    }

    /// Runs it against a board that closes the loop.
    ///
    /// # Errors
    /// The board failed.
    pub fn run_on(&self, link: impl LockstepBoard) -> Result<VirtualReport, CampaignError> {
        let scenario = self.scenario_in("f32")?;
        let built = BuiltRun::<f32>::new(&scenario, 7)?;
        let params = self.world(built.servo.period().seconds(), false);
        let station = lockstep_host(&scenario, &built, link, u64::MAX)?;
        let path = from_scenario::path::<f32>(&scenario)?;
        let report = VirtualLoop::new(&scenario, params, station)?.run(&path)?;
        Ok(self.with_onset(report, self.onset()))
    }

    /// Options of the run, with the defect in the world around the controller.
    fn world(&self, period: f64, record: bool) -> VirtualOptions {
        let onset = self.onset();
        let mut params = VirtualOptions {
            latency_ns: 50_000,
            seed: self.seed,
            record,
            duration: onset + 1.6,
            ..VirtualOptions::default()
        };
        let fault = |kind, direction| Fault { direction, ..Fault::new(kind, onset) };
        match self.case().broken {
            Broken::Fault(kind, way) => params.faults.push(fault(kind, way)),
            Broken::Once(kind, way) => {
                params.faults.push(Fault { lasting: period, ..fault(kind, way) });
            }
            Broken::Random(kind, way, probability) => {
                params.faults.push(Fault { probability, ..fault(kind, way) });
            }
            Broken::Periodic(kind, way, every) => {
                // At the middle between two samples, so that one frame each is hit.
                let begin = ((onset / period).floor() + 0.5) * period;
                params.faults.extend((0..60).map(|i| Fault {
                    at: begin + f64::from(i * every) * period,
                    lasting: period,
                    ..fault(kind, way)
                }));
            }
            Broken::Slow(answer) => {
                params.stall = Some(Stall { at: onset, until: f64::INFINITY, answer });
            }
            Broken::ControllerDies => {
                params.stall = Some(Stall { at: onset, until: f64::INFINITY, answer: 1e4 });
            }
            Broken::Load(_) | Broken::LawNotFinite | Broken::TargetNotFinite | Broken::TargetHuge => {}
        }
        params
    }

    /// A fault that the line does not show showed at its onset.
    fn with_onset(&self, mut report: VirtualReport, onset: f64) -> VirtualReport {
        if report.hit.is_none() && !matches!(self.case().expected, Expected::Tolerated) {
            report.hit = Some(onset);
        }
        report
    }

    fn run_in<T: Real>(
        &self,
        scenario: &Scenario,
        checks: Checks,
        record: bool,
    ) -> Result<VirtualReport, CampaignError> {
        let built = BuiltRun::<T>::with_checks(scenario, 7, checks)?;
        let period: f64 = built.servo.period().seconds();
        let params = self.world(period, record);
        let onset_tick = (self.onset() / period) as u64;
        let path = from_scenario::path::<T>(scenario)?;
        let nan = T::from_f64(f64::NAN);
        let broken = self.case().broken;
        let path = move |tick: u64| {
            let target = path(tick);
            match broken {
                Broken::TargetNotFinite if tick >= onset_tick => Target { velocity: nan, ..target },
                Broken::TargetHuge if tick >= onset_tick => {
                    let position = clutch_core::FixedCounts(target.position.0.wrapping_add(1 << 46));
                    Target { position, ..target }
                }
                _ => target,
            }
        };
        let report = if broken == Broken::LawNotFinite {
            let law = BrokenLaw { law: *built.servo.law(), from: onset_tick };
            let servo = Servo::with_law(&built.params, law).map_err(|e| BuildError::Param(e.cast()))?;
            let node = ControllerNode::new(built.controller, servo, built.supervisor);
            VirtualLoop::new(scenario, params, ControllerStation { node, path: &path })?.run(&path)?
        } else {
            let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
            VirtualLoop::new(scenario, params, ControllerStation { node, path: &path })?.run(&path)?
        };
        let onset = if self.is_outside() { self.onset() } else { onset_tick as f64 * period };
        Ok(self.with_onset(report, onset))
    }

    /// Checks that the report shows the outcome that the defect must have; says what is wrong if not.
    #[must_use]
    pub fn judge(&self, o: &VirtualReport) -> Option<String> {
        let top = 10.0;
        if o.volts.0 < -1e-9 || o.volts.1 > top {
            return Some(format!("commanded {} to {} V, outside of 0 to {top} V", o.volts.0, o.volts.1));
        }
        let time = |within: f64| {
            let (Some(safe), Some(hit)) = (o.safe, o.hit) else {
                return Some("the safe output was never in force".to_owned());
            };
            let took = safe - hit;
            // The bench has a period more of delay, and bounds several times as wide; CTC there brakes hard before it lets
            // go.
            let within = if self.on_bench() { 2.5 * within } else { within };
            // A microsecond for the clock's grain.
            (took > within + 1e-6)
                .then(|| format!("safe output after {:.3} ms instead of {} ms", took * 1e3, within * 1e3))
        };
        let overrun = |limit_deg: f64| {
            let deg = o.overrun.to_degrees();
            (deg > limit_deg).then(|| format!("overrun {deg:.3}° instead of {limit_deg}°"))
        };
        match self.case().expected {
            Expected::Safe { within, causes, avoidable } => {
                let named = o.cause.filter(|c| causes.contains(c));
                if named.is_none() {
                    return Some(format!("named {:?} instead of one of {causes:?}", o.cause));
                }
                time(within).or_else(|| if avoidable { overrun(self.overrun_deg()) } else { None })
            }
            Expected::BoardSafe { within } => time(within).or_else(|| overrun(self.overrun_deg())),
            Expected::Tolerated => {
                if let Some(cause) = o.cause {
                    return Some(format!("ended by {cause:?} although it can be tolerated"));
                }
                if o.board != Some(BoardState::Running) {
                    return Some(format!("the board is in {:?}", o.board));
                }
                let deg = o.largest_error.to_degrees();
                (deg > TOLERATED_DEG).then(|| format!("error {deg:.3}° instead of {TOLERATED_DEG}°"))
            }
        }
    }
}

/// Largest overrun at 20 °/s on the paper's rig where software can help, °.
pub const OVERRUN_DEG: f64 = 0.25;
/// Largest error in a run with a fault that is tolerated, °.
pub const TOLERATED_DEG: f64 = 0.9;

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

    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        let broken = state.1 >= self.from;
        state.1 += 1;
        let nan = T::from_f64(f64::NAN);
        self.law.update(&mut state.0, &if broken { Tick { error_rate: nan, ..*tick } } else { *tick })
    }
}

/// The results of the runs of one case.
#[derive(Clone, Debug, Default)]
struct Row {
    runs: u64,
    /// On the paper's rig and on the bench, s.
    longest: [f64; 2],
    overrun: f64,
    causes: std::collections::BTreeMap<String, u64>,
}

/// The table of `docs/safety.md`: what the runs of each case came to.
#[derive(Clone, Debug, Default)]
pub struct Table {
    rows: std::collections::BTreeMap<usize, Row>,
}

impl Table {
    /// Takes a run in.
    pub fn add(&mut self, run: &RunId, report: &VirtualReport) {
        let row = self.rows.entry(run.case).or_default();
        row.runs += 1;
        if let (Some(safe), Some(hit)) = (report.safe, report.hit) {
            let longest = &mut row.longest[usize::from(run.on_bench())];
            *longest = longest.max(safe - hit);
        }
        // The bench's own limit is twice the paper rig's; the column is in the paper rig's terms.
        let speed = PATHS[run.path].3 / 20.0;
        let scale = speed * speed * if run.on_bench() { 2.0 } else { 1.0 };
        row.overrun = row.overrun.max(report.overrun.to_degrees() / scale);
        let cause = report.cause.map_or("–".to_owned(), |c| format!("{c:?}"));
        *row.causes.entry(cause).or_default() += 1;
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "| fault | hazards | runs | limit | safe after, at most: paper rig, bench | overrun, at most | cause named (runs) |"
        )?;
        writeln!(f, "|---|---|---|---|---|---|---|")?;
        let took = |case: &Case, row: &Row| {
            let [paper, bench] = row.longest.map(|s| format!("{:.2} ms", s * 1e3));
            if row.runs < 20 || case.paper { paper } else { format!("{paper}, {bench}") }
        };
        for (case, row) in &self.rows {
            let case = &CASES[*case];
            let (limit, took, overrun) = match case.expected {
                Expected::Safe { within, avoidable, .. } => {
                    let overrun =
                        if avoidable { format!("{:.3}°", row.overrun) } else { "not avoidable".into() };
                    (format!("{:.1} ms", within * 1e3), took(case, row), overrun)
                }
                Expected::BoardSafe { within } => (
                    format!("{:.1} ms, by the board alone", within * 1e3),
                    took(case, row),
                    format!("{:.3}°", row.overrun),
                ),
                Expected::Tolerated => ("goes on".into(), "–".into(), "–".into()),
            };
            let causes: Vec<String> = row.causes.iter().map(|(c, n)| format!("{c} {n}")).collect();
            let watchdog = if case.watchdog_cycles == 3 {
                String::new()
            } else {
                format!(" (watchdog of {} cycles)", case.watchdog_cycles)
            };
            writeln!(
                f,
                "| {}{watchdog} | {} | {} | {limit} | {took} | {overrun} | {} |",
                case.name,
                case.hazards,
                row.runs,
                causes.join(", ")
            )?;
        }
        Ok(())
    }
}
