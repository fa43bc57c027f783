//! Which parts of lines are seen, by the depth of what the camera sees.
//!
//! An interpolated contour runs inside faces, so that some of it lies behind faces of its own surface that look at the eye: a
//! depth test hides about 40 % of what should be seen, at any tessellation, and a bias that repairs that depends on the size
//! of the scene. Depth is read beside the contour instead, [`OUTWARD`] pixels away from the surface, where nothing but what
//! truly covers the line can be nearer. Then single errors are voted down along the line, gaps bridged and what is short dropped.

use crate::contour::{Line, LineKind, LinePoint, MeshPoint};
use crate::depth::DepthMap;
use crate::projection::Projection;
use crate::tracking::Trace;
use glam::{DVec2, Vec2};

/// How far beside a line depth is read, pixels. At 1 a ring of 600 triangles still covers a quarter of its own contour, at 2
/// contours that pass behind others show more; 1.5 lies between.
pub const OUTWARD: f32 = 1.5;
/// Relative depth by which something must be nearer to cover a line: ten times what the depth of a face varies over a pixel
/// that it does not look away from.
const NEARER: f32 = 1e-3;
/// Length between samples, pixels.
pub const STEP: f64 = 2.0;
/// Slope up to which a face beside a crease may come nearer than the crease without covering it, depth over width: 76
/// degrees.
const STEEPEST: f32 = 4.0;

/// A place on a line in the picture.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Where.
    pub pixel: Vec2,
    /// Along the camera's axis.
    pub depth: f32,
    /// Away from the surface, unit; zero where unknown.
    pub outward: Vec2,
    /// Whether it is seen.
    pub visible: bool,
    /// How far what is seen behind the line is behind it, relative to its depth; 1 at most, also where nothing is there.
    pub gap: f32,
    /// Whether the line separates the surface from what is behind.
    pub silhouette: bool,
    /// How far in front of the line something lies that covers it, relative to its depth; 0 where nothing does.
    pub cover: f32,
    /// Where it lies on its mesh.
    pub mesh_point: MeshPoint,
    /// Where the line itself is, which smoothing leaves.
    pub line: Vec2,
    /// Texture coordinates, where a mask asks for them; zero elsewhere.
    pub uv: Vec2,
    /// How much of it is drawn, 0 to 1.
    pub strength: f32,
    /// What was here in the frame before.
    pub trace: Option<Trace>,
    /// The stroke that it is of, where that is pinned: it is seen unless something covers it.
    pub pinned: Option<u32>,
}

/// A line in the picture, sampled every [`STEP`] pixels or closer.
#[derive(Clone, Debug)]
pub struct SampledLine {
    /// What.
    pub kind: LineKind,
    /// Index of the draw.
    pub draw: u32,
    /// The shape, counted from one.
    pub shape: u32,
    /// In order.
    pub samples: Vec<Sample>,
    /// The last sample is followed by the first.
    pub closed: bool,
    /// Pixels between points of the line, in the mean: how coarse its mesh looks.
    pub facet: f32,
}

/// How runs of samples that are seen or hidden are cleaned, pixels.
#[derive(Clone, Copy, Debug)]
pub struct Cleaning {
    /// Half of what single samples are outvoted in.
    pub vote: f32,
    /// Gaps shorter than this are bridged.
    pub bridge: f32,
    /// What is seen for less than this is dropped.
    pub shortest: f32,
}

impl Default for Cleaning {
    fn default() -> Self {
        Self { vote: 3.0, bridge: 6.0, shortest: 8.0 }
    }
}

