//! The shaft of a cell in counts, ticks and volts, each bound on its safe side.

use super::interval::{Interval, at};
use crate::setup::{Cell, Motor, Setup};

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
    /// Least and most acceleration at 0 V, above Stribeck's speeds.
    pub(crate) drives: (Interval, Interval),
    /// Least and most acceleration at 0 V, at any speed.
    pub(crate) drives_anywhere: (Interval, Interval),
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
    /// The voltage from which those of a motor are counted downwards; none of a brake.
    counted_from: Option<f64>,
    /// Most by which a shaft departs from the line through its samples.
    pub(crate) bend: f64,
    cap: f64,
}

/// The part of [`Shaft`] that brakes and motors have each in their way.
struct Shape {
    drives: (Interval, Interval),
    drives_anywhere: (Interval, Interval),
    brakes: (Interval, Interval),
    brakes_anywhere: (Interval, Interval),
    brakes_leaving: Interval,
    lets_go: f64,
    stays: f64,
    most_slowing: Interval,
}

/// A motor whose volts are counted downwards from `top`, over a `range`.
struct Turned {
    gain: Interval,
    torque: Interval,
    /// Counts per tick² of a torque.
    per: Interval,
    top: Interval,
    range: Interval,
}

impl Turned {
    /// All accelerations at so many volts of its own.
    fn at(&self, volts: Interval, friction: Interval) -> Interval {
        (self.gain * volts + self.torque - friction) * self.per
    }

    /// Least and most acceleration at the top, and braking per volt counted from there. The most that a shaft may accelerate is
    /// convex in the voltage, whatever torque per volt, load, inertia and friction are, and the least concave: the lines from end to
    /// end lie outside.
    fn lines(&self, friction: Interval) -> ((Interval, Interval), (Interval, Interval)) {
        let (first, last) = (self.at(self.top, friction), self.at(self.top - self.range, friction));
        let per_volt = |first: f64, last: f64| (at(first) - at(last)) / self.range;
        let brakes = (per_volt(first.high, last.high).least(), per_volt(first.low, last.low).most());
        ((first.least(), first.most()), brakes)
    }
}

/// Numbers that brakes and motors have in common, before either is asked.
struct Common<'a> {
    setup: &'a Setup,
    cell: &'a Cell,
    period: Interval,
    speed: Interval,
    /// rad/s² to counts per tick².
    scale: Interval,
    /// Least and most, kg m².
    inertia: (Interval, Interval),
    /// Weakest and strongest, N m.
    drive: (Interval, Interval),
    slow_si: Interval,
    /// Least and most friction of a shaft that slides at any speed, and of one at rest.
    sliding: (Interval, Interval),
    rest: (Interval, Interval),
    /// Least and most friction above Stribeck's speeds.
    fast: (Interval, Interval),
    volts_off: Interval,
}

impl<'a> Common<'a> {
    fn new(s: &'a Setup, cell: &'a Cell, count: Interval) -> Self {
        let period = at(s.period_s);
        let noise = at(s.torque_noise);

        // Stribeck's speeds end at this exponent of the curve: any speed would do, as long as what is left is bounded there.
        let exponent = at(libm::pow(cell.slow_exponent, 1.0 / s.stribeck[1]));
        let slow_si = (at(s.stribeck[0]) * exponent).most();
        let power = at(libm::pow((slow_si / at(s.stribeck[0])).low, s.stribeck[1])).widened(LIBRARY);
        let left = at(libm::exp(-power.low)).widened(LIBRARY).most();

        let sliding = (at(cell.sliding[0]), at(cell.sliding[1]));
        let least_rest =
            if s.rest_not_below_sliding { s.at_rest[0].max(cell.sliding[0]) } else { s.at_rest[0] };
        let rest = (at(least_rest), at(s.at_rest[1].max(least_rest)));
        Self {
            setup: s,
            cell,
            period,
            speed: count / period,
            scale: period * period / count,
            inertia: (at(s.inertia[0]), at(s.inertia[1])),
            drive: (at(s.drive_torque[0]) - noise, at(s.drive_torque[1]) + noise),
            slow_si,
            sliding,
            rest,
            // A little wider than need be, as the search has it: its multipliers are for these.
            fast: (
                sliding.0 + left * (rest.0 - sliding.0).min(at(0.0)),
                sliding.1 + left * (rest.1 - sliding.0).positive(),
            ),
            volts_off: (at(0.5) * at(s.converter_step) + at(LAW_ROUNDING)).most(),
        }
    }

    /// Drag of a shaft that has sped up all the tick.
    fn drag(&self, most_drive: Interval) -> Interval {
        at(self.setup.viscous_damping[1]) / self.inertia.0
            * self.period
            * (at(self.cell.speed_cap) + most_drive)
    }

