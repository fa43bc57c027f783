//! BSDFs, textures and colours.
//!
//! Mitsuba's checkerboard swaps its two values where a number is wanted instead of a colour (`eval_1` against
//! `eval` in src/textures/checkerboard.cpp of 3.9.1), so a texture is made once for each of the two uses.

use super::Builder;
use super::document::{Class, Spectrum, Value as Written};
use super::properties::Properties;
use crate::formats::{image, measured};
use crate::{Error, Place};
use glam::{Affine2, Mat2, Vec3};
use std::path::Path;
use std::sync::Arc;
use yugen_optics::Image;
use yugen_optics::spectrum::{MitsubaSpectrum, mitsuba_rgb, mitsuba_uniform_emission};
use yugen_reflectance::Kind;
use yugen_reflectance::metals::{conductor_names, named_conductor};
use yugen_reflectance::microfacet::{ior_names, named_ior};
use yugen_reflectance::principled::eta_of_specular;
use yugen_scene::{
    Material, MaterialId, ModelBuilder, Texture, TextureFilter, TextureId, TurnedNormals, Value, Wrap,
};

/// What a colour is for, which decides how spectra become RGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Of a surface, within [0, 1].
    Colour,
    /// Of a surface, without an upper bound.
    Unbounded,
    /// Emitted.
    Light,
    /// A number.
    Number,
}

