//! Volumes that emit and absorb: what a ray meets in them, and directions in which to look for their light.
//!
//! A direction towards a volume is drawn by a point in it, which lies in a cell as often as the cell emits. What comes along
//! that direction is integrated over the whole line, not at the point alone ("line sampling"; Simon, Hanika, Zirr and
//! Dachsbacher 2017, "Line Integration for Rendering Heterogeneous Emissive Volumes"), so that there is no 1/r² to spoil it
//! close by and a direction that the material drew can be weighed against it.

use glam::{Mat3, Mat4, UVec3, Vec3, Vec4};
use std::sync::Arc;
use yugen_motion::fire::Grid;
use yugen_optics::distribution;

/// Most optical depth of one step of the integral.
const STEP: f32 = 0.25;

/// A [`Grid`] placed in the world.
#[derive(Clone, Debug)]
pub struct Volume {
    grid: Arc<Grid>,
    /// Factor of the emission.
    scale: f32,
    /// World to cells, where centre (i, j, k) is at that point.
    to_cells: Mat4,
    to_world: Mat4,
    /// First of the cells between centres that are not empty, and one past the last.
    occupied: [UVec3; 2],
    /// Per cell between centres, x fastest: chance that a sample lies in it or one before it.
    cumulative: Vec<f32>,
    /// One over the volume of a cell, world.
    per_cell: f32,
    /// Luminance of what it emits in all, per steradian.
    pub intensity: f32,
    /// Middle of what it emits, world.
    pub centre: Vec3,
    /// Root mean square distance of it from there.
    pub radius: f32,
}

/// What a ray meets in a volume.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Marched {
    /// Towards the ray's origin.
    pub radiance: Vec3,
    /// What part of the light behind comes through.
    pub transmittance: f32,
    /// Solid-angle density with which [`Volume::sample`] finds the line.
    pub pdf: f32,
}

impl Volume {
    /// `to_world`: of the grid, without shear. Emission and absorption are per unit of the world whatever its scale.
    pub fn new(grid: &Arc<Grid>, scale: f32, to_world: Mat4, luminance: Vec3) -> Self {
        let size = grid.size.as_vec3();
        let cell = (grid.upper - grid.lower) / size;
        let to_world = to_world * Mat4::from_translation(grid.lower + 0.5 * cell) * Mat4::from_scale(cell);
        let cells = grid.size - UVec3::ONE;
        let mut weights = Vec::with_capacity((cells.x * cells.y * cells.z) as usize);
        let mut occupied = [cells, UVec3::ZERO];
        let (mut sum, mut middle, mut square) = (0.0f64, glam::DVec3::ZERO, 0.0f64);
        for z in 0..cells.z {
            for y in 0..cells.y {
                for x in 0..cells.x {
                    let at = UVec3::new(x, y, z);
                    let corners = corners(grid, at);
                    let mean = corners.iter().sum::<Vec4>() * 0.125;
                    if mean != Vec4::ZERO {
                        occupied = [occupied[0].min(at), occupied[1].max(at + UVec3::ONE)];
                    }
                    let weight = f64::from(luminance.dot(mean.truncate()).max(0.0));
                    let place = to_world.transform_point3(at.as_vec3() + Vec3::splat(0.5)).as_dvec3();
                    sum += weight;
                    middle += weight * place;
                    square += weight * place.length_squared();
                    weights.push(weight);
                }
            }
        }
        let mut cumulative = vec![0.0; weights.len()];
        distribution::accumulate(weights.iter().copied(), &mut cumulative);
        let cell_volume = Mat3::from_mat4(to_world).determinant().abs();
        let centre = if sum > 0.0 { middle / sum } else { glam::DVec3::ZERO };
        let variance = if sum > 0.0 { square / sum - centre.length_squared() } else { 0.0 };
        Self {
            grid: grid.clone(),
            scale,
            to_cells: to_world.inverse(),
            to_world,
            occupied,
            cumulative,
            per_cell: 1.0 / cell_volume,
            intensity: sum as f32 * cell_volume * scale,
            centre: centre.as_vec3(),
            radius: variance.max(0.0).sqrt() as f32,
        }
    }

