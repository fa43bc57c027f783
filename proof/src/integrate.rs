//! Deterministic integration over directions, adaptive, so that a narrow lobe is not missed.
//!
//! The domain (θ, φ) is cut into a grid whose cells are split in four: first where guide directions crowd
//! (draws of the sampler, so that lobes are found wherever they are), then wherever the error estimate is
//! largest. The tree stays and serves the chi-square test as a histogram.

use glam::Vec3;
use std::collections::BinaryHeap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use yugen_optics::frame::spherical;
use yugen_optics::quadrature::gauss_legendre;

/// Where directions may lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// z ≥ 0.
    Hemisphere,
    /// All directions.
    Sphere,
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// Stop when the error estimates of all cells sum to less.
    pub tolerance: f64,
    /// Stop after about so many evaluations.
    pub budget: usize,
}

/// Points per side of the tensor Gauss rule of one cell; exact to degree 7 in θ and φ.
const POINTS: usize = 4;
/// Cells of the coarsest grid over a hemisphere, θ by φ.
const GRID: (usize, usize) = (12, 32);
/// A cell is not trusted to be better by more than this than what its parent showed: along an edge of the
/// function two estimates agree by accident, and splitting the worst first would keep all the accidents.
const INHERITED: f64 = 1.0 / 16.0;
/// A cell with more guides than this is split.
const CROWD: usize = 4;
/// Cells of π/24 · 2⁻¹⁵ are finer than `f32` directions can tell apart.
const MAX_DEPTH: u8 = 15;

#[derive(Clone, Debug)]
struct Node<const K: usize> {
    theta: [f64; 2],
    phi: [f64; 2],
    depth: u8,
    /// Integral over each quarter, by one Gauss rule each.
    quarters: [[f64; K]; 4],
    /// Difference between their sum and one rule over the whole cell: for smooth functions far above the error.
    shown: f64,
    /// The same, or what the parent showed if that is more.
    error: f64,
    /// Index of the first of four children; 0 for a leaf.
    children: u32,
}

/// A function integrated over a [`Domain`], with the cells it took.
pub struct Partition<const K: usize> {
    nodes: Vec<Node<K>>,
    rows: usize,
    theta_max: f64,
    /// Evaluations spent.
    pub evaluations: usize,
}

