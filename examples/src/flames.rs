//! A contact sheet of fires: flames of 100 kW in still air and in the wind, a small and a large fire, and one by day. The
//! cells of each flame are marched by parallel rays; logs are lit by the flame's blobs.
//!
//! `flames` writes `out/flames.png`, `flames FILE.png` elsewhere. `flames --time` says how long a flame takes to make, on one
//! core.

use anyhow::Result;
use glam::{DMat3, DVec3, UVec3, Vec2, Vec3};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_motion::fire::{Burning, Fire, Grid};
use yugen_optics::tonemap::into_gamut;
use yugen_optics::{ColourSpace, Image};

const SPACE: ColourSpace = ColourSpace::LinearRec2020;
/// Pixels a metre.
const SCALE: f32 = 220.0;
/// Luminance that the film shows at 1 - 1/e, cd/m².
const EXPOSED: f32 = 9000.0;
/// How long the shutter is open for sparks, s.
const SHUTTER: f32 = 1.0 / 60.0;
/// Pixels across.
const WIDTH: usize = 1760;

/// A row of the sheet.
struct Row {
    fire: Fire,
    /// The first instant and the time between two, s.
    from: f64,
    every: f64,
    /// Of a picture, left, right and top, m from the foot; below it 8 cm are shown.
    frame: [f32; 3],
    /// Luminance behind, cd/m².
    sky: f32,
}

fn main() -> Result<()> {
    let argument = std::env::args_os().nth(1);
    if argument.as_ref().is_some_and(|a| a == "--time") {
        return time();
    }
    let file = argument.map_or(PathBuf::from("out/flames.png"), PathBuf::from);
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let fire = Fire::default();
    let wind = Vec3::new(2.0, 0.0, 0.3);
    let rows = [
        Row { fire, from: 3.0, every: 0.12, frame: [-0.5, 0.5, 1.75], sky: 2.0 },
        Row { fire: Fire { seed: 4, ..fire }, from: 40.0, every: 1.7, frame: [-0.5, 0.5, 1.75], sky: 2.0 },
        Row { fire: Fire { wind, ..fire }, from: 11.0, every: 0.25, frame: [-0.5, 1.5, 1.5], sky: 2.0 },
        Row {
            fire: Fire { power: 30.0, seed: 2, ..fire },
            from: 5.0,
            every: 0.2,
            frame: [-0.5, 0.5, 0.8],
            sky: 2.0,
        },
        Row {
            fire: Fire { power: 150.0, seed: 3, ..fire },
            from: 7.0,
            every: 0.3,
            frame: [-0.5, 0.5, 2.2],
            sky: 2.0,
        },
        Row {
            fire: Fire { power: 150.0, seed: 3, ..fire },
            from: 7.0,
            every: 0.3,
            frame: [-0.5, 0.5, 2.2],
            sky: 5e3,
        },
    ];
    let mut strips = Vec::new();
    for row in &rows {
        let burning = row.fire.light(SPACE)?;
        let [left, right, top] = row.frame;
        let size = [(right - left) * SCALE, (top + 0.08) * SCALE].map(|v| v as usize);
        let mut strip = Image::rgb(WIDTH, size[1]);
        for i in 0..WIDTH / size[0] {
            let picture = draw(&burning, row, row.from + row.every * i as f64, size)?;
            for y in 0..size[1] {
                for x in 0..size[0] {
                    strip.pixel_mut(i * size[0] + x, y).copy_from_slice(picture.pixel(x, y));
                }
            }
        }
        strips.push(strip);
    }
    let height = strips.iter().map(|s| s.height).sum();
    let mut sheet = Image::rgb(WIDTH, height);
    sheet.data = strips.into_iter().flat_map(|s| s.data).collect();
    image::write(&file, &sheet, &WriteOptions::from(ColourSpace::LinearSrgb))?;
    println!("{}", file.display());
    Ok(())
}

