//! The C header: layouts as offsets, and a codec, for boards written in C or C++.

use clutch_wire::{
    CODES, FieldInfo, List, MAX_BODY, MAX_FRAME, MessageInfo, SCHEMA, STATUS, TABLE, TELEMETRY, VERSION,
    WARNINGS, WATCHDOG_PERIODS,
};
use std::fmt::Write as _;

/// `HoldThenRelease` as `hold_then_release`.
fn snake(name: &str) -> String {
    let mut out = String::new();
    for (i, c) in name.chars().enumerate() {
        if c.is_uppercase() && i > 0 {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

fn upper(name: &str) -> String {
    snake(name).to_uppercase()
}

fn c_type(ty: &str) -> &'static str {
    match ty {
        "u8" => "uint8_t",
        "u16" => "uint16_t",
        "u32" => "uint32_t",
        "u64" => "uint64_t",
        "i32" => "int32_t",
        _ => unreachable!("no such integer in the table"),
    }
}

/// The whole file.
pub(crate) fn text() -> String {
    let mut out = String::new();
    write_all(&mut out).expect("a String takes all");
    out
}

fn write_all(out: &mut String) -> std::fmt::Result {
    out.push_str(HEAD);
    writeln!(out, "#define CLUTCH_VERSION {VERSION}u")?;
    writeln!(out, "#define CLUTCH_WATCHDOG_PERIODS {WATCHDOG_PERIODS}u")?;
    writeln!(out, "#define CLUTCH_SCHEMA UINT64_C({SCHEMA:#018x})")?;
    writeln!(out, "#define CLUTCH_MAX_BODY {MAX_BODY}u  /* longest frame before stuffing, bytes */")?;
    writeln!(out, "#define CLUTCH_MAX_FRAME {MAX_FRAME}u /* longest frame on the wire, bytes */")?;
    writeln!(out, "#define CLUTCH_MAX_LIST {}u  /* most numbers of a list */", List::MOST)?;
    for set in CODES {
        writeln!(out, "\n/* {}: {} */", set.name, ascii(set.doc))?;
        for v in set.values {
            let name = format!("CLUTCH_{}_{}", upper(set.name), upper(v.name));
            writeln!(out, "#define {name} {}u /* {} */", v.value, ascii(v.doc))?;
        }
    }
    for (field, prefix, bits) in [
        ("status of Sample", "STATUS", STATUS),
        ("flags of Telemetry", "TELEMETRY", TELEMETRY),
        ("warnings of Hello", "WARNING", WARNINGS),
    ] {
        writeln!(out, "\n/* Bits of the field {field}. */")?;
        for v in bits {
            let name = format!("CLUTCH_{prefix}_{}", upper(v.name));
            writeln!(out, "#define {name} {:#04x}u /* {} */", v.value, ascii(v.doc))?;
        }
    }
    out.push_str(CODEC);
    for m in TABLE {
        message(out, m)?;
    }
    writeln!(
        out,
        "\n/* Bytes before stuffing of the frame with this body, CRC included; 0 for a kind that is not known. */"
    )?;
    writeln!(out, "static inline size_t clutch_length(const uint8_t *body)\n{{\n    switch (body[0]) {{")?;
    for m in TABLE {
        let big = upper(m.name);
        let list = match list_of(m) {
            Some(list) => format!(" + 4u * (size_t)body[CLUTCH_{big}_{}]", upper(list.name)),
            None => String::new(),
        };
        writeln!(out, "    case CLUTCH_{big}_KIND: return CLUTCH_{big}_LENGTH{list};")?;
    }
    writeln!(out, "    default: return 0;\n    }}\n}}")?;
    out.push_str(DECODER);
    Ok(())
}

/// Comments in ASCII: some vendors' compilers take nothing else.
fn ascii(doc: &str) -> String {
    let text = doc.trim().replace('µ', "u").replace("2⁻¹⁶", "2^-16").replace('`', "");
    assert!(text.is_ascii(), "a comment of the header is not ASCII: {text}");
    text
}

/// The list that ends a message, if one does.
fn list_of(m: &MessageInfo) -> Option<&FieldInfo> {
    m.fields.last().filter(|_| m.list > 0)
}

fn message(out: &mut String, m: &MessageInfo) -> std::fmt::Result {
    let (big, small) = (upper(m.name), snake(m.name));
    let list = list_of(m);
    let numbers = m.fields.len() - usize::from(list.is_some());
    writeln!(out, "\n/* {}: {} */", m.name, ascii(m.doc))?;
    writeln!(out, "#define CLUTCH_{big}_KIND {:#04x}u", m.kind)?;
    let without = if list.is_some() { " /* without the numbers of its list */" } else { "" };
    writeln!(out, "#define CLUTCH_{big}_LENGTH {}u{without}", m.length)?;
    for f in m.fields {
        writeln!(out, "#define CLUTCH_{big}_{} {}u", upper(f.name), f.offset)?;
    }
    writeln!(out, "typedef struct {{")?;
    for f in &m.fields[..numbers] {
        let unit = if f.unit.is_empty() { String::new() } else { format!(" [{}]", ascii(f.unit)) };
        writeln!(out, "    {} {}; /* {}{unit} */", c_type(f.ty), f.name, ascii(f.doc))?;
    }
    if let Some(f) = list {
        writeln!(out, "    uint8_t {}_count; /* at most {} */", f.name, m.list)?;
        writeln!(out, "    uint32_t {}[{}]; /* {} [{}] */", f.name, m.list, ascii(f.doc), ascii(f.unit))?;
    }
    writeln!(out, "}} clutch_{small}_t;\n")?;
    writeln!(out, "/* The frame for the wire; its length, bytes. */")?;
    writeln!(
        out,
        "static inline size_t clutch_encode_{small}(uint8_t wire[CLUTCH_MAX_FRAME], const clutch_{small}_t *m)"
    )?;
    writeln!(out, "{{\n    uint8_t body[CLUTCH_MAX_BODY];\n    body[0] = CLUTCH_{big}_KIND;")?;
    for f in &m.fields[..numbers] {
        writeln!(out, "    clutch_put_{}(body + CLUTCH_{big}_{}, m->{});", f.ty, upper(f.name), f.name)?;
    }
    if let Some(f) = list {
        let (name, at) = (f.name, format!("CLUTCH_{big}_{}", upper(f.name)));
        writeln!(out, "    clutch_put_list(body + {at}, m->{name}, m->{name}_count);")?;
    }
    let more = match list {
        Some(f) => format!(" + 4u * (size_t)body[CLUTCH_{big}_{}]", upper(f.name)),
        None => String::new(),
    };
    writeln!(out, "    return clutch_frame(wire, body, CLUTCH_{big}_LENGTH{more});\n}}\n")?;
    writeln!(out, "/* From the body that clutch_push accepted as CLUTCH_{big}_KIND. */")?;
    writeln!(out, "static inline void clutch_get_{small}(const uint8_t *body, clutch_{small}_t *m)\n{{")?;
    for f in &m.fields[..numbers] {
        writeln!(out, "    m->{} = clutch_get_{}(body + CLUTCH_{big}_{});", f.name, f.ty, upper(f.name))?;
    }
    if let Some(f) = list {
        let (name, at) = (f.name, format!("CLUTCH_{big}_{}", upper(f.name)));
        writeln!(out, "    m->{name}_count = clutch_get_list(body + {at}, m->{name});")?;
    }
    writeln!(out, "}}")
}

const HEAD: &str = r"/* The serial DAQ protocol, for boards in C99 or C++11. Generated from the table of clutch-wire:
 *     cargo run -p clutch-wire --example table -- header
 * Do not edit. docs/wire.md has the meaning of the fields and the duties of a board.
 *
 * Works with any byte order and alignment: nothing is cast, bytes are assembled one by one.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef CLUTCH_WIRE_H
#define CLUTCH_WIRE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

";

const CODEC: &str = r"
/* Integers, little-endian. */
static inline void clutch_put_u8(uint8_t *at, uint8_t value)
{
    at[0] = value;
}

static inline void clutch_put_u16(uint8_t *at, uint16_t value)
{
    at[0] = (uint8_t)(value & 0xffu);
    at[1] = (uint8_t)(value >> 8);
}

static inline void clutch_put_u32(uint8_t *at, uint32_t value)
{
    clutch_put_u16(at, (uint16_t)(value & 0xffffu));
    clutch_put_u16(at + 2, (uint16_t)(value >> 16));
}

static inline void clutch_put_u64(uint8_t *at, uint64_t value)
{
    clutch_put_u32(at, (uint32_t)(value & 0xffffffffu));
    clutch_put_u32(at + 4, (uint32_t)(value >> 32));
}

static inline void clutch_put_i32(uint8_t *at, int32_t value)
{
    clutch_put_u32(at, (uint32_t)value);
}

static inline uint8_t clutch_get_u8(const uint8_t *at)
{
    return at[0];
}

static inline uint16_t clutch_get_u16(const uint8_t *at)
{
    return (uint16_t)(at[0] | ((unsigned)at[1] << 8));
}

static inline uint32_t clutch_get_u32(const uint8_t *at)
{
    return clutch_get_u16(at) | ((uint32_t)clutch_get_u16(at + 2) << 16);
}

static inline uint64_t clutch_get_u64(const uint8_t *at)
{
    return clutch_get_u32(at) | ((uint64_t)clutch_get_u32(at + 4) << 32);
}

static inline int32_t clutch_get_i32(const uint8_t *at)
{
    uint32_t bits = clutch_get_u32(at);
    int32_t value;
    memcpy(&value, &bits, sizeof value); /* a cast would depend on the compiler */
    return value;
}

/* A list: how many numbers, and each. Numbers beyond its room are left out. */
static inline void clutch_put_list(uint8_t *at, const uint32_t *numbers, uint8_t count)
{
    uint8_t i;
    if (count > CLUTCH_MAX_LIST)
        count = CLUTCH_MAX_LIST;
    at[0] = count;
    for (i = 0; i < count; i++)
        clutch_put_u32(at + 1 + 4 * i, numbers[i]);
}

static inline uint8_t clutch_get_list(const uint8_t *at, uint32_t *numbers)
{
    uint8_t i, count = at[0] > CLUTCH_MAX_LIST ? CLUTCH_MAX_LIST : at[0];
    for (i = 0; i < count; i++)
        numbers[i] = clutch_get_u32(at + 1 + 4 * i);
    return count;
}

/* CRC-32/ISO-HDLC: that of Ethernet and zip. */
static inline uint32_t clutch_crc32(const uint8_t *bytes, size_t count)
{
    uint32_t crc = 0xffffffffu;
    size_t i;
    int bit;
    for (i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (bit = 0; bit < 8; bit++)
            crc = (crc >> 1) ^ ((crc & 1u) ? 0xedb88320u : 0u);
    }
    return crc ^ 0xffffffffu;
}

/* Adds the CRC to a body of `length` bytes (CRC included), stuffs it; bytes on the wire. */
static inline size_t clutch_frame(uint8_t *wire, uint8_t *body, size_t length)
{
    size_t i, code = 0; /* where the present block's code goes */
    uint8_t distance = 1;
    clutch_put_u32(body + length - 4, clutch_crc32(body, length - 4));
    for (i = 0; i < length; i++) {
        if (body[i] == 0) {
            wire[code] = distance;
            code = i + 1;
            distance = 1;
        } else {
            wire[i + 1] = body[i];
            distance++;
        }
    }
    wire[code] = distance;
    wire[length + 1] = 0;
    return length + 2;
}
";

const DECODER: &str = r"
/* Results of clutch_push besides a kind. */
#define CLUTCH_NOTHING 0        /* no frame ends here */
#define CLUTCH_BAD_COBS (-1)    /* a code points past the end */
#define CLUTCH_TOO_LONG (-2)    /* more bytes than the longest frame; reported once */
#define CLUTCH_TOO_SHORT (-3)   /* shorter than a kind and a CRC */
#define CLUTCH_BAD_CRC (-4)     /* the checksum does not hold */
#define CLUTCH_UNKNOWN_KIND (-5)
#define CLUTCH_BAD_LENGTH (-6)  /* not the length of its kind */

/* Finds frames in a stream of bytes. All zero to start with. */
typedef struct {
    uint8_t body[CLUTCH_MAX_BODY];
    uint8_t length;   /* bytes in body */
    uint8_t count;    /* bytes since the delimiter */
    uint8_t left;     /* bytes of the block still to come */
    uint8_t dropping; /* too long: drop up to the delimiter */
} clutch_decoder_t;

/* Takes a byte. A kind (> 0): a frame is in d->body until the next byte. An error (< 0): a frame was dropped. */
static inline int clutch_push(clutch_decoder_t *d, uint8_t byte)
{
    uint8_t length = d->length, count = d->count, left = d->left, dropping = d->dropping;
    size_t expected;
    if (byte != 0) {
        if (dropping)
            return CLUTCH_NOTHING;
        if (count >= CLUTCH_MAX_FRAME - 1u) {
            d->dropping = 1;
            return CLUTCH_TOO_LONG;
        }
        d->count++;
        if (left > 0) {
            d->left--;
            d->body[d->length++] = byte;
        } else {
            if (count > 0)
                d->body[d->length++] = 0;
            d->left = (uint8_t)(byte - 1u);
        }
        return CLUTCH_NOTHING;
    }
    d->length = d->count = d->left = d->dropping = 0;
    if (count == 0 || dropping)
        return CLUTCH_NOTHING;
    if (left > 0)
        return CLUTCH_BAD_COBS;
    if (length < 5)
        return CLUTCH_TOO_SHORT;
    if (clutch_crc32(d->body, length - 4u) != clutch_get_u32(d->body + length - 4))
        return CLUTCH_BAD_CRC;
    expected = clutch_length(d->body);
    if (expected == 0)
        return CLUTCH_UNKNOWN_KIND;
    if (expected != length)
        return CLUTCH_BAD_LENGTH;
    return d->body[0];
}

#endif
";
