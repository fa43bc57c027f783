//! Cook and Torrance 1982, "A Reflectance Model for Computer Graphics".

use crate::gaussian_light::SlopeLobe;
use crate::halfway::{
    g_grooves, half_vector, lobe_share, pdf_gaussian_reflection, sample_gaussian_reflection, v_grooves,
};
use crate::microfacet::{d_beckmann, f_dielectric};
use crate::model::{Choice, Laws, Model, Preset, Sample, Spec, Terms, params};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use yugen_optics::ColourSpace;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Beckmann's facets in V-shaped grooves, with a Fresnel term for metals, over a Lambertian ground.
    pub struct CookTorrance {
        f0: Vec3 = Spec::colour([0.95, 0.64, 0.54], 0.0, 1.0, "", "reflectance head on; the index \
            of refraction follows from it"),
        m: f32 = Spec::num(0.3, 0.01, 1.0, "", "root mean square slope of the facets times √2"),
        s: f32 = Spec::num(1.0, 0.0, 1.0, "", "share of the highlight; the ground has d = 1 − s"),
        diffuse: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "R_d, albedo of the ground"),
        form: Choice = Spec::choice(0, &["normalised", "published"],
            "normalised: F D G/(4 cos cos); published: F D G/(π cos cos) with D = exp(−tan² \
                α/m²)/(m² cos⁴ α)"),
    }
}

impl CookTorrance {
    /// The paper's way to colour: the index that gives `f0` head on, then the equation of a dielectric.
    fn f(&self, cos: f32) -> Vec3 {
        let channel = |f0: f32| {
            // 1 − 1e-6: an index of two million for a perfect mirror.
            let root = f0.max(0.0).sqrt().min(1.0 - 1e-6);
            f_dielectric(cos, (1.0 + root) / (1.0 - root))
        };
        Vec3::new(channel(self.f0.x), channel(self.f0.y), channel(self.f0.z))
    }

    /// The share of draws for the highlight.
    fn share(&self) -> f32 {
        // At grazing angles even a dark mirror is bright: at least a tenth of the draws.
        lobe_share(self.s * self.f0.max(Vec3::splat(0.1)), (1.0 - self.s) * self.diffuse)
    }
}

