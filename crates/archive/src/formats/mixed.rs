//! Pictures whose coefficients each have a colour of their own under a light: the sum of a colour that all texels share
//! and of a texel's coefficients, each times its colour, all of which depend on the light alone.
//!
//! RelightLab writes principal components so (`mrgb` and `mycc`): the colours are known under some lights, and between
//! those they are interpolated. With `ycc`, and in PTM files of luminance, the coefficients are those of a luminance
//! and two more for the chrominance, which no light changes.

use super::relightable::Basis;
use glam::Vec3;

/// Such a picture. Its values are as those of a [`Relightable`](super::relightable::Relightable).
#[derive(Clone, Debug, PartialEq)]
pub struct Mixed {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// What the coefficients multiply.
    pub functions: Functions,
    /// Texel after texel from the top left, [`Functions::coefficients`] numbers each.
    pub coefficients: Vec<f32>,
}

/// What the coefficients of a [`Mixed`] multiply.
#[derive(Clone, Debug, PartialEq)]
pub enum Functions {
    /// Colours that are known under some lights.
    Sampled {
        /// Those lights, and how the colours go on between them.
        between: Between,
        /// For each of the lights the shared colour, then that of each coefficient: red, green, blue.
        colours: Vec<[f32; 3]>,
    },
    /// The terms of a basis, all grey: a luminance Y. Two coefficients more are the chrominances Cb and Cr of JFIF, from
    /// −0.5 to 0.5.
    Luminance(Basis),
}

/// How colours that are known under some lights go on between these.
#[derive(Clone, Debug, PartialEq)]
pub enum Between {
    /// The mean with the weights exp(−d²/σ²), d being the distance between the vectors toward the lights; weights below
    /// a thousandth of their sum do not count.
    Gaussian {
        /// Toward the lights.
        lights: Vec<Vec3>,
        /// σ, above zero.
        sigma: f32,
    },
    /// Bilinear on a square grid of so many by so many lights, row after row. The hemisphere lies on it as half of an
    /// octahedron: (x + y, y − x)/(|x| + |y| + |z|) goes from −1 to 1 along either side.
    Octahedron {
        /// At least 2.
        side: usize,
    },
}

impl Between {
    /// How many lights.
    pub fn lights(&self) -> usize {
        match self {
            Self::Gaussian { lights, .. } => lights.len(),
            Self::Octahedron { side } => side * side,
        }
    }
}

impl Functions {
    /// Coefficients a texel.
    pub fn coefficients(&self) -> usize {
        match self {
            Self::Sampled { between, colours } => (colours.len() / between.lights().max(1)).saturating_sub(1),
            Self::Luminance(basis) => basis.terms() + 2,
        }
    }

    /// For people, as in `bilinear, 64 lights`.
    pub fn name(&self) -> String {
        match self {
            Self::Sampled { between: Between::Gaussian { lights, .. }, .. } => {
                format!("RBF, {} lights", lights.len())
            }
            Self::Sampled { between: Between::Octahedron { side }, .. } => {
                format!("bilinear, {} lights", side * side)
            }
            Self::Luminance(basis) => format!("{} luminance", basis.name()),
        }
    }
}
