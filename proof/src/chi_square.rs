//! Does `sample` draw what `pdf` says? Pearson's chi-square over cells of about equal mass.

use crate::Subject;
use crate::integrate::{Domain, Histogram, Partition, Rule};
use glam::Vec3;
use yugen_optics::random::Pcg32;
use yugen_optics::statistics::chi_square_p_value;

/// How hard to look.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquare {
    /// Draws.
    pub samples: usize,
    /// Seed of the draws: the same seed gives the same verdict.
    pub seed: u64,
    /// About how many cells.
    pub cells: usize,
}

impl Default for ChiSquare {
    fn default() -> Self {
        Self { samples: 1_000_000, seed: 1, cells: 800 }
    }
}

/// What was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct ChiSquareResult {
    /// Probability of a fit this bad if `sample` drew exactly `pdf`; 0 where `fault` says more.
    pub p_value: f64,
    /// Pearson's statistic.
    pub statistic: f64,
    /// Cells less one.
    pub dof: f64,
    /// ∫ pdf over the domain.
    pub integral: f64,
    /// Standard error of that.
    pub integral_error: f64,
    /// Share of draws that gave a direction.
    pub hit_rate: f64,
    /// A fault that needs no statistics.
    pub fault: Option<String>,
}

/// Draws that are not Dirac peaks, as directions.
pub(crate) fn guides(subject: &dyn Subject, wo: Vec3, count: usize, seed: u64) -> Vec<Vec3> {
    let mut rng = Pcg32::new(seed, 0x6764);
    (0..count)
        .filter_map(|_| subject.sample(wo, rng.next_vec3()))
        .filter(|s| !s.delta && s.wi.is_finite())
        .map(|s| s.wi)
        .collect()
}

pub(crate) fn domain(subject: &dyn Subject) -> Domain {
    if subject.laws().transmits { Domain::Sphere } else { Domain::Hemisphere }
}

/// A cell with fewer expected draws is pooled with others (Cochran's rule).
const POOL: f64 = 5.0;

/// Tests the draws of `subject` at `wo` against its pdf. Draws of `None` and of Dirac peaks form a cell of
/// their own, which holds the probability that the pdf lacks to one.
pub fn chi_square(subject: &dyn Subject, wo: Vec3, settings: &ChiSquare) -> ChiSquareResult {
    // Enough guides for cells of 1/800 with a few guides each; the tolerance is the error of all cells
    // together, and what is left of it enters the denominator below.
    let found = guides(subject, wo, 4 * settings.cells, settings.seed);
    let rule = Rule { tolerance: 5e-5, budget: 1_000_000 };
    let partition = Partition::new(domain(subject), &found, rule, |wi| [f64::from(subject.pdf(wo, wi))]);
    let histogram = Histogram::new(&partition, 1.0 / settings.cells as f64);

    let mut rng = Pcg32::new(settings.seed, 0x6368);
    let mut seen = vec![0u32; histogram.cells.len()];
    let (mut hits, mut outside) = (0u32, 0u32);
    let mut fault = None;
    for _ in 0..settings.samples {
        let Some(s) = subject.sample(wo, rng.next_vec3()) else { continue };
        if s.delta {
            continue;
        }
        if !s.wi.is_finite() {
            fault = Some(format!("sample returned the direction {}", s.wi));
            break;
        }
        hits += 1;
        match histogram.find(s.wi) {
            Some(cell) => seen[cell] += 1,
            None => outside += 1,
        }
    }

    let n = settings.samples as f64;
    let integral = partition.integral()[0];
    if fault.is_none() && outside > 0 {
        fault = Some(format!("{outside} draws lie below the surface of a reflector"));
    }
    if !integral.is_finite() {
        fault = Some("the pdf is not finite somewhere".into());
    }
    let (mut statistic, mut cells) = (0.0, 0.0);
    let (mut pooled, mut pooled_seen) = (crate::integrate::Cell::default(), 0.0);
    let mut add = |expected: f64, error: f64, seen: f64| {
        // The error of the quadrature is a second, independent source of scatter.
        statistic += (seen - expected).powi(2) / (expected + error * error);
        cells += 1.0;
    };
    for (cell, &count) in histogram.cells.iter().zip(&seen) {
        let (expected, count) = (n * cell.mass, f64::from(count));
        if expected <= 0.0 && count > 1e-5 * n {
            fault.get_or_insert(format!("{count} of {n} draws fell where the pdf is zero"));
        }
        if expected < POOL {
            pooled.mass += cell.mass;
            pooled.error = pooled.error.hypot(cell.error);
            pooled_seen += count;
        } else {
            add(expected, n * cell.error, count);
        }
    }
    for (mass, error, count) in
        [(pooled.mass, pooled.error, pooled_seen), (1.0 - integral, partition.error(), n - f64::from(hits))]
    {
        let expected = (n * mass).max(0.0);
        // A pool that stays below Cochran's rule may only be empty by chance, not full.
        if expected >= POOL || count > expected + 4.0 * POOL {
            add(expected.max(POOL), n * error, count);
        }
    }
    let dof = f64::max(cells - 1.0, 1.0);
    let p_value =
        if fault.is_some() || statistic.is_nan() { 0.0 } else { chi_square_p_value(statistic, dof) };
    ChiSquareResult {
        p_value,
        statistic,
        dof,
        integral,
        integral_error: partition.error(),
        hit_rate: f64::from(hits) / n,
        fault,
    }
}
