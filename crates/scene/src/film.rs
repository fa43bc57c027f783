//! The picture a camera makes.

/// The picture a camera makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// x, y, width, height of the part that is rendered, pixels.
    pub crop: Option<[u32; 4]>,
    /// Reconstruction.
    pub filter: Filter,
}

impl Default for Film {
    fn default() -> Self {
        // Mitsuba's hdrfilm.
        Self { width: 768, height: 576, crop: None, filter: Filter::default() }
    }
}

/// Reconstruction filters; radii in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Each sample counts for its own pixel.
    Box,
    /// Linear fall-off.
    Tent {
        /// Half width.
        radius: f32,
    },
    /// Cut off at four standard deviations and shifted to end at zero, as in Mitsuba.
    Gaussian {
        /// Standard deviation.
        stddev: f32,
    },
    /// Mitchell and Netravali 1988.
    Mitchell {
        /// B.
        b: f32,
        /// C.
        c: f32,
    },
    /// Catmull-Rom: Mitchell with B = 0, C = 1/2.
    CatmullRom,
    /// Windowed sinc.
    Lanczos {
        /// Lobes on each side.
        lobes: f32,
    },
}

impl Default for Filter {
    fn default() -> Self {
        Self::Gaussian { stddev: 0.5 }
    }
}

impl Filter {
    /// Half width of a filter's support in pixels.
    pub fn radius(self) -> f32 {
        match self {
            Self::Box => 0.5,
            Self::Tent { radius } => radius,
            Self::Gaussian { stddev } => 4.0 * stddev,
            Self::Mitchell { .. } | Self::CatmullRom => 2.0,
            Self::Lanczos { lobes } => lobes,
        }
    }

    /// The one-dimensional filter at distance `x` in pixels; filters are separable.
    pub fn value(self, x: f32) -> f32 {
        let x = x.abs();
        if x > self.radius() {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Tent { radius } => (1.0 - x / radius).max(0.0),
            Self::Gaussian { stddev } => {
                let g = |x: f32| (-0.5 * (x / stddev) * (x / stddev)).exp();
                (g(x) - g(4.0 * stddev)).max(0.0)
            }
            Self::Mitchell { b, c } => mitchell(x, b, c),
            Self::CatmullRom => mitchell(x, 0.0, 0.5),
            Self::Lanczos { lobes } => {
                let sinc = |x: f32| {
                    let x = x * std::f32::consts::PI;
                    if x < 1e-4 { 1.0 } else { x.sin() / x }
                };
                sinc(x) * sinc(x / lobes)
            }
        }
    }
}

/// Mitchell and Netravali 1988, "Reconstruction Filters in Computer Graphics", equation 8.
fn mitchell(x: f32, b: f32, c: f32) -> f32 {
    let (x2, x3) = (x * x, x * x * x);
    if x < 1.0 {
        ((12.0 - 9.0 * b - 6.0 * c) * x3 + (-18.0 + 12.0 * b + 6.0 * c) * x2 + (6.0 - 2.0 * b)) / 6.0
    } else {
        ((-b - 6.0 * c) * x3 + (6.0 * b + 30.0 * c) * x2 + (-12.0 * b - 48.0 * c) * x + (8.0 * b + 24.0 * c))
            / 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolating_filters_are_one_at_zero_and_zero_at_whole_pixels() {
        for filter in [Filter::CatmullRom, Filter::Lanczos { lobes: 3.0 }] {
            assert!((filter.value(0.0) - 1.0).abs() < 1e-6);
            assert!(filter.value(1.0).abs() < 1e-6 && filter.value(2.0).abs() < 1e-6);
        }
    }
}
