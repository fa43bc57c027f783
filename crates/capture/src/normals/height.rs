//! Heights whose slopes are those of the normals.
//!
//! The slopes between neighbouring texels are to be met in the least squares (Horn and Brooks 1986), by how far they are
//! trusted and only where there is a surface on both sides, so that a mask of any shape has free borders; a slight pull
//! toward zero makes every piece of the surface well-posed. Solved by conjugate gradients with a multigrid cycle as
//! preconditioner (Tatebe 1993): time and memory grow with the number of texels.

use crate::rows::for_rows;
use glam::Vec3;

/// Slopes beyond this, 80°, are as steep as it: what leans further is hardly seen, and its slope hardly known.
const STEEPEST: f32 = 5.7;
/// The pull toward zero is felt over this many times the picture: a plane bends by less than a thousandth.
const REACH: f32 = 16.0;
/// Texels that nothing is known of are bridged: this much trust in that their slope is none.
const BRIDGE: f32 = 1e-3;
/// By how much the residual is made smaller, and steps at most for that.
const REDUCTION: f64 = 1e-4;
const STEPS: usize = 100;

/// Heights above the mean of their own, in widths of a texel, row by row from the top; +y of normals is up in the picture. `trust` says
/// how far each normal is believed, from 0 to 1, and is NaN where there is no surface; there the height is 0.
pub fn integrate(width: usize, height: usize, normals: &[Vec3], trust: &[f32]) -> Vec<f32> {
    let _span = tracing::info_span!("integrate_normals", texels = width * height).entered();
    let n = width * height;
    assert!(normals.len() == n && trust.len() == n, "a normal and a trust for each texel");
    let slope = |v: Vec3, along: f32| (-along / v.z.max(1e-3)).clamp(-STEEPEST, STEEPEST);
    // A slope is known the less the steeper it is: its error grows with 1/z².
    let weight =
        |i: usize| if trust[i].is_nan() { 0.0 } else { (trust[i] * normals[i].z.powi(4)).max(BRIDGE) };
    let (mut right, mut down) = (Edges::new(n), Edges::new(n));
    for y in 0..height {
        for x in 0..width {
            let i = y * width + x;
            let edge = |edges: &mut Edges, j: usize, by: &dyn Fn(Vec3) -> f32| {
                let (wi, wj) = (weight(i), weight(j));
                if wi > 0.0 && wj > 0.0 {
                    edges.weight[i] = 2.0 * wi * wj / (wi + wj);
                    edges.step[i] = (wi * by(normals[i]) + wj * by(normals[j])) / (wi + wj);
                }
            };
            if x + 1 < width {
                edge(&mut right, i + 1, &|v| slope(v, v.x));
            }
            if y + 1 < height {
                edge(&mut down, i + width, &|v| -slope(v, v.y));
            }
        }
    }
    let pull = (1.0 / (REACH * width.max(height) as f32)).powi(2);
    let inside: Vec<f32> = trust.iter().map(|t| if t.is_nan() { 0.0 } else { pull }).collect();
    let mut z = vec![0.0; n];
    let finest = Level::new(width, height, right.weight.clone(), down.weight.clone(), inside);
    solve(&levels(finest), &right, &down, &mut z);
    let there = trust.iter().filter(|t| !t.is_nan()).count().max(1);
    let mean = z.iter().map(|z| f64::from(*z)).sum::<f64>() / there as f64;
    for (z, t) in z.iter_mut().zip(trust) {
        *z = if t.is_nan() { 0.0 } else { *z - mean as f32 };
    }
    z
}

