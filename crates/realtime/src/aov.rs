//! What is known of the first surface, as pictures beside the picture: one dispatch each.

use crate::film::{FilmPass, opaque_wgsl, shading_wgsl};
use crate::frame::Options;
use crate::pipelines::compute;
use crate::scene::SceneBuffers;
use crate::visibility::PRIMARY_WGSL;
use wgpu::Device;
use yugen_scene::Aov;
use yugen_scene::prepared::{DrawRow, Rows};

/// Its number in aov.wgsl.
fn number(aov: Aov) -> Option<u32> {
    let all = [Aov::Normal, Aov::ShadingNormal, Aov::Depth, Aov::Position, Aov::Uv, Aov::Id, Aov::Albedo];
    all.iter().position(|a| *a == aov).map(|i| i as u32)
}

/// The pass of one AOV, compiled for `rows`; `None` where this renderer has no such AOV. `primary`: the layout of group 1.
pub fn aov_pass(
    device: &Device,
    aov: Aov,
    rows: &Rows,
    scene: &SceneBuffers,
    primary: &wgpu::BindGroupLayout,
    film: &wgpu::BindGroupLayout,
    options: &Options,
) -> Option<FilmPass> {
    let number = number(aov)?;
    // Not overrides: naga refuses some shaders that it has to rewrite for those.
    let constants = format!(
        "const AOV: u32 = {number}u;\nconst HIDE_EMITTERS: bool = {};\nconst FILM_HALVES: bool = false;",
        options.hide_emitters
    );
    // Materials only where light can pass them, or where they are asked for their colour or for what maps make of normals.
    let asked = match aov {
        Aov::Albedo => true,
        Aov::ShadingNormal => rows.turns > 0 || rows.has_cloth,
        _ => false,
    };
    let sees_through = rows.draws.iter().any(|d| d.flags & DrawRow::SEE_THROUGH != 0);
    let pieces = [
        constants.as_str(),
        &if sees_through || asked { shading_wgsl(rows) } else { opaque_wgsl() },
        PRIMARY_WGSL,
        include_str!("aov.wgsl"),
        if asked { include_str!("aov_material.wgsl") } else { include_str!("aov_plain.wgsl") },
    ];
    let groups = [scene.layout(), primary, film];
    let pipeline = compute(device, "add_aov", &pieces, &groups);
    Some(FilmPass::new(device, aov.name(), pipeline, film, options.size, 0))
}
