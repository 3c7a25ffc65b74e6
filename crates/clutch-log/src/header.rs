//! A log's description of itself.

use std::fmt;

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
    /// Every parameter, flattened: `law.smc.kp_v` → `2.5`.
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
    /// Names of [`CommandRecord::terms`](crate::CommandRecord::terms), with units: `surface_rad_s`.
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

impl Header {
    /// Its parts that a table of a channel keeps, as texts: all but parameters, which are in the scenario, and terms, which are columns.
    #[must_use]
    pub fn described(&self) -> Vec<(String, String)> {
        let mut all = vec![
            ("scenario".to_owned(), self.scenario_name.clone()),
            ("version".to_owned(), self.version.clone()),
            ("law_hash".to_owned(), format!("{:016x}", self.law_hash)),
            ("port".to_owned(), self.port.clone()),
            ("source".to_owned(), self.source.name().to_owned()),
            ("scalar".to_owned(), self.scalar.clone()),
            ("period_us".to_owned(), self.period_us.to_string()),
            ("started_unix_ns".to_owned(), self.started_unix_ns.to_string()),
        ];
        all.extend(self.extra.iter().cloned());
        all
    }
}
