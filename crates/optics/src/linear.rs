//! Small dense systems of equations, row by row in a slice.

/// Cholesky's factor L of the symmetric, positive definite `a` (n x n), in its lower triangle; `None` where it is
/// not positive definite.
pub fn cholesky(mut a: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    for i in 0..n {
        let (above, rows) = a.split_at_mut(i * n);
        let row = &mut rows[..n];
        for j in 0..i {
            let other = &above[j * n..j * n + n];
            let dot: f64 = row[..j].iter().zip(&other[..j]).map(|(x, y)| x * y).sum();
            row[j] = (row[j] - dot) / other[j];
        }
        let rest = row[i] - row[..i].iter().map(|x| x * x).sum::<f64>();
        if rest.is_nan() || rest <= 0.0 {
            return None;
        }
        row[i] = rest.sqrt();
    }
    Some(a)
}

/// Solves A x = b of a symmetric, positive definite `a` by its lower triangle; `None` where it is not positive definite.
pub fn solve_spd(a: Vec<f64>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    cholesky_solve(&cholesky(a, n)?, n, &mut b);
    Some(b)
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
    use crate::random::Pcg32;

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

    #[test]
    fn a_system_is_solved_and_one_that_is_none_is_not() {
        // B Bᵀ with B = (1 0 0, 2 1 0, -1 3 2).
        let a = vec![1.0, 2.0, -1.0, 2.0, 5.0, 1.0, -1.0, 1.0, 14.0];
        let want = [0.5, -2.0, 3.0];
        let b = (0..3).map(|i| (0..3).map(|j| a[3 * i + j] * want[j]).sum()).collect();
        let got = solve_spd(a, b).unwrap();
        assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 1e-12), "{got:?}");
        assert!(solve_spd(vec![1.0, 2.0, 2.0, 1.0], vec![1.0; 2]).is_none());
        assert!(solve_spd(vec![f64::NAN], vec![1.0]).is_none());
    }
}
