//! A landscape to be painted in ink: peaks, cliffs and boulders of displaced noise, pines with branches and needles, a boat on
//! water that is not there. What lies between is left to mist, which the painter adds.
//!
//! `landscape` writes `out/landscape.toml`, `landscape FILE.toml` elsewhere, for `yugen ink`. Cameras: `wide` and `scroll`.

mod pine;
mod rock;

use anyhow::Result;
use glam::{Mat4, Vec2, Vec3, vec3};
use pine::Pine;
use rock::{Boulder, Peak};
use std::path::PathBuf;
use std::sync::Arc;
use yugen_archive::formats::labels::Labels;
use yugen_archive::formats::toml;
use yugen_optics::ColourSpace;
use yugen_scene::{
    Camera, Film, Filter, FovAxis, Geometry, Light, Material, MaterialId, Mesh, Projection, Scene, Shape,
    Value, look_along,
};

/// What things are made of, and how light it is.
const MATERIALS: [(&str, f32); 7] = [
    ("rock", 0.3),
    ("peak", 0.36),
    ("bark", 0.13),
    ("needles", 0.1),
    ("foliage", 0.2),
    ("pines", 0.16),
    ("boat", 0.25),
];

fn main() -> Result<()> {
    let file = std::env::args_os().nth(1).map_or(PathBuf::from("out/landscape.toml"), PathBuf::from);
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let scene = landscape();
    let triangles: usize = scene
        .shapes
        .iter()
        .map(|s| if let Geometry::Mesh(mesh) = &s.geometry { mesh.triangles.len() } else { 0 })
        .sum();
    let labels =
        Labels { materials: MATERIALS.iter().map(|m| m.0.to_string()).collect(), ..Labels::default() };
    toml::write(&file, &scene, &labels)?;
    println!("{}: {} shapes, {triangles} triangles", file.display(), scene.shapes.len());
    Ok(())
}

/// Adds a shape of a material by its name.
fn add(scene: &mut Scene, name: String, material: &str, mesh: Mesh) {
    let material: MaterialId = MATERIALS.iter().position(|m| m.0 == material).expect("one of MATERIALS");
    scene.shapes.push(Shape::new(name, Geometry::Mesh(Arc::new(mesh)), Mat4::IDENTITY, material));
}

