//! Geometry made from a few numbers: balls, grids, blocks, and cloth that has fallen over something.

use super::Mesh;
use glam::{IVec3, Vec2, Vec3, Vec4};
use std::f32::consts::{PI, TAU};
use yugen_optics::random::Pcg32;

/// The unit sphere as triangles, with the parametrisation of [`super::Geometry::Sphere`]: u along azimuth,
/// v along the polar angle from +z, tangents along growing azimuth. `segments` around the equator, at least 3.
pub fn ball(segments: u32) -> Mesh {
    let (nu, nv) = (segments.max(3), (segments / 2).max(2));
    let mut mesh = lattice("ball", nu, nv, |u, v| {
        let ((sp, cp), (st, ct)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
        // A pole is one point, though π is not a float.
        let st = if v == 0.0 || v == 1.0 { 0.0 } else { st };
        let n = Vec3::new(st * cp, st * sp, ct);
        (n, n, Vec3::new(-sp, cp, 0.0))
    });
    // The quads at the poles are triangles.
    mesh.triangles.retain(|t| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).length_squared() > 0.0
    });
    mesh
}

/// A flat grid in z = 0, normal +z, `width` along x (u) and `height` along y, of `segments` squares each way.
pub fn grid(width: f32, height: f32, segments: [u32; 2]) -> Mesh {
    lattice("grid", segments[0].max(1), segments[1].max(1), |u, v| {
        (Vec3::new((u - 0.5) * width, (0.5 - v) * height, 0.0), Vec3::Z, Vec3::X)
    })
}

/// An axis-parallel box of full edge lengths `size` about the origin; every face has its own (u, v).
pub fn block(size: Vec3) -> Mesh {
    let mut mesh = Mesh { name: "block".into(), ..Mesh::default() };
    for axis in 0..3 {
        for side in [-1.0, 1.0f32] {
            let n = Vec3::AXES[axis] * side;
            // Sides stand upright about y; the lid and the bottom lie with their u along x.
            let t = if axis == 1 { Vec3::X } else { Vec3::Y.cross(n) };
            let b = n.cross(t);
            let first = mesh.positions.len() as u32;
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0f32)] {
                let p = n + t * (2.0 * u - 1.0) + b * (1.0 - 2.0 * v);
                mesh.positions.push(0.5 * size * p);
                mesh.normals.push(n);
                mesh.uvs.push(Vec2::new(u, v));
                mesh.tangents.push(t.extend(1.0));
            }
            mesh.triangles.extend([[0, 2, 1], [0, 3, 2]].map(|t| t.map(|i: u32| i + first)));
        }
    }
    mesh
}

/// A lattice of (nu + 1) x (nv + 1) vertices from a map (u, v) to position, normal and tangent, where the
/// normal is ∂p/∂v x ∂p/∂u (v runs down).
fn lattice(name: &str, nu: u32, nv: u32, at: impl Fn(f32, f32) -> (Vec3, Vec3, Vec3)) -> Mesh {
    let mut mesh = Mesh { name: name.into(), triangles: lattice_triangles(nu, nv), ..Mesh::default() };
    for j in 0..=nv {
        for i in 0..=nu {
            let (u, v) = (i as f32 / nu as f32, j as f32 / nv as f32);
            let (p, n, t) = at(u, v);
            mesh.positions.push(p);
            mesh.normals.push(n);
            mesh.uvs.push(Vec2::new(u, v));
            mesh.tangents.push(t.extend(1.0));
        }
    }
    mesh
}

fn lattice_triangles(nu: u32, nv: u32) -> Vec<[u32; 3]> {
    let quad = |i: u32, j: u32| {
        let a = j * (nu + 1) + i;
        let (b, c, d) = (a + 1, a + nu + 1, a + nu + 2);
        // Diagonals alternate, so that no direction of the cloth folds more easily than the other.
        if (i + j).is_multiple_of(2) { [[a, c, d], [a, d, b]] } else { [[a, c, b], [b, c, d]] }
    };
    (0..nv).flat_map(|j| (0..nu).flat_map(move |i| quad(i, j))).collect()
}

/// What a cloth falls on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support {
    /// A ball.
    Ball {
        /// Its middle.
        centre: Vec3,
        /// Its radius.
        radius: f32,
    },
    /// An axis-parallel box.
    Block {
        /// Its middle.
        centre: Vec3,
        /// Its full edge lengths.
        size: Vec3,
    },
    /// A round stand: an upright cylinder that ends at `top` and goes down without end.
    Stand {
        /// The middle of its top.
        top: Vec3,
        /// Its radius.
        radius: f32,
    },
}

