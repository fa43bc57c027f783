//! Closed solids out of which the parts are built: prisms, swept beams, tubes, shells, needles.
//!
//! Every solid is a closed surface with its triangles counter-clockwise from outside. (u, v) is laid in metres over a
//! [`Grain`]: u runs along the length of a timber, as the grain of its wood does.

use glam::{Vec2, Vec3};
use std::collections::HashMap;
use yugen_scene::Mesh;

/// How a texture lies on a solid.
#[derive(Clone, Copy, Debug)]
pub struct Grain {
    /// Metres that one tile of the texture covers, along and across.
    pub tile: Vec2,
    /// Of the first corner, in tiles.
    pub offset: Vec2,
}

impl Grain {
    /// A tile of so many metres, begun at an offset of its own for every `piece`, so that no two timbers look the same.
    pub fn piece(tile: Vec2, piece: u32) -> Self {
        let unit = |i: u32| yugen_optics::random::unit_f32(yugen_optics::random::hash_combine(piece, i));
        Self { tile, offset: Vec2::new(unit(1), unit(2)) }
    }

    /// A place on the solid as (u, v).
    pub fn at(&self, metres: Vec2) -> Vec2 {
        metres / self.tile + self.offset
    }
}

/// Axes of a solid: a place and three unit vectors, right-handed; z is the long one.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    /// Where it begins.
    pub at: Vec3,
    /// Across.
    pub x: Vec3,
    /// Across, usually up.
    pub y: Vec3,
    /// Along.
    pub z: Vec3,
}

impl Axes {
    /// Along from one place to another, y as near to `up` as may be; and how far.
    pub fn between(from: Vec3, to: Vec3, up: Vec3) -> (Self, f32) {
        let length = from.distance(to);
        let z = (to - from) / length.max(1e-9);
        let x = up.cross(z).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
        (Self { at: from, x, y: z.cross(x), z }, length)
    }

    fn point(&self, p: Vec2, along: f32) -> Vec3 {
        self.at + self.x * p.x + self.y * p.y + self.z * along
    }
}

/// A rectangle about the origin, its corners cut at 45 degrees by `chamfer` (0: not).
pub fn rectangle(width: f32, height: f32, chamfer: f32) -> Vec<Vec2> {
    let (x, y, c) = (0.5 * width, 0.5 * height, chamfer);
    if c <= 0.0 {
        return vec![Vec2::new(-x, -y), Vec2::new(x, -y), Vec2::new(x, y), Vec2::new(-x, y)];
    }
    vec![
        Vec2::new(-x + c, -y),
        Vec2::new(x - c, -y),
        Vec2::new(x, -y + c),
        Vec2::new(x, y - c),
        Vec2::new(x - c, y),
        Vec2::new(-x + c, y),
        Vec2::new(-x, y - c),
        Vec2::new(-x, -y + c),
    ]
}

/// A regular polygon.
pub fn circle(radius: f32, sides: usize) -> Vec<Vec2> {
    let angle = |i: usize| std::f32::consts::TAU * i as f32 / sides as f32;
    (0..sides).map(|i| radius * Vec2::from_angle(angle(i))).collect()
}

/// A grid of points, rows of the same length.
pub type Grid = Vec<Vec<Vec3>>;

/// Collects solids into one mesh.
#[derive(Clone, Debug, Default)]
pub struct Solids {
    mesh: Mesh,
}

impl Solids {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The mesh, equal vertices shared.
    pub fn mesh(self, name: &str) -> Mesh {
        let mut known: HashMap<[u32; 8], u32> = HashMap::new();
        let mut out = Mesh { name: name.into(), ..Mesh::default() };
        let old = self.mesh;
        let mut index = |i: u32| {
            let i = i as usize;
            // Adding zero makes −0 and 0 the same.
            let (p, n, t) = (old.positions[i] + 0.0, old.normals[i] + 0.0, old.uvs[i] + 0.0);
            let key = [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y].map(f32::to_bits);
            *known.entry(key).or_insert_with(|| {
                out.positions.push(p);
                out.normals.push(n);
                out.uvs.push(t);
                out.positions.len() as u32 - 1
            })
        };
        let triangles = old.triangles.iter().map(|t| t.map(&mut index)).collect();
        out.triangles = triangles;
        out
    }

    /// The largest y of all points.
    pub fn top(&self) -> f32 {
        self.mesh.positions.iter().fold(f32::MIN, |m, p| m.max(p.y))
    }

