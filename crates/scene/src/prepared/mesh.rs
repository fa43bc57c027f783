//! Meshes checked and placed.
//!
//! Shading normals are vertex normals carried by the inverse transpose of `to_world` and interpolated. The geometric
//! normal lies on the side that the winding says. A mirroring `to_world` turns the winding round but not the vertex
//! normals; where there are such, the geometric normal stays with them (Mitsuba lets the two part).

use crate::{Mesh, Shape};
use glam::{Affine3A, Mat3, Mat4, Vec2, Vec3};
use std::sync::Arc;

/// Why a scene cannot be shown.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// NaN or infinity where a vertex should be.
    #[error(
        "shape '{shape}': vertex {index} is not finite once placed in the world; repair the mesh or its to_world"
    )]
    Vertex {
        /// Name of the shape.
        shape: String,
        /// Which vertex.
        index: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("shape '{shape}': triangle {triangle} names vertex {index}, but the mesh has {count}")]
    Index {
        /// Name of the shape.
        shape: String,
        /// Which triangle.
        triangle: usize,
        /// Which vertex it names.
        index: u32,
        /// How many there are.
        count: usize,
    },
    /// Normals, texture coordinates, tangents or attributes are not one per vertex.
    #[error("shape '{shape}': {what} must be one per vertex: {found} values for {count} vertices")]
    Count {
        /// Name of the shape.
        shape: String,
        /// Of what.
        what: String,
        /// Numbers found.
        found: usize,
        /// Vertices.
        count: usize,
    },
    /// The transform flattens the shape or is not finite.
    #[error(
        "shape '{shape}': to_world cannot be inverted (zero scale, or not finite); give it a non-zero scale on every axis"
    )]
    Transform {
        /// Name of the shape.
        shape: String,
    },
    /// An instance of a group that does not exist.
    #[error("shape '{shape}': there is no group {group}; the scene has {count}")]
    Group {
        /// Name of the shape.
        shape: String,
        /// Which group it names.
        group: usize,
        /// How many there are.
        count: usize,
    },
    /// A group that holds instances.
    #[error("shape '{shape}': an instance inside a group; place the inner shapes directly")]
    Nested {
        /// Name of the shape.
        shape: String,
    },
    /// More triangles or shapes than can be counted.
    #[error("the scene has {count} triangles and shapes; at most {limit} can be traced")]
    TooMany {
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
}

/// A mesh in the coordinates of the world, or of the group that it is in.
#[derive(Debug, Clone)]
pub struct PlacedMesh {
    /// The vertices there.
    pub mesh: Arc<Mesh>,
    /// `to_world` mirrors: vertex normals stay on their side, the winding changes its own.
    pub mirrored: bool,
    /// Triangles are flat even where the mesh has normals.
    pub face_normals: bool,
}

impl PlacedMesh {
    /// The mesh of `shape` in its place.
    pub fn new(shape: &Shape, mesh: &Arc<Mesh>) -> Result<Self, GeometryError> {
        let name = || shape.name.clone();
        if !shape.to_world.is_finite() {
            return Err(GeometryError::Transform { shape: name() });
        }
        let mesh = if shape.to_world == Mat4::IDENTITY {
            mesh.clone()
        } else {
            Arc::new(placed(mesh, &Affine3A::from_mat4(shape.to_world)))
        };
        let mirrored = shape.to_world.determinant() < 0.0;
        let this = Self { mesh: mesh.clone(), mirrored, face_normals: shape.face_normals };
        check(&mesh, &shape.name)?;
        Ok(this)
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|i| self.mesh.positions[i as usize])
    }

    /// Whether shading normals are interpolated.
    pub fn has_normals(&self) -> bool {
        !self.mesh.normals.is_empty() && !self.face_normals
    }
}

/// What every mesh must be: finite, with as many of everything as there are vertices, and triangles between them.
pub(super) fn check(mesh: &Mesh, shape: &str) -> Result<(), GeometryError> {
    let name = || shape.to_string();
    let count = mesh.positions.len();
    if let Some(index) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(GeometryError::Vertex { shape: name(), index });
    }
    let per_vertex = [
        ("normals", mesh.normals.len()),
        ("texture coordinates", mesh.uvs.len()),
        ("tangents", mesh.tangents.len()),
    ];
    for (what, found) in per_vertex {
        if found != 0 && found != count {
            return Err(GeometryError::Count { shape: name(), what: what.into(), found, count });
        }
    }
    for (what, width, values) in &mesh.attributes {
        let count = if of_faces(what) { mesh.triangles.len() } else { count };
        if width.checked_mul(count) != Some(values.len()) || !matches!(width, 1 | 3) {
            let what = format!("attribute '{what}' of {width} numbers (1 or 3)");
            return Err(GeometryError::Count { shape: name(), what, found: values.len(), count });
        }
    }
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= count) {
            return Err(GeometryError::Index { shape: name(), triangle, index, count });
        }
    }
    Ok(())
}

/// `m` for normals: its cofactors carry them like the inverse transpose, and need no inverse; their sign is that of
/// the determinant.
pub fn for_normals(m: &Affine3A) -> Mat3 {
    let m = Mat3::from(m.matrix3);
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign
}

/// The mesh moved by `m`: once here instead of at every hit.
fn placed(mesh: &Mesh, m: &Affine3A) -> Mesh {
    let normals = for_normals(m);
    Mesh {
        name: mesh.name.clone(),
        positions: mesh.positions.iter().map(|p| m.transform_point3(*p)).collect(),
        normals: mesh.normals.iter().map(|n| (normals * *n).normalize_or_zero()).collect(),
        tangents: mesh.tangents.iter().map(|t| m.transform_vector3(t.truncate()).extend(t.w)).collect(),
        uvs: mesh.uvs.clone(),
        attributes: mesh.attributes.clone(),
        triangles: mesh.triangles.clone(),
    }
}

/// (b − a) × (c − a), exact enough for any triangle that is not flat.
pub fn double_area_normal([a, b, c]: [Vec3; 3]) -> glam::DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}

/// An attribute at a place on a triangle of a mesh, interpolated where it is one of vertices; one number counts as
/// grey. `None`: there is none of this name.
pub fn attribute(mesh: &Mesh, primitive: u32, barycentric: Vec2, name: &str) -> Option<Vec3> {
    let (_, width, values) = mesh.attributes.iter().find(|(n, ..)| n == name)?;
    let at = |i: u32| match width {
        1 => Vec3::splat(values[i as usize]),
        _ => Vec3::from_slice(&values[3 * i as usize..]),
    };
    if of_faces(name) {
        return Some(at(primitive));
    }
    let [a, b, c] = mesh.triangles[primitive as usize].map(at);
    let w = barycentric;
    Some(a * (1.0 - w.x - w.y) + b * w.x + c * w.y)
}

/// Whether an attribute has one value for each triangle.
pub(super) fn of_faces(attribute: &str) -> bool {
    attribute.starts_with("face_")
}

/// Bytes of its vertices, triangles and attributes.
pub fn mesh_bytes(mesh: &Mesh) -> usize {
    size_of_val(&mesh.positions[..])
        + size_of_val(&mesh.normals[..])
        + size_of_val(&mesh.uvs[..])
        + size_of_val(&mesh.tangents[..])
        + size_of_val(&mesh.triangles[..])
        + mesh.attributes.iter().map(|(_, _, v)| size_of_val(&v[..])).sum::<usize>()
}
