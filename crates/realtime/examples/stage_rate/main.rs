//! What a frame costs on the adapter at hand, from this one program alone.
//!
//! `stage_rate` prints the whole table, in a few minutes on a software GPU: passes, and how time grows with pixels,
//! triangles, lights and samples of an environment, and with the fires of a Noh stage; and what a frame of cloth does.
//! `stage_rate passes`, `pixels`, `triangles`, `lights`, `environment`, `takigi`, `cloth [CELLS…]` or
//! `contact` prints that part.
//! `stage_rate scene BOUNCES FRAMES SCENE…` prints the passes of scene files at 320 x 240.
//! `stage_rate rays SCENE…` prints how many random rays a second shaders trace: nearest hit, and any hit.
//! `stage_rate preview SCENE FOLDER` writes what is shown in the 1st, 4th and 16th frame, standing still and after a turn,
//! with and without previews, and the mean of 512 frames; prints how far the former are from the latter.
//! `stage_rate picture SCENE OUT.exr [WIDTH HEIGHT [FRAMES]]` shows a scene and writes its picture and AOVs.

mod cloth;

use glam::{Mat4, Vec3};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use wgpu::util::DeviceExt;
use yugen_archive::formats::{image, load_scene};
use yugen_motion::fire::Fire;
use yugen_noh::{FireLight, Hour};
use yugen_optics::flip::mean_flip;
use yugen_optics::random::Pcg32;
use yugen_optics::tonemap::{Curve, ToneMap};
use yugen_optics::{ColourSpace, Image};
use yugen_realtime::hierarchy::HIERARCHY_WGSL;
use yugen_realtime::scene::{SceneBuffers, scene_wgsl};
use yugen_realtime::surface::OPAQUE_WGSL;
use yugen_realtime::{Gpu, Options, Preview, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::{Rows, SLABS};
use yugen_scene::{
    Aov, Camera, Film, Filter, Geometry, Light, Material, ModelBuilder, Projection, Scene, Shape, Value,
    look_along, primitives,
};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let number = |i: usize, default: u32| words.get(i).map_or(Ok(default), |s| s.parse());
    let gpu = Gpu::open()?;
    println!("on {}", gpu.name);
    match &words[..] {
        [] => {
            passes(&gpu)?;
            pixels(&gpu)?;
            triangles(&gpu)?;
            lights(&gpu)?;
            environment(&gpu)?;
            takigi(&gpu)?;
            cloth::print(&gpu, &CELLS)?;
            cloth::contact(&gpu, &HEAPS)
        }
        ["passes"] => passes(&gpu),
        ["pixels"] => pixels(&gpu),
        ["triangles"] => triangles(&gpu),
        ["lights"] => lights(&gpu),
        ["environment"] => environment(&gpu),
        ["takigi"] => takigi(&gpu),
        ["cloth"] => cloth::print(&gpu, &CELLS),
        ["cloth", cells @ ..] => {
            let cells = cells.iter().map(|n| n.parse()).collect::<std::result::Result<Vec<u32>, _>>()?;
            cloth::print(&gpu, &cells)
        }
        ["contact"] => cloth::contact(&gpu, &HEAPS),
        ["scene", bounces, frames, scenes @ ..] => {
            println!("{HEAD}");
            let (bounces, frames) = (bounces.parse()?, frames.parse()?);
            scenes.iter().try_for_each(|s| scene_file(&gpu, Path::new(s), bounces, frames))
        }
        ["rays", scenes @ ..] => {
            scenes.iter().try_for_each(|s| rays(&gpu.device, &gpu.queue, Path::new(s)))
        }
        ["preview", scene, folder] => previews(&gpu, Path::new(scene), Path::new(folder)),
        ["picture", scene, out, ..] => {
            let size = [number(3, 640)?, number(4, 480)?];
            picture(&gpu, Path::new(scene), Path::new(out), size, number(5, 16)?)
        }
        _ => Err("usage: stage_rate [passes | pixels | triangles | lights | environment | takigi | cloth [CELLS...] | contact | scene BOUNCES FRAMES SCENE... | \
                  rays SCENE... | preview SCENE FOLDER | picture SCENE OUT.exr [WIDTH HEIGHT [FRAMES]]]"
            .into()),
    }
}

/// Cells along a side of the cloth.
const CELLS: [u32; 3] = [32, 64, 128];

