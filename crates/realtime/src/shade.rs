//! The picture: what the visibility buffer saw, shaded, and surfaces behind it.

use crate::film::{FilmPass, HALVES_PLANES, shading_wgsl};
use crate::flames::{Flames, flames_wgsl};
use crate::frame::{Lighting, Options};
use crate::free_lights::FreeLights;
use crate::pipelines::compute;
use crate::scene::SceneBuffers;
use crate::visibility::PRIMARY_WGSL;
use wgpu::Device;
use yugen_scene::prepared::{NONE, Rows, SLABS};

/// Most lights that the first surface considers in a frame, one sample each; of more some are chosen by their power.
const CANDIDATES: u32 = 16;

/// So many lights have a shadow ray each. Two rays drawn among the five lights of Veach's scene took 60 % of the time and
/// left four times the FLIP.
const FEW_LIGHTS: u32 = 8;

/// Shadow rays of the first surface in a frame where there are more lights than few.
const SHADOW_RAYS: u32 = 8;

/// So many instead beside fires: other lights, of logs, sparks and sky, are weak there. Sixteen on two rays took a third of the
/// frame of the Noh stage (35 and 23 s of CPU a megapixel) and left the same noise: 28 and 29 % after four frames, 17.8 and
/// 17.9 after sixteen.
const BESIDE_FIRES: u32 = 2;

/// `shade.wgsl` has 32 sets of samples for a surface, five of them its own.
const _: () = assert!(5 + CANDIDATES + SHADOW_RAYS <= 32);

/// Bounces from which Russian roulette may end a path, as in Mitsuba.
const ROULETTE: u32 = 5;

/// Most bounces: what a path carries so far has gone through a hundred roulettes.
pub(crate) const BOUNCES: u32 = 100;

/// Whether nothing in the scene shines.
pub fn needs_head_light(rows: &Rows) -> bool {
    rows.emitters == 0 && !rows.has_sky()
}

/// The pass, compiled for the models, maps and lights of `rows`. `primary`: the layout of group 1 with what [`FreeLights`] finds; `bounces`: surfaces that
/// may reflect light on its way to the camera.
pub fn shade_pass(
    device: &Device,
    rows: &Rows,
    scene: &SceneBuffers,
    primary: &wgpu::BindGroupLayout,
    film: &wgpu::BindGroupLayout,
    flames: Option<&Flames>,
    options: &Options,
    bounces: u32,
) -> FilmPass {
    let surfaces_shine = rows.draws.iter().any(|d| d.emitter != NONE);
    // Not overrides: naga refuses some shaders that it has to rewrite for those.
    let constants = format!(
        "// Surfaces that reflect light on its way; 0: only what shines is seen.\nconst BOUNCES: u32 = {}u;\n\
         // Bounces from which roulette may end a path.\nconst ROULETTE: u32 = {ROULETTE}u;\n\
         // Most lights that the first surface considers, and its shadow rays.\nconst CANDIDATES: u32 = {}u;\n\
         const FEW_LIGHTS: u32 = {FEW_LIGHTS}u;\nconst SHADOW_RAYS: u32 = {SHADOW_RAYS}u;\n\
         // Slabs of a fire.\nconst SLABS: u32 = {SLABS}u;\n\
         // Lights are not seen by the camera.\nconst HIDE_EMITTERS: bool = {};\n\
         // Some surface shines; something does that rays can find.\nconst HAS_SURFACE_LIGHTS: bool = {};\n\
         const RAYS_FIND_LIGHT: bool = {};\n\
         // Samples of lights leave less noise on diffuse surfaces than directions drawn, and find all but the background:\n\
         // not of smooth skies, nor of what is sampled by area.\n\
         const LIGHTS_SUFFICE: bool = {};\nconst HAS_BACKGROUND: bool = {};\n\
         // The scene has no light: it comes from the eye, and white surfaces seen head-on are white.\n\
         const HEAD_LIGHT: bool = {};\n\
         // Of lights without extent it is known tile by tile whether nothing is in the way.\nconst FREE_LIGHTS: bool = {};\nconst FILM_HALVES: bool = {};",
        bounces.min(BOUNCES),
        if rows.has_slabs() { BESIDE_FIRES } else { CANDIDATES },
        options.hide_emitters,
        surfaces_shine,
        surfaces_shine || rows.has_sky(),
        !rows.lights_by_area && !rows.has_environment(),
        rows.has_background(),
        needs_head_light(rows),
        FreeLights::are_wanted(rows, options),
        options.keeps_halves()
    );
    let picture = match options.lighting {
        Lighting::Full => include_str!("shade.wgsl").to_string(),
        Lighting::Paper => [PRIMARY_WGSL, include_str!("paper.wgsl")].concat(),
    };
    let pieces = [constants.as_str(), &shading_wgsl(rows), &flames_wgsl(rows), &picture];
    let groups: Vec<_> =
        [scene.layout(), primary, film].into_iter().chain(flames.map(Flames::layout)).collect();
    let pipeline = compute(device, "shade_pixels", &pieces, &groups);
    let more = if options.keeps_halves() { HALVES_PLANES } else { 0 };
    FilmPass::new(device, "shade", pipeline, film, options.size, more)
}
