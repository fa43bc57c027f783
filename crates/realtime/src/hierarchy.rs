//! Two levels of bounding boxes through which shaders trace rays: one tree over each mesh in its own coordinates, and
//! one over the draws of the scene.
//!
//! * Build: binned surface-area heuristic (Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies")
//!   to a binary tree, whose nodes are then opened, the largest first, until they have four children.
//! * Nodes: four boxes of eight bits a plane in 64 bytes (after Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray
//!   Traversal on GPUs Through Compressed Wide BVHs"). Rounding is outwards.
//! * A moved draw needs the top level only: [`Hierarchy::place`].
//!
//! Everything lies in one buffer of rows of four words (`hierarchy.wgsl` reads it):
//!
//! ```text
//! row 0           nodes of the top level, four rows each, the root first; room for one per draw
//!                 one instance per draw, four rows: inverse matrix and translation; root of its mesh, draw, flags
//! for each mesh   one row a triangle in the order of the leaves: three vertices and the triangle
//!                 its nodes, four rows each, the root first
//!
//! node      0: corner x y z (f32), exponents of the steps (a byte an axis)     1: four children
//!           2: bytes of lower x, lower y, lower z, upper x                     3: upper y, upper z, unused, unused
//! child     a node: its first row / 4          a leaf: 1 << 31 | (count - 1) << 29 | first row
//!           nothing: all ones                  (of the top level: count 1, the row of the instance)
//! ```

use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4, Vec4Swizzles};
use yugen_scene::prepared::{DrawRow, MeshRow, Rows, double_area_normal};

/// The traversal in WGSL. The shader that includes it supplies
/// `fn passes(draw: u32, triangle: u32, b: vec2<f32>, dir: vec3<f32>) -> f32`.
pub const HIERARCHY_WGSL: &str = include_str!("hierarchy.wgsl");

/// Entries of the shader's stack that a mesh may need, and those of the top level: together `STACK` of the shader.
const MESH_STACK: u32 = 44;
const TOP_STACK: u32 = 20;

/// Most triangles of a leaf: two bits count them.
const LEAF: usize = 4;
const BINS: usize = 16;
/// Cost of a node over that of a triangle: they fetch as many bytes, and a node's boxes are a little more arithmetic.
const NODE_COST: f32 = 1.0;
/// Subtrees of fewer triangles are not worth a thread.
const PARALLEL: usize = 1 << 14;
/// Coordinates beyond this overflow in the boxes' arithmetic.
const FARTHEST: f32 = 1e15;

const IS_LEAF: u32 = 1 << 31;
const NOTHING: u32 = u32::MAX;
/// A leaf's first row has 29 bits.
const MOST_ROWS: usize = 1 << 29;

/// Why there is no hierarchy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HierarchyError {
    /// Coordinates too large for single precision.
    #[error(
        "draw {draw} (shape {shape}) reaches {farthest:e} from the origin; at most {FARTHEST:e} can be traced: scale the scene down"
    )]
    TooFar {
        /// Index of the draw.
        draw: usize,
        /// Its shape, counted from one.
        shape: u32,
        /// Largest coordinate.
        farthest: f32,
    },
    /// More rows than leaves can point to.
    #[error(
        "{rows} rows of nodes and triangles; at most {MOST_ROWS} can be addressed: leave out or simplify meshes"
    )]
    TooMany {
        /// How many there would be.
        rows: usize,
    },
}

/// What a hierarchy holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HierarchyStats {
    /// Triangles with an area, each mesh counted once.
    pub triangles: usize,
    /// Nodes of all meshes.
    pub nodes: usize,
    /// Draws that cannot be met because their matrix flattens them.
    pub flat_draws: usize,
    /// Seconds the meshes took to build.
    pub build_seconds: f64,
}

/// The tree of a mesh: where its root is and how far it reaches.
#[derive(Clone, Copy, Debug)]
struct MeshTree {
    /// [`NOTHING`]: the mesh has no triangle with an area.
    root: u32,
    lo: Vec3,
    hi: Vec3,
}

/// The rows of the hierarchy.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    rows: Vec<[u32; 4]>,
    meshes: Vec<MeshTree>,
    top_rows: usize,
    stats: HierarchyStats,
}

