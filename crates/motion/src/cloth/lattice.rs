//! Coarse levels: what travels slowly from spring to spring goes through lattices of a few hundred nodes first.
//!
//! Every panel of the flat cloth gets lattices of nodes along its threads, the finest four edges apart, each next one four
//! times as wide. Between two neighbours lie pieces of threads, which cannot be longer than their limit whatever the folds: so
//! lattices only ever pull, and never add stiffness to what cloth may do. In the line of Müller 2008, "Hierarchical Position
//! Based Dynamics", with threads in place of edges of a coarser mesh, and one thing more: a node is where the masses that hang at it
//! (bilinearly) have their centre, not where some vertex is. Then what moves vertices is the gradient of what is measured, a
//! projection in the metric of mass, which takes energy and gives none; nodes at points of the cloth make it tremble.

use super::Cloth;
use super::order::Order;
use super::rows::{LevelRows, split};
use super::springs::{limit_along, panels};
use super::sweep::{Link, Springs};
use glam::{DVec2, Vec4};
use std::collections::HashSet;

/// Places, or nodes, and their weights.
type Weights = super::rows::Weights;

/// A point in a triangle: places and weights.
type Sample = ([u32; 3], [f32; 3]);

/// From the coarsest on.
pub(super) struct Lattices {
    levels: Vec<Level>,
    /// Of each place, nodes of the finest level.
    reach: Vec<Weights>,
    /// Whether no node of any level is moved.
    pub idle: bool,
}

struct Level {
    /// What nodes are the centres of, one after the other: places of the finest level, nodes of the finer one.
    parts: Vec<(u32, f32)>,
    /// Ends of the nodes' parts.
    ends: Vec<u32>,
    /// What threads hang from: attached places and their weights; ends of them. They come after the nodes.
    anchors: (Vec<(u32, f32)>, Vec<u32>),
    /// Nodes of the coarser level that move it; empty for the coarsest.
    coarser: Vec<Weights>,
    threads: Springs,
    /// Where they are, and by how much they are moved; anchors included.
    at: Vec<Vec4>,
    moved: Vec<Vec4>,
}

/// Edges between nodes of the finest level, and nodes of a level between those of the next. Of 2, 3, 4, 6 and 8, four left the
/// least stretch for the time on a hanging sheet of 129 by 129.
const RATIO: f64 = 4.0;
/// No coarser level for panels with fewer cells than this.
const FEWEST: usize = 4;

/// A panel under a lattice.
struct Grid {
    low: DVec2,
    cell: DVec2,
    size: [usize; 2],
    /// Number of a node, or none; row by row.
    node: Vec<Option<u32>>,
    /// Middles between nodes that lie in the panel, counted in half cells.
    middle: HashSet<(usize, usize)>,
}

impl Grid {
    /// Where a node lies in the flat cloth.
    fn at(&self, k: usize) -> DVec2 {
        let row = self.size[0] + 1;
        self.low + DVec2::new((k % row) as f64, (k / row) as f64) * self.cell
    }

    /// Up to four nodes around a point of the flat cloth, bilinearly; the nearest where there is none.
    fn around(&self, p: DVec2) -> Vec<(u32, f64)> {
        let [nu, nv] = self.size;
        let q = (p - self.low) / self.cell;
        let [i, j] = [(q.x, nu), (q.y, nv)].map(|(q, n)| (q.floor().max(0.0) as usize).min(n - 1));
        let t = (q - DVec2::new(i as f64, j as f64)).clamp(DVec2::ZERO, DVec2::ONE);
        let mut found = Vec::new();
        for (a, b) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let weight = [1.0 - t.x, t.x][a] * [1.0 - t.y, t.y][b];
            if let Some(node) = self.node[(j + b) * (nu + 1) + i + a] {
                // A node of which the weight is nought still counts where it is the only one.
                found.push((node, weight.max(1e-9)));
            }
        }
        if found.is_empty() {
            let distance =
                |k: usize| q.distance_squared(DVec2::new((k % (nu + 1)) as f64, (k / (nu + 1)) as f64));
            let all = (0..self.node.len()).filter(|k| self.node[*k].is_some());
            let nearest = all.min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
            found.extend(nearest.and_then(|k| self.node[k]).map(|n| (n, 1.0)));
        }
        let sum: f64 = found.iter().map(|f| f.1).sum();
        found.iter_mut().for_each(|f| f.1 /= sum);
        found
    }
}

