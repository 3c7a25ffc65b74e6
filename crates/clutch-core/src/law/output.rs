//! The end that all laws share: bumpless start, limits, and what a non-number becomes.

use crate::error::{cast, require};
use crate::{Micros, ParamError, Real};

/// Output stage of a law; `Default` = the paper's 0 to 10 V without bumpless start, braking
/// fully on an invalid demand.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct OutputParams<T = f64> {
    /// Lowest voltage, V. Above 0 the pad never lifts.
    pub lowest: T,
    /// Highest voltage, V.
    pub highest: T,
    /// Voltage applied when the demand is not a number, V; between the two limits.
    pub on_invalid: T,
    /// Time constant with which the difference between the voltage found at start and the
    /// law's first demand decays, s; 0 starts with the law's own demand.
    pub bumpless_time: T,
}

cast!(OutputParams { lowest, highest, on_invalid, bumpless_time });

impl<T: Real> Default for OutputParams<T> {
    fn default() -> Self {
        let highest = T::from_i32(10);
        OutputParams { lowest: T::ZERO, highest, on_invalid: highest, bumpless_time: T::ZERO }
    }
}

/// Whether and where the output stage changed the demand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Limit {
    /// The demand went out as it was.
    #[default]
    None,
    /// Raised to the lowest voltage: the law asks for a torque that a brake cannot give.
    Lowest,
    /// Lowered to the highest voltage.
    Highest,
    /// The demand was not a number; the voltage for that case went out.
    Invalid,
}

/// The checked output stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output<T> {
    lowest: T,
    highest: T,
    on_invalid: T,
    decay: T,
}

/// What the output stage remembers: the offset of a bumpless start, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputState<T> {
    offset: T,
}

impl<T: Real> Output<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// `lowest` negative (a pad cannot pull), `highest` not above it, `on_invalid` outside the
    /// two, `bumpless_time` negative; `period` out of range.
    pub fn new(p: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        let period = period.period::<T>()?;
        require(
            "lowest",
            p.lowest,
            p.lowest >= T::ZERO,
            "a finite voltage of at least 0 V: a pad can only push",
        )?;
        require("highest", p.highest, p.highest > p.lowest, "a finite voltage above the lowest, V")?;
        require(
            "on_invalid",
            p.on_invalid,
            p.on_invalid >= p.lowest && p.on_invalid <= p.highest,
            "a voltage from the lowest to the highest, V (it does not follow them)",
        )?;
        require(
            "bumpless_time",
            p.bumpless_time,
            p.bumpless_time >= T::ZERO,
            "a finite time of at least 0 s",
        )?;
        let decay = if p.bumpless_time > T::ZERO { (-(period / p.bumpless_time)).exp() } else { T::ZERO };
        Ok(Output { lowest: p.lowest, highest: p.highest, on_invalid: p.on_invalid, decay })
    }

    /// Lowest voltage, V.
    #[must_use]
    pub fn lowest(&self) -> T {
        self.lowest
    }

    /// Highest voltage, V.
    #[must_use]
    pub fn highest(&self) -> T {
        self.highest
    }

    /// The state from which a law that demands `demand` starts at the voltage `applied`.
    #[must_use]
    pub fn start(&self, demand: T, applied: T) -> OutputState<T> {
        let offset = applied - demand;
        let bumpless = self.decay > T::ZERO && offset.is_finite();
        OutputState { offset: if bumpless { offset } else { T::ZERO } }
    }

    /// A law's demand in, the voltage out, V.
    #[inline]
    pub fn apply(&self, state: &mut OutputState<T>, demand: T) -> (T, Limit) {
        let demand = demand + state.offset;
        state.offset = state.offset * self.decay;
        if demand >= self.lowest {
            if demand <= self.highest { (demand, Limit::None) } else { (self.highest, Limit::Highest) }
        } else if demand < self.lowest {
            (self.lowest, Limit::Lowest)
        } else {
            (self.on_invalid, Limit::Invalid)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn whatever_a_law_demands_the_brake_gets_a_voltage_within_limits(bits in any::<u64>()) {
            let p = OutputParams { lowest: 0.5, on_invalid: 4.0, ..OutputParams::<f64>::default() };
            let out = Output::new(&p, Micros(1000)).unwrap();
            let demand = f64::from_bits(bits);
            let (volts, limit) = out.apply(&mut OutputState::default(), demand);
            prop_assert!((0.5..=10.0).contains(&volts));
            prop_assert_eq!(limit == Limit::Invalid, demand.is_nan());
            if demand.is_nan() { prop_assert_eq!(volts, 4.0); }
        }
    }

    #[test]
    fn a_bumpless_start_begins_at_the_applied_voltage_and_decays_to_the_law() {
        let p = OutputParams { bumpless_time: 0.05, ..OutputParams::<f64>::default() };
        let out = Output::new(&p, Micros(1000)).unwrap();
        let mut state = out.start(1.0, 2.25);
        for k in 0..200 {
            let (volts, _) = out.apply(&mut state, 1.0);
            let expected = 1.0 + 1.25 * (-f64::from(k) * 0.001 / 0.05).exp();
            assert!((volts - expected).abs() < 1e-12, "tick {k}");
        }
    }

    #[test]
    fn each_bad_parameter_is_named() {
        let d = OutputParams::<f64>::default();
        for (bad, field) in [
            (OutputParams { lowest: -1.0, ..d }, "lowest"),
            (OutputParams { highest: 0.0, ..d }, "highest"),
            (OutputParams { on_invalid: 11.0, ..d }, "on_invalid"),
            (OutputParams { bumpless_time: f64::NAN, ..d }, "bumpless_time"),
        ] {
            assert_eq!(Output::new(&bad, Micros(1000)).unwrap_err().field, field);
        }
    }
}
