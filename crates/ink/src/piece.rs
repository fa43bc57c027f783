//! Pieces: parts of lines that are drawn in one go, smoothed, broken at corners, joined where they lie one before the other.

use crate::contour::LineKind;
use crate::stroke::Hand;
use crate::visibility::{STEP, Sample, SampledLine};
use glam::Vec2;
use std::collections::HashMap;

/// Standard deviation of the smoothing along a line, pixels: it takes the steps of faces out of a contour.
const SMOOTHING: f32 = 3.0;

/// A part of a line that is drawn in one go.
#[derive(Clone, Debug)]
pub struct Piece {
    /// What it is of.
    pub kind: LineKind,
    /// Index of the draw.
    pub draw: u32,
    /// The shape, counted from one.
    pub shape: u32,
    /// In order, smoothed.
    pub samples: Vec<Sample>,
    /// The last sample is followed by the first.
    pub closed: bool,
}

impl Piece {
    /// Lets it go the other way.
    pub fn reverse(&mut self) {
        self.samples.reverse();
        self.samples.iter_mut().filter_map(|s| s.trace.as_mut()).for_each(|t| t.reversed = !t.reversed);
    }

    /// Arc length at each sample, pixels.
    pub fn arc(&self) -> Vec<f32> {
        let mut s = 0.0;
        let mut arc = Vec::with_capacity(self.samples.len());
        for (i, sample) in self.samples.iter().enumerate() {
            if i > 0 {
                s += sample.pixel.distance(self.samples[i - 1].pixel);
            }
            arc.push(s);
        }
        arc
    }

    /// Of all of it, by the arc lengths.
    pub fn length(&self, arc: &[f32]) -> f32 {
        let closing = match (self.samples.first(), self.samples.last()) {
            (Some(a), Some(b)) if self.closed => a.pixel.distance(b.pixel),
            _ => 0.0,
        };
        arc.last().copied().unwrap_or(0.0) + closing
    }
}

impl Hand {
    /// Pieces of a line that are strokes: one for each run that is seen, broken at corners.
    pub fn pieces(&self, line: &SampledLine) -> Vec<Piece> {
        let (runs, closed) = line.runs();
        let mut pieces = Vec::new();
        for run in runs {
            // The steps of a coarse contour are as long as its faces; those of folds are meant.
            let steps = if line.kind == LineKind::Contour { 0.8 * line.facet } else { 0.0 };
            let sigma = steps.max(SMOOTHING * self.unit.max(0.5)).min(5.0 * SMOOTHING * self.unit.max(0.5));
            let smooth = smoothed(&run, closed, sigma);
            for (samples, closed) in at_corners(smooth, closed, self.unit) {
                let SampledLine { kind, draw, shape, .. } = *line;
                pieces.push(Piece { kind, draw, shape, samples, closed });
            }
        }
        pieces
    }

    /// Those of all lines: joined where they lie one before the other, without what is too short.
    pub fn all_pieces(&self, lines: &[SampledLine]) -> Vec<Piece> {
        let mut pieces = join(lines.iter().flat_map(|line| self.pieces(line)).collect(), self.unit);
        // What is left of a line beyond a corner at its end is no stroke of its own.
        let least = LEAST_PIECE * self.unit.max(0.5);
        pieces.retain(|piece| {
            piece.length(&piece.arc()) >= least || piece.samples.iter().any(|s| s.pinned.is_some())
        });
        pieces
    }
}

/// A run with its places smoothed along it by a Gaussian; the ends of an open one stay. Sharp turns are smoothed less, so
/// that corners remain.
fn smoothed(run: &[Sample], closed: bool, sigma: f32) -> Vec<Sample> {
    let n = run.len();
    let reach = ((2.5 * sigma / STEP as f32).ceil() as usize).max(1);
    let mut out = run.to_vec();
    for i in 0..n {
        // An open line is smoothed over what lies on both sides alike, so that it does not shrink.
        let most = if closed { reach.min((n - 1) / 2) } else { reach.min(i).min(n - 1 - i) };
        let (mut sum, mut outward, mut weights) = (run[i].pixel, run[i].outward, 1.0);
        let (mut forward, mut backward) = (0.0, 0.0);
        let at = |k: isize| ((i as isize + k).rem_euclid(n as isize)) as usize;
        for k in 1..=most as isize {
            let (a, b) = (at(k), at(-k));
            forward += run[a].pixel.distance(run[at(k - 1)].pixel);
            backward += run[b].pixel.distance(run[at(1 - k)].pixel);
            let far = 0.5 * (forward + backward);
            let weight = (-0.5 * (far / sigma).powi(2)).exp();
            sum += weight * (run[a].pixel + run[b].pixel);
            outward += weight * (run[a].outward + run[b].outward);
            weights += 2.0 * weight;
        }
        out[i].pixel = sum / weights;
        out[i].outward = outward.normalize_or(run[i].outward);
    }
    out
}

