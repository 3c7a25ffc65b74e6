//! Words for a board: its number, the reason why its program started, and what its owner should mend.

use crate::sim_board::{PATIENT_BOARD, STRICT_BOARD};
use clutch_sim::number;
use clutch_wire::{ControllerHello, Hello, ResetCause, WARNING_BROWN_OUT};

pub(crate) fn is_simulated(hello: &Hello) -> bool {
    hello.board == PATIENT_BOARD || hello.board == STRICT_BOARD
}

/// A board that closes the loop itself.
pub(crate) fn controller_text(c: &ControllerHello) -> String {
    let name =
        if c.board <= STRICT_BOARD { "emulated".to_owned() } else { format!("number {:08x}", c.board) };
    let clock =
        if c.clock_hz > 0 { format!(", {} MHz", number(f64::from(c.clock_hz) / 1e6)) } else { String::new() };
    format!("{name}{clock}")
}

/// A board that obeys.
pub(crate) fn board_text(hello: &Hello) -> String {
    match hello.board {
        PATIENT_BOARD => "simulated; its clock waits when this machine stalls".to_owned(),
        STRICT_BOARD => "simulated, in real time".to_owned(),
        serial => format!("number {serial:08x}{}", started_text(hello)),
    }
}

/// The reason of its start, behind its name; nothing for a simulated board, which starts when it is asked to.
pub(crate) fn started_text(hello: &Hello) -> String {
    if is_simulated(hello) {
        return String::new();
    }
    let by = match ResetCause::from_u8(hello.started_by) {
        Some(ResetCause::Unknown) => return ", started for an unknown reason".to_owned(),
        Some(ResetCause::Power) => "power-up",
        Some(ResetCause::Pin) => "its reset pin",
        Some(ResetCause::Watchdog) => "its watchdog",
        Some(ResetCause::Software) => "a reset by software",
        Some(ResetCause::Fault) => "its watchdog after a fault of the program",
        Some(ResetCause::Clock) => "its watchdog after a clock stopped",
        None => return format!(", started for the reason {}, which is not known here", hello.started_by),
    };
    format!(", started by {by}")
}

/// Notes for the owner of the board, before a run.
pub(crate) fn start_notes(hello: &Hello) -> Vec<String> {
    let mut notes = Vec::new();
    let ended = match ResetCause::from_u8(hello.started_by) {
        Some(ResetCause::Watchdog) => "had hung",
        Some(ResetCause::Fault) => "had met a fault of the processor, an unexpected interrupt or a panic",
        Some(ResetCause::Clock) => "had lost a clock: look at its crystal and supply",
        _ => "",
    };
    if !ended.is_empty() {
        notes.push(format!("note: the board was reset by its watchdog, since its program {ended}"));
    }
    if hello.warnings & WARNING_BROWN_OUT != 0 {
        notes.push(
            "note: the board's brown-out level is lower than its program asks for; set it as docs/firmware.md says"
                .to_owned(),
        );
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hello(board: u32, started_by: u8, warnings: u8) -> Hello {
        Hello {
            nonce: 0,
            version: 0,
            schema: 0,
            board,
            boot: 9,
            counts_per_rev: 20_000,
            dac_bits: 12,
            dac_lowest_mv: 0,
            dac_highest_mv: 10_000,
            period_min_us: 500,
            period_max_us: 4000,
            watchdog_max_us: 100_000,
            boot_code: 1844,
            started_by,
            warnings,
            state: 0,
            run: 0,
            config: 0,
        }
    }

    #[test]
    fn a_board_that_its_watchdog_has_reset_is_noted_and_one_that_was_switched_on_is_not() {
        let says = |cause: ResetCause| {
            (board_text(&hello(42, cause as u8, 0)), start_notes(&hello(42, cause as u8, 0)))
        };
        for (cause, text, noted) in [
            (ResetCause::Unknown, "for an unknown reason", None),
            (ResetCause::Power, "by power-up", None),
            (ResetCause::Pin, "by its reset pin", None),
            (ResetCause::Software, "by a reset by software", None),
            (ResetCause::Watchdog, "by its watchdog", Some("had hung")),
            (ResetCause::Fault, "by its watchdog after a fault of the program", Some("a panic")),
            (ResetCause::Clock, "by its watchdog after a clock stopped", Some("had lost a clock")),
        ] {
            let (board, notes) = says(cause);
            assert_eq!(board, format!("number 0000002a, started {text}"));
            let note = notes.first().map(String::as_str).unwrap_or_default();
            assert_eq!(
                (notes.len(), noted.is_some()),
                (usize::from(noted.is_some()), !note.is_empty()),
                "{note}"
            );
            assert!(note.contains(noted.unwrap_or_default()), "{note}");
        }
        assert!(board_text(&hello(42, 77, 0)).ends_with("for the reason 77, which is not known here"));
    }

    #[test]
    fn a_simulated_board_gives_no_reason_and_a_low_brown_out_level_is_noted() {
        assert_eq!(board_text(&hello(1, 1, 0)), "simulated, in real time");
        let notes = start_notes(&hello(42, 1, WARNING_BROWN_OUT));
        assert!(matches!(&notes[..], [note] if note.contains("brown-out level")), "{notes:?}");
    }
}
