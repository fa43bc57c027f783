//! Where a texel's refinement starts, in closed form.

use super::model::{N, STEEPEST, in_tangent_plane, linear, logarithm};
use super::profile::Profile;
use super::rays::{Ray, Rays};
use super::refine::GaussianPrior;
use super::scratch::Scratch;
use crate::lanes::{F, LANES, Mask};

/// A start of the shape: a, b, m, p, q. The two amplitudes follow by linear least squares.
type Shape = [f32; 5];

/// Starts of one texel: as if it had a ground (the readings less Lambert's share), and as if it were bare metal.
/// Values with weight 0 are not there.
fn shapes(
    ray: impl Fn(usize) -> Ray,
    value: impl Fn(usize) -> f32,
    weight: impl Fn(usize) -> f32,
    n: usize,
    order: &mut Vec<(f32, usize)>,
) -> Starts {
    let [d, a, b] = photometric_stereo(&ray, &value, &weight, n, order);
    let diffuse = |i: usize| {
        let [_, _, _, lx, ly, lz] = ray(i);
        d * (lz + a * lx + b * ly).max(0.0)
    };
    Starts {
        normal: [a, b],
        silk: gaussian(&ray, |i| value(i) - diffuse(i), &weight, n, [a, b]),
        metal: gaussian(&ray, &value, &weight, n, [a, b]),
        peak: peak(&ray, |i| value(i) - diffuse(i), &weight, n),
    }
}

/// What [`shapes`] finds.
struct Starts {
    /// Slopes of the normal that the ground alone gives.
    normal: [f32; 2],
    silk: Option<Shape>,
    metal: Option<Shape>,
    /// Slopes of the half vector of the reading that exceeds the ground most.
    peak: [f32; 2],
}

/// Lambert's share: D and the normal's slopes, from the darker readings of those in light. Sorted by how bright they
/// are for their cosine, the darkest tenth may be shadow and the brightest two fifths the highlight.
fn photometric_stereo(
    ray: &impl Fn(usize) -> Ray,
    value: &impl Fn(usize) -> f32,
    weight: &impl Fn(usize) -> f32,
    n: usize,
    order: &mut Vec<(f32, usize)>,
) -> [f32; 3] {
    order.clear();
    order.extend((0..n).filter(|&i| weight(i) > 0.0).map(|i| (value(i) / ray(i)[5], i)));
    let count = order.len();
    if count < 3 {
        return [0.0; 3];
    }
    let (low, high) = (count / 10, (count * 3 / 5).max(3));
    order.select_nth_unstable_by(high - 1, |a, b| a.0.total_cmp(&b.0));
    if low > 0 {
        order[..high].select_nth_unstable_by(low - 1, |a, b| a.0.total_cmp(&b.0));
    }
    let low = low.min(high - 3);
    let (mut h, mut g) = ([[0.0; 3]; 3], [0.0; 3]);
    for &(_, i) in &order[low..high] {
        let l = &ray(i)[3..];
        let w = f64::from(weight(i)).powi(2);
        for r in 0..3 {
            g[r] += w * f64::from(l[r] * value(i));
            for c in 0..3 {
                h[r][c] += w * f64::from(l[r] * l[c]);
            }
        }
    }
    let level = order[low..high].iter().map(|o| o.0).sum::<f32>() / (high - low) as f32;
    match solve(h, g) {
        Some([x, y, z]) if z > 0.0 && x.hypot(y) < f64::from(STEEPEST) * z => {
            [z as f32, (x / z) as f32, (y / z) as f32]
        }
        _ => [level.max(0.0), 0.0, 0.0],
    }
}

