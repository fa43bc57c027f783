//! What was found, drawn over the pictures.

use super::Candidate;
use anyhow::Result;
use std::path::Path;
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_capture::calibrate::View;
use yugen_optics::{ColourSpace, Image, Vec2};

/// The brightest of all pictures with every circle that was found: green where it is a ball, orange where not, and the
/// lamps' mirror images in red.
pub fn draw(path: &Path, brightest: &[f32], view: &View, candidates: &[Candidate]) -> Result<()> {
    let (width, height) = (view.width, view.height);
    let mut image = Image::rgb(width, height);
    let mut sorted: Vec<f32> = brightest.to_vec();
    let nth = sorted.len() * 95 / 100;
    let (_, &mut bright, _) = sorted.select_nth_unstable_by(nth, f32::total_cmp);
    for (pixel, v) in image.data.chunks_exact_mut(3).zip(brightest) {
        pixel.fill((v / bright.max(1e-6)).clamp(0.0, 1.0) * 0.7);
    }
    let mut dot = |at: Vec2, colour: [f32; 3]| {
        if at.x >= 0.0 && at.y >= 0.0 && (at.x as usize) < width && (at.y as usize) < height {
            image.pixel_mut(at.x as usize, at.y as usize).copy_from_slice(&colour);
        }
    };
    for c in candidates {
        let steps = (8.0 * c.outline.ball.radius) as usize;
        let turns: Vec<f32> = (0..steps).map(|i| std::f32::consts::TAU * i as f32 / steps as f32).collect();
        let colour = if c.fault.is_none() { [0.0, 1.0, 0.0] } else { [1.0, 0.4, 0.0] };
        view.rim(c.outline.ball, &turns).unwrap_or_default().into_iter().for_each(|at| dot(at, colour));
        for at in c.highlights.iter().flatten().map(|h| h.at) {
            for off in [Vec2::ZERO, Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y] {
                dot(at + off, [1.0, 0.0, 0.0]);
            }
        }
    }
    Ok(image::write(path, &image, &WriteOptions::from(ColourSpace::LinearSrgb))?)
}