impl Support {
    /// Signed distance of `p` from the surface and the direction away from it.
    fn distance(&self, p: Vec3) -> (f32, Vec3) {
        match *self {
            Self::Ball { centre, radius } => {
                let d = p - centre;
                (d.length() - radius, d.normalize_or(Vec3::Y))
            }
            Self::Block { centre, size } => {
                let d = p - centre;
                let q = d.abs() - 0.5 * size;
                let outside = q.max(Vec3::ZERO);
                if outside != Vec3::ZERO {
                    return (outside.length(), (outside * d.signum()).normalize());
                }
                let axis = (0..3).max_by(|&a, &b| q[a].total_cmp(&q[b])).unwrap_or(1);
                (q[axis], Vec3::AXES[axis] * d.signum()[axis])
            }
            Self::Stand { top, radius } => {
                let d = p - top;
                let flat = Vec3::new(d.x, 0.0, d.z);
                let (side, out) = (flat.length() - radius, flat.normalize_or(Vec3::X));
                match (side > 0.0, d.y > 0.0) {
                    (true, true) => {
                        let v = out * side + Vec3::Y * d.y;
                        (v.length(), v.normalize())
                    }
                    (false, _) if d.y > side => (d.y, Vec3::Y),
                    _ => (side, out),
                }
            }
        }
    }

    /// Where its highest point is.
    fn top(&self) -> Vec3 {
        match *self {
            Self::Ball { centre, radius } => centre + Vec3::Y * radius,
            Self::Block { centre, size } => centre + Vec3::Y * (0.5 * size.y),
            Self::Stand { top, .. } => top,
        }
    }
}

/// A square of cloth that falls, +y being up, until it hangs. Lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drape {
    /// Edge of the square.
    pub size: f32,
    /// Squares of the mesh along an edge.
    pub segments: u32,
    /// What it falls on; the middle of the cloth comes down on its highest point.
    pub over: Support,
    /// The floor's height.
    pub floor: f32,
    /// By how much the cloth is turned about +y before it falls; radians.
    pub turn: f32,
    /// Mass per area, kg/m². Silk 0.06, wool 0.25, brocade 0.4.
    pub weight: f32,
    /// Resistance to bending (flexural rigidity), N·m. Silk 3e-6, wool 1e-5, brocade 1e-4.
    pub bending: f32,
    /// Resistance of the angle between warp and weft, N/m.
    pub shear: f32,
    /// Coulomb friction against support and floor.
    pub friction: f32,
    /// How long it falls, seconds.
    pub seconds: f32,
    /// Which of the many ways to fold: the tiny unevenness that it starts with.
    pub seed: u64,
}

impl Default for Drape {
    fn default() -> Self {
        Self {
            size: 1.6,
            segments: 80,
            over: Support::Ball { centre: Vec3::new(0.0, 0.8, 0.0), radius: 0.35 },
            floor: 0.0,
            turn: 0.0,
            weight: 0.15,
            bending: 1e-5,
            shear: 20.0,
            friction: 0.3,
            seconds: 2.5,
            seed: 1,
        }
    }
}

