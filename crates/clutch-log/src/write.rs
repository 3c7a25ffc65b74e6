//! Writing: chunks that are whole in the file within 100 ms.

use crate::error::{LogError, require_file};
use crate::format::{CHECKSUM, ENVELOPE, FORMAT, METADATA, METADATA_EXTRA, SCENARIO, checksum};
use crate::header::Header;
use crate::proto::{self, CHANNELS, PARAMETER_CHANNEL};
use crate::record::{self, MAX_TERMS, Record};
use crate::sync::Syncer;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Longest span of log time in one chunk, ns: the highest cost of a crash.
pub const CHUNK_NS: u64 = 100_000_000;

/// A chunk is closed before it grows past this, bytes before compression.
pub const CHUNK_BYTES: usize = 1 << 20;

/// Most text in a header, bytes: far below the reader's limit.
const HEADER_BYTES: u64 = 4 << 20;

/// Writes a log. Belongs to the log thread: it calls the system. It waits for the disk at the beginning and at the
/// end; between them a thread of its own does, so that records reach the file however slow the disk is.
///
/// A writer that is dropped closes its chunk but does not finish the file: a reader then reports
/// that the log is not complete.
///
/// A process whose file size is limited (`ulimit -f`) must ignore `SIGXFSZ`: the kernel kills it
/// otherwise, before [`LogError::Full`] can be reported.
pub struct LogWriter {
    path: PathBuf,
    file: Arc<File>,
    /// None after an error.
    writer: Option<Writer<Sink>>,
    started_unix_ns: u64,
    /// MCAP's channel of each row of [`CHANNELS`].
    channels: [u16; CHANNELS.len()],
    payload: Vec<u8>,
    /// Log time of the open chunk's first record, ns.
    chunk_since: Option<u64>,
    chunk_records: [u64; CHANNELS.len()],
    chunk_bytes: usize,
    /// Records in closed chunks.
    written: [u64; CHANNELS.len()],
    chunks: u64,
    span: Option<(u64, u64)>,
    syncer: Syncer,
}

/// The contents of a finished log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// The file.
    pub path: PathBuf,
    /// Records.
    pub records: u64,
    /// Records of each topic.
    pub channels: Vec<(&'static str, u64)>,
    /// Chunks with records.
    pub chunks: u64,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// Earliest record since the start of the run, ns.
    pub first_ns: u64,
    /// Latest record since the start of the run, ns.
    pub last_ns: u64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.last_ns.saturating_sub(self.first_ns) as f64 * 1e-9;
        let Summary { path, records, chunks, bytes, .. } = self;
        write!(f, "{}: {records} records over {seconds:.3} s, {chunks} chunks, {bytes} bytes", path.display())
    }
}

impl LogWriter {
    /// Creates the file, or empties it, and writes the header to the disk.
    ///
    /// # Errors
    /// `path` is not a regular file; the system refuses; the disk is full; a key in
    /// [`Header::extra`] stands there twice; the header has more than 4 MiB of text.
    pub fn create(path: impl AsRef<Path>, header: &Header) -> Result<LogWriter, LogError> {
        let path = path.as_ref();
        let (metadata, extra) = metadata(path, header)?;
        match std::fs::metadata(path) {
            Ok(found) => require_file(path, &found)?,
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            Err(e) => return Err(LogError::io(path, "cannot create", e)),
        }
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(path);
        let file = Arc::new(file.map_err(|e| LogError::io(path, "cannot create", e))?);
        let syncer = Syncer::start(Arc::clone(&file));
        let syncer = syncer.map_err(|e| LogError::io(path, "cannot start a thread that syncs", e))?;
        let (writer, channels) = begin(&file, header, &metadata, &extra).map_err(|e| failure(path, 0, e))?;
        let mut log = LogWriter {
            path: path.into(),
            file,
            writer: Some(writer),
            started_unix_ns: header.started_unix_ns,
            channels,
            payload: Vec::new(),
            chunk_since: None,
            chunk_records: [0; CHANNELS.len()],
            chunk_bytes: 0,
            written: [0; CHANNELS.len()],
            chunks: 0,
            span: None,
            syncer,
        };
        log.sync()?;
        Ok(log)
    }

