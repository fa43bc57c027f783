//! The lobe in the plane of incidence.

use super::lobe::clustered;
use super::scale::digits;
use super::{Colour, Scene};
use crate::figure::{Anchor, CHANNELS, CURVES, Figure, INK, RULE};
use anyhow::{Result, bail};
use std::f32::consts::{FRAC_PI_2, PI};
use yugen_optics::frame::spherical;
use yugen_optics::{Vec2, Vec3};

const WIDTH: f32 = 720.0;
const RADIUS: f32 = 290.0;

pub fn draw(scene: &Scene) -> Result<Figure> {
    // A model that lets light through is seen from below too.
    let reach = if scene.model.bsdf().laws().transmits { PI } else { FRAC_PI_2 };
    let height = if reach > FRAC_PI_2 { 2.0 * RADIUS + 130.0 } else { RADIUS + 150.0 };
    let mut figure = Figure::new(WIDTH, height);
    let centre = Vec2::new(WIDTH / 2.0, RADIUS + 75.0);
    // Angles from the normal, towards the mirror direction.
    let at = |angle: f32, r: f32| centre + r * RADIUS * Vec2::new(angle.sin(), -angle.cos());

    let value = |theta: f32, angle: f32| {
        // Just off the horizon, where f still has a meaning.
        let from_horizon = angle.abs() - FRAC_PI_2;
        let polar = FRAC_PI_2 + from_horizon.abs().max(1e-4).copysign(from_horizon);
        let wo = spherical(polar, if angle < 0.0 { scene.phi + PI } else { scene.phi });
        (angle, scene.value(wo, spherical(theta, scene.phi + PI)))
    };
    let mut lobes: Vec<Vec<(f32, Vec3)>> = scene
        .theta_i
        .iter()
        .map(|&theta| {
            clustered(1440, -reach, reach, theta, 0.04).into_iter().map(|a| value(theta, a)).collect()
        })
        .collect();
    let max = lobes.iter().flatten().fold(0.0f32, |a, (_, v)| a.max(v.max_element()));
    if !max.is_finite() || max <= 0.0 {
        bail!("{} has no finite positive value in the plane of incidence", scene.title);
    }

    // Nodes halve their distance where the curve runs far from one to the next: a sharp peak needs that.
    for (lobe, &theta) in lobes.iter_mut().zip(&scene.theta_i) {
        let length = |v: Vec3| scene.scale.unit(v.max_element(), max);
        for _ in 0..8 {
            let far = |a: &(f32, Vec3), b: &(f32, Vec3)| (length(a.1) - length(b.1)).abs() > 0.02;
            let more: Vec<_> = lobe
                .windows(2)
                .filter(|w| far(&w[0], &w[1]))
                .map(|w| value(theta, (w[0].0 + w[1].0) / 2.0))
                .collect();
            lobe.extend(more);
            lobe.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
    }

    // Rings, spokes and what they mean.
    for tick in scene.scale.ticks(max) {
        let r = scene.scale.unit(tick, max);
        figure.line((-90..=90).map(|i| at(i as f32 / 90.0 * reach, r)).collect(), RULE, 1.0);
    }
    figure.line((-90..=90).map(|i| at(i as f32 / 90.0 * reach, 1.0)).collect(), RULE, 1.0);
    let spokes = (reach.to_degrees() / 15.0).round() as i32;
    for i in -spokes..=spokes {
        let degrees = 15 * i;
        if degrees == -180 {
            continue;
        }
        let angle = (degrees as f32).to_radians();
        figure.line(vec![at(angle, 0.0), at(angle, 1.0)], RULE, if degrees % 90 == 0 { 1.6 } else { 0.7 });
        if degrees % 30 == 0 {
            let p = at(angle, 1.045);
            let anchor = match degrees {
                -180 | 0 | 180 => Anchor::Middle,
                d if d < 0 => Anchor::End,
                _ => Anchor::Start,
            };
            figure.text(p.x, p.y + 4.0 - 2.0 * angle.cos(), anchor, format!("{}°", degrees.abs()));
        }
    }

    let single = lobes.len() == 1;
    let coloured = lobes.iter().flatten().any(|(_, v)| Scene::coloured(*v));
    for (i, lobe) in lobes.iter().enumerate() {
        let mut curve = |value: &dyn Fn(Vec3) -> f32, colour: Colour| {
            let mut outline: Vec<Vec2> =
                lobe.iter().map(|(a, v)| at(*a, scene.scale.unit(value(*v), max))).collect();
            // What lies closer together than the eye can tell makes a file large and nothing else.
            outline.dedup_by(|next, kept| next.distance_squared(*kept) < 0.25);
            let mut area = outline.clone();
            area.push(centre);
            figure.area(area, colour, 0.10);
            figure.line(outline, colour, 2.0);
        };
        if single && coloured {
            for (c, colour) in CHANNELS.iter().enumerate() {
                curve(&|v| v[c], *colour);
            }
        } else {
            curve(&|v| scene.space.luminance(v), CURVES[i % CURVES.len()]);
        }
    }
    for (i, &theta) in scene.theta_i.iter().enumerate() {
        let colour = if single { INK } else { CURVES[i % CURVES.len()] };
        figure.dashes(vec![at(-theta, 0.7), at(-theta, 0.0)], colour, 1.0);
        figure.arrow(at(-theta, 1.0), at(-theta, 0.7), colour);
    }
    for tick in scene.scale.ticks(max) {
        let r = scene.scale.unit(tick, max);
        // At the rim stands 0°.
        if r > 0.96 {
            continue;
        }
        let p = at(0.0, r);
        figure.text(p.x + 4.0, p.y - 3.0, Anchor::Start, digits(tick));
    }

    figure.text(20.0, 26.0, Anchor::Start, scene.title.clone());
    let what = if single && coloured { "red, green, blue" } else { "luminance" };
    let caption = format!("{}, 1/sr, {what}; {}", scene.value.name(), scene.scale.name());
    figure.text(20.0, 46.0, Anchor::Start, caption);
    let bottom = height - 18.0;
    let step = (WIDTH - 40.0) / scene.theta_i.len().max(4) as f32;
    for (i, theta) in scene.theta_i.iter().enumerate() {
        let x = 20.0 + step * i as f32;
        let colour = if single { INK } else { CURVES[i % CURVES.len()] };
        figure.line(vec![Vec2::new(x, bottom - 5.0), Vec2::new(x + 22.0, bottom - 5.0)], colour, 2.5);
        figure.text(x + 28.0, bottom, Anchor::Start, format!("light at {}°", digits(theta.to_degrees())));
    }
    Ok(figure)
}
