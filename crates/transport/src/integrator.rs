//! Light along one camera ray: path tracing with multiple importance sampling.
//!
//! Kajiya 1986, "The Rendering Equation"; Veach 1997, "Robust Monte Carlo Methods for Light Transport
//! Simulation" (power heuristic). At every vertex one light and one direction of the material are drawn.

use crate::accel::{Hit, Ray};
use crate::geometry::{Geometry, Surface};
use crate::lights::Lights;
use crate::material::{Materials, Point, Scratch};
use crate::sampler::Sampler;
use crate::texture::{Lookup, Textures};
use glam::Vec3;
use yugen_archive::scene::{Integrator, IntegratorKind, Scene};

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
}

/// A scene could not be prepared for rendering.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// Shapes.
    #[error(transparent)]
    Geometry(#[from] crate::geometry::BuildError),
    /// Materials.
    #[error(transparent)]
    Material(#[from] crate::material::MaterialError),
    /// Lights.
    #[error(transparent)]
    Light(#[from] crate::lights::LightError),
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
    /// A camera called that does not exist.
    #[error("there is no camera called '{name}' (the scene has {known})")]
    UnknownCamera {
        /// The name asked for.
        name: String,
        /// Those there are.
        known: String,
    },
}

/// What is known about the first surface a camera ray meets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FirstHit {
    /// Hemispherical reflectance, roughly.
    pub albedo: Vec3,
    /// Unit, towards the side of the surface's outside.
    pub normal: Vec3,
    /// After interpolation and maps.
    pub shading_normal: Vec3,
    /// Distance along the ray.
    pub depth: f32,
    /// World position.
    pub position: Vec3,
    /// Surface coordinates.
    pub uv: glam::Vec2,
}

/// Radiance along one camera ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct Radiance {
    /// Linear, working space.
    pub rgb: Vec3,
    /// 1 where the ray met a surface, 0 where it escaped.
    pub alpha: f32,
    /// The first surface.
    pub first: FirstHit,
}

/// How camera rays are followed.
#[derive(Clone, Copy, Debug)]
pub struct Follow<'a> {
    /// What the scene or the caller wants.
    pub settings: &'a Integrator,
    /// Whether the first surface's albedo is wanted.
    pub albedo: bool,
    /// Footprint of a ray at the camera, scene units.
    pub width: f32,
    /// And how it grows, radians.
    pub spread: f32,
}

/// How the ray's footprint grows.
#[derive(Clone, Copy)]
struct Cone {
    width: f32,
    spread: f32,
}

impl World {
    /// Prepares `scene`: hierarchy, textures, materials, lights. `want_uv`: texture coordinates are asked for even
    /// if there are no textures.
    pub fn new(scene: &Scene, want_uv: bool) -> Result<Self, PrepareError> {
        let mut geometry = Geometry::build(scene)?;
        if !want_uv && scene.textures.is_empty() {
            geometry = geometry.without_uv();
        }
        let textures = Textures::new(scene);
        let materials = Materials::new(scene)?;
        let lights = Lights::new(scene, &geometry, &textures)?;
        let see_through = materials.any_see_through();
        Ok(Self { geometry, textures, materials, lights, see_through })
    }

    fn lookup<'a>(&'a self, hit: &Hit, surface: &'a Surface, cone: Cone, ray: &Ray) -> Lookup<'a> {
        if !self.textures.filtered() {
            return Lookup { uv: surface.uv, footprint: 0.0, surface: Some((&self.geometry, surface)) };
        }
        let width = cone.width + cone.spread * hit.t;
        // Width on the surface, stretched where it is seen at a slant, in units of uv.
        let slant = surface.geometric_normal.dot(ray.dir).abs().max(0.1);
        let per_uv = surface.dp_du.length().min(surface.dp_dv.length()).max(1e-12);
        Lookup {
            uv: surface.uv,
            footprint: width / (slant * per_uv),
            surface: Some((&self.geometry, surface)),
        }
    }

