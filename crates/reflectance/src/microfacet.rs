//! The terms of microfacet theory, named by role and author: `d_` distributions of normals, `g_` and `v_`
//! shadowing-masking, `f_` Fresnel reflectance, and the sampling of visible normals.
//!
//! Roughness is `ax` along the tangent +x and `ay` along +y, the root-mean-square slope times √2 for
//! Beckmann. Cosines are of the local frame, so no term needs a trigonometric function.

use crate::gaussian_light::SlopeLobe;
use crate::model::Choice;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};
use yugen_optics::frame::safe_sqrt;
use yugen_optics::special::erfinv_f32;

/// The terms in WGSL, spliced in after `frame.wgsl`.
pub const MICROFACET_WGSL: &str = include_str!("microfacet.wgsl");

/// The names of [`Distribution`], in the order of its indices, for a `Choice` parameter.
pub const DISTRIBUTIONS: &[&str] = &["beckmann", "ggx"];
/// The names of [`Masking`], in the order of its indices, for a `Choice` parameter.
pub const MASKINGS: &[&str] = &["separable", "height_correlated"];

/// Below this roughness single precision no longer resolves the lobe.
pub const MIN_ALPHA: f32 = 1e-4;

/// α of the roughness on the sliders of glTF. A roughness of zero is common in files, where it is meant as polished: a
/// lobe of a thousandth still holds in single precision.
#[inline]
pub fn alpha_of_roughness(roughness: f32) -> f32 {
    (roughness * roughness).max(1e-3)
}

/// How the normals of the microfacets are distributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Gaussian slopes: Beckmann and Spizzichino 1963.
    Beckmann,
    /// Longer tails: Trowbridge and Reitz 1975, Walter et al. 2007.
    Ggx,
}

impl From<Choice> for Distribution {
    fn from(c: Choice) -> Self {
        if c.index() == 0 { Self::Beckmann } else { Self::Ggx }
    }
}

/// How shadowing and masking depend on each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Masking {
    /// Independent: the product of both.
    Separable,
    /// Through the height of the facet, which lowers both at once: Ross et al. 2005, Heitz 2014.
    HeightCorrelated,
}

impl From<Choice> for Masking {
    fn from(c: Choice) -> Self {
        if c.index() == 0 { Self::Separable } else { Self::HeightCorrelated }
    }
}

// ---------------------------------------------------------------------------------------------------------
// Distributions of normals

/// Trowbridge and Reitz 1975; Walter et al. 2007 named it GGX. Density of normals `h`, ∫ D cos θ_h dω = 1.
#[inline]
pub fn d_ggx(h: Vec3, ax: f32, ay: f32) -> f32 {
    let (x, y) = (h.x / ax, h.y / ay);
    let s = x * x + y * y + h.z * h.z;
    FRAC_1_PI / (ax * ay * s * s)
}

/// Beckmann and Spizzichino 1963. Density of normals `h`, ∫ D cos θ_h dω = 1.
#[inline]
pub fn d_beckmann(h: Vec3, ax: f32, ay: f32) -> f32 {
    let (x, y) = (h.x / ax, h.y / ay);
    let z2 = h.z * h.z;
    if z2 < 1e-12 {
        return 0.0;
    }
    FRAC_1_PI * (-(x * x + y * y) / z2).exp() / (ax * ay * z2 * z2)
}

// ---------------------------------------------------------------------------------------------------------
// Shadowing-masking: Smith 1967

/// Smith's Λ for GGX. Heitz 2014, "Understanding the Masking-Shadowing Function".
#[inline]
pub fn lambda_ggx(w: Vec3, ax: f32, ay: f32) -> f32 {
    0.5 * (stretched_length(w, ax, ay) / w.z.abs() - 1.0)
}

