//! Sadeghi, Bisker, De Deken, Jensen 2013, "A Practical Microcylinder Appearance Model for Cloth Rendering".
//!
//! A cloth is two sets of threads that cross at right angles; a thread is a row of small cylinders whose
//! tangents follow a curve. Thread 1 runs along +x, thread 2 along +y. For a cylinder with tangent `t` and
//! outward normal `n'`, tilted by the offset α about the thread's binormal `b`,
//!
//! ```text
//! t = cos α t₀ + sin α n      n' = −sin α t₀ + cos α n
//! θ = asin(w·t)   φ = atan2(w·b, w·n')   ψ = atan2(w·t, w·n')
//! f_s = [ F cos(φ_d/2) g(γ_s, θ_h) + (1 − F)² A ((1 − k_d) g(γ_v, θ_h) + k_d) / (cos θ_i + cos θ_o) ] / cos² θ_d
//! ```
//!
//! with F the exact dielectric Fresnel term at the incidence cosine cos θ_d cos(φ_d/2), g of unit area.
//!
//! # Forms
//! * `paper`: tangents along piecewise linear curves with lengths; M (shadowing and masking) and P
//!   (foreshortening) with smaller-of-two correlation, 1/Q inside the integral:
//!   `f = Σ_j a_j Σ_k w_jk f_s M P cos θ_i / (Q (n·w_i))`. Neither reciprocal nor bounded: cos θ_i stands on the
//!   light's side only and Q prefers one side.
//! * `points`: the same with every control value of the curve once and equal weights.
//! * `physical`, the default, because a path tracer multiplies reflectances and a surface that returns 130 %
//!   of its light at grazing angles makes it diverge: every tangent counts with its projected area on both
//!   sides, `f = c Σ_j a_j Σ_k w_jk f_s M cos θ_i cos θ_o / (V(w_i) V(w_o))` with
//!   `V(w) = max(n·w, Σ_j a_j Σ_k w_jk max(n'·w, 0))`. The projected areas add up to at most the footprint
//!   n·w of the cloth; without that limit the form grows as 1/(n·w) wherever a thread tilts towards a grazing
//!   direction, and no factor c could bound it. c is one number per fabric, found by [`Model::bake`].
//!
//! # Cost
//! θ, φ and ψ never appear as angles. With T = w·t, N = w·n', C = cos θ = √(N² + (w·b)²), S = T_i + T_o,
//! E = C_i + C_o and D = √(S² + E²) = 2 cos θ_d:
//! tan(θ_h/2) = S/(D + E), cos φ_d = (N_i N_o + y_i y_o)/(C_i C_o), cos ψ = N/√(1 − y²), and ψ_d is the
//! same for all tangents of a thread. What is left per tangent are five square roots, five divisions and three
//! exponentials, done for four tangents at once: about 500 instructions a block, half of them multiplications
//! and additions of polynomials; moves for want of registers are most of the rest.
//!
//! A sloped piece of curve is cut at the kinks of M and P, at known offsets, and gets eight Gauss-Legendre nodes
//! per 4.5 γ_s between them, closer where the kernel comes and goes: 5e-6 of the value at worst over random
//! pairs, grazing ones among them, where 15 fixed nodes on linen's 50° err by 1e-3. Measured on one busy core
//! (`examples/cloth_cost.rs`), an evaluation takes 0.3 µs in the points form, 0.7 to 2.5 µs along curves; a
//! density 0.1 to 0.4 µs.

use crate::fabrics::{self, FABRICS, Fabric};
use crate::model::{Choice, Data, Laws, Model, ModelError, Preset, Sample, Spec, params};
use glam::{Vec2, Vec3, Vec4};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use yugen_optics::{ColourSpace, frame::spherical, quadrature::gauss_legendre, warp::uniform_hemisphere};

mod curves;

use curves::{BLOCK, BOUND, Curve, FIBRE, HEAD, SLOPE, curves, pieces, tabulate};

params! {
    /// Cloth of two crossing threads, each a curve of small cylinders.
    pub struct Microcylinder {
        form: Choice = Spec::choice(2, &["paper", "points", "physical"],
            "paper: tangent curves with lengths; points: control values with equal weight; physical: reciprocal, energy-bounded"),
        gap: Choice = Spec::choice(0, &["viewer", "light"],
            "direction whose cosine the gap term of Q takes (paper and points)"),
        colour: Choice = Spec::choice(0, &["coefficient", "albedo"],
            "what colour_1 and colour_2 are: the paper's A, or the albedo of a lone fibre, turned into A"),
        sigma: f32 = Spec::num(20.0, 15.0, 25.0, "deg", "width of the correlation of shadowing with masking"),
        eta_1: f32 = Spec::num(1.46, 1.05, 2.5, "", "thread 1: index of refraction"),
        colour_1: Vec3 = Spec::colour([0.06, 0.24, 0.3], 0.0, 1.0, "", "thread 1: volume colour A"),
        k_d_1: f32 = Spec::num(0.3, 0.0, 1.0, "", "thread 1: isotropic share of the volume scattering"),
        gamma_s_1: f32 = Spec::num(12.0, 1.0, 60.0, "deg", "thread 1: width of the surface lobe"),
        gamma_v_1: f32 = Spec::num(24.0, 1.0, 90.0, "deg", "thread 1: width of the volume lobe"),
        a_1: f32 = Spec::num(0.33, 0.0, 1.0, "", "thread 1: share of the area"),
        eta_2: f32 = Spec::num(1.46, 1.05, 2.5, "", "thread 2: index of refraction"),
        colour_2: Vec3 = Spec::colour([0.06, 0.24, 0.3], 0.0, 1.0, "", "thread 2: volume colour A"),
        k_d_2: f32 = Spec::num(0.3, 0.0, 1.0, "", "thread 2: isotropic share of the volume scattering"),
        gamma_s_2: f32 = Spec::num(12.0, 1.0, 60.0, "deg", "thread 2: width of the surface lobe"),
        gamma_v_2: f32 = Spec::num(24.0, 1.0, 90.0, "deg", "thread 2: width of the volume lobe"),
        a_2: f32 = Spec::num(0.33, 0.0, 1.0, "", "thread 2: share of the area"),
    }
}

