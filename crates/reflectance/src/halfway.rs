//! Half vectors and the Gaussian of slopes that Ward, Ashikhmin and the Noh costume share.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// The same in WGSL, spliced in after `frame.wgsl`.
pub const HALFWAY_WGSL: &str = include_str!("halfway.wgsl");

/// The unit vector between two directions of the upper hemisphere, and the cosine between it and either:
/// half the length of the sum, exact and the same from both sides where a dot product cancels.
#[inline]
pub fn half_vector(wo: Vec3, wi: Vec3) -> (Vec3, f32) {
    let sum = wo + wi;
    let length = sum.length().max(1e-12);
    (sum / length, 0.5 * length)
}

/// Where a facet with normal `h` sends `wo`.
#[inline]
pub fn reflect(wo: Vec3, h: Vec3) -> Vec3 {
    2.0 * wo.dot(h) * h - wo
}

/// Density of `wi` whose half vector with `wo` has the density `pdf_h`: dω_h = dω_i / (4 h·wo).
#[inline]
pub fn pdf_reflected(pdf_h: f32, h_dot_wo: f32) -> f32 {
    pdf_h / (4.0 * h_dot_wo)
}

/// tan² θ_h (cos² φ_h / σx² + sin² φ_h / σy²), the squared slope in units of its width. `h` need not be unit.
#[inline]
pub fn squared_slope(h: Vec3, sx: f32, sy: f32) -> f32 {
    // A half vector on the horizon would make 0/0.
    let z = h.z.max(1e-12);
    let (x, y) = (h.x / (sx * z), h.y / (sy * z));
    x * x + y * y
}

/// Draws a half vector with Gaussian slopes. Walter 2005, "Notes on the Ward BRDF".
#[inline]
pub fn sample_gaussian_slopes(u: Vec2, sx: f32, sy: f32) -> Vec3 {
    let r = (-(1.0 - u.x).ln()).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * sx * cos, r * sy * sin, 1.0).normalize()
}

/// Density of [`sample_gaussian_slopes`] per solid angle of the unit vector `h`.
#[inline]
pub fn pdf_gaussian_slopes(h: Vec3, sx: f32, sy: f32) -> f32 {
    let e = (-squared_slope(h, sx, sy)).exp();
    if e > 0.0 { FRAC_1_PI * e / (sx * sy * h.z * h.z * h.z) } else { 0.0 }
}

/// Draws a half vector with density (n + 1)/2π · cosⁿ θ_h. Blinn 1977's lobe; works for Phong's about any axis.
#[inline]
pub fn sample_cosine_power(u: Vec2, n: f32) -> Vec3 {
    let z = (1.0 - u.x).powf(1.0 / (n + 1.0));
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Density of [`sample_cosine_power`] at an angle whose cosine is `c`.
#[inline]
pub fn pdf_cosine_power(c: f32, n: f32) -> f32 {
    if c <= 0.0 { 0.0 } else { (n + 1.0) / TAU * c.powf(n) }
}

/// G of V-shaped grooves, Torrance and Sparrow 1967, over 4 cos θ_o cos θ_i: the smallest of 1, 2 (n·h)(n·o)/(o·h)
/// and 2 (n·h)(n·i)/(o·h), divided before the cosines can vanish. `h` and `h_dot_wo` are those of [`half_vector`].
#[inline]
pub fn v_grooves(wo: Vec3, wi: Vec3, h: Vec3, h_dot_wo: f32) -> f32 {
    let open = 0.25 / (wo.z * wi.z).max(1e-37);
    let masked = 0.5 * h.z / (h_dot_wo * wo.z.max(wi.z));
    open.min(masked)
}

/// G of V-shaped grooves itself, 0 to 1.
#[inline]
pub fn g_grooves(wo: Vec3, wi: Vec3, h: Vec3, h_dot_wo: f32) -> f32 {
    (2.0 * h.z * wo.z.min(wi.z) / h_dot_wo).clamp(0.0, 1.0)
}

/// The wall of the groove of `h` (itself or its mirror image about the normal) that `wo` sees, each in proportion
/// to the area seen. Heitz and d'Eon 2014, "Importance Sampling Microfacet-Based BSDFs using the Distribution of
/// Visible Normals".
#[inline]
pub fn seen_wall(wo: Vec3, h: Vec3, u: f32) -> Vec3 {
    let other = Vec3::new(-h.x, -h.y, h.z);
    let (a, b) = (wo.dot(h).max(0.0), wo.dot(other).max(0.0));
    if u * (a + b) < a { h } else { other }
}

/// Density of [`seen_wall`] at `h` where both walls of a groove have the density `pdf_h`.
#[inline]
pub fn pdf_seen_wall(wo: Vec3, h: Vec3, pdf_h: f32) -> f32 {
    let a = wo.dot(h).max(0.0);
    let b = (wo.z * h.z - wo.x * h.x - wo.y * h.y).max(0.0);
    if a > 0.0 { 2.0 * pdf_h * a / (a + b) } else { 0.0 }
}

/// Draws `wi` by a half vector of Gaussian slopes, on the wall that `wo` sees. `u.z` chooses the wall.
#[inline]
pub fn sample_gaussian_reflection(wo: Vec3, u: Vec3, sx: f32, sy: f32) -> Vec3 {
    reflect(wo, seen_wall(wo, sample_gaussian_slopes(u.truncate(), sx, sy), u.z))
}

/// Density of [`sample_gaussian_reflection`].
#[inline]
pub fn pdf_gaussian_reflection(wo: Vec3, wi: Vec3, sx: f32, sy: f32) -> f32 {
    let (h, cos) = half_vector(wo, wi);
    pdf_reflected(pdf_seen_wall(wo, h, pdf_gaussian_slopes(h, sx, sy)), cos)
}

/// The share of draws that go to a lobe of albedo about `specular` beside one of about `diffuse`.
#[inline]
pub fn lobe_share(specular: Vec3, diffuse: Vec3) -> f32 {
    let (s, d) = (specular.max_element(), diffuse.max_element());
    if s + d > 0.0 { s / (s + d) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    #[test]
    fn densities_of_half_vectors_integrate_to_one_and_match_their_draws() {
        // E[g] under the draws against ∫ g pdf, g a lopsided polynomial.
        let g = |h: Vec3| f64::from(h.x * h.x + 0.5 * h.z * h.z + 0.3 * h.y * h.y * h.z);
        let mut rng = Pcg32::new(7, 1);
        for (sx, sy) in [(0.1, 0.5), (0.8, 0.3)] {
            let (mut draws, mut integral, mut total) = (0.0, 0.0, 0.0);
            let (n, m) = (100_000, 1600);
            for _ in 0..n {
                let u = rng.next_vec3();
                draws += g(sample_gaussian_slopes(u.truncate(), sx, sy)) / f64::from(n);
            }
            for i in 0..m {
                for k in 0..50 {
                    let z = (i as f32 + 0.5) / m as f32;
                    let (sin, cos) = (TAU * (k as f32 + 0.5) / 50.0).sin_cos();
                    let r = (1.0 - z * z).sqrt();
                    let h = Vec3::new(r * cos, r * sin, z);
                    let p = f64::from(pdf_gaussian_slopes(h, sx, sy) * TAU) / f64::from(m * 50);
                    integral += g(h) * p;
                    total += p;
                }
            }
            assert!((total - 1.0).abs() < 1e-3, "{total}");
            // Four standard errors of 1e5 draws.
            assert!((draws - integral).abs() < 4e-3, "{draws} {integral}");
        }
    }
}
