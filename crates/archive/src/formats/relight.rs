//! RelightLab's folders for the web: `info.json` and a JPEG for every three planes, `plane_0.jpg` and on.
//!
//! A plane's value is (byte/255 − bias) · scale and a colour lies between 0 and 1. With the colour space `rgb` the
//! picture `plane_t.jpg` holds the red, green and blue coefficient of term t; with `lrgb` the first holds the fixed
//! colour and each further one the coefficients of three terms. Terms stand in the order of
//! [`super::relightable::Basis`], and the top row is the first.

use super::image::{ReadOptions, read_bytes};
use super::relightable::{Basis, Colouring, Relightable, admit};
use crate::{Error, Place, atomic_write, make_folder, read_bounded};
use serde::Deserialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// The file that makes a folder one of these.
pub const INFO: &str = "info.json";

/// Of a JPEG that is written; what JPEG loses at this quality is near to what the bytes lose.
const QUALITY: u8 = 95;

/// What `info.json` says, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    width: usize,
    height: usize,
    basis: Basis,
    colouring: Colouring,
    /// Of the pictures, without the dot.
    extension: String,
    scale: Vec<f32>,
    bias: Vec<f32>,
}

#[derive(Deserialize)]
struct Json {
    width: u64,
    height: u64,
    #[serde(rename = "type")]
    kind: String,
    colorspace: String,
    nplanes: u64,
    #[serde(default = "jpg")]
    format: String,
    materials: Vec<Material>,
}

#[derive(Deserialize)]
struct Material {
    scale: Vec<f32>,
    bias: Vec<f32>,
}

fn jpg() -> String {
    "jpg".into()
}

/// Reads `info.json`; more than `max_texels` are refused.
pub fn read_info(bytes: &[u8], file: &Path, max_texels: u64) -> Result<Info, Error> {
    let json: Json = serde_json::from_slice(bytes).map_err(|e| {
        let problem = format!("no RelightLab info: {}", super::json::problem(&e));
        Error::invalid(Place::line(file, e.line(), e.column()), problem)
    })?;
    let at = || Place::file(file);
    let invalid = |problem: String| Err(Error::invalid(at(), problem));
    let (width, height) = admit(at(), json.width, json.height, max_texels)?;
    let colouring = match json.colorspace.as_str() {
        "rgb" => Colouring::Rgb,
        "lrgb" => Colouring::Lrgb,
        "mrgb" | "ycc" | "mycc" => {
            let found = &json.colorspace;
            return invalid(format!(
                "the colour space '{found}' is not read; export the folder with rgb or lrgb"
            ));
        }
        other => return Err(Error::unknown(at(), "colour space", other, ["rgb", "lrgb"])),
    };
    let planes = json.nplanes;
    let terms = match colouring {
        Colouring::Rgb => planes / 3,
        Colouring::Lrgb => planes.saturating_sub(3),
    };
    let basis = match json.kind.as_str() {
        "ptm" => Basis::Ptm,
        "hsh" => match Basis::ALL.into_iter().find(|b| *b != Basis::Ptm && b.terms() as u64 == terms) {
            Some(basis) => basis,
            None => return invalid(format!("expected HSH of 4, 9 or 16 terms; {planes} planes are {terms}")),
        },
        "sh" | "h" | "rbf" | "bilinear" => {
            return invalid(format!(
                "the basis '{}' is not read; export the folder as ptm or hsh",
                json.kind
            ));
        }
        other => return Err(Error::unknown(at(), "basis", other, ["ptm", "hsh"])),
    };
    let expected = match colouring {
        Colouring::Rgb => 3 * basis.terms(),
        Colouring::Lrgb => 3 + basis.terms(),
    };
    if planes != expected as u64 {
        return invalid(format!(
            "{} with the colour space '{}' has {expected} planes; found {planes}",
            basis.name(),
            json.colorspace
        ));
    }
    if !["jpg", "jpeg", "png"].contains(&json.format.as_str()) {
        return invalid(format!("pictures of the format '{}' are not read; expected jpg", json.format));
    }
    let [material] = json.materials.as_slice() else {
        return invalid(format!("expected one material, found {}", json.materials.len()));
    };
    for (what, list) in [("scale", &material.scale), ("bias", &material.bias)] {
        if list.len() != expected || list.iter().any(|v| !v.is_finite()) {
            return invalid(format!("expected {expected} finite numbers as '{what}', found {}", list.len()));
        }
    }
    let (scale, bias) = (material.scale.clone(), material.bias.clone());
    Ok(Info { width, height, basis, colouring, extension: json.format, scale, bias })
}

