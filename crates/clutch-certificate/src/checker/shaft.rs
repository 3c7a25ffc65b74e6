//! The shaft of a cell in counts, ticks and volts, each bound on its safe side.

use super::interval::{Interval, at};
use crate::setup::{Cell, Setup};

/// A step of the target may differ from the path's by one of its 2⁻¹⁶ counts.
pub(crate) const TARGET_STEP: f64 = 1.001 / 65536.0;
/// A law's own rounding, in single precision too, V.
pub(crate) const LAW_ROUNDING: f64 = 1e-4;
/// A law's own rounding, in single precision too, of what its integral gains in a tick, V.
pub(crate) const MEMORY_ROUNDING: f64 = 1e-5;
/// A shell's own rounding of `σ`, in single precision too, rad/s.
pub(crate) const SURFACE_ROUNDING: f64 = 2e-5;
/// Share by which a function of the library may be off: its authors promise a hundredth of it.
const LIBRARY: f64 = 1e-13;

/// Bounds of the shaft; a number named after a side is the one that is safe there.
pub(crate) struct Shaft {
    /// rad per count.
    pub(crate) count: Interval,
    /// rad/s per count and tick.
    pub(crate) speed: Interval,
    /// The path's velocity.
    pub(crate) path: Interval,
    /// Least and most acceleration without the brake.
    pub(crate) drives: (Interval, Interval),
    /// Least and most braking per volt, above Stribeck's speeds.
    pub(crate) brakes: (Interval, Interval),
    /// Least and most braking per volt, at any speed.
    pub(crate) brakes_anywhere: (Interval, Interval),
    /// Least braking per volt of a shaft that speeds up most.
    pub(crate) brakes_leaving: Interval,
    /// Below this voltage no shaft is held at Stribeck's speeds.
    pub(crate) lets_go: f64,
    /// From this voltage on no shaft speeds up.
    pub(crate) stays: f64,
    /// Speed at which Stribeck's speeds end.
    pub(crate) slow: Interval,
    /// Most by which a voltage differs from the law's.
    pub(crate) volts_off: Interval,
    /// `K_Kal`.
    pub(crate) kappa: Interval,
    pub(crate) delay: usize,
    /// Most by which a shaft departs from the line through its samples.
    pub(crate) bend: f64,
    cap: f64,
}

impl Shaft {
    pub(crate) fn new(s: &Setup, cell: &Cell) -> Shaft {
        let tau =
            Interval { low: core::f64::consts::TAU.next_down(), high: core::f64::consts::TAU.next_up() };
        let count = tau / at(f64::from(s.counts_per_rev));
        let period = at(s.period_s);
        let speed = count / period;
        // rad/s² to counts per tick².
        let scale = period * period / count;
        let inertia = (at(s.inertia[0]), at(s.inertia[1]));
        let noise = at(s.torque_noise);
        let (weakest_drive, strongest_drive) = (at(s.drive_torque[0]) - noise, at(s.drive_torque[1]) + noise);
        let most_drive = (strongest_drive / inertia.0 * scale).most();

        // Stribeck's speeds end at this exponent of the curve: any speed would do, as long as what is left is bounded there.
        let exponent = at(libm::pow(s.slow_exponent(), 1.0 / s.stribeck[1]));
        let slow_si = (at(s.stribeck[0]) * exponent).most();
        let power = at(libm::pow((slow_si / at(s.stribeck[0])).low, s.stribeck[1])).widened(LIBRARY);
        let left = at(libm::exp(-power.low)).widened(LIBRARY).most();

        let sliding = (at(cell.sliding[0]), at(cell.sliding[1]));
        let least_rest =
            if s.rest_not_below_sliding { s.at_rest[0].max(cell.sliding[0]) } else { s.at_rest[0] };
        let rest = (at(least_rest), at(s.at_rest[1].max(least_rest)));
        let weak = (at(1.0) - at(s.ripple)) * at(s.brake_gain[0]);
        let strong = (at(1.0) + at(s.ripple)) * at(s.brake_gain[1]);
        let least_fast = sliding.0 + left * (rest.0 - sliding.0).min(at(0.0));
        let most_fast = sliding.1 + left * (rest.1 - sliding.0).positive();
        let least_held = (rest.0.min(sliding.0) * weak).least();
        let most_held = (rest.1.max(sliding.1) * strong).most();

        let drag = at(s.viscous_damping[1]) / inertia.0 * period * (at(cell.speed_cap) + most_drive);
        let brakes_anywhere =
            ((least_held / inertia.1 * scale).least(), (most_held / inertia.0 * scale).most());
        let least_drive = (weakest_drive / inertia.1 * scale - drag).least();
        let volts_off = (at(0.5) * at(s.converter_step) + at(LAW_ROUNDING)).most();
        // With a delay the first ticks have what the brake had before.
        let before = if s.delay_ticks > 0 { s.start_volts[1] } else { 0.0 };
        let most_volts = (at(s.volts[1]) + volts_off).max(at(before));
        let most_slowing = brakes_anywhere.1 * most_volts - least_drive;
        Shaft {
            count,
            speed,
            path: at(s.rate) / speed,
            drives: (least_drive, most_drive),
            brakes: (
                (least_fast * weak / inertia.1 * scale).least(),
                (most_fast * strong / inertia.0 * scale).most(),
            ),
            brakes_anywhere,
            brakes_leaving: (least_held / inertia.0 * scale).least(),
            lets_go: ((weakest_drive - at(s.viscous_damping[1]) * slow_si) / most_held).low.max(0.0),
            stays: (strongest_drive / least_held).high,
            slow: slow_si / speed,
            volts_off,
            kappa: at(s.smoothing),
            delay: s.delay_ticks as usize,
            bend: (most_drive.max(most_slowing) / at(8.0)).high,
            cap: cell.speed_cap,
        }
    }

    /// Most counts that go by from one sample to the next.
    pub(crate) fn most_counts(&self) -> Option<u32> {
        let most = (at(self.cap) + self.drives.1 + self.slow).high.ceil();
        (most <= 1e6).then_some(most as u32)
    }
}
