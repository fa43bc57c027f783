//! Light along one camera ray: path tracing with multiple importance sampling.
//!
//! Kajiya 1986, "The Rendering Equation"; Veach 1997, "Robust Monte Carlo Methods for Light Transport
//! Simulation" (power heuristic). At every vertex one light and one direction of the material are drawn.

use crate::accel::{Hit, Ray};
use crate::geometry::{AttributesAt, Geometry, Surface};
use crate::lights::{LightGroupMap, LightSampleContext, Lights};
use crate::sampler::Sampler;
use glam::Vec3;
use std::cell::Cell;
use yugen_scene::prepared::{
    GeometryError, Lookup, MaterialError, Materials, Scratch, Shading, ShadingPoint, ShadingSample, Textures,
};
use yugen_scene::{CameraError, Integrator, IntegratorKind, MissingAttribute, Scene, Strategy};

/// A scene ready to be followed by rays.
pub struct World {
    /// Shapes.
    pub geometry: Geometry,
    /// Textures.
    pub textures: Textures,
    /// Materials.
    pub materials: Materials,
    /// Lights.
    pub lights: Lights,
    see_through: bool,
    luminance: Vec3,
}

/// A scene could not be prepared for rendering.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// Shapes.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// Materials.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// Lights.
    #[error(transparent)]
    Light(#[from] crate::lights::LightError),
    /// Attributes of meshes.
    #[error(transparent)]
    Attribute(#[from] MissingAttribute),
    /// A picture too large to keep.
    #[error(
        "a picture of {width} x {height} pixels is more than the {limit} that are rendered at once; give a smaller \
         size, or render parts of it by a crop"
    )]
    TooLarge {
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// Most pixels.
        limit: u64,
    },
    /// A camera that does not exist, or a part of the picture that is not in it.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// Nothing to compare.
    #[error("denoising compares samples of a pixel, and there is one of each; --spp has to be 2 or more")]
    TooFewToDenoise,
    /// More layers than anybody looks at.
    #[error(
        "the lights go by {count} names, and each would get a layer of its own; at most {limit} do: let lights that belong \
         together share a name"
    )]
    TooManyGroups {
        /// Names.
        count: usize,
        /// The most.
        limit: usize,
    },
}

/// What is known about the first surface a camera ray meets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FirstHit {
    /// Hemispherical reflectance, roughly.
    pub albedo: Vec3,
    /// Unit, towards the side of the surface's outside.
    pub normal: Vec3,
    /// Unit, the mean over the material's lobes after interpolation and maps, on the surface's outer side.
    pub shading_normal: Vec3,
    /// Distance from the origin of the camera ray, scene units.
    pub depth: f32,
    /// World position.
    pub position: Vec3,
    /// Surface coordinates.
    pub uv: glam::Vec2,
}

/// What a denoiser is told of a camera ray: which way the first surface faces, and what is seen, be it in that surface
/// or through it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DenoiseFeatures {
    /// What light that falls on it is multiplied by on the way to the eye, roughly; 1 for what shines itself.
    pub albedo: Vec3,
    /// Unit, of the first surface after maps, towards the eye; zero where there is none.
    pub normal: Vec3,
    /// Length of the way to what is seen, scene units.
    pub depth: f32,
    /// 1 where it is a surface, 0 where the ray escaped.
    pub surface: f32,
    /// Nothing that comes later counts.
    pub(crate) done: bool,
}

impl DenoiseFeatures {
    /// Of the ends of paths that are not a camera's.
    pub(crate) fn of_none() -> Self {
        Self { done: true, ..Self::default() }
    }
}

/// Radiance along one camera ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct Radiance {
    /// Linear, working space.
    pub rgb: Vec3,
    /// 1 where the ray met a surface, 0 where it escaped.
    pub alpha: f32,
    /// What of it was clamped away, all colours together.
    pub clamped: f32,
    /// The first surface.
    pub first: FirstHit,
    /// For a denoiser.
    pub features: DenoiseFeatures,
}

