//! Emitters that are not shapes.

use super::Builder;
use super::materials::Role;
use super::properties::Properties;
use super::sensors::field_of_view;
use crate::Error;
use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_scene::{Light, Texture, Value};

impl Builder<'_> {
    pub(super) fn light(&mut self, p: Properties) -> Result<Light, Error> {
        p.accept(&["sampling_weight"]);
        let light = match p.plugin() {
            "point" => {
                let position = match p.vector("position")? {
                    Some(_) if p.has("to_world") => {
                        return Err(p.invalid("'position' and 'to_world' cannot both be given"));
                    }
                    Some(position) => position,
                    None => p.to_world()?.w_axis.truncate(),
                };
                Light::Point { position, intensity: self.light_colour(p, "intensity")? }
            }
            "spot" => {
                let cutoff =
                    p.float_in("cutoff_angle", 20.0, |v| v > 0.0 && v < 90.0, "degrees between 0 and 90")?;
                let beam = p.float_in(
                    "beam_width",
                    0.75 * cutoff,
                    |v| v >= 0.0 && v <= cutoff,
                    "0 to cutoff_angle",
                )?;
                let texture = match self.value(p, "texture", Role::Colour)? {
                    Some(Value::Texture(t)) => Some(t),
                    Some(_) => {
                        return Err(
                            p.invalid("'texture' must be a texture; a plain colour goes into 'intensity'")
                        );
                    }
                    None => None,
                };
                Light::Spot {
                    to_world: p.to_world()?,
                    intensity: self.light_colour(p, "intensity")?,
                    beam: beam.to_radians() as f32,
                    cutoff: cutoff.to_radians() as f32,
                    texture,
                }
            }
            "directional" => {
                let direction = match p.vector("direction")? {
                    Some(_) if p.has("to_world") => {
                        return Err(p.invalid("'direction' and 'to_world' cannot both be given"));
                    }
                    Some(d) => d.try_normalize().ok_or_else(|| p.invalid("'direction' cannot be zero"))?,
                    None => p.to_world()?.transform_vector3(Vec3::Z).normalize(),
                };
                Light::Directional { direction, irradiance: self.light_colour(p, "irradiance")? }
            }
            "constant" => Light::Constant { radiance: self.light_colour(p, "radiance")? },
            "envmap" => {
                p.accept(&["mis_compensation"]);
                let file = p.required_file("filename")?;
                let mut image = self.image(&file, false)?;
                if image.channels.len() == 1 {
                    let mut grey = Image::rgb(image.width, image.height);
                    grey.data = image.data.iter().flat_map(|v| [*v; 3]).collect();
                    image = Arc::new(grey);
                }
                let scale = p.float_in("scale", 1.0, |v| v >= 0.0, "0 or more")? as f32;
                Light::Environment { image, scale, to_world: p.to_world()? }
            }
            "projector" => self.projector(p)?,
            _ => return Err(p.unknown_plugin()),
        };
        p.finish()?;
        Ok(light)
    }

    fn projector(&mut self, p: Properties) -> Result<Light, Error> {
        let texture = match self.value(p, "irradiance", Role::Light)?.unwrap_or(Value::Number(1.0)) {
            Value::Texture(texture) => texture,
            Value::Rgb(c) => self.one_texel(c),
            Value::Number(v) => self.one_texel(Vec3::splat(v)),
        };
        // Only a bitmap has a shape of its own.
        let aspect = match &self.scene.textures[texture] {
            Texture::Image { image, .. } => image.width as f64 / image.height as f64,
            _ => 1.0,
        };
        let to_world: Mat4 = p.to_world()?;
        Ok(Light::Projector {
            to_world,
            texture,
            scale: p.float_in("scale", 1.0, |v| v >= 0.0, "0 or more")? as f32,
            fov_x: field_of_view(p, aspect)?.0 as f32,
        })
    }

    fn light_colour(&mut self, p: Properties, name: &'static str) -> Result<Vec3, Error> {
        match self.value(p, name, Role::Light)? {
            None => Ok(Vec3::ONE),
            Some(Value::Rgb(c)) => Ok(c),
            Some(Value::Number(v)) => Ok(Vec3::splat(v)),
            Some(Value::Texture(_)) => {
                Err(p.invalid(format!("'{name}' of a light that is no surface cannot vary; give a colour")))
            }
        }
    }
}
