//! Points on shapes that emit, drawn so that a shading point sees them evenly.
//!
//! Spheres by the cone they subtend; rectangles, and meshes that are one rectangle of two triangles, by
//! their solid angle (Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical
//! Rectangles"); everything else evenly by area.

use super::analytic::Analytic;
use super::{ERROR, Surface, invertible};
use glam::{DMat3, DVec2, DVec3, Mat3, Vec2, Vec3, Vec4};
use std::f32::consts;
use std::f64::consts::TAU;
use yugen_optics::{Frame, distribution, warp};
use yugen_scene::prepared::{Form, GeometryError, PlacedMesh, double_area_normal};
use yugen_scene::{Mesh, Shape};

/// A point on an emitting shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPoint {
    /// In the world.
    pub position: Vec3,
    /// Geometric, unit, on the emitting side.
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Triangle; 0 for other shapes.
    pub primitive: u32,
    /// Weights of the second and third corner of a triangle.
    pub barycentric: Vec2,
    /// Density: per solid angle seen from the reference point, or per area from `sample_area`.
    pub pdf: f32,
    /// Bound on the error of `position`.
    pub error: f32,
}

/// Draws points on one shape of the world.
#[derive(Debug)]
pub struct ShapeSampler {
    kind: Kind,
    area: f32,
    flip: bool,
    two_sided: bool,
    want_uv: bool,
}

#[derive(Debug)]
enum Kind {
    /// A sphere that is round in the world.
    Sphere {
        shape: Analytic,
        centre: DVec3,
        radius: f64,
    },
    /// Two perpendicular edges from a corner.
    Rectangle {
        quad: Quad,
        shape: Flat,
    },
    /// By area.
    Area(Analytic),
    Mesh {
        mesh: PlacedMesh,
        cumulative: Vec<f32>,
    },
}

/// How a point of a rectangle is named.
#[derive(Debug)]
enum Flat {
    Shape,
    /// Corner `i` of triangle `t` sits at these coordinates (0 or 1) along the two edges.
    Mesh {
        mesh: PlacedMesh,
        corners: [[Vec2; 3]; 2],
    },
}

#[derive(Debug)]
struct Quad {
    corner: Vec3,
    edges: [Vec3; 2],
    lengths: Vec2,
    axes: Mat3,
    normal: Vec3,
}

/// Smaller than this share of the squared distance, a rectangle is sampled evenly by area: the two ways differ
/// by a few per cent then, and single precision has no digits to lose in the sum of four angles.
const SMALL: f32 = 0.05;

/// A rectangle seen from a point; the names are the paper's.
struct SphericalRectangle {
    x0: f32,
    x1: f32,
    y0: f32,
    y1: f32,
    z0: f32,
    b0: f32,
    b1: f32,
    k: f32,
    solid_angle: f32,
}

impl Quad {
    fn new(corner: DVec3, edges: [DVec3; 2], normal: Vec3) -> Option<Self> {
        let lengths = edges.map(DVec3::length);
        let [x, y] = [edges[0] / lengths[0], edges[1] / lengths[1]];
        // Single-precision files are not exactly square.
        (x.dot(y).abs() < 1e-6).then(|| {
            let z = x.cross(y).normalize();
            Self {
                corner: corner.as_vec3(),
                edges: edges.map(|e| e.as_vec3()),
                lengths: DVec2::from_array(lengths).as_vec2(),
                axes: DMat3::from_cols(x, z.cross(x), z).as_mat3(),
                normal,
            }
        })
    }

    /// `None`: sample it by area instead.
    fn seen_from(&self, reference: Vec3) -> Option<SphericalRectangle> {
        let d = self.axes.transpose() * (self.corner - reference);
        let centre2 = (d.truncate() + 0.5 * self.lengths).length_squared() + d.z * d.z;
        if self.lengths.x * self.lengths.y < SMALL * centre2 {
            return None;
        }
        // The side on which the reference lies does not matter: z0 is made negative.
        let z0 = -d.z.abs();
        let (x0, y0) = (d.x, d.y);
        let (x1, y1) = (x0 + self.lengths.x, y0 + self.lengths.y);
        let z2 = z0 * z0;
        // z of the normals of the four planes through the reference and an edge.
        let n = [
            -y0 / (y0 * y0 + z2).sqrt(),
            x1 / (x1 * x1 + z2).sqrt(),
            y1 / (y1 * y1 + z2).sqrt(),
            -x0 / (x0 * x0 + z2).sqrt(),
        ];
        let n4 = Vec4::from_array(n);
        let [g0, g1, g2, g3] = acos(-n4 * Vec4::new(n[1], n[2], n[3], n[0])).to_array();
        let solid_angle = (g0 + g1 - consts::PI) + (g2 + g3 - consts::PI);
        let k = consts::TAU - g2 - g3;
        // Nearly edge-on the angle vanishes, however near it is.
        (z0 != 0.0 && solid_angle > 2e-3).then_some(SphericalRectangle {
            x0,
            x1,
            y0,
            y1,
            z0,
            b0: n[0],
            b1: n[2],
            k,
            solid_angle,
        })
    }
}

