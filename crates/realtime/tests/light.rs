//! Light whose amount is known: spheres in a white room without walls, and lights that fall with the square of the
//! distance.

use glam::{Mat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_motion::fire::Grid;
use yugen_optics::denoise::{ALBEDO, DEPTH, NORMAL};
use yugen_optics::{ColourSpace, Image};
use yugen_realtime::{Gpu, Options, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{
    Camera, Film, Filter, Geometry, Light, Material, ModelBuilder, Projection, Scene, Shape, Value,
};

/// From (0, 0, 4) to the origin, all of a unit sphere there in view.
fn camera(size: u32) -> Camera {
    Camera {
        name: "test".into(),
        to_world: Mat4::from_translation(Vec3::Z * 4.0) * Mat4::from_rotation_y(std::f32::consts::PI),
        projection: Projection::pinhole(0.6),
        near_far: [0.01, 100.0],
        film: Film { width: size, height: size, crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }
}

fn picture(gpu: &Gpu, scene: &Scene, size: u32, bounces: u32, frames: u32) -> Image {
    let rows = Rows::new(scene).expect("rows");
    let options = Options::new([size; 2], Some(bounces));
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("a stage");
    for _ in 0..frames {
        stage.frame(&camera(size)).expect("a frame");
    }
    stage.image().expect("a picture")
}

fn model(kind: Kind, set: &[(&str, Value)]) -> Material {
    ModelBuilder::with(kind, set).and_then(ModelBuilder::build).expect("a model")
}

/// What a sphere of albedo one half looks like: one where nothing is, one half on the sphere.
#[test]
fn a_grey_sphere_in_a_white_sky_is_as_bright_as_its_albedo() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut white = Image::rgb(8, 5);
    white.data.fill(1.0);
    let skies = [
        Light::Constant { radiance: Vec3::ONE },
        Light::Environment { image: Arc::new(white), scale: 1.0, to_world: Mat4::IDENTITY },
    ];
    for sky in skies {
        let scene = Scene {
            materials: vec![model(Kind::Lambert, &[("reflectance", Value::Number(0.5))])],
            shapes: vec![Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 0)],
            lights: vec![sky],
            ..Scene::default()
        };
        let image = picture(&gpu, &scene, 24, 1, 64);
        let at = |x, y| Vec3::from_slice(image.pixel(x, y));
        assert!((at(0, 0) - Vec3::ONE).length() < 1e-5, "{}", at(0, 0));
        let patch: Vec<Vec3> = (8..16).flat_map(|y| (8..16).map(move |x| at(x, y))).collect();
        let mean = patch.iter().sum::<Vec3>() / patch.len() as f32;
        let worst = patch.iter().map(|c| (*c - 0.5).abs().max_element()).fold(0.0, f32::max);
        println!("sky: mean {mean}, worst {worst}");
        // Measured .0014 of the mean of a patch, and .028 of a pixel of 64 samples.
        assert!((mean - 0.5).abs().max_element() < 5e-3 && worst < 0.11, "{mean} {worst}");
    }
}

/// A point light, a spot and a small bright square of the same intensity light a wall as the formula says.
#[test]
fn a_lamp_lights_a_wall_by_its_distance_and_slant() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let wall = Shape::new("wall", Geometry::Rectangle, Mat4::from_scale(Vec3::splat(3.0)), 0);
    let lamp_at = Vec3::new(0.5, 0.3, 1.5);
    let side = 0.05f32;
    let square = Shape {
        // Facing the wall; its radiance times its area is the intensity straight down.
        emission: Some(Value::Number(1.0 / (4.0 * side * side))),
        ..Shape::new(
            "lamp",
            Geometry::Rectangle,
            Mat4::from_translation(lamp_at)
                * Mat4::from_rotation_x(std::f32::consts::PI)
                * Mat4::from_scale(Vec3::splat(side)),
            0,
        )
    };
    let material = || vec![model(Kind::Lambert, &[("reflectance", Value::Number(0.5))])];
    let point = Scene {
        materials: material(),
        shapes: vec![wall.clone()],
        lights: vec![Light::Point { position: lamp_at, intensity: Vec3::ONE }],
        ..Scene::default()
    };
    let (beam, cutoff) = (0.2f32, 1.2f32);
    let mut spot = point.clone();
    spot.lights = vec![Light::Spot {
        to_world: Mat4::from_translation(lamp_at) * Mat4::from_rotation_x(std::f32::consts::PI),
        intensity: Vec3::ONE,
        beam,
        cutoff,
        texture: None,
    }];
    let area = Scene { materials: material(), shapes: vec![wall, square], ..Scene::default() };
    // What they send by the cosine to their axis. Measured 5e-4, 8e-4 and 1.5e-3.
    let by_angle = |cos: f32| ((cutoff - cos.acos()) / (cutoff - beam)).min(1.0);
    let lamps: [(_, &dyn Fn(f32) -> f32, _); 3] =
        [(point, &|_| 1.0, 2e-3), (spot, &by_angle, 3.4e-3), (area, &|cos| cos, 6e-3)];
    for (scene, sends, tolerance) in lamps {
        let image = picture(&gpu, &scene, 64, 1, 128);
        for (x, y) in [(14, 13), (32, 33), (49, 22), (9, 53)] {
            // The middle of the pixel on the wall; the picture's x runs against the camera's.
            let half = 0.3f32.tan() * 4.0;
            let place = |i: usize| (2.0 * (i as f32 + 0.5) / 64.0 - 1.0) * half;
            let p = Vec3::new(place(x), -place(y), 0.0);
            let to = lamp_at - p;
            let cos = to.z / to.length();
            let want = 0.5 / std::f32::consts::PI * cos / to.length_squared() * sends(cos);
            let got = image.pixel(x, y)[1];
            println!("lamp: {}", got / want - 1.0);
            assert!((got / want - 1.0).abs() < tolerance, "({x}, {y}): {got}, not {want}");
        }
    }
}

