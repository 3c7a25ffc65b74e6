//! The one table of messages: structs, lengths, coding, description and schema hash come from it.

use crate::bytes::{Put, next};
use crate::list::List;
use clutch_core::{FNV_64, fnv1a_64};

/// The sender of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the host to the board; kinds below 0x80.
    ToBoard,
    /// From the board to the host; kinds from 0x80.
    ToHost,
}

/// A message as the table describes it.
#[derive(Clone, Copy, Debug)]
pub struct MessageInfo {
    /// Name, as the struct's.
    pub name: &'static str,
    /// First byte of its frame.
    pub kind: u8,
    /// Its sender.
    pub direction: Direction,
    /// Bytes before stuffing: kind, fields and CRC, without the numbers of a list. On the wire two more.
    pub length: u8,
    /// Most numbers of the list that ends it, four bytes each; 0 if it has none.
    pub list: u8,
    /// Its meaning.
    pub doc: &'static str,
    /// Its fields in order.
    pub fields: &'static [FieldInfo],
}

/// A field as the table describes it.
#[derive(Clone, Copy, Debug)]
pub struct FieldInfo {
    /// Name, as the struct's.
    pub name: &'static str,
    /// `u8`, `u16`, `u32`, `u64` or `i32`; little-endian. `[u32;8]`: up to eight, and in front of them their number
    /// in a byte.
    pub ty: &'static str,
    /// Its place, bytes from the start of the frame before stuffing (the kind is at 0).
    pub offset: u8,
    /// Its unit; empty for a plain number.
    pub unit: &'static str,
    /// Its meaning.
    pub doc: &'static str,
}

/// Bytes before stuffing that are not fields: kind and CRC.
const AROUND: usize = 1 + 4;

