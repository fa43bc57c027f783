//! Walking a ray through the tree.

use super::lanes::{Lanes, Portable};
use super::{Block, Child, Hit, NO_INSTANCE, Node, Others, Ray, Tree, nearer};
use glam::Vec3;
use std::mem::MaybeUninit;

/// Nodes on the longest way from the root; bounds the stack.
pub(super) const MAX_DEPTH: usize = 48;
const STACK: usize = 7 * MAX_DEPTH + 1;

/// Relative widening of the slabs. Reciprocal, products and triangle distances err by a few 2⁻²⁴; 2⁻²¹
/// leaves room and costs nothing, for it sits in the ray's constants.
const WIDEN: f32 = 1.0 / (1u32 << 21) as f32;

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
    fn new(ray: &Ray) -> Self {
        // A zero component becomes tiny: the slab then spans (nearly) all t or none.
        let tiny = ray.dir.abs().max_element() * 1e-18;
        let inv = Vec3::from_array(
            ray.dir.to_array().map(|d| if d.abs() < tiny { 1f32.copysign(d) / tiny } else { 1.0 / d }),
        );
        // A plane's own product and this shift are rounded against |origin · inv|.
        let pad = (ray.origin * inv).abs() * WIDEN;
        let (inv_near, inv_far) = (inv * (1.0 - WIDEN), inv * (1.0 + WIDEN));
        let (shift_near, shift_far) = (ray.origin * inv_near + pad, ray.origin * inv_far - pad);
        let splat = |v: Vec3| v.to_array().map(L::splat);
        Self {
            near: std::array::from_fn(|axis| 2 * axis + usize::from(inv[axis].is_sign_negative())),
            inv_near: splat(inv_near),
            shift_near: splat(shift_near),
            inv_far: splat(inv_far),
            shift_far: splat(shift_far),
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

impl<L: Lanes> Shear<L> {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let d = ray.dir.abs();
        let z = if d.x >= d.y && d.x >= d.z { 0 } else { 1 + usize::from(d.z > d.y) };
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][z];
        let [dx, dy, dz] = axes.map(|a| ray.dir[a]);
        Self {
            axes,
            origin: axes.map(|a| L::splat(ray.origin[a])),
            shear: [L::splat(dx / dz), L::splat(dy / dz), L::splat(1.0 / dz)],
            t_min: L::splat(ray.t_min),
        }
    }

    #[allow(unsafe_code)]
    #[inline(always)]
    fn meet(&self, block: &Block, t_max: f32) -> Met<L> {
        let corner = |c: usize| {
            // SAFETY: axes are 0 to 2; rows are 32 bytes in a 32-byte aligned block.
            let row = |k: usize| unsafe { L::load(block.vertices[c].as_ptr().add(self.axes[k]).cast()) };
            let z = row(2).sub(self.origin[2]);
            let x = self.shear[0].neg_mul_add(z, row(0).sub(self.origin[0]));
            let y = self.shear[1].neg_mul_add(z, row(1).sub(self.origin[1]));
            (x, y, z)
        };
        let (ax, ay, az) = corner(0);
        let (bx, by, bz) = corner(1);
        let (cx, cy, cz) = corner(2);
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

/// Children still to visit: entry distance (its bits order like the number) above the child.
struct Stack {
    entries: [MaybeUninit<u64>; STACK],
    len: usize,
}

#[allow(unsafe_code)]
impl Stack {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [MaybeUninit::uninit(); STACK], len: 0 }
    }

    #[inline(always)]
    fn push(&mut self, t: f32, child: Child) {
        debug_assert!(self.len < STACK);
        // SAFETY: a tree is at most MAX_DEPTH deep, and each level leaves at most seven behind.
        unsafe { self.entries.get_unchecked_mut(self.len) }
            .write(u64::from(t.to_bits()) << 32 | u64::from(child.0));
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(f32, Child)> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: everything below `len` was written by `push`.
        let e = unsafe { self.entries.get_unchecked(self.len).assume_init() };
        Some((f32::from_bits((e >> 32) as u32), Child(e as u32)))
    }

    /// The entries from `start` on, farthest first.
    #[inline(always)]
    fn sort_from(&mut self, start: usize) {
        // SAFETY: as in `pop`; `i` and `j` stay between `start` and `len`.
        unsafe {
            for i in start + 1..self.len {
                let e = self.entries.get_unchecked(i).assume_init();
                let mut j = i;
                while j > start && self.entries.get_unchecked(j - 1).assume_init() < e {
                    *self.entries.get_unchecked_mut(j) = *self.entries.get_unchecked(j - 1);
                    j -= 1;
                }
                self.entries.get_unchecked_mut(j).write(e);
            }
        }
    }
}

