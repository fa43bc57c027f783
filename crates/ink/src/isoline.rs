//! Isolines of a picture by marching squares, simplified by Douglas and Peucker: the outlines of what is dark in it, for a seal.

use glam::{Vec2, vec2};
use std::collections::HashMap;

/// Greatest distance by which a simplified outline may miss, pixels.
const TOLERANCE: f32 = 0.3;

/// Outlines where `cover` (0 to 1, row after row, nothing outside) passes a half, in pixels: what is inside lies to the left of its
/// outer ones, seen with y down, so that holes wind the other way.
pub fn outlines(cover: &[f32], [width, height]: [usize; 2]) -> Vec<Vec<Vec2>> {
    let value = |x: isize, y: isize| -> f32 {
        let inside = x >= 0 && y >= 0 && x < width as isize && y < height as isize;
        if inside { cover[y as usize * width + x as usize] } else { 0.0 }
    };
    // Where a line between two neighbours passes a half: the pixel to the left or above, and whether the other is below it.
    type Edge = ([isize; 2], bool);
    let place = |([x, y], down): Edge| -> Vec2 {
        let (a, b) = (value(x, y), if down { value(x, y + 1) } else { value(x + 1, y) });
        let t = ((0.5 - a) / (b - a)).clamp(0.0, 1.0);
        let centre = vec2(x as f32 + 0.5, y as f32 + 0.5);
        if down { centre + Vec2::Y * t } else { centre + Vec2::X * t }
    };
    let mut next: HashMap<Edge, Edge> = HashMap::new();
    for y in -1..height as isize {
        for x in -1..width as isize {
            let corners = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]];
            let dark = corners.map(|[x, y]| value(x, y) >= 0.5);
            let (top, right, bottom, left) =
                (([x, y], false), ([x + 1, y], true), ([x, y + 1], false), ([x, y], true));
            let sides = [top, right, bottom, left];
            // Around the square: where dark follows light an outline comes in, where light follows dark it goes out.
            let (mut enters, mut leaves) = (Vec::new(), Vec::new());
            for i in 0..4 {
                match (dark[i], dark[(i + 1) % 4]) {
                    (false, true) => enters.push(i),
                    (true, false) => leaves.push(i),
                    _ => {}
                }
            }
            // Of two dark corners across each is cut off by itself: its outline goes from the side after it to that before.
            for &from in &leaves {
                let to = enters.iter().copied().min_by_key(|to| (from + 4 - to) % 4);
                if let Some(to) = to {
                    next.insert(sides[from], sides[to]);
                }
            }
        }
    }
    let mut starts: Vec<Edge> = next.keys().copied().collect();
    starts.sort_unstable();
    let mut loops = Vec::new();
    for start in starts {
        let (mut way, mut at) = (Vec::new(), start);
        while let Some(to) = next.remove(&at) {
            way.push(place(at));
            at = to;
        }
        if way.len() > 2 {
            loops.push(simplified(&way));
        }
    }
    loops.retain(|l| l.len() > 2);
    loops
}

/// A closed line with fewer points (Douglas and Peucker 1973).
fn simplified(way: &[Vec2]) -> Vec<Vec2> {
    let n = way.len();
    let far =
        (0..n).max_by(|a, b| way[*a].distance(way[0]).total_cmp(&way[*b].distance(way[0]))).unwrap_or(0);
    let mut keep = vec![false; n];
    (keep[0], keep[far]) = (true, true);
    let mut open = vec![(0, far), (far, n)];
    while let Some((a, b)) = open.pop() {
        let (p, q) = (way[a], way[b % n]);
        let off = |i: usize| {
            let d = q - p;
            let t = ((way[i] - p).dot(d) / d.length_squared().max(1e-12)).clamp(0.0, 1.0);
            (p + d * t).distance(way[i])
        };
        let worst = (a + 1..b).max_by(|i, j| off(*i).total_cmp(&off(*j)));
        if let Some(i) = worst.filter(|i| off(*i) > TOLERANCE) {
            keep[i] = true;
            open.extend([(a, i), (i, b)]);
        }
    }
    way.iter().zip(keep).filter(|(_, k)| *k).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(way: &[Vec2]) -> f32 {
        (0..way.len()).map(|i| way[i].perp_dot(way[(i + 1) % way.len()])).sum::<f32>() / 2.0
    }

    #[test]
    fn a_ring_has_two_outlines_that_wind_against_one_another() {
        let [w, h] = [90, 80];
        let cover: Vec<f32> = (0..w * h)
            .map(|i| {
                let r = vec2((i % w) as f32 + 0.5 - 45.0, (i / w) as f32 + 0.5 - 40.0).length();
                (30.5 - r).clamp(0.0, 1.0) * (r - 14.5).clamp(0.0, 1.0)
            })
            .collect();
        let loops = outlines(&cover, [w, h]);
        let mut areas: Vec<f32> = loops.iter().map(|l| area(l)).collect();
        areas.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
        let disc = |r: f32| std::f32::consts::PI * r * r;
        assert_eq!(areas.len(), 2);
        assert!(
            (areas[0].abs() / disc(30.0) - 1.0).abs() < 0.02
                && (areas[1].abs() / disc(15.0) - 1.0).abs() < 0.03
        );
        assert!(areas[0] * areas[1] < 0.0, "{areas:?}");
        assert!(loops.iter().all(|l| l.len() < 100), "simplified");
    }

    #[test]
    fn corners_that_touch_stay_apart_and_edges_of_the_picture_close() {
        let loops = outlines(&[1.0, 0.0, 0.0, 1.0], [2, 2]);
        assert_eq!(loops.len(), 2);
        assert!(loops.iter().all(|l| area(l).abs() < 0.8));
        let whole = outlines(&[1.0; 12], [4, 3]);
        assert!(whole.len() == 1 && (area(&whole[0]).abs() - 11.5).abs() < 1.0, "{whole:?}");
        assert!(outlines(&[0.0; 12], [4, 3]).is_empty());
    }
}