    /// A point in it, world, drawn as often as it emits there (the mean of a cell). `None` where it is dark.
    pub fn sample(&self, u: [f32; 3]) -> Option<Vec3> {
        if self.intensity <= 0.0 {
            return None;
        }
        let (i, rest, _) = distribution::choose(&self.cumulative, u[2]);
        let cells = (self.grid.size - UVec3::ONE).as_u64vec3();
        let i = i as u64;
        let at = glam::U64Vec3::new(i % cells.x, i / cells.x % cells.y, i / (cells.x * cells.y));
        Some(self.to_world.transform_point3(at.as_vec3() + Vec3::new(u[0], u[1], rest)))
    }

    /// Where a ray is among what is not empty, within `range`.
    pub fn crossing(&self, origin: Vec3, direction: Vec3, range: [f32; 2]) -> Option<[f32; 2]> {
        let (o, d) = (self.to_cells.transform_point3(origin), self.to_cells.transform_vector3(direction));
        let [lower, upper] = self.occupied.map(|c| c.as_vec3());
        let [mut near, mut far] = range;
        for k in 0..3 {
            if d[k] == 0.0 {
                if !(lower[k]..=upper[k]).contains(&o[k]) {
                    return None;
                }
            } else {
                let (a, b) = ((lower[k] - o[k]) / d[k], (upper[k] - o[k]) / d[k]);
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            }
        }
        (near < far).then_some([near, far])
    }

    /// What comes to `origin` from `direction` (unit) of what lies up to `until` away. The density is that of
    /// samples for a point `behind` the origin, of the whole line.
    pub fn march(&self, origin: Vec3, direction: Vec3, until: f32, behind: f32) -> Marched {
        let mut out = Marched { transmittance: 1.0, ..Marched::default() };
        let Some([near, far]) = self.crossing(origin, direction, [-behind, f32::INFINITY]) else {
            return out;
        };
        let (o, d) = (self.to_cells.transform_point3(origin), self.to_cells.transform_vector3(direction));
        let cells = self.grid.size - UVec3::ONE;
        let [first, last] = self.occupied.map(|c| c.as_ivec3());
        let start = (o + d * near).floor().as_ivec3().clamp(first, last - 1);
        let mut at = start;
        // Distance along the ray of the next face across each axis.
        let (mut next, mut step) = ([f32::INFINITY; 3], [0; 3]);
        for k in 0..3 {
            if d[k] != 0.0 {
                step[k] = if d[k] > 0.0 { 1 } else { -1 };
                next[k] = ((at[k] + i32::from(d[k] > 0.0)) as f32 - o[k]) / d[k];
            }
        }
        let per = d.abs().recip();
        let mut t = near;
        loop {
            let axis = if next[0] <= next[1] && next[0] <= next[2] {
                0
            } else if next[1] <= next[2] {
                1
            } else {
                2
            };
            let end = next[axis].min(far).max(t);
            let cell = at.as_uvec3();
            let i = ((cell.z * cells.y + cell.y) * cells.x + cell.x) as usize;
            let p = distribution::probability(&self.cumulative, i);
            if p > 0.0 && self.intensity > 0.0 {
                // ∫ (t + behind)² dt.
                let (a, b) = (t + behind, end + behind);
                out.pdf += p * self.per_cell * (b - a) * (a * a + a * b + b * b) * (1.0 / 3.0);
            }
            let (from, to) = (t.max(0.0), end.min(until));
            if to > from {
                self.integrate(cell, o - at.as_vec3(), d, [from, to], &mut out);
            }
            at[axis] += step[axis];
            if end >= far || at[axis] < first[axis] || at[axis] >= last[axis] {
                break;
            }
            t = end;
            next[axis] += per[axis];
        }
        out
    }

