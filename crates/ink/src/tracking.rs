//! Strokes that stay what they are from frame to frame, when the camera or the scene moves.
//!
//! Contours slide over the surface, so that nothing of a mesh is a name for one. But a place of the surface that was on a line
//! is near that line in the next frame: every sample of a stroke keeps the point of the mesh that it lies on, is put where that
//! point is now, and what is drawn there inherits from it (Kalnins et al. 2003, "Coherent Stylized Silhouettes"). By a vote of its
//! samples a stroke keeps its identity and its seed, sample by sample its phase (where along the brush's own marks it is) and
//! what the brush did there. What has nothing to inherit from fades in; what nobody has inherited from fades out where it was.
//! And what was drawn is drawn on where it is as good not to ([`crate::select`]).
//!
//! What is pinned is drawn wherever it is seen, however much is beside it and however short it is; of several strokes that become one
//! the pinned one goes on. Where it is covered or is no line any more it goes like others, but its place on the surface is
//! remembered until the picture is another one: a line that is found there is it again.
//!
//! Nothing of this depends on light or paint: a tracker that has seen the lines of all frames before is in the state of one
//! that has painted them.

mod fading;
mod phase;

use crate::contour::{LineKind, MeshPoint};
use crate::piece::Piece;
use crate::stroke::{Brush, Hand, Path, Stroke};
use crate::visibility::{STEP, SampledLine};
use fading::fading_strokes;
use glam::Vec2;
use phase::{phases, presence};
use std::collections::{HashMap, HashSet};
use yugen_optics::random::hash_combine;

/// Frames over which strokes come and go: a quarter of a second of film.
const FADE: f32 = 6.0;
/// How far from where it was expected a line is looked for, pixels of a picture of 1080 lines: half the width of the brush.
const REACH: f32 = 8.0;
/// Cosine of the angle by which it may have turned: 30 degrees.
const TURNED: f32 = 0.866;
/// Relative depth by which it may have moved.
const SAME_DEPTH: f32 = 0.02;
/// Frames for which a line is drawn on though a test says that it is hidden: a single frame is more often wrong than right.
const GRACE: u8 = 2;
/// What covers a line from so far before it, relative to its depth, surely hides it.
const SURELY: f32 = 0.05;
/// Part of the way by which pressure, dryness and ink go to what they should be in a frame: nothing jumps, and half is done
/// in two frames.
const FOLLOW: f32 = 0.3;
/// Part of the lines that must be found again; where there are fewer the picture is another one (a cut).
const CUT: f32 = 0.1;
/// Shortest stroke that comes in new at once, pixels of a picture of 1080 lines: four times what it may shrink to.
const LEAST_NEW: f32 = 48.0;
/// Frames for which a shorter one must have been seen, away from other strokes: at the ends of those, short pieces come and go.
const WAIT: u8 = 8;

/// What a place on a line inherits.
#[derive(Clone, Copy, Debug)]
pub struct Trace {
    /// Index among the strokes of the frame before; `None` where a line was seen and not drawn.
    pub stroke: Option<u32>,
    /// The stroke was there, and not only going.
    pub drawn: bool,
    /// Where along the marks of the brush it is, pixels.
    pub phase: f32,
    /// What the brush did.
    pub brush: Brush,
    /// 0 to 1: below one it was coming or going.
    pub presence: f32,
    /// Frames for which it has been drawn though hidden.
    pub grace: u8,
    /// Frames in a row for which the line has been seen before this one.
    pub age: u8,
    /// The line runs the other way now.
    pub reversed: bool,
    /// The identity of the stroke where that is pinned.
    pub pinned: Option<u32>,
}

impl Trace {
    /// Of a line that was seen and not drawn.
    fn only_seen(age: u8) -> Self {
        Self {
            stroke: None,
            drawn: false,
            phase: 0.0,
            brush: Brush::default(),
            presence: 0.0,
            grace: 0,
            age,
            reversed: false,
            pinned: None,
        }
    }
}

