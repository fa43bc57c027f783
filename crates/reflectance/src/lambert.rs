//! Lambert 1760, "Photometria": the same radiance in every direction.

use crate::model::{Laws, Model, Sample, Spec, params};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Perfectly diffuse reflection, f = ρ/π.
    pub struct Lambert {
        reflectance: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "diffuse albedo"),
    }
}

impl Model for Lambert {
    const NAME: &'static str = "lambert";
    const SOURCE: &'static str = "Lambert 1760, Photometria";
    const DOC: &'static str = "Perfectly diffuse: the same radiance in every direction. Plaster, unfinished \
        paper. Rough surfaces look flatter than this at grazing light: see oren_nayar.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("lambert.wgsl");

    fn eval(&self, _: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        self.reflectance * FRAC_1_PI
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 {
            return 0.0;
        }
        cosine_hemisphere_pdf(wi)
    }

    fn sample(&self, _: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        let wi = cosine_hemisphere(u.truncate());
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        Some(Sample { wi, weight: self.reflectance, pdf: cosine_hemisphere_pdf(wi), delta: false, eta: 1.0 })
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.reflectance
    }
}
