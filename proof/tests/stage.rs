//! The real-time renderer's geometry against the reference renderer's: what a ray meets and all that is known there.

use glam::{Affine2, Mat4, Vec2, Vec3, Vec4};
use std::f32::consts::TAU;
use std::sync::Arc;
use yugen_optics::Image;
use yugen_optics::random::Pcg32;
use yugen_proof::gpu::Gpu;
use yugen_realtime::hierarchy::{HIERARCHY_WGSL, Hierarchy};
use yugen_realtime::surface::{OPAQUE_WGSL, SURFACE_WGSL};
use yugen_realtime::{Options, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::{GEOMETRY_WGSL, Rows};
use yugen_scene::{
    Aov, Camera, Film, Filter, FovAxis, Geometry as Form, Light, Material, Mesh, ModelBuilder, Projection,
    Scene, Shape, Texture, TextureFilter, TurnedNormals, Value, Wrap, look_along, primitives,
};
use yugen_transport::accel::{NO_INSTANCE, Ray};
use yugen_transport::geometry::{Geometry, Surface};
use yugen_transport::render::{self, Action, Budget, Job};

/// Rows of four floats that a ray comes back as.
const ROWS: usize = 10;

const MAIN: &str = "
@group(0) @binding(0) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(1) var<storage, read> triangles: array<u32>;
@group(0) @binding(2) var<storage, read> draws: array<Draw>;
@group(0) @binding(3) var<storage, read> hierarchy: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> rays: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> results: array<vec4<f32>>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (2u * i >= arrayLength(&rays)) {
        return;
    }
    let o = rays[2u * i].xyz;
    let d = rays[2u * i + 1u].xyz;
    let hit = trace_closest(o, d, 0.0, 1e30);
    let at = 10u * i;
    if (hit.draw == NONE) {
        results[at] = vec4<f32>(-1.0);
        return;
    }
    let s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
    // How often rays that leave to either side meet their own triangle.
    var again = 0.0;
    for (var k = 0u; k < 16u; k++) {
        let phi = f32(k) * 0.7;
        let z = pow(0.3, f32(k % 8u)) * select(1.0, -1.0, k >= 8u);
        let t = s.frame_s * cos(phi) + s.frame_t * sin(phi);
        let away = normalize(t - s.geometric_normal * dot(t, s.geometric_normal)) + s.geometric_normal * z;
        let from_here = offset_origin(s.position, s.error, s.geometric_normal, away);
        let next = trace_closest(from_here, away, 0.0, 1e30);
        again += select(0.0, 1.0, next.draw == hit.draw && next.triangle == hit.triangle);
    }
    results[at] = vec4<f32>(f32(draws[hit.draw].shape), f32(hit.triangle - draws[hit.draw].first_triangle), hit.t, again);
    results[at + 1u] = vec4<f32>(s.position, s.error);
    results[at + 2u] = vec4<f32>(s.geometric_normal, s.handedness);
    results[at + 3u] = vec4<f32>(s.frame_s, s.barycentric.x);
    results[at + 4u] = vec4<f32>(s.frame_t, s.barycentric.y);
    results[at + 5u] = vec4<f32>(s.frame_n, f32(s.material));
    results[at + 6u] = vec4<f32>(s.dp_du, s.uv.x);
    results[at + 7u] = vec4<f32>(s.dp_dv, s.uv.y);
    results[at + 8u] = vec4<f32>(vec3<f32>(0.0), f32(hit.draw));
}";

fn random_vec(rng: &mut Pcg32) -> Vec3 {
    Vec3::from_array(std::array::from_fn(|_| 2.0 * rng.next_f32() - 1.0))
}

