//! All lights of a scene: which to ask, where on it, and how likely that was.
//!
//! A light is chosen in proportion to the irradiance it could send to the point that asks, and to what a gleaming
//! surface makes of it (all of them are looked at while they are few, a fixed distribution is used when they are many),
//! then a direction towards it by its own best density: the cone of a sphere, the spherical rectangle of a quad, what is bright in an environment.

use crate::accel::NO_INSTANCE;
use crate::geometry::{Geometry, ShapeSampler, Surface};
use glam::{Vec2, Vec3};
use std::cell::Cell;
use std::f32::consts::PI;
use yugen_optics::distribution;
use yugen_scene::prepared::{BadEnvironment, DiracLight, EmitterInGroup, Environment, GeometryError};
use yugen_scene::prepared::{LightSource, LightSources, Lookup, Marched, OnTriangle, Textures, Volume};
use yugen_scene::prepared::{chances_by_power, mean_radiance};
use yugen_scene::{Light, Scene, Value};

/// Above this many lights a fixed distribution replaces the look at each.
const FEW: usize = 16;

/// A direction towards a light.
pub struct LightSample {
    /// Unit, away from the point that is lit.
    pub wi: Vec3,
    /// How far the way must be free.
    pub distance: f32,
    emission: Emission,
    /// Which of the lights, for [`LightGroupMap`].
    pub light: u32,
    /// Solid-angle density times the probability of the light; for a Dirac light the probability alone.
    pub pdf: f32,
    /// Only this one direction exists: a material cannot find it by chance.
    pub delta: bool,
}

/// What a light sample brings, or where to look it up once nothing stands in its way: a large picture is far away
/// in memory.
enum Emission {
    This(Vec3),
    /// Emitter and cell of an environment.
    Cell(u32, Vec2),
    /// Emitter that is a volume: what it sends lies all along the way.
    Along(u32),
}

impl LightSample {
    /// The emitter, where light comes from all along the way.
    pub fn volume(&self) -> Option<u32> {
        if let Emission::Along(i) = self.emission { Some(i) } else { None }
    }

    fn times(mut self, factor: Vec3) -> Self {
        if let Emission::This(radiance) = &mut self.emission {
            *radiance *= factor;
        }
        self
    }
}

/// The light that comes from beyond everything, the same from all around.
pub(crate) const BACKGROUND: u32 = u32::MAX;

/// Which group each light belongs to.
#[derive(Clone, Debug, Default)]
pub struct LightGroupMap {
    names: Vec<String>,
    of_emitters: Vec<u32>,
    /// What part of each colour of the background a group has.
    of_background: Vec<(u32, Vec3)>,
}

impl LightGroupMap {
    /// The groups' names.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Gives `light` of the light number `from` to the sums of the groups.
    pub(crate) fn add(&self, from: u32, light: Vec3, sums: &[Cell<Vec3>]) {
        let to = |group: u32, light: Vec3| {
            if let Some(sum) = sums.get(group as usize) {
                sum.set(sum.get() + light);
            }
        };
        if from == BACKGROUND {
            self.of_background.iter().for_each(|(group, part)| to(*group, light * *part));
        } else if let Some(group) = self.of_emitters.get(from as usize) {
            to(*group, light);
        }
    }
}

enum Emitter {
    Area { sampler: Box<ShapeSampler>, radiance: Value, two_sided: bool, mean: f32, centre: Vec3 },
    Dirac(DiracLight),
    Environment(Box<Environment>),
    Volume(Box<Volume>),
}

/// A point for which a light is sampled, and what is known of it (pbrt's name).
#[derive(Clone, Copy, Debug)]
pub struct LightSampleContext {
    /// World position.
    pub position: Vec3,
    /// Unit normal on the side that light has to come to; zero: light from all around counts.
    pub facing: Vec3,
    /// The chance of each light and those before it to be sampled, while they are few.
    chances: [f32; FEW],
}

impl LightSampleContext {
    /// The eye, for which no light is sampled.
    pub fn eye(position: Vec3) -> Self {
        Self { position, facing: Vec3::ZERO, chances: [0.0; FEW] }
    }
}

/// A rough estimate of what a light could send to a point.
struct LightEstimate {
    /// On a surface that faces it.
    irradiance: f32,
    /// What part of that the side that the point faces gets.
    turned: f32,
    /// Towards its middle; none for light from all around.
    direction: Option<Vec3>,
}