/// What became of strokes from one frame to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Change {
    /// How many there are, without those that are going.
    pub strokes: usize,
    /// Of them, those that were not there before, or were going.
    pub born: usize,
    /// Of them, those that were part of another one.
    pub split: usize,
    /// Those of the frame before that are no more.
    pub died: usize,
    /// How far marks of the brush have moved along their stroke against the surface, pixels: in the mean, and of the worst
    /// twentieth.
    pub slip: [f32; 2],
}

/// A point of a stroke in memory.
#[derive(Clone, Copy, Debug)]
struct Point {
    mesh_point: MeshPoint,
    /// From the line to where it was drawn.
    offset: Vec2,
    outward: Vec2,
    phase: f32,
    brush: Brush,
    presence: f32,
    grace: u8,
    /// Where it is in this frame, and how deep; `None` where it cannot be.
    now: Option<(Vec2, f32)>,
}

#[derive(Clone, Debug)]
struct Remembered {
    id: u32,
    seed: u32,
    kind: LineKind,
    draw: u32,
    shape: u32,
    closed: bool,
    fading: bool,
    pinned: bool,
    /// It is pinned and not there: nothing of it is drawn.
    asleep: bool,
    points: Vec<Point>,
}

impl Remembered {
    /// Where it was, with nothing of it there.
    fn put_to_sleep(&self) -> Self {
        let points = self.points.iter().map(|p| Point { presence: 0.0, ..*p }).collect();
        Self { fading: true, asleep: true, points, ..self.clone() }
    }

    /// Pixels of phase from its beginning to its end.
    fn span(&self) -> f32 {
        match (self.points.first(), self.points.last()) {
            (Some(a), Some(b)) => (b.phase - a.phase).abs(),
            _ => 0.0,
        }
    }
}

/// A run of a line that was seen: points of the mesh in their order, and for how many frames in a row each was before.
type SeenLine = (LineKind, u32, Vec<(MeshPoint, u8)>);

#[derive(Clone, Debug, Default)]
struct Memory {
    strokes: Vec<Remembered>,
    seen: Vec<SeenLine>,
}

/// Follows strokes from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Tracker {
    memory: Option<Memory>,
    /// Lines of this frame that are seen.
    seen: Vec<SeenLine>,
    frame: u32,
    change: Change,
}

/// Where a point of a draw's mesh is in this frame, pixels and depth.
pub type Project<'a> = dyn Fn(u32, &MeshPoint) -> Option<(Vec2, f32)> + 'a;

/// Something on a line, to be found by its place in the picture.
#[derive(Clone, Copy)]
struct Entry {
    pixel: Vec2,
    way: Vec2,
    depth: f32,
    kind: LineKind,
    draw: u32,
    /// Stroke and point; or a line that was only seen.
    source: Option<[u32; 2]>,
    /// What counts besides its distance, pixels.
    handicap: f32,
    /// See [`Trace::age`].
    age: u8,
}

struct Places {
    side: f32,
    entries: Vec<Entry>,
    cells: HashMap<[i32; 2], Vec<u32>>,
}

impl Places {
    fn new(side: f32) -> Self {
        Self { side, entries: Vec::new(), cells: HashMap::new() }
    }

    fn cell(&self, p: Vec2) -> [i32; 2] {
        (p / self.side).floor().to_array().map(|v| v as i32)
    }

    fn add(&mut self, entry: Entry) {
        if !entry.pixel.is_finite() {
            return;
        }
        let cell = self.cell(entry.pixel);
        self.cells.entry(cell).or_default().push(self.entries.len() as u32);
        self.entries.push(entry);
    }

    /// The nearest that goes the same way, or the opposite one, of the same kind of line of the same draw.
    fn nearest(&self, p: Vec2, way: Vec2, depth: f32, kind: LineKind, draw: u32) -> Option<&Entry> {
        let [x, y] = self.cell(p);
        let cells = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
        let near =
            cells.filter_map(|c| self.cells.get(&c)).flatten().map(|i| (*i, &self.entries[*i as usize]));
        near.filter(|(_, e)| {
            e.draw == draw
                && e.kind == kind
                && e.pixel.distance(p) < self.side
                && (e.depth - depth).abs() < SAME_DEPTH * depth
                // What has no direction goes any way.
                && (e.way.dot(way).abs() > TURNED || e.way == Vec2::ZERO || way == Vec2::ZERO)
        })
        .min_by(|(i, a), (j, b)| {
            let far = |e: &Entry| e.pixel.distance(p) + e.handicap;
            far(a).total_cmp(&far(b)).then(i.cmp(j))
        })
        .map(|(_, e)| e)
    }
}

