//! Kinds of a single parameter.

/// The kind of a single parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A real number.
    Real,
    /// A whole number of at least 0.
    Whole,
    /// True or false.
    Switch,
    /// One of several words.
    Word(&'static [Word]),
    /// A text.
    Text,
    /// A list of pairs of numbers.
    Points,
}

/// A word that a parameter may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// The word.
    pub name: &'static str,
    /// Its meaning.
    pub doc: &'static str,
}
