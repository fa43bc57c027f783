//! Which lights without extent nothing stands in the way of, tile by tile: `free_lights.wgsl`. Shading then sends no rays to these.

use crate::frame::{Lighting, Options};
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::{compute, over_pixels};
use crate::scene::{SceneBuffers, bind_layout, scene_wgsl};
use crate::surface::{OPAQUE_WGSL, SURFACE_WGSL};
use crate::timing::Timestamps;
use crate::view::VIEW_WGSL;
use crate::visibility::VISIBILITY_WGSL;
use wgpu::{Device, ShaderStages, TextureFormat, TextureUsages};
use yugen_scene::prepared::{Rows, wgsl};

/// A word a tile, a bit a light.
const FORMAT: TextureFormat = TextureFormat::R32Uint;

/// The pass, where there are such lights, and what it writes: a texel of one word a tile of 8 × 8 pixels.
pub(crate) struct FreeLights {
    written: wgpu::BindGroupLayout,
    read: wgpu::BindGroupLayout,
    pipeline: Option<wgpu::ComputePipeline>,
    targets: Targets,
}

struct Targets {
    size: [u32; 2],
    to_write: wgpu::BindGroup,
    to_read: wgpu::BindGroup,
}

impl FreeLights {
    /// For the lights of `rows`. `primary`: the layout of group 1; `view` and `ids`: what is bound there.
    pub fn new(
        device: &Device,
        rows: &Rows,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroupLayout,
        [view, ids]: [wgpu::BindingResource; 2],
        options: &Options,
    ) -> Self {
        let word = wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: FORMAT,
            view_dimension: wgpu::TextureViewDimension::D2,
        };
        let written = bind_layout(device, "free lights", ShaderStages::COMPUTE, [word].into_iter());
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let numbers = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let types = [uniform, numbers, numbers].into_iter();
        let read = bind_layout(device, "view, ids and free lights", ShaderStages::COMPUTE, types);
        let pipeline = Self::are_wanted(rows, options).then(|| {
            let hide = format!("const HIDE_EMITTERS: bool = {};", options.hide_emitters);
            let pieces = [
                &hide,
                &scene_wgsl(),
                &wgsl(rows),
                HIERARCHY_WGSL,
                SURFACE_WGSL,
                OPAQUE_WGSL,
                VIEW_WGSL,
                VISIBILITY_WGSL,
                include_str!("free_lights.wgsl"),
            ];
            compute(device, "find_free_lights", &pieces, &[scene.layout(), primary, &written])
        });
        let targets = targets(device, [&written, &read], [view, ids], options.size);
        Self { written, read, pipeline, targets }
    }

    /// Whether shading of these rows reads the words.
    pub fn are_wanted(rows: &Rows, options: &Options) -> bool {
        rows.has_points() && options.bounces.is_some_and(|b| b > 0) && options.lighting == Lighting::Full
    }

    /// Makes room for another number of pixels.
    pub fn resize(&mut self, device: &Device, view_and_ids: [wgpu::BindingResource; 2], size: [u32; 2]) {
        self.targets = targets(device, [&self.written, &self.read], view_and_ids, size);
    }

    /// Of group 1 of the pass that reads them: view, ids and words.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.read
    }

    /// Group 1 of the pass that reads them.
    pub fn group(&self) -> &wgpu::BindGroup {
        &self.targets.to_read
    }

    /// Looks at what the visibility buffer saw. `primary`: group 1 of this pass.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: &Timestamps,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroup,
    ) {
        let Some(pipeline) = &self.pipeline else { return };
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("free lights"),
            timestamp_writes: timestamps.of_compute("free lights"),
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, scene.group(), &[]);
        pass.set_bind_group(1, primary, &[]);
        pass.set_bind_group(2, &self.targets.to_write, &[]);
        // An invocation a tile.
        over_pixels(&mut pass, self.targets.size.map(|n| n.div_ceil(8)));
    }
}

fn targets(
    device: &Device,
    [written, read]: [&wgpu::BindGroupLayout; 2],
    [view, ids]: [wgpu::BindingResource; 2],
    size: [u32; 2],
) -> Targets {
    let [width, height] = size.map(|n| n.div_ceil(8));
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("free lights"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    });
    let words = texture.create_view(&Default::default());
    let group = |layout, resources: Vec<wgpu::BindingResource>| {
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("free lights"),
            layout,
            entries: &entries,
        })
    };
    let words = || wgpu::BindingResource::TextureView(&words);
    Targets { size, to_write: group(written, vec![words()]), to_read: group(read, vec![view, ids, words()]) }
}
