//! Control laws: PD (4), CTC (11), SMC (29) and (31), PID, super-twisting, SMC with an integral, PD with a disturbance
//! observer, glide; open-loop voltages.
//!
//! A law is a file of this folder and a line in the list below: its parameters (`Default` = Table 2), what it
//! remembers, its terms, and what it has, as a sliding surface, a damping or a filter of its own ([`Listed`]). A line that
//! ends with `in lanes` says that the law runs in the lanes of a vector, too; its memory then has `select` (`selected!`), by which
//! one lane begins anew. Three tiers: parameters → `new`, the only step that can fail → the law, with its state apart. `self` never
//! changes in a tick, so one law serves many runs, and a clone of the state is a snapshot.
//!
//! Sign convention everywhere: `e = θ_d − θ`; `e > 0` means the shaft lags and the brake has to
//! let go. A positive voltage presses the pad. With a motor, which a positive voltage drives forwards, the laws in volts
//! turn their sign round: PD then is `u = K_p e + K_d ė`, as the paper prints it.

mod list;
mod micro_step;
mod output;
mod shell;

pub use crate::limit::Limit;
pub use output::{Output, OutputParams, OutputState};
pub use shell::{Shell, ShellParams};

use crate::edge_timed::EdgeTimedParams;
use crate::params::Choice;
use crate::{Arithmetic, Encoder, FixedCounts, Micros, ParamError, Place, PlantParams, Real};

list::laws! {
    pd Pd PdParams "Proportional–derivative control (4)." in lanes;
    ctc Ctc CtcParams "Computed torque (11)." in lanes;
    smc Smc SmcParams "Sliding mode with the boundary layer (31)." in lanes;
    smc_sign SmcSign SmcSignParams "Sliding mode with the sign function (29)." in lanes;
    pid Pid PidParams "Proportional–integral–derivative control with feed-forward." in lanes;
    super_twisting SuperTwisting SuperTwistingParams "Super-twisting: sliding mode of second order." in lanes;
    smc_integral SmcIntegral SmcIntegralParams "Sliding mode with a boundary layer and an integral in its surface." in lanes;
    dob Dob DobParams "Proportional–derivative control with a disturbance observer." in lanes;
    glide Glide GlideParams "Friction inverted by an edge-timed filter: smooth at low rates.";
    voltage Voltage VoltageParams "Open-loop voltage." in lanes;
    hold Hold HoldParams "Open-loop voltage that holds the resting shaft." in lanes;
}

/// Input of a law in each period.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tick<T> {
    /// `e = θ_d − θ`, rad.
    pub error: T,
    /// `ė`, from (5) or an observer, rad/s.
    pub error_rate: T,
    /// `θ̇_d`, rad/s.
    pub target_velocity: T,
    /// `θ̈_d`, rad/s².
    pub target_acceleration: T,
}

impl<T: Arithmetic> Tick<T> {
    /// `θ̇ = θ̇_d − ė`: the measured velocity, rad/s.
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    #[must_use]
    pub fn velocity(&self) -> T {
        self.target_velocity - self.error_rate
    }
}

/// Measurements behind a law's input, for a law that wants more than errors. In the lanes of a vector there is the voltage
/// alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen<T> {
    /// Position of the shaft, unwrapped.
    pub position: FixedCounts,
    /// Voltage since the last tick, as the converter gave it, V.
    pub applied: T,
    /// Friction around the count of the position, by a map, where there is one.
    pub place: Place<T>,
}

/// The answer of a law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command<T: Arithmetic, Terms> {
    /// Voltage within the limits, V.
    pub voltage: T,
    /// The limit or the invalid demand that decided it, if one did.
    pub limit: T::Limit,
    /// Every intermediate term, for the log; never fed back.
    pub terms: Terms,
}

/// The most terms that a law may have.
pub const MAX_TERMS: usize = 8;

/// The intermediate terms of a law, as a log shows them.
pub trait Terms<T>: Copy + Default {
    /// The values, in the order of [`ControlLaw::TERMS`].
    fn values(&self) -> &[T];

    /// True if each is a number.
    #[inline]
    fn are_finite(&self) -> bool
    where
        T: Real,
    {
        // 0 for numbers, however large; NaN if one of them is none.
        self.values().iter().fold(T::ZERO, |sum, x| sum + T::ZERO * *x) == T::ZERO
    }
}

impl<T: Copy, const N: usize> Terms<T> for [T; N]
where
    [T; N]: Default,
{
    #[inline]
    fn values(&self) -> &[T] {
        self
    }
}

