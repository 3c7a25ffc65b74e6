//! The channel table: topics, protobuf messages, their fields, and the way to records and back.

use crate::names::{self, Names};
use crate::record::{CommandRecord, EventRecord, LinkRecord, MAX_TERMS, Record, SampleRecord, TruthRecord};
use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
};
use std::fmt::Write as _;

/// A field of a message, as viewers show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its number on the wire; never used for anything else later.
    pub number: i32,
    /// Its name, with the unit at the end.
    pub name: &'static str,
    /// Its protobuf type.
    pub kind: Kind,
    /// Its meaning.
    pub meaning: &'static str,
}

/// Protobuf type of a [`Field`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `uint32`
    Uint32,
    /// `uint64`
    Uint64,
    /// `sint32`
    Sint32,
    /// `sint64`
    Sint64,
    /// `double`
    Double,
    /// `bool`
    Bool,
    /// `string`
    String,
    /// An enum inside the message: its name and its values.
    Enum(&'static str, Names),
}

impl Kind {
    /// As in a `.proto` file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Kind::Uint32 => "uint32",
            Kind::Uint64 => "uint64",
            Kind::Sint32 => "sint32",
            Kind::Sint64 => "sint64",
            Kind::Double => "double",
            Kind::Bool => "bool",
            Kind::String => "string",
            Kind::Enum(name, _) => name,
        }
    }
}

/// A channel: topic, message, fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Topic: `/sample`.
    pub topic: &'static str,
    /// Protobuf message: `clutch.Sample`.
    pub message: &'static str,
    /// Its content, and its rate.
    pub meaning: &'static str,
    /// Its fields.
    pub fields: &'static [Field],
}

