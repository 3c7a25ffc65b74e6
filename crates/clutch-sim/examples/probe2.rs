#![allow(missing_docs)]
use clutch_core::law::*;
use clutch_core::reference::ReferenceParams;
use clutch_sim::*;
fn main() {
    for law in [LawParams::Smc(SmcParams::default()), LawParams::Pd(PdParams::default())] {
        for rate in [1.9, 1.99, 1.999, 2.0_f64, 2.001, 2.01, 2.1, 2.2, 3.0, 4.0] {
            let mut spec = RunSpec::new(RigParams::paper(), law, ReferenceParams::Ramp(rate.to_radians()));
            spec.run.duration = 9.0;
            let r = simulate::<f64>(&spec).unwrap();
            spec.rig.delay_ticks = 1;
            let d = simulate::<f64>(&spec).unwrap();
            spec.rig.delay_ticks = 0;
            spec.run.start = Start::Rest;
            let s = simulate::<f64>(&spec).unwrap();
            println!(
                "{rate}: {:.2} {:.4}  delay1 {:.2} {:.4} rest {:.2}",
                r.metrics.stick_slip_cycles_per_s,
                r.metrics.max_error_rad.to_degrees(),
                d.metrics.stick_slip_cycles_per_s,
                d.metrics.max_error_rad.to_degrees(),
                s.metrics.stick_slip_cycles_per_s
            );
        }
    }
}