/// A control law sampled at a fixed period.
pub trait ControlLaw<T: Arithmetic> {
    /// The law's memory. `Default` = at rest; a clone is a snapshot.
    type State: Clone + Default;
    /// Its intermediate terms.
    type Terms: Terms<T>;
    /// Names of the terms, with units; at most [`MAX_TERMS`].
    const TERMS: &'static [&'static str];

    /// Names of the terms of this law: [`ControlLaw::TERMS`], unless it stands for one of several.
    fn term_names(&self) -> &'static [&'static str] {
        Self::TERMS
    }

    /// The state for a start at `tick` while the brake is at `applied` volts.
    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State;

    /// The same where the state is to stay.
    fn restart(&self, state: &mut Self::State, tick: &Tick<T>, applied: T) {
        *state = self.start(tick, applied);
    }

    /// Called before each period, and once after [`ControlLaw::start`], with the facts behind the measurement. Most laws need
    /// none of them, and do not ask: the voltage of a code is computed where it is asked for.
    #[inline]
    fn sees(&self, state: &mut Self::State, seen: impl FnOnce() -> Seen<T>) {
        let _ = (state, seen);
    }

    /// One period: the measurement in, the voltage out.
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms>;
}

/// A law that somebody else owns.
impl<T: Arithmetic, C: ControlLaw<T>> ControlLaw<T> for &C {
    type State = C::State;
    type Terms = C::Terms;
    const TERMS: &'static [&'static str] = C::TERMS;

    fn term_names(&self) -> &'static [&'static str] {
        (**self).term_names()
    }

    fn start(&self, tick: &Tick<T>, applied: T) -> Self::State {
        (**self).start(tick, applied)
    }

    #[inline]
    fn sees(&self, state: &mut Self::State, seen: impl FnOnce() -> Seen<T>) {
        (**self).sees(state, seen);
    }

    #[inline]
    fn update(&self, state: &mut Self::State, tick: &Tick<T>) -> Command<T, Self::Terms> {
        (**self).update(state, tick)
    }
}

/// The parts that a law is built beside.
#[derive(Clone, Copy, Debug)]
pub struct Beside<'a, T> {
    /// The plant that a law with a model believes in.
    pub model: &'a PlantParams<T>,
    /// Its output stage.
    pub output: &'a OutputParams<T>,
    /// The encoder behind its measurement.
    pub encoder: Encoder,
    /// Its sampling period.
    pub period: Micros,
}

impl<'a, T: Real> Beside<'a, T> {
    /// The paper's encoder and sampling period.
    #[must_use]
    pub const fn paper(model: &'a PlantParams<T>, output: &'a OutputParams<T>) -> Self {
        Beside { model, output, encoder: Encoder::PAPER, period: Micros(1000) }
    }

    /// −1 where a voltage above 0 drives the shaft forwards, 1 where it resists: laws count as a brake does.
    #[must_use]
    pub fn sign(&self) -> T {
        if self.model.actuator.kind().drives_above_0() { -T::ONE } else { T::ONE }
    }
}

/// A law of the list: what building, certificate, logs and documentation ask of it.
pub trait Listed<T: Real>: ControlLaw<T> + Sized {
    /// Its parameters.
    type Params: Default;
    /// Its name, as people read it.
    const TITLE: &'static str;
    /// `true` if it follows a path; `false` for an open-loop law, whose path says nothing.
    const FOLLOWS: bool = true;
    /// Condition on its parameters for [`Listed::sampled`], in words, behind its name; empty without one.
    const SAMPLED_IF: &'static str = "";

