//! The contents of a log, without holding them.

use crate::error::LogError;
use crate::printable::printable;
use crate::proto::{CHANNELS, PARAMETER_CHANNEL};
use crate::record;
use crate::scan::{Limits, Scanned, scan_file};
use std::fmt;
use std::path::{Path, PathBuf};

/// A channel of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChannelInfo {
    /// Topic.
    pub topic: &'static str,
    /// Protobuf message.
    pub message: &'static str,
    /// Records.
    pub records: u64,
    /// Earliest and latest record since the start of the run, ns; none without records.
    pub span_ns: Option<(u64, u64)>,
}

/// The contents of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    /// The file.
    pub path: PathBuf,
    /// Header, end, sizes, damage.
    pub scanned: Scanned,
    /// The channels with records, in the order of the channel table.
    pub channels: Vec<ChannelInfo>,
    /// Finished by its writer and without damage.
    pub complete: bool,
}

impl Info {
    /// Records of all channels.
    #[must_use]
    pub fn records(&self) -> u64 {
        self.channels.iter().map(|c| c.records).sum()
    }

    /// Earliest and latest record since the start of the run, ns.
    #[must_use]
    pub fn span_ns(&self) -> Option<(u64, u64)> {
        self.channels.iter().filter_map(|c| c.span_ns).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// From the first to the last record, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.span_ns().map_or(0.0, |(first, last)| last.saturating_sub(first) as f64 * 1e-9)
    }
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (s, h) = (&self.scanned, &self.scanned.header);
        let places = if s.damaged == 1 { "place" } else { "places" };
        let damaged =
            if s.damaged > 0 { format!("DAMAGED in {} {places}, else ", s.damaged) } else { String::new() };
        writeln!(f, "{}: {damaged}{}", self.path.display(), s.tail)?;
        writeln!(f, "  {} of {} by clutch {}", h.source, Quoted(&h.scenario_name), Quoted(&h.version))?;
        writeln!(
            f,
            "  law hash {:016x}, {}, period {} µs, port {}",
            h.law_hash,
            Quoted(&h.scalar),
            h.period_us,
            Quoted(&h.port)
        )?;
        for (key, value) in &h.extra {
            writeln!(f, "  {}: {}", Quoted(key), Quoted(value))?;
        }
        writeln!(
            f,
            "  {} records over {:.3} s, {} parameters",
            self.records(),
            self.duration_s(),
            h.parameters.len()
        )?;
        for c in &self.channels {
            let (first, last) = c.span_ns.unwrap_or_default();
            let (first, last) = (first as f64 * 1e-9, last as f64 * 1e-9);
            writeln!(f, "    {:<9} {:>10}  {first:.3} s to {last:.3} s", c.topic, c.records)?;
        }
        write!(
            f,
            "  {} bytes, {} chunks ({}: {} to {} bytes)",
            s.file_bytes, s.chunks, s.compression, s.uncompressed_bytes, s.compressed_bytes
        )?;
        if s.left_out_bytes > 0 {
            write!(f, "\n  {} bytes cannot be read", s.left_out_bytes)?;
        }
        if let Some(damage) = &s.damage {
            write!(f, "\n  {} damaged {places}; the first: {damage}", s.damaged)?;
        }
        if !s.checked && s.damaged == 0 {
            write!(f, "\n  the header has no checksum: an older version wrote it")?;
        }
        if s.other_messages > 0 {
            write!(f, "\n  {} messages on topics unknown to this version", s.other_messages)?;
        }
        Ok(())
    }
}

struct Quoted<'a>(&'a str);

impl fmt::Display for Quoted<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() { f.write_str("none") } else { f.write_str(&printable(self.0, &[])) }
    }
}

/// Gives the contents of a log, even of one that was cut.
///
/// # Errors
/// As for [`read`](crate::read); the number of records is not limited.
pub fn info(path: impl AsRef<Path>, limits: &Limits) -> Result<Info, LogError> {
    let path = path.as_ref();
    let mut channels: Vec<ChannelInfo> = CHANNELS
        .iter()
        .take(PARAMETER_CHANNEL)
        .map(|c| ChannelInfo { topic: c.topic, message: c.message, records: 0, span_ns: None })
        .collect();
    let scanned = scan_file(path, limits, false, &mut |_, record| {
        if let Some(c) = channels.get_mut(record::channel_of(&record)) {
            let time = record.time_ns();
            c.records += 1;
            let (first, last) = c.span_ns.unwrap_or((time, time));
            c.span_ns = Some((first.min(time), last.max(time)));
        }
        Ok(())
    })?;
    channels.retain(|c| c.records > 0);
    let complete = scanned.complete();
    Ok(Info { path: path.into(), scanned, channels, complete })
}
