//! Cloth that touches itself: vertices and triangles, edges and edges.
//!
//! As in Chen, Hsu, Wang, Gascón, Macklin and Yuksel 2025, "Offset Geometric Contact": once in a while all pairs within a radius are
//! found, and until the next time no vertex moves farther than a part of the distance to the nearest of its pairs. So nothing can
//! pass, whatever springs pull, and no collision has to be looked for between two places. A tree of boxes over the triangles is
//! made once and only fitted anew; where neighbours in the cloth face the same way nothing is looked for.

use super::Cloth;
use super::body::barycentric;
use super::order::Order;
use super::springs::panels;
use glam::{Vec2, Vec3, Vec4};
use std::collections::HashSet;

/// Triangles of a leaf.
const LEAF: usize = 4;
/// Distance to keep, in mean edges, where the cloth is thinner: what is much thinner than its triangles would crumple.
const RADIUS: f32 = 0.2;
/// Distance within which pairs are found, in mean edges: so far that who is not paired may move as much as who touches.
const QUERY: f32 = 0.42;
/// Part of half the distance of a pair that a vertex may move.
const PART: f32 = 0.9;

/// A box around something.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const NONE: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    fn with(self, p: Vec3) -> Self {
        Self { low: self.low.min(p), high: self.high.max(p) }
    }

    fn joined(self, o: Self) -> Self {
        Self { low: self.low.min(o.low), high: self.high.max(o.high) }
    }

    fn meets(&self, o: &Self, gap: f32) -> bool {
        (self.low - gap).cmple(o.high).all() && (o.low - gap).cmple(self.high).all()
    }
}

/// Triangles with the vertices and edges that belong to them, each to one.
struct Leaf {
    triangles: Vec<[u32; 3]>,
    vertices: Vec<u32>,
    edges: Vec<[u32; 2]>,
    /// Mean normal, and the least cosine of a triangle's to it.
    normal: Vec3,
    cosine: f32,
    /// Leaves that it has a vertex in common with, itself among them.
    near: HashSet<u32>,
    /// Whether it has triangles of several panels.
    mixed: bool,
}

/// What touches what.
pub(super) struct Contacts {
    radius: f32,
    query: f32,
    friction: f32,
    leaves: Vec<Leaf>,
    /// A heap: children of i at 2i + 1 and 2i + 2; leaves last.
    boxes: Vec<Bounds>,
    /// Of each vertex, itself and those that are nearer than pairs in the flat cloth.
    ring: Vec<Vec<u32>>,
    /// A vertex and a triangle.
    sides: Vec<[u32; 4]>,
    /// Two edges.
    crosses: Vec<[u32; 4]>,
    stack: Vec<(u32, u32)>,
    /// Where vertices were when pairs were found, and how far from there each may be.
    at: Vec<Vec3>,
    reach: Vec<f32>,
    /// How far all have moved together since.
    drift: Vec3,
    held: bool,
}

