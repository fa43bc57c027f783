//! How noisy the readings are.

use super::fitted::Options;
use super::model::{N, model};
use super::profile::Profile;
use super::rays::Rays;
use super::scratch::Scratch;
use super::start::solve;
use crate::lanes::{F, LANES};
use crate::readings::Readings;

/// Residuals of readings by how bright they are: how large in sum, and how many.
pub(super) type Tally = [[f32; 2]; BINS];

/// Each is twice as bright as the one before.
const BINS: usize = 18;
/// Where the first begins.
const DARKEST: f32 = 1.0 / 16384.0;
/// Less noise than that of the numbers in a file of 16-bit floats is not believed.
const LEAST_NOISE: [f32; 2] = [5e-4, 2e-5];

/// Residuals of eight texels, without those that the robust loss takes for something else than noise.
pub(super) fn tally<R: Rays>(
    rays: R,
    scratch: &Scratch,
    theta: &[F; N],
    profile: &Profile,
) -> [Tally; LANES] {
    let mut seen = vec![F::ZERO; scratch.value.len()];
    model(rays, theta, profile, &mut seen);
    std::array::from_fn(|lane| {
        let mut tally = Tally::default();
        for (i, seen) in seen.iter().enumerate() {
            let [seen, value, weight, counted] =
                [seen, &scratch.value[i], &scratch.weight[i], &scratch.counted[i]].map(|v| v.0[lane]);
            if weight > 0.0 && counted > 0.7 * weight {
                let bin = ((seen / DARKEST).max(1.0).log2() as usize).min(BINS - 1);
                tally[bin] = [tally[bin][0] + (seen - value).abs(), tally[bin][1] + 1.0];
            }
        }
        tally
    })
}

/// The step between the dark values that pictures of whole numbers have; next to nothing for others.
pub(super) fn quantum(bands: &[impl Readings]) -> f32 {
    const DARK: f32 = 0.1;
    let all = bands.iter().flat_map(|b| (0..b.texels()).flat_map(|t| b.values(t))).map(|v| v[0]);
    let mut dark: Vec<f32> = all.filter(|v| *v > 0.0 && *v < DARK).take(1 << 20).collect();
    dark.sort_unstable_by(f32::total_cmp);
    // Closer ones are the same whole number, computed in another way.
    let gaps = dark.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > 1e-6);
    gaps.fold(DARK, f32::min)
}

/// The noise, as a part of the reading and of black, that makes the residuals what they are.
pub(super) fn of_texels(texels: &[(u16, &Tally)], options: &Options, quantum: f32, tails: bool) -> [f32; 2] {
    let mut h = [[0.0; 2]; 2];
    let mut g = [0.0; 2];
    for bin in 0..BINS {
        let (mut sum, mut count, mut freedom) = (0.0, 0.0, 0.0);
        for (readings, tally) in texels {
            let [s, c] = tally[bin].map(f64::from);
            let n = f64::from(*readings);
            sum += s;
            count += c;
            freedom += c * (1.0 - N as f64 / n).max(0.1);
        }
        if count < 50.0 {
            continue;
        }
        // √(π/2) times the mean of |z| is the deviation of a normal deviate; a fit takes some of it up.
        let deviation: f64 = (std::f64::consts::FRAC_PI_2 / (count * freedom)).sqrt() * sum;
        let level = if bin == 0 { 0.0 } else { f64::from(DARKEST) * 1.44 * (bin as f64).exp2() };
        let w = count / (deviation * deviation + 1e-12);
        let row = [level, 1.0];
        for a in 0..2 {
            g[a] += w * row[a] * deviation;
            for b in 0..2 {
                h[a][b] += w * row[a] * row[b];
            }
        }
    }
    if h[1][1] <= 0.0 {
        return [options.noise, options.floor];
    }
    // What the readings are rounded to is noise as well, which does not show where all of them are black: a step over
    // √12, the same in all channels of what is grey.
    let least = f64::from(LEAST_NOISE[1].max(quantum / 12f32.sqrt()));
    let black = solve(h, g).map_or(0.0, |s| s[1]).max(least);
    let part = (g[0] - h[0][1] * black) / h[0][0];
    // What many readings of tails agree in is still the model's and not the material's.
    [(part as f32).max(if tails { options.noise } else { LEAST_NOISE[0] }), black as f32]
}
