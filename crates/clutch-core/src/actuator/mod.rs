//! Actuators: the effect of a voltage on the shaft.
//!
//! ```text
//! J θ̈ = T_drive + T(u) − μ(θ̇) N(u) − C_d θ̇,     at rest while |T_drive + T(u)| ≤ μ_s N(u)
//! ```
//!
//! | actuator | torque `T(u)` | normal force `N(u)`, as torque per unit of μ |
//! |---|---|---|
//! | brake | 0 | `N_0 + K_COF max(u, 0)` |
//! | motor | `k_t u` | `N_0 + λ abs(k_t u)` |
//! | both | `k_t max(−u, 0)` | `N_0 + K_COF max(u, 0)` |
//!
//! A voltage above 0 resists with a brake and with both, and drives forwards with a motor. “A brake can only resist” is
//! not a rule of its own: it follows from the interval of torque that an actuator can give at a velocity, its authority
//! ([`Bounds::authority`](crate::Bounds::authority), and its part that drives, [`Bounds::drives`](crate::Bounds::drives)). The
//! check of a path asks for it. The certificate asks for its two ends per volt, as gains are compared with them; the supervisor's
//! envelope has it in counts, computed once, as each period needs it anew ([`Bounds::possible`](crate::Bounds::possible) is what it is held to).
//! A torque becomes volts in one place, [`Actuator::volts_for`]; the laws that the paper prints in volts stay in volts.

mod geometry;

pub use geometry::BrakeGeometry;

use crate::params::{Range, Table};
use crate::{Arithmetic, Each, ParamError, Real};

crate::params! {
    /// A brake: a voltage above 0 V presses a pad on a disc. It resists a motion and makes none.
    pub struct BrakeActuator<T>: Default {
        /// Brake torque per volt and unit of μ, (18).
        gain: T = 0.14, "gain_nm_v" "K_COF" NM_V, Range::above(0.0);
        /// Normal force without a voltage, as torque per unit of μ: a disc that drags.
        preload: T = 0.0, "preload_nm" "N_0" NM, Range::at_least(0.0);
    }
}

crate::params! {
    /// A motor, with the gear and the bearings behind it: a voltage of either sign drives the shaft that way. Its
    /// friction is that of a constant normal force and of a share of the load.
    pub struct MotorActuator<T> {
        /// Torque per volt.
        gain: T, "gain_nm_v" "k_t" NM_V, Range::above(0.0);
        /// Normal force, as torque per unit of μ.
        preload: T, "preload_nm" "N_0" NM, Range::at_least(0.0);
        /// Share of the motor's torque that presses, too: friction that grows with the load, as a gear's.
        load_share: T = 0.0, "load_share" "λ" NONE, Range::at_least(0.0);
    }
    relations(p) {
        /// More voltage gives more torque.
        DRIVES_ITSELF: load_share, "a share below 1/μ of rig.friction and model.friction: at or above it the motor jams in its own friction";
    }
}

crate::params! {
    /// A brake and a motor on one signal: a voltage above 0 V presses the pad, one below 0 V drives the shaft forwards.
    pub struct BothActuator<T> {
        /// Brake torque per volt above 0 V and unit of μ.
        brake_gain: T, "brake_gain_nm_v" "K_COF" NM_V, Range::above(0.0);
        /// Torque per volt below 0 V.
        motor_gain: T, "motor_gain_nm_v" "k_t" NM_V, Range::above(0.0);
        /// Normal force without a voltage, as torque per unit of μ.
        preload: T = 0.0, "preload_nm" "N_0" NM, Range::at_least(0.0);
    }
}

crate::choice! {
    /// Actuator: the effect of a voltage on the shaft.
    pub enum ActuatorParams<T>: Default {
        /// A brake.
        Brake(BrakeActuator<T>) = "brake",
        /// A brake whose gain follows from its geometry.
        Geometry(BrakeGeometry<T>) = "geometry",
        /// A motor.
        Motor(MotorActuator<T>) = "motor",
        /// A brake and a motor on one signal.
        Both(BothActuator<T>) = "both",
    }
}

impl<T> From<BrakeActuator<T>> for ActuatorParams<T> {
    fn from(p: BrakeActuator<T>) -> Self {
        ActuatorParams::Brake(p)
    }
}

impl<T> From<MotorActuator<T>> for ActuatorParams<T> {
    fn from(p: MotorActuator<T>) -> Self {
        ActuatorParams::Motor(p)
    }
}

impl<T> From<BothActuator<T>> for ActuatorParams<T> {
    fn from(p: BothActuator<T>) -> Self {
        ActuatorParams::Both(p)
    }
}

