//! Masks (omote), carved as heights over an oval and painted with shell white (gofun).
//!
//! The young woman, ko-omote: the face hardly moves when it is looked at, and seems to when it is tilted, because eyes, mouth and
//! cheeks are cut so that light from above darkens them (kumorasu, tilted down) or brightens them (terasu, tilted up).

use crate::pattern::{Surface, Texel, fbm, noise, srgb};
use crate::solid::{Grain, Grid, Solids};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use yugen_optics::special::smoothstep;

/// Width and height of the picture on it, m; the mask itself is .136 by .206.
pub const SIZE: Vec2 = Vec2::new(0.144, 0.216);
/// Half its height, m.
pub const HALF: f32 = 0.103;
/// Wood behind the front, m.
const THICK: f32 = 0.007;
/// How far round the front goes, rad.
const ROUND: f32 = 0.46 * PI;

// Below, x to the viewer's right and y up from the middle of the front are in millimetres.

/// A hill: its middle, its half widths at 1/e, its height.
type Hill = [f32; 5];
/// On both sides.
const PAIRS: [Hill; 5] = [
    // Sockets and, in them, the balls under their lids.
    [27.0, 21.0, 21.0, 9.0, -5.0],
    [27.0, 12.0, 15.0, 8.0, 5.0],
    // Cheeks.
    [37.0, -20.0, 21.0, 25.0, 5.0],
    // Wings of the nose, and what runs from them to the mouth's corners.
    [10.0, -21.0, 5.5, 5.0, 6.0],
    [21.0, -44.0, 6.0, 9.0, -2.0],
];
/// In the middle.
const MIDDLE: [Hill; 7] = [
    [0.0, 58.0, 46.0, 30.0, 5.0],
    // Mouth, upper lip, lower lip, the hollow below it, chin.
    [0.0, -46.0, 25.0, 16.0, 6.0],
    [-5.0, -41.5, 8.0, 3.2, 2.2],
    [5.0, -41.5, 8.0, 3.2, 2.2],
    [0.0, -52.5, 11.0, 3.6, 4.0],
    [0.0, -61.0, 15.0, 4.5, -3.0],
    [0.0, -79.0, 19.0, 14.0, 8.0],
];

fn hill([cx, cy, sx, sy, height]: Hill, x: f32, y: f32) -> f32 {
    height * (-((x - cx) / sx).powi(2) - ((y - cy) / sy).powi(2)).exp()
}

/// Where the slit of an eye is at a distance from the middle of the face, and how far open it is.
fn slit(x: f32) -> (f32, f32) {
    let along = (x - 27.0) / 13.5;
    // It hangs a little to the outside.
    (11.5 - 2.2 * along * along - 1.0 * along, 2.6 * (1.0 - along * along).max(0.0).sqrt())
}

/// Where the mouth is open, and how far.
fn gap(x: f32) -> (f32, f32) {
    let along = x / 18.0;
    (-47.5 + 1.8 * along * along, 2.0 * (1.0 - along * along).max(0.0).sqrt())
}

/// What is carved onto the oval.
fn carved(x: f32, y: f32) -> f32 {
    let mut h: f32 = MIDDLE.iter().map(|m| hill(*m, x, y)).sum();
    h += PAIRS.iter().map(|p| hill(*p, x.abs(), y)).sum::<f32>();
    // The nose rises from between the eyes to its tip.
    let width = 6.5 + 3.5 * smoothstep(20.0, -18.0, y);
    h += 18.0 * smoothstep(34.0, -17.0, y) * smoothstep(-29.0, -20.0, y) * (-(x / width).powi(2)).exp();
    let groove = |(at, open): (f32, f32)| {
        if open > 0.0 { smoothstep(0.0, 0.6, open) * (-((y - at) / (open + 0.6)).powi(2)).exp() } else { 0.0 }
    };
    h - 2.6 * groove(slit(x.abs())) - 4.5 * groove(gap(x))
}

/// Half the width of the oval, as part of the whole height from -1, the chin, to 1.
fn half_width(t: f32) -> f32 {
    if t > 0.0 {
        68.0 * (1.0 - t.powf(3.0)).max(0.0).powf(0.45)
    } else {
        68.0 * (1.0 - (-t).powf(2.3)).max(0.0).powf(0.52)
    }
}

/// A place of the front, m: z forward from the rim.
fn front(t: f32, turn: f32) -> Vec3 {
    let y = 1e3 * HALF * t;
    let x = half_width(t) * turn.sin();
    let depth = 60.0 * (1.0 - t.powi(4)).max(0.0).sqrt();
    let z = depth * turn.cos().max(0.0).powf(0.8) + carved(x, y) * turn.cos().max(0.0).sqrt();
    1e-3 * Vec3::new(x, y, z)
}

