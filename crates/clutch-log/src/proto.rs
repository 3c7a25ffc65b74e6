//! The channel table, and the schemas made from it.

use crate::channel::{Channel, Field, Kind};
use crate::header::Header;
use crate::record::RECORDS;
use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet, OneofDescriptorProto,
};
use std::fmt::Write as _;

/// A parameter of the scenario.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Parameter {
    #[prost(string, tag = 1)]
    pub(crate) key: String,
    #[prost(string, tag = 2)]
    pub(crate) value: String,
}

const PARAMETERS: Channel = Channel {
    topic: "/parameters",
    message: "clutch.Parameter",
    meaning: "Every parameter, once at the start, a message each.",
    fields: &[
        Field {
            number: 1,
            name: "key",
            kind: Kind::String,
            meaning: "Name, as in the scenario file: `law.smc.kp_v`.",
        },
        Field { number: 2, name: "value", kind: Kind::String, meaning: "Value, as in the scenario file." },
    ],
    terms: 0,
};

/// Row of `/parameters` in [`CHANNELS`].
pub const PARAMETER_CHANNEL: usize = RECORDS.len();

/// Messages of `/parameters`: one for each parameter of the header, in its order.
pub fn parameters(header: &Header) -> impl Iterator<Item = Vec<u8>> + '_ {
    let message = |(key, value): &(String, String)| Parameter { key: key.clone(), value: value.clone() };
    header.parameters.iter().map(move |parameter| message(parameter).encode_to_vec())
}

/// The channel table: those of the records, and the parameters.
pub const CHANNELS: [Channel; PARAMETER_CHANNEL + 1] = {
    let mut all = [PARAMETERS; PARAMETER_CHANNEL + 1];
    let mut row = 0;
    while row < RECORDS.len() {
        all[row] = RECORDS[row];
        row += 1;
    }
    all
};

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
///
/// A term is `optional`: a command without an answer of the law has none, which is not a term of 0.
#[must_use]
pub fn schema(channel: &Channel, terms: &[String]) -> Vec<u8> {
    let short = channel.message.trim_start_matches("clutch.");
    let mut names: Vec<String> = channel.fields.iter().map(|f| f.name.to_owned()).collect();
    let first = names.len() - channel.terms;
    if channel.terms > 0 {
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
    let (mut field, mut oneof_decl) = (Vec::new(), Vec::new());
    for (i, (f, name)) in channel.fields.iter().zip(names).enumerate() {
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
        // An optional field of proto3 is one of a group of its own.
        let optional = (i >= first).then_some(true);
        let oneof_index = optional.map(|_| oneof_decl.len() as i32);
        if optional.is_some() {
            oneof_decl.push(OneofDescriptorProto { name: Some(format!("_{name}")), options: None });
        }
        field.push(FieldDescriptorProto {
            json_name: Some(name.clone()), // otherwise JSON would show errorRateRadS
            name: Some(name),
            number: Some(f.number),
            label: Some(Label::Optional as i32),
            r#type: Some(kind as i32),
            type_name,
            oneof_index,
            proto3_optional: optional,
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
            oneof_decl,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::TIME;
    use crate::names::Names;
    use crate::record::{CommandRecord, InChannel, MAX_TERMS};

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
    fn a_term_that_is_called_as_another_column_hides_none() {
        let terms = ["p_v", TIME, "tick"].map(String::from);
        let columns = CommandRecord::CHANNEL.columns(&terms);
        let names: Vec<&str> = columns[columns.len() - 3..].iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["p_v", "time_s_1", "tick_2"]);
    }

    #[test]
    fn a_terms_name_becomes_a_valid_field_that_no_other_field_has() {
        let named = |terms: &[&str]| {
            let names: Vec<String> = terms.iter().map(|&term| term.into()).collect();
            let set = schema(&CommandRecord::CHANNEL, &names);
            let set = FileDescriptorSet::decode(&set[..]).expect("a descriptor");
            let fields = &set.file[0].message_type[0].field;
            let mut all: Vec<_> = fields.iter().map(|f| f.name().to_owned()).collect();
            let terms = all[13..].to_vec();
            assert!(fields.iter().enumerate().all(|(i, f)| f.proto3_optional() == (i >= 13)), "{terms:?}");
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
