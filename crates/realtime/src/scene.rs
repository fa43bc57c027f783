//! The rows of a scene in the device's memory, as group 0 of every shader.

use crate::StageError;
use crate::hierarchy::{Hierarchy, HierarchyStats};
use bytemuck::NoUninit;
use wgpu::util::DeviceExt;
use wgpu::{BufferUsages, Device, Queue, ShaderStages};
use yugen_scene::prepared::{DrawRow, GEOMETRY_WGSL, MeshRow, NONE, Rows, VertexRow};

/// The structs and bindings of group 0 in WGSL.
pub fn scene_wgsl() -> String {
    [GEOMETRY_WGSL, include_str!("scene.wgsl")].join("\n")
}

/// Storage buffers of group 0.
pub const SCENE_BUFFERS: u32 = 7;

/// A scene on the device: vertices, triangles, draws, hierarchy, and what materials and lights look up.
pub struct SceneBuffers {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    vertices: wgpu::Buffer,
    draws: wgpu::Buffer,
    hierarchy_rows: wgpu::Buffer,
    words: wgpu::Buffer,
    numbers: wgpu::Buffer,
    texels: wgpu::Buffer,
    hierarchy: Hierarchy,
    meshes: Vec<MeshRow>,
    placed: Vec<DrawRow>,
}

