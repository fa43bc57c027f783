//! Leaves of the bounding-volume hierarchy of a cloth: groups of at most [`LEAF`] triangles, which lie beside each other in the flat cloth.
//!
//! Nodes are numbered as in a heap: children of i are 2i + 1 and 2i + 2, and leaves, a power of two of them, come last.

use super::Sheet;
use super::aabb::Aabb;
use super::springs::panels;
use glam::{Vec2, Vec3};
use std::collections::HashSet;
use std::ops::Range;

/// Triangles of a leaf, at the most: between four and sixteen, by the time of a large sheet and of robes (docs/cloth.md).
pub(super) const LEAF: usize = 8;

/// Triangles with the vertices and edges that belong to them, each to one: ranges of the lists.
pub(super) struct Leaf {
    pub triangles: Range<u32>,
    pub vertices: Range<u32>,
    pub edges: Range<u32>,
}

/// What is known of a node without its place.
#[derive(Clone, Default)]
struct Node {
    /// Nodes of the same depth with which it has a vertex in common, itself among them, sorted.
    beside: Vec<u32>,
    /// The panel of its triangles, unless they are of several.
    panel: Option<u32>,
}

/// All leaves, a power of two of them, and the lists of which they have ranges; vertices by their places.
pub(super) struct Leaves {
    pub leaves: Vec<Leaf>,
    pub triangles: Vec<[u32; 3]>,
    pub vertices: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    /// Of each place, the leaves with a triangle at it, one place after the other, and where they begin.
    of: Vec<u32>,
    firsts: Vec<u32>,
    nodes: Vec<Node>,
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
        let mut nodes = vec![Node::default(); 2 * depth - 1];
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
            });
            let panels: Vec<u32> = ranked[from..to].iter().map(|t| panel_of[*t as usize]).collect();
            let same = panels.windows(2).all(|p| p[0] == p[1]);
            nodes[depth - 1 + k].panel = panels.first().copied().filter(|_| same);
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
        for (k, leaf) in leaves.iter().enumerate() {
            let of = corners(leaf).flat_map(|v| of[*v as usize].iter().map(|k| k + depth as u32 - 1));
            nodes[depth - 1 + k].beside = sorted(of.collect());
        }
        for i in (0..depth - 1).rev() {
            let [l, r] = [&nodes[2 * i + 1], &nodes[2 * i + 2]];
            let panel = if l.panel == r.panel { l.panel } else { None };
            let beside = l.beside.iter().chain(&r.beside).map(|k| (k - 1) / 2);
            nodes[i] = Node { beside: sorted(beside.collect()), panel };
        }
        let firsts = of.iter().scan(0, |sum, of| Some(std::mem::replace(sum, *sum + of.len() as u32)));
        let firsts = firsts.chain([of.iter().map(Vec::len).sum::<usize>() as u32]).collect();
        Self { leaves, triangles, vertices, edges, of: of.concat(), firsts, nodes }
    }

    /// Whether two nodes of a depth are neighbours in the cloth, both of one panel; of leaves also where there is a seam between them.
    pub fn beside(&self, [a, b]: [u32; 2]) -> bool {
        let [one, two] = [a, b].map(|k| &self.nodes[k as usize]);
        let (Some(p), Some(q)) = (one.panel, two.panel) else { return false };
        (p == q || a as usize >= self.leaves.len() - 1) && one.beside.binary_search(&b).is_ok()
    }

    /// The leaves with a triangle at a place.
    #[inline(always)]
    pub fn of(&self, place: usize) -> &[u32] {
        &self.of[self.firsts[place] as usize..self.firsts[place + 1] as usize]
    }
}

fn sorted(mut list: Vec<u32>) -> Vec<u32> {
    list.sort_unstable();
    list.dedup();
    list
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
