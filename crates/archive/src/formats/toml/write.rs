//! Writes a scene as TOML, with its meshes (PLY) and pictures (PNG, EXR) in a folder of the same name beside it.

use crate::formats::btf;
use crate::formats::image::{self, WriteOptions};
use crate::formats::labels::Labels;
use crate::formats::pc2::PointCache;
use crate::formats::{motion, ply};
use crate::{Error, Place, atomic_write, make_folder};
use glam::{Affine2, Mat4, Vec3};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use yugen_motion::SkeletalMotion;
use yugen_motion::fire::Fire;
use yugen_optics::Image;
use yugen_optics::adaptation::Adaptation;
use yugen_reflectance::{Choice, Kind, ParamType};
use yugen_scene::{
    Attachment, CachedMesh, Camera, Display, Figure, Film, Geometry, Light, Material, MaterialId, Part,
    Projection, Scene, Shape, Texture, TextureFilter, TextureId, Value, Wrap,
};

/// The folder beside `path` that [`write`] puts meshes and pictures into.
pub fn folder(path: &Path) -> PathBuf {
    path.with_extension("")
}

/// Writes `scene` to `path`. Cameras, fires, point and directional lights, constant and pictured environments, meshes and
/// spheres, models with numbers, colours and pictures, maps of cloths, normal maps, two-sided and one-sided materials,
/// caches, and figures of one animation that carry shapes are written; anything else is an error that names it. A mesh is called after its file, whose name is that of the shape in plain
/// letters. The scene file is written last: where it is, all of its files are.
pub fn write(path: &Path, scene: &Scene, labels: &Labels) -> Result<(), Error> {
    let folder = folder(path);
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if name.is_empty() || folder == path {
        return Err(Error::invalid(Place::file(path), "a scene file is called NAME.toml"));
    }
    make_folder(&folder)?;
    let writer =
        Writer { path, folder, name, scene, labels, pictures: HashMap::new(), taken: BTreeSet::new() };
    let text = writer.text()?;
    atomic_write(path, text.as_bytes())
}

struct Writer<'a> {
    path: &'a Path,
    folder: PathBuf,
    /// Of the folder.
    name: String,
    scene: &'a Scene,
    labels: &'a Labels,
    /// Names of pictures by where they are in memory, and whether raw.
    pictures: HashMap<(*const Image, bool), String>,
    /// Names of files.
    taken: BTreeSet<String>,
}

/// As a TOML string.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => _ = write!(out, "\\u{:04X}", c as u32),
            c => out.push(c),
        }
    }
    out + "\""
}

/// Where something is placed, if it is.
fn matrix(to_world: Mat4, out: &mut String) {
    if to_world != Mat4::IDENTITY {
        let rows = to_world.transpose().to_cols_array_2d();
        let row = |r: [f32; 4]| format!("[{}, {}, {}, {}]", r[0], r[1], r[2], r[3]);
        let _ = writeln!(out, "matrix = [{}]", rows.map(row).join(", "));
    }
}

fn triple(v: Vec3) -> String {
    format!("[{}, {}, {}]", v.x, v.y, v.z)
}

fn wrap_name(wrap: Wrap) -> &'static str {
    match wrap {
        Wrap::Repeat => "repeat",
        Wrap::Mirror => "mirror",
        Wrap::Clamp => "clamp",
    }
}