/// Smith's Λ for Beckmann, (e^{−a²}/(a√π) − erfc a)/2 with a = cot θ / α: exact, where many programs use
/// the rational fit of Walter et al. 2007 (up to 0.4 % off in G).
#[inline]
pub fn lambda_beckmann(w: Vec3, ax: f32, ay: f32) -> f32 {
    let (x, y) = (ax * w.x, ay * w.y);
    let s2 = x * x + y * y;
    // Λ(3.5) = 1e-8.
    if w.z * w.z >= 12.25 * s2 {
        return 0.0;
    }
    let a2 = w.z * w.z / s2;
    let a = a2.sqrt();
    // 1/(2√π)
    let lambda = (-a2).exp() * (0.282_094_79 / a - 0.5 * erfc_factor(a));
    lambda.max(0.0)
}

/// √(cos² + αx² x² + αy² y²): the length of `w` in the space where the GGX surface is a hemisphere.
#[inline]
fn stretched_length(w: Vec3, ax: f32, ay: f32) -> f32 {
    let (x, y) = (ax * w.x, ay * w.y);
    (w.z * w.z + x * x + y * y).sqrt()
}

/// G/(4 cos θ_o cos θ_i) for GGX with height-correlated masking. Heitz 2014; the form is Lagarde and
/// de Rousiers 2014, "Moving Frostbite to PBR".
#[inline]
pub fn v_smith_ggx_correlated(wo: Vec3, wi: Vec3, ax: f32, ay: f32) -> f32 {
    let (lo, li) = (stretched_length(wo, ax, ay), stretched_length(wi, ax, ay));
    0.5 / (wi.z.abs() * lo + wo.z.abs() * li)
}

/// G/(4 cos θ_o cos θ_i) for GGX with separable masking. Walter et al. 2007.
#[inline]
pub fn v_smith_ggx_separable(wo: Vec3, wi: Vec3, ax: f32, ay: f32) -> f32 {
    1.0 / ((wo.z.abs() + stretched_length(wo, ax, ay)) * (wi.z.abs() + stretched_length(wi, ax, ay)))
}

// ---------------------------------------------------------------------------------------------------------
// A rough surface

/// A rough surface: its distribution of normals with everything that follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    /// Of normals.
    pub distribution: Distribution,
    /// Smith, in one of its forms.
    pub masking: Masking,
    /// Roughness along +x.
    pub ax: f32,
    /// Roughness along +y.
    pub ay: f32,
}

impl Microfacets {
    /// Roughness is kept at [`MIN_ALPHA`] or more.
    #[inline]
    pub fn new(distribution: Distribution, masking: Masking, ax: f32, ay: f32) -> Self {
        Self { distribution, masking, ax: ax.max(MIN_ALPHA), ay: ay.max(MIN_ALPHA) }
    }

    /// The lobe that they make, without anything else.
    pub fn slope_lobe(&self) -> SlopeLobe {
        let long_tails = self.distribution == Distribution::Ggx;
        SlopeLobe { long_tails, ..SlopeLobe::gaussian(self.ax, self.ay) }
    }

    /// Density of normals.
    #[inline]
    pub fn d(&self, h: Vec3) -> f32 {
        match self.distribution {
            Distribution::Beckmann => d_beckmann(h, self.ax, self.ay),
            Distribution::Ggx => d_ggx(h, self.ax, self.ay),
        }
    }

    /// Smith's Λ.
    #[inline]
    pub fn lambda(&self, w: Vec3) -> f32 {
        match self.distribution {
            Distribution::Beckmann => lambda_beckmann(w, self.ax, self.ay),
            Distribution::Ggx => lambda_ggx(w, self.ax, self.ay),
        }
    }