/// A crumpled sheet with everything a mesh may have, or less.
fn sheet(rng: &mut Pcg32, has: [bool; 3]) -> Mesh {
    let mut mesh = primitives::grid(2.0, 2.0, [6, 6]);
    for p in &mut mesh.positions {
        *p += 0.15 * random_vec(rng);
    }
    let n = mesh.positions.len();
    let [normals, uvs, tangents] = has;
    mesh.normals = (0..n).map(|_| (Vec3::Z + 0.5 * random_vec(rng)).normalize()).collect();
    mesh.uvs = (0..n).map(|_| Vec2::new(rng.next_f32(), rng.next_f32()) * 3.0).collect();
    let side = if rng.next_f32() < 0.5 { 1.0 } else { -1.0 };
    mesh.tangents = (0..n).map(|_| random_vec(rng).extend(side)).collect();
    if !normals {
        mesh.normals.clear();
    }
    if uvs {
        // One triangle without any extent there.
        let [a, b, c] = mesh.triangles[0];
        let there = mesh.uvs[a as usize];
        mesh.uvs[b as usize] = there;
        mesh.uvs[c as usize] = there;
    } else {
        mesh.uvs.clear();
    }
    if !tangents {
        mesh.tangents.clear();
    }
    mesh
}

fn place(rng: &mut Pcg32, i: usize) -> Mat4 {
    let mut m = Mat4::from_translation(1.5 * random_vec(rng))
        * Mat4::from_axis_angle(random_vec(rng).normalize_or(Vec3::X), 3.0 * rng.next_f32());
    if i % 2 == 1 {
        m *= Mat4::from_scale(Vec3::new(0.6, -0.9, 1.4));
    }
    if i % 3 == 1 {
        // A shear.
        m *= Mat4::from_cols(Vec4::X, Vec4::new(0.7, 1.0, 0.0, 0.0), Vec4::new(-0.3, 0.5, 1.0, 0.0), Vec4::W);
    }
    m
}

/// Sheets in the world and in groups placed twice; `far`: from the origin.
fn scene(rng: &mut Pcg32, far: f32) -> Scene {
    let mut scene = Scene::default();
    let mut nth = 0;
    let mut shape = |rng: &mut Pcg32, material| {
        nth += 1;
        let mesh = Arc::new(sheet(rng, [nth % 2 == 0, nth % 3 != 0, nth % 4 == 0]));
        let mut shape = Shape::new("sheet", Form::Mesh(mesh), place(rng, nth), material);
        shape.flip_normals = nth % 5 == 1;
        shape.face_normals = nth % 6 == 4;
        shape
    };
    for group in 0..2 {
        let shapes = (0..3).map(|i| shape(rng, 10 * group + i)).collect();
        scene.groups.push(shapes);
    }
    for i in 0..12 {
        let mut s = shape(rng, 100 + i);
        s.to_world = Mat4::from_translation(Vec3::splat(far)) * s.to_world;
        scene.shapes.push(s);
    }
    for i in 0..4 {
        let m = Mat4::from_translation(Vec3::splat(far)) * place(rng, i);
        scene.shapes.push(Shape::new("group", Form::Instance(i % 2), m, 0));
    }
    scene
}

