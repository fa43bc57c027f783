//! Buffers of a shader that runs several times, each time with two words of its own.

use crate::scene::{bind_layout, storage_type};
use wgpu::util::DeviceExt;
use wgpu::{BufferUsages, Device, ShaderStages};

/// Storage buffers from binding 0 on, and behind them a uniform of two words for each run.
pub(super) struct Numbered {
    pub layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    /// Bytes from the words of one run to those of the next.
    stride: u32,
}

impl Numbered {
    /// `buffers`: each with whether it is only read.
    pub fn new(device: &Device, label: &str, buffers: &[(&wgpu::Buffer, bool)], words: &[[u32; 2]]) -> Self {
        let stride = device.limits().min_uniform_buffer_offset_alignment.max(16);
        let mut contents = vec![0u8; stride as usize * words.len().max(1)];
        for (run, words) in contents.chunks_exact_mut(stride as usize).zip(words) {
            run[..8].copy_from_slice(bytemuck::bytes_of(words));
        }
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: &contents,
            usage: BufferUsages::UNIFORM,
        });
        let size = wgpu::BufferSize::new(8);
        let of_run = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: size,
        };
        let types = buffers.iter().map(|(_, read_only)| storage_type(*read_only)).chain([of_run]);
        let layout = bind_layout(device, label, ShaderStages::COMPUTE, types);
        let words = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: &uniform, offset: 0, size });
        let resources = buffers.iter().map(|(buffer, _)| buffer.as_entire_binding()).chain([words]);
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(label),
            layout: &layout,
            entries: &entries,
        });
        Self { layout, group, stride }
    }

    /// Binds them for this run.
    pub fn bind(&self, pass: &mut wgpu::ComputePass, run: u32) {
        pass.set_bind_group(0, &self.group, &[run * self.stride]);
    }
}
