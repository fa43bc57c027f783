//! RelightLab's folders for the web: `info.json` and a picture for every three planes, `plane_0.jpg` and on, whole or
//! in [tiles].
//!
//! A plane's value is (byte/255 − bias) · scale and a colour lies between 0 and 1; the top row is the first. What the
//! planes are says the colour space:
//! * `rgb`: the picture `plane_t` holds the red, green and blue coefficient of term t; terms stand in the order of
//!   [`super::relightable::Basis`].
//! * `lrgb`: the first picture holds the fixed colour, as it is, and each further one the coefficients of three terms.
//! * `ycc`: the first channel of `plane_t` is the coefficient of term t of a luminance; the second and third of
//!   `plane_0` are Cb and Cr.
//! * `mrgb`: principal components. Under each light of a list (`rbf`) or of a grid (`bilinear`) a colour of its own
//!   belongs to each plane, and one to all; see [`super::mixed`].
//! * `mycc`: the same with Y, Co, Cg (Malvar and Sullivan 2003, "YCoCg-R") instead of colours. `yccplanes` says how many
//!   planes are of each: Y, Co and Cg alternate until Co and Cg have all of theirs, then the rest of Y follows.

mod pyramid;
pub mod tiles;

pub use pyramid::Layout;

use super::gathered::Gathered;
use super::mixed::{Between, Functions, Mixed};
use super::relightable::{Basis, Colouring, Relightable, admit};
use super::relit_contents::Contents;
use super::support::{Feature, Support, find};
use crate::{Error, Place, atomic_write, make_folder, read_bounded};
use glam::Vec3;
use serde::Deserialize;
use serde_json::json;
use std::path::{Path, PathBuf};
use tiles::Picture;

/// The file that makes a folder one of these.
pub const INFO: &str = "info.json";

/// Where older folders keep the colours of principal components.
const MATERIALS: &str = "materials.bin";

/// Of a JPEG that is written; what JPEG loses at this quality is near to what the bytes lose.
const QUALITY: u8 = 95;

/// The most planes that are read; viewers, which need a texture for every three, take some tens.
const MAX_PLANES: u64 = 192;

/// Numbers a texel of as many texels as may be read; where there are more, fewer texels are read.
const MOST_NUMBERS: u64 = 48;

/// The most lights between which colours are interpolated: as many as a dome may have, and a grid of 128 by 128.
const MAX_LIGHTS: u64 = 1 << 14;

/// What RelightLab takes where a file names none.
const DEFAULT_SIGMA: f32 = 0.125;

/// The colour profile of values that are proportional to light, and of those that are not.
const LINEAR: &str = "RGB";
const DISPLAY: &str = "sRGB";

/// What is read.
pub const FEATURES: &[Feature] = &[
    Feature::partly("type: ptm", "no degrees above two"),
    Feature::yes("type: hsh"),
    Feature::yes("type: rbf"),
    Feature::yes("type: bilinear"),
    Feature::yes("type: bln"),
    Feature::no("type: sh", "programs disagree about which of its terms is x and which y"),
    Feature::no("type: h", "no program is known that evaluates it"),
    Feature::no("type: dmd", "no program is known that evaluates it"),
    Feature::no("type: neural", "networks are not supported"),
    Feature::yes("colorspace: rgb"),
    Feature::yes("colorspace: lrgb"),
    Feature::yes("colorspace: ycc"),
    Feature::yes("colorspace: mrgb"),
    Feature::yes("colorspace: mycc"),
    Feature::yes("colorprofile: sRGB"),
    Feature::yes("colorprofile: RGB"),
    Feature::partly("colorprofile: P3", "colours are taken for those of sRGB, and come out too pale"),
    Feature::yes("layout: image"),
    Feature::yes("layout: deepzoom"),
    Feature::yes("layout: tarzoom"),
    Feature::yes("layout: itarzoom"),
    Feature::partly("layout: zoomify", "no numbering of tiles but Zoomify's and RelightLab's"),
    Feature::partly("layout: google", "no tiles of other sizes than 256 pixels"),
    Feature::partly("layout: iiif", "the files of a server of level 0, in the folders plane_N"),
    Feature::no("layout: iip", "it is a server's; fetch the pictures themselves"),
];

