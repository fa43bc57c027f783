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

mod energy;
mod fabrics;
#[cfg(test)]
mod furnace;
mod model;
mod shader;

pub mod ashikhmin_g;
pub mod btf;
pub mod films;
pub mod halfway;
pub mod importance;
pub mod metals;
pub mod microfacet;

pub use model::{Choice, Data, Laws, Model, ModelError, Param, ParamType, Params, Preset, Sample, Spec};
pub use shader::{FRAME_WGSL, wgsl_library, wgsl_params};

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
    principled::Principled,
    merl::Merl,
    rgl::Rgl,
    tabulated::Tabulated,
    microcylinder::Microcylinder,
    gold_thread::GoldThread,
    structural_colour::StructuralColour,
}
