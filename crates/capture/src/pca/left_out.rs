//! How well a basis does on materials that it has not seen.

use super::build::{Rows, basis, gram, rows};
use super::linear::{eigen, ridge};
use super::{BAND, BINS, EPSILON, RIDGE, Reach, Tables, cosines, directions_of, optimal_rows};
use yugen_archive::formats::pca_basis::Basis;
use yugen_optics::parallel::parallel;
use yugen_reflectance::merl::{PHI_D, THETA_D, bin_centre};

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
    let _span = tracing::info_span!("leave_one_out", tables = tables.count()).entered();
    let columns = 3 * tables.count();
    let most = numbers.iter().copied().max().unwrap_or(0).min(columns.saturating_sub(3));
    let (gram, count) = gram(tables, threads, &|x| progress(0.3 * x))?;
    let made = basis(tables, names, most.max(1), threads, &gram, &|x| progress(0.3 + 0.2 * x))?;
    let Some(basis) = made else { return Ok(None) };
    let rows_of: Vec<Vec<usize>> = parallel(
        threads,
        numbers.len(),
        |i| optimal_rows(&basis, numbers[i].min(basis.components), Reach::ALL, &|_| {}),
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
            let (_, vectors) = eigen(&g, n);
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
