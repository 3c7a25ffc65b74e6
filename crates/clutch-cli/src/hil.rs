//! `clutch hil`.

use crate::args::{ScenarioArgs, key_value};
use crate::images::image;
use crate::live::LiveArg;
use crate::output::{BUILD, Exit, json, not_certified, paragraph, remark, report, to_write, warn};
use crate::signals::stop_flag;
use crate::sim;
use crate::table::{number, quantities};
use clap::{Args, ValueEnum};
use clutch_core::Micros;
use clutch_core::supervisor::Cause;
use clutch_loop::cause_words::cause_text;
use clutch_loop::chip_board::{
    AloneReport, AloneSession, ChipEnd, ChipFault, ChipKind, ChipOptions, ChipRole, ChipSession,
};
use clutch_loop::clearance::ClearanceError;
use clutch_loop::faults::{Fault, FaultKind};
use clutch_loop::lockstep_session::{LockstepOptions, LockstepSession};
use clutch_loop::onlooker::Looking;
use clutch_loop::qemu_board::{QemuBoard, QemuSerialBoard};
use clutch_loop::session::SessionError;
use clutch_loop::virtual_time::VirtualReport as Ran;
use clutch_sim::{Metrics, Scenario};
use std::path::PathBuf;

/// Runs the loop on an emulated board, with the simulated rig as its encoder and converter.
///
/// This is hardware in the loop, without the hardware: the board's own image runs, on a Cortex-M4F
/// in qemu-system-arm or, for a NUCLEO-G474RE or a Raspberry Pi Pico, on a register model of its chip;
/// it takes a step, and waits for the simulation to take one. Time is computed, so that a run is the same each time, bit
/// for bit, however long it takes. Laws without memory under a weight have the figures of `clutch sim` in single precision.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  cargo xtask firmware build && clutch hil\n  clutch hil board_smc_2 --log run.mcap && \
    clutch replay run.mcap\n  clutch hil --fault silence:at=2\n  \
    clutch hil examples/nucleo_smc_2.toml --image nucleo-controller\n  \
    clutch hil examples/nucleo_smc_2.toml \\\n      --image nucleo-daq --chip-fault hang:at=2\n  \
    clutch hil examples/pico_smc_2.toml --image pico-controller\n\n\
    The chip's model needs Python with the module unicorn (pip install unicorn); CLUTCH_PYTHON names another \
    interpreter than python3. Images are in $CLUTCH_IMAGES if it is set, else in target/firmware, else in \
    share/clutch/images beside the command.\n\n\
    Exit codes: 0 the path is done; 1 an error; 2 not certified; 3 a fault ended the run. docs/firmware.md is the guide."
)]
pub(crate) struct Hil {
    /// Scenario file, or the name of a built-in scenario; board_smc_2 if none is given.
    #[arg(value_name = "SCENARIO.toml", default_value = "board_smc_2")]
    scenario: PathBuf,
    /// Overrides a key of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// The board's image: a file, or mps2-controller, nucleo-controller, nucleo-daq, nucleo-alone,
    /// pico-controller or pico-daq. One whose name begins with nucleo- or pico- runs on the chip's
    /// model, in the role daq if its name says so; one that says alone has its run compiled in, and its
    /// button is pressed.
    #[arg(long, value_name = "IMAGE", default_value = "mps2-controller")]
    image: PathBuf,
    /// Link to the board in qemu.
    #[arg(long, value_enum, default_value = "memory")]
    link: Link,
    /// Writes an MCAP log, with the shaft's true motion.
    #[arg(long, value_parser = to_write(), value_name = "FILE.mcap")]
    log: Option<PathBuf>,
    /// Runs a law that is not certified for the scenario's bounds.
    #[arg(long)]
    uncertified: bool,
    /// Injects a fault on line or rig, on the chip's model on the line; see `clutch daq --help`.
    #[arg(long, value_name = "KIND:KEY=VALUE,…")]
    fault: Vec<Fault>,
    /// Injects a fault into the chip: converter-stuck, amplifier, crystal, overrun, hang, undefined, nmi,
    /// unexpected, stack-overflow, panic, supply-low, brown-out-low (these three nucleo) or encoder-skip
    /// (pico); :at=SECONDS after arming, else from power-up on.
    #[arg(long, value_name = "KIND[:at=S]")]
    chip_fault: Vec<ChipFault>,
    /// Counts the instructions on the chip's model, and writes the numbers as JSON; takes several
    /// times as long.
    #[arg(long, value_parser = to_write(), value_name = "FILE.json")]
    count: Option<PathBuf>,
    /// Seed of the random faults.
    #[arg(long, default_value_t = 1)]
    fault_seed: u64,
    /// Time that a frame takes between board and rig, µs.
    #[arg(long, default_value_t = 0, value_name = "US", value_parser = clap::value_parser!(u32).range(0..=100_000))]
    latency_us: u32,
    #[command(flatten)]
    live: LiveArg,
    /// Prints the summary as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Link {
    /// Through the emulator's own files: some 20 000 cycles a second, the same each time.
    Memory,
    /// Through the board's two serial lines, interrupts and clock: some 500 to 2000 cycles a
    /// second. Late answers are not checked, since this machine decides the lateness.
    Uart,
}

