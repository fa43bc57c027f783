//! Where readings come from: pictures that show all texels, or a table in which each has its own.

use crate::Stack;
use glam::Vec3;
use yugen_archive::formats::goniometer_csv::Texels;

/// From where a texel was lit and seen, in the frame of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Unit, toward the light.
    pub light: Vec3,
    /// Unit, toward the eye.
    pub eye: Vec3,
    /// Irradiance on a surface that faces the light.
    pub irradiance: f32,
}

/// What [`fit`](crate::fit::fit) and [`Prior::learn`](crate::fit::Prior::learn) take.
pub trait Readings: Sync {
    /// How many texels.
    fn texels(&self) -> usize;
    /// What was read of a texel: linear RGB, the reflectance factor π f cos θ; NaN where it is not to be used.
    fn values(&self, texel: usize) -> &[[f32; 3]];
    /// From where the `i`th of them was read.
    fn reading(&self, texel: usize, i: usize) -> Reading;
    /// Whether that is the same for all texels.
    fn in_common(&self) -> bool;
    /// Whether it is at least the same lamp and camera for all of them, near as they may be.
    fn in_order(&self) -> bool;
}

impl Readings for Stack {
    fn texels(&self) -> usize {
        self.width * self.height
    }
    fn values(&self, texel: usize) -> &[[f32; 3]] {
        self.samples(texel % self.width, texel / self.width)
    }
    fn reading(&self, texel: usize, i: usize) -> Reading {
        let (x, y) = (texel % self.width, texel / self.width);
        let (light, irradiance) = self.light(i, x, y);
        Reading { light, eye: self.eye(i, x, y), irradiance }
    }
    fn in_common(&self) -> bool {
        self.is_distant()
    }
    fn in_order(&self) -> bool {
        true
    }
}

impl Readings for Texels {
    fn texels(&self) -> usize {
        self.width * self.height
    }
    fn values(&self, texel: usize) -> &[[f32; 3]] {
        &self.values[self.of(texel)]
    }
    fn reading(&self, texel: usize, i: usize) -> Reading {
        let [light, eye] = self.directions[self.of(texel)][i];
        Reading { light, eye, irradiance: 1.0 }
    }
    fn in_common(&self) -> bool {
        false
    }
    fn in_order(&self) -> bool {
        false
    }
}
