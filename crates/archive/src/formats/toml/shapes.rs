//! Shapes: exact ones, meshes from files, geometry made here, and groups placed again.

use super::document::{Item, Keys};
use super::materials::Role;
use super::{Parts, Reader, placed};
use crate::Error;
use crate::formats::mtl::{Finish, Libraries};
use crate::formats::{gltf, obj, ply, read_file, serialized};
use glam::{Mat4, Vec3};
use std::path::Path;
use std::sync::Arc;
use yugen_scene::Scene;
use yugen_scene::primitives::{Drape, Support, ball, block, drape, grid};
use yugen_scene::{Figure, Geometry, Material, MaterialId, Mesh, Shape, Texture, Value};

/// The finest mesh that is made here: four million triangles.
const MAX_SEGMENTS: u32 = 1448;
/// The finest cloth: its time grows with the third power, and this takes some minutes.
const MAX_CLOTH: u32 = 320;

#[derive(Clone, Copy)]
enum Type {
    Sphere,
    Rectangle,
    Disc,
    Cylinder,
    Box,
    Ball,
    Grid,
    Drape,
    File,
    Instance,
}

const TYPES: [(&str, Type); 10] = [
    ("sphere", Type::Sphere),
    ("rectangle", Type::Rectangle),
    ("disc", Type::Disc),
    ("cylinder", Type::Cylinder),
    ("box", Type::Box),
    ("ball", Type::Ball),
    ("grid", Type::Grid),
    ("drape", Type::Drape),
    ("file", Type::File),
    ("instance", Type::Instance),
];

impl<'a> Reader<'a> {
    /// One `[[shape]]`, which may be several: a file brings all of its own.
    pub(super) fn shape(&mut self, mut keys: Keys<'a>, out: &mut Vec<Shape>) -> Result<(), Error> {
        let kind = keys.need("type", "a shape such as \"sphere\" or \"file\"")?;
        let word = kind.text()?;
        let kind = kind.one_of("shape", &TYPES)?;
        let name = keys.or("name", word.to_string(), |i| i.text().map(String::from))?;
        keys.what = format!("shape '{name}'");
        let to_world = placed(&mut keys)?;
        let material = match keys.get("material") {
            Some(item) => Some(self.material(&item)?),
            None => None,
        };

        let (first, figures) = (out.len(), self.scene.figures.len());
        let length = |i: &Item| i.number_in(1e-9, 1e9);
        let (geometry, own) = match kind {
            Type::Sphere => {
                (Geometry::Sphere, Mat4::from_scale(Vec3::splat(keys.or("radius", 1.0, length)?)))
            }
            Type::Disc => (Geometry::Disc, Mat4::from_scale(Vec3::splat(keys.or("radius", 1.0, length)?))),
            Type::Rectangle => {
                let [width, height] = keys.or("size", [1.0; 2], sizes)?;
                (Geometry::Rectangle, Mat4::from_scale(Vec3::new(0.5 * width, 0.5 * height, 1.0)))
            }
            Type::Cylinder => {
                let (radius, height) = (keys.or("radius", 1.0, length)?, keys.or("height", 1.0, length)?);
                (Geometry::Cylinder, Mat4::from_scale(Vec3::new(radius, radius, height)))
            }
            Type::Box => (made(block(Vec3::from_array(keys.or("size", [1.0; 3], sizes)?))), Mat4::IDENTITY),
            Type::Ball => {
                let segments = keys.or("segments", 64, |i| i.count(MAX_SEGMENTS))?;
                let radius = keys.or("radius", 1.0, length)?;
                (made(ball(segments)), Mat4::from_scale(Vec3::splat(radius)))
            }
            Type::Grid => {
                let [width, height] = keys.or("size", [1.0; 2], sizes)?;
                let segments = keys.or("segments", 1, |i| i.count(MAX_SEGMENTS))?;
                (made(grid(width, height, [segments; 2])), Mat4::IDENTITY)
            }
            Type::Drape => (made(self.drape(&mut keys)?), Mat4::IDENTITY),
            Type::Instance => {
                let group = keys.need("group", "the name of a group")?;
                let group_name = group.text()?;
                let id = self.groups.get(group_name).copied();
                let known = self.groups.keys().map(String::as_str);
                let id = id.ok_or_else(|| group.unknown("group", group_name, known))?;
                (Geometry::Instance(id), Mat4::IDENTITY)
            }
            Type::File => {
                let file = keys.need("file", "a mesh (.obj, .ply, .serialized) or a scene (.glb, .gltf)")?;
                self.file(&file, &mut keys, to_world, material, out)?;
                // Of several each has its own name.
                if let (true, [only]) = (name != word, &mut out[first..]) {
                    only.name.clone_from(&name);
                }
                (Geometry::Sphere, Mat4::IDENTITY)
            }
        };
        if !matches!(kind, Type::File) {
            let material = match material {
                Some(id) => id,
                None => self.grey(),
            };
            out.push(Shape::new(name.clone(), geometry, to_world * own, material));
        }

        self.movement(&mut keys, &out[first..], first, figures)?;
        let flip = keys.or("flip", false, Item::boolean)?;
        let flat = keys.or("flat", false, Item::boolean)?;
        let emission = match keys.get("emission") {
            Some(_) if matches!(kind, Type::Instance) => {
                return Err(keys.invalid("an instance cannot shine; let the shapes of its group do so"));
            }
            Some(item) => Some(self.value(&item, Role::Light)?),
            None => None,
        };
        let both = keys.or("emits_both_sides", false, Item::boolean)?;
        for shape in &mut out[first..] {
            shape.flip_normals ^= flip;
            shape.face_normals |= flat;
            shape.two_sided_emission |= both;
            if emission.is_some() {
                shape.emission.clone_from(&emission);
            }
        }
        keys.finish()
    }

