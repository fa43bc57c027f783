//! Where a garment begins: spread about a body whose arms are spread too, and where its belt takes it.
//!
//! The trunk of a robe is a tube about the trunk of the body, oval, fronts over each other; above it two sheets, before and behind,
//! meet in an arc over the shoulders and go on as the sleeves. Cloth is longer or shorter there than it is by up to a fifth, and
//! finds its lengths as it settles.

use super::{Body, Cut, Garment, GarmentError, Hang, Wear};
use crate::RigidPose;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use yugen_optics::special::smoothstep;

/// A place on a garment that is spread.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spot {
    /// To the left of the middle, m.
    pub x: f32,
    /// Below the top of the shoulder, m.
    pub s: f32,
    pub front: bool,
    /// What lies on top where fronts overlap. Of trousers: the left leg; x is then along the waist, from the middle of the back to
    /// the left.
    pub over: bool,
}

/// What lies on top is so far outside as it begins, m: several times what contact keeps.
pub(super) const OVER: f32 = 0.015;
/// Within so much of the body sleeves that are deeper than where they are sewn come apart, m.
const LEAVES: f32 = 0.05;
/// From the body to the spread cloth, m.
pub(super) const ROOM: f32 = 0.03;
/// What the belt takes of the way around the body for either front, at the most: each then ends at the other side.
const REACH: f32 = 0.78;

/// Spots of the mesh's vertices; of strips along others, those that they would have if they went on flat.
pub(super) fn spots(garment: &Garment, cut: &Cut) -> Vec<Spot> {
    let mut spots = vec![Spot::default(); cut.uvs.len()];
    let mut of_sheet: Vec<Vec<u32>> = vec![Vec::new(); cut.sheet.positions.len()];
    for (p, panel) in garment.panels.iter().enumerate() {
        let (begin, run, front, over) = match panel.hang {
            Hang::Flat { left, run, front, over } => (left, run, front, over),
            Hang::Leg { from, left, front } => (from, -1.0, front, left),
            Hang::Along => continue,
        };
        for v in cut.panels[p]..cut.panels[p + 1] {
            let at = cut.uvs[v] - panel.bolt;
            spots[v] = Spot { x: begin + run * at.x, s: at.y, front, over };
            of_sheet[cut.vertex[v] as usize].push(v as u32);
        }
    }
    for (p, panel) in garment.panels.iter().enumerate() {
        if panel.hang != Hang::Along {
            continue;
        }
        let rows = &cut.rows[p];
        // Fronts before backs: where a strip goes over the shoulder both are there.
        let base: Vec<Spot> = rows
            .iter()
            .map(|r| {
                let all = &of_sheet[cut.vertex[r.first as usize] as usize];
                let chosen = all.iter().find(|v| spots[**v as usize].front).or(all.first());
                chosen.map_or(Spot::default(), |v| spots[*v as usize])
            })
            .collect();
        for (j, row) in rows.iter().enumerate() {
            let near = |k: usize| if base[k].front == base[j].front { k } else { j };
            let (a, b) = (near(j.saturating_sub(1)), near((j + 1).min(rows.len() - 1)));
            let t = Vec2::new(base[b].x - base[a].x, -(base[b].s - base[a].s)).normalize_or_zero();
            // On the front, seen from there: a quarter to the left of where the strip goes.
            let d = if base[j].front { t.perp() } else { Vec2::Y };
            for (k, u) in row.at.iter().enumerate() {
                let spot = Spot { x: base[j].x + d.x * u, s: base[j].s - d.y * u, ..base[j] };
                spots[row.first as usize + k] = spot;
            }
        }
    }
    spots
}

/// How a garment lies about a body with its arms spread.
pub(super) struct Spread {
    pub(super) wear: Wear,
    /// Of the body: its middle (x, z).
    pub(super) middle: Vec2,
    /// Top of the cloth over the shoulders, or at the waist, and half its depth, m.
    pub(super) top: f32,
    pub(super) depth: f32,
    /// How far the top of the shoulders is drawn to the back at the neck, m along the cloth.
    pub(super) back: f32,
    /// How far the neck is opened to either side, m.
    pub(super) opened: f32,
    /// Middles of the legs of trousers, from that of the body.
    pub(super) centres: [Vec2; 2],
}

