//! Strokes: lines in the picture with pressure, dryness and ink along them, as a brush has them.
//!
//! A stroke is what the brush draws from where it is set down to where it is lifted. Xu, Yang and Wu 2012 give each point
//! pressure, angle, dryness and intensity (PADI); here they are curves over the arc length, times the pressure that the
//! direction of the outline asks for (their circular mapping).

use crate::contour::LineKind;
use crate::control::Controls;
use crate::mask::Place;
use crate::piece::Piece;
use crate::place_controls::PlaceControls;
use crate::steering::StrokeEdit;
use crate::visibility::Sample;
use glam::{Vec2, Vec3};
use std::collections::BTreeMap;
use std::sync::Arc;
use yugen_motion::noise::noise;
use yugen_optics::random::{hash_combine, unit_f32};
use yugen_optics::special::smoothstep;

/// A point of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokePoint {
    /// Pixels.
    pub pixel: Vec2,
    /// Along the camera's axis.
    pub depth: f32,
    /// Arc length from the beginning, pixels.
    pub s: f32,
    /// Where along the marks of the brush it is, pixels: the arc length that it has in the first frame, and then what stays
    /// with the surface ([`crate::tracking`]).
    pub phase: f32,
    /// How the brush is pressed on the paper, 0 to 1.
    pub pressure: f32,
    /// Lack of water, 0 to 1.
    pub dryness: f32,
    /// Density of ink, 0 to 1 and a little more.
    pub ink: f32,
    /// Half the width, pixels.
    pub radius: f32,
}

/// A stroke of the brush.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// What it follows.
    pub kind: LineKind,
    /// The shape, counted from one.
    pub shape: u32,
    /// Its identity from frame to frame; that of one other stroke of a picture at most, which is fading.
    pub id: u32,
    /// Random numbers of the stroke are hashes of it.
    pub seed: u32,
    /// In order.
    pub points: Vec<StrokePoint>,
    /// The last point is followed by the first.
    pub closed: bool,
    /// It is no line any more, and goes.
    pub fading: bool,
}

impl Stroke {
    /// Pixels from the first point to the last, and back to the first where it is closed.
    pub fn length(&self) -> f32 {
        self.points.last().map_or(0.0, |p| p.s) + if self.closed { self.closing() } else { 0.0 }
    }

    /// Pixels from a place in the picture to the stroke; below zero within it.
    pub fn distance(&self, pixel: Vec2) -> f32 {
        let p = &self.points;
        let last = p.last().filter(|_| self.closed).zip(p.first());
        let sides = p.iter().zip(p.iter().skip(1)).chain(last);
        let far = sides.map(|(a, b)| {
            let way = b.pixel - a.pixel;
            let t = ((pixel - a.pixel).dot(way) / way.length_squared().max(1e-12)).clamp(0.0, 1.0);
            (a.pixel + way * t).distance(pixel) - (a.radius + (b.radius - a.radius) * t)
        });
        far.fold(f32::INFINITY, f32::min)
    }

    fn closing(&self) -> f32 {
        match (self.points.first(), self.points.last()) {
            (Some(a), Some(b)) => a.pixel.distance(b.pixel),
            _ => 0.0,
        }
    }
}

/// What a brush goes by along a piece.
#[derive(Clone, Copy, Debug)]
pub struct Path<'a> {
    /// What is random about the stroke is made of it.
    pub seed: u32,
    /// Arc length at each sample, pixels.
    pub s: &'a [f32],
    /// See [`StrokePoint::phase`].
    pub phase: &'a [f32],
}

/// What a brush does at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Brush {
    /// How it is pressed on the paper, 0 to 1 and a little more.
    pub pressure: f32,
    /// Lack of water, 0 to 1.
    pub dryness: f32,
    /// Density of ink.
    pub ink: f32,
    /// How far it strays to the side, pixels.
    pub waver: f32,
    /// How wide it is: the control.
    pub size: f32,
}

impl Brush {
    /// Between two.
    pub fn lerp(&self, to: &Self, t: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * t;
        Self {
            pressure: mix(self.pressure, to.pressure),
            dryness: mix(self.dryness, to.dryness),
            ink: mix(self.ink, to.ink),
            waver: mix(self.waver, to.waver),
            size: mix(self.size, to.size),
        }
    }
}

/// What strokes depend on besides their lines.
#[derive(Clone, Debug)]
pub struct Hand {
    /// The controls.
    pub controls: Controls,
    /// Those of each draw, place by place.
    pub place_controls: Arc<PlaceControls>,
    /// Pixels across and down.
    pub size: Vec2,
    /// What of single strokes is otherwise, by their identity.
    pub edits: Arc<BTreeMap<u32, StrokeEdit>>,
    /// Pixels that stand for one in a picture of 1080 lines.
    pub unit: f32,
    /// Nearest and farthest depth of what is seen.
    pub depths: [f32; 2],
    /// Where in the picture (y down) light goes to, unit: outlines there are pressed harder.
    pub shade: Vec2,
    /// Same seed, same strokes.
    pub seed: u32,
}