    fn drape(&mut self, keys: &mut Keys<'a>) -> Result<Mesh, Error> {
        let default = Drape::default();
        let over = match keys.get("over") {
            None => default.over,
            Some(item) => {
                let mut keys = item.keys("the support of the cloth")?;
                let (ball, block, stand) = (keys.get("ball"), keys.get("box"), keys.get("stand"));
                let at =
                    keys.need("at", "the middle of a ball or a box, or of the top of a stand")?.vec3()?;
                let support = match (ball, block, stand) {
                    (Some(radius), None, None) => {
                        Support::Ball { centre: at, radius: radius.number_in(1e-6, 1e6)? }
                    }
                    (None, Some(size), None) => {
                        Support::Block { centre: at, size: Vec3::from_array(sizes(&size)?) }
                    }
                    (None, None, Some(radius)) => {
                        Support::Stand { top: at, radius: radius.number_in(1e-6, 1e6)? }
                    }
                    _ => {
                        return Err(keys.invalid(
                            "cloth hangs over one of 'ball' (radius), 'box' (sizes) and 'stand' (radius)",
                        ));
                    }
                };
                keys.finish()?;
                support
            }
        };
        Ok(drape(&Drape {
            size: keys.or("size", default.size, |i| i.number_in(0.01, 100.0))?,
            segments: keys.or("segments", default.segments, |i| i.count(MAX_CLOTH))?,
            over,
            floor: keys.or("floor", default.floor, Item::number)?,
            turn: keys.or("turn", default.turn.to_degrees(), Item::number)?.to_radians(),
            weight: keys.or("weight", default.weight, |i| i.number_in(1e-3, 10.0))?,
            bending: keys.or("bending", default.bending, |i| i.number_in(1e-9, 1.0))?,
            shear: keys.or("shear", default.shear, |i| i.number_in(1e-3, 1e6))?,
            friction: keys.or("friction", default.friction, |i| i.number_in(0.0, 10.0))?,
            seconds: keys.or("seconds", default.seconds, |i| i.number_in(0.0, 20.0))?,
            seed: keys.or("seed", default.seed, |i| i.count(u32::MAX).map(u64::from))?,
        }))
    }

    /// Everything in a mesh or scene file, moved by `to_world`.
    fn file(
        &mut self,
        item: &Item<'a>,
        keys: &mut Keys<'a>,
        to_world: Mat4,
        material: Option<MaterialId>,
        out: &mut Vec<Shape>,
    ) -> Result<(), Error> {
        let path = self.folders.find(item.text()?, item.place())?;
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let index = keys.get("index");
        if let (Some(index), true) = (&index, extension != "serialized") {
            return Err(index
                .invalid("only a .serialized file holds several meshes that are told apart by an 'index'"));
        }
        let shape = |mesh: Arc<Mesh>, material| {
            Shape::new(mesh.name.clone(), Geometry::Mesh(mesh), to_world, material)
        };
        match extension.as_str() {
            "obj" => {
                for (name, mesh) in self.obj(&path, material.is_none())? {
                    let finish = match (material, name) {
                        (Some(id), _) => Finish { id, emission: None },
                        (None, name) => self.mtl(&path, name.as_deref())?,
                    };
                    let mut shape = shape(mesh, finish.id);
                    shape.two_sided_emission = finish.emission.is_some();
                    shape.emission = finish.emission;
                    out.push(shape);
                }
            }
            "ply" => {
                let mesh = match self.meshes.get(&path) {
                    Some(mesh) => mesh.clone(),
                    None => Arc::new(ply::read(&read_file(&path)?, &path)?),
                };
                self.meshes.insert(path, mesh.clone());
                let material = material.unwrap_or_else(|| self.grey());
                out.push(shape(mesh, material));
            }
            "serialized" => {
                let index = index.map_or(Ok(0.0), |i| i.number_in(0.0, 1e6))? as usize;
                let read = serialized::read(&read_file(&path)?, index, &path)?;
                let material = material.unwrap_or_else(|| self.grey());
                let mut shape = shape(Arc::new(read.mesh), material);
                shape.face_normals = read.face_normals;
                out.push(shape);
            }
            "glb" | "gltf" => {
                let bytes = read_file(&path)?;
                let scene = gltf::read_into(self.scene.working_space, &bytes, &path, &self.folders)?;
                self.adopt(scene, to_world, material, out);
            }
            other => {
                return Err(item.unknown(
                    "mesh or scene file extension",
                    other,
                    ["obj", "ply", "serialized", "glb", "gltf"],
                ));
            }
        }
        Ok(())
    }

