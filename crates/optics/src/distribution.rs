//! Choosing one of many by their weights: sums, and their inversion.

/// The largest `f32` below one.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// Writes what part of the sum of `weights` each and those before it have; returns the sum. Negative and non-finite
/// weights count as zero, all-zero ones as equal. Entries of `out` beyond the weights are never chosen.
pub fn accumulate(weights: impl Iterator<Item = f64> + Clone, out: &mut [f32]) -> f64 {
    let weights = weights.map(|w| if w.is_finite() { w.max(0.0) } else { 0.0 });
    let total: f64 = weights.clone().sum();
    let count = if total > 0.0 { 0 } else { weights.clone().count().min(out.len()) };
    let (mut sum, mut used) = (0.0, 0usize);
    for (out, w) in out.iter_mut().zip(weights) {
        sum += w;
        used += 1;
        *out = if total > 0.0 { (sum / total) as f32 } else { used as f32 / count as f32 };
    }
    // Also where rounding would leave a gap below one.
    out[used.saturating_sub(1)..].fill(1.0);
    total
}

/// The entry of an [`accumulate`]d list that `u` in [0, 1) falls into, never one without weight; `u` stretched back
/// to [0, 1) within it; and its probability.
#[inline]
pub fn choose(cumulative: &[f32], u: f32) -> (usize, f32, f32) {
    let i = cumulative.partition_point(|&c| c <= u).min(cumulative.len() - 1);
    let below = if i > 0 { cumulative[i - 1] } else { 0.0 };
    let p = cumulative[i] - below;
    (i, ((u - below) / p.max(f32::MIN_POSITIVE)).clamp(0.0, ONE_MINUS_EPSILON), p)
}

/// The probability that [`choose`] finds entry `i`.
#[inline]
pub fn probability(cumulative: &[f32], i: usize) -> f32 {
    cumulative[i] - if i > 0 { cumulative[i - 1] } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    #[test]
    fn entries_are_chosen_as_often_as_they_weigh() {
        let weights = [0.0, 1.0, 3.0, 0.0, 2.0, 2.0, 0.0];
        let mut cumulative = [0.5; 9];
        assert_eq!(accumulate(weights.into_iter(), &mut cumulative), 8.0);
        let mut rng = Pcg32::new(1, 1);
        let (mut seen, mut places) = ([0.0; 9], [0.0; 9]);
        let n = 100_000;
        for _ in 0..n {
            let (i, rest, p) = choose(&cumulative, rng.next_f32());
            assert!(p == probability(&cumulative, i) && (0.0..1.0).contains(&rest));
            seen[i] += 1.0 / n as f32;
            places[i] += rest / n as f32;
        }
        for i in 0..9 {
            let p = weights.get(i).map_or(0.0, |w| *w as f32 / 8.0);
            assert!((probability(&cumulative, i) - p).abs() < 1e-6);
            // Four standard deviations of 100 000 choices.
            assert!(
                (seen[i] - p).abs() < 0.006 && (places[i] - 0.5 * p).abs() < 0.004,
                "{seen:?} {places:?}"
            );
        }
    }

    #[test]
    fn nothing_without_weight_is_chosen_even_at_the_ends() {
        // So many that single precision rounds, between two without weight.
        let weights = (0..1001).map(|i| if i % 1000 == 0 { 0.0 } else { 1.0 / f64::from(i) });
        let mut cumulative = vec![0.0; 1001];
        accumulate(weights, &mut cumulative);
        assert_eq!(choose(&cumulative, 0.0).0, 1);
        assert_eq!(choose(&cumulative, ONE_MINUS_EPSILON).0, 999);
        assert!(choose(&cumulative, 1.0).1 < 1.0);
    }

    #[test]
    fn weights_that_say_nothing_count_as_equal() {
        let mut cumulative = [0.0; 4];
        assert_eq!(accumulate([0.0, f64::NAN, -1.0, f64::INFINITY].into_iter(), &mut cumulative), 0.0);
        assert_eq!(cumulative, [0.25, 0.5, 0.75, 1.0]);
        assert_eq!(accumulate([f64::NAN, 2.0, -1.0, 2.0].into_iter(), &mut cumulative), 4.0);
        assert_eq!(cumulative, [0.0, 0.5, 0.5, 1.0]);
    }
}