/// A flame of 10 x 14 x 10 cells about `middle`, brightest there.
fn flame(middle: Vec3, absorption: f32) -> Grid {
    let size = glam::UVec3::new(10, 14, 10);
    let half = Vec3::new(0.3, 0.42, 0.3);
    let (lower, upper) = (middle - half, middle + half);
    let space = ColourSpace::default();
    let mut grid = Grid { size, lower, upper, space, data: Vec::new(), solid: Vec::new() };
    let centres: Vec<Vec3> = grid.centres().collect();
    grid.data = centres
        .iter()
        .map(|p| {
            let edge = (*p - middle).abs().cmpgt(half * (1.0 - 1.5 / size.as_vec3())).any();
            let v = if edge { 0.0 } else { (-((*p - middle) / half * 2.0).length_squared()).exp() };
            // More than a half float holds.
            [3e5 * v, 2e5 * v, 1e5 * v, absorption * v]
        })
        .collect();
    grid
}

/// A flame lights a wall as quadrature of its cells says, and is seen before it and in it where it is a mirror.
#[test]
fn a_flame_lights_a_wall_and_is_seen_before_it_and_in_a_mirror() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let middle = Vec3::new(0.0, 0.0, 1.2);
    let wall = Shape::new("wall", Geometry::Rectangle, Mat4::from_scale(Vec3::splat(3.0)), 0);
    let half = 0.3f32.tan() * 4.0;
    // Where the pixel's ray meets the wall; the picture's x runs against the camera's.
    let place = |x: usize, y: usize| {
        let at = |i: usize| (2.0 * (i as f32 + 0.5) / 64.0 - 1.0) * half;
        Vec3::new(at(x), -at(y), 0.0)
    };
    let eye = Vec3::Z * 4.0;
    for absorption in [0.0, 1.0] {
        let grid = flame(middle, absorption);
        let radiance = |origin: Vec3, to: Vec3| grid.march(origin, to, [0.0, 9.0], 0.01);
        let irradiance = |p: Vec3| {
            let n = 200;
            let directions = (0..n * n).filter_map(|i| {
                let at = (Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) * (2.0 / n as f32) - 1.0;
                let r2 = at.length_squared();
                (r2 < 1.0).then(|| at.extend((1.0 - r2).sqrt()))
            });
            directions.map(|d| radiance(p, d).radiance.y).sum::<f32>() * 4.0 / (n * n) as f32
        };
        for (kind, mirrors) in [(Kind::Lambert, false), (Kind::Conductor, true)] {
            let material =
                if mirrors { model(kind, &[]) } else { model(kind, &[("reflectance", Value::Number(0.5))]) };
            let light = Light::Volume { grid: Arc::new(grid.clone()), scale: 2.0, to_world: Mat4::IDENTITY };
            let scene = Scene {
                materials: vec![material],
                shapes: vec![wall.clone()],
                lights: vec![light],
                ..Scene::default()
            };
            let image = picture(&gpu, &scene, 64, 2, 128);
            let dark = picture(
                &gpu,
                &Scene { lights: vec![Light::Constant { radiance: Vec3::ONE }], ..scene },
                64,
                1,
                4,
            );
            for (x, y) in [(14, 13), (32, 33), (36, 28), (49, 22), (9, 53)] {
                let p = place(x, y);
                let to = (p - eye).normalize();
                let before = radiance(eye, to);
                let want = 2.0 * before.radiance.y
                    + before.transmittance
                        * if mirrors {
                            // What the mirror reflects of an even sky is its reflectance.
                            dark.pixel(x, y)[1] * 2.0 * radiance(p, Vec3::new(to.x, to.y, -to.z)).radiance.y
                        } else {
                            2.0 * irradiance(p) * 0.5 / std::f32::consts::PI
                        };
                let got = image.pixel(x, y)[1];
                let off = if want > 1.0 { got / want - 1.0 } else { got - want };

                // Worst seen 9e-3.
                assert!(off.abs() < 0.04, "κ {absorption}, mirror {mirrors}, ({x}, {y}): {got}, not {want}");
            }
        }
    }
}

