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

use crate::parallel::parallel;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};
use std::ops::Range;
use yugen_archive::formats::pca_basis::Basis;
use yugen_optics::Frame;
use yugen_optics::random::Pcg32;
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

/// Rows of all columns, less their means.
struct Rows {
    bins: Vec<u32>,
    mean: Vec<f64>,
    /// Row by row.
    values: Vec<f64>,
}

fn rows<T: Tables>(tables: &T, bins: Range<usize>, wanted: impl Fn(usize) -> bool) -> Result<Rows, T::Error> {
    let (n, columns) = (bins.len(), 3 * tables.count());
    let mut all = vec![0.0f32; n * columns];
    for (m, rgb) in all.chunks_exact_mut(3 * n).enumerate() {
        tables.read(m, bins.start, rgb)?;
    }
    let mut out = Rows { bins: Vec::new(), mean: Vec::new(), values: Vec::new() };
    for i in 0..n {
        let bin = bins.start + i;
        let cell = |m: usize| &all[3 * (m * n + i)..][..3];
        let valid = || (0..tables.count()).all(|m| cell(m).iter().all(|v| v.is_finite() && *v >= 0.0));
        let Some(c) = cosines(bin).filter(|_| wanted(bin) && valid()) else { continue };
        let start = out.values.len();
        out.values.extend(
            (0..tables.count()).flat_map(|m| cell(m).iter().map(|v| (f64::from(*v) * c + EPSILON).ln())),
        );
        let mean = out.values[start..].iter().sum::<f64>() / columns as f64;
        out.values[start..].iter_mut().for_each(|v| *v -= mean);
        out.bins.push(bin as u32);
        out.mean.push(mean);
    }
    Ok(out)
}

/// C = Aᵀ B + C where A is k x m, B k x n, C m x n, row by row; or, with `straight`, A is m x k.
fn multiply(straight: bool, m: usize, k: usize, n: usize, a: &[f64], b: &[f64], c: &mut [f64]) {
    assert!(a.len() == m * k && b.len() == k * n && c.len() == m * n);
    let (rsa, csa) = if straight { (k as isize, 1) } else { (1, m as isize) };
    // SAFETY: the lengths above are what the strides reach; c is borrowed alone.
    #[allow(unsafe_code)]
    unsafe {
        let (a, b, c) = (a.as_ptr(), b.as_ptr(), c.as_mut_ptr());
        matrixmultiply::dgemm(m, k, n, 1.0, a, rsa, csa, b, n as isize, 1, 1.0, c, n as isize, 1);
    }
}

/// Eigenvalues of a symmetric matrix, falling, and the eigenvectors as columns (row by row). Jacobi 1846, cyclic by
/// rows; overwrites the matrix.
fn eigen(a: &mut [f64], n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut v = vec![0.0; n * n];
    (0..n).for_each(|i| v[i * n + i] = 1.0);
    let total: f64 = a.iter().map(|x| x * x).sum();
    for _ in 0..60 {
        let off: f64 = (0..n).map(|i| (0..i).map(|j| a[i * n + j] * a[i * n + j]).sum::<f64>()).sum();
        if off <= 1e-30 * total {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                let apq = a[p * n + q];
                if apq * apq <= 1e-32 * (a[p * n + p] * a[q * n + q]).abs() {
                    continue;
                }
                let theta = (a[q * n + q] - a[p * n + p]) / (2.0 * apq);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                // The matrix stays symmetric, so that its rows stand for its columns.
                let turn = |m: &mut [f64]| {
                    let (head, tail) = m.split_at_mut(q * n);
                    for (x, y) in head[p * n..(p + 1) * n].iter_mut().zip(&mut tail[..n]) {
                        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                    }
                };
                turn(a);
                for k in 0..n {
                    let (x, y) = (a[k * n + p], a[k * n + q]);
                    (a[k * n + p], a[k * n + q]) = (c * x - s * y, s * x + c * y);
                }
                turn(&mut v);
            }
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| a[j * n + j].total_cmp(&a[i * n + i]));
    let values = order.iter().map(|&i| a[i * n + i].max(0.0)).collect();
    // Rows of v are the vectors; the first number of each that is not small is positive, so that signs are settled.
    let signs: Vec<f64> = order
        .iter()
        .map(|&i| {
            let row = &v[i * n..(i + 1) * n];
            let largest = row.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            row.iter().find(|x| x.abs() > 0.5 * largest).map_or(1.0, |x| x.signum())
        })
        .collect();
    let vectors = (0..n * n).map(|at| signs[at % n] * v[order[at % n] * n + at / n]).collect();
    (values, vectors)
}