impl Radiance {
    /// Adds light of the light number `from` that came by so many bounces.
    #[inline(always)]
    fn add(&mut self, follow: &Follow, bounces: u32, from: u32, light: Vec3) {
        let light = match follow.settings.clamp {
            Some(most) if bounces > 1 && light.max_element() > most => {
                let kept = light * (most / light.max_element());
                self.clamped += (light - kept).element_sum();
                kept
            }
            _ => light,
        };
        self.rgb += light;
        if let Some(groups) = &follow.groups {
            groups.map.add(from, light, groups.sums);
        }
    }

    /// Whether the camera passes lights by: until something has been met that does not let all light straight through.
    fn hides(&self, follow: &Follow) -> bool {
        follow.settings.hide_emitters && self.alpha == 0.0
    }

    /// Notes a surface for a denoiser: until one is met that is no mirror and no smooth glass, each in turn.
    fn see(&mut self, path: &PathState, shading: &Shading, wo: Vec3, shines: bool) {
        let own = if shines { Vec3::ONE } else { shading.albedo() };
        let first = self.features.surface == 0.0;
        self.features = DenoiseFeatures {
            albedo: path.throughput * own,
            normal: if first { shading.normal_towards(wo) } else { self.features.normal },
            depth: path.travelled,
            surface: 1.0,
            done: shines || shading.smooth(),
        };
    }
}

/// Where light is summed by the group that it comes from.
#[derive(Clone, Copy, Debug)]
pub struct Groups<'a> {
    /// Of which group a light is.
    pub map: &'a LightGroupMap,
    /// One for each group.
    pub sums: &'a [Cell<Vec3>],
}

/// How camera rays are followed.
#[derive(Clone, Copy, Debug)]
pub struct Follow<'a> {
    /// What the scene or the caller wants.
    pub settings: &'a Integrator,
    /// Whether the first surface's albedo is wanted.
    pub albedo: bool,
    /// Whether the first surface's shading normal is wanted.
    pub shading_normal: bool,
    /// Whether a denoiser wants to know what is seen.
    pub features: bool,
    /// Light group by group, where that is wanted.
    pub groups: Option<Groups<'a>>,
    /// Footprint of a ray at the camera, scene units.
    pub width: f32,
    /// And how it grows, radians.
    pub spread: f32,
}

impl Follow<'_> {
    pub(crate) fn max_depth(&self) -> u32 {
        match self.settings.kind {
            IntegratorKind::Path => self.settings.max_depth.unwrap_or(u32::MAX),
            IntegratorKind::Direct => 2,
            IntegratorKind::Depth | IntegratorKind::Aov => 0,
        }
    }
}

/// How the ray's footprint grows.
#[derive(Clone, Copy)]
struct Cone {
    width: f32,
    spread: f32,
}

/// The state of a path between two vertices.
#[derive(Clone, Copy)]
pub(crate) struct PathState {
    pub(crate) ray: Ray,
    /// Of the path so far, or since it was last set to one.
    pub(crate) throughput: Vec3,
    /// What the path carried when `throughput` was set to one; it only decides how long the path goes on.
    pub(crate) before: Vec3,
    pub(crate) depth: u32,
    /// Length of the way so far, scene units.
    travelled: f32,
    eta: f32,
    /// Of the body that it goes through, per scene unit.
    absorption: Vec3,
    cone: Cone,
    draw: Draw,
}

/// Where the last direction was drawn and how likely it was; a Dirac peak cannot be found by a light.
#[derive(Clone, Copy)]
struct Draw {
    from: LightSampleContext,
    pdf: f32,
    delta: bool,
}

impl Draw {
    /// Against a light that finds the same direction with density `pdf`. `depth`: of the surface or light found; what
    /// the camera sees needs no looking for.
    fn weight(&self, pdf: f32, strategy: Strategy, depth: u32) -> f32 {
        match strategy {
            Strategy::Both if self.delta => 1.0,
            Strategy::Both => power(self.pdf, pdf),
            // What no light sample finds, an even sky, is found by the material all the same.
            Strategy::Lights if depth > 0 && (self.delta || pdf > 0.0) => 0.0,
            Strategy::Lights | Strategy::Material => 1.0,
        }
    }
}