/// Cells along a side of cloth that touches itself, and sheets above each other.
const HEAPS: [[u32; 2]; 4] = [[32, 1], [64, 1], [36, 3], [128, 1]];

const AOVS: [Aov; 6] = [Aov::Normal, Aov::ShadingNormal, Aov::Depth, Aov::Position, Aov::Uv, Aov::Id];

const HEAD: &str =
    "scene                 ready s  visible ms   shade ms  ms/Mpx shaded  clock ms/Mpx  CPU s/Mpx";

/// What frames of a scene cost, each the mean of some.
struct Cost {
    /// Seconds until the first frame can be asked for.
    ready: f64,
    /// Seconds of it that the trees of boxes took.
    build: f64,
    /// Milliseconds of each pass, in the order of the frame; empty where the device has no timestamps.
    passes: Vec<(&'static str, f64)>,
    /// Seconds of the clock a frame.
    clock: f64,
    /// Seconds of all cores a frame, where the system tells.
    cpu: Option<f64>,
    /// Millions of pixels that see a surface.
    shaded: f64,
    /// Millions of pixels.
    pixels: f64,
    /// The last frame's sum.
    image: Image,
}

impl Cost {
    fn pass(&self, name: &str) -> f64 {
        self.passes.iter().filter(|(pass, _)| *pass == name).map(|(_, ms)| ms).sum()
    }

