//! A mesh of a stage that is where a cloth on the GPU is, without a way through the processor's memory.
//!
//! Vertices are copied, and the boxes of the mesh's tree fitted anew, level by level from the deepest, as
//! [`Hierarchy::deform`](crate::hierarchy::Hierarchy::deform) does it; then those of the top level that the mesh lies in. All other boxes of
//! the top level stay as the processor wrote them: before every fit it writes them again, lest they grow.

use super::ClothPass;
use super::numbered::Numbered;
use crate::StageError;
use crate::hierarchy::HierarchyError;
use crate::pipelines::{layout as pipeline_layout, module, of_entry};
use crate::scene::{SceneBuffers, storage};
use std::fmt::Write;
use wgpu::{BufferUsages, Device, Queue};
use yugen_scene::prepared::{DrawRow, GEOMETRY_WGSL, NONE};

/// A mesh that follows a cloth.
pub(crate) struct Drape {
    mesh: u32,
    bound: Numbered,
    follow: wgpu::ComputePipeline,
    fit: wgpu::ComputePipeline,
    lift: wgpu::ComputePipeline,
    above: wgpu::Buffer,
    /// Nodes of each level.
    levels: Vec<u32>,
    vertices: u32,
}

/// Invocations of a workgroup.
const GROUP: u32 = 64;

impl Drape {
    /// `of`: of each vertex of the mesh that of the cloth, or [`NONE`].
    pub fn new(
        device: &Device,
        scene: &SceneBuffers,
        mesh: u32,
        cloth: &ClothPass,
        of: &[u32],
    ) -> Result<Self, StageError> {
        let row = scene.meshes().get(mesh as usize);
        let count = row.map_or(0, |m| m.vertices as usize);
        let Some(row) = row.filter(|_| of.len() == count && count > 0) else {
            return Err(HierarchyError::Count { mesh: mesh as usize, count, found: of.len() }.into());
        };
        let most = cloth.vertex.len();
        if let Some(vertex) = of.iter().position(|v| *v != NONE && *v as usize >= most) {
            return Err(StageError::ClothVertex { vertex, of: of[vertex], vertices: most });
        }
        let mine = || scene.draws().iter().filter(|d| d.mesh == mesh);
        if mine().any(|d| d.emitter != NONE) {
            return Err(StageError::MovedLight);
        }
        if mine().any(|d| d.flags & DrawRow::HAS_TANGENTS != 0) {
            return Err(StageError::ClothTangents { mesh });
        }
        let levels = scene.hierarchy().levels(mesh);
        let nodes: Vec<u32> = levels.iter().flatten().copied().collect();
        let (first, root) = (nodes.iter().min().copied().unwrap_or(0), nodes.last().copied().unwrap_or(0));
        let normals = mine().any(|d| d.flags & DrawRow::HAS_NORMALS != 0);
        let mut constants = format!("const NORMALS: bool = {normals};\nconst LEAF: u32 = 0x80000000u;\n");
        for (name, value) in [
            ("VERTICES", row.vertices),
            ("FIRST_VERTEX", row.first_vertex),
            ("CLOTH", most as u32),
            ("NODES", nodes.len() as u32),
            ("FIRST_NODE", first),
            ("ROOT", root),
        ] {
            // Strings take all that is written.
            let _ = writeln!(constants, "const {name}: u32 = {value}u;");
        }
        let tables = [of, &nodes].concat();
        let tables = storage(device, "drape", &tables, 4, BufferUsages::empty());
        // No more nodes than draws are above it, and one.
        let room = scene.draws().len() + 1;
        let above = storage(device, "above a drape", &vec![0u32; 1 + 5 * room], 4, BufferUsages::COPY_DST);
        let corners = vec![[0.0f32; 4]; 2 * (nodes.len() + room)];
        let bounds = storage(device, "boxes of a drape", &corners, 16, BufferUsages::empty());
        let mut from = 0;
        let words = levels.iter().map(|level| {
            let count = level.len() as u32;
            from += count;
            [from - count, count]
        });
        let words: Vec<[u32; 2]> = words.collect();
        let [vertices, triangles, draws, hierarchy] = scene.geometry();
        let buffers = [
            (vertices, false),
            (triangles, true),
            (draws, true),
            (hierarchy, false),
            (cloth.vertices(), true),
            (&tables, true),
            (&above, true),
            (&bounds, false),
        ];
        let bound = Numbered::new(device, "drape", &buffers, &words);
        let module = module(device, "drape", &[GEOMETRY_WGSL, &constants, include_str!("drape.wgsl")]);
        let layout = pipeline_layout(device, "drape", &[&bound.layout]);
        let make = |entry: &str| of_entry(device, &module, &layout, entry);
        Ok(Self {
            mesh,
            bound,
            follow: make("follow"),
            fit: make("fit"),
            lift: make("lift"),
            above,
            levels: levels.iter().map(|l| l.len() as u32).collect(),
            vertices: row.vertices,
        })
    }

    /// The mesh.
    pub fn mesh(&self) -> u32 {
        self.mesh
    }

    /// Puts the mesh where the cloth is. The top level is as the processor wrote it, or as other drapes have left it.
    pub fn record(&self, queue: &Queue, encoder: &mut wgpu::CommandEncoder, scene: &SceneBuffers) {
        let above = scene.hierarchy().above(self.mesh, scene.draws());
        let mut words = vec![above.len() as u32];
        words.extend(above.as_flattened());
        queue.write_buffer(&self.above, 0, bytemuck::cast_slice(&words));
        let mut pass = encoder.begin_compute_pass(&Default::default());
        let mut run = |pipeline: &wgpu::ComputePipeline, groups: u32, level: u32| {
            pass.set_pipeline(pipeline);
            self.bound.bind(&mut pass, level);
            pass.dispatch_workgroups(groups, 1, 1);
        };
        run(&self.follow, self.vertices.div_ceil(GROUP), 0);
        for (level, nodes) in (0..).zip(&self.levels) {
            run(&self.fit, nodes.div_ceil(GROUP), level);
        }
        if !self.levels.is_empty() {
            run(&self.lift, 1, 0);
        }
    }
}
