//! The records, and a log's description of itself.

use std::fmt;

/// One record, without heap: it goes through the ring from the control thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Record {
    /// A measurement, or its absence.
    Sample(SampleRecord),
    /// A command, with every term of the law.
    Command(CommandRecord),
    /// A report of the supervisor, the gate, the log or the port.
    Event(EventRecord),
    /// Counters of the link, since the start of the run.
    Link(LinkRecord),
    /// The plant's true state: simulation only.
    Truth(TruthRecord),
}

impl Record {
    /// Tick of the run, from 0.
    #[must_use]
    pub fn tick(&self) -> u64 {
        match self {
            Record::Sample(r) => r.tick,
            Record::Command(r) => r.tick,
            Record::Event(r) => r.tick,
            Record::Link(r) => r.tick,
            Record::Truth(r) => r.tick,
        }
    }

    /// Time since the start of the run, ns.
    #[must_use]
    pub fn time_ns(&self) -> u64 {
        match self {
            Record::Sample(r) => r.time_ns,
            Record::Command(r) => r.time_ns,
            Record::Event(r) => r.time_ns,
            Record::Link(r) => r.time_ns,
            Record::Truth(r) => r.time_ns,
        }
    }
}

/// A measurement as it came from the board.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleRecord {
    /// Tick of the run, from 0.
    pub tick: u64,
    /// Time since the start of the run, ns.
    pub time_ns: u64,
    /// Its arrival: [`Arrival`](crate::Arrival) as a number.
    pub arrival: u8,
    /// The board's sequence number; wraps.
    pub sequence: u16,
    /// The board's clock at the measurement, µs; wraps.
    pub board_time_us: u32,
    /// Encoder counts; wrap.
    pub counts: i32,
    /// The board's status bits.
    pub status: u8,
    /// Age of the sample when it was used, µs.
    pub age_us: u32,
    /// Time that the answer to the sample before took, µs.
    pub lateness_us: u32,
    /// A newer sample had come with it; it was not answered.
    pub superseded: bool,
}

/// The most terms that a law has in a log.
pub const MAX_TERMS: usize = 8;

/// Terms of a law: up to [`MAX_TERMS`], without an allocation. What is beyond is left out.
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

/// A command, with the values that led the law to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CommandRecord {
    /// Tick of the run, from 0.
    pub tick: u64,
    /// Time since the start of the run, ns.
    pub time_ns: u64,
    /// The supervisor's state: see [`STATES`](crate::names::STATES).
    pub state: u8,
    /// Origin of the code: [`CommandSource`](crate::CommandSource) as a number.
    pub source: u8,
    /// Effect of the output stage on the demand: see [`LIMITS`](crate::names::LIMITS).
    pub limit: u8,
    /// Code for the converter.
    pub code: u16,
    /// Voltage of the code, V.
    pub voltage: f64,
    /// The law's output before limits, V.
    pub demand: f64,
    /// Target position, 2⁻¹⁶ counts.
    pub target_fixed: i64,
    /// Target position, rad.
    pub target_position: f64,
    /// Target velocity, rad/s.
    pub target_velocity: f64,
    /// Target acceleration, rad/s².
    pub target_acceleration: f64,
    /// Position error as the law saw it, rad.
    pub error: f64,
    /// Its rate as the law saw it, rad/s.
    pub error_rate: f64,
    /// The law's own terms; [`Header::term_names`] names them.
    pub terms: Terms,
}

/// Something that happened once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EventRecord {
    /// Tick of the run, from 0.
    pub tick: u64,
    /// Time since the start of the run, ns.
    pub time_ns: u64,
    /// Its kind: [`EventKind`](crate::EventKind) as a number.
    pub kind: u8,
    /// State before: see [`STATES`](crate::names::STATES).
    pub from: u8,
    /// State after.
    pub to: u8,
    /// Its cause: see [`CAUSES`](crate::names::CAUSES).
    pub cause: u8,
    /// The number that goes with it: the value that the check saw, in the check's unit.
    pub value: f64,
}

/// Counters since the start of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkRecord {
    /// Tick of the run, from 0.
    pub tick: u64,
    /// Time since the start of the run, ns.
    pub time_ns: u64,
    /// Samples received.
    pub received: u64,
    /// Samples that never came.
    pub lost: u64,
    /// Samples after their deadline.
    pub late: u64,
    /// Samples that came twice.
    pub duplicated: u64,
    /// Samples that came after a newer one.
    pub reordered: u64,
    /// Frames refused: wrong checksum, length or type.
    pub rejected_frames: u64,
    /// Samples refused by the plausibility gate.
    pub rejected_samples: u64,
    /// Cycles that ended after their deadline.
    pub deadline_misses: u64,
    /// Records that the full ring dropped.
    pub log_dropped: u64,
}

/// The plant's true state, which only a simulation knows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TruthRecord {
    /// Tick of the run, from 0.
    pub tick: u64,
    /// Time since the start of the run, ns.
    pub time_ns: u64,
    /// Angle of the shaft, rad.
    pub position: f64,
    /// Its velocity, rad/s.
    pub velocity: f64,
    /// Held by static friction.
    pub stuck: bool,
}

/// The source of a log's records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Source {
    /// `clutch sim`.
    #[default]
    Simulation,
    /// `clutch loop`.
    Loop,
    /// `clutch replay`.
    Replay,
}

impl Source {
    /// Every source.
    pub const ALL: [Source; 3] = [Source::Simulation, Source::Loop, Source::Replay];

    /// As in the file: `simulation`, `loop`, `replay`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Source::Simulation => "simulation",
            Source::Loop => "loop",
            Source::Replay => "replay",
        }
    }

    /// From its name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Source> {
        Source::ALL.into_iter().find(|s| s.name() == name)
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A log's description of itself; written before the first record.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Name of the scenario.
    pub scenario_name: String,
    /// The whole scenario, TOML.
    pub scenario_toml: String,
    /// Every parameter, flattened: `law.kp` → `12.5`.
    pub parameters: Vec<(String, String)>,
    /// Version of the build.
    pub version: String,
    /// Hash of the law and its parameters.
    pub law_hash: u64,
    /// The port: a path, an address, or nothing.
    pub port: String,
    /// Source of the records.
    pub source: Source,
    /// Scalar of the law: `f32` or `f64`.
    pub scalar: String,
    /// Sampling period, µs.
    pub period_us: u32,
    /// Names of [`CommandRecord::terms`], with units: `surface_rad_s`.
    pub term_names: Vec<String>,
    /// Start of the run, ns since 1970-01-01 UTC.
    pub started_unix_ns: u64,
    /// Anything else. Each key once; read back sorted by key.
    pub extra: Vec<(String, String)>,
}

impl Default for Header {
    fn default() -> Self {
        Header {
            scenario_name: String::new(),
            scenario_toml: String::new(),
            parameters: Vec::new(),
            version: env!("CARGO_PKG_VERSION").into(),
            law_hash: 0,
            port: String::new(),
            source: Source::default(),
            scalar: "f64".into(),
            period_us: 1000,
            term_names: Vec::new(),
            started_unix_ns: 0,
            extra: Vec::new(),
        }
    }
}