/// What `info.json` says, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    width: usize,
    height: usize,
    kind: Kind,
    /// Of the pictures, without the dot.
    extension: String,
    planes: Vec<Plane>,
    /// The colour space of what is shown, where the file names one.
    profile: Option<String>,
}

/// What the planes make up.
#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Terms(Basis, Colouring),
    Luminance(Basis),
    Sampled {
        between: Between,
        /// How many planes each of Co and Cg has; none: the planes have colours.
        chrominance: Option<usize>,
        /// The largest code of each plane's colours.
        range: Vec<f32>,
        /// Codes of the shared colour under each light, then of each plane's; none: they are in [`MATERIALS`].
        codes: Option<Vec<f32>>,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    /// Which of a texel's numbers it is, if any.
    slot: Option<usize>,
    scale: f32,
    bias: f32,
    /// What is taken off its value.
    less: f32,
}

#[derive(Deserialize)]
struct Json {
    width: u64,
    height: u64,
    #[serde(rename = "type")]
    kind: String,
    colorspace: String,
    nplanes: Option<u64>,
    yccplanes: Option<[u64; 3]>,
    #[serde(default = "jpg")]
    format: String,
    lights: Option<Vec<f32>>,
    sigma: Option<f32>,
    resolution: Option<u64>,
    basis: Option<Vec<f32>>,
    colorprofile: Option<String>,
    materials: Vec<Material>,
}

