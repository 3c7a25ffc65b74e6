//! Reading, record by record, within bounds.
//!
//! The file's records (opcode, length, body) are walked here and not by the `mcap` crate: its
//! readers abort on a length of 2⁶⁴ − 1 and on an attachment shorter than its own fields, give
//! nothing of a chunk that is cut, and decompress everything that a chunk claims to hold. Here a
//! length is compared with what is left of the file before anything is allocated, a chunk is
//! decompressed into a buffer of at most [`Limits::max_chunk_bytes`], and its checksum is verified
//! before the first record of it is believed.

use crate::error::{LogError, require_file};
use crate::format::{CHECKSUM, CRC, ENVELOPE, FORMAT, METADATA, METADATA_EXTRA, SCENARIO, checksum};
use crate::header::{Header, Source};
use crate::proto::{self, CHANNELS, PARAMETER_CHANNEL};
use crate::record::{self, Record};
use crc::Table;
use mcap::records::op;
use prost::Message;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::time::{Duration, Instant};

/// The bounds of a reader. The defaults hold for hours of logging at 1 kHz. They let a hostile file
/// take 2.3 GB at most for records (20 million of 112 bytes) and five minutes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Longest record of the file, a compressed chunk for one, bytes. Default 64 MiB.
    pub max_record_bytes: u64,
    /// Largest chunk when decompressed, bytes. Default 16 MiB; ours have 1 MiB.
    pub max_chunk_bytes: u64,
    /// Most records held in memory by [`read`](crate::read). Default 20 million: at 1 kHz with
    /// sample and command nearly three hours. [`info`](crate::info) and
    /// [`recover`](crate::recover) hold none and do not count.
    pub max_records: u64,
    /// Largest file, bytes. Default 64 GiB.
    pub max_file_bytes: u64,
    /// Longest time that reading may take, s. Default 300.
    pub max_seconds: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            max_record_bytes: 64 << 20,
            max_chunk_bytes: 16 << 20,
            max_records: 20_000_000,
            max_file_bytes: 64 << 30,
            max_seconds: 300.0,
        }
    }
}

/// The end of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Tail {
    /// Finished by its writer.
    Finished,
    /// Cut, by a crash or a full disk: the file is whole up to byte `at`, where a record starts
    /// that is not.
    Cut {
        /// Offset, bytes.
        at: u64,
        /// The part that was cut.
        inside: &'static str,
    },
    /// From byte `at` on the file makes no sense.
    Broken {
        /// Offset, bytes.
        at: u64,
        /// The content at that place, and the expectation.
        what: String,
    },
}

impl fmt::Display for Tail {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Tail::Finished => write!(f, "complete"),
            Tail::Cut { at, inside } => write!(f, "cut at byte {at}, inside {inside}"),
            Tail::Broken { at, what } => write!(f, "broken at byte {at}: {what}"),
        }
    }
}

/// Something in the middle of a file that was skipped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Offset of the record of the file, bytes.
    pub at: u64,
    /// The fault, and the expectation.
    pub what: String,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "byte {}: {}", self.at, self.what)
    }
}

/// The findings of a walk through a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Scanned {
    /// The log's description of itself.
    pub header: Header,
    /// Its end.
    pub tail: Tail,
    /// The first damage that was skipped.
    pub damage: Option<Damage>,
    /// Number of damaged places that were skipped.
    pub damaged: u64,
    /// Size of the file, bytes.
    pub file_bytes: u64,
    /// Bytes of it that gave nothing: after the end, and in damaged chunks.
    pub left_out_bytes: u64,
    /// Whole chunks.
    pub chunks: u64,
    /// Their size in the file, bytes.
    pub compressed_bytes: u64,
    /// Their size when decompressed, bytes.
    pub uncompressed_bytes: u64,
    /// Compression of the chunks: `zstd`, `none`, or both.
    pub compression: String,
    /// True if the header's records had checksums, and they held.
    pub checked: bool,
    /// Time of the run from which on records follow a gap, ns: something between them was damaged. None without a gap.
    pub gap_from_ns: Option<u64>,
    /// Messages on topics that are not in the channel table.
    pub other_messages: u64,
}

impl Scanned {
    /// Finished by its writer and without damage.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.tail == Tail::Finished && self.damaged == 0
    }
}

