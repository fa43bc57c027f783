//! How far maps are from the truth.

use glam::Vec3;
use yugen_reflectance::btf::Texel;

/// What [`errors`] are of, in its order.
pub const NAMES: [&str; 6] = ["rho_d", "rho_s", "n", "t", "sigma_x", "sigma_y"];

/// Which of them is the normal's.
pub const NORMAL: usize = 2;

/// Which of them are degrees; the others are parts of the truth.
pub const IN_DEGREES: [bool; 6] = [false, false, true, true, false, false];

/// The heading over [`row`]s.
pub const HEADING: &str = "     rho_d      rho_s         n         t    sigma_x    sigma_y";

/// [`errors`] or quantiles of them to read, each by itself.
pub fn numbers(e: &[f32; 6]) -> [String; 6] {
    std::array::from_fn(|i| match IN_DEGREES[i] {
        true => format!("{:.3}°", e[i]),
        false => format!("{:.2} %", 100.0 * e[i]),
    })
}

/// The same in columns below [`HEADING`].
pub fn row(e: &[f32; 6]) -> String {
    let widths = [10, 10, 9, 9, 10, 10];
    numbers(e).iter().zip(widths).map(|(n, w)| format!("{n:>w$}")).collect::<Vec<_>>().join(" ")
}

/// Degrees between two unit vectors. The cosine is blind below a fortieth of a degree in f32; the sine is not.
pub fn angle(a: Vec3, b: Vec3) -> f32 {
    let acute = a.cross(b).length().min(1.0).asin().to_degrees();
    if a.dot(b) < 0.0 { 180.0 - acute } else { acute }
}

/// Errors of a texel: of the albedos (sums of channels) and widths relative, of the directions in degrees. The tangent of
/// the truth is taken along its longer width, as a fit gives it; an albedo below a tenth of both together counts as that,
/// for a metal has no ground to be relative to.
pub fn errors(got: &Texel, want: &Texel) -> [f32; 6] {
    let least = 0.1 * (want.diffuse + want.specular).element_sum().max(0.01);
    let relative = |a: f32, b: f32| (a - b).abs() / b.max(least);
    let width = |a: f32, b: f32| (a / b - 1.0).abs();
    let along = if want.sigma.x >= want.sigma.y { want.tangent } else { want.normal.cross(want.tangent) };
    let line = |a: Vec3, b: Vec3| angle(a, b).min(angle(a, -b));
    [
        relative(got.diffuse.element_sum(), want.diffuse.element_sum()),
        relative(got.specular.element_sum(), want.specular.element_sum()),
        angle(got.normal, want.normal),
        line(got.tangent, along),
        width(got.sigma.max_element(), want.sigma.max_element()),
        width(got.sigma.min_element(), want.sigma.min_element()),
    ]
}

/// Whether errors are those of a texel that was not found: the normal off by 3°, the tangent by 10° or a width by a
/// quarter.
pub fn failed(e: &[f32; 6]) -> bool {
    e[2] > 3.0 || e[3] > 10.0 || e[4] > 0.25 || e[5] > 0.25
}

/// Confidences are put together in so many steps.
const STEPS: usize = 10;
/// Below this confidence a texel is undecided.
pub const UNDECIDED: f32 = 0.1;
/// Above this it should be right.
pub const SURE: f32 = 0.5;
/// A normal is wrong that is off by more degrees than this.
pub const WRONG: f32 = 5.0;

/// How far normals were off that had about the same confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Mean confidence.
    pub confidence: f32,
    /// Texels.
    pub texels: usize,
    /// Mean degrees.
    pub mean: f32,
    /// Nine in ten are off by no more than so many degrees.
    pub ninety: f32,
    /// Part of the texels that are off by more than [`WRONG`].
    pub wrong: f32,
}

