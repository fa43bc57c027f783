//! Shafer 1985, "Using Color to Separate Reflection Components".

use crate::blinn_phong::normaliser;
use crate::halfway::{
    half_vector, lobe_share, pdf_cosine_power, pdf_gaussian_reflection, pdf_reflected, reflect,
    sample_cosine_power, sample_gaussian_reflection, v_grooves,
};
use crate::microfacet::{Distribution, Masking, Microfacets, d_beckmann, f_dielectric};
use crate::model::{Choice, Laws, Model, Sample, Spec, params};
use crate::oren_nayar::f_energy_preserving;
use crate::ward::f_gmd;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Body reflection in the colour of the object plus interface reflection in the colour of the light.
    pub struct Dichromatic {
        body_colour: Vec3 = Spec::colour([0.6, 0.05, 0.04], 0.0, 1.0, "", "c_b: what comes back \
            from inside, the colour of the object"),
        interface_colour: Vec3 = Spec::rgb(0.4, 0.0, 1.0, "", "c_i: what the border returns; grey, \
            so that it keeps the colour of the light"),
        body_form: Choice = Spec::choice(0, &["lambert", "oren_nayar"], "geometry m_b of the body \
            reflection"),
        interface_form: Choice = Spec::choice(0, &["blinn_phong", "torrance_sparrow", "ward", "ggx"],
            "geometry m_i of the interface reflection; torrance_sparrow and ggx contain Fresnel's \
                factor for eta"),
        sigma: f32 = Spec::num(0.35, 0.0, 1.0, "rad", "roughness of the body, for oren_nayar"),
        roughness: f32 = Spec::num(0.15, 0.02, 1.0, "",
            "slope of the interface (root mean square times √2), for all four: Blinn-Phong's n is \
                2/roughness²"),
        eta: f32 = Spec::num(1.5, 1.0, 4.0, "", "index of refraction, for torrance_sparrow and ggx"),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Interface {
    BlinnPhong,
    TorranceSparrow,
    Ward,
    Ggx,
}

impl Dichromatic {
    fn interface(&self) -> Interface {
        match self.interface_form.index() {
            0 => Interface::BlinnPhong,
            1 => Interface::TorranceSparrow,
            2 => Interface::Ward,
            _ => Interface::Ggx,
        }
    }

    fn exponent(&self) -> f32 {
        2.0 / (self.roughness * self.roughness)
    }

    fn microfacets(&self) -> Microfacets {
        Microfacets::new(Distribution::Ggx, Masking::HeightCorrelated, self.roughness, self.roughness)
    }

    /// c_b m_b
    fn f_body(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        match self.body_form.index() {
            0 => self.body_colour * FRAC_1_PI,
            _ => f_energy_preserving(self.body_colour, self.sigma, wo, wi),
        }
    }

    /// m_i, a number: the interface has no colour of its own.
    fn f_interface(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (h, cos) = half_vector(wo, wi);
        match self.interface() {
            Interface::BlinnPhong => normaliser(self.exponent()) * h.z.min(1.0).powf(self.exponent()),
            Interface::TorranceSparrow => {
                d_beckmann(h, self.roughness, self.roughness)
                    * v_grooves(wo, wi, h, cos)
                    * f_dielectric(cos, self.eta)
            }
            Interface::Ward => f_gmd(wo, wi, self.roughness, self.roughness),
            Interface::Ggx => self.microfacets().reflect(wo, wi).0 * f_dielectric(cos, self.eta),
        }
    }

    fn pdf_interface(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self.interface() {
            Interface::BlinnPhong => {
                let (h, cos) = half_vector(wo, wi);
                pdf_reflected(pdf_cosine_power(h.z.min(1.0), self.exponent()), cos)
            }
            Interface::Ggx => self.microfacets().reflect(wo, wi).1,
            _ => pdf_gaussian_reflection(wo, wi, self.roughness, self.roughness),
        }
    }

    fn share(&self) -> f32 {
        // Fresnel's factor takes most of the interface, less of it at grazing angles.
        let fresnel = match self.interface() {
            Interface::TorranceSparrow | Interface::Ggx => 0.25,
            _ => 1.0,
        };
        lobe_share(self.interface_colour * fresnel, self.body_colour)
    }
}

impl Model for Dichromatic {
    const NAME: &'static str = "dichromatic";
    const SOURCE: &'static str = "Shafer 1985, Using Color to Separate Reflection Components";
    const DOC: &'static str = "Plastic, paint, ceramics, leaves: light that went in and came back has the \
        colour of the object, light that bounced at the border has the colour of the lamp, and each colour \
        is multiplied by geometry alone, f = c_b m_b + c_i m_i. In a photograph the pixels of one such \
        object lie on a plane in colour space, two lines joined like an L, from which both parts and the \
        colour of the lamp can be read. Right: for dielectrics, whose reflectance hardly depends on \
        wavelength. Wrong: for metals and gold thread, whose border is coloured and whose body is black, \
        and for films and pearl, where colour and angle do not part. The two parts do not know of each \
        other: a bright interface leaves the body as bright (plastic and ashikhmin_shirley trade light \
        between them), so keep the sum of both colours at or below one. A coloured c_i is allowed, to show \
        the failure.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("dichromatic.wgsl");
    // Worst 4.4e-4: pow(c, n) with n up to 5000.
    const TWIN: (f32, f32) = (2e-3, 1e-5);

    fn laws(&self) -> Laws {
        if (self.body_colour + self.interface_colour).max_element() <= 1.0 {
            Laws::PHYSICAL
        } else {
            Laws {
                conserves_energy: false,
                why: "body and interface are added, and their colours add up to more than one",
                ..Laws::PHYSICAL
            }
        }
    }

    fn eval(&self, _: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        self.f_body(wo, wi) + self.interface_colour * self.f_interface(wo, wi)
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let share = self.share();
        share * self.pdf_interface(wo, wi) + (1.0 - share) * cosine_hemisphere_pdf(wi)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let share = self.share();
        if u.z >= share {
            return Sample::of(self, table, wo, cosine_hemisphere(u.truncate()));
        }
        let wi = match self.interface() {
            Interface::BlinnPhong => {
                let h = sample_cosine_power(u.truncate(), self.exponent());
                // Seen from behind a facet reflects nothing.
                if h.dot(wo) <= 0.0 {
                    return None;
                }
                reflect(wo, h)
            }
            Interface::Ggx => self.microfacets().sample_reflection(wo, u.truncate()),
            _ => sample_gaussian_reflection(wo, u.with_z(u.z / share), self.roughness, self.roughness),
        };
        Sample::of(self, table, wo, wi)
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        let fresnel = match self.interface() {
            Interface::TorranceSparrow | Interface::Ggx => f_dielectric(1.0, self.eta),
            _ => 1.0,
        };
        (self.body_colour + self.interface_colour * fresnel).min(Vec3::ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;
    use crate::blinn_phong::BlinnPhong;
    use crate::furnace::{albedo, assert_samples, worst_reciprocity};
    use crate::oren_nayar::OrenNayar;
    use crate::torrance_sparrow::TorranceSparrow;
    use crate::ward::Ward;
    use yugen_optics::frame::spherical;

    fn model(body: u32, interface: u32) -> Dichromatic {
        Dichromatic {
            body_form: Choice(body as f32),
            interface_form: Choice(interface as f32),
            ..Dichromatic::defaults()
        }
    }

    #[test]
    fn the_sum_is_that_of_the_models_it_names() {
        let m = model(1, 0);
        let grey = m.interface_colour;
        let on = OrenNayar { reflectance: m.body_colour, sigma: m.sigma, form: Choice(0.0) };
        let bp = BlinnPhong { specular: grey, exponent: 2.0 / (0.15 * 0.15), form: Choice(0.0) };
        let ts = TorranceSparrow {
            specular: grey,
            distribution: Choice(3.0),
            n4: 0.15,
            fresnel: Choice(0.0),
            eta: 1.5,
            ..TorranceSparrow::defaults()
        };
        let ward =
            Ward { diffuse: Vec3::ZERO, specular: grey, alpha_x: 0.15, alpha_y: 0.15, form: Choice(0.0) };
        for i in 0..50 {
            let wo = spherical(0.03 * i as f32, 1.0);
            let wi = spherical(0.02 * i as f32 + 0.2, 4.0);
            let body = on.eval(&[], wo, wi);
            for (k, want) in
                [bp.eval(&[], wo, wi), ts.eval(&[], wo, wi), ward.eval(&[], wo, wi)].into_iter().enumerate()
            {
                let got = model(1, k as u32).eval(&[], wo, wi);
                assert!((got - body - want).length() <= 1e-4 * got.length(), "{k}: {got} {body} {want}");
            }
        }
    }

    #[test]
    fn colours_of_one_object_lie_in_a_plane() {
        // Every f is a sum of c_b and c_i: the determinant of the three vanishes; not so in a metal's highlight.
        for interface in 0..4 {
            let m = model(0, interface);
            for i in 0..40 {
                let f = m.eval(&[], spherical(0.5, 0.0), spherical(0.035 * i as f32, 3.0));
                let volume = f.cross(m.body_colour).dot(m.interface_colour);
                assert!(volume.abs() < 1e-5 * f.length(), "{interface}: {f} {volume}");
            }
        }
    }

    #[test]
    fn sum_of_colours_bounds_the_light() {
        for body in 0..2 {
            for interface in 0..4 {
                let mut m = model(body, interface);
                (m.body_colour, m.interface_colour) = (Vec3::splat(0.6), Vec3::splat(0.4));
                assert!(m.laws().conserves_energy);
                for theta in [0.0, 60.0, 80.0] {
                    assert!(albedo(&m, &[], theta, 0.0, 150) < 1.0 + 1e-4);
                }
                m.interface_colour = Vec3::splat(0.5);
                assert!(!m.laws().conserves_energy);
            }
        }
    }

    #[test]
    fn every_pair_is_reciprocal_and_sampled() {
        for (body, interface) in [(0, 0), (1, 1), (1, 2), (0, 3)] {
            let m = model(body, interface);
            assert!(worst_reciprocity(&m, &[]) < 1e-4);
            assert_samples(&m, &[], Vec3::new(0.36, 0.48, 0.8), 3e-3);
        }
    }
}
