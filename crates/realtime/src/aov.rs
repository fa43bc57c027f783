//! What is known of the first surface, as pictures beside the picture: one dispatch each.

use crate::film::{FILM_WGSL, FilmPass};
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::compute;
use crate::scene::{SceneBuffers, scene_wgsl};
use crate::surface::{OPAQUE_WGSL, PRIMARY_WGSL, SURFACE_WGSL};
use crate::view::VIEW_WGSL;
use wgpu::Device;
use yugen_scene::Aov;

/// Its number in aov.wgsl.
fn number(aov: Aov) -> Option<u32> {
    let all = [Aov::Normal, Aov::ShadingNormal, Aov::Depth, Aov::Position, Aov::Uv, Aov::Id];
    all.iter().position(|a| *a == aov).map(|i| i as u32)
}

/// The pass of one AOV; `None` where this renderer has no such AOV. `primary`: the layout of group 1.
pub fn aov_pass(
    device: &Device,
    aov: Aov,
    scene: &SceneBuffers,
    primary: &wgpu::BindGroupLayout,
    film: &wgpu::BindGroupLayout,
    size: [u32; 2],
) -> Option<FilmPass> {
    let number = number(aov)?;
    let pieces = [
        &scene_wgsl(),
        HIERARCHY_WGSL,
        OPAQUE_WGSL,
        SURFACE_WGSL,
        VIEW_WGSL,
        PRIMARY_WGSL,
        FILM_WGSL,
        include_str!("aov.wgsl"),
    ];
    let groups = [scene.layout(), primary, film];
    let pipeline = compute(device, "add_aov", &pieces, &groups, &[("AOV", f64::from(number))]);
    Some(FilmPass::new(device, aov.name(), pipeline, film, size))
}
