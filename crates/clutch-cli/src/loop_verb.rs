//! `clutch loop`.

use crate::args::{ScenarioArgs, key_value};
use crate::live::LiveArg;
use crate::output::{
    BUILD, Exit, beside, coloured, folded, json, not_certified, paragraph, quiet, report, shown, to_write,
    warn,
};
use crate::signals::stop_flag;
use crate::table::{number, quantities, row};
use anyhow::bail;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use clutch_core::params::Word;
use clutch_loop::clearance::ClearanceError;
use clutch_loop::control_loop::{OnDrift, Pace};
use clutch_loop::faults::Fault;
use clutch_loop::onlooker::Onlooker;
use clutch_loop::port::Address;
use clutch_loop::realtime::{
    CycleSummary, DEFAULT_PRIORITY, HIGHEST_PRIORITY, RealtimeOptions, SPIN_US, Wait,
};
use clutch_loop::release;
use clutch_loop::session::{
    Announcement, Board, Event, Progress, Release, Session, SessionError, SessionOptions,
};
use clutch_loop::summary::{Summary, Verdict};
use clutch_sim::Metrics;
use clutch_sim::metrics::Detected;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A parser of one of some words, whose meanings are in the help.
fn word<T: Clone + Send + Sync + 'static>(
    words: &'static [Word],
    named: fn(&str) -> Option<T>,
) -> impl TypedValueParser<Value = T> {
    let shown = words.iter().map(|word| PossibleValue::new(word.name).help(word.doc.trim()));
    PossibleValuesParser::new(shown).try_map(move |text| named(&text).ok_or("none of the words"))
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum OverrunsArg {
    /// Late answers are counted; many within a short time end control.
    Manage,
    /// The first late answer ends control.
    Fault,
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
    Exit codes: 0 the path is done; 1 an error; 2 not certified; 3 a fault ended the run, and the output is in the \
    safe state; 4 stopped by Ctrl-C or SIGTERM, or by --on-drift stop, likewise. docs/loop.md is the guide, docs/safety.md lists the checks."
)]
pub(crate) struct Loop {
    /// Scenario file, or the name of a built-in scenario; board_smc_2 if none is given.
    #[arg(value_name = "SCENARIO.toml", default_value = "board_smc_2")]
    scenario: PathBuf,
    /// Overrides a key of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// Takes the model and its bounds from a file that `clutch identify --out` has written.
    #[arg(long, value_name = "FILE.toml")]
    identified: Option<PathBuf>,
    /// Takes friction along the disc from a file that `clutch identify --map` has written.
    #[arg(long, value_name = "FILE.toml")]
    map: Option<PathBuf>,
    /// The board's port; without it a board is simulated.
    #[arg(long, value_name = "PATH|tcp://HOST:PORT|unix:///PATH")]
    port: Option<Address>,
    /// The port of a board that closes the loop itself (docs/firmware.md): it is set up, armed, and
    /// watched.
    #[arg(long, value_name = "PATH|tcp://HOST:PORT|unix:///PATH", conflicts_with_all = ["port", "fault", "strict"])]
    board: Option<Address>,
    /// The board at the port is a simulated one whose clock waits when this machine stalls (`clutch daq --patient`): so
    /// does the loop, before it calls the board silent.
    #[arg(long, conflicts_with_all = ["fault", "strict"])]
    patient: bool,
    /// Line rate of the port, baud; no effect on USB, pseudo-terminals and TCP.
    #[arg(long)]
    baud: Option<u32>,
    /// Writes an MCAP log.
    #[arg(long, value_parser = to_write(), value_name = "FILE.mcap")]
    log: Option<PathBuf>,
    /// Length of the run instead of run.duration_s, s.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Runs a law that is not certified for the scenario's bounds.
    #[arg(long)]
    uncertified: bool,
    /// Certificate of the sampled loop, as `clutch certify --sampled --save` writes it: it is checked, and that it is this
    /// scenario's, before anything starts.
    #[arg(long, value_name = "FILE.json")]
    certificate: Option<PathBuf>,
    /// Release test before the run: the brake lets go for some milliseconds and grips again; the way shows wrong signs and
    /// scales of encoder and converter.
    #[arg(long, value_name = "WHEN", default_value = Release::default().name(),
        value_parser = word(Release::WORDS, Release::named))]
    release_test: Release,
    /// The longest way in that test of any shaft within the bounds, °, up to 10: a longer one finds more.
    #[arg(long, value_name = "DEG", default_value_t = release::WAY_DEG, allow_negative_numbers = true)]
    release_deg: f64,
    /// Cycles per second instead of sampling.period_us, Hz.
    #[arg(long, alias = "update_rate", value_name = "HZ", allow_negative_numbers = true)]
    update_rate: Option<f64>,
    /// Keeps all memory in RAM.
    #[arg(long, alias = "lock_memory", value_name = "BOOL", default_value_t = true, action = clap::ArgAction::Set)]
    lock_memory: bool,
    /// Keeps the control thread on this core.
    #[arg(long, alias = "cpu_affinity", value_name = "CORE")]
    cpu_affinity: Option<usize>,
    /// Priority of the control thread under SCHED_FIFO, 1 to 99; 0 stays with the ordinary scheduler.
    #[arg(long, alias = "thread_priority", default_value_t = DEFAULT_PRIORITY,
        value_parser = clap::value_parser!(u8).range(0..=i64::from(HIGHEST_PRIORITY)))]
    thread_priority: u8,
    /// Effect of a late answer.
    #[arg(long, value_enum, default_value = "manage")]
    overruns: OverrunsArg,
    /// Effect of friction over load that leaves the bounds, by what counts and voltages show.
    #[arg(long, default_value = OnDrift::default().name(), value_parser = word(OnDrift::WORDS, OnDrift::named))]
    on_drift: OnDrift,
    /// Start of a cycle.
    #[arg(long, default_value = Pace::default().name(), value_parser = word(Pace::WORDS, Pace::named))]
    pace: Pace,
    /// Wait mode of the loop.
    #[arg(long, default_value = Wait::default().name(), value_parser = word(Wait::WORDS, Wait::named))]
    wait: Wait,
    /// Time before a sample at which spinning begins, with --wait spin, µs.
    #[arg(long, default_value_t = SPIN_US, value_name = "US")]
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
    #[command(flatten)]
    live: LiveArg,
    /// Prints the summary as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

