//! Input of the estimators: counts and the voltage given after each, from a log or a table.

use clutch_core::reference::ReferenceParams;
use clutch_core::supervisor::{Arrival, State};
use clutch_core::{ActuatorKind, Dac, DacCode};
use clutch_log::{CommandRecord, CommandSource, Log, SampleRecord};
use clutch_loop::to_log::{PRESENT_CODE, START_VOLTAGE};
use clutch_sim::{Scenario, ScenarioError};
use std::borrow::Cow;

/// A sample, and the voltage that was given after it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Recorded {
    /// Counts of the encoder.
    pub counts: i64,
    /// Voltage given after the sample, V.
    pub volts: f64,
}

/// A stretch of samples without a gap; with a brake forwards is the way that the shaft is driven.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Name for messages: a file, a part of the experiment.
    pub name: String,
    /// `true` if a voltage drives the shaft, either way; else it brakes.
    pub motor: bool,
    /// Sampling period, s.
    pub period: f64,
    /// Counts of the encoder in a turn.
    pub counts_per_rev: u32,
    /// A step of the converter, V.
    pub step_volts: f64,
    /// Voltage before the first tick's, V.
    pub volts_before: f64,
    /// Rate of the ramp that a law with a filter of its own rode, which slides wherever friction is of its model, rad/s.
    pub glides_at: Option<f64>,
    /// Tick of the run at which the stretch begins.
    pub first_tick: u64,
    /// The samples.
    pub ticks: Vec<Recorded>,
}

/// [`Recording::glides_at`] of a run of a scenario.
#[must_use]
pub fn glides_at(scenario: &Scenario) -> Option<f64> {
    let params = scenario.params();
    let ReferenceParams::Ramp(ramp) = params.reference else { return None };
    params.law.filter().map(|_| ramp.rate)
}

/// Facts that a table does not say of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Sampling period, s.
    pub period: f64,
    /// Counts of the encoder in a turn.
    pub counts_per_rev: u32,
    /// As [`Recording::motor`].
    pub motor: bool,
    /// Least and greatest voltage that there may be, V.
    pub volts: (f64, f64),
}

/// Share of the output's span by which a table's voltages may lie beyond it.
const BEYOND: f64 = 0.1;

impl Scale {
    /// The scale of a scenario's samples and output.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Scale {
        let (spec, output) = (scenario.spec(), scenario.params().output);
        let beyond = BEYOND * (output.highest - output.lowest);
        Scale {
            period: spec.period.seconds(),
            counts_per_rev: spec.rig.encoder.sensor.counts_per_rev,
            motor: spec.rig.actuator.kind() == ActuatorKind::Motor,
            volts: (output.lowest - beyond, output.highest + beyond),
        }
    }
}

/// Ticks or tables that no estimator can use.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The log.
    #[error(transparent)]
    Log(#[from] clutch_log::LogError),
    /// The log's scenario.
    #[error("{name}: its scenario cannot be read: {error}")]
    Scenario {
        /// The log.
        name: String,
        /// The scenario's error.
        error: Box<ScenarioError>,
    },
    /// A log of another plant.
    #[error("{0}: its actuator is {1}: expected a brake, which 0 V lets go, or a motor")]
    Actuator(String, &'static str),
    /// Logs of both.
    #[error("{0} is of another actuator than {1}: expected recordings of one rig, a brake or a motor")]
    Mixed(String, String),
    /// A log without samples under control.
    #[error("{0}: has no samples under control")]
    Empty(String),
    /// A table.
    #[error("{name}: {what}")]
    Table {
        /// The file.
        name: String,
        /// The mistake, its place and what is expected.
        what: String,
    },
}

/// Recordings as seen behind an actuator with a lag, s, if there is one.
pub(crate) fn at_pad(recordings: &[Recording], lag: f64) -> Cow<'_, [Recording]> {
    if lag > 0.0 {
        Cow::Owned(recordings.iter().map(|r| r.through_lag(lag)).collect())
    } else {
        Cow::Borrowed(recordings)
    }
}

/// Most of a table that is read whole, MiB: some hours of a kilohertz.
pub const MOST_TABLE_MIB: u64 = 256;

impl Recording {
    /// Samples in a time, s.
    pub(crate) fn samples(&self, time: f64) -> usize {
        (time / self.period).round().clamp(1.0, 1e9) as usize
    }

    /// The times by which a shaft that sets off is later at an edge than with 20 000 counts, where there are fewer.
    pub(crate) fn coarse(&self) -> f64 {
        (20_000.0 / f64::from(self.counts_per_rev)).sqrt().max(1.0)
    }

    /// A count, rad.
    #[must_use]
    pub fn radians_per_count(&self) -> f64 {
        core::f64::consts::TAU / f64::from(self.counts_per_rev)
    }