/// Cloth in its final folds: u along the warp (x before it is turned), v along the weft, tangents along the
/// warp. Extended position-based dynamics in small steps (Macklin, Müller and Chentanez 2016; Macklin et al.
/// 2019) with rigid threads, elastic shear and bending; the same numbers on every run. Layers of cloth keep
/// about one square of the mesh apart.
pub fn drape(cloth: &Drape) -> Mesh {
    let n = cloth.segments.max(2) as usize;
    let side = n + 1;
    let spacing = cloth.size / n as f32;
    // A thread between two vertices cuts corners: keep the vertices that far away, and a thickness at least.
    let thickness = (0.35 * spacing).max(2e-3 * cloth.size);
    let start = cloth.over.top() + Vec3::Y * (1.5 * thickness);
    let mut rng = Pcg32::new(cloth.seed, 0);
    let (sin, cos) = cloth.turn.sin_cos();
    let mut x: Vec<Vec3> = (0..side * side)
        .map(|k| {
            let (a, b) = (
                (k % side) as f32 * spacing - 0.5 * cloth.size,
                (k / side) as f32 * spacing - 0.5 * cloth.size,
            );
            let bump = (rng.next_f32() - 0.5) * 0.2 * thickness;
            start + Vec3::new(cos * a + sin * b, bump, cos * b - sin * a)
        })
        .collect();
    let mut velocity = vec![Vec3::ZERO; x.len()];

    // One correction per thread and step reaches the weight of all threads below it only in time, and what
    // is missing shows as stretch of about segments · g · step². This step keeps it under two per cent.
    let step = (0.01 * spacing / (9.81 * n as f32)).sqrt().min(1.0 / 600.0);
    let steps = (cloth.seconds / step).ceil() as usize;
    let inverse_mass = 1.0 / (cloth.weight * spacing * spacing);
    let shear = 1.0 / (cloth.shear * step * step);
    let bend = spacing * spacing / (cloth.bending * step * step);
    // Air and inner friction: what moves calms down within half a second.
    let calm = (-2.0 * step).exp();

    let mut last = x.clone();
    let mut layers = Layers::new(x.len(), side, spacing);
    for count in 0..steps {
        for ((p, v), l) in x.iter_mut().zip(&velocity).zip(&mut last) {
            *l = *p;
            *p += (*v + Vec3::NEG_Y * 9.81 * step) * calm * step;
        }
        // Neighbours in these loops share no vertex, so that the processor need not wait for one to begin
        // with the next: four times as fast as vertex by vertex.
        let diagonal = spacing * std::f32::consts::SQRT_2;
        for j in 0..side {
            let row = j * side;
            for first in 0..2 {
                for i in (first..n).step_by(2) {
                    thread(&mut x, row + i, row + i + 1, spacing);
                }
            }
            for first in 0..3 {
                for i in (first..n.saturating_sub(1)).step_by(3) {
                    flatten(&mut x, [row + i, row + i + 1, row + i + 2], inverse_mass, bend);
                }
            }
        }
        for j in 0..n {
            let row = j * side;
            for k in row..row + side {
                thread(&mut x, k, k + side, spacing);
            }
            for k in row..row + n {
                spring(&mut x, k, k + side + 1, diagonal, inverse_mass, shear);
            }
            for k in row..row + n {
                spring(&mut x, k + 1, k + side, diagonal, inverse_mass, shear);
            }
            if j + 1 < n {
                for k in row..row + side {
                    flatten(&mut x, [k, k + side, k + 2 * side], inverse_mass, bend);
                }
            }
        }
        // So many steps take a hundredth of a second: little for folds that close slowly.
        if count % 16 == 0 {
            layers.separate(&mut x);
        }
        for (p, l) in x.iter_mut().zip(&last) {
            let (d, away) = cloth.over.distance(*p);
            rest_on(p, *l, thickness - d, away, cloth.friction);
            rest_on(p, *l, cloth.floor + thickness - p.y, Vec3::Y, cloth.friction);
        }
        for ((v, p), l) in velocity.iter_mut().zip(&x).zip(&last) {
            *v = (*p - *l) / step;
        }
    }
    cloth_mesh(x, n)
}

/// Threads do not stretch.
#[inline]
fn thread(x: &mut [Vec3], a: usize, b: usize, rest: f32) {
    let d = x[b] - x[a];
    let length = d.length().max(1e-9);
    let move_each = d * (0.5 * (length - rest) / length);
    x[a] += move_each;
    x[b] -= move_each;
}

#[inline]
fn spring(x: &mut [Vec3], a: usize, b: usize, rest: f32, inverse_mass: f32, compliance: f32) {
    let d = x[b] - x[a];
    let length = d.length().max(1e-9);
    let move_each = d * (inverse_mass * (length - rest) / (length * (2.0 * inverse_mass + compliance)));
    x[a] += move_each;
    x[b] -= move_each;
}

/// Bending: three vertices in a row want to be straight. Energy ½ B κ² per area with κ = |second difference|/h².
#[inline]
fn flatten(x: &mut [Vec3], [a, b, c]: [usize; 3], inverse_mass: f32, compliance: f32) {
    let bent = x[a] - 2.0 * x[b] + x[c];
    let correction = bent * (inverse_mass / (6.0 * inverse_mass + compliance));
    x[a] -= correction;
    x[b] += 2.0 * correction;
    x[c] -= correction;
}

