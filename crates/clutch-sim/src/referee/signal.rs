//! A load or a normal force over time: a sum of terms.

use serde::{Deserialize, Serialize};

/// `constant + rate (t − from) + amplitude sin 2π(frequency t + phase)` from a time on, 0 before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Term {
    /// Time from which it acts, s.
    pub from_s: f64,
    /// A constant.
    pub constant: f64,
    /// Rise per second.
    pub rate: f64,
    /// Amplitude of a sine.
    pub amplitude: f64,
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// Its phase at t = 0, turns.
    pub phase_turns: f64,
}

/// A sum of terms.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct Signal(pub Vec<Term>);

impl Signal {
    /// Its value at a time, s.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        let one = |term: &Term| {
            if t < term.from_s {
                return 0.0;
            }
            let turns = term.frequency_hz * t + term.phase_turns;
            term.constant
                + term.rate * (t - term.from_s)
                + term.amplitude * libm::sin(core::f64::consts::TAU * turns)
        };
        self.0.iter().map(one).sum()
    }

    /// The first corner after a time, s.
    #[must_use]
    pub fn corner(&self, after: f64) -> Option<f64> {
        self.0.iter().map(|term| term.from_s).filter(|t| *t > after).min_by(f64::total_cmp)
    }

    /// The highest frequency of its sines, Hz.
    #[must_use]
    pub fn fastest(&self) -> f64 {
        self.0.iter().filter(|t| t.amplitude != 0.0).fold(0.0, |most, t| most.max(t.frequency_hz.abs()))
    }

    /// The most that it bends between two corners, per s²: its lines do not, its sines by the square of their frequency.
    #[must_use]
    pub fn curvature(&self) -> f64 {
        let one = |term: &Term| {
            let w = core::f64::consts::TAU * term.frequency_hz;
            term.amplitude.abs() * w * w
        };
        self.0.iter().map(one).sum()
    }

    /// Its value, if it never changes.
    #[must_use]
    pub fn constant(&self) -> Option<f64> {
        let plain = |t: &Term| t.from_s == 0.0 && t.rate == 0.0 && t.amplitude == 0.0;
        self.0.iter().all(plain).then(|| self.0.iter().map(|t| t.constant).sum())
    }

    /// Its terms, each with all its numbers.
    pub(super) fn told(&self) -> serde_json::Value {
        serde_json::to_value(&self.0).unwrap_or_default()
    }

    /// Its flaw.
    pub(super) fn wrong(&self) -> Option<(&'static str, f64, &'static str)> {
        self.0.iter().find_map(|t| {
            let all = [
                ("constant", t.constant),
                ("rate", t.rate),
                ("amplitude", t.amplitude),
                ("frequency_hz", t.frequency_hz),
                ("phase_turns", t.phase_turns),
            ];
            if !(t.from_s.is_finite() && t.from_s >= 0.0) {
                return Some(("from_s", t.from_s, "a time of at least 0 s"));
            }
            all.iter().find(|(_, x)| !x.is_finite()).map(|(key, x)| (*key, *x, "a finite number"))
        })
    }
}