    /// Heights over `base` times `factor`.
    pub fn stretch(&mut self, base: f32, factor: f32) {
        self.mesh.positions.iter_mut().for_each(|p| p.y = base + (p.y - base) * factor);
    }

    fn triangle(&mut self, p: [Vec3; 3], n: [Vec3; 3], uv: [Vec2; 3]) {
        // A grid may shrink to a point at its end.
        if p[0] == p[1] || p[1] == p[2] || p[2] == p[0] {
            return;
        }
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(p);
        self.mesh.normals.extend(n);
        self.mesh.uvs.extend(uv);
        self.mesh.triangles.push([first, first + 1, first + 2]);
    }

    /// A flat convex polygon, counter-clockwise from outside.
    fn polygon(&mut self, points: &[Vec3], uvs: &[Vec2]) {
        let mut normal = Vec3::ZERO;
        for i in 2..points.len() {
            normal += (points[i - 1] - points[0]).cross(points[i] - points[0]);
        }
        let n = [normal.normalize_or(Vec3::Y); 3];
        for i in 2..points.len() {
            self.triangle([points[0], points[i - 1], points[i]], n, [uvs[0], uvs[i - 1], uvs[i]]);
        }
    }

    /// A grid of points as a surface seen from the side where rows run down and columns to the right. `smooth`: with
    /// normals of its own at every point, else flat quadrangles. `joined`: the last row, the last column is the first.
    fn surface(&mut self, grid: &Grid, uvs: &dyn Fn(usize, usize) -> Vec2, smooth: bool, joined: [bool; 2]) {
        let (rows, columns) = (grid.len(), grid[0].len());
        let quad = |i: usize, j: usize| [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        let mut normals = vec![vec![Vec3::ZERO; columns]; rows];
        if smooth {
            for i in 0..rows - 1 {
                for j in 0..columns - 1 {
                    let corners = quad(i, j);
                    let [a, b, c, d] = corners.map(|(i, j)| grid[i][j]);
                    let n = (c - a).cross(d - b);
                    for (i, j) in corners {
                        normals[i][j] += n;
                    }
                }
            }
            if joined[0] {
                let both: Vec<Vec3> =
                    normals[0].iter().zip(&normals[rows - 1]).map(|(a, b)| *a + *b).collect();
                normals[0].clone_from(&both);
                normals[rows - 1] = both;
            }
            if joined[1] {
                for row in &mut normals {
                    let both = row[0] + row[columns - 1];
                    (row[0], row[columns - 1]) = (both, both);
                }
            }
        }
        for i in 0..rows - 1 {
            for j in 0..columns - 1 {
                let corners = quad(i, j);
                let p = corners.map(|(i, j)| grid[i][j]);
                let uv = corners.map(|(i, j)| uvs(i, j));
                let flat = (p[2] - p[0]).cross(p[3] - p[1]).normalize_or(Vec3::Y);
                let n = corners.map(|(i, j)| if smooth { normals[i][j].normalize_or(flat) } else { flat });
                self.triangle([p[0], p[1], p[2]], [n[0], n[1], n[2]], [uv[0], uv[1], uv[2]]);
                self.triangle([p[0], p[2], p[3]], [n[0], n[2], n[3]], [uv[0], uv[2], uv[3]]);
            }
        }
    }

    /// A convex profile, counter-clockwise seen against the axis, drawn out along it.
    pub fn prism(&mut self, profile: &[Vec2], axes: Axes, length: f32, grain: Grain) {
        let ring = |along: f32| profile.iter().map(|p| axes.point(*p, along)).collect::<Vec<_>>();
        let (near, far) = (ring(0.0), ring(length));
        let mut around = 0.0;
        for i in 0..profile.len() {
            let j = (i + 1) % profile.len();
            let next = around + profile[i].distance(profile[j]);
            let uv = |u, v| grain.at(Vec2::new(u, v));
            self.polygon(
                &[near[i], near[j], far[j], far[i]],
                &[uv(0.0, around), uv(0.0, next), uv(length, next), uv(length, around)],
            );
            around = next;
        }
        let flat: Vec<Vec2> = profile.iter().map(|p| grain.at(*p)).collect();
        self.polygon(&far, &flat);
        let (near, flat): (Vec<_>, Vec<_>) = near.into_iter().zip(flat).rev().unzip();
        self.polygon(&near, &flat);
    }

    /// A straight timber of a rectangular section between two places on its axis.
    pub fn beam(&mut self, from: Vec3, to: Vec3, up: Vec3, size: Vec2, chamfer: f32, grain: Grain) {
        let (axes, length) = Axes::between(from, to, up);
        self.prism(&rectangle(size.x, size.y, chamfer), axes, length, grain);
    }

    /// An axis-parallel box; u runs along `along` (0, 1, 2 for x, y, z).
    pub fn block(&mut self, low: Vec3, high: Vec3, along: usize, grain: Grain) {
        let (middle, size) = (0.5 * (low + high), high - low);
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        let (x, y, z) = ([1, 2, 0][along], [2, 0, 1][along], along);
        let at = middle - 0.5 * size[z] * axes[z];
        let frame = Axes { at, x: axes[x], y: axes[y], z: axes[z] };
        self.prism(&rectangle(size[x], size[y], 0.0), frame, size[z], grain);
    }

    /// A plan, counter-clockwise seen from above, with the height of its top at every corner, `thickness` deep. u runs
    /// along `along`, a direction in the plan, measured from `from`.
    pub fn plank(&mut self, plan: &[Vec3], thickness: f32, along: Vec3, from: Vec3, grain: Grain) {
        let across = along.cross(Vec3::Y);
        let uv = |p: Vec3| grain.at(Vec2::new((p - from).dot(along), (p - from).dot(across)));
        let low: Vec<Vec3> = plan.iter().map(|p| *p - Vec3::Y * thickness).collect();
        let flat: Vec<Vec2> = plan.iter().map(|p| uv(*p)).collect();
        self.polygon(plan, &flat);
        let (under, flat): (Vec<_>, Vec<_>) = low.iter().copied().zip(flat).rev().unzip();
        self.polygon(&under, &flat);
        for i in 0..plan.len() {
            let j = (i + 1) % plan.len();
            let side = (plan[j] - plan[i]).normalize_or(Vec3::X);
            let run = |p: Vec3, down: f32| {
                let t = (p - from).dot(side);
                grain.at(if side.dot(along).abs() > 0.5 { Vec2::new(t, down) } else { Vec2::new(down, t) })
            };
            self.polygon(
                &[low[i], low[j], plan[j], plan[i]],
                &[run(plan[i], thickness), run(plan[j], thickness), run(plan[j], 0.0), run(plan[i], 0.0)],
            );
        }
    }

    /// A rectangular section swept along a path in a plane: `up` lies in it, `side` is its normal.
    pub fn sweep(&mut self, path: &[Vec3], side: Vec3, size: Vec2, grain: Grain) {
        let up = |i: usize| {
            let (a, b) = (path[i.saturating_sub(1)], path[(i + 1).min(path.len() - 1)]);
            (b - a).cross(side).normalize_or(Vec3::Y)
        };
        let edge = |s: f32, u: f32| -> Vec<Vec3> {
            (0..path.len())
                .map(|i| path[i] + side * (0.5 * s * size.x) + up(i) * (0.5 * u * size.y))
                .collect()
        };
        let lines = [edge(-1.0, -1.0), edge(1.0, -1.0), edge(1.0, 1.0), edge(-1.0, 1.0)];
        self.bundle(&lines, grain);
    }

    /// A solid between four lines of as many points: its edges, counter-clockwise seen against their direction.
    pub fn bundle(&mut self, lines: &[Vec<Vec3>; 4], grain: Grain) {
        let along = lengths(&lines[0]);
        let mut around = 0.0;
        for k in 0..4 {
            let (a, b) = (&lines[k], &lines[(k + 1) % 4]);
            let width = a[0].distance(b[0]);
            let grid: Grid = vec![a.clone(), b.clone()];
            let v = [around, around + width];
            self.surface(&grid, &|i, j| grain.at(Vec2::new(along[j], v[i])), false, [false; 2]);
            around += width;
        }
        let end = |i: usize| [0, 1, 2, 3].map(|k| lines[k][i]);
        let last = lines[0].len() - 1;
        let flat = |p: [Vec3; 4]| {
            let (w, h) = (p[0].distance(p[1]), p[1].distance(p[2]));
            [Vec2::ZERO, Vec2::new(w, 0.0), Vec2::new(w, h), Vec2::new(0.0, h)].map(|v| grain.at(v))
        };
        let (near, far) = (end(0), end(last));
        self.polygon(&far, &flat(far));
        let near = [near[3], near[2], near[1], near[0]];
        self.polygon(&near, &flat(near));
    }

    /// A round bar along a path, its radius at every point; ends flat.
    pub fn tube(&mut self, path: &[Vec3], radii: &[f32], sides: usize, grain: Grain) {
        let n = path.len();
        let mut x = Vec3::ZERO;
        let mut rings: Vec<Vec<Vec3>> = Vec::with_capacity(n);
        for i in 0..n {
            let z = (path[(i + 1).min(n - 1)] - path[i.saturating_sub(1)]).normalize_or(Vec3::Y);
            // Carried from ring to ring, so that the bar does not twist.
            x = (x - z * x.dot(z)).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
            let axes = Axes { at: path[i], x, y: z.cross(x), z };
            rings.push(circle(radii[i], sides).into_iter().map(|p| axes.point(p, 0.0)).collect());
        }
        let along = lengths(path);
        let grid: Grid = (0..=sides).map(|k| rings.iter().map(|r| r[k % sides]).collect()).collect();
        let girth = std::f32::consts::TAU * radii[0];
        let uv = |k: usize, j: usize| grain.at(Vec2::new(along[j], girth * k as f32 / sides as f32));
        self.surface(&grid, &uv, true, [true, false]);
        let flat: Vec<Vec2> = circle(radii[0], sides).into_iter().map(|p| grain.at(p)).collect();
        self.polygon(&rings[n - 1], &flat);
        let (first, flat): (Vec<_>, Vec<_>) = rings[0].iter().copied().zip(flat).rev().unzip();
        self.polygon(&first, &flat);
    }

    /// A ring-shaped bar: a closed path, all of one radius.
    pub fn ring(&mut self, centre: Vec3, radius: f32, thickness: f32, segments: usize, grain: Grain) {
        let sides = 8;
        let point = |i: usize, k: usize| {
            let (out, turn) = (circle(1.0, segments)[i % segments], circle(thickness, sides)[k % sides]);
            centre + Vec3::new(out.x, 0.0, out.y) * (radius + turn.x) + Vec3::Y * turn.y
        };
        let grid: Grid = (0..=sides).map(|k| (0..=segments).map(|i| point(i, k)).collect()).collect();
        let scale = Vec2::new(radius / segments as f32, thickness / sides as f32) * std::f32::consts::TAU;
        self.surface(&grid, &|k, i| grain.at(Vec2::new(i as f32, k as f32) * scale), true, [true; 2]);
    }

    /// A closed shell: a surface seen from its outside, with rows down and columns to the right, and the surface behind
    /// it. The rim is flat; its (u, v) runs along the rim and over the thickness, in metres.
    pub fn shell(&mut self, outside: &Grid, inside: &Grid, smooth: bool, grain: Grain) {
        let (rows, columns) = (outside.len(), outside[0].len());
        let down = lengths(&outside.iter().map(|r| r[columns / 2]).collect::<Vec<_>>());
        let right = lengths(&outside[rows - 1]);
        self.sheet(outside, inside, &|i, j| grain.at(Vec2::new(right[j], down[i])), smooth, grain);
    }

    /// A [`Solids::shell`] whose points have a (u, v) of their own, the same on both sides; the grain is of the rim.
    pub fn sheet(
        &mut self,
        outside: &Grid,
        inside: &Grid,
        uv: &dyn Fn(usize, usize) -> Vec2,
        smooth: bool,
        grain: Grain,
    ) {
        let (rows, columns) = (outside.len(), outside[0].len());
        self.surface(outside, uv, smooth, [false; 2]);
        let mirrored: Grid = inside.iter().map(|r| r.iter().rev().copied().collect()).collect();
        self.surface(&mirrored, &|i, j| uv(i, columns - 1 - j), smooth, [false; 2]);
        // Once around the rim, counter-clockwise from outside.
        let mut rim: Vec<(usize, usize)> = (0..rows).map(|i| (i, 0)).collect();
        rim.extend((1..columns).map(|j| (rows - 1, j)));
        rim.extend((0..rows - 1).rev().map(|i| (i, columns - 1)));
        rim.extend((0..columns - 1).rev().map(|j| (0, j)));
        let at = |g: &Grid, (i, j): (usize, usize)| g[i][j];
        let mut run = 0.0;
        for pair in rim.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let p = [at(outside, a), at(inside, a), at(inside, b), at(outside, b)];
            let next = run + p[0].distance(p[3]);
            let depth = p[0].distance(p[1]);
            let uv = [[run, 0.0], [run, depth], [next, depth], [next, 0.0]].map(|v| grain.at(v.into()));
            let n = (p[2] - p[0]).cross(p[3] - p[1]).normalize_or(Vec3::Y);
            self.triangle([p[0], p[1], p[2]], [n; 3], [uv[0], uv[1], uv[2]]);
            self.triangle([p[0], p[2], p[3]], [n; 3], [uv[0], uv[2], uv[3]]);
            run = next;
        }
    }