/// YᵀY over all rows, in a fixed order of sums.
fn gram<T: Tables>(
    tables: &T,
    threads: usize,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Vec<f64>, usize), T::Error> {
    const GROUPS: usize = 20;
    let (columns, bands) = (3 * tables.count(), BINS / BAND);
    let done = std::sync::atomic::AtomicUsize::new(0);
    let parts = parallel(
        threads,
        GROUPS,
        |g| {
            let (mut sum, mut count) = (vec![0.0; columns * columns], 0);
            for band in (g..bands).step_by(GROUPS) {
                let r = rows(tables, band * BAND..(band + 1) * BAND, |_| true)?;
                multiply(false, columns, r.bins.len(), columns, &r.values, &r.values, &mut sum);
                count += r.bins.len();
                let n = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
                progress(n as f64 / bands as f64);
            }
            Ok((sum, count))
        },
        &|_| {},
    );
    let (mut total, mut count) = (vec![0.0; columns * columns], 0);
    for part in parts {
        let (sum, n) = part?;
        total.iter_mut().zip(sum).for_each(|(t, s)| *t += s);
        count += n;
    }
    Ok((total, count))
}

/// The basis of `tables`, which are called `names`, with at most `components` columns. Without rows that all tables
/// have, or without two columns that differ, it is `None`. `progress` hears what part of the work is done.
pub fn build<T: Tables>(
    tables: &T,
    names: &[String],
    components: usize,
    threads: usize,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Option<Basis>, T::Error> {
    let (mut gram, _) = gram(tables, threads, &|x| progress(0.6 * x))?;
    basis(tables, names, components, threads, &mut gram, &|x| progress(0.6 + 0.4 * x))
}

fn basis<T: Tables>(
    tables: &T,
    names: &[String],
    components: usize,
    threads: usize,
    gram: &mut [f64],
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Option<Basis>, T::Error> {
    let (columns, bands) = (3 * tables.count(), BINS / BAND);
    let (values, vectors) = eigen(gram, columns);
    let singular: Vec<f32> = values.iter().map(|v| v.sqrt() as f32).collect();
    // Rounding of the squares leaves a millionth of the largest.
    let real = singular.iter().filter(|s| **s > 1e-6 * singular[0] && **s > 0.0).count();
    let k = components.min(real);
    if k == 0 {
        return Ok(None);
    }
    let turn: Vec<f64> = (0..columns).flat_map(|i| vectors[i * columns..][..k].to_vec()).collect();
    let parts = parallel(
        threads,
        bands,
        |band| {
            let r = rows(tables, band * BAND..(band + 1) * BAND, |_| true)?;
            let mut q = vec![0.0; r.bins.len() * k];
            multiply(true, r.bins.len(), columns, k, &r.values, &turn, &mut q);
            let narrow = |v: Vec<f64>| v.into_iter().map(|x| x as f32).collect::<Vec<f32>>();
            Ok((r.bins, narrow(r.mean), narrow(q)))
        },
        &|done| progress(done as f64 / bands as f64),
    );
    let mut basis = Basis {
        names: names.to_vec(),
        singular,
        bins: Vec::new(),
        mean: Vec::new(),
        components: k,
        q: Vec::new(),
    };
    for part in parts {
        let (bins, mean, q) = part?;
        basis.bins.extend(bins);
        basis.mean.extend(mean);
        basis.q.extend(q);
    }
    Ok(Some(basis))
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

/// Condition of the first `n` components at these rows: the largest singular value over the smallest.
fn condition(basis: &Basis, rows: &[usize], n: usize) -> f64 {
    let m = rows.len();
    let row = |i: usize| &basis.q[rows[i] * basis.components..][..n];
    let dot = |i, j| row(i).iter().zip(row(j)).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    let mut square: Vec<f64> = (0..m * m).map(|at| dot(at / m, at % m)).collect();
    let (values, _) = eigen(&mut square, m);
    if values[m - 1] > 0.0 { (values[0] / values[m - 1]).sqrt() } else { f64::INFINITY }
}

/// Optimal rows for `n` readings: first that of the largest components; then, one after the other, the best of 500 at
/// random by the condition of the first `n` components there, after each of which all take turns to step aside, by
/// three bins and then by one, while that helps. The basis must have `n` components.
///
/// # Panics
/// If it has fewer.
pub fn optimal_rows(basis: &Basis, n: usize, progress: &dyn Fn(f64)) -> Vec<usize> {
    const DRAWS: usize = 500;
    assert!(n <= basis.components);
    let k = basis.components;
    let length = |r: &usize| basis.q[r * k..][..n].iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
    let all = 0..basis.bins.len();
    let Some(first) = all.max_by(|a, b| length(a).total_cmp(&length(b))).filter(|_| n > 0) else {
        return Vec::new();
    };
    let mut rows = vec![first];
    let mut rng = Pcg32::new(2015, 1);
    while rows.len() < n {
        let last = rows.len();
        rows.push(0);
        let mut best = (f64::INFINITY, 0);
        for _ in 0..DRAWS {
            let row = ((u64::from(rng.next_u32()) * basis.bins.len() as u64) >> 32) as usize;
            if rows[..last].contains(&row) {
                continue;
            }
            rows[last] = row;
            let found = condition(basis, &rows, n);
            if found < best.0 {
                best = (found, row);
            }
        }
        rows[last] = best.1;
        let mut found = best.0;
        for step in [3i32, 1] {
            // Until a round changes less than a thousandth of a percent, three times; a bound, in case it never does.
            let mut still = 0;
            for _ in 0..200 {
                let before = found;
                for i in 0..rows.len() {
                    for (axis, sign) in [(0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1)] {
                        let Some(row) = aside(basis, rows[i], axis, sign * step) else { continue };
                        if rows.contains(&row) {
                            continue;
                        }
                        let old = std::mem::replace(&mut rows[i], row);
                        let now = condition(basis, &rows, n);
                        if now < found {
                            found = now;
                        } else {
                            rows[i] = old;
                        }
                    }
                }
                still = if found > before * (1.0 - 1e-5) { still + 1 } else { 0 };
                if still == 3 || found == before {
                    break;
                }
            }
        }
        progress(rows.len() as f64 / n as f64);
    }
    rows
}

/// The row so many bins aside along φ_d (which comes round), θ_h or θ_d.
fn aside(basis: &Basis, row: usize, axis: usize, step: i32) -> Option<usize> {
    let bin = basis.bins[row] as usize;
    let mut at = [bin % PHI_D, bin / (THETA_D * PHI_D), bin / PHI_D % THETA_D].map(|x| x as i32);
    at[axis] += step;
    at[0] = at[0].rem_euclid(PHI_D as i32);
    let inside = (0..THETA_H as i32).contains(&at[1]) && (0..THETA_D as i32).contains(&at[2]);
    let bin = |at: [i32; 3]| ((at[1] as usize * THETA_D + at[2] as usize) * PHI_D + at[0] as usize) as u32;
    if inside { basis.bins.binary_search(&bin(at)).ok() } else { None }
}

/// A reading at a row of a basis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Row.
    pub row: usize,
    /// f in 1/sr, linear RGB.
    pub f: Vec3,
}

/// argmin |A c − y|² + η |c|² for A of `k` columns, row by row.
fn ridge(a: &[f64], y: &[f64], k: usize, eta: f64) -> Vec<f64> {
    let n = y.len();
    let mut normal = vec![0.0; k * k];
    multiply(false, k, n, k, a, a, &mut normal);
    let mut right = vec![0.0; k];
    multiply(false, k, n, 1, a, y, &mut right);
    (0..k).for_each(|i| normal[i * k + i] += eta);
    // By the eigenvectors: never fails, and k is small.
    let (values, vectors) = eigen(&mut normal, k);
    let mut c = vec![0.0; k];
    for (j, value) in values.iter().enumerate().filter(|(_, v)| **v > 0.0) {
        let along = (0..k).map(|i| vectors[i * k + j] * right[i]).sum::<f64>() / value;
        (0..k).for_each(|i| c[i] += along * vectors[i * k + j]);
    }
    c
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
    let mut values = vec![-1.0; VALUES];
    for (row, &bin) in basis.bins.iter().enumerate() {
        let (q, c) = (&basis.q[row * all..][..k], cosine(row));
        for (to, coefficients) in values[3 * bin as usize..].iter_mut().zip(&coefficients) {
            let y: f64 = q.iter().zip(coefficients).map(|(q, c)| f64::from(*q) * c).sum();
            *to = (((y + f64::from(basis.mean[row])).exp() - EPSILON).max(0.0) / c) as f32;
        }
    }
    values
}

/// A photograph of a sphere of the material, seen from so far away that all rays run along −z.
pub struct Sphere<'a> {
    /// Linear RGB, row by row from the top left; not finite where a pixel is not to be used.
    pub pixels: &'a [Vec3],
    /// Pixels across.
    pub width: usize,
    /// Centre in pixels from the top left corner.
    pub centre: (f32, f32),
    /// In pixels.
    pub radius: f32,
    /// Towards the lamp, far away, unit; x right, y up, z to the camera.
    pub light: Vec3,
    /// What a white diffuser that faces the lamp would show.
    pub white: f32,
}

impl Sphere<'_> {
    /// What the photograph says: one observation a row of the basis, the mean of the pixels that see it. Neither
    /// direction is farther than 80 degrees from the normal. Also how many pixels were used.
    pub fn observations(&self, basis: &Basis) -> (Vec<Observation>, usize) {
        const LOWEST: f32 = 0.173_648_18;
        let mut seen = std::collections::BTreeMap::<usize, (Vec3, f32)>::new();
        let mut used = 0;
        for (i, &value) in self.pixels.iter().enumerate() {
            let x = ((i % self.width) as f32 + 0.5 - self.centre.0) / self.radius;
            let y = -((i / self.width) as f32 + 0.5 - self.centre.1) / self.radius;
            let z2 = 1.0 - x * x - y * y;
            if z2 <= LOWEST * LOWEST || !value.is_finite() {
                continue;
            }
            let frame = Frame::from_normal(Vec3::new(x, y, z2.sqrt()));
            let (wo, wi) = (frame.to_local(Vec3::Z), frame.to_local(self.light));
            if wi.z <= LOWEST {
                continue;
            }
            if let Some(row) = row_of(basis, bin_of(wo, wi)) {
                let entry = seen.entry(row).or_insert((Vec3::ZERO, 0.0));
                entry.0 += value / (self.white * PI * wi.z);
                entry.1 += 1.0;
                used += 1;
            }
        }
        (seen.into_iter().map(|(row, (sum, n))| Observation { row, f: sum / n }).collect(), used)
    }
}