/// The mask, with the origin in the middle of its rim; +z is where it looks.
pub fn solids() -> Solids {
    // Finer where eyes and mouth are.
    let rows: Vec<f32> = (0..=240).map(|i| 0.998 * (0.5 * PI * (1.0 - i as f32 / 120.0)).sin()).collect();
    let columns: Vec<f32> = (0..=150).map(|j| ROUND * (j as f32 / 75.0 - 1.0)).collect();
    let outside: Grid = rows.iter().map(|t| columns.iter().map(|a| front(*t, *a)).collect()).collect();
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

/// How it is painted.
pub fn painting() -> Surface {
    let (white, blush, hair) = (srgb(0xe9dcc3), srgb(0xe0b79c), srgb(0x17120f));
    let (lips, teeth, pupil) = (srgb(0xa63a2c), srgb(0x1c1512), srgb(0x080606));
    let mix = |a: Vec3, b: Vec3, t: f32| a.lerp(b, t.clamp(0.0, 1.0));
    let within = |d: f32, soft: f32| 1.0 - smoothstep(-soft, soft, d);
    Surface::bake(512, 768, SIZE, |p| {
        let (x, y) = (1e3 * (p.x - 0.5 * SIZE.x), 1e3 * (0.5 * SIZE.y - p.y));
        let side = x.abs();
        let q = p / SIZE;
        let cloud = fbm(q * Vec2::new(6.0, 9.0), [6, 9], 4, 401);
        let brush = noise(q * Vec2::new(40.0, 160.0), [40, 160], 402);
        let mut colour = white * (1.0 + 0.035 * cloud + 0.012 * brush);
        colour = mix(colour, blush, 0.35 * hill([38.0, -22.0, 22.0, 20.0, 1.0], side, y));
        let mut roughness = 0.42 + 0.05 * cloud;
        // Lips, and between them the teeth, which are black.
        let (middle, open) = gap(x);
        let bow = -38.2 - 1.6 * (-(x / 3.0).powi(2)).exp() - 0.016 * x * x;
        let under = -57.5 + 0.028 * x * x;
        let lip = within(y - bow, 0.5) * within(under - y, 0.5) * within(side - 19.0, 0.8);
        colour = mix(colour, lips * (1.0 + 0.1 * cloud), lip);
        colour = mix(colour, teeth, within((y - middle).abs() - open, 0.35) * smoothstep(0.0, 0.5, open));
        // Eyes: white, a black pupil, a line above.
        let (middle, open) = slit(side);
        if open > 0.0 {
            let eye = within((y - middle).abs() - open, 0.3);
            colour = mix(colour, srgb(0xcfc4ae), eye);
            colour = mix(colour, pupil, eye * within((side - 25.5).abs() - 4.2, 0.3));
            let line = within((y - middle - open).abs() - 0.9, 0.35);
            colour = mix(colour, hair, line * smoothstep(0.0, 0.5, open));
            colour = mix(colour, hair, 0.5 * within((y - middle + open).abs() - 0.3, 0.3));
        }
        // Nostrils.
        colour = mix(colour, teeth, 0.85 * within(((side - 5.5) / 2.6).hypot((y + 27.5) / 1.6) - 1.0, 0.25));
        // Eyebrows high on the forehead, smudged with the finger.
        let brow = hill([29.0, 52.0 - 0.02 * (side - 29.0).powi(2), 16.0, 7.0, 1.0], side, y);
        colour = mix(colour, hair, 0.88 * smoothstep(0.25, 0.9, brow + 0.05 * cloud));
        // Hair: parted in the middle, along the rim to the cheeks, with loose strands before it.
        let line = 79.0
            - 0.0052 * side * side
            - 34.0 * smoothstep(44.0, 66.0, side)
            - 60.0 * smoothstep(58.0, 70.0, side);
        let over = y - line;
        let strand = noise(Vec2::new(220.0 * q.x, 30.0 * q.y), [220, 30], 403);
        let mut black = within(-over, 0.8);
        for (k, width) in [(3.2, 0.55), (6.4, 0.5), (9.8, 0.45)] {
            black = black.max(
                within((over + k + 0.05 * side).abs() - width, 0.3)
                    * smoothstep(14.0, 30.0, side)
                    * smoothstep(8.0, 30.0, y),
            );
        }
        black *= 1.0 - within(side - 0.5, 0.4);
        colour = mix(colour, hair * (1.0 + 0.4 * strand), black);
        roughness = roughness + (0.3 - roughness) * black.max(0.7 * lip);
        Texel {
            colour: colour.clamp(Vec3::ZERO, Vec3::ONE),
            roughness,
            metallic: 0.0,
            // Brushed ground, worn hair.
            height: 1.2e-5 * brush + 4e-5 * black * strand.abs(),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::check_closed;

    #[test]
    fn the_mask_is_closed_and_as_large_as_masks_are() {
        let mesh = solids().mesh("mask");
        check_closed(&mesh).unwrap();
        let (low, high) = mesh
            .positions
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let size = high - low;
        // Ko-omote of collections: 21 by 13.5 cm, 7 deep.
        assert!((size.y - 0.206).abs() < 2e-3 && (size.x - 0.136).abs() < 3e-3, "{size}");
        assert!((0.07..0.1).contains(&size.z), "{size}");
        // The tip of the nose is what stands out most.
        let tip = mesh.positions.iter().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
        assert!(tip.x.abs() < 3e-3 && (-0.028..-0.012).contains(&tip.y), "{tip}");
    }
}