impl Hil {
    pub(crate) fn run(mut self) -> anyhow::Result<Exit> {
        self.live.check()?;
        self.image = image(self.image)?;
        if let Some(kind) = ChipKind::of(&self.image) {
            return self.on_chip(kind);
        }
        if !self.chip_fault.is_empty() || self.count.is_some() {
            anyhow::bail!(
                "--chip-fault and --count: {} does not run on a chip's model; use --image nucleo-controller, \
                 nucleo-daq, nucleo-alone, pico-controller or pico-daq",
                self.image.display()
            );
        }
        if self.link == Link::Uart {
            self.set.push(("safety.limits.deadline_us".to_owned(), "1000000".to_owned()));
        }
        let Some(session) = self.checked(LockstepSession::new(self.load()?, self.options()))? else {
            return Ok(Exit::NotCertified);
        };
        let session = session.looked_at(self.looking()?);
        tell(session.admitted().note());
        let started = std::time::Instant::now();
        let ran = match self.link {
            Link::Memory => session.run(|| QemuBoard::start(&self.image))?,
            Link::Uart => session.run(|| QemuSerialBoard::start(&self.image))?,
        };
        let took = started.elapsed().as_secs_f64();
        let scenario = &session.admitted().scenario().clone();
        drop(session); // its views have seen the end of it, and the terminal is free
        report(
            self.json,
            || json(&summary(scenario, &ran, took)),
            || self.text(scenario, &ran, "the emulated board", took),
        )?;
        Ok(exit(&ran))
    }

    /// On the model of the chip.
    fn on_chip(self, kind: ChipKind) -> anyhow::Result<Exit> {
        let chip = ChipOptions {
            faults: self.chip_fault.clone(),
            count: self.count.clone(),
            ..ChipOptions::default()
        };
        let role = ChipRole::of(&self.image);
        if self.link == Link::Uart {
            anyhow::bail!(
                "--link uart: it is for the board in qemu; the chip's model always goes through its line"
            );
        }
        let of_the_line = |fault: &&Fault| fault.kind.silences() && fault.kind != FaultKind::Reset;
        if let Some(fault) = self.fault.iter().find(|fault| !of_the_line(fault)) {
            anyhow::bail!(
                "--fault {fault}: the simulated board's; on the chip's model --fault takes the line's faults, and \
                 --chip-fault those of the chip"
            );
        }
        if AloneSession::is_for(&self.image) {
            return self.alone(kind, chip);
        }
        let session = ChipSession::new(self.load()?, self.options(), chip, role);
        let Some(session) = self.checked(session)? else { return Ok(Exit::NotCertified) };
        let session = session.looked_at(self.looking()?);
        tell(session.admitted().note());
        let started = std::time::Instant::now();
        let on_chip = session.run(&self.image)?;
        let took = started.elapsed().as_secs_f64();
        let (scenario, ran) = (&session.admitted().scenario().clone(), &on_chip.ran);
        drop(session);
        let all = || {
            let mut all = summary(scenario, ran, took);
            all["chip"] = serde_json::json!(on_chip.chip);
            json(&all)
        };
        report(self.json, all, || {
            self.text(scenario, ran, &format!("the model of an {}", kind.name()), took)
                + &chip_text(&on_chip.chip)
        })?;
        Ok(exit(ran))
    }

