//! Meisters 1975, "Polygons Have Ears".

use glam::{DVec2, Vec3};

/// Looks at corners that each corner may cost. Outlines of land take a few hundred; what takes more crosses itself or
/// was made to take long, and is cut somehow.
const LOOKS: usize = 1 << 13;

/// Cuts a polygon, given as the fan of triangles from its first corner, into triangles that lie inside it: as many as
/// before, with the same corners. Where the fan does lie inside, as in all convex polygons, it stays. `false` where no ear
/// was left, as in a polygon that crosses itself, or it has far more corners than can be looked at: then some triangles
/// lie outside.
pub fn cut(positions: &[Vec3], fan: &mut [[u32; 3]]) -> bool {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        (b - a).cross(c - a)
    };
    let normal: Vec3 = fan.iter().map(area).sum();
    if fan.len() < 2 || fan.iter().all(|t| area(t).dot(normal) >= 0.0) {
        return true;
    }
    // Seen along the axis nearest to the normal, so that the polygon runs counter-clockwise.
    let axis = normal.abs().max_position();
    let (mut x, mut y) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (x, y) = (y, x);
    }
    let mut corners = vec![fan[0][0], fan[0][1]];
    corners.extend(fan.iter().map(|t| t[2]));
    let flat: Vec<DVec2> = corners
        .iter()
        .map(|&i| {
            let p = positions[i as usize].as_dvec3();
            DVec2::new(p[x], p[y])
        })
        .collect();
    let side = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]);

    let n = corners.len();
    let mut next: Vec<usize> = (1..n).chain([0]).collect();
    let mut before: Vec<usize> = (0..n).map(|i| (i + n - 1) % n).collect();
    let mut convex: Vec<bool> = (0..n).map(|i| side(before[i], i, next[i]) > 0.0).collect();
    let mut looks = LOOKS * n;
    let mut clean = true;
    // Rounding of single precision, against twice the area of the whole.
    let flat_enough = 1e-6 * f64::from(normal[axis].abs());
    let (mut at, mut passed, mut out, mut left) = (0, 0, 0, n);
    while left > 3 {
        looks = looks.saturating_sub(1);
        let mut ear = convex[at] && {
            let (a, b, c) = (before[at], at, next[at]);
            let mut p = next[c];
            let mut empty = true;
            while empty && p != a && looks > 0 {
                looks -= 1;
                // Only a corner that is not convex can be the first to reach in. One that lies on a corner of the
                // ear is the other bank of a cut to a hole.
                if !convex[p] && ![a, b, c].iter().any(|&i| flat[i] == flat[p]) {
                    empty = side(a, b, p) < 0.0 || side(b, c, p) < 0.0 || side(c, a, p) < 0.0;
                }
                p = next[p];
            }
            empty
        };
        if looks == 0 {
            (ear, clean) = (true, false);
        } else if !ear && passed == left {
            // No corner is an ear: what is left is flat, or crosses itself. The corner that sticks out most does the
            // least harm.
            let mut best = at;
            let mut i = next[at];
            while i != at {
                if side(before[i], i, next[i]) > side(before[best], best, next[best]) {
                    best = i;
                }
                i = next[i];
            }
            looks = looks.saturating_sub(left);
            clean &= side(before[best], best, next[best]).abs() <= flat_enough;
            at = best;
            ear = true;
        }
        let (a, c) = (before[at], next[at]);
        if ear {
            fan[out] = [corners[a], corners[at], corners[c]];
            (out, left, passed) = (out + 1, left - 1, 0);
            (next[a], before[c]) = (c, a);
            for i in [a, c] {
                convex[i] = side(before[i], i, next[i]) > 0.0;
            }
        } else {
            passed += 1;
        }
        at = c;
    }
    fan[out] = [corners[before[at]], corners[at], corners[next[at]]];
    clean
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    fn fan(n: u32) -> Vec<[u32; 3]> {
        (2..n).map(|k| [0, k - 1, k]).collect()
    }

    /// The areas of the triangles added up, each counted as positive: equal to the polygon's only where none of them
    /// lies outside or over another.
    fn area(p: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
        let one = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| p[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        triangles.iter().map(one).sum()
    }

    fn cut_area(p: &[Vec3]) -> [f32; 2] {
        let before = fan(p.len() as u32);
        let mut after = before.clone();
        let clean = cut(p, &mut after);
        let mut used = vec![false; p.len()];
        after.iter().flatten().for_each(|&i| used[i as usize] = true);
        assert!(used.iter().all(|&u| u), "a corner was lost");
        [area(p, &before), if clean { area(p, &after) } else { f32::NAN }]
    }

    fn points(p: &[[f32; 2]]) -> Vec<Vec3> {
        p.iter().map(|&[x, y]| Vec3::new(x, y, 0.0)).collect()
    }

    #[test]
    fn concave_corners_are_kept_outside() {
        // Of the fan one triangle lies outside: a hollow corner, seen from either side and in any plane.
        let dart = points(&[[-1.0, -1.0], [0.0, 0.0], [1.0, -1.0], [0.0, 1.0]]);
        for turn in 0..4 {
            let mut p = dart.clone();
            p.rotate_left(turn);
            for _ in 0..2 {
                p.reverse();
                for axes in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
                    let q: Vec<Vec3> = p.iter().map(|v| Vec3::from(axes.map(|a| v[a]))).collect();
                    assert_eq!(cut_area(&q)[1], 1.0, "{q:?}");
                }
            }
        }
        // A comb, every corner of whose teeth is in the way of others; and one with corners in a straight line.
        let mut comb = vec![[0.0, 0.0], [9.0, 0.0]];
        comb.extend((0..10).rev().map(|i| [i as f32, if i % 2 == 0 { 1.0 } else { 5.0 }]));
        assert!((cut_area(&points(&comb))[1] - 27.0).abs() < 1e-4);
        let line =
            points(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5], [0.0, 2.0], [0.0, 1.0]]);
        assert!((cut_area(&line)[1] - 2.5).abs() < 1e-6);
    }

    #[test]
    fn a_hole_behind_a_cut_stays_a_hole() {
        let square = |s: f32| [[-s, -s], [s, -s], [s, s], [-s, s], [-s, -s]];
        let mut p = square(2.0).to_vec();
        p.extend(square(1.0).into_iter().rev());
        assert!((cut_area(&points(&p))[1] - 12.0).abs() < 1e-5, "{:?}", cut_area(&points(&p)));
    }

    #[test]
    fn random_outlines_keep_their_area() {
        let mut rng = Pcg32::new(4, 4);
        for n in [5, 8, 30, 200] {
            for _ in 0..20 {
                // Around the origin in order, at random distances: hollow almost everywhere, never crossing.
                let p: Vec<[f32; 2]> = (0..n)
                    .map(|i| {
                        let (sin, cos) = (i as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
                        let r = 0.1 + rng.next_f32();
                        [r * cos, r * sin]
                    })
                    .collect();
                let whole: f32 = (0..n)
                    .map(|i| (p[i], p[(i + 1) % n]))
                    .map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0]))
                    .sum();
                let [fan, cut] = cut_area(&points(&p));
                assert!((cut - whole).abs() < 1e-4 * whole, "{n}: {cut} {whole}, as a fan {fan}");
            }
        }
    }

    #[test]
    fn what_crosses_itself_ends() {
        let mut rng = Pcg32::new(5, 5);
        for n in [50, 400, 3000] {
            let p: Vec<[f32; 2]> = (0..n).map(|_| [rng.next_f32(), rng.next_f32()]).collect();
            assert!(cut_area(&points(&p))[1].is_nan(), "{n} corners were cut as if they did not cross");
        }
        cut_area(&points(&[[0.0; 2]; 9]));
        // A flat one keeps its fan.
        let flat = points(&[[0.0, 0.0], [3.0, 0.0], [1.0, 0.0], [2.0, 0.0]]);
        cut_area(&flat);
    }
}
