//! Bodies that cloth lies on: capsules, a ground, and distance fields of closed meshes.
//!
//! What a body costs does not depend on its mesh. A body moves during a step: substeps see it where it is then, and a vertex
//! that crosses it between two of them is found on its way.

use super::ClothError;
use glam::{IVec3, Mat3, Mat4, Quat, Vec3};
use std::sync::Arc;

/// What a body is made of, in its own coordinates.
#[derive(Clone, Debug)]
pub enum Solid {
    /// All that lies below a plane through the origin, y up.
    Ground,
    /// All points nearer to a segment than its radius, which goes over linearly from one end to the other.
    Capsule {
        /// Both ends, m.
        ends: [Vec3; 2],
        /// Radii there, m.
        radii: [f32; 2],
    },
    /// The inside of a closed mesh.
    Field(Arc<Field>),
}

/// Where a body is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// Of its coordinates in the world.
    pub rotation: Quat,
    /// Its origin in the world, m.
    pub origin: Vec3,
}

impl Stance {
    /// What a matrix does besides scaling.
    pub fn of(to_world: &Mat4) -> Self {
        let (_, rotation, origin) = to_world.to_scale_rotation_translation();
        Self { rotation: if rotation.is_finite() { rotation.normalize() } else { Quat::IDENTITY }, origin }
    }
}

impl Default for Stance {
    fn default() -> Self {
        Self { rotation: Quat::IDENTITY, origin: Vec3::ZERO }
    }
}

/// Signed distances to a closed mesh, near it.
#[derive(Clone, Debug)]
pub struct Field {
    low: Vec3,
    cell: f32,
    size: [usize; 3],
    /// x fastest; farther than [`Field::BAND`] cells from the surface they are that many cells, with the sign.
    distances: Vec<f32>,
}

impl Field {
    /// Cells on either side of the surface within which distances are exact.
    pub const BAND: f32 = 3.0;
    /// The most cells of a field, 64 MiB.
    const MOST: usize = 1 << 24;