impl Hierarchy {
    /// Builds the trees on at most `threads` threads; the result is the same for any number.
    pub fn build(rows: &Rows, threads: usize) -> Result<Self, HierarchyError> {
        let start = now();
        let top_rows = 8 * rows.draws.len().max(1);
        let mut this = Self {
            rows: vec![[0; 4]; top_rows],
            meshes: Vec::with_capacity(rows.meshes.len()),
            top_rows,
            stats: HierarchyStats::default(),
        };
        for mesh in &rows.meshes {
            let tree = this.mesh(rows, mesh, threads.max(1))?;
            this.meshes.push(tree);
        }
        this.stats.build_seconds = start.map_or(0.0, |s| s.elapsed().as_secs_f64());
        this.place(&rows.draws)?;
        Ok(this)
    }

    /// The rows as a shader reads them.
    pub fn rows(&self) -> &[[u32; 4]] {
        &self.rows
    }

    /// The rows that [`Hierarchy::place`] writes: the first so many.
    pub fn top_rows(&self) -> usize {
        self.top_rows
    }

    /// What it holds.
    pub fn stats(&self) -> HierarchyStats {
        self.stats
    }

    /// Builds the top level anew over `draws`, of which there may be no more than it was built with.
    pub fn place(&mut self, draws: &[DrawRow]) -> Result<(), HierarchyError> {
        let room = self.top_rows / 8;
        let draws = &draws[..draws.len().min(room)];
        self.stats.flat_draws = 0;
        let mut items = Vec::with_capacity(draws.len());
        for (i, draw) in draws.iter().enumerate() {
            let tree = self.meshes[draw.mesh as usize];
            if tree.root == NOTHING {
                continue;
            }
            let to_world = affine(draw);
            let inverse = to_world.matrix3.inverse();
            if to_world.matrix3.determinant() == 0.0 || !inverse.as_mat3().is_finite() {
                self.stats.flat_draws += 1;
                tracing::warn!(
                    draw = i,
                    shape = draw.shape,
                    "rays cannot meet a mesh that its matrix flattens"
                );
                continue;
            }
            let (lo, hi) = placed_box(&to_world, tree.lo, tree.hi);
            let farthest = lo.abs().max(hi.abs()).max_element();
            if farthest.is_nan() || farthest > FARTHEST {
                return Err(HierarchyError::TooFar { draw: i, shape: draw.shape, farthest });
            }
            items.push(Item::new(lo, hi, i as u32));
            let at = 4 * (room + i);
            for row in 0..3 {
                let r = inverse.row(row).as_vec3();
                self.rows[at + row] = bits(r.extend(to_world.translation[row] as f32));
            }
            self.rows[at + 3] = [tree.root, i as u32, draw.flags, 0];
        }
        let leaf = |_: usize, item: &Item| IS_LEAF | (4 * (room + item.index() as usize)) as u32;
        let nodes = tree(&mut items, 1, 1, TOP_STACK, 0, &leaf);
        self.rows[..4 * nodes.len()].copy_from_slice(nodes.as_flattened());
        Ok(())
    }

