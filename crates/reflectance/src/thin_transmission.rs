//! Khronos Group 2022, "KHR_materials_transmission" and "KHR_materials_diffuse_transmission", without a volume.

use crate::microfacet::{Distribution, MASKINGS, Microfacets, alpha_of_roughness, schlick_weight};
use crate::model::{Choice, Laws, Model, Sample, Spec, params};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use yugen_optics::frame::to_upper;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// A sheet without thickness: it reflects on either side, and lets through what it does not reflect.
    pub struct ThinTransmission {
        transmittance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "part of what is not reflected that passes"),
        diffuse: f32 = Spec::num(0.0, 0.0, 1.0, "", "how much of it leaves in all directions: 0 glass, 1 paper"),
        roughness: f32 = Spec::num(0.3, 0.0, 1.0, "", "perceptual: the square root of alpha"),
        masking: Choice = Spec::choice(0, MASKINGS, "Smith's shadowing-masking; the extensions have separable"),
        specular: f32 = Spec::num(1.0, 0.0, 1.0, "", "strength of the reflection"),
        specular_color: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "tint of the reflection head on"),
        ior: f32 = Spec::num(1.5, 1.0, 3.0, "", "index of refraction; files may go beyond, and 0 reflects specular_color at all angles"),
    }
}

impl ThinTransmission {
    fn facets(&self) -> Microfacets {
        let alpha = alpha_of_roughness(self.roughness);
        Microfacets::new(Distribution::Ggx, self.masking.into(), alpha, alpha)
    }

    /// Schlick's reflectance.
    fn fresnel(&self, cos: f32) -> Vec3 {
        let r = (self.ior - 1.0) / (self.ior + 1.0);
        let f0 = (r * r * self.specular_color).min(Vec3::ONE) * self.specular;
        f0 + (self.specular - f0) * schlick_weight(cos)
    }

    /// Probability of drawing the reflection, seen under this cosine.
    fn reflects(&self, cos: f32) -> f32 {
        let fresnel = self.fresnel(cos).max_element();
        let passes = (1.0 - fresnel) * self.transmittance.max_element();
        if fresnel + passes > 0.0 { fresnel / (fresnel + passes) } else { 1.0 }
    }
}

impl Model for ThinTransmission {
    const NAME: &'static str = "thin_transmission";
    const SOURCE: &'static str =
        "Khronos Group 2022, KHR_materials_transmission and KHR_materials_diffuse_transmission";
    const DOC: &'static str = "A sheet of glass, foil, paper or a leaf as a single surface: microfacets reflect on \
        either side, and what they do not reflect passes, blurred by the same roughness or in all directions. Nothing \
        is refracted, so that it need not be closed. What passes in all directions is what the more grazing of both \
        directions leaves, so that not more leaves than arrives.";
    const LAWS: Laws = Laws { transmits: true, ..Laws::PHYSICAL };
    const WGSL: &'static str = include_str!("thin_transmission.wgsl");
    // Worst 2.9e-7.
    const TWIN: (f32, f32) = (1e-5, 1e-6);

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
        let (o, i) = (to_upper(wo, wo.z), to_upper(wi, wo.z));
        let reflects = self.reflects(o.z);
        if i.z > 0.0 {
            let (s, pdf, cos) = self.facets().reflect(o, i);
            return (self.fresnel(cos) * s, reflects * pdf);
        }
        // What passes leaves as if it were reflected to the other side.
        let i = Vec3::new(i.x, i.y, -i.z);
        let (s, pdf, cos) = self.facets().reflect(o, i);
        let passes = |cos: f32| 1.0 - self.fresnel(cos).max_element();
        // In all directions passes what the more grazing one leaves: the reflectance of the facet between both, as the
        // extension has it, would let more leave than arrives.
        let diffuse = self.diffuse * FRAC_1_PI * passes(o.z.min(i.z));
        let f = self.transmittance * ((1.0 - self.diffuse) * passes(cos) * s + diffuse);
        let pdf = (1.0 - self.diffuse) * pdf + self.diffuse * cosine_hemisphere_pdf(i);
        (f, (1.0 - reflects) * pdf)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z == 0.0 {
            return None;
        }
        let o = to_upper(wo, wo.z);
        let reflects = self.reflects(o.z);
        let passes = u.z >= reflects;
        let diffuse = passes && u.z - reflects < (1.0 - reflects) * self.diffuse;
        let i = if diffuse {
            cosine_hemisphere(u.truncate())
        } else {
            self.facets().sample_reflection(o, u.truncate())
        };
        if i.z <= 0.0 {
            return None;
        }
        let i = if passes { Vec3::new(i.x, i.y, -i.z) } else { i };
        let wi = to_upper(i, wo.z);
        Sample::across(self, table, wo, wi, 1.0)
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.transmittance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::furnace::mean_weight;
    use yugen_optics::frame::spherical;

    #[test]
    fn clear_glass_takes_nothing_and_paper_little() {
        // What facets hide from one another is lost, as everywhere in this family.
        for (diffuse, roughness, least) in [(0.0, 0.3, 0.96), (1.0, 0.5, 0.93), (0.5, 0.5, 0.88)] {
            let sheet = ThinTransmission { diffuse, roughness, ..Default::default() };
            for theta in [0.1, 0.7, 1.1] {
                let e = mean_weight(&sheet, &[], spherical(theta, 0.3), 64);
                assert!((least..1.002).contains(&e), "{diffuse} {theta}: {e}");
            }
            assert!(mean_weight(&sheet, &[], spherical(1.5, 0.3), 64) < 1.002, "grazing, {diffuse}");
        }
    }

    #[test]
    fn an_index_of_zero_reflects_the_specular_colour() {
        let specular_color = Vec3::new(0.8, 0.4, 0.2);
        let sheet = ThinTransmission { ior: 0.0, specular_color, ..Default::default() };
        assert_eq!(sheet.fresnel(1.0), specular_color);
    }
}
