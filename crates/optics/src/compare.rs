//! How alike two pictures are: PSNR and SSIM, on display values from 0 to 1.

use crate::Image;

/// Peak signal-to-noise ratio in dB of values whose peak is 1; infinite where nothing differs. Pairs of which one
/// is not a number are left out; NaN where that leaves none.
pub fn psnr(values: &[f32], reference: &[f32]) -> f64 {
    let (mut sum, mut count) = (0.0, 0u64);
    for (&a, &b) in values.iter().zip(reference) {
        let d = f64::from(a) - f64::from(b);
        if !d.is_nan() {
            sum += d * d;
            count += 1;
        }
    }
    -10.0 * (sum / count as f64).log10()
}

/// Half the width of the window of [`ssim`].
pub const SSIM_REACH: usize = 5;

/// Structural similarity of each pixel, the mean over channels. Wang, Bovik, Sheikh and Simoncelli 2004, "Image
/// Quality Assessment: From Error Visibility to Structural Similarity", with its window, a Gaussian of σ = 1.5
/// pixels cut to 11 x 11, and K₁ = 0.01, K₂ = 0.03 for values from 0 to 1.
///
/// The picture that comes back has one channel and is [`SSIM_REACH`] pixels smaller on every side; `None` where
/// that leaves nothing, or the two differ in size or channels.
pub fn ssim(image: &Image, reference: &Image) -> Option<Image> {
    let (w, h, channels) = (image.width, image.height, image.channels.len());
    let same = (reference.width, reference.height, reference.channels.len()) == (w, h, channels);
    if !same || channels == 0 || w.min(h) <= 2 * SSIM_REACH {
        return None;
    }
    let mut window: Vec<f64> =
        (0..=2 * SSIM_REACH).map(|i| (-0.5 * ((i as f64 - SSIM_REACH as f64) / 1.5).powi(2)).exp()).collect();
    let sum: f64 = window.iter().sum();
    window.iter_mut().for_each(|v| *v /= sum);
    let (ow, oh) = (w - 2 * SSIM_REACH, h - 2 * SSIM_REACH);
    // Rows first, then columns; both lose the border.
    let blur = |plane: &[f64]| -> Vec<f64> {
        let mut across = vec![0.0; ow * h];
        for (out, row) in across.chunks_exact_mut(ow).zip(plane.chunks_exact(w)) {
            for (k, g) in window.iter().enumerate() {
                out.iter_mut().zip(&row[k..]).for_each(|(o, v)| *o += g * v);
            }
        }
        let mut both = vec![0.0; ow * oh];
        for (y, out) in both.chunks_exact_mut(ow).enumerate() {
            for (k, g) in window.iter().enumerate() {
                out.iter_mut().zip(&across[(y + k) * ow..]).for_each(|(o, v)| *o += g * v);
            }
        }
        both
    };
    let (c1, c2) = (0.01f64.powi(2), 0.03f64.powi(2));
    let mut map = Image::new(ow, oh, &["Y"]);
    for c in 0..channels {
        let plane = |i: &Image| i.data.iter().skip(c).step_by(channels).map(|&v| f64::from(v)).collect();
        let (a, b): (Vec<f64>, Vec<f64>) = (plane(image), plane(reference));
        let product = |p: &[f64], q: &[f64]| blur(&p.iter().zip(q).map(|(x, y)| x * y).collect::<Vec<_>>());
        let (mean_a, mean_b) = (blur(&a), blur(&b));
        let (aa, bb, ab) = (product(&a, &a), product(&b, &b), product(&a, &b));
        for (i, out) in map.data.iter_mut().enumerate() {
            let (ma, mb) = (mean_a[i], mean_b[i]);
            let (va, vb, cov) = (aa[i] - ma * ma, bb[i] - mb * mb, ab[i] - ma * mb);
            let likeness = (2.0 * ma * mb + c1) * (2.0 * cov + c2);
            *out += (likeness / ((ma * ma + mb * mb + c1) * (va + vb + c2))) as f32 / channels as f32;
        }
    }
    Some(map)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PSNR: f64 = 23.44942398211934;
    const SSIM: f64 = 0.9573585205184317;
    /// Of pixel (8, 9).
    const SSIM_8_9: f64 = 0.9587567281557153;

    /// The same pictures went through scikit-image 0.26: `peak_signal_noise_ratio` and `structural_similarity` with
    /// gaussian_weights, sigma 1.5, use_sample_covariance False, data_range 1.
    fn pictures() -> [Image; 2] {
        let (mut a, mut b) = (Image::rgb(32, 24), Image::rgb(32, 24));
        for y in 0..24 {
            for x in 0..32 {
                for c in 0..3 {
                    let (u, v, k) = (x as f64, y as f64, c as f64);
                    let value = 0.5 + 0.4 * (0.37 * u + 0.21 * v + k).sin();
                    a.pixel_mut(x, y)[c] = value as f32;
                    b.pixel_mut(x, y)[c] = (0.9 * value + 0.05 * (1.3 * u - 0.7 * v).cos()) as f32;
                }
            }
        }
        [a, b]
    }

    #[test]
    fn values_are_those_of_scikit_image() {
        let [a, b] = pictures();
        assert!((psnr(&b.data, &a.data) - PSNR).abs() < 1e-4, "{}", psnr(&b.data, &a.data));
        let map = ssim(&b, &a).unwrap();
        let mean = map.data.iter().map(|&v| f64::from(v)).sum::<f64>() / map.data.len() as f64;
        assert_eq!((map.width, map.height), (22, 14));
        assert!((mean - SSIM).abs() < 1e-6, "{mean}");
        assert!((f64::from(map.pixel(3, 4)[0]) - SSIM_8_9).abs() < 1e-6, "{}", map.pixel(3, 4)[0]);
    }

    #[test]
    fn equal_pictures_are_perfect_and_masked_values_do_not_count() {
        let [a, b] = pictures();
        assert_eq!(psnr(&a.data, &a.data), f64::INFINITY);
        assert!(ssim(&a, &a).unwrap().data.iter().all(|v| (v - 1.0).abs() < 1e-6));
        let mut masked = b.clone();
        masked.data[100..1100].fill(f32::NAN);
        let rest: [Vec<f32>; 2] = [&a, &b].map(|i| [&i.data[..100], &i.data[1100..]].concat());
        assert_eq!(psnr(&masked.data, &a.data), psnr(&rest[1], &rest[0]));
        assert!(psnr(&[f32::NAN], &[1.0]).is_nan());
        assert!(ssim(&Image::rgb(10, 30), &Image::rgb(10, 30)).is_none());
        assert!(ssim(&Image::rgb(20, 30), &Image::rgb(30, 20)).is_none());
    }
}