#[derive(Deserialize)]
struct Material {
    scale: Vec<f32>,
    bias: Vec<f32>,
    range: Option<Vec<f32>>,
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
    let (kind, space) = (known("type", "basis", &json.kind, file)?, json.colorspace.as_str());
    known("colorspace", "colour space", space, file)?;
    let sampled = matches!(kind, "rbf" | "bilinear" | "bln");
    if sampled != matches!(space, "mrgb" | "mycc") {
        let expected = if sampled { "mrgb or mycc" } else { "rgb, lrgb or ycc" };
        return invalid(format!("the basis '{kind}' with the colour space '{space}'; expected {expected}"));
    }
    let planes = match (space, json.nplanes, json.yccplanes) {
        ("mycc", _, Some(each)) => each.iter().fold(0u64, |sum, n| sum.saturating_add(*n)),
        ("mycc", _, None) => return invalid("expected 'yccplanes', three numbers of planes".into()),
        (_, Some(planes), _) => planes,
        (_, None, _) => return invalid("expected 'nplanes', the number of planes".into()),
    };
    if planes == 0 || planes > MAX_PLANES {
        return invalid(format!("there are {planes} planes; expected 1 to {MAX_PLANES}"));
    }
    if !["jpg", "jpeg", "png"].contains(&json.format.as_str()) {
        return invalid(format!("pictures of the format '{}' are not read; expected jpg", json.format));
    }
    let [material] = json.materials.as_slice() else {
        return invalid(format!("expected one material, found {}", json.materials.len()));
    };
    let list = |what: &str, list: &[f32]| {
        if list.len() as u64 == planes && list.iter().all(|v| v.is_finite()) {
            return Ok(());
        }
        let problem = format!("expected {planes} finite numbers as '{what}', found {}", list.len());
        Err(Error::invalid(at(), problem))
    };
    let planes = planes as usize;
    let kind = if sampled {
        let between = between(kind, &json, file)?;
        let chrominance = match (space, json.yccplanes) {
            ("mycc", Some([y, co, cg])) if co == cg && co <= y => Some(co as usize),
            ("mycc", each) => {
                let found = each.unwrap_or_default();
                return invalid(format!(
                    "'yccplanes' is {found:?}; expected as many planes of Co as of Cg, and no fewer of Y"
                ));
            }
            _ => None,
        };
        let Some(range) = &material.range else {
            return invalid(format!("expected 'range', {planes} numbers"));
        };
        list("range", range)?;
        if range.iter().any(|r| *r <= 0.0) {
            return invalid("expected numbers above zero as 'range'".into());
        }
        let count = 3 * (planes + 1) * between.lights();
        let codes = json.basis.filter(|b| !b.is_empty());
        if let Some(basis) = &codes
            && (basis.len() != count || basis.iter().any(|v| !v.is_finite()))
        {
            return invalid(format!(
                "expected {count} finite numbers as 'basis', three a light for all planes and for each; found {}",
                basis.len()
            ));
        }
        Kind::Sampled { between, chrominance, range: range.clone(), codes }
    } else {
        let colouring = if space == "lrgb" { Colouring::Lrgb } else { Colouring::Rgb };
        let terms = match colouring {
            Colouring::Rgb => planes / 3,
            Colouring::Lrgb => planes.saturating_sub(3),
        };
        let basis = match kind {
            "ptm" => Basis::Ptm,
            _ => match Basis::ALL.into_iter().find(|b| *b != Basis::Ptm && b.terms() == terms) {
                Some(basis) => basis,
                None => {
                    return invalid(format!("expected HSH of 4, 9 or 16 terms; {planes} planes are {terms}"));
                }
            },
        };
        let expected = |terms| if colouring == Colouring::Rgb { 3 * terms } else { 3 + terms };
        // The plane in x and y, without the terms of degree two, is a polynomial, too.
        if planes != expected(basis.terms()) && (basis, planes) != (Basis::Ptm, expected(3)) {
            return invalid(format!(
                "{} with the colour space '{space}' has {} planes; found {planes}",
                basis.name(),
                expected(basis.terms())
            ));
        }
        if space == "ycc" { Kind::Luminance(basis) } else { Kind::Terms(basis, colouring) }
    };
    list("scale", &material.scale)?;
    list("bias", &material.bias)?;
    let planes = (0..planes).map(|p| {
        let plane = Plane { slot: Some(p), scale: material.scale[p], bias: material.bias[p], less: 0.0 };
        match kind {
            // Older files scale the fixed colour as well, and do not mean it.
            Kind::Terms(_, Colouring::Lrgb) if p < 3 => Plane { scale: 1.0, bias: 0.0, ..plane },
            Kind::Luminance(basis) => match p {
                1 | 2 => Plane { slot: Some(basis.terms() + p - 1), less: 0.5, ..plane },
                _ => Plane { slot: (p % 3 == 0).then_some(p / 3), ..plane },
            },
            _ => plane,
        }
    });
    let planes = planes.collect();
    let info = Info { width, height, kind, extension: json.format, planes, profile: json.colorprofile };
    // As much as HSH 16 of the most texels takes.
    let (asked, limit) = ((width * height * info.stride()) as u64, max_texels.saturating_mul(MOST_NUMBERS));
    if asked > limit {
        let what = format!("the number of coefficients ({width} x {height} texels of {})", info.stride());
        return Err(Error::TooLarge { at: at(), what, asked, limit });
    }
    Ok(info)
}

/// Looks a word up among the features that are called `kind: word`.
fn known<'a>(kind: &str, what: &'static str, word: &'a str, file: &Path) -> Result<&'a str, Error> {
    let at = Place::file(file);
    match find(FEATURES, &format!("{kind}: {word}")).map(|f| f.support) {
        Some(Support::No(why)) => {
            let problem = format!("the {what} '{word}' is not read: {why}; export the folder as ptm or hsh");
            Err(Error::invalid(at, problem))
        }
        Some(_) => Ok(word),
        None => {
            let names = FEATURES.iter().filter(|f| !matches!(f.support, Support::No(_)));
            let known = names.filter_map(|f| f.name.strip_prefix(kind)?.strip_prefix(": "));
            Err(Error::unknown(at, what, word, known))
        }
    }
}

