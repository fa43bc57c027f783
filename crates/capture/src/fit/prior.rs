//! What is known of the texels of a cloth before they are fitted.

use super::clusters::Cluster;
use super::features::{Features, distance};
use super::fitted::Options;
use super::model::{N, Theta};
use super::profile::Profile;
use super::refine::GaussianPrior;
use crate::lanes::{F, LANES};

/// What is known of any cloth: the inverse variances of ρ_d, ln A, a, b, m, p, q. Nothing of the ground; of the rest so
/// little that three readings outweigh it.
pub(super) const VAGUE: [f32; N] = [0.0, 0.05, 3.0, 3.0, 0.4, 0.6, 0.6];
const USUAL: Theta = [0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0];

/// The threads of a cloth, learned from a sample of its texels.
#[derive(Clone, Debug)]
pub struct Prior {
    pub(super) clusters: Vec<Cluster>,
    pub(super) profile: Profile,
    /// Standard deviations of readings as they were found: a part of them, and what black ones have.
    pub(super) noise: [f32; 2],
    /// How common texels without a highlight are in each cluster, as a logarithm of odds; empty where that was not asked.
    pub(super) grounds: Vec<f32>,
}

impl Prior {
    pub(super) fn profile(&self) -> Profile {
        self.profile
    }

    /// The options with the noise that was found.
    pub(super) fn noise(&self, options: &Options) -> Options {
        let [noise, floor] = self.noise;
        Options { noise, floor, ..*options }
    }

    /// Standard deviation of the readings as it was found: a part of them, and what black ones have, as a reflectance.
    pub fn found_noise(&self) -> [f32; 2] {
        self.noise
    }

    pub(super) fn nearest(&self, features: &Features) -> Option<usize> {
        let far = |c: &Cluster| distance(&c.centre, features);
        (0..self.clusters.len()).min_by(|&a, &b| far(&self.clusters[a]).total_cmp(&far(&self.clusters[b])))
    }

    /// How common texels without a highlight are in a cluster: a logarithm of odds.
    pub(super) fn ground(&self, cluster: usize) -> f32 {
        self.grounds.get(cluster).copied().unwrap_or(0.0)
    }

    /// The most of these.
    pub(super) fn most_odds(&self) -> f32 {
        self.grounds.iter().copied().reduce(f32::max).unwrap_or(0.0)
    }

    /// m, p and q of a cluster's mean.
    pub(super) fn shape(&self, cluster: usize) -> [f32; 3] {
        let mean = &self.clusters[cluster].mean;
        [mean[4], mean[5], mean[6]].map(|v| v as f32)
    }
}

/// What is known of eight texels before they are fitted.
pub(super) fn known(prior: Option<&Prior>, cluster: &[Option<usize>; LANES]) -> GaussianPrior {
    let mut known = GaussianPrior { mean: USUAL.map(F::splat), precision: [[F::ZERO; N]; N] };
    for (i, row) in known.precision.iter_mut().enumerate() {
        row[i] = F::splat(VAGUE[i]);
    }
    for (lane, cluster) in cluster.iter().enumerate() {
        let Some(cluster) = cluster.and_then(|c| prior.map(|p| &p.clusters[c])) else { continue };
        for i in 0..N {
            known.mean[i].0[lane] = cluster.mean[i] as f32;
            for j in 0..N {
                known.precision[i][j].0[lane] = cluster.precision[i][j] as f32;
            }
        }
    }
    known
}