/// A ball of radiance one above a floor, and dim ones beside it: rows of the scene.
fn ball_above_a_floor(radius: f32, others: usize) -> Rows {
    let floor = Shape::new("floor", Geometry::Rectangle, Mat4::from_scale(Vec3::splat(3.0)), 0);
    let place = Mat4::from_translation(Vec3::new(0.0, 0.0, 1.0)) * Mat4::from_scale(Vec3::splat(radius));
    let ball = Shape { emission: Some(Value::Number(1.0)), ..Shape::new("ball", Geometry::Sphere, place, 0) };
    let two_sided = Material::TwoSided { front: 0, back: 0 };
    let materials = vec![model(Kind::Lambert, &[("reflectance", Value::Number(0.5))]), two_sided];
    let dim = (0..others).map(|i| {
        let at = Vec3::new(-2.5 + 0.25 * i as f32, -2.5, 1.0);
        let place = Mat4::from_translation(at) * Mat4::from_scale(Vec3::splat(0.05));
        Shape { emission: Some(Value::Number(1e-4)), ..Shape::new("dim", Geometry::Sphere, place, 0) }
    });
    let shapes = [Shape { material: 1, ..floor }, ball].into_iter().chain(dim).collect();
    Rows::new(&Scene { materials, shapes, ..Scene::default() }).expect("rows")
}

