//! The reflection of a small Gaussian light in closed form: light of a flame without noise.
//!
//! A light whose places are a Gaussian in space covers a Gaussian of directions, and the half vector carries that over
//! into slopes, where the highlights of most models are Gaussians, too. Their product is one again, so that the integral
//! of both is the value of the whole at one direction, the mean of the product, times two exponentials and a ratio of
//! determinants. After Tokuyoshi, Ikeda, Kulkarni and Harada 2024, "Hierarchical Light Sampling with Accurate Spherical
//! Gaussian Lighting" (SIGGRAPH Asia), who widen an anisotropic lobe by an isotropic light; here the light has a covariance
//! of its own, everything smooth is taken where the product is and not where the light or the mirror is, and what lies
//! below the horizon is left out.

use crate::Bsdf;
use glam::{Mat3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_SQRT_2, PI};
use yugen_optics::special::erf_f32;

/// The same in WGSL.
pub const GAUSSIAN_LIGHT_WGSL: &str = include_str!("gaussian_light.wgsl");

/// The narrow part of a model: a lobe around slope zero of the half vector, and what is left without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlopeLobe {
    /// xx, xy and yy of the matrix A, by which the lobe is exp(−sᵀA⁻¹s) of the slopes s, or (1 + sᵀA⁻¹s)⁻² with `long_tails`.
    pub alpha2: Vec3,
    /// As in GGX.
    pub long_tails: bool,
    /// The rest of f, which is broad.
    pub rest: Vec3,
}

impl SlopeLobe {
    /// A Gaussian of slopes with these widths (√2 times the standard deviations) along the axes.
    pub fn gaussian(alpha_x: f32, alpha_y: f32) -> Self {
        Self {
            alpha2: Vec3::new(alpha_x * alpha_x, 0.0, alpha_y * alpha_y),
            long_tails: false,
            rest: Vec3::ZERO,
        }
    }

    /// The same over a diffuse ground of this albedo.
    pub fn over(self, albedo: Vec3) -> Self {
        Self { rest: albedo * (1.0 / PI), ..self }
    }
}

/// A light as a Gaussian of places, seen from the point that it lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussianLight {
    /// Radiant intensity towards the point, W/sr per channel.
    pub intensity: Vec3,
    /// Its middle, from the point; in the surface's frame.
    pub mean: Vec3,
    /// Covariance of its places; symmetric.
    pub covariance: Mat3,
}

/// The mean of max(0, x) of a Gaussian, and the probability of x > 0.
fn above_zero(mean: f32, deviation: f32) -> (f32, f32) {
    if deviation <= 1e-6 * mean.abs() {
        return (mean.max(0.0), if mean > 0.0 { 1.0 } else { 0.0 });
    }
    let x = mean / deviation;
    let density = 0.398_942_3 * (-0.5 * x * x).exp();
    let probability = 0.5 + 0.5 * erf_f32(x * FRAC_1_SQRT_2);
    ((mean * probability + deviation * density).max(0.0), probability)
}

impl Bsdf<'_> {
    /// Radiance towards `wo`: ∫ f L cos over the directions of the light, nothing in between.
    pub fn reflect_gaussian(&self, wo: Vec3, light: &GaussianLight) -> Vec3 {
        let d2 = light.mean.length_squared();
        if !(wo.z > 0.0 && d2 > 0.0) {
            return Vec3::ZERO;
        }
        let w = light.mean / d2.sqrt();
        // Of directions, about w and across it.
        let across = |v: Vec3| v - w * w.dot(v);
        let spread = |v: Vec3| across(light.covariance * across(v)) / d2;

        let up = spread(Vec3::Z);
        let (cos, share) = above_zero(w.z, up.z.max(0.0).sqrt());
        if share <= 1e-5 {
            return Vec3::ZERO;
        }
        // Of a broad lobe f is looked up where the light is, or what of it is above the horizon.
        let seen = Vec3::new(w.x, w.y, cos / share).normalize();
        let lobe = self.slope_lobe(wo, seen);
        let (at, factor) = match &lobe {
            Some(lobe) => narrow(lobe, wo, w, up, spread),
            None => (seen, cos),
        };
        let rest = lobe.map_or(Vec3::ZERO, |lobe| lobe.rest);
        let f = (self.eval(wo, at) - rest).max(Vec3::ZERO);
        (f * factor + rest * cos) * (light.intensity / d2)
    }
}

