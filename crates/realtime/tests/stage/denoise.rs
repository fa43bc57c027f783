//! What a denoiser is told of the frames, and what it makes of them.

use crate::device::{Gpu, gpu};
use glam::{Mat4, Vec3};
use yugen_optics::Image;
use yugen_optics::denoise::{ALBEDO, DEPTH, Halves, NORMAL, SURFACE, half};
use yugen_realtime::reconstruction::Reconstruction;
use yugen_realtime::{Options, Stage, StageError};
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{
    Aov, Camera, Filter, Geometry, Light, Material, ModelBuilder, Scene, Shape, Value, look_along,
};

const SIZE: usize = 48;

fn model(kind: Kind, set: &[(&str, Value)]) -> Material {
    ModelBuilder::with(kind, set).and_then(ModelBuilder::build).expect("a model")
}

const MATT: Vec3 = Vec3::new(0.7, 0.4, 0.2);
const SILVERING: f32 = 0.8;

/// A matt floor, a mirror that stands at its end and a matt ball before it, under a small lamp and a faint sky.
fn scene() -> Scene {
    let at = |x, y, z| Mat4::from_translation(Vec3::new(x, y, z));
    let shape = |name: &str, geometry, to_world, material| Shape::new(name, geometry, to_world, material);
    let upwards = Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let mut scene = Scene {
        materials: vec![
            model(Kind::Lambert, &[("reflectance", Value::Rgb(MATT))]),
            // Reflects all light, whatever its angle, but for what its factor takes.
            model(
                Kind::Conductor,
                &[
                    ("eta", Value::Rgb(Vec3::ZERO)),
                    ("k", Value::Rgb(Vec3::splat(15.0))),
                    ("specular_reflectance", Value::Rgb(Vec3::splat(SILVERING))),
                ],
            ),
        ],
        shapes: vec![
            shape("floor", Geometry::Rectangle, upwards * Mat4::from_scale(Vec3::splat(8.0)), 0),
            shape("mirror", Geometry::Rectangle, at(0.0, 1.0, -2.0), 1),
            shape("ball", Geometry::Sphere, at(1.2, 0.5, 0.0) * Mat4::from_scale(Vec3::splat(0.5)), 0),
        ],
        ..Scene::default()
    };
    let mut lamp = shape(
        "lamp",
        Geometry::Rectangle,
        at(-0.5, 3.0, 1.0)
            * Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2)
            * Mat4::from_scale(Vec3::splat(0.3)),
        0,
    );
    lamp.emission = Some(Value::Rgb(Vec3::splat(40.0)));
    scene.shapes.push(lamp);
    scene.add_light("sky", Light::Constant { radiance: Vec3::splat(0.05) });
    scene
}

fn camera() -> Camera {
    crate::camera(look_along(Vec3::new(0.0, 1.0, 4.0), -Vec3::Z, Vec3::Y), [SIZE as u32; 2])
}

fn options(planned: u32) -> Options {
    Options { denoise: true, planned: Some(planned), ..Options::new([SIZE as u32; 2], Some(4)) }
}

fn stage_of(gpu: &Gpu, scene: &Scene, options: &Options) -> Stage {
    let rows = Rows::new(scene).expect("rows");
    Stage::new(&gpu.device, &gpu.queue, &rows, options).expect("a stage")
}

fn stage(gpu: &Gpu, options: &Options) -> Stage {
    stage_of(gpu, &scene(), options)
}

fn frames(gpu: &Gpu, options: &Options, count: u32) -> Stage {
    frames_of(gpu, &scene(), options, count)
}

fn frames_of(gpu: &Gpu, scene: &Scene, options: &Options, count: u32) -> Stage {
    let mut stage = stage_of(gpu, scene, options);
    for _ in 0..count {
        stage.frame(&camera()).expect("a frame");
    }
    stage
}

fn halves(stage: &Stage) -> Halves {
    stage.halves().expect("the device lives").expect("it was made with them")
}

