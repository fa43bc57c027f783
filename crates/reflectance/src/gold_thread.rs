//! After Sadeghi et al. 2013, "A Practical Microcylinder Appearance Model for Cloth Rendering", and Walter et al.
//! 2007: the gold thread of Japanese brocade (kinran), in its two makes.
//!
//! * `flat` (hirakinshi): leaf on lacquered paper, cut to a ribbon. The element is flat, so this is rough metal
//!   with one roughness along the strip and another across it, not a cylinder.
//! * `wrapped` (nenkinshi): the strip wound about a core in both senses. Two sets of microcylinders lie at plus
//!   and minus the winding angle to the thread; what metal adds to the cloth model is Fresnel's reflectance of a
//!   conductor in place of the dielectric's, and what it takes away is the volume, as no light comes back from
//!   within: `f = c Σ± ½ F cos(φ_d/2) g(γ, θ_h) M cos θ_i cos θ_o / (cos² θ_d (n·w_i) (n·w_o))`.
//!   f_rs of the paper has eight times the energy of a mirror cylinder, harmless at the 4 % of silk but not at
//!   the 90 % of gold, so c is such that a perfect mirror would give back at most 98 % in any direction.
//!
//! Lacquer of index `n` over the metal is a second face parallel to each facet:
//! `F + (1 − F)² B/(1 − F B)` with F of air on lacquer and B of lacquer on metal at the refracted angle, added
//! without interference as the coat is many wavelengths thick. It turns gold redder. A split into body and
//! surface colour does not hold for either make: all of it is surface.

use crate::gaussian_light::SlopeLobe;
use crate::metals::Metal;
use crate::microcylinder::r3_sequence;
use crate::microfacet::{Distribution, Masking, Microfacets, f_conductor, f_dielectric};
use crate::model::{Choice, Laws, Model, ModelError, Preset, Sample, Spec, params};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use yugen_optics::{ColourSpace, frame::spherical};

params! {
    /// Metal leaf as a ribbon, or wound about a thread; the thread runs along +x.
    pub struct GoldThread {
        form: Choice = Spec::choice(0, &["flat", "wrapped"], "flat: ribbon (hirakinshi); wrapped: wound about a core (nenkinshi)"),
        // Gold, Olmon et al. 2012, at 610, 550 and 450 nm.
        eta: Vec3 = Spec::colour([0.1908, 0.3256, 1.472], 0.0, 10.0, "", "real part of the metal's index of refraction"),
        k: Vec3 = Spec::colour([3.232, 2.507, 1.855], 0.0, 15.0, "", "imaginary part: extinction"),
        alpha_along: f32 = Spec::num(0.3, 0.02, 1.0, "", "flat: roughness along the strip, from the grain of its paper"),
        alpha_across: f32 = Spec::num(0.12, 0.02, 1.0, "", "flat: roughness across the strip"),
        winding: f32 = Spec::num(70.0, 0.0, 90.0, "deg", "wrapped: angle between the strip and the thread"),
        gamma: f32 = Spec::num(12.0, 2.0, 40.0, "deg", "wrapped: width of the lobe, from the strip's unevenness"),
        lacquer: f32 = Spec::num(0.0, 0.0, 1.0, "", "share of the metal that is under lacquer"),
        lacquer_ior: f32 = Spec::num(1.53, 1.05, 2.0, "", "index of refraction of the lacquer; urushi has 1.53"),
    }
}

/// Width of the correlation of shadowing with masking: 20°, as in the cloth.
const SIGMA: f32 = 20.0 * PI / 180.0;

const PRESETS: [Preset; 4] = [
    Preset { name: "hirakinshi", doc: "Gold leaf on paper, cut to a flat ribbon" },
    Preset { name: "hirakinshi_lacquered", doc: "The same under clear lacquer: redder, with a white sheen" },
    Preset { name: "nenkinshi", doc: "Gold strip wound about a silk core" },
    Preset { name: "nenkinshi_silver", doc: "Silver strip wound about a silk core" },
];