/// Unit, along places.
fn ways(places: &[Option<Vec2>]) -> Vec<Vec2> {
    (0..places.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(places.len() - 1));
            match (places[a].or(places[i]), places[b].or(places[i])) {
                (Some(p), Some(q)) => (q - p).normalize_or_zero(),
                _ => Vec2::ZERO,
            }
        })
        .collect()
}

impl Tracker {
    /// Begins anew: the next frame has none before it.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Whether there was a frame before.
    pub fn has_memory(&self) -> bool {
        self.memory.is_some()
    }

    /// What became of strokes in the last frame.
    pub fn change(&self) -> Change {
        self.change
    }

    /// Tells lines what they inherit, and decides anew what of them is seen. Before they are cleaned.
    pub fn recall(&mut self, lines: &mut [SampledLine], project: &Project, unit: f32) {
        let Some(memory) = &mut self.memory else {
            self.seen = lines.iter().flat_map(seen_runs).collect();
            return;
        };
        let side = REACH * unit.max(0.5);
        let (mut places, mut seen) = (Places::new(side), Places::new(side));
        for (i, stroke) in (0u32..).zip(&mut memory.strokes) {
            stroke.points.iter_mut().for_each(|p| p.now = project(stroke.draw, &p.mesh_point));
            let now: Vec<Option<Vec2>> = stroke.points.iter().map(|p| p.now.map(|n| n.0)).collect();
            for (j, (point, way)) in (0u32..).zip(stroke.points.iter().zip(ways(&now))) {
                let Some((pixel, depth)) = point.now else { continue };
                // What is going is inherited from where nothing better is.
                let handicap = if stroke.fading { 0.25 * side } else { 0.0 };
                let (kind, draw, source) = (stroke.kind, stroke.draw, Some([i, j]));
                places.add(Entry { pixel, way, depth, kind, draw, source, handicap, age: 0 });
            }
        }
        for (kind, draw, mesh_points) in &memory.seen {
            let now: Vec<_> = mesh_points.iter().map(|(f, _)| project(*draw, f)).collect();
            let pixels: Vec<Option<Vec2>> = now.iter().map(|n| n.map(|n| n.0)).collect();
            for ((now, (_, age)), way) in now.iter().zip(mesh_points).zip(ways(&pixels)) {
                let Some((pixel, depth)) = *now else { continue };
                let (kind, draw, age) = (*kind, *draw, age.saturating_add(1));
                seen.add(Entry { pixel, way, depth, kind, draw, source: None, handicap: 0.0, age });
            }
        }
        let (mut all, mut found) = (0usize, 0usize);
        for line in lines.iter_mut() {
            let pixels: Vec<Option<Vec2>> = line.samples.iter().map(|s| Some(s.line)).collect();
            for (sample, way) in line.samples.iter_mut().zip(ways(&pixels)) {
                let near = |places: &Places| {
                    places.nearest(sample.line, way, sample.depth, line.kind, line.draw).copied()
                };
                let age = near(&seen).map(|e| e.age);
                sample.trace = match near(&places).and_then(|e| Some((e.source?, e.way.dot(way) < 0.0))) {
                    Some((source, reversed)) => {
                        Some(Trace { age: age.unwrap_or(0), ..memory.trace(source, sample.line, reversed) })
                    }
                    None => age.map(Trace::only_seen),
                };
                sample.pinned = sample.trace.and_then(|t| t.pinned);
                all += usize::from(sample.visible);
                found += usize::from(sample.visible && sample.trace.is_some());
            }
        }
        if (found as f32) < CUT * all as f32 {
            self.memory = None;
            lines.iter_mut().flat_map(|l| &mut l.samples).for_each(|s| (s.trace, s.pinned) = (None, None));
        }
        self.seen = lines.iter().flat_map(seen_runs).collect();
        if self.memory.is_none() {
            return;
        }
        for line in lines {
            for sample in &mut line.samples {
                let (visible, cover) = (sample.visible, sample.cover);
                let Some(trace) = &mut sample.trace else { continue };
                trace.grace = if visible { 0 } else { trace.grace.saturating_add(1) };
                sample.visible |= trace.drawn && trace.grace <= GRACE && cover < SURELY;
            }
            // What is seen for the first time may be an error: it waits for a second frame.
            let runs = line.samples.chunk_by_mut(|a, b| a.visible == b.visible);
            for run in runs.filter(|run| run.iter().all(|s| s.trace.is_none())) {
                run.iter_mut().for_each(|s| s.visible = false);
            }
        }
    }

