//! A cloth's maps in one OpenEXR picture that ordinary tools open.
//!
//! Channels `diffuse.R/G/B`, `specular.R/G/B`, `normal.X/Y/Z`, `tangent.X/Y/Z`, `sigma.X/Y` and `confidence.Y` of
//! [`Texel`], signed where they are signed; text attributes `yugen.*` say what they mean. The name may end in `.btf`
//! or in `.exr`: the content is the same.

pub mod gltf;
pub mod maps;

use super::image::{self, ReadOptions, WriteOptions};
use crate::{Error, Place, atomic_write, read_filled};
use ::exr::meta::MetaData;
use ::exr::meta::attribute::AttributeValue;
use glam::{Vec2, Vec3};
use std::io::Cursor;
use std::path::Path;
use yugen_optics::{ColourSpace, Frame, Image};
use yugen_reflectance::btf::{Btf, Texel};

/// Every channel, in the order of [`Texel`].
pub const CHANNELS: [&str; 15] = [
    "diffuse.R",
    "diffuse.G",
    "diffuse.B",
    "specular.R",
    "specular.G",
    "specular.B",
    "normal.X",
    "normal.Y",
    "normal.Z",
    "tangent.X",
    "tangent.Y",
    "tangent.Z",
    "sigma.X",
    "sigma.Y",
    "confidence.Y",
];

/// The version of the format that is written.
const VERSION: &str = "1";
const MODEL: &str = "noh";
const FRAME: &str = "+x right, +y up, +z to the camera, right-handed";

/// What a file says about its maps.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// The form of the model `noh` whose highlight the numbers were fitted to or made for.
    pub form: String,
    /// Width of a texel on the cloth in millimetres, if known.
    pub texel_mm: Option<f32>,
    /// How many photographs or readings of each texel the numbers come from; 0 where they were not measured.
    pub lights: usize,
    /// Where the maps come from, for people.
    pub source: String,
}

impl Default for About {
    fn default() -> Self {
        Self { form: "ward_gmd".into(), texel_mm: None, lights: 0, source: String::new() }
    }
}

/// The most texels that are read: 16384 × 8192, eight gigabytes of maps.
const MAX_TEXELS: u64 = 1 << 27;

/// Reads the maps in a file, colours in `space`.
pub fn load(path: &Path, space: ColourSpace) -> Result<(Btf, About), Error> {
    let max_samples = MAX_TEXELS * CHANNELS.len() as u64;
    let options = ReadOptions { max_samples, ..ReadOptions::to(space) };
    read(&read_filled(path, 4 * max_samples)?, path, &options)
}

/// Reads maps from memory, colours in the space of the options; `name` is for messages. Where the numbers of a texel make no sense
/// (no normal, a width that is not positive) it becomes a flat black one with confidence 0.
pub fn read(bytes: &[u8], name: &Path, options: &ReadOptions) -> Result<(Btf, About), Error> {
    let about = read_about(bytes, name)?;
    let image = image::read_bytes(bytes, name, &ReadOptions { raw: false, ..options.clone() })?;
    let missing: Vec<&str> = CHANNELS.into_iter().filter(|c| image.channel(c).is_none()).collect();
    if !missing.is_empty() {
        let problem = format!("the maps of a cloth need the channels {} as well", missing.join(", "));
        return Err(Error::invalid(Place::file(name), problem));
    }
    let at = CHANNELS.map(|c| image.channel(c).unwrap_or_default());
    let mut spoilt = 0;
    let texels = image.data.chunks_exact(image.channels.len()).map(|pixel| {
        texel(at.map(|c| pixel[c])).unwrap_or_else(|| {
            spoilt += 1;
            NOTHING
        })
    });
    let texels = texels.collect();
    if spoilt > 0 {
        tracing::warn!("{}: {spoilt} texels have no usable normal, tangent or width", name.display());
    }
    Ok((Btf { width: image.width, height: image.height, colour_space: options.space, texels }, about))
}

/// What stands where a file or a fit has nothing to say.
pub const NOTHING: Texel = Texel {
    diffuse: Vec3::ZERO,
    specular: Vec3::ZERO,
    normal: Vec3::Z,
    tangent: Vec3::X,
    sigma: Vec2::splat(0.3),
    confidence: 0.0,
};

