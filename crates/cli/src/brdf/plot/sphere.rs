//! A sphere under a lamp and a soft sky, seen from far away.

use super::{Scene, bytes};
use crate::figure::{Anchor, Colour, Figure, LINE, wrapped};
use anyhow::Result;
use std::f32::consts::TAU;
use yugen_optics::frame::Frame;
use yugen_optics::random::hash_combine;
use yugen_optics::tonemap::{Curve, ToneMap};
use yugen_optics::{ColourSpace, Vec2, Vec3};
use yugen_reflectance::{Bsdf, Sample};

/// Draws a pixel, each for the sky and for the lamp, at this width and more; smaller pictures get more for the same
/// time, up to four times as many.
const DRAWS: (u32, u32) = (64, 400);
/// The share of the picture's half width that the sphere takes.
const FILL: f32 = 0.86;
const BACKDROP: Vec3 = Vec3::new(0.05, 0.052, 0.056);

/// The lamp is soft, a von Mises-Fisher lobe of this concentration: about five degrees wide.
const KAPPA: f32 = 150.0;
/// Its irradiance on a surface that faces it.
const LAMP: f32 = 2.4;

/// Towards the lamp; x right, y up, z to the eye.
fn lamp() -> Vec3 {
    Vec3::new(-0.5, 0.62, 0.6).normalize()
}

fn lamp_pdf(d: Vec3) -> f32 {
    KAPPA / TAU * (KAPPA * (d.dot(lamp()) - 1.0)).exp()
}

fn lamp_draw(u: Vec2) -> Vec3 {
    let z = 1.0 + (1.0 - u.x + u.x * (-2.0 * KAPPA).exp()).ln() / KAPPA;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Frame::from_normal(lamp()).to_world(Vec3::new(r * cos, r * sin, z))
}

/// Light from above, a warm floor, and a dim wall of light behind to the right that rims the sphere.
fn sky(d: Vec3) -> Vec3 {
    let up = 0.5 + 0.5 * d.y;
    let floor = Vec3::new(0.10, 0.09, 0.08);
    let air = Vec3::new(0.42, 0.45, 0.50);
    let rim =
        Vec3::new(0.75, 0.71, 0.67) * (4.0 * (d.dot(Vec3::new(0.85, 0.25, -0.45).normalize()) - 1.0)).exp();
    floor.lerp(air, up * up * (3.0 - 2.0 * up)) + rim
}

/// Points of the R3 sequence (Roberts 2018), shifted by a hash of the pixel.
fn point(pixel: u32, i: u32, dimension: u32) -> Vec3 {
    const STEP: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    Vec3::from_array(std::array::from_fn(|k| {
        let shift = f64::from(hash_combine(pixel, 3 * dimension + k as u32)) / f64::from(u32::MAX);
        // The largest float below one.
        ((shift + STEP[k] * f64::from(i)).fract() as f32).min(1.0 - f32::EPSILON / 2.0)
    }))
}

/// Lobes that are added up.
pub struct Sum<'a>(pub Vec<Bsdf<'a>>);

impl Sum<'_> {
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let (f, pdf) = self.0.iter().fold((Vec3::ZERO, 0.0), |(f, pdf), lobe| {
            let (g, p) = lobe.eval_pdf(wo, wi);
            (f + g, pdf + p)
        });
        (f, pdf / self.0.len() as f32)
    }

    /// One of the lobes draws, each as often as the others.
    fn sample(&self, wo: Vec3, u: Vec3) -> Option<Sample> {
        let n = self.0.len() as f32;
        let lobe = ((u.z * n) as usize).min(self.0.len() - 1);
        let mut s =
            self.0[lobe].sample(wo, u.with_z((u.z * n - lobe as f32).min(1.0 - f32::EPSILON / 2.0)))?;
        if s.delta {
            s.weight *= n;
        } else if self.0.len() > 1 {
            let (f, pdf) = self.eval_pdf(wo, s.wi);
            s.weight = f * (s.wi.z.abs() / pdf);
            s.pdf = pdf;
        }
        Some(s)
    }
}