    fn print(&self, name: &str) {
        let all: f64 = self.passes.iter().map(|(_, ms)| ms).sum();
        let cpu = self.cpu.map_or("-".into(), |s| format!("{:.2}", s / self.pixels));
        println!(
            "{name:<20} {:>8.2} {:>11.1} {:>10.1} {:>14.0} {:>13.0} {cpu:>10}",
            self.ready,
            self.pass("visibility"),
            self.pass("shade"),
            all / self.shaded.max(1e-9),
            1e3 * self.clock / self.pixels,
        );
    }
}

/// `frames` frames after two that warm up.
fn cost(gpu: &Gpu, rows: &Rows, camera: &Camera, change: &dyn Fn(&mut Options), frames: u32) -> Result<Cost> {
    let [_, _, width, height] = camera.film.crop.unwrap_or([0, 0, camera.film.width, camera.film.height]);
    let mut options = Options { filter: camera.film.filter, ..Options::new([width, height], Some(1)) };
    change(&mut options);
    let start = Instant::now();
    let mut stage = Stage::new(&gpu.device, &gpu.queue, rows, &options)?;
    let ready = start.elapsed().as_secs_f64();
    let build = stage.scene().hierarchy_stats().build_seconds;
    // The first compiles, and the timings of a frame come with the next.
    for _ in 0..2 {
        stage.frame(camera)?;
        stage.wait()?;
    }
    let (start, cpu) = (Instant::now(), cpu_seconds());
    let mut passes: Vec<(&'static str, f64)> = Vec::new();
    for i in 0..frames {
        stage.frame(camera)?;
        stage.wait()?;
        // Those of the frame before.
        for (k, time) in stage.timings().iter().enumerate() {
            if i == 0 {
                passes.push((time.pass, 0.0));
            }
            passes[k].1 += time.milliseconds / f64::from(frames);
        }
    }
    let n = f64::from(frames);
    let clock = start.elapsed().as_secs_f64() / n;
    let cpu = cpu.zip(cpu_seconds()).map(|(from, to)| (to - from) / n);
    let image = stage.image()?;
    let shaded = match image.channel("A") {
        Some(a) => image.data.chunks(image.channels.len()).map(|p| f64::from(p[a])).sum::<f64>() * 1e-6,
        None => f64::from(width * height) * 1e-6,
    };
    Ok(Cost { ready, build, passes, clock, cpu, shaded, pixels: f64::from(width * height) * 1e-6, image })
}

fn camera(size: [u32; 2]) -> Camera {
    Camera {
        name: "bench".into(),
        to_world: look_along(Vec3::new(0.0, 0.0, 3.0), -Vec3::Z, Vec3::Y),
        projection: Projection::pinhole(0.8),
        near_far: [0.1, 100.0],
        film: Film { width: size[0], height: size[1], crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }
}

fn model(kind: Kind, set: &[(&str, f32)]) -> Result<Material> {
    let mut builder = ModelBuilder::new(kind);
    for (param, value) in set {
        builder.set(param, Value::Number(*value))?;
    }
    Ok(builder.build()?)
}

/// Two balls, one of them glossy, in front of a floor and a wall that fill the picture.
fn room() -> Result<Scene> {
    let both = |front| Material::TwoSided { front, back: front };
    let wall = |to_world| Shape::new("wall", Geometry::Rectangle, to_world, 3);
    let ball = |x: f32, material| {
        let place = Mat4::from_translation(Vec3::new(x, -0.3, 0.0)) * Mat4::from_scale(Vec3::splat(0.4));
        Shape::new("ball", Geometry::Sphere, place, material)
    };
    Ok(Scene {
        materials: vec![
            model(Kind::Lambert, &[("reflectance", 0.5)])?,
            both(0),
            model(Kind::Ggx, &[("alpha_x", 0.1), ("alpha_y", 0.3)])?,
            both(0),
        ],
        shapes: vec![
            ball(-0.5, 1),
            ball(0.5, 2),
            wall(Mat4::from_translation(Vec3::Z * -1.0) * Mat4::from_scale(Vec3::splat(6.0))),
            wall(
                Mat4::from_translation(Vec3::Y * -0.7)
                    * Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2)
                    * Mat4::from_scale(Vec3::splat(6.0)),
            ),
        ],
        ..Scene::default()
    })
}

/// So many point lights in a ring above the balls, of the same intensity together.
fn point_lights(count: u32) -> Vec<Light> {
    (0..count)
        .map(|i| {
            let (sin, cos) = (std::f32::consts::TAU * (i as f32 + 0.5) / count as f32).sin_cos();
            let position = Vec3::new(1.5 * cos, 1.6, 1.0 + 0.8 * sin);
            Light::Point { position, intensity: Vec3::splat(6.0 / count as f32) }
        })
        .collect()
}

/// A lamp overhead.
fn lamp() -> Shape {
    let place = Mat4::from_translation(Vec3::new(0.0, 1.6, 0.8))
        * Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2)
        * Mat4::from_scale(Vec3::splat(0.4));
    Shape { emission: Some(Value::Number(8.0)), ..Shape::new("lamp", Geometry::Rectangle, place, 3) }
}

/// A sky with a sun of a few degrees: 128 x 64 pixels.
fn sky() -> Image {
    let mut sky = Image::rgb(128, 64);
    for (i, pixel) in sky.data.chunks_mut(3).enumerate() {
        let (x, y) = (i % 128, i / 128);
        let value = if (40..42).contains(&x) && (12..14).contains(&y) { 400.0 } else { 0.5 };
        pixel.copy_from_slice(&[value, value, if value > 1.0 { value } else { 0.8 }]);
    }
    sky
}

fn passes(gpu: &Gpu) -> Result<()> {
    println!("\nOne light, 640 x 480\n{HEAD}");
    let area = |mut scene: Scene| {
        scene.shapes.push(lamp());
        scene
    };
    for (name, scene, bounces) in [
        ("point light", Scene { lights: point_lights(1), ..room()? }, 1),
        ("area light", area(room()?), 1),
        ("area, 8 bounces", area(room()?), 8),
    ] {
        let rows = Rows::new(&scene)?;
        cost(gpu, &rows, &camera([640, 480]), &|o| o.bounces = Some(bounces), 3)?.print(name);
    }
    let rows = Rows::new(&area(room()?))?;
    let layers = cost(gpu, &rows, &camera([640, 480]), &|o| (o.aovs, o.bounces) = (AOVS.to_vec(), None), 2)?;
    for (pass, ms) in layers.passes {
        println!("  {pass:<18} {ms:>8.2} ms");
    }
    Ok(())
}

fn pixels(gpu: &Gpu) -> Result<()> {
    println!("\nOne area light, more pixels\n{HEAD}");
    let mut scene = room()?;
    scene.shapes.push(lamp());
    let rows = Rows::new(&scene)?;
    for size in [[320, 240], [640, 480], [1280, 960]] {
        cost(gpu, &rows, &camera(size), &|_| (), 2)?.print(&format!("{} x {}", size[0], size[1]));
    }
    Ok(())
}

fn lights(gpu: &Gpu) -> Result<()> {
    println!("\nPoint lights with shadows, 320 x 240\n{HEAD}");
    for count in [1, 4, 16, 64] {
        let rows = Rows::new(&Scene { lights: point_lights(count), ..room()? })?;
        cost(gpu, &rows, &camera([320, 240]), &|_| (), 3)?.print(&format!("{count}"));
    }
    Ok(())
}

/// The sum of frames, each with one sample of the environment a pixel.
fn environment(gpu: &Gpu) -> Result<()> {
    println!("\nSamples of an environment a pixel, 160 x 120: noise against 256 of them\n{HEAD}    noise");
    let light = Light::Environment { image: Arc::new(sky()), scale: 1.0, to_world: Mat4::IDENTITY };
    let rows = Rows::new(&Scene { lights: vec![light], ..room()? })?;
    let many = cost(gpu, &rows, &camera([160, 120]), &|o| o.seed = 1, 254)?.image;
    for samples in [4, 16, 64] {
        let mut few = cost(gpu, &rows, &camera([160, 120]), &|_| (), samples)?;
        let off = |f: &dyn Fn(f32, f32) -> f32| -> f64 {
            few.image.data.iter().zip(&many.data).map(|(a, b)| f64::from(f(*a, *b))).sum()
        };
        let noise = (off(&|a, b| (a - b) * (a - b)) / off(&|_, b| b * b)).sqrt();
        // Of all frames, not of one.
        for (_, ms) in &mut few.passes {
            *ms *= f64::from(samples);
        }
        few.clock *= f64::from(samples);
        few.cpu = few.cpu.map(|s| s * f64::from(samples));
        few.print(&format!("{samples}"));
        println!("{:>96.1} %", 100.0 * noise);
    }
    Ok(())
}

/// The Noh stage by night: what its fires cost, and how near the shading of their light is to the arithmetic that it needs.
fn takigi(gpu: &Gpu) -> Result<()> {
    let peak = flop_rate()?;
    println!(
        "\nThe Noh stage by night, 320 x 180, {:.1} Gflop/s attainable\n{HEAD}  pose ms  light Gflop/s",
        peak * 1e-9
    );
    let stage = yugen_noh::Stage::preset("national")?;
    let one = Fire { diameter: stage.fires()[0].diameter, ..Fire::default() };
    let seen = |scene: &Scene, size: [u32; 2]| -> Result<Camera> {
        let mut camera = scene.cameras.first().ok_or("the stage has no seats")?.clone();
        camera.resize(size[0], size[1]);
        Ok(camera)
    };
    let row = |name: &str, scene: &mut Scene, size: [u32; 2], hide: bool| -> Result<(f64, Cost)> {
        let mut rows = Rows::new(scene)?;
        let start = Instant::now();
        if !scene.fires.is_empty() {
            scene.pose(None, 1.0)?;
            rows.pose(scene)?;
        }
        let pose = 1e3 * start.elapsed().as_secs_f64();
        let cost = cost(gpu, &rows, &seen(scene, size)?, &|o| o.hide_emitters = hide, 2)?;
        cost.print(name);
        Ok((pose, cost))
    };
    let small = [320, 180];
    let points = row("4 points", &mut stage.scene(Hour::Night, FireLight::Points)?, small, false)?.1;
    let mut shares = None;
    for count in [1, 2, 4, 8, 16] {
        let mut scene = stage.scene(Hour::Night, FireLight::Out)?;
        let stands = stage.fires();
        for i in 0..count {
            // Those of the stage, and then a ring around it.
            let (sin, cos) = (i as f32 * std::f32::consts::TAU / 12.0).sin_cos();
            let ring = Vec3::new(9.0 * cos, stands[0].foot.y, 9.0 * sin);
            let foot = stands.get(i).map_or(ring, |stand| stand.foot);
            scene.add_fire("", &Fire { foot, seed: i as u32 + 1, ..one }, None, 0.0)?;
        }
        let (pose, cost) = row(&format!("fires: {count}"), &mut scene, small, false)?;
        let shading = f64::from(150 + 90 * (SLABS * count) as u32) * cost.shaded * 1e6;
        let rate = 1e-9 * shading / (1e-3 * cost.pass("shade"));
        println!("{:>92.0} {rate:>14.2} = {:.1} %", pose, 1e11 * rate / peak);
        if count == 4 {
            let hidden = row("4 fires unseen", &mut scene, small, true)?.1;
            let all: f64 = cost.passes.iter().map(|(_, ms)| ms).sum();
            let [seen, light] = [&cost, &hidden].map(|c| c.pass("shade"));
            shares = Some([seen - light, light - points.pass("shade")].map(|ms| 100.0 * ms / all));
        }
    }
    if let Some([seen, light]) = shares {
        println!(
            "of a frame with 4 fires: flames {seen:.0} %, their light beyond that of points {light:.0} %"
        );
    }
    let mut four = stage.scene(Hour::Night, FireLight::Flames)?;
    for size in [[160, 90], [640, 360]] {
        row(&format!("4 fires, {} x {}", size[0], size[1]), &mut four, size, false)?;
    }
    Ok(())
}

/// Multiplications and additions a second that shaders reach where they do nothing else.
fn flop_rate() -> Result<f64> {
    const EACH: u32 = 1024;
    let shader = |rounds: u32| {
        format!(
            "@group(0) @binding(0) var<storage, read_write> out: array<f32>;
             @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                 var a = vec4<f32>(vec4<u32>(id.x) + vec4<u32>(0u, 1u, 2u, 3u)) * 1e-6;
                 var b = a + 0.5;
                 for (var i = 0u; i < {rounds}u; i += 1u) {{ a = fma(a, b, a); b = fma(b, a, b) - a * b; }}
                 out[id.x] = a.x + a.y + a.z + a.w + b.x;
             }}"
        )
    };
    let gpu = yugen_proof::gpu::Gpu::for_tests().ok_or("no adapter")?;
    let mut rounds = EACH;
    loop {
        let room = vec![0.0; 1 << 16];
        let text = shader(rounds);
        gpu.compute(&text, &[], &room, 1 << 10)?;
        let start = Instant::now();
        gpu.compute(&text, &[], &room, 1 << 10)?;
        let seconds = start.elapsed().as_secs_f64();
        if seconds > 0.2 || rounds > 1 << 24 {
            // Of a round: six operations of four numbers, two in each fma.
            return Ok(f64::from(rounds) * 24.0 * f64::from(1u32 << 16) / seconds);
        }
        rounds *= 4;
    }
}

