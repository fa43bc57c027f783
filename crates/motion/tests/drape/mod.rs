//! Cusick's drape coefficient: a disc of 30 cm on one of 18 cm, seen from above.

use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use yugen_motion::cloth::Sheet;

/// Of the cloth, m.
const RADIUS: f32 = 0.15;
/// Of what it lies on, m.
const UNDER: f32 = 0.09;

/// The disc in cells of about `cell` metres, its rim on the circle.
pub fn disc(cell: f32) -> Sheet {
    let n = (2.0 * RADIUS / cell).ceil() as u32 + 2;
    let half = 0.5 * n as f32 * cell;
    let corner = Vec3::new(-half, 0.0, -half);
    let mut sheet = Sheet::rectangle(corner, Vec3::X, Vec3::Z, Vec2::splat(2.0 * half), [n; 2]);
    let keep: Vec<bool> = sheet.positions.iter().map(|p| p.length() < RADIUS + 0.4 * cell).collect();
    // The rim on the circle, and what that has flattened left out.
    for p in &mut sheet.positions {
        let far = p.length();
        if far > RADIUS - 0.6 * cell {
            *p *= RADIUS / far;
        }
    }
    let at = |v: u32| Vec2::new(sheet.positions[v as usize].x, sheet.positions[v as usize].z);
    let flat_of = |t: &[u32; 3]| t.map(at);
    let area = |f: [Vec2; 3]| (f[1] - f[0]).perp_dot(f[2] - f[0]).abs();
    let mut triangles: Vec<[u32; 3]> = sheet.triangles.clone();
    triangles.retain(|t| t.iter().all(|v| keep[*v as usize]) && area(flat_of(t)) > 0.05 * cell * cell);
    let flat = triangles.iter().map(flat_of).collect();
    let mut place = vec![u32::MAX; keep.len()];
    let mut positions = Vec::new();
    for v in triangles.iter_mut().flatten() {
        let to = &mut place[*v as usize];
        if *to == u32::MAX {
            *to = positions.len() as u32;
            positions.push(sheet.positions[*v as usize]);
        }
        *v = *to;
    }
    Sheet { positions, triangles, flat }
}

/// The vertices that lie on what is under it. The bend at the last of them stands for half a cell on either side, as a cantilever's
/// does.
pub fn held(sheet: &Sheet, cell: f32) -> Vec<u32> {
    let under = |v: &u32| sheet.positions[*v as usize].length() < UNDER + 0.5 * cell;
    (0..sheet.positions.len() as u32).filter(under).collect()
}

/// A hair out of plane, the same at every density, so that folds can choose.
pub fn bent(sheet: &Sheet) -> Vec<Vec3> {
    let lift = |p: &Vec3| *p + Vec3::Y * (0.002 * (5.0 * p.x.atan2(p.z)).sin() * p.length());
    sheet.positions.iter().map(lift).collect()
}

/// The part of the ring around what is under it that the cloth hides from above.
pub fn coefficient(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let under = PI * UNDER.powi(2);
    (shadow(positions, triangles) - under) / (PI * RADIUS.powi(2) - under)
}

/// Area of a shadow from above, m².
fn shadow(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    const N: usize = 600;
    let scale = N as f32 / 0.32;
    let mut seen = vec![false; N * N];
    for t in triangles {
        let q = t.map(|v| (Vec2::new(positions[v as usize].x, positions[v as usize].z) + 0.16) * scale);
        let low = q[0].min(q[1]).min(q[2]).max(Vec2::ZERO);
        let high = q[0].max(q[1]).max(q[2]).min(Vec2::splat(N as f32 - 1.0));
        for y in low.y as usize..=high.y as usize {
            for x in low.x as usize..=high.x as usize {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let w = [0, 1, 2].map(|k| (q[(k + 1) % 3] - q[k]).perp_dot(p - q[k]));
                seen[y * N + x] |= w.iter().all(|w| *w >= 0.0) || w.iter().all(|w| *w <= 0.0);
            }
        }
    }
    seen.iter().filter(|s| **s).count() as f32 / (scale * scale)
}
