//! What recordings show, beside what is believed of it: the content of a picture.

/// A release, and the fall that is believed.
#[derive(Clone, Debug, PartialEq)]
pub struct Fell {
    /// Recording, and its tick with the first sample.
    pub place: (String, u64),
    /// Time between two samples, s.
    pub period: f64,
    /// Way of each sample in whole counts, rad: the shaft is there, or less than a count farther.
    pub seen: Vec<f64>,
    /// Way as believed, rad.
    pub believed: Vec<f64>,
}

/// A ride at an even rate, or a pass of a motor axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rode {
    /// Rate, rad/s; backwards below 0.
    pub rate: f64,
    /// Voltage that keeps the shaft at that rate, V, and its standard deviation.
    pub seen: (f64, f64),
    /// The same as believed; `None` where the findings do not say it.
    pub believed: Option<f64>,
}

/// Both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// Releases of a brake that a fall explains.
    pub falls: Vec<Fell>,
    /// Rides, the slowest first.
    pub rides: Vec<Rode>,
}
