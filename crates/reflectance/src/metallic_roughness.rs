//! Khronos Group 2021, "glTF 2.0 Specification", appendix B, with the extensions KHR_materials_anisotropy,
//! clearcoat, ior, iridescence, sheen and specular.

use crate::gaussian_light::SlopeLobe;
use crate::halfway::half_vector;
use crate::microfacet::{Distribution, MASKINGS, Masking, Microfacets, alpha_of_roughness, schlick_weight};
use crate::model::{Choice, Laws, Model, ModelError, Sample, Spec, params};
use glam::{Mat3, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};
use std::sync::OnceLock;
use yugen_optics::frame::{safe_sqrt, spherical};
use yugen_optics::quadrature::gauss_legendre;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Metal or plastic by one slider, under a coat, sheen or film if wanted.
    pub struct MetallicRoughness {
        base_color: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "albedo of a dielectric, reflectance of a metal"),
        metallic: f32 = Spec::num(1.0, 0.0, 1.0, "", "0 dielectric, 1 metal"),
        roughness: f32 = Spec::num(1.0, 0.0, 1.0, "", "perceptual: the square root of alpha"),
        masking: Choice = Spec::choice(0, MASKINGS, "Smith's shadowing-masking; the specification has separable"),
        anisotropy: f32 = Spec::num(0.0, 0.0, 1.0, "", "how much rougher along the grain"),
        anisotropy_rotation: f32 = Spec::num(0.0, 0.0, TAU, "rad", "from the tangent to the grain"),
        specular: f32 = Spec::num(1.0, 0.0, 1.0, "", "strength of the dielectric's reflection"),
        specular_color: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "tint of the dielectric's reflection head on"),
        ior: f32 = Spec::num(1.5, 1.0, 3.0, "", "index of refraction of the dielectric"),
        sheen_color: Vec3 = Spec::rgb(0.0, 0.0, 1.0, "", "colour of the fibres that stand up"),
        sheen_roughness: f32 = Spec::num(0.0, 0.0, 1.0, "", "how little they are in order"),
        clearcoat: f32 = Spec::num(0.0, 0.0, 1.0, "", "share covered by a clear coat of index 1.5"),
        clearcoat_roughness: f32 = Spec::num(0.0, 0.0, 1.0, "", "of the coat, perceptual"),
        iridescence: f32 = Spec::num(0.0, 0.0, 1.0, "", "share covered by a thin film"),
        iridescence_ior: f32 = Spec::num(1.3, 1.0, 3.0, "", "index of refraction of the film"),
        iridescence_thickness: f32 = Spec::num(400.0, 0.0, 1500.0, "nm", "thickness of the film"),
    }
}

/// Cosines and roughnesses of the table of the albedo of sheen; cosines evenly in their square root.
const SHEEN_COSINES: usize = 32;
const SHEEN_ROUGHNESSES: usize = 16;

/// Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF": normals that avoid the surface's own.
fn d_charlie(cos_h: f32, alpha: f32) -> f32 {
    let sin2 = (1.0 - cos_h * cos_h).max(0.0);
    (2.0 + 1.0 / alpha) * sin2.powf(0.5 / alpha) / TAU
}

/// Estevez and Kulla 2017, equation 3 and table 1: a fit of Smith's Λ for these normals.
fn lambda_charlie(cos: f32, alpha: f32) -> f32 {
    let t = (1.0 - alpha) * (1.0 - alpha);
    let at = |r0: f32, r1: f32| r1 + (r0 - r1) * t;
    let a = at(25.3245, 21.5473);
    let b = at(3.32435, 3.82987);
    let c = at(0.16801, 0.19823);
    let d = at(-1.27393, -1.97760);
    let e = at(-4.85967, -4.32054);
    let l = |x: f32| a / (1.0 + b * x.max(0.0).powf(c)) + d * x + e;
    if cos < 0.5 { l(cos).exp() } else { (2.0 * l(0.5) - l(1.0 - cos)).exp() }
}

/// White sheen.
fn f_sheen(wo: Vec3, wi: Vec3, alpha: f32) -> f32 {
    let h = (wo + wi).normalize_or_zero();
    let g = 1.0 / (1.0 + lambda_charlie(wo.z, alpha) + lambda_charlie(wi.z, alpha));
    d_charlie(h.z, alpha) * g / (4.0 * wo.z * wi.z)
}