    /// Acceleration in counts per period² of 1 rad/s².
    #[must_use]
    pub fn per_rad_s2(&self) -> f64 {
        self.period * self.period / self.radians_per_count()
    }

    /// Voltage given after sample `i`; before the first, the one that was there.
    #[must_use]
    pub fn volts(&self, i: isize) -> f64 {
        usize::try_from(i).ok().and_then(|i| self.ticks.get(i)).map_or(self.volts_before, |t| t.volts)
    }

    /// Mean voltage at the pad over a part of a period: from `from` to `to` periods after sample `i`, both between 0
    /// and 1, where a voltage takes `delay` periods to the pad.
    #[must_use]
    pub fn at_pad(&self, i: usize, (from, to): (f64, f64), delay: f64) -> f64 {
        let whole = delay.floor();
        let change = delay - whole; // within the period, the newer voltage comes then
        let i = i as isize - whole as isize;
        let (older, newer) = (self.volts(i - 1), self.volts(i));
        if to <= change {
            return older;
        }
        if from >= change {
            return newer;
        }
        ((change - from) * older + (to - change) * newer) / (to - from)
    }

    /// As seen behind an actuator with a lag, s: of each period the mean of the voltage that it has.
    #[must_use]
    pub fn through_lag(&self, lag: f64) -> Recording {
        let mut seen = self.clone();
        let left = libm::exp(-self.period / lag);
        let mut at_pad = self.volts_before;
        for tick in &mut seen.ticks {
            let end = tick.volts + (at_pad - tick.volts) * left;
            let mean = tick.volts + (at_pad - tick.volts) * (1.0 - left) * lag / self.period;
            (tick.volts, at_pad) = (mean, end);
        }
        seen
    }

    /// The recordings in a log: more than one where samples are missing. A weight that drives backwards is turned round.
    ///
    /// # Errors
    /// No scenario, neither brake nor motor, no samples.
    pub fn from_log(name: &str, log: &Log) -> Result<Vec<Recording>, ReadError> {
        let scenario = Scenario::of_log(name, &log.header.scenario_toml, &[])
            .map_err(|error| ReadError::Scenario { name: name.to_owned(), error: Box::new(error) })?;
        let extra = |key: &str| log.header.extra.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
        let present = extra(PRESENT_CODE).and_then(|v| v.parse().ok());
        let before = match present {
            Some(code) => Some(converter(name, &scenario)?.volts(DacCode(code))),
            None => extra(START_VOLTAGE).and_then(|v| u64::from_str_radix(v, 16).ok()).map(f64::from_bits),
        };
        Recording::from_records(name, &scenario, before, (&log.samples, &log.commands))
    }

    /// The recordings in the records of a run; `before`: the voltage before it, if it is known, V.
    ///
    /// # Errors
    /// Neither brake nor motor, no samples.
    pub fn from_records(
        name: &str,
        scenario: &Scenario,
        before: Option<f64>,
        (samples, commands): (&[SampleRecord], &[CommandRecord]),
    ) -> Result<Vec<Recording>, ReadError> {
        let spec = scenario.spec();
        let kind = spec.rig.actuator.kind();
        if kind == ActuatorKind::Both {
            return Err(ReadError::Actuator(name.to_owned(), kind.name()));
        }
        let dac = converter(name, scenario)?;
        let template = Recording {
            name: name.to_owned(),
            motor: kind == ActuatorKind::Motor,
            period: spec.period.seconds(),
            counts_per_rev: spec.rig.encoder.sensor.counts_per_rev,
            step_volts: dac.volts(DacCode(1)) - dac.volts(DacCode(0)),
            volts_before: 0.0,
            glides_at: glides_at(scenario),
            first_tick: 0,
            ticks: Vec::new(),
        };
        let by_the_law =
            |c: &&CommandRecord| c.state == State::Running as u8 && c.source == CommandSource::Law as u8;
        let mut samples =
            samples.iter().filter(|s| s.arrival == Arrival::Fresh as u8 && !s.superseded).peekable();
        let mut found: Vec<Recording> = Vec::new();
        let (mut next, mut last) = (0, None);
        for command in commands.iter().filter(by_the_law) {
            while samples.next_if(|s| s.tick < command.tick).is_some() {}
            let Some(sample) = samples.next_if(|s| s.tick == command.tick) else { continue };
            if found.is_empty() || command.tick != next {
                let volts_before = last.or(before).unwrap_or(command.voltage);
                found.push(Recording { volts_before, first_tick: command.tick, ..template.clone() });
            }
            if let Some(recording) = found.last_mut() {
                recording.ticks.push(Recorded { counts: i64::from(sample.counts), volts: command.voltage });
            }
            (next, last) = (command.tick + 1, Some(command.voltage));
        }
        found.iter_mut().for_each(Recording::unwrap_counts);
        found.retain(|r| r.ticks.len() > 1);
        if found.is_empty() {
            return Err(ReadError::Empty(name.to_owned()));
        }
        Ok(found)
    }

