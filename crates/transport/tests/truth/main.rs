//! Scenes whose radiance is known without a picture.

mod volumes;

use glam::{Mat4, Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::Arc;
use yugen_optics::{ColourSpace, Frame};
use yugen_reflectance::btf::{Btf, Texel};
use yugen_reflectance::{Choice, Kind, Model};
use yugen_scene::{
    Aov, Camera, Film, Filter, Geometry, Integrator, Light, Material, Mesh, Projection, Scene, Shape,
    Texture, Value, Wrap,
};
use yugen_transport::checkpoint::ResumeError;
use yugen_transport::render::{Action, Budget, Job, Options};

fn camera(width: u32, height: u32, from: Vec3, to: Vec3) -> Camera {
    let z = (to - from).normalize();
    let x = Vec3::Y.cross(z).normalize_or(Vec3::X);
    let y = z.cross(x);
    Camera {
        name: "main".into(),
        to_world: Mat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), from.extend(1.0)),
        projection: Projection::pinhole(0.6),
        near_far: [1e-3, 1e5],
        film: Film { width, height, crop: None, filter: Filter::Box },
        samples_per_pixel: 64,
    }
}

fn lambert(albedo: f32) -> Material {
    model("lambert", &[("reflectance", albedo)])
}

fn model(name: &str, set: &[(&str, f32)]) -> Material {
    let kind = Kind::from_name(name).expect("a model");
    let mut slots = kind.defaults();
    let mut params: Vec<Value> = kind.params().iter().map(|p| default(p.default_slots())).collect();
    for (name, value) in set {
        let (at, p) = kind.param(name).expect("a parameter");
        slots[at..at + p.width()].fill(*value);
        let index = kind.params().iter().position(|q| q.name == *name).expect("its index");
        params[index] = Value::Number(*value);
    }
    let table: Arc<[f32]> = kind.bake(&slots, &[]).expect("a table").into();
    Material::Model { kind, params, table }
}

fn default(slots: &[f32]) -> Value {
    match slots {
        [r, g, b] => Value::Rgb(Vec3::new(*r, *g, *b)),
        _ => Value::Number(slots[0]),
    }
}

fn shape(geometry: Geometry, to_world: Mat4, material: usize) -> Shape {
    Shape::new("shape", geometry, to_world, material)
}

fn render(scene: &Scene, spp: u32) -> yugen_optics::Image {
    let job = Job::new(scene, &Options { budget: Some(Budget::Samples(spp)), ..Options::default() })
        .expect("a job");
    assert!(job.run(|_, _| Action::Continue));
    assert_eq!(job.status().rejected, 0);
    job.image()
}

fn mean(image: &yugen_optics::Image, channel: usize) -> f64 {
    let n = image.channels.len();
    image.data.chunks_exact(n).map(|p| f64::from(p[channel])).sum::<f64>()
        / (image.width * image.height) as f64
}

/// Inside a closed sphere whose wall emits 1 and reflects ρ, radiance is 1/(1 − ρ) everywhere.
#[test]
fn a_closed_sphere_that_glows() {
    for (albedo, depth) in [(0.0, None), (0.5, None), (0.8, None), (0.5, Some(3))] {
        let mut wall = shape(Geometry::Sphere, Mat4::from_scale(Vec3::splat(5.0)), 0);
        wall.flip_normals = true;
        wall.emission = Some(Value::Number(1.0));
        let scene = Scene {
            cameras: vec![camera(16, 16, Vec3::ZERO, Vec3::Z)],
            materials: vec![lambert(albedo)],
            shapes: vec![wall],
            integrator: Integrator { max_depth: depth, ..Integrator::default() },
            ..Scene::default()
        };
        let expected = match depth {
            None => 1.0 / (1.0 - f64::from(albedo)),
            // Three edges: emitted, once and twice reflected.
            Some(_) => 1.0 + 0.5 + 0.25,
        };
        let got = mean(&render(&scene, 256), 0);
        assert!((got / expected - 1.0).abs() < 4e-3, "albedo {albedo}: {got}, expected {expected}");
    }
}

