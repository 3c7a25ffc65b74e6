//! Source of a law's error rate: the paper's difference (5), counts over time, an edge-timed filter, or an observer.
//! Boards have the first.

#[cfg(feature = "linalg")]
use crate::counts_over_time::{CountsOverTime, CountsOverTimeParams, CountsOverTimeState};
use crate::derivative::{SmoothedDerivative, SmoothedDerivativeParams};
#[cfg(feature = "linalg")]
use crate::edge_timed::{EdgeTimed, EdgeTimedParams, EdgeTimedState};
#[cfg(feature = "linalg")]
use crate::observer::{Observer, ObserverParams, ObserverState};
use crate::{Encoder, FixedCounts, Micros, ParamError, Plant, Real, Target};

crate::choice! {
    /// Source of the velocity that laws are given.
    pub enum VelocityParams<T>: Default {
        /// The smoothed backward difference of the error (5).
        SmoothedDerivative(SmoothedDerivativeParams<T>) = "smoothed_derivative",
        /// Counts over the time between edges of the encoder (M/T).
        #[cfg(feature = "linalg")]
        CountsOverTime(CountsOverTimeParams<T>) = "counts_over_time",
        /// A Kalman filter that is corrected where an edge of the encoder is crossed.
        #[cfg(feature = "linalg")]
        EdgeTimed(EdgeTimedParams<T>) = "edge_timed",
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
    /// Counts over time.
    #[cfg(feature = "linalg")]
    CountsOverTime(CountsOverTime<T>),
    /// The edge-timed filter.
    #[cfg(feature = "linalg")]
    EdgeTimed(EdgeTimed<T>),
    /// The Kalman observer.
    #[cfg(feature = "linalg")]
    Observer(Observer<T>),
}

/// Memory of a velocity source.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VelocityState<T> {
    /// `ė` of (5).
    rate: T,
    #[cfg(feature = "linalg")]
    counts_over_time: CountsOverTimeState<T>,
    #[cfg(feature = "linalg")]
    edge_timed: EdgeTimedState<T>,
    #[cfg(feature = "linalg")]
    observer: ObserverState<T>,
}

impl<T: Real> VelocitySource<T> {
    /// Checks the parameters. `plant` is what a filter or an observer believes of the shaft; (5) needs none.
    ///
    /// # Errors
    /// As the chosen source's constructor.
    pub fn new(
        p: &VelocityParams<T>,
        plant: &Plant<T>,
        encoder: Encoder,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        let _ = plant; // its users are behind the feature `linalg`
        Ok(match p {
            VelocityParams::SmoothedDerivative(p) => {
                VelocitySource::SmoothedDerivative(SmoothedDerivative::new(p, encoder, period)?)
            }
            #[cfg(feature = "linalg")]
            VelocityParams::CountsOverTime(p) => {
                VelocitySource::CountsOverTime(CountsOverTime::new(p, encoder, period)?)
            }
            #[cfg(feature = "linalg")]
            VelocityParams::EdgeTimed(p) => {
                VelocitySource::EdgeTimed(EdgeTimed::new(p, plant, encoder, period)?)
            }
            #[cfg(feature = "linalg")]
            VelocityParams::Observer(p) => {
                VelocitySource::Observer(Observer::new(p, plant, encoder, period)?)
            }
        })
    }

    /// On the path: the shaft moves at the target's velocity, with `applied` volts on the actuator since long.
    #[inline(never)]
    #[must_use]
    pub fn start(&self, position: FixedCounts, target: &Target<T>, applied: T) -> VelocityState<T> {
        let _ = (position, target, applied);
        VelocityState {
            rate: T::ZERO,
            #[cfg(feature = "linalg")]
            counts_over_time: match self {
                VelocitySource::CountsOverTime(m) => m.start(position, target.velocity),
                _ => CountsOverTimeState::default(),
            },
            #[cfg(feature = "linalg")]
            edge_timed: match self {
                VelocitySource::EdgeTimed(f) => f.start(position, applied, target.velocity),
                _ => EdgeTimedState::default(),
            },
            #[cfg(feature = "linalg")]
            observer: match self {
                VelocitySource::Observer(o) => o.start(position, target.velocity),
                _ => ObserverState::default(),
            },
        }
    }

