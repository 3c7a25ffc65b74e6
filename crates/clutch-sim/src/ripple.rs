//! Friction that varies along the disc.

use crate::lane::{Lane, MOST_LANES};
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
        POSITIVE: rms, "a number that, times the root of twice the number of waves (from lowest_waves_per_turn to highest_waves_per_turn), stays below 1" =>
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

params! {
    /// Friction that varies along the disc: one wave, as a pad makes that runs on a disc which wobbles.
    ///
    /// It adds `A sin(n θ + φ)` to the factor on friction, beside a ripple. It needs the engine `dormand_prince`.
    pub struct RunoutParams<f64> {
        /// Amplitude of the variation, as a share of the friction.
        amplitude: f64, "amplitude" "A" NONE, Range::at_least(0.0).below(1.0);
        /// Waves in a turn: 1 for a disc that is not square to its shaft, 2 for one that is bent like a saddle.
        waves: u32 = 1, "waves_per_turn" "n" WAVES_PER_TURN, Range::within(1.0, 1000.0);
        /// Phase at the encoder's zero.
        phase: f64 = 0.0, "phase_deg" "φ" DEG, Range::ANY;
    }
    relations(p) {
        /// Friction does not reach 0.
        POSITIVE: amplitude, "a share that, with the largest sum of the waves of rig.ripple, stays below 1";
    }
}

/// The factor on friction along a disc: 1, and what its patterns add. Of one disc, or of several that differ in their
/// numbers alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Ripple<T = f64> {
    band: Option<Band<T>>,
    runout: Option<Runout<T>>,
}

/// One wave, `amplitude sin(waves θ + phase)`.
#[derive(Clone, Debug, PartialEq)]
struct Runout<T> {
    amplitude: T,
    waves: T,
    phase: T,
}

/// Shape that all discs in the lanes of one vector share: skipped waves and waves of the ripple, and whether there is
/// a run-out.
pub(crate) type Shape = (Option<(u32, usize)>, bool);

impl Ripple {
    /// Checks the patterns; `seed` decides the phases of the ripple. None if there is no pattern: the disc is even.
    ///
    /// # Errors
    /// The first parameter out of range; the amplitude of a run-out with which friction would reach 0.
    pub fn new(
        ripple: Option<&RippleParams>,
        runout: Option<&RunoutParams>,
        seed: u64,
    ) -> Result<Option<Ripple>, ParamError> {
        let band = ripple.map(|p| Band::new(p, seed)).transpose()?;
        runout.map_or(Ok(()), RunoutParams::check_rows)?;
        let wave =
            |r: &RunoutParams| Runout { amplitude: r.amplitude, waves: f64::from(r.waves), phase: r.phase };
        let both = Ripple { band, runout: runout.map(wave) };
        if let Some(runout) = runout {
            RunoutParams::POSITIVE.require(runout.amplitude, both.largest() < 1.0)?;
        }
        Ok((both.band.is_some() || both.runout.is_some()).then_some(both))
    }

    /// The factor at a position.
    #[must_use]
    pub fn factor(&self, position: f64) -> f64 {
        self.at(position)
    }

    /// Largest departure from 1 that the factor can have.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.band.as_ref().map_or(0.0, Band::largest) + self.runout.as_ref().map_or(0.0, |r| r.amplitude)
    }

    /// Root mean square of the factor's slope along the disc, 1/rad.
    #[must_use]
    pub fn slope(&self) -> f64 {
        let band = self.band.as_ref().map_or(0.0, Band::slope);
        let runout = self.runout.as_ref().map_or(0.0, |r| r.amplitude * r.waves);
        libm::sqrt(band * band + 0.5 * runout * runout)
    }

    /// Its shape.
    pub(crate) fn shape(&self) -> Shape {
        (self.band.as_ref().map(|band| (band.skipped, band.phases.len())), self.runout.is_some())
    }
}

impl<T> Ripple<T> {
    /// The factor at a position.
    #[inline(always)]
    pub(crate) fn at(&self, position: T) -> T
    where
        T: Lane,
    {
        let even = match &self.band {
            None => T::ONE,
            Some(band) => T::ONE + band.at(position),
        };
        match &self.runout {
            None => even,
            Some(r) => even + r.amplitude * (r.waves * position + r.phase).sin(),
        }
    }

