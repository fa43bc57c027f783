//! The values in the plane of incidence, as curves over the angle of the eye.

use super::{Scene, Shown};
use crate::figure::CHANNELS;
use crate::figure::curve::{Curve, Look, MOST};
use crate::figure::scale::digits;
use anyhow::{Result, bail};
use std::f32::consts::{FRAC_PI_2, PI};
use yugen_optics::Vec3;
use yugen_optics::frame::spherical;

/// `n` numbers from `low` to `high`, half of them even and half within about `width` of `centre`.
pub fn clustered(n: usize, low: f32, high: f32, centre: f32, width: f32) -> Vec<f32> {
    let (a, b) = (((low - centre) / width).atan(), ((high - centre) / width).atan());
    let half = n / 2;
    let mut all: Vec<f32> = (0..=half).map(|i| low + (high - low) * i as f32 / half as f32).collect();
    all.extend((1..half).map(|i| centre + width * (a + (b - a) * i as f32 / half as f32).tan()));
    all.sort_by(f32::total_cmp);
    all
}

/// Pairs of a model and an angle of incidence, each with the look and the name of its curve. One model at several
/// angles has a colour for each; of several models each has a colour, and angles are told apart by dashes.
pub fn pairs(scene: &Scene) -> Result<Vec<(&Shown, f32, Look, String)>> {
    let (models, angles) = (scene.shown.len(), scene.theta_i.len());
    if models * angles > MOST {
        bail!("{models} models at {angles} angles are more curves than the {MOST} that a figure tells apart");
    }
    let mut all = Vec::new();
    for (m, shown) in scene.shown.iter().enumerate() {
        for (a, &theta) in scene.theta_i.iter().enumerate() {
            let light = format!("light at {}°", digits(theta.to_degrees()));
            let (look, name) = match (models, angles) {
                (1, _) => (Look::nth(a), light),
                (_, 1) => (Look::beside(m), shown.name.clone()),
                _ if models > 6 => (Look::nth(m * angles + a), format!("{}, {light}", shown.name)),
                _ => (Look::of(m, a), format!("{}, {light}", shown.name)),
            };
            all.push((shown, theta, look, name));
        }
    }
    Ok(all)
}

/// The curves over degrees from −`reach` to `reach` (radians), positive towards the mirror direction, and whether their
/// values are those of channels and not luminances. Nodes are as close as `scene.scale` needs.
pub fn curves(scene: &Scene, reach: f32) -> Result<(Vec<Curve>, bool)> {
    let value = |shown: &Shown, theta: f32, angle: f32| {
        // Just off the horizon, where f still has a meaning; above it where nothing is seen from below.
        let from_horizon = angle.abs() - FRAC_PI_2;
        let side = if reach > FRAC_PI_2 { from_horizon } else { -1.0 };
        let polar = FRAC_PI_2 + from_horizon.abs().max(1e-4).copysign(side);
        let wo = spherical(polar, if angle < 0.0 { scene.phi + PI } else { scene.phi });
        (angle, scene.value(shown, wo, spherical(theta, scene.phi + PI)))
    };
    let pairs = pairs(scene)?;
    let mut lobes: Vec<Vec<(f32, Vec3)>> = pairs
        .iter()
        .map(|(shown, theta, ..)| {
            let nodes = clustered(1440, -reach, reach, *theta, 0.04);
            nodes.into_iter().map(|a| value(shown, *theta, a)).collect()
        })
        .collect();
    let highest = |lobe: &[(f32, Vec3)]| lobe.iter().fold(0.0f32, |a, (_, v)| a.max(v.max_element()));
    let all = lobes.iter().map(|lobe| highest(lobe)).fold(0.0, f32::max);
    for (lobe, (shown, ..)) in lobes.iter().zip(&pairs) {
        let most = highest(lobe);
        if !most.is_finite() || most <= 0.0 {
            bail!("{} has no finite positive value in the plane of incidence", shown.name);
        }
    }

    // Nodes halve their distance where the curve runs far from one to the next: a sharp peak needs that.
    for (lobe, (shown, theta, ..)) in lobes.iter_mut().zip(&pairs) {
        let max = if scene.relative { highest(lobe) } else { all };
        let length = |v: Vec3| scene.scale.unit(v.max_element(), max);
        for _ in 0..8 {
            let far = |a: &(f32, Vec3), b: &(f32, Vec3)| (length(a.1) - length(b.1)).abs() > 0.02;
            let more: Vec<_> = lobe
                .windows(2)
                .filter(|w| far(&w[0], &w[1]))
                .map(|w| value(shown, *theta, (w[0].0 + w[1].0) / 2.0))
                .collect();
            lobe.extend(more);
            lobe.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
    }

    let single = pairs.len() == 1;
    let coloured = single && lobes.iter().flatten().any(|(_, v)| Scene::coloured(*v));
    let mut curves = Vec::new();
    for (lobe, (shown, theta, look, name)) in lobes.iter().zip(&pairs) {
        let mut curve = |of: &dyn Fn(Vec3) -> f32, look: Look, name: String| {
            let mut points: Vec<(f32, f32)> = lobe.iter().map(|(a, v)| (a.to_degrees(), of(*v))).collect();
            let mut peak = Curve::top(&points).map(|top| {
                // Between its neighbours the highest point is found by thirds.
                let at = |angle: f32| of(value(shown, *theta, angle.to_radians()).1);
                let (mut low, mut high) = (points[top - 1].0, points[top + 1].0);
                while high - low > 0.02 {
                    let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                    if at(a) < at(b) { low = a } else { high = b }
                }
                (0.5 * (low + high), at(0.5 * (low + high)).max(points[top].1))
            });
            if scene.relative {
                let most = points.iter().fold(f32::MIN_POSITIVE, |a, p| a.max(p.1));
                points.iter_mut().chain(&mut peak).for_each(|p| p.1 /= most);
            }
            curves.push(Curve { name, look, points, peak });
        };
        if coloured {
            for (c, colour) in CHANNELS.into_iter().enumerate() {
                let name = format!("{name}, {}", ["red", "green", "blue"][c]);
                curve(&|v| v[c], Look { colour, ..*look }, name);
            }
        } else {
            curve(&|v| scene.space.luminance(v), *look, name.clone());
        }
    }
    Ok((curves, coloured))
}
