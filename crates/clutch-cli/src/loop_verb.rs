//! `clutch loop`.

use crate::daq::stop_flag;
use crate::table::{number, quantities};
use crate::{Exit, ScenarioArgs, key_value, print};
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use clutch_core::law::Law;
use clutch_core::supervisor::{Cause, State};
use clutch_core::{DacCode, Micros, Real, SafeState};
use clutch_log::Source;
use clutch_loop::control_loop::{self, ConfiguredRun, LoopOptions, LoopReport, Pace};
use clutch_loop::faults::Fault;
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::log_thread::{LogThread, Ring};
use clutch_loop::port::{Address, DeviceKind, Endpoint, Port, PseudoTerminal, SerialOptions};
use clutch_loop::preflight::Talk;
use clutch_loop::realtime::{CycleSummary, RealtimeOptions, WaitMode, describe_system};
use clutch_loop::sim_board::{PATIENT_BOARD, STRICT_BOARD};
use clutch_loop::sim_board_server::{self, ServeOptions, ServeReport};
use clutch_loop::station::{ALIVE_NS, BOARD_SILENCE_NS, HOST_SILENCE};
use clutch_loop::station::{ControllerStation, HostStation, Station};
use clutch_loop::to_log::PRESENT_CODE;
use clutch_loop::watch::Watch;
use clutch_node::{ControllerNode, HostNode, present_code};
use clutch_sim::Scenario;
use clutch_sim::scenario::ScalarKind;
use clutch_wire::Hello;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PaceArg {
    /// The board's sample starts a cycle.
    Sample,
    /// This machine's clock starts a cycle.
    Clock,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum OverrunsArg {
    /// Late answers are counted; many within a short time end control.
    Manage,
    /// The first late answer ends control.
    Fault,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum WaitArg {
    /// The kernel wakes the loop.
    Sleep,
    /// The loop wakes early and spins.
    Spin,
}

/// Closes the loop on a board over a serial line, or on a simulated one.
///
/// Without --port it starts the simulated board in the background and runs over a real
/// pseudo-terminal. It checks board, path and gains, prints its plan, arms, and runs to the path's
/// end; Ctrl-C ends in the safe state.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  clutch loop\n  clutch loop mine.toml --port /dev/ttyACM0 --log run.mcap\n  \
    clutch loop --fault freeze:at=2 --strict\n\n\
    Exit codes: 0 the path is done; 1 an error; 2 not certified; 3 a fault ended the run, and the brake is in the \
    safe state; 4 stopped by Ctrl-C or SIGTERM, likewise. docs/loop.md is the guide, docs/safety.md lists the checks."
)]
pub(crate) struct Loop {
    /// Scenario file, or the name of a built-in scenario; board_smc_2 if none is given.
    #[arg(value_name = "SCENARIO.toml", default_value = "board_smc_2")]
    scenario: PathBuf,
    /// Overrides a key of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// The board's port; without it a board is simulated.
    #[arg(long, value_name = "PATH|tcp://HOST:PORT")]
    port: Option<Address>,
    /// The port of a board that closes the loop itself (docs/firmware.md): it is set up, armed, and
    /// watched.
    #[arg(long, value_name = "PATH|tcp://HOST:PORT", conflicts_with_all = ["port", "fault", "strict"])]
    board: Option<Address>,
    /// Line rate of the port, baud; no effect on USB, pseudo-terminals and TCP.
    #[arg(long)]
    baud: Option<u32>,
    /// Writes an MCAP log.
    #[arg(long, value_name = "FILE.mcap")]
    log: Option<PathBuf>,
    /// Length of the run instead of run.duration_s, s.
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Runs a law that is not certified for the scenario's bounds.
    #[arg(long)]
    uncertified: bool,
    /// Cycles per second instead of sampling.period_us, Hz.
    #[arg(long, alias = "update_rate", value_name = "HZ")]
    update_rate: Option<f64>,
    /// Keeps all memory in RAM.
    #[arg(long, alias = "lock_memory", value_name = "BOOL", default_value_t = true, action = clap::ArgAction::Set)]
    lock_memory: bool,
    /// Keeps the control thread on this core.
    #[arg(long, alias = "cpu_affinity", value_name = "CORE")]
    cpu_affinity: Option<usize>,
    /// Priority of the control thread under SCHED_FIFO, 1 to 99; 0 stays with the ordinary scheduler.
    #[arg(long, alias = "thread_priority", default_value_t = clutch_loop::realtime::DEFAULT_PRIORITY,
        value_parser = clap::value_parser!(u8).range(0..=99))]
    thread_priority: u8,
    /// Effect of a late answer.
    #[arg(long, value_enum, default_value = "manage")]
    overruns: OverrunsArg,
    /// Start of a cycle.
    #[arg(long, value_enum, default_value = "sample")]
    pace: PaceArg,
    /// Wait mode of the loop.
    #[arg(long, value_enum, default_value = "sleep")]
    wait: WaitArg,
    /// Time before a sample at which spinning begins, with --wait spin, µs.
    #[arg(long, default_value_t = 150, value_name = "US")]
    spin_us: u32,
    /// Injects a fault on the simulated board; see `clutch daq --help`.
    #[arg(long, value_name = "KIND:KEY=VALUE,…", conflicts_with = "port")]
    fault: Vec<Fault>,
    /// Seed of the random faults.
    #[arg(long, default_value_t = 1)]
    fault_seed: u64,
    /// Keeps the simulated board's clock running when this machine stalls, as on hardware.
    #[arg(long, conflicts_with = "port")]
    strict: bool,
    /// Prints the summary as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

