//! All lights of a scene: which to ask, where on it, and how likely that was.
//!
//! A light is chosen in proportion to the irradiance it could send to the point that asks (all of them are
//! looked at while they are few, a fixed distribution is used when they are many), then a direction towards it
//! by its own best density: the cone of a sphere, the spherical rectangle of a quad, the bright texels of an
//! environment.

use crate::accel::NO_INSTANCE;
use crate::geometry::{BuildError, Geometry, ShapeSampler, Surface};
use crate::texture::{Lookup, Textures};
use glam::{Mat3, Mat4, Vec2, Vec3, Vec3A};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;
use yugen_archive::scene::{Light, Scene, Value};
use yugen_optics::Image;
use yugen_optics::distribution::{Distribution1d, Distribution2d, ONE_MINUS_EPSILON};
use yugen_optics::warp::uniform_sphere;

/// Above this many lights a fixed distribution replaces the look at each.
const FEW: usize = 24;

/// A direction towards a light.
pub struct LightSample {
    /// Unit, away from the point that asked.
    pub wi: Vec3,
    /// How far the way must be free.
    pub distance: f32,
    brings: Brings,
    /// Solid-angle density times the probability of the light; for a Dirac light the probability alone.
    pub pdf: f32,
    /// Only this one direction exists: a material cannot find it by chance.
    pub delta: bool,
}

/// What a light sample brings, or where to look it up once nothing stands in its way: a large picture is far away
/// in memory.
enum Brings {
    This(Vec3),
    /// Emitter and cell of an environment.
    Cell(u32, Vec2),
}

impl LightSample {
    fn times(mut self, factor: Vec3) -> Self {
        if let Brings::This(radiance) = &mut self.brings {
            *radiance *= factor;
        }
        self
    }
}

enum Emitter {
    Area { sampler: Box<ShapeSampler>, radiance: Value, two_sided: bool, mean: f32, centre: Vec3 },
    Point { position: Vec3, intensity: Vec3 },
    Spot { position: Vec3, to_local: Mat3, intensity: Vec3, beam: f32, cutoff: f32, texture: Option<Value> },
    Directional { direction: Vec3, irradiance: Vec3 },
    Constant { radiance: Vec3 },
    Environment(Box<Environment>),
    Projector { to_local: Mat4, position: Vec3, axis: Vec3, texture: Value, scale: f32, half: Vec2 },
}

/// A latitude-longitude picture at infinity.
struct Environment {
    /// Scaled, four floats each, rows one texel longer than the picture: the first again.
    texels: Vec<Vec3A>,
    width: usize,
    height: usize,
    to_world: Mat3,
    to_local: Mat3,
    /// Over cells between texel centres: W × (H − 1).
    density: Distribution2d,
    mean: f32,
}

/// The lights of a scene.
pub struct Lights {
    emitters: Vec<Emitter>,
    /// Emitter of each shape, by the shape's index.
    of_shape: Vec<Option<u32>>,
    /// Emitters that light up rays that hit nothing.
    infinite: Vec<u32>,
    fixed: Option<Distribution1d>,
    luminance: Vec3,
}

/// A scene's lights could not be prepared.
#[derive(Debug, thiserror::Error)]
pub enum LightError {
    /// A shape that cannot be sampled.
    #[error(transparent)]
    Shape(#[from] BuildError),
    /// Emission on shapes inside a group.
    #[error("shape '{0}' inside a group emits light; instances cannot: place it in the scene itself")]
    EmitterInGroup(String),
    /// An environment picture without pixels or colours.
    #[error(
        "the environment picture is {width}x{height} with {channels} channels; it needs at least 2x2 and R, G, B"
    )]
    BadEnvironment {
        /// Width.
        width: usize,
        /// Height.
        height: usize,
        /// Channels.
        channels: usize,
    },
}