    /// The field of a closed mesh in cells of `cell` metres. What lies inside is told by counting crossings along the three
    /// axes, two of three: small holes do no harm.
    ///
    /// # Errors
    /// Indices or numbers that are none, and more cells than can be.
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], cell: f32) -> Result<Self, ClothError> {
        if triangles.is_empty() {
            return Err(ClothError::Empty("triangles of its body"));
        }
        super::numbers("body vertex", positions, |p| p.is_finite() && p.abs().max_element() <= super::FAR)?;
        super::known("body triangle", positions.len(), triangles.iter().copied())?;
        let corners = || triangles.iter().flatten().map(|v| positions[*v as usize]);
        let (low, high) =
            corners().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let margin = Self::BAND + 1.0;
        let count = ((high - low) / cell + 2.0 * margin).ceil();
        let all = count.as_dvec3().element_product();
        if !(cell > 0.0 && all <= Self::MOST as f64) {
            return Err(ClothError::Cells { cell, most: Self::MOST });
        }
        let size = count.to_array().map(|n| n as usize + 1);
        let low = low - margin * cell;
        let far = Self::BAND * cell;
        let mut field = Self { low, cell, size, distances: vec![far; size.iter().product()] };
        for t in triangles {
            let t = t.map(|v| positions[v as usize]);
            let from = ((t[0].min(t[1]).min(t[2]) - low - far) / cell).floor().max(Vec3::ZERO).as_ivec3();
            let to = ((t[0].max(t[1]).max(t[2]) - low + far) / cell).ceil().as_ivec3();
            let last = IVec3::from_array(size.map(|n| n as i32 - 1));
            let to = to.min(last);
            for z in from.z..=to.z {
                for y in from.y..=to.y {
                    for x in from.x..=to.x {
                        let p = low + IVec3::new(x, y, z).as_vec3() * cell;
                        let i = field.index([x, y, z].map(|v| v as usize));
                        field.distances[i] = field.distances[i].min(p.distance(nearest(p, &t)));
                    }
                }
            }
        }
        let inside = field.crossings(positions, triangles);
        for (d, votes) in field.distances.iter_mut().zip(inside) {
            if votes >= 2 {
                *d = -*d;
            }
        }
        Ok(field)
    }

    /// Its first point, m; the edge of its cells, m; its points along each axis, and distances at them, m, x fastest.
    pub fn grid(&self) -> (Vec3, f32, [usize; 3], &[f32]) {
        (self.low, self.cell, self.size, &self.distances)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Of each point, along how many axes it lies inside.
    fn crossings(&self, positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u8> {
        let mut votes = vec![0u8; self.distances.len()];
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            // Where lines along the axis cross the mesh, in cells. Lines lie a hair beside the points, so that none goes through an
            // edge of a mesh that is made of whole cells.
            let shift = [1.37e-4, 2.11e-4];
            let mut crossed: Vec<Vec<f32>> = vec![Vec::new(); self.size[a] * self.size[b]];
            for t in triangles {
                let t = t.map(|v| (positions[v as usize] - self.low) / self.cell);
                let low = t[0].min(t[1]).min(t[2]);
                let high = t[0].max(t[1]).max(t[2]);
                for j in low[b].floor().max(0.0) as usize..=(high[b].ceil() as usize).min(self.size[b] - 1) {
                    for i in
                        low[a].floor().max(0.0) as usize..=(high[a].ceil() as usize).min(self.size[a] - 1)
                    {
                        let at = [i as f32 + shift[0], j as f32 + shift[1]];
                        let side = |p: Vec3, q: Vec3| {
                            (q[a] - p[a]) * (at[1] - p[b]) - (q[b] - p[b]) * (at[0] - p[a])
                        };
                        let w = [side(t[1], t[2]), side(t[2], t[0]), side(t[0], t[1])];
                        if w.iter().all(|w| *w > 0.0) || w.iter().all(|w| *w < 0.0) {
                            let sum = w[0] + w[1] + w[2];
                            let depth = (t[0][axis] * w[0] + t[1][axis] * w[1] + t[2][axis] * w[2]) / sum;
                            crossed[j * self.size[a] + i].push(depth);
                        }
                    }
                }
            }
            for j in 0..self.size[b] {
                for i in 0..self.size[a] {
                    let list = &mut crossed[j * self.size[a] + i];
                    list.sort_unstable_by(f32::total_cmp);
                    for k in 0..self.size[axis] {
                        let below = list.partition_point(|d| *d < k as f32);
                        if below % 2 == 1 {
                            let mut at = [0; 3];
                            (at[axis], at[a], at[b]) = (k, i, j);
                            votes[self.index(at)] += 1;
                        }
                    }
                }
            }
        }
        votes
    }

    /// Distance and the direction away from the surface; farther outside than [`Field::BAND`] cells no more than the distance.
    fn distance(&self, p: Vec3) -> (f32, Vec3) {
        let q = (p - self.low) / self.cell;
        let last = Vec3::from_array(self.size.map(|n| (n - 1) as f32));
        // What is no number is far.
        if !p.is_finite() {
            return (f32::INFINITY, Vec3::Y);
        }
        // From the box to the mesh there is a cell more than the band: where the box begins, this is what its cells say.
        let beside = (q - q.clamp(Vec3::ZERO, last)) * self.cell;
        let out = beside.length();
        if out > 0.0 {
            return (out + Self::BAND * self.cell, beside / out);
        }
        let first = q.floor().min(last - 1.0);
        let t = q - first;
        let i = self.index(first.to_array().map(|v| v as usize));
        let (dy, dz) = (self.size[0], self.size[0] * self.size[1]);
        let v = |k: usize| self.distances[i + (k & 1) + (k >> 1 & 1) * dy + (k >> 2) * dz];
        let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let c: [f32; 8] = std::array::from_fn(v);
        let along = |t: f32, s: [f32; 4]| (lerp(s[0], s[1], t), lerp(s[2], s[3], t));
        let (y0, y1) = along(t.x, [c[0], c[1], c[2], c[3]]);
        let (y2, y3) = along(t.x, [c[4], c[5], c[6], c[7]]);
        let (z0, z1) = (lerp(y0, y1, t.y), lerp(y2, y3, t.y));
        let x_slope = lerp(lerp(c[1] - c[0], c[3] - c[2], t.y), lerp(c[5] - c[4], c[7] - c[6], t.y), t.z);
        let normal = Vec3::new(x_slope, lerp(y1 - y0, y3 - y2, t.z), z1 - z0);
        (lerp(z0, z1, t.z), normal.normalize_or(Vec3::Y))
    }
}

