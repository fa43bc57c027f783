//! The tree over boxes: binned surface-area heuristic to a binary tree, opened to nodes of four.

use super::NOTHING;
use glam::{Vec3, Vec4, Vec4Swizzles};

const BINS: usize = 16;
/// Cost of a node over that of a triangle: they fetch as many bytes, and a node's boxes are a little more arithmetic.
const NODE_COST: f32 = 1.0;
/// Subtrees of fewer triangles are not worth a thread.
const PARALLEL: usize = 1 << 14;

/// What is put into a tree: a box and a number, which is the last word of its lower corner.
#[derive(Clone, Copy)]
pub(super) struct Item {
    lo: Vec4,
    hi: Vec4,
}

impl Item {
    pub fn new(lo: Vec3, hi: Vec3, index: u32) -> Self {
        Self { lo: lo.extend(f32::from_bits(index)), hi: hi.extend(0.0) }
    }

    pub fn index(&self) -> u32 {
        self.lo.w.to_bits()
    }
}

/// Box of items and box of twice their centres; w is meaningless.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub lo: Vec4,
    pub hi: Vec4,
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

    pub fn of(items: &[Item]) -> Self {
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
pub(super) fn tree(
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
        ((self.base + place) as u32, below + u32::from(children.len() > 1))
    }

    fn open(&self, children: &mut Vec<usize>, slot: usize) {
        let [l, r] = self.binary[children[slot]].links;
        children[slot] = l as usize;
        children.push(r as usize);
    }
}

/// A node of up to four boxes with their child words. Every plane comes to lie strictly outside what it bounds, so that
/// a ray along it is not lost to rounding.
pub(super) fn node_rows(children: &[(Vec3, Vec3, u32)]) -> [[u32; 4]; 4] {
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
