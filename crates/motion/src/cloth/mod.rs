//! Cloth as point masses between springs and dampers, and two solvers over the same ones.
//!
//! [`Cloth`] says what hangs together: masses, [`Spring`]s along warp, weft and bias with their dampers and strain limits,
//! and [`Hinge`]s that resist bending; made from a [`Sheet`] (triangles that know their place in the flat cloth) and a
//! [`Fabric`] (what is measured on cloth), or by hand. [`Provot`] is the mass-spring-damper model of the literature, the
//! baseline; [`SmallSteps`] is the default.
//!
//! Metres, seconds, kilograms. The weft runs along u of the flat cloth and the warp along v.

mod aabb;
mod air;
mod body;
mod contact;
mod crossings;
mod fabric;
mod lattice;
mod leaves;
mod lines;
mod measure;
mod order;
mod provot;
pub mod rows;
mod settings;
mod small_steps;
mod springs;
mod sweep;
mod team;
mod weld;

pub use body::{Field, Solid, Stance};
pub use fabric::{Fabric, PRESETS, Preset, QUANTITIES, Quantity};
use glam::{Vec2, Vec3};
pub use measure::{Energy, Stretch, normals};
pub use provot::Provot;
pub use settings::Settings;
pub use small_steps::SmallSteps;
pub use springs::{Along, Hinge, Spring};
pub use weld::Welded;

/// Triangles that know their place in the flat cloth.
#[derive(Clone, Debug, Default)]
pub struct Sheet {
    /// Vertices where the cloth begins, m.
    pub positions: Vec<Vec3>,
    /// Counter-clockwise seen from the cloth's face.
    pub triangles: Vec<[u32; 3]>,
    /// Where the corners of each triangle lie in the flat cloth, m: u along the weft, v along the warp. They may differ
    /// between triangles at a vertex: there is a seam.
    pub flat: Vec<[Vec2; 3]>,
}

/// Point masses, and what is between them.
#[derive(Clone, Debug, Default)]
pub struct Cloth {
    /// The triangles, or none where the cloth was made by hand.
    pub sheet: Sheet,
    /// Of each vertex, kg.
    pub masses: Vec<f32>,
    /// What resists stretch and shear.
    pub springs: Vec<Spring>,
    /// What resists bending.
    pub hinges: Vec<Hinge>,
    /// Friction on bodies and between layers.
    pub friction: [f32; 2],
    /// Of the cloth, m.
    pub thickness: f32,
    /// Strain at which threads stretch no further, and the bias.
    pub limits: [f32; 2],
}

/// What acts on a cloth during a step.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Acceleration of free fall, m/s².
    pub gravity: Vec3,
    /// Velocity of the air, m/s.
    pub wind: Vec3,
    /// Where the attached vertices are at its end, m, in the order in which they were given.
    pub targets: &'a [Vec3],
    /// Where bodies are at its end, in the order in which they were given.
    pub stances: &'a [Stance],
    /// For each target a unit direction along which its vertex may slide, if [`Settings::grip`] is below 1: it is slowed there, and
    /// hardly drawn back. Where there is none, or nought, it slides nowhere.
    pub slides: &'a [Vec3],
}

impl Default for Step<'_> {
    /// On Earth, in still air.
    fn default() -> Self {
        Self {
            gravity: Vec3::new(0.0, -9.80665, 0.0),
            wind: Vec3::ZERO,
            targets: &[],
            slides: &[],
            stances: &[],
        }
    }
}

