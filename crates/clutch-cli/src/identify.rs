//! `clutch identify`.

use crate::args::{ScenarioArgs, key_value};
use crate::live::LiveArg;
use crate::output::{
    self, BUILD, Exit, folded, json, paragraph, remark, shown, tell, to_write, write, wrote,
};
use crate::signals::stop_flag;
use crate::table::number;
use anyhow::{Context, bail};
use clap::Args;
use clutch_identify::added::{Added, Separate};
use clutch_identify::experiment::{ExperimentError, FASTEST_DEG_S, PartRunner, folder_for_logs};
use clutch_identify::recording::{MOST_TABLE_MIB, Scale};
use clutch_identify::seen::{Fell, Rode, Seen};
use clutch_identify::{
    Consent, Experiment, Finding, Identified, Recording, map_as_believed, map_file, motor,
};
use clutch_log::Limits;
use clutch_sim::Scenario;
use clutch_sim::scenario::read_text_up_to;
use serde_json::{Value, json as value};
use std::io::Write;
use std::path::{Path, PathBuf};
#[cfg(target_os = "linux")]
use {
    clutch_identify::experiment::remedy,
    clutch_loop::onlooker::Onlooker,
    clutch_loop::port::Address,
    clutch_loop::session::{Board, Session, SessionOptions},
    clutch_loop::summary::Verdict,
    std::sync::Arc,
    std::sync::atomic::AtomicBool,
};

/// Finds out what a rig is: T/J, delay, friction, ripple, damping, each with an interval; of a motor axis J/K and friction both
/// ways.
///
/// Runs an experiment of about a minute through the loop, with all its checks: on the scenario's simulated board, in
/// virtual time, or with --port on a real one. With --from it reads logs instead. A parameter that cannot be found is
/// refused, with the experiment that would find it.
#[derive(Args)]
#[command(after_help = "Examples:\n  clutch identify board_smc_2\n  \
    clutch identify mine.toml --port /dev/ttyACM0 --log logs --uncertified --out rig.toml\n  \
    clutch identify --from logs/releases.mcap logs/crawl.mcap logs/ride_5.mcap\n  \
    clutch certify mine.toml --identified rig.toml\n\n\
    docs/identify.md says what is measured, how well, and what cannot be.")]
pub(crate) struct Identify {
    /// Scenario of the rig, with [safety]: file, or name of a built-in one.
    #[arg(value_name = "SCENARIO.toml", default_value = "board_smc_2")]
    scenario: PathBuf,
    /// Overrides a key of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    set: Vec<(String, String)>,
    /// The board's port; without it the scenario's board is simulated, in virtual time.
    #[cfg(target_os = "linux")]
    #[arg(long, value_name = "PATH|tcp://HOST:PORT|unix:///PATH", requires = "log", conflicts_with = "from")]
    port: Option<Address>,
    /// Consent to laws without a certificate on a board at --port: the experiment's have none.
    #[cfg(target_os = "linux")]
    #[arg(long)]
    uncertified: bool,
    /// The board at the port is a simulated one whose clock waits (`clutch daq --patient`).
    #[cfg(target_os = "linux")]
    #[arg(long, requires = "port")]
    patient: bool,
    #[cfg(not(target_os = "linux"))]
    #[command(flatten)]
    at_port: crate::elsewhere::AtPort,
    /// Folder for a log of each part; it may not hold them yet.
    #[arg(long, value_parser = to_write(), value_name = "FOLDER")]
    log: Option<PathBuf>,
    /// Reads these logs instead: MCAP, or CSV with --columns.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "log")]
    from: Vec<PathBuf>,
    /// Logs of a second experiment, with a known mass added beside the weight: T, J and friction one by one.
    #[arg(long, value_name = "FILE", num_args = 1.., requires_all = ["from", "mass", "radius"])]
    loaded: Vec<PathBuf>,
    /// The mass that was added, kg.
    #[arg(long, value_name = "KG", requires = "loaded", allow_negative_numbers = true)]
    mass: Option<f64>,
    /// Radius of the pulley that it hangs from, m.
    #[arg(long, value_name = "M", requires = "loaded", allow_negative_numbers = true)]
    radius: Option<f64>,
    /// Columns of a CSV that hold counts and volts, one sample a row.
    #[arg(
        long,
        value_name = "COUNTS,VOLTS",
        value_delimiter = ',',
        num_args = 1,
        default_value = "counts,volts"
    )]
    columns: Vec<String>,
    #[arg(long, help = travel_help(), value_name = "DEG", conflicts_with = "from", allow_negative_numbers = true)]
    travel: Option<f64>,
    #[arg(long, help = fastest_help(), value_name = "DEG_S", conflicts_with = "from", allow_negative_numbers = true)]
    fastest: Option<f64>,
    /// Writes [model] and [bounds] for scenarios, with the intervals.
    #[arg(long, value_parser = to_write(), value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Writes friction along the disc as [friction_map], for `--map` of sim and loop. Without releases T/J and delay are taken
    /// as the scenario has them.
    #[arg(long, value_parser = to_write(), value_name = "FILE.toml")]
    map: Option<PathBuf>,
    #[command(flatten)]
    live: LiveArg,
    /// Prints the result as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

