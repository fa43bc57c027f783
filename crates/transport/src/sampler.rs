//! Low-discrepancy points: Owen-scrambled Sobol', padded four dimensions at a time.
//!
//! Burley 2020, "Practical Hash-based Owen Scrambling". Every request for up to four numbers takes the first
//! four Sobol' dimensions, scrambled and shuffled by a seed of its own, so that sets are independent of one
//! another and each is stratified in all four dimensions at every power of two.

use yugen_optics::random::{hash_combine, hash_u32, unit_f32};

/// The first four Sobol' dimensions as a byte-wise table, both sides bit-reversed: `TABLE[k][b]` is the reversed
/// point of the index whose reversal is `b << 8k`. So a scramble of the index and one of the point, which both
/// work on reversed bits, need no reversal in between. Joe and Kuo 2008, "Constructing Sobol sequences with better
/// two-dimensional projections".
static TABLE: [[[u32; 4]; 256]; 4] = sobol_table();

const fn directions() -> [[u32; 32]; 4] {
    let mut v = [[0u32; 32]; 4];
    // Dimension 1: van der Corput.
    let mut i = 0;
    while i < 32 {
        v[0][i] = 1 << (31 - i);
        i += 1;
    }
    // Dimensions 2 to 4: degree s, coefficients a and initial numbers m of the primitive polynomials.
    let s = [1usize, 2, 3];
    let a = [0u32, 1, 1];
    let m = [[1u32, 0, 0], [1, 3, 0], [1, 3, 1]];
    let mut d = 0;
    while d < 3 {
        let mut i = 0;
        while i < 32 {
            v[d + 1][i] = if i < s[d] {
                m[d][i] << (31 - i)
            } else {
                let mut x = v[d + 1][i - s[d]] ^ (v[d + 1][i - s[d]] >> s[d]);
                let mut k = 1;
                while k < s[d] {
                    if (a[d] >> (s[d] - 1 - k)) & 1 == 1 {
                        x ^= v[d + 1][i - k];
                    }
                    k += 1;
                }
                x
            };
            i += 1;
        }
        d += 1;
    }
    v
}

const fn sobol_table() -> [[[u32; 4]; 256]; 4] {
    let v = directions();
    let mut table = [[[0u32; 4]; 256]; 4];
    let mut k = 0;
    while k < 4 {
        let mut b = 0;
        while b < 256 {
            let mut bit = 0;
            while bit < 8 {
                if (b >> bit) & 1 == 1 {
                    let mut d = 0;
                    while d < 4 {
                        table[k][b][d] ^= v[d][31 - (8 * k + bit)].reverse_bits();
                        d += 1;
                    }
                }
                bit += 1;
            }
            b += 1;
        }
        k += 1;
    }
    table
}

/// The first four Sobol' dimensions, reversed, of the point whose index has the reversal `i`.
#[inline]
fn sobol(i: u32) -> [u32; 4] {
    let [a, b, c, d] = i.to_le_bytes();
    let mut p = TABLE[3][d as usize];
    let mut add = |k: usize, byte: u8| {
        for (x, y) in p.iter_mut().zip(TABLE[k][byte as usize]) {
            *x ^= y;
        }
    };
    add(2, c);
    // The low half is nothing but a shift of all points while there are no more than 65536.
    if a | b != 0 {
        add(1, b);
        add(0, a);
    }
    p
}

/// A nested uniform scramble of bit-reversed `x`: each bit is flipped by a hash of the bits above it.
/// Laine and Karras 2011; constants of Vegdahl 2021, "Building a Better LK Hash".
#[inline]
fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// The numbers of one sample of one pixel, drawn in sets of up to four.
#[derive(Clone, Debug)]
pub struct Sampler {
    index: u32,
    seed: u32,
    set: u32,
}

impl Sampler {
    /// Sample `index` of pixel (x, y) under a global `seed`.
    pub fn new(x: u32, y: u32, index: u32, seed: u32) -> Self {
        let pixel = hash_combine(hash_combine(hash_u32(seed), x), y);
        Self { index, seed: pixel, set: 0 }
    }

