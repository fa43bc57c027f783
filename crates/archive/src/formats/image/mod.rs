//! Pictures: every format becomes a linear `f32` [`Image`] in the wanted colour space, and back.
//!
//! ```no_run
//! use yugen_archive::formats::image::{ReadOptions, WriteOptions, read, write};
//! let probe = read("probe.exr".as_ref(), &ReadOptions::default())?;
//! write("probe.png".as_ref(), &probe, &WriteOptions::default())?;
//! # Ok::<(), yugen_archive::Error>(())
//! ```
//!
//! Integer formats are sRGB-encoded unless read as `raw`; embedded colour profiles are not looked at. Alpha
//! is kept as the format has it: straight in PNG and WebP, premultiplied in EXR.

mod about;
mod bmp;
mod cube;
mod exr;
mod foreign;
mod hdr;
mod integer;
mod jpeg;
mod layers;
mod png;
mod pnm;
pub mod rows;
mod tga;
mod tiff;
mod webp;

pub use exr::features as exr_features;
pub use layers::{colour_layers, default_layer, layer, layers};

use super::support::Support;
use crate::{Error, Place, atomic_write, check_writable, read_bounded};
pub use about::{About, Channel, about, about_bytes};
pub use foreign::{check_kind, is_raw};
pub(super) use integer::show;
use std::path::Path;
use yugen_optics::adaptation::Adaptation;
use yugen_optics::colour::rgb_to_rgb;
use yugen_optics::tonemap::Curve;
use yugen_optics::{ColourSpace, Image, Vec3};

/// Each file of a picture format declares one of these, and this list makes it known.
const CODECS: &[Codec] = &[
    exr::CODEC,
    hdr::CODEC,
    png::CODEC,
    jpeg::CODEC,
    webp::CODEC,
    tiff::CODEC,
    bmp::CODEC,
    tga::CODEC,
    pnm::CODEC,
];

/// A format that pictures come in.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// For people.
    pub name: &'static str,
    /// Lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// Whether pictures are written in it, too.
    pub written: bool,
    /// How much of it is read.
    pub support: Support,
}

/// Every format that pictures come in.
pub fn formats() -> impl Iterator<Item = Format> {
    CODECS.iter().map(|c| Format {
        name: c.name,
        extensions: c.extensions,
        written: c.encode.is_some(),
        support: c.support,
    })
}

type Encode = fn(&Image, &WriteOptions) -> Result<Vec<u8>, String>;

struct Codec {
    /// For messages.
    name: &'static str,
    /// Lower-case file name extensions.
    extensions: &'static [&'static str],
    /// How much of it is read.
    support: Support,
    /// Whether a file that begins like this is of the format.
    recognises: fn(&[u8]) -> bool,
    decode: fn(&[u8], &ReadOptions, &Place) -> Result<Decoded, Error>,
    /// `None` for a format that is only read. The error is the reason why not.
    encode: Option<Encode>,
}

/// What a codec hands over: linear values, not yet in the wanted space.
struct Decoded {
    image: Image,
    /// xy chromaticities of red, green, blue and white, if the file names them.
    chromaticities: Option<[[f64; 2]; 4]>,
    /// The largest code of a format of integers.
    codes: Option<u32>,
}

/// Four bytes a sample: one gibibyte, a 16k x 4k environment with alpha.
pub const DEFAULT_MAX_SAMPLES: u64 = 1 << 28;

/// What infinities become: the largest finite half float, brighter than any display and far from overflow.
const INFINITE: f32 = 65504.0;

/// What to do with values that are not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum NonFinite {
    /// Replace them (NaN by zero, infinities by ±65504) and log how many there were.
    #[default]
    Replace,
    /// Refuse the file.
    Refuse,
    /// Let them through: NaN says that there is no value. Only OpenEXR and floating-point TIFF can hold them.
    Keep,
}

/// How a picture is read.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// The space that colours are wanted in.
    pub space: ColourSpace,
    /// The space they are in, whatever the file says; `None`: what the file says, else linear sRGB.
    pub source: Option<ColourSpace>,
    /// The numbers of the file as they are: no sRGB decoding, no conversion. For normal maps and masks.
    pub raw: bool,
    /// More samples (width x height x channels) than this are refused before memory is asked for.
    pub max_samples: u64,
    /// What to do with values that are not finite.
    pub non_finite: NonFinite,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self::to(ColourSpace::default())
    }
}

