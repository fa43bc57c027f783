//! From panels and seams to triangles.

use super::{Edge, Garment, GarmentError, Panel, Seam, Side};
use crate::cloth::{self, Sheet};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// A garment in triangles, sewn.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    /// As cloth: vertices that are sewn together are one. Not yet about anybody: all positions are nought.
    pub sheet: Sheet,
    /// Of each vertex of the mesh, that of the sheet: where a seam is, several are one.
    pub vertex: Vec<u32>,
    /// (u, v) of each vertex of the mesh on the bolt, m; v runs down.
    pub uvs: Vec<Vec2>,
    /// Of the mesh, counter-clockwise seen from the face.
    pub triangles: Vec<[u32; 3]>,
    /// Of each panel, the first of its vertices in the mesh, and behind the last one all of them.
    pub panels: Vec<usize>,
    /// Rows of each panel.
    pub(super) rows: Vec<Vec<Row>>,
}

/// Vertices of a panel at one v.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub v: f32,
    /// Number of the first in the mesh.
    pub first: u32,
    /// u of each, rising.
    pub at: Vec<f32>,
}

/// The most vertices of garments that are worn together: thirty square metres in cells of a centimetre.
pub(super) const MOST: usize = 300_000;
/// Two places on a panel nearer than this are one, m.
const SAME: f32 = 1e-4;
/// Lengths of edges that are sewn to each other differ by less than this part.
const EASE: f32 = 0.02;

impl Panel {
    fn wrong(&self, problem: impl Into<String>) -> GarmentError {
        GarmentError::Panel { panel: self.name.clone(), problem: problem.into() }
    }

    fn check(&self) -> Result<(), GarmentError> {
        let numbers = self.along.iter().flat_map(|m| [m.v, m.left, m.right]);
        let numbers = numbers.chain(self.across.iter().copied()).chain(self.bolt.to_array());
        if numbers.into_iter().any(|n| !n.is_finite() || n.abs() > 100.0) {
            return Err(self.wrong("has a measure that is no number within 100 m"));
        }
        if self.across.len() < 2 || self.along.len() < 2 {
            return Err(self.wrong("has less than two marks along or across"));
        }
        let rise = self.across.windows(2).all(|m| m[1] - m[0] > SAME)
            && self.along.windows(2).all(|m| m[1].v - m[0].v > SAME);
        if !rise {
            return Err(self.wrong("has marks that do not rise"));
        }
        let (low, high) = (self.across[0], self.across[self.across.len() - 1]);
        if self.along.iter().any(|m| m.left < low - SAME || m.right > high + SAME || m.left > m.right + SAME)
        {
            return Err(self.wrong("reaches beyond its marks across, or has its left on the right"));
        }
        Ok(())
    }

    /// Numbers of the marks between which an edge lies.
    fn marks(&self, edge: &Edge) -> Result<[usize; 2], GarmentError> {
        let marks: Vec<f32> = match edge.side {
            Side::Left | Side::Right => self.along.iter().map(|m| m.v).collect(),
            Side::Top | Side::Bottom => self.across.clone(),
        };
        let find = |at: f32| {
            let found = marks.iter().position(|m| (m - at).abs() < SAME);
            found.ok_or_else(|| {
                self.wrong(format!("has no mark at {at} m, where a seam ends; it has {marks:?}"))
            })
        };
        Ok([find(edge.from)?, find(edge.to)?])
    }

    /// Lengths of an edge between marks, m, in the order of the edge.
    pub(super) fn lengths(&self, edge: &Edge) -> Result<Vec<f32>, GarmentError> {
        let [from, to] = self.marks(edge)?;
        let of = |k: usize| match edge.side {
            Side::Top | Side::Bottom => self.across[k + 1] - self.across[k],
            Side::Left | Side::Right => {
                let (a, b) = (self.along[k], self.along[k + 1]);
                let u = |m: super::Mark| if edge.side == Side::Left { m.left } else { m.right };
                Vec2::new(u(a), a.v).distance(Vec2::new(u(b), b.v))
            }
        };
        Ok(if from <= to { (from..to).map(of).collect() } else { (to..from).rev().map(of).collect() })
    }
}

