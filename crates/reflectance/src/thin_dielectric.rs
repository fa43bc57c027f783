//! Stokes 1860, "On the Intensity of the Light Reflected from or Transmitted through a Pile of Plates": one plate.

use crate::microfacet::f_dielectric;
use crate::model::{Laws, Model, Sample, Spec, params};
use glam::Vec3;
use yugen_optics::frame::mirror;

params! {
    /// A sheet of glass too thin to displace what is seen through it.
    pub struct ThinDielectric {
        // BK7 glass in air.
        int_ior: f32 = Spec::num(1.5046, 1.0, 3.0, "", "index of refraction of the sheet"),
        ext_ior: f32 = Spec::num(1.000277, 1.0, 3.0, "", "index of refraction on both sides"),
        specular_reflectance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the reflection; 1 is physical"),
        specular_transmittance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the transmission; 1 is physical"),
    }
}

impl Model for ThinDielectric {
    const NAME: &'static str = "thin_dielectric";
    const SOURCE: &'static str =
        "Stokes 1860, On the Intensity of the Light Reflected from or Transmitted through a Pile of Plates";
    const DOC: &'static str = "A window pane as a single surface: reflections between its two sides are summed, \
        light goes straight on.";
    const LAWS: Laws = Laws { transmits: true, delta: true, ..Laws::PHYSICAL };
    const WGSL: &'static str = include_str!("thin_dielectric.wgsl");
    // No difference was seen.
    const TWIN: (f32, f32) = (1e-5, 1e-6);

    fn eval(&self, _: &[f32], _: Vec3, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }

    fn pdf(&self, _: &[f32], _: Vec3, _: Vec3) -> f32 {
        0.0
    }

    fn sample(&self, _: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        // R + T R T + T R³ T + … with T = 1 − R.
        let once = f_dielectric(wo.z.abs(), self.int_ior / self.ext_ior);
        let r = 2.0 * once / (1.0 + once);
        if u.z < r {
            return Some(Sample {
                wi: mirror(wo),
                weight: self.specular_reflectance,
                pdf: r,
                delta: true,
                eta: 1.0,
            });
        }
        Some(Sample { wi: -wo, weight: self.specular_transmittance, pdf: 1.0 - r, delta: true, eta: 1.0 })
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.specular_transmittance
    }
}