impl ReadOptions {
    /// Colours in `space`.
    pub fn to(space: ColourSpace) -> Self {
        Self {
            space,
            source: None,
            raw: false,
            max_samples: DEFAULT_MAX_SAMPLES,
            non_finite: NonFinite::default(),
        }
    }

    /// The numbers of the file as they are.
    pub fn raw() -> Self {
        Self { raw: true, ..Self::to(ColourSpace::default()) }
    }

    /// Refuses what is more than the limit, before memory is asked for.
    fn admit(&self, at: &Place, width: u64, height: u64, channels: u64) -> Result<(), Error> {
        if width == 0 || height == 0 || channels == 0 {
            return Err(Error::invalid(
                at.clone(),
                format!(
                    "the picture is empty ({width} x {height}, {channels} channels); expected at least one pixel"
                ),
            ));
        }
        let asked = width.saturating_mul(height).saturating_mul(channels);
        if asked > self.max_samples {
            let what = format!("the number of samples ({width} x {height} pixels of {channels} channels)");
            return Err(Error::TooLarge { at: at.clone(), what, asked, limit: self.max_samples });
        }
        Ok(())
    }
}

/// How a picture is written.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// The space that the image's colours are in. EXR stores them as they are and names the space.
    pub space: ColourSpace,
    /// EXR: 16-bit floats instead of 32.
    pub half: bool,
    /// PNG: bits per sample, 8 or 16.
    pub bits: u8,
    /// JPEG: 1 to 100.
    pub quality: u8,
    /// PNG and JPEG: brighter by this many stops.
    pub exposure: f32,
    /// PNG and JPEG: from scene light to display light.
    pub curve: Curve,
    /// Films: what the exposure follows.
    pub adaptation: Adaptation,
    /// EXR: text attributes, name and value.
    pub metadata: Vec<(String, String)>,
    /// What to do with values that are not finite; [`NonFinite::Keep`] only for EXR.
    pub non_finite: NonFinite,
    /// PNG, JPEG: values are parts of full scale and stay as they are, with no colour conversion and no curve. For
    /// maps, and for the numbers of a sensor.
    pub raw: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            space: ColourSpace::default(),
            half: false,
            bits: 8,
            quality: 92,
            exposure: 0.0,
            curve: Curve::default(),
            adaptation: Adaptation::default(),
            metadata: Vec::new(),
            non_finite: NonFinite::default(),
            raw: false,
        }
    }
}

impl WriteOptions {
    /// For an image whose colours are in `space`.
    pub fn from(space: ColourSpace) -> Self {
        Self { space, ..Self::default() }
    }
}

/// Whether this file can be written by [`write`]: its format, which the error names, and its folder. Ask before an
/// hour of rendering.
pub fn can_write(path: &Path) -> Result<(), Error> {
    writer(path)?;
    check_writable(path)
}

/// Whether a file of this name holds what a display shows: [`WriteOptions::curve`] and [`WriteOptions::exposure`] are
/// for such formats only, the others hold the light itself.
pub fn is_for_display(path: &Path) -> bool {
    codec_by_extension(path).is_some_and(|c| ![exr::CODEC.name, hdr::CODEC.name].contains(&c.name))
}

/// What a decoder found, and what to do.
fn damaged(found: impl std::fmt::Display) -> String {
    format!("this picture cannot be decoded ({found}); it is damaged or cut short, fetch or export it again")
}

/// Reads a picture. The format is told by the content, not by the name.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Image, Error> {
    let _span = tracing::debug_span!("read_picture", file = %path.display()).entered();
    // No format here needs more than eight bytes a sample, but small pictures may carry a large profile.
    let bytes = read_bounded(path, options.max_samples.saturating_mul(8).max(1 << 26))?;
    read_bytes(&bytes, path, options)
}

/// Reads a picture for its colour: where it has layers only, the one that `name` names or that is meant. The error, for a
/// layer that it lacks, lists those it has.
pub fn read_layer(path: &Path, name: Option<&str>, options: &ReadOptions) -> Result<Image, Error> {
    let image = read(path, options)?;
    let Some(name) = name.or_else(|| default_layer(&image)) else { return Ok(image) };
    layer(&image, name).ok_or_else(|| Error::unknown(Place::file(path), "layer", name, layers(&image)))
}