impl Identify {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        #[cfg(not(target_os = "linux"))]
        self.at_port.refuse("identify")?;
        self.live.check()?;
        output::check_files(self.out.iter().chain(&self.map))?;
        let (scenario, set) = (self.scenario.clone(), self.set.clone());
        let args = ScenarioArgs { scenario, set, identified: None, map: None };
        let scenario = args.load()?;
        let recordings = if self.from.is_empty() {
            match self.experiment(&scenario) {
                Err(why) if matches!(why.downcast_ref(), Some(ExperimentError::Stopped(_))) => {
                    let _ = std::io::stderr().write_all(shown(&paragraph(&why.to_string())).as_bytes());
                    return Ok(Exit::Stopped);
                }
                recordings => recordings?,
            }
        } else {
            let read = self.from.iter().map(|file| self.read(file, &scenario));
            read.collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten().collect()
        };
        let report = Identified::of(&recordings)?;
        let separate = self.separate(&report, &scenario)?;
        output::report(
            self.json,
            || json(&object(&report, separate.as_ref())),
            || text(&report) + &separate.as_ref().map_or_else(String::new, one_by_one),
        )?;
        // One that cannot be made does not cost the other.
        let rig = self.out.as_deref().map(|path| (path, report.rig_file(&scenario).map_err(Into::into)));
        let map = self.map.as_deref().map(|path| (path, friction_map(path, &report, &recordings, &scenario)));
        let (mut written, mut lacks) = (Vec::new(), Ok(()));
        for (path, file) in rig.into_iter().chain(map) {
            match file {
                Ok(file) => {
                    write(path, file)?;
                    written.push(path);
                }
                Err(why) => lacks = lacks.and(Err(why)),
            }
        }
        if !self.json {
            tell(&wrote(&written))?;
        }
        lacks?;
        let told = report.shown().iter().any(|row| row.finding.known().is_some());
        Ok(if told || (self.map.is_some() && self.out.is_none()) { Exit::Done } else { Exit::Failed })
    }

    /// Findings of both experiments together, if there is one with a mass added.
    fn separate(&self, alone: &Identified, scenario: &Scenario) -> anyhow::Result<Option<Separate>> {
        let (false, Some(mass), Some(radius)) = (self.loaded.is_empty(), self.mass, self.radius) else {
            return Ok(None);
        };
        let added = Added::on(scenario, mass, radius)?;
        let read = self.loaded.iter().map(|file| self.read(file, scenario));
        let recordings: Vec<Recording> =
            read.collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten().collect();
        Ok(Some(alone.separate(&Identified::of(&recordings)?, &added)?))
    }

    /// Runs the experiment, and says before what it does.
    fn experiment(&self, scenario: &Scenario) -> anyhow::Result<Vec<Recording>> {
        let consent = Consent { travel_deg: self.travel, fastest_deg_s: self.fastest };
        let experiment = Experiment::of(scenario, &consent)?;
        if let Some(folder) = &self.log {
            // Before anything moves.
            folder_for_logs(folder)?;
        }
        let mut plan = format!("{:.0} s of experiment on {}\n", experiment.seconds(), self.place());
        experiment.lines().iter().for_each(|line| plan += &format!("  {line}\n"));
        remark(&folded(&plan));
        #[cfg(target_os = "linux")]
        if let Some(port) = &self.port {
            return self.at_port(port, scenario, &experiment);
        }
        let logging = |folder: &PathBuf| PartRunner::logging(folder.clone(), BUILD);
        let runner = self.log.as_ref().map_or_else(PartRunner::default, logging);
        // Ctrl-C ends it at once, unless a view is to see the end.
        let looking = if self.live.asked_for() { self.live.looking(&stop_flag()?)? } else { None };
        let mut runner = runner.looked_at(looking, BUILD);
        Ok(experiment.run(scenario, &mut |name, part| runner.run(name, part))?)
    }

    /// The board of the experiment, in words.
    fn place(&self) -> String {
        #[cfg(target_os = "linux")]
        if let Some(port) = &self.port {
            return format!("the board at {port}");
        }
        "the simulated board, in virtual time".to_owned()
    }

    /// The experiment on the board at the port.
    #[cfg(target_os = "linux")]
    fn at_port(
        &self,
        port: &Address,
        scenario: &Scenario,
        experiment: &Experiment,
    ) -> anyhow::Result<Vec<Recording>> {
        if !self.uncertified {
            bail!(
                "nothing was started: the laws above have no certificate; --uncertified is your consent to them on the \
                 board at {port}"
            );
        }
        let folder = self.log.clone().unwrap_or_default();
        let stop = stop_flag()?;
        let live = self.live.start(&stop)?;
        let run = &mut |name: &str, part: &Scenario| {
            let onlooker = live.clone().map(|live| live as Arc<dyn Onlooker>);
            self.on_board(port, &folder.join(format!("{name}.mcap")), (name, part), &stop, onlooker)
        };
        Ok(experiment.run(scenario, run)?)
    }

    /// One run of the loop on the board at the port, read from its log.
    #[cfg(target_os = "linux")]
    fn on_board(
        &self,
        port: &Address,
        log: &Path,
        (name, part): (&str, &Scenario),
        stop: &Arc<AtomicBool>,
        onlooker: Option<Arc<dyn Onlooker>>,
    ) -> Result<Vec<Recording>, ExperimentError> {
        let runs = |e: &dyn std::fmt::Display| ExperimentError::Runs(e.to_string());
        let options = SessionOptions {
            board: Board::Daq(port.clone()),
            log: Some(log.to_owned()),
            patient: self.patient,
            uncertified: true,
            version: BUILD.to_owned(),
            ..SessionOptions::default()
        };
        let session = Session::new(part.clone(), options).map_err(|e| runs(&e))?.looked_at(onlooker);
        let summary = session.run(stop, &mut |_| ()).map_err(|e| runs(&e))?;
        if summary.verdict() == Verdict::Stopped {
            return Err(ExperimentError::Stopped(name.to_owned()));
        }
        if summary.verdict() != Verdict::Done {
            let (name, cause) = (name.to_owned(), summary.cause_text());
            return Err(ExperimentError::Ended { part: name, cause, remedy: remedy(part) });
        }
        let whole = clutch_log::read(log, &Limits::default())?;
        Ok(Recording::from_log(name, &whole)?)
    }

    /// Recordings in a file; of a CSV period and encoder are the scenario's.
    fn read(&self, file: &Path, scenario: &Scenario) -> anyhow::Result<Vec<Recording>> {
        let name = file.display().to_string();
        if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            let [counts, volts] = &self.columns[..] else {
                bail!("--columns {}: expected two names, as counts,volts", self.columns.join(","));
            };
            let text =
                read_text_up_to(file, MOST_TABLE_MIB).with_context(|| format!("{name}: cannot be read"))?;
            return Ok(vec![Recording::from_csv(&name, &text, (counts, volts), &Scale::of(scenario))?]);
        }
        let log = clutch_log::read(file, &Limits::default())?;
        Ok(Recording::from_log(&name, &log)?)
    }
}