impl Builder<'_> {
    pub(super) fn material(&mut self, p: Properties) -> Result<MaterialId, Error> {
        if let Some(&m) = self.materials.get(&p.index) {
            return Ok(m);
        }
        let id = match p.plugin() {
            "diffuse" => {
                let mut m = self.start(p, "lambert")?;
                self.set(p, &mut m, "reflectance", "reflectance", Role::Colour)?;
                self.build(p, m)?
            }
            "conductor" => {
                let mut m = self.start(p, "conductor")?;
                self.metal(p, &mut m)?;
                self.build(p, m)?
            }
            "roughconductor" => {
                let mut m = self.start(p, "rough_conductor")?;
                self.metal(p, &mut m)?;
                self.roughness(p, &mut m)?;
                self.build(p, m)?
            }
            "dielectric" | "thindielectric" | "roughdielectric" => {
                let name = match p.plugin() {
                    "dielectric" => "dielectric",
                    "thindielectric" => "thin_dielectric",
                    _ => "rough_dielectric",
                };
                let mut m = self.start(p, name)?;
                iors(p, &mut m, "bk7")?;
                if name == "rough_dielectric" {
                    self.roughness(p, &mut m)?;
                }
                for colour in ["specular_reflectance", "specular_transmittance"] {
                    self.set(p, &mut m, colour, colour, Role::Colour)?;
                }
                self.build(p, m)?
            }
            "plastic" | "roughplastic" => {
                let rough = p.plugin() == "roughplastic";
                let mut m = self.start(p, if rough { "rough_plastic" } else { "plastic" })?;
                iors(p, &mut m, "polypropylene")?;
                for colour in ["specular_reflectance", "diffuse_reflectance"] {
                    self.set(p, &mut m, colour, colour, Role::Colour)?;
                }
                let nonlinear = if p.boolean("nonlinear", false)? { "on" } else { "off" };
                m.choose("nonlinear", nonlinear).map_err(|e| Error::model(p.place(), e))?;
                if rough {
                    p.accept(&["sample_visible"]);
                    distribution(p, &mut m)?;
                    put(p, &mut m, "alpha", Value::Number(p.float("alpha", 0.1)? as f32))?;
                }
                self.build(p, m)?
            }
            "principled" => self.principled(p)?,
            "principledthin" => self.principled_thin(p)?,
            "measured" => self.measured(p)?,
            "twosided" => {
                p.accept(&["allow_transmission"]);
                let (front, back) = match p.children(Class::Bsdf)[..] {
                    [one] => {
                        let one = self.material(one)?;
                        (one, one)
                    }
                    [front, back] => (self.material(front)?, self.material(back)?),
                    ref n => {
                        return Err(p.invalid(format!(
                            "'twosided' needs one or two BSDFs inside, found {}",
                            n.len()
                        )));
                    }
                };
                self.push(Material::TwoSided { front, back })
            }
            "mask" => {
                let opacity = self.value(p, "opacity", Role::Number)?.unwrap_or(Value::Number(0.5));
                let base = self.inner(p)?;
                self.push(Material::Mask { opacity, base })
            }
            "blendbsdf" => {
                let weight = self.value(p, "weight", Role::Number)?.ok_or_else(|| p.missing("weight"))?;
                let [first, second] = p.children(Class::Bsdf)[..] else {
                    return Err(p.invalid(format!(
                        "'blendbsdf' needs two BSDFs inside, found {}",
                        p.children(Class::Bsdf).len()
                    )));
                };
                let (first, second) = (self.material(first)?, self.material(second)?);
                self.push(Material::Blend { weight, first, second })
            }
            "normalmap" | "bumpmap" => {
                let normal = p.plugin() == "normalmap";
                // Whatever its name and its place among the children.
                let Some(texture) = p.child(Class::Texture)? else {
                    return Err(p.invalid(format!("'{}' needs a <texture> inside", p.plugin())));
                };
                let texture = match self.plain(texture, Role::Unbounded)? {
                    Some(Value::Number(v)) => self.one_texel(Vec3::splat(v)),
                    Some(Value::Rgb(c)) => self.one_texel(c),
                    Some(Value::Texture(texture)) => texture,
                    None => self.texture(texture, !normal)?,
                };
                let turned = TurnedNormals {
                    flip_invalid_normals: p.boolean("flip_invalid_normals", true)?,
                    use_shadowing_function: p.boolean("use_shadowing_function", true)?,
                };
                let base = self.inner(p)?;
                self.push(if normal {
                    Material::NormalMap { texture, scale: 1.0, turned, base }
                } else {
                    Material::BumpMap { texture, scale: p.float("scale", 1.0)? as f32, turned, base }
                })
            }
            "null" => self.push(Material::Null),
            "phong" | "ward" => self.glossy_of_0_6(p)?,
            "roughdiffuse" => self.rough_diffuse(p)?,
            _ => return Err(p.unknown_plugin()),
        };
        p.finish()?;
        self.scene.name_material(id, p.id());
        self.materials.insert(p.index, id);
        Ok(id)
    }

    pub(super) fn push(&mut self, material: Material) -> MaterialId {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    fn inner(&mut self, p: Properties) -> Result<MaterialId, Error> {
        let inner = p
            .child(Class::Bsdf)?
            .ok_or_else(|| p.invalid(format!("'{}' needs a BSDF inside", p.plugin())))?;
        self.material(inner)
    }

    /// A reflectance model by its name.
    fn start(&self, p: Properties, name: &str) -> Result<ModelBuilder, Error> {
        Kind::from_name(name).map(ModelBuilder::new).map_err(|e| Error::model(p.place(), e))
    }

    /// The material is complete.
    fn build(&mut self, p: Properties, model: ModelBuilder) -> Result<MaterialId, Error> {
        let material = model.build().map_err(|e| Error::model(p.place(), e))?;
        Ok(self.push(material))
    }

    /// Sets the parameter `ours` to the property `theirs`, where it is given.
    fn set(
        &mut self,
        p: Properties,
        model: &mut ModelBuilder,
        theirs: &'static str,
        ours: &str,
        role: Role,
    ) -> Result<(), Error> {
        match self.value(p, theirs, role)? {
            Some(value) => put(p, model, ours, value),
            None => Ok(()),
        }
    }

    fn metal(&mut self, p: Properties, model: &mut ModelBuilder) -> Result<(), Error> {
        let (eta, k) = match p.string("material")? {
            Some(_) if p.has("eta") || p.has("k") => {
                return Err(p.invalid("'material' cannot be given together with 'eta' and 'k'"));
            }
            Some((name, at)) => named_conductor(name)
                .ok_or_else(|| Error::unknown(p.place_of(at), "metal", name, conductor_names()))?,
            // A perfect mirror where nothing is said.
            None => (Vec3::ZERO, Vec3::ONE),
        };
        put(p, model, "eta", Value::Rgb(eta))?;
        put(p, model, "k", Value::Rgb(k))?;
        self.set(p, model, "eta", "eta", Role::Unbounded)?;
        self.set(p, model, "k", "k", Role::Unbounded)?;
        self.set(p, model, "specular_reflectance", "specular_reflectance", Role::Colour)
    }

    fn roughness(&mut self, p: Properties, model: &mut ModelBuilder) -> Result<(), Error> {
        p.accept(&["sample_visible"]);
        distribution(p, model)?;
        if p.has("alpha_u") || p.has("alpha_v") {
            if p.has("alpha") {
                return Err(p.invalid("'alpha' cannot be given together with 'alpha_u' and 'alpha_v'"));
            }
            for (theirs, ours) in [("alpha_u", "alpha_x"), ("alpha_v", "alpha_y")] {
                let alpha = self.value(p, theirs, Role::Number)?.ok_or_else(|| p.missing(theirs))?;
                put(p, model, ours, alpha)?;
            }
            return Ok(());
        }
        let alpha = self.value(p, "alpha", Role::Number)?.unwrap_or(Value::Number(0.1));
        put(p, model, "alpha_x", alpha.clone())?;
        put(p, model, "alpha_y", alpha)
    }

    fn principled(&mut self, p: Properties) -> Result<MaterialId, Error> {
        const NUMBERS: &[&str] = &[
            "roughness",
            "anisotropic",
            "spec_trans",
            "sheen",
            "sheen_tint",
            "flatness",
            "spec_tint",
            "metallic",
            "clearcoat",
            "clearcoat_gloss",
        ];
        p.accept(&[
            "main_specular_sampling_rate",
            "clearcoat_sampling_rate",
            "diffuse_reflectance_sampling_rate",
        ]);
        let mut m = self.start(p, "principled")?;
        self.set(p, &mut m, "base_color", "base_color", Role::Colour)?;
        for name in NUMBERS {
            self.set(p, &mut m, name, name, Role::Number)?;
        }
        let eta = match (p.float_or_none("eta")?, p.float_or_none("specular")?) {
            (Some(_), Some(_)) => return Err(p.invalid("'eta' and 'specular' cannot both be given")),
            (Some(eta), None) => eta as f32,
            (None, specular) => {
                let specular = specular.unwrap_or(0.5);
                if !(0.0..=12.0).contains(&specular) {
                    return Err(p.out_of_range("specular", specular, "0 to 12"));
                }
                // As Mitsuba: at 0 there would be no surface left to refract.
                eta_of_specular((specular as f32).max(1e-3))
            }
        };
        put(p, &mut m, "eta", Value::Number(eta))?;
        self.build(p, m)
    }

    fn principled_thin(&mut self, p: Properties) -> Result<MaterialId, Error> {
        const NUMBERS: &[&str] = &[
            "roughness",
            "anisotropic",
            "spec_trans",
            "eta",
            "spec_tint",
            "sheen",
            "sheen_tint",
            "flatness",
            "diff_trans",
        ];
        p.accept(&[
            "diffuse_reflectance_sampling_rate",
            "specular_reflectance_sampling_rate",
            "specular_transmittance_sampling_rate",
            "diffuse_transmittance_sampling_rate",
        ]);
        let mut m = self.start(p, "principled_thin")?;
        self.set(p, &mut m, "base_color", "base_color", Role::Colour)?;
        for name in NUMBERS {
            self.set(p, &mut m, name, name, Role::Number)?;
        }
        self.build(p, m)
    }

    /// Jakob 2014, "Mitsuba Documentation" (0.6), 8.2: the modified Phong model and Ward's over a diffuse ground.
    fn glossy_of_0_6(&mut self, p: Properties) -> Result<MaterialId, Error> {
        p.accept(&["specular_sampling_weight"]);
        let mut diffuse = self.value(p, "diffuse_reflectance", Role::Colour)?.unwrap_or(Value::Number(0.5));
        let mut specular = self.value(p, "specular_reflectance", Role::Colour)?.unwrap_or(Value::Number(0.2));
        // There, where both could reflect more than arrives, both are scaled down together.
        let most = |v: &Value| match v {
            Value::Number(v) => Some(Vec3::splat(*v)),
            Value::Rgb(c) => Some(*c),
            Value::Texture(_) => None,
        };
        if let (Some(a), Some(b)) = (most(&diffuse), most(&specular)) {
            let sum = (a + b).max_element();
            if sum > 1.0 {
                (diffuse, specular) = (Value::Rgb(a * (0.99 / sum)), Value::Rgb(b * (0.99 / sum)));
            }
        }
        let mut lobe = self.start(p, p.plugin())?;
        put(p, &mut lobe, "specular", specular)?;
        if p.plugin() == "ward" {
            let form = match p.choice("variant", "balanced", &["ward", "ward-duer", "balanced"])? {
                "ward" => "ward1992",
                "ward-duer" => "duer",
                _ => "gmd",
            };
            lobe.choose("form", form).map_err(|e| Error::model(p.place(), e))?;
            for (theirs, ours) in [("alpha_u", "alpha_x"), ("alpha_v", "alpha_y")] {
                let alpha = self.value(p, theirs, Role::Number)?.unwrap_or(Value::Number(0.1));
                put(p, &mut lobe, ours, alpha)?;
            }
            put(p, &mut lobe, "diffuse", diffuse)?;
            return self.build(p, lobe);
        }
        let exponent = self.value(p, "exponent", Role::Number)?.unwrap_or(Value::Number(30.0));
        put(p, &mut lobe, "exponent", exponent)?;
        let lobe = self.build(p, lobe)?;
        let ground = self.push(Material::lambert(diffuse));
        Ok(self.push(Material::Sum(vec![ground, lobe])))
    }

    /// The same, 8.2.2: Oren and Nayar's model, by the roughness of a Beckmann distribution with its slopes.
    fn rough_diffuse(&mut self, p: Properties) -> Result<MaterialId, Error> {
        let mut m = self.start(p, "oren_nayar")?;
        self.set(p, &mut m, "reflectance", "reflectance", Role::Colour)?;
        let alpha = match self.value(p, "alpha", Role::Number)? {
            Some(Value::Number(alpha)) => alpha,
            None => 0.2,
            Some(_) => return Err(p.invalid("the 'alpha' of 'roughdiffuse' cannot vary here; give a number")),
        };
        put(p, &mut m, "sigma", Value::Number(alpha * std::f32::consts::FRAC_1_SQRT_2))?;
        let form = if p.boolean("use_fast_approx", false)? { "qualitative" } else { "full" };
        m.choose("form", form).map_err(|e| Error::model(p.place(), e))?;
        self.build(p, m)
    }

    fn measured(&mut self, p: Properties) -> Result<MaterialId, Error> {
        let file = p.required_file("filename")?;
        let mut m = self.start(p, "rgl")?;
        m.data(measured::read(&file, m.kind(), self.scene.working_space)?);
        self.build(p, m)
    }

    /// The value of a property that may be a number, a colour, a spectrum or a texture.
    pub(super) fn value(
        &mut self,
        p: Properties,
        name: &'static str,
        role: Role,
    ) -> Result<Option<Value>, Error> {
        let Some(property) = p.get(name) else { return Ok(None) };
        let place = || p.place_of(property.at);
        let value = match &property.value {
            Written::Float(v) => Value::Number(*v as f32),
            Written::Integer(v) => Value::Number(*v as f32),
            Written::Rgb(c) => Value::Rgb(bounded(c.as_vec3(), role, place)?),
            Written::Spectrum(s) => rgb(s, role, place)?,
            Written::Object(_) | Written::Reference(_) => match p.object(property) {
                Some(t) if t.class() == Class::Texture => match self.plain(t, role)? {
                    Some(value) => value,
                    None => Value::Texture(self.texture(t, role == Role::Number)?),
                },
                Some(t) => {
                    return Err(Error::invalid(
                        place(),
                        format!("expected a texture as '{name}', found a {}", t.class().name()),
                    ));
                }
                None => return Err(Error::invalid(place(), format!("expected a texture as '{name}'"))),
            },
            other => {
                return Err(Error::invalid(
                    place(),
                    format!(
                        "expected a number, colour, spectrum or texture as '{name}', found {}",
                        other.kind()
                    ),
                ));
            }
        };
        Ok(Some(value))
    }

    /// Textures that are the same everywhere: spectra written as plugins.
    fn plain(&mut self, p: Properties, role: Role) -> Result<Option<Value>, Error> {
        let place = || p.place();
        let list = |text: &str| -> Result<Vec<f64>, Error> {
            let number = |w: &str| w.parse::<f64>().ok().filter(|v| v.is_finite());
            let all = super::values::words(text).map(|w| {
                number(w).ok_or_else(|| {
                    Error::invalid(p.place(), format!("expected a finite number, found '{w}'"))
                })
            });
            all.collect()
        };
        let value = match p.plugin() {
            "uniform" => {
                p.accept(&["wavelength_min", "wavelength_max"]);
                let v = p.float_or_none("value")?.ok_or_else(|| p.missing("value"))?;
                // On its own this plugin is the same grey for lights too.
                Value::Number(v as f32)
            }
            // The white of the working space.
            "d65" => {
                let scale = p.float("scale", 1.0)? as f32;
                match p.get("color").map(|c| &c.value) {
                    Some(Written::Rgb(c)) => Value::Rgb(bounded(c.as_vec3() * scale, Role::Light, place)?),
                    Some(other) => {
                        return Err(
                            p.invalid(format!("expected an rgb colour as 'color', found {}", other.kind()))
                        );
                    }
                    None => Value::Number(scale),
                }
            }
            "rawconstant" => match p.get("value").map(|v| &v.value) {
                Some(Written::Float(v)) => Value::Number(*v as f32),
                Some(Written::Integer(v)) => Value::Number(*v as f32),
                Some(Written::Vector(v) | Written::Rgb(v)) => Value::Rgb(v.as_vec3()),
                _ => return Err(p.missing("value")),
            },
            "srgb" => {
                let unbounded = p.boolean("unbounded", false)?;
                let Some(Written::Rgb(c)) = p.get("color").map(|c| &c.value) else {
                    return Err(p.missing("color"));
                };
                Value::Rgb(bounded(
                    c.as_vec3(),
                    if unbounded { Role::Unbounded } else { Role::Colour },
                    place,
                )?)
            }
            "irregular" | "regular" => {
                let spectrum = match p.get("value") {
                    Some(v) => match p.spectrum(v) {
                        Some(s) => s.clone(),
                        None => {
                            return Err(Error::invalid(
                                p.place_of(v.at),
                                format!("expected a spectrum, found {}", v.value.kind()),
                            ));
                        }
                    },
                    None => {
                        let (values, _) = p.string("values")?.ok_or_else(|| p.missing("values"))?;
                        let values = list(values)?;
                        let wavelengths = if p.plugin() == "irregular" {
                            list(p.string("wavelengths")?.ok_or_else(|| p.missing("wavelengths"))?.0)?
                        } else {
                            let first = p
                                .float_or_none("wavelength_min")?
                                .ok_or_else(|| p.missing("wavelength_min"))?;
                            let last = p
                                .float_or_none("wavelength_max")?
                                .ok_or_else(|| p.missing("wavelength_max"))?;
                            let step = (last - first) / (values.len().max(2) - 1) as f64;
                            (0..values.len()).map(|i| first + step * i as f64).collect()
                        };
                        Spectrum::Table { wavelengths, values }
                    }
                };
                rgb(&spectrum, role, place)?
            }
            _ => return Ok(None),
        };
        p.finish()?;
        Ok(Some(value))
    }

    /// A texture; `as_number` where it stands for a number and not for a colour.
    pub(super) fn texture(&mut self, p: Properties, as_number: bool) -> Result<TextureId, Error> {
        if let Some(&t) = self.textures.get(&(p.index, as_number)) {
            return Ok(t);
        }
        let texture = match p.plugin() {
            "bitmap" => {
                p.accept(&["accel", "format"]);
                let file = p.required_file("filename")?;
                Texture::Image {
                    image: self.image(&file, p.boolean("raw", false)?)?,
                    filter: match p.choice("filter_type", "bilinear", &["bilinear", "nearest"])? {
                        "nearest" => TextureFilter::Nearest,
                        _ => TextureFilter::Bilinear,
                    },
                    wrap: [match p.choice("wrap_mode", "repeat", &["repeat", "mirror", "clamp"])? {
                        "mirror" => Wrap::Mirror,
                        "clamp" => Wrap::Clamp,
                        _ => Wrap::Repeat,
                    }; 2],
                    to_uv: to_uv(p)?,
                    channel: None,
                }
            }
            "checkerboard" => {
                let role = if as_number { Role::Number } else { Role::Colour };
                let color0 = self.value(p, "color0", role)?.unwrap_or(Value::Number(0.4));
                let color1 = self.value(p, "color1", role)?.unwrap_or(Value::Number(0.2));
                let (even, odd) = if as_number { (color1, color0) } else { (color0, color1) };
                Texture::Checkerboard { even, odd, to_uv: to_uv(p)? }
            }
            "mesh_attribute" => {
                let (name, at) = p.string("name")?.ok_or_else(|| p.missing("name"))?;
                if !name.starts_with("vertex_") && !name.starts_with("face_") {
                    let problem = format!(
                        "expected the name of an attribute of vertices or faces, such as 'vertex_color' or \
                         'face_color', found '{name}'"
                    );
                    return Err(Error::invalid(p.place_of(at), problem));
                }
                let attribute = Texture::MeshAttribute { name: name.to_string() };
                match p.float("scale", 1.0)? as f32 {
                    1.0 => attribute,
                    scale => {
                        let texture = self.scene.textures.len();
                        self.scene.textures.push(attribute);
                        Texture::Scaled { texture, factor: Vec3::splat(scale) }
                    }
                }
            }
            _ => match self.plain(p, Role::Colour)? {
                // A constant where only a texture will do: one texel.
                Some(value) => {
                    let c = match value {
                        Value::Rgb(c) => c,
                        Value::Number(v) => Vec3::splat(v),
                        Value::Texture(_) => return Err(p.unknown_plugin()),
                    };
                    one_texel(c)
                }
                None => return Err(p.unknown_plugin()),
            },
        };
        p.finish()?;
        let id = self.scene.textures.len();
        self.scene.textures.push(texture);
        self.textures.insert((p.index, as_number), id);
        Ok(id)
    }

    /// A texture that is the same everywhere.
    pub(super) fn one_texel(&mut self, colour: Vec3) -> TextureId {
        self.scene.textures.push(one_texel(colour));
        self.scene.textures.len() - 1
    }

    /// A picture with one channel, or with three.
    pub(super) fn image(&mut self, file: &Path, raw: bool) -> Result<Arc<Image>, Error> {
        let key = (file.to_path_buf(), raw);
        if let Some(image) = self.images.get(&key) {
            return Ok(image.clone());
        }
        let options =
            if raw { image::ReadOptions::raw() } else { image::ReadOptions::to(self.scene.working_space) };
        let mut read = image::read_layer(file, None, &options)?;
        if !raw {
            image::clamp_negative(&mut read, file);
        }
        // Alpha and everything else that is no colour is dropped, as in the program.
        let wanted = [&["R", "G", "B"][..], &["Y"]].into_iter().find_map(|names| read.select(names));
        let image = Arc::new(wanted.ok_or_else(|| {
            let problem = format!("expected the channels R, G, B or Y, found {}", read.channels.join(", "));
            Error::invalid(Place::file(file), problem)
        })?);
        self.images.insert(key, image.clone());
        Ok(image)
    }
}

