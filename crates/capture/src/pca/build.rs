//! The basis of a folder of tables.

use super::linear::{eigen, multiply};
use super::{BAND, BINS, EPSILON, Tables, cosines};
use std::ops::Range;
use yugen_archive::formats::pca_basis::Basis;
use yugen_optics::parallel::parallel;

/// Rows of all columns, less their means.
pub struct Rows {
    pub bins: Vec<u32>,
    pub mean: Vec<f64>,
    /// Row by row.
    pub values: Vec<f64>,
}

pub fn rows<T: Tables>(
    tables: &T,
    bins: Range<usize>,
    wanted: impl Fn(usize) -> bool,
) -> Result<Rows, T::Error> {
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
/// YᵀY over all rows, in a fixed order of sums.
pub fn gram<T: Tables>(
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
    let _span = tracing::info_span!("build_basis", tables = tables.count()).entered();
    let (gram, _) = gram(tables, threads, &|x| progress(0.6 * x))?;
    basis(tables, names, components, threads, &gram, &|x| progress(0.6 + 0.4 * x))
}

pub fn basis<T: Tables>(
    tables: &T,
    names: &[String],
    components: usize,
    threads: usize,
    gram: &[f64],
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Option<Basis>, T::Error> {
    let (columns, bands) = (3 * tables.count(), BINS / BAND);
    let (values, vectors) = eigen(gram, columns);
    let singular: Vec<f32> = values.iter().map(|v| v.sqrt() as f32).collect();
    // Tables hold single precision: the three channels of a grey material differ by that much, and are no components.
    let real = singular.iter().filter(|s| **s > 1e-5 * singular[0] && **s > 0.0).count();
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
