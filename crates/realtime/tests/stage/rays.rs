//! Rays on the GPU against every triangle in turn, in double precision.

use crate::device::{Gpu, add_draw, add_mesh, gpu};
use glam::{Affine3A, DAffine3, DVec3, Mat3, Quat, Vec3};
use yugen_optics::random::Pcg32;
use yugen_realtime::hierarchy::HIERARCHY_WGSL;
use yugen_realtime::scene::{SceneBuffers, scene_wgsl};
use yugen_scene::prepared::{DrawRow, Rows};

/// Half of the light passes a surface that is see-through.
const PASSES: &str = "
fn passes(draw: u32, triangle: u32, b: vec2<f32>, dir: vec3<f32>) -> f32 {
    return select(0.0, 0.5, draw < arrayLength(&draws) && all(b >= vec2<f32>(0.0)) && b.x + b.y <= 1.0001);
}";

const MAIN: &str = "
@group(1) @binding(0) var<storage, read_write> rays: array<vec4<f32>>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (2u * i >= arrayLength(&rays)) {
        return;
    }
    let o = rays[2u * i];
    let d = rays[2u * i + 1u];
    let hit = trace_closest(o.xyz, d.xyz, o.w, d.w);
    let through = trace_any(o.xyz, d.xyz, o.w, d.w);
    rays[2u * i] = vec4<f32>(hit.t, hit.b1, hit.b2, through);
    rays[2u * i + 1u] = vec4<f32>(f32(i32(hit.draw)), f32(i32(hit.triangle)), 0.0, 0.0);
}";

pub struct Ray {
    pub origin: Vec3,
    pub dir: Vec3,
    pub t_min: f32,
    pub t_max: f32,
}

#[derive(Clone, Copy, Debug)]
pub struct Found {
    pub t: f64,
    pub draw: i32,
    pub triangle: i32,
    pub b: [f64; 3],
    /// Sine of the angle between the ray and the triangle's plane.
    pub slope: f64,
}

fn random_vec(rng: &mut Pcg32) -> Vec3 {
    Vec3::from_array(std::array::from_fn(|_| 2.0 * rng.next_f32() - 1.0))
}

fn trace(rows: &Rows, rays: &[Ray]) -> Option<(Vec<[f32; 4]>, SceneBuffers)> {
    let gpu = gpu()?;
    let scene = SceneBuffers::new(&gpu.device, rows, 2).expect("the scene fits");
    Some((trace_in(gpu, &scene, HIERARCHY_WGSL, rays), scene))
}

/// What the rays meet in a scene that is on the device, by `hierarchy.wgsl` or what stands for it.
fn trace_in(gpu: &Gpu, scene: &SceneBuffers, hierarchy: &str, rays: &[Ray]) -> Vec<[f32; 4]> {
    let input: Vec<[f32; 4]> = rays
        .iter()
        .flat_map(|r| [r.origin.extend(r.t_min).to_array(), r.dir.extend(r.t_max).to_array()])
        .collect();
    gpu.run(scene, &[&scene_wgsl(), hierarchy, PASSES, MAIN], &input)
}

/// All that the line of a ray crosses, `slack` beyond the edges included (in weights).
pub fn all_hits(rows: &Rows, ray: &Ray, slack: f64) -> Vec<Found> {
    let mut found = Vec::new();
    let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    for (i, draw) in rows.draws.iter().enumerate() {
        let [x, y, z] = draw.to_world.map(|r| r.map(f64::from));
        let m = DAffine3::from_cols(
            DVec3::new(x[0], y[0], z[0]),
            DVec3::new(x[1], y[1], z[1]),
            DVec3::new(x[2], y[2], z[2]),
            DVec3::new(x[3], y[3], z[3]),
        );
        for t in draw.first_triangle..draw.first_triangle + draw.triangles {
            let [a, b, c] = rows.triangles[t as usize]
                .map(|v| m.transform_point3(Vec3::from(rows.vertices[v as usize].position).as_dvec3()));
            let (e1, e2) = (b - a, c - a);
            let n = e1.cross(e2);
            let det = -d.dot(n);
            if det == 0.0 {
                continue;
            }
            let s = o - a;
            let q = s.cross(d);
            let (b1, b2) = (e2.dot(q) / det, -e1.dot(q) / det);
            let b = [1.0 - b1 - b2, b1, b2];
            if b.iter().all(|w| *w >= -slack) {
                let slope = det.abs() / (n.length() * d.length());
                found.push(Found { t: n.dot(s) / det, draw: i as i32, triangle: t as i32, b, slope });
            }
        }
    }
    found
}