struct Compared {
    met: usize,
    other: usize,
    again: f32,
    worst: Vec<(&'static str, f32)>,
}

/// Rays through the scene, by both renderers.
fn compare(gpu: &Gpu, surface_wgsl: &str, scene: &Scene, rays: &[Ray]) -> Compared {
    let mut rows = Rows::default();
    rows.add_shapes(scene, &|_| false, &|_| None).expect("the scene is sound");
    let hierarchy = Hierarchy::build(&rows, 2).expect("it can be traced");
    let geometry = Geometry::build(scene).expect("the scene is sound");
    let bits = |words: &[u8]| bytemuck::pod_collect_to_vec::<u8, f32>(words);
    let input: Vec<f32> = rays
        .iter()
        .flat_map(|r| [r.origin.extend(0.0), r.dir.extend(0.0)])
        .flat_map(|v| v.to_array())
        .collect();
    let inputs = [
        bits(bytemuck::cast_slice(&rows.vertices)),
        bits(bytemuck::cast_slice(&rows.triangles)),
        bits(bytemuck::cast_slice(&rows.draws)),
        bits(bytemuck::cast_slice(hierarchy.rows())),
        input,
    ];
    let inputs: Vec<&[f32]> = inputs.iter().map(Vec::as_slice).collect();
    let output = vec![f32::NAN; 4 * ROWS * rays.len()];
    let wgsl = [GEOMETRY_WGSL, HIERARCHY_WGSL, OPAQUE_WGSL, surface_wgsl, MAIN].join("\n");
    let results = gpu
        .compute(&wgsl, &inputs, &output, (rays.len() as u32).div_ceil(64))
        .unwrap_or_else(|e| panic!("{e}"));

    let names =
        ["t", "position", "error", "normal", "s", "t of frame", "n", "dp_du", "dp_dv", "uv", "handedness"];
    let mut compared =
        Compared { met: 0, other: 0, again: 0.0, worst: names.iter().map(|n| (*n, 0.0)).collect() };
    for (ray, got) in rays.iter().zip(results.chunks_exact(4 * ROWS)) {
        let row = |i: usize| Vec4::from_slice(&got[4 * i..]);
        let hit = geometry.intersect(ray);
        let seen = hit.as_ref().map(|h| {
            let outer = if h.instance == NO_INSTANCE { h.shape } else { h.instance };
            (outer as f32 + 1.0, h.primitive as f32)
        });
        let head = row(0);
        assert!(head.is_finite(), "a ray was not traced");
        let same = match seen {
            None => head.x < 0.0,
            Some((shape, primitive)) => (head.x, head.y) == (shape, primitive),
        };
        if !same {
            compared.other += 1;
            continue;
        }
        let Some(hit) = hit else { continue };
        let want: Surface = geometry.surface(ray, &hit);
        compared.met += 1;
        compared.again += head.w;
        assert_eq!(row(5).w, want.material as f32);
        let slope = ray.dir.dot(want.geometric_normal).abs() / ray.dir.length();
        let size = want.position.abs().max_element() + 1.0;
        // Where a ray only grazes, the place along it is known as badly.
        let graze = slope.max(1e-2);
        let relative = |a: Vec3, b: Vec3| (a - b).length() / b.length().max(1e-3);
        let uv = Vec2::new(row(6).w, row(7).w);
        let errors = [
            (head.z - hit.t).abs() * ray.dir.length() / size * graze,
            (row(1).truncate() - want.position).length() / size * graze,
            // Smaller is worse; larger by a few is what the way through the matrix takes.
            (want.error / row(1).w - 1.0).max(row(1).w / want.error / 8.0 - 1.0).max(0.0),
            (row(2).truncate() - want.geometric_normal).length(),
            (row(3).truncate() - want.frame.s).length() * graze,
            (row(4).truncate() - want.frame.t).length() * graze,
            (row(5).truncate() - want.frame.n).length() * graze,
            relative(row(6).truncate(), want.dp_du),
            relative(row(7).truncate(), want.dp_dv),
            (uv - want.uv).length() * graze,
            (row(2).w - want.handedness).abs(),
        ];
        for (worst, e) in compared.worst.iter_mut().zip(errors) {
            worst.1 = if e.is_nan() { f32::INFINITY } else { worst.1.max(e) };
        }
    }
    compared
}

fn rays(rng: &mut Pcg32, n: usize, far: f32) -> Vec<Ray> {
    (0..n)
        .map(|_| {
            let origin = Vec3::splat(far) + 3.0 * random_vec(rng);
            Ray::new(origin, Vec3::splat(far) + 2.0 * random_vec(rng) - origin)
        })
        .collect()
}

#[test]
fn surfaces_are_those_of_the_reference() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut rng = Pcg32::new(42, 11);
    for far in [0.0, 100.0] {
        let scene = scene(&mut rng, far);
        let rays = rays(&mut rng, 6000, far);
        let found = compare(gpu, SURFACE_WGSL, &scene, &rays);
        println!(
            "at {far}: {} met, {} others, {} again: {:?}",
            found.met, found.other, found.again, found.worst
        );
        assert!(found.met > 3000, "{}", found.met);
        // Rays within rounding of an edge.
        assert!(found.other <= 6, "{} meet something else", found.other);
        assert_eq!(found.again, 0.0, "rays meet where they start");
        for (what, worst) in found.worst {
            // Worst seen: 6e-4, of the tangent; the error's is a factor, for ours goes through the mesh's coordinates.
            let bound = if what == "error" { 4.0 } else { 2.4e-3 };
            assert!(worst < bound, "{what} is off by {worst}");
        }
    }
}

