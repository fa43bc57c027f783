//! Stamps: what the GPU draws of strokes, one print of the brush after another.

use crate::footprint::VARIANTS;
use crate::stroke::{Stroke, tangent};
use bytemuck::{Pod, Zeroable};
use yugen_optics::random::{hash_combine, unit_f32};

/// One print of the brush: 12 words.
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

/// The stamps of a stroke. `full`: half the width of the full brush, pixels.
pub fn along(stroke: &Stroke, full: f32, stamps: &mut Vec<Stamp>) {
    let points = &stroke.points;
    if points.len() < 2 {
        return;
    }
    let lane = unit_f32(hash_combine(stroke.id, 0x1a_9e));
    let last = if stroke.closed { points.len() } else { points.len() - 1 };
    let (mut next, mut number) = (0.0f32, 0u32);
    for i in 0..last {
        let (a, b) = (&points[i], &points[(i + 1) % points.len()]);
        let length = a.pixel.distance(b.pixel);
        let end = a.s + length;
        let ways = [tangent(points, i), tangent(points, (i + 1) % points.len())];
        while next <= end {
            let t = if length > 0.0 { ((next - a.s) / length).clamp(0.0, 1.0) } else { 0.0 };
            let mix = |x: f32, y: f32| x + (y - x) * t;
            let radius = mix(a.radius, b.radius);
            stamps.push(Stamp {
                pixel: a.pixel.lerp(b.pixel, t).into(),
                radius,
                angle: ways[0].lerp(ways[1], t).to_angle(),
                dryness: mix(a.dryness, b.dryness),
                ink: mix(a.ink, b.ink),
                s: next / full,
                lane,
                variant: hash_combine(stroke.id, number) % VARIANTS as u32,
                weight: 1.0,
                stretch: 1.0,
                ratio: radius / full,
            });
            number += 1;
            next += (SPACING * radius).max(LEAST_SPACING);
        }
    }
}