/// The Gaussian in the slopes of the half vector that the highlight is, after the logarithm a quadratic form with six
/// linear unknowns: ln S = c0 + c1 x + c2 y − (q11 x² + 2 q12 xy + q22 y²), each reading weighted by its square,
/// which the logarithm takes out of the noise.
fn gaussian(
    ray: &impl Fn(usize) -> Ray,
    highlight: impl Fn(usize) -> f32,
    weight: &impl Fn(usize) -> f32,
    n: usize,
    [a, b]: [f32; 2],
) -> Option<Shape> {
    let usable = |i: &usize| weight(*i) > 0.0;
    let most = (0..n).filter(usable).map(&highlight).fold(0.0, f32::max);
    let (mut h, mut g, mut count) = ([[0.0; 6]; 6], [0.0; 6], 0);
    for i in (0..n).filter(usable) {
        let [x, y, k, lx, ly, lz] = ray(i);
        let (s, m) = (highlight(i), lz + a * lx + b * ly);
        if !(s > 0.02 * most && s * weight(i) > 1.5 && m > 0.05) {
            continue;
        }
        let w = f64::from(s * weight(i)).powi(2);
        let y_log = f64::from((s / (m * k)).ln());
        let (x, y) = (f64::from(x), f64::from(y));
        let row = [1.0, x, y, -x * x, -2.0 * x * y, -y * y];
        for r in 0..6 {
            g[r] += w * row[r] * y_log;
            for c in 0..=r {
                h[r][c] += w * row[r] * row[c];
            }
        }
        count += 1;
    }
    if count < 6 {
        return None;
    }
    for r in 0..6 {
        for c in 0..r {
            h[c][r] = h[r][c];
        }
    }
    let [_, c1, c2, q11, q12, q22] = solve(h, g)?;
    let det = 2.0 * (q11 * q22 - q12 * q12);
    let mean = [(c1 * q22 - c2 * q12) / det, (c2 * q11 - c1 * q12) / det].map(|s| s as f32);
    let [m, p, q] = logarithm(in_tangent_plane(mean[0], mean[1], [q11, q12, q22].map(|q| q as f32)))?;
    (mean[0].hypot(mean[1]) < STEEPEST).then_some([mean[0], mean[1], m, p, q])
}

fn peak(
    ray: &impl Fn(usize) -> Ray,
    highlight: impl Fn(usize) -> f32,
    weight: &impl Fn(usize) -> f32,
    n: usize,
) -> [f32; 2] {
    let of = |i: usize| highlight(i) / (ray(i)[5] * ray(i)[2]);
    let best = (0..n).filter(|&i| weight(i) > 0.0).max_by(|&i, &j| of(i).total_cmp(&of(j)));
    best.map_or([0.0; 2], |i| [ray(i)[0], ray(i)[1]].map(|s| s.clamp(-0.7, 0.7)))
}

/// Cholesky's solution; `None` where the matrix is not positive.
pub(super) fn solve<const K: usize>(mut h: [[f64; K]; K], mut g: [f64; K]) -> Option<[f64; K]> {
    let largest = (0..K).map(|i| h[i][i]).fold(0.0, f64::max);
    for i in 0..K {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| h[i][k] * h[j][k]).sum();
            let v = h[i][j] - dot;
            if i == j {
                if v.is_nan() || v <= 1e-12 * largest {
                    return None;
                }
                h[i][i] = v.sqrt();
            } else {
                h[i][j] = v / h[j][j];
            }
        }
    }
    for i in 0..K {
        g[i] = (g[i] - (0..i).map(|k| h[i][k] * g[k]).sum::<f64>()) / h[i][i];
    }
    for i in (0..K).rev() {
        g[i] = (g[i] - (i + 1..K).map(|k| h[k][i] * g[k]).sum::<f64>()) / h[i][i];
    }
    Some(g)
}

