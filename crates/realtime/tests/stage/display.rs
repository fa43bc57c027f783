//! What a display shows, against the same in Rust.

use crate::device::gpu;
use glam::{Mat4, Vec3};
use yugen_optics::ColourSpace;
use yugen_optics::random::Pcg32;
use yugen_optics::tonemap::{Curve, ToneMap};
use yugen_realtime::display::{DISPLAY_WGSL, DisplayPass, DisplayRow, DisplaySettings};
use yugen_realtime::{Options, Stage, Target};
use yugen_scene::prepared::Rows;
use yugen_scene::{Aov, Camera, Geometry, Projection, Scene, Shape, look_along};

const MAIN: &str = "
@group(0) @binding(0) var<storage, read> settings: array<Display>;
@group(0) @binding(1) var<storage, read> colours: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> results: array<vec4<f32>>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i < arrayLength(&colours)) {
        let d = settings[i % arrayLength(&settings)];
        results[i] = vec4<f32>(linear_to_srgb(display_light(d, colours[i].rgb)), 1.0);
    }
}";

fn settings() -> Vec<DisplaySettings> {
    let mut all = Vec::new();
    for curve in Curve::ALL {
        for space in ColourSpace::ALL {
            for display in [ColourSpace::LinearSrgb, ColourSpace::LinearP3] {
                for exposure in [0.0, -2.5, 3.0] {
                    all.push(DisplaySettings { space, display, exposure, curve, origin: [0, 0] });
                }
            }
        }
    }
    all
}

/// The largest difference, in display values of 0 to 1.
fn compare(wgsl: &str, curve: Curve) -> Option<f32> {
    let gpu = yugen_proof::gpu::Gpu::for_tests()?;
    let settings: Vec<_> = settings().into_iter().filter(|s| s.curve == curve).collect();
    let rows: Vec<_> = settings.iter().map(|s| DisplayRow::new(s, [1, 1], 1.0, false)).collect();
    let mut rng = Pcg32::new(9, 1);
    let strange =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -f32::MAX, 0.0, 1e-40, -1.0, 1.0, 16.0];
    let colours: Vec<[f32; 4]> = (0..8192)
        .map(|i| {
            let mut c = [0.0; 4];
            for v in &mut c {
                *v = 2f32.powf(24.0 * rng.next_f32() - 16.0) * if rng.next_f32() < 0.1 { -1.0 } else { 1.0 };
            }
            if i % 8 == 0 {
                c[i / 8 % 3] = strange[rng.next_u32() as usize % strange.len()];
            }
            c
        })
        .collect();
    let bits: Vec<f32> = bytemuck::pod_collect_to_vec(&rows);
    let input = colours.as_flattened();
    let output = vec![f32::NAN; input.len()];
    let wgsl = [wgsl, MAIN].join("\n");
    let got = gpu.compute(&wgsl, &[&bits, input], &output, 128).unwrap_or_else(|e| panic!("{e}"));
    let mut worst = 0.0f32;
    for (i, (c, got)) in colours.iter().zip(got.chunks_exact(4)).enumerate() {
        let s = &settings[i % settings.len()];
        let want = ToneMap::on(s.display, s.space, s.exposure, s.curve).show(Vec3::new(c[0], c[1], c[2]));
        let got = Vec3::new(got[0], got[1], got[2]);
        // What is out of gamut by more than digits can tell need only be shown somehow.
        let huge = c[..3].iter().any(|v| v.abs() > 1e6);
        let off = if huge { (got.clamp(Vec3::ZERO, Vec3::ONE) - got).abs() } else { (got - want).abs() };
        worst = worst.max(if off.is_nan() { f32::INFINITY } else { off.max_element() });
    }
    Some(worst)
}

#[test]
fn displays_show_what_pictures_in_files_do() {
    for curve in Curve::ALL {
        let Some(worst) = compare(DISPLAY_WGSL, curve) else { return };
        println!("{}: off by {worst:e}", curve.name());
        // Worst seen: 3.6e-7, by AgX.
        assert!(worst < 1.5e-6, "{}: {worst}", curve.name());
    }
}