/// Below this the fibres stand so straight that single precision fails.
fn sheen_alpha(roughness: f32) -> f32 {
    roughness.max(0.07) * roughness.max(0.07)
}

/// Albedo of white sheen over roughness and cosine.
fn sheen_table() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let theta = gauss_legendre(32, 0.0, f64::from(FRAC_PI_2));
        let phi = gauss_legendre(16, 0.0, f64::from(PI));
        let mut table = Vec::with_capacity(SHEEN_ROUGHNESSES * SHEEN_COSINES);
        for r in 0..SHEEN_ROUGHNESSES {
            let alpha = sheen_alpha(r as f32 / (SHEEN_ROUGHNESSES - 1) as f32);
            for k in 0..SHEEN_COSINES {
                let t = k as f32 / (SHEEN_COSINES - 1) as f32;
                let z = (t * t).max(1e-4);
                let wo = Vec3::new(safe_sqrt(1.0 - z * z), 0.0, z);
                let mut sum = 0.0;
                for &(theta, wt) in &theta {
                    for &(phi, wp) in &phi {
                        let wi = spherical(theta as f32, phi as f32);
                        sum += 2.0 * wt * wp * theta.sin() * theta.cos() * f64::from(f_sheen(wo, wi, alpha));
                    }
                }
                table.push(sum as f32);
            }
        }
        table
    })
}

fn sheen_albedo(table: &[f32], cos: f32, roughness: f32) -> f32 {
    let x = cos.clamp(0.0, 1.0).sqrt() * (SHEEN_COSINES - 1) as f32;
    let y = roughness.clamp(0.0, 1.0) * (SHEEN_ROUGHNESSES - 1) as f32;
    let (i, j) = ((x as usize).min(SHEEN_COSINES - 2), (y as usize).min(SHEEN_ROUGHNESSES - 2));
    let row = |j: usize| {
        let at = j * SHEEN_COSINES + i;
        table[at] + (table[at + 1] - table[at]) * (x - i as f32)
    };
    row(j) + (row(j + 1) - row(j)) * (y - j as f32)
}

/// Belcour and Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence",
/// in the form of KHR_materials_iridescence: two orders of interference in a film on a base that reflects `f0`
/// head on. Colours are linear sRGB.
fn f_iridescence(cos: f32, film: f32, thickness: f32, f0: Vec3) -> Vec3 {
    // A film thinner than 0.03 nm fades away.
    let t = (thickness / 0.03).clamp(0.0, 1.0);
    let film = 1.0 + (film - 1.0) * t * t * (3.0 - 2.0 * t);
    let cos2_film = 1.0 - (1.0 - cos * cos) / (film * film);
    if cos2_film < 0.0 {
        return Vec3::ONE;
    }
    let cos_film = cos2_film.sqrt();
    let f0_of = |n: f32| ((n - 1.0) / (n + 1.0)).powi(2);
    let schlick = |f0: f32, cos: f32| f0 + (1.0 - f0) * schlick_weight(cos);
    let r12 = schlick(f0_of(film), cos);
    let t121 = 1.0 - r12;
    let opd = 2.0 * film * thickness * cos_film;
    let base = f0.clamp(Vec3::ZERO, Vec3::splat(0.9999)).map(|f| {
        let r = f.sqrt();
        (1.0 + r) / (1.0 - r)
    });
    let r23 = base.map(|n| schlick(f0_of(n / film), cos_film));
    // Half a wave is lost on the way back to the thinner medium, and at a base denser than the film none.
    let phase = base.map(|n| PI + if n < film { PI } else { 0.0 });
    let r123 = (r12 * r23).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
    let rs = t121 * t121 * r23 / (Vec3::ONE - r123);
    let mut sum = r12 + rs;
    let mut order = rs - t121;
    for m in 1..=2 {
        order *= r123.map(f32::sqrt);
        sum += order * 2.0 * sensitivity(m as f32 * opd, m as f32 * phase);
    }
    sum.max(Vec3::ZERO)
}

