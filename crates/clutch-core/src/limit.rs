//! The limit that decided a voltage.

/// The limit at which the output stage changed the demand, if it did.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Limit {
    /// The demand went out as it was.
    #[default]
    None,
    /// Raised to the lowest voltage: the law asks for a torque that the actuator cannot give, with a brake one that drives.
    Lowest,
    /// Lowered to the highest voltage.
    Highest,
    /// The demand was not a number; the voltage for that case went out.
    Invalid,
}

impl Limit {
    /// Every limit, by its number in logs and on the wire.
    pub const ALL: [Limit; 4] = [Limit::None, Limit::Lowest, Limit::Highest, Limit::Invalid];

    /// The limit of that number.
    #[must_use]
    pub fn from_u8(number: u8) -> Option<Limit> {
        Limit::ALL.get(usize::from(number)).copied()
    }
}
