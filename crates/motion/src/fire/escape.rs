//! What part of a flame's light leaves it, past its own soot and what is solid in it, by place and by direction.

use super::Grid;
use super::directivity::{Directivity, NET, NODES, first_alike};
use glam::{DVec3, UVec3, Vec3};
use std::f64::consts::TAU;

/// Blocks across the narrowest side of a grid: a tenth of the fuel bed each.
const ACROSS: u32 = 17;

/// Directions all around `axis`, across it, of equal weight.
pub(super) fn around(axis: DVec3) -> impl Iterator<Item = (DVec3, f64)> {
    let (x, y) = axis.normalize_or(DVec3::Y).any_orthonormal_pair();
    // As near to one another as those of the net.
    let sides = 2 * (NET - 1);
    (0..sides).map(move |i| {
        let (sin, cos) = (TAU * i as f64 / sides as f64).sin_cos();
        (x * cos + y * sin, 1.0 / sides as f64)
    })
}

/// What part of the light of each block of cells leaves.
pub(super) struct Escape {
    /// Cells along each edge of a block.
    pub(super) block: u32,
    /// Blocks along x, y, z.
    size: UVec3,
    /// Of each block, in the mean over the directions; x fastest.
    pub(super) mean: Vec<f32>,
    /// The blocks that shine.
    pub(super) lit: Vec<usize>,
    /// For each of the directions, what part of the light of each of these leaves towards it.
    parts: Vec<Vec<f32>>,
}

impl Escape {
    /// With the mean over `directions` of these weights.
    pub(super) fn new(grid: &Grid, directions: impl Iterator<Item = (DVec3, f64)>) -> Self {
        let block = ((grid.size.min_element() + ACROSS / 2) / ACROSS).max(1);
        let blocks = Blocks::new(grid, block);
        let mut mean = vec![0.0; blocks.light.len()];
        let lit: Vec<usize> = (0..mean.len()).filter(|&o| blocks.light[o] > 0.0).collect();
        let mut part = vec![0.0; mean.len()];
        let each = |(direction, weight): (DVec3, f64)| {
            blocks.leaving(direction, &mut part);
            let own: Vec<f32> = lit.iter().map(|&o| part[o]).collect();
            lit.iter().zip(&own).for_each(|(&o, part)| mean[o] += part * weight as f32);
            own
        };
        let parts = directions.map(each).collect();
        Self { block, size: blocks.size, mean, lit, parts }
    }

    /// In which block a cell is.
    pub(super) fn block_of(&self, cell: UVec3) -> usize {
        let at = cell / self.block;
        ((at.z * self.size.y + at.y) * self.size.x + at.x) as usize
    }

    /// For each node of the net, what part of the light of each block that shines leaves towards it; of what was made with all
    /// directions of the net.
    pub(super) fn of_nodes(&self) -> impl Iterator<Item = &Vec<f32>> {
        let mut of_node = [0; NODES];
        let mut next = 0;
        for node in 0..NODES {
            let first = first_alike(node);
            of_node[node] = if first < node { of_node[first] } else { next };
            next += usize::from(first == node);
        }
        of_node.into_iter().filter_map(|i| self.parts.get(i))
    }

    /// To which sides light shines of which the blocks that do have so much each, before any is kept; of what was made with
    /// all directions of the net.
    pub(super) fn directivity(&self, light: impl Iterator<Item = f64> + Clone) -> Directivity {
        let all: f64 = light.clone().zip(&self.lit).map(|(l, &o)| l * f64::from(self.mean[o])).sum();
        if all <= 0.0 {
            return Directivity::default();
        }
        let towards = |part: &Vec<f32>| light.clone().zip(part).map(|(l, p)| l * f64::from(*p)).sum::<f64>();
        let mut values = [0.0; NODES];
        for (value, part) in values.iter_mut().zip(self.of_nodes()) {
            *value = (towards(part) / all) as f32;
        }
        Directivity::new(values)
    }
}

/// What is needed to know how much light comes through blocks of cells.
struct Blocks {
    size: UVec3,
    edge: DVec3,
    /// Luminance of what they emit.
    light: Vec<f32>,
    /// Absorption, 1/m: of what passes, and of their own light, which comes from where there is more.
    absorption: Vec<f32>,
    own_absorption: Vec<f32>,
    /// What part of the light that comes past, and of their own, is not held up by what is solid in them.
    free: Vec<f32>,
    own: Vec<f32>,
    /// The blocks that matter: around all that shines and all that is solid, and along the longest side of the grid all of
    /// them, for the smoke above. What smoke is beside takes less than a hundredth of the light.
    range: [[usize; 2]; 3],
}

/// What part of light comes through so much absorption, and what part of what is emitted evenly within: exp(−d) and its mean
/// from nought to d. By Padé's (2, 2) of half of d, squared: within .0021 up to d = 4; exactly beyond 6, which is rare.
fn through(depth: f32) -> (f32, f32) {
    if depth > 6.0 {
        let passes = (-depth).exp();
        return (passes, (1.0 - passes) / depth);
    }
    let d = 0.5 * depth;
    let mean = 12.0 / (12.0 + d * (6.0 + d));
    let half = 1.0 - d * mean;
    (half * half, 0.5 * mean * (1.0 + half))
}

