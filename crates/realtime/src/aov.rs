//! What is known of the first surface, as pictures beside the picture: one dispatch each.

use crate::film::{FILM_WGSL, Film};
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::{compute, over_pixels};
use crate::scene::{SceneBuffers, scene_wgsl};
use crate::surface::{OPAQUE_WGSL, PRIMARY_WGSL, SURFACE_WGSL};
use crate::timing::Timestamps;
use crate::view::VIEW_WGSL;
use wgpu::Device;
use yugen_scene::Aov;

/// Its number in aov.wgsl.
fn number(aov: Aov) -> Option<u32> {
    let all = [Aov::Normal, Aov::ShadingNormal, Aov::Depth, Aov::Position, Aov::Uv, Aov::Id];
    all.iter().position(|a| *a == aov).map(|i| i as u32)
}

/// The pass of one AOV and its picture.
pub struct AovPass {
    aov: Aov,
    pipeline: wgpu::ComputePipeline,
    film: Film,
}

impl AovPass {
    /// `None` where this renderer has no such AOV. `primary`: the layout of group 1.
    pub fn new(
        device: &Device,
        aov: Aov,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroupLayout,
        film: &wgpu::BindGroupLayout,
        size: [u32; 2],
    ) -> Option<Self> {
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
        Some(Self { aov, pipeline, film: Film::new(device, film, size) })
    }

    /// Makes room for another number of pixels.
    pub fn resize(&mut self, device: &Device, film: &wgpu::BindGroupLayout, size: [u32; 2]) {
        self.film = Film::new(device, film, size);
    }

    /// Which it is.
    pub fn aov(&self) -> Aov {
        self.aov
    }

    /// Its sums.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Adds this frame's values.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: &Timestamps,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroup,
        size: [u32; 2],
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(self.aov.name()),
            timestamp_writes: timestamps.of_compute(self.aov.name()),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, scene.group(), &[]);
        pass.set_bind_group(1, primary, &[]);
        pass.set_bind_group(2, self.film.group(), &[]);
        over_pixels(&mut pass, size);
    }
}