    /// How much light gets from `origin` along `dir` up to `distance`; walks through at most `layers` surfaces
    /// that let light straight through.
    fn visibility(&self, origin: Vec3, dir: Vec3, distance: f32, layers: u32, room: &mut Scratch) -> f32 {
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
            let lookup = self.lookup(&hit, &surface, Cone { width: 0.0, spread: 0.0 }, &ray);
            let point = point(&surface, lookup);
            through *=
                self.materials.shade(&self.textures, surface.material, &point, -dir, room).through;
            if through <= 0.0 {
                return 0.0;
            }
            let origin = surface.offset(dir);
            let left = ray.t_max - hit.t;
            ray = Ray { origin, dir, t_min: 0.0, t_max: left };
        }
        0.0
    }

    /// Radiance along `ray`. The rooms are for textured parameters, of surfaces met and of surfaces that shadow rays
    /// pass through.
    pub fn radiance(
        &self,
        follow: &Follow,
        ray: Ray,
        sampler: &mut Sampler,
        [room, room_between]: &mut [Scratch; 2],
    ) -> Radiance {
        let settings = follow.settings;
        let max_depth = match settings.kind {
            IntegratorKind::Path => settings.max_depth.unwrap_or(u32::MAX),
            IntegratorKind::Direct => 2,
            IntegratorKind::Depth | IntegratorKind::Aov => 0,
        };
        let mut out = Radiance::default();
        let mut cone = Cone { width: follow.width, spread: follow.spread };
        let mut ray = ray;
        let mut throughput = Vec3::ONE;
        let mut eta = 1.0f32;
        let mut depth = 0u32;
        // Where the last direction was drawn, and how likely it was; a Dirac peak cannot be found by a light.
        let mut origin_of_draw = ray.origin;
        let mut draw_pdf = 0.0f32;
        let mut draw_delta = true;
        loop {
            let hit = self.geometry.intersect(&ray);
            let Some(hit) = hit else {
                if depth < max_depth && !(settings.hide_emitters && draw_delta && out.alpha == 0.0) {
                    for (radiance, pdf) in self.lights.escaped(origin_of_draw, ray.dir) {
                        let weight = if draw_delta { 1.0 } else { power(draw_pdf, pdf) };
                        out.rgb += throughput * radiance * weight;
                    }
                }
                break;
            };
            let surface = self.geometry.surface(&ray, &hit);
            let lookup = self.lookup(&hit, &surface, cone, &ray);
            let wo = -ray.dir;
            let emitted = self.lights.emitted(&self.textures, &surface, &lookup, wo);
            if settings.hide_emitters && depth == 0 && self.lights.is_emitter(&surface) {
                ray = Ray { origin: surface.offset(ray.dir), t_max: ray.t_max - hit.t, ..ray };
                continue;
            }
            if let Some((i, radiance)) = emitted.filter(|_| depth < max_depth) {
                let weight = if draw_delta {
                    1.0
                } else {
                    power(draw_pdf, self.lights.pdf_hit(i, origin_of_draw, &surface))
                };
                out.rgb += throughput * radiance * weight;
            }
            let point = point(&surface, lookup);
            let shading = self.materials.shade(&self.textures, surface.material, &point, wo, room);
            if out.alpha == 0.0 && shading.through < 1.0 {
                out.alpha = 1.0;
                out.first = FirstHit {
                    albedo: if follow.albedo { shading.albedo() } else { Vec3::ZERO },
                    normal: surface.geometric_normal,
                    shading_normal: surface.frame.n,
                    depth: hit.t,
                    position: surface.position,
                    uv: surface.uv,
                };
            }
            if depth + 1 >= max_depth {
                break;
            }

            sampler.at_vertex(depth);
            let u_light = sampler.next_4d();
            let u_bsdf = sampler.next_4d();

            if shading.smooth()
                && let Some(light) = self.lights.sample(&self.textures, surface.position, u_light)
            {
                let (f, pdf) = shading.eval_pdf(light.wi);
                if f != Vec3::ZERO {
                    let origin = surface.offset(light.wi);
                    let layers = (max_depth - depth).saturating_sub(2);
                    let through = self.visibility(origin, light.wi, light.distance, layers, room_between);
                    if through > 0.0 {
                        let weight = if light.delta { 1.0 } else { power(light.pdf, pdf) };
                        let radiance = self.lights.radiance(&light);
                        out.rgb += throughput * f * radiance * (weight * through / light.pdf);
                    }
                }
            }

            let Some(s) = shading.sample(u_bsdf, wo) else { break };
            throughput *= s.weight;
            if throughput == Vec3::ZERO {
                break;
            }
            eta *= s.eta;
            cone.width += cone.spread * hit.t;
            if !s.null {
                origin_of_draw = surface.position;
                draw_pdf = s.pdf;
                draw_delta = s.delta;
                if !s.delta {
                    // A rough bounce spreads the footprint like a lobe of that density.
                    cone.spread = cone.spread.max((1.0 / (4.0 * s.pdf.max(0.05))).sqrt().min(0.5));
                }
            }
            ray = surface.spawn(s.wi);
            depth += 1;

            if depth >= settings.rr_depth {
                // As in Mitsuba: undo the radiance scaling of refraction, never be certain to go on.
                let survive = (throughput.max_element() * eta * eta).min(0.95);
                if u_bsdf[3] >= survive {
                    break;
                }
                throughput /= survive;
            }
        }
        if settings.kind == IntegratorKind::Depth {
            out.rgb = Vec3::splat(out.first.depth);
        }
        out
    }
}

fn point<'a>(surface: &Surface, lookup: Lookup<'a>) -> Point<'a> {
    Point {
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