/// Sets that are joined.
struct Sets(Vec<u32>);

impl Sets {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

impl Garment {
    /// Area of its pieces, m².
    pub fn area(&self) -> f32 {
        let of = |p: &Panel| -> f32 {
            p.along
                .windows(2)
                .map(|m| 0.5 * (m[1].v - m[0].v) * (m[0].right - m[0].left + m[1].right - m[1].left))
                .sum()
        };
        self.panels.iter().map(of).sum()
    }

    /// Triangles with edges of about so many metres along the threads.
    ///
    /// # Errors
    /// Panels and seams that are none.
    pub fn cut(&self, edge: f32) -> Result<Cut, GarmentError> {
        self.panels.iter().try_for_each(Panel::check)?;
        let count = f64::from(self.area()) / f64::from(edge).powi(2);
        if !((0.004..=0.1).contains(&edge) && (100.0..=MOST as f64).contains(&count)) {
            return Err(GarmentError::Edge { edge, count, most: MOST });
        }
        // Pieces of panels between marks, along first; those that are sewn together are divided alike.
        let mut first = Vec::with_capacity(self.panels.len());
        let mut pieces = 0;
        for p in &self.panels {
            first.push(pieces);
            pieces += p.along.len() - 1 + p.across.len() - 1;
        }
        let mut sets = Sets::new(pieces);
        for seam in &self.seams {
            let [a, b] = self.pieces(seam, &first)?;
            a.into_iter().zip(b).for_each(|(a, b)| sets.join(a, b));
        }
        let mut divided = vec![1usize; pieces];
        for (p, first) in self.panels.iter().zip(&first) {
            let along = p.along.windows(2).map(|m| m[1].v - m[0].v);
            let across = p.across.windows(2).map(|m| m[1] - m[0]);
            for (k, length) in along.chain(across).enumerate() {
                let root = sets.root((first + k) as u32) as usize;
                divided[root] = divided[root].max((length / edge).round() as usize);
            }
        }
        let divided: Vec<usize> = (0..pieces).map(|k| divided[sets.root(k as u32) as usize]).collect();
        let mut cut = Cut::default();
        for (p, first) in self.panels.iter().zip(&first) {
            cut.panels.push(cut.uvs.len());
            let (along, across) = divided[*first..].split_at(p.along.len() - 1);
            cut.panel(p, along, &across[..p.across.len() - 1]);
        }
        cut.panels.push(cut.uvs.len());
        let mut sewn = Sets::new(cut.uvs.len());
        for seam in &self.seams {
            let [a, b] = [&seam[0], &seam[1]].map(|e| self.vertices(&cut, e));
            let (a, b) = (a?, b?);
            a.iter().zip(&b).for_each(|(a, b)| sewn.join(*a, *b));
        }
        let mut number = vec![u32::MAX; cut.uvs.len()];
        let mut vertices = 0;
        for v in 0..cut.uvs.len() as u32 {
            let root = sewn.root(v) as usize;
            if number[root] == u32::MAX {
                number[root] = vertices;
                vertices += 1;
            }
            cut.vertex.push(number[root]);
        }
        cut.turn_shared_diagonals();
        cut.sheet = Sheet {
            positions: vec![Vec3::ZERO; vertices as usize],
            triangles: cut.triangles.iter().map(|t| t.map(|v| cut.vertex[v as usize])).collect(),
            flat: cut.triangles.iter().map(|t| t.map(|v| cut.uvs[v as usize])).collect(),
        };
        Ok(cut)
    }

