//! Materials and pictures.

use super::schema::{MaterialEntry, Pbr, SpecularGlossiness, TextureInfo};
use super::{Finish, Reader, VERTEX_ALPHA, VERTEX_COLOR};
use crate::Error;
use crate::formats::image;
use glam::{Affine2, Mat2, Mat3, Vec2, Vec3};
use std::f32::consts::TAU;
use std::path::PathBuf;
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::{Kind, ParamType};
use yugen_scene::{Material, ModelBuilder, Texture, TextureFilter, TextureId, TurnedNormals, Value, Wrap};

/// Where pictures have their alpha, whatever their channels: they are looked up as red, green, blue and alpha.
const ALPHA: usize = 3;

impl Reader<'_> {
    /// Material `index` (none: the format's default) for a mesh whose vertices have so many numbers of colour.
    pub(super) fn material(&mut self, index: Option<usize>, colour: usize) -> Result<Finish, Error> {
        if let Some(finish) = self.materials.get(&(index, colour)) {
            return Ok(finish.clone());
        }
        let doc = self.doc;
        let default = MaterialEntry::default();
        let entry = match index {
            Some(i) => doc.entry(&doc.root.materials, i, "material")?,
            None => &default,
        };
        let finish = self.describe(entry, colour)?;
        self.scene.name_material(finish.id, &entry.name);
        self.materials.insert((index, colour), finish.clone());
        Ok(finish)
    }

    /// What is behind shows through the back of a material.
    pub(super) fn culled(&mut self, base: usize) -> usize {
        self.push_material(Material::OneSided { base })
    }

    fn describe(&mut self, entry: &MaterialEntry, colour: usize) -> Result<Finish, Error> {
        self.uv_sets = uv_sets(entry);
        let x = &entry.extensions;
        let pbr = &entry.pbr_metallic_roughness;
        let (factor, texture) = match &x.specular_glossiness {
            Some(s) => (s.diffuse_factor, s.diffuse_texture.as_ref()),
            None => (pbr.base_color_factor, pbr.base_color_texture.as_ref()),
        };
        let base_colour = self.base_colour(factor, texture, colour)?;

        let strength = x.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength).clamp(0.0, 1e9);
        let glow = Vec3::from_array(entry.emissive_factor).clamp(Vec3::ZERO, Vec3::splat(1e6)) * strength;
        let mut emission = match (&entry.emissive_texture, glow != Vec3::ZERO) {
            (_, false) => None,
            (Some(info), true) if self.has_picture(info)? => Some(self.scaled(info, false, None, glow)?),
            (_, true) => Some(Value::Rgb(self.to_working(glow))),
        };
        let body = x.volume.as_ref().is_some_and(|v| v.thickness_factor > 0.0)
            && x.transmission.as_ref().is_some_and(|t| t.transmission_factor > 0.0);
        let mut id = if x.unlit.is_some() {
            // Without light of its own, what is unlit would be black.
            emission = Some(base_colour);
            self.push_material(Material::lambert(Value::Number(0.0)))
        } else {
            self.surface(entry, base_colour, body)?
        };
        if let Some(info) = &entry.normal_texture
            && self.has_picture(info)?
        {
            let scale = info.scale.filter(|s| s.is_finite()).unwrap_or(1.0);
            let texture = self.texture(info, true, None)?;
            let turned = TurnedNormals::default();
            id = self.push_material(Material::NormalMap { texture, scale, turned, base: id });
        }
        // A body's surface has an inside and an outside.
        if entry.double_sided && !body {
            id = self.push_material(Material::TwoSided { front: id, back: id });
        }
        if let Some(opacity) = self.opacity(entry, factor[3], texture, colour)? {
            id = self.push_material(Material::Mask { opacity: opacity.clone(), base: id });
            // What is not there does not glow.
            emission = emission.map(|e| self.product(e, opacity));
        }
        let uv_sets = std::mem::take(&mut self.uv_sets);
        let culled = !entry.double_sided && !body;
        Ok(Finish { id, emission, double_sided: entry.double_sided, culled, uv_sets })
    }

    fn base_colour(
        &mut self,
        [r, g, b, _]: [f32; 4],
        texture: Option<&TextureInfo>,
        colour: usize,
    ) -> Result<Value, Error> {
        let vertices = (colour >= 3)
            .then(|| Value::Texture(self.push(Texture::MeshAttribute { name: VERTEX_COLOR.into() })));
        let constant = self.colour([r, g, b]);
        let of_texture = match texture {
            Some(info) if self.has_picture(info)? => {
                Some(self.scaled(info, false, None, self.factor([r, g, b]))?)
            }
            _ => None,
        };
        Ok(match (of_texture, vertices) {
            (None, None) => constant,
            (Some(value), None) => value,
            (None, Some(value)) => self.product(value, constant),
            (Some(a), Some(b)) => self.product(a, b),
        })
    }

    /// Where the surface is; `None`: everywhere.
    fn opacity(
        &mut self,
        entry: &MaterialEntry,
        factor: f32,
        texture: Option<&TextureInfo>,
        colour: usize,
    ) -> Result<Option<Value>, Error> {
        let mode = entry.alpha_mode.as_deref().unwrap_or("OPAQUE");
        if !["OPAQUE", "MASK", "BLEND"].contains(&mode) {
            let (at, known) = (self.doc.at.clone(), ["OPAQUE", "MASK", "BLEND"]);
            return Err(Error::unknown(at, "alpha mode", mode, known));
        }
        if mode == "OPAQUE" {
            return Ok(None);
        }
        let factor = factor.clamp(0.0, 1.0);
        let mut alpha = Value::Number(factor);
        if let Some(info) = texture
            && self.has_picture(info)?
            && self.image(info, true)?.channel("A").is_some()
        {
            alpha = self.number(factor, Some(info), ALPHA)?;
        }
        if colour == 4 {
            let of_vertices = Value::Texture(self.push(Texture::MeshAttribute { name: VERTEX_ALPHA.into() }));
            alpha = self.product(alpha, of_vertices);
        }
        let opacity = match (mode, alpha) {
            ("MASK", Value::Number(a)) => {
                Value::Number(f32::from(u8::from(a >= entry.alpha_cutoff.unwrap_or(0.5))))
            }
            ("MASK", value) => {
                let edge = entry.alpha_cutoff.unwrap_or(0.5);
                Value::Texture(self.push(Texture::Step { value, edge }))
            }
            (_, value) => value,
        };
        Ok((opacity != Value::Number(1.0)).then_some(opacity))
    }

    fn product(&mut self, a: Value, b: Value) -> Value {
        match (a, b) {
            (a, Value::Number(1.0)) | (Value::Number(1.0), a) => a,
            (Value::Number(a), Value::Number(b)) => Value::Number(a * b),
            (Value::Rgb(c), Value::Number(n)) | (Value::Number(n), Value::Rgb(c)) => Value::Rgb(c * n),
            (Value::Rgb(a), Value::Rgb(b)) => Value::Rgb(a * b),
            (Value::Texture(texture), Value::Number(n)) | (Value::Number(n), Value::Texture(texture)) => {
                Value::Texture(self.times(texture, Vec3::splat(n)))
            }
            (Value::Texture(texture), Value::Rgb(c)) | (Value::Rgb(c), Value::Texture(texture)) => {
                Value::Texture(self.times(texture, c))
            }
            (a, b) => Value::Texture(self.push(Texture::Product { factors: [a, b] })),
        }
    }

    /// The reflecting material, mixed with what lets light through.
    fn surface(&mut self, entry: &MaterialEntry, base_colour: Value, body: bool) -> Result<usize, Error> {
        let x = &entry.extensions;
        if let Some(s) = &x.specular_glossiness {
            let model = self.specular_glossiness(s, base_colour)?;
            return Ok(self.push_material(model));
        }
        let model = self.metallic_roughness(entry, base_colour.clone())?;
        let mut id = self.push_material(model);
        // What passes in all directions lies below what passes through: as in KHR_materials_diffuse_transmission.
        if let Some(d) = x.diffuse_transmission.as_ref().filter(|d| d.diffuse_transmission_factor > 0.0) {
            let share =
                self.number(d.diffuse_transmission_factor, d.diffuse_transmission_texture.as_ref(), 3)?;
            let tint = self
                .tinted(d.diffuse_transmission_color_factor, d.diffuse_transmission_color_texture.as_ref())?;
            let sheet = self.sheet(entry, tint, 1.0)?;
            id = self.dielectric_share(entry, id, share, sheet)?;
        }
        if let Some(t) = x.transmission.as_ref().filter(|t| t.transmission_factor > 0.0) {
            let share = self.number(t.transmission_factor, t.transmission_texture.as_ref(), 0)?;
            let through = match &x.volume {
                Some(volume) if body => self.body(
                    &entry.pbr_metallic_roughness,
                    x.ior.as_ref().map(|i| i.ior),
                    base_colour,
                    volume,
                )?,
                _ => self.sheet(entry, base_colour, 0.0)?,
            };
            id = self.dielectric_share(entry, id, share, through)?;
        }
        Ok(id)
    }

    /// `share` of the part that is no metal is replaced by `other`.
    fn dielectric_share(
        &mut self,
        entry: &MaterialEntry,
        all: usize,
        share: Value,
        other: usize,
    ) -> Result<usize, Error> {
        let pbr = &entry.pbr_metallic_roughness;
        let metallic = self.number(pbr.metallic_factor, pbr.metallic_roughness_texture.as_ref(), 2)?;
        let weight = match metallic {
            Value::Number(m) => self.product(share, Value::Number(1.0 - m.clamp(0.0, 1.0))),
            // 1 − m, as the mix of one and nothing.
            Value::Texture(_) => {
                let metal =
                    self.push_material(Material::Blend { weight: metallic, first: other, second: all });
                return Ok(match share {
                    Value::Number(1.0) => metal,
                    weight => self.push_material(Material::Blend { weight, first: all, second: metal }),
                });
            }
            Value::Rgb(_) => share,
        };
        Ok(match weight {
            Value::Number(w) if w >= 1.0 => other,
            Value::Number(w) if w <= 0.0 => all,
            weight => self.push_material(Material::Blend { weight, first: all, second: other }),
        })
    }

    /// A sheet without thickness that lets light through.
    fn sheet(&mut self, entry: &MaterialEntry, tint: Value, diffuse: f32) -> Result<usize, Error> {
        let pbr = &entry.pbr_metallic_roughness;
        let mut values = vec![("transmittance", tint), ("diffuse", Value::Number(diffuse))];
        values.push((
            "roughness",
            self.number(pbr.roughness_factor, pbr.metallic_roughness_texture.as_ref(), 1)?,
        ));
        self.reflection(entry, &mut values)?;
        let model = self.model("thin_transmission", values)?;
        Ok(self.push_material(model))
    }

    /// Glass with an inside.
    fn body(
        &mut self,
        pbr: &Pbr,
        ior: Option<f32>,
        tint: Value,
        volume: &super::schema::Volume,
    ) -> Result<usize, Error> {
        let ior = ("int_ior", Value::Number(ior.unwrap_or(1.5)));
        let outside = ("ext_ior", Value::Number(1.0));
        let tint = ("specular_transmittance", tint);
        let model = match (pbr.roughness_factor, &pbr.metallic_roughness_texture) {
            (0.0, _) => self.model("dielectric", vec![ior, outside, tint])?,
            (roughness, texture) => {
                // The texture holds the square root of what the model wants.
                let baked = match texture {
                    Some(info) if self.has_picture(info)? => {
                        self.baked(info, "G", |g| (g * roughness).powi(2))?
                    }
                    _ => None,
                };
                let alpha = baked.unwrap_or(Value::Number(roughness * roughness));
                let alphas = [("alpha_x", alpha.clone()), ("alpha_y", alpha)];
                let mut values = vec![ior, outside, tint];
                values.extend(alphas);
                self.model("rough_dielectric", values)?
            }
        };
        let base = self.push_material(model);
        let colour = self.to_working(Vec3::from_array(volume.attenuation_color).clamp(Vec3::ZERO, Vec3::ONE));
        // Black would be no number.
        let colour = colour.clamp(Vec3::splat(1e-6), Vec3::ONE);
        let distance = volume.attenuation_distance;
        let absorption = if distance > 0.0 { -colour.map(f32::ln) / distance } else { Vec3::ZERO };
        Ok(self.push_material(Material::Body { absorption, base }))
    }

    /// Reflectances of a dielectric are those of the model whose index is 0: `specular_color` itself.
    fn specular_glossiness(&mut self, s: &SpecularGlossiness, diffuse: Value) -> Result<Material, Error> {
        let specular = self.tinted(s.specular_factor, s.specular_glossiness_texture.as_ref())?;
        let gloss = s.glossiness_factor.clamp(0.0, 1.0);
        let rough = match &s.specular_glossiness_texture {
            Some(info) if self.has_picture(info)? => self.baked(info, "A", |a| 1.0 - a * gloss)?,
            _ => None,
        };
        let values = vec![
            ("base_color", diffuse),
            ("metallic", Value::Number(0.0)),
            ("roughness", rough.unwrap_or(Value::Number(1.0 - gloss))),
            ("ior", Value::Number(0.0)),
            ("specular_color", specular),
        ];
        self.model("metallic_roughness", values)
    }

    /// How a dielectric reflects.
    fn reflection(
        &mut self,
        entry: &MaterialEntry,
        values: &mut Vec<(&'static str, Value)>,
    ) -> Result<(), Error> {
        let x = &entry.extensions;
        let ior = x.ior.as_ref().map_or(1.5, |i| i.ior);
        let mut ior = if ior == 0.0 { 0.0 } else { ior.clamp(1.0, 1e4) };
        if let Some(s) = &x.specular {
            values.push(("specular", self.number(s.specular_factor, s.specular_texture.as_ref(), 3)?));
            // Head on it reflects r² times its colour, which may be above one: then the excess goes into r.
            let colour = s.specular_color_factor.map(|c| if c > 0.0 { c } else { 0.0 });
            let most = colour.into_iter().fold(1.0, f32::max);
            let mut colour = colour;
            if most > 1.0 {
                let r2 = ((ior - 1.0) / (ior + 1.0)).powi(2);
                let wanted = (r2 * most).min(1.0);
                ior = if wanted < 1.0 { (1.0 + wanted.sqrt()) / (1.0 - wanted.sqrt()) } else { 0.0 };
                colour = colour.map(|c| if wanted > 0.0 { (c * r2 / wanted).min(1.0) } else { 0.0 });
            }
            values.push(("specular_color", self.tinted(colour, s.specular_color_texture.as_ref())?));
        }
        values.push(("ior", Value::Number(ior)));
        Ok(())
    }

    fn metallic_roughness(&mut self, entry: &MaterialEntry, base_colour: Value) -> Result<Material, Error> {
        let pbr = &entry.pbr_metallic_roughness;
        let x = &entry.extensions;
        let mut values: Vec<(&'static str, Value)> = vec![("base_color", base_colour)];
        let metal_rough = pbr.metallic_roughness_texture.as_ref();
        values.push(("metallic", self.number(pbr.metallic_factor, metal_rough, 2)?));
        values.push(("roughness", self.number(pbr.roughness_factor, metal_rough, 1)?));
        self.reflection(entry, &mut values)?;
        if let Some(s) = &x.sheen {
            values.push(("sheen_color", self.tinted(s.sheen_color_factor, s.sheen_color_texture.as_ref())?));
            values.push((
                "sheen_roughness",
                self.number(s.sheen_roughness_factor, s.sheen_roughness_texture.as_ref(), 3)?,
            ));
        }
        if let Some(c) = &x.clearcoat {
            values.push(("clearcoat", self.number(c.clearcoat_factor, c.clearcoat_texture.as_ref(), 0)?));
            let roughness =
                self.number(c.clearcoat_roughness_factor, c.clearcoat_roughness_texture.as_ref(), 1)?;
            values.push(("clearcoat_roughness", roughness));
        }
        if let Some(a) = &x.anisotropy {
            values
                .push(("anisotropy", self.number(a.anisotropy_strength, a.anisotropy_texture.as_ref(), 2)?));
            let rotation = match &a.anisotropy_texture {
                Some(info) => self.directions(info, a.anisotropy_rotation)?,
                None => Value::Number(a.anisotropy_rotation.rem_euclid(TAU)),
            };
            values.push(("anisotropy_rotation", rotation));
        }
        if let Some(i) = &x.iridescence {
            values
                .push(("iridescence", self.number(i.iridescence_factor, i.iridescence_texture.as_ref(), 0)?));
            values.push(("iridescence_ior", Value::Number(i.iridescence_ior)));
            let (low, high) = (i.iridescence_thickness_minimum, i.iridescence_thickness_maximum);
            let thickness = match &i.iridescence_thickness_texture {
                Some(info) => {
                    self.baked(info, "G", |g| low + g * (high - low))?.unwrap_or(Value::Number(high))
                }
                None => Value::Number(high),
            };
            values.push(("iridescence_thickness", thickness));
        }
        self.model("metallic_roughness", values)
    }

    fn model(&self, name: &str, values: Vec<(&'static str, Value)>) -> Result<Material, Error> {
        let failed = |e| Error::model(self.doc.at.clone(), e);
        let kind = Kind::from_name(name).map_err(failed)?;
        let mut builder = ModelBuilder::new(kind);
        for (name, value) in values {
            let (_, param) = kind.param(name).map_err(failed)?;
            // Exporters are not strict about ranges, and the specification has readers clamp.
            let clamp = |v: f32| match name {
                "ior" => v,
                _ if v.is_nan() => param.min,
                _ => v.clamp(param.min, param.max),
            };
            let value = match value {
                Value::Number(v) if param.kind == ParamType::Rgb => Value::Rgb(Vec3::splat(clamp(v))),
                Value::Number(v) => Value::Number(clamp(v)),
                Value::Rgb(c) => Value::Rgb(c.map(clamp)),
                texture => texture,
            };
            match name {
                // Beyond its range it stands for reflectances that glTF has and no index; at 0 all is reflected.
                "ior" => builder.set_any(name, value).map_err(failed)?,
                _ => builder.set(name, value).map_err(failed)?,
            };
        }
        builder.build().map_err(failed)
    }

    fn factor(&self, rgb: [f32; 3]) -> Vec3 {
        Vec3::from_array(rgb).clamp(Vec3::ZERO, Vec3::splat(1e6))
    }

    fn to_working(&self, rgb: Vec3) -> Vec3 {
        ColourSpace::LinearSrgb.matrix_to(self.scene.working_space) * rgb
    }

    fn colour(&self, rgb: [f32; 3]) -> Value {
        Value::Rgb(
            self.to_working(Vec3::from_array(rgb).clamp(Vec3::ZERO, Vec3::ONE)).clamp(Vec3::ZERO, Vec3::ONE),
        )
    }

    fn tinted(&mut self, factor: [f32; 3], info: Option<&TextureInfo>) -> Result<Value, Error> {
        match info {
            Some(info) if self.has_picture(info)? => self.scaled(info, false, None, self.factor(factor)),
            _ => Ok(self.colour(factor)),
        }
    }

    /// A factor times a channel of a texture.
    fn number(&mut self, factor: f32, info: Option<&TextureInfo>, channel: usize) -> Result<Value, Error> {
        match info {
            Some(info) if self.has_picture(info)? => {
                self.scaled(info, true, Some(channel), Vec3::splat(factor.clamp(0.0, 1e6)))
            }
            _ => Ok(Value::Number(factor)),
        }
    }

    fn scaled(
        &mut self,
        info: &TextureInfo,
        raw: bool,
        channel: Option<usize>,
        factor: Vec3,
    ) -> Result<Value, Error> {
        let grey = factor == Vec3::splat(factor.x);
        if raw || grey || self.scene.working_space == ColourSpace::LinearSrgb {
            let id = self.texture(info, raw, channel)?;
            return Ok(Value::Texture(self.times(id, factor)));
        }
        // Factors multiply in linear sRGB. In another space that is no product channel by channel.
        let image = self.image(info, false)?;
        let Some(at) = ["R", "G", "B"].map(|c| image.channel(c)).into_iter().collect::<Option<Vec<_>>>()
        else {
            let id = self.texture(info, false, None)?;
            return Ok(Value::Texture(self.times(id, self.to_working(factor))));
        };
        let to_working = ColourSpace::LinearSrgb.matrix_to(self.scene.working_space);
        let product = to_working * Mat3::from_diagonal(factor) * to_working.inverse();
        let mut image = Image::clone(&image);
        let width = image.channels.len();
        for pixel in image.data.chunks_exact_mut(width) {
            let rgb = product * Vec3::new(pixel[at[0]], pixel[at[1]], pixel[at[2]]);
            for (&c, v) in at.iter().zip(rgb.to_array()) {
                pixel[c] = v;
            }
        }
        let texture = self.picture(info, Arc::new(image), None)?;
        Ok(Value::Texture(self.place(info, texture)))
    }

    fn times(&mut self, texture: TextureId, factor: Vec3) -> TextureId {
        if factor == Vec3::ONE { texture } else { self.push(Texture::Scaled { texture, factor }) }
    }

    /// `f` of one channel, as a picture of its own; `None` where the picture has no such channel. Grey is all colours.
    fn baked(
        &mut self,
        info: &TextureInfo,
        channel: &str,
        f: impl Fn(f32) -> f32,
    ) -> Result<Option<Value>, Error> {
        let image = self.image(info, true)?;
        let grey = || if channel == "A" { None } else { image.channel("Y") };
        let Some(at) = image.channel(channel).or_else(grey) else { return Ok(None) };
        let data = image.data.iter().skip(at).step_by(image.channels.len()).map(|&v| f(v)).collect();
        let baked = Image { width: image.width, height: image.height, channels: vec!["Y".into()], data };
        let texture = self.picture(info, Arc::new(baked), None)?;
        Ok(Some(Value::Texture(self.place(info, texture))))
    }

    /// Angles of the directions that red and green stand for, [0, 1] for [−1, 1], turned by `turn` radians.
    fn directions(&mut self, info: &TextureInfo, turn: f32) -> Result<Value, Error> {
        let image = self.image(info, true)?;
        let [Some(r), Some(g)] = ["R", "G"].map(|c| image.channel(c)) else {
            return Ok(Value::Number(turn.rem_euclid(TAU)));
        };
        let angle = |p: &[f32]| ((2.0 * p[g] - 1.0).atan2(2.0 * p[r] - 1.0) + turn).rem_euclid(TAU);
        let data = image.data.chunks_exact(image.channels.len()).map(angle).collect();
        let angles = Image { width: image.width, height: image.height, channels: vec!["Y".into()], data };
        let mut texture = self.picture(info, Arc::new(angles), None)?;
        if let Texture::Image { filter, .. } = &mut texture {
            // Between an angle and the same a turn on lies every other.
            *filter = TextureFilter::Nearest;
        }
        Ok(Value::Texture(self.place(info, texture)))
    }

    fn texture(&mut self, info: &TextureInfo, raw: bool, channel: Option<usize>) -> Result<TextureId, Error> {
        let image = self.image(info, raw)?;
        let texture = self.picture(info, image, channel)?;
        Ok(self.place(info, texture))
    }

    /// Adds a texture at the coordinates that `info` asks for.
    fn place(&mut self, info: &TextureInfo, texture: Texture) -> TextureId {
        let texture = self.push(texture);
        match uv_set(info) {
            set if self.uv_sets.first() == Some(&set) => texture,
            set => self.push(Texture::At { texture, attribute: uv_attribute(set) }),
        }
    }

    /// Whether the texture has a picture that can be read; warns where it has another.
    fn has_picture(&mut self, info: &TextureInfo) -> Result<bool, Error> {
        let doc = self.doc;
        let texture = doc.entry(&doc.root.textures, info.index, "texture")?;
        Ok(texture.source.is_some()
            || texture.extensions.webp.is_some()
            || texture.extensions.basisu.is_none())
    }

    fn picture(
        &self,
        info: &TextureInfo,
        image: Arc<Image>,
        channel: Option<usize>,
    ) -> Result<Texture, Error> {
        let doc = self.doc;
        let texture = doc.entry(&doc.root.textures, info.index, "texture")?;
        let (mut filter, mut wrap) = (TextureFilter::default(), [Wrap::default(); 2]);
        if let Some(sampler) = texture.sampler {
            let sampler = doc.entry(&doc.root.samplers, sampler, "sampler")?;
            if sampler.mag_filter == Some(9728) {
                filter = TextureFilter::Nearest;
            }
            let of = |code: Option<u32>| match code {
                Some(33071) => Wrap::Clamp,
                Some(33648) => Wrap::Mirror,
                _ => Wrap::Repeat,
            };
            wrap = [of(sampler.wrap_s), of(sampler.wrap_t)];
        }
        let to_uv = info.extensions.transform.as_ref().map_or(Affine2::IDENTITY, |t| {
            let (sin, cos) = t.rotation.sin_cos();
            let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
            Affine2::from_mat2_translation(turn * Mat2::from_diagonal(t.scale.into()), t.offset.into())
        });
        if !to_uv.is_finite() {
            return Err(doc.invalid("the transform of a texture is not finite"));
        }
        Ok(Texture::Image { image, filter, wrap, to_uv, channel })
    }

    fn image(&mut self, info: &TextureInfo, raw: bool) -> Result<Arc<Image>, Error> {
        let doc = self.doc;
        let texture = doc.entry(&doc.root.textures, info.index, "texture")?;
        let source = texture.extensions.webp.as_ref().map(|w| w.source).or(texture.source);
        let source = source.ok_or_else(|| {
            doc.invalid(format!("texture {} names no picture that can be read", info.index))
        })?;
        if let Some(image) = self.images.get(&(source, raw)) {
            return Ok(image.clone());
        }
        let entry = doc.entry(&doc.root.images, source, "image")?;
        let mut name = PathBuf::from(format!("{}, image {source}", doc.at.file.display()));
        let fetched;
        let bytes = match (&entry.uri, entry.buffer_view) {
            (Some(uri), _) => {
                if !uri.starts_with("data:") {
                    name = doc.at.file.with_file_name(uri);
                }
                fetched = doc.fetch(uri, &self.folders)?;
                &fetched[..]
            }
            (None, Some(view)) => doc.view(view)?,
            (None, None) => return Err(doc.invalid(format!("image {source} is nowhere"))),
        };
        let options = image::ReadOptions {
            raw,
            max_samples: self.samples_left.min(image::DEFAULT_MAX_SAMPLES),
            ..image::ReadOptions::to(self.scene.working_space)
        };
        let image = Arc::new(image::read_bytes(bytes, &name, &options)?);
        self.samples_left -= image.data.len() as u64;
        self.images.insert((source, raw), image.clone());
        Ok(image)
    }

    fn push(&mut self, texture: Texture) -> TextureId {
        self.scene.textures.push(texture);
        self.scene.textures.len() - 1
    }

    fn push_material(&mut self, material: Material) -> usize {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }
}

/// The name of the attribute of a mesh that holds a set of (u, v) which is not its first.
pub(super) fn uv_attribute(set: usize) -> String {
    format!("uv_{set}")
}

/// The set of (u, v) that a texture asks for.
fn uv_set(info: &TextureInfo) -> usize {
    info.extensions.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord)
}

/// The sets of (u, v) that the textures of a material ask for. The first, that of the normal texture if there is one,
/// is the one that tangents follow.
fn uv_sets(entry: &MaterialEntry) -> Vec<usize> {
    let (pbr, x) = (&entry.pbr_metallic_roughness, &entry.extensions);
    let (sheen, specular, clearcoat) = (x.sheen.as_ref(), x.specular.as_ref(), x.clearcoat.as_ref());
    let (iridescence, gloss) = (x.iridescence.as_ref(), x.specular_glossiness.as_ref());
    let diffuse = x.diffuse_transmission.as_ref();
    let all = [
        entry.normal_texture.as_ref(),
        x.anisotropy.as_ref().and_then(|a| a.anisotropy_texture.as_ref()),
        pbr.base_color_texture.as_ref(),
        pbr.metallic_roughness_texture.as_ref(),
        entry.emissive_texture.as_ref(),
        gloss.and_then(|g| g.diffuse_texture.as_ref()),
        gloss.and_then(|g| g.specular_glossiness_texture.as_ref()),
        sheen.and_then(|s| s.sheen_color_texture.as_ref()),
        sheen.and_then(|s| s.sheen_roughness_texture.as_ref()),
        specular.and_then(|s| s.specular_texture.as_ref()),
        specular.and_then(|s| s.specular_color_texture.as_ref()),
        clearcoat.and_then(|c| c.clearcoat_texture.as_ref()),
        clearcoat.and_then(|c| c.clearcoat_roughness_texture.as_ref()),
        iridescence.and_then(|i| i.iridescence_texture.as_ref()),
        iridescence.and_then(|i| i.iridescence_thickness_texture.as_ref()),
        x.transmission.as_ref().and_then(|t| t.transmission_texture.as_ref()),
        diffuse.and_then(|d| d.diffuse_transmission_texture.as_ref()),
        diffuse.and_then(|d| d.diffuse_transmission_color_texture.as_ref()),
    ];
    let mut sets: Vec<usize> = Vec::new();
    for set in all.into_iter().flatten().map(uv_set) {
        if !sets.contains(&set) {
            sets.push(set);
        }
    }
    sets
}