/// Length on both sides over which the turn of a line is judged, pixels of a picture of 1080 lines.
const CORNER_REACH: f32 = 7.0;
/// How far apart the ends of two pieces may be that are one stroke, pixels of a picture of 1080 lines, and cosine of the angle
/// at which they may meet (20 degrees): the edges of boards that lie side by side are one line to a painter.
const JOIN: f32 = 10.0;
/// See [`JOIN`].
const JOIN_STRAIGHT: f32 = 0.94;
/// Ends that are nearer than this meet, whatever way leads from one to the other, likewise.
const JOIN_MEET: f32 = 3.0;
/// Relative depth by which they may be apart.
const JOIN_DEPTH: f32 = 0.01;
/// Two pieces that were one stroke in the frame before are joined from farther by this factor.
const JOIN_STAYS: f32 = 1.5;

/// An end of a piece.
#[derive(Clone, Copy)]
struct End {
    pixel: Vec2,
    /// Unit, away from the piece.
    way: Vec2,
    depth: f32,
    stroke: Option<u32>,
}

impl End {
    /// The first or the last of a piece.
    fn of(piece: &Piece, last: bool, reach: usize) -> Self {
        let n = piece.samples.len();
        let at = |k: usize| &piece.samples[if last { n - 1 - k.min(n - 1) } else { k.min(n - 1) }];
        let way = (at(0).pixel - at(reach).pixel).normalize_or_zero();
        Self { pixel: at(0).pixel, way, depth: at(0).depth, stroke: at(0).trace.and_then(|t| t.stroke) }
    }

    /// How far another end is with which this one is a stroke.
    fn apart(&self, other: &Self, unit: f32) -> Option<f32> {
        let gap = other.pixel - self.pixel;
        let far = gap.length();
        let stays = if self.stroke.is_some() && self.stroke == other.stroke { JOIN_STAYS } else { 1.0 };
        let straight = far < JOIN_MEET * unit
            || (gap.dot(self.way) > JOIN_STRAIGHT * far && gap.dot(other.way) < -JOIN_STRAIGHT * far);
        let near = (self.depth - other.depth).abs() < JOIN_DEPTH * self.depth;
        (far < JOIN * unit * stays && self.way.dot(other.way) < -JOIN_STRAIGHT && straight && near)
            .then_some(far)
    }
}