/// Pushes a vertex out by `depth` and holds it back along the surface (Coulomb).
#[inline]
fn rest_on(p: &mut Vec3, last: Vec3, depth: f32, away: Vec3, friction: f32) {
    if depth <= 0.0 {
        return;
    }
    *p += away * depth;
    let moved = *p - last;
    let along = moved - away * moved.dot(away);
    let length = along.length();
    if length > 0.0 {
        *p -= along * (friction * depth / length).min(1.0);
    }
}

/// Finds vertices that come near each other though they are no neighbours: a hashed grid of cells, as wide
/// as the distance to keep (Teschner et al. 2003).
struct Layers {
    side: usize,
    apart: f32,
    /// Where the vertices of each bucket begin in `sorted`.
    starts: Vec<u32>,
    sorted: Vec<u32>,
    buckets: Vec<u32>,
}

impl Layers {
    fn new(vertices: usize, side: usize, spacing: f32) -> Self {
        let table = (2 * vertices).next_power_of_two();
        Self {
            side,
            apart: 0.9 * spacing,
            starts: vec![0; table + 1],
            sorted: vec![0; vertices],
            buckets: vec![0; vertices],
        }
    }

    fn cell(&self, p: Vec3) -> IVec3 {
        (p / self.apart).floor().as_ivec3()
    }

    fn bucket(&self, cell: IVec3) -> usize {
        let [x, y, z] = cell.to_array().map(|c| c as u32);
        let hash = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
        hash as usize & (self.starts.len() - 2)
    }

    /// Pushes every such pair apart, half each.
    fn separate(&mut self, x: &mut [Vec3]) {
        // Counting sort by bucket.
        self.starts.fill(0);
        for (k, &p) in x.iter().enumerate() {
            let b = self.bucket(self.cell(p));
            self.buckets[k] = b as u32;
            self.starts[b] += 1;
        }
        let mut end = 0;
        for s in &mut self.starts {
            end += *s;
            *s = end;
        }
        for (k, &b) in self.buckets.iter().enumerate().rev() {
            let at = &mut self.starts[b as usize];
            *at -= 1;
            self.sorted[*at as usize] = k as u32;
        }
        for a in 0..x.len() {
            let cell = self.cell(x[a]);
            // The cell itself and half of its neighbours: the other half finds this one.
            for near in 13..27 {
                let offset = IVec3::new(near % 3 - 1, near / 3 % 3 - 1, near / 9 - 1);
                let b = self.bucket(cell + offset);
                for &k in &self.sorted[self.starts[b] as usize..self.starts[b + 1] as usize] {
                    if near > 13 || k as usize > a {
                        self.push_apart(x, a, k as usize);
                    }
                }
            }
        }
    }

    #[inline]
    fn push_apart(&self, x: &mut [Vec3], a: usize, b: usize) {
        let d = x[b] - x[a];
        let squared = d.length_squared();
        if squared >= self.apart * self.apart || squared == 0.0 {
            return;
        }
        // What hangs together lies near each other by right.
        let lattice = |k: usize| ((k % self.side) as i32, (k / self.side) as i32);
        let ((ai, aj), (bi, bj)) = (lattice(a), lattice(b));
        if (ai - bi).abs().max((aj - bj).abs()) <= 1 {
            return;
        }
        let length = squared.sqrt();
        let move_each = d * (0.5 * (self.apart - length) / length);
        x[a] -= move_each;
        x[b] += move_each;
    }
}