impl Loop {
    pub(crate) fn run(mut self) -> anyhow::Result<Exit> {
        self.live.check()?;
        self.set_shortcuts()?;
        let (scenario, set) = (self.scenario.clone(), self.set.clone());
        let (identified, map) = (self.identified.clone(), self.map.clone());
        let args = ScenarioArgs { scenario, set, identified, map };
        let scenario = args.load()?;
        args.remark_unused_map(&scenario);
        args.hold_times(&scenario, !self.uncertified)?;
        if let Some(log) = &self.log
            && log.canonicalize().is_ok_and(|l| self.scenario.canonicalize().is_ok_and(|s| s == l))
        {
            bail!("{}: is the scenario; name another file for the log", log.display());
        }
        let session = match Session::new(scenario, self.options()) {
            Ok(session) => session,
            Err(SessionError::Clearance(refusal @ ClearanceError::NotCertified { .. })) => {
                self.say(&not_certified(&refusal, &self.scenario))?;
                return Ok(Exit::NotCertified);
            }
            Err(refusal) => return Err(refusal.into()),
        };
        let stop = stop_flag()?;
        let live = self.live.start(&stop)?;
        let session = session.looked_at(live.map(|live| live as Arc<dyn Onlooker>));
        let scope = self.live.has_terminal();
        let show = std::io::stderr().is_terminal() && !quiet() && !scope;
        // Events that come while a scope has the terminal are printed after it.
        let mut later = Vec::new();
        let mut tell = |text: &str| {
            if scope {
                later.push(text.to_owned());
                return;
            }
            let clear = if show { "\r\x1b[K" } else { "" };
            tell_aside(clear, text);
        };
        let mut said = Ok(());
        let ran = session.run(&stop, &mut |event| match event {
            // A run that cannot be announced does not begin: nothing has moved yet.
            Event::Announced(announcement) => {
                said = if quiet() { Ok(()) } else { self.say(&plan(&announcement)) };
                stop.fetch_or(said.is_err(), Ordering::Relaxed);
            }
            Event::Progress(progress) if show => status(&progress),
            Event::Progress(_) => {}
            // A terminal that has gone away does not stop a loop.
            Event::LogEnded => tell("the log has ended early; the loop continues"),
            Event::Drift(text) => tell(&text),
        });
        // The views have seen the end of it; the terminal is free.
        drop(session);
        for text in later {
            tell_aside("", &text);
        }
        if show {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
        let ran = match ran {
            Ok(ran) => ran,
            Err(ended @ SessionError::Released { .. }) => {
                said?;
                self.say(&folded(&ended.to_string()))?;
                return Ok(Exit::Fault);
            }
            Err(obstacle) => return Err(obstacle.into()),
        };
        said?;
        report(self.json, || json(&ran.to_json()), || summary(&ran))?;
        Ok(match ran.verdict() {
            Verdict::Done if ran.log.as_ref().is_some_and(|log| log.records.is_err()) => Exit::Incomplete,
            Verdict::Done => Exit::Done,
            Verdict::Stopped => Exit::Stopped,
            Verdict::Fault => Exit::Fault,
            Verdict::NotArmed => Exit::Failed,
        })
    }

    /// Options that stand for keys of the scenario.
    fn set_shortcuts(&mut self) -> anyhow::Result<()> {
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
        Ok(())
    }

    fn options(&self) -> SessionOptions {
        SessionOptions {
            board: match (&self.port, &self.board) {
                (Some(port), _) => Board::Daq(port.clone()),
                (None, Some(port)) => Board::Controller(port.clone()),
                (None, None) => Board::Simulated {
                    faults: self.fault.clone(),
                    seed: self.fault_seed,
                    strict: self.strict,
                },
            },
            patient: self.patient,
            baud: self.baud,
            log: self.log.clone(),
            uncertified: self.uncertified,
            certificate: self.certificate.clone(),
            release: self.release_test,
            release_way: self.release_deg.to_radians(),
            realtime: RealtimeOptions {
                thread_priority: self.thread_priority,
                lock_memory: self.lock_memory,
                cpu_affinity: self.cpu_affinity,
                wait: self.wait.mode(self.spin_us),
            },
            pace: self.pace,
            on_drift: self.on_drift,
            version: BUILD.to_owned(),
        }
    }

    fn say(&self, text: &str) -> anyhow::Result<()> {
        // With --json standard output is for the summary.
        if self.json {
            let _ = std::io::stderr().write_all(shown(text).as_bytes());
            return Ok(());
        }
        warn(text)
    }
}

/// Prints what has happened, on standard error, after `clear`, with verdicts in colour on a terminal.
fn tell_aside(clear: &str, text: &str) {
    // The text that clears a line is no colour: it stays where colours are left out.
    let _ = std::io::stderr().write_all(clear.as_bytes());
    let _ = anstream::stderr().write_all(coloured(&shown(&paragraph(text))).as_bytes()); // a terminal that has gone away
}

fn status(p: &Progress) {
    let line = format!(
        "\r\x1b[K{:7.2} of {:.2} s   error {:+8.4}°   {:6.3} V   lost {}   late {}",
        p.time,
        p.duration,
        p.error.to_degrees(),
        p.volts,
        p.lost,
        p.late_answers,
    );
    let _ = std::io::stderr().write_all(line.as_bytes()); // a terminal that has gone away
}

/// The summary of a session, as the command prints it.
#[must_use]
pub fn summary(s: &Summary) -> String {
    let r = &s.report;
    let (m, d) = (&r.metrics, &r.detected);
    let latency = |s: &CycleSummary| times(&[s.p50_ns, s.p99_ns, s.p99_9_ns, s.max_ns].map(us));
    // A board whose clock waits for this machine says nothing of it.
    let measured = r.wake.count > 0;
    let late = if measured { latency(&r.wake) } else { "not measured".to_owned() };
    let settled = m.measured_s > 0.0;
    let over = if settled {
        format!("figures over {} s after settling, from the encoder", number(m.measured_s))
    } else {
        "no figures: the run ended before run.settle_s".to_owned()
    };
    let figures = [
        row(&Metrics::MAX_ERROR, m),
        row(&Metrics::RMS_ERROR, m),
        row(&Metrics::MEAN_ERROR, m),
        row(&Detected::STICK_SLIP, d),
        (Detected::TOLD.label, d.words(), Detected::TOLD.shown_unit),
        row(&Detected::STICK_TIME, d),
        row(&Detected::STAIRS, d),
        row(&Metrics::VARIATION, m),
    ];
    let mut text = quantities(
        &format!("{}\n{} ticks; {over}", s.scenario, r.ticks),
        &[
            if settled { &figures[..] } else { &[] },
            &[
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
                ("wake-up late by p50 / p99 / p99.9 / max", late, if measured { "µs" } else { "" }),
            ],
        ]
        .concat(),
    );
    if let Some(reason) = d.reason().filter(|_| settled) {
        text += &paragraph(&format!("stick-slip: {reason}"));
    }
    text.extend(s.remarks().iter().map(|line| paragraph(line)));
    text
}

/// Times beside each other, narrow enough for the table to keep within 80 columns where each of them is of seconds.
fn times(each: &[String]) -> String {
    let wide = each.join(" / ");
    if wide.len() <= 34 { wide } else { each.join("/") }
}

/// A time as µs, to three digits.
fn us(ns: u64) -> String {
    let us = ns as f64 / 1e3;
    let digits = if us < 10.0 { 2 } else { usize::from(us < 100.0) };
    format!("{us:.digits$}")
}

/// Plan of a loop, printed before anything moves, in lines of a terminal.
#[must_use]
pub fn plan(a: &Announcement) -> String {
    let rows = a.rows.iter().map(|(name, value)| beside(&format!("  {name:<11}"), value));
    let remarks = a.remarks.iter().map(|line| paragraph(line));
    std::iter::once(paragraph(&a.title)).chain(rows).chain(remarks).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_seconds_keep_the_table_within_80_columns() {
        let late = quantities(
            "t",
            &[(
                "wake-up late by p50 / p99 / p99.9 / max",
                times(&[1_000_000_000, 1_001_000_000, 9_999_999_000, 99_999_999_000].map(us)),
                "µs",
            )],
        );
        assert!(late.lines().all(|line| line.chars().count() <= 80), "{late}");
        assert_eq!(times(&[1000, 2000].map(us)), "1.00 / 2.00");
    }
}
