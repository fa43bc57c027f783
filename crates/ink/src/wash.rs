//! Colour wash (ran): broad, wet prints of a soft brush where it is dark, and of a small one where something finer is: hair, the eyes
//! of a mask, the pattern of a robe (from coarse to fine, as Hertzmann 1998, "Painterly Rendering with Curved Brush Strokes of
//! Multiple Sizes").

use crate::control::Controls;
use crate::footprint::VARIANTS;
use crate::scatter::Surfaces;
use crate::stamp::Stamp;
use crate::tone::{in_shades, share};
use glam::Vec2;
use yugen_optics::random::{hash_combine, unit_f32};
use yugen_optics::special::smoothstep;

/// Half the width of a print, pixels of a picture of 1080 lines: two and a half times a wrinkle's.
const RADIUS: f32 = 15.0;
/// Prints that overlap at a place, in the mean: fewer leave holes, more cost time and change nothing.
const OVERLAP: f32 = 9.0;
/// Xu, Yang and Wu's factors and exponents of a wash: m is low so that it fills and does not speak, q low for it is wet.
const M: f32 = 0.8;
const BETA: f32 = 1.6;
const Q: f32 = 0.2;
const GAMMA: f32 = 0.8;
/// Falloff from the outline to the middle: what looks at the eye gets so much of what the edge gets.
const MIDDLE: f32 = 0.62;
/// Grey from which on it does: what is black is black all over.
const BLACK: f32 = 0.35;
/// The small brush beside the broad one, and how many of its prints overlap.
const SMALL: f32 = 1.0 / 3.0;
const SMALL_OVERLAP: f32 = 6.0;
/// How much more a small print weighs, by eye: it lies over broad ones, of whose ink and its own the paper shows the mean.
const PRESSED: f32 = 2.0;
/// Between which differences of grey within a broad print and a small one the small one takes over, by eye: noise of the light made
/// specks below.
const FINE: [f32; 2] = [0.1, 0.2];
/// Load of ink at intensity one.
const LOAD: f32 = 1.5;

/// Darkness where light is `grey`, from outline (`facing` 0) to middle (1).
fn darkness(grey: f32, facing: f32) -> f32 {
    (1.0 - grey) * (1.0 + (MIDDLE - 1.0) * smoothstep(0.0, 0.8, facing) * smoothstep(0.0, BLACK, grey))
}

/// The stamps on `surfaces`.
pub fn stamps(surfaces: &Surfaces) -> Vec<Stamp> {
    let mut stamps = by(surfaces, 1.0, OVERLAP, 0x7a5);
    stamps.extend(by(surfaces, SMALL, SMALL_OVERLAP, 0x5a5));
    stamps
}

/// Those of a brush that is `scale` of the broad one.
fn by(surfaces: &Surfaces, scale: f32, overlap: f32, salt: u32) -> Vec<Stamp> {
    let Surfaces { map, tones, unit, .. } = *surfaces;
    let broad_of = |size: f32| RADIUS * unit * size.sqrt();
    let density = |c: &Controls| {
        if c.wash > 0.0 { overlap / (std::f32::consts::PI * (scale * broad_of(c.size)).powi(2)) } else { 0.0 }
    };
    let mut stamps = Vec::new();
    for place in surfaces.scatter(density, salt) {
        let controls = surfaces.controls(&place);
        let broad = broad_of(controls.size);
        let full = scale * broad;
        let random = |k: u32| unit_f32(hash_combine(place.hash, k));
        let Some(i) = tones.index(place.pixel) else { continue };
        let mean_grey = |radius: f32| tones.grey(place.pixel, 0.9 * radius, place.shape);
        let Some(grey) = mean_grey(full) else { continue };
        let dark = in_shades(darkness(grey, tones.facing[i]));
        if dark < 0.02 {
            continue;
        }
        let is_small = scale < 1.0;
        let Some(of_other) = mean_grey(if is_small { broad } else { SMALL * broad }) else { continue };
        let fine = smoothstep(FINE[0], FINE[1], (grey - of_other).abs());
        let share_of_brush = if is_small { PRESSED * fine } else { 1.0 - fine };
        if share_of_brush <= 0.0 {
            continue;
        }
        let own = share(map, place.pixel, full, place.shape);
        let far = surfaces.paleness(&place, &controls);
        let ink =
            LOAD * controls.wash * controls.ink * (M * dark).powf(BETA) * (0.85 + 0.3 * random(10)) * far;
        // Near the outline, at which prints end, the brush is held more upright.
        let radius = full * (0.75 + 0.5 * random(11)) * (0.6 + 0.4 * own * own);
        let slope = tones.slope[i] + 0.15 * Vec2::from_angle(random(12) * std::f32::consts::TAU);
        stamps.push(Stamp {
            pixel: place.pixel.into(),
            radius,
            angle: slope.perp().to_angle(),
            dryness: (Q * grey * controls.dryness * 2.0).clamp(0.0, 1.0).powf(GAMMA),
            ink,
            s: random(13) * 90.0,
            lane: random(14),
            variant: place.hash % VARIANTS as u32,
            shape: place.shape,
            weight: place.weight * share_of_brush,
            stretch: 1.25,
            ratio: 1.0,
        });
    }
    stamps
}
