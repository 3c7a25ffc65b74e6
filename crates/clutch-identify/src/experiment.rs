//! The experiment: runs of the loop's own laws, with all its checks, from which [`crate::identify`] learns.
//!
//! | part | law | shows |
//! |---|---|---|
//! | `releases` | PID without an integral on a path of steps | the brake lets go for some 40 ms: free falls |
//! | `crawl` | a soft PD far below the rate at which it sticks | break-aways under a voltage that falls slowly |
//! | `ride …` | glide, with the findings of the releases | mean friction at a rate, ripple |
//! | `releases_low`, behind the first ride | SMC with the sign function on such a path: releases from a lower voltage | a lag of the actuator, apart from a dead time |
//! | `releases_behind` | as `releases` | whether the torque is what it was |

use crate::break_away::{self, break_aways};
use crate::recording::{ReadError, Recording};
use crate::release;
use clutch_core::edge_timed::{EdgeTimedParams, waves_seen};
use clutch_core::supervisor::State;
use clutch_core::{DacCode, Real};
use clutch_log::{LogError, LogWriter, Source};
use clutch_loop::build_error::BuildError;
use clutch_loop::cause_words::cause_text;
use clutch_loop::from_scenario::{self, BuiltRun};
use clutch_loop::onlooker::Looking;
use clutch_loop::station::ControllerStation;
use clutch_loop::to_log::PRESENT_CODE;
use clutch_loop::virtual_time::{VirtualError, VirtualLoop, VirtualOptions};
use clutch_node::ControllerNode;
use clutch_sim::scenario::ScalarKind;
use clutch_sim::{Scenario, ScenarioError};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// The parts of the experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Programme {
    /// Releases.
    pub releases: u32,
    /// Releases from a lower voltage.
    pub releases_low: u32,
    /// Releases behind the rides.
    pub releases_behind: u32,
    /// Way from one release to the next, and from a lower voltage, from which a shaft takes longer to stop, °.
    pub step_deg: [f64; 2],
    /// Length of the crawl, s.
    pub crawl_s: f64,
    /// Rates of the rides, °/s, and their lengths, s, in their order: the first at a rate that bears a lag nobody knows of.
    pub rides: Vec<(f64, f64)>,
}

/// Less than a minute.
impl Default for Programme {
    fn default() -> Self {
        Programme {
            releases: 12,
            releases_low: 6,
            releases_behind: 4,
            step_deg: [2.5, 1.5],
            crawl_s: 24.0,
            rides: vec![(20.0, 7.0), (5.0, 10.0), (60.0, 5.0)],
        }
    }
}

/// Time from one release to the next, s.
const PACE_S: f64 = 0.45;
/// Rate of the crawl, °/s, and its law: the voltage falls by 1 V/s while the shaft rests.
const CRAWL_DEG_S: f64 = 0.5;
const CRAWL_KP: f64 = 115.0; // V/rad
const CRAWL_KD: f64 = 3.0; // V s/rad
/// Following error at rest that ends a part, °: a release and a soft law are far from the path.
const FOLLOWING_DEG: f64 = 6.0;
/// The lower voltage of releases, over the mean of a ride: it stops a shaft that has fallen a step within two of them; and the share
/// of the highest that it is at most, for a lag shows in the ratio of the two.
const LOW: f64 = 1.6;
const LOWER: f64 = 0.8;
/// Slope of a surface on which a velocity counts for less than an encoder's step, 1/s.
const PLACE_ALONE: f64 = 1e4;
/// Share of the speed limit with which a step of the path rises.
const STEP_RATE: f64 = 0.8;

/// Range of the highest rate of a ride, °/s; the last is the rate without a limit.
pub const FASTEST_DEG_S: (f64, f64) = (5.0, 60.0);

impl Programme {
    /// The programme whose rides are no faster, °/s.
    ///
    /// # Errors
    /// A rate out of range.
    pub fn within(fastest_deg_s: Option<f64>) -> Result<Self, ExperimentError> {
        let (least, most) = FASTEST_DEG_S;
        let value = fastest_deg_s.unwrap_or(most);
        if !(least..=most).contains(&value) {
            return Err(ExperimentError::Limit { key: "fastest", value, least, most, unit: "°/s" });
        }
        let programme = Programme::default();
        let mut rides: Vec<(f64, f64)> = Vec::new();
        for (rate, seconds) in programme.rides {
            let rate = rate.min(value);
            match rides.iter_mut().find(|ride| ride.0.total_cmp(&rate).is_eq()) {
                Some(same) => same.1 = same.1.max(seconds),
                None => rides.push((rate, seconds)),
            }
        }
        Ok(Programme { rides, ..programme })
    }