/// Why something is no cloth.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ClothError {
    /// A number out of its range, or none.
    #[error("{name} of a fabric is {value} {unit}; it lies between {low} and {high} {unit}")]
    Range {
        /// Which one.
        name: &'static str,
        /// What was given.
        value: f32,
        /// Its unit.
        unit: &'static str,
        /// The least it may be.
        low: f32,
        /// And the most.
        high: f32,
    },
    /// Nothing to move.
    #[error("a cloth without {0} cannot be simulated")]
    Empty(&'static str),
    /// Lists that do not belong together.
    #[error("a cloth has {have} {what}; {want} were expected, one for each of its {each}")]
    Count {
        /// Of what.
        what: &'static str,
        /// How many there are.
        have: usize,
        /// How many there should be.
        want: usize,
        /// For each of what.
        each: &'static str,
    },
    /// An index beyond the end.
    #[error("{what} {index} of a cloth names vertex {vertex}; it has {vertices}")]
    Vertex {
        /// What names it.
        what: &'static str,
        /// Which of them.
        index: usize,
        /// The vertex.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// Not a number, or far away.
    #[error("{what} {index} of a cloth is {value}; finite numbers within 1e6 were expected")]
    Number {
        /// Of what.
        what: &'static str,
        /// Which of them.
        index: usize,
        /// What stands there.
        value: String,
    },
    /// A field of too many cells.
    #[error(
        "a body cannot be made a field in cells of {cell} m: more than none and at most {most} cells are possible"
    )]
    Cells {
        /// The edge asked for.
        cell: f32,
        /// Of cells.
        most: usize,
    },
    /// More bodies than can be told apart.
    #[error("a cloth meets at most {most} bodies; there are {have}")]
    Bodies {
        /// How many there are.
        have: usize,
        /// And may be.
        most: usize,
    },
    /// A triangle without area in the flat cloth.
    #[error("triangle {index} of a cloth has no area {place}; merge its corners or leave it out")]
    Flat {
        /// Which triangle.
        index: usize,
        /// Where.
        place: &'static str,
    },
    /// More than two triangles at an edge, or two with the same direction.
    #[error(
        "the edge between vertices {a} and {b} of a cloth has {triangles} on the same side; wind all triangles of a cloth alike, \
         and let at most two meet at an edge"
    )]
    Edge {
        /// One end.
        a: u32,
        /// The other.
        b: u32,
        /// How many, in words.
        triangles: &'static str,
    },
}

/// Stronger wind is a mistake of units, m/s.
pub const MOST_WIND: f32 = 100.0;

/// What is further away than this is a mistake of units, m.
const FAR: f32 = 1e6;

impl Cloth {
    /// The cloth of a sheet and a fabric.
    pub fn new(sheet: Sheet, fabric: &Fabric) -> Result<Self, ClothError> {
        fabric.check()?;
        sheet.check()?;
        let springs::Made { masses, springs, hinges } = springs::make(&sheet, fabric)?;
        Ok(Self {
            sheet,
            masses,
            springs,
            hinges,
            friction: [fabric.friction, fabric.layer_friction],
            thickness: fabric.thickness,
            limits: [fabric.limit, fabric.bias_limit],
        })
    }

    /// Another cloth beside this one, which it touches as cloth of its own: as thick as the thicker of both, with the friction of the
    /// rougher, and along coarse threads as tight as the tighter.
    pub fn join(&mut self, other: Self) {
        let first = self.sheet.positions.len() as u32;
        self.sheet.join(other.sheet);
        self.masses.extend(other.masses);
        self.springs
            .extend(other.springs.into_iter().map(|s| Spring { ends: s.ends.map(|v| v + first), ..s }));
        self.hinges
            .extend(other.hinges.into_iter().map(|h| Hinge { vertices: h.vertices.map(|v| v + first), ..h }));
        self.friction = [0, 1].map(|k| self.friction[k].max(other.friction[k]));
        self.limits = [0, 1].map(|k| self.limits[k].min(other.limits[k]));
        self.thickness = self.thickness.max(other.thickness);
    }

