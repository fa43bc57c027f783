//! A denoiser for pictures of the path tracer, guided by what is seen and by how noisy each pixel is.
//!
//! After Bitterli, Rousselle, Moon, Iglesias-Guitián, Adler, Mitchell, Jarosz and Novák 2016, "Nonlinearly Weighted
//! First-order Regression for Denoising Monte Carlo Renderings": at every pixel radiance is taken for a linear
//! function of albedo, normal, distance and coverage, fitted to the pixels around. Those whose own surroundings look
//! alike, as far as their noise lets one tell, weigh most (non-local means with variances: Rousselle, Knaus and
//! Zwicker 2012). The samples come in two halves that know nothing of each other: the weights of one serve the other,
//! and what one makes of a pixel is judged by the other, which chooses between several widths and leaves the pixel as
//! it is where that is better.

use crate::accel;
use crate::guide::{ALBEDO, DEPTH, Halves, NORMAL, SURFACE};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Pixels to each side that a pixel is fitted to.
const REACH: usize = 9;
/// Pixels to each side that are compared to say how alike two pixels are.
const PATCH: usize = 3;
/// Pixels around a block that it looks at.
const BORDER: usize = REACH + PATCH;
/// Pixels across and down of a block, which one thread works at.
const BLOCK: usize = 16;
/// Pixels that are worked at together.
const LANES: usize = 8;
/// Offsets of a window.
const OFFSETS: usize = (2 * REACH + 1) * (2 * REACH + 1);
/// How far apart two pixels may be, in standard deviations of their difference, to count as alike: candidates.
const WIDTHS: [f32; 2] = [0.35, 0.7];
/// Most that two pixels may be apart, in squares of the above; beyond that they have nothing to do with each other.
const APART: f32 = 8.0;
/// Darkest albedo that radiance is divided by.
const DARK: f32 = 0.05;
/// Added to the variance of features, as a part of their spread: what a fit may not make much of.
const RIDGE: f32 = 1e-3;

/// How much more fine detail there is than along a straight edge: surfaces are thin and have corners.
const FINE: f32 = 4.0;
/// Part of a pixel's brightness that differences are not told from noise, whatever a few samples say.
const FAINT: f32 = 0.03;
/// Most that a pixel's nearest kin may seem apart from it, in the squares above, and be taken for alike all the same:
/// samples that missed a rare bright path think too well of themselves.
const KIN: f32 = 1.0;
/// How much more than is usual around the two halves of a pixel have to differ to be believed.
const UNUSUAL: f32 = 6.0;

type Lanes = [f32; LANES];

/// A denoised picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Denoised {
    /// Radiance, plane after plane.
    pub rgb: [Vec<f32>; 3],
    /// Estimate of its standard error.
    pub error: [Vec<f32>; 3],
}

/// A plane with a border around it.
struct Plane {
    pitch: usize,
    data: Vec<f32>,
}

impl Plane {
    /// `plane` of so many pixels, its edge repeated outside.
    fn new(plane: &[f32], width: usize, height: usize) -> Self {
        let pitch = (width.next_multiple_of(BLOCK) + 2 * BORDER).next_multiple_of(LANES) + 2 * LANES;
        let rows = height.next_multiple_of(BLOCK) + 2 * BORDER;
        let mut data = Vec::with_capacity(pitch * rows);
        for y in 0..rows {
            let row = y.saturating_sub(BORDER).min(height - 1) * width;
            data.extend((0..pitch).map(|x| plane[row + x.saturating_sub(BORDER).min(width - 1)]));
        }
        Self { pitch, data }
    }

    /// The pixels from (x, y) on, with the border counted.
    #[inline(always)]
    fn at(&self, x: usize, y: usize) -> &Lanes {
        let from = y * self.pitch + x;
        self.data[from..].first_chunk().unwrap_or(&[0.0; LANES])
    }
}

/// One half, ready to be looked at.
struct Side {
    rgb: [Plane; 3],
    /// Of all three together.
    variance: Plane,
}

/// What a surface is like, one number of it.
struct Feature {
    plane: Plane,
    /// Variance of its noise.
    noise: Plane,
    /// Least spread of it that counts.
    floor: f32,
}

/// Everything that a block looks at.
struct View {
    width: usize,
    height: usize,
    sides: [Side; 2],
    /// 0 at pixels with samples, infinity at those without and outside the picture.
    far: Plane,
    features: Vec<Feature>,
}