/// Frames one by one, by the differences of the sums.
#[test]
fn variances_and_halves_are_those_of_the_frames() {
    let Some(gpu) = gpu() else { return };
    const FRAMES: u32 = 12;
    let options = Options { aovs: vec![Aov::Variance, Aov::Id], ..options(FRAMES) };
    let mut stage = stage(gpu, &options);
    let mut sums = vec![[0.0f64; 3]; SIZE * SIZE];
    let mut found: Vec<Vec<[f64; 3]>> = Vec::new();
    for _ in 0..FRAMES {
        let count = f64::from(stage.frame(&camera()).expect("a frame"));
        let image = stage.image().expect("a picture");
        let mut own = Vec::new();
        for (sum, p) in sums.iter_mut().zip(image.data.chunks_exact(image.channels.len())) {
            own.push(std::array::from_fn(|c| f64::from(p[c]) * count - sum[c]));
            *sum = std::array::from_fn(|c| f64::from(p[c]) * count);
        }
        found.push(own);
    }
    let image = stage.image().expect("a picture");
    assert_eq!(
        image.channels,
        ["R", "G", "B", "A", "variance.R", "variance.G", "variance.B", "samples.Y", "id.Y"]
    );
    let told = halves(&stage);
    let n = f64::from(FRAMES);
    let (mut noisy, mut differ) = (0, 0);
    for i in 0..SIZE * SIZE {
        let p = image.pixel(i % SIZE, i / SIZE);
        assert_eq!(p[7], FRAMES as f32);
        for c in 0..3 {
            let own: Vec<f64> = found.iter().map(|frame| frame[i][c]).collect();
            let mean = own.iter().sum::<f64>() / n;
            let want = own.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n;
            // What is left of frames after taking sums from sums.
            let rounding = 1e-5 * mean * mean + 1e-12;
            assert!((f64::from(p[4 + c]) - want).abs() < 1e-3 * want + rounding, "{i}: {} {want}", p[4 + c]);
            assert_eq!(told.variance[c][i], p[4 + c]);
            noisy += usize::from(want > 1e-4 * mean * mean);
            let of = |which: usize| {
                let own = (0..FRAMES).filter(|k| half(*k, Some(FRAMES)) == which).map(|k| own[k as usize]);
                let (sum, count) = own.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
                (sum / count, count as f32)
            };
            for which in 0..2 {
                let (want, count) = of(which);
                assert_eq!(told.count[which][i], count);
                let got = f64::from(told.mean[which][c][i]);
                assert!((got - want).abs() < 1e-4 * (want.abs() + mean) + 1e-7, "{i}, {which}: {got} {want}");
            }
            differ += usize::from(told.mean[0][c][i] != told.mean[1][c][i]);
        }
    }
    assert!(noisy > 1000 && differ > 1000, "{noisy} {differ}: there was nothing to find");
}

/// The same of a filter that is negative somewhere: frames of weights +1 and −1.
#[test]
fn variances_and_halves_of_signed_frames_are_right_in_the_mean() {
    let Some(gpu) = gpu() else { return };
    const FRAMES: u32 = 48;
    let filter = Filter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 };
    let weights: Vec<f64> = {
        let reconstruction = Reconstruction::new(filter);
        (0..FRAMES).map(|i| f64::from(reconstruction.sample(i, false).weight)).collect()
    };
    assert!(weights.contains(&-1.0), "the filter is negative nowhere");
    let mut stage = stage(gpu, &Options { filter, ..options(FRAMES) });
    let mut sums = vec![0.0f64; SIZE * SIZE];
    let mut found: Vec<Vec<f64>> = Vec::new();
    let mut whole = 0.0;
    for weight in &weights {
        stage.frame(&camera()).expect("a frame");
        let image = stage.image().expect("a picture");
        whole += weight;
        // Of weights that cancel the picture is the sum.
        let scale = if whole == 0.0 { 1.0 } else { whole };
        let now: Vec<f64> = image.data.chunks(4).map(|p| f64::from(p[1]) * scale).collect();
        found.push(now.iter().zip(&sums).map(|(now, before)| (now - before) / weight).collect());
        sums = now;
    }
    let told = halves(&stage);
    let (mut want, mut got) = (0.0, 0.0);
    for i in 0..SIZE * SIZE {
        let mean = sums[i] / whole;
        let squares: f64 = found.iter().map(|frame| (frame[i] - mean).powi(2)).sum();
        want += squares / f64::from(FRAMES - 1) * f64::from(FRAMES) / (whole * whole);
        got += f64::from(told.variance[1][i]);
        for which in 0..2 {
            let own = (0..FRAMES).filter(|k| half(*k, Some(FRAMES)) == which).map(|k| k as usize);
            let (sum, weight) =
                own.fold((0.0, 0.0), |(s, w), k| (s + weights[k] * found[k][i], w + weights[k]));
            let (mean_of_half, want) = (f64::from(told.mean[which][1][i]), sum / weight);
            assert_eq!(told.count[which][i], weight as f32);
            assert!((mean_of_half - want).abs() < 1e-4 * (want.abs() + mean.abs()) + 1e-5, "{i}, {which}");
        }
    }
    println!("variance of {FRAMES} signed frames: {:.3} of what they have", got / want);
    // Measured .987.
    assert!((got / want - 1.0).abs() < 0.05, "{got} {want}");
}

