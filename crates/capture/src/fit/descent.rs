//! From a start to what fits the readings best.

use super::fitted::Options;
use super::model::{self, Loss, N, robust_weights};
use super::profile::Profile;
use super::rays::Rays;
use super::refine::{GaussianPrior, Refined, refine};
use super::scratch::Scratch;
use crate::lanes::{F, Mask};

/// The way from a start to what fits the readings best.
#[derive(Clone, Copy)]
pub(super) struct Descent<'a, R> {
    pub rays: R,
    pub profile: &'a Profile,
    pub known: &'a GaussianPrior,
    /// With the noise as it was found. Far from the solution it is good not to be too sure of the readings, and it is as
    /// it was said.
    pub found: &'a Options,
}

impl<R: Rays> Descent<'_, R> {
    pub fn from(&self, start: [F; N], scratch: &mut Scratch) -> Solution {
        let Self { rays, profile, known, .. } = *self;
        scratch.weight.clone_from(&scratch.stated);
        let early = Loss { knee: F::splat(3.0), shadows: false };
        let first =
            refine(rays, &scratch.value, &scratch.weight, start, profile, known, &early, 6, F::splat(1.0));
        let level = reweigh(rays, scratch, &first.theta, profile, self.found);
        let loss = Loss { knee: level * 4.0, shadows: true };
        let enough = level * level * 0.01;
        let mut refined =
            refine(rays, &scratch.value, &scratch.weight, first.theta, profile, known, &loss, 20, enough);
        refined.passes += first.passes;
        Solution { refined, loss, weight: scratch.weight.clone() }
    }
}

/// Where a descent has come to.
pub(super) struct Solution {
    pub refined: Refined,
    pub loss: Loss,
    /// 1/σ of the readings, as the model has them.
    pub weight: Vec<F>,
}

impl Solution {
    pub fn posterior(&self, known: &GaussianPrior) -> F {
        self.refined.sums.cost + known.cost(&self.refined.theta)
    }

    pub fn exchange(&mut self, taken: Mask, other: Self) {
        self.refined.exchange(taken, &other.refined);
        self.loss.knee = taken.choose(other.loss.knee, self.loss.knee);
        for (to, from) in self.weight.iter_mut().zip(other.weight) {
            *to = taken.choose(from, *to);
        }
    }

    /// Curvature of ½χ² of the readings alone, in units of the noise that there is.
    pub fn information(&self, lane: usize, usable: usize) -> [[f32; N]; N] {
        let chi2 = chi2(self.refined.sums.cost.0[lane], usable);
        self.refined.sums.curvature.map(|row| row.map(|v| v.0[lane] / chi2))
    }
}

/// χ² a degree of freedom.
pub(super) fn chi2(cost: f32, usable: usize) -> f32 {
    (cost / usable.saturating_sub(N).max(1) as f32).max(0.05)
}

/// The Gaussian highlight that comes nearest to one with tails: normal and direction stay. It describes the readings
/// less well than their noise would have it, so the noise is what was said.
pub(super) fn ward_of<R: Rays>(rays: R, scratch: &mut Scratch, done: &Refined, options: &Options) -> Refined {
    let mut held = GaussianPrior { mean: done.theta, precision: [[F::ZERO; N]; N] };
    for (i, tight) in [(2, 1e8), (3, 1e8), (5, 1e4), (6, 1e4)] {
        held.precision[i][i] = F::splat(tight);
    }
    let profile = &Profile::GAUSSIAN;
    let ward = Descent { rays, profile, known: &held, found: options }.from(done.theta, scratch);
    let Solution { refined, loss, weight } = ward;
    robust_weights(rays, &scratch.value, &weight, &refined.theta, profile, &loss, &mut scratch.counted);
    refined
}

/// Weights by what the model says instead of the readings, which noise and shadows have pulled; and how large the
/// residuals then are, at least one.
fn reweigh<R: Rays>(
    rays: R,
    scratch: &mut Scratch,
    theta: &[F; N],
    profile: &Profile,
    options: &Options,
) -> F {
    model::model(rays, theta, profile, &mut scratch.counted);
    for ((weight, value), model) in scratch.weight.iter_mut().zip(&scratch.value).zip(&scratch.counted) {
        let level = value.max(*model);
        let new = F::ONE / (level.max(F::ZERO) * options.noise + options.floor);
        *weight = weight.above(F::ZERO).choose(new, F::ZERO);
    }
    let mut sorted: Vec<f32> = Vec::with_capacity(scratch.value.len());
    F(std::array::from_fn(|lane| {
        sorted.clear();
        let residuals = scratch.value.iter().zip(&scratch.counted).zip(&scratch.weight);
        sorted.extend(
            residuals
                .filter(|r| r.1.0[lane] > 0.0)
                .map(|((v, m), w)| (v.0[lane] - m.0[lane]).abs() * w.0[lane]),
        );
        if sorted.is_empty() {
            return 1.0;
        }
        let middle = sorted.len() / 2;
        // The median of |z| of a normal deviate is 0.6745.
        (*sorted.select_nth_unstable_by(middle, f32::total_cmp).1 / 0.6745).max(1.0)
    }))
}
