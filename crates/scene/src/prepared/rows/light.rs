//! Emitters as rows of [`STRIDE`] words.

use super::texture::Programs;
use super::{DrawRow, NONE, Rows, RowsError, environment};
use crate::prepared::{DiracLight, Environment, LightSource, LightSources, Textures};
use crate::prepared::{chances_by_power, mean_radiance};
use crate::{Geometry, Scene, Shape, Value};
use glam::{Mat3, Vec3};
use std::f32::consts::PI;
use yugen_optics::distribution;

/// Words of an emitter. `light.wgsl` knows it, and what they mean.
const STRIDE: usize = 27;

/// Where in a slab its covariance is: the diagonal, then xy, xz and yz.
const COVARIANCE: usize = 21;

/// Kinds of emitters, the first word of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Op {
    Area,
    Point,
    Spot,
    Directional,
    Environment,
    Projector,
    Slab,
}

/// Parts of a volume as lights.
pub const SLABS: usize = 6;
/// Points of each in each direction of its net.
pub(super) const POINTS: usize = 32;

impl Op {
    pub(super) fn of(source: &LightSource) -> Self {
        match source {
            LightSource::Surface { .. } => Self::Area,
            LightSource::Environment { .. } => Self::Environment,
            LightSource::Slab { .. } | LightSource::Volume { .. } => Self::Slab,
            LightSource::Dirac { dirac, .. } => match dirac {
                DiracLight::Point { .. } => Self::Point,
                DiracLight::Spot { .. } => Self::Spot,
                DiracLight::Directional { .. } => Self::Directional,
                DiracLight::Projector { .. } => Self::Projector,
            },
        }
    }

    /// For sentences.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Area => "a surface",
            Self::Point => "a point light",
            Self::Spot => "a spot light",
            Self::Directional => "a directional light",
            Self::Environment => "an environment",
            Self::Projector => "a projector",
            Self::Slab => "a part of a volume",
        }
    }
}

/// What an emitter sends, whatever its pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emission {
    pub(super) op: Op,
    /// Its radiance, or the texture of its light, as [`Programs::value`] has it; the first word of none is [`NONE`]. Of an
    /// environment, where it begins.
    value: [u32; 4],
    /// Luminance: mean radiance of a surface, irradiance of an environment on what faces anywhere.
    mean: f32,
}

/// Adds the textures of all emitters and the tables of environments.
pub(super) fn write_emissions(
    scene: &Scene,
    lights: &LightSources,
    textures: &Textures,
    programs: &mut Programs,
    rows: &mut Rows,
) -> Result<Vec<Emission>, RowsError> {
    let luminance = scene.working_space.luminance_weights();
    let emission = |source: &LightSource| {
        let (value, mean) = match source {
            LightSource::Surface { radiance, .. } => {
                (programs.value(radiance, rows)?, mean_radiance(radiance, textures, luminance))
            }
            LightSource::Environment { image, scale, to_world, .. } => {
                let e = Environment::new(image, *scale, *to_world, luminance)?;
                ([environment::write(&e, rows), 0, 0, 0], e.irradiance(Vec3::ZERO))
            }
            LightSource::Slab { .. } | LightSource::Volume { .. } => ([NONE, 0, 0, 0], 0.0),
            LightSource::Dirac { dirac, .. } => match dirac.texture() {
                Some(id) => (programs.value(&Value::Texture(id), rows)?, 0.0),
                None => ([NONE, 0, 0, 0], 0.0),
            },
        };
        Ok(Emission { op: Op::of(source), value, mean })
    };
    lights.sources.iter().map(emission).collect()
}