#[test]
fn a_denoiser_is_told_what_is_seen_in_mirrors_too() {
    let Some(gpu) = gpu() else { return };
    let stage = frames(gpu, &Options { aovs: vec![Aov::Albedo], ..options(16) }, 16);
    let told = halves(&stage);
    let image = stage.image().expect("a picture");
    let first = image.select(&["albedo.R", "albedo.G", "albedo.B"]).expect("its albedo");
    let at = |x: usize, y: usize| {
        let i = y * SIZE + x;
        let mean = |v: usize| 0.5 * (told.mean[0][v][i] + told.mean[1][v][i]);
        let three = |from: usize| Vec3::new(mean(from), mean(from + 1), mean(from + 2));
        (three(ALBEDO.start), three(NORMAL.start), mean(DEPTH), mean(SURFACE))
    };
    // The floor before the mirror: itself.
    let (albedo, normal, depth, surface) = at(24, 44);
    assert!((albedo - MATT).length() < 1e-4 && (normal - Vec3::Y).length() < 1e-4, "{albedo} {normal}");
    let half_view = 0.4f32.tan();
    let down = (2.0 * 44.5 / SIZE as f32 - 1.0) * half_view;
    let want = (1.0 + down * down).sqrt() / down;
    assert!((depth / want - 1.0).abs() < 0.05 && surface == 1.0, "{depth} {want} {surface}");
    assert!((Vec3::from_slice(first.pixel(24, 44)) - MATT).length() < 1e-4);
    // In the mirror the floor again: its albedo times that of the mirror, the mirror's normal, the whole way.
    let (albedo, normal, depth, surface) = at(22, 28);
    let down = (2.0 * 28.5 / SIZE as f32 - 1.0) * half_view;
    let want = (1.0 + down * down).sqrt() / down;
    assert!((albedo - SILVERING * MATT).length() < 1e-3, "{albedo}");
    assert!((normal - Vec3::Z).length() < 1e-4 && surface == 1.0, "{normal} {surface}");
    assert!((depth / want - 1.0).abs() < 0.15 && depth > 6.1, "{depth} {want}");
    // As a layer it is that of the mirror itself.
    assert!((Vec3::from_slice(first.pixel(22, 28)) - SILVERING).length() < 1e-2, "{:?}", first.pixel(22, 28));
    // Further up the sky: all that the mirror leaves, and nothing is met.
    let (albedo, normal, _, surface) = at(24, 16);
    assert!((albedo - SILVERING).length() < 1e-2 && surface == 0.0, "{albedo} {surface}");
    assert!((normal - Vec3::Z).length() < 1e-4);
    // Beside it the sky.
    let (albedo, normal, depth, surface) = at(2, 2);
    assert_eq!((albedo, normal, depth, surface), (Vec3::ONE, Vec3::ZERO, 0.0, 0.0));
}

fn squared_error(image: &Image, truth: &Image) -> f64 {
    let dark = 0.1 * f64::from(truth.data.iter().sum::<f32>()) / truth.data.len() as f64;
    let squared = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2) / f64::from(b * b).max(dark * dark);
    image.data.iter().zip(&truth.data).map(squared).sum::<f64>() / truth.data.len() as f64
}

