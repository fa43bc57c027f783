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
    pub over: bool,
}

/// What lies on top is so far outside as it begins, m: several times what contact keeps.
const OVER: f32 = 0.015;
/// From the body to the spread cloth, m.
const ROOM: f32 = 0.03;
/// What the belt takes of the way around the body for either front, at the most: each then ends at the other side.
const REACH: f32 = 0.74;

/// Spots of the mesh's vertices; of strips along others, those that they would have if they went on flat.
pub(super) fn spots(garment: &Garment, cut: &Cut) -> Vec<Spot> {
    let mut spots = vec![Spot::default(); cut.uvs.len()];
    let mut of_sheet: Vec<Vec<u32>> = vec![Vec::new(); cut.sheet.positions.len()];
    for (p, panel) in garment.panels.iter().enumerate() {
        let Hang::Flat { left, run, front, over } = panel.hang else { continue };
        for v in cut.panels[p]..cut.panels[p + 1] {
            let at = cut.uvs[v] - panel.bolt;
            spots[v] = Spot { x: left + run * at.x, s: at.y, front, over };
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
    wear: Wear,
    /// Of the body: its middle (x, z).
    middle: Vec2,
    /// Top of the cloth over the shoulders, and half its depth, m.
    top: f32,
    depth: f32,
    /// How far the top of the shoulders is drawn to the back at the neck, m along the cloth.
    back: f32,
}

impl Spread {
    pub fn new(wear: &Wear, body: &Body, poses: &[RigidPose]) -> Result<Self, GarmentError> {
        let arms = body.capsules.iter().filter(|c| body.arms.contains(&c.joint));
        let tops = arms.flat_map(|c| {
            let y = c.ends.map(|p| (poses[c.joint].position + poses[c.joint].rotation * p).y);
            [y[0] + c.radii[0], y[1] + c.radii[1]]
        });
        let top = tops.fold(f32::NEG_INFINITY, f32::max) + 0.02;
        if !top.is_finite() {
            return Err(GarmentError::Body("has no capsule on its upper arms".into()));
        }
        let hem = top - wear.length + 0.1;
        let discs = body.discs(poses, [hem.min(top - 0.3), top]);
        // Hands and feet reach where the garment does not.
        let x = 0.5 * (poses[body.arms[0]].position.x + poses[body.arms[1]].position.x);
        let trunk = discs.iter().filter(|(p, _)| (p.x - x).abs() < wear.half);
        let (low, high) =
            trunk.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), (p, r)| (l.min(p.y - r), h.max(p.y + r)));
        let most = (wear.half + wear.hem) / PI;
        let depth = (0.5 * (high - low) + ROOM).max(0.1);
        if !(depth < most) {
            return Err(GarmentError::Body(format!(
                "is {:.2} m deep from front to back; a robe that is {:.2} m around its hem has room for {:.2} m",
                high - low,
                2.0 * (wear.half + wear.hem),
                2.0 * (most - ROOM)
            )));
        }
        let z = 0.5 * (low + high);
        let neck = body.discs(poses, [top - 0.02, top + 0.06]);
        let behind = neck
            .iter()
            .filter(|(p, _)| (p.x - x).abs() < 0.5 * wear.half)
            .fold(z, |least, (p, r)| least.min(p.y - r));
        let sine = ((z - behind + 0.015) / depth).clamp(0.0, 0.9);
        Ok(Self { wear: *wear, middle: Vec2::new(x, z), top, depth, back: depth * sine.asin() })
    }

    /// From the middle of the back to the middle of the front, so far below the shoulder.
    fn half_round(&self, s: f32) -> f32 {
        let Wear { length, half, hem, armhole, .. } = self.wear;
        2.0 * half - (half - hem) * ((s - armhole) / (length - armhole)).clamp(0.0, 1.0)
    }

    /// How far along the way around a spot is, from the middle of the back to the left.
    fn around(&self, spot: &Spot) -> f32 {
        match (spot.front, spot.over) {
            (false, _) => spot.x,
            (true, true) => self.half_round(spot.s) - spot.x,
            (true, false) => -self.half_round(spot.s) - spot.x,
        }
    }

    /// An oval so long around: a point of it and the direction outwards (x, z).
    fn oval(&self, around: f32, half_round: f32) -> (Vec2, Vec2) {
        let d = self.depth;
        let straight = 0.5 * (half_round - PI * d).max(0.0);
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

    /// A spot in the world.
    pub fn at(&self, spot: &Spot) -> Vec3 {
        let Wear { half, sleeve, armhole, cuff, .. } = self.wear;
        let d = self.depth;
        let drawn = self.back * (1.0 - smoothstep(0.3 * half, half, spot.x.abs()));
        let way = if spot.front { spot.s - drawn } else { spot.s + drawn };
        let arc = (way / d).min(FRAC_PI_2);
        let y = self.top - d + d * arc.cos() - (way - d * arc);
        let flat = d * arc.sin() * if spot.front { 1.0 } else { -1.0 };
        let closed = smoothstep(armhole - 0.25, armhole, spot.s);
        let (mut p, n);
        if spot.x.abs() <= half + 1e-4 {
            let (oval, outwards) = self.oval(self.around(spot), self.half_round(spot.s));
            p = Vec2::new(spot.x, flat).lerp(oval, closed);
            n = Vec2::new(0.0, if spot.front { 1.0 } else { -1.0 })
                .lerp(outwards, closed)
                .normalize_or(outwards);
        } else {
            let straight = 0.5 * (self.half_round(spot.s) - PI * d).max(0.0);
            let x = spot.x.abs() - (half - straight - d) * closed;
            let end = smoothstep(half + sleeve - 0.15, half + sleeve, spot.x.abs());
            let shut = end * smoothstep(cuff - 0.08, cuff + 0.08, spot.s);
            p = Vec2::new(x * spot.x.signum(), flat * (1.0 - closed) * (1.0 - shut));
            n = Vec2::ZERO;
        }
        if spot.over {
            p += n * (OVER * (1.0 - smoothstep(0.05, 0.25, spot.x)));
        }
        p += self.middle;
        Vec3::new(p.x, y, p.y)
    }

    /// The vertices of the sheet, out of the body.
    pub fn place(
        &self,
        garment: &Garment,
        cut: &Cut,
        spots: &[Spot],
        body: &Body,
        poses: &[RigidPose],
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
        for (p, panel) in garment.panels.iter().enumerate().filter(|(_, p)| p.hang == Hang::Along) {
            let rows = &cut.rows[p];
            let base: Vec<Vec3> = rows.iter().map(|r| at[cut.vertex[r.first as usize] as usize]).collect();
            // It faces forwards on the fronts and backwards behind the neck, and turns between them.
            let faces = |k: usize| match &spots[rows[k].first as usize] {
                Spot { front: false, .. } => PI,
                Spot { over: true, .. } => 0.0,
                _ => TAU,
            };
            for (j, row) in rows.iter().enumerate() {
                let near = (0..rows.len()).filter(|k| (rows[*k].v - row.v).abs() < 0.06);
                let (sum, count) = near.fold((0.0, 0.0), |(s, c), k| (s + faces(k), c + 1.0));
                let angle: f32 = sum / count;
                let n = Vec3::new(angle.sin(), 0.0, angle.cos());
                let t = base[(j + 1).min(rows.len() - 1)] - base[j.saturating_sub(1)];
                let d = n.cross(t).normalize_or(Vec3::Y);
                for (k, u) in row.at.iter().enumerate().skip(1) {
                    at[cut.vertex[row.first as usize + k] as usize] = base[j] + d * *u;
                }
            }
            let _ = panel;
        }
        let solids: Vec<_> = body.solids(0.006).zip(body.stances(poses)).collect();
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

    /// Where the belt takes vertices of the sheet: which, and to where. Layers lie `layer` metres apart, the innermost `clearance` from the
    /// body.
    pub fn belt(
        &self,
        cut: &Cut,
        spots: &[Spot],
        body: &Body,
        poses: &[RigidPose],
        [clearance, layer]: [f32; 2],
    ) -> Vec<(u32, Vec3)> {
        let [from, to] = self.wear.belt;
        let height = poses[body.pelvis].position.y + 0.06;
        let half_width = 0.5 * (to - from);
        let hull = Hull::new(&body.discs(poses, [height - half_width, height + half_width]));
        let mut taken: Vec<(u32, Vec3)> = Vec::new();
        let mut known = vec![false; cut.sheet.positions.len()];
        let tied = |s: &Spot| s.s >= from - 1e-4 && s.s <= to + 1e-4 && s.x.abs() <= self.wear.half + 1e-4;
        let reach = spots.iter().filter(|s| tied(s)).map(|s| self.around(s).abs()).fold(0.0, f32::max);
        let round = hull.length(clearance);
        let gather = (REACH * round / reach.max(1e-6)).min(1.0);
        for (v, spot) in cut.vertex.iter().zip(spots) {
            if !tied(spot) || std::mem::replace(&mut known[*v as usize], true) {
                continue;
            }
            let around = self.around(spot) * gather;
            let over = smoothstep(0.10, 0.20, around / round);
            let p = hull.at(around, clearance) + hull.outwards(around, clearance) * (layer * over);
            taken.push((*v, Vec3::new(p.x, height + half_width - (spot.s - from), p.y)));
        }
        taken
    }
}

/// The convex outline of discs.
struct Hull {
    /// Middle of the disc that is outermost in each direction, its radius, and the direction, from the back (−z) to the left.
    corners: Vec<(Vec2, f32, Vec2)>,
}

/// Directions of an outline.
const DIRECTIONS: usize = 360;

impl Hull {
    fn new(discs: &[(Vec2, f32)]) -> Self {
        let corners = (0..=DIRECTIONS).map(|k| {
            let angle = TAU * k as f32 / DIRECTIONS as f32;
            let n = Vec2::new(angle.sin(), -angle.cos());
            let most = discs.iter().copied().max_by(|a, b| (a.0.dot(n) + a.1).total_cmp(&(b.0.dot(n) + b.1)));
            let (p, r) = most.unwrap_or((Vec2::ZERO, 0.1));
            (p, r, n)
        });
        Self { corners: corners.collect() }
    }

    /// Points of the outline at a distance.
    fn points(&self, out: f32) -> impl Iterator<Item = (Vec2, Vec2)> {
        self.corners.iter().map(move |(p, r, n)| (*p + *n * (r + out), *n))
    }

    fn length(&self, out: f32) -> f32 {
        let points: Vec<Vec2> = self.points(out).map(|p| p.0).collect();
        points.windows(2).map(|p| p[0].distance(p[1])).sum()
    }

    fn find(&self, around: f32, out: f32) -> (Vec2, Vec2) {
        let points: Vec<(Vec2, Vec2)> = self.points(out).collect();
        let mut left = around.rem_euclid(self.length(out).max(1e-6));
        for p in points.windows(2) {
            let step = p[0].0.distance(p[1].0);
            if left <= step {
                let t = left / step.max(1e-9);
                return (p[0].0.lerp(p[1].0, t), p[0].1.lerp(p[1].1, t).normalize_or(p[0].1));
            }
            left -= step;
        }
        points[0]
    }

    /// A point so far around from the back to the left.
    fn at(&self, around: f32, out: f32) -> Vec2 {
        self.find(around, out).0
    }

    fn outwards(&self, around: f32, out: f32) -> Vec2 {
        self.find(around, out).1
    }
}
