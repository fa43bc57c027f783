//! [`super::SmallSteps`] as plain lists: what it does in a substep and in which order, for the same solver on a GPU.
//!
//! A place is where a vertex lies in the solver's memory: neighbours lie near each other. In each substep, in this order and all of one item at
//! once:
//!
//! 1. Every fourth time: air on all places; then in each strip springs, then hinges, as dampers; then in each border.
//! 2. Hinges of strips as forces, gravity, attachments: how far places would go.
//! 3. In each strip one spring after the other; in each border hinges as forces, then one spring after the other.
//! 4. With [`super::Settings::lines`], each line of the first direction, then of the other; what is in a line is not among the springs of 3.
//! 5. Lattices: centres of nodes from the finest level to the coarsest, then threads from the coarsest to the finest, twice.
//! 6. What lattices move places by; bodies; the new velocities and places.
//!
//! As a step begins, before the first: normals and areas, how far places have gone across since they turned, and what drag they have for it.
//! Neighbours in a list of springs or hinges mostly have no place in common.
//!
//! Where cloth touches cloth ([`ContactRows`]), between 5 and 6: what lattices move places by; springs that are longer than they may be, once
//! more in strips and borders, so often as `tightened` says; pairs that are nearer than the radius are pushed apart; bodies; and pairs that would pass
//! through each other are stopped. How pairs are found, and in which order they are solved, is left to each.

use super::air::{AIR, DRAG, FORGETS, NEVER, OVER, SWINGING, SWINGS};
use super::body::{Placed, RECOVERY};
use super::contact::{FLOOR, PART, TOLERANCE, TOUCH};
use super::lattice::SWEEPS;
use super::lines::LEAST;
use super::small_steps::{CALM, REACH, SLID};
use super::sweep::SHORT;
use super::{Solid, Stance};
use glam::{Mat3, Vec3};
use std::ops::Range;

/// A spring in a substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringRow {
    /// Two places, or two nodes of a level.
    pub ends: [u32; 2],
    /// Length without force, m.
    pub rest: f32,
    /// Longest that it may be, m; infinite for none.
    pub longest: f32,
    /// Part of a correction that the first end takes.
    pub share: f32,
    /// Part of the elongation that is taken away in a substep.
    pub give: f32,
    /// Part of the relative velocity that the damper takes away when it acts.
    pub calm: f32,
}

/// A hinge in a substep: it sees Σ `slopes` times places relative to the third, and takes that times `push` from each of them; times the
/// seconds that it acts for a force, times `calm` for a damper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeRow {
    /// Four places, of which the last two may be the same.
    pub at: [u32; 4],
    /// Of the first, second and fourth, 1/m.
    pub slopes: [f32; 3],
    /// Of all four, N/kg.
    pub push: [f32; 4],
    /// s.
    pub calm: f32,
}

/// A place of a line, and the link to the next place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineRow {
    /// The place.
    pub place: u32,
    /// Its inverse mass, 1/kg.
    pub inverse: f32,
    /// Length of the link without force, m.
    pub rest: f32,
    /// Longest that it may be, m.
    pub longest: f32,
    /// 1/(k h²), 1/kg.
    pub compliance: f32,
}

/// What is worked on alone: a strip or a border.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskRows {
    /// Its places.
    pub places: Range<usize>,
    /// In the order in which they act as dampers, and are solved where `loose` is none.
    pub springs: Vec<SpringRow>,
    /// Those that are in no line, in the order in which they are solved.
    pub loose: Option<Vec<SpringRow>>,
    /// In the order in which they act.
    pub hinges: Vec<HingeRow>,
}

/// Up to four nodes and their weights.
pub type Weights = ([u32; 4], [f32; 4]);

/// A level of nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelRows {
    /// What each node is the centre of: places of the finest level, nodes of the finer one, with weights.
    pub parts: Vec<Vec<(u32, f32)>>,
    /// What threads hang from, numbered after the nodes: places and weights.
    pub anchors: Vec<Vec<(u32, f32)>>,
    /// Nodes of the coarser level that move each node; empty for the coarsest.
    pub coarser: Vec<Weights>,
    /// Between nodes and anchors, in the order in which they are solved.
    pub threads: Vec<SpringRow>,
}

/// Where a cloth is between two steps, of [`super::SmallSteps::now`].
#[derive(Clone, Debug, PartialEq)]
pub struct Now {
    /// Of each place, m, m/s, and what adding to the place has lost to rounding, m.
    pub places: [Vec<Vec3>; 3],
    /// Of each place, the way across, along the normal, since its velocity relative to the air turned back, and how long the one before was, m;
    /// the drag coefficient across at the turn.
    pub swings: Vec<[f32; 3]>,
    /// Of each attachment, where it was to be, m.
    pub targets: Vec<Vec3>,
    /// Where bodies are.
    pub stances: Vec<Stance>,
}

