//! Oren and Nayar 1994, "Generalization of Lambert's Reflectance Model".

use crate::model::{Choice, Laws, Model, Sample, Spec, params};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Rough diffuse reflection: V-shaped cavities with Lambertian walls.
    pub struct OrenNayar {
        reflectance: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "albedo of the cavity walls"),
        sigma: f32 = Spec::num(0.35, 0.0, 1.0, "rad", "standard deviation of the slope angle of the \
            cavities"),
        form: Choice = Spec::choice(0, &["energy_preserving", "full", "qualitative"],
            "energy_preserving: Portsmouth, Kutz and Hill 2025; full: 1994 with interreflection; \
             qualitative: 1994, the short form"),
    }
}

// Albedo of Fujii's lobe 1 + r s/t with white walls (Portsmouth et al. 2025): 1 + (1/2 − 2/(3π)) r at grazing
// incidence, where it is largest and set to one; 1 + (2/3 − 28/(15π)) r as a mean over the hemisphere.
const GRAZING_SHARE: f32 = 0.5 - 2.0 / (3.0 * PI);
const MEAN_SHARE: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// The factors A and B of the qualitative form.
fn qualitative_factors(sigma: f32) -> (f32, f32) {
    let s2 = sigma * sigma;
    (1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09))
}

/// Directional albedo of Fujii's lobe for white walls, exact.
fn fujii_albedo(cos: f32, r: f32) -> f32 {
    let a = 1.0 / (1.0 + GRAZING_SHARE * r);
    // (sin/cos)(1 − sin³) without the cancellation: (1 − s³) = c²(1 + s + s²)/(1 + s).
    let s = (1.0 - cos * cos).max(0.0).sqrt();
    let tail = s * cos * (1.0 + s + s * s) / (1.0 + s) - s;
    let g = s * (s.atan2(cos) - s * cos) + 2.0 / 3.0 * tail;
    a * (1.0 + r * FRAC_1_PI * g)
}

/// Fujii's lobe, made white by the light it loses (Portsmouth, Kutz and Hill 2025, "EON").
#[inline]
pub(crate) fn f_energy_preserving(reflectance: Vec3, sigma: f32, wo: Vec3, wi: Vec3) -> Vec3 {
    // The same slope of the lobe as the qualitative form: r = B/A.
    let (a, b) = qualitative_factors(sigma);
    let r = b / a;
    let scale = 1.0 / (1.0 + GRAZING_SHARE * r);
    let s = wo.x * wi.x + wo.y * wi.y;
    let s_over_t = if s > 0.0 { s / wo.z.max(wi.z) } else { s };
    let single = reflectance * (FRAC_1_PI * scale * (1.0 + r * s_over_t));
    let mean = scale * (1.0 + MEAN_SHARE * r);
    let lost = (1.0 - fujii_albedo(wo.z, r)).max(0.0) * (1.0 - fujii_albedo(wi.z, r)).max(0.0);
    // For r = 0 nothing is lost and nothing is given back.
    let shape = lost / (1.0 - mean).max(1e-6);
    let colour = reflectance * reflectance * mean / (Vec3::ONE - reflectance * (1.0 - mean));
    single + colour * (FRAC_1_PI * shape)
}

impl OrenNayar {
    /// Equations 30: direct light with three terms, and one bounce between the walls.
    fn full(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let (sin_o, sin_i) = (wo.truncate().length(), wi.truncate().length());
        let (theta_o, theta_i) = (sin_o.atan2(wo.z), sin_i.atan2(wi.z));
        let (alpha, beta) = (theta_o.max(theta_i), theta_o.min(theta_i));
        let both = sin_o * sin_i;
        let cos_phi = if both > 1e-12 { ((wo.x * wi.x + wo.y * wi.y) / both).clamp(-1.0, 1.0) } else { 0.0 };
        let s2 = self.sigma * self.sigma;
        let rough = s2 / (s2 + 0.09);
        let c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
        let b = 2.0 * beta * FRAC_1_PI;
        let c2 = 0.45 * rough * (alpha.sin() - if cos_phi < 0.0 { b * b * b } else { 0.0 });
        let c3 = 4.0 * alpha * beta * FRAC_1_PI * FRAC_1_PI;
        let c3 = 0.125 * rough * c3 * c3;
        let direct =
            c1 + c2 * cos_phi * beta.tan() + c3 * (1.0 - cos_phi.abs()) * (0.5 * (alpha + beta)).tan();
        let bounce = 0.17 * s2 / (s2 + 0.13) * (1.0 - cos_phi * b * b);
        // The fit turns negative where eye and light graze from opposite sides.
        self.reflectance * FRAC_1_PI * (direct.max(0.0) + self.reflectance * bounce)
    }