fn travel_help() -> String {
    let (least, most) = motor::experiment::TRAVELS_DEG;
    let own = motor::experiment::Programme::default().travel_deg;
    format!("Way that a motor axis may go forwards from where it rests, {least} to {most}° [default: {own}]")
}

fn fastest_help() -> String {
    let (brake, axis) = (FASTEST_DEG_S, motor::experiment::FASTEST_DEG_S);
    let own = motor::experiment::Programme::default().fastest_deg_s;
    format!(
        "Highest rate, {} to {} °/s with a brake [default: {}], {} to {} °/s with a motor [default: {own}]",
        brake.0, brake.1, brake.1, axis.0, axis.1
    )
}

/// The file of the friction along the disc, as it was found or as the law believed it to be.
fn friction_map(
    path: &Path,
    report: &Identified,
    recordings: &[Recording],
    scenario: &Scenario,
) -> anyhow::Result<String> {
    let believed = || map_as_believed(recordings, scenario);
    let map = if report.map().is_empty() { believed() } else { report.map().to_vec() };
    if map.is_empty() {
        bail!(
            "{}: not written: no ride at an even rate was found; docs/identify.md says what is one",
            path.display()
        );
    }
    Ok(map_file(&map, scenario.name()))
}

fn text(report: &Identified) -> String {
    let (sets_off, slips, rates) = report.found();
    let of = if matches!(report, Identified::Brake(_)) { "releases" } else { "hops" };
    let rates: Vec<String> = rates.iter().map(|r| format!("{:.3}", r.to_degrees())).collect();
    let mut out = format!(
        "{sets_off} {of}, {slips} break-aways, {} rides{}\n",
        rates.len(),
        if rates.is_empty() { String::new() } else { format!(" at {} °/s", rates.join(", ")) }
    );
    let rows = report.shown();
    for row in &rows {
        if let Some(e) = row.finding.known() {
            let e = e.times(row.factor);
            let interval = format!("{} … {}", number(e.low), number(e.high));
            let line = format!("  {:<26}{:>10}  {interval:<23} {}", row.label, number(e.value), row.unit);
            out += line.trim_end();
            out.push('\n');
        }
    }
    if let Some(waves) = report.waves() {
        out += &format!("  {:<26}{waves:>10.0}  the likeliest           per turn\n", "waves of the ripple");
    }
    for row in &rows {
        if let Finding::Refused(why) = row.finding {
            out += &paragraph(&format!("{}: not determined; {why}", row.label));
        }
    }
    report.unexplained().iter().for_each(|line| out += &paragraph(&format!("unexplained: {line}")));
    if let (Identified::Motor(_), [first, .., last]) = (report, report.map())
        && last.angle - first.angle < core::f64::consts::TAU
    {
        out += &paragraph(&format!(
            "friction and load are those from {:.1} to {:.1}°: what varies once or twice a turn, as by a run-out, is a part of them, and \
             another one elsewhere",
            first.angle.to_degrees(),
            last.angle.to_degrees()
        ));
    }
    if matches!(report, Identified::Brake(_)) { out } else { folded(&out) }
}