const PAPER: u32 = 0;
const POINTS: u32 = 1;
const PHYSICAL: u32 = 2;

/// Gauss-Legendre rule with eight nodes on [−1, 1]: one half, the other is its mirror. Abramowitz and Stegun
/// 1964, table 25.4.
const GAUSS_X: Vec4 = Vec4::new(0.183434642, 0.525532410, 0.796666477, 0.960289856);
const GAUSS_W: Vec4 = Vec4::new(0.181341892, 0.156853323, 0.111190517, 0.050614268); // sums to ½
/// Longest stretch of curve one rule spans, in widths γ_s of the narrowest lobe and in radians.
const STRETCH_GAMMA: f32 = 4.5;
const STRETCH: f32 = 0.5;

/// The per-thread numbers of one evaluation, in the order of f_s.
#[derive(Clone, Copy)]
struct Thread {
    gamma_s: f32,
    eta2_1: f32,
    surface_k: f32,
    surface_n: f32,
    volume_k: f32,
    volume_n: f32,
    k_d: f32,
    tan_s: f32,
    tan_v: f32,
    f0: f32,
    a: f32,
    colour: Vec3,
}

/// Sums over the tangents of a thread: Σ w M P cos θ_i (or M cos θ_i cos θ_o) times f_rs, times f_rv for A = 1,
/// and Σ w P.
#[derive(Clone, Copy, Default)]
struct Lanes {
    surface: Vec4,
    volume: Vec4,
    p: Vec4,
}

/// [`Lanes`] added up.
struct Sums {
    surface: f32,
    volume: f32,
    p: f32,
}

/// arctan²(√v) for v in [0, 1]. Minimax polynomial of degree 8 for arctan²(√v)/v, relative error 6.4e-8.
#[inline(always)]
fn atan2_of_sqrt(v: Vec4) -> Vec4 {
    let mut p = Vec4::splat(0.010036948);
    for c in
        [-0.056258354, 0.14742184, -0.25193518, 0.3392638, -0.41584125, 0.5108187, -0.66665614, 0.99999994]
    {
        p = p * v + Vec4::splat(c);
    }
    p * v
}

/// exp(−x) for x ≥ 0: 2^k by exponent bits, 2^f on |f| ≤ ½ by a minimax polynomial of degree 5. Relative error
/// 1.5e-7 for x < 1, growing to 4e-6 at x = 60 with the rounding of x log₂ e. It stays there, at 9e-27: further
/// down the products it enters would be denormal, which costs a processor ten times the rest.
#[inline(always)]
fn exp_minus(x: Vec4) -> Vec4 {
    let y = x.min(Vec4::splat(60.0)) * -std::f32::consts::LOG2_E;
    // Adding 1.5·2²³ leaves the nearest integer in the low bits.
    let shifted = y + Vec4::splat(12_582_912.0);
    let f = y - (shifted - Vec4::splat(12_582_912.0));
    let mut p = Vec4::splat(0.0013276467);
    for c in [0.009675542, 0.055507133, 0.2402212, 0.69314697, 1.0] {
        p = p * f + Vec4::splat(c);
    }
    p * Vec4::from_array(shifted.to_array().map(|k| f32::from_bits(k.to_bits().wrapping_add(127) << 23)))
}

/// Unpolarised reflectance of a dielectric, `eta2_1` = η² − 1, at incidence cosine c. Fresnel's equations in
/// the form of Cook and Torrance 1982.
#[inline(always)]
fn f_dielectric(c: Vec4, eta2_1: f32) -> Vec4 {
    let g = (Vec4::splat(eta2_1) + c * c).sqrt();
    let (sum, difference) = (g + c, g - c);
    let ratio = difference / sum;
    let p = (c * sum - Vec4::ONE) / (c * difference + Vec4::ONE);
    0.5 * ratio * ratio * (Vec4::ONE + p * p)
}

/// Thread 2 is thread 1 seen with x and y exchanged: the model does not tell b from −b.
#[inline(always)]
fn in_thread(j: usize, w: Vec3) -> Vec3 {
    if j == 0 { w } else { Vec3::new(w.y, w.x, w.z) }
}

#[inline(always)]
fn lanes(block: &[f32; BLOCK]) -> (Vec4, Vec4, Vec4) {
    let b: &[[f32; 4]; 3] = bytemuck::cast_ref(block);
    (Vec4::from_array(b[0]), Vec4::from_array(b[1]), Vec4::from_array(b[2]))
}