/// A white object in a white world is invisible, whatever it is made of, where the model loses nothing.
#[test]
fn a_white_furnace_hides_white_things() {
    for (material, tolerance) in [(lambert(1.0), 2e-3), (model("dielectric", &[]), 2e-3)] {
        let scene = Scene {
            cameras: vec![camera(24, 24, Vec3::new(0.0, 0.0, -6.0), Vec3::ZERO)],
            materials: vec![material],
            shapes: vec![shape(Geometry::Sphere, Mat4::IDENTITY, 0)],
            lights: vec![Light::Constant { radiance: Vec3::ONE }],
            integrator: Integrator { max_depth: Some(64), rr_depth: 1000, ..Integrator::default() },
            ..Scene::default()
        };
        let got = mean(&render(&scene, 64), 1);
        assert!((got - 1.0).abs() < tolerance, "{got}");
    }
}

/// A point light, a spot and a directional light on a facing wall: E·ρ/π.
#[test]
fn dirac_lights_obey_the_inverse_square() {
    let wall =
        shape(Geometry::Rectangle, Mat4::from_rotation_x(PI) * Mat4::from_scale(Vec3::splat(0.001)), 0);
    let axis = Mat4::from_translation(Vec3::new(0.0, 0.0, -2.0));
    let cases = [
        (Light::Point { position: Vec3::new(0.0, 0.0, -2.0), intensity: Vec3::splat(8.0) }, 2.0),
        (Light::Directional { direction: Vec3::Z, irradiance: Vec3::splat(3.0) }, 3.0),
        (
            Light::Spot {
                to_world: axis,
                intensity: Vec3::splat(8.0),
                beam: 0.2,
                cutoff: 0.4,
                texture: None,
            },
            2.0,
        ),
    ];
    for (light, irradiance) in cases {
        let mut eye = camera(1, 1, Vec3::new(0.0, 0.0, -5.0), Vec3::ZERO);
        if let Projection::Perspective { fov_x, .. } = &mut eye.projection {
            *fov_x = 1e-4;
        }
        let scene = Scene {
            cameras: vec![eye],
            materials: vec![lambert(0.5)],
            shapes: vec![wall.clone()],
            lights: vec![light],
            ..Scene::default()
        };
        let got = mean(&render(&scene, 16), 0);
        let expected = irradiance * 0.5 / std::f64::consts::PI;
        assert!((got / expected - 1.0).abs() < 1e-4, "{got} {expected}");
    }
}

/// More lights than are looked at one by one for every point, of which the brightest is alone by far.
#[test]
fn twenty_lights_add_up() {
    let wall =
        shape(Geometry::Rectangle, Mat4::from_rotation_x(PI) * Mat4::from_scale(Vec3::splat(0.001)), 0);
    let light = |i: u32| Light::Point {
        position: Vec3::new(0.0, 0.0, -2.0),
        intensity: Vec3::splat(if i == 7 { 100.0 } else { i as f32 }),
    };
    let mut eye = camera(1, 1, Vec3::new(0.0, 0.0, -5.0), Vec3::ZERO);
    if let Projection::Perspective { fov_x, .. } = &mut eye.projection {
        *fov_x = 1e-4;
    }
    let scene = Scene {
        cameras: vec![eye],
        materials: vec![lambert(0.5)],
        shapes: vec![wall],
        lights: (0..20).map(light).collect(),
        ..Scene::default()
    };
    let got = mean(&render(&scene, 4096), 0);
    // 0 to 19 are 190.
    let expected = (190.0 - 7.0 + 100.0) / 4.0 * 0.5 / std::f64::consts::PI;
    // Measured 1.8e-5.
    assert!((got / expected - 1.0).abs() < 8e-5, "{got} {expected}");
}