/// What a camera beside it sees of the floor within `reach` of the middle, over what `want` says: the worst, and the mean.
fn floor_by(gpu: &Gpu, rows: &Rows, frames: u32, reach: f32, want: &dyn Fn(Vec3) -> f64) -> (f64, f64) {
    let options = Options { aovs: vec![yugen_scene::Aov::Position], ..Options::new([33; 2], Some(1)) };
    let mut beside = camera(33);
    beside.to_world = Mat4::from_translation(Vec3::new(2.0, 0.0, 0.5))
        * Mat4::from_rotation_y(-std::f32::consts::FRAC_PI_2 - 0.25);
    let mut stage = Stage::new(&gpu.device, &gpu.queue, rows, &options).expect("a stage");
    for _ in 0..frames {
        stage.frame(&beside).expect("a frame");
    }
    let image = stage.image().expect("a picture");
    let (mut seen, mut worst, mut mean) = (0, 0.0f64, 0.0);
    for pixel in image.data.chunks(image.channels.len()) {
        let p = Vec3::from_slice(&pixel[4..7]);
        if pixel[3] < 1.0 || p.z.abs() > 1e-3 || p.truncate().length() > reach {
            continue;
        }
        let ratio = f64::from(pixel[0]) / want(p);
        worst = worst.max((ratio - 1.0).abs());
        mean += ratio;
        seen += 1;
    }
    assert!(seen > 20, "{seen}");
    (worst, mean / f64::from(seen))
}

/// Irradiance of a sphere above the horizon, at distance one: π (r/d)² cos.
fn below_the_ball(radius: f32) -> impl Fn(Vec3) -> f64 {
    move |p| {
        let d2 = f64::from(p.truncate().length_squared()) + 1.0;
        0.5 * f64::from(radius * radius) / d2 / d2.sqrt()
    }
}

/// A ball of radiance one lights a floor below its middle by π (r/d)².
#[test]
fn a_bright_ball_lights_a_floor_as_the_square_of_its_sine() {
    let Some(gpu) = Gpu::for_tests() else { return };
    // With 19 dim ones beside it, not every light is looked at in every frame.
    for (radius, others) in [(0.1f32, 0), (0.9, 0), (0.9, 19)] {
        let rows = ball_above_a_floor(radius, others);
        let (worst, mean) = floor_by(&gpu, &rows, 128, 0.6, &below_the_ball(radius));
        println!("{radius} {others}: worst {worst}, mean {mean}");
        // Measured .011 at most, and .0019 of the mean.
        assert!(worst < 0.045 && (mean - 1.0).abs() < 8e-3, "{radius} {others}: {worst} {mean}");
    }
}

/// Each of the numbers that lights are sampled by, a little wrong, is seen in the same pictures.
#[test]
fn a_light_sampled_wrongly_is_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let emitter = |rows: &Rows, word: usize| rows.words[4] as usize + word;
    let scale = |rows: &mut Rows, word: usize, by: f32| {
        let at = emitter(rows, word);
        rows.words[at] = (f32::from_bits(rows.words[at]) * by).to_bits();
    };
    let off = |rows: &Rows| {
        let (worst, mean) = floor_by(&gpu, rows, 64, 0.6, &below_the_ball(0.9));
        worst.max(8.0 * (mean - 1.0).abs())
    };
    // The radius of the cone, alone and among many; evenly by area instead, with another area.
    let mut radius = ball_above_a_floor(0.9, 0);
    scale(&mut radius, 13, 1.1);
    let mut area = ball_above_a_floor(0.9, 0);
    scale(&mut area, 13, 0.0);
    scale(&mut area, 9, 1.5);
    let mut many = ball_above_a_floor(0.9, 19);
    scale(&mut many, 13, 1.1);
    for (name, rows) in [("radius", radius), ("area", area), ("many", many)] {
        let off = off(&rows);
        println!("{name}: {off}");
        assert!(off > 0.1, "{name} is not caught: {off}");
    }
}

/// Half of the sides of a rectangle of radiance one that looks down on a floor, and how high it is.
const LAMP: ([f32; 2], f32) = ([0.8, 0.5], 0.7);

/// Light from a floor of albedo one half below it, by the corner formula: for sides a and b from the foot of the
/// perpendicular, in units of the height, irradiance is [a/√(1+a²) atan(b/√(1+a²)) + b/√(1+b²) atan(a/√(1+b²))]/2.
fn below_the_rectangle(p: Vec3) -> f64 {
    let corner = |a: f64, b: f64| {
        let part = |a: f64, b: f64| {
            let root = (1.0 + a * a).sqrt();
            a / root * (b / root).atan()
        };
        0.5 * (part(a, b) + part(b, a))
    };
    let (half, height) = LAMP;
    let side = |i: usize, sign: f32| f64::from((sign * half[i] - p[i]) / height);
    let (x, y) = ([side(0, -1.0), side(0, 1.0)], [side(1, -1.0), side(1, 1.0)]);
    // The corner formula is odd in both sides.
    0.5 / std::f64::consts::PI
        * (corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0]))
}

