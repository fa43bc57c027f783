//! Special functions used by normalisers, samplers and tests of hypotheses.
//!
//! `f64` throughout, accurate to about 1e-13 relative unless the text says otherwise; the `_f32` forms are
//! the fast ones for samplers.

use std::f64::consts::{FRAC_2_SQRT_PI, PI};

/// Euler-Mascheroni constant γ.
pub const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// Hermite's cubic from 0 to 1 between the edges `a` and `b`, as the shaders' function of this name.
pub fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Error function, 2/√π ∫₀ˣ exp(−t²) dt.
pub fn erf(x: f64) -> f64 {
    libm::erf(x)
}

/// Complementary error function 1 − erf(x), without cancellation for large x.
pub fn erfc(x: f64) -> f64 {
    libm::erfc(x)
}

/// Scaled complementary error function exp(x²) erfc(x); does not underflow for large positive x.
pub fn erfcx(x: f64) -> f64 {
    if x < 10.0 {
        return (x * x).exp() * erfc(x);
    }
    // Laplace's continued fraction (DLMF 7.9.1), evaluated backwards; 20 terms reach 1e-16 from x = 10 on.
    let tail = (1..=20).rev().fold(0.0, |t, k| 0.5 * f64::from(k) / (x + t));
    0.5 * FRAC_2_SQRT_PI / (x + tail)
}

/// Inverse of [`erf`]; ±∞ at ±1 and NaN outside.
pub fn erfinv(y: f64) -> f64 {
    if y.abs() >= 1.0 {
        return if y.abs() > 1.0 { f64::NAN } else { y * f64::INFINITY };
    }
    let mut x = giles(y, -((1.0 - y) * (1.0 + y)).ln());
    // Two Halley steps on erf(x) = y; erfc keeps the residual exact near the ends.
    for _ in 0..2 {
        let residual =
            if y.abs() < 0.5 { erf(x) - y } else { y.signum() * ((1.0 - y.abs()) - erfc(x.abs())) };
        let newton = residual / (FRAC_2_SQRT_PI * (-x * x).exp());
        x -= newton / (1.0 + x * newton);
    }
    x
}

/// Giles 2012, "Approximating the erfinv function", single-precision polynomial (GPU Computing Gems 2).
fn giles(y: f64, w: f64) -> f64 {
    const CENTRE: [f64; 9] = [
        2.81022636e-08,
        3.43273939e-07,
        -3.5233877e-06,
        -4.39150654e-06,
        0.00021858087,
        -0.00125372503,
        -0.00417768164,
        0.246640727,
        1.50140941,
    ];
    const TAIL: [f64; 9] = [
        -0.000200214257,
        0.000100950558,
        0.00134934322,
        -0.00367342844,
        0.00573950773,
        -0.0076224613,
        0.00943887047,
        1.00167406,
        2.83297682,
    ];
    let (table, v) = if w < 5.0 { (CENTRE, w - 2.5) } else { (TAIL, w.sqrt() - 3.0) };
    y * table.into_iter().fold(0.0, |p, c| p * v + c)
}

/// Fast [`erf`] for samplers: absolute error below 5e-7. Abramowitz and Stegun 7.1.26.
pub fn erf_f32(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.3275911 * x.abs());
    let poly =
        ((((1.061405429 * t - 1.453152027) * t + 1.421413741) * t - 0.284496736) * t + 0.254829592) * t;
    (1.0 - poly * (-x * x).exp()).copysign(x)
}

/// Fast [`erfinv`] for samplers: relative error below 2e-6; finite at ±1 (clamped to the last `f32` inside).
/// Giles 2012.
pub fn erfinv_f32(y: f32) -> f32 {
    let y = y.clamp(-1.0 + f32::EPSILON / 2.0, 1.0 - f32::EPSILON / 2.0);
    let w = -((1.0 - y) * (1.0 + y)).ln();
    let horner = |table: [f32; 9], v: f32| table.into_iter().fold(0.0, |p, c| p * v + c);
    if w < 5.0 {
        let table = [
            2.810_226_4e-8,
            3.432_739_4e-7,
            -3.523_387_7e-6,
            -4.391_506_5e-6,
            0.000_218_580_87,
            -0.001_253_725,
            -0.004_177_681_6,
            0.246_640_73,
            1.501_409_4,
        ];
        y * horner(table, w - 2.5)
    } else {
        let table = [
            -0.000_200_214_26,
            0.000_100_950_56,
            0.001_349_343_2,
            -0.003_673_428_4,
            0.005_739_507_7,
            -0.007_622_461_3,
            0.009_438_870_5,
            1.001_674,
            2.832_976_8,
        ];
        y * horner(table, w.sqrt() - 3.0)
    }
}

