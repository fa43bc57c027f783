//! Wrinkles (cun): short strokes over the form, after the manners of the tradition.

use crate::contour::LineKind;
use crate::control::Controls;
use crate::depth::DepthMap;
use crate::scatter::{Place, Surfaces};
use crate::stroke::{Stroke, StrokePoint};
use crate::tone::Tones;
use glam::{Vec2, Vec3};
use yugen_motion::noise::noise;
use yugen_optics::random::{hash_combine, unit_f32};
use yugen_optics::special::smoothstep;

/// A manner of wrinkles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manner {
    /// Of presets.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// Length of a stroke, pixels of a picture of 1080 lines.
    pub length: f32,
    /// Half its width where it is widest, likewise.
    pub radius: f32,
    /// Direction: 0 along the outline, a quarter turn across the form, radians.
    pub turn: f32,
    /// How far it bends on its way, radians.
    pub curl: f32,
    /// How far it sways, radians.
    pub sway: f32,
    /// Where along it is widest: 0 at its beginning (a wedge), .5 in its middle.
    pub heaviest: f32,
    /// Strokes to a square of its length, where it is darkest.
    pub density: f32,
    /// Lack of water beside that of the brush.
    pub dryness: f32,
}

/// All manners.
pub const MANNERS: &[Manner] = &[
    Manner {
        name: "hemp",
        doc: "pima: long, lightly swaying fibres along the form",
        length: 95.0,
        radius: 2.3,
        turn: 0.0,
        curl: 0.25,
        sway: 0.5,
        heaviest: 0.3,
        density: 9.0,
        dryness: 0.25,
    },
    Manner {
        name: "axe",
        doc: "fupi: short wedges, as an axe leaves them, across the form",
        length: 34.0,
        radius: 6.5,
        turn: 1.15,
        curl: 0.1,
        sway: 0.15,
        heaviest: 0.08,
        density: 1.7,
        dryness: 0.5,
    },
    Manner {
        name: "rain",
        doc: "yudian: drops",
        length: 11.0,
        radius: 2.7,
        turn: 0.3,
        curl: 0.0,
        sway: 0.1,
        heaviest: 0.35,
        density: 0.7,
        dryness: 0.05,
    },
    Manner {
        name: "cloud",
        doc: "juanyun: curls, as clouds roll",
        length: 75.0,
        radius: 3.0,
        turn: 0.3,
        curl: 2.6,
        sway: 0.3,
        heaviest: 0.45,
        density: 5.0,
        dryness: 0.15,
    },
    Manner {
        name: "lotus",
        doc: "heye: veins that run down the form, as in a lotus leaf",
        length: 120.0,
        radius: 2.4,
        turn: 1.571,
        curl: 0.35,
        sway: 0.25,
        heaviest: 0.15,
        density: 10.0,
        dryness: 0.2,
    },
];

impl Manner {
    /// The one called `name`.
    pub fn find(name: &str) -> Option<&'static Self> {
        MANNERS.iter().find(|m| m.name == name)
    }
}

/// Xu, Yang and Wu's factor and exponent of intensity: medium, so that wrinkles stand between wash and contour.
const M: f32 = 0.9;
const BETA: f32 = 1.2;
/// Load of ink at intensity one.
const LOAD: f32 = 1.3;
/// Length of a step, pixels.
const STEP: f32 = 2.0;
/// Relative change of depth over a step at which the form ends.
const JUMP: f32 = 0.015;
/// Change of how many there should be over which one comes or goes.
const COMING: f32 = 0.08;
/// Sine of the angle to the eye below which a surface has no direction of its own.
const FLAT: f32 = 0.18;

