//! A servo in `f32`, as on a board, against the one in `f64`.

use clutch_core::law::{CtcParams, LawParams, PdParams, SmcParams};
use clutch_core::reference::ReferenceParams;
use clutch_sim::{RigParams, RunSpec, simulate};

#[test]
fn single_precision_gives_the_same_errors_and_cycles() {
    for (law, rate) in [
        (LawParams::Pd(PdParams::default()), 2.0),
        (LawParams::Pd(PdParams::default()), 20.0),
        (LawParams::Ctc(CtcParams::default()), 2.0),
        (LawParams::Smc(SmcParams::default()), 2.0),
        (LawParams::Smc(SmcParams::default()), 20.0),
    ] {
        let spec = RunSpec::new(RigParams::paper(), law, ReferenceParams::ramp(f64::to_radians(rate)));
        let wide = simulate::<f64>(&spec).unwrap().metrics;
        let narrow = simulate::<f32>(&spec).unwrap().metrics;
        let apart = (wide.max_error_rad - narrow.max_error_rad).abs().to_degrees();
        assert!(apart < 0.004, "{law:?} at {rate} °/s: errors {apart}° apart");
        let cycles = (wide.stick_slip_cycles_per_s - narrow.stick_slip_cycles_per_s).abs();
        assert!(cycles <= 3.0, "{law:?} at {rate} °/s: {cycles} cycles per s apart");
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_does_not() {
    for rig in [RigParams::paper(), RigParams { torque_noise: 1e-4, ..RigParams::bench() }] {
        let path = ReferenceParams::ramp(2.0_f64.to_radians());
        let mut spec = RunSpec::new(rig, LawParams::Smc(SmcParams::default()), path);
        spec.run.duration = 2.0;
        let (a, b) = (simulate::<f32>(&spec).unwrap(), simulate::<f32>(&spec).unwrap());
        assert_eq!(a, b);
        spec.run.seed += 1;
        assert_ne!(a.trace, simulate::<f32>(&spec).unwrap().trace);
    }
}