/// Fourier transform of the eye's sensitivities, Gaussians in XYZ, at an optical path difference in nm.
fn sensitivity(opd: f32, shift: Vec3) -> Vec3 {
    // Belcour and Barla 2017, supplemental code: amplitude, position and variance of each Gaussian.
    let phase = TAU * opd * 1e-9;
    let gauss = |value: f32, position: f32, variance: f32, shift: f32| {
        value * (TAU * variance).sqrt() * (position * phase + shift).cos() * (-variance * phase * phase).exp()
    };
    let xyz = Vec3::new(
        gauss(5.4856e-13, 1.6810e6, 4.3278e9, shift.x) + gauss(9.7470e-14, 2.2399e6, 4.5282e9, shift.x),
        gauss(4.4201e-13, 1.7953e6, 9.3046e9, shift.y),
        gauss(5.2481e-13, 2.2084e6, 6.6121e9, shift.z),
    ) / 1.0685e-7;
    // XYZ to linear sRGB, IEC 61966-2-1.
    Mat3::from_cols(
        Vec3::new(3.2404542, -0.9692660, 0.0556434),
        Vec3::new(-1.5371385, 1.8760108, -0.2040259),
        Vec3::new(-0.4985314, 0.0415560, 1.0572252),
    ) * xyz
}

/// The probabilities of the lobes; the cosine lobe has the rest.
struct Lobes {
    coat: f32,
    specular: f32,
}

impl MetallicRoughness {
    fn facets(&self) -> Microfacets {
        let alpha = alpha_of_roughness(self.roughness);
        let along = alpha + (1.0 - alpha) * self.anisotropy * self.anisotropy;
        Microfacets::new(Distribution::Ggx, self.masking.into(), along, alpha)
    }

    fn coat_facets(&self) -> Microfacets {
        let alpha = alpha_of_roughness(self.clearcoat_roughness);
        Microfacets::new(Distribution::Ggx, Masking::Separable, alpha, alpha)
    }

    /// Share of the light the coat takes at this cosine; its index is 1.5.
    fn coat_fresnel(&self, cos: f32) -> f32 {
        self.clearcoat * (0.04 + 0.96 * schlick_weight(cos))
    }

    /// Into the frame of the grain, and back with −1.
    fn turn(&self, w: Vec3, sign: f32) -> Vec3 {
        if self.anisotropy == 0.0 || self.anisotropy_rotation == 0.0 {
            return w;
        }
        let (sin, cos) = (sign * self.anisotropy_rotation).sin_cos();
        Vec3::new(cos * w.x + sin * w.y, cos * w.y - sin * w.x, w.z)
    }

    /// Reflectances of the dielectric and of the metal at head-on incidence.
    fn f0(&self) -> (Vec3, Vec3) {
        let r = (self.ior - 1.0) / (self.ior + 1.0);
        ((r * r * self.specular_color).min(Vec3::ONE) * self.specular, self.base_color)
    }

    /// Reflectances of the dielectric and of the metal without the film.
    fn fresnel_bare(&self, cos: f32) -> (Vec3, Vec3) {
        let ((dielectric, metal), m) = (self.f0(), schlick_weight(cos));
        (dielectric + (self.specular - dielectric) * m, metal + (1.0 - metal) * m)
    }

    /// Reflectances of the dielectric and of the metal.
    fn fresnel(&self, cos: f32) -> (Vec3, Vec3) {
        let bare = self.fresnel_bare(cos);
        if self.iridescence == 0.0 || self.iridescence_thickness == 0.0 {
            return bare;
        }
        let film = |bare: Vec3, f0| {
            let f = f_iridescence(cos, self.iridescence_ior, self.iridescence_thickness, f0);
            bare.lerp(f.min(Vec3::ONE), self.iridescence)
        };
        let f0 = self.f0();
        (film(bare.0, f0.0), film(bare.1, f0.1))
    }

    /// The base of the dielectric, which has what its reflection leaves: at these directions `dielectric`.
    fn diffuse(&self, wo: Vec3, wi: Vec3, dielectric: Vec3) -> Vec3 {
        let taken = self.fresnel(wo.z.min(wi.z)).0.max(dielectric).max_element();
        self.base_color * ((1.0 - taken) * FRAC_1_PI)
    }

    /// Puts the fibres over `f`.
    fn add_sheen(&self, table: &[f32], wo: Vec3, wi: Vec3, f: &mut Vec3) {
        let sheen = self.sheen_color.max_element();
        if sheen > 0.0 {
            let albedo = |cos| sheen_albedo(table, cos, self.sheen_roughness);
            *f *= (1.0 - sheen * albedo(wo.z).max(albedo(wi.z))).max(0.0);
            *f += self.sheen_color * f_sheen(wo, wi, sheen_alpha(self.sheen_roughness));
        }
    }