/// Four arc cosines to 1e-7. Abramowitz and Stegun 1964, 4.4.46.
fn acos(x: Vec4) -> Vec4 {
    const A: [f32; 8] = [
        consts::FRAC_PI_2,
        -0.214_598_8,
        0.088_978_99,
        -0.050_174_303,
        0.030_891_88,
        -0.017_088_126,
        0.006_670_09,
        -0.001_262_491,
    ];
    let y = x.abs().min(Vec4::ONE);
    let series = A.iter().rev().fold(Vec4::ZERO, |sum, a| sum * y + *a);
    let positive = (Vec4::ONE - y).map(f32::sqrt) * series;
    Vec4::select(x.cmplt(Vec4::ZERO), consts::PI - positive, positive)
}

impl SphericalRectangle {
    /// Coordinates in [0, 1]² along the edges.
    fn sample(&self, u: Vec2) -> Vec2 {
        let au = u.x * self.solid_angle + self.k;
        let (sin, cos) = au.sin_cos();
        let fu = (cos * self.b0 - self.b1) / sin;
        let cu = (1.0 / (fu * fu + self.b0 * self.b0).sqrt()).copysign(fu).clamp(-1.0, 1.0);
        let xu = (-(cu * self.z0) / (1.0 - cu * cu).max(1e-30).sqrt()).clamp(self.x0, self.x1);
        let d2 = xu * xu + self.z0 * self.z0;
        let h0 = self.y0 / (d2 + self.y0 * self.y0).sqrt();
        let h1 = self.y1 / (d2 + self.y1 * self.y1).sqrt();
        let hv = h0 + u.y * (h1 - h0);
        let yv = (hv * (d2 / (1.0 - hv * hv).max(1e-30)).sqrt()).clamp(self.y0, self.y1);
        Vec2::new((xu - self.x0) / (self.x1 - self.x0), (yv - self.y0) / (self.y1 - self.y0))
    }
}

impl ShapeSampler {
    /// For a shape of the world that is no instance. An instance has no sampler: `Ok(None)`, and so has a
    /// mesh without area.
    pub fn new(shape: &Shape) -> Result<Option<Self>, GeometryError> {
        let mut flip = shape.flip_normals;
        let form = match &shape.geometry {
            yugen_scene::Geometry::Instance(_) => return Ok(None),
            yugen_scene::Geometry::Mesh(mesh) => {
                let mesh = PlacedMesh::new(shape, mesh)?;
                if mesh.has_normals() && shape.to_world.determinant() < 0.0 {
                    flip = !flip;
                }
                return Ok(Self::mesh(mesh, flip, shape.two_sided_emission));
            }
            yugen_scene::Geometry::Sphere => Form::Sphere,
            yugen_scene::Geometry::Rectangle => Form::Rectangle,
            yugen_scene::Geometry::Disc => Form::Disc,
            yugen_scene::Geometry::Cylinder => Form::Cylinder,
        };
        let (to_world, to_object) = invertible(shape)?;
        if form == Form::Sphere {
            flip ^= shape.to_world.determinant() < 0.0;
        }
        let analytic = Analytic { form, to_world, to_object };
        let area = analytic.area() as f32;
        let m = to_world.matrix3;
        let kind = match form {
            Form::Sphere => {
                let gram = m.transpose() * m;
                let r2 = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
                let round = (gram - DMat3::from_diagonal(DVec3::splat(r2)))
                    .to_cols_array()
                    .iter()
                    .all(|d| d.abs() < 1e-5 * r2);
                if round {
                    Kind::Sphere { shape: analytic, centre: to_world.translation, radius: r2.sqrt() }
                } else {
                    Kind::Area(analytic)
                }
            }
            Form::Rectangle => {
                let edges = [2.0 * m.x_axis, 2.0 * m.y_axis];
                let corner = to_world.translation - m.x_axis - m.y_axis;
                let normal = analytic.normal(DVec3::ZERO);
                match Quad::new(corner, edges, normal) {
                    Some(quad) => Kind::Rectangle { quad, shape: Flat::Shape },
                    None => Kind::Area(analytic),
                }
            }
            _ => Kind::Area(analytic),
        };
        Ok(Some(Self { kind, area, flip, two_sided: shape.two_sided_emission, want_uv: true }))
    }

