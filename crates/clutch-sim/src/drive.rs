//! The drive of the shaft: a weight, a spring, a belt, a torque over time (table, ramp, sine, chirp), or a hand.

use crate::tables::Points;
use clutch_core::params::{Params, Range};
use clutch_core::{ParamError, params};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

clutch_core::words! {
    /// Side of the pulley on which a weight hangs.
    pub enum Side {
        /// It drives forwards.
        Forwards = "forwards" default,
        /// It drives backwards.
        Backwards = "backwards",
    }
}

params! {
    /// A weight on a pulley, as in the paper: the torque is `T_u = M g R_p` in (1).
    #[derive(Copy)]
    pub struct WeightDrive<f64>: Default {
        /// Mass, in (1).
        mass: f64 = 0.2, "mass_kg" "M" KG, Range::above(0.0);
        /// Acceleration of gravity in (1), as the paper rounds it.
        gravity: f64 = 9.81, "gravity_m_s2" "g" M_S2, Range::above(0.0);
        /// Radius of the pulley, in (1).
        pulley_radius: f64 = 0.024, "pulley_radius_m" "R_p" M, Range::above(0.0);
        /// Side on which it hangs.
        side: Side = "forwards", "side" "" NONE, Range::ANY;
    }
}

params! {
    /// A spring: the torque is `stiffness · (rest − θ)`. It needs the engine `dormand_prince`.
    #[derive(Copy)]
    pub struct SpringDrive<f64> {
        /// Stiffness.
        stiffness: f64, "stiffness_nm_rad" "" NM_RAD, Range::above(0.0);
        /// Angle from the start at which it pulls no more.
        rest: f64, "rest_deg" "" DEG, Range::ANY;
    }
}

params! {
    /// A belt: spring and damper between the shaft and an end that moves evenly, from where the spring is at rest at the
    /// start. The torque is `stiffness · (speed t − θ) + damping · (speed − θ̇)`. It needs the engine `dormand_prince`.
    #[derive(Copy)]
    pub struct BeltDrive<f64> {
        /// Stiffness.
        stiffness: f64, "stiffness_nm_rad" "" NM_RAD, Range::above(0.0);
        /// Damping.
        damping: f64 = 0.0, "damping_nm_s_rad" "" NM_S_RAD, Range::at_least(0.0);
        /// Speed of the moving end, as an angle of the shaft.
        speed: f64, "speed_deg_s" "" DEG_S, Range::ANY;
    }
}

params! {
    /// A torque that rises, or falls, evenly with time and without end. It needs the engine `dormand_prince`.
    #[derive(Copy)]
    pub struct RampDrive<f64> {
        /// Torque at the start of the run.
        from: f64, "from_nm" "" NM, Range::ANY;
        /// Rise.
        rate: f64, "rate_nm_s" "" NM_S, Range::ANY;
    }
}

params! {
    /// A torque over time: straight lines between points, constant outside. It needs the engine `dormand_prince`.
    pub struct TableDrive<f64> {
        /// Points of time and torque; times rise.
        points: Points, "points_s_nm" "" S_NM, Range::ANY;
    }
    relations(p) {
        /// There is a torque.
        NOT_EMPTY: points, "at least one point" => !p.points.0.is_empty();
    }
}

params! {
    /// A sine about a mean torque: `mean + amplitude sin 2π(frequency t + phase)`. It needs the engine `dormand_prince`.
    #[derive(Copy)]
    pub struct SineDrive<f64> {
        /// Mean torque.
        mean: f64, "mean_nm" "" NM, Range::ANY;
        /// Amplitude.
        amplitude: f64, "amplitude_nm" "" NM, Range::at_least(0.0);
        /// Frequency.
        frequency: f64, "frequency_hz" "" HZ, Range::above(0.0).up_to(1000.0);
        /// Phase at the start of the run.
        phase_turns: f64 = 0.0, "phase_turns" "" TURNS, Range::within(-1.0, 1.0);
    }
}

