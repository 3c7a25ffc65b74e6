//! A vector of lanes that is declared outside of the core: each lane has the bits of the scalar.
#![allow(
    clippy::std_instead_of_core,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    clippy::redundant_closure,
    reason = "it runs on the host"
)]

use clutch_core::law::{
    Beside, ControlLaw, Ctc, CtcParams, Dob, DobParams, Hold, HoldParams, Limit, Listed, OutputParams, Pd,
    PdParams, Pid, PidParams, Seen, Smc, SmcIntegral, SmcIntegralParams, SmcParams, SmcSign, SmcSignParams,
    SuperTwisting, SuperTwistingParams, Terms, Tick, Voltage, VoltageParams,
};
use clutch_core::{
    ActuatorParams, Arithmetic, BothActuator, BrakeActuator, Each, Encoder, Micros, MotorActuator,
    PlantParams, SmoothedDerivative, SmoothedDerivativeParams, StribeckParams,
};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

const N: usize = 4;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Lanes([f64; N]);

#[derive(Clone, Copy)]
struct Mask([bool; N]);

impl Lanes {
    fn each(self, f: impl Fn(f64) -> f64) -> Lanes {
        Lanes(self.0.map(f))
    }
    fn with(self, other: Lanes, f: impl Fn(f64, f64) -> f64) -> Lanes {
        Lanes(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
    fn compared(self, other: Lanes, f: impl Fn(f64, f64) -> bool) -> Mask {
        Mask(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

macro_rules! operators {
    ($($of:ident $f:ident $op:tt;)+) => { $(
        impl $of for Lanes {
            type Output = Lanes;
            fn $f(self, other: Lanes) -> Lanes {
                self.with(other, |a, b| a $op b)
            }
        }
    )+ };
}
operators! { Add add +; Sub sub -; Mul mul *; Div div /; }

impl Neg for Lanes {
    type Output = Lanes;
    fn neg(self) -> Lanes {
        self.each(|a| -a)
    }
}
impl BitAnd for Mask {
    type Output = Mask;
    fn bitand(self, other: Mask) -> Mask {
        Mask(std::array::from_fn(|i| self.0[i] && other.0[i]))
    }
}
impl BitOr for Mask {
    type Output = Mask;
    fn bitor(self, other: Mask) -> Mask {
        Mask(std::array::from_fn(|i| self.0[i] || other.0[i]))
    }
}
impl Not for Mask {
    type Output = Mask;
    fn not(self) -> Mask {
        Mask(self.0.map(|a| !a))
    }
}

impl Arithmetic for Lanes {
    type Mask = Mask;
    type Limit = [Limit; N];
    const ZERO: Lanes = Lanes([0.0; N]);
    const ONE: Lanes = Lanes([1.0; N]);

    fn splat(x: f64) -> Lanes {
        Lanes([x; N])
    }
    fn less(self, other: Lanes) -> Mask {
        self.compared(other, |a, b| a < b)
    }
    fn less_or_equal(self, other: Lanes) -> Mask {
        self.compared(other, |a, b| a <= b)
    }
    fn select(mask: Mask, a: Lanes, b: Lanes) -> Lanes {
        Lanes(std::array::from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    fn limit_of(limit: Limit) -> [Limit; N] {
        [limit; N]
    }
    fn select_limit(mask: Mask, a: [Limit; N], b: [Limit; N]) -> [Limit; N] {
        std::array::from_fn(|i| if mask.0[i] { a[i] } else { b[i] })
    }
    fn decided(limit: [Limit; N]) -> Mask {
        Mask(limit.map(|limit| limit != Limit::None))
    }
    fn all(mask: Mask) -> bool {
        mask.0.iter().all(|a| *a)
    }
    fn abs(self) -> Lanes {
        self.each(Arithmetic::abs)
    }
    fn exp_neg(self) -> Lanes {
        self.each(Arithmetic::exp_neg)
    }
    fn sqrt(self) -> Lanes {
        self.each(Arithmetic::sqrt)
    }
    fn powf(self, n: Lanes) -> Lanes {
        self.with(n, Arithmetic::powf)
    }
    fn max(self, other: Lanes) -> Lanes {
        self.with(other, Arithmetic::max)
    }
    fn min(self, other: Lanes) -> Lanes {
        self.with(other, Arithmetic::min)
    }
    fn is_finite(self) -> Mask {
        Mask(self.0.map(|a| a.is_finite()))
    }
}

/// Measurements that meet the layer, both limits, the surface, and a number that is none.
fn tick(k: u32, lane: usize) -> Tick<f64> {
    let x = f64::from((k * 37 + 11 * lane as u32) % 101) / 50.0 - 1.0;
    let error = if k % 211 == 7 { f64::NAN } else { 0.002 * x * x * x };
    let error_rate = if k % 223 == 9 { f64::NAN } else { 0.3 * x };
    Tick { error, error_rate, target_velocity: 0.035, target_acceleration: 0.1 * x }
}

/// A law's memory, of which a lane begins anew.
trait Memory {
    fn select(mask: Mask, a: &Self, b: &Self) -> Self;
}

macro_rules! memories {
    ($($law:ident)+) => { $(
        impl Memory for <$law<Lanes> as ControlLaw<Lanes>>::State {
            fn select(mask: Mask, a: &Self, b: &Self) -> Self {
                Self::select(mask, a, b)
            }
        }
    )+ };
}
// PD's is that of each law which remembers its output stage alone.
memories! { Pd Pid SuperTwisting SmcIntegral Dob Voltage }

/// As [`open_loop`], of a law that meets every way out of its output stage.
fn same_bits<S, V>(laws: [S; N], as_one: impl Fn(Each<'_, S, f64, Lanes>) -> V)
where
    S: ControlLaw<f64>,
    V: ControlLaw<Lanes>,
    V::State: Memory,
{
    let limits = open_loop(laws, as_one);
    assert!(limits.iter().all(|n| *n > 0), "each way out of the output stage is met: {limits:?}");
}

/// Runs a law of each lane by itself and all of them as one, of which now and then a lane begins anew, and compares bits; how often each limit decided.
fn open_loop<S, V>(laws: [S; N], as_one: impl Fn(Each<'_, S, f64, Lanes>) -> V) -> [u32; 4]
where
    S: ControlLaw<f64>,
    V: ControlLaw<Lanes>,
    V::State: Memory,
{
    let vector = as_one(&|get| Lanes(std::array::from_fn(|i| get(&laws[i]))));
    let at = |k: u32| -> ([Tick<f64>; N], Tick<Lanes>) {
        let ticks: [Tick<f64>; N] = std::array::from_fn(|i| tick(k, i));
        let of = |get: fn(&Tick<f64>) -> f64| Lanes(std::array::from_fn(|i| get(&ticks[i])));
        let all = Tick {
            error: of(|t| t.error),
            error_rate: of(|t| t.error_rate),
            target_velocity: of(|t| t.target_velocity),
            target_acceleration: of(|t| t.target_acceleration),
        };
        (ticks, all)
    };
    let (ticks, all) = at(0);
    let mut states: Vec<S::State> = (0..N).map(|i| laws[i].start(&ticks[i], 2.25)).collect();
    let mut state = vector.start(&all, Lanes::splat(2.25));
    let (mut limits, mut applied) = ([0; 4], Lanes::splat(2.25));
    for k in 0..20_000 {
        let (ticks, all) = at(k);
        if k % 1000 == 999 {
            // One lane begins anew, with a voltage of its own.
            let lane = (k / 1000) as usize % N;
            states[lane] = laws[lane].start(&ticks[lane], 3.5);
            let begun = vector.start(&all, Lanes::splat(3.5));
            state = Memory::select(Mask(std::array::from_fn(|i| i == lane)), &begun, &state);
        }
        let seen = |applied| Seen { applied, ..Seen::default() };
        vector.sees(&mut state, || Seen { applied, ..Seen::default() });
        let together = vector.update(&mut state, &all);
        for i in 0..N {
            laws[i].sees(&mut states[i], || seen(applied.0[i]));
            let alone = laws[i].update(&mut states[i], &ticks[i]);
            limits[alone.limit as usize] += 1;
            assert_eq!(alone.voltage.to_bits(), together.voltage.0[i].to_bits(), "tick {k}, lane {i}");
            assert_eq!(alone.limit, together.limit[i], "tick {k}, lane {i}");
            let bits = |x: &f64| if x.is_nan() { u64::MAX } else { x.to_bits() };
            for (a, b) in alone.terms.values().iter().zip(together.terms.values()) {
                assert_eq!(bits(a), bits(&b.0[i]), "tick {k}, lane {i}");
            }
        }
        applied = together.voltage;
    }
    limits
}

const PERIOD: Micros = Micros(1000);

fn output() -> OutputParams {
    OutputParams { on_invalid: 4.0, bumpless_time: 0.02, ..OutputParams::within(0.5, 9.0) }
}

fn scaled(i: usize) -> f64 {
    1.0 + 0.3 * i as f64
}

/// A plant with an actuator, and the output stage for it.
fn with(actuator: impl Into<ActuatorParams<f64>>) -> (PlantParams<f64>, OutputParams) {
    let actuator = actuator.into();
    let two_sided = OutputParams { lowest: -8.0, on_invalid: 0.0, ..output() };
    let output = if actuator.kind().two_sided() { two_sided } else { output() };
    (PlantParams { actuator, ..PlantParams::default() }, output)
}

/// Laws whose integral or observer limits hold, with each actuator.
fn laws_that_remember() {
    let both = BothActuator { brake_gain: 0.14, motor_gain: 0.02, preload: 0.01 };
    for (model, output) in [
        with(BrakeActuator { gain: 0.14, preload: 0.02 }),
        with(MotorActuator { gain: 0.05, preload: 0.3, load_share: 0.4 }),
        with(both),
    ] {
        let beside = Beside::paper(&model, &output);
        for boundary in [0.0, 0.1] {
            same_bits(
                std::array::from_fn(|i| {
                    let p = SuperTwistingParams {
                        k1: 20.0 * scaled(i),
                        k2: 200.0 * scaled(i),
                        // A layer in some lanes alone.
                        boundary: if i % 2 == 0 { boundary } else { 0.0 },
                        ..SuperTwistingParams::default()
                    };
                    SuperTwisting::build(&p, &beside).unwrap()
                }),
                |each| SuperTwisting::in_lanes(each),
            );
        }
        same_bits(
            std::array::from_fn(|i| {
                let p = SmcIntegralParams {
                    kp: 9.5 * scaled(i),
                    kd: 5.0 * scaled(i),
                    // One lane keeps no integral.
                    integral: 3000.0 * i as f64,
                    ..SmcIntegralParams::default()
                };
                SmcIntegral::build(&p, &beside).unwrap()
            }),
            |each| SmcIntegral::in_lanes(each),
        );
        same_bits(
            std::array::from_fn(|i| {
                let p = DobParams { kp: 1e4, kd: 2000.0 * scaled(i), bandwidth: 33.0 * scaled(i) };
                Dob::build(&p, &beside).unwrap()
            }),
            |each| Dob::in_lanes(each).unwrap(),
        );
    }
}

#[test]
fn each_law_has_in_each_lane_the_bits_of_the_scalar() {
    same_bits(
        std::array::from_fn(|i| {
            let p = PdParams { kp: 5000.0 * scaled(i), kd: 20.0 };
            Pd::new(&p, &output(), PERIOD).unwrap()
        }),
        |each| Pd::in_lanes(each),
    );
    same_bits(
        std::array::from_fn(|i| {
            let p = SmcParams { kp: 3.0 * scaled(i), boundary: 0.1 * scaled(i), ..SmcParams::default() };
            Smc::new(&p, &output(), PERIOD).unwrap()
        }),
        |each| Smc::in_lanes(each),
    );
    same_bits(
        std::array::from_fn(|i| {
            let p = SmcSignParams { kp: 3.0 * scaled(i), ..SmcSignParams::default() };
            SmcSign::new(&p, &output(), PERIOD).unwrap()
        }),
        |each| SmcSign::in_lanes(each),
    );
    same_bits(
        std::array::from_fn(|i| {
            let p = PidParams {
                kp: 5000.0,
                derivative_time: 0.003 * scaled(i),
                bias: 4.0,
                ..PidParams::default()
            };
            Pid::new(&p, &output(), PERIOD).unwrap()
        }),
        |each| Pid::in_lanes(each),
    );
    laws_that_remember();
    // Open-loop laws, which meet no limit.
    open_loop(
        std::array::from_fn(|i| {
            let p = HoldParams { margin: scaled(i) };
            Hold::new(&p, &PlantParams::default(), &output(), PERIOD).unwrap()
        }),
        |each| Hold::in_lanes(each),
    );
    open_loop(
        std::array::from_fn(|i| {
            let p = VoltageParams {
                start: scaled(i),
                end: 8.0,
                rate: 2.0 * scaled(i),
                wait: 1e-3 * scaled(i),
                returns: i < 2,
            };
            Voltage::new(&p, &output(), PERIOD).unwrap()
        }),
        |each| Voltage::in_lanes(each),
    );
    // Each lane believes in another friction; a power in one of them takes it in all.
    for exponent in [1.0, 1.5] {
        same_bits(
            std::array::from_fn(|i| {
                let friction = StribeckParams {
                    mu_static: 0.2 * scaled(i),
                    stribeck_velocity: 0.001 * scaled(i),
                    stribeck_exponent: if i == 0 { exponent } else { 1.0 },
                    ..StribeckParams::default()
                };
                let model = PlantParams { friction: friction.into(), ..PlantParams::default() };
                let p = CtcParams { outer_gain: 900.0 * scaled(i), ..CtcParams::default() };
                Ctc::new(&p, &model, &output(), PERIOD).unwrap()
            }),
            |each| Ctc::in_lanes(each).unwrap(),
        );
    }
}

#[test]
fn the_smoothed_derivative_has_in_each_lane_the_bits_of_the_scalar() {
    let filters: [SmoothedDerivative<f64>; N] = std::array::from_fn(|i| {
        let p = SmoothedDerivativeParams { smoothing: 0.2 * scaled(i) };
        SmoothedDerivative::new(&p, Encoder::PAPER, PERIOD).unwrap()
    });
    let together = SmoothedDerivative::in_lanes(&|get| Lanes(std::array::from_fn(|i| get(&filters[i]))));
    let (mut rates, mut rate) = ([0.0; N], Lanes::default());
    for k in 0..1000 {
        let differences: [f64; N] = std::array::from_fn(|i| libm::sin(f64::from(k) * 0.37 * scaled(i)));
        rate = together.smooth(rate, Lanes(differences));
        for i in 0..N {
            rates[i] = filters[i].smooth(rates[i], differences[i]);
            assert_eq!(rates[i].to_bits(), rate.0[i].to_bits(), "sample {k}, lane {i}");
        }
    }
}
