//! Masks (omote), carved as heights over an oval and painted with shell white (gofun).

use super::{hannya, ko_omote};
use crate::part::Finish;
use crate::pattern::Surface;
use crate::solid::{Grain, Grid, Solids};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// A mask.
pub struct Mask {
    /// On the command line.
    pub name: &'static str,
    /// Japanese, romaji and English.
    pub names: [&'static str; 3],
    /// What it is painted with.
    pub(crate) finish: Finish,
    /// What is carved onto the oval, by x to the viewer's right and y up from the middle of the front; all in mm.
    pub(super) carved: fn(f32, f32) -> f32,
    /// Half the width of the oval, mm, as part of the whole height from -1, the chin, to 1.
    pub(super) half_width: fn(f32) -> f32,
    /// How far the oval stands out, mm.
    pub(super) depth: f32,
    /// What stands out of it, if anything: names, and the solid in metres about the middle of the rim.
    pub(super) horns: Option<fn() -> yugen_scene::Mesh>,
}

/// All masks; the first is worn where nobody says.
pub static MASKS: [Mask; 2] = [ko_omote::MASK, hannya::MASK];

impl Mask {
    /// By its name.
    pub fn find(name: &str) -> Option<&'static Self> {
        MASKS.iter().find(|m| m.name == name)
    }
}

impl std::fmt::Debug for Mask {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// Width and height of the picture on a mask, m.
pub const SIZE: Vec2 = Vec2::new(0.164, 0.216);
/// Half the height of a mask, m.
pub const HALF: f32 = 0.103;
/// Wood behind the front, m.
const THICK: f32 = 0.007;
/// How far round the front goes, rad.
const ROUND: f32 = 0.46 * PI;

/// A hill: its middle, its half widths at 1/e, its height, and how far it falls to the outside, mm a mm.
pub type Hill = [f32; 6];

/// Its height at a place.
pub fn hill([cx, cy, sx, sy, height, falls]: Hill, x: f32, y: f32) -> f32 {
    height * (-((x - cx) / sx).powi(2) - ((y - cy + falls * (x - cx)) / sy).powi(2)).exp()
}

/// The height of hills in the middle and of those on both sides.
pub fn hills(middle: &[Hill], pairs: &[Hill], x: f32, y: f32) -> f32 {
    middle.iter().map(|m| hill(*m, x, y)).sum::<f32>()
        + pairs.iter().map(|p| hill(*p, x.abs(), y)).sum::<f32>()
}

/// How deep a groove is that lies at a height and is open so far to both sides, from 0 to 1.
pub fn groove(y: f32, (at, open): (f32, f32)) -> f32 {
    if open > 0.0 {
        yugen_optics::special::smoothstep(0.0, 0.6, open) * (-((y - at) / (open + 0.6)).powi(2)).exp()
    } else {
        0.0
    }
}

/// A picture on a mask, of its places in mm as in [`Mask::carved`], and of its texture's.
pub fn painted(texel: impl Fn(f32, f32, Vec2) -> crate::pattern::Texel) -> Surface {
    Surface::bake(512, 704, SIZE, |p| texel(1e3 * (p.x - 0.5 * SIZE.x), 1e3 * (0.5 * SIZE.y - p.y), p / SIZE))
}

impl Mask {
    /// A place of the front, m: z forward from the rim.
    fn front(&self, t: f32, turn: f32) -> Vec3 {
        let y = 1e3 * HALF * t;
        let x = (self.half_width)(t) * turn.sin();
        let depth = self.depth * (1.0 - t.powi(4)).max(0.0).sqrt();
        let z = depth * turn.cos().max(0.0).powf(0.8) + (self.carved)(x, y) * turn.cos().max(0.0).sqrt();
        1e-3 * Vec3::new(x, y, z)
    }

    /// The mask, with the origin in the middle of its rim; +z is where it looks.
    pub fn solids(&self) -> Solids {
        // Finer where the rim is.
        let rows: Vec<f32> = (0..=240).map(|i| 0.998 * (0.5 * PI * (1.0 - i as f32 / 120.0)).sin()).collect();
        let columns: Vec<f32> = (0..=150).map(|j| ROUND * (j as f32 / 75.0 - 1.0)).collect();
        let outside: Grid =
            rows.iter().map(|t| columns.iter().map(|a| self.front(*t, *a)).collect()).collect();
        let inside: Grid = outside
            .iter()
            .map(|r| {
                let back = Vec3::new(1.0 - THICK / 0.068, 1.0 - THICK / HALF, 1.0);
                r.iter().map(|p| (*p * back - Vec3::Z * THICK).max(Vec3::new(-1.0, -1.0, -THICK))).collect()
            })
            .collect();
        let mut s = Solids::new();
        let uv = |i: usize, j: usize| {
            let p = outside[i][j];
            Vec2::new(0.5 + p.x / SIZE.x, 0.5 - p.y / SIZE.y)
        };
        s.sheet(&outside, &inside, &uv, true, Grain { tile: SIZE, offset: Vec2::ZERO });
        s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::check_closed;

    #[test]
    fn masks_are_closed_and_as_large_as_masks_are() {
        for (mask, wide, deep) in
            MASKS.iter().zip([0.136, 0.152]).zip([0.07..0.1, 0.08..0.12]).map(|((m, w), d)| (m, w, d))
        {
            let mesh = mask.solids().mesh("mask");
            check_closed(&mesh).unwrap();
            let (low, high) = mesh
                .positions
                .iter()
                .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
            let size = high - low;
            // Of collections: ko-omote 21 by 13.5 cm and 7 deep, hannya 1 to 2 wider.
            assert!((size.y - 0.206).abs() < 2e-3 && (size.x - wide).abs() < 3e-3, "{} {size}", mask.name);
            assert!(deep.contains(&size.z), "{} {size}", mask.name);
            // The tip of the nose is what stands out most.
            let tip = mesh.positions.iter().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
            assert!(tip.x.abs() < 3e-3 && (-0.03..-0.01).contains(&tip.y), "{} {tip}", mask.name);
            if let Some(horns) = mask.horns {
                check_closed(&horns()).unwrap();
            }
        }
    }
}
