//! Laws that are tried, and the gains of each candidate.

use crate::proof::typed;
use clutch_core::edge_timed::{EdgeTimedParams, waves_seen};
use clutch_core::friction::FrictionModel as _;
use clutch_core::law::{GlideParams, LawParams};
use clutch_core::params::Choice;
use clutch_core::{ActuatorKind, Plant};
use clutch_sim::ripple::RippleParams;
use clutch_sim::scenario::{Table, Value};
use clutch_sim::{Scenario, ScenarioError};

/// A law with the gains that are varied.
pub(crate) struct Family {
    /// Key of the law, as `pd`.
    pub(crate) key: &'static str,
    /// Name for readers.
    pub(crate) name: &'static str,
    gains: &'static [Gain],
    /// Keys of the law for what is known of the rig.
    told: &'static [(&'static str, Told)],
    /// Tried along paths that may rest and turn round alone.
    pub(crate) for_turns: bool,
}

/// Something known of the rig that a law is told.
#[derive(Clone, Copy)]
enum Told {
    /// Friction along the disc: the root mean square of its ripple, as a share.
    Ripple,
    /// Time constant of the actuator, where it has one, s.
    Lag,
    /// Periods from a sample to its voltage.
    Delay,
    /// Voltage that holds the believed shaft while it slides, V; of a motor, that balances its load.
    Holding,
    /// Voltage of a motor against the friction of a sliding shaft, V.
    Friction,
    /// Voltage over velocity against the damping, V s/rad.
    Damping,
    /// Voltage over acceleration for the inertia, V s²/rad.
    Inertia,
    /// Rate below which micro-steps are taken, °/s, if the lag lets them.
    Steps,
    /// Waves of the ripple at the middle of its band, or the most that the encoder sees, where they are not near the default's.
    Waves,
}

/// Unit of a gain's ends.
#[derive(Clone, Copy)]
enum Unit {
    /// As the key has it.
    Own,
    /// [`Volts::motion`].
    Motion,
    /// [`Volts::friction`].
    Friction,
}

/// A gain, and between which ends it is drawn, evenly in ratio.
struct Gain {
    key: &'static str,
    low: f64,
    high: f64,
    unit: Unit,
}

const fn plain(key: &'static str, low: f64, high: f64) -> Gain {
    Gain { key, low, high, unit: Unit::Own }
}

const fn volts(key: &'static str, low: f64, high: f64) -> Gain {
    Gain { key, low, high, unit: Unit::Motion }
}

/// A law that is told nothing.
const fn family(key: &'static str, name: &'static str, gains: &'static [Gain]) -> Family {
    Family { key, name, gains, told: &[], for_turns: false }
}

/// Acceleration of the paper's shaft without a brake, rad/s²: ends of gains in volts were chosen on it.
const PAPER_PULL: f64 = 27.7;

/// Voltages by which gains with volts in their unit are measured, V.
pub(crate) struct Volts {
    /// The voltage that holds the sliding shaft; of a motor the one that accelerates it with 27.7 rad/s².
    motion: f64,
    /// The same of a brake; of a motor the one that friction at rest takes.
    pub(crate) friction: f64,
}

impl Volts {
    /// Those of the believed shaft.
    pub(crate) fn of(scenario: &Scenario) -> Volts {
        let plain = Volts { motion: 1.0, friction: 1.0 };
        let model = scenario.spec().model;
        let Ok(plant) = Plant::new(&model) else { return plain };
        let actuator = plant.actuator();
        if actuator.kind() == ActuatorKind::Motor {
            let volts = |torque: f64| torque / actuator.motor_gain();
            let at_rest = volts(plant.friction().at_rest() * actuator.preload());
            return Volts {
                motion: volts(PAPER_PULL * model.inertia),
                // A motor without friction has nothing to break away from.
                friction: if at_rest > 0.0 { at_rest } else { 1.0 },
            };
        }
        let hold = plant.holding_voltage_sliding();
        Volts { motion: hold, friction: hold }
    }

    fn in_unit(&self, unit: Unit) -> f64 {
        match unit {
            Unit::Own => 1.0,
            Unit::Motion => self.motion,
            Unit::Friction => self.friction,
        }
    }
}

