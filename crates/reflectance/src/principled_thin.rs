//! Burley 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering", its thin surfaces, in the
//! form of Mitsuba 3 (principledthin).

use crate::microfacet::{Microfacets, f_dielectric};
use crate::model::{Laws, Model, Sample, Spec, params};
use crate::principled::{Principled, stretched_facets};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use yugen_optics::frame::to_upper;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

params! {
    /// Leaves, paper, soap bubbles and panes as a single surface, by sliders for artists.
    pub struct PrincipledThin {
        base_color: Vec3 = Spec::rgb(0.5, 0.0, 1.0, "", "colour of the material"),
        roughness: f32 = Spec::num(0.5, 0.0, 1.0, "", "perceptual: the square root of alpha"),
        anisotropic: f32 = Spec::num(0.0, 0.0, 1.0, "", "stretches highlights along the tangent"),
        spec_trans: f32 = Spec::num(0.0, 0.0, 1.0, "", "share that is clear, as a pane"),
        eta: f32 = Spec::num(1.5, 1.0, 3.0, "", "index of refraction of the sheet"),
        spec_tint: f32 = Spec::num(0.0, 0.0, 1.0, "", "tints the reflection with the base's hue"),
        sheen: f32 = Spec::num(0.0, 0.0, 1.0, "", "a grazing lobe for cloth"),
        sheen_tint: f32 = Spec::num(0.0, 0.0, 1.0, "", "tints it with the base's hue"),
        flatness: f32 = Spec::num(0.0, 0.0, 1.0, "", "from diffuse to flat, as by scattering inside"),
        diff_trans: f32 = Spec::num(0.0, 0.0, 2.0, "", "how much of the diffuse light passes: 1 half, 2 all"),
    }
}

/// The probabilities of the lobes; what passes diffusely has the rest.
struct Lobes {
    reflects: f32,
    passes: f32,
    diffuse: f32,
}

impl PrincipledThin {
    fn facets(&self) -> Microfacets {
        stretched_facets(self.roughness, self.anisotropic)
    }

    /// Light that passes is bent twice, and blurred less the closer the index is to one: Burley 2015, figure 15.
    fn facets_through(&self) -> Microfacets {
        stretched_facets((0.65 * self.eta - 0.35) * self.roughness, self.anisotropic)
    }

    /// The lobes that it shares with the thick material.
    fn thick(&self) -> Principled {
        Principled {
            base_color: self.base_color,
            roughness: self.roughness,
            metallic: 0.0,
            spec_trans: self.spec_trans,
            eta: self.eta,
            spec_tint: self.spec_tint,
            sheen: self.sheen * (1.0 - self.spec_trans),
            sheen_tint: self.sheen_tint,
            flatness: self.flatness,
            ..Principled::default()
        }
    }

    fn lobes(&self) -> Lobes {
        let clear = 0.5 * self.spec_trans;
        Lobes {
            reflects: clear,
            passes: clear,
            diffuse: (1.0 - self.spec_trans) * (1.0 - 0.5 * self.diff_trans),
        }
    }
}

/// Whether light that a facet mirrors from `o` to `i` (both above), turned over to the other side of the sheet, leaves
/// behind that facet as well: else it is lost, up to a sixth of it at roughness 1, as in Mitsuba.
fn behind(o: Vec3, i: Vec3) -> bool {
    (o + i).dot(Vec3::new(i.x, i.y, -i.z)) < 0.0
}

impl Model for PrincipledThin {
    const NAME: &'static str = "principled_thin";
    const SOURCE: &'static str =
        "Burley 2015, Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering";
    const DOC: &'static str = "Disney's material for what is thin: a clear share that reflects and lets light straight \
        through, a diffuse share that returns it or passes it on. Matches Mitsuba 3. Sheen is added without taking from \
        what lies below.";
    const LAWS: Laws = Laws {
        conserves_energy: false,
        transmits: true,
        why: "sheen and retroreflection are added to the diffuse without taking from it",
        ..Laws::PHYSICAL
    };
    const WGSL: &'static str = include_str!("principled_thin.wgsl");
    // Worst 2.7e-7.
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
                why: "sheen and retroreflection are added to the diffuse, and light that would leave before the facet \
                    which it passed is lost one way and not the other",
                ..Self::LAWS
            };
        }
        Self::LAWS
    }

    fn eval_pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let lobes = self.lobes();
        let (o, i) = (to_upper(wo, wo.z), to_upper(wi, wo.z));
        let passed = 0.5 * self.diff_trans;
        if i.z > 0.0 {
            let (s, pdf, cos) = self.facets().reflect(o, i);
            let thick = self.thick();
            let clear = self.spec_trans * s * thick.fresnel(cos, f_dielectric(cos, self.eta));
            let f = clear + (1.0 - passed) * thick.diffuse(o, i, cos);
            return (f, lobes.reflects * pdf + lobes.diffuse * cosine_hemisphere_pdf(i));
        }
        let i = Vec3::new(i.x, i.y, -i.z);
        let (s, pdf, cos) = if behind(o, i) { self.facets_through().reflect(o, i) } else { (0.0, 0.0, 0.0) };
        let clear = self.spec_trans * (1.0 - f_dielectric(cos, self.eta)) * s;
        let diffuse = (1.0 - self.spec_trans) * passed * FRAC_1_PI;
        let rest = (1.0 - self.spec_trans) * passed;
        ((clear + diffuse) * self.base_color, lobes.passes * pdf + rest * cosine_hemisphere_pdf(i))
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z == 0.0 {
            return None;
        }
        let lobes = self.lobes();
        let (o, uv) = (to_upper(wo, wo.z), u.truncate());
        let (i, above) = if u.z < lobes.reflects {
            (self.facets().sample_reflection(o, uv), true)
        } else if u.z < lobes.reflects + lobes.passes {
            let i = self.facets_through().sample_reflection(o, uv);
            if !behind(o, i) {
                return None;
            }
            (i, false)
        } else {
            (cosine_hemisphere(uv), u.z < lobes.reflects + lobes.passes + lobes.diffuse)
        };
        if i.z <= 0.0 {
            return None;
        }
        let wi = to_upper(if above { i } else { Vec3::new(i.x, i.y, -i.z) }, wo.z);
        Sample::across(self, table, wo, wi, 1.0)
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        self.base_color
    }
}