#[test]
fn a_wrong_surface_is_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut rng = Pcg32::new(42, 11);
    let scene = scene(&mut rng, 0.0);
    let rays = rays(&mut rng, 1500, 0.0);
    for (from, to, what) in [
        ("select(normal, -normal, mirrored)", "normal", "normal"),
        ("select(v, -v, mirrored)", "v", "n"),
        ("(dp2 * d1.x - dp1 * d2.x) / det", "(dp2 * d1.x + dp1 * d2.x) / det", "dp_dv"),
        ("handedness = a.tangent.w", "handedness = 1.0", "handedness"),
        ("b = e3 * scale;\n    } else", "b = -e3 * scale;\n    } else", "normal"),
    ] {
        let wrong = SURFACE_WGSL.replace(from, to);
        assert_ne!(wrong, SURFACE_WGSL, "nothing to spoil: {from}");
        let found = compare(gpu, &wrong, &scene, &rays);
        let worst = found.worst.iter().find(|w| w.0 == what).expect("it is compared").1;
        assert!(worst > 0.1, "{from} -> {to}: {worst}");
    }
}

/// Channels of AOVs by both renderers through the same camera and filter.
#[test]
fn aovs_are_those_of_the_reference() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut rng = Pcg32::new(5, 11);
    let mut scene = scene(&mut rng, 0.0);
    scene.materials = vec![ModelBuilder::new(Kind::Lambert).build().expect("it has defaults")];
    for shape in scene.shapes.iter_mut().chain(scene.groups.iter_mut().flatten()) {
        shape.material = 0;
    }
    scene.cameras = vec![Camera {
        name: "front".into(),
        to_world: look_along(Vec3::new(1.0, 2.0, 6.0), Vec3::new(-1.0, -2.0, -6.0), Vec3::Y),
        projection: Projection::Perspective {
            fov_x: 0.9,
            fov_axis: FovAxis::X,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            principal_point: Vec2::new(0.05, -0.02),
        },
        near_far: [0.5, 100.0],
        film: Film {
            width: 72,
            height: 54,
            crop: Some([4, 3, 60, 40]),
            filter: Filter::Gaussian { stddev: 0.5 },
        },
        samples_per_pixel: 256,
    }];
    let aovs = vec![Aov::Normal, Aov::ShadingNormal, Aov::Depth, Aov::Position, Aov::Uv, Aov::Id];
    let options =
        render::Options { aovs: aovs.clone(), budget: Some(Budget::Samples(256)), ..Default::default() };
    let job = Job::new(&scene, &options).expect("the reference takes it");
    assert!(job.run(|_, _| Action::Continue));
    let want = job.image();

    let mut rows = Rows::default();
    rows.add_shapes(&scene, &|_| false, &|_| None).expect("the scene is sound");
    let film = &scene.cameras[0].film;
    let options = Options { filter: film.filter, aovs, ..Options::new([60, 40], None) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("it fits");
    for _ in 0..256 {
        stage.frame(&scene.cameras[0]).expect("it is seen");
    }
    let got = stage.image().expect("it can be read");
    assert_eq!((got.width, got.height), (want.width, want.height));
    assert_eq!(got.channels.len(), 13);
    for (c, name) in got.channels.iter().enumerate() {
        let k = want.channel(name).unwrap_or_else(|| panic!("the reference has no {name}"));
        let (mut sum, mut worst, mut size, mut count, mut exact) = (0.0, 0.0f32, 0.0f32, 0, 0);
        for y in 2..got.height - 2 {
            for x in 2..got.width - 2 {
                let (a, b) = (got.pixel(x, y)[c], want.pixel(x, y)[k]);
                sum += f64::from((a - b).abs());
                worst = worst.max((a - b).abs());
                size = size.max(b.abs());
                exact += usize::from((a - b).abs() <= 1e-3 * b.abs().max(1.0));
                count += 1;
            }
        }
        let mean = sum / f64::from(count) / f64::from(size);
        println!("{name}: mean {mean:e}, worst {worst} of {size}, {exact} of {count} alike");
        if name == "id.Y" {
            // What the raster rounds at outlines.
            assert!(exact as f64 > 0.99 * f64::from(count), "{name}: {exact} of {count}");
        } else {
            // Noise of 256 samples at outlines.
            assert!(mean < 0.01, "{name}: {mean}");
        }
    }
}

