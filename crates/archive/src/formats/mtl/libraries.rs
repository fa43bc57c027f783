//! From the libraries of an OBJ file to materials of a scene.

use super::{FEATURES, Map, Mtl, OPTIONS, read};
use crate::formats::folders::Folders;
use crate::formats::support::{Support, find};
use crate::formats::{image, read_file};
use crate::{Error, Place, list_folder};
use glam::Vec3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::Kind;
use yugen_scene::nearest;
use yugen_scene::{
    Material, MaterialId, ModelBuilder, Scene, Texture, TextureFilter, TextureId, Value, Wrap,
};

/// A material in the scene.
#[derive(Clone, Debug)]
pub(crate) struct Finish {
    pub(crate) id: MaterialId,
    /// What its surfaces emit, on both sides.
    pub(crate) emission: Option<Value>,
}

/// The libraries of one OBJ file, of which materials come into a scene when they are first asked for.
pub(crate) struct Libraries {
    obj: PathBuf,
    folders: Folders,
    /// With the file of each.
    materials: Vec<(Mtl, PathBuf)>,
    finished: HashMap<String, Option<Finish>>,
    /// By file and whether raw.
    images: HashMap<(PathBuf, bool), Arc<Image>>,
    /// What has been said already.
    said: HashSet<String>,
}

impl Libraries {
    /// Reads what the `mtllib` statements of an OBJ file name; what is missing is said.
    pub(crate) fn open(lines: &[String], obj: &Path, folders: &Folders) -> Result<Self, Error> {
        let mut libraries = Self {
            obj: obj.to_path_buf(),
            folders: folders.inside(obj),
            materials: Vec::new(),
            finished: HashMap::new(),
            images: HashMap::new(),
            said: HashSet::new(),
        };
        let mut opened: Vec<PathBuf> = Vec::new();
        for line in lines {
            // A name with blanks, or several names.
            let whole = locate(&libraries.folders, line, obj);
            let found = match whole {
                Ok(file) => vec![Ok(file)],
                Err(_) => names(line).iter().map(|name| locate(&libraries.folders, name, obj)).collect(),
            };
            for file in found {
                match file {
                    Ok(file) if opened.contains(&file) => {}
                    Ok(file) => {
                        let materials = read(&read_file(&file)?, &file);
                        say_omissions(&materials, &file);
                        libraries.materials.extend(materials.into_iter().map(|m| (m, file.clone())));
                        opened.push(file);
                    }
                    Err(problem) => tracing::warn!("{problem}; its materials are grey"),
                }
            }
        }
        Ok(libraries)
    }

    /// The material called `name`; `None`, said once, where no library has it.
    pub(crate) fn material(&mut self, name: &str, scene: &mut Scene) -> Result<Option<Finish>, Error> {
        if let Some(finish) = self.finished.get(name) {
            return Ok(finish.clone());
        }
        let called = |name: &str| self.materials.iter().find(|(m, _)| m.name == name);
        let found = called(name).or_else(|| called(name.split_once(" #")?.0.trim())).cloned();
        let finish = match found {
            Some((mtl, file)) => {
                let finish = self.finish(&mtl, &file, scene)?;
                scene.name_material(finish.id, &mtl.name);
                Some(finish)
            }
            None => {
                let near = nearest(name, self.materials.iter().map(|(m, _)| m.name.as_str()));
                let hint = near.map_or(String::new(), |n| format!("; did you mean '{n}'?"));
                // Where there are no libraries at all, that has been said.
                if !self.materials.is_empty() {
                    let obj = self.obj.display();
                    tracing::warn!("{obj}: no library defines the material '{name}', it is grey{hint}");
                }
                None
            }
        };
        self.finished.insert(name.to_string(), finish.clone());
        Ok(finish)
    }

    fn say(&mut self, what: String) {
        if self.said.insert(what.clone()) {
            tracing::warn!("{what}");
        }
    }

