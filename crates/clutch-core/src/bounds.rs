//! Bounds on the plant: intervals instead of numbers, as (23) of the paper.

use crate::friction::FrictionModel;
use crate::params::{Range, Table};
use crate::{ParamError, PlantParams, Real};

crate::params! {
    /// A closed interval.
    #[derive(Default)]
    pub struct Interval<T> {
        /// Lower end.
        low: T, "low" "" NONE, Range::ANY;
        /// Upper end.
        high: T, "high" "" NONE, Range::ANY;
    }
    relations(p) {
        /// A supervisor can work with the lower end.
        LOW_USABLE: low, "a finite number that the parameter may be";
        /// A supervisor can work with the upper end.
        HIGH_USABLE: high, "a finite number that the parameter may be";
    }
}

impl<T: Real> Interval<T> {
    /// `value · (1 ± share)`.
    fn around(value: T, share: T) -> Self {
        let (a, b) = (value * (T::ONE - share), value * (T::ONE + share));
        Interval { low: a.min(b), high: a.max(b) }
    }

    /// `low (1 − share) … high (1 + share)` of an interval of positive numbers.
    fn widened(self, share: T) -> Self {
        Interval { low: self.low * (T::ONE - share), high: self.high * (T::ONE + share) }
    }
}

crate::params! {
    /// Accuracy to which each parameter of the model is known, as a share of its value: 20 % stands for ±20 %. The
    /// defaults say exactly.
    pub struct Tolerances<T>: Default {
        /// ± on the inertia `J`, (23a).
        inertia: T = 0.0, "inertia_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on the driving torque `T_u`, (23b).
        drive_torque: T = 0.0, "drive_torque_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on the viscous damping `C_d`, (23c).
        viscous_damping: T = 0.0, "viscous_damping_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on the brake gain `K_COF`, (23h).
        brake_gain: T = 0.0, "brake_gain_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
        /// ± on the friction, in motion (23d) and at rest (23e).
        friction: T = 0.0, "friction_percent" "" PERCENT, Range::at_least(0.0).below(100.0);
    }
}

crate::params! {
    /// The bounds (23) on the plant.
    pub struct Bounds<T> {}
    nested {
        /// `J_0 … J_1` (23a), kg m².
        inertia: Interval<T>, "inertia_kg_m2";
        /// `(M g R_p)_1 … (M g R_p)_2` (23b), N m.
        drive_torque: Interval<T>, "drive_torque_nm";
        /// Up to `C_d1` (23c), N m s/rad.
        viscous_damping: Interval<T>, "viscous_damping_nm_s_rad";
        /// `K_COF1 … K_COF2` (23h), N m/V.
        brake_gain: Interval<T>, "brake_gain_nm_v";
        /// `|μ|` at rest: of `μ_s` (23e).
        friction_at_rest: Interval<T>, "friction_at_rest";
        /// `|μ|` of a fast shaft: of `μ_d` (23d).
        friction_sliding: Interval<T>, "friction_sliding";
        /// All that `|μ|` can be at any speed.
        friction: Interval<T>, "friction";
    }
}

impl<T: Real> Bounds<T> {
    /// Bounds around a plant. The driving torque must be positive: turn the axis if it is not.
    ///
    /// # Errors
    /// A tolerance negative or so large that its parameter could reach 0; a parameter of the
    /// plant out of range; a driving torque not above 0.
    pub fn around(plant: &PlantParams<T>, tolerance: &Tolerances<T>) -> Result<Self, ParamError<T>> {
        let friction = crate::Plant::new(plant)?;
        let friction = friction.friction();
        tolerance.check_rows()?;
        let t = tolerance;
        PlantParams::DRIVES.require(plant.drive_torque, plant.drive_torque > T::ZERO)?;
        friction.check_divisor()?;
        Ok(Bounds {
            inertia: Interval::around(plant.inertia, t.inertia),
            drive_torque: Interval::around(plant.drive_torque, t.drive_torque),
            viscous_damping: Interval::around(plant.viscous_damping, t.viscous_damping),
            brake_gain: Interval::around(plant.brake_gain, t.brake_gain),
            friction_at_rest: Interval::around(friction.at_rest(), t.friction),
            friction_sliding: Interval::around(friction.sliding(), t.friction),
            friction: friction.envelope().widened(t.friction),
        })
    }

    /// Least brake torque per volt over all corners and speeds, N m/V.
    #[must_use]
    pub fn weakest_brake(&self) -> T {
        self.friction.low * self.brake_gain.low
    }

    /// Greatest brake torque per volt over all corners and speeds, N m/V.
    #[must_use]
    pub fn strongest_brake(&self) -> T {
        self.friction.high * self.brake_gain.high
    }
}
