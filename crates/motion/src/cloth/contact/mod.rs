//! Cloth that touches itself: vertices and triangles, edges and edges.
//!
//! As in Chen, Hsu, Wang, Gascón, Macklin and Yuksel 2025, "Offset Geometric Contact": once in a while all pairs within a radius are
//! found, and until the next time no vertex moves so far that it could touch what it is not paired with. Pairs that come nearer than they
//! keep are pushed apart. That, and what springs and bodies do besides, may still draw them through each other; so in each substep, when all else
//! has had its say, those that would pass are stopped ([`guard`]). The paper bounds the way of each vertex instead, which holds back cloth that falls in
//! folds.
//! A tree of boxes over the triangles is made once and only fitted anew.
//!
//! What passes through itself to begin with is looked for. It is not pushed, for on the wrong side it would stay there, and may come back.
//!
//! Three lists, each made from the one before when it is due. Leaves of the tree that are near, with a margin that lasts for about a
//! frame. Pairs of vertices, triangles and edges within reach, when a vertex has gone as far as it may: several times a frame, and only
//! of leaves of which a vertex has gone far since; others may go as far as is left to them. Pairs that touch, with weights of where. All
//! are made by all threads, in blocks of a fixed number, each a part of the tree against another, and pairs are
//! pushed apart one after the other in the order of the blocks: same bits for any number of threads.

mod guard;
mod pairs;

pub(super) use guard::{FLOOR, ROUNDS, TOLERANCE};

use super::Cloth;
use super::aabb::Aabb;
use super::body::{RECOVERY, barycentric};
use super::leaves::{Leaf, Leaves};
use super::order::Order;
use super::rows::ContactRows;
use super::team::Parts;
use glam::{Vec3, Vec3A, Vec4};
use guard::Passing;
use pairs::Cone;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Distance to keep, in mean edges, where the cloth is thinner: what is much thinner than its triangles would crumple.
const RADIUS: f32 = 0.2;
/// Distance within which pairs are found, in mean edges: so far that who is not paired may move as much as who touches.
const QUERY: f32 = 0.42;
/// How far vertices may move before leaves are compared again, in mean edges.
const MARGIN: f32 = 0.5;
/// How far vertices may move from each other before it is looked again where leaves face, in mean edges: two triangles may turn from each other by
/// about three times as many radians in that.
const TURN: f32 = 0.1;
/// Part of the distance between two by which they may come nearer.
pub(super) const PART: f32 = 0.9;
/// Speed at which what passes through itself may come back, m/s.
const LEAST: f32 = 0.5;
/// Pairs of a vertex are found again where less is left to it than what it goes in a substep at this speed, m/s: that of limbs in a dance.
const LIMBS: f32 = 0.5;
/// Blocks of the work on pairs: several for each of a dozen threads, and so small that what has moved is in few of them.
pub(super) const BLOCKS: usize = 256;
/// Of the distance to keep, within which a pair may come to touch while others are pushed.
pub(super) const TOUCH: f32 = 1.1;
/// Of the distance to keep, what pairs may be nearer at the end of a pass; those that are have more passes, this many at the most. Where a
/// belt presses layers on each other, what one pair is pushed another has to take on, and where that ended they were pressed through each
/// other: in robes of five sizes of triangles up to five crossings were left by dressing, with three passes in one of them, with eight none.
const DEEP: f32 = 0.8;
const PASSES: u32 = 8;
/// Of the distance to keep, how much nearer two that are not paired may come before the next search, where no more lies between that
/// distance and the one within which pairs are found. Assumed: by less, pairs of thick cloth would be searched for in nearly every substep;
/// by more, less would be left than keeps layers from passing through each other.
const NEARER: f32 = 0.2;

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
    /// Those that would pass through each other.
    passing: Vec<Passing>,
    /// How much nearer pairs may come before any might pass through each other, m.
    left: f32,
    /// Edges of two leaves that are near to each other, while they are compared.
    close: [Vec<Close>; 2],
    /// The number of the search in which pairs were found.
    search: u32,
}

/// Four places, the leaves that they were found in, and the direction from the second of both to the first when found; nought where they met.
struct Pair {
    at: [u32; 4],
    leaves: [u32; 2],
    normal: Vec3A,
    /// Whether they are as near in the flat cloth: they do not push each other.
    ring: bool,
}

/// An edge, its ends and its box.
type Close = ([u32; 2], [Vec3A; 2], Aabb);

