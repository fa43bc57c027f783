//! Eight numbers side by side. Plain arrays and plain IEEE operations, fused only where it says so: whatever
//! instructions the compiler makes of them, the bits are the same.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// How many go in step.
pub(crate) const LANES: usize = 8;

/// Eight numbers: one of each texel, or one of each term.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct F(pub [f32; LANES]);

/// Yes or no for each texel, as 1 or 0.
pub(crate) type Mask = F;

impl F {
    pub const ZERO: Self = Self([0.0; LANES]);
    pub const ONE: Self = Self([1.0; LANES]);

    #[inline(always)]
    pub fn splat(x: f32) -> Self {
        Self([x; LANES])
    }

    // Loops, because the closures of the library's array functions are not inlined into a wider instruction set.
    #[inline(always)]
    pub fn map(mut self, f: impl Fn(f32) -> f32) -> Self {
        for v in &mut self.0 {
            *v = f(*v);
        }
        self
    }

    #[inline(always)]
    fn zip(mut self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        for i in 0..LANES {
            self.0[i] = f(self.0[i], b.0[i]);
        }
        self
    }

    /// self · b + c, rounded once. Slow on processors that cannot do it in one instruction.
    #[inline(always)]
    pub fn mul_add(mut self, b: Self, c: Self) -> Self {
        for i in 0..LANES {
            self.0[i] = self.0[i].mul_add(b.0[i], c.0[i]);
        }
        self
    }

    #[inline(always)]
    pub fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    pub fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    pub fn clamp(self, low: f32, high: f32) -> Self {
        self.max(Self::splat(low)).min(Self::splat(high))
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        self.map(f32::abs)
    }

    #[inline(always)]
    pub fn above(self, b: Self) -> Mask {
        self.zip(b, |a, b| if a > b { 1.0 } else { 0.0 })
    }

    /// Where `self` says yes, `yes`; elsewhere `no`. Takes the number as it is, so that a NaN on the other side
    /// does no harm. By bits: of an `if` the compiler makes branches in some places, and then no wide instructions.
    #[inline(always)]
    pub fn choose(self, yes: Self, no: Self) -> Self {
        let mut out = no;
        for i in 0..LANES {
            let all = 0u32.wrapping_sub(u32::from(self.0[i] > 0.5));
            out.0[i] = f32::from_bits(yes.0[i].to_bits() & all | no.0[i].to_bits() & !all);
        }
        out
    }

    #[inline(always)]
    pub fn any(self) -> bool {
        self.0.iter().fold(false, |any, m| any | (*m > 0.5))
    }

    /// eˣ for |x| ≤ 87, to 2e-7: 2ⁿ times the exponential of a remainder of at most ln 2 / 2 by its series.
    #[inline(always)]
    pub fn exp(self) -> Self {
        self.map(exp)
    }
}

#[inline(always)]
fn exp(x: f32) -> f32 {
    // Adding 1.5 · 2²³ leaves the nearest whole number in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let x = if x > -87.0 { x } else { -87.0 };
    let x = if x < 87.0 { x } else { 87.0 };
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    // ln 2 in two parts, so that the product with n is exact.
    let r = (x - n * 0.693_359_4) + n * 2.121_944_4e-4;
    let series = 1.0
        + r * (1.0
            + r * (1.0 / 2.0 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0))))));
    let power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3f80_0000));
    series * power
}

macro_rules! operator {
    ($name:ident, $method:ident, $op:tt) => {
        impl $name for F {
            type Output = Self;
            #[inline(always)]
            fn $method(self, b: Self) -> Self {
                self.zip(b, |a, b| a $op b)
            }
        }
        impl $name<f32> for F {
            type Output = Self;
            #[inline(always)]
            fn $method(self, b: f32) -> Self {
                self.map(|a| a $op b)
            }
        }
    };
}

operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl Neg for F {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

impl AddAssign for F {
    #[inline(always)]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_that_of_the_library() {
        for i in -8700..8700 {
            let x = 0.01 * i as f32;
            assert!((exp(x) / x.exp() - 1.0).abs() < 5e-7, "{x}");
        }
        assert_eq!(exp(0.0), 1.0);
        assert!(exp(-1e30) < 1e-37 && exp(f32::NAN).is_finite());
    }
}
