//! LuGre friction: bristles that bend, slide and damp.
//!
//! ```text
//! ż = θ̇ − σ_0 |θ̇| z/g(θ̇),    μ = σ_0 z + σ_1 ż,    g = μ_d + (μ_s − μ_d) exp(−|θ̇/θ̇_s|^δ)
//! ```
//!
//! C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, A new model for control of systems with friction, IEEE Trans.
//! Automat. Control 40 (1995) 419–425, whose values for a mass of 1 kg on 1 N of friction are `σ_0` = 10⁵ 1/m,
//! `σ_1` = √10⁵ s/m, 1 and 1.5 N, 1 mm/s. It has what Stribeck's curve lacks: a spring before the break-away, friction that
//! lags behind the velocity, a break-away that depends on the rate of force. It creeps: under a load that trembles a little
//! below break-away it drifts, and steady loads are held. Where a load has to be held, take the elasto-plastic model, or
//! Stribeck's curve. It is stiff: a run takes some times as long as with Stribeck's curve.

use super::{Bristles, FrictionModel, Stribeck, StribeckParams};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Interval, ParamError, Real};

crate::params! {
    /// LuGre friction: `ż = θ̇ − σ_0 |θ̇| z/g(θ̇)`, `μ = σ_0 z + σ_1 ż`, with Stribeck's curve `g`. It needs the engine
    /// `bristle`.
    pub struct LugreParams<T>: Default {
        /// Coefficient of friction at which the bristles give way from rest.
        mu_static: T = 0.2, "mu_static" "μ_s" NONE, Range::above(0.0);
        /// Coefficient of friction of a fast shaft.
        mu_dynamic: T = 0.15, "mu_dynamic" "μ_d" NONE, Range::above(0.0);
        /// Stribeck velocity of steady sliding.
        stribeck_velocity: T = 0.001, "stribeck_velocity_rad_s" "θ̇_s" RAD_S, Range::divisor();
        /// Stribeck exponent of steady sliding.
        stribeck_exponent: T = 2.0, "stribeck_exponent" "δ" NONE, Range::above(0.0);
        /// Stiffness of the bristles, as a coefficient of friction per angle.
        stiffness: T = 2000.0, "stiffness_1_rad" "σ_0" PER_RAD, Range::divisor();
        /// Damping of the bristles, as a coefficient of friction per velocity of bending.
        damping: T = 5.0, "damping_s_rad" "σ_1" S_RAD, Range::at_least(0.0);
    }
}

/// LuGre friction, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lugre<T> {
    params: LugreParams<T>,
    /// Steady sliding.
    curve: Stribeck<T>,
}

impl<T: Arithmetic> Lugre<T> {
    /// The parameters it was built from.
    #[must_use]
    pub fn params(&self) -> &LugreParams<T> {
        &self.params
    }

    /// The frictions of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Lugre<L> {
        let p = |get: fn(&LugreParams<T>) -> T| each(&|f| get(&f.params));
        let params = LugreParams {
            mu_static: p(|p| p.mu_static),
            mu_dynamic: p(|p| p.mu_dynamic),
            stribeck_velocity: p(|p| p.stribeck_velocity),
            stribeck_exponent: p(|p| p.stribeck_exponent),
            stiffness: p(|p| p.stiffness),
            damping: p(|p| p.damping),
        };
        Lugre { params, curve: Stribeck::in_lanes(&|get| each(&|f| get(&f.curve))) }
    }
}

impl<T: Arithmetic> FrictionModel<T> for Lugre<T> {
    type Params = LugreParams<T>;

    fn build(p: &LugreParams<T>) -> Result<Self, ParamError<T>> where T: Real {
        p.check_rows()?;
        let curve = Stribeck::new(&StribeckParams {
            mu_static: p.mu_static,
            mu_dynamic: p.mu_dynamic,
            stribeck_velocity: p.stribeck_velocity,
            stribeck_exponent: p.stribeck_exponent,
        })?;
        Ok(Lugre { params: *p, curve })
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
        let LugreParams { stiffness, damping, .. } = self.params;
        Some(Bristles { curve: self.curve, stiffness, damping, elastic: T::ZERO })
    }
}
