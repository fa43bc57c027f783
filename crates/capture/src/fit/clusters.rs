//! Texels that look alike, and what their numbers are drawn from.

use super::features::{Features, distance, nearest};
use super::model::{N, Theta};
use super::outcome::{Evidence, Outcome};
use super::start::solve;
use yugen_optics::random::Pcg32;

type Matrix = [[f64; N]; N];

/// The numbers of θ that belong to the material, and those that belong to the normal.
const MATERIAL: [usize; 5] = [0, 1, 4, 5, 6];
const NORMAL: [usize; 2] = [2, 3];
/// A texel that a cluster is learned from.
#[derive(Clone, Copy)]
pub(super) struct Member<'a> {
    pub theta: &'a Theta,
    pub evidence: &'a Evidence,
}

/// Lloyd 1982, started as Arthur and Vassilvitskii 2007.
pub(super) fn k_means(texels: &[Features], k: usize) -> Vec<Features> {
    let mut rng = Pcg32::new(1, 7);
    let mut centres = vec![texels[0]];
    while centres.len() < k {
        let far = |t: &Features| distance(&centres[nearest(&centres, t)], t);
        let total: f32 = texels.iter().map(far).sum();
        if total <= 0.0 {
            break;
        }
        let mut left = rng.next_f32() * total;
        let next = texels.iter().find(|t| {
            left -= far(t);
            left <= 0.0
        });
        centres.push(*next.unwrap_or(&texels[texels.len() - 1]));
    }
    for _ in 0..20 {
        let mut sums = vec![([0.0f64; 7], 0.0f64); centres.len()];
        for t in texels {
            let (sum, count) = &mut sums[nearest(&centres, t)];
            sum.iter_mut().zip(t).for_each(|(s, f)| *s += f64::from(*f));
            *count += 1.0;
        }
        for (centre, (sum, count)) in centres.iter_mut().zip(sums) {
            if count > 0.0 {
                *centre = sum.map(|s| (s / count) as f32);
            }
        }
    }
    centres
}

/// Standard deviations within a thread that are never undercut: a thousandth of white for the ground and [`GROUND`] of it,
/// 5 % of the highlight, a degree of the normal, some percent of widths.
const SPREAD: [f64; N] = [0.001, 0.05, 0.02, 0.02, 0.05, 0.05, 0.05];
const GROUND: f64 = 0.05;

impl Cluster {
    /// The same with any normal.
    pub fn material(&self) -> Self {
        let mut spread = inverse(&self.precision).unwrap_or([[0.0; N]; N]);
        let mut mean = self.mean;
        for n in NORMAL {
            mean[n] = 0.0;
            for i in 0..N {
                (spread[n][i], spread[i][n]) = (0.0, 0.0);
            }
            spread[n][n] = 4.0;
        }
        Self { centre: self.centre, mean, precision: inverse(&spread).unwrap_or(self.precision) }
    }

    /// A material with the normals of texels that were fitted with it.
    pub fn with_normals(&self, centre: Features, texels: &[Outcome]) -> Self {
        let mut spread = inverse(&self.precision).unwrap_or([[0.0; N]; N]);
        let mut mean = self.mean;
        let count = texels.len().max(1) as f64;
        let at = |o: &Outcome, n: usize| f64::from(o.theta[n]);
        for n in NORMAL {
            mean[n] = texels.iter().map(|o| at(o, n)).sum::<f64>() / count;
        }
        for n in NORMAL {
            for m in NORMAL {
                let both = texels.iter().map(|o| (at(o, n) - mean[n]) * (at(o, m) - mean[m]));
                // Room for a normal that none of the few has.
                spread[n][m] = 2.0 * both.sum::<f64>() / count + if n == m { 0.04 } else { 0.0 };
            }
        }
        Self { centre, mean, precision: inverse(&spread).unwrap_or(self.precision) }
    }

    /// Whether two are made of something else.
    pub fn differs(&self, other: &Self) -> bool {
        let (Some(a), Some(b)) = (inverse(&self.precision), inverse(&other.precision)) else { return true };
        let apart = MATERIAL.map(|i| (self.mean[i] - other.mean[i]).powi(2) / (a[i][i] + b[i][i]));
        apart.iter().sum::<f64>() > MATERIAL.len() as f64
    }

