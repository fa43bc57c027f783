//! What a picture holds, without a word about what it shows.

use super::{ReadOptions, codec_of, decode, exr};
use crate::formats::exif::{self, Settings};
use crate::{Error, Place, read_bounded};
use std::path::Path;

/// A picture as its file has it.
#[derive(Clone, Debug)]
pub struct About {
    /// Of the file.
    pub format: &'static str,
    /// Its size.
    pub bytes: u64,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// In their order.
    pub channels: Vec<Channel>,
    /// The largest code of a format of integers.
    pub codes: Option<u32>,
    /// xy of red, green, blue and white, where the file names them.
    pub chromaticities: Option<[[f64; 2]; 4]>,
    /// What OpenEXR keeps beside the pixels: names and values, by name.
    pub attributes: Vec<(String, String)>,
    /// What a camera has written.
    pub camera: Settings,
}

/// A channel. Integers are linear, from 0 to 1, where they stand for light, colours not yet converted.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Its name; `R`, `G`, `B`, `A` or `Y` for formats without names.
    pub name: String,
    /// Of the values that are finite; nothing where none is.
    pub range: Option<[f32; 2]>,
    /// Of the values that are finite.
    pub mean: f64,
    /// How many values are below zero.
    pub negative: u64,
    /// How many values are NaN or infinite.
    pub not_finite: u64,
}

/// Reads a picture and tells of it.
///
/// # Errors
/// As [`read`](super::read).
pub fn about(path: &Path) -> Result<About, Error> {
    let options = ReadOptions::default();
    let bytes = read_bounded(path, options.max_samples.saturating_mul(8).max(1 << 26))?;
    about_bytes(&bytes, path, options.max_samples)
}

/// As [`about`], from memory; `name` is for messages, and more samples than `max_samples` are refused.
pub fn about_bytes(bytes: &[u8], name: &Path, max_samples: u64) -> Result<About, Error> {
    let at = Place::file(name);
    let format = codec_of(bytes, &at)?.name;
    // Light rather than codes: half as bright as white is 0.5, whatever the code.
    let decoded = decode(bytes, &ReadOptions { max_samples, ..ReadOptions::default() }, &at)?;
    let image = decoded.image;
    let channels = image.channels.iter().enumerate().map(|(c, name)| {
        let values = || image.data.iter().skip(c).step_by(image.channels.len()).copied();
        let finite = || values().filter(|v| v.is_finite());
        let count = finite().count() as u64;
        Channel {
            name: name.clone(),
            range: (count > 0).then(|| {
                [finite().fold(f32::INFINITY, f32::min), finite().fold(f32::NEG_INFINITY, f32::max)]
            }),
            mean: finite().map(f64::from).sum::<f64>() / count.max(1) as f64,
            negative: finite().filter(|v| *v < 0.0).count() as u64,
            not_finite: (image.width * image.height) as u64 - count,
        }
    });
    Ok(About {
        format,
        bytes: bytes.len() as u64,
        width: image.width,
        height: image.height,
        channels: channels.collect(),
        codes: decoded.codes,
        chromaticities: decoded.chromaticities,
        attributes: if format == exr::CODEC.name { exr::attributes(bytes) } else { Vec::new() },
        camera: exif::read_bytes(bytes),
    })
}
