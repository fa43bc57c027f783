//! The picture: what the visibility buffer saw, shaded, and surfaces behind it.

use crate::film::{FILM_WGSL, Film};
use crate::frame::Options;
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::{compute, over_pixels};
use crate::scene::{SceneBuffers, scene_wgsl};
use crate::surface::SURFACE_WGSL;
use crate::timing::Timestamps;
use crate::view::VIEW_WGSL;
use wgpu::Device;
use yugen_scene::prepared::{Rows, wgsl};

/// Most lights that the first surface looks at in a frame, one sample each; of more some are chosen by their power.
const LIGHTS: u32 = 16;

/// Bounces from which Russian roulette may end a path, as in Mitsuba.
const ROULETTE: u32 = 5;

/// Most bounces: what a path carries so far has gone through a hundred roulettes.
const BOUNCES: u32 = 100;

/// The pass and its picture.
pub struct ShadePass {
    pipeline: wgpu::ComputePipeline,
    film: Film,
}

impl ShadePass {
    /// Compiles the shader for the models, maps and lights of `rows`. `primary`: the layout of group 1.
    pub fn new(
        device: &Device,
        rows: &Rows,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroupLayout,
        film: &wgpu::BindGroupLayout,
        options: &Options,
        bounces: u32,
    ) -> Self {
        // Not overrides: naga refuses some shaders that it has to rewrite for those.
        let constants = format!(
            "// Surfaces that reflect light on its way; 0: only what shines is seen.\nconst BOUNCES: u32 = {}u;\n\
             // Bounces from which roulette may end a path.\nconst ROULETTE: u32 = {ROULETTE}u;\n\
             // Most lights that the first surface looks at, one sample each.\nconst LIGHTS: u32 = {LIGHTS}u;\n\
             // Lights are not seen by the camera.\nconst HIDE_EMITTERS: bool = {};",
            bounces.min(BOUNCES),
            options.hide_emitters
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
        Self { pipeline, film: Film::new(device, film, options.size) }
    }

    /// Makes room for another number of pixels.
    pub fn resize(&mut self, device: &Device, film: &wgpu::BindGroupLayout, size: [u32; 2]) {
        self.film = Film::new(device, film, size);
    }

    /// Its sums.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Adds this frame's light.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: &Timestamps,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroup,
        size: [u32; 2],
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("shade"),
            timestamp_writes: timestamps.of_compute("shade"),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, scene.group(), &[]);
        pass.set_bind_group(1, primary, &[]);
        pass.set_bind_group(2, self.film.group(), &[]);
        over_pixels(&mut pass, size);
    }
}
