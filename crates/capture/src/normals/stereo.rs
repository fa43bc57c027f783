//! The fit of eight texels in step.

use super::Options;
use crate::lanes::{F, LANES, Mask};
use glam::Vec3;
use yugen_optics::random::Pcg32;

/// A light as eight texels see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light {
    /// The direction toward it times its irradiance.
    l: [F; 3],
    /// One over the irradiance.
    dim: F,
    /// Unit half vector between it and the eye.
    half: [F; 3],
    /// Cosine between it and the eye.
    apart: F,
}

const UP: [F; 3] = [F::ZERO, F::ZERO, F::ONE];

impl Light {
    /// Stands where there is no reading.
    pub const BESIDE: Self = Self { l: UP, dim: F::ONE, half: UP, apart: F::ONE };

    /// `None` below the horizon.
    pub fn of(light: Vec3, eye: Vec3, irradiance: f32) -> Option<Self> {
        // A degree above it: nothing that grazes so tells anything.
        if !(light.z > 0.0175 && eye.z > 0.0175 && irradiance > 0.0) {
            return None;
        }
        let l = (light * irradiance).to_array().map(F::splat);
        let half = (light + eye).normalize().to_array().map(F::splat);
        Some(Self { l, dim: F::splat(1.0 / irradiance), half, apart: F::splat(light.dot(eye)) })
    }

    /// Of slopes x, y of the half vector, anything, and the direction times its irradiance.
    pub fn of_ray([x, y, _, lx, ly, lz]: [F; 6]) -> Self {
        let flat = F::ONE / (x * x + y * y + 1.0).sqrt();
        let l = [lx, ly, lz];
        let (dim, half) = (F::ONE / dot(&l, &l).sqrt(), [x * flat, y * flat, flat]);
        let cos = dot(&l, &half) * dim;
        Self { l, dim, half, apart: cos * cos * 2.0 - 1.0 }
    }

    /// Takes over one texel's.
    pub fn put(&mut self, lane: usize, light: &Self) {
        let pairs = self.l.iter_mut().zip(light.l).chain(self.half.iter_mut().zip(light.half));
        pairs.for_each(|(to, from)| to.0[lane] = from.0[lane]);
        self.dim.0[lane] = light.dim.0[lane];
        self.apart.0[lane] = light.apart.0[lane];
    }

    /// Unit, of the first texel.
    pub fn toward(&self) -> Vec3 {
        Vec3::from(self.l.map(|v| v.0[0])).normalize_or_zero()
    }
}

/// The readings of eight texels.
#[derive(Default)]
pub(crate) struct Scratch {
    /// Mean of the channels, one a reading.
    pub value: Vec<F>,
    pub channels: [Vec<F>; 3],
    /// 1 where there is one.
    pub usable: Vec<F>,
}

impl Scratch {
    /// Turns the readings of up to eight texels on their side.
    pub fn gather<'a>(&mut self, used: &[usize], values: impl Fn(usize) -> Option<&'a [[f32; 3]]>) {
        for list in [&mut self.value, &mut self.usable].into_iter().chain(&mut self.channels) {
            list.clear();
            list.resize(used.len(), F::ZERO);
        }
        for (lane, values) in (0..LANES).filter_map(|lane| Some((lane, values(lane)?))) {
            for (to, &from) in used.iter().enumerate() {
                let Some(rgb) = values.get(from) else { continue };
                let value = (rgb[0] + rgb[1] + rgb[2]) * (1.0 / 3.0);
                if value.is_finite() {
                    self.channels.iter_mut().zip(*rgb).for_each(|(channel, v)| channel[to].0[lane] = v);
                    self.value[to].0[lane] = value;
                    self.usable[to].0[lane] = 1.0;
                }
            }
        }
    }
}

/// By what a ground departs from Lambert's law.
#[derive(Clone, Copy)]
pub(crate) enum Law {
    Lambert,
    Coated,
    /// Oren and Nayar's B/A: how much is added to Lambert's share where light and eye are on one side.
    Rough(f32),
}

/// How eight texels are to be fitted.
#[derive(Clone, Copy)]
pub(crate) struct Task {
    pub law: Law,
    pub options: Options,
    /// A part of the albedo by which every reading may be off besides its noise: what shadows that are not quite black, light
    /// from neighbours and the law itself make of it.
    pub slack: f32,
}