params! {
    /// A sine about a mean torque whose frequency rises, or falls, evenly with time, and then stays. It needs the engine
    /// `dormand_prince`.
    #[derive(Copy)]
    pub struct ChirpDrive<f64> {
        /// Mean torque.
        mean: f64, "mean_nm" "" NM, Range::ANY;
        /// Amplitude.
        amplitude: f64, "amplitude_nm" "" NM, Range::at_least(0.0);
        /// Frequency at the start of the run.
        from: f64, "from_hz" "" HZ, Range::within(0.0, 1000.0);
        /// Frequency at the end of `duration_s`, and after it.
        to: f64, "to_hz" "" HZ, Range::within(0.0, 1000.0);
        /// Time from the one to the other.
        duration: f64, "duration_s" "" S, Range::above(0.0);
    }
}

params! {
    /// A hand: a mean torque and a random part in a band of frequencies.
    ///
    /// The random part is 48 sines, one at random in each slice of the band; the seed of the run decides them. It
    /// needs the engine `dormand_prince`.
    #[derive(Copy)]
    pub struct HandDrive<f64> {
        /// Mean torque.
        mean: f64, "mean_nm" "" NM, Range::ANY;
        /// Root mean square of the random part.
        rms: f64, "rms_nm" "" NM, Range::at_least(0.0);
        /// Lower end of the band.
        lowest_frequency: f64, "lowest_frequency_hz" "" HZ, Range::at_least(0.0);
        /// Upper end of the band; a hand is no faster than 50 Hz.
        highest_frequency: f64, "highest_frequency_hz" "" HZ, Range::above(0.0).up_to(50.0);
    }
    relations(p) {
        /// The band is not empty.
        BAND: highest_frequency, "a frequency above lowest_frequency_hz" =>
            p.highest_frequency > p.lowest_frequency;
    }
}

clutch_core::choice! {
    /// The drive of the shaft.
    pub enum DriveParams<f64>: Default {
        /// A weight on a pulley.
        Weight(WeightDrive) = "weight",
        /// A spring.
        Spring(SpringDrive) = "spring",
        /// A belt.
        Belt(BeltDrive) = "belt",
        /// A torque over time.
        Table(TableDrive) = "table",
        /// An even rise of torque.
        Ramp(RampDrive) = "ramp",
        /// A sine.
        Sine(SineDrive) = "sine",
        /// A sine of changing frequency.
        Chirp(ChirpDrive) = "chirp",
        /// A hand.
        Hand(HandDrive) = "hand",
    }
}

/// Sines in a hand's random part.
const HAND_SINES: u32 = 48;

/// A driving torque, checked, as a function of time.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// Constant, N m.
    Constant(f64),
    /// `stiffness · (rest + speed t − θ) + damping · (speed − θ̇)`. The damping of the shaft's own velocity is the
    /// plant's viscous damping: [`Drive::damping`].
    Spring {
        /// N m/rad.
        stiffness: f64,
        /// rad
        rest: f64,
        /// N m s/rad.
        damping: f64,
        /// rad/s
        speed: f64,
    },
    /// `from + rate t`.
    Ramp(RampDrive),
    /// (s, N m), straight lines between.
    Table(Vec<(f64, f64)>),
    /// Mean and sines.
    Sines {
        /// N m.
        mean: f64,
        /// Amplitude (N m), angular frequency (rad/s), phase (rad).
        sines: Vec<(f64, f64, f64)>,
    },
    /// Mean and a sine of changing frequency.
    Chirp(ChirpDrive),
}

