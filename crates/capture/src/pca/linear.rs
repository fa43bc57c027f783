//! The linear algebra of a basis, on matrices row by row.

use nalgebra::{DMatrix, SymmetricEigen};

/// C = Aᵀ B + C where A is k x m, B k x n, C m x n, row by row; or, with `straight`, A is m x k.
pub fn multiply(straight: bool, m: usize, k: usize, n: usize, a: &[f64], b: &[f64], c: &mut [f64]) {
    assert!(a.len() == m * k && b.len() == k * n && c.len() == m * n);
    let (rsa, csa) = if straight { (k as isize, 1) } else { (1, m as isize) };
    // SAFETY: the lengths above are what the strides reach; c is borrowed alone.
    #[allow(unsafe_code)]
    unsafe {
        let (a, b, c) = (a.as_ptr(), b.as_ptr(), c.as_mut_ptr());
        matrixmultiply::dgemm(m, k, n, 1.0, a, rsa, csa, b, n as isize, 1, 1.0, c, n as isize, 1);
    }
}

/// Eigenvalues of a symmetric matrix, falling and never negative, and the eigenvectors as columns.
pub fn eigen(a: &[f64], n: usize) -> (Vec<f64>, Vec<f64>) {
    if n == 0 {
        return (Vec::new(), Vec::new());
    }
    let SymmetricEigen { eigenvalues: found, eigenvectors: v } =
        DMatrix::from_row_slice(n, n, a).symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| found[j].total_cmp(&found[i]));
    let values = order.iter().map(|&i| found[i].max(0.0)).collect();
    // The first number of each vector that is not small is positive, so that signs are settled.
    let signs: Vec<f64> = order
        .iter()
        .map(|&i| {
            let largest = v.column(i).amax();
            v.column(i).iter().find(|x| x.abs() > 0.5 * largest).map_or(1.0, |x| x.signum())
        })
        .collect();
    let vectors = (0..n * n).map(|at| signs[at % n] * v[(at / n, order[at % n])]).collect();
    (values, vectors)
}

/// argmin |A c − y|² + η |c|² for A of `k` columns, row by row.
pub fn ridge(a: &[f64], y: &[f64], k: usize, eta: f64) -> Vec<f64> {
    let n = y.len();
    let mut normal = vec![0.0; k * k];
    multiply(false, k, n, k, a, a, &mut normal);
    let mut right = vec![0.0; k];
    multiply(false, k, n, 1, a, y, &mut right);
    (0..k).for_each(|i| normal[i * k + i] += eta);
    // By the eigenvectors: never fails, and k is small.
    let (values, vectors) = eigen(&normal, k);
    let mut c = vec![0.0; k];
    for (j, value) in values.iter().enumerate().filter(|(_, v)| **v > 0.0) {
        let along = (0..k).map(|i| vectors[i * k + j] * right[i]).sum::<f64>() / value;
        (0..k).for_each(|i| c[i] += along * vectors[i * k + j]);
    }
    c
}
