//! From stamps to dry ink: water and ink go from the pixels of a layer to the cells of the flow, run, and come back.

use crate::canvas::{BRUSHED, LOADS, Layer, Materials};
use crate::dispersion::Dispersion;
use crate::flow::FlowRow;
use crate::paper::Sheet;
use crate::passes::{Binding, group_for, one_layer, pass, pipeline};
use bytemuck::{Pod, Zeroable};
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{Device, ShaderStages, TextureViewDimension};

/// The way of water and ink between pixels and cells.
pub(crate) struct Drying {
    dispersion: Dispersion,
    wet: wgpu::ComputePipeline,
    dry: wgpu::RenderPipeline,
    /// For each layer: for compute, and for drawing.
    groups: Vec<[wgpu::BindGroup; 2]>,
    cells: [u32; 2],
    steps: u32,
    /// Of each layer.
    mobile: [f32; BRUSHED],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct DryRow {
    size: [u32; 2],
    side: u32,
    unused: u32,
    cells: [u32; 2],
    mobile: f32,
    water: f32,
    granulation: f32,
    unused_too: [f32; 7],
}

/// Side of a cell of water, pixels of a picture of 1080 lines: half of that would take four times as long and twice as many
/// steps to flow as far.
const CELL: f32 = 2.0;
/// How much more ink the deepest hollow takes than the highest grain, of a paper whose grain is one.
const GRANULATION: f32 = 0.5;
/// Steps of the flow: as far as water creeps before it is dry, and the same for each picture, so that films do not boil.
const STEPS: u32 = 33;

impl Drying {
    /// Pixels of a side of a cell, cells across and down, and how open the paper is in each.
    pub fn parts(sheet: &Sheet, m: &Materials) -> (u32, [u32; 2], Vec<f32>) {
        let side = (CELL * m.unit).round().max(1.0) as u32;
        let cells = sheet.size.map(|n| n.div_ceil(side));
        let at = |i: u32| {
            let [x, y] = [i % cells[0], i / cells[0]].map(|k| k * side + side / 2);
            let (x, y) = (x.min(sheet.size[0] - 1), y.min(sheet.size[1] - 1));
            sheet.texels[(y * sheet.size[0] + x) as usize][3]
        };
        (side, cells, (0..cells[0] * cells[1]).map(at).collect())
    }

    pub fn new(
        device: &Device,
        size: [u32; 2],
        (side, cells, open): (u32, [u32; 2], Vec<f32>),
        loads: &wgpu::Texture,
        sheet: &wgpu::TextureView,
        m: &Materials,
    ) -> Self {
        let row = FlowRow::new(cells);
        let dispersion = Dispersion::new(device, &row, &open);
        let mobile: [f32; BRUSHED] = std::array::from_fn(|i| Layer::ALL[i].mobile() * m.bleed);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("dry"),
            source: wgpu::ShaderSource::Wgsl(include_str!("dry.wgsl").into()),
        });
        let mut layouts = None;
        let groups = (0..)
            .zip(mobile)
            .map(|(layer, mobile)| {
                let row = DryRow {
                    size,
                    side,
                    unused: 0,
                    cells,
                    mobile,
                    water: 1.0,
                    granulation: GRANULATION * m.paper.grain,
                    unused_too: [0.0; 7],
                };
                let row = device.create_buffer_init(&BufferInitDescriptor {
                    label: Some("dry"),
                    contents: bytemuck::bytes_of(&row),
                    usage: wgpu::BufferUsages::UNIFORM,
                });
                let view = one_layer(loads, layer);
                let flat = TextureViewDimension::D2;
                let both = [ShaderStages::COMPUTE, ShaderStages::FRAGMENT].map(|stage| {
                    group_for(
                        device,
                        "dry",
                        stage,
                        &[
                            (Binding::Uniform, row.as_entire_binding()),
                            (Binding::Texture(flat, false), wgpu::BindingResource::TextureView(&view)),
                            (Binding::Texture(flat, false), wgpu::BindingResource::TextureView(sheet)),
                            (Binding::Storage, dispersion.cells().as_entire_binding()),
                        ],
                    )
                });
                let [(compute_layout, compute), (draw_layout, draw)] = both;
                layouts = Some([compute_layout, draw_layout]);
                [compute, draw]
            })
            .collect();
        // There are layers.
        let [compute_layout, draw_layout] = layouts.unwrap_or_else(|| unreachable!());
        let wet = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("wet"),
            layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("wet"),
                bind_group_layouts: &[Some(&compute_layout)],
                immediate_size: 0,
            })),
            module: &module,
            entry_point: Some("wet"),
            compilation_options: Default::default(),
            cache: None,
        });
        let targets =
            [Some(wgpu::ColorTargetState { format: LOADS, blend: None, write_mask: wgpu::ColorWrites::ALL })];
        let dry =
            pipeline(device, include_str!("dry.wgsl"), ["everywhere", "dried"], &draw_layout, None, &targets);
        Self { dispersion, wet, dry, groups, cells, steps: STEPS, mobile }
    }

    /// Lets a layer run and dry, onto `dried`.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, layer: usize, dried: &wgpu::TextureView) {
        let [compute, draw] = &self.groups[layer];
        if self.mobile[layer] > 0.0 {
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&self.wet);
                pass.set_bind_group(0, compute, &[]);
                pass.dispatch_workgroups(self.cells[0].div_ceil(8), self.cells[1].div_ceil(8), 1);
            }
            self.dispersion.record(encoder, self.steps);
        }
        let mut pass = pass(encoder, "dry", &[dried]);
        pass.set_pipeline(&self.dry);
        pass.set_bind_group(0, draw, &[]);
        pass.draw(0..3, 0..1);
    }
}
