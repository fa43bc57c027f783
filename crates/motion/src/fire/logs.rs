//! The fuel bed: split logs, crossed in layers, that glow where they face one another.

use super::{Burning, Grid};
use crate::noise::noise;
use glam::{Quat, Vec3};
use yugen_optics::random::Pcg32;

/// Logs of a layer and layers; length and radius over the bed's diameter.
const LAYERS: [u32; 3] = [4, 3, 3];
const LENGTH: f32 = 0.82;
const RADIUS: f32 = 0.062;
/// Corners around a log and rings along it.
const AROUND: u32 = 14;
const ALONG: u32 = 18;
/// The coolest and the hottest surface, K: charred ends, and embers between logs with air from below. Assumed; burning
/// charcoal has 1000 to 1500 K.
const KELVIN: [f32; 2] = [550.0, 1330.0];
/// How fast embers brighten and fade, 1/s.
const BREATH: f64 = 0.35;

/// Logs as a mesh, with what is needed to say how they glow.
#[derive(Clone, Debug, PartialEq)]
pub struct Logs {
    /// Of vertices, m.
    pub positions: Vec<Vec3>,
    /// Of vertices, unit, outwards.
    pub normals: Vec<Vec3>,
    /// Vertices of each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Where each vertex is in the bed's own noise.
    places: Vec<Vec3>,
    /// Of each log: the middles of its ends, m, and its mean radius.
    bars: Vec<([Vec3; 2], f32)>,
    /// How much heat each vertex gets from its neighbours, 0 to 1.
    heat: Vec<f32>,
}

impl Logs {
    /// Notes what part of each cell of `grid` they fill, by eight points of it.
    pub fn fill(&self, grid: &mut Grid) {
        let cell = grid.cell();
        let corners: [Vec3; 8] = std::array::from_fn(|i| {
            let side = |k: usize| if i >> k & 1 == 1 { 0.25 } else { -0.25 };
            cell * Vec3::new(side(0), side(1), side(2))
        });
        let (low, high) =
            self.bars.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), (ends, r)| {
                (low.min(ends[0] - *r).min(ends[1] - *r), high.max(ends[0] + *r).max(ends[1] + *r))
            });
        let holds = |p: Vec3| {
            self.bars.iter().any(|([a, b], r)| {
                let (along, to) = (*b - *a, p - *a);
                let t = to.dot(along) / along.length_squared();
                (0.0..=1.0).contains(&t) && (to - t * along).length_squared() < r * r
            })
        };
        grid.solid = grid
            .centres()
            .map(|p| {
                if p.cmplt(low - cell).any() || p.cmpgt(high + cell).any() {
                    return 0.0;
                }
                corners.iter().filter(|c| holds(p + **c)).count() as f32 / 8.0
            })
            .collect();
    }
}

impl Burning {
    /// The logs of the fuel bed. They lie still.
    pub fn logs(&self) -> Logs {
        let d = self.fire.diameter;
        let mut random = Pcg32::new(u64::from(self.fire.seed), 0x6c_6f_67_73);
        let mut logs = Logs {
            positions: vec![],
            normals: vec![],
            triangles: vec![],
            places: vec![],
            bars: vec![],
            heat: vec![],
        };
        for (layer, count) in LAYERS.into_iter().enumerate() {
            for i in 0..count {
                let mut about = |by: f32| by * (2.0 * random.next_f32() - 1.0);
                // Layers cross; each log is a little off.
                let turn = layer as f32 * 1.1 + about(0.3);
                let beside = (i as f32 + 0.5) / count as f32 - 0.5;
                let radius = RADIUS * d * (1.0 + about(0.25));
                let length = LENGTH * d * (1.0 - 0.9 * beside * beside + about(0.06));
                let spin = Quat::from_rotation_y(turn) * Quat::from_rotation_z(about(0.12));
                let middle =
                    Vec3::new(about(0.04) * d, (0.065 + 0.105 * layer as f32) * d, 0.72 * beside * d);
                let middle = Quat::from_rotation_y(turn) * middle;
                let seed = Vec3::new(about(100.0), about(100.0), about(100.0));
                self.log(&mut logs, middle, spin, [length, radius], seed);
            }
        }
        logs
    }