/// A message and its rows of the table, from one list, so that the two cannot disagree.
macro_rules! message {
    ($name:ident, $fields:ident { $($tag:tt $field:ident: $rust:ty, ($($attr:tt)*), $kind:expr, $meaning:literal;)* }) => {
        #[derive(Clone, PartialEq, Message)]
        pub(crate) struct $name {
            $(#[prost($($attr)*, tag = $tag)] pub(crate) $field: $rust,)*
        }
        const $fields: &[Field] =
            &[$(Field { number: $tag, name: stringify!($field), kind: $kind, meaning: $meaning }),*];
    };
}

// Doubles are `optional` for the encoder: it would leave out 0.0, and −0.0 with it, which would
// come back as +0.0. The schema says plain `double`; a zero on the wire is valid there.
message!(Sample, SAMPLE {
    1 tick: u64, (uint64), Kind::Uint64, "tick of the run, from 0";
    2 arrival: u32, (uint32), Kind::Enum("Arrival", names::ARRIVALS), "arrival of the sample";
    3 sequence: u32, (uint32), Kind::Uint32, "the board's sequence number, wraps at 2^16";
    4 board_time_us: u32, (uint32), Kind::Uint32, "the board's clock at the measurement, µs, wraps at 2^32";
    5 counts: i32, (sint32), Kind::Sint32, "encoder counts, wrap at 2^32";
    6 status: u32, (uint32), Kind::Uint32, "the board's status bits";
    7 age_us: u32, (uint32), Kind::Uint32, "age of the sample when it was used, µs";
    8 lateness_us: u32, (uint32), Kind::Uint32, "time that the answer to the sample before took, µs";
    9 superseded: bool, (bool), Kind::Bool, "a newer sample had come with it; not answered";
});

message!(Command, COMMAND {
    1 tick: u64, (uint64), Kind::Uint64, "tick of the run, from 0";
    2 state: u32, (uint32), Kind::Enum("State", names::STATES), "state of the supervisor";
    3 source: u32, (uint32), Kind::Enum("Source", names::COMMAND_SOURCES), "origin of the code";
    4 limit: u32, (uint32), Kind::Enum("Limit", names::LIMITS), "effect of the output stage on the demand";
    5 code: u32, (uint32), Kind::Uint32, "code for the converter";
    6 voltage_v: Option<f64>, (double, optional), Kind::Double, "voltage of the code, V";
    7 demand_v: Option<f64>, (double, optional), Kind::Double, "the law's output before limits, V";
    8 target_counts_x65536: i64, (sint64), Kind::Sint64, "target position, 2^-16 counts";
    9 target_position_rad: Option<f64>, (double, optional), Kind::Double, "target position, rad";
    10 target_velocity_rad_s: Option<f64>, (double, optional), Kind::Double, "target velocity, rad/s";
    11 target_acceleration_rad_s2: Option<f64>, (double, optional), Kind::Double, "target acceleration, rad/s²";
    12 error_rad: Option<f64>, (double, optional), Kind::Double, "position error as the law saw it, rad";
    13 error_rate_rad_s: Option<f64>, (double, optional), Kind::Double, "its rate as the law saw it, rad/s";
    14 term_0: Option<f64>, (double, optional), Kind::Double, "the law's first term; the file has the law's name for it, and as many terms as the law";
    15 term_1: Option<f64>, (double, optional), Kind::Double, "the law's second term, likewise";
    16 term_2: Option<f64>, (double, optional), Kind::Double, "the law's third term, likewise";
    17 term_3: Option<f64>, (double, optional), Kind::Double, "the law's fourth term, likewise";
    18 term_4: Option<f64>, (double, optional), Kind::Double, "the law's fifth term, likewise";
    19 term_5: Option<f64>, (double, optional), Kind::Double, "the law's sixth term, likewise";
    20 term_6: Option<f64>, (double, optional), Kind::Double, "the law's seventh term, likewise";
    21 term_7: Option<f64>, (double, optional), Kind::Double, "the law's eighth term, likewise";
});

message!(Event, EVENT {
    1 tick: u64, (uint64), Kind::Uint64, "tick of the run, from 0";
    2 kind: u32, (uint32), Kind::Enum("Kind", names::EVENT_KINDS), "kind of event";
    3 from_state: u32, (uint32), Kind::Enum("State", names::STATES), "state before";
    4 to_state: u32, (uint32), Kind::Enum("State", names::STATES), "state after";
    5 cause: u32, (uint32), Kind::Enum("Cause", names::CAUSES), "why";
    6 value: Option<f64>, (double, optional), Kind::Double, "value that the check saw, in the check's unit";
});

message!(Link, LINK {
    1 tick: u64, (uint64), Kind::Uint64, "tick of the run, from 0";
    2 received: u64, (uint64), Kind::Uint64, "samples received";
    3 lost: u64, (uint64), Kind::Uint64, "samples that never came";
    4 late: u64, (uint64), Kind::Uint64, "samples after their deadline";
    5 duplicated: u64, (uint64), Kind::Uint64, "samples that came twice";
    6 reordered: u64, (uint64), Kind::Uint64, "samples that came after a newer one";
    7 rejected_frames: u64, (uint64), Kind::Uint64, "frames with a wrong checksum, length or type";
    8 rejected_samples: u64, (uint64), Kind::Uint64, "samples refused by the plausibility gate";
    9 deadline_misses: u64, (uint64), Kind::Uint64, "cycles that ended after their deadline";
    10 log_dropped: u64, (uint64), Kind::Uint64, "records that the full ring dropped";
});

message!(Truth, TRUTH {
    1 tick: u64, (uint64), Kind::Uint64, "tick of the run, from 0";
    2 position_rad: Option<f64>, (double, optional), Kind::Double, "angle of the shaft, rad";
    3 velocity_rad_s: Option<f64>, (double, optional), Kind::Double, "its velocity, rad/s";
    4 stuck: bool, (bool), Kind::Bool, "held by static friction";
});

message!(Parameter, PARAMETER {
    1 key: String, (string), Kind::String, "name, as in the scenario file: `law.kp`";
    2 value: String, (string), Kind::String, "value, as in the scenario file";
});

/// The channel table.
pub const CHANNELS: [Channel; 6] = [
    Channel {
        topic: "/sample",
        message: "clutch.Sample",
        meaning: "The measurement of a tick, or its absence.",
        fields: SAMPLE,
    },
    Channel {
        topic: "/command",
        message: "clutch.Command",
        meaning: "The command of a tick, with every term of the law.",
        fields: COMMAND,
    },
    Channel {
        topic: "/event",
        message: "clutch.Event",
        meaning: "A report of the supervisor, the gate, the log or the port.",
        fields: EVENT,
    },
    Channel {
        topic: "/link",
        message: "clutch.Link",
        meaning: "Counters since the start of the run.",
        fields: LINK,
    },
    Channel {
        topic: "/truth",
        message: "clutch.Truth",
        meaning: "The plant's true state, which only a simulation knows.",
        fields: TRUTH,
    },
    Channel {
        topic: "/parameters",
        message: "clutch.Parameter",
        meaning: "Every parameter, once at the start, a message each.",
        fields: PARAMETER,
    },
];

/// Row of `/command` in [`CHANNELS`].
pub(crate) const COMMAND_CHANNEL: usize = 1;
/// Row of `/parameters` in [`CHANNELS`].
pub(crate) const PARAMETER_CHANNEL: usize = 5;

/// Row of the record's channel in [`CHANNELS`].
pub(crate) fn channel_of(record: &Record) -> usize {
    match record {
        Record::Sample(_) => 0,
        Record::Command(_) => COMMAND_CHANNEL,
        Record::Event(_) => 2,
        Record::Link(_) => 3,
        Record::Truth(_) => 4,
    }
}

/// The channel table in Markdown, as it stands in `docs/log.md`.
#[must_use]
pub fn channel_table() -> String {
    let mut text = String::new();
    for channel in &CHANNELS {
        // Writing to a String cannot fail.
        let _ = write!(text, "### `{}`: {}\n\n{}\n\n", channel.topic, channel.message, channel.meaning);
        text += "| no. | field | type | meaning, unit |\n|---|---|---|---|\n";
        for f in channel.fields {
            let _ = writeln!(text, "| {} | `{}` | {} | {} |", f.number, f.name, f.kind.name(), f.meaning);
        }
        let mut shown = Vec::new();
        for f in channel.fields {
            if let Kind::Enum(name, values) = f.kind
                && !shown.contains(&name)
            {
                shown.push(name);
                let values: Vec<_> =
                    values.iter().map(|(number, value)| format!("{number} {value}")).collect();
                let _ = write!(text, "\n{name}: {}.\n", values.join(", "));
            }
        }
        text.push('\n');
    }
    text
}

/// The schema of a channel: a `FileDescriptorSet`. `terms` name the last fields of `/command`, which has as many.
pub(crate) fn schema(channel: &Channel, terms: &[String]) -> Vec<u8> {
    let short = channel.message.trim_start_matches("clutch.");
    let mut names: Vec<String> = channel.fields.iter().map(|f| f.name.to_owned()).collect();
    if channel.fields == COMMAND {
        let first = names.len() - MAX_TERMS;
        names.truncate(first + terms.len());
        for (i, term) in terms.iter().enumerate() {
            let mut name = field_name(term, i);
            // Two fields of one name would make the whole schema invalid.
            while names.iter().enumerate().any(|(j, other)| j != first + i && *other == name) {
                name = format!("{name}_{i}");
            }
            names[first + i] = name;
        }
    }
    let mut enums: Vec<EnumDescriptorProto> = Vec::new();
    let mut field = Vec::new();
    for (f, name) in channel.fields.iter().zip(names) {
        let (kind, type_name) = match f.kind {
            Kind::Uint32 => (Type::Uint32, None),
            Kind::Uint64 => (Type::Uint64, None),
            Kind::Sint32 => (Type::Sint32, None),
            Kind::Sint64 => (Type::Sint64, None),
            Kind::Double => (Type::Double, None),
            Kind::Bool => (Type::Bool, None),
            Kind::String => (Type::String, None),
            Kind::Enum(enum_name, values) => {
                if !enums.iter().any(|e| e.name() == enum_name) {
                    enums.push(EnumDescriptorProto {
                        name: Some(enum_name.into()),
                        value: values
                            .iter()
                            .map(|(number, value)| EnumValueDescriptorProto {
                                name: Some((*value).into()),
                                number: Some(i32::from(*number)),
                                options: None,
                            })
                            .collect(),
                        ..EnumDescriptorProto::default()
                    });
                }
                (Type::Enum, Some(format!(".{}.{enum_name}", channel.message)))
            }
        };
        field.push(FieldDescriptorProto {
            json_name: Some(name.clone()), // otherwise JSON would show errorRateRadS
            name: Some(name),
            number: Some(f.number),
            label: Some(Label::Optional as i32),
            r#type: Some(kind as i32),
            type_name,
            ..FieldDescriptorProto::default()
        });
    }
    let file = FileDescriptorProto {
        name: Some(format!("clutch/{}.proto", short.to_lowercase())),
        package: Some("clutch".into()),
        message_type: vec![DescriptorProto {
            name: Some(short.into()),
            field,
            enum_type: enums,
            ..DescriptorProto::default()
        }],
        syntax: Some("proto3".into()),
        ..FileDescriptorProto::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

/// `term` with nothing but `a-z`, `0-9` and `_`, as a field's name must be.
fn field_name(term: &str, index: usize) -> String {
    let name: String = term
        .trim()
        .chars()
        .map(|c| c.to_ascii_lowercase())
        .map(|c| if c.is_ascii_lowercase() || c.is_ascii_digit() { c } else { '_' })
        .collect();
    match name.chars().next() {
        _ if name.chars().all(|c| c == '_') => format!("term_{index}"),
        Some('a'..='z') => name,
        _ => format!("term_{name}"),
    }
}

/// Appends the record's message, as it stands in the log without the envelope (tick and time
/// are in the envelope's `sequence` and `log_time`, too).
pub fn encode(record: &Record, out: &mut Vec<u8>) {
    out.reserve(240); // the longest message has 21 fields: no second allocation
    let done = match record {
        Record::Sample(r) => Sample {
            tick: r.tick,
            arrival: r.arrival.into(),
            sequence: r.sequence.into(),
            board_time_us: r.board_time_us,
            counts: r.counts,
            status: r.status.into(),
            age_us: r.age_us,
            lateness_us: r.lateness_us,
            superseded: r.superseded,
        }
        .encode(out),
        Record::Command(r) => {
            let [term_0, term_1, term_2, term_3, term_4, term_5, term_6, term_7] =
                std::array::from_fn(|i| r.terms.get(i).copied());
            Command {
                tick: r.tick,
                state: r.state.into(),
                source: r.source.into(),
                limit: r.limit.into(),
                code: r.code.into(),
                voltage_v: Some(r.voltage),
                demand_v: Some(r.demand),
                target_counts_x65536: r.target_fixed,
                target_position_rad: Some(r.target_position),
                target_velocity_rad_s: Some(r.target_velocity),
                target_acceleration_rad_s2: Some(r.target_acceleration),
                error_rad: Some(r.error),
                error_rate_rad_s: Some(r.error_rate),
                term_0,
                term_1,
                term_2,
                term_3,
                term_4,
                term_5,
                term_6,
                term_7,
            }
            .encode(out)
        }
        Record::Event(r) => Event {
            tick: r.tick,
            kind: r.kind.into(),
            from_state: r.from.into(),
            to_state: r.to.into(),
            cause: r.cause.into(),
            value: Some(r.value),
        }
        .encode(out),
        Record::Link(r) => Link {
            tick: r.tick,
            received: r.received,
            lost: r.lost,
            late: r.late,
            duplicated: r.duplicated,
            reordered: r.reordered,
            rejected_frames: r.rejected_frames,
            rejected_samples: r.rejected_samples,
            deadline_misses: r.deadline_misses,
            log_dropped: r.log_dropped,
        }
        .encode(out),
        Record::Truth(r) => Truth {
            tick: r.tick,
            position_rad: Some(r.position),
            velocity_rad_s: Some(r.velocity),
            stuck: r.stuck,
        }
        .encode(out),
    };
    debug_assert!(done.is_ok(), "a Vec grows: encoding into it cannot fail");
}

/// The record in a message of the channel in row `channel` of [`CHANNELS`].
pub(crate) fn decode(channel: usize, time_ns: u64, data: &[u8]) -> Result<Record, String> {
    fn message<M: Message + Default>(data: &[u8]) -> Result<M, String> {
        M::decode(data).map_err(|e| e.to_string())
    }
    fn narrow<T: TryFrom<u32>>(field: &str, value: u32) -> Result<T, String> {
        let bits = 8 * size_of::<T>();
        T::try_from(value).map_err(|_| format!("{field} = {value}: expected at most {bits} bits"))
    }
    // A double that is not there is zero, as for any reader of proto3.
    let real = Option::unwrap_or_default;
    Ok(match channel {
        0 => {
            let m: Sample = message(data)?;
            Record::Sample(SampleRecord {
                tick: m.tick,
                time_ns,
                arrival: narrow("arrival", m.arrival)?,
                sequence: narrow("sequence", m.sequence)?,
                board_time_us: m.board_time_us,
                counts: m.counts,
                status: narrow("status", m.status)?,
                age_us: m.age_us,
                lateness_us: m.lateness_us,
                superseded: m.superseded,
            })
        }
        COMMAND_CHANNEL => {
            let m: Command = message(data)?;
            Record::Command(CommandRecord {
                tick: m.tick,
                time_ns,
                state: narrow("state", m.state)?,
                source: narrow("source", m.source)?,
                limit: narrow("limit", m.limit)?,
                code: narrow("code", m.code)?,
                voltage: real(m.voltage_v),
                demand: real(m.demand_v),
                target_fixed: m.target_counts_x65536,
                target_position: real(m.target_position_rad),
                target_velocity: real(m.target_velocity_rad_s),
                target_acceleration: real(m.target_acceleration_rad_s2),
                error: real(m.error_rad),
                error_rate: real(m.error_rate_rad_s),
                terms: [m.term_0, m.term_1, m.term_2, m.term_3, m.term_4, m.term_5, m.term_6, m.term_7]
                    .into_iter()
                    .map_while(|term| term)
                    .collect(),
            })
        }
        2 => {
            let m: Event = message(data)?;
            Record::Event(EventRecord {
                tick: m.tick,
                time_ns,
                kind: narrow("kind", m.kind)?,
                from: narrow("from_state", m.from_state)?,
                to: narrow("to_state", m.to_state)?,
                cause: narrow("cause", m.cause)?,
                value: real(m.value),
            })
        }
        3 => {
            let m: Link = message(data)?;
            Record::Link(LinkRecord {
                tick: m.tick,
                time_ns,
                received: m.received,
                lost: m.lost,
                late: m.late,
                duplicated: m.duplicated,
                reordered: m.reordered,
                rejected_frames: m.rejected_frames,
                rejected_samples: m.rejected_samples,
                deadline_misses: m.deadline_misses,
                log_dropped: m.log_dropped,
            })
        }
        4 => {
            let m: Truth = message(data)?;
            Record::Truth(TruthRecord {
                tick: m.tick,
                time_ns,
                position: real(m.position_rad),
                velocity: real(m.velocity_rad_s),
                stuck: m.stuck,
            })
        }
        other => return Err(format!("channel {other} holds no records")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_values_of_one_messages_enums_share_a_name() {
        // Protobuf puts the values of all enums of a message into one scope.
        for channel in &CHANNELS {
            let mut enums: Vec<(&str, Names)> = Vec::new();
            for f in channel.fields {
                if let Kind::Enum(name, values) = f.kind
                    && !enums.contains(&(name, values))
                {
                    enums.push((name, values));
                }
            }
            let mut values: Vec<&str> = enums.iter().flat_map(|(_, v)| v.iter().map(|(_, n)| *n)).collect();
            let all = values.len();
            values.sort_unstable();
            values.dedup();
            assert_eq!(values.len(), all, "{}", channel.message);
        }
    }

    #[test]
    fn every_enum_starts_at_zero_as_proto3_demands() {
        for channel in &CHANNELS {
            for f in channel.fields {
                if let Kind::Enum(name, values) = f.kind {
                    assert!(values.iter().enumerate().all(|(i, (n, _))| i == usize::from(*n)), "{name}");
                }
            }
        }
    }

    #[test]
    fn a_terms_name_becomes_a_valid_field_that_no_other_field_has() {
        let named = |terms: &[&str]| {
            let names: Vec<String> = terms.iter().map(|&term| term.into()).collect();
            let set = schema(&CHANNELS[COMMAND_CHANNEL], &names);
            let set = FileDescriptorSet::decode(&set[..]).expect("a descriptor");
            let fields = &set.file[0].message_type[0].field;
            let mut all: Vec<_> = fields.iter().map(|f| f.name().to_owned()).collect();
            let terms = all[13..].to_vec();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), 13 + terms.len(), "{terms:?}");
            terms
        };
        assert_eq!(named(&["surface_rad_s", "Ff Torque/N·m", "x"]), ["surface_rad_s", "ff_torque_n_m", "x"]);
        assert_eq!(named(&["", "·", "3rd"]), ["term_0", "term_1", "term_3rd"]);
        assert_eq!(named(&["error_rad", "same", "same"])[0], "error_rad_0");
        assert_eq!(named(&["a", "b", "c", "d", "e", "f", "g", "h"]).len(), MAX_TERMS);
    }
}
