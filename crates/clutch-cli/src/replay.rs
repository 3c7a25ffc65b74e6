//! `clutch replay`.

use crate::args::key_value;
use crate::output::{BUILD, Exit, paragraph, tell, to_write, wrote};
use crate::plot::{self, Figure, Panel, Series, Shade};
use crate::table::{number, quantities};
use clap::Args;
use clutch_core::supervisor::Arrival;
use clutch_log::{CommandRecord, Limits, Log, SampleRecord, Tail};
use clutch_loop::picture::{Pictured, pictured};
use clutch_loop::replay::{drift, replay};
use clutch_sim::Scenario;
use clutch_sim::picture::{Envelope, PARTS};
use clutch_sim::progress::UNWATCHED;
use std::path::PathBuf;

/// Feeds a log's encoder counts to its law again and compares every output bit for bit.
///
/// With --set the law gets other parameters: an open-loop replay, which gives the commands that
/// those would have caused on the same counts, and does not predict the motion of the shaft. Other
/// bounds are those against which friction over load is held.
///
/// Exit code 0: identical, or replayed with --set; 3: the outputs differ; 5: the same, as far as they can be compared: the
/// log ended early, or has a gap, behind which nothing is.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  clutch replay run.mcap\n  clutch replay run.mcap --set law.smc.kp_v=4 --plot compare.svg"
)]
pub(crate) struct Replay {
    /// The log.
    #[arg(value_name = "LOG.mcap")]
    log: PathBuf,
    /// Overrides a key of the log's scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// Draws both commands and their difference, closely around a stick and whole.
    #[arg(long, value_parser = to_write(), value_name = "FILE.svg|png")]
    plot: Option<PathBuf>,
}

impl Replay {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        if let Some(file) = &self.plot {
            plot::figure_format(file)?;
        }
        let log = clutch_log::read(&self.log, &Limits::default())?;
        let origin = format!("{}: its scenario", self.log.display());
        let scenario = Scenario::of_log(&origin, &log.header.scenario_toml, &self.set)?;
        let replayed = replay(&log, &scenario, UNWATCHED)?;
        if let Some(file) = &self.plot {
            figure(&log, &scenario, &replayed.commands)?.save(file)?;
        }
        let n = replayed.commands.len();
        let mut text = wrote(&self.plot.iter().map(PathBuf::as_path).collect::<Vec<_>>());
        if log.tail != Tail::Finished {
            text += &paragraph(&format!("the log ended early ({}); its readable part is replayed", log.tail));
        }
        if let Some(damage) = &log.damage {
            text += &paragraph(&format!("{} damaged places in the log; the first: {damage}", log.damaged));
        }
        if replayed.dropped > 0 {
            text += &format!("the log dropped {} records\n", replayed.dropped);
        }
        if replayed.behind_gap > 0 {
            text += &format!("a gap: {} ticks behind it are not comparable\n", replayed.behind_gap);
        }
        if replayed.terms_apart > 0 {
            text += &paragraph(&format!(
                "the law had another number of terms: {} of them not compared",
                replayed.terms_apart
            ));
        }
        let drift = drift(&log, &scenario, UNWATCHED)?;
        text += &paragraph(&format!("{}: {}", drift.label(), drift.words()));
        text.extend(drift.alarm_line().map(|line| paragraph(&line)));
        let whole = log.complete && replayed.behind_gap == 0 && replayed.dropped == 0;
        let done = if whole { Exit::Done } else { Exit::Incomplete };
        if !self.set.is_empty() {
            text += &compare(&log.commands, &replayed.commands);
            tell(&text)?;
            return Ok(done);
        }
        let outcome = match &replayed.first {
            None => {
                text += &format!("identical over {n} ticks\n");
                done
            }
            Some(d) => {
                text += &paragraph(&format!(
                    "differs: tick {}, {}: logged {:?}, replayed {:?}",
                    d.tick, d.field, d.logged, d.replayed
                ));
                if log.header.version != BUILD {
                    text += &paragraph(&format!(
                        "the log was written by version {}, this is {}",
                        log.header.version, BUILD
                    ));
                }
                Exit::Fault
            }
        };
        tell(&text)?;
        Ok(outcome)
    }
}

