//! Symmetric positive definite systems, dense and small.

/// Solves A x = b by Cholesky's factorisation of the lower half of A (n by n, row after row), which it overwrites; `None`
/// where A is not positive definite.
pub(super) fn solve_spd(a: &mut [f64], mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for i in 0..n {
        let (above, rows) = a.split_at_mut(i * n);
        let row = &mut rows[..n];
        for j in 0..i {
            let other = &above[j * n..j * n + n];
            let dot: f64 = row[..j].iter().zip(&other[..j]).map(|(x, y)| x * y).sum();
            row[j] = (row[j] - dot) / other[j];
        }
        let left = row[i] - row[..i].iter().map(|x| x * x).sum::<f64>();
        if left <= 0.0 || left.is_nan() {
            return None;
        }
        row[i] = left.sqrt();
    }
    for i in 0..n {
        let dot: f64 = (0..i).map(|j| a[i * n + j] * b[j]).sum();
        b[i] = (b[i] - dot) / a[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|j| a[j * n + i] * b[j]).sum();
        b[i] = (b[i] - dot) / a[i * n + i];
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_solved_and_one_that_is_none_is_not() {
        // B Bᵀ with B = (1 0 0, 2 1 0, -1 3 2).
        let a = [1.0, 2.0, -1.0, 2.0, 5.0, 1.0, -1.0, 1.0, 14.0];
        let want = [0.5, -2.0, 3.0];
        let b = (0..3).map(|i| (0..3).map(|j| a[3 * i + j] * want[j]).sum()).collect();
        let got = solve_spd(&mut a.clone(), b).unwrap();
        assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 1e-12), "{got:?}");
        assert!(solve_spd(&mut [1.0, 2.0, 2.0, 1.0], vec![1.0; 2]).is_none());
        assert!(solve_spd(&mut [f64::NAN], vec![1.0]).is_none());
    }
}
