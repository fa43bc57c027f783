//! Cloth that touches itself: vertices and triangles, edges and edges.
//!
//! As in Chen, Hsu, Wang, Gascón, Macklin and Yuksel 2025, "Offset Geometric Contact": once in a while all pairs within a radius are
//! found, and until the next time no vertex moves farther than a part of the distance to the nearest of its pairs, so that no
//! collision has to be searched for between two places. A vertex that is paired may always move at a speed of [`LEAST`], so cloth that
//! limbs squeeze flat can pass. A tree of boxes over the triangles is made once and only fitted anew.
//!
//! Three lists, each made from the one before when it is due. Leaves of the tree that are near, with a margin that lasts for about a
//! frame. Pairs of vertices, triangles and edges within reach, when a vertex has gone as far as it may: several times a frame, and only
//! of leaves of which a vertex has gone far since; others may go as far as is left to them. Pairs that touch, with weights of where. All
//! are made by all threads, in blocks of a fixed number, each a part of the tree against another, and pairs are
//! pushed apart one after the other in the order of the blocks: same bits for any number of threads.
//!
//! Neighbours in the cloth that face the same way do not touch (Volino and Magnenat Thalmann 1994, "Efficient Self-Collision Detection on
//! Smoothly Discretized Surface Animations Using Geometrical Shape Regularity"): they are left out, by nodes of the tree as large as that
//! holds for, and watched, so that they are let in when they cease to.

use super::Cloth;
use super::aabb::Aabb;
use super::body::{RECOVERY, barycentric};
use super::leaves::{LEAF, Leaf, Leaves};
use super::order::Order;
use super::team::Parts;
use glam::{Vec3, Vec3A, Vec4};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Distance to keep, in mean edges, where the cloth is thinner: what is much thinner than its triangles would crumple.
const RADIUS: f32 = 0.2;
/// Distance within which pairs are found, in mean edges: so far that who is not paired may move as much as who touches.
const QUERY: f32 = 0.42;
/// How far vertices may move before leaves are compared again, in mean edges.
const MARGIN: f32 = 0.5;
/// Part of half the distance of a pair that a vertex may move.
const PART: f32 = 0.9;
/// Speed at which a vertex may move whatever it is near to, m/s. What is squeezed flat between two limbs, or passes through itself,
/// would else stay where it is while a limb goes on: so fast are limbs of a dance.
const LEAST: f32 = 0.5;
/// Blocks of the work on pairs: several for each of a dozen threads, and so small that what has moved is in few of them.
pub(super) const BLOCKS: usize = 256;
/// Nodes that each block has to compare, at the least.
const SHARES: usize = 4;
/// Part of the way it may move that a vertex has gone for its pairs to be found again when those of others are.
const GONE: f32 = 0.4;
/// Of the distance to keep, within which a pair may come to touch while others are pushed.
const TOUCH: f32 = 1.1;
/// Of the distance to keep, what pairs may be nearer at the end of a pass; those that are have more passes, this many at the most. Where a
/// belt presses layers on each other, what one pair is pushed another has to take on, and where that ended they were pressed through each
/// other: in robes of five sizes of triangles up to five crossings were left by dressing, with three passes in one of them, with eight none.
const DEEP: f32 = 0.8;
const PASSES: u32 = 8;
/// Of the distance to keep, how much nearer two that are not paired may come before the next search, where no more lies between that
/// distance and the one within which pairs are found. Assumed: by less, pairs of thick cloth would be searched for in nearly every substep;
/// by more, less would be left than keeps layers from passing through each other.
const NEARER: f32 = 0.2;
/// Neighbours in the cloth do not touch each other where all normals of both are nearer to each other than this when leaves are compared, and
/// later than that: half a right angle and sixty degrees. With half as much again four edges passed through triangles of a robe that was drawn
/// up over its belt.
const FLAT: [f32; 2] = [0.8, 1.0];
/// Depths of the tree, from the leaves up, at which neighbours are so told apart: so small a part of a panel cannot come around to itself while
/// it faces one way.
const DEPTHS: u32 = 5;