    /// Appends the tree of a mesh.
    fn mesh(&mut self, rows: &Rows, mesh: &MeshRow, threads: usize) -> Result<MeshTree, HierarchyError> {
        let first = mesh.first_triangle as usize;
        let triangles = &rows.triangles[first..first + mesh.triangles as usize];
        let corners = |t: &[u32; 3]| t.map(|i| Vec3::from(rows.vertices[i as usize].position));
        let mut items = Vec::with_capacity(triangles.len());
        for (i, t) in triangles.iter().enumerate() {
            let [a, b, c] = corners(t);
            // A triangle without area can be met by no ray and has no normal.
            if double_area_normal([a, b, c]) != DVec3::ZERO {
                items.push(Item::new(a.min(b).min(c), a.max(b).max(c), i as u32));
            }
        }
        if items.is_empty() {
            return Ok(MeshTree { root: NOTHING, lo: Vec3::ZERO, hi: Vec3::ZERO });
        }
        let extent = Extent::of(&items);
        let (lo, hi) = (extent.lo.xyz(), extent.hi.xyz());
        let farthest = lo.abs().max(hi.abs()).max_element();
        if farthest.is_nan() || farthest > FARTHEST {
            let named = |d: &DrawRow| d.first_triangle == mesh.first_triangle;
            let draw = rows.draws.iter().position(named).unwrap_or(0);
            let shape = rows.draws.get(draw).map_or(0, |d| d.shape);
            return Err(HierarchyError::TooFar { draw, shape, farthest });
        }
        let base = self.rows.len();
        let count = items.len();
        // A node for every leaf at most.
        let most = base + 5 * count + 4;
        if most >= MOST_ROWS {
            return Err(HierarchyError::TooMany { rows: most });
        }
        let nodes_at = base + count.next_multiple_of(4);
        let leaf = |at: usize, _: &Item| IS_LEAF | (base + at) as u32;
        let nodes = tree(&mut items, LEAF, threads, MESH_STACK, nodes_at / 4, &leaf);
        self.rows.reserve_exact(nodes_at - base + 4 * nodes.len());
        self.rows.extend(items.iter().map(|item| {
            let [a, b, c] = triangles[item.index() as usize];
            [a, b, c, mesh.first_triangle + item.index()]
        }));
        self.rows.resize(nodes_at, [0; 4]);
        self.rows.extend_from_slice(nodes.as_flattened());
        self.stats.triangles += count;
        self.stats.nodes += nodes.len();
        Ok(MeshTree { root: (nodes_at / 4) as u32, lo, hi })
    }
}

/// There is no clock in a browser's worker.
fn now() -> Option<std::time::Instant> {
    (!cfg!(target_arch = "wasm32")).then(std::time::Instant::now)
}