/// The four largest of several weights, with a sum of one; nought where there are none.
fn four(mut all: Vec<(u32, f64)>) -> Weights {
    all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    all.truncate(4);
    let sum: f64 = all.iter().map(|w| w.1).sum();
    let mut out = ([0; 4], [0.0; 4]);
    for (k, (node, weight)) in all.into_iter().enumerate() {
        out.0[k] = node;
        out.1[k] = (weight / sum) as f32;
    }
    out
}

/// Part of the strain limit that pieces of threads between nodes may take: edges at the limit everywhere along one would be more
/// than any cloth bears, and what one pass leaves comes on top.
const SHARE: f64 = 0.6;
/// Sweeps of a level. More made no difference to a hanging sheet.
pub(super) const SWEEPS: u32 = 2;
/// Nodes of which the centres are found as one task.
pub(super) const BLOCK: usize = 128;

impl Lattices {
    /// For a cloth whose vertices lie in this order, with inverse masses of places.
    pub fn new(cloth: &Cloth, order: &Order, inverse: &[f32]) -> Option<Self> {
        let sheet = &cloth.sheet;
        if sheet.triangles.is_empty()
            || cloth.springs.is_empty()
            || cloth.limits.iter().any(|l| !l.is_finite())
        {
            return None;
        }
        let edge = cloth.springs.iter().map(|s| f64::from(s.rest)).sum::<f64>() / cloth.springs.len() as f64;
        let panel_of = panels(sheet);
        let count = panel_of.iter().max().map_or(0, |m| *m as usize + 1);
        let flat: Vec<[DVec2; 3]> = sheet.flat.iter().map(|t| t.map(|p| p.as_dvec2())).collect();
        let mut boxes = vec![[DVec2::INFINITY, DVec2::NEG_INFINITY]; count];
        for (t, p) in flat.iter().zip(&panel_of) {
            let b = &mut boxes[*p as usize];
            t.iter().for_each(|q| *b = [b[0].min(*q), b[1].max(*q)]);
        }
        let mut pins = Vec::new();
        vertices(cloth, order, &panel_of, &flat, |place, panel, at| {
            if inverse[place] == 0.0 {
                pins.push((place as u32, panel, at));
            }
        });
        // From the finest on: a level's parts are what lies below it.
        let mut levels: Vec<Level> = Vec::new();
        let mut below: Vec<Below> = Vec::new();
        let mut reach = Vec::new();
        let mut finer: Vec<Grid> = Vec::new();
        let mut spacing = edge;
        loop {
            spacing *= RATIO;
            let (samples, grids) = lay(cloth, order, &panel_of, &flat, &boxes, spacing);
            let widest = grids.iter().flat_map(|g| g.size).max().unwrap_or(0);
            if samples.is_empty() || (widest < FEWEST && !levels.is_empty()) {
                break;
            }
            // Of each part, the nodes that it hangs at.
            let mut hang: Vec<Vec<(u32, f64)>>;
            if levels.is_empty() {
                hang = vec![Vec::new(); inverse.len()];
                let below_of = |p: usize| Below {
                    mass: cloth.masses[order.vertex[p] as usize].into(),
                    held: inverse[p] == 0.0,
                    flat: Vec::new(),
                };
                below = (0..inverse.len()).map(below_of).collect();
                vertices(cloth, order, &panel_of, &flat, |p, panel, at| {
                    hang[p].extend(grids[panel].around(at));
                    below[p].flat.push((panel as u32, at));
                });
            } else {
                hang = vec![Vec::new(); below.len()];
                for (panel, grid) in finer.iter().enumerate() {
                    for (k, node) in grid.node.iter().enumerate() {
                        if let Some(node) = node {
                            hang[*node as usize] = grids[panel].around(grid.at(k));
                        }
                    }
                }
            }
            let mut hang: Vec<Weights> = hang.into_iter().map(four).collect();
            let (level, nodes) = hold(samples, &grids, &hang, &below, &pins, inverse, cloth.limits);
            // What is attached hangs at nodes too, but is not moved by them.
            let held = hang.iter_mut().zip(&below).filter(|(_, below)| below.held);
            held.for_each(|(hang, _)| *hang = ([0; 4], [0.0; 4]));
            match levels.last_mut() {
                Some(finer) => finer.coarser = hang,
                None => reach = hang,
            }
            levels.push(level);
            (below, finer) = (nodes, grids);
            if widest < FEWEST {
                break;
            }
        }
        levels.reverse();
        (!levels.is_empty()).then_some(Self { levels, reach, idle: true })
    }