/// How well a material is reconstructed by the basis of all others.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Which material.
    pub material: usize,
    /// How many readings; none is the mean of the others.
    pub readings: usize,
    /// √ of the mean square of ln(f C + ε) against the truth.
    pub log_rms: f64,
    /// √Σ w |f cos θ_i − g cos θ_i|^(2/3), as fits have it.
    pub cube_root: f64,
}

/// The report of [`leave_one_out`].
pub struct Report {
    /// Of all materials.
    pub basis: Basis,
    /// The rows of the readings for each of the numbers asked for.
    pub rows: Vec<Vec<usize>>,
    /// Material by material, for each first without a reading, then with the numbers asked for.
    pub errors: Vec<LeftOut>,
}

/// Leaves each material out, makes the basis of the others, and reconstructs it from `numbers` of readings, as many
/// components as readings. The basis is exact: the matrix YᵀY of the others follows from that of all. The directions
/// of the readings are those for all materials.
pub fn leave_one_out<T: Tables>(
    tables: &T,
    names: &[String],
    numbers: &[usize],
    threads: usize,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Option<Report>, T::Error> {
    /// Rows on which errors are measured.
    const JUDGED: usize = 6000;
    let columns = 3 * tables.count();
    let most = numbers.iter().copied().max().unwrap_or(0).min(columns.saturating_sub(3));
    let (gram, count) = gram(tables, threads, &|x| progress(0.3 * x))?;
    let made = basis(tables, names, most.max(1), threads, &mut gram.clone(), &|x| progress(0.3 + 0.2 * x))?;
    let Some(basis) = made else { return Ok(None) };
    let rows_of: Vec<Vec<usize>> = parallel(
        threads,
        numbers.len(),
        |i| optimal_rows(&basis, numbers[i].min(basis.components), &|_| {}),
        &|_| {},
    );
    progress(0.6);

    // The judged rows keep clear of grazing directions, as fits do.
    let lowest = 80f32.to_radians().cos();
    let every = (count / JUDGED).max(1);
    let mut wanted: Vec<u32> = rows_of.iter().flatten().map(|&r| basis.bins[r]).collect();
    let judged: Vec<u32> = basis.bins.iter().copied().skip(every / 2).step_by(every).collect();
    wanted.extend(&judged);
    wanted.sort_unstable();
    wanted.dedup();
    let bands = BINS / BAND;
    let parts = parallel(
        threads,
        bands,
        |b| rows(tables, b * BAND..(b + 1) * BAND, |bin| wanted.binary_search(&(bin as u32)).is_ok()),
        &|done| progress(0.6 + 0.1 * done as f64 / bands as f64),
    );
    let mut some = Rows { bins: Vec::new(), mean: Vec::new(), values: Vec::new() };
    for part in parts {
        let part = part?;
        some.bins.extend(part.bins);
        some.mean.extend(part.mean);
        some.values.extend(part.values);
    }
    let at = |bin: u32| some.bins.binary_search(&bin).unwrap_or_default();
    let places: Vec<Vec<usize>> =
        rows_of.iter().map(|rows| rows.iter().map(|&r| at(basis.bins[r])).collect()).collect();
    let judged: Vec<(usize, f64, f64, f64)> = judged
        .into_iter()
        .filter_map(|bin| {
            let (wo, wi) = directions_of(bin as usize);
            let [h, d, _] = bin_centre(bin as usize / (THETA_D * PHI_D), bin as usize / PHI_D % THETA_D, 0);
            // dω_h dω_d 4 cos θ_d, with θ_h even in its root.
            let weight = f64::from(h.sin() * h.sqrt() * d.sin() * d.cos());
            let cosine = cosines(bin as usize)?;
            (wo.z > lowest && wi.z > lowest).then(|| (at(bin), weight, cosine, f64::from(wi.z)))
        })
        .collect();

    let errors = parallel(
        threads,
        tables.count(),
        |j| {
            let kept: Vec<usize> = (0..columns).filter(|c| c / 3 != j).collect();
            let n = kept.len();
            // Centred anew: H G H with H = 1 − 1/n.
            let mut g: Vec<f64> = kept
                .iter()
                .flat_map(|&a| kept.iter().map(move |&b| (a, b)))
                .map(|(a, b)| gram[a * columns + b])
                .collect();
            let means: Vec<f64> = g.chunks_exact(n).map(|r| r.iter().sum::<f64>() / n as f64).collect();
            let whole = means.iter().sum::<f64>() / n as f64;
            g.iter_mut().enumerate().for_each(|(at, v)| *v += whole - means[at / n] - means[at % n]);
            let (_, vectors) = eigen(&mut g, n);
            let row = |place: usize| &some.values[place * columns..][..columns];
            let mean = |place: usize| kept.iter().map(|&c| row(place)[c]).sum::<f64>() / n as f64;
            let component = |place: usize, mean: f64, k: usize| -> f64 {
                kept.iter().enumerate().map(|(i, &c)| (row(place)[c] - mean) * vectors[i * n + k]).sum()
            };
            let most = most.min(n);
            let prepared: Vec<(f64, Vec<f64>)> = judged
                .iter()
                .map(|&(place, ..)| {
                    let m = mean(place);
                    (m, (0..most).map(|k| component(place, m, k)).collect())
                })
                .collect();
            let mut found = Vec::new();
            for places in std::iter::once(&Vec::new()).chain(&places) {
                let k = places.len().min(most);
                let means: Vec<f64> = places.iter().map(|&p| mean(p)).collect();
                let a: Vec<f64> = places
                    .iter()
                    .zip(&means)
                    .flat_map(|(&p, &m)| (0..k).map(move |c| (p, m, c)))
                    .map(|(p, m, c)| component(p, m, c))
                    .collect();
                let (mut square, mut cube, mut weights) = (0.0, 0.0, 0.0);
                for channel in 0..3 {
                    let column = 3 * j + channel;
                    let y: Vec<f64> = places.iter().zip(&means).map(|(&p, m)| row(p)[column] - m).collect();
                    let c = ridge(&a, &y, k, RIDGE);
                    for (&(place, weight, cosine, cos_i), (m, q)) in judged.iter().zip(&prepared) {
                        let guess = m + q.iter().zip(&c).map(|(q, c)| q * c).sum::<f64>();
                        let truth = row(place)[column];
                        let f =
                            |log: f64| ((log + some.mean[place]).exp() - EPSILON).max(0.0) / cosine * cos_i;
                        square += (guess - truth).powi(2);
                        cube += weight * (f(guess) - f(truth)).abs().powf(2.0 / 3.0);
                        weights += weight;
                    }
                }
                found.push(LeftOut {
                    material: j,
                    readings: places.len(),
                    log_rms: (square / (3 * judged.len()) as f64).sqrt(),
                    cube_root: (cube / weights).sqrt(),
                });
            }
            found
        },
        &|done| progress(0.7 + 0.3 * done as f64 / tables.count() as f64),
    );
    Ok(Some(Report { basis, rows: rows_of, errors: errors.into_iter().flatten().collect() }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_reflectance::microfacet::{d_ggx, v_smith_ggx_correlated};

    /// Lambert under GGX: colour, strength and roughness vary.
    struct Made(usize);

    fn made(material: usize, wo: Vec3, wi: Vec3) -> Vec3 {
        let x = |k: f32| (0.3 + k * material as f32).fract();
        let (alpha, strength) = (0.08 + 0.4 * x(0.618), 0.03 + 0.5 * x(0.755));
        let h = (wo + wi).normalize();
        let base = Vec3::new(x(0.31), x(0.83), x(0.57)) * 0.25 + 0.01;
        base + strength * d_ggx(h, alpha, alpha) * v_smith_ggx_correlated(wo, wi, alpha, alpha)
    }

    impl Tables for Made {
        type Error = std::convert::Infallible;

        fn count(&self) -> usize {
            self.0
        }

        fn read(&self, material: usize, first: usize, rgb: &mut [f32]) -> Result<(), Self::Error> {
            for (i, to) in rgb.chunks_exact_mut(3).enumerate() {
                let (wo, wi) = directions_of(first + i);
                let f = if wo.z > 0.0 && wi.z > 0.0 { made(material, wo, wi) } else { Vec3::NEG_ONE };
                to.copy_from_slice(&f.to_array());
            }
            Ok(())
        }
    }

    fn names(n: usize) -> Vec<String> {
        (0..n).map(|i| format!("m{i}")).collect()
    }

    /// Twelve columns.
    fn basis() -> &'static Basis {
        static BASIS: std::sync::OnceLock<Basis> = std::sync::OnceLock::new();
        BASIS.get_or_init(|| {
            build(&Made(4), &names(4), 99, 2, &|_| {}).unwrap_or_else(|e| match e {}).unwrap()
        })
    }

    fn worst(values: &[f32], material: usize) -> f32 {
        let seen = values.chunks_exact(3).enumerate().filter(|(_, v)| v[0] >= 0.0).step_by(7);
        seen.map(|(bin, v)| {
            let (wo, wi) = directions_of(bin);
            let want = made(material, wo, wi);
            ((Vec3::from_slice(v) - want) / (want + 0.05)).abs().max_element()
        })
        .fold(0.0, f32::max)
    }

    #[test]
    fn eigenvectors_are_those_of_a_known_matrix() {
        // Eigenvalues 2 − √2, 2, 2 + √2.
        let a = [2.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 2.0];
        let (values, v) = eigen(&mut a.to_vec(), 3);
        let root = 2f64.sqrt();
        for (got, want) in values.iter().zip([2.0 + root, 2.0, 2.0 - root]) {
            assert!((got - want).abs() < 1e-13);
        }
        for j in 0..3 {
            for i in 0..3 {
                let av: f64 = (0..3).map(|k| a[i * 3 + k] * v[k * 3 + j]).sum();
                assert!((av - values[j] * v[i * 3 + j]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn bins_and_directions_agree() {
        let mut rng = Pcg32::new(1, 3);
        for _ in 0..4000 {
            let bin = ((u64::from(rng.next_u32()) * BINS as u64) >> 32) as usize;
            // Closer to the normal single precision no longer knows φ_d to half a degree.
            if cosines(bin).is_some() && bin >= 4 * THETA_D * PHI_D {
                let (wo, wi) = directions_of(bin);
                assert_eq!(bin_of(wo, wi), bin);
                assert_eq!(bin_of(wi, wo), bin, "reciprocity");
            }
        }
    }

    #[test]
    fn components_are_orthogonal_and_hold_the_training_tables() {
        let b = basis();
        // All that lies above the horizon; at most 11 columns, as the mean takes one of twelve.
        assert!(
            (1_088_000..1_118_000).contains(&b.bins.len()) && (8..=11).contains(&b.components),
            "{}",
            b.components
        );
        let k = b.components;
        for i in 0..k {
            for j in 0..=i {
                let dot: f64 = b.q.chunks_exact(k).map(|r| f64::from(r[i]) * f64::from(r[j])).sum();
                let (si, sj) = (f64::from(b.singular[i]), f64::from(b.singular[j]));
                let want = if i == j { 1.0 } else { 0.0 };
                // Single precision of a million rows; the last columns come from the small end of a squared spectrum.
                assert!((dot / (si * sj) - want).abs() < 1e-3, "{i} {j}: {}", dot / (si * sj));
            }
        }
        let all: Vec<Observation> = (0..b.bins.len())
            .step_by(5)
            .map(|row| {
                let (wo, wi) = directions_of(b.bins[row] as usize);
                Observation { row, f: made(2, wo, wi) }
            })
            .collect();
        let exact = worst(&reconstruct(b, &all, k, 1e-9), 2);
        assert!(exact < 2e-4, "{exact}");
        // The ridge of the paper costs a little.
        let ridged = worst(&reconstruct(b, &all, k, RIDGE), 2);
        assert!(ridged > exact && ridged < 0.2, "{ridged}");
    }

    #[test]
    fn few_directions_or_a_photograph_tell_a_material_of_the_basis() {
        let b = basis();
        let rows = optimal_rows(b, 5, &|_| {});
        assert_eq!(rows, optimal_rows(b, 5, &|_| {}));
        let mut rng = Pcg32::new(3, 3);
        let random = (0..40)
            .map(|_| {
                let rows: Vec<usize> = (0..5).map(|_| rng.next_u32() as usize % b.bins.len()).collect();
                condition(b, &rows, 5)
            })
            .fold(f64::INFINITY, f64::min);
        assert!(condition(b, &rows, 5) < 0.7 * random, "{} {random}", condition(b, &rows, 5));

        let size = 96;
        let light = Vec3::new(0.5, 0.3, 0.7).normalize();
        let pixels: Vec<Vec3> = (0..size * size)
            .map(|i| {
                let at = |v: usize| (v as f32 + 0.5) / size as f32 * 2.0 - 1.0;
                let (x, y) = (at(i % size), -at(i / size));
                let z2 = 1.0 - x * x - y * y;
                if z2 <= 0.0 {
                    return Vec3::ZERO;
                }
                let frame = Frame::from_normal(Vec3::new(x, y, z2.sqrt()));
                let (wo, wi) = (frame.to_local(Vec3::Z), frame.to_local(light));
                if wi.z > 0.0 { made(1, wo, wi) * wi.z * PI * 0.8 } else { Vec3::ZERO }
            })
            .collect();
        let half = size as f32 / 2.0;
        let photo =
            Sphere { pixels: &pixels, width: size, centre: (half, half), radius: half, light, white: 0.8 };
        let (seen, used) = photo.observations(b);
        assert!(seen.len() > 1000 && used >= seen.len());
        let mean_error = |eta: f64| {
            let table = reconstruct(b, &seen, b.components, eta);
            let (mut sum, mut count) = (0.0f64, 0);
            for (bin, v) in table.chunks_exact(3).enumerate().filter(|(_, v)| v[0] >= 0.0).step_by(11) {
                let (wo, wi) = directions_of(bin);
                let want = made(1, wo, wi);
                sum += f64::from(((Vec3::from_slice(v) - want) / (want + 0.05)).abs().max_element());
                count += 1;
            }
            sum / f64::from(count)
        };
        // A slice of the table is too little for the ridge of the paper to trust all components.
        let (trusting, ridged) = (mean_error(1e-2), mean_error(RIDGE));
        assert!(trusting < 0.1 && trusting < 0.6 * ridged && ridged < 0.5, "{trusting} {ridged}");
    }

    #[test]
    fn leaving_one_out_gets_better_with_readings_and_does_not_depend_on_threads() {
        let run = |threads| {
            let told = std::sync::Mutex::new(0.0f64);
            let report = leave_one_out(&Made(5), &names(5), &[2, 6], threads, &|x| {
                let mut t = told.lock().unwrap();
                *t = t.max(x);
            });
            assert!((*told.lock().unwrap() - 1.0).abs() < 1e-9);
            report.unwrap_or_else(|e| match e {}).unwrap()
        };
        let (one, three) = (run(1), run(3));
        assert_eq!((&one.errors, &one.rows, &one.basis), (&three.errors, &three.rows, &three.basis));
        let mean = |n: usize| {
            let of: Vec<f64> = one.errors.iter().filter(|e| e.readings == n).map(|e| e.log_rms).collect();
            assert_eq!(of.len(), 5);
            of.iter().sum::<f64>() / 5.0
        };
        assert!(mean(2) < mean(0) && mean(6) < mean(2), "{} {} {}", mean(0), mean(2), mean(6));
    }
}
