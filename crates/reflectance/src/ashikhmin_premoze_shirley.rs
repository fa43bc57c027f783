//! Ashikhmin, Premože and Shirley 2000, "A Microfacet-based BRDF Generator".

use crate::ashikhmin_g;
use crate::gaussian_light::SlopeLobe;
use crate::halfway::{half_vector, pdf_gaussian_reflection, sample_gaussian_reflection};
use crate::microfacet::f_schlick;
use crate::model::{Choice, Laws, Model, ModelError, Sample, Spec, params};
use glam::Vec3;

params! {
    /// A BRDF from nothing but a distribution of normals, here an elliptical Gaussian of slopes.
    pub struct AshikhminPremozeShirley {
        f0: Vec3 = Spec::rgb(0.8, 0.0, 1.0, "", "reflectance of a facet head on; white at grazing \
            light (Schlick)"),
        sigma_x: f32 = Spec::num(0.1, 0.02, 1.0, "", "slope of the highlight along the tangent \
            (root mean square times √2)"),
        sigma_y: f32 = Spec::num(0.4, 0.02, 1.0, "", "slope of the highlight across the tangent"),
        form: Choice = Spec::choice(0, &["uncorrelated", "correlated"],
            "uncorrelated: light and eye are shadowed independently; correlated: together where \
                their azimuths agree"),
        correlation: f32 = Spec::num(0.35, 0.05, 1.0, "rad", "azimuth over which the correlation \
            fades (15 to 25 degrees)"),
    }
}

/// f with F = 1. `correlation` is `None` for independent shadowing. P(k) = cos θ_k ⟨h·n⟩/g(k).
#[inline]
pub(crate) fn f_ashikhmin2000(
    table: &[f32],
    wo: Vec3,
    wi: Vec3,
    sx: f32,
    sy: f32,
    correlation: Option<f32>,
) -> f32 {
    let (h, _) = half_vector(wo, wi);
    let (go, gi) = (ashikhmin_g::g(table, wo), ashikhmin_g::g(table, wi));
    let mut shadowing = ashikhmin_g::mean_cosine(table) / (go * gi);
    if let Some(width) = correlation {
        // The angle between the azimuths; either direction head on is never in shadow, whatever comes out.
        let (a, b) = (wo.truncate(), wi.truncate());
        let phi = a.perp_dot(b).abs().atan2(a.dot(b));
        let x = phi / width;
        let together = (-0.5 * x * x).exp();
        // min(P(wo), P(wi)) over ⟨h·n⟩ and both cosines; 1e-6 keeps a light in the horizon finite.
        let least = (1.0 / (wi.z.max(1e-6) * go)).min(1.0 / (wo.z.max(1e-6) * gi));
        shadowing += together * (least - shadowing);
    }
    0.25 * ashikhmin_g::p(table, h, sx, sy) * shadowing
}

impl Model for AshikhminPremozeShirley {
    const NAME: &'static str = "ashikhmin_premoze_shirley";
    const SOURCE: &'static str = "Ashikhmin, Premože and Shirley 2000, A Microfacet-based BRDF Generator";
    const DOC: &'static str = "Satin, velvet, brushed metal: choose how the facets are turned and the rest \
        follows, shadowing included, f = p ⟨h·n⟩ F/(4 g g). Here p is an elliptical Gaussian of slopes. \
        Right: reciprocal, never returns more than arrives, and close to all of it for smooth surfaces; no \
        groove or Smith assumption is needed. Wrong: light that bounces twice is lost (9 % for σ = (0.1, \
        0.5) at 80°), and with independent shadowing a rough surface lit from behind the eye is too dark, \
        which the correlated form repairs. g has no closed form: it is tabulated once for constant σx, σy; \
        a texture of σ changes the highlight but keeps the table of the material's constant.";
    const LAWS: Laws = Laws { isotropic: false, ..Laws::PHYSICAL };
    const WGSL: &'static str = include_str!("ashikhmin_premoze_shirley.wgsl");
    // Worst 1e-5.
    const TWIN: (f32, f32) = (4e-5, 1e-5);

    fn bake(&self, _: &[f32]) -> Result<Vec<f32>, ModelError> {
        ashikhmin_g::bake(self.sigma_x, self.sigma_y)
    }

    fn laws(&self) -> Laws {
        Laws { isotropic: self.sigma_x == self.sigma_y, ..Laws::PHYSICAL }
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        let correlation = (self.form.index() == 1).then_some(self.correlation);
        let (_, cos) = half_vector(wo, wi);
        f_schlick(self.f0, Vec3::ONE, cos)
            * f_ashikhmin2000(table, wo, wi, self.sigma_x, self.sigma_y, correlation)
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        pdf_gaussian_reflection(wo, wi, self.sigma_x, self.sigma_y)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        // p cos³ θ_h short of the density drawn from: the weight is bounded.
        Sample::of(self, table, wo, sample_gaussian_reflection(wo, u, self.sigma_x, self.sigma_y))
    }

    fn slope_lobe(&self, _: &[f32], _: Vec3, _: Vec3) -> Option<SlopeLobe> {
        Some(SlopeLobe::gaussian(self.sigma_x, self.sigma_y))
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.f0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::furnace::{albedo, assert_samples, worst_reciprocity};

    fn white(sigma_x: f32, sigma_y: f32, form: u32) -> (AshikhminPremozeShirley, Vec<f32>) {
        let m = AshikhminPremozeShirley {
            f0: Vec3::ONE,
            sigma_x,
            sigma_y,
            form: Choice(form as f32),
            correlation: 0.35,
        };
        (m, m.bake(&[]).unwrap())
    }

    #[test]
    fn correlation_adds_light_towards_its_source_and_none_across() {
        let ((a, table), (b, _)) = (white(0.5, 0.5, 0), white(0.5, 0.5, 1));
        let wo = Vec3::new(0.96, 0.0, 0.28);
        let ratio = |wi: Vec3| b.eval(&table, wo, wi).x / a.eval(&table, wo, wi).x;
        assert!(ratio(wo) > 1.05, "{}", ratio(wo));
        assert!((ratio(Vec3::new(0.0, 0.8, 0.6)) - 1.0).abs() < 1e-4);
        assert!((ratio(Vec3::Z) - 1.0).abs() < 2e-3);
        for theta in [0.0, 50.0, 80.0] {
            let (x, y) = (albedo(&a, &table, theta, 0.0, 200), albedo(&b, &table, theta, 0.0, 200));
            assert!(x <= y + 1e-6 && y < 1.0 + 1e-4, "{theta}: {x} {y}");
        }
    }

    #[test]
    fn forms_are_reciprocal_and_sampled() {
        for form in 0..2 {
            let (m, table) = white(0.2, 0.6, form);
            assert!(worst_reciprocity(&m, &table) < 1e-4);
            assert_samples(&m, &table, Vec3::new(0.36, 0.48, 0.8), 3e-3);
        }
    }
}
