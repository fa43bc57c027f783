//! Writes a scene as GLB: one node for each shape, camera and light, pictures as PNG inside.
//!
//! Lights are KHR_lights_punctual; W/sr and W/m² are written as candela and lux, as the reader has them. A surrounding
//! has no place in glTF and is left out. Of the models those are written that glTF has: `metallic_roughness` as it is,
//! `lambert` and `oren_nayar` as a rough dielectric without reflection (`specularFactor` 0).

use crate::formats::image::{self, WriteOptions};
use crate::formats::labels::Labels;
use crate::{Error, Place, atomic_write};
use glam::{Affine2, Mat4, Vec3};
use serde_json::{Map, Value as Json, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::Kind;
use yugen_scene::{
    Camera, Geometry, Light, Material, MaterialId, Mesh, Projection, Scene, Texture, TextureFilter,
    TextureId, Value, Wrap,
};

/// GLB counts its bytes in 32 bits.
const MAX_BYTES: usize = u32::MAX as usize - 64;

/// Writes `scene` to `path`, whole or not at all.
pub fn write(path: &Path, scene: &Scene, labels: &Labels) -> Result<(), Error> {
    atomic_write(path, &write_bytes(path, scene, labels)?)
}

/// The bytes that [`write`] writes; the path is for messages.
pub fn write_bytes(path: &Path, scene: &Scene, labels: &Labels) -> Result<Vec<u8>, Error> {
    let writer = Writer {
        at: Place::file(path),
        scene,
        labels,
        to_srgb: scene.working_space.matrix_to(ColourSpace::LinearSrgb),
        bytes: Vec::new(),
        views: Vec::new(),
        accessors: Vec::new(),
        images: Vec::new(),
        samplers: Vec::new(),
        textures: Vec::new(),
        pictures: HashMap::new(),
        used: BTreeSet::new(),
    };
    writer.document()
}

struct Writer<'a> {
    at: Place,
    scene: &'a Scene,
    labels: &'a Labels,
    to_srgb: glam::Mat3,
    bytes: Vec<u8>,
    views: Vec<Json>,
    accessors: Vec<Json>,
    images: Vec<Json>,
    samplers: Vec<Json>,
    textures: Vec<Json>,
    /// Images by where they are in memory, and whether raw.
    pictures: HashMap<(*const Image, bool), usize>,
    /// Extensions.
    used: BTreeSet<&'static str>,
}

fn extras(pairs: &[(String, String)]) -> Json {
    Json::Object(pairs.iter().map(|(k, v)| (k.clone(), Json::from(v.as_str()))).collect::<Map<_, _>>())
}

