//! Super-twisting: sliding mode of second order.
//!
//! ```text
//! σ = f e + ė                                                     (13)
//! u = v − K_1 √|σ| sgn σ,     v̇ = −K_2 sgn σ
//! ```
//!
//! This is the sign for a brake; with a motor both terms turn round. The demand has no jump where `σ` passes 0: the sign
//! function is under the integral (Levant 1993; gains and proof: Moreno and Osorio 2012). A boundary layer replaces
//! `√|σ| sgn σ` by `σ/√ε` and `sgn σ` by `σ/ε` where `|σ| < ε`.
//!
//! The integral stands still while a limit of the output decides and it would go further that way. A run begins with the
//! integral at which the law demands the voltage that the brake has.

use super::{Beside, Command, ControlLaw, Damping, Listed, Output, OutputParams, OutputState, Tick};
use crate::params::{Range, Table};
use crate::{Arithmetic, Each, Micros, ParamError, Real};

crate::params! {
    /// Super-twisting, a sliding mode of second order: a root and the integral of a sign, which switches behind an integral and
    /// not at the output.
    ///
    /// `u = v − K_1 √|σ| sgn σ`, `v̇ = −K_2 sgn σ` with `σ = f e + ė` and a brake; with a motor both terms turn round. A
    /// start is bumpless where the integral that it takes is within the output's limits, and the integral does not wind up at a limit.
    pub struct SuperTwistingParams<T>: Default {
        /// Gain of the root.
        k1: T = 4.4, "k1_v_rt_s_rad" "K_1" V_RT_S_RAD, Range::above(0.0);
        /// Gain of the integral: its rate beyond the layer.
        k2: T = 15.0, "k2_v_s" "K_2" V_S, Range::above(0.0);
        /// Slope of the sliding surface (13).
        slope: T = 35.0, "slope_1_s" "f" PER_S, Range::above(0.0);
        /// Thickness of a boundary layer in which both terms are linear; 0 has none.
        boundary: T = 0.0, "boundary_rad_s" "ε" RAD_S, Range::at_least(0.0);
    }
}

/// The law, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuperTwisting<T> {
    /// With a motor, gains are negative.
    params: SuperTwistingParams<T>,
    /// Way of the integral in a period beyond the layer, V; its sign as the gains'.
    twist: T,
    output: Output<T>,
}

/// Memory of the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SuperTwistingState<T> {
    /// `v`, V.
    integral: T,
    output: OutputState<T>,
}

super::list::selected! { SuperTwistingState: integral }

impl<T: Real> SuperTwisting<T> {
    /// Checks gains and output stage.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new(
        p: &SuperTwistingParams<T>,
        output: &OutputParams<T>,
        period: Micros,
    ) -> Result<Self, ParamError<T>> {
        p.check_rows()?;
        let seconds = period.period::<T>()?;
        Ok(SuperTwisting { params: *p, twist: p.k2 * seconds, output: Output::new(output, period)? })
    }
}

impl<T: Arithmetic> SuperTwisting<T> {
    /// The laws of several lanes as one.
    #[must_use]
    pub fn in_lanes<L: Arithmetic>(each: Each<'_, Self, T, L>) -> SuperTwisting<L> {
        let params = SuperTwistingParams {
            k1: each(&|law| law.params.k1),
            k2: each(&|law| law.params.k2),
            slope: each(&|law| law.params.slope),
            boundary: each(&|law| law.params.boundary),
        };
        let output = Output::in_lanes(&|get| each(&|law| get(&law.output)));
        SuperTwisting { params, twist: each(&|law| law.twist), output }
    }

    /// `σ`, `√|σ| sgn σ` and `sgn σ`, both linear within the layer.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn surface(&self, tick: &Tick<T>) -> (T, T, T) {
        let surface = self.params.slope * tick.error + tick.error_rate;
        let size = surface.abs().max(self.params.boundary);
        // Elsewhere it is 0, or no number.
        let sized = T::ZERO.less(size);
        let root = T::branch(sized, || surface / size.sqrt(), || surface);
        let sign = T::branch(sized, || surface / size, || surface);
        (surface, root, sign)
    }
}