/// The point of a triangle that is nearest to `p` (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
pub(super) fn nearest(p: Vec3, [a, b, c]: &[Vec3; 3]) -> Vec3 {
    let w = barycentric(p, *a, *b, *c);
    *a * w[0] + *b * w[1] + *c * w[2]
}

/// Weights of the corners of the nearest point of a triangle.
#[inline]
pub(super) fn barycentric(p: Vec3, a: Vec3, b: Vec3, c: Vec3) -> [f32; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    if sum <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    [va / sum, vb / sum, vc / sum]
}

impl Solid {
    /// Whether it can be one.
    pub fn check(&self) -> Result<(), ClothError> {
        if let Self::Capsule { ends, radii } = self {
            super::numbers("end of a capsule", ends, |p| {
                p.is_finite() && p.abs().max_element() <= super::FAR
            })?;
            super::numbers("radius of a capsule", radii, |r| *r > 0.0 && *r <= super::FAR)?;
        }
        Ok(())
    }

    /// Signed distance from its surface, m, negative inside, and a unit direction away from it. Of a [`Field`], farther than three cells
    /// outside: no more than the distance, and any direction. Infinite where `p` is no number.
    // Inline, so that who asks for the distance alone gets no direction made.
    #[inline(always)]
    pub fn distance(&self, p: Vec3) -> (f32, Vec3) {
        match self {
            Self::Ground => (p.y, Vec3::Y),
            Self::Capsule { ends: [a, b], radii } => {
                let along = *b - *a;
                let t = ((p - *a).dot(along) / along.length_squared().max(1e-20)).clamp(0.0, 1.0);
                let from = p - (*a + along * t);
                let d = from.length();
                let n = if d > 1e-9 { from / d } else { along.any_orthogonal_vector().normalize_or(Vec3::Y) };
                (d - (radii[0] + (radii[1] - radii[0]) * t), n)
            }
            Self::Field(field) => field.distance(p),
        }
    }

    /// A sphere around it: its middle and radius.
    pub(super) fn bounds(&self) -> (Vec3, f32) {
        match self {
            Self::Ground => (Vec3::ZERO, f32::INFINITY),
            Self::Capsule { ends: [a, b], radii } => {
                (0.5 * (*a + *b), 0.5 * a.distance(*b) + radii[0].max(radii[1]))
            }
            Self::Field(f) => {
                let half = Vec3::from_array(f.size.map(|n| (n - 1) as f32)) * (0.5 * f.cell);
                (f.low + half, half.length())
            }
        }
    }

    /// What it sweeps over from one stance to another lies within a sphere: its middle, its radius, and what [`Solid::moved`] says.
    pub(super) fn swept(&self, from: &Stance, to: &Stance) -> (Vec3, f32, Option<f32>) {
        let (middle, radius) = self.bounds();
        let ends = [from, to].map(|s| s.rotation * middle + s.origin);
        // A turn takes its middle around, at most half as far as a straight line is long.
        (0.5 * (ends[0] + ends[1]), radius + ends[0].distance(ends[1]), self.moved(from, to))
    }

    /// How far any of its points goes from one stance to another, as [`Placed::between`] takes it there, where that is easily told, m.
    pub(super) fn moved(&self, from: &Stance, to: &Stance) -> Option<f32> {
        let (middle, radius) = self.bounds();
        // Along an arc about its origin.
        let turn = match from.rotation == to.rotation {
            true => 0.0,
            // The angle is found to within a tenth of a thousandth.
            false => (from.rotation.angle_between(to.rotation) + 1e-4) * (middle.length() + radius),
        };
        Some(from.origin.distance(to.origin) + turn).filter(|moved| moved.is_finite())
    }

