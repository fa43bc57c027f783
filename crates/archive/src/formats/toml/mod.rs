//! Yugen's own scene file: TOML, small enough to write by hand. The manual is `docs/scene.md`.

pub(in crate::formats) mod document;
mod materials;
mod movement;
mod shapes;
#[cfg(test)]
mod tests;
mod write;

pub use write::{folder, write};

use super::Options;
use super::folders::Folders;
use super::mtl::Libraries;
use crate::{Error, Place};
use document::{Document, Item, Keys};
use glam::{EulerRot, Mat4, Quat, Vec2, Vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use yugen_motion::fire::{Fire, Flicker, PARAMETERS, Parameter};
use yugen_optics::adaptation::Adaptation;
use yugen_optics::tonemap::Curve;
use yugen_optics::{ColourSpace, Image};
use yugen_scene::Scene;
use yugen_scene::{
    Aov, Camera, Figure, Film, Filter, FovAxis, Integrator, IntegratorKind, Light, Material, MaterialId,
    Mesh, Projection, Texture, TextureId, look_along,
};

/// The most samples a pixel may ask for: a year of rendering.
const MAX_SAMPLES: u32 = 1 << 24;
/// The widest picture.
const MAX_PIXELS: u32 = 1 << 16;

/// Reads a scene from the bytes of a file; the path names it in messages and says where its files lie.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<Scene, Error> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let at = Place::byte(path, e.valid_up_to() as u64);
        Error::invalid(at, "this is no UTF-8 text; expected a scene in TOML")
    })?;
    let doc = Document { file: path, text };
    let table = doc.parse()?;
    let reader = Reader {
        folders: Folders::new(path, &options.folders, Some(["[scene] path = [\"", "\"]"]))?,
        colours: ColourSpace::LinearSrgb,
        scene: Scene::default(),
        textures: HashMap::new(),
        materials: HashMap::new(),
        images: HashMap::new(),
        layers: HashMap::new(),
        meshes: HashMap::new(),
        objs: HashMap::new(),
        libraries: HashMap::new(),
        groups: HashMap::new(),
        figures: Vec::new(),
        caches: Vec::new(),
        grey: None,
    };
    reader.scene(Keys::root(&doc, table.get_ref()), path)
}

/// A texture or a material that was named, and what has become of it.
enum Named<'a, Id> {
    /// Not yet looked at.
    Written(Item<'a>),
    /// Being read: whoever meets it now has found a circle.
    Open,
    /// Read.
    Done(Id),
}

/// Meshes with the names of their materials.
type Parts = Vec<(Option<String>, Arc<Mesh>)>;

struct Reader<'a> {
    folders: Folders,
    /// The space of `[r, g, b]`.
    colours: ColourSpace,
    scene: Scene,
    textures: HashMap<String, Named<'a, TextureId>>,
    materials: HashMap<String, Named<'a, MaterialId>>,
    /// By file and whether raw.
    images: HashMap<(PathBuf, bool), Arc<Image>>,
    /// Layers of these.
    layers: HashMap<(PathBuf, bool, String), Arc<Image>>,
    meshes: HashMap<PathBuf, Arc<Mesh>>,
    /// The meshes of OBJ files with the names of their materials; by file and whether these are asked for.
    objs: HashMap<(PathBuf, bool), Parts>,
    libraries: HashMap<PathBuf, Libraries>,
    groups: HashMap<String, usize>,
    /// By name, until the scene takes them.
    figures: Vec<(String, Figure)>,
    caches: Vec<movement::Cache>,
    /// What shapes without a material are made of.
    grey: Option<MaterialId>,
}

