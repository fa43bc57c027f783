//! Frames: what is seen through every kind of camera, sums of frames, and what cannot be shown.

use crate::device::{gpu, open};
use crate::rays::{Ray, all_hits};
use glam::{Mat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_realtime::{Gpu, Options, Stage, StageError};
use yugen_scene::prepared::{Rows, VertexRow};
use yugen_scene::{Aov, Camera, Film, Filter, Geometry, Projection, Scene, Shape, look_along, primitives};

fn camera(name: &str, projection: Projection) -> Camera {
    let eye = Vec3::new(3.0, 2.0, 4.0);
    let straight = crate::camera(look_along(eye, -eye, Vec3::Y), [64, 48]);
    Camera { name: name.into(), projection, near_far: [0.1, 100.0], ..straight }
}

/// A stretched ball, a mirrored block and one far away, a rectangle and a small ball.
fn scene() -> Scene {
    let ball = Geometry::Mesh(Arc::new(primitives::ball(12)));
    let block = Geometry::Mesh(Arc::new(primitives::block(Vec3::new(0.8, 1.2, 0.6))));
    let shape = |geometry, to_world| Shape::new("thing", geometry, to_world, 0);
    let shapes = vec![
        shape(ball, Mat4::from_scale(Vec3::new(0.8, 0.5, 0.7))),
        shape(
            block.clone(),
            Mat4::from_translation(Vec3::new(-1.4, 0.2, 0.6)) * Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)),
        ),
        shape(block, Mat4::from_translation(Vec3::new(-9.0, -4.0, -9.0)) * Mat4::from_rotation_y(0.5)),
        shape(
            Geometry::Rectangle,
            Mat4::from_translation(Vec3::new(0.0, -0.8, 0.0))
                * Mat4::from_rotation_x(-1.57)
                * Mat4::from_scale(Vec3::splat(2.0)),
        ),
        shape(
            Geometry::Mesh(Arc::new(primitives::ball(8))),
            Mat4::from_translation(Vec3::new(0.3, 0.9, 0.9)) * Mat4::from_scale(Vec3::splat(0.4)),
        ),
    ];
    Scene { shapes, ..Scene::default() }
}

fn rows(scene: &Scene) -> Rows {
    let mut rows = Rows::default();
    rows.add_shapes(scene, &|_| false, &|_| None).expect("the scene is sound");
    rows
}

const AOVS: [Aov; 6] = [Aov::Normal, Aov::ShadingNormal, Aov::Depth, Aov::Position, Aov::Uv, Aov::Id];

fn options(camera: &Camera) -> Options {
    let [_, _, w, h] = camera.film.crop.unwrap_or([0, 0, camera.film.width, camera.film.height]);
    Options { filter: camera.film.filter, aovs: AOVS.to_vec(), ..Options::new([w, h], None) }
}

fn pixel(image: &Image, x: usize, y: usize, name: &str) -> f32 {
    image.pixel(x, y)[image.channel(name).unwrap_or_else(|| panic!("there is no {name}"))]
}

fn vec3(image: &Image, x: usize, y: usize, layer: &str) -> Vec3 {
    Vec3::from_array(["X", "Y", "Z"].map(|c| pixel(image, x, y, &format!("{layer}.{c}"))))
}

/// The ray through a place of the whole picture, by the words of `Camera`'s documentation; not normalised where the
/// camera is perspective.
fn ray(camera: &Camera, at: Vec2) -> Ray {
    let film = &camera.film;
    let aspect = film.width as f32 / film.height as f32;
    let p = at / Vec2::new(film.width as f32, film.height as f32);
    let [near, far] = camera.near_far;
    let (origin, dir) = match camera.projection {
        Projection::Perspective { fov_x, principal_point, .. } => {
            let p = p - principal_point;
            let half = (0.5 * fov_x).tan();
            (Vec3::ZERO, Vec3::new((1.0 - 2.0 * p.x) * half, (1.0 - 2.0 * p.y) * half / aspect, 1.0))
        }
        Projection::Orthographic => (Vec3::new(1.0 - 2.0 * p.x, (1.0 - 2.0 * p.y) / aspect, 0.0), Vec3::Z),
    };
    Ray {
        origin: camera.to_world.transform_point3(origin),
        dir: camera.to_world.transform_vector3(dir),
        t_min: near,
        t_max: far,
    }
}

