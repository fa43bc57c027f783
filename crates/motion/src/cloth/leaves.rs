//! Leaves of the bounding-volume hierarchy of a cloth: groups of at most [`LEAF`] triangles, which lie beside each other in the flat cloth.

use super::Sheet;
use super::aabb::Aabb;
use super::springs::panels;
use glam::{Vec2, Vec3};
use std::collections::HashSet;
use std::ops::Range;

/// Triangles of a leaf.
pub(super) const LEAF: usize = 4;

/// Triangles with the vertices and edges that belong to them, each to one: ranges of the lists.
pub(super) struct Leaf {
    pub triangles: Range<u32>,
    pub vertices: Range<u32>,
    pub edges: Range<u32>,
    /// Leaves that it has a vertex in common with, itself among them, sorted.
    pub near: Vec<u32>,
    /// Whether it has triangles of several panels.
    pub mixed: bool,
}

/// All leaves, a power of two of them, and the lists of which they have ranges; vertices by their places.
pub(super) struct Leaves {
    pub leaves: Vec<Leaf>,
    pub triangles: Vec<[u32; 3]>,
    pub vertices: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    /// Of each place, the leaves with a triangle at it.
    pub of: Vec<Vec<u32>>,
}

impl Leaves {
    /// Of a sheet with triangles, whose vertices are at the places `place` says.
    pub fn new(sheet: &Sheet, place: &impl Fn(u32) -> u32) -> Self {
        let n = sheet.positions.len();
        // Leaves by splitting triangles in two, over and over, along the longest side of what they cover of the flat cloth, panel
        // from panel first: layers that lie on each other are no neighbours.
        let panel_of = panels(sheet);
        let widest = sheet.flat.iter().flatten().fold(1.0f32, |w, p| w.max(p.abs().max_element()));
        let depth = sheet.triangles.len().div_ceil(LEAF).next_power_of_two();
        let mut ranked: Vec<u32> = (0..sheet.triangles.len() as u32).collect();
        let middle = |t: u32| {
            let flat: Vec2 = sheet.flat[t as usize].iter().sum();
            flat.extend(panel_of[t as usize] as f32 * 10.0 * widest)
        };
        split(&mut ranked, depth, &middle);
        let mut owned: HashSet<u32> = HashSet::new();
        let mut edges_of: HashSet<[u32; 2]> = HashSet::new();
        let count = sheet.triangles.len();
        let mut leaves = Vec::with_capacity(depth);
        let (mut triangles, mut vertices, mut edges) = (Vec::with_capacity(count), Vec::new(), Vec::new());
        for k in 0..depth {
            // The same halves as `split` has.
            let (mut from, mut to) = (0, count);
            let mut width = depth;
            let mut rest = k;
            while width > 1 {
                let half = from + (to - from) / 2;
                width /= 2;
                if rest >= width {
                    from = half;
                    rest -= width;
                } else {
                    to = half;
                }
            }
            let firsts = [triangles.len(), vertices.len(), edges.len()];
            for t in &ranked[from..to] {
                let t = sheet.triangles[*t as usize].map(place);
                triangles.push(t);
                vertices.extend(t.iter().filter(|v| owned.insert(**v)));
                for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                    let e = [t[a].min(t[b]), t[a].max(t[b])];
                    if edges_of.insert(e) {
                        edges.push(e);
                    }
                }
            }
            let range = |first: usize, len: usize| first as u32..len as u32;
            leaves.push(Leaf {
                triangles: range(firsts[0], triangles.len()),
                vertices: range(firsts[1], vertices.len()),
                edges: range(firsts[2], edges.len()),
                near: Vec::new(),
                mixed: ranked[from..to]
                    .windows(2)
                    .any(|t| panel_of[t[0] as usize] != panel_of[t[1] as usize]),
            });
        }
        // Leaves that have a vertex in common.
        let mut of: Vec<Vec<u32>> = vec![Vec::new(); n];
        let corners = |leaf: &Leaf| {
            triangles[leaf.triangles.start as usize..leaf.triangles.end as usize].iter().flatten()
        };
        for (k, leaf) in leaves.iter().enumerate() {
            for v in corners(leaf) {
                if of[*v as usize].last() != Some(&(k as u32)) {
                    of[*v as usize].push(k as u32);
                }
            }
        }
        for leaf in &mut leaves {
            let mut near: Vec<u32> = corners(leaf).flat_map(|v| of[*v as usize].iter().copied()).collect();
            near.sort_unstable();
            near.dedup();
            leaf.near = near;
        }
        Self { leaves, triangles, vertices, edges, of }
    }
}

/// Sorts triangles so that halves of halves lie side by side.
fn split(list: &mut [u32], leaves: usize, middle: &impl Fn(u32) -> Vec3) {
    if leaves <= 1 || list.len() <= 1 {
        return;
    }
    let bounds = list.iter().fold(Aabb::NONE, |b, t| b.with(middle(*t).into()));
    let size = bounds.high - bounds.low;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let half = list.len() / 2;
    list.select_nth_unstable_by(half, |a, b| middle(*a)[axis].total_cmp(&middle(*b)[axis]).then(a.cmp(b)));
    let (low, high) = list.split_at_mut(half);
    split(low, leaves / 2, middle);
    split(high, leaves / 2, middle);
}