    /// The parameters with which a period takes longest: what a measurement of its time uses.
    #[must_use]
    fn busiest() -> Self::Params {
        Self::Params::default()
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter out of range.
    fn build(p: &Self::Params, beside: &Beside<'_, T>) -> Result<Self, ParamError<T>>;

    /// Its output stage.
    fn output(&self) -> &Output<T>;

    /// Its own filter of the encoder's counts, if it has one: the law then takes its velocity from there, and delay and
    /// lag of the loop are what the filter was told.
    #[must_use]
    fn filter(p: &Self::Params) -> Option<&EdgeTimedParams<T>> {
        let _ = p;
        None
    }

    /// Its answer to a departure from the speed, near its path and while nothing saturates; none of a law that switches,
    /// or follows no path.
    #[must_use]
    fn damping(p: &Self::Params) -> Option<Damping<T>> {
        let _ = p;
        None
    }

    /// The law in a form that a certificate of the sampled loop takes; none of a law of another form.
    #[must_use]
    fn sampled(p: &Self::Params) -> Option<SampledForm<T>> {
        let _ = p;
        None
    }

    /// Its sliding surface, if it has one: what a certificate speaks of.
    fn surface(&self, asked: &Asked<'_, T>) -> Option<Surface<T>> {
        let _ = asked;
        None
    }
}

/// A law's answer to a departure from the speed, as parameters have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping<T> {
    /// A voltage, V s/rad.
    Voltage(T),
    /// An acceleration, of the inertia that the law believes in, 1/s.
    Acceleration(T),
}

/// A law whose sampled loop can be certified, in the units of its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SampledForm<T> {
    /// (4) with feed-forward and an integral: `u = u_0 − (K_p e + K_i ∫ e dt + K_d ė + K_c sgn θ̇_d + K_v θ̇_d)` with a brake,
    /// `u_0 + (…)` with a motor.
    Linear {
        /// `K_p`, V/rad.
        kp: T,
        /// `K_i`, V/(rad s); 0 of a law that remembers nothing.
        ki: T,
        /// Time in which the integral follows a limit, s.
        tracking_time: T,
        /// `K_d`, V s/rad.
        kd: T,
        /// `u_0`, V.
        bias: T,
        /// `K_c`, V.
        coulomb: T,
        /// `K_v`, V s/rad.
        velocity: T,
    },
    /// (31): `u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}` with a brake, `σ = f e + ė`.
    Layer {
        /// `K_p`, V.
        kp: T,
        /// `K_d`, V s/rad.
        kd: T,
        /// `f`, 1/s.
        slope: T,
        /// `ε`, rad/s.
        boundary: T,
    },
}

/// Requirements of a path on a law with a sliding surface.
pub struct Asked<'a, T> {
    /// Highest velocity of the path, rad/s.
    pub velocity: T,
    /// Highest acceleration of the path, rad/s².
    pub acceleration: T,
    /// Largest `|ė|` that the brake can stop with a surface of a slope (1/s), rad/s.
    pub fastest: &'a dyn Fn(T) -> T,
}

/// A law as a certificate sees it: `σ = f e + ė`, and the voltage that answers `|σ|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface<T> {
    /// `f`: slope of the surface, 1/s.
    pub slope: T,
    /// Thickness of the layer around the surface within which the law does not switch fully, rad/s.
    pub layer: T,
    /// Voltage outside the layer, V.
    pub kp: T,
    /// Voltage per `|ė|` outside the layer, V s/rad; none for a law that is affine in `σ`.
    pub kd: Option<T>,
    /// `true` if the layer weakens `kd`, too.
    pub weakened: bool,
    /// `true` for a sliding-mode law, of which the paper's conditions speak.
    pub sliding: bool,
}

