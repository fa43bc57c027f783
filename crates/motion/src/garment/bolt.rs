//! Pieces as they are cut from the bolt and sewn: what cuts of robes have in common.

use super::Side::{Bottom, Left, Right, Top};
use super::{Edge, Hang, Mark, Panel, Seam, Side};
use glam::Vec2;

/// Pieces as they are laid on the bolt, side by side.
#[derive(Default)]
pub(super) struct Bolt {
    pub panels: Vec<Panel>,
    pub seams: Vec<Seam>,
    used: f32,
}

impl Bolt {
    /// Cuts a panel; returns its number.
    pub fn cut(&mut self, name: &str, across: &[f32], along: Vec<Mark>, hang: Hang) -> usize {
        let width = across[across.len() - 1] - across[0];
        let bolt = Vec2::new(self.used - across[0], 0.0);
        self.used += width + 0.1;
        self.panels.push(Panel { name: name.into(), bolt, across: across.to_vec(), along, hang });
        self.panels.len() - 1
    }

    pub fn sew(&mut self, a: Edge, b: Edge) {
        self.seams.push([a, b]);
    }
}

/// An edge of a panel.
pub(super) fn edge(panel: usize, side: Side, from: f32, to: f32) -> Edge {
    Edge { panel, side, from, to }
}

/// Where a piece is that lies flat, u from so far to the left of the wearer's middle.
pub(super) fn flat(from: f32, run: f32, front: bool, left: bool) -> Hang {
    Hang::Flat { from, run, front, left }
}

/// Heights at which seams of a robe begin or end: those that lie within five millimetres of each other are one.
pub(super) struct Levels(Vec<f32>);

impl Levels {
    pub fn new(mut all: Vec<f32>) -> Self {
        all.sort_by(f32::total_cmp);
        all.dedup_by(|a, b| (*a - *b).abs() < 5e-3);
        Self(all)
    }

    /// What was merged with a neighbour is where that is.
    pub fn near(&self, v: f32) -> f32 {
        let distance = |w: &f32| (w - v).abs();
        self.0.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(v)
    }

    /// Marks of a piece from a height to another, which reaches from u to u there.
    pub fn marks(&self, from: f32, to: f32, of: impl Fn(f32) -> [f32; 2]) -> Vec<Mark> {
        let within = self.0.iter().filter(|v| (from..=to).contains(*v));
        within.map(|v| (*v, of(*v))).map(|(v, [left, right])| Mark { v, left, right }).collect()
    }
}

/// How much narrower a piece is where it lies beside another that it is not sewn to, m.
pub(super) const APART: f32 = 0.02;

/// How much narrower a piece is at v that leaves its neighbour from a height on, m.
pub(super) fn leaves(v: f32, from: f32, to: f32) -> f32 {
    APART * ((v - from) / (to - from)).clamp(0.0, 1.0)
}

/// A sleeve that is open at the hand, and the body beside it, m.
pub(super) struct WideSleeve {
    /// From the middle of the back to the side.
    pub back: f32,
    /// From the side to the cuff.
    pub sleeve: f32,
    /// From top to bottom.
    pub depth: f32,
    /// How much of the depth is sewn to the body.
    pub sewn: f32,
}

impl Bolt {
    /// The left and the right back, sewn in the middle.
    pub fn backs(&mut self, levels: &Levels, length: f32, back: f32, neck: f32) -> [usize; 2] {
        let all = levels.marks(0.0, length, |_| [0.0, back]);
        let backs = [
            self.cut("left back", &[0.0, back - neck, back], all.clone(), flat(back, -1.0, false, false)),
            self.cut("right back", &[0.0, neck, back], all, flat(0.0, -1.0, false, false)),
        ];
        self.sew(edge(backs[0], Right, 0.0, length), edge(backs[1], Left, 0.0, length));
        backs
    }

    /// The left and the right front, from `inner` to `outer` m beside the middle at v, sewn to the backs at the shoulders.
    pub fn fronts(
        &mut self,
        levels: &Levels,
        [length, back, neck]: [f32; 3],
        backs: [usize; 2],
        inner: impl Fn(f32) -> f32,
        outer: impl Fn(f32) -> f32,
    ) -> [usize; 2] {
        let left = levels.marks(0.0, length, |v| [inner(v), outer(v)]);
        let right = levels.marks(0.0, length, |v| [back - outer(v), back - inner(v)]);
        let fronts = [
            self.cut("left front", &[0.0, neck, back], left, flat(0.0, 1.0, true, true)),
            self.cut("right front", &[0.0, back - neck, back], right, flat(-back, 1.0, true, false)),
        ];
        self.sew(edge(backs[0], Top, back - neck, 0.0), edge(fronts[0], Top, neck, back));
        self.sew(edge(backs[1], Top, neck, back), edge(fronts[1], Top, back - neck, 0.0));
        fronts
    }

    /// Wide sleeves, sewn to the backs, and to the fronts if there are any given; else they leave these from the shoulder on.
    pub fn wide_sleeves(
        &mut self,
        levels: &Levels,
        of: &WideSleeve,
        backs: [usize; 2],
        fronts: Option<[usize; 2]>,
    ) {
        let WideSleeve { back, sleeve, depth, sewn } = *of;
        let across = [0.0, APART, sleeve - APART, sleeve];
        for (k, name) in ["left sleeve", "right sleeve"].into_iter().enumerate() {
            let left = k == 0;
            let mut cut = |which: &str, hang: Hang, from: f32, at_left: bool| {
                let marks = levels.marks(0.0, depth, |v| {
                    let inner = leaves(v, from, depth);
                    if at_left { [inner, sleeve] } else { [0.0, sleeve - inner] }
                });
                self.cut(&format!("{name}, {which}"), &across, marks, hang)
            };
            // Of the left sleeve u runs inwards behind, and outwards before; of the right the other way round.
            let [at_back, at_front] = if left { [back + sleeve, back] } else { [-back, -back - sleeve] };
            let behind = cut("back", flat(at_back, -1.0, false, false), sewn, !left);
            let from = if fronts.is_some() { sewn } else { 0.0 };
            let before = cut("front", flat(at_front, 1.0, true, left), from, left);
            let (towards, away) = if left { (Right, Left) } else { (Left, Right) };
            self.sew(edge(behind, towards, 0.0, sewn), edge(backs[k], away, 0.0, sewn));
            if let Some(fronts) = fronts {
                self.sew(edge(before, away, 0.0, sewn), edge(fronts[k], towards, 0.0, sewn));
            }
            self.sew(edge(behind, Top, 0.0, sleeve), edge(before, Top, sleeve, 0.0));
            let [low, high] = if left { [0.0, sleeve - APART] } else { [APART, sleeve] };
            self.sew(edge(behind, Bottom, low, high), edge(before, Bottom, sleeve - low, sleeve - high));
        }
    }

    /// A strip along edges that follow one another, sewn to them.
    pub fn strip(&mut self, name: &str, width: f32, path: &[Edge]) -> usize {
        let mark = |v: f32| Mark { v, left: 0.0, right: width };
        let mut along = vec![mark(0.0)];
        let mut ends = vec![0.0];
        for edge in path {
            // Marks are where the cut has put them.
            for length in self.panels[edge.panel].lengths(edge).unwrap_or_default() {
                along.push(mark(along[along.len() - 1].v + length));
            }
            ends.push(along[along.len() - 1].v);
        }
        let strip = self.cut(name, &[0.0, width], along, Hang::Along);
        for (of, ends) in path.iter().zip(ends.windows(2)) {
            self.sew(edge(strip, Side::Left, ends[0], ends[1]), *of);
        }
        strip
    }
}