/// Walks through a log and hands each record, in the order of the file, to `each`, with the
/// header known so far (all of it, in a log of ours).
///
/// # Errors
/// No such file or no log; a limit; a header that cannot be read; what `each` returns.
pub fn scan(
    path: impl AsRef<Path>,
    limits: &Limits,
    mut each: impl FnMut(&Header, Record) -> Result<(), LogError>,
) -> Result<Scanned, LogError> {
    scan_file(path.as_ref(), limits, false, &mut each)
}

pub(crate) type Each<'a> = &'a mut dyn FnMut(&Header, Record) -> Result<(), LogError>;

/// With `lenient`, a part over a limit is skipped as damage instead of an error.
pub(crate) fn scan_file(
    path: &Path,
    limits: &Limits,
    lenient: bool,
    each: Each<'_>,
) -> Result<Scanned, LogError> {
    // Looked at before it is opened: opening a pipe would wait for a writer.
    let found = std::fs::metadata(path).map_err(|e| LogError::io(path, "cannot open", e))?;
    require_file(path, &found)?;
    let file = File::open(path).map_err(|e| LogError::io(path, "cannot open", e))?;
    let size = file.metadata().map_err(|e| LogError::io(path, "cannot measure", e))?.len();
    Scan::new(BufReader::with_capacity(1 << 16, file), size, path, limits, lenient).run(each)
}

/// The same on bytes in memory; `path` is for messages.
pub(crate) fn scan_bytes(
    bytes: &[u8],
    path: &Path,
    limits: &Limits,
    each: Each<'_>,
) -> Result<Scanned, LogError> {
    Scan::new(bytes, bytes.len() as u64, path, limits, false).run(each)
}

/// The content of a channel of the file.
#[derive(Clone, Copy)]
enum Held {
    /// The channel in this row of [`CHANNELS`].
    Row(usize),
    Other,
}

struct Scan<'a, R> {
    input: R,
    size: u64,
    /// Offset of the record under way.
    at: u64,
    path: &'a Path,
    limits: &'a Limits,
    lenient: bool,
    started: Instant,
    time: Duration,
    /// Checksum of the data section, then of the summary.
    crc: crc::Digest<'static, u32, Table<16>>,
    named: bool,
    attached: bool,
    in_summary: bool,
    held: BTreeMap<u16, Held>,
    parameter_bytes: u64,
    chunk: Vec<u8>,
    /// Just after the latest record so far, in the time of the run, ns.
    reached_ns: u64,
    unpack: Option<zstd::bulk::Decompressor<'static>>,
    seen: Scanned,
}

/// The next step after a record of the file.
enum Next {
    More,
    End,
}

impl<'a, R: Read> Scan<'a, R> {
    fn new(input: R, size: u64, path: &'a Path, limits: &'a Limits, lenient: bool) -> Self {
        Scan {
            input,
            size,
            at: 0,
            path,
            limits,
            lenient,
            started: Instant::now(),
            time: Duration::try_from_secs_f64(limits.max_seconds).unwrap_or(Duration::MAX),
            crc: CRC.digest(),
            named: false,
            attached: false,
            in_summary: false,
            held: BTreeMap::new(),
            parameter_bytes: 0,
            chunk: Vec::new(),
            reached_ns: 0,
            unpack: None,
            seen: Scanned {
                header: Header::default(),
                tail: Tail::Finished,
                damage: None,
                damaged: 0,
                file_bytes: size,
                left_out_bytes: 0,
                chunks: 0,
                compressed_bytes: 0,
                uncompressed_bytes: 0,
                compression: String::new(),
                checked: true,
                gap_from_ns: None,
                other_messages: 0,
            },
        }
    }

