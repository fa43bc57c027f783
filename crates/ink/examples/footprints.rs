//! What the slides' method prints with: `footprints MASKS STROKES` draws two pictures of 400 x 300. Of the first the columns are
//! footprints of a soft, a usual and a worn brush, the rows F and the dispersed F_diff; in the second are strokes by
//! `yugen_ink::literal` without dryness, with that of its contours, and wholly dry.

use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_ink::footprint::{Footprint, TEXELS, VARIANTS};
use yugen_ink::literal::{self, Padi, constant};
use yugen_optics::{ColourSpace, Image};

type Result = std::result::Result<(), Box<dyn std::error::Error>>;

const SIZE: [usize; 2] = [400, 300];
const ROUGHNESS: [f32; 3] = [0.0, 0.4, 1.0];
const DRYNESS: [f32; 3] = [0.0, constant::DRYNESS, 1.0];
/// Half width of a stroke that is wholly pressed, pixels.
const RADIUS: f32 = 26.0;

fn main() -> Result {
    let files: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [masks_file, strokes_file] = &files[..] else {
        return Err("expected MASKS STROKES, two names of pictures".into());
    };
    let brushes = ROUGHNESS.map(|roughness| {
        (0..VARIANTS as u32).map(|k| Footprint::new(0, k, roughness)).collect::<Vec<Footprint>>()
    });
    write(masks_file, &masks(&brushes))?;
    write(strokes_file, &strokes(&brushes[1]))
}

/// Footprints side by side, in the middle of their places.
fn masks(brushes: &[Vec<Footprint>; 3]) -> Vec<f32> {
    let [w, h] = SIZE;
    let mut alpha = vec![0.0; w * h];
    for (column, brush) in brushes.iter().enumerate() {
        for (row, mask) in [&brush[0].bristles, &brush[0].diffused].into_iter().enumerate() {
            let [left, top] = [(w / 3, column), (h / 2, row)].map(|(n, k)| n * k + (n - TEXELS) / 2);
            for (y, texels) in mask.chunks_exact(TEXELS).enumerate() {
                alpha[(top + y) * w + left..][..TEXELS].copy_from_slice(texels);
            }
        }
    }
    alpha
}

/// Three strokes from left to right, each a row of inked pixels that swings once.
fn strokes(masks: &[Footprint]) -> Vec<f32> {
    let [w, h] = SIZE;
    let mut pixels = vec![Padi::default(); w * h];
    for (k, dryness) in DRYNESS.into_iter().enumerate() {
        for x in 30..w - 30 {
            let theta = TAU * x as f32 / w as f32;
            let y = h as f32 * (k as f32 + 0.5) / 3.0 + 12.0 * theta.sin();
            let slope = 12.0 * TAU / w as f32 * theta.cos();
            let pressure = constant::A * (constant::OMEGA * theta).sin() + constant::T;
            let intensity = constant::INTENSITY;
            pixels[y as usize * w + x] = Padi { pressure, angle: slope.atan(), dryness, intensity };
        }
    }
    let mut alpha = vec![0.0; w * h];
    let size = SIZE.map(|n| n as u32);
    literal::particles(&mut alpha, &pixels, size, masks, [RADIUS, 1.0, constant::K_DRY], 0);
    alpha
}

/// Ink on white paper.
fn write(file: &Path, alpha: &[f32]) -> Result {
    let mut picture = Image::rgb(SIZE[0], SIZE[1]);
    for (pixel, alpha) in picture.data.chunks_exact_mut(3).zip(alpha) {
        pixel.fill(1.0 - alpha);
    }
    Ok(image::write(file, &picture, &WriteOptions::from(ColourSpace::LinearSrgb))?)
}
