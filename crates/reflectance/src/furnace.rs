//! White furnace for the unit tests of the models: how much of the light from one side comes back.

use crate::Model;
use glam::Vec3;
use std::f64::consts::{FRAC_PI_2, TAU};
use yugen_optics::frame::spherical;
use yugen_optics::quadrature::gauss_legendre;

/// ∫ f cos θ_i dω_i for light that leaves towards `theta`, `phi` (degrees), red channel: `n` Gauss-Legendre
/// nodes in the polar angle, `2 n` equal steps in azimuth.
pub fn albedo<M: Model>(model: &M, table: &[f32], theta: f32, phi: f32, n: usize) -> f64 {
    let wo = spherical(theta.to_radians(), phi.to_radians());
    let mut sum = 0.0;
    for (t, weight) in gauss_legendre(n, 0.0, FRAC_PI_2) {
        for k in 0..2 * n {
            // Off the axes, where a lobe may have a kink.
            let wi = spherical(t as f32, (TAU * (k as f64 + 0.25) / (2 * n) as f64) as f32);
            sum += f64::from(model.eval(table, wo, wi).x) * t.cos() * t.sin() * weight;
        }
    }
    sum * TAU / (2 * n) as f64
}

/// Asserts the albedos of a model at the given polar angles (degrees) to within `tolerance`.
pub fn assert_albedos<M: Model>(model: &M, table: &[f32], phi: f32, expected: &[(f32, f64)], tolerance: f64) {
    for &(theta, want) in expected {
        let got = albedo(model, table, theta, phi, 200);
        assert!((got - want).abs() < tolerance, "{} at {theta}°, {phi}°: {got} instead of {want}", M::NAME);
    }
}

/// Number i of n² points of the unit cube: midpoints of a grid, the third number by the golden ratio, even and unrelated
/// to the first two.
fn stratified(i: usize, n: usize) -> Vec3 {
    let at = |k: usize| (k as f32 + 0.5) / n as f32;
    Vec3::new(at(i % n), at(i / n), (i as f64 * 0.618_033_988_749_895).fract() as f32)
}

/// Mean weight of n² draws, first channel: the albedo, over both sides where light passes.
pub fn mean_weight<M: Model>(model: &M, table: &[f32], wo: Vec3, n: usize) -> f64 {
    let weight = |i| model.sample(table, wo, stratified(i, n)).map_or(0.0, |s| f64::from(s.weight.x));
    (0..n * n).map(weight).sum::<f64>() / (n * n) as f64
}

/// Asserts that every draw carries weight f cos / pdf, that its density is `pdf`, and that the mean weight is
/// the albedo: a sampler whose density is wrong fails here.
pub fn assert_samples<M: Model>(model: &M, table: &[f32], wo: Vec3, tolerance: f64) {
    let n = 256;
    let (mut mean, mut light) = (0.0, 0);
    for i in 0..n * n {
        let Some(s) = model.sample(table, wo, stratified(i, n)) else { continue };
        let (f, pdf) = model.eval_pdf(table, wo, s.wi);
        assert!((pdf - s.pdf).abs() <= 1e-3 * pdf, "{}: pdf {pdf} but sampled {}", M::NAME, s.pdf);
        let weight = f * s.wi.z / pdf;
        assert!(
            (weight - s.weight).length() <= 2e-3 * weight.length() + 1e-6,
            "{}: {weight} {}",
            M::NAME,
            s.weight
        );
        mean += f64::from(s.weight.x) / (n * n) as f64;
        light += 1;
    }
    assert!(light > 0, "{}: no draw carries light", M::NAME);
    let theta = wo.z.acos().to_degrees();
    let want = albedo(model, table, theta, wo.y.atan2(wo.x).to_degrees(), 200);
    assert!((mean - want).abs() < tolerance, "{} at {theta}°: mean weight {mean}, albedo {want}", M::NAME);
}

/// The largest |f(wo, wi) − f(wi, wo)| over the larger of the two, for directions all over the hemisphere.
pub fn worst_reciprocity<M: Model>(model: &M, table: &[f32]) -> f32 {
    let directions: Vec<Vec3> =
        (0..64).map(|i| spherical((i as f32 + 0.5) / 64.0 * 1.5, i as f32 * 2.399_963)).collect();
    let mut worst = 0.0f32;
    for &a in &directions {
        for &b in &directions {
            let (f, g) = (model.eval(table, a, b), model.eval(table, b, a));
            let scale = f.max(g).max_element();
            if scale > 1e-20 {
                worst = worst.max((f - g).abs().max_element() / scale);
            }
        }
    }
    worst
}
