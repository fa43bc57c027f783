//! Shapes and what they are made of; instances and their groups.

use super::Builder;
use super::document::Class;
use super::materials::Role;
use super::properties::Properties;
use crate::Error;
use crate::formats::{obj, ply, read_file, serialized};
use glam::{Mat3, Mat4, Vec2, Vec3};
use std::path::PathBuf;
use std::sync::Arc;
use yugen_optics::Frame;
use yugen_scene::{Geometry, GroupId, Material, MaterialId, Mesh, Shape, Value};

/// What makes one mesh differ from another.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct MeshKey {
    file: PathBuf,
    shape_index: usize,
    v_up: bool,
    /// The linear part of `to_world`, where computed normals depend on it.
    linear: Option<[u32; 9]>,
}

impl Builder<'_> {
    pub(super) fn shape(&mut self, p: Properties) -> Result<Shape, Error> {
        p.accept(&["silhouette_sampling_weight"]);
        let mut to_world = p.to_world()?;
        if p.plugin() == "instance" {
            return self.instance(p, to_world);
        }
        let flip_normals = p.boolean("flip_normals", false)?;
        let mut face_normals = false;
        let mut name = p.id().to_string();
        let geometry = match p.plugin() {
            "obj" | "ply" | "serialized" => {
                face_normals = p.boolean("face_normals", false)?;
                let mesh = self.mesh(p, to_world, face_normals)?;
                if name.is_empty() {
                    name.clone_from(&mesh.name);
                }
                Geometry::Mesh(mesh)
            }
            "cube" => {
                face_normals = p.boolean("face_normals", false)?;
                Geometry::Mesh(
                    self.meshes
                        .entry(MeshKey { file: PathBuf::new(), shape_index: 0, v_up: false, linear: None })
                        .or_insert_with(|| Arc::new(cube()))
                        .clone(),
                )
            }
            "sphere" => {
                let centre = p.vector("center")?.unwrap_or(Vec3::ZERO);
                let radius = p.float_in("radius", 1.0, |v| v > 0.0, "more than 0")? as f32;
                to_world *= Mat4::from_translation(centre) * Mat4::from_scale(Vec3::splat(radius));
                Geometry::Sphere
            }
            "cylinder" => {
                let p0 = p.vector("p0")?.unwrap_or(Vec3::ZERO);
                let p1 = p.vector("p1")?.unwrap_or(Vec3::Z);
                let radius = p.float_in("radius", 1.0, |v| v > 0.0, "more than 0")? as f32;
                let length = (p1 - p0).length();
                let axis = (p1 - p0)
                    .try_normalize()
                    .ok_or_else(|| p.invalid("'p0' and 'p1' cannot be the same point"))?;
                let f = Frame::from_normal(axis);
                to_world *= Mat4::from_cols(
                    (f.s * radius).extend(0.0),
                    (f.t * radius).extend(0.0),
                    (f.n * length).extend(0.0),
                    p0.extend(1.0),
                );
                Geometry::Cylinder
            }
            "rectangle" => Geometry::Rectangle,
            "disk" => Geometry::Disc,
            _ => return Err(p.unknown_plugin()),
        };
        if !to_world.inverse().is_finite() {
            return Err(p.invalid("the shape has no size in single precision"));
        }
        if let Some(medium) = p.children(Class::Medium).first() {
            return Err(medium.unknown_plugin());
        }
        let emitter = p.child(Class::Emitter)?;
        let emission = match emitter {
            Some(e) => Some(self.area(e)?),
            None => None,
        };
        let material = match p.child(Class::Bsdf)? {
            Some(b) => self.material(b)?,
            None => self.default_material(emission.is_some()),
        };
        if name.is_empty() {
            name = p.plugin().to_string();
        }
        p.finish()?;
        let shape = Shape::new(name, geometry, to_world, material);
        Ok(Shape { flip_normals, face_normals, emission, ..shape })
    }

    fn area(&mut self, p: Properties) -> Result<Value, Error> {
        if p.plugin() != "area" {
            return Err(p.invalid(format!(
                "the emitter '{}' does not belong to a shape; expected 'area'",
                p.plugin()
            )));
        }
        p.accept(&["sampling_weight"]);
        if p.has("to_world") {
            return Err(p.invalid("'to_world' of an area emitter is that of its shape; remove it here"));
        }
        let radiance = self.value(p, "radiance", Role::Light)?.unwrap_or(Value::Number(1.0));
        p.finish()?;
        Ok(radiance)
    }

    /// Grey, or black where the shape emits.
    fn default_material(&mut self, emits: bool) -> MaterialId {
        if let Some(m) = self.defaults[usize::from(emits)] {
            return m;
        }
        let grey = if emits { 0.0 } else { 0.5 };
        let m = self.push(Material::lambert(Value::Number(grey)));
        self.defaults[usize::from(emits)] = Some(m);
        m
    }

    fn instance(&mut self, p: Properties, to_world: Mat4) -> Result<Shape, Error> {
        let group = p.child(Class::Shape)?.filter(|g| g.plugin() == "shapegroup");
        let group =
            group.ok_or_else(|| p.invalid("an instance needs a <ref> to a shape of type 'shapegroup'"))?;
        let group = self.group(group)?;
        p.finish()?;
        Ok(Shape::new(
            if p.id().is_empty() { "instance" } else { p.id() },
            Geometry::Instance(group),
            to_world,
            0,
        ))
    }

    pub(super) fn group(&mut self, p: Properties) -> Result<GroupId, Error> {
        if let Some(&g) = self.groups.get(&p.index) {
            return Ok(g);
        }
        p.accept(&["silhouette_sampling_weight"]);
        if p.has("to_world") {
            return Err(
                p.invalid("a shapegroup has no place of its own; 'to_world' belongs to its instances")
            );
        }
        let mut shapes = Vec::new();
        for child in p.children(Class::Shape) {
            if matches!(child.plugin(), "instance" | "shapegroup") {
                return Err(child.invalid("groups and instances cannot be nested in a shapegroup"));
            }
            let shape = self.shape(child)?;
            if shape.emission.is_some() {
                return Err(child.invalid("a shape that emits cannot be instanced; place it by itself"));
            }
            shapes.push(shape);
        }
        p.finish()?;
        let id = self.scene.groups.len();
        self.scene.groups.push(shapes);
        self.groups.insert(p.index, id);
        Ok(id)
    }

    /// The mesh of a file, with normals where Mitsuba gives it some.
    fn mesh(&mut self, p: Properties, to_world: Mat4, face_normals: bool) -> Result<Arc<Mesh>, Error> {
        let file = p.required_file("filename")?;
        let shape_index =
            if p.plugin() == "serialized" { p.count("shape_index", 0, 0, u32::MAX)? as usize } else { 0 };
        // OBJ files count v from below, which the plugin turns over unless it is told not to.
        let from_below = p.plugin() == "obj";
        let v_up = if p.plugin() == "serialized" {
            false
        } else {
            p.boolean("flip_tex_coords", from_below)? != from_below
        };
        let mut key = MeshKey { file, shape_index, v_up, linear: None };
        let raw = match self.meshes.get(&key) {
            Some(mesh) => mesh.clone(),
            None => {
                let bytes = read_file(&key.file)?;
                let mut mesh = match p.plugin() {
                    "obj" => obj::read(&bytes, &key.file)?.mesh,
                    "ply" => ply::read(&bytes, &key.file)?,
                    _ => serialized::read(&bytes, shape_index, &key.file)?.mesh,
                };
                if v_up {
                    mesh.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
                }
                if mesh.name.is_empty() {
                    mesh.name = key.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                }
                self.meshes.entry(key.clone()).or_insert(Arc::new(mesh)).clone()
            }
        };
        if !raw.normals.is_empty() || face_normals {
            return Ok(raw);
        }
        let linear = Mat3::from_mat4(to_world);
        let linear = if keeps_angles(linear) { Mat3::IDENTITY } else { linear };
        key.linear = Some(linear.to_cols_array().map(f32::to_bits));
        let with_normals = self.meshes.entry(key).or_insert_with(|| {
            let mut mesh = Mesh::clone(&raw);
            mesh.complete_normals(linear);
            Arc::new(mesh)
        });
        Ok(with_normals.clone())
    }
}

