//! The records: each field is written down once, here, with its number in the log, its type and its meaning. From
//! the table come the record, its protobuf message, the way from one to the other, the channel table of docs/log.md
//! and the columns of Python.

use crate::channel::{Channel, Field, Kind, Value};
use crate::names::{self, EventKind};
use crate::values::{of_law, position, source};
use clutch_core::supervisor::Cycle;
use clutch_core::{Dac, FixedCounts, Real, law};
use clutch_node::{CycleNotice, Ending, LinkCounts, Standing};
use prost::Message;

pub use clutch_core::law::MAX_TERMS;

/// Terms of a law: up to [`MAX_TERMS`], without an allocation. Terms beyond them are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    values: [f64; MAX_TERMS],
    count: u8,
}

impl FromIterator<f64> for Terms {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Terms {
        let mut all = Terms::default();
        for (to, term) in all.values.iter_mut().zip(terms) {
            *to = term;
            all.count += 1;
        }
        all
    }
}

impl std::ops::Deref for Terms {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[..usize::from(self.count)]
    }
}

/// A value of a record's field, and how a message has it.
trait Stored: Sized {
    type Message;
    fn put(self) -> Self::Message;
    /// An error in words if the record's type cannot hold it.
    fn take(field: &str, message: Self::Message) -> Result<Self, String>;
    fn value(self) -> Value;
}

macro_rules! stored {
    ($($whole:ty => $message:ty),*) => { $(impl Stored for $whole {
        type Message = $message;
        fn put(self) -> $message { self.into() }
        fn take(field: &str, message: $message) -> Result<Self, String> {
            let bits = 8 * size_of::<Self>();
            Self::try_from(message).map_err(|_| format!("{field} = {message}: expected at most {bits} bits"))
        }
        fn value(self) -> Value { Value::Whole(self as i64) }
    })* };
}
stored!(u8 => u32, u16 => u32, u32 => u32, u64 => u64, i32 => i32, i64 => i64);

impl Stored for f64 {
    // The encoder would leave out 0.0, and −0.0 with it, which would come back as +0.0. The schema says plain
    // `double`: there a zero may be written, and what is absent is zero, as for any reader of proto3.
    type Message = Option<f64>;
    fn put(self) -> Option<f64> {
        Some(self)
    }
    fn take(_: &str, message: Option<f64>) -> Result<f64, String> {
        Ok(message.unwrap_or_default())
    }
    fn value(self) -> Value {
        Value::Real(self)
    }
}

impl Stored for bool {
    type Message = bool;
    fn put(self) -> bool {
        self
    }
    fn take(_: &str, message: bool) -> Result<bool, String> {
        Ok(message)
    }
    fn value(self) -> Value {
        Value::Flag(self)
    }
}

/// A record that has a channel of its own.
pub trait InChannel {
    /// The channel.
    const CHANNEL: Channel;
    /// Time since the start of the run, ns.
    fn time_ns(&self) -> u64;
    /// The values of [`Channel::fields`]; of the terms only those that the record's law has.
    fn values(&self) -> impl Iterator<Item = Value>;
}

/// The type of a field, in the schema.
macro_rules! kind {
    (uint32) => {
        Kind::Uint32
    };
    (uint64) => {
        Kind::Uint64
    };
    (sint32) => {
        Kind::Sint32
    };
    (sint64) => {
        Kind::Sint64
    };
    (double) => {
        Kind::Double
    };
    (bool) => {
        Kind::Bool
    };
    (string) => {
        Kind::String
    };
    (uint32, $name:literal $names:path) => {
        Kind::Enum($name, $names)
    };
}

/// The function that makes a record of what there is in a run, if its table says of what.
macro_rules! made {
    ($record:ident {} $($rest:tt)*) => {};
    ($record:ident {(
        [$($of:tt)*] ($($arg:ident: $type:ty),*) at ($tick:expr, $time_ns:expr)
    )} $($field:ident {$($value:expr)?})*) => {
        impl $record {
            /// Made of what there is in a run, at its time, ns; what is not known there is 0.
            #[must_use]
            #[allow(clippy::needless_update, reason = "of some records all is known")]
            pub fn of<$($of)*>($($arg: $type),*) -> $record {
                $record {
                    tick: $tick,
                    time_ns: $time_ns,
                    $($($field: $value,)?)*
                    ..$record::default()
                }
            }
        }
    };
}