    /// A flat board between two lines of as many points, as thick as `depth` (which points away from the viewer): the
    /// board of a gable, a pendant, a strut.
    pub fn board(&mut self, upper: &[Vec3], lower: &[Vec3], depth: Vec3, grain: Grain) {
        let front: Grid = vec![upper.to_vec(), lower.to_vec()];
        let back: Grid = front.iter().map(|r| r.iter().map(|p| *p + depth).collect()).collect();
        self.shell(&front, &back, false, grain);
    }

    /// A needle: a thin pyramid of three sides, its four corners shared and its shading round.
    pub fn needle(&mut self, foot: Vec3, tip: Vec3, width: f32) {
        let (axes, length) = Axes::between(foot, tip, Vec3::Y);
        let first = self.mesh.positions.len() as u32;
        for (i, p) in circle(0.5 * width, 3).into_iter().enumerate() {
            let corner = axes.point(p, 0.0);
            self.mesh.positions.push(corner);
            // A little to the rear, so that it looks to the side of the foot as well.
            self.mesh.normals.push(((corner - foot).normalize_or(axes.x) - 0.3 * axes.z).normalize());
            self.mesh.uvs.push(Vec2::new(0.0, 0.02 * i as f32));
        }
        self.mesh.positions.push(tip);
        self.mesh.normals.push(axes.z);
        self.mesh.uvs.push(Vec2::new(10.0 * length, 0.02));
        for t in [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]] {
            self.mesh.triangles.push(t.map(|i: u32| i + first));
        }
    }
}