/// Share of samples spread evenly over the hemisphere. The mixture knows the curve by some of its tangents
/// only; where just those in between see both directions, these keep the sampler unbiased and weights bounded.
const EVEN: f32 = 0.04;

/// Smallest squared length that is divided by.
const TINY: f32 = 1e-30;

/// The share of both directions' visibility that is common, M and P alike: uncorrelated product, or the smaller
/// one where the directions agree. Ashikhmin et al. 2000.
#[inline(always)]
fn correlated(u: Vec4, a: Vec4, b: Vec4) -> Vec4 {
    a * b + u * (a.min(b) - a * b)
}

/// Two directions in the frame of a thread, and what is the same for all its tangents.
struct Pair {
    wo: Vec3,
    wi: Vec3,
    /// √(1 − y²) of both, inverted: cos ψ = n'·w / √(1 − y²).
    inverse_o: f32,
    inverse_i: f32,
    /// ψ of both at α = 0; at α it is ψ + α.
    psi_o: f32,
    psi_i: f32,
    /// 1/(2σ²) and u(ψ_d).
    u_k: f32,
    u_psi: f32,
}

impl Pair {
    fn new(wo: Vec3, wi: Vec3, u_k: f32) -> Self {
        let inverse = |w: Vec3| 1.0 / (w.x * w.x + w.z * w.z).max(TINY).sqrt();
        let (psi_o, psi_i) = (wo.x.atan2(wo.z), wi.x.atan2(wi.z));
        let psi_d = psi_i - psi_o;
        let u_psi = (-psi_d * psi_d * u_k).exp();
        Self { wo, wi, inverse_o: inverse(wo), inverse_i: inverse(wi), psi_o, psi_i, u_k, u_psi }
    }

    /// Where the kernel is smooth along a curve.
    fn course(&self) -> Course {
        let (lo, hi) = (self.psi_o.min(self.psi_i), self.psi_o.max(self.psi_i));
        let (begin, end) = (-FRAC_PI_2 - lo, FRAC_PI_2 - hi);
        let mirror = 0.5 * (begin + end);
        // cos φ_i = cos φ_o where N_i |y_o| = N_o |y_i|.
        let (yo, yi) = (self.wo.y.abs(), self.wi.y.abs());
        let (sin, cos) = (self.wi.z * yo - self.wo.z * yi, self.wi.x * yo - self.wo.x * yi);
        let equal = if cos == 0.0 { begin } else { (sin / cos).atan().max(begin).min(end) };
        // cos φ = N/√(N² + y²) leaves 0 within |y|/√(1 − y²) of where N does.
        let (near_o, near_i) = ((yo * self.inverse_o).max(0.01), (yi * self.inverse_i).max(0.01));
        let (first, last) = if self.psi_o < self.psi_i { (near_o, near_i) } else { (near_i, near_o) };
        Course {
            kinks: [begin, mirror.min(equal), mirror.max(equal), end],
            rise: first.min(hi - lo + last),
            fall: last.min(hi - lo + first),
        }
    }
}

/// The kernel along a curve: kinks at the ends of the stretch that sees both directions, where P changes its
/// smaller side (the middle of that stretch) and where M does. `rise` and `fall` are the lengths over which it
/// comes and goes at the two ends.
struct Course {
    kinks: [f32; 4],
    rise: f32,
    fall: f32,
}

impl Course {
    /// How far one rule may reach from `at` towards `next`, a kink or an end of the piece: lengths in proportion
    /// to the distance from where the kernel comes and goes, and no longer than `stretch`.
    fn reach(&self, at: f32, next: f32, stretch: f32) -> f32 {
        let whole = next - at;
        let from_begin = 3.0 * self.rise + 6.0 * (at - self.kinks[0]);
        let from_end = (3.0 * self.fall + 6.0 * (self.kinks[3] - at)) / 7.0;
        let limit = from_begin.min(from_end);
        if limit >= whole && whole <= stretch { whole } else { limit.min(whole / (whole / stretch).ceil()) }
    }
}