fn scene_file(gpu: &Gpu, path: &Path, bounces: u32, frames: u32) -> Result<()> {
    let scene = load_scene(path, &Default::default())?;
    let rows = Rows::new(&scene)?;
    let mut camera = match scene.cameras.first() {
        Some(camera) => camera.clone(),
        None => scene.framing_camera(Film::default()),
    };
    camera.resize(320, 240);
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    cost(gpu, &rows, &camera, &|o| o.bounces = Some(bounces), frames)?.print(&name);
    Ok(())
}

fn previews(gpu: &Gpu, path: &Path, folder: &Path) -> Result<()> {
    let scene = load_scene(path, &Default::default())?;
    let rows = Rows::new(&scene)?;
    let mut camera = match scene.cameras.first() {
        Some(camera) => camera.clone(),
        None => scene.framing_camera(Film::default()),
    };
    camera.resize(192, 144);
    let options = Options { filter: camera.film.filter, ..Options::new([192, 144], Some(8)) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options)?;
    let write = |name: &str, image: &Image| {
        image::write(&folder.join(name), image, &image::WriteOptions::from(ColourSpace::default()))
    };
    let none = Preview::default();
    let mut shown = Vec::new();
    let middle = scene.bounds().map_or(Vec3::ZERO, |[lo, hi]| 0.5 * (lo + hi));
    for (name, settings, moved) in [
        ("still_plain", none, false),
        ("still_smooth", Preview::ALL, false),
        ("turned_kept", Preview { reproject: true, ..none }, true),
        ("turned_all", Preview::ALL, true),
    ] {
        stage.set_preview(settings)?;
        stage.set_moving(moved);
        // Towards the camera in steps of a degree around the middle of the scene.
        for step in (1..=8).rev().filter(|_| moved) {
            let mut other = camera.clone();
            let about = Mat4::from_translation(middle)
                * Mat4::from_axis_angle(camera.to_world.y_axis.truncate().normalize(), 0.0175 * step as f32)
                * Mat4::from_translation(-middle);
            other.to_world = about * camera.to_world;
            stage.frame(&other)?;
        }
        for frame in 1..=16 {
            stage.frame(&camera)?;
            if [1, 4, 16].contains(&frame) {
                let image = stage.shown_image()?;
                write(&format!("{name}_{frame}.exr"), &image)?;
                shown.push((name, frame, image));
            }
        }
        for time in stage.timings() {
            println!("{name:14} {:12} {:8.2} ms", time.pass, time.milliseconds);
        }
        // Begins the sum anew.
        stage.place(&rows.draws)?;
    }
    stage.set_preview(none)?;
    stage.set_moving(false);
    for _ in 0..512 {
        stage.frame(&camera)?;
    }
    let reference = stage.image()?;
    write("reference.exr", &reference)?;
    println!("frame           error %    FLIP");
    let display = ToneMap::new(scene.working_space, 0.0, Curve::Clip);
    let displayed = |image: &Image| {
        let mut out = Image::rgb(image.width, image.height);
        for (to, from) in out.data.chunks_exact_mut(3).zip(image.data.chunks_exact(4)) {
            to.copy_from_slice(&display.show(Vec3::from_slice(from)).to_array());
        }
        out
    };
    for (name, frame, image) in shown {
        let sum = |f: &dyn Fn(f32, f32) -> f32| -> f64 {
            image.data.iter().zip(&reference.data).map(|(a, b)| f64::from(f(*a, *b))).sum()
        };
        let error = (sum(&|a, b| (a - b) * (a - b)) / sum(&|_, b| b * b)).sqrt();
        let flip = mean_flip(&displayed(&image), &displayed(&reference)).unwrap_or(f64::NAN);
        println!("{name:12} {frame:>3} {:>7.1} {flip:>7.3}", 100.0 * error);
    }
    Ok(())
}

