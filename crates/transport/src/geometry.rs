//! The shapes of a scene as rays meet them, and the local geometry where they do.
//!
//! Conventions, checked against Mitsuba 3.9.1 shape by shape (`tests/geometry.rs`):
//! * Meshes: (u, v) of the file, else the weights of the second and third corner; ∂p/∂u along the file's u,
//!   else the first edge. Sphere, rectangle, disc, cylinder as `archive::scene` says.
//! * Shading normals are vertex normals carried by the inverse transpose of `to_world` and interpolated.
//! * The geometric normal lies on the side that the winding says. A mirroring `to_world` turns the winding
//!   round but not the vertex normals; where there are such, the geometric normal stays with them
//!   (Mitsuba lets the two part). `flip_normals` turns both.

mod analytic;
mod sampler;

pub use sampler::{LightPoint, ShapeSampler};

use crate::accel::{Aabb, Hit, Item, NO_INSTANCE, Others, Ray, Source, Tree, TreeStats, nearer};
use analytic::Analytic;
use glam::{Affine3A, DAffine3, DMat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_optics::Frame;
use yugen_scene::prepared::{
    Attributes, Form, GeometryError, PlacedMesh, attribute, double_area_normal, for_normals, mesh_bytes,
};
use yugen_scene::{MaterialId, Mesh, Scene, Shape};

/// Counts and costs of a [`Geometry`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stats {
    /// Triangles that can be met, each group counted once.
    pub triangles: usize,
    /// Nodes of all hierarchies.
    pub nodes: usize,
    /// Resident in hierarchies.
    pub tree_bytes: usize,
    /// Resident in meshes, each counted once.
    pub mesh_bytes: usize,
    /// Wall clock.
    pub build_seconds: f64,
}

/// Everything a ray can meet.
#[derive(Debug)]
pub struct Geometry {
    world: Level,
    groups: Vec<Level>,
    stats: Stats,
    want_uv: bool,
}

/// The shapes of the world or of one group, and the tree over them.
#[derive(Debug)]
struct Level {
    shapes: Vec<Placed>,
    tree: Tree,
}

#[derive(Debug)]
struct Placed {
    kind: Kind,
    flip: bool,
    material: MaterialId,
}

#[derive(Debug)]
enum Kind {
    Mesh(PlacedMesh),
    Analytic(Analytic),
    Instance { group: usize, to_world: DAffine3, to_group: DAffine3 },
}

/// All of the local geometry where a ray met a surface.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// In the world.
    pub position: Vec3,
    /// `position` and the next ray's arithmetic are off by less than this, along the geometric normal.
    pub error: f32,
    /// Unit.
    pub geometric_normal: Vec3,
    /// Tangent along ∂p/∂u (or the mesh's tangents), normal: the interpolated one.
    pub frame: Frame,
    /// 1, or −1 where the mesh's tangents say that the bitangent is −`frame.t`.
    pub handedness: f32,
    /// Texture coordinates.
    pub uv: Vec2,
    /// ∂p/∂u.
    pub dp_du: Vec3,
    /// ∂p/∂v.
    pub dp_dv: Vec3,
    /// Index into `Scene::shapes`, or into the instance's group.
    pub shape: u32,
    /// Triangle.
    pub primitive: u32,
    /// Index into `Scene::shapes`, or `NO_INSTANCE`.
    pub instance: u32,
    /// Of what it is made.
    pub material: MaterialId,
    /// Weights of the second and third corner of a triangle.
    pub barycentric: Vec2,
}

impl Surface {
    /// Where a ray towards `direction` may start without meeting this surface again.
    pub fn offset(&self, direction: Vec3) -> Vec3 {
        offset_origin(self.position, self.error, self.geometric_normal, direction)
    }

    /// A ray into `direction`.
    pub fn spawn(&self, direction: Vec3) -> Ray {
        Ray::new(self.offset(direction), direction)
    }
}

/// `position` moved off its surface by `error`, to the side that `direction` leaves on.
pub fn offset_origin(position: Vec3, error: f32, geometric_normal: Vec3, direction: Vec3) -> Vec3 {
    position + geometric_normal * error.copysign(direction.dot(geometric_normal))
}

/// Unit roundoff of `f32`.
const ULP: f32 = f32::EPSILON / 2.0;