/// Adds the sums over four tangents.
#[inline(always)]
fn add_block<const IS_PHYSICAL: bool>(
    sums: &mut Lanes,
    sin: Vec4,
    cos: Vec4,
    weight: Vec4,
    th: &Thread,
    w: &Pair,
) {
    let normal_i = cos * w.wi.z - sin * w.wi.x;
    let normal_o = cos * w.wo.z - sin * w.wo.x;
    let (seen_i, seen_o) = (normal_i.max(Vec4::ZERO), normal_o.max(Vec4::ZERO));
    let s = (cos * w.wi.x + sin * w.wi.z) + (cos * w.wo.x + sin * w.wo.z);
    let cos_i = (normal_i * normal_i + Vec4::splat(w.wi.y * w.wi.y)).max(Vec4::splat(TINY)).sqrt();
    let cos_o = (normal_o * normal_o + Vec4::splat(w.wo.y * w.wo.y)).max(Vec4::splat(TINY)).sqrt();
    let e = cos_i + cos_o;
    let d2 = s * s + e * e;
    let d = d2.sqrt();

    let over_both = Vec4::ONE / (cos_i * cos_o);
    let cos_phi_d = (normal_i * normal_o + Vec4::splat(w.wi.y * w.wo.y)) * over_both;
    let cos_half = (Vec4::splat(0.5) + 0.5 * cos_phi_d).clamp(Vec4::ZERO, Vec4::ONE).sqrt();
    // φ_d² = 16 arctan²(tan(φ_d/4))
    let phi_d2 = 16.0 * atan2_of_sqrt((Vec4::ONE - cos_half) / (Vec4::ONE + cos_half));
    let m = correlated(exp_minus(phi_d2 * w.u_k), seen_i * cos_o * over_both, seen_o * cos_i * over_both);

    let t = s / (d + e);
    let theta_h2 = 4.0 * atan2_of_sqrt(t * t);
    let fresnel = f_dielectric(0.5 * d * cos_half, th.eta2_1);
    let through = Vec4::ONE - fresnel;
    let lobe_s = exp_minus(theta_h2 * th.surface_k) * th.surface_n;
    let lobe_v = exp_minus(theta_h2 * th.volume_k) * th.volume_n + Vec4::splat(th.k_d);

    let weight = if IS_PHYSICAL {
        weight * cos_o
    } else {
        let p = weight * correlated(Vec4::splat(w.u_psi), seen_i * w.inverse_i, seen_o * w.inverse_o);
        sums.p += p;
        p
    };
    // M cos θ_i / (cos² θ_d (cos θ_i + cos θ_o)) and the tangent's weight.
    let common = weight * m * cos_i * 4.0 / (d2 * e);
    sums.surface += common * e * fresnel * cos_half * lobe_s;
    sums.volume += common * through * through * lobe_v;
}

/// Coefficients of [`sin_cos`] in α², highest first.
const SIN: [f32; 5] = [2.6017497e-6, -0.00019807350, 0.0083330242, -0.16666657, 1.0];
const COS: [f32; 6] = [-2.6050028e-7, 2.4760079e-5, -0.0013888358, 0.041666636, -0.5, 1.0];

/// sin α and cos α for |α| ≤ π/2. Minimax polynomials, absolute error 1e-7.
#[inline(always)]
fn sin_cos(a: Vec4) -> (Vec4, Vec4) {
    let a2 = a * a;
    let mut sin = Vec4::splat(SIN[0]);
    for c in &SIN[1..] {
        sin = sin * a2 + Vec4::splat(*c);
    }
    let mut cos = Vec4::splat(COS[0]);
    for c in &COS[1..] {
        cos = cos * a2 + Vec4::splat(*c);
    }
    (sin * a, cos)
}

/// The sums over one thread. Straight pieces of the curve are one tangent each. A sloped piece is cut at the
/// kinks of M and P, whose places are known, and integrated between them, where the kernel is smooth.
fn sums<const IS_PHYSICAL: bool>(
    straight: &[[f32; BLOCK]],
    sloped: &[[f32; SLOPE]],
    th: &Thread,
    w: &Pair,
) -> Sums {
    let mut sums = Lanes::default();
    for block in straight {
        let (sin, cos, weight) = lanes(block);
        add_block::<IS_PHYSICAL>(&mut sums, sin, cos, weight, th, w);
    }
    if !sloped.is_empty() {
        let course = w.course();
        let stretch = STRETCH.min(STRETCH_GAMMA * th.gamma_s);
        for &[from, to, _, _, _, _, weight] in sloped {
            let density = weight / (to - from);
            for ends in course.kinks.windows(2) {
                let (mut at, next) = (ends[0].max(from), ends[1].min(to));
                while at < next {
                    let half = 0.5 * course.reach(at, next, stretch);
                    for side in [-half, half] {
                        let (sin, cos) = sin_cos(Vec4::splat(at + half) + side * GAUSS_X);
                        add_block::<IS_PHYSICAL>(
                            &mut sums,
                            sin,
                            cos,
                            GAUSS_W * (2.0 * half * density),
                            th,
                            w,
                        );
                    }
                    let after = at + 2.0 * half;
                    // What is left by rounding is no stretch of its own.
                    at = if next - after < 1e-5 { next } else { after };
                }
            }
        }
    }
    Sums { surface: sums.surface.element_sum(), volume: sums.volume.element_sum(), p: sums.p.element_sum() }
}

/// Σ w max(n'·w, 0) over a thread: its projected area. On a sloped piece n'·w = cos(α + ψ) √(1 − y²), whose
/// integral is t·w between the ends that are lit.
fn area(straight: &[[f32; BLOCK]], sloped: &[[f32; SLOPE]], w: Vec3) -> f32 {
    let mut sum = 0.0;
    for block in straight {
        let (sin, cos, weight) = lanes(block);
        sum += weight.dot((cos * w.z - sin * w.x).max(Vec4::ZERO));
    }
    let full = (w.x * w.x + w.z * w.z).sqrt();
    for &[from, to, sin_from, sin_to, cos_from, cos_to, weight] in sloped {
        let end = |sin: f32, cos: f32| {
            let along = cos * w.x + sin * w.z;
            if cos * w.z - sin * w.x > 0.0 { along } else { full.copysign(along) }
        };
        sum += weight * (end(sin_to, cos_to) - end(sin_from, cos_from)) / (to - from);
    }
    sum
}

