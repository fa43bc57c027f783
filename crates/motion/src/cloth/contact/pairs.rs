//! Finding of pairs: of the tree's nodes that are near, of their leaves, of what is in these.
//!
//! Neighbours in the cloth that face the same way do not touch (Volino and Magnenat Thalmann 1994, "Efficient Self-Collision Detection on
//! Smoothly Discretized Surface Animations Using Geometrical Shape Regularity"): they are left out, by nodes of the tree as large as that
//! holds for, and watched, so that they are let in when they cease to.

use super::{BLOCKS, Block, Close, Lists, PART, Pair, Shared, nearest_of_edges};
use crate::cloth::aabb::Aabb;
use crate::cloth::body::barycentric;
use crate::cloth::leaves::{LEAF, Leaf};
use crate::cloth::team::Parts;
use glam::{Vec3A, Vec4};
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

/// Nodes that each block has to compare, at the least.
const SHARES: usize = 4;
/// Part of the way it may move that a vertex has gone for its pairs to be found again when those of others are.
const GONE: f32 = 0.4;
/// Neighbours in the cloth do not touch each other where all normals of both, now and after the next substep, are nearer to each other than this when
/// leaves are compared, and later than that: 74 and 89 degrees.
const FLAT: [f32; 2] = [1.2, 1.4];
/// Depths of the tree, from the leaves up, at which neighbours are so told apart: so small a part of a panel cannot come around to itself while
/// it faces one way.
const DEPTHS: u32 = 4;
/// Leaves that are fitted as one task.
const FIT: usize = 128;

/// Where the triangles of a node face: their mean normal, and how far that of any is from it at the most. Normals are told apart by the distance of
/// unit vectors: 0 to 2.
#[derive(Clone, Copy, Default)]
pub(super) struct Cone {
    normal: Vec3A,
    spread: f32,
}

impl Cone {
    fn joined(self, o: Self) -> Self {
        let normal = (self.normal + o.normal).normalize_or_zero();
        Self { normal, spread: self.to(normal).max(o.to(normal)) }
    }

    /// How far the normal of any is from this one, at the most.
    fn to(self, normal: Vec3A) -> f32 {
        self.normal.distance(normal) + self.spread
    }

    /// How far two normals of both are from each other, at the most.
    fn apart(self, o: Self) -> f32 {
        self.to(o.normal) + o.spread
    }
}