fn cloth_mesh(x: Vec<Vec3>, n: usize) -> Mesh {
    let side = n + 1;
    let difference = |k: usize, at: usize, stride: usize| {
        let (low, high) = (if at > 0 { k - stride } else { k }, if at < n { k + stride } else { k });
        x[high] - x[low]
    };
    let mut mesh =
        Mesh { name: "drape".into(), triangles: lattice_triangles(n as u32, n as u32), ..Mesh::default() };
    for k in 0..x.len() {
        let (i, j) = (k % side, k / side);
        let (warp, weft) = (difference(k, i, 1), difference(k, j, side));
        let normal = weft.cross(warp).normalize_or(Vec3::Y);
        let tangent = (warp - normal * warp.dot(normal)).normalize_or(normal.any_orthonormal_vector());
        mesh.normals.push(normal);
        mesh.tangents.push(Vec4::from((tangent, 1.0)));
        mesh.uvs.push(Vec2::new(i as f32, j as f32) / n as f32);
    }
    mesh.positions = x;
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_frames(mesh: &Mesh) {
        assert_eq!(mesh.positions.len(), mesh.normals.len());
        for (n, t) in mesh.normals.iter().zip(&mesh.tangents) {
            assert!((n.length() - 1.0).abs() < 1e-4 && n.dot(t.truncate()).abs() < 1e-4);
        }
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| i as usize);
            let face = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
            let mean = mesh.normals[a] + mesh.normals[b] + mesh.normals[c];
            assert!(face.dot(mean) > 0.0, "{} winds the wrong way", mesh.name);
        }
    }

    #[test]
    fn tangents_point_along_u_and_bitangents_up_the_picture() {
        for mesh in [ball(24), grid(2.0, 3.0, [4, 5]), block(Vec3::new(1.0, 2.0, 3.0))] {
            check_frames(&mesh);
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| i as usize);
                let (e, f) = (mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
                let (s, t) = (mesh.uvs[b] - mesh.uvs[a], mesh.uvs[c] - mesh.uvs[a]);
                let det = s.x * t.y - s.y * t.x;
                let (du, dv) = ((e * t.y - f * s.y) / det, (f * s.x - e * t.x) / det);
                let tangent = mesh.tangents[a].truncate();
                let bitangent = mesh.normals[a].cross(tangent) * mesh.tangents[a].w;
                assert!(du.dot(tangent) > 0.0 && dv.dot(bitangent) < 0.0, "{}", mesh.name);
            }
        }
        let area = |m: &Mesh| -> f32 {
            let tri = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| m.positions[i as usize]);
                0.5 * (b - a).cross(c - a).length()
            };
            m.triangles.iter().map(tri).sum()
        };
        assert!((area(&grid(2.0, 3.0, [4, 5])) - 6.0).abs() < 1e-4);
        assert!((area(&block(Vec3::new(1.0, 2.0, 3.0))) - 22.0).abs() < 1e-4);
        // The inscribed polyhedron of 64 x 32 lacks about 1.5 π²/64² of the sphere's area.
        assert!((area(&ball(64)) / (4.0 * PI) - 1.0).abs() < 5e-3);
    }

    #[test]
    fn cloth_hangs_without_stretching_outside_what_holds_it() {
        let supports = [
            Support::Ball { centre: Vec3::new(0.1, 0.8, 0.0), radius: 0.35 },
            Support::Block { centre: Vec3::new(0.0, 0.7, 0.0), size: Vec3::new(0.5, 0.4, 0.6) },
            Support::Stand { top: Vec3::new(0.0, 1.0, 0.0), radius: 0.3 },
        ];
        for over in supports {
            let cloth = Drape { segments: 24, over, turn: 0.3, ..Drape::default() };
            let mesh = drape(&cloth);
            check_frames_loosely(&mesh);
            let spacing = cloth.size / 24.0;
            let (mut sum, mut worst) = (0.0f32, 0.0f32);
            for j in 0..25 {
                for i in 0..24 {
                    for (a, b) in [(j * 25 + i, j * 25 + i + 1), (i * 25 + j, (i + 1) * 25 + j)] {
                        let strain = (mesh.positions[a].distance(mesh.positions[b]) / spacing - 1.0).abs();
                        sum += strain;
                        worst = worst.max(strain);
                    }
                }
            }
            let mean = sum / (2.0 * 25.0 * 24.0);
            println!("{over:?}: strain mean {mean}, worst {worst}");
            assert!(mean < 0.02 && worst < 0.15, "{over:?}: mean {mean}, worst {worst}");
            let deepest = mesh.positions.iter().map(|&p| over.distance(p).0).fold(f32::MAX, f32::min);
            assert!(deepest > 0.0, "{over:?}: {deepest}");
            // It hangs: the corners are far below the middle, which rests on top.
            let (middle, corner) = (mesh.positions[12 * 25 + 12], mesh.positions[0]);
            assert!((middle.y - over.top().y).abs() < 0.03 && corner.y < middle.y - 0.4, "{middle} {corner}");
            assert!(mesh.positions.iter().all(|p| p.y > cloth.floor));
            assert_eq!(mesh.positions, drape(&cloth).positions, "the same numbers on every run");
        }
    }

    fn check_frames_loosely(mesh: &Mesh) {
        for (n, t) in mesh.normals.iter().zip(&mesh.tangents) {
            assert!((n.length() - 1.0).abs() < 1e-4 && n.dot(t.truncate()).abs() < 1e-4);
        }
        assert!(mesh.uvs.iter().all(|uv| (0.0..=1.0).contains(&uv.x) && (0.0..=1.0).contains(&uv.y)));
    }
}