/// The direction at which the product of lobe and light lies, and the factor of f there with the cosine in it. `w`: to the
/// middle of the light, whose directions have the covariance `spread`, a matrix by what it makes of vectors; `up` of +z.
/// The slope is taken as linear over the light: Newton steps from where that leads changed no error of the tests.
fn narrow(lobe: &SlopeLobe, wo: Vec3, w: Vec3, up: Vec3, spread: impl Fn(Vec3) -> Vec3) -> (Vec3, f32) {
    // How slopes go with directions; what is below the horizon counts as on it.
    let k = 1.0 / (wo.z + w.z.max(0.0)).max(1e-4);
    let slope = (wo + w).truncate() * k;
    let [jx, jy] = [Vec3::new(k, 0.0, -slope.x * k), Vec3::new(0.0, k, -slope.y * k)];
    let (cx, cy) = (spread(jx), spread(jy));
    // The lobe's covariance of slopes. Long tails are flatter further out.
    let mut v = lobe.alpha2 * 0.5;
    if lobe.long_tails {
        let q = (v.z * slope.x * slope.x - 2.0 * v.y * slope.x * slope.y + v.x * slope.y * slope.y)
            / (v.x * v.z - v.y * v.y);
        v *= 0.5 * (1.0 + 0.5 * q);
    }
    let added = Vec3::new(jx.dot(cx), jx.dot(cy), jy.dot(cy));
    let sum = v + added;
    let per_det = 1.0 / (sum.x * sum.z - sum.y * sum.y);
    let y = Vec2::new(sum.z * slope.x - sum.y * slope.y, sum.x * slope.y - sum.y * slope.x) * per_det;
    let at = (w - cx * y.x - cy * y.y).normalize();
    // How far out that is in the light, squared.
    let far = y.x * y.x * added.x + 2.0 * y.x * y.y * added.y + y.y * y.y * added.z;
    let weight = ((v.x * v.z - v.y * v.y) * per_det).max(0.0).sqrt() * (-0.5 * far).exp();
    // What is left of the spread upwards, of what may be below the horizon.
    let taken = (sum.z * cx.z * cx.z - 2.0 * sum.y * cx.z * cy.z + sum.x * cy.z * cy.z) * per_det;
    let (cos, share) = above_zero(at.z, (up.z - taken).max(0.0).sqrt());
    if share <= 1e-5 {
        return (at, 0.0);
    }
    (Vec3::new(at.x, at.y, cos / share).normalize(), cos * weight)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Kind;
    use yugen_optics::frame::spherical;
    use yugen_optics::random::Pcg32;

    fn noh(sigma: [f32; 2]) -> Vec<f32> {
        vec![0.0, 0.0, 0.0, 0.8, 0.8, 0.8, sigma[0], sigma[1], 0.0, 0.0]
    }

    /// ∫ over places: points of equal weight, antithetic.
    fn by_points(bsdf: &Bsdf, wo: Vec3, light: &GaussianLight, deviations: Mat3, points: &[Vec3]) -> f32 {
        let at = |p: Vec3| {
            let to = light.mean + deviations * p;
            let d2 = to.length_squared();
            let wi = to / d2.sqrt();
            bsdf.eval(wo, wi).x * light.intensity.x * wi.z.max(0.0) / d2
        };
        points.iter().map(|p| at(*p) + at(-*p)).sum::<f32>() / (2 * points.len()) as f32
    }

    fn normals(count: usize) -> Vec<Vec3> {
        let mut rng = Pcg32::new(7, 1);
        (0..count).map(|_| Vec3::from_array(std::array::from_fn(|_| rng.normal()))).collect()
    }

    /// Views and surfaces at random, a light as wide as an eighth of a bonfire at 5 m. Root mean square error over the mean.
    fn error(bsdf: &Bsdf, deviation: Vec3, points: &[Vec3]) -> (f32, f32) {
        let mut rng = Pcg32::new(11, 3);
        let (mut squares, mut sum, mut found) = (0.0f64, 0.0f64, 0.0f64);
        let n = 200;
        for _ in 0..n {
            let mut u = || rng.next_f32();
            let wo = spherical((0.2 + u() * 0.78).acos(), 2.0 * PI * u());
            // Half of the time near where a mirror would need it.
            let spread = 0.6 * u();
            let m = Vec3::new(-wo.x, -wo.y, wo.z) + spread * spherical(PI * u(), 2.0 * PI * u());
            let m =
                if u() < 0.7 { m.normalize() } else { spherical((u() * 1.1 - 0.1).acos(), 2.0 * PI * u()) };
            let turn = Mat3::from_axis_angle(spherical(PI * u(), 2.0 * PI * u()), 6.0 * u());
            let deviations = turn * Mat3::from_diagonal(deviation);
            let light = GaussianLight {
                intensity: Vec3::ONE,
                mean: 5.0 * m,
                covariance: deviations * deviations.transpose(),
            };
            let truth = f64::from(by_points(bsdf, wo, &light, deviations, points));
            let closed = f64::from(bsdf.reflect_gaussian(wo, &light).x);
            assert!(closed >= 0.0 && closed.is_finite(), "{wo} {light:?} {closed} {truth}");
            squares += (closed - truth).powi(2);
            sum += truth;
            found += closed;
        }
        let mean = sum / f64::from(n);
        (((squares / f64::from(n)).sqrt() / mean) as f32, (found / sum - 1.0) as f32)
    }

    const SMALL: Vec3 = Vec3::splat(0.1);
    /// A whole bonfire.
    const LARGE: Vec3 = Vec3::new(0.15, 0.15, 0.3);

    #[test]
    fn a_light_like_a_part_of_a_flame_is_reflected_within_a_hundredth() {
        let points = normals(6_000);
        // Worst seen: widths; error of a small light and of a large one. What is left of the small one's is the points'.
        for (sigma, small, large) in [
            ([0.35, 0.25], 0.0021, 0.019),
            ([0.3, 0.1], 0.0024, 0.020),
            ([0.2, 0.05], 0.005, 0.024),
            ([0.12, 0.03], 0.011, 0.029),
        ] {
            let slots = noh(sigma);
            let bsdf = Bsdf::new(Kind::Noh, &slots, &[]);
            for (deviation, most) in [(SMALL, small), (LARGE, large)] {
                let (error, bias) = error(&bsdf, deviation, &points);
                assert!(error < 2.0 * most && bias.abs() < 0.01, "{sigma:?} {deviation}: {error} {bias}");
            }
        }
        for (kind, small, large) in [
            (Kind::Lambert, 4.4e-5, 0.0056),
            (Kind::MetallicRoughness, 0.0018, 0.0092),
            (Kind::Ggx, 0.0036, 0.016),
            // GGX of .12: the tails are wider than any Gaussian.
            (Kind::GoldThread, 0.013, 0.036),
            (Kind::Microcylinder, 0.0063, 0.017),
        ] {
            let slots = kind.defaults();
            let table = kind.bake(&slots, &[]).unwrap();
            let bsdf = Bsdf::new(kind, &slots, &table);
            for (deviation, most) in [(SMALL, small), (LARGE, large)] {
                let (error, bias) = error(&bsdf, deviation, &points);
                assert!(error < 2.0 * most && bias.abs() < 0.04, "{}: {error} {bias}", kind.name());
            }
        }
    }

    #[test]
    fn a_light_without_extent_is_a_point() {
        let mut seen = 0;
        for &kind in Kind::ALL {
            let slots = kind.defaults();
            let Ok(table) = kind.bake(&slots, &[]) else { continue };
            let bsdf = Bsdf::new(kind, &slots, &table);
            for (a, b, phi) in
                [(0.1, 0.2, 1.0), (0.8, 0.7, 3.0), (1.2, 0.3, 0.4), (1.4, 1.45, 3.1), (0.3, 2.0, 0.0)]
            {
                let (wo, wi) = (spherical(a, 0.3), spherical(b, 0.3 + phi));
                let intensity = Vec3::new(2.0, 1.0, 3.0);
                let light = GaussianLight { intensity, mean: 4.0 * wi, covariance: Mat3::ZERO };
                let want =
                    if wi.z > 0.0 { bsdf.eval(wo, wi) * intensity * (wi.z / 16.0) } else { Vec3::ZERO };
                let got = bsdf.reflect_gaussian(wo, &light);
                let most = 1e-5 * want.max_element() + 1e-9;
                assert!((got - want).abs().max_element() < most, "{} {got} {want}", kind.name());
                seen += 1;
            }
        }
        assert!(seen > 100, "{seen}");
    }

    #[test]
    fn what_is_below_the_horizon_gives_nothing() {
        let slots = Kind::Lambert.defaults();
        let bsdf = Bsdf::new(Kind::Lambert, &slots, &[]);
        let mut points = normals(20_000);
        points.iter_mut().for_each(|p| *p *= 0.2);
        for height in [-0.3f32, -0.1, 0.0, 0.1, 0.5] {
            let light = GaussianLight {
                intensity: Vec3::ONE,
                mean: Vec3::new(4.0, 0.0, height),
                covariance: Mat3::from_diagonal(Vec3::splat(0.04)),
            };
            let want = by_points(&bsdf, Vec3::Z, &light, Mat3::IDENTITY, &points);
            let got = bsdf.reflect_gaussian(Vec3::Z, &light).x;
            // Of a light half of which is seen; the worst is .004 of that.
            let scale = 0.2 * 0.4 / (PI * 64.0) * slots[0];
            assert!((got - want).abs() < 0.015 * scale, "{height}: {got} {want} {scale}");
        }
    }
}