    /// Takes over the shapes and figures of another scene, their indices moved behind ours; its lights and cameras stay.
    fn adopt(&mut self, other: Scene, to_world: Mat4, material: Option<MaterialId>, out: &mut Vec<Shape>) {
        let (t, m, g) = (self.scene.textures.len(), self.scene.materials.len(), self.scene.groups.len());
        let shift = |v: Value| if let Value::Texture(id) = v { Value::Texture(id + t) } else { v };
        self.scene.textures.extend(other.textures.into_iter().map(|texture| match texture {
            Texture::Scaled { texture, factor } => Texture::Scaled { texture: texture + t, factor },
            Texture::Checkerboard { even, odd, to_uv } => {
                Texture::Checkerboard { even: shift(even), odd: shift(odd), to_uv }
            }
            Texture::At { texture, attribute } => Texture::At { texture: texture + t, attribute },
            Texture::Product { factors } => Texture::Product { factors: factors.map(shift) },
            Texture::Step { value, edge } => Texture::Step { value: shift(value), edge },
            own @ (Texture::Image { .. } | Texture::MeshAttribute { .. } | Texture::Cloth { .. }) => own,
        }));
        self.scene.materials.extend(other.materials.into_iter().map(|material| match material {
            Material::Model { kind, params, table } => {
                Material::Model { kind, params: params.into_iter().map(shift).collect(), table }
            }
            Material::TwoSided { front, back } => Material::TwoSided { front: front + m, back: back + m },
            Material::Mask { opacity, base } => Material::Mask { opacity: shift(opacity), base: base + m },
            Material::Blend { weight, first, second } => {
                Material::Blend { weight: shift(weight), first: first + m, second: second + m }
            }
            Material::Sum(all) => Material::Sum(all.into_iter().map(|id| id + m).collect()),
            Material::NormalMap { texture, scale, turned, base } => {
                Material::NormalMap { texture: texture + t, scale, turned, base: base + m }
            }
            Material::Cloth { texture, form } => Material::Cloth { texture: texture + t, form },
            Material::BumpMap { texture, scale, turned, base } => {
                Material::BumpMap { texture: texture + t, scale, turned, base: base + m }
            }
            Material::Body { absorption, base } => Material::Body { absorption, base: base + m },
            Material::OneSided { base } => Material::OneSided { base: base + m },
            Material::Null => Material::Null,
        }));
        for (id, name) in other.material_names.iter().enumerate() {
            self.scene.name_material(id + m, name);
        }
        let own = |mut shape: Shape| {
            shape.material = material.unwrap_or(shape.material + m);
            shape.emission = shape.emission.map(shift);
            if let Geometry::Instance(group) = &mut shape.geometry {
                *group += g;
            }
            shape
        };
        self.scene
            .groups
            .extend(other.groups.into_iter().map(|shapes| shapes.into_iter().map(own).collect::<Vec<_>>()));
        let adopted = |f: Arc<Figure>| Arc::new(Arc::unwrap_or_clone(f).adopted(out.len(), to_world));
        let figures = other.figures.into_iter().map(adopted);
        self.scene.figures.extend(figures);
        out.extend(other.shapes.into_iter().map(own).map(|mut shape| {
            shape.to_world = to_world * shape.to_world;
            shape
        }));
    }

    /// The meshes of an OBJ file: one for each of its own materials, which its libraries define, or one in all.
    fn obj(&mut self, path: &Path, own: bool) -> Result<Parts, Error> {
        if let Some(parts) = self.objs.get(&(path.to_path_buf(), own)) {
            return Ok(parts.clone());
        }
        let obj = obj::read(&read_file(path)?, path)?;
        let parts: Parts = if own && !obj.libraries.is_empty() {
            let libraries = Libraries::open(&obj.libraries, path, &self.folders)?;
            self.libraries.insert(path.to_path_buf(), libraries);
            obj.split().into_iter().map(|(name, mesh)| (name, Arc::new(mesh))).collect()
        } else {
            vec![(None, Arc::new(obj.mesh))]
        };
        self.objs.insert((path.to_path_buf(), own), parts.clone());
        Ok(parts)
    }

    /// The material `name` of an OBJ file's libraries; grey where there is none.
    fn mtl(&mut self, obj: &Path, name: Option<&str>) -> Result<Finish, Error> {
        let finish = match (self.libraries.get_mut(obj), name) {
            (Some(libraries), Some(name)) => libraries.material(name, &mut self.scene)?,
            _ => None,
        };
        Ok(finish.unwrap_or_else(|| Finish { id: self.grey(), emission: None }))
    }
}

fn made(mesh: Mesh) -> Geometry {
    Geometry::Mesh(Arc::new(mesh))
}

fn sizes<const N: usize>(item: &Item) -> Result<[f32; N], Error> {
    let v = item.numbers()?;
    if v.iter().all(|s| (1e-9..=1e9).contains(s)) {
        Ok(v)
    } else {
        Err(item.wrong("lengths greater than zero"))
    }
}