    /// One sample: position and target in, error rate `ė` out, rad/s. `moved` is the way of the error since the last
    /// sample, 2⁻¹⁶ counts, `volts` what the brake was given since.
    #[inline]
    pub fn update(
        &self,
        state: &mut VelocityState<T>,
        position: FixedCounts,
        target: &Target<T>,
        moved: T,
        volts: impl FnOnce() -> T,
    ) -> T {
        let _ = (position, target, &volts);
        match self {
            VelocitySource::SmoothedDerivative(d) => {
                state.rate = d.smooth_fine(state.rate, moved);
                state.rate
            }
            #[cfg(feature = "linalg")]
            VelocitySource::CountsOverTime(m) => {
                target.velocity - m.update(&mut state.counts_over_time, position)
            }
            #[cfg(feature = "linalg")]
            VelocitySource::EdgeTimed(f) => {
                f.update(&mut state.edge_timed, position, volts(), target.velocity);
                target.velocity - f.rad_per_s(state.edge_timed.velocity())
            }
            #[cfg(feature = "linalg")]
            VelocitySource::Observer(o) => {
                target.velocity - o.update(&mut state.observer, position, volts()).velocity
            }
        }
    }
}

#[cfg(all(test, feature = "linalg"))]
mod tests {
    use super::*;
    use crate::PlantParams;

    #[test]
    fn the_edge_timed_source_tells_the_error_rate_of_a_shaft_that_lags() {
        let plant = Plant::<f64>::new(&PlantParams::default()).unwrap();
        let p = VelocityParams::EdgeTimed(EdgeTimedParams::default());
        let source = VelocitySource::new(&p, &plant, Encoder::PAPER, Micros(1000)).unwrap();
        // The path goes at 3 °/s, the shaft at 2 °/s under the voltage that keeps it.
        let (path, shaft) = (3.0_f64.to_radians(), 2.0_f64.to_radians());
        let volts = (0.047088 - 0.001 * shaft) / (0.15 * 0.14);
        let counts =
            |rate: f64, k: i32| rate * 1e-3 * f64::from(k) * Encoder::PAPER.counts_per_radian::<f64>();
        let target = |k| Target {
            position: FixedCounts::from_real(counts(path, k)),
            velocity: path,
            acceleration: 0.0,
        };
        let mut state = source.start(FixedCounts(0), &target(0), volts);
        let mut rate = 0.0;
        for k in 1..3000 {
            let read = FixedCounts::from_counts(counts(shaft, k).floor() as i64);
            // It asks position and target alone.
            rate = source.update(&mut state, read, &target(k), 0.0, || volts);
        }
        assert!((rate - (path - shaft)).to_degrees().abs() < 0.2, "{} °/s", rate.to_degrees());
    }

    #[test]
    fn each_source_starts_with_the_velocity_of_the_path() {
        let plant = Plant::new(&PlantParams::default()).unwrap();
        let target = Target { velocity: 0.035, ..Target::default() };
        let state = |p: &VelocityParams<f64>| {
            let source = VelocitySource::new(p, &plant, Encoder::PAPER, Micros(1000)).unwrap();
            source.start(FixedCounts(0), &target, 2.24)
        };
        let observer = ObserverParams::default();
        assert_eq!(state(&VelocityParams::Observer(observer)).observer, {
            Observer::new(&observer, &plant, Encoder::PAPER, Micros(1000))
                .unwrap()
                .start(FixedCounts(0), 0.035)
        });
        let edges = EdgeTimedParams::default();
        assert_eq!(state(&VelocityParams::EdgeTimed(edges)).edge_timed, {
            let filter = EdgeTimed::new(&edges, &plant, Encoder::PAPER, Micros(1000)).unwrap();
            filter.start(FixedCounts(0), 2.24, 0.035)
        });
    }
}