/// The simulated board, beside the loop.
struct Background {
    stop: Arc<AtomicBool>,
    thread: std::thread::JoinHandle<Result<ServeReport, sim_board_server::ServeError>>,
}

impl Background {
    fn start(scenario: &Scenario, options: ServeOptions) -> anyhow::Result<(Background, Address)> {
        let (mut terminal, _) = PseudoTerminal::open().context("a pseudo-terminal could not be opened")?;
        let address = terminal.address();
        let stop = Arc::new(AtomicBool::new(false));
        let (scenario, flag) = (scenario.clone(), stop.clone());
        let thread = std::thread::Builder::new()
            .name("clutch-board".to_owned())
            .spawn(move || sim_board_server::serve(&scenario, &options, &mut terminal, &flag, |_| ()))
            .context("the simulated board could not be started")?;
        Ok((Background { stop, thread }, address))
    }

    fn end(self) -> anyhow::Result<ServeReport> {
        self.stop.store(true, Ordering::Relaxed);
        match self.thread.join() {
            Ok(report) => Ok(report?),
            Err(_) => bail!("the simulated board failed; please report this as a defect"),
        }
    }
}

impl Loop {
    pub(crate) fn run(mut self) -> anyhow::Result<Exit> {
        if let Some(duration) = self.duration {
            self.set.push(("run.duration_s".to_owned(), format!("{duration:?}")));
        }
        if let Some(rate) = self.update_rate {
            let period = 1e6 / rate;
            if !(period.is_finite()
                && (1.0..=1e6).contains(&period)
                && (period - period.round()).abs() < 1e-6)
            {
                bail!(
                    "--update-rate {rate}: expected a rate whose period is a whole number of µs, 1 to 1 000 000 Hz"
                );
            }
            self.set.push(("sampling.period_us".to_owned(), format!("{}", period.round())));
        }
        if matches!(self.overruns, OverrunsArg::Fault) {
            self.set.push(("safety.limits.overruns".to_owned(), "1".to_owned()));
        }
        let args = ScenarioArgs { scenario: self.scenario.clone(), set: self.set.clone() };
        let mut scenario = args.load()?;
        if self.board.is_some() {
            scenario = crate::single_precision(&args, scenario)?;
        }
        if let Some(log) = &self.log
            && log.canonicalize().is_ok_and(|l| self.scenario.canonicalize().is_ok_and(|s| s == l))
        {
            bail!("{}: is the scenario; name another file for the log", log.display());
        }
        match scenario.scalar {
            ScalarKind::F32 => self.run_in::<f32>(&scenario),
            ScalarKind::F64 => self.run_in::<f64>(&scenario),
        }
    }

