//! What is put right in a merged picture: the lens's shading, white, colour.

use super::bracket::Light;
use super::{Hdr, MAX_TEXT};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use yugen_archive::formats::colour_chart;
use yugen_archive::formats::image::{self, NonFinite, ReadOptions};
use yugen_archive::read_bounded;
use yugen_capture::hdr::colour_matrix;
use yugen_optics::{Image, Mat3, Vec2, Vec3};

impl Hdr {
    /// The file of the flat for a light.
    pub(super) fn flat_file(&self, light: &Light) -> Option<PathBuf> {
        let path = self.flat.as_ref()?;
        Some(if path.is_dir() { path.join(format!("{}.exr", light.name)) } else { path.clone() })
    }

    /// The flat for a light.
    pub(super) fn flat_of(&self, light: &Light) -> Result<Option<Image>> {
        let Some(file) = self.flat_file(light) else { return Ok(None) };
        let options = ReadOptions { non_finite: NonFinite::Keep, ..ReadOptions::raw() };
        Ok(Some(image::read(&file, &options)?))
    }

    /// Makes what the white reference reads its reflectance; what it read.
    pub(super) fn balance(&self, image: &mut Image, name: &str) -> Result<Vec3> {
        let [x, y, w, h] = self.white[..] else { bail!("--white takes four numbers") };
        let fits = |at: usize, size: usize, all: usize| {
            size > 0 && at.checked_add(size).is_some_and(|end| end <= all)
        };
        ensure!(
            fits(x, w, image.width) && fits(y, h, image.height),
            "--white {x},{y},{w},{h} does not lie in the pictures, which are {} x {}",
            image.width,
            image.height
        );
        let planes = image.channels.len() / 2;
        let (mut sum, mut count) = (Vec3::ZERO, 0usize);
        for j in y..y + h {
            for i in x..x + w {
                let pixel = image.pixel(i, j);
                if !pixel[0].is_nan() {
                    sum += Vec3::from_array([0, 1, 2].map(|c| pixel[if planes == 1 { 0 } else { c }]));
                    count += 1;
                }
            }
        }
        ensure!(
            2 * count > w * h && sum.min_element() > 0.0,
            "light '{name}': the white reference is saturated or black; expose the bracket for it too"
        );
        let read = sum / count as f32;
        let scale = (self.white_reflectance / read).to_array();
        for pixel in image.data.chunks_exact_mut(2 * planes) {
            for (i, v) in pixel.iter_mut().enumerate() {
                *v *= scale[i % planes];
            }
        }
        Ok(read)
    }
}

/// Divides the shape of a flat out, relative to its middle.
pub(super) fn flatten(image: &mut Image, flat: &Image) -> Result<()> {
    ensure!(
        (flat.width, flat.height) == (image.width, image.height),
        "it is {} x {}, they are {} x {}",
        flat.width,
        flat.height,
        image.width,
        image.height
    );
    let planes = image.channels.len() / 2;
    for c in 0..planes {
        let name = &image.channels[c];
        let from =
            flat.channel(name).or(flat.channel("Y")).with_context(|| format!("it has no channel {name}"))?;
        let stride = flat.channels.len();
        // An eighth of the picture around its middle, without what is masked.
        let reach = Vec2::new(flat.width as f32, flat.height as f32) / 16.0;
        let middle = Vec2::new(flat.width as f32, flat.height as f32) / 2.0;
        let (mut sum, mut count) = (0.0f64, 0usize);
        for y in 0..flat.height {
            for x in 0..flat.width {
                let off = (Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - middle).abs();
                let v = flat.data[(y * flat.width + x) * stride + from];
                if off.cmple(reach.max(Vec2::splat(1.0))).all() && v.is_finite() {
                    sum += f64::from(v);
                    count += 1;
                }
            }
        }
        let mean = (sum / count.max(1) as f64) as f32;
        ensure!(mean > 0.0, "it is black or masked in the middle");
        for (pixel, white) in image.data.chunks_exact_mut(2 * planes).zip(flat.data.chunks_exact(stride)) {
            let v = white[from];
            let gain = if v > 0.0 { mean / v } else { f32::NAN };
            pixel[c] *= gain;
            pixel[planes + c] *= gain;
        }
    }
    Ok(())
}

/// The matrix of a colour chart, and how well it does.
pub(super) fn colours(path: &Path) -> Result<(Mat3, f32)> {
    let patches = colour_chart::read(&read_bounded(path, MAX_TEXT)?, path)?;
    let (measured, known): (Vec<[f32; 3]>, Vec<[f32; 3]>) =
        patches.iter().map(|p| (p.measured, p.known)).unzip();
    colour_matrix(&measured, &known)
        .with_context(|| format!("{}: the patches are too much alike to give a matrix", path.display()))
}

/// Turns colours, and their uncertainties as if the channels were independent.
pub(super) fn turn(image: &mut Image, matrix: Mat3) -> Result<()> {
    ensure!(image.channels.len() == 6, "--chart is for colours, and the pictures are grey; leave it out");
    let squares = Mat3::from_cols_array(&matrix.to_cols_array().map(|v| v * v));
    for pixel in image.data.chunks_exact_mut(6) {
        let value = matrix * Vec3::from_slice(&pixel[..3]);
        let sigma = Vec3::from_slice(&pixel[3..]);
        pixel[..3].copy_from_slice(&value.to_array());
        let sigma = (squares * (sigma * sigma)).to_array().map(f32::sqrt);
        pixel[3..].copy_from_slice(&sigma);
    }
    Ok(())
}