/// What a picture may be off by: measured .017 at most, and .0009 of the mean. The least wrong below are .26, and .05 of the
/// mean.
fn rectangle_is_right(worst: f64, mean: f64) -> bool {
    worst < 0.07 && (mean - 1.0).abs() < 4e-3
}

fn rectangle_above_a_floor(geometry: Geometry, turned: Mat4) -> Rows {
    let (half, height) = LAMP;
    let place = Mat4::from_translation(Vec3::new(0.0, 0.0, height))
        * Mat4::from_rotation_x(std::f32::consts::PI)
        * Mat4::from_scale(Vec3::new(half[0], half[1], 1.0));
    let floor = Shape::new("floor", Geometry::Rectangle, Mat4::from_scale(Vec3::splat(3.0)), 0);
    let lamp =
        Shape { emission: Some(Value::Number(1.0)), ..Shape::new("lamp", geometry, place * turned, 0) };
    let scene = Scene {
        materials: vec![model(Kind::Lambert, &[("reflectance", Value::Number(0.5))])],
        shapes: vec![floor, lamp],
        ..Scene::default()
    };
    let rows = Rows::new(&scene).expect("rows");
    assert_eq!(rows.lights >> 30, 1, "the lamp is known to be a rectangle");
    rows
}

#[test]
fn a_bright_rectangle_lights_a_floor_as_the_corner_formula_says() {
    let Some(gpu) = Gpu::for_tests() else { return };
    // The second is mirrored, the third a mesh, with the corners in another order.
    let quad = Arc::new(yugen_scene::Mesh {
        positions: [[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]
            .map(|[x, y]| Vec3::new(x, y, 0.0))
            .to_vec(),
        triangles: vec![[0, 1, 2], [2, 3, 0]],
        ..Default::default()
    });
    let mirror = Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let lamps = [
        ("rectangle", Geometry::Rectangle, Mat4::IDENTITY),
        ("mirrored", Geometry::Rectangle, mirror),
        ("mesh", Geometry::Mesh(quad), Mat4::IDENTITY),
    ];
    for (name, geometry, turned) in lamps {
        let rows = rectangle_above_a_floor(geometry, turned);
        let (worst, mean) = floor_by(&gpu, &rows, 64, 1.0, &below_the_rectangle);
        println!("{name}: worst {worst}, mean {mean}");
        assert!(rectangle_is_right(worst, mean), "{name}: {worst} {mean}");
    }
}

/// Each of the numbers that rectangles are sampled by, a little wrong, is seen in the same picture.
#[test]
fn a_rectangle_sampled_wrongly_is_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let right = || rectangle_above_a_floor(Geometry::Rectangle, Mat4::IDENTITY);
    let scale = |first: usize, by: f32| {
        let mut rows = right();
        let at = rows.words[4] as usize + first;
        rows.words[at..at + 3].iter_mut().for_each(|w| *w = (f32::from_bits(*w) * by).to_bits());
        rows
    };
    let mut swapped = right();
    let at = swapped.words[4] as usize + 17;
    let sides: Vec<u32> = swapped.words[at..at + 6].to_vec();
    swapped.words[at..at + 3].copy_from_slice(&sides[3..]);
    swapped.words[at + 3..at + 6].copy_from_slice(&sides[..3]);
    for (name, rows) in [
        ("corner", scale(14, 1.1)),
        ("first side", scale(17, 1.1)),
        ("second side", scale(20, 0.9)),
        ("facing away", swapped),
    ] {
        let (worst, mean) = floor_by(&gpu, &rows, 64, 1.0, &below_the_rectangle);
        println!("{name}: worst {worst}, mean {mean}");
        assert!(!rectangle_is_right(worst, mean), "{name} is not caught: {worst} {mean}");
    }
}