/// Compares and counts what rounding leaves open; the worst relative error of t.
fn compare(rows: &Rows, rays: &[Ray], scale: f64) -> (usize, usize, f64) {
    let Some((results, _)) = trace(rows, rays) else { return (0, 0, 0.0) };
    let (mut open, mut hits, mut worst) = (0, 0, 0.0f64);
    for (i, ray) in rays.iter().enumerate() {
        let [t, b1, b2, through] = results[2 * i];
        let [draw, triangle, ..] = results[2 * i + 1];
        assert!([t, through, draw].iter().all(|v| v.is_finite()), "ray {i} was not traced");
        let length = f64::from(ray.dir.length());
        // What is surely met, and what perhaps is.
        let maybe = all_hits(rows, ray, 1e-4);
        let room = |f: &Found| 1e-5 * (scale + f.t.abs() * length) / length / f.slope.max(1e-3);
        let within = |f: &Found, by: f64| {
            f.t > f64::from(ray.t_min) + by * room(f) && f.t <= f64::from(ray.t_max) - by * room(f)
        };
        let surely = |f: &&Found| f.b.iter().all(|w| *w > 2e-5) && f.slope > 1e-3 && within(f, 1.0);
        let sure = maybe.iter().filter(surely).min_by(|a, b| a.t.total_cmp(&b.t));
        let opaque = |f: &&Found| rows.draws[f.draw as usize].flags & DrawRow::SEE_THROUGH == 0;
        if draw >= 0.0 {
            hits += 1;
            let same = |f: &&Found| f.draw == draw as i32 && f.triangle == triangle as i32;
            let met = maybe.iter().find(same).unwrap_or_else(|| panic!("ray {i} meets what is not there"));
            let off = (f64::from(t) - met.t).abs() * length / (scale + met.t.abs() * length);
            worst = worst.max(off * met.slope);
            for (b, want) in [(b1, met.b[1]), (b2, met.b[2])] {
                assert!(
                    (f64::from(b) - want).abs() < 1e-3 / met.slope.max(1e-2),
                    "ray {i}: {b} {want} {met:?}"
                );
            }
            if let Some(sure) = sure {
                assert!(met.t <= sure.t + room(sure) + room(met), "ray {i}: {met:?} hides {sure:?}");
            }
        } else {
            open += usize::from(maybe.iter().any(|f| within(f, -1.0)));
            assert!(sure.is_none(), "ray {i} misses {sure:?}");
        }
        // Light: halved by every surface that is see-through, stopped by every other.
        let all_sure = maybe.iter().all(|f| surely(&f) || !within(f, -1.0));
        if all_sure {
            let between: Vec<_> = maybe.iter().filter(surely).collect();
            let want = if between.iter().any(&opaque) { 0.0 } else { 0.5f32.powi(between.len() as i32) };
            assert_eq!(through, want, "ray {i}: {between:?}");
        } else {
            open += 1;
        }
        if sure.filter(opaque).is_some() {
            assert_eq!(through, 0.0, "ray {i} passes {sure:?}");
        }
    }
    (open, hits, worst)
}

fn soup(n: usize, size: f32, rng: &mut Pcg32) -> Vec<[Vec3; 3]> {
    (0..n)
        .map(|_| {
            let p = random_vec(rng);
            [p, p + size * random_vec(rng), p + size * random_vec(rng)]
        })
        .collect()
}