    fn lobes(&self, table: &[f32], wo: Vec3) -> Lobes {
        let coat = self.coat_fresnel(wo.z);
        let (dielectric, metal) = self.fresnel_bare(wo.z);
        let specular = dielectric.lerp(metal, self.metallic).max_element();
        let diffuse =
            (1.0 - self.metallic) * (1.0 - dielectric.max_element()) * self.base_color.max_element();
        let sheen = self.sheen_color.max_element();
        let sheen = if sheen > 0.0 { sheen * sheen_albedo(table, wo.z, self.sheen_roughness) } else { 0.0 };
        let total = specular + diffuse + sheen;
        let specular = if total > 0.0 { (1.0 - coat) * specular / total } else { 1.0 - coat };
        Lobes { coat, specular }
    }
}

impl Model for MetallicRoughness {
    const NAME: &'static str = "metallic_roughness";
    const SOURCE: &'static str = "Khronos Group 2021, glTF 2.0 Specification, appendix B";
    const DOC: &'static str = "The material of glTF: diffuse or metal, with anisotropy, sheen, clear coat, tinted \
        specular and thin film as its extensions define them. The dielectric's reflection, the coat and the sheen \
        take from what is below as much as the more grazing of both directions says, so that the model is \
        reciprocal and returns no more than arrives; the specification takes what the facet between both reflects, \
        by which white plastic returns up to a third too much at grazing angles. The film's colours are those of \
        linear sRGB.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("metallic_roughness.wgsl");
    // Worst 1.7e-5, in the colours of a film.
    const TWIN: (f32, f32) = (7e-5, 1e-6);

    /// The albedo of sheen.
    fn bake(&self, _: &[f32]) -> Result<Vec<f32>, ModelError> {
        Ok(sheen_table().to_vec())
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
        let (s, specular_pdf, cos) = self.facets().reflect(self.turn(wo, 1.0), self.turn(wi, 1.0));
        let (dielectric, metal) = self.fresnel(cos);
        let mut f = (dielectric * s + self.diffuse(wo, wi, dielectric)).lerp(metal * s, self.metallic);
        self.add_sheen(table, wo, wi, &mut f);
        let lobes = self.lobes(table, wo);
        let mut pdf =
            lobes.specular * specular_pdf + (1.0 - lobes.specular - lobes.coat) * cosine_hemisphere_pdf(wi);
        if self.clearcoat > 0.0 {
            let (s, coat_pdf, cos) = self.coat_facets().reflect(wo, wi);
            f = f * (1.0 - self.coat_fresnel(wo.z.min(wi.z))) + self.coat_fresnel(cos) * s;
            pdf += lobes.coat * coat_pdf;
        }
        (f, pdf)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let lobes = self.lobes(table, wo);
        let wi = if u.z < lobes.coat {
            self.coat_facets().sample_reflection(wo, u.truncate())
        } else if u.z < lobes.coat + lobes.specular {
            self.turn(self.facets().sample_reflection(self.turn(wo, 1.0), u.truncate()), -1.0)
        } else {
            cosine_hemisphere(u.truncate())
        };
        Sample::of(self, table, wo, wi)
    }

