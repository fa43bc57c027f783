//! The Rusinkiewicz slice at φ_d = 90°, which tells most isotropic materials apart: the highlight at the left, the
//! Fresnel rise at the top, grazing retroreflection at the right. (Burley 2012, "Physically-Based Shading at
//! Disney".)

use super::scale::digits;
use super::{Scene, bytes};
use crate::figure::{Anchor, Figure, INK};
use anyhow::{Result, bail};
use std::f32::consts::FRAC_PI_2;
use yugen_optics::tonemap::into_gamut;
use yugen_optics::{ColourSpace, Vec2, Vec3};
use yugen_reflectance::importance::from_rusinkiewicz;

const SIDE: f32 = 480.0;
const MARGIN: Vec2 = Vec2::new(70.0, 62.0);

pub fn draw(scene: &Scene) -> Result<Figure> {
    let cells = (scene.size * 2 / 3).max(64) as usize;
    let to_srgb = scene.space.matrix_to(ColourSpace::LinearSrgb);
    let rows = super::parallel(cells, "slice", |y| {
        let theta_d = FRAC_PI_2 * (1.0 - (y as f32 + 0.5) / cells as f32);
        let bsdf = scene.model.bsdf();
        (0..cells)
            .map(|x| {
                let theta_h = FRAC_PI_2 * (x as f32 + 0.5) / cells as f32;
                let (wo, wi) = from_rusinkiewicz(theta_h, theta_d, FRAC_PI_2);
                into_gamut(to_srgb * bsdf.eval(wo, wi), ColourSpace::LinearSrgb)
            })
            .collect::<Vec<Vec3>>()
    });
    let values = rows.concat();
    // White is what three values in a hundred exceed: the peak itself may be thousands of times the rest.
    let mut sorted: Vec<f32> = values.iter().map(|v| v.max_element()).filter(|v| v.is_finite()).collect();
    sorted.sort_by(f32::total_cmp);
    let white = sorted.get(sorted.len() * 97 / 100).copied().unwrap_or(0.0);
    if white <= 0.0 {
        bail!("{} has no finite positive value in this slice", scene.title);
    }
    let pixels: Vec<_> = values
        .iter()
        .map(|v| bytes(v.map(|v| if v.is_finite() { scene.scale.unit(v, white) } else { 1.0 })))
        .collect();

    let mut figure = Figure::new(SIDE + MARGIN.x + 40.0, SIDE + MARGIN.y + 64.0);
    figure.picture(MARGIN, Vec2::splat(SIDE), cells as u32, &pixels)?;
    let (low, high) = (MARGIN, MARGIN + SIDE);
    figure.line(vec![low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y), low], INK, 1.0);
    for degrees in [0, 30, 60, 90] {
        let t = SIDE * degrees as f32 / 90.0;
        let (x, y) = (low.x + t, high.y - t);
        figure.line(vec![Vec2::new(x, high.y), Vec2::new(x, high.y + 6.0)], INK, 1.0);
        figure.text(x, high.y + 20.0, Anchor::Middle, format!("{degrees}°"));
        figure.line(vec![Vec2::new(low.x - 6.0, y), Vec2::new(low.x, y)], INK, 1.0);
        figure.text(low.x - 10.0, y + 4.0, Anchor::End, format!("{degrees}°"));
    }
    figure.text((low.x + high.x) / 2.0, high.y + 42.0, Anchor::Middle, "theta_h");
    figure.text(low.x - 14.0, (low.y + high.y) / 2.0 - 45.0, Anchor::End, "theta_d");
    figure.text(20.0, 26.0, Anchor::Start, scene.title.clone());
    figure.text(
        20.0,
        46.0,
        Anchor::Start,
        format!("f at phi_d = 90°, {}, white at {} 1/sr", scene.scale.name(), digits(white)),
    );
    Ok(figure)
}
