//! A denoiser for pictures of a renderer, guided by what is seen and by how noisy each pixel is.
//!
//! After Bitterli, Rousselle, Moon, Iglesias-Guitián, Adler, Mitchell, Jarosz and Novák 2016, "Nonlinearly Weighted
//! First-order Regression for Denoising Monte Carlo Renderings": at every pixel radiance is taken for a linear
//! function of albedo, normal, distance and coverage, fitted to the pixels around. Those whose own surroundings look
//! alike, as far as their noise lets one tell, weigh most (non-local means with variances: Rousselle, Knaus and
//! Zwicker 2012). The samples come in two halves that know nothing of each other ([`Halves`]): the weights of one serve the
//! other, and what one makes of a pixel is judged by the other, which chooses between several widths and leaves the pixel as
//! it is where that is better.

mod fit;
mod halves;
mod pixel_filter;

use crate::Image;
use crate::parallel::parallel;
use fit::{BORDER, Feature, Inputs, Plane, Side, WIDTHS, fits};
pub use halves::{ALBEDO, DEPTH, Halves, NORMAL, SURFACE, VALUES, both_halves, half};
pub use pixel_filter::PixelFilter;

/// Darkest albedo that radiance is divided by.
const DARK: f32 = 0.05;
/// How much more fine detail there is than along a straight edge: surfaces are thin and have corners.
const FINE: f32 = 4.0;
/// Part of a pixel's brightness that differences are not told from noise, whatever a few samples say.
const FAINT: f32 = 0.03;
/// How much more than is usual around the two halves of a pixel have to differ to be believed.
const UNUSUAL: f32 = 6.0;

/// A denoised picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Denoised {
    /// Radiance, plane after plane.
    pub rgb: [Vec<f32>; 3],
    /// Estimate of its standard error.
    pub error: [Vec<f32>; 3],
}

impl Denoised {
    /// In the place of `image`, whose first channels are R, G and B: these are kept as `noisy.R`, `noisy.G` and `noisy.B`;
    /// `error.R`, `error.G` and `error.B` are the estimate of the standard error. Everything else is as it was.
    pub fn in_place_of(&self, image: &Image) -> Image {
        let n = image.channels.len();
        let layers = ["noisy.R", "noisy.G", "noisy.B", "error.R", "error.G", "error.B"].map(String::from);
        let mut out = Image {
            width: image.width,
            height: image.height,
            channels: image.channels.iter().cloned().chain(layers).collect(),
            data: Vec::with_capacity(image.width * image.height * (n + 6)),
        };
        for (i, pixel) in image.data.chunks_exact(n).enumerate() {
            out.data.extend(self.rgb.iter().map(|plane| plane[i]));
            out.data.extend_from_slice(&pixel[3..]);
            out.data.extend_from_slice(&pixel[..3]);
            out.data.extend(self.error.iter().map(|plane| plane[i]));
        }
        out
    }
}

/// Mean of the (2 `reach` + 1)² pixels around each.
fn blur(plane: &[f32], width: usize, height: usize, reach: usize) -> Vec<f32> {
    let mut across = vec![0.0; plane.len()];
    let whole = 2 * reach + 1;
    for (to, from) in across.chunks_exact_mut(width).zip(plane.chunks_exact(width)) {
        // Where all of the window lies within the row one pixel of it after the other, for all pixels at once.
        let inside = reach..width.saturating_sub(reach).max(reach);
        if !inside.is_empty() {
            for k in 0..whole {
                to[inside.clone()].iter_mut().zip(&from[k..]).for_each(|(to, v)| *to += v);
            }
        }
        for (x, to) in to.iter_mut().enumerate() {
            if inside.contains(&x) {
                *to /= whole as f32;
                continue;
            }
            let part = &from[x.saturating_sub(reach)..(x + reach + 1).min(width)];
            *to = part.iter().sum::<f32>() / part.len() as f32;
        }
    }
    let mut out = vec![0.0; plane.len()];
    for (y, to) in out.chunks_exact_mut(width).enumerate() {
        let (from, end) = (y.saturating_sub(reach), (y + reach + 1).min(height));
        for row in from..end {
            for (to, from) in to.iter_mut().zip(&across[row * width..]) {
                *to += from;
            }
        }
        let share = 1.0 / (end - from) as f32;
        to.iter_mut().for_each(|v| *v *= share);
    }
    out
}

/// `f` of the pixels of two planes.
fn zip(a: &[f32], b: &[f32], f: impl Fn(f32, f32) -> f32) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()
}

