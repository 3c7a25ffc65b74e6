//! A session with an image that has no host: its button is pressed, its lamp watched, and each of its codes compared with
//! that of the scenario's controller in this process, on the same counts.

use super::{ChipBoard, ChipEnd, ChipFault};
use crate::clearance::Admitted;
use crate::from_scenario::{self, BuiltRun};
use crate::lockstep_session::LockstepError;
use crate::session::SessionError;
use crate::true_motion::{At, TrueMotion};
use crate::virtual_time::{VirtualBoard, VirtualError};
use clutch_core::law::LawState;
use clutch_core::supervisor::{BoardMode, Cause, Sample};
use clutch_core::{
    BeginningAt, Counts, DacCode, FixedCounts, Micros, Planned, Servo, Supervisor, SupervisorState,
};
use clutch_node::Outbox;
use clutch_sim::{Metrics, Scenario};
use std::path::{Path, PathBuf};

/// Time for which the board is left alone before its button is pressed, ns.
const BEFORE_NS: u64 = 1_100_000_000;
/// The longest that a press may need, ns.
const PRESS_NS: u64 = 100_000_000;
/// Dark for so long is behind the last flash, ns.
const PAUSE_NS: u64 = 500_000_000;
/// Time in which any number of flashes has been seen, ns.
const FLASHES_NS: u64 = 10_000_000_000;

/// The outcome of a session with an image that has no host.
#[derive(Clone, Debug)]
pub struct AloneReport {
    /// Codes under control, tick by tick.
    pub codes: Vec<u16>,
    /// Those of the scenario's controller in this process, on the same counts.
    pub expected: Vec<u16>,
    /// Ticks of the scenario.
    pub ticks: u64,
    /// True if control goes on after the scenario's ticks: the image has a longer run.
    pub goes_on: bool,
    /// Figures of the shaft's true motion under control.
    pub metrics: Metrics,
    /// Flashes of the lamp after the end: one for the end of the path, the number of the cause for a fault, 12 after a reset by
    /// the board itself; none if the board does not flash.
    pub flashes: u32,
    /// The chip at the end.
    pub chip: ChipEnd,
}

impl AloneReport {
    /// The first tick with another code than in this process.
    #[must_use]
    pub fn differs(&self) -> Option<usize> {
        self.codes.iter().zip(&self.expected).position(|(here, there)| here != there)
    }

    /// True if the path was followed to its end, and nothing was reset on the way.
    #[must_use]
    pub fn done(&self) -> bool {
        self.chip.resets == 0 && self.flashes == 1 && self.codes.len() as u64 == self.ticks
    }

    /// The cause of a fault, by the lamp; none at the end of the path.
    #[must_use]
    pub fn fault(&self) -> Option<Cause> {
        // One flash is an end that was wanted: no sample is lost where there is no line.
        u8::try_from(self.flashes).ok().filter(|n| *n > 1).and_then(Cause::from_u8)
    }
}

/// A checked session with an image that has no host.
#[derive(Clone, Debug)]
pub struct AloneSession {
    admitted: Admitted,
    faults: Vec<ChipFault>,
    count: Option<PathBuf>,
}

/// The scenario's controller, which sees what the chip sees.
struct Twin {
    servo: Servo<f32>,
    supervisor: Supervisor<f32>,
    state: SupervisorState<f32, LawState<f32>>,
    sequence: u16,
}

impl Twin {
    fn code(&mut self, now_ns: u64, counts: Counts, planned: impl Planned<f32>) -> u16 {
        let sample = Sample {
            sequence: self.sequence,
            time: Micros((now_ns / 1000) as u32),
            counts,
            board: BoardMode::Driving,
            ..Sample::default()
        };
        self.sequence = self.sequence.wrapping_add(1);
        self.supervisor.sample(&self.servo, &mut self.state, &sample, planned);
        self.state.code().0
    }
}

/// The run on its way.
struct Course<'a, P> {
    board: ChipBoard,
    now_ns: u64,
    path: &'a P,
    twin: Twin,
    expected: Vec<u16>,
    origin: FixedCounts,
    figures: TrueMotion,
    codes: Vec<u16>,
    /// The shaft at the last sample.
    waiting: Option<At>,
}

impl AloneSession {
    /// Checks everything that can be checked without the image.
    ///
    /// # Errors
    /// As [`check`](crate::clearance::check).
    pub fn new(
        scenario: Scenario,
        uncertified: bool,
        faults: Vec<ChipFault>,
        count: Option<PathBuf>,
    ) -> Result<Self, SessionError> {
        let admitted = Admitted::in_single_precision(scenario, uncertified, None)?;
        Ok(AloneSession { admitted, faults, count })
    }

    /// The scenario as it will run.
    #[must_use]
    pub fn admitted(&self) -> &Admitted {
        &self.admitted
    }

