//! What a texel looks like before any fit.

use super::rays::Ray;

/// What a texel looks like, in units in which a difference of one is a different thread.
pub(super) type Features = [f32; 7];

/// A ground as dark as this is black, whatever hue its noise has: else one metal would look like many.
const BLACK: f32 = 0.002;

/// The look of a texel: how bright its ground is, the hues of its darker and brighter readings, and which way half
/// vectors shine.
pub(super) fn of(
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
