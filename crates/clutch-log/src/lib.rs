#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod cells;
mod channel;
mod error;
mod format;
mod header;
mod info;
pub mod names;
mod printable;
mod proto;
mod read;
mod record;
mod recover;
mod scan;
mod sync;
mod values;
mod write;

pub use cells::{Cells, word};
pub use channel::{Channel, Field, Kind, TIME, Value};
pub use error::LogError;
pub use header::{Header, Source};
pub use info::{ChannelInfo, Info, info};
pub use names::{Arrival, CommandSource, EventKind};
pub use printable::printable;
pub use proto::{CHANNELS, PARAMETER_CHANNEL, channel_table, parameters, schema};
pub use read::{Log, read, read_bytes, read_while};
pub use record::{
    ChangeRecord, CommandRecord, EventRecord, InChannel, LinkRecord, MAX_TERMS, Record, SampleRecord, Terms,
    TruthRecord, channel_of, encode,
};
pub use recover::{Recovered, recover};
pub use scan::{Damage, Limits, Scanned, Tail, scan};
pub use write::{CHUNK_BYTES, CHUNK_NS, LogWriter, Summary};
