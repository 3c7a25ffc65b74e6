//! Break-aways of a motor axis under a voltage that rises slowly, and the friction at rest that they show.
//!
//! A break-away shows friction at rest where the shaft stood, and rides its ratio to the mean there: their quotient does
//! not depend on the place.

use crate::recording::Recording;
use crate::ride::Place;

/// Time for which the shaft has to have rested before, s; time in which it then goes so many counts, s.
const RESTED: f64 = 0.05;
const SOON: f64 = 0.06;
const FEWEST_COUNTS: i64 = 4;
/// Share of the voltage by which it may change in a period, in steps of the converter and in itself.
const SLOWLY: (f64, f64) = (3.0, 0.01);
/// The first edge lies so many times √(2/a) behind the break-away: a place anywhere in its count, in the mean.
const FIRST_EDGE: f64 = 2.0 / 3.0;

/// A break-away, forwards in its recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    /// Count that it left.
    pub counts: i64,
    /// Tick of its first edge.
    tick: usize,
}

/// The break-aways forwards in a recording.
#[must_use]
pub fn slips(recording: &Recording) -> Vec<Slip> {
    let ticks = &recording.ticks;
    let (mut found, mut still) = (Vec::new(), 0);
    let [resting, soon] = [RESTED, SOON].map(|time| recording.samples(time));
    for i in 1..ticks.len() {
        let moved = ticks[i].counts - ticks[i - 1].counts;
        if moved == 0 {
            still += 1;
            continue;
        }
        let rested = std::mem::take(&mut still) >= resting;
        if !rested || moved < 0 {
            continue;
        }
        let most = (SLOWLY.0 * recording.step_volts).max(SLOWLY.1 * ticks[i - 1].volts.abs());
        let slowly = ticks[i - resting..i]
            .windows(2)
            .all(|w| (-0.5 * most..=most).contains(&(w[1].volts - w[0].volts)) && w[1].volts > 0.0);
        let goes = ticks[ticks.len().min(i + soon) - 1].counts - ticks[i - 1].counts >= FEWEST_COUNTS;
        if slowly && goes {
            found.push(Slip { counts: ticks[i - 1].counts, tick: i });
        }
    }
    found
}

impl Slip {
    /// Voltage that broke it away, V, where it slides at `sliding` and K/J is `pull` (rad/s² per volt), and the voltage by which
    /// that is taken to lie below the one at its first edge.
    #[must_use]
    pub fn volts(&self, recording: &Recording, pull: f64, delay: f64, sliding: f64) -> (f64, f64) {
        let r = recording;
        let at_edge = r.ticks[self.tick - 1].volts;
        let a = (pull * (at_edge - sliding) * r.per_rad_s2()).max(1e-4);
        let late = FIRST_EDGE * (2.0 / a).sqrt();
        let time = (self.tick as f64 - late - 0.5 - delay / r.period).max(0.0);
        let i = time as usize;
        let part = time - i as f64;
        // A staircase stands for a ramp.
        let volts = (1.0 - part) * r.volts(i as isize - 1) + part * r.volts(i as isize);
        let rested = r.samples(RESTED);
        let ramp = (at_edge - r.volts(self.tick as isize - 1 - rested as isize)) / rested as f64;
        (volts, ramp * late)
    }

    /// Friction where it rested, over its mean, by a map whose angles rise; none beyond it.
    #[must_use]
    pub fn factor(&self, recording: &Recording, map: &[Place]) -> Option<f64> {
        let angle = (self.counts as f64 + 0.5) * recording.radians_per_count();
        let next = map.partition_point(|place| place.angle < angle);
        let (a, b) = (map.get(next.checked_sub(1)?)?, map.get(next)?);
        let share = (angle - a.angle) / (b.angle - a.angle).max(1e-12);
        Some(a.factor + share * (b.factor - a.factor))
    }
}
