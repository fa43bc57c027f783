//! Pairs that would pass through each other are stopped along the direction in which they are nearest.
//!
//! Two convex things that a plane separates at both ends of a straight way are separated by it all along. So no collision is searched for: a
//! pair may come nearer along the direction from one to the other by [`PART`] of the distance between them, and what is too much is taken
//! from both, as by an inelastic push. Whom that sets moving against others is looked at again in the next round. What moves together is
//! left alone, however fast.

use super::{BLOCKS, Block, PART, Pair, Shared, gap, nearest};
use glam::{Vec3A, Vec4};
use std::sync::atomic::Ordering;

/// How often pairs are looked through again for what stopping others has set moving against them.
pub(in crate::cloth) const ROUNDS: usize = 6;
/// How often all pairs that are stopped are gone through in each round, at the most.
const SWEEPS: u32 = 8;
/// Of the distance to keep, what pairs are not let nearer than.
pub(in crate::cloth) const FLOOR: f32 = 0.02;
/// Likewise, by how much more than they may pairs are let nearer: what has nothing left of its way would else be stopped over and over for what is
/// rounded.
pub(in crate::cloth) const TOLERANCE: f32 = 0.001;

/// Four places that would pass through each other: of the first `first` and the rest, the direction from these to those, and how much nearer
/// they may come along it, m.
pub(super) struct Passing {
    at: [u32; 4],
    first: usize,
    normal: Vec3A,
    most: f32,
}

/// Of both, the place that is least far along a direction and the one that is farthest.
fn ends(along: &[f32; 4], first: usize) -> [f32; 2] {
    let (one, two) = along.split_at(first);
    [one.iter().copied().fold(f32::INFINITY, f32::min), two.iter().copied().fold(f32::NEG_INFINITY, f32::max)]
}

/// In rounds: [`Shared::suspect`] in all blocks, and [`Shared::guard`] where [`Shared::suspects`] says so.
///
/// # Safety
/// As of all of [`Shared`].
#[allow(unsafe_code, clippy::missing_safety_doc)]
impl Shared<'_> {
    /// Which pairs of a block might pass through each other on the way from `x` by `u`; after the first round, of those with a vertex that the
    /// one before has stopped.
    pub unsafe fn suspect(&self, block: usize, round: usize, x: &[Vec4], u: &[Vec4]) {
        // SAFETY: by the promise of the phases.
        let Block { sides, crosses, passing, left, .. } =
            unsafe { &mut self.blocks.part(&(block..block + 1))[0] };
        let lists = unsafe { &self.lists.read(&(0..1))[0] };
        let stopped = unsafe { self.stopped.read(&(0..self.stopped.len())) };
        let [floor, tolerance] = [FLOOR, TOLERANCE].map(|part| part * self.fixed.radius);
        if round == 0 {
            passing.clear();
            *left -= 2.0 * self.pace();
            if *left > floor {
                return;
            }
            *left = self.fixed.query;
        }
        let known = passing.len();
        for (list, first) in [(sides, 1), (crosses, 2)] {
            for Pair { at, normal, .. } in list.iter() {
                if round > 0 && at.iter().all(|v| stopped[*v as usize] != lists.stopped) {
                    continue;
                }
                let q = at.map(|v| Vec3A::from_vec4(x[v as usize]));
                let w = at.map(|v| Vec3A::from_vec4(u[v as usize]));
                let [from, by] = [q, w].map(|q| q.map(|q| q.dot(*normal)));
                let to = [0, 1, 2, 3].map(|k| from[k] + by[k]);
                let [from, to] = [from, to].map(|along| gap(along, first));
                *left = left.min(to);
                // A plane that separated them when they were found mostly does so still.
                if from > 0.0 && to > floor.max((1.0 - PART) * from) {
                    continue;
                }
                let (_, between) = nearest(q, first);
                let d = between.length();
                if d <= 1e-9 {
                    continue;
                }
                let normal = between / d;
                let nearer = -gap(w.map(|w| w.dot(normal)), first);
                // What passes through each other already may come back.
                let least = if self.passes(at, first) { self.fixed.least } else { f32::NEG_INFINITY };
                // Below the floor they are to part, or they would come nearer by the tolerance in each substep.
                let part = if d > floor { PART } else { 1.0 - PART };
                let most = (part * (d - floor)).max(least);
                if nearer > most + tolerance {
                    passing.push(Passing { at: *at, first, normal, most });
                }
            }
        }
        if passing.len() > known {
            self.found[round].store(true, Ordering::Relaxed);
            if round + 1 == ROUNDS {
                self.tangled.store(true, Ordering::Relaxed);
            }
        }
    }

    /// Whether a round has found pairs that may pass through each other.
    pub fn suspects(&self, round: usize) -> bool {
        self.found[round].load(Ordering::Relaxed)
    }

    /// Stops pairs, one after the other, over and over; `moved` is told which places by how much, m.
    pub unsafe fn guard(&self, u: &mut [Vec4], inverse: &[f32], mut moved: impl FnMut(usize, f32)) {
        // SAFETY: by the promise of the phases, alone.
        let (blocks, lists) = unsafe { (self.blocks.part(&(0..BLOCKS)), &mut self.lists.part(&(0..1))[0]) };
        let stopped = unsafe { self.stopped.part(&(0..self.stopped.len())) };
        let tolerance = TOLERANCE * self.fixed.radius;
        lists.stopped = lists.stopped.wrapping_add(1);
        for _ in 0..SWEEPS {
            let mut any = false;
            for Passing { at, first, normal, most } in blocks.iter().flat_map(|b| &b.passing) {
                let w = at.map(|v| inverse[v as usize]);
                let along = at.map(|v| Vec3A::from_vec4(u[v as usize]).dot(*normal));
                let [low, high] = ends(&along, *first);
                let over = high - low - most;
                let yields = |w: &[f32]| w.iter().copied().fold(0.0, f32::max);
                let [one, two] = [yields(&w[..*first]), yields(&w[*first..])];
                if over <= 0.25 * tolerance || one + two <= 0.0 {
                    continue;
                }
                any = true;
                let [low, high] = [low + over * one / (one + two), high - over * two / (one + two)];
                for k in 0..4 {
                    let by = if k < *first { (low - along[k]).max(0.0) } else { (high - along[k]).min(0.0) };
                    if w[k] > 0.0 && by != 0.0 {
                        let place = at[k] as usize;
                        u[place] += (*normal * by).extend(0.0);
                        stopped[place] = lists.stopped;
                        moved(place, by.abs());
                    }
                }
            }
            if !any {
                break;
            }
        }
    }
}
