//! Surfaces that are known exactly, seen by a camera.

use glam::{DVec2, DVec3, Mat4, Vec3};
use std::f64::consts::TAU;
use std::sync::Arc;
use yugen_scene::{
    Camera, Film, Filter, Geometry, Light, Material, Mesh, Projection as Kind, Scene, Shape, Value,
    look_along,
};

pub const MAJOR: f64 = 1.0;
pub const MINOR: f64 = 0.4;

/// About the z axis.
pub fn point(u: f64, v: f64) -> (DVec3, DVec3) {
    let n = DVec3::new(u.cos() * v.cos(), u.sin() * v.cos(), v.sin());
    (DVec3::new(u.cos(), u.sin(), 0.0) * MAJOR + n * MINOR, n)
}

/// A surface over u and v from 0 to 1: places and normals, not of unit length.
pub type Surface<'a> = dyn Fn(f64, f64) -> (DVec3, DVec3) + 'a;

/// Its mesh of as many cells along u and v; `around`: which of them come back to where they begin.
pub fn mesh_of(surface: &Surface, [nu, nv]: [u32; 2], around: [bool; 2]) -> Mesh {
    let mut mesh = Mesh { name: "surface".into(), ..Mesh::default() };
    let [rows, columns] = [nu + u32::from(!around[0]), nv + u32::from(!around[1])];
    for i in 0..rows {
        for j in 0..columns {
            let (p, n) = surface(f64::from(i) / f64::from(nu), f64::from(j) / f64::from(nv));
            mesh.positions.push(p.as_vec3());
            mesh.normals.push(n.normalize().as_vec3());
        }
    }
    let at = |i: u32, j: u32| (i % rows) * columns + j % columns;
    for i in 0..nu {
        for j in 0..nv {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// 2 · across² · 2 triangles.
pub fn torus(across: u32) -> Mesh {
    mesh_of(&|u, v| point(TAU * u, TAU * v), [2 * across, across], [true, true])
}

pub fn camera(distance: f64, size: [u32; 2]) -> Camera {
    let e = 20f64.to_radians();
    let eye = DVec3::new(0.4 * e.cos(), -0.917 * e.cos(), e.sin()).normalize().as_vec3() * distance as f32;
    Camera {
        name: "test".into(),
        to_world: look_along(eye, -eye, Vec3::Z),
        projection: Kind::pinhole(40f32.to_radians()),
        near_far: [0.01, 100.0],
        film: Film { width: size[0], height: size[1], crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }
}

pub fn scene(mesh: Mesh) -> Scene {
    Scene {
        materials: vec![Material::lambert(Value::Rgb(Vec3::splat(0.5)))],
        lights: vec![Light::Directional {
            direction: Vec3::new(-0.5, 0.5, -1.0).normalize(),
            irradiance: Vec3::ONE,
        }],
        shapes: vec![Shape::new("torus", Geometry::Mesh(Arc::new(mesh)), Mat4::IDENTITY, 0)],
        ..Scene::default()
    }
}

/// Places in the picture in cells, to find the nearest.
pub struct Cells(std::collections::HashMap<[i64; 2], Vec<DVec2>>);

impl Cells {
    const SIDE: f64 = 8.0;

    pub fn new(points: impl Iterator<Item = DVec2>) -> Self {
        let mut cells = std::collections::HashMap::new();
        for p in points {
            let cell = (p / Self::SIDE).floor();
            cells.entry([cell.x as i64, cell.y as i64]).or_insert_with(Vec::new).push(p);
        }
        Self(cells)
    }

    /// Distance to the nearest; infinite where there is none within `most`.
    pub fn nearest(&self, p: DVec2, most: f64) -> f64 {
        let cell = (p / Self::SIDE).floor();
        let mut best = f64::INFINITY;
        for ring in 0..=(most / Self::SIDE).ceil() as i64 {
            if best < (ring - 1) as f64 * Self::SIDE {
                break;
            }
            for x in -ring..=ring {
                for y in -ring..=ring {
                    if x.abs().max(y.abs()) == ring
                        && let Some(all) = self.0.get(&[cell.x as i64 + x, cell.y as i64 + y])
                    {
                        best = all.iter().map(|q| q.distance(p)).fold(best, f64::min);
                    }
                }
            }
        }
        if best <= most { best } else { f64::INFINITY }
    }

    pub fn is_near(&self, p: DVec2, most: f64) -> bool {
        self.nearest(p, most) <= most
    }
}
