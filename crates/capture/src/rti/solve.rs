//! Small dense systems, row by row in a slice.

/// Cholesky's factor L of the symmetric, positive definite `a` (n x n), in its lower triangle; `None` where it is
/// not positive definite.
pub fn cholesky(mut a: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            let rest = a[i * n + j] - dot;
            if i == j {
                if rest.is_nan() || rest <= 0.0 {
                    return None;
                }
                a[i * n + i] = rest.sqrt();
            } else {
                a[i * n + j] = rest / a[j * n + j];
            }
        }
    }
    Some(a)
}

/// Solves L Lᵀ x = b in place.
pub fn cholesky_solve(l: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| l[i * n + k] * b[k]).sum();
        b[i] = (b[i] - dot) / l[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| l[k * n + i] * b[k]).sum();
        b[i] = (b[i] - dot) / l[i * n + i];
    }
}

/// The inverse of `a` (n x n) by elimination with row pivots; `None` where it is singular to working precision.
pub fn inverse(mut a: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    let largest = a.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut inverse = vec![0.0; n * n];
    (0..n).for_each(|i| inverse[i * n + i] = 1.0);
    for column in 0..n {
        let pivot = (column..n).max_by(|p, q| a[p * n + column].abs().total_cmp(&a[q * n + column].abs()))?;
        // Rounding leaves about 1e-16 of the largest entry where there should be nothing.
        if a[pivot * n + column].abs() <= 1e-13 * largest {
            return None;
        }
        for k in 0..n {
            a.swap(column * n + k, pivot * n + k);
            inverse.swap(column * n + k, pivot * n + k);
        }
        let scale = 1.0 / a[column * n + column];
        for k in 0..n {
            a[column * n + k] *= scale;
            inverse[column * n + k] *= scale;
        }
        for row in (0..n).filter(|r| *r != column) {
            let factor = a[row * n + column];
            if factor != 0.0 {
                for k in 0..n {
                    a[row * n + k] -= factor * a[column * n + k];
                    inverse[row * n + k] -= factor * inverse[column * n + k];
                }
            }
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    #[test]
    fn systems_are_solved_and_singular_ones_told() {
        let n = 7;
        let mut rng = Pcg32::new(1, 2);
        let b: Vec<f64> = (0..n * n).map(|_| f64::from(rng.next_f32()) - 0.5).collect();
        let times = |p: &[f64], q: &[f64]| -> Vec<f64> {
            (0..n * n).map(|i| (0..n).map(|k| p[i / n * n + k] * q[k * n + i % n]).sum()).collect()
        };
        let product = times(&b, &inverse(b.clone(), n).unwrap());
        assert!(
            product
                .iter()
                .enumerate()
                .all(|(i, v)| (v - f64::from(u8::from(i % (n + 1) == 0))).abs() < 1e-11)
        );
        let transposed: Vec<f64> = (0..n * n).map(|i| b[i % n * n + i / n]).collect();
        let spd = times(&b, &transposed);
        let x: Vec<f64> = (0..n).map(|i| i as f64 - 2.0).collect();
        let mut y: Vec<f64> = (0..n).map(|i| (0..n).map(|k| spd[i * n + k] * x[k]).sum()).collect();
        cholesky_solve(&cholesky(spd.clone(), n).unwrap(), n, &mut y);
        assert!(y.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-9), "{y:?}");
        let mut singular = b;
        singular.copy_within(0..n, n);
        assert!(inverse(singular, n).is_none());
        assert!(cholesky(spd.iter().map(|v| -v).collect(), n).is_none());
    }
}
