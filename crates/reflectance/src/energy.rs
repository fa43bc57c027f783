//! Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks": what a rough surface loses because
//! Smith's model follows light to one facet only, and a lobe that gives it back.
//!
//! E(w) is the albedo of a perfect mirror of facets, tabulated for the roughness of a material over azimuth and
//! cosine.

use crate::microfacet::{Distribution, Masking, Microfacets};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};
use yugen_optics::quadrature::gauss_legendre;

/// Azimuths, evenly in |x|/(|x| + |y|).
const PHIS: usize = 13;
/// Cosines, evenly in √cos θ: E bends most at grazing light.
const COSINES: usize = 64;
/// Where the cosine-weighted mean of 1 − E is kept.
const MEAN: usize = PHIS * COSINES;

/// 1 − E of a perfect mirror of facets for light from `w`: the mean of 1 − G2/G1 over visible normals.
/// By Gauss-Legendre in t, u = 3t² − 2t³: the losses are in the tails, at the ends of u. Few nodes go round GGX's
/// spherical cap (`u.x`) and many across it (`u.y`), where the horizon makes an edge.
fn loss(m: &Microfacets, w: Vec3, across: &[(f32, f32)], round: &[(f32, f32)]) -> f32 {
    let lambda_o = m.lambda(w);
    let mut sum = 0.0;
    for &(x, wx) in round {
        for &(y, wy) in across {
            let wi = m.sample_reflection(w, Vec2::new(x, y));
            let lost = if wi.z > 0.0 {
                let lambda_i = m.lambda(wi);
                match m.masking {
                    Masking::Separable => lambda_i / (1.0 + lambda_i),
                    Masking::HeightCorrelated => lambda_i / (1.0 + lambda_o + lambda_i),
                }
            } else {
                1.0
            };
            sum += wx * wy * lost;
        }
    }
    sum
}

/// The table of 1 − E for a surface, and its mean.
pub(crate) fn bake(m: &Microfacets) -> Vec<f32> {
    let mut table = Vec::with_capacity(MEAN + 1);
    let nodes = |n| -> Vec<(f32, f32)> {
        let t = gauss_legendre(n, 0.0, 1.0).into_iter();
        t.map(|(t, w)| ((t * t * (3.0 - 2.0 * t)) as f32, (w * 6.0 * t * (1.0 - t)) as f32)).collect()
    };
    // Round the cap all is periodic: midpoints.
    let midpoints = |n: usize| (0..n).map(|i| ((i as f32 + 0.5) / n as f32, 1.0 / n as f32)).collect();
    let (across, round) = match m.distribution {
        Distribution::Ggx => (nodes(160), midpoints(64)),
        Distribution::Beckmann => (nodes(48), nodes(48)),
    };
    for p in 0..PHIS {
        if m.ax == m.ay && p > 0 {
            table.extend_from_within(..COSINES);
            continue;
        }
        let x = p as f32 / (PHIS - 1) as f32;
        let axis = Vec2::new(x, 1.0 - x).normalize();
        for k in 0..COSINES {
            let t = k as f32 / (COSINES - 1) as f32;
            let z = (t * t).max(1e-4);
            let r = (1.0 - z * z).sqrt();
            table.push(loss(m, (r * axis).extend(z), &across, &round));
        }
    }
    // 2 ∫ (1 − E) μ dμ of the interpolant itself, so that what one direction loses all directions give back.
    let nodes = gauss_legendre(96, 0.0, 1.0);
    let mut mean = 0.0;
    for j in 0..64 {
        let phi = FRAC_PI_2 * (j as f32 + 0.5) / 64.0;
        for &(t, w) in &nodes {
            // μ = t² as the table has it: 2 μ dμ = 4 t³ dt.
            let z = (t * t) as f32;
            let r = (1.0 - z * z).sqrt();
            let v = Vec3::new(r * phi.cos(), r * phi.sin(), z);
            mean += w * 4.0 * t.powi(3) / 64.0 * f64::from(lost(&table, v));
        }
    }
    table.push(mean as f32);
    table
}

/// The cell of a coordinate in `nodes` nodes and the place in it.
fn cell(x: f32, nodes: usize) -> (usize, f32) {
    let i = (x as usize).min(nodes - 2);
    (i, x - i as f32)
}

/// 1 − E(w).
pub(crate) fn lost(table: &[f32], w: Vec3) -> f32 {
    let (x, y) = (w.x.abs(), w.y.abs());
    let (p, tp) = cell(if x > 0.0 { x / (x + y) * (PHIS - 1) as f32 } else { 0.0 }, PHIS);
    let (k, tk) = cell(w.z.clamp(0.0, 1.0).sqrt() * (COSINES - 1) as f32, COSINES);
    let at = |p: usize| {
        let i = p * COSINES + k;
        table[i] + (table[i + 1] - table[i]) * tk
    };
    let (a, b) = (at(p), at(p + 1));
    a + (b - a) * tp
}

/// The lobe that gives back what was lost, for facets that reflect all light: a reciprocal function of the
/// losses of both directions.
pub(crate) fn f_multiple(table: &[f32], lost_o: f32, lost_i: f32) -> f32 {
    // A thousandth is kept back, more than the error of the table, so that no furnace gains.
    lost_o * lost_i * (0.999 * FRAC_1_PI) / table[MEAN].max(1e-7)
}

/// Its colour, for facets whose mean reflectance is `f`: the sum over two and more facets.
pub(crate) fn f_multiple_colour(table: &[f32], f: Vec3) -> Vec3 {
    f * f * (1.0 - table[MEAN]) / (Vec3::ONE - f * table[MEAN])
}