/// Adds the emitters, which send what `emissions` say, the chance of each and those before it to be chosen by its power,
/// and the background.
pub(super) fn write(scene: &Scene, lights: &LightSources, emissions: &[Emission], rows: &mut Rows) {
    let luminance = scene.working_space.luminance_weights();
    let table = rows.words.len();
    rows.words.resize(table + STRIDE * lights.sources.len(), 0);
    (rows.lights, rows.lights_by_area) = (0, false);
    let radius = rows.radius();
    let mut next = 0;
    let mut power = Vec::new();
    let mut environments = Vec::new();

    for (source, Emission { op, value, mean }) in lights.sources.iter().zip(emissions) {
        let mut words = vec![*op as u32];
        let floats = |words: &mut Vec<u32>, v: &[f32]| words.extend(v.iter().map(|x| x.to_bits()));
        match source {
            LightSource::Surface { shape, two_sided, .. } => {
                let draw = rows.draws.iter().position(|d| d.emitter == next).map_or(NONE, |i| i as u32);
                let (cumulative, area) = rows.areas(draw);
                power.push(mean * area * PI * if *two_sided { 2.0 } else { 1.0 });
                words.extend([draw, u32::from(*two_sided)]);
                words.extend(value);
                words.extend([rows.numbers.len() as u32, cumulative.len() as u32, area.to_bits()]);
                let cone = sphere(&scene.shapes[*shape], value[0] == 2);
                rows.lights |= u32::from(cone[3] > 0.0) << 31;
                words.extend(cone.map(f32::to_bits));
                let mut by_angle = cone[3] > 0.0;
                if value[0] != 2
                    && let Some(corner_and_sides) = rows.rectangle(draw)
                {
                    rows.lights |= 1 << 30;
                    words.extend(corner_and_sides.iter().flat_map(|v| v.to_array()).map(f32::to_bits));
                    words.push(1);
                    by_angle = true;
                }
                rows.lights_by_area |= !by_angle;
                rows.numbers.extend(cumulative);
            }
            LightSource::Slab {
                points,
                block,
                intensity,
                directivity,
                gaussian: (mean, covariance),
                near,
                ..
            } => {
                words.extend([
                    rows.numbers.len() as u32,
                    (points.len() / directivity.values().len()) as u32,
                    0,
                ]);
                floats(&mut words, &intensity.to_array());
                floats(&mut words, &block.to_cols_array());
                floats(&mut words, &[*near]);
                words.push((rows.numbers.len() + 3 * points.len()) as u32);
                floats(&mut words, &mean.to_array());
                debug_assert_eq!(words.len(), COVARIANCE);
                words.extend(covariance_words(*covariance));
                rows.numbers.extend(points.iter().flat_map(|p| p.to_array()));
                rows.numbers.extend(directivity.values());
                power.push(4.0 * PI * luminance.dot(*intensity));
            }
            // Divided into slabs.
            LightSource::Volume { .. } => power.push(0.0),
            LightSource::Environment { to_world, .. } => {
                environment::set_orientation(value[0], *to_world, rows);
                environments.push(next);
                // Four times the irradiance is the mean radiance times 4π.
                power.push(4.0 * PI * radius * radius * mean);
                words.push(value[0]);
            }
            LightSource::Dirac { dirac, .. } => match dirac {
                DiracLight::Point { position, intensity } => {
                    floats(&mut words, &position.to_array());
                    floats(&mut words, &intensity.to_array());
                    power.push(4.0 * PI * luminance.dot(*intensity));
                }
                DiracLight::Spot { position, to_local, intensity, beam, cutoff, .. } => {
                    floats(&mut words, &position.to_array());
                    floats(&mut words, &intensity.to_array());
                    floats(&mut words, &to_local.to_cols_array());
                    floats(&mut words, &[*beam, *cutoff]);
                    words.extend(value);
                    power.push(2.0 * PI * (1.0 - cutoff.cos()) * luminance.dot(*intensity));
                }
                DiracLight::Directional { direction, irradiance } => {
                    floats(&mut words, &direction.to_array());
                    floats(&mut words, &irradiance.to_array());
                    power.push(PI * radius * radius * luminance.dot(*irradiance));
                }
                DiracLight::Projector { to_local, position, axis, scale, half, .. } => {
                    for row in 0..3 {
                        floats(&mut words, &to_local.row(row).to_array());
                    }
                    floats(&mut words, &position.to_array());
                    floats(&mut words, &axis.to_array());
                    words.extend(value);
                    floats(&mut words, &[*scale, half.x, half.y]);
                    power.push(PI * scale * 4.0 * half.x * half.y);
                }
            },
        }
        rows.lights |= 1 << words[0];
        let at = table + STRIDE * next as usize;
        rows.words[at..at + words.len()].copy_from_slice(&words);
        next += 1;
    }
    rows.emitters = next;
    rows.words[4..7].copy_from_slice(&[table as u32, next, rows.numbers.len() as u32]);
    rows.numbers.extend(chances_by_power(&power));
    rows.words[7] = rows.words.len() as u32;
    rows.words.push(environments.len() as u32);
    rows.words.extend(environments);
    let slabs = lights.sources.iter().filter(|s| matches!(s, LightSource::Slab { .. })).count() as u32;
    rows.words[11] = next - slabs;
    rows.words[8..11].copy_from_slice(&lights.background.to_array().map(f32::to_bits));
}

/// A symmetric matrix as the words of a slab.
fn covariance_words(m: Mat3) -> [u32; 6] {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
    [x.x, y.y, z.z, x.y, x.z, y.z].map(f32::to_bits)
}

/// Centre and radius of a shape that is a round sphere of one radiance, sampled by the cone that it subtends; else a
/// radius of zero.
fn sphere(shape: &Shape, textured: bool) -> [f32; 4] {
    let m = shape.to_world;
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|a| a.truncate());
    let r = x.length();
    let round = [y.length() - r, z.length() - r, x.dot(y) / r, x.dot(z) / r, y.dot(z) / r];
    if matches!(shape.geometry, Geometry::Sphere) && !textured && round.iter().all(|d| d.abs() < 1e-5 * r) {
        m.w_axis.truncate().extend(r).to_array()
    } else {
        [0.0; 4]
    }
}

impl Rows {
    /// Whether the same light comes from everywhere.
    pub fn has_background(&self) -> bool {
        self.words.get(8..11).is_some_and(|c| c.iter().any(|w| f32::from_bits(*w) != 0.0))
    }