impl SceneBuffers {
    /// Builds the hierarchy on at most `threads` threads and copies everything.
    pub fn new(device: &Device, rows: &Rows, threads: usize) -> Result<Self, StageError> {
        let limits = device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let check = |what, bytes: usize| {
            let bytes = bytes as u64;
            if bytes > limit { Err(StageError::TooLarge { what, bytes, limit }) } else { Ok(()) }
        };
        check("vertices", size_of_val(&rows.vertices[..]))?;
        check("triangles", size_of_val(&rows.triangles[..]))?;
        check("placed meshes", size_of_val(&rows.draws[..]))?;
        check("materials and lights", size_of_val(&rows.words[..]))?;
        check("tables of reflectance models", size_of_val(&rows.numbers[..]))?;
        check("textures", size_of_val(&rows.texels[..]))?;
        let hierarchy = Hierarchy::build(rows, threads)?;
        check("boxes around triangles", size_of_val(hierarchy.rows()))?;

        let copied = BufferUsages::COPY_DST;
        let vertices = storage(device, "vertices", &rows.vertices, size_of::<VertexRow>(), copied);
        let triangles = storage(device, "triangles", &rows.triangles, 12, copied);
        let draws = storage(device, "draws", &rows.draws, size_of::<DrawRow>(), copied);
        let hierarchy_rows = storage(device, "hierarchy", hierarchy.rows(), 16, copied);
        let words = storage(device, "words", &rows.words, 4, copied);
        let numbers = storage(device, "numbers", &rows.numbers, 4, copied);
        let texels = storage(device, "texels", &rows.texels, 16, copied);
        let buffers = [&vertices, &triangles, &draws, &hierarchy_rows, &words, &numbers, &texels];
        let layout = storage_layout(
            device,
            "scene",
            ShaderStages::VERTEX | ShaderStages::COMPUTE,
            &[true; SCENE_BUFFERS as usize],
        );
        let entries: Vec<_> = buffers
            .iter()
            .enumerate()
            .map(|(i, b)| wgpu::BindGroupEntry { binding: i as u32, resource: b.as_entire_binding() })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout: &layout,
            entries: &entries,
        });
        let meshes = rows.meshes.clone();
        Ok(Self {
            layout,
            group,
            vertices,
            draws,
            hierarchy_rows,
            words,
            numbers,
            texels,
            hierarchy,
            meshes,
            placed: rows.draws.clone(),
        })
    }

    /// Moves the draws, which must be of the same meshes as before. What its matrix flattens, or what is not finite, can
    /// no longer be met by rays.
    pub fn place(&mut self, queue: &Queue, draws: &[DrawRow]) -> Result<(), StageError> {
        // All but the matrix and what it says of mirrors.
        let rest =
            |d: &DrawRow| DrawRow { to_world: [[0.0; 4]; 3], flags: d.flags & !DrawRow::MIRRORED, ..*d };
        if !draws.iter().map(rest).eq(self.placed.iter().map(rest)) {
            return Err(StageError::OtherDraws { found: draws.len(), stage: self.placed.len() });
        }
        let moved = |(a, b): (&DrawRow, &DrawRow)| a.emitter != NONE && a.to_world != b.to_world;
        if draws.iter().zip(&self.placed).any(moved) {
            return Err(StageError::MovedLight);
        }
        self.hierarchy.place(draws)?;
        self.placed.copy_from_slice(draws);
        queue.write_buffer(&self.draws, 0, bytemuck::cast_slice(draws));
        self.write_top(queue);
        Ok(())
    }

    /// Gives what materials and lights look up other values, as many of each as before; `false`: there are more or fewer.
    pub fn refill(&mut self, queue: &Queue, rows: &Rows) -> bool {
        let buffers: [(&wgpu::Buffer, &[u8], u64); 3] = [
            (&self.words, bytemuck::cast_slice(&rows.words), 4),
            (&self.numbers, bytemuck::cast_slice(&rows.numbers), 4),
            (&self.texels, bytemuck::cast_slice(&rows.texels), 16),
        ];
        let same = buffers.iter().all(|(buffer, bytes, row)| buffer.size() == (bytes.len() as u64).max(*row));
        if same {
            for (buffer, bytes, _) in buffers {
                queue.write_buffer(buffer, 0, bytes);
            }
        }
        same
    }

    /// Deforms a mesh: all of its vertices, positions, normals and tangents alike. Its tree stays as it is and gets new
    /// boxes, so that rays slow down the farther vertices move.
    pub fn deform(&mut self, queue: &Queue, mesh: u32, vertices: &[VertexRow]) -> Result<(), StageError> {
        if self.placed.iter().any(|d| d.mesh == mesh && d.emitter != NONE) {
            return Err(StageError::MovedLight);
        }
        let range = self.hierarchy.deform(mesh as usize, vertices)?;
        self.hierarchy.place(&self.placed)?;
        let first = self.meshes[mesh as usize].first_vertex;
        queue.write_buffer(
            &self.vertices,
            u64::from(first) * size_of::<VertexRow>() as u64,
            bytemuck::cast_slice(vertices),
        );
        let rows = &self.hierarchy.rows()[range.clone()];
        queue.write_buffer(&self.hierarchy_rows, 16 * range.start as u64, bytemuck::cast_slice(rows));
        self.write_top(queue);
        Ok(())
    }

    fn write_top(&self, queue: &Queue) {
        let top = &self.hierarchy.rows()[..self.hierarchy.top_rows()];
        queue.write_buffer(&self.hierarchy_rows, 0, bytemuck::cast_slice(top));
    }

    /// Of group 0.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Group 0.
    pub fn group(&self) -> &wgpu::BindGroup {
        &self.group
    }

    /// The meshes.
    pub fn meshes(&self) -> &[MeshRow] {
        &self.meshes
    }

    /// Where they are.
    pub fn draws(&self) -> &[DrawRow] {
        &self.placed
    }

    /// What the hierarchy holds.
    pub fn hierarchy_stats(&self) -> HierarchyStats {
        self.hierarchy.stats()
    }
}

/// A storage buffer of `rows`; of one row of zeros where there are none, for a binding may not be empty.
pub(crate) fn storage<T: NoUninit>(
    device: &Device,
    label: &str,
    rows: &[T],
    row_bytes: usize,
    usage: BufferUsages,
) -> wgpu::Buffer {
    let zeros = vec![0; row_bytes];
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents: if rows.is_empty() { &zeros } else { bytemuck::cast_slice(rows) },
        usage: usage | BufferUsages::STORAGE,
    })
}

/// A layout of storage buffers: whether each is only read.
pub(crate) fn storage_layout(
    device: &Device,
    label: &str,
    visibility: ShaderStages,
    read_only: &[bool],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = read_only
        .iter()
        .enumerate()
        .map(|(i, &read_only)| wgpu::BindGroupLayoutEntry {
            binding: i as u32,
            visibility,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}