    /// An image without a host, on the model of the chip.
    fn alone(self, kind: ChipKind, chip: ChipOptions) -> anyhow::Result<Exit> {
        if self.log.is_some() || !self.fault.is_empty() || self.latency_us > 0 || self.live.asked_for() {
            anyhow::bail!(
                "--log, --fault, --latency-us and the views: {} has no line to a host",
                self.image.display()
            );
        }
        let session = AloneSession::new(self.load()?, self.uncertified, chip.faults, chip.count);
        let Some(session) = self.checked(session)? else { return Ok(Exit::NotCertified) };
        tell(session.admitted().note());
        let started = std::time::Instant::now();
        let ran = session.run(&self.image)?;
        let took = started.elapsed().as_secs_f64();
        let scenario = session.admitted().scenario();
        let all = || {
            let mut all = base(scenario, ran.codes.len() as u64, &ran.metrics, took);
            all["differs_at_tick"] = serde_json::json!(ran.differs());
            all["goes_on"] = ran.goes_on.into();
            all["flashes"] = ran.flashes.into();
            all["cause"] = serde_json::json!(ran.fault().map(|cause| format!("{cause:?}")));
            all["chip"] = serde_json::json!(ran.chip);
            json(&all)
        };
        report(self.json, all, || alone_text(scenario, &ran, kind, took))?;
        let fault = ran.chip.resets > 0 || !(ran.goes_on || ran.flashes == 1);
        Ok(match (ran.done(), ran.differs()) {
            (true, None) => Exit::Done,
            _ if fault => Exit::Fault,
            _ => Exit::Failed,
        })
    }

    fn load(&self) -> anyhow::Result<Scenario> {
        let (scenario, set) = (self.scenario.clone(), self.set.clone());
        ScenarioArgs { scenario, set, identified: None, map: None }.load()
    }

    /// A session; none, and the reason is printed, if the gains are not certified.
    fn checked<T>(&self, session: Result<T, SessionError>) -> anyhow::Result<Option<T>> {
        match session {
            Ok(session) => Ok(Some(session)),
            Err(SessionError::Clearance(refusal @ ClearanceError::NotCertified { .. })) => {
                warn(&not_certified(&refusal, &self.scenario))?;
                Ok(None)
            }
            Err(refusal) => Err(refusal.into()),
        }
    }

    /// The views that were asked for.
    fn looking(&self) -> anyhow::Result<Option<Looking>> {
        // Ctrl-C ends it at once, unless a view is to see the end.
        if self.live.asked_for() { self.live.looking(&stop_flag()?) } else { Ok(None) }
    }

    fn options(&self) -> LockstepOptions {
        LockstepOptions {
            log: self.log.clone(),
            uncertified: self.uncertified,
            faults: self.fault.clone(),
            seed: self.fault_seed,
            latency_ns: u64::from(self.latency_us) * 1000,
            // The board's own clock runs on while this machine computes.
            silence: (self.link == Link::Uart).then_some(Micros(10_000_000)),
            version: BUILD.to_owned(),
        }
    }

    fn text(&self, scenario: &Scenario, ran: &Ran, board: &str, took: f64) -> String {
        let mut text = figures(scenario, board, ran.answers, &ran.metrics, took);
        if let Some(file) = &self.log {
            text += &format!("log: {0}; clutch replay {0}\n", file.display());
        }
        let board = ran.board.map_or("gone".to_owned(), |s| format!("{s:?}").to_lowercase());
        let standing = &ran.standing;
        text += &match standing.cause {
            Cause::None => {
                let state = format!("{:?}", standing.state).to_lowercase();
                paragraph(&format!(
                    "control did not end: the board is {state}, encoder and converter are {board}"
                ))
            }
            cause => {
                let asked_for = cause == Cause::Done || cause == Cause::Operator && ran.stopped;
                let fault = if asked_for { "" } else { "FAULT: " };
                let what = cause_text(cause, standing.value, true, ran.stopped);
                paragraph(&format!("{fault}{what}; encoder and converter are {board}"))
            }
        };
        text
    }
}

