//! Shadows of lights without extent, for which whole tiles are looked at at once, against every triangle in turn.

use crate::device::gpu;
use crate::rays::{Ray, all_hits};
use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_realtime::{Options, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{
    Aov, Geometry, Light, Material, ModelBuilder, Scene, Shape, Value, look_along, primitives,
};

const SIZE: [u32; 2] = [72, 56];
const POINT: Vec3 = Vec3::new(1.5, 2.5, 2.0);
const SPOT: Vec3 = Vec3::new(-2.5, 2.0, 1.0);
const DIRECTION: Vec3 = Vec3::new(-0.4, -0.7, -0.6);

/// Balls, a mirrored block, a small rectangle in the air, a floor and an open box: convex meshes, flat ones and others, turned and
/// stretched; a red point, a green direction and a blue spot.
fn scene() -> Scene {
    let mut white = ModelBuilder::new(Kind::Lambert);
    white.set("reflectance", Value::Number(0.5)).expect("a parameter");
    let lambert = white.build().expect("a model");
    let shape =
        |geometry, to_world| Shape { face_normals: true, ..Shape::new("thing", geometry, to_world, 1) };
    let ball = |segments| Geometry::Mesh(Arc::new(primitives::ball(segments)));
    let at = |x, y, z| Mat4::from_translation(Vec3::new(x, y, z));
    let mut bowl = primitives::ball(10);
    // Open towards +y, so that it throws shadows into itself.
    bowl.triangles.retain(|t| t.iter().any(|i| bowl.positions[*i as usize].y < 0.3));
    let mut shapes = vec![
        shape(
            ball(24),
            at(-0.9, 0.0, 0.0) * Mat4::from_scale(Vec3::new(0.5, 0.8, 0.4)) * Mat4::from_rotation_z(0.4),
        ),
        shape(ball(12), at(0.5, -0.2, 0.9) * Mat4::from_scale(Vec3::splat(0.35))),
        shape(
            Geometry::Mesh(Arc::new(primitives::block(Vec3::new(0.6, 0.9, 0.5)))),
            at(0.9, -0.3, -0.4) * Mat4::from_rotation_y(0.6) * Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)),
        ),
        shape(Geometry::Mesh(Arc::new(bowl)), at(-0.2, -0.5, 1.2) * Mat4::from_scale(Vec3::splat(0.3))),
        shape(
            Geometry::Rectangle,
            at(0.1, 1.2, 0.3) * Mat4::from_rotation_x(1.1) * Mat4::from_scale(Vec3::splat(0.25)),
        ),
        shape(
            Geometry::Rectangle,
            at(0.0, -0.8, 0.0) * Mat4::from_rotation_x(-1.57) * Mat4::from_scale(Vec3::splat(4.0)),
        ),
    ];
    // Turned inside out.
    shapes[1].flip_normals = true;
    let colour = |c: Vec3| 8.0 * c;
    Scene {
        materials: vec![lambert, Material::TwoSided { front: 0, back: 0 }],
        shapes,
        lights: vec![
            Light::Point { position: POINT, intensity: colour(Vec3::X) },
            Light::Directional { direction: DIRECTION, irradiance: colour(Vec3::Y) },
            Light::Spot {
                to_world: look_along(SPOT, -SPOT, Vec3::Y),
                intensity: colour(Vec3::Z),
                cutoff: 1.2,
                beam: 1.1,
                texture: None,
            },
        ],
        ..Scene::default()
    }
}

#[test]
fn pixels_are_lit_where_nothing_is_between_them_and_a_light() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let rows = Rows::new(&scene).expect("rows");
    let options = Options { aovs: vec![Aov::Position, Aov::Normal], ..Options::new(SIZE, Some(1)) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("a stage");
    let (mut lit, mut dark) = ([0; 3], [0; 3]);
    for eye in [Vec3::new(0.3, 1.6, 4.2), Vec3::new(-2.6, 0.9, 2.4)] {
        let camera = crate::camera(look_along(eye, -eye, Vec3::Y), SIZE);
        stage.frame(&camera).expect("a frame");
        let image = stage.image().expect("a picture");
        let channel = |name: &str| image.channel(name).expect("a channel");
        let [r, x, nx] = ["R", "position.X", "normal.X"].map(channel);
        let alpha = channel("A");
        for pixel in image.data.chunks_exact(image.channels.len()).filter(|p| p[alpha] == 1.0) {
            let place = Vec3::from_slice(&pixel[x..x + 3]);
            let normal = Vec3::from_slice(&pixel[nx..nx + 3]);
            let ways = [POINT - place, -20.0 * DIRECTION.normalize(), SPOT - place];
            for (light, way) in ways.into_iter().enumerate() {
                let facing = normal.dot(way) / way.length();
                // Of both sides of a surface the one that is seen counts.
                let seen = normal.dot(eye - place);
                if facing * seen.signum() < 0.02 || seen.abs() < 0.05 {
                    continue;
                }
                let ray = Ray {
                    origin: place + 1e-4 * normal * facing.signum(),
                    dir: way,
                    t_min: 0.0,
                    t_max: 0.999,
                };
                let between = |slack| all_hits(&rows, &ray, slack).iter().any(|f| f.t > 0.0 && f.t < 0.999);
                // At the edge of a shadow either is right.
                if between(0.02) != between(-0.02) {
                    continue;
                }
                let blocked = between(0.0);
                assert_eq!(pixel[r + light] > 0.0, !blocked, "light {light} at {place}, {pixel:?}");
                if blocked { dark[light] += 1 } else { lit[light] += 1 }
            }
        }
    }
    assert!(lit.iter().chain(&dark).all(|n| *n > 100), "{lit:?} lit, {dark:?} dark");
}
