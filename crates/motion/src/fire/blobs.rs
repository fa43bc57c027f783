//! A flame as a few lights: Gaussian blobs of the light that leaves it.

use super::Grid;
use super::directivity::{Directivity, directions};
use super::escape::{Escape, around};
use glam::{DMat3, DVec3, UVec3};
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
    /// To which sides it shines.
    pub directivity: Directivity,
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
    /// Mean intensity towards all sides across `axis` (of any length), past what is solid: what is measured around a fire at
    /// the height of its flame. Its luminance is in cd.
    pub fn intensity_around(&self, axis: DVec3) -> DVec3 {
        let escape = Escape::new(self, around(axis));
        self.shining(&escape).map(|(_, cell)| cell.power).sum::<DVec3>() / (2.0 * TAU)
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
        let parts = in_order(self.parts(), axis);
        let all: f64 = parts.iter().map(|p| p.weight).sum();
        let mut below = 0.0;
        let mut sums = vec![Moments::NONE; count];
        for part in &parts {
            let at = (below + 0.5 * part.weight) / all * count as f64;
            below += part.weight;
            let at = (at - 0.5).clamp(0.0, (count - 1) as f64);
            let (slab, t) = (at.floor() as usize, at.fract());
            sums[slab].add(part, 1.0 - t);
            if t > 0.0 {
                sums[slab + 1].add(part, t);
            }
        }
        let cell = self.cell().as_dvec3();
        sums.iter().map(|s| s.blob_of_cells(cell)).collect()
    }

    /// `count` slabs of equal light (at least one) across `axis`, lowest first, with `points` points each: for renderers that
    /// draw a point for a sample of light. Where nothing shines slabs have no points.
    pub fn slabs(&self, count: usize, points: usize, axis: DVec3) -> Vec<Slab> {
        let count = count.max(1);
        let escape = Escape::new(self, directions());
        let mut of_block = vec![0; escape.mean.len()];
        escape.lit.iter().enumerate().for_each(|(i, &block)| of_block[block] = i);
        let mut cells: Vec<(usize, Moments)> = self.shining(&escape).collect();
        let along = |(_, cell): &(usize, Moments)| axis.dot(cell.first) / cell.weight;
        cells.sort_by(|a, b| along(a).total_cmp(&along(b)));
        let all: f64 = cells.iter().map(|(_, cell)| cell.weight).sum();
        // Of each slab: its moments, its points, and how much of the light of each block that shines is in it.
        let mut slabs = vec![(Moments::NONE, Vec::new(), vec![0.0; escape.lit.len()]); count];
        let mut below = 0.0;
        for (block, cell) in &cells {
            let [from, to] = [below, below + cell.weight].map(|w| w / all * count as f64);
            below += cell.weight;
            for (k, (sum, all_points, light)) in
                slabs.iter_mut().enumerate().skip(from as usize).take(to as usize - from as usize + 1)
            {
                let inside = |w: f64| (w - k as f64).clamp(0.0, 1.0);
                let [from, to] = [inside(from), inside(to)];
                let share = (to - from) / count as f64 * all / cell.weight;
                sum.add(cell, share);
                light[of_block[*block]] += share * cell.weight / f64::from(escape.mean[*block]);
                // Systematic: point m stands in the middle of the m-th share.
                let before = |w: f64| (w * points as f64 + 0.5).floor() as usize;
                let times = before(to) - before(from);
                all_points.extend(std::iter::repeat_n(cell.first / cell.weight, times));
            }
        }
        let cell = self.cell().as_dvec3();
        let slab = |(sum, mut all_points, light): (Moments, Vec<DVec3>, Vec<f64>)| {
            // What rounding has taken.
            if let Some(last) = all_points.last().copied() {
                all_points.resize(points, last);
            }
            let directivity = escape.directivity(&light);
            Slab { blob: sum.blob_of_cells(cell), points: all_points, directivity }
        };
        slabs.into_iter().map(slab).collect()
    }

    /// What leaves of the light of each cell of which any does, from below upwards, and the block of `escape` that it is in.
    fn shining(&self, escape: &Escape) -> impl Iterator<Item = (usize, Moments)> {
        let [nx, ny, nz] = self.size.to_array();
        let weights = self.space.luminance_weights().as_dvec3();
        let flux = self.flux();
        let cells =
            (0..ny).flat_map(move |y| (0..nz).flat_map(move |z| (0..nx).map(move |x| UVec3::new(x, y, z))));
        cells.filter_map(move |cell| {
            let o = ((cell.z * ny + cell.y) * nx + cell.x) as usize;
            let [r, g, b, _] = self.data[o].map(f64::from);
            if r.max(g).max(b) <= 0.0 {
                return None;
            }
            let block = escape.block_of(cell);
            let power = DVec3::new(r, g, b) * (f64::from(escape.mean[block]) * flux);
            let weight = weights.dot(power);
            let at = self.centre(cell).as_dvec3();
            let moments = Moments { power, weight, first: at * weight, second: outer(at) * weight };
            (weight > 0.0).then_some((block, moments))
        })
    }

    /// The same of cubes of two cells along each edge.
    fn parts(&self) -> Vec<Moments> {
        let size = self.size.map(|v| v.div_ceil(2));
        let mut parts = vec![Moments::NONE; size.element_product() as usize];
        for (_, cell) in self.shining(&Escape::new(self, directions())) {
            let at = ((cell.first / cell.weight).as_vec3() - self.lower) / self.cell();
            let at = (at.as_uvec3() / 2).min(size - 1);
            parts[((at.z * size.y + at.y) * size.x + at.x) as usize].add(&cell, 1.0);
        }
        parts.retain(|part| part.weight > 0.0);
        parts
    }
}

/// By the middles of their light along an axis.
fn in_order(mut parts: Vec<Moments>, axis: DVec3) -> Vec<Moments> {
    let along = |part: &Moments| axis.dot(part.first) / part.weight;
    parts.sort_by(|a, b| along(a).total_cmp(&along(b)));
    parts
}
