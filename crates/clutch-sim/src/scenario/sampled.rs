//! The sampled loop of a scenario, and the box of plants around it: what a sampled-data certificate speaks of.

use super::{Scenario, ScenarioBounds};
use crate::number;
use crate::rig::Rig;
use crate::ripple::Ripple;
use crate::run::Start;
use clutch_certificate::{Gains, Motor, Setup};
use clutch_core::friction::FrictionModel;
use clutch_core::law::{LawParams, SampledForm};
use clutch_core::params::Choice;
use clutch_core::reference::ReferenceParams;
use clutch_core::{ActuatorKind, Bounds, Dac, Interval, Plant, Tolerances, VelocityParams};

/// Torque noise of the rig is normal: a certificate covers this many times its root mean square.
pub const NOISE_ROOTS: f64 = 4.0;

/// Stribeck velocity of a friction that falls at once, rad/s.
pub(super) const AT_ONCE: f64 = 1e-6;

/// The sampled-data certificate does not cover such a scenario.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the sampled-data certificate does not cover {what} ({key}); it covers {covered}")]
pub struct NotCovered {
    /// The scenario's key.
    pub key: &'static str,
    /// Its value there.
    pub what: String,
    /// The values that are covered.
    pub covered: String,
}

fn not(key: &'static str, what: impl Into<String>, covered: impl Into<String>) -> NotCovered {
    NotCovered { key, what: what.into(), covered: covered.into() }
}

/// Gains, on a ramp forwards, of a law that has a sampled certificate of its own, within an output's limits, V; `motor` if it
/// drives one.
pub(super) fn gains(law: &LawParams, rate: f64, limits: [f64; 2], motor: bool) -> Option<Gains> {
    Some(match law.sampled()? {
        SampledForm::Linear { kp, ki, tracking_time, kd, bias, coulomb, velocity } => {
            let ahead = coulomb + velocity * rate;
            let forward = if motor { bias + ahead } else { bias - ahead };
            if ki > 0.0 {
                Gains::Integral { kp, ki, kd, forward, tracking: tracking_time, limits }
            } else {
                Gains::Linear { kp, kd, forward }
            }
        }
        SampledForm::Layer { .. } if motor => return None,
        SampledForm::Layer { kp, kd, slope, boundary } => Gains::Layer { kp, kd, slope, boundary },
    })
}

/// Laws that have a sampled certificate of their own, in words.
pub(super) fn sampled_laws(motor: bool) -> String {
    let all = LawParams::all();
    let covered = all.iter().filter(|law| gains(law, 0.0, [0.0; 2], motor).is_some());
    let words = covered.map(|law| format!("{} {}", law.title(), law.sampled_if()).trim_end().to_owned());
    words.collect::<Vec<_>>().join(", ")
}

/// Lowest voltage of a motor that surely turns no shaft of the box round, V: friction holds what motor and load push backwards, and a
/// converter may round half a step down, a law a ten-thousandth of a volt.
fn turns_below(s: &Setup) -> Option<f64> {
    let motor = s.motor.as_ref()?;
    let friction = s.at_rest[0].min(s.sliding[0]) * (1.0 - s.ripple) * motor.preload;
    let left = friction + s.drive_torque[0] - s.torque_noise;
    let holds = -left / if left > 0.0 { motor.gain[1] } else { motor.gain[0] };
    Some(holds + 0.5 * s.converter_step + 1e-4)
}

/// Refuses a motor that may turn a shaft of the box round.
fn goes_forwards(s: &Setup) -> Result<(), NotCovered> {
    match turns_below(s) {
        Some(limit) if s.volts[0].min(s.start_volts[0]) < limit => Err(not(
            "output.lowest_v",
            if limit < 0.0 {
                let from = (1e3 * limit).ceil() / 1e3;
                let volts = s.volts[0];
                format!(
                    "{volts} V at a motor, which may turn the shaft round: friction surely holds it from {from} V on"
                )
            } else {
                "a load that friction may not hold, so that any lowest voltage may turn the shaft round"
                    .to_owned()
            },
            "motors that go forwards alone",
        )),
        _ => Ok(()),
    }
}