impl PathState {
    /// A camera ray.
    pub(crate) fn new(follow: &Follow, ray: Ray) -> Self {
        Self {
            ray,
            throughput: Vec3::ONE,
            before: Vec3::ONE,
            depth: 0,
            travelled: 0.0,
            eta: 1.0,
            absorption: Vec3::ZERO,
            cone: Cone { width: follow.width, spread: follow.spread },
            draw: Draw { from: LightSampleContext::eye(ray.origin), pdf: 0.0, delta: true },
        }
    }
}

/// Where a path met a surface.
pub(crate) struct Vertex<'a> {
    pub(crate) surface: Surface,
    pub(crate) shading: Shading<'a>,
    /// Along the ray that came here.
    pub(crate) t: f32,
    pub(crate) wo: Vec3,
    /// For sampling lights.
    context: LightSampleContext,
}

/// Light that arrives at a vertex from one direction.
#[derive(Clone, Copy)]
pub(crate) struct IncidentLight {
    pub(crate) wi: Vec3,
    /// Number of the light, where it comes straight from one.
    pub(crate) from: u32,
    /// Over the density of having looked there.
    pub(crate) radiance: Vec3,
    /// f |cos| of the vertex.
    pub(crate) f: Vec3,
}

impl World {
    /// Prepares `scene`: hierarchy, textures, materials, lights. `want_uv`: texture coordinates are asked for even
    /// if there are no textures.
    pub fn new(scene: &Scene, want_uv: bool) -> Result<Self, PrepareError> {
        let _span = tracing::info_span!("prepare").entered();
        scene.check_attributes()?;
        let mut geometry = tracing::debug_span!("hierarchy").in_scope(|| Geometry::build(scene))?;
        let stats = geometry.stats();
        tracing::debug!("{} triangles, {} bytes of hierarchy", stats.triangles, stats.tree_bytes);
        if !want_uv && scene.textures.is_empty() {
            geometry = geometry.without_uv();
        }
        let textures = tracing::debug_span!("textures").in_scope(|| Textures::new(scene));
        let materials = tracing::debug_span!("materials").in_scope(|| Materials::new(scene))?;
        let lights = tracing::debug_span!("lights").in_scope(|| Lights::new(scene, &geometry, &textures))?;
        let see_through = materials.any_see_through();
        let luminance = scene.working_space.luminance_weights();
        Ok(Self { geometry, textures, materials, lights, see_through, luminance })
    }

    /// Whether any surface lets light straight through.
    pub(crate) fn see_through(&self) -> bool {
        self.see_through
    }