impl<T> Surface<T> {
    /// A law that gives `gain` volts per `σ`, within the limits of an output: outside of the layer it saturates, with
    /// `highest` volts on a brake, with the nearer limit on what drives either way.
    #[must_use]
    pub fn affine(slope: T, (lowest, highest): (T, T), gain: T) -> Self
    where
        T: Real,
    {
        let below = -lowest;
        let (nearer, farther) =
            if below > T::ZERO { (highest.min(below), highest.max(below)) } else { (highest, highest) };
        Surface { slope, layer: farther / gain, kp: nearer, kd: None, weakened: false, sliding: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FixedCounts, MotorActuator};
    use std::vec::Vec;

    const OUTPUT: OutputParams<f64> =
        OutputParams { lowest: 0.0, highest: 9.0, on_invalid: 4.0, bumpless_time: 0.0 };
    const PERIOD: Micros = Micros(1000);

    fn built(p: &LawParams<f64>) -> Law<f64> {
        Law::new(p, &Beside::paper(&PlantParams::default(), &OUTPUT)).unwrap()
    }

    fn behind(error: f64) -> Tick<f64> {
        Tick { error, error_rate: 0.0, target_velocity: 0.035, target_acceleration: 0.0 }
    }

    #[test]
    fn a_law_by_reference_is_the_law() {
        let law = built(&LawParams::all()[0]);
        let by = &law;
        assert_eq!(ControlLaw::<f64>::term_names(&by), ControlLaw::<f64>::term_names(&law));
        let tick = behind(-1e-3);
        let (mut one, mut other) = (law.start(&tick, 2.0), ControlLaw::start(&by, &tick, 2.0));
        let seen = Seen { position: FixedCounts::from_counts(3), applied: 2.0, ..Seen::default() };
        law.sees(&mut one, || seen);
        ControlLaw::sees(&by, &mut other, || seen);
        assert_eq!(one, other);
        assert_eq!(law.update(&mut one, &tick), ControlLaw::update(&by, &mut other, &tick));
    }

    #[test]
    fn a_state_of_another_law_is_begun_anew() {
        let laws = LawParams::<f64>::all().map(|p| built(&p));
        let tick = behind(-1e-4);
        for law in &laws {
            for other in &laws {
                let mut foreign = other.start(&tick, 3.0);
                law.sees(&mut foreign, || Seen { applied: 1.0, ..Seen::default() });
                let command = law.update(&mut foreign, &tick);
                assert!((0.0..=9.0).contains(&command.voltage), "{command:?}");
            }
        }
    }

    #[test]
    fn every_law_has_a_title_its_limits_and_a_busiest_period_that_is_valid() {
        for p in LawParams::<f64>::all() {
            assert!(!p.title().is_empty());
            assert_eq!(LawParams::named(p.name()), Some(p));
            let law = built(&p);
            assert_eq!(law.output().limits(), (0.0, 9.0), "{}", p.title());
            assert_eq!(law.output().on_invalid(), 4.0);
        }
        macro_rules! busiest {
            ($($module:ident $law:ident;)+) => {
                [$(LawParams::$law(<$law<f64> as Listed<f64>>::busiest())),+]
            };
        }
        let busiest = each_law!(busiest);
        assert_eq!(LawParams::<f64>::named("bang_bang"), None);
        assert!(busiest.iter().all(|p| built(p).output().limits() == (0.0, 9.0)));
    }

    #[test]
    fn computed_torque_as_printed_has_the_bits_of_the_actuators_equation() {
        let law = Ctc::new(&CtcParams::default(), &PlantParams::default(), &OUTPUT, PERIOD).unwrap();
        let actuator = law.model().actuator();
        let mut within = 0;
        for (i, j) in (-20..=20).flat_map(|i| (-20..=20).map(move |j| (i, j))) {
            let tick = Tick { error_rate: f64::from(j) * 1e-3, ..behind(f64::from(i) * 1e-4) };
            let command = law.update(&mut law.start(&tick, 0.0), &tick);
            let [_, friction, mu] = command.terms;
            let volts = actuator.volts_for(-friction, mu, actuator.way(tick.target_velocity));
            assert_eq!(command.voltage.to_bits(), volts.clamp(0.0, 9.0).to_bits(), "{tick:?}");
            within += u32::from(command.limit == Limit::None);
        }
        assert!(within > 100, "{within}");
    }

    #[test]
    fn laws_turn_their_sign_round_for_a_motor() {
        let motor = MotorActuator { gain: 0.05, preload: 0.3, load_share: 0.0 };
        let model = PlantParams { actuator: motor.into(), ..PlantParams::default() };
        let output = OutputParams { lowest: -9.0, highest: 9.0, on_invalid: 0.0, bumpless_time: 0.0 };
        let beside = |model| Beside::paper(model, &output);
        assert_eq!((beside(&PlantParams::default()).sign(), beside(&model).sign()), (1.0, -1.0));
        for p in LawParams::<f64>::all().into_iter().filter(LawParams::follows) {
            let law = Law::new(&p, &Beside::paper(&model, &output)).unwrap();
            let asked = |error| law.update(&mut law.start(&behind(0.0), 0.0), &behind(error)).voltage;
            // A shaft that lags is driven on, one that leads is held back.
            assert!(asked(2e-3) > 0.0 && asked(-2e-3) < 0.0, "{}: {} V", p.title(), asked(2e-3));
        }
    }

    #[cfg(feature = "linalg")]
    #[test]
    fn a_servo_with_an_observer_sees_the_rate_of_a_shaft_that_lags() {
        use crate::{Counts, ObserverParams, Servo, ServoParams, Target, VelocityParams};
        let p = ServoParams {
            velocity: VelocityParams::Observer(ObserverParams::default()),
            ..ServoParams::<f64>::paper(LawParams::all()[0])
        };
        let servo = Servo::new(&p).unwrap();
        // The target goes on by five counts a period, the shaft by four: 0.314 rad/s behind.
        let target = |k: i32| Target {
            position: FixedCounts::from_counts(5 * i64::from(k)),
            velocity: 5000.0 * servo.encoder().radians_per_count::<f64>(),
            acceleration: 0.0,
        };
        let mut state = servo.start(Counts(0), &target(0), 2.0);
        let rates = (1..400).map(|k| servo.tick(&mut state, Counts(4 * k), &target(k)).tick.error_rate);
        let last = rates.last().unwrap();
        assert!((last - 1000.0 * servo.encoder().radians_per_count::<f64>()).abs() < 0.05, "{last} rad/s");
    }

    #[test]
    fn laws_without_a_surface_have_none_and_computed_torque_knows_its_plant() {
        let asked = Asked { velocity: 0.1, acceleration: 0.5, fastest: &|_| 1.0 };
        let surfaces = LawParams::<f64>::all().map(|p| (p.name(), built(&p).surface(&asked).is_some()));
        for (name, has) in surfaces {
            assert_eq!(has, ["pd", "ctc", "smc", "smc_sign"].contains(&name), "{name}");
        }
        let p = CtcParams::<f64>::default();
        for none in [CtcParams { kp: 0.0, ..p }, CtcParams { outer_gain: 0.0, ..p }] {
            assert!(built(&none.into()).surface(&asked).is_none(), "no slope or no gain, no surface");
        }
        let law = Ctc::new(&p, &PlantParams::default(), &OUTPUT, PERIOD).unwrap();
        assert_eq!(law.model().params(), &PlantParams::default());
        assert_eq!(ControlLaw::<f64>::term_names(&law), <Ctc<f64> as ControlLaw<f64>>::TERMS);
    }

    /// The laws of the list that have something.
    fn those_with(has: impl Fn(&LawParams<f64>) -> bool) -> Vec<&'static str> {
        LawParams::<f64>::all().iter().filter(|p| has(p)).map(Choice::<f64>::name).collect()
    }

