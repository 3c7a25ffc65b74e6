//! The file that the emulated board reads: a header, the settings, the counts; then the next run.

use clutch_core::FixedCounts;

/// Bytes of a header.
pub const HEADER: usize = 32;
/// Bytes of a setting: key and value.
pub const SETTING: usize = 10;

/// The header of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Job {
    /// The count on which the path begins.
    pub origin: FixedCounts,
    /// Voltage on the brake before the first tick, V.
    pub volts: f32,
    /// Ticks; as many counts of 32 bits follow the settings.
    pub ticks: u32,
    /// Settings that follow.
    pub settings: u32,
    /// True to write each record to a file.
    pub dump: bool,
    /// Tick and bit of its record that the board must spoil, for the test of the test.
    pub spoil: Option<(u32, u32)>,
}

impl Job {
    /// As bytes.
    #[must_use]
    pub fn to_bytes(self) -> [u8; HEADER] {
        let (tick, bit) = self.spoil.unwrap_or((u32::MAX, u32::MAX));
        let position = self.origin.0.cast_unsigned();
        let words = [
            position as u32,
            (position >> 32) as u32,
            self.volts.to_bits(),
            self.ticks,
            self.settings,
            u32::from(self.dump),
            tick,
            bit,
        ];
        let mut bytes = [0; HEADER];
        for (slot, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
            *slot = word.to_le_bytes();
        }
        bytes
    }

    /// From bytes.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; HEADER]) -> Job {
        let mut words = bytes.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b));
        let mut next = || words.next().unwrap_or(0);
        let (low, high) = (next(), next());
        Job {
            origin: FixedCounts((u64::from(high) << 32 | u64::from(low)).cast_signed()),
            volts: f32::from_bits(next()),
            ticks: next(),
            settings: next(),
            dump: next() != 0,
            spoil: Some((next(), next())).filter(|(tick, _)| *tick != u32::MAX),
        }
    }
}

/// A setting as bytes.
#[must_use]
pub fn setting_to_bytes(key: u16, value: u64) -> [u8; SETTING] {
    let ([a, b], [c, d, e, f, g, h, i, j]) = (key.to_le_bytes(), value.to_le_bytes());
    [a, b, c, d, e, f, g, h, i, j]
}

/// Key and value of a setting.
#[must_use]
pub fn setting_from_bytes(bytes: [u8; SETTING]) -> (u16, u64) {
    let [a, b, value @ ..] = bytes;
    (u16::from_le_bytes([a, b]), u64::from_le_bytes(value))
}