/// ln |Γ(x)|.
pub fn ln_gamma(x: f64) -> f64 {
    libm::lgamma(x)
}

/// Regularised lower incomplete gamma function P(a, x), a > 0, x ≥ 0.
pub fn gamma_p(a: f64, x: f64) -> f64 {
    if x < a + 1.0 { gamma_series(a, x) } else { 1.0 - gamma_fraction(a, x) }
}

/// Regularised upper incomplete gamma function Q(a, x) = 1 − P(a, x), a > 0, x ≥ 0.
pub fn gamma_q(a: f64, x: f64) -> f64 {
    if x < a + 1.0 { 1.0 - gamma_series(a, x) } else { gamma_fraction(a, x) }
}

/// P(a, x) by its power series (DLMF 8.7.1); converges fast for x < a + 1.
fn gamma_series(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
    while term > sum * 1e-17 {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    sum * (a * x.ln() - x - ln_gamma(a)).exp()
}

/// Q(a, x) by Legendre's continued fraction (DLMF 8.9.2), modified Lentz; converges fast for x > a + 1.
fn gamma_fraction(a: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut h = d;
    // √a terms are enough near the diagonal; the bound only guards against NaN input.
    for i in 1..100_000 {
        let i = f64::from(i);
        let an = i * (a - i);
        b += 2.0;
        d = 1.0 / nonzero(an * d + b, TINY);
        c = nonzero(b + an / c, TINY);
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-16 {
            break;
        }
    }
    h * (a * x.ln() - x - ln_gamma(a)).exp()
}

fn nonzero(x: f64, tiny: f64) -> f64 {
    if x.abs() < tiny { tiny } else { x }
}

/// Modified Bessel function of the first kind, order zero, scaled: exp(−|x|) I₀(x).
pub fn bessel_i0e(x: f64) -> f64 {
    let x = x.abs();
    if x < 30.0 {
        // Power series (DLMF 10.25.2): all terms positive, so no cancellation.
        let q = 0.25 * x * x;
        let (mut term, mut sum, mut k) = (1.0, 1.0, 0.0);
        while term > sum * 1e-17 {
            k += 1.0;
            term *= q / (k * k);
            sum += term;
        }
        return sum * (-x).exp();
    }
    // Hankel's expansion (DLMF 10.40.1); from x = 30 on its terms fall below 1e-16 before they grow.
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..=30 {
        let odd = f64::from(2 * k - 1);
        term *= odd * odd / (8.0 * f64::from(k) * x);
        sum += term;
        if term < 1e-17 {
            break;
        }
    }
    sum / (2.0 * PI * x).sqrt()
}

/// Modified Bessel function of the first kind, order zero. Overflows beyond |x| = 713: see [`ln_bessel_i0`].
pub fn bessel_i0(x: f64) -> f64 {
    bessel_i0e(x) * x.abs().exp()
}

/// ln I₀(x), finite for every finite x.
pub fn ln_bessel_i0(x: f64) -> f64 {
    x.abs() + bessel_i0e(x).ln()
}

/// Exponential integral E₁(x) = ∫ₓ^∞ exp(−t)/t dt, x > 0; ∞ at 0.
pub fn exp_integral_e1(x: f64) -> f64 {
    if x <= 0.0 {
        return if x == 0.0 { f64::INFINITY } else { f64::NAN };
    }
    if x < 1.0 {
        // DLMF 6.6.2.
        let (mut term, mut sum, mut k) = (1.0, 0.0, 0.0);
        loop {
            k += 1.0;
            term *= -x / k;
            sum -= term / k;
            if term.abs() < 1e-18 {
                break;
            }
        }
        return sum - EULER_GAMMA - x.ln();
    }
    // DLMF 6.9.1 as an even fraction, evaluated backwards; 120 levels reach 1e-15 at x = 1.
    let tail = (1..=120).rev().fold(0.0, |t, k| {
        let k = f64::from(k);
        k * k / (x + 2.0 * k + 1.0 - t)
    });
    (-x).exp() / (x + 1.0 - tail)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: f64, expected: f64, relative: f64) {
        assert!((got - expected).abs() <= relative * expected.abs(), "{got} is not {expected}");
    }

    #[test]
    fn error_functions_agree_with_published_values() {
        // Abramowitz and Stegun, tables 7.1 and 7.3.
        near(erf(0.5), 0.5204998778, 1e-10);
        near(erf(1.0), 0.8427007929497149, 1e-15);
        near(erf(2.0), 0.9953222650189527, 1e-15);
        near(erfc(3.0), 2.209049699858544e-5, 1e-14);
        // scipy.special.erfcx.
        near(erfcx(1.0), 0.427583576155807, 1e-14);
        near(erfcx(9.9999), 0.05614154868052325, 1e-12);
        near(erfcx(10.0), 0.056140992743822586, 1e-14);
        near(erfcx(1000.0), 0.0005641893014533876, 1e-14);
        near(erfcx(-2.0), 108.9409043899779, 1e-13);
        assert!(erfcx(40.0) > 0.0);
    }

    #[test]
    fn erfinv_inverts_erf_over_the_whole_range() {
        near(erfinv(0.5), 0.4769362762044699, 1e-15);
        near(erfinv(0.99), 1.8213863677184496, 1e-14);
        near(erfinv(1.0 - 1e-12), 5.042031898572696, 1e-9);
        for i in -999..1000 {
            let y = f64::from(i) / 1000.0;
            assert!((erf(erfinv(y)) - y).abs() < 1e-15, "{y}");
        }
        assert_eq!(erfinv(1.0), f64::INFINITY);
        assert!(erfinv(1.5).is_nan());
    }

    #[test]
    fn fast_forms_stay_within_their_promise() {
        let mut worst = (0.0f64, 0.0f64);
        for i in -6000..=6000 {
            let x = i as f32 / 1000.0;
            worst.0 = worst.0.max((f64::from(erf_f32(x)) - erf(f64::from(x))).abs());
            let y = i as f32 / 6001.0;
            let exact = erfinv(f64::from(y));
            worst.1 = worst.1.max((f64::from(erfinv_f32(y)) - exact).abs() / exact.abs().max(1e-9));
        }
        assert!(worst.0 < 5e-7 && worst.1 < 2e-6, "{worst:?}");
        assert!(erfinv_f32(1.0).is_finite() && erfinv_f32(-1.0).is_finite());
    }

    #[test]
    fn gamma_family_agrees_with_published_values() {
        near(ln_gamma(0.5), 0.5723649429247001, 1e-15);
        near(ln_gamma(101.0), 363.73937555556347, 1e-15);
        // P(a, x) from DLMF 8.11 relations and scipy.special.gammainc.
        near(gamma_p(1.0, 2.0), 1.0 - (-2f64).exp(), 1e-15);
        near(gamma_p(0.5, 1.0), erf(1.0), 1e-14);
        near(gamma_q(0.5, 4.0), erfc(2.0), 1e-13);
        near(gamma_q(500.0, 550.0), 0.014614408126295192, 1e-12);
        near(gamma_q(3.0, 10.0), 0.0027693957155115775, 1e-13);
        assert_eq!(gamma_q(3.0, 0.0), 1.0);
    }

    #[test]
    fn bessel_and_exponential_integral_agree_with_published_values() {
        // Abramowitz and Stegun, tables 9.8 and 5.1; scipy.special.
        near(bessel_i0(1.0), 1.2660658777520084, 1e-15);
        near(bessel_i0(10.0), 2815.716628466254, 1e-14);
        near(bessel_i0e(29.999), 0.0731471761291321, 1e-14);
        near(bessel_i0e(30.0), 0.07314594648223727, 1e-14);
        near(bessel_i0e(1000.0), 0.012617240455891257, 1e-14);
        near(ln_bessel_i0(1e6), 1e6 + bessel_i0e(1e6).ln(), 1e-15);
        near(exp_integral_e1(0.1), 1.8229239584193906, 1e-14);
        near(exp_integral_e1(0.999999), 0.21938430227532935, 1e-14);
        near(exp_integral_e1(1.0), 0.21938393439552029, 1e-14);
        near(exp_integral_e1(5.0), 0.001148295591275326, 1e-14);
        assert_eq!(exp_integral_e1(0.0), f64::INFINITY);
    }
}