impl<T: Real> ActuatorParams<T> {
    /// A brake of a gain, N m/V per unit of μ, that lets go at 0 V.
    #[must_use]
    pub const fn brake(gain: T) -> Self {
        ActuatorParams::Brake(BrakeActuator { gain, preload: T::ZERO })
    }

    /// Its kind.
    #[must_use]
    pub const fn kind(&self) -> ActuatorKind {
        match self {
            ActuatorParams::Brake(_) | ActuatorParams::Geometry(_) => ActuatorKind::Brake,
            ActuatorParams::Motor(_) => ActuatorKind::Motor,
            ActuatorParams::Both(_) => ActuatorKind::Both,
        }
    }
}

crate::words! {
    /// Kind of an actuator.
    pub enum ActuatorKind {
        /// It resists.
        Brake = "brake" default,
        /// It drives either way.
        Motor = "motor",
        /// It resists, and drives forwards.
        Both = "both",
    }
}

impl ActuatorKind {
    /// `true` if a voltage above 0 drives the shaft forwards; else it resists. Laws that ask for more or less braking
    /// turn their sign round for such an actuator.
    #[must_use]
    pub const fn drives_above_0(self) -> bool {
        matches!(self, ActuatorKind::Motor)
    }

    /// `true` if a voltage below 0 does something.
    #[must_use]
    pub const fn two_sided(self) -> bool {
        !matches!(self, ActuatorKind::Brake)
    }

    /// `true` if a voltage drives the shaft, either way.
    #[must_use]
    pub fn drives_at<T: Real>(self, volts: T) -> bool {
        (volts > T::ZERO && self.drives_above_0()) || (volts < T::ZERO && self.two_sided())
    }

    /// Most volts of an output against a motion forwards, and most with it; of a brake the second do nothing.
    #[must_use]
    pub(crate) fn most_volts<T: Real>(self, lowest: T, highest: T) -> [T; 2] {
        if self.drives_above_0() { [-lowest, highest] } else { [highest, -lowest] }
    }
}

/// An actuator, checked.
///
/// ```
/// use clutch_core::{Actuator, ActuatorParams, MotorActuator};
/// let motor = MotorActuator { gain: 0.05, preload: 0.3, load_share: 0.0 };
/// let motor = Actuator::<f64>::new(&ActuatorParams::Motor(motor))?;
/// assert_eq!(motor.torque(-2.0), -0.1);
/// assert_eq!(motor.friction(0.2, -2.0), 0.06);
/// # Ok::<(), clutch_core::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Actuator<T> {
    kind: ActuatorKind,
    /// N m/V per unit of μ, above 0 V.
    brake: T,
    /// Torque per volt above 0, and below it, N m/V.
    above: T,
    below: T,
    preload: T,
    share: T,
}

impl<T: Real> Actuator<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &ActuatorParams<T>) -> Result<Self, ParamError<T>> {
        let kind = p.kind();
        let zero = T::ZERO;
        Ok(match p {
            ActuatorParams::Brake(p) => {
                p.check_rows()?;
                Actuator { kind, brake: p.gain, above: zero, below: zero, preload: p.preload, share: zero }
            }
            ActuatorParams::Geometry(p) => {
                let brake = p.brake_gain()?;
                Actuator { kind, brake, above: zero, below: zero, preload: zero, share: zero }
            }
            ActuatorParams::Motor(p) => {
                p.check_rows()?;
                let (above, below) = (p.gain, p.gain);
                Actuator { kind, brake: zero, above, below, preload: p.preload, share: p.load_share }
            }
            ActuatorParams::Both(p) => {
                p.check_rows()?;
                let (above, below) = (zero, -p.motor_gain);
                Actuator { kind, brake: p.brake_gain, above, below, preload: p.preload, share: zero }
            }
        })
    }
}

