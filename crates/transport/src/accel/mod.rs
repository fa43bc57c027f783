//! The hierarchy that rays are traced through: nodes of eight boxes, leaves of eight triangles.
//!
//! * Build: binned surface-area heuristic to a binary tree, from which the best wide nodes are picked (`build.rs`).
//! * Boxes: slabs with one fused multiply-add a plane; the ray's constants are widened so that no box is
//!   missed that the exact ray touches (`traverse.rs`).
//! * Triangles: Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection". An edge function of
//!   two triangles that share the edge has the same magnitude and opposite signs, and zero counts as
//!   inside, so no ray passes between them.
//!
//! Hits are equal bit for bit for any number of threads (the tree does not depend on it) and for both
//! kernels (AVX2 with FMA, and portable): they are one text over [`yugen_optics::lanes::Lanes`]. At equal distance the
//! smaller (shape, primitive) wins, so the order of the tree does not show either.

mod build;
mod traverse;

#[cfg(test)]
mod tests;

use glam::Vec3;

/// A half-line or a piece of one: origin + t · dir for t_min < t ≤ t_max.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where t is 0.
    pub origin: Vec3,
    /// Need not be of unit length; t counts in its lengths.
    pub dir: Vec3,
    /// Not negative. Excluded.
    pub t_min: f32,
    /// Included.
    pub t_max: f32,
}

impl Ray {
    /// From `origin` without end.
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self { origin, dir, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.dir * t
    }
}

/// An axis-parallel box. Empty where `lo > hi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub lo: Vec3,
    /// Largest corner.
    pub hi: Vec3,
}

impl Aabb {
    /// Contains nothing.
    pub const EMPTY: Self = Self { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    /// Grown to contain `p`.
    pub fn with(self, p: Vec3) -> Self {
        Self { lo: self.lo.min(p), hi: self.hi.max(p) }
    }

    /// Around both.
    pub fn union(self, b: Self) -> Self {
        Self { lo: self.lo.min(b.lo), hi: self.hi.max(b.hi) }
    }

    /// Contains nothing?
    pub fn is_empty(&self) -> bool {
        !self.lo.cmple(self.hi).all()
    }

    /// The sphere around it: centre and radius.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        if self.is_empty() {
            return (Vec3::ZERO, 0.0);
        }
        let centre = 0.5 * (self.lo + self.hi);
        (centre, centre.distance(self.hi))
    }
}

/// No instance: the hit shape is one of `Scene::shapes`.
pub const NO_INSTANCE: u32 = u32::MAX;

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Triangle: weight of the second vertex. Others: see `Geometry::surface`.
    pub u: f32,
    /// Triangle: weight of the third vertex.
    pub v: f32,
    /// Index into `Scene::shapes`, or into the instance's group.
    pub shape: u32,
    /// Index of the triangle; 0 for other shapes.
    pub primitive: u32,
    /// Index into `Scene::shapes` of the instance, or [`NO_INSTANCE`].
    pub instance: u32,
}

/// Eight child boxes and what is in them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// lo x, hi x, lo y, hi y, lo z, hi z of the eight children. Empty ones: +∞, −∞.
    bounds: [[f32; 8]; 6],
    /// 32-byte aligned, as the rows above are.
    children: [Child; 8],
}

impl Node {
    const EMPTY: Self = {
        let (p, m) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
        Self { bounds: [p, m, p, m, p, m], children: [Child::EMPTY; 8] }
    };

    fn set(&mut self, slot: usize, bounds: Aabb, child: Child) {
        for axis in 0..3 {
            self.bounds[2 * axis][slot] = bounds.lo[axis];
            self.bounds[2 * axis + 1][slot] = bounds.hi[axis];
        }
        self.children[slot] = child;
    }

    fn child_bounds(&self, slot: usize) -> Aabb {
        let b = |i: usize| self.bounds[i][slot];
        Aabb { lo: Vec3::new(b(0), b(2), b(4)), hi: Vec3::new(b(1), b(3), b(5)) }
    }
}

/// A node, a leaf of triangles, or another shape, in 32 bits: two of kind, thirty of index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub(crate) struct Child(u32);

impl Child {
    const NODE: u32 = 0;
    const BLOCK: u32 = 1 << 30;
    const OTHER: u32 = 2 << 30;
    const KIND: u32 = 3 << 30;
    const EMPTY: Self = Self(u32::MAX);
    const ROOT: Self = Self(Self::NODE);
    /// More than this many nodes, blocks or other shapes do not fit.
    const LIMIT: usize = 1 << 30;

    fn index(self) -> usize {
        (self.0 & !Self::KIND) as usize
    }
}

/// Eight triangles. Unused lanes hold NaN, which no ray meets.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Block {
    /// `vertices[corner][axis][lane]`.
    vertices: [[[f32; 8]; 3]; 3],
    shape: [u32; 8],
    primitive: [u32; 8],
}

impl Block {
    const EMPTY: Self =
        Self { vertices: [[[f32::NAN; 8]; 3]; 3], shape: [u32::MAX; 8], primitive: [u32::MAX; 8] };
}

/// What a hierarchy is built over.
pub(crate) trait Source: Sync {
    /// The corners of triangle `primitive` of `shape`.
    fn triangle(&self, shape: u32, primitive: u32) -> [Vec3; 3];
}

/// A box with what is in it: the unit of building.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item {
    /// w: shape (bits).
    lo: glam::Vec4,
    /// w: primitive (bits), [`Item::OTHER`] for a shape that is no mesh.
    hi: glam::Vec4,
}

impl Item {
    const OTHER: u32 = u32::MAX;

