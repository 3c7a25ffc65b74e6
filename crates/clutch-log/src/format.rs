//! Marks by which an MCAP file is a log of clutch: names, version, checksums.

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use std::collections::BTreeMap;

/// Bytes of a message in a chunk beside its payload: opcode, length, channel, sequence, two times.
pub(crate) const ENVELOPE: usize = 31;

/// Name of the metadata record that makes an MCAP file a log of clutch.
pub(crate) const METADATA: &str = "clutch";
/// Name of the metadata record with [`Header::extra`](crate::Header::extra).
pub(crate) const METADATA_EXTRA: &str = "clutch.extra";
/// Name of the attachment with the scenario.
pub(crate) const SCENARIO: &str = "scenario.toml";
/// Key of the checksum of a metadata record, which MCAP has for chunks and attachments only.
pub(crate) const CHECKSUM: &str = "crc32";
/// Version of the channel table and of the metadata.
pub(crate) const FORMAT: u32 = 1;

/// CRC-32/ISO-HDLC, MCAP's.
pub(crate) static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// CRC-32/ISO-HDLC of a metadata record: of its name and of its pairs but the checksum, in the order of the keys' bytes,
/// each text behind its length in four bytes, little-endian.
pub(crate) fn checksum(name: &str, pairs: &BTreeMap<String, String>) -> u32 {
    let mut crc = CRC.digest();
    let pairs = pairs.iter().filter(|(key, _)| *key != CHECKSUM).flat_map(|(key, value)| [key, value]);
    for text in [name].into_iter().chain(pairs.map(String::as_str)) {
        crc.update(&(text.len() as u32).to_le_bytes());
        crc.update(text.as_bytes());
    }
    crc.finalize()
}