/// Radiance at one point of the picture; x right and y up in units of the radius.
fn radiance(bsdf: &Sum, at: Vec2, for_sky: Vec3, for_lamp: Vec2) -> Vec3 {
    let r2 = at.length_squared();
    if r2 >= 1.0 {
        return BACKDROP;
    }
    let normal = Vec3::new(at.x, at.y, (1.0 - r2).sqrt());
    // The tangent goes around the upright axis.
    let frame = Frame::from_normal_tangent(normal, Vec3::Y.cross(normal));
    let wo = frame.to_local(Vec3::Z);
    let mut sum = Vec3::ZERO;
    // Both ways of finding the lamp, weighted by the balance heuristic (Veach and Guibas 1995).
    if let Some(s) = bsdf.sample(wo, for_sky) {
        let d = frame.to_world(s.wi);
        let lamp = lamp_pdf(d);
        let share = if s.delta { 1.0 } else { s.pdf / (s.pdf + lamp) };
        sum += s.weight * (sky(d) + LAMP * lamp * share);
    }
    let d = lamp_draw(for_lamp);
    let wi = frame.to_local(d);
    let (f, pdf) = bsdf.eval_pdf(wo, wi);
    let lamp = lamp_pdf(d);
    sum + f * wi.z.abs() * LAMP * lamp / (lamp + pdf)
}

/// One sphere fills the figure; several stand in rows, with their names below.
pub(super) fn draw(scene: &Scene) -> Result<Figure> {
    let side = scene.size as f32;
    let mut pictures = scene
        .shown
        .iter()
        .map(|shown| (shown.name.clone(), pixels(&Sum(vec![shown.model.bsdf()]), scene.space, scene.size)));
    if scene.shown.len() > 1 {
        return sheet(&pictures.collect::<Vec<_>>(), scene.size, 4);
    }
    let mut figure = Figure::new(side, side);
    if let Some((_, pixels)) = pictures.next() {
        figure.picture(Vec2::ZERO, Vec2::splat(side), scene.size, &pixels)?;
    }
    Ok(figure)
}

/// Square pictures of `size` pixels a side, so many in a row at most, with their names below.
pub fn sheet(pictures: &[(String, Vec<Colour>)], size: u32, columns: usize) -> Result<Figure> {
    let columns = pictures.len().clamp(1, columns);
    let names: Vec<Vec<String>> = pictures.iter().map(|(name, _)| wrapped(name, SIDE - 12.0)).collect();
    let lines = names.iter().map(Vec::len).max().unwrap_or(0);
    let step = Vec2::new(SIDE, SIDE + LINE * lines as f32 + 12.0);
    let rows = pictures.len().div_ceil(columns);
    let mut figure = Figure::new(step.x * columns as f32, step.y * rows as f32);
    for (i, ((_, pixels), name)) in pictures.iter().zip(&names).enumerate() {
        let corner = step * Vec2::new((i % columns) as f32, (i / columns) as f32);
        figure.picture(corner, Vec2::splat(SIDE), size, pixels)?;
        for (k, line) in name.iter().enumerate() {
            let at = corner + Vec2::new(0.5 * SIDE, SIDE + LINE * (k as f32 + 0.9));
            figure.text(at.x, at.y, Anchor::Middle, line.as_str());
        }
    }
    Ok(figure)
}

/// Side of a picture among others, in units of the figure.
const SIDE: f32 = 220.0;

/// The picture as `size` rows of `size` pixels; the colours of the lobes are of `space`.
pub fn pixels(bsdf: &Sum, space: ColourSpace, size: u32) -> Vec<Colour> {
    let n = size as usize;
    let draws = (DRAWS.0 * DRAWS.1.pow(2) / size.pow(2)).clamp(DRAWS.0, 4 * DRAWS.0);
    let display = ToneMap::new(space, 0.3, Curve::Aces);
    let rows = super::parallel(n, "sphere", |y| {
        (0..n)
            .map(|x| {
                let pixel = (y * n + x) as u32;
                let mut sum = Vec3::ZERO;
                for i in 0..draws {
                    let (a, b) = (point(pixel, i, 0), point(pixel, i, 1));
                    let film = Vec2::new(x as f32 + b.z, y as f32 + point(pixel, i, 2).x) / n as f32;
                    let at = (2.0 * film - 1.0) * Vec2::new(1.0, -1.0) / FILL;
                    let light = radiance(bsdf, at, a, Vec2::new(b.x, b.y));
                    if light.is_finite() {
                        sum += light;
                    }
                }
                bytes(display.show(sum / draws as f32))
            })
            .collect::<Vec<Colour>>()
    });
    rows.concat()
}
