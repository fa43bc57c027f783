//! How well contours are found: recall and precision against shapes whose contours are known, drawn and hidden, of our strokes
//! and of the slides' method.

use crate::surfaces::{Cells, MAJOR, MINOR, Surface, camera, mesh_of, point, scene};
use glam::{DVec2, DVec3};
use std::collections::HashSet;
use std::f64::consts::{PI, TAU};
use yugen_ink::control::Controls;
use yugen_ink::painter::{Painter, Style};
use yugen_ink::projection::Projection;
use yugen_realtime::Gpu;
use yugen_scene::{Camera, Mesh};

const SIZE: [u32; 2] = [960, 540];
/// Pixels within which a line is found.
const NEAR: f64 = 3.0;
/// Parts of the parameters between which a zero is looked for, and lines along which that is done.
const STEPS: u32 = 720;
const LINES: u32 = 3000;

/// What should be seen, and what is there and hidden, as pixels that lines cover.
struct Truth {
    seen: Vec<DVec2>,
    hidden: Vec<DVec2>,
}

/// Pixels of places: each once, so that what counts is length.
fn pixels(places: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let inside =
        |p: &DVec2| p.cmpge(DVec2::ZERO).all() && p.x < f64::from(SIZE[0]) && p.y < f64::from(SIZE[1]);
    let mut once = HashSet::new();
    places.filter(inside).filter(|p| once.insert(p.floor().to_array().map(|v| v as i64))).collect()
}

/// Zeros of N · (eye − P) by bisection along lines of both parameters.
fn zeros(surface: &Surface, projection: &Projection) -> Vec<DVec3> {
    let mut zeros = Vec::new();
    for turned in [false, true] {
        let at = |line: f64, t: f64| if turned { surface(t, line) } else { surface(line, t) };
        for i in 0..=LINES {
            let line = f64::from(i) / f64::from(LINES);
            let g = |t: f64| {
                let (p, n) = at(line, t);
                n.dot(projection.to_eye(p)) >= 0.0
            };
            let mut before = g(0.0);
            for j in 1..=STEPS {
                let [mut a, mut b] = [j - 1, j].map(|k| f64::from(k) / f64::from(STEPS));
                let here = g(b);
                if here != before {
                    for _ in 0..40 {
                        let m = 0.5 * (a + b);
                        if g(m) == before { a = m } else { b = m }
                    }
                    zeros.push(at(line, a).0);
                }
                before = here;
            }
        }
    }
    zeros
}

/// Whether the way from the eye to a point is free but for its last hundredth. `outside`: above zero where nothing is, and no
/// more than the distance to what is.
fn is_free(eye: DVec3, p: DVec3, outside: &dyn Fn(DVec3) -> f64) -> bool {
    let way = p - eye;
    let (length, direction) = (way.length(), way.normalize());
    let mut t = 0.0;
    while t < 0.99 * length {
        let d = outside(eye + direction * t);
        if d < 1e-6 {
            return false;
        }
        t += d.max(1e-3);
    }
    true
}

struct Shape {
    name: &'static str,
    mesh: Mesh,
    truth: Truth,
}