#[derive(PartialEq)]
struct Worst(f64, u32);
impl Eq for Worst {}
impl Ord for Worst {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}
impl PartialOrd for Worst {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// Polar angle and azimuth in [0, 2π), exact near the poles.
fn angles(w: Vec3) -> (f64, f64) {
    let [x, y, z] = w.as_dvec3().to_array();
    let phi = y.atan2(x);
    (x.hypot(y).atan2(z), if phi < 0.0 { (phi + TAU).min(TAU.next_down()) } else { phi })
}

impl<const K: usize> Partition<K> {
    /// ∫ f(w) dw, with guides where f may be narrow.
    pub fn new(domain: Domain, guides: &[Vec3], rule: Rule, f: impl Fn(Vec3) -> [f64; K]) -> Self {
        let gauss: [(f64, f64); POINTS] =
            gauss_legendre(POINTS, 0.0, 1.0).try_into().expect("the rule has as many points as asked for");
        let evaluate = |theta: [f64; 2], phi: [f64; 2]| {
            let mut sum = [0.0; K];
            for (s, ws) in gauss {
                let (sin, cos) = (theta[0] + s * (theta[1] - theta[0])).sin_cos();
                for (t, wt) in gauss {
                    let (sin_phi, cos_phi) = (phi[0] + t * (phi[1] - phi[0])).sin_cos();
                    let w = Vec3::new((sin * cos_phi) as f32, (sin * sin_phi) as f32, cos as f32);
                    for (sum, v) in sum.iter_mut().zip(f(w)) {
                        *sum += ws * wt * sin * v;
                    }
                }
            }
            sum.map(|v| v * (theta[1] - theta[0]) * (phi[1] - phi[0]))
        };
        let quarter = |theta: [f64; 2], phi: [f64; 2], i: usize| {
            let (tm, pm) = (0.5 * (theta[0] + theta[1]), 0.5 * (phi[0] + phi[1]));
            (
                if i < 2 { [theta[0], tm] } else { [tm, theta[1]] },
                if i.is_multiple_of(2) { [phi[0], pm] } else { [pm, phi[1]] },
            )
        };
        let cell = |theta: [f64; 2], phi: [f64; 2], depth: u8, coarse: [f64; K]| {
            let quarters: [[f64; K]; 4] = std::array::from_fn(|i| {
                let (t, p) = quarter(theta, phi, i);
                evaluate(t, p)
            });
            let shown = (0..K)
                .map(|k| (quarters.iter().map(|q| q[k]).sum::<f64>() - coarse[k]).abs())
                // f64::max would swallow a NaN, which must stay visible.
                .fold(0.0, |a: f64, b| if b.is_nan() { f64::NAN } else { a.max(b) });
            Node { theta, phi, depth, quarters, shown, error: shown, children: 0 }
        };

        let (rows, theta_max) = match domain {
            Domain::Hemisphere => (GRID.0, FRAC_PI_2),
            Domain::Sphere => (2 * GRID.0, PI),
        };
        let mut this = Self { nodes: Vec::new(), rows, theta_max, evaluations: 0 };
        for i in 0..rows * GRID.1 {
            let (row, column) = ((i / GRID.1) as f64, (i % GRID.1) as f64);
            let theta = [row, row + 1.0].map(|r| r / rows as f64 * theta_max);
            let phi = [column, column + 1.0].map(|c| c / GRID.1 as f64 * TAU);
            this.nodes.push(cell(theta, phi, 0, evaluate(theta, phi)));
        }
        this.evaluations += 5 * POINTS * POINTS * this.nodes.len();
        let split = |this: &mut Self, at: usize| {
            let Node { theta, phi, depth, quarters, shown, .. } = this.nodes[at];
            this.nodes[at].children = this.nodes.len() as u32;
            for (i, coarse) in quarters.into_iter().enumerate() {
                let (t, p) = quarter(theta, phi, i);
                this.nodes.push(cell(t, p, depth + 1, coarse));
            }
            let four = this.nodes.len() - 4..;
            this.nodes[four].iter_mut().for_each(|n| n.error = n.error.max(INHERITED * shown));
            this.evaluations += 16 * POINTS * POINTS;
        };

        // Guides first.
        let mut crowds: Vec<(usize, Vec<(f64, f64)>)> =
            (0..this.nodes.len()).map(|i| (i, Vec::new())).collect();
        for g in guides {
            let (theta, phi) = angles(*g);
            if theta <= theta_max {
                crowds[this.root(theta, phi)].1.push((theta, phi));
            }
        }
        while let Some((at, crowd)) = crowds.pop() {
            if crowd.len() <= CROWD || this.nodes[at].depth >= MAX_DEPTH {
                continue;
            }
            split(&mut this, at);
            let mut parts: [Vec<(f64, f64)>; 4] = Default::default();
            for (theta, phi) in crowd {
                parts[this.nodes[at].quarter_of(theta, phi)].push((theta, phi));
            }
            let first = this.nodes[at].children as usize;
            crowds.extend(parts.into_iter().enumerate().map(|(i, p)| (first + i, p)));
        }

        // Then the error estimates.
        let mut heap: BinaryHeap<Worst> = BinaryHeap::new();
        let mut total = 0.0;
        for (i, n) in this.nodes.iter().enumerate().filter(|(_, n)| n.children == 0) {
            total += n.error;
            heap.push(Worst(n.error, i as u32));
        }
        while let Some(Worst(error, at)) = heap.pop() {
            if total < rule.tolerance || this.evaluations >= rule.budget || error == 0.0 || error.is_nan() {
                break;
            }
            // Split before its turn, for a neighbour's sake.
            if this.nodes[at as usize].children != 0 {
                continue;
            }
            let mut queue = vec![at as usize];
            while let Some(at) = queue.pop() {
                let Node { theta, phi, depth, error, children, .. } = this.nodes[at];
                if children != 0 || depth >= MAX_DEPTH {
                    continue;
                }
                total -= error;
                split(&mut this, at);
                let first = this.nodes[at].children;
                for i in first..first + 4 {
                    total += this.nodes[i as usize].error;
                    heap.push(Worst(this.nodes[i as usize].error, i));
                }
                // Neighbours follow at one level's distance: an edge that clips a corner of theirs, between
                // the points of their rules, is not seen by themselves.
                let (tm, pm) = (0.5 * (theta[0] + theta[1]), 0.5 * (phi[0] + phi[1]));
                let (dt, dp) = (0.51 * (theta[1] - theta[0]), 0.51 * (phi[1] - phi[0]));
                for (t, p) in [(tm - dt, pm), (tm + dt, pm), (tm, pm - dp), (tm, pm + dp)] {
                    if t > 0.0 && t < theta_max {
                        let leaf = this.leaf(t, p.rem_euclid(TAU));
                        if this.nodes[leaf].depth < depth {
                            queue.push(leaf);
                        }
                    }
                }
            }
        }
        this
    }

    /// The integral.
    pub fn integral(&self) -> [f64; K] {
        let mut sum = [0.0; K];
        for n in self.leaves() {
            n.quarters.iter().for_each(|q| sum.iter_mut().zip(q).for_each(|(s, v)| *s += v));
        }
        sum
    }

    /// Its standard error, the estimates of the leaves taken as independent.
    pub fn error(&self) -> f64 {
        self.leaves().map(|n| n.error * n.error).sum::<f64>().sqrt()
    }

    fn leaves(&self) -> impl Iterator<Item = &Node<K>> {
        self.nodes.iter().filter(|n| n.children == 0)
    }

    fn leaf(&self, theta: f64, phi: f64) -> usize {
        let mut at = self.root(theta, phi);
        while self.nodes[at].children != 0 {
            at = self.nodes[at].children as usize + self.nodes[at].quarter_of(theta, phi);
        }
        at
    }

