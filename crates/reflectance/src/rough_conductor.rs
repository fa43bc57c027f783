//! Torrance and Sparrow 1967, in the form of Walter et al. 2007, "Microfacet Models for Refraction through
//! Rough Surfaces": a rough metal with its exact Fresnel reflectance.

use crate::gaussian_light::SlopeLobe;
use crate::halfway::half_vector;
use crate::metals::Metal;
use crate::microfacet::{DISTRIBUTIONS, MASKINGS, Microfacets, f_conductor};
use crate::model::{Choice, Laws, Model, Preset, Sample, Spec, Terms, params};
use glam::Vec3;
use yugen_optics::ColourSpace;

params! {
    /// Facets of metal, each a mirror.
    pub struct RoughConductor {
        distribution: Choice = Spec::choice(0, DISTRIBUTIONS, "distribution of the facets' normals"),
        masking: Choice = Spec::choice(0, MASKINGS, "Smith's shadowing-masking"),
        alpha_x: f32 = Spec::num(0.1, 0.001, 1.0, "", "roughness along the tangent"),
        alpha_y: f32 = Spec::num(0.1, 0.001, 1.0, "", "roughness across the tangent"),
        // Gold, Olmon et al. 2012, at 610, 550 and 450 nm.
        eta: Vec3 = Spec::colour([0.1908, 0.3256, 1.472], 0.0, 10.0, "", "real part of the index of refraction"),
        k: Vec3 = Spec::colour([3.232, 2.507, 1.855], 0.0, 15.0, "", "imaginary part: extinction"),
        specular_reflectance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the reflection; 1 is physical"),
    }
}

impl RoughConductor {
    fn facets(&self) -> Microfacets {
        Microfacets::new(self.distribution.into(), self.masking.into(), self.alpha_x, self.alpha_y)
    }
}

impl Model for RoughConductor {
    const NAME: &'static str = "rough_conductor";
    const SOURCE: &'static str =
        "Walter et al. 2007, Microfacet Models for Refraction through Rough Surfaces";
    const DOC: &'static str = "Rough or brushed metal by its complex index of refraction. The defaults (Beckmann, \
        separable masking) are those of Mitsuba 3. Light that meets several facets is lost: rough metal is \
        too dark beyond a roughness of about 0.4; ggx can give it back.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("rough_conductor.wgsl");
    const PRESETS: &'static [Preset] = Metal::PRESETS;

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let (eta, k) = Metal::from_name(name)?.rgb_index(space);
        Some((Self { eta, k, ..Self::default() }, Vec::new()))
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(table, wo, wi).0
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        self.facets().reflect(wo, wi).1
    }

    fn eval_pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let (f, pdf, cos) = self.facets().reflect(wo, wi);
        if f <= 0.0 {
            return (Vec3::ZERO, pdf);
        }
        (f * f_conductor(cos, self.eta, self.k) * self.specular_reflectance, pdf)
    }

    fn sample(&self, _: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let facets = self.facets();
        let wi = facets.sample_reflection(wo, u.truncate());
        let (f, pdf, cos) = facets.reflect(wo, wi);
        if pdf <= 0.0 {
            return None;
        }
        let weight = f * wi.z / pdf * f_conductor(cos, self.eta, self.k) * self.specular_reflectance;
        Some(Sample { wi, weight, pdf, delta: false, eta: 1.0 })
    }

    fn terms(&self, wo: Vec3, wi: Vec3) -> Option<Terms> {
        let (facets, (h, cos)) = (self.facets(), half_vector(wo, wi));
        let f = f_conductor(cos, self.eta, self.k) * self.specular_reflectance;
        Some(Terms { d: facets.d(h), g: facets.g2(wo, wi), f })
    }

    fn slope_lobe(&self, _: &[f32], _: Vec3, _: Vec3) -> Option<SlopeLobe> {
        Some(self.facets().slope_lobe())
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        f_conductor(1.0, self.eta, self.k) * self.specular_reflectance
    }
}
