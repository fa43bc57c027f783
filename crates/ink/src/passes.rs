//! What the passes of the canvas are put together from: bindings, pipelines, targets.

use wgpu::util::{DeviceExt, TextureDataOrder};
use wgpu::{
    Device, Extent3d, Queue, ShaderStages, TextureFormat, TextureSampleType, TextureUsages,
    TextureViewDimension,
};

pub(crate) fn one_layer(texture: &wgpu::Texture, layer: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..Default::default()
    })
}

pub(crate) enum Binding {
    Uniform,
    Storage,
    Texture(TextureViewDimension, bool),
    /// A flat texture of whole numbers.
    Numbers,
    Sampler,
}

pub(crate) fn group(
    device: &Device,
    label: &str,
    bindings: &[(Binding, wgpu::BindingResource)],
) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    group_for(device, label, ShaderStages::VERTEX_FRAGMENT, bindings)
}

pub(crate) fn group_for(
    device: &Device,
    label: &str,
    visibility: ShaderStages,
    bindings: &[(Binding, wgpu::BindingResource)],
) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    let layout_entries: Vec<_> = (0..)
        .zip(bindings)
        .map(|(binding, (kind, _))| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: match kind {
                Binding::Storage => wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                Binding::Uniform => wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                Binding::Texture(view_dimension, filterable) => wgpu::BindingType::Texture {
                    sample_type: TextureSampleType::Float { filterable: *filterable },
                    view_dimension: *view_dimension,
                    multisampled: false,
                },
                Binding::Numbers => wgpu::BindingType::Texture {
                    sample_type: TextureSampleType::Uint,
                    view_dimension: TextureViewDimension::D2,
                    multisampled: false,
                },
                Binding::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            },
            count: None,
        })
        .collect();
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &layout_entries,
    });
    let entries: Vec<_> = (0..)
        .zip(bindings)
        .map(|(binding, (_, resource))| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout: &layout,
        entries: &entries,
    });
    (layout, group)
}

pub(crate) fn pipeline(
    device: &Device,
    wgsl: &str,
    [vertex, fragment]: [&str; 2],
    layout: &wgpu::BindGroupLayout,
    instances: Option<&wgpu::VertexBufferLayout>,
    targets: &[Option<wgpu::ColorTargetState>],
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(fragment),
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    });
    let buffers: Vec<_> = instances.cloned().into_iter().map(Some).collect();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(fragment),
            bind_group_layouts: &[Some(layout)],
            immediate_size: 0,
        })),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers: &buffers,
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A render pass over targets that are cleared to zero.
pub(crate) fn pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &str,
    targets: &[&wgpu::TextureView],
) -> wgpu::RenderPass<'a> {
    let attachments: Vec<_> = targets
        .iter()
        .copied()
        .map(|view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })
        })
        .collect();
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &attachments,
        ..Default::default()
    })
}

pub(crate) fn bytes_texture(
    device: &Device,
    queue: &Queue,
    label: &str,
    format: TextureFormat,
    [width, height]: [u32; 2],
    bytes: &[u8],
) -> wgpu::TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    };
    device
        .create_texture_with_data(queue, &descriptor, TextureDataOrder::LayerMajor, bytes)
        .create_view(&Default::default())
}