    /// Adds a record; closes the chunk first if it is old or large enough.
    ///
    /// # Errors
    /// [`LogError::Full`] once, when there is no space left; other errors of the system;
    /// [`LogError::Closed`] ever after.
    pub fn write(&mut self, record: &Record) -> Result<(), LogError> {
        let time_ns = record.time_ns();
        if let Some(since) = self.chunk_since
            && (time_ns.saturating_sub(since) >= CHUNK_NS || self.chunk_bytes >= CHUNK_BYTES)
        {
            self.flush()?;
        }
        let row = record::channel_of(record);
        self.payload.clear();
        record::encode(record, &mut self.payload);
        // Wraps, so that any two numbers come back from their sum.
        let log_time = self.started_unix_ns.wrapping_add(time_ns);
        let header = MessageHeader {
            channel_id: self.channels[row],
            sequence: record.tick() as u32, // the low 32 bits: as the docs promise
            log_time,
            publish_time: log_time,
        };
        let Some(writer) = &mut self.writer else { return Err(self.closed()) };
        if let Err(e) = writer.write_to_known_channel(&header, &self.payload) {
            return Err(self.fail(e));
        }
        self.chunk_since.get_or_insert(time_ns);
        self.chunk_records[row] += 1;
        self.chunk_bytes += ENVELOPE + self.payload.len();
        self.span = Some(match self.span {
            None => (time_ns, time_ns),
            Some((first, last)) => (first.min(time_ns), last.max(time_ns)),
        });
        Ok(())
    }

    /// Closes the chunk and hands it to the system, so that a crash of this process leaves it in
    /// the file. Call it at least every 100 ms. Once a second it also asks for the file to be written to the disk, and
    /// does not wait for it.
    ///
    /// # Errors
    /// As for [`write`](LogWriter::write); what such a write to the disk met.
    pub fn flush(&mut self) -> Result<(), LogError> {
        let Some(writer) = &mut self.writer else { return Err(self.closed()) };
        if self.chunk_since.is_none() {
            return Ok(());
        }
        if let Err(e) = writer.flush() {
            return Err(self.fail(e));
        }
        self.chunk_since = None;
        self.chunk_bytes = 0;
        self.chunks += 1;
        for (sum, chunk) in self.written.iter_mut().zip(&mut self.chunk_records) {
            *sum += std::mem::take(chunk);
        }
        self.syncer.nudge().map_err(|e| self.fail(e.into()))
    }

    /// Records in closed chunks: those that a crash of this process does not cost.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.written.iter().sum()
    }

    /// Closes the chunk, writes the index and waits for the disk.
    ///
    /// # Errors
    /// As for [`write`](LogWriter::write).
    pub fn finish(mut self) -> Result<Summary, LogError> {
        self.flush()?;
        if let Some(writer) = &mut self.writer
            && let Err(e) = writer.finish()
        {
            return Err(self.fail(e));
        }
        self.sync()?;
        self.writer = None;
        let bytes = self.file.metadata().map_err(|e| LogError::io(&self.path, "cannot measure", e))?.len();
        let (first_ns, last_ns) = self.span.unwrap_or_default();
        Ok(Summary {
            records: self.written(),
            channels: CHANNELS.iter().map(|c| c.topic).zip(self.written).take(PARAMETER_CHANNEL).collect(),
            chunks: self.chunks,
            bytes,
            first_ns,
            last_ns,
            path: std::mem::take(&mut self.path),
        })
    }

    fn sync(&mut self) -> Result<(), LogError> {
        self.syncer.wait().map_err(|e| self.fail(e.into()))
    }

    fn fail(&mut self, error: McapError) -> LogError {
        self.abandon();
        failure(&self.path, self.written(), error)
    }

    fn closed(&self) -> LogError {
        LogError::Closed { path: self.path.clone(), written: self.written() }
    }

    /// Drops the writer without an index, which its own drop would write.
    fn abandon(&mut self) {
        if let Some(writer) = self.writer.take() {
            drop(writer.into_inner());
        }
    }
}

impl Drop for LogWriter {
    fn drop(&mut self) {
        if self.writer.is_some() {
            let _ = self.flush(); // nobody is left to receive the error
        }
        self.abandon();
    }
}

impl fmt::Debug for LogWriter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LogWriter")
            .field("path", &self.path)
            .field("written", &self.written())
            .finish_non_exhaustive()
    }
}

/// Holds a chunk's small writes together: the file gets chunk and index in one.
struct Sink {
    file: Arc<File>,
    /// Bytes that the file has.
    position: u64,
    pending: Vec<u8>,
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let file: &File = &self.file;
        let mut file = file;
        file.write_all(&self.pending)?;
        self.position += self.pending.len() as u64;
        self.pending.clear();
        Ok(())
    }
}

impl Seek for Sink {
    /// Gives the position; the writer never goes elsewhere.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Current(0) => Ok(self.position + self.pending.len() as u64),
            _ => Err(io::Error::new(io::ErrorKind::Unsupported, "a log is written from start to end")),
        }
    }
}

