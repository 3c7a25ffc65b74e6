//! The chips that have a model, and which image runs on which.

use super::ChipFaultKind;
use std::path::Path;

/// A chip with a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChipKind {
    /// The chip of the NUCLEO-G474RE.
    Stm32g474,
    /// The chip of the Raspberry Pi Pico.
    Rp2040,
}

impl ChipKind {
    /// The chip of an image, by the beginning of its name; none if it has no model.
    #[must_use]
    pub fn of(image: &Path) -> Option<ChipKind> {
        let name = image.file_name()?.to_string_lossy();
        match name.split_once('-')?.0 {
            "nucleo" => Some(ChipKind::Stm32g474),
            "pico" => Some(ChipKind::Rp2040),
            _ => None,
        }
    }

    /// Name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            ChipKind::Stm32g474 => "STM32G474RE",
            ChipKind::Rp2040 => "RP2040",
        }
    }

    /// Its registers, for the core of `cortex_m.py`.
    pub(super) const fn model(self) -> &'static str {
        match self {
            ChipKind::Stm32g474 => include_str!("stm32g474.py"),
            ChipKind::Rp2040 => include_str!("rp2040.py"),
        }
    }

    /// True if it can have a fault: an RP2040 has no monitor of its supply and no such options, and only its encoder's
    /// counter reports edges that it missed. Its images have no panic handler: with a path to a panic they would not link.
    #[must_use]
    pub const fn has(self, fault: ChipFaultKind) -> bool {
        match fault {
            ChipFaultKind::SupplyLow | ChipFaultKind::BrownOutLow | ChipFaultKind::Panic => {
                matches!(self, ChipKind::Stm32g474)
            }
            ChipFaultKind::EncoderSkip => matches!(self, ChipKind::Rp2040),
            _ => true,
        }
    }
}
