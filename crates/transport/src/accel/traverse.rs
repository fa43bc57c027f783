//! Walking a ray through the tree.

use super::{Block, Child, Hit, NO_INSTANCE, Node, Others, Ray, Tree, nearer};
use glam::Vec4;
use std::mem::MaybeUninit;
use yugen_optics::lanes::{Lanes, Portable};

/// Nodes on the longest way from the root; bounds the stack.
pub(super) const MAX_DEPTH: usize = 64;
/// Seven wait on every level, and eight are written at a time.
const STACK: usize = 7 * MAX_DEPTH + 9;

/// Relative widening of the slabs. Reciprocal, products and triangle distances err by a few 2⁻²⁴; 2⁻²¹
/// leaves room and costs nothing, for it sits in the ray's constants.
const WIDEN: f32 = 1.0 / (1u32 << 21) as f32;

/// 1 / direction. A zero component becomes tiny: its slab then spans (nearly) all t or none.
#[inline(always)]
fn reciprocal(ray: &Ray) -> Vec4 {
    let d = ray.dir.extend(1.0);
    let tiny = Vec4::splat(ray.dir.abs().max_element() * 1e-18);
    1.0 / Vec4::select(d.abs().cmplt(tiny), tiny.copysign(d), d)
}

/// A ray as the boxes want it: t = plane · inv − shift, with constants for entry and exit rounded apart.
struct Slabs<L> {
    /// Row of `Node::bounds` where the ray enters; it leaves at the row `^ 1`.
    near: [usize; 3],
    inv_near: [L; 3],
    shift_near: [L; 3],
    inv_far: [L; 3],
    shift_far: [L; 3],
    t_min: L,
}

impl<L: Lanes> Slabs<L> {
    #[inline(always)]
    fn new(ray: &Ray, inv: Vec4) -> Self {
        let o = ray.origin.extend(0.0);
        // A plane's own product and this shift are rounded against |origin · inv|.
        let pad = (o * inv).abs() * WIDEN;
        let (inv_near, inv_far) = (inv * (1.0 - WIDEN), inv * (1.0 + WIDEN));
        let (shift_near, shift_far) = (o * inv_near + pad, o * inv_far - pad);
        let negative = inv.is_negative_bitmask() as usize;
        // Written out: a closure over lanes would not be compiled for the lanes' instructions.
        Self {
            near: [negative & 1, 2 + (negative >> 1 & 1), 4 + (negative >> 2 & 1)],
            inv_near: [L::splat(inv_near.x), L::splat(inv_near.y), L::splat(inv_near.z)],
            shift_near: [L::splat(shift_near.x), L::splat(shift_near.y), L::splat(shift_near.z)],
            inv_far: [L::splat(inv_far.x), L::splat(inv_far.y), L::splat(inv_far.z)],
            shift_far: [L::splat(shift_far.x), L::splat(shift_far.y), L::splat(shift_far.z)],
            t_min: L::splat(ray.t_min),
        }
    }

    /// Distances of entry, and a bit for every child met before `t_max`.
    #[allow(unsafe_code)]
    #[inline(always)]
    fn meet(&self, node: &Node, t_max: f32) -> (L, u32) {
        let mut entry = self.t_min;
        let mut exit = L::splat(t_max);
        for axis in 0..3 {
            let near = self.near[axis];
            debug_assert!(near < 6);
            // SAFETY: `near` is 0 to 5 and so is `near ^ 1`; rows are 32 bytes in a 64-byte aligned node.
            let (a, b) = unsafe {
                let rows = node.bounds.as_ptr();
                (L::load(rows.add(near).cast()), L::load(rows.add(near ^ 1).cast()))
            };
            entry = a.mul_sub(self.inv_near[axis], self.shift_near[axis]).max(entry);
            exit = b.mul_sub(self.inv_far[axis], self.shift_far[axis]).min(exit);
        }
        (entry, entry.le(exit))
    }
}