    /// Strokes of the pieces of lines that are drawn, and those that are going. `is_free`: whether nothing covers a place in
    /// the picture at a depth.
    pub fn strokes(
        &mut self,
        pieces: Vec<Piece>,
        hand: &Hand,
        is_free: &dyn Fn(Vec2, f32) -> bool,
    ) -> Vec<Stroke> {
        let memory = self.memory.take();
        let known = memory.is_some();
        let memory = memory.unwrap_or_default();
        let mut pieces = pieces;
        for piece in &mut pieces {
            orient(piece, &memory);
        }
        let matches = match_strokes(&pieces, &memory);
        // A short piece begins a stroke only where it has been seen for a while and no other is; one that was there may end as one.
        let lasts = |p: &Piece| {
            2 * p
                .samples
                .iter()
                .filter(|s| s.trace.is_some_and(|t| t.stroke.is_none() && t.age >= WAIT))
                .count()
                > p.samples.len()
        };
        let least = if known { LEAST_NEW * hand.unit.max(0.5) } else { 0.0 };
        let (mut pieces, matches): (Vec<Piece>, Vec<Match>) = pieces
            .into_iter()
            .zip(matches)
            .filter(|(p, h)| h.keeps || p.length(&p.arc()) >= least || lasts(p))
            .unzip();
        let mut used: HashSet<u32> = memory.strokes.iter().map(|s| s.id).collect();
        // Nobody has inherited a name yet; who has asked for one has it.
        let asked = if known { HashMap::new() } else { asked_for(&pieces) };
        used.extend(asked.values());
        let (mut strokes, mut next) = (Vec::new(), Memory::default());
        let there: HashSet<u32> = memory.strokes.iter().filter(|s| !s.fading).map(|s| s.id).collect();
        let mut change = Change { strokes: pieces.len(), ..Change::default() };
        let mut slips: Vec<f32> = Vec::new();
        for (i, (piece, found)) in pieces.iter_mut().zip(&matches).enumerate() {
            let parent = found.parent.map(|p| &memory.strokes[p as usize]);
            // One that was going has come again, where not only a part of it was.
            change.born += usize::from(found.keeps && parent.is_some_and(|p| !there.contains(&p.id)));
            let id = match (parent, found.keeps) {
                (Some(parent), true) => parent.id,
                _ if asked.contains_key(&i) => asked[&i],
                _ => {
                    *if parent.is_some() { &mut change.split } else { &mut change.born } +=
                        usize::from(known);
                    let base = hand.own(piece);
                    let base = if known { hash_combine(base, self.frame) } else { base };
                    let mut own = (0u32..).map(|k| if k == 0 { base } else { hash_combine(base, k) });
                    own.find(|id| !used.contains(id)).unwrap_or(base)
                }
            };
            used.insert(id);
            let seed = parent.map_or(id, |p| p.seed);
            if let Some(parent) = parent.filter(|_| piece.closed) {
                begin_where_it_began(piece, parent);
            }
            let s = piece.arc();
            let same = |t: &Trace| t.stroke.is_some_and(|i| memory.strokes[i as usize].seed == seed);
            let votes: Vec<Option<f32>> =
                piece.samples.iter().map(|s| s.trace.filter(same).map(|t| t.phase)).collect();
            let around = parent.filter(|p| p.closed).map(Remembered::span);
            let (phase, slip) = phases(&s, &votes, around, hand.unit);
            slips.extend(slip);
            let path = Path { seed, s: &s, phase: &phase };
            let mut brush = hand.brush(piece, id, &path);
            for (brush, sample) in brush.iter_mut().zip(&piece.samples) {
                if let Some(before) = sample.trace.filter(|t| t.stroke.is_some()) {
                    *brush = before.brush.lerp(brush, FOLLOW);
                }
            }
            let presence = if known { presence(piece, &s, hand.unit) } else { vec![1.0; s.len()] };
            let stroke = hand.stroke(piece, id, &path, &brush, &presence);
            let points = (0..s.len()).map(|i| {
                let sample = &piece.samples[i];
                Point {
                    mesh_point: sample.mesh_point,
                    offset: stroke.points[i].pixel - sample.line,
                    outward: sample.outward,
                    phase: phase[i],
                    brush: brush[i],
                    presence: presence[i],
                    grace: sample.trace.map_or(0, |t| t.grace),
                    now: None,
                }
            });
            next.strokes.push(Remembered {
                id,
                seed,
                kind: piece.kind,
                draw: piece.draw,
                shape: piece.shape,
                closed: piece.closed,
                fading: false,
                pinned: hand.edits.get(&id).is_some_and(|edit| edit.pin),
                asleep: false,
                points: points.collect(),
            });
            strokes.push(stroke);
        }
        let kept: HashSet<u32> = next.strokes.iter().map(|s| s.id).collect();
        change.died = there.difference(&kept).count();
        slips.sort_by(f32::total_cmp);
        if !slips.is_empty() {
            let mean = slips.iter().sum::<f32>() / slips.len() as f32;
            change.slip = [mean, slips[slips.len() - 1 - slips.len() / 20]];
        }
        for fading in fading_strokes(&memory, &pieces, hand.unit, is_free) {
            strokes.push(hand.fading(&fading));
            next.strokes.push(fading.remembered);
        }
        let gone = |s: &&Remembered| s.pinned && (!s.fading || s.asleep) && !kept.contains(&s.id);
        next.strokes.extend(memory.strokes.iter().filter(gone).map(Remembered::put_to_sleep));
        next.seen = std::mem::take(&mut self.seen);
        self.memory = Some(next);
        self.frame += 1;
        self.change = change;
        strokes
    }
}

