//! Binned surface-area heuristic (Wald 2007, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies") to a binary tree whose leaves fill a block, from which nodes of eight are picked so that
//! the expected number of visits is least.

use super::{Aabb, Block, Child, Item, Node, Source, Tree, traverse::MAX_DEPTH};
use glam::{Vec3, Vec4, Vec4Swizzles};
use yugen_optics::lanes::has_avx2;

const LEAF: usize = 8;
const BINS: usize = 16;
/// Below this depth of the binary tree (the wide one is never deeper) everything is halved by count, which
/// ends within 28 further levels, for there are at most 2²⁸ items.
const HALVING_DEPTH: usize = MAX_DEPTH - 28;
/// Subtrees of at least this many items may be built on a thread of their own.
const PARALLEL: usize = 1 << 14;

/// Box of the items and box of twice their centres; w is meaningless.
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

    fn of(items: &[Item]) -> Self {
        items.iter().fold(Self::EMPTY, |e, i| {
            let c = i.lo + i.hi;
            Self {
                lo: e.lo.min(i.lo),
                hi: e.hi.max(i.hi),
                centre_lo: e.centre_lo.min(c),
                centre_hi: e.centre_hi.max(c),
            }
        })
    }

    fn aabb(&self) -> Aabb {
        Aabb { lo: self.lo.xyz(), hi: self.hi.xyz() }
    }
}

fn half_area(lo: Vec4, hi: Vec4) -> f32 {
    let d = (hi - lo).xyz();
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// How many leaf blocks `n` triangles fill.
fn blocks(n: u32) -> f32 {
    n.div_ceil(LEAF as u32) as f32
}

struct Part<'a> {
    items: &'a mut [Item],
    extent: Extent,
}

impl<'a> Part<'a> {
    fn new(items: &'a mut [Item]) -> Self {
        let extent = Extent::of(items);
        Self { items, extent }
    }

    /// May it hang in a node without further splitting?
    fn is_leaf(&self) -> bool {
        self.items.len() == 1 || (self.items.len() <= LEAF && !self.items.iter().any(Item::is_other))
    }

    fn halve(self) -> (Self, Self) {
        let d = (self.extent.centre_hi - self.extent.centre_lo).xyz();
        let axis = if d.x >= d.y && d.x >= d.z { 0 } else { 1 + usize::from(d.z > d.y) };
        let mid = self.items.len() / 2;
        let key = |i: &Item| (i.lo + i.hi)[axis];
        self.items.select_nth_unstable_by(mid, |a, b| {
            key(a).total_cmp(&key(b)).then((a.shape(), a.primitive()).cmp(&(b.shape(), b.primitive())))
        });
        let (a, b) = self.items.split_at_mut(mid);
        (Self::new(a), Self::new(b))
    }

    /// The cheapest of the planes between bins on the three axes; by count where all centres coincide.
    fn split(self) -> (Self, Self) {
        let Extent { centre_lo, centre_hi, .. } = self.extent;
        let size = centre_hi - centre_lo;
        let usable = size.xyz().cmpgt(Vec3::ZERO);
        if !usable.any() || !size.xyz().is_finite() {
            return self.halve();
        }
        let scale =
            Vec4::select(size.cmpgt(Vec4::ZERO), Vec4::splat(BINS as f32 * 0.9999) / size, Vec4::ZERO);
        let bin_of = |item: &Item| {
            ((item.lo + item.hi - centre_lo) * scale)
                .xyz()
                .as_uvec3()
                .min(glam::UVec3::splat(BINS as u32 - 1))
        };

        let mut lo = [[Vec4::INFINITY; BINS]; 3];
        let mut hi = [[Vec4::NEG_INFINITY; BINS]; 3];
        let mut count = [[0u32; BINS]; 3];
        for item in self.items.iter() {
            let bin = bin_of(item).to_array();
            for axis in 0..3 {
                let b = bin[axis] as usize;
                lo[axis][b] = lo[axis][b].min(item.lo);
                hi[axis][b] = hi[axis][b].max(item.hi);
                count[axis][b] += 1;
            }
        }
        let mut best = (f32::INFINITY, 0, 0);
        for axis in 0..3 {
            if !usable.test(axis) {
                continue;
            }
            let mut right = [0.0; BINS];
            let (mut l, mut h, mut n) = (Vec4::INFINITY, Vec4::NEG_INFINITY, 0);
            for b in (1..BINS).rev() {
                l = l.min(lo[axis][b]);
                h = h.max(hi[axis][b]);
                n += count[axis][b];
                right[b] = if n > 0 { half_area(l, h) * blocks(n) } else { f32::INFINITY };
            }
            (l, h, n) = (Vec4::INFINITY, Vec4::NEG_INFINITY, 0);
            for b in 0..BINS - 1 {
                l = l.min(lo[axis][b]);
                h = h.max(hi[axis][b]);
                n += count[axis][b];
                if n > 0 {
                    let cost = half_area(l, h) * blocks(n) + right[b + 1];
                    if cost < best.0 {
                        best = (cost, axis, b as u32 + 1);
                    }
                }
            }
        }
        let (cost, axis, plane) = best;
        if cost == f32::INFINITY {
            return self.halve();
        }
        let mut mid = 0;
        let mut end = self.items.len();
        let (mut a, mut b) = (Extent::EMPTY, Extent::EMPTY);
        let grow = |e: &mut Extent, i: &Item| {
            let c = i.lo + i.hi;
            *e = Extent {
                lo: e.lo.min(i.lo),
                hi: e.hi.max(i.hi),
                centre_lo: e.centre_lo.min(c),
                centre_hi: e.centre_hi.max(c),
            };
        };
        while mid < end {
            let item = self.items[mid];
            if bin_of(&item)[axis] < plane {
                grow(&mut a, &item);
                mid += 1;
            } else {
                grow(&mut b, &item);
                end -= 1;
                self.items.swap(mid, end);
            }
        }
        let (left, right) = self.items.split_at_mut(mid);
        (Self { items: left, extent: a }, Self { items: right, extent: b })
    }
}

