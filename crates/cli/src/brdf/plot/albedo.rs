//! Directional albedo against angle.

use super::Scene;
use crate::figure::chart::{Across, Chart};
use crate::figure::curve::{Curve, Look, MOST};
use crate::figure::{CHANNELS, Figure};
use anyhow::{Result, bail};
use yugen_optics::Vec3;
use yugen_optics::frame::spherical;

pub fn draw(scene: &Scene) -> Result<Figure> {
    let count = scene.shown.len();
    if count > MOST {
        bail!("{count} models are more curves than the {MOST} that a figure tells apart");
    }
    // The last one as near to grazing as the quadrature is sure of.
    let degrees: Vec<f32> = (0..30).map(|i| 3.0 * i as f32).chain([88.5]).collect();
    let n = degrees.len();
    let albedos: Vec<Vec3> = super::parallel(n * count, "albedo", |i| {
        let wo = spherical(degrees[i % n].to_radians(), scene.phi);
        yugen_proof::furnace(&scene.shown[i / n].model.bsdf(), wo)
    });
    let mut curves = Vec::new();
    let mut any_colour = false;
    for (i, (shown, albedos)) in scene.shown.iter().zip(albedos.chunks_exact(n)).enumerate() {
        if !albedos.iter().all(|v| v.is_finite()) {
            bail!("{} has an albedo that is not finite", shown.name);
        }
        let mut curve = |of: &dyn Fn(Vec3) -> f32, look: Look, name: String| {
            let points = degrees.iter().zip(albedos).map(|(d, v)| (*d, of(*v))).collect();
            curves.push(Curve { name, look, points, peak: None });
        };
        if count == 1 && albedos.iter().any(|v| Scene::coloured(*v)) {
            any_colour = true;
            for (c, colour) in CHANNELS.into_iter().enumerate() {
                curve(&|v| v[c], Look { colour, ..Look::nth(0) }, ["red", "green", "blue"][c].into());
            }
        } else {
            let name = if count == 1 { String::new() } else { shown.name.clone() };
            curve(&|v| scene.space.luminance(v), Look::beside(i), name);
        }
    }
    let most = curves.iter().flat_map(|c| &c.points).fold(0.0f32, |a, (_, v)| a.max(*v));
    let mut heading = scene.titles();
    let what = if any_colour || count == 1 { "" } else { ", luminance" };
    // f of what passes through is that of radiance, which changes with the square of the index.
    let how = if scene.transmits() { ", light from within over the index squared" } else { "" };
    heading.push(format!("directional albedo{what}{how}"));
    let chart = Chart {
        heading,
        across: Across::degrees("angle of the eye from the normal", 0.0, 90.0),
        upwards: "albedo".into(),
        scale: scene.scale,
        // At least to one, the bound of energy.
        top: most.max(1.0) * 1.05,
        marks: vec![1.0],
        posts: Vec::new(),
    };
    Ok(chart.draw(&curves))
}