    /// Starts the sets of path vertex `depth`, so that vertices do not disturb one another's dimensions.
    pub fn at_vertex(&mut self, depth: u32) {
        self.set = 1 + depth * 4;
    }

    /// The next set: four numbers in [0, 1), stratified together over the samples of this pixel.
    #[inline]
    pub fn next_4d(&mut self) -> [f32; 4] {
        let seed = hash_combine(self.seed, self.set);
        self.set += 1;
        let mut index = laine_karras(self.index.reverse_bits(), seed);
        if self.index < 1 << 16 {
            index &= 0xffff_0000;
        }
        let p = sobol(index);
        let mut out = [0.0; 4];
        let mut key = seed;
        for d in 0..4 {
            key = key.wrapping_mul(0x9e37_79b9).wrapping_add(0x7f4a_7c15);
            out[d] = unit_f32(laine_karras(p[d], hash_u32(key)).reverse_bits());
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(n: u32, pixel: u32) -> Vec<[f32; 4]> {
        (0..n)
            .map(|i| {
                let mut s = Sampler::new(pixel, 7, i, 3);
                s.at_vertex(2);
                s.next_4d()
            })
            .collect()
    }

    #[test]
    fn every_dimension_is_stratified_and_the_first_two_in_every_elementary_interval() {
        for pixel in 0..8 {
            let points = points(256, pixel);
            for d in 0..4 {
                let mut seen = [false; 256];
                for p in &points {
                    seen[(p[d] * 256.0) as usize] = true;
                }
                assert!(seen.iter().all(|s| *s), "dimension {d} of pixel {pixel}");
            }
            for log_x in 0..=8 {
                let (nx, ny) = (1 << log_x, 256 >> log_x);
                let mut seen = vec![0; 256];
                for p in &points {
                    seen[(p[0] * nx as f32) as usize * ny + (p[1] * ny as f32) as usize] += 1;
                }
                assert!(seen.iter().all(|s| *s == 1), "{nx} x {ny} of pixel {pixel}");
            }
        }
    }

    #[test]
    fn error_falls_faster_than_with_independent_points() {
        // ∫ of a smooth function over four dimensions: root mean square error over pixels, at 64 and 1024.
        let f =
            |p: [f32; 4]| p.iter().map(|x| f64::from(*x)).map(|x| (2.0 * x).sin() + x * x).product::<f64>();
        let exact = {
            let one = (1.0 - 2f64.cos()) / 2.0 + 1.0 / 3.0;
            one.powi(4)
        };
        let rms = |n: u32| {
            let sum: f64 = (0..64)
                .map(|pixel| {
                    let mean = points(n, pixel).into_iter().map(f).sum::<f64>() / f64::from(n);
                    (mean - exact).powi(2)
                })
                .sum();
            (sum / 64.0).sqrt()
        };
        let ratio = rms(64) / rms(1024);
        // Independent points would give 4; a rate of N^-1 gives 16.
        assert!(ratio > 10.0, "error fell by {ratio} only");
    }

    #[test]
    fn pixels_and_sets_are_independent() {
        let a = Sampler::new(0, 0, 0, 0).next_4d();
        let b = Sampler::new(1, 0, 0, 0).next_4d();
        let c = Sampler::new(0, 0, 0, 1).next_4d();
        assert!(a != b && a != c);
        // Correlation of neighbouring pixels over many samples is small.
        let n = 4096;
        let mean: f64 = (0..n)
            .map(|i| {
                let x = Sampler::new(10, 10, i, 0).next_4d()[0] - 0.5;
                let y = Sampler::new(11, 10, i, 0).next_4d()[0] - 0.5;
                f64::from(x * y)
            })
            .sum::<f64>()
            / f64::from(n);
        // Standard deviation of the mean of a product of two uniforms: 1/12/sqrt(4096) = 0.0013.
        assert!(mean.abs() < 5.0 * 0.0013, "{mean}");
    }
}
