//! Shapes whose contours are known exactly, drawn and hidden, and how well lines agree with them: the scorer of our own strokes,
//! of the slides' method and of other programs (`examples/line_peers.rs`).

use crate::surfaces::{Cells, MAJOR, MINOR, Surface, mesh_of, point};
use glam::{DVec2, DVec3};
use std::collections::HashSet;
use std::f64::consts::{PI, TAU};
use yugen_ink::projection::Projection;
use yugen_ink::stroke::Stroke;
use yugen_scene::{Camera, Mesh};

/// Pixels across and down.
pub const SIZE: [u32; 2] = [960, 540];
/// Pixels within which a line is found.
pub const NEAR: f64 = 3.0;
/// Parts of a parameter between which a zero is looked for.
const STEPS: u32 = 720;
/// Lines along each parameter along which that is done, where not less is asked.
const LINES: u32 = 3000;
/// Fewest pixels of hidden lines of which a part is a measure.
const FEWEST: usize = 50;

/// What should be seen, and what is there and hidden, as pixels that lines cover.
#[derive(Clone, Debug)]
pub struct Truth {
    pub seen: Vec<DVec2>,
    pub hidden: Vec<DVec2>,
}

/// Pixels of places: each once, so that what counts is length.
pub fn pixels(places: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let inside =
        |p: &DVec2| p.cmpge(DVec2::ZERO).all() && p.x < f64::from(SIZE[0]) && p.y < f64::from(SIZE[1]);
    let mut once = HashSet::new();
    places.filter(inside).filter(|p| once.insert(p.floor().to_array().map(|v| v as i64))).collect()
}

/// Zeros of N · (eye − P) by bisection along so many lines of both parameters.
pub fn zeros(surface: &Surface, projection: &Projection, lines: u32) -> Vec<DVec3> {
    let mut zeros = Vec::new();
    for turned in [false, true] {
        let at = |line: f64, t: f64| if turned { surface(t, line) } else { surface(line, t) };
        for i in 0..=lines {
            let line = f64::from(i) / f64::from(lines);
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

/// Whether the way from the eye to a point is free but for its last part, `skip`, in which the surface that it lies on is
/// touched. `outside`: above zero where nothing is, and no more than the distance to what is.
pub fn is_free(eye: DVec3, p: DVec3, skip: f64, outside: &dyn Fn(DVec3) -> f64) -> bool {
    let way = p - eye;
    let (length, direction) = (way.length(), way.normalize());
    let mut t = 0.0;
    while t < (1.0 - skip) * length {
        let d = outside(eye + direction * t);
        if d < 1e-6 {
            return false;
        }
        t += d.max(1e-4);
    }
    true
}

/// Of the torus.
pub fn torus_at(u: f64, v: f64) -> (DVec3, DVec3) {
    point(TAU * u, TAU * v)
}

/// Distance to the torus, below zero inside.
pub fn outside_torus(p: DVec3) -> f64 {
    DVec2::new(DVec2::new(p.x, p.y).length() - MAJOR, p.z).length() - MINOR
}

pub struct Shape {
    pub name: &'static str,
    pub mesh: Mesh,
    pub truth: Truth,
}

/// Radius of the dented ball in a direction.
fn dents(d: DVec3) -> f64 {
    1.0 + 0.16 * (4.0 * d.x).sin() * (4.0 * d.y).cos() * (4.0 * d.z + 0.5).cos()
}

/// Direction of a longitude and a latitude, of 0 to 1.
fn direction(u: f64, v: f64) -> DVec3 {
    let (a, b) = (TAU * u, PI * (v - 0.5));
    DVec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin())
}

/// A ball with dents, so that contours lie within the outline and end in cusps.
pub fn dented(u: f64, v: f64) -> (DVec3, DVec3) {
    let outside = |p: DVec3| p.length() - dents(p.normalize());
    let d = direction(u, v);
    let p = d * dents(d);
    let h = 1e-5;
    let slope = |axis: DVec3| (outside(p + h * axis) - outside(p - h * axis)) / (2.0 * h);
    (p, DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)))
}

/// Its mesh, of 4 · across² triangles.
pub fn dented_mesh(across: u32) -> Mesh {
    mesh_of(&dented, [2 * across, across], [true, false])
}

