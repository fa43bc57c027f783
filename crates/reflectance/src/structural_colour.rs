//! Abelès 1950, "Recherches sur la propagation des ondes électromagnétiques sinusoïdales dans les milieux
//! stratifiés": colour from thin layers, on microfacets.

use crate::films::{Layer, coat, repeated_stack};
use crate::metals::{Metal, VISIBLE, WAVELENGTHS};
use crate::microfacet::{Distribution, Masking, Microfacets};
use crate::model::{Choice, Laws, Model, ModelError, Preset, Sample, Spec, params};
use glam::{DVec3, Vec3};
use num_complex::Complex64;
use yugen_optics::ColourSpace;
use yugen_optics::spectrum::Sensor;

/// Cosines of the table, 0 to 1.
const COSINES: usize = 64;
/// Thickness factors of the table where the thickness varies over the surface.
const ROWS: usize = 64;

/// In the order of [`ColourSpace::ALL`].
const SPACES: &[&str] = &["srgb", "rec2020", "acescg", "p3"];
/// A dielectric by its index, or a metal of [`Metal::ALL`] in that order.
const MATERIALS: &[&str] = &["dielectric", "gold", "gold_johnson_christy", "silver", "copper", "aluminium"];

params! {
    /// Thin layers on a rough surface: `pairs` times a film and a gap, on a base, under an optional thick coat.
    pub struct StructuralColour {
        alpha_x: f32 = Spec::num(0.1, 0.001, 1.0, "", "roughness along the tangent"),
        alpha_y: f32 = Spec::num(0.1, 0.001, 1.0, "", "roughness across the tangent"),
        thickness: f32 = Spec::num(1.0, 0.0, 2.0, "", "factor on film and gap; may vary over the surface by thickness_range"),
        thickness_range: f32 = Spec::num(0.0, 0.0, 1.0, "", "the table reaches from 1 - range to 1 + range; 0 where the thickness is the same everywhere"),
        space: Choice = Spec::choice(1, SPACES, "the scene's working space, in which the reflectance is expressed"),
        film: Choice = Spec::choice(0, MATERIALS, "what the film is made of"),
        film_index: f32 = Spec::num(1.33, 1.0, 4.0, "", "index of a dielectric film"),
        film_thickness: f32 = Spec::num(300.0, 0.0, 2000.0, "nm", "thickness of the film"),
        gap_index: f32 = Spec::num(1.0, 1.0, 4.0, "", "index of the gap below each film"),
        gap_thickness: f32 = Spec::num(0.0, 0.0, 2000.0, "nm", "thickness of the gap"),
        pairs: f32 = Spec::num(1.0, 0.0, 24.0, "", "how many times film and gap repeat; a whole number"),
        disorder: f32 = Spec::num(0.0, 0.0, 0.3, "", "standard deviation of the thickness from place to place, relative"),
        base: Choice = Spec::choice(0, MATERIALS, "what lies below; light that enters it is lost"),
        base_index: f32 = Spec::num(1.0, 1.0, 4.0, "", "index of a dielectric base"),
        coat_index: f32 = Spec::num(1.0, 1.0, 2.5, "", "index of a clear coat too thick to interfere; 1 for none"),
    }
}

impl StructuralColour {
    fn facets(&self) -> Microfacets {
        Microfacets::new(Distribution::Ggx, Masking::HeightCorrelated, self.alpha_x, self.alpha_y)
    }

    fn rows(&self) -> usize {
        if self.thickness_range > 0.0 { ROWS } else { 1 }
    }

