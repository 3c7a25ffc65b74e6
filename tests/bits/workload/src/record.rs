//! A tick's outputs as bytes.

use clutch_core::law::{LawTerms, MAX_TERMS, Terms};
use clutch_core::{ServoOutput, StickSlipState, Target};
use crc::{CRC_32_ISO_HDLC, Crc, Digest};

/// The type of a field's bytes; all are little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Unsigned, 8 bit.
    U8,
    /// Unsigned, 16 bit.
    U16,
    /// Unsigned, 32 bit.
    U32,
    /// Signed, 64 bit.
    I64,
    /// Real, 32 bit.
    F32,
}

impl Kind {
    /// Bytes.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Kind::U8 => 1,
            Kind::U16 => 2,
            Kind::U32 | Kind::F32 => 4,
            Kind::I64 => 8,
        }
    }

    /// NumPy's name of the type.
    #[must_use]
    pub const fn numpy(self) -> &'static str {
        match self {
            Kind::U8 => "u1",
            Kind::U16 => "<u2",
            Kind::U32 => "<u4",
            Kind::I64 => "<i8",
            Kind::F32 => "<f4",
        }
    }
}

/// A field of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Its type.
    pub kind: Kind,
}

/// The fields of a record, in the order of their bytes; SI and radians.
pub const FIELDS: &[Field] = &[
    Field { name: "target_counts_x65536", kind: Kind::I64 },
    Field { name: "target_velocity", kind: Kind::F32 },
    Field { name: "target_acceleration", kind: Kind::F32 },
    Field { name: "error", kind: Kind::F32 },
    Field { name: "error_rate", kind: Kind::F32 },
    // The law's terms, here and at the end; 0 beyond those that it has.
    Field { name: "term_0", kind: Kind::F32 },
    Field { name: "term_1", kind: Kind::F32 },
    Field { name: "term_2", kind: Kind::F32 },
    Field { name: "demand", kind: Kind::F32 },
    Field { name: "voltage", kind: Kind::F32 },
    Field { name: "code", kind: Kind::U16 },
    Field { name: "limit", kind: Kind::U8 },
    Field { name: "stuck", kind: Kind::U8 },
    Field { name: "cycles", kind: Kind::U32 },
    Field { name: "stuck_ticks", kind: Kind::U32 },
    Field { name: "stair", kind: Kind::U32 },
    Field { name: "term_3", kind: Kind::F32 },
    Field { name: "term_4", kind: Kind::F32 },
    Field { name: "term_5", kind: Kind::F32 },
    Field { name: "term_6", kind: Kind::F32 },
    Field { name: "term_7", kind: Kind::F32 },
];

/// Bytes of a record.
pub const RECORD: usize = {
    let (mut sum, mut fields) = (0, FIELDS);
    while let [field, rest @ ..] = fields {
        sum += field.kind.size();
        fields = rest;
    }
    sum
};

/// Bytes of a record that its hash covers, for a law of so many terms: of the terms at the end those that it has.
#[must_use]
pub const fn hashed(terms: usize) -> usize {
    RECORD - 4 * MAX_TERMS.saturating_sub(if terms > TERMS_WITHIN { terms } else { TERMS_WITHIN })
}

/// Terms that stand within a record and not at its end.
const TERMS_WITHIN: usize = 3;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The running hash of a run's records: the CRC-32 that zlib, and so Python, has.
#[must_use]
pub fn hash() -> Digest<'static, u32> {
    CRC.digest()
}

/// Fills a record from its beginning.
struct Writer {
    bytes: [u8; RECORD],
    at: usize,
}

impl Writer {
    fn put<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        if let Some(slot) = self.bytes.get_mut(self.at..).and_then(|rest| rest.first_chunk_mut::<N>()) {
            *slot = bytes;
        }
        self.at += N;
        self
    }
}

/// The outputs of a tick, and the code's voltage, in the order of [`FIELDS`].
pub(crate) fn record(
    target: &Target<f32>,
    output: &ServoOutput<f32, LawTerms<f32>>,
    voltage: f32,
    sticks: &StickSlipState<f32>,
) -> [u8; RECORD] {
    let mut terms = [0.0; MAX_TERMS];
    terms.iter_mut().zip(output.command.terms.values()).for_each(|(term, value)| *term = *value);
    let (within, behind) = terms.split_at(TERMS_WITHIN);
    let reals =
        |writer: Writer, reals: &[f32]| reals.iter().fold(writer, |w, real| w.put(real.to_le_bytes()));
    let writer = Writer { bytes: [0; RECORD], at: 0 }
        .put(target.position.0.to_le_bytes())
        .put(target.velocity.to_le_bytes())
        .put(target.acceleration.to_le_bytes())
        .put(output.tick.error.to_le_bytes())
        .put(output.tick.error_rate.to_le_bytes());
    let writer = reals(writer, within)
        .put(output.command.voltage.to_le_bytes())
        .put(voltage.to_le_bytes())
        .put(output.code.0.to_le_bytes())
        .put([output.command.limit as u8])
        .put([u8::from(sticks.stuck())])
        // A run has fewer ticks than 32 bits count.
        .put((sticks.cycles() as u32).to_le_bytes())
        .put((sticks.stuck_ticks() as u32).to_le_bytes())
        .put(sticks.stair().to_le_bytes());
    reals(writer, behind).bytes
}
