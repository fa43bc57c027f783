//! From scene light to what a display shows: exposure, gamut, curve.

use crate::colour::{ColourSpace, linear_to_srgb};
use glam::{Mat3, Vec3};

/// A named curve from linear scene light to linear display light in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Curve {
    /// No curve: what is brighter than the display is cut off. The one to compare renderers with.
    #[default]
    Clip,
    /// Reinhard, Stark, Shirley and Ferwerda 2002, "Photographic Tone Reproduction for Digital Images",
    /// equation 4, on luminance, with the white point at [`REINHARD_WHITE`].
    Reinhard,
    /// Narkowicz 2016, "ACES Filmic Tone Mapping Curve", channel by channel: contrast and a soft shoulder.
    Aces,
    /// Sobotka 2022, "AgX" (github.com/sobotka/AgX): primaries drawn in, so that bright colours go to white as on film, a
    /// logarithm and a sigmoid; without a look. The values of its configuration for OpenColorIO within 3e-4.
    AgX,
}

/// The smallest luminance that [`Curve::Reinhard`] shows as white: four stops over a grey card's white.
pub const REINHARD_WHITE: f32 = 16.0;

impl Curve {
    /// Every curve.
    pub const ALL: [Self; 4] = [Self::Clip, Self::Reinhard, Self::Aces, Self::AgX];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clip => "clip",
            Self::Reinhard => "reinhard",
            Self::Aces => "aces",
            Self::AgX => "agx",
        }
    }

    /// The curve called `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }

    /// Primaries that the curve works on where a display has those of `display`: these, but for curves that were made channel by
    /// channel for the primaries of sRGB, which give the same colours on every display.
    pub fn primaries(self, display: ColourSpace) -> ColourSpace {
        match self {
            Self::Clip | Self::Reinhard => display,
            Self::Aces | Self::AgX => ColourSpace::LinearSrgb,
        }
    }

    /// Linear scene light of the curve's [primaries](Self::primaries), no channel negative, to linear display light in [0, 1].
    pub fn apply(self, rgb: Vec3, primaries: ColourSpace) -> Vec3 {
        let mapped = match self {
            Self::Clip => rgb,
            Self::Reinhard => {
                let y = primaries.luminance(rgb);
                rgb * ((1.0 + y / (REINHARD_WHITE * REINHARD_WHITE)) / (1.0 + y))
            }
            Self::Aces => {
                // The curve is level at 1.03 from about 60 on; beyond 1e15 its squares would overflow.
                let x = rgb.min(Vec3::splat(1e6));
                (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
            }
            // The sigmoid makes the numbers of a display of exponent 2.2.
            Self::AgX => agx_log(rgb).map(|x| agx_sigmoid(x).powf(2.2)),
        };
        mapped.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// Stops about which AgX's logarithm lies: ten below middle grey, .18, and six and a half above it.
const AGX_STOPS: [f32; 2] = [-12.473_93, 4.026_069];

/// AgX's log encoding of linear sRGB: black and white of the range are 0 and 1. The matrix is that of "AgX Log (Kraken)"
/// in the configuration.
fn agx_log(rgb: Vec3) -> Vec3 {
    let inset = Mat3::from_cols(
        Vec3::new(0.842_479_06, 0.042_328_24, 0.042_375_655),
        Vec3::new(0.078_433_6, 0.878_468_64, 0.078_433_6),
        Vec3::new(0.079_223_745, 0.079_166_13, 0.879_142_97),
    );
    let [low, high] = AGX_STOPS;
    (inset * rgb).map(|x| ((x.max(1e-30).log2() - low) / (high - low)).clamp(0.0, 1.0))
}

/// AgX's contrast, from log encoding to the numbers of a display: a line of slope 2 through middle grey, which comes out
/// at one half, bent to reach (0, 0) with exponent 3 and (1, 1) with exponent 3.25.
fn agx_sigmoid(x: f32) -> f32 {
    const MIDDLE: f32 = 10.0 / 16.5;
    let (side, run, power) = if x < MIDDLE { (-1.0, MIDDLE, 3.0) } else { (1.0, 1.0 - MIDDLE, 3.25f32) };
    // y = k t / (1 + tᵖ)^(1/p) for t = 2 |x - middle| / k, with the k that makes y one half at the end.
    let k = 2.0 * run / ((4.0 * run).powf(power) - 1.0).powf(1.0 / power);
    let t = 2.0 * (x - MIDDLE).abs() / k;
    (0.5 + side * k * t / (1.0 + t.powf(power)).powf(1.0 / power)).max(0.0)
}

/// Brings a linear colour with negative channels into the gamut by mixing it with the grey of its luminance
/// just as far as needed: hue and luminance stay, saturation goes. Without light there is black.
pub fn into_gamut(rgb: Vec3, space: ColourSpace) -> Vec3 {
    let least = rgb.min_element();
    if least >= 0.0 {
        return rgb;
    }
    let y = space.luminance(rgb);
    if y <= 0.0 {
        return Vec3::ZERO;
    }
    let grey = Vec3::splat(y);
    (grey + (rgb - grey) * (y / (y - least))).max(Vec3::ZERO)
}

/// From scene light to a display: exposure, gamut and curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMap {
    /// Primaries that the curve works on.
    primaries: ColourSpace,
    to_primaries: Mat3,
    to_display: Mat3,
    curve: Curve,
}

impl ToneMap {
    /// For colours of `space`, brightened by `exposure` stops and mapped by `curve`, on an sRGB display.
    pub fn new(space: ColourSpace, exposure: f32, curve: Curve) -> Self {
        Self::on(ColourSpace::LinearSrgb, space, exposure, curve)
    }

    /// The same on a display with the primaries of `display` and the transfer function of sRGB.
    pub fn on(display: ColourSpace, space: ColourSpace, exposure: f32, curve: Curve) -> Self {
        let primaries = curve.primaries(display);
        Self {
            primaries,
            to_primaries: space.matrix_to(primaries) * exposure.exp2(),
            to_display: primaries.matrix_to(display),
            curve,
        }
    }

    /// Scene light to display values in [0, 1]; what is not a number becomes black.
    pub fn show(&self, rgb: Vec3) -> Vec3 {
        if rgb.is_nan() {
            return Vec3::ZERO;
        }
        let rgb = self.to_primaries * rgb.clamp(Vec3::splat(-f32::MAX / 64.0), Vec3::splat(f32::MAX / 64.0));
        let light = self.to_display * self.curve.apply(into_gamut(rgb, self.primaries), self.primaries);
        light.clamp(Vec3::ZERO, Vec3::ONE).map(linear_to_srgb)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::srgb_to_linear;

    #[test]
    fn curves_rise_from_black_to_white_and_hit_their_published_points() {
        for curve in Curve::ALL {
            assert_eq!(Curve::from_name(curve.name()), Some(curve));
            assert!(curve.apply(Vec3::ZERO, ColourSpace::LinearSrgb).max_element() < 1e-12, "{curve:?}");
            let mut last = 0.0;
            for i in 0..200 {
                let v = curve.apply(Vec3::splat(1.1f32.powi(i - 100)), ColourSpace::LinearSrgb).x;
                assert!(v >= last && v <= 1.0, "{curve:?} {i}");
                last = v;
            }
            assert!((last - 1.0).abs() < 1e-3, "{curve:?} ends at {last}");
        }
        // White maps to one exactly there, and small values stay as they are (Reinhard et al. 2002, figure 4).
        assert!(
            (Curve::Reinhard.apply(Vec3::splat(REINHARD_WHITE), ColourSpace::LinearP3).x - 1.0).abs() < 1e-6
        );
        assert!(
            (Curve::Reinhard.apply(Vec3::splat(1e-3), ColourSpace::LinearSrgb).x / 1e-3 - 1.0).abs() < 2e-3
        );
        // Narkowicz's rational function at 1: 2.54 / 3.16.
        assert!((Curve::Aces.apply(Vec3::ONE, ColourSpace::LinearSrgb).x - 2.54 / 3.16).abs() < 1e-6);
    }

    /// Values of "AgX Base" in Sobotka's configuration, by OpenColorIO 2.6.0.
    #[test]
    fn agx_has_the_values_of_its_configuration() {
        for (light, shown) in [
            ([0.18, 0.18, 0.18], [0.5, 0.5, 0.5]),
            ([0.01, 0.01, 0.01], [0.09616, 0.09615, 0.09615]),
            ([0.05, 0.04, 0.03], [0.27436, 0.24651, 0.21458]),
            ([1.0, 1.0, 1.0], [0.78754, 0.78751, 0.78751]),
            ([4.0, 4.0, 4.0], [0.93781, 0.9378, 0.9378]),
            ([1.0, 0.2, 0.05], [0.76533, 0.53666, 0.40095]),
            ([0.02, 0.3, 2.0], [0.5174, 0.64861, 0.8634]),
            ([8.0, 0.0, 0.0], [0.96853, 0.61031, 0.61051]),
            ([0.0, 0.0, 3.0], [0.5486, 0.54847, 0.90402]),
        ] {
            let ours =
                Curve::AgX.apply(Vec3::from_array(light), ColourSpace::LinearSrgb).map(|v| v.powf(1.0 / 2.2));
            // The worst is 7e-5.
            assert!((ours - Vec3::from_array(shown)).abs().max_element() < 3e-4, "{light:?}: {ours}");
        }
    }

    #[test]
    fn gamut_mapping_keeps_luminance_and_leaves_what_fits() {
        let space = ColourSpace::LinearSrgb;
        let inside = Vec3::new(0.1, 2.0, 0.3);
        assert_eq!(into_gamut(inside, space), inside);
        // The green primary of Rec. 2020 lies far outside.
        let outside = ColourSpace::LinearRec2020.matrix_to(space) * Vec3::Y;
        assert!(outside.min_element() < -0.1);
        let mapped = into_gamut(outside, space);
        assert!(mapped.min_element().abs() < 1e-6, "{mapped}");
        assert!((space.luminance(mapped) - space.luminance(outside)).abs() < 1e-6);
        assert_eq!(into_gamut(Vec3::new(-1.0, 0.0, 0.0), space), Vec3::ZERO);
    }

    /// A colour within both gamuts is the same light on both displays; P3's green is left as it is on the one and not on the other.
    #[test]
    fn displays_of_other_primaries_show_the_same_colours() {
        let [srgb, p3] = [ColourSpace::LinearSrgb, ColourSpace::LinearP3];
        let light = |display: ColourSpace, curve, rgb| {
            let shown = ToneMap::on(display, p3, 0.0, curve).show(rgb);
            display.matrix_to(p3) * shown.map(srgb_to_linear)
        };
        for curve in Curve::ALL {
            let inside = Vec3::new(0.5, 0.4, 0.3);
            let off = (light(srgb, curve, inside) - light(p3, curve, inside)).abs().max_element();
            assert!(off < 1e-5, "{curve:?}: {off}");
        }
        let green = Vec3::new(0.0, 0.5, 0.0);
        assert!((light(p3, Curve::Clip, green) - green).abs().max_element() < 1e-5);
        assert!((light(srgb, Curve::Clip, green) - green).max_element() > 0.05);
        let [on_srgb, on_p3] = [srgb, p3].map(|d| light(d, Curve::AgX, green));
        assert!((on_srgb - on_p3).abs().max_element() < 1e-5, "{on_srgb} {on_p3}");
    }

    #[test]
    fn display_values_are_sane_for_anything() {
        let d = ToneMap::new(ColourSpace::LinearRec2020, 1.0, Curve::Clip);
        // One stop brighter, grey stays grey: 0.25 becomes 0.5, sRGB 0.735357 (IEC 61966-2-1).
        assert!((d.show(Vec3::splat(0.25)) - Vec3::splat(0.735357)).abs().max_element() < 1e-5);
        for x in [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, -f32::MAX, 0.0, 1e-40] {
            for curve in Curve::ALL {
                let v = ToneMap::new(ColourSpace::AcesCg, 3.0, curve).show(Vec3::new(x, 0.5, -x));
                assert!(
                    v.is_finite() && v.min_element() >= 0.0 && v.max_element() <= 1.0,
                    "{curve:?} {x} {v}"
                );
            }
        }
    }
}