impl<T: Arithmetic> ControlLaw<T> for SuperTwisting<T> {
    type State = SuperTwistingState<T>;
    type Terms = [T; 3];
    const TERMS: &'static [&'static str] = &["surface_rad_s", "root_v", "integral_v"];

    fn start(&self, tick: &Tick<T>, applied: T) -> SuperTwistingState<T> {
        let (_, root, _) = self.surface(tick);
        let root = -(self.params.k1 * root);
        let integral = applied - root;
        let integral = T::select(integral.is_finite(), integral, T::ZERO);
        SuperTwistingState { integral, output: self.output.start(root + integral, applied) }
    }

    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update(&self, state: &mut SuperTwistingState<T>, tick: &Tick<T>) -> Command<T, [T; 3]> {
        let (surface, root, sign) = self.surface(tick);
        let root = -(self.params.k1 * root);
        let integral = state.integral;
        let demand = root + integral;
        let (voltage, limit) = self.output.apply(&mut state.output, demand);
        let step = -(self.twist * sign);
        let (lowest, highest) = self.output.limits();
        let stays = || integral;
        let moves = || (integral + step).limit(lowest, highest);
        let at_highest = || T::branch(T::ZERO.less(step), stays, moves);
        let at_lowest = || T::branch(step.less(T::ZERO), stays, moves);
        let below = || T::branch(demand.less_or_equal(lowest), at_lowest, moves);
        let next = || T::branch(highest.less_or_equal(demand), at_highest, below);
        T::put_where(step.is_finite(), &mut state.integral, next);
        Command { voltage, limit, terms: [surface, root, integral] }
    }
}

impl<T: Real> Listed<T> for SuperTwisting<T> {
    type Params = SuperTwistingParams<T>;
    const TITLE: &'static str = "super-twisting";