/// A line as the picture has it: in pieces where the near plane or the window cuts it. `shape`: of its draw.
pub fn sample(line: &Line, shape: u32, projection: &Projection, map: &DepthMap) -> Vec<SampledLine> {
    let count = line.points.len();
    let new = || SampledLine {
        kind: line.kind,
        draw: line.draw,
        shape,
        samples: Vec::new(),
        closed: false,
        facet: 0.0,
    };
    let (mut pixels, mut parts) = (0.0, 0.0);
    let mut pieces = vec![new()];
    let segments = if line.closed { count } else { count.saturating_sub(1) };
    let mut whole = true;
    for i in 0..segments {
        let (a, b) = (&line.points[i], &line.points[(i + 1) % count]);
        let seen = projection.clip_near(a.position, b.position).and_then(|near| {
            let [p, q] = near.map(|t| projection.project(a.position.lerp(b.position, t)));
            let (p, q) = (p?, q?);
            let part = clip_to_window(p.pixel, q.pixel, map.size)?;
            Some((near, p, q, part))
        });
        let Some((near, p, q, part)) = seen else {
            whole = false;
            pieces.push(new());
            continue;
        };
        if near[0] > 0.0 || part[0] > 0.0 {
            whole = false;
            pieces.push(new());
        }
        let length = (q.pixel - p.pixel).length() * (part[1] - part[0]);
        (pixels, parts) = (pixels + length, parts + 1.0);
        let steps = ((length / STEP).ceil() as usize).clamp(1, 1 << 14);
        let cut = near[1] < 1.0 || part[1] < 1.0;
        // The end of this segment is the beginning of the next, unless there is none.
        let last = cut || (i + 1 == segments && !line.closed);
        let outward = [a, b].map(|e| projection.direction(e.position, e.outward));
        let beyond = sticks_out(a, outward[0], projection).max(sticks_out(b, outward[1], projection));
        for k in 0..steps + usize::from(last) {
            let u = part[0] + (part[1] - part[0]) * k as f64 / steps as f64;
            // Pixels go evenly, points of the world by the reciprocal of depth.
            let t = u * p.depth / (q.depth + u * (p.depth - q.depth));
            let along = near[0] + (near[1] - near[0]) * t;
            let mesh_point = MeshPoint { ends: [a.anchor, b.anchor], part: along as f32 };
            let depth = (p.depth + (q.depth - p.depth) * t) as f32;
            let outward = outward[0].lerp(outward[1], along).normalize_or_zero().as_vec2();
            let pixel = p.pixel.lerp(q.pixel, u).as_vec2();
            let (visible, gap, cover) = match line.kind {
                LineKind::Contour => beside_contour(map, pixel, depth, outward * (OUTWARD + beyond)),
                _ => {
                    let direction = (q.pixel - p.pixel).normalize_or_zero().as_vec2();
                    beside_fold(map, projection, pixel, depth, direction.perp(), shape)
                }
            };
            if let Some(piece) = pieces.last_mut() {
                piece.samples.push(Sample {
                    pixel,
                    depth,
                    outward,
                    visible: visible && a.possible,
                    gap,
                    silhouette: a.silhouette,
                    cover,
                    mesh_point,
                    line: pixel,
                    uv: Vec2::ZERO,
                    strength: a.strength + (b.strength - a.strength) * along as f32,
                    trace: None,
                    pinned: None,
                });
            }
        }
        if cut {
            whole = false;
            pieces.push(new());
        }
    }
    if whole {
        pieces.iter_mut().for_each(|p| p.closed = line.closed);
    }
    pieces.retain(|p| p.samples.len() > 1);
    let facet = if parts > 0.0 { (pixels / parts) as f32 } else { 0.0 };
    for piece in &mut pieces {
        piece.facet = facet;
        go_on_outside(&mut piece.samples, map.size);
    }
    pieces
}

