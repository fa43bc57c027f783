//! Strokes that are no longer and go, where they were on the surface.

use super::{Entry, FADE, Memory, Places, REACH, Remembered, ways};
use crate::piece::Piece;
use crate::stroke::{Hand, Stroke};
use crate::visibility::OUTWARD;
use glam::Vec2;

/// Least samples of a stroke that goes: less than a print of the brush.
const LEAST_FADING: usize = 4;

/// A stroke, or a part of one, that is no longer and goes.
pub(super) struct Fading {
    pub(super) remembered: Remembered,
    /// Where its points are, and how deep.
    places: Vec<(Vec2, f32)>,
}

/// What of the strokes of the frame before nobody has taken over and nothing covers.
pub(super) fn fading_strokes(
    memory: &Memory,
    pieces: &[Piece],
    unit: f32,
    is_free: &dyn Fn(Vec2, f32) -> bool,
) -> Vec<Fading> {
    let mut places = Places::new(REACH * unit.max(0.5));
    for piece in pieces {
        let pixels: Vec<Option<Vec2>> = piece.samples.iter().map(|s| Some(s.line)).collect();
        for (sample, way) in piece.samples.iter().zip(ways(&pixels)) {
            let (pixel, depth) = (sample.line, sample.depth);
            let (kind, draw, source, handicap) = (piece.kind, piece.draw, None, 0.0);
            places.add(Entry { pixel, way, depth, kind, draw, source, handicap, age: 0 });
        }
    }
    let mut all = Vec::new();
    for stroke in &memory.strokes {
        let now: Vec<Option<Vec2>> = stroke.points.iter().map(|p| p.now.map(|n| n.0)).collect();
        let ways = ways(&now);
        let goes = |i: &usize| -> bool {
            let point = &stroke.points[*i];
            let Some((pixel, depth)) = point.now else { return false };
            point.presence > 1.0 / FADE
                && places.nearest(pixel, ways[*i], depth, stroke.kind, stroke.draw).is_none()
                && is_free(pixel + point.outward * OUTWARD, depth)
        };
        let going: Vec<(usize, bool)> = (0..stroke.points.len()).map(|i| (i, goes(&i))).collect();
        for run in going.chunk_by(|a, b| a.1 == b.1).filter(|run| run[0].1 && run.len() >= LEAST_FADING) {
            let (first, last) = (run[0].0, run[run.len() - 1].0);
            let mut points = stroke.points[first..=last].to_vec();
            let places = points.iter().filter_map(|p| p.now.map(|(at, depth)| (at + p.offset, depth)));
            let places = places.collect();
            points.iter_mut().for_each(|p| p.presence -= 1.0 / FADE);
            let remembered = Remembered { fading: true, closed: false, points, ..stroke.clone() };
            all.push(Fading { remembered, places });
        }
    }
    all
}

impl Hand {
    /// A stroke that goes.
    pub(super) fn fading(&self, fading: &Fading) -> Stroke {
        let r = &fading.remembered;
        let mut stroke = Stroke {
            kind: r.kind,
            shape: r.shape,
            id: r.id,
            seed: r.seed,
            points: Vec::with_capacity(r.points.len()),
            closed: false,
            fading: true,
        };
        let mut s = 0.0;
        for (i, (point, (pixel, depth))) in r.points.iter().zip(&fading.places).enumerate() {
            if i > 0 {
                s += pixel.distance(fading.places[i - 1].0);
            }
            stroke.points.push(self.point(*pixel, *depth, s, point.phase, &point.brush, point.presence));
        }
        stroke
    }
}
