//! Silk that falls on a ball, moved and drawn on the GPU: `draped FOLDER [FRAMES [CELLS]]` writes a picture after every tenth of a second
//! and prints milliseconds, of the cloth's steps and of taking it over into the scene.

use glam::{Mat4, Vec2, Vec3};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use yugen_archive::formats::image;
use yugen_motion::cloth::{Cloth, PRESETS, Settings, Sheet, SmallSteps, Solid, Stance, Step};
use yugen_optics::ColourSpace;
use yugen_realtime::{ClothPass, Gpu, Options, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{
    Camera, Film, Filter, Geometry, Light, Material, Mesh, ModelBuilder, Projection, Scene, Shape, Value,
    look_along,
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const SIZE: [u32; 2] = [480, 360];
/// Frames of the stage in a picture.
const SAMPLES: u32 = 32;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let Some(folder) = words.first() else {
        return Err("usage: draped FOLDER [FRAMES [CELLS]]".into());
    };
    let number = |i: usize, default: u32| words.get(i).map_or(Ok(default), |word| word.parse());
    let (frames, cells) = (number(1, 90)?, number(2, 64)?);
    std::fs::create_dir_all(folder)?;

    let corner = Vec3::new(-0.5, 0.32, -0.5);
    let sheet = Sheet::rectangle(corner, Vec3::X, Vec3::Z, Vec2::ONE, [cells; 2]);
    let ball = Solid::Capsule { ends: [Vec3::ZERO; 2], radii: [0.3; 2] };
    let floor = Stance { origin: Vec3::Y * -0.45, ..Stance::default() };
    let scene = scene(&sheet)?;
    let cloth = Cloth::new(sheet, &PRESETS[0].fabric)?;
    let vertices: Vec<u32> = (0..cloth.masses.len() as u32).collect();
    let solver = SmallSteps::new(cloth, &[], Settings::default())?
        .with_bodies(vec![(ball, Stance::default()), (Solid::Ground, floor)])?;

    let gpu = Gpu::open()?;
    println!("{} vertices on {}", vertices.len(), gpu.name);
    let rows = Rows::new(&scene)?;
    let mut cloth = ClothPass::new(&gpu.device, &gpu.queue, &solver)?;
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &Options::new(SIZE, Some(2)))?;
    // Every vertex of the first mesh is that of the cloth.
    stage.drape(rows.draws[0].mesh, &cloth, &vertices)?;
    let (mut moved, mut taken, mut pictures) = (0.0, 0.0, 0u32);
    for frame in 1..=frames {
        let start = Instant::now();
        cloth.step(&Step::default());
        stage.wait()?;
        moved += start.elapsed().as_secs_f64();
        if frame % 6 != 0 {
            continue;
        }
        let start = Instant::now();
        stage.follow()?;
        stage.wait()?;
        taken += start.elapsed().as_secs_f64();
        pictures += 1;
        for _ in 0..SAMPLES {
            stage.frame(&camera())?;
        }
        let name = format!("{pictures:02}.png");
        image::write(
            &Path::new(folder).join(name),
            &stage.image()?,
            &image::WriteOptions::from(ColourSpace::default()),
        )?;
    }
    let per = |seconds: f64, count: u32| seconds * 1e3 / f64::from(count.max(1));
    println!("a step {:.2} ms, taken over {:.2} ms", per(moved, frames), per(taken, pictures));
    Ok(())
}

/// The sheet above a ball on a floor.
fn scene(sheet: &Sheet) -> Result<Scene> {
    let cloth = Mesh {
        positions: sheet.positions.clone(),
        triangles: sheet.triangles.clone(),
        normals: vec![Vec3::Y; sheet.positions.len()],
        ..Mesh::default()
    };
    let matte = |r, g, b| Material::lambert(Value::Rgb(Vec3::new(r, g, b)));
    let silk = ModelBuilder::with(
        Kind::MetallicRoughness,
        &[
            ("base_color", Value::Rgb(Vec3::new(0.55, 0.05, 0.08))),
            ("metallic", Value::Number(0.0)),
            ("roughness", Value::Number(0.45)),
        ],
    )?;
    let silk = silk.build()?;
    let floor = Mat4::from_translation(Vec3::Y * -0.45) * Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let floor = floor * Mat4::from_scale(Vec3::splat(4.0));
    let shape = |name: &str, geometry, to_world, material| Shape::new(name, geometry, to_world, material);
    Ok(Scene {
        materials: vec![
            Material::TwoSided { front: 1, back: 1 },
            silk,
            matte(0.2, 0.3, 0.5),
            matte(0.4, 0.4, 0.4),
        ],
        shapes: vec![
            shape("silk", Geometry::Mesh(Arc::new(cloth)), Mat4::IDENTITY, 0),
            shape("ball", Geometry::Sphere, Mat4::from_scale(Vec3::splat(0.297)), 2),
            shape("floor", Geometry::Rectangle, floor, 3),
        ],
        lights: vec![
            Light::Point { position: Vec3::new(1.5, 3.0, 2.0), intensity: Vec3::splat(22.0) },
            Light::Point { position: Vec3::new(-3.0, 1.0, 1.0), intensity: Vec3::splat(5.0) },
        ],
        ..Scene::default()
    })
}

fn camera() -> Camera {
    let eye = Vec3::new(0.6, 0.7, 2.2);
    Camera {
        name: "camera".into(),
        to_world: look_along(eye, Vec3::new(0.0, -0.1, 0.0) - eye, Vec3::Y),
        projection: Projection::pinhole(0.75),
        near_far: [0.01, 100.0],
        film: Film { width: SIZE[0], height: SIZE[1], crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }
}
