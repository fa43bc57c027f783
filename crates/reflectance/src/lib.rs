//! Reflectance models: one file each, in Rust (`x.rs`) and in WGSL (`x.wgsl`), from one list.
//!
//! # Convention
//! Directions are unit vectors in the local frame, normal `n = +z`, tangent `+x`. `wo` points to the eye,
//! `wi` to the light, both away from the surface. [`Model::eval`] returns the BRDF `f` in 1/sr **without**
//! the cosine of `wi`; pdfs are per solid angle; colours are linear RGB of the scene's working space.
//! `frame.wgsl` says the same for shaders.
//!
//! # A model
//! is plain numbers (its parameters, declared once by [`params!`]) and, for some, a table of numbers (a
//! measurement, a tabulated normaliser). Both are slices of `f32`, byte for byte what the shader reads.
//! The list at the end of this file yields the [`Kind`] enum, the dispatch in Rust and in WGSL, the
//! parameter tables, and every test.

mod axis;
mod energy;
mod fabrics;
#[cfg(test)]
mod furnace;
mod model;
mod shader;

pub mod ashikhmin_g;
pub mod btf;
pub mod films;
pub mod gaussian_light;
pub mod halfway;
pub mod importance;
pub mod metals;
pub mod microfacet;

pub use model::{
    Choice, Data, Laws, Model, ModelError, Param, ParamType, Params, Preset, Sample, Spec, Terms,
};
pub use shader::{FRAME_WGSL, wgsl_library, wgsl_library_where, wgsl_params};

model::models! {
    lambert::Lambert,
    oren_nayar::OrenNayar,
    phong::Phong,
    blinn_phong::BlinnPhong,
    ward::Ward,
    torrance_sparrow::TorranceSparrow,
    cook_torrance::CookTorrance,
    ashikhmin_shirley::AshikhminShirley,
    ashikhmin_premoze_shirley::AshikhminPremozeShirley,
    ggx::Ggx,
    noh::Noh,
    dichromatic::Dichromatic,
    conductor::Conductor,
    rough_conductor::RoughConductor,
    dielectric::Dielectric,
    thin_dielectric::ThinDielectric,
    rough_dielectric::RoughDielectric,
    plastic::Plastic,
    rough_plastic::RoughPlastic,
    metallic_roughness::MetallicRoughness,
    thin_transmission::ThinTransmission,
    principled::Principled,
    principled_thin::PrincipledThin,
    merl::Merl,
    rgl::Rgl,
    tabulated::Tabulated,
    microcylinder::Microcylinder,
    gold_thread::GoldThread,
    structural_colour::StructuralColour,
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::frame::spherical;

    #[test]
    fn models_made_of_terms_are_their_product() {
        let mut found = Vec::new();
        for &kind in Kind::ALL {
            let slots = kind.defaults();
            let Ok(table) = kind.bake(&slots, &[]) else { continue };
            let bsdf = Bsdf::new(kind, &slots, &table);
            for (a, b, phi) in [(0.1, 0.2, 1.0), (0.8, 0.7, 3.0), (1.2, 0.3, 0.4), (1.4, 1.45, 3.1)] {
                let (wo, wi) = (spherical(a, 0.3), spherical(b, 0.3 + phi));
                let Some(Terms { d, g, f }) = bsdf.terms(wo, wi) else { continue };
                assert!((0.0..=1.0).contains(&g), "{} {g}", kind.name());
                let (want, got) = (bsdf.eval(wo, wi), f * (d * g / (4.0 * wo.z * wi.z)));
                // Measured 4e-7 where there is light; in the far tails an exponential has fewer digits.
                let most = 2e-6 * want.max_element() + 1e-9;
                assert!((got - want).abs().max_element() <= most, "{} {want} {got}", kind.name());
                found.push(kind.name());
            }
        }
        found.dedup();
        assert_eq!(found, ["torrance_sparrow", "cook_torrance", "ggx", "rough_conductor"]);
    }
}