/// Lower and upper end.
fn ends(i: &Interval) -> [f64; 2] {
    [i.low, i.high]
}

impl Scenario {
    /// The sampled loop around the rig as it is, its mean friction and nothing else, believed in exactly: the loop whose
    /// linear stability decides whether a motion along the path is smooth.
    ///
    /// # Errors
    /// As [`Scenario::sampled_setup`]. None for a sensor without steps, torque noise, and a bumpless start, which a
    /// linear loop knows nothing of, nor for a shell, within which the law stands.
    pub fn setup_as_it_is(&self) -> Result<Setup, NotCovered> {
        let mut own = self.clone();
        let p = &mut own.params;
        let plant = Rig::new(&p.rig, p.run.seed).map(|rig| *rig.model.plant.params());
        p.model = plant.map_err(|_| not("rig", "a rig out of range", "rigs that can be built"))?;
        (p.rig.ripple, p.rig.runout, p.rig.torque_noise) = (None, None, 0.0);
        p.bounds = ScenarioBounds::default();
        (p.rig.encoder.quantised, p.output.bumpless_time, p.shell.boundary) = (true, 0.0, 0.0);
        let bounds = Bounds::around(&p.model, &Tolerances::default())
            .map_err(|_| not("rig", "a rig out of range", "rigs that can be built"))?;
        own.sampled_setup(&bounds)
    }

    /// The sampled loop with every plant of the bounds: `[model]` within `[bounds]`, with encoder, converter, delay, ripple and
    /// torque noise of `[rig]`.
    ///
    /// # Errors
    /// A part of the scenario that the sampled-data certificate does not cover, by its key.
    pub fn sampled_setup(&self, bounds: &Bounds) -> Result<Setup, NotCovered> {
        let setup = self.setup_either_way(bounds)?;
        goes_forwards(&setup)?;
        Ok(setup)
    }

    /// Lowest voltage of a motor that turns no shaft of the bounds round on a ramp forwards, V; none of a brake, and where the
    /// sampled-data certificate covers no such axis whatever its output is.
    #[must_use]
    pub fn lowest_forwards(&self, bounds: &Bounds) -> Option<f64> {
        turns_below(&self.setup_either_way(bounds).ok()?)
    }

    /// [`Scenario::sampled_setup`], also of a motor that may turn the shaft round.
    fn setup_either_way(&self, bounds: &Bounds) -> Result<Setup, NotCovered> {
        let p = &self.params;
        let (smoothing, rate) = self.smoothing_and_rate()?;
        let (plant, stribeck) = self.shaft_of_the_loop(bounds)?;
        let motor = self.motor_of_the_loop(bounds)?;
        let law = self.law_of_the_loop(motor.is_some())?;
        self.check_sensor_and_delay()?;
        let rig = Rig::new(&p.rig, p.run.seed)
            .map_err(|_| not("rig", "a rig out of range", "rigs that can be built"))?;
        let torque_noise = self.torque_noise(bounds)?;
        let swing = rig.model.ripple.as_ref().map_or(0.0, Ripple::largest);
        let (_, ripple) = p.bounds.friction_shares(swing);
        let friction = plant.friction();
        Ok(Setup {
            period_s: p.sampling.sampling.period.seconds(),
            counts_per_rev: p.rig.encoder.sensor.counts_per_rev,
            inertia: ends(&bounds.inertia),
            drive_torque: ends(&bounds.drive_torque),
            viscous_damping: ends(&bounds.viscous_damping),
            brake_gain: ends(&bounds.brake_gain),
            motor,
            sliding: ends(&p.bounds.mean_of(&bounds.friction_sliding)),
            at_rest: ends(&p.bounds.mean_of(&bounds.friction_at_rest)),
            rest_not_below_sliding: friction.at_rest() >= friction.sliding(),
            stribeck,
            ripple,
            torque_noise,
            delay_ticks: p.rig.delay_ticks,
            converter_step: if p.rig.dac.quantised { rig.dac.step() } else { 0.0 },
            volts: self.volts_given(&rig.dac),
            rate,
            smoothing,
            law,
            from_rest: p.run.start == Start::Rest,
            start_volts: self.start_volts(bounds, rate, ripple),
        })
    }