    /// A table of columns, one sample a row; `counts` and `volts` are the names of its columns.
    ///
    /// # Errors
    /// The row, the column, and what is expected there.
    pub fn from_csv(
        name: &str,
        text: &str,
        (counts, volts): (&str, &str),
        scale: &Scale,
    ) -> Result<Recording, ReadError> {
        let &Scale { period, counts_per_rev, motor, volts: (least, most) } = scale;
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let heads = reader.headers().map_err(|e| table(name, &e.to_string()))?.clone();
        let column = |wanted: &str| {
            heads.iter().position(|head| head == wanted).ok_or_else(|| {
                let all: Vec<&str> = heads.iter().collect();
                table(name, &format!("has no column \"{wanted}\": expected one of: {}", all.join(", ")))
            })
        };
        let (counts, volts) = (column(counts)?, column(volts)?);
        let mut ticks = Vec::new();
        for (i, row) in reader.records().enumerate() {
            let line = i + 2;
            let row = row.map_err(|e| table(name, &e.to_string()))?;
            let number = |column: usize| {
                let text = row.get(column).unwrap_or("");
                let value = text.parse::<f64>().ok().filter(|x| x.is_finite());
                value.ok_or_else(|| {
                    let head = heads.get(column).unwrap_or("");
                    table(name, &format!("line {line}, column \"{head}\" = \"{text}\": expected a number"))
                })
            };
            let read = number(counts)?;
            if read.fract() != 0.0 || read.abs() > 1e15 {
                let what = format!("line {line}: counts = {read}: expected a whole number of counts");
                return Err(table(name, &what));
            }
            let given = number(volts)?;
            if !(least..=most).contains(&given) {
                let head = heads.get(volts).unwrap_or("");
                let what = format!(
                    "line {line}, column \"{head}\" = {given}: expected volts within output.lowest_v and output.highest_v of the scenario, \
                     and not far beyond: {least} to {most}"
                );
                return Err(table(name, &what));
            }
            ticks.push(Recorded { counts: read as i64, volts: given });
        }
        if ticks.len() < 2 {
            return Err(ReadError::Empty(name.to_owned()));
        }
        let mut steps: Vec<f64> = ticks.windows(2).map(|w| (w[1].volts - w[0].volts).abs()).collect();
        steps.retain(|step| *step > 1e-9);
        let step_volts = steps.into_iter().fold(f64::INFINITY, f64::min);
        let mut found = Recording {
            name: name.to_owned(),
            motor,
            period,
            counts_per_rev,
            step_volts: if step_volts.is_finite() { step_volts } else { 0.0 },
            volts_before: ticks[0].volts,
            glides_at: None,
            first_tick: 0,
            ticks,
        };
        found.unwrap_counts();
        let most = i64::from(counts_per_rev / 2).max(1);
        let leap = found.ticks.windows(2).position(|w| (w[1].counts - w[0].counts).abs() > most);
        match leap {
            Some(i) => {
                let by = found.ticks[i + 1].counts - found.ticks[i].counts;
                let what = format!(
                    "line {}: counts go on by {by} in one period: expected at most half a turn, {most}",
                    i + 3
                );
                Err(table(name, &what))
            }
            None => Ok(found),
        }
    }

    /// The same with the axis turned round.
    #[must_use]
    pub fn turned(&self) -> Recording {
        let mut other = self.clone();
        other.volts_before = -other.volts_before;
        // −1 − n keeps counts that floor.
        other.ticks.iter_mut().for_each(|t| *t = Recorded { counts: -1 - t.counts, volts: -t.volts });
        other
    }

    /// Counts wrap at 2³², and a shaft that a weight drives backwards is turned round.
    fn unwrap_counts(&mut self) {
        let Some(first) = self.ticks.first().map(|t| t.counts) else { return };
        let mut last = first;
        for tick in &mut self.ticks {
            let step = tick.counts.wrapping_sub(last) as i32;
            tick.counts = last + i64::from(step);
            last = tick.counts;
        }
        if last < first && !self.motor {
            // −1 − n keeps counts that floor.
            self.ticks.iter_mut().for_each(|tick| tick.counts = -1 - tick.counts);
        }
    }
}

fn converter(name: &str, scenario: &Scenario) -> Result<Dac<f64>, ReadError> {
    Dac::new(&scenario.spec().rig.dac.converter).map_err(|e| table(name, &e.to_string()))
}

fn table(name: &str, what: &str) -> ReadError {
    ReadError::Table { name: name.to_owned(), what: what.to_owned() }
}