/// Room for the rounding of a position, of the next origin and of the next ray's distance to the surface it
/// starts on, in units of the largest coordinate involved. Some 6 roundings add up; the rest is measured:
/// some 10⁵ rays leaving a triangle and every exact shape at all angles, near and far from the origin, small and
/// large, placed and instanced, meet themselves nowhere (`rays_do_not_meet_where_they_start`).
const ERROR: f32 = 24.0 * ULP;

impl Geometry {
    /// Builds the hierarchies on all cores.
    pub fn build(scene: &Scene) -> Result<Self, GeometryError> {
        Self::build_on(scene, yugen_optics::parallel::threads())
    }

    /// Builds on at most `threads` threads; the result is the same for any number.
    pub fn build_on(scene: &Scene, threads: usize) -> Result<Self, GeometryError> {
        let start = std::time::Instant::now();
        let groups =
            scene.groups.iter().map(|g| Level::build(g, None, threads)).collect::<Result<Vec<_>, _>>()?;
        let world = Level::build(&scene.shapes, Some(&groups), threads)?;
        let mut stats = Stats::default();
        let mut meshes: Vec<&Arc<Mesh>> = Vec::new();
        for level in groups.iter().chain([&world]) {
            stats.nodes += level.tree.node_count();
            stats.tree_bytes += level.tree.bytes();
            stats.triangles += level.tree.triangle_count();
            meshes.extend(
                level
                    .shapes
                    .iter()
                    .filter_map(|s| if let Kind::Mesh(m) = &s.kind { Some(&m.mesh) } else { None }),
            );
        }
        meshes.sort_by_key(|m| Arc::as_ptr(m));
        meshes.dedup_by_key(|m| Arc::as_ptr(m));
        stats.mesh_bytes = meshes.iter().map(|m| mesh_bytes(m)).sum();
        stats.build_seconds = start.elapsed().as_secs_f64();
        Ok(Self { world, groups, stats, want_uv: true })
    }

    /// The same geometry whose spheres, discs and cylinders come without texture coordinates: those cost more than
    /// all the rest.
    pub fn without_uv(self) -> Self {
        Self { want_uv: false, ..self }
    }

    /// The nearest surface on the ray.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.world.tree.closest(ray, &InWorld(self))
    }

    /// Is there any surface on the ray?
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.world.tree.any(ray, &InWorld(self))
    }

    /// Around everything.
    pub fn bounds(&self) -> Aabb {
        self.world.tree.bounds()
    }

    /// Counts and costs.
    pub fn stats(&self) -> Stats {
        self.stats
    }

    /// Checks the hierarchies of the world and of every group, in this order.
    pub fn validate(&self) -> Result<Vec<TreeStats>, String> {
        [&self.world].into_iter().chain(&self.groups).map(|l| l.tree.validate()).collect()
    }

    /// The local geometry at `hit`, which must have come from `ray`.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let (level, outer) = self.level_of(hit.instance);
        let placed = &level.shapes[hit.shape as usize];
        let mut surface = match &placed.kind {
            Kind::Mesh(mesh) => mesh_surface(mesh, outer.map(|(m, _)| m), hit),
            Kind::Analytic(shape) => analytic_surface(shape, outer, ray, hit, self.want_uv),
            Kind::Instance { .. } => unreachable!("an instance is passed through, not met"),
        };
        if placed.flip {
            surface.geometric_normal = -surface.geometric_normal;
            let n = -surface.frame.n;
            surface.frame = Frame { s: surface.frame.s, t: n.cross(surface.frame.s), n };
        }
        surface.material = placed.material;
        surface
    }

    /// An attribute of the mesh, interpolated where it is one of vertices; one number counts as grey. `None`: there is
    /// none.
    pub fn attribute(&self, surface: &Surface, name: &str) -> Option<Vec3> {
        let (level, _) = self.level_of(surface.instance);
        let Kind::Mesh(shape) = &level.shapes[surface.shape as usize].kind else { return None };
        attribute(&shape.mesh, surface.primitive, surface.barycentric, name)
    }

    /// The attributes at `surface`.
    pub fn attributes<'a>(&'a self, surface: &'a Surface) -> AttributesAt<'a> {
        AttributesAt { geometry: self, surface }
    }

    fn level_of(&self, instance: u32) -> (&Level, Option<(&DAffine3, &DAffine3)>) {
        if instance == NO_INSTANCE {
            return (&self.world, None);
        }
        match &self.world.shapes[instance as usize].kind {
            Kind::Instance { group, to_world, to_group } => {
                (&self.groups[*group], Some((to_world, to_group)))
            }
            _ => unreachable!("hits name only instances as instances"),
        }
    }
}