/// Where the triangles of a node face: how far the normal of any is from their mean.
#[derive(Clone, Copy, Default)]
struct Cone {
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

/// A part of the tree compared with another, or with itself, and what was found there.
#[derive(Default)]
struct Block {
    /// Leaves that may have pairs.
    near: Vec<[u32; 2]>,
    /// Nodes that have none while they face the same way.
    flat: Vec<[u32; 2]>,
    /// Nodes that are still to be compared.
    stack: Vec<[u32; 2]>,
    /// A vertex and a triangle.
    sides: Vec<Pair>,
    /// Two edges.
    crosses: Vec<Pair>,
    /// Those of them that touch, with the weights of their nearest points, which sum up to one and minus one.
    touching: Vec<([u32; 4], [f32; 4])>,
    /// Edges of two leaves that are near to each other, while they are compared.
    close: [Vec<Close>; 2],
    /// The number of the search in which pairs were found.
    search: u32,
}

/// Four places, and the leaves that they were found in.
struct Pair {
    at: [u32; 4],
    leaves: [u32; 2],
}

/// An edge, its ends and its box.
type Close = ([u32; 2], [Vec3A; 2], Aabb);

/// What does not change.
struct Fixed {
    radius: f32,
    query: f32,
    margin: f32,
    /// How far vertices that are paired may always move between two searches, m.
    least: f32,
    /// What must be left to a vertex of the way it may go, or its pairs are found again: `least`, where all may go farther than that.
    spare: f32,
    /// How far at the most: two that are not paired are farther apart than the query, and end no nearer than the radius; of cloth that is
    /// nearly as thick as the query or thicker, no nearer than the radius less [`NEARER`] of it.
    farthest: f32,
    friction: f32,
    leaves: Leaves,
    /// Of each vertex, those that are nearer than the radius in the flat cloth: mostly none.
    ring: Vec<Vec<u32>>,
    /// Whether there are such.
    ringed: Vec<bool>,
    /// Places that go where they are told.
    attached: Vec<u32>,
}

impl Fixed {
    /// Whether nodes are so near that their leaves must be compared.
    #[inline(always)]
    fn may_meet(&self, boxes: &[Aabb], [a, b]: [u32; 2]) -> bool {
        a == b || boxes[a as usize].meets(&boxes[b as usize], self.query + 2.0 * self.margin)
    }
}

/// What one thread changes while the others wait.
struct Lists {
    /// Nodes from which blocks begin, and those they come from.
    front: [Vec<[u32; 2]>; 2],
    /// How far all have moved together since pairs were found; and since leaves were compared.
    drift: Vec3A,
    far_drift: Vec3A,
    /// How often pairs have been searched for, and the last time when all were.
    search: u32,
    all: u32,
    /// Pairs that have another pass, each by its block and its number there.
    deep: Vec<[u32; 2]>,
}

/// What touches what.
pub(super) struct Contacts {
    fixed: Fixed,
    /// Of each node, when pairs were found.
    boxes: Vec<Aabb>,
    /// Of each node of the lowest [`DEPTHS`], when last looked at.
    cones: Vec<Cone>,
    lists: [Lists; 1],
    blocks: Vec<Block>,
    /// Where vertices were when pairs were found, and how far from there each may be, as bits: the least of several threads.
    at: Vec<Vec3A>,
    reach: Vec<AtomicU32>,
    /// Where they were when leaves were compared.
    far_at: Vec<Vec3A>,
    /// Whether leaves must be compared again.
    far: AtomicBool,
    /// Of each leaf, the number of the search before which a vertex of it had moved.
    moved: Vec<AtomicU32>,
    /// Of each leaf, how far its vertices may go for what is found of others in a search, as bits.
    room: Vec<AtomicU32>,
}

/// [`Contacts`] as threads share them in a step.
pub(super) struct Shared<'a> {
    fixed: &'a Fixed,
    boxes: Parts<'a, Aabb>,
    cones: Parts<'a, Cone>,
    lists: Parts<'a, Lists>,
    blocks: Parts<'a, Block>,
    at: Parts<'a, Vec3A>,
    reach: &'a [AtomicU32],
    far_at: Parts<'a, Vec3A>,
    far: &'a AtomicBool,
    moved: &'a [AtomicU32],
    room: &'a [AtomicU32],
}