/// Half the width of a brush that is fully pressed, pixels in a picture of 1080 lines: a middle brush on a sheet as high as
/// an arm is long.
const RADIUS: f32 = 9.0;
/// The same of one that barely touches.
const LEAST_RADIUS: f32 = 0.7;
/// Load of a stroke at ink one: thick ink, which reflects as much as velvet.
const INK: f32 = 1.8;
/// How the width grows with pressure.
const RADIUS_POWER: f32 = 1.2;

impl Hand {
    /// The hand that draws an object.
    pub fn of(&self, draw: u32) -> Self {
        Self { controls: self.place_controls.of_draw(draw), ..self.clone() }
    }

    /// The controls at a sample of a line of it.
    pub fn at(&self, draw: u32, sample: &Sample) -> Controls {
        match self.place_controls.is_masked(draw) {
            true => self.place_controls.at(draw, &Place { part: sample.line / self.size, uv: sample.uv }),
            false => self.place_controls.of_draw(draw),
        }
    }

    /// Half the width at a pressure.
    pub fn radius(&self, pressure: f32) -> f32 {
        self.radius_of(self.controls.size, pressure)
    }

    /// Of a brush of this size.
    fn radius_of(&self, size: f32, pressure: f32) -> f32 {
        let most = RADIUS * size * self.unit;
        let least = LEAST_RADIUS * self.unit * size.min(1.0);
        least + (most - least) * pressure.clamp(0.0, 1.3).powf(RADIUS_POWER)
    }

    /// How near something at a depth is: 1 in front, 0 behind.
    pub fn nearness(&self, depth: f32) -> f32 {
        let [near, far] = self.depths;
        // By the reciprocal, as what is seen shrinks; nothing is gained by telling apart what is equally far.
        if far - near < 1e-3 * far.abs() {
            return 1.0;
        }
        ((1.0 / depth.max(1e-20) - 1.0 / far) / (1.0 / near - 1.0 / far)).clamp(0.0, 1.0)
    }

    /// What a piece is called by where it begins on its mesh.
    pub fn own(&self, piece: &Piece) -> u32 {
        let [v, w] = piece.samples.first().map_or([0; 2], |s| s.mesh_point.ends[0].vertices);
        let place = hash_combine(hash_combine(v, w), piece.kind as u32);
        hash_combine(self.seed, hash_combine(piece.draw, place))
    }

    /// The stroke of a piece by what the brush does at each of its samples; `presence`: how much of it is there, 0 to 1.
    pub fn stroke(&self, piece: &Piece, id: u32, path: &Path, brush: &[Brush], presence: &[f32]) -> Stroke {
        let samples = &piece.samples;
        let mut points: Vec<StrokePoint> = (0..samples.len())
            .map(|i| {
                let Sample { pixel, depth, .. } = samples[i];
                self.point(pixel, depth, path.s[i], path.phase[i], &brush[i], presence[i])
            })
            .collect();
        // The hand wavers across the way.
        let moved: Vec<Vec2> = (0..points.len())
            .map(|i| points[i].pixel + tangent(&points, i).perp() * brush[i].waver)
            .collect();
        points.iter_mut().zip(moved).for_each(|(point, moved)| point.pixel = moved);
        let Piece { kind, shape, closed, .. } = *piece;
        Stroke { kind, shape, id, seed: path.seed, points, closed, fading: false }
    }

    /// A point of a stroke.
    pub(crate) fn point(
        &self,
        pixel: Vec2,
        depth: f32,
        s: f32,
        phase: f32,
        brush: &Brush,
        presence: f32,
    ) -> StrokePoint {
        // What comes or goes is thin and pale.
        let pressure = brush.pressure * (0.4 + 0.6 * presence);
        let (dryness, ink) = (brush.dryness, brush.ink * presence);
        StrokePoint {
            pixel,
            depth,
            s,
            phase,
            pressure,
            dryness,
            ink,
            radius: self.radius_of(brush.size, pressure),
        }
    }

