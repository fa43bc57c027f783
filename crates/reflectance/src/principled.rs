//! Burley 2012, "Physically-Based Shading at Disney", and 2015, "Extending the Disney BRDF to a BSDF with Integrated
//! Subsurface Scattering", in the form of Mitsuba 3 (principled).

use crate::microfacet::{
    Distribution, Masking, Microfacets, apart_from_one, f_dielectric, refract, schlick_weight,
};
use crate::model::{Laws, Model, Sample, Spec, params};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use yugen_optics::frame::to_upper;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Everything at once, by sliders for artists.
    pub struct Principled {
        base_color: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "colour of the material"),
        roughness: f32 = Spec::num(0.5, 0.0, 1.0, "", "perceptual: the square root of alpha"),
        anisotropic: f32 = Spec::num(0.0, 0.0, 1.0, "", "stretches highlights along the tangent"),
        metallic: f32 = Spec::num(0.0, 0.0, 1.0, "", "0 dielectric, 1 metal"),
        spec_trans: f32 = Spec::num(0.0, 0.0, 1.0, "", "share of a dielectric that is clear: 1 is rough glass"),
        eta: f32 = Spec::num(1.5, 1.0, 3.0, "", "index of refraction inside over outside"),
        spec_tint: f32 = Spec::num(0.0, 0.0, 1.0, "", "tints the dielectric's reflection with the base's hue"),
        sheen: f32 = Spec::num(0.0, 0.0, 1.0, "", "a grazing lobe for cloth"),
        sheen_tint: f32 = Spec::num(0.0, 0.0, 1.0, "", "tints it with the base's hue"),
        flatness: f32 = Spec::num(0.0, 0.0, 1.0, "", "from diffuse to flat, as by scattering inside"),
        clearcoat: f32 = Spec::num(0.0, 0.0, 1.0, "", "strength of a second, colourless highlight"),
        clearcoat_gloss: f32 = Spec::num(0.0, 0.0, 1.0, "", "its sharpness"),
    }
}

/// The index of refraction that Disney's `specular` slider stands for: F0 = 0.08 · specular.
pub fn eta_of_specular(specular: f32) -> f32 {
    2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
}

/// Burley 2012: Berry's distribution with exponent 1, whose tails are longer than GGX's.
fn d_gtr1(h: Vec3, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    // sin² + α² cos²: 1 + (α² − 1) cos² has no digits left at the peak of a sharp coat.
    let t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
    (a2 - 1.0) / (PI * a2.ln() * t)
}

/// Normals with density [`d_gtr1`] cos θ.
fn sample_gtr1(alpha: f32, u: Vec2) -> Vec3 {
    let a2 = alpha * alpha;
    let r2 = ((a2.powf(1.0 - u.y) - a2) / (1.0 - a2)).clamp(0.0, 1.0);
    let r = r2.sqrt();
    let (sin, cos) = (TAU * u.x).sin_cos();
    Vec3::new(r * cos, r * sin, (1.0 - r2).sqrt())
}

/// Smith's G1 of GGX with the roughness Burley takes for the coat.
fn g1_coat(cos: f32) -> f32 {
    const ALPHA2: f32 = 0.25 * 0.25;
    2.0 / (1.0 + (1.0 + ALPHA2 * (1.0 - cos * cos) / (cos * cos)).sqrt())
}

/// Facets by perceptual roughness, stretched along the tangent.
pub(crate) fn stretched_facets(roughness: f32, anisotropic: f32) -> Microfacets {
    let alpha = roughness * roughness;
    let aspect = (1.0 - 0.9 * anisotropic).sqrt();
    let (ax, ay) = ((alpha / aspect).max(1e-3), (alpha * aspect).max(1e-3));
    Microfacets::new(Distribution::Ggx, Masking::Separable, ax, ay)
}

/// The colour without its brightness, linear sRGB.
fn hue(c: Vec3) -> Vec3 {
    let luminance = c.dot(Vec3::new(0.212671, 0.715160, 0.072169));
    if luminance > 0.0 { c / luminance } else { Vec3::ONE }
}

/// The probabilities of the lobes, before Fresnel decides between reflection and transmission.
struct Lobes {
    specular: f32,
    coat: f32,
    diffuse: f32,
}

impl Principled {
    fn facets(&self) -> Microfacets {
        stretched_facets(self.roughness, self.anisotropic)
    }

    /// The index inside over outside.
    fn eta(&self) -> f32 {
        apart_from_one(self.eta)
    }

    fn coat_alpha(&self) -> f32 {
        0.1 + (0.001 - 0.1) * self.clearcoat_gloss
    }

    /// Share that is clear.
    fn clear(&self) -> f32 {
        (1.0 - self.metallic) * self.spec_trans
    }

    fn lobes(&self, above: bool) -> Lobes {
        if !above {
            return Lobes { specular: 1.0, coat: 0.0, diffuse: 0.0 };
        }
        let (specular, coat) = (1.0, 0.25 * self.clearcoat);
        let diffuse = (1.0 - self.metallic) * (1.0 - self.spec_trans);
        let total = specular + coat + diffuse;
        Lobes { specular: specular / total, coat: coat / total, diffuse: diffuse / total }
    }

    /// The probability that the specular lobe reflects where the facet reflects `f`.
    fn p_reflect(&self, above: bool, f: f32) -> f32 {
        if above { 1.0 - self.clear() * (1.0 - f) } else { f }
    }

    /// Reflectance of a facet from above.
    pub(crate) fn fresnel(&self, cos: f32, dielectric: f32) -> Vec3 {
        let m = schlick_weight(cos);
        let towards_white = |f0: Vec3| f0 + (1.0 - f0) * m;
        let r = (self.eta() - 1.0) / (self.eta() + 1.0);
        let plain = (1.0 - self.metallic) * (1.0 - self.spec_tint) * dielectric;
        self.metallic * towards_white(self.base_color)
            + (1.0 - self.metallic) * self.spec_tint * towards_white(r * r * hue(self.base_color))
            + plain
    }