    /// Its length, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        let releases = [self.releases, self.releases_low, self.releases_behind].map(releases_s);
        releases.iter().sum::<f64>() + self.crawl_s + self.rides.iter().map(|ride| ride.1).sum::<f64>()
    }

    /// The way that the shaft is turned by, °, beyond which only a fault goes.
    #[must_use]
    pub fn way_deg(&self) -> f64 {
        let rides: f64 = self.rides.iter().map(|(rate, seconds)| rate * seconds).sum();
        let parts = 4.0 + self.rides.len() as f64;
        let [step, low] = self.step_deg;
        f64::from(self.releases + self.releases_behind) * step
            + f64::from(self.releases_low) * low
            + CRAWL_DEG_S * self.crawl_s
            + rides
            + parts * FOLLOWING_DEG
    }

    /// The plan, a line for each part: what it does, for how long, and how far.
    #[must_use]
    pub fn plan(&self) -> Vec<String> {
        let [step, low] = self.step_deg;
        let releases = |number: u32| {
            let seconds = releases_s(number);
            format!(
                "releases    {number} times 0 V until the shaft has fallen by about {step} °, {seconds:.1} s"
            )
        };
        let mut rides = self
            .rides
            .iter()
            .map(|(rate, seconds)| format!("ride        {rate} °/s under glide, {seconds} s"));
        let mut lines = vec![
            releases(self.releases),
            format!("crawl       {CRAWL_DEG_S} °/s under a soft PD, it sticks and slips, {} s", self.crawl_s),
        ];
        lines.extend(rides.next());
        lines.push(format!(
            "releases    {} times from a lower voltage, by about {low} °, {:.1} s",
            self.releases_low,
            releases_s(self.releases_low)
        ));
        lines.extend(rides);
        lines.push(releases(self.releases_behind));
        lines.push(format!(
            "limits      {:.0}° in all; a part ends {FOLLOWING_DEG}° off its path, and by any other check",
            self.way_deg()
        ));
        lines
    }
}

/// Length of so many releases, s.
fn releases_s(number: u32) -> f64 {
    PACE_S * (f64::from(number) + 1.0)
}