/// Reads a folder; more than `max_texels` are refused before memory is asked for.
pub fn read(folder: &Path, max_texels: u64) -> Result<Relightable, Error> {
    let path = folder.join(INFO);
    let info = read_info(&read_bounded(&path, 1 << 24)?, &path, max_texels)?;
    let Info { width, height, basis, colouring, .. } = info;
    let mut r = Relightable { width, height, basis, colouring, coefficients: Vec::new() };
    let stride = r.stride();
    r.coefficients = vec![0.0; width * height * stride];
    let options = ReadOptions { max_samples: 3 * (width * height) as u64, ..ReadOptions::raw() };
    for picture in 0..stride.div_ceil(3) {
        let path = folder.join(format!("plane_{picture}.{}", info.extension));
        if picture == 0
            && !path.exists()
            && (folder.join("plane_0.dzi").exists() || folder.join("plane_0.tzi").exists())
        {
            let problem = "this folder holds tiles, which are not read; export it as plain pictures";
            return Err(Error::invalid(Place::file(folder), problem));
        }
        let bytes = read_bounded(&path, options.max_samples.saturating_mul(2).max(1 << 20))?;
        let image = read_bytes(&bytes, &path, &options)?;
        if (image.width, image.height, image.channels.len()) != (width, height, 3) {
            let problem = format!(
                "expected {width} x {height} pixels of 3 channels, as {INFO} says; found {} x {} of {}",
                image.width,
                image.height,
                image.channels.len()
            );
            return Err(Error::invalid(Place::file(path), problem));
        }
        for (texel, pixel) in r.coefficients.chunks_exact_mut(stride).zip(image.data.chunks_exact(3)) {
            let planes = texel.iter_mut().enumerate().skip(3 * picture).take(3);
            for ((plane, v), byte) in planes.zip(pixel) {
                *v = (byte - info.bias[plane]) * info.scale[plane];
            }
        }
    }
    Ok(r)
}

/// The files of a folder with so many planes.
pub(super) fn files(folder: &Path, planes: usize) -> Vec<PathBuf> {
    let pictures = (0..planes.div_ceil(3)).map(|i| folder.join(format!("plane_{i}.jpg")));
    pictures.chain([folder.join(INFO)]).collect()
}

/// Writes a folder, which is made where it is missing; `info.json` comes last, so that a folder with one is whole.
pub fn write(folder: &Path, r: &Relightable) -> Result<(), Error> {
    r.check(folder)?;
    let stride = r.stride();
    let mut ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; stride];
    for texel in r.coefficients.chunks_exact(stride) {
        for (range, &v) in ranges.iter_mut().zip(texel) {
            *range = [range[0].min(v), range[1].max(v)];
        }
    }
    if r.colouring == Colouring::Lrgb {
        // The fixed colour is a picture of its own.
        ranges[..3].fill([0.0, 1.0]);
    }
    // A plane that never changes has no scale to divide by.
    let scale: Vec<f32> = ranges.iter().map(|[lo, hi]| if hi - lo > 1e-30 { hi - lo } else { 1.0 }).collect();
    let bias: Vec<f32> = ranges.iter().zip(&scale).map(|([lo, _], s)| -lo / s).collect();

    make_folder(folder)?;
    let size = |n: usize| {
        let problem = format!("{n} texels are too many across or down for a JPEG; expected at most 65535");
        u16::try_from(n).map(u32::from).map_err(|_| Error::invalid(Place::file(folder), problem))
    };
    let (width, height) = (size(r.width)?, size(r.height)?);
    let mut bytes = vec![0; r.width * r.height * 3];
    for picture in 0..stride.div_ceil(3) {
        bytes.fill(0);
        for (pixel, texel) in bytes.chunks_exact_mut(3).zip(r.coefficients.chunks_exact(stride)) {
            for (byte, plane) in pixel.iter_mut().zip(3 * picture..stride) {
                *byte = (255.0 * (texel[plane] / scale[plane] + bias[plane])).round() as u8;
            }
        }
        let path = folder.join(format!("plane_{picture}.jpg"));
        let mut jpeg = Vec::new();
        ::image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
            .encode(&bytes, width, height, ::image::ExtendedColorType::Rgb8)
            .map_err(|e| Error::invalid(Place::file(&path), e.to_string()))?;
        atomic_write(&path, &jpeg)?;
    }
    let info = json!({
        "width": r.width,
        "height": r.height,
        "format": "jpg",
        "type": match r.basis { Basis::Ptm => "ptm", Basis::Hsh { .. } => "hsh" },
        "colorspace": match r.colouring { Colouring::Rgb => "rgb", Colouring::Lrgb => "lrgb" },
        "nplanes": stride,
        "quality": QUALITY,
        "materials": [{ "scale": scale, "bias": bias }],
    });
    atomic_write(&folder.join(INFO), format!("{info:#}\n").as_bytes())
}

