//! Materials of Wavefront OBJ files. Alias|Wavefront 1995, "Material Library", with the statements for physically based
//! materials that Blender and others write.
//!
//! A Lambertian `Kd` and a normalised Blinn-Phong lobe `Ks` of exponent `Ns` share what arrives: the lobe takes the
//! largest channel of `Ks`, the rest is left to `Kd`, so that no surface returns more than it gets. Where `Pr`, `Pm`
//! and their like are given, the material is glTF's instead. `illum` 4 with an index `Ni` above one is a sheet of glass,
//! 6 and 7 are solid glass. Both sides look alike, because the format says nothing about sides. Colours are linear
//! sRGB, pictures sRGB-encoded.

use super::folders::Folders;
use super::numbers::{Scanner, text};
use super::support::{Feature, Support, find};
use super::{image, read_file};
use crate::scene::{
    Material, MaterialId, ModelBuilder, Scene, Texture, TextureFilter, TextureId, Value, Wrap,
};
use crate::{Error, Place, list_folder, nearest};
use glam::{Affine2, Mat2, Vec2, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::Kind;

const AMBIENT: &str = "no constant is added for light from everywhere: that light is followed";

/// The statements of a material.
pub const FEATURES: &[Feature] = &[
    Feature::yes("newmtl"),
    Feature::partly("Ka", AMBIENT),
    Feature::partly("Kd", "three numbers, one or `xyz`; no spectral curves (.rfl)"),
    Feature::partly(
        "Ks",
        "likewise; what it takes is missing from Kd; not for glass, `illum` 0 and 1, nor beside Pr or Pm",
    ),
    Feature::yes("Ke"),
    Feature::partly("Ns", "up to 1000; glass is smooth"),
    Feature::partly("Ni", "for glass and beside Pr or Pm"),
    Feature::partly("d", "with -halo the same from all sides; not for glass"),
    Feature::yes("Tr"),
    Feature::partly("Tf", "for glass"),
    Feature::partly(
        "illum",
        "0 and 1 are matt; 4 is a sheet of glass, 6 and 7 solid glass, where Ni is above 1; all others are as 2",
    ),
    Feature::partly("map_Ka", AMBIENT),
    Feature::yes("map_Kd"),
    Feature::partly("map_Ks", "its brightness; the hue is that of Ks"),
    Feature::yes("map_Ke"),
    Feature::yes("map_Ns"),
    Feature::yes("map_d"),
    Feature::partly("map_bump", "a picture in the colours of normals is read as `norm`"),
    Feature::partly("bump", "a picture in the colours of normals is read as `norm`"),
    Feature::yes("norm"),
    Feature::yes("Pr"),
    Feature::yes("Pm"),
    Feature::partly("Ps", "white sheen"),
    Feature::yes("Pc"),
    Feature::yes("Pcr"),
    Feature::yes("aniso"),
    Feature::yes("anisor"),
    Feature::yes("map_Pr"),
    Feature::yes("map_Pm"),
    Feature::partly("map_Ps", "white sheen"),
    Feature::yes("map_Pc"),
    Feature::yes("map_Pcr"),
    Feature::partly("map_RMA", "R is roughness, G metal; occlusion is followed, not read"),
    Feature::partly("map_ORM", "G is roughness, B metal; occlusion is followed, not read"),
    Feature::no("map_Tf", "glass has one colour"),
    Feature::no("disp", "surfaces are not displaced; the slope alone can be had with 'bump'"),
    Feature::no("map_disp", "surfaces are not displaced; the slope alone can be had with 'bump'"),
    Feature::no("decal", "pictures are not laid over each other; bake them into map_Kd"),
    Feature::no("refl", "reflections are followed, not read from a picture"),
    Feature::no("sharpness", "reflections are followed, not read from a picture"),
    Feature::no("map_aat", "an instruction for other renderers"),
];

/// The options of a picture, and how many words each takes at most.
pub const OPTIONS: &[Feature] = &[
    Feature::yes("-s"),
    Feature::yes("-o"),
    Feature::no("-t", "pictures are not stirred by turbulence"),
    Feature::partly("-clamp", "beyond its rim the picture goes on as its border does"),
    Feature::yes("-bm"),
    Feature::yes("-mm"),
    Feature::yes("-imfchan"),
    Feature::partly("-blendu", "pictures are always interpolated"),
    Feature::partly("-blendv", "pictures are always interpolated"),
    Feature::partly("-texres", "pictures are used in their own size"),
    Feature::no("-boost", "pictures are not sharpened"),
    Feature::no("-cc", "colours are as in the picture"),
    Feature::no("-type", "reflections are followed, not read from a picture"),
];

/// How many words follow an option: at most, and whether they have to be numbers.
fn words_of(option: &str) -> (usize, bool) {
    match option {
        "-s" | "-o" | "-t" => (3, true),
        "-mm" => (2, true),
        "-bm" | "-texres" | "-boost" => (1, true),
        _ => (1, false),
    }
}

/// A material of a library, as written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mtl {
    /// What stands after `newmtl`.
    pub name: String,
    /// Statements in order: keyword, and the rest of the line.
    pub statements: Vec<(String, String)>,
}