    #[test]
    fn laws_say_what_they_have() {
        assert_eq!(those_with(|p| p.sampled().is_some()), ["pd", "smc", "pid"]);
        // A derivative with a filter of its own has a state that the certificate has not.
        assert_eq!(those_with(|p| !p.sampled_if().is_empty()), ["pid"]);
        assert_eq!(those_with(|p| p.filter().is_some()), ["glide"]);
        let damped = ["pd", "ctc", "smc", "pid", "smc_integral", "dob", "glide"];
        assert_eq!(
            those_with(|p| p.damping().is_some()),
            damped,
            "super-twisting has a layer, by default of 0"
        );
        let layer = SuperTwistingParams::<f64> { boundary: 0.04, ..SuperTwistingParams::default() };
        assert_eq!(LawParams::from(layer).damping(), Some(Damping::Voltage(layer.k1 / 0.2)));
    }

    #[test]
    fn a_damping_is_the_slope_of_the_voltage_over_the_error_rate() {
        // No drag of the shaft, and beyond its Stribeck velocity.
        let model = PlantParams { viscous_damping: 0.0, ..PlantParams::default() };
        let grip = 0.15 * 0.14;
        let layer = SuperTwistingParams { boundary: 0.04, ..SuperTwistingParams::default() };
        // The answer of an observer comes over the periods, and a filter has its own rate.
        let at_once = |p: &LawParams<f64>| p.filter().is_none() && !matches!(p, LawParams::Dob(_));
        let all = LawParams::<f64>::all().into_iter().chain([LawParams::from(layer)]);
        let mut seen = 0;
        for p in all.filter(at_once) {
            let Some(damping) = p.damping() else { continue };
            let law = Law::new(&p, &Beside::paper(&model, &OUTPUT)).unwrap();
            let path = Tick { target_velocity: 10.0, ..Tick::default() };
            let volts = |error_rate| {
                let tick = Tick { error_rate, error: -1e-4, ..path };
                law.update(&mut law.start(&Tick { error: -1e-4, ..path }, 3.0), &tick).voltage
            };
            let slope = (volts(-1e-5) - volts(1e-5)) / 2e-5;
            let told = match damping {
                Damping::Voltage(volts) => volts,
                Damping::Acceleration(rate) => rate * model.inertia / grip,
            };
            assert!((slope / told - 1.0).abs() < 1e-3, "{}: {slope} and {told} V s/rad", p.title());
            seen += 1;
        }
        assert_eq!(seen, 6);
    }

