//! Parameters as people are shown them.

use crate::report::{Finding, Report};
use clutch_core::params::{MS, PER_S, PERCENT, RAD_S2, V};

/// A parameter that recordings may tell.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Key in files and JSON, SI.
    pub key: &'static str,
    /// Name for readers.
    pub label: &'static str,
    /// Unit for readers; empty for a plain number.
    pub unit: &'static str,
    /// Factor from SI to that unit.
    pub factor: f64,
    of: fn(&Report) -> &Finding,
}

impl Row {
    /// The finding on it.
    #[must_use]
    pub fn finding<'a>(&self, report: &'a Report) -> &'a Finding {
        (self.of)(report)
    }
}

const fn row(
    key: &'static str,
    label: &'static str,
    (unit, factor): (&'static str, f64),
    of: fn(&Report) -> &Finding,
) -> Row {
    Row { key, label, unit, factor, of }
}

/// The parameters, in the order in which they are shown.
pub const ROWS: [Row; 9] = [
    row("pull_rad_s2", "T/J", (RAD_S2.text, 1.0), |r| &r.pull),
    row("delay_s", "delay, dead time and lag", (MS.text, 1e3), |r| &r.delay),
    row("hold_v", "v_hold = T/(μ_d K)", (V.text, 1.0), |r| &r.hold),
    row("ripple_rms", "ripple, rms", (PERCENT.text, 100.0), |r| &r.ripple),
    row("ratio", "μ_s/μ_d", ("", 1.0), |r| &r.ratio),
    row("stribeck_velocity_rad_s", "Stribeck velocity", ("mrad/s", 1e3), |r| &r.stribeck),
    row("damping_1_s", "C/J", (PER_S.text, 1.0), |r| &r.damping),
    row("lag_s", "lag", (MS.text, 1e3), |r| &r.lag),
    row("each", "J, T, K, μ one by one", ("", 1.0), |r| &r.each),
];
