use clutch_core::law::*;
use clutch_core::reference::ReferenceParams;
use clutch_sim::engine::EngineKind;
use clutch_sim::*;
use std::time::Instant;
fn main() {
    let laws = [
        ("PD", LawParams::Pd(PdParams::default())),
        ("CTC", LawParams::Ctc(CtcParams::default())),
        ("SMC", LawParams::Smc(SmcParams::default())),
    ];
    for (rig, kinds) in [
        ("paper", &[EngineKind::DormandPrince, EngineKind::ExactFlow][..]),
        ("bench", &[EngineKind::Auto][..]),
    ] {
        for kind in kinds {
            for (name, law) in &laws {
                for rate in [100.0, 20.0, 10.0, 6.0, 2.0_f64] {
                    let mut spec = RunSpec::new(
                        RigParams::named(rig).unwrap(),
                        *law,
                        ReferenceParams::Ramp(rate.to_radians()),
                    );
                    spec.run.engine = *kind;
                    let t = Instant::now();
                    match simulate::<f64>(&spec) {
                        Ok(r) => {
                            let m = r.metrics;
                            println!(
                                "{rig} {name} {rate} {:?}: max {:.4} mean {:.4} cyc {:.2} stuck {:.3} events {} ({:.1} ms)",
                                r.engine,
                                m.max_error_rad.to_degrees(),
                                m.mean_error_rad.to_degrees(),
                                m.stick_slip_cycles_per_s,
                                m.stick_time_fraction,
                                r.events.len(),
                                t.elapsed().as_secs_f64() * 1e3
                            );
                        }
                        Err(e) => println!("{rig} {name} {rate}: {e}"),
                    }
                }
            }
        }
    }
}