/// Beyond the window nothing is known of depth: a line goes on there as it leaves the picture, so that no stroke ends at its
/// edge, and is whole where it leaves and comes back seen.
fn go_on_outside(samples: &mut [Sample], size: [u32; 2]) {
    let size = Vec2::from(size.map(|n| n as f32));
    let inside = |s: &Sample| s.pixel.cmpge(Vec2::ZERO).all() && s.pixel.cmplt(size).all();
    let n = samples.len();
    let mut first = 0;
    while first < n {
        if inside(&samples[first]) {
            first += 1;
            continue;
        }
        let end = (first..n).find(|i| inside(&samples[*i])).unwrap_or(n);
        let seen = |i: Option<usize>| i.filter(|i| *i < n).map(|i| samples[i].visible);
        let (before, after) = (seen(first.checked_sub(1)), seen(Some(end)));
        let whole = before == Some(true) && after == Some(true);
        let count = end - first;
        for (i, sample) in samples[first..end].iter_mut().enumerate() {
            let near = [(before, i), (after, count - 1 - i)];
            let goes_on = near.iter().any(|(seen, far)| *seen == Some(true) && *far < WHOLE_MARGIN);
            sample.visible = whole || goes_on;
        }
        first = end;
    }
}

/// Samples within which a line that leaves the window has left the margin too, or runs along it and is not seen.
const WHOLE_MARGIN: usize = 128;

/// Most that a mesh is believed to stick out beyond its contour, pixels: a coarser one is seen as it is.
const BEYOND: f64 = 8.0;

/// How far the edge on which a contour crosses it sticks out beyond the contour, pixels.
fn sticks_out(point: &LinePoint, outward: DVec2, projection: &Projection) -> f32 {
    let Some(at) = projection.project(point.position) else { return 0.0 };
    let ends = point.ends.iter().filter_map(|end| projection.project(*end));
    ends.map(|end| (end.pixel - at.pixel).dot(outward)).fold(0.0, f64::max).min(BEYOND) as f32
}

/// Whether a contour is seen, how far what is behind it lies and how far before it what covers it; by what is there beside
/// it.
fn beside_contour(map: &DepthMap, pixel: Vec2, depth: f32, beside: Vec2) -> (bool, f32, f32) {
    let (beside, _) = map.at(pixel + beside);
    (beside > depth * (1.0 - NEARER), gap(beside, depth), gap(depth, beside))
}

/// The same of a crease or border: one of the two sides must be its own face or lie behind.
fn beside_fold(
    map: &DepthMap,
    projection: &Projection,
    pixel: Vec2,
    depth: f32,
    across: Vec2,
    shape: u32,
) -> (bool, f32, f32) {
    let width = OUTWARD / projection.pixels_per_unit(f64::from(depth)).max(1e-30) as f32;
    let sides = [1.0, -1.0].map(|side| map.at(pixel + across * side * OUTWARD));
    let seen = |&(beside, id): &(f32, u32)| {
        let nearer = if id == shape { (STEEPEST * width).max(NEARER * depth) } else { NEARER * depth };
        beside > depth - nearer
    };
    let farther = sides[0].0.max(sides[1].0);
    (sides.iter().any(seen), gap(farther, depth), gap(depth, farther))
}

/// How far the first lies behind the second, relative to the second; 1 at most.
fn gap(behind: f32, before: f32) -> f32 {
    ((behind - before) / before.abs().max(1e-30)).clamp(0.0, 1.0)
}

/// How far beyond the window lines are followed, pixels: more than a footprint reaches.
const MARGIN: f64 = 64.0;