    /// Discs of several runs as one, whose shapes are those of the first.
    pub(crate) fn in_lanes(each: &[&Ripple]) -> Option<Self>
    where
        T: Lane,
    {
        let first = each.first()?;
        let mut all = Ripple {
            band: first.band.as_ref().map(|band| Band {
                amplitude: T::ZERO,
                spacing: T::ZERO,
                skipped: band.skipped,
                phases: vec![(T::ZERO, T::ZERO); band.phases.len()],
            }),
            runout: first.runout.as_ref().map(|_| Runout {
                amplitude: T::ZERO,
                waves: T::ZERO,
                phase: T::ZERO,
            }),
        };
        all.take(|i| each.get(i).copied());
        Some(all)
    }

    /// Takes the numbers of other discs of its shape; a disc of another shape counts as even.
    #[inline(always)]
    pub(crate) fn take<'r>(&mut self, each: impl Fn(usize) -> Option<&'r Ripple>)
    where
        T: Lane,
    {
        if let Some(all) = &mut self.band {
            let bands: [_; MOST_LANES] = std::array::from_fn(|i| each(i % T::WIDTH)?.band.as_ref());
            let of = |get: fn(&Band<f64>) -> f64| T::of(|i| bands[i].map_or(0.0, get));
            all.amplitude = of(|band| band.amplitude);
            all.spacing = of(|band| band.spacing);
            let phases = bands.map(|band| band.map_or(&[][..], |band| &band.phases[..]));
            for (n, phase) in all.phases.iter_mut().enumerate() {
                let of = |i: usize| phases[i].get(n).copied().unwrap_or_default();
                *phase = (T::of(|i| of(i).0), T::of(|i| of(i).1));
            }
        }
        if let Some(all) = &mut self.runout {
            let of = |get: fn(&Runout<f64>) -> f64| {
                T::of(|i| each(i).and_then(|r| r.runout.as_ref()).map_or(0.0, get))
            };
            *all = Runout { amplitude: of(|r| r.amplitude), waves: of(|r| r.waves), phase: of(|r| r.phase) };
        }
    }
}

/// The waves `amplitude Σ_n sin(n θ + φ_n)`, `n = lowest … highest`.
#[derive(Clone, Debug, PartialEq)]
struct Band<T> {
    amplitude: T,
    spacing: T,
    /// Multiples of the spacing before the first wave.
    skipped: u32,
    /// Sine and cosine of each wave's phase.
    phases: Vec<(T, T)>,
}

impl Band<f64> {
    fn new(p: &RippleParams, seed: u64) -> Result<Self, ParamError> {
        p.check_rows()?;
        let (waves, amplitude) = (p.waves(), p.amplitude());
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x7269_7070_6c65);
        let phases = (0..waves).map(|_| libm::sincos(core::f64::consts::TAU * rng.random::<f64>())).collect();
        Ok(Band { amplitude, spacing: f64::from(p.spacing), skipped: p.lowest / p.spacing - 1, phases })
    }

    fn largest(&self) -> f64 {
        self.amplitude * self.phases.len() as f64
    }

    /// Root mean square of the slope, 1/rad.
    fn slope(&self) -> f64 {
        let waves = (1..=self.phases.len() as u32).map(|i| self.spacing * f64::from(self.skipped + i));
        self.amplitude * libm::sqrt(0.5 * waves.map(|n| n * n).sum::<f64>())
    }
}