/// What a confidence is worth: from pairs of confidence (0 to 1) and degrees by which the normal was off. Steps without
/// texels are left out.
pub fn calibration(texels: &[(f32, f32)]) -> Vec<Step> {
    let mut steps: [(f64, Vec<f32>); STEPS] = Default::default();
    for (confidence, off) in texels {
        let step = &mut steps[((confidence * STEPS as f32) as usize).min(STEPS - 1)];
        step.0 += f64::from(*confidence);
        step.1.push(*off);
    }
    let filled = steps.into_iter().filter(|s| !s.1.is_empty());
    filled
        .map(|(confidence, mut off)| {
            let n = off.len();
            let mean = off.iter().map(|o| f64::from(*o)).sum::<f64>() / n as f64;
            Step {
                confidence: (confidence / n as f64) as f32,
                texels: n,
                mean: mean as f32,
                wrong: off.iter().filter(|o| **o > WRONG).count() as f32 / n as f32,
                ninety: quantile(&mut off, 0.9).unwrap_or(0.0),
            }
        })
        .collect()
}

/// How far normals were off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalErrors {
    /// Texels that were compared.
    pub texels: usize,
    /// Mean degrees.
    pub mean: f64,
    /// Half are off by no more.
    pub median: f32,
    /// Nine in ten are off by no more.
    pub ninety: f32,
    /// Texels with a confidence above [`SURE`].
    pub sure: usize,
    /// Their mean degrees.
    pub sure_mean: f64,
    /// How many of them are off by more than [`WRONG`].
    pub sure_and_wrong: usize,
}

impl NormalErrors {
    /// Of pairs of confidence (0 to 1) and degrees by which the normal was off; `None` without any.
    pub fn of(texels: &[(f32, f32)]) -> Option<Self> {
        let mean = |off: &[f32]| off.iter().map(|o| f64::from(*o)).sum::<f64>() / off.len().max(1) as f64;
        let mut all: Vec<f32> = texels.iter().map(|t| t.1).collect();
        let sure: Vec<f32> = texels.iter().filter(|t| t.0 > SURE).map(|t| t.1).collect();
        Some(Self {
            texels: all.len(),
            mean: mean(&all),
            median: quantile(&mut all, 0.5)?,
            ninety: quantile(&mut all, 0.9)?,
            sure: sure.len(),
            sure_mean: mean(&sure),
            sure_and_wrong: sure.iter().filter(|o| **o > WRONG).count(),
        })
    }
}

/// The value below which a part `q` of `all` lies, `None` without any. Sorts them.
pub fn quantile(all: &mut [f32], q: f32) -> Option<f32> {
    all.sort_unstable_by(f32::total_cmp);
    all.get((all.len().max(1) - 1).min(((all.len().max(1) - 1) as f32 * q).round() as usize)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_normals_are_counted() {
        let all = [(0.9, 1.0), (0.9, 7.0), (0.5, 30.0), (0.2, 2.0)];
        let found = NormalErrors::of(&all).unwrap();
        assert_eq!((found.texels, found.mean, found.ninety), (4, 10.0, 30.0));
        assert_eq!((found.sure, found.sure_mean, found.sure_and_wrong), (2, 4.0, 1));
        assert_eq!(NormalErrors::of(&[]), None);
        assert_eq!(numbers(&[0.5; 6])[..3], ["50.00 %", "50.00 %", "0.500°"]);
    }

    #[test]
    fn confidences_are_put_beside_what_came_of_them() {
        let texels: Vec<(f32, f32)> = (0..100)
            .map(|i| if i < 80 { (0.95, 1.0) } else { (0.21, if i < 90 { 2.0 } else { 8.0 }) })
            .collect();
        let steps = calibration(&texels);
        assert_eq!(steps.len(), 2);
        let [unsure, sure] = [&steps[0], &steps[1]];
        assert_eq!((unsure.texels, unsure.mean, unsure.wrong, unsure.ninety), (20, 5.0, 0.5, 8.0));
        assert_eq!((sure.texels, sure.mean, sure.wrong), (80, 1.0, 0.0));
        assert!((sure.confidence - 0.95).abs() < 1e-6);
        // The ends belong to the first and the last.
        assert_eq!(calibration(&[(0.0, 1.0), (1.0, 1.0)]).len(), 2);
    }
}