const GLIDE_GAINS: &[Gain] = &[plain("law.glide.kp_1_s", 20.0, 60.0), plain("law.glide.kd_1_s", 80.0, 220.0)];
const RIPPLE: (&str, Told) = ("law.glide.filter.ripple_share", Told::Ripple);
const LAG: (&str, Told) = ("law.glide.filter.lag_s", Told::Lag);
const DELAY: (&str, Told) = ("law.glide.filter.delay_ticks", Told::Delay);
const WAVES: (&str, Told) = ("law.glide.filter.ripple_waves_per_turn", Told::Waves);

/// Key of the smoothing of (5).
pub(crate) const SMOOTHING: &str = "velocity.smoothed_derivative.smoothing";
const SMOOTHED: Gain = plain(SMOOTHING, 0.2, 1.0);

/// Every law that is tried. Ends were chosen so that the sets of docs/smooth.md and docs/certified.md lie within.
pub(crate) const FAMILIES: [Family; 7] = [
    Family {
        key: "glide",
        name: "glide",
        gains: GLIDE_GAINS,
        told: &[RIPPLE, LAG, DELAY, WAVES],
        for_turns: false,
    },
    Family {
        key: "glide",
        name: "glide with micro-steps",
        gains: GLIDE_GAINS,
        told: &[RIPPLE, LAG, DELAY, WAVES, ("law.glide.micro_below_deg_s", Told::Steps)],
        for_turns: true,
    },
    Family {
        key: "pid",
        name: "PI with feed-forward",
        gains: &[
            volts("law.pid.kp_v_rad", 150.0, 1600.0),
            volts("law.pid.ki_v_rad_s", 1000.0, 16_000.0),
            volts("law.pid.kd_v_s_rad", 1.5, 16.0),
            SMOOTHED,
        ],
        told: &[
            ("law.pid.bias_v", Told::Holding),
            ("law.pid.coulomb_v", Told::Friction),
            ("law.pid.velocity_v_s_rad", Told::Damping),
            ("law.pid.acceleration_v_s2_rad", Told::Inertia),
        ],
        for_turns: false,
    },
    family(
        "dob",
        "DOB",
        &[
            plain("law.dob.kp_1_s2", 3000.0, 16_000.0),
            plain("law.dob.kd_1_s", 80.0, 500.0),
            plain("law.dob.bandwidth_rad_s", 25.0, 200.0),
            SMOOTHED,
        ],
    ),
    family(
        "pd",
        "PD",
        &[volts("law.pd.kp_v_rad", 150.0, 2500.0), volts("law.pd.kd_v_s_rad", 1.5, 24.0), SMOOTHED],
    ),
    family(
        "smc",
        "SMC (31)",
        &[
            Gain { key: "law.smc.kp_v", low: 1.2, high: 3.0, unit: Unit::Friction },
            volts("law.smc.kd_v_s_rad", 2.0, 180.0),
            plain("law.smc.slope_1_s", 30.0, 120.0),
            plain("law.smc.boundary_rad_s", 0.05, 0.4),
            SMOOTHED,
        ],
    ),
    family(
        "ctc",
        "CTC",
        &[plain("law.ctc.kp_1_s2", 20.0, 400.0), plain("law.ctc.kd_1_s", 0.2, 3.0), SMOOTHED],
    ),
];

/// Element `n` of the van der Corput sequence in a base: evenly spread between 0 and 1, whatever the number.
fn van_der_corput(mut n: u32, base: u32) -> f64 {
    let (mut x, mut share) = (0.0, 1.0);
    while n > 0 {
        share /= f64::from(base);
        x += share * f64::from(n % base);
        n /= base;
    }
    x
}

/// Bases of the sequence, one for each gain.
const BASES: [u32; 5] = [2, 3, 5, 7, 11];

/// The gains of a candidate, by their keys.
pub(crate) type Gains = Vec<(String, f64)>;

/// Rate below which a shaft does not slide under an encoder of 20 000 counts, °/s: docs/smooth.md.
const STEPS_BELOW: f64 = 0.95;

/// Waves over those of glide's default that it does as well with untold.
const NEAR: core::ops::RangeInclusive<f64> = 0.5..=2.0;