fn landscape() -> Scene {
    let mut scene = Scene { working_space: ColourSpace::default(), ..Scene::default() };
    scene.materials = MATERIALS.map(|(_, albedo)| Material::lambert(Value::Number(albedo))).to_vec();
    // Peaks, from far to near: foot, height, half width, leaning to.
    let peaks: [([f32; 2], f32, f32, f32); 8] = [
        ([-62.0, -185.0], 62.0, 26.0, 2.0),
        ([44.0, -210.0], 88.0, 30.0, -6.0),
        ([92.0, -190.0], 60.0, 26.0, 4.0),
        ([10.0, -150.0], 74.0, 19.0, 5.0),
        ([-14.0, -135.0], 46.0, 13.0, -3.0),
        ([31.0, -128.0], 50.0, 14.0, 2.0),
        ([25.0, -66.0], 29.0, 8.0, -2.0),
        ([33.0, -74.0], 21.0, 8.0, 1.0),
    ];
    for (i, ([x, z], height, radius, lean)) in (1u32..).zip(peaks) {
        let near = z > -100.0;
        let peak =
            Peak { foot: vec3(x, -9.0, z), height, radius, lean: vec3(lean, 0.0, 0.3 * lean), seed: i };
        add(&mut scene, format!("peak-{i}"), if near { "rock" } else { "peak" }, peak.mesh(near));
        // Pines on its shoulders and its top, small with distance.
        let pines = if near {
            9
        } else if z > -160.0 {
            12
        } else {
            0
        };
        for k in 0..pines {
            let (foot, out) = peak.stand(k);
            let tall = if near { 2.6 } else { 4.8 };
            for (part, blob) in pine::distant(foot, out, tall, 31 * i + k).into_iter().enumerate() {
                add(&mut scene, format!("far-pine-{i}-{k}-{part}"), "pines", blob);
            }
        }
    }
    // The ledge on which the pine stands, and what lies before it.
    let boulders: [(Vec3, Vec3, u32); 12] = [
        (vec3(-8.6, -0.2, -2.0), vec3(5.2, 4.8, 3.6), 3),
        (vec3(-5.0, -0.9, 1.0), vec3(2.9, 2.6, 2.4), 4),
        (vec3(-11.0, 3.0, -6.5), vec3(3.6, 3.8, 3.0), 5),
        (vec3(-3.0, -0.9, 2.6), vec3(1.5, 1.5, 1.3), 6),
        (vec3(-7.4, -0.7, 4.0), vec3(2.6, 2.1, 1.7), 7),
        (vec3(-2.0, -1.6, -1.2), vec3(1.6, 1.5, 1.4), 13),
        (vec3(10.9, -1.6, -4.0), vec3(3.4, 2.9, 2.6), 8),
        (vec3(7.9, -1.9, -2.6), vec3(1.7, 1.6, 1.5), 9),
        (vec3(13.2, -0.6, -8.5), vec3(3.4, 4.4, 3.0), 10),
        (vec3(6.1, -2.3, -3.2), vec3(1.3, 0.9, 0.9), 21),
        (vec3(15.6, -2.4, -24.0), vec3(5.0, 3.6, 3.2), 12),
        (vec3(9.8, -2.9, -22.0), vec3(2.2, 1.7, 1.6), 14),
    ];
    for (i, (at, size, seed)) in boulders.into_iter().enumerate() {
        add(&mut scene, format!("boulder-{}", i + 1), "rock", Boulder { at, size, seed }.mesh());
    }
    let pines = [
        Pine { foot: vec3(-6.6, 2.2, -1.9), height: 9.4, lean: vec3(4.0, 0.0, 1.2), seed: 5 },
        Pine { foot: vec3(-9.4, 5.6, -4.4), height: 5.6, lean: vec3(-1.4, 0.0, 0.4), seed: 12 },
    ];
    for (i, pine) in pines.into_iter().enumerate() {
        let (bark, needles, pads) = pine.meshes();
        add(&mut scene, format!("pine-{}", i + 1), "bark", bark);
        for (k, mesh) in needles.into_iter().enumerate() {
            add(&mut scene, format!("pine-{}-needles-{}", i + 1, k + 1), "needles", mesh);
        }
        for (k, mesh) in pads.into_iter().enumerate() {
            add(&mut scene, format!("pine-{}-pad-{}", i + 1, k + 1), "foliage", mesh);
        }
    }
    let (hull, roof, man) = boat(vec3(0.9, -1.9, -13.0), -0.3);
    add(&mut scene, "boat".into(), "boat", hull);
    add(&mut scene, "boat-roof".into(), "boat", roof);
    add(&mut scene, "boatman".into(), "boat", man);

    scene.lights.push(Light::Directional {
        direction: vec3(0.95, -0.85, 0.2).normalize(),
        irradiance: Vec3::splat(2.6),
    });
    scene.lights.push(Light::Constant { radiance: Vec3::splat(0.2) });
    scene.light_names = vec!["sun".into(), "sky".into()];
    scene.cameras = vec![
        camera("wide", vec3(0.0, 4.6, 21.0), vec3(1.0, 9.0, -20.0), 0.66, [1280, 960]),
        camera("scroll", vec3(0.0, 4.6, 21.0), vec3(-0.6, 10.6, -20.0), 0.86, [900, 1400]),
    ];
    scene
}

