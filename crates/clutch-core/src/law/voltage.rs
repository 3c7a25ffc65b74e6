//! An open-loop voltage: constant, or after a wait on its way from one voltage to another, once or to and fro.
//!
//! ```text
//! u = u_0 until t_w,   then u̇ = ± r between u_0 and u_1
//! ```
//!
//! For what is measured without control: the voltage at which a shaft breaks away, friction over speed, a motor's
//! gain, a fall of some milliseconds. A shaft under an open-loop voltage follows no path.

use super::{Beside, Command, ControlLaw, Listed, Output, OutputParams, OutputState, Tick};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Micros, ParamError, Real};

crate::params! {
    /// An open-loop voltage, whatever the shaft does. It begins at `start_v`, and after a wait goes to `end_v` at a rate.
    pub struct VoltageParams<T>: Default {
        /// Voltage at the start.
        start: T = 0.0, "start_v" "u_0" V, Range::ANY;
        /// Voltage at the end of the way.
        end: T = 0.0, "end_v" "u_1" V, Range::ANY;
        /// Rate from the one to the other; 0 stays at the start.
        rate: T = 0.0, "rate_v_s" "r" V_S, Range::at_least(0.0);
        /// Time at the start before it goes, in whole periods.
        wait: T = 0.0, "wait_s" "t_w" S, Range::at_least(0.0);
        /// `true` if it goes to and fro between them; else it stays at the end.
        returns: bool = false, "returns" "" NONE, Range::ANY;
    }
    relations(p) {
        /// It gets where it is to go.
        GOES: rate, "a rate above 0 where an end_v is given" =>
            p.rate > T::ZERO || p.end == p.start || p.end == T::ZERO;
        /// The output gives the first voltage.
        START_GIVEN: start, "a voltage from output.lowest_v to output.highest_v";
        /// Ticks count the time, in single precision too.
        WAIT_COUNTED: wait, "a time of at most 1e7 times sampling.period_us";
        /// The output gives the last voltage.
        END_GIVEN: end, "a voltage from output.lowest_v to output.highest_v";
    }
}

/// The law, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voltage<T> {
    start: T,
    lowest: T,
    highest: T,
    /// Way of a period, V; towards the end.
    step: T,
    /// Periods before it goes.
    wait: T,
    /// 1 if it goes to and fro, else 0.
    returns: T,
    output: Output<T>,
}

/// Memory of the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VoltageState<T> {
    /// V, from the start.
    way: T,
    /// 1 on the way back, else 0.
    back: T,
    /// Periods that it has waited.
    waited: T,
    output: OutputState<T>,
}

super::list::selected! { VoltageState: way back waited }

impl<T: Real> Voltage<T> {
    /// Checks parameters and output stage.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(p: &VoltageParams<T>, output: &OutputParams<T>, period: Micros) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let given = |volts: T| volts >= output.lowest && volts <= output.highest;
        VoltageParams::START_GIVEN.require(p.start, given(p.start))?;
        VoltageParams::END_GIVEN.require(p.end, given(p.end))?;
        let towards = (p.end - p.start).sgn();
        let period_s = period.period::<T>()?;
        let wait = (p.wait / period_s + T::from_f64(0.5)).floor();
        VoltageParams::WAIT_COUNTED.require(p.wait, wait <= T::from_f64(1e7))?;
        Ok(Voltage {
            start: p.start,
            lowest: p.start.min(p.end),
            highest: p.start.max(p.end),
            step: towards * p.rate * period_s,
            wait,
            returns: if p.returns { T::ONE } else { T::ZERO },
            output: Output::new(output, period)?,
        })
    }
}

impl<T: Arithmetic> Voltage<T> {
    /// The laws of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> Voltage<L> {
        Voltage {
            start: each(&|law| law.start),
            lowest: each(&|law| law.lowest),
            highest: each(&|law| law.highest),
            step: each(&|law| law.step),
            wait: each(&|law| law.wait),
            returns: each(&|law| law.returns),
            output: Output::in_lanes(&|get| each(&|law| get(&law.output))),
        }
    }
}

