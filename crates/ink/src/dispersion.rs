//! The flow of [`crate::flow`] on the GPU.

use crate::flow::FlowRow;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, Device, ShaderStages};

/// The flow in WGSL.
pub const FLOW_WGSL: &str = include_str!("flow.wgsl");

/// Water and ink on a grid of cells, in two buffers each, which take turns.
pub struct Dispersion {
    begin: wgpu::ComputePipeline,
    step: wgpu::ComputePipeline,
    /// Reads the first and writes the second, and the other way round.
    groups: [wgpu::BindGroup; 2],
    cells: [wgpu::Buffer; 2],
    size: [u32; 2],
}

impl Dispersion {
    /// For the cells of `row`; `open`: how easily water passes each, 0 to 1.
    pub fn new(device: &Device, row: &FlowRow, open: &[f32]) -> Self {
        let count = u64::from(row.size[0]) * u64::from(row.size[1]);
        let init = |label, contents, usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let uniform = init("flow", bytemuck::bytes_of(row), BufferUsages::UNIFORM);
        let open = init("open", bytemuck::cast_slice(open), BufferUsages::STORAGE);
        let storage = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        };
        let populations = [(); 2].map(|()| storage("populations", count * 36));
        let cells = [(); 2].map(|()| storage("cells", count * 16));
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let read = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("flow"),
            entries: &[
                entry(0, wgpu::BufferBindingType::Uniform),
                entry(1, read(true)),
                entry(2, read(true)),
                entry(3, read(true)),
                entry(4, read(false)),
                entry(5, read(false)),
            ],
        });
        let groups = [0, 1].map(|from: usize| {
            let buffers =
                [&uniform, &open, &populations[from], &cells[from], &populations[1 - from], &cells[1 - from]];
            let entries: Vec<_> = (0..)
                .zip(buffers)
                .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("flow"),
                layout: &layout,
                entries: &entries,
            })
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("flow"),
            source: wgpu::ShaderSource::Wgsl(FLOW_WGSL.into()),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("flow"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = |entry| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        Self { begin: pipeline("begin"), step: pipeline("step"), groups, cells, size: row.size }
    }

    /// Water, ink and two numbers that do not matter of each cell: to be filled before [`Dispersion::record`], and what it
    /// leaves, whose fourth number is fixed ink.
    pub fn cells(&self) -> &wgpu::Buffer {
        &self.cells[0]
    }

    /// So many steps, an even number being one more.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, steps: u32) {
        let mut pass = encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("flow"), timestamp_writes: None });
        let [across, down] = self.size.map(|n| n.div_ceil(8));
        pass.set_pipeline(&self.begin);
        pass.set_bind_group(0, &self.groups[0], &[]);
        pass.dispatch_workgroups(across, down, 1);
        pass.set_pipeline(&self.step);
        // An odd number after the beginning ends in the first buffer.
        for k in 0..steps | 1 {
            pass.set_bind_group(0, &self.groups[(1 - k % 2) as usize], &[]);
            pass.dispatch_workgroups(across, down, 1);
        }
    }
}
