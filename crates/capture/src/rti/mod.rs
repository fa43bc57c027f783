//! Reflectance transformation imaging: a picture as a function of its light, texel by texel.
//!
//! [`fit`] makes polynomial texture maps and hemispherical harmonics of a stack, [`rbf`] interpolates between the lights
//! of a stack, [`light`] shows any of them, or a fitted cloth, under lamps and environments, [`mixed`] what others have
//! fitted in other ways, and [`holdout`] says which of them predicts photographs it has not seen.
//!
//! Values are display values, as the tools of the field have them: what an eight-bit photograph would show, from 0 to
//! 1, unless [`Encoding::Linear`] is asked for.

mod basis;
pub mod fit;
pub mod holdout;
pub mod light;
pub mod mixed;
pub mod rbf;

pub use basis::evaluate;

use crate::Stack;
use yugen_optics::colour::srgb_to_linear;

/// What the numbers of a relightable picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Encoding {
    /// sRGB display values of what lies between black and white, the rest cut off: as photographs are.
    #[default]
    Srgb,
    /// Proportional to light.
    Linear,
}

/// The curve of sRGB for 0 to 1, within 3e-6. Its power x^(1/2.4) is u^(5/3) of the fourth root u of x, which bends so
/// little above the straight part that a polynomial through seven points follows it (Chebyshev's, both ends among
/// them); without a table or a branch, so that eight go at once.
#[inline(always)]
fn curve(x: f32) -> f32 {
    const C: [f32; 7] =
        [-0.004_261_023, 0.132_036_28, 1.294_589_2, -0.804_547_4, 0.613_259_1, -0.292_567_46, 0.061_491_307];
    let u = x.sqrt().sqrt();
    let power = C[0] + u * (C[1] + u * (C[2] + u * (C[3] + u * (C[4] + u * (C[5] + u * C[6])))));
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * power - 0.055 }
}

impl Encoding {
    /// From light; what is not a number stays so.
    #[inline(always)]
    pub fn encode(self, light: f32) -> f32 {
        match self {
            Self::Linear => light,
            Self::Srgb => curve(light.clamp(0.0, 1.0)),
        }
    }

    /// To light, never negative.
    #[inline]
    pub fn decode(self, value: f32) -> f32 {
        match self {
            Self::Linear => value.max(0.0),
            Self::Srgb => srgb_to_linear(value.max(0.0)),
        }
    }
}

/// Why a stack cannot be fitted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RtiError {
    /// Not enough to learn from.
    #[error("{what} needs at least {least} lights; the stack has {lights}")]
    TooFewLights {
        /// Lights of the stack.
        lights: usize,
        /// What was to be fitted.
        what: &'static str,
        /// How many it takes.
        least: usize,
    },
    /// A texel has all its readings from lights in one place or on one line.
    #[error("the lights stand on one line as seen from the sample; interpolation needs three that do not")]
    LightsOnALine,
}

/// The readings of a texel under lights of the same irradiance, encoded, one a light; what is masked becomes
/// NaN in all channels. Returns whether any is.
fn readings(stack: &Stack, x: usize, y: usize, encoding: Encoding, out: &mut [[f32; 3]]) -> bool {
    let samples = stack.samples(x, y);
    let near = matches!(stack.lights, crate::Lights::Near(_));
    let mut sum = 0.0;
    for (light, (out, sample)) in out.iter_mut().zip(samples).enumerate() {
        let scale = if near { 1.0 / stack.light(light, x, y).1 } else { 1.0 };
        *out = sample.map(|v| encoding.encode(v * scale));
        // A sum is no number as soon as one of its parts is none.
        sum += out[0] + out[1] + out[2];
    }
    let masked = !sum.is_finite();
    if masked {
        for v in out.iter_mut().filter(|v| v.iter().any(|v| !v.is_finite())) {
            *v = [f32::NAN; 3];
        }
    }
    masked
}

#[cfg(test)]
mod tests;
