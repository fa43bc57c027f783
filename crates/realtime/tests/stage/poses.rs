//! A stage that takes over a pose shows what one made for it shows.

use crate::device::{Gpu, gpu};
use glam::{Affine2, Mat4, Vec3};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_realtime::{Options, Stage, StageError};
use yugen_reflectance::Kind;
use yugen_scene::prepared::{Rows, VertexRow};
use yugen_scene::{
    Camera, Geometry, Light, Material, Mesh, ModelBuilder, Scene, Shape, Texture, TextureFilter, Value, Wrap,
    look_along,
};

/// A lamp, a wall that is deformed by `t` and a ball that rises with it.
fn scene(t: f32) -> Scene {
    let mut scene = Scene {
        materials: vec![ModelBuilder::new(Kind::Lambert).build().expect("a model")],
        ..Scene::default()
    };
    let wall = Mesh {
        positions: [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]
            .map(|[x, y]| Vec3::new(x, y, -1.0 - t * (x + 2.0)))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let shape = |name: &str, geometry, to_world| Shape::new(name, geometry, to_world, 0);
    scene.shapes.push(shape("wall", Geometry::Mesh(Arc::new(wall)), Mat4::IDENTITY));
    let ball = Mat4::from_translation(Vec3::new(0.0, t, 0.0)) * Mat4::from_scale(Vec3::splat(0.5));
    scene.shapes.push(shape("ball", Geometry::Sphere, ball));
    // A light that moves as well, by place and by what it sends.
    let lamp = Mat4::from_translation(Vec3::new(1.5, 1.0 + t, 1.0)) * Mat4::from_scale(Vec3::splat(0.2));
    let mut lamp = shape("lamp", Geometry::Sphere, lamp);
    lamp.emission = Some(Value::Rgb(Vec3::splat(20.0)));
    scene.shapes.push(lamp);
    let (position, intensity) = (Vec3::new(-1.5, t, 1.0), Vec3::splat(2.0 - t));
    scene.add_light("spark", Light::Point { position, intensity });
    scene
}

fn camera() -> Camera {
    crate::camera(look_along(Vec3::Z * 5.0, -Vec3::Z, Vec3::Y), [32, 24])
}

fn options() -> Options {
    let camera = camera();
    Options::new([camera.film.width, camera.film.height], Some(3))
}

fn picture(stage: &mut Stage) -> Image {
    for _ in 0..4 {
        stage.frame(&camera()).expect("a frame");
    }
    stage.image().expect("a picture")
}

fn rows(scene: &Scene) -> Rows {
    Rows::new(scene).expect("rows")
}

fn stage(gpu: &Gpu, scene: &Scene) -> Stage {
    Stage::new(&gpu.device, &gpu.queue, &rows(scene), &options()).expect("a stage")
}

#[test]
fn a_pose_shows_what_a_stage_made_for_it_shows() {
    let Some(gpu) = gpu() else { return };
    let mut moved = stage(gpu, &scene(0.0));
    let first = picture(&mut moved);
    // Rows that are posed, as windows and films do, and rows made anew.
    let mut posed = rows(&scene(0.0));
    for (t, anew) in [(0.7, false), (0.3, true), (0.0, false)] {
        posed.pose(&scene(t)).expect("a pose");
        let pose = if anew { &rows(&scene(t)) } else { &posed };
        assert!(moved.pose(pose).expect("a pose"));
        let (got, want) = (picture(&mut moved), picture(&mut stage(gpu, &scene(t))));
        // The boxes of a deformed mesh are others than those of one built anew, not what rays meet in them.
        assert_eq!(got.data, want.data, "at {t}");
        assert_eq!(got.data == first.data, t == 0.0);
    }
    // What is no pose of it is refused, and leaves what was there.
    let mut other = scene(0.5);
    other.shapes.pop();
    assert!(!moved.pose(&rows(&other)).expect("the device lives"));
    let mut other = scene(0.5);
    other.shapes[0].name = "renamed".into();
    other.shapes[0].material = 1;
    other.materials.push(other.materials[0].clone());
    assert!(!moved.pose(&rows(&other)).expect("the device lives"));
    assert_eq!(moved.image().expect("a picture").data, first.data);
    assert_eq!(moved.frame(&camera()).expect("a frame"), 5, "the sum goes on");
}

/// The scene on a textured wall, twice as large.
fn textured(t: f32, grey: f32) -> Scene {
    let mut scene = scene(t);
    let mut image = Image::rgb(4, 4);
    image.data.fill(grey);
    scene.textures.push(Texture::Image {
        image: Arc::new(image),
        filter: TextureFilter::Bilinear,
        wrap: [Wrap::Repeat; 2],
        to_uv: Affine2::IDENTITY,
        channel: None,
    });
    scene.materials[0] = Material::lambert(Value::Texture(0));
    scene.shapes[0].to_world = Mat4::from_scale(Vec3::splat(2.0));
    scene
}

#[test]
fn a_pose_that_fails_on_the_way_leaves_nothing_behind_that_the_next_would_keep() {
    let Some(gpu) = gpu() else { return };
    let good = rows(&textured(0.0, 0.5));
    let mut stage = stage(gpu, &textured(0.0, 0.5));
    let want = picture(&mut stage);
    let then = |stage: &mut Stage, what: &str| {
        assert_eq!(stage.frame(&camera()).expect("a frame"), 1, "{what}: the sum is of what was there");
        assert!(stage.pose(&good).expect("a pose"));
        assert_eq!(picture(stage).data, want.data, "{what}");
    };
    // Of rows that reach too far the vertices, lights and textures are sent, and not where the draws are.
    let mut far = textured(0.7, 0.9);
    far.shapes[1].to_world.w_axis.x = 1e16;
    assert!(matches!(stage.pose(&rows(&far)), Err(StageError::Hierarchy(_))));
    then(&mut stage, "a pose");
    assert!(matches!(stage.refill(&rows(&far)), Err(StageError::Hierarchy(_))));
    then(&mut stage, "other textures");
    // Of a mesh that cannot be where its draw takes it the vertices are sent.
    let wall = [0, 1, 2, 3].map(|i| VertexRow { position: [9e14; 3], ..good.vertices[i] });
    assert!(matches!(stage.deform(0, &wall), Err(StageError::Hierarchy(_))));
    then(&mut stage, "a deformed mesh");
}

#[test]
fn a_scene_whose_only_light_goes_out_needs_another_shader() {
    let Some(gpu) = gpu() else { return };
    let lit = |radiance: f32| {
        let mut scene = scene(0.0);
        scene.shapes[2].emission = None;
        scene.lights = vec![Light::Constant { radiance: Vec3::splat(radiance) }];
        scene
    };
    let mut sky = stage(gpu, &lit(1.0));
    assert!(!sky.has_head_light() && stage(gpu, &lit(0.0)).has_head_light());
    assert!(sky.refill(&rows(&lit(2.0))).expect("the device lives"));
    assert!(!sky.refill(&rows(&lit(0.0))).expect("the device lives"));
    assert!(!sky.pose(&rows(&lit(0.0))).expect("the device lives"));
}

/// Coats that no material has are left out of the shader: one that has them shows materials without, not the other way.
#[test]
fn what_is_zero_in_all_materials_is_left_out_of_the_shader() {
    let Some(gpu) = gpu() else { return };
    let coated = |coat: f32, sheen: f32| {
        let values =
            [("clearcoat", Value::Number(coat)), ("sheen_color", Value::Rgb(Vec3::new(0.0, sheen, 0.0)))];
        let model = ModelBuilder::with(Kind::MetallicRoughness, &values);
        let mut scene = scene(0.3);
        scene.materials[0] = model.and_then(ModelBuilder::build).expect("a model");
        scene
    };
    let (bare, both) = (coated(0.0, 0.0), coated(0.7, 0.4));
    let [plain, other] = [&bare, &both].map(|scene| picture(&mut stage(gpu, scene)));
    assert_ne!(plain.data, other.data);
    let mut small = stage(gpu, &bare);
    for more in [coated(0.7, 0.0), coated(0.0, 0.4)] {
        assert!(!small.refill(&rows(&more)).expect("the device lives"));
    }
    assert_eq!(picture(&mut small).data, plain.data);
    let mut large = stage(gpu, &both);
    assert!(large.refill(&rows(&bare)).expect("the device lives"));
    let found = picture(&mut large);
    // Compilers round otherwise where they know more.
    let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-5 * b.abs().max(1.0);
    assert!(found.data.iter().zip(&plain.data).all(near), "a shader with coats shows none otherwise");
}