/// The figures of a run, under its title.
fn figures(scenario: &Scenario, board: &str, ticks: u64, metrics: &Metrics, took: f64) -> String {
    let title = format!(
        "{}\n{ticks} ticks on {board} in {took:.1} s, seed {}\nfigures over {} s after settling",
        scenario.name(),
        scenario.spec().run.seed,
        number(metrics.measured_s)
    );
    quantities(&title, &sim::figures(metrics))
}

/// The figures of a run without a host, its codes beside those of this machine, and what the lamp says.
fn alone_text(scenario: &Scenario, ran: &AloneReport, kind: ChipKind, took: f64) -> String {
    let board = format!("the model of an {}", kind.name());
    let mut text = figures(scenario, &board, ran.codes.len() as u64, &ran.metrics, took);
    let code = |codes: &[u16], tick: usize| codes.get(tick).map_or("none".to_owned(), u16::to_string);
    text += &paragraph(&match ran.differs() {
        None => "each code is that of the scenario's controller on this machine".to_owned(),
        Some(tick) if ran.chip.resets == 0 && ran.fault().is_none() => format!(
            "tick {tick}: its code is {}, that of the scenario's controller on this machine {}. The image has its run compiled \
             in: is it this scenario's (clutch scenario rust)?",
            code(&ran.codes, tick),
            code(&ran.expected, tick)
        ),
        Some(tick) => {
            format!("the first {tick} codes are those of the scenario's controller on this machine")
        }
    });
    let ticks = ran.codes.len();
    text += &paragraph(&match (ran.flashes, ran.fault()) {
        (_, _) if ran.goes_on => {
            format!("control goes on after the scenario's {} ticks: the image has a longer run", ran.ticks)
        }
        (0, _) => format!("control ended after {ticks} ticks; the lamp does not flash"),
        (1, _) if ran.done() => {
            "the lamp flashes once: the path is done, and the safe output holds".to_owned()
        }
        (1, _) => {
            format!("the lamp flashes once: the path is done after {ticks} ticks, and not {}", ran.ticks)
        }
        (n, Some(cause)) => {
            format!(
                "FAULT: control ended after {ticks} ticks; the lamp flashes {n} times, {cause:?} (docs/firmware.md)"
            )
        }
        (n, None) => format!("FAULT: control ended after {ticks} ticks; the lamp flashes {n} times"),
    });
    text + &chip_text(&ran.chip)
}

/// A remark, on standard error.
fn tell(note: Option<&str>) {
    if let Some(note) = note {
        remark(&paragraph(&format!("note: {note}")));
    }
}

fn exit(ran: &Ran) -> Exit {
    match ran.standing.cause {
        Cause::Done => Exit::Done,
        Cause::None => Exit::Failed,
        Cause::Operator if ran.stopped => Exit::Stopped,
        _ => Exit::Fault,
    }
}

/// The state of the chip at the end, where it is not as always.
fn chip_text(chip: &ChipEnd) -> String {
    let mut text = String::new();
    if chip.resets > 0 {
        text += &format!("the chip was reset: {}\n", chip.resets);
    }
    if chip.dead {
        text += "the chip's program does not run any more\n";
    }
    if chip.floating {
        text += "the converter decides nothing: divider or switch at the driver's input hold\n";
    }
    text
}

/// The rows that each summary begins with.
fn base(scenario: &Scenario, ticks: u64, metrics: &Metrics, took: f64) -> serde_json::Value {
    serde_json::json!({
        "scenario": scenario.name(),
        "version": env!("CARGO_PKG_VERSION"),
        "seed": scenario.spec().run.seed,
        "ticks": ticks,
        "took_s": took,
        "metrics": metrics,
    })
}

fn summary(scenario: &Scenario, ran: &Ran, took: f64) -> serde_json::Value {
    let standing = &ran.standing;
    let mut all = base(scenario, ran.answers, &ran.metrics, took);
    all["state"] = format!("{:?}", standing.state).into();
    all["cause"] = format!("{:?}", standing.cause).into();
    all["cause_text"] = cause_text(standing.cause, standing.value, true, ran.stopped).into();
    all["value"] = standing.value.into();
    all["board"] = serde_json::json!(ran.board.map(|s| format!("{s:?}")));
    all["lost"] = standing.lost.into();
    all
}
