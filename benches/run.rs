//! Ten simulated seconds on each rig, and engine against engine on the same run.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use clutch_core::law::{LawParams, PdParams, SmcParams};
use clutch_core::reference::ReferenceParams;
use clutch_sim::engine::EngineKind;
use clutch_sim::rig::RigBase;
use clutch_sim::{RigParams, RunSpec, simulate};
use criterion::{Criterion, criterion_group, criterion_main};

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
        for (law_name, law) in
            [("pd", LawParams::Pd(PdParams::default())), ("smc", LawParams::Smc(SmcParams::default()))]
        {
            for rate in [20.0, 2.0] {
                let spec = ten_seconds(rig.clone(), law, rate);
                group.bench_function(format!("{name}/{law_name}_{rate}_deg_s"), |b| {
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

criterion_group!(benches, rigs, engines);
criterion_main!(benches);
