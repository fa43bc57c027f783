//! On which side of its triangles a mesh has nothing more of itself, so that a ray which leaves it to there never meets it again: a floor,
//! a wall, a ball from outside.

use glam::{DVec3, Vec3};
use yugen_scene::prepared::double_area_normal;

/// Nothing of the mesh lies before any of its triangles, on the side that their winding says.
pub const FRONT: u32 = 1;
/// Nothing lies behind any.
pub const BACK: u32 = 2;

/// How far a mesh may stand out over its triangles and still be taken for convex, in units of its largest coordinate: three times what
/// the origins of rays are moved off surfaces for rounding.
const ROUNDING: f64 = 4e-6;

/// Triangles of a scene that are looked at, each against the boxes of its whole mesh. Flat meshes do not count.
pub const MOST: usize = 1 << 15;

/// Triangles of a block, whose box is looked at before they are.
const BLOCK: usize = 32;

/// The sides of a mesh that are clear of it; none where `left`, which it lessens, does not suffice to know. `triangles`: those with an
/// area, neighbours one after the other.
pub fn clear_sides(triangles: impl Iterator<Item = [Vec3; 3]> + Clone, left: &mut usize) -> u32 {
    let farthest = triangles.clone().flatten().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    let room = ROUNDING * f64::from(farthest);
    let planes = triangles.clone().filter_map(|t| plane(t, room));
    let largest = planes.clone().max_by(|a, b| a.2.total_cmp(&b.2));
    let Some((normal, from, _)) = largest else { return FRONT | BACK };
    let far_from = |p: &Vec3| (normal.dot(p.as_dvec3()) - from).abs() > room;
    if !triangles.clone().flatten().any(|p| far_from(&p)) {
        return FRONT | BACK;
    }
    let count = triangles.clone().count();
    if count > *left {
        return 0;
    }
    *left -= count;
    let blocks = Blocks::new(triangles.collect());
    let slack = 1e-6 * farthest;
    let front = planes.clone().all(|(normal, from, _)| !blocks.reach(normal, from + room, slack));
    let back = !front && planes.clone().all(|(normal, from, _)| !blocks.reach(-normal, room - from, slack));
    u32::from(front) * FRONT + u32::from(back) * BACK
}

/// The unit normal of a triangle, how far along it its plane lies, and twice its area; none of slivers as narrow as `room`.
fn plane(t: [Vec3; 3], room: f64) -> Option<(DVec3, f64, f64)> {
    let [a, b, c] = t.map(|p| p.as_dvec3());
    let normal = double_area_normal(t);
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    let area = normal.length();
    (area > room * longest.sqrt()).then(|| (normal / area, (normal / area).dot(a), area))
}

/// Triangles in blocks, and the boxes of these: middles and halves by axes.
struct Blocks {
    triangles: Vec<[Vec3; 3]>,
    middles: [Vec<f32>; 3],
    halves: [Vec<f32>; 3],
}

impl Blocks {
    fn new(triangles: Vec<[Vec3; 3]>) -> Self {
        let boxes: Vec<[Vec3; 2]> = triangles
            .chunks(BLOCK)
            .map(|block| {
                let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
                block.iter().flatten().fold(none, |[low, high], p| [low.min(*p), high.max(*p)])
            })
            .collect();
        let middles = [0, 1, 2].map(|k| boxes.iter().map(|[low, high]| 0.5 * (low[k] + high[k])).collect());
        let halves = [0, 1, 2].map(|k| boxes.iter().map(|[low, high]| 0.5 * (high[k] - low[k])).collect());
        Self { triangles, middles, halves }
    }

    /// Whether some vertex lies farther than `limit` along `n`; boxes are known to `slack`.
    fn reach(&self, n: DVec3, limit: f64, slack: f32) -> bool {
        let ([x, y, z], [a, b, c]) = (&self.middles, &self.halves);
        let (f, least) = (n.as_vec3(), limit as f32 - slack);
        let g = f.abs();
        (0..x.len()).any(|k| {
            let farthest = f.x * x[k] + f.y * y[k] + f.z * z[k] + (g.x * a[k] + g.y * b[k] + g.z * c[k]);
            let block = || &self.triangles[BLOCK * k..self.triangles.len().min(BLOCK * (k + 1))];
            farthest > least && block().iter().flatten().any(|p| n.dot(p.as_dvec3()) > limit)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hierarchy::Hierarchy;
    use glam::{Mat4, Quat};
    use std::sync::Arc;
    use yugen_scene::prepared::Rows;
    use yugen_scene::{Geometry, Mesh, Scene, Shape, primitives};

    /// The sides of the first draw that are clear of it.
    fn clear_of(mesh: Mesh, to_world: Mat4, flip_normals: bool) -> u32 {
        let mesh = Geometry::Mesh(Arc::new(mesh));
        let shape = Shape { flip_normals, ..Shape::new("thing", mesh, to_world, 0) };
        let mut rows = Rows::default();
        let scene = Scene { shapes: vec![shape], ..Scene::default() };
        rows.add_shapes(&scene, &|_| false, &|_| None).expect("the scene is sound");
        let hierarchy = Hierarchy::build(&rows, 1).expect("a hierarchy");
        hierarchy.rows()[4 + 3][3]
    }

    #[test]
    fn balls_blocks_and_grids_are_clear_where_they_are_convex() {
        let turned = Mat4::from_quat(Quat::from_rotation_y(0.7) * Quat::from_rotation_x(0.4));
        let moved = |mut mesh: Mesh| {
            // In its own coordinates, so that no plane is along an axis.
            mesh.positions
                .iter_mut()
                .for_each(|p| *p = turned.transform_point3(*p) + Vec3::new(0.3, -2.0, 1.0));
            mesh.normals.clear();
            mesh.tangents.clear();
            mesh
        };
        let mirror = Mat4::from_scale(Vec3::new(-1.0, 1.0, 2.0));
        for mesh in [primitives::ball(24), primitives::ball(64), primitives::block(Vec3::new(1.0, 2.0, 0.5))]
        {
            for mesh in [mesh.clone(), moved(mesh)] {
                assert_eq!(clear_of(mesh.clone(), turned, false), FRONT);
                assert_eq!(clear_of(mesh.clone(), Mat4::IDENTITY, true), BACK);
                // Normals of the mesh stay outside when it is mirrored; those of its winding turn.
                let out = if mesh.normals.is_empty() { BACK } else { FRONT };
                assert_eq!(clear_of(mesh, mirror, false), out);
            }
        }
        let grid = primitives::grid(3.0, 2.0, [20, 30]);
        assert_eq!(clear_of(grid.clone(), turned, false), FRONT | BACK);
        assert_eq!(clear_of(moved(grid.clone()), Mat4::IDENTITY, false), FRONT | BACK);
        // A dent in the middle, or a bump.
        for height in [0.01, -0.01] {
            let mut uneven = grid.clone();
            let n = uneven.positions.len() / 2;
            let normal = (uneven.positions[1] - uneven.positions[0])
                .cross(uneven.positions[n] - uneven.positions[0])
                .normalize();
            uneven.positions[n] += height * normal;
            assert_eq!(clear_of(uneven, turned, false), 0);
        }
    }
}