    /// Of a seam, the pieces of both edges in order.
    fn pieces(&self, seam: &Seam, first: &[usize]) -> Result<[Vec<u32>; 2], GarmentError> {
        let mut both = [Vec::new(), Vec::new()];
        let mut lengths = [0.0; 2];
        for ((edge, pieces), length) in seam.iter().zip(&mut both).zip(&mut lengths) {
            let Some(p) = self.panels.get(edge.panel) else {
                let problem = format!("has no number {}: there are only {}", edge.panel, self.panels.len());
                return Err(GarmentError::Panel { panel: "of a seam".into(), problem });
            };
            let [from, to] = p.marks(edge)?;
            let start = match edge.side {
                Side::Left | Side::Right => first[edge.panel],
                Side::Top | Side::Bottom => first[edge.panel] + p.along.len() - 1,
            };
            *pieces = (from.min(to)..from.max(to)).map(|k| (start + k) as u32).collect();
            if from > to {
                pieces.reverse();
            }
            *length = p.lengths(edge)?.iter().sum();
        }
        let [have, want] = lengths;
        let name = |k: usize| self.panels[seam[k].panel].name.clone();
        if (have - want).abs() > EASE * have.max(want) || both[0].len() != both[1].len() {
            return Err(GarmentError::Seam { from: name(0), have, to: name(1), want });
        }
        Ok(both)
    }

    /// Of an edge, its vertices in the mesh in order.
    pub(super) fn vertices(&self, cut: &Cut, edge: &Edge) -> Result<Vec<u32>, GarmentError> {
        let p = &self.panels[edge.panel];
        p.marks(edge)?;
        let rows = &cut.rows[edge.panel];
        let (low, high) = (edge.from.min(edge.to) - SAME, edge.from.max(edge.to) + SAME);
        let within = |at: f32| (low..=high).contains(&at);
        let row = |r: &Row| {
            r.at.iter().enumerate().filter(|(_, u)| within(**u)).map(|(k, _)| r.first + k as u32).collect()
        };
        let mut vertices: Vec<u32> = match edge.side {
            Side::Left => rows.iter().filter(|r| within(r.v)).map(|r| r.first).collect(),
            Side::Right => {
                rows.iter().filter(|r| within(r.v)).map(|r| r.first + r.at.len() as u32 - 1).collect()
            }
            Side::Top => row(&rows[0]),
            Side::Bottom => row(&rows[rows.len() - 1]),
        };
        if edge.from > edge.to {
            vertices.reverse();
        }
        Ok(vertices)
    }
}

/// From mark to mark, evenly.
fn divide(marks: &[f32], counts: &[usize]) -> Vec<f32> {
    let mut all = vec![marks[0]];
    for (m, count) in marks.windows(2).zip(counts) {
        all.extend((1..*count).map(|k| m[0] + (m[1] - m[0]) * (k as f32 / *count as f32)));
        all.push(m[1]);
    }
    all
}

impl Cut {
    fn panel(&mut self, p: &Panel, along: &[usize], across: &[usize]) {
        let columns = divide(&p.across, across);
        let cell = (columns[columns.len() - 1] - columns[0]) / (columns.len() - 1) as f32;
        let marks: Vec<f32> = p.along.iter().map(|m| m.v).collect();
        let mut rows: Vec<Row> = Vec::new();
        let mut mark = 0;
        for (k, v) in divide(&marks, along).into_iter().enumerate() {
            let before: usize = along[..=mark.min(along.len() - 1)].iter().sum();
            if k > before {
                mark += 1;
            }
            let (a, b) = (p.along[mark], p.along[mark + 1]);
            let t = ((v - a.v) / (b.v - a.v)).clamp(0.0, 1.0);
            let (left, right) = (a.left + (b.left - a.left) * t, a.right + (b.right - a.right) * t);
            let mut at = vec![left];
            // No slivers beside a slanted edge.
            let slack = |edge: f32| {
                if columns.iter().any(|c| (c - edge).abs() < SAME) { SAME } else { 0.45 * cell }
            };
            let (low, high) = (left + slack(left), right - slack(right));
            at.extend(columns.iter().filter(|u| (low..=high).contains(*u)));
            if right - left > SAME {
                at.push(right);
            }
            let first = self.uvs.len() as u32;
            self.uvs.extend(at.iter().map(|u| p.bolt + Vec2::new(*u, v)));
            rows.push(Row { v, first, at });
        }
        for (j, two) in rows.windows(2).enumerate() {
            let (upper, lower) = (&two[0], &two[1]);
            let (mut i, mut k) = (0, 0);
            while i + 1 < upper.at.len() || k + 1 < lower.at.len() {
                let (a, b) = (upper.first + i as u32, lower.first + k as u32);
                let down = match (upper.at.get(i + 1), lower.at.get(k + 1)) {
                    // Diagonals alternate, so that neither bias is preferred.
                    (Some(u), Some(w)) if (u - w).abs() < SAME => {
                        let column = (u / cell).round() as i64;
                        (column + j as i64) % 2 == 0
                    }
                    (Some(u), Some(w)) => w < u,
                    (None, _) => true,
                    (_, None) => false,
                };
                if down {
                    self.triangles.push([a, b, b + 1]);
                    k += 1;
                } else {
                    self.triangles.push([a, b, a + 1]);
                    i += 1;
                }
            }
        }
        self.rows.push(rows);
    }

