//! A flame as a few lights: Gaussian blobs of the light that leaves it.

use super::Grid;
use glam::{DMat3, DVec3, UVec3, Vec3};
use std::f64::consts::TAU;

/// A part of a flame as a light: its flux, and where it comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blob {
    /// Flux, RGB in the grid's space; its luminance is in lm, and a 4π-th of it is the intensity, cd.
    pub power: DVec3,
    /// Its middle, by luminance, m.
    pub mean: DVec3,
    /// Covariance about it, m²; symmetric.
    pub covariance: DMat3,
}

/// A part of a flame as a light: its flux, and points from which equal shares of it come.
#[derive(Clone, Debug, PartialEq)]
pub struct Slab {
    /// All of it together.
    pub blob: Blob,
    /// Middles of cells, m. One that is bright is there several times.
    pub points: Vec<DVec3>,
    /// To which sides it shines: as the whole flame does.
    pub directivity: Directivity,
}

/// Intensity by direction over its mean, in spherical harmonics up to the second degree. What absorbs its own light shines
/// where it is broad: a flame more to the sides than up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directivity {
    /// First degree.
    pub linear: DVec3,
    /// Second degree: symmetric, without trace.
    pub quadratic: DMat3,
}

impl Default for Directivity {
    fn default() -> Self {
        Self { linear: DVec3::ZERO, quadratic: DMat3::ZERO }
    }
}

impl Directivity {
    /// Towards a unit direction, away from the flame.
    pub fn towards(&self, direction: DVec3) -> f64 {
        (1.0 + self.linear.dot(direction) + direction.dot(self.quadratic * direction)).max(0.0)
    }
}

/// Light of some cells: moments about the origin.
#[derive(Clone, Copy)]
struct Moments {
    power: DVec3,
    weight: f64,
    first: DVec3,
    second: DMat3,
}

impl Moments {
    /// Of nothing. (The default of a matrix is the identity.)
    const NONE: Self = Self { power: DVec3::ZERO, weight: 0.0, first: DVec3::ZERO, second: DMat3::ZERO };

    fn add(&mut self, other: &Self, share: f64) {
        self.power += other.power * share;
        self.weight += other.weight * share;
        self.first += other.first * share;
        self.second += other.second * share;
    }

    fn blob(&self) -> Blob {
        if self.weight <= 0.0 {
            return Blob { power: DVec3::ZERO, mean: DVec3::ZERO, covariance: DMat3::ZERO };
        }
        let mean = self.first / self.weight;
        Blob { power: self.power, mean, covariance: self.second * (1.0 / self.weight) - outer(mean) }
    }

    /// The same of cells with these edges: one is as wide as it is, also where it is alone.
    fn blob_of_cells(&self, cell: DVec3) -> Blob {
        let mut blob = self.blob();
        blob.covariance += DMat3::from_diagonal((cell * cell) / 12.0);
        blob
    }
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

impl Grid {
    /// What part of each cell's light leaves the grid, past what is solid: the mean over the directions of [`Grid::power`], in
    /// which neighbours hand on what comes through. And how much of all light leaves to each side.
    fn escape(&self) -> (Vec<f32>, Directivity) {
        let size = self.size.to_array().map(|v| v as i32);
        let mut escape = vec![0.0; self.data.len()];
        let (mut behind, mut through) = (escape.clone(), escape.clone());
        let index = |x: i32, y: i32, z: i32| ((z * size[1] + y) * size[0] + x) as usize;
        let weights = self.space.luminance_weights();
        let light: Vec<f32> =
            self.data.iter().map(|[r, g, b, _]| weights.dot(Vec3::new(*r, *g, *b)).max(0.0)).collect();
        let mut mean = 0.0;
        let mut directivity = Directivity::default();
        for (step, direction, weight) in self.directions() {
            let mut sum = 0.0f64;
            let length = (self.cell() * step.as_vec3()).length();
            for (t, v) in through.iter_mut().zip(&self.data) {
                *t = if v[3] > 0.0 { (-v[3] * length).exp() } else { 1.0 };
            }
            for (t, solid) in through.iter_mut().zip(&self.solid) {
                *t *= 1.0 - solid;
            }
            // From where the light leaves inwards.
            let order = |axis: usize| {
                let n = size[axis];
                (0..n).map(move |i| if step[axis] > 0 { n - 1 - i } else { i })
            };
            for z in order(2) {
                for y in order(1) {
                    for x in order(0) {
                        let (o, next) = (index(x, y, z), [x + step.x, y + step.y, z + step.z]);
                        let inside = next.iter().zip(size).all(|(i, n)| (0..n).contains(i));
                        behind[o] = if inside {
                            let next = index(next[0], next[1], next[2]);
                            behind[next] * through[next]
                        } else {
                            1.0
                        };
                        let depth = self.data[o][3] * length;
                        let own = if depth > 1e-3 { -(-depth).exp_m1() / depth } else { 1.0 - 0.5 * depth };
                        // Nothing comes out of what is solid, and half of it is in the way of the rest.
                        let solid = self.solid.get(o).copied().unwrap_or(0.0);
                        let part = behind[o] * own * (1.0 - solid) * (1.0 - 0.5 * solid);
                        escape[o] += part * weight as f32;
                        sum += f64::from(light[o] * part);
                    }
                }
            }
            let share = weight * sum;
            mean += share;
            directivity.linear += 3.0 * share * direction;
            directivity.quadratic +=
                7.5 * share * (outer(direction) - DMat3::from_diagonal(DVec3::splat(1.0 / 3.0)));
        }
        if mean > 0.0 {
            directivity.linear /= mean;
            directivity.quadratic *= 1.0 / mean;
        }
        (escape, directivity)
    }