/// A gleaming plate shows each pixel little but one of the lights. Choosing among them by what the plate shows must
/// leave the sum what it is, and cost little against looking at each of them.
#[test]
fn lights_over_a_gleaming_plate_add_up() {
    let plate =
        shape(Geometry::Rectangle, Mat4::from_rotation_x(-0.5 * PI) * Mat4::from_scale(Vec3::splat(3.0)), 0);
    let light = |i: usize| {
        let radius = [0.05, 0.1, 0.2, 0.4][i];
        let place = Mat4::from_translation(Vec3::new(i as f32 - 1.5, 1.0, 0.5))
            * Mat4::from_scale(Vec3::splat(radius));
        let mut light = shape(Geometry::Sphere, place, 1);
        light.emission = Some(Value::Number(1.0 / (radius * radius)));
        light
    };
    let look = |lights: &[usize], spp| {
        let scene = Scene {
            cameras: vec![camera(12, 8, Vec3::new(0.0, 1.5, -3.0), Vec3::ZERO)],
            materials: vec![model("ggx", &[("alpha_x", 0.15), ("alpha_y", 0.1)]), lambert(0.0)],
            shapes: std::iter::once(plate.clone()).chain(lights.iter().map(|i| light(*i))).collect(),
            integrator: Integrator { max_depth: Some(2), ..Integrator::default() },
            ..Scene::default()
        };
        let job = Job::new(&scene, &Options { aovs: vec![Aov::Variance], ..options(2, spp) }).expect("a job");
        assert!(job.run(|_, _| Action::Continue));
        job.image()
    };
    let together = look(&[0, 1, 2, 3], 4096);
    let alone: Vec<_> = (0..4).map(|i| look(&[i], 1024)).collect();
    let n = together.channels.len();
    let variance = together.channel("variance.R").expect("a variance");
    let (mut worst, mut of_choice, mut of_each) = (0.0f64, 0.0, 0.0);
    for (i, pixel) in together.data.chunks_exact(n).enumerate() {
        let each = |c: usize| alone.iter().map(|a| f64::from(a.data[i * n + c])).sum::<f64>();
        let expected = f64::from(pixel[variance]) + each(variance);
        // Below this is rounding.
        worst = worst.max((f64::from(pixel[0]) - each(0)).abs() / (expected.sqrt() + 1e-5));
        of_choice += f64::from(pixel[variance]);
        of_each += each(variance);
    }
    // 1.0 with low-discrepancy points.
    assert!(worst < 2.5, "{worst} standard errors");
    // A third of that of as many samples shared out evenly; twice that where lights are chosen by what they would send
    // to a matt plate.
    assert!(of_choice < 0.5 * of_each, "{of_choice} {of_each}");
}

/// Clamped light is gone after more than one bounce, straight light never, and what is gone is stated.
#[test]
fn clamped_light_is_accounted_for() {
    let look = |clamp: Option<f32>, depth| {
        let mut scene = corner();
        scene.integrator = Integrator { clamp, max_depth: Some(depth), ..scene.integrator };
        let job = Job::new(&scene, &Options { aovs: Vec::new(), ..options(2, 64) }).expect("a job");
        assert!(job.run(|_, _| Action::Continue));
        (mean(&job.image(), 0) + mean(&job.image(), 1) + mean(&job.image(), 2), job.status().clamped)
    };
    let (all, none) = look(Some(1e30), 6);
    assert_eq!(none, 0.0);
    let (straight, _) = look(None, 2);
    let (some, clamped) = look(Some(0.02), 6);
    assert!(clamped > 0.05 && straight < some && some < all, "{straight} {some} {all}, {clamped} clamped");
    // Box filter, so that every sample counts alike: the rest is rounding.
    assert!((some / (1.0 - clamped) / all - 1.0).abs() < 1e-4, "{some} {all} {clamped}");
    let (barely, _) = look(Some(1e-6), 6);
    assert!((barely / straight - 1.0).abs() < 1e-3, "{barely} {straight}");
}