    /// Whether a cloth that was made by hand can be simulated.
    pub fn check(&self) -> Result<(), ClothError> {
        let n = self.sheet.positions.len();
        if n == 0 {
            return Err(ClothError::Empty("vertices"));
        }
        if self.masses.len() != n {
            let (have, want) = (self.masses.len(), n);
            return Err(ClothError::Count { what: "masses", have, want, each: "vertices" });
        }
        numbers("vertex", &self.sheet.positions, |p| p.is_finite() && p.abs().max_element() <= FAR)?;
        numbers("mass", &self.masses, |m| *m > 0.0 && *m <= FAR)?;
        let good = |v: f32| v.is_finite() && v >= 0.0;
        numbers("spring", &self.springs, |s| {
            good(s.stiffness) && good(s.damper) && s.limit >= 0.0 && s.rest > 0.0 && s.rest <= FAR
        })?;
        numbers("hinge", &self.hinges, |h| {
            good(h.stiffness) && good(h.damper) && h.slopes.iter().all(|k| k.is_finite())
        })?;
        known("spring", n, self.springs.iter().map(|s| s.ends))?;
        known("hinge", n, self.hinges.iter().map(|h| h.vertices))
    }
}

impl Sheet {
    /// A rectangle of `size` metres (weft, warp), in cells of `cells`, with its first corner at `corner` and its edges along
    /// `weft` and `warp` (unit vectors). Vertices run along the weft first; diagonals alternate from cell to cell, so that
    /// neither bias is preferred.
    pub fn rectangle(corner: Vec3, weft: Vec3, warp: Vec3, size: Vec2, cells: [u32; 2]) -> Self {
        let [nu, nv] = cells.map(|n| n.max(1));
        let cell = size / Vec2::new(nu as f32, nv as f32);
        let flat_of = |i: u32, j: u32| Vec2::new(i as f32, j as f32) * cell;
        let mut sheet = Self::default();
        for j in 0..=nv {
            for i in 0..=nu {
                let at = flat_of(i, j);
                sheet.positions.push(corner + weft * at.x + warp * at.y);
            }
        }
        for j in 0..nv {
            for i in 0..nu {
                let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let halves = if (i + j) % 2 == 0 { [[0, 1, 2], [0, 2, 3]] } else { [[0, 1, 3], [1, 2, 3]] };
                for half in halves {
                    let half = half.map(|k| corners[k]);
                    sheet.triangles.push(half.map(|(i, j)| j * (nu + 1) + i));
                    sheet.flat.push(half.map(|(i, j)| flat_of(i, j)));
                }
            }
        }
        sheet
    }

    /// Another sheet beside this one, behind it in all lists.
    pub fn join(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
        self.flat.extend(other.flat);
    }

    fn check(&self) -> Result<(), ClothError> {
        let n = self.positions.len();
        if n == 0 || self.triangles.is_empty() {
            return Err(ClothError::Empty(if n == 0 { "vertices" } else { "triangles" }));
        }
        if self.flat.len() != self.triangles.len() {
            let (have, want) = (self.flat.len(), self.triangles.len());
            return Err(ClothError::Count { what: "flat triangles", have, want, each: "triangles" });
        }
        numbers("vertex", &self.positions, |p| p.is_finite() && p.abs().max_element() <= FAR)?;
        numbers("flat triangle", &self.flat, |t| {
            t.iter().all(|p| p.is_finite() && p.abs().max_element() <= FAR)
        })?;
        known("triangle", n, self.triangles.iter().copied())
    }
}

fn numbers<T: std::fmt::Debug>(
    what: &'static str,
    all: &[T],
    good: impl Fn(&T) -> bool,
) -> Result<(), ClothError> {
    match all.iter().position(|v| !good(v)) {
        Some(index) => Err(ClothError::Number { what, index, value: format!("{:?}", all[index]) }),
        None => Ok(()),
    }
}

fn known<const N: usize>(
    what: &'static str,
    vertices: usize,
    all: impl Iterator<Item = [u32; N]>,
) -> Result<(), ClothError> {
    for (index, stencil) in all.enumerate() {
        if let Some(&vertex) = stencil.iter().find(|v| **v as usize >= vertices) {
            return Err(ClothError::Vertex { what, index, vertex, vertices });
        }
    }
    Ok(())
}
