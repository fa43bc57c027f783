//! What is read of glTF 2.0 and of its extensions.

use super::document::Document;
use crate::Error;
use crate::formats::support::{Feature, Support, find};

/// Meshes that only Draco's decoder unpacks.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
/// Buffers packed by meshopt, in its first form.
pub(super) const MESHOPT: &str = "EXT_meshopt_compression";
/// And in its second.
pub(super) const KHR_MESHOPT: &str = "KHR_meshopt_compression";
/// Pictures in KTX 2.
pub(super) const BASISU: &str = "KHR_texture_basisu";

// Of no consequence for a picture; nobody needs to hear of it.
const OTHERS: &str = "data for another program";
const ABOUT: &str = "data about the file";
const UNSEEN: &str = "says nothing about pictures";
const UNPACK: &str = "no decoder; unpack with `gltf-transform copy`, or export without compression";

/// The format's own features, then extensions by their names in files.
pub const FEATURES: &[Feature] = &[
    Feature::yes(".gltf with data URIs or files beside it, .glb"),
    Feature::yes("triangles, strips, fans"),
    Feature::no("points, lines", "not shown; a warning says so"),
    Feature::yes("sparse accessors, normalised integers"),
    Feature::yes("skins, morph targets, animations"),
    Feature::partly("joints and weights", "the first four joints of a vertex"),
    Feature::yes("cameras"),
    Feature::yes("metallic-roughness materials, normal and emissive textures"),
    Feature::partly("occlusion textures", "not used: light is followed"),
    Feature::yes("alpha modes, vertex colours and their alpha, wrap modes, sets of texture coordinates"),
    Feature::partly("single-sided materials", "closed meshes are not looked into from inside"),
    Feature::partly("minification filters", "bilinear in the full picture; rays average it"),
    Feature::no("glTF 1", "another format; convert it with gltf-pipeline"),
    Feature::no("ADOBE_materials_clearcoat_specular", "the coat is of index 1.5 without it"),
    Feature::no("ADOBE_materials_clearcoat_tint", "the coat is clear without it"),
    Feature::no("AGI_articulations", "nodes stay where they are"),
    Feature::no("AGI_stk_metadata", OTHERS),
    Feature::no("CESIUM_primitive_outline", "outlines are not drawn"),
    Feature::no("CESIUM_RTC", "an offset of glTF 1; nodes can move things in glTF 2"),
    Feature::no("EXT_feature_metadata", OTHERS),
    Feature::no("EXT_instance_features", OTHERS),
    Feature::no("EXT_lights_ies", "lamps shine evenly without their profiles"),
    Feature::no("EXT_lights_image_based", "give an environment in a scene file instead"),
    Feature::no("EXT_mesh_features", OTHERS),
    Feature::yes("EXT_mesh_gpu_instancing"),
    Feature::no("EXT_mesh_manifold", "the triangles are read without it"),
    Feature::yes(MESHOPT),
    Feature::no("EXT_structural_metadata", OTHERS),
    Feature::no("EXT_texture_avif", "no decoder; convert its pictures to PNG or JPEG"),
    Feature::yes("EXT_texture_webp"),
    Feature::no("FB_geometry_metadata", OTHERS),
    Feature::no("GODOT_single_root", UNSEEN),
    Feature::no("KHR_animation_pointer", "only nodes and weights move"),
    Feature::no(DRACO, UNPACK),
    Feature::yes("KHR_lights_punctual"),
    Feature::yes("KHR_materials_anisotropy"),
    Feature::partly("KHR_materials_clearcoat", "the coat's own normal texture"),
    Feature::yes("KHR_materials_diffuse_transmission"),
    Feature::no("KHR_materials_dispersion", "glass does not split colours"),
    Feature::yes("KHR_materials_emissive_strength"),
    Feature::yes("KHR_materials_ior"),
    Feature::yes("KHR_materials_iridescence"),
    Feature::yes("KHR_materials_pbrSpecularGlossiness"),
    Feature::yes("KHR_materials_sheen"),
    Feature::yes("KHR_materials_specular"),
    Feature::yes("KHR_materials_transmission"),
    Feature::yes("KHR_materials_unlit"),
    Feature::partly("KHR_materials_variants", "the material that a mesh has by default"),
    Feature::partly(
        "KHR_materials_volume",
        "thickness only tells bodies from sheets: light is followed inside",
    ),
    Feature::no("KHR_materials_volume_scatter", "bodies absorb, but do not scatter"),
    Feature::yes("KHR_mesh_quantization"),
    Feature::no(KHR_MESHOPT, UNPACK),
    Feature::no("KHR_node_hoverability", UNSEEN),
    Feature::no("KHR_node_selectability", UNSEEN),
    Feature::no("KHR_node_visibility", "nodes are shown even if they are marked as hidden"),
    Feature::no("KHR_techniques_webgl", "shaders of a file are not run"),
    Feature::no(BASISU, "no decoder; convert its pictures with `gltf-transform ktxdecompress`"),
    Feature::yes("KHR_texture_transform"),
    Feature::no("KHR_xmp", ABOUT),
    Feature::no("KHR_xmp_json_ld", ABOUT),
    Feature::no("MSFT_lod", "the finest level is shown"),
    Feature::no("MSFT_packing_normalRoughnessMetallic", "the textures of the core are read instead"),
    Feature::no("MSFT_packing_occlusionRoughnessMetallic", "the textures of the core are read instead"),
    Feature::no("MSFT_texture_dds", "no decoder; the picture beside it is read"),
    Feature::no("VRM", "an avatar's behaviour; its figure is shown"),
    Feature::no("VRMC_materials_mtoon", "shown by its metallic-roughness material"),
    Feature::no("VRMC_vrm", "an avatar's behaviour; its figure is shown"),
];

/// Extensions that change nothing in a picture.
fn harmless(why: &str) -> bool {
    [OTHERS, ABOUT, UNSEEN].contains(&why)
}

/// Refuses what the file requires and is not read; warns, once, of what else it uses.
pub(super) fn check(doc: &Document) -> Result<(), Error> {
    let mut left_out = Vec::new();
    let required = &doc.root.extensions_required;
    let mut used: Vec<&String> = doc.root.extensions_used.iter().chain(required).collect();
    used.sort();
    used.dedup();
    for name in used {
        let why = match find(FEATURES, name).map(|f| f.support) {
            Some(Support::Yes | Support::Partly(_)) => continue,
            Some(Support::No(why)) => why,
            None => "it is not known here",
        };
        if required.contains(name) && !harmless(why) {
            let problem = format!("the file requires the extension {name}, which is not read: {why}");
            return Err(doc.invalid(problem));
        }
        if !harmless(why) {
            left_out.push(format!("{name} ({why})"));
        }
    }
    if !left_out.is_empty() {
        tracing::warn!("{}: extensions that are not read: {}", doc.at, left_out.join(", "));
    }
    Ok(())
}

/// Data that is there only in a form that is not read.
pub(super) fn packed(doc: &Document, name: &'static str) -> Error {
    doc.invalid(format!("its meshes are packed by {name}, which is not read: {UNPACK}"))
}