fn compare(logged: &[CommandRecord], replayed: &[CommandRecord]) -> String {
    let pairs = || logged.iter().zip(replayed);
    let largest =
        |f: fn(&CommandRecord) -> f64| pairs().map(|(a, b)| (f(a) - f(b)).abs()).fold(0.0, f64::max);
    let n = pairs().count().max(1) as f64;
    let square: f64 = pairs().map(|(a, b)| (a.voltage - b.voltage) * (a.voltage - b.voltage)).sum();
    let differ = pairs().filter(|(a, b)| a.code != b.code).count();
    let variation =
        |c: &[CommandRecord]| c.windows(2).map(|w| (w[1].voltage - w[0].voltage).abs()).sum::<f64>();
    let mut text = quantities(
        &format!("{} ticks replayed with other parameters, open loop", n),
        &[
            ("ticks with another code", differ.to_string(), ""),
            ("largest difference of the voltage", number(largest(|c| c.voltage)), "V"),
            ("RMS difference of the voltage", number((square / n).sqrt()), "V"),
            ("largest difference of the error rate", number(largest(|c| c.error_rate)), "rad/s"),
            ("voltage variation, logged", number(variation(logged)), "V"),
            ("voltage variation, replayed", number(variation(replayed)), "V"),
        ],
    );
    let early = pairs().find(|(a, b)| a.state != b.state);
    if let Some((a, b)) = early {
        let name = |s: u8| clutch_log::names::STATES.iter().find(|(n, _)| *n == s).map_or("?", |(_, n)| n);
        text += &format!(
            "from tick {} on the supervisor would have been {} instead of {}\n",
            a.tick,
            name(b.state),
            name(a.state)
        );
    }
    text
}

/// Left the window around a stick, right the whole: the voltage, what of it is other, position and error.
fn figure(log: &Log, scenario: &Scenario, replayed: &[CommandRecord]) -> anyhow::Result<Figure> {
    let n = replayed.len().min(log.commands.len());
    let logged = &log.commands[..n];
    let time: Vec<f64> = logged.iter().map(|c| c.time_ns as f64 / 1e9).collect();
    let Pictured { window, sticks } = pictured(log, scenario)?;
    let (from, to, words) = match window {
        Some(w) => (w.from, w.to, w.words()),
        None => (0.0, time.last().copied().unwrap_or(0.0), String::new()),
    };
    let place = |at: f64| time.partition_point(|t| *t < at);
    let within = place(from)..place(to);
    let rest = sticks.iter().map(|s| (s.from.max(from), s.to.min(to))).filter(|(a, b)| a < b).collect();
    let close = |title: &str, y_label: &str, series: Vec<Series>| Panel {
        title: title.to_owned(),
        x_label: "time (s)".to_owned(),
        y_label: y_label.to_owned(),
        series,
        shades: vec![Shade { label: "at rest".to_owned(), stretches: Vec::clone(&rest), of: None }],
        step: true,
        ..Panel::default()
    };
    let whole = |title: &str, y_label: &str, series: Vec<Series>| Panel {
        title: title.to_owned(),
        x_label: "time (s)".to_owned(),
        y_label: y_label.to_owned(),
        series,
        shades: vec![Shade { label: "the window".to_owned(), stretches: vec![(from, to)], of: None }],
        ..Panel::default()
    };
    let volts = [
        ("logged", logged.iter().map(|c| c.voltage).collect::<Vec<f64>>()),
        ("replayed", replayed[..n].iter().map(|c| c.voltage).collect()),
    ];
    let other: Vec<f64> = volts[1].1.iter().zip(&volts[0].1).map(|(b, a)| b - a).collect();
    let error: Vec<f64> = logged.iter().map(|c| c.error).collect();
    let points = |values: &[f64]| within.clone().map(|i| (time[i], values[i])).collect::<Vec<_>>();
    let line = |label: &str, values: &[f64]| Series::new(label, points(values));
    let band = |label: &str, values: &[f64], factor| {
        Series::envelope(label, &Envelope::new(&time, values, PARTS), factor)
    };
    let target = |c: &CommandRecord| c.target_fixed as f64 / 65536.0;
    let origin = within.clone().next().map_or(0.0, |i| target(&logged[i]).floor());
    let path = within.clone().map(|i| (time[i], target(&logged[i]) - origin)).collect();
    let seen = |s: &&SampleRecord| s.arrival != Arrival::Missing as u8;
    let counts =
        log.samples.iter().filter(seen).map(|s| (s.time_ns as f64 / 1e9, f64::from(s.counts) - origin));
    let counts = counts.filter(|(t, _)| (from..to).contains(t)).collect();
    let title = format!("{} ms {words}: voltage", number((1e3 * (to - from)).round()));
    let both = "lowest to highest and mean";
    let stairs = vec![Series::new("encoder", counts), Series { guide: true, ..Series::new("path", path) }];
    Ok(Figure {
        title: format!("Replay of {}", log.header.scenario_name),
        columns: 2,
        panels: vec![
            close(&title, "voltage (V)", volts.iter().map(|(label, v)| line(label, v)).collect()),
            whole(
                &format!("The whole run: voltage, {both}"),
                "voltage (V)",
                volts.iter().map(|(label, v)| band(label, v, 1.0)).collect(),
            ),
            close("The same: replayed − logged", "voltage (V)", vec![line("replayed − logged", &other)]),
            whole(
                &format!("The whole run: replayed − logged, {both}"),
                "voltage (V)",
                vec![band("mean", &other, 1.0)],
            ),
            close("The same: position, as logged", "position (counts)", stairs),
            whole(
                &format!("The whole run: error, as logged, {both}"),
                "error (°)",
                vec![band("mean", &error, 1.0_f64.to_degrees())],
            ),
        ],
        ..Figure::default()
    })
}
