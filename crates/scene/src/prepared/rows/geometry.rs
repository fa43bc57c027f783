//! Shapes as rows: vertices, triangles, and where each mesh is drawn.
//!
//! A mesh is stored once, in its own coordinates, however often it is placed. Forms are meshes here, with the normals and
//! parameters of the form at every vertex.

use super::Rows;
use crate::prepared::mesh::{GeometryError, check, of_faces};
use crate::prepared::{Form, PlacedMesh};
use crate::{Geometry, Mesh, Scene, Shape};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Mat4, Vec2};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A vertex: 12 floats.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct VertexRow {
    /// In the mesh's own coordinates.
    pub position: [f32; 3],
    /// Texture coordinate across.
    pub u: f32,
    /// Unit; zero where the mesh has none.
    pub normal: [f32; 3],
    /// Texture coordinate down.
    pub v: f32,
    /// And the bitangent's sign; zero where the mesh has none.
    pub tangent: [f32; 4],
}

/// Where a mesh lies in the rows.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct MeshRow {
    /// Its first vertex.
    pub first_vertex: u32,
    /// How many it has.
    pub vertices: u32,
    /// Its first triangle.
    pub first_triangle: u32,
    /// How many it has.
    pub triangles: u32,
}

/// A mesh in its place: 20 words.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct DrawRow {
    /// The three rows of the affine matrix to the world.
    pub to_world: [[f32; 4]; 3],
    /// Index of the [`MeshRow`].
    pub mesh: u32,
    /// Its first triangle.
    pub first_triangle: u32,
    /// How many it has.
    pub triangles: u32,
    /// What it has, of the constants of this type.
    pub flags: u32,
    /// Index of the material.
    pub material: u32,
    /// What the id AOV calls it: the shape or the instance, counted from one.
    pub shape: u32,
    /// Index of the emitter that it is, or [`NONE`].
    pub emitter: u32,
    /// Word where its table of attributes begins, or [`NONE`].
    pub attributes: u32,
}

/// No index.
pub const NONE: u32 = u32::MAX;

impl DrawRow {
    /// Shading normals are interpolated.
    pub const HAS_NORMALS: u32 = 1;
    /// Texture coordinates are those of the vertices, else the weights of the second and third corner.
    pub const HAS_UVS: u32 = 2;
    /// Tangents are those of the vertices, else along u.
    pub const HAS_TANGENTS: u32 = 4;
    /// `to_world` mirrors.
    pub const MIRRORED: u32 = 8;
    /// Normals point the other way.
    pub const FLIPPED: u32 = 16;
    /// Light can pass straight through it somewhere.
    pub const SEE_THROUGH: u32 = 32;
    /// Logs of a fire: what they keep of its light is known, so that rays for what else stands in between pass them.
    pub const FUEL: u32 = 64;
}

/// Segments of a form around its axis, and half as many down a sphere: its outline is off by 3e-4 of the radius.
const SEGMENTS: u32 = 256;

/// Most triangles: a quarter of what an index counts.
const MOST: usize = 1 << 28;

impl Rows {
    /// Adds the shapes of `scene`. `see_through` says it of a material; `emitter` is the number of a shape's emitter.
    pub fn add_shapes(
        &mut self,
        scene: &Scene,
        see_through: &dyn Fn(usize) -> bool,
        emitter: &dyn Fn(usize) -> Option<u32>,
    ) -> Result<(), GeometryError> {
        let is_fuel = |shape: usize| scene.fires.iter().any(|fire| fire.shapes()[0] == shape);
        let mut meshes = Meshes { rows: self, of_mesh: HashMap::new(), of_form: HashMap::new() };
        for (i, shape) in scene.shapes.iter().enumerate() {
            let id = i as u32 + 1;
            let Geometry::Instance(group) = &shape.geometry else {
                meshes.draw(shape, Mat4::IDENTITY, id, emitter(i), see_through)?;
                if let (true, Some(draw)) = (is_fuel(i), meshes.rows.draws.last_mut()) {
                    draw.flags |= DrawRow::FUEL;
                }
                continue;
            };
            let inner = scene.groups.get(*group).ok_or_else(|| GeometryError::Group {
                shape: shape.name.clone(),
                group: *group,
                count: scene.groups.len(),
            })?;
            if !shape.to_world.is_finite() || shape.to_world.determinant() == 0.0 {
                return Err(GeometryError::Transform { shape: shape.name.clone() });
            }
            for part in inner {
                if matches!(part.geometry, Geometry::Instance(_)) {
                    return Err(GeometryError::Nested { shape: part.name.clone() });
                }
                meshes.draw(part, shape.to_world, id, None, see_through)?;
            }
        }
        Ok(())
    }
}

