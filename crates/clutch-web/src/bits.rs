//! The hash of a run: of every bit of its samples, its events and its figures.

use clutch_sim::Run;
use clutch_sim::metrics::columns;
use crc::{CRC_32_ISO_HDLC, Crc};

/// Hash of zlib (CRC-32), over little-endian numbers: the samples column by column, the law's terms, the events, the figures.
pub(crate) fn bits(run: &Run) -> u32 {
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    let t = &run.trace;
    let reals = [
        &t.time,
        &t.target_position,
        &t.target_velocity,
        &t.target_acceleration,
        &t.position,
        &t.velocity,
        &t.error,
        &t.measured_error,
        &t.error_rate,
        &t.voltage,
        &t.demand,
    ];
    let terms = t.terms.iter().map(|(_, column)| column);
    for column in reals.into_iter().chain(terms) {
        column.iter().for_each(|x| digest.update(&x.to_le_bytes()));
    }
    t.target_fixed.iter().for_each(|x| digest.update(&x.0.to_le_bytes()));
    t.counts.iter().for_each(|x| digest.update(&x.to_le_bytes()));
    t.code.iter().for_each(|x| digest.update(&x.to_le_bytes()));
    t.limit.iter().zip(&t.stuck).for_each(|(limit, stuck)| digest.update(&[*limit as u8, u8::from(*stuck)]));
    for event in &run.events {
        digest.update(&[event.kind as u8]);
        [event.time, event.position, event.torque].iter().for_each(|x| digest.update(&x.to_le_bytes()));
    }
    for (_, figure) in columns(&run.metrics, &run.detected) {
        digest.update(&figure.unwrap_or(f64::MAX).to_le_bytes());
    }
    digest.finalize()
}
