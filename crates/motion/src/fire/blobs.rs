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
    /// Places that its light towards each node of the net of [`Directivity`] comes from, m: as many for each, node after node.
    /// One that is bright is there several times. What lies deep between logs shines up and hardly to a side: from below and from
    /// beside it is seen elsewhere.
    pub points: Vec<DVec3>,
    /// Edges of the box about each point that it stands for, m.
    pub edges: DVec3,
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

    /// `count` slabs of equal light (at least one) across `axis`, lowest first, with `points` points for each direction of the
    /// net: for renderers that draw a point for a sample of light. `turn` makes of directions those of the grid. Where nothing
    /// shines slabs have no points.
    pub fn slabs(&self, count: usize, points: usize, axis: DVec3, turn: DMat3) -> Vec<Slab> {
        let count = count.max(1);
        let escape = Escape::new(self, directions().map(|(d, weight)| (turn * d, weight)));
        let mut of_block = vec![0; escape.mean.len()];
        escape.lit.iter().enumerate().for_each(|(i, &block)| of_block[block] = i);
        let mut cells: Vec<(usize, Moments)> = self.shining(&escape).collect();
        let along = |(_, cell): &(usize, Moments)| axis.dot(cell.first) / cell.weight;
        cells.sort_by(|a, b| along(a).total_cmp(&along(b)));
        let all: f64 = cells.iter().map(|(_, cell)| cell.weight).sum();
        // Of each slab: its moments, and of each block that shines how much of its light is in the slab, before any is kept,
        // and where, as a first moment.
        let none = || (Moments::NONE, vec![(0.0, DVec3::ZERO); escape.lit.len()]);
        let mut slabs: Vec<_> = (0..count).map(|_| none()).collect();
        let mut below = 0.0;
        for (block, cell) in &cells {
            let [from, to] = [below, below + cell.weight].map(|w| w / all * count as f64);
            below += cell.weight;
            for (k, (sum, light)) in
                slabs.iter_mut().enumerate().skip(from as usize).take(to as usize - from as usize + 1)
            {
                let inside = |w: f64| (w - k as f64).clamp(0.0, 1.0);
                let share = (inside(to) - inside(from)) / count as f64 * all / cell.weight;
                sum.add(cell, share);
                let own = &mut light[of_block[*block]];
                let kept = share / f64::from(escape.mean[*block]);
                *own = (own.0 + kept * cell.weight, own.1 + kept * cell.first);
            }
        }
        let cell = self.cell().as_dvec3();
        let slab = |(sum, light): (Moments, Vec<(f64, DVec3)>)| {
            let lit = || (0..).zip(&light).filter(|(_, (own, _))| *own > 0.0);
            let towards = |part: &Vec<f32>| {
                evenly(lit().map(|(i, (own, at))| (own * f64::from(part[i]), at / own)), points)
            };
            Slab {
                blob: sum.blob_of_cells(cell),
                points: escape.of_nodes().flat_map(towards).collect(),
                edges: cell * f64::from(escape.block),
                directivity: escape.directivity(light.iter().map(|(own, _)| *own)),
            }
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
}

/// `count` of these places, each as often as it weighs: systematically, the m-th stands in the middle of the m-th share.
fn evenly(places: impl Iterator<Item = (f64, DVec3)> + Clone, count: usize) -> Vec<DVec3> {
    let all: f64 = places.clone().map(|(weight, _)| weight).sum();
    let mut points = Vec::new();
    if all <= 0.0 {
        // None weighs anything, and any will do.
        return places.take(1).flat_map(|(_, at)| vec![at; count]).collect();
    }
    let mut below = 0.0;
    for (weight, at) in places {
        below += weight;
        let until = ((below / all * count as f64 + 0.5).floor() as usize).min(count);
        points.resize(until.max(points.len()), at);
    }
    // What rounding has taken.
    if let Some(last) = points.last().copied() {
        points.resize(count, last);
    }
    points
}
