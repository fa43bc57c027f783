//! Fits of linear functions of features to the pixels around, for blocks of pixels on all threads.

use crate::lanes;
use crate::parallel::parallel;

/// Pixels to each side that a pixel is fitted to.
const REACH: usize = 9;
/// Pixels to each side that are compared to say how alike two pixels are.
const PATCH: usize = 3;
/// Pixels around a block that it looks at.
pub(super) const BORDER: usize = REACH + PATCH;
/// Pixels across and down of a block, which one thread works at.
const BLOCK: usize = 16;
/// Pixels that are worked at together.
const LANES: usize = 8;
/// Offsets of a window.
const OFFSETS: usize = (2 * REACH + 1) * (2 * REACH + 1);
/// Offsets that are added to the sums of a fit at once: the sums, more than there are registers, are fetched once for all.
const BATCH: usize = 4;
/// How far apart two pixels may be, in standard deviations of their difference, to count as alike: candidates.
pub(super) const WIDTHS: [f32; 2] = [0.35, 0.7];
/// Most that two pixels may be apart, in squares of the above; beyond that they have nothing to do with each other.
const APART: f32 = 8.0;
/// Added to the variance of features, as a part of their spread: what a fit may not make much of.
const RIDGE: f32 = 1e-3;
/// Most that a pixel's nearest kin may seem apart from it, in the squares above, and be taken for alike all the same:
/// samples that missed a rare bright path think too well of themselves.
const KIN: f32 = 1.0;

/// Values of pixels that are worked at together.
type Eight = [f32; LANES];

/// A plane with a border around it.
pub(super) struct Plane {
    pub(super) pitch: usize,
    pub(super) data: Vec<f32>,
}

impl Plane {
    /// `plane` of so many pixels, its edge repeated outside.
    pub(super) fn new(plane: &[f32], width: usize, height: usize) -> Self {
        let pitch = (width.next_multiple_of(BLOCK) + 2 * BORDER).next_multiple_of(LANES) + 2 * LANES;
        let rows = height.next_multiple_of(BLOCK) + 2 * BORDER;
        let mut data = Vec::with_capacity(pitch * rows);
        for y in 0..rows {
            let row = y.saturating_sub(BORDER).min(height - 1) * width;
            let row = &plane[row..row + width];
            data.extend(std::iter::repeat_n(row[0], BORDER));
            data.extend_from_slice(row);
            data.extend(std::iter::repeat_n(row[width - 1], pitch - BORDER - width));
        }
        Self { pitch, data }
    }

    /// The pixels from (x, y) on, with the border counted.
    #[inline(always)]
    fn at(&self, x: usize, y: usize) -> &Eight {
        let from = y * self.pitch + x;
        self.data[from..].first_chunk().unwrap_or(&[0.0; LANES])
    }
}

/// One half, ready to be looked at.
pub(super) struct Side {
    pub(super) rgb: [Plane; 3],
    /// Of all three together.
    pub(super) variance: Plane,
}

/// What a surface is like, one number of it.
pub(super) struct Feature {
    pub(super) plane: Plane,
    /// Variance of its noise.
    pub(super) noise: Plane,
    /// Least spread of it that counts.
    pub(super) floor: f32,
}

/// Everything that a block looks at.
pub(super) struct Inputs {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) sides: Vec<Side>,
    /// 0 at pixels with samples, infinity at those without and outside the picture.
    pub(super) far: Plane,
    pub(super) features: Vec<Feature>,
}

/// What comes of a block: for every width, half and colour its pixels.
type Fits = [[[[f32; BLOCK * BLOCK]; 3]; 2]; WIDTHS.len()];