/// The start that leaves least, with the linear numbers that belong to it.
pub(super) fn best<R: Rays>(
    rays: R,
    scratch: &mut Scratch,
    usual: &[Option<[f32; 3]>; LANES],
    profile: &Profile,
) -> [F; N] {
    let n = scratch.value.len();
    let starts: [Starts; LANES] = std::array::from_fn(|lane| {
        let (value, weight) = (&scratch.value, &scratch.weight);
        shapes(|i| rays.of(i, lane), |i| value[i].0[lane], |i| weight[i].0[lane], n, &mut scratch.order)
    });
    // Where the closed form fails, these stand in: as wide as highlights of cloth are, to each side, about the normal of
    // the ground and about the brightest reading.
    const WIDTHS: [[f32; 3]; 9] = [
        [2.4, 0.0, 0.0],
        [3.0, 1.0, 0.0],
        [3.0, -1.0, 0.0],
        [3.0, 0.0, 1.0],
        [3.0, 0.0, -1.0],
        [4.4, 1.0, 0.0],
        [4.4, -1.0, 0.0],
        [4.4, 0.0, 1.0],
        [4.4, 0.0, -1.0],
    ];
    let (mut best, mut least) = ([F::ZERO; N], F::splat(f32::INFINITY));
    let consider = |best: &mut [F; N], least: &mut F, shape: &dyn Fn(usize) -> Shape| {
        let shapes: [Shape; LANES] = std::array::from_fn(shape);
        let mut theta = [F::ZERO; N];
        for (j, t) in theta.iter_mut().skip(2).enumerate() {
            *t = F(std::array::from_fn(|lane| shapes[lane][j]));
        }
        let (d, a, left) = linear(rays, &scratch.value, &scratch.weight, &theta, profile);
        theta[0] = d;
        // A highlight of nothing has no slope to follow; this little is always allowed.
        theta[1] = a.max(F::splat(1e-4)).map(f32::ln);
        let better: Mask = least.above(left);
        for (b, t) in best.iter_mut().zip(theta) {
            *b = better.choose(t, *b);
        }
        *least = better.choose(left, *least);
    };
    let about = |at: [f32; 2], [m, p, q]: [f32; 3]| [at[0], at[1], m, p, q];
    consider(&mut best, &mut least, &|lane| {
        starts[lane].silk.unwrap_or(about(starts[lane].normal, WIDTHS[0]))
    });
    consider(&mut best, &mut least, &|lane| {
        starts[lane].metal.unwrap_or(about(starts[lane].peak, WIDTHS[0]))
    });
    if usual.iter().any(Option::is_some) {
        let usual = |lane: usize| usual[lane].unwrap_or(WIDTHS[0]);
        consider(&mut best, &mut least, &|lane| about(starts[lane].normal, usual(lane)));
        consider(&mut best, &mut least, &|lane| about(starts[lane].peak, usual(lane)));
    }
    // Within three deviations of the readings on average is near enough to go on from; and what is usual is a better
    // start than these (by `errors.failed` of `capture fit --truth`, as many
    // texels of kinran and karaori fail with them as without).
    let alone = F(usual.map(|u| if u.is_none() { 1.0 } else { 0.0 }));
    let poor: Mask = alone * least.above(F::splat(9.0 * n as f32));
    if poor.any() {
        let found = best;
        for width in WIDTHS {
            consider(&mut best, &mut least, &|lane| about(starts[lane].normal, width));
            consider(&mut best, &mut least, &|lane| about(starts[lane].peak, width));
        }
        for (b, found) in best.iter_mut().zip(found) {
            *b = poor.choose(*b, found);
        }
    }
    best
}

/// How many more starts a texel gets that is in doubt.
const SECOND_CHANCES: usize = 3;

/// Normals all over the hemisphere, with the shape that was found and what is usual: those that leave least, each away
/// from the others.
pub(super) fn elsewhere<R: Rays>(
    rays: R,
    scratch: &mut Scratch,
    usual: &[Option<[f32; 3]>; LANES],
    known: &GaussianPrior,
    profile: &Profile,
    found: &[F; N],
) -> [[F; N]; SECOND_CHANCES] {
    scratch.weight.clone_from(&scratch.stated);
    let usual: [F; 3] = std::array::from_fn(|j| F(usual.map(|u| u.unwrap_or([3.0, 0.0, 0.0])[j])));
    let mut best = [*found; SECOND_CHANCES];
    let mut least = [F::splat(f32::INFINITY); SECOND_CHANCES];
    for (ring, tilt) in [0.0f32, 20.0, 37.0, 53.0, 67.0, 78.0].into_iter().enumerate() {
        for i in 0..(6 * ring).max(1) {
            let turn = (i as f32 + 0.5 * (ring % 2) as f32) / (6 * ring).max(1) as f32;
            let at = glam::Vec2::from_angle(std::f32::consts::TAU * turn) * tilt.to_radians().tan();
            let mut theta = [F::ZERO, F::ZERO, F::splat(at.x), F::splat(at.y), usual[0], usual[1], usual[2]];
            let (d, a, left) = linear(rays, &scratch.value, &scratch.weight, &theta, profile);
            theta[0] = d;
            theta[1] = a.max(F::splat(1e-4)).map(f32::ln);
            let mut left = left + known.cost(&theta);
            // Into its place among the best.
            for (b, l) in best.iter_mut().zip(&mut least) {
                let better = l.above(left);
                for (b, t) in b.iter_mut().zip(&mut theta) {
                    (*b, *t) = (better.choose(*t, *b), better.choose(*b, *t));
                }
                (*l, left) = (better.choose(left, *l), better.choose(*l, left));
            }
        }
    }
    best
}
