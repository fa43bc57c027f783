//! Levenberg 1944, Marquardt 1963: damped Gauss-Newton, every texel with a damping of its own.

use super::model::{Loss, N, SIGMA, STEEPEST, Sums, evaluate, wide};
use super::profile::Profile;
use super::rays::Rays;
use crate::lanes::{F, Mask};

/// What is known beforehand: a Gaussian about `mean` with inverse covariance `precision`.
#[derive(Clone, Copy)]
pub(crate) struct GaussianPrior {
    pub mean: [F; N],
    pub precision: [[F; N]; N],
}

/// Where refinement has come to.
#[derive(Clone, Copy)]
pub(crate) struct Refined {
    pub theta: [F; N],
    /// Of the readings alone.
    pub sums: Sums,
    /// Passes over the readings that each texel needed.
    pub passes: F,
}

impl Refined {
    /// Takes the other where the mask says so.
    pub fn exchange(&mut self, taken: Mask, other: &Self) {
        for (to, from) in self.theta.iter_mut().zip(other.theta) {
            *to = taken.choose(from, *to);
        }
        self.sums = better_sums(taken, &other.sums, &self.sums);
        self.passes += other.passes;
    }
}

/// Steps until a step gains less than `enough` of χ², at most `limit` of them.
pub(crate) fn refine<R: Rays>(
    rays: R,
    value: &[F],
    weight: &[F],
    start: [F; N],
    profile: &Profile,
    known: &GaussianPrior,
    loss: &Loss,
    limit: usize,
    enough: F,
) -> Refined {
    let mut theta = bound(start);
    let mut sums = evaluate(rays, value, weight, &theta, profile, loss);
    let mut cost = sums.cost + known.cost(&theta);
    let mut damping = F::splat(1e-3);
    let mut active: Mask = F::ONE;
    let mut passes = F::ONE;
    for _ in 0..limit {
        let trial = wide!(
            bounded_step(theta: &[F; N], sums: &Sums, known: &GaussianPrior, damping: F) -> [F; N];
            &theta, &sums, known, damping);
        let at = evaluate(rays, value, weight, &trial, profile, loss);
        passes += active;
        let trial_cost = at.cost + known.cost(&trial);
        let gain = cost - trial_cost;
        let better: Mask = active * gain.above(F::ZERO);
        for (t, new) in theta.iter_mut().zip(trial) {
            *t = better.choose(new, *t);
        }
        sums = better_sums(better, &at, &sums);
        cost = better.choose(trial_cost, cost);
        damping = better.choose(damping * 0.1, damping * 10.0).clamp(1e-7, 1e9);
        // A texel that is done stands still, so that its bits do not depend on who goes in step with it.
        let done = better.choose(enough.above(gain), damping.above(F::splat(1e5)));
        active = active * (F::ONE - done);
        if !active.any() {
            break;
        }
    }
    Refined { theta, sums, passes }
}

fn better_sums(better: Mask, new: &Sums, old: &Sums) -> Sums {
    Sums {
        cost: better.choose(new.cost, old.cost),
        gradient: std::array::from_fn(|i| better.choose(new.gradient[i], old.gradient[i])),
        curvature: std::array::from_fn(|i| {
            std::array::from_fn(|j| better.choose(new.curvature[i][j], old.curvature[i][j]))
        }),
    }
}

impl GaussianPrior {
    pub fn cost(&self, theta: &[F; N]) -> F {
        let pull = self.pull(theta);
        (0..N).fold(F::ZERO, |sum, i| sum + pull[i] * (theta[i] - self.mean[i]))
    }

    #[inline(always)]
    fn pull(&self, theta: &[F; N]) -> [F; N] {
        let mut pull = [F::ZERO; N];
        for i in 0..N {
            for j in 0..N {
                pull[i] += self.precision[i][j] * (theta[j] - self.mean[j]);
            }
        }
        pull
    }
}

/// How far one step may go: the model is no parabola further out.
const LONGEST: [f32; N] = [f32::INFINITY, 1.5, 0.2, 0.2, 1.0, 0.7, 0.7];

#[inline(always)]
fn bounded_step(theta: &[F; N], sums: &Sums, known: &GaussianPrior, damping: F) -> [F; N] {
    bound(step(theta, sums, known, damping))
}

#[inline(always)]
fn step(theta: &[F; N], sums: &Sums, known: &GaussianPrior, damping: F) -> [F; N] {
    let pull = known.pull(theta);
    let mut h = sums.curvature;
    let mut g = [F::ZERO; N];
    for i in 0..N {
        g[i] = -(sums.gradient[i] + pull[i]);
        for j in 0..N {
            h[i][j] += known.precision[i][j];
        }
        h[i][i] = h[i][i] + h[i][i] * damping + 1e-9;
    }
    // A ground that is black and would become darker stays black, and the others know it.
    let stuck: Mask = (F::ONE - theta[0].above(F::ZERO)) * F::ZERO.above(g[0]);
    let free = F::ONE - stuck;
    for i in 1..N {
        h[i][0] = h[i][0] * free;
        h[0][i] = h[i][0];
    }
    g[0] = g[0] * free;
    let step = solve(&factor(&h), g);
    let steep = theta[2] * theta[2] + theta[3] * theta[3] + 1.0;
    let mut shrink = F::ONE;
    for i in 1..N {
        // A slope of s is an angle whose tangent it is: it may change by as much more.
        let longest = if i == 2 || i == 3 { steep * LONGEST[i] } else { F::splat(LONGEST[i]) };
        shrink = shrink.min(longest / step[i].abs().max(F::splat(1e-12)));
    }
    let mut to = *theta;
    for i in 0..N {
        to[i] = theta[i] + step[i] * shrink;
    }
    to
}

/// Keeps the numbers where they mean something.
#[inline(always)]
fn bound(theta: [F; N]) -> [F; N] {
    let [d, log_a, a, b, m, p, q] = theta;
    let (low, high) = (-2.0 * SIGMA[1].ln(), -2.0 * SIGMA[0].ln());
    let m = m.clamp(low, high);
    let margin = (m - low).min(F::splat(high) - m).max(F::splat(1e-3));
    let r = (p * p + q * q + 1e-12).sqrt();
    let shrink = (margin / r).min(F::ONE);
    [
        d.max(F::ZERO),
        log_a.clamp(-20.0, 14.0),
        a.clamp(-STEEPEST, STEEPEST),
        b.clamp(-STEEPEST, STEEPEST),
        m,
        p * shrink,
        q * shrink,
    ]
}

/// Cholesky's factor, its diagonal inverted.
#[inline(always)]
pub(crate) fn factor(h: &[[F; N]; N]) -> [[F; N]; N] {
    let mut l = *h;
    for i in 0..N {
        for j in 0..=i {
            let mut v = l[i][j];
            for k in 0..j {
                v = v - l[i][k] * l[j][k];
            }
            l[i][j] =
                if i == j { F::ONE / v.max(h[i][i] * 1e-7).max(F::splat(1e-30)).sqrt() } else { v * l[j][j] };
        }
    }
    l
}

/// Solves with what [`factor`] made.
#[inline(always)]
pub(crate) fn solve(l: &[[F; N]; N], mut g: [F; N]) -> [F; N] {
    for i in 0..N {
        for k in 0..i {
            g[i] = g[i] - l[i][k] * g[k];
        }
        g[i] = g[i] * l[i][i];
    }
    for i in (0..N).rev() {
        for k in i + 1..N {
            g[i] = g[i] - l[k][i] * g[k];
        }
        g[i] = g[i] * l[i][i];
    }
    g
}
