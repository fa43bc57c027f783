//! First pass: which triangle each pixel sees. Rastered; traced where the camera has a lens.
//!
//! The buffer holds ids alone. Where in the triangle a pixel looks, later passes find with the pixel's own ray, in the
//! arithmetic of the tracer. Vertices are pulled from the scene's rows, one call for each run of draws of a mesh, all
//! recorded once.

use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::{compute, layout, module, over_pixels};
use crate::scene::{SceneBuffers, scene_wgsl};
use crate::surface::OPAQUE_WGSL;
use crate::timing::Timestamps;
use crate::view::VIEW_WGSL;
use wgpu::{Device, ShaderStages, TextureFormat, TextureUsages};

/// `visible_hit` and `camera_hit`: what a pixel of the visibility buffer sees. Stands on the view and the surface. Needs a
/// constant `HIDE_EMITTERS`.
pub const VISIBILITY_WGSL: &str = include_str!("visibility.wgsl");

/// `primary_hit`: the same past what lets all light pass. Stands on `visible_hit` and `passes`.
pub const PRIMARY_WGSL: &str = include_str!("primary.wgsl");

/// (draw + 1, triangle), or zeros.
const IDS: TextureFormat = TextureFormat::Rg32Uint;
const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// The pass and its targets.
pub struct Visibility {
    view_group: wgpu::BindGroup,
    bundle: wgpu::RenderBundle,
    trace: wgpu::ComputePipeline,
    ids_layout: wgpu::BindGroupLayout,
    targets: Targets,
}

struct Targets {
    size: [u32; 2],
    texture: wgpu::Texture,
    ids: wgpu::TextureView,
    depth: wgpu::TextureView,
    ids_group: wgpu::BindGroup,
}

impl Visibility {
    /// Compiles the shaders, records the draws of `scene` and makes room for `size` pixels. `view`: the buffer of a
    /// [`crate::view::ViewRow`].
    pub fn new(device: &Device, scene: &SceneBuffers, view: &wgpu::Buffer, size: [u32; 2]) -> Self {
        let view_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("view"),
            entries: &[view_entry(ShaderStages::VERTEX | ShaderStages::COMPUTE)],
        });
        let view_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: &view_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: view.as_entire_binding() }],
        });
        let raster = raster_pipeline(device, &[scene.layout(), &view_layout]);
        let bundle = record(device, scene, &view_group, &raster);
        let ids_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("ids to write"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: ShaderStages::COMPUTE,
                ty: wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format: IDS,
                    view_dimension: wgpu::TextureViewDimension::D2,
                },
                count: None,
            }],
        });
        let pieces =
            [&scene_wgsl(), HIERARCHY_WGSL, OPAQUE_WGSL, VIEW_WGSL, include_str!("visibility_traced.wgsl")];
        let groups = [scene.layout(), &view_layout, &ids_layout];
        let trace = compute(device, "trace_visibility", &pieces, &groups);
        let targets = Targets::new(device, &ids_layout, size);
        Self { view_group, bundle, trace, ids_layout, targets }
    }

    /// Makes room for another number of pixels.
    pub fn resize(&mut self, device: &Device, size: [u32; 2]) {
        self.targets = Targets::new(device, &self.ids_layout, size);
    }

    /// The ids, to be bound as [`primary_layout`] says.
    pub fn ids(&self) -> &wgpu::TextureView {
        &self.targets.ids
    }

    /// Copies the ids of a pixel within the picture to the first eight bytes of `to`.
    pub fn copy_pixel(&self, encoder: &mut wgpu::CommandEncoder, [x, y]: [u32; 2], to: &wgpu::Buffer) {
        let mut from = self.targets.texture.as_image_copy();
        from.origin = wgpu::Origin3d { x, y, z: 0 };
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: None, rows_per_image: None };
        let size = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };
        encoder.copy_texture_to_buffer(from, wgpu::TexelCopyBufferInfo { buffer: to, layout }, size);
    }

    /// By the rasteriser.
    pub fn raster(&self, encoder: &mut wgpu::CommandEncoder, timestamps: &Timestamps) {
        let targets = &self.targets;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("visibility"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &targets.ids,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: timestamps.of_render("visibility"),
            ..Default::default()
        });
        pass.execute_bundles([&self.bundle]);
    }

    /// By rays.
    pub fn trace(&self, encoder: &mut wgpu::CommandEncoder, timestamps: &Timestamps, scene: &SceneBuffers) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("visibility"),
            timestamp_writes: timestamps.of_compute("visibility"),
        });
        pass.set_pipeline(&self.trace);
        pass.set_bind_group(0, scene.group(), &[]);
        pass.set_bind_group(1, &self.view_group, &[]);
        pass.set_bind_group(2, &self.targets.ids_group, &[]);
        over_pixels(&mut pass, self.targets.size);
    }
}

