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
