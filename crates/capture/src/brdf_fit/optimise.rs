//! Levenberg 1944 and Marquardt 1963 in a box, for sums that need not be of squares.

use super::Reading;
use super::space::{Point, Space};
use glam::Vec3;

/// What is made small: Σ w ((h(g) − h(f))² + δ²)^q over readings and channels, where f and g are the reading and the
/// model times cos θ_i. As q ≤ 1 the power lies below its tangent, so that weighted least squares with the weights
/// q (d² + δ²)^(q−1) go down with it (iteratively reweighted least squares).
#[derive(Clone, Copy, Debug)]
pub struct Loss {
    pub scale: Scale,
    pub power: f64,
    /// Rounds off the cusp of the power at d = 0.
    pub delta: f64,
}

/// h.
#[derive(Clone, Copy, Debug)]
pub enum Scale {
    Identity,
    /// ln(1 + x).
    Log,
    /// ∛(x + ε), which lets ground and highlight count alike.
    CubeRoot(f64),
}

impl Scale {
    /// h(x) and h′(x).
    fn at(self, x: f64) -> (f64, f64) {
        match self {
            Self::Identity => (x, 1.0),
            Self::Log => (x.max(0.0).ln_1p(), 1.0 / (1.0 + x.max(0.0))),
            Self::CubeRoot(floor) => {
                let root = (x.max(0.0) + floor).cbrt();
                (root, 1.0 / (3.0 * root * root))
            }
        }
    }
}