impl<T: Arithmetic> Actuator<T> {
    /// The actuators of several lanes as one; none if they are not of one kind.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Option<Actuator<L>> {
        let of_kind = |kind: ActuatorKind| {
            L::all(L::ONE.less_or_equal(each(&|a| if a.kind == kind { T::ONE } else { T::ZERO })))
        };
        let kind = ActuatorKind::ALL.iter().copied().find(|kind| of_kind(*kind))?;
        Some(Actuator {
            kind,
            brake: each(&|a| a.brake),
            above: each(&|a| a.above),
            below: each(&|a| a.below),
            preload: each(&|a| a.preload),
            share: each(&|a| a.share),
        })
    }

    /// Parameters of such an actuator; of a geometry, those of the brake that it gives.
    #[must_use]
    pub fn params(&self) -> ActuatorParams<T> {
        let Actuator { brake, above, below, preload, share, .. } = *self;
        match self.kind {
            ActuatorKind::Brake => ActuatorParams::Brake(BrakeActuator { gain: brake, preload }),
            ActuatorKind::Motor => {
                ActuatorParams::Motor(MotorActuator { gain: above, preload, load_share: share })
            }
            ActuatorKind::Both => {
                ActuatorParams::Both(BothActuator { brake_gain: brake, motor_gain: -below, preload })
            }
        }
    }

    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> ActuatorKind {
        self.kind
    }

    /// `K_COF`: brake torque per volt above 0 V and unit of μ, N m/V; 0 for a motor.
    #[inline]
    #[must_use]
    pub fn brake_gain(&self) -> T {
        self.brake
    }

    /// `k_t`: torque per volt of what drives, N m/V; 0 for a brake.
    #[must_use]
    pub fn motor_gain(&self) -> T {
        self.below.abs()
    }

    /// `N_0`: normal force without a voltage, as torque per unit of μ, N m.
    #[must_use]
    pub fn preload(&self) -> T {
        self.preload
    }

    /// `λ`: share of the motor's torque that presses, too.
    #[must_use]
    pub fn load_share(&self) -> T {
        self.share
    }

    /// `T(u)`: torque that drives the shaft, N m.
    // Always, where lanes call it: a vector's instructions do not pass a call. For boards the compiler chooses.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    #[must_use]
    pub fn torque(&self, volts: T) -> T {
        self.above * volts.max(T::ZERO) + self.below * volts.min(T::ZERO)
    }

    /// `N(u)`: normal force, as torque per unit of μ, N m.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    #[must_use]
    pub fn normal(&self, volts: T) -> T {
        self.brake * volts.max(T::ZERO) + (self.preload + self.share * self.torque(volts).abs())
    }

    /// `μ N(u)`: torque of friction, N m.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    #[must_use]
    pub fn friction(&self, mu: T, volts: T) -> T {
        // In this order a brake without preload has the bits of the product.
        mu * self.brake * volts.max(T::ZERO) + mu * (self.preload + self.share * self.torque(volts).abs())
    }

    /// The way, 1 or −1 or 0, that friction is counted against where a path goes with a velocity: the path's with what drives
    /// both ways; the others are for a shaft that is driven forwards.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    #[must_use]
    pub fn way(&self, target_velocity: T) -> T {
        match self.kind {
            ActuatorKind::Motor => target_velocity.sgn(),
            ActuatorKind::Brake | ActuatorKind::Both => T::ONE,
        }
    }

    /// The voltage at which torque and friction of a shaft that moves in a direction (`way`: 1 or −1, or 0 for none) with
    /// a coefficient `mu` add up to `torque`, V. No limits; where an actuator cannot give the torque, as a brake one
    /// that drives, the voltage is one at which it gives the least.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    #[must_use]
    pub fn volts_for(&self, torque: T, mu: T, way: T) -> T {
        let resists = -(way * torque) - mu * self.preload;
        match self.kind {
            ActuatorKind::Brake => resists / (mu * self.brake),
            ActuatorKind::Motor => {
                let needed = torque + way * mu * self.preload;
                // Friction of the load is for the motion where torque and motion differ in sign.
                needed / (self.above * (T::ONE - mu * self.share * way * needed.sgn()))
            }
            ActuatorKind::Both => {
                let drives = resists.less(T::ZERO);
                let volts = resists / T::select(drives, -self.below, mu * self.brake);
                // An actuator that drives, drives forwards.
                T::select(drives & way.less(T::ZERO), T::ZERO, volts)
            }
        }
    }
}

