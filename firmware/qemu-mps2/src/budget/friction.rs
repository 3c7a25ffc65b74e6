//! One evaluation of each friction model: of a curve its coefficient at a velocity, of bristles their rate and the
//! coefficient, as a simulation on the chip would ask.

use crate::meter::{Tally, instructions};
use clutch_core::friction::{
    Bend, Bristles, CoulombParams, DahlParams, ElastoPlasticParams, Friction, FrictionModel, FrictionParams,
    LugreParams, MaxwellParams, StribeckParams,
};

/// A velocity in, `μ` out.
#[inline(never)]
extern "C" fn curve(friction: &Friction<f32>, velocity: &f32) -> f32 {
    friction.coefficient(*velocity)
}

/// A deflection and a velocity in, `μ` out.
#[inline(never)]
extern "C" fn bristled(bristles: &Bristles<f32>, bend: &Bend<f32>, velocity: &f32) -> f32 {
    bristles.coefficient(bend, &core::hint::black_box(bristles.rate(bend, *velocity)))
}

/// Measures and prints: the default of each model, as `cargo xtask bench -- friction` does.
pub fn measure() -> Option<()> {
    let squared = StribeckParams { stribeck_exponent: 2.0, ..StribeckParams::default() };
    let models: [(&str, FrictionParams<f32>); 7] = [
        ("friction_coulomb", CoulombParams::default().into()),
        ("friction_stribeck", StribeckParams::default().into()),
        ("friction_stribeck_exponent_2", squared.into()),
        ("friction_lugre", LugreParams::default().into()),
        ("friction_dahl", DahlParams::default().into()),
        ("friction_elasto_plastic", ElastoPlasticParams::default().into()),
        ("friction_maxwell", MaxwellParams::default().into()),
    ];
    for (name, params) in models {
        let friction = Friction::build(&params).ok()?;
        let mut tally = Tally::new(name);
        // Within some Stribeck velocities of rest, either way; bristles bent by all shares of what they can.
        let x = |i: u16| (f32::from(i.wrapping_mul(37) % 64) - 32.0) / 32.0;
        for i in 0..64 {
            let velocity = 0.005 * x(i);
            let called = match friction.bristles() {
                None => {
                    let function = curve as extern "C" fn(&Friction<f32>, &f32) -> f32;
                    let arguments = [&raw const friction as usize, &raw const velocity as usize, 0];
                    // SAFETY: the arguments are those of the function.
                    unsafe { instructions(function as usize, arguments) }
                }
                Some(bristles) => {
                    let bend = bristles.holding(x(i.wrapping_add(11)) * friction.at_rest());
                    let function = bristled as extern "C" fn(&Bristles<f32>, &Bend<f32>, &f32) -> f32;
                    let arguments = [
                        &raw const bristles as usize,
                        &raw const bend as usize,
                        &raw const velocity as usize,
                    ];
                    // SAFETY: the arguments are those of the function.
                    unsafe { instructions(function as usize, arguments) }
                }
            };
            tally.add(called);
        }
        tally.print();
    }
    Some(())
}
