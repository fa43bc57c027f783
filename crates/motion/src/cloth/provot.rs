//! The baseline: masses, springs and dampers, explicitly.
//!
//! Provot 1995, "Deformation Constraints in a Mass-Spring Model to Describe Rigid Cloth Behavior": forces of all springs and dampers,
//! Euler's method, and after it springs that are longer than they may be are brought back to their limit. Velocity first, then
//! place (symplectic), which costs nothing and keeps the energy of an undamped cloth. Substeps are as many as stability needs.

use super::{Cloth, ClothError, Step};
use glam::Vec3;

/// A cloth as Provot has it.
pub struct Provot {
    cloth: Cloth,
    seconds: f32,
    substeps: u32,
    clamps: u32,
    inverse: Vec<f32>,
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    forces: Vec<Vec3>,
    before: Vec<Vec3>,
    attached: Vec<(u32, Vec3, Vec3)>,
}

/// Part of the longest stable step that is used: bounds hold for small strains.
const SAFETY: f32 = 0.5;

impl Provot {
    /// A cloth at rest in steps of `seconds`, with so many passes of the clamp on strain after each substep. `attached`
    /// vertices go where each step's targets are.
    ///
    /// # Errors
    /// What [`Cloth::check`] says, or an attachment to a vertex that is not there.
    pub fn new(cloth: Cloth, attached: &[u32], seconds: f32, clamps: u32) -> Result<Self, ClothError> {
        cloth.check()?;
        super::known("attachment", cloth.masses.len(), attached.iter().map(|v| [*v]))?;
        let seconds = if seconds > 0.0 { seconds.min(1.0) } else { 1.0 / 60.0 };
        let mut inverse: Vec<f32> = cloth.masses.iter().map(|m| 1.0 / m).collect();
        attached.iter().for_each(|v| inverse[*v as usize] = 0.0);
        // Gershgorin's bounds on frequencies squared, of stiffness, and on the rates of dampers.
        let mut bounds = vec![[0.0f32; 2]; inverse.len()];
        for s in &cloth.springs {
            for v in s.ends.map(|v| v as usize) {
                bounds[v][0] += 2.0 * s.stiffness * inverse[v];
                bounds[v][1] += 2.0 * s.damper * inverse[v];
            }
        }
        for b in &cloth.hinges {
            let all: f32 = b.slopes.iter().map(|k| k.abs()).sum();
            for (v, k) in b.vertices.iter().zip(b.slopes) {
                let (v, row) = (*v as usize, k.abs() * all);
                bounds[v][0] += b.stiffness * row * inverse[v];
                bounds[v][1] += b.damper * row * inverse[v];
            }
        }
        let stable = |[square, rate]: [f32; 2]| {
            let spring = if square > 0.0 { 2.0 / square.sqrt() } else { f32::INFINITY };
            let damper = if rate > 0.0 { 2.0 / rate } else { f32::INFINITY };
            spring.min(damper)
        };
        let longest = SAFETY * bounds.into_iter().map(stable).fold(f32::INFINITY, f32::min);
        // A million of them is a mistake of units, not a cloth.
        let substeps = (seconds / longest).ceil().clamp(1.0, 1e6) as u32;
        let positions = cloth.sheet.positions.clone();
        let n = positions.len();
        let attached =
            attached.iter().map(|v| (*v, positions[*v as usize], positions[*v as usize])).collect();
        Ok(Self {
            before: positions.clone(),
            positions,
            velocities: vec![Vec3::ZERO; n],
            forces: vec![Vec3::ZERO; n],
            cloth,
            seconds,
            substeps,
            clamps,
            inverse,
            attached,
        })
    }

    /// The cloth.
    pub fn cloth(&self) -> &Cloth {
        &self.cloth
    }

    /// Substeps of a step, so many as stability needs.
    pub fn substeps(&self) -> u32 {
        self.substeps
    }

    /// At least so many substeps.
    pub fn at_least(mut self, substeps: u32) -> Self {
        self.substeps = self.substeps.max(substeps);
        self
    }

    /// Where the vertices are, m.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// How fast they are, m/s.
    pub fn velocities(&self) -> &[Vec3] {
        &self.velocities
    }

    /// Puts vertices elsewhere, with velocities.
    pub fn place(&mut self, positions: &[Vec3], velocities: &[Vec3]) {
        let n = self.positions.len().min(positions.len()).min(velocities.len());
        self.positions[..n].copy_from_slice(&positions[..n]);
        self.velocities[..n].copy_from_slice(&velocities[..n]);
    }

    /// One step. Nothing is allocated. There is no wind in this model.
    pub fn step(&mut self, step: &Step<'_>) {
        for (i, (v, from, to)) in self.attached.iter_mut().enumerate() {
            *from = self.positions[*v as usize];
            *to = step.targets.get(i).copied().unwrap_or(*from);
        }
        let h = self.seconds / self.substeps as f32;
        for s in 1..=self.substeps {
            self.before.copy_from_slice(&self.positions);
            self.force();
            for i in 0..self.positions.len() {
                if self.inverse[i] > 0.0 {
                    self.velocities[i] += (step.gravity + self.forces[i] * self.inverse[i]) * h;
                    self.positions[i] += self.velocities[i] * h;
                }
            }
            for (v, from, to) in &self.attached {
                self.positions[*v as usize] = *from + (*to - *from) * (s as f32 / self.substeps as f32);
            }
            let mut clamped = false;
            for _ in 0..self.clamps {
                clamped |= self.clamp();
            }
            if clamped {
                for i in 0..self.positions.len() {
                    self.velocities[i] = (self.positions[i] - self.before[i]) / h;
                }
            } else {
                for (v, ..) in &self.attached {
                    let v = *v as usize;
                    self.velocities[v] = (self.positions[v] - self.before[v]) / h;
                }
            }
        }
    }

    fn force(&mut self) {
        let (x, v, f) = (&self.positions, &self.velocities, &mut self.forces);
        f.fill(Vec3::ZERO);
        for s in &self.cloth.springs {
            let [a, b] = s.ends.map(|v| v as usize);
            let d = x[b] - x[a];
            let length = d.length().max(1e-12);
            let n = d / length;
            let pull = n * (s.stiffness * (length - s.rest) + s.damper * n.dot(v[b] - v[a]));
            f[a] += pull;
            f[b] -= pull;
        }
        for b in &self.cloth.hinges {
            let at = b.vertices.map(|v| v as usize);
            let c = at[2];
            let of = |y: &[Vec3]| {
                (y[at[0]] - y[c]) * b.slopes[0]
                    + (y[at[1]] - y[c]) * b.slopes[1]
                    + (y[at[3]] - y[c]) * b.slopes[3]
            };
            let push = of(x) * b.stiffness + of(v) * b.damper;
            for (v, k) in at.iter().zip(b.slopes) {
                f[*v] -= push * k;
            }
        }
    }

    /// Brings springs that are too long back to their limit, one after the other; whether there was any.
    fn clamp(&mut self) -> bool {
        let mut any = false;
        for s in &self.cloth.springs {
            let [a, b] = s.ends.map(|v| v as usize);
            let (wa, wb) = (self.inverse[a], self.inverse[b]);
            let d = self.positions[b] - self.positions[a];
            let (length, longest) = (d.length(), s.rest * (1.0 + s.limit));
            if length > longest && wa + wb > 0.0 {
                let by = d * ((length - longest) / (length * (wa + wb)));
                self.positions[a] += by * wa;
                self.positions[b] -= by * wb;
                any = true;
            }
        }
        any
    }
}