/// What the sampler needs to know of four tangents and the viewer.
struct Seen {
    sin_theta: Vec4,
    cos_theta: Vec4,
    /// Weights of the lobes: surface, volume, flat. Not normalised.
    lobes: [Vec4; 3],
}

/// Lobe weights of a block: projected weight times the rough energy of f_rs, f_rv's lobe and its flat part.
#[inline(always)]
fn seen<const IS_PHYSICAL: bool>(block: &[f32; BLOCK], th: &Thread, wo: Vec3) -> Seen {
    let (sin, cos, weight) = lanes(block);
    let normal = (cos * wo.z - sin * wo.x).max(Vec4::ZERO);
    let sin_theta = cos * wo.x + sin * wo.z;
    let cos_theta = (normal * normal + Vec4::splat(wo.y * wo.y)).max(Vec4::splat(TINY)).sqrt();
    // M_o cos θ_o in the physical form, M_o P_o in the paper's (the factor common to the thread left out).
    let area = if IS_PHYSICAL { normal } else { normal * normal / cos_theta };
    let area = th.a * weight * area;
    let grazing = (Vec4::ONE - cos_theta).max(Vec4::ZERO);
    let grazing2 = grazing * grazing;
    let fresnel = Vec4::splat(th.f0) + (1.0 - th.f0) * grazing2 * grazing2 * grazing;
    let through = (Vec4::ONE - fresnel) * (Vec4::ONE - fresnel) * th.colour.element_sum() / 3.0;
    let lobe = through * (1.0 - th.k_d) / cos_theta.max(Vec4::splat(0.1));
    // 1.9 and 0.9: ∫ cos(φ/2) cos φ dφ over the lit half, and the flat part's integral over θ_i at θ_o = 0.
    Seen { sin_theta, cos_theta, lobes: [area * 1.9 * fresnel, area * lobe, area * 0.9 * through * th.k_d] }
}

/// The bounds of the lobe's cumulative density for θ_i in ±90°, in (−1, 1): x/√(s² + x²) at the two ends
/// tan θ_h = (sin θ_o ∓ 1)/cos θ_o.
#[inline(always)]
fn lobe_range(sin_theta: Vec4, cos_theta: Vec4, tan: f32) -> (Vec4, Vec4) {
    let width = cos_theta * cos_theta * (tan * tan);
    let (up, down) = ((Vec4::ONE + sin_theta).max(Vec4::ZERO), (Vec4::ONE - sin_theta).max(Vec4::ZERO));
    (
        -down / (width + down * down + Vec4::splat(TINY)).sqrt(),
        up / (width + up * up + Vec4::splat(TINY)).sqrt(),
    )
}

/// Σ of lobe weights, and Σ of weight times density, over one thread.
#[inline(always)]
fn densities<const IS_PHYSICAL: bool>(
    blocks: &[[f32; BLOCK]],
    th: &Thread,
    wo: Vec3,
    wi: Vec3,
) -> (f32, f32) {
    let (mut total, mut density) = (Vec4::ZERO, Vec4::ZERO);
    for block in blocks {
        let Seen { sin_theta, cos_theta, lobes } = seen::<IS_PHYSICAL>(block, th, wo);
        total += lobes[0] + lobes[1] + lobes[2];
        let (sin, cos, _) = lanes(block);
        let normal_i = cos * wi.z - sin * wi.x;
        let seen_i = normal_i.max(Vec4::ZERO);
        let s = (cos * wi.x + sin * wi.z) + sin_theta;
        let cos_i = (normal_i * normal_i + Vec4::splat(wi.y * wi.y)).max(Vec4::splat(TINY)).sqrt();
        let e = cos_i + cos_theta;
        let (s2, e2) = (s * s, e * e);
        let scale = 0.25 * e * (s2 + e2) / cos_i;
        let mut sum = lobes[2] * 0.5;
        for (weight, tan) in [(lobes[0], th.tan_s), (lobes[1], th.tan_v)] {
            let (lo, hi) = lobe_range(sin_theta, cos_theta, tan);
            let r2 = e2 * (tan * tan) + s2;
            sum += weight * scale * (2.0 * tan * tan) / (r2 * r2.sqrt() * (hi - lo));
        }
        density += 0.5 * seen_i / cos_i * sum;
    }
    (total.element_sum(), density.element_sum())
}