impl Targets {
    fn new(device: &Device, ids_layout: &wgpu::BindGroupLayout, size: [u32; 2]) -> Self {
        let texture = |label, format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
        let ids_texture = texture("ids", IDS, usage);
        let ids = ids_texture.create_view(&Default::default());
        let depth = texture("depth", DEPTH, TextureUsages::empty()).create_view(&Default::default());
        let ids_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("ids to write"),
            layout: ids_layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&ids),
            }],
        });
        Self { size, texture: ids_texture, ids, depth, ids_group }
    }
}

/// The uniform of group 1.
fn view_entry(visibility: ShaderStages) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding: 0,
        visibility,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

/// Group 1 of passes that shade: the view and the ids.
pub fn primary_layout(device: &Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("view and ids"),
        entries: &[
            view_entry(ShaderStages::COMPUTE),
            wgpu::BindGroupLayoutEntry {
                binding: 1,
                visibility: ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Uint,
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            },
        ],
    })
}

/// Group 1 of passes that shade.
pub fn primary_group(
    device: &Device,
    layout: &wgpu::BindGroupLayout,
    view: &wgpu::Buffer,
    ids: &wgpu::TextureView,
) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("view and ids"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: view.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(ids) },
        ],
    })
}

fn raster_pipeline(device: &Device, groups: &[&wgpu::BindGroupLayout]) -> wgpu::RenderPipeline {
    let module =
        module(device, "visibility", &[&scene_wgsl(), VIEW_WGSL, include_str!("visibility_rastered.wgsl")]);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("visibility"),
        layout: Some(&layout(device, "visibility", groups)),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        // Surfaces are seen from both sides.
        primitive: wgpu::PrimitiveState { cull_mode: None, ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            // Nearer is larger; of two in the same place the first draw is seen, as by rays.
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("seen"),
            compilation_options: Default::default(),
            targets: &[Some(IDS.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn record(
    device: &Device,
    scene: &SceneBuffers,
    view_group: &wgpu::BindGroup,
    pipeline: &wgpu::RenderPipeline,
) -> wgpu::RenderBundle {
    let mut bundle = device.create_render_bundle_encoder(&wgpu::RenderBundleEncoderDescriptor {
        label: Some("visibility"),
        color_formats: &[Some(IDS)],
        depth_stencil: Some(wgpu::RenderBundleDepthStencil {
            format: DEPTH,
            depth_read_only: false,
            stencil_read_only: true,
        }),
        sample_count: 1,
        multiview: None,
    });
    bundle.set_pipeline(pipeline);
    bundle.set_bind_group(0, scene.group(), &[]);
    bundle.set_bind_group(1, view_group, &[]);
    let draws = scene.draws();
    let mut i = 0;
    for run in draws.chunk_by(|a, b| a.mesh == b.mesh) {
        let (first, count) = (3 * run[0].first_triangle, 3 * run[0].triangles);
        bundle.draw(first..first + count, i..i + run.len() as u32);
        i += run.len() as u32;
    }
    bundle.finish(&wgpu::RenderBundleDescriptor { label: Some("visibility") })
}
