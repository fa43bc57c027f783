//! What shines in a scene and is sampled as a light: which, in which order, and with what numbers.

use super::Textures;
use crate::{Geometry, Light, Scene, Texture, TextureId, Value};
use glam::{DVec3, Mat3, Mat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_motion::fire::{Directivity, Grid};
use yugen_optics::parallel::{parallel, threads};
use yugen_optics::{Image, distribution};

/// A light that reaches a point from one direction only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DiracLight {
    /// See [`Light::Point`].
    Point {
        /// Where.
        position: Vec3,
        /// W/sr per channel.
        intensity: Vec3,
    },
    /// See [`Light::Spot`].
    Spot {
        /// Where.
        position: Vec3,
        /// Directions of the world to those of its frame, not normalised; +z is the axis.
        to_local: Mat3,
        /// On the axis, W/sr per channel.
        intensity: Vec3,
        /// Half angle of the part that is fully lit, radians.
        beam: f32,
        /// Half angle beyond which nothing is lit, radians.
        cutoff: f32,
        /// Multiplies the intensity.
        texture: Option<TextureId>,
    },
    /// See [`Light::Directional`].
    Directional {
        /// Unit, the way light travels.
        direction: Vec3,
        /// On a surface that faces it.
        irradiance: Vec3,
    },
    /// See [`Light::Projector`].
    Projector {
        /// The world to its frame, which it throws along +z of.
        to_local: Mat4,
        /// Where.
        position: Vec3,
        /// Unit, the way it throws.
        axis: Vec3,
        /// Its picture.
        texture: TextureId,
        /// Factor.
        scale: f32,
        /// Half of the picture's width and height at distance one.
        half: Vec2,
    },
}

impl DiracLight {
    /// The picture that it throws.
    pub fn texture(&self) -> Option<TextureId> {
        match self {
            Self::Spot { texture, .. } => *texture,
            Self::Projector { texture, .. } => Some(*texture),
            Self::Point { .. } | Self::Directional { .. } => None,
        }
    }
}

/// Something that light samples are taken of.
#[derive(Clone, Debug)]
pub enum LightSource<'a> {
    /// A shape of the scene.
    Surface {
        /// Its index.
        shape: usize,
        /// Of the side of its normal.
        radiance: &'a Value,
        /// The other side shines as well.
        two_sided: bool,
    },
    /// A light without extent.
    Dirac {
        /// Its index.
        light: usize,
        /// What it is.
        dirac: DiracLight,
    },
    /// A picture at infinity; see [`Light::Environment`].
    Environment {
        /// Its index among the lights.
        light: usize,
        /// Radiance.
        image: &'a Arc<Image>,
        /// Factor.
        scale: f32,
        /// Its frame.
        to_world: Mat4,
    },
    /// A part of a volume; see [`LightSources::with_slabs`].
    Slab {
        /// Index of the volume among the lights.
        light: usize,
        /// Places of the world from which equal shares of its light come: as many for each node of the net of
        /// `directivity`, node after node.
        points: Vec<Vec3>,
        /// Edges of the box about each that it stands for.
        block: Mat3,
        /// In the mean over all directions.
        intensity: Vec3,
        /// To which sides it shines, over that; directions of the world.
        directivity: Box<Directivity>,
        /// Mean and covariance of the places, as what they are together.
        gaussian: (Vec3, Mat3),
        /// Added to the square of the distance of the mean, scene units squared: within a light as wide as it is most of it is
        /// further away than its middle.
        near: f32,
    },
    /// Cells that emit; see [`Light::Volume`].
    Volume {
        /// Its index among the lights.
        light: usize,
        /// The cells.
        grid: &'a Arc<Grid>,
        /// Factor of the emission.
        scale: f32,
        /// Its frame.
        to_world: Mat4,
    },
}

/// A shape inside a group that shines: instances cannot.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("shape '{0}' inside a group emits light; instances cannot: place it in the scene itself")]
pub struct EmitterInGroup(pub String);

/// All that shines.
#[derive(Clone, Debug, Default)]
pub struct LightSources<'a> {
    /// Surfaces in the order of their shapes, then lights in theirs.
    pub sources: Vec<LightSource<'a>>,
    /// Radiance from everywhere alike. Directions that a material draws find it best, so no samples are taken of it.
    pub background: Vec3,
}