impl<'a> Reader<'a> {
    fn scene(mut self, mut root: Keys<'a>, file: &Path) -> Result<Scene, Error> {
        if let Some(item) = root.get("scene") {
            let mut keys = item.keys("scene")?;
            let spaces = ColourSpace::ALL.map(|s| (s.name(), s));
            self.scene.working_space =
                keys.or("working_space", ColourSpace::default(), |i| i.one_of("colour space", &spaces))?;
            self.colours = keys.or("colours", self.colours, |i| i.one_of("colour space", &spaces))?;
            if let Some(item) = keys.get("path") {
                let folders = if item.try_text().is_some() { vec![item] } else { item.array()? };
                for folder in folders {
                    self.folders.add_last(folder.text()?, folder.file(), folder.place())?;
                }
            }
            keys.finish()?;
        }
        let film = self.film(&mut root)?;
        let samples = self.render(&mut root)?;

        if let Some(textures) = root.get("texture") {
            let named = textures.keys("texture")?.names();
            self.textures = named.into_iter().map(|i| (i.key.clone(), Named::Written(i))).collect();
        }
        if let Some(materials) = root.get("material") {
            let named = materials.keys("material")?.names();
            self.materials = named.into_iter().map(|i| (i.key.clone(), Named::Written(i))).collect();
        }
        // All of them, used or not: a mistake is a mistake.
        let mut names: Vec<String> = self.textures.keys().cloned().collect();
        names.sort();
        for name in names {
            self.named_texture(&name, None)?;
        }
        let mut names: Vec<String> = self.materials.keys().cloned().collect();
        names.sort();
        for name in names {
            self.named_material(&name, None)?;
        }

        if let Some(groups) = root.get("group") {
            for item in groups.keys("group")?.names() {
                let mut shapes = Vec::new();
                for shape in item.array()? {
                    self.shape(shape.keys("shape")?, &mut shapes)?;
                }
                // What is placed many times stands still.
                self.scene.figures.clear();
                if !self.caches.is_empty() {
                    return Err(item
                        .invalid("a shape of a group has a cache; what is placed many times stands still"));
                }
                self.scene.groups.push(shapes);
                self.groups.insert(item.key, self.scene.groups.len() - 1);
            }
        }
        if let Some(figures) = root.get("figure") {
            for figure in figures.array()? {
                self.figure(figure.keys("figure")?)?;
            }
        }
        if let Some(shapes) = root.get("shape") {
            // Nothing else has put shapes there, so that they keep the numbers by which figures know them.
            let mut all = Vec::new();
            for shape in shapes.array()? {
                self.shape(shape.keys("shape")?, &mut all)?;
            }
            self.scene.shapes = all;
        }
        self.move_in(file)?;
        if let Some(lights) = root.get("light") {
            for light in lights.array()? {
                let mut keys = light.keys("light")?;
                let name = keys.or("name", String::new(), |i| i.text().map(String::from))?;
                self.light(keys, &name)?;
            }
        }
        match root.get("camera") {
            Some(item) => {
                let cameras = if item.try_array().is_some() { item.array()? } else { vec![item] };
                for camera in cameras {
                    let camera = self.camera(camera.keys("camera")?, &film, samples)?;
                    self.scene.cameras.push(camera);
                }
            }
            None => {
                let camera = self.scene.framing_camera(film);
                self.scene.cameras = vec![Camera { samples_per_pixel: samples, ..camera }];
            }
        }
        root.finish()?;
        Ok(self.scene)
    }