impl Microcylinder {
    fn thread(&self, j: usize, table: &[f32]) -> Thread {
        let (eta, colour, k_d, gamma_s, gamma_v, a) = if j == 0 {
            (self.eta_1, self.colour_1, self.k_d_1, self.gamma_s_1, self.gamma_v_1, self.a_1)
        } else {
            (self.eta_2, self.colour_2, self.k_d_2, self.gamma_s_2, self.gamma_v_2, self.a_2)
        };
        let (gamma_s, gamma_v) = (gamma_s.to_radians(), gamma_v.to_radians());
        let colour = if self.colour.index() == 0 {
            colour
        } else {
            // Isolated fibre lit across: albedo = S + V A, so A = ρ (1 − S)/V turns ρ = 1 into no loss.
            let fibre = &table[FIBRE + 3 * j..FIBRE + 3 * j + 3];
            let volume = (1.0 - k_d) * fibre[1] + k_d * fibre[2];
            colour * ((1.0 - fibre[0]).max(0.0) / volume)
        };
        let f0 = (eta - 1.0) / (eta + 1.0);
        // Student's t with two degrees of freedom, 1.1 σ wide, has the least variance as a proposal for a
        // Gaussian (1.094 times that of the Gaussian itself) and needs no erf. It lives in tan θ_h: γ + γ³/2 stands
        // for tan γ, and any positive width would be right.
        let tan = |gamma: f32| {
            let gamma = gamma.min(1.05);
            1.1 * gamma * (1.0 + 0.5 * gamma * gamma)
        };
        let root_tau = (2.0 * PI).sqrt();
        Thread {
            gamma_s,
            eta2_1: eta * eta - 1.0,
            surface_k: 0.5 / (gamma_s * gamma_s),
            surface_n: 1.0 / (root_tau * gamma_s),
            volume_k: 0.5 / (gamma_v * gamma_v),
            volume_n: (1.0 - k_d) / (root_tau * gamma_v),
            k_d,
            tan_s: tan(gamma_s),
            tan_v: tan(gamma_v),
            f0: f0 * f0,
            a,
            colour,
        }
    }

    fn gap(&self) -> f32 {
        (1.0 - self.a_1 - self.a_2).max(0.0)
    }

    /// Surface and volume parts of f before colour: `[thread] -> (surface, volume, A)`, and the factor common
    /// to all.
    fn parts(&self, table: &[f32], wo: Vec3, wi: Vec3) -> ([(f32, f32, Vec3); 2], f32) {
        let sigma = self.sigma.to_radians();
        let u_k = 0.5 / (sigma * sigma);
        let mut parts = [(0.0, 0.0, Vec3::ZERO); 2];
        let (mut q, mut area_i, mut area_o) = (0.0, 0.0, 0.0);
        for (j, part) in parts.iter_mut().enumerate() {
            let th = self.thread(j, table);
            let w = Pair::new(in_thread(j, wo), in_thread(j, wi), u_k);
            let (straight, sloped, _) = pieces(table, j);
            let s = if self.form.index() == PHYSICAL {
                area_i += th.a * area(straight, sloped, w.wi);
                area_o += th.a * area(straight, sloped, w.wo);
                sums::<true>(straight, sloped, &th, &w)
            } else {
                sums::<false>(straight, sloped, &th, &w)
            };
            q += th.a * s.p;
            *part = (th.a * s.surface, th.a * s.volume, th.colour);
        }
        let scale = if self.form.index() == PHYSICAL {
            table[BOUND] / (area_i.max(wi.z) * area_o.max(wo.z))
        } else {
            q += self.gap() * if self.gap.index() == 0 { wo.z } else { wi.z };
            if q > 0.0 { 1.0 / (q * wi.z) } else { 0.0 }
        };
        (parts, scale)
    }

    /// Share of what is seen along `w` that passes straight through the gaps between the threads, in [0, 1]:
    /// the gap's projected area among those of the threads, as the paper's Q weighs them. Add it to the
    /// reflection as a transmission without deflection; the areas a₁ and a₂ already scale the reflection.
    /// The physical form's bound leaves room for it.
    pub fn straight_through(&self, table: &[f32], w: Vec3) -> f32 {
        let gap = self.gap() * w.z;
        if gap <= 0.0 {
            return 0.0;
        }
        let threads: f32 = (0..2)
            .map(|j| {
                let (w, a) = (in_thread(j, w), if j == 0 { self.a_1 } else { self.a_2 });
                let (straight, sloped, _) = pieces(table, j);
                a * area(straight, sloped, w) / (w.x * w.x + w.z * w.z).max(TINY).sqrt()
            })
            .sum();
        gap / (gap + threads)
    }