macro_rules! messages {
    ($(
        $(#[doc = $doc:literal])+
        $kind:literal $direction:ident $name:ident {
            $($(#[doc = $field_doc:literal])+ $field:ident: $ty:ident $([$unit:literal])?,)+
        }
        $(then $(#[doc = $list_doc:literal])+ $list:ident [$list_unit:literal])?
    )+) => {
        $(
            $(#[doc = $doc])+
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub struct $name {
                $(
                    $(#[doc = $field_doc])+
                    $(#[doc = concat!("\n\nUnit: ", $unit, ".")])?
                    pub $field: $ty,
                )+
                $(
                    $(#[doc = $list_doc])+
                    #[doc = concat!("\n\nUnit: ", $list_unit, ".")]
                    pub $list: List,
                )?
            }

            impl $name {
                /// First byte of the frame.
                pub const KIND: u8 = $kind;
                /// Bytes before stuffing: kind, fields and CRC, without the numbers of a list.
                pub const LENGTH: usize = AROUND $(+ size_of::<$ty>())+ $(+ listed!($list 1))?;
                /// The same of the longest.
                const LONGEST: usize = $name::LENGTH $(+ listed!($list 4 * List::MOST))?;

                #[inline]
                fn put(&self, out: &mut Put<'_>) -> usize {
                    out.bytes([$kind]);
                    $(out.bytes(self.$field.to_le_bytes());)+
                    $(self.$list.put(out);)?
                    ($name::LENGTH - 4) $(.wrapping_add(self.$list.size()))?
                }

                #[inline]
                fn take(mut rest: &[u8]) -> Option<Self> {
                    Some($name {
                        $($field: <$ty>::from_le_bytes(next(&mut rest)?),)+
                        $($list: List::take(&mut rest)?,)?
                    })
                }
            }
        )+

        /// The content of one frame.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Message {
            $($(#[doc = $doc])+ $name($name),)+
        }

        impl Message {
            /// Writes kind and fields; the length of both, bytes.
            #[inline]
            pub(crate) fn put(&self, out: &mut Put<'_>) -> usize {
                match self {
                    $(Message::$name(message) => message.put(out),)+
                }
            }

            /// Bytes before stuffing of a frame of this kind with these fields; nothing for a kind that is not in
            /// the table.
            #[inline]
            pub(crate) fn length(kind: u8, fields: &[u8]) -> Option<usize> {
                let _ = fields; // most have no list
                match kind {
                    $($kind => Some(
                        $name::LENGTH $(.wrapping_add(listed!($list List::claimed(fields, $name::LENGTH - AROUND - 1))))?
                    ),)+
                    _ => None,
                }
            }

            /// Reads the fields of a frame of this kind.
            #[inline]
            pub(crate) fn take(kind: u8, fields: &[u8]) -> Option<Message> {
                match kind {
                    $($kind => $name::take(fields).map(Message::$name),)+
                    _ => None,
                }
            }
        }

        /// The table: every message, its layout and its meaning.
        pub const TABLE: &[MessageInfo] = &[$(MessageInfo {
            name: stringify!($name),
            kind: $kind,
            direction: Direction::$direction,
            length: $name::LENGTH as u8,
            list: 0 $(+ listed!($list List::MOST as u8))?,
            doc: concat!($($doc),+),
            fields: {
                #[allow(unused_assignments, reason = "the last field's end starts no other field")]
                const FIELDS: &[FieldInfo] = {
                    let mut end = 1;
                    &[$({
                        let offset = end;
                        end += size_of::<$ty>() as u8;
                        FieldInfo {
                            name: stringify!($field),
                            ty: stringify!($ty),
                            offset,
                            unit: concat!("" $(, $unit)?),
                            doc: concat!($($field_doc),+),
                        }
                    },)+ $(FieldInfo {
                        name: stringify!($list),
                        ty: "[u32;8]",
                        offset: end,
                        unit: $list_unit,
                        doc: concat!($($list_doc),+),
                    })?]
                };
                FIELDS
            },
        }),+];

        /// The longest frame before stuffing, bytes.
        pub(crate) const LONGEST: usize = {
            let mut longest = 0;
            $(if $name::LONGEST > longest {
                longest = $name::LONGEST;
            })+
            longest
        };
    };
}

/// The code that only a message with a list has.
macro_rules! listed {
    ($list:ident $($what:tt)+) => {
        $($what)+
    };
}

messages! {
    /// Asks for the board's identity. Any state. The layout is the same in all versions.
    0x01 ToBoard Discover {
        /// Number that the answer echoes.
        nonce: u32,
        /// The host's version of the protocol.
        version: u8,
        /// The host's schema hash.
        schema: u64,
    }

    /// Prepares a run: period, watchdog and safe output. Starts the samples.
    0x02 ToBoard Configure {
        /// Number of the new run; other than that of the run before.
        run: u16,
        /// The host's hash of the scenario; the board stores and echoes it.
        config: u64,
        /// Time from sample to sample.
        period_us: u32 ["µs"],
        /// Longest time without an applied `Actuate` while armed or running.
        watchdog_us: u32 ["µs"],
        /// Way to the safe output: a `SafeKind`.
        safe_kind: u8,
        /// The code that holds.
        hold_code: u16 ["DAC code"],
        /// The code that releases.
        release_code: u16 ["DAC code"],
        /// Step of the ramp to `hold_code`.
        ramp_step: u32 ["2⁻¹⁶ DAC codes per period"],
        /// Time for which `HoldThenRelease` holds.
        hold_periods: u32 ["periods"],
    }

    /// Consent to the run that was configured.
    0x03 ToBoard Arm {
        /// The configured run.
        run: u16,
        /// The configured hash.
        config: u64,
        /// The number of the power-up that the board gave in its hello: who arms has heard the board.
        boot: u32,
    }

    /// A code for the converter, in answer to a sample.
    0x04 ToBoard Actuate {
        /// The configured run.
        run: u16,
        /// Sequence number of the sample it answers.
        sequence: u16,
        /// The code to put out.
        code: u16 ["DAC code"],
        /// Not applied if it arrives later than this after that sample was taken.
        valid_us: u16 ["µs"],
    }

    /// Ends the run: safe output.
    0x05 ToBoard Stop {
        /// The configured run.
        run: u16,
        /// Reason: a `StopReason`.
        reason: u8,
    }

    /// Asks for the board's time. Any state.
    0x06 ToBoard Ping {
        /// The host's run; the answer echoes it.
        run: u16,
        /// Number that the answer echoes.
        nonce: u32,
    }

    /// One setting of the run to come. For boards in the controller role: the loop then runs on them.
    0x07 ToBoard Set {
        /// Number of the run to come; the first setting of another run discards those before.
        run: u16,
        /// Number of the setting.
        key: u16,
        /// Its value: a whole number, or the bits of a real one of 32 bits.
        value: u64,
    }

    /// The board's identity, abilities and present state. Answers `Discover`.
    0x81 ToHost Hello {
        /// The nonce of `Discover`.
        nonce: u32,
        /// The board's version of the protocol.
        version: u8,
        /// The board's schema hash.
        schema: u64,
        /// The board's own serial number; 0 and 1 are simulated boards, and 0 one whose clock may wait.
        board: u32,
        /// Another number at each power-up, which cannot be guessed; `Arm` brings it back.
        boot: u32,
        /// Encoder counts per revolution, after quadrature.
        counts_per_rev: u32 ["counts per revolution"],
        /// Resolution of the converter.
        dac_bits: u8 ["bits"],
        /// Output at code 0.
        dac_lowest_mv: i32 ["mV"],
        /// Output one step above the highest code.
        dac_highest_mv: i32 ["mV"],
        /// Shortest period.
        period_min_us: u32 ["µs"],
        /// Longest period.
        period_max_us: u32 ["µs"],
        /// Longest watchdog time.
        watchdog_max_us: u32 ["µs"],
        /// The code put out from power-up to the first safe output or run.
        boot_code: u16 ["DAC code"],
        /// The reason why its program started: a `ResetCause`.
        started_by: u8,
        /// Conditions of the board that its owner should mend: bits.
        warnings: u8,
        /// The present state of the board: a `BoardState`.
        state: u8,
        /// The latched run; 0 if none since power-up.
        run: u16,
        /// The latched hash; 0 if none since power-up.
        config: u64,
    }

    /// The run is prepared; samples follow. Answers `Configure`.
    0x82 ToHost Configured {
        /// The run.
        run: u16,
        /// The hash.
        config: u64,
        /// As in `Hello`: the host sees a board that was reset in between.
        boot: u32,
    }

    /// The consent is taken. Answers `Arm`.
    0x83 ToHost Armed {
        /// The run.
        run: u16,
        /// The hash.
        config: u64,
    }

    /// A measurement, one each period.
    0x84 ToHost Sample {
        /// The run.
        run: u16,
        /// 0 after `Configure`, then one more each period; wraps.
        sequence: u16,
        /// Time of the measurement, by the board's clock; wraps.
        time_us: u32 ["µs"],
        /// The encoder's counter; wraps.
        counts: i32 ["counts"],
        /// `BoardState` and flags.
        status: u8,
    }

    /// The board went to its safe output by itself.
    0x85 ToHost Fault {
        /// The run.
        run: u16,
        /// Sequence number of the newest sample.
        sequence: u16,
        /// Time of the fault, by the board's clock.
        time_us: u32 ["µs"],
        /// Cause: a `BoardFault`.
        cause: u8,
        /// Detail of the cause.
        value: u32,
    }

    /// The run is over. Answers `Stop`.
    0x86 ToHost Stopped {
        /// The run.
        run: u16,
        /// The reason of `Stop`.
        reason: u8,
        /// The code that is put out now.
        code: u16 ["DAC code"],
    }

    /// The board's time. Answers `Ping`.
    0x87 ToHost Pong {
        /// The run of `Ping`.
        run: u16,
        /// The nonce of `Ping`.
        nonce: u32,
        /// Time at which `Ping` was taken, by the board's clock.
        time_us: u32 ["µs"],
    }

    /// The board refuses a frame. The layout is the same in all versions.
    0x88 ToHost Refused {
        /// Kind of the frame that is refused.
        request: u8,
        /// Reason: a `Refusal`.
        reason: u8,
        /// Detail of the reason.
        value: u32,
    }

    /// A board in the controller role. Answers `Discover`; the `Hello` of the board that it drives follows.
    0x89 ToHost ControllerHello {
        /// The nonce of `Discover`.
        nonce: u32,
        /// The board's version of the protocol.
        version: u8,
        /// The board's schema hash.
        schema: u64,
        /// The board's hash of its table of settings.
        settings: u64,
        /// The board's own serial number; 0 and 1 are emulated boards.
        board: u32,
        /// Another number at each power-up, which cannot be guessed; `Arm` brings it back.
        boot: u32,
        /// Frequency of `Telemetry.cycles`; 0 if it counts nothing.
        clock_hz: u32 ["Hz"],
        /// Points that a path given as a table may have.
        knots: u16,
        /// State of control: the supervisor's state.
        state: u8,
        /// The latched run; 0 if none since power-up.
        run: u16,
        /// The latched hash; 0 if none since power-up.
        config: u64,
    }

    /// The setting is taken. Answers `Set`.
    0x8A ToHost Taken {
        /// The run.
        run: u16,
        /// The setting.
        key: u16,
        /// The value, as it was taken.
        value: u64,
    }

    /// A sample after consent, and the controller's result for it. Real numbers are sent as their 32 bits.
    0x8B ToHost Telemetry {
        /// The run.
        run: u16,
        /// One more with each frame of this kind; wraps. A gap is lost telemetry.
        number: u16,
        /// The run's tick, low half.
        tick: u32,
        /// Sequence number of the sample.
        sequence: u16,
        /// Time of the sample.
        time_us: u32 ["µs"],
        /// Counts of the sample.
        counts: i32 ["counts"],
        /// Status of the sample: `BoardState` and flags.
        status: u8,
        /// The controller's findings: bits.
        flags: u8,
        /// Arrival of the sample: the supervisor's number for it.
        arrival: u8,
        /// The supervisor's state after it (high half) and before it (low half).
        states: u8,
        /// Cause of the end of control, if it has ended: the supervisor's number for it.
        cause: u8,
        /// Value that the check that ended control saw.
        value: u32 ["bits"],
        /// Time that the answer before took.
        lateness_us: u32 ["µs"],
        /// The error.
        error: u32 ["bits, rad"],
        /// Its rate.
        error_rate: u32 ["bits, rad/s"],
        /// The law's voltage within its limits.
        demand: u32 ["bits, V"],
        /// Code given to the converter.
        code: u16 ["DAC code"],
        /// Clock cycles of the tick before: see `ControllerHello.clock_hz`.
        cycles: u32 ["clock cycles"],
    }
    then
        /// The law's terms: how many, and each.
        terms ["bits"]

    /// Control has ended, but not by a sample.
    0x8C ToHost Ended {
        /// The run.
        run: u16,
        /// The run's tick, low half.
        tick: u32,
        /// The supervisor's state after it (high half) and before it (low half).
        states: u8,
        /// Cause: the supervisor's number for it.
        cause: u8,
        /// Value that the check saw.
        value: u32 ["bits"],
    }

    /// Counters of the controller's own line; each second, and at each end.
    0x8D ToHost Link {
        /// The run.
        run: u16,
        /// Samples of the run.
        received: u32,
        /// Samples lost.
        lost: u32,
        /// Samples that a newer one had overtaken.
        late: u32,
        /// Samples that came twice.
        duplicated: u32,
        /// Samples that came after a newer one.
        reordered: u32,
        /// Frames that were not whole.
        bad_frames: u32,
        /// Samples that were not believed.
        rejected: u32,
        /// Answers later than the deadline.
        deadline_misses: u32,
        /// Frames to the host for which there was no room.
        dropped: u32,
    }
}

/// A hexadecimal digit, lower case.
const fn digit(value: u8) -> u8 {
    if value < 10 { b'0'.wrapping_add(value) } else { b'a'.wrapping_add(value.wrapping_sub(10)) }
}

/// FNV-1a (64 bit) over the canonical text of [`TABLE`]: a line per message in order, of its kind
/// as two hexadecimal digits, its name, and `name:type` of each field, with one space between and
/// a line feed at the end.
///
/// The line of `Ping`, for one: `06 Ping run:u16 nonce:u32`. Two ends with the same hash agree on
/// every byte of every frame.
pub const SCHEMA: u64 = {
    let mut hash = FNV_64;
    let mut table = TABLE;
    while let [message, others @ ..] = table {
        hash = fnv1a_64(hash, &[digit(message.kind >> 4), digit(message.kind & 15), b' ']);
        hash = fnv1a_64(hash, message.name.as_bytes());
        let mut fields = message.fields;
        while let [field, rest @ ..] = fields {
            hash = fnv1a_64(hash, b" ");
            hash = fnv1a_64(hash, field.name.as_bytes());
            hash = fnv1a_64(hash, b":");
            hash = fnv1a_64(hash, field.ty.as_bytes());
            fields = rest;
        }
        hash = fnv1a_64(hash, b"\n");
        table = others;
    }
    hash
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_that_is_not_in_the_table_is_no_message() {
        let kinds = (0..=u8::MAX).filter(|kind| TABLE.iter().all(|message| message.kind != *kind));
        for kind in kinds {
            assert_eq!((Message::length(kind, &[0; 64]), Message::take(kind, &[0; 64])), (None, None));
        }
    }

    #[test]
    fn the_schema_writes_kinds_in_hexadecimal() {
        assert_eq!([0, 9, 10, 15].map(digit), *b"09af");
    }
}
