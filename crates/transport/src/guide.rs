//! What a denoiser is guided by: per pixel, and apart for two halves of its samples, the means of radiance and of what
//! is seen there, be it in a mirror or through glass.
//!
//! Unlike the picture these are not filtered: a sample counts in its own pixel only, so that noise is not carried from
//! pixel to pixel. The halves are blocks of the low-discrepancy sequence, each as well stratified as a picture of half
//! the samples; the difference between them tells the true error of the mean, which the variance of single samples
//! overstates up to tenfold.

use crate::integrator::Radiance;
use std::ops::Range;

/// Values of a pixel: radiance first, then what is seen.
pub const VALUES: usize = 11;

/// Which of them are the albedo.
pub const ALBEDO: Range<usize> = 3..6;

/// Which of them are the normal.
pub const NORMAL: Range<usize> = 6..9;

/// Which of them is the distance.
pub const DEPTH: usize = 9;

/// Which of them says whether a surface was met.
pub const SURFACE: usize = 10;

/// All numbers of a guide.
pub const NUMBERS: usize = 2 * (VALUES + 1);

/// Samples of one block. Blocks go to the halves in turn.
const BLOCK: u32 = 8;

/// The means of both halves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guide {
    /// Samples of each half.
    pub count: [f32; 2],
    /// Means of each.
    pub mean: [[f32; VALUES]; 2],
}

impl Guide {
    /// What a sample says.
    pub fn of(radiance: &Radiance) -> [f32; VALUES] {
        let ([r, g, b], features) = (radiance.rgb.to_array(), &radiance.features);
        let ([ar, ag, ab], [nx, ny, nz]) = (features.albedo.to_array(), features.normal.to_array());
        [r, g, b, ar, ag, ab, nx, ny, nz, features.depth, features.surface]
    }

    /// All numbers of it, to be stored.
    pub fn numbers(&self) -> impl Iterator<Item = f32> {
        self.count.iter().chain(self.mean.as_flattened()).copied()
    }

    /// The guide that has these numbers.
    pub fn from_numbers(numbers: [f32; NUMBERS]) -> Self {
        let mut out = Self::default();
        for (to, from) in out.count.iter_mut().chain(out.mean.as_flattened_mut()).zip(numbers) {
            *to = from;
        }
        out
    }

    /// Adds a sample.
    #[inline]
    pub fn add(&mut self, half: usize, values: &[f32; VALUES]) {
        self.count[half] += 1.0;
        let share = 1.0 / self.count[half];
        for (mean, value) in self.mean[half].iter_mut().zip(values) {
            *mean += (value - *mean) * share;
        }
    }
}

/// The guides of a picture, plane after plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Halves {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Samples of each pixel, per half.
    pub count: [Vec<f32>; 2],
    /// Means per half and value, in the order of [`Guide::of`].
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

    /// Sets pixel (x, y) to `guide` and the `moments` of its radiance: means, sums of squared deviations, count.
    pub fn set(&mut self, x: usize, y: usize, guide: &Guide, moments: &[f32; 7]) {
        let at = y * self.width + x;
        for half in 0..2 {
            self.count[half][at] = guide.count[half];
            for (plane, value) in self.mean[half].iter_mut().zip(guide.mean[half]) {
                plane[at] = value;
            }
        }
        let n = moments[6];
        for (c, plane) in self.variance.iter_mut().enumerate() {
            plane[at] = if n > 1.0 { moments[3 + c] / (n - 1.0) / n } else { 0.0 };
        }
    }
}

/// To which half sample `index` goes, where a pixel gets `samples` or, if that is not known yet, at least 16.
pub fn half(index: u32, samples: Option<u32>) -> usize {
    // A block is a power of two, which is what the sequence is stratified at.
    let block = samples.map_or(BLOCK, |n| (1 << (n / 2).max(1).ilog2()).min(BLOCK));
    (index / block % 2) as usize
}
