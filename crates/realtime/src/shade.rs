//! The picture: what the visibility buffer saw, shaded, and surfaces behind it.

use crate::film::{FILM_WGSL, FilmPass};
use crate::flames::{Flames, flames_wgsl};
use crate::frame::{Lighting, Options};
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::compute;
use crate::scene::{SceneBuffers, scene_wgsl};
use crate::surface::{SEE_THROUGH_WGSL, SURFACE_WGSL};
use crate::view::VIEW_WGSL;
use glam::Vec3;
use wgpu::Device;
use yugen_scene::prepared::{NONE, Rows, SLABS, wgsl};

/// Most lights that the first surface considers in a frame, one sample each; of more some are chosen by their power.
const CANDIDATES: u32 = 16;

/// So many lights have a shadow ray each. Two rays drawn among the five lights of Veach's scene took 60 % of the time and
/// left four times the FLIP.
const FEW_LIGHTS: u32 = 8;

/// Shadow rays of the first surface in a frame where there are more lights than few.
const SHADOW_RAYS: u32 = 8;

/// `shade.wgsl` has 32 sets of samples for a surface, five of them its own.
const _: () = assert!(5 + CANDIDATES + SHADOW_RAYS <= 32);

/// Bounces from which Russian roulette may end a path, as in Mitsuba.
const ROULETTE: u32 = 5;

/// Most bounces: what a path carries so far has gone through a hundred roulettes.
const BOUNCES: u32 = 100;

/// Whether nothing in the scene shines.
pub fn needs_head_light(rows: &Rows) -> bool {
    rows.emitters == 0 && !rows.has_sky()
}

/// The pass, compiled for the models, maps and lights of `rows`. `primary`: the layout of group 1; `bounces`: surfaces that
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
         // Most lights that the first surface considers, and its shadow rays.\nconst CANDIDATES: u32 = {CANDIDATES}u;\n\
         const FEW_LIGHTS: u32 = {FEW_LIGHTS}u;\nconst SHADOW_RAYS: u32 = {SHADOW_RAYS}u;\n\
         // Slabs of a fire.\nconst SLABS: u32 = {SLABS}u;\n\
         // Lights are not seen by the camera.\nconst HIDE_EMITTERS: bool = {};\n\
         // Some surface shines; something does that rays can find.\nconst HAS_SURFACE_LIGHTS: bool = {};\n\
         const RAYS_FIND_LIGHT: bool = {};\n\
         // Samples of lights leave less noise on diffuse surfaces than directions drawn, and find all but the background:\n\
         // not of smooth skies, nor of what is sampled by area.\n\
         const LIGHTS_SUFFICE: bool = {};\nconst HAS_BACKGROUND: bool = {};\n\
         // The scene has no light: it comes from the eye, and white surfaces seen head-on are white.\n\
         const HEAD_LIGHT: bool = {};",
        bounces.min(BOUNCES),
        options.hide_emitters,
        surfaces_shine,
        surfaces_shine || rows.has_sky(),
        !rows.lights_by_area && !rows.has_environment(),
        rows.has_background(),
        needs_head_light(rows)
    );
    let picture = match options.lighting {
        Lighting::Full => include_str!("shade.wgsl").to_string(),
        Lighting::Paper => {
            let Vec3 { x, y, z } = middle(rows);
            let unit = flame_unit(rows);
            format!(
                "const MAP_CENTRE = vec3<f32>({x:?}, {y:?}, {z:?});\nconst MAP_UNIT: f32 = {unit:?};\n{}{}",
                include_str!("primary.wgsl"),
                include_str!("paper.wgsl")
            )
        }
    };
    let pieces = [
        &constants,
        &scene_wgsl(),
        &wgsl(rows),
        HIERARCHY_WGSL,
        SURFACE_WGSL,
        SEE_THROUGH_WGSL,
        VIEW_WGSL,
        FILM_WGSL,
        &flames_wgsl(rows),
        include_str!("samples.wgsl"),
        &picture,
    ];
    let groups: Vec<_> =
        [scene.layout(), primary, film].into_iter().chain(flames.map(Flames::layout)).collect();
    let pipeline = compute(device, "shade_pixels", &pieces, &groups);
    FilmPass::new(device, "shade", pipeline, film, options.size)
}

/// The middle of all that is drawn.
fn middle(rows: &Rows) -> Vec3 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for draw in &rows.draws {
        let row = |r: [f32; 4], p: Vec3| r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3];
        let first = draw.first_triangle as usize;
        for v in rows.triangles.iter().skip(first).take(draw.triangles as usize).flatten() {
            let p = Vec3::from(rows.vertices[*v as usize].position);
            let p = Vec3::from(draw.to_world.map(|r| row(r, p)));
            (low, high) = (low.min(p), high.max(p));
        }
    }
    if low.is_finite() && high.is_finite() { 0.5 * (low + high) } else { Vec3::ZERO }
}

/// What a value of the ambient map counts in the paper's equations. Both the colour of a fire, C_l, which falls off with the square of
/// the distance, and that of the map, C_a, are colours of flames there; so the middle of a flame in the map counts what lights a
/// surface at one metre: intensity over radiance, m², over π as in the diffuse term. 1 where nothing burns.
fn flame_unit(rows: &Rows) -> f32 {
    let units = rows.volumes.iter().filter_map(|v| {
        let grid = &v.grid;
        let (mut of, mut at) = (0.0, Vec3::ZERO);
        for (cell, p) in grid.data.iter().zip(grid.centres()) {
            let light = cell[0] + cell[1] + cell[2];
            of += light;
            at += p * light;
        }
        let away = Vec3::X * (grid.upper - grid.lower).length();
        let seen = grid.march(at / of + away, Vec3::NEG_X, [0.0, 2.0 * away.x], grid.cell().min_element());
        let intensity = grid.intensity(glam::DVec3::X).as_vec3().element_sum();
        // To the world: the edges of the box there over those of the grid.
        let size =
            (v.to_unit.determinant() * (grid.upper - grid.lower).element_product()).abs().cbrt().recip();
        let unit = intensity / seen.radiance.element_sum() * size * size / std::f32::consts::PI;
        unit.is_finite().then_some(unit)
    });
    let units: Vec<f32> = units.collect();
    if units.is_empty() { 1.0 } else { units.iter().sum::<f32>() / units.len() as f32 }
}
