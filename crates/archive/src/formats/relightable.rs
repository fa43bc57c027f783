//! Pictures whose light can be moved: what `.ptm`, `.rti` and RelightLab's folders hold.

use crate::{Error, Place};

/// The functions of the light's direction (x, y, z) that a texel's coefficients multiply, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Basis {
    /// 1, x, y, x², xy, y². Malzbender, Gelb and Wolters 2001, "Polynomial Texture Maps".
    Ptm,
    /// Hemispherical harmonics of orders 0 to `order` − 1, `order`² of them, as HSH tools number them: within an
    /// order cos mφ with m falling, the zonal one, sin mφ with m rising. Gautron et al. 2004, "A Novel
    /// Hemispherical Basis for Accurate and Efficient Rendering".
    Hsh {
        /// 2, 3 or 4.
        order: usize,
    },
}

impl Basis {
    /// Every basis that files hold.
    pub const ALL: [Self; 4] =
        [Self::Ptm, Self::Hsh { order: 2 }, Self::Hsh { order: 3 }, Self::Hsh { order: 4 }];

    /// How many functions.
    pub fn terms(self) -> usize {
        match self {
            Self::Ptm => 6,
            Self::Hsh { order } => order * order,
        }
    }

    /// For people, as in `HSH 9`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ptm => "PTM",
            Self::Hsh { order: 2 } => "HSH 4",
            Self::Hsh { order: 3 } => "HSH 9",
            Self::Hsh { .. } => "HSH 16",
        }
    }
}

/// What is a function of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Colouring {
    /// Each of red, green and blue.
    Rgb,
    /// A factor, which multiplies a fixed colour.
    Lrgb,
}

impl Colouring {
    pub(super) fn stride(self, basis: Basis) -> usize {
        match self {
            Self::Rgb => 3 * basis.terms(),
            Self::Lrgb => 3 + basis.terms(),
        }
    }
}

/// A picture whose light can be moved. Its values are what a display shows at 0 (black) to 1 (255 of 255), in
/// practice with the sRGB curve in them; a file does not say.
#[derive(Clone, Debug, PartialEq)]
pub struct Relightable {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// The functions of light.
    pub basis: Basis,
    /// What they make up.
    pub colouring: Colouring,
    /// Texel after texel from the top left, [`Self::stride`] numbers each: for [`Colouring::Rgb`] the red, green and
    /// blue coefficient of each term; for [`Colouring::Lrgb`] red, green, blue of the fixed colour, then a
    /// coefficient a term.
    pub coefficients: Vec<f32>,
}

impl Relightable {
    /// Numbers a texel.
    pub fn stride(&self) -> usize {
        self.colouring.stride(self.basis)
    }

    /// The part of each texel that multiplies functions of the light.
    #[cfg(test)]
    pub(crate) fn terms_of<'a>(&self, texel: &'a [f32]) -> &'a [f32] {
        match self.colouring {
            Colouring::Rgb => texel,
            Colouring::Lrgb => &texel[3..],
        }
    }

    /// Smallest and largest coefficient of each term over all texels and colours.
    #[cfg(test)]
    pub(crate) fn ranges(&self) -> Vec<[f32; 2]> {
        super::gathered::Gathered::from(self).term_ranges()
    }

    /// Coefficients a term.
    #[cfg(test)]
    pub(crate) fn colours(&self) -> usize {
        match self.colouring {
            Colouring::Rgb => 3,
            Colouring::Lrgb => 1,
        }
    }
}

/// Texels that are read where the caller has no other wish: 8k x 8k.
pub const DEFAULT_MAX_TEXELS: u64 = 1 << 26;

/// The size in a header, refused where it is nothing or more than the limit.
pub(crate) fn admit(at: Place, width: u64, height: u64, limit: u64) -> Result<(usize, usize), Error> {
    if width == 0 || height == 0 {
        return Err(Error::invalid(at, format!("the picture is empty ({width} x {height})")));
    }
    let asked = width.saturating_mul(height);
    if asked > limit {
        let what = format!("the number of texels ({width} x {height})");
        return Err(Error::TooLarge { at, what, asked, limit });
    }
    Ok((width as usize, height as usize))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    /// A picture with coefficients of both signs, a term that is never negative and one that is zero.
    pub fn sample(basis: Basis, colouring: Colouring, width: usize, height: usize) -> Relightable {
        let mut r = Relightable { width, height, basis, colouring, coefficients: Vec::new() };
        let mut rng = Pcg32::new(7, 3);
        for _ in 0..width * height {
            if colouring == Colouring::Lrgb {
                r.coefficients.extend([1.0, rng.next_f32(), 0.25]);
            }
            for term in 0..basis.terms() {
                for _ in 0..r.colours() {
                    let u = rng.next_f32();
                    r.coefficients.push(match term {
                        0 => 0.3 + 0.9 * u,
                        3 => 0.0,
                        _ => u - 0.4,
                    });
                }
            }
        }
        r
    }

    /// The largest difference of a coefficient, in quanta of its term, and of a fixed colour, in 1/255.
    pub fn quanta(a: &Relightable, b: &Relightable) -> f32 {
        assert_eq!(
            (a.width, a.height, a.basis, a.colouring, a.coefficients.len()),
            (b.width, b.height, b.basis, b.colouring, b.coefficients.len())
        );
        let steps: Vec<f32> =
            a.ranges().iter().map(|[lo, hi]| (hi.max(0.0) - lo.min(0.0)).max(1e-3) / 255.0).collect();
        let mut worst = 0f32;
        for (x, y) in a.coefficients.chunks_exact(a.stride()).zip(b.coefficients.chunks_exact(a.stride())) {
            let terms = a.terms_of(x).iter().zip(b.terms_of(y)).enumerate();
            worst = terms.map(|(i, (p, q))| (p - q).abs() / steps[i / a.colours()]).fold(worst, f32::max);
            if a.colouring == Colouring::Lrgb {
                worst = (0..3).map(|c| 255.0 * (x[c] - y[c]).abs()).fold(worst, f32::max);
            }
        }
        worst
    }
}
