//! Materials and pictures.

use super::schema::{MaterialEntry, TextureInfo};
use super::{Finish, Reader};
use crate::Error;
use crate::formats::image;
use crate::scene::{Material, ModelBuilder, Texture, TextureFilter, TextureId, TurnedNormals, Value, Wrap};
use glam::{Affine2, Mat2, Mat3, Vec2, Vec3};
use std::f32::consts::TAU;
use std::path::PathBuf;
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::{Kind, ParamType};

impl Reader<'_> {
    /// Material `index` (none: the format's default) for a mesh with or without vertex colours.
    pub(super) fn material(&mut self, index: Option<usize>, coloured: bool) -> Result<Finish, Error> {
        if let Some(finish) = self.materials.get(&(index, coloured)) {
            return Ok(finish.clone());
        }
        let doc = self.doc;
        let default = MaterialEntry::default();
        let entry = match index {
            Some(i) => doc.entry(&doc.root.materials, i, "material")?,
            None => &default,
        };
        let finish = self.describe(entry, coloured)?;
        self.materials.insert((index, coloured), finish.clone());
        Ok(finish)
    }

    fn describe(&mut self, entry: &MaterialEntry, coloured: bool) -> Result<Finish, Error> {
        let pbr = &entry.pbr_metallic_roughness;
        let uv_set = self.uv_set(entry);
        let [r, g, b, alpha] = pbr.base_color_factor;
        let base_colour = match &pbr.base_color_texture {
            Some(info) => {
                if coloured {
                    tracing::warn!(
                        "{}: the vertex colours under the texture of '{}' are not used",
                        self.doc.at,
                        entry.name
                    );
                }
                self.scaled(info, false, None, self.factor([r, g, b]))?
            }
            None if coloured => {
                let id = self.push(Texture::MeshAttribute { name: "vertex_color".into() });
                Value::Texture(self.times(id, self.factor([r, g, b])))
            }
            None => self.colour([r, g, b]),
        };

        let strength =
            entry.extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength).clamp(0.0, 1e9);
        let glow = Vec3::from_array(entry.emissive_factor).clamp(Vec3::ZERO, Vec3::splat(1e6)) * strength;
        let mut emission = match (&entry.emissive_texture, glow != Vec3::ZERO) {
            (_, false) => None,
            (Some(info), true) => Some(self.scaled(info, false, None, glow)?),
            (None, true) => Some(Value::Rgb(self.to_working(glow))),
        };
        let mut id = if entry.extensions.unlit.is_some() {
            // Without light of its own, what is unlit would be black.
            emission = Some(base_colour);
            self.push_material(Material::lambert(Value::Number(0.0)))
        } else {
            let model = self.metallic_roughness(entry, base_colour)?;
            self.push_material(model)
        };
        if let Some(info) = &entry.normal_texture {
            let scale = info.scale.filter(|s| s.is_finite()).unwrap_or(1.0);
            let texture = self.texture(info, true, None)?;
            let turned = TurnedNormals::default();
            id = self.push_material(Material::NormalMap { texture, scale, turned, base: id });
        }
        if entry.double_sided {
            id = self.push_material(Material::TwoSided { front: id, back: id });
        }
        let opacity = match entry.alpha_mode.as_deref().unwrap_or("OPAQUE") {
            "OPAQUE" => None,
            mode @ ("MASK" | "BLEND") => {
                let cutoff = (mode == "MASK").then(|| entry.alpha_cutoff.unwrap_or(0.5));
                let opacity = |a: f32| match cutoff {
                    Some(cutoff) => f32::from(u8::from(a * alpha >= cutoff)),
                    None => (a * alpha).clamp(0.0, 1.0),
                };
                match &pbr.base_color_texture {
                    Some(info) => {
                        Some(self.baked(info, "A", opacity)?.unwrap_or(Value::Number(opacity(1.0))))
                    }
                    None => Some(Value::Number(opacity(1.0))),
                }
            }
            other => {
                return Err(Error::unknown(
                    self.doc.at.clone(),
                    "alpha mode",
                    other,
                    ["OPAQUE", "MASK", "BLEND"],
                ));
            }
        };
        if let Some(opacity) = opacity.filter(|o| *o != Value::Number(1.0)) {
            id = self.push_material(Material::Mask { opacity, base: id });
        }
        Ok(Finish { id, emission, double_sided: entry.double_sided, uv_set })
    }

    fn metallic_roughness(&mut self, entry: &MaterialEntry, base_colour: Value) -> Result<Material, Error> {
        let pbr = &entry.pbr_metallic_roughness;
        let x = &entry.extensions;
        let mut values: Vec<(&str, Value)> = vec![("base_color", base_colour)];
        let metal_rough = pbr.metallic_roughness_texture.as_ref();
        values.push(("metallic", self.number(pbr.metallic_factor, metal_rough, 2)?));
        values.push(("roughness", self.number(pbr.roughness_factor, metal_rough, 1)?));
        if let Some(ior) = &x.ior {
            values.push(("ior", Value::Number(ior.ior)));
        }
        if let Some(s) = &x.specular {
            values.push(("specular", self.number(s.specular_factor, s.specular_texture.as_ref(), 3)?));
            values.push((
                "specular_color",
                self.tinted(s.specular_color_factor, s.specular_color_texture.as_ref())?,
            ));
        }
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
        let failed = |e| Error::model(self.doc.at.clone(), e);
        let kind = Kind::from_name("metallic_roughness").map_err(failed)?;
        let mut builder = ModelBuilder::new(kind);
        for (name, value) in values {
            let (_, param) = kind.param(name).map_err(failed)?;
            // Exporters are not strict about ranges, and the specification has readers clamp.
            let clamp = |v: f32| if v.is_nan() { param.min } else { v.clamp(param.min, param.max) };
            let value = match value {
                Value::Number(v) if param.kind == ParamType::Rgb => Value::Rgb(Vec3::splat(clamp(v))),
                Value::Number(v) => Value::Number(clamp(v)),
                Value::Rgb(c) => Value::Rgb(c.map(clamp)),
                texture => texture,
            };
            builder.set(name, value).map_err(failed)?;
        }
        builder.build().map_err(failed)
    }

    /// The set of (u, v) that the material's textures name; where they differ, that of the first. A mesh carries one.
    fn uv_set(&self, entry: &MaterialEntry) -> Option<usize> {
        let textures = textures(entry);
        let (_, first) = *textures.first()?;
        let others: Vec<String> =
            textures.iter().filter(|t| t.1 != first).map(|(name, set)| format!("{name} ({set})")).collect();
        if !others.is_empty() {
            tracing::warn!(
                "{}: the textures of material '{}' use several sets of texture coordinates, and only one can be \
                 read: TEXCOORD_{first} is taken for all, wrongly for {}; bake them to one set",
                self.doc.at,
                entry.name,
                others.join(", ")
            );
        }
        Some(first)
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
            Some(info) => self.scaled(info, false, None, self.factor(factor)),
            None => Ok(self.colour(factor)),
        }
    }

    /// A factor times a channel of a texture.
    fn number(&mut self, factor: f32, info: Option<&TextureInfo>, channel: usize) -> Result<Value, Error> {
        match info {
            Some(info) => self.scaled(info, true, Some(channel), Vec3::splat(factor.clamp(0.0, 1e6))),
            None => Ok(Value::Number(factor)),
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
        Ok(Value::Texture(self.push(texture)))
    }

    fn times(&mut self, texture: TextureId, factor: Vec3) -> TextureId {
        if factor == Vec3::ONE { texture } else { self.push(Texture::Scaled { texture, factor }) }
    }

    /// `f` of one channel, as a picture of its own; `None` where the picture has no such channel.
    fn baked(
        &mut self,
        info: &TextureInfo,
        channel: &str,
        f: impl Fn(f32) -> f32,
    ) -> Result<Option<Value>, Error> {
        let image = self.image(info, true)?;
        let Some(at) = image.channel(channel) else { return Ok(None) };
        let data = image.data.iter().skip(at).step_by(image.channels.len()).map(|&v| f(v)).collect();
        let baked = Image { width: image.width, height: image.height, channels: vec!["Y".into()], data };
        let texture = self.picture(info, Arc::new(baked), None)?;
        Ok(Some(Value::Texture(self.push(texture))))
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
        Ok(Value::Texture(self.push(texture)))
    }

    fn texture(&mut self, info: &TextureInfo, raw: bool, channel: Option<usize>) -> Result<TextureId, Error> {
        let image = self.image(info, raw)?;
        let channel = match channel {
            // Grey pictures have one channel for all; without alpha, there is no hole in it.
            Some(c) if c >= image.channels.len() => Some(0),
            other => other,
        };
        let texture = self.picture(info, image, channel)?;
        Ok(self.push(texture))
    }

    fn picture(
        &self,
        info: &TextureInfo,
        image: Arc<Image>,
        channel: Option<usize>,
    ) -> Result<Texture, Error> {
        let doc = self.doc;
        let texture = doc.entry(&doc.root.textures, info.index, "texture")?;
        let (mut filter, mut wrap) = (TextureFilter::default(), Wrap::default());
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
            wrap = of(sampler.wrap_s);
            if wrap != of(sampler.wrap_t) {
                tracing::warn!("{}: a texture wraps otherwise across than down; it wraps as across", doc.at);
            }
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

/// The textures of a material that are read, the most visible first, each with its set of (u, v).
fn textures(entry: &MaterialEntry) -> Vec<(&'static str, usize)> {
    let (pbr, x) = (&entry.pbr_metallic_roughness, &entry.extensions);
    let (sheen, specular, clearcoat) = (x.sheen.as_ref(), x.specular.as_ref(), x.clearcoat.as_ref());
    let iridescence = x.iridescence.as_ref();
    let all = [
        ("baseColorTexture", pbr.base_color_texture.as_ref()),
        ("normalTexture", entry.normal_texture.as_ref()),
        ("metallicRoughnessTexture", pbr.metallic_roughness_texture.as_ref()),
        ("emissiveTexture", entry.emissive_texture.as_ref()),
        ("anisotropyTexture", x.anisotropy.as_ref().and_then(|a| a.anisotropy_texture.as_ref())),
        ("sheenColorTexture", sheen.and_then(|s| s.sheen_color_texture.as_ref())),
        ("sheenRoughnessTexture", sheen.and_then(|s| s.sheen_roughness_texture.as_ref())),
        ("specularTexture", specular.and_then(|s| s.specular_texture.as_ref())),
        ("specularColorTexture", specular.and_then(|s| s.specular_color_texture.as_ref())),
        ("clearcoatTexture", clearcoat.and_then(|c| c.clearcoat_texture.as_ref())),
        ("clearcoatRoughnessTexture", clearcoat.and_then(|c| c.clearcoat_roughness_texture.as_ref())),
        ("iridescenceTexture", iridescence.and_then(|i| i.iridescence_texture.as_ref())),
        ("iridescenceThicknessTexture", iridescence.and_then(|i| i.iridescence_thickness_texture.as_ref())),
    ];
    let set = |info: &TextureInfo| {
        info.extensions.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord)
    };
    all.into_iter().filter_map(|(name, info)| Some((name, set(info?)))).collect()
}