#[allow(unsafe_code)]
#[inline(always)]
fn closest<L: Lanes>(tree: &Tree, ray: &Ray, others: &impl Others) -> Option<Hit> {
    let slabs = Slabs::<L>::new(ray);
    let shear = Shear::<L>::new(ray);
    let mut best = None;
    let mut t_max = ray.t_max;
    let mut stack = Stack::new();
    stack.push(0.0, Child(Child::NODE));
    'pop: while let Some((entry, mut child)) = stack.pop() {
        if entry > t_max {
            continue;
        }
        while child.0 & Child::KIND == Child::NODE {
            // SAFETY: `Tree` is only made by `build`, whose children are in range (and `validate` checks).
            let node = unsafe { tree.nodes.get_unchecked(child.index()) };
            let (entry, mut mask) = slabs.meet(node, t_max);
            if mask == 0 {
                continue 'pop;
            }
            let first = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            if mask == 0 {
                child = node.children[first & 7];
                continue;
            }
            let entry = entry.to_array();
            let start = stack.len;
            stack.push(entry[first & 7], node.children[first & 7]);
            while mask != 0 {
                let i = mask.trailing_zeros() as usize & 7;
                mask &= mask - 1;
                stack.push(entry[i], node.children[i]);
            }
            stack.sort_from(start);
            child = match stack.pop() {
                Some((_, c)) => c,
                None => break 'pop,
            };
        }
        if child.0 & Child::KIND == Child::BLOCK {
            // SAFETY: as above.
            let block = unsafe { tree.blocks.get_unchecked(child.index()) };
            let met = shear.meet(block, t_max);
            let mut mask = met.mask;
            if mask != 0 {
                let (t, u, v) = (met.t.to_array(), met.u.to_array(), met.v.to_array());
                while mask != 0 {
                    let i = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    let hit = Hit {
                        t: t[i],
                        u: u[i],
                        v: v[i],
                        shape: block.shape[i],
                        primitive: block.primitive[i],
                        instance: NO_INSTANCE,
                    };
                    if nearer(&hit, &best) {
                        t_max = hit.t;
                        best = Some(hit);
                    }
                }
            }
        } else {
            others.intersect(child.index() as u32, &Ray { t_max, ..*ray }, &mut best);
            if let Some(b) = &best {
                t_max = b.t;
            }
        }
    }
    best
}

#[allow(unsafe_code)]
#[inline(always)]
fn any<L: Lanes>(tree: &Tree, ray: &Ray, others: &impl Others) -> bool {
    let slabs = Slabs::<L>::new(ray);
    let shear = Shear::<L>::new(ray);
    let mut stack = Stack::new();
    stack.push(0.0, Child(Child::NODE));
    while let Some((_, child)) = stack.pop() {
        match child.0 & Child::KIND {
            Child::NODE => {
                // SAFETY: as in `closest`.
                let node = unsafe { tree.nodes.get_unchecked(child.index()) };
                let (_, mut mask) = slabs.meet(node, ray.t_max);
                while mask != 0 {
                    let i = mask.trailing_zeros() as usize & 7;
                    mask &= mask - 1;
                    stack.push(0.0, node.children[i]);
                }
            }
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
    false
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2 {
    use super::super::lanes::Avx2;
    use super::{Hit, Others, Ray, Tree};

    #[target_feature(enable = "avx2,fma,bmi1,bmi2")]
    pub(super) fn closest(tree: &Tree, ray: &Ray, others: &impl Others) -> Option<Hit> {
        super::closest::<Avx2>(tree, ray, others)
    }

    #[target_feature(enable = "avx2,fma,bmi1,bmi2")]
    pub(super) fn any(tree: &Tree, ray: &Ray, others: &impl Others) -> bool {
        super::any::<Avx2>(tree, ray, others)
    }

    pub(super) fn is_here() -> bool {
        is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
    }
}

/// A ray that can meet anything: finite, with a direction.
fn usable(ray: &Ray) -> bool {
    ray.origin.is_finite()
        && ray.dir.is_finite()
        && ray.dir != Vec3::ZERO
        && ray.t_min >= 0.0
        && ray.t_max > ray.t_min
}

impl Tree {
    #[allow(unsafe_code)]
    pub(crate) fn closest(&self, ray: &Ray, others: &impl Others) -> Option<Hit> {
        if self.nodes.is_empty() || !usable(ray) {
            return None;
        }
        #[cfg(target_arch = "x86_64")]
        if avx2::is_here() {
            // SAFETY: the processor has just said that it can.
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
        if avx2::is_here() {
            // SAFETY: the processor has just said that it can.
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