/// Joins pieces of lines of one kind and draw whose ends lie one before the other.
pub fn join(pieces: Vec<Piece>, unit: f32) -> Vec<Piece> {
    let unit = unit.max(0.5);
    let reach = ((CORNER_REACH * unit / STEP as f32).round() as usize).max(2);
    // Twice the index of the piece, and one more for its last end.
    let ends: Vec<Option<End>> = pieces
        .iter()
        .flat_map(|p| [false, true].map(|last| (!p.closed).then(|| End::of(p, last, reach))))
        .collect();
    let side = JOIN * unit * JOIN_STAYS;
    let cell = |p: Vec2| (p / side).floor().to_array().map(|v| v as i32);
    let mut cells: HashMap<[i32; 2], Vec<usize>> = HashMap::new();
    for (i, end) in ends.iter().enumerate() {
        if let Some(end) = end.filter(|e| e.pixel.is_finite()) {
            cells.entry(cell(end.pixel)).or_default().push(i);
        }
    }
    let mut pairs: Vec<(f32, usize, usize)> = Vec::new();
    for (i, end) in ends.iter().enumerate() {
        let Some(end) = end else { continue };
        let [x, y] = cell(end.pixel);
        for around in (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y])) {
            for &j in cells.get(&around).into_iter().flatten().filter(|j| **j > i && **j / 2 != i / 2) {
                let (a, b) = (&pieces[i / 2], &pieces[j / 2]);
                let far = ends[j].and_then(|other| end.apart(&other, unit));
                if let (Some(far), true) = (far, a.kind == b.kind && a.draw == b.draw) {
                    pairs.push((far, i, j));
                }
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut partner: Vec<Option<usize>> = vec![None; ends.len()];
    for (_, i, j) in pairs {
        if partner[i].is_none() && partner[j].is_none() {
            (partner[i], partner[j]) = (Some(j), Some(i));
        }
    }
    let mut pieces: Vec<Option<Piece>> = pieces.into_iter().map(Some).collect();
    let mut joined = Vec::new();
    for start in 0..pieces.len() {
        if pieces[start].is_none() {
            continue;
        }
        // Back to where the chain begins, or once around.
        let (mut from, mut round) = (2 * start, false);
        while let Some(before) = partner[from] {
            from = before ^ 1;
            if from / 2 == start {
                (from, round) = (2 * start, true);
                break;
            }
        }
        let mut whole: Option<Piece> = None;
        while let Some(mut piece) = pieces[from / 2].take() {
            if from % 2 == 1 {
                piece.reverse();
            }
            match &mut whole {
                None => whole = Some(piece),
                Some(whole) => whole.samples.append(&mut piece.samples),
            }
            match partner[from ^ 1] {
                Some(next) => from = next,
                None => break,
            }
        }
        if let Some(mut whole) = whole {
            whole.closed |= round;
            joined.push(whole);
        }
    }
    joined
}

/// Shortest stroke, pixels of a picture of 1080 lines: less than its ends take.
const LEAST_PIECE: f32 = 12.0;
/// Turn at which the brush is lifted: 55 degrees within twice that length, which no wrist follows.
const CORNER: f32 = 0.57;
/// By so much sharper a corner must be to break a stroke that was one in the frame before, and less sharp to go on breaking it:
/// ten degrees.
const CORNER_STAYS: f32 = 0.14;

/// The line in pieces between its corners.
fn at_corners(run: Vec<Sample>, closed: bool, unit: f32) -> Vec<(Vec<Sample>, bool)> {
    let n = run.len();
    let k = ((CORNER_REACH * unit / STEP as f32).round() as usize).max(2);
    if n < 2 * k + 2 {
        return vec![(run, closed)];
    }
    let straight = |i: usize| -> f32 {
        let (a, b) = if closed { ((i + n - k) % n, (i + k) % n) } else { (i - k, i + k) };
        let (p, q, r) = (run[a].pixel, run[i].pixel, run[b].pixel);
        (q - p).normalize_or_zero().dot((r - q).normalize_or_zero())
    };
    let inside = if closed { 0..n } else { k..n - k };
    let turn: Vec<f32> = (0..n).map(|i| if inside.contains(&i) { straight(i) } else { 1.0 }).collect();
    let sharpest = |i: usize| {
        (1..=k).all(|d| {
            let neighbours = [(i + d) % n, (i + n - d) % n];
            turn[i] <= turn[neighbours[0]] && turn[i] < turn[neighbours[1]]
        })
    };
    let stroke = |i: usize| run[i % n].trace.and_then(|t| t.stroke);
    let sharp = |i: usize| match (stroke(i + n - k), stroke(i + k)) {
        (Some(a), Some(b)) if a == b => CORNER - CORNER_STAYS,
        (Some(_), Some(_)) => CORNER + CORNER_STAYS,
        _ => CORNER,
    };
    let corners: Vec<usize> = (0..n).filter(|i| turn[*i] < sharp(*i) && sharpest(*i)).collect();
    let Some(&first) = corners.first() else { return vec![(run, closed)] };
    let mut pieces = Vec::new();
    if closed {
        for (j, &from) in corners.iter().enumerate() {
            let to = corners.get(j + 1).copied().unwrap_or(first + n);
            pieces.push(((from..=to).map(|i| run[i % n]).collect(), false));
        }
    } else {
        let cuts: Vec<usize> =
            std::iter::once(0).chain(corners.iter().copied()).chain(std::iter::once(n - 1)).collect();
        for pair in cuts.windows(2) {
            pieces.push((run[pair[0]..=pair[1]].to_vec(), false));
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From one place to another in steps of two pixels.
    fn piece(from: [f32; 2], to: [f32; 2]) -> Piece {
        let (from, to) = (Vec2::from(from), Vec2::from(to));
        let n = (from.distance(to) / 2.0) as usize;
        let samples = (0..=n)
            .map(|i| Sample { silhouette: false, ..Sample::at(from.lerp(to, i as f32 / n as f32)) })
            .collect();
        Piece { kind: LineKind::Crease, draw: 0, shape: 1, samples, closed: false }
    }

    #[test]
    fn ends_before_one_another_are_joined_whichever_way_they_go() {
        let one = join(
            vec![
                piece([0.0, 0.0], [40.0, 0.0]),
                piece([90.0, 1.0], [46.0, 1.0]),
                piece([92.0, 1.0], [140.0, 0.0]),
            ],
            1.0,
        );
        assert_eq!(one.len(), 1);
        let x: Vec<f32> = one[0].samples.iter().map(|s| s.pixel.x).collect();
        assert!(x.windows(2).all(|w| w[1] > w[0]) && x[0] == 0.0 && x[x.len() - 1] == 140.0, "{x:?}");
        // Beside one another, at a corner, too far, nearer in depth, of another kind: each stays.
        let first = || piece([0.0, 0.0], [40.0, 0.0]);
        let mut near = piece([44.0, 0.0], [90.0, 0.0]);
        near.samples.iter_mut().for_each(|s| s.depth = 0.9);
        let other = Piece { kind: LineKind::Border, ..piece([44.0, 0.0], [90.0, 0.0]) };
        let apart = [
            piece([42.0, 6.0], [90.0, 6.0]),
            piece([40.0, 2.0], [40.0, 50.0]),
            piece([60.0, 0.0], [90.0, 0.0]),
            near,
            other,
        ];
        for other in apart {
            assert_eq!(join(vec![first(), other], 1.0).len(), 2);
        }
        // Two half circles that meet at both ends go round once.
        let half = |side: f32| {
            let mut half = piece([0.0, 0.0], [200.0, 0.0]);
            let n = half.samples.len() as f32 - 1.0;
            for (i, s) in half.samples.iter_mut().enumerate() {
                s.pixel = 60.0 * Vec2::from_angle(side * std::f32::consts::PI * i as f32 / n);
            }
            half
        };
        assert_eq!(join(vec![half(1.0), half(-1.0)], 1.0).len(), 1);
    }
}
