//! Last pass: a film's sums through exposure, gamut and curve onto a texture or a window.

use crate::film::Film;
use crate::pipelines::{layout, module};
use crate::timing::Timestamps;
use bytemuck::{Pod, Zeroable};
use glam::Mat3;
use wgpu::{Device, Queue, ShaderStages, TextureFormat};
use yugen_optics::ColourSpace;
use yugen_optics::tonemap::Curve;

/// Exposure, gamut and curve in WGSL, twin of [`yugen_optics::tonemap`].
pub const DISPLAY_WGSL: &str = include_str!("display.wgsl");

/// How a film is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplaySettings {
    /// Of the film's colours.
    pub space: ColourSpace,
    /// Primaries of the display, whose numbers have the transfer function of sRGB.
    pub display: ColourSpace,
    /// Stops.
    pub exposure: f32,
    /// From scene light to display light.
    pub curve: Curve,
    /// Where the picture's top left pixel lies on the target; what it leaves free becomes black.
    pub origin: [u32; 2],
}

/// `Display` of display.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct DisplayRow {
    to_primaries: [[f32; 4]; 3],
    to_display: [[f32; 4]; 3],
    luminance: [f32; 3],
    scale: f32,
    origin: [u32; 2],
    size: [u32; 2],
    curve: u32,
    target_encodes: u32,
    unused: [u32; 2],
}

impl DisplayRow {
    /// For a film of `size` pixels whose samples weigh `weight` together. `target_encodes`: the target turns light into
    /// the numbers of sRGB by itself.
    pub fn new(settings: &DisplaySettings, size: [u32; 2], weight: f64, target_encodes: bool) -> Self {
        let primaries = settings.curve.primaries(settings.display);
        let columns = |m: Mat3| m.to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0]);
        Self {
            to_primaries: columns(settings.space.matrix_to(primaries) * settings.exposure.exp2()),
            to_display: columns(primaries.matrix_to(settings.display)),
            luminance: primaries.luminance_weights().into(),
            scale: if weight == 0.0 { 0.0 } else { (1.0 / weight) as f32 },
            origin: settings.origin,
            size,
            // In the order of display.wgsl, which is that of the list.
            curve: Curve::ALL.iter().position(|c| *c == settings.curve).unwrap_or(0) as u32,
            target_encodes: u32::from(target_encodes),
            unused: [0; 2],
        }
    }
}

/// The pass, for targets of one format.
pub struct DisplayPass {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    row: wgpu::Buffer,
    group: wgpu::BindGroup,
    size: [u32; 2],
    target_encodes: bool,
}

impl DisplayPass {
    /// Compiles for targets of `format` (8 or 10 bits a channel, or floats) and shows `film`.
    pub fn new(device: &Device, format: TextureFormat, film: &Film) -> Self {
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let inputs = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("display"),
            entries: &[
                entry(0, ShaderStages::FRAGMENT, wgpu::BufferBindingType::Uniform),
                entry(1, ShaderStages::FRAGMENT, wgpu::BufferBindingType::Storage { read_only: true }),
            ],
        });
        let module = module(device, "display", &[DISPLAY_WGSL, include_str!("display_pass.wgsl")]);
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("display"),
            layout: Some(&layout(device, "display", &[&inputs])),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("everywhere"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("show"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let row = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("display"),
            size: size_of::<DisplayRow>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = group(device, &inputs, &row, film);
        Self { pipeline, layout: inputs, row, group, size: film.size(), target_encodes: format.is_srgb() }
    }

    /// Shows another film.
    pub fn set_film(&mut self, device: &Device, film: &Film) {
        self.group = group(device, &self.layout, &self.row, film);
        self.size = film.size();
    }

    /// Shows the film, whose samples weigh `weight` together, on `target`.
    pub fn record(
        &self,
        queue: &Queue,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: Option<&Timestamps>,
        target: &wgpu::TextureView,
        settings: &DisplaySettings,
        weight: f64,
    ) {
        let row = DisplayRow::new(settings, self.size, weight, self.target_encodes);
        queue.write_buffer(&self.row, 0, bytemuck::bytes_of(&row));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("display"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            timestamp_writes: timestamps.and_then(|t| t.of_render("display")),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn group(
    device: &Device,
    layout: &wgpu::BindGroupLayout,
    row: &wgpu::Buffer,
    film: &Film,
) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("display"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: row.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: film.buffer().as_entire_binding() },
        ],
    })
}
