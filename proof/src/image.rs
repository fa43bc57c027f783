//! Pictures against references.
//!
//! A rendered picture is random, so it is not compared with a threshold but with a test: is each pixel's
//! difference from the reference as likely as the reference's variance says? After the method of Mitsuba 3's
//! render tests: a z-test per pixel and channel against a mean and a variance picture, Šidák's correction for
//! the number of pixels, and all but 0.25 % of the values must pass (the tails of a path tracer are heavier
//! than normal). Mitsuba compares in XYZ: convert picture and references first to repeat its verdict.

use std::fmt;
use yugen_optics::Image;
use yugen_optics::statistics::{sidak, z_p_value};

/// Why two pictures cannot be compared, or do not agree.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// They differ in size or channels.
    #[error("{what} is {found}, expected {expected}")]
    Shape {
        /// Which picture.
        what: &'static str,
        /// Its size and channels.
        found: String,
        /// The size and channels of the reference.
        expected: String,
    },
    /// There is nothing to compare.
    #[error("the pictures have no pixels")]
    Empty,
    /// A value that is not a number, before anything is compared.
    #[error("{what} holds {value} at pixel ({x}, {y}), channel {channel}; {count} values are not finite")]
    NotFinite {
        /// Which picture.
        what: &'static str,
        /// Pixel across.
        x: usize,
        /// Pixel down.
        y: usize,
        /// Name of the channel.
        channel: String,
        /// The first of them.
        value: f32,
        /// How many.
        count: usize,
    },
}

/// Verdict of a [`z_test`].
#[derive(Clone, Debug, PartialEq)]
pub struct ZTest {
    /// Share of values that pass.
    pub share: f64,
    /// Share that must.
    pub required: f64,
    /// Significance of each single test.
    pub significance: f64,
    /// Smallest p-value.
    pub worst_p: f64,
    /// Where that is.
    pub worst: (usize, usize),
    /// Smallest p-value of each pixel, row by row: a picture of where it goes wrong.
    pub p_values: Vec<f32>,
}

impl ZTest {
    /// Whether the picture agrees.
    pub fn passed(&self) -> bool {
        self.share >= self.required
    }
}

impl fmt::Display for ZTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.3} % of the values agree ({:.2} % must), smallest p = {:.1e} at pixel ({}, {})",
            100.0 * self.share,
            100.0 * self.required,
            self.worst_p,
            self.worst.0,
            self.worst.1
        )
    }
}

/// Settings of a [`z_test`].
#[derive(Clone, Copy, Debug)]
pub struct ZSettings {
    /// Significance of all tests together.
    pub significance: f64,
    /// Share of values that must pass.
    pub share: f64,
    /// Samples per pixel of the picture under test: the reference variance is that of one sample.
    pub samples: f64,
    /// Samples per pixel behind the reference mean; infinite for an exact one.
    pub reference_samples: f64,
    /// Reference variances below this are raised to it: a pixel that no reference sample saw lit has none.
    pub variance_floor: f64,
}

impl ZSettings {
    /// Mitsuba's, for a picture of `samples` per pixel against a reference taken as exact: significance 0.01,
    /// 99.75 % of the values, variances of 1e-4 at least.
    pub fn mitsuba(samples: f64) -> Self {
        Self {
            significance: 0.01,
            share: 0.9975,
            samples,
            reference_samples: f64::INFINITY,
            variance_floor: 1e-4,
        }
    }
}

fn shape(image: &Image) -> String {
    format!("{} x {} with channels {}", image.width, image.height, image.channels.join(", "))
}

/// All values finite, or the first that is not. Comes before every comparison, since NaN compares as equal.
pub fn finite(what: &'static str, image: &Image) -> Result<(), ImageError> {
    let bad = |v: &&f32| !v.is_finite();
    let Some(at) = image.data.iter().position(|v| !v.is_finite()) else { return Ok(()) };
    let channels = image.channels.len().max(1);
    let pixel = at / channels;
    Err(ImageError::NotFinite {
        what,
        x: pixel % image.width.max(1),
        y: pixel / image.width.max(1),
        channel: image.channels.get(at % channels).cloned().unwrap_or_default(),
        value: image.data[at],
        count: image.data.iter().filter(bad).count(),
    })
}

