//! Geometry in its place.

use crate::{GroupId, MaterialId, Mesh, Value};
use glam::Mat4;
use std::sync::Arc;

/// What a shape is, in its own coordinates.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles.
    Mesh(Arc<Mesh>),
    /// Radius 1 about the origin; u along azimuth, v along polar angle from +z, as in Mitsuba.
    Sphere,
    /// [−1, 1]² in z = 0, normal +z, (u, v) = (x + 1, y + 1)/2.
    Rectangle,
    /// Radius 1 in z = 0, normal +z; u radius, v azimuth/2π.
    Disc,
    /// Radius 1 about the z axis from z = 0 to 1, open ends, normal outwards.
    Cylinder,
    /// A group placed again.
    Instance(GroupId),
}

/// Geometry in its place, with its material.
#[derive(Clone, Debug)]
pub struct Shape {
    /// For messages and the id AOV.
    pub name: String,
    /// What.
    pub geometry: Geometry,
    /// Own coordinates to world (or to group).
    pub to_world: Mat4,
    /// Normals point the other way.
    pub flip_normals: bool,
    /// Triangles are flat even where the mesh has normals.
    pub face_normals: bool,
    /// Of what. Ignored for an instance.
    pub material: MaterialId,
    /// Radiance emitted on the side of the normal, in the working space; `None` for a shape that is no light.
    pub emission: Option<Value>,
    /// Emits on both sides.
    pub two_sided_emission: bool,
}

impl Shape {
    /// A shape that neither shines nor is turned inside out.
    pub fn new(name: impl Into<String>, geometry: Geometry, to_world: Mat4, material: MaterialId) -> Self {
        Self {
            name: name.into(),
            geometry,
            to_world,
            flip_normals: false,
            face_normals: false,
            material,
            emission: None,
            two_sided_emission: false,
        }
    }
}