    /// Where panels are sewn along both sides of a corner, diagonals that cut the corner off in each would be one edge of four triangles.
    /// All but the first, or all where the edge is also one of a seam, go to the corner instead.
    fn turn_shared_diagonals(&mut self) {
        // Triangles by edge of the sheet, in order.
        let mut order = Vec::new();
        let mut at: HashMap<[u32; 2], Vec<(usize, usize)>> = HashMap::new();
        for (t, triangle) in self.triangles.iter().enumerate() {
            for corner in 0..3 {
                let ends = [1, 2].map(|k| self.vertex[triangle[(corner + k) % 3] as usize]);
                let triangles =
                    at.entry([ends[0].min(ends[1]), ends[0].max(ends[1])]).or_insert_with_key(|edge| {
                        order.push(*edge);
                        Vec::with_capacity(2)
                    });
                triangles.push((t, corner));
            }
        }
        for edge in order.iter().filter(|edge| at[*edge].len() > 2) {
            let sides = &at[edge];
            let ends = |(t, corner): (usize, usize)| [1, 2].map(|k| self.triangles[t][(corner + k) % 3]);
            let reversed = |[a, b]: [u32; 2]| [b, a];
            // Diagonals have a triangle of their own panel on either side.
            let mut diagonals = Vec::new();
            for (i, side) in sides.iter().enumerate() {
                let other = sides[i + 1..].iter().find(|other| ends(**other) == reversed(ends(*side)));
                diagonals.extend(other.map(|other| [*side, *other]));
            }
            let kept = usize::from(2 * diagonals.len() == sides.len());
            for [(t, corner), (u, opposite)] in diagonals.into_iter().skip(kept) {
                let [a, b] = [1, 2].map(|k| self.triangles[t][(corner + k) % 3]);
                let (c, d) = (self.triangles[t][corner], self.triangles[u][opposite]);
                self.triangles[t] = [a, d, c];
                self.triangles[u] = [d, b, c];
            }
        }
    }

    /// Another garment's beside this one's.
    pub(super) fn join(&mut self, other: Self) {
        let (mesh, sheet) = (self.uvs.len(), self.sheet.positions.len() as u32);
        self.sheet.join(other.sheet);
        self.vertex.extend(other.vertex.iter().map(|v| v + sheet));
        self.uvs.extend(other.uvs);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + mesh as u32)));
        self.panels.pop();
        self.panels.extend(other.panels.iter().map(|v| v + mesh));
        let rows = other.rows.into_iter().map(|rows| {
            rows.into_iter().map(|r| Row { first: r.first + mesh as u32, ..r }).collect::<Vec<_>>()
        });
        self.rows.extend(rows);
    }

    /// Where the vertices of the mesh are, by where those of the sheet are.
    pub fn points(&self, positions: &[Vec3]) -> Vec<Vec3> {
        self.vertex.iter().map(|v| positions[*v as usize]).collect()
    }

    /// Normals of the mesh's vertices, smooth across seams, by where those of the sheet are.
    pub fn normals(&self, positions: &[Vec3]) -> Vec<Vec3> {
        let normals = cloth::normals(&self.sheet.triangles, positions);
        self.vertex.iter().map(|v| normals[*v as usize]).collect()
    }
}
