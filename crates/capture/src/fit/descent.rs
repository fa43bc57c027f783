//! From a start to what fits the readings best.

use super::Options;
use super::model::{self, Loss, N, robust_weights};
use super::profile::Profile;
use super::rays::Rays;
use super::refine::{Known, Refined, refine};
use super::room::Room;
use crate::lanes::{F, Mask};

/// The way from a start to what fits the readings best.
#[derive(Clone, Copy)]
pub(super) struct Descent<'a, R> {
    pub rays: R,
    pub profile: &'a Profile,
    pub known: &'a Known,
    /// With the noise as it was found. Far from the solution it is good not to be too sure of the readings, and it is as
    /// it was said.
    pub found: &'a Options,
}

impl<R: Rays> Descent<'_, R> {
    pub fn from(&self, start: [F; N], room: &mut Room) -> Descended {
        let Self { rays, profile, known, .. } = *self;
        room.weight.clone_from(&room.stated);
        let early = Loss { knee: F::splat(3.0), shadows: false };
        let first = refine(rays, &room.value, &room.weight, start, profile, known, &early, 6, F::splat(1.0));
        let level = reweigh(rays, room, &first.theta, profile, self.found);
        let loss = Loss { knee: level * 4.0, shadows: true };
        let enough = level * level * 0.01;
        let mut refined =
            refine(rays, &room.value, &room.weight, first.theta, profile, known, &loss, 20, enough);
        refined.passes += first.passes;
        Descended { refined, loss, weight: room.weight.clone() }
    }
}

/// Where a descent has come to.
pub(super) struct Descended {
    pub refined: Refined,
    pub loss: Loss,
    /// 1/σ of the readings, as the model has them.
    pub weight: Vec<F>,
}

impl Descended {
    pub fn posterior(&self, known: &Known) -> F {
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
pub(super) fn ward_of<R: Rays>(rays: R, room: &mut Room, done: &Refined, options: &Options) -> Refined {
    let mut held = Known { mean: done.theta, precision: [[F::ZERO; N]; N] };
    for (i, tight) in [(2, 1e8), (3, 1e8), (5, 1e4), (6, 1e4)] {
        held.precision[i][i] = F::splat(tight);
    }
    let profile = &Profile::GAUSSIAN;
    let ward = Descent { rays, profile, known: &held, found: options }.from(done.theta, room);
    let Descended { refined, loss, weight } = ward;
    robust_weights(rays, &room.value, &weight, &refined.theta, profile, &loss, &mut room.counted);
    refined
}

/// Weights by what the model says instead of the readings, which noise and shadows have pulled; and how large the
/// residuals then are, at least one.
fn reweigh<R: Rays>(rays: R, room: &mut Room, theta: &[F; N], profile: &Profile, options: &Options) -> F {
    model::model(rays, theta, profile, &mut room.counted);
    for ((weight, value), model) in room.weight.iter_mut().zip(&room.value).zip(&room.counted) {
        let level = value.max(*model);
        let new = F::ONE / (level.max(F::ZERO) * options.noise + options.floor);
        *weight = weight.above(F::ZERO).choose(new, F::ZERO);
    }
    let mut sorted: Vec<f32> = Vec::with_capacity(room.value.len());
    F(std::array::from_fn(|lane| {
        sorted.clear();
        let residuals = room.value.iter().zip(&room.counted).zip(&room.weight);
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