fn camera(name: &str, eye: Vec3, to: Vec3, fov_y: f32, [width, height]: [u32; 2]) -> Camera {
    Camera {
        name: name.into(),
        to_world: look_along(eye, to - eye, Vec3::Y),
        projection: Projection::Perspective {
            fov_x: 2.0 * ((0.5 * fov_y).tan() * width as f32 / height as f32).atan(),
            fov_axis: FovAxis::Y,
            aperture_radius: 0.0,
            focus_distance: 20.0,
            principal_point: Vec2::ZERO,
        },
        near_far: [0.1, 1000.0],
        film: Film { width, height, crop: None, filter: Filter::Box },
        samples_per_pixel: 16,
    }
}

/// A mesh of rows of points, each joined to the next; `around`: the last point of a row is followed by the first.
fn skin(rows: &[Vec<Vec3>], around: bool) -> Mesh {
    let n = rows.first().map_or(0, Vec::len) as u32;
    let mut mesh = Mesh { positions: rows.concat(), ..Mesh::default() };
    for i in 0..rows.len() as u32 - 1 {
        for j in 0..if around { n } else { n - 1 } {
            let k = (j + 1) % n;
            let [a, b, c, d] = [i * n + j, i * n + k, (i + 1) * n + k, (i + 1) * n + j];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Unit normals at vertices, by the areas of their triangles.
fn smooth(mut mesh: Mesh) -> Mesh {
    mesh.normals = vec![Vec3::ZERO; mesh.positions.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        let n = (b - a).cross(c - a);
        t.iter().for_each(|v| mesh.normals[*v as usize] += n);
    }
    mesh.normals.iter_mut().for_each(|n| *n = n.normalize_or(Vec3::Y));
    mesh
}

/// A tube about a path.
fn tube(path: &[Vec3], radii: &[f32], sides: usize) -> Mesh {
    let mut side = Vec3::X;
    let rows: Vec<Vec<Vec3>> = (0..path.len())
        .map(|i| {
            let way = (path[(i + 1).min(path.len() - 1)] - path[i.saturating_sub(1)]).normalize_or(Vec3::Y);
            side = (side - way * side.dot(way)).normalize_or(way.any_orthonormal_vector());
            let up = way.cross(side);
            (0..sides)
                .map(|k| {
                    let (s, c) = (k as f32 / sides as f32 * std::f32::consts::TAU).sin_cos();
                    path[i] + (side * c + up * s) * radii[i]
                })
                .collect()
        })
        .collect();
    smooth(skin(&rows, true))
}

/// A flat-bottomed boat with a mat over its middle and a man who stands at its stern.
fn boat(at: Vec3, turn: f32) -> (Mesh, Mesh, Mesh) {
    let place = Mat4::from_translation(at) * Mat4::from_rotation_y(turn);
    let rows: Vec<Vec<Vec3>> = (0..=24)
        .map(|i| {
            let t = i as f32 / 12.0 - 1.0;
            let (half, lift) = (0.52 * (1.0 - t * t).max(0.0).powf(0.6), 0.55 * t.abs().powf(2.6));
            (0..=8)
                .map(|k| {
                    let s = k as f32 / 4.0 - 1.0;
                    let deep = 0.36 * (1.0 - s.abs().powi(3));
                    place.transform_point3(vec3(2.1 * t, 0.4 + lift - deep, half * s))
                })
                .collect()
        })
        .collect();
    let roof: Vec<Vec<Vec3>> = (0..=6)
        .map(|i| {
            let x = -0.75 + 1.3 * i as f32 / 6.0;
            (0..=10)
                .map(|k| {
                    let (s, c) = ((1.0 - k as f32 / 10.0) * std::f32::consts::PI).sin_cos();
                    place.transform_point3(vec3(x, 0.4 + 0.62 * s, 0.5 * c))
                })
                .collect()
        })
        .collect();
    let body: Vec<Vec3> =
        (0..=8).map(|i| place.transform_point3(vec3(1.15, 0.35 + 0.13 * i as f32, 0.0))).collect();
    let wide = [0.17, 0.21, 0.22, 0.22, 0.2, 0.12, 0.12, 0.34, 0.02];
    (smooth(skin(&rows, false)), smooth(skin(&roof, false)), tube(&body, &wide, 10))
}
