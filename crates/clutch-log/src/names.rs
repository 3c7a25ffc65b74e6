//! The meanings of the small numbers in records: the one table of names.
//!
//! The schemas in the file carry these names, so viewers show `Holding`, not 4.

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

/// States of the supervisor.
pub const STATES: Names = &[
    (0, "Disconnected"),
    (1, "Ready"),
    (2, "Armed"),
    (3, "Running"),
    (4, "Holding"),
    (5, "Released"),
    (6, "Faulted"),
];

/// The cause of a change of the supervisor's state.
pub const CAUSES: Names = &[
    (0, "None"),
    (1, "Lost"),
    (2, "Late"),
    (3, "Duplicated"),
    (4, "Reordered"),
    (5, "Jump"),
    (6, "StandStill"),
    (7, "FollowingError"),
    (8, "Saturation"),
    (9, "NotFinite"),
    (10, "Deadline"),
    (11, "Silence"),
    (12, "Board"),
    (13, "Target"),
    (14, "Operator"),
    (15, "Done"),
    (16, "Channel"),
    (17, "Reversed"),
    (18, "TooSlow"),
    (19, "TooFast"),
    (20, "Clock"),
];

/// The limit at which the output stage changed the law's demand, if any.
pub const LIMITS: Names = &[(0, "Unlimited"), (1, "Lowest"), (2, "Highest"), (3, "Invalid")];