    /// The part of the facets facing `w` that `w` sees.
    #[inline]
    pub fn g1(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// The part of the facets that both directions see, from their Λ. Two directions on opposite sides (through
    /// the surface) with height correlation give the beta function of Ross et al., for which the literature
    /// and we take the separable form.
    #[inline]
    fn g2_of(&self, lambda_o: f32, lambda_i: f32, same_side: bool) -> f32 {
        if self.masking == Masking::HeightCorrelated && same_side {
            1.0 / (1.0 + lambda_o + lambda_i)
        } else {
            1.0 / ((1.0 + lambda_o) * (1.0 + lambda_i))
        }
    }

    /// The part of the facets that both directions see.
    #[inline]
    pub fn g2(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.g2_of(self.lambda(wo), self.lambda(wi), wo.z * wi.z > 0.0)
    }

    /// Reflection off a perfect mirror of facets, both directions above: f = D G/(4 cos cos), the density
    /// of [`Self::sample_reflection`], and wo·h for Fresnel. Zeros where there is none.
    #[inline]
    pub fn reflect(&self, wo: Vec3, wi: Vec3) -> (f32, f32, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (0.0, 0.0, 0.0);
        }
        let h = (wo + wi).normalize_or_zero();
        let d = self.d(h);
        let cos_oh = wo.dot(h).clamp(0.0, 1.0);
        let (f, pdf) = match self.distribution {
            Distribution::Ggx => {
                let (lo, li) =
                    (stretched_length(wo, self.ax, self.ay), stretched_length(wi, self.ax, self.ay));
                let v = match self.masking {
                    Masking::HeightCorrelated => 0.5 / (wi.z * lo + wo.z * li),
                    Masking::Separable => 1.0 / ((wo.z + lo) * (wi.z + li)),
                };
                (d * v, 0.5 * d / (wo.z + lo))
            }
            Distribution::Beckmann => {
                let (lo, li) = (lambda_beckmann(wo, self.ax, self.ay), lambda_beckmann(wi, self.ax, self.ay));
                let d4 = 0.25 * d / wo.z;
                (d4 * self.g2_of(lo, li, true) / wi.z, d4 / (1.0 + lo))
            }
        };
        (f, pdf, cos_oh)
    }

    /// Refraction of all light by facets, `wo` above and `wi` below, into an index `eta` times that of the side of `wo`:
    /// f, the density of [`refract`] at a visible normal, and wo·h for Fresnel. Zeros where there is none. Walter et al.
    /// 2007, equation 21, for radiance.
    #[inline]
    pub fn refract(&self, wo: Vec3, wi: Vec3, eta: f32) -> (f32, f32, f32) {
        // The facet that refracts one into the other, turned to face up.
        let h = wo + eta * wi;
        let h = h.normalize_or_zero() * 1f32.copysign(h.z);
        let (oh, ih) = (wo.dot(h), wi.dot(h));
        if wo.z <= 0.0 || wi.z >= 0.0 || oh <= 0.0 || ih >= 0.0 {
            return (0.0, 0.0, 0.0);
        }
        // D |o·h| |i·h| / (cos o (o·h + η i·h)²); the η² of dω_h/dω_i meets the 1/η² of radiance in f.
        let denominator = oh + eta * ih;
        let seen = self.d(h) * self.g1(wo) * oh * -ih / (wo.z * denominator * denominator);
        (seen * self.g1(wi) / -wi.z, seen * eta * eta, oh)
    }

    /// Draws `wi` for [`Self::reflect`]; it may lie below the surface, where light is lost.
    #[inline]
    pub fn sample_reflection(&self, wo: Vec3, u: Vec2) -> Vec3 {
        let h = self.sample_visible_normal(wo, u);
        2.0 * wo.dot(h) * h - wo
    }

    /// Density of [`Self::sample_visible_normal`] per solid angle of `h`, for `wo` above.
    #[inline]
    pub fn pdf_visible_normal(&self, wo: Vec3, h: Vec3) -> f32 {
        self.g1(wo) * wo.dot(h).max(0.0) * self.d(h) / wo.z
    }

    /// A normal as `wo` (above) sees them: density G1 max(wo·h, 0) D / cos θ_o.
    #[inline]
    pub fn sample_visible_normal(&self, wo: Vec3, u: Vec2) -> Vec3 {
        match self.distribution {
            Distribution::Beckmann => sample_visible_beckmann(wo, self.ax, self.ay, u),
            Distribution::Ggx => sample_visible_ggx(wo, self.ax, self.ay, u),
        }
    }
}

/// Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".
#[inline]
pub fn sample_visible_ggx(wo: Vec3, ax: f32, ay: f32, u: Vec2) -> Vec3 {
    let v = Vec3::new(ax * wo.x, ay * wo.y, wo.z).normalize();
    let z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    let r = safe_sqrt(1.0 - z * z);
    let (sin, cos) = (TAU * u.x).sin_cos();
    let c = Vec3::new(r * cos + v.x, r * sin + v.y, z + v.z);
    Vec3::new(ax * c.x, ay * c.y, c.z.max(1e-9)).normalize()
}

/// Visible slopes of a Gaussian surface: Heitz and d'Eon 2014, "Importance Sampling Microfacet-Based BSDFs
/// using the Distribution of Visible Normals". Along the view the CDF of the slope s is, up to a factor,
/// cos θ (1 + erf s) + sin θ e^{−s²}/√π. The first guess mixes the closed forms of head-on and grazing view;
/// two steps of Halley's method from it leave 1e-7 of the CDF at most.
pub fn sample_visible_beckmann(wo: Vec3, ax: f32, ay: f32, u: Vec2) -> Vec3 {
    // 1/√π
    const FRAC_1_SQRT_PI: f32 = 0.564_189_6;
    let v = Vec3::new(ax * wo.x, ay * wo.y, wo.z).normalize();
    let cos_theta = v.z;
    let sin_theta = (v.x * v.x + v.y * v.y).sqrt();
    let (cos_phi, sin_phi) = if sin_theta > 0.0 { (v.x / sin_theta, v.y / sin_theta) } else { (1.0, 0.0) };
    // erf saturates in single precision at slopes of 4.
    let cot = if cos_theta < 4.0 * sin_theta { cos_theta / sin_theta } else { 4.0 };
    let cdf = |s: f32, gauss: f32| cos_theta * one_plus_erf(s, gauss) + sin_theta * FRAC_1_SQRT_PI * gauss;
    let gauss = (-cot * cot).exp();
    let u_x = u.x.max(1e-6);
    let target = u_x * cdf(cot, gauss);
    // Head on 1 + erf s is 2u, at grazing erfc √(−ln u), where the Gaussian is u.
    let blend = cos_theta * cos_theta;
    let grazing = erfc_factor((-u_x.ln()).sqrt());
    let x = one_plus_erf(cot, gauss) * u_x * (blend + (1.0 - blend) * grazing);
    let mut s = erfinv_f32((x - 1.0).clamp(-1.0 + 1e-6, 1.0 - 1e-6));
    for _ in 0..2 {
        let gauss = (-s * s).exp();
        let facing = (cos_theta - s * sin_theta).max(1e-6);
        // 2/√π e^{−s²} (cos θ − s sin θ) is the slope of the CDF.
        let step = (cdf(s, gauss) - target) / (2.0 * FRAC_1_SQRT_PI * gauss * facing);
        let curvature = -2.0 * s - sin_theta / facing;
        s = (s - step / (1.0 - 0.5 * step * curvature).clamp(0.5, 2.0)).clamp(-4.0, cot);
    }
    let t = erfinv_f32((2.0 * u.y - 1.0).clamp(-1.0 + 1e-6, 1.0 - 1e-6));
    Vec3::new(-ax * (cos_phi * s - sin_phi * t), -ay * (sin_phi * s + cos_phi * t), 1.0).normalize()
}

/// 1 + erf(s), from e^{−s²} that the caller has.
#[inline]
fn one_plus_erf(s: f32, gauss: f32) -> f32 {
    let tail = erfc_factor(s.abs()) * gauss;
    if s < 0.0 { tail } else { 2.0 - tail }
}

/// erfc(x) e^{x²} for x ≥ 0, to 1.5e-7 e^{x²}. Abramowitz and Stegun 1964, 7.1.26.
#[inline]
fn erfc_factor(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    t * (0.254_829_592
        + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))))
}

// ---------------------------------------------------------------------------------------------------------
// Fresnel