    fn say(&self, text: &str) -> anyhow::Result<()> {
        // With --json standard output is for the summary.
        if self.json {
            let _ = std::io::stderr().write_all(text.as_bytes());
            return Ok(());
        }
        print(text)
    }

    fn run_in<T: Real>(&self, scenario: &Scenario) -> anyhow::Result<Exit> {
        let safety = scenario.safety()?;
        let plan = scenario.plan()?;
        let certified = plan.certificate.certified();
        if !certified && !self.uncertified {
            self.say(&crate::not_certified(scenario, &self.scenario))?;
            return Ok(Exit::NotCertified);
        }
        if let Some(log) = &self.log {
            crate::new_log(log)?;
        }
        let stop = stop_flag()?;
        // A log on a limited disk must end the log and not the loop.
        let ignored = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register(signal_hook::consts::SIGXFSZ, ignored)
            .context("signals could not be caught")?;

        // The board.
        let (background, address) = match self.port.as_ref().or(self.board.as_ref()) {
            Some(address) => (None, address.clone()),
            None => {
                let options = ServeOptions {
                    faults: self.fault.clone(),
                    seed: self.fault_seed,
                    patient: !self.strict && !self.fault.iter().any(|f| f.kind.silences()),
                    wait: WaitMode::Sleep,
                };
                let (board, address) = Background::start(scenario, options)?;
                (Some(board), address)
            }
        };
        let run =
            Run { verb: self, scenario, address: &address, certified, safety, plan: &plan, stop: &stop };
        let outcome = match &self.board {
            None => run.on_board::<T>(),
            Some(_) => run.on_controller(),
        };
        let board = background.map(Background::end).transpose();
        let (report, log_line) = outcome?;
        let board = board?;
        let stopped = stop.load(Ordering::Relaxed);
        let text = if self.json {
            crate::json(&as_json(scenario, &report, certified, board.as_ref(), stopped))?
        } else {
            summary(scenario, &report, &log_line, board.as_ref(), (stopped, self.fault.len()))
        };
        print(&text)?;
        Ok(if report.state == State::Faulted || report.port_error.is_some() {
            Exit::Fault
        } else if stopped {
            Exit::Stopped
        } else if !report.begun {
            Exit::Failed
        } else if report.cause == Cause::Operator {
            Exit::Fault // it was not stopped from here: the board has missed this machine
        } else {
            Exit::Done
        })
    }
}

/// A run that has been checked, and its destination.
struct Run<'a> {
    verb: &'a Loop,
    scenario: &'a Scenario,
    address: &'a Address,
    certified: bool,
    safety: &'a clutch_sim::scenario::Safety,
    plan: &'a clutch_sim::scenario::Plan,
    stop: &'a Arc<AtomicBool>,
}

