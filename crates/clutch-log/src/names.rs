//! The meanings of the small numbers in records: the one table of names.
//!
//! The schemas in the file carry these names, so viewers show `Holding`, not 4.

use clutch_core::law::Limit;
use clutch_core::supervisor::{Cause, State};

/// Number and name, in the order of the numbers.
pub type Names = &'static [(u8, &'static str)];

/// The name of `number`, or `"?"`.
#[must_use]
pub fn name_of(names: Names, number: u8) -> &'static str {
    names.iter().find(|(n, _)| *n == number).map_or("?", |(_, name)| name)
}

/// An enum together with its table.
macro_rules! named {
    ($(#[$doc:meta])* $name:ident, $(#[$table_doc:meta])* $table:ident {
        $($(#[$value_doc:meta])* $value:ident = $number:literal),* $(,)?
    }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum $name { $($(#[$value_doc])* $value = $number),* }

        $(#[$table_doc])*
        pub const $table: Names = &[$(($number, stringify!($value))),*];

        impl $name {
            /// From the number in a record.
            #[must_use]
            pub const fn from_number(number: u8) -> Option<Self> {
                match number { $($number => Some($name::$value),)* _ => None }
            }

            /// The name that viewers show.
            #[must_use]
            pub fn name(self) -> &'static str {
                name_of($table, self as u8)
            }
        }

        impl From<$name> for u8 {
            fn from(value: $name) -> u8 { value as u8 }
        }
    };
}

named! {
    /// The arrival of a tick's sample.
    Arrival,
    /// Names of [`Arrival`].
    ARRIVALS {
        /// In time and in order.
        Fresh = 0,
        /// None came in this tick.
        Missing = 1,
        /// The same sequence number again.
        Duplicate = 2,
        /// An older sequence number than the last.
        Reordered = 3,
        /// After its deadline.
        Late = 4,
        /// Refused by the plausibility gate.
        Implausible = 5,
    }
}

named! {
    /// The origin of a command's code.
    CommandSource,
    /// Names of [`CommandSource`].
    COMMAND_SOURCES {
        /// The control law.
        Law = 0,
        /// Nobody: the sample was not answered, and the board kept its code.
        Unanswered = 1,
        /// The safe state.
        Safe = 2,
    }
}

named! {
    /// The kind of an event.
    EventKind,
    /// Names of [`EventKind`].
    EVENT_KINDS {
        /// The supervisor went from one state to another.
        StateChange = 0,
        /// Control ended, but not by a sample: silence, the board's own report, an operator, the
        /// path's end.
        Ended = 1,
        /// The ring was full: `value` records were dropped.
        LogDropped = 2,
        /// The port is gone.
        PortLost = 3,
        /// Friction over load left the bounds that a certificate assumes: `value` is the multiple of the
        /// model's that was seen.
        Drift = 4,
    }
}

/// The table of an enum of clutch-core, which owns the numbers; the log has words of its own where it says so. A value
/// that is left out does not compile.
macro_rules! of_core {
    ($(#[$doc:meta])* $table:ident of $name:ident { $($value:ident $(as $word:literal)?),* $(,)? }) => {
        $(#[$doc])*
        pub const $table: Names = &[$(($name::$value as u8, of_core!(@ $value $($word)?))),*];

        const _: fn($name) = |value| match value { $($name::$value => (),)* };
    };
    (@ $value:ident) => { stringify!($value) };
    (@ $value:ident $word:literal) => { $word };
}

of_core! {
    /// States of the supervisor.
    STATES of State { Disconnected, Ready, Armed, Running, Holding, Released, Faulted }
}

of_core! {
    /// The cause of a change of the supervisor's state.
    CAUSES of Cause {
        None,
        Lost,
        Late,
        Duplicated,
        Reordered,
        Jump,
        StandStill,
        FollowingError,
        Saturation,
        NotFinite,
        Deadline,
        Silence,
        Board,
        Target,
        Operator,
        Done,
        Channel,
        Reversed,
        TooSlow,
        TooFast,
        Clock,
    }
}

of_core! {
    /// The limit at which the output stage changed the law's demand, if any.
    LIMITS of Limit { None as "Unlimited", Lowest, Highest, Invalid }
}
