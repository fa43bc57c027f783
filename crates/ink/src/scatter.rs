//! Places strewn over surfaces, so many to each pixel of the picture, that stay where they are on the surface.
//!
//! Every triangle has an endless list of places, drawn once for all; of it as many are taken as the triangle is large in the
//! picture. When it grows more are added, and those that are added or dropped fade. Strewn over the picture instead, marks
//! would hang in the air while surfaces move under them (the shower-door effect; Meier 1996, "Painterly Rendering for
//! Animation").

use crate::contour::to_world;
use crate::control::Controls;
use crate::depth::DepthMap;
use crate::mask;
use crate::place_controls::PlaceControls;
use crate::projection::Projection;
use crate::tone::Tones;
use glam::{DVec3, Vec2};
use std::collections::HashSet;
use yugen_optics::random::{hash_combine, unit_f32};
use yugen_scene::prepared::{MeshRow, Rows};

/// Relative depth within which a place is that which is seen at its pixel.
const SAME: f32 = 0.01;
/// Part of one place, or of all that a small triangle has of it, over which it fades in as the triangle grows.
const FADE: f32 = 0.25;
/// Most places of one triangle: beyond, a single one would fill the picture and its memory.
const MOST: u32 = 1 << 16;

/// A place on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Where it is seen.
    pub pixel: Vec2,
    /// Along the camera's axis.
    pub depth: f32,
    /// Texture coordinates.
    pub uv: Vec2,
    /// In the world.
    pub point: DVec3,
    /// Index of the draw.
    pub draw: u32,
    /// The shape, counted from one.
    pub shape: u32,
    /// Its own for ever: what is random about it is made of it.
    pub hash: u32,
    /// 0 to 1: below one it comes or goes.
    pub weight: f32,
}

/// What is seen of a scene, for marks that lie on its surfaces.
#[derive(Clone, Copy)]
pub struct Surfaces<'a> {
    /// The scene.
    pub rows: &'a Rows,
    /// Draws that have none.
    pub without: &'a HashSet<u32>,
    /// How it is seen.
    pub projection: &'a Projection,
    /// What is seen, and how far away.
    pub map: &'a DepthMap,
    /// In which light.
    pub tones: &'a Tones,
    /// How each place of each draw is painted.
    pub place_controls: &'a PlaceControls,
    /// Pixels that stand for one in a picture of 1080 lines.
    pub unit: f32,
    /// How near something at a depth is, 0 to 1.
    pub near: &'a dyn Fn(f32) -> f32,
    /// What mist leaves of a point at a value of its control.
    pub mist: &'a dyn Fn(DVec3, f32) -> f32,
    /// Same seed, same marks.
    pub seed: u32,
}

impl Surfaces<'_> {
    /// How a place is painted.
    pub fn controls(&self, place: &Place) -> Controls {
        self.controls_at(place.draw, place.pixel, place.uv)
    }

    fn controls_at(&self, draw: u32, pixel: Vec2, uv: Vec2) -> Controls {
        let part = pixel / Vec2::from(self.map.size.map(|n| n as f32));
        self.place_controls.at(draw, &mask::Place { part, uv })
    }

    /// How a draw is painted at another pixel than where a place of it is, by the texture coordinates that are seen there; by those of
    /// the place where the picture has none.
    pub fn controls_beside(&self, first: &Place, pixel: Vec2) -> Controls {
        let uv = self.tones.index(pixel).and_then(|i| self.tones.uv.get(i)).copied();
        self.controls_at(first.draw, pixel, uv.unwrap_or(first.uv))
    }

    /// What is left of ink at the depth of a place.
    pub fn paleness(&self, place: &Place, controls: &Controls) -> f32 {
        let far = 1.0 - 0.75 * controls.distance * (1.0 - (self.near)(place.depth));
        far * (self.mist)(place.point, controls.mist)
    }

    /// Places that are seen, `density` of them to a pixel by the controls there, in an order that does not depend on the view; each
    /// kind of mark has a `salt` of its own.
    pub fn scatter(&self, density: impl Fn(&Controls) -> f32, salt: u32) -> Vec<Place> {
        let (rows, seed) = (self.rows, hash_combine(self.seed, salt));
        let [w, h] = self.map.size.map(|n| n as f32);
        let mut places = Vec::new();
        for (index, draw) in (0u32..).zip(&rows.draws).filter(|(i, _)| !self.without.contains(i)) {
            let most = density(&self.place_controls.most(index));
            if most <= 0.0 {
                continue;
            }
            let is_masked = self.place_controls.is_masked(index);
            let MeshRow { first_vertex, vertices, .. } = rows.meshes[draw.mesh as usize];
            let world = to_world(draw);
            let vertices = &rows.vertices[first_vertex as usize..(first_vertex + vertices) as usize];
            let placed: Vec<DVec3> =
                vertices.iter().map(|v| world(DVec3::from_array(v.position.map(f64::from)))).collect();
            let seen: Vec<_> = placed.iter().map(|p| self.projection.project(*p)).collect();
            let first = draw.first_triangle;
            for number in first..first + draw.triangles {
                let t = rows.triangles[number as usize].map(|v| (v - first_vertex) as usize);
                // A triangle that the near plane cuts is too near to be painted by marks on it.
                let [Some(a), Some(b), Some(c)] = t.map(|v| seen[v]) else { continue };
                let [p, q, r] = [a, b, c].map(|c| c.pixel.as_vec2());
                let (low, high) = (p.min(q).min(r), p.max(q).max(r));
                if high.x < 0.0 || high.y < 0.0 || low.x > w || low.y > h {
                    continue;
                }
                let area = 0.5 * (q - p).perp_dot(r - p).abs();
                let own = hash_combine(hash_combine(seed, index), number - first);
                let count = (area * most + 1.0).min(MOST as f32) as u32;
                for k in 0..count {
                    let hash = hash_combine(own, k);
                    let weight = |density: f32| {
                        let wanted = area * density;
                        ((wanted - k as f32 - unit_f32(hash)) / (FADE * wanted.min(1.0))).clamp(0.0, 1.0)
                    };
                    // Of a triangle that is not finite it is no number.
                    let there = |weight: f32| weight > 0.0;
                    let greatest = weight(most);
                    if !there(greatest) {
                        continue;
                    }
                    // Evenly over the triangle.
                    let (mut u, mut v) = (unit_f32(hash_combine(hash, 1)), unit_f32(hash_combine(hash, 2)));
                    if u + v > 1.0 {
                        (u, v) = (1.0 - u, 1.0 - v);
                    }
                    let [p, q, r] = t.map(|i| placed[i]);
                    let point = p + (q - p) * f64::from(u) + (r - p) * f64::from(v);
                    let Some(at) = self.projection.project(point) else { continue };
                    let (pixel, depth) = (at.pixel.as_vec2(), at.depth as f32);
                    if pixel.x < 0.0 || pixel.y < 0.0 || pixel.x >= w || pixel.y >= h {
                        continue;
                    }
                    let (near, shape) = self.map.at(pixel);
                    if shape != draw.shape || (near - depth).abs() > SAME * depth.abs() {
                        continue;
                    }
                    let [p, q, r] = t.map(|i| Vec2::new(vertices[i].u, vertices[i].v));
                    let uv = p + (q - p) * u + (r - p) * v;
                    let mut place =
                        Place { pixel, depth, uv, point, draw: index, shape, hash, weight: greatest };
                    if is_masked {
                        place.weight = weight(density(&self.controls(&place)));
                    }
                    if there(place.weight) {
                        places.push(place);
                    }
                }
            }
        }
        places
    }
}
