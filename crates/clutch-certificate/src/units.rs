//! The box of one cell in counts, ticks and volts: what the shaft may do in a tick.

use crate::coordinates::P;
use crate::setup::{Ends, Gains, Motor, Setup};
use core::f64::consts::TAU;

/// Target positions are whole numbers of 2⁻¹⁶ counts, and their steps those of the path to one such number.
pub(crate) const TARGET_STEP: f64 = 1.001 / 65536.0;
/// Share of a law's rounding, in either scalar, in a voltage, V.
pub(crate) const LAW_ROUNDING: f64 = 1e-4;
/// Share of a law's rounding, in either scalar, in what its integral gains in a tick, V.
pub(crate) const MEMORY_ROUNDING: f64 = 1e-5;
/// Share of a shell's rounding, in either scalar, in `σ`, rad/s.
pub(crate) const SURFACE_ROUNDING: f64 = 2e-5;

/// Accelerations in counts per tick², speeds in counts per tick, voltages in V. Those of a motor are counted down from a
/// voltage above them all, so that it looks like a brake: more of them slow the shaft down.
#[derive(Clone, Debug)]
pub(crate) struct Units {
    /// `ω_d`: the path's velocity.
    pub(crate) path: f64,
    /// Acceleration at a voltage of 0, above Stribeck's speeds: `g₁, g₂`. With a brake what drives.
    pub(crate) drive: Ends,
    /// The same at all speeds.
    pub(crate) drive_any: Ends,
    /// Slowing per volt above Stribeck's speeds: `b₁, b₂`.
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
    /// The largest voltage that there is.
    pub(crate) most_volts: f64,
    /// Voltages before the first tick.
    pub(crate) start_volts: Ends,
    pub(crate) kappa: f64,
    /// s.
    pub(crate) period: f64,
    /// rad per count.
    pub(crate) count: f64,
    /// rad/s per count and tick.
    pub(crate) speed: f64,
    pub(crate) delay: usize,
    /// The law in these voltages.
    pub(crate) law: Gains,
}

impl Units {
    /// Coordinate of the integral, of a law that remembers one.
    pub(crate) fn memory(&self) -> Option<usize> {
        self.law.remembers().then_some(P + self.delay)
    }
}

impl Units {
    /// The part of a box with these `μ_d`, for a shaft that is no faster than `speed_cap` at samples, and whose slow speeds end at
    /// this exponent.
    pub(crate) fn new(s: &Setup, sliding: Ends, slow_exponent: f64, speed_cap: f64) -> Units {
        let count = TAU / f64::from(s.counts_per_rev);
        let speed = count / s.period_s;
        let per = s.period_s * s.period_s / count;
        let (j0, j1) = (s.inertia[0], s.inertia[1]);
        let rest = rest_of(s, sliding);
        let slow = s.stribeck[0] * libm::pow(slow_exponent, 1.0 / s.stribeck[1]);
        let left = libm::exp(-slow_exponent);
        // A slow part of the curve may lie on either side of the fast one.
        let (low, high) = (
            sliding[0] + left * (rest[0] - sliding[0]).min(0.0),
            sliding[1] + left * (rest[1] - sliding[0]).max(0.0),
        );
        let off = 0.5 * s.converter_step + LAW_ROUNDING;
        let drag = s.viscous_damping[1] / j0 * s.period_s;
        let common = Units {
            path: s.rate / speed,
            drive: [0.0; 2],
            drive_any: [0.0; 2],
            brake: [0.0; 2],
            brake_any: [0.0; 2],
            brake_leaving: 0.0,
            lets_go: 0.0,
            stays: 0.0,
            slow: slow / speed,
            volts_off: off,
            volts: s.volts,
            most_volts: s.volts[1] + off,
            start_volts: s.start_volts,
            kappa: s.smoothing,
            period: s.period_s,
            count,
            speed,
            delay: s.delay_ticks as usize,
            law: s.law,
        };
        let held = s.drive_torque[0] - s.torque_noise;
        let (fast, any) = ([low, high], [rest[0].min(sliding[0]), rest[1].max(sliding[1])]);
        if let Some(motor) = s.motor {
            return common.motor(s, &motor, (fast, any), (per, drag, speed_cap, slow));
        }
        let (weak, strong) = ((1.0 - s.ripple) * s.brake_gain[0], (1.0 + s.ripple) * s.brake_gain[1]);
        let (least, most) = (any[0] * weak, any[1] * strong);
        let strongest = drive_high(s) / j0 * per;
        let drive = [held / j1 * per - drag * (speed_cap + strongest), strongest];
        Units {
            drive,
            drive_any: drive,
            brake: [low * weak / j1 * per, high * strong / j0 * per],
            brake_any: [least / j1 * per, most / j0 * per],
            brake_leaving: least / j0 * per,
            lets_go: ((held - s.viscous_damping[1] * slow) / most).max(0.0),
            stays: drive_high(s) / least,
            ..common
        }
    }

