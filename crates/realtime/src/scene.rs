//! The rows of a scene in the device's memory, as group 0 of every shader.

use crate::StageError;
use crate::hierarchy::{Hierarchy, HierarchyStats};
use crate::shade::needs_head_light;
use bytemuck::NoUninit;
use wgpu::util::DeviceExt;
use wgpu::{BufferUsages, Device, Queue, ShaderStages};
use yugen_optics::Fingerprint;
use yugen_reflectance::Kind;
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
    triangles: wgpu::Buffer,
    draws: wgpu::Buffer,
    hierarchy_rows: wgpu::Buffer,
    words: wgpu::Buffer,
    numbers: wgpu::Buffer,
    texels: wgpu::Buffer,
    hierarchy: Hierarchy,
    meshes: Vec<MeshRow>,
    /// Fingerprints of the vertices of each mesh that the device has; `None`: unknown.
    prints: Vec<Option<u64>>,
    placed: Vec<DrawRow>,
    /// Of each mesh, whether it is where a cloth on the device is.
    draped: Vec<bool>,
    /// An update failed on the way, so that the device has some of its rows and not others.
    half_sent: bool,
    plan: Plan,
}

/// What rows must have in common with those of a stage, whose shaders and buffers were made for them.
#[derive(Clone, Debug, PartialEq)]
struct Plan {
    kinds: Vec<Kind>,
    /// What the shader takes for zero, as [`Rows::zeros`]: less of it shows more materials.
    zeros: Vec<u64>,
    has: [bool; 4],
    /// Light from all sides, and of that the same from everywhere. A shader that has it shows a scene without just as well.
    sky: [bool; 2],
    /// No light at all: a shader of its own.
    head_light: bool,
    counts: [u32; 7],
    lengths: [usize; 4],
}

impl Plan {
    fn of(rows: &Rows) -> Self {
        Self {
            kinds: rows.kinds.clone(),
            zeros: rows.zeros.clone(),
            has: [rows.has_cloth, rows.has_programs, rows.lights_by_area, rows.has_environment()],
            sky: [rows.has_sky(), rows.has_background()],
            head_light: needs_head_light(rows),
            counts: [
                rows.lobes,
                rows.turns,
                rows.emitters,
                rows.steps,
                rows.operations,
                rows.lights,
                rows.operands,
            ],
            lengths: [rows.triangles.len(), rows.words.len(), rows.numbers.len(), rows.texels.len()],
        }
    }
}

