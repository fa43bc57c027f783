//! Pictures and cloth under new light.

use super::basis::MOST;
use super::{Encoding, evaluate, readings};
use crate::rows::for_rows;
use crate::{Lights, Stack};
use glam::{Quat, Vec3};
use std::f32::consts::{PI, TAU};
use yugen_archive::formats::relightable::{Colouring, Relightable};
use yugen_optics::Image;
use yugen_reflectance::btf::{Btf, Texel};
use yugen_reflectance::{Choice, Model, ModelError};

/// Light from far away in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Unit vector toward it.
    pub toward: Vec3,
    /// Radiance of a white diffuser that faces it: irradiance over π.
    pub white: Vec3,
}

impl Lamp {
    /// The light that photographs of a stack are taken with: a white diffuser that faces it has the value 1.
    pub fn unit(toward: Vec3) -> Self {
        Self { toward, white: Vec3::ONE }
    }
}

/// Encoded values of one texel, given the values of the basis.
#[inline]
pub(super) fn texel_under(picture: &Relightable, texel: &[f32], basis: &[f64; MOST]) -> [f32; 3] {
    let mut out = [0.0; 3];
    match picture.colouring {
        Colouring::Rgb => {
            for (k, b) in texel.chunks_exact(3).zip(basis) {
                (0..3).for_each(|c| out[c] += k[c] * *b as f32);
            }
        }
        Colouring::Lrgb => {
            let l: f32 = texel[3..].iter().zip(basis).map(|(k, b)| k * *b as f32).sum();
            (0..3).for_each(|c| out[c] = l * texel[c]);
        }
    }
    out
}

/// Encoded values of all texels under light from the unit vector `light`, as they come out of the sum.
pub fn values(picture: &Relightable, light: Vec3) -> Vec<[f32; 3]> {
    let basis = evaluate(picture.basis, light);
    let (width, stride) = (picture.width, picture.stride());
    let mut out = vec![[0.0; 3]; width * picture.height];
    for_rows(&mut out, width, |y, row| {
        let texels = picture.coefficients[y * width * stride..].chunks_exact(stride);
        row.iter_mut().zip(texels).for_each(|(out, texel)| *out = texel_under(picture, texel, &basis));
    });
    out
}

/// The picture under lamps, linear.
///
/// With linear values the lamps' light is summed up in the basis first, and each coefficient is looked at once;
/// display values have to become light before they are added, lamp by lamp.
pub fn picture(picture: &Relightable, lamps: &[Lamp], encoding: Encoding) -> Vec<[f32; 3]> {
    let bases: Vec<[f64; MOST]> = lamps.iter().map(|l| evaluate(picture.basis, l.toward)).collect();
    let mut summed = [[0.0f64; MOST]; 3];
    for (basis, lamp) in bases.iter().zip(lamps) {
        for (sum, white) in summed.iter_mut().zip(lamp.white.to_array()) {
            sum.iter_mut().zip(basis).for_each(|(s, b)| *s += b * f64::from(white));
        }
    }
    let (width, stride) = (picture.width, picture.stride());
    let mut out = vec![[0.0; 3]; width * picture.height];
    for_rows(&mut out, width, |y, row| {
        let texels = picture.coefficients[y * width * stride..].chunks_exact(stride);
        for (out, texel) in row.iter_mut().zip(texels) {
            match encoding {
                Encoding::Linear => {
                    for (c, out) in out.iter_mut().enumerate() {
                        *out = texel_under(picture, texel, &summed[c])[c].max(0.0);
                    }
                }
                Encoding::Srgb => {
                    for (basis, lamp) in bases.iter().zip(lamps) {
                        let value = texel_under(picture, texel, basis);
                        for ((out, v), white) in out.iter_mut().zip(value).zip(lamp.white.to_array()) {
                            *out += encoding.decode(v) * white;
                        }
                    }
                }
            }
        }
    });
    out
}

/// A cloth seen head on under lamps, linear, in its own colours. `form` is that of [`yugen_reflectance::noh::Noh`].
pub fn cloth(btf: &Btf, form: Choice, lamps: &[Lamp]) -> Result<Vec<[f32; 3]>, ModelError> {
    // The forms of fitted maps need no table; one that does has it baked for every texel.
    let tables: Vec<Vec<f32>> = match btf.texels.first().map(|t| t.noh(form).bake(&[])).transpose()? {
        Some(table) if table.is_empty() => Vec::new(),
        _ => btf.texels.iter().map(|t| t.noh(form).bake(&[])).collect::<Result<_, _>>()?,
    };
    let mut out = vec![[0.0; 3]; btf.texels.len()];
    for_rows(&mut out, btf.width, |y, row| {
        for (x, out) in row.iter_mut().enumerate() {
            let i = y * btf.width + x;
            let table = tables.get(i).map_or(&[][..], Vec::as_slice);
            let light = lamps.iter().map(|l| factor(&btf.texels[i], form, table, l.toward) * l.white);
            *out = light.sum::<Vec3>().to_array();
        }
    });
    Ok(out)
}