    fn run(mut self, each: Each<'_>) -> Result<Scanned, LogError> {
        self.limit("bytes in the file", self.size, self.limits.max_file_bytes)?;
        let mut magic = Vec::new();
        self.fill(&mut magic, mcap::MAGIC.len() as u64)?;
        if magic != mcap::MAGIC {
            let found = if magic.is_empty() {
                "an empty file".into()
            } else {
                format!("it starts with {magic:02x?}")
            };
            return Err(self.foreign(found, "an MCAP file: 89 4d 43 41 50 30 0d 0a"));
        }
        self.crc.update(&magic);
        self.at = magic.len() as u64;
        let mut body = Vec::new();
        let end = loop {
            self.check_time()?;
            let mut head = Vec::new();
            self.fill(&mut head, 9)?;
            let mut fields = Bytes(&head);
            let (Some(opcode), Some(length)) = (fields.u8(), fields.u64()) else {
                break Tail::Cut { at: self.at, inside: "the head of a record" };
            };
            let left = self.size.saturating_sub(self.at).saturating_sub(9);
            if length > left {
                break if length > self.limits.max_record_bytes {
                    let what =
                        format!("a record of {length} bytes: expected at most the {left} left in the file");
                    Tail::Broken { at: self.at, what }
                } else {
                    Tail::Cut { at: self.at, inside: name_of_record(opcode) }
                };
            }
            if length > self.limits.max_record_bytes {
                if !self.lenient {
                    self.limit("bytes in a record", length, self.limits.max_record_bytes)?;
                }
                std::io::copy(&mut (&mut self.input).take(length), &mut std::io::sink())
                    .map_err(|e| LogError::io(self.path, "cannot read", e))?;
                self.gap();
                self.skip(length, format!("a record of {length} bytes, over the limit"));
                self.at += 9 + length;
                continue;
            }
            self.fill(&mut body, length)?;
            if body.len() as u64 != length {
                // The file became shorter meanwhile.
                break Tail::Cut { at: self.at, inside: name_of_record(opcode) };
            }
            let next = self.record(opcode, &head, &body, each)?;
            self.at += 9 + length;
            if let Next::End = next {
                break self.last_magic()?;
            }
        };
        if !(self.named && self.attached) {
            return Err(match end {
                Tail::Finished => {
                    self.foreign("no record of it is ours".into(), "a metadata record \"clutch\"")
                }
                _ => LogError::NoHeader { path: self.path.into(), at: self.at },
            });
        }
        if end != Tail::Finished {
            self.seen.left_out_bytes += self.size.saturating_sub(self.at);
        }
        self.seen.tail = end;
        Ok(self.seen)
    }

    /// One record of the file.
    fn record(&mut self, opcode: u8, head: &[u8], body: &[u8], each: Each<'_>) -> Result<Next, LogError> {
        if opcode == op::DATA_END {
            let saved = Bytes(body).u32().unwrap_or_default();
            self.check_crc(saved, "data section");
            self.crc = CRC.digest();
            self.in_summary = true;
            return Ok(Next::More);
        }
        if opcode == op::FOOTER {
            // Its checksum covers everything before itself.
            let (before, saved) = body.split_at(body.len().saturating_sub(4));
            self.crc.update(head);
            self.crc.update(before);
            if !self.in_summary {
                self.damage("a footer without an end of the data before it".into());
            } else if body.len() == 20 {
                self.check_crc(Bytes(saved).u32().unwrap_or_default(), "summary");
            } else {
                self.damage(format!("a footer of {} bytes: expected 20", body.len()));
            }
            return Ok(Next::End);
        }
        self.crc.update(head);
        self.crc.update(body);
        if self.in_summary {
            return Ok(Next::More); // repeats what the data section said
        }
        match opcode {
            op::METADATA => self.metadata(body)?,
            op::ATTACHMENT => self.attachment(body)?,
            op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK if !self.named => {
                return Err(self.foreign(
                    "another program's MCAP file".into(),
                    "a metadata record \"clutch\" before the data",
                ));
            }
            op::CHUNK => self.chunk(body, each)?,
            op::CHANNEL | op::MESSAGE => {
                if let Err(what) = self.data_record(opcode, body, each)? {
                    self.gap();
                    self.skip(9 + body.len() as u64, what);
                }
            }
            op::HEADER | op::SCHEMA | op::MESSAGE_INDEX => {}
            0x80.. => {} // private records are other people's, and allowed
            _ => {
                // It may have been a chunk.
                self.gap();
                self.skip(9 + body.len() as u64, format!("a record of unknown kind {opcode:#04x}"));
            }
        }
        Ok(Next::More)
    }

    fn metadata(&mut self, body: &[u8]) -> Result<(), LogError> {
        let mut fields = Bytes(body);
        let name = fields.text().unwrap_or_default();
        match name {
            // Only the first counts: a later one cannot take the log's name from it.
            METADATA if !self.named => match fields.map() {
                Some(map) => {
                    self.verify(METADATA, &map);
                    self.header(map)?;
                    self.named = true;
                }
                None => return Err(self.corrupt("metadata \"clutch\": expected pairs of texts".into())),
            },
            METADATA_EXTRA if !self.attached => match fields.map() {
                Some(mut map) => {
                    self.verify(METADATA_EXTRA, &map);
                    map.remove(CHECKSUM);
                    self.seen.header.extra = map.into_iter().collect();
                }
                None => self
                    .skip(9 + body.len() as u64, "metadata \"clutch.extra\": expected pairs of texts".into()),
            },
            _ => {}
        }
        Ok(())
    }

