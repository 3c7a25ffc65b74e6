//! The end that all laws share: bumpless start, limits, and what a non-number becomes.

use crate::params::{Range, Table};
use crate::{ActuatorKind, Arithmetic, Each, Micros, ParamError, Real};

crate::params! {
    /// Output stage of a law. The defaults are for a brake: the paper's 0 to 10 V without bumpless start, and full braking
    /// on an invalid demand.
    pub struct OutputParams<T>: Default {
        /// Lowest voltage. With a brake at least 0, as a pad can only push; above 0 the pad never lifts.
        lowest: T = 0.0, "lowest_v" "" V, Range::ANY;
        /// Highest voltage. Lower `on_invalid_v` together with it.
        highest: T = 10.0, "highest_v" "" V, Range::ANY;
        /// Voltage for a demand that is not a number; with a motor 0.
        on_invalid: T = 10.0, "on_invalid_v" "" V, Range::ANY;
        /// Time constant of a bumpless start, with which the difference between the voltage found at start and the
        /// law's first demand decays; 0 starts with the law's own demand.
        bumpless_time: T = 0.0, "bumpless_time_s" "" S, Range::at_least(0.0);
    }
    relations(p) {
        /// The range is not empty.
        ABOVE_LOWEST: highest, "a voltage above lowest_v" => p.highest > p.lowest;
        /// The voltage for an invalid demand is one of the range.
        WITHIN_LIMITS: on_invalid, "a voltage from lowest_v to highest_v (it does not follow them)" =>
            p.on_invalid >= p.lowest && p.on_invalid <= p.highest;
        /// A pad can only push.
        PUSHES: lowest, "a voltage of at least 0 with a brake, whose pad can only push (rig.actuator, model.actuator)";
        /// A motor drives both ways.
        DRIVES: lowest, "a voltage below 0, as -10.0, with an actuator that drives (model.actuator); a motor needs on_invalid_v = 0, too";
        /// An invalid demand moves nothing.
        MOVES_NOTHING: on_invalid, "0 with a motor, which any other voltage drives, and at least 0 with a brake and a motor (model.actuator)";
        /// The converter reaches the lowest voltage.
        LOWEST_REACHED: lowest, "a voltage that the converter reaches: not below rig.dac.lowest_v";
        /// The converter reaches the highest voltage.
        HIGHEST_REACHED: highest, "a voltage that the converter reaches: not above rig.dac.highest_v";
    }
}

impl<T: Real> OutputParams<T> {
    /// Checks the limits against an actuator.
    ///
    /// # Errors
    /// A voltage below 0 with a brake, none below 0 with what drives, one for an invalid demand that drives.
    pub fn check_for(&self, kind: ActuatorKind) -> Result<(), ParamError<T>> {
        let below = self.lowest < T::ZERO;
        if kind.two_sided() {
            OutputParams::DRIVES.require(self.lowest, below)?;
        } else {
            OutputParams::PUSHES.require(self.lowest, !below)?;
        }
        OutputParams::MOVES_NOTHING.require(self.on_invalid, !kind.drives_at(self.on_invalid))?;
        Ok(())
    }

    /// The default output stage with these limits, V; an invalid demand brakes with the higher.
    #[must_use]
    pub const fn within(lowest: T, highest: T) -> Self {
        OutputParams { lowest, highest, on_invalid: highest, bumpless_time: T::ZERO }
    }
}

/// The checked output stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output<T> {
    lowest: T,
    highest: T,
    on_invalid: T,
    decay: T,
}

/// Memory of the output stage: the offset of a bumpless start, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputState<T> {
    offset: T,
}

impl<T: Arithmetic> OutputState<T> {
    /// The memory `a` where the mask is true, `b` elsewhere.
    #[must_use]
    pub fn select(mask: T::Mask, a: &Self, b: &Self) -> Self {
        OutputState { offset: T::select(mask, a.offset, b.offset) }
    }
}

impl<T: Real> Output<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range; `period` out of range.
    #[inline(never)] // each law asks for one: a board needs the code once
    pub fn new(p: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        let period = period.period::<T>()?;
        p.check_rows()?;
        let decay = if p.bumpless_time > T::ZERO { (-(period / p.bumpless_time)).exp() } else { T::ZERO };
        Ok(Output { lowest: p.lowest, highest: p.highest, on_invalid: p.on_invalid, decay })
    }
}

impl<T: Arithmetic> Output<T> {
    /// The output stages of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Output<L> {
        Output {
            lowest: each(&|o| o.lowest),
            highest: each(&|o| o.highest),
            on_invalid: each(&|o| o.on_invalid),
            decay: each(&|o| o.decay),
        }
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

    /// Lowest and highest voltage, V.
    #[must_use]
    pub fn limits(&self) -> (T, T) {
        (self.lowest, self.highest)
    }

    /// Voltage for an invalid demand, V.
    #[must_use]
    pub fn on_invalid(&self) -> T {
        self.on_invalid
    }

    /// The state from which a law that demands `demand` starts at the voltage `applied`.
    #[must_use]
    pub fn start(&self, demand: T, applied: T) -> OutputState<T> {
        let offset = applied - demand;
        let bumpless = T::ZERO.less(self.decay) & offset.is_finite();
        OutputState { offset: T::select(bumpless, offset, T::ZERO) }
    }

    /// A law's demand in, the voltage out, V.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn apply(&self, state: &mut OutputState<T>, demand: T) -> (T, T::Limit) {
        let demand = demand + state.offset;
        state.offset = state.offset * self.decay;
        demand.limited(self.lowest, self.highest, self.on_invalid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::Limit;
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
            (OutputParams { lowest: f64::NAN, ..d }, "lowest"),
            (OutputParams { highest: 0.0, ..d }, "highest"),
            (OutputParams { on_invalid: 11.0, ..d }, "on_invalid"),
            (OutputParams { bumpless_time: f64::NAN, ..d }, "bumpless_time"),
        ] {
            assert_eq!(Output::new(&bad, Micros(1000)).unwrap_err().field(), field);
        }
    }
}