/// Whether the slopes are those of a surface: the slope along x changes along y as that along y does along x. From 1, they
/// do, over 0, there is nothing to tell, to −1: they change oppositely, as where one axis of the lights is turned round.
pub fn closure(width: usize, height: usize, normals: &[Vec3], trust: &[f32]) -> f32 {
    let slope = |i: usize| {
        let n = normals[i];
        // Steep ones say little and weigh much.
        (trust[i] > 0.1 && n.z > 0.3).then(|| [-n.x / n.z, -n.y / n.z])
    };
    let (mut both, mut first, mut second) = (0.0f64, 0.0f64, 0.0f64);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let i = y * width + x;
            let sides = [i - 1, i + 1, i - width, i + width].map(slope);
            let [Some(left), Some(right), Some(up), Some(down)] = sides else { continue };
            let (p_y, q_x) = (f64::from(up[0] - down[0]), f64::from(right[1] - left[1]));
            both += p_y * q_x;
            first += p_y * p_y;
            second += q_x * q_x;
        }
    }
    (both / (first * second).sqrt().max(1e-30)) as f32
}

/// Of each texel to its neighbour on one side: how far the step is trusted, and the step.
struct Edges {
    weight: Vec<f32>,
    step: Vec<f32>,
}

impl Edges {
    fn new(n: usize) -> Self {
        Self { weight: vec![0.0; n], step: vec![0.0; n] }
    }
}

/// The equations on one grid: weights of the edges to the right and down, and the pull on each texel.
struct Level {
    width: usize,
    height: usize,
    right: Vec<f32>,
    down: Vec<f32>,
    pull: Vec<f32>,
    /// One over the diagonal; 0 where there is nothing.
    inverse: Vec<f32>,
}

impl Level {
    fn new(width: usize, height: usize, right: Vec<f32>, down: Vec<f32>, pull: Vec<f32>) -> Self {
        let mut diagonal = pull.clone();
        for i in 0..diagonal.len() {
            if right[i] > 0.0 {
                diagonal[i] += right[i];
                diagonal[i + 1] += right[i];
            }
            if down[i] > 0.0 {
                diagonal[i] += down[i];
                diagonal[i + width] += down[i];
            }
        }
        let inverse = diagonal.into_iter().map(|d| if d > 0.0 { 1.0 / d } else { 0.0 }).collect();
        Self { width, height, right, down, pull, inverse }
    }

    /// Half as many texels each way. The slope between two texels of the coarse grid is met by two rows of two steps of
    /// the fine one.
    fn coarser(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let (mut right, mut down, mut pull) =
            (vec![0.0; width * height], vec![0.0; width * height], vec![0.0; width * height]);
        for y in 0..self.height {
            for x in 0..self.width {
                let (fine, coarse) = (y * self.width + x, y / 2 * width + x / 2);
                pull[coarse] += self.pull[fine];
                if x % 2 == 1 {
                    right[coarse] += 0.5 * self.right[fine];
                }
                if y % 2 == 1 {
                    down[coarse] += 0.5 * self.down[fine];
                }
            }
        }
        Self::new(width, height, right, down, pull)
    }

    /// Σ over the neighbours of weight times their value, at texel (x, y).
    #[inline(always)]
    fn around(&self, z: &[f32], x: usize, y: usize) -> f32 {
        let (i, w) = (y * self.width + x, self.width);
        let mut sum = 0.0;
        if x + 1 < w {
            sum += self.right[i] * z[i + 1];
        }
        if x > 0 {
            sum += self.right[i - 1] * z[i - 1];
        }
        if y + 1 < self.height {
            sum += self.down[i] * z[i + w];
        }
        if y > 0 {
            sum += self.down[i - w] * z[i - w];
        }
        sum
    }

    /// The matrix times z.
    fn times(&self, z: &[f32], out: &mut [f32]) {
        rows(out, self.width, |y, row| {
            for (x, out) in row.iter_mut().enumerate() {
                let i = y * self.width + x;
                let diagonal = self.inverse[i];
                *out = if diagonal > 0.0 { z[i] / diagonal - self.around(z, x, y) } else { 0.0 };
            }
        });
    }

    /// One step of damped Jacobi from z to `out`.
    fn smooth(&self, right_side: &[f32], z: &[f32], out: &mut [f32]) {
        rows(out, self.width, |y, row| {
            for (x, out) in row.iter_mut().enumerate() {
                let i = y * self.width + x;
                let there = self.inverse[i] * (right_side[i] + self.around(z, x, y));
                *out = z[i] + DAMPING * (there - z[i]);
            }
        });
    }
}

