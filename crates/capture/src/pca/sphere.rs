//! Readings from a photograph.

use super::{Observation, bin_of, row_of};
use glam::Vec3;
use std::f32::consts::PI;
use yugen_archive::formats::pca_basis::Basis;
use yugen_optics::Frame;

/// A photograph of a sphere of the material, seen from so far away that all rays run along −z.
pub struct Sphere<'a> {
    /// Linear RGB, row by row from the top left; not finite where a pixel is not to be used.
    pub pixels: &'a [Vec3],
    /// Pixels across.
    pub width: usize,
    /// Centre in pixels from the top left corner.
    pub centre: (f32, f32),
    /// In pixels.
    pub radius: f32,
    /// Towards the lamp, far away, unit; x right, y up, z to the camera.
    pub light: Vec3,
    /// What a white diffuser that faces the lamp would show.
    pub white: f32,
}

impl Sphere<'_> {
    /// What the photograph says: one observation a row of the basis, the mean of the pixels that see it. Neither
    /// direction is farther than 80 degrees from the normal. Also how many pixels were used.
    pub fn observations(&self, basis: &Basis) -> (Vec<Observation>, usize) {
        const LOWEST: f32 = 0.173_648_18;
        let mut seen = std::collections::BTreeMap::<usize, (Vec3, f32)>::new();
        let mut used = 0;
        for (i, &value) in self.pixels.iter().enumerate() {
            let x = ((i % self.width) as f32 + 0.5 - self.centre.0) / self.radius;
            let y = -((i / self.width) as f32 + 0.5 - self.centre.1) / self.radius;
            let z2 = 1.0 - x * x - y * y;
            if z2 <= LOWEST * LOWEST || !value.is_finite() {
                continue;
            }
            let frame = Frame::from_normal(Vec3::new(x, y, z2.sqrt()));
            let (wo, wi) = (frame.to_local(Vec3::Z), frame.to_local(self.light));
            if wi.z <= LOWEST {
                continue;
            }
            if let Some(row) = row_of(basis, bin_of(wo, wi)) {
                let entry = seen.entry(row).or_insert((Vec3::ZERO, 0.0));
                entry.0 += value / (self.white * PI * wi.z);
                entry.1 += 1.0;
                used += 1;
            }
        }
        (seen.into_iter().map(|(row, (sum, n))| Observation { row, f: sum / n }).collect(), used)
    }
}