impl Contacts {
    /// For substeps of `h` seconds.
    pub fn new(cloth: &Cloth, order: &Order, attached: Vec<u32>, h: f32) -> Option<Self> {
        let sheet = &cloth.sheet;
        if sheet.triangles.is_empty() || cloth.springs.is_empty() {
            return None;
        }
        let n = cloth.masses.len();
        let edge = cloth.springs.iter().map(|s| s.rest).sum::<f32>() / cloth.springs.len() as f32;
        let place = |v: u32| order.place[v as usize];
        let radius = cloth.thickness.max(RADIUS * edge);
        let query = radius.max(QUERY * edge);
        let (least, farthest) = (LEAST * h, 0.5 * (query - radius).max(NEARER * radius) * PART);
        // What is as near in the flat cloth does not touch for that.
        let mut ring: Vec<Vec<u32>> = vec![Vec::new(); n];
        for s in cloth.springs.iter().filter(|s| s.rest < 1.5 * radius) {
            let [a, b] = s.ends.map(place);
            ring[a as usize].push(b);
            ring[b as usize].push(a);
        }
        ring.iter_mut().for_each(|r| r.sort_unstable());
        let leaves = Leaves::new(sheet, &place);
        let count = leaves.leaves.len();
        let lists = Lists {
            front: Default::default(),
            drift: Vec3A::ZERO,
            far_drift: Vec3A::ZERO,
            search: 0,
            all: 0,
            deep: Vec::new(),
        };
        Some(Self {
            boxes: vec![Aabb::NONE; 2 * count - 1],
            cones: vec![Cone::default(); 2 * count - 1],
            lists: [lists],
            blocks: (0..BLOCKS).map(|_| Block::default()).collect(),
            at: vec![Vec3A::ZERO; n],
            // Pairs are searched for before anything moves.
            reach: (0..n).map(|_| AtomicU32::new(0)).collect(),
            far_at: vec![Vec3A::ZERO; n],
            far: AtomicBool::new(true),
            moved: (0..count).map(|_| AtomicU32::new(0)).collect(),
            room: (0..count).map(|_| AtomicU32::new(0)).collect(),
            fixed: Fixed {
                radius,
                query,
                margin: MARGIN * edge,
                least,
                spare: least.min(0.5 * farthest),
                farthest,
                friction: cloth.friction[1],
                leaves,
                ringed: ring.iter().map(|r| !r.is_empty()).collect(),
                ring,
                attached,
            },
        })
    }

    /// Leaves are compared again at the next search, as if there had been none before.
    pub fn forget(&mut self) {
        self.far.store(true, Ordering::Relaxed);
    }

    /// For the threads of a step.
    pub fn shared(&mut self) -> Shared<'_> {
        Shared {
            fixed: &self.fixed,
            boxes: Parts::new(&mut self.boxes),
            cones: Parts::new(&mut self.cones),
            lists: Parts::new(&mut self.lists),
            blocks: Parts::new(&mut self.blocks),
            at: Parts::new(&mut self.at),
            reach: &self.reach,
            far_at: Parts::new(&mut self.far_at),
            far: &self.far,
            moved: &self.moved,
            room: &self.room,
        }
    }
}

/// Leaves that are fitted as one task.
const FIT: usize = 128;