impl Writer<'_> {
    fn text(mut self) -> Result<String, Error> {
        let mut out = String::new();
        for (key, value) in &self.labels.about {
            // A comment is one line.
            let _ = writeln!(out, "# {key}: {}", value.replace(['\n', '\r'], " "));
        }
        let space = self.scene.working_space.name();
        let _ = writeln!(out, "[scene]\nworking_space = {0}\ncolours = {0}", quoted(space));
        let (first, Display { exposure, curve, adaptation }) =
            (self.scene.cameras.first(), self.scene.display);
        let shown = self.scene.display != Display::default();
        if first.is_some() || shown {
            let _ = writeln!(out, "\n[film]");
        }
        if let Some(Film { width, height, .. }) = first.map(|c| &c.film) {
            let _ = writeln!(out, "size = [{width}, {height}]");
        }
        if shown {
            let _ = writeln!(out, "exposure = {exposure}\ncurve = {}", quoted(curve.name()));
        }
        if adaptation != Adaptation::default() {
            let _ = writeln!(out, "adaptation = {}", quoted(adaptation.name()));
        }
        if let Some(first) = first {
            let _ = writeln!(out, "\n[render]\nsamples = {}", first.samples_per_pixel);
        }
        for camera in &self.scene.cameras {
            self.camera(camera, &mut out)?;
        }
        // Fires bring shapes of their own.
        let of_fires: BTreeSet<usize> = self.scene.fires.iter().flat_map(|f| f.shapes()).collect();
        let own = || self.scene.shapes.iter().enumerate().filter(|(i, _)| !of_fires.contains(i));
        let mut used: BTreeSet<MaterialId> = own().map(|(_, s)| s.material).collect();
        // Both sides of a material have names of their own.
        for id in used.clone() {
            used.extend(self.sides(id).into_iter().flatten());
        }
        for id in used {
            self.material(id, &mut out)?;
        }
        let carried = self.figures(&mut out)?;
        let scene = self.scene;
        for (i, shape) in scene.shapes.iter().enumerate().filter(|(i, _)| !of_fires.contains(i)) {
            let _ = writeln!(out, "\n[[shape]]\nname = {}", quoted(&shape.name));
            for (key, value) in self.labels.shapes.get(i).into_iter().flatten() {
                let _ = writeln!(out, "# {key}: {}", value.replace(['\n', '\r'], " "));
            }
            match &shape.geometry {
                Geometry::Mesh(mesh) => {
                    let cache = scene.caches.iter().find(|c| c.shape() == i);
                    let file = self.file(&shape.name, "ply");
                    let mesh = cache.map_or(mesh, |c| c.rest());
                    atomic_write(&self.folder.join(&file), &ply::write_bytes(mesh))?;
                    let file = quoted(&format!("{}/{file}", self.name));
                    let _ = writeln!(out, "type = \"file\"\nfile = {file}");
                    if let Some(cache) = cache {
                        self.cache(shape, cache, &mut out)?;
                    }
                }
                Geometry::Sphere => out.push_str("type = \"sphere\"\n"),
                _ => {
                    return Err(
                        self.cannot(format!("the shape '{}' is neither a mesh nor a sphere", shape.name))
                    );
                }
            }
            let _ = writeln!(out, "material = {}", quoted(&self.labels.material(shape.material)));
            let mut to_world = shape.to_world;
            if let Some((figure, joint, to_joint)) = carried.get(&i) {
                let _ = writeln!(out, "figure = {}\njoint = {}", quoted(figure), quoted(joint));
                to_world = *to_joint;
            }
            matrix(to_world, &mut out);
            if let Some(emission) = &shape.emission {
                let emission = self.value(emission, false, &shape.name, "emission")?;
                let _ = writeln!(out, "emission = {emission}");
            }
            for (on, key) in [
                (shape.two_sided_emission, "emits_both_sides"),
                (shape.flip_normals, "flip"),
                (shape.face_normals, "flat"),
            ] {
                if on {
                    let _ = writeln!(out, "{key} = true");
                }
            }
        }
        for (i, light) in scene.lights.iter().enumerate() {
            out.push_str("\n[[light]]\n");
            if let Some(name) = scene.light_names.get(i).filter(|n| !n.is_empty()) {
                let _ = writeln!(out, "name = {}", quoted(name));
            }
            match light {
                Light::Point { position, intensity } => {
                    let _ = writeln!(
                        out,
                        "type = \"point\"\nat = {}\nintensity = {}",
                        triple(*position),
                        triple(*intensity)
                    );
                }
                Light::Directional { direction, irradiance } => {
                    let (way, light) = (triple(*direction), triple(*irradiance));
                    let _ = writeln!(out, "type = \"directional\"\ndirection = {way}\nirradiance = {light}");
                }
                Light::Constant { radiance } => {
                    let _ = writeln!(out, "type = \"constant\"\nradiance = {}", triple(*radiance));
                }
                Light::Environment { image, scale, to_world } if *to_world == Mat4::IDENTITY => {
                    let file = self.file("environment", "exr");
                    let options = WriteOptions { half: true, ..WriteOptions::from(scene.working_space) };
                    image::write(&self.folder.join(&file), image, &options)?;
                    let file = quoted(&format!("{}/{file}", self.name));
                    let _ = writeln!(out, "type = \"environment\"\nimage = {file}\nscale = {scale}");
                }
                Light::Volume { .. } if scene.fires.iter().any(|f| f.light() == i) => {
                    for fire in scene.fires.iter().filter(|f| f.light() == i) {
                        let Fire { foot, up, diameter, power, candela, wind, seed, flicker } = *fire.fire();
                        let _ = writeln!(
                            out,
                            "type = \"fire\"\nat = {}\nup = {}\ndiameter = {diameter}\npower = {power}\n\
                             candela = {candela}\nwind = {}\nseed = {seed}\nflicker = {}\ncell = {}",
                            triple(foot),
                            triple(up),
                            triple(wind),
                            quoted(flicker.name()),
                            fire.cell()
                        );
                    }
                }
                _ => return Err(self.cannot(format!("light {i} is of a kind that is not written"))),
            }
        }
        Ok(out)
    }

    /// Figures with their motion; of each shape that a joint carries, the names of both and where it is at the joint.
    fn figures(&mut self, out: &mut String) -> Result<BTreeMap<usize, (String, String, Mat4)>, Error> {
        let mut carried = BTreeMap::new();
        for figure in &self.scene.figures {
            let Figure { to_world, skeleton, clips, attachments, deformed, .. } = &**figure;
            let ([clip], []) = (&clips[..], &deformed[..]) else {
                return Err(self.cannot("a figure has a skin or several animations".into()));
            };
            let file = self.file("figure", "glb");
            let name = file.trim_end_matches(".glb").to_string();
            let path = self.folder.join(&file);
            let frames = clip.channels.iter().map(|(_, curve)| curve.times().len()).max().unwrap_or(0);
            let [first, last] = clip.span();
            let rate = if last > first { (frames - 1) as f64 / f64::from(last - first) } else { 0.0 };
            let moved = SkeletalMotion { skeleton: skeleton.clone(), clip: clip.clone(), rate, frames };
            atomic_write(&path, &motion::gltf::write(&moved, &path)?)?;
            let file = quoted(&format!("{}/{file}", self.name));
            let _ = writeln!(out, "\n[[figure]]\nname = {}\nmotion = {file}", quoted(&name));
            matrix(*to_world, out);
            for Attachment { joint, part } in attachments {
                let Part::Shape { shape, to_joint, flips: false } = part else {
                    return Err(self.cannot("a figure carries a camera, a light or a mirrored shape".into()));
                };
                let joint = skeleton.joints()[*joint].name.clone();
                carried.insert(*shape, (name.clone(), joint, *to_joint));
            }
        }
        Ok(carried)
    }

    /// Where the vertices of a shape are over time, as a file of its own.
    fn cache(&mut self, shape: &Shape, cache: &CachedMesh, out: &mut String) -> Result<(), Error> {
        let space = match cache.to_shape() {
            m if m == Mat4::IDENTITY => "own",
            m if m == shape.to_world.inverse() => "world",
            _ => return Err(self.cannot(format!("the cache of '{}' has coordinates of its own", shape.name))),
        };
        let file = self.file(&shape.name, "pc2");
        let start = (f64::from(cache.span()[0]) * cache.rate()) as f32;
        let points = PointCache { start, rate: 1.0, samples: cache.samples().to_vec() };
        points.write(&self.folder.join(&file))?;
        let (file, fps) = (quoted(&format!("{}/{file}", self.name)), cache.rate());
        let _ = writeln!(out, "cache = {{ file = {file}, fps = {fps}, space = \"{space}\" }}");
        Ok(())
    }

    fn cannot(&self, problem: String) -> Error {
        Error::invalid(Place::file(self.path), format!("{problem}; leave it out or write it by hand"))
    }

    fn camera(&self, camera: &Camera, out: &mut String) -> Result<(), Error> {
        let [across, up, forward, at] = [0, 1, 2, 3].map(|i| camera.to_world.col(i).truncate());
        let [near, far] = camera.near_far;
        let Projection::Perspective { fov_x, aperture_radius, focus_distance, principal_point, .. } =
            camera.projection
        else {
            let _ = writeln!(
                out,
                "\n[[camera]]\nname = {}\nfrom = {}\nto = {}\nup = {}\nwidth = {}\nnear_far = [{near}, {far}]",
                quoted(&camera.name),
                triple(at),
                triple(at + forward),
                triple(up.normalize_or(Vec3::Y)),
                2.0 * across.length(),
            );
            return Ok(());
        };
        let _ = writeln!(
            out,
            "\n[[camera]]\nname = {}\nfrom = {}\nto = {}\nup = {}\nfov = {}\nnear_far = [{near}, {far}]",
            quoted(&camera.name),
            triple(at),
            triple(at + forward * focus_distance),
            triple(up),
            fov_x.to_degrees(),
        );
        if aperture_radius > 0.0 {
            let _ = writeln!(out, "aperture = {aperture_radius}");
        }
        if principal_point != glam::Vec2::ZERO {
            let _ = writeln!(out, "shift = [{}, {}]", principal_point.x, principal_point.y);
        }
        Ok(())
    }

    /// The materials of a front and a back that differ.
    fn sides(&self, id: MaterialId) -> Option<[MaterialId; 2]> {
        match self.scene.materials.get(id) {
            Some(Material::TwoSided { front, back }) if front != back => Some([*front, *back]),
            _ => None,
        }
    }

    fn material(&mut self, id: MaterialId, out: &mut String) -> Result<(), Error> {
        let name = self.labels.material(id);
        let _ = writeln!(out, "\n[material.{}]", quoted(&name));
        if let Some(sides) = self.sides(id) {
            let [front, back] = sides.map(|id| quoted(&self.labels.material(id)));
            let _ = writeln!(out, "front = {front}\nback = {back}");
            return Ok(());
        }
        let mut at = id;
        // What is around a model, from outside in.
        for _ in 0..8 {
            match self.scene.materials.get(at) {
                Some(Material::TwoSided { front, back }) if front == back => {
                    out.push_str("two_sided = true\n");
                    at = *front;
                }
                Some(Material::NormalMap { texture, scale, base, .. }) => {
                    let picture = self.texture(*texture, true, &name, "normal")?;
                    let _ = writeln!(out, "normal_map = {picture}\nnormal_scale = {scale}");
                    at = *base;
                }
                Some(Material::Model { kind, params, .. }) => {
                    let _ = writeln!(out, "model = {}", quoted(kind.name()));
                    for (param, value) in kind.params().iter().zip(params.clone()) {
                        if param.name == "space" {
                            continue;
                        }
                        let text = match (param.kind, &value) {
                            (ParamType::Choice(names), Value::Number(i)) => {
                                quoted(names.get(*i as usize).copied().unwrap_or_default())
                            }
                            (kind, value) => {
                                self.value(value, kind == ParamType::Number, &name, param.name)?
                            }
                        };
                        let _ = writeln!(out, "{} = {text}", param.name);
                    }
                    return Ok(());
                }
                Some(Material::Cloth { texture, form }) => {
                    let text = self.cloth(*texture, *form, &name)?;
                    out.push_str(&text);
                    return Ok(());
                }
                _ => break,
            }
        }
        Err(self.cannot(format!("the material '{name}' is of a kind that is not written")))
    }

    /// The maps of a cloth as a file of their own, and how they lie.
    fn cloth(&mut self, id: TextureId, form: Choice, owner: &str) -> Result<String, Error> {
        let Some(Texture::Cloth { maps, wrap, to_uv }) = self.scene.textures.get(id) else {
            return Err(self.cannot(format!("the cloth '{owner}' has no maps")));
        };
        let m = to_uv.matrix2;
        if m.x_axis.y != 0.0 || m.y_axis.x != 0.0 {
            return Err(self.cannot(format!("the maps of '{owner}' are turned")));
        }
        let names = match Kind::Noh.param("form").map(|(_, p)| p.kind) {
            Ok(ParamType::Choice(names)) => names,
            _ => &[],
        };
        let about = btf::About { source: format!("of the scene {}", self.name), ..btf::About::default() };
        let file = self.file(owner, "btf");
        btf::save(&self.folder.join(&file), maps, &about)?;
        Ok(format!(
            "btf = {}\nform = {}\nscale = [{}, {}]\noffset = [{}, {}]\nwrap = \"{}\"\n",
            quoted(&format!("{}/{file}", self.name)),
            quoted(names.get(form.index() as usize).copied().unwrap_or_default()),
            m.x_axis.x,
            m.y_axis.y,
            to_uv.translation.x,
            to_uv.translation.y,
            wrap_name(*wrap),
        ))
    }

    fn value(&mut self, value: &Value, raw: bool, owner: &str, what: &str) -> Result<String, Error> {
        Ok(match value {
            Value::Number(v) => v.to_string(),
            Value::Rgb(c) => triple(*c),
            Value::Texture(id) => self.texture(*id, raw, owner, what)?,
        })
    }

    /// A picture described on the spot, written where it is not yet.
    fn texture(&mut self, id: TextureId, raw: bool, owner: &str, what: &str) -> Result<String, Error> {
        let Some(Texture::Image { image, filter, wrap: [wrap, down], to_uv, channel }) =
            self.scene.textures.get(id)
        else {
            return Err(self.cannot(format!("a texture of '{owner}' is no picture")));
        };
        if wrap != down || *to_uv != Affine2::IDENTITY {
            return Err(self.cannot(format!("a texture of '{owner}' is moved, or wraps in two ways")));
        }
        let key = (Arc::as_ptr(image), raw);
        let file = match self.pictures.get(&key) {
            Some(file) => file.clone(),
            None => {
                let file = self.file(&format!("{owner}-{what}"), "png");
                let options = WriteOptions { raw, ..WriteOptions::from(self.scene.working_space) };
                image::write(&self.folder.join(&file), image, &options)?;
                self.pictures.insert(key, file.clone());
                file
            }
        };
        let filter = match filter {
            TextureFilter::Nearest => "nearest",
            TextureFilter::Bilinear => "bilinear",
            TextureFilter::Mip => "mip",
        };
        let wrap = wrap_name(*wrap);
        let channel = channel
            .and_then(|c| image.channels.get(c))
            .map(|c| format!(", channel = {}", quoted(c)))
            .unwrap_or_default();
        let file = quoted(&format!("{}/{file}", self.name));
        Ok(format!("{{ image = {file}, raw = {raw}, filter = \"{filter}\", wrap = \"{wrap}\"{channel} }}"))
    }

    /// A name of its own for a file, of letters that every system takes.
    fn file(&mut self, name: &str, extension: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
        let stem: String = name.chars().map(plain).collect();
        let mut file = format!("{stem}.{extension}");
        let mut n = 1;
        while !self.taken.insert(file.clone()) {
            n += 1;
            file = format!("{stem}-{n}.{extension}");
        }
        file
    }
}
