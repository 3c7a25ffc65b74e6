//! A log as a picture shows it: its sticks, and the window around one.

use crate::build_error::BuildError;
use clutch_core::{Counts, Encoder, StickSlip, StickSlipParams, StickSlipState};
use clutch_log::{CommandRecord, CommandSource, Log};
use clutch_sim::Scenario;
use clutch_sim::picture::{Curves, Stick, Window};
use std::collections::HashMap;

/// The parts of a log that a picture shows closely.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictured {
    /// The stretch around a stick, or the largest error; none where no law answered.
    pub window: Option<Window>,
    /// Times at rest: the shaft's own, of a simulation; of a loop the silences of the encoder.
    pub sticks: Vec<Stick>,
}

/// The sticks of a log, and its window; `scenario` is the log's.
///
/// # Errors
/// A parameter of the encoder out of range.
pub fn pictured(log: &Log, scenario: &Scenario) -> Result<Pictured, BuildError> {
    let spec = scenario.spec();
    let encoder = Encoder::new::<f64>(spec.rig.encoder.sensor.counts_per_rev)?;
    let period: f64 = spec.period.seconds();
    let by_law = |command: &&CommandRecord| command.source == CommandSource::Law as u8;
    let law: Vec<&CommandRecord> = log.commands.iter().filter(by_law).collect();
    let curve = |of: fn(&CommandRecord) -> f64| law.iter().map(|c| of(c)).collect::<Vec<f64>>();
    let time = curve(|c| c.time_ns as f64 / 1e9);
    let end = time.last().map_or(0.0, |t| t + period);
    let sticks = if log.truths.is_empty() {
        let silence = StickSlip::<f64>::new(&StickSlipParams::default(), encoder, spec.period)?;
        let mut state = StickSlipState::default();
        let counts: HashMap<u64, i32> = log.samples.iter().map(|s| (s.tick, s.counts)).collect();
        let silent = law.iter().filter_map(|c| {
            silence.update(&mut state, Counts(*counts.get(&c.tick)?), c.target_velocity);
            Some((c.time_ns, state.stuck()))
        });
        stretches(silent, end)
    } else {
        stretches(log.truths.iter().map(|t| (t.time_ns, t.stuck)), end)
    };
    let curves = Curves {
        time: &time,
        target: &curve(|c| c.target_position),
        target_velocity: &curve(|c| c.target_velocity),
        error: &curve(|c| c.error),
        count: encoder.radians_per_count(),
        settled: time.first().map_or(0.0, |t| t + spec.run.settle),
        end,
    };
    Ok(Pictured { window: Window::chosen(&curves, sticks.clone()), sticks })
}

/// The stretches of samples in which a shaft is at rest.
fn stretches(samples: impl Iterator<Item = (u64, bool)>, end: f64) -> Vec<Stick> {
    let mut found = Vec::new();
    let mut begun = None;
    for (time_ns, stuck) in samples {
        let time = time_ns as f64 / 1e9;
        match (stuck, begun) {
            (true, None) => begun = Some(time),
            (false, Some(from)) => {
                found.push(Stick { from, to: time });
                begun = None;
            }
            _ => {}
        }
    }
    found.extend(begun.map(|from| Stick { from, to: end }));
    found
}