impl Task {
    /// For the first passes, which are to find the way.
    fn coarse(&self) -> f32 {
        (4.0 * self.slack).min(self.slack.max(0.25))
    }
}

/// So many triplets are tried: with two fifths of the readings wrong one in five is right, and 24 miss once in two hundred.
const TRIPLETS: usize = 24;
/// Determinants below this magnify noise tenfold and more.
const FLATTEST: f32 = 0.02;

/// Triplets of lights that are far from lying in a plane, spread over all of them; the same each time.
pub(crate) fn triplets(toward: &[Vec3]) -> Vec<[usize; 3]> {
    let volume = |[i, j, k]: [usize; 3]| toward[i].dot(toward[j].cross(toward[k])).abs();
    let n = toward.len();
    let mut all: Vec<[usize; 3]> = Vec::new();
    if n <= 12 {
        for k in 2..n {
            all.extend((1..k).flat_map(|j| (0..j).map(move |i| [i, j, k])));
        }
    } else {
        // Among a few hundred the larger half is as good as that of all.
        let mut rng = Pcg32::new(1, 3);
        let draw = |rng: &mut Pcg32| ((rng.next_f32() * n as f32) as usize).min(n - 1);
        for _ in 0..16 * TRIPLETS {
            let t = [draw(&mut rng), draw(&mut rng), draw(&mut rng)];
            if t[0] != t[1] && t[1] != t[2] && t[0] != t[2] {
                all.push(t);
            }
        }
    }
    all.sort_by(|a, b| volume(*b).total_cmp(&volume(*a)));
    // Lights of a narrow dome have no better ones than these.
    let least = FLATTEST.min(0.25 * all.first().map_or(0.0, |t| volume(*t)));
    all.truncate(((all.len() * 3).div_ceil(5)).max(TRIPLETS));
    all.retain(|t| volume(*t) > least.max(1e-5));
    let wanted = TRIPLETS.min(all.len());
    (0..wanted).map(|i| all[i * all.len() / wanted]).collect()
}

/// What was found, eight at a time.
pub(crate) struct Solved {
    /// Albedo times normal.
    pub g: [F; 3],
    /// Degrees.
    pub error: F,
    pub confidence: F,
    /// Root mean square of what readings that count are off, in their standard deviations.
    pub residual: F,
    /// Readings that count.
    pub agreeing: F,
    /// Robust, of all readings.
    pub cost: F,
}

/// Cosine between normal and half vector from which a brighter reading may be a highlight: 40°. Wider lobes than that
/// describes are not told from a ground by their shape.
const SHINY: f32 = 0.766;
/// Passes with the coarse slack, and with the fine one.
const PASSES: [usize; 2] = [4, 6];

/// A reading beside what g says of it.
struct Beside {
    /// What g alone would read by Lambert's law, and what the law makes of it: what the coat lets through.
    lit: F,
    through: F,
    /// Squares of the standard deviation and of the difference.
    variance: F,
    off: F,
    /// Whether it is too bright, and whether a highlight may stand there.
    bright: Mask,
    shiny: Mask,
}

impl Beside {
    /// Whether it is brighter than anything explains.
    #[inline(always)]
    fn strange(&self) -> Mask {
        self.bright * (F::ONE - self.shiny)
    }

    #[inline(always)]
    fn loss(&self) -> F {
        loss(self.variance, self.off, self.strange())
    }
}

/// The length of g, one over it, and the cosine's threshold times it.
#[derive(Clone, Copy)]
struct Size {
    length: F,
    inverse: F,
}