/// Runs of a line that are seen.
fn seen_runs(line: &SampledLine) -> Vec<SeenLine> {
    let runs = line.samples.chunk_by(|a, b| a.visible == b.visible).filter(|run| run[0].visible);
    runs.map(|run| {
        (line.kind, line.draw, run.iter().map(|s| (s.mesh_point, s.trace.map_or(0, |t| t.age))).collect())
    })
    .collect()
}

impl Memory {
    /// What a place near a point of a stroke inherits: between that point and its neighbours.
    fn trace(&self, [stroke, point]: [u32; 2], at: Vec2, reversed: bool) -> Trace {
        let remembered = &self.strokes[stroke as usize];
        let (points, j) = (&remembered.points, point as usize);
        let here = &points[j];
        let mut best = (f32::INFINITY, here, here, 0.0);
        for k in [j.checked_sub(1), Some(j + 1).filter(|k| *k < points.len())].into_iter().flatten() {
            let (Some((p, _)), Some((q, _))) = (here.now, points[k].now) else { continue };
            let way = q - p;
            let t = ((at - p).dot(way) / way.length_squared().max(1e-12)).clamp(0.0, 1.0);
            let far = at.distance(p + way * t);
            if far < best.0 {
                best = (far, here, &points[k], t);
            }
        }
        let (_, a, b, t) = best;
        // Beyond an end there was no stroke.
        let end = !remembered.closed && (j == 0 || j + 1 == points.len()) && t == 0.0;
        let beyond = end && here.now.is_some_and(|(p, _)| p.distance(at) > 0.5 * STEP as f32);
        let mix = |x: f32, y: f32| x + (y - x) * t;
        Trace {
            stroke: Some(stroke),
            drawn: !remembered.fading && !beyond,
            phase: mix(a.phase, b.phase),
            brush: a.brush.lerp(&b.brush, t),
            presence: mix(a.presence, b.presence),
            grace: here.grace,
            age: 0,
            reversed,
            pinned: (remembered.pinned && !beyond).then_some(remembered.id),
        }
    }
}

