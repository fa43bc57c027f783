//! The maps of a cloth as a glTF 2.0 material, and how much is lost on the way.
//!
//! glTF has anisotropic GGX for the highlight where the maps have a Gaussian of slopes, and a texel is a metal or a
//! dielectric. Metals are the texels without a ground; the others get ρ_s as reflectance head on, up to the .25 of an
//! index of 3. GGX has longer tails than a Gaussian: the widths are made somewhat larger, and the reflectance with them
//! so that the peak stays, by the factor that comes nearest over the whole cloth.

use super::maps::save_numbers;
use crate::formats::image::{WriteOptions, write};
use crate::{Error, atomic_write};
use glam::{Vec2, Vec3};
use serde_json::json;
use std::f32::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use yugen_optics::frame::spherical;
use yugen_optics::{ColourSpace, Frame, Image};
use yugen_reflectance::btf::{Btf, Texel};
use yugen_reflectance::{Bsdf, Choice, Kind};

/// What became of the maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// Root mean square difference of radiance, as a part of the root mean square radiance, over texels and over lights
    /// on the upper hemisphere, seen head on.
    pub relative: f32,
    /// Factor on the widths.
    pub widening: f32,
    /// Texels whose ρ_s is more than glTF gives a dielectric, or more than 1.
    pub clipped: usize,
}

/// What glTF says of a texel.
struct Converted {
    base: Vec3,
    metallic: f32,
    roughness: f32,
    /// Along the tangent, in its plane.
    direction: Vec2,
    strength: f32,
    specular: Vec3,
}

/// Index of refraction of the dielectric texels, and its reflectance head on.
const IOR: f32 = 3.0;
const F0: f32 = 0.25;

/// A texel with a ground less than this part of its highlight is metal.
const METAL: f32 = 0.1;

impl Converted {
    fn of(t: &Texel, widening: f32) -> Self {
        let metal = t.diffuse.element_sum() < METAL * t.specular.element_sum();
        let specular = t.specular * (widening * widening);
        let alpha = (t.sigma * widening).clamp(Vec2::splat(0.02), Vec2::ONE);
        let (long, short) = (alpha.max_element(), alpha.min_element());
        let along = if t.sigma.x >= t.sigma.y { t.tangent } else { t.normal.cross(t.tangent) };
        Self {
            base: if metal { specular } else { t.diffuse / (1.0 - t.specular.max_element().clamp(0.0, F0)) }
                .clamp(Vec3::ZERO, Vec3::ONE),
            metallic: f32::from(u8::from(metal)),
            roughness: short.sqrt(),
            direction: along.truncate().normalize_or(Vec2::X),
            strength: ((long - short) / (1.0 - short).max(1e-3)).max(0.0).sqrt().min(1.0),
            specular: if metal { Vec3::ONE } else { (specular / F0).clamp(Vec3::ZERO, Vec3::ONE) },
        }
    }

    fn slots(&self) -> Vec<f32> {
        let kind = Kind::MetallicRoughness;
        let mut slots = kind.defaults();
        let mut set = |name: &str, values: &[f32]| {
            if let Ok((at, _)) = kind.param(name) {
                slots[at..at + values.len()].copy_from_slice(values);
            }
        };
        set("base_color", &self.base.to_array());
        set("metallic", &[self.metallic]);
        set("roughness", &[self.roughness]);
        set("anisotropy", &[self.strength]);
        set("specular_color", &self.specular.to_array());
        set("ior", &[IOR]);
        slots
    }
}

