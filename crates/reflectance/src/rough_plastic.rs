//! Jakob 2010, "Mitsuba renderer" (roughplastic): a diffuse base under a rough dielectric coat.

use crate::gaussian_light::SlopeLobe;
use crate::microfacet::{DISTRIBUTIONS, Masking, Microfacets, f_dielectric, refract};
use crate::model::{Choice, Laws, Model, ModelError, Sample, Spec, params};
use crate::plastic::{coat_probability, coated_diffuse};
use glam::{Vec2, Vec3};
use yugen_optics::quadrature::gauss_legendre;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Facets of glass over a diffuse base.
    pub struct RoughPlastic {
        distribution: Choice = Spec::choice(0, DISTRIBUTIONS, "distribution of the facets' normals"),
        alpha: f32 = Spec::num(0.1, 0.001, 1.0, "", "roughness"),
        diffuse_reflectance: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "albedo of the base, without the coat"),
        specular_reflectance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the reflection; 1 is physical"),
        // Polypropylene in air.
        int_ior: f32 = Spec::num(1.49, 1.0, 3.0, "", "index of refraction of the coat"),
        ext_ior: f32 = Spec::num(1.000277, 1.0, 3.0, "", "index of refraction outside"),
        nonlinear: Choice = Spec::choice(0, &["off", "on"], "colours saturate by scattering inside"),
    }
}

/// Cosines at which the coat's transmittance is tabulated, evenly from 0 to 1; Mitsuba's choice.
const COSINES: usize = 64;

impl RoughPlastic {
    fn facets(&self) -> Microfacets {
        Microfacets::new(self.distribution.into(), Masking::Separable, self.alpha, self.alpha)
    }

    fn eta(&self) -> f32 {
        self.int_ior / self.ext_ior
    }

    /// The base under the coat, in light that has come through.
    fn base(&self, table: &[f32]) -> Vec3 {
        coated_diffuse(self.diffuse_reflectance, table[COSINES], self.nonlinear.index() == 1, self.eta())
    }
}

/// The coat's transmittance at a cosine, linearly between its entries.
fn transmittance(table: &[f32], cos: f32) -> f32 {
    let x = cos * (COSINES - 1) as f32;
    let i = (x as usize).min(COSINES - 2);
    table[i] + (table[i + 1] - table[i]) * (x - i as f32)
}

/// ∫ over visible normals seen from `cos`, by a product of `n` Gauss-Legendre nodes.
fn over_visible_normals(facets: &Microfacets, cos: f32, n: usize, g: impl Fn(Vec3, Vec3) -> f32) -> f32 {
    let wo = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let nodes = gauss_legendre(n, 0.0, 1.0);
    let mut sum = 0.0;
    for &(x, wx) in &nodes {
        for &(y, wy) in &nodes {
            sum += wx * wy * g(wo, facets.sample_visible_normal(wo, Vec2::new(x as f32, y as f32))) as f64;
        }
    }
    sum as f32
}

impl Model for RoughPlastic {
    const NAME: &'static str = "rough_plastic";
    const SOURCE: &'static str = "Jakob 2010, Mitsuba renderer";
    const DOC: &'static str = "Plastic, glazed ceramic or lacquer with a soft highlight. Matches Mitsuba 3, so \
        light that meets several facets of the coat is lost. Roughness and indices of refraction belong to the \
        whole material: its table is made from them.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("rough_plastic.wgsl");

    /// The transmittance from outside at [`COSINES`] cosines, then the diffuse reflectance from inside.
    fn bake(&self, _: &[f32]) -> Result<Vec<f32>, ModelError> {
        let (facets, eta) = (self.facets(), self.eta());
        let cosine = |k: usize| (k as f32 / (COSINES - 1) as f32).max(1e-6);
        let mut table: Vec<f32> = (0..COSINES)
            .map(|k| {
                over_visible_normals(&facets, cosine(k), 32, |wo, h| {
                    let through = refract(wo, h, eta).filter(|wi| wi.z < 0.0);
                    through.map_or(0.0, |wi| facets.g1(wi) * (1.0 - f_dielectric(wo.dot(h), eta)))
                })
            })
            .collect();
        // The mean over the tabulated cosines, as Mitsuba has it, for the same brightness as there.
        let inside = (0..COSINES).map(|k| {
            let cos = cosine(k);
            let r = over_visible_normals(&facets, cos, 64, |wo, h| {
                let wi = 2.0 * wo.dot(h) * h - wo;
                if wi.z > 0.0 { facets.g1(wi) * f_dielectric(wo.dot(h), 1.0 / eta) } else { 0.0 }
            });
            2.0 * cos * r / COSINES as f32
        });
        let inside = inside.sum();
        table.push(inside);
        Ok(table)
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
        let (to, ti) = (transmittance(table, wo.z), transmittance(table, wi.z));
        let (f, facet_pdf, cos) = self.facets().reflect(wo, wi);
        let coat = coat_probability(1.0 - to, self.specular_reflectance, self.diffuse_reflectance);
        (
            self.specular_reflectance * (f * f_dielectric(cos, eta)) + self.base(table) * (to * ti),
            coat * facet_pdf + (1.0 - coat) * cosine_hemisphere_pdf(wi),
        )
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let to = transmittance(table, wo.z);
        let wi = if u.z < coat_probability(1.0 - to, self.specular_reflectance, self.diffuse_reflectance) {
            self.facets().sample_reflection(wo, u.truncate())
        } else {
            cosine_hemisphere(u.truncate())
        };
        Sample::of(self, table, wo, wi)
    }

    fn slope_lobe(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Option<SlopeLobe> {
        let rest = self.base(table) * (transmittance(table, wo.z) * transmittance(table, wi.z.max(0.0)));
        Some(SlopeLobe { rest, ..self.facets().slope_lobe() })
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.diffuse_reflectance
    }
}