/// Three meshes of which one has triangles without area, in twelve places: turned, stretched, sheared, mirrored, far
/// from where they were made, small and large.
fn instances(rng: &mut Pcg32) -> Rows {
    let mut rows = Rows::default();
    let mut degenerate = soup(40, 0.7, rng);
    for i in 0..10 {
        let [a, b, _] = degenerate[i];
        degenerate.push([a, a, b]);
        degenerate.push([a, b, a.lerp(b, 0.5)]);
    }
    let meshes = [soup(60, 0.5, rng), degenerate, soup(1, 1.0, rng)].map(|c| add_mesh(&mut rows, &c));
    let empty = add_mesh(&mut rows, &[]);
    for i in 0..12 {
        let turn = Mat3::from_quat(Quat::from_scaled_axis(3.0 * random_vec(rng)));
        let mut m = turn;
        if i % 3 == 1 {
            m *= Mat3::from_diagonal(Vec3::new(0.3, 1.0, 1.9));
        }
        if i % 4 == 2 {
            m *= Mat3::from_cols(Vec3::X, Vec3::new(0.8, 1.0, 0.0), Vec3::new(0.1, -0.6, 1.0));
        }
        if i % 2 == 1 {
            m *= Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
        }
        let flags = if i % 3 == 0 { DrawRow::SEE_THROUGH } else { 0 };
        let place = Affine3A::from_mat3_translation(m, 2.0 * random_vec(rng));
        add_draw(&mut rows, meshes[i % 3], &place, flags);
    }
    add_draw(&mut rows, empty, &Affine3A::IDENTITY, 0);
    rows
}

fn random_rays(n: usize, reach: f32, rng: &mut Pcg32) -> Vec<Ray> {
    (0..n)
        .map(|i| {
            let origin = reach * random_vec(rng);
            let mut dir = reach * random_vec(rng) - origin;
            // Along an axis, in a plane of two, or neither; long and short.
            match i % 7 {
                0 => dir = Vec3::X * dir.x,
                1 => dir = Vec3::Y * dir.y,
                2 => dir = Vec3::Z * dir.z,
                3 => dir.y = 0.0,
                _ => {}
            }
            if i % 2 == 0 {
                dir = dir.normalize();
            }
            let t_max = if i % 3 == 0 { 1.0 } else { 1e30 };
            Ray { origin, dir, t_min: if i % 5 == 0 { 0.3 } else { 0.0 }, t_max }
        })
        .collect()
}

#[test]
fn rays_meet_what_every_triangle_in_turn_says() {
    let mut rng = Pcg32::new(7, 3);
    for size in [0.05, 0.4, 2.0] {
        let mut rows = Rows::default();
        let mesh = add_mesh(&mut rows, &soup(600, size, &mut rng));
        add_draw(&mut rows, mesh, &Affine3A::IDENTITY, 0);
        let (open, hits, worst) = compare(&rows, &random_rays(4000, 1.5, &mut rng), 1.5);
        println!("soup of {size}: {hits} hits, {open} open, t off by {worst:e}");
        assert!(hits == 0 && gpu().is_none() || hits > 100);
        assert!(open < 200 && worst < 1e-6);
    }
    for _ in 0..3 {
        let rows = instances(&mut rng);
        let (open, hits, worst) = compare(&rows, &random_rays(4000, 3.0, &mut rng), 3.0);
        println!("instances: {hits} hits, {open} open, t off by {worst:e}");
        assert!(hits == 0 && gpu().is_none() || hits > 1000);
        assert!(open < 200 && worst < 1e-6);
    }
}

#[test]
fn rays_through_nothing_meet_nothing() {
    let mut rng = Pcg32::new(3, 3);
    let mut only_flat = Rows::default();
    let mesh = add_mesh(&mut only_flat, &[[Vec3::X, Vec3::X, Vec3::Y]]);
    add_draw(&mut only_flat, mesh, &Affine3A::IDENTITY, 0);
    let whole = add_mesh(&mut only_flat, &[[Vec3::X, Vec3::Z, Vec3::Y]]);
    add_draw(&mut only_flat, whole, &Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0)), 0);
    for rows in [Rows::default(), only_flat] {
        let Some((results, _)) = trace(&rows, &random_rays(200, 2.0, &mut rng)) else { return };
        for r in results.chunks_exact(2) {
            assert_eq!((r[0][3], r[1][0]), (1.0, -1.0));
        }
    }
}