/// How much `maps` lose in glTF with widths larger by this factor.
fn loss(maps: &Btf, widening: f32) -> f32 {
    // A few thousand texels and a hundred lights say it to two digits.
    let step = (maps.texels.len() / 1009).max(1);
    let (mut difference, mut whole) = (0.0f64, 0.0f64);
    for t in maps.texels.iter().step_by(step) {
        let converted = Converted::of(t, widening);
        let slots = converted.slots();
        let gltf = Bsdf::new(Kind::MetallicRoughness, &slots, &[]);
        let noh = t.noh(Choice(0.0));
        let noh: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&noh));
        let truth = Bsdf::new(Kind::Noh, noh, &[]);
        let (own, turned) =
            (t.frame(), Frame::from_normal_tangent(t.normal, converted.direction.extend(0.0)));
        for i in 0..100 {
            let z = 1.0 - (i as f32 + 0.5) / 100.0;
            let light = spherical(z.acos(), TAU * 0.381_966 * i as f32);
            let of = |bsdf: &Bsdf, frame: &Frame| {
                let wi = frame.to_local(light);
                bsdf.eval(frame.to_local(Vec3::Z), wi) * (PI * wi.z.max(0.0))
            };
            let (got, want) = (of(&gltf, &turned), of(&truth, &own));
            difference += f64::from((got - want).length_squared());
            whole += f64::from(want.length_squared());
        }
    }
    (difference / whole.max(1e-12)).sqrt() as f32
}

const PICTURES: [&str; 5] =
    ["base_color.png", "roughness_metallic.png", "normal_gltf.png", "anisotropy.png", "specular_color.png"];

/// What [`save`] writes.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    PICTURES.iter().chain(&["cloth.bin", "cloth.gltf"]).map(|name| folder.join(name)).collect()
}

