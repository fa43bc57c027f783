//! Round things: closed meshes of where a distance is zero.
//!
//! Cells of a grid that the surface passes get a vertex each, moved onto it, and edges that it crosses a quadrangle (Gibson
//! 1998, "Constrained Elastic Surface Nets").

use glam::{UVec3, Vec2, Vec3};
use yugen_scene::Mesh;

/// Between two distances, their meeting rounded over about `k` metres.
pub fn join(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - 0.25 * h * h * k
}

/// What is in `a` and not in `b`, rounded likewise.
pub fn cut(a: f32, b: f32, k: f32) -> f32 {
    -join(-a, b, k)
}

/// To an ellipsoid; exact on its surface, and of the right order elsewhere.
pub fn ellipsoid(p: Vec3, centre: Vec3, radii: Vec3) -> f32 {
    let q = p - centre;
    let (k0, k1) = ((q / radii).length(), (q / (radii * radii)).length());
    if k1 > 0.0 { k0 * (k0 - 1.0) / k1 } else { -radii.min_element() }
}

/// To a rod with round ends, whose radius goes over from one end to the other.
pub fn rod(p: Vec3, [a, b]: [Vec3; 2], [ra, rb]: [f32; 2]) -> f32 {
    let (ap, ab) = (p - a, b - a);
    let t = (ap.dot(ab) / ab.length_squared().max(1e-12)).clamp(0.0, 1.0);
    (ap - ab * t).length() - (ra + (rb - ra) * t)
}

/// To rods one after another.
pub fn rods(p: Vec3, path: &[(Vec3, f32)], k: f32) -> f32 {
    path.windows(2)
        .map(|w| rod(p, [w[0].0, w[1].0], [w[0].1, w[1].1]))
        .fold(f32::INFINITY, |a, b| if a.is_finite() { join(a, b, k) } else { b })
}

/// The surface of `distance` between two corners, in cells of `cell` metres; it has to be closed in between.
pub fn mesh(
    name: &str,
    [low, high]: [Vec3; 2],
    cell: f32,
    distance: &dyn Fn(Vec3) -> f32,
    uv: &dyn Fn(Vec3) -> Vec2,
) -> Mesh {
    let cells = ((high - low) / cell).ceil().max(Vec3::ONE).as_uvec3();
    let points = cells + 1;
    let at = |v: UVec3| low + v.as_vec3() * cell;
    let index = |v: UVec3| (v.x + points.x * (v.y + points.y * v.z)) as usize;
    let each = |n: UVec3| {
        (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
    };
    let values: Vec<f32> = each(points).map(|v| distance(at(v))).collect();
    let mut vertex = vec![u32::MAX; values.len()];
    let mut mesh = Mesh { name: name.into(), ..Mesh::default() };
    let gradient = |p: Vec3| {
        let e = 0.25 * cell;
        let along = |d: Vec3| distance(p + d) - distance(p - d);
        Vec3::new(along(Vec3::X * e), along(Vec3::Y * e), along(Vec3::Z * e)) / (2.0 * e)
    };
    for v in each(cells) {
        let corner = |k: u32| v + UVec3::new(k & 1, k >> 1 & 1, k >> 2);
        let (mut sum, mut crossed) = (Vec3::ZERO, 0.0);
        for a in 0..8u32 {
            for axis in 0..3 {
                let b = a | 1 << axis;
                if b == a {
                    continue;
                }
                let (pa, pb) = (corner(a), corner(b));
                let (da, db) = (values[index(pa)], values[index(pb)]);
                if (da < 0.0) != (db < 0.0) {
                    sum += at(pa).lerp(at(pb), da / (da - db));
                    crossed += 1.0;
                }
            }
        }
        if crossed == 0.0 {
            continue;
        }
        vertex[index(v)] = mesh.positions.len() as u32;
        let (mut p, lo) = (sum / crossed, at(v));
        for _ in 0..3 {
            let g = gradient(p);
            // Never out of its cell, so that triangles neither turn over nor shrink to nothing.
            p = (p - g * (distance(p) / g.length_squared().max(0.1)))
                .clamp(lo + 0.01 * cell, lo + 0.99 * cell);
        }
        mesh.positions.push(p);
        mesh.normals.push(gradient(p).normalize_or(Vec3::Y));
        mesh.uvs.push(uv(p));
    }
    for v in each(points) {
        for axis in 0..3 {
            let (u, w) = ((axis + 1) % 3, (axis + 2) % 3);
            let unit = |k: usize| UVec3::from_array(std::array::from_fn(|i| u32::from(i == k)));
            let next = v + unit(axis);
            if next[axis] >= points[axis] || v[u] == 0 || v[w] == 0 || v[u] >= cells[u] || v[w] >= cells[w] {
                continue;
            }
            let inside = values[index(v)] < 0.0;
            if inside == (values[index(next)] < 0.0) {
                continue;
            }
            let around = [v - unit(u) - unit(w), v - unit(w), v, v - unit(u)];
            let mut q = around.map(|c| vertex[index(c)]);
            if !inside {
                q.reverse();
            }
            mesh.triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::check_closed;

    #[test]
    fn a_ball_with_a_dent_is_closed_smooth_and_as_large_as_it_should_be() {
        let corners = [Vec3::splat(-0.15), Vec3::splat(0.15)];
        let ball = |p: Vec3| p.length() - 0.1;
        let m = mesh("ball", corners, 0.01, &ball, &|p| p.truncate());
        check_closed(&m).unwrap();
        let volume: f32 = m
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| m.positions[v as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let exact = 4.0 / 3.0 * std::f32::consts::PI * 1e-3;
        assert!((volume / exact - 1.0).abs() < 0.02, "{volume} {exact}");
        for (p, n) in m.positions.iter().zip(&m.normals) {
            assert!((p.length() - 0.1).abs() < 2e-4 && n.dot(p.normalize()) > 0.999, "{p} {n}");
        }
        let dented = |p: Vec3| cut(ball(p), ellipsoid(p, Vec3::Y * 0.1, Vec3::splat(0.05)), 0.01);
        check_closed(&mesh("dented", corners, 0.007, &dented, &|p| p.truncate())).unwrap();
        // A join is never farther than either, and rounds nothing far off.
        assert_eq!(join(0.3, 0.1, 0.05), 0.1);
        assert!(join(0.1, 0.1, 0.05) < 0.1);
        assert!((rod(Vec3::new(0.5, 0.3, 0.0), [Vec3::ZERO, Vec3::X], [0.1, 0.2]) - 0.15).abs() < 1e-6);
    }
}