impl Blocks {
    fn new(grid: &Grid, block: u32) -> Self {
        let size = grid.size.map(|v| v.div_ceil(block));
        let count = size.element_product() as usize;
        let [mut light, mut absorption, mut own_absorption, mut solid] =
            [(); 4].map(|()| vec![0.0f32; count]);
        let weights = grid.space.luminance_weights();
        let each = 1.0 / block.pow(3) as f32;
        let mut o = 0;
        for z in 0..grid.size.z {
            for y in 0..grid.size.y {
                for x in 0..grid.size.x {
                    let b = ((z / block * size.y + y / block) * size.x + x / block) as usize;
                    let [red, green, blue, absorbs] = grid.data[o];
                    let shines = weights.dot(Vec3::new(red, green, blue)).max(0.0);
                    light[b] += shines;
                    own_absorption[b] += shines * absorbs.max(0.0);
                    absorption[b] += absorbs.max(0.0) * each;
                    solid[b] += grid.solid.get(o).copied().unwrap_or(0.0) * each;
                    o += 1;
                }
            }
        }
        for (own, light) in own_absorption.iter_mut().zip(&light) {
            *own /= light.max(f32::MIN_POSITIVE);
        }
        let mut range = [[usize::MAX, 0]; 3];
        let n = size.to_array().map(|v| v as usize);
        for o in (0..count).filter(|&o| light[o] > 0.0 || solid[o] > 0.0) {
            for (range, at) in range.iter_mut().zip([o % n[0], o / n[0] % n[1], o / (n[0] * n[1])]) {
                *range = [range[0].min(at), range[1].max(at + 1)];
            }
        }
        let edges = (grid.upper - grid.lower).to_array();
        let longest = (0..3).fold(0, |best, axis| if edges[axis] > edges[best] { axis } else { best });
        if range[longest][1] > 0 {
            range[longest] = [0, n[longest]];
        }
        let held: Vec<f32> = solid.iter().map(|f| if *f > 0.0 { f.powf(2.0 / 3.0) } else { 0.0 }).collect();
        Self {
            size,
            edge: grid.cell().as_dvec3() * f64::from(block),
            // A body that fills a part f of a block stands in the way of f^(2/3) of what passes; nothing comes out of it.
            free: held.iter().map(|held| 1.0 - held).collect(),
            own: solid.iter().map(|f| 1.0 - f).collect(),
            light,
            absorption,
            own_absorption,
            range,
        }
    }

    /// Sets what part of the light of each block leaves towards a unit direction: layer by layer from where it leaves, each
    /// looks up what comes out of the one before it between four of its blocks.
    fn leaving(&self, direction: DVec3, part: &mut [f32]) {
        let steps = (direction / self.edge).to_array();
        let a = (0..3).max_by(|i, j| steps[*i].abs().total_cmp(&steps[*j].abs())).unwrap_or(0);
        let [b, c] = [(a + 1) % 3, (a + 2) % 3];
        let [ra, rb, rc] = [a, b, c].map(|axis| self.range[axis]);
        if ra[0] >= ra[1] {
            return;
        }
        let [nx, ny, _] = self.size.to_array().map(|v| v as usize);
        let stride = [1, nx, nx * ny];
        let length = (1.0 / steps[a].abs()) as f32;
        // What comes out of the layer before, with a rim of what is outside. The way from layer to layer is not longer than a
        // block across: the axis is that of the longest step.
        let [wide, high] = [rb, rc].map(|r| r[1] - r[0] + 4);
        let mut before = vec![1.0f32; wide * high];
        let mut after = before.clone();
        let [(du, s), (dv, t)] = [steps[b], steps[c]].map(|step| {
            let across = step / steps[a].abs();
            ((across.floor() + 2.0) as usize, (across - across.floor()) as f32)
        });
        for layer in 0..ra[1] - ra[0] {
            let k = if steps[a] > 0.0 { ra[1] - 1 - layer } else { ra[0] + layer };
            for j in 0..rc[1] - rc[0] {
                let row = (k * stride[a]) + (j + rc[0]) * stride[c];
                for i in 0..rb[1] - rb[0] {
                    let v = (j + dv) * wide + i + du;
                    let between = |v: usize| before[v] + s * (before[v + 1] - before[v]);
                    let behind = between(v) + t * (between(v + wide) - between(v));
                    let o = row + (i + rb[0]) * stride[b];
                    part[o] = behind * through(self.own_absorption[o] * length).1 * self.own[o];
                    let through = through(self.absorption[o] * length).0;
                    after[(j + 2) * wide + i + 2] = behind * through * self.free[o];
                }
            }
            std::mem::swap(&mut before, &mut after);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_through_falls_exponentially() {
        for depth in (0..400).map(|i| i as f32 * 0.01).chain([5.0, 7.0, 16.0, 300.0]) {
            let (t, mean) = through(depth);
            let exact = if depth > 0.0 { -(-depth).exp_m1() / depth } else { 1.0 };
            assert!((t - (-depth).exp()).abs() < 4e-3 && (mean - exact).abs() < 4e-3, "{depth} {t} {mean}");
        }
        assert_eq!(through(f32::INFINITY), (0.0, 0.0));
    }
}