impl Told {
    /// A feed-forward of the believed shaft, as the law PID documents it; none that it has no key for.
    fn volts(self, plant: &Plant<f64>) -> Option<f64> {
        let (actuator, model) = (plant.actuator(), plant.params());
        let motor = actuator.kind() == ActuatorKind::Motor;
        let sliding = plant.friction().sliding();
        let per_torque = if motor { actuator.motor_gain() } else { sliding * actuator.brake_gain() };
        match self {
            Told::Holding => Some(plant.holding_voltage_sliding()),
            Told::Friction => motor.then(|| sliding * actuator.preload() / per_torque),
            Told::Damping => Some(model.viscous_damping / per_torque),
            Told::Inertia => Some(model.inertia / per_torque),
            Told::Ripple | Told::Lag | Told::Delay | Told::Steps | Told::Waves => None,
        }
    }

    /// Its value, as a key takes it; none where the rig has nothing to be told.
    fn value(self, base: &Scenario) -> Option<Value> {
        let rig = &base.params().rig;
        Some(match self {
            Told::Ripple => Value::Float(rig.ripple.as_ref().map_or(0.03, |ripple| ripple.rms.max(0.03))),
            Told::Lag => Value::Float(rig.actuator_time_constant?),
            Told::Waves => {
                let unseen = EdgeTimedParams::<f64>::default().waves;
                let middle = |r: &RippleParams| 0.5 * (f64::from(r.lowest) + f64::from(r.highest));
                let waves = rig.ripple.as_ref().map(middle).filter(|waves| !NEAR.contains(&(waves / unseen)));
                let waves = waves_seen(waves.unwrap_or(unseen), rig.encoder.sensor.counts_per_rev);
                (waves != unseen).then_some(Value::Float(waves))?
            }
            Told::Delay => Value::Integer(rig.delay_ticks.min(3).into()),
            Told::Steps
                if rig
                    .actuator_time_constant
                    .is_some_and(|lag| lag > GlideParams::<f64>::MOST_LAG_OF_STEPS) =>
            {
                return None;
            }
            Told::Steps => {
                Value::Float(STEPS_BELOW * 20_000.0 / f64::from(rig.encoder.sensor.counts_per_rev))
            }
            Told::Holding | Told::Friction | Told::Damping | Told::Inertia => {
                Value::Float(self.volts(&Plant::new(&base.spec().model).ok()?)?)
            }
        })
    }
}

impl Family {
    /// The law with its defaults.
    fn law(&self) -> Option<LawParams> {
        LawParams::named(self.key)
    }

    /// True if it has a sampled certificate of its own, without a shell.
    pub(crate) fn certified_alone(&self) -> bool {
        self.law().is_some_and(|law| law.sampled().is_some())
    }

    /// Gains of candidate `n`, in these volts. Candidate 0 has the scenario's own, where the law is the scenario's, else the
    /// law's defaults.
    pub(crate) fn gains(&self, n: u32, volts: &Volts) -> Gains {
        if n == 0 {
            return Vec::new();
        }
        let drawn = |(gain, base): (&Gain, &u32)| {
            let value =
                volts.in_unit(gain.unit) * gain.low * (gain.high / gain.low).powf(van_der_corput(n, *base));
            (gain.key.to_owned(), typed(value))
        };
        self.gains.iter().zip(&BASES).map(drawn).collect()
    }

    /// The scenario with this law and these gains. The law's share of an identification goes with it.
    pub(crate) fn scenario(&self, base: &Scenario, gains: &Gains) -> Result<Scenario, ScenarioError> {
        let mut table = base.table().clone();
        let own = Choice::<f64>::name(&base.params().law) == self.key;
        if !own {
            let empty = Table::from_iter([(self.key.to_owned(), Value::Table(Table::new()))]);
            table.insert("law".to_owned(), Value::Table(empty));
            table.remove("velocity");
        }
        table.remove("shell");
        let told = self.told.iter().filter_map(|(key, told)| Some(((*key).to_owned(), told.value(base)?)));
        let mut set: Vec<(String, Value)> = told.collect();
        let filters = self.law().is_some_and(|law| law.filter().is_some());
        if !filters {
            set.push(("output.bumpless_time_s".to_owned(), Value::Float(0.0)));
        }
        set.extend(gains.iter().map(|(key, value)| (key.clone(), Value::Float(*value))));
        if filters || !gains.is_empty() {
            table.remove("velocity");
        }
        Scenario::from_table(base.name(), table, &set)
    }
}

/// The family of a scenario's law, if it is one of those that are tried.
pub(crate) fn family_of(law: &LawParams) -> Option<&'static Family> {
    FAMILIES.iter().find(|family| family.key == Choice::<f64>::name(law))
}