/// What does not change.
struct Fixed {
    radius: f32,
    query: f32,
    margin: f32,
    /// How far what passes through itself comes back in a substep at the most, m.
    least: f32,
    /// What must be left to a vertex of the way it may go, or its pairs are found again, m.
    spare: f32,
    /// How far a vertex may go at the most, m: two that are not paired are farther apart than the query, and end no nearer than the radius; of cloth that is
    /// nearly as thick as the query or thicker, no nearer than the radius less [`NEARER`] of it.
    farthest: f32,
    /// How far places may move from each other before it is looked again where leaves face, m.
    turn: f32,
    friction: f32,
    /// How much farther a vertex may go than the way after which its pairs are found again, m.
    beyond: f32,
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
    /// How far all have moved together since pairs were found, since leaves were compared, and in this substep, m.
    drift: Vec3A,
    far_drift: Vec3A,
    mean: Vec3A,
    /// How far two places may have moved from each other since it was looked where leaves face, m; without the last substep.
    turned: f32,
    /// How often pairs have been searched for, and the last time when all were.
    search: u32,
    all: u32,
    /// Pairs that have another pass, each by its block and its number there.
    deep: Vec<[u32; 2]>,
    /// The number of the last round in which pairs were stopped.
    stopped: u32,
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
    /// Of each place, the last round in which it was stopped; and of each round, whether pairs were found.
    stopped: Vec<u32>,
    found: [AtomicBool; ROUNDS],
    /// How far any place goes in this substep beside what all go, m, as bits.
    pace: AtomicU32,
    /// Whether cloth may pass through itself as a step begins, and the places where it does.
    tangled: AtomicBool,
    through: Vec<bool>,
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
    stopped: Parts<'a, u32>,
    found: &'a [AtomicBool; ROUNDS],
    pace: &'a AtomicU32,
    tangled: &'a AtomicBool,
    through: &'a [bool],
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
        let farthest = 0.5 * (query - radius).max(NEARER * radius) * PART;
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
            mean: Vec3A::ZERO,
            turned: f32::INFINITY,
            far_drift: Vec3A::ZERO,
            search: 0,
            all: 0,
            deep: Vec::new(),
            stopped: 0,
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
            stopped: vec![0; n],
            found: Default::default(),
            pace: AtomicU32::new(0),
            tangled: AtomicBool::new(true),
            through: vec![false; n],
            fixed: Fixed {
                radius,
                query,
                margin: MARGIN * edge,
                least: LEAST * h,
                spare: (LIMBS * h).min(0.5 * farthest),
                farthest,
                turn: TURN * edge,
                friction: cloth.friction[1],
                // Then those that are not paired yet do not touch.
                beyond: 0.5 * PART * radius,
                leaves,
                ringed: ring.iter().map(|r| !r.is_empty()).collect(),
                ring,
                attached,
            },
        })
    }

    /// As lists, for a solver that tightens springs so often, where what lies on a body gives way by this part, which ends so many radii from it.
    pub fn rows(&self, tightened: u32, loaded: f32, loads: f32) -> ContactRows {
        let Fixed { radius, friction, leaves, ring, .. } = &self.fixed;
        let ranges = |leaf: &Leaf| [&leaf.triangles, &leaf.vertices, &leaf.edges].map(Range::clone);
        ContactRows {
            radius: *radius,
            friction: *friction,
            tightened,
            loaded,
            loads: loads * radius,
            leaves: leaves.leaves.iter().map(ranges).collect(),
            triangles: leaves.triangles.clone(),
            vertices: leaves.vertices.clone(),
            edges: leaves.edges.clone(),
            ring: ring.clone(),
        }
    }

    /// Leaves are compared again at the next search, as if there had been none before.
    pub fn forget(&mut self) {
        self.far.store(true, Ordering::Relaxed);
        self.tangled.store(true, Ordering::Relaxed);
        self.lists[0].turned = f32::INFINITY;
    }

    /// Looks where cloth passes through itself, where that may be: in the beginning, and when pairs could not all be stopped. `crossings` are the
    /// places of edges and triangles.
    pub fn look(&mut self, crossings: impl FnOnce() -> Vec<[u32; 5]>) {
        if !*self.tangled.get_mut() {
            return;
        }
        let found = crossings();
        self.through.fill(false);
        found.iter().flatten().for_each(|p| self.through[*p as usize] = true);
        *self.tangled.get_mut() = !found.is_empty();
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
            stopped: Parts::new(&mut self.stopped),
            found: &self.found,
            pace: &self.pace,
            tangled: &self.tangled,
            through: &self.through,
        }
    }
}