    /// Where nodes of the finest level are, [`BLOCK`] of them, for places that have moved by `u` from `x`.
    pub fn centres(&self, block: usize, x: &[Vec4], u: &[Vec4], centres: &mut [Vec4]) {
        if let Some(level) = self.levels.last() {
            centre(&level.parts, &level.ends, block * BLOCK, |p| x[p] + u[p], centres);
        }
    }

    /// Pulls nodes together where threads between them are too long, those of the finest level being at `centres`.
    pub fn solve(&mut self, centres: &[Vec4], x: &[Vec4], u: &[Vec4]) {
        let Some(finest) = self.levels.len().checked_sub(1) else { return };
        self.levels[finest].at[..centres.len()].copy_from_slice(centres);
        for l in (0..finest).rev() {
            let (coarse, fine) = self.levels.split_at_mut(l + 1);
            let level = &mut coarse[l];
            centre(&level.parts, &level.ends, 0, |p| fine[0].at[p], &mut level.at);
        }
        self.idle = true;
        for l in 0..=finest {
            let (above, level) = self.levels.split_at_mut(l);
            let level = &mut level[0];
            let (parts, ends) = &level.anchors;
            centre(parts, ends, 0, |p| x[p] + u[p], &mut level.at[level.ends.len()..]);
            level.moved.fill(Vec4::ZERO);
            if let Some(above) = above.last().filter(|_| !self.idle) {
                for (moved, weights) in level.moved.iter_mut().zip(&level.coarser) {
                    *moved = blend(&above.moved, weights);
                }
            }
            for _ in 0..SWEEPS {
                // They have no stiffness: longer than they may be is all they cannot be.
                self.idle &= !level.threads.tighten(&level.at, &mut level.moved);
            }
        }
    }

    /// By how much a place is moved.
    #[inline]
    pub fn moves(&self, place: usize) -> Vec4 {
        self.levels.last().map_or(Vec4::ZERO, |l| blend(&l.moved, &self.reach[place]))
    }

    /// Levels from the coarsest on, and of each place the nodes that move it.
    pub fn rows(&self) -> (Vec<LevelRows>, Vec<Weights>) {
        let row = |level: &Level| LevelRows {
            parts: split(&level.parts, &level.ends),
            anchors: split(&level.anchors.0, &level.anchors.1),
            coarser: level.coarser.clone(),
            threads: level.threads.rows(0),
        };
        (self.levels.iter().map(row).collect(), self.reach.clone())
    }

    /// How many nodes the finest level has.
    pub fn nodes(&self) -> usize {
        self.levels.last().map_or(0, |l| l.ends.len())
    }
}

#[inline(always)]
fn blend(moved: &[Vec4], (nodes, weights): &Weights) -> Vec4 {
    let d = |i: usize| moved[nodes[i] as usize] * weights[i];
    (d(0) + d(1)) + (d(2) + d(3))
}

/// Centres of parts, from the one numbered `first` on; each has those up to its end.
fn centre(
    parts: &[(u32, f32)],
    ends: &[u32],
    first: usize,
    of: impl Fn(usize) -> Vec4,
    centres: &mut [Vec4],
) {
    let mut from = first.checked_sub(1).map_or(0, |k| ends[k] as usize);
    for (centre, to) in centres.iter_mut().zip(&ends[first..]) {
        let parts = &parts[from..*to as usize];
        from = *to as usize;
        // From one of them, so that little is lost to rounding.
        let origin = parts.first().map_or(Vec4::ZERO, |p| of(p.0 as usize));
        let sum: Vec4 = parts.iter().map(|(p, weight)| (of(*p as usize) - origin) * *weight).sum();
        *centre = origin + sum;
    }
}

/// What a level stands on: a place or a node.
struct Below {
    mass: f64,
    held: bool,
    /// In which panels, and where in the flat cloth.
    flat: Vec<(u32, DVec2)>,
}