    /// Whether a picture of light from everywhere is among the emitters.
    pub fn has_environment(&self) -> bool {
        self.lights >> Op::Environment as u32 & 1 != 0
    }

    /// Whether some light comes from a point, or from one direction.
    pub fn has_points(&self) -> bool {
        let points = [Op::Point, Op::Spot, Op::Directional, Op::Projector];
        points.into_iter().any(|op| self.lights >> op as u32 & 1 != 0)
    }

    /// Whether a fire lights surfaces by its slabs.
    pub fn has_slabs(&self) -> bool {
        self.lights >> Op::Slab as u32 & 1 != 0
    }

    /// Replaces the covariance of each slab (symmetric, in the world, square scene units) by `f` of it, which must be symmetric;
    /// returns the number of slabs. For proofs of what the covariances are worth.
    pub fn map_slab_covariances(&mut self, f: impl Fn(Mat3) -> Mat3) -> usize {
        let [table, count, plain] = [4, 5, 11].map(|word| self.words.get(word).map_or(0, |w| *w as usize));
        for slab in plain..count {
            let at = table + STRIDE * slab + COVARIANCE;
            let [x, y, z, xy, xz, yz] = std::array::from_fn(|k| f32::from_bits(self.words[at + k]));
            let own = Mat3::from_cols_array(&[x, xy, xz, xy, y, yz, xz, yz, z]);
            self.words[at..at + 6].copy_from_slice(&covariance_words(f(own)));
        }
        count - plain
    }

    /// Whether light comes from infinity other than along one direction.
    pub fn has_sky(&self) -> bool {
        self.has_background() || self.has_environment()
    }

    fn corners(&self, draw: usize, triangle: u32) -> [Vec3; 3] {
        let rows = self.draws[draw].to_world;
        self.triangles[triangle as usize].map(|i| {
            let p = Vec3::from(self.vertices[i as usize].position).extend(1.0);
            Vec3::from(rows.map(|r| glam::Vec4::from(r).dot(p)))
        })
    }

    /// A corner and the two sides from it, in the world, of a draw that is a rectangle of two triangles; their cross
    /// product is along its normal.
    fn rectangle(&self, draw: u32) -> Option<[Vec3; 3]> {
        let d = self.draws.get(draw as usize)?;
        if d.triangles != 2 {
            return None;
        }
        let [first, second] = [0, 1].map(|i| self.corners(draw as usize, d.first_triangle + i));
        let size = (first[1] - first[0]).length() + (first[2] - first[0]).length();
        let same = |a: Vec3, b: Vec3| (a - b).length() < 1e-5 * size;
        // The corner of the first that the second has not is where the sides are.
        let alone = (0..3).find(|&i| !second.iter().any(|p| same(*p, first[i])))?;
        let (corner, x, y) = (first[alone], first[(alone + 1) % 3], first[(alone + 2) % 3]);
        let (x, mut y) = (x - corner, y - corner);
        let across = corner + x + y;
        let whole = second.iter().filter(|p| same(**p, across)).count() == 1
            && second.iter().filter(|p| same(**p, corner + x) || same(**p, corner + y)).count() == 2;
        let square = x.dot(y).abs() < 1e-5 * x.length() * y.length() && x.length() * y.length() > 0.0;
        let mut x = x;
        let turned =
            d.flags & (DrawRow::HAS_NORMALS | DrawRow::MIRRORED) == DrawRow::HAS_NORMALS | DrawRow::MIRRORED;
        if turned != (d.flags & DrawRow::FLIPPED != 0) {
            std::mem::swap(&mut x, &mut y);
        }
        (whole && square).then_some([corner, x, y])
    }

    /// Of a draw's triangles in the world: what part each and those before it have, and the whole area.
    fn areas(&self, draw: u32) -> (Vec<f32>, f32) {
        let Some(d) = self.draws.get(draw as usize) else { return (Vec::new(), 0.0) };
        let area = |i: u32| {
            let [a, b, c] = self.corners(draw as usize, d.first_triangle + i);
            f64::from(0.5 * (b - a).cross(c - a).length())
        };
        let mut cumulative = vec![0.0; d.triangles as usize];
        if cumulative.is_empty() {
            return (cumulative, 0.0);
        }
        let sum = distribution::accumulate((0..d.triangles).map(area), &mut cumulative);
        (cumulative, sum as f32)
    }

    /// Of a sphere around everything, roughly.
    fn radius(&self) -> f32 {
        let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for draw in &self.draws {
            let mesh = self.meshes[draw.mesh as usize];
            let own = &self.vertices[mesh.first_vertex as usize..][..mesh.vertices as usize];
            for v in own {
                let p = Vec3::from(v.position).extend(1.0);
                let p = Vec3::from(draw.to_world.map(|r| glam::Vec4::from(r).dot(p)));
                (lo, hi) = (lo.min(p), hi.max(p));
            }
        }
        if lo.x <= hi.x { 0.5 * (hi - lo).length() } else { 1.0 }
    }
}