impl Drive {
    /// Checks the parameters; `seed` decides a hand's phases and frequencies.
    ///
    /// # Errors
    /// The first parameter out of range; of points that do not rise, the value is the number (from 0).
    pub fn new(p: &DriveParams, seed: u64) -> Result<Drive, ParamError> {
        p.check()?;
        match p {
            DriveParams::Weight(WeightDrive { mass, gravity, pulley_radius, side }) => {
                let torque = mass * gravity * pulley_radius;
                Ok(Drive::Constant(if *side == Side::Forwards { torque } else { -torque }))
            }
            DriveParams::Spring(SpringDrive { stiffness, rest }) => {
                Ok(Drive::Spring { stiffness: *stiffness, rest: *rest, damping: 0.0, speed: 0.0 })
            }
            DriveParams::Belt(BeltDrive { stiffness, damping, speed }) => {
                Ok(Drive::Spring { stiffness: *stiffness, rest: 0.0, damping: *damping, speed: *speed })
            }
            DriveParams::Ramp(ramp) => Ok(Drive::Ramp(*ramp)),
            DriveParams::Table(TableDrive { points: Points(points) }) => Ok(Drive::Table(points.clone())),
            DriveParams::Sine(SineDrive { mean, amplitude, frequency, phase_turns }) => {
                let tau = core::f64::consts::TAU;
                Ok(Drive::Sines {
                    mean: *mean,
                    sines: vec![(*amplitude, tau * frequency, tau * phase_turns)],
                })
            }
            DriveParams::Chirp(chirp) => Ok(Drive::Chirp(*chirp)),
            DriveParams::Hand(HandDrive {
                mean,
                rms,
                lowest_frequency: lowest,
                highest_frequency: highest,
            }) => {
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
                Ok(Drive::Sines { mean: *mean, sines })
            }
        }
    }

    /// Viscous damping that the drive adds to the shaft's own, N m s/rad.
    #[must_use]
    pub fn damping(&self) -> f64 {
        if let Drive::Spring { damping, .. } = self { *damping } else { 0.0 }
    }