impl<T: Lane> Band<T> {
    #[inline(always)]
    fn at(&self, position: T) -> T {
        // The sines of all multiples from one sine and cosine, by the addition theorem.
        let (s1, c1) = (self.spacing * position).sincos();
        let mut wave = (s1, c1);
        for _ in 0..self.skipped {
            wave = (wave.0 * c1 + wave.1 * s1, wave.1 * c1 - wave.0 * s1);
        }
        let mut sum = T::ZERO;
        for (sp, cp) in &self.phases {
            sum = sum + (wave.0 * *cp + wave.1 * *sp);
            wave = (wave.0 * c1 + wave.1 * s1, wave.1 * c1 - wave.0 * s1);
        }
        self.amplitude * sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band(p: &RippleParams, seed: u64) -> Ripple {
        Ripple::new(Some(p), None, seed).unwrap().unwrap()
    }

    #[test]
    fn patterns_add_up_and_a_disc_without_one_is_even() {
        let p = RippleParams { rms: 0.1, lowest: 160, highest: 640, spacing: 40 };
        let tilted = RunoutParams { amplitude: 0.2, waves: 1, phase: 0.5 };
        let (fine, both) = (band(&p, 3), Ripple::new(Some(&p), Some(&tilted), 3).unwrap().unwrap());
        let alone = Ripple::new(None, Some(&tilted), 3).unwrap().unwrap();
        for i in 0..100 {
            let x = f64::from(i) * 0.37;
            let wave = 0.2 * libm::sin(x + 0.5);
            assert!((alone.factor(x) - 1.0 - wave).abs() < 1e-14);
            assert!((both.factor(x) - fine.factor(x) - wave).abs() < 1e-14);
        }
        assert!((alone.largest() - 0.2).abs() < 1e-15);
        assert!((both.largest() - fine.largest() - 0.2).abs() < 1e-15);
        assert_eq!(Ripple::new(None, None, 3).unwrap(), None);
        let much = RunoutParams { amplitude: 1.0 - fine.largest(), ..tilted };
        assert_eq!(Ripple::new(Some(&p), Some(&much), 3).unwrap_err().field(), "amplitude");
        assert!(Ripple::new(None, Some(&much), 3).is_ok());
        for (bad, field) in [
            (RunoutParams { amplitude: 1.0, ..tilted.clone() }, "amplitude"),
            (RunoutParams { amplitude: f64::NAN, ..tilted.clone() }, "amplitude"),
            (RunoutParams { waves: 0, ..tilted.clone() }, "waves"),
            (RunoutParams { phase: f64::INFINITY, ..tilted }, "phase"),
        ] {
            assert_eq!(Ripple::new(None, Some(&bad), 1).unwrap_err().field(), field);
        }
    }

    #[test]
    fn friction_along_the_disc_has_its_rms_closes_after_a_turn_and_repeats_with_its_seed() {
        let p = RippleParams { rms: 0.15, lowest: 160, highest: 640, spacing: 40 };
        let r = band(&p, 3);
        let n = 100_000;
        let tau = core::f64::consts::TAU;
        let off = |i: i32| r.factor(tau * f64::from(i) / f64::from(n)) - 1.0;
        let square: f64 = (0..n).map(|i| off(i) * off(i)).sum();
        assert!((libm::sqrt(square / f64::from(n)) - 0.15).abs() < 1e-9);
        assert!((r.factor(0.3) - r.factor(0.3 + tau)).abs() < 1e-10);
        assert_eq!(r, band(&p, 3));
        assert_ne!(r, band(&p, 4));
    }

    #[test]
    fn the_slope_is_that_of_the_factor() {
        let p = RippleParams { rms: 0.1, lowest: 160, highest: 640, spacing: 40 };
        let tilted = RunoutParams { amplitude: 0.2, waves: 100, phase: 0.5 };
        let (n, tau) = (200_000, core::f64::consts::TAU);
        for r in [band(&p, 3), Ripple::new(Some(&p), Some(&tilted), 3).unwrap().unwrap()] {
            let step = tau / f64::from(n);
            let slope = |i: i32| (r.factor(step * f64::from(i + 1)) - r.factor(step * f64::from(i))) / step;
            let square: f64 = (0..n).map(|i| slope(i) * slope(i)).sum();
            let rms = libm::sqrt(square / f64::from(n));
            assert!((r.slope() / rms - 1.0).abs() < 1e-4, "{} {rms}", r.slope());
        }
    }

    #[test]
    fn the_recurrence_is_the_sum_of_sines() {
        let p = RippleParams { rms: 0.1, lowest: 82, highest: 246, spacing: 41 };
        let r = Band::new(&p, 9).unwrap();
        for i in 0..100 {
            let x = f64::from(i) * 0.37;
            let direct: f64 = r
                .phases
                .iter()
                .enumerate()
                .map(|(j, (sp, cp))| libm::sin(41.0 * (j + 2) as f64 * x + libm::atan2(*sp, *cp)))
                .sum();
            assert!((r.at(x) - r.amplitude * direct).abs() < 1e-11);
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
            assert_eq!(Ripple::new(Some(&bad), None, 1).unwrap_err().field(), field);
        }
    }
}
