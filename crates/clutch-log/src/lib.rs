//! Logs of simulations, loops and replays: [MCAP](https://mcap.dev) files with one channel table.
//!
//! ```text
//! control thread ── Record ──▶ ring ──▶ log thread ── LogWriter ──▶ run.mcap ──▶ read · info · recover
//! ```
//!
//! [`Record`] is `Copy` and holds no heap: it goes through a ring from the control thread to the
//! thread that owns the [`LogWriter`]. The file contains the schemas, so that Foxglove, PlotJuggler
//! and Python show names and units without a plugin. Reals are doubles, always written, so that
//! a replay compares bit for bit, −0 and the payload of a NaN included.
//!
//! **After a crash** everything but the last chunk is there. A chunk spans less than [`CHUNK_NS`]
//! of log time and reaches the file whole, in one write. [`read`] also takes a file that was cut
//! anywhere; [`recover`] writes a finished file from it.
//!
//! **Hostile files** cost bounded memory and time ([`Limits`]), and give an error, never a panic.
//!
//! ```
//! use clutch_log::{Header, Limits, LogWriter, Record, SampleRecord, read};
//! # let folder = std::env::temp_dir().join(format!("clutch-log-doc-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # let path = folder.join("run.mcap");
//! let mut log = LogWriter::create(&path, &Header { period_us: 1000, ..Header::default() })?;
//! for tick in 0..250 {
//!     let sample = SampleRecord { tick, time_ns: tick * 1_000_000, counts: -3, ..SampleRecord::default() };
//!     log.write(&Record::Sample(sample))?;
//! }
//! assert_eq!(log.finish()?.records, 250);
//!
//! let log = read(&path, &Limits::default())?;
//! assert!(log.complete);
//! assert_eq!((log.samples.len(), log.samples[249].counts), (250, -3));
//! # std::fs::remove_dir_all(folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod error;
mod info;
pub mod names;
mod proto;
mod read;
mod record;
mod recover;
mod scan;
mod write;

pub use error::LogError;
pub use info::{ChannelInfo, Info, info};
pub use names::{Arrival, CommandSource, EventKind};
pub use proto::{CHANNELS, Channel, Field, Kind, channel_table, encode};
pub use read::{Log, read, read_bytes};
pub use record::{CommandRecord, EventRecord, Header, LinkRecord, Record, SampleRecord, Source, TruthRecord};
pub use recover::{Recovered, recover};
pub use scan::{Damage, End, Limits, Scanned, scan};
pub use write::{CHUNK_BYTES, CHUNK_NS, LogWriter, Summary};