    fn build(p: &SuperTwistingParams<T>, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>> {
        let mut law = SuperTwisting::new(p, beside.output, beside.period)?;
        law.params.k1 = beside.sign() * p.k1;
        law.twist = beside.sign() * law.twist;
        Ok(law)
    }

    fn output(&self) -> &Output<T> {
        &self.output
    }

    fn damping(p: &SuperTwistingParams<T>) -> Option<Damping<T>> {
        // The root is as steep as you like without a layer.
        (p.boundary > T::ZERO).then(|| Damping::Voltage(p.k1 / p.boundary.sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlantParams;
    use crate::law::Limit;

    const PERIOD: Micros = Micros(1000);
    /// `μ_d K_COF/J` of Table 1: what a volt takes from the acceleration, rad/s²/V.
    const PER_VOLT: f64 = 0.15 * 0.14 / 0.0017;

    fn law(p: SuperTwistingParams) -> SuperTwisting<f64> {
        SuperTwisting::new(&p, &OutputParams::default(), PERIOD).unwrap()
    }

    /// Largest `|σ|` in the last second of four, rad/s, of a sliding shaft without a path, whose acceleration without a brake
    /// grows by `rate` rad/s³ for two seconds and shrinks for two.
    fn largest(p: SuperTwistingParams, rate: f64) -> f64 {
        let law = law(p);
        let (mut push, mut velocity, mut position) = (30.0, 0.0, 0.0);
        let mut state = law.start(&Tick::default(), push / PER_VOLT);
        let mut largest: f64 = 0.0;
        for k in 0..4000 {
            let tick = Tick { error: -position, error_rate: -velocity, ..Tick::default() };
            let out = law.update(&mut state, &tick);
            push += if k < 2000 { rate } else { -rate } * 1e-3;
            velocity += (push - PER_VOLT * out.voltage) * 1e-3;
            position += velocity * 1e-3;
            if k >= 3000 {
                largest = largest.max(out.terms[0].abs());
            }
        }
        largest
    }

    #[test]
    fn a_disturbance_is_followed_without_an_offset_as_long_as_it_is_slower_than_the_integral() {
        let p = SuperTwistingParams { k1: 2.0, k2: 1.0, ..SuperTwistingParams::default() };
        // Levant: the integral has to be faster, K_2 μ_d K_COF/J = 12.4 rad/s³.
        let bound = p.k2 * PER_VOLT;
        let (slow, fast) = (largest(p, 0.8 * bound), largest(p, 1.2 * bound));
        assert!(slow < 0.03 && fast > 10.0 * slow, "{slow} and {fast} rad/s");
        // The root alone needs (Δu/K_1)² of a disturbance of 22 rad/s²: no K_2 keeps it so near.
        let root_alone = (20.0 / PER_VOLT / p.k1).powi(2);
        let weak = largest(SuperTwistingParams { k2: 1e-6, ..p }, 0.8 * bound);
        assert!(weak > 10.0 * slow && weak < 2.0 * root_alone, "{weak} rad/s, {root_alone}");
    }

    #[test]
    fn a_demand_has_no_jump_where_the_surface_is_crossed() {
        let law = law(SuperTwistingParams { slope: 1.0, ..SuperTwistingParams::default() });
        let volts = |error| {
            let mut state = law.start(&Tick::default(), 5.0);
            law.update(&mut state, &Tick { error, ..Tick::default() }).voltage
        };
        for size in [1e-2, 1e-4, 1e-6, 0.0] {
            // 4.4 V √(s/rad) √σ either way.
            let step = 4.4 * f64::sqrt(size);
            assert!((volts(-size) - 5.0 - step).abs() < 1e-12 && (volts(size) - 5.0 + step).abs() < 1e-12, "{size}");
        }
    }

    #[test]
    fn a_layer_is_linear_inside_and_changes_nothing_outside() {
        let p = SuperTwistingParams { k1: 4.0, k2: 30.0, slope: 1.0, ..SuperTwistingParams::default() };
        let (sharp, soft) = (law(p), law(SuperTwistingParams { boundary: 0.01, ..p }));
        let after = |law: &SuperTwisting<f64>, error| {
            let mut state = law.start(&Tick::default(), 5.0);
            let tick = Tick { error, ..Tick::default() };
            let terms = law.update(&mut state, &tick).terms;
            (terms[1], law.update(&mut state, &tick).terms[2] - 5.0)
        };
        for error in [0.011, -0.5] {
            assert_eq!(after(&sharp, error), after(&soft, error), "{error}");
        }
        let (root, way) = after(&soft, 0.0025);
        // A quarter of the layer: K_1 σ/√ε and K_2 T σ/ε.
        assert!((root + 4.0 * 0.025).abs() < 1e-12 && (way + 0.25 * 0.03).abs() < 1e-12, "{root}, {way}");
    }

    #[test]
    fn an_integral_at_a_limit_stands_still_and_comes_back_at_once() {
        let law = law(SuperTwistingParams::default());
        let behind = |error| Tick { error, ..Tick::default() };
        let mut state = law.start(&behind(0.0), 2.25);
        for _ in 0..1000 {
            let out = law.update(&mut state, &behind(0.1));
            assert_eq!((out.voltage, out.limit, out.terms[2]), (0.0, Limit::Lowest, 2.25));
        }
        // The other way it goes on, but not beyond the output.
        for _ in 0..2 {
            law.update(&mut state, &behind(-1e-9));
        }
        assert!((state.integral - 2.28).abs() < 1e-9, "{}", state.integral);
        for _ in 0..1000 {
            law.update(&mut state, &behind(-1e-9));
        }
        assert_eq!(state.integral, 10.0);
    }

    #[test]
    fn a_start_takes_over_the_voltage_that_the_brake_has() {
        let tick = Tick { error: 1e-4, error_rate: 0.01, target_velocity: 0.03, target_acceleration: 0.0 };
        let law = law(SuperTwistingParams::default());
        let mut state = law.start(&tick, 2.25);
        assert!((law.update(&mut state, &tick).voltage - 2.25).abs() < 1e-12);
    }

    #[test]
    fn a_measurement_that_is_no_number_spoils_one_tick() {
        for boundary in [0.0, 0.1] {
            let law = law(SuperTwistingParams { boundary, ..SuperTwistingParams::default() });
            let mut state = law.start(&Tick::default(), 3.0);
            let bad = Tick { error: f64::NAN, ..Tick::default() };
            assert_eq!(law.update(&mut state, &bad).limit, Limit::Invalid);
            assert_eq!(law.update(&mut state, &Tick::default()).voltage, 3.0);
            assert_eq!(law.start(&bad, 3.0).integral, 0.0);
        }
    }

    #[test]
    fn a_law_without_a_root_or_an_integral_is_refused() {
        let d = SuperTwistingParams::<f64>::default();
        for (p, field) in [
            (SuperTwistingParams { k1: 0.0, ..d }, "k1"),
            (SuperTwistingParams { k2: 0.0, ..d }, "k2"),
            (SuperTwistingParams { boundary: -0.1, ..d }, "boundary"),
        ] {
            let (model, output) = (PlantParams::default(), OutputParams::default());
            assert_eq!(SuperTwisting::build(&p, &Beside::paper(&model, &output)).unwrap_err().field(), field);
        }
    }
}