/// (1 − x)⁵ for x in [0, 1].
#[inline]
pub fn schlick_weight(x: f32) -> f32 {
    let m = (1.0 - x).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering": from `f0` head on to `f90` at
/// grazing light.
#[inline]
pub fn f_schlick(f0: Vec3, f90: Vec3, cos: f32) -> Vec3 {
    f0 + (f90 - f0) * schlick_weight(cos)
}

/// Unpolarised reflectance of a dielectric, exact, in the g-form of Cook and Torrance 1982. `cos` ≥ 0 is that of
/// the incident side, `eta` the index beyond over the index here; 1 under total internal reflection.
#[inline]
pub fn f_dielectric(cos: f32, eta: f32) -> f32 {
    let c = cos.clamp(0.0, 1.0);
    let g2 = eta * eta - 1.0 + c * c;
    if g2 <= 0.0 {
        return 1.0;
    }
    let g = g2.sqrt();
    let a = (g - c) / (g + c);
    let b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    (0.5 * a * a * (1.0 + b * b)).min(1.0)
}

/// Unpolarised reflectance of a conductor, exact per channel, in air. `eta` + i `k` is the complex index.
#[inline]
pub fn f_conductor(cos: f32, eta: Vec3, k: Vec3) -> Vec3 {
    let c = cos.clamp(0.0, 1.0);
    let c2 = c * c;
    let s2 = 1.0 - c2;
    let (eta2, k2) = (eta * eta, k * k);
    let t = eta2 - k2 - s2;
    // a² + b² and a of the complex cosine of refraction times the index.
    let a2b2 = (t * t + 4.0 * eta2 * k2).map(f32::sqrt);
    let a = (0.5 * (a2b2 + t)).max(Vec3::ZERO).map(f32::sqrt);
    let (t1, t2) = (a2b2 + c2, 2.0 * c * a);
    let rs = (t1 - t2) / (t1 + t2);
    // The tiny number makes the index 0, where all is 0/0, the mirror it tends to.
    let (t3, t4) = (c2 * a2b2 + s2 * s2 + 1e-20, t2 * s2);
    let rp = rs * ((t3 - t4) / (t3 + t4));
    0.5 * (rs + rp)
}

/// The direction `w` goes through a facet `h` (on the side of `w`) into an index `eta` times that of its own
/// side, pointing away from the surface; `None` under total internal reflection.
#[inline]
pub fn refract(w: Vec3, h: Vec3, eta: f32) -> Option<Vec3> {
    let c = w.dot(h);
    let t2 = 1.0 - (1.0 - c * c) / (eta * eta);
    if t2 <= 0.0 {
        return None;
    }
    Some(((c / eta - t2.sqrt()) * h - w / eta).normalize())
}

/// A relative index of facets that is never quite one: there light goes straight on, which is no density.
#[inline]
pub fn apart_from_one(eta: f32) -> f32 {
    if (eta - 1.0).abs() < 5e-3 { 1.005 } else { eta }
}

/// Mean of [`f_dielectric`] over a cosine-weighted hemisphere: what a diffuse flux loses at the boundary. By
/// 64-point Gauss-Legendre quadrature on either side of the critical angle, exact to single precision.
pub fn f_dielectric_diffuse(eta: f32) -> f32 {
    // In s = sin²: ∫ F ds. Beyond the critical angle F = 1.
    let critical = (eta * eta).min(1.0) as f64;
    // s = c (1 − t²) takes out the square root at the upper end.
    let inside = yugen_optics::quadrature::integrate(64, 0.0, 1.0, |t| {
        let s = critical * (1.0 - t * t);
        f_dielectric((1.0 - s).max(0.0).sqrt() as f32, eta) as f64 * 2.0 * t
    });
    (critical * inside + (1.0 - critical)) as f32
}

/// Indices of refraction by name, at the sodium line and room temperature, under the names Mitsuba 3 uses.
pub fn named_ior(name: &str) -> Option<f32> {
    IORS.iter().find(|(known, _)| *known == name).map(|(_, ior)| *ior)
}

/// Every name that [`named_ior`] knows, to suggest from.
pub fn ior_names() -> impl Iterator<Item = &'static str> {
    IORS.iter().map(|(name, _)| *name)
}

