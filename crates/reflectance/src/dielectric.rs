//! Fresnel 1823, as in Born and Wolf 1999, "Principles of Optics", 1.5: a polished boundary of glass or water.

use crate::microfacet::{f_dielectric, refract};
use crate::model::{Laws, Model, Sample, Spec, params};
use glam::Vec3;
use yugen_optics::frame::mirror;

params! {
    /// A boundary between two transparent media: the outside is the side of the normal.
    pub struct Dielectric {
        // BK7 glass in air.
        int_ior: f32 = Spec::num(1.5046, 1.0, 3.0, "", "index of refraction inside"),
        ext_ior: f32 = Spec::num(1.000277, 1.0, 3.0, "", "index of refraction outside"),
        specular_reflectance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the reflection; 1 is physical"),
        specular_transmittance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the transmission; 1 is physical"),
    }
}

impl Model for Dielectric {
    const NAME: &'static str = "dielectric";
    const SOURCE: &'static str = "Born and Wolf 1999, Principles of Optics (7th ed.), 1.5";
    const DOC: &'static str = "Perfectly smooth glass, water, a gem: reflects and refracts, with total internal \
        reflection. Closed shapes only; for a window of one sheet see thin_dielectric. Radiance changes by \
        the square of the index of refraction as it crosses.";
    const LAWS: Laws = Laws {
        reciprocal: false,
        transmits: true,
        delta: true,
        why: "radiance, unlike power, scales with the square of the index of refraction it travels in",
        ..Laws::PHYSICAL
    };
    const WGSL: &'static str = include_str!("dielectric.wgsl");
    // No difference was seen.
    const TWIN: (f32, f32) = (1e-5, 1e-6);

    fn eval(&self, _: &[f32], _: Vec3, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }

    fn pdf(&self, _: &[f32], _: Vec3, _: Vec3) -> f32 {
        0.0
    }

    fn sample(&self, _: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        let eta = if wo.z > 0.0 { self.int_ior / self.ext_ior } else { self.ext_ior / self.int_ior };
        let f = f_dielectric(wo.z.abs(), eta);
        if u.z < f {
            return Some(Sample {
                wi: mirror(wo),
                weight: self.specular_reflectance,
                pdf: f,
                delta: true,
                eta: 1.0,
            });
        }
        let wi = refract(wo, Vec3::new(0.0, 0.0, 1f32.copysign(wo.z)), eta)?;
        let weight = self.specular_transmittance / (eta * eta);
        Some(Sample { wi, weight, pdf: 1.0 - f, delta: true, eta })
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        // What passes is of whatever lies behind; denoisers do best with white.
        self.specular_transmittance
    }
}
