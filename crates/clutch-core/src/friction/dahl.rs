//! Dahl's friction: bristles that bend and slide, without damping and without a peak.
//!
//! ```text
//! ż = θ̇ (1 − σ_0 z sgn(θ̇)/μ_d),    μ = σ_0 z
//! ```
//!
//! P. R. Dahl, A solid friction model, The Aerospace Corporation, TOR-0158(3107-18)-1 (1968), with the exponent 1: the limit
//! of LuGre's model for equal coefficients and no damping. Friction depends on the way alone and not on how fast it is gone;
//! there is no stick-slip. For bearings that roll, and for small motions.

use super::{Bristles, FrictionModel, Stribeck, StribeckParams};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Interval, ParamError, Real};

crate::params! {
    /// Dahl's friction: `ż = θ̇ (1 − σ_0 z sgn(θ̇)/μ_d)`, `μ = σ_0 z`. It needs the engine `bristle`.
    pub struct DahlParams<T>: Default {
        /// Coefficient of friction of steady sliding.
        mu_dynamic: T = 0.15, "mu_dynamic" "μ_d" NONE, Range::above(0.0);
        /// Stiffness of the bristles, as a coefficient of friction per angle.
        stiffness: T = 2000.0, "stiffness_1_rad" "σ_0" PER_RAD, Range::divisor();
    }
}

/// Dahl's friction, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dahl<T> {
    params: DahlParams<T>,
    /// Steady sliding.
    curve: Stribeck<T>,
}

impl<T: Arithmetic> Dahl<T> {
    /// The parameters it was built from.
    #[must_use]
    pub fn params(&self) -> &DahlParams<T> {
        &self.params
    }

    /// The frictions of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Dahl<L> {
        let p = |get: fn(&DahlParams<T>) -> T| each(&|f| get(&f.params));
        let params = DahlParams {
            mu_dynamic: p(|p| p.mu_dynamic),
            stiffness: p(|p| p.stiffness),
        };
        Dahl { params, curve: Stribeck::in_lanes(&|get| each(&|f| get(&f.curve))) }
    }
}

impl<T: Arithmetic> FrictionModel<T> for Dahl<T> {
    type Params = DahlParams<T>;

    fn build(p: &DahlParams<T>) -> Result<Self, ParamError<T>> where T: Real {
        p.check_rows()?;
        let curve = Stribeck::new(&StribeckParams {
            mu_static: p.mu_dynamic,
            mu_dynamic: p.mu_dynamic,
            stribeck_velocity: T::ONE,
            stribeck_exponent: T::ONE,
        })?;
        Ok(Dahl { params: *p, curve })
    }

    #[inline]
    fn level(&self, velocity: T) -> T {
        self.curve.level(velocity)
    }

    fn quick(&self) -> Option<Stribeck<T>>
    where
        T: Real,
    {
        self.curve.quick()
    }

    #[inline]
    fn at_rest(&self) -> T {
        self.curve.at_rest()
    }

    #[inline]
    fn sliding(&self) -> T {
        self.curve.sliding()
    }

    fn envelope(&self) -> Interval<T> where T: Real {
        self.curve.envelope()
    }

    fn check_divisor(&self) -> Result<(), ParamError<T>> where T: Real {
        // The rows above 0 see to it.
        Ok(())
    }

    fn bristles(&self) -> Option<Bristles<T>> where T: Real {
        let DahlParams { stiffness, .. } = self.params;
        Some(Bristles { curve: self.curve, stiffness, damping: T::ZERO, elastic: T::ZERO })
    }
}
