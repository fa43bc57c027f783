//! Stamps: what the GPU draws of strokes, one print of the brush after another.

use crate::footprint::VARIANTS;
use crate::stroke::{Stroke, tangent};
use bytemuck::{Pod, Zeroable};
use yugen_optics::random::{hash_combine, unit_f32};

/// One print of the brush: 13 words.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Stamp {
    /// Pixels.
    pub pixel: [f32; 2],
    /// Half the width across its way, pixels.
    pub radius: f32,
    /// The brush's way: 0 to the right, a quarter turn down.
    pub angle: f32,
    /// Lack of water, 0 to 1.
    pub dryness: f32,
    /// Density of ink.
    pub ink: f32,
    /// Arc length from the beginning of its stroke, in half widths of the full brush.
    pub s: f32,
    /// Which part of the trail of bristles the stroke has: 0 to 1.
    pub lane: f32,
    /// Which mask.
    pub variant: u32,
    /// The shape at whose outline it ends, counted from one; 0: at none.
    pub shape: u32,
    /// How much it counts, 0 to 1: below one it fades in or out.
    pub weight: f32,
    /// Length along its way over width.
    pub stretch: f32,
    /// Its half width over that of the full brush.
    pub ratio: f32,
}

/// Distance between stamps, in half widths of the brush: closer adds nothing that is seen, for overlap is evened out; farther
/// shows single prints.
pub const SPACING: f32 = 0.25;
/// Closest distance, pixels.
const LEAST_SPACING: f32 = 0.6;

/// The stamps of a stroke. `full`: half the width of the full brush, pixels. They stand at phases that are multiples of a
/// distance, which doubles as the brush widens: where a stroke is carried from frame to frame its prints go with it.
pub fn along(stroke: &Stroke, full: f32, stamps: &mut Vec<Stamp>) {
    let points = &stroke.points;
    if points.len() < 2 {
        return;
    }
    let lane = unit_f32(hash_combine(stroke.seed, 0x1a_9e));
    let last = if stroke.closed { points.len() } else { points.len() - 1 };
    for i in 0..last {
        let (a, b) = (&points[i], &points[(i + 1) % points.len()]);
        let ways = [tangent(points, i), tangent(points, (i + 1) % points.len())];
        let begin = a.phase;
        let end = if i + 1 < points.len() { b.phase } else { begin + a.pixel.distance(b.pixel) };
        let spacing = (SPACING * 0.5 * (a.radius + b.radius)).max(LEAST_SPACING);
        // In units of the least, a power of two.
        let steps = 1 << (spacing / LEAST_SPACING).log2() as u32;
        let step = LEAST_SPACING * steps as f32;
        let mut number = (begin / step).ceil() as i64;
        while (number as f32) * step < end {
            let t = ((number as f32 * step - begin) / (end - begin).max(1e-6)).clamp(0.0, 1.0);
            let mix = |x: f32, y: f32| x + (y - x) * t;
            let radius = mix(a.radius, b.radius);
            let phase = number as f32 * step;
            stamps.push(Stamp {
                pixel: a.pixel.lerp(b.pixel, t).into(),
                radius,
                angle: ways[0].lerp(ways[1], t).to_angle(),
                dryness: mix(a.dryness, b.dryness),
                ink: mix(a.ink, b.ink),
                s: phase / full,
                lane,
                variant: hash_combine(stroke.seed, (number * steps) as u32) % VARIANTS as u32,
                shape: 0,
                weight: 1.0,
                stretch: 1.0,
                ratio: radius / full,
            });
            number += 1;
        }
    }
}