/// All of them as a camera sees them.
pub fn shapes(view: &Camera) -> Vec<Shape> {
    let projection = Projection::new(view).unwrap();
    let eye = view.to_world.w_axis.truncate().as_dvec3();
    let seen_at = |p: &DVec3| projection.project(*p).map(|at| at.pixel);
    let truth = |points: Vec<DVec3>, is_seen: &dyn Fn(DVec3) -> bool| {
        let (seen, hidden): (Vec<DVec3>, Vec<DVec3>) = points.into_iter().partition(|p| is_seen(*p));
        let of = |points: &[DVec3]| pixels(points.iter().filter_map(seen_at));
        Truth { seen: of(&seen), hidden: of(&hidden) }
    };
    let mut shapes = Vec::new();

    let of_torus = truth(zeros(&torus_at, &projection, LINES), &|p| is_free(eye, p, 0.01, &outside_torus));
    for across in [48, 96] {
        let mesh = mesh_of(&torus_at, [2 * across, across], [true, true]);
        shapes.push(Shape { name: "torus", mesh, truth: of_torus.clone() });
    }

    for (name, axes) in [("sphere", DVec3::splat(1.1)), ("ellipsoid", DVec3::new(1.3, 0.8, 0.6))] {
        let surface = |u: f64, v: f64| (direction(u, v) * axes, direction(u, v) / axes);
        let mesh = mesh_of(&surface, [96, 48], [true, false]);
        shapes.push(Shape { name, mesh, truth: truth(zeros(&surface, &projection, LINES), &|_| true) });
    }

    // Slopes are up to one: half of what is outside is less than the distance.
    let free = |p: DVec3| is_free(eye, p, 0.01, &|q| 0.4 * (q.length() - dents(q.normalize())));
    let of_dented = truth(zeros(&dented, &projection, LINES), &free);
    shapes.push(Shape { name: "dented ball", mesh: dented_mesh(80), truth: of_dented });

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
    let mut lines = zeros(&side, &projection, LINES);
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
pub struct Score {
    pub recall: f64,
    pub precision: f64,
    pub f1: f64,
    /// `None` where nothing is hidden apart from what is seen.
    pub shown: Option<f64>,
}

impl Score {
    /// Cells of a table.
    pub fn row(&self) -> String {
        let shown = self.shown.map_or("none hidden".into(), |s| format!("{:.1}", 100.0 * s));
        format!("{:.3} | {:.3} | {:.3} | {shown}", self.recall, self.precision, self.f1)
    }
}

/// The pixels of lines through points in the picture, each once.
pub fn pixels_along(lines: impl Iterator<Item = Vec<DVec2>>) -> Vec<DVec2> {
    let steps = |w: &[DVec2]| {
        let (a, b) = (w[0], w[1]);
        let n = (8.0 * a.distance(b)).ceil().clamp(1.0, 1e5) as u32;
        (0..=n).map(move |k| a.lerp(b, f64::from(k) / f64::from(n)))
    };
    pixels(lines.flat_map(|line| line.windows(2).flat_map(steps).collect::<Vec<_>>()))
}

/// The points of a stroke in their order, and the first again where it is closed.
pub fn points(stroke: &Stroke) -> Vec<DVec2> {
    let again = if stroke.closed { stroke.points.first() } else { None };
    stroke.points.iter().chain(again).map(|p| p.pixel.as_dvec2()).collect()
}

/// How well what is drawn agrees with what should be seen.
pub fn score(truth: &Truth, drawn: &[DVec2]) -> Score {
    let share = |of: &[DVec2], near: &Cells, within: f64| {
        let count = of.iter().filter(|p| near.is_near(**p, within)).count();
        count as f64 / of.len().max(1) as f64
    };
    let [seen, there] = [&truth.seen[..], drawn].map(|p| Cells::new(p.iter().copied()));
    let (recall, precision) = (share(&truth.seen, &there, NEAR), share(drawn, &seen, NEAR));
    // What is hidden and apart from all that is seen.
    let apart: Vec<DVec2> = truth.hidden.iter().copied().filter(|p| !seen.is_near(*p, 2.0 * NEAR)).collect();
    Score {
        recall,
        precision,
        f1: 2.0 * recall * precision / (recall + precision).max(1e-9),
        shown: (apart.len() >= FEWEST).then(|| share(&apart, &there, NEAR)),
    }
}