/// The strokes on `surfaces`.
pub fn strokes(manner: &Manner, surfaces: &Surfaces) -> Vec<Stroke> {
    let Surfaces { map, tones, unit, .. } = *surfaces;
    let length = |size: f32| manner.length * unit * size.sqrt();
    let density = |c: &Controls| if c.wrinkle > 0.0 { manner.density / length(c.size).powi(2) } else { 0.0 };
    let mut strokes = Vec::new();
    for place in surfaces.scatter(density, 0xc0) {
        let controls = surfaces.controls(&place);
        let length = length(controls.size);
        let random = |k: u32| unit_f32(hash_combine(place.hash, k));
        let Some(grey) = tones.grey(place.pixel, 6.0 * unit, place.shape) else { continue };
        let dark = 1.0 - grey;
        // Where it is light there are few; that which stands there is the same in every view.
        let bend = tones.bend(place.pixel, 14.0 * unit);
        let share = smoothstep(0.1, 0.75, dark) * (0.3 + 0.7 * controls.detail) * bend;
        // One that comes or goes does so slowly.
        let there = ((share - random(20)) / COMING).clamp(0.0, 1.0);
        if there <= 0.0 {
            continue;
        }
        let way = trace(&place, manner, map, tones, length * (0.6 + 0.8 * random(21)), unit);
        if way.len() < 4 {
            continue;
        }
        let far = surfaces.paleness(&place, &controls);
        let ink = LOAD * (M * dark).powf(BETA) * (0.7 + 0.6 * random(22)) * far;
        let is_masked = surfaces.place_controls.is_masked(place.draw);
        let whole = (way.len() - 1) as f32 * STEP;
        // A stroke that the form cuts short is thinner.
        let scale = (whole / length).clamp(0.35, 1.0).sqrt() * unit;
        let points = way
            .iter()
            .enumerate()
            .map(|(i, (pixel, depth))| {
                let t = i as f32 / (way.len() - 1) as f32;
                let rise = smoothstep(0.0, manner.heaviest.max(0.04), t);
                let fall = 1.0 - smoothstep(manner.heaviest, 1.0, t);
                let pressure = (0.12 + 0.88 * rise) * (0.08 + 0.92 * fall.powf(0.8));
                let c = if is_masked { surfaces.controls_beside(&place, *pixel) } else { controls };
                StrokePoint {
                    pixel: *pixel,
                    depth: *depth,
                    s: i as f32 * STEP,
                    phase: i as f32 * STEP,
                    pressure,
                    dryness: (manner.dryness + c.dryness * (0.35 + 0.6 * t) + 0.3 * grey).clamp(0.0, 1.0),
                    ink: ink * c.wrinkle * c.ink * place.weight * there,
                    radius: (manner.radius * scale * c.size * pressure).max(0.45),
                }
            })
            .collect();
        strokes.push(Stroke {
            kind: LineKind::Wrinkle,
            shape: place.shape,
            id: place.hash,
            seed: place.hash,
            points,
            closed: false,
            fading: false,
        });
    }
    strokes
}

/// From a place along the form: pixels and depths.
fn trace(
    place: &Place,
    manner: &Manner,
    map: &DepthMap,
    tones: &Tones,
    length: f32,
    unit: f32,
) -> Vec<(Vec2, f32)> {
    let sway = |s: f32| {
        noise(Vec3::new(s / (45.0 * unit), (place.hash & 0xfff) as f32 * 0.37, 1.5)).0 * manner.sway / 0.3
    };
    let direction = |p: Vec2, s: f32| -> Option<Vec2> {
        let i = tones.index(p)?;
        let slope = tones.slope[i];
        // What looks at the eye is stroked downwards, as a hand falls.
        let steep = smoothstep(0.5 * FLAT, 1.5 * FLAT, slope.length());
        let along = slope.perp().normalize_or(Vec2::Y);
        let along = if along.y < 0.0 { -along } else { along };
        let turned = Vec2::from_angle(manner.turn).rotate(Vec2::Y.lerp(along, steep).normalize_or(Vec2::Y));
        Some(Vec2::from_angle(manner.curl * (s / length - 0.5) + sway(s)).rotate(turned))
    };
    let (mut p, mut depth) = (place.pixel, place.depth);
    let mut way = vec![(p, depth)];
    let mut before: Option<Vec2> = None;
    let steps = (length / STEP) as usize;
    for k in 0..steps {
        let Some(mut d) = direction(p, k as f32 * STEP) else { break };
        if before.is_some_and(|b| b.dot(d) < 0.0) {
            d = -d;
        }
        // No brush turns at once.
        d = before.map_or(d, |b| b.lerp(d, 0.35).normalize_or(d));
        let next = p + d * STEP;
        let Some(i) = tones.index(next) else { break };
        if map.shape[i] != place.shape || (map.depth[i] - depth).abs() > JUMP * depth {
            break;
        }
        (p, depth, before) = (next, map.depth[i], Some(d));
        way.push((p, depth));
    }
    way
}
