//! Source of a law's error rate: the paper's difference (5), or an observer.

use crate::derivative::{DerivativeState, SmoothedDerivative, SmoothedDerivativeParams};
#[cfg(feature = "linalg")]
use crate::observer::{Observer, ObserverParams, ObserverState};
use crate::{Encoder, FixedCounts, Micros, ParamError, Plant, Real, Target};

crate::choice! {
    /// Source of the velocity that laws are given.
    pub enum VelocityParams<T>: Default {
        /// The smoothed backward difference of the error (5).
        SmoothedDerivative(SmoothedDerivativeParams<T>) = "smoothed_derivative",
        /// A Kalman observer of position, velocity and disturbance torque.
        #[cfg(feature = "linalg")]
        Observer(ObserverParams<T>) = "observer",
    }
}

/// A checked velocity source.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum VelocitySource<T> {
    /// The smoothed backward difference of the error (5).
    SmoothedDerivative(SmoothedDerivative<T>),
    /// The Kalman observer.
    #[cfg(feature = "linalg")]
    Observer(Observer<T>),
}

/// Memory of a velocity source.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VelocityState<T> {
    derivative: DerivativeState<T>,
    #[cfg(feature = "linalg")]
    observer: ObserverState<T>,
}

impl<T: Real> VelocitySource<T> {
    /// Checks the parameters. `plant` is what an observer believes of the shaft; (5) needs none.
    ///
    /// # Errors
    /// As the chosen source's constructor.
    pub fn new(
        p: &VelocityParams<T>,
        plant: &Plant<T>,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        let _ = plant; // the only user is behind the feature `linalg`
        Ok(match p {
            VelocityParams::SmoothedDerivative(p) => {
                VelocitySource::SmoothedDerivative(SmoothedDerivative::new(p, encoder, period)?)
            }
            #[cfg(feature = "linalg")]
            VelocityParams::Observer(p) => {
                VelocitySource::Observer(Observer::new(p, plant, encoder, period)?)
            }
        })
    }

    /// On the path: the shaft moves at the target's velocity.
    #[must_use]
    pub fn start(&self, position: FixedCounts, target: &Target<T>) -> VelocityState<T> {
        VelocityState {
            derivative: DerivativeState::at(FixedCounts(target.position.0.wrapping_sub(position.0))),
            #[cfg(feature = "linalg")]
            observer: match self {
                VelocitySource::Observer(o) => o.start(position, target.velocity),
                VelocitySource::SmoothedDerivative(_) => ObserverState::default(),
            },
        }
    }

    /// One sample: position and target in, error rate `ė` out, rad/s. `volts` is what the
    /// brake was given since the last sample.
    #[inline]
    pub fn update(
        &self,
        state: &mut VelocityState<T>,
        position: FixedCounts,
        target: &Target<T>,
        volts: T,
    ) -> T {
        let _ = volts;
        match self {
            VelocitySource::SmoothedDerivative(d) => {
                d.update(&mut state.derivative, FixedCounts(target.position.0.wrapping_sub(position.0)))
            }
            #[cfg(feature = "linalg")]
            VelocitySource::Observer(o) => {
                target.velocity - o.update(&mut state.observer, position, volts).velocity
            }
        }
    }
}
