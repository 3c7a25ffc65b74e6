//! Ten simulated seconds on each rig, and engine against engine on the same run.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use clutch_core::law::{LawParams, PdParams};
use clutch_core::reference::ReferenceParams;
use clutch_core::{Friction, FrictionModel, Plant, PlantParams, StribeckParams};
use clutch_sim::drive::{Drive, DriveParams, SineDrive};
use clutch_sim::engine::{self, DormandPrince, Engine, EngineKind, Input, Model, Volts};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::rig::RigBase;
use clutch_sim::scenario::Value;
use clutch_sim::sweep::Sweep;
use clutch_sim::system::{Motion, System, SystemState};
use clutch_sim::{Keep, RigParams, RunSpec, simulate};
use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{SMatrix, SVector};
use std::sync::atomic::AtomicBool;

fn ten_seconds(rig: RigParams, law: LawParams, rate_deg_s: f64) -> RunSpec<'static> {
    let mut spec = RunSpec::new(rig, law, ReferenceParams::ramp(rate_deg_s.to_radians()));
    spec.run.duration = 10.0;
    spec
}

fn rigs(c: &mut Criterion) {
    let mut group = c.benchmark_group("run_10_s");
    group.sample_size(10);
    for base in RigBase::ALL {
        let name = base.name();
        let rig = RigParams::named(*base);
        for law in ["pd", "ctc", "smc", "pid"] {
            let params = LawParams::named(law).expect("a law of the list");
            for rate in [20.0, 2.0] {
                let spec = ten_seconds(rig.clone(), params, rate);
                group.bench_function(format!("{name}/{law}_{rate}_deg_s"), |b| {
                    b.iter(|| simulate::<f64>(&spec).expect("runs"));
                });
            }
        }
    }
    group.finish();
}

fn engines(c: &mut Criterion) {
    let mut group = c.benchmark_group("engine_10_s");
    group.sample_size(10);
    for rate in [20.0, 2.0] {
        for (name, engine) in
            [("exact_flow", EngineKind::ExactFlow), ("dormand_prince", EngineKind::DormandPrince)]
        {
            let mut spec = ten_seconds(RigParams::paper(), LawParams::Pd(PdParams::default()), rate);
            spec.run.engine = engine;
            group.bench_function(format!("{name}/pd_{rate}_deg_s"), |b| {
                b.iter(|| simulate::<f64>(&spec).expect("runs"));
            });
        }
    }
    group.finish();
}

/// The paper's shaft, 2 V, under a torque that swings across break-away: as a shaft, and as a system of one inertia and one
/// row.
struct Shaft(Friction<f64>);

impl System<1, 1> for Shaft {
    fn inertia(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from([[0.0017]])
    }
    fn applied(&self, t: f64, _: &SVector<f64, 1>, v: &SVector<f64, 1>) -> SVector<f64, 1> {
        SVector::from([0.03 + 0.05 * (6.0 * std::f64::consts::PI * t).sin() - 0.001 * v[0]])
    }
    fn rows(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from([[1.0]])
    }
    fn normal(&self, _: f64) -> SVector<f64, 1> {
        SVector::from([0.28])
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        &self.0
    }
}

fn systems(c: &mut Criterion) {
    let mut group = c.benchmark_group("shaft_1_s");
    group.sample_size(10);
    let params = StribeckParams { stribeck_velocity: 0.01, ..StribeckParams::default() };
    let system = Shaft(Friction::build(&params.into()).expect("in range"));
    group.bench_function("system", |b| {
        b.iter(|| {
            let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity: SVector::zeros() };
            let mut motion = Motion::new(&system, begin).expect("a system");
            motion.advance(1.0, &mut Vec::new()).expect("it can be followed");
            motion.state().position
        });
    });
    let plant = PlantParams { friction: params.into(), ..PlantParams::default() };
    let model = Model { plant: Plant::new(&plant).expect("in range"), ripple: None };
    let sine = SineDrive { mean: 0.03, amplitude: 0.05, frequency: 3.0, phase_turns: 0.0 };
    let drive = Drive::new(&DriveParams::Sine(sine), 0).expect("in range");
    group.bench_function("dormand_prince", |b| {
        b.iter(|| {
            let (mut engine, mut shaft, mut events) =
                (DormandPrince::default(), engine::Shaft::new(0.0, 0.0), Vec::new());
            for k in 0..1000 {
                let (time, volts) = (f64::from(k) * 1e-3, Volts::Held(2.0));
                let input = Input { time, duration: 1e-3, origin: 0.0, volts, drive: &drive, noise: 0.0 };
                engine.advance(&model, &input, &mut shaft, &mut events).expect("it can be followed");
            }
            shaft.position
        });
    });
    group.finish();
}

/// 256 runs with gains of their own: in the lanes of vectors, as a sweep does, and one by one; on one thread.
fn lanes(c: &mut Criterion) {
    let mut group = c.benchmark_group("sweep_256_x_10_s");
    group.sample_size(10);
    // A gain of each law, its least value, and the range of values.
    let laws = [
        ("pd", "kp_v_rad", 4000.0, 2048.0),
        ("super_twisting", "k1_v_rt_s_rad", 4.0, 1.0),
        ("smc_integral", "kp_v", 6.5, 1.0),
        ("dob", "kp_1_s2", 9000.0, 2000.0),
    ];
    let on = [("paper", 20.0), ("paper", 2.0), ("bench", 2.0)];
    for ((law, gain, least, range), (rig, rate)) in laws.iter().flat_map(|law| on.map(|on| (*law, on))) {
        let base =
            format!("name = \"{law}\"\n[rig]\nbase = \"{rig}\"\n[law.{law}]\n[run]\nduration_s = 10.0\n");
        let table = format!("{base}[reference.ramp]\nrate_deg_s = {rate}\n").parse().expect("a table");
        let keys = vec![format!("law.{law}.{gain}")];
        let rows = (0..256).map(|i| vec![Value::Float(least + range * f64::from(i) / 256.0)]).collect();
        let sweep = Sweep::new(law, table, keys, rows).expect("a value for the key in each row");
        let never = AtomicBool::new(false);
        group.bench_function(format!("in_lanes/{rig}/{law}_{rate}_deg_s"), |b| {
            b.iter(|| sweep.run(1, Keep::Figures, &never, &|_, row| assert!(row.is_ok())));
        });
        group.bench_function(format!("one_by_one/{rig}/{law}_{rate}_deg_s"), |b| {
            b.iter(|| {
                for i in 0..sweep.len() {
                    let scenario = sweep.scenario(i).expect("in range");
                    scenario.run(Keep::Figures, UNWATCHED).expect("runs");
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, rigs, engines, systems, lanes);
criterion_main!(benches);