/// The table. A row is: meaning; number in the message, name in the log, field of the record, its type, protobuf's type
/// (for the encoder an `optional` one keeps each zero); of a small number its enum's name and the names of the values; its
/// value in a run, where the head says of what the record is made. Below the rows are the numbers and names of the law's
/// terms, if the record has them.
macro_rules! records {
    ($(
        $(#[doc = $doc:literal])*
        $variant:ident = $record:ident, $topic:literal, $content:literal $(of $of:tt)? {
            $(
                #[doc = $meaning:literal]
                $tag:tt $name:ident = $field:ident: $type:ty, $proto:ident $(($optional:ident))?
                    $(of $enum:literal $names:path)? $(, $value:expr)?;
            )*
            $($terms:ident ($terms_value:expr) { $(#[doc = $term_meaning:literal] $term_tag:tt $term:ident;)* })?
        }
    )*) => {
        /// One record, without heap: it goes through the ring from the control thread.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Record {
            $($(#[doc = $doc])* $variant($record)),*
        }

        impl Record {
            /// Tick of the run, from 0.
            #[must_use]
            pub fn tick(&self) -> u64 {
                match self { $(Record::$variant(r) => r.tick),* }
            }

            /// Time since the start of the run, ns.
            #[must_use]
            pub fn time_ns(&self) -> u64 {
                match self { $(Record::$variant(r) => r.time_ns),* }
            }
        }

        /// The channels that hold records, in the order of the table.
        pub(crate) const RECORDS: [Channel; [$($topic),*].len()] = [$($record::CHANNEL),*];

        /// Row of the record's channel in [`CHANNELS`](crate::CHANNELS).
        #[must_use]
        pub fn channel_of(record: &Record) -> usize {
            enum Row { $($variant),* }
            match record { $(Record::$variant(_) => Row::$variant as usize),* }
        }

        /// Appends the record's message, as it stands in the log without the envelope (tick and time
        /// are in the envelope's `sequence` and `log_time`, too).
        pub fn encode(record: &Record, out: &mut Vec<u8>) {
            out.reserve(240); // the longest message has 21 fields: no second allocation
            let done = match record { $(Record::$variant(r) => message::$variant::of(r).encode(out)),* };
            debug_assert!(done.is_ok(), "a Vec grows: encoding into it cannot fail");
        }

        /// The record in a message of the channel in row `channel` of [`RECORDS`].
        pub(crate) fn decode(channel: usize, time_ns: u64, data: &[u8]) -> Result<Record, String> {
            type Decode = fn(u64, &[u8]) -> Result<Record, String>;
            const DECODE: [Decode; RECORDS.len()] = [$(|time_ns, data| {
                let message = message::$variant::decode(data).map_err(|e| e.to_string())?;
                message.record(time_ns).map(Record::$variant)
            }),*];
            DECODE.get(channel).ok_or_else(|| format!("channel {channel} holds no records"))?(time_ns, data)
        }

        $(
            $(#[doc = $doc])*
            #[derive(Clone, Copy, Debug, Default, PartialEq)]
            pub struct $record {
                /// Tick of the run, from 0.
                pub tick: u64,
                /// Time since the start of the run, ns.
                pub time_ns: u64,
                $(
                    #[doc = $meaning]
                    $(#[doc = concat!("The number of one of [`", stringify!($names), "`](crate::", stringify!($names), ").")])?
                    pub $field: $type,
                )*
                $(
                    /// The law's own terms; [`Header::term_names`](crate::Header::term_names) names them.
                    pub $terms: Terms,
                )?
            }

            made!($record {$($of)?} $($field {$($value)?})* $($terms {$terms_value})?);

            impl InChannel for $record {
                const CHANNEL: Channel = Channel {
                    topic: $topic,
                    message: concat!("clutch.", stringify!($variant)),
                    meaning: $content,
                    fields: &[
                        Field { number: 1, name: "tick", kind: Kind::Uint64, meaning: "Tick of the run, from 0." },
                        $(Field {
                            number: $tag,
                            name: stringify!($name),
                            kind: kind!($proto $(, $enum $names)?),
                            meaning: $meaning.trim_ascii(),
                        },)*
                        $($(Field {
                            number: $term_tag,
                            name: stringify!($term),
                            kind: Kind::Double,
                            meaning: $term_meaning.trim_ascii(),
                        },)*)?
                    ],
                    terms: 0 $(+ [$($term_tag),*].len())?,
                };

                fn time_ns(&self) -> u64 {
                    self.time_ns
                }

                fn values(&self) -> impl Iterator<Item = Value> {
                    let values = [self.tick.value(), $(self.$field.value()),*].into_iter();
                    $(let values = values.chain(self.$terms.iter().map(|term| term.value()));)?
                    values
                }
            }
        )*

        /// Protobuf's messages.
        mod message {
            use super::*;

            $(
                #[derive(Clone, PartialEq, Message)]
                pub(super) struct $variant {
                    #[prost(uint64, tag = 1)]
                    tick: u64,
                    $(
                        #[prost($proto $(, $optional)?, tag = $tag)]
                        $name: <$type as Stored>::Message,
                    )*
                    $($(#[prost(double, optional, tag = $term_tag)] $term: Option<f64>,)*)?
                }

                impl $variant {
                    pub(super) fn of(r: &$record) -> $variant {
                        $(let [$($term),*] = std::array::from_fn(|i| r.$terms.get(i).copied());)?
                        $variant { tick: r.tick, $($name: r.$field.put(),)* $($($term),*)? }
                    }

                    pub(super) fn record(self, time_ns: u64) -> Result<$record, String> {
                        Ok($record {
                            tick: self.tick,
                            time_ns,
                            $($field: Stored::take(stringify!($name), self.$name)?,)*
                            $($terms: [$(self.$term),*].into_iter().map_while(|term| term).collect(),)?
                        })
                    }
                }
            )*
        }
    };
}

records! {
    /// A measurement as it came from the board.
    Sample = SampleRecord, "/sample", "The measurement of a tick, or its absence."
        of ([T: Real, X](n: &CycleNotice<T, X>, time_ns: u64, age_us: u32, wake_us: u32, radians_per_count: f64)
            at (n.cycle.tick, time_ns))
    {
        /// Arrival of the sample.
        2 arrival = arrival: u8, uint32 of "Arrival" names::ARRIVALS, n.cycle.arrival as u8;
        /// The board's sequence number, wraps at 2^16.
        3 sequence = sequence: u16, uint32, n.sample.sequence;
        /// The board's clock at the measurement, µs, wraps at 2^32.
        4 board_time_us = board_time_us: u32, uint32, n.sample.time_us;
        /// Encoder counts, wrap at 2^32.
        5 counts = counts: i32, sint32, n.sample.counts;
        /// The board's status bits.
        6 status = status: u8, uint32, n.sample.status;
        /// Age of the sample when it was used, µs.
        7 age_us = age_us: u32, uint32, age_us;
        /// Time that the answer to the sample before took, µs.
        8 lateness_us = lateness_us: u32, uint32, n.lateness.0;
        /// A newer sample had come with it; not answered.
        9 superseded = superseded: bool, bool, n.superseded;
        /// Lateness of the wake-up that brought it, µs; 0 where it is not known.
        10 wake_us = wake_us: u32, uint32, wake_us;
        /// Position that the counts show, on the target's turn of the counter, rad.
        11 position_rad = position: f64, double (optional),
            position(n.sample.counts, n.cycle.target.position, radians_per_count);
    }
    /// A command, with the values that led the law to it.
    Command = CommandRecord, "/command", "The command of a tick, with every term of the law."
        of ([T: Real, X: law::Terms<T>](cycle: &Cycle<T, X>, time_ns: u64, dac: &Dac<T>, radians_per_count: f64)
            at (cycle.tick, time_ns))
    {
        /// State of the supervisor.
        2 state = state: u8, uint32 of "State" names::STATES, cycle.state as u8;
        /// Origin of the code.
        3 source = source: u8, uint32 of "Source" names::COMMAND_SOURCES, source(cycle) as u8;
        /// Effect of the output stage on the demand.
        4 limit = limit: u8, uint32 of "Limit" names::LIMITS,
            cycle.output.as_ref().map_or(0, |out| out.command.limit as u8);
        /// Code for the converter.
        5 code = code: u16, uint32, cycle.code.0;
        /// Voltage of the code, V.
        6 voltage_v = voltage: f64, double (optional), dac.volts(cycle.code).to_f64();
        /// Voltage that the law asks for within its limits, before converter and supervisor, V.
        7 demand_v = demand: f64, double (optional), of_law(cycle, |out| out.command.voltage);
        /// Target position, 2^-16 counts.
        8 target_counts_x65536 = target_fixed: i64, sint64, cycle.target.position.0;
        /// Target position, rad.
        9 target_position_rad = target_position: f64, double (optional),
            cycle.target.position.minus::<f64>(FixedCounts(0)) * radians_per_count;
        /// Target velocity, rad/s.
        10 target_velocity_rad_s = target_velocity: f64, double (optional), cycle.target.velocity.to_f64();
        /// Target acceleration, rad/s².
        11 target_acceleration_rad_s2 = target_acceleration: f64, double (optional),
            cycle.target.acceleration.to_f64();
        /// Position error as the law saw it, rad.
        12 error_rad = error: f64, double (optional), of_law(cycle, |out| out.tick.error);
        /// Rate of the error as the law saw it, rad/s.
        13 error_rate_rad_s = error_rate: f64, double (optional), of_law(cycle, |out| out.tick.error_rate);
        terms (cycle.output.iter().flat_map(|out| out.command.terms.values()).map(|term| term.to_f64()).collect()) {
            /// The law's first term; the file has the law's name for it, and as many terms as the law.
            14 term_0;
            /// The law's second term, likewise.
            15 term_1;
            /// The law's third term, likewise.
            16 term_2;
            /// The law's fourth term, likewise.
            17 term_3;
            /// The law's fifth term, likewise.
            18 term_4;
            /// The law's sixth term, likewise.
            19 term_5;
            /// The law's seventh term, likewise.
            20 term_6;
            /// The law's eighth term, likewise.
            21 term_7;
        }
    }
    /// A report of the supervisor, the gate, the log or the port.
    Event = EventRecord, "/event", "A report of the supervisor, the gate, the log or the port."
        of ([T: Real](kind: EventKind, e: &Ending<T>, time_ns: u64) at (e.tick, time_ns))
    {
        /// Kind of event.
        2 kind = kind: u8, uint32 of "Kind" names::EVENT_KINDS, kind as u8;
        /// State before.
        3 from_state = from: u8, uint32 of "State" names::STATES, e.from as u8;
        /// State after.
        4 to_state = to: u8, uint32 of "State" names::STATES, e.state as u8;
        /// Cause of the event.
        5 cause = cause: u8, uint32 of "Cause" names::CAUSES, e.cause as u8;
        /// Value that the check saw, in the check's unit.
        6 value = value: f64, double (optional), e.value.to_f64();
    }
    /// Counters of the link, since the start of the run.
    Link = LinkRecord, "/link", "Counters since the start of the run."
        of ([T](counts: &LinkCounts, standing: &Standing<T>, time_ns: u64, log_dropped: u64) at (standing.tick, time_ns))
    {
        /// Samples received.
        2 received = received: u64, uint64, counts.received;
        /// Samples that never came.
        3 lost = lost: u64, uint64, standing.lost;
        /// Samples after their deadline.
        4 late = late: u64, uint64, counts.late;
        /// Samples that came twice.
        5 duplicated = duplicated: u64, uint64, counts.duplicated;
        /// Samples that came after a newer one.
        6 reordered = reordered: u64, uint64, counts.reordered;
        /// Frames with a wrong checksum, length or type.
        7 rejected_frames = rejected_frames: u64, uint64, counts.bad_frames;
        /// Samples refused by the plausibility gate.
        8 rejected_samples = rejected_samples: u64, uint64, standing.rejected;
        /// Cycles that ended after their deadline.
        9 deadline_misses = deadline_misses: u64, uint64, standing.deadline_misses;
        /// Records that the full ring dropped.
        10 log_dropped = log_dropped: u64, uint64, log_dropped;
    }
    /// A parameter that was changed while the loop ran.
    Change = ChangeRecord, "/change", "A parameter that was changed while the loop ran." {
        /// Number of the parameter in the file's list of parameters, from 0.
        2 parameter = parameter: u16, uint32;
        /// Its value from this tick on.
        3 value = value: f64, double (optional);
        /// Bound on the error of the sampled loop with it, rad; NaN of one without a certificate.
        4 error_bound_rad = error_bound: f64, double (optional);
    }
    /// The plant's true state, which only a simulation knows.
    Truth = TruthRecord, "/truth", "The plant's true state, which only a simulation knows." {
        /// Angle of the shaft, rad.
        2 position_rad = position: f64, double (optional);
        /// Its velocity, rad/s.
        3 velocity_rad_s = velocity: f64, double (optional);
        /// Held by static friction.
        4 stuck = stuck: bool, bool;
    }
}