impl Run<'_> {
    /// Opens the port, whose line carries frames of these lengths each cycle.
    fn open(&self, frames: (usize, usize)) -> anyhow::Result<(Port, Vec<String>)> {
        let options = SerialOptions { baud: self.verb.baud, low_latency: true };
        let opened = Port::open(self.address, &options)?;
        let (port, mut notes) = (opened.port, opened.notes);
        let period = Duration::from_micros(u64::from(self.scenario.spec().period.0));
        if port.kind().has_line_rate() {
            notes.extend(port.check_baud(frames, period)?);
        }
        Ok((port, notes))
    }

    /// An error unless encoder and converter are those of the scenario.
    fn check(&self, hello: &Hello, port: &Port) -> anyhow::Result<()> {
        let mut lines = from_scenario::misfits(self.scenario, hello);
        let simulated = hello.board == PATIENT_BOARD || hello.board == STRICT_BOARD;
        let real = !matches!(port.kind(), DeviceKind::PseudoTerminal | DeviceKind::Tcp);
        if simulated && real && self.verb.board.is_none() {
            lines.push(format!(
                "board: its serial number {} is kept for simulated boards; give it another",
                hello.board
            ));
        }
        if lines.is_empty() {
            return Ok(());
        }
        let address = self.address.to_string();
        Err(clutch_loop::preflight::PreflightError::Misfit { address, lines }.into())
    }

    /// A new run on a board with this clock: its patience when the clock waits.
    fn built<T: Real>(&self, hello: &Hello) -> anyhow::Result<BuiltRun<T>> {
        let mut built = BuiltRun::<T>::new(self.scenario, hello.run.wrapping_add(1).max(1))?;
        if hello.board == PATIENT_BOARD {
            // Its clock waits when this machine stalls, and so does our patience.
            built.controller.silence = Micros(5_500_000);
        }
        Ok(built)
    }

    /// Closes the loop here.
    fn on_board<T: Real>(&self) -> anyhow::Result<(LoopReport, String)> {
        // A sample and its answer, each cycle.
        let (mut port, notes) = self.open((15, 20))?;
        // Ask for the board's identity.
        let mut end = local(&BuiltRun::<T>::new(self.scenario, 0)?, from_scenario::path(self.scenario)?);
        let hello = Talk::new(&mut port, &mut end).discover(Duration::from_secs(2))?;
        self.check(&hello, &port)?;
        let built = self.built::<T>(&hello)?;
        let mut end = local(&built, from_scenario::path(self.scenario)?);
        self.tell(&hello, &port, &notes)?;
        let hold = built.supervisor.safe_codes().hold;
        let (log, ring, watch) = self.log(&built, present_code(&hello, hold), &board_text(&hello))?;
        // The start of this command was the consent.
        let mut talk = Talk::new(&mut port, &mut end);
        talk.configure(present_code(&hello, hold))?;
        let clock = talk.clock()?;
        let (end, port) = (&mut end, &mut port);
        let (ticks, detector, patient) = (built.ticks, built.detector, hello.board == PATIENT_BOARD);
        let configured =
            ConfiguredRun { station: end, port, ring, watch: &watch, patient, ticks, clock, detector };
        self.drive(configured, log)
    }

    /// Closes the loop on the board.
    fn on_controller(&self) -> anyhow::Result<(LoopReport, String)> {
        // Telemetry each cycle; now and then a frame to the board.
        let (mut port, notes) = self.open((0, clutch_wire::Telemetry::LENGTH + 2))?;
        let remote = |built: &BuiltRun<f32>, patient: bool| -> anyhow::Result<_> {
            let configure =
                ControllerNode::new(built.controller, built.servo, built.supervisor).configuration();
            let silence = if patient { 5_500_000_000 } else { BOARD_SILENCE_NS };
            let node = HostNode::new(built.servo, configure, ALIVE_NS, silence);
            Ok(HostStation { node, path: from_scenario::path::<f32>(self.scenario)? })
        };
        let mut end = remote(&BuiltRun::<f32>::new(self.scenario, 0)?, false)?;
        let hello = Talk::new(&mut port, &mut end).discover(Duration::from_secs(2))?;
        let clock_hz = end.node.controller().map_or(0, |c| c.clock_hz);
        let text = end.node.controller().map_or_else(String::new, controller_text);
        self.check(&hello, &port)?;
        let built = self.built::<f32>(&hello)?;
        let patient = hello.board == PATIENT_BOARD;
        let host_silence = if patient { built.controller.silence } else { HOST_SILENCE };
        let settings = from_scenario::settings(self.scenario, &built, host_silence, built.ticks)?;
        let mut end = remote(&built, patient)?;
        self.tell(&hello, &port, &notes)?;
        self.verb.say(&format!("the loop is closed on the board: {text}\n"))?;
        let hold = built.supervisor.safe_codes().hold;
        let (log, ring, watch) = self.log(&built, present_code(&hello, hold), &text)?;
        let mut talk = Talk::new(&mut port, &mut end);
        talk.upload(&settings)?;
        talk.configure(hold)?;
        let clock = talk.clock()?;
        let (end, port, detector) = (&mut end, &mut port, built.detector);
        let ticks = built.ticks;
        let configured =
            ConfiguredRun { station: end, port, ring, watch: &watch, patient, ticks, clock, detector };
        let (mut report, line) = self.drive(configured, log)?;
        report.clock_hz = clock_hz;
        Ok((report, line))
    }

    /// Prints the plan.
    fn tell(&self, hello: &Hello, port: &Port, notes: &[String]) -> anyhow::Result<()> {
        self.verb.say(&self.plan_text(hello, port.kind()))?;
        for note in notes {
            self.verb.say(&format!("note: {note}\n"))?;
        }
        Ok(())
    }

    /// Opens the log before the board is armed: an error of the log appears before anything moves.
    fn log<T: Real>(
        &self,
        built: &BuiltRun<T>,
        present: DacCode,
        board: &str,
    ) -> anyhow::Result<(Option<LogThread>, Option<Ring>, Arc<Watch>)> {
        let watch = Arc::new(Watch { stop: self.stop.clone(), ..Watch::default() });
        let Some(path) = &self.verb.log else { return Ok((None, None, watch)) };
        let address = self.address.to_string();
        let mut header =
            from_scenario::header(self.scenario, &built.servo, Source::Loop, &address, crate::BUILD);
        header.extra.push((PRESENT_CODE.to_owned(), present.0.to_string()));
        header.extra.push(("board".to_owned(), board.to_owned()));
        header.extra.push(("certified".to_owned(), self.certified.to_string()));
        let (thread, ring) = LogThread::start(path, &header, watch.clone())?;
        Ok((Some(thread), Some(ring), watch))
    }

    /// Runs it on a thread of its own, and shows its progress.
    fn drive<S: Station + Send>(
        &self,
        configured: ConfiguredRun<'_, S>,
        log: Option<LogThread>,
    ) -> anyhow::Result<(LoopReport, String)> {
        let (verb, watch, ticks) = (self.verb, configured.watch, configured.ticks);
        let spec = self.scenario.spec();
        let spin_us = verb.spin_us;
        let options = LoopOptions {
            realtime: RealtimeOptions {
                thread_priority: verb.thread_priority,
                lock_memory: verb.lock_memory,
                cpu_affinity: verb.cpu_affinity,
                wait: match verb.wait {
                    WaitArg::Sleep => WaitMode::Sleep,
                    WaitArg::Spin => WaitMode::SleepSpin { spin_us },
                },
            },
            pace: match verb.pace {
                PaceArg::Sample => Pace::Sample,
                PaceArg::Clock => Pace::Clock,
            },
            settle: spec.run.settle,
            hooks: (|| (), || ()),
        };
        let show = std::io::stderr().is_terminal();
        let report = std::thread::scope(|scope| {
            let control = std::thread::Builder::new()
                .name("clutch-control".to_owned())
                .spawn_scoped(scope, move || control_loop::run(configured, &options));
            let control = control.context("the control thread could not be started")?;
            let mut refused_told = false;
            while !control.is_finished() {
                if show {
                    status(watch, spec.period.0, ticks);
                }
                if watch.log_ended.load(Ordering::Relaxed) && !refused_told {
                    refused_told = true;
                    let _ = writeln!(std::io::stderr(), "\nthe log has ended early; the loop continues");
                }
                std::thread::sleep(Duration::from_millis(50));
            }
            if show {
                let _ = write!(std::io::stderr(), "\r\x1b[K");
            }
            control.join().map_err(|_| anyhow::anyhow!("the control thread failed; the board's watchdog has put the brake into the safe state. Please report this as a defect"))
        })?;
        let mut line = match log.map(LogThread::finish) {
            None => String::new(),
            Some(Ok(summary)) => {
                let path = verb.log.as_ref().map(|p| p.display().to_string()).unwrap_or_default();
                format!("log: {path}, {} records; clutch replay {path}\n", summary.records)
            }
            Some(Err(error)) => format!("log: {error}\n"),
        };
        for note in &report.notes {
            line += &format!("note: {note}\n");
        }
        Ok((report, line))
    }

    fn plan_text(&self, hello: &Hello, kind: DeviceKind) -> String {
        let Run { scenario, address, certified, safety, plan, .. } = *self;
        let spec = scenario.spec();
        let board = board_text(hello);
        let safe = match safety.supervisor.on_fault {
            SafeState::Hold { volts } => format!("hold with {} V", number(volts)),
            SafeState::Ramp { volts_per_s, volts } => {
                format!("ramp by {} V/s to {} V, and hold", number(volts_per_s), number(volts))
            }
            SafeState::Release => "release".to_owned(),
            SafeState::HoldThenRelease { volts, after } => {
                format!("hold with {} V for {} s, then release", number(volts), number(after))
            }
        };
        let (boot, holds) = from_scenario::boot_output(scenario, hello, plan);
        let system = describe_system();
        let mut text = format!("{}\n", scenario.name);
        let mut row = |name: &str, value: String| text += &format!("  {name:<12}{value}\n");
        row("port", format!("{address}, {}", kind.describe()));
        row(
            "board",
            format!(
                "{board}; {} counts/rev, {} bit, powers up at {} V",
                hello.counts_per_rev,
                hello.dac_bits,
                number(boot)
            ),
        );
        row("loop", format!("{} µs, answers due within {} µs", spec.period.0, safety.supervisor.deadline.0));
        row(
            "path",
            format!(
                "{} s, up to {} °/s",
                number(spec.run.duration),
                number(plan.envelope.velocity.to_degrees())
            ),
        );
        row(
            "gains",
            if certified {
                "certified for the bounds given".into()
            } else {
                "NOT certified; run anyway, as requested".into()
            },
        );
        row("safe state", format!("{safe}: {}", safety.reason));
        row("watchdog", format!("{} cycles on the board", safety.watchdog_cycles));
        if let Some(first) = system.first() {
            row("system", first.clone());
        }
        if !holds {
            text += "note: the board powers up at a voltage that does not hold the shaft; set its power-up output to the safe state's\n";
        }
        if hello.board != PATIENT_BOARD && hello.board != STRICT_BOARD {
            text += "note: a brake that a motor presses lets go when its power fails; software cannot change that\n";
        }
        text
    }
}