    /// What it costs to be another than the mean.
    pub fn cost(&self, theta: &Theta) -> f64 {
        let off: [f64; N] = std::array::from_fn(|i| f64::from(theta[i]) - self.mean[i]);
        (0..N).map(|i| (0..N).map(|j| off[i] * self.precision[i][j] * off[j]).sum::<f64>()).sum()
    }

    pub fn of(centre: Features, members: &[Member]) -> Self {
        // What the readings of a texel say by themselves: curvature H, and H times where its parabola is lowest.
        let texels: Vec<(Matrix, [f64; N])> = members
            .iter()
            .map(|o| {
                let h = o.evidence.information.map(|row| row.map(f64::from));
                let at = o.theta.map(f64::from);
                (
                    h,
                    std::array::from_fn(|i| {
                        (0..N).map(|j| h[i][j] * at[j]).sum::<f64>() - f64::from(o.evidence.slope[i])
                    }),
                )
            })
            .collect();
        let mut mean: [f64; N] = std::array::from_fn(|i| {
            let mut all: Vec<f32> = members.iter().map(|o| o.theta[i]).collect();
            let middle = all.len() / 2;
            f64::from(*all.select_nth_unstable_by(middle, f32::total_cmp).1)
        });
        let mut spread: Matrix = [[0.0; N]; N];
        for (i, wide) in [0.1, 1.0, 0.2, 0.2, 0.7, 0.7, 0.7].into_iter().enumerate() {
            spread[i][i] = wide * wide;
        }
        let mut precision = inverse(&spread).unwrap_or(spread);
        for _ in 0..24 {
            let (mut total, mut sum, mut scatter) = (0.0, [0.0; N], [[0.0; N]; N]);
            for (h, b) in &texels {
                let both: Matrix =
                    std::array::from_fn(|i| std::array::from_fn(|j| h[i][j] + precision[i][j]));
                let Some(covariance) = inverse(&both) else { continue };
                let right: [f64; N] =
                    std::array::from_fn(|i| b[i] + (0..N).map(|j| precision[i][j] * mean[j]).sum::<f64>());
                let off: [f64; N] = std::array::from_fn(|i| {
                    (0..N).map(|j| covariance[i][j] * right[j]).sum::<f64>() - mean[i]
                });
                // Student's t with four degrees of freedom: a texel far from all others is of another thread.
                let far: f64 =
                    (0..N).map(|i| (0..N).map(|j| off[i] * precision[i][j] * off[j]).sum::<f64>()).sum();
                let w = (4.0 + N as f64) / (4.0 + far);
                total += w;
                for i in 0..N {
                    sum[i] += w * off[i];
                    for j in 0..N {
                        scatter[i][j] += w * (covariance[i][j] + off[i] * off[j]);
                    }
                }
            }
            if total <= 0.0 {
                break;
            }
            let shift = sum.map(|s| s / total);
            for i in 0..N {
                mean[i] += shift[i];
                for j in 0..N {
                    spread[i][j] = scatter[i][j] / total - shift[i] * shift[j];
                }
            }
            for (i, least) in SPREAD.into_iter().enumerate() {
                let least = if i == 0 { least + GROUND * mean[0].max(0.0) } else { least };
                spread[i][i] += least * least;
            }
            match inverse(&spread) {
                Some(p) => precision = p,
                None => break,
            }
        }
        Self { centre, mean, precision }
    }
}

fn inverse(h: &Matrix) -> Option<Matrix> {
    let mut out = [[0.0; N]; N];
    for i in 0..N {
        let mut unit = [0.0; N];
        unit[i] = 1.0;
        let column = solve(*h, unit)?;
        for j in 0..N {
            out[j][i] = column[j];
        }
    }
    Some(out)
}
#[derive(Clone, Debug)]
pub(super) struct Cluster {
    pub centre: Features,
    pub mean: [f64; N],
    pub precision: Matrix,
}
