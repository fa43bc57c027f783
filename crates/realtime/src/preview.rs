//! What is shown while a picture is young: the picture before, where its surfaces are seen now, and neighbours on the same
//! surface.
//!
//! An approximation, beside the sum and never in it: light that changed, reflections and what a moved shape uncovers are
//! late or blurred. What the picture before counts falls to nothing over [`FADE`] frames, and nothing is smoothed from the
//! eighth on (later where the filter is negative somewhere: such frames are worth less), so that what is shown tends to
//! what the sum tends to.

use crate::film::{Film, film_bytes};
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::{compute, layout, module, over_pixels};
use crate::scene::{SceneBuffers, bind_layout, scene_wgsl, storage_type};
use crate::surface::{OPAQUE_WGSL, SURFACE_WGSL};
use crate::timing::Timestamps;
use crate::view::{VIEW_WGSL, View};
use bytemuck::{Pod, Zeroable};
use wgpu::{BindingResource, Device, Queue, ShaderStages, TextureFormat};

/// What is shown in place of the mean of frames. Nothing of it is on by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Preview {
    /// When the camera or the scene moves, surfaces keep what was known of their light.
    pub reproject: bool,
    /// The first frames are smoothed along surfaces.
    pub smooth: bool,
}

impl Preview {
    /// All of it, for windows.
    pub const ALL: Self = Self { reproject: true, smooth: true };

    /// Whether anything is on.
    pub fn is_on(self) -> bool {
        self.reproject || self.smooth
    }
}

/// Frames until the picture before no longer counts.
pub const FADE: u32 = 32;

/// `Preview` of preview.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct PreviewRow {
    before_to_clip: [[f32; 4]; 4],
    size: [u32; 2],
    frames: u32,
    has_before: u32,
    weight: f32,
    fade: f32,
    smooth: u32,
    footprint: f32,
    eye: [f32; 3],
    orthographic: u32,
}

/// The passes and what they keep from frame to frame.
pub(crate) struct PreviewPass {
    pub settings: Preview,
    gbuffer: wgpu::ComputePipeline,
    blend: wgpu::ComputePipeline,
    smooth: wgpu::ComputePipeline,
    layouts: [wgpu::BindGroupLayout; 2],
    row: wgpu::Buffer,
    kept: Kept,
    /// Which of the two of everything is of now.
    turn: usize,
    /// What the other one saw.
    before: Option<View>,
    /// What this one sees.
    now: Option<View>,
}

/// What goes with the number of pixels.
struct Kept {
    size: [u32; 2],
    shown: Film,
    gbuffer_groups: [wgpu::BindGroup; 2],
    groups: [wgpu::BindGroup; 2],
}