/// The lights that colours are known under.
fn between(kind: &str, json: &Json, file: &Path) -> Result<Between, Error> {
    let invalid = |problem: String| Err(Error::invalid(Place::file(file), problem));
    if kind != "rbf" {
        let side = json.resolution.unwrap_or(0);
        if side < 2 || side.saturating_mul(side) > MAX_LIGHTS {
            return invalid(format!("'resolution' is {side}; expected 2 to {}", MAX_LIGHTS.isqrt()));
        }
        return Ok(Between::Octahedron { side: side as usize });
    }
    let numbers = json.lights.as_deref().unwrap_or_default();
    let lights = numbers.len() / 3;
    if lights == 0 || !numbers.len().is_multiple_of(3) || lights as u64 > MAX_LIGHTS {
        let found = numbers.len();
        return invalid(format!("expected 'lights', three numbers each of 1 to {MAX_LIGHTS}; found {found}"));
    }
    let sigma = json.sigma.unwrap_or(DEFAULT_SIGMA);
    // Beyond these all lights, or none but the nearest, would count.
    if !(1e-3..=1e3).contains(&sigma) {
        return invalid(format!("'sigma' is {sigma}; expected .001 to 1000"));
    }
    if numbers.iter().any(|v| v.is_nan() || v.abs() > 1e6) {
        return invalid("expected finite numbers as 'lights'".into());
    }
    Ok(Between::Gaussian { lights: numbers.chunks_exact(3).map(Vec3::from_slice).collect(), sigma })
}

impl Info {
    /// Whether the values are said to be proportional to light.
    pub fn linear(&self) -> bool {
        self.profile.as_deref() == Some(LINEAR)
    }

    /// Numbers a texel.
    fn stride(&self) -> usize {
        match &self.kind {
            Kind::Terms(basis, colouring) => colouring.stride(*basis),
            Kind::Luminance(basis) => basis.terms() + 2,
            Kind::Sampled { .. } => self.planes.len(),
        }
    }

    /// What the coefficients multiply, where that is not said by basis and colouring.
    fn functions(&self, folder: &Path) -> Result<Option<Functions>, Error> {
        let (between, chrominance, range, codes) = match &self.kind {
            Kind::Terms(..) => return Ok(None),
            Kind::Luminance(basis) => return Ok(Some(Functions::Luminance(*basis))),
            Kind::Sampled { between, chrominance, range, codes } => (between, chrominance, range, codes),
        };
        let (planes, lights) = (self.planes.len(), between.lights());
        let codes = match codes {
            Some(codes) => codes.clone(),
            None => {
                let (path, count) = (folder.join(MATERIALS), 3 * (planes + 1) * lights);
                let bytes = read_bounded(&path, count as u64)?;
                if bytes.len() != count {
                    let problem = format!("expected {count} bytes, found {}", bytes.len());
                    return Err(Error::invalid(Place::file(path), problem));
                }
                bytes.into_iter().map(f32::from).collect()
            }
        };
        let colour = |light: usize, plane: usize| {
            let code = &codes[3 * (plane * lights + light)..][..3];
            let value = |c: usize| match plane {
                0 => code[c] / 255.0,
                _ => (code[c] - 127.0) / range[plane - 1],
            };
            let all = [0, 1, 2].map(value);
            match chrominance {
                None => all,
                Some(_) if plane == 0 => to_rgb(all),
                // One of Y, Co and Cg is this plane's.
                Some(n) => {
                    let own = if plane <= 3 * n { (plane - 1) % 3 } else { 0 };
                    to_rgb(std::array::from_fn(|c| if c == own { all[c] } else { 0.0 }))
                }
            }
        };
        let colours = (0..lights).flat_map(|l| (0..=planes).map(move |p| (l, p))).map(|(l, p)| colour(l, p));
        let colours: Vec<[f32; 3]> = colours.collect();
        if colours.as_flattened().iter().any(|v| !v.is_finite()) {
            let problem = "the colours of the planes are not finite";
            return Err(Error::invalid(Place::file(folder.join(INFO)), problem));
        }
        Ok(Some(Functions::Sampled { between: between.clone(), colours }))
    }
}

