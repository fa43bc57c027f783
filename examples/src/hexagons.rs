//! Draws `examples/scenes/hexagons.png`, the pattern of the brocade. `hexagons FILE.png` writes it elsewhere.

use anyhow::Result;
use std::path::PathBuf;
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_optics::{ColourSpace, Image};

fn main() -> Result<()> {
    let scenes = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes/hexagons.png");
    let file = std::env::args_os().nth(1).map_or(scenes, PathBuf::from);
    image::write(&file, &hexagons(512), &WriteOptions::from(ColourSpace::LinearSrgb))?;
    Ok(())
}

/// A tile of the tortoise-shell pattern (kikkō): gold outlines and hearts of hexagons. Repeats at its edges: two
/// rows of hexagons, squeezed by 15 % so that the tile is square.
fn hexagons(size: usize) -> Image {
    let mut image = Image::new(size, size, &["R"]);
    for y in 0..size {
        for x in 0..size {
            let p = [(x as f32 + 0.5) / size as f32 * 3f32.sqrt(), (y as f32 + 0.5) / size as f32 * 3.0];
            // Distance to the nearest and second nearest centre of a triangular lattice.
            let mut nearest = [f32::MAX; 2];
            for row in -1i32..=3 {
                for column in -1i32..=2 {
                    let c = [(column as f32 + 0.5 * (row & 1) as f32) * 3f32.sqrt(), row as f32 * 1.5];
                    let d = (p[0] - c[0]).hypot(p[1] - c[1]);
                    if d < nearest[0] {
                        nearest = [d, nearest[0]];
                    } else if d < nearest[1] {
                        nearest[1] = d;
                    }
                }
            }
            let edge = nearest[1] - nearest[0];
            let gold = edge < 0.22 || nearest[0] < 0.34 || (edge > 0.42 && edge < 0.56);
            image.pixel_mut(x, y)[0] = f32::from(gold);
        }
    }
    image
}