/// A direction relative to a microcylinder in the plane of the cloth: along it, across it, cos θ.
struct Around {
    along: f32,
    across: f32,
    cos_theta: f32,
}

impl Around {
    /// `sense` is ±1, the sense of winding.
    fn new(winding: Vec2, sense: f32, w: Vec3) -> Self {
        let along = winding.x * w.x + sense * winding.y * w.y;
        let across = winding.x * w.y - sense * winding.y * w.x;
        Self { along, across, cos_theta: (w.z * w.z + across * across).sqrt() }
    }
}

impl GoldThread {
    /// Reflectance of a facet or a cylinder at incidence cosine `cos`.
    fn reflectance(&self, cos: f32) -> Vec3 {
        let bare = f_conductor(cos, self.eta, self.k);
        if self.lacquer <= 0.0 {
            return bare;
        }
        let n = self.lacquer_ior;
        let top = f_dielectric(cos, n);
        let cos_within = (1.0 - (1.0 - cos * cos).max(0.0) / (n * n)).sqrt();
        let base = f_conductor(cos_within, self.eta / n, self.k / n);
        let coated = Vec3::splat(top)
            + (1.0 - top) * (1.0 - top) * base / (Vec3::ONE - top * base).max(Vec3::splat(1e-6));
        bare.lerp(coated, self.lacquer)
    }

    fn facets(&self) -> Microfacets {
        Microfacets::new(Distribution::Ggx, Masking::HeightCorrelated, self.alpha_along, self.alpha_across)
    }

    fn winding(&self) -> Vec2 {
        Vec2::from_angle(self.winding.to_radians())
    }

    /// f of one sense of winding for F = 1 and c = 1, and the cosine for F.
    fn cylinder(&self, sense: f32, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let (o, i) = (Around::new(self.winding(), sense, wo), Around::new(self.winding(), sense, wi));
        let (s, e) = (o.along + i.along, o.cos_theta + i.cos_theta);
        let d2 = s * s + e * e;
        let phi_d = (wi.z * o.across - wo.z * i.across).atan2(wi.z * wo.z + i.across * o.across);
        let cos_half = (0.5 * phi_d).cos();
        let u = (-0.5 * (phi_d / SIGMA) * (phi_d / SIGMA)).exp();
        // M cos θ_i cos θ_o / ((n·w_i)(n·w_o)) with m = n·w / cos θ.
        let m = 1.0 - u + u * (o.cos_theta / wo.z).min(i.cos_theta / wi.z);
        let gamma = self.gamma.to_radians();
        let x = s.atan2(e) / gamma;
        let g = (-0.5 * x * x).exp() / (TAU.sqrt() * gamma);
        (cos_half * g * 4.0 / d2 * m, 0.5 * d2.sqrt() * cos_half)
    }

    /// Bounds of the sampled lobe, as in the cloth's sampler: Student's t with two degrees of freedom in tan θ_h.
    fn lobe(&self, o: &Around) -> (f32, f32, f32) {
        let gamma = self.gamma.to_radians();
        let width = 1.1 * gamma * (1.0 + 0.5 * gamma * gamma);
        let c = o.cos_theta * width;
        let (up, down) = ((1.0 + o.along).max(0.0), (1.0 - o.along).max(0.0));
        (width, -down / (c * c + down * down).sqrt(), up / (c * c + up * up).sqrt())
    }

    fn cylinder_pdf(&self, sense: f32, wo: Vec3, wi: Vec3) -> f32 {
        let (o, i) = (Around::new(self.winding(), sense, wo), Around::new(self.winding(), sense, wi));
        let (width, lo, hi) = self.lobe(&o);
        let (s, e) = (o.along + i.along, o.cos_theta + i.cos_theta);
        let r2 = e * e * width * width + s * s;
        let p_theta = 0.5 * width * width * e * (s * s + e * e) / (r2 * r2.sqrt() * (hi - lo));
        0.5 * wi.z / i.cos_theta * p_theta / i.cos_theta
    }

