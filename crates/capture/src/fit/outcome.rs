//! What a fit leaves of a texel: its numbers, and what a prior is learned from.

use super::features::Features;
use super::fitted::{Fitted, NOTHING};
use super::model::{N, Theta};
use super::noise::Tally;
use super::tails::Products;

/// A texel's fit.
#[derive(Clone)]
pub(super) struct Outcome {
    pub fitted: Fitted,
    pub theta: Theta,
    pub features: Features,
    /// By how much better its ground by itself describes it, see [`Ground::margin`](super::choice::Ground::margin).
    pub margin: f32,
    /// Whether another start might lead elsewhere: the readings are described badly, or do not decide.
    pub doubtful: bool,
    /// Where a prior is to be learned, and there were enough readings.
    pub evidence: Option<Box<Evidence>>,
}

impl Outcome {
    pub const NONE: Self = Self {
        fitted: NOTHING,
        theta: [0.0; N],
        features: [0.0; 7],
        margin: 0.0,
        doubtful: false,
        evidence: None,
    };
}

/// What the prior is learned from.
#[derive(Clone)]
pub(super) struct Evidence {
    /// Curvature of ½χ² of the readings alone, in units of the noise that was found.
    pub information: [[f32; N]; N],
    /// Half the gradient, in the same units: what the prior had to hold against.
    pub slope: Theta,
    /// What the profile of its highlight is learned from.
    pub products: Products,
    /// What the noise of the readings is learned from.
    pub noise: Tally,
}