/// One picture, linear sRGB.
fn draw(burning: &Burning, row: &Row, seconds: f64, size: [usize; 2]) -> Result<Image> {
    let flame = burning.at(seconds);
    let grid = flame.grid(flame.cells(0.014))?;
    let [left, _, top] = row.frame;
    let at = |x: f32, y: f32| Vec2::new(left + x / SCALE, top - y / SCALE);
    let far = 10.0;
    let (depth, mut behind) = logs(burning, &grid, seconds, row, size);
    let mut light = vec![Vec3::ZERO; size[0] * size[1]];
    for y in 0..size[1] {
        for x in 0..size[0] {
            let p = at(x as f32 + 0.5, y as f32 + 0.5);
            let o = y * size[0] + x;
            let along = grid.march(p.extend(far), Vec3::NEG_Z, [0.0, far - depth[o]], 0.007);
            if depth[o] == -far {
                behind[o] = Vec3::new(0.8, 1.0, 1.3) * row.sky;
            }
            light[o] = along.radiance + behind[o] * along.transmittance;
        }
    }
    for spark in burning.sparks(seconds) {
        let glow = 0.9 * burning.glow(spark.temperature);
        let area = std::f32::consts::PI * (spark.radius * SCALE).powi(2);
        let steps = 12;
        for i in 0..steps {
            let p = spark.position + spark.velocity * (SHUTTER * (i as f32 / steps as f32 - 0.5));
            let (x, y) = ((p.x - left) * SCALE - 0.5, (top - p.y) * SCALE - 0.5);
            for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (px, py) = (x.floor() + i as f32, y.floor() + j as f32);
                let share = (1.0 - (x - px).abs()) * (1.0 - (y - py).abs());
                let inside = px >= 0.0 && py >= 0.0 && px < size[0] as f32 && py < size[1] as f32;
                let o = py.max(0.0) as usize * size[0] + px.max(0.0) as usize;
                if inside && depth[o] < p.z {
                    light[o] += glow * (area * share / steps as f32);
                }
            }
        }
    }
    let to_srgb = SPACE.matrix_to(ColourSpace::LinearSrgb);
    let mut image = Image::rgb(size[0], size[1]);
    for (pixel, light) in image.data.chunks_exact_mut(3).zip(light) {
        // Film saturates channel by channel: what is bright turns from orange to yellow.
        let film = (light / EXPOSED).map(|v| 1.0 - (-v).exp());
        let shown = into_gamut(to_srgb * film, ColourSpace::LinearSrgb);
        pixel.copy_from_slice(&shown.to_array());
    }
    Ok(image)
}

/// The logs: how far to the front each pixel is (−10 where there is none), and what light comes from there.
fn logs(burning: &Burning, grid: &Grid, seconds: f64, row: &Row, size: [usize; 2]) -> (Vec<f32>, Vec<Vec3>) {
    let logs = burning.logs();
    let kelvin = burning.ember_temperatures(&logs, seconds);
    let slabs = grid.slabs(6, 1, DVec3::Y, DMat3::IDENTITY);
    let shade = |i: usize| {
        let (p, n) = (logs.positions[i], logs.normals[i]);
        let mut light = 0.9 * burning.glow(kelvin[i]);
        for blob in slabs.iter().map(|slab| &slab.blob) {
            let to = blob.mean.as_vec3() - p;
            // Blobs are no points: from near they give no more than from their own size.
            let spread = blob.covariance.diagonal().element_sum() as f32;
            let irradiance =
                blob.power.as_vec3() * (n.dot(to.normalize()).max(0.0) / (4.0 * std::f32::consts::PI));
            light += irradiance * (0.06 / std::f32::consts::PI / (to.length_squared() + spread));
        }
        light + Vec3::splat(0.03 * row.sky)
    };
    let shaded: Vec<Vec3> = (0..logs.positions.len()).map(shade).collect();
    let (mut depth, mut light) = (vec![-10.0f32; size[0] * size[1]], vec![Vec3::ZERO; size[0] * size[1]]);
    let [left, _, top] = row.frame;
    for triangle in &logs.triangles {
        let corner = triangle.map(|i| {
            let p = logs.positions[i as usize];
            Vec3::new((p.x - left) * SCALE, (top - p.y) * SCALE, p.z)
        });
        let [a, b, c] = corner.map(|p| p.truncate());
        let area = (b - a).perp_dot(c - a);
        let low = a.min(b).min(c).floor().max(Vec2::ZERO);
        let high = a.max(b).max(c).ceil().min(Vec2::new(size[0] as f32, size[1] as f32));
        for y in low.y as usize..high.y.max(0.0) as usize {
            for x in low.x as usize..high.x.max(0.0) as usize {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let w = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)]
                    .map(|v| v / area);
                let z = w[0] * corner[0].z + w[1] * corner[1].z + w[2] * corner[2].z;
                let o = y * size[0] + x;
                if w.iter().all(|v| *v >= 0.0) && z > depth[o] {
                    depth[o] = z;
                    light[o] = (0..3).map(|k| shaded[triangle[k] as usize] * w[k]).sum();
                }
            }
        }
    }
    (depth, light)
}

/// The least of some runs.
fn least<T>(mut work: impl FnMut(f64) -> T) -> Duration {
    let run = |i: i32| {
        let start = Instant::now();
        std::hint::black_box(work(f64::from(i) * 0.37));
        start.elapsed()
    };
    (0..8).map(run).min().unwrap_or_default()
}

fn time() -> Result<()> {
    let burning = Fire::default().light(SPACE)?;
    println!("Fire::light            {:>10.2?}", least(|_| Fire::default().light(SPACE)));
    println!("Burning::at            {:>10.2?}", least(|t| burning.at(t)));
    println!("Burning::sparks        {:>10.2?}", least(|t| burning.sparks(t)));
    let flame = burning.at(1.0);
    for cells in [UVec3::new(24, 48, 24), UVec3::new(48, 96, 48)] {
        let grid = flame.grid(cells)?;
        println!("{cells}");
        println!("  Flame::grid          {:>10.2?}", least(|_| flame.grid(cells)));
        println!("  Grid::slabs          {:>10.2?}", least(|_| grid.slabs(6, 32, DVec3::Y, DMat3::IDENTITY)));
        println!("  Grid::power          {:>10.2?}", least(|_| grid.power()));
    }
    Ok(())
}
