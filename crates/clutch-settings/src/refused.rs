//! A board's refusal of settings, in words.

use super::declared::{Declared, Setting};
use super::{Misfit, Settings};
use clutch_core::params::{Kind, Row};
use core::fmt;

impl Misfit {
    /// As the frame `Refused` has it: the key in the low half and, above it, the number of the condition that does
    /// not hold.
    #[must_use]
    pub fn bits(&self) -> u32 {
        match *self {
            Misfit::Missing(key) | Misfit::Unknown(key) => key.into(),
            Misfit::Unfit { key, relation, .. } => u32::from(relation) << 16 | u32::from(key),
        }
    }
}

/// A setting that a board refuses: name, value and expectation, as a scenario's error has them.
#[derive(Clone, Copy, Debug)]
pub struct Refusing<'a> {
    /// The settings that the board was sent.
    pub settings: &'a Settings,
    /// [`Misfit::bits`], as the board reports them.
    pub bits: u32,
    /// The board lacks the setting or knows no such value; otherwise the value is out of range.
    pub lacks: bool,
}

impl fmt::Display for Refusing<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (key, relation) = (self.bits as u16, self.bits >> 16);
        let Some(setting) = Setting::of(key) else {
            return if Settings::knows(key) {
                write!(f, "a point of reference.table ({key:#06x}): the board lacks it")
            } else {
                write!(f, "the setting {key:#06x}: expected one that this program knows")
            };
        };
        write!(f, "{}", setting.name)?;
        let Some(sent) = self.settings.get(key) else {
            return write!(f, ": missing");
        };
        f.write_str(" = ")?;
        match setting.declared {
            Declared::Choice(choice) => {
                one_of(f, &mut choice.options.iter().map(|option| option.key), sent)?;
            }
            Declared::Row(row, _) => value(f, row, sent)?,
        }
        f.write_str(if self.lacks {
            ": the board lacks it, or knows no such value: expected "
        } else {
            ": expected "
        })?;
        match setting.declared {
            Declared::Choice(choice) => {
                f.write_str("one of: ")?;
                let mut names = choice.options.iter().map(|option| option.key);
                names.next().map_or(Ok(()), |first| f.write_str(first))?;
                names.try_for_each(|name| write!(f, ", {name}"))
            }
            Declared::Row(row, table) => {
                match usize::try_from(relation).ok().and_then(|n| table.relations.get(n.checked_sub(1)?)) {
                    Some(relation) => f.write_str(relation.expected),
                    None => row.range.words(row.kind, &setting.shown_unit(), false).fmt(f),
                }
            }
        }
    }
}

/// The name at a place in a list; of a place beyond it, its number.
fn one_of(
    f: &mut fmt::Formatter<'_>,
    names: &mut dyn Iterator<Item = &'static str>,
    place: u64,
) -> fmt::Result {
    match usize::try_from(place).ok().and_then(|n| names.nth(n)) {
        Some(name) => f.write_str(name),
        None => write!(f, "{place}"),
    }
}

/// A value in the unit of its key.
fn value(f: &mut fmt::Formatter<'_>, row: &Row, sent: u64) -> fmt::Result {
    match (row.kind, u32::try_from(sent)) {
        // As short as the single precision of the wire.
        (Kind::Real, Ok(bits)) => write!(f, "{}", row.unit.from_si(f32::from_bits(bits).into()) as f32),
        (Kind::Points, _) => write!(f, "{sent} points"),
        (Kind::Word(words), _) => one_of(f, &mut words.iter().map(|word| word.name), sent),
        _ => write!(f, "{sent}"),
    }
}
