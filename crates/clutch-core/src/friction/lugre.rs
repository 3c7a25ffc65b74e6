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
//! below break-away it drifts, and steady loads are held. If a load has to be held, take the elasto-plastic model, or
//! Stribeck's curve. It is stiff: a run takes some times as long as with Stribeck's curve.

use super::StribeckParams;
use super::bristles::Way;
use crate::params::Range;

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

super::bristles::bristled! {
    /// LuGre friction, checked.
    Lugre LugreParams { mu_static, mu_dynamic, stribeck_velocity, stribeck_exponent, stiffness, damping }
    p => StribeckParams {
        mu_static: p.mu_static,
        mu_dynamic: p.mu_dynamic,
        stribeck_velocity: p.stribeck_velocity,
        stribeck_exponent: p.stribeck_exponent,
    },
    Way::One { stiffness: p.stiffness, damping: p.damping, elastic: T::ZERO }
}
