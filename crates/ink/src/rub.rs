//! Rubbing (ca): the side of a nearly dry brush wiped over what is dark, where wrinkles are; the grain of the paper shows.

use crate::footprint::VARIANTS;
use crate::scatter::Surfaces;
use crate::stamp::Stamp;
use glam::Vec2;
use std::f32::consts::PI;
use yugen_optics::random::{hash_combine, unit_f32};
use yugen_optics::special::smoothstep;

/// Half the width of a print, pixels of a picture of 1080 lines: the side of the brush, between its tip and a wash.
const RADIUS: f32 = 7.0;
/// Length of a print along its way over its width: a wipe.
const STRETCH: f32 = 3.4;
/// Prints that overlap at a place where it is darkest: fewer are told apart, more hide the paper.
const OVERLAP: f32 = 4.5;
/// Lack of water: of a brush that was wiped off first.
const DRYNESS: f32 = 0.85;
/// Load of ink at intensity one: pale beside wrinkles.
const LOAD: f32 = 0.3;
/// Darkness from which on a place is rubbed, and where it wholly is.
const DARK: [f32; 2] = [0.15, 0.8];
/// Change of how many there should be over which one comes or goes.
const COMING: f32 = 0.08;

/// The stamps on `surfaces`.
pub fn stamps(surfaces: &Surfaces) -> Vec<Stamp> {
    let Surfaces { tones, unit, .. } = *surfaces;
    let full = |size: f32| RADIUS * unit * size.sqrt();
    let density = |c: &crate::control::Controls| match c.rub > 0.0 {
        true => OVERLAP / (PI * STRETCH * full(c.size).powi(2)),
        false => 0.0,
    };
    let mut stamps = Vec::new();
    for place in surfaces.scatter(density, 0xca) {
        let controls = surfaces.controls(&place);
        let random = |k: u32| unit_f32(hash_combine(place.hash, k));
        let full = full(controls.size);
        let Some(i) = tones.index(place.pixel) else { continue };
        let Some(grey) = tones.grey(place.pixel, full, place.shape) else { continue };
        let bend = tones.bend(place.pixel, 14.0 * unit);
        let share = smoothstep(DARK[0], DARK[1], 1.0 - grey) * (0.25 + 0.75 * bend);
        let there = ((share - random(30)) / COMING).clamp(0.0, 1.0);
        if there <= 0.0 {
            continue;
        }
        // Along the form, as wrinkles go; what looks at the eye is wiped downwards.
        let along = tones.slope[i].perp().normalize_or(Vec2::Y);
        stamps.push(Stamp {
            pixel: place.pixel.into(),
            radius: full * (0.7 + 0.6 * random(31)),
            angle: along.to_angle() + 0.35 * (random(32) - 0.5),
            dryness: DRYNESS,
            ink: LOAD
                * controls.rub
                * controls.ink
                * (0.7 + 0.6 * random(33))
                * surfaces.paleness(&place, &controls),
            s: random(34) * 90.0,
            lane: random(35),
            variant: place.hash % VARIANTS as u32,
            shape: place.shape,
            weight: place.weight * there,
            stretch: STRETCH,
            ratio: 1.0,
        });
    }
    stamps
}