/// From Y, Co and Cg.
fn to_rgb([y, co, cg]: [f32; 3]) -> [f32; 3] {
    let rest = y - cg / 2.0;
    [rest + co / 2.0, y + cg / 2.0, rest - co / 2.0]
}

/// What the `info.json` of a folder says; more than `max_texels` are refused.
pub fn info(folder: &Path, max_texels: u64) -> Result<Info, Error> {
    let path = folder.join(INFO);
    read_info(&read_bounded(&path, 1 << 26)?, &path, max_texels)
}

/// Reads a folder; more than `max_texels` are refused before memory is asked for.
pub fn read(folder: &Path, max_texels: u64) -> Result<Contents, Error> {
    let path = folder.join(INFO);
    let info = info(folder, max_texels)?;
    if let Some(profile) = &info.profile {
        match find(FEATURES, &format!("colorprofile: {profile}")).map(|f| f.support) {
            Some(Support::Yes) => {}
            Some(Support::Partly(what) | Support::No(what)) => {
                tracing::warn!("{}: the colour profile '{profile}': {what}", path.display());
            }
            None => {
                let profile = profile.chars().take(40).collect::<String>().escape_debug().to_string();
                tracing::warn!("{}: unknown colour profile '{profile}'; sRGB is assumed", path.display());
            }
        }
    }
    let functions = info.functions(folder)?;
    let (width, height, stride) = (info.width, info.height, info.stride());
    let pictures = info.planes.len().div_ceil(3);
    // All are looked for before there is memory for any.
    let open = |number| Picture::open(folder, number, [width, height], &info.extension);
    let mut pictures = (0..pictures).map(open).collect::<Result<Vec<_>, _>>()?;
    let mut coefficients = vec![0.0; width * height * stride];
    for (picture, planes) in pictures.iter_mut().zip(info.planes.chunks(3)) {
        picture.tiles(|[left, top, across, down], image| {
            for y in 0..down {
                let row = &mut coefficients[((top + y) * width + left) * stride..][..across * stride];
                let pixels = image.data[y * image.width * 3..].chunks_exact(3);
                for (texel, pixel) in row.chunks_exact_mut(stride).zip(pixels) {
                    for (plane, byte) in planes.iter().zip(pixel) {
                        if let Some(slot) = plane.slot {
                            texel[slot] = (byte - plane.bias) * plane.scale - plane.less;
                        }
                    }
                }
            }
        })?;
    }
    if coefficients.iter().any(|v| !v.is_finite()) {
        let problem = "scales and biases make coefficients that are not finite";
        return Err(Error::invalid(Place::file(path), problem));
    }
    Ok(match (info.kind, functions) {
        (Kind::Terms(basis, colouring), _) => {
            Contents::Terms(Relightable { width, height, basis, colouring, coefficients })
        }
        (_, Some(functions)) => Contents::Mixed(Mixed { width, height, functions, coefficients }),
        (_, None) => {
            let problem = "the planes have no functions of the light";
            return Err(Error::invalid(Place::file(path), problem));
        }
    })
}

