//! Materials of Wavefront OBJ files. Alias|Wavefront 1995, Object Files and Material Library.

use super::folders::Folders;
use super::image;
use super::obj::Mtl;
use crate::scene::{Material, MaterialId, ModelBuilder, Scene, Texture, TextureFilter, Value, Wrap};
use crate::{Error, Place};
use glam::{Affine2, Vec3};
use std::path::Path;
use std::sync::Arc;
use yugen_optics::ColourSpace;
use yugen_reflectance::Kind;

/// Adds the material to the scene: a Lambertian `Kd` (or `map_Kd`) plus, where `Ks` is not black, a
/// normalised Blinn-Phong lobe of exponent `Ns`; `d` or `map_d` cut holes. Both sides look alike, because the
/// format says nothing about sides. The file's colours are linear sRGB, its pictures sRGB-encoded.
pub fn material(mtl: &Mtl, scene: &mut Scene, folders: &Folders, file: &Path) -> Result<MaterialId, Error> {
    let space = scene.working_space;
    let colour = |keyword| {
        let c: Option<Vec3> = mtl.colour(keyword);
        c.filter(|c| c.is_finite())
            .map(|c| ColourSpace::LinearSrgb.matrix_to(space) * c.clamp(Vec3::ZERO, Vec3::ONE))
            .map(|c| c.clamp(Vec3::ZERO, Vec3::ONE))
    };
    let mut texture = |keyword, raw| -> Result<Option<Value>, Error> {
        let Some(name) = mtl.file(keyword) else { return Ok(None) };
        // Folders are written both ways round.
        let path = folders.find(&name.replace('\\', "/"), Place::file(file))?;
        let options = image::ReadOptions { raw, ..image::ReadOptions::to(space) };
        scene.textures.push(Texture::Image {
            image: Arc::new(image::read(&path, &options)?),
            filter: TextureFilter::default(),
            wrap: Wrap::default(),
            to_uv: Affine2::IDENTITY,
            channel: None,
        });
        Ok(Some(Value::Texture(scene.textures.len() - 1)))
    };
    let diffuse = match texture("map_Kd", false)? {
        Some(texture) => texture,
        None => Value::Rgb(colour("Kd").unwrap_or(Vec3::splat(0.5))),
    };
    let holes = texture("map_d", true)?;
    let number = |keyword| mtl.colour(keyword).map(|c| c.x).filter(|v| v.is_finite());
    let opacity = number("d").or(number("Tr").map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0);
    let specular = colour("Ks").filter(|c| c.max_element() > 0.0);

    let failed = |e| Error::model(Place::file(file), e);
    let mut push = |material| {
        scene.materials.push(material);
        scene.materials.len() - 1
    };
    let mut id = push(Material::lambert(diffuse));
    if let Some(specular) = specular {
        let kind = Kind::from_name("blinn_phong").map_err(failed)?;
        let mut lobe = ModelBuilder::new(kind);
        lobe.set("specular", Value::Rgb(specular)).map_err(failed)?;
        let (_, exponent) = kind.param("exponent").map_err(failed)?;
        let n = number("Ns").unwrap_or(exponent.default[0]).clamp(exponent.min, exponent.max);
        lobe.set("exponent", Value::Number(n)).map_err(failed)?;
        let lobe = push(lobe.build().map_err(failed)?);
        id = push(Material::Sum(vec![id, lobe]));
    }
    id = push(Material::TwoSided { front: id, back: id });
    Ok(match (holes, opacity < 1.0) {
        (Some(opacity), _) => push(Material::Mask { opacity, base: id }),
        (None, true) => push(Material::Mask { opacity: Value::Number(opacity), base: id }),
        (None, false) => id,
    })
}
