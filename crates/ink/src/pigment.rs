//! Pigments by Kubelka and Munk 1931: what a layer of ink on paper reflects, in eight bands of the spectrum.
//!
//! A pigment is told by what a layer of unit load reflects over white and over black (Curtis et al. 1997, "Computer-Generated
//! Watercolor"); layers lie over one another as light is thrown to and fro between them. Alpha over black has no shades: ink
//! of .1, .2, .4, .8 and 1.6 loads reflects .62, .45, .24, .08 and .03 of the light here, the five shades of a painter.

use glam::Vec3;
use yugen_optics::ColourSpace;
use yugen_optics::spectrum::Sensor;

/// Bands of the spectrum.
pub const BANDS: usize = 8;
/// Their middles, nanometres.
pub const WAVELENGTHS: [f64; BANDS] = [420.0, 460.0, 500.0, 540.0, 580.0, 620.0, 660.0, 700.0];

/// A pigment in its binder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pigment {
    /// Of presets.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// What a layer of unit load reflects over white.
    pub over_white: [f32; BANDS],
    /// And over black: less, but more than nothing.
    pub over_black: [f32; BANDS],
}

/// All pigments. Their curves are drawn by hand after the known course of such spectra (soot nearly grey, cinnabar's step near
/// 600 nm, indigo's valley near 660, malachite's peak near 530); they are of no measured sample.
pub const PIGMENTS: &[Pigment] = &[
    Pigment {
        name: "pine",
        doc: "soot of pine: the cool ink of wide distances",
        over_white: [0.068, 0.066, 0.063, 0.060, 0.057, 0.055, 0.054, 0.053],
        over_black: [0.036, 0.035, 0.033, 0.030, 0.028, 0.027, 0.026, 0.026],
    },
    Pigment {
        name: "oil",
        doc: "soot of oil: warm and glossy",
        over_white: [0.046, 0.049, 0.053, 0.058, 0.063, 0.068, 0.072, 0.075],
        over_black: [0.022, 0.024, 0.026, 0.029, 0.032, 0.034, 0.036, 0.037],
    },
    Pigment {
        name: "cinnabar",
        doc: "seal paste: vermilion",
        over_white: [0.055, 0.050, 0.050, 0.060, 0.16, 0.62, 0.76, 0.80],
        over_black: [0.042, 0.038, 0.038, 0.046, 0.12, 0.42, 0.52, 0.55],
    },
    Pigment {
        name: "indigo",
        doc: "indigo: a dark blue wash",
        over_white: [0.30, 0.36, 0.28, 0.17, 0.10, 0.07, 0.06, 0.16],
        over_black: [0.060, 0.068, 0.056, 0.036, 0.022, 0.018, 0.016, 0.030],
    },
    Pigment {
        name: "malachite",
        doc: "malachite: mineral green",
        over_white: [0.20, 0.32, 0.52, 0.58, 0.42, 0.24, 0.15, 0.12],
        over_black: [0.12, 0.20, 0.34, 0.38, 0.27, 0.14, 0.09, 0.07],
    },
];

impl Pigment {
    /// The one called `name`.
    pub fn find(name: &str) -> Option<&'static Self> {
        PIGMENTS.iter().find(|p| p.name == name)
    }

    /// Kubelka and Munk's numbers of each band: a = 1 + K/S, b = √(a² − 1), and scattering S of unit load.
    pub fn numbers(&self) -> [[f32; BANDS]; 3] {
        let mut out = [[0.0; BANDS]; 3];
        for band in 0..BANDS {
            let [w, k] = [self.over_white, self.over_black].map(|r| f64::from(r[band]));
            let a = 0.5 * (w + (k - w + 1.0) / k);
            let b = (a * a - 1.0).sqrt();
            let x = (b * b - (a - w) * (a - 1.0)) / (b * (1.0 - w));
            // The inverse of the hyperbolic cotangent.
            let s = 0.5 * ((x + 1.0) / (x - 1.0)).ln() / b;
            out[0][band] = a as f32;
            out[1][band] = b as f32;
            out[2][band] = s as f32;
        }
        out
    }
}

/// What a layer of `load` with the numbers a, b and S reflects over something that reflects `below`.
pub fn over(a: f32, b: f32, s: f32, load: f32, below: f32) -> f32 {
    // Beyond, nothing below is seen any more, and cosines of large numbers are none.
    let x = (b * s * load).min(20.0);
    if x <= 0.0 {
        return below;
    }
    let c = a * x.sinh() + b * x.cosh();
    let (r, t) = (x.sinh() / c, b / c);
    r + t * t * below / (1.0 - r * below)
}

/// Linear sRGB of reflectances in the bands: red, green and blue of each band. White is one.
pub fn band_to_rgb() -> [Vec3; BANDS] {
    let sensor = Sensor::reflectance_at(ColourSpace::LinearSrgb, WAVELENGTHS.to_vec());
    std::array::from_fn(|i| sensor.weights()[i].as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition: unit load over white and black is what the pigment says.
    #[test]
    fn unit_loads_reflect_what_the_pigment_says() {
        for p in PIGMENTS {
            let [a, b, s] = p.numbers();
            for i in 0..BANDS {
                let at = |below| over(a[i], b[i], s[i], 1.0, below);
                assert!((at(1.0) - p.over_white[i]).abs() < 1e-4, "{} {i}: {}", p.name, at(1.0));
                assert!((at(0.0) - p.over_black[i]).abs() < 1e-4, "{} {i}: {}", p.name, at(0.0));
                assert_eq!(over(a[i], b[i], s[i], 0.0, 0.3), 0.3);
                assert!(over(a[i], b[i], s[i], 1e30, 0.3).is_finite());
            }
        }
    }

    /// Five shades, by an independent computation of the same formulae: over paper of .86, of a grey ink with .06 and .03.
    #[test]
    fn ink_has_five_shades() {
        let grey = Pigment { name: "", doc: "", over_white: [0.06; BANDS], over_black: [0.03; BANDS] };
        let [a, b, s] = grey.numbers().map(|v| v[0]);
        for (load, want) in [(0.1, 0.618), (0.2, 0.445), (0.4, 0.236), (0.8, 0.081), (1.6, 0.034)] {
            let found = over(a, b, s, load, 0.86);
            assert!((found - want).abs() < 1e-3, "{load}: {found} instead of {want}");
        }
    }

    /// Two layers of half a load are one of a whole.
    #[test]
    fn layers_add_up() {
        for p in PIGMENTS {
            let [a, b, s] = p.numbers();
            for i in 0..BANDS {
                let half = |below| over(a[i], b[i], s[i], 0.35, below);
                let whole = over(a[i], b[i], s[i], 0.7, 0.8);
                assert!((half(half(0.8)) - whole).abs() < 1e-5, "{}", p.name);
            }
        }
    }

    #[test]
    fn white_is_white_and_cinnabar_red() {
        let to_rgb = band_to_rgb();
        let rgb = |r: &[f32; BANDS]| to_rgb.iter().zip(r).map(|(w, r)| *w * *r).sum::<Vec3>();
        assert!((rgb(&[1.0; BANDS]) - Vec3::ONE).length() < 1e-5);
        let red = rgb(&Pigment::find("cinnabar").unwrap().over_white);
        assert!(red.x > 4.0 * red.y && red.x > 4.0 * red.z, "{red}");
        let green = rgb(&Pigment::find("malachite").unwrap().over_white);
        assert!(green.y > green.x && green.y > green.z, "{green}");
    }
}