fn texel(v: [f32; 15]) -> Option<Texel> {
    let [dr, dg, db, sr, sg, sb, nx, ny, nz, tx, ty, tz, x, y, confidence] = v;
    let (n, t, sigma) = (Vec3::new(nx, ny, nz), Vec3::new(tx, ty, tz), Vec2::new(x, y));
    let normal = n.try_normalize()?;
    // Rounding to halves or an edit in another program may have left the two not quite perpendicular.
    let frame = Frame::from_normal_tangent(normal, t);
    let usable = t.length_squared() > 1e-6 && sigma.min_element() > 0.0;
    // Unit vectors that are unit already stay as they are, so that a copy has the same bits.
    let whole = (n.length_squared() - 1.0).abs() < 1e-5
        && (t.length_squared() - 1.0).abs() < 1e-5
        && n.dot(t).abs() < 1e-5;
    usable.then_some(Texel {
        diffuse: Vec3::new(dr, dg, db),
        specular: Vec3::new(sr, sg, sb),
        normal: if whole { n } else { frame.n },
        tangent: if whole { t } else { frame.s },
        sigma,
        confidence: confidence.clamp(0.0, 1.0),
    })
}

/// What the header says.
fn read_about(bytes: &[u8], name: &Path) -> Result<About, Error> {
    let invalid = |problem: String| Error::invalid(Place::file(name), problem);
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|_| invalid("this is no OpenEXR picture, and so not the maps of a cloth".into()))?;
    let text = |key: &str| {
        meta.headers.iter().find_map(|h| {
            h.shared_attributes.other.iter().chain(&h.own_attributes.other).find_map(|(k, v)| match v {
                AttributeValue::Text(text) if k == key => Some(text.to_string()),
                _ => None,
            })
        })
    };
    if let Some(version) = text("yugen.btf").filter(|v| v != VERSION) {
        return Err(invalid(format!(
            "version {version} of the maps is not known; this program reads {VERSION}"
        )));
    }
    if let Some(model) = text("yugen.model").filter(|m| m != MODEL) {
        return Err(invalid(format!("the maps are for the model '{model}'; expected '{MODEL}'")));
    }
    let default = About::default();
    Ok(About {
        form: text("yugen.form").unwrap_or(default.form),
        texel_mm: text("yugen.texel_mm").and_then(|v| v.parse().ok()).filter(|v: &f32| *v > 0.0),
        lights: text("yugen.lights").and_then(|v| v.parse().ok()).unwrap_or(0),
        source: text("yugen.source").unwrap_or_default(),
    })
}

/// The bytes of a file with these maps, as 32-bit floats.
pub fn write(btf: &Btf, about: &About) -> Result<Vec<u8>, Error> {
    let mut metadata: Vec<(String, String)> = [
        ("yugen.btf", VERSION),
        ("yugen.model", MODEL),
        ("yugen.form", about.form.as_str()),
        ("yugen.colour_space", btf.colour_space.name()),
        ("yugen.frame", FRAME),
        ("yugen.sigma", "root mean square slope times sqrt(2): X along the tangent, Y across"),
        ("yugen.source", about.source.as_str()),
    ]
    .map(|(k, v)| (k.to_string(), v.to_string()))
    .to_vec();
    metadata.push(("yugen.lights".into(), about.lights.to_string()));
    metadata.extend(about.texel_mm.map(|mm| ("yugen.texel_mm".into(), mm.to_string())));
    let options = WriteOptions { metadata, ..WriteOptions::from(btf.colour_space) };
    image::write_bytes(Path::new("btf.exr"), &image(btf), &options)
}

/// Writes the maps to a file, whole or not at all.
pub fn save(path: &Path, btf: &Btf, about: &About) -> Result<(), Error> {
    atomic_write(path, &write(btf, about)?)
}