/// Without a light it comes from the eye: a surface of albedo one half shows half the cosine at which it is seen.
#[test]
fn a_scene_without_light_is_lit_from_the_eye() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let scene = Scene {
        materials: vec![model(Kind::Lambert, &[("reflectance", Value::Number(0.5))])],
        shapes: vec![Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 0)],
        ..Scene::default()
    };
    let rows = Rows::new(&scene).expect("rows");
    let options = Options {
        aovs: vec![yugen_scene::Aov::ShadingNormal, yugen_scene::Aov::Position],
        ..Options::new([33; 2], Some(3))
    };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("a stage");
    assert!(stage.has_head_light());
    stage.frame(&camera(33)).expect("a frame");
    let image = stage.image().expect("a picture");
    let mut seen = 0;
    for p in image.data.chunks(10).filter(|p| p[3] == 1.0) {
        let (normal, position) = (Vec3::from_slice(&p[4..7]), Vec3::from_slice(&p[7..10]));
        let want = 0.5 * normal.dot((Vec3::Z * 4.0 - position).normalize());
        // Where the mesh's outline is, the eye is below the horizon of some interpolated normals.
        assert!((p[0] - want.max(0.0)).abs() < 1e-4, "{p:?}, not {want}");
        seen += 1;
    }
    assert!(seen > 300, "{seen}");
    let lit = Scene { lights: vec![Light::Constant { radiance: Vec3::ONE }], ..scene };
    let rows = Rows::new(&lit).expect("rows");
    assert!(!Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("a stage").has_head_light());
}

/// Layers look through what is open and through lights that are hidden.
#[test]
fn layers_see_what_is_behind_masks_and_hidden_lights() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let in_front = |z: f32| Mat4::from_translation(Vec3::Z * z) * Mat4::from_scale(Vec3::splat(2.0));
    let lamp = Shape {
        emission: Some(Value::Number(1.0)),
        ..Shape::new("lamp", Geometry::Rectangle, in_front(2.0), 0)
    };
    let scene = Scene {
        materials: vec![model(Kind::Lambert, &[]), Material::Mask { opacity: Value::Number(0.0), base: 0 }],
        shapes: vec![
            Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 0),
            Shape::new("mask", Geometry::Rectangle, in_front(1.5), 1),
            lamp,
        ],
        ..Scene::default()
    };
    let rows = Rows::new(&scene).expect("rows");
    for (hide_emitters, want, depth) in [(false, 3.0, 2.0), (true, 1.0, 3.0)] {
        let options = Options {
            filter: Filter::Box,
            aovs: vec![yugen_scene::Aov::Id, yugen_scene::Aov::Depth],
            threads: 2,
            hide_emitters,
            ..Options::new([5; 2], None)
        };
        let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("a stage");
        stage.frame(&camera(5)).expect("a frame");
        let image = stage.image().expect("a picture");
        let middle = image.pixel(2, 2);
        let at = |name: &str| middle[image.channel(name).expect("it is there")];
        assert_eq!(at("id.Y"), want);
        assert!((at("depth.Z") + 0.01 - depth).abs() < 1e-3, "{}", at("depth.Z"));
    }
}

