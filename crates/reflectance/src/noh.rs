//! Wakita et al., "Digital Archiving of Takigi Noh Based on Reflectance Analysis".

use crate::ashikhmin_g;
use crate::ashikhmin_premoze_shirley::f_ashikhmin2000;
use crate::blinn_phong::normaliser;
use crate::gaussian_light::SlopeLobe;
use crate::halfway::{
    half_vector, lobe_share, pdf_cosine_power, pdf_gaussian_reflection, pdf_reflected, reflect,
    sample_cosine_power, sample_gaussian_reflection, squared_slope,
};
use crate::microfacet::{Distribution, Masking, Microfacets, schlick_weight};
use crate::model::{Choice, Laws, Model, ModelError, Preset, Sample, Spec, params};
use crate::ward::{WHY_UNBOUNDED, f_duer, f_gmd};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};
use yugen_optics::ColourSpace;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// The Noh costume: silk as a ground, gold thread as an anisotropic highlight, per texel.
    pub struct Noh {
        rho_d: Vec3 = Spec::colour([0.35, 0.06, 0.04], 0.0, 1.0, "", "ρ_d, albedo of the ground"),
        rho_s: Vec3 = Spec::colour([0.55, 0.42, 0.2], 0.0, 1.0, "",
            "ρ_s, albedo of the highlight, nearly; in the paper form the height of the peak as Eq. \
                4 has it"),
        sigma_x: f32 = Spec::num(0.15, 0.02, 1.0, "", "σ_x along the tangent t: the root mean \
            square slope times √2"),
        sigma_y: f32 = Spec::num(0.4, 0.02, 1.0, "", "σ_y across the tangent"),
        grazing: f32 = Spec::num(0.0, 0.0, 1.0, "",
            "how far ρ_s rises to white at grazing light (Schlick); forms ashikhmin2000, beckmann and ggx"),
        form: Choice = Spec::choice(0,
            &["ward_gmd", "paper", "ward_duer", "ashikhmin2000", "beckmann", "ggx", "blinn_phong"],
            "how the same numbers become a highlight; paper is Eq. 3-4 to the letter"),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Form {
    WardGmd,
    Paper,
    WardDuer,
    Ashikhmin2000,
    Beckmann,
    Ggx,
    BlinnPhong,
}

impl Noh {
    /// The form `paper`.
    pub const PAPER: Choice = Choice(1.0);

    fn form(&self) -> Form {
        match self.form.index() {
            0 => Form::WardGmd,
            1 => Form::Paper,
            2 => Form::WardDuer,
            3 => Form::Ashikhmin2000,
            4 => Form::Beckmann,
            5 => Form::Ggx,
            _ => Form::BlinnPhong,
        }
    }

    /// The albedo ρ_s that gives the paper's peak height (Eq. 4) at these widths, for a texture that was fitted to
    /// Eq. 3-4 and is to drive another form: Eq. 3-4 is Ward-Dür with ρ_s/(4π σ_x σ_y) for ρ_s.
    pub fn albedo_of_peak(peak: Vec3, sigma_x: f32, sigma_y: f32) -> Vec3 {
        peak * (4.0 * PI * sigma_x * sigma_y)
    }

    fn microfacets(&self) -> Microfacets {
        let distribution =
            if self.form() == Form::Beckmann { Distribution::Beckmann } else { Distribution::Ggx };
        Microfacets::new(distribution, Masking::HeightCorrelated, self.sigma_x, self.sigma_y)
    }

    /// The exponent of an isotropic lobe as wide: cosⁿ α ≈ exp(−n α²/2) against exp(−α²/σ²).
    fn exponent(&self) -> f32 {
        2.0 / (self.sigma_x * self.sigma_y)
    }

    /// Schlick's rise of ρ_s, the part that `grazing` asks for.
    fn f(&self, cos: f32) -> Vec3 {
        self.rho_s + (Vec3::ONE - self.rho_s) * (self.grazing * schlick_weight(cos))
    }

    fn highlight(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        let (sx, sy) = (self.sigma_x, self.sigma_y);
        let (h, cos) = half_vector(wo, wi);
        match self.form() {
            Form::WardGmd => self.rho_s * f_gmd(wo, wi, sx, sy),
            // Equations 3 and 4; 1e-18 keeps directions in the horizon finite.
            Form::Paper => self.rho_s * ((-squared_slope(h, sx, sy)).exp() / (wo.z * wi.z).max(1e-18)),
            Form::WardDuer => self.rho_s * f_duer(wo, wi, sx, sy),
            Form::Ashikhmin2000 => self.f(cos) * f_ashikhmin2000(table, wo, wi, sx, sy, None),
            Form::Beckmann | Form::Ggx => self.f(cos) * self.microfacets().reflect(wo, wi).0,
            Form::BlinnPhong => {
                let n = self.exponent();
                self.rho_s * (normaliser(n) * h.z.min(1.0).powf(n))
            }
        }
    }

    fn highlight_pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self.form() {
            Form::Beckmann | Form::Ggx => self.microfacets().reflect(wo, wi).1,
            Form::BlinnPhong => {
                let (h, cos) = half_vector(wo, wi);
                pdf_reflected(pdf_cosine_power(h.z.min(1.0), self.exponent()), cos)
            }
            _ => pdf_gaussian_reflection(wo, wi, self.sigma_x, self.sigma_y),
        }
    }

    fn share(&self) -> f32 {
        // With a rise even a dark highlight is bright at grazing angles: at least a tenth of it.
        lobe_share(self.rho_s.max(Vec3::splat(0.1 * self.grazing)), self.rho_d)
    }
}