    /// What the brush does along a piece, which becomes this stroke.
    pub fn brush(&self, piece: &Piece, id: u32, path: &Path) -> Vec<Brush> {
        let edit = self.edits.get(&id);
        let samples = &piece.samples;
        let length = piece.length(path.s).max(1e-3);
        let u = self.unit;
        let random = |k: u32| unit_f32(hash_combine(path.seed, k));
        // Interior folds, creases and borders are drawn with less weight than what stands out against the distance.
        let of_kind = match piece.kind {
            LineKind::Contour => 0.62,
            LineKind::Crease | LineKind::Wrinkle => 0.5,
            LineKind::Suggestive => 0.45,
            LineKind::Border => 0.6,
        };
        let hidden_tip = random(1) < 0.6;
        let along = |phase: f32, wave: f32, k: u32| {
            let seed = (path.seed.wrapping_add(k * 0x9e37) & 0xfff) as f32 * 0.173;
            noise(Vec3::new(phase / (wave * u), seed, 0.5)).0 / 0.6
        };
        let of_sample = |i: usize| -> Brush {
            let (sample, s, phase) = (&samples[i], path.s[i], path.phase[i]);
            let mut c = self.at(piece.draw, sample);
            edit.iter().for_each(|edit| edit.changes.apply(&mut c));
            let full = self.radius_of(c.size, 1.0);
            // The brush is set down within two to five of its half widths and lifted over up to fourteen.
            let entry = (0.12 * length).clamp(2.0 * full, 5.0 * full).min(0.35 * length);
            let exit = (0.3 * length).clamp(4.0 * full, 14.0 * full).min(0.5 * length);
            // A short stroke is a light one: the brush has no way to sink in.
            let reach = smoothstep(0.0, 1.0, length / (16.0 * full));
            // How far a load of ink goes, pixels of a picture of 1080 lines: from a hand's breadth to the whole sheet.
            let runs_dry = (250.0 + 900.0 * c.water) * (0.7 + 0.6 * random(2)) * u * c.size.sqrt();
            let near = self.nearness(sample.depth);

            let kind = of_kind + (1.0 - of_kind) * stands_out(sample);
            let shade = sample.outward.dot(self.shade);
            // A sin(θ − φ) + T with its maximum on the side away from the light.
            let circular = 0.66 + 0.34 * shade;
            let (rise, fall) = ((s / entry).clamp(0.0, 1.0), ((length - s) / exit).clamp(0.0, 1.0));
            let tip = if hidden_tip {
                0.45 + 0.55 * (1.0 - (1.0 - rise).powf(2.5))
            } else {
                0.12 + 0.88 * rise.powf(0.8)
            };
            let lift = 0.06 + 0.94 * smoothstep(0.0, 1.0, fall.powf(0.85));
            let ends = tip * lift;
            let swell = 1.0 + 0.16 * (-((s - entry) / (1.2 * entry)).powi(2)).exp();
            let sway = 1.0 + 0.28 * along(phase, 130.0, 3) + 0.12 * c.roughness * along(phase, 23.0, 4);
            let varied = circular * swell * sway * (0.25 + 0.75 * reach);
            // Without contrast the hand keeps its pressure.
            let pressure = (0.6 + c.contrast * 1.6 * (varied - 0.6)).max(0.08) * ends;
            let pressure =
                (pressure * kind * sample.strength.sqrt() * (0.55 + 0.45 * near.powf(0.5 * c.distance)))
                    .clamp(0.0, 1.25);

            let spent = 1.0 - (-s / runs_dry).exp();
            let flick = (1.0 - fall).powi(2);
            let dryness = c.dryness * (0.5 + 0.9 * spent + 0.9 * flick + 0.35 * along(phase, 180.0, 5));
            let far = 1.0 - c.distance * 0.8 * (1.0 - near);
            let load = (0.75 + 0.5 * random(7)) * (1.0 - 0.4 * spent) * (0.5 + 0.5 * kind);
            let of_line = if piece.kind == LineKind::Suggestive { c.suggestive.min(1.0) } else { 1.0 };
            let ink = INK * c.ink * c.contour * load * far * of_line * sample.strength;
            // A closed stroke must meet its beginning.
            let fade = if piece.closed { (s.min(length - s) / (60.0 * u)).clamp(0.0, 1.0) } else { 1.0 };
            let waver = 1.3 * c.roughness * u * along(phase, 60.0, 6) * fade;
            Brush { pressure, dryness: dryness.clamp(0.0, 1.0), ink: ink.max(0.0), waver, size: c.size }
        };
        (0..samples.len()).map(of_sample).collect()
    }
}

/// How far a sample stands out against what is behind it, 0 to 1.
fn stands_out(s: &Sample) -> f32 {
    if s.silhouette { smoothstep(0.0, 0.25, s.gap) } else { 0.0 }
}

/// Unit, along the stroke.
pub fn tangent(points: &[StrokePoint], i: usize) -> Vec2 {
    let (a, b) = (i.saturating_sub(1), (i + 1).min(points.len() - 1));
    (points[b].pixel - points[a].pixel).normalize_or(Vec2::X)
}
