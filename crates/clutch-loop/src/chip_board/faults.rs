//! Faults of the chip: their kinds and times.

use clutch_sim::nearest;
use std::str::FromStr;

/// A fault of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChipFaultKind {
    /// The converter's output register does not follow.
    ConverterStuck,
    /// The crystal stops, or never starts.
    Crystal,
    /// Bytes come faster than they are read.
    Overrun,
    /// The core spins, with interrupts off.
    Hang,
    /// The core meets an undefined instruction.
    Undefined,
    /// A non-maskable interrupt.
    Nmi,
    /// An interrupt that the program never enabled.
    Unexpected,
    /// The supply is below the threshold of the chip's monitor, and the converter's reference with it.
    SupplyLow,
    /// Both signals of the encoder change at once.
    EncoderSkip,
    /// The chip's brown-out level is as its maker delivers it.
    BrownOutLow,
    /// The amplifier behind the converter gives 0 V.
    Amplifier,
    /// A function calls itself without an end.
    StackOverflow,
    /// The program comes to its panic handler.
    Panic,
}

impl ChipFaultKind {
    /// All, by name.
    pub const ALL: [(&'static str, ChipFaultKind); 13] = [
        ("converter-stuck", ChipFaultKind::ConverterStuck),
        ("crystal", ChipFaultKind::Crystal),
        ("overrun", ChipFaultKind::Overrun),
        ("hang", ChipFaultKind::Hang),
        ("undefined", ChipFaultKind::Undefined),
        ("nmi", ChipFaultKind::Nmi),
        ("unexpected", ChipFaultKind::Unexpected),
        ("supply-low", ChipFaultKind::SupplyLow),
        ("encoder-skip", ChipFaultKind::EncoderSkip),
        ("brown-out-low", ChipFaultKind::BrownOutLow),
        ("amplifier", ChipFaultKind::Amplifier),
        ("stack-overflow", ChipFaultKind::StackOverflow),
        ("panic", ChipFaultKind::Panic),
    ];

    /// Its name.
    pub(super) fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }

    /// Its bit, as `Fault` in the model of the chip has it.
    pub(super) const fn bit(self) -> u32 {
        match self {
            ChipFaultKind::ConverterStuck => 1,
            ChipFaultKind::Crystal => 1 << 1,
            ChipFaultKind::Overrun => 1 << 2,
            ChipFaultKind::Hang => 1 << 3,
            ChipFaultKind::Undefined => 1 << 4,
            ChipFaultKind::Nmi => 1 << 5,
            ChipFaultKind::Unexpected => 1 << 6,
            ChipFaultKind::SupplyLow => 1 << 7,
            ChipFaultKind::EncoderSkip => 1 << 8,
            ChipFaultKind::BrownOutLow => 1 << 9,
            ChipFaultKind::Amplifier => 1 << 10,
            ChipFaultKind::StackOverflow => 1 << 11,
            ChipFaultKind::Panic => 1 << 12,
        }
    }
}

/// A fault of the chip, and when: it lasts, even through a reset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChipFault {
    /// The fault.
    pub kind: ChipFaultKind,
    /// Its beginning, s after arming; none for one that is there at power-up.
    pub at: Option<f64>,
}

impl ChipFault {
    /// True if it is in force; `armed` is the time since arming, s.
    #[must_use]
    pub fn active(&self, armed: Option<f64>) -> bool {
        self.at.is_none_or(|at| armed.is_some_and(|t| t >= at))
    }
}

/// A text is no fault of the chip.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("chip fault \"{text}\": {problem}")]
pub struct ChipFaultError {
    text: String,
    problem: String,
}

/// `KIND`, from power-up on, or `KIND:at=SECONDS` after arming.
impl FromStr for ChipFault {
    type Err = ChipFaultError;

    fn from_str(text: &str) -> Result<Self, ChipFaultError> {
        let bad = |problem: String| ChipFaultError { text: text.to_owned(), problem };
        let (name, rest) = text.split_once(':').map_or((text, None), |(name, rest)| (name, Some(rest)));
        let Some((_, kind)) = ChipFaultKind::ALL.into_iter().find(|(known, _)| *known == name) else {
            let names = ChipFaultKind::ALL.map(|(name, _)| name);
            return Err(bad(format!("expected one of {}{}", names.join(", "), nearest(name, &names))));
        };
        let at = rest.map(|rest| {
            let number = rest.strip_prefix("at=").and_then(|at| at.parse::<f64>().ok());
            number.filter(|at| at.is_finite() && *at >= 0.0).ok_or_else(|| {
                bad(format!("\"{rest}\": expected at=SECONDS, a number of seconds after arming, not below 0"))
            })
        });
        Ok(ChipFault { kind, at: at.transpose()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_read_from_its_text() {
        let read = |text: &str| text.parse::<ChipFault>();
        assert_eq!(read("crystal"), Ok(ChipFault { kind: ChipFaultKind::Crystal, at: None }));
        assert_eq!(read("nmi:at=1.5"), Ok(ChipFault { kind: ChipFaultKind::Nmi, at: Some(1.5) }));
        for wrong in ["", "nim", "nmi:", "nmi:at", "nmi:at=-1", "nmi:at=nan", "nmi:for=1"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