    /// Torque at a time (s) and a position (rad from the start), without [`Drive::damping`], N m.
    #[must_use]
    pub fn torque(&self, t: f64, position: f64) -> f64 {
        match self {
            Drive::Constant(torque) => *torque,
            Drive::Spring { stiffness, rest, damping, speed } => {
                stiffness * (rest + speed * t - position) + damping * speed
            }
            Drive::Ramp(RampDrive { from, rate }) => from + rate * t,
            Drive::Table(points) => {
                let after = points.partition_point(|p| p.0 <= t);
                match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
                    (Some((t0, a)), Some((t1, b))) => a + (b - a) * (t - t0) / (t1 - t0),
                    (Some((_, end)), None) | (None, Some((_, end))) => *end,
                    (None, None) => 0.0,
                }
            }
            Drive::Sines { mean, sines } => {
                mean + sines.iter().map(|(a, w, phase)| a * libm::sin(w * t + phase)).sum::<f64>()
            }
            Drive::Chirp(ChirpDrive { mean, amplitude, from, to, duration }) => {
                let (rising, after) = (t.min(*duration), (t - duration).max(0.0));
                let turns = rising * (from + 0.5 * (to - from) * rising / duration) + to * after;
                mean + amplitude * libm::sin(core::f64::consts::TAU * turns)
            }
        }
    }

    /// Lowest and highest torque that can come, N m: of a spring all, of many sines the mean ± 4 rms.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        match self {
            Drive::Constant(torque) => (*torque, *torque),
            Drive::Spring { .. } => (f64::NEG_INFINITY, f64::INFINITY),
            Drive::Ramp(RampDrive { from, rate }) => {
                let end = |sign: f64| if sign * rate > 0.0 { sign * f64::INFINITY } else { *from };
                (end(-1.0), end(1.0))
            }
            Drive::Table(points) => points
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), (_, x)| (lo.min(*x), hi.max(*x))),
            Drive::Sines { mean, sines } => {
                let rms = libm::sqrt(sines.iter().map(|(a, _, _)| 0.5 * a * a).sum());
                let most = sines.iter().map(|(a, _, _)| a.abs()).sum::<f64>().min(4.0 * rms);
                (mean - most, mean + most)
            }
            Drive::Chirp(ChirpDrive { mean, amplitude, .. }) => (mean - amplitude, mean + amplitude),
        }
    }

    /// Times strictly between two others at which the torque has a corner, s.
    pub(crate) fn corners(&self, from: f64, to: f64) -> impl Iterator<Item = f64> + '_ {
        let (points, end): (&[_], _) = match self {
            Drive::Table(points) => (points, None),
            // From there on the frequency stays.
            Drive::Chirp(chirp) => (&[], Some(chirp.duration)),
            _ => (&[], None),
        };
        let first = points.partition_point(|p| p.0 <= from);
        let end = end.filter(move |t| *t > from && *t < to);
        points.iter().skip(first).map(|p| p.0).take_while(move |t| *t < to).chain(end)
    }

    /// The most that the torque of a shaft at rest bends between two corners, N m/s².
    pub(crate) fn curvature(&self) -> f64 {
        match self {
            Drive::Constant(_) | Drive::Spring { .. } | Drive::Ramp(_) | Drive::Table(_) => 0.0,
            Drive::Sines { sines, .. } => sines.iter().map(|(a, w, _)| a.abs() * w * w).sum(),
            Drive::Chirp(ChirpDrive { amplitude, from, to, duration, .. }) => {
                let tau = core::f64::consts::TAU;
                let fastest = tau * from.max(*to);
                amplitude * (fastest * fastest + tau * (to - from).abs() / duration)
            }
        }
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
    fn a_chirp_rises_to_its_last_frequency_and_keeps_it() {
        let (from, to, duration) = (2.0, 10.0, 4.0);
        let p = ChirpDrive { mean: 0.1, amplitude: 0.05, from, to, duration };
        let d = Drive::new(&DriveParams::Chirp(p), 0).unwrap();
        assert_eq!(d.range(), (0.05, 0.15000000000000002));
        // Turns until t: from t + (to − from) t²/2D; 24 by the end, and ten a second after.
        for (t, turns) in [(0.0, 0.0), (1.0, 3.0), (4.0, 24.0), (4.25, 26.5), (5.025, 34.25)] {
            let expected = 0.1 + 0.05 * libm::sin(core::f64::consts::TAU * turns);
            assert!((d.torque(t, 0.0) - expected).abs() < 1e-12, "{t} s");
        }
        assert_eq!(d.corners(3.9, 4.1).collect::<Vec<_>>(), [4.0]);
        assert_eq!(d.corners(4.0, 4.1).count() + d.corners(3.0, 4.0).count(), 0);
    }

    #[test]
    fn a_sine_has_its_amplitude_frequency_and_phase() {
        let p = SineDrive { mean: -0.02, amplitude: 0.06, frequency: 0.5, phase_turns: 0.25 };
        let d = Drive::new(&DriveParams::Sine(p), 0).unwrap();
        assert_eq!(d.range(), (-0.08, 0.039999999999999994));
        assert!((d.torque(0.0, 0.0) - 0.04).abs() < 1e-15);
        assert!((d.torque(1.0, 9.0) + 0.08).abs() < 1e-15);
    }

    #[test]
    fn a_table_is_straight_between_its_points_and_constant_outside() {
        let d =
            Drive::new(&DriveParams::Table(TableDrive { points: Points(vec![(1.0, 0.1), (2.0, 0.3)]) }), 0)
                .unwrap();
        assert_eq!(d.torque(0.0, 0.0), 0.1);
        assert!((d.torque(1.25, 0.0) - 0.15).abs() < 1e-15);
        assert_eq!(d.torque(9.0, 0.0), 0.3);
    }

    #[test]
    fn a_hand_has_its_mean_and_rms_and_repeats_with_its_seed() {
        let p = DriveParams::Hand(HandDrive {
            mean: 0.05,
            rms: 0.01,
            lowest_frequency: 0.2,
            highest_frequency: 5.0,
        });
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
        let weight = |mass| DriveParams::Weight(WeightDrive { mass, ..WeightDrive::default() });
        assert_eq!(Drive::new(&weight(-1.0), 0).unwrap_err().field(), "mass");
        assert_eq!(Drive::new(&weight(f64::NAN), 0).unwrap_err().field(), "mass");
        let table = DriveParams::Table(TableDrive { points: Points(vec![(0.0, 1.0), (0.0, 2.0)]) });
        assert_eq!(Drive::new(&table, 0).unwrap_err().field(), "points");
        let hand = DriveParams::Hand(HandDrive {
            mean: 0.0,
            rms: 0.01,
            lowest_frequency: 2.0,
            highest_frequency: 1.0,
        });
        assert_eq!(Drive::new(&hand, 0).unwrap_err().field(), "highest_frequency");
    }
}