    fn direction(&self, wo: Vec3, u: Vec3) -> Vec3 {
        let (sense, winding) = (if u.z < 0.5 { 1.0 } else { -1.0 }, self.winding());
        let o = Around::new(winding, sense, wo);
        let (width, lo, hi) = self.lobe(&o);
        let x = lo + u.x * (hi - lo);
        let (c2, s2) = ((1.0 - x * x).max(0.0), width * width * x * x);
        let (cos_2h, sin_2h) = ((c2 - s2) / (c2 + s2), 2.0 * width * x * c2.sqrt() / (c2 + s2));
        let along = sin_2h * o.cos_theta - cos_2h * o.along;
        let cos_theta = (cos_2h * o.cos_theta + sin_2h * o.along).max(0.0);
        let sin_phi = 2.0 * u.y - 1.0;
        let across = cos_theta * sin_phi;
        Vec3::new(
            winding.x * along - sense * winding.y * across,
            sense * winding.y * along + winding.x * across,
            cos_theta * (1.0 - sin_phi * sin_phi).max(0.0).sqrt(),
        )
        .normalize()
    }
}

impl Model for GoldThread {
    const NAME: &'static str = "gold_thread";
    const SOURCE: &'static str = "After Sadeghi et al. 2013, A Practical Microcylinder Appearance Model for Cloth \
        Rendering, and Walter et al. 2007, Microfacet Models for Refraction through Rough Surfaces";
    const DOC: &'static str = "The metal thread of brocade: leaf as a flat ribbon (hirakinshi) or wound about a core \
        (nenkinshi), bare or under lacquer. Set the tangent along the thread. Gold is redder than sRGB can say: \
        work in rec2020.";
    const LAWS: Laws = Laws { isotropic: false, ..Laws::PHYSICAL };
    const WGSL: &'static str = include_str!("gold_thread.wgsl");
    const PRESETS: &'static [Preset] = &PRESETS;

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let of = |metal: Metal, form: f32, lacquer: f32| {
            let (eta, k) = metal.rgb_index(space);
            Self { form: Choice(form), eta, k, lacquer, ..Self::default() }
        };
        let model = match name {
            "hirakinshi" => of(Metal::Gold, 0.0, 0.0),
            "hirakinshi_lacquered" => of(Metal::Gold, 0.0, 1.0),
            "nenkinshi" => of(Metal::Gold, 1.0, 0.0),
            "nenkinshi_silver" => of(Metal::Silver, 1.0, 0.0),
            _ => return None,
        };
        Some((model, Vec::new()))
    }

    /// One number: c of the wrapped form.
    fn bake(&self, _: &[f32]) -> Result<Vec<f32>, ModelError> {
        if self.form.index() == 0 {
            return Ok(vec![1.0]);
        }
        let mut largest = 0f32;
        for theta in [0.0f32, 0.6, 1.0, 1.25, 1.4, 1.49, 1.54, 1.5655] {
            for k in 0..8 {
                // Half a turn is enough: turned by half a turn the thread is the same.
                let wo = spherical(theta, k as f32 * PI / 8.0);
                let n = 256;
                let returned = (0..n).map(|i| {
                    let wi = self.direction(wo, r3_sequence(i));
                    let pdf = self.pdf(&[1.0], wo, wi);
                    let f: f32 = [1.0, -1.0].map(|sense| 0.5 * self.cylinder(sense, wo, wi).0).iter().sum();
                    if wi.z > 0.0 && pdf > 0.0 { f * wi.z / pdf } else { 0.0 }
                });
                largest = largest.max(returned.sum::<f32>() / n as f32);
            }
        }
        Ok(vec![0.98 / largest])
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        if self.form.index() == 0 {
            let (f, _, cos) = self.facets().reflect(wo, wi);
            return f * self.reflectance(cos);
        }
        let mut sum = Vec3::ZERO;
        for sense in [1.0, -1.0] {
            let (f, cos) = self.cylinder(sense, wo, wi);
            sum += 0.5 * f * self.reflectance(cos);
        }
        table[0] * sum
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        if self.form.index() == 0 {
            return self.facets().reflect(wo, wi).1;
        }
        0.5 * (self.cylinder_pdf(1.0, wo, wi) + self.cylinder_pdf(-1.0, wo, wi))
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = if self.form.index() == 0 {
            self.facets().sample_reflection(wo, u.truncate())
        } else {
            self.direction(wo, u)
        };
        let pdf = self.pdf(table, wo, wi);
        if wi.z <= 0.0 || pdf.is_nan() || pdf <= 0.0 {
            return None;
        }
        Some(Sample { wi, weight: self.eval(table, wo, wi) * (wi.z / pdf), pdf, delta: false, eta: 1.0 })
    }

    fn slope_lobe(&self, _: &[f32], _: Vec3, _: Vec3) -> Option<SlopeLobe> {
        (self.form.index() == 0).then(|| self.facets().slope_lobe())
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.reflectance(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::films::{coat, stack};
    use yugen_optics::quadrature::gauss_legendre;

    #[test]
    fn coated_facets_are_what_films_say() {
        // The same coat by the characteristic-matrix module, clear, at one wavelength per channel.
        let m = GoldThread { lacquer: 1.0, ..GoldThread::default() };
        for cos in [1.0f32, 0.8, 0.5, 0.2] {
            let ours = m.reflectance(cos);
            for c in 0..3 {
                let index = num_complex::Complex64::new(f64::from(m.eta[c]), f64::from(m.k[c]));
                let n = f64::from(m.lacquer_ior);
                let theirs = coat(1.0, f64::from(cos), n, 1.0, |inside| stack(550.0, n, inside, &[], index));
                // films keeps the polarisations apart between the faces; unpolarised light between them differs
                // by 0.013 at most here, at cos 0.2.
                assert!(
                    (f64::from(ours[c]) - theirs.reflectance()).abs() < 0.03,
                    "{cos} {c}: {ours} {theirs:?}"
                );
            }
        }
    }

    #[test]
    fn gold_is_gold_and_lacquer_makes_it_redder() {
        let bare = GoldThread::preset("hirakinshi", ColourSpace::LinearRec2020).unwrap().0.reflectance(1.0);
        let coated = GoldThread::preset("hirakinshi_lacquered", ColourSpace::LinearRec2020)
            .unwrap()
            .0
            .reflectance(1.0);
        // Spectrally (Olmon et al. 2012, D65) gold is (0.9236, 0.7875, 0.3848); indices averaged per channel come
        // within 0.06 of it.
        assert!((bare - Vec3::new(0.9236, 0.7875, 0.3848)).abs().max_element() < 0.06, "{bare}");
        assert!(coated.z / coated.x < bare.z / bare.x, "{coated} {bare}");
    }

    #[test]
    fn a_mirror_strip_returns_what_is_promised() {
        for (winding, gamma) in [(70.0, 12.0), (20.0, 4.0), (45.0, 30.0)] {
            let m = GoldThread {
                form: Choice(1.0),
                eta: Vec3::ZERO,
                k: Vec3::splat(5.0),
                winding,
                gamma,
                ..GoldThread::default()
            };
            let table = m.bake(&[]).unwrap();
            let mut largest = 0f32;
            for theta in [0.0f32, 0.5, 1.0, 1.3, 1.5] {
                let wo = spherical(theta, 0.7);
                let mut sum = 0.0;
                for (x, w) in gauss_legendre(64, 0.0, std::f64::consts::FRAC_PI_2) {
                    for k in 0..128 {
                        let wi = spherical(x as f32, TAU * (k as f32 + 0.5) / 128.0);
                        sum += m.eval(&table, wo, wi).x * wi.z * (w * x.sin()) as f32 * TAU / 128.0;
                    }
                }
                assert!(sum < 1.0, "{winding} {gamma} {theta}: {sum}");
                largest = largest.max(sum);
            }
            assert!(largest > 0.5, "{winding} {gamma}: the bound is far too low, {largest}");
        }
    }
}