    /// Powers up a board with an image, presses its button, and lets it run to the path's end or to a fault.
    ///
    /// # Errors
    /// The chip does not start or ends; no press begins a run.
    pub fn run(&self, image: &Path) -> Result<AloneReport, LockstepError> {
        let scenario = self.admitted.scenario();
        let spec = scenario.spec();
        let built = BuiltRun::<f32>::new(scenario, 1).map_err(SessionError::from)?;
        let path = from_scenario::path::<f32>(scenario).map_err(SessionError::from)?;
        let board = ChipBoard::start(image, scenario, &self.faults, self.count.as_deref())?;
        let radians_per_count = board.rig().rig().encoder.radians_per_count();
        let figures = TrueMotion::new(spec.period, radians_per_count, spec.run.settle);
        let twin = Twin {
            servo: built.servo,
            supervisor: built.supervisor,
            state: SupervisorState::default(),
            sequence: 0,
        };
        let mut course = Course {
            board,
            now_ns: 0,
            path: &path,
            twin,
            expected: Vec::new(),
            origin: FixedCounts(0),
            figures,
            codes: Vec::new(),
            waiting: None,
        };
        course.begin()?;
        course.drive(built.ticks)?;
        let goes_on = course.board.lamp();
        let flashes = course.flashes()?;
        let Course { board, figures, codes, expected, .. } = course;
        Ok(AloneReport {
            codes,
            expected,
            ticks: built.ticks,
            goes_on,
            metrics: figures.finish(),
            flashes,
            chip: board.end().map_err(VirtualError::from)?,
        })
    }

    /// True if an image has no host, by its name.
    #[must_use]
    pub fn is_for(image: &Path) -> bool {
        image.file_name().is_some_and(|name| name.to_string_lossy().contains("alone"))
    }
}

impl<P: Planned<f32>> Course<'_, P> {
    /// The chip goes on to what it does next, but no further than to a time.
    fn step(&mut self, until_ns: u64) -> Result<(), VirtualError> {
        self.now_ns = self.board.next_ns().map_or(until_ns, |next| next.clamp(self.now_ns, until_ns));
        self.board.step(self.now_ns, &mut Outbox::default())
    }

    /// The button: let go for a while, then pressed until the lamp is lit.
    fn begin(&mut self) -> Result<(), VirtualError> {
        self.board.press(false);
        while self.now_ns < BEFORE_NS {
            self.step(BEFORE_NS)?;
        }
        let present = DacCode(self.board.code().0);
        self.board.press(true);
        while !self.board.lamp() {
            if self.now_ns >= BEFORE_NS + PRESS_NS {
                let why = "a press of its button does not light its lamp for good";
                return Err(VirtualError::Refused(why.to_owned()));
            }
            self.step(BEFORE_NS + PRESS_NS)?;
        }
        self.origin = FixedCounts::from_counts(i64::from(self.board.rig().counts().0));
        self.twin.supervisor.connect(&mut self.twin.state);
        self.twin.supervisor.arm(&mut self.twin.state, present);
        self.sampled();
        self.board.press(false);
        Ok(())
    }

    /// To the end of control, but for no more than some ticks beyond the scenario's.
    fn drive(&mut self, ticks: u64) -> Result<(), VirtualError> {
        let mut samples = self.board.samples();
        while (self.codes.len() as u64) < ticks.saturating_add(10) {
            self.step(u64::MAX)?;
            if !self.board.lamp() {
                self.measure();
                break;
            }
            if self.board.samples() != samples {
                samples = self.board.samples();
                self.measure();
                self.sampled();
            }
        }
        Ok(())
    }

    /// A sample has its code.
    fn sampled(&mut self) {
        let rig = self.board.rig();
        self.waiting = Some(At::now(rig));
        let planned = BeginningAt { planned: self.path, origin: self.origin };
        self.expected.push(self.twin.code(self.now_ns, rig.counts(), planned));
        self.codes.push(self.board.code().0);
    }

    /// The period behind the last sample is over.
    fn measure(&mut self) {
        let events = self.board.take_events();
        let Some(began) = self.waiting.take() else { return };
        let tick = self.codes.len() as u64 - 1;
        let target = self.path.target(tick).position.plus(self.origin);
        self.figures.period(tick, &began, target, self.board.volts(), &events);
    }

    /// The flashes of the lamp until it pauses; none while it is lit because control has not ended.
    fn flashes(&mut self) -> Result<u32, VirtualError> {
        let (end_ns, mut flashes, mut changed_ns, mut lit) =
            (self.now_ns + FLASHES_NS, 0, self.now_ns, self.board.lamp());
        if lit {
            return Ok(0);
        }
        while self.now_ns < end_ns && !(flashes > 0 && !lit && self.now_ns - changed_ns > PAUSE_NS) {
            self.step(end_ns)?;
            if self.board.lamp() != lit {
                (lit, changed_ns) = (!lit, self.now_ns);
                flashes += u32::from(lit);
            }
        }
        Ok(flashes)
    }
}
