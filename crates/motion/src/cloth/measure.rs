//! What is measured on a cloth that has moved.

use super::{Along, Cloth, Spring};
use glam::{DVec3, Vec3};

/// How far springs are from their rest lengths: |length/rest − 1| at parts of them, sorted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// At half of them.
    pub median: f32,
    /// At 99.9 % of them.
    pub p999: f32,
    /// The worst.
    pub worst: f32,
}

/// Energies, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Of motion.
    pub kinetic: f64,
    /// Of height, from the origin.
    pub gravity: f64,
    /// Of springs.
    pub stretch: f64,
    /// Of hinges.
    pub bending: f64,
}

/// Unit normals of vertices at `positions`: the mean of their triangles' normals by area; upwards where there are none.
pub fn normals(triangles: &[[u32; 3]], positions: &[Vec3]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let n = (b - a).cross(c - a);
        t.iter().for_each(|v| sums[*v as usize] += n);
    }
    sums.into_iter().map(|sum| sum.normalize_or(Vec3::Y)).collect()
}

impl Energy {
    /// All together.
    pub fn sum(&self) -> f64 {
        self.kinetic + self.gravity + self.stretch + self.bending
    }
}

impl Cloth {
    /// Strain of the springs that `count`, at these positions; nought where there are none. What is not a number is
    /// the worst.
    pub fn stretch(&self, positions: &[Vec3], count: impl Fn(Along) -> bool) -> Stretch {
        let strain = |[a, b]: [u32; 2], rest: f32| {
            let s = (positions[a as usize].distance(positions[b as usize]) / rest - 1.0).abs();
            if s.is_nan() { f32::INFINITY } else { s }
        };
        let mut all: Vec<f32> =
            self.springs.iter().filter(|s| count(s.along)).map(|s| strain(s.ends, s.rest)).collect();
        all.sort_unstable_by(f32::total_cmp);
        let at = |part: f64| {
            all.get((part * (all.len().max(1) - 1) as f64).round() as usize).copied().unwrap_or(0.0)
        };
        Stretch { median: at(0.5), p999: at(0.999), worst: at(1.0) }
    }

    /// By how much longer than at rest the springs that `count` are, in parts, at 99.9 % of them; what is pushed together is shorter
    /// and counts for less than nothing. Nought where there are none.
    pub fn elongation(&self, positions: &[Vec3], count: impl Fn(&Spring) -> bool) -> f32 {
        let longer = |s: &Spring| {
            let [a, b] = s.ends.map(|v| positions[v as usize]);
            let by = a.distance(b) / s.rest - 1.0;
            if by.is_nan() { f32::INFINITY } else { by }
        };
        let mut all: Vec<f32> = self.springs.iter().filter(|s| count(s)).map(longer).collect();
        all.sort_unstable_by(f32::total_cmp);
        all.get(all.len().saturating_sub(1) * 999 / 1000).copied().unwrap_or(0.0)
    }

    /// Edges that go through triangles of which they have no corner, with the number of the triangle: where cloth passes through
    /// itself.
    pub fn crossings(&self, positions: &[Vec3]) -> Vec<([u32; 2], u32)> {
        super::crossings::crossings(positions, &self.sheet.triangles)
    }

    /// Energies at these positions and velocities.
    pub fn energy(
        &self,
        positions: &[Vec3],
        velocities: impl IntoIterator<Item = Vec3>,
        gravity: Vec3,
    ) -> Energy {
        let x: Vec<DVec3> = positions.iter().map(|p| p.as_dvec3()).collect();
        let mut energy = Energy::default();
        for ((m, x), v) in self.masses.iter().zip(&x).zip(velocities) {
            energy.kinetic += 0.5 * f64::from(*m) * v.as_dvec3().length_squared();
            energy.gravity -= f64::from(*m) * gravity.as_dvec3().dot(*x);
        }
        for s in &self.springs {
            let [a, b] = s.ends.map(|v| x[v as usize]);
            let by = a.distance(b) - f64::from(s.rest);
            energy.stretch += 0.5 * f64::from(s.stiffness) * by * by;
        }
        for b in &self.hinges {
            let mut bend = DVec3::ZERO;
            let origin = x[b.vertices[2] as usize];
            for (v, k) in b.vertices.iter().zip(b.slopes) {
                bend += (x[*v as usize] - origin) * f64::from(k);
            }
            energy.bending += 0.5 * f64::from(b.stiffness) * bend.length_squared();
        }
        energy
    }
}