/// The attributes of meshes where a ray met them.
pub struct AttributesAt<'a> {
    geometry: &'a Geometry,
    surface: &'a Surface,
}

impl AttributesAt<'_> {
    /// Where.
    pub fn surface(&self) -> &Surface {
        self.surface
    }
}

impl Attributes for AttributesAt<'_> {
    fn attribute(&self, name: &str) -> Option<Vec3> {
        self.geometry.attribute(self.surface, name)
    }
}

impl Source for Vec<Placed> {
    fn triangle(&self, shape: u32, primitive: u32) -> [Vec3; 3] {
        match &self[shape as usize].kind {
            Kind::Mesh(mesh) => mesh.corners(primitive),
            _ => unreachable!("only meshes have triangles"),
        }
    }
}

/// A matrix that can be turned round, with its inverse.
fn invertible(shape: &Shape) -> Result<(DAffine3, DAffine3), GeometryError> {
    let m: DMat4 = shape.to_world.as_dmat4();
    let m = DAffine3::from_mat4(m);
    let inverse = m.inverse();
    if m.is_finite() && inverse.is_finite() && m.matrix3.determinant() != 0.0 {
        Ok((m, inverse))
    } else {
        Err(GeometryError::Transform { shape: shape.name.clone() })
    }
}

impl Level {
    /// `groups`: `None` inside a group.
    fn build(shapes: &[Shape], groups: Option<&[Level]>, threads: usize) -> Result<Self, GeometryError> {
        let mut placed = Vec::with_capacity(shapes.len());
        let mut items = Vec::new();
        let triangles =
            |s: &Shape| if let yugen_scene::Geometry::Mesh(m) = &s.geometry { m.triangles.len() } else { 1 };
        let count: usize = shapes.iter().map(triangles).sum();
        // A quarter of what the tree's indices count.
        let limit = 1 << 28;
        if count > limit {
            return Err(GeometryError::TooMany { count, limit });
        }
        items.reserve_exact(count);
        for (index, shape) in shapes.iter().enumerate() {
            let index = index as u32;
            let analytic = |form| -> Result<Kind, GeometryError> {
                let (to_world, to_object) = invertible(shape)?;
                Ok(Kind::Analytic(Analytic { form, to_world, to_object }))
            };
            let mut flip = shape.flip_normals;
            let kind = match &shape.geometry {
                yugen_scene::Geometry::Mesh(mesh) => Kind::Mesh(PlacedMesh::new(shape, mesh)?),
                yugen_scene::Geometry::Sphere => {
                    // Mitsuba turns a mirrored sphere inside out, and only the sphere.
                    flip ^= shape.to_world.determinant() < 0.0;
                    analytic(Form::Sphere)?
                }
                yugen_scene::Geometry::Rectangle => analytic(Form::Rectangle)?,
                yugen_scene::Geometry::Disc => analytic(Form::Disc)?,
                yugen_scene::Geometry::Cylinder => analytic(Form::Cylinder)?,
                yugen_scene::Geometry::Instance(group) => {
                    let groups = groups.ok_or_else(|| GeometryError::Nested { shape: shape.name.clone() })?;
                    if *group >= groups.len() {
                        return Err(GeometryError::Group {
                            shape: shape.name.clone(),
                            group: *group,
                            count: groups.len(),
                        });
                    }
                    let (to_world, to_group) = invertible(shape)?;
                    Kind::Instance { group: *group, to_world, to_group }
                }
            };
            match &kind {
                Kind::Mesh(mesh) => items.extend((0..mesh.mesh.triangles.len() as u32).filter_map(|i| {
                    let corners = mesh.corners(i);
                    // A triangle without area can be met by no ray and has no normal.
                    (double_area_normal(corners) != glam::DVec3::ZERO)
                        .then(|| Item::triangle(corners, index, i))
                })),
                Kind::Analytic(shape) => items.push(Item::other(shape.bounds(), index)),
                Kind::Instance { group, to_world, .. } => {
                    let inner = groups.map_or(Aabb::EMPTY, |g| g[*group].tree.bounds());
                    if !inner.is_empty() {
                        items.push(Item::other(analytic::transformed(inner, to_world), index));
                    }
                }
            }
            placed.push(Placed { kind, flip, material: shape.material });
        }
        let tree = Tree::build(&placed, items, threads);
        Ok(Self { shapes: placed, tree })
    }
}

