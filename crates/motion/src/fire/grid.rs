//! A flame as a renderer reads it: cells that emit and absorb, and what light leaves them.

use super::FireError;
use super::directivity::directions;
use glam::{DVec3, UVec3, Vec3, Vec4};
use std::f64::consts::TAU;
use yugen_optics::ColourSpace;

/// Regular cells that emit and absorb light, without scattering: the definition of what is rendered.
///
/// Values lie at the centres of the cells and go over linearly into those of the neighbours (trilinear); outside of the
/// box there is nothing. The outermost cells are empty, so that it does not matter what a sampler makes of the last half
/// cell before the border.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Cells along x, y, z; at least [`Grid::FEWEST`] each.
    pub size: UVec3,
    /// The box's lower corner, m.
    pub lower: Vec3,
    /// And its upper one.
    pub upper: Vec3,
    /// Of the emission's channels.
    pub space: ColourSpace,
    /// Per cell, x fastest, then y, then z: emission red, green, blue and absorption. Emission is radiance per metre, such
    /// that its luminance in `space` is in cd/m³ (cd/m² a metre); absorption is in 1/m, one number for all wavelengths
    /// (that at 560 nm).
    pub data: Vec<[f32; 4]>,
    /// What part of each cell is filled by things that let no light through; empty: none is. Only the light that leaves the
    /// grid knows of them ([`Grid::slabs`]): whoever marches through it meets the things themselves.
    pub solid: Vec<f32>,
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Along {
    /// Radiance towards the ray's origin; its luminance is in cd/m².
    pub radiance: Vec3,
    /// What part of the light behind comes through, 0 to 1.
    pub transmittance: f32,
}

impl Grid {
    /// The fewest cells along an axis.
    pub const FEWEST: u32 = 4;
    /// The most cells of a grid, all in all (256 MiB).
    pub const MOST: u64 = 1 << 24;

    /// Whether so many cells can be.
    pub(super) fn check(size: UVec3) -> Result<(), FireError> {
        let all = size.to_array().iter().try_fold(1u64, |n, v| n.checked_mul(u64::from(*v)));
        if size.min_element() < Self::FEWEST || all.is_none_or(|n| n > Self::MOST) {
            return Err(FireError::Cells { x: size.x, y: size.y, z: size.z });
        }
        Ok(())
    }

    /// The cells as a texture or a buffer takes them: four numbers each.
    pub fn flat(&self) -> &[f32] {
        self.data.as_flattened()
    }

    /// Edges of a cell, m.
    pub fn cell(&self) -> Vec3 {
        (self.upper - self.lower) / self.size.as_vec3()
    }

    /// Where the centre of a cell is.
    pub fn centre(&self, cell: UVec3) -> Vec3 {
        self.lower + (cell.as_vec3() + Vec3::splat(0.5)) * self.cell()
    }

    /// The centres of all cells, in the order of [`Grid::data`].
    pub fn centres(&self) -> impl Iterator<Item = Vec3> {
        let [nx, ny, nz] = self.size.to_array();
        (0..nz).flat_map(move |z| {
            (0..ny).flat_map(move |y| (0..nx).map(move |x| self.centre(UVec3::new(x, y, z))))
        })
    }

    /// Emission and absorption at a point, as in [`Grid::data`].
    pub fn sample(&self, p: Vec3) -> Vec4 {
        let at = (p - self.lower) / self.cell() - Vec3::splat(0.5);
        let size = self.size.as_vec3();
        // What is not a number is outside too.
        let inside = |v: f32, n: f32| v >= -0.5 && v <= n - 0.5;
        if !(inside(at.x, size.x) && inside(at.y, size.y) && inside(at.z, size.z)) {
            return Vec4::ZERO;
        }
        let at = at.clamp(Vec3::ZERO, size - Vec3::ONE);
        let first = at.floor().min(size - Vec3::splat(2.0));
        let t = at - first;
        let [nx, ny] = [self.size.x as usize, self.size.y as usize];
        let c = first.as_uvec3();
        let o = (c.z as usize * ny + c.y as usize) * nx + c.x as usize;
        let v = |i: usize| Vec4::from_array(self.data[o + i]);
        let row = |i: usize| v(i).lerp(v(i + 1), t.x);
        let slice = |i: usize| row(i).lerp(row(i + nx), t.y);
        slice(0).lerp(slice(nx * ny), t.z)
    }

    /// Light along a ray from `origin` to `direction` (unit) within `range` (m), by the midpoint rule with steps of at most
    /// `step`, m: within each, absorption and source are constant and the rest is exact.
    pub fn march(&self, origin: Vec3, direction: Vec3, range: [f32; 2], step: f32) -> Along {
        let [a, b] = [(self.lower - origin) / direction, (self.upper - origin) / direction];
        // Along an axis to which the ray is parallel these are ±∞, or not a number on the very face: then it misses.
        let near = a.min(b).max_element().max(range[0]);
        let far = a.max(b).min_element().min(range[1]);
        let mut along = Along { radiance: Vec3::ZERO, transmittance: 1.0 };
        if !(near < far && step > 0.0) {
            return along;
        }
        let count = ((far - near) / step).ceil().clamp(1.0, 1e5);
        let length = (far - near) / count;
        for i in 0..count as u32 {
            let v = self.sample(origin + direction * (near + (i as f32 + 0.5) * length));
            let depth = v.w * length;
            // (1 − exp(−depth)) / depth, which is 1 for what hardly absorbs.
            let share = if depth > 1e-4 { -(-depth).exp_m1() / depth } else { 1.0 - 0.5 * depth };
            along.radiance += v.truncate() * (length * share * along.transmittance);
            along.transmittance *= (-depth).exp();
        }
        along
    }

