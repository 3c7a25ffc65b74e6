//! Dahl's friction: bristles that bend and slide, without damping and without a peak.
//!
//! ```text
//! ż = θ̇ (1 − σ_0 z sgn(θ̇)/μ_d),    μ = σ_0 z
//! ```
//!
//! P. R. Dahl, A solid friction model, The Aerospace Corporation, TOR-0158(3107-18)-1 (1968), with the exponent 1: the limit
//! of LuGre's model for equal coefficients and no damping. Friction depends on the way alone and not on how fast it is gone;
//! there is no stick-slip. For bearings that roll, and for small motions.

use super::StribeckParams;
use super::bristles::Way;
use crate::params::Range;

crate::params! {
    /// Dahl's friction: `ż = θ̇ (1 − σ_0 z sgn(θ̇)/μ_d)`, `μ = σ_0 z`. It needs the engine `bristle`.
    pub struct DahlParams<T>: Default {
        /// Coefficient of friction of steady sliding.
        mu_dynamic: T = 0.15, "mu_dynamic" "μ_d" NONE, Range::above(0.0);
        /// Stiffness of the bristles, as a coefficient of friction per angle.
        stiffness: T = 2000.0, "stiffness_1_rad" "σ_0" PER_RAD, Range::divisor();
    }
}

super::bristles::bristled! {
    /// Dahl's friction, checked.
    Dahl DahlParams { mu_dynamic, stiffness }
    p => StribeckParams {
        mu_static: p.mu_dynamic,
        mu_dynamic: p.mu_dynamic,
        stribeck_velocity: T::ONE,
        stribeck_exponent: T::ONE,
    },
    Way::One { stiffness: p.stiffness, damping: T::ZERO, elastic: T::ZERO }
}