impl Lights {
    /// Prepares the lights of `scene`.
    pub fn new(scene: &Scene, geometry: &Geometry, textures: &Textures) -> Result<Self, LightError> {
        let luminance = scene.working_space.luminance_weights();
        for shape in scene.groups.iter().flatten() {
            if shape.emission.is_some() {
                return Err(LightError::EmitterInGroup(shape.name.clone()));
            }
        }
        let mut emitters = Vec::new();
        let mut of_shape = vec![None; scene.shapes.len()];
        for (i, shape) in scene.shapes.iter().enumerate() {
            let Some(radiance) = &shape.emission else { continue };
            let Some(sampler) = ShapeSampler::new(shape)? else { continue };
            let sampler = if matches!(radiance, Value::Texture(_)) { sampler } else { sampler.without_uv() };
            of_shape[i] = Some(emitters.len() as u32);
            let mean = luminance.dot(textures.mean(radiance));
            // The mean of a few points: all that choosing a light needs.
            let corners = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]];
            let centre =
                corners.map(|u| sampler.sample_area(Vec2::from_array(u)).position).iter().sum::<Vec3>() / 4.0;
            emitters.push(Emitter::Area {
                sampler: Box::new(sampler),
                radiance: radiance.clone(),
                two_sided: shape.two_sided_emission,
                mean,
                centre,
            });
        }
        for light in &scene.lights {
            emitters.push(match light {
                Light::Point { position, intensity } => {
                    Emitter::Point { position: *position, intensity: *intensity }
                }
                Light::Spot { to_world, intensity, beam, cutoff, texture } => Emitter::Spot {
                    position: to_world.w_axis.truncate(),
                    to_local: Mat3::from_mat4(*to_world).inverse(),
                    intensity: *intensity,
                    beam: *beam,
                    cutoff: *cutoff,
                    texture: texture.map(Value::Texture),
                },
                Light::Directional { direction, irradiance } => Emitter::Directional {
                    direction: direction.normalize_or(-Vec3::Z),
                    irradiance: *irradiance,
                },
                Light::Constant { radiance } => Emitter::Constant { radiance: *radiance },
                Light::Environment { image, scale, to_world } => {
                    Emitter::Environment(Box::new(Environment::new(image, *scale, *to_world, luminance)?))
                }
                Light::Projector { to_world, texture, scale, fov_x } => {
                    let half = (0.5 * fov_x).tan();
                    let aspect = match &scene.textures[*texture] {
                        yugen_archive::scene::Texture::Image { image, .. } => {
                            image.width as f32 / image.height as f32
                        }
                        _ => 1.0,
                    };
                    Emitter::Projector {
                        to_local: to_world.inverse(),
                        position: to_world.w_axis.truncate(),
                        axis: to_world.transform_vector3(Vec3::Z).normalize_or(Vec3::Z),
                        texture: Value::Texture(*texture),
                        scale: *scale,
                        half: Vec2::new(half, half / aspect),
                    }
                }
            });
        }
        let infinite = emitters
            .iter()
            .enumerate()
            .filter(|(_, e)| matches!(e, Emitter::Constant { .. } | Emitter::Environment(_)))
            .map(|(i, _)| i as u32)
            .collect();
        let mut lights = Self { emitters, of_shape, infinite, fixed: None, luminance };
        if lights.emitters.len() > FEW {
            let bounds = geometry.bounds();
            let centre = (bounds.lo + bounds.hi) * 0.5;
            let reach = (bounds.hi - bounds.lo).length() * 0.25;
            let power: Vec<f32> =
                (0..lights.emitters.len()).map(|i| lights.importance(i, centre, reach)).collect();
            // A tenth to all alike, so that a light that matters locally is never starved.
            let floor = 0.1 * power.iter().sum::<f32>() / power.len() as f32;
            lights.fixed = Some(Distribution1d::new(&power.iter().map(|p| p + floor).collect::<Vec<_>>()));
        }
        Ok(lights)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// Irradiance that emitter `i` could send to a facing surface at `p`, roughly; distances are not taken
    /// smaller than `reach`.
    fn importance(&self, i: usize, p: Vec3, reach: f32) -> f32 {
        let near2 = reach * reach;
        match &self.emitters[i] {
            Emitter::Area { sampler, mean, centre, .. } => {
                let area = sampler.area();
                // Half of what a small source of this area would give head on, never more than the hemisphere.
                mean * (area / (p.distance_squared(*centre) + area * 0.25).max(near2)).min(PI)
            }
            Emitter::Point { position, intensity } | Emitter::Spot { position, intensity, .. } => {
                self.luminance.dot(*intensity) / p.distance_squared(*position).max(near2.max(1e-12))
            }
            Emitter::Directional { irradiance, .. } => self.luminance.dot(*irradiance),
            Emitter::Constant { radiance } => PI * self.luminance.dot(*radiance),
            Emitter::Environment(e) => PI * e.mean,
            Emitter::Projector { position, scale, .. } => {
                PI * scale / p.distance_squared(*position).max(near2.max(1e-12))
            }
        }
    }

    /// Chooses an emitter for `p`: its index and probability, and `u` stretched back to [0, 1).
    fn choose(&self, p: Vec3, u: f32) -> Option<(usize, f32, f32)> {
        match self.emitters.len() {
            0 => None,
            1 => Some((0, 1.0, u)),
            n => {
                if let Some(fixed) = &self.fixed {
                    let (i, v) = fixed.sample_discrete(u);
                    return Some((i, fixed.probability(i), v));
                }
                let mut weights = [0.0f32; FEW];
                let total = self.weights(p, &mut weights);
                let mut rest = u * total;
                for (i, &w) in weights[..n].iter().enumerate() {
                    if rest < w || i + 1 == n {
                        return Some((i, w / total, (rest / w).clamp(0.0, ONE_MINUS_EPSILON)));
                    }
                    rest -= w;
                }
                None
            }
        }
    }

    fn weights(&self, p: Vec3, weights: &mut [f32; FEW]) -> f32 {
        let n = self.emitters.len();
        let mut total = 0.0;
        for (i, w) in weights[..n].iter_mut().enumerate() {
            *w = self.importance(i, p, 0.0);
            total += *w;
        }
        // A twentieth to all alike: importance is a guess.
        let floor = (0.05 * total / n as f32).max(1e-30);
        for w in &mut weights[..n] {
            *w += floor;
        }
        total + floor * n as f32
    }

    fn probability(&self, p: Vec3, i: usize) -> f32 {
        match (self.emitters.len(), &self.fixed) {
            (1, _) => 1.0,
            (_, Some(fixed)) => fixed.probability(i),
            _ => {
                let mut weights = [0.0f32; FEW];
                let total = self.weights(p, &mut weights);
                weights[i] / total
            }
        }
    }

    /// A direction from `p` to some light; `u` chooses the light with `u[2]` and the place with the others.
    #[inline]
    pub fn sample(&self, textures: &Textures, p: Vec3, u: [f32; 4]) -> Option<LightSample> {
        let (i, probability, _) = self.choose(p, u[2])?;
        let uv = Vec2::new(u[0], u[1]);
        let dirac = |position: Vec3, intensity: Vec3| {
            let to = position - p;
            let d2 = to.length_squared();
            let distance = d2.sqrt();
            LightSample {
                wi: to / distance,
                distance,
                brings: Brings::This(intensity / d2),
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
                let at = Lookup { uv: s.uv, footprint: 0.0, surface: None };
                LightSample {
                    wi,
                    distance,
                    brings: Brings::This(textures.rgb(radiance, &at)),
                    pdf: s.pdf * probability,
                    delta: false,
                }
            }
            Emitter::Point { position, intensity } => dirac(*position, *intensity),
            Emitter::Spot { position, to_local, intensity, beam, cutoff, texture } => {
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
                        0.5 - 0.5 * local.x / (local.z * half),
                        0.5 - 0.5 * local.y / (local.z * half),
                    );
                    intensity *= textures.rgb(texture, &Lookup { uv, footprint: 0.0, surface: None });
                }
                s.times(intensity)
            }
            Emitter::Directional { direction, irradiance } => LightSample {
                wi: -*direction,
                distance: f32::INFINITY,
                brings: Brings::This(*irradiance),
                pdf: probability,
                delta: true,
            },
            Emitter::Constant { radiance } => LightSample {
                wi: uniform_sphere(uv),
                distance: f32::INFINITY,
                brings: Brings::This(*radiance),
                pdf: probability * FRAC_1_PI * 0.25,
                delta: false,
            },
            Emitter::Environment(e) => {
                let (wi, pdf, cell) = e.sample(uv)?;
                let brings = Brings::Cell(i as u32, cell);
                LightSample { wi, distance: f32::INFINITY, brings, pdf: pdf * probability, delta: false }
            }
            Emitter::Projector { to_local, position, axis, texture, scale, half } => {
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
                let picture = textures.rgb(texture, &Lookup { uv, footprint: 0.0, surface: None });
                s.times(picture * (PI * scale / (cos * cos * cos)))
            }
        };
        Some(sample)
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

    /// Density with which `sample` from `p` finds `surface`, which is on emitter `i`.
    pub fn pdf_hit(&self, i: u32, p: Vec3, surface: &Surface) -> f32 {
        let Emitter::Area { sampler, .. } = &self.emitters[i as usize] else { return 0.0 };
        sampler.pdf(p, surface) * self.probability(p, i as usize)
    }

    /// Radiance from infinity along `direction`, light by light, and the density with which `sample` from `p`
    /// finds that direction on it.
    pub fn escaped(&self, p: Vec3, direction: Vec3) -> impl Iterator<Item = (Vec3, f32)> + '_ {
        self.infinite.iter().map(move |&i| {
            let (radiance, pdf) = match &self.emitters[i as usize] {
                Emitter::Constant { radiance } => (*radiance, FRAC_1_PI * 0.25),
                Emitter::Environment(e) => e.radiance_pdf(direction),
                _ => (Vec3::ZERO, 0.0),
            };
            (radiance, pdf * self.probability(p, i as usize))
        })
    }

    /// What a sample brings: radiance along it; for a Dirac light irradiance on a surface that faces it.
    #[inline]
    pub fn radiance(&self, sample: &LightSample) -> Vec3 {
        match sample.brings {
            Brings::This(radiance) => radiance,
            Brings::Cell(i, cell) => match &self.emitters[i as usize] {
                Emitter::Environment(e) => e.radiance_at(cell),
                _ => Vec3::ZERO,
            },
        }
    }
}