fn cameras() -> Vec<Camera> {
    let mut all = vec![camera("plain", Projection::pinhole(0.9))];
    let mut shifted = camera("shifted", Projection::pinhole(0.7));
    if let Projection::Perspective { principal_point, .. } = &mut shifted.projection {
        *principal_point = Vec2::new(0.1, -0.07);
    }
    all.push(shifted);
    let mut cropped = camera("cropped", Projection::pinhole(1.1));
    cropped.film.crop = Some([13, 7, 40, 33]);
    all.push(cropped);
    let mut clipped = camera("clipped", Projection::pinhole(0.9));
    clipped.near_far = [4.9, 6.0];
    all.push(clipped);
    let mut parallel = camera("parallel", Projection::Orthographic);
    parallel.to_world *= Mat4::from_scale(Vec3::new(2.0, 2.0, 1.0));
    all.push(parallel.clone());
    parallel.name = "parallel, clipped and cropped".into();
    parallel.near_far = [0.0, 5.5];
    parallel.film.crop = Some([1, 2, 30, 31]);
    all.push(parallel);
    all
}

#[test]
fn every_camera_sees_what_its_rays_meet() {
    let Some(gpu) = gpu() else { return };
    let rows = rows(&scene());
    for camera in cameras() {
        let [x0, y0, w, h] = camera.film.crop.unwrap_or([0, 0, camera.film.width, camera.film.height]);
        let met: Vec<_> = (0..w * h)
            .map(|i| {
                let ray = ray(&camera, Vec2::new((x0 + i % w) as f32, (y0 + i / w) as f32) + 0.5);
                let within = |t: f64| t > f64::from(ray.t_min) && t <= f64::from(ray.t_max);
                let hits = all_hits(&rows, &ray, 0.0).into_iter().filter(|h| within(h.t));
                (hits.min_by(|a, b| a.t.total_cmp(&b.t)), ray)
            })
            .collect();
        for trace_camera in [false, true] {
            let options = Options { trace_camera, ..options(&camera) };
            let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("the scene fits");
            stage.frame(&camera).expect("the camera sees");
            let image = stage.image().expect("it can be read");
            let (mut open, mut seen) = (0, 0);
            for y in 0..image.height {
                for x in 0..image.width {
                    let (met, ray) = &met[y * image.width + x];
                    let id = pixel(&image, x, y, "id.Y");
                    let want = met.as_ref().map_or(0.0, |h| rows.draws[h.draw as usize].shape as f32);
                    // At outlines the raster decides by its own rounding, by 1/256 of a pixel.
                    if id != want {
                        open += 1;
                        continue;
                    }
                    let Some(met) = met else {
                        assert_eq!(vec3(&image, x, y, "position"), Vec3::ZERO);
                        continue;
                    };
                    seen += 1;
                    let (scale, t) = (ray.dir.length(), met.t as f32);
                    let position = vec3(&image, x, y, "position");
                    let depth = pixel(&image, x, y, "depth.Z");
                    let off = (position - (ray.origin + ray.dir * t)).length() * met.slope as f32;
                    let room = if trace_camera { 2e-5 } else { 2e-3 };
                    if off > room || (depth - (t - ray.t_min) * scale).abs() * met.slope as f32 > room {
                        open += 1;
                        continue;
                    }
                    let normal = vec3(&image, x, y, "normal");
                    assert!((normal.length() - 1.0).abs() < 1e-5);
                    let slope = normal.dot(ray.dir).abs() / scale;
                    if (slope - met.slope as f32).abs() > 1e-3 {
                        open += 1;
                    }
                }
            }
            println!("{} traced {trace_camera}: {seen} seen, {open} open", camera.name);
            assert!(seen > 200, "{} sees {seen}", camera.name);
            // Worst: none of rays, 2 of the raster.
            assert!(open <= if trace_camera { 0 } else { 8 }, "{}: {open} of {seen}", camera.name);
        }
    }
}

