//! Suggestive contours: lines that would be contours from a little aside. DeCarlo, Finkelstein, Rusinkiewicz and Santella 2003,
//! "Suggestive Contours for Conveying Shape".
//!
//! With w the part of the direction to the eye in the tangent plane, radial curvature is the normal curvature along w; suggestive
//! contours are its zeros at which it grows towards the eye. They are stable where it grows fast and the surface does not face
//! the eye, and fade to nothing where either ends.

use crate::contour::{Anchor, Line, LineKind, LinePoint, Surface, growth};
use crate::curvature;
use crate::zero_set::zero_chains;
use glam::DVec3;
use yugen_optics::special::smoothstep;

/// Growth of radial curvature over the way towards the eye, times the squared half extent of the mesh, below which a line is not
/// drawn and from which on wholly: a ring whose tube is a third of its radius has up to 20.
const GROWTH: [f32; 2] = [0.6, 4.0];
/// Sine of the angle to the eye likewise: 12 and 24 degrees. What faces the eye has no direction to it.
const ASIDE: [f32; 2] = [0.21, 0.41];

impl Surface<'_> {
    /// Radial curvature at the nodes, above zero along what is convex where normals look to.
    pub fn radial_curvature(&self, to_eye: &dyn Fn(DVec3) -> DVec3) -> Vec<f64> {
        let forms = curvature::forms(self.topology(), &self.positions, &self.normals);
        let at = |i: usize| {
            let (n, eye) = (self.normals[i], to_eye(self.positions[i]));
            curvature::along(&forms[i], n, eye - n * n.dot(eye))
        };
        (0..self.positions.len()).map(at).collect()
    }

    /// The suggestive contours, chained.
    pub fn suggestive_contours(&self, to_eye: &dyn Fn(DVec3) -> DVec3, draw: u32) -> Vec<Line> {
        let topology = self.topology();
        let curvature = self.radial_curvature(to_eye);
        let (low, high) = self
            .positions
            .iter()
            .filter(|p| p.is_finite())
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        let size = 0.5 * (high - low).length();
        // Of a triangle: how strong the line is in it.
        let strength = |t: u32| -> f32 {
            let corner = topology.triangles[t as usize].map(|n| n as usize);
            let [p, n] = [&self.positions, &self.normals].map(|of| corner.map(|i| of[i]));
            let (middle, normal) = ((p[0] + p[1] + p[2]) / 3.0, (n[0] + n[1] + n[2]).normalize_or_zero());
            let eye = to_eye(middle).normalize_or_zero();
            let w = eye - normal * normal.dot(eye);
            // Of a sheet seen from behind what is convex is hollow.
            let facing = if normal.dot(eye) < 0.0 { -1.0 } else { 1.0 };
            let grows = facing * growth(p, corner.map(|i| curvature[i]), w.normalize_or_zero()) * size * size;
            // Of a solid the far side is hidden.
            if topology.closed && normal.dot(eye) * self.side() < 0.0 {
                return 0.0;
            }
            smoothstep(GROWTH[0], GROWTH[1], grows as f32) * smoothstep(ASIDE[0], ASIDE[1], w.length() as f32)
        };
        let mut lines = Vec::new();
        for chain in zero_chains(topology, &curvature) {
            let of: Vec<f32> = chain.triangles.iter().map(|t| strength(*t)).collect();
            let n = chain.edges.len();
            // At a crossing as strong as the weaker of both sides; ends of an open chain as their only one.
            let at: Vec<f32> = (0..n)
                .map(|i| {
                    let before =
                        if i > 0 { Some(of[i - 1]) } else { of.last().copied().filter(|_| chain.closed) };
                    let after = of.get(i).copied();
                    before.or(after).unwrap_or(0.0).min(after.or(before).unwrap_or(0.0))
                })
                .collect();
            let point = |i: usize| {
                let [a, b] = topology.edges[chain.edges[i] as usize].nodes.map(|n| n as usize);
                let part = curvature[a] / (curvature[a] - curvature[b]);
                LinePoint {
                    position: self.positions[a].lerp(self.positions[b], part),
                    outward: self.normals[a].lerp(self.normals[b], part),
                    ends: [self.positions[a], self.positions[b]],
                    anchor: Anchor { vertices: [a, b].map(|n| topology.vertices[n]), part: part as f32 },
                    possible: true,
                    silhouette: false,
                    strength: at[i],
                }
            };
            // Runs of points that are there at all; around a closed chain from one that is not.
            let start = if chain.closed { at.iter().position(|s| *s <= 0.0) } else { Some(0) };
            let walk: Vec<usize> = (0..n).map(|i| (start.unwrap_or(0) + i) % n).collect();
            let kind = LineKind::Suggestive;
            for run in walk.split(|i| at[*i] <= 0.0).filter(|run| run.len() > 1) {
                let points = run.iter().map(|i| point(*i)).collect();
                lines.push(Line { kind, draw, points, closed: chain.closed && start.is_none() });
            }
        }
        lines
    }
}