    fn slope_lobe(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Option<SlopeLobe> {
        // A coat is sharper than what it covers, which is then the rest.
        if self.clearcoat > 0.0 {
            let bare = Self { clearcoat: 0.0, ..*self };
            let rest = bare.eval(table, wo, wi) * (1.0 - self.coat_fresnel(wo.z.min(wi.z)));
            return Some(SlopeLobe { rest, ..self.coat_facets().slope_lobe() });
        }
        let cos = half_vector(wo, wi).1;
        let mut rest = self.diffuse(wo, wi, self.fresnel(cos).0) * (1.0 - self.metallic);
        self.add_sheen(table, wo, wi, &mut rest);
        let facets = self.facets().slope_lobe();
        let (sin, cos) = self.anisotropy_rotation.sin_cos();
        let [along, across] = [facets.alpha2.x, facets.alpha2.z];
        let alpha2 = Vec3::new(
            cos * cos * along + sin * sin * across,
            cos * sin * (along - across),
            sin * sin * along + cos * cos * across,
        );
        Some(SlopeLobe { alpha2, rest, ..facets })
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.base_color
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::furnace::mean_weight;
    use crate::ggx::Ggx;
    use crate::microfacet::f_dielectric;

    const PAIRS: [(f32, f32, f32, f32); 4] =
        [(0.1, 0.0, 0.3, 2.0), (0.7, 1.0, 0.9, 4.0), (1.2, 5.0, 1.1, 2.0), (0.5, 3.0, 1.4, 3.5)];

    fn close(a: Vec3, b: Vec3) -> bool {
        (a - b).abs().max_element() <= 1e-5 * a.abs().max_element().max(1e-3)
    }

    #[test]
    fn metal_is_ggx_and_dielectric_is_its_mixture_with_lambert() {
        let base = Vec3::new(0.9, 0.5, 0.1);
        let m = MetallicRoughness { base_color: base, roughness: 0.6, ..Default::default() };
        let table = m.bake(&[]).unwrap();
        let ggx = |f0| Ggx { masking: Choice(0.0), alpha_x: 0.36, alpha_y: 0.36, f0, ..Ggx::default() };
        for (a, b, c, d) in PAIRS {
            let (wo, wi) = (spherical(a, b), spherical(c, d));
            assert!(close(m.eval(&table, wo, wi), ggx(base).eval(&[], wo, wi)));
            // Appendix B.3.5, but by Fresnel at the more grazing direction.
            let m = MetallicRoughness { metallic: 0.0, ..m };
            let fr = 0.04 + 0.96 * schlick_weight(wo.z.min(wi.z));
            let expected = (1.0 - fr) * base * FRAC_1_PI + ggx(Vec3::splat(0.04)).eval(&[], wo, wi);
            assert!(close(m.eval(&table, wo, wi), expected));
        }
    }

    #[test]
    fn white_plastic_returns_no_more_than_arrives() {
        for roughness in [0.0, 0.2, 0.5, 0.8, 1.0] {
            let white = MetallicRoughness { metallic: 0.0, roughness, ..Default::default() };
            for theta in [0.0, 0.5, 1.0, 1.3, 1.5] {
                let albedo = mean_weight(&white, &[], spherical(theta, 0.3), 64);
                assert!((0.3..1.002).contains(&albedo), "roughness {roughness}, {theta} rad: {albedo}");
            }
        }
    }

    #[test]
    fn the_grain_turns_with_its_rotation() {
        let m = MetallicRoughness { roughness: 0.3, anisotropy: 0.8, ..Default::default() };
        let turned = MetallicRoughness { anisotropy_rotation: 0.7, ..m };
        for (a, b, c, d) in PAIRS {
            let f = m.eval(&[], spherical(a, b), spherical(c, d));
            assert!(
                (turned.eval(&[], spherical(a, b + 0.7), spherical(c, d + 0.7)) / f - 1.0).x.abs() < 1e-4
            );
        }
        // Rougher along the grain: the highlight is longer there.
        let wo = Vec3::Z;
        assert!(m.eval(&[], wo, spherical(0.5, 0.0)).x > 5.0 * m.eval(&[], wo, spherical(0.5, FRAC_PI_2)).x);
    }

    #[test]
    fn a_film_without_thickness_is_not_there_and_a_thick_one_has_no_colour() {
        for f0 in [0.04, 0.5, 0.95] {
            let got = f_iridescence(1.0, 1.3, 0.0, Vec3::splat(f0));
            // Two orders of interference only, and sensitivities that integrate to one within a percent.
            assert!((got - f0).abs().max_element() < 0.01, "{f0}: {got}");
        }
        // Ten micrometres of film: the orders wash out to the sum of both boundaries' reflections.
        let got = f_iridescence(1.0, 1.3, 10_000.0, Vec3::splat(0.04));
        let (r12, r23) = (f_dielectric(1.0, 1.3), f_dielectric(1.0, 1.5 / 1.3));
        let expected = r12 + (1.0 - r12) * (1.0 - r12) * r23 / (1.0 - r12 * r23);
        assert!((got - expected).abs().max_element() < 1e-3, "{got} for {expected}");
        // A soap film of 350 nm on glass is coloured.
        let coloured = f_iridescence(1.0, 1.3, 350.0, Vec3::splat(0.04));
        assert!(coloured.max_element() > 1.2 * coloured.min_element(), "{coloured}");
    }
}