/// Finding of pairs, in phases that follow one another: [`Shared::search`] at all places, [`Shared::fit`] of all leaves,
/// [`Shared::begin`], [`Shared::pair`] in all blocks, [`Shared::settle`] at all places. Once in a while before it [`Shared::face`] of all
/// leaves, [`Shared::watch`] in all blocks. Then in each substep [`Shared::touch`] in all blocks, [`Shared::part`].
///
/// # Safety
/// Of all: a phase is over before the next begins, and the tasks of a phase have different numbers or ranges.
#[allow(unsafe_code, clippy::missing_safety_doc)]
impl Shared<'_> {
    /// The distance that cloth keeps from itself, m.
    pub fn radius(&self) -> f32 {
        self.fixed.radius
    }

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

    /// Where leaves and small nodes face.
    pub unsafe fn face(&self, task: usize, x: &[Vec4]) {
        let leaves = &self.fixed.leaves;
        let (count, range) = (leaves.leaves.len(), self.leaves_of(task));
        let p = |v: u32| Vec3A::from_vec4(x[v as usize]);
        // SAFETY: by the promise of the phases.
        let cones = unsafe { self.cones.part(&(range.start + count - 1..range.end + count - 1)) };
        for (cone, leaf) in cones.iter_mut().zip(&leaves.leaves[range.clone()]) {
            let triangles = &leaves.triangles[leaf.triangles.start as usize..leaf.triangles.end as usize];
            let mut normals = [Vec3A::ZERO; LEAF];
            for (t, n) in triangles.iter().zip(&mut normals) {
                let [a, b, c] = t.map(p);
                *n = (b - a).cross(c - a).normalize_or_zero();
            }
            let normal = normals.iter().sum::<Vec3A>().normalize_or_zero();
            let normals = &normals[..triangles.len()];
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
        let near =
            |v: u32, w: u32| v == w || (f.ringed[v as usize] && f.ring[v as usize].binary_search(&w).is_ok());
        let shorten = |vertices: &[u32], d: f32| {
            let reach = (0.5 * PART * d).max(f.least);
            vertices.iter().for_each(|v| lower(&self.reach[*v as usize], reach));
        };
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
                    if !bounds.has(q) || t.iter().any(|w| near(*v, *w)) {
                        continue;
                    }
                    let w = barycentric(q.into(), q0.into(), q1.into(), q2.into());
                    let d = q.distance(q0 * w[0] + q1 * w[1] + q2 * w[2]);
                    if d < query {
                        found.sides.push(Pair { at: [*v, t[0], t[1], t[2]], leaves: [a as u32, b as u32] });
                        shorten(&[*v, t[0], t[1], t[2]], d);
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
                if !grown.meets(box_of, 0.0) || e.iter().any(|v| near(*v, other[0]) || near(*v, other[1])) {
                    continue;
                }
                let [s, t] = nearest_of_edges((*p0).into(), (*p1).into(), (*q0).into(), (*q1).into());
                let d = p0.lerp(*p1, s).distance(q0.lerp(*q1, t));
                if d < query {
                    found
                        .crosses
                        .push(Pair { at: [e[0], e[1], other[0], other[1]], leaves: [a as u32, b as u32] });
                    shorten(&[e[0], e[1], other[0], other[1]], d);
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

    /// Which pairs of a block touch, vertices being at `x` + `u`; or, unless `all` are asked for, of a block whose pairs were found in the
    /// last search.
    pub unsafe fn touch(&self, block: usize, x: &[Vec4], u: &[Vec4], all: bool) {
        // SAFETY: by the promise of the phases.
        let Block { sides, crosses, touching, search, .. } =
            unsafe { &mut self.blocks.part(&(block..block + 1))[0] };
        if !all && *search != unsafe { self.lists.read(&(0..1))[0].search } {
            return;
        }
        touching.clear();
        let near = TOUCH * self.fixed.radius;
        let place = |v: u32| Vec3A::from_vec4(x[v as usize] + u[v as usize]);
        let mut keep = |pair: &[u32; 4], q: [Vec3A; 4], c: [f32; 4]| {
            let between = (q[0] * c[0] + q[1] * c[1]) + (q[2] * c[2] + q[3] * c[3]);
            if between.length_squared() < near * near {
                touching.push((*pair, c));
            }
        };
        // Boxes first: most pairs are within reach only.
        let apart =
            |a: [Vec3A; 2], b: [Vec3A; 2]| (b[0] - a[1]).max(a[0] - b[1]).cmpge(Vec3A::splat(near)).any();
        for Pair { at: pair, .. } in sides.iter() {
            let q = pair.map(place);
            if apart([q[0], q[0]], [q[1].min(q[2]).min(q[3]), q[1].max(q[2]).max(q[3])]) {
                continue;
            }
            let w = barycentric(q[0].into(), q[1].into(), q[2].into(), q[3].into());
            keep(pair, q, [1.0, -w[0], -w[1], -w[2]]);
        }
        for Pair { at: pair, .. } in crosses.iter() {
            let q = pair.map(place);
            if apart([q[0].min(q[1]), q[0].max(q[1])], [q[2].min(q[3]), q[2].max(q[3])]) {
                continue;
            }
            let [s, t] = nearest_of_edges(q[0].into(), q[1].into(), q[2].into(), q[3].into());
            keep(pair, q, [1.0 - s, s, t - 1.0, -t]);
        }
    }

    /// Pushes pairs apart that are nearer than the radius, with friction, one after the other; and takes the mean motion, of what is
    /// attached if anything is, as that which all have in common: what moves together does not come nearer.
    pub unsafe fn part(&self, x: &[Vec4], u: &mut [Vec4], inverse: &[f32], h: f32) {
        // SAFETY: by the promise of the phases, alone.
        let (found, lists) = unsafe { (self.blocks.read(&(0..BLOCKS)), &mut self.lists.part(&(0..1))[0]) };
        let Lists { deep, drift, .. } = lists;
        for (pair, c) in found.iter().flat_map(|f| &f.touching) {
            self.push(x, u, inverse, pair.map(|v| v as usize), c, RECOVERY * h);
        }
        deep.clear();
        let least = DEEP * self.fixed.radius;
        for (block, found) in found.iter().enumerate() {
            for (k, (pair, c)) in found.touching.iter().enumerate() {
                let v = pair.map(|v| v as usize);
                if (between(x, v, c) + between(u, v, c)).length_squared() < least * least {
                    deep.push([block as u32, k as u32]);
                }
            }
        }
        for _ in 0..PASSES {
            deep.retain(|[block, k]| {
                let (pair, c) = &found[*block as usize].touching[*k as usize];
                self.push(x, u, inverse, pair.map(|v| v as usize), c, 0.0)
            });
        }
        let at = unsafe { self.at.read(&(0..self.at.len())) };
        let way = |p: usize| Vec3A::from_vec4(x[p] + u[p]) - (at[p] + *drift);
        // What is attached follows nobody: the rest follows it. And what flies off alone does not count.
        let attached = &self.fixed.attached;
        let moved = if attached.is_empty() {
            (0..at.len()).map(|p| way(p).clamp_length_max(self.fixed.query)).sum::<Vec3A>() / at.len() as f32
        } else {
            attached.iter().map(|p| way(*p as usize)).sum::<Vec3A>() / attached.len() as f32
        };
        *drift += moved;
    }

    /// Pushes two points apart, of weights that sum up to one and minus one, and those that were too near before by `back`, m; whether they
    /// were too near.
    #[inline]
    fn push(
        &self,
        x: &[Vec4],
        u: &mut [Vec4],
        inverse: &[f32],
        v: [usize; 4],
        c: &[f32; 4],
        back: f32,
    ) -> bool {
        let f = self.fixed;
        let (start, slide) = (Vec3A::from_vec4(between(x, v, c)), Vec3A::from_vec4(between(u, v, c)));
        let apart = start + slide;
        let square = apart.length_squared();
        if square >= f.radius * f.radius || square < 1e-20 {
            return false;
        }
        let d = square.sqrt();
        let w = v.map(|v| inverse[v]);
        let sum: f32 = (0..4).map(|k| w[k] * c[k] * c[k]).sum();
        if sum <= 0.0 {
            return false;
        }
        let n = apart / d;
        // As much as they have come nearer in this substep; what was too near before parts in time.
        let push = (f.radius - d).min((start.dot(n) - d).max(0.0) + back);
        // By how much the two points slide past each other in this substep.
        let slide = slide - n * slide.dot(n);
        let far = slide.length();
        let hold = if far > 0.0 { (f.friction * push / far).min(1.0) } else { 0.0 };
        let by = (n * push - slide * hold) / sum;
        for k in 0..4 {
            u[v[k]] += (by * (w[k] * c[k])).extend(0.0);
        }
        true
    }

    /// Keeps places from going farther than they may, unless they are attached and go where they are told; `moved` is told which of the
    /// range by how much, m. Whether pairs must be found again.
    pub unsafe fn hold(
        &self,
        range: &Range<usize>,
        x: &[Vec4],
        u: &mut [Vec4],
        inverse: &[f32],
        mut moved: impl FnMut(usize, f32),
    ) -> bool {
        // SAFETY: by the promise of the phases.
        let (at, drift) = unsafe { (self.at.read(range), self.lists.read(&(0..1))[0].drift) };
        let mut again = false;
        let of = at.iter().zip(&self.reach[range.clone()]).zip(&inverse[range.clone()]);
        for (i, ((x, u), ((at, reach), w))) in x.iter().zip(u).zip(of).enumerate() {
            let from = *at + drift;
            let way = Vec3A::from_vec4(*x + *u) - from;
            let (far, reach) = (way.length(), f32::from_bits(reach.load(Ordering::Relaxed)));
            if far > reach && *w > 0.0 {
                *u = (from + way * (reach / far) - Vec3A::from_vec4(*x)).extend(0.0);
                moved(i, far - reach);
            }
            again |= far > 0.7 * reach;
        }
        again
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

/// What lies between two points of four places, by weights that sum up to one and minus one.
#[inline(always)]
fn between(x: &[Vec4], v: [usize; 4], c: &[f32; 4]) -> Vec4 {
    x[v[0]] * c[0] + x[v[1]] * c[1] + (x[v[2]] * c[2] + x[v[3]] * c[3])
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::{PRESETS, Sheet};
    use glam::Vec2;

    /// Of coarse cloth and of such a fine one that none of it may go far.
    #[test]
    fn what_comes_nearer_by_little_at_a_time_is_paired() {
        for size in [0.1, 0.01] {
            come_nearer(size);
        }
    }

    fn come_nearer(size: f32) {
        let square = || Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Z, Vec2::splat(size), [5; 2]);
        let (mut sheet, mut above) = (square(), square());
        let lower = sheet.positions.len();
        above.flat.iter_mut().flatten().for_each(|p| p.x += 1.0);
        sheet.join(above);
        let cloth = Cloth::new(sheet, &PRESETS[0].fabric).unwrap();
        let edges: Vec<[u32; 2]> = cloth.springs.iter().map(|s| s.ends).collect();
        let order = Order::new(cloth.masses.len(), &edges);
        let mut contacts = Contacts::new(&cloth, &order, Vec::new(), 1.0 / 1200.0).unwrap();
        let Fixed { query, spare, margin, .. } = contacts.fixed;
        // By less at a time than is spared, and by so little in all that leaves need not be compared again.
        let (from, to, by) = (1.2 * query, 0.8 * query, 0.3 * spare);
        let mut kept = 0;
        assert!(from - to < margin);
        let mut height = from;
        while height > to {
            let at = |v: &u32| {
                let up = if *v as usize >= lower { Vec3::Y * height } else { Vec3::ZERO };
                (cloth.sheet.positions[*v as usize] + up).extend(0.0)
            };
            let x: Vec<Vec4> = order.vertex.iter().map(at).collect();
            let shared = contacts.shared();
            // SAFETY: one thread does one phase after the other.
            #[allow(unsafe_code)]
            unsafe {
                shared.search(&(0..x.len()), &x);
                let marked = |m: &AtomicU32| {
                    m.load(Ordering::Relaxed) == shared.lists.read(&(0..1))[0].search.wrapping_add(1)
                };
                kept += usize::from(!shared.moved.iter().any(marked));
                (0..shared.fits()).for_each(|task| shared.face(task, &x));
                (0..shared.fits()).for_each(|task| shared.fit(task));
                shared.begin();
                (0..BLOCKS).for_each(|block| shared.pair(block));
                shared.settle(&(0..x.len()));
            }
            let pairs: usize = contacts.blocks.iter().map(|f| f.sides.len()).sum();
            assert!(height < query || pairs == 0, "{height}");
            height -= by;
        }
        assert_eq!(contacts.lists[0].all, 1);
        assert!(contacts.blocks.iter().any(|f| !f.sides.is_empty()));
        assert!(kept > 0, "pairs of all are found again every time");
    }
}
