//! On which side of its triangles a mesh has nothing more of itself, so that a ray which leaves it to there never meets it again: a floor,
//! a wall, a ball from outside.

use super::{IS_LEAF, NOTHING};
use glam::{DVec3, Vec3};
use yugen_scene::prepared::double_area_normal;

/// Nothing of the mesh lies before any of its triangles, on the side that their winding says.
pub const FRONT: u32 = 1;
/// Nothing lies behind any.
pub const BACK: u32 = 2;

/// How far a mesh may stand out over its triangles and still be taken for convex, in units of its largest coordinate: three times what
/// the origins of rays are moved off surfaces for rounding.
const ROUNDING: f64 = 4e-6;

/// Triangles of a scene that are looked at, each against its whole mesh, 14 µs a triangle of a ball: half a second. Flat meshes do not
/// count.
pub const MOST: usize = 1 << 15;

/// The sides of a mesh that are clear of it; none where `left`, which it lessens, does not suffice to know. `root`: the first row of its tree; `triangles` with an area; `at`: where a vertex is.
pub fn clear_sides(
    rows: &[[u32; 4]],
    root: usize,
    triangles: impl Iterator<Item = [u32; 3]> + Clone,
    at: &dyn Fn(u32) -> Vec3,
    left: &mut usize,
) -> u32 {
    let farthest = triangles.clone().flatten().map(|i| at(i).abs().max_element()).fold(0.0, f32::max);
    let room = ROUNDING * f64::from(farthest);
    // Slivers as narrow as that have no plane.
    let planes = triangles.filter_map(|t| {
        let [a, b, c] = t.map(|i| at(i).as_dvec3());
        let normal = double_area_normal(t.map(at));
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        (normal.length() > room * longest.sqrt()).then_some((a, normal))
    });
    let within = |(from, normal): (DVec3, DVec3)| {
        let n = normal.normalize();
        !reaches(rows, root, n, n.dot(from) + room, at)
    };
    let turned = |(from, normal): (DVec3, DVec3)| (from, -normal);
    // Of what is flat boxes say nothing, for all straddle its plane: it is looked at once.
    let largest = planes.clone().max_by(|a, b| a.1.length_squared().total_cmp(&b.1.length_squared()));
    if largest.is_none_or(|plane| within(plane) && within(turned(plane))) {
        return FRONT | BACK;
    }
    let mut clear = |plane| {
        *left = left.saturating_sub(1);
        *left > 0 && within(plane)
    };
    let front = planes.clone().all(&mut clear);
    let back = !front && planes.map(turned).all(&mut clear);
    u32::from(front) * FRONT + u32::from(back) * BACK
}

/// Whether some vertex below the node at `row` lies farther than `limit` along `n`.
fn reaches(rows: &[[u32; 4]], row: usize, n: DVec3, limit: f64, at: &dyn Fn(u32) -> Vec3) -> bool {
    let [head, children, low, high] = std::array::from_fn(|i| rows[row + i]);
    let planes = [[low[0], low[3]], [low[1], high[0]], [low[2], high[1]]];
    children.into_iter().enumerate().filter(|(_, child)| *child != NOTHING).any(|(slot, child)| {
        let farthest: f64 = (0..3)
            .map(|axis| {
                let step = f64::from(f32::from_bits((head[3] >> (8 * axis) & 255) << 23));
                let corner = f64::from(f32::from_bits(head[axis]));
                let plane = |k: usize| corner + f64::from(planes[axis][k] >> (8 * slot) & 255) * step;
                n[axis] * plane(usize::from(n[axis] > 0.0))
            })
            .sum();
        if farthest <= limit {
            return false;
        }
        if child & IS_LEAF == 0 {
            return reaches(rows, 4 * child as usize, n, limit, at);
        }
        let first = (child & 0x1fff_ffff) as usize;
        let leaf = &rows[first..=first + (child >> 29 & 3) as usize];
        leaf.iter().flat_map(|[a, b, c, _]| [*a, *b, *c]).any(|i| n.dot(at(i).as_dvec3()) > limit)
    })
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
