//! Does `sample` draw what `pdf` says? Pearson's chi-square over cells of about equal mass; over rings of them about
//! the mean direction of the draws; and over sectors about it. Many cells see a fault in one place, a few rings or
//! sectors a faint one that leans the same way everywhere and drowns in the scatter of many.

use crate::Subject;
use crate::integrate::{Domain, Histogram, Partition, Rule};
use glam::Vec3;
use yugen_optics::Frame;
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
    /// Probability of a fit this bad, in the worst of the three divisions, if `sample` drew exactly `pdf`; 0 where
    /// `fault` says more.
    pub p_value: f64,
    /// Cells of the finest division.
    pub cells: usize,
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

/// Rings, and sectors: few, so that their scatter is small; enough to see a fault that changes its sign twice.
const GROUPS: f64 = 16.0;

/// Draws of a cell: expected, the error that the quadrature makes in that, and seen.
#[derive(Clone, Copy, Default)]
struct Count {
    expected: f64,
    error: f64,
    seen: f64,
}

impl Count {
    fn join(&mut self, other: Self) {
        self.expected += other.expected;
        self.error = self.error.hypot(other.error);
        self.seen += other.seen;
    }
}

/// The p-value of Pearson's statistic. `rest` counts the draws that are no directions.
fn pearson(counts: &[Count], rest: Count) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0.0);
    let mut add = |c: Count| {
        // The error of the quadrature is a second, independent source of scatter.
        statistic += (c.seen - c.expected).powi(2) / (c.expected + c.error * c.error);
        cells += 1.0;
    };
    let mut pool = Count::default();
    for &c in counts {
        if c.expected < POOL { pool.join(c) } else { add(c) }
    }
    for c in [pool, rest] {
        let expected = c.expected.max(0.0);
        // A pool that stays below Cochran's rule may only be empty by chance, not full.
        if expected >= POOL || c.seen > expected + 4.0 * POOL {
            add(Count { expected: expected.max(POOL), ..c });
        }
    }
    if statistic.is_nan() { 0.0 } else { chi_square_p_value(statistic, f64::max(cells - 1.0, 1.0)) }
}

/// Neighbours, in the order of `key`, joined to groups of about equal mass.
fn groups(counts: &[Count], key: impl Fn(usize) -> f32) -> Vec<Count> {
    let mut order: Vec<(f32, usize)> = (0..counts.len()).map(|i| (key(i), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let share = counts.iter().map(|c| c.expected).sum::<f64>() / GROUPS;
    let mut all = vec![Count::default()];
    for (_, i) in order {
        let n = all.len() - 1;
        all[n].join(counts[i]);
        if all[n].expected >= share {
            all.push(Count::default());
        }
    }
    all
}

/// Tests the draws of `subject` at `wo` against its pdf. Draws of `None` and of Dirac peaks form a cell of
/// their own, which holds the probability that the pdf lacks to one.
pub fn chi_square(subject: &dyn Subject, wo: Vec3, settings: &ChiSquare) -> ChiSquareResult {
    // Enough guides for cells of 1/800 with a few guides each; the tolerance is the error of all cells
    // together, and what is left of it enters the denominator of the statistic.
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
    let count = |mass: f64, error: f64, seen: f64| Count { expected: n * mass, error: n * error, seen };
    let cells = &histogram.cells;
    let counts: Vec<Count> =
        cells.iter().zip(&seen).map(|(c, &seen)| count(c.mass, c.error, f64::from(seen))).collect();
    if let Some(c) = counts.iter().find(|c| c.expected <= 0.0 && c.seen > 1e-5 * n) {
        fault.get_or_insert(format!("{} of {n} draws fell where the pdf is zero", c.seen));
    }
    let rest = count(1.0 - integral, partition.error(), n - f64::from(hits));
    let about = Frame::from_normal(found.iter().sum::<Vec3>().try_normalize().unwrap_or(Vec3::Z));
    let local = |i: usize| about.to_local(cells[i].middle);
    let p_values = [
        pearson(&counts, rest),
        pearson(&groups(&counts, |i| local(i).z), rest),
        pearson(&groups(&counts, |i| f32::atan2(local(i).y, local(i).x)), rest),
    ];
    let least = p_values.into_iter().fold(1.0, f64::min);
    ChiSquareResult {
        // The chance that one of three is as small as the smallest.
        p_value: if fault.is_some() { 0.0 } else { -f64::exp_m1(p_values.len() as f64 * f64::ln_1p(-least)) },
        cells: cells.len(),
        integral,
        integral_error: partition.error(),
        hit_rate: f64::from(hits) / n,
        fault,
    }
}