fn local<T: Real, P>(built: &BuiltRun<T>, path: P) -> ControllerStation<T, Law<T>, P> {
    ControllerStation { node: ControllerNode::new(built.controller, built.servo, built.supervisor), path }
}

fn controller_text(c: &clutch_wire::ControllerHello) -> String {
    let name =
        if c.board <= STRICT_BOARD { "emulated".to_owned() } else { format!("number {:08x}", c.board) };
    let clock =
        if c.clock_hz > 0 { format!(", {} MHz", number(f64::from(c.clock_hz) / 1e6)) } else { String::new() };
    format!("{name}{clock}")
}

fn board_text(hello: &Hello) -> String {
    match hello.board {
        PATIENT_BOARD => "simulated; its clock waits when this machine stalls".to_owned(),
        STRICT_BOARD => "simulated, in real time".to_owned(),
        serial => format!("number {serial:08x}"),
    }
}

fn status(watch: &Watch, period_us: u32, ticks: u64) {
    let time = |n: u64| n as f64 * f64::from(period_us) / 1e6;
    let load = |a: &std::sync::atomic::AtomicI64| a.load(Ordering::Relaxed) as f64;
    let line = format!(
        "\r\x1b[K{:7.2} of {:.2} s   error {:+8.4}°   {:6.3} V   lost {}   late {}",
        time(watch.tick.load(Ordering::Relaxed)),
        time(ticks),
        (load(&watch.error_nrad) * 1e-9).to_degrees(),
        load(&watch.millivolts) / 1e3,
        watch.lost.load(Ordering::Relaxed),
        watch.late_answers.load(Ordering::Relaxed),
    );
    let _ = std::io::stderr().write_all(line.as_bytes()); // a terminal that has gone away
}