#[cfg(test)]
mod tests {
    use super::super::relightable::DEFAULT_MAX_TEXELS;
    use super::super::relightable::tests::{quanta, sample};
    use super::*;

    /// Waves of some texels' length: what JPEG is made for.
    fn smooth(basis: Basis, colouring: Colouring) -> Relightable {
        let mut r = sample(basis, colouring, 40, 24);
        let stride = r.stride();
        for (i, v) in r.coefficients.iter_mut().enumerate() {
            let (texel, k) = (i / stride, (i % stride) as f32);
            let (x, y) = ((texel % 40) as f32, (texel / 40) as f32);
            *v = 0.5 + 0.4 * (0.2 * x + k).sin() * (0.3 * y).cos();
        }
        r
    }

    #[test]
    fn folders_come_back() {
        let folder = std::env::temp_dir().join(format!("yugen-relight-{}", std::process::id()));
        for (basis, colouring) in [
            (Basis::Ptm, Colouring::Rgb),
            (Basis::Ptm, Colouring::Lrgb),
            (Basis::Hsh { order: 3 }, Colouring::Rgb),
            (Basis::Hsh { order: 2 }, Colouring::Lrgb),
        ] {
            let r = smooth(basis, colouring);
            write(&folder, &r).unwrap();
            let back = read(&folder, DEFAULT_MAX_TEXELS).unwrap();
            // Half a level for the byte and what JPEG loses; measured 9.3, with planes that are unlike each other.
            assert!(quanta(&r, &back) < 36.0, "{basis:?} {colouring:?} {}", quanta(&r, &back));
        }
        std::fs::write(folder.join("plane_1.jpg"), b"no picture").unwrap();
        assert!(read(&folder, 1000).unwrap_err().to_string().contains("plane_1.jpg"));
        std::fs::remove_file(folder.join("plane_1.jpg")).unwrap();
        assert!(read(&folder, 1000).unwrap_err().to_string().contains("plane_1.jpg"));
        std::fs::rename(folder.join("plane_0.jpg"), folder.join("plane_0.dzi")).unwrap();
        assert!(read(&folder, 1000).unwrap_err().to_string().contains("holds tiles"));
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(read(&folder, 1000).unwrap_err().to_string().contains(INFO));
    }

    #[test]
    fn bad_infos_get_a_sentence() {
        let good = r#"{"width": 4, "height": 2, "type": "ptm", "colorspace": "lrgb", "nplanes": 9,
"materials": [{"scale": [1,1,1,1,1,1,1,1,1], "bias": [0,0,0,0,0,0,0,0,0]}]}"#;
        let parse = |text: &str| read_info(text.as_bytes(), Path::new("info.json"), 1000);
        assert_eq!(parse(good).unwrap().basis, Basis::Ptm);
        for (from, to, want) in [
            ("4,", "0,", "info.json: the picture is empty (0 x 2)"),
            ("4,", "4000000000,", "the number of texels (4000000000 x 2)"),
            ("4,", "-4,", "info.json:1:12: no RelightLab info: found -4, expected a whole number, 0 or more"),
            ("\"width\": 4, ", "", "missing field 'width'"),
            ("ptm", "ptn", "unknown basis 'ptn'; did you mean 'ptm'?"),
            ("ptm", "rbf", "the basis 'rbf' is not read"),
            ("ptm", "hsh", "expected HSH of 4, 9 or 16 terms; 9 planes are 6"),
            ("lrgb", "mycc", "the colour space 'mycc' is not read"),
            ("lrgb", "rgb", "PTM with the colour space 'rgb' has 18 planes; found 9"),
            ("nplanes\": 9", "nplanes\": 8", "has 9 planes; found 8"),
            ("[0,0,", "[0,", "expected 9 finite numbers as 'bias', found 8"),
            ("[1,1,", "[1e300,1,", "expected 9 finite numbers as 'scale'"),
            ("[{", "[], \"x\": [{", "expected one material, found 0"),
        ] {
            assert!(good.contains(from));
            let got = parse(&good.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(got.contains(want), "{from} -> {to}: {got}");
        }
    }
}
