//! Dry friction of a pad on a disc.
//!
//! ```text
//! T_f = μ(θ̇) N,   N = K_COF max(v_a, 0) with the paper's brake  the friction term of (1)
//! ```
//!
//! A friction model is a file of this folder and a line in the list below: its parameters, and what
//! [`FrictionModel`] asks. Plant, computed torque, observer, bounds and certificate ask the trait, and never
//! one model's parameters. Two readings are settled here: `sgn(0) = 0`, and a pad can only push, so that a
//! negative voltage gives no normal force.

mod bristles;
mod list;

pub use bristles::{Bend, Bristles, ELEMENTS};

use crate::{Arithmetic, Each, Interval, ParamError, Real};

list::frictions! {
    stribeck Stribeck StribeckParams "Stribeck's curve (2).";
    coulomb Coulomb CoulombParams "Coulomb's friction with a level at rest.";
    lugre Lugre LugreParams "LuGre friction: bristles that bend, slide and damp.";
    dahl Dahl DahlParams "Dahl's friction: bristles that bend and slide.";
    elasto_plastic ElastoPlastic ElastoPlasticParams "Elasto-plastic friction: bristles that only bend below break-away.";
    maxwell Maxwell MaxwellParams "Generalised Maxwell slip: up to eight springs that hold up to their shares.";
}

/// A friction, as one that depends on the velocity alone; what else it has are its [`FrictionModel::bristles`].
pub trait FrictionModel<T: Arithmetic>: Sized {
    /// Its parameters.
    type Params;

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range.
    fn build(p: &Self::Params) -> Result<Self, ParamError<T>>
    where
        T: Real;

    /// `|μ|` at a velocity (rad/s); towards rest, its limit.
    fn level(&self, velocity: T) -> T;

    /// Stribeck's curve that the level is; none if it is no such curve.
    fn curve(&self) -> Option<Stribeck<T>>
    where
        T: Real,
    {
        None
    }

    /// `|μ|` up to which a resting shaft stays at rest.
    fn at_rest(&self) -> T;

    /// `|μ|` of a fast shaft.
    fn sliding(&self) -> T;

    /// All that `|μ|` can be, rest included.
    fn envelope(&self) -> Interval<T>
    where
        T: Real;

    /// The curve, if it falls exponentially from rest to a fast shaft: a closed form exists for such.
    fn exponential(&self) -> Option<Exponential<T>>
    where
        T: Real,
    {
        None
    }

    /// The way in which it falls from rest to a fast shaft, if it is Stribeck's.
    fn falls(&self) -> Option<Fall<T>>
    where
        T: Real,
    {
        None
    }

    /// The bristles of a friction that bends before it slides. All else that a friction is asked is of its steady sliding.
    fn bristles(&self) -> Option<Bristles<T>>
    where
        T: Real,
    {
        None
    }

    /// Checks that something may divide by `|μ|` at any velocity.
    ///
    /// # Errors
    /// The parameter by which it can be 0.
    fn check_divisor(&self) -> Result<(), ParamError<T>>
    where
        T: Real;

    /// `μ(θ̇)` with its sign; 0 at rest.
    #[inline]
    fn coefficient(&self, velocity: T) -> T {
        self.level(velocity) * velocity.sgn()
    }
}

/// `|μ|(θ̇) = sliding + (at_rest − sliding) exp(−(|θ̇|/velocity)^exponent)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fall<T> {
    /// Stribeck velocity, rad/s; 0 of a friction that falls at once.
    pub velocity: T,
    /// `δ`.
    pub exponent: T,
}

/// `|μ|(θ̇) = sliding + (at_rest − sliding) exp(−|θ̇|/velocity)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponential<T> {
    /// At rest.
    pub at_rest: T,
    /// Level of a fast shaft.
    pub sliding: T,
    /// Velocity at which all but 1/e of the fall is done, rad/s.
    pub velocity: T,
}

#[cfg(test)]
mod tests;
