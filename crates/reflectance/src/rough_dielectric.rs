//! Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces": frosted glass.

use crate::microfacet::{DISTRIBUTIONS, MASKINGS, Microfacets, apart_from_one, f_dielectric, refract};
use crate::model::{Choice, Laws, Model, Sample, Spec, params};
use glam::Vec3;
use yugen_optics::frame::to_upper;

params! {
    /// Facets of glass, each of which reflects and refracts.
    pub struct RoughDielectric {
        distribution: Choice = Spec::choice(0, DISTRIBUTIONS, "distribution of the facets' normals"),
        masking: Choice = Spec::choice(0, MASKINGS, "Smith's shadowing-masking, for reflection"),
        alpha_x: f32 = Spec::num(0.1, 0.002, 1.0, "", "roughness along the tangent"),
        alpha_y: f32 = Spec::num(0.1, 0.002, 1.0, "", "roughness across the tangent"),
        // BK7 glass in air.
        int_ior: f32 = Spec::num(1.5046, 1.0, 3.0, "", "index of refraction inside"),
        ext_ior: f32 = Spec::num(1.000277, 1.0, 3.0, "", "index of refraction outside"),
        specular_reflectance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the reflection; 1 is physical"),
        specular_transmittance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the transmission; 1 is physical"),
    }
}

impl RoughDielectric {
    fn facets(&self) -> Microfacets {
        Microfacets::new(self.distribution.into(), self.masking.into(), self.alpha_x, self.alpha_y)
    }

    /// The index beyond the surface over that on the side of `wo`.
    fn eta(&self, wo: Vec3) -> f32 {
        apart_from_one(if wo.z > 0.0 { self.int_ior / self.ext_ior } else { self.ext_ior / self.int_ior })
    }
}

impl Model for RoughDielectric {
    const NAME: &'static str = "rough_dielectric";
    const SOURCE: &'static str =
        "Walter et al. 2007, Microfacet Models for Refraction through Rough Surfaces";
    const DOC: &'static str = "Frosted or etched glass. The defaults (Beckmann, separable masking) are those of \
        Mitsuba 3. Closed shapes only. Radiance changes by the square of the index of refraction as it crosses.";
    const LAWS: Laws = Laws {
        reciprocal: false,
        transmits: true,
        why: "radiance, unlike power, scales with the square of the index of refraction it travels in",
        ..Laws::PHYSICAL
    };
    const WGSL: &'static str = include_str!("rough_dielectric.wgsl");
    // Worst 5.2e-5, in the direction through a facet close to total reflection.
    const TWIN: (f32, f32) = (2e-4, 1e-6);

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(table, wo, wi).0
    }

    fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(table, wo, wi).1
    }

    fn eval_pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let eta = self.eta(wo);
        let facets = self.facets();
        let (o, i) = (to_upper(wo, wo.z), to_upper(wi, wo.z));
        if i.z > 0.0 {
            let (f, pdf, cos) = facets.reflect(o, i);
            let fresnel = f_dielectric(cos, eta);
            return (f * fresnel * self.specular_reflectance, pdf * fresnel);
        }
        let (f, pdf, cos) = facets.refract(o, i, eta);
        let through = 1.0 - f_dielectric(cos, eta);
        (f * through * self.specular_transmittance, pdf * through)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z == 0.0 {
            return None;
        }
        let eta = self.eta(wo);
        let o = to_upper(wo, wo.z);
        let h = self.facets().sample_visible_normal(o, u.truncate());
        let oh = o.dot(h);
        let reflects = u.z < f_dielectric(oh, eta);
        let i = if reflects { 2.0 * oh * h - o } else { refract(o, h, eta)? };
        if (i.z > 0.0) != reflects {
            return None;
        }
        Sample::across(self, table, wo, to_upper(i, wo.z), if reflects { 1.0 } else { eta })
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.specular_transmittance
    }
}
