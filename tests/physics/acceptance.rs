//! Cases whose answer is known independently of this code.

use clutch_core::law::{LawParams, PdParams, SmcParams};
use clutch_core::reference::ReferenceParams;
use clutch_core::{ActuatorParams, Plant, PlantParams, StribeckParams};
use clutch_sim::drive::Drive;
use clutch_sim::engine::{EventKind, Motion, Shaft};
use clutch_sim::{RigParams, RunSpec, simulate};
use clutch_tests::{advance, assert_near, engines, model};

fn table1_drive() -> Drive {
    Drive::Constant(PlantParams::<f64>::default().drive_torque)
}

#[test]
fn a1_holding_voltages_and_free_motion_of_the_papers_shaft() {
    let plant = Plant::<f64>::new(&PlantParams::default()).unwrap();
    assert_near("static holding voltage, V", plant.holding_voltage_static(), 1.681714, 1e-6);
    assert_near("sliding holding voltage, V", plant.holding_voltage_sliding(), 2.242286, 1e-6);
    assert_near("free acceleration, rad/s²", plant.acceleration(0.0, 0.0), 27.69882, 1e-5);
    let (m, drive) = (model(&PlantParams::default()), table1_drive());
    for (name, mut engine) in engines() {
        let mut shaft = Shaft::new(0.0, 0.0);
        let events = advance(engine.as_mut(), &m, &drive, 0.0, &mut shaft, 100);
        assert_eq!(events[0].kind, EventKind::BreakAway, "{name}: a released shaft moves at once");
        assert_near(&format!("{name}: speed after 0.1 s of free fall"), shaft.velocity, 2.6899894, 2.7e-6);
        advance(engine.as_mut(), &m, &drive, 0.0, &mut shaft, 60_000);
        assert_near(&format!("{name}: terminal speed"), shaft.velocity, 47.088, 47e-6);
    }
}

#[test]
fn a2_a_constant_brake_stops_the_shaft_at_the_analytic_instant() {
    let flat = StribeckParams { mu_static: 0.15, mu_dynamic: 0.15, ..StribeckParams::default() };
    for (damping, instant, angle_deg) in [(0.001, 0.0504770714, Some(2.5113638)), (0.0, 0.0512339, None)] {
        let params =
            PlantParams { friction: flat.into(), viscous_damping: damping, ..PlantParams::default() };
        // Without damping: t = J ω0 / (μ K v − T), exactly.
        let exact = 0.0017 * 100.0_f64.to_radians() / (0.15 * 0.14 * 5.0 - params.drive_torque);
        for (name, mut engine) in engines() {
            let mut shaft = Shaft::new(0.0, 100.0_f64.to_radians());
            let events = advance(engine.as_mut(), &model(&params), &table1_drive(), 5.0, &mut shaft, 100);
            assert_eq!(events.len(), 1, "{name}: it stops once and stays");
            let tolerance = if angle_deg.is_some() { 1e-9 } else { 1e-7 }; // digits of the constant
            assert_near(&format!("{name}: instant of the stop"), events[0].time, instant, tolerance);
            if damping == 0.0 {
                assert_near(&format!("{name}: instant, in closed form"), events[0].time, exact, 1e-12);
            }
            if let Some(angle) = angle_deg {
                assert_near(&format!("{name}: angle of the stop"), shaft.position.to_degrees(), angle, 1e-7);
            }
            assert_eq!((shaft.velocity, shaft.motion), (0.0, Motion::Stuck));
        }
    }
}

#[test]
fn a3_on_a_ramp_the_offset_is_what_the_gains_and_the_holding_voltage_make_it() {
    let pd = LawParams::Pd(PdParams::default());
    let smc = LawParams::Smc(SmcParams::default());
    for (name, law, rate, offset_deg) in [
        ("PD", pd, 2.0, 0.0256757),
        ("SMC", smc, 2.0, 0.0611325),
        ("PD", pd, 100.0, 0.0247423),
        ("SMC", smc, 100.0, 0.0589103),
    ] {
        let path = ReferenceParams::ramp(f64::to_radians(rate));
        let run = simulate::<f64>(&RunSpec::new(RigParams::ideal(), law, path)).unwrap();
        // The brake is on while the shaft is ahead: e is negative.
        let measured = -run.metrics.mean_error_rad.to_degrees();
        assert_near(&format!("{name} at {rate} °/s: offset in °"), measured, offset_deg, 1e-5 * offset_deg);
        assert_eq!(
            run.metrics.stick_slip_cycles_per_s, 0.0,
            "{name} at {rate} °/s never sticks on an ideal rig"
        );
    }
}

#[test]
fn a4_a_held_shaft_does_not_creep_in_an_hour() {
    let plant = Plant::<f64>::new(&PlantParams::default()).unwrap();
    for share in [0.84, 0.999] {
        for (name, mut engine) in engines() {
            let mut shaft = Shaft::new(0.3, 0.0);
            let volts = plant.holding_voltage_static() / share;
            let m = model(&PlantParams::default());
            let events = advance(engine.as_mut(), &m, &table1_drive(), volts, &mut shaft, 3_600_000);
            assert_eq!(shaft.position, 0.3, "{name}: crept at {share} of the static limit");
            assert!(events.is_empty(), "{name}");
        }
    }
}

/// A mass on a spring with Coulomb friction: unit inertia and brake gain, `F_c = μ K v = 1`.
fn coulomb(drive_torque: f64) -> PlantParams {
    PlantParams {
        inertia: 1.0,
        drive_torque,
        viscous_damping: 0.0,
        actuator: ActuatorParams::brake(1.0),
        friction: StribeckParams { mu_static: 1.0, mu_dynamic: 1.0, ..StribeckParams::default() }.into(),
    }
}

#[test]
fn a9_a_coulomb_oscillator_loses_two_percent_of_a_unit_each_half_cycle_and_stops_after_five() {
    let (_, mut engine) = engines().into_iter().next().unwrap(); // a spring is not for the exact flow
    let mut shaft = Shaft::new(0.105, 0.0);
    let spring = Drive::Spring { stiffness: 100.0, rest: 0.0, damping: 0.0, speed: 0.0 };
    let events = advance(engine.as_mut(), &model(&coulomb(0.0)), &spring, 1.0, &mut shaft, 3_000);
    assert_eq!(events.len(), 2, "it breaks away once and sticks once");
    assert_near("instant of the stop", events[1].time, core::f64::consts::FRAC_PI_2, 1e-9);
    assert_near("place of the stop", shaft.position, -0.005, 1e-9);
    assert_eq!(shaft.motion, Motion::Stuck);
}

#[test]
fn p3_a_brake_that_closes_at_0_1_s_stops_a_sliding_mass_at_1_1_s_after_0_6_m() {
    let params = PlantParams {
        friction: StribeckParams { mu_static: 0.5, mu_dynamic: 0.5, ..StribeckParams::default() }.into(),
        ..coulomb(0.0)
    };
    for (name, mut engine) in engines() {
        let mut shaft = Shaft::new(0.0, 1.0);
        let none = Drive::Constant(0.0);
        advance(engine.as_mut(), &model(&params), &none, 0.0, &mut shaft, 100);
        let events = advance(engine.as_mut(), &model(&params), &none, 2.0, &mut shaft, 2_000);
        assert_eq!(events.len(), 1, "{name}: it stops and stays");
        assert_near(&format!("{name}: instant of the stop"), 0.1 + events[0].time, 1.1, 1e-9);
        assert_near(&format!("{name}: place of the stop"), shaft.position, 0.6, 1e-9);
        assert_eq!(shaft.velocity, 0.0);
    }
}
