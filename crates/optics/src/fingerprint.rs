//! Tells one content from another.

use std::fmt::{Debug, Write};

/// A 64-bit hash of whatever it is fed, the same on every machine: several gigabytes a second, against accidents
/// and not against people. Two inputs that differ in one word never share it.
#[derive(Clone, Debug)]
pub struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        // The digits of π after the point, so that leading zeros count.
        Self(0x243f_6a88_85a3_08d3)
    }
}

impl Fingerprint {
    /// Of `bytes` alone.
    pub fn of(bytes: &[u8]) -> u64 {
        let mut all = Self::default();
        all.bytes(bytes);
        all.finish()
    }

    /// Takes in a word. For a given state every word leads to another one, and the other way round.
    #[inline]
    pub fn word(&mut self, word: u64) {
        // 2⁶⁴ over the golden ratio, odd: multiplying by it can be undone.
        self.0 = (self.0.rotate_left(23) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    /// Takes in bytes and how many they are.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.word(bytes.len() as u64);
        let (words, rest) = bytes.as_chunks::<8>();
        for word in words {
            self.word(u64::from_le_bytes(*word));
        }
        if !rest.is_empty() {
            let mut last = [0; 8];
            last[..rest.len()].copy_from_slice(rest);
            self.word(u64::from_le_bytes(last));
        }
    }

    /// Takes in how `value` prints: exact for numbers, dear for anything long.
    pub fn debug(&mut self, value: &impl Debug) {
        // Writing to it cannot fail.
        let _ = write!(self, "{value:?}");
        self.word(0);
    }

    /// The hash of all that was taken in.
    pub fn finish(&self) -> u64 {
        // Vigna's variant of the finaliser of MurmurHash3 (splitmix64): every bit depends on every other.
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }
}

impl Write for Fingerprint {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.bytes(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_bit_a_shift_or_a_missing_end_gives_another() {
        let data: Vec<u8> = (0..61).collect();
        let whole = Fingerprint::of(&data);
        assert_eq!(whole, Fingerprint::of(&data));
        for bit in 0..8 * data.len() {
            let mut bent = data.clone();
            bent[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(whole, Fingerprint::of(&bent), "bit {bit}");
        }
        for n in 0..data.len() {
            assert_ne!(whole, Fingerprint::of(&data[..n]), "{n} bytes");
        }
        assert_ne!(Fingerprint::of(&[0; 8]), Fingerprint::of(&[0; 16]));
        let printed = |a: f32, b: f32| {
            let mut f = Fingerprint::default();
            f.debug(&a);
            f.debug(&b);
            f.finish()
        };
        assert_ne!(printed(1.0, 11.0), printed(11.0, 1.0));
        assert_ne!(printed(0.1, 0.0), printed(0.1 + f32::EPSILON / 8.0, 0.0));
    }
}
