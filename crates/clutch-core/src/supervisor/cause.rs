//! The cause of the end of control, and sets of the checks that can be one.

/// The cause of the end of control.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Cause {
    /// It has not.
    #[default]
    None = 0,
    /// Too many samples lost.
    Lost = 1,
    /// Too many samples or answers late.
    Late = 2,
    /// Too many samples twice.
    Duplicated = 3,
    /// Too many samples out of order.
    Reordered = 4,
    /// Counts that no shaft can have moved.
    Jump = 5,
    /// No count although the shaft must have moved.
    StandStill = 6,
    /// Too far from the path.
    FollowingError = 7,
    /// Too long at a limit of the output.
    Saturation = 8,
    /// A measurement, term or demand that is not a number.
    NotFinite = 9,
    /// Too many answers later than the deadline.
    Deadline = 10,
    /// No sample for too long.
    Silence = 11,
    /// The board reports a fault, or has gone to its safe state by itself.
    Board = 12,
    /// A target that is not a number or moves too fast.
    Target = 13,
    /// An operator's stop.
    Operator = 14,
    /// The path is done.
    Done = 15,
    /// Counts to and fro, although the shaft must have moved on.
    Channel = 16,
    /// Counts backwards, where no shaft goes.
    Reversed = 17,
    /// Counts behind the slowest shaft.
    TooSlow = 18,
    /// Counts ahead of the fastest shaft.
    TooFast = 19,
    /// A clock of the board that does not agree with its periods, or with its host's clock.
    Clock = 20,
}

impl Cause {
    /// Every cause that is a check's.
    pub const CHECKS: [Cause; 18] = [
        Cause::Lost,
        Cause::Late,
        Cause::Duplicated,
        Cause::Reordered,
        Cause::Jump,
        Cause::StandStill,
        Cause::FollowingError,
        Cause::Saturation,
        Cause::NotFinite,
        Cause::Deadline,
        Cause::Silence,
        Cause::Board,
        Cause::Target,
        Cause::Channel,
        Cause::Reversed,
        Cause::TooSlow,
        Cause::TooFast,
        Cause::Clock,
    ];
}

impl Cause {
    /// The one of this number; none if there is none.
    #[must_use]
    pub fn from_u8(number: u8) -> Option<Cause> {
        match number {
            0 => Some(Cause::None),
            14 => Some(Cause::Operator),
            15 => Some(Cause::Done),
            check => Cause::CHECKS.iter().find(|c| **c as u8 == check).copied(),
        }
    }
}

/// A set of checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Checks(u32);

impl Checks {
    /// All of them.
    pub const ALL: Checks = Checks(u32::MAX);

    /// All but one.
    #[must_use]
    pub const fn without(self, cause: Cause) -> Checks {
        Checks(self.0 & !Checks::bit(cause))
    }

    /// Those that are in both sets.
    #[must_use]
    pub const fn both(a: Checks, b: Checks) -> Checks {
        Checks(a.0 & b.0)
    }

    /// True if the check is on.
    #[must_use]
    pub const fn has(self, cause: Cause) -> bool {
        self.0 & Checks::bit(cause) != 0
    }

    const fn bit(cause: Cause) -> u32 {
        1_u32.wrapping_shl(cause as u32)
    }
}