fn rows_of(scene: &Scene) -> Result<Rows> {
    let mut rows = Rows::default();
    rows.add_shapes(scene, &|_| false, &|_| None)?;
    Ok(rows)
}

fn picture(gpu: &Gpu, path: &Path, out: &Path, [width, height]: [u32; 2], frames: u32) -> Result<()> {
    let scene = load_scene(path, &Default::default())?;
    let rows = Rows::new(&scene)?;
    let mut camera = match scene.cameras.first() {
        Some(camera) => camera.clone(),
        None => scene.framing_camera(Film::default()),
    };
    camera.resize(width, height);
    let written =
        cost(gpu, &rows, &camera, &|o| (o.aovs, o.bounces) = (AOVS.to_vec(), Some(8)), frames.max(3) - 2)?;
    println!("{} triangles, ready after {:.2} s", rows.triangles.len(), written.ready);
    for (pass, ms) in &written.passes {
        println!("{pass:16} {ms:8.2} ms");
    }
    image::write(out, &written.image, &image::WriteOptions::from(ColourSpace::default()))?;
    Ok(())
}

/// Balls of more and more triangles.
fn triangles(gpu: &Gpu) -> Result<()> {
    println!("\nTriangles, 640 x 480: rastered and traced visibility, a layer of normals, a point light\n");
    println!(
        "{:>10} {:>8} {:>8} {:>10} {:>10} {:>10} {:>10}",
        "triangles", "build s", "ready s", "raster ms", "trace ms", "normal ms", "shade ms"
    );
    for segments in [32, 100, 320, 1000, 1414] {
        let ball = Geometry::Mesh(Arc::new(primitives::ball(segments)));
        let shapes = vec![Shape::new("ball", ball, Mat4::IDENTITY, 0)];
        let materials = vec![model(Kind::Lambert, &[("reflectance", 0.5)])?];
        let rows = Rows::new(&Scene { shapes, materials, lights: point_lights(1), ..Scene::default() })?;
        let mut costs = Vec::new();
        for trace_camera in [false, true] {
            let change = |o: &mut Options| {
                o.aovs = vec![Aov::ShadingNormal];
                o.trace_camera = trace_camera;
            };
            costs.push(cost(gpu, &rows, &camera([640, 480]), &change, 2)?);
        }
        println!(
            "{:>10} {:>8.2} {:>8.2} {:>10.2} {:>10.2} {:>10.2} {:>10.2}",
            rows.triangles.len(),
            costs[0].build,
            costs[0].ready,
            costs[0].pass("visibility"),
            costs[1].pass("visibility"),
            costs[0].pass(Aov::ShadingNormal.name()),
            costs[0].pass("shade"),
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