impl Size {
    #[inline(always)]
    fn of(g: &[F; 3]) -> Self {
        let length = (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt().max(F::splat(1e-12));
        Self { length, inverse: F::ONE / length }
    }
}

#[inline(always)]
fn dot(a: &[F; 3], b: &[F; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// 1 − (1 − c)⁵.
#[inline(always)]
fn through_coat(cos: F) -> F {
    let out = F::ONE - cos.clamp(0.0, 1.0);
    let out2 = out * out;
    F::ONE - out2 * out2 * out
}

/// Oren and Nayar 1994 over Lambert's law as Fujii has it (see the model `oren_nayar`): 1 + B/A cos Δφ sin α tan β where light
/// and eye stand on one side of the normal, 1 + B/A cos Δφ sin α sin β where not. `cos` is the light's cosine, `g_half` g times
/// the half vector.
#[inline(always)]
fn of_rough(light: &Light, cos: F, g_half: F, inverse: F, rough: f32) -> F {
    // The eye is the light mirrored at the half vector.
    let eye = (g_half * inverse * ((light.apart + 1.0) * 2.0).sqrt() - cos).max(F::ZERO);
    let beside = light.apart - cos * eye;
    let one_side = beside.above(F::ZERO);
    F::ONE + beside / one_side.choose(cos.max(eye).max(F::splat(0.05)), F::ONE) * rough
}

#[inline(always)]
fn beside(
    light: &Light,
    value: F,
    g: &[F; 3],
    size: Size,
    slack: f32,
    law: Law,
    options: &Options,
) -> Beside {
    let lit = dot(g, &light.l).max(F::ZERO);
    let g_half = dot(g, &light.half);
    let cos = lit * size.inverse * light.dim;
    let through = match law {
        Law::Lambert => F::ONE,
        Law::Coated => through_coat(cos),
        Law::Rough(rough) => of_rough(light, cos, g_half, size.inverse, rough),
    };
    let seen = lit * through;
    let deviation = seen.max(value) * options.noise + (size.length * slack + options.floor);
    let off = value - seen;
    Beside {
        lit,
        through,
        variance: deviation * deviation,
        off: off * off,
        bright: off.above(F::ZERO),
        shiny: g_half.above(size.length * SHINY),
    }
}

/// ln (a/b), straight between powers of two: for a score that is near enough, and it grows as it should.
#[inline(always)]
fn rough_ln(a: F, b: F) -> F {
    let mut out = F::ZERO;
    for i in 0..LANES {
        let bits = a.0[i].to_bits() as i32 - b.0[i].to_bits() as i32;
        out.0[i] = bits as f32 * (std::f32::consts::LN_2 / 8_388_608.0);
    }
    out
}

/// Geman and McClure's loss, and the logarithm (Cauchy's) where a reading is brighter than anything explains.
#[inline(always)]
fn loss(variance: F, off: F, strange: Mask) -> F {
    let sum = variance + off;
    strange.choose(rough_ln(sum, variance), off / sum)
}

/// The weight of a reading in least squares: over its variance and, where the loss has it so, less.
#[inline(always)]
fn weight(b: &Beside) -> F {
    let w = F::ONE / (b.variance + b.off);
    b.strange().choose(w, w * w * b.variance)
}

#[inline(always)]
fn cost_of_candidate(
    lights: &[Light],
    value: &[F],
    usable: &[F],
    g: &[F; 3],
    slack: f32,
    options: &Options,
) -> F {
    let size = Size::of(g);
    let mut sum = F::ZERO;
    for ((light, value), usable) in lights.iter().zip(value).zip(usable) {
        // By Lambert's law: what differs is little beside what shadows do.
        sum += beside(light, *value, g, size, slack, Law::Lambert, options).loss() * *usable;
    }
    // What looks away from the camera cannot be seen; NaN fails as well.
    g[2].above(F::ZERO).choose(sum, F::splat(f32::INFINITY))
}

#[inline(always)]
fn cross(a: &[F; 3], b: &[F; 3]) -> [F; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// g of three readings: Cramer's rule.
#[inline(always)]
fn of_three(l: [&[F; 3]; 3], v: [F; 3]) -> ([F; 3], F) {
    let (c0, c1, c2) = (cross(l[1], l[2]), cross(l[2], l[0]), cross(l[0], l[1]));
    let det = dot(l[0], &c0);
    let sound = det.abs().above(F::splat(1e-6));
    let inverse = F::ONE / sound.choose(det, F::ONE);
    let mut g = [F::ZERO; 3];
    for i in 0..3 {
        g[i] = (c0[i] * v[0] + c1[i] * v[1] + c2[i] * v[2]) * inverse;
    }
    (g, sound)
}

/// Normal equations of weighted least squares: the lower half of the matrix, and the right hand side.
struct Equations {
    h: [F; 6],
    b: [F; 3],
}

impl Equations {
    /// Inverse of the matrix by its cofactors, as xx, xy, yy, xz, yz, zz, with so little added to its diagonal that
    /// it is there.
    #[inline(always)]
    fn inverse(&self) -> [F; 6] {
        let [xx, xy, yy, xz, yz, zz] = self.h;
        let little = (xx + yy + zz) * 1e-6 + 1e-20;
        let (xx, yy, zz) = (xx + little, yy + little, zz + little);
        let cofactors = [
            yy * zz - yz * yz,
            xz * yz - xy * zz,
            xx * zz - xz * xz,
            xy * yz - yy * xz,
            xy * xz - xx * yz,
            xx * yy - xy * xy,
        ];
        let det = xx * cofactors[0] + xy * cofactors[1] + xz * cofactors[3];
        let scale = F::ONE / det.max(F::splat(1e-30));
        let [xx, xy, yy, xz, yz, zz] = cofactors;
        [xx * scale, xy * scale, yy * scale, xz * scale, yz * scale, zz * scale]
    }

    #[inline(always)]
    fn solution(&self) -> [F; 3] {
        let [xx, xy, yy, xz, yz, zz] = self.inverse();
        let b = &self.b;
        [dot(&[xx, xy, xz], b), dot(&[xy, yy, yz], b), dot(&[xz, yz, zz], b)]
    }
}

/// Readings whose weights are found before their moments are summed: they fit beside the lights in the nearest cache.
const CHUNK: usize = 32;

/// A reading's weight for the matrix, and its weight times its value for the right hand side.
#[derive(Clone, Copy)]
struct Weight {
    matrix: F,
    value: F,
}

/// Weights first and then one sum after another: of nine sums in one loop the compiler makes shuffles across the lanes, which
/// take twice the time of everything else here.
#[inline(always)]
fn equations(lights: &[Light], value: &[F], usable: &[F], g: &[F; 3], slack: f32, task: &Task) -> Equations {
    let size = Size::of(g);
    // Weights in units of the albedo, so that single precision holds their products.
    let unit = size.length * size.length;
    let mut weights = [Weight { matrix: F::ZERO, value: F::ZERO }; CHUNK];
    let (mut h, mut b) = ([F::ZERO; 6], [F::ZERO; 3]);
    for ((lights, value), usable) in lights.chunks(CHUNK).zip(value.chunks(CHUNK)).zip(usable.chunks(CHUNK)) {
        for (((light, value), usable), to) in lights.iter().zip(value).zip(usable).zip(&mut weights) {
            let at = beside(light, *value, g, size, slack, task.law, &task.options);
            let w = weight(&at) * *usable * at.lit.above(F::ZERO) * unit * at.through;
            *to = Weight { matrix: w * at.through, value: w * *value };
        }
        // As in Equations: xx, xy, yy, xz, yz, zz.
        for (h, [i, j]) in h.iter_mut().zip([[0, 0], [0, 1], [1, 1], [0, 2], [1, 2], [2, 2]]) {
            for (light, w) in lights.iter().zip(&weights) {
                *h += w.matrix * light.l[i] * light.l[j];
            }
        }
        for (i, b) in b.iter_mut().enumerate() {
            for (light, w) in lights.iter().zip(&weights) {
                *b += w.value * light.l[i];
            }
        }
    }
    Equations { h, b }
}

/// From the candidates to the one that costs least, and the least cost of any whose normal stands elsewhere.
#[inline(always)]
fn start(
    lights: &[Light],
    value: &[F],
    usable: &[F],
    triplets: &[[usize; 3]],
    task: &Task,
) -> ([F; 3], F, F) {
    let far = F::splat(f32::INFINITY);
    let (mut best, mut least, mut second) = ([F::ZERO, F::ZERO, F::splat(1e-6)], far, far);
    let slack = task.coarse();
    // No closure: it would not be compiled for the instructions that this function is.
    for t in 0..=triplets.len() {
        let (g, there) = match triplets.get(t) {
            Some(&[i, j, k]) => {
                let (g, sound) =
                    of_three([&lights[i].l, &lights[j].l, &lights[k].l], [value[i], value[j], value[k]]);
                (g, sound * usable[i] * usable[j] * usable[k])
            }
            // Of texels of which a triplet is never whole.
            None => (least_squares(lights, value, usable), F::ONE),
        };
        let cost = there.choose(cost_of_candidate(lights, value, usable, &g, slack, &task.options), far);
        let better = least.above(cost);
        // Elsewhere: 15° and more.
        let apart = (Size::of(&g).length * Size::of(&best).length * 0.966).above(dot(&g, &best));
        let loser = better.choose(least, cost);
        second = apart.choose(second.min(loser), second);
        for i in 0..3 {
            best[i] = better.choose(g[i], best[i]);
        }
        least = better.choose(cost, least);
    }
    (best, least, second)
}

/// Of all readings as they are.
#[inline(always)]
fn least_squares(lights: &[Light], value: &[F], usable: &[F]) -> [F; 3] {
    let (mut h, mut b) = ([F::ZERO; 6], [F::ZERO; 3]);
    for ((light, value), usable) in lights.iter().zip(value).zip(usable) {
        let [x, y, z] = light.l;
        let (v, ux, uy) = (*value * *usable, x * *usable, y * *usable);
        h[0] += ux * x;
        h[1] += ux * y;
        h[2] += uy * y;
        h[3] += ux * z;
        h[4] += uy * z;
        h[5] += z * z * *usable;
        b[0] += v * x;
        b[1] += v * y;
        b[2] += v * z;
    }
    Equations { h, b }.solution()
}

#[inline(always)]
fn kernel(lights: &[Light], value: &[F], usable: &[F], triplets: &[[usize; 3]], task: &Task) -> Solved {
    let (mut g, least, second) = start(lights, value, usable, triplets, task);
    for (slack, passes) in [task.coarse(), task.slack].into_iter().zip(PASSES) {
        let mut active = F::ONE;
        for _ in 0..passes {
            let new = equations(lights, value, usable, &g, slack, task).solution();
            let taken = active * new[2].above(F::ZERO);
            let (mut moved, mut length) = (F::ZERO, F::splat(1e-12));
            for i in 0..3 {
                let step = new[i] - g[i];
                moved += step * step;
                length += new[i] * new[i];
                g[i] = taken.choose(new[i], g[i]);
            }
            // A texel that stands still stays so, that its bits do not depend on who goes in step with it: .03°.
            active = taken * moved.above(length * 3e-7);
            if !active.any() {
                break;
            }
        }
    }
    judge(lights, value, usable, g, least, second, task)
}

#[inline(always)]
fn judge(lights: &[Light], value: &[F], usable: &[F], g: [F; 3], least: F, second: F, task: &Task) -> Solved {
    let size = Size::of(&g);
    let (mut sum, mut all) = (F::ZERO, F::ZERO);
    let (mut agreeing, mut against, mut squares, mut weights) = (F::ZERO, F::ZERO, F::ZERO, F::ZERO);
    for ((light, value), usable) in lights.iter().zip(value).zip(usable) {
        let at = beside(light, *value, &g, size, task.slack, task.law, &task.options);
        sum += at.loss() * *usable;
        all += *usable;
        let agrees = (at.variance * 4.0).above(at.off);
        let lit = at.lit.above(F::ZERO);
        agreeing += agrees * lit * *usable;
        // What may be a highlight is nothing against it.
        against += (F::ONE - agrees) * (F::ONE - at.bright * at.shiny) * *usable;
        let w = at.variance * weight(&at) * lit * *usable;
        squares += w * at.off / at.variance;
        weights += w;
    }
    // What is left over of the readings that count, a degree of freedom; no less than a fifth of what was said.
    let left = (squares / (weights - 3.0).max(F::splat(0.5))).max(F::splat(0.04));
    // Trace of the covariance across the normal, in units of the albedo.
    let n = [g[0] * size.inverse, g[1] * size.inverse, g[2] * size.inverse];
    let [xx, xy, yy, xz, yz, zz] = equations(lights, value, usable, &g, task.slack, task).inverse();
    let turned = [dot(&[xx, xy, xz], &n), dot(&[xy, yy, yz], &n), dot(&[xz, yz, zz], &n)];
    let across = (xx + yy + zz - dot(&turned, &n)).max(F::ZERO);
    let deviation = (across * left).sqrt() * DEGREES;
    // Readings that are neither of this normal nor of a highlight say that something else is at work: by how much, was
    // measured on rendered things with shadows and interreflection, where this is near the mean error throughout. So is
    // how much more it is where another normal describes the readings nearly as well.
    let doubtful = against / (agreeing + against).max(F::ONE);
    let rival = (second - least) / all.max(F::ONE) / apart_costs(task);
    // Three readings are met whatever they are: nothing tells whether they are the surface's.
    let unchecked = (F::splat(4.0) - agreeing).clamp(0.0, 1.0);
    let own = (deviation * deviation * 4.0 + doubtful * doubtful * 64.0 + unchecked * 36.0).sqrt();
    let error = own * (F::ONE + (rival.min(F::splat(10.0)) * -6.0).exp() * 2.0);
    let error = error.min(F::splat(90.0));
    let part = error * (1.0 / HALVED);
    let confidence = F::ONE / (F::ONE + part * part);
    Solved {
        g,
        error,
        confidence,
        residual: (squares / weights.max(F::splat(1e-6))).sqrt(),
        agreeing,
        cost: sum,
    }
}

/// What a normal 15° off costs a reading at the slack with which candidates were compared: a sixth of the albedo, beside
/// noise of 2 %.
fn apart_costs(task: &Task) -> f32 {
    let (off, slack) = (0.16f32, task.coarse() + 0.02);
    off * off / (off * off + slack * slack)
}

/// Expected degrees at which confidence is a half.
const HALVED: f32 = 3.0;
const DEGREES: f32 = 180.0 / std::f32::consts::PI;

/// Fits eight texels. With AVX2 where the machine has it: the operations and their order are the same, and so are the
/// bits.
pub(crate) fn solve_block(
    lights: &[Light],
    value: &[F],
    usable: &[F],
    triplets: &[[usize; 3]],
    task: &Task,
) -> Solved {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn avx2(l: &[Light], v: &[F], u: &[F], triplets: &[[usize; 3]], task: &Task) -> Solved {
            kernel(l, v, u, triplets, task)
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: asked in the line above.
            #[allow(unsafe_code)]
            return unsafe { avx2(lights, value, usable, triplets, task) };
        }
    }
    kernel(lights, value, usable, triplets, task)
}

/// Albedo of each channel, of the readings that agree.
pub(crate) fn albedo(
    lights: &[Light],
    value: &[F],
    channels: &[Vec<F>; 3],
    usable: &[F],
    solved: &Solved,
    task: &Task,
) -> [F; 3] {
    let size = Size::of(&solved.g);
    let (mut up, mut down) = ([F::ZERO; 3], F::splat(1e-20));
    for (i, light) in lights.iter().enumerate() {
        let at = beside(light, value[i], &solved.g, size, task.slack, task.law, &task.options);
        let seen = at.lit * at.through * size.inverse;
        let w = weight(&at) * usable[i] * seen;
        down += w * seen;
        for (up, channel) in up.iter_mut().zip(channels) {
            *up += w * channel[i];
        }
    }
    up.map(|v| (v / down).max(F::ZERO))
}

/// What readings cost with a model that is no [`Solved`].
pub(crate) struct Other {
    pub cost: F,
    /// By how much readings may be off besides their noise: as strict as the model can bear, which has more numbers.
    pub slack: F,
    /// That as a part of their level.
    pub part: F,
}

/// What readings cost with a model that says what is `seen`, and whose normal has the slopes `a` and `b`.
pub(crate) fn cost_of_other(
    lights: &[Light],
    value: &[F],
    usable: &[F],
    seen: &[F],
    [a, b]: [F; 2],
    task: &Task,
) -> Other {
    let (slack, part) = bearable(value, usable, seen, task.slack);
    let steep = (a * a + b * b + 1.0).sqrt() * SHINY;
    let mut cost = F::ZERO;
    for (i, light) in lights.iter().enumerate() {
        let shiny = (light.half[2] + light.half[0] * a + light.half[1] * b).above(steep);
        cost += cost_of_reading(value[i], seen[i], shiny, slack, &task.options) * usable[i];
    }
    Other { cost, slack, part }
}

/// What they cost by the same measure with what was found.
pub(crate) fn cost(lights: &[Light], value: &[F], usable: &[F], solved: &Solved, slack: F, task: &Task) -> F {
    let size = Size::of(&solved.g);
    let mut cost = F::ZERO;
    for (i, light) in lights.iter().enumerate() {
        let at = beside(light, value[i], &solved.g, size, task.slack, task.law, &task.options);
        cost += cost_of_reading(value[i], at.lit * at.through, at.shiny, slack, &task.options) * usable[i];
    }
    cost
}

/// The least slack that there may be: for [`cost`], so that it is the most that it may be.
pub(crate) fn least_slack(value: &[F], usable: &[F]) -> F {
    let (mut sum, mut count) = (F::ZERO, F::ZERO);
    for (value, usable) in value.iter().zip(usable) {
        sum += *value * *usable;
        count += *usable;
    }
    (sum / count.max(F::ONE)).max(F::ZERO) * (LEVEL * super::SLACK[0])
}

#[inline(always)]
fn cost_of_reading(value: F, seen: F, shiny: Mask, slack: F, options: &Options) -> F {
    let deviation = seen.max(value) * options.noise + slack + options.floor;
    let off = value - seen;
    loss(deviation * deviation, off * off, off.above(F::ZERO) * (F::ONE - shiny))
}

/// A matte texel reads two thirds of its albedo in the mean.
const LEVEL: f32 = 1.6;

/// How much readings are off that a model describes, besides their noise: from a hundredth of their level to `most` of it.
fn bearable(value: &[F], usable: &[F], seen: &[F], most: f32) -> (F, F) {
    let mut off = Vec::with_capacity(value.len());
    let (mut slack, mut part) = (F::ZERO, F::splat(super::SLACK[0]));
    for lane in 0..LANES {
        off.clear();
        let mut sum = 0.0;
        for ((value, usable), seen) in value.iter().zip(usable).zip(seen) {
            if usable.0[lane] > 0.0 {
                off.push((value.0[lane] - seen.0[lane]).abs());
                sum += value.0[lane];
            }
        }
        if off.is_empty() {
            continue;
        }
        let (count, middle) = (off.len() as f32, off.len() / 2);
        let level = (LEVEL * sum / count).max(0.0);
        let median = *off.select_nth_unstable_by(middle, f32::total_cmp).1;
        let needed = super::OF_MEDIAN * median / level.max(1e-12);
        part.0[lane] = needed.clamp(super::SLACK[0], most.max(super::SLACK[0]));
        slack.0[lane] = part.0[lane] * level;
    }
    (slack, part)
}

/// Calls `each` with lane, light and the ratio of the reading to what the ground predicts, where it is well lit.
pub(crate) fn ratios(
    lights: &[Light],
    scratch: &Scratch,
    solved: &Solved,
    task: &Task,
    mut each: impl FnMut(usize, usize, f32),
) {
    /// Cosine from which shadows and light from neighbours are little beside the light.
    const WELL: f32 = 0.4;
    let size = Size::of(&solved.g);
    for (i, light) in lights.iter().enumerate() {
        let at = beside(light, scratch.value[i], &solved.g, size, task.slack, task.law, &task.options);
        let cos = at.lit * size.inverse * light.dim;
        let ratio = scratch.value[i] / (at.lit * at.through).max(F::splat(1e-12));
        for (lane, ratio) in ratio.0.into_iter().enumerate() {
            if scratch.usable[i].0[lane] > 0.0 && cos.0[lane] > WELL {
                each(lane, i, ratio);
            }
        }
    }
}

/// The median difference of readings in light, as a part of the albedo; `None` of a texel that has too few of them.
pub(crate) fn misfit(
    lights: &[Light],
    scratch: &Scratch,
    solved: &Solved,
    task: &Task,
) -> [Option<f32>; LANES] {
    let size = Size::of(&solved.g);
    let mut off: [Vec<f32>; LANES] = std::array::from_fn(|_| Vec::with_capacity(lights.len()));
    for (i, light) in lights.iter().enumerate() {
        let at = beside(light, scratch.value[i], &solved.g, size, task.slack, task.law, &task.options);
        for (lane, off) in off.iter_mut().enumerate() {
            if scratch.usable[i].0[lane] > 0.0 && at.lit.0[lane] > 0.0 {
                off.push(at.off.0[lane].sqrt() * size.inverse.0[lane]);
            }
        }
    }
    off.map(|mut off| {
        let middle = off.len() / 2;
        (off.len() > 4).then(|| *off.select_nth_unstable_by(middle, f32::total_cmp).1)
    })
}
