//! Numbers that are reported of shafts at a sample.

/// A number that is reported of a shaft at a sample.
#[derive(Clone, Copy)]
pub(crate) enum Quantity {
    Time,
    Position,
    Velocity,
    Counts,
    Stuck,
    Sticks,
    Voltage,
    MeasuredError,
    ErrorRate,
    TargetCounts,
    TargetVelocity,
    TargetAcceleration,
    LawVoltage,
}

/// Their names, with units.
pub(super) const QUANTITIES: [&str; 13] = [
    "time_s",
    "position_rad",
    "velocity_rad_s",
    "counts",
    "stuck",
    "sticks",
    "voltage_v",
    "measured_error_rad",
    "error_rate_rad_s",
    "target_counts",
    "target_velocity_rad_s",
    "target_acceleration_rad_s2",
    "law_voltage_v",
];

/// A number for each quantity and each shaft of a block.
pub(crate) struct Told {
    pub(super) shafts: usize,
    pub(super) numbers: Vec<f64>,
}

impl Told {
    pub(super) fn new(shafts: usize) -> Self {
        Told { shafts, numbers: vec![0.0; QUANTITIES.len() * shafts] }
    }

    /// The number of a shaft.
    #[inline(always)]
    pub(crate) fn at(&mut self, quantity: Quantity, shaft: usize) -> &mut f64 {
        &mut self.row(quantity)[shaft]
    }

    /// The numbers of all shafts.
    #[inline(always)]
    pub(crate) fn row(&mut self, quantity: Quantity) -> &mut [f64] {
        &mut self.numbers[quantity as usize * self.shafts..][..self.shafts]
    }
}