impl Model for CookTorrance {
    const NAME: &'static str = "cook_torrance";
    const SOURCE: &'static str = "Cook and Torrance 1982, A Reflectance Model for Computer Graphics";
    const DOC: &'static str = "The model that made copper look like copper and not like plastic: \
        Beckmann's distribution, the groove masking of torrance_sparrow, and a Fresnel term whose colour \
        shifts to white at grazing angles. Right: the shape and the growing brightness of highlights on \
        moderately rough metals. Wrong: the index is guessed from the reflectance head on as for a \
        dielectric, whose Brewster angle then lies a degree or two above the horizon and takes half of a \
        bright metal's light there, where real metals dip gently (see conductor), G has a kink, and light \
        between the facets is lost beyond m = 0.4 (a fifth at m = 0.6). The published form has 1/π where \
        1/4 belongs (a D without its 1/π): it is four times too bright.";
    const LAWS: Laws = Laws::PHYSICAL;
    const PRESETS: &'static [Preset] = &[
        Preset {
            name: "copper",
            doc: "copper's reflectance head on under D65; the roughness is a satin finish, chosen by eye",
        },
        Preset { name: "black_rubber", doc: "a dark ground under a rough dielectric film, chosen by eye" },
    ];
    const WGSL: &'static str = include_str!("cook_torrance.wgsl");
    // Worst 1.1e-6.
    const TWIN: (f32, f32) = (1e-5, 1e-5);

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let base = <Self as crate::Params>::defaults();
        let copper = ColourSpace::LinearSrgb.matrix_to(space) * Vec3::new(0.955, 0.638, 0.538);
        let model = match name {
            "copper" => Self { f0: copper.clamp(Vec3::ZERO, Vec3::ONE), m: 0.25, ..base },
            "black_rubber" => {
                Self { f0: Vec3::splat(0.04), m: 0.45, s: 0.6, diffuse: Vec3::splat(0.03), ..base }
            }
            _ => return None,
        };
        Some((model, Vec::new()))
    }

    fn laws(&self) -> Laws {
        match self.form.index() {
            0 => Laws::PHYSICAL,
            _ => Laws {
                conserves_energy: false,
                why: "1/π for 1/4 with a D that lacks its 1/π: \
                four times too bright",
                ..Laws::PHYSICAL
            },
        }
    }

    fn eval(&self, _: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        let (h, cos) = half_vector(wo, wi);
        let scale = match self.form.index() {
            0 => 1.0,
            // v_grooves has the 1/4; the 1/π of the paper is the one that its D lacks.
            _ => 4.0,
        };
        let highlight = scale * d_beckmann(h, self.m, self.m) * v_grooves(wo, wi, h, cos);
        self.f(cos) * (self.s * highlight) + self.diffuse * ((1.0 - self.s) * FRAC_1_PI)
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let share = self.share();
        share * pdf_gaussian_reflection(wo, wi, self.m, self.m) + (1.0 - share) * cosine_hemisphere_pdf(wi)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        let share = self.share();
        if u.z >= share {
            return Sample::of(self, table, wo, cosine_hemisphere(u.truncate()));
        }
        Sample::of(self, table, wo, sample_gaussian_reflection(wo, u.with_z(u.z / share), self.m, self.m))
    }

    fn slope_lobe(&self, _: &[f32], _: Vec3, _: Vec3) -> Option<SlopeLobe> {
        Some(SlopeLobe::gaussian(self.m, self.m).over(self.diffuse * (1.0 - self.s)))
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.f0 * self.s + self.diffuse * (1.0 - self.s)
    }

    /// Those of the highlight.
    fn terms(&self, wo: Vec3, wi: Vec3) -> Option<Terms> {
        let (h, cos) = half_vector(wo, wi);
        // As printed, D lacks its 1/π.
        let scale = if self.form.index() == 0 { 1.0 } else { std::f32::consts::PI };
        let d = scale * d_beckmann(h, self.m, self.m);
        Some(Terms { d, g: g_grooves(wo, wi, h, cos), f: self.f(cos) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;
    use crate::furnace::{assert_albedos, assert_samples, worst_reciprocity};

    fn white(m: f32, form: u32) -> CookTorrance {
        CookTorrance { f0: Vec3::ONE, m, s: 1.0, diffuse: Vec3::ZERO, form: Choice(form as f32) }
    }

    #[test]
    fn the_published_form_is_four_times_too_bright() {
        assert_albedos(&white(0.3, 1), &[], 0.0, &[(0.0, 4.0 * 0.99558)], 1e-4);
    }

    #[test]
    fn colour_is_f0_head_on_and_white_in_the_horizon_but_dips_between() {
        let copper = CookTorrance::defaults();
        assert!((copper.f(1.0) - copper.f0).abs().max_element() < 1e-4, "{}", copper.f(1.0));
        assert!((copper.f(0.0) - Vec3::ONE).abs().max_element() < 1e-6);
        // Brewster's angle of the borrowed dielectric: half of the red is gone where tan θ = n = 78.
        assert!(copper.f(1.0 / 78.0).x < 0.51);
    }

    #[test]
    fn both_lobes_are_reciprocal_and_sampled() {
        for form in 0..2 {
            let m = CookTorrance { s: 0.4, form: Choice(form as f32), ..CookTorrance::defaults() };
            assert!(worst_reciprocity(&m, &[]) < 1e-4);
            assert_samples(&m, &[], Vec3::new(0.0, 0.8, 0.6), 4e-3);
        }
        assert!(CookTorrance::preset("copper", ColourSpace::LinearRec2020).is_some());
    }
}