/// What comes of a block: for every width, half and colour its pixels.
type Fits = [[[[f32; BLOCK * BLOCK]; 3]; 2]; WIDTHS.len()];

/// Mean of the (2 `reach` + 1)² pixels around each.
fn blur(plane: &[f32], width: usize, height: usize, reach: usize) -> Vec<f32> {
    let mut across = vec![0.0; plane.len()];
    for (to, from) in across.chunks_exact_mut(width).zip(plane.chunks_exact(width)) {
        for (x, to) in to.iter_mut().enumerate() {
            let part = &from[x.saturating_sub(reach)..(x + reach + 1).min(width)];
            *to = part.iter().sum::<f32>() / part.len() as f32;
        }
    }
    let mut out = vec![0.0; plane.len()];
    for (y, to) in out.chunks_exact_mut(width).enumerate() {
        let (from, end) = (y.saturating_sub(reach), (y + reach + 1).min(height));
        for row in from..end {
            for (to, from) in to.iter_mut().zip(&across[row * width..]) {
                *to += from;
            }
        }
        let share = 1.0 / (end - from) as f32;
        to.iter_mut().for_each(|v| *v *= share);
    }
    out
}

/// `f` of the pixels of two planes.
fn zip(a: &[f32], b: &[f32], f: impl Fn(f32, f32) -> f32) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()
}

/// Distances of a block's pixels to those around them: for each group of lanes all offsets.
#[inline(always)]
fn distances<L: accel::Lanes>(side: &Side, far: &Plane, x0: usize, y0: usize, out: &mut [Lanes]) {
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

/// Value at its own pixel of the linear function of `K` features that fits the pixels around best: for all three
/// colours of `target`.
#[inline(always)]
// Rows of two matrices at once: indices say what happens.
#[allow(clippy::needless_range_loop)]
fn fit<L: accel::Lanes, const K: usize>(
    features: &[(&Feature, f32)],
    target: &[Plane; 3],
    distance: &[Lanes],
    nearest: L,
    width: f32,
    x: usize,
    y: usize,
) -> [Lanes; 3] {
    // Loops throughout: a closure over lanes would not be compiled for the lanes' instructions.
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    // Upper triangle of the normal equations: features, then one; and right-hand sides.
    let mut s = [[zero; K]; K];
    let (mut s1, mut count) = ([zero; K], zero);
    let (mut t, mut t1) = ([[zero; 3]; K], [zero; 3]);
    let (mut own, mut noise, mut scale) = ([zero; K], [zero; K], [zero; K]);
    for k in 0..K {
        own[k] = L::from_array(features[k].0.plane.at(x, y));
        noise[k] = L::from_array(features[k].0.noise.at(x, y));
        scale[k] = L::splat(features[k].1);
    }
    let sharp = L::splat(1.0 / (APART * width * width));
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
            let mut colour = [zero; 3];
            count = count.add(w);
            for c in 0..3 {
                colour[c] = L::from_array(target[c].at(qx, qy));
                t1[c] = w.mul_add(colour[c], t1[c]);
            }
            let mut f = [zero; K];
            for k in 0..K {
                f[k] = L::from_array(features[k].0.plane.at(qx, qy)).sub(own[k]).mul(scale[k]);
            }
            for k in 0..K {
                let wf = w.mul(f[k]);
                s1[k] = s1[k].add(wf);
                for c in 0..3 {
                    t[k][c] = wf.mul_add(colour[c], t[k][c]);
                }
                for j in k..K {
                    s[k][j] = wf.mul_add(f[j], s[k][j]);
                }
            }
        }
    }
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

/// What a reconstruction filter does to pixels that are means of their own samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Footprint {
    /// Weights of the pixels in a row or column that do to a smooth picture what the filter does to samples; of an odd
    /// number, the middle one for the pixel itself.
    pub taps: Vec<f32>,
    /// Part of a pixel's variance that is in the filtered picture, but not in the weighted pixels: of where in a pixel
    /// its samples lie.
    pub leftover: f32,
    /// Part of a pixel's variance that is in the filtered picture.
    pub kept: f32,
    /// What the filter shows of an edge and the weighted pixels do not, squared, as a part of the squared second
    /// differences of the pixels there: mean over where in a pixel a straight edge may lie.
    pub fine: f32,
}

