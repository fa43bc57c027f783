//! Fresnel 1823, as in Born and Wolf 1999, "Principles of Optics", 14.2: a polished metal.

use crate::metals::Metal;
use crate::microfacet::f_conductor;
use crate::model::{Laws, Model, Preset, Sample, Spec, params};
use glam::Vec3;
use yugen_optics::ColourSpace;
use yugen_optics::frame::mirror;

params! {
    /// A mirror whose colour is Fresnel's for a complex index of refraction.
    pub struct Conductor {
        // Gold, Olmon et al. 2012, at 610, 550 and 450 nm.
        eta: Vec3 = Spec::colour([0.1908, 0.3256, 1.472], 0.0, 10.0, "", "real part of the index of refraction"),
        k: Vec3 = Spec::colour([3.232, 2.507, 1.855], 0.0, 15.0, "", "imaginary part: extinction"),
        specular_reflectance: Vec3 = Spec::rgb(1.0, 0.0, 1.0, "", "factor on the reflection; 1 is physical"),
    }
}

impl Model for Conductor {
    const NAME: &'static str = "conductor";
    const SOURCE: &'static str = "Born and Wolf 1999, Principles of Optics (7th ed.), 14.2";
    const DOC: &'static str = "A perfectly smooth metal: one mirror direction, coloured by the exact Fresnel \
        reflectance of a complex index of refraction. For brushed or cast metal see rough_conductor.";
    const LAWS: Laws = Laws { delta: true, ..Laws::PHYSICAL };
    const WGSL: &'static str = include_str!("conductor.wgsl");
    const PRESETS: &'static [Preset] = Metal::PRESETS;

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let (eta, k) = Metal::from_name(name)?.rgb_index(space);
        Some((Self { eta, k, ..Self::default() }, Vec::new()))
    }

    fn eval(&self, _: &[f32], _: Vec3, _: Vec3) -> Vec3 {
        Vec3::ZERO
    }

    fn pdf(&self, _: &[f32], _: Vec3, _: Vec3) -> f32 {
        0.0
    }

    fn sample(&self, _: &[f32], wo: Vec3, _: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let weight = f_conductor(wo.z, self.eta, self.k) * self.specular_reflectance;
        Some(Sample { wi: mirror(wo), weight, pdf: 1.0, delta: true, eta: 1.0 })
    }

    fn albedo(&self, _: &[f32]) -> Vec3 {
        f_conductor(1.0, self.eta, self.k) * self.specular_reflectance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_metal_is_a_preset() {
        assert_eq!(Conductor::PRESETS.len(), Metal::ALL.len());
        for p in Conductor::PRESETS {
            let (m, _) = Conductor::preset(p.name, ColourSpace::default()).expect(p.name);
            // What is averaged is the index: the colour comes near the metal's own.
            let own = Metal::from_name(p.name).expect(p.name).f0(ColourSpace::default());
            assert!(
                (m.albedo(&[]) - own).abs().max_element() < 0.06,
                "{}: {} for {own}",
                p.name,
                m.albedo(&[])
            );
        }
    }
}