    pub(crate) fn triangle(corners: [Vec3; 3], shape: u32, primitive: u32) -> Self {
        let [a, b, c] = corners;
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        Self { lo: lo.extend(f32::from_bits(shape)), hi: hi.extend(f32::from_bits(primitive)) }
    }

    pub(crate) fn other(bounds: Aabb, index: u32) -> Self {
        Self {
            lo: bounds.lo.extend(f32::from_bits(index)),
            hi: bounds.hi.extend(f32::from_bits(Self::OTHER)),
        }
    }

    fn shape(&self) -> u32 {
        self.lo.w.to_bits()
    }

    fn primitive(&self) -> u32 {
        self.hi.w.to_bits()
    }

    fn is_other(&self) -> bool {
        self.primitive() == Self::OTHER
    }
}

/// Shapes that are no triangles, met by their number.
pub(crate) trait Others {
    /// Makes `best` the nearer one. `ray.t_max` is the nearest distance so far.
    fn intersect(&self, index: u32, ray: &Ray, best: &mut Option<Hit>);
    /// Is it met at all?
    fn occluded(&self, index: u32, ray: &Ray) -> bool;
}

/// Is `a` to be preferred to `b`? Nearer first, then the smaller name.
pub(crate) fn nearer(a: &Hit, b: &Option<Hit>) -> bool {
    match b {
        None => true,
        Some(b) => (a.t, a.instance, a.shape, a.primitive) < (b.t, b.instance, b.shape, b.primitive),
    }
}

/// A hierarchy over triangles and other shapes.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    bounds: Aabb,
    /// The processor has what the fast kernel needs.
    avx2: bool,
}

/// What [`Tree::validate`] counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TreeStats {
    /// Wide nodes.
    pub nodes: usize,
    /// Children in use.
    pub children: usize,
    /// Leaf blocks.
    pub blocks: usize,
    /// Triangles in them.
    pub triangles: usize,
    /// Other shapes.
    pub others: usize,
    /// Longest way from the root, in nodes.
    pub depth: usize,
    /// Expected boxes and blocks met by a random line that meets the root (surface-area heuristic).
    pub cost: f32,
}

impl Tree {
    /// The same tree for any `threads`.
    pub(crate) fn build(source: &impl Source, items: Vec<Item>, threads: usize) -> Self {
        build::build(source, items, threads)
    }

    pub(crate) fn bounds(&self) -> Aabb {
        self.bounds
    }

    pub(crate) fn node_count(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn triangle_count(&self) -> usize {
        self.blocks.iter().flat_map(|b| b.shape).filter(|&s| s != u32::MAX).count()
    }

    pub(crate) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>() + self.blocks.capacity() * size_of::<Block>()
    }

    /// Walks everything and says what is wrong: a box that does not hold what is under it, a node or block
    /// met twice or never, a tree too deep for the stack.
    pub(crate) fn validate(&self) -> Result<TreeStats, String> {
        let mut stats =
            TreeStats { nodes: self.nodes.len(), blocks: self.blocks.len(), ..Default::default() };
        if self.nodes.is_empty() {
            return if self.blocks.is_empty() { Ok(stats) } else { Err("blocks without a node".into()) };
        }
        let mut seen_nodes = vec![false; self.nodes.len()];
        let mut seen_blocks = vec![false; self.blocks.len()];
        let area = |b: Aabb| {
            let d = (b.hi - b.lo).max(Vec3::ZERO);
            d.x * d.y + d.y * d.z + d.z * d.x
        };
        let root_area = area(self.bounds).max(f32::MIN_POSITIVE);
        let mut stack = vec![(0usize, self.bounds, 1usize)];
        while let Some((index, bounds, depth)) = stack.pop() {
            stats.depth = stats.depth.max(depth);
            stats.cost += area(bounds) / root_area;
            if depth > traverse::MAX_DEPTH {
                return Err(format!("node {index} is {depth} deep"));
            }
            if std::mem::replace(&mut seen_nodes[index], true) {
                return Err(format!("node {index} has two parents"));
            }
            let node = &self.nodes[index];
            for slot in 0..8 {
                let child = node.children[slot];
                let inside = node.child_bounds(slot);
                if child == Child::EMPTY {
                    if !inside.is_empty() {
                        return Err(format!("node {index}: empty slot {slot} has a box"));
                    }
                    continue;
                }
                stats.children += 1;
                if inside.is_empty() || inside.union(bounds) != bounds {
                    return Err(format!("node {index}: child {slot} reaches out of its parent's box"));
                }
                match child.0 & Child::KIND {
                    Child::NODE => stack.push((child.index(), inside, depth + 1)),
                    Child::BLOCK => {
                        let block = &self.blocks[child.index()];
                        if std::mem::replace(&mut seen_blocks[child.index()], true) {
                            return Err(format!("block {} has two parents", child.index()));
                        }
                        stats.cost += area(inside) / root_area;
                        for lane in 0..8 {
                            if block.shape[lane] == u32::MAX {
                                continue;
                            }
                            stats.triangles += 1;
                            for corner in &block.vertices {
                                let p = Vec3::new(corner[0][lane], corner[1][lane], corner[2][lane]);
                                if !(p.is_finite() && inside.with(p) == inside) {
                                    return Err(format!("a triangle of block {} sticks out", child.index()));
                                }
                            }
                        }
                    }
                    _ => stats.others += 1,
                }
            }
        }
        if !seen_nodes.iter().chain(&seen_blocks).all(|&s| s) {
            return Err("something is not reachable from the root".into());
        }
        Ok(stats)
    }
}