/// Rows on all cores where they are worth the threads.
fn rows(out: &mut [f32], width: usize, fill: impl Fn(usize, &mut [f32]) + Sync) {
    const WORTH: usize = 1 << 18;
    if out.len() < WORTH {
        out.chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| fill(y, row));
    } else {
        for_rows(out, width, fill);
    }
}

/// Of Jacobi's steps: takes the rough half of the spectrum away fastest.
const DAMPING: f32 = 0.8;
/// Steps before and after the coarser grids have spoken; the same number, so that the cycle is symmetric.
const SMOOTHING: usize = 2;

/// All grids, down to a few texels.
fn levels(finest: Level) -> Vec<Level> {
    let mut all = vec![finest];
    while let Some(last) = all.last()
        && last.width.max(last.height) > 2
    {
        all.push(last.coarser());
    }
    all
}

/// One V cycle from nothing.
fn cycle(levels: &[Level], right_side: &[f32], z: &mut [f32], room: &mut [f32]) {
    let [level, coarser @ ..] = levels else { return };
    for ((z, b), inverse) in z.iter_mut().zip(right_side).zip(&level.inverse) {
        *z = DAMPING * b * inverse;
    }
    let steps = if coarser.is_empty() { 16 } else { SMOOTHING };
    for _ in 1..steps {
        level.smooth(right_side, z, room);
        z.copy_from_slice(room);
    }
    if let [next, ..] = coarser {
        level.times(z, room);
        let mut rest = vec![0.0; next.width * next.height];
        for y in 0..level.height {
            for x in 0..level.width {
                let i = y * level.width + x;
                rest[y / 2 * next.width + x / 2] += right_side[i] - room[i];
            }
        }
        let (mut gain, mut small) = (vec![0.0; rest.len()], vec![0.0; rest.len()]);
        cycle(coarser, &rest, &mut gain, &mut small);
        rows(z, level.width, |y, row| {
            for (x, z) in row.iter_mut().enumerate() {
                *z += gain[y / 2 * next.width + x / 2];
            }
        });
    }
    for _ in 0..steps {
        level.smooth(right_side, z, room);
        z.copy_from_slice(room);
    }
    // Nothing where there is nothing.
    for (z, inverse) in z.iter_mut().zip(&level.inverse) {
        *z = if *inverse > 0.0 { *z } else { 0.0 };
    }
}