/// Sets what is below zero in the colours of a picture of light or reflectance to zero: filters that overshoot and
/// conversions between colour spaces leave such values, and they would be lamps that take light away. Says once how many
/// pixels that were. Pictures of numbers, such as heights and normals, are not for this.
pub fn clamp_negative(image: &mut Image, file: &Path) {
    let colour = |name: &String| matches!(name.rsplit('.').next(), Some("R" | "G" | "B" | "Y"));
    let colours: Vec<usize> = (0..image.channels.len()).filter(|c| colour(&image.channels[*c])).collect();
    let mut count = 0usize;
    let mut least = 0.0f32;
    for pixel in image.data.chunks_exact_mut(image.channels.len().max(1)) {
        let mut found = false;
        for c in &colours {
            if pixel[*c] < 0.0 {
                least = least.min(pixel[*c]);
                pixel[*c] = 0.0;
                found = true;
            }
        }
        count += usize::from(found);
    }
    if count > 0 {
        tracing::warn!(
            "{}: {count} of {} pixels have colours below zero, the least {least}; they are taken for zero",
            file.display(),
            image.width * image.height
        );
    }
}

/// Reads a picture from memory; `name` is for messages, and its extension serves as a hint where the
/// content does not tell.
pub fn read_bytes(bytes: &[u8], name: &Path, options: &ReadOptions) -> Result<Image, Error> {
    let at = Place::file(name);
    let Decoded { mut image, chromaticities, .. } = decode(bytes, options, &at)?;
    let bad = if options.non_finite == NonFinite::Keep { 0 } else { replace_non_finite(&mut image.data) };
    if bad > 0 {
        if options.non_finite == NonFinite::Refuse {
            let problem = format!("{bad} of {} values are not finite; expected numbers", image.data.len());
            return Err(Error::invalid(at, problem));
        }
        tracing::warn!("{at}: {bad} of {} values were not finite and have been replaced", image.data.len());
    }
    tracing::debug!("{at}: {} x {}, {}", image.width, image.height, image.channels.join(", "));
    if !options.raw {
        // Writers are known to fill the field with zeros, which states nothing.
        let stated = chromaticities.filter(|c| c.iter().flatten().any(|x| *x != 0.0)).filter(|&c| {
            let usable = spans_a_space(c);
            if !usable {
                tracing::warn!("{at}: the chromaticities {c:?} span no colour space; linear sRGB is assumed");
            }
            usable
        });
        let from = options.source.map(ColourSpace::chromaticities).or(stated);
        convert(
            &mut image,
            from.unwrap_or(ColourSpace::LinearSrgb.chromaticities()),
            options.space.chromaticities(),
        );
    }
    Ok(image)
}

fn decode(bytes: &[u8], options: &ReadOptions, at: &Place) -> Result<Decoded, Error> {
    (codec_of(bytes, at)?.decode)(bytes, options, at)
}

/// By how a file begins, else by its extension; an error says what it is instead of a picture.
fn codec_of(head: &[u8], at: &Place) -> Result<&'static Codec, Error> {
    if let Some(refusal) = foreign::refusal(head, at) {
        return Err(refusal);
    }
    CODECS.iter().find(|c| (c.recognises)(head)).or_else(|| codec_by_extension(&at.file)).ok_or_else(|| {
        let names = CODECS.iter().map(|c| c.name).collect::<Vec<_>>().join(", ");
        Error::invalid(at.clone(), format!("this is no picture of a known format (expected {names})"))
    })
}

/// Writes a picture in the format of the file name's extension, whole or not at all.
pub fn write(path: &Path, image: &Image, options: &WriteOptions) -> Result<(), Error> {
    let _span = tracing::info_span!("write_picture", file = %path.display()).entered();
    atomic_write(path, &write_bytes(path, image, options)?)
}

