//! Spectra: tables over wavelength, the standard observer, illuminants, and the way from a spectrum to RGB.
//!
//! Wavelengths are in nanometres. Two ways lead to RGB: [`Sensor`], which is colorimetry as it should be, and
//! [`mitsuba_rgb`], which does what Mitsuba 3 does, so that its scene files keep their colours.

mod cie;

use crate::colour::{ColourSpace, bradford};
use glam::{DMat3, DVec3, Vec3};

/// Why a table of a spectrum cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// Fewer than two entries, or lists of different length.
    #[error(
        "a spectrum needs at least two wavelengths with one value each; got {wavelengths} wavelengths and {values} values"
    )]
    Length {
        /// How many wavelengths there were.
        wavelengths: usize,
        /// How many values.
        values: usize,
    },
    /// Wavelengths must rise.
    #[error(
        "entry {index} of a spectrum is at {wavelength} nm, not above the one before it; list the wavelengths in rising order"
    )]
    Order {
        /// Which entry, from 0.
        index: usize,
        /// Its wavelength, nm.
        wavelength: f64,
    },
    /// A wavelength or value is infinite or not a number.
    #[error("entry {index} of a spectrum is not a finite number")]
    NotFinite {
        /// Which entry, from 0.
        index: usize,
    },
}

/// A tabulated spectrum, linear between its entries.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    wavelengths: Vec<f64>,
    values: Vec<f64>,
}

impl Spectrum {
    /// From wavelengths (nm, rising) and one value each.
    pub fn new(wavelengths: Vec<f64>, values: Vec<f64>) -> Result<Self, SpectrumError> {
        check(&wavelengths, &values)?;
        Ok(Self { wavelengths, values })
    }

    /// From values on a regular grid that includes both ends.
    pub fn regular(first: f64, last: f64, values: Vec<f64>) -> Result<Self, SpectrumError> {
        let step = (last - first) / (values.len().max(2) - 1) as f64;
        Self::new((0..values.len()).map(|i| first + step * i as f64).collect(), values)
    }

    /// First and last wavelength, nm.
    pub fn range(&self) -> [f64; 2] {
        [self.wavelengths[0], self.wavelengths[self.wavelengths.len() - 1]]
    }

    /// The wavelengths, nm.
    pub fn wavelengths(&self) -> &[f64] {
        &self.wavelengths
    }

    /// The values.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value at `lambda`; zero outside the table, as for light that was not measured.
    pub fn at(&self, lambda: f64) -> f64 {
        interpolate(&self.wavelengths, &self.values, lambda).unwrap_or(0.0)
    }

    /// The value at `lambda`; the end values go on outside, as for an index of refraction.
    pub fn at_held(&self, lambda: f64) -> f64 {
        let [first, last] = self.range();
        self.at(lambda.clamp(first, last))
    }
}

fn check(wavelengths: &[f64], values: &[f64]) -> Result<(), SpectrumError> {
    if wavelengths.len() != values.len() || values.len() < 2 {
        return Err(SpectrumError::Length { wavelengths: wavelengths.len(), values: values.len() });
    }
    for (index, (&w, &v)) in wavelengths.iter().zip(values).enumerate() {
        if !w.is_finite() || !v.is_finite() {
            return Err(SpectrumError::NotFinite { index });
        }
        if index > 0 && w <= wavelengths[index - 1] {
            return Err(SpectrumError::Order { index, wavelength: w });
        }
    }
    Ok(())
}

fn interpolate(x: &[f64], y: &[f64], at: f64) -> Option<f64> {
    let last = x.len() - 1;
    if !(x[0] <= at && at <= x[last]) {
        return None;
    }
    let i = x.partition_point(|&x| x <= at).clamp(1, last) - 1;
    let t = (at - x[i]) / (x[i + 1] - x[i]);
    Some(y[i] + t * (y[i + 1] - y[i]))
}

/// Index of the interval of the CIE's tables that holds `lambda`, and how far along it.
fn cie_interval(lambda: f64) -> Option<(usize, f64)> {
    if !(cie::FIRST..=cie::LAST).contains(&lambda) {
        return None;
    }
    let t = (lambda - cie::FIRST) / cie::STEP;
    let i = (t as usize).min(cie::D65.len() - 2);
    Some((i, t - i as f64))
}

/// Colour-matching functions x̄, ȳ, z̄ of the CIE 1931 standard observer (2°); zero outside 360..830 nm.
pub fn cie_1931(lambda: f64) -> DVec3 {
    cie_interval(lambda).map_or(DVec3::ZERO, |(i, t)| {
        DVec3::from(cie::CIE_1931[i]).lerp(DVec3::from(cie::CIE_1931[i + 1]), t)
    })
}