/// Improves z until the steps are met as well as they can be.
fn solve(levels: &[Level], right: &Edges, down: &Edges, z: &mut [f32]) {
    let level = &levels[0];
    let n = z.len();
    let mut rest = vec![0.0f32; n];
    for i in 0..n {
        for (edges, to) in [(right, 1), (down, level.width)] {
            if edges.weight[i] > 0.0 {
                let part = edges.weight[i] * edges.step[i];
                rest[i] -= part;
                rest[i + to] += part;
            }
        }
    }
    let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
    let (mut room, mut preconditioned, mut image) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    cycle(levels, &rest, &mut preconditioned, &mut room);
    let scale = dot(&rest, &preconditioned);
    level.times(z, &mut image);
    rest.iter_mut().zip(&image).for_each(|(r, i)| *r -= i);
    let mut direction: Vec<f32> = Vec::new();
    let mut before = 0.0;
    for _ in 0..STEPS {
        cycle(levels, &rest, &mut preconditioned, &mut room);
        let now = dot(&rest, &preconditioned);
        if now.is_nan() || now <= REDUCTION * REDUCTION * scale {
            break;
        }
        if direction.is_empty() {
            direction.clone_from(&preconditioned);
        } else {
            let beta = (now / before) as f32;
            direction.iter_mut().zip(&preconditioned).for_each(|(d, p)| *d = p + beta * *d);
        }
        before = now;
        level.times(&direction, &mut image);
        let bend = dot(&direction, &image);
        if bend.is_nan() || bend <= 0.0 {
            break;
        }
        let alpha = (now / bend) as f32;
        z.iter_mut().zip(&direction).for_each(|(z, d)| *z += alpha * d);
        rest.iter_mut().zip(&image).for_each(|(r, i)| *r -= alpha * i);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 150;
    const HEIGHT: usize = 97;

    /// A bump on a slope, as exact normals, and its heights.
    fn bump(x: usize, y: usize) -> (Vec3, f32) {
        let (u, v) = (x as f32 - 60.0, 40.0 - y as f32);
        let e = 12.0 * (-(u * u + v * v) / 800.0).exp();
        let (p, q) = (0.1 - e * u / 400.0, -0.2 - e * v / 400.0);
        (Vec3::new(-p, -q, 1.0).normalize(), 0.1 * u - 0.2 * v + e)
    }

    /// Root mean square of what differs, means taken away.
    fn apart(got: &[f32], want: &[f32], inside: impl Fn(usize) -> bool) -> f32 {
        let off: Vec<f32> = (0..got.len()).filter(|i| inside(*i)).map(|i| got[i] - want[i]).collect();
        let mean = off.iter().sum::<f32>() / off.len() as f32;
        (off.iter().map(|o| (o - mean).powi(2)).sum::<f32>() / off.len() as f32).sqrt()
    }

    fn surface() -> (Vec<Vec3>, Vec<f32>) {
        (0..WIDTH * HEIGHT).map(|i| bump(i % WIDTH, i / WIDTH)).unzip()
    }

    #[test]
    fn a_bump_on_a_slope_comes_back() {
        let (normals, want) = surface();
        let got = integrate(WIDTH, HEIGHT, &normals, &vec![1.0; want.len()]);
        let off = apart(&got, &want, |_| true);
        assert!(off < 0.02, "{off}");
        assert!(closure(WIDTH, HEIGHT, &normals, &vec![1.0; want.len()]) > 0.95);
        // Sabotage: a map whose y runs down.
        let turned: Vec<Vec3> = normals.iter().map(|n| Vec3::new(n.x, -n.y, n.z)).collect();
        let off = apart(&integrate(WIDTH, HEIGHT, &turned, &vec![1.0; want.len()]), &want, |_| true);
        assert!(off > 1.0, "{off}");
        assert!(closure(WIDTH, HEIGHT, &turned, &vec![1.0; want.len()]) < -0.95);
    }

    /// Borders are free: what lies outside says nothing, whatever is written there, and a hole does not matter.
    #[test]
    fn masks_have_free_borders() {
        let (mut normals, want) = surface();
        let inside = |i: usize| {
            let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
            (x - 75.0).hypot(1.4 * (y - 48.0)) < 60.0 && (x - 50.0).hypot(y - 60.0) > 9.0
        };
        let trust: Vec<f32> = (0..want.len()).map(|i| if inside(i) { 1.0 } else { f32::NAN }).collect();
        for (i, n) in normals.iter_mut().enumerate() {
            if !inside(i) {
                *n = Vec3::new(0.9, 0.3, 0.3).normalize();
            }
        }
        let got = integrate(WIDTH, HEIGHT, &normals, &trust);
        let off = apart(&got, &want, inside);
        assert!(off < 0.03, "{off}");
        assert!((0..got.len()).all(|i| inside(i) || got[i] == 0.0));
    }

    /// Undecided texels are bridged.
    #[test]
    fn what_is_not_known_is_bridged() {
        let (mut normals, want) = surface();
        let mut trust = vec![1.0; want.len()];
        for i in 0..want.len() {
            if (i % WIDTH).abs_diff(100) < 4 && (i / WIDTH).abs_diff(50) < 4 {
                (normals[i], trust[i]) = (Vec3::new(0.7, 0.0, 0.7), 0.0);
            }
        }
        let off = apart(&integrate(WIDTH, HEIGHT, &normals, &trust), &want, |_| true);
        assert!(off < 0.06, "{off}");
    }
}
