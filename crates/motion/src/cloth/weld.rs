//! From meshes as files have them to sheets.

use super::Sheet;
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// A sheet of which vertices at one place are one, as the pieces of a garment are that a file keeps apart.
#[derive(Clone, Debug)]
pub struct Welded {
    /// The sheet.
    pub sheet: Sheet,
    /// Of each vertex of the mesh, that of the sheet; none where no triangle has it.
    pub vertex: Vec<Option<u32>>,
    /// Metres for a unit of u and of v.
    pub scale: Vec2,
    /// Triangles that were left out for having no area.
    pub dropped: usize,
}

impl Sheet {
    /// The sheet of a mesh whose (u, v) are a flat pattern, with `scale` metres for a unit of u and v; without one, the two that fit
    /// the lengths of the edges best. `None` where there is no such scale: the (u, v) are all alike.
    pub fn welded(
        positions: &[Vec3],
        uvs: &[Vec2],
        triangles: &[[u32; 3]],
        scale: Option<Vec2>,
    ) -> Option<Welded> {
        let scale = match scale {
            Some(scale) => scale,
            None => fitted(positions, uvs, triangles)?,
        };
        let mut known: HashMap<[u32; 3], u32> = HashMap::new();
        let mut vertex = vec![None; positions.len()];
        let mut sheet = Sheet::default();
        let mut dropped = 0;
        for t in triangles {
            let flat = t.map(|v| uvs[v as usize] * scale);
            let sides = [0, 1, 2].map(|k| flat[(k + 1) % 3].distance(flat[k]));
            let longest = sides.into_iter().fold(0.0, f32::max);
            let twice = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]).abs();
            // Twice what a cloth accepts, for its own test is in other numbers.
            let welded = t.map(|v| {
                let p = positions[v as usize];
                // −0 is 0.
                let key = (p + 0.0).to_array().map(f32::to_bits);
                (key, v)
            });
            let alike = (0..3).any(|k| welded[k].0 == welded[(k + 1) % 3].0);
            if twice <= 2e-3 * longest * longest || alike {
                dropped += 1;
                continue;
            }
            let places = welded.map(|(key, v)| {
                let next = known.len() as u32;
                let place = *known.entry(key).or_insert(next);
                if place == next && sheet.positions.len() == next as usize {
                    sheet.positions.push(positions[v as usize]);
                }
                vertex[v as usize] = Some(place);
                place
            });
            sheet.triangles.push(places);
            sheet.flat.push(flat);
        }
        Some(Welded { sheet, vertex, scale, dropped })
    }
}

/// Squares of edges as sums of squares of their du and dv, by least squares.
fn fitted(positions: &[Vec3], uvs: &[Vec2], triangles: &[[u32; 3]]) -> Option<Vec2> {
    let (mut m, mut r) = ([0.0f64; 3], [0.0f64; 2]);
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
            let d = (uvs[b] - uvs[a]).as_dvec2();
            let (u, v) = (d.x * d.x, d.y * d.y);
            let square = f64::from(positions[a].distance_squared(positions[b]));
            m = [m[0] + u * u, m[1] + u * v, m[2] + v * v];
            r = [r[0] + u * square, r[1] + v * square];
        }
    }
    let det = m[0] * m[2] - m[1] * m[1];
    let [u, v] = [(r[0] * m[2] - r[1] * m[1]) / det, (r[1] * m[0] - r[0] * m[1]) / det];
    (u > 0.0 && v > 0.0 && u.is_finite() && v.is_finite())
        .then(|| Vec2::new(u.sqrt() as f32, v.sqrt() as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_joined_and_the_scale_is_found() {
        // Two squares that share an edge only by place; u and v of different scales.
        let square =
            |x: f32| [(x, 0.0), (x + 0.5, 0.0), (x + 0.5, 0.5), (x, 0.5)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let positions: Vec<Vec3> = [square(0.0), square(0.5)].concat();
        let uvs: Vec<Vec2> = positions.iter().map(|p| Vec2::new(p.x * 4.0, p.y * 0.5)).collect();
        let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7], [1, 4, 2]];
        let welded = Sheet::welded(&positions, &uvs, &triangles, None).unwrap();
        assert!((welded.scale - Vec2::new(0.25, 2.0)).length() < 1e-5, "{}", welded.scale);
        assert_eq!((welded.sheet.positions.len(), welded.sheet.triangles.len(), welded.dropped), (6, 4, 1));
        assert_eq!(welded.vertex[1], welded.vertex[4]);
        assert!(Sheet::welded(&positions, &[Vec2::ZERO; 8], &triangles, None).is_none());
    }
}
