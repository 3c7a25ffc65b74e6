//! Words for the refusals of a board, and for the causes that end control.

use clutch_core::supervisor::Cause;
use clutch_settings::{Refusing, Settings};
use clutch_sim::number;
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

/// The cause of the end of control, in words; `v` is what the check saw, `stopped` is true if somebody here has
/// stopped it.
#[must_use]
pub fn cause_text(cause: Cause, v: f64, on_the_board: bool, stopped: bool) -> String {
    let envelope =
        |what: &str| format!("{what} ({} ° outside of what a shaft can do)", number(v.to_degrees()));
    match cause {
        Cause::Done => "the path is done".into(),
        Cause::Operator if on_the_board && !stopped => {
            "the board has not heard this machine for too long, and has ended the run".into()
        }
        Cause::Operator => "stopped by the operator".into(),
        Cause::Lost => format!("{v} samples lost within 128 periods"),
        Cause::Late => "too many samples or answers came late".into(),
        Cause::Duplicated => format!("{v} samples came twice within 128 periods"),
        Cause::Reordered => format!("{v} samples came out of order within 128 periods"),
        Cause::Jump => format!("the encoder jumped, by {v} counts at last"),
        Cause::StandStill => envelope("the encoder shows no movement: encoder frozen, or shaft blocked"),
        Cause::Channel => envelope("the counts go to and fro: a channel of the encoder is dead, or loose"),
        Cause::Reversed => {
            envelope("the counts go backwards, where no shaft goes: encoder or converter the wrong way round")
        }
        Cause::TooSlow => envelope(
            "the counts are behind the slowest shaft of [bounds]: counts missing, a brake that drags, or bounds too narrow",
        ),
        Cause::TooFast => envelope(
            "the counts are ahead of the fastest shaft of [bounds]: brake open, converter, lever or pad broken, or bounds too narrow",
        ),
        Cause::FollowingError => format!("following error of {} °", number(v.to_degrees())),
        Cause::Saturation => "the voltage was at its limit for too long".into(),
        Cause::NotFinite => "the law's demand was not a number".into(),
        Cause::Deadline => format!("answers came too late, the last after {v} µs"),
        // The board's own supervisor reports the number of periods.
        Cause::Clock => format!(
            "the board's clock and its periods, or this machine's clock, are apart by {} ms: a wrong prescaler or crystal",
            number(v / 1000.0)
        ),
        Cause::Silence if on_the_board && v > 0.0 => "the board's encoder and converter fell silent".into(),
        Cause::Silence => "the board fell silent".into(),
        Cause::Board => match v as u8 {
            1 => "the board's watchdog went off: it got no valid answer in time".into(),
            2 => "the board sees no encoder".into(),
            3 => "the board's converter does not follow".into(),
            _ => "the board went to its safe state by itself".into(),
        },
        Cause::Target => {
            "the path's target is not a number, or moves faster than rig.speed_limit_deg_s".into()
        }
        Cause::None => "control did not begin".into(),
    }
}