    fn motor(&self, motor: &Motor) -> Shape {
        let s = self.setup;
        let ripple = Interval { low: 1.0 - s.ripple, high: 1.0 + s.ripple }.widened(LIBRARY);
        let normal = ripple * at(motor.preload);
        let friction =
            |least: Interval, most: Interval| Interval { low: least.low, high: most.high } * normal;
        let held = friction(self.rest.0.min(self.sliding.0), self.rest.1.max(self.sliding.1));
        let from = at(counted_from(s));
        let turn = Turned {
            gain: Interval { low: motor.gain[0], high: motor.gain[1] },
            torque: Interval { low: self.drive.0.low, high: self.drive.1.high },
            per: self.scale / Interval { low: s.inertia[0], high: s.inertia[1] },
            top: from,
            range: (from - (at(s.volts[0]) - self.volts_off).min(at(s.start_volts[0]))).most(),
        };
        let ((least, most), brakes) = turn.lines(friction(self.fast.0, self.fast.1));
        let ((least_anywhere, most_anywhere), brakes_anywhere) = turn.lines(held);
        let drag = self.drag(most.max(most_anywhere).positive());
        // Volts at which a shaft that friction holds just goes, and just stays.
        let goes = (held + at(s.viscous_damping[1]) * self.slow_si - turn.torque) / turn.gain;
        let stays = (held - turn.torque) / turn.gain;
        let drives_anywhere = ((least_anywhere - drag).least(), most_anywhere);
        Shape {
            drives: ((least - drag).least(), most),
            drives_anywhere,
            brakes,
            brakes_anywhere,
            brakes_leaving: (at(turn.gain.low) / self.inertia.0 * self.scale).least(),
            lets_go: (turn.top - goes).low,
            stays: (turn.top - stays).high,
            most_slowing: brakes_anywhere.1 * turn.range - drives_anywhere.0,
        }
    }

    fn brake(&self) -> Shape {
        let (s, scale, inertia) = (self.setup, self.scale, self.inertia);
        let weak = (at(1.0) - at(s.ripple)) * at(s.brake_gain[0]);
        let strong = (at(1.0) + at(s.ripple)) * at(s.brake_gain[1]);
        let least_held = (self.rest.0.min(self.sliding.0) * weak).least();
        let most_held = (self.rest.1.max(self.sliding.1) * strong).most();
        let brakes_anywhere =
            ((least_held / inertia.1 * scale).least(), (most_held / inertia.0 * scale).most());
        let most_drive = (self.drive.1 / inertia.0 * scale).most();
        let least_drive = (self.drive.0 / inertia.1 * scale - self.drag(most_drive)).least();
        // With a delay the first ticks have what the brake had before.
        let before = if s.delay_ticks > 0 { s.start_volts[1] } else { 0.0 };
        let most_volts = (at(s.volts[1]) + self.volts_off).max(at(before));
        Shape {
            drives: (least_drive, most_drive),
            drives_anywhere: (least_drive, most_drive),
            brakes: (
                (self.fast.0 * weak / inertia.1 * scale).least(),
                (self.fast.1 * strong / inertia.0 * scale).most(),
            ),
            brakes_anywhere,
            brakes_leaving: (least_held / inertia.0 * scale).least(),
            lets_go: ((self.drive.0 - at(s.viscous_damping[1]) * self.slow_si) / most_held).low,
            stays: (self.drive.1 / least_held).high,
            most_slowing: brakes_anywhere.1 * most_volts - least_drive,
        }
    }
}

/// Voltage from which a motor's are counted downwards, V: the whole number from the highest on, and one more for what converter
/// and law round. Multipliers that speak of volts counted from another prove nothing here.
pub(crate) fn counted_from(s: &Setup) -> f64 {
    let [highest, before] = [s.volts[1], s.start_volts[1]];
    (if before > highest { before } else { highest }).ceil() + 1.0
}

impl Shaft {
    pub(crate) fn new(s: &Setup, cell: &Cell) -> Shaft {
        let tau =
            Interval { low: core::f64::consts::TAU.next_down(), high: core::f64::consts::TAU.next_up() };
        let count = tau / at(f64::from(s.counts_per_rev));
        let common = Common::new(s, cell, count);
        let shape = match &s.motor {
            Some(motor) => common.motor(motor),
            None => common.brake(),
        };
        Shaft {
            count,
            speed: common.speed,
            path: at(s.rate) / common.speed,
            drives: shape.drives,
            drives_anywhere: shape.drives_anywhere,
            brakes: shape.brakes,
            brakes_anywhere: shape.brakes_anywhere,
            brakes_leaving: shape.brakes_leaving,
            lets_go: shape.lets_go.max(0.0),
            stays: shape.stays,
            slow: common.slow_si / common.speed,
            volts_off: common.volts_off,
            kappa: at(s.smoothing),
            delay: s.delay_ticks as usize,
            counted_from: s.motor.map(|_| counted_from(s)),
            bend: (shape.drives.1.max(shape.drives_anywhere.1).max(shape.most_slowing) / at(8.0)).high,
            cap: cell.speed_cap,
        }
    }

    /// A voltage as the set counts it.
    pub(crate) fn counted(&self, volts: f64) -> Interval {
        self.counted_from.map_or(at(volts), |from| at(from) - at(volts))
    }

    /// Two voltages as the set counts them, the lower first.
    pub(crate) fn ends(&self, [low, high]: [f64; 2]) -> [Interval; 2] {
        let (low, high) = (self.counted(low), self.counted(high));
        if self.counted_from.is_some() { [high, low] } else { [low, high] }
    }

    /// Most counts that go by from one sample to the next.
    pub(crate) fn most_counts(&self) -> Option<u32> {
        let most = (at(self.cap) + self.drives.1.max(self.drives_anywhere.1) + self.slow).high.ceil();
        (most <= 1e6).then_some(most as u32)
    }
}
