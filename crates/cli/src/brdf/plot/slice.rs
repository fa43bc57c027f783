//! The Rusinkiewicz slice at φ_d = 90°, which tells most isotropic materials apart: the highlight at the left, the
//! Fresnel rise at the top, grazing retroreflection at the right. (Burley 2012, "Physically-Based Shading at
//! Disney".)

use super::{Scene, bytes};
use crate::figure::colours::{bar, bar_width, grey, ticks};
use crate::figure::{Anchor, Colour, Figure, INK, LINE, wrapped};
use anyhow::{Result, bail};
use std::f32::consts::FRAC_PI_2;
use yugen_optics::tonemap::into_gamut;
use yugen_optics::{ColourSpace, Vec2, Vec3};
use yugen_reflectance::importance::from_rusinkiewicz;

/// Side of a slice that stands alone, and of one among others.
const SIDES: (f32, f32) = (480.0, 220.0);
/// Left of a slice, for its axis.
const LEFT: f32 = 76.0;
/// Below it.
const FOOT: f32 = 50.0;
const COLUMNS: usize = 3;

/// A slice as a picture: rows of `cells` colours, θ_d falling, θ_h rising.
pub struct Panel {
    pub name: String,
    pub pixels: Vec<Colour>,
}

/// What a bar says of the colours of all panels.
pub struct Key<'a> {
    pub colour: &'a dyn Fn(f32) -> Colour,
    pub ticks: Vec<(f32, f32)>,
    pub label: String,
}

/// Angles at the centre of cell (x, y) of `cells` a side: θ_h, θ_d.
pub fn angles(x: usize, y: usize, cells: usize) -> (f32, f32) {
    let at = |i: usize| FRAC_PI_2 * (i as f32 + 0.5) / cells as f32;
    (at(x), FRAC_PI_2 - at(y))
}

/// Panels beside each other with their axes and one bar.
pub fn sheet(heading: &[String], panels: &[Panel], cells: usize, key: &Key) -> Result<Figure> {
    let columns = panels.len().clamp(1, COLUMNS);
    let side = if panels.len() == 1 { SIDES.0 } else { SIDES.1 };
    let names = panels.iter().map(|p| wrapped(&p.name, side + 20.0).len()).max().unwrap_or(0);
    let named = if panels.len() > 1 { LINE * names as f32 } else { 0.0 };
    let ticks: Vec<f32> = key.ticks.iter().map(|t| t.0).collect();
    let width = columns as f32 * (side + LEFT) + 24.0 + bar_width(&ticks) + 10.0;
    let lines: Vec<&str> = heading.iter().map(String::as_str).collect();
    let head: usize = lines.iter().map(|l| wrapped(l, width - 40.0).len()).sum();
    let above = 16.0 + LINE * head as f32;
    let step = named + side + FOOT;
    let mut figure = Figure::new(width, above + 14.0 + step * panels.len().div_ceil(columns) as f32);
    figure.heading(&lines);
    for (i, panel) in panels.iter().enumerate() {
        let corner = Vec2::new(
            LEFT + (side + LEFT) * (i % columns) as f32,
            above + 14.0 + named + step * (i / columns) as f32,
        );
        if panels.len() > 1 {
            for (k, line) in wrapped(&panel.name, side + 20.0).into_iter().enumerate() {
                let y = corner.y - named + LINE * (k as f32 + 0.6);
                figure.text(corner.x + 0.5 * side, y, Anchor::Middle, line);
            }
        }
        figure.picture(corner, Vec2::splat(side), cells as u32, &panel.pixels)?;
        let (low, high) = (corner, corner + side);
        figure.line(vec![low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y), low], INK, 1.0);
        for degrees in [0, 30, 60, 90] {
            let t = side * degrees as f32 / 90.0;
            let (x, y) = (low.x + t, high.y - t);
            figure.line(vec![Vec2::new(x, high.y), Vec2::new(x, high.y + 5.0)], INK, 1.0);
            figure.text(x, high.y + 20.0, Anchor::Middle, format!("{degrees}°"));
            figure.line(vec![Vec2::new(low.x - 5.0, y), Vec2::new(low.x, y)], INK, 1.0);
            figure.text(low.x - 9.0, y + 5.0, Anchor::End, format!("{degrees}°"));
        }
        figure.text((low.x + high.x) / 2.0, high.y + 40.0, Anchor::Middle, "theta_h");
        figure.upwards(low.x - 54.0, (low.y + high.y) / 2.0, "theta_d");
    }
    let at = Vec2::new(columns as f32 * (side + LEFT) + 24.0, above + 14.0 + named);
    bar(&mut figure, at, side, key.colour, &key.ticks, &key.label)?;
    Ok(figure)
}

pub(super) fn draw(scene: &Scene) -> Result<Figure> {
    let share = if scene.shown.len() == 1 { 1.5 } else { 3.0 };
    let cells = (scene.size as f32 / share).max(64.0) as usize;
    let to_srgb = scene.space.matrix_to(ColourSpace::LinearSrgb);
    let rows = super::parallel(cells * scene.shown.len(), "slice", |row| {
        let bsdf = scene.shown[row / cells].model.bsdf();
        (0..cells)
            .map(|x| {
                let (theta_h, theta_d) = angles(x, row % cells, cells);
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
        bail!("{} has no finite positive value in this slice", scene.shown[0].name);
    }
    let show = |v: &Vec3| bytes(v.map(|v| if v.is_finite() { scene.scale.unit(v, white) } else { 1.0 }));
    let panels: Vec<Panel> = scene
        .shown
        .iter()
        .zip(values.chunks_exact(cells * cells))
        .map(|(shown, values)| Panel { name: shown.name.clone(), pixels: values.iter().map(show).collect() })
        .collect();
    let mut heading = scene.titles();
    heading.push(format!("f at phi_d = 90°, {}", scene.scale.name()));
    let key = Key { colour: &grey, ticks: ticks(scene.scale, white), label: "f, 1/sr".into() };
    sheet(&heading, &panels, cells, &key)
}