impl PreviewPass {
    /// `primary`: the layout of group 1; `film`: what is summed.
    pub fn new(
        device: &Device,
        settings: Preview,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroupLayout,
        film: &Film,
    ) -> Self {
        let written = wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: FORMAT,
            view_dimension: wgpu::TextureViewDimension::D2,
        };
        let read = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let layouts = [
            bind_layout(device, "positions and normals", ShaderStages::COMPUTE, [written; 2].into_iter()),
            bind_layout(
                device,
                "preview",
                ShaderStages::COMPUTE,
                [uniform]
                    .into_iter()
                    .chain([true, false, true, false, false].map(storage_type))
                    .chain([read; 3]),
            ),
        ];
        let pieces = [
            &scene_wgsl(),
            HIERARCHY_WGSL,
            OPAQUE_WGSL,
            SURFACE_WGSL,
            VIEW_WGSL,
            "@group(1) @binding(1) var visibility: texture_2d<u32>;",
            include_str!("gbuffer.wgsl"),
        ];
        let gbuffer = compute(device, "write_gbuffer", &pieces, &[scene.layout(), primary, &layouts[0]]);
        let shader = module(device, "preview", &[include_str!("preview.wgsl")]);
        let pipeline_layout = layout(device, "preview", &[&layouts[1]]);
        let pipeline = |entry| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline_layout),
                module: &shader,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        let (blend, smooth) = (pipeline("blend"), pipeline("smooth_pixels"));
        let row = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("preview"),
            size: size_of::<PreviewRow>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let kept = Kept::new(device, &layouts, &row, film);
        Self { settings, gbuffer, blend, smooth, layouts, row, kept, turn: 0, before: None, now: None }
    }

    /// Makes room for the pixels of another film.
    pub fn resize(&mut self, device: &Device, film: &Film) {
        self.kept = Kept::new(device, &self.layouts, &self.row, film);
        self.forget();
    }

    /// Begins without what was seen before: it was of another light or other materials.
    pub fn forget(&mut self) {
        (self.before, self.now) = (None, None);
    }

    /// What is shown, in place of the film: means, not sums.
    pub fn shown(&self) -> &Film {
        &self.kept.shown
    }

    /// After the film has frame `frames` of what `view` sees, counted from one.
    #[allow(clippy::too_many_arguments)]
    pub fn record(
        &mut self,
        queue: &Queue,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: &Timestamps,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroup,
        view: &View,
        frames: u32,
        weight: f64,
    ) {
        if frames == 1 {
            self.before = self.now.replace(view.clone());
            self.turn = 1 - self.turn;
        }
        let before = self.before.as_ref().filter(|_| self.settings.reproject);
        let (eye, footprint, orthographic) = view.footprint();
        let row = PreviewRow {
            before_to_clip: before.map_or([[0.0; 4]; 4], View::to_clip_of_centres),
            size: self.kept.size,
            frames,
            has_before: u32::from(before.is_some()),
            weight: weight as f32,
            fade: 1.0 - frames.min(FADE) as f32 / FADE as f32,
            smooth: u32::from(self.settings.smooth),
            footprint,
            eye: eye.into(),
            orthographic: u32::from(orthographic),
        };
        queue.write_buffer(&self.row, 0, bytemuck::bytes_of(&row));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("preview"),
            timestamp_writes: timestamps.of_compute("preview"),
        });
        if frames == 1 {
            pass.set_pipeline(&self.gbuffer);
            pass.set_bind_group(0, scene.group(), &[]);
            pass.set_bind_group(1, primary, &[]);
            pass.set_bind_group(2, &self.kept.gbuffer_groups[self.turn], &[]);
            over_pixels(&mut pass, self.kept.size);
        }
        for pipeline in [&self.blend, &self.smooth] {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.kept.groups[self.turn], &[]);
            over_pixels(&mut pass, self.kept.size);
        }
    }
}

const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

impl Kept {
    fn new(
        device: &Device,
        [gbuffer_layout, preview_layout]: &[wgpu::BindGroupLayout; 2],
        row: &wgpu::Buffer,
        film: &Film,
    ) -> Self {
        let size = film.size();
        let texture = || {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("positions or normals"),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let buffer = || {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("preview"),
                size: film_bytes(size),
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        let (positions, normals) = ([texture(), texture()], [texture(), texture()]);
        let (carried, seen) = (buffer(), [buffer(), buffer()]);
        let shown = Film::new(device, &Film::layout(device), size);
        let group = |layout, resources: &[BindingResource<'_>]| {
            let entries: Vec<_> = (0..)
                .zip(resources)
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("preview"),
                layout,
                entries: &entries,
            })
        };
        let view = BindingResource::TextureView;
        let gbuffer_groups =
            [0, 1].map(|now| group(gbuffer_layout, &[view(&positions[now]), view(&normals[now])]));
        let groups = [0, 1].map(|now: usize| {
            let buffers = [row, film.buffer(), &carried, &seen[1 - now], &seen[now], shown.buffer()];
            let textures = [&positions[now], &normals[now], &positions[1 - now]];
            let all: Vec<_> =
                buffers.iter().map(|b| b.as_entire_binding()).chain(textures.map(view)).collect();
            group(preview_layout, &all)
        });
        Self { size, shown, gbuffer_groups, groups }
    }
}
