//! How highlights fall off.

use crate::lanes::F;

/// Gaussians that a profile is made of.
pub(super) const TERMS: usize = 7;

/// How narrow each is: its exponent, in units of the highlight's own. Each is twice as wide as the one before.
pub(super) const NARROW: [f32; TERMS] = [64.0, 16.0, 4.0, 1.0, 1.0 / 4.0, 1.0 / 16.0, 1.0 / 64.0];

/// The one of the highlight's own width.
pub(super) const OWN: usize = 3;

/// How a highlight falls off with the squared slope u of the half vector in units of the width: K(u) = Σ shareᵢ
/// exp(−narrowᵢ u), K(0) = 1. Every fall whose derivatives alternate in sign is such a sum (Bernstein 1929), those of
/// Ward, GGX and all others of the field among them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Profile {
    share: [F; TERMS],
    /// Ward's exp(−u) and nothing else.
    gaussian: bool,
}

impl Profile {
    /// Ward's.
    pub const GAUSSIAN: Self =
        Self { share: [F::ZERO, F::ZERO, F::ZERO, F::ONE, F::ZERO, F::ZERO, F::ZERO], gaussian: true };

    /// The same for all texels.
    pub fn of(share: [f32; TERMS]) -> Self {
        let share = share.map(F::splat);
        Self { share, gaussian: share == Self::GAUSSIAN.share }
    }

    pub fn is_gaussian(&self) -> bool {
        self.gaussian
    }

    /// K and −K′.
    #[inline(always)]
    pub fn at(&self, u: F) -> (F, F) {
        if self.gaussian {
            let e = (-u).exp();
            return (e, e);
        }
        let (mut sum, mut slope) = (F::ZERO, F::ZERO);
        let e = gaussians(u);
        for i in 0..TERMS {
            let part = self.share[i] * e[i];
            sum += part;
            slope += part * NARROW[i];
        }
        (sum, slope)
    }
}

/// exp(−narrowᵢ u), each the fourth power of the next.
#[inline(always)]
pub(super) fn gaussians(u: F) -> [F; TERMS] {
    let (one, wide) = ((-u).exp(), (u * -NARROW[TERMS - 1]).exp());
    let (four, wider) = (fourth(one), fourth(wide));
    let sixteen = fourth(four);
    [fourth(sixteen), sixteen, four, one, fourth(wider), wider, wide]
}

#[inline(always)]
fn fourth(e: F) -> F {
    let e2 = e * e;
    e2 * e2
}