/// The lights of a scene.
pub struct Lights {
    emitters: Vec<Emitter>,
    /// Emitter of each shape, by the shape's index.
    of_shape: Vec<Option<u32>>,
    /// Emitters that are environments.
    environments: Vec<u32>,
    /// Emitters that are volumes.
    volumes: Vec<u32>,
    /// Radiance from all around. Nothing finds it better than the directions that a material draws by itself, so it
    /// is not among those that are sampled.
    background: Vec3,
    /// Of many lights: the chance that each or one before it is chosen.
    fixed: Option<Vec<f32>>,
    luminance: Vec3,
    map: LightGroupMap,
}

/// A scene's lights could not be prepared.
#[derive(Debug, thiserror::Error)]
pub enum LightError {
    /// A shape that cannot be sampled.
    #[error(transparent)]
    Shape(#[from] GeometryError),
    /// Emission on shapes inside a group.
    #[error(transparent)]
    EmitterInGroup(#[from] EmitterInGroup),
    /// An environment picture without pixels or colours.
    #[error(transparent)]
    Environment(#[from] BadEnvironment),
}

impl Lights {
    /// Prepares the lights of `scene`.
    pub fn new(scene: &Scene, geometry: &Geometry, textures: &Textures) -> Result<Self, LightError> {
        let luminance = scene.working_space.luminance_weights();
        let LightSources { sources, background } = LightSources::new(scene)?;
        let groups = scene.light_groups();
        let mut map = LightGroupMap { names: groups.names, ..LightGroupMap::default() };
        let mut emitters = Vec::new();
        let mut of_shape = vec![None; scene.shapes.len()];
        for source in sources {
            let (emitter, group) = match source {
                LightSource::Surface { shape, radiance, two_sided } => {
                    // A mesh without area sends nothing.
                    let Some(sampler) = ShapeSampler::new(&scene.shapes[shape])? else { continue };
                    let sampler =
                        if matches!(radiance, Value::Texture(_)) { sampler } else { sampler.without_uv() };
                    of_shape[shape] = Some(emitters.len() as u32);
                    // The mean of a few points: all that choosing a light needs.
                    let corners = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]];
                    let points = corners.map(|u| sampler.sample_area(Vec2::from_array(u)).position);
                    let emitter = Emitter::Area {
                        sampler: Box::new(sampler),
                        radiance: radiance.clone(),
                        two_sided,
                        mean: mean_radiance(radiance, textures, luminance),
                        centre: points.iter().sum::<Vec3>() / 4.0,
                    };
                    (emitter, groups.of_shapes[shape].unwrap_or(0))
                }
                LightSource::Dirac { light, dirac } => (Emitter::Dirac(dirac), groups.of_lights[light]),
                LightSource::Environment { light, image, scale, to_world } => {
                    let environment = Environment::new(image, scale, to_world, luminance)?;
                    (Emitter::Environment(Box::new(environment)), groups.of_lights[light])
                }
                // Volumes were not divided.
                LightSource::Slab { .. } => continue,
                LightSource::Volume { light, grid, scale, to_world } => {
                    let volume = Volume::new(grid, scale, to_world, luminance);
                    (Emitter::Volume(Box::new(volume)), groups.of_lights[light])
                }
            };
            emitters.push(emitter);
            map.of_emitters.push(group);
        }
        for (light, group) in scene.lights.iter().zip(groups.of_lights) {
            if let Light::Constant { radiance } = light {
                let part = Vec3::select(background.cmpgt(Vec3::ZERO), *radiance / background, Vec3::ZERO);
                map.of_background.push((group, part));
            }
        }
        let which = |kind: fn(&Emitter) -> bool| {
            emitters.iter().enumerate().filter(|(_, e)| kind(e)).map(|(i, _)| i as u32).collect()
        };
        let environments = which(|e| matches!(e, Emitter::Environment(_)));
        let volumes = which(|e| matches!(e, Emitter::Volume(_)));
        let mut lights =
            Self { emitters, of_shape, environments, volumes, background, fixed: None, luminance, map };
        if lights.emitters.len() > FEW {
            let bounds = geometry.bounds();
            let position = (bounds.lo + bounds.hi) * 0.5;
            let middle = LightSampleContext::eye(position);
            let reach = (bounds.hi - bounds.lo).length() * 0.25;
            let power: Vec<f32> =
                (0..lights.emitters.len()).map(|i| lights.estimate(i, &middle, reach).irradiance).collect();
            lights.fixed = Some(chances_by_power(&power));
        }
        Ok(lights)
    }

    /// A point that asks for light. `reflected`: luminance of f |cos θ| of its surface towards a direction, where
    /// that says more than the side it faces.
    pub fn context(
        &self,
        position: Vec3,
        facing: Vec3,
        reflected: Option<&dyn Fn(Vec3) -> f32>,
    ) -> LightSampleContext {
        let mut to = LightSampleContext { position, facing, chances: [0.0; FEW] };
        let n = self.emitters.len();
        if !(2..=FEW).contains(&n) {
            return to;
        }
        let (mut bright, mut seen) = ([0.0; FEW], [0.0; FEW]);
        for i in 0..n {
            let estimate = self.estimate(i, &to, 0.0);
            bright[i] = estimate.irradiance * estimate.turned;
            seen[i] = match (reflected, estimate.direction) {
                (Some(f), Some(direction)) => estimate.irradiance * f(direction),
                // As if matt.
                _ => bright[i] * (1.0 / PI),
            };
        }
        // A twentieth to all alike, another to what is bright whatever the surface makes of its middle: the rest is a
        // guess.
        let sum = |w: &[f32; FEW]| w[..n].iter().sum::<f32>().max(1e-30);
        let (of_bright, of_seen) = (0.05 / sum(&bright), 0.9 / sum(&seen));
        let even = 0.05 / n as f32;
        let chances = (0..n).map(|i| f64::from(even + of_bright * bright[i] + of_seen * seen[i]));
        distribution::accumulate(chances, &mut to.chances[..n]);
        to
    }

    /// What emitter `i` could send to `to` and light samples have to find, roughly; distances are not taken smaller
    /// than `reach`.
    fn estimate(&self, i: usize, to: &LightSampleContext, reach: f32) -> LightEstimate {
        let near2 = (reach * reach).max(1e-12);
        // A source of that irradiance head on towards `way`, and the sine of its half angle.
        let from = |irradiance: f32, way: Vec3, sine: f32| {
            let direction = way.normalize_or_zero();
            let turned = if to.facing == Vec3::ZERO {
                1.0
            } else {
                ((to.facing.dot(direction) + sine) / (1.0 + sine)).clamp(0.0, 1.0)
            };
            LightEstimate { irradiance, turned, direction: Some(direction) }
        };
        let distance2 = |p: Vec3| to.position.distance_squared(p).max(near2);
        match &self.emitters[i] {
            Emitter::Area { sampler, mean, centre, .. } => {
                let area = sampler.area();
                let distance2 = distance2(*centre);
                // Half of what a small source of this area would give head on, never more than the hemisphere.
                let irradiance = mean * (area / (distance2 + area * 0.25)).min(PI);
                from(irradiance, *centre - to.position, (area / distance2).sqrt().min(1.0))
            }
            Emitter::Dirac(
                DiracLight::Point { position, intensity } | DiracLight::Spot { position, intensity, .. },
            ) => from(self.luminance.dot(*intensity) / distance2(*position), *position - to.position, 0.0),
            Emitter::Dirac(DiracLight::Directional { irradiance, direction }) => {
                from(self.luminance.dot(*irradiance), -*direction, 0.0)
            }
            Emitter::Volume(v) => {
                let (d2, r2) = (distance2(v.centre), v.radius * v.radius);
                from(v.intensity / (d2 + r2), v.centre - to.position, (2.0 * r2 / (d2 + r2)).sqrt().min(1.0))
            }
            Emitter::Environment(e) => {
                LightEstimate { irradiance: e.irradiance(to.facing), turned: 1.0, direction: None }
            }
            Emitter::Dirac(DiracLight::Projector { position, scale, .. }) => {
                from(PI * scale / distance2(*position), *position - to.position, 0.0)
            }
        }
    }

    /// The chance of each light and those before it to be sampled for `to`.
    fn chances<'a>(&'a self, to: &'a LightSampleContext) -> &'a [f32] {
        self.fixed.as_deref().unwrap_or_else(|| &to.chances[..self.emitters.len()])
    }

    /// Chooses an emitter for `to`: its index and probability.
    fn choose(&self, to: &LightSampleContext, u: f32) -> Option<(usize, f32)> {
        match self.emitters.len() {
            0 => None,
            1 => Some((0, 1.0)),
            _ => {
                let (i, _, probability) = distribution::choose(self.chances(to), u);
                Some((i, probability))
            }
        }
    }

    fn probability(&self, to: &LightSampleContext, i: usize) -> f32 {
        if self.emitters.len() == 1 { 1.0 } else { distribution::probability(self.chances(to), i) }
    }

    /// A direction from `to` to some light; `u` chooses the light with `u[2]` and the place with the others.
    #[inline]
    pub fn sample(&self, textures: &Textures, to: &LightSampleContext, u: [f32; 4]) -> Option<LightSample> {
        let (i, probability) = self.choose(to, u[2])?;
        let p = to.position;
        let uv = Vec2::new(u[0], u[1]);
        let dirac = |position: Vec3, intensity: Vec3| {
            let to = position - p;
            let d2 = to.length_squared();
            let distance = d2.sqrt();
            LightSample {
                wi: to / distance,
                distance,
                emission: Emission::This(intensity / d2),
                light: i as u32,
                pdf: probability,
                delta: true,
            }
        };
        let sample = match &self.emitters[i] {
            Emitter::Area { sampler, radiance, two_sided, .. } => {
                let s = sampler.sample(p, uv)?;
                let to = s.position - p;
                let distance = to.length();
                let wi = to / distance;
                let facing = -wi.dot(s.normal);
                if s.pdf <= 0.0 || distance <= 0.0 || (facing <= 0.0 && !two_sided) {
                    return None;
                }
                let place = sampler.mesh_of().map(|mesh| OnTriangle {
                    mesh,
                    triangle: s.primitive,
                    barycentric: s.barycentric,
                });
                let place = place.as_ref().map(|place| place as _);
                let at = Lookup { uv: s.uv, footprint: 0.0, place };
                LightSample {
                    wi,
                    distance,
                    emission: Emission::This(textures.rgb(radiance, &at)),
                    light: i as u32,
                    pdf: s.pdf * probability,
                    delta: false,
                }
            }
            Emitter::Dirac(DiracLight::Point { position, intensity }) => dirac(*position, *intensity),
            Emitter::Dirac(DiracLight::Spot { position, to_local, intensity, beam, cutoff, texture }) => {
                let s = dirac(*position, Vec3::ONE);
                let local = (*to_local * -s.wi).normalize();
                let angle = local.z.clamp(-1.0, 1.0).acos();
                if angle >= *cutoff {
                    return None;
                }
                let mut intensity = *intensity;
                if angle > *beam {
                    intensity *= (cutoff - angle) / (cutoff - beam);
                }
                if let Some(texture) = texture {
                    let half = cutoff.tan();
                    let uv = Vec2::new(
                        0.5 + 0.5 * local.x / (local.z * half),
                        0.5 + 0.5 * local.y / (local.z * half),
                    );
                    let texture = Value::Texture(*texture);
                    intensity *= textures.rgb(&texture, &Lookup { uv, footprint: 0.0, place: None });
                }
                s.times(intensity)
            }
            Emitter::Dirac(DiracLight::Directional { direction, irradiance }) => LightSample {
                wi: -*direction,
                distance: f32::INFINITY,
                emission: Emission::This(*irradiance),
                light: i as u32,
                pdf: probability,
                delta: true,
            },
            Emitter::Environment(e) => {
                let (wi, pdf, cell) = e.sample(to.facing, uv)?;
                let emission = Emission::Cell(i as u32, cell);
                LightSample {
                    wi,
                    distance: f32::INFINITY,
                    emission,
                    light: i as u32,
                    pdf: pdf * probability,
                    delta: false,
                }
            }
            Emitter::Volume(v) => {
                let wi = (v.sample([u[0], u[1], u[3]])? - p).try_normalize()?;
                // Of all ways in which the direction is found, not of the one point.
                let pdf = v.march(p, wi, 0.0, 0.0).pdf;
                if pdf.is_nan() || pdf <= 0.0 {
                    return None;
                }
                LightSample {
                    wi,
                    distance: f32::INFINITY,
                    emission: Emission::Along(i as u32),
                    light: i as u32,
                    pdf: pdf * probability,
                    delta: false,
                }
            }
            Emitter::Dirac(DiracLight::Projector { to_local, position, axis, texture, scale, half }) => {
                let local = to_local.transform_point3(p);
                let uv = Vec2::new(
                    0.5 - 0.5 * local.x / (local.z * half.x),
                    0.5 - 0.5 * local.y / (local.z * half.y),
                );
                if local.z <= 0.0 || uv.min_element() < 0.0 || uv.max_element() > 1.0 {
                    return None;
                }
                let s = dirac(*position, Vec3::ONE);
                // The picture is π times the irradiance it throws on a wall at distance 1, as in Mitsuba:
                // intensity falls with 1/cos³ so that the wall is lit evenly.
                let cos = -axis.dot(s.wi);
                let picture =
                    textures.rgb(&Value::Texture(*texture), &Lookup { uv, footprint: 0.0, place: None });
                s.times(picture * (PI * scale / (cos * cos * cos)))
            }
        };
        Some(sample)
    }

    /// Which group each light belongs to.
    pub fn group_map(&self) -> &LightGroupMap {
        &self.map
    }

    /// Radiance that the surface a ray met sends back along it.
    #[inline]
    pub fn emitted(
        &self,
        textures: &Textures,
        surface: &Surface,
        lookup: &Lookup,
        wo: Vec3,
    ) -> Option<(u32, Vec3)> {
        if surface.instance != NO_INSTANCE {
            return None;
        }
        let i = (*self.of_shape.get(surface.shape as usize)?)?;
        let Emitter::Area { radiance, two_sided, .. } = &self.emitters[i as usize] else { return None };
        if !two_sided && surface.frame.n.dot(wo) <= 0.0 {
            return None;
        }
        Some((i, textures.rgb(radiance, lookup)))
    }

    /// Whether the surface's shape emits light.
    pub fn is_emitter(&self, surface: &Surface) -> bool {
        surface.instance == NO_INSTANCE
            && self.of_shape.get(surface.shape as usize).is_some_and(Option::is_some)
    }

    /// Density with which `sample` for `to` finds `surface`, which is on emitter `i`.
    pub fn pdf_hit(&self, i: u32, to: &LightSampleContext, surface: &Surface) -> f32 {
        let Emitter::Area { sampler, .. } = &self.emitters[i as usize] else { return 0.0 };
        sampler.pdf(to.position, surface) * self.probability(to, i as usize)
    }

    /// Radiance from infinity along `direction`, light by light, its number and the density with which `sample` for `to` finds
    /// that direction on it.
    pub fn escaped(
        &self,
        to: &LightSampleContext,
        direction: Vec3,
    ) -> impl Iterator<Item = (Vec3, f32, u32)> + '_ {
        let to = *to;
        let environments = self.environments.iter().filter_map(move |&i| {
            let Emitter::Environment(e) = &self.emitters[i as usize] else { return None };
            let (radiance, pdf) = e.radiance_pdf(direction, to.facing);
            Some((radiance, pdf * self.probability(&to, i as usize), i))
        });
        std::iter::once((self.background, 0.0, BACKGROUND)).chain(environments)
    }

