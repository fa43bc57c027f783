//! Ashikhmin and Shirley 2000, "An Anisotropic Phong BRDF Model".

use crate::halfway::{half_vector, pdf_reflected, reflect};
use crate::microfacet::{f_schlick, schlick_weight};
use crate::model::{Laws, Model, Sample, Spec, params};
use glam::Vec3;
use std::f32::consts::{PI, TAU};
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// An anisotropic power of cosine about the half vector over a ground that gives way to it.
    pub struct AshikhminShirley {
        diffuse: Vec3 = Spec::rgb(0.3, 0.0, 1.0, "", "R_d, albedo of the ground"),
        specular: Vec3 = Spec::rgb(0.3, 0.0, 1.0, "", "R_s, reflectance of the coat head on"),
        n_u: f32 = Spec::num(400.0, 0.0, 2000.0, "", "exponent along the tangent: larger is sharper"),
        n_v: f32 = Spec::num(20.0, 0.0, 2000.0, "", "exponent across the tangent"),
    }
}

impl AshikhminShirley {
    /// Density of the half vector per solid angle, √((n_u + 1)(n_v + 1))/2π · cos^(n_u cos² φ + n_v sin² φ) θ_h.
    fn pdf_half(&self, h: Vec3) -> f32 {
        let s2 = h.x * h.x + h.y * h.y;
        let exponent = if s2 > 0.0 { (self.n_u * h.x * h.x + self.n_v * h.y * h.y) / s2 } else { 0.0 };
        ((self.n_u + 1.0) * (self.n_v + 1.0)).sqrt() / TAU * h.z.min(1.0).powf(exponent)
    }

    fn sample_half(&self, u: glam::Vec2) -> Vec3 {
        // tan φ = √((n_u + 1)/(n_v + 1)) tan(2π u), quadrant kept.
        let (sin, cos) = (TAU * u.y).sin_cos();
        let p = glam::Vec2::new(cos * (self.n_v + 1.0).sqrt(), sin * (self.n_u + 1.0).sqrt()).normalize();
        let exponent = self.n_u * p.x * p.x + self.n_v * p.y * p.y;
        let z = (1.0 - u.x).powf(1.0 / (exponent + 1.0));
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * p.x, r * p.y, z)
    }

    fn share(&self) -> f32 {
        let (s, d) = (
            self.specular.max_element().max(0.1),
            ((Vec3::ONE - self.specular) * self.diffuse).max_element(),
        );
        s / (s + d)
    }
}

/// 1 − (1 − c/2)⁵: the light the coat lets through.
fn let_in(c: f32) -> f32 {
    1.0 - schlick_weight(0.5 * c)
}

impl Model for AshikhminShirley {
    const NAME: &'static str = "ashikhmin_shirley";
    const SOURCE: &'static str = "Ashikhmin and Shirley 2000, An Anisotropic Phong BRDF Model";
    const DOC: &'static str = "Brushed metal and varnished wood with two exponents, a Fresnel term, and a \
        ground that darkens where the coat brightens: the first Phong that keeps both laws. Right: \
        reciprocal, energy bounded, cheap to draw from, ground and highlight trade light at grazing \
        angles. Wrong: no masking, instead 1/max(cos, cos), which loses up to half of the light near the \
        horizon, and the powers fall off faster than real tails (see ggx).";
    const LAWS: Laws = Laws { isotropic: false, ..Laws::PHYSICAL };
    const WGSL: &'static str = include_str!("ashikhmin_shirley.wgsl");
    // Worst 2e-4: pow(c, n) with n up to 2000.
    const TWIN: (f32, f32) = (1e-3, 1e-5);

    fn laws(&self) -> Laws {
        Laws { isotropic: self.n_u == self.n_v, ..Laws::PHYSICAL }
    }

    fn eval(&self, _: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        let (h, c) = half_vector(wo, wi);
        // √(..)/8π = pdf/4
        let highlight = 0.25 * self.pdf_half(h) / (c * wo.z.max(wi.z));
        // 28/23π makes the ground white for white light head on.
        let ground =
            self.diffuse * (Vec3::ONE - self.specular) * (28.0 / (23.0 * PI) * let_in(wo.z) * let_in(wi.z));
        f_schlick(self.specular, Vec3::ONE, c) * highlight + ground
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let ((h, c), share) = (half_vector(wo, wi), self.share());
        share * pdf_reflected(self.pdf_half(h), c) + (1.0 - share) * cosine_hemisphere_pdf(wi)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if u.z >= self.share() {
            return Sample::of(self, table, wo, cosine_hemisphere(u.truncate()));
        }
        let h = self.sample_half(u.truncate());
        // Seen from behind a facet reflects nothing.
        if h.dot(wo) <= 0.0 {
            return None;
        }
        Sample::of(self, table, wo, reflect(wo, h))
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.specular + self.diffuse * (Vec3::ONE - self.specular)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::furnace::{albedo, assert_albedos, assert_samples, worst_reciprocity};

    fn model(specular: f32, diffuse: f32, n_u: f32, n_v: f32) -> AshikhminShirley {
        AshikhminShirley { diffuse: Vec3::splat(diffuse), specular: Vec3::splat(specular), n_u, n_v }
    }

    #[test]
    fn ground_alone_has_its_closed_albedo() {
        // R_s = 0 leaves Schlick's rim; take it away by comparing white and black ground.
        for theta in [0.0f32, 40.0, 80.0] {
            let white = albedo(&model(0.0, 1.0, 10.0, 10.0), &[], theta, 0.0, 100);
            let black = albedo(&model(0.0, 0.0, 10.0, 10.0), &[], theta, 0.0, 100);
            let want = f64::from(let_in(theta.to_radians().cos()));
            assert!((white - black - want).abs() < 1e-5, "{theta}: {white} {black} {want}");
        }
    }

    #[test]
    fn albedos_are_those_of_an_independent_double_precision_quadrature() {
        let at = |a: [f64; 4]| -> Vec<_> { [0.0, 30.0, 60.0, 80.0].into_iter().zip(a).collect() };
        assert_albedos(
            &model(1.0, 1.0, 10.0, 10.0),
            &[],
            0.0,
            &at([0.69571, 0.68817, 0.61333, 0.53932]),
            3e-5,
        );
        assert_albedos(
            &model(0.5, 1.0, 100.0, 100.0),
            &[],
            0.0,
            &at([0.96496, 0.93761, 0.81847, 0.61171]),
            3e-5,
        );
        assert_albedos(&model(0.0, 1.0, 1.0, 1.0), &[], 0.0, &at([0.96877, 0.94162, 0.76728, 0.40070]), 3e-5);
    }

    #[test]
    fn model_is_reciprocal_and_sampled() {
        for m in [model(0.4, 0.5, 300.0, 20.0), model(0.9, 0.1, 5.0, 60.0)] {
            assert!(worst_reciprocity(&m, &[]) < 1e-4);
            assert_samples(&m, &[], Vec3::new(0.48, 0.36, 0.8), 3e-3);
        }
    }
}