/// Distances of a block's pixels to those around them: for each group of lanes all offsets.
#[inline(always)]
fn distances<L: lanes::Lanes>(side: &Side, far: &Plane, x0: usize, y0: usize, out: &mut [Eight]) {
    const WIDE: usize = BLOCK + 2 * LANES;
    const HIGH: usize = BLOCK + 2 * PATCH;
    // Loops throughout, as in `fit`.
    let (zero, least, most) = (L::splat(0.0), L::splat(1e-12), L::splat(1e4));
    let share = L::splat(1.0 / ((2 * PATCH + 1) * (2 * PATCH + 1)) as f32);
    let mut sums = [[zero; BLOCK / LANES]; HIGH];
    let mut row = [0.0f32; WIDE];
    let mut o = 0;
    for dy in 0..=2 * REACH {
        for dx in 0..=2 * REACH {
            for (y, sum) in sums.iter_mut().enumerate() {
                let py = y0 + BORDER - PATCH + y;
                let qy = py + dy - REACH;
                for x in (0..BLOCK + 2 * PATCH).step_by(LANES) {
                    let px = x0 + BORDER - PATCH + x;
                    let qx = px + dx - REACH;
                    let vp = L::from_array(side.variance.at(px, py));
                    let vq = L::from_array(side.variance.at(qx, qy));
                    // What noise adds to the square; a neighbour noisier than the pixel itself is no excuse.
                    let mut apart = zero.sub(vp.add(vp.min(vq)));
                    for plane in &side.rgb {
                        let d = L::from_array(plane.at(px, py)).sub(L::from_array(plane.at(qx, qy)));
                        apart = d.mul_add(d, apart);
                    }
                    let apart = apart.div(vp.add(vq).add(least)).min(most);
                    row[x..x + LANES].copy_from_slice(&apart.to_array());
                }
                for (group, sum) in sum.iter_mut().enumerate() {
                    *sum = zero;
                    for i in 0..=2 * PATCH {
                        let from = group * LANES + i;
                        *sum = sum.add(L::from_array(row[from..].first_chunk().unwrap_or(&[0.0; LANES])));
                    }
                }
            }
            for y in 0..BLOCK {
                for group in 0..BLOCK / LANES {
                    let mut d = zero;
                    for sum in &sums[y..=y + 2 * PATCH] {
                        d = d.add(sum[group]);
                    }
                    let far = far.at(x0 + BORDER + group * LANES + dx - REACH, y0 + BORDER + y + dy - REACH);
                    out[(y * (BLOCK / LANES) + group) * OFFSETS + o] =
                        d.mul_add(share, L::from_array(far)).to_array();
                }
            }
            o += 1;
        }
    }
}

/// A pixel around: its weight, what is fitted, and what that is to be a linear function of.
#[derive(Clone, Copy)]
struct Neighbour<L, const K: usize> {
    w: L,
    colour: [L; 3],
    f: [L; K],
}

/// Upper triangle of the normal equations: features, then one; and right-hand sides.
struct Sums<L, const K: usize> {
    s: [[L; K]; K],
    s1: [L; K],
    count: L,
    t: [[L; 3]; K],
    t1: [L; 3],
}

impl<L: lanes::Lanes, const K: usize> Sums<L, K> {
    /// Adds so many pixels, to each sum one after the other: the same bits, however many they are.
    #[inline(always)]
    // Rows of two matrices at once: indices say what happens.
    #[allow(clippy::needless_range_loop)]
    fn add<const N: usize>(&mut self, pixels: &[Neighbour<L, K>; N]) {
        for p in pixels {
            self.count = self.count.add(p.w);
        }
        for c in 0..3 {
            let mut sum = self.t1[c];
            for p in pixels {
                sum = p.w.mul_add(p.colour[c], sum);
            }
            self.t1[c] = sum;
        }
        for k in 0..K {
            let mut wf = [self.count; N];
            for (wf, p) in wf.iter_mut().zip(pixels) {
                *wf = p.w.mul(p.f[k]);
            }
            let mut sum = self.s1[k];
            for wf in wf {
                sum = sum.add(wf);
            }
            self.s1[k] = sum;
            for c in 0..3 {
                let mut sum = self.t[k][c];
                for n in 0..N {
                    sum = wf[n].mul_add(pixels[n].colour[c], sum);
                }
                self.t[k][c] = sum;
            }
            for j in k..K {
                let mut sum = self.s[k][j];
                for n in 0..N {
                    sum = wf[n].mul_add(pixels[n].f[j], sum);
                }
                self.s[k][j] = sum;
            }
        }
    }
}