impl Environment {
    fn new(image: &Arc<Image>, scale: f32, to_world: Mat4, luminance: Vec3) -> Result<Self, LightError> {
        let (w, h, channels) = (image.width, image.height, image.channels.len());
        if w < 2 || h < 2 || channels < 3 {
            return Err(LightError::BadEnvironment { width: w, height: h, channels });
        }
        let to_world = Mat3::from_mat4(to_world);
        let value =
            |x: usize, y: usize| luminance.dot(Vec3::from_slice(&image.pixel(x % w, y)[..3])).max(0.0);
        let mut cells = Vec::with_capacity(w * (h - 1));
        let (mut sum, mut weight) = (0.0f64, 0.0f64);
        for y in 0..h - 1 {
            // ∫ sin θ over the row, exactly.
            let solid = (PI * y as f32 / (h - 1) as f32).cos() - (PI * (y + 1) as f32 / (h - 1) as f32).cos();
            for x in 0..w {
                let mean = 0.25 * (value(x, y) + value(x + 1, y) + value(x, y + 1) + value(x + 1, y + 1));
                cells.push(mean * solid);
                sum += f64::from(mean * solid);
                weight += f64::from(solid);
            }
        }
        // A hundredth to all alike, against cells that are dark in the mean but not everywhere.
        let floor = (0.01 * sum / weight) as f32;
        for (y, row) in cells.chunks_exact_mut(w).enumerate() {
            let solid = (PI * y as f32 / (h - 1) as f32).cos() - (PI * (y + 1) as f32 / (h - 1) as f32).cos();
            for cell in row {
                *cell += floor * solid;
            }
        }
        let mean = (sum / weight) as f32 * scale;
        let density = Distribution2d::new(&cells, w, h - 1);
        let texel = |x: usize, y: usize| Vec3A::from_slice(&image.pixel(x % w, y)[..3]) * scale;
        let texels = (0..h).flat_map(|y| (0..=w).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        Ok(Self { texels, width: w, height: h, to_world, to_local: to_world.inverse(), density, mean })
    }

    /// Cell coordinates of a local direction: x in [0, 1) from the first texel's centre, y in [0, 1].
    fn cell(&self, local: Vec3) -> Vec2 {
        let phi = local.x.atan2(-local.z) / TAU;
        let x = phi - 0.5 / self.width as f32;
        Vec2::new(x - x.floor(), local.y.clamp(-1.0, 1.0).acos() * FRAC_1_PI)
    }

    /// Radiance along `direction`, and the density of `sample` there.
    fn radiance_pdf(&self, direction: Vec3) -> (Vec3, f32) {
        let local = (self.to_local * direction).normalize();
        let cell = self.cell(local);
        let sin_theta = (1.0 - local.y * local.y).max(0.0).sqrt();
        let pdf = if sin_theta > 0.0 { self.density.pdf(cell) / (2.0 * PI * PI * sin_theta) } else { 0.0 };
        (self.radiance_at(cell), pdf)
    }

    fn radiance_at(&self, cell: Vec2) -> Vec3 {
        let (w, h) = (self.width, self.height);
        let x = cell.x * w as f32;
        let y = cell.y * (h - 1) as f32;
        let (x0, y0) = ((x as usize).min(w - 1), (y as usize).min(h - 2));
        let (tx, ty) = (x - x0 as f32, y - y0 as f32);
        // One column more than the picture has, so that neighbours lie side by side everywhere.
        let row = y0 * (w + 1) + x0;
        let (top, bottom) = (&self.texels[row..row + 2], &self.texels[row + w + 1..row + w + 3]);
        let top = top[0].lerp(top[1], tx);
        let bottom = bottom[0].lerp(bottom[1], tx);
        top.lerp(bottom, ty).into()
    }

    /// A direction, its density, and the cell where its radiance lies.
    fn sample(&self, u: Vec2) -> Option<(Vec3, f32, Vec2)> {
        let (cell, pdf) = self.density.sample(u);
        let phi = (cell.x + 0.5 / self.width as f32) * TAU;
        let (sin_theta, cos_theta) = (cell.y * PI).sin_cos();
        if sin_theta <= 0.0 || pdf <= 0.0 {
            return None;
        }
        let (sin_phi, cos_phi) = phi.sin_cos();
        let local = Vec3::new(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta);
        let pdf = pdf / (2.0 * PI * PI * sin_theta);
        Some(((self.to_world * local).normalize(), pdf, cell))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_environment_is_sampled_where_it_shines_and_its_density_integrates_to_one() {
        let mut image = Image::rgb(16, 9);
        for (i, v) in image.data.iter_mut().enumerate() {
            *v = ((i * 31) % 7) as f32 * 0.1;
        }
        image.pixel_mut(5, 3).copy_from_slice(&[50.0, 40.0, 30.0]);
        let turn = Mat4::from_rotation_x(0.7) * Mat4::from_rotation_y(-1.9);
        let env =
            Environment::new(&Arc::new(image), 2.0, turn, Vec3::new(0.2, 0.7, 0.1)).expect("a good picture");
        let n = 300;
        let (mut integral, mut power) = (0.0f64, 0.0f64);
        let frame = yugen_optics::Frame::from_normal(Vec3::new(0.3, 0.8, -0.5).normalize());
        for i in 0..n {
            for j in 0..n {
                let w = frame.to_world(uniform_sphere((Vec2::new(i as f32, j as f32) + 0.5) / n as f32));
                let (radiance, pdf) = env.radiance_pdf(w);
                integral += f64::from(pdf);
                power += f64::from(radiance.y);
            }
        }
        let solid = 4.0 * std::f64::consts::PI / f64::from(n * n);
        assert!((integral * solid - 1.0).abs() < 0.01, "{}", integral * solid);
        let mut sum = 0.0f64;
        let samples = 100_000;
        let mut disagree = 0;
        let mut rng = yugen_optics::random::Pcg32::new(3, 4);
        for _ in 0..samples {
            let (w, pdf, _) = env.sample(Vec2::new(rng.next_f32(), rng.next_f32())).expect("a direction");
            // A direction on the border of two cells may be read back in the other one.
            let (radiance, again) = env.radiance_pdf(w);
            disagree += u32::from((again / pdf - 1.0).abs() > 1e-3);
            sum += f64::from(radiance.y / pdf);
        }
        let estimate = sum / f64::from(samples);
        assert!(disagree < 50, "{disagree} of {samples}");
        assert!((estimate / (power * solid) - 1.0).abs() < 0.01, "{estimate} {}", power * solid);
    }
}
