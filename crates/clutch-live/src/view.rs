//! A view, and what it is told.

use clutch_log::{Header, Record, Source};
use clutch_loop::live_gains::{Gain, LiveGains};
use clutch_sim::Scenario;
use serde::Serialize;
use std::fmt::Debug;
use std::sync::Arc;
use std::time::Duration;

/// Upper ends of the histogram's classes, µs; the last class has none.
const CLASSES: [u32; 13] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000];

/// A view of the runs that a feed reports. The feed's thread calls it: nothing in it waits for anybody who looks.
pub(crate) trait View: Debug + Send + Sync {
    /// A run begins.
    fn begin(&self, header: &Header, run: &Opening<'_>);
    /// A record, each one.
    fn record(&self, _: &Record) {}
    /// Something has happened.
    fn note(&self, _: &Note) {}
    /// The figures since the last frame.
    fn frame(&self, _: &Frame) {}
    /// Those who look on.
    fn readers(&self) -> usize;
    /// Nothing more comes. Waits until those who look on know, but not for long.
    fn close(&self, at_most: Duration);
}

/// The beginning of a run, as a view hears of it.
#[derive(Serialize)]
pub(crate) struct Opening<'a> {
    pub(crate) scenario: &'a str,
    pub(crate) law: &'a str,
    pub(crate) version: &'a str,
    pub(crate) place: &'a str,
    pub(crate) simulated: bool,
    pub(crate) duration_s: f64,
    pub(crate) period_us: u32,
    pub(crate) settle_s: f64,
    pub(crate) count_deg: f64,
    pub(crate) volts: [f64; 2],
    pub(crate) classes_us: &'static [u32],
    pub(crate) gains: Vec<Gain>,
    /// The gains, if they may be changed.
    #[serde(skip)]
    pub(crate) live_gains: Option<Arc<dyn LiveGains>>,
}

impl<'a> Opening<'a> {
    pub(crate) fn new(
        header: &'a Header,
        scenario: &'a Scenario,
        live_gains: Option<Arc<dyn LiveGains>>,
    ) -> Self {
        let spec = scenario.spec();
        let output = spec.output;
        Opening {
            scenario: &header.scenario_name,
            law: spec.law.title(),
            version: &header.version,
            place: &header.port,
            simulated: header.source == Source::Simulation,
            duration_s: spec.run.duration,
            period_us: header.period_us,
            settle_s: spec.run.settle,
            count_deg: 360.0 / f64::from(spec.rig.encoder.sensor.counts_per_rev),
            volts: [output.lowest, output.highest],
            classes_us: &CLASSES,
            gains: live_gains.as_ref().map(|gains| gains.gains()).unwrap_or_default(),
            live_gains,
        }
    }
}

/// The points of a curve, as spans: at rates up to 1 kHz both ends of a span are the sample.
#[derive(Default, Serialize)]
pub(crate) struct Spans {
    pub(crate) low: Vec<f64>,
    pub(crate) high: Vec<f64>,
}

impl Spans {
    /// A new value, in a new point or in the one that is under way.
    pub(crate) fn take(&mut self, value: f64, new: bool) {
        match (self.low.last_mut(), self.high.last_mut()) {
            (Some(low), Some(high)) if !new => (*low, *high) = (low.min(value), high.max(value)),
            _ => {
                self.low.push(value);
                self.high.push(value);
            }
        }
    }
}

/// A thirtieth of a second of a run.
#[derive(Default, Serialize)]
pub(crate) struct Frame {
    /// Time of each point, s.
    pub(crate) time_s: Vec<f64>,
    pub(crate) target_deg: Vec<f64>,
    pub(crate) position_deg: Spans,
    /// Null where no law was asked.
    pub(crate) error_deg: Spans,
    pub(crate) volts: Spans,
    /// Times at which the encoder fell silent for as long as a stick takes, s.
    pub(crate) sticks_s: Vec<f64>,
    pub(crate) tick: u64,
    pub(crate) state: &'static str,
    pub(crate) cycles: u64,
    pub(crate) cycles_per_s: f64,
    pub(crate) largest_error_deg: f64,
    pub(crate) lost: u64,
    pub(crate) deadline_misses: u64,
    /// Answers by the time they took, by [`CLASSES`]; wake-ups by their lateness.
    pub(crate) answers: Histogram,
    pub(crate) wake_ups: Histogram,
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Histogram(pub(crate) [u64; CLASSES.len() + 1]);

impl Histogram {
    pub(crate) fn take(&mut self, us: u32) {
        let class = CLASSES.partition_point(|end| us >= *end);
        if let Some(count) = self.0.get_mut(class) {
            *count += 1;
        }
    }
}

/// Something that has happened.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct Note {
    pub(crate) time_s: f64,
    pub(crate) text: String,
    /// True if control ended otherwise than it should.
    pub(crate) bad: bool,
    /// The gain that was changed, and its value.
    pub(crate) gain: Option<(String, f64)>,
}
