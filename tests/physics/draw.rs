//! Random shafts, drives and discs, the same each time.

use clutch_core::friction::{
    CoulombParams, DahlParams, ElastoPlasticParams, FrictionParams, LugreParams, MaxwellParams,
    StribeckParams,
};
use clutch_core::{
    ActuatorParams, BothActuator, BrakeActuator, Friction, FrictionModel, MotorActuator, PlantParams,
};
use clutch_sim::Points;
use clutch_sim::drive::{
    BeltDrive, ChirpDrive, DriveParams, HandDrive, RampDrive, Side, SineDrive, SpringDrive, TableDrive,
    WeightDrive,
};
use clutch_sim::ripple::{RippleParams, RunoutParams};

/// A source of random numbers.
pub(crate) struct Draw(u64);

impl Draw {
    pub(crate) fn new(seed: u64) -> Self {
        Draw(seed)
    }

    /// Below 1.
    pub(crate) fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// Evenly in its logarithm.
    pub(crate) fn log(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.share())
    }

    /// Below `n`.
    pub(crate) fn whole(&mut self, n: u64) -> u64 {
        (self.share() * n as f64) as u64
    }

    pub(crate) fn one_in(&mut self, n: u64) -> bool {
        self.whole(n) == 0
    }

    pub(crate) fn of<T: Clone>(&mut self, all: &[T]) -> T {
        all[self.whole(all.len() as u64) as usize].clone()
    }

    /// Friction without bristles.
    pub(crate) fn friction(&mut self) -> FrictionParams {
        let mu_dynamic = self.log(0.02, 0.5);
        let mu_static = mu_dynamic * if self.one_in(10) { 1.0 } else { self.between(1.0, 2.5) };
        if self.one_in(4) {
            return CoulombParams { mu_static, mu_dynamic }.into();
        }
        let stribeck_exponent = if self.one_in(3) { self.between(0.5, 3.0) } else { 1.0 };
        StribeckParams { mu_static, mu_dynamic, stribeck_velocity: self.log(1e-4, 1.0), stribeck_exponent }
            .into()
    }

    /// Friction with bristles.
    pub(crate) fn bristled(&mut self) -> FrictionParams {
        let mu_dynamic = self.log(0.02, 0.5);
        let mu_static = mu_dynamic * self.between(1.0, 2.0);
        let (stribeck_velocity, stribeck_exponent) = (self.log(1e-3, 0.1), self.between(1.0, 2.0));
        let stiffness = mu_dynamic * self.log(1e3, 1e5);
        let damping = self.log(0.1, 1.0) * stiffness.sqrt();
        match self.whole(4) {
            0 => LugreParams {
                mu_static,
                mu_dynamic,
                stribeck_velocity,
                stribeck_exponent,
                stiffness,
                damping,
            }
            .into(),
            1 => {
                let elastic = 0.8 * mu_dynamic;
                ElastoPlasticParams {
                    mu_static,
                    mu_dynamic,
                    stribeck_velocity,
                    stribeck_exponent,
                    stiffness,
                    damping,
                    elastic,
                }
                .into()
            }
            2 => DahlParams { mu_dynamic, stiffness }.into(),
            _ => MaxwellParams {
                mu_static,
                mu_dynamic,
                stribeck_velocity,
                stribeck_exponent,
                ..MaxwellParams::default()
            }
            .into(),
        }
    }

    /// Friction with one bristle in each place.
    pub(crate) fn of_one_bristle(&mut self) -> FrictionParams {
        loop {
            match self.bristled() {
                FrictionParams::Maxwell(_) => {}
                one => return one,
            }
        }
    }

    /// A shaft that moves by some Stribeck velocities or by hundreds in a time, s, under about such a voltage; a torque of
    /// about what its friction holds then, N m.
    pub(crate) fn plant(&mut self, friction: FrictionParams, seconds: f64, volts: f64) -> (PlantParams, f64) {
        let mu = Friction::build(&friction).unwrap().at_rest();
        let gain = self.log(0.01, 1.0);
        let preload = if self.one_in(2) { 0.0 } else { gain * self.log(0.01, 1.0) };
        let (actuator, torque): (ActuatorParams, f64) = match self.whole(4) {
            0 => {
                let (preload, load_share) = (gain / mu, if self.one_in(2) { 0.0 } else { 0.3 });
                (MotorActuator { gain, preload, load_share }.into(), gain)
            }
            1 => {
                let motor_gain = gain * self.log(0.1, 1.0);
                (BothActuator { brake_gain: gain, motor_gain, preload }.into(), mu * gain * volts)
            }
            _ => (BrakeActuator { gain, preload }.into(), mu * gain * volts),
        };
        let inertia = self.log(1e-5, 0.1);
        let drag = if self.one_in(5) { 0.0 } else { self.log(1e-4, 0.3) };
        let viscous_damping = drag * inertia / seconds;
        let torque = torque * self.between(0.3, 1.5);
        (PlantParams { inertia, drive_torque: torque, viscous_damping, actuator, friction }, torque)
    }

    /// A drive of about that torque, N m, over a time, s.
    pub(crate) fn drive(&mut self, torque: f64, seconds: f64) -> DriveParams {
        let torque = torque * self.of(&[1.0, 1.0, -1.0]);
        match self.whole(12) {
            0 => {
                let (stiffness, rest) = (torque.abs() * self.log(0.1, 10.0), self.between(-2.0, 2.0));
                DriveParams::Spring(SpringDrive { stiffness, rest })
            }
            1 => {
                let (stiffness, speed) = (torque.abs() * self.log(0.1, 10.0), self.between(-2.0, 2.0));
                let damping = if self.one_in(2) { 0.0 } else { torque.abs() * self.log(1e-3, 0.1) };
                DriveParams::Belt(BeltDrive { stiffness, damping, speed })
            }
            2 => {
                let times = [0.0, 0.21, 0.5, 0.83, 1.0].map(|share| share * seconds);
                let points = times.map(|t| (t, torque * self.between(-1.0, 2.0)));
                DriveParams::Table(TableDrive { points: Points(points.into()) })
            }
            3 => DriveParams::Ramp(RampDrive {
                from: 0.0,
                rate: 2.0 * torque / seconds * self.between(0.3, 1.0),
            }),
            4 => {
                let (amplitude, frequency) =
                    (torque.abs() * self.share(), (self.log(1.0, 30.0) / seconds).min(900.0));
                let phase_turns = self.between(-1.0, 1.0);
                DriveParams::Sine(SineDrive { mean: torque, amplitude, frequency, phase_turns })
            }
            5 => {
                let (amplitude, from) = (torque.abs() * self.share(), (1.0 / seconds).min(100.0));
                let (to, duration) = ((20.0 / seconds).min(900.0), 0.7 * seconds);
                DriveParams::Chirp(ChirpDrive { mean: torque, amplitude, from, to, duration })
            }
            6 => {
                let (rms, lowest_frequency) = (torque.abs() * self.log(0.01, 0.5), 0.1);
                DriveParams::Hand(HandDrive { mean: torque, rms, lowest_frequency, highest_frequency: 20.0 })
            }
            _ => {
                let (gravity, pulley_radius) = (9.81, 0.024);
                let mass = torque.abs() / (gravity * pulley_radius);
                let side = if torque < 0.0 { Side::Backwards } else { Side::Forwards };
                DriveParams::Weight(WeightDrive { mass, gravity, pulley_radius, side })
            }
        }
    }

    /// Friction along the disc: most are even.
    pub(crate) fn disc(&mut self) -> (Option<RippleParams>, Option<RunoutParams>) {
        let spacing = 1 + self.whole(40) as u32;
        let (lowest, highest) = (spacing, spacing * (1 + self.whole(10) as u32));
        let ripple = RippleParams { rms: self.log(1e-3, 0.08), lowest, highest, spacing };
        let runout =
            RunoutParams { amplitude: self.log(1e-3, 0.1), waves: 1 + self.whole(9) as u32, phase: 0.3 };
        (self.one_in(6).then_some(ripple), self.one_in(6).then_some(runout))
    }
}