/// The files of a folder with so many planes; of tiles, their folders.
pub(super) fn files(folder: &Path, planes: usize, layout: Layout) -> Vec<PathBuf> {
    let pictures = (0..planes.div_ceil(3)).flat_map(|i| match layout {
        Layout::Image => vec![format!("plane_{i}.jpg")],
        Layout::DeepZoom => vec![format!("plane_{i}_files"), format!("plane_{i}.dzi")],
        Layout::TarZoom => vec![format!("plane_{i}.tzb"), format!("plane_{i}.tzi")],
        Layout::ITarZoom if i == 0 => vec!["planes.tzb".into(), "planes.tzi".into()],
        Layout::ITarZoom => Vec::new(),
    });
    pictures.chain([INFO.into()]).map(|name| folder.join(name)).collect()
}

/// Refuses a folder that holds pictures of another layout: readers might take those for the new ones.
pub(crate) fn has_no_other(folder: &Path, layout: Layout) -> Result<(), Error> {
    let other = Layout::ALL.into_iter().find(|l| *l != layout && folder.join(l.mark()).exists());
    other.map_or(Ok(()), |other| {
        let problem = format!(
            "there are pictures of the layout '{}' in it; write into another folder, or delete them",
            other.name()
        );
        Err(Error::invalid(Place::file(folder), problem))
    })
}

/// Writes a folder, which is made where it is missing; `info.json` comes last, so that a folder with one is whole.
pub fn write(folder: &Path, r: &mut Gathered, layout: Layout) -> Result<(), Error> {
    r.check(folder)?;
    let (stride, [width, height]) = (r.stride(), r.size());
    let mut ranges = r.ranges().to_vec();
    if r.colouring() == Colouring::Lrgb {
        // The fixed colour is a picture of its own.
        ranges[..3].fill([0.0, 1.0]);
    }
    // A plane that never changes has no scale to divide by.
    let scale: Vec<f32> = ranges.iter().map(|[lo, hi]| if hi - lo > 1e-30 { hi - lo } else { 1.0 }).collect();
    let bias: Vec<f32> = ranges.iter().zip(&scale).map(|([lo, _], s)| -lo / s).collect();

    make_folder(folder)?;
    // A folder that has one is whole.
    let info = folder.join(INFO);
    match std::fs::remove_file(&info) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(Error::io(&info, e)),
        _ => {}
    }
    let mut writer = pyramid::Writer::new(folder, layout, [width, height], stride.div_ceil(3))?;
    let size = width * height * 3;
    // Each group is another pass over the coefficients.
    let group = (r.memory() / size as u64).clamp(1, stride.div_ceil(3) as u64) as usize;
    let mut bytes = vec![0; group * size];
    let mut row = Vec::new();
    for first in (0..stride.div_ceil(3)).step_by(group) {
        bytes.fill(0);
        for y in 0..height {
            r.row(y, &mut row)?;
            for (picture, bytes) in bytes.chunks_exact_mut(size).enumerate() {
                let pixels = bytes[y * width * 3..][..width * 3].chunks_exact_mut(3);
                for (pixel, texel) in pixels.zip(row.chunks_exact(stride)) {
                    for (byte, plane) in pixel.iter_mut().zip(3 * (first + picture)..stride) {
                        *byte = (255.0 * (texel[plane] / scale[plane] + bias[plane])).round() as u8;
                    }
                }
            }
        }
        for (picture, bytes) in bytes.chunks_exact(size).enumerate().take(stride.div_ceil(3) - first) {
            writer.picture(first + picture, bytes)?;
        }
    }
    writer.finish()?;
    let text = json!({
        "width": width,
        "height": height,
        "format": "jpg",
        "type": match r.basis() { Basis::Ptm => "ptm", Basis::Hsh { .. } => "hsh" },
        "colorspace": match r.colouring() { Colouring::Rgb => "rgb", Colouring::Lrgb => "lrgb" },
        "nplanes": stride,
        "quality": QUALITY,
        "colorprofile": if r.is_linear() { LINEAR } else { DISPLAY },
        "materials": [{ "scale": scale, "bias": bias }],
    });
    atomic_write(&info, format!("{text:#}\n").as_bytes())
}

#[cfg(test)]
mod tests;
