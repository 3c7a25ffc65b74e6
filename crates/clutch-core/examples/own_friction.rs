//! Friction numbers of your own, in the computed-torque law, as the part of a firmware that controls.
//!
//! ```sh
//! cargo test --package clutch-core --example own_friction     # on a PC: are the numbers taken?
//! cargo build --release --package clutch-core --example own_friction --target thumbv7em-none-eabihf
//! ```
#![cfg_attr(not(test), no_std)]

use clutch_core::law::{ControlLaw, CtcParams, Law, LawParams, OutputParams};
use clutch_core::reference::{Reference, ReferenceParams};
use clutch_core::{
    ActuatorParams, Counts, DacCode, Encoder, FixedCounts, ParamError, PlantParams, Servo, ServoParams,
    ServoState, StribeckParams,
};

/// The measured values of the brake and the shaft; the rest as in the paper.
fn model() -> PlantParams<f32> {
    let friction = StribeckParams {
        mu_static: 0.31,
        mu_dynamic: 0.26,
        stribeck_velocity: 0.02, // rad/s
        ..StribeckParams::default()
    }
    .into();
    PlantParams {
        inertia: 0.0042,
        drive_torque: 0.11,
        actuator: ActuatorParams::brake(0.09),
        friction,
        ..PlantParams::default()
    }
}

/// The control of one shaft, along a path of 2 °/s.
pub struct Control {
    servo: Servo<f32>,
    path: Reference<'static, f32>,
    state: ServoState<f32, <Law<f32> as ControlLaw<f32>>::State>,
    tick: u64,
}

impl Control {
    /// Begins where the shaft is, with the brake at `applied` volts.
    ///
    /// # Errors
    /// The first number out of range. On a board show it, by a light at least, and leave the brake in its safe state:
    /// the numbers are known when this is compiled, and of a firmware whose numbers are refused an optimiser leaves
    /// nothing but that.
    pub fn start(counts: Counts, applied: f32) -> Result<Control, ParamError<f32>> {
        let servo = Servo::<f32>::new(&ServoParams {
            model: model(),
            // The driver of this brake ends at 8 V; on a demand that is not a number it brakes fully, too.
            output: OutputParams::within(0.0, 8.0),
            ..ServoParams::paper(LawParams::Ctc(CtcParams::default()))
        })?;
        let path = ReferenceParams::ramp(2.0_f32.to_radians());
        let from = FixedCounts::from_counts(i64::from(counts.0));
        let path = Reference::new(&path, from, Encoder::PAPER, servo.period())?;
        let state = servo.start(counts, &path.at(0), applied);
        Ok(Control { servo, path, state, tick: 0 })
    }

    /// To be called every millisecond: the encoder's counts in, the converter's code out.
    pub fn period(&mut self, counts: Counts) -> DacCode {
        let target = self.path.at(self.tick);
        self.tick = self.tick.wrapping_add(1);
        self.servo.tick(&mut self.state, counts, &target).code
    }
}

#[test]
fn the_numbers_are_taken_and_the_law_uses_them() -> Result<(), ParamError<f32>> {
    let mut control = Control::start(Counts(0), 0.0)?;
    let volts = |code: DacCode| f32::from(code.0) * 20.0 / 4096.0 - 10.0;
    // On the path: T_u / (μ K_COF) at 2 °/s, 4.55 V with these numbers and 2.24 V with the paper's.
    let on_path = volts(control.period(Counts(0)));
    assert!((on_path - 4.55).abs() < 0.01, "{on_path} V");
    // Far ahead of it: all that the driver has.
    let far_ahead = volts(control.period(Counts(2000)));
    assert!((far_ahead - 8.0).abs() < 0.005, "{far_ahead} V");
    Ok(())
}