/// The cause of the end of control, in words; `v` is the value that the check saw, `stopped` is
/// true if it was stopped from here.
pub(crate) fn cause_text(cause: Cause, v: f64, on_the_board: bool, stopped: bool) -> String {
    match cause {
        Cause::Done => "the path is done".into(),
        Cause::Operator if on_the_board && !stopped => {
            "the board has not heard this machine for too long, and has ended the run".into()
        }
        Cause::Operator => "stopped by the operator".into(),
        Cause::Lost => format!("{v} samples lost within 128 cycles"),
        Cause::Late => "too many samples or answers came late".into(),
        Cause::Duplicated => format!("{v} samples came twice within 128 cycles"),
        Cause::Reordered => format!("{v} samples came out of order within 128 cycles"),
        Cause::Jump => format!("the encoder jumped, by {v} counts at last"),
        Cause::StandStill => format!(
            "the encoder shows no movement, though the shaft must have gone {} °: encoder frozen, or shaft blocked",
            number(v.to_degrees())
        ),
        Cause::FollowingError => format!("following error of {} °", number(v.to_degrees())),
        Cause::Saturation => "the brake's voltage was at its limit for too long".into(),
        Cause::NotFinite => "the law's demand was not a number".into(),
        Cause::Deadline => format!("answers came too late, the last after {v} µs"),
        // The board's own supervisor reports the number of periods.
        Cause::Silence if on_the_board && v > 0.0 => "the board's encoder and converter fell silent".into(),
        Cause::Silence => "the board fell silent".into(),
        Cause::Board => match v as u8 {
            1 => "the board's watchdog went off: it got no valid answer in time".into(),
            2 => "the board sees no encoder".into(),
            3 => "the board's converter does not follow".into(),
            _ => "the board went to its safe state by itself".into(),
        },
        Cause::Target => {
            "the path's target is not a number, or moves faster than rig.speed_limit_deg_s".into()
        }
        Cause::None => "control did not begin".into(),
    }
}