    fn film(&mut self, root: &mut Keys<'a>) -> Result<Film, Error> {
        let mut film = Film::default();
        let Some(item) = root.get("film") else { return Ok(film) };
        let mut keys = item.keys("film")?;
        if let Some(size) = keys.get("size") {
            let sides = size.array()?;
            let [width, height] = &sides[..] else { return Err(size.wrong("width and height in pixels")) };
            (film.width, film.height) = (width.count(MAX_PIXELS)?, height.count(MAX_PIXELS)?);
        }
        if let Some(crop) = keys.get("crop") {
            let [x, y, w, h] = crop.numbers()?;
            let inside = |start: f32, length: f32, whole: u32| {
                start >= 0.0
                    && length >= 1.0
                    && start + length <= whole as f32
                    && start.fract() + length.fract() == 0.0
            };
            if !inside(x, w, film.width) || !inside(y, h, film.height) {
                return Err(crop.wrong("x, y, width and height of a part of the picture, in whole pixels"));
            }
            film.crop = Some([x, y, w, h].map(|v| v as u32));
        }
        let own = self.scene.display;
        self.scene.display.exposure = keys.or("exposure", own.exposure, |i| i.number_in(-60.0, 60.0))?;
        self.scene.display.curve =
            keys.or("curve", own.curve, |i| i.one_of("curve", &Curve::ALL.map(|c| (c.name(), c))))?;
        let adaptations = Adaptation::ALL.map(|a| (a.name(), a));
        self.scene.display.adaptation =
            keys.or("adaptation", own.adaptation, |i| i.one_of("adaptation", &adaptations))?;
        if let Some(filter) = keys.get("filter") {
            let filters = [
                ("box", Filter::Box),
                ("tent", Filter::Tent { radius: 1.0 }),
                ("gaussian", Filter::default()),
                ("mitchell", Filter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }),
                ("catmull_rom", Filter::CatmullRom),
                ("lanczos", Filter::Lanczos { lobes: 3.0 }),
            ];
            film.filter = filter.one_of("filter", &filters)?;
        }
        if let Some(width) = keys.get("filter_width") {
            let value = width.number_in(0.05, 16.0)?;
            match &mut film.filter {
                Filter::Tent { radius: w }
                | Filter::Gaussian { stddev: w }
                | Filter::Lanczos { lobes: w } => *w = value,
                _ => return Err(width.invalid("only the filters tent, gaussian and lanczos have a width")),
            }
        }
        keys.finish()?;
        Ok(film)
    }

    /// Sets the integrator; returns samples per pixel.
    fn render(&mut self, root: &mut Keys<'a>) -> Result<u32, Error> {
        let mut samples = 64;
        let Some(item) = root.get("render") else { return Ok(samples) };
        let mut keys = item.keys("render")?;
        let mut integrator = Integrator::default();
        samples = keys.or("samples", samples, |i| i.count(MAX_SAMPLES))?;
        let kinds = [
            ("path", IntegratorKind::Path),
            ("direct", IntegratorKind::Direct),
            ("depth", IntegratorKind::Depth),
            ("aov", IntegratorKind::Aov),
        ];
        if let Some(kind) = keys.get("integrator") {
            let words = [0, 1, 2, 3].map(|i| (kinds[i].0, i));
            integrator.kind = kinds[kind.one_of("integrator", &words)?].1.clone();
        }
        integrator.max_depth = keys.or("max_depth", None, |i| i.count(1 << 20).map(Some))?;
        integrator.rr_depth = keys.or("roulette_depth", integrator.rr_depth, |i| i.count(1 << 20))?;
        integrator.clamp = keys.or("clamp", None, |i| i.number_in(1e-6, 1e30).map(Some))?;
        integrator.hide_emitters = keys.or("hide_lights", false, Item::boolean)?;
        if let Some(aovs) = keys.get("aovs") {
            for aov in aovs.array()? {
                integrator.aovs.push(aov.one_of("AOV", &Aov::ALL.map(|a| (a.name(), a)))?);
            }
        }
        keys.finish()?;
        self.scene.integrator = integrator;
        Ok(samples)
    }

    fn camera(&mut self, mut keys: Keys<'a>, film: &Film, samples: u32) -> Result<Camera, Error> {
        let name = keys.or("name", "camera".to_string(), |i| i.text().map(String::from))?;
        let from = keys.need("from", "where it stands, [x, y, z]")?.vec3()?;
        let to_item = keys.need("to", "what it looks at, [x, y, z]")?;
        let to = to_item.vec3()?;
        let up = keys.or("up", Vec3::Y, Item::direction)?;
        let distance = from.distance(to);
        if distance < 1e-12 || up.cross(to - from).length() < 1e-6 * distance {
            return Err(
                to_item.invalid("the camera needs to look somewhere that is neither itself nor along 'up'")
            );
        }
        let mut to_world = look_along(from, to - from, up);
        let (fov, fov_y, width) = (keys.get("fov"), keys.get("fov_y"), keys.get("width"));
        let aperture_radius = keys.or("aperture", 0.0, |i| i.number_in(0.0, 1e6))?;
        let focus_distance = keys.or("focus", distance, |i| i.number_in(1e-6, 1e12))?;
        let principal_point = keys.or("shift", Vec2::ZERO, Item::vec2)?;
        let near_far = keys.or("near_far", [1e-4 * distance, 1e5 * distance], |i| {
            i.numbers().and_then(|[n, f]| {
                if 0.0 < n && n < f { Ok([n, f]) } else { Err(i.wrong("two growing distances")) }
            })
        })?;
        let aspect = film.height as f32 / film.width as f32;
        let projection = match (fov, fov_y, width) {
            (fov, None, None) => {
                let fov_x = fov.map_or(Ok(40.0), |i| i.number_in(0.01, 179.0))?.to_radians();
                let fov_axis = FovAxis::X;
                Projection::Perspective { fov_x, fov_axis, aperture_radius, focus_distance, principal_point }
            }
            (None, Some(fov_y), None) => {
                let half = 0.5 * fov_y.number_in(0.01, 179.0)?.to_radians();
                let (fov_x, fov_axis) = (2.0 * (half.tan() / aspect).atan(), FovAxis::Y);
                Projection::Perspective { fov_x, fov_axis, aperture_radius, focus_distance, principal_point }
            }
            (None, None, Some(width)) => {
                let half = 0.5 * width.number_in(1e-9, 1e12)?;
                to_world *= Mat4::from_scale(Vec3::new(half, half, 1.0));
                Projection::Orthographic
            }
            (_, Some(two), _) | (_, _, Some(two)) => {
                let problem =
                    "give one of 'fov' (across), 'fov_y' (down, both in degrees) and 'width' (parallel rays)";
                return Err(two.invalid(problem));
            }
        };
        let camera =
            Camera { name, to_world, projection, near_far, film: film.clone(), samples_per_pixel: samples };
        keys.finish()?;
        Ok(camera)
    }

    fn light(&mut self, mut keys: Keys<'a>, name: &str) -> Result<(), Error> {
        #[derive(Clone, Copy)]
        enum Type {
            Point,
            Spot,
            Directional,
            Constant,
            Environment,
            Projector,
            Fire,
        }
        let types = [
            ("point", Type::Point),
            ("spot", Type::Spot),
            ("directional", Type::Directional),
            ("constant", Type::Constant),
            ("environment", Type::Environment),
            ("projector", Type::Projector),
            ("fire", Type::Fire),
        ];
        let kind =
            keys.need("type", "a light such as \"point\" or \"environment\"")?.one_of("light", &types)?;
        let light = match kind {
            Type::Point => Light::Point {
                position: keys.need("at", "its place, [x, y, z]")?.vec3()?,
                intensity: self.light_colour(&mut keys, "intensity")?,
            },
            Type::Spot => {
                let to_world = aimed(&mut keys)?;
                let intensity = self.light_colour(&mut keys, "intensity")?;
                let cutoff = keys.or("angle", 30.0, |i| i.number_in(0.01, 89.9))?;
                let beam = keys.or("beam", 0.75 * cutoff, |i| i.number_in(0.0, cutoff))?;
                let texture = match keys.get("texture") {
                    Some(item) => Some(self.texture(&item, false)?),
                    None => None,
                };
                Light::Spot {
                    to_world,
                    intensity,
                    beam: beam.to_radians(),
                    cutoff: cutoff.to_radians(),
                    texture,
                }
            }
            Type::Directional => Light::Directional {
                direction: keys.need("direction", "the way the light travels, [x, y, z]")?.direction()?,
                irradiance: self.light_colour(&mut keys, "irradiance")?,
            },
            Type::Constant => Light::Constant { radiance: self.light_colour(&mut keys, "radiance")? },
            Type::Environment => {
                let image = keys.need("image", "the file of a latitude-longitude picture")?;
                let image = self.image(&image, false, keys.get("layer").as_ref())?;
                let image = match image.select(&["R", "G", "B"]) {
                    Some(rgb) => Arc::new(rgb),
                    None => {
                        return Err(
                            keys.invalid("the picture of an environment needs the channels R, G and B")
                        );
                    }
                };
                let scale = keys.or("scale", 1.0, |i| i.number_in(0.0, 1e12))?;
                Light::Environment { image, scale, to_world: Mat4::from_quat(rotation(&mut keys)?) }
            }
            Type::Projector => {
                let to_world = aimed(&mut keys)?;
                let texture = keys.need("texture", "the slide")?;
                let texture = self.texture(&texture, false)?;
                let scale = keys.or("scale", 1.0, |i| i.number_in(0.0, 1e12))?;
                let fov_x = keys.or("fov", 40.0, |i| i.number_in(0.01, 179.0))?.to_radians();
                Light::Projector { to_world, texture, scale, fov_x }
            }
            Type::Fire => return self.fire(keys, name),
        };
        keys.finish()?;
        self.scene.add_light(name, light);
        Ok(())
    }

    fn fire(&mut self, mut keys: Keys<'a>, name: &str) -> Result<(), Error> {
        let usual = Fire::default();
        let number = |keys: &mut Keys<'a>, p: &Parameter| {
            keys.or(p.name, p.default, |i| i.number_in(p.range[0], p.range[1]))
        };
        let [diameter, power, candela, wind] = &PARAMETERS;
        let flickers = Flicker::ALL.map(|f| (f.name(), f));
        let fire = Fire {
            foot: keys.or("at", usual.foot, |i| i.vec3())?,
            up: keys.or("up", usual.up, |i| i.direction())?,
            diameter: number(&mut keys, diameter)?,
            power: number(&mut keys, power)?,
            candela: number(&mut keys, candela)?,
            wind: keys.or(wind.name, usual.wind, |i| i.vec3())?,
            seed: keys.or("seed", usual.seed, |i| i.count(u32::MAX))?,
            flicker: keys.or("flicker", usual.flicker, |i| i.one_of("way to flicker", &flickers))?,
        };
        let cell = match keys.get("cell") {
            Some(item) => Some(item.number_in(1e-3, 1.0)?),
            None => None,
        };
        let seconds = keys.or("seconds", 0.0, |i| i.number_in(-1e6, 1e6))?;
        let place = keys.place();
        keys.finish()?;
        self.scene
            .add_fire(name, &fire, cell, seconds.into())
            .map_err(|e| Error::invalid(place, e.to_string()))
    }

    fn push_material(&mut self, material: Material) -> MaterialId {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    fn push_texture(&mut self, texture: Texture) -> TextureId {
        self.scene.textures.push(texture);
        self.scene.textures.len() - 1
    }

    /// Half grey, both sides: what is not said to be anything else.
    fn grey(&mut self) -> MaterialId {
        if let Some(id) = self.grey {
            return id;
        }
        let base = self.push_material(Material::lambert(yugen_scene::Value::Number(0.5)));
        let id = self.push_material(Material::TwoSided { front: base, back: base });
        self.grey = Some(id);
        id
    }
}