/// Writes `cloth.gltf` with its pictures into a folder that is there: a material on a square as wide as the cloth
/// (a metre, where its size is not known).
pub fn save(folder: &Path, maps: &Btf, texel_mm: Option<f32>) -> Result<Loss, Error> {
    let factors = (0..=10).map(|i| 1.0 + 0.04 * i as f32);
    let (relative, widening) =
        factors.map(|f| (loss(maps, f), f)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 1.0));
    let to_srgb = maps.colour_space.matrix_to(ColourSpace::LinearSrgb);
    let convert = |t: &Texel| {
        let srgb = Texel { diffuse: to_srgb * t.diffuse, specular: to_srgb * t.specular, ..*t };
        (Converted::of(&srgb, widening), srgb)
    };
    let (w, h) = (maps.width, maps.height);
    let colour = |name: &str, of: &dyn Fn(&Converted) -> Vec3| {
        let mut image = Image::rgb(w, h);
        for (pixel, t) in image.data.chunks_exact_mut(3).zip(&maps.texels) {
            pixel.copy_from_slice(&of(&convert(t).0).to_array());
        }
        write(&folder.join(name), &image, &WriteOptions::from(ColourSpace::LinearSrgb))
    };
    let numbers = |name: &str, of: &dyn Fn(&Converted, &Texel) -> Vec3| {
        let values = maps.texels.iter().map(|t| {
            let (c, t) = convert(t);
            of(&c, &t)
        });
        save_numbers(&folder.join(name), w, h, 8, values)
    };
    colour("base_color.png", &|c| c.base)?;
    colour("specular_color.png", &|c| c.specular)?;
    numbers("roughness_metallic.png", &|c, _| Vec3::new(0.0, c.roughness, c.metallic))?;
    numbers("normal_gltf.png", &|_, t| (t.normal + 1.0) * 0.5)?;
    numbers("anisotropy.png", &|c, _| (c.direction * 0.5 + 0.5).extend(c.strength))?;

    let size = texel_mm.map_or(1.0, |mm| 1e-3 * mm * w as f32);
    let (x, y) = (0.5 * size, 0.5 * size * h as f32 / w as f32);
    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
    let mut bytes = Vec::new();
    let mut put = |values: &[f32]| bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    corners.iter().for_each(|[x, y]| put(&[*x, *y, 0.0]));
    corners.iter().for_each(|_| put(&[0.0, 0.0, 1.0]));
    corners.iter().for_each(|_| put(&[1.0, 0.0, 0.0, 1.0]));
    [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].iter().for_each(|uv| put(uv));
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    let view = |at: usize, length: usize| json!({ "buffer": 0, "byteOffset": at, "byteLength": length });
    let floats = |view: usize, kind: &str| json!({ "bufferView": view, "componentType": 5126, "count": 4, "type": kind });
    let mut positions = floats(0, "VEC3");
    (positions["min"], positions["max"]) = (json!([-x, -y, 0.0]), json!([x, y, 0.0]));
    let document = json!({
        "asset": { "version": "2.0", "generator": format!("Yugen {}", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed": ["KHR_materials_anisotropy", "KHR_materials_specular", "KHR_materials_ior"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "cloth" }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TANGENT": 2, "TEXCOORD_0": 3 },
            "indices": 4,
            "material": 0,
        }] }],
        "materials": [{
            "name": "cloth",
            "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": 0 },
                "metallicRoughnessTexture": { "index": 1 },
            },
            "normalTexture": { "index": 2 },
            "extensions": {
                "KHR_materials_anisotropy": { "anisotropyStrength": 1.0, "anisotropyTexture": { "index": 3 } },
                "KHR_materials_specular": { "specularColorTexture": { "index": 4 } },
                "KHR_materials_ior": { "ior": IOR },
            },
            "extras": { "relative_rms_error": relative, "widening": widening },
        }],
        "textures": (0..PICTURES.len()).map(|i| json!({ "source": i, "sampler": 0 })).collect::<Vec<_>>(),
        "samplers": [{ "magFilter": 9729, "minFilter": 9987 }],
        "images": PICTURES.map(|uri| json!({ "uri": uri })),
        "buffers": [{ "uri": "cloth.bin", "byteLength": bytes.len() }],
        "bufferViews": [view(0, 48), view(48, 48), view(96, 64), view(160, 32), view(192, 12)],
        "accessors": [
            positions, floats(1, "VEC3"), floats(2, "VEC4"), floats(3, "VEC2"),
            { "bufferView": 4, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
    });
    atomic_write(&folder.join("cloth.bin"), &bytes)?;
    atomic_write(&folder.join("cloth.gltf"), format!("{document:#}\n").as_bytes())?;
    let clipped = maps.texels.iter().filter(|t| {
        let (c, t) = convert(t);
        let most = t.specular.max_element() * widening * widening;
        most > if c.metallic > 0.5 { 1.0 } else { F0 }
    });
    Ok(Loss { relative, widening, clipped: clipped.count() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::load_scene;
    use yugen_scene::Material;

    #[test]
    fn the_material_is_read_back_and_the_loss_is_what_it_says() {
        let folder = std::env::temp_dir().join(format!("yugen-btf-gltf-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let texel = |i: usize| {
            let gold = i.is_multiple_of(2);
            let frame = Frame::from_normal_tangent(
                Vec3::new(0.1 * (i % 5) as f32 - 0.2, 0.1, 1.0).normalize(),
                Vec3::new((0.3 * i as f32).cos(), (0.3 * i as f32).sin(), 0.0),
            );
            Texel {
                diffuse: if gold { Vec3::ZERO } else { Vec3::new(0.4, 0.05, 0.03) },
                specular: if gold { Vec3::new(0.8, 0.6, 0.3) } else { Vec3::splat(0.1) },
                normal: frame.n,
                tangent: frame.s,
                sigma: Vec2::new(0.35, 0.15),
                confidence: 1.0,
            }
        };
        let texels = (0..48).map(texel).collect();
        let maps = Btf { width: 8, height: 6, colour_space: ColourSpace::LinearSrgb, texels };
        let lost = save(&folder, &maps, Some(0.1)).unwrap();
        // 0.11 with the best widths; without widening more.
        assert!(lost.relative > 0.01 && lost.relative < 0.3, "{lost:?}");
        assert!(loss(&maps, lost.widening) <= loss(&maps, 1.0));
        let scene = load_scene(&folder.join("cloth.gltf"), &crate::formats::Options::default()).unwrap();
        assert!(scene.materials.iter().any(|m| matches!(m, Material::NormalMap { .. })));
        assert_eq!(scene.shapes.len(), 1);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
