//! Milliseconds per pass of the stage, and the pictures that it makes.
//!
//! `stage_rate` prints how the time grows with triangles, from a thousand to two millions.
//! `stage_rate SCENE OUT.exr [WIDTH HEIGHT [FRAMES]]` shows a scene and writes its AOVs.

use glam::{Mat4, Vec2, Vec3};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use yugen_archive::formats::{image, load_scene};
use yugen_optics::ColourSpace;
use yugen_realtime::{Options, Stage};
use yugen_scene::prepared::Rows;
use yugen_scene::{
    Aov, Camera, Film, Filter, FovAxis, Geometry, Projection, Scene, Shape, look_along, primitives,
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (device, queue) = open()?;
    let number = |i: usize, default: u32| arguments.get(i).map_or(Ok(default), |s| s.parse());
    match &arguments[..] {
        [] => growth(&device, &queue),
        [scene, out, ..] => {
            let size = [number(2, 640)?, number(3, 480)?];
            picture(&device, &queue, Path::new(scene), Path::new(out), size, number(4, 16)?)
        }
        _ => Err("usage: stage_rate [SCENE OUT.exr [WIDTH HEIGHT [FRAMES]]]".into()),
    }
}

/// The fastest device, with the default limits of WebGPU and larger buffers where it has them.
fn open() -> Result<(wgpu::Device, wgpu::Queue)> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let opened = pollster::block_on(yugen_realtime::device::open(&instance, None))?;
    println!("on {}", opened.name);
    Ok((opened.device, opened.queue))
}

const AOVS: [Aov; 6] = [Aov::Normal, Aov::ShadingNormal, Aov::Depth, Aov::Position, Aov::Uv, Aov::Id];

fn rows_of(scene: &Scene) -> Result<Rows> {
    let mut rows = Rows::default();
    rows.add_shapes(scene, &|_| false, &|_| None)?;
    Ok(rows)
}

fn picture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    path: &Path,
    out: &Path,
    [width, height]: [u32; 2],
    frames: u32,
) -> Result<()> {
    let scene = load_scene(path, &Default::default())?;
    let rows = rows_of(&scene)?;
    let mut camera = match scene.cameras.first() {
        Some(camera) => camera.clone(),
        None => scene.framing_camera(Film::default()),
    };
    camera.resize(width, height);
    let size = camera.film.crop.map_or([width, height], |c| [c[2], c[3]]);
    let start = Instant::now();
    let options =
        Options { size, filter: camera.film.filter, aovs: AOVS.to_vec(), trace_camera: false, threads: 2 };
    let mut stage = Stage::new(device, queue, &rows, &options)?;
    println!("{} triangles, ready after {:.2} s", rows.triangles.len(), start.elapsed().as_secs_f64());
    for _ in 0..frames {
        stage.frame(&camera, None)?;
    }
    let written = stage.image()?;
    for time in stage.timings() {
        println!("{:16} {:8.2} ms", time.pass, time.milliseconds);
    }
    image::write(out, &written, &image::WriteOptions::from(ColourSpace::default()))?;
    Ok(())
}

/// Balls of more and more triangles at 640 x 480.
fn growth(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<()> {
    println!(
        "{:>10} {:>8} {:>8} {:>10} {:>10} {:>10}",
        "triangles", "build s", "ready s", "raster ms", "trace ms", "normal ms"
    );
    let camera = Camera {
        name: "bench".into(),
        to_world: look_along(Vec3::new(0.0, 0.0, 3.0), -Vec3::Z, Vec3::Y),
        projection: Projection::Perspective {
            fov_x: 0.8,
            fov_axis: FovAxis::X,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            principal_point: Vec2::ZERO,
        },
        near_far: [0.1, 100.0],
        film: Film { width: 640, height: 480, crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    };
    for segments in [32, 100, 320, 1000, 1414] {
        let ball = Geometry::Mesh(Arc::new(primitives::ball(segments)));
        let shapes = vec![Shape::new("ball", ball, Mat4::IDENTITY, 0)];
        let rows = rows_of(&Scene { shapes, ..Scene::default() })?;
        let mut times = Vec::new();
        let (mut ready, mut build) = (0.0, 0.0);
        for trace_camera in [false, true] {
            let start = Instant::now();
            let options = Options {
                size: [640, 480],
                filter: Filter::Box,
                aovs: vec![Aov::ShadingNormal],
                trace_camera,
                threads: 2,
            };
            let mut stage = Stage::new(device, queue, &rows, &options)?;
            ready = start.elapsed().as_secs_f64();
            build = stage.scene().hierarchy_stats().build_seconds;
            // The least of some: the first ones compile.
            let mut least = vec![f64::INFINITY; 2];
            for _ in 0..8 {
                stage.frame(&camera, None)?;
                device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None })?;
                for (least, time) in least.iter_mut().zip(stage.timings()) {
                    *least = least.min(time.milliseconds);
                }
            }
            times.push(least);
        }
        println!(
            "{:>10} {build:>8.2} {ready:>8.2} {:>10.2} {:>10.2} {:>10.2}",
            rows.triangles.len(),
            times[0][0],
            times[1][0],
            times[0][1]
        );
    }
    Ok(())
}
