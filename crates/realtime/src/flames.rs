//! Volumes in the device's memory, as group 3 of the picture's pass: a texture in which each has a box of its own.

use crate::paper::ambient_map;
use crate::{Lighting, StageError};
use bytemuck::{NoUninit, Zeroable};
use half::f16;
use wgpu::{Device, Queue, ShaderStages};
use yugen_scene::prepared::{Rows, VolumeRow};

/// Most volumes of a scene.
const MOST: usize = 64;

/// The passage of a ray in WGSL; where a scene has no volume, nothing.
pub fn flames_wgsl(rows: &Rows) -> String {
    if rows.volumes.is_empty() {
        return "const HAS_FLAMES: bool = false;\nfn flames_along(origin: vec3<f32>, dir: vec3<f32>, reach: f32, u: f32) -> \
                vec4<f32> { return vec4<f32>(0.0, 0.0, 0.0, 1.0); }\n\
                fn ambient_map() -> vec4<f32> { return vec4<f32>(0.0, 0.0, 0.0, 1.0); }\n"
            .into();
    }
    format!(
        "const HAS_FLAMES: bool = true;\nconst FLAMES: u32 = {}u;\n{}",
        rows.volumes.len().min(MOST),
        include_str!("flames.wgsl")
    )
}

/// As in `flames.wgsl`.
#[derive(Clone, Copy, NoUninit, Zeroable)]
#[repr(C)]
struct FlameRow {
    to_unit: [[f32; 4]; 3],
    corner: [f32; 4],
    edges: [f32; 4],
    cells: [f32; 4],
}

/// The volumes of a scene on the device.
pub struct Flames {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    uniform: wgpu::Buffer,
    texture: wgpu::Texture,
    /// Cells that each has room for.
    room: [u32; 3],
    /// How many lie beside each other along x.
    across: u32,
    count: usize,
    lighting: Lighting,
}

/// Bytes before the rows: the ambient map of the paper's lighting.
const HEAD: u64 = 16;

impl Flames {
    /// Those of `rows`; `None` where there are none. Flames change their size from pose to pose: each gets a quarter more
    /// room than it needs now.
    pub fn new(
        device: &Device,
        queue: &Queue,
        rows: &Rows,
        lighting: Lighting,
    ) -> Result<Option<Self>, StageError> {
        let count = rows.volumes.len();
        if count == 0 {
            return Ok(None);
        }
        if count > MOST {
            return Err(StageError::Volumes { count, limit: MOST });
        }
        let limit = device.limits().max_texture_dimension_3d;
        let most = |axis: usize| rows.volumes.iter().map(|v| v.grid.size[axis]).max().unwrap_or(1);
        let room = [0, 1, 2].map(|axis| (most(axis) + most(axis) / 4 + 4).min(limit.max(most(axis))));
        let across = (limit / room[0]).clamp(1, count as u32);
        let along = (count as u32).div_ceil(across);
        let size = [room[0] * across, room[1], room[2] * along];
        let bytes = size.iter().map(|s| u64::from(*s)).product::<u64>() * 8;
        if size.iter().any(|s| *s > limit) || bytes > device.limits().max_buffer_size {
            return Err(StageError::TooLarge {
                what: "volumes",
                bytes,
                limit: device.limits().max_buffer_size,
            });
        }
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("volumes"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: size[2] },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("volumes"),
            size: HEAD + (count * size_of::<FlameRow>()) as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("volumes"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("volumes"),
            entries: &[
                entry(
                    0,
                    wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Uniform,
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                ),
                entry(
                    1,
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: true },
                        view_dimension: wgpu::TextureViewDimension::D3,
                        multisampled: false,
                    },
                ),
                entry(2, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            ],
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("volumes"),
            layout: &layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&texture.create_view(&Default::default())),
                },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&sampler) },
            ],
        });
        let flames = Self { layout, group, uniform, texture, room, across, count, lighting };
        flames.send(queue, rows);
        Ok(Some(flames))
    }

    /// Whether there is room for those of `rows`.
    pub fn fits(&self, rows: &Rows) -> bool {
        let small = |v: &VolumeRow| (0..3).all(|axis| v.grid.size[axis] <= self.room[axis]);
        rows.volumes.len() == self.count && rows.volumes.iter().all(small)
    }

    /// Takes over those of `rows`, which [`Flames::fits`].
    pub fn send(&self, queue: &Queue, rows: &Rows) {
        let whole = self.texture.size();
        let whole = [whole.width, whole.height, whole.depth_or_array_layers].map(|s| s as f32);
        let mut table = Vec::new();
        let mut cells: Vec<[f16; 4]> = Vec::new();
        for (i, volume) in (0u32..).zip(&rows.volumes) {
            let origin = [i % self.across * self.room[0], 0, i / self.across * self.room[2]];
            let size = volume.grid.size.to_array();
            // Half floats reach 65504.
            let most = |channels: std::ops::Range<usize>| {
                let values = volume.grid.data.iter().flat_map(|v| v[channels.clone()].iter().copied());
                values.filter(|v| v.is_finite()).fold(1e-20, f32::max)
            };
            let (emission, absorption) = (most(0..3), most(3..4));
            cells.clear();
            cells.extend(volume.grid.data.iter().map(|[r, g, b, a]| {
                [r / emission, g / emission, b / emission, a / absorption].map(f16::from_f32)
            }));
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &self.texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: origin[0], y: origin[1], z: origin[2] },
                    aspect: wgpu::TextureAspect::All,
                },
                bytemuck::cast_slice(&cells),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(8 * size[0]),
                    rows_per_image: Some(size[1]),
                },
                wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: size[2] },
            );
            let part = |n: [u32; 3], w: f32| {
                [n[0] as f32 / whole[0], n[1] as f32 / whole[1], n[2] as f32 / whole[2], w]
            };
            table.push(FlameRow {
                to_unit: [0, 1, 2].map(|row| volume.to_unit.row(row).to_array()),
                corner: part(origin, emission * volume.scale),
                edges: part(size, absorption),
                cells: [size[0] as f32, size[1] as f32, size[2] as f32, 0.0],
            });
        }
        let map = match self.lighting {
            Lighting::Full => [0.0; 4],
            Lighting::Paper => ambient_map(rows),
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::cast_slice(&map));
        queue.write_buffer(&self.uniform, HEAD, bytemuck::cast_slice(&table));
    }

    /// Of group 3.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Group 3.
    pub fn group(&self) -> &wgpu::BindGroup {
        &self.group
    }
}
