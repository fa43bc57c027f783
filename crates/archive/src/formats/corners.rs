//! Corners of faces that share everything (position, texture coordinate, normal) become one vertex.

/// An empty place of the table.
const NONE: u32 = u32::MAX;

/// Numbers the distinct triples: open addressing over the list of keys.
#[derive(Default)]
pub(crate) struct Corners {
    /// In the order of their numbers.
    pub(crate) keys: Vec<[u32; 3]>,
    table: Vec<u32>,
}

impl Corners {
    #[inline]
    fn slot(&self, [p, t, n]: [u32; 3]) -> usize {
        // Odd 64-bit constants (fractional parts of e, π and the golden ratio); the high bits are mixed best.
        let h = u64::from(p).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ u64::from(t).wrapping_mul(0xb7e1_5162_8aed_2a6b).rotate_left(21)
            ^ u64::from(n).wrapping_mul(0x243f_6a88_85a3_08d3).rotate_left(42);
        let h = (h ^ (h >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (h >> (64 - self.table.len().trailing_zeros())) as usize
    }

    /// The number of a triple, which is new where it was not seen before.
    #[inline]
    pub(crate) fn find(&mut self, key: [u32; 3]) -> u32 {
        if 2 * self.keys.len() >= self.table.len() {
            self.table = vec![NONE; (4 * self.keys.len()).next_power_of_two().max(1024)];
            for i in 0..self.keys.len() {
                let mut slot = self.slot(self.keys[i]);
                while self.table[slot] != NONE {
                    slot = (slot + 1) & (self.table.len() - 1);
                }
                self.table[slot] = i as u32;
            }
        }
        let mut slot = self.slot(key);
        loop {
            match self.table[slot] {
                NONE => break,
                i if self.keys[i as usize] == key => return i,
                _ => slot = (slot + 1) & (self.table.len() - 1),
            }
        }
        self.table[slot] = self.keys.len() as u32;
        self.keys.push(key);
        self.table[slot]
    }
}