    /// The flux that leaves the grid, by the light of each cell: what the blobs add up to. [`Grid::power`] is the same by rays.
    pub(super) fn leaving(&self) -> DVec3 {
        let sum: DVec3 = self
            .data
            .iter()
            .zip(self.escape().0)
            .map(|(v, escape)| DVec3::new(v[0].into(), v[1].into(), v[2].into()) * f64::from(escape))
            .sum();
        sum * self.flux()
    }

    /// Flux of a cell for each unit of emission, m³ sr.
    fn flux(&self) -> f64 {
        2.0 * TAU * self.cell().as_dvec3().element_product()
    }

    /// `count` blobs (at least one) that give the light of the grid together, lowest first: slabs of equal light across
    /// `axis` (up, or where the wind bends a flame to), each with the mean and covariance of its light. Light between the
    /// middles of two slabs is shared by both, so that blobs change as smoothly as the flame; a mixture fitted by expectation
    /// and maximisation jumps. Power, mean and second moments of the whole are kept.
    pub fn blobs(&self, count: usize, axis: DVec3) -> Vec<Blob> {
        let count = count.max(1);
        let parts = self.parts(2).0;
        let all: f64 = parts.iter().map(|p| p.weight).sum();
        let mut order: Vec<(f64, usize)> =
            parts.iter().enumerate().map(|(i, p)| (axis.dot(p.first) / p.weight, i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut below = 0.0;
        let mut sums = vec![Moments::NONE; count];
        for (_, i) in order {
            let at = (below + 0.5 * parts[i].weight) / all * count as f64;
            below += parts[i].weight;
            let at = (at - 0.5).clamp(0.0, (count - 1) as f64);
            let (slab, t) = (at.floor() as usize, at.fract());
            sums[slab].add(&parts[i], 1.0 - t);
            if t > 0.0 {
                sums[slab + 1].add(&parts[i], t);
            }
        }
        let cell = self.cell().as_dvec3();
        sums.iter().map(|s| s.blob_of_cells(cell)).collect()
    }

    /// `count` slabs of equal light (at least one) across `axis`, lowest first, with `points` points each: for renderers that
    /// draw a point for a sample of light. Where nothing shines slabs have no points.
    pub fn slabs(&self, count: usize, points: usize, axis: DVec3) -> Vec<Slab> {
        let count = count.max(1);
        let (parts, directivity) = self.parts(1);
        let all: f64 = parts.iter().map(|p| p.weight).sum();
        let mut order: Vec<(f64, usize)> =
            parts.iter().enumerate().map(|(i, p)| (axis.dot(p.first) / p.weight, i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut slabs = vec![(Moments::NONE, Vec::new()); count];
        let mut below = 0.0;
        for (_, i) in order {
            let part = &parts[i];
            let [from, to] = [below, below + part.weight].map(|w| w / all * count as f64);
            below += part.weight;
            for (k, (sum, all_points)) in
                slabs.iter_mut().enumerate().skip(from as usize).take(to as usize - from as usize + 1)
            {
                let inside = |w: f64| (w - k as f64).clamp(0.0, 1.0);
                let [from, to] = [inside(from), inside(to)];
                sum.add(part, (to - from) / count as f64 * all / part.weight);
                // Systematic: point m stands in the middle of the m-th share.
                let before = |w: f64| (w * points as f64 + 0.5).floor() as usize;
                let times = before(to) - before(from);
                all_points.extend(std::iter::repeat_n(part.first / part.weight, times));
            }
        }
        let cell = self.cell().as_dvec3();
        let slab = |(sum, mut all_points): (Moments, Vec<DVec3>)| {
            // What rounding has taken.
            if let Some(last) = all_points.last().copied() {
                all_points.resize(points, last);
            }
            Slab { blob: sum.blob_of_cells(cell), points: all_points, directivity }
        };
        slabs.into_iter().map(slab).collect()
    }

    /// Moments of the light of blocks of so many cells along each axis: those that shine; and to which sides all of it does.
    fn parts(&self, block: u32) -> (Vec<Moments>, Directivity) {
        let (escape, directivity) = self.escape();
        let [nx, ny, _] = self.size.to_array().map(|v| v as usize);
        let weights = self.space.luminance_weights().as_dvec3();
        let flux = self.flux();
        let blocks = self.size.map(|v| v.div_ceil(block));
        let mut parts = Vec::new();
        for z in 0..blocks.z {
            for y in 0..blocks.y {
                for x in 0..blocks.x {
                    let first = block * UVec3::new(x, y, z);
                    let end = (first + block).min(self.size);
                    let mut part = Moments::NONE;
                    for k in first.z..end.z {
                        for j in first.y..end.y {
                            for i in first.x..end.x {
                                let o = (k as usize * ny + j as usize) * nx + i as usize;
                                let [r, g, b, _] = self.data[o].map(f64::from);
                                let power = DVec3::new(r, g, b) * (f64::from(escape[o]) * flux);
                                let weight = weights.dot(power);
                                if weight > 0.0 {
                                    let at = self.centre(UVec3::new(i, j, k)).as_dvec3();
                                    let (first, second) = (at * weight, outer(at) * weight);
                                    part.add(&Moments { power, weight, first, second }, 1.0);
                                }
                            }
                        }
                    }
                    if part.weight > 0.0 {
                        parts.push(part);
                    }
                }
            }
        }
        (parts, directivity)
    }
}
