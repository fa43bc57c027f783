//! How highlights fall off, learned from many texels.

use super::model::{N, Natural, predict};
use super::profile::{OWN, Profile, TERMS, gaussians};
use super::rays::Rays;
use crate::lanes::F;

/// What a profile is learned from: the ground as it was found, the Gaussians under the amplitude that was found, and what
/// all readings lack alike.
pub(super) const COLUMNS: usize = TERMS + 2;

/// Of numbers that were cut instead of rounded, or an ambient picture that was too bright: else tails would answer for it.
const LACK: usize = TERMS + 1;

/// Products of these columns and the value with each other, the lower half row by row.
pub(super) type Products = [f32; (COLUMNS + 1) * (COLUMNS + 2) / 2];

/// Of each texel, its readings weighted.
pub(super) fn products<R: Rays>(
    rays: R,
    value: &[F],
    weight: &[F],
    theta: &[F; N],
) -> [F; (COLUMNS + 1) * (COLUMNS + 2) / 2] {
    let n = Natural::of(theta, &Profile::GAUSSIAN);
    let mut out = [F::ZERO; (COLUMNS + 1) * (COLUMNS + 2) / 2];
    for (i, (value, weight)) in value.iter().zip(weight).enumerate() {
        let seen = predict(&n, rays.at(i));
        let cos = seen.cos * *weight;
        let shine = cos * n.amplitude * seen.jacobian;
        let mut row = [cos * n.d; COLUMNS + 1];
        row[LACK] = -*weight;
        for (to, e) in row[1..].iter_mut().zip(gaussians(seen.u)) {
            *to = shine * e;
        }
        row[COLUMNS] = *value * *weight;
        let mut at = 0;
        for a in 0..=COLUMNS {
            for b in 0..=a {
                out[at] += row[a] * row[b];
                at += 1;
            }
        }
    }
    out
}

/// Tails are believed when they leave less than this part of χ². Where there are none they save a ten thousandth.
const TAILS: f64 = 0.95;

/// And when Ward leaves more than this for each reading: readings without noise are described so well that what remains
/// says nothing.
const EXACT: f64 = 1e-3;

/// The profile that most of what is sure of itself agrees on: of texels their confidence, how many readings they have, and
/// the products.
pub(super) fn of_texels(texels: &[(f32, u16, &Products)]) -> Profile {
    let mut h = [[0.0; COLUMNS + 1]; COLUMNS + 1];
    let mut readings = 0.0;
    for (confidence, count, products) in texels {
        let weight = f64::from(*confidence);
        readings += weight * f64::from(*count);
        let mut at = 0;
        for a in 0..=COLUMNS {
            for b in 0..=a {
                h[a][b] += weight * f64::from(products[at]);
                h[b][a] = h[a][b];
                at += 1;
            }
        }
    }
    let (_, at_ward) = non_negative(&h, |c| [0, OWN + 1, LACK].contains(&c));
    let (found, at_found) = non_negative(&h, |_| true);
    let total: f64 = found[1..LACK].iter().sum();
    if total <= 0.0 || at_found > TAILS * at_ward || at_ward < EXACT * readings {
        return Profile::GAUSSIAN;
    }
    Profile::of(std::array::from_fn::<f32, TERMS, _>(|i| (found[i + 1] / total) as f32))
}

/// Non-negative least squares by coordinate descent over the columns that are let in: coefficients, and the squares
/// that remain. The last column is the right hand side.
fn non_negative(
    h: &[[f64; COLUMNS + 1]; COLUMNS + 1],
    with: impl Fn(usize) -> bool,
) -> ([f64; COLUMNS], f64) {
    let mut x = [0.0; COLUMNS];
    for _ in 0..2000 {
        for c in (0..COLUMNS).filter(|c| with(*c) && h[*c][*c] > 0.0) {
            let others: f64 = (0..COLUMNS).filter(|o| *o != c).map(|o| h[c][o] * x[o]).sum();
            x[c] = ((h[c][COLUMNS] - others) / h[c][c]).max(0.0);
        }
    }
    let quadratic: f64 = (0..COLUMNS).map(|a| (0..COLUMNS).map(|b| x[a] * h[a][b] * x[b]).sum::<f64>()).sum();
    let mixed: f64 = (0..COLUMNS).map(|c| x[c] * h[c][COLUMNS]).sum();
    (x, h[COLUMNS][COLUMNS] - 2.0 * mixed + quadratic)
}
