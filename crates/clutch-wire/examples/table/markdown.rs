//! The tables of docs/wire.md.

use clutch_wire::{
    CODES, Direction, MAX_BODY, MAX_FRAME, SCHEMA, STATUS, TABLE, TELEMETRY, VERSION, WARNINGS,
};
use std::fmt::Write as _;

/// All tables, from the first line to the last.
pub(crate) fn tables() -> String {
    let mut out = String::new();
    write_all(&mut out).expect("a String takes all");
    out
}

fn write_all(out: &mut String) -> std::fmt::Result {
    writeln!(
        out,
        "Version {VERSION}, schema `{SCHEMA:#018x}`. The longest frame has {MAX_BODY} bytes before"
    )?;
    writeln!(out, "stuffing and {MAX_FRAME} on the wire.\n")?;
    writeln!(out, "| kind | name | sent by | bytes before stuffing | bytes on the wire |")?;
    writeln!(out, "|---|---|---|---|---|")?;
    for m in TABLE {
        let by = if m.direction == Direction::ToBoard { "host" } else { "board" };
        let n = if m.list > 0 { " + 4 n" } else { "" };
        writeln!(out, "| `{:#04x}` | {} | {by} | {}{n} | {}{n} |", m.kind, m.name, m.length, m.length + 2)?;
    }
    for m in TABLE {
        writeln!(out, "\n### `{:#04x}` {}\n\n{}\n", m.kind, m.name, m.doc.trim())?;
        writeln!(out, "| offset | field | type | unit | meaning |")?;
        writeln!(out, "|---|---|---|---|---|")?;
        for f in m.fields {
            let unit = if f.unit.is_empty() { "–" } else { f.unit };
            writeln!(out, "| {} | `{}` | `{}` | {unit} | {} |", f.offset, f.name, f.ty, f.doc.trim())?;
        }
        let n = if m.list > 0 { " + 4 n" } else { "" };
        writeln!(out, "| {}{n} | CRC | `u32` | – | Checksum of all bytes before it. |", m.length - 4)?;
    }
    for set in CODES {
        writeln!(out, "\n### {}\n\n{}\n", set.name, set.doc.trim())?;
        writeln!(out, "| number | name | meaning |")?;
        writeln!(out, "|---|---|---|")?;
        for v in set.values {
            writeln!(out, "| {} | {} | {} |", v.value, v.name, v.doc.trim())?;
        }
    }
    for (field, bits) in
        [("Sample.status", STATUS), ("Telemetry.flags", TELEMETRY), ("Hello.warnings", WARNINGS)]
    {
        writeln!(out, "\n### Bits of `{field}`\n")?;
        writeln!(out, "| bits | name | meaning |")?;
        writeln!(out, "|---|---|---|")?;
        for v in bits {
            writeln!(out, "| `{:#04x}` | {} | {} |", v.value, v.name, v.doc.trim())?;
        }
    }
    Ok(())
}
