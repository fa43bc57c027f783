//! What both renderers start from.
//!
//! Whatever a scene means before a ray or a pixel exists is decided here, once: materials flattened, textures with their
//! pyramids, meshes checked and placed, the tables by which environments are sampled.

mod environment;
mod form;
mod geometry;
mod material;
mod mesh;
mod texture;

pub use environment::{BadEnvironment, Environment};
pub use form::Form;
pub use geometry::{DrawRow, MeshRow, NONE, VertexRow};
pub use material::{MaterialError, Materials, Scratch, Shading, ShadingPoint, ShadingSample, scratch};
pub use mesh::{GeometryError, PlacedMesh, attribute, double_area_normal, for_normals, mesh_bytes};
pub use texture::{Attributes, Lookup, OnTriangle, Textures};

/// A scene as rows of plain numbers that shaders read as they are.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Vertices of all meshes.
    pub vertices: Vec<VertexRow>,
    /// Triangles of all meshes: indices into `vertices`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The meshes.
    pub meshes: Vec<MeshRow>,
    /// Where they are.
    pub draws: Vec<DrawRow>,
    /// Attributes of meshes that textures ask for.
    pub attribute_names: Vec<String>,
    /// Everything else that is looked up by the word.
    pub words: Vec<u32>,
}
