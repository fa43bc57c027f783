//! What is read of a picture whose light can be moved.

use super::mixed::Mixed;
use super::relightable::Relightable;

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Contents {
    /// A function of the light for each colour, or for a factor of a fixed colour: what can be written, too.
    Terms(Relightable),
    /// Coefficients with colours of their own.
    Mixed(Mixed),
}

impl Contents {
    /// Texels across and down.
    pub fn size(&self) -> [usize; 2] {
        match self {
            Self::Terms(r) => [r.width, r.height],
            Self::Mixed(m) => [m.width, m.height],
        }
    }

    /// Numbers a texel.
    pub fn stride(&self) -> usize {
        match self {
            Self::Terms(r) => r.stride(),
            Self::Mixed(m) => m.functions.coefficients(),
        }
    }

    /// All texels' numbers.
    pub fn coefficients(&self) -> &[f32] {
        match self {
            Self::Terms(r) => &r.coefficients,
            Self::Mixed(m) => &m.coefficients,
        }
    }

    /// The picture, if its terms are functions of the light.
    pub fn terms(self) -> Option<Relightable> {
        match self {
            Self::Terms(r) => Some(r),
            Self::Mixed(_) => None,
        }
    }
}