fn affine(draw: &DrawRow) -> DAffine3 {
    let [x, y, z] = draw.to_world.map(|r| r.map(f64::from));
    DAffine3 {
        matrix3: DMat3::from_cols_array_2d(&[[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]),
        translation: DVec3::new(x[3], y[3], z[3]),
    }
}

/// The box in the world of a mesh's box, with room for the rounding of rays on their way into the mesh.
fn placed_box(m: &DAffine3, lo: Vec3, hi: Vec3) -> (Vec3, Vec3) {
    let (lo, hi) = (lo.as_dvec3(), hi.as_dvec3());
    let (centre, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
    let centre = m.transform_point3(centre);
    let a = m.matrix3;
    let half = a.x_axis.abs() * half.x + a.y_axis.abs() * half.y + a.z_axis.abs() * half.z;
    let half = half + 4e-7 * (centre.abs() + half);
    ((centre - half).as_vec3(), (centre + half).as_vec3())
}

fn bits(v: Vec4) -> [u32; 4] {
    v.to_array().map(f32::to_bits)
}

/// What is put into a tree: a box and a number, which is the last word of its lower corner.
#[derive(Clone, Copy)]
struct Item {
    lo: Vec4,
    hi: Vec4,
}

impl Item {
    fn new(lo: Vec3, hi: Vec3, index: u32) -> Self {
        Self { lo: lo.extend(f32::from_bits(index)), hi: hi.extend(0.0) }
    }

    fn index(&self) -> u32 {
        self.lo.w.to_bits()
    }
}

/// Box of items and box of twice their centres; w is meaningless.
#[derive(Clone, Copy)]
struct Extent {
    lo: Vec4,
    hi: Vec4,
    centre_lo: Vec4,
    centre_hi: Vec4,
}

impl Extent {
    const EMPTY: Self = Self {
        lo: Vec4::INFINITY,
        hi: Vec4::NEG_INFINITY,
        centre_lo: Vec4::INFINITY,
        centre_hi: Vec4::NEG_INFINITY,
    };

    #[inline]
    fn with(self, item: &Item) -> Self {
        let c = item.lo + item.hi;
        Self {
            lo: self.lo.min(item.lo),
            hi: self.hi.max(item.hi),
            centre_lo: self.centre_lo.min(c),
            centre_hi: self.centre_hi.max(c),
        }
    }

    fn of(items: &[Item]) -> Self {
        items.iter().fold(Self::EMPTY, Self::with)
    }
}

#[inline]
fn half_area(lo: Vec4, hi: Vec4) -> f32 {
    let d = hi - lo;
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// A node of the binary tree. Children lie before their parents.
struct Binary {
    lo: Vec3,
    hi: Vec3,
    area: f32,
    /// A leaf: first item and how many; else the two children and none.
    links: [u32; 2],
    count: u32,
}

/// The nodes over `items`, which are put into the order of the leaves. `leaf` is the child word of those that begin
/// at an item, without their number; `base`: where the root will lie. The shader needs at most `stack` entries.
fn tree(
    items: &mut [Item],
    largest_leaf: usize,
    threads: usize,
    stack: u32,
    base: usize,
    leaf: &dyn Fn(usize, &Item) -> u32,
) -> Vec<[[u32; 4]; 4]> {
    if items.is_empty() {
        return vec![node_rows(&[])];
    }
    // Deeper than this everything is halved by count, and later opened evenly, so that the stack suffices.
    for halve_from in [usize::MAX, 16, 0] {
        let grow = Grow { largest_leaf, halve_from };
        let mut binary = Vec::new();
        let forks = if threads > 1 { 4 * threads } else { 1 };
        let extent = Extent::of(items);
        grow.grow(items, extent, 0, 0, forks, &mut binary);
        let mut wide = Widen { items, binary: &binary, leaf, base, even: halve_from == 0, nodes: Vec::new() };
        let (_, needed) = wide.node(binary.len() - 1);
        if needed <= stack || halve_from == 0 {
            return wide.nodes;
        }
    }
    unreachable!("the last round returns")
}

struct Grow {
    largest_leaf: usize,
    halve_from: usize,
}

/// A plane between bins: axis, first bin beyond it, and how the bins lie.
struct Plane {
    cost: f32,
    axis: usize,
    bin: u32,
    from: Vec4,
    scale: Vec4,
}

impl Plane {
    #[inline]
    fn bins(from: Vec4, scale: Vec4, item: &Item) -> [u32; 3] {
        let b = ((item.lo + item.hi - from) * scale).as_ivec4();
        [b.x, b.y, b.z].map(|b| b.clamp(0, BINS as i32 - 1) as u32)
    }
}

impl Grow {
    /// Appends the binary tree over `items` to `nodes`, children first; `first` counts the items before them. `forks`:
    /// how many threads may still be started.
    fn grow(
        &self,
        items: &mut [Item],
        extent: Extent,
        first: usize,
        depth: usize,
        forks: usize,
        nodes: &mut Vec<Binary>,
    ) {
        let n = items.len();
        let area = half_area(extent.lo, extent.hi);
        let mut node = Binary {
            lo: extent.lo.xyz(),
            hi: extent.hi.xyz(),
            area,
            links: [first as u32, 0],
            count: n as u32,
        };
        let plane = if n > 1 && depth < self.halve_from { best_plane(items, &extent) } else { None };
        let split = plane.as_ref().map_or(f32::INFINITY, |p| p.cost) + NODE_COST * area;
        if n == 1 || n <= self.largest_leaf && n as f32 * area <= split {
            nodes.push(node);
            return;
        }
        let (middle, l, r) = match plane {
            Some(plane) => partition(items, &plane),
            None => halve(items, &extent),
        };
        let (left, right) = items.split_at_mut(middle);
        let links = if forks > 1 && n >= PARALLEL {
            let mut others = Vec::new();
            std::thread::scope(|scope| {
                scope.spawn(|| self.grow(right, r, first + middle, depth + 1, forks / 2, &mut others));
                self.grow(left, l, first, depth + 1, forks - forks / 2, nodes);
            });
            let (a, moved) = (nodes.len() as u32 - 1, nodes.len() as u32);
            nodes.extend(others.into_iter().map(|mut n| {
                if n.count == 0 {
                    n.links = n.links.map(|l| l + moved);
                }
                n
            }));
            [a, nodes.len() as u32 - 1]
        } else {
            self.grow(left, l, first, depth + 1, 1, nodes);
            let a = nodes.len() as u32 - 1;
            self.grow(right, r, first + middle, depth + 1, 1, nodes);
            [a, nodes.len() as u32 - 1]
        };
        (node.links, node.count) = (links, 0);
        nodes.push(node);
    }
}

/// The cheapest of the planes between bins on the three axes; none where all centres coincide.
fn best_plane(items: &[Item], extent: &Extent) -> Option<Plane> {
    let from = extent.centre_lo;
    let size = extent.centre_hi - from;
    let usable = size.cmpgt(Vec4::ZERO) & size.cmplt(Vec4::INFINITY);
    if usable.bitmask() & 7 == 0 {
        return None;
    }
    let scale = Vec4::select(usable, Vec4::splat(BINS as f32 * 0.9999) / size, Vec4::ZERO);
    let mut bins = [[(Vec4::INFINITY, Vec4::NEG_INFINITY, 0u32); BINS]; 3];
    for item in items {
        let at = Plane::bins(from, scale, item);
        for (axis, b) in at.into_iter().enumerate() {
            let bin = &mut bins[axis][b as usize];
            *bin = (bin.0.min(item.lo), bin.1.max(item.hi), bin.2 + 1);
        }
    }
    let mut best = Plane { cost: f32::INFINITY, axis: 0, bin: 0, from, scale };
    for (axis, bins) in bins.iter().enumerate() {
        if !usable.test(axis) {
            continue;
        }
        let mut right = [0.0; BINS];
        let mut sum = (Vec4::INFINITY, Vec4::NEG_INFINITY, 0);
        let add = |s: (Vec4, Vec4, u32), b: &(Vec4, Vec4, u32)| (s.0.min(b.0), s.1.max(b.1), s.2 + b.2);
        for b in (1..BINS).rev() {
            sum = add(sum, &bins[b]);
            right[b] = if sum.2 > 0 { half_area(sum.0, sum.1) * sum.2 as f32 } else { f32::INFINITY };
        }
        sum = (Vec4::INFINITY, Vec4::NEG_INFINITY, 0);
        for b in 0..BINS - 1 {
            sum = add(sum, &bins[b]);
            if sum.2 > 0 {
                let cost = half_area(sum.0, sum.1) * sum.2 as f32 + right[b + 1];
                if cost < best.cost {
                    (best.cost, best.axis, best.bin) = (cost, axis, b as u32 + 1);
                }
            }
        }
    }
    (best.cost < f32::INFINITY).then_some(best)
}

fn partition(items: &mut [Item], plane: &Plane) -> (usize, Extent, Extent) {
    let (mut l, mut r) = (Extent::EMPTY, Extent::EMPTY);
    let (mut middle, mut end) = (0, items.len());
    while middle < end {
        let item = items[middle];
        if Plane::bins(plane.from, plane.scale, &item)[plane.axis] < plane.bin {
            l = l.with(&item);
            middle += 1;
        } else {
            r = r.with(&item);
            end -= 1;
            items.swap(middle, end);
        }
    }
    (middle, l, r)
}

fn halve(items: &mut [Item], extent: &Extent) -> (usize, Extent, Extent) {
    let d = extent.centre_hi - extent.centre_lo;
    let axis = if d.x >= d.y && d.x >= d.z { 0 } else { 1 + usize::from(d.z > d.y) };
    let middle = items.len() / 2;
    let key = |i: &Item| i.lo[axis] + i.hi[axis];
    items.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.index().cmp(&b.index())));
    let (l, r) = items.split_at(middle);
    (middle, Extent::of(l), Extent::of(r))
}

/// Turns the binary tree into one of nodes of four.
struct Widen<'a> {
    items: &'a [Item],
    binary: &'a [Binary],
    leaf: &'a dyn Fn(usize, &Item) -> u32,
    base: usize,
    /// Open both children of a node, whatever their size.
    even: bool,
    nodes: Vec<[[u32; 4]; 4]>,
}

