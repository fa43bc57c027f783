//! Phong 1975, "Illumination for Computer Generated Pictures".

use crate::halfway::{pdf_cosine_power, sample_cosine_power};
use crate::model::{Choice, Laws, Model, Sample, Spec, params};
use glam::Vec3;
use std::f32::consts::TAU;
use yugen_optics::Frame;
use yugen_optics::frame::mirror;

params! {
    /// A lobe cosⁿ β about the mirror direction.
    pub struct Phong {
        specular: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "strength of the highlight"),
        exponent: f32 = Spec::num(50.0, 0.0, 1000.0, "", "n: larger is sharper"),
        form: Choice = Spec::choice(0, &["normalised", "radiance"],
            "normalised: f = ρ (n + 2)/2π cosⁿ β; radiance: 1975, the radiance ρ cosⁿ β under a \
                light of unit irradiance head on"),
    }
}

/// What a highlight breaks that was written as a radiance.
pub(crate) const RADIANCE: Laws = Laws {
    reciprocal: false,
    conserves_energy: false,
    why: "a radiance written as if it were a BRDF: the cosine of the light is missing and nothing normalises the lobe",
    ..Laws::PHYSICAL
};

impl Model for Phong {
    const NAME: &'static str = "phong";
    const SOURCE: &'static str = "Phong 1975, Illumination for Computer Generated Pictures; Lafortune and \
        Willems 1994, Using the Modified Phong Reflectance Model for Physically Based Rendering";
    const DOC: &'static str = "A round highlight about the mirror direction, made to look right, not \
        derived. Right: where the highlight is and that it widens with 1/√n. Wrong: the highlight stays \
        round at grazing angles, where real ones stretch (see blinn_phong and ggx), and does not grow \
        brighter there (no Fresnel). The normalised form is reciprocal and returns at most ρ, ρ cos θ for \
        a sharp lobe. The radiance form is the equation as written: as a BRDF it is ρ cosⁿ β / cos θ_i, so \
        light and eye cannot be exchanged, and for n < 2π − 1 it returns more light than arrives.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("phong.wgsl");
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
        let cos = mirror(wo).dot(wi);
        if cos <= 0.0 {
            return Vec3::ZERO;
        }
        let lobe = cos.min(1.0).powf(self.exponent);
        self.specular
            * match self.form.index() {
                0 => (self.exponent + 2.0) / TAU * lobe,
                // 1e-6: a light in the horizon stays finite.
                _ => lobe / wi.z.max(1e-6),
            }
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        pdf_cosine_power(mirror(wo).dot(wi).min(1.0), self.exponent)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        let about_mirror = sample_cosine_power(u.truncate(), self.exponent);
        Sample::of(self, table, wo, Frame::from_normal(mirror(wo)).to_world(about_mirror))
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.specular
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::furnace::{albedo, assert_samples, worst_reciprocity};

    fn white(form: u32, exponent: f32) -> Phong {
        Phong { specular: Vec3::ONE, exponent, form: Choice(form as f32) }
    }

    #[test]
    fn radiance_form_is_neither_reciprocal_nor_bounded() {
        assert!(worst_reciprocity(&white(1, 20.0), &[]) > 0.5);
        assert!(worst_reciprocity(&white(0, 20.0), &[]) < 1e-5);
        // Head on its albedo is 2π/(n + 1), which exceeds one below n = 2π − 1.
        for n in [1.0f32, 5.0, 40.0] {
            assert!((albedo(&white(1, n), &[], 0.0, 0.0, 200) - f64::from(TAU / (n + 1.0))).abs() < 1e-4);
        }
        // As radiance it peaks exactly in the mirror direction, with ρ.
        let m = white(1, 30.0);
        let wi = Vec3::new(0.6, 0.0, 0.8);
        assert!((m.eval(&[], mirror(wi), wi).x * wi.z - 1.0).abs() < 1e-5);
    }

    #[test]
    fn sampler_follows_the_lobe() {
        for form in 0..2 {
            assert_samples(&white(form, 30.0), &[], Vec3::new(0.6, 0.0, 0.8), 2e-3);
        }
    }
}