/// Standard illuminant D65, relative, 100 at 560 nm; zero outside 360..830 nm.
pub fn d65(lambda: f64) -> f64 {
    cie_interval(lambda).map_or(0.0, |(i, t)| cie::D65[i] + t * (cie::D65[i + 1] - cie::D65[i]))
}

/// Standard illuminant A, relative, 100 at 560 nm: an incandescent lamp. CIE 015:2018, equation 4.1.
pub fn illuminant_a(lambda: f64) -> f64 {
    let tail = |l: f64| (1.435e7 / (2848.0 * l)).exp_m1();
    100.0 * (560.0 / lambda).powi(5) * tail(560.0) / tail(lambda)
}

/// Spectral radiance of a black body, W/(m² sr nm), at `kelvin`. Planck 1901; CODATA 2018 constants (exact).
pub fn blackbody(lambda: f64, kelvin: f64) -> f64 {
    const H: f64 = 6.626_070_15e-34;
    const C: f64 = 299_792_458.0;
    const K: f64 = 1.380_649e-23;
    let l = lambda * 1e-9;
    2.0 * H * C * C / l.powi(5) / (H * C / (l * K * kelvin)).exp_m1() * 1e-9
}

/// ∫ ȳ dλ in nm: the luminance of one unit per nanometre at every wavelength.
pub const INTEGRAL_Y: f64 = 106.857;

/// `n` wavelengths over `range`, both ends included.
fn even(range: [f64; 2], n: usize) -> Vec<f64> {
    let step = (range[1] - range[0]) / (n.max(2) - 1) as f64;
    (0..n).map(|i| range[0] + step * i as f64).collect()
}

/// A spectrum to RGB, as weights at regular wavelengths: exact for spectra linear between those.
#[derive(Clone, Debug)]
pub struct Sensor {
    wavelengths: Vec<f64>,
    weights: Vec<DVec3>,
}

impl Sensor {
    /// The RGB of light of spectrum `light(λ) · value(λ)`, from `n` ≥ 2 wavelengths over `range`.
    /// One unit per nanometre at every wavelength has luminance 1. White points that are not D65 are reached
    /// by Bradford adaptation, as between colour spaces.
    pub fn emission(space: ColourSpace, range: [f64; 2], n: usize, light: impl Fn(f64) -> f64) -> Self {
        let mut sensor = Self::xyz(even(range, n), light);
        let srgb = ColourSpace::LinearSrgb;
        let to_rgb = srgb.matrix_to(space).as_dmat3() * srgb.to_xyz().inverse() * (1.0 / INTEGRAL_Y);
        sensor.apply(to_rgb);
        sensor
    }

    /// The RGB of a surface that reflects `value(λ)`, seen under D65: exactly (1, 1, 1) where all is
    /// reflected, in every space.
    pub fn reflectance(space: ColourSpace, range: [f64; 2], n: usize) -> Self {
        Self::reflectance_at(space, even(range, n))
    }

    /// [`Self::reflectance`] from values at these wavelengths, nm, two or more that rise and overlap 360..830.
    pub fn reflectance_at(space: ColourSpace, wavelengths: Vec<f64>) -> Self {
        let mut sensor = Self::xyz(wavelengths, d65);
        let white: DVec3 = sensor.weights.iter().sum();
        let adapt = bradford(white / white.y, space.to_xyz() * DVec3::ONE);
        sensor.apply(space.to_xyz().inverse() * adapt * (1.0 / white.y));
        sensor
    }

    fn xyz(wavelengths: Vec<f64>, light: impl Fn(f64) -> f64) -> Self {
        let last = wavelengths.len() - 1;
        let (low, high) = (wavelengths[0].max(cie::FIRST), wavelengths[last].min(cie::LAST));
        assert!(last > 0 && low < high, "a sensor needs two wavelengths or more, some of them visible");
        let mut weights = vec![DVec3::ZERO; wavelengths.len()];
        // Each nanometre's share goes to the two wavelengths around it, by the trapezoid rule.
        let fine = (high - low).ceil() as usize;
        let h = (high - low) / fine as f64;
        for k in 0..=fine {
            let lambda = low + h * k as f64;
            let share = cie_1931(lambda) * light(lambda) * if k == 0 || k == fine { 0.5 * h } else { h };
            let i = wavelengths.partition_point(|&w| w <= lambda).clamp(1, last) - 1;
            let t = (lambda - wavelengths[i]) / (wavelengths[i + 1] - wavelengths[i]);
            weights[i] += share * (1.0 - t);
            weights[i + 1] += share * t;
        }
        Self { wavelengths, weights }
    }