#[test]
fn means_of_frames_are_what_covers_a_pixel() {
    let Some(gpu) = gpu() else { return };
    // Half of the plane z = 0, x cos 0.3 + y sin 0.3 < 0, seen from z = 5 through a film of 16 pixels a unit.
    let half = Mat4::from_rotation_z(0.3)
        * Mat4::from_scale(Vec3::splat(10.0))
        * Mat4::from_translation(Vec3::new(-1.0, 0.0, 0.0));
    let scene = Scene { shapes: vec![Shape::new("half", Geometry::Rectangle, half, 0)], ..Scene::default() };
    let rows = rows(&scene);
    // Worst seen: .008, .012, .035, .014, .014; where a filter is negative, samples of both signs cancel. Traced, every
    // pixel looks elsewhere.
    for (filter, trace_camera, bound) in [
        (Filter::Box, false, 0.02),
        (Filter::Gaussian { stddev: 0.5 }, false, 0.03),
        (Filter::CatmullRom, false, 0.08),
        (Filter::Box, true, 0.05),
        (Filter::Gaussian { stddev: 0.5 }, true, 0.05),
    ] {
        let mut camera = camera("above", Projection::Orthographic);
        camera.to_world = look_along(Vec3::new(0.0, 0.0, 5.0), -Vec3::Z, Vec3::Y);
        camera.film = Film { width: 32, height: 32, crop: None, filter };
        let options = Options { aovs: vec![Aov::Normal], trace_camera, ..options(&camera) };
        let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("it fits");
        let frames = 512;
        for i in 0..frames {
            assert_eq!(stage.frame(&camera).expect("it is seen"), i + 1);
        }
        let image = stage.image().expect("it can be read");
        // Pixels with their distance from the edge, in pixels: the mean is a function of it alone, from 1 to 0, and one
        // half on the edge by symmetry.
        let mut worst = 0.0f32;
        for y in 0..16 {
            for x in 0..32 {
                let (a, b) = (pixel(&image, x, y, "normal.Z"), pixel(&image, 31 - x, 31 - y, "normal.Z"));
                worst = worst.max((a + b - 1.0).abs());
                let to_right = Vec2::new(x as f32 - 15.5, 15.5 - y as f32);
                let side = to_right.dot(Vec2::new(0.3f32.cos(), 0.3f32.sin()));
                if side.abs() > 3.0 {
                    assert!((a - f32::from(u8::from(side < 0.0))).abs() < 1e-5, "{filter:?} {x} {y}: {a}");
                }
                if filter == Filter::Box {
                    let n = 64;
                    let inside = (0..n * n).filter(|i| {
                        let p = Vec2::new((i % n) as f32, (i / n) as f32) + 0.5;
                        let p = to_right + p / n as f32 - 0.5;
                        p.dot(Vec2::new(0.3f32.cos(), 0.3f32.sin())) < 0.0
                    });
                    let want = inside.count() as f32 / (n * n) as f32;
                    worst = worst.max((a - want).abs());
                }
            }
        }
        println!("{filter:?}, traced {trace_camera}: off by {worst}");
        assert!(worst < bound, "{filter:?}: {worst}");
    }
}

