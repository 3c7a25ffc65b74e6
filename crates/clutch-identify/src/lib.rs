#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod added;
pub mod believed;
pub mod break_away;
mod confidence;
pub mod experiment;
pub mod filter;
pub mod identified;
mod lag;
pub mod map_file;
pub mod motor;
mod profile;
pub mod recording;
pub mod release;
pub mod report;
pub mod ride;
pub mod rig_file;
pub mod seen;
pub mod shown;
pub mod times;
pub mod unlike;

pub use believed::{Believed, Corner, believed};
pub use identified::{Consent, Experiment, Identified};
pub use map_file::{map_as_believed, map_file};
pub use recording::{ReadError, Recorded, Recording};
pub use report::{Finding, Report, identify};
pub use rig_file::RigFile;

/// C/J that is thought possible before anything is known of it, 1/s: from nothing to five times the paper's.
pub const DAMPINGS: (f64, f64) = (0.0, 3.0);

/// A value with the interval that holds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Estimate {
    /// The same in another unit.
    #[must_use]
    pub fn times(self, by: f64) -> Estimate {
        Estimate { value: self.value * by, low: self.low * by, high: self.high * by }
    }

    /// The same without a part that is known; nothing below 0.
    #[must_use]
    pub fn less(self, by: f64) -> Estimate {
        let left = |x: f64| (x - by).max(0.0);
        Estimate { value: left(self.value), low: left(self.low), high: left(self.high) }
    }

    /// Its value, of one that is surely there; 0 of one whose interval begins at 0 or below.
    #[must_use]
    pub fn if_any(self) -> f64 {
        if self.low > 0.0 { self.value } else { 0.0 }
    }

    /// `true` if a value lies within.
    #[must_use]
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Half its width, as a share of the value.
    #[must_use]
    pub fn share(&self) -> f64 {
        (self.high - self.value).max(self.value - self.low) / self.value.abs()
    }
}