/// A lamp and a sky that are not seen, behind a mask that lets all light pass, behind one that lets half of it pass, and in a mirror.
#[test]
fn lights_are_hidden_as_by_the_reference() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let model = |kind| ModelBuilder::new(kind).build().expect("it has defaults");
    let open = |opacity| Material::Mask { opacity: Value::Number(opacity), base: 0 };
    let strip = |name: &str, x: f32, material| {
        let to_world = Mat4::from_translation(Vec3::X * x) * Mat4::from_scale(Vec3::new(0.45, 0.8, 1.0));
        Shape::new(name, Form::Rectangle, to_world, material)
    };
    let behind = Mat4::from_translation(Vec3::NEG_Z) * Mat4::from_scale(Vec3::new(3.0, 0.5, 1.0));
    let lamp = Shape { emission: Some(Value::Number(1.0)), ..Shape::new("lamp", Form::Rectangle, behind, 0) };
    let mut scene = Scene {
        materials: vec![model(Kind::Lambert), open(0.0), open(0.5), model(Kind::Conductor)],
        shapes: vec![strip("open", -1.0, 1), strip("half open", 0.0, 2), strip("mirror", 1.0, 3), lamp],
        lights: vec![Light::Constant { radiance: Vec3::splat(0.3) }],
        cameras: vec![Camera {
            name: "front".into(),
            to_world: look_along(Vec3::Z * 4.0, Vec3::NEG_Z, Vec3::Y),
            projection: Projection::pinhole(0.9),
            near_far: [0.5, 100.0],
            film: Film { width: 36, height: 24, crop: None, filter: Filter::Box },
            samples_per_pixel: 256,
        }],
        ..Scene::default()
    };
    scene.integrator.max_depth = Some(3);
    for hide_emitters in [false, true] {
        scene.integrator.hide_emitters = hide_emitters;
        let options = render::Options { budget: Some(Budget::Samples(256)), ..Default::default() };
        let job = Job::new(&scene, &options).expect("the reference takes it");
        assert!(job.run(|_, _| Action::Continue));
        let want = job.image();
        let rows = Rows::new(&scene).expect("the scene is sound");
        let options = Options { filter: Filter::Box, hide_emitters, ..Options::new([36, 24], Some(2)) };
        let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("it fits");
        for _ in 0..256 {
            stage.frame(&scene.cameras[0]).expect("it is seen");
        }
        let got = stage.image().expect("it can be read");
        let channels = ["R", "G", "B", "A"];
        let [got, want] = [&got, &want].map(|i| i.select(&channels).expect("channels").data);
        let sum = |off: &dyn Fn((&f32, &f32)) -> f32| -> f32 { got.iter().zip(&want).map(off).sum() };
        let off = sum(&|(a, b)| (a - b).abs()) / sum(&|(_, b)| b.abs());
        let dark = want.chunks(4).filter(|p| p.iter().all(|v| *v == 0.0)).count();
        println!("hidden {hide_emitters}: off by {off}, nothing in {dark} of {} pixels", want.len() / 4);
        // Measured .0084 and .0106: noise and outlines.
        assert!(off < 0.02, "{off}");
        assert_eq!(dark > 100, hide_emitters, "{dark}");
    }
}