impl Footprint {
    /// Of a separable filter with this half width, in pixels.
    pub fn new(radius: f32, filter: impl Fn(f32) -> f32) -> Self {
        const STEPS: usize = 64;
        let border = (radius - 0.5).ceil().max(0.0) as usize;
        let at = |pixel: usize, step: usize| {
            let x = pixel as f32 - border as f32 + (step as f32 + 0.5) / STEPS as f32 - 0.5;
            (x, if x.abs() > radius { 0.0 } else { filter(x) })
        };
        let all = |f: &dyn Fn(f32, f32) -> f32| -> Vec<f32> {
            let of =
                |pixel| (0..STEPS).map(|s| at(pixel, s)).map(|(x, g)| f(x, g)).sum::<f32>() / STEPS as f32;
            (0..=2 * border).map(of).collect()
        };
        let total: f32 = all(&|_, g| g).iter().sum();
        let (mean, square) = (all(&|_, g| g / total), all(&|_, g| (g / total) * (g / total)));
        let spread: f32 = all(&|x, g| x * x * g / total).iter().sum();
        // The means of the filter over pixels spread as much as the filter and a pixel together, and a pixel is there
        // already: twice the twelfth that a pixel spreads has to go.
        let place = |i: usize| i as f32 - border as f32;
        let now: f32 = mean.iter().enumerate().map(|(i, w)| place(i) * place(i) * w).sum();
        let missing = 0.5 * (spread - 1.0 / 12.0 - now);
        let width = mean.len();
        let mut taps = vec![0.0; width + 2];
        for (i, w) in mean.iter().enumerate() {
            taps[i] += missing * w;
            taps[i + 1] += (1.0 - 2.0 * missing) * w;
            taps[i + 2] += missing * w;
        }
        let padded = |i: usize, of: &[f32]| if i == 0 || i > width { 0.0 } else { of[i - 1] };
        let own: f32 = square.iter().sum();
        let both: f32 = taps.iter().enumerate().map(|(i, w)| w * padded(i, &mean)).sum();
        let weights: f32 = taps.iter().map(|w| w * w).sum();
        let leftover = (own * own - 2.0 * both * both + weights * weights).max(0.0);
        if radius <= 0.5 {
            return Self { taps: vec![1.0], leftover: 0.0, kept: 1.0, fine: 0.0 };
        }
        // Edges at each step of the filter, dark to the left and bright to the right.
        let cells: Vec<f32> =
            (0..width * STEPS).map(|i| at(i / STEPS, i % STEPS).1 / (total * STEPS as f32)).collect();
        let (mut missed, mut bent) = (0.0, 0.0);
        for edge in 0..=cells.len() {
            let seen: f32 = cells[edge..].iter().sum();
            let lit = |pixel: isize| {
                (((pixel + 1) * STEPS as isize - edge as isize) as f32 / STEPS as f32).clamp(0.0, 1.0)
            };
            let shown: f32 = taps.iter().zip(-1..).map(|(w, pixel)| w * lit(pixel)).sum();
            let own = border as isize;
            missed += (seen - shown) * (seen - shown);
            bent += (lit(own - 1) + lit(own + 1) - 2.0 * lit(own)).powi(2);
        }
        Self { taps, leftover, kept: own * own, fine: missed / bent }
    }

    /// `plane` as the filter would show it.
    fn apply(&self, plane: &[f32], width: usize, height: usize) -> Vec<f32> {
        let half = self.taps.len() / 2;
        let mut across = vec![0.0; plane.len()];
        for (to, from) in across.chunks_exact_mut(width).zip(plane.chunks_exact(width)) {
            for (x, to) in to.iter_mut().enumerate() {
                let at = |i: usize| from[(x + i).saturating_sub(half).min(width - 1)];
                *to = self.taps.iter().enumerate().map(|(i, w)| w * at(i)).sum();
            }
        }
        let mut out = vec![0.0; plane.len()];
        for (y, to) in out.chunks_exact_mut(width).enumerate() {
            for (i, w) in self.taps.iter().enumerate() {
                let row = (y + i).saturating_sub(half).min(height - 1) * width;
                for (to, from) in to.iter_mut().zip(&across[row..]) {
                    *to += w * from;
                }
            }
        }
        out
    }
}