impl Model for Noh {
    const NAME: &'static str = "noh";
    const SOURCE: &'static str = "Wakita, Tanaka, Furukawa, Hachimura and Tanaka, Digital Archiving of \
        Takigi Noh Based on Reflectance Analysis; after Ashikhmin, Premože and Shirley 2000";
    const DOC: &'static str = "Gold brocade on silk, as measured for a Noh costume: diffuse albedo, \
        highlight, tangent and two widths per texel. Every form reads the same numbers. paper is the \
        published Eq. 3-4, P = ρ_s exp(−tan² θ_h(…))/(cos cos): exactly Ward-Dür times 4π σ_x σ_y, with no \
        normaliser, no Fresnel, no shadowing, so that wide highlights return more light than arrives and \
        every highlight does at the rim. Its σ is √2 times a standard deviation of slope. ward_duer only \
        mends the normaliser. ward_gmd, the default, is its nearest relative with a bounded albedo and is \
        what a fit to the paper's measurements should be shown with. ashikhmin2000 is the model the paper \
        names (its table is for constant σ). beckmann and ggx add Smith's masking and, through `grazing`, \
        Fresnel. blinn_phong is the paper's isotropic baseline, with an exponent 2/(σ_x σ_y) where the \
        paper writes ρ_s. The paper measures with the eye head on, so half vectors beyond 45°, and with \
        them σ above 0.8, masking and Fresnel, are extrapolation. A surface model: light through the cloth \
        and the relief of the threads are not in it.";
    const LAWS: Laws = Laws { isotropic: false, ..Laws::PHYSICAL };
    const WGSL: &'static str = include_str!("noh.wgsl");
    // Worst 4.4e-4: pow(c, n) of the baseline with n up to 5000.
    const TWIN: (f32, f32) = (2e-3, 1e-5);
    const PRESETS: &'static [Preset] = &[
        Preset {
            name: "gold_thread",
            doc: "Flat gold thread: no ground, gold of Olmon 2012, narrow \
            across its length",
        },
        Preset {
            name: "vermilion_silk",
            doc: "Vermilion satin silk: a deep ground with a broad \
            white sheen (estimated by eye)",
        },
    ];

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let base = <Self as crate::Params>::defaults();
        let from_srgb = |c: Vec3| (ColourSpace::LinearSrgb.matrix_to(space) * c).clamp(Vec3::ZERO, Vec3::ONE);
        let model = match name {
            // Linear sRGB (1.0427, 0.7740, 0.3346) is outside sRGB and inside Rec.2020.
            "gold_thread" => Self {
                rho_d: Vec3::ZERO,
                rho_s: from_srgb(Vec3::new(1.0427, 0.7740, 0.3346)),
                sigma_x: 0.35,
                sigma_y: 0.12,
                ..base
            },
            "vermilion_silk" => Self {
                rho_d: from_srgb(Vec3::new(0.5, 0.06, 0.03)),
                rho_s: Vec3::splat(0.12),
                sigma_x: 0.25,
                sigma_y: 0.5,
                ..base
            },
            _ => return None,
        };
        Some((model, Vec::new()))
    }

    fn bake(&self, _: &[f32]) -> Result<Vec<f32>, ModelError> {
        match self.form() {
            Form::Ashikhmin2000 => ashikhmin_g::bake(self.sigma_x, self.sigma_y),
            _ => Ok(Vec::new()),
        }
    }

    fn laws(&self) -> Laws {
        let bounded = !matches!(self.form(), Form::Paper | Form::WardDuer);
        let rises = matches!(self.form(), Form::Ashikhmin2000 | Form::Beckmann | Form::Ggx);
        // What the highlight may reach at most.
        let highlight = if rises { self.f(0.0) } else { self.rho_s };
        let shared = (self.rho_d + highlight).max_element() <= 1.0;
        Laws {
            conserves_energy: bounded && shared,
            isotropic: self.sigma_x == self.sigma_y || self.form() == Form::BlinnPhong,
            why: match (bounded, shared) {
                (true, true) => "",
                (false, _) => WHY_UNBOUNDED,
                (true, false) => "the albedos of ground and highlight add up to more than one",
            },
            ..Laws::PHYSICAL
        }
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        self.rho_d * FRAC_1_PI + self.highlight(table, wo, wi)
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let share = self.share();
        share * self.highlight_pdf(wo, wi) + (1.0 - share) * cosine_hemisphere_pdf(wi)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let share = self.share();
        if u.z >= share {
            return Sample::of(self, table, wo, cosine_hemisphere(u.truncate()));
        }
        let wi = match self.form() {
            Form::Beckmann | Form::Ggx => self.microfacets().sample_reflection(wo, u.truncate()),
            Form::BlinnPhong => {
                let h = sample_cosine_power(u.truncate(), self.exponent());
                // Seen from behind a facet reflects nothing.
                if h.dot(wo) <= 0.0 {
                    return None;
                }
                reflect(wo, h)
            }
            _ => sample_gaussian_reflection(wo, u.with_z(u.z / share), self.sigma_x, self.sigma_y),
        };
        Sample::of(self, table, wo, wi)
    }

    fn slope_lobe(&self, _: &[f32], _: Vec3, _: Vec3) -> Option<SlopeLobe> {
        let lobe = match self.form() {
            Form::Ggx => self.microfacets().slope_lobe(),
            Form::BlinnPhong => {
                let alpha = (2.0 / self.exponent()).sqrt();
                SlopeLobe::gaussian(alpha, alpha)
            }
            _ => SlopeLobe::gaussian(self.sigma_x, self.sigma_y),
        };
        Some(lobe.over(self.rho_d))
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        (self.rho_d + self.rho_s).min(Vec3::ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;
    use crate::furnace::{albedo, assert_albedos, assert_samples, worst_reciprocity};
    use yugen_optics::frame::spherical;

    fn white(form: Form, sigma_x: f32, sigma_y: f32) -> (Noh, Vec<f32>) {
        let m = Noh {
            rho_d: Vec3::ZERO,
            rho_s: Vec3::ONE,
            sigma_x,
            sigma_y,
            grazing: 0.0,
            form: Choice(form as u32 as f32),
        };
        assert!(m.form() == form);
        (m, m.bake(&[]).unwrap())
    }

    const ALL: [Form; 7] = [
        Form::WardGmd,
        Form::Paper,
        Form::WardDuer,
        Form::Ashikhmin2000,
        Form::Beckmann,
        Form::Ggx,
        Form::BlinnPhong,
    ];

    #[test]
    fn equation_3_is_ward_duer_times_four_pi_sigma_x_sigma_y() {
        for (sx, sy) in [(0.1f32, 0.5f32), (0.3, 0.3), (0.9, 0.2)] {
            let ((paper, _), (duer, _)) = (white(Form::Paper, sx, sy), white(Form::WardDuer, sx, sy));
            // As written: D(θ_h, φ_h) by its angles, over the cosines.
            let literal = |wo: Vec3, wi: Vec3| {
                let h = (wo + wi).normalize();
                let (tan2, phi) = ((1.0 - h.z * h.z) / (h.z * h.z), h.y.atan2(h.x));
                let d = (-tan2 * ((phi.cos() / sx).powi(2) + (phi.sin() / sy).powi(2))).exp();
                d / (wi.z * wo.z)
            };
            for i in 0..200 {
                let wo = spherical(0.007 * i as f32, 1.1 * i as f32);
                let wi = spherical(1.4 - 0.0069 * i as f32, 2.7 * i as f32);
                let p = paper.eval(&[], wo, wi).x;
                let d = duer.eval(&[], wo, wi).x * 4.0 * PI * sx * sy;
                assert!((p - d).abs() <= 2e-5 * p, "{p} {d}");
                assert!((p - literal(wo, wi)).abs() <= 1e-3 * p + 1e-6, "{p} {}", literal(wo, wi));
            }
            let peak = Vec3::new(2.0, 1.5, 0.7);
            let converted = Noh { rho_s: Noh::albedo_of_peak(peak, sx, sy), ..duer };
            assert!((converted.eval(&[], Vec3::Z, Vec3::Z) - peak).abs().max_element() < 1e-5);
        }
    }

    #[test]
    fn head_on_every_form_has_the_same_peak() {
        let want = 1.0 / (4.0 * PI * 0.1 * 0.3);
        for form in ALL {
            let (m, table) = white(form, 0.1, 0.3);
            let got = m.eval(&table, Vec3::Z, Vec3::Z).x * if form == Form::Paper { want } else { 1.0 };
            // Ashikhmin's normaliser N1 differs from π σx σy, and Blinn's from n/8π, by the width squared.
            let slack = if matches!(form, Form::Ashikhmin2000 | Form::BlinnPhong) { 0.1 } else { 1e-5 };
            assert!((got / want - 1.0).abs() < slack, "form {}: {got} {want}", form as u32);
        }
    }

    #[test]
    fn forms_have_the_published_albedos() {
        let at = |a: [f64; 4]| -> Vec<_> { [0.0, 30.0, 60.0, 80.0].into_iter().zip(a).collect() };
        let (m, t) = white(Form::WardDuer, 0.1, 0.1);
        assert_albedos(&m, &t, 0.0, &at([0.98058, 0.98058, 0.98054, 0.94750]), 2e-5);
        let (m, t) = white(Form::WardDuer, 0.1, 0.5);
        assert_albedos(&m, &t, 90.0, &at([0.8227, 0.8101, 0.7857, 1.0382]), 1e-4);
        let (m, t) = white(Form::WardGmd, 0.1, 0.5);
        assert_albedos(&m, &t, 90.0, &at([0.871, 0.842, 0.786, 0.806]), 6e-4);
        let (m, t) = white(Form::Ashikhmin2000, 0.1, 0.5);
        assert_albedos(&m, &t, 90.0, &at([0.9945, 0.9672, 0.9088, 0.9299]), 1e-4);
        let (m, t) = white(Form::Ggx, 0.1, 0.5);
        assert_albedos(&m, &t, 0.0, &at([0.81807, 0.81646, 0.80427, 0.75382]), 3e-5);
        assert_albedos(&m, &t, 90.0, &[(60.0, 0.80576), (80.0, 0.87776)], 3e-5);
        let (m, t) = white(Form::Beckmann, 0.3, 0.3);
        assert_albedos(&m, &t, 0.0, &at([0.99971, 0.99145, 0.92329, 0.91634]), 3e-4);
        // Head on Eq. 3-4 returns ρ_s 4 N1(σ) while the highlight is narrow, N1 = 0.24211757 for σ = 0.3; it has no
        // normaliser, so a wide one returns more than arrives.
        let (m, t) = white(Form::Paper, 0.3, 0.3);
        assert!((albedo(&m, &t, 0.0, 0.0, 200) - 4.0 * 0.24211757).abs() < 1e-4);
        let (m, t) = white(Form::Paper, 0.6, 0.6);
        assert!(albedo(&m, &t, 0.0, 0.0, 200) > 2.5);
    }

    #[test]
    fn corrected_forms_keep_within_their_albedos_even_with_a_rise() {
        for form in ALL.into_iter().filter(|f| !matches!(f, Form::Paper | Form::WardDuer)) {
            let (mut m, table) = white(form, 0.2, 0.6);
            (m.rho_d, m.rho_s, m.grazing) = (Vec3::ZERO, Vec3::splat(0.3), 1.0);
            assert!(m.laws().conserves_energy);
            for theta in [0.0, 60.0, 80.0] {
                assert!(albedo(&m, &table, theta, 30.0, 150) < 1.0 + 1e-4);
            }
        }
        assert!(!white(Form::Paper, 0.2, 0.6).0.laws().conserves_energy);
    }

    #[test]
    fn every_form_is_reciprocal_and_sampled() {
        for form in ALL {
            let (m, table) = white(form, 0.2, 0.5);
            let m = Noh { rho_d: Vec3::splat(0.3), rho_s: Vec3::splat(0.6), grazing: 0.5, ..m };
            assert!(worst_reciprocity(&m, &table) < 1e-4, "form {}", form as u32);
            let scale = if form == Form::Paper { 1.3 } else { 1.0 };
            assert_samples(&m, &table, Vec3::new(0.36, 0.48, 0.8), 4e-3 * scale);
        }
    }

    #[test]
    fn presets_are_what_they_are_called() {
        for space in ColourSpace::ALL {
            for p in Noh::PRESETS {
                let (m, _) = Noh::preset(p.name, space).unwrap();
                assert!(m.laws().conserves_energy, "{} in {}", p.name, space.name());
            }
        }
        assert!(Noh::preset("linen", ColourSpace::LinearSrgb).is_none());
        let (gold, _) = Noh::preset("gold_thread", ColourSpace::LinearRec2020).unwrap();
        // Gold head on under D65, Olmon 2012.
        assert!(
            (gold.rho_s - Vec3::new(0.9236, 0.7875, 0.3848)).abs().max_element() < 2e-4,
            "{}",
            gold.rho_s
        );
        assert!(Noh::defaults().laws().conserves_energy);
    }
}
