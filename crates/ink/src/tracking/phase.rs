//! Where along the marks of the brush a stroke is, and how much of it is there, from what its samples inherit.

use super::FADE;
use crate::piece::Piece;
use crate::visibility::Sample;

/// Standard deviation along a stroke over which phases are made smooth, pixels of a picture of 1080 lines.
const SMOOTH: f32 = 40.0;
/// Most that phase may run ahead of or behind arc length: marks of the brush may be stretched by half.
const STRETCH: f32 = 0.5;
/// Part of the way by which stretched marks relax in a frame, and the most pixels of a picture of 1080 lines that this may be:
/// a quarter of the slip that is allowed.
const RELAX: f32 = 0.02;
/// See [`RELAX`].
const RELAX_MOST: f32 = 0.25;
/// Length over which what comes in new at the end of a stroke is as present as the stroke, pixels of a picture of 1080 lines.
const GROWTH: f32 = 48.0;

/// Phase at each arc length, smooth and near what was voted for, and how far each vote is from it. `around`: of a closed
/// stroke, the phase after which it begins again.
pub fn phases(s: &[f32], votes: &[Option<f32>], around: Option<f32>, unit: f32) -> (Vec<f32>, Vec<f32>) {
    let mut votes: Vec<(f32, f32)> =
        s.iter().zip(votes).filter_map(|(s, v)| Some((*s, (*v)? - s))).filter(|v| v.1.is_finite()).collect();
    if votes.is_empty() {
        return (s.to_vec(), Vec::new());
    }
    let mut sorted: Vec<f32> = votes.iter().map(|v| v.1).collect();
    sorted.sort_by(f32::total_cmp);
    let median = sorted[sorted.len() / 2];
    if let Some(around) = around.filter(|a| *a > 1.0) {
        votes.iter_mut().for_each(|v| v.1 -= around * ((v.1 - median) / around).round());
    }
    let sigma = SMOOTH * unit.max(0.3);
    let mean = votes.iter().map(|v| v.1).sum::<f32>() / votes.len() as f32;
    let (mut from, mut to) = (0, 0);
    let mut offsets: Vec<f32> = s
        .iter()
        .map(|at| {
            while from < votes.len() && votes[from].0 < at - 2.5 * sigma {
                from += 1;
            }
            while to < votes.len() && votes[to].0 <= at + 2.5 * sigma {
                to += 1;
            }
            let (mut sum, mut weights) = (0.0f64, 0.0f64);
            // At the ends of a stroke it is smoothed over what lies on both sides alike, so that it does not shrink.
            for (place, offset) in &votes[from.min(to)..to] {
                let weight = f64::from((-0.5 * ((place - at) / sigma).powi(2)).exp());
                sum += weight * f64::from(*offset);
                weights += weight;
            }
            if weights > 1e-6 { (sum / weights) as f32 } else { f32::NAN }
        })
        .collect();
    // Where nobody has voted: as the nearest.
    for i in 1..offsets.len() {
        if offsets[i].is_nan() {
            offsets[i] = offsets[i - 1];
        }
    }
    for i in (1..offsets.len()).rev() {
        if offsets[i - 1].is_nan() {
            offsets[i - 1] = offsets[i];
        }
    }
    let most = RELAX_MOST * unit;
    offsets.iter_mut().for_each(|o| *o += (RELAX * (mean - *o)).clamp(-most, most));
    // From the place that is nearest to the middle, so that an outlier does not carry the rest away.
    let middle = (0..offsets.len())
        .min_by(|a, b| (offsets[*a] - median).abs().total_cmp(&(offsets[*b] - median).abs()))
        .unwrap_or(0);
    for i in middle + 1..offsets.len() {
        let most = STRETCH * (s[i] - s[i - 1]);
        offsets[i] = offsets[i].clamp(offsets[i - 1] - most, offsets[i - 1] + most);
    }
    for i in (0..middle).rev() {
        let most = STRETCH * (s[i + 1] - s[i]);
        offsets[i] = offsets[i].clamp(offsets[i + 1] - most, offsets[i + 1] + most);
    }
    let phase: Vec<f32> = s.iter().zip(&offsets).map(|(s, o)| s + o).collect();
    let (mut i, mut slips) = (0, Vec::new());
    for (at, offset) in votes {
        while s[i] < at {
            i += 1;
        }
        slips.push((offsets[i] - offset).abs());
    }
    (phase, slips)
}

/// How much of each sample is there: more than before by a step; of what is new as much as of its neighbours that are not.
pub fn presence(piece: &Piece, s: &[f32], unit: f32) -> Vec<f32> {
    let before = |s: &Sample| s.trace.map_or(0.0, |t| t.presence);
    let mut presence: Vec<f32> = piece.samples.iter().map(|s| (before(s) + 1.0 / FADE).min(1.0)).collect();
    let growth = GROWTH * unit.max(0.3);
    for i in 1..presence.len() {
        presence[i] = presence[i].max(presence[i - 1] - (s[i] - s[i - 1]) / growth);
    }
    for i in (1..presence.len()).rev() {
        presence[i - 1] = presence[i - 1].max(presence[i] - (s[i] - s[i - 1]) / growth);
    }
    presence
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_follow_votes_and_stay_smooth() {
        let s: Vec<f32> = (0..200).map(|i| 2.0 * i as f32).collect();
        let (phase, slip) = phases(&s, &vec![None; 200], None, 1.0);
        assert_eq!((phase, slip.len()), (s.clone(), 0));
        // Moved along by three pixels, with an outlier and an end about which nobody knows.
        let mut votes: Vec<Option<f32>> = s.iter().map(|s| Some(s + 3.0)).collect();
        votes[60] = Some(700.0);
        votes[150..].fill(None);
        let (phase, slip) = phases(&s, &votes, None, 1.0);
        assert!(phase.windows(2).all(|w| w[1] > w[0]));
        let off = |i: usize| (phase[i] - s[i] - 3.0).abs();
        assert!(off(0) < 0.1 && off(199) < 0.5, "{} {}", off(0), off(199));
        let mut sorted = slip;
        sorted.sort_by(f32::total_cmp);
        assert!(sorted[100] < 10.0);
        // Around a closed stroke.
        let votes: Vec<Option<f32>> = s.iter().map(|s| Some((s + 3.0) % 400.0)).collect();
        let (phase, slip) = phases(&s, &votes, Some(400.0), 1.0);
        assert!(slip.iter().all(|s| *s < 0.1), "{slip:?}");
        assert!((phase[199] - 401.0).abs() < 0.1);
    }
}
