//! Changes of materials and lights on a stage that is there: the picture that a stage made anew has, without its shaders.

use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_realtime::{Gpu, Options, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{Film, Filter, Geometry, Light, Material, ModelBuilder, Scene, Shape, Value};
use yugen_view::command::LightChange;
use yugen_view::edit::{Edits, materials};

fn scene() -> Scene {
    let turned = Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let lamp =
        Mat4::from_translation(Vec3::new(0.0, 3.0, 1.0)) * Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let mut scene = Scene {
        materials: vec![
            Material::lambert(Value::Number(0.5)),
            ModelBuilder::new(Kind::RoughPlastic).build().expect("its defaults"),
        ],
        shapes: vec![
            Shape::new("desk", Geometry::Rectangle, turned * Mat4::from_scale(Vec3::splat(3.0)), 0),
            Shape::new("ball", Geometry::Sphere, Mat4::from_translation(Vec3::Y), 1),
            Shape {
                emission: Some(Value::Rgb(Vec3::splat(4.0))),
                ..Shape::new("lamp", Geometry::Rectangle, lamp, 0)
            },
        ],
        ..Scene::default()
    };
    scene.add_light(
        "point",
        Light::Point { position: Vec3::new(-2.0, 3.0, 2.0), intensity: Vec3::splat(5.0) },
    );
    let mut sky = Image::rgb(8, 4);
    sky.data.iter_mut().enumerate().for_each(|(i, v)| *v = 0.1 + 0.01 * (i % 7) as f32);
    let sky = Light::Environment { image: Arc::new(sky), scale: 1.0, to_world: Mat4::IDENTITY };
    scene.add_light("sky", sky);
    scene.add_light("all around", Light::Constant { radiance: Vec3::splat(0.05) });
    let camera = scene.framing_camera(Film { width: 40, height: 30, filter: Filter::Box, crop: None });
    scene.cameras.push(camera);
    scene
}

fn stage(gpu: &Gpu, scene: &Scene) -> Stage {
    let options = Options { seed: 3, ..Options::new([40, 30], Some(2)) };
    let rows = Rows::new(scene).expect("the scene is sound");
    Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("it fits")
}

fn picture(stage: &mut Stage, scene: &Scene) -> Image {
    for _ in 0..4 {
        stage.frame(&scene.cameras[0]).expect("it is seen");
    }
    stage.image().expect("it can be read")
}

fn mean(image: &Image) -> f32 {
    image.data.iter().sum::<f32>() / image.data.len() as f32
}

#[test]
fn a_stage_takes_other_values_and_shows_what_a_new_one_would() {
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu,
        Err(e) => {
            assert!(!std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1"), "{e}");
            return println!("skipped: {e}");
        }
    };
    let scene = scene();
    let mut live = stage(&gpu, &scene);
    let before = picture(&mut live, &scene);
    let ball = materials(&scene).into_iter().find(|m| m.kind == Kind::RoughPlastic).expect("there is one");
    let mut edits = Edits::none(&scene);
    let words = |w: &[&str]| w.iter().map(|w| w.to_string()).collect::<Vec<_>>();
    let mut last = before.clone();
    for change in ["alpha", "diffuse_reflectance", "lamp", "point", "sky", "all around"] {
        match change {
            "alpha" => edits.set(&ball, "alpha", &words(&["0.4"])).expect("in range"),
            "diffuse_reflectance" => {
                edits.set(&ball, change, &words(&["0.1", "0.2", "0.7"])).expect("in range")
            }
            light => {
                let index = edits.light(light).expect("there is one");
                edits.change_light(index, LightChange::Switch(Some(false)));
            }
        }
        let changed = edits.apply(&scene).expect("it can be");
        let rows = Rows::new(&changed).expect("the scene is sound");
        assert!(live.refill(&rows).expect("the device lives"), "{change} needs another shader");
        let refilled = picture(&mut live, &changed);
        let anew = picture(&mut stage(&gpu, &changed), &changed);
        assert_eq!(refilled.data, anew.data, "{change}");
        assert_ne!(refilled.data, last.data, "{change} is not seen");
        last = refilled;
    }
    // All lights are off: black, with an alpha of one where something stands.
    let light = last.select(&["R", "G", "B"]).expect("a picture");
    assert!(mean(&light) == 0.0 && mean(&before.select(&["R", "G", "B"]).expect("a picture")) > 0.05);
    // And back.
    assert!(live.refill(&Rows::new(&scene).expect("the scene is sound")).expect("the device lives"));
    assert_eq!(picture(&mut live, &scene).data, before.data);
    // Another model has another shader: the stage says so and stays as it was.
    let mut other = scene.clone();
    other.materials[1] = ModelBuilder::new(Kind::Ward).build().expect("its defaults");
    assert!(!live.refill(&Rows::new(&other).expect("the scene is sound")).expect("the device lives"));
    assert_eq!(live.image().expect("it can be read").data, before.data);
}