/// Form factor of a disc seen from a point on its axis: E = π L r²/(r² + d²). Every shape of light agrees.
#[test]
fn area_lights_of_every_shape() {
    let (r, d) = (0.7f32, 1.3f32);
    let facing = Mat4::from_translation(Vec3::new(0.0, 0.0, -d));
    let disc = (Geometry::Disc, facing * Mat4::from_scale(Vec3::splat(r)), PI * r * r / (r * r + d * d));
    // Half-angle of the cone a sphere subtends: sin² = r²/d².
    let sphere = (Geometry::Sphere, facing * Mat4::from_scale(Vec3::splat(r)), PI * r * r / (d * d));
    // A square on the axis: four quadrants of the corner form factor (Howell, catalogue B-3).
    let (x, y) = (r / d, r / d);
    let corner = (x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan()
        + y / (1.0 + y * y).sqrt() * (x / (1.0 + y * y).sqrt()).atan())
        / (2.0 * PI);
    let square = (Geometry::Rectangle, facing * Mat4::from_scale(Vec3::splat(r)), 4.0 * corner * PI);
    let mesh = Mesh {
        name: "quad".into(),
        positions: vec![
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::new(1.0, 1.0, 0.0),
            Vec3::new(-1.0, 1.0, 0.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let quad = (Geometry::Mesh(Arc::new(mesh)), square.1, square.2);
    for (geometry, to_world, irradiance) in [disc, sphere, square, quad] {
        let what = format!("{geometry:?}");
        let mut light = shape(geometry, to_world, 1);
        light.emission = Some(Value::Number(1.0));
        let wall =
            shape(Geometry::Rectangle, Mat4::from_rotation_x(PI) * Mat4::from_scale(Vec3::splat(1e-4)), 0);
        let mut eye = camera(1, 1, Vec3::new(3.0, 0.0, -3.0), Vec3::ZERO);
        if let Projection::Perspective { fov_x, .. } = &mut eye.projection {
            *fov_x = 1e-6;
        }
        let scene = Scene {
            cameras: vec![eye],
            materials: vec![lambert(1.0), lambert(0.0)],
            shapes: vec![wall, light],
            ..Scene::default()
        };
        let got = mean(&render(&scene, 4096), 0) * std::f64::consts::PI;
        assert!((got / f64::from(irradiance) - 1.0).abs() < 2e-3, "{what}: {got} {irradiance}");
    }
}

/// Light through n half-open layers: opacity by mask, for light sampling and for drawn directions alike.
#[test]
fn masks_let_light_through() {
    let mut layers = Vec::new();
    for i in 0..3 {
        let at = Mat4::from_translation(Vec3::new(0.0, 0.0, -1.0 - i as f32))
            * Mat4::from_scale(Vec3::splat(100.0));
        layers.push(shape(Geometry::Rectangle, at, 1));
    }
    layers.push(shape(Geometry::Rectangle, Mat4::from_rotation_x(PI), 0));
    let mut eye = camera(1, 1, Vec3::new(0.0, 0.3, -0.5), Vec3::ZERO);
    if let Projection::Perspective { fov_x, .. } = &mut eye.projection {
        *fov_x = 1e-3;
    }
    let scene = Scene {
        cameras: vec![eye],
        materials: vec![lambert(1.0), Material::Mask { opacity: Value::Number(0.25), base: 2 }, lambert(0.0)],
        shapes: layers,
        lights: vec![Light::Constant { radiance: Vec3::ONE }],
        ..Scene::default()
    };
    let got = mean(&render(&scene, 4096), 0);
    let expected = 0.75f64.powi(3);
    assert!((got / expected - 1.0).abs() < 0.02, "{got} {expected}");
}

fn busy_scene() -> Scene {
    let mut lamp = shape(
        Geometry::Sphere,
        Mat4::from_translation(Vec3::new(1.5, 2.0, -1.0)) * Mat4::from_scale(Vec3::splat(0.3)),
        0,
    );
    lamp.emission = Some(Value::Rgb(Vec3::new(9.0, 6.0, 3.0)));
    Scene {
        cameras: vec![camera(70, 45, Vec3::new(0.0, 1.0, -6.0), Vec3::ZERO)],
        materials: vec![lambert(0.7), model("rough_conductor", &[])],
        shapes: vec![
            shape(Geometry::Sphere, Mat4::IDENTITY, 1),
            shape(
                Geometry::Disc,
                Mat4::from_translation(Vec3::NEG_Y)
                    * Mat4::from_rotation_x(-PI / 2.0)
                    * Mat4::from_scale(Vec3::splat(4.0)),
                0,
            ),
            lamp,
        ],
        lights: vec![Light::Constant { radiance: Vec3::new(0.1, 0.2, 0.3) }],
        ..Scene::default()
    }
}

fn options(threads: usize, spp: u32) -> Options {
    Options {
        threads: Some(threads),
        budget: Some(Budget::Samples(spp)),
        aovs: Aov::ALL.to_vec(),
        ..Options::default()
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let scene = busy_scene();
    let run = |threads| {
        let job = Job::new(&scene, &options(threads, 40)).expect("a job");
        job.run(|_, _| Action::Continue);
        job.image()
    };
    let one = run(1);
    for threads in [2, 5] {
        let more = run(threads);
        assert_eq!(one.channels, more.channels);
        assert!(
            one.data.iter().zip(&more.data).all(|(a, b)| a.to_bits() == b.to_bits()),
            "{threads} threads"
        );
    }
}

#[test]
fn a_resumed_render_gives_the_same_bits_and_refuses_what_is_not_its_own() {
    let scene = busy_scene();
    let whole = Job::new(&scene, &options(2, 512)).expect("a job");
    whole.run(|_, _| Action::Continue);

    // Cut off on the way: an observer stops it at the first look, 50 ms from the start.
    let first = Job::new(&scene, &options(2, 512)).expect("a job");
    assert!(!first.run(|_, _| Action::Stop));
    let saved = first.checkpoint();
    let second = Job::new(&scene, &options(1, 512)).expect("a job");
    second.resume(&saved).expect("its own checkpoint");
    second.run(|_, _| Action::Continue);
    let (a, b) = (whole.image(), second.image());
    assert!(a.data.iter().zip(&b.data).all(|(a, b)| a.to_bits() == b.to_bits()));

    let other = Job::new(&scene, &Options { seed: 9, ..options(1, 512) }).expect("a job");
    let why = other.resume(&saved).expect_err("another seed").to_string();
    assert!(why.ends_with("the seed was 0 in it, and is 9 now"), "{why}");
    for cut in [0, 10, saved.len() / 2, saved.len() - 1] {
        assert!(matches!(second.resume(&saved[..cut]), Err(ResumeError::Damaged(_))));
    }
    let mut bent = saved.clone();
    bent[saved.len() / 3] ^= 4;
    assert!(matches!(second.resume(&bent), Err(ResumeError::Damaged(_))));
}

/// Samples are added to a render that has ended, in numbers that do and do not fill its visits.
#[test]
fn more_samples_give_the_bits_that_they_would_have_given_at_once() {
    let scene = busy_scene();
    let mut saved: Option<Vec<u8>> = None;
    for (spp, kept) in [(10, 0), (32, 32), (50, 48), (50, 48), (64, 64)] {
        let job = Job::new(&scene, &options(2, spp)).expect("a job");
        if let Some(saved) = &saved {
            job.resume(saved).expect("fewer samples of the same");
        }
        assert!(job.run(|_, _| Action::Continue));
        let whole = Job::new(&scene, &options(1, spp)).expect("a job");
        whole.run(|_, _| Action::Continue);
        let (a, b) = (whole.image(), job.image());
        assert!(a.data.iter().zip(&b.data).all(|(a, b)| a.to_bits() == b.to_bits()), "{spp}");
        assert_eq!(whole.status().samples, job.status().samples);
        let head = job.head();
        assert!(head.finished && head.samples == kept, "{head:?}");
        saved = Some(job.checkpoint());
    }
    let saved = saved.expect("a checkpoint");
    let fewer = Job::new(&scene, &options(2, 40)).expect("a job");
    assert_eq!(fewer.resume(&saved), Err(ResumeError::Fewer { done: 64, asked: 40 }));

    // Noise takes over where numbers have ended, but not the other way round.
    let by_noise = |target| {
        let budget = Some(Budget::Error(target));
        Job::new(&scene, &Options { budget, ..options(2, 1) }).expect("a job")
    };
    let coarse = by_noise(1e-5);
    coarse.resume(&saved).expect("samples for all");
    let target = 0.5 * coarse.error();
    let job = by_noise(target);
    job.resume(&saved).expect("samples for all");
    assert!(job.run(|_, _| Action::Continue) && job.error() <= target);
    let saved = job.checkpoint();
    assert_eq!(fewer.resume(&saved), Err(ResumeError::SharedOut));
    let finer = by_noise(0.8 * target);
    finer.resume(&saved).expect("the same, finer");
    assert!(finer.run(|_, _| Action::Continue) && finer.error() <= 0.8 * target);
    assert!(finer.status().samples > job.status().samples);
}

#[test]
fn an_error_budget_spends_where_it_is_noisy_and_reaches_its_target() {
    let scene = busy_scene();
    let run = |seed, budget| {
        let options = Options { seed, budget: Some(budget), ..options(2, 1) };
        let job = Job::new(&scene, &options).expect("a job");
        job.run(|_, _| Action::Continue);
        job.image()
    };
    let target = 0.02;
    let image = run(1, Budget::Error(target));
    let truth = run(2, Budget::Samples(2048));
    let n = image.channels.len();
    let samples = image.channel("samples.Y").expect("counts");
    let counts: Vec<f32> = image.data.chunks_exact(n).map(|p| p[samples]).collect();
    let (least, most) = counts.iter().fold((f32::MAX, 0.0f32), |(a, b), c| (a.min(*c), b.max(*c)));
    assert!(most > 1.5 * least, "{least} {most}");
    let mut sum = 0.0;
    for (p, t) in image.data.chunks_exact(n).zip(truth.data.chunks_exact(n)) {
        sum += f64::from((p[1] - t[1]) / t[1].max(0.01)).powi(2);
    }
    let rms = (sum / counts.len() as f64).sqrt();
    assert!(rms < f64::from(target) * 1.2, "{rms}");
}

/// Two instances of one group are two things to whoever cuts the picture apart by the id AOV.
#[test]
fn the_id_tells_instances_apart() {
    let place = |x: f32| shape(Geometry::Instance(0), Mat4::from_translation(Vec3::new(x, 0.0, 0.0)), 0);
    let scene = Scene {
        cameras: vec![camera(3, 1, Vec3::new(0.0, 0.0, -10.0), Vec3::ZERO)],
        materials: vec![lambert(0.5)],
        groups: vec![vec![shape(Geometry::Sphere, Mat4::from_scale(Vec3::splat(0.5)), 0)]],
        shapes: vec![place(-2.0), place(2.0)],
        ..Scene::default()
    };
    let options = Options { aovs: vec![Aov::Id], ..options(1, 1) };
    let job = Job::new(&scene, &options).expect("a job");
    job.run(|_, _| Action::Continue);
    let image = job.image();
    let id = image.channel("id.Y").expect("an id");
    let ids: Vec<f32> = (0..3).map(|x| image.pixel(x, 0)[id]).collect();
    assert_eq!(ids[1], 0.0);
    assert!(ids[0] > 0.0 && ids[2] > 0.0 && ids[0] != ids[2], "{ids:?}");
}

/// A cloth that fills the view of a camera straight above it, its top row up; or its mirror image.
fn flat_cloth(maps: Btf, form: u32, size: u32, light: Vec3, mirrored: bool) -> Scene {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let u = |x: f32| if mirrored { 0.5 - 0.5 * x } else { 0.5 + 0.5 * x };
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let quad = Mesh {
        name: "cloth".into(),
        positions: corners.map(|(x, y)| corner(x, y)).to_vec(),
        uvs: corners.map(|(x, y)| Vec2::new(u(x), 0.5 - 0.5 * y)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mut above = camera(size, size, Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO);
    above.projection = Projection::Orthographic;
    let maps = Arc::new(maps);
    Scene {
        working_space: ColourSpace::LinearSrgb,
        cameras: vec![above],
        textures: vec![Texture::Cloth { maps, wrap: Wrap::Repeat, to_uv: glam::Affine2::IDENTITY }],
        materials: vec![Material::Cloth { texture: 0, form: Choice(form as f32) }],
        shapes: vec![shape(Geometry::Mesh(Arc::new(quad)), Mat4::IDENTITY, 0)],
        lights: vec![Light::Directional { direction: -light, irradiance: Vec3::ONE }],
        ..Scene::default()
    }
}

fn thread(slope: Vec2, along: Vec2) -> Texel {
    let frame = Frame::from_normal_tangent(slope.extend(1.0).normalize(), along.extend(0.0));
    Texel {
        diffuse: Vec3::new(0.3, 0.1, 0.05),
        specular: Vec3::new(0.6, 0.5, 0.2),
        normal: frame.n,
        tangent: frame.s,
        sigma: Vec2::new(0.35, 0.12),
        confidence: 1.0,
    }
}

/// Radiance under irradiance 1 of a texel that lies in the plane z = 0.
fn shone(t: &Texel, form: u32, light: Vec3) -> Vec3 {
    let frame = t.frame();
    let wi = frame.to_local(light);
    t.noh(Choice(form as f32)).eval(&[], frame.to_local(Vec3::Z), wi) * wi.z.max(0.0)
}

/// Normal and tangent of the maps stand in the world as in the picture, in a mirror as in the mirrored one.
#[test]
fn a_cloth_shines_as_its_texels_say() {
    let light = Vec3::new(0.35, 0.3, 0.9).normalize();
    let t = thread(Vec2::new(0.15, 0.1), Vec2::new(0.8, 0.6));
    let other = thread(Vec2::new(-0.15, 0.1), Vec2::new(-0.8, 0.6));
    for form in [0, 1, 5] {
        for (mirrored, want) in [(false, shone(&t, form, light)), (true, shone(&other, form, light))] {
            let maps =
                Btf { width: 4, height: 4, colour_space: ColourSpace::LinearSrgb, texels: vec![t; 16] };
            let image = render(&flat_cloth(maps, form, 8, light, mirrored), 4);
            for c in 0..3 {
                let got = mean(&image, c);
                let want = f64::from(want[c]);
                assert!(
                    (got / want - 1.0).abs() < 1e-3,
                    "form {form}, mirrored {mirrored}: {got}, expected {want}"
                );
            }
        }
    }
}

/// From afar, two kinds of threads whose normals lean apart shine as much as the mean of their highlights, near that of
/// every texel by itself; the mean normal alone would be dark here or blinding.
#[test]
fn a_cloth_from_afar_is_as_rough_as_its_threads_are_crooked() {
    let texels: Vec<Texel> = (0..64 * 64)
        .map(|i| {
            let across = ((i % 64 % 8) as f32 - 3.5) / 3.5;
            thread(Vec2::new(0.3 * across, 0.0), Vec2::Y)
        })
        .collect();
    for polar in [0.0f32, 0.3, 0.6] {
        let light = Vec3::new(polar.sin(), 0.0, polar.cos());
        let each = texels.iter().map(|t| shone(t, 0, light)).sum::<Vec3>() / texels.len() as f32;
        let maps =
            Btf { width: 64, height: 64, colour_space: ColourSpace::LinearSrgb, texels: texels.clone() };
        // A pixel has eight texels across, a whole thread.
        let got = mean(&render(&flat_cloth(maps, 0, 8, light, false), 16), 0);
        let flat = f64::from(shone(&thread(Vec2::ZERO, Vec2::Y), 0, light).x);
        let want = f64::from(each.x);
        println!("{polar}: {got:.4}, texel by texel {want:.4}, mean normal {flat:.4}");
        // Worst .20: these slopes are spread evenly, the Gaussian that stands for them is not.
        assert!((got / want - 1.0).abs() < 0.25, "{polar}: {got}, texel by texel {want}");
        assert!(polar == 0.3 || (flat / want - 1.0).abs() > 0.5, "{polar}: the test is too easy");
    }
}

/// A corner with a ball in it: what bounces differs from pixel to pixel, across edges and out of shadows.
fn corner() -> Scene {
    let quad = |m: Mat4, material| shape(Geometry::Rectangle, m, material);
    let mut lamp = quad(
        Mat4::from_translation(Vec3::new(0.3, 1.9, 0.2))
            * Mat4::from_rotation_x(PI / 2.0)
            * Mat4::from_scale(Vec3::splat(0.4)),
        0,
    );
    lamp.emission = Some(Value::Number(20.0));
    Scene {
        cameras: vec![Camera {
            film: Film { width: 8, height: 8, crop: None, filter: Filter::Box },
            ..camera(8, 8, Vec3::new(2.0, 1.5, 3.5), Vec3::new(0.0, 0.2, 0.0))
        }],
        materials: vec![lambert(0.8), model("lambert", &[("reflectance", 0.5)]), lambert(0.3)],
        shapes: vec![
            quad(Mat4::from_rotation_x(-PI / 2.0) * Mat4::from_scale(Vec3::splat(4.0)), 0),
            quad(Mat4::from_translation(Vec3::new(0.0, 0.0, -1.0)) * Mat4::from_scale(Vec3::splat(4.0)), 1),
            quad(
                Mat4::from_translation(Vec3::new(-1.0, 0.0, 0.0))
                    * Mat4::from_rotation_y(PI / 2.0)
                    * Mat4::from_scale(Vec3::splat(4.0)),
                2,
            ),
            shape(
                Geometry::Sphere,
                Mat4::from_translation(Vec3::new(0.0, 0.4, 0.0)) * Mat4::from_scale(Vec3::splat(0.4)),
                0,
            ),
            lamp,
        ],
        integrator: Integrator { max_depth: Some(5), ..Integrator::default() },
        ..Scene::default()
    }
}

/// Pixels that share the ends of their paths tend to the same values as pixels that are rendered alone, and faster.
#[test]
fn shared_paths_change_the_noise_and_not_the_picture() {
    let scene = corner();
    let job = |crop, spp| {
        let mut scene = scene.clone();
        scene.cameras[0].film.crop = Some(crop);
        let job = Job::new(&scene, &Options { aovs: vec![Aov::Variance], ..options(2, spp) }).expect("a job");
        job.run(|_, _| Action::Continue);
        job.image()
    };
    let together = job([0, 0, 8, 8], 1024);
    let n = together.channels.len();
    let variance = together.channel("variance.R").expect("a variance");
    let (mut worst, mut sum, mut of_sum, mut gained) = (0.0f64, 0.0, 0.0, 0.0);
    for (i, shared) in together.data.chunks_exact(n).enumerate() {
        let image = job([i as u32 % 8, i as u32 / 8, 1, 1], 1024);
        let alone = image.pixel(0, 0);
        let difference = f64::from(shared[0] - alone[0]);
        // Low-discrepancy points err less than this, so the scores are small ones: of 64 the worst is 1.2, and that
        // of the sum .02.
        let expected = f64::from(shared[variance] + alone[variance]);
        worst = worst.max(difference.abs() / expected.sqrt());
        sum += difference;
        of_sum += expected;
        gained += f64::from(alone[variance]) / f64::from(shared[variance]) / 64.0;
    }
    assert!(worst < 2.5, "{worst}");
    // The noise of neighbours goes together: a group of eight counts as one.
    let sum = sum.abs() / (8.0 * of_sum).sqrt();
    assert!(sum < 0.25, "{sum}");
    assert!(gained > 2.0, "the variance fell by {gained}");
}
