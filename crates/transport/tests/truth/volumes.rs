//! Volumes that emit and absorb, against quadrature of their cells.

use super::{camera, lambert, mean, render, shape};
use glam::{Mat4, UVec3, Vec2, Vec3};
use std::sync::Arc;
use yugen_motion::fire::Grid;
use yugen_optics::ColourSpace;
use yugen_scene::{
    Geometry, Integrator, IntegratorKind, Light, Material, Projection, Scene, Shape, Strategy, Value,
};

/// A lopsided flame in a box of 8 x 8 x 12 cells, as thick as is asked for.
fn flame(absorption: f32) -> Arc<Grid> {
    let size = UVec3::new(8, 8, 12);
    let mut grid = Grid {
        size,
        lower: Vec3::new(-0.5, -0.4, 1.0),
        upper: Vec3::new(0.5, 0.6, 3.0),
        space: ColourSpace::default(),
        data: vec![],
        solid: vec![],
    };
    for z in 0..size.z {
        for y in 0..size.y {
            for x in 0..size.x {
                let at = UVec3::new(x, y, z);
                let edge = at.cmpeq(UVec3::ZERO).any() || at.cmpeq(size - 1).any();
                let from = (grid.centre(at) - Vec3::new(0.1, 0.1, 1.7)) / Vec3::new(0.2, 0.2, 0.5);
                let v = if edge { 0.0 } else { (-from.length_squared()).exp() };
                grid.data.push([3.0 * v, 2.0 * v, v, absorption * v]);
            }
        }
    }
    Arc::new(grid)
}

/// A small patch at the origin that faces +z, seen from the side, before a flame; and perhaps something between.
fn before_a_flame(grid: &Arc<Grid>, place: Mat4, strategy: Strategy, more: &[Shape]) -> Scene {
    let patch = shape(Geometry::Rectangle, Mat4::from_scale(Vec3::splat(1e-3)), 0);
    let mut eye = camera(4, 4, Vec3::new(3.0, 0.0, 1.5), Vec3::ZERO);
    let Projection::Perspective { fov_x, .. } = &mut eye.projection else { unreachable!() };
    *fov_x = 1e-4;
    Scene {
        cameras: vec![eye],
        materials: vec![lambert(1.0), Material::Mask { opacity: Value::Number(0.25), base: 0 }],
        shapes: std::iter::once(patch).chain(more.iter().cloned()).collect(),
        lights: vec![Light::Volume { grid: grid.clone(), scale: 2.0, to_world: place }],
        integrator: Integrator { kind: IntegratorKind::Direct, strategy, ..Integrator::default() },
        ..Scene::default()
    }
}

/// Irradiance of a patch at `origin` that faces +z, of a grid where it is, by rays through a fine raster.
fn irradiance(grid: &Grid, origin: Vec3) -> f64 {
    let n = 1000;
    let mut sum = 0.0;
    for j in 0..n {
        for i in 0..n {
            // Equal solid angles times cosine: Malley's disc.
            let p = (Vec2::new(i as f32, j as f32) + 0.5) / n as f32 * 2.0 - 1.0;
            let r2 = p.length_squared();
            if r2 < 1.0 {
                let direction = p.extend((1.0 - r2).sqrt());
                sum += f64::from(grid.march(origin, direction, [0.0, 10.0], 0.01).radiance.x);
            }
        }
    }
    sum * 4.0 / f64::from(n * n)
}

#[test]
fn a_patch_before_a_flame_gets_what_quadrature_of_the_flame_says() {
    for absorption in [0.0, 2.0, 12.0] {
        let grid = flame(absorption);
        // Beside the flame and in the middle of it.
        for (along, spp) in [(0.0, 4096), (-1.6, 4096)] {
            let place = Mat4::from_translation(Vec3::Z * along);
            let expected = 2.0 * irradiance(&grid, Vec3::Z * -along) / std::f64::consts::PI;
            for strategy in [Strategy::Both, Strategy::Lights, Strategy::Material] {
                if along < 0.0 && strategy == Strategy::Lights {
                    // Few samples look away from the middle; nothing tells how far off that is.
                    continue;
                }
                let mut scene = before_a_flame(&grid, place, strategy, &[]);
                if along < 0.0 {
                    // The eye looks through the flame; what it sees of it is not the patch's.
                    scene.integrator.hide_emitters = true;
                }
                let got = mean(&render(&scene, spp), 0);
                let off = got / expected - 1.0;
                // Worst seen 9e-4.
                assert!(
                    off.abs() < 4e-3,
                    "κ {absorption} at {along} by {strategy:?}: {got}, expected {expected}"
                );
            }
        }
    }
}

