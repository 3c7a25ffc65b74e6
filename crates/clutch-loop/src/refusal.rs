//! The reason of a board that refuses, in words.

use clutch_node::{Refusing, Settings};
use clutch_wire::{Refusal, Refused};

/// The board's reason in words; `settings` are those that it was sent, if any.
#[must_use]
pub(crate) fn why(m: &Refused, settings: Option<&Settings>) -> String {
    match Refusal::from_u8(m.reason) {
        Some(Refusal::State) => {
            "another controller drives it now; stop that one first (a board whose controller has died is free after its watchdog's time)".into()
        }
        Some(Refusal::Run) => "the number of the run is spent; start again".into(),
        Some(Refusal::Config) => format!("it has another configuration (its hash ends with {:08x})", m.value),
        Some(Refusal::Period) => format!("it cannot sample each {} µs", m.value),
        Some(Refusal::Watchdog) => format!("its watchdog cannot be set to {} µs", m.value),
        Some(Refusal::Safe) => "it does not know the safe state, or its converter has no such code".into(),
        Some(Refusal::Boot) => "it was reset since it said who it is; start again".into(),
        Some(Refusal::Busy) => "it is busy".into(),
        Some(reason @ (Refusal::Setting | Refusal::Unfit)) => match settings {
            Some(settings) => {
                Refusing { settings, bits: m.value, lacks: reason == Refusal::Setting }.to_string()
            }
            None => format!("it refuses the setting {:#06x}", m.value & 0xffff),
        },
        Some(Refusal::NoBoard) => "it finds no encoder and converter".into(),
        Some(Refusal::Differs) => "its settings say something else than the run; start again".into(),
        _ => format!("reason {}, value {}", m.reason, m.value),
    }
}