/// The reflectance factor π f cos θ of a texel seen head on.
pub(super) fn factor(texel: &Texel, form: Choice, table: &[f32], toward: Vec3) -> Vec3 {
    if toward.z <= 0.0 {
        return Vec3::ZERO;
    }
    let frame = texel.frame();
    let (wo, wi) = (frame.to_local(Vec3::Z), frame.to_local(toward));
    texel.noh(form).eval(table, wo, wi) * (PI * wi.z.max(0.0))
}

/// Lamps that stand for a panorama (equirectangular, R, G and B first), at most one for each of `columns` by half as
/// many cells: the light of a cell comes from where its centre of light is. Light from below the sample is left out.
///
/// The sample lies in the panorama as scenes do: the centre of the panorama is in front of it (+z), where the camera is,
/// +y is up, and the left border of the panorama lies behind it; `turn` turns the panorama about +y, in radians,
/// counterclockwise from above.
pub fn panorama(image: &Image, columns: usize, turn: f32) -> Vec<Lamp> {
    let rows = (columns / 2).max(1);
    let mut cells = vec![(Vec3::ZERO, Vec3::ZERO, 0.0f32); columns * rows];
    let (w, h) = (image.width, image.height);
    let step = PI / (h.max(2) - 1) as f32;
    let turn = Quat::from_rotation_y(turn);
    for y in 0..h {
        // Rows stand for rings about their middle, those at the poles for half of one.
        let theta = y as f32 * step;
        let (lo, hi) = ((theta - 0.5 * step).max(0.0), (theta + 0.5 * step).min(PI));
        let solid = (lo.cos() - hi.cos()) * TAU / w as f32;
        for x in 0..w {
            let (sin, cos) = ((x as f32 + 0.5) / w as f32 * TAU).sin_cos();
            let toward = turn * Vec3::new(sin * theta.sin(), theta.cos(), -cos * theta.sin());
            if toward.z <= 0.0 {
                continue;
            }
            let radiance = Vec3::from_slice(&image.pixel(x, y)[..3]).max(Vec3::ZERO);
            let cell = &mut cells[y * rows / h * columns + x * columns / w];
            let weight = radiance.element_sum() * solid;
            *cell = (cell.0 + toward * weight, cell.1 + radiance * solid / PI, cell.2 + weight);
        }
    }
    let lit = cells.into_iter().filter(|c| c.2 > 0.0);
    lit.filter_map(|(toward, white, _)| Some(Lamp { toward: toward.try_normalize()?, white })).collect()
}

/// Sum of squares of what a fitted band misses of the encoded readings, and how many usable numbers those are.
pub fn misfit(stack: &Stack, picture: &Relightable, encoding: Encoding) -> (f64, u64) {
    let (width, stride, lights) = (stack.width, picture.stride(), stack.lights.len());
    let bases: Vec<_> = (0..lights).map(|l| evaluate(picture.basis, stack.light(l, 0, 0).0)).collect();
    let near = matches!(stack.lights, Lights::Near(_));
    let mut rows = vec![(0.0, 0); stack.height];
    for_rows(&mut rows, 1, |y, row| {
        let mut values = vec![[0.0; 3]; lights];
        for x in 0..width {
            readings(stack, x, y, encoding, &mut values);
            let texel = &picture.coefficients[(y * width + x) * stride..][..stride];
            for (l, v) in values.iter().enumerate().filter(|(_, v)| !v[0].is_nan()) {
                let own = near.then(|| evaluate(picture.basis, stack.light(l, x, y).0));
                let shown = texel_under(picture, texel, own.as_ref().unwrap_or(&bases[l]));
                row[0].0 += (0..3).map(|c| f64::from(shown[c] - v[c]).powi(2)).sum::<f64>();
                row[0].1 += 3;
            }
        }
    });
    // Row after row, so that the sum does not depend on who was first.
    rows.iter().fold((0.0, 0), |(sum, n), row| (sum + row.0, n + row.1))
}

/// Normals as RTI viewers find them: where a matt surface would lie that is as bright as the picture under three lamps 45
/// degrees from +z, at azimuths of 30, 150 and 270 degrees. `under` gives light, not display values.
pub fn normals(under: impl Fn(Vec3) -> Vec<[f32; 3]>) -> Vec<Vec3> {
    let lamps = [30f32, 150.0, 270.0].map(|a| yugen_optics::frame::spherical(PI / 4.0, a.to_radians()));
    let to_normal = glam::Mat3::from_cols_array_2d(&lamps.map(|l| l.to_array())).transpose().inverse();
    let pictures = lamps.map(under);
    (0..pictures[0].len())
        .map(|i| {
            let bright = Vec3::from_array([0, 1, 2].map(|l| pictures[l][i].iter().sum::<f32>()));
            (to_normal * bright).try_normalize().unwrap_or(Vec3::Z)
        })
        .collect()
}