/// The part of a segment that lies in the window and a margin around it. Liang and Barsky 1984.
fn clip_to_window(p: DVec2, q: DVec2, size: [u32; 2]) -> Option<[f64; 2]> {
    let d = q - p;
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (d, first, last) in [
        (d.x, -MARGIN - p.x, f64::from(size[0]) + MARGIN - p.x),
        (d.y, -MARGIN - p.y, f64::from(size[1]) + MARGIN - p.y),
    ] {
        if d == 0.0 {
            if first > 0.0 || last < 0.0 {
                return None;
            }
            continue;
        }
        let (a, b) = (first / d, last / d);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    (from < to || (from == to && d == DVec2::ZERO)).then_some([from, to])
}

impl Sample {
    /// Whether a stroke was here in the frame before.
    pub fn was_drawn(&self) -> bool {
        self.trace.is_some_and(|t| t.drawn)
    }
}

impl SampledLine {
    /// Whether most of what is seen of it was drawn in the frame before.
    pub fn is_mostly_known(&self) -> bool {
        let seen = || self.samples.iter().filter(|s| s.visible);
        2 * seen().filter(|s| s.was_drawn()).count() > seen().count()
    }

    /// Decides by vote, bridges gaps and drops what is short, but for what is pinned.
    pub fn clean(&mut self, cleaning: &Cleaning) {
        let n = self.samples.len();
        let length = |i: usize| {
            let j = (i + 1) % n;
            if j == 0 && !self.closed { 0.0 } else { self.samples[i].pixel.distance(self.samples[j].pixel) }
        };
        let step: Vec<f32> = (0..n).map(length).collect();
        let seen: Vec<bool> = self.samples.iter().map(|s| s.visible).collect();
        let mut vote: Vec<bool> = (0..n)
            .map(|i| {
                let mut balance = if seen[i] { 1 } else { -1 };
                for forward in [true, false] {
                    let (mut j, mut far) = (i, 0.0);
                    for _ in 0..n {
                        let next = match (forward, self.closed) {
                            (true, false) if j + 1 == n => break,
                            (false, false) if j == 0 => break,
                            (true, _) => (j + 1) % n,
                            (false, _) => (j + n - 1) % n,
                        };
                        far += if forward { step[j] } else { step[next] };
                        j = next;
                        if far > cleaning.vote || j == i {
                            break;
                        }
                        balance += if seen[j] { 1 } else { -1 };
                    }
                }
                // Undecided, a sample stays as it is.
                if balance == 0 { seen[i] } else { balance > 0 }
            })
            .collect();
        // The stroke that was drawn at the edge of a gap in the frame before, or close to it.
        let stroke = |from: usize, forward: bool| {
            let way = (0..EDGE.min(n)).map(|k| if forward { (from + k) % n } else { (from + n - k) % n });
            way.filter_map(|i| self.samples[i].trace?.stroke).next()
        };
        let bridge = |before: usize, after: usize| match (stroke(before, false), stroke(after, true)) {
            (Some(a), Some(b)) if a == b => cleaning.bridge * WHOLE,
            (Some(_), Some(_)) => cleaning.bridge / WHOLE,
            _ => cleaning.bridge,
        };
        flip_short_runs(&mut vote, &step, self.closed, false, &bridge);
        flip_short_runs(&mut vote, &step, self.closed, true, &|_, _| cleaning.shortest);
        self.samples.iter_mut().zip(vote).for_each(|(s, v)| s.visible = v || s.visible && s.pinned.is_some());
    }

    /// The runs that are seen: ranges of samples, which go on from the first after the last where the line is closed; and
    /// whether the whole closed line is one.
    pub fn runs(&self) -> (Vec<Vec<Sample>>, bool) {
        let n = self.samples.len();
        if self.samples.iter().all(|s| s.visible) {
            return (vec![self.samples.clone()], self.closed);
        }
        // A closed line is walked from a sample that is hidden.
        let first = if self.closed { self.samples.iter().position(|s| !s.visible).unwrap_or(0) } else { 0 };
        let walk: Vec<&Sample> = (0..n).map(|i| &self.samples[(first + i) % n]).collect();
        let runs = walk.split(|s| !s.visible).filter(|run| run.len() > 1);
        (runs.map(|run| run.iter().map(|s| **s).collect()).collect(), false)
    }
}

/// Samples at the edge of a gap that say what was there.
const EDGE: usize = 4;
/// A stroke that was whole in the frame before bridges gaps that are longer by this factor, and one that was two pieces only
/// those that are shorter by it.
const WHOLE: f32 = 1.6;

/// Turns runs of `value` that are shorter than `least` pixels, which is asked with the samples before and after, into the
/// opposite; not those at the ends of an open line where they are hidden, for there is nothing to bridge.
fn flip_short_runs(
    values: &mut [bool],
    step: &[f32],
    closed: bool,
    value: bool,
    least: &dyn Fn(usize, usize) -> f32,
) {
    let n = values.len();
    if values.iter().all(|v| *v == value) {
        // A line that is seen from end to end can be too short; one that is hidden is no gap.
        if value && step.iter().sum::<f32>() < least(0, n - 1) {
            values.fill(false);
        }
        return;
    }
    let start = if closed { values.iter().position(|v| *v != value).unwrap_or(0) } else { 0 };
    let mut i = 0;
    while i < n {
        let at = |k: usize| (start + k) % n;
        if values[at(i)] != value {
            i += 1;
            continue;
        }
        let mut end = i;
        let mut length = 0.0;
        while end < n && values[at(end)] == value {
            length += step[at(end)];
            end += 1;
        }
        let at_end = !closed && (i == 0 || end == n);
        if (value || !at_end) && length < least(at(i + n - 1), at(end)) {
            (i..end).for_each(|k| values[at(k)] = !value);
        }
        i = end;
    }
}

#[cfg(test)]
impl Sample {
    /// Seen, on a silhouette, one unit away, with nothing behind or before it.
    pub fn at(pixel: Vec2) -> Self {
        let anchor = crate::contour::Anchor { vertices: [0; 2], part: 0.0 };
        Self {
            pixel,
            depth: 1.0,
            outward: Vec2::Y,
            visible: true,
            gap: 0.0,
            silhouette: true,
            cover: 0.0,
            mesh_point: MeshPoint { ends: [anchor; 2], part: 0.0 },
            line: Vec2::ZERO,
            uv: Vec2::ZERO,
            strength: 1.0,
            trace: None,
            pinned: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(seen: &str, closed: bool) -> SampledLine {
        let samples = seen
            .chars()
            .enumerate()
            .map(|(i, c)| Sample { visible: c == '#', ..Sample::at(Vec2::new(2.0 * i as f32, 0.0)) })
            .collect();
        SampledLine { kind: LineKind::Contour, draw: 0, shape: 1, samples, closed, facet: 2.0 }
    }

    fn cleaned(seen: &str, closed: bool) -> String {
        let mut line = line(seen, closed);
        line.clean(&Cleaning::default());
        line.samples.iter().map(|s| if s.visible { '#' } else { '.' }).collect()
    }

    #[test]
    fn single_errors_are_outvoted_gaps_bridged_and_short_runs_dropped() {
        assert_eq!(cleaned("#######.########", false), "################");
        assert_eq!(cleaned("######..########", false), "################");
        assert_eq!(cleaned("........#.......", false), "................");
        assert_eq!(cleaned("......##........", false), "................");
        let long = "##########..........##########";
        assert_eq!(cleaned(long, false), long);
        // Around the seam of a closed line a gap is one, and at the end of an open one it is none.
        assert_eq!(line("..####..########..", true).runs().0.len(), 2);
        assert_eq!(cleaned("##############..", false), "##############..");
    }

    #[test]
    fn runs_of_a_closed_line_go_on_across_its_seam() {
        let (runs, closed) = line("####....####", true).runs();
        assert_eq!((runs.len(), runs[0].len(), closed), (1, 8, false));
        let (runs, closed) = line("########", true).runs();
        assert_eq!((runs.len(), closed), (1, true));
        let (runs, _) = line("####....####", false).runs();
        assert_eq!(runs.len(), 2);
    }

    #[test]
    fn what_lies_outside_the_window_is_cut_off() {
        let clip = |a: [f64; 2], b: [f64; 2]| clip_to_window(a.into(), b.into(), [100, 100]);
        assert_eq!(clip([10.0, 10.0], [90.0, 10.0]), Some([0.0, 1.0]));
        assert_eq!(clip([-264.0, 50.0], [136.0, 50.0]), Some([0.5, 1.0]));
        assert_eq!(clip([-300.0, 50.0], [-200.0, 50.0]), None);
        assert_eq!(clip([0.0, 300.0], [50.0, 300.0]), None);
    }
}