impl<'a> LightSources<'a> {
    /// Of `scene`.
    pub fn new(scene: &'a Scene) -> Result<Self, EmitterInGroup> {
        if let Some(shape) = scene.groups.iter().flatten().find(|s| s.emission.is_some()) {
            return Err(EmitterInGroup(shape.name.clone()));
        }
        let surfaces =
            scene.shapes.iter().enumerate().filter_map(|(shape, s)| match (&s.emission, &s.geometry) {
                (None, _) | (_, Geometry::Instance(_)) => None,
                (Some(radiance), _) => {
                    Some(LightSource::Surface { shape, radiance, two_sided: s.two_sided_emission })
                }
            });
        let mut all = Self { sources: surfaces.collect(), background: Vec3::ZERO };
        for (light, l) in scene.lights.iter().enumerate() {
            let dirac = match l {
                Light::Constant { radiance } => {
                    all.background += *radiance;
                    continue;
                }
                Light::Environment { image, scale, to_world } => {
                    let (scale, to_world) = (*scale, *to_world);
                    all.sources.push(LightSource::Environment { light, image, scale, to_world });
                    continue;
                }
                Light::Volume { grid, scale, to_world } => {
                    let (scale, to_world) = (*scale, *to_world);
                    all.sources.push(LightSource::Volume { light, grid, scale, to_world });
                    continue;
                }
                Light::Point { position, intensity } => {
                    DiracLight::Point { position: *position, intensity: *intensity }
                }
                Light::Spot { to_world, intensity, beam, cutoff, texture } => DiracLight::Spot {
                    position: to_world.w_axis.truncate(),
                    to_local: Mat3::from_mat4(*to_world).inverse(),
                    intensity: *intensity,
                    beam: *beam,
                    cutoff: *cutoff,
                    texture: *texture,
                },
                Light::Directional { direction, irradiance } => DiracLight::Directional {
                    direction: direction.normalize_or(-Vec3::Z),
                    irradiance: *irradiance,
                },
                Light::Projector { to_world, texture, scale, fov_x } => {
                    let half = (0.5 * fov_x).tan();
                    let aspect = match scene.textures.get(*texture) {
                        Some(Texture::Image { image, .. }) => image.width as f32 / image.height as f32,
                        _ => 1.0,
                    };
                    DiracLight::Projector {
                        to_local: to_world.inverse(),
                        position: to_world.w_axis.truncate(),
                        axis: to_world.transform_vector3(Vec3::Z).normalize_or(Vec3::Z),
                        texture: *texture,
                        scale: *scale,
                        half: Vec2::new(half, half / aspect),
                    }
                }
            };
            all.sources.push(LightSource::Dirac { light, dirac });
        }
        Ok(all)
    }

    /// With `count` slabs of `points` points for each direction in place of each volume, which together send the light that leaves
    /// it. They come last.
    pub fn with_slabs(mut self, count: usize, points: usize) -> Self {
        let is_volume = |source: &LightSource| matches!(source, LightSource::Volume { .. });
        let (volumes, others): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.sources).into_iter().partition(is_volume);
        self.sources = others;
        let slabs_of = |i: usize| {
            let LightSource::Volume { grid, to_world, .. } = &volumes[i] else { return Vec::new() };
            let turn = Mat3::from_mat4(crate::rigid(*to_world)).transpose().as_dmat3();
            grid.slabs(count, points, DVec3::Y, turn)
        };
        let slabs = parallel(threads(), volumes.len(), slabs_of, &|_| {});
        for (source, slabs) in volumes.iter().zip(slabs) {
            let LightSource::Volume { light, grid, scale, to_world } = *source else { continue };
            for slab in slabs {
                // Where nothing shines it does not matter where, but there are always as many.
                let nowhere = to_world.transform_point3(grid.lower);
                let place = |p: &DVec3| to_world.transform_point3(p.as_vec3());
                let mut places: Vec<Vec3> = slab.points.iter().map(place).collect();
                places.resize(points * slab.directivity.values().len(), nowhere);
                let mean = to_world.transform_point3(slab.blob.mean.as_vec3());
                let frame = Mat3::from_mat4(to_world);
                let covariance = frame * slab.blob.covariance.as_mat3() * frame.transpose();
                let variance = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
                let intensity = slab.blob.power * (f64::from(scale) / (4.0 * std::f64::consts::PI));
                self.sources.push(LightSource::Slab {
                    light,
                    points: places,
                    block: Mat3::from_mat4(to_world) * Mat3::from_diagonal(slab.edges.as_vec3()),
                    intensity: intensity.as_vec3(),
                    directivity: Box::new(slab.directivity),
                    gaussian: (mean, covariance),
                    // A quarter of what a disc as wide has on its axis, which darkens what is a metre away by some .2 %.
                    near: 0.25 * variance,
                });
            }
        }
        self
    }
}