/// In phases that follow one another: [`Shared::search`] at all places, [`Shared::fit`] of all leaves,
/// [`Shared::begin`], [`Shared::pair`] in all blocks, [`Shared::settle`] at all places. Once in a while before it [`Shared::face`] of all
/// leaves, [`Shared::watch`] in all blocks.
///
/// # Safety
/// As of all of [`Shared`].
#[allow(unsafe_code, clippy::missing_safety_doc)]
impl Shared<'_> {
    /// Takes over where places are. Pairs of those that have gone far since theirs were found, or have too little left of their way,
    /// are found again, and until then they may go as far as leaves are compared for; others may go as far as is left to them.
    pub unsafe fn search(&self, range: &Range<usize>, x: &[Vec4]) {
        // SAFETY: by the promise of the phases.
        let (at, lists) = unsafe { (self.at.part(range), &self.lists.read(&(0..1))[0]) };
        let far_at = unsafe { self.far_at.read(range) };
        let drift = lists.far_drift + lists.drift;
        let f = self.fixed;
        let mut most = 0.0f32;
        for (((at, x), far_at), place) in at.iter_mut().zip(x).zip(far_at).zip(range.clone()) {
            let (now, reach) = (Vec3A::from_vec4(*x), &self.reach[place]);
            let gone = (now - *at - lists.drift).length();
            let may = f32::from_bits(reach.load(Ordering::Relaxed));
            let left = may - gone;
            let far = (now - *far_at - drift).length();
            // What is no number is searched for.
            if gone <= GONE * may && left >= f.spare {
                reach.store(left.to_bits(), Ordering::Relaxed);
            } else {
                reach.store((f.farthest + (f.margin - far).max(0.0)).to_bits(), Ordering::Relaxed);
                for leaf in f.leaves.of(place) {
                    self.moved[*leaf as usize].store(lists.search.wrapping_add(1), Ordering::Relaxed);
                }
            }
            *at = now;
            most = most.max(far);
        }
        if most > f.margin {
            self.far.store(true, Ordering::Relaxed);
        }
    }

    /// How many tasks [`Shared::fit`] has.
    pub fn fits(&self) -> usize {
        self.fixed.leaves.leaves.len().div_ceil(FIT)
    }

    /// Boxes of leaves and of what is above them.
    pub unsafe fn fit(&self, task: usize) {
        let leaves = &self.fixed.leaves;
        let range = self.leaves_of(task);
        let count = leaves.leaves.len();
        // SAFETY: by the promise of the phases.
        let at = unsafe { self.at.read(&(0..self.at.len())) };
        let boxes = unsafe { self.boxes.part(&(range.start + count - 1..range.end + count - 1)) };
        for (bounds, leaf) in boxes.iter_mut().zip(&leaves.leaves[range.clone()]) {
            let triangles = &leaves.triangles[leaf.triangles.start as usize..leaf.triangles.end as usize];
            let corners = triangles.iter().flatten();
            *bounds = corners.fold(Aabb::NONE, |bounds, v| bounds.with(at[*v as usize]));
        }
        unsafe { rise(&self.boxes, boxes, range, FIT.ilog2(), Aabb::joined) };
    }

    fn leaves_of(&self, task: usize) -> Range<usize> {
        task * FIT..self.fixed.leaves.leaves.len().min((task + 1) * FIT)
    }

    /// Where leaves and small nodes face, now and after a substep of `h` seconds in which places at `x` go on with velocities `v`.
    pub unsafe fn face(&self, task: usize, x: &[Vec4], v: &[Vec4], h: f32) {
        let leaves = &self.fixed.leaves;
        let (count, range) = (leaves.leaves.len(), self.leaves_of(task));
        // SAFETY: by the promise of the phases.
        let cones = unsafe { self.cones.part(&(range.start + count - 1..range.end + count - 1)) };
        for (cone, leaf) in cones.iter_mut().zip(&leaves.leaves[range.clone()]) {
            let triangles = &leaves.triangles[leaf.triangles.start as usize..leaf.triangles.end as usize];
            let mut normals = [Vec3A::ZERO; 2 * LEAF];
            for (t, n) in triangles.iter().zip(normals.chunks_exact_mut(2)) {
                let at = t.map(|p| x[p as usize]);
                let goes = t.map(|p| x[p as usize] + v[p as usize] * h);
                for (n, of) in n.iter_mut().zip([at, goes]) {
                    let [a, b, c] = of.map(Vec3A::from_vec4);
                    *n = (b - a).cross(c - a).normalize_or_zero();
                }
            }
            let normal = normals.iter().sum::<Vec3A>().normalize_or_zero();
            let normals = &normals[..2 * triangles.len()];
            let spread = normals.iter().map(|n| n.distance_squared(normal)).fold(0.0, f32::max).sqrt();
            *cone = Cone { normal, spread };
        }
        unsafe { rise(&self.cones, cones, range, DEPTHS - 1, Cone::joined) };
    }

    /// Looks for neighbours of a block that have ceased to face the same way: they may have pairs from now on. Whether pairs must be found
    /// again.
    pub unsafe fn watch(&self, block: usize) -> bool {
        // SAFETY: by the promise of the phases.
        let found = unsafe { &mut self.blocks.part(&(block..block + 1))[0] };
        let cones = unsafe { self.cones.read(&(0..self.cones.len())) };
        let next = unsafe { self.lists.read(&(0..1))[0].search }.wrapping_add(1);
        let Block { flat, stack, .. } = found;
        flat.retain(|[a, b]| {
            // What is no number is not flat.
            let keeps = cones[*a as usize].apart(cones[*b as usize]) < FLAT[1];
            if !keeps {
                stack.push([*a, *b]);
            }
            keeps
        });
        if stack.is_empty() {
            return false;
        }
        let known = found.near.len();
        self.descend(found, cones, |_| true);
        for leaf in found.near[known..].iter().flatten() {
            self.moved[*leaf as usize].store(next, Ordering::Relaxed);
        }
        true
    }

    /// Of the nodes on the stack, those below them that face the same way as their neighbours, and leaves that may have pairs.
    fn descend(&self, found: &mut Block, cones: &[Cone], may_meet: impl Fn([u32; 2]) -> bool) {
        let Block { near, flat, stack, .. } = found;
        let (small, first) = (self.small(), self.fixed.leaves.leaves.len() as u32 - 1);
        while let Some([a, b]) = stack.pop() {
            if !may_meet([a, b]) {
                continue;
            }
            let apart = || cones[a as usize].apart(cones[b as usize]);
            if a >= small && apart() < FLAT[0] && self.fixed.leaves.beside([a, b]) {
                flat.push([a, b]);
            } else if a >= first {
                near.push([a - first, b - first]);
            } else {
                stack.extend(children([a, b]));
            }
        }
    }

    /// Begins a search; and, where vertices have moved too far since leaves were compared, shares that work out.
    pub unsafe fn begin(&self) {
        // SAFETY: by the promise of the phases, alone.
        let lists = unsafe { &mut self.lists.part(&(0..1))[0] };
        lists.far_drift += lists.drift;
        lists.drift = Vec3A::ZERO;
        lists.search = lists.search.wrapping_add(1);
        self.room.iter().for_each(|r| r.store(f32::INFINITY.to_bits(), Ordering::Relaxed));
        if !self.far.swap(false, Ordering::Relaxed) {
            return;
        }
        lists.far_drift = Vec3A::ZERO;
        lists.all = lists.search;
        let farthest = self.fixed.farthest + self.fixed.margin;
        self.reach.iter().for_each(|r| r.store(farthest.to_bits(), Ordering::Relaxed));
        let all = 0..self.at.len();
        unsafe { self.far_at.part(&all).copy_from_slice(self.at.read(&all)) };
        let boxes = unsafe { self.boxes.part(&(0..self.boxes.len())) };
        for i in (0..self.fits() - 1).rev() {
            boxes[i] = boxes[2 * i + 1].joined(boxes[2 * i + 2]);
        }
        // As many as blocks have work, from nodes so large that they cannot face one way.
        let [front, next] = &mut lists.front;
        front.clear();
        front.push([0, 0]);
        while front.len() < SHARES * BLOCKS && front[0][0] < self.small() {
            next.clear();
            next.extend(front.drain(..).flat_map(children).filter(|pair| self.fixed.may_meet(boxes, *pair)));
            std::mem::swap(front, next);
        }
    }

    /// The first of the nodes that are small enough to face one way.
    fn small(&self) -> u32 {
        (self.fixed.leaves.leaves.len() >> (DEPTHS - 1)).max(1) as u32 - 1
    }

    /// Finds leaves of a block that are near.
    unsafe fn compare(&self, block: usize, found: &mut Block) {
        // SAFETY: by the promise of the phases.
        let [front, _] = unsafe { &self.lists.read(&(0..1))[0].front };
        let boxes = unsafe { self.boxes.read(&(0..self.boxes.len())) };
        let cones = unsafe { self.cones.read(&(0..self.cones.len())) };
        found.near.clear();
        found.flat.clear();
        let each = front.len().div_ceil(BLOCKS);
        for pair in front.iter().skip(block * each).take(each) {
            found.stack.push(*pair);
            self.descend(found, cones, |pair| self.fixed.may_meet(boxes, pair));
        }
    }

    /// Finds the pairs of a block, if vertices of it have moved.
    pub unsafe fn pair(&self, block: usize) {
        // SAFETY: by the promise of the phases.
        let Lists { search, all, .. } = unsafe { &self.lists.read(&(0..1))[0] };
        let found = unsafe { &mut self.blocks.part(&(block..block + 1))[0] };
        if all == search {
            unsafe { self.compare(block, found) };
        }
        let moved = |leaf: u32| self.moved[leaf as usize].load(Ordering::Relaxed) == *search;
        let due = |[a, b]: [u32; 2]| all == search || moved(a) || moved(b);
        let near = std::mem::take(&mut found.near);
        let mut these = near.iter().filter(|pair| due(**pair)).peekable();
        if all == search || these.peek().is_some() {
            found.search = *search;
            found.left = 0.0;
            let Block { sides, crosses, .. } = found;
            // What was found of these leaves before is gone with them.
            for list in [sides, crosses] {
                list.retain(|pair| !due(pair.leaves));
            }
            these.for_each(|[a, b]| unsafe { self.pair_leaves(*a as usize, *b as usize, found) });
        }
        found.near = near;
    }

    unsafe fn pair_leaves(&self, a: usize, b: usize, found: &mut Block) {
        // SAFETY: by the promise of the phases.
        let count = self.fixed.leaves.leaves.len();
        let (bounds, at) =
            unsafe { (self.boxes.read(&(count - 1..2 * count - 1)), self.at.read(&(0..self.at.len()))) };
        let (f, query) = (self.fixed, self.fixed.query);
        let leaves = &f.leaves;
        let limit = |d: f32| {
            let room = (0.5 * PART * (d - f.radius)).max(f.farthest);
            [a, b].iter().for_each(|k| lower(&self.room[*k], room));
        };
        if a != b {
            let apart = bounds[a].distance(&bounds[b]);
            if apart > query {
                return limit(apart);
            }
        }
        let (one, two) = (&leaves.leaves[a], &leaves.leaves[b]);
        limit(query);
        let p = |v: u32| at[v as usize];
        let ringed = |v: u32, w: u32| f.ringed[v as usize] && f.ring[v as usize].binary_search(&w).is_ok();
        for (from, to, k) in [(one, two, b), (two, one, a)].iter().take(if a == b { 1 } else { 2 }) {
            let around = bounds[*k].grown(query);
            for v in &leaves.vertices[from.vertices.start as usize..from.vertices.end as usize] {
                let q = p(*v);
                if !around.has(q) {
                    continue;
                }
                for t in &leaves.triangles[to.triangles.start as usize..to.triangles.end as usize] {
                    let [q0, q1, q2] = t.map(p);
                    let bounds = Aabb { low: q0.min(q1).min(q2), high: q0.max(q1).max(q2) }.grown(query);
                    if !bounds.has(q) || t.contains(v) {
                        continue;
                    }
                    let w = barycentric(q.into(), q0.into(), q1.into(), q2.into());
                    let way = q - (q0 * w[0] + q1 * w[1] + q2 * w[2]);
                    let d = way.length();
                    if d < query {
                        let ring = t.iter().any(|w| ringed(*v, *w));
                        found.sides.push(Pair {
                            ring,
                            at: [*v, t[0], t[1], t[2]],
                            leaves: [a as u32, b as u32],
                            normal: way.normalize_or_zero(),
                        });
                    }
                }
            }
        }
        // Edges of both that come near the other, with their boxes.
        let close = |leaf: &Leaf, other: &Aabb, list: &mut Vec<Close>| {
            let around = other.grown(query);
            list.clear();
            for e in &leaves.edges[leaf.edges.start as usize..leaf.edges.end as usize] {
                let ends = e.map(p);
                let bounds = Aabb { low: ends[0].min(ends[1]), high: ends[0].max(ends[1]) };
                if bounds.meets(&around, 0.0) {
                    list.push((*e, ends, bounds));
                }
            }
        };
        let [mine, theirs] = &mut found.close;
        close(one, &bounds[b], mine);
        if a != b {
            close(two, &bounds[a], theirs);
        }
        for (i, (e, [p0, p1], bounds)) in mine.iter().enumerate() {
            let grown = bounds.grown(query);
            let others = if a == b { &mine[i + 1..] } else { &theirs[..] };
            for (other, [q0, q1], box_of) in others {
                if !grown.meets(box_of, 0.0) || e.iter().any(|v| other.contains(v)) {
                    continue;
                }
                let [s, t] = nearest_of_edges((*p0).into(), (*p1).into(), (*q0).into(), (*q1).into());
                let way = p0.lerp(*p1, s) - q0.lerp(*q1, t);
                let d = way.length();
                if d < query {
                    let ring = e.iter().any(|v| ringed(*v, other[0]) || ringed(*v, other[1]));
                    found.crosses.push(Pair {
                        ring,
                        at: [e[0], e[1], other[0], other[1]],
                        leaves: [a as u32, b as u32],
                        normal: way.normalize_or_zero(),
                    });
                }
            }
        }
    }

    /// Places go no farther than what was found of their leaves lets them.
    pub unsafe fn settle(&self, range: &Range<usize>) {
        for (place, reach) in range.clone().zip(&self.reach[range.clone()]) {
            let of = self.fixed.leaves.of(place).iter();
            let room = of.map(|k| self.room[*k as usize].load(Ordering::Relaxed)).min();
            if let Some(room) = room {
                reach.fetch_min(room, Ordering::Relaxed);
            }
        }
    }
}

