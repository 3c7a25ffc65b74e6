//! Laws that are tried, and the gains of each candidate.

use clutch_core::Plant;
use clutch_core::law::LawParams;
use clutch_core::params::Choice;
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
    /// Voltage that holds the believed shaft while it slides, V.
    Holding,
}

/// A gain, and between which ends it is drawn, evenly in ratio.
struct Gain {
    key: &'static str,
    low: f64,
    high: f64,
    /// Its unit has volts: both ends count in voltages that hold the sliding shaft.
    volts: bool,
}

const fn plain(key: &'static str, low: f64, high: f64) -> Gain {
    Gain { key, low, high, volts: false }
}

const fn volts(key: &'static str, low: f64, high: f64) -> Gain {
    Gain { key, low, high, volts: true }
}

/// A law that is told nothing.
const fn family(key: &'static str, name: &'static str, gains: &'static [Gain]) -> Family {
    Family { key, name, gains, told: &[] }
}

/// Key of the smoothing of (5).
pub(crate) const SMOOTHING: &str = "velocity.smoothed_derivative.smoothing";
const SMOOTHED: Gain = plain(SMOOTHING, 0.2, 1.0);

/// Every law that is tried. Ends were chosen so that the sets of docs/smooth.md and docs/certified.md lie within.
pub(crate) const FAMILIES: [Family; 5] = [
    Family {
        key: "glide",
        name: "glide",
        gains: &[plain("law.glide.kp_1_s", 20.0, 60.0), plain("law.glide.kd_1_s", 80.0, 220.0)],
        told: &[
            ("law.glide.filter.ripple_share", Told::Ripple),
            ("law.glide.filter.lag_s", Told::Lag),
            ("law.glide.filter.delay_ticks", Told::Delay),
        ],
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
        told: &[("law.pid.bias_v", Told::Holding)],
    },
    family(
        "pd",
        "PD",
        &[volts("law.pd.kp_v_rad", 150.0, 2500.0), volts("law.pd.kd_v_s_rad", 1.5, 24.0), SMOOTHED],
    ),
    family(
        "smc",
        "SMC (31)",
        &[
            volts("law.smc.kp_v", 1.2, 3.0),
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

impl Told {
    /// Its value, as a key takes it; none where the rig has nothing to be told.
    fn value(self, base: &Scenario) -> Option<Value> {
        let rig = &base.params().rig;
        Some(match self {
            Told::Ripple => Value::Float(rig.ripple.as_ref().map_or(0.03, |ripple| ripple.rms.max(0.03))),
            Told::Lag => Value::Float(rig.actuator_time_constant?),
            Told::Delay => Value::Integer(rig.delay_ticks.min(3).into()),
            Told::Holding => Value::Float(holding(base)),
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

    /// Gains of candidate `n`; with `hold` the voltage that holds the sliding shaft, V. Candidate 0 has the scenario's own,
    /// where the law is the scenario's, else the law's defaults.
    pub(crate) fn gains(&self, n: u32, hold: f64) -> Gains {
        if n == 0 {
            return Vec::new();
        }
        let drawn = |(gain, base): (&Gain, &u32)| {
            let unit = if gain.volts { hold } else { 1.0 };
            let value = unit * gain.low * (gain.high / gain.low).powf(van_der_corput(n, *base));
            // Four digits: what is typed again is what was run.
            (gain.key.to_owned(), format!("{value:.3e}").parse().unwrap_or(value))
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

/// The voltage that holds the believed shaft while it slides, V.
pub(crate) fn holding(scenario: &Scenario) -> f64 {
    Plant::new(&scenario.spec().model).map_or(1.0, |plant| plant.holding_voltage_sliding())
}

/// The family of a scenario's law, if it is one of those that are tried.
pub(crate) fn family_of(law: &LawParams) -> Option<&'static Family> {
    FAMILIES.iter().find(|family| family.key == Choice::<f64>::name(law))
}
