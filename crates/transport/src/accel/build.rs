//! Binned surface-area heuristic (Wald 2007, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies"), splitting straight to nodes of eight: the child with the largest box is split until
//! eight are there.

use super::{Aabb, Block, Child, Item, Node, Source, Tree, traverse::MAX_DEPTH};
use glam::{Vec3, Vec4, Vec4Swizzles};

const LEAF: usize = 8;
const BINS: usize = 16;
/// Below this depth everything is halved by count, which ends within log₈(2³⁰) = 10 further levels.
const HALVING_DEPTH: usize = MAX_DEPTH - 12;
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

struct Out {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

pub(super) fn build(source: &impl Source, mut items: Vec<Item>, threads: usize) -> Tree {
    let mut out = Out { nodes: Vec::new(), blocks: Vec::new() };
    let mut bounds = Aabb::EMPTY;
    if !items.is_empty() {
        let part = Part::new(&mut items);
        bounds = part.extent.aabb();
        grow(source, part, 1, threads.max(1), &mut out);
    }
    out.nodes.shrink_to_fit();
    out.blocks.shrink_to_fit();
    assert!(
        out.nodes.len() < Child::LIMIT && out.blocks.len() < Child::LIMIT,
        "more triangles than 30 bits count"
    );
    Tree { nodes: out.nodes, blocks: out.blocks, bounds }
}

/// Appends the node over `part`, and all below it, to `out`.
fn grow(source: &impl Source, part: Part, depth: usize, threads: usize, out: &mut Out) {
    let large = part.items.len() >= PARALLEL;
    let mut parts = vec![part];
    while parts.len() < 8 {
        let widest = parts
            .iter()
            .enumerate()
            .filter(|(_, p)| !p.is_leaf())
            .map(|(i, p)| (i, half_area(p.extent.lo, p.extent.hi)))
            .reduce(|a, b| if b.1 > a.1 { b } else { a });
        let Some((i, _)) = widest else { break };
        let part = parts.swap_remove(i);
        let (a, b) = if depth >= HALVING_DEPTH { part.halve() } else { part.split() };
        parts.extend([a, b]);
    }
    let index = out.nodes.len();
    out.nodes.push(Node::EMPTY);
    let boxes: Vec<Aabb> = parts.iter().map(|p| p.extent.aabb()).collect();
    let children: Vec<Child> = if large {
        let branches = in_parallel(parts, threads, |part| {
            let mut branch = Out { nodes: Vec::new(), blocks: Vec::new() };
            let child = hang(source, part, depth, threads, &mut branch);
            (child, branch)
        });
        branches.into_iter().map(|(child, branch)| out.append(child, branch)).collect()
    } else {
        parts.into_iter().map(|part| hang(source, part, depth, 1, out)).collect()
    };
    for (slot, (bounds, child)) in boxes.into_iter().zip(children).enumerate() {
        out.nodes[index].set(slot, bounds, child);
    }
}

/// Appends a leaf or a subtree.
fn hang(source: &impl Source, part: Part, depth: usize, threads: usize, out: &mut Out) -> Child {
    if !part.is_leaf() {
        let index = out.nodes.len() as u32;
        grow(source, part, depth + 1, threads, out);
        return Child(Child::NODE | index);
    }
    if part.items[0].is_other() {
        return Child(Child::OTHER | part.items[0].shape());
    }
    let mut block = Block::EMPTY;
    for (lane, item) in part.items.iter().enumerate() {
        block.shape[lane] = item.shape();
        block.primitive[lane] = item.primitive();
        for (corner, p) in source.triangle(item.shape(), item.primitive()).iter().enumerate() {
            for axis in 0..3 {
                block.vertices[corner][axis][lane] = p[axis];
            }
        }
    }
    out.blocks.push(block);
    Child(Child::BLOCK | (out.blocks.len() - 1) as u32)
}

impl Out {
    /// Moves a branch that was built by itself to the end.
    fn append(&mut self, child: Child, branch: Out) -> Child {
        let (nodes, blocks) = (self.nodes.len() as u32, self.blocks.len() as u32);
        let moved = |c: Child| match c.0 & Child::KIND {
            Child::NODE => Child(c.0 + nodes),
            Child::BLOCK => Child(c.0 + blocks),
            _ => c,
        };
        self.blocks.extend(branch.blocks);
        self.nodes.extend(branch.nodes.into_iter().map(|mut n| {
            n.children = n.children.map(moved);
            n
        }));
        moved(child)
    }
}

/// `f` of every part, in order, by up to `threads` threads.
fn in_parallel<'a, R: Send>(
    parts: Vec<Part<'a>>,
    threads: usize,
    f: impl Fn(Part<'a>) -> R + Sync,
) -> Vec<R> {
    if threads <= 1 {
        return parts.into_iter().map(f).collect();
    }
    let mut results: Vec<Option<R>> = parts.iter().map(|_| None).collect();
    let mut jobs: Vec<_> = parts.into_iter().zip(&mut results).collect();
    // The largest is taken first.
    jobs.sort_by_key(|(p, _)| p.items.len());
    let jobs = std::sync::Mutex::new(jobs);
    let work = || {
        while let Some((part, result)) = { jobs.lock().unwrap_or_else(|e| e.into_inner()).pop() } {
            *result = Some(f(part));
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(work);
        }
        work();
    });
    drop(jobs);
    results.into_iter().flatten().collect()
}