    /// By how much its distance changes at the most over a metre.
    pub fn slope(&self) -> f32 {
        match self {
            Self::Ground => 1.0,
            // Its radius changes along the axis too.
            Self::Capsule { ends: [a, b], radii } => {
                1.0 + (radii[0] - radii[1]).abs() / a.distance(*b).max(1e-6)
            }
            // It is interpolated along three axes.
            Self::Field(_) => 3f32.sqrt(),
        }
    }

    /// Length of the steps in which a way is searched for a crossing, m: a fraction of what is thinnest.
    pub fn stride(&self) -> f32 {
        match self {
            Self::Ground => f32::INFINITY,
            Self::Capsule { radii, .. } => 0.5 * radii[0].min(radii[1]),
            Self::Field(f) => f.cell,
        }
    }
}

/// A stance as a substep uses it.
#[derive(Clone, Copy, Default)]
pub(super) struct Placed {
    to_world: Mat3,
    origin: Vec3,
}

impl Placed {
    /// Part `t` of the way between two stances.
    pub fn between(from: &Stance, to: &Stance, t: f32) -> Self {
        let rotation = from.rotation.slerp(to.rotation, t).normalize();
        Self { to_world: Mat3::from_quat(rotation), origin: from.origin.lerp(to.origin, t) }
    }

    /// Rotation and origin.
    pub fn parts(&self) -> (Mat3, Vec3) {
        (self.to_world, self.origin)
    }

    pub fn local(&self, p: Vec3) -> Vec3 {
        self.to_world.transpose() * (p - self.origin)
    }

    fn world(&self, q: Vec3) -> Vec3 {
        self.to_world * q + self.origin
    }
}

/// Speed with which a vertex that starts inside comes out, m/s: a costume frees itself within a simulated second, and is not
/// shot off.
pub(super) const RECOVERY: f32 = 0.5;