/// A ray as the triangles want it: sheared so that it runs along z.
struct Shear<L> {
    axes: [usize; 3],
    origin: [L; 3],
    shear: [L; 3],
    t_min: L,
}

/// Lanes met, their distances and the weights of the second and third corner.
struct Met<L> {
    mask: u32,
    t: L,
    u: L,
    v: L,
}

/// The other two axes and the one that the ray runs along most, which comes third.
static AXES: [[usize; 4]; 4] = [[1, 2, 0, 0], [2, 0, 1, 0], [0, 1, 2, 0], [0; 4]];

impl<L: Lanes> Shear<L> {
    #[inline(always)]
    fn new(ray: &Ray, inv: Vec4) -> Self {
        let d = ray.dir.abs();
        let z = usize::from(!(d.x >= d.y && d.x >= d.z)) * (1 + usize::from(d.z > d.y));
        // Arrays of four and masked indices: no branch on the axis, which no processor could foretell.
        let [x, y, z, _] = AXES[z & 3];
        let (x, y, z) = (x & 3, y & 3, z & 3);
        let (o, d) = (ray.origin.extend(0.0).to_array(), ray.dir.extend(0.0).to_array());
        let inv = inv.to_array()[z];
        Self {
            axes: [x, y, z],
            origin: [L::splat(o[x]), L::splat(o[y]), L::splat(o[z])],
            shear: [L::splat(d[x] * inv), L::splat(d[y] * inv), L::splat(inv)],
            t_min: L::splat(ray.t_min),
        }
    }

    #[allow(unsafe_code)]
    #[inline(always)]
    fn meet(&self, block: &Block, t_max: f32) -> Met<L> {
        macro_rules! corner {
            ($c:literal) => {{
                // SAFETY: axes are 0 to 2; rows are 32 bytes in a 32-byte aligned block.
                let (x, y, z) = unsafe {
                    let rows = block.vertices[$c].as_ptr();
                    let [x, y, z] = self.axes;
                    (L::load(rows.add(x).cast()), L::load(rows.add(y).cast()), L::load(rows.add(z).cast()))
                };
                let z = z.sub(self.origin[2]);
                let x = self.shear[0].neg_mul_add(z, x.sub(self.origin[0]));
                let y = self.shear[1].neg_mul_add(z, y.sub(self.origin[1]));
                (x, y, z)
            }};
        }
        let (ax, ay, az) = corner!(0);
        let (bx, by, bz) = corner!(1);
        let (cx, cy, cz) = corner!(2);
        // Not fused: the two products of an edge must be rounded alike, whichever side asks.
        let u = cx.mul(by).sub(cy.mul(bx));
        let v = ax.mul(cy).sub(ay.mul(cx));
        let w = bx.mul(ay).sub(by.mul(ax));
        let zero = L::splat(0.0);
        let inside = zero.le(u.min(v).min(w)) | u.max(v).max(w).le(zero);
        if inside == 0 {
            return Met { mask: 0, t: zero, u: zero, v: zero };
        }
        let det = u.add(v).add(w);
        let inv = L::splat(1.0).div(det);
        let t = u.mul(az).add(v.mul(bz)).add(w.mul(cz)).mul(self.shear[2]).mul(inv);
        // A flat triangle seen edge-on has det 0 and a t that is NaN or infinite; both fail here.
        let mask = inside & self.t_min.lt(t) & t.le(L::splat(t_max)) & t.lt(L::splat(f32::INFINITY));
        Met { mask, t, u: v.mul(inv), v: w.mul(inv) }
    }
}

/// Children still to visit, the next one last.
struct Stack {
    /// Bits of the distance of entry, at most.
    distances: [MaybeUninit<u32>; STACK],
    children: [MaybeUninit<u32>; STACK],
    len: usize,
}

#[allow(unsafe_code)]
impl Stack {
    #[inline(always)]
    fn new() -> Self {
        Self {
            distances: [const { MaybeUninit::uninit() }; STACK],
            children: [const { MaybeUninit::uninit() }; STACK],
            len: 0,
        }
    }