    fn lookup<'a>(&self, hit: &Hit, at: &'a AttributesAt, cone: Cone, ray: &Ray) -> Lookup<'a> {
        let surface = at.surface();
        if !self.textures.filtered() {
            return Lookup { uv: surface.uv, footprint: 0.0, place: Some(at) };
        }
        let width = cone.width + cone.spread * hit.t;
        // Width on the surface, stretched where it is seen at a slant, in units of uv.
        let slant = surface.geometric_normal.dot(ray.dir).abs().max(0.1);
        let per_uv = surface.dp_du.length().min(surface.dp_dv.length()).max(1e-12);
        Lookup { uv: surface.uv, footprint: width / (slant * per_uv), place: Some(at) }
    }

    /// How much light gets from `origin` along `dir` up to `distance`, through at most `layers` surfaces
    /// that let light straight through.
    pub(crate) fn visibility(
        &self,
        origin: Vec3,
        dir: Vec3,
        distance: f32,
        layers: u32,
        scratch: &mut Scratch,
    ) -> f32 {
        let through = self.past_surfaces(origin, dir, distance, layers, scratch);
        if through > 0.0 && self.lights.has_volumes() {
            return through * self.lights.along(origin, dir, distance, 0.0, |_, _| {});
        }
        through
    }

    #[inline(always)]
    fn past_surfaces(
        &self,
        origin: Vec3,
        dir: Vec3,
        distance: f32,
        layers: u32,
        scratch: &mut Scratch,
    ) -> f32 {
        // Leave the light itself out.
        let t_max = if distance.is_finite() { distance * (1.0 - 1e-3) } else { f32::INFINITY };
        let mut ray = Ray { origin, dir, t_min: 0.0, t_max };
        if !self.see_through {
            return if self.geometry.occluded(&ray) { 0.0 } else { 1.0 };
        }
        let mut through = 1.0;
        for _ in 0..=layers.min(64) {
            let Some(hit) = self.geometry.intersect(&ray) else { return through };
            let surface = self.geometry.surface(&ray, &hit);
            if !self.materials.see_through(surface.material) {
                return 0.0;
            }
            let attributes = self.geometry.attributes(&surface);
            let lookup = self.lookup(&hit, &attributes, Cone { width: 0.0, spread: 0.0 }, &ray);
            let point = point(&surface, lookup);
            through *= self.materials.shade(&self.textures, surface.material, &point, -dir, scratch).through;
            if through <= 0.0 {
                return 0.0;
            }
            let origin = surface.offset(dir);
            let left = ray.t_max - hit.t;
            ray = Ray { origin, dir, t_min: 0.0, t_max: left };
        }
        0.0
    }

    /// Light of volume `i` that arrives at `origin` from `dir`, through at most `layers` surfaces that let light
    /// straight through.
    fn light_along(&self, origin: Vec3, dir: Vec3, i: u32, layers: u32, scratch: &mut Scratch) -> Vec3 {
        let (mut light, mut through) = (Vec3::ZERO, 1.0);
        let mut ray = Ray::new(origin, dir);
        for _ in 0..=layers.min(64) {
            let hit = self.geometry.intersect(&ray);
            let until = hit.as_ref().map_or(f32::INFINITY, |hit| hit.t);
            let free = self.lights.along(ray.origin, dir, until, 0.0, |volume, marched| {
                if volume == i {
                    light += through * marched.radiance;
                }
            });
            let Some(hit) = hit else { break };
            let surface = self.geometry.surface(&ray, &hit);
            if !self.materials.see_through(surface.material) {
                break;
            }
            let attributes = self.geometry.attributes(&surface);
            let lookup = self.lookup(&hit, &attributes, Cone { width: 0.0, spread: 0.0 }, &ray);
            let point = point(&surface, lookup);
            let shading = self.materials.shade(&self.textures, surface.material, &point, -dir, scratch);
            through *= free * shading.through;
            if through <= 0.0 {
                break;
            }
            ray = Ray::new(surface.offset(dir), dir);
        }
        light
    }

    /// Adds what volumes send along the ray of `path` before it meets anything at the distance `until`.
    fn volumes(&self, follow: &Follow, path: &mut PathState, until: f32, out: &mut Radiance) {
        if out.hides(follow) {
            return;
        }
        let Ray { origin, dir, .. } = path.ray;
        // Surfaces that let it straight through lie between.
        let behind = if path.draw.delta { 0.0 } else { path.draw.from.position.distance(origin) };
        let seen = path.depth < follow.max_depth();
        path.throughput *= self.lights.along(origin, dir, until, behind, |i, marched| {
            if seen {
                let pdf = marched.pdf * self.lights.chance(&path.draw.from, i);
                let weight = path.draw.weight(pdf, follow.settings.strategy, path.depth);
                out.add(follow, path.depth, i, path.throughput * marched.radiance * weight);
            }
        });
    }

    /// Follows `path` to the next surface. What shines on the way is added to `out`; `None`: the path has ended.
    #[inline(always)]
    pub(crate) fn next_vertex<'a>(
        &'a self,
        follow: &Follow,
        path: &mut PathState,
        scratch: &'a mut Scratch,
        out: &mut Radiance,
    ) -> Option<Vertex<'a>> {
        let max_depth = follow.max_depth();
        loop {
            let hit = self.geometry.intersect(&path.ray);
            if self.lights.has_volumes() {
                self.volumes(follow, path, hit.as_ref().map_or(f32::INFINITY, |hit| hit.t), out);
            }
            let Some(hit) = hit else {
                if path.depth < max_depth && !out.hides(follow) {
                    for (radiance, pdf, from) in self.lights.escaped(&path.draw.from, path.ray.dir) {
                        let weight = path.draw.weight(pdf, follow.settings.strategy, path.depth);
                        let light = path.throughput * radiance * weight;
                        out.add(follow, path.depth, from, light);
                    }
                }
                if follow.features && !out.features.done {
                    (out.features.albedo, out.features.surface) = (path.throughput, 0.0);
                }
                return None;
            };
            path.travelled += hit.t;
            let surface = self.geometry.surface(&path.ray, &hit);
            let attributes = self.geometry.attributes(&surface);
            let lookup = self.lookup(&hit, &attributes, path.cone, &path.ray);
            let wo = -path.ray.dir;
            if path.absorption != Vec3::ZERO {
                path.throughput *= (-hit.t * path.absorption).exp();
            }
            if out.hides(follow) && self.lights.is_emitter(&surface) {
                let origin = surface.offset(path.ray.dir);
                path.ray = Ray { origin, t_max: path.ray.t_max - hit.t, ..path.ray };
                continue;
            }
            let mut shines = false;
            if path.depth < max_depth
                && let Some((i, radiance)) = self.lights.emitted(&self.textures, &surface, &lookup, wo)
            {
                let pdf =
                    if path.draw.delta { 0.0 } else { self.lights.pdf_hit(i, &path.draw.from, &surface) };
                let weight = path.draw.weight(pdf, follow.settings.strategy, path.depth);
                out.add(follow, path.depth, i, path.throughput * radiance * weight);
                shines = radiance != Vec3::ZERO;
            }
            let point = point(&surface, lookup);
            let shading = self.materials.shade(&self.textures, surface.material, &point, wo, scratch);
            if out.alpha == 0.0 && shading.through < 1.0 {
                out.alpha = 1.0;
                out.first = FirstHit {
                    albedo: if follow.albedo { shading.albedo() } else { Vec3::ZERO },
                    normal: surface.geometric_normal,
                    shading_normal: if follow.shading_normal {
                        shading.normal_towards(surface.frame.n)
                    } else {
                        Vec3::ZERO
                    },
                    depth: path.travelled,
                    position: surface.position,
                    uv: surface.uv,
                };
            }
            if follow.features && !out.features.done && shading.through < 1.0 {
                out.see(path, &shading, wo, shines);
            }
            if path.depth + 1 >= max_depth {
                return None;
            }
            let context = self.context(&surface, &shading, wo);
            return Some(Vertex { surface, shading, t: hit.t, wo, context });
        }
    }

    /// What sampling a light needs to know of a surface.
    #[inline(always)]
    fn context(&self, surface: &Surface, shading: &Shading, wo: Vec3) -> LightSampleContext {
        let n = surface.frame.n;
        let facing = if !shading.one_sided() {
            Vec3::ZERO
        } else if n.dot(wo) < 0.0 {
            -n
        } else {
            n
        };
        let reflected = |wi: Vec3| self.luminance.dot(shading.eval_pdf(wi).0);
        let gleams = shading.smooth() && !self.materials.matt(surface.material);
        self.lights.context(surface.position, facing, if gleams { Some(&reflected) } else { None })
    }

    /// Light that comes to `vertex` straight from a light chosen by `u`, over the density of that choice and
    /// weighed against finding it by the material.
    #[inline(always)]
    pub(crate) fn light(
        &self,
        follow: &Follow,
        path: &PathState,
        vertex: &Vertex,
        u: [f32; 4],
        for_shadows: &mut Scratch,
    ) -> Option<IncidentLight> {
        if !vertex.shading.smooth() || follow.settings.strategy == Strategy::Material {
            return None;
        }
        let light = self.lights.sample(&self.textures, &vertex.context, u)?;
        let (f, pdf) = vertex.shading.eval_pdf(light.wi);
        if f == Vec3::ZERO {
            return None;
        }
        let origin = vertex.surface.offset(light.wi);
        let layers = (follow.max_depth() - path.depth).saturating_sub(2);
        let alone = light.delta || follow.settings.strategy == Strategy::Lights;
        let weight = if alone { 1.0 } else { power(light.pdf, pdf) };
        let radiance = if let Some(i) = light.volume() {
            self.light_along(origin, light.wi, i, layers, for_shadows) * (weight / light.pdf)
        } else {
            let through = self.visibility(origin, light.wi, light.distance, layers, for_shadows);
            if through <= 0.0 {
                return None;
            }
            self.lights.radiance(&light) * (weight * through / light.pdf)
        };
        Some(IncidentLight { wi: light.wi, from: light.light, radiance, f })
    }

    /// Goes on from `vertex` into the direction `s`, if `u` finds it worth it: then one over the chance that it gave.
    #[inline(always)]
    pub(crate) fn scatter(
        &self,
        follow: &Follow,
        path: &mut PathState,
        vertex: &Vertex,
        s: &ShadingSample,
        u: f32,
    ) -> Option<f32> {
        path.throughput *= s.weight;
        if path.throughput == Vec3::ZERO {
            return None;
        }
        path.eta *= s.eta;
        path.cone.width += path.cone.spread * vertex.t;
        if let Some(absorption) = vertex.shading.body {
            let n = vertex.surface.geometric_normal;
            if n.dot(vertex.wo) * n.dot(s.wi) < 0.0 {
                path.absorption = if n.dot(s.wi) < 0.0 { absorption } else { Vec3::ZERO };
            }
        }
        if !s.null {
            path.draw = Draw { from: vertex.context, pdf: s.pdf, delta: s.delta };
            if !s.delta {
                // A rough bounce spreads the footprint like a lobe of that density.
                path.cone.spread = path.cone.spread.max((1.0 / (4.0 * s.pdf.max(0.05))).sqrt().min(0.5));
            }
        }
        path.ray = vertex.surface.spawn(s.wi);
        path.depth += 1;
        if path.depth >= follow.settings.rr_depth {
            // As in Mitsuba: undo the radiance scaling of refraction, never be certain to go on.
            let carried = (path.before * path.throughput).max_element();
            let survive = (carried * path.eta * path.eta).min(0.95);
            if u >= survive {
                return None;
            }
            path.throughput /= survive;
            return Some(1.0 / survive);
        }
        Some(1.0)
    }

    /// All light along `path` from here on, added to `out`. The memory is for textured parameters of surfaces
    /// and of surfaces that shadow rays pass through.
    pub(crate) fn radiance(
        &self,
        follow: &Follow,
        path: &mut PathState,
        sampler: &mut Sampler,
        [scratch, for_shadows]: [&mut Scratch; 2],
        out: &mut Radiance,
    ) {
        while let Some(vertex) = self.next_vertex(follow, path, scratch, out) {
            if self.bounce(follow, path, &vertex, sampler, for_shadows, out).is_none() {
                break;
            }
        }
    }

    /// The same from a `vertex` that it has already met.
    pub(crate) fn radiance_from(
        &self,
        follow: &Follow,
        path: &mut PathState,
        vertex: &Vertex,
        sampler: &mut Sampler,
        [scratch, for_shadows]: [&mut Scratch; 2],
        out: &mut Radiance,
    ) {
        if self.bounce(follow, path, vertex, sampler, for_shadows, out).is_some() {
            self.radiance(follow, path, sampler, [scratch, for_shadows], out);
        }
    }

    /// Adds the light of one light at `vertex` and goes on into a direction that it draws, if anywhere: that
    /// direction, and one over the chance of having gone on.
    #[inline(always)]
    pub(crate) fn bounce(
        &self,
        follow: &Follow,
        path: &mut PathState,
        vertex: &Vertex,
        sampler: &mut Sampler,
        for_shadows: &mut Scratch,
        out: &mut Radiance,
    ) -> Option<(ShadingSample, f32)> {
        sampler.at_vertex(path.depth);
        let (u_light, u_bsdf) = (sampler.next_4d(), sampler.next_4d());
        if let Some(incident) = self.light(follow, path, vertex, u_light, for_shadows) {
            out.add(follow, path.depth + 1, incident.from, path.throughput * incident.f * incident.radiance);
        }
        let s = vertex.shading.sample(u_bsdf, vertex.wo)?;
        let boost = self.scatter(follow, path, vertex, &s, u_bsdf[3])?;
        Some((s, boost))
    }
}

