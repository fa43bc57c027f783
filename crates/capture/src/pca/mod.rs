//! Nielsen, Jensen and Ramamoorthi 2015, "On Optimal, Minimal BRDF Sampling for Reflectance Acquisition": a basis of
//! measured materials, in which a few readings, or a photograph of a sphere, make a whole table.
//!
//! Each colour channel of each material is a column, each bin of a MERL table that all have a row. The paper maps
//! reflectance ρ to ln((ρ C + ε)/(m + ε)), C = max(cos θ_i cos θ_o, 0.01), ε = 0.001, m the median of the row, and
//! takes the mean of the row away. The median goes out with the mean: what is left is ln(ρ C + ε) less its mean, so
//! that no median is needed here and the numbers are the paper's.
//!
//! A whole database need not fit in memory: rows come in bands ([`Tables`]), and the singular vectors are those of
//! the small matrix YᵀY, columns by columns.

mod build;
mod left_out;
mod linear;
mod optimal;
mod sphere;
#[cfg(test)]
mod tests;

pub use build::build;
pub use left_out::{LeftOut, Report, leave_one_out};
pub use optimal::{Reach, optimal_rows};
pub use sphere::Sphere;

use glam::Vec3;
use linear::ridge;
use std::f32::consts::{FRAC_PI_2, PI};
use yugen_archive::formats::pca_basis::Basis;
use yugen_reflectance::importance::{from_rusinkiewicz, rusinkiewicz};
use yugen_reflectance::merl::{PHI_D, THETA_D, THETA_H, VALUES, bin_centre};

/// Bins of a table.
pub const BINS: usize = VALUES / 3;
/// Keeps the logarithm finite.
const EPSILON: f64 = 0.001;
/// η, the ridge that keeps few readings from saying too much. With the paper's scaling of the components, its value.
pub const RIDGE: f64 = 40.0;
/// Rows worked on at a time: half of the bins of one θ_h.
const BAND: usize = THETA_D * PHI_D / 2;

/// Measured tables, read by bands.
pub trait Tables: Sync {
    /// Why a table cannot be read.
    type Error: Send;

    /// How many.
    fn count(&self) -> usize;

    /// f in 1/sr, linear RGB, of the bins of a material from `first`, θ_h slowest and φ_d fastest; negative or not
    /// finite where there is none.
    fn read(&self, material: usize, first: usize, rgb: &mut [f32]) -> Result<(), Self::Error>;
}

/// wo and wi at the centre of a bin.
pub fn directions_of(bin: usize) -> (Vec3, Vec3) {
    let [h, d, p] = bin_centre(bin / (THETA_D * PHI_D), bin / PHI_D % THETA_D, bin % PHI_D);
    from_rusinkiewicz(h, d, p)
}

/// The bin of a pair of directions.
pub fn bin_of(wo: Vec3, wi: Vec3) -> usize {
    let a = rusinkiewicz(wo, wi);
    let cell = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
    let phi = a.z / PI;
    let (h, d) = (cell((a.x / FRAC_PI_2).sqrt(), THETA_H), cell(a.y / FRAC_PI_2, THETA_D));
    (h * THETA_D + d) * PHI_D + cell(phi - phi.floor(), PHI_D)
}

/// C of a bin; `None` where a direction lies below the surface.
fn cosines(bin: usize) -> Option<f64> {
    let (wo, wi) = directions_of(bin);
    (wo.z > 0.0 && wi.z > 0.0).then(|| f64::from(wo.z * wi.z).clamp(0.01, 1.0))
}
/// Where the row of a bin is; the nearest bin in φ_d or θ_d of the same θ_h if it has none.
pub fn row_of(basis: &Basis, bin: usize) -> Option<usize> {
    let find = |bin: usize| basis.bins.binary_search(&(bin as u32)).ok();
    find(bin).or_else(|| {
        let (h, d, p) = (bin / (THETA_D * PHI_D), bin / PHI_D % THETA_D, bin % PHI_D);
        (1..4usize).find_map(|r| {
            let near =
                [(d, (p + r) % PHI_D), (d, (p + PHI_D - r) % PHI_D), (d.saturating_sub(r), p), (d + r, p)];
            near.into_iter()
                .filter(|(d, _)| *d < THETA_D)
                .find_map(|(d, p)| find((h * THETA_D + d) * PHI_D + p))
        })
    })
}
/// A reading at a row of a basis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Row.
    pub row: usize,
    /// f in 1/sr, linear RGB.
    pub f: Vec3,
}

