//! Friction that varies along the disc.

use clutch_core::params::{Range, Table};
use clutch_core::{ParamError, params};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

params! {
    /// Friction that varies along the disc: a band of waves with one amplitude and random phases.
    ///
    /// The factor on friction is `1 + A Σ sin(n θ + φ_n)` over `n = lowest, lowest + spacing, …, highest`; the seed of
    /// the run decides the phases. A disc is closed, so each wave fits a whole number of times into a turn. It
    /// needs the engine `dormand_prince`.
    pub struct RippleParams<f64> {
        /// Root mean square of the variation, as a share of the friction.
        rms: f64, "rms" "" NONE, Range::at_least(0.0);
        /// Longest wave.
        lowest: u32, "lowest_waves_per_turn" "" WAVES_PER_TURN, Range::within(1.0, 4294967295.0);
        /// Shortest wave.
        highest: u32, "highest_waves_per_turn" "" WAVES_PER_TURN, Range::within(1.0, 4294967295.0);
        /// From one wave to the next: the pattern repeats that often in a turn.
        spacing: u32, "spacing_waves_per_turn" "" WAVES_PER_TURN, Range::within(1.0, 4294967295.0);
    }
    relations(p) {
        /// Waves fit the pattern.
        LOWEST_FITS: lowest, "a multiple of spacing_waves_per_turn" => p.lowest.is_multiple_of(p.spacing);
        /// Waves fit the pattern, and are not too many.
        HIGHEST_FITS: highest,
            "a multiple of spacing_waves_per_turn, not below lowest_waves_per_turn, less than 64 spacings above it and at most 1000 spacings" =>
            p.highest >= p.lowest
                && p.highest.is_multiple_of(p.spacing)
                && (p.highest - p.lowest) / p.spacing < 64
                && p.highest / p.spacing <= 1000;
        /// Friction does not reach 0.
        POSITIVE: rms, "a number that, times the root of twice the number of waves, stays below 1" =>
            p.amplitude() * f64::from(p.waves()) < 1.0;
    }
}

impl RippleParams {
    fn waves(&self) -> u32 {
        (self.highest - self.lowest) / self.spacing + 1
    }

    fn amplitude(&self) -> f64 {
        self.rms * libm::sqrt(2.0 / f64::from(self.waves()))
    }
}

/// The factor `1 + amplitude Σ_n sin(n θ + φ_n)` on friction, `n = lowest … highest`.
#[derive(Clone, Debug, PartialEq)]
pub struct Ripple {
    amplitude: f64,
    spacing: f64,
    /// Multiples of the spacing before the first wave.
    skipped: u32,
    /// Sine and cosine of each wave's phase.
    phases: Vec<(f64, f64)>,
}

impl Ripple {
    /// Checks the parameters; `seed` decides the phases.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &RippleParams, seed: u64) -> Result<Ripple, ParamError> {
        p.check_rows()?;
        let (waves, amplitude) = (p.waves(), p.amplitude());
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x7269_7070_6c65);
        let phases = (0..waves).map(|_| libm::sincos(core::f64::consts::TAU * rng.random::<f64>())).collect();
        Ok(Ripple { amplitude, spacing: f64::from(p.spacing), skipped: p.lowest / p.spacing - 1, phases })
    }

    /// The factor at a position.
    #[must_use]
    pub fn factor(&self, position: f64) -> f64 {
        // The sines of all multiples from one sine and cosine, by the addition theorem.
        let (s1, c1) = libm::sincos(self.spacing * position);
        let next = |(s, c): (f64, f64)| (s * c1 + c * s1, c * c1 - s * s1);
        let mut wave = (s1, c1);
        for _ in 0..self.skipped {
            wave = next(wave);
        }
        let mut sum = 0.0;
        for (sp, cp) in &self.phases {
            sum += wave.0 * cp + wave.1 * sp;
            wave = next(wave);
        }
        1.0 + self.amplitude * sum
    }

    /// Largest departure from 1 that the factor can have.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.amplitude * self.phases.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_along_the_disc_has_its_rms_closes_after_a_turn_and_repeats_with_its_seed() {
        let p = RippleParams { rms: 0.15, lowest: 160, highest: 640, spacing: 40 };
        let r = Ripple::new(&p, 3).unwrap();
        let n = 100_000;
        let tau = core::f64::consts::TAU;
        let off = |i: i32| r.factor(tau * f64::from(i) / f64::from(n)) - 1.0;
        let square: f64 = (0..n).map(|i| off(i) * off(i)).sum();
        assert!((libm::sqrt(square / f64::from(n)) - 0.15).abs() < 1e-9);
        assert!((r.factor(0.3) - r.factor(0.3 + tau)).abs() < 1e-10);
        assert_eq!(r, Ripple::new(&p, 3).unwrap());
        assert_ne!(r, Ripple::new(&p, 4).unwrap());
    }

    #[test]
    fn the_recurrence_is_the_sum_of_sines() {
        let p = RippleParams { rms: 0.1, lowest: 82, highest: 246, spacing: 41 };
        let r = Ripple::new(&p, 9).unwrap();
        for i in 0..100 {
            let x = f64::from(i) * 0.37;
            let direct: f64 = r
                .phases
                .iter()
                .enumerate()
                .map(|(j, (sp, cp))| libm::sin(41.0 * (j + 2) as f64 * x + libm::atan2(*sp, *cp)))
                .sum();
            assert!((r.factor(x) - 1.0 - r.amplitude * direct).abs() < 1e-11);
        }
    }

    #[test]
    fn each_bad_parameter_is_named() {
        let good = RippleParams { rms: 0.1, lowest: 160, highest: 640, spacing: 40 };
        for (bad, field) in [
            (RippleParams { rms: 0.4, ..good.clone() }, "rms"),
            (RippleParams { rms: f64::NAN, ..good.clone() }, "rms"),
            (RippleParams { lowest: 170, ..good.clone() }, "lowest"),
            (RippleParams { highest: 120, ..good.clone() }, "highest"),
            (RippleParams { spacing: 0, ..good }, "spacing"),
        ] {
            assert_eq!(Ripple::new(&bad, 1).unwrap_err().field(), field);
        }
    }
}