/// `at` and one of `towards`, `direction`: a frame that looks there along +z.
fn aimed(keys: &mut Keys) -> Result<Mat4, Error> {
    let at = keys.need("at", "its place, [x, y, z]")?.vec3()?;
    let up = keys.or("up", Vec3::Y, Item::direction)?;
    let direction = match (keys.get("towards"), keys.get("direction")) {
        (Some(item), None) => {
            let way = item.vec3()? - at;
            way.try_normalize().ok_or_else(|| item.invalid("'towards' is where the light itself stands"))?
        }
        (None, Some(item)) => item.direction()?,
        _ => {
            return Err(
                keys.invalid(format!("{} needs one of 'towards' (a place) and 'direction'", keys.what))
            );
        }
    };
    Ok(look_along(at, direction, up))
}

/// `rotate = [x, y, z]`: degrees about the three axes, x first.
fn rotation(keys: &mut Keys) -> Result<Quat, Error> {
    let degrees = keys.or("rotate", Vec3::ZERO, Item::vec3)?;
    let [x, y, z] = degrees.to_array().map(f32::to_radians);
    Ok(Quat::from_euler(EulerRot::ZYX, z, y, x))
}

/// Where a shape stands: `matrix`, or `scale`, then `rotate` or `facing`, then `at`.
fn placed(keys: &mut Keys) -> Result<Mat4, Error> {
    let scale = keys
        .or("scale", Vec3::ONE, |i| i.try_number().map_or_else(|| i.vec3(), |v| Ok(Vec3::splat(v as f32))))?;
    let mut turn = rotation(keys)?;
    if let Some(facing) = keys.get("facing") {
        if turn != Quat::IDENTITY {
            return Err(facing.invalid("give one of 'facing' and 'rotate'"));
        }
        turn = Quat::from_rotation_arc(Vec3::Z, facing.direction()?);
    }
    let at = keys.or("at", Vec3::ZERO, Item::vec3)?;
    let own = Mat4::from_scale_rotation_translation(scale, turn, at);
    let matrix = match keys.get("matrix") {
        Some(item) => {
            let rows = item.array()?;
            let rows = rows.iter().map(Item::numbers::<4>).collect::<Result<Vec<_>, _>>()?;
            let Ok(rows) = <[[f32; 4]; 4]>::try_from(rows) else {
                return Err(item.wrong("four rows of four numbers"));
            };
            if rows[3] != [0.0, 0.0, 0.0, 1.0] {
                return Err(item.wrong("a last row of [0, 0, 0, 1]"));
            }
            own * Mat4::from_cols_array_2d(&rows).transpose()
        }
        None => own,
    };
    let size = matrix.determinant();
    if !matrix.is_finite() || size == 0.0 || !size.is_finite() {
        return Err(keys.invalid(format!(
            "{} is squeezed flat or larger than numbers can be; check 'scale'",
            keys.what
        )));
    }
    Ok(matrix)
}