/// What a table is in a basis: the coefficients of its red, green and blue channel, so many as the basis has
/// components. `rgb` is f in 1/sr of all bins, [`VALUES`] numbers; a row that the table lacks counts as the mean.
///
/// # Panics
/// If `rgb` is shorter.
pub fn coefficients(basis: &Basis, rgb: &[f32]) -> [Vec<f64>; 3] {
    let k = basis.components;
    let mut all: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; k]);
    for (row, &bin) in basis.bins.iter().enumerate() {
        let cosine = cosines(bin as usize).unwrap_or(1.0);
        let q = &basis.q[row * k..][..k];
        for (sums, f) in all.iter_mut().zip(&rgb[3 * bin as usize..][..3]) {
            if !(f.is_finite() && *f >= 0.0) {
                continue;
            }
            let y = (f64::from(*f) * cosine + EPSILON).ln() - f64::from(basis.mean[row]);
            sums.iter_mut().zip(q).for_each(|(s, q)| *s += f64::from(*q) * y);
        }
    }
    // Components are orthogonal, as long as their singular values.
    for sums in &mut all {
        sums.iter_mut().zip(&basis.singular).for_each(|(s, sigma)| *s /= f64::from(*sigma).powi(2));
    }
    all
}

/// The table that fits the observations best, as [`VALUES`] numbers in the order of MERL, −1 where the basis has no
/// row; with the ridge `eta` and the first `components` of the basis (readings as few as these need no more).
///
/// # Panics
/// If the basis has fewer components, or a row is not its.
pub fn reconstruct(basis: &Basis, observations: &[Observation], components: usize, eta: f64) -> Vec<f32> {
    let (k, all) = (components, basis.components);
    assert!(k <= all);
    let a: Vec<f64> =
        observations.iter().flat_map(|o| basis.q[o.row * all..][..k].iter().map(|v| f64::from(*v))).collect();
    let cosine = |row: usize| cosines(basis.bins[row] as usize).unwrap_or(1.0);
    let coefficients: [Vec<f64>; 3] = std::array::from_fn(|channel| {
        let y: Vec<f64> = observations
            .iter()
            .map(|o| {
                let x = f64::from(o.f[channel].max(0.0)) * cosine(o.row);
                (x + EPSILON).ln() - f64::from(basis.mean[o.row])
            })
            .collect();
        ridge(&a, &y, k, eta)
    });
    expand(basis, &coefficients)
}

/// The table that coefficients of the first components mean, one list a colour channel, each as long as the others: as
/// [`VALUES`] numbers in the order of MERL, −1 where the basis has no row. A coefficient of a table of the basis has a
/// mean square, over all columns, of one over their number.
///
/// # Panics
/// If there are more coefficients than components.
pub fn expand(basis: &Basis, coefficients: &[Vec<f64>; 3]) -> Vec<f32> {
    let (k, all) = (coefficients[0].len(), basis.components);
    assert!(k <= all);
    let cosine = |row: usize| cosines(basis.bins[row] as usize).unwrap_or(1.0);
    let mut values = vec![-1.0; VALUES];
    for (row, &bin) in basis.bins.iter().enumerate() {
        let (q, c) = (&basis.q[row * all..][..k], cosine(row));
        for (to, coefficients) in values[3 * bin as usize..].iter_mut().zip(coefficients) {
            let y: f64 = q.iter().zip(coefficients).map(|(q, c)| f64::from(*q) * c).sum();
            *to = (((y + f64::from(basis.mean[row])).exp() - EPSILON).max(0.0) / c) as f32;
        }
    }
    values
}