    fn mesh(mesh: PlacedMesh, flip: bool, two_sided: bool) -> Option<Self> {
        let count = mesh.mesh.triangles.len();
        let areas = (0..count as u32).map(|i| 0.5 * double_area_normal(mesh.corners(i)).length());
        let mut cumulative = vec![0.0; count];
        let sum = distribution::accumulate(areas, &mut cumulative);
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        let kind = match rectangle_of(&mesh) {
            Some((quad, corners)) => Kind::Rectangle { quad, shape: Flat::Mesh { mesh, corners } },
            None => Kind::Mesh { mesh, cumulative },
        };
        Some(Self { kind, area: sum as f32, flip, two_sided, want_uv: true })
    }

    /// The same sampler whose points come without texture coordinates, which cost more than they do.
    pub fn without_uv(self) -> Self {
        Self { want_uv: false, ..self }
    }

    /// The mesh that its points lie on, if it is one.
    pub fn mesh_of(&self) -> Option<&Mesh> {
        match &self.kind {
            Kind::Mesh { mesh, .. } | Kind::Rectangle { shape: Flat::Mesh { mesh, .. }, .. } => {
                Some(&mesh.mesh)
            }
            _ => None,
        }
    }

    /// Of the whole shape; where a scale is not uniform, to about 1e-4.
    pub fn area(&self) -> f32 {
        self.area
    }

    /// Emits on both sides?
    pub fn two_sided(&self) -> bool {
        self.two_sided
    }

    /// A point seen from `reference`, with its density per solid angle. `None` where `reference` sees the
    /// shape edge-on, or sits on the point drawn.
    pub fn sample(&self, reference: Vec3, u: Vec2) -> Option<LightPoint> {
        match &self.kind {
            Kind::Sphere { shape, centre, radius } => {
                let to = *centre - reference.as_dvec3();
                let Some(cone) = Cone::new(to, *radius) else { return self.by_area(reference, u) };
                // pbrt-v4, section 6.2.4: from the angle at the reference to the angle at the centre.
                let one_minus_cos = f64::from(u.x) * cone.one_minus_cos;
                let sin2 = one_minus_cos * (2.0 - one_minus_cos);
                let cos = 1.0 - one_minus_cos;
                let cos_a = sin2 / cone.sin + cos * (1.0 - sin2 / (cone.sin * cone.sin)).max(0.0).sqrt();
                let sin_a = (1.0 - cos_a * cos_a).max(0.0).sqrt();
                let (sin_phi, cos_phi) = (TAU * f64::from(u.y)).sin_cos();
                let frame = Frame::from_normal((-to).normalize().as_vec3());
                let n =
                    frame.to_world(DVec3::new(sin_a * cos_phi, sin_a * sin_phi, cos_a).as_vec3()).as_dvec3();
                // On the sphere's own surface, for its (u, v).
                let local = shape.to_object.transform_vector3(n * *radius).normalize();
                Some(LightPoint { pdf: cone.pdf() as f32, ..self.analytic_point(shape, local) })
            }
            Kind::Rectangle { quad, shape } => {
                let Some(seen) = quad.seen_from(reference) else { return self.by_area(reference, u) };
                let st = seen.sample(u);
                Some(LightPoint { pdf: 1.0 / seen.solid_angle, ..self.flat_point(quad, shape, st) })
            }
            _ => self.by_area(reference, u),
        }
    }

