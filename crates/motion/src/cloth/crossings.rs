//! Where cloth passes through itself.

use super::aabb::Aabb;
use glam::{DVec3, IVec3, Vec3};
use std::collections::{HashMap, HashSet};

/// Size of the cells in which triangles are looked up, in the extent of the largest. From 1 to 4 it makes no difference.
const CELL: f32 = 2.0;

/// Each pair of an edge and a triangle it pierces, without shared corner, sorted.
pub(super) fn crossings(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<([u32; 2], u32)> {
    let p = |v: u32| positions[v as usize];
    let bounds = |vertices: &[u32]| vertices.iter().fold(Aabb::NONE, |b, v| b.with(p(*v).into()));
    let boxes: Vec<Aabb> = triangles.iter().map(|t| bounds(t)).collect();
    // Triangles by the cell of the low corner of their boxes. What meets an edge's box begins at the most as far below it as the largest is wide (and a
    // hair, for that is rounded). Cells are several times as large, so that this is mostly in one or two of them along each axis.
    let widest = boxes.iter().map(|b| (b.high - b.low).max_element()).fold(f32::MIN_POSITIVE, f32::max);
    let size = CELL * widest;
    let cell = |p: Vec3| (p / size).floor().clamp(Vec3::splat(-1e9), Vec3::splat(1e9)).as_ivec3();
    let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
    for (i, b) in boxes.iter().enumerate() {
        cells.entry(cell(b.low.into())).or_default().push(i as u32);
    }
    let mut known = HashSet::new();
    let mut found = Vec::new();
    for t in triangles {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let e = [t[a].min(t[b]), t[a].max(t[b])];
            if !known.insert(e) || !e.iter().all(|v| p(*v).is_finite()) {
                continue;
            }
            let around = bounds(&e);
            let low = cell(Vec3::from(around.low) - 1.001 * widest);
            let high = cell(around.high.into());
            for x in low.x..=high.x {
                for y in low.y..=high.y {
                    for z in low.z..=high.z {
                        let of = cells.get(&IVec3::new(x, y, z)).into_iter().flatten();
                        let met = of.filter(|i| around.meets(&boxes[**i as usize], 0.0));
                        found.extend(met.filter(|i| pierces(p, e, triangles[**i as usize])).map(|i| (e, *i)));
                    }
                }
            }
        }
    }
    found.sort_unstable();
    found
}

/// Whether an edge goes through a triangle of which it has no corner.
fn pierces(p: impl Fn(u32) -> Vec3, e: [u32; 2], t: [u32; 3]) -> bool {
    if t.iter().any(|v| e.contains(v)) {
        return false;
    }
    let [a, b, c] = t.map(|v| p(v).as_dvec3());
    let [o, q] = e.map(|v| p(v).as_dvec3());
    let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
    let normal = (b - a).cross(c - a);
    if normal.dot(o - a) * normal.dot(q - a) >= 0.0 {
        return false;
    }
    let sides = [volume(o, q, a, b), volume(o, q, b, c), volume(o, q, c, a)];
    sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number from 0 to 1, a different one for each `i`.
    fn mixed(i: u32) -> f32 {
        (i.wrapping_mul(0x9e37_79b9) ^ i.wrapping_mul(0x85eb_ca6b).rotate_left(13)) as f32 / u32::MAX as f32
    }

    #[test]
    fn cells_miss_no_edge_through_a_triangle() {
        // Triangles of all sizes on both sides of nought, one of which is a hundred times as large as most.
        let point = |i: u32| Vec3::new(mixed(3 * i), mixed(3 * i + 1), mixed(3 * i + 2)) - 0.5;
        let triangles: Vec<[u32; 3]> = (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let size = |i: u32| if i == 7 { 1.0 } else { 0.1 + 0.2 * mixed(5000 + i) };
        let positions: Vec<Vec3> = (0..900).map(|v| point(1000 + v / 3) + point(v) * size(v / 3)).collect();
        let p = |v: u32| positions[v as usize];
        let mut all = Vec::new();
        for [a, b, c] in &triangles {
            for [v, w] in [[a, b], [b, c], [a, c]] {
                let e = [*v, *w];
                let through = (0..triangles.len()).filter(|i| pierces(p, e, triangles[*i]));
                all.extend(through.map(|i| (e, i as u32)));
            }
        }
        all.sort_unstable();
        println!("{} edges", all.len());
        assert!(all.len() > 100);
        assert_eq!(crossings(&positions, &triangles), all);
    }
}