/// So do pictures, and what a denoiser is told: be a light that is hidden before a mask or behind it, the wall beyond is as
/// without both.
#[test]
fn pictures_see_what_is_behind_masks_and_hidden_lights() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let in_front = |z: f32| Mat4::from_translation(Vec3::Z * z) * Mat4::from_scale(Vec3::splat(0.5));
    let plane = |name: &str, z, material| Shape::new(name, Geometry::Rectangle, in_front(z), material);
    // It shines away from the wall.
    let lamp = |z| Shape { emission: Some(Value::Number(0.02)), ..plane("lamp", z, 0) };
    let wall = Shape::new("wall", Geometry::Rectangle, Mat4::from_scale(Vec3::splat(3.0)), 0);
    let open = |opacity| Material::Mask { opacity: Value::Number(opacity), base: 0 };
    let scene = |before: &[Shape]| Scene {
        materials: vec![
            model(Kind::Lambert, &[("reflectance", Value::Number(0.5))]),
            open(0.0),
            open(1e-4),
            model(Kind::Dielectric, &[]),
        ],
        shapes: [std::slice::from_ref(&wall), before].concat(),
        lights: vec![Light::Point { position: Vec3::new(1.5, 0.0, 1.0), intensity: Vec3::splat(0.05) }],
        ..Scene::default()
    };
    let options = |hide_emitters| Options {
        denoise: true,
        planned: Some(4),
        hide_emitters,
        ..Options::new([9; 2], Some(1))
    };
    let seen = |scene: &Scene, hide: bool| {
        let rows = Rows::new(scene).expect("rows");
        let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options(hide)).expect("a stage");
        (0..4).for_each(|_| assert!(stage.frame(&camera(9)).is_ok()));
        let told = stage.halves().expect("the device lives").expect("it was made with them");
        let [albedo, normal, depth] = [ALBEDO.start, NORMAL.end - 1, DEPTH].map(|v| told.mean[1][v][40]);
        (stage.image().expect("a picture").pixel(4, 4)[0], [albedo, normal, depth])
    };
    let (light, told) = seen(&scene(&[]), true);
    assert!(light > 1e-3 && told[0] == 0.5 && told[1] > 0.99 && told[2] > 3.9, "{light} {told:?}");
    let apart = |a: f32, b: f32| (a / b - 1.0).abs();
    let mut worst = 0.0f32;
    for (name, hides, before) in [
        ("a lamp", true, vec![lamp(2.0)]),
        ("two lamps", true, vec![lamp(2.0), lamp(2.5)]),
        ("a lamp before a mask", true, vec![lamp(2.0), plane("mask", 1.5, 1)]),
        ("a lamp behind a mask", true, vec![lamp(1.5), plane("mask", 2.0, 1)]),
        ("a lamp with a body", true, vec![Shape { material: 3, ..lamp(2.0) }]),
        // A mask that lets not all light pass is seen, and what is behind it through it.
        ("a lamp behind what is nearly open", false, vec![lamp(1.5), plane("mask", 2.0, 2)]),
    ] {
        let (hidden, of_hidden) = seen(&scene(&before), true);
        let (shown, _) = seen(&scene(&before), false);
        println!("{name}: {} of the light of the wall, {} where it is shown", hidden / light, shown / light);
        assert!(apart(shown, light) > 0.5, "{name} is not seen where it is shown: {shown} {light}");
        // Rounding alone was measured, 2e-7.
        assert!(apart(hidden, if hides { light } else { shown }) < 1e-6, "{name}: {hidden} {light} {shown}");
        // A denoiser is told of the first that reflects at all.
        for (a, b) in of_hidden.into_iter().zip(told).filter(|_| hides) {
            worst = worst.max(apart(a, b));
        }
    }
    println!("what a denoiser is told is off by {worst}");
    // Measured 1.7e-6.
    assert!(worst < 1e-5, "{worst}");
    // Where nothing else is there is neither light nor a surface.
    let bare = Scene {
        shapes: vec![lamp(1.5), plane("mask", 2.0, 1)],
        lights: vec![Light::Constant { radiance: Vec3::ONE }],
        ..scene(&[])
    };
    let rows = Rows::new(&bare).expect("rows");
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options(true)).expect("a stage");
    (0..4).for_each(|_| assert!(stage.frame(&camera(9)).is_ok()));
    assert_eq!(stage.image().expect("a picture").pixel(4, 4)[..4], [0.0; 4]);
}

