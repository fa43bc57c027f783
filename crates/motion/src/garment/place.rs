//! Where a garment begins: how it is arranged about a body with its arms spread.
//!
//! The trunk of a robe is a tube about the trunk of the body, oval, fronts over each other; above it two sheets, before and behind,
//! meet in an arc over the shoulders and go on as the sleeves. Cloth is longer or shorter there than it is by up to a fifth, and
//! finds its lengths as it settles.

use super::{Body, Cut, Form, Garment, GarmentError, Hang, Wear};
use crate::RigidPose;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};
use yugen_optics::special::smoothstep;

/// A place on a garment that lies flat.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spot {
    /// To the left of the middle, m.
    pub x: f32,
    /// Below the top of the shoulder, m.
    pub s: f32,
    pub front: bool,
    /// Of the left front, which lies on top of the right one, or of the left leg of trousers; x of these is along the waist, from the
    /// middle of the back to the left.
    pub left: bool,
}

/// What lies on top is so far outside as it begins, m: several times what contact keeps.
pub(super) const LAP: f32 = 0.015;
/// By so much at the least sleeves that are deeper than where they are sewn begin beside the body's side, m; they come apart within it.
const LEAVES: f32 = 0.05;
/// How far to its side each end of a collar goes that is sewn shut at the throat, to its height: so far that both are apart.
const PARTS: f32 = 0.25;
/// From the body to where the cloth begins, m: more than arms and folds of what is worn stand out.
pub(super) const ROOM: f32 = 0.03;
/// Spots of the mesh's vertices; of strips along others, those that they would have if they went on flat.
pub(super) fn spots(garment: &Garment, cut: &Cut) -> Vec<Spot> {
    let mut spots = vec![Spot::default(); cut.uvs.len()];
    let mut of_sheet: Vec<Vec<u32>> = vec![Vec::new(); cut.sheet.positions.len()];
    for (p, panel) in garment.panels.iter().enumerate() {
        let (from, run, front, left) = match panel.hang {
            Hang::Flat { from, run, front, left } => (from, run, front, left),
            Hang::Leg { from, left, front } => (from, -1.0, front, left),
            Hang::Along => continue,
        };
        for v in cut.panels[p]..cut.panels[p + 1] {
            let at = cut.uvs[v] - panel.bolt;
            spots[v] = Spot { x: from + run * at.x, s: at.y, front, left };
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
                let mut spot = Spot { x: base[j].x + d.x * u, s: base[j].s - d.y * u, ..base[j] };
                // Ends that meet in the middle part from there on.
                if spot.front && garment.wear.form == Form::Fastened {
                    spot.x = if spot.left { spot.x.max(PARTS * u) } else { spot.x.min(-PARTS * u) };
                }
                spots[row.first as usize + k] = spot;
            }
        }
    }
    spots
}

/// How a garment lies about a body with its arms spread.
pub(super) struct Arrangement {
    pub(super) wear: Wear,
    /// Of the body: its middle (x, z).
    pub(super) middle: Vec2,
    /// Top of the cloth over the shoulders, or at the waist, and half its depth, m.
    pub(super) top: f32,
    pub(super) depth: f32,
    /// Below the upper arms, m.
    pub(super) under: f32,
    /// How far the top of the shoulders is drawn to the back at the neck, m along the cloth.
    pub(super) back: f32,
    /// How far the neck is opened to either side, m.
    pub(super) opened: f32,
    /// By how much more than [`LEAVES`] sleeves begin beside the body, because trousers that are worn reach so far, m; and how far below the
    /// shoulder these begin, m.
    pub(super) beside: [f32; 2],
    /// Middles of the legs of trousers, from that of the body.
    pub(super) centres: [Vec2; 2],
}

