//! Parameters as people are shown them.

use crate::motor;
use crate::report::{Finding, Report};
use clutch_core::params::{MRAD_S, MS, NONE, PER_S, PERCENT, RAD_S2, Unit, V, V_S_RAD, V_S2_RAD};

/// A parameter that recordings may determine, in a report of that kind.
#[derive(Clone, Copy, Debug)]
pub struct Row<R> {
    /// Key in files and JSON, SI.
    pub key: &'static str,
    /// Name for readers.
    pub label: &'static str,
    /// Unit for readers; empty for a plain number.
    pub unit: &'static str,
    /// Factor from SI to that unit.
    pub factor: f64,
    of: fn(&R) -> &Finding,
}

impl<R> Row<R> {
    /// The finding on it.
    #[must_use]
    pub fn finding<'a>(&self, report: &'a R) -> &'a Finding {
        (self.of)(report)
    }
}

const fn row<R>(key: &'static str, label: &'static str, unit: &Unit, of: fn(&R) -> &Finding) -> Row<R> {
    Row { key, label, unit: unit.text, factor: unit.factor(), of }
}

/// The parameters of a braked shaft, in the order in which they are shown.
pub const ROWS: [Row<Report>; 9] = [
    row("pull_rad_s2", "T/J", &RAD_S2, |r| &r.pull),
    row("delay_s", "delay, dead time and lag", &MS, |r| &r.delay),
    row("hold_v", "v_hold = T/(μ_d K)", &V, |r| &r.hold),
    row("ripple_rms", "ripple, rms", &PERCENT, |r| &r.ripple),
    row("ratio", "μ_s/μ_d", &NONE, |r| &r.ratio),
    row("stribeck_velocity_rad_s", "Stribeck velocity", &MRAD_S, |r| &r.stribeck),
    row("damping_1_s", "C/J", &PER_S, |r| &r.damping),
    row("lag_s", "lag", &MS, |r| &r.lag),
    row("each", "J, T, K, μ one by one", &NONE, |r| &r.each),
];

/// The same of a motor axis, torques in volts.
pub const MOTOR_ROWS: [Row<motor::Report>; 12] = [
    row("break_forwards_v", "T_s/K forwards", &V, |r| &r.at_rest[0]),
    row("break_backwards_v", "T_s/K backwards", &V, |r| &r.at_rest[1]),
    row("slide_forwards_v", "T_c/K forwards", &V, |r| &r.sliding[0]),
    row("slide_backwards_v", "T_c/K backwards", &V, |r| &r.sliding[1]),
    row("load_v", "load T/K", &V, |r| &r.load),
    row("viscous_v_s_rad", "C/K", &V_S_RAD, |r| &r.viscous),
    row("stribeck_velocity_rad_s", "Stribeck velocity", &MRAD_S, |r| &r.stribeck),
    row("inertia_v_s2_rad", "J/K", &V_S2_RAD, |r| &r.inertia),
    row("delay_s", "delay, dead time and lag", &MS, |r| &r.delay),
    row("ripple_rms", "ripple, rms", &PERCENT, |r| &r.ripple),
    row("lag_s", "lag", &MS, |r| &r.lag),
    row("each", "K, J, friction, load one by one", &NONE, |r| &r.each),
];
