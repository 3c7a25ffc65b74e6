//! Bristles: friction that bends before it slides.
//!
//! ```text
//! ż = θ̇ (1 − α(z, θ̇) σ_0 z sgn(θ̇)/g(θ̇)),     μ = σ_0 z + σ_1 ż
//! ```
//!
//! `z` is the deflection of the bristles, `g` the curve of steady sliding, and `α` the share of the motion that slides: 1
//! for LuGre's and Dahl's model, and for the elasto-plastic one 0 as long as the bristles bend less than at break-away.

use super::{FrictionModel, Stribeck};
use crate::Real;

/// Bristles of a friction, with one state: the deflection `z`, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristles<T> {
    /// `g`.
    pub(super) curve: Stribeck<T>,
    /// `σ_0`, 1/rad.
    pub(super) stiffness: T,
    /// `σ_1`, s/rad.
    pub(super) damping: T,
    /// Coefficient up to which the bristles only bend; 0 if they always slide a little.
    pub(super) elastic: T,
}

impl<T: Real> Bristles<T> {
    /// `σ_0`, 1/rad.
    #[must_use]
    pub fn stiffness(&self) -> T {
        self.stiffness
    }

    /// `α`: share of a motion with which the bristles slide.
    fn sliding_share(&self, z: T, curve: T, velocity: T) -> T {
        if self.elastic <= T::ZERO {
            return T::ONE;
        }
        let bend = self.stiffness * z.abs();
        // A bristle that unbends does not slide.
        if z * velocity < T::ZERO || bend <= self.elastic {
            return T::ZERO;
        }
        if bend >= curve {
            return T::ONE;
        }
        // From 0 to 1 as a half wave of a sine does.
        let share = (bend - self.elastic) / (curve - self.elastic);
        // From −1 to 1 quarters of a turn, of which there are 2⁶² parts each.
        let turn = (share + share - T::ONE) * T::from_f64((1_u64 << 62) as f64);
        let (sine, _) = crate::sin_cos_turns::<T>(turn.to_i64() as u64);
        T::from_f64(0.5) * (T::ONE + sine)
    }

    /// `true` if bending is damped: friction then exceeds that of steady sliding at times.
    #[must_use]
    pub fn damps(&self) -> bool {
        self.damping > T::ZERO
    }

    /// Velocity at which steady sliding has lost all but 1/e of the drop from rest, rad/s.
    #[must_use]
    pub fn stribeck_velocity(&self) -> T {
        self.curve.params().stribeck_velocity
    }

    /// `ż`, rad/s.
    #[must_use]
    pub fn rate(&self, z: T, velocity: T) -> T {
        let curve = self.curve.level(velocity);
        let share = self.sliding_share(z, curve, velocity);
        velocity - share * (self.stiffness * velocity.abs() * z / curve)
    }

    /// `μ`, with its sign.
    #[must_use]
    pub fn coefficient(&self, z: T, rate: T) -> T {
        self.stiffness * z + self.damping * rate
    }

    /// The deflection of steady sliding, rad; at rest 0.
    #[must_use]
    pub fn steady(&self, velocity: T) -> T {
        self.curve.coefficient(velocity) / self.stiffness
    }

    /// The deflection that carries a coefficient at rest, rad, at most that of break-away.
    #[must_use]
    pub fn holding(&self, mu: T) -> T {
        let most = self.curve.at_rest();
        mu.max(-most).min(most) / self.stiffness
    }

    /// Deflection as a share of that of steady sliding: near 1 the shaft slides, below it the bristles hold it.
    #[must_use]
    pub fn bent(&self, z: T, velocity: T) -> T {
        self.stiffness * z.abs() / self.curve.level(velocity)
    }

    /// Viscous damping for each N m of normal force (as torque per unit of μ) from which on the friction takes energy out of
    /// any motion, s/rad: `σ_1 (μ_s − μ_d)/μ_d`, after Barabanov and Ortega (IEEE Trans. Automat. Control 45, 2000).
    #[must_use]
    pub fn passive_from(&self) -> T {
        let (rest, sliding) = (self.curve.at_rest(), self.curve.sliding());
        (self.damping * (rest - sliding) / sliding).max(T::ZERO)
    }
}

/// A friction with bristles, checked: its parameters, the curve that they give of steady sliding, and stiffness, damping
/// and elastic coefficient of the bristles. All that a friction is asked besides is that curve's.
macro_rules! bristled {
    (
        $(#[$doc:meta])*
        $model:ident $params:ident { $($field:ident),+ }
        $p:ident => $curve:expr, $bends:expr
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $model<T> {
            params: $params<T>,
            /// Steady sliding.
            curve: $crate::Stribeck<T>,
        }

        impl<T: $crate::Arithmetic> $model<T> {
            /// The parameters it was built from.
            #[must_use]
            pub fn params(&self) -> &$params<T> {
                &self.params
            }

            /// The frictions of several lanes as one.
            #[must_use]
            pub fn in_lanes<L: $crate::Arithmetic>(each: $crate::Each<'_, Self, T, L>) -> $model<L> {
                $model {
                    params: $params { $($field: each(&|f| f.params.$field),)+ },
                    curve: $crate::Stribeck::in_lanes(&|get| each(&|f| get(&f.curve))),
                }
            }
        }

        impl<T: $crate::Arithmetic> $crate::FrictionModel<T> for $model<T> {
            type Params = $params<T>;

            fn build($p: &$params<T>) -> Result<Self, $crate::ParamError<T>> where T: $crate::Real {
                $crate::params::Table::check_rows($p)?;
                Ok($model { params: *$p, curve: $crate::Stribeck::new(&$curve)? })
            }

            #[inline]
            fn level(&self, velocity: T) -> T {
                self.curve.level(velocity)
            }

            fn quick(&self) -> Option<$crate::Stribeck<T>> where T: $crate::Real {
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

            fn envelope(&self) -> $crate::Interval<T> where T: $crate::Real {
                self.curve.envelope()
            }

            fn check_divisor(&self) -> Result<(), $crate::ParamError<T>> where T: $crate::Real {
                // The rows above 0 see to it.
                Ok(())
            }

            fn bristles(&self) -> Option<$crate::Bristles<T>> where T: $crate::Real {
                let $p = &self.params;
                let (stiffness, damping, elastic) = $bends;
                Some($crate::Bristles { curve: self.curve, stiffness, damping, elastic })
            }
        }
    };
}
pub(super) use bristled;
