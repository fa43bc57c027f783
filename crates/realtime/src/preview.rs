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
use crate::visibility::VISIBILITY_WGSL;
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

/// A picture counts as no more frames than this once the camera has moved.
const MOVED_FRAMES: f32 = 16.0;

/// And no more than this once shapes have: where a surface is now another part of it may have been.
const POSED_FRAMES: f32 = 4.0;

/// `Preview` of preview.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct PreviewRow {
    before_to_clip: [[f32; 4]; 4],
    size: [u32; 2],
    before_size: [u32; 2],
    frames: u32,
    has_before: u32,
    weight: f32,
    fade: f32,
    eye: [f32; 3],
    footprint: f32,
    smooth: u32,
    orthographic: u32,
    most_frames: f32,
    unused: u32,
}

/// The passes and what they keep from frame to frame.
pub(crate) struct PreviewPass {
    pub settings: Preview,
    gbuffer: wgpu::ComputePipeline,
    blend: wgpu::ComputePipeline,
    smooth: wgpu::ComputePipeline,
    layouts: [wgpu::BindGroupLayout; 2],
    row: wgpu::Buffer,
    targets: Targets,
    /// Which of the two histories is of this picture; the other one is of that before.
    current: usize,
    /// What the picture before saw, and in how many pixels.
    before: Option<(View, [u32; 2])>,
    /// What this one sees.
    now: Option<View>,
    /// Pixels of the last picture of which there was a frame.
    seen_size: [u32; 2],
    /// Shapes or lights have moved since the picture before.
    posed: bool,
    /// They have since the last frame.
    pose_follows: bool,
}

/// What is written for a picture, and read for the next.
#[derive(Clone)]
struct History {
    positions: wgpu::TextureView,
    normals: wgpu::TextureView,
    /// Colour and how many frames it is worth.
    colours: wgpu::Buffer,
}

/// What goes with the number of pixels.
struct Targets {
    size: [u32; 2],
    shown: Film,
    histories: [History; 2],
    gbuffer_groups: [wgpu::BindGroup; 2],
    groups: [wgpu::BindGroup; 2],
    /// There was no frame yet.
    unused: bool,
    /// What was seen last before, in another size, and what is bound in place of `groups` for the first picture.
    last: Option<(History, wgpu::BindGroup)>,
}

impl PreviewPass {
    /// `primary`: the layout of group 1; `film`: what is summed; `hide_emitters` as in [`crate::Options`].
    pub fn new(
        device: &Device,
        settings: Preview,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroupLayout,
        film: &Film,
        hide_emitters: bool,
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
        let hide = format!("const HIDE_EMITTERS: bool = {hide_emitters};");
        let pieces = [
            &scene_wgsl(),
            HIERARCHY_WGSL,
            OPAQUE_WGSL,
            SURFACE_WGSL,
            VIEW_WGSL,
            &hide,
            VISIBILITY_WGSL,
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
        let targets = Targets::new(device, &layouts, &row, film, None, 0);
        Self {
            settings,
            gbuffer,
            blend,
            smooth,
            layouts,
            row,
            targets,
            current: 0,
            before: None,
            now: None,
            seen_size: film.size(),
            posed: false,
            pose_follows: false,
        }
    }

    /// Makes room for the pixels of another film. What was seen so far is known to the next picture.
    pub fn resize(&mut self, device: &Device, film: &Film) {
        let seen = match &self.targets {
            Targets { unused: true, last, .. } => last.as_ref().map(|(history, _)| history),
            targets => Some(&targets.histories[self.current]),
        };
        let last = seen.cloned().filter(|_| self.now.is_some());
        self.targets = Targets::new(device, &self.layouts, &self.row, film, last, 1 - self.current);
    }

    /// Shapes or lights have moved.
    pub fn pose(&mut self) {
        self.pose_follows = true;
    }

    /// Begins without what was seen before: it was of another light or other materials.
    pub fn forget(&mut self) {
        (self.before, self.now) = (None, None);
    }

    /// What is shown, in place of the film: means, not sums.
    pub fn shown(&self) -> &Film {
        &self.targets.shown
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
            let known = self.now.replace(view.clone());
            self.before = known.map(|before| (before, self.seen_size));
            if !std::mem::take(&mut self.targets.unused) {
                self.targets.last = None;
            }
            self.seen_size = self.targets.size;
            self.current = 1 - self.current;
            self.posed = std::mem::take(&mut self.pose_follows);
        }
        let before = self.before.as_ref().filter(|_| self.settings.reproject);
        let (eye, footprint, orthographic) = view.footprint();
        let row = PreviewRow {
            before_to_clip: before.map_or([[0.0; 4]; 4], |(view, _)| view.to_clip_of_centres()),
            size: self.targets.size,
            before_size: before.map_or(self.targets.size, |(_, size)| *size),
            frames,
            has_before: u32::from(before.is_some()),
            weight: weight as f32,
            fade: 1.0 - frames.min(FADE) as f32 / FADE as f32,
            eye: eye.into(),
            footprint,
            smooth: u32::from(self.settings.smooth),
            orthographic: u32::from(orthographic),
            most_frames: if self.posed { POSED_FRAMES } else { MOVED_FRAMES },
            unused: 0,
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
            pass.set_bind_group(2, &self.targets.gbuffer_groups[self.current], &[]);
            over_pixels(&mut pass, self.targets.size);
        }
        let group = self.targets.last.as_ref().map_or(&self.targets.groups[self.current], |(_, group)| group);
        for pipeline in [&self.blend, &self.smooth] {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            over_pixels(&mut pass, self.targets.size);
        }
    }
}

const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

impl Targets {
    /// `last`: what was seen last, in another size; `next`: which of the histories is that of the next picture.
    fn new(
        device: &Device,
        [gbuffer_layout, preview_layout]: &[wgpu::BindGroupLayout; 2],
        row: &wgpu::Buffer,
        film: &Film,
        last: Option<History>,
        next: usize,
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
        let histories =
            [0, 1].map(|_| History { positions: texture(), normals: texture(), colours: buffer() });
        let (carried, shown) = (buffer(), Film::new(device, &Film::layout(device), size));
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
        let gbuffer_groups = [0, 1]
            .map(|i| group(gbuffer_layout, &[view(&histories[i].positions), view(&histories[i].normals)]));
        let preview_group = |before: &History, now: &History| {
            let buffers = [row, film.buffer(), &carried, &before.colours, &now.colours, shown.buffer()];
            let textures = [&now.positions, &now.normals, &before.positions];
            let all: Vec<_> = buffers
                .iter()
                .map(|b| b.as_entire_binding())
                .chain(textures.map(BindingResource::TextureView))
                .collect();
            group(preview_layout, &all)
        };
        let groups = [0, 1].map(|now: usize| preview_group(&histories[1 - now], &histories[now]));
        let last = last.map(|before| {
            let group = preview_group(&before, &histories[next]);
            (before, group)
        });
        Self { size, shown, histories, gbuffer_groups, groups, unused: true, last }
    }
}