#[test]
fn a_flame_is_hidden_and_dimmed_by_what_stands_in_it_and_before_it() {
    let grid = flame(2.0);
    let bright = 2.0 * irradiance(&grid, Vec3::ZERO) / std::f64::consts::PI;
    // A pane of a quarter's opacity before it.
    let pane = shape(
        Geometry::Rectangle,
        Mat4::from_scale_rotation_translation(Vec3::splat(0.6), glam::Quat::IDENTITY, Vec3::Z * 0.5),
        1,
    );
    // A plate in the middle of it, behind which half is dark.
    let plate = shape(Geometry::Rectangle, Mat4::from_translation(Vec3::Z * 1.7), 0);
    let mut seen = Vec::new();
    for strategy in [Strategy::Both, Strategy::Lights, Strategy::Material] {
        let mut scene = before_a_flame(&grid, Mat4::IDENTITY, strategy, std::slice::from_ref(&pane));
        scene.integrator = Integrator { max_depth: Some(3), strategy, ..Integrator::default() };
        let dimmed = mean(&render(&scene, 4096), 0);
        // The material alone finds it with one sample in thirty, of which it lets three quarters through.
        let noise = if strategy == Strategy::Material { 4e-2 } else { 4e-3 };
        assert!((dimmed / (0.75 * bright) - 1.0).abs() < noise, "{strategy:?}: {dimmed}, open {bright}");
        let scene = before_a_flame(&grid, Mat4::IDENTITY, strategy, std::slice::from_ref(&plate));
        seen.push(mean(&render(&scene, 4096), 0));
    }
    let [both, lights, material] = seen[..] else { panic!() };
    assert!((both / lights - 1.0).abs() < 5e-3 && (both / material - 1.0).abs() < 4e-2, "{seen:?}");
    assert!(both > 0.3 * bright && both < 0.8 * bright, "{both} of {bright}");
}

#[test]
fn smoke_dims_what_is_behind_it_by_the_law_of_lambert_and_beer() {
    let grid = flame(2.0);
    let eye = Vec3::new(0.1, 0.1, 6.0);
    let light = Light::Point { position: eye, intensity: Vec3::splat(36.0) };
    let through = f64::from(grid.march(Vec3::ZERO, eye.normalize(), [0.0, 10.0], 0.002).transmittance);
    let mut scene = before_a_flame(&grid, Mat4::IDENTITY, Strategy::Both, &[]);
    scene.lights = vec![
        // Smoke alone.
        Light::Volume { grid, scale: 0.0, to_world: Mat4::IDENTITY },
        light,
    ];
    let got = mean(&render(&scene, 1024), 0);
    let cos = f64::from(eye.normalize().z);
    let expected = 36.0 / f64::from(eye.length_squared()) * cos / std::f64::consts::PI * through;
    assert!((got / expected - 1.0).abs() < 2e-3 && through < 0.6, "{got}, expected {expected}");
    // And so what a camera sees through it.
    scene.cameras = vec![camera(1, 1, eye, Vec3::ZERO)];
    let Projection::Perspective { fov_x, .. } = &mut scene.cameras[0].projection else { unreachable!() };
    *fov_x = 1e-5;
    scene.lights[1] = Light::Point { position: Vec3::new(3.0, 0.0, 3.0), intensity: Vec3::splat(36.0) };
    let (dim, mut clear) = (mean(&render(&scene, 1 << 14), 0), scene.clone());
    clear.lights.remove(0);
    let ratio = dim / mean(&render(&clear, 64), 0);
    assert!((ratio / through - 1.0).abs() < 2e-3, "{ratio}, expected {through}");
}
