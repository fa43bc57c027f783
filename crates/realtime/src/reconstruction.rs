//! Where in a pixel each frame looks, so that a plain mean over frames becomes the picture that the film's filter makes.
//!
//! Every pixel of a frame is seen at the same place relative to its centre, drawn from the filter by its magnitude (Ernst,
//! Stamminger and Greiner 2006, "Filter Importance Sampling"). What a frame finds counts +1, or −1 where the filter is
//! negative there: the sum of samples over the sum of these weights tends to the integral of the picture times the filter
//! over the integral of the filter, which is what weighted splats tend to. Filters are separable, and so is the draw. The
//! first frame looks at the centre.

use glam::Vec2;
use yugen_scene::Filter;

/// Where a frame looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameSample {
    /// From the pixel's centre, in pixels.
    pub offset: Vec2,
    /// In the unit square, for the lens.
    pub lens: Vec2,
    /// What it counts: 1, or −1 where the filter is negative.
    pub weight: f32,
    /// The random numbers in the unit square that `offset` is made from.
    pub u: Vec2,
}

/// The places that a filter makes frames look at.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    filter: Filter,
    radius: f32,
    /// Share of the filter's magnitude below each of equal steps over its support, from 0 to 1.
    below: Vec<f32>,
    /// Offsets below which so many equal shares of the filter's magnitude lie, for shaders.
    offsets: Vec<f32>,
}

impl Reconstruction {
    const STEPS: usize = 2048;
    /// Of `FILTER_STEPS` in view.wgsl.
    const SHARES: usize = 256;

    /// For `filter`; one without extent looks at centres.
    pub fn new(filter: Filter) -> Self {
        let radius = filter.radius();
        let step = |i: usize| 2.0 * radius * ((i as f32 + 0.5) / Self::STEPS as f32 - 0.5);
        let mut below = vec![0.0];
        let mut sum = 0.0f64;
        for i in 0..Self::STEPS {
            sum += f64::from(filter.value(step(i)).abs());
            below.push(sum as f32);
        }
        let radius = if radius > 0.0 && sum > 0.0 && sum.is_finite() { radius } else { 0.0 };
        below.iter_mut().for_each(|b| *b = (f64::from(*b) / sum) as f32);
        let mut made = Self { filter, radius, below, offsets: Vec::new() };
        made.offsets = (0..=Self::SHARES).map(|i| made.along(i as f32 / Self::SHARES as f32).0).collect();
        made
    }

    /// Offset for `u` in [0, 1), and the filter's sign there.
    fn along(&self, u: f32) -> (f32, f32) {
        if self.radius == 0.0 {
            return (0.0, 1.0);
        }
        let i = self.below.partition_point(|b| *b <= u).clamp(1, Self::STEPS) - 1;
        let (a, b) = (self.below[i], self.below[i + 1]);
        let within = if b > a { (u - a) / (b - a) } else { 0.5 };
        let x = 2.0 * self.radius * ((i as f32 + within) / Self::STEPS as f32 - 0.5);
        (x, if self.filter.value(x) < 0.0 { -1.0 } else { 1.0 })
    }

    /// Offsets below which 0, 1/256, …, 1 of the filter's magnitude lies, in pixels.
    pub fn offsets(&self) -> &[f32] {
        &self.offsets
    }

    /// Whether the filter is negative somewhere.
    pub fn is_signed(&self) -> bool {
        (0..Self::STEPS).any(|i| self.along((i as f32 + 0.5) / Self::STEPS as f32).1 < 0.0)
    }

    /// Where frame `index` looks; `lens`: whether the place on the lens matters.
    pub fn sample(&self, index: u32, lens: bool) -> FrameSample {
        // Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences": powers of the roots of x³ = x + 1 and,
        // in four dimensions, x⁵ = x + 1.
        const TWO: [f64; 4] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2, 0.0, 0.0];
        const FOUR: [f64; 4] = [
            0.856_674_883_854_502_9,
            0.733_891_856_627_126,
            0.628_706_721_037_808_7,
            0.538_597_257_223_610_1,
        ];
        let steps = if lens { FOUR } else { TWO };
        let u = steps.map(|step| (0.5 + f64::from(index) * step).fract() as f32);
        let (x, wx) = self.along(u[0]);
        let (y, wy) = self.along(u[1]);
        FrameSample {
            offset: Vec2::new(x, y),
            lens: Vec2::new(u[2], u[3]),
            weight: wx * wy,
            u: Vec2::new(u[0], u[1]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILTERS: [Filter; 6] = [
        Filter::Box,
        Filter::Tent { radius: 1.0 },
        Filter::Gaussian { stddev: 0.5 },
        Filter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        Filter::CatmullRom,
        Filter::Lanczos { lobes: 3.0 },
    ];

    #[test]
    fn the_first_frame_looks_at_the_centre() {
        for filter in FILTERS {
            let s = Reconstruction::new(filter).sample(0, false);
            assert!(s.offset.length() < 1e-3 && s.weight == 1.0, "{filter:?} {s:?}");
        }
    }

    /// The mean of waves over frames is the filter's own, by quadrature.
    #[test]
    fn means_over_frames_are_filtered() {
        for filter in FILTERS {
            let r = Reconstruction::new(filter);
            let n = 1 << 14;
            for (lens, frequency) in
                [(false, Vec2::ZERO), (true, Vec2::new(0.25, 0.0)), (false, Vec2::new(0.4, 0.3))]
            {
                let wave = |p: Vec2| (std::f32::consts::TAU * p.dot(frequency)).cos();
                let (mut sum, mut weight) = (0.0, 0.0);
                for i in 0..n {
                    let s = r.sample(i, lens);
                    sum += f64::from(s.weight * wave(s.offset));
                    weight += f64::from(s.weight);
                }
                let m = 400;
                let (mut want, mut all) = (0.0, 0.0);
                for i in 0..m * m {
                    let at = |i: i32| filter.radius() * (2.0 * (i as f32 + 0.5) / m as f32 - 1.0);
                    let p = Vec2::new(at(i % m), at(i / m));
                    let f = f64::from(filter.value(p.x) * filter.value(p.y));
                    want += f * f64::from(wave(p));
                    all += f;
                }
                // The worst is 4e-4, of Lanczos.
                let off = (sum / weight - want / all).abs();
                assert!(off < 2e-3, "{filter:?} {frequency} {off}");
            }
        }
    }
}