struct Meshes<'a> {
    rows: &'a mut Rows,
    of_mesh: HashMap<*const Mesh, (u32, u32)>,
    of_form: HashMap<Form, u32>,
}

impl Meshes<'_> {
    fn draw(
        &mut self,
        shape: &Shape,
        outer: Mat4,
        id: u32,
        emitter: Option<u32>,
        see_through: &dyn Fn(usize) -> bool,
    ) -> Result<(), GeometryError> {
        let mut to_world = outer * shape.to_world;
        let determinant = to_world.determinant();
        let mut flipped = shape.flip_normals;
        let (mesh, attributes, has) = match &shape.geometry {
            Geometry::Mesh(mesh) => {
                let (row, attributes) = if determinant == 0.0 {
                    // No ray finds its way into flattened coordinates: such a mesh is placed here.
                    let placed = PlacedMesh::new(&Shape { to_world, ..shape.clone() }, mesh)?;
                    to_world = Mat4::IDENTITY;
                    self.add_mesh(&placed.mesh)?
                } else {
                    self.mesh(shape, mesh)?
                };
                let mut has = 0;
                for (flag, there) in [
                    (DrawRow::HAS_NORMALS, !mesh.normals.is_empty() && !shape.face_normals),
                    (DrawRow::HAS_UVS, !mesh.uvs.is_empty()),
                    (DrawRow::HAS_TANGENTS, !mesh.tangents.is_empty()),
                ] {
                    has |= if there { flag } else { 0 };
                }
                (row, attributes, has)
            }
            Geometry::Instance(_) => return Err(GeometryError::Nested { shape: shape.name.clone() }),
            geometry => {
                let form = match geometry {
                    Geometry::Rectangle => Form::Rectangle,
                    Geometry::Disc => Form::Disc,
                    Geometry::Cylinder => Form::Cylinder,
                    _ => Form::Sphere,
                };
                // Mitsuba turns a mirrored sphere inside out, and only the sphere.
                flipped ^= form == Form::Sphere && shape.to_world.determinant() < 0.0;
                if determinant == 0.0 {
                    return Err(GeometryError::Transform { shape: shape.name.clone() });
                }
                (self.form(form)?, NONE, DrawRow::HAS_NORMALS | DrawRow::HAS_UVS | DrawRow::HAS_TANGENTS)
            }
        };
        if !to_world.is_finite() {
            return Err(GeometryError::Transform { shape: shape.name.clone() });
        }
        let flag = |on: bool, flag: u32| if on { flag } else { 0 };
        let MeshRow { first_triangle, triangles, .. } = self.rows.meshes[mesh as usize];
        self.rows.draws.push(DrawRow {
            to_world: [to_world.row(0).into(), to_world.row(1).into(), to_world.row(2).into()],
            mesh,
            first_triangle,
            triangles,
            flags: has
                | flag(determinant < 0.0, DrawRow::MIRRORED)
                | flag(flipped, DrawRow::FLIPPED)
                | flag(see_through(shape.material), DrawRow::SEE_THROUGH),
            material: shape.material as u32,
            shape: id,
            emitter: emitter.unwrap_or(NONE),
            attributes,
        });
        Ok(())
    }

    /// Index of the row of a mesh, and where its attributes begin.
    fn mesh(&mut self, shape: &Shape, mesh: &Arc<Mesh>) -> Result<(u32, u32), GeometryError> {
        if let Some(known) = self.of_mesh.get(&Arc::as_ptr(mesh)) {
            return Ok(*known);
        }
        check(mesh, &shape.name)?;
        let (row, attributes) = self.add_mesh(mesh)?;
        self.of_mesh.insert(Arc::as_ptr(mesh), (row, attributes));
        Ok((row, attributes))
    }

    /// The same of a mesh that has been checked, anew.
    fn add_mesh(&mut self, mesh: &Mesh) -> Result<(u32, u32), GeometryError> {
        let at = |i: usize| VertexRow {
            position: mesh.positions[i].into(),
            u: mesh.uvs.get(i).map_or(0.0, |uv| uv.x),
            normal: mesh.normals.get(i).copied().unwrap_or_default().into(),
            v: mesh.uvs.get(i).map_or(0.0, |uv| uv.y),
            tangent: mesh.tangents.get(i).copied().unwrap_or_default().into(),
        };
        let row = self.add((0..mesh.positions.len()).map(at), mesh.triangles.iter().copied())?;
        Ok((row, self.attributes(mesh)))
    }

    fn add(
        &mut self,
        vertices: impl Iterator<Item = VertexRow>,
        triangles: impl Iterator<Item = [u32; 3]>,
    ) -> Result<u32, GeometryError> {
        let rows = &mut *self.rows;
        let (first_vertex, first_triangle) = (rows.vertices.len(), rows.triangles.len());
        rows.vertices.extend(vertices);
        rows.triangles.extend(triangles.map(|t| t.map(|i| i + first_vertex as u32)));
        let count = rows.triangles.len().max(rows.vertices.len());
        if count > MOST {
            return Err(GeometryError::TooMany { count, limit: MOST });
        }
        rows.meshes.push(MeshRow {
            first_vertex: first_vertex as u32,
            vertices: (rows.vertices.len() - first_vertex) as u32,
            first_triangle: first_triangle as u32,
            triangles: (rows.triangles.len() - first_triangle) as u32,
        });
        Ok(rows.meshes.len() as u32 - 1)
    }

    /// The table of a mesh's attributes: for each name that the scene's textures ask for, the word where its values
    /// begin ([`NONE`]: it has none), their width, and 1 where there is one for each triangle.
    fn attributes(&mut self, mesh: &Mesh) -> u32 {
        let names = self.rows.attribute_names.clone();
        if names.is_empty() || mesh.attributes.is_empty() {
            return NONE;
        }
        let first_vertex = self.rows.meshes.last().map_or(0, |m| m.first_vertex);
        let first_triangle = self.rows.meshes.last().map_or(0, |m| m.first_triangle);
        let table = self.rows.words.len();
        self.rows.words.resize(table + 4 * names.len(), NONE);
        for (i, name) in names.iter().enumerate() {
            let Some((_, width, values)) = mesh.attributes.iter().find(|(n, ..)| n == name) else { continue };
            let per_face = of_faces(name);
            let first = if per_face { first_triangle } else { first_vertex };
            let words = &mut self.rows.words;
            let begin = words.len() as u32;
            words.extend(values.iter().map(|v| v.to_bits()));
            words[table + 4 * i..][..4].copy_from_slice(&[begin, *width as u32, u32::from(per_face), first]);
        }
        table as u32
    }

    fn form(&mut self, form: Form) -> Result<u32, GeometryError> {
        if let Some(row) = self.of_form.get(&form) {
            return Ok(*row);
        }
        let (vertices, triangles) = tessellate(form);
        let row = self.add(vertices.into_iter(), triangles.into_iter())?;
        self.of_form.insert(form, row);
        Ok(row)
    }
}

