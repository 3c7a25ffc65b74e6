//! Coulomb's friction with a level at rest:
//!
//! ```text
//! μ = μ_d sgn(θ̇) in motion,   up to μ_s at rest
//! ```
//!
//! C. A. Coulomb, Théorie des machines simples (1785); the level at rest is Morin's (1833). For quick estimates and
//! closed forms: the drop from rest to motion is at once, so that a shaft which breaks away leaps as far as it can. A shaft
//! that sticks and slips does it more than with Stribeck's curve.

use super::{Exponential, Fall, FrictionModel};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Interval, ParamError, Real};

crate::params! {
    /// Coulomb's friction with a level at rest: `μ = μ_d sgn(θ̇)` in motion, up to `μ_s` at rest.
    pub struct CoulombParams<T>: Default {
        /// Coefficient of friction at rest.
        mu_static: T = 0.2, "mu_static" "μ_s" NONE, Range::at_least(0.0);
        /// Coefficient of friction in motion.
        mu_dynamic: T = 0.15, "mu_dynamic" "μ_d" NONE, Range::at_least(0.0);
    }
    relations(p) {
        /// A shaft that moves does not stop below what holds it.
        HOLDS: mu_static, "a number of at least mu_dynamic" => p.mu_static >= p.mu_dynamic;
        /// Something divides by the friction of a moving shaft.
        DIVIDES: mu_dynamic, "a number above 0 in model.friction, and with a brake in rig.friction: computed torque and bounds divide by it";
    }
}

/// Coulomb's friction, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coulomb<T> {
    params: CoulombParams<T>,
}

impl<T: Arithmetic> Coulomb<T> {
    /// The parameters it was built from.
    #[must_use]
    pub fn params(&self) -> &CoulombParams<T> {
        &self.params
    }

    /// The frictions of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Coulomb<L> {
        let (mu_static, mu_dynamic) = (each(&|f| f.params.mu_static), each(&|f| f.params.mu_dynamic));
        Coulomb { params: CoulombParams { mu_static, mu_dynamic } }
    }
}

impl<T: Arithmetic> FrictionModel<T> for Coulomb<T> {
    type Params = CoulombParams<T>;

    fn build(p: &CoulombParams<T>) -> Result<Self, ParamError<T>> where T: Real {
        p.check_rows()?;
        Ok(Coulomb { params: *p })
    }

    #[inline]
    fn level(&self, _: T) -> T {
        self.params.mu_dynamic
    }

    #[inline]
    fn at_rest(&self) -> T {
        self.params.mu_static
    }

    #[inline]
    fn sliding(&self) -> T {
        self.params.mu_dynamic
    }

    fn envelope(&self) -> Interval<T> where T: Real {
        Interval { low: self.params.mu_dynamic, high: self.params.mu_static }
    }

    fn exponential(&self) -> Option<Exponential<T>> where T: Real {
        let level = self.params.mu_dynamic;
        Some(Exponential { at_rest: level, sliding: level, velocity: T::ONE })
    }

    fn falls(&self) -> Option<Fall<T>> where T: Real {
        Some(Fall { velocity: T::ZERO, exponent: T::ONE })
    }

    fn check_divisor(&self) -> Result<(), ParamError<T>> where T: Real {
        CoulombParams::DIVIDES.require(self.params.mu_dynamic, self.params.mu_dynamic > T::ZERO)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_drops_at_once_and_each_bad_parameter_is_named() {
        let f = Coulomb::<f64>::build(&CoulombParams::default()).unwrap();
        assert_eq!((f.at_rest(), f.level(1e-300), f.level(9.0), f.coefficient(-1.0)), (0.2, 0.15, 0.15, -0.15));
        let bad = CoulombParams { mu_static: 0.1, mu_dynamic: 0.15 };
        assert_eq!(Coulomb::<f64>::build(&bad).unwrap_err().field(), "mu_static");
        let bad = CoulombParams { mu_static: 0.1, mu_dynamic: f64::NAN };
        assert_eq!(Coulomb::<f64>::build(&bad).unwrap_err().field(), "mu_dynamic");
    }
}