/// Lets a piece go the way that most of what it inherits went.
fn orient(piece: &mut Piece, memory: &Memory) {
    let traces = || piece.samples.iter().filter_map(|s| s.trace).filter(|t| t.stroke.is_some());
    // A stroke that goes round nearly a whole circle goes both ways; its phases tell which.
    let reversed = traces().filter(|t| t.reversed).count();
    if 2 * reversed > traces().count() && !memory.strokes.is_empty() {
        piece.reverse();
    }
}

/// The names that pieces are to have, by their index: each that of the pinned stroke that most of it is; of several with the same
/// one the longest has it.
fn asked_for(pieces: &[Piece]) -> HashMap<usize, u32> {
    let mut longest: HashMap<u32, (usize, usize)> = HashMap::new();
    for (i, piece) in pieces.iter().enumerate() {
        let mut counts: HashMap<u32, usize> = HashMap::new();
        piece.samples.iter().filter_map(|s| s.pinned).for_each(|id| *counts.entry(id).or_default() += 1);
        let most = counts.into_iter().max_by_key(|(id, count)| (*count, std::cmp::Reverse(*id)));
        if let Some((id, count)) = most {
            let best = longest.entry(id).or_insert((i, count));
            if count > best.1 {
                *best = (i, count);
            }
        }
    }
    longest.into_iter().map(|(id, (i, _))| (i, id)).collect()
}

/// From whom a piece inherits.
#[derive(Clone, Copy, Default)]
struct Match {
    parent: Option<u32>,
    /// It is the parent, not only a part of it.
    keeps: bool,
}

/// For each piece the stroke that most of it was; of several with the same one the longest is it.
fn match_strokes(pieces: &[Piece], memory: &Memory) -> Vec<Match> {
    let mut claims: Vec<(usize, usize, u32)> = Vec::new();
    for (i, piece) in pieces.iter().enumerate() {
        let mut votes: HashMap<u32, usize> = HashMap::new();
        for stroke in piece.samples.iter().filter_map(|s| s.trace?.stroke) {
            *votes.entry(stroke).or_default() += 1;
        }
        claims.extend(votes.into_iter().map(|(stroke, count)| (count, i, stroke)));
    }
    // Those that are there come before those that are going, and of them those that are pinned before others.
    let rank = |stroke: u32| match &memory.strokes[stroke as usize] {
        s if s.fading => 2,
        s if s.pinned => 0,
        _ => 1,
    };
    claims.sort_by(|a, b| {
        rank(a.2).cmp(&rank(b.2)).then(b.0.cmp(&a.0)).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2))
    });
    let mut matches = vec![Match::default(); pieces.len()];
    let mut taken: HashSet<u32> = HashSet::new();
    for (_, piece, stroke) in &claims {
        let id = memory.strokes[*stroke as usize].id;
        if !matches[*piece].keeps && taken.insert(id) {
            matches[*piece] = Match { parent: Some(*stroke), keeps: true };
        }
    }
    for (_, piece, stroke) in claims {
        matches[piece].parent.get_or_insert(stroke);
    }
    matches
}

/// Lets a closed piece begin where the stroke began that it was.
fn begin_where_it_began(piece: &mut Piece, parent: &Remembered) {
    let Some(first) = parent.points.first().and_then(|p| p.now) else { return };
    let near = |s: &crate::visibility::Sample| {
        s.line.distance(first.0) + 300.0 * (s.depth - first.1).abs() / first.1
    };
    let start = piece.samples.iter().enumerate().min_by(|a, b| near(a.1).total_cmp(&near(b.1)));
    if let Some((start, _)) = start {
        piece.samples.rotate_left(start);
    }
}