impl Mtl {
    /// One or three numbers after a keyword (`Ns`, `Kd`, …), or three after `xyz`; one number stands for grey. The last
    /// statement counts. Colours are linear sRGB.
    pub fn colour(&self, keyword: &str) -> Option<Vec3> {
        let rest = self.rest(keyword)?;
        let (numbers, xyz) = match rest.strip_prefix("xyz") {
            Some(numbers) => (numbers, true),
            None => (rest, false),
        };
        let v: Vec<f32> = numbers.split_whitespace().map_while(|w| w.parse().ok()).collect();
        let c = match v[..] {
            [x] | [x, _] => Vec3::splat(x),
            [x, y, z, ..] => Vec3::new(x, y, z),
            [] => return None,
        };
        let c = if xyz { (ColourSpace::LinearSrgb.to_xyz().inverse() * c.as_dvec3()).as_vec3() } else { c };
        c.is_finite().then_some(c)
    }

    /// The first number after a keyword, past the words that are none, such as `-halo`.
    fn number(&self, keyword: &str) -> Option<f32> {
        self.rest(keyword)?.split_whitespace().find_map(|w| w.parse().ok()).filter(|v: &f32| v.is_finite())
    }

    /// The picture named after a keyword (`map_Kd`, `bump`, …) with its options.
    pub fn map(&self, keyword: &str) -> Option<Map> {
        Map::parse(self.rest(keyword)?)
    }

    fn has(&self, keywords: &[&str]) -> bool {
        keywords.iter().any(|k| self.rest(k).is_some())
    }

    fn rest(&self, keyword: &str) -> Option<&str> {
        self.statements.iter().rev().find(|(k, _)| k.eq_ignore_ascii_case(keyword)).map(|(_, r)| r.as_str())
    }
}