impl Widen<'_> {
    /// Appends the node at binary node `index` and all below it; its child word, and how many entries of a stack are
    /// needed below it.
    fn node(&mut self, index: usize) -> (u32, u32) {
        let place = self.nodes.len();
        self.nodes.push([[0; 4]; 4]);
        let mut children = vec![index];
        if self.binary[index].count == 0 {
            self.open(&mut children, 0);
            if self.even {
                for slot in [1, 0] {
                    if self.binary[children[slot]].count == 0 {
                        self.open(&mut children, slot);
                    }
                }
            }
        }
        while children.len() < 4 && !self.even {
            let forks = (0..children.len()).filter(|&s| self.binary[children[s]].count == 0);
            // The first of the largest.
            let largest = forks.max_by(|&a, &b| {
                let area = |s: usize| self.binary[children[s]].area;
                area(a).total_cmp(&area(b)).then(b.cmp(&a))
            });
            let Some(slot) = largest else { break };
            self.open(&mut children, slot);
        }
        let mut below = 0;
        let mut boxes = Vec::with_capacity(4);
        for &child in &children {
            let node = &self.binary[child];
            let (lo, hi) = (node.lo, node.hi);
            let word = if node.count > 0 {
                let first = node.links[0] as usize;
                (self.leaf)(first, &self.items[first]) | (node.count - 1) << 29
            } else {
                let (word, needed) = self.node(child);
                below = below.max(needed);
                word
            };
            boxes.push((lo, hi, word));
        }
        self.nodes[place] = node_rows(&boxes);
        ((self.base + place) as u32, below + children.len() as u32 - 1)
    }

    fn open(&self, children: &mut Vec<usize>, slot: usize) {
        let [l, r] = self.binary[children[slot]].links;
        children[slot] = l as usize;
        children.push(r as usize);
    }
}