/// Value at its own pixel of the linear function of `K` features that fits the pixels around best: for all three
/// colours of `target`.
#[inline(always)]
// Rows of two matrices at once: indices say what happens.
#[allow(clippy::needless_range_loop)]
fn fit<L: lanes::Lanes, const K: usize>(
    features: &[(&Feature, f32)],
    target: &[Plane; 3],
    distance: &[Eight],
    nearest: L,
    width: f32,
    x: usize,
    y: usize,
) -> [Eight; 3] {
    // Loops throughout: a closure over lanes would not be compiled for the lanes' instructions.
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let (mut own, mut noise, mut scale) = ([zero; K], [zero; K], [zero; K]);
    for k in 0..K {
        own[k] = L::from_array(features[k].0.plane.at(x, y));
        noise[k] = L::from_array(features[k].0.noise.at(x, y));
        scale[k] = L::splat(features[k].1);
    }
    let sharp = L::splat(1.0 / (APART * width * width));
    let mut sums = Sums { s: [[zero; K]; K], s1: [zero; K], count: zero, t: [[zero; 3]; K], t1: [zero; 3] };
    let mut batch = [Neighbour { w: zero, colour: [zero; 3], f: [zero; K] }; BATCH];
    let mut waiting = 0;
    let mut o = 0;
    for qy in y - REACH..=y + REACH {
        for qx in x - REACH..=x + REACH {
            let d = L::from_array(&distance[o]);
            o += 1;
            // A power near to the exponential function that ends.
            let e = d.sub(nearest).max(zero).neg_mul_add(sharp, one).max(zero);
            let e = e.mul(e);
            let e = e.mul(e);
            let w = e.mul(e);
            if zero.lt(w) == 0 {
                continue;
            }
            let next = &mut batch[waiting];
            next.w = w;
            for c in 0..3 {
                next.colour[c] = L::from_array(target[c].at(qx, qy));
            }
            for k in 0..K {
                next.f[k] = L::from_array(features[k].0.plane.at(qx, qy)).sub(own[k]).mul(scale[k]);
            }
            waiting += 1;
            if waiting == BATCH {
                sums.add(&batch);
                waiting = 0;
            }
        }
    }
    for one in &batch[..waiting] {
        sums.add(std::array::from_ref(one));
    }
    let Sums { mut s, mut s1, count, mut t, mut t1 } = sums;
    // Gaussian elimination without pivoting: the matrix is positive definite. The row of ones comes last, so that its
    // solution, the value at the pixel itself, needs no substitution.
    let mut rest = count;
    for k in 0..K {
        // Of a feature that is itself noisy not much is made either.
        let ridge = scale[k].mul(scale[k]).mul_add(noise[k], L::splat(RIDGE));
        let inverse = one.div(ridge.mul_add(count, s[k][k].max(zero)));
        for j in k + 1..K {
            let factor = s[k][j].mul(inverse);
            for l in j..K {
                s[j][l] = factor.neg_mul_add(s[k][l], s[j][l]);
            }
            s1[j] = factor.neg_mul_add(s1[k], s1[j]);
            for c in 0..3 {
                t[j][c] = factor.neg_mul_add(t[k][c], t[j][c]);
            }
        }
        let factor = s1[k].mul(inverse);
        rest = factor.neg_mul_add(s1[k], rest);
        for c in 0..3 {
            t1[c] = factor.neg_mul_add(t[k][c], t1[c]);
        }
    }
    let rest = rest.max(count.mul(L::splat(1e-3))).max(L::splat(f32::MIN_POSITIVE));
    [t1[0].div(rest).to_array(), t1[1].div(rest).to_array(), t1[2].div(rest).to_array()]
}

