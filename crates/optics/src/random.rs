//! Small deterministic random numbers: same seed, same bits, on every machine.

use crate::special::ln_gamma;

/// PCG32. O'Neill 2014, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms".
#[derive(Clone, Debug)]
pub struct Pcg32 {
    state: u64,
    inc: u64,
}

impl Pcg32 {
    /// A generator for `seed` on its own `stream`.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut rng = Self { state: 0, inc: (stream << 1) | 1 };
        rng.next_u32();
        rng.state = rng.state.wrapping_add(seed);
        rng.next_u32();
        rng
    }

    /// 32 random bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6364136223846793005).wrapping_add(self.inc);
        let shifted = (((old >> 18) ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// Uniform in [0, 1): 24 bits, so that 1 is never reached.
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        unit_f32(self.next_u32())
    }

    /// From the normal distribution with mean 0 and variance 1. Box and Muller 1958.
    pub fn normal(&mut self) -> f32 {
        // 1 − u is never zero.
        let radius = (-2.0 * (1.0 - self.next_f32()).ln()).sqrt();
        radius * (std::f32::consts::TAU * self.next_f32()).cos()
    }

    /// From the Poisson distribution: how many of independent events come where `mean` are expected. Zero where
    /// the mean is not a positive number.
    pub fn poisson(&mut self, mean: f64) -> f64 {
        if !(mean > 0.0 && mean.is_finite()) {
            return 0.0;
        }
        if mean < 10.0 {
            // Knuth: events with exponential gaps until the time is over.
            let (limit, mut product, mut count) = ((-mean).exp(), 1.0f64, -1.0);
            while product > limit {
                product *= 1.0 - f64::from(self.next_f32());
                count += 1.0;
            }
            return count;
        }
        // Hörmann 1993, "The transformed rejection method for generating Poisson random variables", PTRS.
        let b = 0.931 + 2.53 * mean.sqrt();
        let a = -0.059 + 0.02483 * b;
        let inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
        let squeeze = 0.9277 - 3.6224 / (b - 2.0);
        loop {
            let u = f64::from(self.next_f32()) - 0.5;
            let v = f64::from(self.next_f32());
            let us = 0.5 - u.abs();
            let k = ((2.0 * a / us + b) * u + mean + 0.43).floor();
            if us >= 0.07 && v <= squeeze {
                return k;
            }
            // us is zero for u = −1/2, and then k is −∞.
            if k < 0.0 || (us < 0.013 && v > us) {
                continue;
            }
            let accepted = (v * inverse_alpha / (a / (us * us) + b)).ln();
            if accepted <= k * mean.ln() - mean - ln_gamma(k + 1.0) {
                return k;
            }
        }
    }

    /// Three uniforms in [0, 1).
    #[inline]
    pub fn next_vec3(&mut self) -> glam::Vec3 {
        glam::Vec3::new(self.next_f32(), self.next_f32(), self.next_f32())
    }
}

/// The top 24 bits as a number in [0, 1).
#[inline]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A good 32-bit mixer. Wellons 2018, "Prospecting for Hash Functions" (lowbias32).
#[inline]
pub fn hash_u32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A hash of two words.
#[inline]
pub fn hash_combine(a: u32, b: u32) -> u32 {
    hash_u32(a ^ b.wrapping_mul(0x9e37_79b9).wrapping_add(0x85eb_ca6b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pcg32_reproduces_its_published_first_outputs() {
        // The demo of the PCG reference implementation: seed 42, stream 54.
        let mut rng = Pcg32::new(42, 54);
        let first: Vec<u32> = (0..6).map(|_| rng.next_u32()).collect();
        assert_eq!(first, [0xa15c02b7, 0x7b47f409, 0xba1d3330, 0x83d2f293, 0xbfa4784b, 0xcbed606e]);
    }

    /// Frequencies against the distribution itself, in cells of at least ten expected draws.
    #[test]
    fn poisson_draws_follow_the_distribution() {
        use crate::statistics::chi_square_p_value;
        for mean in [0.3, 4.0, 9.9, 10.1, 37.0, 800.0] {
            let mut rng = Pcg32::new(7, 3);
            let draws = 40_000;
            let mut counts = std::collections::BTreeMap::new();
            for _ in 0..draws {
                *counts.entry(rng.poisson(mean) as u64).or_insert(0.0) += 1.0;
            }
            let (mut statistic, mut cells, mut got, mut want) = (0.0, 0.0, 0.0, 0.0);
            let last = (mean + 12.0 * mean.sqrt() + 12.0) as u64;
            for k in 0..=last {
                got += counts.get(&k).unwrap_or(&0.0);
                want += f64::from(draws) * (k as f64 * mean.ln() - mean - ln_gamma(k as f64 + 1.0)).exp();
                if want >= 10.0 {
                    statistic += (got - want) * (got - want) / want;
                    (cells, got, want) = (cells + 1.0, 0.0, 0.0);
                }
            }
            let p = chi_square_p_value(statistic, cells - 1.0);
            assert!(p > 1e-4, "mean {mean}: χ² {statistic} in {cells} cells, p {p}");
        }
        assert_eq!(Pcg32::new(1, 1).poisson(0.0), 0.0);
        assert_eq!(Pcg32::new(1, 1).poisson(f64::NAN), 0.0);
    }

    #[test]
    fn normal_draws_have_the_moments_of_the_distribution() {
        let mut rng = Pcg32::new(5, 9);
        let n = 100_000;
        let draws: Vec<f64> = (0..n).map(|_| f64::from(rng.normal())).collect();
        let moment = |k: i32| draws.iter().map(|x| x.powi(k)).sum::<f64>() / f64::from(n);
        // Standard errors √(1, 2, 15, 96)/√n; four of them.
        for (k, want, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)] {
            let slack = 4.0 * (variance / f64::from(n)).sqrt();
            assert!((moment(k) - want).abs() < slack, "moment {k}: {} {want}", moment(k));
        }
    }
}
