//! Bristles: friction that bends before it slides.
//!
//! ```text
//! one bristle:       ż = θ̇ (1 − α(z, θ̇) σ_0 z sgn(θ̇)/g(θ̇)),                        μ = σ_0 z + σ_1 ż
//! several elements:  ż_i = θ̇ while an element holds, up to k_i |z_i| = α_i g(θ̇); then, until θ̇ turns round,
//!                    k_i ż_i = sgn(θ̇) C (α_i − k_i |z_i|/g(θ̇)), at most k_i θ̇;      μ = Σ k_i z_i + σ Σ_held α_i θ̇
//! ```
//!
//! `z` is a deflection, `g` the curve of steady sliding, and `α` the share of the motion that slides: 1 for LuGre's and Dahl's
//! model, and for the elasto-plastic one 0 as long as the bristles bend less than at break-away. Elements are those of
//! generalised Maxwell slip, `α_i` their shares of the friction.

use super::{FrictionModel, Stribeck};
use crate::Real;

/// Elements of a friction at most.
pub const ELEMENTS: usize = 8;
/// Elements of a friction that has several, at least.
pub(super) const FEWEST: usize = 4;

/// State of a friction's bristles: how far they are bent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend<T> {
    /// Deflection of each element, rad; one bristle is the first.
    pub each: [T; ELEMENTS],
    /// Elements that slide, of a friction whose elements either hold or slide.
    pub slides: [bool; ELEMENTS],
}

impl<T: Real> Bend<T> {
    /// Bristles that are not bent.
    #[must_use]
    pub const fn none() -> Self {
        Bend { each: [T::ZERO; ELEMENTS], slides: [false; ELEMENTS] }
    }

    fn one(z: T) -> Self {
        let mut bend = Self::none();
        bend.each[0] = z;
        bend
    }
}

/// The ways in which bristles bend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way<T> {
    /// All as one.
    One {
        /// `σ_0`, 1/rad.
        stiffness: T,
        /// `σ_1`, s/rad.
        damping: T,
        /// Coefficient up to which the bristles only bend; 0 if they always slide a little.
        elastic: T,
    },
    /// Each by itself.
    Elements {
        /// Those from the first on that are used.
        count: usize,
        /// `k_i`, 1/rad.
        stiffness: [T; ELEMENTS],
        /// `α_i`.
        share: [T; ELEMENTS],
        /// `σ`, s/rad.
        damping: T,
        /// `C`, 1/s.
        attraction: T,
    },
}

/// Bristles of a friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristles<T> {
    /// `g`.
    pub(super) curve: Stribeck<T>,
    pub(super) way: Way<T>,
}

impl<T: Real> Bristles<T> {
    /// Elements that have a deflection, from the first on.
    #[must_use]
    pub fn count(&self) -> usize {
        match self.way {
            Way::One { .. } => 1,
            Way::Elements { count, .. } => count,
        }
    }

    /// Stiffness of all together, 1/rad.
    #[must_use]
    pub fn stiffness(&self) -> T {
        match self.way {
            Way::One { stiffness, .. } => stiffness,
            Way::Elements { count, stiffness, .. } => {
                stiffness.iter().take(count).fold(T::ZERO, |sum, k| sum + *k)
            }
        }
    }

    /// `true` if bending is damped: friction then exceeds that of steady sliding at times.
    #[must_use]
    pub fn damps(&self) -> bool {
        match self.way {
            Way::One { damping, .. } | Way::Elements { damping, .. } => damping > T::ZERO,
        }
    }

    /// Velocity at which steady sliding has lost all but 1/e of the drop from rest, rad/s.
    #[must_use]
    pub fn stribeck_velocity(&self) -> T {
        self.curve.params().stribeck_velocity
    }

    /// `ż` of each element, rad/s.
    #[must_use]
    pub fn rate(&self, bend: &Bend<T>, velocity: T) -> [T; ELEMENTS] {
        let curve = self.curve.level(velocity);
        let mut rates = [T::ZERO; ELEMENTS];
        match &self.way {
            Way::One { stiffness, elastic, .. } => {
                let z = bend.each[0];
                let share = sliding_share(*stiffness, *elastic, z, curve, velocity);
                rates[0] = velocity - share * (*stiffness * velocity.abs() * z / curve);
            }
            Way::Elements { count, stiffness, share, attraction, .. } => {
                let elements =
                    stiffness.iter().zip(share).zip(bend.each.iter().zip(&bend.slides)).take(*count);
                for (rate, ((k, share), (z, slides))) in rates.iter_mut().zip(elements) {
                    *rate = if *slides {
                        // No spring is bent by more than the motion: friction gives no energy then.
                        let way = velocity.sgn();
                        let bears = *k * *z * way;
                        way * (*attraction * (*share - bears / curve) / *k).min(velocity.abs())
                    } else {
                        velocity
                    };
                }
            }
        }
        rates
    }

    /// `μ`, with its sign.
    #[must_use]
    pub fn coefficient(&self, bend: &Bend<T>, rate: &[T; ELEMENTS]) -> T {
        match &self.way {
            Way::One { stiffness, damping, .. } => *stiffness * bend.each[0] + *damping * rate[0],
            Way::Elements { count, stiffness, share, damping, .. } => {
                let elements = stiffness.iter().zip(share).zip(bend.each.iter().zip(&bend.slides)).zip(rate);
                elements.take(*count).fold(T::ZERO, |sum, (((k, share), (z, slides)), rate)| {
                    sum + *k * *z + if *slides { T::ZERO } else { *damping * *share * *rate }
                })
            }
        }
    }

