//! What a denoiser is guided by, in a pixel while samples come in.
//!
//! Unlike the picture the means are not filtered: a sample counts in its own pixel only, so that noise is not carried from
//! pixel to pixel.

use crate::integrator::Radiance;
use yugen_optics::denoise::{Halves, VALUES};

/// All numbers of a guide.
pub const NUMBERS: usize = 2 * (VALUES + 1);

/// The means of both halves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Guide {
    /// Samples of each half.
    pub count: [f32; 2],
    /// Means of each.
    pub mean: [[f32; VALUES]; 2],
}

impl Guide {
    /// What a sample says, in the order of [`VALUES`].
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

    /// Sets pixel (x, y) of `halves` to this and the `moments` of its radiance: means, sums of squared deviations, count.
    pub fn put(&self, halves: &mut Halves, x: usize, y: usize, moments: &[f32; 7]) {
        let at = y * halves.width + x;
        for half in 0..2 {
            halves.count[half][at] = self.count[half];
            for (plane, value) in halves.mean[half].iter_mut().zip(self.mean[half]) {
                plane[at] = value;
            }
        }
        let n = moments[6];
        for (c, plane) in halves.variance.iter_mut().enumerate() {
            plane[at] = if n > 1.0 { moments[3 + c] / (n - 1.0) / n } else { 0.0 };
        }
    }
}