fn shapes(view: &Camera) -> Vec<Shape> {
    let projection = Projection::new(view).unwrap();
    let eye = view.to_world.w_axis.truncate().as_dvec3();
    let seen_at = |p: &DVec3| projection.project(*p).map(|at| at.pixel);
    let truth = |points: Vec<DVec3>, is_seen: &dyn Fn(DVec3) -> bool| {
        let (seen, hidden): (Vec<DVec3>, Vec<DVec3>) = points.into_iter().partition(|p| is_seen(*p));
        let of = |points: &[DVec3]| pixels(points.iter().filter_map(seen_at));
        Truth { seen: of(&seen), hidden: of(&hidden) }
    };
    let mut shapes = Vec::new();

    let torus = |u: f64, v: f64| point(TAU * u, TAU * v);
    let outside = |p: DVec3| DVec2::new(DVec2::new(p.x, p.y).length() - MAJOR, p.z).length() - MINOR;
    let of_torus = || truth(zeros(&torus, &projection), &|p| is_free(eye, p, &outside));
    for across in [48, 96] {
        let mesh = mesh_of(&torus, [2 * across, across], [true, true]);
        shapes.push(Shape { name: "torus", mesh, truth: of_torus() });
    }

    // Longitude and latitude.
    let direction = |u: f64, v: f64| {
        let (a, b) = (TAU * u, PI * (v - 0.5));
        DVec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin())
    };
    for (name, axes) in [("sphere", DVec3::splat(1.1)), ("ellipsoid", DVec3::new(1.3, 0.8, 0.6))] {
        let surface = |u: f64, v: f64| (direction(u, v) * axes, direction(u, v) / axes);
        let mesh = mesh_of(&surface, [96, 48], [true, false]);
        shapes.push(Shape { name, mesh, truth: truth(zeros(&surface, &projection), &|_| true) });
    }

    // A ball with dents, so that contours lie within the outline and end in cusps.
    let radius = |d: DVec3| 1.0 + 0.16 * (4.0 * d.x).sin() * (4.0 * d.y).cos() * (4.0 * d.z + 0.5).cos();
    let outside = |p: DVec3| p.length() - radius(p.normalize());
    let dented = |u: f64, v: f64| {
        let d = direction(u, v);
        let p = d * radius(d);
        let h = 1e-5;
        let slope = |axis: DVec3| (outside(p + h * axis) - outside(p - h * axis)) / (2.0 * h);
        (p, DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)))
    };
    let mesh = mesh_of(&dented, [160, 80], [true, false]);
    // Slopes are up to one: half of what is outside is less than the distance.
    let free = |p: DVec3| is_free(eye, p, &|q| 0.4 * outside(q));
    shapes.push(Shape { name: "dented ball", mesh, truth: truth(zeros(&dented, &projection), &free) });

    // A cylinder with its ends: two straight lines and the rims where one of the faces there looks at the eye.
    let (r, h, n) = (0.8, 1.2, 1200u32);
    let side = |u: f64, v: f64| {
        let d = DVec3::new((TAU * u).cos(), (TAU * u).sin(), 0.0);
        (d * r + DVec3::Z * (v * 2.0 - 1.0) * 0.5 * h, d)
    };
    let mut mesh = mesh_of(&side, [n, 4], [true, false]);
    for (v, normal) in [(0.0, -DVec3::Z), (1.0, DVec3::Z)] {
        let first = mesh.positions.len() as u32;
        mesh.positions.push((normal * 0.5 * h).as_vec3());
        mesh.normals.push(normal.as_vec3());
        for i in 0..n {
            mesh.positions.push(side(f64::from(i) / f64::from(n), v).0.as_vec3());
            mesh.normals.push(normal.as_vec3());
        }
        for i in 0..n {
            let [a, b] = [first + 1 + i, first + 1 + (i + 1) % n];
            mesh.triangles.push(if v > 0.5 { [first, a, b] } else { [first, b, a] });
        }
    }
    let mut lines = zeros(&side, &projection);
    let fine = 20_000;
    for (v, normal) in [(0.0, -DVec3::Z), (1.0, DVec3::Z)] {
        lines.extend((0..fine).map(|i| side(f64::from(i) / f64::from(fine), v).0 + normal * 1e-9));
    }
    let looks = |p: DVec3| {
        let out = DVec3::new(p.x, p.y, 0.0).normalize();
        let end = (p.z.abs() > 0.5 * h - 1e-6).then(|| DVec3::Z * p.z.signum());
        end.is_none_or(|e| e.dot(eye - p) > 0.0 || out.dot(eye - p) > 0.0)
    };
    shapes.push(Shape { name: "cylinder", mesh, truth: truth(lines, &looks) });
    shapes
}