/// How [`super::SmallSteps`] works, of [`super::SmallSteps::rows`].
#[derive(Clone, Debug)]
pub struct Rows {
    /// Of each place, the vertex that lies there.
    pub vertex: Vec<u32>,
    /// Triangles of places.
    pub triangles: Vec<[u32; 3]>,
    /// Inverse masses of places, 1/kg, nought where attached for good.
    pub inverse: Vec<f32>,
    /// How wide the cloth is in which each place is, as far as drag knows, m.
    pub widths: Vec<f32>,
    /// Strips, and borders between them.
    pub tasks: [Vec<TaskRows>; 2],
    /// Lines of both directions; those of a direction have no place in common.
    pub lines: [Vec<Vec<LineRow>>; 2],
    /// From the coarsest on; none without coarse levels.
    pub levels: Vec<LevelRows>,
    /// Of each place, nodes of the finest level that move it.
    pub reach: Vec<Weights>,
    /// Places of attachments in the order in which they were given.
    pub attached: Vec<u32>,
    /// As [`super::Settings::grip`].
    pub grip: f32,
    /// Of a step.
    pub seconds: f32,
    /// Of a step.
    pub substeps: u32,
    /// For how long dampers and air act at a time, s.
    pub calm_seconds: f32,
    /// Friction on bodies.
    pub friction: f32,
    /// Distance that is kept from bodies, m.
    pub gap: f32,
    /// In the order in which they were given.
    pub bodies: Vec<Solid>,
    /// Where cloth touches cloth.
    pub contact: Option<ContactRows>,
}

/// What cloth needs that touches itself.
#[derive(Clone, Debug)]
pub struct ContactRows {
    /// Distance to keep, m.
    pub radius: f32,
    /// Friction between layers.
    pub friction: f32,
    /// How often springs that are longer than they may be are solved once more in a substep.
    pub tightened: u32,
    /// Which part of its way what lies on a body gives way to cloth that presses on it, and the distance from the body over which that ends, m.
    pub loaded: f32,
    /// m.
    pub loads: f32,
    /// Leaves of the tree of triangles, a power of two: where their triangles, vertices and edges begin and end. Each vertex and edge is in one leaf.
    pub leaves: Vec<[Range<u32>; 3]>,
    /// Of all leaves, triangles of places.
    pub triangles: Vec<[u32; 3]>,
    /// Of all leaves, places.
    pub vertices: Vec<u32>,
    /// Of all leaves, two places each.
    pub edges: Vec<[u32; 2]>,
    /// Of each place, those that are nearer than the radius in the flat cloth, and do not push it.
    pub ring: Vec<Vec<u32>>,
}

/// Substeps between two goes of dampers and air.
pub const CALM_EVERY: u32 = CALM;
/// Sweeps over the threads of a level.
pub const LEVEL_SWEEPS: u32 = SWEEPS;
/// The solver's numbers by their names.
pub const NUMBERS: &[(&str, f32)] = &[
    ("SHORT", SHORT),
    ("LEAST", LEAST),
    ("SLID", SLID),
    ("FLIGHT", REACH),
    ("RECOVERY", RECOVERY),
    ("AIR", AIR),
    ("DRAG_ACROSS", DRAG[0]),
    ("DRAG_ALONG", DRAG[1]),
    ("SWINGING", SWINGING),
    ("SHORTEST_SWING", SWINGS[0]),
    ("LONGEST_SWING", SWINGS[1]),
    ("FORGETS", FORGETS),
    ("OVER_WAY", OVER[0]),
    ("OVER_WIDTH", OVER[1]),
    ("NEVER", NEVER),
    ("PART", PART),
    ("FLOOR", FLOOR),
    ("TOLERANCE", TOLERANCE),
    ("TOUCH", TOUCH),
];
/// Of the radius, within which a pair may come to touch while others are pushed.
pub const TOUCHING: f32 = TOUCH;

/// Where a body is during a step.
#[derive(Clone, Debug)]
pub struct Course {
    /// Of a sphere around all that it sweeps over, m; its radius may be infinite.
    pub middle: Vec3,
    /// m.
    pub radius: f32,
    /// How far any of its points goes, where that is easily told, m.
    pub moved: Option<f32>,
    /// As the step begins and after each substep: rotation and origin.
    pub placed: Vec<(Mat3, Vec3)>,
}

impl Course {
    /// From one stance to another in so many substeps.
    pub fn new(solid: &Solid, from: &Stance, to: &Stance, substeps: u32) -> Self {
        let (middle, radius, moved) = solid.swept(from, to);
        let placed = |s: u32| Placed::between(from, to, s as f32 / substeps as f32).parts();
        Self { middle, radius, moved, placed: (0..=substeps).map(placed).collect() }
    }
}

/// Parts of a list by their ends, as lists.
pub(super) fn split(all: &[(u32, f32)], ends: &[u32]) -> Vec<Vec<(u32, f32)>> {
    let starts = [0].into_iter().chain(ends.iter().copied());
    starts.zip(ends).map(|(from, to)| all[from as usize..*to as usize].to_vec()).collect()
}