    /// Takes the nearest itself.
    #[inline(always)]
    fn push_sorted<L: Lanes>(&mut self, entry: L, mask: u32, node: &Node) -> Child {
        debug_assert!(self.len + 8 <= STACK);
        // SAFETY: a tree is at most MAX_DEPTH deep, each level leaves at most seven behind, and eight places
        // follow them.
        unsafe {
            let (d, c) =
                (self.distances.as_mut_ptr().add(self.len), self.children.as_mut_ptr().add(self.len));
            entry.write_sorted(mask, bytemuck::cast_ref(&node.children), d.cast(), c.cast());
        }
        self.len += mask.count_ones() as usize - 1;
        // SAFETY: just written.
        Child(unsafe { self.children.get_unchecked(self.len).assume_init() })
    }

    /// Takes the first itself.
    #[inline(always)]
    fn push_all<L: Lanes>(&mut self, mask: u32, node: &Node) -> Child {
        debug_assert!(self.len + 8 <= STACK);
        let rest = mask & (mask - 1);
        if rest != 0 {
            // SAFETY: as in `push_sorted`.
            unsafe {
                let c = self.children.as_mut_ptr().add(self.len);
                L::write_compact(rest, bytemuck::cast_ref(&node.children), c.cast());
            }
            self.len += rest.count_ones() as usize;
        }
        node.children[mask.trailing_zeros() as usize & 7]
    }

    /// The next child that is nearer than `t_max`.
    #[inline(always)]
    fn pop_within(&mut self, t_max: f32) -> Option<Child> {
        loop {
            self.len = self.len.checked_sub(1)?;
            // SAFETY: everything below `len` was written by a push.
            let distance = unsafe { self.distances.get_unchecked(self.len).assume_init() };
            if f32::from_bits(distance) <= t_max {
                return Some(Child(unsafe { self.children.get_unchecked(self.len).assume_init() }));
            }
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Child> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: as in `pop_within`.
        Some(Child(unsafe { self.children.get_unchecked(self.len).assume_init() }))
    }
}

#[allow(unsafe_code)]
#[inline(always)]
fn closest<L: Lanes>(tree: &Tree, ray: &Ray, others: &impl Others) -> Option<Hit> {
    let inv = reciprocal(ray);
    let slabs = Slabs::<L>::new(ray, inv);
    let shear = Shear::<L>::new(ray, inv);
    let mut best = None;
    let mut t_max = ray.t_max;
    let mut stack = Stack::new();
    let mut child = Child::ROOT;
    loop {
        'visit: {
            while child.0 & Child::KIND == Child::NODE {
                // SAFETY: `Tree` is only made by `build`, whose children are in range (and `validate` checks).
                let node = unsafe { tree.nodes.get_unchecked(child.index()) };
                let (entry, mask) = slabs.meet(node, t_max);
                if mask & mask.wrapping_sub(1) == 0 {
                    // None, or one, as mostly: the stack's latency is saved.
                    if mask == 0 {
                        break 'visit;
                    }
                    child = node.children[mask.trailing_zeros() as usize & 7];
                } else {
                    child = stack.push_sorted(entry, mask, node);
                }
            }
            match child.0 & Child::KIND {
                Child::BLOCK => {
                    // SAFETY: as above.
                    let block = unsafe { tree.blocks.get_unchecked(child.index()) };
                    let met = shear.meet(block, t_max);
                    let mut mask = met.mask;
                    if mask != 0 {
                        let (t, u, v) = (met.t.to_array(), met.u.to_array(), met.v.to_array());
                        while mask != 0 {
                            let i = mask.trailing_zeros() as usize & 7;
                            mask &= mask - 1;
                            let (shape, primitive) = (block.shape[i], block.primitive[i]);
                            let hit =
                                Hit { t: t[i], u: u[i], v: v[i], shape, primitive, instance: NO_INSTANCE };
                            if nearer(&hit, &best) {
                                t_max = hit.t;
                                best = Some(hit);
                            }
                        }
                    }
                }
                _ => {
                    others.intersect(child.index() as u32, &Ray { t_max, ..*ray }, &mut best);
                    if let Some(b) = &best {
                        t_max = b.t;
                    }
                }
            }
        }
        child = match stack.pop_within(t_max) {
            Some(next) => next,
            None => return best,
        };
    }
}