/// All fits of a block.
#[inline(always)]
fn block<L: accel::Lanes>(view: &View, x0: usize, y0: usize) -> Box<Fits> {
    let groups = BLOCK * BLOCK / LANES;
    let mut apart = [vec![[0.0; LANES]; groups * OFFSETS], vec![[0.0; LANES]; groups * OFFSETS]];
    for (side, out) in view.sides.iter().zip(&mut apart) {
        distances::<L>(side, &view.far, x0, y0, out);
    }
    // Features that tell anything here.
    let mut told = Vec::new();
    for feature in &view.features {
        let plane = &feature.plane;
        let (mut sum, mut squares, mut n) = (0.0f64, 0.0f64, 0.0f64);
        for y in y0 + BORDER - REACH..(y0 + BLOCK + BORDER + REACH).min(view.height + BORDER) {
            for x in x0 + BORDER - REACH..(x0 + BLOCK + BORDER + REACH).min(view.width + BORDER) {
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
            let target = &view.sides[half].rgb;
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
fn block_avx2(view: &View, x0: usize, y0: usize) -> Box<Fits> {
    block::<accel::Avx2>(view, x0, y0)
}

/// Wider registers where there are any; the same operations in the same order, so the same bits.
fn block_by_cpu(view: &View, x0: usize, y0: usize) -> Box<Fits> {
    #[cfg(target_arch = "x86_64")]
    if accel::has_avx2() {
        // SAFETY: the processor has what the function was compiled for.
        #[allow(unsafe_code)]
        return unsafe { block_avx2(view, x0, y0) };
    }
    block::<accel::Portable>(view, x0, y0)
}

/// All fits of a picture: for every width, half and colour a plane.
fn fits(view: &View, threads: usize) -> Vec<[[Vec<f32>; 3]; 2]> {
    let (w, h) = (view.width, view.height);
    let corners: Vec<(usize, usize)> =
        (0..h).step_by(BLOCK).flat_map(|y| (0..w).step_by(BLOCK).map(move |x| (x, y))).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        while let Some(&(x, y)) = corners.get(next.fetch_add(1, Ordering::Relaxed)) {
            done.push((x, y, block_by_cpu(view, x, y)));
        }
        done
    };
    let done: Vec<_> = std::thread::scope(|scope| {
        let all: Vec<_> = (0..threads.clamp(1, corners.len())).map(|_| scope.spawn(work)).collect();
        all.into_iter().flat_map(|t| t.join().unwrap_or_else(|e| std::panic::resume_unwind(e))).collect()
    });
    let plane = || vec![0.0f32; w * h];
    let mut out: Vec<[[Vec<f32>; 3]; 2]> =
        WIDTHS.iter().map(|_| std::array::from_fn(|_| std::array::from_fn(|_| plane()))).collect();
    for (x0, y0, block) in done {
        let across = BLOCK.min(w - x0);
        for (out, block) in out.iter_mut().flatten().flatten().zip(block.as_flattened().as_flattened()) {
            for y in 0..BLOCK.min(h - y0) {
                out[(y0 + y) * w + x0..][..across].copy_from_slice(&block[y * BLOCK..][..across]);
            }
        }
    }
    out
}

/// Denoises what `halves` say. `picture` is what the reconstruction filter, of this `footprint`, makes of the same
/// samples: R, G, B, plane after plane. The same bits for any number of `threads`.
pub fn denoise(halves: &Halves, picture: &[Vec<f32>; 3], footprint: &Footprint, threads: usize) -> Denoised {
    let (w, h) = (halves.width, halves.height);
    let pixels = w * h;
    let both = |i: usize| halves.count[0][i] > 0.0 && halves.count[1][i] > 0.0;
    if !(0..pixels).any(both) {
        // There is nothing to compare.
        let error = |plane: &Vec<f32>| plane.iter().map(|v| (footprint.kept * v).sqrt()).collect();
        return Denoised { rgb: picture.clone(), error: halves.variance.each_ref().map(error) };
    }
    let [a, b] = &halves.mean;
    let part = zip(&halves.count[0], &halves.count[1], |a, b| if a + b > 0.0 { a / (a + b) } else { 0.5 });
    let mean = |c: usize| -> Vec<f32> {
        (0..pixels).map(|i| part[i] * a[c][i] + (1.0 - part[i]) * b[c][i]).collect()
    };
    // Radiance over albedo is smoother than radiance.
    let albedo: [Vec<f32>; 3] =
        std::array::from_fn(|c| mean(ALBEDO.start + c).into_iter().map(|albedo| albedo.max(DARK)).collect());
    // Where one half has no samples, it is given what the other has.
    let light: [[Vec<f32>; 3]; 2] = std::array::from_fn(|half| {
        std::array::from_fn(|c| {
            let of = |i: usize| {
                let from = if halves.count[half][i] > 0.0 { half } else { 1 - half };
                halves.mean[from][c][i] / albedo[c][i]
            };
            (0..pixels).map(of).collect()
        })
    });
    // Samples are better spread than by chance: the difference of the halves knows by how much, the variance of
    // samples where.
    let told: [Vec<f32>; 3] =
        std::array::from_fn(|c| zip(&halves.variance[c], &albedo[c], |v, a| v / (a * a)));
    let seen: [Vec<f32>; 3] = std::array::from_fn(|c| {
        (0..pixels).map(|i| (light[0][c][i] - light[1][c][i]).powi(2) * part[i] * (1.0 - part[i])).collect()
    });
    let sum = |planes: &[Vec<f32>; 3]| -> Vec<f32> {
        (0..pixels).map(|i| planes[0][i] + planes[1][i] + planes[2][i]).collect()
    };
    let ratio = zip(&blur(&sum(&seen), w, h, 4), &blur(&sum(&told), w, h, 4), |seen, told| {
        (seen / told.max(1e-20)).clamp(0.02, 2.0)
    });
    // Not so where a rare bright path came to one half alone.
    let own = zip(&sum(&seen), &sum(&told), |seen, told| (seen / told.max(1e-20)).min(1.0));
    let ratio = zip(&ratio, &own, |around, own| if own > UNUSUAL * around { own } else { around });
    let variance: [Vec<f32>; 3] = std::array::from_fn(|c| zip(&told[c], &ratio, |v, r| v * r));
    let whole = sum(&variance);
    let own = |c: usize, i: usize| part[i] * light[0][c][i] + (1.0 - part[i]) * light[1][c][i];
    let side = |half: usize| {
        let variance = |i: usize| {
            let p = if half == 0 { part[i] } else { 1.0 - part[i] };
            let faint: f32 = (0..3).map(|c| (FAINT * own(c, i)).powi(2)).sum();
            whole[i] / p.max(0.01) + faint
        };
        Side {
            rgb: std::array::from_fn(|c| Plane::new(&light[half][c], w, h)),
            variance: Plane::new(&(0..pixels).map(variance).collect::<Vec<_>>(), w, h),
        }
    };
    let [depth, surface] = [DEPTH, SURFACE].map(mean);
    let farness = depth.iter().sum::<f32>() / surface.iter().sum::<f32>().max(1.0);
    let feature = |(value, floor): (usize, f32)| {
        let apart = |i: usize| (a[value][i] - b[value][i]).powi(2) * part[i] * (1.0 - part[i]);
        let noise = blur(&(0..pixels).map(apart).collect::<Vec<_>>(), w, h, 1);
        Feature { plane: Plane::new(&mean(value), w, h), noise: Plane::new(&noise, w, h), floor }
    };
    let floors = NORMAL.chain(ALBEDO).map(|i| (i, 0.005)).chain([(DEPTH, 1e-4 * farness), (SURFACE, 0.01)]);
    let met: Vec<bool> = (0..pixels).map(|i| halves.count[0][i] + halves.count[1][i] > 0.0).collect();
    let mut far = Plane::new(&vec![0.0; pixels], w, h);
    let pitch = far.pitch;
    for (at, far) in far.data.iter_mut().enumerate() {
        let (x, y) = ((at % pitch).wrapping_sub(BORDER), (at / pitch).wrapping_sub(BORDER));
        if x >= w || y >= h || !met[y * w + x] {
            *far = f32::INFINITY;
        }
    }
    let view =
        View { width: w, height: h, sides: [side(0), side(1)], far, features: floors.map(feature).collect() };
    let fits = fits(&view, threads);

    // All errors relative to how bright it is around.
    let bright: Vec<f32> = (0..pixels).map(|i| (0..3).map(|c| own(c, i)).sum()).collect();
    let dark = 0.01 * bright.iter().sum::<f32>() / pixels as f32;
    let scale: Vec<f32> =
        blur(&bright, w, h, 2).iter().map(|v| 1.0 / (v * v + dark * dark).max(1e-20)).collect();
    // Of a fit: its mean square error as the other half tells, and what of it is noise.
    let judge = |fit: &[[Vec<f32>; 3]; 2]| -> [Vec<f32>; 2] {
        let (mut error, mut noise) = (vec![0.0; pixels], vec![0.0; pixels]);
        for i in 0..pixels {
            let p = [part[i].max(0.01), (1.0 - part[i]).max(0.01)];
            for c in 0..3 {
                let d = fit[0][c][i] - fit[1][c][i];
                noise[i] += scale[i] * 0.25 * d * d;
                let across = |from: usize| {
                    let d = fit[from][c][i] - light[1 - from][c][i];
                    d * d - variance[c][i] / p[1 - from]
                };
                error[i] += scale[i] * 0.5 * (across(0) + across(1));
            }
            error[i] -= noise[i];
        }
        [blur(&error, w, h, 3), blur(&noise, w, h, 3)]
    };
    let judged: Vec<[Vec<f32>; 2]> = fits.iter().map(judge).collect();
    // Of each width the part that it has in a pixel: where it is best around.
    let mut parts: Vec<Vec<f32>> = vec![vec![0.0; pixels]; WIDTHS.len()];
    for i in 0..pixels {
        let best = |a: &usize, b: &usize| judged[*a][0][i].total_cmp(&judged[*b][0][i]);
        if let Some(best) = (0..WIDTHS.len()).min_by(best) {
            parts[best][i] = 1.0;
        }
    }
    let parts: Vec<Vec<f32>> = parts.iter().map(|part| blur(part, w, h, 2)).collect();
    let raw_noise = blur(&zip(&whole, &scale, |v, s| v * s), w, h, 3);
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; pixels]);
    let mut error: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; pixels]);
    let mut raw: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; pixels]);
    for i in 0..pixels {
        let mix = |of: &dyn Fn(usize) -> f32| (0..WIDTHS.len()).map(|k| parts[k][i] * of(k)).sum::<f32>();
        let noise = mix(&|k| judged[k][1][i]);
        let bias = (mix(&|k| judged[k][0][i]) - noise).max(0.0);
        // As much of the pixel itself as makes the sum of both errors least.
        let keep = if bias + raw_noise[i] > 0.0 { bias / (bias + raw_noise[i]) } else { 1.0 };
        let fit: [f32; 3] = std::array::from_fn(|c| mix(&|k| 0.5 * (fits[k][0][c][i] + fits[k][1][c][i])));
        // Errors around were seen relative to the brightness around, and are so here.
        let here = fit.iter().sum::<f32>().powi(2).min(1.0 / scale[i]) + dark * dark;
        let all = fit.iter().map(|v| v * v).sum::<f32>().max(1e-20);
        for c in 0..3 {
            let own = own(c, i);
            rgb[c][i] = albedo[c][i] * (fit[c] + keep * (own - fit[c]));
            raw[c][i] = albedo[c][i] * own;
            let of_fit = (noise + bias) * here * (fit[c] * fit[c] / all);
            let squared =
                (1.0 - keep) * (1.0 - keep) * of_fit + keep * keep * footprint.kept * variance[c][i];
            error[c][i] = albedo[c][i] * squared.max(0.0).sqrt();
        }
    }
    // What the filter shows and pixels cannot, where it is more than noise: where in a pixel an edge is.
    let mut out: [Vec<f32>; 3] = std::array::from_fn(|_| Vec::new());
    let mut fine: [Vec<f32>; 3] =
        std::array::from_fn(|c| zip(&picture[c], &footprint.apply(&raw[c], w, h), |p, f| p - f));
    if footprint.leftover > 0.0 {
        // It is to be expected where the picture bends.
        let mut bent = vec![0.0f32; pixels];
        for plane in &rgb {
            for y in 0..h {
                for x in 0..w {
                    let at = |x: usize, y: usize| plane[y.min(h - 1) * w + x.min(w - 1)];
                    let own = 2.0 * at(x, y);
                    let across = at(x.saturating_sub(1), y) + at(x + 1, y) - own;
                    let down = at(x, y.saturating_sub(1)) + at(x, y + 1) - own;
                    bent[y * w + x] += across * across + down * down;
                }
            }
        }
        let expected: Vec<f32> = blur(&bent, w, h, 1).iter().map(|v| FINE * footprint.fine * v).collect();
        let noise: Vec<f32> =
            (0..pixels).map(|i| (0..3).map(|c| variance[c][i] * albedo[c][i].powi(2)).sum()).collect();
        let noise = blur(&noise, w, h, 1);
        for i in 0..pixels {
            let share = expected[i] / (expected[i] + footprint.leftover * noise[i]).max(1e-30);
            fine.iter_mut().for_each(|plane| plane[i] *= share);
        }
    }
    for c in 0..3 {
        out[c] = zip(&footprint.apply(&rgb[c], w, h), &fine[c], |v, fine| v + fine);
        for i in (0..pixels).filter(|i| !met[*i]) {
            out[c][i] = picture[c][i];
        }
    }
    Denoised { rgb: out, error }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    const SIZE: usize = 48;

    /// Two halves of 8 samples with normal noise of this deviation each, around `truth`; albedo 1 and the first
    /// component of the normal as given, everything else alike.
    fn noisy(
        truth: impl Fn(usize, usize) -> f32,
        normal: impl Fn(usize, usize) -> f32,
        deviation: f32,
    ) -> Halves {
        let mut halves = Halves::new(SIZE, SIZE);
        let mut random = Pcg32::new(7, 1);
        for y in 0..SIZE {
            for x in 0..SIZE {
                let i = y * SIZE + x;
                for half in 0..2 {
                    halves.count[half][i] = 8.0;
                    for c in 0..3 {
                        halves.mean[half][c][i] =
                            truth(x, y) + deviation * 0.5f32.sqrt() * random.normal() / 2.0;
                        halves.mean[half][ALBEDO.start + c][i] = 1.0;
                    }
                    halves.mean[half][NORMAL.start][i] = normal(x, y);
                    halves.mean[half][DEPTH][i] = 1.0;
                    halves.mean[half][SURFACE][i] = 1.0;
                }
                for c in 0..3 {
                    halves.variance[c][i] = deviation * deviation / 16.0;
                }
            }
        }
        halves
    }

    fn raw(halves: &Halves) -> [Vec<f32>; 3] {
        std::array::from_fn(|c| {
            let sums = |half: usize| zip(&halves.mean[half][c], &halves.count[half], |v, n| v * n);
            let counts = zip(&halves.count[0], &halves.count[1], |a, b| (a + b).max(1.0));
            zip(&zip(&sums(0), &sums(1), |a, b| a + b), &counts, |sum, count| sum / count)
        })
    }

    fn clean(halves: &Halves, threads: usize) -> Denoised {
        denoise(halves, &raw(halves), &Footprint::new(0.5, |_| 1.0), threads)
    }

    fn squared_error(rgb: &[Vec<f32>; 3], truth: impl Fn(usize, usize) -> f32) -> f32 {
        let of = |(i, v): (usize, &f32)| (v - truth(i % SIZE, i / SIZE)).powi(2);
        rgb.iter().flat_map(|plane| plane.iter().enumerate().map(of)).sum::<f32>() / (3 * SIZE * SIZE) as f32
    }

    #[test]
    fn noise_around_a_constant_goes_and_its_rest_is_known() {
        let halves = noisy(|_, _| 1.0, |_, _| 0.0, 0.8);
        let before = squared_error(&raw(&halves), |_, _| 1.0);
        let out = clean(&halves, 2);
        let after = squared_error(&out.rgb, |_, _| 1.0);
        // 361 pixels of a window, most of them taken for alike.
        assert!(before > 60.0 * after, "{before} {after}");
        let claimed = out.error.iter().flatten().map(|e| e * e).sum::<f32>() / (3 * SIZE * SIZE) as f32;
        // What is left is mistaken for bias here and there: 4 times the square was measured.
        assert!((0.5..8.0).contains(&(claimed / after)), "{claimed} {after}");
    }

    #[test]
    fn the_same_bits_on_any_processor() {
        let mut random = Pcg32::new(3, 4);
        let mut plane = || Plane::new(&(0..20 * 20).map(|_| random.next_f32()).collect::<Vec<_>>(), 20, 20);
        let mut side = || Side { rgb: std::array::from_fn(|_| plane()), variance: plane() };
        let sides = [side(), side()];
        let features = (0..4).map(|_| Feature { plane: plane(), noise: plane(), floor: 0.01 }).collect();
        let mut far = Plane::new(&[0.0; 400], 20, 20);
        far.data.iter_mut().step_by(7).for_each(|far| *far = f32::INFINITY);
        let view = View { width: 20, height: 20, sides, far, features };
        for at in [0, BLOCK] {
            assert!(block_by_cpu(&view, at, at) == block::<accel::Portable>(&view, at, at));
        }
    }

    #[test]
    fn the_same_bits_for_any_number_of_threads() {
        let halves = noisy(|x, _| x as f32 / 8.0, |_, y| y as f32, 0.5);
        assert_eq!(clean(&halves, 1), clean(&halves, 4));
    }

    #[test]
    fn an_edge_that_the_normal_knows_stays_sharp() {
        let side = |x: usize, _: usize| if x < SIZE / 2 { 0.0 } else { 1.0 };
        let truth = |x: usize, y: usize| 1.0 + 0.5 * side(x, y);
        let halves = noisy(truth, side, 1.6);
        let mut out = clean(&halves, 2);
        let whole = squared_error(&raw(&halves), truth) / squared_error(&out.rgb, truth);
        assert!(whole > 20.0, "{whole}");
        // The pixels on both sides of it.
        for i in (0..SIZE * SIZE).filter(|i| !(SIZE / 2 - 1..=SIZE / 2).contains(&(i % SIZE))) {
            out.rgb.iter_mut().for_each(|plane| plane[i] = truth(i % SIZE, i / SIZE));
        }
        let edge = squared_error(&out.rgb, truth) * (SIZE / 2) as f32;
        assert!(squared_error(&raw(&halves), truth) > 10.0 * edge, "{edge}");
    }

    #[test]
    fn what_no_feature_knows_and_no_noise_hides_is_left_as_it_is() {
        // Spots of one pixel each, four deviations of the mean bright.
        let truth = |x: usize, y: usize| if (x * 7 + y * 13).is_multiple_of(11) { 1.4 } else { 1.0 };
        for deviation in [0.0, 0.04, 0.4] {
            let halves = noisy(truth, |_, _| 0.0, deviation);
            let (before, after) =
                (squared_error(&raw(&halves), truth), squared_error(&clean(&halves, 2).rgb, truth));
            assert!(after <= 1.05 * before + 1e-10, "{deviation}: {before} {after}");
        }
    }

    #[test]
    fn a_wrong_variance_is_noticed() {
        let halves = noisy(|_, _| 1.0, |_, _| 0.0, 0.8);
        let right = squared_error(&clean(&halves, 2).rgb, |_, _| 1.0);
        let mut wrong = halves;
        wrong.variance.iter_mut().flatten().for_each(|v| *v *= 1e-4);
        let wrong = squared_error(&clean(&wrong, 2).rgb, |_, _| 1.0);
        assert!(wrong > 10.0 * right, "{wrong} {right}");
    }

    #[test]
    fn pixels_without_samples_do_no_harm() {
        let mut halves = noisy(|_, _| 1.0, |_, _| 0.0, 0.4);
        for i in 0..SIZE * SIZE / 2 {
            for half in 0..2 {
                // All of the first rows, half of the next.
                if half == 1 || i < SIZE * SIZE / 4 {
                    halves.count[half][i] = 0.0;
                    halves.mean[half].iter_mut().for_each(|plane| plane[i] = 0.0);
                }
            }
        }
        let out = clean(&halves, 2);
        assert!(out.rgb.iter().chain(&out.error).flatten().all(|v| v.is_finite()));
        let rest = &out.rgb[0][SIZE * SIZE / 2..];
        let worst = rest.iter().map(|v| (v - 1.0).abs()).fold(0.0, f32::max);
        // 0.35 as rendered.
        assert!(worst < 0.2, "{worst}");
        // One half alone tells nothing.
        halves.count[1].fill(0.0);
        let out = clean(&halves, 2);
        assert_eq!(out.rgb, raw(&halves));
    }

    #[test]
    fn taps_do_to_means_what_the_filter_does_to_samples() {
        for stddev in [0.4, 0.5, 1.0, 2.0] {
            let filter = |x: f32| (-0.5 * (x / stddev) * (x / stddev)).exp();
            let foot = Footprint::new(4.0 * stddev, filter);
            let middle = (foot.taps.len() / 2) as f32;
            let moment =
                |n| foot.taps.iter().enumerate().map(|(i, w)| (i as f32 - middle).powi(n) * w).sum::<f32>();
            assert!((moment(0) - 1.0).abs() < 1e-4 && moment(1).abs() < 1e-4, "{foot:?}");
            assert!(
                (moment(2) - (stddev * stddev - 1.0 / 12.0)).abs() < 2e-3 * (1.0 + stddev * stddev),
                "{stddev}: {}",
                moment(2)
            );
            assert!(foot.leftover > 0.0 && foot.leftover < 0.2, "{foot:?}");
        }
    }
}