impl<T: Real> Actuator<T> {
    /// Checks that more voltage gives more torque with coefficients up to `mu`.
    ///
    /// # Errors
    /// The share of the load that presses.
    pub fn check_share(&self, mu: T) -> Result<(), ParamError<T>> {
        MotorActuator::DRIVES_ITSELF.require(self.share, self.share * mu < T::ONE)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn motor(load_share: f64) -> Actuator<f64> {
        let p = MotorActuator { gain: 0.05, preload: 0.3, load_share };
        Actuator::new(&p.into()).unwrap()
    }

    fn both() -> Actuator<f64> {
        let p = BothActuator { brake_gain: 0.14, motor_gain: 0.02, preload: 0.01 };
        Actuator::new(&p.into()).unwrap()
    }

    #[test]
    fn a_brake_makes_no_torque_and_a_negative_voltage_presses_no_pad() {
        let brake = Actuator::<f64>::new(&ActuatorParams::brake(0.14)).unwrap();
        assert_eq!((brake.torque(5.0), brake.torque(-5.0)), (0.0, 0.0));
        assert_eq!((brake.normal(2.0), brake.normal(-2.0)), (0.28, 0.0));
        assert_eq!(brake.friction(0.2, 2.0), 0.2 * 0.14 * 2.0);
    }

    #[test]
    fn a_motor_drives_either_way_and_its_gear_rubs_with_the_load() {
        let gear = motor(0.4);
        assert_eq!((gear.torque(2.0), gear.torque(-2.0)), (0.1, -0.1));
        assert!((gear.normal(-2.0) - 0.34).abs() < 1e-15);
    }

    #[test]
    fn both_brakes_above_0_volts_and_drives_forwards_below() {
        let both = both();
        assert_eq!((both.torque(3.0), both.torque(-3.0)), (0.0, 0.06));
        assert!((both.normal(3.0) - 0.43).abs() < 1e-15);
        assert_eq!(both.normal(-3.0), 0.01);
    }

    #[test]
    fn parameters_come_back_and_each_bad_one_is_named() {
        for a in [motor(0.4), both(), Actuator::new(&ActuatorParams::default()).unwrap()] {
            assert_eq!(Actuator::new(&a.params()).unwrap(), a);
        }
        let bad = MotorActuator { gain: 0.0, preload: 0.1, load_share: 0.0 };
        assert_eq!(Actuator::<f64>::new(&bad.into()).unwrap_err().field(), "gain");
        let bad = MotorActuator { gain: 0.1, preload: -0.1, load_share: 0.0 };
        assert_eq!(Actuator::<f64>::new(&bad.into()).unwrap_err().field(), "preload");
        assert_eq!(motor(5.0).check_share(0.2).unwrap_err().field(), "load_share");
        assert!(motor(4.9).check_share(0.2).is_ok());
    }

    proptest! {
        #[test]
        fn the_voltage_for_a_torque_gives_that_torque(
            torque in -0.5_f64..0.5, mu in 0.05_f64..0.5, share in 0.0_f64..1.5, forward in any::<bool>()
        ) {
            let way = if forward { 1.0 } else { -1.0 };
            for a in [motor(share), both()] {
                // An actuator that resists and drives forwards is for a shaft that goes forwards.
                let way = if a.kind() == ActuatorKind::Both { 1.0 } else { way };
                let volts = a.volts_for(torque, mu, way);
                let given = a.torque(volts) - way * a.friction(mu, volts);
                prop_assert!((given - torque).abs() < 1e-12, "{:?}: {volts} V gives {given} for {torque}", a.kind());
            }
        }
    }

    #[test]
    fn a_brake_by_its_geometry_is_the_brake_of_its_gain() {
        let geometry = geometry::tests::of_table_1();
        let of = |p| Actuator::<f64>::new(&ActuatorParams::Geometry(p));
        let brake = of(geometry).unwrap();
        assert!((brake.brake_gain() - 0.14).abs() < 1e-15 && brake.kind() == ActuatorKind::Brake);
        assert_eq!((brake.torque(3.0), brake.motor_gain(), brake.preload()), (0.0, 0.0, 0.0));
        // Lengths that are numbers, of a gain that is none.
        for size in [1e-300, 1e200] {
            let extreme = BrakeGeometry { contact_radius: size, lever_area: size, ..geometry };
            assert_eq!(of(extreme).unwrap_err().field(), "contact_radius", "{size}");
        }
    }

    #[test]
    fn a_brake_never_drives_a_motor_does_both_ways_and_both_on_one_signal_backwards() {
        let drives = |kind: ActuatorKind| [-1.0, 0.0, 1.0].map(|volts: f64| kind.drives_at(volts));
        assert_eq!(drives(ActuatorKind::Brake), [false, false, false]);
        assert_eq!(drives(ActuatorKind::Motor), [true, false, true]);
        assert_eq!(drives(ActuatorKind::Both), [true, false, false]);
    }

    #[test]
    fn actuators_of_different_kinds_are_not_one() {
        let (one, other) = (motor(0.4), both());
        assert_eq!(Actuator::in_lanes::<f64>(&|get| get(&one)), Some(one));
        assert_eq!(Actuator::in_lanes::<f64>(&|get| 0.5 * (get(&one) + get(&other))), None);
    }
}