    /// Whether anything fills the space between surfaces.
    pub fn has_volumes(&self) -> bool {
        !self.volumes.is_empty()
    }

    /// What a ray meets in volumes up to the distance `until`, each in turn from the origin on: its number, what of its
    /// light arrives there, and the density with which `sample` finds the line for a point `behind` the origin, but for
    /// the chance of the light. Returns what part of the light behind them comes through. Volumes one within the other are
    /// taken one after the other.
    #[inline]
    pub fn along(
        &self,
        origin: Vec3,
        direction: Vec3,
        until: f32,
        behind: f32,
        mut each: impl FnMut(u32, &Marched),
    ) -> f32 {
        let mut through = 1.0;
        let mut nearest = f32::NEG_INFINITY;
        let mut done = 0;
        loop {
            // The next by where the ray enters it, and by number: there are few.
            let next = self.volumes.iter().filter_map(|&i| {
                let Emitter::Volume(v) = &self.emitters[i as usize] else { return None };
                let [near, _] = v.crossing(origin, direction, [0.0, until])?;
                ((near, i) > (nearest, done)).then_some((near, i, v))
            });
            let Some((near, i, volume)) = next.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) else {
                return through;
            };
            let mut marched = volume.march(origin, direction, until, behind);
            marched.radiance *= through;
            each(i, &marched);
            through *= marched.transmittance;
            (nearest, done) = (near, i);
        }
    }

    /// The chance that `sample` for `to` chooses light `i`.
    pub fn chance(&self, to: &LightSampleContext, i: u32) -> f32 {
        self.probability(to, i as usize)
    }

    /// What a sample brings: radiance along it; for a Dirac light irradiance on a surface that faces it. None of a
    /// volume, where it depends on how far the way is free.
    #[inline]
    pub fn radiance(&self, sample: &LightSample) -> Vec3 {
        match sample.emission {
            Emission::This(radiance) => radiance,
            Emission::Cell(i, cell) => match &self.emitters[i as usize] {
                Emitter::Environment(e) => e.radiance_at(cell),
                _ => Vec3::ZERO,
            },
            // Its light is that of the part of the way that is free: [`Lights::along`].
            Emission::Along(_) => Vec3::ZERO,
        }
    }
}
