//! Blinn 1977, "Models of Light Reflection for Computer Synthesized Pictures".

use crate::halfway::{half_vector, pdf_cosine_power, pdf_reflected, reflect, sample_cosine_power};
use crate::model::{Choice, Laws, Model, Sample, Spec, params};
use crate::phong::RADIANCE;
use glam::Vec3;
use std::f32::consts::PI;

params! {
    /// A lobe cosⁿ α about the normal, α the angle of the half vector.
    pub struct BlinnPhong {
        specular: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "strength of the highlight"),
        exponent: f32 = Spec::num(50.0, 0.0, 1000.0, "",
            "n, the n1 of the distribution D1 = cosⁿ α: four times Phong's for a highlight of the \
                same width"),
        form: Choice = Spec::choice(0, &["normalised", "radiance"],
            "normalised: albedo ρ head on; radiance: the radiance ρ cosⁿ α under a light of unit \
                irradiance head on"),
    }
}

/// 1/∫ cosⁿ α cos θ dω at normal incidence, where α = θ/2: (n + 2)(n + 4) / (8π (2^{−n/2} + n)).
pub fn normaliser(n: f32) -> f32 {
    (n + 2.0) * (n + 4.0) / (8.0 * PI * ((-0.5 * n).exp2() + n))
}

impl Model for BlinnPhong {
    const NAME: &'static str = "blinn_phong";
    const SOURCE: &'static str = "Blinn 1977, Models of Light Reflection for Computer Synthesized Pictures";
    const DOC: &'static str = "Phong's highlight measured at the half vector. Right: highlights on flat \
        surfaces stretch towards the eye at grazing angles, as the setting sun on water does. Wrong: no \
        Fresnel, no shadowing by the facets and no 1/(cos cos), so the surface darkens towards the rim \
        where real ones brighten: the albedo falls from ρ head on towards zero. n is the n1 of \
        torrance_sparrow's D1, which puts the missing factors back. The radiance form is what shading \
        languages compute; as a BRDF it divides by the cosine of the light and so is not reciprocal.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("blinn_phong.wgsl");
    // Worst 1.1e-4: pow(c, n) with n up to 1000.
    const TWIN: (f32, f32) = (5e-4, 1e-5);

    fn laws(&self) -> Laws {
        match self.form.index() {
            0 => Laws::PHYSICAL,
            _ => RADIANCE,
        }
    }

    fn eval(&self, _: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        let lobe = half_vector(wo, wi).0.z.min(1.0).powf(self.exponent);
        self.specular
            * match self.form.index() {
                0 => normaliser(self.exponent) * lobe,
                // 1e-6: a light in the horizon stays finite.
                _ => lobe / wi.z.max(1e-6),
            }
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let (h, cos) = half_vector(wo, wi);
        pdf_reflected(pdf_cosine_power(h.z.min(1.0), self.exponent), cos)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        let h = sample_cosine_power(u.truncate(), self.exponent);
        // Seen from behind a facet reflects nothing.
        if h.dot(wo) <= 0.0 {
            return None;
        }
        Sample::of(self, table, wo, reflect(wo, h))
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.specular
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::furnace::{albedo, assert_samples, worst_reciprocity};

    fn white(form: u32, exponent: f32) -> BlinnPhong {
        BlinnPhong { specular: Vec3::ONE, exponent, form: Choice(form as f32) }
    }

    #[test]
    fn no_exponent_returns_more_than_arrives() {
        for n in [0.0, 0.3, 1.0, 3.0, 10.0] {
            for theta in [0.0, 20.0, 50.0, 75.0, 88.0] {
                assert!(albedo(&white(0, n), &[], theta, 0.0, 100) < 1.0 + 1e-4);
            }
        }
    }

    #[test]
    fn radiance_form_is_the_lobe_itself_and_breaks_both_laws() {
        let (wo, wi) = (Vec3::new(0.0, 0.6, 0.8), Vec3::new(0.28, 0.0, 0.96));
        let m = white(1, 12.0);
        let cos = (wo + wi).normalize().z;
        assert!((m.eval(&[], wo, wi).x * wi.z - cos.powi(12)).abs() < 1e-6);
        assert!(worst_reciprocity(&m, &[]) > 0.5);
        assert!(albedo(&white(1, 2.0), &[], 0.0, 0.0, 100) > 2.0);
        assert!(worst_reciprocity(&white(0, 12.0), &[]) < 1e-5);
    }

    #[test]
    fn sampler_follows_the_lobe() {
        for form in 0..2 {
            assert_samples(&white(form, 60.0), &[], Vec3::new(0.6, 0.0, 0.8), 2e-3);
        }
    }
}
