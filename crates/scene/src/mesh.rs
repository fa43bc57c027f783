//! Triangle meshes.

use glam::{Vec2, Vec3};

/// A triangle mesh in its own coordinates.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For messages.
    pub name: String,
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Empty, or one unit normal per vertex.
    pub normals: Vec<Vec3>,
    /// Empty, or one (u, v) per vertex; v down, so that v = 0 is the top row of a picture.
    pub uvs: Vec<Vec2>,
    /// Empty, or one tangent per vertex with the bitangent's sign in w (glTF's convention).
    pub tangents: Vec<glam::Vec4>,
    /// Extra values: name, width (1 or 3), values; of each triangle where the name begins with `face_`, else of each
    /// vertex.
    pub attributes: Vec<(String, usize, Vec<f32>)>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}