/// Luminance of the mean radiance of a surface: all that choosing among lights needs to know of its picture.
pub fn mean_radiance(radiance: &Value, textures: &Textures, luminance: Vec3) -> f32 {
    luminance.dot(textures.mean(radiance)).max(0.0)
}

/// The chance of each source and those before it to be sampled where it is the same for all points, by the `power` of
/// each. A tenth goes to all alike, so that a light that matters locally is never starved.
pub fn chances_by_power(power: &[f32]) -> Vec<f32> {
    let power = power.iter().map(|p| if p.is_finite() { p.max(0.0) } else { 0.0 });
    let mut chances = vec![0.0; power.len()];
    let floor = 0.1 * power.clone().sum::<f32>() / power.len() as f32;
    distribution::accumulate(power.map(|p| f64::from(p + floor)), &mut chances);
    chances
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shape;

    #[test]
    fn surfaces_come_first_and_what_comes_from_everywhere_is_not_among_them() {
        let shine = |geometry| Shape {
            emission: Some(Value::Number(1.0)),
            ..Shape::new("lamp", geometry, Mat4::IDENTITY, 0)
        };
        let mut scene = Scene {
            shapes: vec![
                Shape::new("dark", Geometry::Sphere, Mat4::IDENTITY, 0),
                shine(Geometry::Instance(0)),
                Shape { two_sided_emission: true, ..shine(Geometry::Sphere) },
            ],
            lights: vec![
                Light::Constant { radiance: Vec3::X },
                Light::Point { position: Vec3::ONE, intensity: Vec3::Y },
                Light::Constant { radiance: Vec3::Z },
                Light::Projector { to_world: Mat4::IDENTITY, texture: 7, scale: 2.0, fov_x: 1.0 },
            ],
            groups: vec![vec![Shape::new("part", Geometry::Sphere, Mat4::IDENTITY, 0)]],
            ..Scene::default()
        };
        let lights = LightSources::new(&scene).expect("nothing shines in the group");
        assert_eq!(lights.background, Vec3::new(1.0, 0.0, 1.0));
        let half = 0.5f32.tan();
        assert!(matches!(
            lights.sources[..],
            [
                LightSource::Surface { shape: 2, two_sided: true, .. },
                LightSource::Dirac { light: 1, dirac: DiracLight::Point { intensity: Vec3::Y, .. } },
                LightSource::Dirac { light: 3, dirac: DiracLight::Projector { half: h, axis: Vec3::Z, .. } },
            ] if h == Vec2::splat(half)
        ));
        scene.groups[0][0].emission = Some(Value::Number(1.0));
        assert_eq!(LightSources::new(&scene).err(), Some(EmitterInGroup("part".into())));
    }

    #[test]
    fn chances_go_with_power_but_for_a_tenth() {
        assert_eq!(chances_by_power(&[]), []);
        let chances = chances_by_power(&[8.0, 0.0, f32::NAN, 2.0]);
        // 8.25, .25, .25 and 2.25 of 11.
        let want = [0.75, 8.5 / 11.0, 8.75 / 11.0, 1.0];
        assert!(chances.iter().zip(want).all(|(c, w)| (c - w).abs() < 1e-6), "{chances:?}");
        // Without any power, or with more than floats can add, all alike.
        for power in [0.0, f32::MAX] {
            assert_eq!(chances_by_power(&[power; 4]), [0.25, 0.5, 0.75, 1.0]);
        }
    }
}
