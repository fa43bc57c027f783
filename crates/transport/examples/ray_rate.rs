//! How many rays a second, on real meshes: closest hits and occlusion, incoherent rays, all cores.
//!
//! `cargo run --release -p yugen-transport --example ray_rate [MESH.obj …]`; without names, the meshes under
//! `YUGEN_DATA`, a height field of a million triangles and a thin-triangle thicket. `benches/ray_rate.py`
//! sends the same kinds of rays through Mitsuba and prints the ratios.
//! One line a mesh: name, triangles, hit fraction, closest and occlusion rays in M/s, build seconds, bytes a
//! triangle.

use glam::{Mat4, Vec3};
use std::sync::Arc;
use std::time::Instant;
use yugen_optics::random::Pcg32;
use yugen_scene::{Geometry as Form, Mesh, Scene, Shape};
use yugen_transport::accel::Ray;
use yugen_transport::geometry::Geometry;

/// Positions and faces of an OBJ file, polygons as fans; all that a ray needs.
fn obj(path: &str) -> Mesh {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let mut mesh = Mesh::default();
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let x: Vec<f32> = words.take(3).map(|w| w.parse().expect("a number")).collect();
                mesh.positions.push(Vec3::from_slice(&x));
            }
            Some("f") => {
                let n = mesh.positions.len() as i64;
                let index = |w: &str| {
                    let i: i64 = w.split('/').next().and_then(|i| i.parse().ok()).expect("an index");
                    (if i < 0 { n + i } else { i - 1 }) as u32
                };
                let corners: Vec<u32> = words.map(index).collect();
                mesh.triangles.extend((2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]));
            }
            _ => {}
        }
    }
    mesh
}

/// `2 n²` triangles of a bumpy square.
fn height_field(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=n {
        for i in 0..=n {
            let (x, y) = (i as f32 / n as f32, j as f32 / n as f32);
            mesh.positions.push(Vec3::new(
                x,
                y,
                0.1 * (17.0 * x).sin() * (13.0 * y).cos() + 0.01 * (300.0 * x * y).sin(),
            ));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            mesh.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
        }
    }
    mesh
}

/// Long thin triangles in all directions.
fn thicket(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let mut rng = Pcg32::new(5, 1);
    for i in 0..n {
        let (a, b) = (rng.next_vec3(), rng.next_vec3());
        let end = a + (b - a).normalize() * 0.3;
        mesh.positions.extend([a, end, end + 0.002 * rng.next_vec3()]);
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// From a point in the box to a direction drawn evenly.
fn rays(lo: Vec3, hi: Vec3, count: usize) -> Vec<Ray> {
    let mut rng = Pcg32::new(1, 2);
    (0..count)
        .map(|_| {
            let origin = lo + (hi - lo) * rng.next_vec3();
            let z = 1.0 - 2.0 * rng.next_f32();
            let (sin, cos) = (std::f32::consts::TAU * rng.next_f32()).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Ray::new(origin, Vec3::new(r * cos, r * sin, z))
        })
        .collect()
}

/// Seconds this thread has run: on Linux without the time others had its core, so that a busy machine
/// measures (nearly) the same as a quiet one; elsewhere the clock on the wall.
fn thread_seconds(start: Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok())
        .map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Rays a second on all cores, of the best of five rounds, and the sum of what `f` returned.
fn rate(rays: &[Ray], f: impl Fn(&Ray) -> f64 + Sync) -> (f64, f64) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut best = f64::INFINITY;
    let mut total = 0.0;
    for _ in 0..5 {
        let work = |rays: &[Ray]| {
            let clock = Instant::now();
            let start = thread_seconds(clock);
            let sum = rays.iter().map(&f).sum::<f64>();
            (sum, thread_seconds(clock) - start)
        };
        let (sum, seconds) = std::thread::scope(|scope| {
            let chunks = rays.chunks(rays.len().div_ceil(threads));
            let running: Vec<_> = chunks.map(|c| scope.spawn(move || work(c))).collect();
            running
                .into_iter()
                .map(|w| w.join().expect("no panic"))
                .fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
        });
        best = best.min(seconds / threads as f64);
        total = sum;
    }
    (rays.len() as f64 / best, total)
}

fn main() {
    let mut meshes: Vec<(String, Mesh)> = std::env::args().skip(1).map(|p| (p.clone(), obj(&p))).collect();
    if meshes.is_empty() {
        if let Ok(data) = std::env::var("YUGEN_DATA") {
            for name in [
                "mitsuba/common/meshes/sphere.obj",
                "mesh/dancing_girl/DancingGirl.obj",
                "mesh/spot/spot_triangulated.obj",
                "mesh/teapot.obj",
            ] {
                meshes.push((name.rsplit('/').next().unwrap_or(name).into(), obj(&format!("{data}/{name}"))));
            }
        }
        meshes.push(("height field".into(), height_field(707)));
        meshes.push(("thicket".into(), thicket(50_000)));
    }
    println!("mesh triangles hit closest_M/s occluded_M/s build_s bytes/triangle cost");
    for (name, mesh) in meshes {
        let shape = Shape::new(name.clone(), Form::Mesh(Arc::new(mesh)), Mat4::IDENTITY, 0);
        let geometry =
            Geometry::build(&Scene { shapes: vec![shape], ..Default::default() }).expect("a good mesh");
        let (stats, bounds) = (geometry.stats(), geometry.bounds());
        let rays = rays(bounds.lo, bounds.hi, 1_000_000);
        let (closest, hits) = rate(&rays, |r| f64::from(u8::from(geometry.intersect(r).is_some())));
        let (occluded, blocked) = rate(&rays, |r| f64::from(u8::from(geometry.occluded(r))));
        assert_eq!(hits, blocked, "a closest hit is a hit");
        println!(
            "{} {} {:.3} {:.2} {:.2} {:.3} {:.0} {:.1}",
            name.replace(' ', "_"),
            stats.triangles,
            hits / rays.len() as f64,
            closest / 1e6,
            occluded / 1e6,
            stats.build_seconds,
            (stats.tree_bytes + stats.mesh_bytes) as f64 / stats.triangles as f64,
            geometry.validate().expect("a sound tree")[0].cost,
        );
    }
}