    /// Holds a metadata record against its checksum; one that an older version wrote has none.
    fn verify(&mut self, name: &str, map: &BTreeMap<String, String>) {
        let Some(saved) = map.get(CHECKSUM) else {
            self.seen.checked = false;
            return;
        };
        let computed = format!("{:08x}", checksum(name, map));
        if *saved != computed {
            self.seen.checked = false;
            self.damage(format!("metadata \"{name}\": checksum {computed}, expected {saved:?}"));
        }
    }

    fn header(&mut self, mut map: BTreeMap<String, String>) -> Result<(), LogError> {
        let path = self.path;
        let mut text = |key: &str| map.remove(key).unwrap_or_default();
        fn number<T>(
            path: &Path,
            key: &str,
            value: String,
            expected: &'static str,
            parse: impl Fn(&str) -> Option<T>,
        ) -> Result<T, LogError> {
            parse(&value).ok_or_else(|| LogError::Header {
                path: path.into(),
                key: key.into(),
                value,
                expected,
            })
        }
        number(path, "format", text("format"), "1; a newer clutch reads newer logs", |v| {
            v.parse().ok().filter(|v: &u32| *v == FORMAT)
        })?;
        let hash = "16 hexadecimal digits";
        let h = &mut self.seen.header;
        h.law_hash = number(path, "law_hash", text("law_hash"), hash, |v| u64::from_str_radix(v, 16).ok())?;
        h.source = number(path, "source", text("source"), "simulation, loop or replay", Source::from_name)?;
        let whole = "a whole number";
        h.period_us = number(path, "period_us", text("period_us"), whole, |v| v.parse().ok())?;
        h.started_unix_ns =
            number(path, "started_unix_ns", text("started_unix_ns"), whole, |v| v.parse().ok())?;
        h.scenario_name = text("scenario_name");
        h.version = text("version");
        h.port = text("port");
        h.scalar = text("scalar");
        h.term_names = (0..crate::MAX_TERMS).map_while(|i| map.remove(&format!("term_{i}"))).collect();
        Ok(())
    }

    fn attachment(&mut self, body: &[u8]) -> Result<(), LogError> {
        let mut fields = Bytes(body);
        let _times = (fields.u64(), fields.u64());
        if self.attached || !self.named || fields.text() != Some(SCENARIO) {
            return Ok(());
        }
        let data = fields.text().and_then(|_media_type| fields.u64()).and_then(|length| fields.take(length));
        let (Some(data), Some(saved)) = (data, fields.u32()) else {
            return Err(self.corrupt("attachment \"scenario.toml\": shorter than it says".into()));
        };
        let computed = CRC.checksum(&body[..body.len().saturating_sub(4)]);
        if saved != 0 && saved != computed {
            return Err(self.corrupt(format!(
                "attachment \"scenario.toml\": checksum {computed:08x}, expected {saved:08x}"
            )));
        }
        match std::str::from_utf8(data) {
            Ok(text) => self.seen.header.scenario_toml = text.to_owned(),
            Err(e) => return Err(self.corrupt(format!("attachment \"scenario.toml\": {e}"))),
        }
        self.attached = true;
        Ok(())
    }

    fn chunk(&mut self, body: &[u8], each: Each<'_>) -> Result<(), LogError> {
        let mut chunk = std::mem::take(&mut self.chunk);
        let result = self.unpack(body, &mut chunk);
        let whole = 9 + body.len() as u64;
        match result? {
            Err(what) => {
                self.gap();
                self.skip(whole, what);
            }
            Ok(compressed) => {
                self.seen.chunks += 1;
                self.seen.compressed_bytes += compressed;
                self.seen.uncompressed_bytes += chunk.len() as u64;
                let mut rest = Bytes(&chunk);
                while !rest.0.is_empty() {
                    let record =
                        rest.u8().zip(rest.u64()).and_then(|(o, length)| Some((o, rest.take(length)?)));
                    let Some((opcode, body)) = record else {
                        self.gap();
                        self.damage("a chunk that ends inside a record".into());
                        break;
                    };
                    if let Err(what) = self.data_record(opcode, body, each)? {
                        self.gap();
                        self.damage(what);
                    }
                    if self.seen.damaged > 0 {
                        self.check_time()?; // a chunk full of nonsense costs more than one of ours
                    }
                }
            }
        }
        self.chunk = chunk;
        Ok(())
    }