impl<T: Arithmetic> ControlLaw<T> for Voltage<T> {
    type State = VoltageState<T>;
    type Terms = [T; 1];
    const TERMS: &'static [&'static str] = &["level_v"];

    fn start(&self, _: &Tick<T>, applied: T) -> VoltageState<T> {
        let output = self.output.start(self.start, applied);
        VoltageState { way: T::ZERO, back: T::ZERO, waited: T::ZERO, output }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update(&self, state: &mut VoltageState<T>, _: &Tick<T>) -> Command<T, [T; 1]> {
        let level = (self.start + state.way).limit(self.lowest, self.highest);
        let back = T::ZERO.less(state.back);
        state.waited = state.waited + T::ONE;
        let waits = state.waited.less(self.wait);
        // At its end it turns, or stays; back at its start it turns.
        let next = state.way + T::select(waits, T::ZERO, T::select(back, -self.step, self.step));
        let beyond = (self.highest - self.lowest).less(next.abs());
        let before = back & (next * self.step).less_or_equal(T::ZERO);
        let end = T::select(T::ZERO.less(self.step), self.highest, self.lowest) - self.start;
        state.way = T::select(before, T::ZERO, T::select(beyond, end, next));
        state.back = T::select(before, T::ZERO, T::select(beyond, self.returns, state.back));
        let (voltage, limit) = self.output.apply(&mut state.output, level);
        Command { voltage, limit, terms: [level] }
    }
}

impl<T: Real> Listed<T> for Voltage<T> {
    type Params = VoltageParams<T>;
    const TITLE: &'static str = "voltage, open loop";

    /// To and fro.
    fn busiest() -> VoltageParams<T> {
        let [start, end, rate] = [1.0, 5.0, 100.0].map(T::from_f64);
        VoltageParams { start, end, rate, wait: T::ZERO, returns: true }
    }
    const FOLLOWS: bool = false;

    fn build(p: &VoltageParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        Voltage::new(p, beside.output, beside.period)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn levels(p: VoltageParams, n: usize) -> Vec<f64> {
        let output = OutputParams { lowest: -10.0, ..OutputParams::default() };
        let law = Voltage::new(&p, &output, Micros(1000)).unwrap();
        let mut state = law.start(&Tick::default(), 0.0);
        (0..n).map(|_| law.update(&mut state, &Tick::default()).voltage).collect()
    }

    #[test]
    fn a_voltage_without_a_rate_stays() {
        let p = VoltageParams { start: 2.5, end: 2.5, ..VoltageParams::default() };
        assert_eq!(levels(p, 3), [2.5; 3]);
        let long = VoltageParams { wait: 2e4, ..p };
        assert_eq!(Voltage::<f64>::new(&long, &OutputParams::default(), Micros(1000)).unwrap_err().field(), "wait");
        let nowhere = VoltageParams { end: 4.0, ..p };
        let output = OutputParams::default();
        assert_eq!(Voltage::<f64>::new(&nowhere, &output, Micros(1000)).unwrap_err().field(), "rate");
    }

    #[test]
    fn a_ramp_ends_at_its_end_and_stays_or_comes_back() {
        let p = VoltageParams { start: 1.0, end: -0.5, rate: 500.0, wait: 0.0, returns: false };
        assert_eq!(levels(p, 6), [1.0, 0.5, 0.0, -0.5, -0.5, -0.5]);
        let p = VoltageParams { returns: true, ..p };
        assert_eq!(levels(p, 10), [1.0, 0.5, 0.0, -0.5, -0.5, 0.0, 0.5, 1.0, 0.5, 0.0]);
    }

    #[test]
    fn a_wait_is_so_many_periods_at_the_start_and_only_there() {
        let p = VoltageParams { end: 1.0, rate: 500.0, wait: 0.003, returns: true, ..VoltageParams::default() };
        assert_eq!(levels(p, 9), [0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 0.5, 0.0, 0.5]);
        // One period at the start there is in any case.
        assert_eq!(levels(VoltageParams { wait: 0.001, ..p }, 3), levels(VoltageParams { wait: 0.0, ..p }, 3));
        // A fall, and the brake at once.
        let fall = VoltageParams { end: 9.0, rate: 1e6, wait: 0.002, ..VoltageParams::default() };
        assert_eq!(levels(fall, 4), [0.0, 0.0, 9.0, 9.0]);
    }

    #[test]
    fn a_rate_that_is_no_divisor_of_the_way_still_reaches_both_ends() {
        let p = VoltageParams { start: 0.0, end: 1.0, rate: 300.0, wait: 0.0, returns: true };
        let levels = levels(p, 100);
        assert!(levels.iter().all(|u| (0.0..=1.0).contains(u)));
        let at = |end: f64| levels.iter().filter(|u| **u == end).count();
        assert!(at(1.0) >= 10 && at(0.0) >= 10, "{levels:?}");
    }

    #[test]
    fn a_voltage_that_the_output_does_not_give_is_named() {
        let output = OutputParams { lowest: 1.0, ..OutputParams::<f64>::default() };
        for (start, end, field) in [(0.9, 5.0, "start"), (10.1, 5.0, "start"), (2.0, 0.9, "end"), (2.0, 10.1, "end")] {
            let p = VoltageParams { start, end, rate: 1.0, ..VoltageParams::default() };
            assert_eq!(Voltage::new(&p, &output, Micros(1000)).unwrap_err().field(), field, "{start} V, {end} V");
        }
    }
}
