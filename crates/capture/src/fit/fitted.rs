//! What a fit is asked for, and what it says of a texel.

use crate::normals::Surface;
use glam::Vec3;
use yugen_reflectance::btf::Texel;

/// How the readings are looked at. Where there is a [`Prior`](super::Prior) the noise is what it found, and this where it began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Standard deviation of a reading, as a part of it.
    pub noise: f32,
    /// Standard deviation of a black reading, as a reflectance.
    pub floor: f32,
    /// Fewer usable readings than this say nothing about a texel.
    pub least_readings: usize,
    /// What the ground is like, where texels may have nothing else; `None`: every texel has a highlight.
    pub surface: Option<Surface>,
}

impl Default for Options {
    fn default() -> Self {
        Self { noise: 0.02, floor: 0.002, least_readings: 8, surface: None }
    }
}

/// Of fewer readings a texel nothing is said but its ground: seven numbers would describe whatever they are.
pub const FEWEST_FOR_HIGHLIGHTS: usize = 16;

/// What a texel was found to be made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Too few readings.
    Nothing,
    /// A ground: its specular colour is black.
    Ground,
    /// A ground and a highlight.
    Both,
    /// A highlight over next to no ground: metal.
    Highlight,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Nothing, Self::Ground, Self::Both, Self::Highlight];
}

/// What became of a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted {
    /// What it is made of.
    pub kind: Kind,
    /// Its numbers. Confidence 0, black and flat, where there were too few readings.
    pub texel: Texel,
    /// Root mean square of model less reading over their standard deviation.
    pub residual: f32,
    /// Readings that counted.
    pub readings: u16,
    /// Passes of the refinement over them until it stood still.
    pub passes: u16,
}

/// The texel of which nothing is known.
pub(super) const NOTHING: Fitted = Fitted {
    kind: Kind::Nothing,
    texel: Texel {
        diffuse: Vec3::ZERO,
        specular: Vec3::ZERO,
        normal: Vec3::Z,
        tangent: Vec3::X,
        sigma: glam::Vec2::splat(0.3),
        confidence: 0.0,
    },
    residual: 0.0,
    readings: 0,
    passes: 0,
};