    /// Decompresses a chunk's body into `chunk` and verifies it; gives its compressed size. The
    /// inner error is damage.
    fn unpack(&mut self, body: &[u8], chunk: &mut Vec<u8>) -> Result<Result<u64, String>, LogError> {
        let mut fields = Bytes(body);
        let _times = (fields.u64(), fields.u64());
        let (Some(size), Some(saved), Some(compression)) = (fields.u64(), fields.u32(), fields.text()) else {
            return Ok(Err("a chunk without its head".into()));
        };
        let Some(packed) = fields.u64().and_then(|length| fields.take(length)) else {
            return Ok(Err("a chunk shorter than it says".into()));
        };
        let limit = self.limits.max_chunk_bytes;
        if size > limit {
            if !self.lenient {
                self.limit("bytes in a chunk when decompressed", size, limit)?;
            }
            return Ok(Err(format!("a chunk of {size} bytes when decompressed: expected at most {limit}")));
        }
        chunk.clear();
        match compression {
            "" => chunk.extend_from_slice(packed),
            "zstd" => {
                // The room is exactly the chunk's claim, which is within the limit: zstd stops
                // there. The room is not touched before something is written to it.
                chunk.reserve_exact(size as usize);
                let unpack = match &mut self.unpack {
                    Some(unpack) => unpack,
                    none => none.insert(
                        zstd::bulk::Decompressor::new()
                            .map_err(|e| LogError::io(self.path, "cannot decompress", e))?,
                    ),
                };
                if let Err(e) = unpack.decompress_to_buffer(packed, chunk) {
                    return Ok(Err(format!("a chunk that zstd cannot decompress to {size} bytes: {e}")));
                }
            }
            other => return Ok(Err(format!("a chunk compressed by \"{other}\": expected zstd or nothing"))),
        }
        if chunk.len() as u64 != size {
            return Ok(Err(format!("a chunk of {} bytes when decompressed: expected {size}", chunk.len())));
        }
        let computed = CRC.checksum(chunk);
        if saved != 0 && saved != computed {
            return Ok(Err(format!("a chunk with checksum {computed:08x}: expected {saved:08x}")));
        }
        let name = if compression.is_empty() { "none" } else { "zstd" };
        if self.seen.compression.is_empty() {
            self.seen.compression = name.into();
        } else if self.seen.compression != name {
            self.seen.compression = "none and zstd".into();
        }
        Ok(Ok(packed.len() as u64))
    }

    /// A channel or a message. The inner error is damage.
    fn data_record(
        &mut self,
        opcode: u8,
        body: &[u8],
        each: Each<'_>,
    ) -> Result<Result<(), String>, LogError> {
        let mut fields = Bytes(body);
        match opcode {
            op::CHANNEL => {
                let (Some(id), Some(_schema), Some(topic), Some(encoding)) =
                    (fields.u16(), fields.u16(), fields.text(), fields.text())
                else {
                    return Ok(Err("a channel without its fields".into()));
                };
                let row = CHANNELS.iter().position(|c| c.topic == topic && encoding == "protobuf");
                self.held.insert(id, row.map_or(Held::Other, Held::Row));
            }
            op::MESSAGE => {
                let (Some(id), Some(_sequence), Some(log_time), Some(_publish_time)) =
                    (fields.u16(), fields.u32(), fields.u64(), fields.u64())
                else {
                    return Ok(Err("a message without its envelope".into()));
                };
                match self.held.get(&id) {
                    None => return Ok(Err(format!("a message on channel {id}, which is not declared"))),
                    Some(Held::Other) => self.seen.other_messages += 1,
                    Some(Held::Row(PARAMETER_CHANNEL)) => {
                        // An empty one takes memory, too.
                        self.parameter_bytes += ENVELOPE as u64 + fields.0.len() as u64;
                        let (bytes, limit) = (self.parameter_bytes, self.limits.max_chunk_bytes);
                        self.limit("bytes of parameters", bytes, limit)?;
                        match proto::Parameter::decode(fields.0) {
                            Ok(p) => self.seen.header.parameters.push((p.key, p.value)),
                            Err(e) => return Ok(Err(format!("a message on /parameters: {e}"))),
                        }
                    }
                    Some(Held::Row(row)) => {
                        let time_ns = log_time.wrapping_sub(self.seen.header.started_unix_ns);
                        match record::decode(*row, time_ns, fields.0) {
                            Ok(record) => {
                                // A time before the start is a foreign one, and says nothing of where a gap lies.
                                if log_time >= self.seen.header.started_unix_ns {
                                    self.reached_ns = self.reached_ns.max(time_ns.saturating_add(1));
                                }
                                each(&self.seen.header, record)?;
                            }
                            Err(what) => {
                                return Ok(Err(format!("a message on {}: {what}", CHANNELS[*row].topic)));
                            }
                        }
                    }
                }
            }
            _ => {} // schemas: ours are known
        }
        Ok(Ok(()))
    }