    /// The same of a motor. `μ` is that of a fast shaft and that at any speed.
    ///
    /// At each voltage the acceleration lies between those with the worst torque per volt, inertia, load and friction. The largest is a
    /// convex function of the voltage and the least a concave one, so that straight lines between their ends hold them.
    fn motor(
        self,
        s: &Setup,
        motor: &Motor,
        (fast, any): (Ends, Ends),
        (per, drag, speed_cap, slow): (f64, f64, f64, f64),
    ) -> Units {
        let from = s.counted_from();
        let down = |[low, high]: Ends| [from - high, from - low];
        let range = from - (s.volts[0] - self.volts_off).min(s.start_volts[0]);
        let torque = [s.drive_torque[0] - s.torque_noise, drive_high(s)];
        let rough = |[low, high]: Ends| {
            [low * (1.0 - s.ripple), high * (1.0 + s.ripple)].map(|mu| mu * motor.preload)
        };
        let (fast, any) = (rough(fast), rough(any));
        let [j0, j1] = s.inertia;
        let [k0, k1] = motor.gain;
        // Least and most acceleration at so many volts.
        let at = |volts: f64, friction: Ends| {
            let [least, most] = if volts < 0.0 { [k1, k0] } else { [k0, k1] };
            let low = least * volts + torque[0] - friction[1];
            let high = most * volts + torque[1] - friction[0];
            [if low > 0.0 { low / j1 } else { low / j0 }, if high > 0.0 { high / j0 } else { high / j1 }]
                .map(|a| a * per)
        };
        let lines = |friction: Ends| {
            let (top, bottom) = (at(from, friction), at(from - range, friction));
            (top, [(top[1] - bottom[1]) / range, (top[0] - bottom[0]) / range])
        };
        let (drive, brake) = lines(fast);
        let (drive_any, brake_any) = lines(any);
        let drag = drag * (speed_cap + drive[1].max(drive_any[1]).max(0.0));
        let slower = |[low, high]: Ends| [low - drag, high];
        let volts =
            |torque: f64, [positive, negative]: Ends| torque / if torque > 0.0 { positive } else { negative };
        let lets_go = any[1] + s.viscous_damping[1] * slow - torque[0];
        let law = match self.law {
            Gains::Linear { kp, kd, forward } => Gains::Linear { kp, kd, forward: from - forward },
            Gains::Integral { kp, ki, kd, forward, tracking, limits } => {
                Gains::Integral { kp, ki, kd, forward: from - forward, tracking, limits: down(limits) }
            }
            other => other,
        };
        Units {
            drive: slower(drive),
            drive_any: slower(drive_any),
            brake,
            brake_any,
            brake_leaving: k0 / j0 * per,
            lets_go: (from - volts(lets_go, [k0, k1])).max(0.0),
            stays: from - volts(any[0] - torque[1], [k1, k0]),
            volts: down(s.volts),
            most_volts: range,
            start_volts: down(s.start_volts),
            law,
            ..self
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
