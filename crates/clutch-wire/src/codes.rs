//! The meanings of the numbers in the fields.

/// A set of numbers that a field may hold.
#[derive(Clone, Copy, Debug)]
pub struct CodeInfo {
    /// Name of the set: the enum's.
    pub name: &'static str,
    /// Its meaning.
    pub doc: &'static str,
    /// The numbers.
    pub values: &'static [CodeValue],
}

/// One number and its meaning.
#[derive(Clone, Copy, Debug)]
pub struct CodeValue {
    /// Name of the number.
    pub name: &'static str,
    /// The number.
    pub value: u8,
    /// Its meaning.
    pub doc: &'static str,
}

/// One table makes the enums, their decoding, and [`CODES`] for documents and headers.
macro_rules! codes {
    ($($(#[doc = $doc:literal])+ $name:ident {
        $($(#[doc = $value_doc:literal])+ $variant:ident = $value:literal,)+
    })+) => {
        $(
            $(#[doc = $doc])+
            #[cfg_attr(feature = "defmt", derive(defmt::Format))]
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            #[repr(u8)]
            pub enum $name {
                $($(#[doc = $value_doc])+ $variant = $value,)+
            }

            impl $name {
                /// The meaning of a number; nothing if it has none.
                #[must_use]
                pub const fn from_u8(value: u8) -> Option<$name> {
                    match value {
                        $($value => Some($name::$variant),)+
                        _ => None,
                    }
                }
            }
        )+

        /// All sets of numbers.
        pub const CODES: &[CodeInfo] = &[$(CodeInfo {
            name: stringify!($name),
            doc: concat!($($doc),+),
            values: &[$(CodeValue {
                name: stringify!($variant),
                value: $value,
                doc: concat!($($value_doc),+),
            }),+],
        }),+];
    };
}

codes! {
    /// The present state of the board.
    BoardState {
        /// Powered up; never configured since; the output is `boot_code`.
        Boot = 0,
        /// Configured; samples go out; the output is as it was, or a safe output goes on.
        Ready = 1,
        /// The host has consented; the first `Actuate` starts the run.
        Armed = 2,
        /// The output follows the host.
        Running = 3,
        /// Stopped by the host; the safe output is on.
        Stopped = 4,
        /// A fault is latched; the safe output is on.
        Faulted = 5,
    }

    /// The board's way to its safe output.
    SafeKind {
        /// `hold_code` at once.
        Hold = 0,
        /// From the present code to `hold_code`, by `ramp_step` each period.
        Ramp = 1,
        /// `release_code` at once.
        Release = 2,
        /// `hold_code` at once, `release_code` after `hold_periods`.
        HoldThenRelease = 3,
    }

    /// The reason why the board went to its safe output by itself.
    BoardFault {
        /// No `Actuate` was applied for `watchdog_us`; `value` is the time since the last one, µs.
        Watchdog = 1,
        /// The encoder's reading cannot be trusted; `value` is the board's own detail.
        Encoder = 2,
        /// The converter did not take a code; `value` is the board's own detail.
        Converter = 3,
    }

    /// The host's reason to stop the run.
    StopReason {
        /// The run is over.
        Done = 0,
        /// Somebody asked for it.
        Operator = 1,
        /// The host saw a fault; the board latches it.
        Fault = 2,
    }

    /// The reason why the board's program started.
    ResetCause {
        /// The board cannot know.
        Unknown = 0,
        /// The supply came, or had been too low.
        Power = 1,
        /// The reset pin: a button, or a debugger.
        Pin = 2,
        /// The hardware watchdog: the program had hung.
        Watchdog = 3,
        /// The program or a debugger asked for it.
        Software = 4,
        /// A fault of the processor, an unexpected interrupt, or a panic had stopped the program.
        Fault = 5,
        /// A clock had stopped, and the program with it.
        Clock = 6,
    }

    /// The board's reason to refuse a frame.
    Refusal {
        /// Another version of the protocol; `value` is the board's.
        Version = 1,
        /// Another table of messages; `value` is the low 32 bits of the board's schema hash.
        Schema = 2,
        /// The run number is not a new one (`Configure`) or not the configured one; `value` is the
        /// board's.
        Run = 3,
        /// The configuration hash is not the configured one; `value` is the low 32 bits of the board's.
        Config = 4,
        /// Not in this state; `value` is the `BoardState`, or a controller's own state of control.
        State = 5,
        /// The period is out of the board's range; `value` is the period asked for, µs.
        Period = 6,
        /// The watchdog time is below two periods, above a hundred, or above the board's limit; `value` is
        /// the time asked for, µs.
        Watchdog = 7,
        /// No such safe output: unknown kind, or a code above the converter's top; `value` is the kind.
        Safe = 8,
        /// Came too late. A board of version 1 shows this in `Sample.status` instead; `value` is the
        /// delay, µs.
        Late = 9,
        /// Cannot be done just now: ask again; `value` is 0.
        Busy = 10,
        /// The code is above the converter's top; `value` is the code.
        Code = 11,
        /// A setting that is missing, or whose value is of a kind that is not known; `value` is its key.
        Setting = 12,
        /// The settings make no run; `value` is the key of the offending one, and above its 16 bits the number of
        /// the condition between several that does not hold, or 0.
        Unfit = 13,
        /// Nothing answers where the controller's encoder and converter should be; `value` is 0.
        NoBoard = 14,
        /// `Configure` differs from the settings; `value` is 0.
        Differs = 15,
        /// `Arm` does not bring back the number of the power-up that the hello had; `value` is 0.
        Boot = 16,
    }
}

/// Bits of a field: each a constant, and all of them in one table.
macro_rules! bits {
    ($(#[doc = $all:literal])+ $table:ident
     $($(#[doc = $doc:literal])+ $name:ident = $value:literal $short:literal;)+) => {
        $($(#[doc = $doc])+ pub const $name: u8 = $value;)+

        $(#[doc = $all])+
        pub const $table: &[CodeValue] =
            &[$(CodeValue { name: $short, value: $value, doc: concat!($($doc),+) }),+];
    };
}

bits! {
    /// The bits of `Telemetry.flags`.
    TELEMETRY
    /// A newer sample was there already.
    TELEMETRY_SUPERSEDED = 0x01 "Superseded";
    /// The sample was answered.
    TELEMETRY_ANSWERED = 0x02 "Answered";
    /// The law was asked: error, rate, terms and demand are set.
    TELEMETRY_ASKED = 0x04 "Asked";
    /// The path was asked for its target.
    TELEMETRY_TARGETED = 0x08 "Targeted";
    /// The limit that decided the voltage: 0 none, 1 the lowest, 2 the highest, 3 a demand that was not a number.
    TELEMETRY_LIMIT = 0x30 "Limit";
}

bits! {
    /// The bits of `Hello.warnings`.
    WARNINGS
    /// The supply may fall further before it resets the board than the board's program asks for.
    WARNING_BROWN_OUT = 0x01 "BrownOut";
}

bits! {
    /// The bits of `Sample.status`.
    STATUS
    /// The bits that hold the `BoardState`.
    STATUS_STATE = 0x07 "State";
    /// The encoder's reading cannot be trusted.
    STATUS_ENCODER_FAULT = 0x08 "EncoderFault";
    /// The converter did not take the last code.
    STATUS_DAC_FAULT = 0x10 "DacFault";
    /// An `Actuate` since the sample before came too late and was not applied.
    STATUS_LATE = 0x20 "Late";
}
