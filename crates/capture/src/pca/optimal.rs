//! Where few readings tell most.

use super::directions_of;
use super::linear::eigen;
use yugen_archive::formats::pca_basis::Basis;
use yugen_optics::random::Pcg32;
use yugen_reflectance::merl::{PHI_D, THETA_D, THETA_H};

/// Condition of the first `n` components at these rows: the largest singular value over the smallest.
pub fn condition(basis: &Basis, rows: &[usize], n: usize) -> f64 {
    let m = rows.len();
    let row = |i: usize| &basis.q[rows[i] * basis.components..][..n];
    let dot = |i, j| row(i).iter().zip(row(j)).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    let square: Vec<f64> = (0..m * m).map(|at| dot(at / m, at % m)).collect();
    let (values, _) = eigen(&square, m);
    if values[m - 1] > 0.0 { (values[0] / values[m - 1]).sqrt() } else { f64::INFINITY }
}

/// Which pairs of directions can be measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// The farthest that light and eye lie from the normal, radians.
    pub most: f32,
    /// The least angle between light and eye, radians: a lamp cannot stand where the camera is.
    pub apart: f32,
}

impl Reach {
    /// Everything above the surface.
    pub const ALL: Self = Self { most: std::f32::consts::FRAC_PI_2, apart: 0.0 };

    fn holds(self, bin: u32) -> bool {
        let (wo, wi) = directions_of(bin as usize);
        wo.z.min(wi.z) >= self.most.cos() && wo.angle_between(wi) >= self.apart
    }
}

/// Optimal rows for `n` readings within `reach`: first that of the largest components; then, one after the other, the best of 500 at
/// random by the condition of the first `n` components there, after each of which all take turns to step aside, by
/// three bins and then by one, while that helps. The basis must have `n` components. Empty where fewer than `n` rows
/// lie within reach.
///
/// # Panics
/// If it has fewer.
pub fn optimal_rows(basis: &Basis, n: usize, reach: Reach, progress: &dyn Fn(f64)) -> Vec<usize> {
    const DRAWS: usize = 500;
    assert!(n <= basis.components);
    let k = basis.components;
    let length = |r: &usize| basis.q[r * k..][..n].iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
    let all: Vec<usize> = (0..basis.bins.len()).filter(|&row| reach.holds(basis.bins[row])).collect();
    let first = all.iter().copied().max_by(|a, b| length(a).total_cmp(&length(b)));
    let Some(first) = first.filter(|_| n > 0 && all.len() >= n) else {
        return Vec::new();
    };
    let mut rows = vec![first];
    let mut rng = Pcg32::new(2015, 1);
    while rows.len() < n {
        let last = rows.len();
        rows.push(0);
        let mut best = (f64::INFINITY, 0);
        for _ in 0..DRAWS {
            let row = all[((u64::from(rng.next_u32()) * all.len() as u64) >> 32) as usize];
            if rows[..last].contains(&row) {
                continue;
            }
            rows[last] = row;
            let found = condition(basis, &rows, n);
            if found < best.0 {
                best = (found, row);
            }
        }
        rows[last] = best.1;
        let mut found = best.0;
        for step in [3i32, 1] {
            // Until a round changes less than a thousandth of a percent, three times; a bound, in case it never does.
            let mut still = 0;
            for _ in 0..200 {
                let before = found;
                for i in 0..rows.len() {
                    for (axis, sign) in [(0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1)] {
                        let Some(row) = aside(basis, rows[i], axis, sign * step) else { continue };
                        if rows.contains(&row) || all.binary_search(&row).is_err() {
                            continue;
                        }
                        let old = std::mem::replace(&mut rows[i], row);
                        let now = condition(basis, &rows, n);
                        if now < found {
                            found = now;
                        } else {
                            rows[i] = old;
                        }
                    }
                }
                still = if found > before * (1.0 - 1e-5) { still + 1 } else { 0 };
                if still == 3 || found == before {
                    break;
                }
            }
        }
        progress(rows.len() as f64 / n as f64);
    }
    rows
}

/// The row so many bins aside along φ_d (which comes round), θ_h or θ_d.
fn aside(basis: &Basis, row: usize, axis: usize, step: i32) -> Option<usize> {
    let bin = basis.bins[row] as usize;
    let mut at = [bin % PHI_D, bin / (THETA_D * PHI_D), bin / PHI_D % THETA_D].map(|x| x as i32);
    at[axis] += step;
    at[0] = at[0].rem_euclid(PHI_D as i32);
    let inside = (0..THETA_H as i32).contains(&at[1]) && (0..THETA_D as i32).contains(&at[2]);
    let bin = |at: [i32; 3]| ((at[1] as usize * THETA_D + at[2] as usize) * PHI_D + at[0] as usize) as u32;
    if inside { basis.bins.binary_search(&bin(at)).ok() } else { None }
}