fn one_texel(colour: Vec3) -> Texture {
    let mut image = Image::rgb(1, 1);
    image.data = colour.to_array().to_vec();
    Texture::Image {
        image: Arc::new(image),
        filter: TextureFilter::Nearest,
        wrap: [Wrap::Repeat; 2],
        to_uv: Affine2::IDENTITY,
        channel: None,
    }
}

/// The two-dimensional part of `to_uv`. Seen in 3.9.1: (u, v) is moved by the fourth column only, so that
/// the third of a plain 3 x 3 matrix has no effect.
fn to_uv(p: Properties) -> Result<Affine2, Error> {
    let m = p.transform("to_uv")?;
    let linear = Mat2::from_cols(m.x_axis.truncate().truncate(), m.y_axis.truncate().truncate());
    Ok(Affine2::from_mat2_translation(linear, m.w_axis.truncate().truncate()))
}

/// Sets a parameter; the program sets no bounds where ours has them.
fn put(p: Properties, model: &mut ModelBuilder, name: &str, value: Value) -> Result<(), Error> {
    model.set_any(name, value).map(|_| ()).map_err(|e| Error::model(p.place(), e))
}

fn distribution(p: Properties, model: &mut ModelBuilder) -> Result<(), Error> {
    let name = p.choice("distribution", "beckmann", &["beckmann", "ggx"])?;
    model.choose("distribution", name).map(|_| ()).map_err(|e| Error::model(p.place(), e))
}