#[test]
fn a_wrong_curve_is_caught() {
    for (from, to, curve) in [
        ("2.51", "2.50", Curve::Aces),
        ("REINHARD_WHITE: f32 = 16.0", "REINHARD_WHITE: f32 = 15.0", Curve::Reinhard),
        ("power = 3.25", "power = 3.2", Curve::AgX),
        ("y / (y - least)", "y / (y + least)", Curve::Clip),
        ("d.to_display[1].xyz * l.y", "d.to_display[0].xyz * l.y", Curve::AgX),
    ] {
        let wrong = DISPLAY_WGSL.replace(from, to);
        assert_ne!(wrong, DISPLAY_WGSL, "nothing to spoil: {from}");
        let Some(worst) = compare(&wrong, curve) else { return };
        assert!(worst.is_nan() || worst > 5e-4, "{from} -> {to}: {worst}");
    }
}

/// A plane whose positions are colours, on targets of eight and ten bits that encode or do not.
#[test]
fn targets_of_every_kind_hold_the_same_picture() {
    let Some(gpu) = gpu() else { return };
    let plane = Mat4::from_scale(Vec3::splat(2.0)) * Mat4::from_translation(Vec3::new(0.7, 0.7, 0.0));
    let scene =
        Scene { shapes: vec![Shape::new("plane", Geometry::Rectangle, plane, 0)], ..Scene::default() };
    let mut rows = Rows::default();
    rows.add_shapes(&scene, &|_| false, &|_| None).expect("the scene is sound");
    let above = crate::camera(look_along(Vec3::new(0.4, 0.4, 5.0), -Vec3::Z, Vec3::Y), [40, 30]);
    let camera = Camera { projection: Projection::Orthographic, ..above };
    let options = Options { aovs: vec![Aov::Position], ..Options::new([40, 30], None) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("it fits");
    for format in [
        wgpu::TextureFormat::Rgba8Unorm,
        wgpu::TextureFormat::Rgba8UnormSrgb,
        wgpu::TextureFormat::Bgra8Unorm,
        wgpu::TextureFormat::Rgb10a2Unorm,
    ] {
        let pass =
            DisplayPass::new(&gpu.device, format, stage.film(Some(Aov::Position)).expect("it has one"));
        let (width, height) = (64, 40);
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let settings = DisplaySettings {
            space: ColourSpace::LinearSrgb,
            display: ColourSpace::LinearP3,
            exposure: 0.5,
            curve: Curve::AgX,
            origin: [11, 5],
        };
        let view = texture.create_view(&Default::default());
        for _ in 0..3 {
            stage
                .frame_on(&camera, Some(&Target { pass: &pass, view: &view, settings }))
                .expect("it is seen");
        }
        let image = stage.image().expect("it can be read");
        let copy = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * width * height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &copy,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * width),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        gpu.queue.submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |r| r.expect("it is mapped"));
        gpu.device
            .poll(wgpu::PollType::Wait { submission_index: None, timeout: None })
            .expect("the device lives");
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&copy.get_mapped_range(..).expect("it is mapped"));
        let bits = if format == wgpu::TextureFormat::Rgb10a2Unorm { 10 } else { 8 };
        let display = ToneMap::on(settings.display, settings.space, settings.exposure, settings.curve);
        let mut worst = 0.0f32;
        for (i, word) in words.iter().enumerate() {
            let (x, y) = (i as u32 % width, i as u32 / width);
            let inside = (11..51).contains(&x) && (5..35).contains(&y);
            let most = (1u32 << bits) - 1;
            let mut got =
                Vec3::from_array([0, 1, 2].map(|c| (word >> (bits * c) & most) as f32 / most as f32));
            if format == wgpu::TextureFormat::Bgra8Unorm {
                got = Vec3::new(got.z, got.y, got.x);
            }
            let want = if inside {
                let p = image.pixel(x as usize - 11, y as usize - 5);
                display.show(Vec3::new(p[0], p[1], p[2]))
            } else {
                Vec3::ZERO
            };
            worst = worst.max((got - want).abs().max_element() * most as f32);
        }
        println!("{format:?}: off by {worst} steps");
        // Half a step is rounding; the software GPU cuts ten bits off instead, and encodes by a curve of its own (.64).
        assert!(worst < 1.0, "{format:?}: {worst} steps");
    }
}
