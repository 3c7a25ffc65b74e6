//! What drives the shaft: a weight, a spring, a table over time, or a hand.

use clutch_core::ParamError;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Parameters of a driving torque.
#[derive(Clone, Debug, PartialEq)]
pub enum DriveParams {
    /// A weight on a pulley: `M g R_p`.
    Weight {
        /// `M`, kg.
        mass: f64,
        /// `g`, m/s².
        gravity: f64,
        /// `R_p`, m.
        pulley_radius: f64,
    },
    /// A spring: `stiffness · (rest − θ)`.
    Spring {
        /// N m/rad.
        stiffness: f64,
        /// Angle at which it pulls no more, rad from the start.
        rest: f64,
    },
    /// Torque at points in time, straight lines between, constant outside.
    Table(
        /// (s, N m), with rising times.
        Vec<(f64, f64)>,
    ),
    /// A hand: a mean with a random part whose power lies evenly in a band of frequencies.
    Hand {
        /// Mean, N m.
        mean: f64,
        /// Root mean square of the random part, N m.
        rms: f64,
        /// Lower end of the band, Hz.
        lowest_frequency: f64,
        /// Upper end of the band, Hz.
        highest_frequency: f64,
    },
}

/// Sines in a hand's random part.
const HAND_SINES: u32 = 48;

/// A driving torque, checked, as a function of time.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// Constant, N m.
    Constant(f64),
    /// `stiffness · (rest − θ)`, N m/rad and rad.
    Spring {
        /// N m/rad.
        stiffness: f64,
        /// rad
        rest: f64,
    },
    /// (s, N m), straight lines between.
    Table(Vec<(f64, f64)>),
    /// Mean and sines.
    Hand {
        /// N m.
        mean: f64,
        /// Amplitude (N m), angular frequency (rad/s), phase (rad).
        sines: Vec<(f64, f64, f64)>,
    },
}

impl Drive {
    /// Checks the parameters; `seed` decides a hand's phases and frequencies.
    ///
    /// # Errors
    /// Names the parameter: one that is not finite, a mass or pulley radius not above 0, times that do
    /// not rise, a negative rms, a band that is empty or reaches below 0 Hz.
    pub fn new(p: &DriveParams, seed: u64) -> Result<Drive, ParamError> {
        let bad = |field, value, expected| Err(ParamError { field, value, expected });
        match p {
            DriveParams::Weight { mass, gravity, pulley_radius } => {
                for (field, value, expected) in [
                    ("mass", *mass, "a finite number above 0 kg"),
                    ("gravity", *gravity, "a finite number above 0 m/s²"),
                    ("pulley_radius", *pulley_radius, "a finite number above 0 m"),
                ] {
                    if !(value > 0.0 && value.is_finite()) {
                        return bad(field, value, expected);
                    }
                }
                Ok(Drive::Constant(mass * gravity * pulley_radius))
            }
            DriveParams::Spring { stiffness, rest } => {
                if !(*stiffness > 0.0 && stiffness.is_finite()) {
                    return bad("stiffness", *stiffness, "a finite number above 0 N m/rad");
                }
                if !rest.is_finite() {
                    return bad("rest", *rest, "a finite angle, rad");
                }
                Ok(Drive::Spring { stiffness: *stiffness, rest: *rest })
            }
            DriveParams::Table(points) => {
                if points.is_empty() {
                    return bad("points", 0.0, "at least one point");
                }
                for (i, (t, torque)) in points.iter().enumerate() {
                    if !(t.is_finite() && torque.is_finite()) {
                        return bad(
                            "points",
                            i as f64,
                            "finite times (s) and torques (N m); the value is the number (from 0) of the point that is not",
                        );
                    }
                    if i > 0 && points[i - 1].0 >= *t {
                        return bad(
                            "points",
                            i as f64,
                            "times that rise from point to point; the value is the number (from 0) of the point that does not",
                        );
                    }
                }
                Ok(Drive::Table(points.clone()))
            }
            DriveParams::Hand { mean, rms, lowest_frequency: lowest, highest_frequency: highest } => {
                if !mean.is_finite() {
                    return bad("mean", *mean, "a finite torque, N m");
                }
                if !(*rms >= 0.0 && rms.is_finite()) {
                    return bad("rms", *rms, "a finite torque of at least 0 N m");
                }
                if !(*lowest >= 0.0 && lowest.is_finite()) {
                    return bad("lowest_frequency", *lowest, "a finite frequency of at least 0 Hz");
                }
                if !(highest > lowest && *highest <= 50.0) {
                    return bad(
                        "highest_frequency",
                        *highest,
                        "a frequency above the lowest and at most 50 Hz (a hand is slower)",
                    );
                }
                let mut rng = Pcg64::seed_from_u64(seed ^ 0x6861_6e64); // a stream apart from the noise
                let amplitude = rms * libm::sqrt(2.0 / f64::from(HAND_SINES));
                let width = (highest - lowest) / f64::from(HAND_SINES);
                let sines = (0..HAND_SINES)
                    .map(|i| {
                        // One frequency at random in each slice of the band.
                        let f = lowest + width * (f64::from(i) + rng.random::<f64>());
                        let tau = core::f64::consts::TAU;
                        (amplitude, tau * f, tau * rng.random::<f64>())
                    })
                    .collect();
                Ok(Drive::Hand { mean: *mean, sines })
            }
        }
    }

