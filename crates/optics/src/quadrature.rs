//! Deterministic integration.

/// Nodes and weights of Gauss-Legendre quadrature with `n` points on [a, b]; exact for polynomials of
/// degree 2n − 1. Newton iteration on the Legendre recurrence.
pub fn gauss_legendre(n: usize, a: f64, b: f64) -> Vec<(f64, f64)> {
    let (mid, half) = (0.5 * (a + b), 0.5 * (b - a));
    (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut p0, mut p1) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
                }
                if n == 0 {
                    break;
                }
                slope = n as f64 * (x * p1 - p0) / (x * x - 1.0);
                let step = p1 / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (mid - half * x, half * 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// ∫ g(x) dx over [a, b] by `n`-point Gauss-Legendre.
pub fn integrate(n: usize, a: f64, b: f64, g: impl Fn(f64) -> f64) -> f64 {
    gauss_legendre(n, a, b).into_iter().map(|(x, w)| w * g(x)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_polynomials_exactly_and_the_exponential_well() {
        for n in 1..40 {
            let degree = 2 * n - 1;
            let got = integrate(n, 0.0, 1.0, |x| x.powi(degree as i32));
            assert!((got * (degree as f64 + 1.0) - 1.0).abs() < 1e-12, "{n}: {got}");
        }
        assert!((integrate(12, -1.0, 2.0, f64::exp) - (2f64.exp() - (-1f64).exp())).abs() < 1e-13);
    }
}