    /// The density per solid angle with which [`ShapeSampler::sample`] finds `surface`, which must be on
    /// this shape and visible from `reference`.
    pub fn pdf(&self, reference: Vec3, surface: &Surface) -> f32 {
        match &self.kind {
            Kind::Sphere { centre, radius, .. } => {
                if let Some(cone) = Cone::new(*centre - reference.as_dvec3(), *radius) {
                    return cone.pdf() as f32;
                }
            }
            Kind::Rectangle { quad, .. } => {
                if let Some(seen) = quad.seen_from(reference) {
                    return 1.0 / seen.solid_angle;
                }
            }
            _ => {}
        }
        let density = match &self.kind {
            Kind::Area(shape) => {
                shape.density(shape.to_object.transform_point3(surface.position.as_dvec3())) as f32
            }
            _ => 1.0 / self.area,
        };
        per_solid_angle(density, reference, surface.position, surface.geometric_normal).unwrap_or(0.0)
    }

    /// A point evenly by area (by parameter where a scale is not uniform), with its density per area.
    pub fn sample_area(&self, u: Vec2) -> LightPoint {
        match &self.kind {
            Kind::Sphere { shape, .. } | Kind::Area(shape) => {
                let local = shape.form.uniform(u);
                LightPoint { pdf: shape.density(local) as f32, ..self.analytic_point(shape, local) }
            }
            Kind::Rectangle { quad, shape } => {
                LightPoint { pdf: 1.0 / self.area, ..self.flat_point(quad, shape, u) }
            }
            Kind::Mesh { mesh, cumulative } => {
                let (i, x, _) = distribution::choose(cumulative, u.x);
                let b = warp::triangle(Vec2::new(x, u.y));
                LightPoint { pdf: 1.0 / self.area, ..self.mesh_point(mesh, i as u32, b) }
            }
        }
    }

    fn by_area(&self, reference: Vec3, u: Vec2) -> Option<LightPoint> {
        let point = self.sample_area(u);
        let pdf = per_solid_angle(point.pdf, reference, point.position, point.normal)?;
        Some(LightPoint { pdf, ..point })
    }

    fn analytic_point(&self, shape: &Analytic, local: DVec3) -> LightPoint {
        let position = shape.to_world.transform_point3(local).as_vec3();
        let normal = shape.normal(local);
        LightPoint {
            position,
            normal: if self.flip { -normal } else { normal },
            uv: if self.want_uv { shape.form.uv(local).as_vec2() } else { Vec2::ZERO },
            primitive: 0,
            barycentric: Vec2::ZERO,
            pdf: 0.0,
            error: position.abs().max_element() * ERROR,
        }
    }

    fn flat_point(&self, quad: &Quad, shape: &Flat, st: Vec2) -> LightPoint {
        let position = quad.corner + quad.edges[0] * st.x + quad.edges[1] * st.y;
        let mut point = LightPoint {
            position,
            normal: if self.flip { -quad.normal } else { quad.normal },
            uv: st,
            primitive: 0,
            barycentric: Vec2::ZERO,
            pdf: 0.0,
            error: position.abs().max_element() * ERROR,
        };
        if let (Flat::Mesh { mesh, corners }, true) = (shape, self.want_uv) {
            // The triangle whose weights are all (most nearly) positive.
            let weights = corners.map(|[a, b, c]| {
                let (e1, e2, p) = (b - a, c - a, st - a);
                Vec2::new(p.perp_dot(e2), e1.perp_dot(p)) / e1.perp_dot(e2)
            });
            let least = |w: Vec2| w.min_element().min(1.0 - w.x - w.y);
            let i = usize::from(least(weights[1]) > least(weights[0]));
            point.primitive = i as u32;
            point.barycentric = weights[i].clamp(Vec2::ZERO, Vec2::ONE);
            point.uv = mesh_uv(mesh, point.primitive, point.barycentric);
        }
        point
    }

    fn mesh_point(&self, mesh: &PlacedMesh, primitive: u32, b: Vec2) -> LightPoint {
        let corners = mesh.corners(primitive);
        let normal = double_area_normal(corners).normalize_or(DVec3::Z).as_vec3();
        let largest = corners.iter().fold(Vec3::ZERO, |a, p| a.max(p.abs())).max_element();
        LightPoint {
            position: corners[0] * (1.0 - b.x - b.y) + corners[1] * b.x + corners[2] * b.y,
            normal: if self.flip { -normal } else { normal },
            uv: mesh_uv(mesh, primitive, b),
            primitive,
            barycentric: b,
            pdf: 0.0,
            error: largest * ERROR,
        }
    }
}