#[allow(unsafe_code)]
#[inline(always)]
fn any<L: Lanes>(tree: &Tree, ray: &Ray, others: &impl Others) -> bool {
    let inv = reciprocal(ray);
    let slabs = Slabs::<L>::new(ray, inv);
    let shear = Shear::<L>::new(ray, inv);
    let mut stack = Stack::new();
    let mut child = Child::ROOT;
    loop {
        'visit: {
            while child.0 & Child::KIND == Child::NODE {
                // SAFETY: as in `closest`.
                let node = unsafe { tree.nodes.get_unchecked(child.index()) };
                let (_, mask) = slabs.meet(node, ray.t_max);
                if mask == 0 {
                    break 'visit;
                }
                child = stack.push_all::<L>(mask, node);
            }
            match child.0 & Child::KIND {
                Child::BLOCK => {
                    // SAFETY: as in `closest`.
                    let block = unsafe { tree.blocks.get_unchecked(child.index()) };
                    if shear.meet(block, ray.t_max).mask != 0 {
                        return true;
                    }
                }
                _ => {
                    if others.occluded(child.index() as u32, ray) {
                        return true;
                    }
                }
            }
        }
        child = match stack.pop() {
            Some(next) => next,
            None => return false,
        };
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2 {
    use super::{Hit, Others, Ray, Tree};
    use yugen_optics::lanes::Avx2;

    #[target_feature(enable = "avx2,fma,bmi1,bmi2")]
    pub(super) fn closest(tree: &Tree, ray: &Ray, others: &impl Others) -> Option<Hit> {
        super::closest::<Avx2>(tree, ray, others)
    }

    #[target_feature(enable = "avx2,fma,bmi1,bmi2")]
    pub(super) fn any(tree: &Tree, ray: &Ray, others: &impl Others) -> bool {
        super::any::<Avx2>(tree, ray, others)
    }
}

/// A ray that can meet anything: finite, with a direction.
fn usable(ray: &Ray) -> bool {
    let sum = ray.origin.element_sum() + ray.dir.element_sum();
    sum.is_finite() && ray.dir.abs().max_element() > 1e-18 && ray.t_min >= 0.0 && ray.t_max > ray.t_min
}

impl Tree {
    #[allow(unsafe_code)]
    pub(crate) fn closest(&self, ray: &Ray, others: &impl Others) -> Option<Hit> {
        if self.nodes.is_empty() || !usable(ray) {
            return None;
        }
        #[cfg(target_arch = "x86_64")]
        if self.avx2 {
            // SAFETY: the processor was asked when the tree was built.
            return unsafe { avx2::closest(self, ray, others) };
        }
        closest::<Portable>(self, ray, others)
    }

    #[allow(unsafe_code)]
    pub(crate) fn any(&self, ray: &Ray, others: &impl Others) -> bool {
        if self.nodes.is_empty() || !usable(ray) {
            return false;
        }
        #[cfg(target_arch = "x86_64")]
        if self.avx2 {
            // SAFETY: the processor was asked when the tree was built.
            return unsafe { avx2::any(self, ray, others) };
        }
        any::<Portable>(self, ray, others)
    }
}

#[cfg(test)]
impl Tree {
    /// What [`Tree::closest`] and [`Tree::any`] say without AVX2.
    pub(super) fn portable(&self, ray: &Ray, others: &impl Others) -> (Option<Hit>, bool) {
        (closest::<Portable>(self, ray, others), any::<Portable>(self, ray, others))
    }
}