/// All fits of a block.
#[inline(always)]
fn block<L: lanes::Lanes>(inputs: &Inputs, x0: usize, y0: usize) -> Box<Fits> {
    let groups = BLOCK * BLOCK / LANES;
    let mut apart = [vec![[0.0; LANES]; groups * OFFSETS], vec![[0.0; LANES]; groups * OFFSETS]];
    for (side, out) in inputs.sides.iter().zip(&mut apart) {
        distances::<L>(side, &inputs.far, x0, y0, out);
    }
    // Features that tell anything here.
    let mut told = Vec::new();
    for feature in &inputs.features {
        let plane = &feature.plane;
        let (mut sum, mut squares, mut n) = (0.0f64, 0.0f64, 0.0f64);
        for y in y0 + BORDER - REACH..(y0 + BLOCK + BORDER + REACH).min(inputs.height + BORDER) {
            for x in x0 + BORDER - REACH..(x0 + BLOCK + BORDER + REACH).min(inputs.width + BORDER) {
                let v = f64::from(plane.data[y * plane.pitch + x]);
                (sum, squares, n) = (sum + v, squares + v * v, n + 1.0);
            }
        }
        let spread = (squares / n - (sum / n) * (sum / n)).max(0.0).sqrt() as f32;
        if spread > feature.floor {
            told.push((feature, 1.0 / spread));
        }
    }
    let mut out = Box::new([[[[0.0; BLOCK * BLOCK]; 3]; 2]; WIDTHS.len()]);
    for group in 0..groups {
        let (x, y) = (group % (BLOCK / LANES) * LANES, group / (BLOCK / LANES));
        let (px, py) = (x0 + x + BORDER, y0 + y + BORDER);
        for half in 0..2 {
            // What the noise of one half makes look alike does not look alike in the other.
            let distance = &apart[1 - half][group * OFFSETS..(group + 1) * OFFSETS];
            let target = &inputs.sides[half].rgb;
            let mut nearest = L::splat(KIN);
            for (o, d) in distance.iter().enumerate() {
                if o != OFFSETS / 2 {
                    nearest = nearest.min(L::from_array(d));
                }
            }
            let nearest = nearest.max(L::splat(0.0));
            for (w, width) in WIDTHS.into_iter().enumerate() {
                let rgb = match told.len() {
                    0 => fit::<L, 0>(&told, target, distance, nearest, width, px, py),
                    1 => fit::<L, 1>(&told, target, distance, nearest, width, px, py),
                    2 => fit::<L, 2>(&told, target, distance, nearest, width, px, py),
                    3 => fit::<L, 3>(&told, target, distance, nearest, width, px, py),
                    4 => fit::<L, 4>(&told, target, distance, nearest, width, px, py),
                    5 => fit::<L, 5>(&told, target, distance, nearest, width, px, py),
                    6 => fit::<L, 6>(&told, target, distance, nearest, width, px, py),
                    7 => fit::<L, 7>(&told, target, distance, nearest, width, px, py),
                    _ => fit::<L, 8>(&told[..8], target, distance, nearest, width, px, py),
                };
                for (to, from) in out[w][half].iter_mut().zip(rgb) {
                    to[y * BLOCK + x..][..LANES].copy_from_slice(&from);
                }
            }
        }
    }
    out
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn block_avx2(inputs: &Inputs, x0: usize, y0: usize) -> Box<Fits> {
    block::<lanes::Avx2>(inputs, x0, y0)
}

/// Wider registers where there are any; the same operations in the same order, so the same bits.
fn block_by_cpu(inputs: &Inputs, x0: usize, y0: usize) -> Box<Fits> {
    #[cfg(target_arch = "x86_64")]
    if lanes::has_avx2() {
        // SAFETY: the processor has what the function was compiled for.
        #[allow(unsafe_code)]
        return unsafe { block_avx2(inputs, x0, y0) };
    }
    block::<lanes::Portable>(inputs, x0, y0)
}

/// All fits of a picture: for every width, half and colour a plane.
pub(super) fn fits(inputs: &Inputs, threads: usize) -> Vec<[[Vec<f32>; 3]; 2]> {
    let (w, h) = (inputs.width, inputs.height);
    let corners: Vec<(usize, usize)> =
        (0..h).step_by(BLOCK).flat_map(|y| (0..w).step_by(BLOCK).map(move |x| (x, y))).collect();
    let one = |i: usize| block_by_cpu(inputs, corners[i].0, corners[i].1);
    let done = parallel(threads, corners.len(), one, &|_| {});
    let plane = || vec![0.0f32; w * h];
    let mut out: Vec<[[Vec<f32>; 3]; 2]> =
        WIDTHS.iter().map(|_| std::array::from_fn(|_| std::array::from_fn(|_| plane()))).collect();
    for ((x0, y0), block) in corners.into_iter().zip(done) {
        let across = BLOCK.min(w - x0);
        for (out, block) in out.iter_mut().flatten().flatten().zip(block.as_flattened().as_flattened()) {
            for y in 0..BLOCK.min(h - y0) {
                out[(y0 + y) * w + x0..][..across].copy_from_slice(&block[y * BLOCK..][..across]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    #[test]
    fn the_same_bits_on_any_processor() {
        let mut random = Pcg32::new(3, 4);
        let mut plane = || Plane::new(&(0..20 * 20).map(|_| random.next_f32()).collect::<Vec<_>>(), 20, 20);
        let mut side = || Side { rgb: std::array::from_fn(|_| plane()), variance: plane() };
        let sides = vec![side(), side()];
        let features = (0..4).map(|_| Feature { plane: plane(), noise: plane(), floor: 0.01 }).collect();
        let mut far = Plane::new(&[0.0; 400], 20, 20);
        far.data.iter_mut().step_by(7).for_each(|far| *far = f32::INFINITY);
        let inputs = Inputs { width: 20, height: 20, sides, far, features };
        for at in [0, BLOCK] {
            assert!(block_by_cpu(&inputs, at, at) == block::<lanes::Portable>(&inputs, at, at));
        }
    }
}
