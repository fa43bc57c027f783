//! What the readings can decide.

use super::model::N;
use super::prior::VAGUE;
use super::refine::{factor, solve};
use crate::lanes::F;

/// From 0 to 1: the least of what the readings say about normal, width, direction and brightness of the highlight, and
/// how well the model describes them.
pub(super) fn confidence(information: &[[f32; N]; N], widest: f32, residual: f32) -> f32 {
    // The prior is no evidence; as much of it as keeps the matrix sound.
    let mut h = information.map(|row| row.map(F::splat));
    for (i, row) in h.iter_mut().enumerate() {
        row[i] += F::splat(VAGUE[i] + 1e-6);
    }
    let l = factor(&h);
    let deviation = |i: usize| {
        let mut unit = [F::ZERO; N];
        unit[i] = F::ONE;
        solve(&l, unit)[i].0[0].max(0.0).sqrt()
    };
    // Deviations at which confidence has halved: a fifth of the brightness, 3° of the normal, a tenth of the widths, and
    // of the difference of their logarithms (which for a lobe twice as long as wide is 8° of the tangent).
    let doubts = [(1, 0.2), (2, 0.05), (3, 0.05), (4, 0.2), (5, 0.2), (6, 0.2)];
    let doubt = doubts.iter().map(|&(i, half)| (deviation(i) / half).powi(2)).fold(0.0, f32::max);
    // Half vectors end at 45°, slope 1: wider than 0.8 is extrapolation.
    let seen = ((1.0 - widest) / 0.2).clamp(0.0, 1.0);
    let described = 1.0 / (1.0 + (residual / 10.0).powi(2));
    seen * described / (1.0 + doubt)
}
