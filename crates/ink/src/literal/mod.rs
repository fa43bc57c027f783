//! The method of Xu, Yang and Wu 2012, "Stroke-based Real-time Rendering of Ink Wash Style for Geometric Models" (SIGGRAPH
//! Asia), as their slides stand: the baseline that this room is measured against.
//!
//! A first pass leaves pressure, angle, dryness and intensity ([`Padi`]) in each pixel, for each of the five techniques by itself:
//! contouring ([`contour`]), wrinkling, rubbing and colouring ([`surface`]), and dotting, which makes a whole mesh one particle.
//! In the second pass every inked pixel becomes a print of the brush that is blended over those before it, with a random
//! threshold of its own. One view vector serves all vertices, each triangle gives a line by itself, and what is seen is decided
//! by depth with a bias.
//!
//! The slides give formulae and no numbers; those in [`constant`] are chosen here.

pub mod contour;
pub mod surface;

use crate::footprint::{EXTENT, Footprint, TEXELS};
use glam::Vec2;
use yugen_optics::random::{hash_combine, unit_f32};

/// Pressure, angle, dryness and intensity of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Padi {
    /// 0 to 1.
    pub pressure: f32,
    /// Radians; 0 to the right, a quarter turn down.
    pub angle: f32,
    /// 0 to 1.
    pub dryness: f32,
    /// 0 to 1; 0 where nothing is drawn.
    pub intensity: f32,
}

/// What the slides leave open: medium dryness and heavy ink of contours, a pressure that swings about its middle once around the
/// outline.
pub mod constant {
    /// Of the circular mapping A sin(ω θ + φ) + T.
    pub const A: f32 = 0.35;
    /// A whole number, else it has a seam.
    pub const OMEGA: f32 = 1.0;
    /// Middle of the pressure.
    pub const T: f32 = 0.55;
    /// Of contours.
    pub const DRYNESS: f32 = 0.45;
    /// Of contours.
    pub const INTENSITY: f32 = 0.9;
    /// Relative depth by which a line may lie behind what is seen.
    pub const Z_BIAS: f32 = 1e-3;
    /// Half widths of prints of wrinkling and rubbing, and of colouring, beside those of contours.
    pub const WRINKLING_SIZE: f32 = 0.4;
    /// See [`WRINKLING_SIZE`].
    pub const COLOURING_SIZE: f32 = 1.0;
    /// How much a mask counts, and one of dispersed ink where the brush is wholly wet.
    pub const K: f32 = 1.0;
    /// See `K`.
    pub const K_DIFF: f32 = 0.45;
    /// How much dryness takes away of contours and dots.
    pub const K_DRY: f32 = 0.9;
    /// The same of wrinkling, rubbing and colouring, whose ink is paler than contours by as much.
    pub const K_DRY_SURFACE: f32 = 0.2;
    /// Ink that prints leave at a place of a surface that is wholly covered, were they of the densest: so that ink of intensity
    /// one is black.
    pub const COVERAGE: f32 = 3.0;
}

/// The five techniques, in the order in which they are painted: light to dark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Technique {
    /// Ran.
    Colouring,
    /// Cun.
    Wrinkling,
    /// Ca.
    Rubbing,
    /// Gou.
    Contouring,
    /// Dian.
    Dotting,
}

/// Second pass: every inked pixel as a particle of at most `radius` pixels, over what `alpha` has and one over the other.
/// `weight`: of all the k of α = (k F + k_diff F_diff) I − k_dry ξ D, less where particles are dense; and k_dry beside it.
pub fn particles(
    alpha: &mut [f32],
    pixels: &[Padi],
    [w, h]: [u32; 2],
    masks: &[Footprint],
    [radius, weight, k_dry]: [f32; 3],
    seed: u32,
) {
    use constant::{K, K_DIFF};
    for (i, p) in (0u32..).zip(pixels).filter(|(_, p)| p.intensity > 0.0) {
        let hash = hash_combine(seed, i);
        let (mask, xi) = (&masks[hash as usize % masks.len()], unit_f32(hash_combine(hash, 1)));
        let r = (radius * p.pressure.clamp(0.0, 1.0)).max(0.5);
        let centre = Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
        let reach = r * EXTENT;
        let range =
            |c: f32, n: u32| (c - reach).floor().max(0.0) as u32..((c + reach).ceil().max(0.0) as u32).min(n);
        let turn = Vec2::from_angle(-p.angle);
        for y in range(centre.y, h) {
            for x in range(centre.x, w) {
                let local = turn.rotate(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - centre) / reach;
                if local.abs().max_element() >= 1.0 {
                    continue;
                }
                let texel = ((local + 1.0) * 0.5 * TEXELS as f32).as_uvec2();
                let at = texel.y as usize * TEXELS + texel.x as usize;
                let k_diff = K_DIFF * (1.0 - p.dryness);
                let load = (K * mask.bristles[at] + k_diff * mask.diffused[at]) * p.intensity;
                // Nothing is taken away beyond the print.
                let a =
                    if load > 0.0 { weight * (load - k_dry * xi * p.dryness).clamp(0.0, 1.0) } else { 0.0 };
                let under = &mut alpha[(y * w + x) as usize];
                *under += a * (1.0 - *under);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use yugen_optics::random::Pcg32;

    /// The slides' threshold is drawn for each particle, so that white disappears where prints overlap; one that belongs to
    /// the place keeps it, and evened-out overlap keeps the tone as well. Published here: mean alpha and share of white
    /// (alpha below .05) of a stroke of a box footprint with alpha .7 − D ξ.
    #[test]
    fn noise_of_each_particle_has_no_flying_white() {
        let mut random = Pcg32::new(11, 4);
        let places = 20_000;
        let (mut own, mut fixed, mut evened) = ([0.0f64; 2], [0.0f64; 2], [0.0f64; 2]);
        let (dryness, overlaps) = (0.9f32, 24);
        let note = |sum: &mut [f64; 2], alpha: f32| {
            sum[0] += f64::from(alpha) / f64::from(places);
            sum[1] += f64::from(u8::from(alpha < 0.05)) / f64::from(places);
        };
        for _ in 0..places {
            let alpha = |xi: f32| (0.7 - dryness * xi).clamp(0.0, 1.0);
            let place = random.next_f32();
            let (mut a, mut b) = (0.0f32, 0.0f32);
            for _ in 0..overlaps {
                a += alpha(random.next_f32()) * (1.0 - a);
                b += alpha(place) * (1.0 - b);
            }
            note(&mut own, a);
            note(&mut fixed, b);
            note(&mut evened, alpha(place));
        }
        println!("own {own:?} fixed {fixed:?} evened {evened:?}");
        // As measured independently: 1.00 and none, .73 and 22 %, .27 and 28 %; places are 20 000, so ±1 %.
        assert!(own[0] > 0.99 && own[1] < 1e-3);
        assert!((fixed[0] - 0.73).abs() < 0.02 && (fixed[1] - 0.24).abs() < 0.03, "{fixed:?}");
        assert!((evened[0] - 0.27).abs() < 0.02 && (evened[1] - 0.28).abs() < 0.02, "{evened:?}");
    }
}