/// From within a closed mesh no ray escapes, not even through its edges and corners.
#[test]
fn closed_meshes_are_tight() {
    let mut rng = Pcg32::new(11, 3);
    let (across, down) = (48, 24);
    let at = |i: usize, j: usize| {
        let (sin, cos) = (std::f32::consts::PI * j as f32 / down as f32).sin_cos();
        let (y, x) = (std::f32::consts::TAU * (i % across) as f32 / across as f32).sin_cos();
        if j == 0 || j == down { Vec3::Z * cos.signum() } else { Vec3::new(sin * x, sin * y, cos) }
    };
    let mut corners = Vec::new();
    for j in 0..down {
        for i in 0..across {
            corners.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            corners.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let place = Affine3A::from_mat3_translation(
        Mat3::from_quat(Quat::from_scaled_axis(Vec3::new(0.4, 1.0, -0.3)))
            * Mat3::from_diagonal(Vec3::new(1.0, -2.0, 0.7)),
        Vec3::new(3.0, -1.0, 2.0),
    );
    for place in [Affine3A::IDENTITY, place] {
        let mut rows = Rows::default();
        let mesh = add_mesh(&mut rows, &corners);
        add_draw(&mut rows, mesh, &place, 0);
        let mut rays = Vec::new();
        for _ in 0..4 {
            let origin = place.transform_point3(0.5 * random_vec(&mut rng));
            for t in &corners {
                for (a, b) in [(0, 0), (0, 1), (1, 2), (2, 0)] {
                    let goal = place.transform_point3(t[a].lerp(t[b], 0.5));
                    rays.push(Ray { origin, dir: goal - origin, t_min: 0.0, t_max: 1e30 });
                }
            }
        }
        let Some((results, _)) = trace(&rows, &rays) else { return };
        let escaped = results.chunks_exact(2).filter(|r| r[1][0] < 0.0 || r[0][3] != 0.0).count();
        assert_eq!(escaped, 0, "of {}", rays.len());
    }
}

/// Moved draws are met where they are now.
#[test]
fn moved_draws_are_met_in_their_new_place() {
    let Some(gpu) = gpu() else { return };
    let mut rng = Pcg32::new(5, 3);
    let before = instances(&mut rng);
    let mut after = before.clone();
    for draw in &mut after.draws {
        for row in &mut draw.to_world {
            row[3] += 0.7 * (rng.next_f32() - 0.5);
        }
    }
    let mut scene = SceneBuffers::new(&gpu.device, &before, 1).expect("the scene fits");
    scene.place(&gpu.queue, &after.draws).expect("it can be placed");
    let rays = random_rays(500, 3.0, &mut rng);
    let (want, _) = trace(&after, &rays).expect("there is a GPU");
    let got = trace_in(gpu, &scene, HIERARCHY_WGSL, &rays);
    assert_eq!(got, want);
    assert_ne!(trace(&before, &rays).expect("there is a GPU").0, want);
}

/// Deformed meshes are met as if they had been built so.
#[test]
fn deformed_meshes_are_met_in_their_new_shape() {
    let Some(gpu) = gpu() else { return };
    let mut rng = Pcg32::new(6, 3);
    let before = instances(&mut rng);
    let mut after = before.clone();
    let mut scene = SceneBuffers::new(&gpu.device, &before, 1).expect("the scene fits");
    for mesh in [0, 2] {
        let row = before.meshes[mesh as usize];
        let vertices = &mut after.vertices[row.first_vertex as usize..][..row.vertices as usize];
        for v in vertices.iter_mut() {
            v.position = (Vec3::from(v.position) + 0.5 * random_vec(&mut rng)).into();
        }
        scene.deform(&gpu.queue, mesh, vertices).expect("it can be deformed");
    }
    let rays = random_rays(500, 3.0, &mut rng);
    let (want, _) = trace(&after, &rays).expect("there is a GPU");
    let got = trace_in(gpu, &scene, HIERARCHY_WGSL, &rays);
    assert_eq!(got, want);
    assert_ne!(trace(&before, &rays).expect("there is a GPU").0, want);
}

/// The comparison sees a wrong traversal.
#[test]
fn a_wrong_traversal_is_caught() {
    let Some(gpu) = gpu() else { return };
    let mut rng = Pcg32::new(7, 3);
    let mut rows = Rows::default();
    let mesh = add_mesh(&mut rows, &soup(600, 0.4, &mut rng));
    add_draw(&mut rows, mesh, &Affine3A::IDENTITY, 0);
    let rays = random_rays(1000, 1.5, &mut rng);
    let (right, scene) = trace(&rows, &rays).expect("there is a GPU");
    for (from, to) in
        [("max(keys.z, keys.w))", "min(keys.z, keys.w))"), ("let last = first +", "let last = first + 0u *")]
    {
        let wrong = HIERARCHY_WGSL.replace(from, to);
        assert_ne!(wrong, HIERARCHY_WGSL, "nothing to spoil: {from}");
        let got = trace_in(gpu, &scene, &wrong, &rays);
        assert_ne!(got, right, "{from}");
    }
}
