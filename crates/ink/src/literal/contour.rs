//! Contouring (gou): a silhouette segment for each triangle, pressure by the circular mapping, depth with a bias.

use super::{Padi, constant};
use crate::contour::Surface;
use crate::depth::DepthMap;
use crate::projection::Projection;
use crate::topology::Topology;
use glam::{DVec3, Vec2};

/// A silhouette segment of a triangle in the world, and θ of the normal at its ends.
pub type Segment = [(DVec3, f32); 2];

/// Silhouettes, a segment for each triangle: λ = N₁·V / (N₁·V − N₂·V) with one V for all.
pub fn silhouettes(
    surface: &Surface,
    topology: &Topology,
    v: DVec3,
    theta: impl Fn(DVec3, DVec3) -> f32,
) -> Vec<Segment> {
    let mut segments = Vec::new();
    for t in &topology.triangles {
        let [p, n] = [&surface.positions, &surface.normals].map(|a| t.map(|i| a[i as usize]));
        let g = n.map(|n| n.dot(v));
        let mut ends = (0..3).filter_map(|i| {
            let j = (i + 1) % 3;
            (g[i] * g[j] <= 0.0 && g[i] != g[j]).then(|| {
                let lambda = g[i] / (g[i] - g[j]);
                let place = p[i].lerp(p[j], lambda);
                (place, theta(place, n[i].lerp(n[j], lambda)))
            })
        });
        if let (Some(a), Some(b)) = (ends.next(), ends.next()) {
            segments.push([a, b]);
        }
    }
    segments
}

/// First pass: the brush's state at each pixel that a segment covers and that is not hidden. `phi` shifts the pressure.
pub fn padi(segments: &[Segment], projection: &Projection, map: &DepthMap, phi: f32) -> Vec<Padi> {
    let [w, h] = map.size;
    let mut pixels = vec![Padi::default(); (w * h) as usize];
    for [a, b] in segments {
        let Some([from, to]) = projection.clip_near(a.0, b.0) else { continue };
        let ends = [from, to].map(|t| (projection.project(a.0.lerp(b.0, t)), a.1 + (b.1 - a.1) * t as f32));
        let [(Some(p), mut theta_a), (Some(q), mut theta_b)] = ends else { continue };
        let (mut from, mut to) = (p, q);
        // In the direction in which θ grows.
        if theta_b < theta_a {
            (from, to, theta_a, theta_b) = (q, p, theta_b, theta_a);
        }
        let way = (to.pixel - from.pixel).as_vec2();
        let steps = (way.abs().max_element().ceil() as usize).clamp(1, 1 << 13);
        for k in 0..=steps {
            let t = k as f32 / steps as f32;
            let pixel = from.pixel.as_vec2() + way * t;
            let inside = pixel.cmpge(Vec2::ZERO).all() && pixel.x < w as f32 && pixel.y < h as f32;
            let depth = (from.depth + (to.depth - from.depth) * f64::from(t)) as f32;
            if !inside || map.at(pixel).0 < depth * (1.0 - constant::Z_BIAS) {
                continue;
            }
            let theta = theta_a + (theta_b - theta_a) * t;
            pixels[(pixel.y as u32 * w + pixel.x as u32) as usize] = Padi {
                pressure: constant::A * (constant::OMEGA * theta + phi).sin() + constant::T,
                angle: way.to_angle(),
                dryness: constant::DRYNESS,
                intensity: constant::INTENSITY,
            };
        }
    }
    pixels
}
