//! Pieces as they are cut from the bolt and sewn: what cuts of robes have in common.

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

/// Where a piece is that lies flat to the left of the wearer's middle.
pub(super) fn flat(left: f32, run: f32, front: bool, over: bool) -> Hang {
    Hang::Flat { left, run, front, over }
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

impl Bolt {
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