impl Writer<'_> {
    fn document(mut self) -> Result<Vec<u8>, Error> {
        let scene = self.scene;
        let (mut nodes, mut meshes, mut materials) = (Vec::new(), Vec::new(), Vec::new());
        let mut places: BTreeMap<MaterialId, usize> = BTreeMap::new();
        for (i, shape) in scene.shapes.iter().enumerate() {
            let problem = |what: &str| self.cannot(&format!("the shape '{}' {what}", shape.name));
            let ball;
            let mesh = match &shape.geometry {
                Geometry::Mesh(mesh) => &**mesh,
                Geometry::Sphere => {
                    ball = yugen_scene::primitives::ball(48);
                    &ball
                }
                _ => return Err(problem("is neither a mesh nor a sphere")),
            };
            if shape.flip_normals {
                return Err(problem("is turned inside out"));
            }
            // What shines has a material of its own.
            let material = match (&shape.emission, places.get(&shape.material)) {
                (None, Some(index)) => *index,
                (emission, _) => {
                    let mut entry = self.material(shape.material)?;
                    if let Some(emission) = emission {
                        self.emission(&mut entry, emission)?;
                    } else {
                        places.insert(shape.material, materials.len());
                    }
                    materials.push(entry);
                    materials.len() - 1
                }
            };
            let primitive = self.primitive(mesh, shape.face_normals, material)?;
            meshes.push(json!({ "name": shape.name, "primitives": [primitive] }));
            let mut node = json!({ "name": shape.name, "mesh": meshes.len() - 1 });
            if shape.to_world != Mat4::IDENTITY {
                node["matrix"] = json!(shape.to_world.to_cols_array());
            }
            if let Some(pairs) = self.labels.shapes.get(i).filter(|p| !p.is_empty()) {
                node["extras"] = extras(pairs);
            }
            nodes.push(node);
        }
        let mut cameras = Vec::new();
        for camera in &scene.cameras {
            cameras.push(self.camera(camera)?);
            // It looks along −z with +x to the right.
            let frame = camera.to_world * Mat4::from_scale(Vec3::new(-1.0, 1.0, -1.0));
            nodes.push(
                json!({ "name": camera.name, "camera": cameras.len() - 1, "matrix": frame.to_cols_array() }),
            );
        }
        let mut lights = Vec::new();
        for (i, light) in scene.lights.iter().enumerate() {
            let name = scene.light_names.get(i).cloned().unwrap_or_default();
            let (kind, colour, place) = match light {
                Light::Point { position, intensity } => {
                    ("point", *intensity, Mat4::from_translation(*position))
                }
                Light::Directional { direction, irradiance } => {
                    let turn =
                        glam::Quat::from_rotation_arc(Vec3::NEG_Z, direction.normalize_or(Vec3::NEG_Z));
                    ("directional", *irradiance, Mat4::from_quat(turn))
                }
                Light::Constant { .. } | Light::Environment { .. } => continue,
                _ => return Err(self.cannot(&format!("light {i} is of a kind that is not written"))),
            };
            self.used.insert("KHR_lights_punctual");
            // Colours of firelight lie outside sRGB, and lights there have none below zero.
            let colour = (self.to_srgb * colour).max(Vec3::ZERO);
            let most = colour.max_element().max(1e-20);
            lights.push(
                json!({ "name": name, "type": kind, "color": (colour / most).to_array(), "intensity": most }),
            );
            let index = lights.len() - 1;
            nodes.push(json!({
                "name": name,
                "matrix": place.to_cols_array(),
                "extensions": { "KHR_lights_punctual": { "light": index } },
            }));
        }
        let mut root = json!({
            "asset": { "version": "2.0", "generator": format!("Yugen {}", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
            "nodes": nodes,
        });
        if !self.labels.about.is_empty() {
            root["asset"]["extras"] = extras(&self.labels.about);
        }
        if !lights.is_empty() {
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
        }
        if !self.used.is_empty() {
            root["extensionsUsed"] = json!(self.used);
        }
        let buffers = vec![json!({ "byteLength": self.bytes.len() })];
        // No array of a glTF file may be empty.
        for (key, list) in [
            ("meshes", meshes),
            ("materials", materials),
            ("cameras", cameras),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
            ("images", self.images),
            ("samplers", self.samplers),
            ("textures", self.textures),
        ] {
            if !list.is_empty() {
                root[key] = Json::Array(list);
            }
        }
        if !self.bytes.is_empty() {
            root["buffers"] = Json::Array(buffers);
        }
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let all = 12 + 8 + text.len() + 8 + self.bytes.len();
        if all > MAX_BYTES {
            let what = "the number of bytes of a .glb file".to_string();
            return Err(Error::TooLarge { at: self.at, what, asked: all as u64, limit: MAX_BYTES as u64 });
        }
        let mut out = Vec::with_capacity(all);
        out.extend(b"glTF");
        for word in [2, all as u32, text.len() as u32] {
            out.extend(word.to_le_bytes());
        }
        out.extend(b"JSON");
        out.extend(text);
        if !self.bytes.is_empty() {
            out.extend((self.bytes.len() as u32).to_le_bytes());
            out.extend(b"BIN\0");
            out.extend(self.bytes);
        }
        Ok(out)
    }

    fn cannot(&self, problem: &str) -> Error {
        Error::invalid(self.at.clone(), format!("{problem}; glTF has no form for it, write .toml instead"))
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let at = self.bytes.len().next_multiple_of(4);
        self.bytes.resize(at, 0);
        self.bytes.extend(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": at, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    fn floats(&mut self, values: impl Iterator<Item = f32>, width: usize, bounds: bool) -> usize {
        let values: Vec<f32> = values.collect();
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(34962));
        let shape = ["SCALAR", "VEC2", "VEC3", "VEC4"][width - 1];
        let count = values.len() / width;
        let mut accessor =
            json!({ "bufferView": view, "componentType": 5126, "count": count, "type": shape });
        if bounds {
            let of = |start: f32, f: fn(f32, f32) -> f32| {
                (0..width)
                    .map(|k| values.iter().skip(k).step_by(width).copied().fold(start, f))
                    .collect::<Vec<_>>()
            };
            (accessor["min"], accessor["max"]) =
                (json!(of(f32::MAX, f32::min)), json!(of(f32::MIN, f32::max)));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn primitive(&mut self, mesh: &Mesh, flat: bool, material: usize) -> Result<Json, Error> {
        if mesh.positions.is_empty() || mesh.triangles.is_empty() {
            return Err(self.cannot(&format!("the mesh '{}' has no triangles", mesh.name)));
        }
        let mut attributes = Map::new();
        let positions = self.floats(mesh.positions.iter().flat_map(|p| p.to_array()), 3, true);
        attributes.insert("POSITION".into(), positions.into());
        // Without normals a mesh is flat.
        if !mesh.normals.is_empty() && !flat {
            let normals = self.floats(mesh.normals.iter().flat_map(|n| n.to_array()), 3, false);
            attributes.insert("NORMAL".into(), normals.into());
        }
        if !mesh.uvs.is_empty() {
            let uvs = self.floats(mesh.uvs.iter().flat_map(|t| t.to_array()), 2, false);
            attributes.insert("TEXCOORD_0".into(), uvs.into());
        }
        if !mesh.tangents.is_empty() {
            let tangents = self.floats(mesh.tangents.iter().flat_map(|t| t.to_array()), 4, false);
            attributes.insert("TANGENT".into(), tangents.into());
        }
        let corners = mesh.triangles.iter().flatten();
        let (bytes, kind): (Vec<u8>, u32) = if mesh.positions.len() <= usize::from(u16::MAX) {
            (corners.flat_map(|i| (*i as u16).to_le_bytes()).collect(), 5123)
        } else {
            (corners.flat_map(|i| i.to_le_bytes()).collect(), 5125)
        };
        let view = self.view(&bytes, Some(34963));
        let count = 3 * mesh.triangles.len();
        self.accessors
            .push(json!({ "bufferView": view, "componentType": kind, "count": count, "type": "SCALAR" }));
        Ok(json!({ "attributes": attributes, "indices": self.accessors.len() - 1, "material": material }))
    }

    fn camera(&self, camera: &Camera) -> Result<Json, Error> {
        let Projection::Perspective { fov_x, .. } = camera.projection else {
            return Err(self.cannot(&format!("the camera '{}' has parallel rays", camera.name)));
        };
        let aspect = camera.film.width as f32 / camera.film.height.max(1) as f32;
        let yfov = 2.0 * ((0.5 * fov_x).tan() / aspect).atan();
        let [near, far] = camera.near_far;
        Ok(json!({
            "name": camera.name,
            "type": "perspective",
            "perspective": { "aspectRatio": aspect, "yfov": yfov, "znear": near, "zfar": far },
        }))
    }

    fn emission(&mut self, entry: &mut Json, emission: &Value) -> Result<(), Error> {
        let colour = match emission {
            Value::Number(v) => Vec3::splat(*v),
            Value::Rgb(c) => *c,
            Value::Texture(_) => return Err(self.cannot("a shape that shines by a picture")),
        };
        let colour = (self.to_srgb * colour).max(Vec3::ZERO);
        let most = colour.max_element().max(1e-20);
        entry["emissiveFactor"] = json!((colour / most).to_array());
        entry["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": most });
        self.used.insert("KHR_materials_emissive_strength");
        Ok(())
    }

    fn material(&mut self, id: MaterialId) -> Result<Json, Error> {
        let name = self.labels.material(id);
        let mut entry = json!({ "name": name });
        let mut at = id;
        for _ in 0..8 {
            match self.scene.materials.get(at) {
                Some(Material::TwoSided { front, back }) if front == back => {
                    entry["doubleSided"] = json!(true);
                    at = *front;
                }
                Some(Material::OneSided { base }) => at = *base,
                Some(Material::NormalMap { texture, scale, base, .. }) => {
                    let index = self.texture(*texture, true)?;
                    entry["normalTexture"] = json!({ "index": index, "scale": scale });
                    at = *base;
                }
                Some(Material::Model { kind, params, .. }) => {
                    let params = params.clone();
                    self.model(*kind, &params, &mut entry)?;
                    return Ok(entry);
                }
                _ => break,
            }
        }
        Err(self.cannot(&format!("the material '{name}' is of a kind that is not written")))
    }

    fn model(&mut self, kind: Kind, params: &[Value], entry: &mut Json) -> Result<(), Error> {
        let value = |name: &str| {
            kind.params().iter().zip(params).find(|(p, _)| p.name == name).map(|(_, v)| v.clone())
        };
        let mut pbr = json!({});
        let colour = if kind == Kind::MetallicRoughness { "base_color" } else { "reflectance" };
        match value(colour) {
            Some(Value::Texture(id)) => {
                pbr["baseColorTexture"] = json!({ "index": self.texture(id, false)? })
            }
            Some(Value::Rgb(c)) => {
                let c = (self.to_srgb * c).clamp(Vec3::ZERO, Vec3::ONE);
                pbr["baseColorFactor"] = json!([c.x, c.y, c.z, 1.0]);
            }
            Some(Value::Number(v)) => pbr["baseColorFactor"] = json!([v, v, v, 1.0]),
            None => return Err(self.cannot(&format!("the model '{}'", kind.name()))),
        }
        if matches!(kind, Kind::Lambert | Kind::OrenNayar) {
            (pbr["metallicFactor"], pbr["roughnessFactor"]) = (json!(0.0), json!(1.0));
            entry["extensions"]["KHR_materials_specular"] = json!({ "specularFactor": 0.0 });
            self.used.insert("KHR_materials_specular");
        } else {
            let mut picture = None;
            for (name, factor, channel) in
                [("roughness", "roughnessFactor", 1), ("metallic", "metallicFactor", 2)]
            {
                match value(name) {
                    Some(Value::Number(v)) => pbr[factor] = json!(v),
                    Some(Value::Texture(id)) => {
                        let found = match self.scene.textures.get(id) {
                            Some(Texture::Image { image, channel: Some(c), .. }) if *c == channel => {
                                Arc::as_ptr(image)
                            }
                            _ => return Err(self.cannot(&format!("{name} from another channel than glTF's"))),
                        };
                        if picture.is_some_and(|p| p != found) {
                            return Err(self.cannot("roughness and metal from two pictures"));
                        }
                        picture = Some(found);
                        pbr["metallicRoughnessTexture"] = json!({ "index": self.texture(id, true)? });
                    }
                    _ => {}
                }
            }
            // A picture tells both; what is a number all over is so by its factor, where the picture has ones.
            let number = |name: &str, default: f32| match value(name) {
                Some(Value::Number(v)) => v,
                _ => default,
            };
            if let Some(Value::Rgb(c)) = value("sheen_color")
                && c != Vec3::ZERO
            {
                let c = (self.to_srgb * c).clamp(Vec3::ZERO, Vec3::ONE);
                let roughness = number("sheen_roughness", 0.0);
                entry["extensions"]["KHR_materials_sheen"] =
                    json!({ "sheenColorFactor": c.to_array(), "sheenRoughnessFactor": roughness });
                self.used.insert("KHR_materials_sheen");
            }
            if number("specular", 1.0) != 1.0 {
                entry["extensions"]["KHR_materials_specular"] =
                    json!({ "specularFactor": number("specular", 1.0) });
                self.used.insert("KHR_materials_specular");
            }
            if number("ior", 1.5) != 1.5 {
                entry["extensions"]["KHR_materials_ior"] = json!({ "ior": number("ior", 1.5) });
                self.used.insert("KHR_materials_ior");
            }
            if number("clearcoat", 0.0) > 0.0 {
                let (factor, roughness) = (number("clearcoat", 0.0), number("clearcoat_roughness", 0.0));
                entry["extensions"]["KHR_materials_clearcoat"] =
                    json!({ "clearcoatFactor": factor, "clearcoatRoughnessFactor": roughness });
                self.used.insert("KHR_materials_clearcoat");
            }
        }
        entry["pbrMetallicRoughness"] = pbr;
        Ok(())
    }

    fn texture(&mut self, id: TextureId, raw: bool) -> Result<usize, Error> {
        let Some(Texture::Image { image, filter, wrap, to_uv, .. }) = self.scene.textures.get(id) else {
            return Err(self.cannot("a texture that is no picture"));
        };
        if *to_uv != Affine2::IDENTITY {
            return Err(self.cannot("a texture that is moved"));
        }
        let key = (Arc::as_ptr(image), raw);
        let source = match self.pictures.get(&key) {
            Some(source) => *source,
            None => {
                let options = WriteOptions { raw, ..WriteOptions::from(self.scene.working_space) };
                let bytes = image::write_bytes(Path::new("texture.png"), image, &options)?;
                let view = self.view(&bytes, None);
                self.images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
                self.pictures.insert(key, self.images.len() - 1);
                self.images.len() - 1
            }
        };
        let code = |w: &Wrap| match w {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        };
        let magnify = if *filter == TextureFilter::Nearest { 9728 } else { 9729 };
        let sampler = json!({ "magFilter": magnify, "minFilter": 9987, "wrapS": code(&wrap[0]), "wrapT": code(&wrap[1]) });
        let sampler = match self.samplers.iter().position(|s| *s == sampler) {
            Some(index) => index,
            None => {
                self.samplers.push(sampler);
                self.samplers.len() - 1
            }
        };
        let texture = json!({ "source": source, "sampler": sampler });
        Ok(match self.textures.iter().position(|t| *t == texture) {
            Some(index) => index,
            None => {
                self.textures.push(texture);
                self.textures.len() - 1
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Options, toml};
    use std::path::PathBuf;
    use yugen_scene::{Film, FovAxis, ModelBuilder, Shape, TurnedNormals, look_along};

    /// A scene of everything that both writers take, in sRGB, its pictures of whole codes.
    fn scene(space: ColourSpace) -> Scene {
        let mut scene = Scene { working_space: space, ..Scene::default() };
        let picture = |f: &dyn Fn(usize) -> f32| {
            let mut image = Image::rgb(4, 4);
            image.data.iter_mut().enumerate().for_each(|(i, v)| *v = f(i));
            Arc::new(image)
        };
        let texture = |image: Arc<Image>, channel| Texture::Image {
            image,
            filter: TextureFilter::Bilinear,
            wrap: [Wrap::Mirror; 2],
            to_uv: Affine2::IDENTITY,
            channel,
        };
        let rough = picture(&|i| (i * 5 % 256) as f32 / 255.0);
        scene.textures = vec![
            texture(picture(&|i| if i % 2 == 0 { 1.0 } else { 0.0 }), None),
            texture(rough.clone(), Some(1)),
            texture(rough, Some(2)),
            texture(picture(&|i| if i % 3 == 2 { 1.0 } else { 128.0 / 255.0 }), None),
        ];
        let mut metal = ModelBuilder::new(Kind::MetallicRoughness);
        metal.set("base_color", Value::Texture(0)).unwrap();
        metal.set("roughness", Value::Texture(1)).unwrap().set("metallic", Value::Texture(2)).unwrap();
        metal.set("sheen_color", Value::Rgb(Vec3::new(0.25, 0.5, 0.125))).unwrap();
        metal.set("specular", Value::Number(0.5)).unwrap();
        let turned = TurnedNormals::default();
        scene.materials.push(Material::NormalMap { texture: 3, scale: 0.5, turned, base: 1 });
        scene.materials.push(metal.build().unwrap());
        scene.materials.push(Material::lambert(Value::Rgb(Vec3::new(0.5, 0.25, 0.125))));
        let ball = Arc::new(yugen_scene::primitives::ball(8));
        let place =
            Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)) * Mat4::from_scale(Vec3::new(1.0, 2.0, 0.5));
        scene.shapes.push(Shape::new("柱 \"a\"", Geometry::Mesh(ball.clone()), place, 0));
        scene.shapes.push(Shape::new("b", Geometry::Mesh(ball), Mat4::IDENTITY, 2));
        let mut lamp = Shape::new("lamp", Geometry::Sphere, Mat4::from_scale(Vec3::splat(0.5)), 2);
        lamp.emission = Some(Value::Rgb(Vec3::new(8.0, 4.0, 2.0)));
        scene.shapes.push(lamp);
        scene.add_light(
            "fire",
            Light::Point { position: Vec3::new(0.0, 5.0, 0.0), intensity: Vec3::new(4.0, 2.0, 1.0) },
        );
        let direction = Vec3::new(0.6, -0.8, 0.0);
        scene.add_light("moon", Light::Directional { direction, irradiance: Vec3::splat(0.5) });
        scene.cameras.push(Camera {
            name: "seat".into(),
            to_world: look_along(Vec3::new(0.0, 1.0, 9.0), Vec3::new(0.1, -0.1, -1.0), Vec3::Y),
            projection: Projection::Perspective {
                fov_x: 1.0,
                fov_axis: FovAxis::X,
                aperture_radius: 0.0,
                focus_distance: 5.0,
                principal_point: glam::Vec2::ZERO,
            },
            near_far: [0.1, 100.0],
            film: Film { width: 320, height: 160, ..Film::default() },
            samples_per_pixel: 16,
        });
        scene
    }

    fn labels() -> Labels {
        let pair = |k: &str, v: &str| (k.to_string(), v.to_string());
        Labels {
            materials: vec!["gold".into()],
            shapes: vec![vec![pair("ja", "シテ柱"), pair("en", "a \"pillar\"\nof two lines")]],
            about: vec![pair("notes", "two\nlines")],
        }
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("yugen-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    /// What both formats have in common is read back.
    fn same(read: &Scene, wrote: &Scene) {
        for (a, b) in read.shapes.iter().zip(&wrote.shapes) {
            assert_eq!(a.name, b.name);
            let far = (a.to_world - b.to_world).to_cols_array().map(f32::abs);
            assert!(far.iter().all(|v| *v < 1e-6), "{}", a.name);
            if let (Geometry::Mesh(a), Geometry::Mesh(b)) = (&a.geometry, &b.geometry) {
                assert_eq!((&a.positions, &a.uvs, &a.triangles), (&b.positions, &b.uvs, &b.triangles));
            }
        }
        assert_eq!(read.shapes.len(), wrote.shapes.len());
        let to = wrote.working_space.matrix_to(read.working_space);
        for (i, (a, b)) in read.lights.iter().zip(&wrote.lights).enumerate() {
            assert_eq!(read.light_name(i), wrote.light_name(i));
            match (a, b) {
                (Light::Point { position: p, intensity: a }, Light::Point { position: q, intensity: b }) => {
                    assert!(p.distance(*q) < 1e-5 && a.distance(to * *b) < 1e-4);
                }
                (
                    Light::Directional { direction: p, irradiance: a },
                    Light::Directional { direction: q, irradiance: b },
                ) => {
                    assert!(p.distance(*q) < 1e-5 && a.distance(to * *b) < 1e-5);
                }
                _ => panic!("{a:?} {b:?}"),
            }
        }
        let (a, b) = (&read.cameras[0], &wrote.cameras[0]);
        let far = (a.to_world - b.to_world).to_cols_array().map(f32::abs);
        assert!(a.name == b.name && far.iter().all(|v| *v < 1e-5), "{far:?}");
        let (Projection::Perspective { fov_x: p, .. }, Projection::Perspective { fov_x: q, .. }) =
            (&a.projection, &b.projection)
        else {
            panic!("perspective")
        };
        assert!((p - q).abs() < 1e-5 && a.film.width * b.film.height == b.film.width * a.film.height);
        let lamp = &read.shapes[2];
        let Some(Value::Rgb(c)) = &lamp.emission else { panic!("a lamp that shines") };
        assert!(c.distance(to * Vec3::new(8.0, 4.0, 2.0)) < 1e-3, "{c}");
        // The first shape: a normal map over the model with its pictures.
        let Material::NormalMap { scale, base, texture, .. } = read.materials[material(read, 0)] else {
            panic!("a normal map")
        };
        assert_eq!(scale, 0.5);
        let pixels = |t: usize, scene: &Scene| match &scene.textures[t] {
            Texture::Image { image, wrap, .. } => {
                assert_eq!(*wrap, [Wrap::Mirror; 2]);
                image.data.clone()
            }
            other => panic!("{other:?}"),
        };
        assert_eq!(pixels(texture, read), pixels(3, wrote));
        let Material::Model { kind, params, .. } = &read.materials[base] else { panic!("a model") };
        assert_eq!(*kind, Kind::MetallicRoughness);
        let value =
            |name: &str| kind.params().iter().zip(params).find(|(p, _)| p.name == name).unwrap().1.clone();
        for (name, channel) in [("roughness", 1), ("metallic", 2)] {
            let Value::Texture(t) = value(name) else { panic!("{name}") };
            assert_eq!(pixels(t, read), pixels(1, wrote));
            assert!(matches!(read.textures[t], Texture::Image { channel: Some(c), .. } if c == channel));
        }
        let Value::Rgb(sheen) = value("sheen_color") else { panic!("sheen") };
        assert!(
            sheen.distance(to * Vec3::new(0.25, 0.5, 0.125)) < 1e-5
                && value("specular") == Value::Number(0.5)
        );
    }

    /// Without the rule of one side that closed meshes come back with.
    fn material(scene: &Scene, shape: usize) -> MaterialId {
        match scene.materials[scene.shapes[shape].material] {
            Material::OneSided { base } => base,
            _ => scene.shapes[shape].material,
        }
    }

    #[test]
    fn a_scene_written_as_glb_is_read_back() {
        let wrote = scene(ColourSpace::LinearSrgb);
        let folder = folder("glb-write");
        let path = folder.join("a.glb");
        write(&path, &wrote, &labels()).unwrap();
        let read = crate::formats::load_scene(&path, &Options::default()).unwrap();
        same(&read, &wrote);
        // Names and remarks are in the file.
        let bytes = std::fs::read(&path).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let root: Json = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        assert_eq!(root["nodes"][0]["extras"]["ja"], "シテ柱");
        assert_eq!(root["asset"]["extras"]["notes"], "two\nlines");
        assert_eq!(root["materials"][0]["name"], "gold");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_scene_written_as_toml_is_read_back() {
        let folder = folder("toml-write");
        for space in ColourSpace::ALL {
            let path = folder.join(format!("{}.toml", space.name()));
            let mut wrote = scene(space);
            if space != ColourSpace::LinearSrgb {
                // Black and white are the same in every space; other colours are not whole codes any more.
                wrote.textures[0] = wrote.textures[3].clone();
            }
            // Files have names of plain letters.
            wrote.shapes[0].name = "a".into();
            toml::write(&path, &wrote, &labels()).unwrap();
            let read = crate::formats::load_scene(&path, &Options::default()).unwrap();
            assert_eq!(read.working_space, space);
            same(&read, &wrote);
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_a_format_has_no_form_for_is_named() {
        let folder = folder("write-errors");
        let mut wrote = scene(ColourSpace::LinearSrgb);
        wrote.shapes[1].geometry = Geometry::Disc;
        for said in [
            write(&folder.join("a.glb"), &wrote, &labels()).unwrap_err().to_string(),
            toml::write(&folder.join("a.toml"), &wrote, &labels()).unwrap_err().to_string(),
        ] {
            assert!(said.contains("the shape 'b' is neither a mesh nor a sphere"), "{said}");
        }
        assert!(!folder.join("a.glb").exists() && !folder.join("a.toml").exists());
        let mut wrote = scene(ColourSpace::LinearSrgb);
        wrote.materials[1] = Material::Null;
        let said = write(&folder.join("a.glb"), &wrote, &labels()).unwrap_err().to_string();
        assert!(said.contains("the material 'gold'"), "{said}");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