    /// After the footer.
    fn last_magic(&mut self) -> Result<Tail, LogError> {
        let left = self.size.saturating_sub(self.at);
        let mut magic = Vec::new();
        self.fill(&mut magic, left.min(9))?; // one more than expected shows that there is more
        let at = self.at;
        Ok(if magic == mcap::MAGIC {
            Tail::Finished
        } else if mcap::MAGIC.starts_with(&magic) {
            Tail::Cut { at, inside: "the last magic" }
        } else {
            Tail::Broken { at, what: "something after the footer: expected the magic and the end".into() }
        })
    }

    /// `length` bytes, or what the file has.
    fn fill(&mut self, into: &mut Vec<u8>, length: u64) -> Result<(), LogError> {
        into.clear();
        let read = (&mut self.input).take(length).read_to_end(into);
        read.map_err(|e| LogError::io(self.path, "cannot read", e)).map(drop)
    }

    fn check_crc(&mut self, saved: u32, section: &str) {
        let computed = std::mem::replace(&mut self.crc, CRC.digest()).finalize();
        if saved != 0 && saved != computed {
            self.damage(format!("checksum of the {section} is {computed:08x}: expected {saved:08x}"));
        }
    }

    fn check_time(&self) -> Result<(), LogError> {
        if self.started.elapsed() <= self.time {
            return Ok(());
        }
        let (value, limit) = (self.started.elapsed().as_secs(), self.time.as_secs());
        Err(LogError::Limit { path: self.path.into(), what: "seconds of reading", value, limit })
    }

    fn limit(&self, what: &'static str, value: u64, limit: u64) -> Result<(), LogError> {
        if value <= limit {
            return Ok(());
        }
        Err(LogError::Limit { path: self.path.into(), what, value, limit })
    }

    /// Records are missing here.
    fn gap(&mut self) {
        self.seen.gap_from_ns.get_or_insert(self.reached_ns);
    }

    fn damage(&mut self, what: String) {
        self.seen.damaged += 1;
        let at = self.at;
        self.seen.damage.get_or_insert(Damage { at, what });
    }

    fn skip(&mut self, bytes: u64, what: String) {
        self.seen.left_out_bytes += bytes;
        self.damage(what);
    }

    fn corrupt(&self, what: String) -> LogError {
        LogError::Corrupt { path: self.path.into(), offset: self.at, what }
    }

    fn foreign(&self, found: String, expected: &'static str) -> LogError {
        LogError::NotALog { path: self.path.into(), found, expected }
    }
}

fn name_of_record(opcode: u8) -> &'static str {
    match opcode {
        op::HEADER => "the file's header",
        op::SCHEMA => "a schema",
        op::CHANNEL => "a channel",
        op::MESSAGE => "a message",
        op::CHUNK => "a chunk",
        op::MESSAGE_INDEX => "a chunk's index",
        op::ATTACHMENT => "an attachment",
        op::METADATA => "a metadata record",
        op::DATA_END => "the end of the data",
        op::FOOTER => "the footer",
        _ => "the summary",
    }
}

/// The rest of a record's body. Little-endian, as MCAP is; `None` if it is too short.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, length: u64) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(usize::try_from(length).ok()?)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*taken)
    }

    fn u8(&mut self) -> Option<u8> {
        self.array().map(u8::from_le_bytes)
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.take(length.into())?).ok()
    }

    fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let length = self.u32()?;
        let mut pairs = Bytes(self.take(length.into())?);
        let mut map = BTreeMap::new();
        while !pairs.0.is_empty() {
            map.insert(pairs.text()?.to_owned(), pairs.text()?.to_owned());
        }
        Some(map)
    }
}
