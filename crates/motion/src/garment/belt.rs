//! Where a belt takes a garment, and how it is drawn shut.

use super::place::{Arrangement, LAP, Spot, discs_of};
use super::{Body, Cut, Form};
use crate::RigidPose;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use yugen_optics::special::smoothstep;

/// What the belt takes of the way around the body for either front, at the most: each then ends at the other side.
const REACH: f32 = 0.78;
/// How far fronts are drawn up at the middle, m: by so much their way over the chest is longer than that of the back.
const DRAWN_UP: f32 = 0.09;
/// Parts of half the way around between which what lies on top comes to lie a layer farther out: from behind the side of the
/// body, where only the right front is, to before it.
const RISES: [f32; 2] = [0.2, 0.36];

impl Arrangement {
    /// How far below the shoulder a belt takes a spot: fronts are drawn up, for their way over the chest is longer.
    fn level(&self, spot: &Spot) -> f32 {
        if self.wear.form.legs().is_some() {
            return spot.s;
        }
        let inwards = if spot.left { -spot.x } else { spot.x };
        let drawn = if spot.front { smoothstep(-self.wear.half, 0.0, inwards) } else { 0.0 };
        spot.s - DRAWN_UP * drawn
    }

    /// What the belt takes of triangles with edges of `edge` metres, and how. Layers lie `layer` metres apart in the end, the innermost `clearance` from the body.
    pub fn belt(
        self,
        cut: &Cut,
        spots: &[Spot],
        body: &Body,
        poses: &[RigidPose],
        worn: &[Vec3],
        [clearance, layer]: [f32; 2],
        edge: f32,
    ) -> Belt {
        let [from, to] = self.wear.belt;
        let middle = 0.5 * (from + to);
        // No column of coarse triangles slips through.
        let reach = (0.5 * (to - from)).max(0.51 * edge);
        let height = poses[body.pelvis].position.y + body.tied;
        let mut discs = body.discs(poses, [height - reach, height + reach]);
        // What is worn is in small folds there.
        discs.extend(discs_of(worn, [height - 2.0 * reach, height + 2.0 * reach], layer));
        let hull = Hull::new(&discs, clearance);
        let mut known = vec![false; cut.sheet.positions.len()];
        // Sleeves are not.
        let tied = |s: &Spot| {
            (self.level(s) - middle).abs() <= reach + 1e-4
                && (s.x.abs() <= self.wear.half + 1e-4 || self.wear.form.legs().is_some())
        };
        let ties = cut
            .vertex
            .iter()
            .zip(spots)
            .filter(|(v, s)| tied(s) && !std::mem::replace(&mut known[**v as usize], true));
        let ties: Vec<(u32, Spot)> = ties.map(|(v, s)| (*v, *s)).collect();
        let way = ties.iter().map(|(_, s)| self.around(s).abs()).fold(0.0, f32::max);
        // Trousers end where they began.
        let part = if self.wear.form.legs().is_some() { 0.5 } else { REACH };
        let gather = (part * hull.length() / way.max(1e-6)).min(1.0);
        Belt { arrangement: self, hull, ties, gather, middle, height, layer }
    }
}

/// Where a belt holds a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tie {
    pub to: Vec3,
    /// Unit direction along the belt. A belt presses cloth on and lets threads find their lengths along it.
    pub along: Vec3,
}

/// A belt that is drawn shut.
pub(super) struct Belt {
    arrangement: Arrangement,
    hull: Hull,
    /// Vertices of the sheet.
    ties: Vec<(u32, Spot)>,
    /// How much shorter cloth is along it than flat: small folds take the rest.
    gather: f32,
    /// Of the garment it takes what is about so far below the shoulder or the waist ([`Arrangement::level`]), m, and holds that at this
    /// height in the end, m.
    middle: f32,
    height: f32,
    layer: f32,
}

impl Belt {
    /// The vertices that it holds.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        self.ties.iter().map(|t| t.0)
    }

    /// Where it holds them: at 0 where they are as it begins, at 1 tight. All of it goes around by the same law, so that layers
    /// slide past each other in their order.
    pub fn at(&self, t: f32) -> impl Iterator<Item = Tie> {
        let begin = &self.arrangement;
        let round = self.hull.length();
        self.ties.iter().map(move |(_, spot)| {
            let (around, half_round) = (begin.around(spot), begin.half_round(spot.s));
            // In parts of half the way around.
            let (loose, tight) = (around / half_round, 2.0 * around * self.gather / round);
            // Sheets go there straight, tubes around.
            let part = if begin.wear.form.sheets() { tight } else { loose + (tight - loose) * t };
            let (from, from_n) = if begin.wear.form.sheets() {
                let at = begin.at(spot);
                (Vec2::new(at.x, at.z) - begin.middle, Vec2::new(0.0, if spot.front { 1.0 } else { -1.0 }))
            } else {
                begin.oval(part * half_round, half_round)
            };
            // A front that is one stays in the middle.
            let way = if begin.wear.form == Form::Fastened && spot.front {
                0.5 * round - spot.x
            } else {
                0.5 * part * round
            };
            let (to, to_n) = self.hull.find(way);
            let n = from_n.lerp(to_n, t).normalize_or(to_n);
            let laps = matches!(begin.wear.form, Form::Wrapped | Form::Open);
            let layer = if laps { self.layer } else { 0.0 };
            // Sheets have it already.
            let loose = if begin.wear.form.sheets() { 0.0 } else { LAP * begin.lapped(spot, 1.0) };
            let out = [loose, layer * smoothstep(RISES[0], RISES[1], tight)];
            let p = (from + begin.middle).lerp(to, t) + n * (out[0] + (out[1] - out[0]) * t);
            let y = begin.at(spot).y;
            let end = self.height - (begin.level(spot) - self.middle);
            Tie { to: Vec3::new(p.x, y + (end - y) * t, p.y), along: Vec3::new(-n.y, 0.0, n.x) }
        })
    }
}

/// The convex outline of discs.
struct Hull {
    /// Points and the direction outwards, from the back (−z) to the left.
    points: Vec<(Vec2, Vec2)>,
}

/// Directions of an outline.
const DIRECTIONS: usize = 360;

impl Hull {
    /// So far outside of them.
    fn new(discs: &[(Vec2, f32)], out: f32) -> Self {
        let points = (0..=DIRECTIONS).map(|k| {
            let angle = TAU * k as f32 / DIRECTIONS as f32;
            let n = Vec2::new(angle.sin(), -angle.cos());
            let most = discs.iter().copied().max_by(|a, b| (a.0.dot(n) + a.1).total_cmp(&(b.0.dot(n) + b.1)));
            let (p, r) = most.unwrap_or((Vec2::ZERO, 0.1));
            (p + n * (r + out), n)
        });
        Self { points: points.collect() }
    }

    fn length(&self) -> f32 {
        self.points.windows(2).map(|p| p[0].0.distance(p[1].0)).sum()
    }

    /// A point so far around from the back to the left, and the direction outwards.
    fn find(&self, around: f32) -> (Vec2, Vec2) {
        let mut left = around.rem_euclid(self.length().max(1e-6));
        for p in self.points.windows(2) {
            let step = p[0].0.distance(p[1].0);
            if left <= step {
                let t = left / step.max(1e-9);
                return (p[0].0.lerp(p[1].0, t), p[0].1.lerp(p[1].1, t).normalize_or(p[0].1));
            }
            left -= step;
        }
        self.points[0]
    }
}