/// In each substep [`Shared::touch`] in all blocks, [`Shared::part`], and when all else has moved places [`Shared::hold`] at all of them and what
/// [`guard`] says.
///
/// # Safety
/// Of all: a phase is over before the next begins, and the tasks of a phase have different numbers or ranges.
#[allow(unsafe_code, clippy::missing_safety_doc)]
impl Shared<'_> {
    /// The distance that cloth keeps from itself, m.
    pub fn radius(&self) -> f32 {
        self.fixed.radius
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
        for (list, first) in [(sides, 1), (crosses, 2)] {
            for Pair { at, normal, .. } in list.iter().filter(|p| !p.ring && !self.passes(&p.at, first)) {
                let q = at.map(place);
                // Planes first: most pairs are within reach only.
                if gap(q.map(|q| q.dot(*normal)), first) >= near {
                    continue;
                }
                let (c, between) = nearest(q, first);
                if between.length_squared() < near * near {
                    touching.push((*at, c));
                }
            }
        }
    }

    /// Pushes pairs apart that are nearer than the radius, with friction, one after the other; and takes the mean motion, of what is
    /// attached if anything is, as that which all have in common: what moves together does not come nearer.
    pub unsafe fn part(&self, x: &[Vec4], u: &mut [Vec4], inverse: &[f32], h: f32) {
        // SAFETY: by the promise of the phases, alone.
        let turned = unsafe { self.turned() };
        let (found, lists) = unsafe { (self.blocks.read(&(0..BLOCKS)), &mut self.lists.part(&(0..1))[0]) };
        lists.turned = if turned { 0.0 } else { lists.turned + 2.0 * self.pace() };
        let Lists { deep, drift, mean, .. } = lists;
        self.found.iter().for_each(|f| f.store(false, Ordering::Relaxed));
        self.pace.store(0, Ordering::Relaxed);
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
        *mean = moved;
    }

    /// Whether the first `first` places and the rest are of what passes through each other.
    #[inline(always)]
    fn passes(&self, at: &[u32; 4], first: usize) -> bool {
        let through = |side: &[u32]| side.iter().any(|v| self.through[*v as usize]);
        through(&at[..first]) && through(&at[first..])
    }

    /// How far any place has gone in the last substep beside what all have, m.
    fn pace(&self) -> f32 {
        f32::from_bits(self.pace.load(Ordering::Relaxed))
    }

    /// Whether places have moved so far from each other that it must be looked again where leaves face.
    pub unsafe fn turned(&self) -> bool {
        // SAFETY: by the promise of the phases.
        let turned = unsafe { self.lists.read(&(0..1))[0].turned };
        let far = turned + 2.0 * self.pace();
        far > self.fixed.turn || far.is_nan()
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

    /// Keeps places from going so far that they could pass through what they are not paired with, unless they are attached and go where they
    /// are told; `moved` is told which of the range by how much, m. Whether pairs must be found again.
    pub unsafe fn hold(
        &self,
        range: &Range<usize>,
        x: &[Vec4],
        u: &mut [Vec4],
        inverse: &[f32],
        mut moved: impl FnMut(usize, f32),
    ) -> bool {
        // SAFETY: by the promise of the phases.
        let (at, Lists { drift, mean, .. }) = unsafe { (self.at.read(range), &self.lists.read(&(0..1))[0]) };
        let (mut again, mut pace) = (false, 0.0f32);
        let of = at.iter().zip(&self.reach[range.clone()]).zip(&inverse[range.clone()]);
        for (i, ((x, u), ((at, reach), w))) in x.iter().zip(u).zip(of).enumerate() {
            let from = *at + *drift;
            let way = Vec3A::from_vec4(*x + *u) - from;
            let (far, due) = (way.length(), f32::from_bits(reach.load(Ordering::Relaxed)));
            let reach = due + self.fixed.beyond;
            if far > reach && *w > 0.0 {
                *u = (from + way * (reach / far) - Vec3A::from_vec4(*x)).extend(0.0);
                moved(i, far - reach);
            }
            again |= far > 0.7 * due;
            pace = pace.max((Vec3A::from_vec4(*u) - *mean).length_squared());
        }
        self.pace.fetch_max(pace.sqrt().to_bits(), Ordering::Relaxed);
        again
    }
}

/// What lies between two points of four places, by weights that sum up to one and minus one.
#[inline(always)]
fn between(x: &[Vec4], v: [usize; 4], c: &[f32; 4]) -> Vec4 {
    x[v[0]] * c[0] + x[v[1]] * c[1] + (x[v[2]] * c[2] + x[v[3]] * c[3])
}

/// How far the first `first` of four places and the rest are apart along a direction, of which how far each is along it is given; less than nought
/// where they overlap.
#[inline(always)]
fn gap(along: [f32; 4], first: usize) -> f32 {
    let [a, b, c, d] = along;
    if first == 1 { a - b.max(c).max(d) } else { a.min(b) - c.max(d) }
}

/// Weights of the nearest points of the first `first` of four places and the rest, a vertex and a triangle or two edges, which sum up to one and
/// minus one; and the way from the second point to the first.
#[inline(always)]
fn nearest(q: [Vec3A; 4], first: usize) -> ([f32; 4], Vec3A) {
    let p = q.map(Vec3::from);
    let c = if first == 1 {
        let w = barycentric(p[0], p[1], p[2], p[3]);
        [1.0, -w[0], -w[1], -w[2]]
    } else {
        let [s, t] = nearest_of_edges(p[0], p[1], p[2], p[3]);
        [1.0 - s, s, t - 1.0, -t]
    };
    (c, (q[0] * c[0] + q[1] * c[1]) + (q[2] * c[2] + q[3] * c[3]))
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
                (0..shared.fits()).for_each(|task| shared.face(task, &x, &x, 0.0));
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