impl Plan {
    /// Whether what was made for this plan shows rows of `other`.
    fn suits(&self, other: &Self) -> bool {
        let lit = self.sky.iter().zip(&other.sky).all(|(own, other)| *own || !other);
        let zero = self.zeros.iter().zip(&other.zeros).all(|(own, other)| own & !other == 0);
        lit && zero && *self == Self { sky: self.sky, zeros: self.zeros.clone(), ..other.clone() }
    }
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
        let types = [storage_type(true); SCENE_BUFFERS as usize].into_iter();
        let layout = bind_layout(device, "scene", ShaderStages::VERTEX | ShaderStages::COMPUTE, types);
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
            triangles,
            draws,
            hierarchy_rows,
            words,
            numbers,
            texels,
            hierarchy,
            prints: meshes.iter().map(|m| Some(fingerprint(of_mesh(rows, m)))).collect(),
            draped: vec![false; meshes.len()],
            half_sent: false,
            meshes,
            placed: rows.draws.clone(),
            plan: Plan::of(rows),
        })
    }

    /// Takes over what moves between two poses of a scene (vertices, draws, lights), the values of its materials, and where
    /// `textures` have changed those as well. `false`: more than that is different, and nothing is taken over. After an
    /// error a part may have been; the next update sends everything.
    pub fn update(&mut self, queue: &Queue, rows: &Rows, textures: bool) -> Result<bool, StageError> {
        let same = rows.meshes == self.meshes && self.plan.suits(&Plan::of(rows));
        if !same || check_same_draws(&rows.draws, &self.placed).is_err() {
            return Ok(false);
        }
        let textures = textures || self.half_sent;
        let sent = self.send(queue, rows, textures);
        self.half_sent = sent.is_err();
        if self.half_sent {
            self.prints.fill(None);
        }
        sent.map(|()| true)
    }

    fn send(&mut self, queue: &Queue, rows: &Rows, textures: bool) -> Result<(), StageError> {
        for (mesh, row) in rows.meshes.iter().enumerate() {
            let vertices = of_mesh(rows, row);
            let print = Some(fingerprint(vertices));
            if self.prints[mesh] != print && !self.draped[mesh] {
                self.write_mesh(queue, mesh, vertices)?;
                self.prints[mesh] = print;
            }
        }
        queue.write_buffer(&self.words, 0, bytemuck::cast_slice(&rows.words));
        queue.write_buffer(&self.numbers, 0, bytemuck::cast_slice(&rows.numbers));
        if textures {
            queue.write_buffer(&self.texels, 0, bytemuck::cast_slice(&rows.texels));
        }
        self.write_draws(queue, &rows.draws)
    }

    /// Moves the draws, which must be of the same meshes as before. What its matrix flattens, or what is not finite, can
    /// no longer be met by rays.
    pub fn place(&mut self, queue: &Queue, draws: &[DrawRow]) -> Result<(), StageError> {
        check_same_draws(draws, &self.placed)?;
        let moved = |(a, b): (&DrawRow, &DrawRow)| a.emitter != NONE && a.to_world != b.to_world;
        if draws.iter().zip(&self.placed).any(moved) {
            return Err(StageError::MovedLight);
        }
        self.write_draws(queue, draws)
    }

    fn write_draws(&mut self, queue: &Queue, draws: &[DrawRow]) -> Result<(), StageError> {
        self.hierarchy.place(draws)?;
        self.placed.copy_from_slice(draws);
        queue.write_buffer(&self.draws, 0, bytemuck::cast_slice(draws));
        self.write_top(queue);
        Ok(())
    }

    /// Deforms a mesh: all of its vertices, positions, normals and tangents alike. Its tree stays as it is and gets new
    /// boxes, so that rays slow down the farther vertices move.
    pub fn deform(&mut self, queue: &Queue, mesh: u32, vertices: &[VertexRow]) -> Result<(), StageError> {
        if self.placed.iter().any(|d| d.mesh == mesh && d.emitter != NONE) {
            return Err(StageError::MovedLight);
        }
        self.write_mesh(queue, mesh as usize, vertices)?;
        self.prints[mesh as usize] = None;
        self.hierarchy.place(&self.placed)?;
        self.write_top(queue);
        Ok(())
    }

    fn write_mesh(&mut self, queue: &Queue, mesh: usize, vertices: &[VertexRow]) -> Result<(), StageError> {
        let range = self.hierarchy.deform(mesh, vertices)?;
        let first = self.meshes[mesh].first_vertex;
        queue.write_buffer(
            &self.vertices,
            u64::from(first) * size_of::<VertexRow>() as u64,
            bytemuck::cast_slice(vertices),
        );
        let rows = &self.hierarchy.rows()[range.clone()];
        queue.write_buffer(&self.hierarchy_rows, 16 * range.start as u64, bytemuck::cast_slice(rows));
        Ok(())
    }

    fn write_top(&self, queue: &Queue) {
        let top = &self.hierarchy.rows()[..self.hierarchy.top_rows()];
        queue.write_buffer(&self.hierarchy_rows, 0, bytemuck::cast_slice(top));
    }

    /// A mesh is from now on where a cloth on the device is: poses leave it there.
    pub(crate) fn drape(&mut self, mesh: u32) {
        self.draped[mesh as usize] = true;
        self.hierarchy.release(mesh, &self.placed);
    }

    /// Writes the top level as the processor has it.
    pub(crate) fn rewrite_top(&self, queue: &Queue) {
        self.write_top(queue);
    }

    /// Vertices, triangles, draws, and the rows of the hierarchy.
    pub(crate) fn geometry(&self) -> [&wgpu::Buffer; 4] {
        [&self.vertices, &self.triangles, &self.draws, &self.hierarchy_rows]
    }

    /// The processor's own.
    pub(crate) fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
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

fn of_mesh<'a>(rows: &'a Rows, mesh: &MeshRow) -> &'a [VertexRow] {
    &rows.vertices[mesh.first_vertex as usize..][..mesh.vertices as usize]
}

fn fingerprint(vertices: &[VertexRow]) -> u64 {
    Fingerprint::of(bytemuck::cast_slice(vertices))
}

/// Refuses draws that differ in more than their matrices and what those say of mirrors.
fn check_same_draws(draws: &[DrawRow], placed: &[DrawRow]) -> Result<(), StageError> {
    let movable = DrawRow::MIRRORED | DrawRow::FLIPPED;
    let rest = |d: &DrawRow| DrawRow { to_world: [[0.0; 4]; 3], flags: d.flags & !movable, ..*d };
    if !draws.iter().map(rest).eq(placed.iter().map(rest)) {
        return Err(StageError::OtherDraws { found: draws.len(), stage: placed.len() });
    }
    Ok(())
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

/// A storage buffer.
pub(crate) fn storage_type(read_only: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A layout of `types`, from binding 0 on.
pub(crate) fn bind_layout(
    device: &Device,
    label: &str,
    visibility: ShaderStages,
    types: impl Iterator<Item = wgpu::BindingType>,
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(types)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}
