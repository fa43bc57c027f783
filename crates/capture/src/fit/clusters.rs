//! Texels that look alike, and what their numbers are drawn from.

use super::Outcome;
use super::model::{N, Theta};
use super::prior::Member;
use super::rays::Ray;
use super::start::solve;
use yugen_optics::random::Pcg32;

/// What a texel looks like, in units in which a difference of one is a different thread.
pub(super) type Features = [f32; 7];

type Matrix = [[f64; N]; N];

/// The numbers of θ that belong to the material, and those that belong to the normal.
const MATERIAL: [usize; 5] = [0, 1, 4, 5, 6];
const NORMAL: [usize; 2] = [2, 3];
/// A ground as dark as this is black, whatever hue its noise has: else one metal would look like many.
const BLACK: f32 = 0.002;

/// The look of a texel: how bright its ground is, the hues of its darker and brighter readings, and which way half
/// vectors shine.
pub(super) fn features(
    ray: impl Fn(usize) -> Ray,
    usable: impl Fn(usize) -> bool,
    n: usize,
    rgb: impl Fn(usize) -> [f32; 3],
) -> Features {
    let level = |i: usize| rgb(i).iter().sum::<f32>().max(0.0) / ray(i)[5];
    let (mut sum, mut count) = (0.0, 0);
    for i in (0..n).filter(|&i| usable(i)) {
        sum += level(i).sqrt();
        count += 1;
    }
    if count == 0 {
        return [0.0; 7];
    }
    // The mean of roots divides ground from highlight well enough and needs no sorting.
    let border = (sum / count as f32).powi(2);
    let (mut dark, mut bright, mut darks) = ([1e-4; 3], [1e-4; 3], 0.0);
    let (mut weight, mut first, mut second) = (1e-6, [0.0; 2], [0.0; 3]);
    for i in (0..n).filter(|&i| usable(i)) {
        let (l, c, [x, y, ..]) = (level(i), rgb(i), ray(i));
        let to = if l < border { &mut dark } else { &mut bright };
        for (to, c) in to.iter_mut().zip(c) {
            *to += c.max(0.0);
        }
        darks += if l < border { ray(i)[5] } else { 0.0 };
        weight += l;
        first = [first[0] + l * x, first[1] + l * y];
        second = [second[0] + l * x * x, second[1] + l * x * y, second[2] + l * y * y];
    }
    let hue = |c: [f32; 3]| [c[0], c[1]].map(|v| v / (c[0] + c[1] + c[2]) / 0.05);
    let dark = dark.map(|c| c + BLACK * darks);
    let ground = (dark.iter().sum::<f32>() / f32::max(darks, 1e-3)).max(1e-3).ln() / 0.5;
    let [mx, my] = first.map(|v| v / weight);
    let [xx, xy, yy] = second.map(|v| v / weight);
    let (xx, xy, yy) = (xx - mx * mx, xy - mx * my, yy - my * my);
    let long = [xx - yy, 2.0 * xy].map(|v| v / (xx + yy).max(1e-6) / 0.2);
    let ([dr, dg], [br, bg]) = (hue(dark), hue(bright));
    [ground, dr, dg, br, bg, long[0], long[1]]
}

pub(super) fn distance(a: &Features, b: &Features) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

pub(super) fn nearest(centres: &[Features], features: &Features) -> usize {
    let far = |i: &usize| distance(&centres[*i], features);
    (0..centres.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0)
}

/// Lloyd 1982, started as Arthur and Vassilvitskii 2007.
pub(super) fn k_means(outcomes: &[Member], k: usize) -> Vec<Features> {
    let mut rng = Pcg32::new(1, 7);
    let mut centres = vec![outcomes[0].features];
    while centres.len() < k {
        let far = |o: &Member| distance(&centres[nearest(&centres, &o.features)], &o.features);
        let total: f32 = outcomes.iter().map(far).sum();
        if total <= 0.0 {
            break;
        }
        let mut left = rng.next_f32() * total;
        let next = outcomes.iter().find(|o| {
            left -= far(o);
            left <= 0.0
        });
        centres.push(next.unwrap_or(&outcomes[outcomes.len() - 1]).features);
    }
    for _ in 0..20 {
        let mut sums = vec![([0.0f64; 7], 0.0f64); centres.len()];
        for o in outcomes {
            let (sum, count) = &mut sums[nearest(&centres, &o.features)];
            sum.iter_mut().zip(o.features).for_each(|(s, f)| *s += f64::from(f));
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
    pub fn leaning(&self, centre: Features, texels: &[Outcome]) -> Self {
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

    pub fn of(centre: Features, members: &[&Member]) -> Self {
        // What the readings of a texel say by themselves: curvature H, and H times where its parabola is lowest.
        let texels: Vec<(Matrix, [f64; N])> = members
            .iter()
            .map(|o| {
                let h = o.lesson.information.map(|row| row.map(f64::from));
                let at = o.theta.map(f64::from);
                (
                    h,
                    std::array::from_fn(|i| {
                        (0..N).map(|j| h[i][j] * at[j]).sum::<f64>() - f64::from(o.lesson.slope[i])
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