/// Calls with every vertex of every panel, once for each: its place, the panel, where it is in the flat cloth.
fn vertices(
    cloth: &Cloth,
    order: &Order,
    panel_of: &[u32],
    flat: &[[DVec2; 3]],
    mut with: impl FnMut(usize, usize, DVec2),
) {
    let mut seen = HashSet::new();
    for ((triangle, flat), panel) in cloth.sheet.triangles.iter().zip(flat).zip(panel_of) {
        for (v, p) in triangle.iter().zip(flat) {
            if seen.insert((*v, *panel)) {
                with(order.place[*v as usize] as usize, *panel as usize, *p);
            }
        }
    }
}

/// Nodes so far apart, or as near as divides each panel evenly, each with the triangle in which it lies: places and weights.
fn lay(
    cloth: &Cloth,
    order: &Order,
    panel_of: &[u32],
    flat: &[[DVec2; 3]],
    boxes: &[[DVec2; 2]],
    spacing: f64,
) -> (Vec<Sample>, Vec<Grid>) {
    let grid = |[low, high]: &[DVec2; 2]| {
        let size = ((*high - *low) / spacing).round().max(DVec2::ONE);
        let cell = (*high - *low) / size;
        let size = [size.x as usize, size.y as usize];
        Grid {
            low: *low,
            cell,
            size,
            node: vec![None; (size[0] + 1) * (size[1] + 1)],
            middle: HashSet::new(),
        }
    };
    let mut grids: Vec<Grid> = boxes.iter().map(grid).collect();
    // Points of a lattice twice as fine that lie in the panel: nodes and the middles between them.
    let mut at: Vec<Sample> = Vec::new();
    for ((triangle, t), panel) in cloth.sheet.triangles.iter().zip(flat).zip(panel_of) {
        let grid = &mut grids[*panel as usize];
        let q = t.map(|p| (p - grid.low) / grid.cell * 2.0);
        let (low, high) = (q[0].min(q[1]).min(q[2]), q[0].max(q[1]).max(q[2]));
        let area = (q[1] - q[0]).perp_dot(q[2] - q[0]);
        // Points on an edge count, rounding included.
        let slack = 1e-6;
        let from = (low - slack).ceil().max(DVec2::ZERO);
        let to = (high + slack).floor();
        for b in from.y as usize..=(to.y as usize).min(2 * grid.size[1]) {
            for a in from.x as usize..=(to.x as usize).min(2 * grid.size[0]) {
                let p = DVec2::new(a as f64, b as f64);
                let w = [0, 1, 2].map(|k| (q[(k + 1) % 3] - p).perp_dot(q[(k + 2) % 3] - p) / area);
                if w.iter().any(|w| *w < -slack) {
                    continue;
                }
                if a % 2 == 1 || b % 2 == 1 {
                    grid.middle.insert((a, b));
                    continue;
                }
                let node = &mut grid.node[b / 2 * (grid.size[0] + 1) + a / 2];
                if node.is_none() {
                    *node = Some(at.len() as u32);
                    at.push((triangle.map(|v| order.place[v as usize]), w.map(|w| w as f32)));
                }
            }
        }
    }
    (at, grids)
}