/// How far along a line each of its points lies.
fn lengths(line: &[Vec3]) -> Vec<f32> {
    let mut sum = 0.0;
    let mut out = vec![0.0];
    for pair in line.windows(2) {
        sum += pair[0].distance(pair[1]);
        out.push(sum);
    }
    out
}

/// Why a mesh is no closed solid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Leak {
    /// An edge that not exactly two triangles use, once in each direction.
    #[error("the edge between {0} and {1} is used {2} times forwards and {3} times backwards")]
    Edge(String, String, usize, usize),
    /// A triangle without area.
    #[error("triangle {0} has no area")]
    Flat(usize),
    /// Turned inside out.
    #[error("the volume is not positive")]
    Inverted,
}

/// Whether a mesh is the closed surface of solids: every edge has one triangle on each side, no triangle is without area,
/// and the volume is positive. Vertices at the same place are one.
pub fn check_closed(mesh: &Mesh) -> Result<(), Leak> {
    let key = |i: u32| (mesh.positions[i as usize] + 0.0).to_array().map(f32::to_bits);
    let mut edges: HashMap<[[u32; 3]; 2], [usize; 2]> = HashMap::new();
    let mut volume = 0.0f64;
    for (k, t) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
        if (b - a).cross(c - a).length() < 1e-12 {
            return Err(Leak::Flat(k));
        }
        volume += a.dot(b.cross(c)) / 6.0;
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (key(t[i]), key(t[j]));
            let (pair, way) = if a < b { ([a, b], 0) } else { ([b, a], 1) };
            edges.entry(pair).or_default()[way] += 1;
        }
    }
    if let Some((pair, [f, b])) = edges.iter().find(|(_, ways)| **ways != [1, 1]) {
        let place = |p: [u32; 3]| Vec3::from_array(p.map(f32::from_bits)).to_string();
        return Err(Leak::Edge(place(pair[0]), place(pair[1]), *f, *b));
    }
    if volume <= 0.0 || mesh.triangles.is_empty() {
        return Err(Leak::Inverted);
    }
    Ok(())
}