    /// Torque at a time (s) and a position (rad from the start), N m.
    #[must_use]
    pub fn torque(&self, t: f64, position: f64) -> f64 {
        match self {
            Drive::Constant(torque) => *torque,
            Drive::Spring { stiffness, rest } => stiffness * (rest - position),
            Drive::Table(points) => {
                let after = points.partition_point(|p| p.0 <= t);
                match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
                    (Some((t0, a)), Some((t1, b))) => a + (b - a) * (t - t0) / (t1 - t0),
                    (Some((_, end)), None) | (None, Some((_, end))) => *end,
                    (None, None) => 0.0,
                }
            }
            Drive::Hand { mean, sines } => {
                mean + sines.iter().map(|(a, w, phase)| a * libm::sin(w * t + phase)).sum::<f64>()
            }
        }
    }

    /// Lowest and highest torque that can come, N m: of a spring all, of a hand the mean ± 4 rms.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        match self {
            Drive::Constant(torque) => (*torque, *torque),
            Drive::Spring { .. } => (f64::NEG_INFINITY, f64::INFINITY),
            Drive::Table(points) => points
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), (_, x)| (lo.min(*x), hi.max(*x))),
            Drive::Hand { mean, sines } => {
                let rms = libm::sqrt(sines.iter().map(|(a, _, _)| 0.5 * a * a).sum());
                (mean - 4.0 * rms, mean + 4.0 * rms)
            }
        }
    }

    /// Times strictly between two others at which the torque has a corner, s.
    pub(crate) fn corners(&self, from: f64, to: f64) -> impl Iterator<Item = f64> + '_ {
        let points = match self {
            Drive::Table(points) => points.as_slice(),
            _ => &[],
        };
        let first = points.partition_point(|p| p.0 <= from);
        points.iter().skip(first).map(|p| p.0).take_while(move |t| *t < to)
    }

    /// Changes neither with time nor with position.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        matches!(self, Drive::Constant(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_straight_between_its_points_and_constant_outside() {
        let d = Drive::new(&DriveParams::Table(vec![(1.0, 0.1), (2.0, 0.3)]), 0).unwrap();
        assert_eq!(d.torque(0.0, 0.0), 0.1);
        assert!((d.torque(1.25, 0.0) - 0.15).abs() < 1e-15);
        assert_eq!(d.torque(9.0, 0.0), 0.3);
    }

    #[test]
    fn a_hand_has_its_mean_and_rms_and_repeats_with_its_seed() {
        let p = DriveParams::Hand { mean: 0.05, rms: 0.01, lowest_frequency: 0.2, highest_frequency: 5.0 };
        let d = Drive::new(&p, 7).unwrap();
        let n = 200_000;
        let (mut sum, mut square) = (0.0, 0.0);
        for i in 0..n {
            let x = d.torque(f64::from(i) * 0.005, 0.0) - 0.05;
            sum += x;
            square += x * x;
        }
        assert!((sum / f64::from(n)).abs() < 1e-4);
        assert!((libm::sqrt(square / f64::from(n)) - 0.01).abs() < 2e-4);
        assert_eq!(d, Drive::new(&p, 7).unwrap());
        assert_ne!(d, Drive::new(&p, 8).unwrap());
    }

    #[test]
    fn each_bad_parameter_is_named() {
        let weight = |mass| DriveParams::Weight { mass, gravity: 9.81, pulley_radius: 0.024 };
        assert_eq!(Drive::new(&weight(-1.0), 0).unwrap_err().field, "mass");
        assert_eq!(Drive::new(&weight(f64::NAN), 0).unwrap_err().field, "mass");
        let table = DriveParams::Table(vec![(0.0, 1.0), (0.0, 2.0)]);
        assert_eq!(Drive::new(&table, 0).unwrap_err().field, "points");
        let hand = DriveParams::Hand { mean: 0.0, rms: 0.01, lowest_frequency: 2.0, highest_frequency: 1.0 };
        assert_eq!(Drive::new(&hand, 0).unwrap_err().field, "highest_frequency");
    }
}