    /// The gains of the law, or the shell within which it stands.
    fn law_of_the_loop(&self, motor: bool) -> Result<Gains, NotCovered> {
        let (law, shell) = (&self.params.law, self.params.shell);
        if shell.boundary > 0.0 {
            return Ok(Gains::Shell { slope: shell.slope, boundary: shell.boundary });
        }
        // Other paths are refused, whatever the law gives on them.
        let rate = if let ReferenceParams::Ramp(ramp) = self.params.reference { ramp.rate } else { 0.0 };
        let limits = self.limits();
        let covered = || {
            let with = if motor { ", with a motor" } else { "" };
            format!("{}, and any law in a [shell]{with}", sampled_laws(motor))
        };
        let gains = gains(law, rate, limits, motor).ok_or_else(|| not("law", law.title(), covered()))?;
        // The law takes back what a limit cuts off such a voltage.
        match gains {
            Gains::Linear { forward, .. } | Gains::Integral { forward, .. }
                if !(limits[0]..=limits[1]).contains(&forward) =>
            {
                let what = format!("a law's {} V without an error, beyond the limits", number(forward));
                Err(not("output", what, "a voltage within them"))
            }
            gains => Ok(gains),
        }
    }

    /// Lowest and highest voltage that the law may ask for, V.
    pub(super) fn limits(&self) -> [f64; 2] {
        [self.params.output.lowest, self.params.output.highest]
    }

    /// Smoothing of the difference (5), and rate of the ramp, rad/s.
    fn smoothing_and_rate(&self) -> Result<(f64, f64), NotCovered> {
        let p = &self.params;
        let VelocityParams::SmoothedDerivative(filter) = p.velocity else {
            let source = Choice::<f64>::name(&p.velocity);
            return Err(not("velocity", source, "smoothed_derivative, the difference (5)"));
        };
        let ReferenceParams::Ramp(ramp) = p.reference else {
            return Err(not("reference", "a path that is no ramp", "ramps"));
        };
        if ramp.rate <= 0.0 {
            return Err(not("reference.ramp.rate_deg_s", "a path that rests", "ramps forwards"));
        }
        Ok((filter.smoothing, ramp.rate))
    }

    /// The believed shaft, and velocity (rad/s) and exponent of Stribeck's with which its friction falls.
    fn shaft_of_the_loop(&self, bounds: &Bounds) -> Result<(Plant<f64>, [f64; 2]), NotCovered> {
        if bounds.actuator == ActuatorKind::Both {
            return Err(not("model.actuator", "a brake and a motor on one signal", "brakes and motors"));
        }
        if bounds.actuator == ActuatorKind::Brake && bounds.preload > 0.0 {
            return Err(not(
                "model.actuator.brake.preload_nm",
                "a disc that drags",
                "brakes without preload",
            ));
        }
        let plant = Plant::new(&self.params.model)
            .map_err(|_| not("model", "a plant out of range", "plants that can be built"))?;
        let Some(fall) = plant.friction().falls() else {
            return Err(not("model.friction", "bristles", "Stribeck's and Coulomb's friction"));
        };
        let velocity = if fall.velocity > 0.0 { fall.velocity } else { AT_ONCE };
        Ok((plant, [velocity, fall.exponent]))
    }

    /// The motor, of an axis that has one.
    fn motor_of_the_loop(&self, bounds: &Bounds) -> Result<Option<Motor>, NotCovered> {
        if bounds.actuator != ActuatorKind::Motor {
            return Ok(None);
        }
        if bounds.load_share > 0.0 {
            return Err(not(
                "model.actuator.motor.load_share",
                "friction that grows with the motor's torque",
                "motors without load_share",
            ));
        }
        Ok(Some(Motor { gain: ends(&bounds.motor_gain), preload: bounds.preload }))
    }

