//! The command line of a campaign: number of rigs, first seed, and what is other than in the table that a verb writes.

use crate::random_rig::{Outcome, lag, other_waves};

/// What may be other than on the rigs of a table.
const OTHERS: [&str; 2] = ["waves", "lags"];

/// Rigs that are asked for.
pub(crate) struct Asked {
    pub(crate) rigs: u64,
    pub(crate) first: u64,
    /// Other values of some keys on all rigs.
    set: Vec<(String, String)>,
    words: Vec<String>,
}

impl Asked {
    /// `RIGS SEED`, `waves` for ripples unlike that of `bench`, `lags` for actuators with a lag, `KEY=VALUE` for another value on all rigs, and the campaign's own
    /// words.
    pub(crate) fn of_the_line([rigs, first]: [u64; 2], own: &[&str]) -> Outcome<Asked> {
        let mut args = std::env::args().skip(1);
        let mut number = |default: u64| args.next().map_or(Ok(default), |text| text.parse::<u64>());
        let (rigs, first) = (number(rigs)?, number(first)?);
        let (mut set, mut words) = (Vec::new(), Vec::new());
        for word in args {
            match word.split_once('=') {
                Some((key, value)) => set.push((key.to_owned(), value.to_owned())),
                None if OTHERS.contains(&word.as_str()) || own.contains(&word.as_str()) => words.push(word),
                None => {
                    let expected = [&OTHERS, own].concat().join(", ");
                    return Err(format!("{word}: expected KEY=VALUE or one of: {expected}").into());
                }
            }
        }
        Ok(Asked { rigs, first, set, words })
    }

    /// If the line has this word.
    pub(crate) fn has(&self, word: &str) -> bool {
        self.words.iter().any(|own| own == word)
    }

    /// Departures from the table that a verb writes, for a row.
    pub(crate) fn other(&self) -> String {
        let set = self.set.iter().map(|(key, value)| format!("`{key} = {value}`"));
        let others = OTHERS.iter().filter(|word| self.has(word)).map(|word| format!("other {word}"));
        others.chain(set).collect::<Vec<_>>().join(", ")
    }

    /// Other values of some keys on the rig of a seed.
    pub(crate) fn set_of(&self, seed: u64) -> Vec<(String, String)> {
        let waves = if self.has("waves") { other_waves(seed) } else { Vec::new() };
        let lags = if self.has("lags") { lag(seed) } else { Vec::new() };
        [waves, lags, self.set.clone()].concat()
    }
}
