//! Where cloth passes through itself.

use super::aabb::Aabb;
use glam::{DVec3, Vec3};
use std::collections::HashSet;

/// Each pair of an edge and a triangle it pierces, without shared corner, sorted.
pub(super) fn crossings(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<([u32; 2], u32)> {
    // Boxes sorted along x, and those that overlap there compared.
    let p = |v: u32| positions[v as usize];
    let mut known = HashSet::new();
    let mut edges: Vec<([u32; 2], Aabb)> = Vec::new();
    for t in triangles {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let e = [t[a].min(t[b]), t[a].max(t[b])];
            if known.insert(e) {
                edges.push((e, Aabb::NONE.with(p(e[0]).into()).with(p(e[1]).into())));
            }
        }
    }
    let mut faces: Vec<(u32, Aabb)> = triangles
        .iter()
        .enumerate()
        .map(|(i, t)| (i as u32, t.iter().fold(Aabb::NONE, |b, v| b.with(p(*v).into()))))
        .collect();
    edges.sort_by(|a, b| a.1.low.x.total_cmp(&b.1.low.x));
    faces.sort_by(|a, b| a.1.low.x.total_cmp(&b.1.low.x));
    let widest = faces.iter().map(|f| f.1.high.x - f.1.low.x).fold(0.0, f32::max);
    let mut found = Vec::new();
    for (e, bounds) in &edges {
        let start = faces.partition_point(|f| f.1.low.x < bounds.low.x - widest);
        for (i, other) in faces[start..].iter().take_while(|f| f.1.low.x <= bounds.high.x) {
            let t = triangles[*i as usize];
            if !bounds.meets(other, 0.0) || t.iter().any(|v| e.contains(v)) {
                continue;
            }
            let [a, b, c] = t.map(|v| p(v).as_dvec3());
            let [o, q] = e.map(|v| p(v).as_dvec3());
            let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
            let (above, below) = (volume(a, b, c, o), volume(a, b, c, q));
            if above * below >= 0.0 {
                continue;
            }
            let sides = [volume(o, q, a, b), volume(o, q, b, c), volume(o, q, c, a)];
            if sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0) {
                found.push((*e, *i));
            }
        }
    }
    found.sort_unstable();
    found
}