    #[test]
    fn a_sampled_form_is_the_law() {
        let proportional =
            PidParams { ki: 0.0, bias: 2.2, coulomb: 0.3, velocity: 0.5, ..PidParams::default() };
        for p in LawParams::<f64>::all().into_iter().chain([proportional.into()]) {
            let Some(form) = p.sampled() else { continue };
            let wide = OutputParams { lowest: -1e6, highest: 1e6, on_invalid: 0.0, bumpless_time: 0.0 };
            let motor = MotorActuator { gain: 0.05, preload: 0.3, load_share: 0.0 };
            let model = PlantParams { actuator: motor.into(), ..PlantParams::default() };
            let law = Law::new(&p, &Beside::paper(&model, &wide)).unwrap();
            for (error, error_rate) in [(1e-4, 1e-3), (-2e-3, 0.05), (3e-3, -0.4), (-1e-5, 2e-2)] {
                let tick = Tick { error, error_rate, target_velocity: 0.3, ..Tick::default() };
                let mut state = law.start(&tick, 0.0);
                let volts = law.update(&mut state, &tick).voltage;
                let sat = |x: f64| x.clamp(-1.0, 1.0);
                let told = match form {
                    // An integral begins where the law demands the 0 V that the actuator has.
                    SampledForm::Linear { ki, .. } if ki > 0.0 => {
                        let gained = law.update(&mut state, &tick).voltage - volts;
                        let told = ki * 0.001 * error;
                        assert!((gained - told).abs() < 1e-9 * told.abs(), "{gained} and {told} V a tick");
                        0.0
                    }
                    SampledForm::Linear { kp, kd, bias, coulomb, velocity, .. } => {
                        bias + kp * error + kd * error_rate + coulomb + velocity * 0.3
                    }
                    SampledForm::Layer { kp, kd, slope, boundary } => {
                        let surface = slope * error + error_rate;
                        kp * sat(surface / boundary) + kd * sat(surface * error_rate / boundary) * error_rate
                    }
                };
                assert!(
                    (volts - told).abs() < 1e-9 * told.abs().max(1e-3),
                    "{}: {volts} and {told} V",
                    p.title()
                );
            }
        }
    }

    #[test]
    fn computed_torque_of_a_motor_saturates_where_its_torque_ends() {
        let motor = MotorActuator { gain: 0.05, preload: 0.3, load_share: 0.5 };
        let model = PlantParams { actuator: motor.into(), drive_torque: -0.01, ..PlantParams::default() };
        let output = OutputParams { lowest: -4.0, highest: 9.0, on_invalid: 0.0, bumpless_time: 0.0 };
        let p = CtcParams::<f64>::default();
        let law = Law::new(&p.into(), &Beside::paper(&model, &output)).unwrap();
        let asked = Asked { velocity: 0.1, acceleration: 0.5, fastest: &|_| 1.0 };
        let surface = law.surface(&asked).unwrap();
        assert!((surface.slope - p.kp / p.kd).abs() < 1e-12);
        // 9 V with the friction of their own load, the drive, friction, inertia and drag, over J K K_d.
        let (mu, m) = (0.2, &model);
        let farther = 9.0 * 0.05 * (1.0 + mu * 0.5);
        let torque = farther + 0.01 + mu * 0.3 + m.inertia * 0.5 + m.viscous_damping * 1.1;
        let layer = torque / (m.inertia * p.outer_gain * p.kd);
        assert!((surface.layer - layer).abs() < 1e-9 * layer, "{} instead of {layer}", surface.layer);
    }

    #[test]
    fn computed_torque_of_a_brake_that_presses_by_itself_asks_for_less() {
        let brake = |preload| crate::BrakeActuator { gain: 0.14, preload };
        let volts = |preload: f64| {
            let actuator = crate::ActuatorParams::Brake(brake(preload));
            let model = PlantParams { actuator, ..PlantParams::default() };
            let law = Law::new(&CtcParams::default().into(), &Beside::paper(&model, &OUTPUT)).unwrap();
            law.update(&mut law.start(&behind(0.0), 0.0), &behind(-1e-5)).voltage
        };
        // The same normal force: N_0 + K_COF u.
        assert!((volts(0.0) - volts(0.07) - 0.5).abs() < 1e-9, "{} V, {} V", volts(0.0), volts(0.07));
    }

    #[test]
    fn a_surface_of_a_two_sided_output_ends_at_the_nearer_limit() {
        let one = Surface::affine(5.0, (0.0, 9.0), 3.0);
        assert_eq!((one.kp, one.layer), (9.0, 3.0));
        for limits in [(-6.0, 9.0), (-9.0, 6.0)] {
            let two = Surface::affine(5.0, limits, 3.0);
            assert_eq!((two.kp, two.layer, two.slope), (6.0, 3.0, 5.0));
        }
    }
}