/// Whether a map is a rotation and a uniform scale, to single precision, without mirroring.
fn keeps_angles(m: Mat3) -> bool {
    let gram = m.transpose() * m;
    let scale = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    m.determinant() > 0.0 && gram.abs_diff_eq(Mat3::from_diagonal(Vec3::splat(scale)), 1e-5 * scale)
}

/// [−1, 1]³ with a normal and the whole of (u, v) on each side.
fn cube() -> Mesh {
    // Normal, direction of u and direction of v: the way Mitsuba 3.9.1 lays pictures on its cube.
    let sides = [
        (Vec3::NEG_Y, Vec3::Z, Vec3::X),
        (Vec3::Y, Vec3::NEG_X, Vec3::NEG_Z),
        (Vec3::X, Vec3::Y, Vec3::NEG_Z),
        (Vec3::Z, Vec3::Y, Vec3::X),
        (Vec3::NEG_X, Vec3::Y, Vec3::Z),
        (Vec3::NEG_Z, Vec3::NEG_Y, Vec3::X),
    ];
    let mut mesh = Mesh { name: "cube".into(), ..Mesh::default() };
    for (n, u, v) in sides {
        let first = mesh.positions.len() as u32;
        for uv in [Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)] {
            mesh.positions.push(n + u * (2.0 * uv.x - 1.0) + v * (2.0 * uv.y - 1.0));
            mesh.normals.push(n);
            mesh.uvs.push(uv);
        }
        mesh.triangles.extend([[0, 1, 2], [3, 0, 2]].map(|t: [u32; 3]| t.map(|i| first + i)));
    }
    mesh
}
