//! Elasto-plastic friction: LuGre's bristles, which only bend below break-away.
//!
//! ```text
//! ż = θ̇ (1 − α(z, θ̇) σ_0 z sgn(θ̇)/g(θ̇)),    μ = σ_0 z + σ_1 ż
//! α = 0 for σ_0 |z| ≤ μ_e or z θ̇ < 0,  1 for σ_0 |z| ≥ g,  ½ + ½ sin(π (2x − 1)/2) between, x = (σ_0 |z| − μ_e)/(g − μ_e)
//! ```
//!
//! P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, Single state elastoplastic friction models, IEEE Trans. Automat. Control
//! 47 (2002) 787–792. A load that trembles below `μ_e` is held for ever, where LuGre's model drifts; all else is LuGre's.

use super::StribeckParams;
use super::bristles::Way;
use crate::params::Range;

crate::params! {
    /// Elasto-plastic friction: LuGre's bristles, which only bend and do not slide below a coefficient `μ_e`. It needs the
    /// engine `bristle`.
    pub struct ElastoPlasticParams<T>: Default {
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
        /// Coefficient up to which the bristles only bend.
        elastic: T = 0.12, "mu_elastic" "μ_e" NONE, Range::above(0.0);
    }
    relations(p) {
        /// Bristles slide before they do so steadily.
        BELOW: elastic, "a number below mu_static and mu_dynamic" => p.elastic < p.mu_static.min(p.mu_dynamic);
    }
}

super::bristles::bristled! {
    /// Elasto-plastic friction, checked.
    ElastoPlastic ElastoPlasticParams { mu_static, mu_dynamic, stribeck_velocity, stribeck_exponent, stiffness, damping, elastic }
    p => StribeckParams {
        mu_static: p.mu_static,
        mu_dynamic: p.mu_dynamic,
        stribeck_velocity: p.stribeck_velocity,
        stribeck_exponent: p.stribeck_exponent,
    },
    Way::One { stiffness: p.stiffness, damping: p.damping, elastic: p.elastic }
}