/// Relative costs of visiting a wide node and a leaf block: measured to be about the same.
const NODE_COST: f32 = 1.0;
const BLOCK_COST: f32 = 1.0;

/// A node of the binary tree that the wide nodes are picked from.
struct Binary {
    bounds: Aabb,
    content: Content,
    /// `cost[i]`: of all below, if it may take up to `i + 1` slots of the wide node above.
    cost: [f32; 8],
    /// `left[i]`: slots that the left child then gets; 0: the node itself takes a single one.
    left: [u8; 8],
}

enum Content {
    /// First item and how many.
    Leaf(usize, usize),
    /// Left and right child.
    Fork(u32, u32),
}

impl Binary {
    fn leaf(extent: &Extent, first: usize, count: usize) -> Self {
        let cost = BLOCK_COST * half_area(extent.lo, extent.hi);
        Self { bounds: extent.aabb(), content: Content::Leaf(first, count), cost: [cost; 8], left: [0; 8] }
    }

    /// The best way to share slots among two children, for any number of slots. Ylitie, Karras and Laine
    /// 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", section 3.1.
    fn fork(extent: &Extent, nodes: &[Self], l: u32, r: u32) -> Self {
        let (a, b) = (&nodes[l as usize].cost, &nodes[r as usize].cost);
        let mut cost = [f32::INFINITY; 8];
        let mut left = [0; 8];
        for slots in 2..=8 {
            for k in 1..slots {
                let c = a[k - 1] + b[slots - k - 1];
                if c < cost[slots - 1] {
                    (cost[slots - 1], left[slots - 1]) = (c, k as u8);
                }
            }
        }
        // A single slot: a wide node of its own, whose eight slots are then shared the best way; the way is
        // kept in `left[0]`.
        let own = NODE_COST * half_area(extent.lo, extent.hi) + cost[7];
        left[0] = left[7];
        cost[0] = own;
        for slots in 1..8 {
            if cost[slots - 1] <= cost[slots] {
                (cost[slots], left[slots]) = (cost[slots - 1], if slots == 1 { 0 } else { left[slots - 1] });
            }
        }
        Self { bounds: extent.aabb(), content: Content::Fork(l, r), cost, left }
    }
}

/// Appends the binary tree over `part` to `nodes`, children first; `first` counts the items before it.
/// `forks`: how many threads may still be started.
fn grow(part: Part, first: usize, depth: usize, forks: usize, nodes: &mut Vec<Binary>) {
    if part.is_leaf() {
        nodes.push(Binary::leaf(&part.extent, first, part.items.len()));
        return;
    }
    let extent = part.extent;
    let large = part.items.len() >= PARALLEL;
    let (l, r) = if depth >= HALVING_DEPTH { part.halve() } else { part.split() };
    let middle = first + l.items.len();
    let left = if forks > 1 && large {
        let mut others = Vec::new();
        std::thread::scope(|scope| {
            scope.spawn(|| grow(r, middle, depth + 1, forks / 2, &mut others));
            grow(l, first, depth + 1, forks - forks / 2, nodes);
        });
        let left = nodes.len() as u32 - 1;
        let moved = nodes.len() as u32;
        nodes.extend(others.into_iter().map(|mut n| {
            if let Content::Fork(a, b) = &mut n.content {
                *a += moved;
                *b += moved;
            }
            n
        }));
        left
    } else {
        grow(l, first, depth + 1, 1, nodes);
        let left = nodes.len() as u32 - 1;
        grow(r, middle, depth + 1, 1, nodes);
        left
    };
    let node = Binary::fork(&extent, nodes, left, nodes.len() as u32 - 1);
    nodes.push(node);
}