    fn finish(&mut self, mtl: &Mtl, file: &Path, scene: &mut Scene) -> Result<Finish, Error> {
        let failed = |e| Error::model(Place::file(file), e);
        let space = ColourSpace::LinearSrgb.matrix_to(scene.working_space);
        let colour = |keyword: &str| mtl.colour(keyword).map(|c| (space * c).max(Vec3::ZERO));
        for keyword in ["Kd", "Ks", "Ke", "Tf"] {
            if let (Some(rest), None) = (mtl.rest(keyword), mtl.colour(keyword)) {
                self.say(format!(
                    "{}: '{keyword} {rest}' of material '{}' is not read; expected one number or three",
                    file.display(),
                    mtl.name
                ));
            }
        }
        let diffuse = match self.picture(mtl, file, "map_Kd", false, scene)? {
            Some((texture, _)) => self.times(texture, colour("Kd"), "Kd", mtl, file, scene),
            None => Value::Rgb(colour("Kd").unwrap_or(Vec3::splat(0.5)).min(Vec3::ONE)),
        };
        let emission = match self.picture(mtl, file, "map_Ke", false, scene)? {
            Some((texture, _)) => Some(self.times(texture, colour("Ke"), "Ke", mtl, file, scene)),
            None => colour("Ke").filter(|c| *c != Vec3::ZERO).map(Value::Rgb),
        };
        let holes = self.picture(mtl, file, "map_d", true, scene)?;
        let holes = holes.map(|(texture, map)| opacity_of(texture, &map, scene));
        let bumps = self.picture(mtl, file, "map_bump", true, scene)?;
        let bumps = match bumps {
            Some(found) => Some(found),
            None => self.picture(mtl, file, "bump", true, scene)?,
        };
        let normals = self.picture(mtl, file, "norm", true, scene)?;

        let illum = mtl.number("illum").map_or(2, |v| v as i32);
        let ior = mtl.number("Ni").unwrap_or(1.0);
        let clear = colour("Tf").unwrap_or(Vec3::ONE).min(Vec3::ONE);
        // Many programs write such a model for everything, with an index of one.
        let glass = matches!(illum, 4 | 6 | 7) && ior > 1.0 && clear != Vec3::ZERO;
        const PHYSICAL: [&str; 11] =
            ["Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "map_Pr", "map_Pm", "map_Ps", "map_RMA", "map_ORM"];
        let mut id = if glass {
            let kind = if illum == 4 { Kind::ThinDielectric } else { Kind::Dielectric };
            let mut model = ModelBuilder::new(kind);
            let (_, range) = kind.param("int_ior").map_err(failed)?;
            model.set("int_ior", Value::Number(ior.clamp(range.min, range.max))).map_err(failed)?;
            model.set("ext_ior", Value::Number(1.0)).map_err(failed)?;
            model.set("specular_transmittance", Value::Rgb(clear)).map_err(failed)?;
            push(scene, model.build().map_err(failed)?)
        } else if mtl.has(&PHYSICAL) {
            self.physical(mtl, file, diffuse, ior, scene)?
        } else {
            self.glossy(mtl, file, diffuse, if illum < 2 { None } else { colour("Ks") }, scene)?
        };
        if let Some((texture, map)) = normals {
            id = push(
                scene,
                Material::NormalMap { texture, scale: map.bump, turned: Default::default(), base: id },
            );
        }
        if let Some((texture, map)) = bumps {
            let material = if is_normal_map(&scene.textures[texture]) {
                self.say(format!(
                    "{}: the picture '{}' has the colours of normals and is read as 'norm'",
                    file.display(),
                    map.file
                ));
                Material::NormalMap { texture, scale: map.bump, turned: Default::default(), base: id }
            } else {
                Material::BumpMap { texture, scale: map.bump, turned: Default::default(), base: id }
            };
            id = push(scene, material);
        }
        if !glass {
            id = push(scene, Material::TwoSided { front: id, back: id });
        }
        let opacity = mtl.number("d").or(mtl.number("Tr").map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0);
        let opacity = match holes {
            Some(texture) if opacity < 1.0 => Value::Texture(scaled(texture, Vec3::splat(opacity), scene)),
            Some(texture) => Value::Texture(texture),
            None if glass => Value::Number(1.0),
            None => Value::Number(opacity),
        };
        if opacity != Value::Number(1.0) {
            id = push(scene, Material::Mask { opacity, base: id });
        }
        Ok(Finish { id, emission })
    }

    /// Kd and Ks.
    fn glossy(
        &mut self,
        mtl: &Mtl,
        file: &Path,
        diffuse: Value,
        specular: Option<Vec3>,
        scene: &mut Scene,
    ) -> Result<MaterialId, Error> {
        let failed = |e| Error::model(Place::file(file), e);
        let base = push(scene, Material::lambert(diffuse));
        let Some(specular) = specular.map(|c| c.min(Vec3::ONE)).filter(|c| *c != Vec3::ZERO) else {
            return Ok(base);
        };
        let kind = Kind::BlinnPhong;
        let mut lobe = ModelBuilder::new(kind);
        let share = specular.max_element();
        lobe.set("specular", Value::Rgb(specular / share)).map_err(failed)?;
        let (_, range) = kind.param("exponent").map_err(failed)?;
        let exponent = mtl.number("Ns").unwrap_or(range.default[0]).clamp(range.min, range.max);
        let exponent = match self.picture(mtl, file, "map_Ns", true, scene)? {
            Some((texture, _)) => Value::Texture(scaled(texture, Vec3::splat(exponent), scene)),
            None => Value::Number(exponent),
        };
        lobe.set("exponent", exponent).map_err(failed)?;
        let second = push(scene, lobe.build().map_err(failed)?);
        let weight = match self.picture(mtl, file, "map_Ks", false, scene)? {
            Some((texture, _)) => Value::Texture(scaled(texture, Vec3::splat(share), scene)),
            None => Value::Number(share),
        };
        Ok(push(scene, Material::Blend { weight, first: base, second }))
    }

    /// Pr, Pm and so on.
    fn physical(
        &mut self,
        mtl: &Mtl,
        file: &Path,
        diffuse: Value,
        ior: f32,
        scene: &mut Scene,
    ) -> Result<MaterialId, Error> {
        let failed = |e| Error::model(Place::file(file), e);
        let kind = Kind::MetallicRoughness;
        let mut model = ModelBuilder::new(kind);
        model.set("base_color", diffuse).map_err(failed)?;
        // The exponent that stands for the same width, Walter et al. 2007: alpha² = 2 / (n + 2).
        let of_exponent = |n: f32| (2.0 / (n.max(0.0) + 2.0)).powf(0.25);
        let roughness = mtl.number("Pr").or(mtl.number("Ns").map(of_exponent)).unwrap_or(0.5);
        let packed = [("map_ORM", [1, 2]), ("map_RMA", [0, 1])].into_iter().find(|(k, _)| mtl.has(&[k]));
        // Of a packed picture the factors are what is given, or one.
        let default = if packed.is_some() { 1.0 } else { 0.0 };
        let values = [
            (
                "roughness",
                "map_Pr",
                if packed.is_some() { mtl.number("Pr").unwrap_or(1.0) } else { roughness },
                Some(0),
            ),
            ("metallic", "map_Pm", mtl.number("Pm").unwrap_or(default), Some(1)),
            ("clearcoat", "map_Pc", mtl.number("Pc").unwrap_or(0.0), None),
            ("clearcoat_roughness", "map_Pcr", mtl.number("Pcr").unwrap_or(0.0), None),
            ("anisotropy", "", mtl.number("aniso").unwrap_or(0.0), None),
            (
                "anisotropy_rotation",
                "",
                std::f32::consts::TAU * mtl.number("anisor").unwrap_or(0.0).rem_euclid(1.0),
                None,
            ),
            ("sheen_color", "map_Ps", mtl.number("Ps").unwrap_or(0.0), None),
            ("ior", "", if ior > 1.0 { ior } else { 1.5 }, None),
        ];
        for (name, keyword, factor, part) in values {
            let (_, range) = kind.param(name).map_err(failed)?;
            let factor = factor.clamp(range.min, range.max);
            let mut found = self.picture(mtl, file, keyword, true, scene)?.map(|(texture, _)| texture);
            if let (None, Some((keyword, channels)), Some(part)) = (found, packed, part)
                && let Some((texture, _)) = self.picture(mtl, file, keyword, true, scene)?
            {
                if let Texture::Image { image, channel, .. } = &mut scene.textures[texture] {
                    *channel = image.channel(["R", "G", "B"][channels[part]]);
                }
                found = Some(texture);
            }
            let value = match found {
                // A factor of zero beside a picture is a default that was written down.
                Some(texture) if factor == 0.0 => Value::Texture(texture),
                Some(texture) => Value::Texture(scaled(texture, Vec3::splat(factor), scene)),
                None if name == "sheen_color" => Value::Rgb(Vec3::splat(factor)),
                None => Value::Number(factor),
            };
            model.set(name, value).map_err(failed)?;
        }
        Ok(push(scene, model.build().map_err(failed)?))
    }

    /// A picture times its factor. Exporters write black for the factor where only the picture is meant.
    fn times(
        &mut self,
        texture: TextureId,
        factor: Option<Vec3>,
        keyword: &str,
        mtl: &Mtl,
        file: &Path,
        scene: &mut Scene,
    ) -> Value {
        let factor = match factor {
            Some(black) if black == Vec3::ZERO => {
                self.say(format!(
                    "{}: {keyword} of material '{}' is black, which would hide the picture map_{keyword}; the picture \
                     is shown as it is",
                    file.display(),
                    mtl.name
                ));
                Vec3::ONE
            }
            factor => factor.unwrap_or(Vec3::ONE),
        };
        Value::Texture(scaled(texture, factor, scene))
    }

    /// The picture that a statement names, if it can be found; else that is said.
    fn picture(
        &mut self,
        mtl: &Mtl,
        file: &Path,
        keyword: &str,
        raw: bool,
        scene: &mut Scene,
    ) -> Result<Option<(TextureId, Map)>, Error> {
        if !mtl.has(&[keyword]) {
            return Ok(None);
        }
        let Some(map) = mtl.map(keyword) else {
            self.say(format!("{}: '{keyword}' of material '{}' names no picture", file.display(), mtl.name));
            return Ok(None);
        };
        for option in &map.ignored {
            let why = match find(OPTIONS, option).map(|o| o.support) {
                Some(Support::No(why)) => why,
                _ => continue,
            };
            self.say(format!("{}: the option {option} of pictures is skipped: {why}", file.display()));
        }
        let path = match locate(&self.folders.inside(file), &map.file, file) {
            Ok(path) => path,
            Err(problem) => {
                self.say(format!("{problem}; '{keyword}' of material '{}' is skipped", mtl.name));
                return Ok(None);
            }
        };
        let mut image = match self.images.get(&(path.clone(), raw)) {
            Some(image) => image.clone(),
            None => {
                let options = image::ReadOptions { raw, ..image::ReadOptions::to(scene.working_space) };
                let mut image = image::read_layer(&path, None, &options)?;
                if !raw {
                    image::clamp_negative(&mut image, &path);
                }
                let image = Arc::new(image);
                self.images.insert((path.clone(), raw), image.clone());
                image
            }
        };
        if map.range != [0.0, 1.0] {
            let alpha = image.channel("A");
            let mut changed = (*image).clone();
            let channels = changed.channels.len();
            for (i, v) in changed.data.iter_mut().enumerate() {
                if Some(i % channels) != alpha {
                    *v = map.range[0] + map.range[1] * *v;
                }
            }
            image = Arc::new(changed);
        }
        let channel = match map.channel {
            Some(letter @ ('r' | 'g' | 'b' | 'm' | 'z')) => {
                let name =
                    if letter == 'm' { "A".to_string() } else { letter.to_ascii_uppercase().to_string() };
                let channel = image.channel(&name);
                if channel.is_none() {
                    self.say(format!(
                        "{}: '-imfchan {letter}' asks for the channel {name} of '{}', which has {}; it is skipped",
                        file.display(),
                        map.file,
                        image.channels.join(", ")
                    ));
                }
                channel
            }
            _ => None,
        };
        scene.textures.push(Texture::Image {
            image,
            filter: TextureFilter::default(),
            wrap: [if map.clamp { Wrap::Clamp } else { Wrap::default() }; 2],
            to_uv: map.to_uv(),
            channel,
        });
        Ok(Some((scene.textures.len() - 1, map)))
    }
}

fn push(scene: &mut Scene, material: Material) -> MaterialId {
    scene.materials.push(material);
    scene.materials.len() - 1
}

fn scaled(texture: TextureId, factor: Vec3, scene: &mut Scene) -> TextureId {
    if factor == Vec3::ONE {
        return texture;
    }
    scene.textures.push(Texture::Scaled { texture, factor });
    scene.textures.len() - 1
}

/// A picture of holes: its alpha where that says something, else its brightness.
fn opacity_of(texture: TextureId, map: &Map, scene: &mut Scene) -> TextureId {
    if let Texture::Image { image, channel, .. } = &mut scene.textures[texture]
        && map.channel.is_none()
        && let Some(alpha) = image.channel("A")
        && image.data.iter().skip(alpha).step_by(image.channels.len()).any(|a| *a < 1.0)
    {
        *channel = Some(alpha);
    }
    texture
}

/// Whether a picture, meant for heights, shows normals: bluish everywhere and grey nowhere.
fn is_normal_map(texture: &Texture) -> bool {
    let Texture::Image { image, channel: None, .. } = texture else { return false };
    let Some(rgb) = image.select(&["R", "G", "B"]) else { return false };
    let n = (rgb.width * rgb.height) as f64;
    let mean: [f64; 3] =
        std::array::from_fn(|c| rgb.data.iter().skip(c).step_by(3).map(|v| f64::from(*v)).sum::<f64>() / n);
    // Upright normals are (0.5, 0.5, 1).
    (0.35..0.65).contains(&mean[0]) && (0.35..0.65).contains(&mean[1]) && mean[2] > 0.75
}

/// The names of libraries in one statement: quoted, or up to a word that ends as such names do.
fn names(line: &str) -> Vec<String> {
    if line.contains('"') {
        return line.split('"').map(str::trim).filter(|n| !n.is_empty()).map(String::from).collect();
    }
    let mut names = Vec::new();
    let mut name = String::new();
    for word in line.split_whitespace() {
        if word.starts_with('#') {
            break;
        }
        if !name.is_empty() {
            name.push(' ');
        }
        name.push_str(word);
        if word.to_ascii_lowercase().ends_with(".mtl") {
            names.push(std::mem::take(&mut name));
        }
    }
    if !name.is_empty() {
        names.push(name);
    }
    names
}

/// The file that `user` calls `name`: in its place, else one of this name beside `user`, as the places of other people's
/// disks are of no use here, else one that differs only in case.
fn locate(folders: &Folders, name: &str, user: &Path) -> Result<PathBuf, Error> {
    let name = name.trim().trim_matches('"').replace('\\', "/");
    let found = folders.find(&name, Place::file(user));
    let base = name.rsplit('/').next().unwrap_or(&name);
    if found.is_ok() || base.is_empty() {
        return found;
    }
    if base != name
        && let Ok(file) = folders.find(base, Place::file(user))
    {
        return Ok(file);
    }
    let Err(problem) = found else { return found };
    let folder = user.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beside: Vec<String> = list_folder(folder)
        .unwrap_or_default()
        .iter()
        .filter_map(|p| p.file_name()?.to_str().map(String::from))
        .collect();
    let mut alike = beside.iter().filter(|n| n.to_lowercase() == base.to_lowercase());
    if let (Some(one), None) = (alike.next(), alike.next()) {
        return folders.find(one, Place::file(user));
    }
    Err(match nearest(base, beside.iter().map(String::as_str)) {
        Some(near) => {
            Error::invalid(Place::file(user), format!("there is no file '{name}'; did you mean '{near}'?"))
        }
        None => problem,
    })
}

/// Says once for each statement of a library that is not read why, and how often it was found.
fn say_omissions(materials: &[Mtl], file: &Path) {
    let mut words: Vec<(String, usize)> = Vec::new();
    for (keyword, _) in materials.iter().flat_map(|m| &m.statements) {
        match words.iter().position(|w| w.0.eq_ignore_ascii_case(keyword)) {
            Some(i) => words[i].1 += 1,
            // A file that is no library at all has many words.
            None if words.len() < 64 => words.push((keyword.clone(), 1)),
            None => {}
        }
    }
    let file = file.display();
    for (word, count) in words {
        let times = if count == 1 { String::new() } else { format!(" ({count} times)") };
        let word: String = word.chars().take(40).collect();
        match FEATURES.iter().find(|f| f.name.eq_ignore_ascii_case(&word)).map(|f| f.support) {
            Some(Support::Yes | Support::Partly(_)) => {}
            Some(Support::No(why)) => tracing::warn!("{file}: '{word}' is skipped{times}: {why}"),
            None => match nearest(&word, FEATURES.iter().map(|f| f.name)) {
                Some(near) => tracing::warn!(
                    "{file}: unknown MTL statement '{word}' is skipped{times}; did you mean '{near}'?"
                ),
                None => tracing::warn!("{file}: unknown MTL statement '{word}' is skipped{times}"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_libraries_in_one_statement() {
        assert_eq!(names("a.mtl b c.MTL d # and so on"), ["a.mtl", "b c.MTL", "d"]);
        assert_eq!(names("\"my own.mtl\" \"b.mtl\""), ["my own.mtl", "b.mtl"]);
    }
}
