//! A robe that moves: sewn, put on a player of Noh and danced in by the simulation of this program.

use glam::{Mat4, Vec3};
use std::ops::ControlFlow;
use std::sync::{Arc, LazyLock};
use yugen_motion::dance;
use yugen_motion::garment::{Fitting, outfit};
use yugen_noh::Costume;
use yugen_scene::{
    Camera, Film, Filter, Geometry, Light, Material, Projection, Scene, Shape, Value, look_along,
};

/// A sleeve is thrown over the arm while the player turns, within a second.
const DANCE: &str = "kamae seconds=.2\nturn degrees=40 seconds=.5\nsleeve side=left seconds=2";
/// Edges of its triangles, m: as coarse as the robe of docs/ink.md's performance.
const EDGE: f32 = 0.06;
/// Frames a second of the simulation, of which every second is kept.
const RATE: f64 = 48.0;

/// The robe alone, with a cache of its places. It moves from its beginning on.
pub fn robe() -> Scene {
    static ROBE: LazyLock<Scene> = LazyLock::new(simulated);
    ROBE.clone()
}

fn simulated() -> Scene {
    let moved = dance::dance(&dance::parse(DANCE).unwrap(), RATE).unwrap();
    let garments = outfit("kosode", 1.0).unwrap();
    let fitting = Fitting { edge: EDGE, threads: 2, ..Fitting::default() };
    let worn = Costume::simulate(&garments, &moved, &fitting, 2, |_| ControlFlow::Continue(())).unwrap();
    let Costume { mesh, samples, rate, .. } = worn.into_iter().next_back().unwrap();
    let cloth = Material::lambert(Value::Rgb(Vec3::splat(0.5)));
    let mut scene = Scene {
        materials: vec![cloth.clone(), cloth, Material::TwoSided { front: 0, back: 1 }],
        shapes: vec![Shape::new("robe", Geometry::Mesh(Arc::new(mesh)), Mat4::IDENTITY, 2)],
        lights: vec![
            Light::Directional { direction: Vec3::new(1.0, -1.0, -0.7).normalize(), irradiance: Vec3::ONE },
            Light::Constant { radiance: Vec3::splat(0.1) },
        ],
        ..Scene::default()
    };
    scene.add_cache(0, samples, rate, 0.0, Mat4::IDENTITY).unwrap();
    scene.pose(None, 0.0).unwrap();
    scene
}

/// From before the player, as the performance's own camera is.
pub fn view([width, height]: [u32; 2]) -> Camera {
    let (eye, to) = (Vec3::new(-1.5, 1.25, 4.2), Vec3::Y * 0.8);
    Camera {
        name: "player".into(),
        to_world: look_along(eye, to - eye, Vec3::Y),
        projection: Projection::pinhole(44f32.to_radians()),
        near_far: [0.02, 100.0],
        film: Film { width, height, crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }
}
