//! The device of these tests, rows made by hand, and shaders that read and write lists.

use glam::{Affine3A, Mat4, Vec3};
use std::sync::OnceLock;
use wgpu::util::DeviceExt;
use yugen_realtime::scene::SceneBuffers;
use yugen_scene::prepared::{DrawRow, MeshRow, NONE, Rows, VertexRow};

pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

/// The device, made once with `Limits::default()` and the features given here. `None` after printing why; with
/// `REQUIRE_GPU=1` a panic instead.
pub fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    GPU.get_or_init(|| {
        // The adapter of all tests, by its own policy.
        yugen_proof::gpu::Gpu::for_tests()?;
        open(wgpu::Features::empty())
    })
    .as_ref()
}

/// A device of its own.
pub fn open(features: wgpu::Features) -> Option<Gpu> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    adapters.sort_by_key(|a| a.get_info().device_type != wgpu::DeviceType::Cpu);
    let adapter = adapters.into_iter().next()?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_limits: wgpu::Limits::default(),
        required_features: features & adapter.features(),
        ..Default::default()
    }))
    .expect("the adapter has the default limits");
    assert_eq!(device.limits().max_storage_buffers_per_shader_stage, 8);
    assert_eq!(device.limits().max_storage_buffer_binding_size, 128 << 20);
    Some(Gpu { device, queue })
}

impl Gpu {
    /// Runs `main` of a shader over the scene (group 0) with `rows` at binding 0 of group 1, one thread for every two; what
    /// it leaves there.
    pub fn run(&self, scene: &SceneBuffers, pieces: &[&str], rows: &[[f32; 4]]) -> Vec<[f32; 4]> {
        let device = &self.device;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(pieces.join("\n").into()),
        });
        let lists = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(scene.layout()), Some(&lists)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let list = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: bytemuck::cast_slice(rows),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &lists,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: list.as_entire_binding() }],
        });
        let copy = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: list.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, scene.group(), &[]);
            pass.set_bind_group(1, &group, &[]);
            pass.dispatch_workgroups((rows.len() as u32 / 2).div_ceil(64), 1, 1);
        }
        encoder.copy_buffer_to_buffer(&list, 0, &copy, 0, list.size());
        self.queue.submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |r| r.expect("it is mapped"));
        device
            .poll(wgpu::PollType::Wait { submission_index: None, timeout: None })
            .expect("the device lives");
        bytemuck::pod_collect_to_vec(&copy.get_mapped_range(..).expect("it is mapped"))
    }
}

/// Adds a mesh to the rows; its number.
pub fn add_mesh(rows: &mut Rows, corners: &[[Vec3; 3]]) -> u32 {
    let first_vertex = rows.vertices.len() as u32;
    let n = corners.len() as u32;
    rows.vertices.extend(corners.as_flattened().iter().map(|p| VertexRow {
        position: (*p).into(),
        u: 0.0,
        normal: [0.0; 3],
        v: 0.0,
        tangent: [0.0; 4],
    }));
    let first_triangle = rows.triangles.len() as u32;
    rows.triangles.extend((0..n).map(|i| [0, 1, 2].map(|k| first_vertex + 3 * i + k)));
    rows.meshes.push(MeshRow { first_vertex, vertices: 3 * n, first_triangle, triangles: n });
    rows.meshes.len() as u32 - 1
}

/// Places a mesh.
pub fn add_draw(rows: &mut Rows, mesh: u32, to_world: &Affine3A, flags: u32) {
    let m = Mat4::from(*to_world);
    let row = rows.meshes[mesh as usize];
    rows.draws.push(DrawRow {
        to_world: [m.row(0).into(), m.row(1).into(), m.row(2).into()],
        mesh,
        first_triangle: row.first_triangle,
        triangles: row.triangles,
        flags,
        material: 0,
        shape: rows.draws.len() as u32 + 1,
        emitter: NONE,
        attributes: NONE,
    });
}
