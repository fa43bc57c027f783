//! The lobe in three dimensions: a surface as far from the origin as the value is large.

use super::plane::clustered;
use super::{Scene, Shown};
use crate::figure::scale::digits;
use crate::figure::{Anchor, Figure, INK, RULE};
use anyhow::{Result, bail};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use yugen_optics::frame::spherical;
use yugen_optics::{Vec2, Vec3};

const WIDTH: f32 = 720.0;
const RADIUS: f32 = 300.0;
/// Where the eye stands: aside of the plane of incidence and a little above the surface.
const EYE: (f32, f32) = (65.0 * PI / 180.0, -70.0 * PI / 180.0);

pub fn draw(scene: &Scene, shown: &Shown) -> Result<Figure> {
    let theta_i = scene.theta_i[0];
    let wi = spherical(theta_i, scene.phi + PI);
    let transmits = scene.transmits();
    let height = if transmits { 700.0 } else { 520.0 };
    let mut figure = Figure::new(WIDTH, height);
    let origin = Vec2::new(WIDTH / 2.0, if transmits { height / 2.0 + 20.0 } else { height - 150.0 });

    // Orthographic, from `eye`; turned with the plane of incidence so that it is always seen from aside.
    let eye = spherical(EYE.0, EYE.1 + scene.phi);
    let right = Vec3::Z.cross(eye).normalize();
    let up = eye.cross(right);
    let project = |p: Vec3| origin + RADIUS * Vec2::new(p.dot(right), -p.dot(up));

    // Nodes over polar angle and azimuth, close around the peak in the plane of incidence.
    let top = FRAC_PI_2 - 1e-4;
    let length = |v: Vec3| scene.space.luminance(v);
    let peak = |low: f32, high: f32| {
        let at = |i: usize| low + (high - low) * i as f32 / 4000.0;
        let scan: Vec<f32> =
            (0..=4000).map(|i| length(scene.value(shown, spherical(at(i), scene.phi), wi))).collect();
        let best = (0..=4000).max_by(|&a, &b| scan[a].total_cmp(&scan[b])).unwrap_or(0);
        // As wide as it is at half its height.
        let width = scan.iter().filter(|v| **v > 0.5 * scan[best]).count() as f32 * (high - low) / 4000.0;
        (at(best), width.clamp(0.01, 0.5))
    };
    let (theta, width) = peak(0.0, top);
    let mut thetas = clustered(96, 0.0, top, theta, width);
    let mut across = width / theta.sin().max(0.1);
    if transmits {
        let (theta, width) = peak(PI - top, PI);
        thetas.extend(clustered(96, PI - top, PI, theta, width));
        across = across.min(width / theta.sin().max(0.1));
    }
    let phis = clustered(160, -PI, PI, 0.0, across);
    let nodes: Vec<Vec<(Vec3, Vec3)>> = thetas
        .iter()
        .map(|&theta| {
            phis.iter()
                .map(|&phi| {
                    let wo = spherical(theta, phi + scene.phi);
                    (wo, scene.value(shown, wo, wi))
                })
                .collect()
        })
        .collect();
    let max = nodes.iter().flatten().fold(0.0f32, |a, (_, v)| a.max(length(*v)));
    if !max.is_finite() || max <= 0.0 {
        bail!("{} has no finite positive value at this angle", shown.name);
    }
    let point = |&(wo, v): &(Vec3, Vec3)| wo * scene.scale.unit(length(v), max);

    // The lamp of the picture shines over the eye's shoulder; the colour is that of the value.
    let lamp = (eye + 0.6 * up - 0.5 * right).normalize();
    let mut facets = Vec::new();
    for rows in nodes.windows(2) {
        if rows[0][0].0.z > 0.0 && rows[1][0].0.z < 0.0 {
            continue;
        }
        for j in 0..phis.len() - 1 {
            let corners = [&rows[0][j], &rows[1][j], &rows[1][j + 1], &rows[0][j + 1]];
            let p = corners.map(point);
            let cross = (p[2] - p[0]).cross(p[3] - p[1]);
            if cross.length_squared() < 1e-14 {
                continue;
            }
            let middle = p.iter().sum::<Vec3>() / 4.0;
            let value = corners.iter().map(|c| c.1).sum::<Vec3>();
            // Outwards; what is turned away is hidden by the rest, as every ray from the origin meets the lobe once.
            // Facets turned away a little make a rim without steps.
            let normal = cross.normalize() * cross.dot(middle).signum();
            if normal.dot(eye) <= -0.4 {
                continue;
            }
            let light = 0.25 + 0.75 * normal.dot(lamp).max(0.0);
            let hue = value / value.max_element().max(f32::MIN_POSITIVE);
            facets.push((middle, p.map(project).to_vec(), scene.display(hue * 0.85 * light)));
        }
    }
    facets.sort_by(|a, b| a.0.dot(eye).total_cmp(&b.0.dot(eye)));

    let (above, below): (Vec<_>, Vec<_>) = facets.into_iter().partition(|f| f.0.z >= 0.0);
    for (_, corners, colour) in below {
        figure.area(corners, colour, 1.0);
    }
    // The surface: a disc with its rings, the tangent and the plane of incidence.
    let ring = |r: f32| (0..=96).map(|i| project(r * spherical(FRAC_PI_2, i as f32 / 96.0 * TAU))).collect();
    figure.area(ring(1.0), [238, 240, 244], if transmits { 0.7 } else { 1.0 });
    for r in [0.25, 0.5, 0.75, 1.0] {
        figure.line(ring(r), RULE, 1.0);
    }
    for i in 0..12 {
        let spoke = spherical(FRAC_PI_2, i as f32 / 6.0 * PI);
        figure.line(vec![project(Vec3::ZERO), project(spoke)], RULE, 0.7);
    }
    let tangent = project(1.12 * Vec3::X);
    figure.line(vec![project(Vec3::ZERO), project(1.06 * Vec3::X)], INK, 1.2);
    figure.text(tangent.x, tangent.y + 5.0, Anchor::Middle, "x");
    let normal = project(1.12 * Vec3::Z);
    figure.dashes(vec![project(Vec3::ZERO), project(1.08 * Vec3::Z)], INK, 1.0);
    figure.text(normal.x, normal.y, Anchor::Middle, "n");
    // The light comes in as far as the surface of the lobe.
    let inside = scene.scale.unit(length(scene.value(shown, wi, wi)), max);
    for (_, corners, colour) in above {
        figure.area(corners, colour, 1.0);
    }
    figure.arrow(project((inside + 0.35).max(1.15) * wi), project(inside * wi), INK);

    let caption = format!(
        "{}, {}; light at {}°, longest {} 1/sr",
        scene.value.name(),
        scene.scale.name(),
        digits(theta_i.to_degrees()),
        digits(max)
    );
    figure.heading(&[&shown.name, &caption]);
    Ok(figure)
}