/// The experiment could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// A key of the scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A part makes no run.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The recordings.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A run in virtual time.
    #[error(transparent)]
    Virtual(#[from] VirtualError),
    /// A log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Logs are never written over: they may be the only record of an experiment.
    #[error("{}: holds logs already, as {file}; name another folder for the logs", folder.display())]
    HoldsLogs {
        /// The folder.
        folder: PathBuf,
        /// One of them.
        file: String,
    },
    /// The output does not let go.
    #[error("output.lowest_v = {0}: expected at most 0 V, as a release lets the brake go")]
    NoRelease(f64),
    /// The model's actuator is no motor.
    #[error("model.actuator: expected a motor, as that of [rig.actuator]")]
    NoMotor,
    /// The output of a motor goes one way.
    #[error("{0} = {1}: expected {2} 0 V, as the axis goes both ways")]
    OneWay(&'static str, f64, &'static str),
    /// A limit that this rig's experiment has no use for.
    #[error("{0}: is a limit of the experiment on a motor axis, and [rig.actuator] is none")]
    OfMotors(&'static str),
    /// A limit of the experiment.
    #[error("{key} = {value} {unit}: expected {least} to {most} {unit}")]
    Limit {
        /// Its name.
        key: &'static str,
        /// Its value.
        value: f64,
        /// Least that it may be.
        least: f64,
        /// Most that it may be.
        most: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The supervisor ended a part.
    #[error("the part \"{part}\" ended early: {cause}; it is in its safe state. {remedy}")]
    Ended {
        /// The part.
        part: String,
        /// The cause, in words.
        cause: String,
        /// The remedy.
        remedy: String,
    },
    /// Somebody here stopped a part.
    #[error("the part \"{0}\" was stopped by the operator; it is in its safe state")]
    Stopped(String),
    /// Something else that runs a part.
    #[error("{0}")]
    Runs(String),
}

/// A new folder for the logs of an experiment: it is made if it is not there, and holds none yet.
///
/// # Errors
/// A log of whatever part; a folder that cannot be made or read.
pub fn folder_for_logs(folder: &Path) -> Result<(), ExperimentError> {
    let io = |source| LogError::Io { path: folder.into(), action: "cannot be made or read", source };
    std::fs::create_dir_all(folder).map_err(io)?;
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.extension().is_some_and(|ending| ending == "mcap") {
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            return Err(ExperimentError::HoldsLogs { folder: folder.to_owned(), file });
        }
    }
    Ok(())
}

/// A function that makes one run of the loop, given the part's name and its scenario, and gives the recordings.
pub type Runs<'a> = dyn FnMut(&str, &Scenario) -> Result<Vec<Recording>, ExperimentError> + 'a;

/// Counts that a sample may be off, below which steps of the encoder alone make samples that are not believed.
const FEWEST_JUMP_COUNTS: f64 = 3.0;

/// The remedy where a check ended a part.
#[must_use]
pub fn remedy(scenario: &Scenario) -> String {
    let mut remedy = "Look at the rig first. Wider [bounds] help if they do not hold it, and a lower --fastest (fastest_deg_s) if it \
                      gathers speed too slowly for a ride"
        .to_owned();
    let count_deg = 360.0 / f64::from(scenario.spec().rig.encoder.sensor.counts_per_rev);
    let jump_deg = scenario
        .safety()
        .map_or(f64::INFINITY, |safety| (1e6 * safety.limits.supervisor.jump.to_degrees()).round() / 1e6);
    if jump_deg < FEWEST_JUMP_COUNTS * count_deg {
        remedy += &format!(
            ". safety.limits.jump_deg = {jump_deg} is {:.1} counts of this encoder, so that samples of a sound shaft are not believed, and \
             get no answer; expected {FEWEST_JUMP_COUNTS} counts or more, as {:.2}",
            jump_deg / count_deg,
            (100.0 * FEWEST_JUMP_COUNTS * count_deg).ceil() / 100.0
        );
    }
    remedy
}

/// Runs the programme, part by part; `run` makes one run of the loop, and says what was recorded. Later parts are given
/// what earlier ones gave.
///
/// # Errors
/// The scenario has no safe state or does not let go; a part that cannot be run, or was ended by a check.
pub fn experiment(
    base: &Scenario,
    programme: &Programme,
    run: &mut Runs<'_>,
) -> Result<Vec<Recording>, ExperimentError> {
    base.safety()?;
    let lowest = base.params().output.lowest;
    if lowest > 0.0 {
        return Err(ExperimentError::NoRelease(lowest));
    }
    let mut recordings = run("releases", &releases(base, programme.releases, programme)?)?;
    recordings.extend(run("crawl", &crawl(base, programme)?)?);
    let mut fall = fall(&recordings);
    for (number, ride) in programme.rides.iter().enumerate() {
        let ridden = run(&format!("ride_{}", ride.0), &glide(base, *ride, fall.as_ref())?)?;
        let low = LOW * mean_volts(&ridden);
        recordings.extend(ridden);
        if number == 0 && low < LOWER * base.params().output.highest {
            recordings.extend(run("releases_low", &releases_from(base, low, programme)?)?);
            fall = self::fall(&recordings).or(fall);
        }
    }
    let behind = releases(base, programme.releases_behind, programme)?;
    recordings.extend(run("releases_behind", &behind)?);
    Ok(recordings)
}

/// T/J, delay and lag as known from these, where they are.
fn fall(recordings: &[Recording]) -> Option<release::Fall> {
    let releases: Vec<_> = recordings.iter().flat_map(release::releases).collect();
    let slips: Vec<_> = recordings.iter().flat_map(break_aways).collect();
    release::fall(&releases, crate::DAMPINGS, break_away::mean_volts(&slips)).ok()
}

/// A table of one key after the other.
pub(crate) fn table<const N: usize>(rows: [(&str, Value); N]) -> Value {
    Value::Table(rows.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
}

/// A part: the scenario with another law, path and length. Rig, model, bounds, safe state and checks stay.
pub(crate) fn part(base: &Scenario, law: Value, path: Value, seconds: f64) -> Result<Table, ScenarioError> {
    let mut t = base.table().clone();
    for other in ["velocity", "shell"] {
        t.remove(other);
    }
    t.insert("law".to_owned(), law);
    t.insert("reference".to_owned(), path);
    if let Some(Value::Table(run)) = t.get_mut("run") {
        run.insert("duration_s".to_owned(), Value::Float(seconds));
        run.insert("settle_s".to_owned(), Value::Float(0.0));
        run.insert("start".to_owned(), Value::String("rest".to_owned()));
    }
    if let Some(Value::Table(safety)) = t.get_mut("safety")
        && let Some(Value::Table(limits)) = safety.get_mut("limits")
    {
        let given = limits.get("following_error_deg").and_then(Value::as_float).unwrap_or(0.0);
        limits.insert("following_error_deg".to_owned(), Value::Float(given.max(FOLLOWING_DEG)));
    }
    Ok(t)
}

pub(crate) fn checked(base: &Scenario, name: &str, table: Table) -> Result<Scenario, ScenarioError> {
    let title = Value::String(format!("{}: {name}", base.name()));
    Scenario::from_table(&format!("{name} for {}", base.name()), table, &[("name".to_owned(), title)])
}

/// Mean voltage of a ride, V.
fn mean_volts(ride: &[Recording]) -> f64 {
    let ticks = || ride.iter().flat_map(|r| &r.ticks);
    ticks().map(|tick| tick.volts).sum::<f64>() / ticks().count() as f64
}

/// Releases on a path of steps; the brake holds with all that the output has.
fn releases(base: &Scenario, number: u32, programme: &Programme) -> Result<Scenario, ScenarioError> {
    let spec = base.spec();
    let rate = STEP_RATE * spec.rig.speed.speed_limit; // rad/s
    // The voltage that holds the shaft while it waits.
    let wait = base.safety()?.on_fault.holding_voltage().unwrap_or(0.8 * spec.output.highest);
    let wait = wait.min(spec.output.highest);
    // The first period of a step takes all of it away: an integral of next to nothing keeps what the limits have cut off
    // while the shaft was held ahead of the path.
    let kp = 8.0 * wait / (rate * spec.period.seconds::<f64>());
    let law = table([(
        "pid",
        table([
            ("kp_v_rad", Value::Float(kp)),
            ("ki_v_rad_s", Value::Float(1e-30)),
            ("kd_v_s_rad", Value::Float(0.0)),
            ("bias_v", Value::Float(wait)),
        ]),
    )]);
    let path = steps(base, number, programme.step_deg[0]);
    checked(base, "releases", part(base, law, path, releases_s(number))?)
}

/// The same, held with a voltage lower than that: one voltage ahead of the path, none behind it.
fn releases_from(base: &Scenario, volts: f64, programme: &Programme) -> Result<Scenario, ScenarioError> {
    let number = programme.releases_low;
    let law = table([(
        "smc_sign",
        table([
            ("kp_v", Value::Float(volts)),
            ("kd_v_s_rad", Value::Float(0.0)),
            ("slope_1_s", Value::Float(PLACE_ALONE)),
        ]),
    )]);
    let path = steps(base, number, programme.step_deg[1]);
    checked(base, "releases from a lower voltage", part(base, law, path, releases_s(number))?)
}

/// A path of so many steps, °.
fn steps(base: &Scenario, number: u32, step_deg: f64) -> Value {
    let rate = STEP_RATE * base.spec().rig.speed.speed_limit; // rad/s
    let rise = step_deg / rate.to_degrees();
    let mut points = vec![(0.0, 0.0)];
    for k in 0..number {
        let (time, angle) = (PACE_S * f64::from(k + 1), step_deg * f64::from(k));
        points.extend([(time, angle), (time + rise, angle + step_deg)]);
    }
    let points = points.into_iter().map(|(t, a)| Value::Array(vec![Value::Float(t), Value::Float(a)]));
    table([(
        "table",
        table([
            ("points_s_deg", Value::Array(points.collect())),
            ("interpolation", Value::String("linear".to_owned())),
        ]),
    )])
}

pub(crate) fn ramp(rate_deg_s: f64) -> Value {
    table([("ramp", table([("rate_deg_s", Value::Float(rate_deg_s))]))])
}

fn crawl(base: &Scenario, programme: &Programme) -> Result<Scenario, ScenarioError> {
    let law = table([(
        "pd",
        table([("kp_v_rad", Value::Float(CRAWL_KP)), ("kd_v_s_rad", Value::Float(CRAWL_KD))]),
    )]);
    checked(base, "crawl", part(base, law, ramp(CRAWL_DEG_S), programme.crawl_s)?)
}

fn glide(
    base: &Scenario,
    (rate, seconds): (f64, f64),
    fall: Option<&release::Fall>,
) -> Result<Scenario, ScenarioError> {
    let spec = base.spec();
    let period: f64 = spec.period.seconds();
    let delay = fall.map_or(0.0, |fall| (fall.dead_time() / period).round().min(3.0));
    let lag = fall.map_or(0.0, release::Fall::lags);
    let waves = waves_seen(EdgeTimedParams::<f64>::default().waves, spec.rig.encoder.sensor.counts_per_rev);
    let filter = table([
        ("delay_ticks", Value::Integer(delay as i64)),
        ("lag_s", Value::Float(lag)),
        ("ripple_waves_per_turn", Value::Float(waves)),
    ]);
    let law = table([("glide", table([("filter", filter)]))]);
    let mut t = part(base, law, ramp(rate), seconds)?;
    if let (Some(fall), Some(Value::Table(model))) = (fall, t.get_mut("model")) {
        // Drive torque stays what it is believed to be: only their ratio is determined, and only it matters.
        let inertia = spec.model.drive_torque / fall.pull.value;
        model.insert("inertia_kg_m2".to_owned(), Value::Float(inertia));
    }
    checked(base, &format!("ride at {rate} °/s"), t)
}

/// Runs the parts of an experiment on the scenario's simulated board in virtual time, the shaft where the part before has left it.
#[derive(Debug, Default)]
pub struct PartRunner {
    /// Folder for a log of each run, and the version that it states.
    logs: Option<(PathBuf, String)>,
    /// One that looks on, and the version that it is told.
    looking: Option<(Looking, String)>,
    /// Counts at which the shaft rests.
    rests_at: Option<f64>,
}

impl PartRunner {
    /// One whose runs leave a log each in a folder, which states this version.
    #[must_use]
    pub fn logging(folder: PathBuf, version: &str) -> Self {
        PartRunner { logs: Some((folder, version.to_owned())), ..PartRunner::default() }
    }

    /// The same, looked at if somebody looks on, who is told this version.
    #[must_use]
    pub fn looked_at(self, looking: Option<Looking>, version: &str) -> Self {
        PartRunner { looking: looking.map(|looking| (looking, version.to_owned())), ..self }
    }

    /// One run, and what was recorded.
    ///
    /// # Errors
    /// As [`experiment`].
    pub fn run(&mut self, name: &str, scenario: &Scenario) -> Result<Vec<Recording>, ExperimentError> {
        let at = self.rests_at.map(|counts| ("run.start_counts".to_owned(), format!("{counts:?}")));
        let set: Vec<(String, String)> = at.into_iter().collect();
        let scenario = Scenario::parse(scenario.name(), &scenario.canonical(), &set)?;
        match scenario.scalar() {
            ScalarKind::F32 => self.run_in::<f32>(name, &scenario),
            ScalarKind::F64 => self.run_in::<f64>(name, &scenario),
        }
    }

    fn run_in<T: Real>(
        &mut self,
        name: &str,
        scenario: &Scenario,
    ) -> Result<Vec<Recording>, ExperimentError> {
        let built = BuiltRun::<T>::new(scenario, 1)?;
        let path = from_scenario::path::<T>(scenario)?;
        let options = VirtualOptions {
            record: true,
            // After its end the safe state brings the shaft to rest.
            duration: scenario.spec().run.duration + 1.0,
            ticks: built.ticks,
            ..VirtualOptions::default()
        };
        let (dac, servo) = (*built.servo.dac(), built.servo);
        let node = ControllerNode::new(built.controller, built.servo, built.supervisor);
        let on_rig = VirtualLoop::new(scenario, options, ControllerStation::new(node, &path))
            .map_err(VirtualError::from)?;
        let header = |version: &str| {
            from_scenario::header(scenario, &servo, Source::Loop, "simulated, in virtual time", version)
        };
        let played =
            self.looking.as_ref().map(|(looking, version)| looking.begin(&header(version), scenario));
        let mut on_rig = on_rig.played(played);
        let report = on_rig.run(&path)?;
        let rig = on_rig.rig();
        self.rests_at = Some(rig.shaft().position * rig.rig().encoder.counts_per_radian::<f64>());
        if let Some((folder, version)) = &self.logs {
            let mut header = header(version);
            header.extra.push((PRESENT_CODE.to_owned(), report.present.to_string()));
            let mut log = LogWriter::create(folder.join(format!("{name}.mcap")), &header)?;
            for record in &report.records {
                log.write(record)?;
            }
            log.finish()?;
        }
        if report.standing.state == State::Faulted || report.cause.is_some() {
            let cause = report.cause.unwrap_or(report.standing.cause);
            return Err(ExperimentError::Ended {
                part: name.to_owned(),
                cause: cause_text(cause, report.standing.value, false, false),
                remedy: remedy(scenario),
            });
        }
        if report.stopped {
            return Err(ExperimentError::Stopped(name.to_owned()));
        }
        let (samples, commands) = report.samples_and_commands();
        let before = dac.volts(DacCode(report.present)).to_f64();
        Ok(Recording::from_records(name, scenario, Some(before), (&samples, &commands))?)
    }
}