fn summary(
    scenario: &Scenario,
    r: &LoopReport,
    log_line: &str,
    board: Option<&ServeReport>,
    (stopped, faults): (bool, usize),
) -> String {
    let m = &r.metrics;
    let deg = |x: f64| number(x.to_degrees());
    let us = |ns: u64| number(ns as f64 / 1e3);
    let latency = |s: &CycleSummary| {
        format!("{} / {} / {} / {}", us(s.p50_ns), us(s.p99_ns), us(s.p99_9_ns), us(s.max_ns))
    };
    let title = format!(
        "{}\n{} ticks; figures over {} s after settling, from the encoder",
        scenario.name,
        r.ticks,
        number(m.measured_s)
    );
    let mut text = quantities(
        &title,
        &[
            ("max |error|", deg(m.max_error_rad), "°"),
            ("RMS error", deg(m.rms_error_rad), "°"),
            ("mean error (target − position)", deg(m.mean_error_rad), "°"),
            ("stick-slip seen by the encoder", number(m.stick_slip_cycles_per_s), "cycles/s"),
            ("voltage variation", number(m.control_variation_v_s), "V/s"),
            ("samples received", r.link.received.to_string(), ""),
            ("samples lost", r.lost.to_string(), ""),
            (
                "samples late / twice / out of order",
                format!("{} / {} / {}", r.link.late, r.link.duplicated, r.link.reordered),
                "",
            ),
            ("frames with errors", r.link.bad_frames.to_string(), ""),
            ("samples not believed", r.implausible.to_string(), ""),
            ("deadline misses", r.deadline_misses.to_string(), ""),
            ("answer after p50 / p99 / p99.9 / max", latency(&r.response), "µs"),
            ("cycle time p50 / p99 / p99.9 / max", latency(&r.interval), "µs"),
        ],
    );
    if r.clock_hz > 0 {
        let us = |cycles: u64| number(cycles as f64 * 1e6 / f64::from(r.clock_hz));
        let c = &r.tick_cycles;
        text += &format!(
            "a tick on the board p50 / p99.9 / max: {} / {} / {} clock cycles, {} / {} / {} µs\n",
            c.p50_ns,
            c.p99_9_ns,
            c.max_ns,
            us(c.p50_ns),
            us(c.p99_9_ns),
            us(c.max_ns)
        );
    }
    if r.untold > 0 {
        text += &format!(
            "{} cycles of the board did not reach this machine; they are missing in the log\n",
            r.untold
        );
    }
    if r.log_dropped > 0 {
        text += &format!("the log dropped {} records: its thread did not keep up\n", r.log_dropped);
    }
    if r.cut_writes > 0 {
        text += &format!("the line took {} frames only in part: its buffer was full\n", r.cut_writes);
    }
    if let Some(board) = board
        && board.waits > 0
    {
        text += &format!(
            "the simulated board's clock waited {} times for the loop, {:.3} s in all: this machine stalled\n",
            board.waits, board.waited
        );
    }
    if board.is_some_and(|b| b.hits == 0) && faults > 0 {
        text += "the requested fault had not begun\n";
    }
    text += log_line;
    if let Some(error) = &r.port_error {
        text += &format!("{error}\n");
    }
    let safe = match (r.state, r.board_safe) {
        (State::Released, true) => "the brake is released",
        (_, true) => "the board is in its safe state",
        (_, false) if r.on_the_board => {
            "the board did not confirm its safe state; it goes there by itself when it misses this machine"
        }
        (_, false) => "the board did not confirm its safe state; its watchdog takes it there",
    };
    if !r.begun && r.state != State::Faulted {
        if r.cause == Cause::None && stopped {
            return text + "stopped before the board was armed; its output is as it was\n";
        }
        if stopped {
            return text + &format!("stopped before the board said that it was armed; {safe}\n");
        }
        return text
            + &match &r.refused {
                Some(m) => format!("the board was not armed: {}\n", clutch_loop::preflight::why(m)),
                None => format!("the board did not say that it was armed; {safe}\n"),
            };
    }
    let missed = r.cause == Cause::Operator && !stopped;
    let fault = if r.state == State::Faulted || missed { "FAULT: " } else { "" };
    text += &format!("{fault}{}; {safe}\n", cause_text(r.cause, r.value, r.on_the_board, stopped));
    text
}