/// In a closed white room of albedo a whose walls shine with E, light after n bounces is E (1 − aⁿ⁺¹)/(1 − a).
#[test]
fn a_closed_room_fills_with_light_bounce_by_bounce() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let room = Shape {
        emission: Some(Value::Number(1.0)),
        flip_normals: true,
        ..Shape::new("room", Geometry::Sphere, Mat4::from_scale(Vec3::splat(20.0)), 0)
    };
    let scene = Scene {
        materials: vec![model(Kind::Lambert, &[("reflectance", Value::Number(0.5))])],
        shapes: vec![room],
        ..Scene::default()
    };
    // The last with roulette.
    for bounces in [0, 1, 3, 30] {
        let image = picture(&gpu, &scene, 16, bounces, 64);
        let mean = image.data.chunks(4).map(|p| p[0]).sum::<f32>() / 256.0;
        assert!(image.data.chunks(4).all(|p| p[3] == 1.0), "{bounces}: surfaces cover their pixels");
        let want = 2.0 * (1.0 - 0.5f32.powi(bounces as i32 + 1));
        println!("room: {}", mean / want - 1.0);
        // Measured 6e-4 at most.
        assert!((mean / want - 1.0).abs() < 2.4e-3, "{bounces}: {mean}, not {want}");
    }
}

/// What is too bright for a float is left out, and counted.
#[test]
fn samples_that_are_no_numbers_are_counted() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let ball = |emission: f32| Shape {
        emission: Some(Value::Number(emission)),
        ..Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 0)
    };
    for (emission, some) in [(1.0, false), (3.2e38, true)] {
        let scene = Scene {
            materials: vec![model(Kind::Lambert, &[])],
            shapes: vec![ball(emission)],
            ..Scene::default()
        };
        let options = Options::new([9; 2], Some(0));
        let rows = Rows::new(&scene).expect("rows");
        let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("a stage");
        stage.frame(&camera(9)).expect("a frame");
        let film = stage.film(None).expect("there is a picture");
        let (sums, left_out) = film.read_and_count(&gpu.device, &gpu.queue).expect("it can be read");
        assert_eq!(sums.len(), 81);
        assert_eq!(left_out > 0, some, "{emission}: {left_out}");
        assert_eq!(sums[40][0], if some { 0.0 } else { 1.0 });
    }
}

/// Same seed, same bits, whatever was rendered before.
#[test]
fn the_same_frames_are_the_same_bits() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let scene = Scene {
        materials: vec![model(Kind::Ggx, &[("alpha_x", Value::Number(0.2))])],
        shapes: vec![Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 0)],
        lights: vec![Light::Constant { radiance: Vec3::new(0.2, 0.5, 1.0) }],
        ..Scene::default()
    };
    let [a, b] = [0, 1].map(|_| picture(&gpu, &scene, 24, 2, 5));
    assert_eq!(a.data, b.data);
}

/// A fire that burns on needs no other stage, and shows what a new one would.
#[test]
fn a_fire_burns_on_in_the_same_stage() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut scene = Scene {
        materials: vec![model(Kind::Lambert, &[("reflectance", Value::Number(0.5))])],
        shapes: vec![Shape::new("wall", Geometry::Rectangle, Mat4::from_scale(Vec3::splat(3.0)), 0)],
        ..Scene::default()
    };
    let fire = yugen_motion::fire::Fire { foot: Vec3::new(0.0, -0.5, 1.0), ..Default::default() };
    scene.add_fire("fire", &fire, Some(0.05), 0.0).expect("it burns");
    let options = Options::new([24; 2], Some(1));
    let stage = |rows: &Rows| Stage::new(&gpu.device, &gpu.queue, rows, &options).expect("a stage");
    let mut rows = Rows::new(&scene).expect("rows");
    let mut first = stage(&rows);
    first.frame(&camera(24)).expect("a frame");
    let before = first.image().expect("a picture");
    for seconds in [0.4, 3.0, 7.7] {
        scene.pose(None, seconds).expect("it burns on");
        rows.pose(&scene).expect("a pose");
        assert!(first.pose(&rows).expect("rows"), "at {seconds} s it needs another stage");
        let mut anew = stage(&Rows::new(&scene).expect("rows"));
        for stage in [&mut first, &mut anew] {
            stage.frame(&camera(24)).expect("a frame");
        }
        let [posed, anew] = [&first, &anew].map(|s| s.image().expect("a picture"));
        assert!(posed.data == anew.data && posed.data != before.data, "{seconds}");
    }
}