    fn root(&self, theta: f64, phi: f64) -> usize {
        let row = ((theta / self.theta_max * self.rows as f64) as usize).min(self.rows - 1);
        let column = ((phi / TAU * GRID.1 as f64) as usize).min(GRID.1 - 1);
        row * GRID.1 + column
    }
}

impl<const K: usize> Node<K> {
    fn quarter_of(&self, theta: f64, phi: f64) -> usize {
        2 * usize::from(theta >= 0.5 * (self.theta[0] + self.theta[1]))
            + usize::from(phi >= 0.5 * (self.phi[0] + self.phi[1]))
    }
}

/// A histogram cell: expected mass, the error of that, and its middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    pub mass: f64,
    pub error: f64,
    pub middle: Vec3,
}

/// Cells of about equal mass made from the tree.
pub(crate) struct Histogram<'a> {
    partition: &'a Partition<1>,
    /// Cell of each node; `u32::MAX` for nodes above the cells.
    cell_of: Vec<u32>,
    /// The cells.
    pub cells: Vec<Cell>,
}

impl<'a> Histogram<'a> {
    /// The largest nodes whose mass is at most `mass` (or leaves) become cells.
    pub fn new(partition: &'a Partition<1>, mass: f64) -> Self {
        let nodes = &partition.nodes;
        // Mass and squared error.
        let mut sums: Vec<[f64; 2]> =
            nodes.iter().map(|n| [n.quarters.iter().map(|q| q[0]).sum(), n.error * n.error]).collect();
        // Children always follow their parent.
        for i in (0..nodes.len()).rev().filter(|&i| nodes[i].children != 0) {
            let first = nodes[i].children as usize;
            sums[i] = sums[first..first + 4].iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        }
        let mut this = Self { partition, cell_of: vec![u32::MAX; nodes.len()], cells: Vec::new() };
        let mut stack: Vec<usize> = (0..partition.rows * GRID.1).collect();
        while let Some(i) = stack.pop() {
            let Node { theta, phi, children, .. } = nodes[i];
            if children == 0 || sums[i][0] <= mass {
                this.cell_of[i] = this.cells.len() as u32;
                let half = |[a, b]: [f64; 2]| (0.5 * (a + b)) as f32;
                let middle = spherical(half(theta), half(phi));
                this.cells.push(Cell { mass: sums[i][0], error: sums[i][1].sqrt(), middle });
            } else {
                stack.extend(children as usize..children as usize + 4);
            }
        }
        this
    }

    /// The cell a direction falls into; `None` outside the domain.
    pub fn find(&self, w: Vec3) -> Option<usize> {
        let (theta, phi) = angles(w);
        if theta > self.partition.theta_max {
            return None;
        }
        let mut at = self.partition.root(theta, phi);
        while self.cell_of[at] == u32::MAX {
            let n = &self.partition.nodes[at];
            at = n.children as usize + n.quarter_of(theta, phi);
        }
        Some(self.cell_of[at] as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_smooth_narrow_and_broken_functions() {
        let rule = Rule { tolerance: 1e-6, budget: 1_000_000 };
        let cosine = Partition::new(Domain::Hemisphere, &[], rule, |w| [f64::from(w.z), 1.0]);
        assert!((cosine.integral()[0] - PI).abs() < 1e-6 && (cosine.integral()[1] - TAU).abs() < 1e-6);
        // exp(k (cos − 1)) about an axis near the horizon of the sphere: 2π (1 − exp(−2k)) / k, width 0.003.
        let axis = Vec3::new(0.3, -0.9, 0.1).normalize();
        let k = 1e5;
        let lobe = |w: Vec3| [(-0.5 * k * w.as_dvec3().distance_squared(axis.as_dvec3())).exp() * k / TAU];
        let narrow = Partition::new(Domain::Sphere, &[axis; 8], rule, lobe);
        assert!((narrow.integral()[0] - 1.0).abs() < 1e-4, "{:?}", narrow.integral());
        let step = Partition::new(Domain::Sphere, &[], rule, |w| [f64::from(u8::from(w.dot(axis) > 0.5))]);
        let off = (step.integral()[0] - PI).abs();
        assert!(off < 1e-4 && off < 3.0 * step.error(), "{off} {}", step.error());
    }

    #[test]
    fn a_histogram_holds_all_mass_and_finds_every_direction() {
        let rule = Rule { tolerance: 1e-5, budget: 100_000 };
        let p = Partition::new(Domain::Hemisphere, &[Vec3::Z; 9], rule, |w| [f64::from(w.z) / PI]);
        let h = Histogram::new(&p, 1e-3);
        assert!((h.cells.iter().map(|c| c.mass).sum::<f64>() - 1.0).abs() < 1e-5);
        for w in [Vec3::Z, Vec3::X, -Vec3::X, -Vec3::Y, Vec3::new(0.6, -1e-9, 0.8)] {
            assert!(h.find(w).is_some(), "{w}");
        }
        assert_eq!(h.find(-Vec3::Z), None);
    }
}