impl Contacts {
    pub fn new(cloth: &Cloth, order: &Order, held: bool) -> Option<Self> {
        let sheet = &cloth.sheet;
        if sheet.triangles.is_empty() || cloth.springs.is_empty() {
            return None;
        }
        let n = cloth.masses.len();
        let edge = cloth.springs.iter().map(|s| s.rest).sum::<f32>() / cloth.springs.len() as f32;
        let place = |v: u32| order.place[v as usize];
        let radius = cloth.thickness.max(RADIUS * edge);
        let query = radius.max(QUERY * edge);
        // What is as near in the flat cloth does not touch for that.
        let mut ring: Vec<Vec<u32>> = (0..n as u32).map(|v| vec![v]).collect();
        for s in cloth.springs.iter().filter(|s| s.rest < 1.5 * query) {
            let [a, b] = s.ends.map(place);
            ring[a as usize].push(b);
            ring[b as usize].push(a);
        }
        ring.iter_mut().for_each(|r| r.sort_unstable());
        // Leaves by splitting triangles in two, over and over, along the longest side of what they cover of the flat cloth, panel
        // from panel first: layers that lie on each other are no neighbours.
        let panel_of = panels(sheet);
        let widest = sheet.flat.iter().flatten().fold(1.0f32, |w, p| w.max(p.abs().max_element()));
        let depth = sheet.triangles.len().div_ceil(LEAF).next_power_of_two();
        let mut order_of: Vec<u32> = (0..sheet.triangles.len() as u32).collect();
        let middle = |t: u32| {
            let flat: Vec2 = sheet.flat[t as usize].iter().sum();
            flat.extend(panel_of[t as usize] as f32 * 10.0 * widest)
        };
        split(&mut order_of, depth, &middle);
        let mut owned: HashSet<u32> = HashSet::new();
        let mut edges_of: HashSet<[u32; 2]> = HashSet::new();
        let count = sheet.triangles.len();
        let mut leaves = Vec::with_capacity(depth);
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
            let mut leaf = Leaf {
                triangles: Vec::new(),
                vertices: Vec::new(),
                edges: Vec::new(),
                normal: Vec3::ZERO,
                cosine: -1.0,
                near: HashSet::new(),
                mixed: order_of[from..to]
                    .windows(2)
                    .any(|t| panel_of[t[0] as usize] != panel_of[t[1] as usize]),
            };
            for t in &order_of[from..to] {
                let t = sheet.triangles[*t as usize].map(place);
                leaf.triangles.push(t);
                leaf.vertices.extend(t.iter().filter(|v| owned.insert(**v)));
                for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                    let e = [t[a].min(t[b]), t[a].max(t[b])];
                    if edges_of.insert(e) {
                        leaf.edges.push(e);
                    }
                }
            }
            leaves.push(leaf);
        }
        // Leaves that have a vertex in common.
        let mut leaves_of: Vec<Vec<u32>> = vec![Vec::new(); n];
        for (k, leaf) in leaves.iter().enumerate() {
            for v in leaf.triangles.iter().flatten() {
                if leaves_of[*v as usize].last() != Some(&(k as u32)) {
                    leaves_of[*v as usize].push(k as u32);
                }
            }
        }
        for leaf in &mut leaves {
            for v in leaf.triangles.iter().flatten() {
                leaf.near.extend(&leaves_of[*v as usize]);
            }
        }
        Some(Self {
            radius,
            query,
            friction: cloth.friction[1],
            boxes: vec![Bounds::NONE; 2 * leaves.len() - 1],
            leaves,
            ring,
            sides: Vec::new(),
            crosses: Vec::new(),
            stack: Vec::with_capacity(256),
            at: vec![Vec3::ZERO; n],
            // Pairs are looked for before anything moves.
            reach: vec![0.0; n],
            drift: Vec3::ZERO,
            held,
        })
    }

    /// Finds all pairs.
    pub fn find(&mut self, x: &[Vec4]) {
        for (at, x) in self.at.iter_mut().zip(x) {
            *at = x.truncate();
        }
        self.drift = Vec3::ZERO;
        // Two that are not paired are farther apart than the query, and end no nearer than the radius.
        let farthest = 0.5 * (self.query - self.radius).max(0.2 * self.radius) * PART;
        self.reach.fill(farthest);
        self.sides.clear();
        self.crosses.clear();
        let first = self.leaves.len() - 1;
        let at = &self.at;
        let p = |v: u32| at[v as usize];
        for (k, leaf) in self.leaves.iter_mut().enumerate() {
            let bounds = leaf.triangles.iter().flatten().fold(Bounds::NONE, |b, v| b.with(p(*v)));
            self.boxes[first + k] = bounds;
            let normal_of = |t: &[u32; 3]| (p(t[1]) - p(t[0])).cross(p(t[2]) - p(t[0])).normalize_or_zero();
            leaf.normal = leaf.triangles.iter().map(normal_of).sum::<Vec3>().normalize_or_zero();
            leaf.cosine = leaf.triangles.iter().map(|t| normal_of(t).dot(leaf.normal)).fold(1.0, f32::min);
        }
        for i in (0..first).rev() {
            self.boxes[i] = self.boxes[2 * i + 1].joined(self.boxes[2 * i + 2]);
        }
        let mut stack = std::mem::take(&mut self.stack);
        stack.push((0, 0));
        while let Some((a, b)) = stack.pop() {
            let (i, j) = (a as usize, b as usize);
            if a != b && !self.boxes[i].meets(&self.boxes[j], self.query) {
                continue;
            }
            match (i >= first, j >= first) {
                (true, true) => self.pair(i - first, j - first),
                _ if a == b => {
                    let (l, r) = (2 * a + 1, 2 * a + 2);
                    stack.extend([(l, l), (r, r), (l, r)]);
                }
                // All leaves lie equally deep: both are nodes.
                _ => {
                    let (l, r) = (2 * a + 1, 2 * a + 2);
                    let (m, s) = (2 * b + 1, 2 * b + 2);
                    stack.extend([(l, m), (l, s), (r, m), (r, s)]);
                }
            }
        }
        self.stack = stack;
    }

    fn pair(&mut self, a: usize, b: usize) {
        let (one, two) = (&self.leaves[a], &self.leaves[b]);
        // Neighbours that face the same way do not touch each other.
        let tight = |l: &Leaf| l.cosine > 0.8 && !l.mixed;
        if one.near.contains(&(b as u32)) && tight(one) && tight(two) && one.normal.dot(two.normal) > 0.6 {
            return;
        }
        let at = &self.at;
        let p = |v: u32| at[v as usize];
        let query = self.query;
        let near = |v: u32, w: u32| self.ring[v as usize].binary_search(&w).is_ok();
        let reach = &mut self.reach;
        let mut shorten = |vertices: &[u32], d: f32| {
            for v in vertices {
                let r = &mut reach[*v as usize];
                *r = r.min(0.5 * PART * d);
            }
        };
        for (from, to) in [(one, two), (two, one)].iter().take(if a == b { 1 } else { 2 }) {
            for t in &to.triangles {
                let [q0, q1, q2] = t.map(p);
                let bounds = Bounds { low: q0.min(q1).min(q2) - query, high: q0.max(q1).max(q2) + query };
                for v in &from.vertices {
                    let q = p(*v);
                    let inside = bounds.low.cmple(q).all() && q.cmple(bounds.high).all();
                    if !inside || t.iter().any(|w| near(*v, *w)) {
                        continue;
                    }
                    let w = barycentric(q, q0, q1, q2);
                    let d = q.distance(q0 * w[0] + q1 * w[1] + q2 * w[2]);
                    if d < query {
                        self.sides.push([*v, t[0], t[1], t[2]]);
                        shorten(&[*v, t[0], t[1], t[2]], d);
                    }
                }
            }
        }
        for (i, e) in one.edges.iter().enumerate() {
            let [p0, p1] = e.map(p);
            let bounds = Bounds { low: p0.min(p1), high: p0.max(p1) };
            let others = if a == b { &two.edges[i + 1..] } else { &two.edges[..] };
            for f in others {
                let [q0, q1] = f.map(p);
                let other = Bounds { low: q0.min(q1), high: q0.max(q1) };
                if !bounds.meets(&other, query) || e.iter().any(|v| near(*v, f[0]) || near(*v, f[1])) {
                    continue;
                }
                let [s, t] = nearest_of_edges(p0, p1, q0, q1);
                let d = p0.lerp(p1, s).distance(q0.lerp(q1, t));
                if d < query {
                    self.crosses.push([e[0], e[1], f[0], f[1]]);
                    shorten(&[e[0], e[1], f[0], f[1]], d);
                }
            }
        }
    }

    /// Pushes pairs apart that are nearer than the radius, vertices being at `x` + `u`, with friction.
    pub fn solve(&self, x: &[Vec4], u: &mut [Vec4], inverse: &[f32]) {
        for pair in &self.sides {
            let v = pair.map(|v| v as usize);
            let q = v.map(|v| (x[v] + u[v]).truncate());
            let w = barycentric(q[0], q[1], q[2], q[3]);
            self.part(u, inverse, v, [1.0, -w[0], -w[1], -w[2]], &q);
        }
        for pair in &self.crosses {
            let v = pair.map(|v| v as usize);
            let q = v.map(|v| (x[v] + u[v]).truncate());
            let [s, t] = nearest_of_edges(q[0], q[1], q[2], q[3]);
            self.part(u, inverse, v, [1.0 - s, s, t - 1.0, -t], &q);
        }
    }

    /// Two points of weights that sum up to one and minus one.
    #[inline]
    fn part(&self, u: &mut [Vec4], inverse: &[f32], v: [usize; 4], c: [f32; 4], q: &[Vec3; 4]) {
        let between = (q[0] * c[0] + q[1] * c[1]) + (q[2] * c[2] + q[3] * c[3]);
        let square = between.length_squared();
        if square >= self.radius * self.radius || square < 1e-20 {
            return;
        }
        let d = square.sqrt();
        let w = v.map(|v| inverse[v]);
        let sum: f32 = (0..4).map(|k| w[k] * c[k] * c[k]).sum();
        if sum <= 0.0 {
            return;
        }
        let n = between / d;
        let push = self.radius - d;
        // By how much the two points slide past each other in this substep.
        let slide = (u[v[0]] * c[0] + u[v[1]] * c[1] + u[v[2]] * c[2] + u[v[3]] * c[3]).truncate();
        let slide = slide - n * slide.dot(n);
        let far = slide.length();
        let hold = if far > 0.0 { (self.friction * push / far).min(1.0) } else { 0.0 };
        let by = (n * push - slide * hold) / sum;
        for k in 0..4 {
            u[v[k]] += (by * (w[k] * c[k])).extend(0.0);
        }
    }

    /// Keeps a vertex from going farther than it may; whether pairs must be found again.
    #[inline]
    pub fn hold(&self, place: usize, x: Vec4, u: &mut Vec4) -> bool {
        let from = self.at[place] + self.drift;
        let way = (x + *u).truncate() - from;
        let (far, reach) = (way.length(), self.reach[place]);
        if far > reach {
            *u = (from + way * (reach / far) - x.truncate()).extend(0.0);
        }
        far > 0.7 * reach
    }

    /// Takes the mean motion as that which all have in common: what moves together does not come nearer.
    pub fn follow(&mut self, x: &[Vec4], u: &[Vec4]) {
        // Attached vertices go where they are told, and do not follow.
        if self.held {
            return;
        }
        let mut sum = Vec3::ZERO;
        for ((x, u), at) in x.iter().zip(u).zip(&self.at) {
            sum += (*x + *u).truncate() - *at;
        }
        self.drift = sum / self.at.len() as f32;
    }
}