    /// The diffuse lobe with its retroreflection, flattening and sheen; `cos` is that of the half vector.
    pub(crate) fn diffuse(&self, wo: Vec3, wi: Vec3, cos: f32) -> Vec3 {
        let (fo, fi) = (schlick_weight(wo.z), schlick_weight(wi.z));
        let rr = 2.0 * self.roughness * cos * cos;
        let retro = rr * (fo + fi + fo * fi * (rr - 1.0));
        let plain = (1.0 - 0.5 * fo) * (1.0 - 0.5 * fi) + retro;
        // Hanrahan and Krueger 1993, as Burley approximates it.
        let half = |f: f32| 1.0 + (0.5 * rr - 1.0) * f;
        let flat = 1.25 * (half(fo) * half(fi) * (1.0 / (wo.z + wi.z) - 0.5) + 0.5);
        let amount = (1.0 - self.metallic) * (1.0 - self.spec_trans) * FRAC_1_PI;
        let base = self.base_color * (amount * (plain + (flat - plain) * self.flatness));
        if self.sheen == 0.0 {
            return base;
        }
        let tint = Vec3::ONE.lerp(hue(self.base_color), self.sheen_tint);
        base + tint * (self.sheen * (1.0 - self.metallic) * schlick_weight(cos))
    }
}

impl Model for Principled {
    const NAME: &'static str = "principled";
    const SOURCE: &'static str =
        "Burley 2012, Physically-Based Shading at Disney; 2015, Extending the Disney BRDF";
    const DOC: &'static str = "Disney's material: one set of sliders for plastic, metal, cloth, lacquer and glass. \
        Matches Mitsuba 3. Sheen and clear coat are added without taking from what lies below, so that bright \
        materials can gain energy.";
    const LAWS: Laws = Laws {
        conserves_energy: false,
        why: "the specular, clear coat and sheen lobes are added to the diffuse without taking from it",
        ..Laws::PHYSICAL
    };
    const WGSL: &'static str = include_str!("principled.wgsl");
    // Worst 1.8e-7.
    const TWIN: (f32, f32) = (1e-5, 1e-6);

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(table, wo, wi).0
    }

    fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(table, wo, wi).1
    }

    fn laws(&self) -> Laws {
        if self.spec_trans > 0.0 {
            return Laws {
                reciprocal: false,
                transmits: true,
                why: "lobes are added without taking from each other, and radiance, unlike power, scales with the \
                    square of the index of refraction",
                ..Self::LAWS
            };
        }
        Self::LAWS
    }

    fn eval_pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let above = wo.z > 0.0;
        let clear = self.clear();
        if clear == 0.0 && !(above && wi.z > 0.0) {
            return (Vec3::ZERO, 0.0);
        }
        let eta = if above { self.eta() } else { 1.0 / self.eta() };
        let lobes = self.lobes(above);
        let facets = self.facets();
        let (o, i) = (to_upper(wo, wo.z), to_upper(wi, wo.z));
        if i.z > 0.0 {
            let (s, pdf, cos) = facets.reflect(o, i);
            let dielectric = f_dielectric(cos, eta);
            let pdf = lobes.specular * self.p_reflect(above, dielectric) * pdf;
            if !above {
                return (Vec3::splat(s * clear * dielectric), pdf);
            }
            let f = s * self.fresnel(cos, dielectric) + self.diffuse(wo, wi, cos);
            let pdf = pdf + lobes.diffuse * cosine_hemisphere_pdf(wi);
            if self.clearcoat == 0.0 {
                return (f, pdf);
            }
            let h = (wo + wi).normalize_or_zero();
            let d = d_gtr1(h, self.coat_alpha());
            let coat = 0.25
                * self.clearcoat
                * (0.04 + 0.96 * schlick_weight(cos))
                * d
                * g1_coat(wo.z)
                * g1_coat(wi.z);
            return (f + coat, pdf + lobes.coat * d * h.z / (4.0 * cos).max(1e-9));
        }
        let (s, pdf, cos) = facets.refract(o, i, eta);
        let dielectric = f_dielectric(cos, eta);
        // Once in and once out of a closed shape gives the base colour.
        let f = self.base_color.map(f32::sqrt) * (clear * (1.0 - dielectric) * s);
        (f, lobes.specular * (1.0 - self.p_reflect(above, dielectric)) * pdf)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        let above = wo.z > 0.0;
        if wo.z == 0.0 || !above && self.clear() == 0.0 {
            return None;
        }
        let lobes = self.lobes(above);
        let eta = if above { self.eta() } else { 1.0 / self.eta() };
        let o = to_upper(wo, wo.z);
        let mut crossed = 1.0;
        let i = if u.z < lobes.specular {
            let h = self.facets().sample_visible_normal(o, u.truncate());
            let oh = o.dot(h);
            if u.z < lobes.specular * self.p_reflect(above, f_dielectric(oh, eta)) {
                2.0 * oh * h - o
            } else {
                crossed = eta;
                refract(o, h, eta)?
            }
        } else if u.z < lobes.specular + lobes.coat {
            let h = sample_gtr1(self.coat_alpha(), u.truncate());
            2.0 * o.dot(h) * h - o
        } else {
            cosine_hemisphere(u.truncate())
        };
        if (i.z > 0.0) != (crossed == 1.0) {
            return None;
        }
        Sample::across(self, table, wo, to_upper(i, wo.z), crossed)
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.base_color
    }
}