    fn log(&self, logs: &mut Logs, middle: Vec3, spin: Quat, [length, radius]: [f32; 2], seed: Vec3) {
        let first = logs.positions.len() as u32;
        let d = self.fire.diameter;
        let end =
            |x: f32| self.fire.foot + self.shape.frame * (middle + spin * Vec3::new(x * length, 0.0, 0.0));
        logs.bars.push(([end(-0.5), end(0.5)], radius));
        // A ring more at each end, drawn in to a point: the cut faces.
        let rings = ALONG + 2;
        let point = |ring: u32, corner: u32| {
            let along = ((ring.clamp(1, ALONG) - 1) as f32 / (ALONG - 1) as f32 - 0.5) * length;
            let angle = std::f32::consts::TAU * (corner % AROUND) as f32 / AROUND as f32;
            let side = Vec3::new(0.0, angle.cos(), angle.sin());
            let at = Vec3::new(along / radius * 0.35, side.y, side.z);
            // Split wood: not round, with ridges along the grain.
            let rough = 1.0 + 0.34 * noise(at + seed).0 + 0.2 * noise(at * Vec3::new(0.6, 3.1, 3.1) + seed).0;
            let open = if ring == 0 || ring == rings - 1 { 0.0 } else { rough };
            Vec3::new(along, 0.0, 0.0) + side * (radius * open)
        };
        for ring in 0..rings {
            for corner in 0..AROUND {
                let p = point(ring, corner);
                let along = point(ring + 1, corner) - point(ring.saturating_sub(1), corner);
                let around = point(ring, corner + 1) - point(ring, corner + AROUND - 1);
                let cap = if ring == 0 { -Vec3::X } else { Vec3::X };
                let normal = around.cross(along).try_normalize().unwrap_or(cap);
                // Upwards of the middle of the bed, and where others are near, it is hot.
                let local = middle + spin * p;
                let ends = (Vec3::new(local.x, 0.0, local.z).length() / (0.5 * d)).min(1.2);
                let down = 0.5 - 0.5 * (spin * normal).y;
                let heat = (1.15 - ends * ends) * (0.45 + 0.55 * down);
                logs.positions.push(self.fire.foot + self.shape.frame * local);
                logs.normals.push(self.shape.frame * (spin * normal));
                logs.places.push(p * (7.0 / d) + seed);
                logs.heat.push(heat.clamp(0.0, 1.0));
            }
        }
        for ring in 0..rings - 1 {
            for corner in 0..AROUND {
                let at = |ring: u32, corner: u32| first + ring * AROUND + corner % AROUND;
                let [a, b] = [at(ring, corner), at(ring, corner + 1)];
                let [c, e] = [at(ring + 1, corner), at(ring + 1, corner + 1)];
                logs.triangles.push([a, b, c]);
                logs.triangles.push([c, b, e]);
            }
        }
        // Where the end rings close to a point, one of the two triangles has no area.
        logs.triangles.retain(|t| {
            let [a, b, c] = t.map(|i| logs.positions[i as usize]);
            (b - a).cross(c - a).length() > 1e-12
        });
    }

    /// Temperature of each vertex of the logs at `seconds`, K.
    pub fn ember_temperatures(&self, logs: &Logs, seconds: f64) -> Vec<f32> {
        let slow = (self.moment(seconds).0 * BREATH).rem_euclid(256.0) as f32;
        logs.places
            .iter()
            .zip(&logs.heat)
            .map(|(place, heat)| {
                let patches = 0.5 + 0.9 * noise(*place + Vec3::new(0.0, slow, 0.0)).0;
                let cracks = 1.0 - (noise(*place * 2.3).0 * 5.0).abs().min(1.0);
                let glow = heat * (0.55 * patches + 0.6 * cracks * patches + 0.25);
                KELVIN[0] + (KELVIN[1] - KELVIN[0]) * glow.clamp(0.0, 1.0)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fire::Fire;
    use glam::{DMat3, DVec3};
    use yugen_optics::ColourSpace;

    #[test]
    fn logs_fill_their_cells_and_keep_the_light_that_they_hide() {
        let burning = Fire { foot: Vec3::new(1.0, 0.5, -2.0), ..Fire::default() }
            .light(ColourSpace::default())
            .unwrap();
        let logs = burning.logs();
        let flame = burning.at(2.0);
        let open = flame.grid(flame.cells(0.0225)).unwrap();
        let mut grid = open.clone();
        logs.fill(&mut grid);
        let filled = grid.solid.iter().sum::<f32>() * grid.cell().element_product();
        // Where logs cross they share cells; the mesh is rough about the same radius.
        let volume: f32 =
            logs.bars.iter().map(|([a, b], r)| std::f32::consts::PI * r * r * a.distance(*b)).sum();
        assert!((0.75..1.02).contains(&(filled / volume)), "{filled} {volume}");
        // The cells and what they emit are the same; less of it leaves, and slabs are what leaves.
        assert_eq!(grid.data, open.data);
        let leaving = |grid: &Grid| grid.slabs(1, 0, DVec3::Y, DMat3::IDENTITY)[0].blob.power;
        let (all, left) = (leaving(&open), leaving(&grid));
        println!("{:.2} of the light leaves past the logs", left.y / all.y);
        assert!((0.5..0.9).contains(&(left.y / all.y)), "{left} {all}");
        let slabs = grid.slabs(4, 64, DVec3::Y, DMat3::IDENTITY);
        let sum: DVec3 = slabs.iter().map(|s| s.blob.power).sum();
        assert!((sum / left - DVec3::ONE).abs().max_element() < 1e-5, "{sum} {left}");
    }
}