/// Sorts triangles so that halves of halves lie side by side.
fn split(list: &mut [u32], leaves: usize, middle: &impl Fn(u32) -> Vec3) {
    if leaves <= 1 || list.len() <= 1 {
        return;
    }
    let bounds = list.iter().fold(Bounds::NONE, |b, t| b.with(middle(*t)));
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

/// Parts of the way along two edges where they are nearest to each other (Ericson 2005, "Real-Time Collision Detection", 5.1.9).
pub(super) fn nearest_of_edges(p0: Vec3, p1: Vec3, q0: Vec3, q1: Vec3) -> [f32; 2] {
    let (d1, d2, r) = (p1 - p0, q1 - q0, p0 - q0);
    let (a, e, f) = (d1.length_squared(), d2.length_squared(), d2.dot(r));
    if a <= 1e-20 || e <= 1e-20 {
        return [0.0, if e > 1e-20 { (f / e).clamp(0.0, 1.0) } else { 0.0 }];
    }
    let (b, c) = (d1.dot(d2), d1.dot(r));
    let denominator = a * e - b * b;
    // Parallel edges: anywhere.
    let s = if denominator > 1e-6 * a * e { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.5 };
    let t = (b * s + f) / e;
    if t < 0.0 {
        [(-c / a).clamp(0.0, 1.0), 0.0]
    } else if t > 1.0 {
        [((b - c) / a).clamp(0.0, 1.0), 1.0]
    } else {
        [s, t]
    }
}

/// Edges that go through triangles of which they have no corner: of each, both.
pub(super) fn crossings(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<([u32; 2], u32)> {
    // Boxes sorted along x, and those that overlap there compared.
    let p = |v: u32| positions[v as usize];
    let mut known = HashSet::new();
    let mut edges: Vec<([u32; 2], Bounds)> = Vec::new();
    for t in triangles {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let e = [t[a].min(t[b]), t[a].max(t[b])];
            if known.insert(e) {
                edges.push((e, Bounds::NONE.with(p(e[0])).with(p(e[1]))));
            }
        }
    }
    let mut faces: Vec<(u32, Bounds)> = triangles
        .iter()
        .enumerate()
        .map(|(i, t)| (i as u32, t.iter().fold(Bounds::NONE, |b, v| b.with(p(*v)))))
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
            let volume = |a: glam::DVec3, b: glam::DVec3, c: glam::DVec3, d: glam::DVec3| {
                (b - a).cross(c - a).dot(d - a)
            };
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