    /// Albedo of a lone fibre of thread `j` lit across (θ = 0), for A = 1: surface, volume lobe, flat volume.
    fn fibre(&self, j: usize, table: &[f32]) -> [f64; 3] {
        let th = self.thread(j, table);
        let phis = gauss_legendre(16, 0.0, std::f64::consts::PI);
        let integrate = |gamma: f64, f: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
            let end = std::f64::consts::FRAC_PI_2.min(14.0 * gamma);
            let thetas = gauss_legendre(48, 0.0, end);
            // Even in θ and φ: four quadrants alike.
            let half = |&(theta, wt): &(f64, f64)| {
                let (cos_i, cos_d) = (theta.cos(), (0.5 * theta).cos());
                let around = |&(phi, wp): &(f64, f64)| {
                    let cos_half = (0.5 * phi).cos();
                    let c = Vec4::splat((cos_d * cos_half) as f32);
                    let fresnel = f64::from(f_dielectric(c, th.eta2_1).x);
                    wp * f(0.5 * theta, fresnel, cos_half) * cos_i * cos_i / (cos_d * cos_d)
                };
                wt * phis.iter().map(around).sum::<f64>()
            };
            4.0 * thetas.iter().map(half).sum::<f64>()
        };
        let gauss =
            |gamma: f64, x: f64| (-0.5 * (x / gamma).powi(2)).exp() / (std::f64::consts::TAU.sqrt() * gamma);
        let (gamma_s, gamma_v) =
            if j == 0 { (self.gamma_s_1, self.gamma_v_1) } else { (self.gamma_s_2, self.gamma_v_2) };
        let (gamma_s, gamma_v) = (f64::from(gamma_s).to_radians(), f64::from(gamma_v).to_radians());
        let volume = |h: f64, fresnel: f64| (1.0 - fresnel).powi(2) / (1.0 + (2.0 * h).cos());
        [
            integrate(gamma_s, &|h, fresnel, cos_half| fresnel * cos_half * gauss(gamma_s, h)),
            integrate(gamma_v, &|h, fresnel, _| volume(h, fresnel) * gauss(gamma_v, h)),
            integrate(10.0, &|h, fresnel, _| volume(h, fresnel)),
        ]
    }

    /// Largest factor c for which `c R(w) + straight_through(w) ≤ 0.98` for light from anywhere. 2 % are for
    /// what lies between the directions tried and for the error of the 256 samples.
    fn bound(&self, table: &[f32]) -> f32 {
        let mut c = 1f32;
        for theta in [0.0f32, 0.6, 1.0, 1.25, 1.4, 1.49, 1.54, 1.5655] {
            for k in 0..8 {
                let w = spherical(theta, k as f32 * PI / 4.0);
                let n = 256;
                let mut reflectance = Vec3::ZERO;
                for i in 0..n {
                    let u = r3_sequence(i);
                    reflectance += self.sample(table, w, u).map_or(Vec3::ZERO, |s| s.weight) / n as f32;
                }
                let room = 0.98 * (1.0 - self.straight_through(table, w));
                c = c.min(room / reflectance.max_element().max(TINY));
            }
        }
        c
    }

    /// Draws `wi`; it may lie below the horizon.
    fn direction(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Vec3> {
        if u.z < EVEN {
            return Some(uniform_hemisphere(u.truncate()));
        }
        let (j, tangent, sin_o, cos_o, lobe, tan) = self.choose(table, wo, (u.z - EVEN) / (1.0 - EVEN))?;
        // θ_i: the flat lobe by its cosine; the others through tan θ_h, so that θ_i = 2θ_h − θ_o.
        let (sin_i, cos_i) = if lobe == 2 {
            let sin_i = 2.0 * u.x - 1.0;
            (sin_i, (1.0 - sin_i * sin_i).max(0.0).sqrt())
        } else {
            let (lo, hi) = lobe_range(Vec4::splat(sin_o), Vec4::splat(cos_o), tan);
            let x = lo.x + u.x * (hi.x - lo.x);
            let (c2, s2) = ((1.0 - x * x).max(0.0), tan * tan * x * x);
            let (cos_2h, sin_2h) = ((c2 - s2) / (c2 + s2), 2.0 * tan * x * c2.sqrt() / (c2 + s2));
            (sin_2h * cos_o - cos_2h * sin_o, (cos_2h * cos_o + sin_2h * sin_o).max(0.0))
        };
        let sin_phi = 2.0 * u.y - 1.0;
        let across = cos_i * (1.0 - sin_phi * sin_phi).max(0.0).sqrt();
        let wi = Vec3::new(
            tangent.y * sin_i - tangent.x * across,
            cos_i * sin_phi,
            tangent.x * sin_i + tangent.y * across,
        );
        Some(in_thread(j, wi).normalize())
    }

    fn choose(&self, table: &[f32], wo: Vec3, u: f32) -> Option<(usize, Vec2, f32, f32, usize, f32)> {
        if self.form.index() == PHYSICAL {
            self.choose_in::<true>(table, wo, u)
        } else {
            self.choose_in::<false>(table, wo, u)
        }
    }

    /// A tangent and a lobe in proportion to their weights: thread, (sin α, cos α), sin θ_o, cos θ_o, lobe and
    /// the lobe's width.
    fn choose_in<const IS_PHYSICAL: bool>(
        &self,
        table: &[f32],
        wo: Vec3,
        u: f32,
    ) -> Option<(usize, Vec2, f32, f32, usize, f32)> {
        let threads = [self.thread(0, table), self.thread(1, table)];
        let scale = [0, 1].map(|j| thread_scale::<IS_PHYSICAL>(in_thread(j, wo)));
        let each = |j: usize| {
            let (th, scale, wo) = (threads[j], scale[j], in_thread(j, wo));
            pieces(table, j).2.iter().map(move |b| (b, seen::<IS_PHYSICAL>(b, &th, wo), scale))
        };
        let weight = |s: &Seen, scale: f32| scale * (s.lobes[0] + s.lobes[1] + s.lobes[2]);
        let total: f32 = (0..2).flat_map(|j| each(j).map(|(_, s, k)| weight(&s, k).element_sum())).sum();
        let mut left = u * total;
        let mut chosen = None;
        for (j, th) in threads.iter().enumerate() {
            for (block, s, k) in each(j) {
                let weights = weight(&s, k);
                let sum = weights.element_sum();
                if sum <= 0.0 {
                    continue;
                }
                let last = left < sum;
                for lane in 0..4 {
                    for lobe in 0..3 {
                        let w = k * s.lobes[lobe][lane];
                        if w <= 0.0 {
                            continue;
                        }
                        let tan = [th.tan_s, th.tan_v, 0.0][lobe];
                        let tangent = Vec2::new(block[lane], block[4 + lane]);
                        chosen = Some((j, tangent, s.sin_theta[lane], s.cos_theta[lane], lobe, tan));
                        if last && left < w {
                            return chosen;
                        }
                        if last {
                            left -= w;
                        }
                    }
                }
                if last {
                    return chosen;
                }
                left -= sum;
            }
        }
        chosen
    }
}

