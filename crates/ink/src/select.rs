//! Which lines are drawn. A painter leaves out: where lines crowd, the more important ones stand for the rest.

use crate::contour::LineKind;
use crate::visibility::{Cleaning, Sample, SampledLine};
use glam::Vec2;
use std::collections::HashMap;
use yugen_optics::special::smoothstep;

/// Lines nearer to one another than this and in the same direction are one, at no detail and at all, pixels of a picture of
/// 1080 lines.
const APART: [f32; 2] = [26.0, 2.5];
/// Shortest line, likewise.
const SHORTEST: [f32; 2] = [44.0, 9.0];
/// Cosine of the angle within which two lines have the same direction: 35 degrees.
const PARALLEL: f32 = 0.82;

/// What was drawn in the frame before is crowded out only from nearer, may be shorter and counts for more, by these factors;
/// what was not must be farther away: where two lines are equally good, the choice stays as it was.
const STAY: f32 = 0.75;
/// See [`STAY`].
const COME: f32 = 1.2;

/// By so much what is pinned counts for more: others give way to it.
const PINNED: f32 = 100.0;

/// 0 to 1, of a place on a line of a draw.
pub type Detail<'a> = &'a dyn Fn(u32, &Sample) -> f32;

/// Hides what is too much; what is pinned stays. `unit`: pixels that stand for one in a picture of 1080 lines. `known`: there was a
/// frame before.
pub fn select(lines: &mut Vec<SampledLine>, detail: Detail, unit: f32, known: bool) {
    let between = |[from, to]: [f32; 2], detail: f32| (from + (to - from) * detail) * unit;
    let widest = between(APART, 0.0).max(2.0);
    let mut order: Vec<(f32, usize)> = lines.iter().enumerate().map(|(i, l)| (importance(l), i)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    // As wide as what is looked for is at the most.
    let mut drawn = Drawn { cell: widest * COME, places: HashMap::new() };
    for (_, i) in order {
        let line = &mut lines[i];
        let details: Vec<f32> = line.samples.iter().map(|s| detail(line.draw, s)).collect();
        // The mean of what is all the same is that, to the bit: in so few doubles nothing is rounded.
        let mean = (details.iter().map(|d| f64::from(*d)).sum::<f64>() / details.len() as f64) as f32;
        let (apart, shortest) = (between(APART, mean).max(2.0), between(SHORTEST, mean).max(4.0));
        let cleaning = Cleaning { bridge: 2.0 * apart, shortest, ..Cleaning::default() };
        let ways = ways(&line.samples, line.closed);
        for ((sample, way), detail) in line.samples.iter_mut().zip(&ways).zip(details) {
            // What stands out far is never crowded out.
            let change = match sample.was_drawn() {
                true => STAY,
                false if known => COME,
                false => 1.0,
            };
            let reach = between(APART, detail).max(2.0) * change * (1.0 - 0.5 * outline(sample));
            sample.visible &= sample.pinned.is_some() || !drawn.is_crowded(sample.pixel, *way, reach);
        }
        let stays = line.is_mostly_known();
        line.clean(&Cleaning { shortest: cleaning.shortest * if stays { STAY } else { 1.0 }, ..cleaning });
        for (sample, way) in line.samples.iter().zip(&ways).filter(|(s, _)| s.visible) {
            drawn.add(sample.pixel, *way);
        }
    }
    lines.retain(|l| l.samples.iter().any(|s| s.visible));
}

/// How much of an outline it is: by how far what is behind lies behind.
fn outline(sample: &Sample) -> f32 {
    if sample.silhouette { smoothstep(0.0, 0.25, sample.gap) } else { 0.0 }
}

/// Visible length, by kind.
fn importance(line: &SampledLine) -> f32 {
    let of_kind = match line.kind {
        LineKind::Contour => 1.0,
        LineKind::Border => 0.9,
        LineKind::Crease | LineKind::Wrinkle => 0.6,
        LineKind::Suggestive => 0.5,
    };
    let pairs = line.samples.windows(2).filter(|w| w[0].visible && w[1].visible);
    let of = |w: &[Sample]| {
        let stays = match &w[0] {
            s if s.pinned.is_some() => PINNED,
            s if s.was_drawn() => 1.0 / STAY,
            _ => 1.0,
        };
        w[0].pixel.distance(w[1].pixel) * (of_kind + 2.0 * outline(&w[0])) * stays
    };
    pairs.map(of).sum()
}

/// Direction at each sample.
fn ways(samples: &[Sample], closed: bool) -> Vec<Vec2> {
    let n = samples.len();
    (0..n)
        .map(|i| {
            let (a, b) = match closed {
                true => ((i + n - 1) % n, (i + 1) % n),
                false => (i.saturating_sub(1), (i + 1).min(n - 1)),
            };
            (samples[b].pixel - samples[a].pixel).normalize_or_zero()
        })
        .collect()
}

/// Samples of lines that are drawn, by cells of the picture.
struct Drawn {
    cell: f32,
    places: HashMap<[i32; 2], Vec<(Vec2, Vec2)>>,
}

impl Drawn {
    fn of(&self, p: Vec2) -> [i32; 2] {
        (p / self.cell).floor().to_array().map(|v| v as i32)
    }

    fn add(&mut self, pixel: Vec2, way: Vec2) {
        let cell = self.of(pixel);
        let places = self.places.entry(cell).or_default();
        // A few are as good as all.
        if !places
            .iter()
            .any(|(p, w)| p.distance(pixel) < 0.5 * self.cell.min(4.0) && w.dot(way).abs() > 0.99)
        {
            places.push((pixel, way));
        }
    }

    fn is_crowded(&self, pixel: Vec2, way: Vec2, reach: f32) -> bool {
        let [x, y] = self.of(pixel);
        (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y])).any(|cell| {
            self.places.get(&cell).is_some_and(|places| {
                places.iter().any(|(p, w)| p.distance(pixel) < reach && w.dot(way).abs() > PARALLEL)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(y: f32, tilt: f32, length: f32, gap: f32) -> SampledLine {
        let samples = (0..(length / 2.0) as usize)
            .map(|i| Sample { gap, ..Sample::at(Vec2::new(2.0 * i as f32, y + tilt * 2.0 * i as f32)) })
            .collect();
        SampledLine { kind: LineKind::Crease, draw: 0, shape: 1, samples, closed: false, facet: 2.0 }
    }

    #[test]
    fn of_lines_that_crowd_the_important_one_stays() {
        let all =
            || vec![line(0.0, 0.0, 200.0, 0.0), line(3.0, 0.0, 180.0, 1.0), line(60.0, 0.0, 180.0, 0.0)];
        let mut lines = all();
        select(&mut lines, &|_, _| 0.3, 1.0, false);
        assert_eq!(lines.len(), 2, "one of the two that are three pixels apart");
        assert!(lines.iter().any(|l| l.samples[0].pixel.y == 3.0), "the outline");
        let mut lines = all();
        select(&mut lines, &|_, _| 1.0, 1.0, false);
        assert_eq!(lines.len(), 3);
        // One that crosses is no double.
        let mut lines = vec![line(0.0, 0.0, 200.0, 0.0), line(-100.0, 1.0, 200.0, 0.0)];
        select(&mut lines, &|_, _| 0.3, 1.0, false);
        assert_eq!(lines.len(), 2);
        let mut lines = vec![line(0.0, 0.0, 20.0, 0.0)];
        select(&mut lines, &|_, _| 0.0, 1.0, false);
        assert!(lines.is_empty(), "too short");
        // What is pinned stays, however short it is and whatever is beside it, which gives way.
        let mut lines = vec![line(0.0, 0.0, 200.0, 1.0), line(5.0, 0.0, 20.0, 0.0)];
        lines[1].samples.iter_mut().for_each(|s| s.pinned = Some(7));
        let (all, long) = (lines[1].samples.len(), lines[0].samples.len());
        select(&mut lines, &|_, _| 0.0, 1.0, false);
        let seen = |l: &SampledLine| l.samples.iter().filter(|s| s.visible).count();
        assert_eq!((lines.len(), seen(&lines[1])), (2, all));
        assert!(seen(&lines[0]) < long, "the other gives way");
    }
}
