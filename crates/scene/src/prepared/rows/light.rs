//! Emitters as rows of [`STRIDE`] words.

use super::texture::Programs;
use super::{DrawRow, NONE, Rows, RowsError, environment};
use crate::prepared::{Environment, Textures};
use crate::{Geometry, Light, Scene, Shape, Texture, Value};
use glam::{Mat3, Vec3};
use std::f32::consts::PI;
use yugen_optics::distribution;

/// Words of an emitter. `light.wgsl` knows it, and what they mean.
const STRIDE: usize = 28;

/// Kinds of emitters, the first word of each.
#[derive(Clone, Copy)]
#[repr(u32)]
enum Op {
    Area,
    Point,
    Spot,
    Directional,
    Environment,
    Projector,
}

/// What an emitter sends, whatever its pose.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sends {
    /// Its radiance, or the texture of its light, as [`Programs::value`] has it; the first word of none is [`NONE`]. Of an
    /// environment, where it begins.
    value: [u32; 4],
    /// Luminance: mean radiance of a surface, irradiance of an environment on what faces anywhere.
    mean: f32,
    /// Width over height of a projector's picture.
    aspect: f32,
}

fn shines(shape: &Shape) -> bool {
    shape.emission.is_some() && !matches!(shape.geometry, Geometry::Instance(_))
}

/// Lights that are chosen among, without what comes from everywhere alike.
fn chosen(scene: &Scene) -> impl Iterator<Item = &Light> {
    scene.lights.iter().filter(|l| !matches!(l, Light::Constant { .. }))
}

/// How many emitters there are.
pub(super) fn count(scene: &Scene) -> usize {
    scene.shapes.iter().filter(|s| shines(s)).count() + chosen(scene).count()
}

/// The emitter of each shape: those that shine come first, in their order.
pub(super) fn number(scene: &Scene) -> Result<Vec<Option<u32>>, RowsError> {
    if let Some(shape) = scene.groups.iter().flatten().find(|s| s.emission.is_some()) {
        return Err(RowsError::EmitterInGroup(shape.name.clone()));
    }
    if scene.lights.iter().any(|l| matches!(l, Light::Volume { .. })) {
        return Err(RowsError::Volume);
    }
    let mut count = 0;
    let number = |shape: &Shape| {
        shines(shape).then(|| {
            count += 1;
            count - 1
        })
    };
    Ok(scene.shapes.iter().map(number).collect())
}

/// Adds the textures of all emitters and the tables of environments.
pub(super) fn send(
    scene: &Scene,
    textures: &Textures,
    programs: &mut Programs,
    rows: &mut Rows,
) -> Result<Vec<Sends>, RowsError> {
    let luminance = scene.working_space.luminance_weights();
    let mut all = Vec::new();
    for radiance in scene.shapes.iter().filter(|s| shines(s)).filter_map(|s| s.emission.as_ref()) {
        let mean = luminance.dot(textures.mean(radiance)).max(0.0);
        all.push(Sends { value: programs.value(radiance, rows)?, mean, ..Sends::default() });
    }
    for light in chosen(scene) {
        all.push(match light {
            Light::Environment { image, scale, to_world } => {
                let e = Environment::new(image, *scale, *to_world, luminance)?;
                let at = environment::write(&e, rows);
                Sends { value: [at, 0, 0, 0], mean: e.irradiance(Vec3::ZERO), ..Sends::default() }
            }
            Light::Spot { texture: Some(id), .. } => {
                Sends { value: programs.value(&Value::Texture(*id), rows)?, ..Sends::default() }
            }
            Light::Projector { texture, .. } => {
                let aspect = match &scene.textures[*texture] {
                    Texture::Image { image, .. } => image.width as f32 / image.height as f32,
                    _ => 1.0,
                };
                Sends { value: programs.value(&Value::Texture(*texture), rows)?, aspect, ..Sends::default() }
            }
            _ => Sends { value: [NONE, 0, 0, 0], ..Sends::default() },
        });
    }
    Ok(all)
}

