//! Jakob 2010, "Mitsuba renderer" (plastic): a diffuse base under a smooth dielectric coat, with the light that
//! the coat sends back to the base summed to the end.

use crate::microfacet::{f_dielectric, f_dielectric_diffuse};
use crate::model::{Choice, Laws, Model, ModelError, Sample, Spec, params};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use yugen_optics::frame::mirror;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// A mirror of glass over a diffuse base.
    pub struct Plastic {
        diffuse_reflectance: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "albedo of the base, without the coat"),
        specular_reflectance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the reflection; 1 is physical"),
        // Polypropylene in air.
        int_ior: f32 = Spec::num(1.49, 1.0, 3.0, "", "index of refraction of the coat"),
        ext_ior: f32 = Spec::num(1.000277, 1.0, 3.0, "", "index of refraction outside"),
        nonlinear: Choice = Spec::choice(0, &["off", "on"], "colours saturate by scattering inside"),
    }
}

/// The diffuse part with its coat, but for the transmittances of both directions: Duntley 1942, with the
/// colour of every scattering (`nonlinear`) or of the first alone. `lost` is the diffuse reflectance of the coat
/// from inside.
pub(crate) fn coated_diffuse(diffuse: Vec3, lost: f32, nonlinear: bool, eta: f32) -> Vec3 {
    let inter = if nonlinear { Vec3::ONE - diffuse * lost } else { Vec3::splat(1.0 - lost) };
    // 1/η²: radiance spreads over a larger solid angle as it leaves the coat.
    diffuse / inter * (FRAC_1_PI / (eta * eta))
}

/// How often the coat is chosen where it reflects `f` of the light.
pub(crate) fn coat_probability(f: f32, specular: Vec3, diffuse: Vec3) -> f32 {
    let (s, d) = (specular.element_sum() * f, diffuse.element_sum() * (1.0 - f));
    if s + d > 0.0 { s / (s + d) } else { 1.0 }
}

impl Plastic {
    fn eta(&self) -> f32 {
        self.int_ior / self.ext_ior
    }
}

impl Model for Plastic {
    const NAME: &'static str = "plastic";
    const SOURCE: &'static str = "Jakob 2010, Mitsuba renderer";
    const DOC: &'static str = "Smooth plastic, glazed ceramic, lacquer: a mirror reflection over a diffuse base, \
        with the light caught between them. Matches Mitsuba 3. For a soft highlight see rough_plastic.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("plastic.wgsl");

    /// One number: the coat's diffuse reflectance from inside.
    fn bake(&self, _: &[f32]) -> Result<Vec<f32>, ModelError> {
        Ok(vec![f_dielectric_diffuse(1.0 / self.eta())])
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(table, wo, wi).0
    }

    fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(table, wo, wi).1
    }

    fn eval_pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let eta = self.eta();
        let (fo, fi) = (f_dielectric(wo.z, eta), f_dielectric(wi.z, eta));
        let base = coated_diffuse(self.diffuse_reflectance, table[0], self.nonlinear.index() == 1, eta);
        let coat = coat_probability(fo, self.specular_reflectance, self.diffuse_reflectance);
        (base * ((1.0 - fo) * (1.0 - fi)), (1.0 - coat) * cosine_hemisphere_pdf(wi))
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let fo = f_dielectric(wo.z, self.eta());
        let coat = coat_probability(fo, self.specular_reflectance, self.diffuse_reflectance);
        if u.z < coat {
            let weight = self.specular_reflectance * (fo / coat);
            return Some(Sample { wi: mirror(wo), weight, pdf: coat, delta: true, eta: 1.0 });
        }
        let wi = cosine_hemisphere(u.truncate());
        Sample::of(self, table, wo, wi)
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.diffuse_reflectance
    }
}
