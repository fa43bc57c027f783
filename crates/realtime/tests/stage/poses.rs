//! A stage that takes over a pose shows what one made for it shows.

use crate::device::gpu;
use glam::{Mat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_realtime::{Options, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{
    Camera, Film, FovAxis, Geometry, Light, Mesh, ModelBuilder, Projection, Scene, Shape, Value, look_along,
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
    Camera {
        name: "camera".into(),
        to_world: look_along(Vec3::Z * 5.0, -Vec3::Z, Vec3::Y),
        projection: Projection::Perspective {
            fov_x: 0.8,
            fov_axis: FovAxis::X,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            principal_point: Vec2::ZERO,
        },
        near_far: [0.01, 100.0],
        film: Film { width: 32, height: 24, ..Film::default() },
        samples_per_pixel: 1,
    }
}

fn options() -> Options {
    let camera = camera();
    Options {
        size: [camera.film.width, camera.film.height],
        filter: camera.film.filter,
        aovs: Vec::new(),
        trace_camera: false,
        threads: 1,
        bounces: Some(3),
        hide_emitters: false,
        seed: 0,
    }
}

fn picture(stage: &mut Stage) -> Image {
    for _ in 0..4 {
        stage.frame(&camera()).expect("a frame");
    }
    stage.image().expect("a picture")
}

#[test]
fn a_pose_shows_what_a_stage_made_for_it_shows() {
    let Some(gpu) = gpu() else { return };
    let new = |t: f32| {
        let rows = Rows::new(&scene(t)).expect("rows");
        Stage::new(&gpu.device, &gpu.queue, &rows, &options()).expect("a stage")
    };
    let mut moved = new(0.0);
    let first = picture(&mut moved);
    for t in [0.7, 0.0] {
        assert!(moved.pose(&Rows::new(&scene(t)).expect("rows")).expect("a pose"));
        let (got, want) = (picture(&mut moved), picture(&mut new(t)));
        // The boxes of a deformed mesh are others than those of one built anew, not what rays meet in them.
        assert_eq!(got.data, want.data, "at {t}");
        assert_eq!(got.data == first.data, t == 0.0);
    }
    // What is no pose of it is refused, and leaves what was there.
    let mut other = scene(0.5);
    other.shapes.pop();
    assert!(!moved.pose(&Rows::new(&other).expect("rows")).expect("the device lives"));
    let mut other = scene(0.5);
    other.shapes[0].name = "renamed".into();
    other.shapes[0].material = 1;
    other.materials.push(other.materials[0].clone());
    assert!(!moved.pose(&Rows::new(&other).expect("rows")).expect("the device lives"));
    assert_eq!(picture(&mut moved).data.len(), first.data.len());
}