fn comparable(pictures: &[(&'static str, &Image)]) -> Result<(), ImageError> {
    let (_, first) = pictures[0];
    let count = first.width * first.height * first.channels.len();
    if count == 0 {
        return Err(ImageError::Empty);
    }
    for (what, image) in pictures {
        let same =
            image.width == first.width && image.height == first.height && image.channels == first.channels;
        if !same || image.data.len() != count {
            return Err(ImageError::Shape { what, found: shape(image), expected: shape(first) });
        }
        finite(what, image)?;
    }
    Ok(())
}

/// Tests `image` against the `mean` and the `variance` of one sample of a reference.
pub fn z_test(
    image: &Image,
    mean: &Image,
    variance: &Image,
    settings: ZSettings,
) -> Result<ZTest, ImageError> {
    comparable(&[
        ("the reference mean", mean),
        ("the reference variance", variance),
        ("the picture", image),
    ])?;
    let channels = mean.channels.len();
    let significance = sidak(settings.significance, mean.width * mean.height);
    let scale = 1.0 / settings.samples + 1.0 / settings.reference_samples;
    let p_values: Vec<f64> = (0..mean.data.len())
        .map(|i| {
            let error = (f64::from(variance.data[i]).max(settings.variance_floor) * scale).sqrt();
            z_p_value((f64::from(image.data[i]) - f64::from(mean.data[i])) / error)
        })
        .collect();
    let pixels: Vec<f64> =
        p_values.chunks_exact(channels).map(|p| p.iter().copied().fold(1.0, f64::min)).collect();
    let (at, worst_p) =
        pixels.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).ok_or(ImageError::Empty)?;
    let passing = p_values.iter().filter(|p| **p > significance).count();
    Ok(ZTest {
        share: passing as f64 / p_values.len() as f64,
        required: settings.share,
        significance,
        worst_p,
        worst: (at % mean.width, at / mean.width),
        p_values: pixels.into_iter().map(|p| p as f32).collect(),
    })
}

/// Mean over all values of (a − b)² / (b² + 0.01): relative, and tame where the reference is dark.
pub fn relative_mse(image: &Image, reference: &Image) -> Result<f64, ImageError> {
    comparable(&[("the reference", reference), ("the picture", image)])?;
    let sum: f64 = image
        .data
        .iter()
        .zip(&reference.data)
        .map(|(&a, &b)| (f64::from(a), f64::from(b)))
        .map(|(a, b)| (a - b).powi(2) / (b * b + 1e-2))
        .sum();
    Ok(sum / image.data.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;
    use yugen_optics::statistics::normal_quantile;

    /// A grey ramp, its variance, and a picture of it with noise for `samples` per pixel.
    fn noisy(samples: f64, seed: u64) -> [Image; 3] {
        let mut mean = Image::rgb(64, 48);
        mean.data.iter_mut().enumerate().for_each(|(i, v)| *v = 0.1 + i as f32 / 9216.0);
        let mut variance = mean.clone();
        variance.data.iter_mut().for_each(|v| *v *= 0.5);
        let mut rng = Pcg32::new(seed, 1);
        let mut image = mean.clone();
        for (v, var) in image.data.iter_mut().zip(&variance.data) {
            let z = normal_quantile(f64::from(rng.next_f32()).clamp(1e-7, 1.0 - 1e-7));
            *v += (z * (f64::from(*var) / samples).sqrt()) as f32;
        }
        [image, mean, variance]
    }

    #[test]
    fn honest_noise_passes() {
        for seed in 0..5 {
            let [image, mean, variance] = noisy(64.0, seed);
            let z = z_test(&image, &mean, &variance, ZSettings::mitsuba(64.0)).unwrap();
            assert!(z.passed() && z.share == 1.0, "{z}");
        }
    }

    #[test]
    fn wrong_pictures_are_caught() {
        let settings = ZSettings::mitsuba(65536.0);
        let [image, mean, variance] = noisy(65536.0, 1);
        let verdict = |f: &dyn Fn(usize, f32) -> f32| {
            let mut wrong = image.clone();
            wrong.data.iter_mut().enumerate().for_each(|(i, v)| *v = f(i, *v));
            z_test(&wrong, &mean, &variance, settings).unwrap()
        };
        assert!(verdict(&|_, v| v).passed());
        // Two percent too bright; a block of 40 pixels moved; noise said to be a hundredth of what it is.
        assert!(!verdict(&|_, v| v * 1.02).passed());
        let block = verdict(&|i, v| if (3000..3120).contains(&i) { v + 0.1 } else { v });
        assert!(!block.passed() && (1000..1040).contains(&(block.worst.1 * 64 + block.worst.0)), "{block}");
        let [loud, ..] = noisy(655.36, 1);
        assert!(!z_test(&loud, &mean, &variance, settings).unwrap().passed());
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let settings = ZSettings::mitsuba(64.0);
        let [mut image, mean, variance] = noisy(64.0, 1);
        image.pixel_mut(5, 7)[1] = f32::NAN;
        let e = z_test(&image, &mean, &variance, settings).unwrap_err();
        assert!(matches!(e, ImageError::NotFinite { x: 5, y: 7, count: 1, .. }), "{e}");
        assert!(relative_mse(&image, &mean).is_err());
        assert!(matches!(relative_mse(&mean, &image), Err(ImageError::NotFinite { .. })));
        assert!(matches!(
            z_test(&Image::rgb(1, 2), &mean, &variance, settings),
            Err(ImageError::Shape { .. })
        ));
        let none = Image::default();
        assert_eq!(z_test(&none, &none, &none, settings), Err(ImageError::Empty));
    }

    #[test]
    fn relative_mse_is_what_it_says() {
        let [_, mean, _] = noisy(1.0, 1);
        assert_eq!(relative_mse(&mean, &mean), Ok(0.0));
        let mut off = mean.clone();
        off.data.iter_mut().for_each(|v| *v = 1.1);
        let mut one = mean.clone();
        one.data.fill(1.0);
        assert!((relative_mse(&off, &one).unwrap() - 0.01 / 1.01).abs() < 1e-6);
    }
}