impl Solid {
    /// By how much a vertex moves that would go from `x` to `x` + `u` in a substep of `h` seconds, if it stays `gap` away from the
    /// body, which goes from one place to the other; or `Err` with how far it is from that where they do not meet. Friction is Coulomb's.
    /// The second is by how much it is moved besides, without velocity, because it was inside before.
    pub(super) fn stop(
        &self,
        [from, to]: [&Placed; 2],
        x: Vec3,
        u: Vec3,
        gap: f32,
        friction: f32,
        h: f32,
    ) -> Result<[Vec3; 2], f32> {
        let end = to.local(x + u);
        let (mut d, mut n) = self.distance(end);
        let mut at = end;
        d -= gap;
        let start = from.local(x);
        let way = end - start;
        let stride = self.stride();
        if d > 0.0 {
            let long = way.length();
            // Where the end is that far away nothing on the way is nearer.
            if long <= stride || d > long * self.slope() {
                return Err(d);
            }
            // So many reach a dozen metres through the thinnest arm.
            let count = (long / stride).ceil().min(256.0);
            let step = way / count;
            let hit = (1..count as u32).find_map(|k| {
                let p = start + step * k as f32;
                let (d, n) = self.distance(p);
                (d < gap).then_some((p, d - gap, n))
            });
            (at, d, n) = hit.ok_or(d)?;
        }
        // What was inside as the substep began comes out in time.
        let before = (self.distance(start).0 - gap).min(0.0);
        let push = (before - d).max(0.0);
        let point = at + n * push;
        let normal = to.to_world * n;
        let mut u = to.world(point) - x;
        // The point of the body that is touched has moved too.
        let carried = to.world(point) - from.world(point);
        let relative = u - carried;
        let slide = relative - normal * relative.dot(normal);
        let (far, most) = (slide.length(), friction * push);
        if far > 0.0 {
            u -= slide * (most / far).min(1.0);
        }
        Ok([u, normal * (-before).min(RECOVERY * h)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of this size about the origin.
    fn block(half: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let corner =
            |i: usize| Vec3::from_array([0, 1, 2].map(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] }));
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let split = |f: [u32; 4]| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]];
        ((0..8).map(corner).collect(), faces.into_iter().flat_map(split).collect())
    }

    #[test]
    fn a_field_has_the_distances_of_its_mesh() {
        let half = Vec3::new(0.3, 0.2, 0.1);
        let (positions, triangles) = block(half);
        let field = Field::new(&positions, &triangles, 0.02).unwrap();
        // Three cells to either side are known.
        for i in 0..4000u32 {
            let r = |k: u32| {
                (i.wrapping_mul(2_654_435_761).wrapping_add(k.wrapping_mul(0x9E37_79B9)) >> 8) as f32
                    / (1 << 24) as f32
            };
            let p = (Vec3::new(r(1), r(2), r(3)) - 0.5) * 2.0 * (half + 0.05);
            let q = p.abs() - half;
            let truth = q.max(Vec3::ZERO).length() + q.max_element().min(0.0);
            if truth.abs() < 0.03 {
                let (d, _) = field.distance(p);
                // Interpolation rounds the edges of the box.
                assert!((d - truth).abs() < 0.01, "{p}: {d} {truth}");
            }
        }
        assert!(field.distance(Vec3::ZERO).0 < -0.05 && field.distance(Vec3::splat(9.0)).0 > 9.0);
        assert_eq!(field.distance(Vec3::NAN).0, f32::INFINITY);
        // Outside of its box, which ends at 38 cm along x, distances go on from those at its border and are none too large.
        for y in [0.0, 0.15, 0.25, 0.5] {
            let mut before = field.distance(Vec3::new(0.37, y, 0.0)).0;
            for k in 0..400 {
                let p = Vec3::new(0.37 + 0.001 * k as f32, y, 0.0);
                let truth = (p.abs() - half).max(Vec3::ZERO).length();
                let (d, n) = field.distance(p);
                assert!(
                    d > 0.05 && d <= truth + 1e-5 && (d - before).abs() < 0.0012,
                    "{p}: {d} {before} {truth}"
                );
                assert!(p.x < 0.38 + 1e-5 || n.x > 0.0, "{p}: {n}");
                before = d;
            }
        }
        assert!(Field::new(&positions, &triangles, 1e-5).is_err());
        assert!(Field::new(&positions, &[], 0.1).is_err());
        assert!(Field::new(&positions, &[[0, 1, 99]], 0.1).is_err());
        assert!(Field::new(&[Vec3::NAN; 3], &[[0, 1, 2]], 0.1).is_err());
    }

    #[test]
    fn what_crosses_a_thin_body_in_one_substep_is_stopped() {
        let bar = Solid::Capsule { ends: [Vec3::NEG_X, Vec3::X], radii: [0.03; 2] };
        let still = Placed::between(&Stance::default(), &Stance::default(), 0.0);
        // Two metres down in one substep, through the middle of it.
        let u = bar.stop([&still; 2], Vec3::Y, Vec3::new(0.0, -2.0, 0.0), 0.001, 0.3, 1e-3).unwrap()[0];
        assert!((u.y + 0.969).abs() < 1e-3, "{u}");
        // Or the body through the cloth.
        let up = Stance { origin: Vec3::new(0.0, 2.0, 0.0), ..Stance::default() };
        let risen = Placed::between(&Stance::default(), &up, 1.0);
        let u = bar.stop([&still, &risen], Vec3::Y, Vec3::ZERO, 0.001, 0.3, 1e-3).unwrap()[0];
        assert!(u.y > 1.0, "{u}");
        // Beside it there is nothing.
        let by = Vec3::new(0.0, 0.0, 0.2);
        assert!(bar.stop([&still; 2], Vec3::Y + by, Vec3::new(0.0, -2.0, 0.0), 0.001, 0.3, 1e-3).is_err());
    }
}