    fn apply(&mut self, m: DMat3) {
        self.weights.iter_mut().for_each(|w| *w = m * *w);
    }

    /// Where it looks, nm.
    pub fn wavelengths(&self) -> &[f64] {
        &self.wavelengths
    }

    /// RGB per unit at each wavelength.
    pub fn weights(&self) -> &[DVec3] {
        &self.weights
    }

    /// RGB of `value(λ)`.
    pub fn rgb(&self, value: impl Fn(f64) -> f64) -> Vec3 {
        self.wavelengths.iter().zip(&self.weights).map(|(&l, &w)| w * value(l)).sum::<DVec3>().as_vec3()
    }
}

/// RGB in `space` of a surface that reflects `value(λ)`, under D65.
pub fn reflectance_rgb(space: ColourSpace, value: impl Fn(f64) -> f64) -> Vec3 {
    Sensor::reflectance(space, [cie::FIRST, cie::LAST], 471).rgb(value)
}

/// RGB in `space` of light of spectrum `value(λ)`; one unit per nanometre at every wavelength has luminance 1.
pub fn emission_rgb(space: ColourSpace, value: impl Fn(f64) -> f64) -> Vec3 {
    Sensor::emission(space, [cie::FIRST, cie::LAST], 471, |_| 1.0).rgb(value)
}

/// What a wavelength list means to Mitsuba.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MitsubaSpectrum {
    /// A colour of a surface or texture: weighted by D65, clamped to [0, 1].
    Reflectance,
    /// A surface parameter that may exceed one, such as `eta` and `k`: weighted by D65, not below 0.
    Unbounded,
    /// Light: every wavelength counts alike, so a flat list is reddish, (1.205, 0.948, 0.909); not below 0.
    Emission,
}

/// Linear sRGB of a wavelength list as the `rgb` variants of Mitsuba 3.9.1 read it.
///
/// It takes 1000 wavelengths from 360 to 830 nm, both included; those outside the list count as zero; the sum
/// is weighted by 470/1000 nm, its own norms of ȳ and D65, and its own matrix to sRGB. Agrees with the program
/// to 2e-6, its single-precision rounding.
pub fn mitsuba_rgb(
    wavelengths: &[f64],
    values: &[f64],
    kind: MitsubaSpectrum,
) -> Result<Vec3, SpectrumError> {
    check(wavelengths, values)?;
    // Numbers of include/mitsuba/core/spectrum.h.
    const STEPS: usize = 1000;
    const Y_NORM: f64 = 1.0 / 106.750_259_399_414_06;
    const D65_NORM: f64 = 1.0 / 98.997_417_518_762_55;
    let width = cie::LAST - cie::FIRST;
    let mut xyz = DVec3::ZERO;
    for i in 0..STEPS {
        let lambda = cie::FIRST + i as f64 / (STEPS - 1) as f64 * width;
        if let Some(value) = interpolate(wavelengths, values, lambda) {
            let light = if kind == MitsubaSpectrum::Emission { 1.0 } else { d65(lambda) * D65_NORM };
            xyz += cie_1931(lambda) * (value * light);
        }
    }
    let rgb = mitsuba_from_xyz(xyz * (Y_NORM * width / STEPS as f64));
    let ceiling = if kind == MitsubaSpectrum::Reflectance { 1.0 } else { f32::INFINITY };
    Ok(rgb.as_vec3().clamp(Vec3::ZERO, Vec3::splat(ceiling)))
}

/// Linear sRGB of `<spectrum value="2.5"/>`, one number for all wavelengths, on a Mitsuba emitter: reddish,
/// like a flat list. On a surface the number itself is meant, as is `<float value="2.5"/>` everywhere.
pub fn mitsuba_uniform_emission(value: f32) -> Vec3 {
    mitsuba_from_xyz(DVec3::ONE).as_vec3() * value
}

/// Mitsuba's XYZ to linear sRGB (include/mitsuba/core/spectrum.h, `xyz_to_srgb`).
fn mitsuba_from_xyz(xyz: DVec3) -> DVec3 {
    DMat3::from_cols(
        DVec3::new(3.240479, -0.969256, 0.055648),
        DVec3::new(-1.537150, 1.875991, -0.204043),
        DVec3::new(-0.498535, 0.041556, 1.057311),
    ) * xyz
}