/// What the tree of the world holds besides triangles.
struct InWorld<'a>(&'a Geometry);

/// What the tree of a group holds besides triangles.
struct InGroup<'a>(&'a Level);

fn meet_analytic(shape: &Analytic, index: u32, ray: &Ray, best: &mut Option<Hit>) {
    if let Some((t, _)) = shape.intersect(ray, ray.t_min, ray.t_max) {
        let hit = Hit { t, u: 0.0, v: 0.0, shape: index, primitive: 0, instance: NO_INSTANCE };
        if nearer(&hit, best) {
            *best = Some(hit);
        }
    }
}

/// The same ray in the group's coordinates; t is the same too.
fn into_group(to_group: &DAffine3, ray: &Ray) -> Ray {
    Ray {
        origin: to_group.transform_point3(ray.origin.as_dvec3()).as_vec3(),
        dir: to_group.transform_vector3(ray.dir.as_dvec3()).as_vec3(),
        ..*ray
    }
}

impl Others for InGroup<'_> {
    fn intersect(&self, index: u32, ray: &Ray, best: &mut Option<Hit>) {
        if let Kind::Analytic(shape) = &self.0.shapes[index as usize].kind {
            meet_analytic(shape, index, ray, best);
        }
    }

    fn occluded(&self, index: u32, ray: &Ray) -> bool {
        match &self.0.shapes[index as usize].kind {
            Kind::Analytic(shape) => shape.intersect(ray, ray.t_min, ray.t_max).is_some(),
            _ => false,
        }
    }
}

impl Others for InWorld<'_> {
    fn intersect(&self, index: u32, ray: &Ray, best: &mut Option<Hit>) {
        match &self.0.world.shapes[index as usize].kind {
            Kind::Analytic(shape) => meet_analytic(shape, index, ray, best),
            Kind::Instance { group, to_group, .. } => {
                let group = &self.0.groups[*group];
                if let Some(hit) = group.tree.closest(&into_group(to_group, ray), &InGroup(group)) {
                    let hit = Hit { instance: index, ..hit };
                    if nearer(&hit, best) {
                        *best = Some(hit);
                    }
                }
            }
            Kind::Mesh(_) => {}
        }
    }

    fn occluded(&self, index: u32, ray: &Ray) -> bool {
        match &self.0.world.shapes[index as usize].kind {
            Kind::Analytic(shape) => shape.intersect(ray, ray.t_min, ray.t_max).is_some(),
            Kind::Instance { group, to_group, .. } => {
                let group = &self.0.groups[*group];
                group.tree.any(&into_group(to_group, ray), &InGroup(group))
            }
            Kind::Mesh(_) => false,
        }
    }
}

/// The largest error, in the world, of a point whose group coordinates were rounded to `f32`.
fn instance_error(to_world: &DAffine3, local: Vec3) -> f32 {
    let m = to_world.matrix3.as_mat3();
    let p = local.abs();
    (m.x_axis.abs() * p.x + m.y_axis.abs() * p.y + m.z_axis.abs() * p.z).max_element() * ERROR
}

/// The unit normal of a triangle; slivers, whose cross product cancels, are done in double precision.
#[inline]
fn unit_normal(corners: [Vec3; 3], e1: Vec3, e2: Vec3) -> Vec3 {
    let n = e1.cross(e2);
    let n2 = n.length_squared();
    // A sine above 1/30 loses five bits at most.
    if n2 > 1e-3 * e1.length_squared() * e2.length_squared() && n2 > 1e-30 {
        n / n2.sqrt()
    } else {
        double_area_normal(corners).normalize_or(glam::DVec3::Z).as_vec3()
    }
}

