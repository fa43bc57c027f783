//! Colours, textures and materials.

use super::document::{Item, Keys};
use super::{Named, Reader};
use crate::Error;
use crate::formats::{btf, image, measured};
use glam::{Affine2, Vec2, Vec3};
use std::sync::Arc;
use yugen_optics::colour::srgb_to_linear;
use yugen_optics::spectrum::{Spectrum, blackbody, emission_rgb, reflectance_rgb};
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::metals::{conductor_names, named_conductor};
use yugen_reflectance::microfacet::f_conductor;
use yugen_reflectance::{Choice, Data, Kind, ModelError, ParamType};
use yugen_scene::{
    Material, MaterialId, ModelBuilder, Texture, TextureFilter, TextureId, TurnedNormals, Value, Wrap,
};

/// Words for metals that people use, and the names of the published measurements.
const METALS: [(&str, &str); 7] = [
    ("gold", "Au"),
    ("silver", "Ag"),
    ("copper", "Cu"),
    ("aluminium", "Al"),
    ("chromium", "Cr"),
    ("tungsten", "W"),
    ("mercury", "Hg"),
];

const WRAPS: [(&str, Wrap); 3] = [("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror), ("clamp", Wrap::Clamp)];

/// What a value is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// A colour of a surface.
    Surface,
    /// Light.
    Light,
    /// A number, or numbers that are no colours: pictures are read raw.
    Number,
}

impl<'a> Reader<'a> {
    /// The colour under `key`, or white.
    pub(super) fn light_colour(&mut self, keys: &mut Keys<'a>, key: &'static str) -> Result<Vec3, Error> {
        let Some(item) = keys.get(key) else { return Ok(Vec3::ONE) };
        match self.value(&item, Role::Light)? {
            Value::Number(v) => Ok(Vec3::splat(v)),
            Value::Rgb(c) => Ok(c),
            Value::Texture(_) => Err(item.wrong("a colour")),
        }
    }

    /// A number, a colour or a texture in any of their forms.
    pub(super) fn value(&mut self, item: &Item<'a>, role: Role) -> Result<Value, Error> {
        const EXPECTED: &str =
            "a number, a colour ([r, g, b], \"#rrggbb\", { blackbody = kelvin }, …) or a texture";
        let dark = |item: &Item, least: f32| {
            let problem = format!("light cannot be negative, found {least}; give 0 or more");
            if role == Role::Light && least < 0.0 { Err(item.invalid(problem)) } else { Ok(()) }
        };
        if item.try_number().is_some() {
            let number = item.number()?;
            dark(item, number)?;
            return Ok(Value::Number(number));
        }
        if let Some(text) = item.try_text() {
            if let Some(hex) = text.strip_prefix('#') {
                let code = Some(hex)
                    .filter(|h| h.len() == 6 && h.is_ascii())
                    .and_then(|h| u32::from_str_radix(h, 16).ok());
                let code = code.ok_or_else(|| item.wrong("six hexadecimal digits after '#'"))?;
                let [_, r, g, b] = code.to_be_bytes().map(|v| srgb_to_linear(f32::from(v) / 255.0));
                return Ok(Value::Rgb(self.to_working(Vec3::new(r, g, b), ColourSpace::LinearSrgb)));
            }
            return self.texture(item, role == Role::Number).map(Value::Texture);
        }
        if item.try_array().is_some() {
            let triple = item.vec3()?;
            dark(item, triple.min_element())?;
            // Indices of refraction and the like are given per channel of the same space as colours.
            return Ok(Value::Rgb(self.to_working(triple, self.colours)));
        }
        let Some(mut keys) = item.try_keys("colour") else { return Err(item.wrong(EXPECTED)) };
        let (rgb, kelvin, metal) = (keys.get("rgb"), keys.get("blackbody"), keys.get("metal"));
        let wavelengths = keys.get("wavelengths");
        let forms = [&rgb, &kelvin, &metal, &wavelengths];
        match forms.into_iter().flatten().count() {
            0 => return self.texture(item, role == Role::Number).map(Value::Texture),
            1 => {}
            _ => return Err(item.invalid("a colour is given in one way, not in several")),
        }
        let space = self.scene.working_space;
        let colour = if let Some(rgb) = rgb {
            let spaces = ColourSpace::ALL.map(|s| (s.name(), s));
            let from = keys.or("space", self.colours, |i| i.one_of("colour space", &spaces))?;
            let triple = rgb.vec3()?;
            dark(&rgb, triple.min_element())?;
            self.to_working(triple, from)
        } else if let Some(kelvin) = kelvin {
            // Of luminance one, so that `scale` says how bright.
            let kelvin = f64::from(kelvin.number_in(500.0, 50_000.0)?);
            let peak = blackbody(2.897_771_955e6 / kelvin, kelvin);
            let rgb = emission_rgb(space, |l| blackbody(l, kelvin) / peak);
            rgb / space.luminance(rgb)
        } else if let Some(metal) = metal {
            let [eta, k] = self.metal(&metal)?;
            f_conductor(1.0, eta, k)
        } else if let Some(wavelengths) = wavelengths {
            let list = |i: &Item| {
                i.array()?.iter().map(|v| v.number().map(f64::from)).collect::<Result<Vec<_>, _>>()
            };
            let values = keys.need("values", "one number per wavelength")?;
            let numbers = list(&values)?;
            dark(&values, numbers.iter().fold(0.0, |a: f32, v| a.min(*v as f32)))?;
            let spectrum = Spectrum::new(list(&wavelengths)?, numbers)
                .map_err(|e| wavelengths.invalid(e.to_string()))?;
            match role {
                Role::Light => emission_rgb(space, |l| spectrum.at(l)),
                _ => reflectance_rgb(space, |l| spectrum.at(l)),
            }
        } else {
            return Err(item.wrong(EXPECTED));
        };
        let scale = keys.or("scale", 1.0, |i| i.number_in(0.0, 1e12))?;
        keys.finish()?;
        Ok(Value::Rgb(colour * scale))
    }

    fn to_working(&self, colour: Vec3, from: ColourSpace) -> Vec3 {
        from.matrix_to(self.scene.working_space) * colour
    }

    /// Index of refraction and extinction of a named metal.
    fn metal(&self, item: &Item) -> Result<[Vec3; 2], Error> {
        let name = item.text()?;
        let symbol = METALS.iter().find(|(word, _)| *word == name).map_or(name, |(_, symbol)| symbol);
        let (eta, k) = named_conductor(symbol).ok_or_else(|| {
            item.unknown("metal", name, METALS.iter().map(|m| m.0).chain(conductor_names()))
        })?;
        // They are spectra seen through the linear sRGB primaries, and so change space like colours.
        let to = |v| self.to_working(v, ColourSpace::LinearSrgb).max(Vec3::ZERO);
        Ok([to(eta), to(k)])
    }

    /// A texture: its name, or a table that describes it on the spot. `raw`: numbers rather than colours.
    pub(super) fn texture(&mut self, item: &Item<'a>, raw: bool) -> Result<TextureId, Error> {
        match item.try_text() {
            Some(name) => self.named_texture(name, Some(item)),
            None => self.describe_texture(item.clone(), raw),
        }
    }

    pub(super) fn named_texture(&mut self, name: &str, user: Option<&Item>) -> Result<TextureId, Error> {
        let written = match self.textures.get_mut(name) {
            Some(Named::Done(id)) => return Ok(*id),
            Some(named @ Named::Written(_)) => std::mem::replace(named, Named::Open),
            Some(Named::Open) => {
                let at = user.map_or_else(Default::default, Item::place);
                return Err(Error::invalid(at, format!("texture '{name}' contains itself")));
            }
            None => {
                let Some(user) = user else { return Ok(0) };
                return Err(user.unknown("texture", name, self.textures.keys().map(String::as_str)));
            }
        };
        let Named::Written(item) = written else { unreachable!("matched above") };
        let id = self.describe_texture(item, false)?;
        self.textures.insert(name.to_string(), Named::Done(id));
        Ok(id)
    }

    fn describe_texture(&mut self, item: Item<'a>, raw: bool) -> Result<TextureId, Error> {
        let mut keys = item.keys("texture")?;
        let (file, checker, attribute) = (keys.get("image"), keys.get("checker"), keys.get("attribute"));
        let texture = match (file, checker, attribute) {
            (Some(file), None, None) => {
                let raw = keys.or("raw", raw, Item::boolean)?;
                let (layer, channel) = (keys.get("layer"), keys.get("channel"));
                let mut image = self.image(&file, raw, layer.as_ref())?;
                // A channel may be called by its full name, the layer's before it.
                if let (None, Some(name)) = (&layer, &channel) {
                    let whole = self.whole_image(&file, raw)?;
                    if whole.channel(name.text()?).is_some() {
                        image = whole;
                    }
                }
                let filters = [
                    ("nearest", TextureFilter::Nearest),
                    ("bilinear", TextureFilter::Bilinear),
                    ("mip", TextureFilter::Mip),
                ];
                let filter = keys.or("filter", TextureFilter::default(), |i| i.one_of("filter", &filters))?;
                let wrap = keys.or("wrap", Wrap::default(), |i| i.one_of("wrap", &WRAPS))?;
                let channel = match channel {
                    Some(item) => {
                        let name = item.text()?;
                        let known = image.channels.iter().map(String::as_str);
                        Some(image.channel(name).ok_or_else(|| item.unknown("channel", name, known))?)
                    }
                    None => None,
                };
                let colour = ["R", "G", "B"].iter().all(|c| image.channel(c).is_some());
                if channel.is_none() && !colour && image.channels.len() > 1 && image.channels[0] != "Y" {
                    let problem = format!(
                        "the picture has the channels {}; say which with 'layer' or 'channel'",
                        image.channels.join(", ")
                    );
                    return Err(file.invalid(problem));
                }
                // Renderers look at four channels; one of those behind becomes a picture of its own.
                let (image, channel) = match channel.filter(|c| *c > 3) {
                    Some(c) => {
                        let name = image.channels[c].clone();
                        (image.select(&[&name]).map_or(image, Arc::new), None)
                    }
                    None => (image, channel),
                };
                Texture::Image { image, filter, wrap: [wrap; 2], to_uv: to_uv(&mut keys)?, channel }
            }
            (None, Some(checker), None) => {
                let values = checker.array()?;
                let [even, odd] = &values[..] else { return Err(checker.wrong("two values in brackets")) };
                let role = if raw { Role::Number } else { Role::Surface };
                let (even, odd) = (self.value(even, role)?, self.value(odd, role)?);
                Texture::Checkerboard { even, odd, to_uv: to_uv(&mut keys)? }
            }
            (None, None, Some(attribute)) => Texture::MeshAttribute { name: attribute.text()?.to_string() },
            _ => {
                return Err(keys.invalid("a texture needs one of 'image' (a file), 'checker' (two values) and 'attribute' (of a mesh)"));
            }
        };
        let factor = match keys.get("tint") {
            Some(item) => match self.value(&item, Role::Surface)? {
                Value::Number(v) => Some(Vec3::splat(v)),
                Value::Rgb(c) => Some(c),
                Value::Texture(_) => return Err(item.wrong("a number or a colour")),
            },
            None => None,
        };
        keys.finish()?;
        let id = self.push_texture(texture);
        Ok(match factor {
            Some(factor) => self.push_texture(Texture::Scaled { texture: id, factor }),
            None => id,
        })
    }

    /// The picture in the file that `item` names: the layer that is named, or the one that is meant.
    pub(super) fn image(
        &mut self,
        item: &Item<'a>,
        raw: bool,
        layer: Option<&Item<'a>>,
    ) -> Result<Arc<Image>, Error> {
        let whole = self.whole_image(item, raw)?;
        let name = match layer {
            Some(layer) => layer.text()?,
            None => match image::default_layer(&whole) {
                Some(name) => name,
                None => return Ok(whole),
            },
        };
        let key = (self.folders.find(item.text()?, item.place())?, raw, name.to_string());
        if let Some(image) = self.layers.get(&key) {
            return Ok(image.clone());
        }
        let picked = image::layer(&whole, name)
            .ok_or_else(|| layer.unwrap_or(item).unknown("layer", name, image::layers(&whole)))?;
        let picked = Arc::new(picked);
        self.layers.insert(key, picked.clone());
        Ok(picked)
    }

    /// All channels of the picture in the file that `item` names.
    fn whole_image(&mut self, item: &Item<'a>, raw: bool) -> Result<Arc<Image>, Error> {
        let path = self.folders.find(item.text()?, item.place())?;
        if let Some(image) = self.images.get(&(path.clone(), raw)) {
            return Ok(image.clone());
        }
        let options = image::ReadOptions { raw, ..image::ReadOptions::to(self.scene.working_space) };
        let mut image = image::read(&path, &options)?;
        if !raw {
            image::clamp_negative(&mut image, &path);
        }
        let image = Arc::new(image);
        self.images.insert((path, raw), image.clone());
        Ok(image)
    }

    /// The material that `item` names.
    pub(super) fn material(&mut self, item: &Item<'a>) -> Result<MaterialId, Error> {
        self.named_material(item.text()?, Some(item))
    }

    pub(super) fn named_material(
        &mut self,
        name: &str,
        user: Option<&Item<'a>>,
    ) -> Result<MaterialId, Error> {
        let written = match self.materials.get_mut(name) {
            Some(Named::Done(id)) => return Ok(*id),
            Some(named @ Named::Written(_)) => std::mem::replace(named, Named::Open),
            Some(Named::Open) => {
                let at = user.map_or_else(Default::default, Item::place);
                return Err(Error::invalid(at, format!("material '{name}' contains itself")));
            }
            None => {
                let Some(user) = user else { return Ok(0) };
                return Err(user.unknown("material", name, self.materials.keys().map(String::as_str)));
            }
        };
        let Named::Written(item) = written else { unreachable!("matched above") };
        let id = self.describe_material(item)?;
        self.scene.name_material(id, name);
        self.materials.insert(name.to_string(), Named::Done(id));
        Ok(id)
    }

    /// What the material is made of, then what is laid over it: bumps, both sides, holes.
    fn describe_material(&mut self, item: Item<'a>) -> Result<MaterialId, Error> {
        let mut keys = item.keys(&format!("material '{}'", item.key))?;
        let two_sided = keys.or("two_sided", false, Item::boolean)?;
        let (normal_map, bump_map) = (keys.get("normal_map"), keys.get("bump_map"));
        let normal_scale = keys.get("normal_scale");
        let bump_scale = keys.get("bump_scale");
        let flip_invalid_normals = keys.get("flip_invalid_normals");
        let use_shadowing_function = keys.get("use_shadowing_function");
        let opacity = keys.get("opacity");

        let (model, blend, sum, front) =
            (keys.get("model"), keys.get("blend"), keys.get("sum"), keys.get("front"));
        let cloth = keys.get("btf");
        let material = match (model, blend, sum, front) {
            (None, None, None, None) if cloth.is_some() => {
                self.cloth(cloth.as_ref().unwrap_or(&item), &mut keys)?
            }
            _ if cloth.is_some() => {
                let problem =
                    format!("{}: 'btf' takes the place of a model and of other materials", keys.what);
                return Err(keys.invalid(problem));
            }
            (Some(model), None, None, None) => self.model(&model, &mut keys)?,
            (None, Some(blend), None, None) => {
                let parts = blend.array()?;
                let [first, second] = &parts[..] else {
                    return Err(blend.wrong("the names of two materials in brackets"));
                };
                let (first, second) = (self.material(first)?, self.material(second)?);
                let weight = keys.need("weight", "how much of the second, 0 to 1, a number or a texture")?;
                Material::Blend { weight: self.fraction(&weight)?, first, second }
            }
            (None, None, Some(sum), None) => {
                let parts = sum.array()?;
                Material::Sum(parts.iter().map(|p| self.material(p)).collect::<Result<_, _>>()?)
            }
            (None, None, None, Some(front)) => {
                let back = keys.need("back", "the name of a material")?;
                Material::TwoSided { front: self.material(&front)?, back: self.material(&back)? }
            }
            _ => {
                let problem = format!(
                    "{} needs one of 'model', 'btf' (a file), 'blend' (two materials), 'sum' (several) and 'front' with 'back'",
                    keys.what
                );
                return Err(keys.invalid(problem));
            }
        };
        let mut id = self.push_material(material);
        for (key, item) in [
            ("flip_invalid_normals", &flip_invalid_normals),
            ("use_shadowing_function", &use_shadowing_function),
        ] {
            if let Some(item) = item.as_ref().filter(|_| normal_map.is_none() && bump_map.is_none()) {
                return Err(item.invalid(format!("'{key}' needs a 'normal_map' or a 'bump_map'")));
            }
        }
        let turned = TurnedNormals {
            flip_invalid_normals: flip_invalid_normals.as_ref().map_or(Ok(true), Item::boolean)?,
            use_shadowing_function: use_shadowing_function.as_ref().map_or(Ok(true), Item::boolean)?,
        };
        if let Some(map) = normal_map {
            let texture = self.texture(&map, true)?;
            let scale = normal_scale.as_ref().map_or(Ok(1.0), |i| i.number_in(-100.0, 100.0))?;
            id = self.push_material(Material::NormalMap { texture, scale, turned, base: id });
        } else if let Some(scale) = normal_scale {
            return Err(scale.invalid("'normal_scale' needs a 'normal_map'"));
        }
        if let Some(map) = bump_map {
            let texture = self.texture(&map, true)?;
            let scale = bump_scale.as_ref().map_or(Ok(1.0), |i| i.number_in(-1e6, 1e6))?;
            id = self.push_material(Material::BumpMap { texture, scale, turned, base: id });
        } else if let Some(scale) = bump_scale {
            return Err(scale.invalid("'bump_scale' needs a 'bump_map'"));
        }
        if two_sided {
            id = self.push_material(Material::TwoSided { front: id, back: id });
        }
        if let Some(opacity) = opacity {
            let opacity = self.fraction(&opacity)?;
            id = self.push_material(Material::Mask { opacity, base: id });
        }
        keys.finish()?;
        Ok(id)
    }

    /// A number from 0 to 1, or a texture.
    fn fraction(&mut self, item: &Item<'a>) -> Result<Value, Error> {
        match self.value(item, Role::Number)? {
            Value::Number(_) => item.number_in(0.0, 1.0).map(Value::Number),
            Value::Texture(t) => Ok(Value::Texture(t)),
            Value::Rgb(_) => Err(item.wrong("a number from 0 to 1 or a texture")),
        }
    }

    fn model(&mut self, item: &Item<'a>, keys: &mut Keys<'a>) -> Result<Material, Error> {
        let name = item.text()?;
        let known = || Kind::ALL.iter().map(|k| k.name());
        let kind = Kind::from_name(name).map_err(|_| item.unknown("reflectance model", name, known()))?;
        let preset = keys.get("preset");
        let mut builder = match &preset {
            Some(preset) => {
                let name = preset.text()?;
                ModelBuilder::preset(kind, name, self.scene.working_space).map_err(|e| match e {
                    ModelError::UnknownPreset { .. } => {
                        preset.unknown("preset", name, kind.presets().iter().map(|p| p.name))
                    }
                    other => Error::model(preset.place(), other),
                })?
            }
            None => ModelBuilder::new(kind),
        };
        // Models that turn spectra into colours do so for this scene.
        if kind.param("space").is_ok() {
            let space = self.scene.working_space.name();
            builder.choose("space", space).map_err(|e| Error::model(item.place(), e))?;
        }
        // A metal gives both optical constants at once.
        if ["eta", "k"].iter().all(|name| kind.param(name).is_ok())
            && let Some(metal) = keys.get("metal")
        {
            let constants = self.metal(&metal)?;
            for (name, value) in ["eta", "k"].into_iter().zip(constants) {
                builder.set(name, Value::Rgb(value)).map_err(|e| Error::model(metal.place(), e))?;
            }
        }
        // One roughness for both ways is what most people mean.
        let short = [("alpha", ["alpha_x", "alpha_y"]), ("sigma", ["sigma_x", "sigma_y"])];
        for (both, each) in short {
            if kind.param(both).is_err()
                && each.iter().all(|name| kind.param(name).is_ok())
                && let Some(item) = keys.get(both)
            {
                let value = self.value(&item, Role::Number)?;
                for name in each {
                    builder.set(name, value.clone()).map_err(|e| Error::model(item.place(), e))?;
                }
            }
        }
        for param in kind.params() {
            let Some(item) = keys.get(param.name) else { continue };
            let set = match param.kind {
                ParamType::Choice(names) => {
                    let choice = item.one_of("form", &names.iter().map(|n| (*n, *n)).collect::<Vec<_>>())?;
                    builder.choose(param.name, choice)
                }
                ParamType::Number => builder.set(param.name, self.value(&item, Role::Number)?),
                ParamType::Rgb => builder.set(param.name, self.value(&item, Role::Surface)?),
            };
            set.map_err(|e| Error::model(item.place(), e))?;
        }
        if let Some(file) = keys.get("data") {
            builder.data(self.measured(kind, &file)?);
        }
        builder.build().map_err(|e| Error::model(item.place(), e))
    }

    /// The maps of a cloth as a material.
    fn cloth(&mut self, file: &Item<'a>, keys: &mut Keys<'a>) -> Result<Material, Error> {
        let path = self.folders.find(file.text()?, file.place())?;
        let maps = Arc::new(btf::load(&path, self.scene.working_space)?.0);
        // Its table is for constant widths.
        let forms: Vec<(&str, Choice)> = match Kind::Noh.param("form").map(|(_, p)| p.kind) {
            Ok(ParamType::Choice(names)) => {
                names.iter().enumerate().map(|(i, n)| (*n, Choice(i as f32))).collect()
            }
            _ => Vec::new(),
        };
        let forms: Vec<_> = forms.into_iter().filter(|f| f.0 != "ashikhmin2000").collect();
        let form = keys.or("form", Choice(0.0), |i| i.one_of("form for maps", &forms))?;
        let wrap = keys.or("wrap", Wrap::default(), |i| i.one_of("wrap", &WRAPS))?;
        let texture = self.push_texture(Texture::Cloth { maps, wrap, to_uv: to_uv(keys)? });
        Ok(Material::Cloth { texture, form })
    }

    /// The numbers of a measured file, by the model that bakes them.
    fn measured(&mut self, kind: Kind, item: &Item<'a>) -> Result<Vec<f32>, Error> {
        let path = self.folders.find(item.text()?, item.place())?;
        if kind.data() == Data::None {
            return Err(item.invalid(format!("model '{}' takes no measured file", kind.name())));
        }
        measured::read(&path, kind, self.scene.working_space)
    }
}

/// `scale`, then `rotate` (degrees), then `offset` of the (u, v) of a surface.
fn to_uv(keys: &mut Keys) -> Result<Affine2, Error> {
    let scale = keys
        .or("scale", Vec2::ONE, |i| i.try_number().map_or_else(|| i.vec2(), |v| Ok(Vec2::splat(v as f32))))?;
    let turn = keys.or("rotate", 0.0, Item::number)?.to_radians();
    let offset = keys.or("offset", Vec2::ZERO, Item::vec2)?;
    Ok(Affine2::from_scale_angle_translation(scale, turn, offset))
}