/// The maps as one picture with [`CHANNELS`].
pub fn image(btf: &Btf) -> Image {
    let values = |t: &Texel| {
        let Texel { diffuse: d, specular: s, normal: n, tangent: a, sigma, confidence } = *t;
        [d.x, d.y, d.z, s.x, s.y, s.z, n.x, n.y, n.z, a.x, a.y, a.z, sigma.x, sigma.y, confidence]
    };
    Image {
        width: btf.width,
        height: btf.height,
        channels: CHANNELS.map(String::from).to_vec(),
        data: btf.texels.iter().flat_map(values).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> Btf {
        let texels = (0..35).map(|i| {
            let a = 0.3 * i as f32;
            let frame = Frame::from_normal_tangent(
                Vec3::new(0.2 * a.sin(), 0.1 * a.cos(), 1.0).normalize(),
                Vec3::new(a.cos(), a.sin(), 0.0),
            );
            Texel {
                diffuse: Vec3::new(0.3, 0.02 * a, 0.1),
                specular: Vec3::new(0.7, 0.6, 0.1 * a),
                normal: frame.n,
                tangent: frame.s,
                sigma: Vec2::new(0.4, 0.1 + 0.01 * a),
                confidence: 0.01 * i as f32,
            }
        });
        Btf { width: 7, height: 5, colour_space: ColourSpace::LinearRec2020, texels: texels.collect() }
    }

    #[test]
    fn maps_come_back_bit_for_bit_and_colours_change_space() {
        let btf = small();
        let about = About {
            form: "ggx".into(),
            texel_mm: Some(0.05),
            lights: 50,
            source: "a draft, thread by thread".into(),
        };
        let bytes = write(&btf, &about).unwrap();
        let (back, told) = read(&bytes, Path::new("a.btf"), &ReadOptions::to(btf.colour_space)).unwrap();
        assert_eq!((back, told), (btf.clone(), about));
        let (srgb, _) = read(&bytes, Path::new("a.btf"), &ReadOptions::to(ColourSpace::LinearSrgb)).unwrap();
        let m = btf.colour_space.matrix_to(ColourSpace::LinearSrgb);
        for (a, b) in srgb.texels.iter().zip(&btf.texels) {
            assert!(
                (a.diffuse - m * b.diffuse).length() < 1e-5 && (a.specular - m * b.specular).length() < 1e-5
            );
            assert_eq!((a.normal, a.tangent, a.sigma), (b.normal, b.tangent, b.sigma));
        }
    }

    #[test]
    fn a_spoilt_texel_is_flat_and_black_and_a_crooked_one_is_set_right() {
        let mut btf = small();
        btf.texels[3].normal = Vec3::ZERO;
        btf.texels[4].sigma.y = f32::NAN;
        btf.texels[5].tangent = Vec3::new(1.0, 0.5, 0.3);
        btf.texels[5].normal *= 0.5;
        let (back, _) = read(
            &write(&btf, &About::default()).unwrap(),
            Path::new("a"),
            &ReadOptions::to(btf.colour_space),
        )
        .unwrap();
        assert_eq!(back.texels[3..5], [NOTHING; 2]);
        let t = back.texels[5];
        assert!(t.normal.dot(t.tangent).abs() < 1e-6 && (t.normal.length() - 1.0).abs() < 1e-6);
        assert!((t.tangent.length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn other_pictures_get_a_sentence() {
        let say = |bytes: &[u8]| {
            read(bytes, Path::new("a.btf"), &ReadOptions::to(ColourSpace::LinearSrgb))
                .unwrap_err()
                .to_string()
        };
        assert!(say(b"PNG").starts_with("a.btf: this is no OpenEXR picture"));
        let options = WriteOptions::default();
        let rgb = image::write_bytes(Path::new("x.exr"), &Image::rgb(2, 2), &options).unwrap();
        assert!(say(&rgb).starts_with("a.btf: the maps of a cloth need the channels diffuse.R, diffuse.G"));
        let with = |key: &str, value: &str| {
            let metadata = vec![(key.to_string(), value.to_string())];
            let options = WriteOptions { metadata, ..WriteOptions::default() };
            image::write_bytes(Path::new("x.exr"), &image(&small()), &options).unwrap()
        };
        assert_eq!(
            say(&with("yugen.btf", "2")),
            "a.btf: version 2 of the maps is not known; this program reads 1"
        );
        assert_eq!(
            say(&with("yugen.model", "phong")),
            "a.btf: the maps are for the model 'phong'; expected 'noh'"
        );
    }
}