/// Opens the MCAP file and puts everything into it that stands before the records: the header
/// must be whole in the file before anything can be lost.
fn begin(
    file: &Arc<File>,
    header: &Header,
    metadata: &Metadata,
    extra: &Metadata,
) -> Result<(Writer<Sink>, [u16; CHANNELS.len()]), McapError> {
    let sink = Sink { file: Arc::clone(file), position: 0, pending: Vec::new() };
    let mut writer = WriteOptions::new()
        .library(concat!("clutch-log/", env!("CARGO_PKG_VERSION")))
        // Level 1 takes a quarter less time than the default, 3, on chunks as short as ours, and makes
        // them 1 % larger.
        .compression(Some(Compression::Zstd))
        .compression_level(1)
        .compression_threads(0) // otherwise one thread per core
        .chunk_size(None) // `write` and `flush` close chunks
        .disable_seeking(true) // a chunk goes to the file when it is whole, not before
        .create(sink)?;
    let begun = (|| {
        writer.write_metadata(metadata)?;
        writer.write_metadata(extra)?;
        writer.attach(&Attachment {
            log_time: header.started_unix_ns,
            create_time: header.started_unix_ns,
            name: SCENARIO.into(),
            media_type: "application/toml".into(),
            data: Cow::Borrowed(header.scenario_toml.as_bytes()),
        })?;
        let mut channels = [0; CHANNELS.len()];
        for (id, channel) in channels.iter_mut().zip(&CHANNELS) {
            let schema = proto::schema(channel, &header.term_names);
            let schema = writer.add_schema(channel.message, "protobuf", &schema)?;
            *id = writer.add_channel(schema, channel.topic, "protobuf", &BTreeMap::new())?;
        }
        for (i, message) in proto::parameters(header).enumerate() {
            let header = MessageHeader {
                channel_id: channels[PARAMETER_CHANNEL],
                sequence: i as u32,
                log_time: header.started_unix_ns,
                publish_time: header.started_unix_ns,
            };
            writer.write_to_known_channel(&header, &message)?;
        }
        writer.flush()?;
        Ok(channels)
    })();
    match begun {
        Ok(channels) => Ok((writer, channels)),
        Err(e) => {
            drop(writer.into_inner());
            Err(e)
        }
    }
}

/// The two metadata records of a header.
fn metadata(path: &Path, h: &Header) -> Result<(Metadata, Metadata), LogError> {
    let value = [&h.scenario_name, &h.scenario_toml, &h.version, &h.port, &h.scalar]
        .into_iter()
        .chain(&h.term_names)
        .chain(h.extra.iter().chain(&h.parameters).flat_map(|(k, v)| [k, v]))
        .map(|text| text.len() as u64)
        .sum();
    if h.term_names.len() > MAX_TERMS {
        let (path, what, value) = (path.into(), "terms of a law", h.term_names.len() as u64);
        return Err(LogError::Limit { path, what, value, limit: MAX_TERMS as u64 });
    }
    if value > HEADER_BYTES {
        let (path, what) = (path.into(), "bytes of text in the header");
        return Err(LogError::Limit { path, what, value, limit: HEADER_BYTES });
    }
    let mut clutch = BTreeMap::new();
    let mut put = |key: &str, value: String| clutch.insert(key.to_owned(), value);
    put("format", FORMAT.to_string());
    put("scenario_name", h.scenario_name.clone());
    put("version", h.version.clone());
    put("law_hash", format!("{:016x}", h.law_hash));
    put("port", h.port.clone());
    put("source", h.source.name().into());
    put("scalar", h.scalar.clone());
    put("period_us", h.period_us.to_string());
    put("started_unix_ns", h.started_unix_ns.to_string());
    for (i, term) in h.term_names.iter().enumerate() {
        put(&format!("term_{i}"), term.clone());
    }
    let mut extra = BTreeMap::new();
    for (key, value) in &h.extra {
        if key == CHECKSUM || extra.insert(key.clone(), value.clone()).is_some() {
            return Err(LogError::Header {
                path: path.into(),
                key: key.clone(),
                value: value.clone(),
                expected: "each extra key once, and not crc32",
            });
        }
    }
    let checked = |name: &str, mut metadata: BTreeMap<String, String>| {
        let crc = checksum(name, &metadata);
        metadata.insert(CHECKSUM.to_owned(), format!("{crc:08x}"));
        Metadata { name: name.to_owned(), metadata }
    };
    Ok((checked(METADATA, clutch), checked(METADATA_EXTRA, extra)))
}

fn failure(path: &Path, written: u64, error: McapError) -> LogError {
    let source = match error {
        McapError::Io(source) => source,
        other => io::Error::other(other),
    };
    LogError::writing(path, written, source)
}