/// A node of up to four boxes with their child words. Every plane comes to lie strictly outside what it bounds, so that
/// a ray along it is not lost to rounding.
fn node_rows(children: &[(Vec3, Vec3, u32)]) -> [[u32; 4]; 4] {
    let mut words = [NOTHING; 4];
    let mut planes = [[[0u32; 4]; 3]; 2];
    let mut corner = [0f32; 3];
    let mut exponents = 0;
    for (word, child) in words.iter_mut().zip(children) {
        *word = child.2;
    }
    for axis in 0..3 {
        let least = children.iter().map(|c| c.0[axis]).fold(f32::INFINITY, f32::min);
        let most = children.iter().map(|c| c.1[axis]).fold(f32::NEG_INFINITY, f32::max);
        if least > most {
            continue;
        }
        // Some units in the last place of the largest coordinate.
        let gap = least.abs().max(most.abs()).max(1e-25) * 2f32.powi(-21);
        let from = least - gap;
        let mut exponent = (f64::from(most + gap - from) / 254.0).log2().ceil() as i32;
        loop {
            let step = 2f32.powi(exponent);
            let at = |q: u32| from + q as f32 * step;
            let mut fits = true;
            for (slot, child) in children.iter().enumerate() {
                let (lo, hi) = (child.0[axis], child.1[axis]);
                let mut q = ((lo - from) / step).floor() as u32;
                while q > 0 && at(q) >= lo {
                    q -= 1;
                }
                planes[0][axis][slot] = q;
                q = ((hi - from) / step).ceil() as u32;
                while q < 255 && at(q) <= hi {
                    q += 1;
                }
                fits &= q <= 255 && at(q) > hi;
                planes[1][axis][slot] = q;
            }
            if fits {
                break;
            }
            exponent += 1;
        }
        corner[axis] = from;
        exponents |= ((exponent + 127) as u32) << (8 * axis);
    }
    let pack = |p: [u32; 4]| p[0] | p[1] << 8 | p[2] << 16 | p[3] << 24;
    let [lo, hi] = planes.map(|p| p.map(pack));
    let [x, y, z] = corner.map(f32::to_bits);
    [[x, y, z, exponents], words, [lo[0], lo[1], lo[2], hi[0]], [hi[1], hi[2], 0, 0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;
    use yugen_scene::prepared::VertexRow;

    /// Rows of one mesh of these triangles, drawn once.
    fn rows_of(corners: &[[Vec3; 3]]) -> Rows {
        let vertex = |p: &Vec3| VertexRow {
            position: (*p).into(),
            u: 0.0,
            normal: [0.0; 3],
            v: 0.0,
            tangent: [0.0; 4],
        };
        let n = corners.len() as u32;
        Rows {
            vertices: corners.as_flattened().iter().map(vertex).collect(),
            triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            meshes: vec![MeshRow { first_vertex: 0, vertices: 3 * n, first_triangle: 0, triangles: n }],
            draws: vec![draw([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], n)],
            ..Rows::default()
        }
    }

    fn draw(to_world: [[f32; 4]; 3], triangles: u32) -> DrawRow {
        DrawRow {
            to_world,
            mesh: 0,
            first_triangle: 0,
            triangles,
            flags: 0,
            material: 0,
            shape: 1,
            emitter: u32::MAX,
            attributes: u32::MAX,
        }
    }

    fn random_vec(rng: &mut Pcg32) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| 2.0 * rng.next_f32() - 1.0))
    }

    fn soup(n: usize, size: f32, rng: &mut Pcg32) -> Vec<[Vec3; 3]> {
        (0..n)
            .map(|_| {
                let p = random_vec(rng);
                [p, p + size * random_vec(rng), p + size * random_vec(rng)]
            })
            .collect()
    }

    /// Checks the tree below the node at `row`; the triangles found, and the entries of a stack that it needs.
    fn check(rows: &[[u32; 4]], scene: &Rows, row: usize, lo: Vec3, hi: Vec3, found: &mut Vec<u32>) -> u32 {
        let [head, children, low, high] = std::array::from_fn(|i| rows[row + i]);
        let step: [f32; 3] = std::array::from_fn(|a| f32::from_bits((head[3] >> (8 * a) & 255) << 23));
        let plane = |words: [u32; 3], slot: usize| {
            Vec3::from_array(std::array::from_fn(|a| {
                f32::from_bits(head[a]) + (words[a] >> (8 * slot) & 255) as f32 * step[a]
            }))
        };
        let (mut count, mut below) = (0, 0);
        for slot in 0..4 {
            let child = children[slot];
            if child == NOTHING {
                continue;
            }
            count += 1;
            let inner_lo = plane([low[0], low[1], low[2]], slot);
            let inner_hi = plane([low[3], high[0], high[1]], slot);
            if child & IS_LEAF == 0 {
                below = below.max(check(rows, scene, 4 * child as usize, inner_lo, inner_hi, found));
                continue;
            }
            let first = (child & 0x1fff_ffff) as usize;
            for [a, b, c, triangle] in &rows[first..=first + (child >> 29 & 3) as usize] {
                assert_eq!(scene.triangles[*triangle as usize], [*a, *b, *c]);
                found.push(*triangle);
                for i in [a, b, c] {
                    let p = Vec3::from(scene.vertices[*i as usize].position);
                    assert!(p.cmpgt(inner_lo).all() && p.cmplt(inner_hi).all(), "{p} {inner_lo} {inner_hi}");
                    // Boxes above are those of all below, rounded each for itself.
                    let room = 0.02 * (hi - lo) + 1e-5 * p.abs();
                    assert!(p.cmpgt(lo - room).all() && p.cmplt(hi + room).all());
                }
            }
        }
        below + count - 1
    }

    #[test]
    fn every_triangle_lies_in_the_boxes_above_it_once_and_the_stack_suffices() {
        let mut rng = Pcg32::new(1, 1);
        let mut scenes = vec![soup(1, 0.1, &mut rng), soup(5, 0.1, &mut rng), soup(20_000, 0.02, &mut rng)];
        // All in one place; smaller and smaller towards a corner, which makes a chain; flat; far away; on a line.
        scenes.push(vec![[Vec3::X, Vec3::Y, Vec3::Z]; 3000]);
        scenes.push((0..120).map(|i| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * 0.6f32.powi(i))).collect());
        scenes.push((0..120).map(|i| [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 0.6f32.powi(i))).collect());
        scenes.push(soup(2000, 0.1, &mut rng).into_iter().map(|t| t.map(|p| p.with_z(0.0))).collect());
        scenes.push(soup(2000, 0.1, &mut rng).into_iter().map(|t| t.map(|p| p + 1e6)).collect());
        scenes.push(soup(2000, 0.1, &mut rng).into_iter().map(|t| t.map(|p| 1e-20 * p)).collect());
        scenes.push(soup(2000, 0.1, &mut rng).into_iter().map(|t| t.map(|p| 1e13 * p)).collect());
        scenes.push(
            (0..5000).map(|i| [Vec3::ZERO, Vec3::Y, Vec3::Z].map(|p| p + Vec3::X * i as f32)).collect(),
        );
        for (s, corners) in scenes.iter().enumerate() {
            let scene = rows_of(corners);
            let hierarchy = Hierarchy::build(&scene, 1).unwrap();
            assert_eq!(
                hierarchy.rows(),
                Hierarchy::build(&scene, 7).unwrap().rows(),
                "scene {s}: threads show"
            );
            let tree = hierarchy.meshes[0];
            let mut found = Vec::new();
            let needed =
                check(hierarchy.rows(), &scene, 4 * tree.root as usize, tree.lo, tree.hi, &mut found);
            found.sort_unstable();
            // Far away some lose their area.
            let area = |t: &[Vec3; 3]| double_area_normal(*t) != DVec3::ZERO;
            let want: Vec<_> = (0..corners.len() as u32).filter(|i| area(&corners[*i as usize])).collect();
            assert!(found == want, "scene {s}: {} of {}", found.len(), want.len());
            assert!(needed <= MESH_STACK, "scene {s} needs {needed}");
        }
    }

    /// Of the chain, which a surface-area heuristic takes apart one by one.
    #[test]
    fn chains_are_halved_where_the_stack_would_not_suffice() {
        let chain: Vec<_> =
            (0..120).map(|i| [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 0.6f32.powi(i))).collect();
        let mut items: Vec<_> = chain
            .iter()
            .enumerate()
            .map(|(i, t)| Item::new(t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]), i as u32))
            .collect();
        let leaf = |at: usize, _: &Item| IS_LEAF | at as u32;
        let scene = rows_of(&chain);
        for (allowed, largest_leaf) in [(60, 1), (30, 1), (12, 4)] {
            let nodes = tree(&mut items, largest_leaf, 1, allowed, 0, &leaf);
            let rows: Vec<_> = items.iter().map(|i| scene.triangles[i.index() as usize]).collect();
            let mut all: Vec<[u32; 4]> = nodes.as_flattened().to_vec();
            // Leaves point to rows from zero on: put them behind the nodes.
            let moved = all.len() as u32;
            for node in all.chunks_exact_mut(4) {
                for child in &mut node[1] {
                    if *child != NOTHING && *child & IS_LEAF != 0 {
                        *child += moved;
                    }
                }
            }
            all.extend(rows.iter().zip(&items).map(|(t, i)| [t[0], t[1], t[2], i.index()]));
            let mut found = Vec::new();
            let needed = check(&all, &scene, 0, Vec3::splat(-1.0), Vec3::splat(2.0), &mut found);
            assert!(needed <= allowed, "{needed} of {allowed}");
            assert_eq!(found.len(), chain.len());
        }
    }

    #[test]
    fn what_cannot_be_traced_is_said() {
        let far = rows_of(&[[Vec3::X, Vec3::Y, Vec3::Z].map(|p| 1e20 * p)]);
        assert!(matches!(Hierarchy::build(&far, 1), Err(HierarchyError::TooFar { draw: 0, shape: 1, .. })));
        let mut moved = rows_of(&[[Vec3::X, Vec3::Y, Vec3::Z]]);
        moved.draws[0].to_world[1][3] = -1e16;
        let error = Hierarchy::build(&moved, 1).unwrap_err();
        assert!(error.to_string().contains("e16"), "{error}");
        let mut flat = rows_of(&[[Vec3::X, Vec3::Y, Vec3::Z]]);
        flat.draws[0].to_world[1] = [0.0; 4];
        assert_eq!(Hierarchy::build(&flat, 1).unwrap().stats().flat_draws, 1);
        let nothing = Hierarchy::build(&Rows::default(), 1).unwrap();
        assert_eq!(nothing.rows()[1], [NOTHING; 4]);
    }

    #[test]
    fn the_shader_has_the_stack_that_the_builder_counts_on() {
        let all = format!("const STACK: u32 = {}u;", MESH_STACK + TOP_STACK);
        assert!(HIERARCHY_WGSL.contains(&all), "{all}");
    }
}
