//! Gains of a session that are changed while it runs: each change is checked and certified before it comes into force.
//!
//! A change is made beside the control thread, as a servo that takes over with the state that the old one has left. It has
//! to be of the law that runs and to change nothing else, above all nothing that the supervisor watches. The error of
//! the sampled loop with the new gains has to have a proven bound; that is a bound of a run with these gains from its
//! start. The change-over itself is covered by no certificate: the supervisor watches it as it watches everything.

use crate::from_scenario::BuiltRun;
use crate::live_gains::{Change, Changes, Gain, LiveGains, Refusal, with};
use clutch_core::law::LawParams;
use clutch_core::params::{Choice, Kind};
use clutch_core::{Real, Servo, Supervisor};
use clutch_sim::scenario::Value;
use clutch_sim::scenario::describe::{Entry, description, entries};
use clutch_sim::{Scenario, number};
use std::fmt;
use std::sync::{Mutex, PoisonError, TryLockError};

/// Changes that may wait for the control thread.
const WAITING: usize = 16;

/// The gains of a run in the scalar `T`.
pub(crate) struct Tuning<T: Real> {
    state: Mutex<State<T>>,
    /// True if gains without a certificate may run.
    uncertified: bool,
}

struct State<T: Real> {
    /// The scenario as it is now.
    scenario: Scenario,
    supervisor: Supervisor<T>,
    ring: rtrb::Producer<Change<Servo<T>>>,
}

impl<T: Real> fmt::Debug for Tuning<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tuning").field("uncertified", &self.uncertified).finish_non_exhaustive()
    }
}

impl<T: Real> Tuning<T> {
    /// The tuning of a run that is built, and the end for its control thread.
    pub(crate) fn new(
        scenario: &Scenario,
        built: &BuiltRun<T>,
        uncertified: bool,
    ) -> (Self, Changes<Servo<T>>) {
        let (ring, changes) = rtrb::RingBuffer::new(WAITING);
        let state = State { scenario: scenario.clone(), supervisor: built.supervisor, ring };
        (Tuning { state: Mutex::new(state), uncertified }, changes)
    }
}

/// The gains of a scenario's law: real numbers that stand in its own table.
fn gains(scenario: &Scenario) -> Vec<Gain> {
    let law = &scenario.params().law;
    let choice = <LawParams<f64> as Choice<f64>>::CHOICE;
    let name = Choice::<f64>::name(law);
    let Some(option) = choice.options.get(Choice::<f64>::chosen(law)) else { return Vec::new() };
    let values = scenario.table().get("law").and_then(|t| t.get(name));
    let value = |key: &str| match values?.get(key)? {
        Value::Float(x) => Some(*x),
        Value::Integer(x) => Some(*x as f64),
        _ => None,
    };
    let gain = |entry| match entry {
        Entry::Row(row, table) if row.kind == Kind::Real => {
            let (key, meaning) = (format!("law.{name}.{}", row.key), description(row, table));
            value(row.key).map(|value| Gain { key, value, meaning })
        }
        _ => None,
    };
    entries(option.table).into_iter().filter_map(gain).collect()
}

/// The number of a key in a scenario's list of parameters.
fn number_of(scenario: &Scenario, key: &str) -> Option<u16> {
    let place = scenario.parameters().iter().position(|(k, _)| k == key)?;
    u16::try_from(place).ok()
}

impl<T: Real> LiveGains for Tuning<T> {
    fn gains(&self) -> Vec<Gain> {
        gains(&self.state.lock().unwrap_or_else(PoisonError::into_inner).scenario)
    }

    fn change(&self, key: &str, value: f64) -> Result<String, Refusal> {
        let mut state = match self.state.try_lock() {
            Ok(state) => state,
            Err(TryLockError::Poisoned(state)) => state.into_inner(),
            Err(TryLockError::WouldBlock) => {
                return Err(Refusal(
                    "another change is being certified; try again when its answer is there".to_owned(),
                ));
            }
        };
        if state.ring.is_abandoned() {
            return Err(Refusal("the run is over".to_owned()));
        }
        let known = gains(&state.scenario);
        if !known.iter().any(|gain| gain.key == key) {
            let keys: Vec<&str> = known.iter().map(|gain| gain.key.as_str()).collect();
            return Err(Refusal(format!("{key}: expected a gain of the law that runs: {}", keys.join(", "))));
        }
        let changed = with(&state.scenario, key, value).map_err(|e| Refusal(e.to_string()))?;
        let plan = changed.plan().map_err(|e| Refusal(e.to_string()))?;
        let sampled = changed.sampled(&plan.bounds);
        let proven = match sampled.prove() {
            Ok((proven, _)) if sampled.bound_suffices() => Ok(proven.checked.error_bound),
            Ok(_) => Err("the bound of the error holds, but linear stability is not known".to_owned()),
            Err(why) => Err(why.to_string()),
        };
        let verdict = match &proven {
            Ok(bound) => format!("certified as sampled: |e| stays below {} °", number(bound.to_degrees())),
            Err(why) if self.uncertified => format!("UNCERTIFIED, as asked: {why}"),
            Err(why) => return Err(Refusal(format!("{key} = {value}: not certified as sampled: {why}"))),
        };
        let built = BuiltRun::<T>::new(&changed, 0).map_err(|e| Refusal(e.to_string()))?;
        if built.supervisor != state.supervisor {
            return Err(Refusal(format!(
                "{key} = {value}: changes what the supervisor watches; end the run first"
            )));
        }
        let parameter = number_of(&changed, key)
            .ok_or_else(|| Refusal(format!("{key}: expected a key of the scenario's list of parameters")))?;
        let change = Change { servo: built.servo, parameter, value, error_bound: proven.ok() };
        state
            .ring
            .push(change)
            .map_err(|_| Refusal("the loop has not taken the last changes yet".to_owned()))?;
        state.scenario = changed;
        Ok(verdict)
    }
}
