//! A session with a board controller in lockstep: the board's own image, and the simulated rig as its encoder and
//! converter, in virtual time.

use crate::clearance::{Admitted, Cleared};
use crate::faults::Fault;
use crate::from_scenario::{self, BuiltRun};
use crate::lockstep_board::LockstepBoard;
use crate::lockstep_host::lockstep_host;
use crate::onlooker::{Looking, Played};
use crate::qemu_board::QemuError;
use crate::session::SessionError;
use crate::to_log::PRESENT_CODE;
use crate::virtual_time::{VirtualError, VirtualLoop, VirtualOptions, VirtualReport};
use clutch_core::{Micros, Real, Servo};
use clutch_log::{Header, LogWriter, Source};
use clutch_sim::Scenario;
use std::path::PathBuf;

/// Options of a session in lockstep; by default gains have to be certified, and nothing goes wrong.
#[derive(Clone, Debug, Default)]
pub struct LockstepOptions {
    /// A new file for a log, with the shaft's true motion.
    pub log: Option<PathBuf>,
    /// True if gains may run that are not certified for the scenario's bounds.
    pub uncertified: bool,
    /// The faults of line and rig.
    pub faults: Vec<Fault>,
    /// Seed of what goes wrong at random.
    pub seed: u64,
    /// Time that a frame takes between board and rig, ns.
    pub latency_ns: u64,
    /// Silence of encoder and converter that the board bears, if its clock runs on while this machine computes.
    pub silence: Option<Micros>,
    /// Version and commit of the build, for the log.
    pub version: String,
}

impl LockstepOptions {
    fn header<T: Real>(&self, scenario: &Scenario, servo: &Servo<T>, board: &str) -> Header {
        from_scenario::header(scenario, servo, Source::Loop, board, &self.version)
    }

    /// The view of a run on a kind of board, if one is wanted.
    pub(crate) fn played<T: Real>(
        &self,
        looking: Option<&Looking>,
        scenario: &Scenario,
        servo: &Servo<T>,
        board: &str,
    ) -> Option<Played> {
        looking.map(|looking| looking.begin(&self.header(scenario, servo, board), scenario))
    }

    /// Writes the log of a run, if one is wanted: `on` is the kind of board, and what is known of the gains.
    pub(crate) fn write_log<T: Real>(
        &self,
        scenario: &Scenario,
        servo: &Servo<T>,
        (board, cleared): (&str, &Cleared),
        report: &VirtualReport,
    ) -> Result<(), SessionError> {
        let Some(file) = &self.log else { return Ok(()) };
        let mut header = self.header(scenario, servo, board);
        header.extra.push((PRESENT_CODE.to_owned(), report.present.to_string()));
        header.extra.push(("board".to_owned(), "emulated".to_owned()));
        header.extra.extend(cleared.verdicts());
        let mut log = LogWriter::create(file, &header)?;
        for record in &report.records {
            log.write(record)?;
        }
        log.finish()?;
        Ok(())
    }
}

/// A session in lockstep was refused, or could not go on.
#[derive(Debug, thiserror::Error)]
pub enum LockstepError {
    /// Scenario, gains or log.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The emulated board.
    #[error(transparent)]
    Board(#[from] QemuError),
    /// The run.
    #[error(transparent)]
    Virtual(#[from] VirtualError),
}

/// A checked session in lockstep, in single precision as the board calculates.
#[derive(Clone, Debug)]
pub struct LockstepSession {
    admitted: Admitted,
    options: LockstepOptions,
    looking: Option<Looking>,
}

impl LockstepSession {
    /// Checks everything that can be checked without a board.
    ///
    /// # Errors
    /// As [`check`](crate::clearance::check).
    pub fn new(scenario: Scenario, options: LockstepOptions) -> Result<Self, SessionError> {
        let admitted = Admitted::in_single_precision(scenario, options.uncertified, options.log.as_deref())?;
        Ok(LockstepSession { admitted, options, looking: None })
    }

    /// The same with one that looks on.
    #[must_use]
    pub fn looked_at(self, looking: Option<Looking>) -> Self {
        LockstepSession { looking, ..self }
    }

    /// The scenario as it will run.
    #[must_use]
    pub fn admitted(&self) -> &Admitted {
        &self.admitted
    }

    /// Starts a board, and runs it to the path's end or to a fault.
    ///
    /// # Errors
    /// The board does not start or ends; it does not take the run; the log cannot be written.
    pub fn run<L: LockstepBoard>(
        &self,
        start: impl FnOnce() -> Result<L, QemuError>,
    ) -> Result<VirtualReport, LockstepError> {
        let (scenario, o) = (self.admitted.scenario(), &self.options);
        let mut built = BuiltRun::<f32>::new(scenario, 1).map_err(SessionError::from)?;
        if let Some(silence) = o.silence {
            built.controller.silence = silence;
        }
        // The last period is the one in which the run ends.
        let ticks = built.ticks + 1;
        let params = VirtualOptions {
            watched: f64::INFINITY,
            latency_ns: o.latency_ns,
            faults: o.faults.clone(),
            stall: None,
            seed: o.seed,
            record: o.log.is_some(),
            duration: scenario.spec().run.duration + 1.0,
            ticks,
            settle: scenario.spec().run.settle,
        };
        let station = lockstep_host(scenario, &built, start()?, ticks).map_err(SessionError::from)?;
        let path = from_scenario::path::<f32>(scenario).map_err(SessionError::from)?;
        let on_rig = VirtualLoop::new(scenario, params, station).map_err(VirtualError::from);
        let played = o.played(self.looking.as_ref(), scenario, &built.servo, "emulated board");
        let report = on_rig?.played(played).run(&path)?;
        self.options.write_log(
            scenario,
            &built.servo,
            ("emulated board", self.admitted.cleared()),
            &report,
        )?;
        Ok(report)
    }
}
