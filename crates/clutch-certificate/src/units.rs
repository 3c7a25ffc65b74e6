//! The box of one cell in counts, ticks and volts: what the shaft may do in a tick.

use crate::coordinates::P;
use crate::setup::{Ends, Gains, Setup};
use core::f64::consts::TAU;

/// Target positions are whole numbers of 2⁻¹⁶ counts, and their steps those of the path to one such number.
pub(crate) const TARGET_STEP: f64 = 1.001 / 65536.0;
/// Share of a law's rounding, in either scalar, in a voltage, V.
pub(crate) const LAW_ROUNDING: f64 = 1e-4;
/// Share of a law's rounding, in either scalar, in what its integral gains in a tick, V.
pub(crate) const MEMORY_ROUNDING: f64 = 1e-5;
/// Share of a shell's rounding, in either scalar, in `σ`, rad/s.
pub(crate) const SURFACE_ROUNDING: f64 = 2e-5;

/// Accelerations in counts per tick², speeds in counts per tick, voltages in V.
#[derive(Clone, Debug)]
pub(crate) struct Units {
    /// `ω_d`: the path's velocity.
    pub(crate) path: f64,
    /// Drive without brake: `g₁, g₂`.
    pub(crate) drive: Ends,
    /// Brake per volt above Stribeck's speeds: `b₁, b₂`.
    pub(crate) brake: Ends,
    /// The same at all speeds: `b_m, b_s`.
    pub(crate) brake_any: Ends,
    /// `b_m` with the inertia that lets a shaft speed up most.
    pub(crate) brake_leaving: f64,
    /// Volts below which no shaft of the cell is held.
    pub(crate) lets_go: f64,
    /// Volts from which on none speeds up.
    pub(crate) stays: f64,
    /// `ω₁`: Stribeck's speeds end here.
    pub(crate) slow: f64,
    /// A voltage differs from the law's by at most this.
    pub(crate) volts_off: f64,
    /// Voltages at which the output stage ends, as the converter reaches them.
    pub(crate) volts: Ends,
    pub(crate) kappa: f64,
    /// s.
    pub(crate) period: f64,
    /// rad per count.
    pub(crate) count: f64,
    /// rad/s per count and tick.
    pub(crate) speed: f64,
    pub(crate) delay: usize,
    pub(crate) law: Gains,
}

impl Units {
    /// Coordinate of the integral, of a law that remembers one.
    pub(crate) fn memory(&self) -> Option<usize> {
        self.law.remembers().then_some(P + self.delay)
    }
}

impl Units {
    /// The part of a box with these `μ_d`, for a shaft that is no faster than `speed_cap` at samples.
    pub(crate) fn new(s: &Setup, sliding: Ends, speed_cap: f64) -> Units {
        let count = TAU / f64::from(s.counts_per_rev);
        let speed = count / s.period_s;
        let per = s.period_s * s.period_s / count;
        let (j0, j1) = (s.inertia[0], s.inertia[1]);
        let rest = rest_of(s, sliding);
        let strongest = drive_high(s) / j0 * per;
        let slow = s.stribeck[0] * libm::pow(s.slow_exponent(), 1.0 / s.stribeck[1]);
        let left = libm::exp(-s.slow_exponent());
        // A slow part of the curve may lie on either side of the fast one.
        let (low, high) = (
            sliding[0] + left * (rest[0] - sliding[0]).min(0.0),
            sliding[1] + left * (rest[1] - sliding[0]).max(0.0),
        );
        let (weak, strong) = ((1.0 - s.ripple) * s.brake_gain[0], (1.0 + s.ripple) * s.brake_gain[1]);
        let (least, most) = (rest[0].min(sliding[0]) * weak, rest[1].max(sliding[1]) * strong);
        let held = s.drive_torque[0] - s.torque_noise;
        let drag = s.viscous_damping[1] / j0 * s.period_s * (speed_cap + strongest);
        let off = 0.5 * s.converter_step + LAW_ROUNDING;
        Units {
            path: s.rate / speed,
            drive: [held / j1 * per - drag, strongest],
            brake: [low * weak / j1 * per, high * strong / j0 * per],
            brake_any: [least / j1 * per, most / j0 * per],
            brake_leaving: least / j0 * per,
            lets_go: ((held - s.viscous_damping[1] * slow) / most).max(0.0),
            stays: drive_high(s) / least,
            slow: slow / speed,
            volts_off: off,
            volts: s.volts,
            kappa: s.smoothing,
            period: s.period_s,
            count,
            speed,
            delay: s.delay_ticks as usize,
            law: s.law,
        }
    }
}

fn drive_high(s: &Setup) -> f64 {
    s.drive_torque[1] + s.torque_noise
}

/// `μ_s` of the plants of a cell.
fn rest_of(s: &Setup, sliding: Ends) -> Ends {
    let low = if s.rest_not_below_sliding { s.at_rest[0].max(sliding[0]) } else { s.at_rest[0] };
    [low, s.at_rest[1].max(low)]
}
