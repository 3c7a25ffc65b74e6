//! The summary of a session: its figures, and what ended it in words.

use crate::cause_words::{cause_text, why};
use crate::clearance::Cleared;
use crate::control_loop::LoopReport;
use crate::realtime::CycleSummary;
use crate::sim_board_server::ServeReport;
use clutch_core::supervisor::{Cause, State};
use clutch_sim::number;
use clutch_sim::scenario::{CERTIFIED, STICKS};
use serde_json::{Value, json};
use std::path::PathBuf;

/// The verdict on the end of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The path is done.
    Done,
    /// Somebody here stopped it.
    Stopped,
    /// A fault ended the run, or the port was lost.
    Fault,
    /// The board did not take consent.
    NotArmed,
}

impl Verdict {
    /// As JSON and Python have it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Done => "done",
            Verdict::Stopped => "stopped",
            Verdict::Fault => "fault",
            Verdict::NotArmed => "not_armed",
        }
    }
}

/// The fate of a session's log.
#[derive(Clone, Debug)]
pub struct LogSummary {
    /// Its file.
    pub path: PathBuf,
    /// Records in it; or why it ended early.
    pub records: Result<u64, String>,
}

/// The results of a session.
#[derive(Clone, Debug)]
pub struct Summary {
    /// The scenario's name.
    pub scenario: String,
    /// Version and commit of the build.
    pub version: String,
    /// Verdicts on the gains.
    pub cleared: Cleared,
    /// The file of the sampled loop's certificate, if one was given.
    pub certificate: Option<PathBuf>,
    /// True if somebody here has stopped it.
    pub stopped: bool,
    /// Faults that were asked for.
    pub faults: usize,
    /// The report of the loop.
    pub report: LoopReport,
    /// The report of the simulated board, if there was one.
    pub board: Option<ServeReport>,
    /// The log, if there was to be one.
    pub log: Option<LogSummary>,
}