fn mesh_uv(mesh: &PlacedMesh, primitive: u32, b: Vec2) -> Vec2 {
    if mesh.mesh.uvs.is_empty() {
        return b;
    }
    let [p, q, r] = mesh.mesh.triangles[primitive as usize].map(|i| mesh.mesh.uvs[i as usize]);
    p * (1.0 - b.x - b.y) + q * b.x + r * b.y
}

/// The rectangle that two triangles make, and where their corners sit on it.
fn rectangle_of(shape: &PlacedMesh) -> Option<(Quad, [[Vec2; 3]; 2])> {
    if shape.mesh.triangles.len() != 2 {
        return None;
    }
    let triangles = [shape.corners(0), shape.corners(1)];
    // The corner of the first triangle with the right angle, and its neighbours.
    let quad = (0..3).find_map(|i| {
        let [a, b, c] = [0, 1, 2].map(|k| triangles[0][(i + k) % 3].as_dvec3());
        let normal = (b - a).cross(c - a).normalize().as_vec3();
        Quad::new(a, [b - a, c - a], normal)
    })?;
    let size = quad.lengths.max_element();
    let mut seen = [0; 4];
    let mut corners = [[Vec2::ZERO; 3]; 2];
    for (t, triangle) in triangles.iter().enumerate() {
        for (i, p) in triangle.iter().enumerate() {
            let d = quad.axes.transpose() * (p - quad.corner);
            let st = d.truncate() / quad.lengths;
            let rounded = st.round();
            let off = (st - rounded).abs().max_element().max(d.z.abs() / size);
            if off > 1e-5 || !(0.0..=1.0).contains(&rounded.x) || !(0.0..=1.0).contains(&rounded.y) {
                return None;
            }
            seen[rounded.x as usize + 2 * rounded.y as usize] += 1;
            corners[t][i] = rounded;
        }
        // Both wound the same way.
        if double_area_normal(*triangle).dot(quad.normal.as_dvec3()) <= 0.0 {
            return None;
        }
    }
    // The diagonal twice, the other two corners once.
    matches!(seen, [1, 2, 2, 1] | [2, 1, 1, 2]).then_some((quad, corners))
}

fn per_solid_angle(density: f32, reference: Vec3, position: Vec3, normal: Vec3) -> Option<f32> {
    let d = position - reference;
    let d2 = d.length_squared();
    let cos = d.dot(normal).abs() / d2.sqrt();
    let pdf = density * d2 / cos;
    (cos > 0.0 && pdf > 0.0 && pdf.is_finite()).then_some(pdf)
}

/// The cone under which a sphere is seen from outside.
struct Cone {
    sin: f64,
    one_minus_cos: f64,
}

impl Cone {
    fn new(to_centre: DVec3, radius: f64) -> Option<Self> {
        let d2 = to_centre.length_squared();
        let sin2 = radius * radius / d2;
        // From the surface itself half of all directions meet the sphere, but rounding decides which.
        (sin2 < 1.0 - 1e-6)
            .then(|| Self { sin: sin2.sqrt(), one_minus_cos: sin2 / (1.0 + (1.0 - sin2).sqrt()) })
    }

    fn pdf(&self) -> f64 {
        1.0 / (TAU * self.one_minus_cos)
    }
}

impl Analytic {
    /// det(M) M⁻ᵀ n: direction and stretch of a surface element.
    fn element(&self, local: DVec3) -> DVec3 {
        let m = self.to_world.matrix3;
        let n = self.form.normal(local);
        m.y_axis.cross(m.z_axis) * n.x + m.z_axis.cross(m.x_axis) * n.y + m.x_axis.cross(m.y_axis) * n.z
    }

    fn normal(&self, local: DVec3) -> Vec3 {
        (self.element(local) * 1f64.copysign(self.to_world.matrix3.determinant()))
            .normalize_or(DVec3::Z)
            .as_vec3()
    }

    /// Density per world area of a point that is even in the form's own coordinates.
    fn density(&self, local: DVec3) -> f64 {
        1.0 / (self.form.own_area() * self.element(local).length())
    }

    /// Mean stretch times own area, by the midpoint rule.
    fn area(&self) -> f64 {
        const N: u32 = 128;
        let mean: f64 = (0..N * N)
            .map(|i| {
                let u = Vec2::new((i % N) as f32 + 0.5, (i / N) as f32 + 0.5) / N as f32;
                self.element(self.form.uniform(u)).length()
            })
            .sum::<f64>()
            / f64::from(N * N);
        mean * self.form.own_area()
    }
}