#[inline]
fn mesh_surface(shape: &PlacedMesh, outer: Option<&DAffine3>, hit: &Hit) -> Surface {
    let mesh = &*shape.mesh;
    let indices = mesh.triangles[hit.primitive as usize];
    let (b1, b2) = (hit.u, hit.v);
    let b0 = 1.0 - b1 - b2;
    let weigh = |v: [Vec3; 3]| v[0] * b0 + v[1] * b1 + v[2] * b2;

    let local = shape.corners(hit.primitive);
    let mut error = 0.0;
    let mut corners = local;
    // Of an instance, from its group to the world.
    let to_world = outer.map(|outer| Affine3A::from_mat4(DMat4::from(*outer).as_mat4()));
    if let (Some(m), Some(outer)) = (to_world, outer) {
        corners = local.map(|p| m.transform_point3(p));
        error = instance_error(outer, local.iter().fold(Vec3::ZERO, |a, p| a.max(p.abs())));
    }
    let largest = corners.iter().fold(Vec3::ZERO, |a, p| a.max(p.abs())).max_element();
    error += largest * ERROR;

    let position = weigh(corners);
    let (dp1, dp2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let mut normal = unit_normal(corners, dp1, dp2);

    let mut uv = Vec2::new(b1, b2);
    let (mut dp_du, mut dp_dv) = (dp1, dp2);
    if !mesh.uvs.is_empty() {
        let [a, b, c] = indices.map(|i| mesh.uvs[i as usize]);
        uv = a * b0 + b * b1 + c * b2;
        let (d1, d2) = (b - a, c - a);
        let det = d1.perp_dot(d2);
        let (du, dv) = ((dp1 * d2.y - dp2 * d1.y) / det, (dp2 * d1.x - dp1 * d2.x) / det);
        if du.is_finite() && dv.is_finite() {
            (dp_du, dp_dv) = (du, dv);
        }
    }

    let mut shading = normal;
    if shape.has_normals() {
        let mut vertex = indices.map(|i| mesh.normals[i as usize]);
        if shape.mirrored {
            normal = -normal;
        }
        if let Some(m) = to_world {
            let normals = for_normals(&m);
            vertex = vertex.map(|n| (normals * n).normalize_or_zero());
            if m.matrix3.determinant() < 0.0 {
                normal = -normal;
            }
        }
        shading = weigh(vertex).try_normalize().unwrap_or(normal);
    }

    let mut tangent = dp_du;
    let mut handedness = 1.0;
    if !mesh.tangents.is_empty() {
        let [a, b, c] = indices.map(|i| mesh.tangents[i as usize]);
        let t = weigh([a, b, c].map(|t| t.truncate()));
        let t = to_world.map_or(t, |m| m.transform_vector3(t));
        if t.length_squared() > 0.0 && t.is_finite() {
            tangent = t;
            handedness = a.w;
        }
    }
    Surface {
        position,
        error,
        geometric_normal: normal,
        frame: Frame::from_normal_tangent(shading, tangent),
        handedness,
        uv,
        dp_du,
        dp_dv,
        shape: hit.shape,
        primitive: hit.primitive,
        instance: hit.instance,
        material: 0,
        barycentric: Vec2::new(b1, b2),
    }
}

fn analytic_surface(
    shape: &Analytic,
    outer: Option<(&DAffine3, &DAffine3)>,
    ray: &Ray,
    hit: &Hit,
    want_uv: bool,
) -> Surface {
    let local_ray = outer.map_or(*ray, |(_, to_group)| into_group(to_group, ray));
    let p = shape.point_near(&local_ray, hit.t);
    let to_world = outer.map_or(shape.to_world, |(m, _)| *m * shape.to_world);
    let [dp_du, dp_dv] = shape.form.tangents(p);
    let position = to_world.transform_point3(p);
    let sign = 1f64.copysign(to_world.matrix3.determinant());
    let m = to_world.matrix3;
    let n = shape.form.normal(p);
    let cofactor =
        m.y_axis.cross(m.z_axis) * n.x + m.z_axis.cross(m.x_axis) * n.y + m.x_axis.cross(m.y_axis) * n.z;
    let normal = (cofactor * sign).normalize_or(glam::DVec3::Z).as_vec3();
    let dp_du = (m * dp_du).as_vec3();
    let position = position.as_vec3();
    let error = position.abs().max_element().max(0.1 * analytic::extent(&to_world)) * ERROR
        + outer.map_or(0.0, |(m, _)| instance_error(m, shape.to_world.transform_point3(p).as_vec3()));
    Surface {
        position,
        error,
        geometric_normal: normal,
        frame: Frame::from_normal_tangent(normal, dp_du),
        handedness: 1.0,
        uv: if want_uv { shape.form.uv(p).as_vec2() } else { Vec2::ZERO },
        dp_du,
        dp_dv: (m * dp_dv).as_vec3(),
        shape: hit.shape,
        primitive: 0,
        instance: hit.instance,
        material: 0,
        barycentric: Vec2::ZERO,
    }
}