/// A form as vertices and triangles, counter-clockwise seen from the side of its normal.
fn tessellate(form: Form) -> (Vec<VertexRow>, Vec<[u32; 3]>) {
    // The tangent, along u, is given: on an axis, where azimuths meet, each has its own.
    let vertex = |p: DVec3, uv: Vec2, du: DVec3| VertexRow {
        position: p.as_vec3().into(),
        u: uv.x,
        normal: form.normal(p).as_vec3().into(),
        v: uv.y,
        tangent: du.as_vec3().extend(1.0).into(),
    };
    // A grid over two parameters, each point by `at`.
    let grid = |across: u32, down: u32, at: &dyn Fn(f64, f64) -> (DVec3, Vec2, DVec3), turned: bool| {
        let mut vertices = Vec::new();
        for j in 0..=down {
            for i in 0..=across {
                let (p, uv, du) = at(f64::from(i) / f64::from(across), f64::from(j) / f64::from(down));
                vertices.push(vertex(p, uv, du));
            }
        }
        let mut triangles = Vec::new();
        for j in 0..down {
            for i in 0..across {
                let a = j * (across + 1) + i;
                let (b, c, d) = (a + 1, a + across + 1, a + across + 2);
                for t in [[a, b, d], [a, d, c]] {
                    triangles.push(if turned { [t[0], t[2], t[1]] } else { t });
                }
            }
        }
        (vertices, triangles)
    };
    let around = |u: f64| {
        let (sin, cos) = (TAU * u).sin_cos();
        DVec3::new(cos, sin, 0.0)
    };
    let uv = |u: f64, v: f64| Vec2::new(u as f32, v as f32);
    match form {
        Form::Sphere => {
            let at = |u: f64, v: f64| {
                let (sin, cos) = (PI * v).sin_cos();
                ((around(u) * sin).with_z(cos), uv(u, v), around(u + 0.25))
            };
            grid(SEGMENTS, SEGMENTS / 2, &at, true)
        }
        Form::Rectangle => {
            grid(1, 1, &|u, v| (DVec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0), uv(u, v), DVec3::X), false)
        }
        Form::Disc => {
            // From the centre outwards; (u, v) are radius and azimuth.
            let at = |u: f64, r: f64| (around(u) * r, uv(r, u), around(u));
            grid(SEGMENTS, 1, &at, true)
        }
        Form::Cylinder => grid(SEGMENTS, 1, &|u, v| (around(u).with_z(v), uv(u, v), around(u + 0.25)), false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn tessellated_forms_lie_on_them_and_their_windings_agree_with_their_normals() {
        for form in [Form::Sphere, Form::Rectangle, Form::Disc, Form::Cylinder] {
            let (vertices, triangles) = tessellate(form);
            let mut area = 0.0;
            for t in &triangles {
                let [a, b, c] = t.map(|i| Vec3::from(vertices[i as usize].position));
                let n = (b - a).cross(c - a);
                area += 0.5 * n.length();
                let outside: Vec3 = t.map(|i| Vec3::from(vertices[i as usize].normal)).iter().sum();
                assert!(n.length() < 1e-7 || n.dot(outside) > 0.0, "{form:?}");
            }
            assert!((f64::from(area) / form.own_area() - 1.0).abs() < 5e-4, "{form:?} {area}");
            for v in &vertices {
                let p = Vec3::from(v.position).as_dvec3();
                let uv = form.uv(p).as_vec2();
                // The seam is met from both sides; on an axis any azimuth is right.
                let off = (uv - Vec2::new(v.u, v.v)).abs();
                let off = off.min((off - 1.0).abs());
                assert!(off.max_element() < 1e-5 || p.x.hypot(p.y) < 1e-5, "{form:?} {p} {uv}");
                let along = form.tangents(p)[0].normalize_or_zero().as_vec3();
                let tangent = Vec3::from_slice(&v.tangent);
                assert!(tangent.dot(along) > 0.9999 || p.x.hypot(p.y) < 1e-5, "{form:?} {p} {tangent}");
            }
        }
    }
}