impl Summary {
    /// The verdict on the end of the session.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let r = &self.report;
        if r.state == State::Faulted || r.port_error.is_some() {
            Verdict::Fault
        } else if self.stopped {
            Verdict::Stopped
        } else if !r.begun {
            Verdict::NotArmed
        } else if r.cause == Cause::Operator {
            Verdict::Fault // nobody here has stopped it: the board has missed this machine
        } else {
            Verdict::Done
        }
    }

    /// The cause of the end of control, in words.
    #[must_use]
    pub fn cause_text(&self) -> String {
        if self.report.ended_by_drift && self.report.cause == Cause::Operator {
            return format!("stopped as {} left the bounds", self.report.drift.label());
        }
        cause_text(self.report.cause, self.report.value, self.report.on_the_board, self.stopped)
    }

    /// The remarks beside the figures, a line each; the last says why control ended, and whether the
    /// board is safe.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let r = &self.report;
        let mut lines = vec![
            format!("as sampled: {}", self.cleared.bound_line()),
            format!("as sampled: {}", self.cleared.sampled.stability_line()),
            format!("sticks: {STICKS}"),
        ];
        lines.push(format!("{}: {}", r.drift.label(), r.drift.words()));
        lines.extend(r.drift.alarm_line());
        if r.clock_hz > 0 {
            let us = |cycles: u64| number(cycles as f64 * 1e6 / f64::from(r.clock_hz));
            let c = &r.tick_cycles;
            lines.push(format!(
                "a tick on the board p50 / p99.9 / max: {} / {} / {} clock cycles, {} / {} / {} µs",
                c.p50_ns,
                c.p99_9_ns,
                c.max_ns,
                us(c.p50_ns),
                us(c.p99_9_ns),
                us(c.max_ns)
            ));
        }
        if r.changed > 0 {
            let times = if r.changed == 1 { "once".to_owned() } else { format!("{} times", r.changed) };
            let how = match r.changed_uncertified {
                0 => "each certified as sampled".to_owned(),
                some => format!("{some} of them UNCERTIFIED"),
            };
            lines.push(format!("gains were changed {times} while it ran, {how}; what is said above of the gains is of those at the start"));
        }
        if r.untold > 0 {
            lines.push(format!(
                "{} cycles of the board did not reach this machine; they are missing in the log",
                r.untold
            ));
        }
        if r.log_dropped > 0 {
            lines.push(format!("the log dropped {} records: its thread did not keep up", r.log_dropped));
        }
        if r.cut_writes > 0 {
            lines.push(format!("the line took {} frames only in part: its buffer was full", r.cut_writes));
        }
        if let Some(board) = self.board.filter(|b| b.waits > 0) {
            let times = if board.waits == 1 { "once".to_owned() } else { format!("{} times", board.waits) };
            lines.push(format!(
                "the simulated board's clock waited {times} for the loop, {} ms in all: this machine stalled",
                number(1e3 * board.waited)
            ));
        }
        if self.board.is_some_and(|b| b.hits == 0) && self.faults > 0 {
            lines.push("the fault that was asked for had not begun".into());
        }
        lines.extend(self.log.as_ref().map(|log| match &log.records {
            Ok(records) => format!("log: {0}, {records} records; clutch replay {0}", log.path.display()),
            Err(error) => format!("log: {error}"),
        }));
        lines.extend(r.notes.iter().map(|note| format!("note: {note}")));
        lines.extend(r.port_error.clone());
        lines.push(self.last_line());
        lines
    }

    /// The last of the remarks: why control ended, and whether the board is safe.
    #[must_use]
    pub fn last_line(&self) -> String {
        let r = &self.report;
        let safe = match (r.state, r.board_safe) {
            (State::Released, true) => "the output is released",
            (_, true) => "the board is in its safe state",
            (_, false) if r.on_the_board => {
                "the board did not confirm its safe state; it goes there by itself when it misses this machine"
            }
            (_, false) => "the board did not confirm its safe state; its watchdog takes it there",
        };
        if r.begun || r.state == State::Faulted {
            let missed = r.cause == Cause::Operator && !self.stopped;
            let fault = if r.state == State::Faulted || missed { "FAULT: " } else { "" };
            return format!("{fault}{}; {safe}", self.cause_text());
        }
        match &r.refused {
            _ if self.stopped && r.cause == Cause::None => {
                "stopped before the board was armed; its output is as it was".into()
            }
            _ if self.stopped => format!("stopped before the board said that it was armed; {safe}"),
            Some(m) => format!("the board was not armed: {}", why(m, None)),
            None => format!("the board did not say that it was armed; {safe}"),
        }
    }

    /// The whole as one JSON object, SI and radians; times of answers and cycles in µs.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let r = &self.report;
        let latency = |s: &CycleSummary| {
            json!({
                "p50_us": s.p50_ns as f64 / 1e3, "p99_us": s.p99_ns as f64 / 1e3,
                "p99_9_us": s.p99_9_ns as f64 / 1e3, "max_us": s.max_ns as f64 / 1e3, "count": s.count,
            })
        };
        json!({
            "scenario": self.scenario,
            "version": self.version,
            "verdict": self.verdict().name(),
            "state": format!("{:?}", r.state),
            "cause": format!("{:?}", r.cause),
            "cause_text": self.cause_text(),
            "value": r.value,
            (CERTIFIED): self.cleared.plan.certificate.certified(),
            "sampled": {
                "error_bound_rad": self.cleared.proven.map(|proven| proven.checked.error_bound),
                "verdict": self.cleared.bound_line(),
                "certificate": self.certificate,
                "spectral_radius": self.cleared.sampled.radii(),
                "stable": self.cleared.sampled.stable(),
                "sticks_excluded": false,
            },
            "ticks": r.ticks,
            "metrics": r.metrics,
            "detected": r.detected,
            "drift": r.drift.to_json(),
            "ended_by_drift": r.ended_by_drift,
            "samples": {
                "received": r.link.received, "lost": r.lost, "late": r.link.late,
                "duplicated": r.link.duplicated, "reordered": r.link.reordered, "implausible": r.implausible,
            },
            "bad_frames": r.link.bad_frames,
            "deadline_misses": r.deadline_misses,
            "response": latency(&r.response),
            "cycle": latency(&r.interval),
            "wake": latency(&r.wake),
            "tick_clock_cycles": (r.clock_hz > 0).then(|| json!({
                "clock_hz": r.clock_hz, "p50": r.tick_cycles.p50_ns, "p99_9": r.tick_cycles.p99_9_ns,
                "max": r.tick_cycles.max_ns,
            })),
            "untold": r.untold,
            "gains_changed": r.changed, "gains_changed_uncertified": r.changed_uncertified,
            "log_dropped": r.log_dropped,
            "cut_writes": r.cut_writes,
            "board_safe": r.board_safe,
            "board_waits": self.board.map(|b| b.waits),
            "port_error": r.port_error,
            "notes": r.notes,
        })
    }
}