#[test]
fn pictures_begin_anew_and_are_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let rows = rows(&scene());
    let [plain, shifted] = [&cameras()[0], &cameras()[1]];
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options(plain)).expect("it fits");
    let take = |stage: &mut Stage, camera: &Camera, frames: u32| {
        for _ in 0..frames {
            stage.frame(camera).expect("it is seen");
        }
        stage.image().expect("it can be read").data
    };
    let first = take(&mut stage, plain, 3);
    let other = take(&mut stage, shifted, 2);
    assert_ne!(first, other);
    assert_eq!(take(&mut stage, plain, 3), first);
    // Moved and back, and another size and back.
    let mut moved = rows.draws.clone();
    moved[0].to_world[0][3] += 0.5;
    stage.place(&moved).expect("it can be placed");
    assert_ne!(take(&mut stage, plain, 3), first);
    stage.place(&rows.draws).expect("it can be placed");
    let mut large = plain.clone();
    large.resize(200, 150);
    stage.resize([200, 150]).expect("there is room");
    assert_eq!(take(&mut stage, &large, 1).len(), 200 * 150 * 13);
    stage.resize([64, 48]).expect("there is room");
    assert_eq!(take(&mut stage, plain, 3), first);
}

/// Through a lens the pixels in focus stay sharp; others see what lies around.
#[test]
fn a_lens_is_sharp_where_it_is_focused() {
    let Some(gpu) = gpu() else { return };
    let rows = rows(&scene());
    let mut lens = cameras()[0].clone();
    let take = |camera: &Camera| {
        let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options(camera)).expect("it fits");
        (0..64).for_each(|_| assert!(stage.frame(camera).is_ok()));
        stage.image().expect("it can be read")
    };
    let sharp = take(&lens);
    let mut off = [0.0; 2];
    for (focus, off) in [5.0, 2.0].into_iter().zip(&mut off) {
        if let Projection::Perspective { aperture_radius, focus_distance, .. } = &mut lens.projection {
            (*aperture_radius, *focus_distance) = (0.1, focus);
        }
        let blurred = take(&lens);
        // The middle, where the ball is, about five away.
        for y in 20..28 {
            for x in 24..40 {
                *off += (pixel(&sharp, x, y, "depth.Z") - pixel(&blurred, x, y, "depth.Z")).abs() / 128.0;
            }
        }
    }
    println!("depth off by {off:?}");
    assert!(off[0] < 0.02 && off[1] > 2.0 * off[0], "{off:?}");
}

#[test]
fn what_cannot_be_shown_is_said_in_a_sentence() {
    let Some(gpu) = gpu() else { return };
    let rows = rows(&scene());
    let camera = cameras()[0].clone();
    let good = options(&camera);
    let refuse =
        |options: &Options| Stage::new(&gpu.device, &gpu.queue, &rows, options).err().expect("refused");
    for size in [[0, 10], [10, 0], [9000, 10], [u32::MAX, u32::MAX]] {
        let error = refuse(&Options { size, ..good.clone() });
        assert!(matches!(error, StageError::Size { limit: 8192, .. }), "{error}");
    }
    let error = refuse(&Options { size: [8192, 8192], ..good.clone() });
    assert!(error.to_string().contains("1025 MiB"), "{error}");

    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &good).expect("it fits");
    assert!(matches!(stage.resize([0, 4]), Err(StageError::Size { .. })));
    let spoilt = |spoil: &dyn Fn(&mut Camera)| {
        let mut bad = camera.clone();
        spoil(&mut bad);
        bad
    };
    for bad in [
        spoilt(&|c| c.to_world = Mat4::ZERO),
        spoilt(&|c| c.to_world.w_axis.x = f32::NAN),
        spoilt(&|c| c.near_far = [1.0, 1.0]),
        spoilt(&|c| c.near_far = [f32::NAN, 1.0]),
        spoilt(&|c| c.projection = Projection::pinhole(0.0)),
        spoilt(&|c| c.projection = Projection::pinhole(f32::NAN)),
        spoilt(&|c| c.film.crop = Some([60, 0, 10, 48])),
        spoilt(&|c| c.film.crop = Some([u32::MAX, 0, 64, 48])),
        spoilt(&|c| c.film.width = 0),
    ] {
        let error = stage.frame(&bad).expect_err("a camera that is none");
        assert!(matches!(error, StageError::Camera { .. }), "{error}");
    }
    let error = stage.frame(&cameras()[2]).expect_err("another size");
    assert!(matches!(error, StageError::OtherSize { found: [40, 33], stage: [64, 48] }), "{error}");
    // And it still works.
    assert_eq!(stage.frame(&camera).expect("it is seen"), 1);

    let mut large = Rows::default();
    let vertex = VertexRow { position: [0.0; 3], u: 0.0, normal: [0.0; 3], v: 0.0, tangent: [0.0; 4] };
    large.vertices.resize((128 << 20) / 48 + 1, vertex);
    let error = Stage::new(&gpu.device, &gpu.queue, &large, &good).err().expect("refused");
    assert_eq!(
        error.to_string(),
        "the vertices of the scene take 129 MiB and this device takes 128 MiB of one kind: simplify the meshes, or \
         use the reference renderer"
    );
    // Nothing at all is a picture of nothing.
    let mut empty = Stage::new(&gpu.device, &gpu.queue, &Rows::default(), &good).expect("nothing fits");
    empty.frame(&camera).expect("it is seen");
    assert!(empty.image().expect("it can be read").data.iter().all(|v| *v == 0.0));
}