/// The bytes that [`write`] would write to `name`.
pub fn write_bytes(name: &Path, image: &Image, options: &WriteOptions) -> Result<Vec<u8>, Error> {
    let encode = writer(name)?;
    let invalid = |problem: String| Error::invalid(Place::file(name), problem);
    if image.width == 0 || image.height == 0 || image.channels.is_empty() {
        return Err(invalid("an empty image cannot be written".into()));
    }
    if image.data.len() != image.width * image.height * image.channels.len() {
        return Err(invalid("the image has not as many values as its size says".into()));
    }
    let bad = image.data.iter().filter(|v| !v.is_finite()).count();
    let holds_nan = codec_by_extension(name).is_some_and(|c| c.name == exr::CODEC.name);
    if bad == 0 || options.non_finite == NonFinite::Keep && holds_nan {
        return encode(image, options).map_err(invalid);
    }
    if options.non_finite == NonFinite::Refuse {
        return Err(invalid(format!("{bad} of {} values are not finite", image.data.len())));
    }
    tracing::warn!(
        "{}: {bad} of {} values were not finite and are not written",
        name.display(),
        image.data.len()
    );
    let mut image = image.clone();
    replace_non_finite(&mut image.data);
    encode(&image, options).map_err(invalid)
}

fn writer(name: &Path) -> Result<Encode, Error> {
    codec_by_extension(name).and_then(|c| c.encode).ok_or_else(|| {
        let known: Vec<_> =
            CODECS.iter().filter(|c| c.encode.is_some()).flat_map(|c| c.extensions).copied().collect();
        let problem = format!(
            "cannot tell a picture format to write; expected a name ending in .{}",
            known.join(", .")
        );
        Error::invalid(Place::file(name), problem)
    })
}

/// Whether a file's name ends as those of pictures do.
pub fn is_picture(name: &Path) -> bool {
    codec_by_extension(name).is_some()
}

fn codec_by_extension(name: &Path) -> Option<&'static Codec> {
    let extension = name.extension()?.to_str()?.to_lowercase();
    CODECS.iter().find(|c| c.extensions.contains(&extension.as_str()))
}

/// NaN to zero, infinities to ±65504; how many there were.
fn replace_non_finite(data: &mut [f32]) -> usize {
    let mut count = 0;
    for v in data.iter_mut().filter(|v| !v.is_finite()) {
        count += 1;
        *v = if v.is_nan() { 0.0 } else { INFINITE.copysign(*v) };
    }
    count
}

/// The positions of every colour in the channels: `R`, `G`, `B` and `layer.R`, `layer.G`, `layer.B`.
fn colour_channels(image: &Image) -> Vec<[usize; 3]> {
    let layers = image.channels.iter().enumerate().filter_map(|(r, name)| {
        let prefix = name.strip_suffix('R').filter(|p| p.is_empty() || p.ends_with('.'))?;
        Some([r, image.channel(&format!("{prefix}G"))?, image.channel(&format!("{prefix}B"))?])
    });
    layers.collect()
}

/// Whether primaries and white (xy) are far enough apart to compute with.
fn spans_a_space(chromaticities: [[f64; 2]; 4]) -> bool {
    let m = rgb_to_rgb(chromaticities, ColourSpace::LinearSrgb.chromaticities());
    // Between real spaces no entry exceeds five.
    m.to_cols_array().iter().all(|x| x.abs() < 100.0)
}

/// Converts every colour of the image between spaces given by chromaticities.
fn convert(image: &mut Image, from: [[f64; 2]; 4], to: [[f64; 2]; 4]) {
    // Files carry chromaticities as f32 with three to five digits; nearer than that is the same space, and
    // its colours must not lose bits on the way.
    let same = from.iter().flatten().zip(to.iter().flatten()).all(|(a, b)| (a - b).abs() < 5e-5);
    if same {
        return;
    }
    let matrix = rgb_to_rgb(from, to);
    let colours = colour_channels(image);
    let width = image.channels.len();
    for pixel in image.data.chunks_exact_mut(width) {
        for c in &colours {
            let rgb = matrix * Vec3::from_array(c.map(|i| pixel[i]));
            for (&i, v) in c.iter().zip(rgb.to_array()) {
                pixel[i] = v;
            }
        }
    }
}

/// Which channels a format for one picture shows: R, G, B (alpha aside) or one grey channel.
fn shown_channels(image: &Image) -> ([usize; 3], Option<usize>) {
    let rgb = ["R", "G", "B"].map(|c| image.channel(c));
    let alpha = image.channel("A").filter(|_| image.channels.len() > 1);
    match rgb {
        [Some(r), Some(g), Some(b)] => ([r, g, b], alpha),
        // Other names: three or more channels are a colour in order, fewer are grey.
        _ if image.channels.len() >= 3 && alpha.is_none() => ([0, 1, 2], None),
        _ => ([image.channel("Y").unwrap_or(0); 3], alpha),
    }
}

#[cfg(test)]
mod tests;