    /// Radiant intensity towards `direction` (unit, away from the fire): the integral of radiance over the plane across it,
    /// with absorption on the way. Its luminance is in cd.
    pub fn intensity(&self, direction: DVec3) -> DVec3 {
        let (x, y) = direction.any_orthonormal_pair();
        let centre = (0.5 * (self.lower + self.upper)).as_dvec3();
        let half = (0.5 * (self.upper - self.lower)).as_dvec3();
        let reach = |axis: DVec3| axis.abs().dot(half);
        let cell = f64::from(self.cell().min_element());
        let counts = [x, y].map(|axis| (2.0 * reach(axis) / cell).ceil().max(1.0));
        let steps = [2.0 * reach(x) / counts[0], 2.0 * reach(y) / counts[1]];
        let depth = reach(direction) * 1.001;
        let mut sum = DVec3::ZERO;
        for j in 0..counts[1] as u32 {
            for i in 0..counts[0] as u32 {
                let across = x * ((f64::from(i) + 0.5) * steps[0] - reach(x));
                let up = y * ((f64::from(j) + 0.5) * steps[1] - reach(y));
                let origin = centre + across + up + direction * depth;
                let range = [0.0, 2.0 * depth as f32];
                let along = self.march(origin.as_vec3(), -direction.as_vec3(), range, cell as f32);
                sum += along.radiance.as_dvec3();
            }
        }
        sum * (steps[0] * steps[1])
    }

    /// Flux that leaves the grid, by its intensity in 66 directions over the sphere. Its luminance is in lm; over 4π it is the
    /// mean intensity.
    pub fn power(&self) -> DVec3 {
        2.0 * TAU * directions().map(|(d, weight)| self.intensity(d) * weight).sum::<DVec3>()
    }

    /// Flux that the cells emit, before anything is absorbed.
    pub fn emitted(&self) -> DVec3 {
        let cell = self.cell().as_dvec3();
        let sum: DVec3 = self.data.iter().map(|v| Vec3::new(v[0], v[1], v[2]).as_dvec3()).sum();
        2.0 * TAU * cell.x * cell.y * cell.z * sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box within empty cells, of one emission and absorption.
    fn block(n: u32, absorption: f32) -> Grid {
        let size = UVec3::splat(n);
        let mut data = Vec::new();
        for z in 0..n {
            for y in 0..n {
                for x in 0..n {
                    let edge = [x, y, z].iter().any(|v| *v == 0 || *v == n - 1);
                    data.push(if edge { [0.0; 4] } else { [3.0, 2.0, 1.0, absorption] });
                }
            }
        }
        let (lower, upper, space) = (Vec3::splat(-1.0), Vec3::ONE, ColourSpace::default());
        Grid { size, lower, upper, space, data, solid: vec![] }
    }

    #[test]
    fn values_lie_at_centres_and_nothing_outside() {
        let grid = block(8, 2.0);
        assert_eq!(grid.sample(grid.centre(UVec3::new(1, 4, 6))), Vec4::new(3.0, 2.0, 1.0, 2.0));
        let between = 0.5 * (grid.centre(UVec3::new(0, 4, 4)) + grid.centre(UVec3::new(1, 4, 4)));
        assert!((grid.sample(between) - Vec4::new(1.5, 1.0, 0.5, 1.0)).abs().max_element() < 1e-6);
        for outside in [Vec3::splat(1.01), Vec3::new(0.0, -1.2, 0.0), Vec3::NAN, Vec3::INFINITY] {
            assert_eq!(grid.sample(outside), Vec4::ZERO);
        }
    }

    #[test]
    fn what_does_not_absorb_lets_all_light_out_and_what_does_keeps_the_rest() {
        let thin = block(16, 0.0);
        let (power, emitted) = (thin.power(), thin.emitted());
        // Diagonal rays a cell apart see the sharp edges of 14 cells to 3.2e-3.
        assert!((power / emitted - DVec3::ONE).abs().max_element() < 1e-2, "{power} {emitted}");
        // Along an axis a column of 14 cells, with its slopes 14 cells long too: L = j/κ (1 − exp(−κ s)).
        let kappa = 4.0f64;
        let thick = block(16, kappa as f32);
        let along = thick.march(Vec3::new(0.01, 0.02, 5.0), Vec3::NEG_Z, [0.0, 10.0], 0.005);
        let length = 14.0 * 2.0 / 16.0;
        let radiance = 3.0 / kappa * -(-kappa * length).exp_m1();
        assert!((f64::from(along.radiance.x) / radiance - 1.0).abs() < 1e-3, "{along:?} {radiance}");
        assert!((f64::from(along.transmittance).ln() + kappa * length).abs() < 1e-2);
        // A ray that ends half way and one that looks elsewhere.
        assert!(thick.march(Vec3::Z * 5.0, Vec3::NEG_Z, [0.0, 3.0], 0.1).radiance == Vec3::ZERO);
        assert!(thick.march(Vec3::Z * 5.0, Vec3::Z, [0.0, 10.0], 0.1).transmittance == 1.0);
        assert!(thick.power().x < 0.3 * thick.emitted().x);
    }
}