    /// Unpolarised reflectance in air at `lambda` nm and the cosine `cos`, all thicknesses times `factor`.
    pub fn reflectance(&self, lambda: f64, cos: f64, factor: f64) -> f64 {
        let material = |choice: Choice, index: f32| match choice.index() {
            0 => Complex64::from(f64::from(index)),
            metal => Metal::ALL[metal as usize - 1].index(lambda),
        };
        let film = Layer {
            index: material(self.film, self.film_index),
            thickness: f64::from(self.film_thickness) * factor,
        };
        let gap = Layer {
            index: f64::from(self.gap_index).into(),
            thickness: f64::from(self.gap_thickness) * factor,
        };
        let pairs = self.pairs.round().clamp(0.0, 24.0) as u32;
        let base = material(self.base, self.base_index);
        let on = |n0: f64, cos: f64| repeated_stack(lambda, n0, cos, &[film, gap], pairs, base);
        if self.coat_index > 1.0 {
            let n = f64::from(self.coat_index);
            coat(1.0, cos, n, 1.0, |cos| on(n, cos)).reflectance()
        } else {
            on(1.0, cos).reflectance()
        }
    }

    /// RGB at one cosine and factor, averaged over the disorder, between 0 and 1.
    fn rgb(&self, sensor: &Sensor, cos: f64, factor: f64) -> Vec3 {
        // Gauss-Hermite with 5 nodes, for the mean over a Gaussian: node in standard deviations, weight.
        const NODES: [(f64, f64); 5] = [
            (-2.856_970_013_872_806, 0.011_257_411_327_720_69),
            (-1.355_626_179_974_266, 0.222_075_922_005_612_6),
            (0.0, 0.533_333_333_333_333_3),
            (1.355_626_179_974_266, 0.222_075_922_005_612_6),
            (2.856_970_013_872_806, 0.011_257_411_327_720_69),
        ];
        let nodes = if self.disorder > 0.0 { &NODES[..] } else { &[(0.0, 1.0)] };
        let mut rgb = DVec3::ZERO;
        for (lambda, weight) in sensor.wavelengths().iter().zip(sensor.weights()) {
            let mean: f64 = nodes
                .iter()
                .map(|(x, w)| {
                    w * self.reflectance(
                        *lambda,
                        cos,
                        (factor * (1.0 + f64::from(self.disorder) * x)).max(0.0),
                    )
                })
                .sum();
            rgb += *weight * mean;
        }
        rgb.as_vec3().clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// The table at the cosine `cos` between half vector and light.
    fn fresnel(&self, table: &[f32], cos: f32) -> Vec3 {
        let x = cos.clamp(0.0, 1.0) * (COSINES - 1) as f32;
        let i = (x as usize).min(COSINES - 2);
        let x = x - i as f32;
        let row = |r: usize| {
            let at = 3 * (r * COSINES + i);
            Vec3::from_slice(&table[at..]).lerp(Vec3::from_slice(&table[at + 3..]), x)
        };
        if table.len() <= 3 * COSINES {
            return row(0);
        }
        let y =
            (self.thickness - 1.0 + self.thickness_range) / (2.0 * self.thickness_range) * (ROWS - 1) as f32;
        let y = y.clamp(0.0, (ROWS - 1) as f32);
        let j = (y as usize).min(ROWS - 2);
        row(j).lerp(row(j + 1), y - j as f32)
    }
}

/// Cosine between the half vector and either direction, the same for both to the last bit: the table is steep
/// along the surface.
fn cos_d(wo: Vec3, wi: Vec3) -> f32 {
    0.5 * (wo + wi).length()
}

impl Model for StructuralColour {
    const NAME: &'static str = "structural_colour";
    const SOURCE: &'static str =
        "Abelès 1950, matrices of stratified media; with the microfacets of Walter et al. 2007";
    const DOC: &'static str = "Colour from thin layers: soap, nacre, beetles and butterflies, lacquer and gold leaf. \
        Reflectance is computed at 81 wavelengths from polarised light in all layers, and baked into a table of \
        RGB over the angle (and the thickness, where thickness_range says that it varies). `space` must be the \
        scene's working space; presets and scene readers set it. Values are kept between 0 and 1: in sRGB gold \
        loses a little red by that. Light that enters the base is lost; sum with a diffuse model for a pale base.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("structural_colour.wgsl");
    const PRESETS: &'static [Preset] = &[
        Preset { name: "soap_film", doc: "water film in air, 300 nm, textured between none and twice that" },
        Preset {
            name: "morpho",
            doc: "eight chitin lamellae (1.56, 63 nm) in air (127 nm): the blue of Morpho, after Vukusic et al. 1999",
        },
        Preset {
            name: "nacre",
            doc: "twelve aragonite tablets (1.68, 450 nm) with organic sheets (1.43, 30 nm), thickness varying by 5 %",
        },
        Preset {
            name: "gold_leaf_on_lacquer",
            doc: "gold leaf of 100 nm (Olmon et al. 2012) on urushi lacquer (1.53)",
        },
        Preset {
            name: "lacquered_gold",
            doc: "gold (Olmon et al. 2012) under clear lacquer (1.53), redder than bare gold",
        },
    ];

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let space = ColourSpace::ALL.iter().position(|s| *s == space)?;
        let plain = Self { space: Choice(space as f32), ..Self::default() };
        let gold = Choice(1.0);
        let model = match name {
            "soap_film" => Self { alpha_x: 0.01, alpha_y: 0.01, thickness_range: 1.0, ..plain },
            // The lamellae run along the ridges of a scale: light spreads across them.
            "morpho" => Self {
                alpha_x: 0.15,
                alpha_y: 0.5,
                film_index: 1.56,
                film_thickness: 63.0,
                gap_thickness: 127.0,
                pairs: 8.0,
                disorder: 0.05,
                base_index: 1.56,
                ..plain
            },
            "nacre" => Self {
                film_index: 1.68,
                film_thickness: 450.0,
                gap_index: 1.43,
                gap_thickness: 30.0,
                pairs: 12.0,
                disorder: 0.02,
                base_index: 1.68,
                thickness_range: 0.05,
                ..plain
            },
            "gold_leaf_on_lacquer" => Self { film: gold, film_thickness: 100.0, base_index: 1.53, ..plain },
            "lacquered_gold" => Self { pairs: 0.0, base: gold, coat_index: 1.53, ..plain },
            _ => return None,
        };
        Some((model, Vec::new()))
    }

    fn bake(&self, _: &[f32]) -> Result<Vec<f32>, ModelError> {
        let space = ColourSpace::ALL.get(self.space.index() as usize).copied().unwrap_or_default();
        let sensor = Sensor::reflectance(space, VISIBLE, WAVELENGTHS);
        let mut table = Vec::with_capacity(3 * COSINES * self.rows());
        for row in 0..self.rows() {
            let factor = if self.rows() == 1 {
                self.thickness
            } else {
                1.0 + self.thickness_range * (2.0 * row as f32 / (ROWS - 1) as f32 - 1.0)
            };
            for i in 0..COSINES {
                // Not quite along the surface, where even nothing at all would reflect.
                let cos = (i as f64 / (COSINES - 1) as f64).max(1e-4);
                table.extend(self.rgb(&sensor, cos, f64::from(factor)).to_array());
            }
        }
        Ok(table)
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(table, wo, wi).0
    }

    fn pdf(&self, _: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        self.facets().reflect(wo, wi).1
    }

    fn eval_pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let (f, pdf, _) = self.facets().reflect(wo, wi);
        if f <= 0.0 {
            return (Vec3::ZERO, pdf);
        }
        (f * self.fresnel(table, cos_d(wo, wi)), pdf)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let facets = self.facets();
        let wi = facets.sample_reflection(wo, u.truncate());
        let (f, pdf, _) = facets.reflect(wo, wi);
        if pdf <= 0.0 {
            return None;
        }
        let weight = f * wi.z / pdf * self.fresnel(table, cos_d(wo, wi));
        Some(Sample { wi, weight, pdf, delta: false, eta: 1.0 })
    }

    fn albedo(&self, table: &[f32]) -> Vec3 {
        self.fresnel(table, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::frame::spherical;

    fn made(name: &str, space: ColourSpace) -> (StructuralColour, Vec<f32>) {
        let (model, data) = StructuralColour::preset(name, space).unwrap();
        let table = model.bake(&data).unwrap();
        (model, table)
    }

    #[test]
    fn presets_have_their_colours() {
        let srgb = ColourSpace::LinearSrgb;
        // The colours of films.rs and metals.rs; red beyond one is cut.
        for (name, want) in
            [("gold_leaf_on_lacquer", [1.0, 0.7697, 0.3387]), ("lacquered_gold", [1.0, 0.7308, 0.2498])]
        {
            let (model, table) = made(name, srgb);
            let got = model.albedo(&table);
            assert!((got - Vec3::from(want)).abs().max_element() < 1e-3, "{name}: {got}");
        }
        let (model, table) = made("morpho", srgb);
        let blue = model.albedo(&table);
        assert!(blue.z > 0.4 && blue.z > 3.0 * blue.x && blue.z > 1.5 * blue.y, "{blue}");
        // Iridescence goes to shorter waves: beyond blue there is no light left.
        let oblique = model.fresnel(&table, 0.6);
        assert!(oblique.z < 0.5 * blue.z, "{oblique}");
        let (model, table) = made("nacre", ColourSpace::LinearRec2020);
        let (front, thick) =
            (model.albedo(&table), StructuralColour { thickness: 1.05, ..model }.albedo(&table));
        assert!(front.min_element() > 0.02 && (front - thick).abs().max_element() > 0.05, "{front} {thick}");
        assert!(StructuralColour::preset("mud", srgb).is_none());
    }

    #[test]
    fn the_table_follows_the_films() {
        let (model, table) = made("soap_film", ColourSpace::LinearRec2020);
        assert_eq!(table.len(), 3 * COSINES * ROWS);
        let sensor = Sensor::reflectance(ColourSpace::LinearRec2020, VISIBLE, WAVELENGTHS);
        let mut worst = 0.0f32;
        for i in 0..40 {
            let model = StructuralColour { thickness: 0.03 + 0.045 * i as f32, ..model };
            for cos in [0.999, 0.83, 0.51, 0.27] {
                let want = model.rgb(&sensor, cos, f64::from(model.thickness));
                worst = worst.max((model.fresnel(&table, cos as f32) - want).abs().max_element());
            }
        }
        // Measured 3.8e-3: linear between 64 thicknesses and 64 cosines.
        assert!(worst < 0.016, "{worst}");
        // No film at all reflects nothing in air.
        let none = StructuralColour { thickness: 0.0, ..model };
        assert!(none.fresnel(&table, 0.8).max_element() < 1e-6);
    }

    #[test]
    fn reflects_as_its_facets_and_films_say() {
        let (model, table) = made("gold_leaf_on_lacquer", ColourSpace::LinearRec2020);
        let (wo, wi) = (spherical(0.7, 0.3), spherical(0.9, 2.9));
        let (f, pdf, _) = model.facets().reflect(wo, wi);
        let got = model.eval(&table, wo, wi);
        let want = f * model.fresnel(&table, cos_d(wo, wi));
        assert_eq!((got, model.pdf(&table, wo, wi)), (want, pdf));
        assert!((got - model.eval(&table, wi, wo)).abs().max_element() < 1e-5 * got.max_element());
        let s = model.sample(&table, wo, Vec3::new(0.3, 0.6, 0.1)).unwrap();
        let weight = model.eval(&table, wo, s.wi) * s.wi.z / s.pdf;
        assert!((s.weight - weight).abs().max_element() < 1e-6 && s.weight.max_element() <= 1.0);
        assert_eq!(model.eval(&table, wo, -wi), Vec3::ZERO);
    }
}