// Mitsuba 3 documentation, "Available dielectric materials"; most of them from the CRC Handbook.
const IORS: &[(&str, f32)] = &[
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("water", 1.3330),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.52045),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.470),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.5750),
    ("diamond", 2.419),
];

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::frame::spherical;
    use yugen_optics::quadrature::gauss_legendre;

    const SHAPES: [(Distribution, f32, f32); 6] = [
        (Distribution::Ggx, 0.3, 0.3),
        (Distribution::Ggx, 0.2, 0.6),
        (Distribution::Ggx, 1.0, 1.0),
        (Distribution::Beckmann, 0.3, 0.3),
        (Distribution::Beckmann, 0.2, 0.6),
        (Distribution::Beckmann, 1.0, 1.0),
    ];
    const VIEWS: [(f32, f32); 4] = [(0.0, 0.0), (0.6, 0.4), (1.2, 2.0), (1.5, 4.0)];

    /// ∫ g(h) D(h) cos θ_h dω over slopes stretched to polar coordinates.
    fn over_normals(m: &Microfacets, mut g: impl FnMut(Vec3) -> [f64; 4]) -> [f64; 4] {
        let mut sum = [0.0; 4];
        // ρ = t/(1 − t) maps [0, 1) to all stretched slopes.
        for (t, wt) in gauss_legendre(200, 0.0, 1.0) {
            let rho = t / (1.0 - t);
            for k in 0..200 {
                let phi = std::f64::consts::TAU * (k as f64 + 0.5) / 200.0;
                let (x, y) = (m.ax as f64 * rho * phi.cos(), m.ay as f64 * rho * phi.sin());
                let h = Vec3::new(-x as f32, -y as f32, 1.0).normalize();
                // dω cos θ = cos⁴ θ dx dy
                let jacobian = (m.ax * m.ay) as f64 * rho / ((1.0 - t) * (1.0 - t)) * (h.z as f64).powi(4);
                let w = wt * std::f64::consts::TAU / 200.0 * jacobian * m.d(h) as f64;
                for (s, v) in sum.iter_mut().zip(g(h)) {
                    *s += w * v;
                }
            }
        }
        sum
    }

    #[test]
    fn distributions_are_normalised_and_smith_projects_what_is_seen() {
        for (distribution, ax, ay) in SHAPES {
            let m = Microfacets::new(distribution, Masking::Separable, ax, ay);
            let one = over_normals(&m, |_| [1.0, 0.0, 0.0, 0.0])[0];
            assert!((one - 1.0).abs() < 1e-4, "{m:?}: ∫ D cos = {one}");
            for (theta, phi) in VIEWS {
                let w = spherical(theta, phi);
                // Heitz 2014, eq. 19: what is seen of the facets has the area seen of the plane. The kink at
                // the facets' horizon costs the quadrature 2e-4.
                let seen = over_normals(&m, |h| [(w.dot(h).max(0.0) / h.z) as f64, 0.0, 0.0, 0.0])[0];
                let got = m.g1(w) as f64 * seen;
                assert!((got - w.z as f64).abs() < 5e-4, "{m:?} {theta}: {got} for {}", w.z);
            }
        }
    }

    #[test]
    fn visible_normals_have_the_moments_of_their_density() {
        const N: usize = 256;
        for (distribution, ax, ay) in SHAPES {
            let m = Microfacets::new(distribution, Masking::Separable, ax, ay);
            for (theta, phi) in VIEWS {
                let w = spherical(theta, phi);
                let moments = |h: Vec3| [h.x as f64, h.y as f64, h.z as f64, (h.x * h.y) as f64];
                let expected = over_normals(&m, |h| {
                    moments(h).map(|v| v * (m.g1(w) * w.dot(h).max(0.0) / (w.z * h.z)) as f64)
                });
                let mut got = [0.0; 4];
                for i in 0..N * N {
                    let u = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32;
                    for (s, v) in got.iter_mut().zip(moments(m.sample_visible_normal(w, u))) {
                        *s += v / (N * N) as f64;
                    }
                }
                for (a, b) in got.iter().zip(expected) {
                    assert!((a - b).abs() < 2e-3, "{m:?} {theta}: {got:?} for {expected:?}");
                }
            }
        }
    }

    #[test]
    fn reflection_is_the_product_of_its_terms() {
        for (distribution, ax, ay) in SHAPES {
            for masking in [Masking::Separable, Masking::HeightCorrelated] {
                let m = Microfacets::new(distribution, masking, ax, ay);
                let (wo, wi) = (spherical(0.6, 0.4), spherical(1.1, 2.5));
                let h = (wo + wi).normalize();
                let (f, pdf, cos) = m.reflect(wo, wi);
                assert!((f / (m.d(h) * m.g2(wo, wi) / (4.0 * wo.z * wi.z)) - 1.0).abs() < 1e-5);
                assert!((pdf / (m.pdf_visible_normal(wo, h) / (4.0 * cos)) - 1.0).abs() < 1e-5);
                if distribution == Distribution::Ggx {
                    let v = match masking {
                        Masking::Separable => v_smith_ggx_separable(wo, wi, ax, ay),
                        Masking::HeightCorrelated => v_smith_ggx_correlated(wo, wi, ax, ay),
                    };
                    assert!((f / (m.d(h) * v) - 1.0).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn fresnel_agrees_with_published_values() {
        // Gold, Olmon et al. 2012, at 550 and 450 nm.
        for (eta, k, expected) in [
            (0.3256, 2.507, [0.838056, 0.836299, 0.837190, 0.893226]),
            (1.472, 1.855, [0.383572, 0.391299, 0.416685, 0.606308]),
        ] {
            for (degrees, r) in [0f32, 45.0, 60.0, 80.0].into_iter().zip(expected) {
                let got = f_conductor(degrees.to_radians().cos(), Vec3::splat(eta), Vec3::splat(k));
                assert!((got - r).abs().max_element() < 2e-6, "{eta} {k} {degrees}: {got} for {r}");
            }
        }
        // A conductor that does not absorb is a dielectric; normal incidence and total reflection in closed form.
        for cos in [0.01, 0.3, 0.7, 1.0] {
            assert!((f_conductor(cos, Vec3::splat(1.5), Vec3::ZERO).x - f_dielectric(cos, 1.5)).abs() < 1e-6);
        }
        assert!((f_dielectric(1.0, 1.5) - 0.04).abs() < 1e-7);
        assert_eq!(f_dielectric(0.7, 1.0 / 1.5), 1.0);
        assert!(f_dielectric(0.75, 1.0 / 1.5) < 1.0);
        assert_eq!(refract(spherical(0.8, 0.3), Vec3::Z, 1.0 / 1.5), None);
        // Snell, and the same reflectance from the other side.
        let w = spherical(0.7, 0.3);
        let t = refract(w, Vec3::Z, 1.5).expect("there is no total reflection into glass");
        assert!((t.truncate() * 1.5 + w.truncate()).length() < 1e-6 && t.z < 0.0);
        assert!((f_dielectric(w.z, 1.5) - f_dielectric(-t.z, 1.0 / 1.5)).abs() < 1e-6);
    }

    #[test]
    fn diffuse_fresnel_agrees_with_its_closed_form() {
        // Egan and Hilgeman 1973 give 0.0918 and 0.5963 for n = 1.5 (external and internal).
        assert!((f_dielectric_diffuse(1.5) - 0.0918).abs() < 1e-4, "{}", f_dielectric_diffuse(1.5));
        assert!(
            (f_dielectric_diffuse(1.0 / 1.5) - 0.5963).abs() < 1e-4,
            "{}",
            f_dielectric_diffuse(1.0 / 1.5)
        );
        // The flux through the boundary is the same both ways: 1 − F_int = (1 − F_ext)/n².
        for n in [1.1f32, 1.33, 2.4] {
            let (e, i) = (f_dielectric_diffuse(n), f_dielectric_diffuse(1.0 / n));
            assert!(((1.0 - i) - (1.0 - e) / (n * n)).abs() < 2e-6, "{n}: {e} {i}");
        }
    }

    #[test]
    fn indices_have_names() {
        assert_eq!(named_ior("bk7"), Some(1.5046));
        assert_eq!(named_ior("diamond"), Some(2.419));
        assert_eq!(named_ior("unobtainium"), None);
    }
}