/// The layer of shading normals has what maps of normals and of heights make of them, on both sides of a surface.
#[test]
fn shading_normals_are_as_maps_turn_them() {
    let Some(gpu) = Gpu::for_tests() else { return };
    // Waves that repeat; as a normal map their third channel is mostly up.
    let mut waves = Image::rgb(32, 32);
    for y in 0..32 {
        for x in 0..32 {
            let phase = |k: usize| (TAU * k as f32 / 32.0).sin();
            let up = 0.5 + 0.5 * (1.0 - 0.16 * (phase(x).powi(2) + phase(y).powi(2))).sqrt();
            waves.pixel_mut(x, y).copy_from_slice(&[0.5 + 0.2 * phase(x), 0.5 + 0.2 * phase(y), up]);
        }
    }
    let picture = |channel| Texture::Image {
        image: Arc::new(waves.clone()),
        filter: TextureFilter::Bilinear,
        wrap: [Wrap::Repeat; 2],
        to_uv: Affine2::IDENTITY,
        channel,
    };
    let turned = TurnedNormals { flip_invalid_normals: false, use_shadowing_function: false };
    let place = |x: f32, turn: f32| {
        let turn = Mat4::from_rotation_y(turn);
        Mat4::from_translation(Vec3::X * x) * turn * Mat4::from_scale(Vec3::new(0.9, 1.2, 1.0))
    };
    let sheet = |name: &str, to_world, material| Shape::new(name, Form::Rectangle, to_world, material);
    let mut scene = Scene {
        textures: vec![picture(None), picture(Some(0))],
        materials: vec![
            ModelBuilder::new(Kind::Lambert).build().expect("it has defaults"),
            Material::NormalMap { texture: 0, scale: 1.0, turned, base: 0 },
            Material::BumpMap { texture: 1, scale: 0.3, turned, base: 0 },
        ],
        shapes: vec![
            sheet("normals", place(-2.0, 0.3), 1),
            sheet("heights", place(0.0, -0.2), 2),
            sheet("from behind", place(2.0, 3.0), 1),
        ],
        lights: vec![Light::Constant { radiance: Vec3::splat(0.3) }],
        cameras: vec![Camera {
            name: "front".into(),
            to_world: look_along(Vec3::Z * 5.0, Vec3::NEG_Z, Vec3::Y),
            projection: Projection::pinhole(1.1),
            near_far: [0.5, 100.0],
            film: Film { width: 60, height: 28, crop: None, filter: Filter::Box },
            samples_per_pixel: 64,
        }],
        ..Scene::default()
    };
    scene.integrator.max_depth = Some(2);
    let aovs = vec![Aov::Normal, Aov::ShadingNormal];
    let options =
        render::Options { aovs: aovs.clone(), budget: Some(Budget::Samples(64)), ..Default::default() };
    let job = Job::new(&scene, &options).expect("the reference takes it");
    assert!(job.run(|_, _| Action::Continue));
    let want = job.image();
    let rows = Rows::new(&scene).expect("the scene is sound");
    let options = Options { filter: Filter::Box, aovs, ..Options::new([60, 28], Some(1)) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("it fits");
    for _ in 0..64 {
        stage.frame(&scene.cameras[0]).expect("it is seen");
    }
    let got = stage.image().expect("it can be read");
    let layer = |image: &Image, name: &str| {
        let channels = ["X", "Y", "Z"].map(|c| format!("{name}.{c}"));
        image.select(&channels.each_ref().map(String::as_str)).expect("the layer is there").data
    };
    let apart =
        |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.len() as f32;
    let (ours, theirs) = (layer(&got, "shading_normal"), layer(&want, "shading_normal"));
    let [off, turned_by] = [apart(&ours, &theirs), apart(&theirs, &layer(&want, "normal"))];
    println!("off by {off}, maps turn by {turned_by}");
    // Measured .0017, the noise of outlines, and .115.
    assert!(off < 0.004 && turned_by > 0.05, "{off} {turned_by}");
}
