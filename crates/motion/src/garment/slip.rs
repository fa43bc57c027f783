//! Where a robe begins that is slipped off the right shoulder: the arm never was in the sleeve.
//!
//! Above the belt the right front goes around the side of the body to its back, farther with each row, until the shoulder seam lies behind
//! the right shoulder blade; it and the back meet there in a fold that stands out behind, and the sleeve goes on from it. All of it is below the
//! arm and, row by row, beside itself.

use super::Wear;
use super::place::{Arrangement, Spot};
use glam::{Vec2, Vec3};
use yugen_optics::special::smoothstep;

/// Where the front begins to go around, above the belt, m: what the belt takes lies as in other robes.
const ABOVE: f32 = 0.02;
/// From where on it is all behind the body, in parts of the way from the shoulder to there. Threads of the warp are then a third longer than
/// they are, and less tall by [`STEEP`].
const BEHIND: f32 = 0.36;
/// How steep cloth above the belt begins, in parts of its length: with .3 it came out of its folds through itself, with .5 to .8 it did not.
const STEEP: f32 = 0.55;
/// It ends so far below the arms, m.
const BELOW: f32 = 0.01;
/// Rows of the back are level from so far above the belt on, m.
const LEVEL: f32 = 0.15;
/// How far to the left of the middle the back begins to go over into what has slipped, m.
const OVER: f32 = 0.12;
/// Direction in which the fold stands out (x, z): almost that of the body's side, to the back.
const AWAY: Vec2 = Vec2::new(-0.2, -0.98);
/// Its two layers, and those of the sleeve, are so far apart, m, from so far out on.
const GAP: [f32; 2] = [0.02, 0.06];

impl Wear {
    /// How far below the shoulder what is slipped off begins to fold over, m.
    pub(super) fn folded(&self) -> f32 {
        self.belt[0] - ABOVE
    }
}

impl Arrangement {
    /// Of a spot that is slipped off: where it is, and the part by which it is there rather than where it is worn.
    pub(super) fn slipped(&self, spot: &Spot) -> Option<(Vec3, f32)> {
        let wear = &self.wear;
        let (x, s, end) = (spot.x, spot.s, wear.folded());
        if !wear.bare || s >= end || (spot.front && spot.left) {
            return None;
        }
        let part = if spot.front { 1.0 } else { 1.0 - smoothstep(-wear.neck, OVER, x) };
        // How far the fold stands out, and where around the body it begins: what is farther to the right than that is on it.
        let folded = (wear.half - wear.neck) * ((end - s) / (end * (1.0 - BEHIND))).min(1.0);
        let root = folded - wear.half;
        let out = root - x;
        let half_round = self.half_round(s);
        let around = match (out > 0.0, spot.front) {
            (true, _) => root,
            (_, true) => 2.0 * folded - half_round - x,
            (_, false) => x,
        };
        let (mut p, _) = self.oval(around, half_round);
        if out > 0.0 {
            let beside = if spot.front { -AWAY.perp() } else { AWAY.perp() };
            p += AWAY * out + beside * (0.5 * GAP[0] * smoothstep(0.0, GAP[1], out));
        }
        p += self.middle;
        let side = self.height_at(-wear.half, half_round, end);
        let steep = STEEP.min((self.under - BELOW - side) / end).max(0.1);
        let mut level = self.height_at(around, half_round, end);
        if around > -wear.half {
            level += (side - level) * smoothstep(0.0, LEVEL, end - s);
        }
        let y = level + steep * (end - s);
        Some((Vec3::new(p.x, y, p.y), part))
    }

    /// How high a row of the worn robe is, so far around.
    fn height_at(&self, around: f32, half_round: f32, s: f32) -> f32 {
        let front = around < -self.wear.half;
        let x = if front { -half_round - around } else { around };
        self.worn(&Spot { x, s, front, left: false }).y
    }
}

#[cfg(test)]
mod tests {
    use super::super::place::spots;
    use super::*;
    use crate::cloth::Cloth;
    use crate::dance;
    use crate::garment::{Body, CUTS, GarmentError, parse};

    /// All measures at the ends of their ranges, each by itself.
    #[test]
    fn what_is_slipped_off_begins_below_the_arm_and_hardly_in_itself() {
        let motion = dance::dance(&dance::parse("kamae").unwrap(), 60.0).unwrap();
        let (body, poses) = (Body::player(), motion.approach(0.0).unwrap());
        let kosode = CUTS.iter().find(|c| c.name == "kosode").unwrap();
        let ends = kosode.measures.iter().flat_map(|m| m.range.map(|v| format!("{}={v}", m.name)));
        let mut arranged = 0;
        for text in std::iter::once(String::new()).chain(ends) {
            let [slipped, worn] = ["nugisage", ""].map(|style| {
                // Told where sleeves end below the belt.
                let garment = parse(&format!("kosode {style} {text}")).ok()?;
                let begin = match Arrangement::new(&garment.wear, &body, &poses, &[]) {
                    Ok(begin) => begin,
                    Err(GarmentError::Body(_)) => return None,
                    Err(other) => panic!("{text}: {other}"),
                };
                let cut = garment.cut(0.04).unwrap();
                let spots = spots(&garment, &cut);
                let at = begin.place(&garment, &cut, &spots, &body, &poses, 0.005);
                let arm = poses[body.arms[1][0]].position;
                let sleeve = cut.vertex.iter().zip(&spots).filter(|(_, s)| s.x < -garment.wear.half - 1e-4);
                let top = sleeve.map(|(v, _)| at[*v as usize].y - arm.y).fold(f32::NEG_INFINITY, f32::max);
                let crossed = Cloth { sheet: cut.sheet, ..Cloth::default() }.crossings(&at).len();
                Some((crossed, top))
            });
            let (Some((crossed, top)), Some((as_worn, above))) = (slipped, worn) else { continue };
            println!(
                "{text}: {crossed} edges cross, {as_worn} as worn; sleeve to {top:.3} m, {above:.3} as worn"
            );
            // An arm is .058 m thick.
            assert!(top < -0.058 && above > 0.058, "{text}: {top} {above}");
            // Measured 16 at the most where it is not worse as worn.
            assert!(crossed <= as_worn.max(40), "{text}: {crossed}");
            arranged += 1;
        }
        assert!(arranged > 15, "{arranged}");
    }
}