pub(super) fn build(source: &impl Source, mut items: Vec<Item>, threads: usize) -> Tree {
    let mut tree = Tree { nodes: Vec::new(), blocks: Vec::new(), bounds: Aabb::EMPTY, avx2: has_avx2() };
    if items.is_empty() {
        return tree;
    }
    let part = Part::new(&mut items);
    tree.bounds = part.extent.aabb();
    let mut binary = Vec::new();
    // More pieces than threads, so that uneven ones even out.
    grow(part, 0, 1, if threads > 1 { 4 * threads } else { 1 }, &mut binary);
    let leaves = binary.iter().filter(|n| matches!(n.content, Content::Leaf(..))).count();
    tree.blocks.reserve_exact(leaves);
    let mut widen = Widen { source, items: &items, binary: &binary, tree: &mut tree };
    widen.node(binary.len() - 1);
    tree.nodes.shrink_to_fit();
    tree.blocks.shrink_to_fit();
    assert!(
        tree.nodes.len() < Child::LIMIT && tree.blocks.len() < Child::LIMIT,
        "more triangles than 30 bits count"
    );
    tree
}

/// Turns the binary tree into the wide one.
struct Widen<'a, S> {
    source: &'a S,
    items: &'a [Item],
    binary: &'a [Binary],
    tree: &'a mut Tree,
}

impl<S: Source> Widen<'_, S> {
    /// Appends the wide node at binary node `index`, and all below it, in the order of a walk.
    fn node(&mut self, index: usize) -> Child {
        let place = self.tree.nodes.len();
        self.tree.nodes.push(Node::EMPTY);
        let mut children = [0; 8];
        let mut count = 0;
        match self.binary[index].content {
            Content::Leaf(..) => {
                children[0] = index;
                count = 1;
            }
            Content::Fork(l, r) => {
                let left = self.binary[index].left[0] as usize;
                self.gather(l as usize, left, &mut children, &mut count);
                self.gather(r as usize, 8 - left, &mut children, &mut count);
            }
        }
        for (slot, &child) in children[..count].iter().enumerate() {
            let made = match self.binary[child].content {
                Content::Leaf(first, n) => self.leaf(&self.items[first..first + n]),
                Content::Fork(..) => self.node(child),
            };
            self.tree.nodes[place].set(slot, self.binary[child].bounds, made);
        }
        Child(Child::NODE | place as u32)
    }

    /// The binary nodes that fill `slots` slots best.
    fn gather(&self, index: usize, slots: usize, children: &mut [usize; 8], count: &mut usize) {
        let node = &self.binary[index];
        match node.content {
            Content::Fork(l, r) if slots > 1 && node.left[slots - 1] > 0 => {
                // Fewer slots may be best; the left child's share says out of how many.
                let used = (2..=slots).find(|&s| node.cost[s - 1] <= node.cost[slots - 1]).unwrap_or(slots);
                let left = node.left[used - 1] as usize;
                self.gather(l as usize, left, children, count);
                self.gather(r as usize, used - left, children, count);
            }
            _ => {
                children[*count] = index;
                *count += 1;
            }
        }
    }

    fn leaf(&mut self, items: &[Item]) -> Child {
        if items[0].is_other() {
            return Child(Child::OTHER | items[0].shape());
        }
        let mut block = Block::EMPTY;
        for (lane, item) in items.iter().enumerate() {
            block.shape[lane] = item.shape();
            block.primitive[lane] = item.primitive();
            for (corner, p) in self.source.triangle(item.shape(), item.primitive()).iter().enumerate() {
                for axis in 0..3 {
                    block.vertices[corner][axis][lane] = p[axis];
                }
            }
        }
        self.tree.blocks.push(block);
        Child(Child::BLOCK | (self.tree.blocks.len() - 1) as u32)
    }
}