fn point<'a>(surface: &Surface, lookup: Lookup<'a>) -> ShadingPoint<'a> {
    ShadingPoint {
        frame: surface.frame,
        handedness: surface.handedness,
        normal: surface.geometric_normal,
        dp: [surface.dp_du, surface.dp_dv],
        lookup,
    }
}

/// The power heuristic with exponent two.
fn power(a: f32, b: f32) -> f32 {
    let (a2, b2) = (a * a, b * b);
    if a2.is_infinite() {
        return 1.0;
    }
    if a2 > 0.0 { a2 / (a2 + b2) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_scene::prepared::scratch;

    /// What a ray along −z sees that meets these shapes first and then a wall at z = −2, 5 from where it starts.
    fn seen(shapes: &str) -> Radiance {
        let text = format!(
            "[camera]\nfrom = [0, 0, 3]\nto = [0, 0, 0]\n[material.open]\nmodel = \"lambert\"\nopacity = 0\n\
             {shapes}[[shape]]\ntype = \"rectangle\"\nsize = [9, 9]\nat = [0, 0, -2]\n[[light]]\ntype = \"constant\"\n"
        );
        let path =
            std::env::temp_dir().join(format!("yugen-seen-{}-{}.toml", std::process::id(), shapes.len()));
        std::fs::write(&path, text).unwrap();
        let scene = yugen_archive::formats::load_scene(&path, &Default::default()).unwrap();
        std::fs::remove_file(&path).unwrap();
        let world = World::new(&scene, false).unwrap();
        let settings = Integrator::default();
        let follow = Follow {
            settings: &settings,
            albedo: true,
            shading_normal: true,
            features: true,
            groups: None,
            width: 0.0,
            spread: 0.0,
        };
        let mut path = PathState::new(&follow, Ray::new(Vec3::new(0.1, 0.2, 3.0), -Vec3::Z));
        let (mut sampler, mut out) = (Sampler::new(0, 0, 0, 1), Radiance::default());
        world.radiance(&follow, &mut path, &mut sampler, [&mut scratch(), &mut scratch()], &mut out);
        out
    }

    #[test]
    fn what_is_open_hides_neither_normal_nor_distance_of_what_is_behind() {
        let pane = "[[shape]]\ntype = \"rectangle\"\nsize = [2, 2]\nmaterial = \"open\"\n";
        let plain = seen("");
        assert!((plain.first.depth - 5.0).abs() < 1e-5 && (plain.features.depth - 5.0).abs() < 1e-5);
        for open in
            [pane.to_string(), pane.to_string() + &pane.replace("material", "at = [0, 0, -1]\nmaterial")]
        {
            let behind = seen(&open);
            assert!((behind.first.depth - 5.0).abs() < 1e-4, "{}", behind.first.depth);
            assert!((behind.features.depth - 5.0).abs() < 1e-4, "{}", behind.features.depth);
            assert_eq!(behind.first.shading_normal, Vec3::Z);
            assert_eq!(
                (behind.features.normal, behind.features.albedo),
                (plain.features.normal, plain.features.albedo)
            );
        }
    }
}
