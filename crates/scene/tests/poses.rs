//! Rows that take over a pose of their scene, and refuse what is none.

use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_scene::prepared::{Rows, RowsError};
use yugen_scene::{Geometry, Light, Material, Mesh, Scene, Shape, Value};

/// A floor, a lamp that is a sphere, a point light and a sky.
fn scene(t: f32) -> Scene {
    let place = |at: Vec3| Mat4::from_translation(at);
    let mut sky = Image::rgb(8, 5);
    sky.data.fill(0.2);
    let floor = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y + t * Vec3::Z],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    Scene {
        materials: vec![Material::lambert(Value::Number(0.5))],
        shapes: vec![
            Shape::new("floor", Geometry::Mesh(Arc::new(floor)), place(Vec3::ZERO), 0),
            Shape {
                emission: Some(Value::Number(3.0)),
                ..Shape::new("lamp", Geometry::Sphere, place(Vec3::Z * (2.0 + t)), 0)
            },
        ],
        lights: vec![
            Light::Point { position: Vec3::new(t, 1.0, 1.0), intensity: Vec3::splat(1.0 + t) },
            Light::Environment { image: Arc::new(sky), scale: 1.0, to_world: place(Vec3::ZERO) },
            Light::Constant { radiance: Vec3::splat(0.1 * t) },
        ],
        ..Scene::default()
    }
}

/// All that shaders read.
fn read(rows: &Rows) -> impl PartialEq + use<> {
    let vertices: Vec<[f32; 3]> = rows.vertices.iter().map(|v| v.position).collect();
    let draws: Vec<_> = rows.draws.iter().map(|d| (d.to_world, d.flags, d.emitter)).collect();
    let kinds = (rows.lights, rows.lights_by_area, rows.emitters);
    (vertices, rows.triangles.clone(), draws, rows.words.clone(), rows.numbers.clone(), kinds)
}

#[test]
fn rows_that_were_posed_are_those_made_for_the_pose() {
    let mut rows = Rows::new(&scene(0.0)).expect("rows");
    for t in [0.5, 1.0, 0.0] {
        let before = read(&rows);
        rows.pose(&scene(t)).expect("a pose");
        assert!(read(&rows) == read(&Rows::new(&scene(t)).expect("rows")), "{t}");
        assert!(read(&rows) != before, "{t} is another pose");
    }
}

#[test]
fn another_scene_is_no_pose_and_leaves_the_rows_as_they_were() {
    let mut rows = Rows::new(&scene(0.0)).expect("rows");
    let refused = |change: &dyn Fn(&mut Scene), rows: &mut Rows| {
        let before = read(rows);
        let mut other = scene(0.5);
        change(&mut other);
        let problem = rows.pose(&other).expect_err("it is another scene");
        assert!(read(rows) == before, "{problem}");
        problem.to_string()
    };
    let begins = "another scene is no pose of this one: ";
    let point = Light::Point { position: Vec3::ONE, intensity: Vec3::ONE };
    // An environment goes out, and a light of another kind is in its place.
    let environment_out = |s: &mut Scene| drop(s.lights.remove(1));
    assert_eq!(refused(&environment_out, &mut rows), format!("{begins}2 emitters instead of 3"));
    let other_kind = |s: &mut Scene| s.lights[1] = point.clone();
    assert_eq!(
        refused(&other_kind, &mut rows),
        format!("{begins}a point light as emitter number 3 instead of an environment")
    );
    // As many emitters and materials together, but not each.
    let traded = |s: &mut Scene| {
        s.lights.remove(1);
        s.materials.push(s.materials[0].clone());
    };
    assert_eq!(refused(&traded, &mut rows), format!("{begins}2 materials instead of 1"));
    let lamp_out = |s: &mut Scene| {
        s.shapes[1].emission = None;
        s.lights.insert(0, point.clone());
    };
    assert_eq!(
        refused(&lamp_out, &mut rows),
        format!("{begins}a point light as emitter number 1 instead of a surface")
    );
}

#[test]
fn rows_are_empty_after_a_pose_that_has_no_rows_and_whole_after_the_next() {
    let mut rows = Rows::new(&scene(0.0)).expect("rows");
    let mut bad = scene(0.5);
    bad.shapes[1].to_world.w_axis.x = f32::NAN;
    assert!(matches!(rows.pose(&bad), Err(RowsError::Geometry(_))));
    assert!(rows.draws.is_empty() && rows.vertices.is_empty() && rows.emitters == 0 && !rows.has_sky());
    rows.pose(&scene(0.5)).expect("a pose");
    assert!(read(&rows) == read(&Rows::new(&scene(0.5)).expect("rows")));
}