#[test]
fn denoised_frames_are_nearer_to_the_truth() {
    let Some(gpu) = gpu() else { return };
    const RGB: [&str; 3] = ["R", "G", "B"];
    let truth = frames(gpu, &Options { seed: 9, ..options(512) }, 512).image().expect("a picture");
    let truth = truth.select(&RGB).expect("channels");
    // How much smaller relative mean square errors become: 9.5 and 2.3 times were measured, and an estimate of the error of
    // .76 and .67 of the true one.
    for (count, gain) in [(4, 7.0), (16, 1.9)] {
        let stage = frames(gpu, &options(count), count);
        let clean = stage.denoised(2).expect("a picture");
        assert_eq!(clean.data, stage.denoised(1).expect("a picture").data, "by another number of threads");
        let [after, before, claimed] = ["", "noisy.", "error."].map(|layer| {
            let names = RGB.map(|c| format!("{layer}{c}"));
            clean.select(&names.each_ref().map(String::as_str)).expect("its layers")
        });
        assert_eq!(before.data, stage.image().expect("a picture").select(&RGB).expect("channels").data);
        let zero = Image {
            data: truth.data.iter().zip(&claimed.data).map(|(t, e)| t + e).collect(),
            ..truth.clone()
        };
        let [before, after, claimed] = [&before, &after, &zero].map(|image| squared_error(image, &truth));
        let ratio = (claimed / after).sqrt();
        println!(
            "{count} frames: {before:.5} to {after:.5}, a factor of {:.2}; claimed {ratio:.2}",
            before / after
        );
        assert!(before > gain * after, "{count} frames: {before} {after}");
        assert!((0.5..1.0).contains(&ratio), "{count} frames: {ratio}");
    }
}

#[test]
fn without_halves_nothing_is_denoised() {
    let Some(gpu) = gpu() else { return };
    let plain = Options { denoise: false, planned: None, ..options(4) };
    let stage = frames(gpu, &plain, 4);
    assert!(stage.halves().expect("the device lives").is_none());
    let with = frames(gpu, &options(4), 4);
    let rgb = |image: Image| image.select(&["R", "G", "B"]).expect("channels").data;
    // What is kept beside the picture leaves its bits alone.
    assert_eq!(rgb(stage.denoised(1).expect("a picture")), rgb(with.image().expect("a picture")));
    // The memory of four planes is asked for before there is any; there is room for three.
    let limits = gpu.device.limits();
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let width = limits.max_texture_dimension_2d;
    let size = [width, (bytes / (4 * 16 * u64::from(width))) as u32 + 1];
    assert!(3 * 16 * u64::from(size[0]) * u64::from(size[1]) < bytes && size[1] <= width);
    let rows = Rows::new(&scene()).expect("rows");
    let error = Stage::new(&gpu.device, &gpu.queue, &rows, &Options { size, ..options(4) }).err();
    assert!(matches!(error, Some(StageError::TooLarge { .. })), "{error:?}");
}

/// Sums over pixels, mean over seeds: the mean square error of the picture, and what the difference of the halves says of it.
fn errors_and_what_is_told_of_them(
    gpu: &Gpu,
    scene: &Scene,
    trace_camera: bool,
    count: u32,
    truth: &Image,
) -> [f64; 2] {
    const SEEDS: u32 = 6;
    let mut sums = [0.0; 2];
    for seed in 0..SEEDS {
        let stage = frames_of(gpu, scene, &Options { seed, trace_camera, ..options(count) }, count);
        let image = stage.image().expect("a picture");
        let told = halves(&stage);
        for i in 0..SIZE * SIZE {
            let (x, y) = (i % SIZE, i / SIZE);
            for c in 0..3 {
                let off = f64::from(image.pixel(x, y)[c] - truth.pixel(x, y)[c]);
                let apart = f64::from(told.mean[0][c][i] - told.mean[1][c][i]);
                sums[0] += off * off;
                sums[1] += 0.25 * apart * apart;
            }
        }
    }
    sums.map(|sum| sum / f64::from(SEEDS))
}

/// The frames of a picture share their places in pixels and are spread more evenly than by chance: how far it is off, the
/// difference of its halves tells all the same.
#[test]
fn halves_tell_how_far_a_picture_is_off() {
    let Some(gpu) = gpu() else { return };
    // The specks that the mirror throws are most of it: 1.00 to 1.03 times the true error were measured.
    let scene = scene();
    let truth = Options { seed: 99, trace_camera: true, ..options(1024) };
    let truth = frames_of(gpu, &scene, &truth, 1024).image().expect("a picture");
    for trace_camera in [false, true] {
        for count in [4, 16, 64] {
            let [off, seen] = errors_and_what_is_told_of_them(gpu, &scene, trace_camera, count, &truth);
            let seen = seen / off;
            println!("traced {trace_camera}, {count} frames: {off:.5}, halves {seen:.2}");
            assert!((0.88..1.12).contains(&seen), "{trace_camera}, {count} frames: {seen}");
        }
    }
}