/// Makes a level of nodes: what each is the centre of, and threads between them.
fn hold(
    samples: Vec<Sample>,
    grids: &[Grid],
    hang: &[Weights],
    below: &[Below],
    pins: &[(u32, usize, DVec2)],
    inverse: &[f32],
    limits: [f32; 2],
) -> (Level, Vec<Below>) {
    let n = samples.len();
    let mut panel_of = vec![0; n];
    let mut flat = vec![DVec2::ZERO; n];
    for (panel, grid) in grids.iter().enumerate() {
        for (k, node) in grid.node.iter().enumerate() {
            if let Some(node) = node {
                panel_of[*node as usize] = panel as u32;
                flat[*node as usize] = grid.at(k);
            }
        }
    }
    let mut parts: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
    for (i, ((nodes, weights), below)) in hang.iter().zip(below).enumerate() {
        for (node, weight) in nodes.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
            parts[*node as usize].push((i as u32, f64::from(*weight) * below.mass));
        }
    }
    let masses: Vec<f64> = parts.iter().map(|p| p.iter().map(|p| p.1).sum()).collect();
    // Where an attached vertex has most of a node, the node is attached.
    let fixed = |(places, weights): &Sample| {
        let held = places.iter().zip(weights).filter(|(p, _)| inverse[**p as usize] == 0.0);
        held.map(|(_, w)| w).sum::<f32>() > 0.5
    };
    let held: Vec<bool> = samples.iter().zip(&masses).map(|(s, m)| fixed(s) || *m <= 0.0).collect();
    // Centres in the flat cloth, by parts of the same panel.
    let within = |i: u32, panel: u32| below[i as usize].flat.iter().find(|f| f.0 == panel).map(|f| f.1);
    let centres: Vec<DVec2> = (0..n)
        .map(|k| {
            let mine = parts[k].iter().filter_map(|(i, m)| Some((within(*i, panel_of[k])?, m)));
            let (sum, mass) = mine.fold((DVec2::ZERO, 0.0), |(s, t), (p, m)| (s + p * *m, t + m));
            if mass > 0.0 { sum / mass } else { flat[k] }
        })
        .collect();
    let weight = |k: usize| if held[k] { 0.0 } else { (1.0 / masses[k]) as f32 };
    let mut pins_of: Vec<Vec<(u32, DVec2)>> = vec![Vec::new(); n];
    for (place, panel, at) in pins {
        for (node, _) in grids[*panel].around(*at) {
            pins_of[node as usize].push((*place, *at));
        }
    }
    let mut anchors: (Vec<(u32, f32)>, Vec<u32>) = Default::default();
    let mut links = Vec::new();
    for grid in grids {
        let [nu, nv] = grid.size;
        for (k, node) in grid.node.iter().enumerate() {
            let (a, b) = ((k % (nu + 1)) as i64, (k / (nu + 1)) as i64);
            // Both threads, both diagonals.
            for (da, db) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
                let (c, d) = (a + da, b + db);
                if c > nu as i64
                    || d > nv as i64
                    || d < 0
                    || !grid.middle.contains(&((a + c) as usize, (b + d) as usize))
                {
                    continue;
                }
                let (Some(from), Some(to)) = (*node, grid.node[d as usize * (nu + 1) + c as usize]) else {
                    continue;
                };
                let (mut ends, [i, j]) = ([from, to], [from, to].map(|v| v as usize));
                let rest = match (held[i], held[j]) {
                    (true, true) => continue,
                    (false, false) => centres[i].distance(centres[j]),
                    // A thread hangs from the attached vertex that is nearest to each part of the free node; the mean of these
                    // distances is the most that lies between the centres of both.
                    (first, _) => {
                        let (hold, free) = if first { (i, j) } else { (j, i) };
                        let mut sum = (0.0, 0.0);
                        let mut by: std::collections::BTreeMap<u32, f64> = Default::default();
                        for (p, m) in &parts[free] {
                            let Some(p) = within(*p, panel_of[free]) else { continue };
                            let to = |pin: &(u32, DVec2)| pin.1.distance(p);
                            let Some(pin) = pins_of[hold].iter().min_by(|a, b| to(a).total_cmp(&to(b)))
                            else {
                                continue;
                            };
                            sum = (sum.0 + to(pin) * m, sum.1 + m);
                            *by.entry(pin.0).or_default() += m;
                        }
                        if sum.1 <= 0.0 {
                            continue;
                        }
                        anchors.0.extend(by.into_iter().map(|(place, m)| (place, (m / sum.1) as f32)));
                        anchors.1.push(anchors.0.len() as u32);
                        ends[usize::from(!first)] = (n + anchors.1.len() - 1) as u32;
                        sum.0 / sum.1
                    }
                };
                let course = DVec2::new(da as f64, db as f64) * grid.cell;
                links.push(Link {
                    ends,
                    inverse: [weight(i), weight(j)],
                    rest: rest as f32,
                    stiffness: 0.0,
                    damper: 0.0,
                    longest: (rest * (1.0 + SHARE * limit_along(course, limits))) as f32,
                });
            }
        }
    }
    let mut level = Level {
        parts: Vec::new(),
        ends: Vec::with_capacity(n),
        coarser: Vec::new(),
        threads: Springs::new(&links, &(0..n + anchors.1.len()), 1.0, 0.0),
        at: vec![Vec4::ZERO; n + anchors.1.len()],
        moved: vec![Vec4::ZERO; n + anchors.1.len()],
        anchors,
    };
    for (parts, mass) in parts.iter().zip(&masses) {
        level.parts.extend(parts.iter().map(|(i, m)| (*i, (m / mass) as f32)));
        level.ends.push(level.parts.len() as u32);
    }
    let node = |k: usize| Below { mass: masses[k], held: held[k], flat: vec![(panel_of[k], centres[k])] };
    (level, (0..n).map(node).collect())
}
