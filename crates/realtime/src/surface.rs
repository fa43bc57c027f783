//! The local geometry of a place on a triangle, in WGSL, and what shaders of surfaces are made of.

use crate::film::FILM_WGSL;
use crate::hierarchy::HIERARCHY_WGSL;
use crate::scene::scene_wgsl;
use crate::view::VIEW_WGSL;
use yugen_scene::prepared::{Rows, wgsl};

/// `Surface` and `surface_at`: position, normals, frame, texture coordinates. Stands on the scene and its hierarchy.
pub const SURFACE_WGSL: &str = include_str!("surface.wgsl");

/// `passes` for shaders without materials: nothing does.
pub const OPAQUE_WGSL: &str = include_str!("opaque.wgsl");

/// `visible_hit` and `camera_hit`: what a pixel of the visibility buffer sees. Stands on the view and the surface. Needs a
/// constant `HIDE_EMITTERS`.
pub const VISIBILITY_WGSL: &str = include_str!("visibility.wgsl");

/// `primary_hit`: the same past what lets all light pass. Stands on `visible_hit` and `passes`.
pub const PRIMARY_WGSL: &str = include_str!("primary.wgsl");

/// `passes` for shaders with materials, and `shading_point`. Stands on the surface and [`yugen_scene::prepared::wgsl`].
pub const SEE_THROUGH_WGSL: &str = include_str!("see_through.wgsl");

/// What a shader starts from that adds to a film what pixels see of surfaces of the materials and under the lights of `rows`.
/// Needs constants `HIDE_EMITTERS` and `FILM_HALVES`.
pub(crate) fn shading_wgsl(rows: &Rows) -> String {
    film_pass_wgsl(&wgsl(rows), SEE_THROUGH_WGSL)
}

/// The same without materials: of surfaces that let nothing pass.
pub(crate) fn opaque_wgsl() -> String {
    film_pass_wgsl("", OPAQUE_WGSL)
}

fn film_pass_wgsl(materials: &str, passes: &str) -> String {
    let samples = include_str!("samples.wgsl");
    let scene = scene_wgsl();
    [&scene, materials, HIERARCHY_WGSL, SURFACE_WGSL, passes, VIEW_WGSL, VISIBILITY_WGSL, FILM_WGSL, samples]
        .join("\n")
}
