//! One step: each law by itself, the velocity sources, the servo's whole tick, and one evaluation of each friction model, in
//! `f32` and `f64`.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use clutch_core::friction::{
    CoulombParams, DahlParams, ElastoPlasticParams, Friction, FrictionModel, FrictionParams, LugreParams,
    MaxwellParams, StribeckParams,
};
use clutch_core::law::{Beside, ControlLaw, Law, LawParams, OutputParams, Tick};
use clutch_core::params::Choice;
use clutch_core::{
    Counts, FixedCounts, ObserverParams, PlantParams, Real, Servo, ServoParams, SmoothedDerivativeParams,
    Target, VelocityParams,
};
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

/// Sixty-four measurements around a path, so that no branch is always the same.
fn ticks<T: Real>() -> Vec<Tick<T>> {
    (0..64)
        .map(|i| {
            let x = f64::from((i * 37) % 64 - 32) / 32.0;
            Tick {
                error: T::from_f64(0.002 * x),
                error_rate: T::from_f64(0.2 * x * x - 0.05),
                target_velocity: T::from_f64(0.035),
                target_acceleration: T::ZERO,
            }
        })
        .collect()
}

fn law_step<T: Real>(c: &mut Criterion, scalar: &str) {
    let mut group = c.benchmark_group(format!("law/{scalar}"));
    for params in LawParams::<T>::all() {
        let name = params.name();
        let law = Law::new(&params, &Beside::paper(&PlantParams::default(), &OutputParams::default()))
            .expect("Table 2 is in range");
        let (ticks, mut state, mut i) = (ticks::<T>(), Default::default(), 0);
        group.bench_function(name, |b| {
            b.iter(|| {
                i = (i + 1) % 64;
                law.update(&mut state, black_box(&ticks[i]))
            });
        });
    }
    group.finish();
}

fn servo_tick<T: Real>(c: &mut Criterion, scalar: &str) {
    let mut group = c.benchmark_group(format!("servo/{scalar}"));
    let sources = [
        ("", VelocityParams::SmoothedDerivative(SmoothedDerivativeParams::default())),
        ("_observer", VelocityParams::Observer(ObserverParams::default())),
    ];
    for params in LawParams::<T>::all() {
        let name = params.name();
        for (suffix, velocity) in sources {
            let params = ServoParams { velocity, ..ServoParams::paper(params) };
            let servo = Servo::new(&params).expect("the paper's servo is in range");
            // 2 °/s: a count each ninth tick.
            let target = |k: i64| Target {
                position: FixedCounts(k * 7282),
                velocity: T::from_f64(2.0_f64.to_radians()),
                acceleration: T::ZERO,
            };
            let (mut state, mut k) = (servo.start(Counts(0), &target(0), T::from_f64(2.25)), 0_i64);
            group.bench_function(format!("{name}{suffix}"), |b| {
                b.iter(|| {
                    k += 1;
                    servo.tick(&mut state, black_box(Counts((k / 9) as i32)), black_box(&target(k)))
                });
            });
        }
    }
    group.finish();
}

/// Friction at a velocity; of bristles, the rate of their bend and the friction that it makes.
fn friction_step<T: Real>(c: &mut Criterion, scalar: &str) {
    let mut group = c.benchmark_group(format!("friction/{scalar}"));
    let squared = StribeckParams { stribeck_exponent: T::from_f64(2.0), ..StribeckParams::default() };
    let models: [(&str, FrictionParams<T>); 7] = [
        ("coulomb", CoulombParams::default().into()),
        ("stribeck", StribeckParams::default().into()),
        ("stribeck_exponent_2", squared.into()),
        ("lugre", LugreParams::default().into()),
        ("dahl", DahlParams::default().into()),
        ("elasto_plastic", ElastoPlasticParams::default().into()),
        ("maxwell", MaxwellParams::default().into()),
    ];
    for (name, params) in models {
        let friction = Friction::build(&params).expect("defaults are in range");
        // Within some Stribeck velocities of rest, either way; bristles bent by all shares of what they can.
        let x = |i: i32| T::from_f64(f64::from((i * 37) % 64 - 32) / 32.0);
        let at: Vec<_> = (0..64).map(|i| (T::from_f64(0.005) * x(i), x(i + 11))).collect();
        let mut i = 0;
        match friction.bristles() {
            None => group.bench_function(name, |b| {
                b.iter(|| {
                    i = (i + 1) % 64;
                    friction.coefficient(black_box(at[i].0))
                });
            }),
            Some(bristles) => {
                let bends: Vec<_> =
                    at.iter().map(|(_, share)| bristles.holding(*share * friction.at_rest())).collect();
                group.bench_function(name, |b| {
                    b.iter(|| {
                        i = (i + 1) % 64;
                        let bend = black_box(&bends[i]);
                        let rate = bristles.rate(bend, black_box(at[i].0));
                        bristles.coefficient(bend, &rate)
                    });
                })
            }
        };
    }
    group.finish();
}

fn all(c: &mut Criterion) {
    friction_step::<f32>(c, "f32");
    friction_step::<f64>(c, "f64");
    law_step::<f32>(c, "f32");
    law_step::<f64>(c, "f64");
    servo_tick::<f32>(c, "f32");
    servo_tick::<f64>(c, "f64");
}

criterion_group!(benches, all);
criterion_main!(benches);
