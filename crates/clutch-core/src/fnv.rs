//! The hash FNV-1a, which names tables of settings and schemas: short, and constant at compile time.

/// FNV-1a of 64 bits, continued from `hash`; begin with [`FNV_64`].
#[must_use]
pub const fn fnv1a_64(mut hash: u64, mut bytes: &[u8]) -> u64 {
    while let [byte, rest @ ..] = bytes {
        hash = (hash ^ *byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
        bytes = rest;
    }
    hash
}

/// The beginning of every hash by [`fnv1a_64`].
pub const FNV_64: u64 = 0xcbf2_9ce4_8422_2325;

/// FNV-1a of 32 bits.
#[must_use]
pub(crate) const fn fnv1a_32(mut bytes: &[u8]) -> u32 {
    let mut hash = 0x811c_9dc5_u32;
    while let [byte, rest @ ..] = bytes {
        hash = (hash ^ *byte as u32).wrapping_mul(0x0100_0193);
        bytes = rest;
    }
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_test_vectors_come_out() {
        // Fowler, Noll, Vo: test vectors of FNV-1a.
        assert_eq!(fnv1a_32(b""), 0x811c_9dc5);
        assert_eq!(fnv1a_32(b"foobar"), 0xbf9c_f968);
        assert_eq!(fnv1a_64(FNV_64, b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a_64(FNV_64, b"foobar"), 0x8594_4171_f739_67e8);
    }
}