#[cfg(test)]
mod tests {
    use super::MitsubaSpectrum::{Emission, Reflectance, Unbounded};
    use super::*;

    fn near(got: Vec3, want: [f32; 3], tolerance: f32) {
        assert!((got - Vec3::from(want)).abs().max_element() <= tolerance, "{got} is not {want:?}");
    }

    #[test]
    fn the_observer_and_the_illuminants_are_the_published_ones() {
        assert!((cie_1931(560.0) - DVec3::new(0.5945, 0.995, 0.0039)).length() < 1e-12);
        assert_eq!(cie_1931(359.9), DVec3::ZERO);
        let sum: DVec3 = (0..=94).map(|i| cie_1931(360.0 + 5.0 * f64::from(i)) * 5.0).sum();
        assert!((sum.y - INTEGRAL_Y).abs() < 1e-3, "{sum}");
        // colour-science 0.4.7, SDS_ILLUMINANTS['A'].
        for (lambda, a) in [(360.0, 6.14462), (450.0, 33.0859), (560.0, 100.0), (780.0, 241.675)] {
            assert!((illuminant_a(lambda) / a - 1.0).abs() < 1e-5, "{lambda}");
        }
        assert_eq!((d65(560.0), d65(452.5)), (100.0, 0.5 * (117.008 + 117.41)));
        // Chromaticity of D65 (CIE 015:2018, table 11.3) and of A.
        for (light, x, y) in [(d65 as fn(f64) -> f64, 0.31272, 0.32903), (illuminant_a, 0.44758, 0.40745)] {
            let xyz: DVec3 = (0..=470).map(|i| 360.0 + f64::from(i)).map(|l| cie_1931(l) * light(l)).sum();
            let sum = xyz.element_sum();
            assert!((xyz.x / sum - x).abs() < 3e-5 && (xyz.y / sum - y).abs() < 3e-5, "{}", xyz / sum);
        }
    }

    #[test]
    fn blackbody_obeys_stefan_boltzmann_and_wien() {
        // ∫ B dλ = σ T⁴ / π; the peak at 2897.772 nm·kK / T.
        let t = 3000.0;
        let total: f64 = (1..200_000).map(|i| blackbody(f64::from(i), t)).sum();
        assert!((total * std::f64::consts::PI / (5.670_374_419e-8 * t.powi(4)) - 1.0).abs() < 1e-4);
        let peak = (900..1050).max_by(|&a, &b| blackbody(a.into(), t).total_cmp(&blackbody(b.into(), t)));
        assert_eq!(peak, Some(966));
    }

    #[test]
    fn white_is_white_and_a_sensor_is_exact_between_its_wavelengths() {
        for space in ColourSpace::ALL {
            near(reflectance_rgb(space, |_| 1.0), [1.0; 3], 1e-6);
            near(Sensor::reflectance(space, [380.0, 780.0], 81).rgb(|_| 0.25), [0.25; 3], 1e-6);
            near(
                space.matrix_to(ColourSpace::LinearSrgb) * emission_rgb(space, |_| 1.0),
                [1.2048, 0.9483, 0.9089],
                5e-4,
            );
            let ramp = |l: f64| 0.1 + 0.002 * (l - 380.0);
            let coarse = Sensor::reflectance(space, [380.0, 780.0], 5).rgb(ramp);
            near(coarse, Sensor::reflectance(space, [380.0, 780.0], 401).rgb(ramp).into(), 1e-6);
            let uneven = Sensor::reflectance_at(space, vec![380.0, 391.0, 450.0, 452.5, 700.0, 780.0]);
            near(uneven.rgb(ramp), coarse.into(), 1e-6);
        }
    }

    #[test]
    fn spectra_interpolate_and_refuse_bad_tables() {
        let s = Spectrum::regular(400.0, 700.0, vec![1.0, 2.0, 4.0, 0.0]).unwrap();
        assert_eq!(
            [350.0, 400.0, 450.0, 600.0, 650.0, 700.0, 701.0].map(|l| s.at(l)),
            [0.0, 1.0, 1.5, 4.0, 2.0, 0.0, 0.0]
        );
        assert_eq!((s.at_held(300.0), s.range()), (1.0, [400.0, 700.0]));
        for (w, v, e) in [
            (vec![400.0], vec![1.0], SpectrumError::Length { wavelengths: 1, values: 1 }),
            (vec![400.0, 500.0], vec![1.0], SpectrumError::Length { wavelengths: 2, values: 1 }),
            (vec![400.0, 400.0], vec![1.0, 1.0], SpectrumError::Order { index: 1, wavelength: 400.0 }),
            (vec![400.0, f64::NAN], vec![1.0, 1.0], SpectrumError::NotFinite { index: 1 }),
        ] {
            assert_eq!(mitsuba_rgb(&w, &v, Emission), Err(e.clone()));
            assert_eq!(Spectrum::new(w, v), Err(e));
        }
    }

