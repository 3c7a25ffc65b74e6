//! Generalised Maxwell slip: up to eight elements side by side, each a spring that holds up to its share of the friction and then
//! slides.
//!
//! ```text
//! held:    ż_i = θ̇,  until  k_i |z_i| = α_i g(θ̇)
//! sliding: k_i ż_i = sgn(θ̇) C (α_i − k_i |z_i|/g(θ̇)), at most k_i θ̇,  until  θ̇ turns round
//! μ = Σ k_i z_i + σ Σ_held α_i θ̇,    Σ α_i = 1
//! ```
//!
//! F. Al-Bender, V. Lampaert, J. Swevers, IEEE Trans. Automat. Control 50 (2005) 1883–1887, with two additions: a held
//! element is damped, and a sliding one bends by no more than the motion, without which the model can give energy. It has
//! what one bristle lacks: it remembers where the motion turned round, so that a small loop inside a large one closes, and
//! the large one goes on as if the small one had not been. With one coefficient it is Maxwell slip, which the way alone
//! decides. It is for pre-sliding that was measured: stiffnesses and shares are the slopes and the bends of the first
//! loading curve. The fourth element bears what the others leave; four are used as long as the others bear nothing. It is
//! stiff, and takes some times as long as one bristle.

use super::StribeckParams;
use super::bristles::{FEWEST, Way};
use crate::params::Range;

crate::params! {
    /// Generalised Maxwell slip: up to eight springs side by side that hold up to their shares of the friction and then slide. It
    /// needs the engine `bristle`.
    pub struct MaxwellParams<T>: Default {
        /// Coefficient of friction at which all elements have given way from rest.
        mu_static: T = 0.2, "mu_static" "μ_s" NONE, Range::above(0.0);
        /// Coefficient of friction of a fast shaft.
        mu_dynamic: T = 0.15, "mu_dynamic" "μ_d" NONE, Range::above(0.0);
        /// Stribeck velocity of steady sliding.
        stribeck_velocity: T = 0.001, "stribeck_velocity_rad_s" "θ̇_s" RAD_S, Range::divisor();
        /// Stribeck exponent of steady sliding.
        stribeck_exponent: T = 2.0, "stribeck_exponent" "δ" NONE, Range::above(0.0);
        /// Stiffness of the first element, as a coefficient of friction per angle.
        stiffness_a: T = 1600.0, "stiffness_a_1_rad" "k_a" PER_RAD, Range::divisor();
        /// Stiffness of the second element.
        stiffness_b: T = 800.0, "stiffness_b_1_rad" "k_b" PER_RAD, Range::divisor();
        /// Stiffness of the third element.
        stiffness_c: T = 400.0, "stiffness_c_1_rad" "k_c" PER_RAD, Range::divisor();
        /// Stiffness of the fourth element.
        stiffness_d: T = 200.0, "stiffness_d_1_rad" "k_d" PER_RAD, Range::divisor();
        /// Stiffness of the fifth element.
        stiffness_e: T = 100.0, "stiffness_e_1_rad" "k_e" PER_RAD, Range::divisor();
        /// Stiffness of the sixth element.
        stiffness_f: T = 50.0, "stiffness_f_1_rad" "k_f" PER_RAD, Range::divisor();
        /// Stiffness of the seventh element.
        stiffness_g: T = 25.0, "stiffness_g_1_rad" "k_g" PER_RAD, Range::divisor();
        /// Stiffness of the eighth element.
        stiffness_h: T = 12.5, "stiffness_h_1_rad" "k_h" PER_RAD, Range::divisor();
        /// Share of the friction that the first element bears.
        share_a: T = 0.25, "share_a" "α_a" NONE, Range::within(0.0, 1.0);
        /// Share of the second element.
        share_b: T = 0.25, "share_b" "α_b" NONE, Range::within(0.0, 1.0);
        /// Share of the third element; the fourth bears what all others leave.
        share_c: T = 0.25, "share_c" "α_c" NONE, Range::within(0.0, 1.0);
        /// Share of the fifth element.
        share_e: T = 0.0, "share_e" "α_e" NONE, Range::within(0.0, 1.0);
        /// Share of the sixth element.
        share_f: T = 0.0, "share_f" "α_f" NONE, Range::within(0.0, 1.0);
        /// Share of the seventh element.
        share_g: T = 0.0, "share_g" "α_g" NONE, Range::within(0.0, 1.0);
        /// Share of the eighth element.
        share_h: T = 0.0, "share_h" "α_h" NONE, Range::within(0.0, 1.0);
        /// Rate at which a sliding element comes to its share.
        attraction: T = 50.0, "attraction_1_s" "C" PER_S, Range::at_least(0.0);
        /// Damping of held elements, as a coefficient of friction per velocity.
        damping: T = 1.0, "damping_s_rad" "σ" S_RAD, Range::at_least(0.0);
    }
    relations(p) {
        /// Elements share one friction.
        WHOLE: share_c, "a share with which share_a, share_b, share_c and share_e to share_h are 1 or below in all" => // Decimal fractions round.
            p.share_a + p.share_b + p.share_c + (p.share_e + p.share_f + p.share_g + p.share_h) <= T::from_f64(1.0 + 1e-6);
    }
}

super::bristles::bristled! {
    /// Generalised Maxwell slip, checked.
    Maxwell MaxwellParams {
        mu_static, mu_dynamic, stribeck_velocity, stribeck_exponent, stiffness_a, stiffness_b, stiffness_c, stiffness_d,
        stiffness_e, stiffness_f, stiffness_g, stiffness_h, share_a, share_b, share_c, share_e, share_f, share_g, share_h,
        attraction, damping
    }
    p => StribeckParams {
        mu_static: p.mu_static,
        mu_dynamic: p.mu_dynamic,
        stribeck_velocity: p.stribeck_velocity,
        stribeck_exponent: p.stribeck_exponent,
    },
    {
        let rest = T::ONE - p.share_a - p.share_b - p.share_c - p.share_e - p.share_f - p.share_g - p.share_h;
        let share = [p.share_a, p.share_b, p.share_c, rest.max(T::ZERO), p.share_e, p.share_f, p.share_g, p.share_h];
        Way::Elements {
            count: share.iter().rposition(|share| *share > T::ZERO).map_or(FEWEST, |last| FEWEST.max(last + 1)),
            stiffness: [
                p.stiffness_a,
                p.stiffness_b,
                p.stiffness_c,
                p.stiffness_d,
                p.stiffness_e,
                p.stiffness_f,
                p.stiffness_g,
                p.stiffness_h,
            ],
            share,
            damping: p.damping,
            attraction: p.attraction,
        }
    }
}