/// Denoises what `halves` say. `picture` is what the reconstruction filter makes of the same samples, and `filter` how it goes
/// about it: R, G, B, plane after plane. The same bits for any number of `threads`.
pub fn denoise(halves: &Halves, picture: &[Vec<f32>; 3], filter: &PixelFilter, threads: usize) -> Denoised {
    let (w, h) = (halves.width, halves.height);
    let pixels = w * h;
    let both = |i: usize| halves.count[0][i] > 0.0 && halves.count[1][i] > 0.0;
    if !(0..pixels).any(both) {
        // There is nothing to compare.
        let error = |plane: &Vec<f32>| plane.iter().map(|v| (filter.kept * v).sqrt()).collect();
        return Denoised { rgb: picture.clone(), error: halves.variance.each_ref().map(error) };
    }
    let [a, b] = &halves.mean;
    let part = zip(&halves.count[0], &halves.count[1], |a, b| if a + b > 0.0 { a / (a + b) } else { 0.5 });
    let mean = |c: usize| -> Vec<f32> {
        (0..pixels).map(|i| part[i] * a[c][i] + (1.0 - part[i]) * b[c][i]).collect()
    };
    // Radiance over albedo is smoother than radiance.
    let albedo: [Vec<f32>; 3] =
        std::array::from_fn(|c| mean(ALBEDO.start + c).into_iter().map(|albedo| albedo.max(DARK)).collect());
    // Where one half has no samples, it is given what the other has.
    let of_half = |half: usize| -> [Vec<f32>; 3] {
        std::array::from_fn(|c| {
            let of = |i: usize| {
                let from = if halves.count[half][i] > 0.0 { half } else { 1 - half };
                halves.mean[from][c][i] / albedo[c][i]
            };
            (0..pixels).map(of).collect()
        })
    };
    let light = parallel(threads, 2, of_half, &|_| {});
    // Samples are better spread than by chance: the difference of the halves knows by how much, the variance of
    // samples where.
    let told: [Vec<f32>; 3] =
        std::array::from_fn(|c| zip(&halves.variance[c], &albedo[c], |v, a| v / (a * a)));
    let seen: [Vec<f32>; 3] = std::array::from_fn(|c| {
        (0..pixels).map(|i| (light[0][c][i] - light[1][c][i]).powi(2) * part[i] * (1.0 - part[i])).collect()
    });
    let sum = |planes: &[Vec<f32>; 3]| -> Vec<f32> {
        (0..pixels).map(|i| planes[0][i] + planes[1][i] + planes[2][i]).collect()
    };
    let ratio = zip(&blur(&sum(&seen), w, h, 4), &blur(&sum(&told), w, h, 4), |seen, told| {
        (seen / told.max(1e-20)).clamp(0.02, 2.0)
    });
    // Not so where a rare bright path came to one half alone.
    let own = zip(&sum(&seen), &sum(&told), |seen, told| (seen / told.max(1e-20)).min(1.0));
    let ratio = zip(&ratio, &own, |around, own| if own > UNUSUAL * around { own } else { around });
    let variance: [Vec<f32>; 3] = std::array::from_fn(|c| zip(&told[c], &ratio, |v, r| v * r));
    let whole = sum(&variance);
    let own = |c: usize, i: usize| part[i] * light[0][c][i] + (1.0 - part[i]) * light[1][c][i];
    let side = |half: usize| {
        let variance = |i: usize| {
            let p = if half == 0 { part[i] } else { 1.0 - part[i] };
            let faint: f32 = (0..3).map(|c| (FAINT * own(c, i)).powi(2)).sum();
            whole[i] / p.max(0.01) + faint
        };
        Side {
            rgb: std::array::from_fn(|c| Plane::new(&light[half][c], w, h)),
            variance: Plane::new(&(0..pixels).map(variance).collect::<Vec<_>>(), w, h),
        }
    };
    let [depth, surface] = [DEPTH, SURFACE].map(mean);
    let farness = depth.iter().sum::<f32>() / surface.iter().sum::<f32>().max(1.0);
    let feature = |(value, floor): (usize, f32)| {
        let apart = |i: usize| (a[value][i] - b[value][i]).powi(2) * part[i] * (1.0 - part[i]);
        let noise = blur(&(0..pixels).map(apart).collect::<Vec<_>>(), w, h, 1);
        Feature { plane: Plane::new(&mean(value), w, h), noise: Plane::new(&noise, w, h), floor }
    };
    let floors = NORMAL.chain(ALBEDO).map(|i| (i, 0.005)).chain([(DEPTH, 1e-4 * farness), (SURFACE, 0.01)]);
    let met: Vec<bool> = (0..pixels).map(|i| halves.count[0][i] + halves.count[1][i] > 0.0).collect();
    let mut far = Plane::new(&vec![0.0; pixels], w, h);
    let pitch = far.pitch;
    for (at, far) in far.data.iter_mut().enumerate() {
        let (x, y) = ((at % pitch).wrapping_sub(BORDER), (at / pitch).wrapping_sub(BORDER));
        if x >= w || y >= h || !met[y * w + x] {
            *far = f32::INFINITY;
        }
    }
    let floors: Vec<_> = floors.collect();
    let features = parallel(threads, floors.len(), |i| feature(floors[i]), &|_| {});
    let sides = parallel(threads, 2, side, &|_| {});
    let fits = fits(&Inputs { width: w, height: h, sides, far, features }, threads);

    // All errors relative to how bright it is around.
    let bright: Vec<f32> = (0..pixels).map(|i| (0..3).map(|c| own(c, i)).sum()).collect();
    let dark = 0.01 * bright.iter().sum::<f32>() / pixels as f32;
    let scale: Vec<f32> =
        blur(&bright, w, h, 2).iter().map(|v| 1.0 / (v * v + dark * dark).max(1e-20)).collect();
    // Of a fit: its mean square error as the other half tells, and what of it is noise.
    let judge = |fit: &[[Vec<f32>; 3]; 2]| -> [Vec<f32>; 2] {
        let (mut error, mut noise) = (vec![0.0; pixels], vec![0.0; pixels]);
        for i in 0..pixels {
            let p = [part[i].max(0.01), (1.0 - part[i]).max(0.01)];
            for c in 0..3 {
                let d = fit[0][c][i] - fit[1][c][i];
                noise[i] += scale[i] * 0.25 * d * d;
                let across = |from: usize| {
                    let d = fit[from][c][i] - light[1 - from][c][i];
                    d * d - variance[c][i] / p[1 - from]
                };
                error[i] += scale[i] * 0.5 * (across(0) + across(1));
            }
            error[i] -= noise[i];
        }
        [blur(&error, w, h, 3), blur(&noise, w, h, 3)]
    };
    let judged = parallel(threads, fits.len(), |i| judge(&fits[i]), &|_| {});
    // Of each width the part that it has in a pixel: where it is best around.
    let mut parts: Vec<Vec<f32>> = vec![vec![0.0; pixels]; WIDTHS.len()];
    for i in 0..pixels {
        let best = |a: &usize, b: &usize| judged[*a][0][i].total_cmp(&judged[*b][0][i]);
        if let Some(best) = (0..WIDTHS.len()).min_by(best) {
            parts[best][i] = 1.0;
        }
    }
    let parts: Vec<Vec<f32>> = parts.iter().map(|part| blur(part, w, h, 2)).collect();
    let raw_noise = blur(&zip(&whole, &scale, |v, s| v * s), w, h, 3);
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; pixels]);
    let mut error: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; pixels]);
    let mut raw: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; pixels]);
    for i in 0..pixels {
        let mix = |of: &dyn Fn(usize) -> f32| (0..WIDTHS.len()).map(|k| parts[k][i] * of(k)).sum::<f32>();
        let noise = mix(&|k| judged[k][1][i]);
        let bias = (mix(&|k| judged[k][0][i]) - noise).max(0.0);
        // As much of the pixel itself as makes the sum of both errors least.
        let keep = if bias + raw_noise[i] > 0.0 { bias / (bias + raw_noise[i]) } else { 1.0 };
        let fit: [f32; 3] = std::array::from_fn(|c| mix(&|k| 0.5 * (fits[k][0][c][i] + fits[k][1][c][i])));
        // Errors around were seen relative to the brightness around, and are so here.
        let here = fit.iter().sum::<f32>().powi(2).min(1.0 / scale[i]) + dark * dark;
        let all = fit.iter().map(|v| v * v).sum::<f32>().max(1e-20);
        for c in 0..3 {
            let own = own(c, i);
            rgb[c][i] = albedo[c][i] * (fit[c] + keep * (own - fit[c]));
            raw[c][i] = albedo[c][i] * own;
            let of_fit = (noise + bias) * here * (fit[c] * fit[c] / all);
            let squared = (1.0 - keep) * (1.0 - keep) * of_fit + keep * keep * filter.kept * variance[c][i];
            error[c][i] = albedo[c][i] * squared.max(0.0).sqrt();
        }
    }
    // What the filter shows and pixels cannot, where it is more than noise: where in a pixel an edge is.
    let mut out: [Vec<f32>; 3] = std::array::from_fn(|_| Vec::new());
    let mut fine: [Vec<f32>; 3] =
        std::array::from_fn(|c| zip(&picture[c], &filter.apply(&raw[c], w, h), |p, f| p - f));
    if filter.leftover > 0.0 {
        // It is to be expected where the picture bends.
        let mut bent = vec![0.0f32; pixels];
        for plane in &rgb {
            for y in 0..h {
                for x in 0..w {
                    let at = |x: usize, y: usize| plane[y.min(h - 1) * w + x.min(w - 1)];
                    let own = 2.0 * at(x, y);
                    let across = at(x.saturating_sub(1), y) + at(x + 1, y) - own;
                    let down = at(x, y.saturating_sub(1)) + at(x, y + 1) - own;
                    bent[y * w + x] += across * across + down * down;
                }
            }
        }
        let expected: Vec<f32> = blur(&bent, w, h, 1).iter().map(|v| FINE * filter.fine * v).collect();
        let noise: Vec<f32> =
            (0..pixels).map(|i| (0..3).map(|c| variance[c][i] * albedo[c][i].powi(2)).sum()).collect();
        let noise = blur(&noise, w, h, 1);
        for i in 0..pixels {
            let share = expected[i] / (expected[i] + filter.leftover * noise[i]).max(1e-30);
            fine.iter_mut().for_each(|plane| plane[i] *= share);
        }
    }
    for c in 0..3 {
        out[c] = zip(&filter.apply(&rgb[c], w, h), &fine[c], |v, fine| v + fine);
        for i in (0..pixels).filter(|i| !met[*i]) {
            out[c][i] = picture[c][i];
        }
    }
    Denoised { rgb: out, error }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    const SIZE: usize = 48;

    /// Two halves of 8 samples with normal noise of this deviation each, around `truth`; albedo 1 and the first
    /// component of the normal as given, everything else alike.
    fn noisy(
        truth: impl Fn(usize, usize) -> f32,
        normal: impl Fn(usize, usize) -> f32,
        deviation: f32,
    ) -> Halves {
        let mut halves = Halves::new(SIZE, SIZE);
        let mut random = Pcg32::new(7, 1);
        for y in 0..SIZE {
            for x in 0..SIZE {
                let i = y * SIZE + x;
                for half in 0..2 {
                    halves.count[half][i] = 8.0;
                    for c in 0..3 {
                        halves.mean[half][c][i] =
                            truth(x, y) + deviation * 0.5f32.sqrt() * random.normal() / 2.0;
                        halves.mean[half][ALBEDO.start + c][i] = 1.0;
                    }
                    halves.mean[half][NORMAL.start][i] = normal(x, y);
                    halves.mean[half][DEPTH][i] = 1.0;
                    halves.mean[half][SURFACE][i] = 1.0;
                }
                for c in 0..3 {
                    halves.variance[c][i] = deviation * deviation / 16.0;
                }
            }
        }
        halves
    }

    fn raw(halves: &Halves) -> [Vec<f32>; 3] {
        std::array::from_fn(|c| {
            let sums = |half: usize| zip(&halves.mean[half][c], &halves.count[half], |v, n| v * n);
            let counts = zip(&halves.count[0], &halves.count[1], |a, b| (a + b).max(1.0));
            zip(&zip(&sums(0), &sums(1), |a, b| a + b), &counts, |sum, count| sum / count)
        })
    }

    fn clean(halves: &Halves, threads: usize) -> Denoised {
        denoise(halves, &raw(halves), &PixelFilter::new(0.5, |_| 1.0), threads)
    }

    fn squared_error(rgb: &[Vec<f32>; 3], truth: impl Fn(usize, usize) -> f32) -> f32 {
        let of = |(i, v): (usize, &f32)| (v - truth(i % SIZE, i / SIZE)).powi(2);
        rgb.iter().flat_map(|plane| plane.iter().enumerate().map(of)).sum::<f32>() / (3 * SIZE * SIZE) as f32
    }

    #[test]
    fn noise_around_a_constant_goes_and_its_rest_is_known() {
        let halves = noisy(|_, _| 1.0, |_, _| 0.0, 0.8);
        let before = squared_error(&raw(&halves), |_, _| 1.0);
        let out = clean(&halves, 2);
        let after = squared_error(&out.rgb, |_, _| 1.0);
        // 361 pixels of a window, most of them taken for alike.
        assert!(before > 60.0 * after, "{before} {after}");
        let claimed = out.error.iter().flatten().map(|e| e * e).sum::<f32>() / (3 * SIZE * SIZE) as f32;
        // What is left is mistaken for bias here and there: 4 times the square was measured.
        assert!((0.5..8.0).contains(&(claimed / after)), "{claimed} {after}");
    }

    #[test]
    fn the_same_bits_for_any_number_of_threads() {
        let halves = noisy(|x, _| x as f32 / 8.0, |_, y| y as f32, 0.5);
        assert_eq!(clean(&halves, 1), clean(&halves, 4));
    }

    #[test]
    fn an_edge_that_the_normal_knows_stays_sharp() {
        let side = |x: usize, _: usize| if x < SIZE / 2 { 0.0 } else { 1.0 };
        let truth = |x: usize, y: usize| 1.0 + 0.5 * side(x, y);
        let halves = noisy(truth, side, 1.6);
        let mut out = clean(&halves, 2);
        let whole = squared_error(&raw(&halves), truth) / squared_error(&out.rgb, truth);
        assert!(whole > 20.0, "{whole}");
        // The pixels on both sides of it.
        for i in (0..SIZE * SIZE).filter(|i| !(SIZE / 2 - 1..=SIZE / 2).contains(&(i % SIZE))) {
            out.rgb.iter_mut().for_each(|plane| plane[i] = truth(i % SIZE, i / SIZE));
        }
        let edge = squared_error(&out.rgb, truth) * (SIZE / 2) as f32;
        assert!(squared_error(&raw(&halves), truth) > 10.0 * edge, "{edge}");
    }

    #[test]
    fn what_no_feature_knows_and_no_noise_hides_is_left_as_it_is() {
        // Spots of one pixel each, four deviations of the mean bright.
        let truth = |x: usize, y: usize| if (x * 7 + y * 13).is_multiple_of(11) { 1.4 } else { 1.0 };
        for deviation in [0.0, 0.04, 0.4] {
            let halves = noisy(truth, |_, _| 0.0, deviation);
            let (before, after) =
                (squared_error(&raw(&halves), truth), squared_error(&clean(&halves, 2).rgb, truth));
            assert!(after <= 1.05 * before + 1e-10, "{deviation}: {before} {after}");
        }
    }

    #[test]
    fn a_wrong_variance_is_noticed() {
        let halves = noisy(|_, _| 1.0, |_, _| 0.0, 0.8);
        let right = squared_error(&clean(&halves, 2).rgb, |_, _| 1.0);
        let mut wrong = halves;
        wrong.variance.iter_mut().flatten().for_each(|v| *v *= 1e-4);
        let wrong = squared_error(&clean(&wrong, 2).rgb, |_, _| 1.0);
        assert!(wrong > 10.0 * right, "{wrong} {right}");
    }

    #[test]
    fn pixels_without_samples_do_no_harm() {
        let mut halves = noisy(|_, _| 1.0, |_, _| 0.0, 0.4);
        for i in 0..SIZE * SIZE / 2 {
            for half in 0..2 {
                // All of the first rows, half of the next.
                if half == 1 || i < SIZE * SIZE / 4 {
                    halves.count[half][i] = 0.0;
                    halves.mean[half].iter_mut().for_each(|plane| plane[i] = 0.0);
                }
            }
        }
        let out = clean(&halves, 2);
        assert!(out.rgb.iter().chain(&out.error).flatten().all(|v| v.is_finite()));
        let rest = &out.rgb[0][SIZE * SIZE / 2..];
        let worst = rest.iter().map(|v| (v - 1.0).abs()).fold(0.0, f32::max);
        // 0.35 as rendered.
        assert!(worst < 0.2, "{worst}");
        // One half alone tells nothing.
        halves.count[1].fill(0.0);
        let out = clean(&halves, 2);
        assert_eq!(out.rgb, raw(&halves));
    }

    #[test]
    fn taps_do_to_means_what_the_filter_does_to_samples() {
        for stddev in [0.4, 0.5, 1.0, 2.0] {
            let filter = |x: f32| (-0.5 * (x / stddev) * (x / stddev)).exp();
            let made = PixelFilter::new(4.0 * stddev, filter);
            let middle = (made.taps.len() / 2) as f32;
            let moment =
                |n| made.taps.iter().enumerate().map(|(i, w)| (i as f32 - middle).powi(n) * w).sum::<f32>();
            assert!((moment(0) - 1.0).abs() < 1e-4 && moment(1).abs() < 1e-4, "{made:?}");
            assert!(
                (moment(2) - (stddev * stddev - 1.0 / 12.0)).abs() < 2e-3 * (1.0 + stddev * stddev),
                "{stddev}: {}",
                moment(2)
            );
            assert!(made.leftover > 0.0 && made.leftover < 0.2, "{made:?}");
        }
    }
}
