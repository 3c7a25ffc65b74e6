//! No engine gives a shaft energy: every actuator and friction, under a torque and a voltage that are held.

use crate::draw::Draw;
use crate::parts::Interval;
use clutch_core::friction::{FrictionParams, StribeckParams};
use clutch_core::{FrictionModel, Plant, PlantParams};
use clutch_sim::engine::{Bristle, DormandPrince, Engine, ExactFlow};

/// Torque times way, less what the shaft has gained, went into friction, drag, and bristles that bend: never below nothing. Bristles
/// that could give energy have the viscous damping from which on they cannot.
fn gains_nothing(seed: u64, friction: fn(&mut Draw) -> FrictionParams, engine: fn() -> Box<dyn Engine>) {
    let mut draw = Draw::new(seed);
    let (mut moved, mut took) = (0, 0);
    for n in 0..1000 {
        let friction = friction(&mut draw);
        let mut interval = Interval::draw(&mut draw, friction, true);
        let plant = interval.model.plant;
        let normal = plant.actuator().normal(interval.held());
        if let Some(bristles) = plant.friction().bristles() {
            let damping = plant.params().viscous_damping.max(1.001 * bristles.passive_from() * normal);
            interval.model.plant =
                Plant::new(&PlantParams { viscous_damping: damping, ..*plant.params() }).unwrap();
        }
        let p = *interval.model.plant.params();
        let (shaft, _) = interval.end(engine().as_mut(), 1);
        let given = (p.drive_torque + plant.actuator().torque(interval.held())) * shaft.position;
        let kinetic = [interval.velocity, shaft.velocity].map(|v| 0.5 * p.inertia * v * v);
        let gained = kinetic[1] - kinetic[0];
        let rounding = 1e-7 * (given.abs() + kinetic[0] + kinetic[1]);
        assert!(given - gained >= -rounding, "{n}: {given:e} J given, {gained:e} J gained, {p:?}");
        moved += u32::from(shaft.position != 0.0);
        took += u32::from(given - gained > 1e3 * rounding);
    }
    // Most move, and friction takes a part that is no rounding.
    assert!(moved > 500 && took > 300, "{moved} moved, of {took} friction took energy");
}

#[test]
fn the_exact_flow_gives_no_energy() {
    let friction = |draw: &mut Draw| match draw.friction() {
        FrictionParams::Stribeck(p) => StribeckParams { stribeck_exponent: 1.0, ..p }.into(),
        other => other,
    };
    gains_nothing(71, friction, || Box::new(ExactFlow));
}

#[test]
fn dormand_prince_gives_no_energy() {
    gains_nothing(72, Draw::friction, || Box::new(DormandPrince::default()));
}

#[test]
fn bristles_give_no_more_energy_than_they_took() {
    gains_nothing(73, Draw::bristled, || Box::new(Bristle::default()));
}