    /// Refuses a lag, a sensor without steps, a bumpless start and a long delay.
    fn check_sensor_and_delay(&self) -> Result<(), NotCovered> {
        let p = &self.params;
        if p.rig.actuator_time_constant.is_some() {
            return Err(not(
                "rig.actuator_time_constant_s",
                "a lag of the actuator",
                "actuators without lag",
            ));
        }
        if !p.rig.encoder.quantised {
            return Err(not("rig.encoder.quantised", "an ideal sensor", "encoders that give whole counts"));
        }
        // A shell asks nothing of the law's beginning.
        if p.output.bumpless_time > 0.0 && p.shell.boundary <= 0.0 {
            return Err(not(
                "output.bumpless_time_s",
                "a bumpless start",
                "starts with the law's own voltage",
            ));
        }
        if p.rig.delay_ticks > 3 {
            return Err(not(
                "rig.delay_ticks",
                format!("{} ticks of delay", p.rig.delay_ticks),
                "up to 3 ticks of delay",
            ));
        }
        Ok(())
    }

    /// Largest torque of the noise, N m.
    fn torque_noise(&self, bounds: &Bounds) -> Result<f64, NotCovered> {
        let noise = NOISE_ROOTS * self.params.rig.torque_noise;
        if bounds.actuator == ActuatorKind::Brake && noise >= bounds.drive_torque.low {
            return Err(not(
                "rig.torque_noise_nm",
                format!(
                    "a torque noise that turns the drive round ({NOISE_ROOTS} times its root mean square)"
                ),
                "noise below the weakest drive",
            ));
        }
        Ok(noise)
    }

    /// Lowest and highest voltage that output and converter give, V.
    fn volts_given(&self, dac: &Dac<f64>) -> [f64; 2] {
        let p = &self.params;
        // A converter that rounds nothing gives all that it is asked for.
        let (bottom, top) = if p.rig.dac.quantised {
            (dac.volts(dac.code(f64::MIN)), dac.volts(dac.code(f64::MAX)))
        } else {
            (f64::NEG_INFINITY, f64::INFINITY)
        };
        [p.output.lowest.max(bottom), p.output.highest.min(top)]
    }

    /// Voltages between which that of brake or motor is before the first tick, at a rate (rad/s) and with so much ripple, V: as
    /// [`Rig::resting_voltage`] and [`Rig::sliding_voltage`], for each plant of the box.
    fn start_volts(&self, bounds: &Bounds, rate: f64, ripple: f64) -> [f64; 2] {
        let p = &self.params;
        if bounds.actuator == ActuatorKind::Motor {
            let [weak, strong] = ends(&bounds.motor_gain);
            // From rest the motor carries the load alone.
            let friction = if p.run.start == Start::Rest {
                [0.0; 2]
            } else {
                let drag = bounds.viscous_damping.high * rate;
                [bounds.friction.low * bounds.preload, bounds.friction.high * bounds.preload + drag]
            };
            let (low, high) = (friction[0] - bounds.drive_torque.high, friction[1] - bounds.drive_torque.low);
            let converter = p.rig.dac.converter;
            let reached = |volts: f64| volts.clamp(converter.lowest, converter.highest);
            let least = low / if low > 0.0 { strong } else { weak };
            let most = high / if high > 0.0 { weak } else { strong };
            return [reached(least), reached(most)];
        }
        // Before the first tick the brake has what the rig gives it, beyond the output's limits, too.
        let reached = p.rig.dac.converter.highest;
        let (torque, gain) = (ends(&bounds.drive_torque), ends(&bounds.brake_gain));
        let drag = bounds.viscous_damping.high * rate;
        let least = (torque[0] - drag).max(0.0) / (bounds.friction.high * gain[1]);
        let most = torque[1] / (bounds.friction.low * gain[0]);
        let most = if p.run.start == Start::Rest { 1.25 * most / (1.0 - ripple) } else { most };
        [least.min(reached), most.min(reached)]
    }
}