/// Pairs of the children of two nodes of a depth, or of one.
fn children([a, b]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    let [l, r, m, s] = [2 * a + 1, 2 * a + 2, 2 * b + 1, 2 * b + 2];
    let all = if a == b { [[l, l], [l, r], [r, r], [r, r]] } else { [[l, m], [l, s], [r, m], [r, s]] };
    all.into_iter().take(if a == b { 3 } else { 4 })
}

/// From the leaves of a range so many depths up, where that many nodes lie above these alone.
///
/// # Safety
/// As of [`Parts::part`], of all nodes above the leaves of the range.
#[allow(unsafe_code)]
unsafe fn rise<'a, T: Copy>(
    nodes: &'a Parts<'_, T>,
    mut lower: &'a mut [T],
    range: Range<usize>,
    depths: u32,
    join: fn(T, T) -> T,
) {
    let leaves = nodes.len().div_ceil(2);
    for depth in 1..=depths {
        let [from, to, count] = [range.start, range.end, leaves].map(|n| n >> depth);
        if from == to {
            return;
        }
        // SAFETY: by the promise.
        let upper = unsafe { nodes.part(&(from + count - 1..to + count - 1)) };
        upper.iter_mut().zip(lower.chunks_exact(2)).for_each(|(up, two)| *up = join(two[0], two[1]));
        lower = upper;
    }
}

/// Makes a number no more than another, neither below nought: the bits of such have their order. Mostly it is less already, and memory is not
/// written to that other threads read.
#[inline(always)]
fn lower(bits: &AtomicU32, to: f32) {
    if to.to_bits() < bits.load(Ordering::Relaxed) {
        bits.fetch_min(to.to_bits(), Ordering::Relaxed);
    }
}
