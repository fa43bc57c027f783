//! Puts pictures into rows on one sheet, each in the middle of its place: `sheet OUT COLUMNS PICTURE…`.

use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use yugen_archive::formats::image::{self, ReadOptions, WriteOptions};
use yugen_optics::{ColourSpace, Image};

/// Pixels between pictures, and their colour, linear: a wall.
const GAP: usize = 10;
const WALL: f32 = 0.55;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [out, columns, files @ ..] = &words[..] else { bail!("expected OUT COLUMNS PICTURE…") };
    let columns: usize = columns.parse().ok().filter(|n| *n > 0).context("COLUMNS is a number")?;
    let read = |file: &String| image::read(&PathBuf::from(file), &ReadOptions::to(ColourSpace::LinearSrgb));
    let pictures: Vec<Image> = files.iter().map(read).collect::<Result<_, _>>()?;
    // As wide as the widest of a column, as high as the highest of a row.
    let mut wide = vec![0; columns.min(pictures.len())];
    let mut high = vec![0; pictures.len().div_ceil(columns)];
    for (k, picture) in pictures.iter().enumerate() {
        let (column, row) = (k % columns, k / columns);
        (wide[column], high[row]) = (wide[column].max(picture.width), high[row].max(picture.height));
    }
    let whole = |sides: &[usize]| GAP + sides.iter().map(|n| n + GAP).sum::<usize>();
    let mut sheet = Image::rgb(whole(&wide), whole(&high));
    sheet.data.fill(WALL);
    for (k, picture) in pictures.iter().enumerate() {
        let rgb = picture.select(&["R", "G", "B"]).with_context(|| format!("{} has no colours", files[k]))?;
        let (column, row, w, h) = (k % columns, k / columns, picture.width, picture.height);
        let left = whole(&wide[..column]) + (wide[column] - w) / 2;
        let top = whole(&high[..row]) + (high[row] - h) / 2;
        for y in 0..h {
            for x in 0..w {
                sheet.pixel_mut(left + x, top + y).copy_from_slice(rgb.pixel(x, y));
            }
        }
    }
    Ok(image::write(&PathBuf::from(out), &sheet, &WriteOptions::from(ColourSpace::LinearSrgb))?)
}
