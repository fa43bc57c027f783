//! The picture: what the visibility buffer saw, shaded, and surfaces behind it.

use crate::film::{FILM_WGSL, FilmPass};
use crate::frame::Options;
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::compute;
use crate::scene::{SceneBuffers, scene_wgsl};
use crate::surface::SURFACE_WGSL;
use crate::view::VIEW_WGSL;
use wgpu::Device;
use yugen_scene::prepared::{NONE, Rows, wgsl};

/// Most lights that the first surface looks at in a frame, one sample each; of more some are chosen by their power.
const LIGHTS: u32 = 16;

/// `shade.wgsl` has 32 sets of samples for a surface, five of them its own.
const _: () = assert!(LIGHTS + 5 <= 32);

/// Bounces from which Russian roulette may end a path, as in Mitsuba.
const ROULETTE: u32 = 5;

/// Most bounces: what a path carries so far has gone through a hundred roulettes.
const BOUNCES: u32 = 100;

/// The pass, compiled for the models, maps and lights of `rows`. `primary`: the layout of group 1; `bounces`: surfaces that
/// may reflect light on its way to the camera.
pub fn shade_pass(
    device: &Device,
    rows: &Rows,
    scene: &SceneBuffers,
    primary: &wgpu::BindGroupLayout,
    film: &wgpu::BindGroupLayout,
    options: &Options,
    bounces: u32,
) -> FilmPass {
    // Not overrides: naga refuses some shaders that it has to rewrite for those.
    let constants = format!(
        "// Surfaces that reflect light on its way; 0: only what shines is seen.\nconst BOUNCES: u32 = {}u;\n\
         // Bounces from which roulette may end a path.\nconst ROULETTE: u32 = {ROULETTE}u;\n\
         // Most lights that the first surface looks at, one sample each.\nconst LIGHTS: u32 = {LIGHTS}u;\n\
         // Lights are not seen by the camera.\nconst HIDE_EMITTERS: bool = {};\n\
         // Some surface shines.\nconst HAS_SURFACE_LIGHTS: bool = {};",
        bounces.min(BOUNCES),
        options.hide_emitters,
        rows.draws.iter().any(|d| d.emitter != NONE)
    );
    let pieces = [
        &constants,
        &scene_wgsl(),
        &wgsl(rows),
        HIERARCHY_WGSL,
        SURFACE_WGSL,
        VIEW_WGSL,
        FILM_WGSL,
        include_str!("shade.wgsl"),
    ];
    let groups = [scene.layout(), primary, film];
    let pipeline = compute(device, "shade_pixels", &pieces, &groups, &[]);
    FilmPass::new(device, "shade", pipeline, film, options.size)
}
