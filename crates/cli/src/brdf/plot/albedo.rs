//! Directional albedo against angle.

use super::Scene;
use super::scale::{Scale, digits};
use crate::figure::{Anchor, CHANNELS, CURVES, Figure, INK, RULE};
use anyhow::{Result, bail};
use yugen_optics::frame::spherical;
use yugen_optics::{Vec2, Vec3};

const PLOT: Vec2 = Vec2::new(620.0, 360.0);
const MARGIN: Vec2 = Vec2::new(64.0, 66.0);

pub fn draw(scene: &Scene) -> Result<Figure> {
    // The last one as near to grazing as the quadrature is sure of.
    let degrees: Vec<f32> = (0..30).map(|i| 3.0 * i as f32).chain([88.5]).collect();
    let albedos: Vec<Vec3> = super::parallel(degrees.len(), "albedo", |i| {
        yugen_proof::furnace(&scene.model.bsdf(), spherical(degrees[i].to_radians(), scene.phi))
    });
    let most = albedos.iter().fold(0.0f32, |a, v| a.max(v.max_element()));
    if !most.is_finite() {
        bail!("{} has an albedo that is not finite", scene.title);
    }
    // At least to one, the bound of energy.
    let top = if most <= 1.005 { 1.0 } else { most * 1.05 };

    let mut figure = Figure::new(PLOT.x + MARGIN.x + 36.0, PLOT.y + MARGIN.y + 60.0);
    let at = |degrees: f32, v: f32| MARGIN + Vec2::new(degrees / 90.0 * PLOT.x, PLOT.y * (1.0 - v / top));
    for tick in [0.0].into_iter().chain(Scale::Linear.ticks(top)) {
        figure.line(vec![at(0.0, tick), at(90.0, tick)], RULE, if tick == 0.0 { 1.6 } else { 0.8 });
        let p = at(0.0, tick);
        figure.text(p.x - 8.0, p.y + 4.0, Anchor::End, digits(tick));
    }
    for d in (0..=90).step_by(15) {
        let d = d as f32;
        figure.line(vec![at(d, 0.0), at(d, top)], RULE, if d == 0.0 { 1.6 } else { 0.8 });
        let p = at(d, 0.0);
        figure.text(p.x, p.y + 20.0, Anchor::Middle, format!("{d}°"));
    }
    figure.dashes(vec![at(0.0, 1.0), at(90.0, 1.0)], INK, 1.0);
    let coloured = albedos.iter().any(|v| Scene::coloured(*v));
    for c in 0..if coloured { 3 } else { 1 } {
        let curve = degrees.iter().zip(&albedos).map(|(d, v)| at(*d, v[c])).collect();
        figure.line(curve, if coloured { CHANNELS[c] } else { CURVES[0] }, 2.2);
    }
    let p = at(45.0, 0.0);
    figure.text(p.x, p.y + 44.0, Anchor::Middle, "angle of the eye from the normal");
    figure.text(20.0, 26.0, Anchor::Start, scene.title.clone());
    let what = if coloured { ": red, green, blue" } else { "" };
    // f of what passes through is that of radiance, which changes with the square of the index.
    let how =
        if scene.model.bsdf().laws().transmits { ", light from within over the index squared" } else { "" };
    figure.text(20.0, 46.0, Anchor::Start, format!("directional albedo{what}{how}"));
    Ok(figure)
}
