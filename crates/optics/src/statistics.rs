//! Tests of hypotheses and running moments: chi-square, z, Student's t, Šidák, Welford.

use crate::special::{erfc, erfinv, gamma_q, ln_gamma};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// Probability that a chi-square variable of `dof` degrees of freedom is at least `statistic`.
pub fn chi_square_p_value(statistic: f64, dof: f64) -> f64 {
    gamma_q(0.5 * dof, 0.5 * statistic)
}

/// Significance of each of `tests` independent tests so that all together have significance `alpha`.
/// Šidák 1967: 1 − (1 − α)^(1/n).
pub fn sidak(alpha: f64, tests: usize) -> f64 {
    // ln_1p and exp_m1 keep the digits that 1 − small would lose.
    -((-alpha).ln_1p() / tests.max(1) as f64).exp_m1()
}

/// Φ(z), the cumulative distribution of the standard normal.
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * erfc(-z * FRAC_1_SQRT_2)
}

/// Inverse of [`normal_cdf`].
pub fn normal_quantile(p: f64) -> f64 {
    SQRT_2 * erfinv(2.0 * p - 1.0)
}

/// Two-sided p-value of a standard normal deviate.
pub fn z_p_value(z: f64) -> f64 {
    erfc(z.abs() * FRAC_1_SQRT_2)
}

/// Two-sided p-value of Student's t with `dof` degrees of freedom.
pub fn student_t_p_value(t: f64, dof: f64) -> f64 {
    beta_regularised(0.5 * dof, 0.5, dof / (dof + t * t))
}

/// Regularised incomplete beta function Iₓ(a, b) by its continued fraction (DLMF 8.17.22), modified Lentz.
pub fn beta_regularised(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta_regularised(b, a, 1.0 - x);
    }
    let nonzero = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp() / a;
    let (mut c, mut d) = (1.0, 1.0 / nonzero(1.0 - (a + b) * x / (a + 1.0)));
    let mut h = d;
    for m in 1..10_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let before = h;
        for numerator in [even, odd] {
            d = 1.0 / nonzero(1.0 + numerator * d);
            c = nonzero(1.0 + numerator / c);
            h *= c * d;
        }
        if (h - before).abs() <= 1e-16 * h.abs() {
            break;
        }
    }
    front * h
}

/// Running mean and variance. Welford 1962; merging after Chan, Golub and LeVeque 1979.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: f64,
    mean: f64,
    m2: f64,
}

impl Moments {
    /// Adds one value.
    pub fn push(&mut self, x: f64) {
        self.count += 1.0;
        let delta = x - self.mean;
        self.mean += delta / self.count;
        self.m2 += delta * (x - self.mean);
    }

    /// Adds everything `other` has seen.
    pub fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        if count > 0.0 {
            let delta = other.mean - self.mean;
            self.m2 += other.m2 + delta * delta * self.count * other.count / count;
            self.mean += delta * other.count / count;
            self.count = count;
        }
    }

    /// How many values.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Their mean; 0 where there are none.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased variance of one value; 0 for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.count > 1.0 { self.m2 / (self.count - 1.0) } else { 0.0 }
    }

    /// Standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        if self.count > 0.0 { (self.variance() / self.count).sqrt() } else { 0.0 }
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut m = Self::default();
        values.into_iter().for_each(|x| m.push(x));
        m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: f64, expected: f64, relative: f64) {
        assert!((got - expected).abs() <= relative * expected.abs(), "{got} is not {expected}");
    }

    #[test]
    fn p_values_agree_with_tables() {
        // NIST/SEMATECH e-Handbook 1.3.6.7.4 (chi-square), 1.3.6.7.2 (t), 1.3.6.7.1 (normal).
        near(chi_square_p_value(18.307, 10.0), 0.05, 1e-4);
        near(chi_square_p_value(135.807, 100.0), 0.01, 1e-4);
        near(student_t_p_value(2.228, 10.0), 0.05, 1e-3);
        near(student_t_p_value(63.657, 1.0), 0.01, 1e-4);
        near(z_p_value(1.959963984540054), 0.05, 1e-12);
        near(normal_cdf(1.0), 0.8413447460685429, 1e-14);
        near(normal_quantile(0.975), 1.959963984540054, 1e-13);
        near(beta_regularised(2.0, 3.0, 0.4), 0.5248, 1e-13);
    }

    #[test]
    fn sidak_keeps_the_family_wise_error() {
        near(sidak(0.05, 1), 0.05, 1e-14);
        let each = sidak(0.01, 1_000_000);
        near(1.0 - (1.0 - each).powf(1e6), 0.01, 1e-8);
        near(each, 1.0050335802996816e-8, 1e-12);
    }

    #[test]
    fn moments_do_not_depend_on_how_they_were_gathered() {
        let values: Vec<f64> = (0..1000).map(|i| 1e6 + f64::from(i % 7)).collect();
        let whole: Moments = values.iter().copied().collect();
        let mut merged: Moments = values[..300].iter().copied().collect();
        merged.merge(&values[300..].iter().copied().collect());
        merged.merge(&Moments::default());
        near(whole.mean(), 1e6 + 2.997, 1e-12);
        near(whole.variance(), 3.998989989989989, 1e-9);
        near(merged.variance(), whole.variance(), 1e-9);
        assert_eq!(merged.count(), 1000.0);
        near(whole.standard_error(), (whole.variance() / 1000.0).sqrt(), 1e-12);
    }
}