impl Spread {
    /// About a body and what it wears already, which is at the points `worn`.
    pub fn new(wear: &Wear, body: &Body, poses: &[RigidPose], worn: &[Vec3]) -> Result<Self, GarmentError> {
        if let Some(legs) = wear.legs {
            return Self::about_legs(wear, legs, body, poses);
        }
        let arms = body.capsules.iter().filter(|c| body.arms.iter().any(|arm| arm[0] == c.joint));
        let tops = arms.flat_map(|c| {
            let y = c.ends.map(|p| (poses[c.joint].position + poses[c.joint].rotation * p).y);
            [y[0] + c.radii[0], y[1] + c.radii[1]]
        });
        let top = tops.fold(f32::NEG_INFINITY, f32::max) + 0.02;
        if !top.is_finite() {
            return Err(GarmentError::Body("has no capsule on its upper arms".into()));
        }
        let hem = top - wear.length + 0.1;
        let heights = [hem.min(top - 0.3), top];
        let mut discs = body.discs(poses, heights);
        discs.extend(around(worn, heights, OVER));
        // Hands and feet reach where the garment does not.
        let x = 0.5 * (poses[body.arms[0][0]].position.x + poses[body.arms[1][0]].position.x);
        let trunk = discs.iter().filter(|(p, _)| (p.x - x).abs() < wear.half);
        let (low, high) =
            trunk.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), (p, r)| (l.min(p.y - r), h.max(p.y + r)));
        // Two sheets go over the shoulders in an arc and must still hang below the arms.
        let most = if wear.open { 0.3 * wear.length } else { (wear.half + wear.hem) / PI };
        let depth = (0.5 * (high - low) + ROOM).max(0.1);
        if depth.is_nan() || depth >= most {
            return Err(GarmentError::Body(format!(
                "is {:.2} m deep from front to back{}; a robe of this {} has room for {:.2} m",
                high - low,
                if worn.is_empty() { "" } else { " with what it wears" },
                if wear.open {
                    format!("length, {:.2} m,", wear.length)
                } else {
                    format!("width, {:.2} m around its hem,", 2.0 * (wear.half + wear.hem))
                },
                2.0 * (most - ROOM)
            )));
        }
        let z = 0.5 * (low + high);
        let neck = body.discs(poses, [top - 0.02, top + 0.06]);
        let behind = neck
            .iter()
            .filter(|(p, _)| (p.x - x).abs() < 0.5 * wear.half)
            .fold(z, |least, (p, r)| least.min(p.y - r));
        let beside = neck
            .iter()
            .map(|(p, r)| (p.x - x).abs() + r)
            .filter(|w| *w < 0.5 * wear.half)
            .fold(0.0, f32::max);
        let opened = (beside + ROOM - wear.neck).max(0.0);
        let sine = ((z - behind + 0.015) / depth).clamp(0.0, 0.9);
        Ok(Self {
            wear: *wear,
            middle: Vec2::new(x, z),
            top,
            depth,
            back: depth * sine.asin(),
            opened,
            centres: [Vec2::ZERO; 2],
        })
    }

    /// From the middle of the back to the middle of the front, so far below the shoulder.
    fn half_round(&self, s: f32) -> f32 {
        if let Some(legs) = self.wear.legs {
            return legs.round;
        }
        let Wear { length, half, hem, armhole, .. } = self.wear;
        2.0 * half - (half - hem) * ((s - armhole) / (length - armhole)).clamp(0.0, 1.0)
    }

    /// How far along the way around a spot is, from the middle of the back to the left.
    fn around(&self, spot: &Spot) -> f32 {
        match (spot.front, spot.over) {
            (false, _) => spot.x,
            _ if self.wear.legs.is_some() => spot.x,
            (true, true) => self.half_round(spot.s) - spot.x,
            (true, false) => -self.half_round(spot.s) - spot.x,
        }
    }

    /// An oval so long around: a point of it and the direction outwards (x, z).
    pub(super) fn oval(&self, around: f32, half_round: f32) -> (Vec2, Vec2) {
        let d = self.depth;
        let straight = 0.5 * (half_round - PI * d).max(0.0);
        // Beyond the middle of the front it goes on around the other side.
        let around =
            if around.abs() > half_round { around - 2.0 * half_round.copysign(around) } else { around };
        let (w, side) = (around.abs(), around.signum());
        let (p, n) = if w < straight {
            (Vec2::new(w, -d), Vec2::NEG_Y)
        } else if w < straight + PI * d {
            let angle = (w - straight) / d;
            let n = Vec2::new(angle.sin(), -angle.cos());
            (Vec2::new(straight, 0.0) + n * d, n)
        } else {
            (Vec2::new(2.0 * straight + PI * d - w, d), Vec2::Y)
        };
        (Vec2::new(p.x * side, p.y), Vec2::new(n.x * side, n.y))
    }

    /// Part of [`OVER`] by which what is on the left lies on top: from its side on, and at the neck where fronts meet.
    fn over(&self, spot: &Spot, closed: f32) -> f32 {
        if self.wear.legs.is_some() || self.wear.shut {
            return 0.0;
        }
        let left = if spot.front { spot.over } else { spot.x > 0.0 };
        if !left {
            return 0.0;
        }
        let side = closed * smoothstep(0.3, 0.45, self.around(spot) / self.half_round(spot.s));
        let front = if spot.front { 1.0 - smoothstep(0.20, 0.32, spot.x) } else { 0.0 };
        side.max(front)
    }

    /// A spot in the world.
    pub fn at(&self, spot: &Spot) -> Vec3 {
        if let Some(legs) = self.wear.legs {
            return self.on_leg(spot, legs);
        }
        let Wear { half, sleeve, armhole, depth, cuff, .. } = self.wear;
        let d = self.depth;
        let drawn = self.back * (1.0 - smoothstep(0.3 * half, half, spot.x.abs()));
        let way = if spot.front { spot.s - drawn } else { spot.s + drawn };
        let arc = (way / d).min(FRAC_PI_2);
        let y = self.top - d + d * arc.cos() - (way - d * arc);
        let flat = d * arc.sin() * if spot.front { 1.0 } else { -1.0 };
        let closed = if self.wear.open { 0.0 } else { smoothstep(0.1 * armhole, armhole, spot.s) };
        let (mut p, n);
        if spot.x.abs() <= half + 1e-4 {
            let (oval, outwards) = self.oval(self.around(spot), self.half_round(spot.s));
            let side = if spot.front { if spot.over { 1.0 } else { -1.0 } } else { spot.x.signum() };
            let mut open = self.opened * side * (1.0 - smoothstep(0.05, 0.4, spot.s));
            open *= 1.0 - smoothstep(0.3 * half, half, spot.x.abs());
            let beside = smoothstep(0.0, 2.0 * self.wear.neck, spot.x.abs());
            let parted = spot.front && !self.wear.shut;
            let before = if parted { smoothstep(0.0, 0.1, spot.s) } else { 0.0 };
            open *= beside + (1.0 - beside) * before;
            p = Vec2::new(spot.x + open, flat).lerp(oval, closed);
            n = Vec2::new(0.0, if spot.front { 1.0 } else { -1.0 })
                .lerp(outwards, closed)
                .normalize_or(outwards);
        } else {
            let straight = 0.5 * (self.half_round(spot.s) - PI * d).max(0.0);
            let x = spot.x.abs() - (half - straight - d) * closed;
            let end = smoothstep(half + 0.2 * sleeve, half + sleeve, spot.x.abs());
            let shut = end * smoothstep(0.5 * cuff, cuff, spot.s);
            // Where it is deeper than it is sewn it leaves the body's side, which on the left lies on top.
            let over = if spot.x > 0.0 { OVER * closed } else { 0.0 };
            // What is sewn to the back alone leaves the front from the shoulder on.
            let [from, to] =
                if self.wear.shut && spot.front { [0.0, 0.2] } else { [0.6 * armhole, 1.2 * armhole] };
            let leaves = over + LEAVES * smoothstep(from, to, spot.s);
            let x = if depth > armhole { x + leaves } else { x };
            // Where it leaves the body it is as shut as that.
            let own = smoothstep(0.1 * depth, depth, spot.s);
            let closed = closed + (own - closed) * smoothstep(half, half + LEAVES, spot.x.abs());
            p = Vec2::new(x * spot.x.signum(), flat * (1.0 - closed) * (1.0 - shut));
            n = Vec2::ZERO;
        }
        p += n * (OVER * self.over(spot, closed));
        p += self.middle;
        Vec3::new(p.x, y, p.y)
    }

    /// The vertices of the sheet, `clearance` metres and more out of the body.
    pub fn place(
        &self,
        garment: &Garment,
        cut: &Cut,
        spots: &[Spot],
        body: &Body,
        poses: &[RigidPose],
        clearance: f32,
    ) -> Vec<Vec3> {
        let mut sums = vec![(Vec3::ZERO, 0.0f32); cut.sheet.positions.len()];
        for (p, panel) in garment.panels.iter().enumerate() {
            if panel.hang == Hang::Along {
                continue;
            }
            for v in cut.panels[p]..cut.panels[p + 1] {
                let (sum, count) = &mut sums[cut.vertex[v] as usize];
                (*sum, *count) = (*sum + self.at(&spots[v]), *count + 1.0);
            }
        }
        let mut at: Vec<Vec3> = sums.iter().map(|(sum, count)| *sum / count.max(1.0)).collect();
        for (p, _) in garment.panels.iter().enumerate().filter(|(_, p)| p.hang == Hang::Along) {
            let rows = &cut.rows[p];
            let base: Vec<Vec3> = rows.iter().map(|r| at[cut.vertex[r.first as usize] as usize]).collect();
            // Upright about the neck, and flat on the fronts.
            for (base, row) in base.iter().zip(rows) {
                for (k, u) in row.at.iter().enumerate().skip(1) {
                    let spot = &spots[row.first as usize + k];
                    let flat = if spot.front { smoothstep(0.1, 0.3, spot.s) } else { 0.0 };
                    let at_sheet = &mut at[cut.vertex[row.first as usize + k] as usize];
                    *at_sheet = (*base + Vec3::Y * *u).lerp(self.at(spot), flat);
                }
            }
        }
        let solids: Vec<_> = body.solids(clearance).zip(body.stances(poses)).collect();
        for p in &mut at {
            // What is in several comes out of one after the other.
            for _ in 0..8 {
                for (solid, stance) in &solids {
                    let (d, n) = solid.distance(stance.rotation.inverse() * (*p - stance.origin));
                    if d < 0.0 {
                        *p -= stance.rotation * n * d;
                    }
                }
            }
        }
        at
    }

    /// How far below the shoulder a belt takes a spot: fronts are drawn up, for their way over the chest is longer.
    fn level(&self, spot: &Spot) -> f32 {
        if self.wear.legs.is_some() {
            return spot.s;
        }
        let inwards = if spot.over { -spot.x } else { spot.x };
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
        let half_width = 0.5 * (to - from);
        // No column of coarse triangles slips through.
        let to = to.max(from + 1.02 * edge);
        let height = poses[body.pelvis].position.y + body.tied;
        let mut discs = body.discs(poses, [height - half_width, height + half_width]);
        // What is worn is in small folds there.
        discs.extend(around(worn, [height - 2.0 * half_width, height + 2.0 * half_width], layer));
        let hull = Hull::new(&discs, clearance);
        let mut known = vec![false; cut.sheet.positions.len()];
        // Sleeves are not.
        let tied = |s: &Spot| {
            (from - 1e-4..=to + 1e-4).contains(&self.level(s))
                && (s.x.abs() <= self.wear.half + 1e-4 || self.wear.legs.is_some())
        };
        let ties = cut
            .vertex
            .iter()
            .zip(spots)
            .filter(|(v, s)| tied(s) && !std::mem::replace(&mut known[**v as usize], true));
        let ties: Vec<(u32, Spot)> = ties.map(|(v, s)| (*v, *s)).collect();
        let reach = ties.iter().map(|(_, s)| self.around(s).abs()).fold(0.0, f32::max);
        // Trousers end where they began.
        let overlap = if self.wear.legs.is_some() { 0.5 } else { REACH };
        let gather = (overlap * hull.length() / reach.max(1e-6)).min(1.0);
        Belt { spread: self, hull, ties, gather, height: height + half_width, layer }
    }
}

