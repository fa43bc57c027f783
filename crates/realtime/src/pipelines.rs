//! Compute pipelines from pieces of WGSL.

use wgpu::Device;

/// A compute pipeline of `entry` over the pieces of a shader, joined. `groups`: the layouts of groups 0, 1, … .
pub(crate) fn compute(
    device: &Device,
    entry: &str,
    pieces: &[&str],
    groups: &[&wgpu::BindGroupLayout],
) -> wgpu::ComputePipeline {
    of_entry(device, &module(device, entry, pieces), &layout(device, entry, groups), entry)
}

/// The compute pipeline of one entry of a shader.
pub(crate) fn of_entry(
    device: &Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    entry: &str,
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(layout),
        module,
        entry_point: Some(entry),
        compilation_options: Default::default(),
        cache: None,
    })
}

/// The pieces of a shader, joined.
pub(crate) fn module(device: &Device, label: &str, pieces: &[&str]) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(pieces.join("\n").into()),
    })
}

/// A pipeline layout of these groups.
pub(crate) fn layout(
    device: &Device,
    label: &str,
    groups: &[&wgpu::BindGroupLayout],
) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().copied().map(Some).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

/// Workgroups of 8 × 8 pixels.
pub(crate) fn over_pixels(pass: &mut wgpu::ComputePass, size: [u32; 2]) {
    pass.dispatch_workgroups(size[0].div_ceil(8), size[1].div_ceil(8), 1);
}
