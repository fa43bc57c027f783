//! What a denoiser is told of a picture: per pixel, and apart for two halves of its samples, the means of radiance and of
//! what is seen there, be it in a mirror or through glass.
//!
//! The halves are blocks of the samples' sequence, each as well stratified as a picture of half the samples; the difference
//! between them tells the true error of the mean, which the variance of single samples overstates up to tenfold.

use std::ops::Range;

/// Values of a pixel: radiance first, then what is seen.
pub const VALUES: usize = 11;

/// Which of them are the albedo: what light that falls on what is seen is multiplied by on the way to the eye, roughly.
pub const ALBEDO: Range<usize> = 3..6;

/// Which of them are the normal: of the first surface, towards the eye.
pub const NORMAL: Range<usize> = 6..9;

/// Which of them is the distance: the length of the way to what is seen.
pub const DEPTH: usize = 9;

/// Which of them says whether a surface was met.
pub const SURFACE: usize = 10;

/// Samples of one block. Blocks go to the halves in turn.
const BLOCK: u32 = 8;

/// The guides of a picture, plane after plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Halves {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Samples of each pixel, per half.
    pub count: [Vec<f32>; 2],
    /// Means per half and value, in the order of [`VALUES`].
    pub mean: [[Vec<f32>; VALUES]; 2],
    /// Variance of the mean of all samples of a pixel per colour, as if they were independent.
    pub variance: [Vec<f32>; 3],
}

impl Halves {
    /// Of a picture without samples.
    pub fn new(width: usize, height: usize) -> Self {
        let plane = || vec![0.0; width * height];
        Self {
            width,
            height,
            count: [plane(), plane()],
            mean: std::array::from_fn(|_| std::array::from_fn(|_| plane())),
            variance: std::array::from_fn(|_| plane()),
        }
    }
}

/// Samples of a block where a pixel gets so many: a power of two, which is what the sequence is stratified at.
fn block(samples: Option<u32>) -> u32 {
    samples.map_or(BLOCK, |n| (1 << (n / 2).max(1).ilog2()).min(BLOCK))
}

/// To which half sample `index` goes, where a pixel gets `samples` or, if that is not known yet, at least [`both_halves`].
pub fn half(index: u32, samples: Option<u32>) -> usize {
    (index / block(samples) % 2) as usize
}

/// Samples of a pixel, of the `samples` that it gets, with which each half has a block: with fewer there is nothing to
/// compare, or little.
pub fn both_halves(samples: Option<u32>) -> u32 {
    2 * block(samples)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_half_has_a_block_as_early_as_may_be() {
        for samples in (2..100).map(Some).chain([None]) {
            let enough = both_halves(samples);
            assert!(samples.is_none_or(|n| enough <= n), "{samples:?}: {enough}");
            let [first, second] = [0, 1].map(|h| (0..enough).filter(|i| half(*i, samples) == h).count());
            assert_eq!(first, second, "{samples:?}");
        }
        assert_eq!([None, Some(100), Some(9), Some(2)].map(both_halves), [16, 16, 8, 2]);
    }
}