fn as_json(
    scenario: &Scenario,
    r: &LoopReport,
    certified: bool,
    board: Option<&ServeReport>,
    stopped: bool,
) -> serde_json::Value {
    let latency = |s: &CycleSummary| {
        serde_json::json!({
            "p50_us": s.p50_ns as f64 / 1e3, "p99_us": s.p99_ns as f64 / 1e3,
            "p99_9_us": s.p99_9_ns as f64 / 1e3, "max_us": s.max_ns as f64 / 1e3, "count": s.count,
        })
    };
    serde_json::json!({
        "scenario": scenario.name,
        "version": env!("CARGO_PKG_VERSION"),
        "state": format!("{:?}", r.state),
        "cause": format!("{:?}", r.cause),
        "cause_text": cause_text(r.cause, r.value, r.on_the_board, stopped),
        "value": r.value,
        "certified": certified,
        "ticks": r.ticks,
        "metrics": r.metrics,
        "samples": {
            "received": r.link.received, "lost": r.lost, "late": r.link.late, "duplicated": r.link.duplicated,
            "reordered": r.link.reordered, "implausible": r.implausible,
        },
        "bad_frames": r.link.bad_frames,
        "deadline_misses": r.deadline_misses,
        "response": latency(&r.response),
        "cycle": latency(&r.interval),
        "tick_clock_cycles": (r.clock_hz > 0).then(|| serde_json::json!({
            "clock_hz": r.clock_hz, "p50": r.tick_cycles.p50_ns, "p99_9": r.tick_cycles.p99_9_ns,
            "max": r.tick_cycles.max_ns,
        })),
        "untold": r.untold,
        "log_dropped": r.log_dropped,
        "cut_writes": r.cut_writes,
        "board_safe": r.board_safe,
        "board_waits": board.map(|b| b.waits),
        "port_error": r.port_error,
        "notes": r.notes,
    })
}
