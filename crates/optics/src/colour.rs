//! Linear RGB spaces and the way between them.
//!
//! The *working space* is a property of a scene: products of colours differ from space to space, so light
//! is carried in one named space and converted at file borders only. Gold and firelight lie outside sRGB.

use glam::{DMat3, DVec3, Mat3, Vec3};

/// A linear RGB space, given by its primaries and white point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ColourSpace {
    /// ITU-R BT.709 primaries, D65. What Mitsuba's `rgb` variants work in.
    LinearSrgb,
    /// ITU-R BT.2020 primaries, D65. Yugen's own default: wide enough for gold under firelight.
    #[default]
    LinearRec2020,
    /// ACES AP1 primaries, D60-like white.
    AcesCg,
    /// DCI-P3 primaries, D65: what displays of a wide gamut show (Display P3, with the transfer function of sRGB).
    LinearP3,
}

impl ColourSpace {
    /// Every space.
    pub const ALL: [Self; 4] = [Self::LinearSrgb, Self::LinearRec2020, Self::AcesCg, Self::LinearP3];

    /// The name used in scene files and metadata.
    pub fn name(self) -> &'static str {
        match self {
            Self::LinearSrgb => "srgb",
            Self::LinearRec2020 => "rec2020",
            Self::AcesCg => "acescg",
            Self::LinearP3 => "p3",
        }
    }

    /// The space called `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }

    /// CIE xy chromaticities: red, green, blue, white (ITU-R BT.709-6, BT.2020-2; SMPTE ST 2065-1 for AP1;
    /// SMPTE RP 431-2 with the white of D65 for P3).
    pub fn chromaticities(self) -> [[f64; 2]; 4] {
        const D65: [f64; 2] = [0.3127, 0.3290];
        match self {
            Self::LinearSrgb => [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65],
            Self::LinearRec2020 => [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], D65],
            Self::AcesCg => [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044], [0.32168, 0.33767]],
            Self::LinearP3 => [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], D65],
        }
    }

    /// RGB to CIE XYZ (1931, 2°), white at Y = 1.
    pub fn to_xyz(self) -> DMat3 {
        rgb_to_xyz(self.chromaticities())
    }

    /// The matrix from this space to `to`; Bradford adaptation where the white points differ.
    pub fn matrix_to(self, to: Self) -> Mat3 {
        if self == to {
            return Mat3::IDENTITY;
        }
        rgb_to_rgb(self.chromaticities(), to.chromaticities())
    }

    /// Weights of relative luminance Y for a colour of this space.
    pub fn luminance_weights(self) -> Vec3 {
        self.to_xyz().row(1).as_vec3()
    }

    /// Relative luminance Y.
    pub fn luminance(self, rgb: Vec3) -> f32 {
        self.luminance_weights().dot(rgb)
    }
}

/// RGB to CIE XYZ, white at Y = 1, for the xy chromaticities of red, green, blue and white.
pub fn rgb_to_xyz(chromaticities: [[f64; 2]; 4]) -> DMat3 {
    // Not in units of y, which is zero for two of the primaries of XYZ itself.
    let xyz = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y);
    let [r, g, b, white] = chromaticities.map(xyz);
    let scale = DMat3::from_cols(r, g, b).inverse() * (white / white.y);
    DMat3::from_cols(r * scale.x, g * scale.y, b * scale.z)
}

/// The matrix between RGB spaces given by xy chromaticities (red, green, blue, white); Bradford adaptation
/// where the white points differ.
pub fn rgb_to_rgb(from: [[f64; 2]; 4], to: [[f64; 2]; 4]) -> Mat3 {
    let (from, to) = (rgb_to_xyz(from), rgb_to_xyz(to));
    (to.inverse() * bradford(from * DVec3::ONE, to * DVec3::ONE) * from).as_mat3()
}

/// Linear Bradford chromatic adaptation from white point `from` to `to`, both XYZ with Y = 1.
pub fn bradford(from: DVec3, to: DVec3) -> DMat3 {
    // Lam 1985; the matrix as printed in ICC.1:2022, Annex E.
    let m = DMat3::from_cols(
        DVec3::new(0.8951, -0.7502, 0.0389),
        DVec3::new(0.2664, 1.7135, -0.0685),
        DVec3::new(-0.1614, 0.0367, 1.0296),
    );
    let gain = (m * to) / (m * from);
    m.inverse() * DMat3::from_diagonal(gain) * m
}

/// sRGB transfer function, display value to linear (IEC 61966-2-1).
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// sRGB transfer function, linear to display value (IEC 61966-2-1).
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.0031308 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_agree_with_the_published_ones() {
        // IEC 61966-2-1 (to four digits) and ITU-R BT.2087-0, table 1.
        let srgb = ColourSpace::LinearSrgb.to_xyz();
        assert!((srgb.row(1) - DVec3::new(0.2126, 0.7152, 0.0722)).abs().max_element() < 1e-4);
        let xyz = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]];
        assert!((rgb_to_xyz(xyz) - DMat3::IDENTITY).to_cols_array().iter().all(|v| v.abs() < 1e-12));
        let to2020 = ColourSpace::LinearSrgb.matrix_to(ColourSpace::LinearRec2020);
        assert!((to2020.row(0) - Vec3::new(0.6274, 0.3293, 0.0433)).abs().max_element() < 1e-4);
        assert!((to2020.row(2) - Vec3::new(0.0164, 0.0880, 0.8956)).abs().max_element() < 1e-4);
        // CSS Color 4, section 18 (sample code).
        let p3 = ColourSpace::LinearP3.to_xyz();
        assert!((p3.row(0) - DVec3::new(0.486571, 0.265668, 0.198217)).abs().max_element() < 1e-5);
        assert!((p3.row(1) - DVec3::new(0.228975, 0.691739, 0.079287)).abs().max_element() < 1e-5);
    }

    #[test]
    fn white_stays_white_and_round_trips() {
        for a in ColourSpace::ALL {
            for b in ColourSpace::ALL {
                let white = a.matrix_to(b) * Vec3::ONE;
                assert!((white - Vec3::ONE).abs().max_element() < 1e-5, "{a:?} {b:?} {white}");
                let back = b.matrix_to(a) * a.matrix_to(b);
                assert!((back - Mat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-5));
            }
        }
        for i in 0..=100 {
            let v = i as f32 / 100.0;
            assert!((linear_to_srgb(srgb_to_linear(v)) - v).abs() < 1e-5);
        }
    }
}
