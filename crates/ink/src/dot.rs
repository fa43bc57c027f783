//! Dots (dian): what is too small for lines becomes one print of the brush.

use crate::control::Controls;
use crate::depth::DepthMap;
use crate::footprint::VARIANTS;
use crate::projection::Projection;
use crate::stamp::Stamp;
use crate::stroke::Hand;
use glam::{DVec3, Vec2};
use yugen_optics::random::{hash_combine, unit_f32};

/// Half the size of what becomes a dot, pixels of a picture of 1080 lines.
const SMALL: f32 = 6.0;
/// Smallest half width of a print, pixels: less is not seen.
const LEAST: f32 = 0.8;
/// Dryness and density, which the slides have as constants: a loaded brush that only touches.
const DRYNESS: f32 = 0.2;
const LOAD: f32 = 1.4;
/// Longest print, as length over width.
const LONGEST: f32 = 2.5;

/// Whether a placed mesh with these vertices is too small for lines: `None` where it is not, else its dot where it is seen. `at`: the
/// controls of what is painted at a place of the picture.
pub fn dot(
    positions: &[DVec3],
    projection: &Projection,
    map: &DepthMap,
    hand: &Hand,
    at: &dyn Fn(Vec2) -> Controls,
    draw: u32,
    shape: u32,
) -> Option<Option<Stamp>> {
    let (mut low, mut high, mut depth) = (Vec2::INFINITY, Vec2::NEG_INFINITY, 0.0f32);
    for p in positions {
        // What reaches before the near plane is not small.
        let at = projection.project(*p)?;
        let pixel = at.pixel.as_vec2();
        (low, high) = (low.min(pixel), high.max(pixel));
        depth = depth.max(at.depth as f32);
        if (high - low).max_element() > 2.0 * SMALL * hand.unit {
            return None;
        }
    }
    let (middle, size) = (0.5 * (low + high), high - low);
    if !middle.is_finite() {
        return None;
    }
    let inside =
        middle.cmpge(Vec2::ZERO).all() && middle.x < map.size[0] as f32 && middle.y < map.size[1] as f32;
    if !inside {
        return Some(None);
    }
    let c = at(middle);
    if c.dot <= 0.0 {
        return Some(None);
    }
    // Seen where it is the shape of the pixel, or so small that it is between pixels and nothing is before it.
    let (near, there) = map.at(middle);
    if there != shape && near < depth {
        return Some(None);
    }
    let id = hash_combine(hand.seed, hash_combine(draw, 0xd07));
    let (long, short) = (size.max_element(), size.min_element());
    let stretch = (long / short.max(1e-3)).clamp(1.0, LONGEST);
    let far = 1.0 - 0.75 * c.distance * (1.0 - hand.nearness(depth));
    Some(Some(Stamp {
        pixel: middle.into(),
        radius: (0.55 * long / stretch).max(LEAST),
        // By the ratio of width and height, as the slides have it.
        angle: size.y.atan2(size.x),
        dryness: DRYNESS * c.dryness,
        ink: LOAD * c.ink * c.dot * far,
        s: 90.0 * unit_f32(hash_combine(id, 1)),
        lane: unit_f32(hash_combine(id, 2)),
        variant: id % VARIANTS as u32,
        shape: 0,
        weight: 1.0,
        stretch,
        ratio: 1.0,
    }))
}
