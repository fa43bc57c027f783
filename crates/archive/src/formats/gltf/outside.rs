//! Which meshes nobody sees from behind.

use glam::{DVec3, Vec3};
use std::collections::HashMap;
use yugen_scene::Mesh;

/// Whether the mesh is closed and its triangles face outwards: then its backs are seen only from inside, and need not
/// be looked through. Vertices at the same place count as one, as exporters double them along seams.
pub(super) fn only_seen_from_outside(mesh: &Mesh) -> bool {
    let mut places: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.positions.len());
    // Minus zero is zero.
    let bits = |p: Vec3| (p + 0.0).to_array().map(f32::to_bits);
    let ids: Vec<u32> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = places.len() as u32;
            *places.entry(bits(*p)).or_insert(next)
        })
        .collect();
    let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
    let mut volume = 0.0;
    let origin = mesh.positions.first().copied().unwrap_or_default();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| ids[i as usize]);
        if a == b || b == c || c == a {
            continue;
        }
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.push((from.min(to), from.max(to), from < to));
        }
        let [a, b, c] = t.map(|i| -> DVec3 { (mesh.positions[i as usize] - origin).as_dvec3() });
        volume += a.dot(b.cross(c));
    }
    edges.sort_unstable();
    // Every edge as often one way as the other.
    let closed = edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).all(|same| {
        let forward = same.iter().filter(|e| e.2).count();
        2 * forward == same.len()
    });
    closed && volume > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_closed_and_one_that_is_open_or_inside_out_is_not() {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
        // Every face with corners of its own, as with flat normals.
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut mesh = Mesh::default();
        for face in faces {
            let at = mesh.positions.len() as u32;
            mesh.positions.extend(face.map(corner));
            mesh.triangles.extend([[at, at + 1, at + 2], [at, at + 2, at + 3]]);
        }
        assert!(only_seen_from_outside(&mesh));
        let mut inside_out = mesh.clone();
        inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!(!only_seen_from_outside(&inside_out));
        mesh.triangles.pop();
        assert!(!only_seen_from_outside(&mesh));
    }
}
