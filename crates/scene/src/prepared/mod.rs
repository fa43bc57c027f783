//! What both renderers start from.
//!
//! Whatever a scene means before a ray or a pixel exists is decided here, once: materials flattened, textures with their
//! pyramids, meshes checked and placed, what shines, the tables by which environments are sampled.

mod environment;
mod form;
mod lights;
mod material;
mod mesh;
mod rows;
mod texture;
mod volume;

pub use environment::{BadEnvironment, Environment};
pub use form::Form;
pub use lights::{DiracLight, EmitterInGroup, LightSource, LightSources, chances_by_power, mean_radiance};
pub use material::{MaterialError, Materials, Scratch, Shading, ShadingPoint, ShadingSample, scratch};
pub use mesh::{GeometryError, PlacedMesh, attribute, double_area_normal, for_normals, mesh_bytes};
pub use rows::{
    DrawRow, GEOMETRY_WGSL, MeshRow, NONE, Rows, RowsError, SLABS, VertexRow, VolumeRow, wgsl, wgsl_where,
};
pub use texture::{Attributes, Lookup, OnTriangle, Textures};
pub use volume::{Marched, Volume};