impl Loss {
    fn sum(&self, readings: &[Reading], values: &[Vec3]) -> f64 {
        let mut sum = 0.0;
        for (r, g) in readings.iter().zip(values) {
            for c in 0..3 {
                let d = self.difference(r, g, c).0;
                sum += f64::from(r.weight) * self.raised(d);
            }
        }
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    fn raised(&self, d: f64) -> f64 {
        let square = d * d + self.delta * self.delta;
        if self.power == 1.0 { square } else { square.powf(self.power) }
    }

    /// h(g) − h(f) and h′(g).
    fn difference(&self, r: &Reading, g: &Vec3, c: usize) -> (f64, f64) {
        let (to, slope) = self.scale.at(f64::from(g[c]));
        (to - self.scale.at(f64::from(r.f[c] * r.wi.z)).0, slope)
    }

    fn weight(&self, d: f64) -> f64 {
        if self.power == 1.0 {
            1.0
        } else {
            self.power * (d * d + self.delta * self.delta).powf(self.power - 1.0)
        }
    }
}

/// Width of a difference quotient, of the box: above what single precision loses, below where lobes bend.
const STEP: f64 = 1e-3;
/// The longest step along any coordinate.
const REACH: f64 = 0.2;

/// Moves `u` downhill along `groups` of the coordinates of `space`, at most `iterations` times; the loss there.
pub fn descend(
    space: &Space,
    readings: &[Reading],
    loss: &Loss,
    groups: &[usize],
    iterations: usize,
    u: &mut [f64],
) -> f64 {
    let mut here = Point::default();
    if !space.values(u, readings, false, &mut here) {
        return f64::INFINITY;
    }
    let mut value = loss.sum(readings, &here.values);
    let (mut there, mut aside) = (Point::default(), Point::default());
    // The columns of the Jacobian: one of each group for all three channels, or one for each channel.
    let mut columns = Vec::new();
    for &g in groups {
        columns.extend(space.groups[g].clone());
    }
    let n = columns.len();
    let mut slopes: Vec<Vec<Vec3>> = vec![Vec::new(); groups.len()];
    let (mut normal, mut gradient) = (vec![0.0; n * n], vec![0.0; n]);
    let mut damping = 1e-2;
    let mut idle = 0;
    for _ in 0..iterations {
        for (slope, &g) in slopes.iter_mut().zip(groups) {
            let group = space.groups[g].clone();
            let mut moved = u.to_vec();
            // All coordinates of a group step to the same side, that with more room.
            let step = if group.clone().map(|k| u[k]).sum::<f64>() > 0.5 * group.len() as f64 {
                -STEP
            } else {
                STEP
            };
            // A triple steps as one: each of its channels sees its own coordinate only.
            group.clone().for_each(|k| moved[k] += step);
            aside.tables.clone_from(&here.tables);
            aside.keys.clone_from(&here.keys);
            slope.clear();
            if space.values(&moved, readings, false, &mut aside) {
                let quotient = aside.values.iter().zip(&here.values).map(|(a, b)| (*a - *b) / step as f32);
                slope.extend(quotient);
            } else {
                slope.resize(readings.len(), Vec3::ZERO);
            }
        }
        normal.fill(0.0);
        gradient.fill(0.0);
        let mut row = vec![(0usize, 0.0f64); groups.len()];
        for (i, r) in readings.iter().enumerate() {
            for c in 0..3 {
                let (d, h) = loss.difference(r, &here.values[i], c);
                let w = f64::from(r.weight) * loss.weight(d);
                let mut at = 0;
                for ((slot, slope), &g) in row.iter_mut().zip(&slopes).zip(groups) {
                    let width = space.groups[g].len();
                    *slot = (at + if width == 3 { c } else { 0 }, h * f64::from(slope[i][c]));
                    at += width;
                }
                for (k, &(a, x)) in row.iter().enumerate() {
                    let wx = w * x;
                    gradient[a] += wx * d;
                    for &(b, y) in &row[..=k] {
                        normal[a * n + b] += wx * y;
                    }
                }
            }
        }
        if !gradient.iter().all(|g| g.is_finite()) || !normal.iter().all(|g| g.is_finite()) {
            return value;
        }
        // At a wall, what would go through it stays (projected gradient).
        let held: Vec<bool> = (0..n)
            .map(|a| {
                let at = u[columns[a]];
                (at <= 0.0 && gradient[a] > 0.0)
                    || (at >= 1.0 && gradient[a] < 0.0)
                    || normal[a * n + a] <= 0.0
            })
            .collect();
        let mut better = false;
        for _ in 0..6 {
            let Some(step) = solve(&normal, &gradient, &held, damping) else {
                damping *= 10.0;
                continue;
            };
            // No farther than the slopes can be trusted.
            let longest = step.iter().fold(0.0f64, |a, s| a.max(s.abs()));
            let short = (REACH / longest.max(f64::MIN_POSITIVE)).min(1.0);
            let mut tried = u.to_vec();
            for (a, s) in step.iter().enumerate() {
                tried[columns[a]] = (tried[columns[a]] - short * s).clamp(0.0, 1.0);
            }
            there.tables.clone_from(&here.tables);
            there.keys.clone_from(&here.keys);
            let found = if space.values(&tried, readings, false, &mut there) {
                loss.sum(readings, &there.values)
            } else {
                f64::INFINITY
            };
            if found < value {
                let gain = (value - found) / value;
                u.copy_from_slice(&tried);
                std::mem::swap(&mut here, &mut there);
                value = found;
                damping = (damping * 0.2f64).max(1e-9);
                idle = if gain < 1e-5 { idle + 1 } else { 0 };
                better = true;
                break;
            }
            damping *= 5.0;
        }
        if !better || idle >= 2 {
            break;
        }
    }
    value
}

/// (N + damping · diag N) x = g by Cholesky's method, with zero where `held`; N is given by its lower triangle.
fn solve(normal: &[f64], gradient: &[f64], held: &[bool], damping: f64) -> Option<Vec<f64>> {
    let n = gradient.len();
    let mut l = vec![0.0; n * n];
    let mut x = vec![0.0; n];
    for i in 0..n {
        for j in 0..=i {
            let mut sum = if held[i] || held[j] {
                f64::from(u8::from(i == j))
            } else {
                normal[i * n + j] * if i == j { 1.0 + damping } else { 1.0 }
            };
            sum -= (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum::<f64>();
            l[i * n + j] = if i == j {
                if sum <= 0.0 {
                    return None;
                }
                sum.sqrt()
            } else {
                sum / l[j * n + j]
            };
        }
        let right = if held[i] { 0.0 } else { gradient[i] };
        x[i] = (right - (0..i).map(|k| l[i * n + k] * x[k]).sum::<f64>()) / l[i * n + i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| l[k * n + i] * x[k]).sum::<f64>()) / l[i * n + i];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damped_normal_equations_are_solved_around_what_is_held() {
        let normal = [4.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.5, 0.2, 2.0];
        let x = solve(&normal, &[1.0, 2.0, 3.0], &[false, false, false], 0.0).unwrap();
        let back = [4.0 * x[0] + x[1] + 0.5 * x[2], x[0] + 3.0 * x[1] + 0.2 * x[2]];
        assert!((back[0] - 1.0).abs() < 1e-12 && (back[1] - 2.0).abs() < 1e-12);
        let x = solve(&normal, &[1.0, 2.0, 3.0], &[false, true, false], 1.0).unwrap();
        assert!(x[1] == 0.0 && (8.0 * x[0] + 0.5 * x[2] - 1.0).abs() < 1e-12);
        assert!(solve(&[-1.0], &[1.0], &[false], 0.0).is_none());
    }
}
