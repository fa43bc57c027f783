//! The lighting of Wakita et al. against its equations in double precision.

use glam::{DVec3, Mat4, Vec3};
use std::f64::consts::PI;
use yugen_optics::Image;
use yugen_realtime::{Gpu, Lighting, Options, Stage};
use yugen_reflectance::Kind;
use yugen_scene::prepared::Rows;
use yugen_scene::{
    Camera, Film, Filter, Geometry, Light, Material, ModelBuilder, Projection, Scene, Shape, Value,
};

const SIZE: u32 = 32;
const LAMP: Vec3 = Vec3::new(0.5, 0.3, 1.5);
const INTENSITY: f32 = 3.0;
const SKY: f32 = 0.7;
const EYE: f32 = 4.0;

fn camera() -> Camera {
    Camera {
        name: "test".into(),
        to_world: Mat4::from_translation(Vec3::Z * EYE) * Mat4::from_rotation_y(std::f32::consts::PI),
        projection: Projection::pinhole(0.4),
        near_far: [0.01, 100.0],
        film: Film { width: SIZE, height: SIZE, crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }
}

/// A wall before the eye.
fn scene(wall: Material) -> Scene {
    Scene {
        materials: vec![wall],
        shapes: vec![Shape::new("wall", Geometry::Rectangle, Mat4::from_scale(Vec3::splat(3.0)), 0)],
        lights: vec![
            Light::Point { position: LAMP, intensity: Vec3::splat(INTENSITY) },
            Light::Constant { radiance: Vec3::splat(SKY) },
        ],
        ..Scene::default()
    }
}

fn picture(gpu: &Gpu, scene: &Scene, lighting: Lighting) -> Image {
    let rows = Rows::new(scene).expect("rows");
    let options = Options { lighting, ..Options::new([SIZE; 2], Some(1)) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options).expect("a stage");
    stage.frame(&camera()).expect("a frame");
    stage.image().expect("a picture")
}

/// Where the middle of a pixel is on the wall; the first frame looks there. The camera looks along -z with +x to its left.
fn place(x: u32, y: u32) -> DVec3 {
    let half = f64::from(EYE) * f64::tan(0.2);
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(SIZE) * 2.0 - 1.0;
    DVec3::new(half * at(x), -half * at(y), 0.0)
}

fn model(kind: Kind, set: &[(&str, f32)]) -> Material {
    let mut builder = ModelBuilder::new(kind);
    for (param, value) in set {
        builder.set(param, Value::Number(*value)).expect("a parameter");
    }
    builder.build().expect("a model")
}

#[test]
fn equations_one_to_six_are_met_pixel_by_pixel() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let (rho_d, rho_s, sigma) = (0.2, 0.3, [0.35, 0.12]);
    let costume = model(
        Kind::Noh,
        &[("rho_d", 0.2), ("rho_s", 0.3), ("sigma_x", sigma[0] as f32), ("sigma_y", sigma[1] as f32)],
    );
    let other = model(Kind::Lambert, &[("reflectance", 0.4)]);
    for (material, is_costume) in [(costume, true), (other, false)] {
        let image = picture(&gpu, &scene(material), Lighting::Paper);
        let (mut worst, mut lit) = (0.0f64, 0);
        for y in 0..SIZE {
            for x in 0..SIZE {
                let p = place(x, y);
                let (to, eye) = (LAMP.as_dvec3() - p, (DVec3::Z * f64::from(EYE) - p).normalize());
                let (light, d2) = (to.normalize(), to.length_squared());
                let h = (light + eye).normalize();
                let (colour, power) = if is_costume {
                    let slope = (h.x / h.z / sigma[0]).powi(2) + (h.y / h.z / sigma[1]).powi(2);
                    (rho_d, rho_s * (-slope).exp() / (light.z * eye.z))
                } else {
                    (0.4, h.z.powi(32))
                };
                let want = colour * f64::from(INTENSITY) / d2 * light.z / PI + power * f64::from(SKY);
                let found = f64::from(image.pixel(x as usize, y as usize)[0]);
                worst = worst.max((found / want - 1.0).abs());
                lit += 1;
            }
        }
        println!("costume {is_costume}: {lit} pixels, worst {worst:.1e}");
        // Measured 1.4e-6 on the costume and 4e-6 beside it, of rounding.
        assert!(worst < 4e-5, "{worst}");
    }
}

#[test]
fn fires_of_the_paper_cast_no_shadow() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut scene = Scene {
        lights: vec![Light::Point { position: LAMP, intensity: Vec3::splat(INTENSITY) }],
        ..scene(model(Kind::Lambert, &[("reflectance", 0.4)]))
    };
    // Between the lamp and the middle of the wall.
    let blocker = Mat4::from_translation(LAMP * 0.9) * Mat4::from_scale(Vec3::splat(0.06));
    scene.shapes.push(Shape::new("blocker", Geometry::Sphere, blocker, 0));
    let [full, paper] = [Lighting::Full, Lighting::Paper].map(|l| picture(&gpu, &scene, l));
    let (middle, beside) = ((SIZE / 2) as usize, 2);
    assert_eq!(full.pixel(middle, middle)[0], 0.0, "the blocker stands in the way");
    assert!(paper.pixel(middle, middle)[0] > 0.1);
    // Where nothing does, and there is no sky to be mirrored, both are one.
    let [a, b] = [&full, &paper].map(|i| i.pixel(beside, beside)[0]);
    assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
}