/// Recall, precision, their harmonic mean, and the part of what is hidden that is drawn.
#[derive(Clone, Copy, Debug)]
struct Score {
    recall: f64,
    precision: f64,
    f1: f64,
    shown: f64,
}

fn score(truth: &Truth, drawn: Vec<DVec2>) -> Score {
    let share = |of: &[DVec2], near: &Cells, within: f64| {
        let count = of.iter().filter(|p| near.nearest(**p) <= within).count();
        count as f64 / of.len().max(1) as f64
    };
    let [seen, there] = [truth.seen.clone(), drawn.clone()].map(|p| Cells::new(p.into_iter()));
    let (recall, precision) = (share(&truth.seen, &there, NEAR), share(&drawn, &seen, NEAR));
    // What is hidden and apart from all that is seen.
    let apart: Vec<DVec2> = truth.hidden.iter().copied().filter(|p| seen.nearest(*p) > 2.0 * NEAR).collect();
    Score {
        recall,
        precision,
        f1: 2.0 * recall * precision / (recall + precision).max(1e-9),
        shown: share(&apart, &there, NEAR),
    }
}

/// Published here; asked is an F1 of .97 at 3 pixels, at most 5 % of what is hidden shown and 1 % of what is seen hidden.
#[test]
fn contours_are_found_and_hidden_ones_are_not() {
    let Some(gpu) = Gpu::for_tests() else { return };
    // All lines, with a steady hand: what is left out on purpose is no error.
    let controls = Controls { detail: 1.0, roughness: 0.0, ..Controls::default() };
    let style = Style { controls, ..Style::default() };
    println!(
        "| | triangles | distance | recall | precision | F1 | hidden shown, % | F1 of the slides' method | hidden shown, % |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for distance in [4.5, 12.4] {
        let view = camera(distance, SIZE);
        for Shape { name, mesh, truth } in shapes(&view) {
            let triangles = mesh.triangles.len();
            let scene = scene(mesh);
            let mut painter = Painter::new(&gpu.device, &gpu.queue, &scene, &view, style.clone(), 2).unwrap();
            let strokes = painter.follow(&view).unwrap().0;
            let along = strokes.iter().flat_map(|s| {
                let ends = if s.closed { s.points.first() } else { None };
                let points: Vec<DVec2> = s.points.iter().chain(ends).map(|p| p.pixel.as_dvec2()).collect();
                let between =
                    |w: &[DVec2]| (0..8).map(|k| w[0].lerp(w[1], f64::from(k) / 8.0)).collect::<Vec<_>>();
                points.windows(2).flat_map(between).collect::<Vec<_>>()
            });
            let drawn = pixels(along);
            // Sabotage: the same drawn beside where it should be.
            let beside =
                score(&truth, drawn.iter().map(|p| *p + DVec2::new(2.0 * NEAR, 2.0 * NEAR)).collect());
            assert!(beside.f1 < 0.7, "{beside:?}");
            let ours = score(&truth, drawn);
            let padi = painter.see_literally(&view).unwrap();
            let inked = padi.iter().enumerate().filter(|(_, p)| p.intensity > 0.0).map(|(i, _)| {
                let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
                DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
            });
            let theirs = score(&truth, pixels(inked));
            println!(
                "| {name} | {triangles} | {distance} | {:.3} | {:.3} | {:.3} | {:.1} | {:.3} | {:.1} |",
                ours.recall,
                ours.precision,
                ours.f1,
                100.0 * ours.shown,
                theirs.f1,
                100.0 * theirs.shown
            );
            // Measured .999 or more; a line of three pixels more or less at a cusp is a thousandth.
            assert!(
                truth.seen.len() > 300 && ours.f1 > 0.99 && ours.recall > 0.99 && ours.shown < 0.01,
                "{ours:?}"
            );
            assert!(theirs.f1 < ours.f1 - 0.03, "{theirs:?}");
        }
    }
}