/// Points between two heights as discs (x, z).
fn around(worn: &[Vec3], [low, high]: [f32; 2], radius: f32) -> impl Iterator<Item = (Vec2, f32)> {
    worn.iter().filter(move |p| (low..=high).contains(&p.y)).map(move |p| (Vec2::new(p.x, p.z), radius))
}

/// How far fronts are drawn up at the middle, m.
const DRAWN_UP: f32 = 0.09;

/// Where a belt holds a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tie {
    pub to: Vec3,
    /// Unit direction along the belt. A belt presses cloth on and lets threads find their lengths along it.
    pub along: Vec3,
}

/// A belt that is drawn shut.
pub(super) struct Belt {
    spread: Spread,
    hull: Hull,
    /// Vertices of the sheet.
    ties: Vec<(u32, Spot)>,
    /// How much shorter cloth is along it than flat: small folds take the rest.
    gather: f32,
    /// Of its upper edge in the end, m.
    height: f32,
    layer: f32,
}

impl Belt {
    /// The vertices that it holds.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        self.ties.iter().map(|t| t.0)
    }

    /// Where it holds them: at 0 where they are as it is spread, at 1 tight. All of it goes around by the same law, so that layers
    /// slide past each other in their order.
    pub fn at(&self, t: f32) -> impl Iterator<Item = Tie> {
        let spread = &self.spread;
        let round = self.hull.length();
        self.ties.iter().map(move |(_, spot)| {
            let (around, half_round) = (spread.around(spot), spread.half_round(spot.s));
            // In parts of half the way around.
            let (loose, tight) = (around / half_round, 2.0 * around * self.gather / round);
            // Sheets go there straight, tubes around.
            let part = if spread.wear.open { tight } else { loose + (tight - loose) * t };
            let (from, from_n) = if spread.wear.open {
                let at = spread.at(spot);
                (Vec2::new(at.x, at.z) - spread.middle, Vec2::new(0.0, if spot.front { 1.0 } else { -1.0 }))
            } else {
                spread.oval(part * half_round, half_round)
            };
            // A front that is one stays in the middle.
            let way = if spread.wear.shut && spot.front { 0.5 * round - spot.x } else { 0.5 * part * round };
            let (to, to_n) = self.hull.find(way);
            let n = from_n.lerp(to_n, t).normalize_or(to_n);
            let laps = spread.wear.legs.is_none() && !spread.wear.shut;
            let layer = if laps { self.layer } else { 0.0 };
            // Sheets have it already.
            let loose = if spread.wear.open { 0.0 } else { OVER * spread.over(spot, 1.0) };
            let over = [loose, layer * smoothstep(0.2, 0.36, tight)];
            let p = (from + spread.middle).lerp(to, t) + n * (over[0] + (over[1] - over[0]) * t);
            let y = spread.at(spot).y;
            let end = self.height - (spread.level(spot) - spread.wear.belt[0]);
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