    fn qualitative(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let (a, b) = qualitative_factors(self.sigma);
        // cos Δφ sin α tan β = (projected product) / (the larger cosine).
        let s = (wo.x * wi.x + wo.y * wi.y).max(0.0);
        self.reflectance * (FRAC_1_PI * (a + b * s / wo.z.max(wi.z)))
    }
}

impl Model for OrenNayar {
    const NAME: &'static str = "oren_nayar";
    const SOURCE: &'static str = "Oren and Nayar 1994, Generalization of Lambert's Reflectance Model; \
        Portsmouth, Kutz and Hill 2025, EON: A Practical Energy-Preserving Rough Diffuse BRDF";
    const DOC: &'static str = "Clay, sand, the full moon: rough and dull. Towards the light the walls that \
        face it hide the dark ones, so the rim of a sphere stays bright where Lambert's falls off; sigma = \
        0 is Lambert. energy_preserving keeps the shape of the lobe and returns every bounce, coloured \
        deeper than the walls, so that white walls make a white surface. full and qualitative are the \
        equations of 1994: at sigma = 0.35 and white walls they lose 5 and 13 % head on, and both can \
        return more than arrived at grazing angles (by up to 5 % near sigma = 0.3, and 1.5 % near 0.2). \
        None of them knows of light that travels inside the material.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("oren_nayar.wgsl");
    // Worst 9e-5, where terms of the full form cancel against the light.
    const TWIN: (f32, f32) = (4e-4, 1e-6);

    fn laws(&self) -> Laws {
        match self.form.index() {
            0 => Laws::PHYSICAL,
            _ => Laws {
                conserves_energy: false,
                why: "the fits of 1994 exceed one by a few per cent for white walls at grazing angles",
                ..Laws::PHYSICAL
            },
        }
    }

    fn eval(&self, _: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        match self.form.index() {
            0 => f_energy_preserving(self.reflectance, self.sigma, wo, wi),
            1 => self.full(wo, wi),
            _ => self.qualitative(wo, wi),
        }
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 {
            return 0.0;
        }
        cosine_hemisphere_pdf(wi)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        Sample::of(self, table, wo, cosine_hemisphere(u.truncate()))
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.reflectance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;
    use crate::furnace::{albedo, assert_albedos, assert_samples, worst_reciprocity};

    fn white(form: u32, sigma: f32) -> OrenNayar {
        OrenNayar { reflectance: Vec3::ONE, sigma, form: Choice(form as f32) }
    }

    #[test]
    fn full_form_has_the_albedos_of_an_independent_double_precision_quadrature() {
        let at = [(0.0, 0.94742), (30.0, 0.94976), (60.0, 0.97142), (80.0, 1.00883)];
        assert_albedos(&white(1, 20f32.to_radians()), &[], 0.0, &at, 3e-5);
    }

    #[test]
    fn energy_preserving_form_is_white_at_every_angle_and_lambert_without_roughness() {
        for sigma in [0.0, 0.05, 0.2, 0.5, 1.0] {
            for theta in [0.0, 30.0, 60.0, 80.0, 88.0] {
                let got = albedo(&white(0, sigma), &[], theta, 0.0, 200);
                assert!((got - 1.0).abs() < 2e-4, "σ {sigma}, {theta}°: {got}");
            }
        }
        let smooth = OrenNayar { sigma: 0.0, ..OrenNayar::defaults() };
        for (form, theta) in [(0, 0.1f32), (1, 0.9), (2, 1.4)] {
            let m = OrenNayar { form: Choice(form as f32), ..smooth };
            let f = m.eval(&[], Vec3::new(theta.sin(), 0.0, theta.cos()), Vec3::new(0.0, 0.6, 0.8)).x;
            assert!((f - 0.5 * FRAC_1_PI).abs() < 1e-6, "{f}");
        }
    }

    #[test]
    fn coloured_walls_deepen_with_every_bounce() {
        let m = OrenNayar { reflectance: Vec3::new(0.8, 0.4, 0.1), sigma: 0.5, form: Choice(0.0) };
        // The single bounce alone is 0.8 : 0.4; with the rest red must gain on green.
        let f = m.eval(&[], Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
        assert!(f.x / f.y > 2.0 && f.y / f.z > 4.0, "{f}");
    }

    #[test]
    fn forms_are_reciprocal_and_sampled() {
        for form in 0..3 {
            let m = white(form, 0.5);
            assert!(worst_reciprocity(&m, &[]) < 1e-5);
            assert_samples(&m, &[], Vec3::new(0.6, 0.0, 0.8), 1e-3);
        }
    }
}