#[test]
fn a_lost_device_is_said_and_no_panic() {
    if gpu().is_none() {
        return;
    }
    let gpu = open(wgpu::Features::empty()).expect("there was one before");
    let camera = cameras()[0].clone();
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows(&scene()), &options(&camera)).expect("it fits");
    stage.frame(&camera).expect("it is seen");
    gpu.device.destroy();
    let _ = gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None });
    let error = stage.frame(&camera).expect_err("it is gone");
    assert!(matches!(error, StageError::Lost(_)), "{error}");
    assert!(stage.image().is_err());
    assert!(stage.resize([8, 8]).is_err());
}

#[test]
fn passes_are_timed_where_the_device_can() {
    if gpu().is_none() {
        return;
    }
    let gpu = open(wgpu::Features::TIMESTAMP_QUERY).expect("there was one before");
    let camera = cameras()[0].clone();
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows(&scene()), &options(&camera)).expect("it fits");
    assert!(stage.timings().is_empty());
    for _ in 0..3 {
        stage.frame(&camera).expect("it is seen");
        gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None }).expect("it lives");
    }
    let names: Vec<_> = stage.timings().iter().map(|t| t.pass).collect();
    if gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        assert_eq!(names[0], "visibility");
        assert_eq!(names.len(), 1 + AOVS.len());
        assert!(stage.timings().iter().all(|t| t.milliseconds > 0.0 && t.milliseconds < 1e5));
    } else {
        assert!(names.is_empty());
    }
}

#[test]
fn programs_that_bring_no_device_get_one_or_a_sentence() {
    let instance = |backends| {
        wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        })
    };
    let nothing = instance(wgpu::Backends::empty());
    let error = pollster::block_on(Gpu::on(&nothing, None)).err().expect("there is none");
    assert_eq!(error, StageError::NoAdapter);
    assert!(error.to_string().contains("mesa-vulkan-drivers"), "{error}");
    if gpu().is_none() {
        return;
    }
    let opened =
        pollster::block_on(Gpu::on(&instance(wgpu::Backends::VULKAN), None)).expect("there was one before");
    assert!(!opened.name.is_empty());
    assert!(opened.device.limits().max_buffer_size >= wgpu::Limits::default().max_buffer_size);
    assert_eq!(opened.device.limits().max_storage_buffers_per_shader_stage, 8);
    let camera = cameras()[0].clone();
    let mut stage =
        Stage::new(&opened.device, &opened.queue, &rows(&scene()), &options(&camera)).expect("it fits");
    assert_eq!(stage.frame(&camera).expect("it is seen"), 1);
}