    /// Adds what a stretch of the ray meets in one cell. `o`, `d`: the ray in coordinates of the cell.
    fn integrate(&self, cell: UVec3, o: Vec3, d: Vec3, [from, to]: [f32; 2], out: &mut Marched) {
        let corners = corners(&self.grid, cell);
        if corners.iter().all(|v| *v == Vec4::ZERO) {
            return;
        }
        let value = |t: f32| {
            let f = (o + d * t).clamp(Vec3::ZERO, Vec3::ONE);
            let row = |i: usize| corners[i].lerp(corners[i + 1], f.x);
            let slice = |i: usize| row(i).lerp(row(i + 2), f.y);
            slice(0).lerp(slice(4), f.z)
        };
        let mut left = value(from);
        let whole = value(to);
        let thick = left.w.max(whole.w).max(value(0.5 * (from + to)).w) * (to - from);
        let steps = (thick / STEP).ceil().clamp(1.0, 64.0) as u32;
        let length = (to - from) / steps as f32;
        for i in 0..steps {
            let begin = from + length * i as f32;
            let (middle, right) = (value(begin + 0.5 * length), value(begin + length));
            // Simpson's rule, exact for the cubics that these are along a ray but for the exponential.
            let depth = length * (1.0 / 6.0) * (left.w + 4.0 * middle.w + right.w);
            let half = length * (1.0 / 24.0) * (5.0 * left.w + 8.0 * middle.w - right.w);
            let (t_half, t_all) =
                if depth > 0.0 { ((-half.max(0.0)).exp(), (-depth).exp()) } else { (1.0, 1.0) };
            let sum = left.truncate() + middle.truncate() * (4.0 * t_half) + right.truncate() * t_all;
            out.radiance += sum * (length * (1.0 / 6.0) * self.scale * out.transmittance);
            out.transmittance *= t_all;
            left = right;
        }
    }
}