fn iors(p: Properties, model: &mut ModelBuilder, inside: &str) -> Result<(), Error> {
    for (name, default) in [("int_ior", inside), ("ext_ior", "air")] {
        let (word, at) = match p.get(name) {
            Some(property) => match &property.value {
                Written::String(word) => (word.as_str(), property.at),
                _ => {
                    let ior = p.float_in(name, 1.0, |v| v > 0.0, "more than 0")?;
                    put(p, model, name, Value::Number(ior as f32))?;
                    continue;
                }
            },
            None => (default, p.at()),
        };
        let ior = named_ior(&word.to_lowercase());
        let ior =
            ior.ok_or_else(|| Error::unknown(p.place_of(at), "dielectric material", word, ior_names()))?;
        put(p, model, name, Value::Number(ior))?;
    }
    Ok(())
}

fn bounded(c: Vec3, role: Role, place: impl Fn() -> Place) -> Result<Vec3, Error> {
    if !c.is_finite() {
        return Err(Error::invalid(place(), "the colour overflows single precision"));
    }
    match role {
        Role::Light | Role::Unbounded if c.min_element() < 0.0 => {
            Err(Error::invalid(place(), format!("the colour {}, {}, {} cannot be negative", c.x, c.y, c.z)))
        }
        Role::Colour if c.min_element() < 0.0 || c.max_element() > 1.0 => Err(Error::invalid(
            place(),
            format!("the colour {}, {}, {} of a surface must lie within 0 and 1", c.x, c.y, c.z),
        )),
        _ => Ok(c),
    }
}

fn rgb(spectrum: &Spectrum, role: Role, place: impl Fn() -> Place) -> Result<Value, Error> {
    let least = match spectrum {
        Spectrum::Uniform(v) => *v,
        Spectrum::Table { values, .. } => values.iter().copied().fold(0.0, f64::min),
    };
    if role == Role::Light && least < 0.0 {
        let problem = format!("light cannot be negative, found {least}; give 0 or more");
        return Err(Error::invalid(place(), problem));
    }
    Ok(match spectrum {
        Spectrum::Uniform(v) if role == Role::Light => Value::Rgb(mitsuba_uniform_emission(*v as f32)),
        Spectrum::Uniform(v) => Value::Number(*v as f32),
        Spectrum::Table { wavelengths, values } => {
            let kind = match role {
                Role::Colour | Role::Number => MitsubaSpectrum::Reflectance,
                Role::Unbounded => MitsubaSpectrum::Unbounded,
                Role::Light => MitsubaSpectrum::Emission,
            };
            Value::Rgb(
                mitsuba_rgb(wavelengths, values, kind).map_err(|e| Error::invalid(place(), e.to_string()))?,
            )
        }
    })
}