    #[test]
    fn wavelength_lists_become_what_mitsuba_makes_of_them() {
        // Mitsuba 3.9.1, spectrum_list_to_srgb in scalar_rgb. It rounds to f32 on the way (worst seen 2e-6
        // relative to one); hence 1e-5.
        let zigzag: (&[f64], &[f64]) = (&[410.0, 473.0, 521.5, 602.0, 660.0], &[0.9, 0.1, 0.7, 0.2, 1.4]);
        let wide: (&[f64], &[f64]) = (&[300.0, 355.0, 362.0, 900.0], &[2.0, 1.0, 0.5, 0.25]);
        let narrow: (&[f64], &[f64]) = (&[545.0, 555.0], &[10.0, 10.0]);
        let flat: (&[f64], &[f64]) = (&[360.0, 830.0], &[1.0, 1.0]);
        let steep: (&[f64], &[f64]) = (&[400.0, 500.0, 700.0], &[1.5, 0.2, 3.0]);
        let between: (&[f64], &[f64]) = (&[450.0, 450.3], &[5.0, 9.0]);
        for ((w, v), kind, want) in [
            (zigzag, Reflectance, [0.4554922, 0.49792, 0.3757469]),
            (zigzag, Unbounded, [0.4554922, 0.49792, 0.3757469]),
            (zigzag, Emission, [0.566635, 0.4658684, 0.3563977]),
            (wide, Reflectance, [0.369315, 0.4154234, 0.4628149]),
            (wide, Emission, [0.4494698, 0.3940429, 0.4227546]),
            (narrow, Reflectance, [0.0, 1.0, 0.0]),
            (narrow, Unbounded, [0.0, 1.393553, 0.0]),
            (narrow, Emission, [0.0, 1.331769, 0.0]),
            (flat, Reflectance, [0.998_983_44, 0.998_872_3, 0.998_802_2]),
            (flat, Emission, [1.2048826, 0.9482289, 0.909_266_8]),
            (steep, Unbounded, [2.2597847, 0.6973439, 0.768_857_7]),
            (steep, Emission, [2.592945, 0.665_110_05, 0.7116072]),
            (between, Emission, [0.0; 3]),
        ] {
            near(mitsuba_rgb(w, v, kind).unwrap(), want, 1e-5);
        }
        // PointLight with <spectrum name="intensity" value="2.5"/>.
        near(mitsuba_uniform_emission(2.5), [3.01198, 2.37073, 2.27229], 1e-5);
    }

    #[test]
    fn the_cornell_box_has_mitsubas_colours() {
        let Some(data) = std::env::var_os("YUGEN_DATA") else {
            assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must name the data folder in CI");
            println!("skipped: YUGEN_DATA is not set");
            return;
        };
        let xml = std::fs::read_to_string(std::path::Path::new(&data).join("mitsuba/scenes/cbox/cbox.xml"))
            .unwrap();
        let lists: Vec<(&str, &str)> = xml
            .split("<spectrum name=\"")
            .skip(1)
            .map(|s| {
                let mut quoted = s.split('"');
                (quoted.next().unwrap(), quoted.nth(1).unwrap())
            })
            .collect();
        // The same lists loaded into Mitsuba 3.9.1 (scalar_rgb): box twice, red, green, light material, light.
        let want = [
            [0.7350128, 0.7356251, 0.7362642],
            [0.7350128, 0.7356251, 0.7362642],
            [0.49132, 0.04922798, 0.05092189],
            [0.06828208, 0.3977605, 0.08629083],
            [0.7763677, 0.7798091, 0.7760289],
            [20.71082, 10.85464, 2.771151],
        ];
        assert_eq!(lists.len(), want.len());
        for ((name, list), want) in lists.into_iter().zip(want) {
            let (w, v): (Vec<f64>, Vec<f64>) = list
                .split(',')
                .map(|pair| pair.trim().split_once(':').unwrap())
                .map(|(w, v)| (w.parse::<f64>().unwrap(), v.parse::<f64>().unwrap()))
                .unzip();
            let kind = if name == "radiance" { Emission } else { Reflectance };
            near(mitsuba_rgb(&w, &v, kind).unwrap(), want, 1e-5 * want[0].max(1.0));
        }
    }
}