/// Values at the corners of the cell between centres, x fastest.
fn corners(grid: &Grid, cell: UVec3) -> [Vec4; 8] {
    let [nx, ny] = [grid.size.x as usize, grid.size.y as usize];
    let first = (cell.z as usize * ny + cell.y as usize) * nx + cell.x as usize;
    std::array::from_fn(|i| {
        Vec4::from_array(grid.data[first + (i & 1) + (i >> 1 & 1) * nx + (i >> 2) * nx * ny])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;
    use std::f32::consts::PI;
    use yugen_optics::ColourSpace;
    use yugen_optics::random::Pcg32;

    /// Random values within a border of nothing, and much nothing on one side.
    fn grid(absorption: f32) -> Arc<Grid> {
        let size = UVec3::new(9, 6, 7);
        let mut rng = Pcg32::new(3, 1);
        let mut data = Vec::new();
        for z in 0..size.z {
            for y in 0..size.y {
                for x in 0..size.x {
                    let at = UVec3::new(x, y, z);
                    let empty = at.cmpeq(UVec3::ZERO).any() || at.cmpeq(size - 1).any() || x > 5;
                    let v = if empty { 0.0 } else { rng.next_f32() };
                    data.push([v, 2.0 * v * v, 0.5 * v, absorption * v]);
                }
            }
        }
        let (lower, upper) = (Vec3::new(-1.0, -0.5, 0.2), Vec3::new(1.0, 0.5, 1.4));
        Arc::new(Grid { size, lower, upper, space: ColourSpace::default(), data, solid: Vec::new() })
    }

    const LUMINANCE: Vec3 = Vec3::new(0.3, 0.6, 0.1);

    fn direction(u: Vec2) -> Vec3 {
        let z = 1.0 - 2.0 * u.x;
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * (2.0 * PI * u.y).cos(), r * (2.0 * PI * u.y).sin(), z)
    }

    #[test]
    fn what_a_ray_meets_is_what_a_fine_march_finds() {
        let mut rng = Pcg32::new(1, 1);
        for absorption in [0.0, 1.0, 40.0] {
            let grid = grid(absorption);
            let volume = Volume::new(&grid, 1.0, Mat4::IDENTITY, LUMINANCE);
            let mut worst = 0.0f32;
            for i in 0..200 {
                let mut number = || rng.next_f32();
                // Through it, from within it, along an axis.
                let target = grid.lower + (grid.upper - grid.lower) * Vec3::new(number(), number(), number());
                let d = if i % 5 == 0 { Vec3::AXES[i % 3] } else { direction(Vec2::new(number(), number())) };
                let origin = target - d * (i % 3) as f32;
                let until = if i % 4 == 0 { 1.1 } else { 9.0 };
                let truth = grid.march(origin, d, [0.0, until], 2e-4);
                let found = volume.march(origin, d, until, 0.0);
                let off = (found.radiance - truth.radiance).abs() / (truth.radiance + 1e-2);
                worst = worst.max(off.max_element());
                worst = worst.max((found.transmittance - truth.transmittance).abs());
            }
            // Worst seen 4e-4, where much is absorbed.
            assert!(worst < 2e-3, "{absorption}: {worst}");
        }
    }

    #[test]
    fn directions_are_drawn_as_densely_as_it_says() {
        let grid = grid(1.0);
        let place = Mat4::from_scale_rotation_translation(
            Vec3::splat(1.5),
            glam::Quat::from_rotation_x(0.7),
            Vec3::new(0.3, 0.1, -0.2),
        );
        let volume = Volume::new(&grid, 2.0, place, LUMINANCE);
        // Outside, near and within: light all together, and the density's integral.
        for origin in [Vec3::new(0.0, 4.0, 1.0), Vec3::new(0.0, 0.9, 0.6), volume.centre] {
            let mut rng = Pcg32::new(5, 1);
            let (mut by_samples, n) = (0.0f64, 40_000);
            for _ in 0..n {
                let p = volume.sample([rng.next_f32(), rng.next_f32(), rng.next_f32()]).unwrap();
                let d = (p - origin).normalize();
                let pdf = volume.march(origin, d, 0.0, 0.0).pdf;
                let light = volume.march(origin, d, 9.0, 0.0).radiance.x;
                by_samples += f64::from(light / pdf) / f64::from(n);
            }
            let (mut by_raster, m) = ([0.0f64; 2], 400);
            for j in 0..m {
                for i in 0..m {
                    let d = direction((Vec2::new(i as f32, j as f32) + 0.5) / m as f32);
                    let found = volume.march(origin, d, 9.0, 0.0);
                    let per = 4.0 * std::f64::consts::PI / f64::from(m * m);
                    by_raster[0] += f64::from(found.radiance.x) * per;
                    by_raster[1] += f64::from(found.pdf) * per;
                }
            }
            // Worst seen 2e-3, of the raster.
            for (a, b) in [by_samples, 1.0].iter().zip(by_raster) {
                assert!((a / b - 1.0).abs() < 8e-3, "{origin}: {by_samples} {by_raster:?}");
            }
        }
        // Seen from behind: the line is the same and further away.
        let (o, d) = (Vec3::new(0.0, 4.0, 1.0), (volume.centre - Vec3::new(0.0, 4.0, 1.0)).normalize());
        let (whole, later) = (volume.march(o, d, 9.0, 0.0), volume.march(o + d * 4.6, d, 9.0, 4.6));
        assert!((later.pdf / whole.pdf - 1.0).abs() < 1e-4 && later.radiance.x < whole.radiance.x);
    }

    #[test]
    fn what_is_dark_is_never_drawn_and_still_absorbs() {
        let smoke = Volume::new(&grid(1.0), 0.0, Mat4::IDENTITY, LUMINANCE);
        assert_eq!(smoke.sample([0.5; 3]), None);
        let met = smoke.march(Vec3::new(-0.3, 0.0, -1.0), Vec3::Z, 9.0, 0.0);
        assert!(met.radiance == Vec3::ZERO && met.pdf == 0.0 && met.transmittance < 0.9, "{met:?}");
        let nothing = Grid { data: vec![[0.0; 4]; 9 * 6 * 7], ..(*grid(1.0)).clone() };
        let nothing = Volume::new(&Arc::new(nothing), 1.0, Mat4::IDENTITY, LUMINANCE);
        assert_eq!(nothing.sample([0.5; 3]), None);
        let met = nothing.march(Vec3::ZERO, Vec3::Z, 9.0, 0.0);
        assert_eq!(met, Marched { transmittance: 1.0, ..Marched::default() });
    }
}
