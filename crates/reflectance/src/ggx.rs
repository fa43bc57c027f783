//! Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Heitz 2014, "Understanding the
//! Masking-Shadowing Function in Microfacet-Based BRDFs": the rough mirror most programs agree on.

use crate::energy;
use crate::gaussian_light::SlopeLobe;
use crate::halfway::half_vector;
use crate::microfacet::{DISTRIBUTIONS, MASKINGS, Microfacets, f_schlick};
use crate::model::{Choice, Laws, Model, ModelError, Sample, Spec, Terms, params};
use glam::Vec3;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Facets with Schlick's Fresnel reflectance, brushed or not, with or without the light between facets.
    pub struct Ggx {
        distribution: Choice = Spec::choice(1, DISTRIBUTIONS, "distribution of the facets' normals"),
        masking: Choice = Spec::choice(1, MASKINGS, "Smith's shadowing-masking"),
        alpha_x: f32 = Spec::num(0.3, 0.001, 1.0, "", "roughness along the tangent"),
        alpha_y: f32 = Spec::num(0.3, 0.001, 1.0, "", "roughness across the tangent"),
        f0: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "reflectance of a facet head on; white at grazing light"),
        multiple_scattering: Choice = Spec::choice(0, &["off", "on"], "give back the light that meets several facets"),
    }
}

impl Ggx {
    fn facets(&self) -> Microfacets {
        Microfacets::new(self.distribution.into(), self.masking.into(), self.alpha_x, self.alpha_y)
    }

    fn compensates(&self) -> bool {
        self.multiple_scattering.index() == 1
    }

    /// Colour of the lobe of several facets.
    fn multiple_colour(&self, table: &[f32]) -> Vec3 {
        // Schlick's mean over the cosine-weighted hemisphere.
        energy::f_multiple_colour(table, self.f0 + (Vec3::ONE - self.f0) / 21.0)
    }

    /// The probability of the lobe of several facets.
    fn p_multiple(&self, wo: Vec3, lost: f32, colour: Vec3) -> f32 {
        let single = f_schlick(self.f0, Vec3::ONE, wo.z).element_sum() * (1.0 - lost);
        let multiple = colour.element_sum() * lost;
        multiple / (single + multiple)
    }
}

impl Model for Ggx {
    const NAME: &'static str = "ggx";
    const SOURCE: &'static str =
        "Walter et al. 2007, Microfacet Models for Refraction through Rough Surfaces";
    const DOC: &'static str = "The standard rough mirror: GGX or Beckmann facets, isotropic or brushed, with \
        Schlick's Fresnel. Anything glossy whose colour head on is known. Rough surfaces lose up to two thirds of \
        the light unless multiple_scattering is on (Kulla and Conty 2017), which makes the white furnace white; then the \
        roughness belongs to the whole material: its table is made from it.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("ggx.wgsl");

    /// What the mirror of facets loses, where that is given back.
    fn bake(&self, _: &[f32]) -> Result<Vec<f32>, ModelError> {
        Ok(if self.compensates() { energy::bake(&self.facets()) } else { Vec::new() })
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
        let (f, pdf, cos) = self.facets().reflect(wo, wi);
        let single = f * f_schlick(self.f0, Vec3::ONE, cos);
        if !self.compensates() {
            return (single, pdf);
        }
        let (lost_o, lost_i) = (energy::lost(table, wo), energy::lost(table, wi));
        let colour = self.multiple_colour(table);
        let p = self.p_multiple(wo, lost_o, colour);
        (
            single + energy::f_multiple(table, lost_o, lost_i) * colour,
            (1.0 - p) * pdf + p * cosine_hemisphere_pdf(wi),
        )
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let p = if self.compensates() {
            self.p_multiple(wo, energy::lost(table, wo), self.multiple_colour(table))
        } else {
            0.0
        };
        let wi = if u.z < p {
            cosine_hemisphere(u.truncate())
        } else {
            self.facets().sample_reflection(wo, u.truncate())
        };
        Sample::of(self, table, wo, wi)
    }

    /// Those of the light that meets one facet.
    fn terms(&self, wo: Vec3, wi: Vec3) -> Option<Terms> {
        let (facets, (h, cos)) = (self.facets(), half_vector(wo, wi));
        Some(Terms { d: facets.d(h), g: facets.g2(wo, wi), f: f_schlick(self.f0, Vec3::ONE, cos) })
    }

    fn slope_lobe(&self, _: &[f32], _: Vec3, _: Vec3) -> Option<SlopeLobe> {
        // What comes back from between facets is broad, but it is a small part of what is sharp.
        Some(self.facets().slope_lobe())
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.f0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;
    use yugen_optics::frame::spherical;

    /// ∫ f cos through the sampler, by midpoints; `u.z` is stratified with them.
    fn albedo(m: &Ggx, table: &[f32], wo: Vec3) -> f32 {
        const N: usize = 192;
        let mut sum = 0.0;
        for i in 0..N * N {
            // Most points in the tails of both variables, where light is lost.
            let t = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32;
            let u = t * t * (3.0 - 2.0 * t);
            let density = 36.0 * (t * (1.0 - t)).element_product();
            // Golden-ratio steps for the choice of the lobe.
            let z = (i as f64 * 0.618_033_988_749_895).fract() as f32;
            sum += m.sample(table, wo, u.extend(z)).map_or(0.0, |s| (s.weight.x * density) as f64);
        }
        (sum / (N * N) as f64) as f32
    }

    #[test]
    fn the_furnace_is_white_with_multiple_scattering() {
        let mut worst = 0f32;
        for (d, g, alpha_x, alpha_y) in [
            (0.0, 0.0, 0.3, 0.3),
            (0.0, 1.0, 0.1, 0.5),
            (0.0, 1.0, 1.0, 1.0),
            (1.0, 0.0, 0.6, 0.6),
            (1.0, 1.0, 0.05, 0.05),
            (1.0, 1.0, 0.9, 0.35),
            (1.0, 1.0, 1.0, 1.0),
        ] {
            let m = Ggx {
                distribution: Choice(d),
                masking: Choice(g),
                alpha_x,
                alpha_y,
                multiple_scattering: Choice(1.0),
                ..Ggx::default()
            };
            let table = m.bake(&[]).unwrap();
            for (theta, phi) in
                [(0f32, 0f32), (25.0, 40.0), (50.0, 75.0), (65.0, 10.0), (80.0, 30.0), (87.0, 60.0)]
            {
                let got = albedo(&m, &table, spherical(theta.to_radians(), phi.to_radians()));
                worst = worst.max((got - 1.0).abs());
            }
        }
        // Measured 8.5e-4, on a brushed surface: the thousandth kept back and the table's interpolation.
        assert!(worst < 3.4e-3, "worst {worst}");
    }
}
