//! The maps of a cloth as pictures of their own.

use crate::Error;
use crate::formats::image::{WriteOptions, write};
use glam::Vec3;
use std::path::Path;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::btf::{Btf, Texel};

/// A map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// ρ_d, a colour.
    Diffuse,
    /// ρ_s, a colour.
    Specular,
    /// (n + 1)/2.
    Normal,
    /// (t + 1)/2, of t and −t the one to the right.
    Tangent,
    /// σ_x, σ_y, 0.
    Sigma,
    /// A number.
    Confidence,
}

impl Map {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Diffuse, Self::Specular, Self::Normal, Self::Tangent, Self::Sigma, Self::Confidence];

    /// The usual name of its file, without the extension.
    pub fn name(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            Self::Specular => "specular",
            Self::Normal => "normal",
            Self::Tangent => "tangent",
            Self::Sigma => "sigma",
            Self::Confidence => "confidence",
        }
    }

    fn value(self, t: &Texel) -> Vec3 {
        match self {
            Self::Diffuse => t.diffuse,
            Self::Specular => t.specular,
            Self::Normal => (t.normal + 1.0) * 0.5,
            Self::Tangent => (t.tangent * t.tangent.x.signum() + 1.0) * 0.5,
            Self::Sigma => t.sigma.extend(0.0),
            Self::Confidence => Vec3::splat(t.confidence),
        }
    }
}

/// Writes a map to a picture whose extension says which format. Vectors and numbers are stored as numbers in [0, 1], not
/// as colours; integers hold nothing above 1.
pub fn save(path: &Path, btf: &Btf, map: Map) -> Result<(), Error> {
    match map {
        Map::Diffuse | Map::Specular => {
            let image = picture(btf.width, btf.height, btf.texels.iter().map(|t| map.value(t)));
            write(path, &image, &WriteOptions { bits: 16, ..WriteOptions::from(btf.colour_space) })
        }
        _ => save_numbers(path, btf.width, btf.height, 16, btf.texels.iter().map(|t| map.value(t))),
    }
}

/// Writes numbers in [0, 1], three a pixel, with codes of so many bits proportional to them in a PNG.
pub fn save_numbers(
    path: &Path,
    width: usize,
    height: usize,
    bits: u8,
    values: impl Iterator<Item = Vec3>,
) -> Result<(), Error> {
    let options = WriteOptions { bits, raw: true, ..WriteOptions::from(ColourSpace::LinearSrgb) };
    write(path, &picture(width, height, values), &options)
}

fn picture(width: usize, height: usize, values: impl Iterator<Item = Vec3>) -> Image {
    let channels = ["R", "G", "B"].map(String::from).to_vec();
    Image { width, height, channels, data: values.flat_map(|v| v.to_array()).collect() }
}
