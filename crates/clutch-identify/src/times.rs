//! Delay and lag as they were found, beside those that a scenario has of its rig and that its law believes.

use crate::RigFile;
use clutch_core::VelocityParams;
use clutch_core::params::Choice as _;
use clutch_sim::{Scenario, ScenarioError};

/// A key of a scenario whose value is not what was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Other {
    /// The key.
    pub key: String,
    /// Its value.
    pub value: String,
    /// What was found.
    pub expected: String,
}

impl Other {
    /// The refusal of a scenario of that name.
    #[must_use]
    pub fn refusal(&self, origin: &str) -> ScenarioError {
        ScenarioError::value(origin, &self.key, &self.value, &self.expected)
    }
}

impl RigFile {
    /// Keys of `[rig]` by which certificates reckon with another delay or lag than was found.
    #[must_use]
    pub fn other_times(&self, scenario: &Scenario) -> Vec<Other> {
        let rig = scenario.spec().rig;
        self.beside(scenario, "rig.", rig.delay_ticks, "actuator_time_constant_s", rig.actuator_time_constant)
    }

    /// The same of the filter that believes in a delay and a lag, if the scenario has one.
    #[must_use]
    pub fn otherwise_believed(&self, scenario: &Scenario) -> Vec<Other> {
        let spec = scenario.spec();
        let of_law = spec.law.filter().map(|filter| (format!("law.{}.filter.", spec.law.name()), *filter));
        let of_velocity = match spec.velocity {
            VelocityParams::EdgeTimed(filter) => Some(("velocity.edge_timed.".to_owned(), filter)),
            _ => None,
        };
        let filter = of_law.or(of_velocity);
        filter.map_or_else(Vec::new, |(keys, filter)| {
            let lag = Some(filter.lag).filter(|lag| *lag > 0.0);
            self.beside(scenario, &keys, filter.delay, "lag_s", lag)
        })
    }

    fn beside(
        &self,
        scenario: &Scenario,
        keys: &str,
        ticks: u32,
        lag_key: &str,
        lag: Option<f64>,
    ) -> Vec<Other> {
        let mut others = Vec::new();
        let found = self.lag.filter(|lag| lag.low > 0.0);
        if let Some(found) = found.filter(|found| !found.holds(lag.unwrap_or(0.0))) {
            others.push(Other {
                key: keys.to_owned() + lag_key,
                value: lag.map_or_else(|| "none".to_owned(), |lag| lag.to_string()),
                expected: format!(
                    "{:.6}: the rig file has a lag of {:.2} to {:.2} ms",
                    found.value,
                    1e3 * found.low,
                    1e3 * found.high
                ),
            });
        }
        let period: f64 = scenario.spec().period.seconds();
        let delay = self.delay.map(|delay| delay.less(found.map_or(0.0, |lag| lag.value)));
        if let Some(delay) = delay.filter(|delay| !delay.holds(f64::from(ticks) * period)) {
            let nearest = (delay.value / period).round();
            let found = format!("{:.2} to {:.2} ms", 1e3 * delay.low, 1e3 * delay.high);
            others.push(Other {
                key: format!("{keys}delay_ticks"),
                value: ticks.to_string(),
                expected: if delay.holds(nearest * period) {
                    format!("{nearest}: the rig file has a delay of {found}")
                } else {
                    format!("the delay of {found} in the rig file, which is no whole number of periods")
                },
            });
        }
        others
    }
}