/// Torque, inertia and friction of both experiments together.
fn one_by_one(separate: &Separate) -> String {
    let mut out = String::new();
    for (_, label, unit, finding) in separate.rows() {
        match finding {
            Finding::Known(e) => {
                let interval = format!("{} … {}", number(e.low), number(e.high));
                out += &format!("  {label:<26}{:>10}  {interval:<23} {}\n", number(e.value), unit.text);
            }
            Finding::Refused(why) => out += &paragraph(&format!("{label}: not determined; {why}")),
        }
    }
    out
}

fn finding(finding: &Finding) -> Value {
    match finding {
        Finding::Known(e) => value!({ "value": e.value, "low": e.low, "high": e.high }),
        Finding::Refused(why) => value!({ "refused": why }),
    }
}

/// Releases and rides beside what is believed of them.
fn seen(seen: &Seen) -> Value {
    let fell = |fell: &Fell| {
        value!({
            "recording": fell.place.0,
            "tick": fell.place.1,
            "period_s": fell.period,
            "seen_rad": fell.seen,
            "believed_rad": fell.believed,
        })
    };
    let rode = |rode: &Rode| {
        let (volts, deviation) = rode.seen;
        value!({ "rate_rad_s": rode.rate, "seen_v": volts, "deviation_v": deviation, "believed_v": rode.believed })
    };
    value!({
        "falls": seen.falls.iter().map(fell).collect::<Vec<_>>(),
        "rides": seen.rides.iter().map(rode).collect::<Vec<_>>(),
    })
}

/// The result as `--json` prints it.
#[must_use]
pub fn object(report: &Identified, separate: Option<&Separate>) -> Value {
    let parameters: serde_json::Map<String, Value> =
        report.shown().iter().map(|row| (row.key.to_owned(), finding(row.finding))).collect();
    let (sets_off, slips, rates) = report.found();
    let brake = matches!(report, Identified::Brake(_));
    let mut object = value!({
        "version": env!("CARGO_PKG_VERSION"),
        "actuator": if brake { "brake" } else { "motor" },
        "releases": if brake { *sets_off } else { 0 },
        "hops": if brake { 0 } else { *sets_off },
        "break_aways": slips,
        "rides_rad_s": rates,
        "parameters": parameters,
        "ripple_waves_per_turn": report.waves(),
        "unexplained": report.unexplained(),
        "seen": seen(report.seen()),
        "map": report.map().iter().map(|p| [p.angle, p.factor]).collect::<Vec<_>>(),
    });
    if let Some(separate) = separate {
        object["separate"] = separate.rows().iter().map(|row| (row.0.to_owned(), finding(row.3))).collect();
    }
    object
}
