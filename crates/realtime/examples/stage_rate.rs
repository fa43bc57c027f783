//! Milliseconds per pass of the stage, and the pictures that it makes.
//!
//! `stage_rate` prints how the time grows with triangles, from a thousand to two millions.
//! `stage_rate rays SCENE…` prints how many random rays a second shaders trace: nearest hit, and any hit.
//! `stage_rate SCENE OUT.exr [WIDTH HEIGHT [FRAMES]]` shows a scene and writes its picture and AOVs.

use glam::{Mat4, Vec2, Vec3};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use wgpu::util::DeviceExt;
use yugen_archive::formats::{image, load_scene};
use yugen_optics::ColourSpace;
use yugen_optics::random::Pcg32;
use yugen_realtime::hierarchy::HIERARCHY_WGSL;
use yugen_realtime::scene::{SceneBuffers, scene_wgsl};
use yugen_realtime::surface::OPAQUE_WGSL;
use yugen_realtime::{Gpu, Options, Stage};
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
        [verb, scenes @ ..] if verb == "rays" => {
            scenes.iter().try_for_each(|s| rays(&device, &queue, Path::new(s)))
        }
        [scene, out, ..] => {
            let size = [number(2, 640)?, number(3, 480)?];
            picture(&device, &queue, Path::new(scene), Path::new(out), size, number(4, 16)?)
        }
        _ => Err("usage: stage_rate [rays SCENE... | SCENE OUT.exr [WIDTH HEIGHT [FRAMES]]]".into()),
    }
}

/// The fastest device, with the default limits of WebGPU and larger buffers where it has them.
fn open() -> Result<(wgpu::Device, wgpu::Queue)> {
    let opened = Gpu::open()?;
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
    let rows = Rows::new(&scene)?;
    let mut camera = match scene.cameras.first() {
        Some(camera) => camera.clone(),
        None => scene.framing_camera(Film::default()),
    };
    camera.resize(width, height);
    let size = camera.film.crop.map_or([width, height], |c| [c[2], c[3]]);
    let start = Instant::now();
    let options = Options {
        size,
        filter: camera.film.filter,
        aovs: AOVS.to_vec(),
        trace_camera: false,
        threads: 2,
        bounces: Some(8),
        hide_emitters: false,
        seed: 0,
    };
    let mut stage = Stage::new(device, queue, &rows, &options)?;
    println!("{} triangles, ready after {:.2} s", rows.triangles.len(), start.elapsed().as_secs_f64());
    for _ in 0..frames {
        stage.frame(&camera)?;
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
                bounces: None,
                hide_emitters: false,
                seed: 0,
            };
            let mut stage = Stage::new(device, queue, &rows, &options)?;
            ready = start.elapsed().as_secs_f64();
            build = stage.scene().hierarchy_stats().build_seconds;
            // The least of some: the first ones compile.
            let mut least = vec![f64::INFINITY; 2];
            for _ in 0..8 {
                stage.frame(&camera)?;
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

const RAYS: &str = "
@group(1) @binding(0) var<storage, read_write> rays: array<vec4<f32>>;
@compute @workgroup_size(64)
fn closest(@builtin(global_invocation_id) id: vec3<u32>) {
    rays[2u * id.x].w = trace_closest(rays[2u * id.x].xyz, rays[2u * id.x + 1u].xyz, 0.0, 1e30).t;
}
@compute @workgroup_size(64)
fn any_hit(@builtin(global_invocation_id) id: vec3<u32>) {
    rays[2u * id.x].w = trace_any(rays[2u * id.x].xyz, rays[2u * id.x + 1u].xyz, 0.0, 1e30);
}";

/// Rays between random points of the scene's box. On a software GPU the time of the cores says more than the clock.
fn rays(device: &wgpu::Device, queue: &wgpu::Queue, path: &Path) -> Result<()> {
    let scene = load_scene(path, &Default::default())?;
    let rows = rows_of(&scene)?;
    let [lo, hi] = scene.bounds().ok_or("there is nothing in it")?;
    let count = 1u32 << 18;
    let mut rng = Pcg32::new(1, 1);
    let mut point = || lo + (hi - lo) * Vec3::from_array(std::array::from_fn(|_| rng.next_f32()));
    let rays: Vec<[f32; 4]> = (0..count)
        .flat_map(|_| {
            let (from, to) = (point(), point());
            [from.extend(0.0).to_array(), (to - from).extend(0.0).to_array()]
        })
        .collect();
    let buffers = SceneBuffers::new(device, &rows, 2)?;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(
            [&scene_wgsl(), HIERARCHY_WGSL, OPAQUE_WGSL, RAYS].join("\n").into(),
        ),
    });
    let lists = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: false },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(buffers.layout()), Some(&lists)],
        immediate_size: 0,
    });
    let input = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(&rays),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &lists,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: input.as_entire_binding() }],
    });
    for name in ["closest", "any_hit"] {
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&layout),
            module: &module,
            entry_point: Some(name),
            compilation_options: Default::default(),
            cache: None,
        });
        let run = || -> Result<()> {
            let mut encoder = device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&pipeline);
                pass.set_bind_group(0, buffers.group(), &[]);
                pass.set_bind_group(1, &group, &[]);
                pass.dispatch_workgroups(count / 64, 1, 1);
            }
            queue.submit([encoder.finish()]);
            device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None })?;
            Ok(())
        };
        run()?;
        let times = 4;
        let (start, cpu) = (Instant::now(), cpu_seconds());
        for _ in 0..times {
            run()?;
        }
        let million = f64::from(times * count) * 1e-6;
        let clock = million / start.elapsed().as_secs_f64();
        let cpu = cpu.zip(cpu_seconds()).map_or(String::new(), |(from, to)| {
            format!(", {:.2} a second of CPU", million / (to - from).max(1e-3))
        });
        println!(
            "{:20} {name:8} {clock:.2} M rays a second{cpu}",
            path.file_name().unwrap_or_default().display()
        );
    }
    Ok(())
}

/// That this process has used, where the system tells.
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut fields = stat.rsplit(')').next()?.split_whitespace().skip(11);
    let ticks: [f64; 2] = [fields.next()?.parse().ok()?, fields.next()?.parse().ok()?];
    // Linux counts in hundredths.
    Some((ticks[0] + ticks[1]) * 0.01)
}