impl Arrangement {
    /// About a body and what it wears already, which is at the points `worn`.
    pub fn new(wear: &Wear, body: &Body, poses: &[RigidPose], worn: &[Vec3]) -> Result<Self, GarmentError> {
        if let Some(legs) = wear.form.legs() {
            return Self::about_legs(wear, legs, body, poses);
        }
        let arms = body.capsules.iter().filter(|c| body.arms.iter().any(|arm| arm[0] == c.joint));
        let arms = arms.flat_map(|c| [0.0, 1.0].map(|part| c.sphere(&poses[c.joint], part)));
        let [under, top] = arms.fold([f32::INFINITY, f32::NEG_INFINITY], |[under, top], (p, r)| {
            [under.min(p.y - r), top.max(p.y + r)]
        });
        let top = top + 0.02;
        if !top.is_finite() {
            return Err(GarmentError::Body("has no capsule on its upper arms".into()));
        }
        let hem = top - wear.length + 0.1;
        let heights = [hem.min(top - 0.3), top];
        let mut discs = body.discs(poses, heights);
        discs.extend(discs_of(worn, heights, LAP));
        // Hands and feet reach where the garment does not.
        let x = 0.5 * (poses[body.arms[0][0]].position.x + poses[body.arms[1][0]].position.x);
        let trunk = discs.iter().filter(|(p, _)| (p.x - x).abs() < wear.half);
        let (low, high) =
            trunk.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), (p, r)| (l.min(p.y - r), h.max(p.y + r)));
        // Two sheets go over the shoulders in an arc and must still hang below the arms.
        let most = if wear.form.sheets() { 0.3 * wear.length } else { (wear.half + wear.hem) / PI };
        let depth = (0.5 * (high - low) + ROOM).max(0.1);
        if depth.is_nan() || depth >= most {
            return Err(GarmentError::Body(format!(
                "is {:.2} m deep from front to back{}; a robe of this {} has room for {:.2} m",
                high - low,
                if worn.is_empty() { "" } else { " with what it wears" },
                if wear.form.sheets() {
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
        // Of trousers that are worn, beside which sleeves hang.
        let levels = [top - wear.depth, top - wear.armhole];
        let worn = worn.iter().filter(|p| (levels[0]..=levels[1]).contains(&p.y));
        let [width, highest] =
            worn.fold([0.0, levels[0]], |[w, y]: [f32; 2], p| [w.max((p.x - x).abs()), y.max(p.y)]);
        let beside = [(width + ROOM - wear.half - LEAVES).max(0.0), top - highest];
        let sine = ((z - behind + 0.015) / depth).clamp(0.0, 0.9);
        Ok(Self {
            wear: *wear,
            middle: Vec2::new(x, z),
            top,
            depth,
            under,
            back: depth * sine.asin(),
            opened,
            beside,
            centres: [Vec2::ZERO; 2],
        })
    }

    /// From the middle of the back to the middle of the front, so far below the shoulder.
    pub(super) fn half_round(&self, s: f32) -> f32 {
        if let Some(legs) = self.wear.form.legs() {
            return legs.round;
        }
        let Wear { length, half, hem, armhole, .. } = self.wear;
        2.0 * half - (half - hem) * ((s - armhole) / (length - armhole)).clamp(0.0, 1.0)
    }

    /// How far along the way around a spot is, from the middle of the back to the left.
    pub(super) fn around(&self, spot: &Spot) -> f32 {
        match (spot.front, spot.left) {
            (false, _) => spot.x,
            _ if self.wear.form.legs().is_some() => spot.x,
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

    /// Part of [`LAP`] by which what is on the left lies on top: from its side on, and at the neck where fronts meet.
    pub(super) fn lapped(&self, spot: &Spot, closed: f32) -> f32 {
        if !matches!(self.wear.form, Form::Wrapped | Form::Open) {
            return 0.0;
        }
        let left = if spot.front { spot.left } else { spot.x > 0.0 };
        if !left {
            return 0.0;
        }
        let side = closed * smoothstep(0.3, 0.45, self.around(spot) / self.half_round(spot.s));
        let front = if spot.front { 1.0 - smoothstep(0.20, 0.32, spot.x) } else { 0.0 };
        side.max(front)
    }

    /// A spot in the world.
    pub fn at(&self, spot: &Spot) -> Vec3 {
        if let Some(legs) = self.wear.form.legs() {
            return self.on_leg(spot, legs);
        }
        let worn = self.worn(spot);
        self.slipped(spot).map_or(worn, |(slipped, part)| worn.lerp(slipped, part))
    }

    /// A spot of a robe, with both arms in their sleeves.
    pub(super) fn worn(&self, spot: &Spot) -> Vec3 {
        let Wear { half, sleeve, armhole, depth, cuff, .. } = self.wear;
        let d = self.depth;
        let drawn = self.back * (1.0 - smoothstep(0.3 * half, half, spot.x.abs()));
        let way = if spot.front { spot.s - drawn } else { spot.s + drawn };
        let arc = (way / d).min(FRAC_PI_2);
        let y = self.top - d + d * arc.cos() - (way - d * arc);
        let flat = d * arc.sin() * if spot.front { 1.0 } else { -1.0 };
        let closed = if self.wear.form.sheets() { 0.0 } else { smoothstep(0.1 * armhole, armhole, spot.s) };
        let (mut p, n);
        if spot.x.abs() <= half + 1e-4 {
            let (oval, outwards) = self.oval(self.around(spot), self.half_round(spot.s));
            let side = if spot.front { if spot.left { 1.0 } else { -1.0 } } else { spot.x.signum() };
            let mut open = self.opened * side * (1.0 - smoothstep(0.05, 0.4, spot.s));
            open *= 1.0 - smoothstep(0.3 * half, half, spot.x.abs());
            let beside = smoothstep(0.0, 2.0 * self.wear.neck, spot.x.abs());
            let parted = spot.front && self.wear.form != Form::Fastened;
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
            let lap = if spot.x > 0.0 { LAP * closed } else { 0.0 };
            // What is sewn to the back alone leaves the front from the shoulder on.
            let [from, to] = if self.wear.form == Form::Fastened && spot.front {
                [0.0, 0.2]
            } else {
                [0.6 * armhole, 1.2 * armhole]
            };
            let [more, begin] = self.beside;
            let leaves =
                lap + LEAVES * smoothstep(from, to, spot.s) + more * smoothstep(from, begin.max(to), spot.s);
            let x = if depth > armhole { x + leaves } else { x };
            // Where it leaves the body it is as shut as that.
            let own = smoothstep(0.1 * depth, depth, spot.s);
            let closed = closed + (own - closed) * smoothstep(half, half + LEAVES, spot.x.abs());
            p = Vec2::new(x * spot.x.signum(), flat * (1.0 - closed) * (1.0 - shut));
            n = Vec2::ZERO;
        }
        p += n * (LAP * self.lapped(spot, closed));
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
}

/// Points between two heights as discs (x, z).
pub(super) fn discs_of(
    worn: &[Vec3],
    [low, high]: [f32; 2],
    radius: f32,
) -> impl Iterator<Item = (Vec2, f32)> {
    worn.iter().filter(move |p| (low..=high).contains(&p.y)).map(move |p| (Vec2::new(p.x, p.z), radius))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::Cloth;
    use crate::dance;
    use crate::garment::{CUTS, parse};

    /// All measures at the ends of their ranges, each by itself. Where fronts lap over each other the collar may lie in them at first.
    #[test]
    fn what_does_not_lap_over_itself_begins_outside_of_itself() {
        let motion = dance::dance(&dance::parse("kamae").unwrap(), 60.0).unwrap();
        let (body, poses) = (Body::player(), motion.approach(0.0).unwrap());
        let (mut arranged, mut told, mut tight) = (0, 0, 0);
        for cut_of in CUTS {
            let ends = cut_of.measures.iter().flat_map(|m| m.range.map(|v| format!("{}={v}", m.name)));
            for text in std::iter::once(String::new()).chain(ends) {
                let garment = match parse(&format!("{} {text}", cut_of.name)) {
                    Ok(garment) => garment,
                    // Measures that do not go together.
                    Err(GarmentError::Text { .. }) => {
                        told += 1;
                        continue;
                    }
                    Err(other) => panic!("{} {text}: {other}", cut_of.name),
                };
                let begin = match Arrangement::new(&garment.wear, &body, &poses, &[]) {
                    Ok(begin) => begin,
                    // Too narrow for this body, or too low between its legs.
                    Err(GarmentError::Body(_)) => {
                        tight += 1;
                        continue;
                    }
                    Err(other) => panic!("{} {text}: {other}", cut_of.name),
                };
                if garment.wear.form == Form::Wrapped {
                    continue;
                }
                let cut = garment.cut(0.04).unwrap();
                let at = begin.place(&garment, &cut, &spots(&garment, &cut), &body, &poses, 0.005);
                let crossed = Cloth { sheet: cut.sheet, ..Cloth::default() }.crossings(&at).len();
                assert_eq!(crossed, 0, "{} {text}", cut_of.name);
                arranged += 1;
            }
        }
        println!("{arranged} arranged, {told} told, {tight} too tight");
        assert!(arranged > 30, "{arranged}");
        // Measured 47, 1 and 5.
        assert!(told <= 4 && tight <= 8, "{told} {tight}");
    }
}