/// A pose that went wrong costs what it moves, not the picture.
#[test]
fn poses_that_are_no_numbers_are_left_out() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let camera = cameras()[0].clone();
    let good = rows(&scene);
    let mut without = scene.clone();
    without.shapes.remove(0);
    let without = rows(&without);
    let take = |stage: &mut Stage| {
        stage.frame(&camera).expect("it is seen");
        stage.image().expect("it can be read")
    };
    for trace_camera in [false, true] {
        let options = Options { trace_camera, ..options(&camera) };
        let new = |rows| Stage::new(&gpu.device, &gpu.queue, rows, &options).expect("it fits");
        let want = take(&mut new(&without));
        let mut stage = new(&good);
        let whole = take(&mut stage);
        for bad in [f32::NAN, f32::INFINITY, 0.0] {
            let mut draws = good.draws.clone();
            draws[0].to_world = [[bad; 4]; 3];
            stage.place(&draws).expect("the others can be placed");
            let got = take(&mut stage);
            let off = (0..got.height * got.width).filter(|i| {
                let (x, y) = (i % got.width, i / got.width);
                pixel(&got, x, y, "depth.Z") != pixel(&want, x, y, "depth.Z")
            });
            assert_eq!(off.count(), 0, "{bad}, traced {trace_camera}");
            assert_eq!(stage.scene().hierarchy_stats().flat_draws, 1);
        }
        stage.place(&good.draws).expect("it can be placed");
        assert_eq!(take(&mut stage), whole);
        let error = stage.place(&good.draws[1..]).expect_err("one is missing");
        assert!(matches!(error, StageError::OtherDraws { found: 4, stage: 5 }), "{error}");
        let mut far = good.draws.clone();
        far[2].to_world[0][3] = 1e20;
        assert!(matches!(stage.place(&far), Err(StageError::Hierarchy(_))));
    }
}

#[test]
fn frames_ask_for_no_memory() {
    if gpu().is_none() {
        return;
    }
    let gpu = open(wgpu::Features::TIMESTAMP_QUERY).expect("there was one before");
    let mut camera = cameras()[0].clone();
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows(&scene()), &options(&camera)).expect("it fits");
    let mut reserved = Vec::new();
    for i in 0..60 {
        // Every third frame from another place.
        camera.to_world.w_axis.x += if i % 3 == 0 { 0.01 } else { 0.0 };
        stage.frame(&camera).expect("it is seen");
        gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None }).expect("it lives");
        reserved.extend(gpu.device.generate_allocator_report().map(|r| r.total_reserved_bytes));
    }
    assert_eq!(reserved.len(), 60, "Vulkan tells what it has reserved");
    assert!(reserved.iter().all(|r| *r == reserved[0] && *r > 0), "{reserved:?}");
}

#[test]
fn pixels_can_be_picked() {
    let Some(gpu) = gpu() else { return };
    let rows = rows(&scene());
    for camera in [&cameras()[0], &cameras()[2]] {
        let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options(camera)).expect("it fits");
        assert_eq!(stage.pick([0, 0]).expect("it can be read"), None);
        stage.frame(camera).expect("it is seen");
        let image = stage.image().expect("it can be read");
        let mut seen = Vec::new();
        for (x, y) in
            (0..image.height).step_by(7).flat_map(|y| (0..image.width).step_by(9).map(move |x| (x, y)))
        {
            let picked = stage.pick([x as u32, y as u32]).expect("it can be read");
            assert_eq!(picked.map_or(0, |p| p.shape) as f32, pixel(&image, x, y, "id.Y"));
            if let Some(p) = picked {
                let draw = rows.draws[p.draw as usize];
                assert!(draw.shape == p.shape && p.triangle - draw.first_triangle < draw.triangles);
                seen.push(p.shape);
            }
        }
        seen.sort_unstable();
        seen.dedup();
        assert!(seen.len() > 2, "{seen:?}");
        assert_eq!(stage.pick([u32::MAX, 0]).expect("it can be read"), None);
    }
}