/// The factor of P_o common to all tangents of a thread.
#[inline(always)]
fn thread_scale<const IS_PHYSICAL: bool>(wo: Vec3) -> f32 {
    if IS_PHYSICAL { 1.0 } else { 1.0 / (wo.x * wo.x + wo.z * wo.z).max(TINY).sqrt() }
}

/// Point `i` of the additive recurrence with the best known spread in three dimensions (Roberts 2018).
pub(crate) fn r3_sequence(i: u32) -> Vec3 {
    let g = 1.220_744_084_605_759_5f64;
    let at = |k: i32| (0.5 + f64::from(i) * g.powi(-k)).fract() as f32;
    Vec3::new(at(1), at(2), at(3)).min(Vec3::splat(yugen_optics::distribution::ONE_MINUS_EPSILON))
}

impl Model for Microcylinder {
    const NAME: &'static str = "microcylinder";
    const SOURCE: &'static str = "Sadeghi, Bisker, De Deken and Jensen 2013, A Practical Microcylinder Appearance \
        Model for Cloth Rendering";
    const DOC: &'static str = "Woven cloth as two crossing sets of threads made of small cylinders: linen, silk, \
        satin, velvet seen from far enough that threads blur. The forms 'paper' and 'points' are the published \
        model, literal; 'physical' is reciprocal and bounded and is the default. Nearer, where single threads \
        show, it ends: use geometry or a BTF.";
    const LAWS: Laws = Laws { isotropic: false, ..Laws::PHYSICAL };
    const WGSL: &'static str = include_str!("microcylinder.wgsl");
    const COSTLY: bool = true;
    const DATA: Data = Data::Optional(
        "tangent curves: for each of the two threads the count of offsets, the offsets in degrees, and count − 1 \
         lengths",
    );
    const PRESETS: &'static [Preset] = &fabrics::PRESETS;

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let fabric = Fabric::find(name)?;
        let [t1, t2] = &fabric.threads;
        let model = Self {
            eta_1: t1.eta,
            colour_1: t1.colour(space),
            k_d_1: t1.k_d,
            gamma_s_1: t1.gamma_s,
            gamma_v_1: t1.gamma_v,
            a_1: t1.a,
            eta_2: t2.eta,
            colour_2: t2.colour(space),
            k_d_2: t2.k_d,
            gamma_s_2: t2.gamma_s,
            gamma_v_2: t2.gamma_v,
            a_2: t2.a,
            ..Self::default()
        };
        Some((model, fabric.curves()))
    }

    fn bake(&self, data: &[f32]) -> Result<Vec<f32>, ModelError> {
        let default = FABRICS[0].curves();
        let curves = curves(if data.is_empty() { &default } else { data })?;
        let curves =
            curves.map(|(offsets, lengths)| Curve::new(offsets, lengths, self.form.index() == POINTS));
        let mut table = tabulate(&curves, [self.gamma_s_1, self.gamma_s_2]);
        table[BOUND] = 1.0;
        for j in 0..2 {
            let fibre = self.fibre(j, &[1.0; HEAD]);
            for (slot, x) in table[FIBRE + 3 * j..].iter_mut().zip(fibre) {
                *slot = x as f32;
            }
        }
        if self.form.index() == PHYSICAL {
            table[BOUND] = self.bound(&table);
        }
        Ok(table)
    }

    fn laws(&self) -> Laws {
        match self.form.index() {
            PAPER | POINTS => Laws {
                reciprocal: false,
                conserves_energy: false,
                why: "cos θ_i stands on the light's side only, Q and its gap term weigh the two sides unequally, and \
                      F g/cos² θ_d grows at grazing angles: shot silk lit at 80° returns 130 % of the green",
                ..Self::LAWS
            },
            _ => Self::LAWS,
        }
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        let ([(s1, v1, a1), (s2, v2, a2)], scale) = self.parts(table, wo, wi);
        (Vec3::splat(s1 + s2) + a1 * v1 + a2 * v2) * scale
    }

    fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let (mut total, mut density) = (0.0, 0.0);
        for j in 0..2 {
            let (th, wo, wi) = (self.thread(j, table), in_thread(j, wo), in_thread(j, wi));
            let (t, d, k) = if self.form.index() == PHYSICAL {
                let (t, d) = densities::<true>(pieces(table, j).2, &th, wo, wi);
                (t, d, 1.0)
            } else {
                let (t, d) = densities::<false>(pieces(table, j).2, &th, wo, wi);
                (t, d, thread_scale::<false>(wo))
            };
            total += k * t;
            density += k * d;
        }
        if total > 0.0 { (1.0 - EVEN) * density / total + EVEN / TAU } else { 0.0 }
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = self.direction(table, wo, u)?;
        if wi.z <= 0.0 {
            return None;
        }
        let pdf = self.pdf(table, wo, wi);
        if pdf.is_nan() || pdf <= 0.0 {
            return None;
        }
        Some(Sample { wi, weight: self.eval(table, wo, wi) * (wi.z / pdf), pdf, delta: false, eta: 1.0 })
    }
}

#[cfg(test)]
mod tests;
