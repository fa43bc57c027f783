//! The light of a fire on what a costume and a stage are made of: the real-time renderer's closed form against the reference,
//! which marches through the flame.

use glam::{Mat4, Vec2, Vec3};
use yugen_motion::fire::{Fire, Flicker};
use yugen_realtime::{Gpu, Options, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{
    Camera, Film, Filter, FovAxis, Geometry, Integrator, IntegratorKind, Material, ModelBuilder, Projection,
    Scene, Shape, Value, look_along,
};
use yugen_transport::render::{self, Action, Budget, Job};

/// Pixels of a patch, and patches across.
const SIDE: u32 = 12;
const ACROSS: u32 = 4;
const FOOT: Vec3 = Vec3::new(2.6, -1.0, 2.2);

fn materials(scene: &Scene) -> Vec<(&'static str, Material)> {
    let made = |kind: Kind, values: &[(&str, Value)]| {
        let mut model = ModelBuilder::new(kind);
        for (name, value) in values {
            model.set(name, value.clone()).expect("a parameter");
        }
        model.build().expect("a material")
    };
    let noh = |x: f32, y: f32, ground: f32| {
        made(
            Kind::Noh,
            &[
                ("sigma_x", Value::Number(x)),
                ("sigma_y", Value::Number(y)),
                ("rho_d", Value::Rgb(Vec3::splat(ground))),
                ("rho_s", Value::Rgb(Vec3::splat(0.5))),
            ],
        )
    };
    let fabric = |name| {
        ModelBuilder::preset(Kind::Microcylinder, name, scene.working_space)
            .expect("a fabric")
            .build()
            .expect("a material")
    };
    vec![
        ("silk .35/.25", noh(0.35, 0.25, 0.3)),
        ("float .30/.10", noh(0.3, 0.1, 0.1)),
        ("gold .20/.05", noh(0.2, 0.05, 0.0)),
        ("gold .12/.03", noh(0.12, 0.03, 0.0)),
        (
            "hinoki",
            made(
                Kind::MetallicRoughness,
                &[("metallic", Value::Number(0.0)), ("roughness", Value::Number(0.45))],
            ),
        ),
        ("gravel", Material::lambert(Value::Number(0.55))),
        ("linen", fabric("linen_plain")),
        ("crepe", fabric("silk_crepe_de_chine")),
        ("charmeuse", fabric("polyester_satin_charmeuse")),
        ("charmeuse, back", fabric("polyester_satin_charmeuse_back")),
        ("shot silk", fabric("silk_shot")),
        ("velvet", fabric("velvet")),
    ]
}

/// Patches that face between the eye and the flame, each a little turned.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let eye = Vec3::new(0.0, 0.0, 4.0);
    let flame = FOOT + Vec3::Y * 0.5;
    let list = materials(&scene);
    for (i, (name, material)) in list.into_iter().enumerate() {
        let (column, row) = (i as u32 % ACROSS, i as u32 / ACROSS);
        let at = Vec3::new(0.5 * (column as f32 - 1.5), 0.5 * (1.0 - row as f32), 0.0);
        let half = ((eye - at).normalize() + (flame - at).normalize()).normalize();
        let normal = (half + Vec3::new(0.02, 0.03, 0.0) * (i % 3) as f32).normalize();
        let place = Mat4::from_translation(at)
            * look_along(Vec3::ZERO, normal, Vec3::Y)
            * Mat4::from_scale(Vec3::splat(0.24));
        scene.shapes.push(Shape::new(name, Geometry::Rectangle, place, scene.materials.len()));
        scene.materials.push(material);
    }
    let fire = Fire { foot: FOOT, flicker: Flicker::Still, ..Fire::default() };
    scene.add_fire("", &fire, None, 0.0).expect("a fire");
    let [width, height] = [SIDE * ACROSS, SIDE * 3];
    scene.cameras = vec![Camera {
        name: "test".into(),
        to_world: look_along(eye, -Vec3::Z, Vec3::Y),
        projection: Projection::Perspective {
            fov_x: 2.0 * (0.25f32).atan(),
            fov_axis: FovAxis::X,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            principal_point: Vec2::ZERO,
        },
        near_far: [0.01, 100.0],
        film: Film { width, height, crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }];
    scene.integrator = Integrator { kind: IntegratorKind::Path, max_depth: Some(2), ..Integrator::default() };
    scene
}

#[test]
fn materials_reflect_a_fire_as_in_the_reference() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let scene = scene();
    let options = render::Options { budget: Some(Budget::Samples(512)), ..Default::default() };
    let job = Job::new(&scene, &options).expect("the reference takes it");
    assert!(job.run(|_, _| Action::Continue));
    let want = job.image().select(&["R", "G", "B"]).expect("a picture");

    let [width, height] = [SIDE * ACROSS, SIDE * 3];
    let options = Options {
        size: [width, height],
        filter: Filter::Box,
        aovs: Vec::new(),
        trace_camera: true,
        threads: 2,
        bounces: Some(1),
        hide_emitters: false,
        seed: 0,
    };
    let rows = Rows::new(&scene).expect("rows");
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("a stage");
    for _ in 0..16 {
        stage.frame(&scene.cameras[0]).expect("a frame");
    }
    let found = stage.image().expect("a picture").select(&["R", "G", "B"]).expect("channels");

    for (i, shape) in scene.shapes.iter().take(12).enumerate() {
        let (column, row) = (i as u32 % ACROSS, i as u32 / ACROSS);
        let (mut squares, mut of, mut sums) = (0.0f64, 0.0f64, [0.0f64; 2]);
        // The middle of the patch, without its rim.
        for y in 4..SIDE - 4 {
            for x in 4..SIDE - 4 {
                let at = 3 * ((row * SIDE + y) * width + column * SIDE + x) as usize;
                for c in at..at + 3 {
                    let [a, b] = [found.data[c], want.data[c]].map(f64::from);
                    squares += (a - b).powi(2);
                    of += b * b;
                    sums[0] += a;
                    sums[1] += b;
                }
            }
        }
        let (error, ratio) = ((squares / of).sqrt(), sums[0] / sums[1]);
        println!("{:<16} {error:.3} {ratio:.3}", shape.name);
        // Worst seen .099 and 1.092: the sides to which a flame shines are known to the second degree only, and over a sharp
        // highlight it is no Gaussian. Logs that hid nothing would make it half as bright again.
        assert!(error < 0.15 && (ratio - 1.0).abs() < 0.14, "{}: {error} {ratio}", shape.name);
    }
}