/// Adds the emitters, the chance of each and those before it to be chosen by its power, and the background.
pub(super) fn write(scene: &Scene, of_shape: &[Option<u32>], sends: &[Sends], rows: &mut Rows) {
    let luminance = scene.working_space.luminance_weights();
    let table = rows.words.len();
    rows.words.resize(table + STRIDE * sends.len(), 0);
    (rows.lights, rows.lights_by_area) = (0, false);
    let radius = rows.radius();
    let mut next = 0;
    let mut power = Vec::new();
    let mut environments = Vec::new();
    let mut sends = sends.iter();

    for (shape, _) in scene.shapes.iter().zip(of_shape).filter(|(_, e)| e.is_some()) {
        let Some(Sends { value, mean, .. }) = sends.next() else { continue };
        let draw = rows.draws.iter().position(|d| d.emitter == next).map_or(NONE, |i| i as u32);
        let (cumulative, area) = rows.areas(draw);
        let sides = if shape.two_sided_emission { 2.0 } else { 1.0 };
        power.push(mean * area * PI * sides);
        let mut words = vec![Op::Area as u32, draw, u32::from(shape.two_sided_emission)];
        words.extend(value);
        words.extend([rows.numbers.len() as u32, cumulative.len() as u32, area.to_bits()]);
        let cone = sphere(shape, value[0] == 2);
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
        put(rows, table, &mut next, &words);
    }
    for (light, Sends { value, mean, aspect }) in chosen(scene).zip(sends) {
        let mut words = Vec::new();
        let floats = |words: &mut Vec<u32>, v: &[f32]| words.extend(v.iter().map(|x| x.to_bits()));
        match light {
            // Refused in [`number`].
            Light::Constant { .. } | Light::Volume { .. } => {}
            Light::Point { position, intensity } => {
                words.push(Op::Point as u32);
                floats(&mut words, &position.to_array());
                floats(&mut words, &intensity.to_array());
                power.push(4.0 * PI * luminance.dot(*intensity));
            }
            Light::Spot { to_world, intensity, beam, cutoff, .. } => {
                words.push(Op::Spot as u32);
                floats(&mut words, &to_world.w_axis.truncate().to_array());
                floats(&mut words, &intensity.to_array());
                floats(&mut words, &Mat3::from_mat4(*to_world).inverse().to_cols_array());
                floats(&mut words, &[*beam, *cutoff]);
                words.extend(value);
                power.push(2.0 * PI * (1.0 - cutoff.cos()) * luminance.dot(*intensity));
            }
            Light::Directional { direction, irradiance } => {
                words.push(Op::Directional as u32);
                floats(&mut words, &direction.normalize_or(-Vec3::Z).to_array());
                floats(&mut words, &irradiance.to_array());
                power.push(PI * radius * radius * luminance.dot(*irradiance));
            }
            Light::Environment { to_world, .. } => {
                environment::turn(value[0], *to_world, rows);
                environments.push(next);
                // Four times the irradiance is the mean radiance times 4π.
                power.push(4.0 * PI * radius * radius * mean);
                words.extend([Op::Environment as u32, value[0]]);
            }
            Light::Projector { to_world, scale, fov_x, .. } => {
                let half = (0.5 * fov_x).tan();
                let to_local = to_world.inverse();
                words.push(Op::Projector as u32);
                for row in 0..3 {
                    floats(&mut words, &to_local.row(row).to_array());
                }
                floats(&mut words, &to_world.w_axis.truncate().to_array());
                let axis = to_world.transform_vector3(Vec3::Z).normalize_or(Vec3::Z);
                floats(&mut words, &axis.to_array());
                words.extend(value);
                floats(&mut words, &[*scale, half, half / aspect]);
                power.push(PI * scale * 4.0 * half * half / aspect);
            }
        }
        put(rows, table, &mut next, &words);
    }
    let mut background = Vec3::ZERO;
    for light in &scene.lights {
        if let Light::Constant { radiance } = light {
            background += *radiance;
        }
    }

    // A tenth to all alike, so that a light that matters locally is never starved.
    let power: Vec<f64> =
        power.iter().map(|p| if p.is_finite() { f64::from(p.max(0.0)) } else { 0.0 }).collect();
    let floor = 0.1 * power.iter().sum::<f64>() / power.len().max(1) as f64;
    let mut chances = vec![0.0; power.len()];
    if !power.is_empty() {
        distribution::accumulate(power.iter().map(|p| p + floor), &mut chances);
    }
    rows.emitters = next;
    rows.words[4..7].copy_from_slice(&[table as u32, next, rows.numbers.len() as u32]);
    rows.numbers.extend(chances);
    rows.words[7] = rows.words.len() as u32;
    rows.words.push(environments.len() as u32);
    rows.words.extend(environments);
    rows.words[8..11].copy_from_slice(&background.to_array().map(f32::to_bits));
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

fn put(rows: &mut Rows, table: usize, next: &mut u32, words: &[u32]) {
    rows.lights |= 1 << words[0];
    let at = table + STRIDE * *next as usize;
    rows.words[at..at + words.len()].copy_from_slice(words);
    *next += 1;
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