/// A picture as a material names it.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The file; may have blanks.
    pub file: String,
    /// `-s`: how often the picture fits into a unit of (u, v).
    pub scale: Vec2,
    /// `-o`: added to (u, v), of which v runs up.
    pub offset: Vec2,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-bm`: a factor on the height.
    pub bump: f32,
    /// `-mm`: the value of black and the distance from there to white.
    pub range: [f32; 2],
    /// `-imfchan`: r, g, b, m (alpha), l (luminance) or z.
    pub channel: Option<char>,
    /// Options that are not followed, and words that look like options.
    pub ignored: Vec<String>,
}

impl Map {
    /// `None` where no file is named.
    fn parse(text: &str) -> Option<Self> {
        let mut map = Self {
            file: String::new(),
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            clamp: false,
            bump: 1.0,
            range: [0.0, 1.0],
            channel: None,
            ignored: Vec::new(),
        };
        // Words with their places: a name may have blanks, and may stand before the options.
        let words: Vec<(usize, &str)> =
            text.split_whitespace().map(|w| (w.as_ptr() as usize - text.as_ptr() as usize, w)).collect();
        let mut name: Option<(usize, usize)> = None;
        let mut i = 0;
        while let Some(&(start, word)) = words.get(i) {
            i += 1;
            let lower = word.to_ascii_lowercase();
            let Some(option) = find(OPTIONS, &lower) else {
                let begin = name.map_or(start, |n| n.0);
                name = Some((begin, start + word.len()));
                continue;
            };
            let (most, numbers) = words_of(&lower);
            let mut values = Vec::new();
            let first = i;
            while i < words.len() && i - first < most {
                match words[i].1.parse::<f32>().ok().filter(|v| v.is_finite()) {
                    Some(v) => values.push(v),
                    None if numbers => break,
                    None => {}
                }
                i += 1;
            }
            let said = words.get(first).map_or("", |w| w.1).to_ascii_lowercase();
            let pair =
                |old: Vec2| Vec2::new(*values.first().unwrap_or(&old.x), *values.get(1).unwrap_or(&old.y));
            match (option.name, &values[..]) {
                ("-s", _) => map.scale = pair(map.scale),
                ("-o", _) => map.offset = pair(map.offset),
                ("-clamp", _) => map.clamp = said == "on",
                ("-bm", [v, ..]) => map.bump = *v,
                ("-mm", [base, gain]) => map.range = [*base, *gain],
                ("-imfchan", _) => map.channel = said.chars().next(),
                _ => {}
            }
            if let Support::No(_) = option.support {
                map.ignored.push(option.name.to_string());
            }
        }
        let (start, end) = name?;
        map.file = text[start..end].trim_matches('"').to_string();
        Some(map)
    }

    /// From the (u, v) of a mesh, of which v runs down.
    fn to_uv(&self) -> Affine2 {
        let (s, o) = (self.scale, self.offset);
        Affine2::from_mat2_translation(Mat2::from_diagonal(s), Vec2::new(o.x, 1.0 - s.y - o.y))
    }
}

/// Reads a library; `path` names it in messages. Numbers are checked where they are asked for.
pub fn read(bytes: &[u8], path: &Path) -> Vec<Mtl> {
    let bytes = text(bytes);
    let mut s = Scanner::new(&bytes, path);
    let mut materials: Vec<Mtl> = Vec::new();
    let mut stray = 0;
    loop {
        s.space();
        if s.at_end() {
            break;
        }
        let keyword = String::from_utf8_lossy(s.word()).into_owned();
        let line = String::from_utf8_lossy(s.next_line()).into_owned();
        if keyword.starts_with('#') {
            continue;
        }
        if keyword.eq_ignore_ascii_case("newmtl") {
            materials.push(Mtl { name: line, statements: Vec::new() });
            continue;
        }
        // A comment after a blank; names of materials may have such a sign.
        let rest = line.split_once(" #").map_or(&*line, |l| l.0).trim().to_string();
        match materials.last_mut() {
            Some(last) => last.statements.push((keyword, rest)),
            None => stray += 1,
        }
    }
    if stray > 0 {
        tracing::warn!(
            "{}: statements before the first 'newmtl' belong to no material and are skipped: {stray}",
            path.display()
        );
    }
    materials
}

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
        let mut read: Vec<PathBuf> = Vec::new();
        for line in lines {
            // A name with blanks, or several names.
            let whole = locate(&libraries.folders, line, obj);
            let found = match whole {
                Ok(file) => vec![Ok(file)],
                Err(_) => names(line).iter().map(|name| locate(&libraries.folders, name, obj)).collect(),
            };
            for file in found {
                match file {
                    Ok(file) if read.contains(&file) => {}
                    Ok(file) => {
                        let materials = self::read(&read_file(&file)?, &file);
                        say_omissions(&materials, &file);
                        libraries.materials.extend(materials.into_iter().map(|m| (m, file.clone())));
                        read.push(file);
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
            Some((mtl, file)) => Some(self.finish(&mtl, &file, scene)?),
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
            wrap: if map.clamp { Wrap::Clamp } else { Wrap::default() },
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
    fn a_library_of_materials() {
        let text = "\u{feff}Kd 3\n# x\nnewmtl red\nKd 1 0 0.5\nNs 20 # sharp\nmap_Kd -bm 1 wood.png\nd -halo 0.25\n\
                    newmtl b\nKd xyz 0.9505 1 1.089\nKs spectral glass.rfl";
        let m = read(text.as_bytes(), Path::new("a.mtl"));
        assert_eq!(m.len(), 2);
        assert_eq!(m[0].colour("kd"), Some(Vec3::new(1.0, 0.0, 0.5)));
        assert_eq!(m[0].colour("Ns"), Some(Vec3::splat(20.0)));
        assert_eq!(m[0].map("map_Kd").unwrap().file, "wood.png");
        assert_eq!(m[0].number("d"), Some(0.25));
        assert!((m[1].colour("Kd").unwrap() - Vec3::ONE).abs().max_element() < 1e-3);
        assert_eq!((m[1].colour("Ks"), m[1].colour("Ka")), (None, None));
    }

    #[test]
    fn options_and_names_with_blanks() {
        let map = |text: &str| Map::parse(text);
        for text in [
            "half tex 01.png",
            "-clamp on half tex 01.png",
            "half tex 01.png -blendu off",
            "\"half tex 01.png\"",
            "-o 0.5 half tex 01.png",
            "-imfchan l -bm 2 -texres 512 half tex 01.png -cc on",
            "-t 1 1 1 half tex 01.png",
        ] {
            assert_eq!(map(text).unwrap().file, "half tex 01.png", "{text}");
        }
        assert_eq!(map("half  tex.png").unwrap().file, "half  tex.png");
        let m = map("-S 2 3 1 -o 0.5 0.25 -mm 0.1 0.8 -clamp on -bm -0.5 -imfchan m a-s.png").unwrap();
        assert_eq!((m.scale, m.offset), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.25)));
        assert_eq!((m.range, m.clamp, m.bump, m.channel), ([0.1, 0.8], true, -0.5, Some('m')));
        assert!(m.ignored.is_empty() && map("-t 1 x.png").unwrap().ignored == ["-t"]);
        assert_eq!((map(""), map("-s 2 2 2")), (None, None));
        // Where v runs up, v' = 3 v + 0.25.
        assert!((m.to_uv().transform_point2(Vec2::new(0.5, 0.9)) - Vec2::new(1.5, 0.45)).length() < 1e-6);
        assert_eq!(m.to_uv().transform_point2(Vec2::new(0.5, 1.0)).y, 0.75);
    }

    #[test]
    fn several_libraries_in_one_statement() {
        assert_eq!(names("a.mtl b c.MTL d # and so on"), ["a.mtl", "b c.MTL", "d"]);
        assert_eq!(names("\"my own.mtl\" \"b.mtl\""), ["my own.mtl", "b.mtl"]);
    }
}
