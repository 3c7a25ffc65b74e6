//! A run of the campaign without its troubles: rig, law, path, safe state, line.

/// The rig of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigName {
    /// The paper's.
    Paper,
    /// The stand-in for the experiment: friction a third weaker and uneven, a period of delay.
    Bench,
    /// A geared motor axis with friction.
    Motor,
}

impl RigName {
    /// Each of them.
    pub(super) const ALL: [RigName; 3] = [RigName::Paper, RigName::Bench, RigName::Motor];
}

/// The safe state of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Safe {
    /// Holds, V.
    Hold(f64),
    /// Ramps at a rate (V/s) to a voltage (V).
    Ramp(f64, f64),
    /// Lets go.
    Release,
    /// Holds (V) and lets go after a time (s).
    HoldThenRelease(f64, f64),
}

/// A path from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathKind {
    /// A ramp, °/s.
    Ramp(f64),
    /// From rest to rest in two seconds, with this as its top speed, °/s.
    MinimumJerk(f64),
    /// A ramp with a sine of 2 Hz on it, °/s.
    Sine(f64),
}

impl PathKind {
    /// Its highest speed, °/s.
    #[must_use]
    pub fn top_deg_s(self) -> f64 {
        match self {
            PathKind::Ramp(v) | PathKind::MinimumJerk(v) => v,
            PathKind::Sine(v) => v * (1.0 + SINE_DEG_PER_DEG_S * std::f64::consts::TAU * 2.0),
        }
    }
}

impl PathKind {
    /// Largest acceleration, °/s².
    pub(super) fn steepest_deg_s2(self) -> f64 {
        match self {
            PathKind::Ramp(_) => 0.0,
            // 5.7735 times its distance, by the square of its 2 s.
            PathKind::MinimumJerk(v) => 5.7735 * (v / 1.875 * 2.0) / 4.0,
            PathKind::Sine(v) => v * SINE_DEG_PER_DEG_S * (std::f64::consts::TAU * 2.0).powi(2),
        }
    }

    /// Its lowest speed where troubles begin, °/s.
    #[must_use]
    pub fn slowest_deg_s(self) -> f64 {
        match self {
            PathKind::Ramp(v) => v,
            // At a quarter of its time.
            PathKind::MinimumJerk(v) => 0.56 * v,
            PathKind::Sine(v) => v * (1.0 - SINE_DEG_PER_DEG_S * std::f64::consts::TAU * 2.0),
        }
    }
}

/// Amplitude of a path's sine, ° per °/s of its ramp.
pub(super) const SINE_DEG_PER_DEG_S: f64 = 0.03;

/// A healthy run, but for its troubles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HealthyRun {
    /// Its rig.
    pub rig: RigName,
    /// Its law, by the name in scenarios.
    pub law: &'static str,
    /// Its path.
    pub path: PathKind,
    /// True if `[bounds]` know the plant to 10 % (friction to 20 %) only.
    pub wide: bool,
    /// Its safe state.
    pub safe: Safe,
    /// True if the velocity is the observer's.
    pub observer: bool,
    /// True in single precision.
    pub single: bool,
    /// Periods of delay of the rig.
    pub delay: u32,
    /// The line, one way, ns.
    pub latency_ns: u64,
    /// Periods without an answer that board and supervisor wait.
    pub cycles: u32,
    /// Good samples after one that was refused.
    pub good_samples: u32,
}