    /// The bend of steady sliding; at rest none.
    #[must_use]
    pub fn steady(&self, velocity: T) -> Bend<T> {
        let mu = self.curve.coefficient(velocity);
        match &self.way {
            Way::One { stiffness, .. } => Bend::one(mu / *stiffness),
            Way::Elements { count, stiffness, share, .. } => {
                let mut bend = Bend::none();
                let elements = bend.each.iter_mut().zip(&mut bend.slides).zip(stiffness).zip(share);
                for (((z, slides), k), share) in elements.take(*count) {
                    *z = *share * mu / *k;
                    *slides = velocity.abs() > T::ZERO;
                }
                bend
            }
        }
    }

    /// The bend that carries a coefficient at rest, at most that of break-away, on the first way from no bend.
    #[must_use]
    pub fn holding(&self, mu: T) -> Bend<T> {
        let most = self.curve.at_rest();
        let mu = mu.max(-most).min(most);
        match &self.way {
            Way::One { stiffness, .. } => Bend::one(mu / *stiffness),
            Way::Elements { count, stiffness, share, .. } => {
                let mut bend = Bend::none();
                let way = mu.sgn();
                // Each round finds the deflection of those that are not at their share yet.
                let mut full = [false; ELEMENTS];
                for _ in 0..=ELEMENTS {
                    let (mut left, mut stiff) = (mu.abs(), T::ZERO);
                    for ((k, share), full) in stiffness.iter().zip(share).zip(&full).take(*count) {
                        if *full {
                            left -= *share * most;
                        } else {
                            stiff += *k;
                        }
                    }
                    let deflection = if stiff > T::ZERO { left.max(T::ZERO) / stiff } else { T::ZERO };
                    let elements = stiffness.iter().zip(share).zip(bend.each.iter_mut().zip(&mut full));
                    for ((k, share), (z, full)) in elements.take(*count) {
                        *full |= *k * deflection >= *share * most;
                        *z = way * if *full { *share * most / *k } else { deflection };
                    }
                }
                bend
            }
        }
    }

    /// The deflection at which all of it has given way from rest, rad.
    #[must_use]
    pub fn deflection(&self) -> T {
        self.holding(T::from_f64(1e30)).each.iter().fold(T::ZERO, |most, z| most.max(*z))
    }

    /// Bend as a share of that of steady sliding: near 1 the shaft slides, below it the bristles hold it.
    #[must_use]
    pub fn bent(&self, bend: &Bend<T>, velocity: T) -> T {
        let level = self.curve.level(velocity);
        match &self.way {
            Way::One { stiffness, .. } => *stiffness * bend.each[0].abs() / level,
            Way::Elements { stiffness, .. } => {
                let sum = stiffness.iter().zip(&bend.each).fold(T::ZERO, |sum, (k, z)| sum + *k * *z);
                sum.abs() / level
            }
        }
    }

    /// Elements as they are from now on: one slides once it bears more than its share, and holds once the velocity has
    /// turned round. The same as `bend` if nothing happened.
    #[must_use]
    pub fn settled(&self, bend: &Bend<T>, velocity: T) -> Bend<T> {
        let mut settled = *bend;
        if let Way::Elements { count, stiffness, share, .. } = &self.way {
            let (level, way) = (self.curve.level(velocity), velocity.sgn());
            let elements = stiffness.iter().zip(share).zip(settled.each.iter().zip(&mut settled.slides));
            for ((k, share), (z, slides)) in elements.take(*count) {
                *slides = if *slides { *z * way >= T::ZERO } else { *k * *z * way > *share * level };
            }
        }
        settled
    }

    /// Viscous damping for each N m of normal force (as torque per unit of μ) from which on the friction takes energy out of
    /// any motion, s/rad. For one bristle it is `σ_1 (μ_s − μ_d)/μ_d`, after Barabanov and Ortega (IEEE Trans. Automat. Control
    /// 45, 2000). Elements need none: what a held one takes is in its spring, and a sliding one bends by no more than
    /// the motion.
    #[must_use]
    pub fn passive_from(&self) -> T {
        let (rest, sliding) = (self.curve.at_rest(), self.curve.sliding());
        match self.way {
            Way::One { damping, .. } => (damping * (rest - sliding) / sliding).max(T::ZERO),
            Way::Elements { .. } => T::ZERO,
        }
    }
}

/// `α`: share of a motion with which bristles slide that are one.
fn sliding_share<T: Real>(stiffness: T, elastic: T, z: T, curve: T, velocity: T) -> T {
    if elastic <= T::ZERO {
        return T::ONE;
    }
    let bend = stiffness * z.abs();
    // A bristle that unbends does not slide.
    if z * velocity < T::ZERO || bend <= elastic {
        return T::ZERO;
    }
    if bend >= curve {
        return T::ONE;
    }
    // From 0 to 1 as a half wave of a sine does.
    let share = (bend - elastic) / (curve - elastic);
    // From −1 to 1 quarters of a turn, of which there are 2⁶² parts each.
    let turn = (share + share - T::ONE) * T::from_f64((1_u64 << 62) as f64);
    let (sine, _) = crate::sin_cos_turns::<T>(turn.to_i64() as u64);
    T::from_f64(0.5) * (T::ONE + sine)
}

/// A friction with bristles, checked: its parameters, the curve that they give of steady sliding, and the way in which its
/// bristles bend. All that a friction is asked besides is that curve's.
macro_rules! bristled {
    (
        $(#[$doc:meta])*
        $model:ident $params:ident { $($field:ident),+ }
        $p:ident => $curve:expr, $way:expr
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

            fn curve(&self) -> Option<$crate::Stribeck<T>> where T: $crate::Real {
                Some(self.curve)
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
                Some($crate::Bristles { curve: self.curve, way: $way })
            }
        }
    };
}
pub(super) use bristled;
