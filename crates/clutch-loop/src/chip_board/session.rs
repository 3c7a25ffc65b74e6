//! A session with a board whose image runs on the model of its chip, in virtual time.

use super::{ChipBoard, ChipEnd, ChipFault, ChipKind};
use crate::clearance::Admitted;
use crate::from_scenario::{self, BuiltRun};
use crate::lockstep_session::{LockstepError, LockstepOptions};
use crate::onlooker::Looking;
use crate::session::SessionError;
use crate::station::{ALIVE_NS, BOARD_SILENCE_NS, ControllerStation, HOST_SILENCE, HostStation, Station};
use crate::virtual_time::{VirtualError, VirtualLoop, VirtualOptions, VirtualReport};
use clutch_core::{Planned, Real};
use clutch_node::{ControllerNode, HostNode};
use clutch_sim::Scenario;
use clutch_sim::scenario::ScalarKind;
use std::path::{Path, PathBuf};

/// The role of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChipRole {
    /// The loop is closed on the chip, and this machine looks on.
    Controller,
    /// The loop is closed on this machine.
    Daq,
}

impl ChipRole {
    /// The role of an image by its name.
    #[must_use]
    pub fn of(image: &Path) -> ChipRole {
        let daq = image.file_name().is_some_and(|name| name.to_string_lossy().contains("daq"));
        if daq { ChipRole::Daq } else { ChipRole::Controller }
    }
}

/// Options of a session with the chip, beside those of any session in virtual time.
#[derive(Clone, Debug, Default)]
pub struct ChipOptions {
    /// Faults of the chip.
    pub faults: Vec<ChipFault>,
    /// A file for the numbers of instructions; counting makes the run slower.
    pub count: Option<PathBuf>,
    /// True if the records of a log are kept in the report, without a log as well.
    pub record: bool,
    /// Time after arming at which the run is left as it is, s.
    pub until: Option<f64>,
}

/// The outcome of a session with the chip.
#[derive(Clone, Debug)]
pub struct ChipReport {
    /// The run.
    pub ran: VirtualReport,
    /// The chip at the end.
    pub chip: ChipEnd,
}

/// A checked session with the chip.
#[derive(Clone, Debug)]
pub struct ChipSession {
    admitted: Admitted,
    options: LockstepOptions,
    chip: ChipOptions,
    role: ChipRole,
    looking: Option<Looking>,
}

impl ChipSession {
    /// Checks everything that can be checked without a board.
    ///
    /// # Errors
    /// As [`check`](crate::clearance::check).
    pub fn new(
        scenario: Scenario,
        options: LockstepOptions,
        chip: ChipOptions,
        role: ChipRole,
    ) -> Result<Self, SessionError> {
        let (uncertified, log) = (options.uncertified, options.log.as_deref());
        let admitted = match role {
            ChipRole::Controller => Admitted::in_single_precision(scenario, uncertified, log)?,
            ChipRole::Daq => Admitted::new(scenario, uncertified, log)?,
        };
        Ok(ChipSession { admitted, options, chip, role, looking: None })
    }

    /// The same with one that looks on.
    #[must_use]
    pub fn looked_at(self, looking: Option<Looking>) -> Self {
        ChipSession { looking, ..self }
    }

    /// The scenario as it will run.
    #[must_use]
    pub fn admitted(&self) -> &Admitted {
        &self.admitted
    }

    /// Powers up a board with an image, and runs it to the path's end or to a fault.
    ///
    /// # Errors
    /// The chip does not start or ends; the board does not take the run; the log cannot be written.
    pub fn run(&self, image: &Path) -> Result<ChipReport, LockstepError> {
        let (ran, board) = self.run_board(image)?;
        Ok(ChipReport { ran, chip: board.end().map_err(VirtualError::from)? })
    }

    /// The same; gives the board as the run has left it.
    ///
    /// # Errors
    /// As [`ChipSession::run`].
    pub fn run_board(&self, image: &Path) -> Result<(VirtualReport, ChipBoard), LockstepError> {
        match (self.role, self.admitted.scenario().scalar()) {
            (ChipRole::Controller, _) => self.controller(image),
            (ChipRole::Daq, ScalarKind::F32) => self.daq::<f32>(image),
            (ChipRole::Daq, ScalarKind::F64) => self.daq::<f64>(image),
        }
    }

    /// The loop is closed on the chip.
    fn controller(&self, image: &Path) -> Result<(VirtualReport, ChipBoard), LockstepError> {
        let scenario = self.admitted.scenario();
        let built = BuiltRun::<f32>::new(scenario, 1).map_err(SessionError::from)?;
        // The last period is the one in which the run ends.
        let ticks = built.ticks + 1;
        let configure = ControllerNode::new(built.controller, built.servo, built.supervisor).configuration();
        let path = || from_scenario::path::<f32>(scenario).map_err(SessionError::from);
        let node = HostNode::new(built.servo, configure, ALIVE_NS, BOARD_SILENCE_NS);
        let settings = from_scenario::settings(scenario, &built, HOST_SILENCE, ticks);
        let settings = settings.map_err(SessionError::from)?;
        let station = HostStation::uploading(node, path()?, settings);
        self.drive(image, &built, ticks, station, &path()?)
    }

    /// The loop is closed here.
    fn daq<T: Real>(&self, image: &Path) -> Result<(VirtualReport, ChipBoard), LockstepError> {
        let built = BuiltRun::<T>::new(self.admitted.scenario(), 1).map_err(SessionError::from)?;
        let path = from_scenario::path::<T>(self.admitted.scenario()).map_err(SessionError::from)?;
        let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
        let station = ControllerStation::new(node, &path);
        self.drive(image, &built, built.ticks + 1, station, &path)
    }

    fn drive<S: Station>(
        &self,
        image: &Path,
        built: &BuiltRun<S::Scalar>,
        ticks: u64,
        station: S,
        path: &impl Planned<S::Scalar>,
    ) -> Result<(VirtualReport, ChipBoard), LockstepError> {
        let (run, o) = (&self.admitted.scenario().spec().run, &self.options);
        // A host hears only after a while that a board is silent.
        let broken = !o.faults.is_empty() || !self.chip.faults.is_empty();
        let after = if broken { 0.1 + BOARD_SILENCE_NS as f64 / 1e9 } else { 0.1 };
        let params = VirtualOptions {
            latency_ns: o.latency_ns,
            faults: o.faults.clone(),
            seed: o.seed,
            record: o.log.is_some() || self.chip.record,
            duration: self.chip.until.unwrap_or(run.duration + after),
            ticks,
            settle: run.settle,
            ..VirtualOptions::default()
        };
        let board =
            ChipBoard::start(image, self.admitted.scenario(), &self.chip.faults, self.chip.count.as_deref());
        let chip =
            ChipKind::of(image).map_or_else(String::new, |kind| format!("model of an {}", kind.name()));
        let played = o.played(self.looking.as_ref(), self.admitted.scenario(), &built.servo, &chip);
        let mut on_chip = VirtualLoop::with_board(board?, params, station).played(played);
        let ran = on_chip.run(path)?;
        o.write_log(self.admitted.scenario(), &built.servo, (&chip, self.admitted.cleared()), &ran)?;
        Ok((ran, on_chip.into_board()))
    }
}
