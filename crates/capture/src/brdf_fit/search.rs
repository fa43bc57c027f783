//! From many starts to the best fit of each model.

use super::optimise::{Loss, Scale, descend};
use super::space::{Coordinate, Point, Space, forms};
use super::{Data, Fit, Kind, Lobe, Metric, Options, ParamType, Reading, Readings, r_sequence};
use std::sync::atomic::{AtomicUsize, Ordering};
use yugen_optics::ColourSpace;
use yugen_optics::parallel::parallel;

/// Readings that starts are compared with.
const SCREEN: usize = 256;
/// Candidates of a model that are refined.
const KEPT: usize = 3;

/// Why a model cannot be fitted, if it cannot.
pub fn unfit(kind: Kind) -> Option<&'static str> {
    let laws = kind.laws();
    // A choice of the working space: the model turns spectra into colours, one table for each place in its box.
    let spectral = kind.params().iter().any(|p| match p.kind {
        ParamType::Choice(names) => names.iter().all(|n| ColourSpace::from_name(n).is_some()),
        _ => false,
    });
    if laws.delta {
        Some("it reflects into single directions only")
    } else if laws.transmits {
        Some("light goes through it")
    } else if matches!(kind.data(), Data::Required(_)) {
        Some("it is a table itself")
    } else if spectral {
        Some("its colours are spectra, which RGB readings do not determine")
    } else {
        None
    }
}

/// Models made ready for fits: their forms, and what there is to fit in each. Good for any number of materials.
pub struct Models {
    kinds: Vec<Kind>,
    /// Which kind, which form, which coordinates; the ground is there where it was asked for.
    forms: Vec<(usize, Space)>,
    isotropic: bool,
    space: ColourSpace,
}

impl Models {
    /// Probes the models. `isotropic`: as in [`Readings`]. `ground`: puts a Lambertian ground under forms that have
    /// none of their own. For isotropic materials, forms that cannot do without a grain are left out where their
    /// model has others.
    pub fn new(
        kinds: &[Kind],
        isotropic: bool,
        space: ColourSpace,
        ground: bool,
        threads: usize,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Self {
        let _span = tracing::info_span!("probe_models", models = kinds.len()).entered();
        let jobs: Vec<(usize, Vec<f32>)> = kinds
            .iter()
            .enumerate()
            .flat_map(|(k, kind)| forms(*kind, space).into_iter().map(move |f| (k, f)))
            .collect();
        let found =
            parallel(threads, jobs.len(), |j| Space::of(kinds[jobs[j].0], &jobs[j].1, isotropic), &|done| {
                progress(done as f64 / jobs.len() as f64)
            });
        let lambert = Space::of(Kind::Lambert, &Kind::Lambert.defaults(), true);
        let mut all: Vec<(usize, Space)> = Vec::new();
        for ((k, _), found) in jobs.iter().zip(found) {
            let Some(found) = found else { continue };
            let below = lambert.as_ref().filter(|_| ground && !found.has_ground);
            all.push((*k, below.map_or_else(|| found.clone(), |l| found.clone().plus(l))));
        }
        let round: Vec<bool> =
            (0..kinds.len()).map(|k| all.iter().any(|(j, s)| *j == k && !s.has_grain)).collect();
        all.retain(|(k, s)| !s.has_grain || !round[*k]);
        Self { kinds: kinds.to_vec(), forms: all, isotropic, space }
    }

    /// Leaves out the models of [`Self::with_grain`].
    pub fn drop_grain(&mut self) {
        let grain = self.with_grain();
        self.forms.retain(|(k, _)| !grain.contains(&self.kinds[*k]));
    }

    /// Models that have a grain in every form although the material has none: they can be fitted, to its average over
    /// all azimuths, but not explain it.
    pub fn with_grain(&self) -> Vec<Kind> {
        let grain = |k: usize| self.forms.iter().filter(|(j, _)| *j == k).all(|(_, s)| s.has_grain);
        (0..self.kinds.len()).filter(|&k| grain(k)).map(|k| self.kinds[k]).collect()
    }
}

/// A place that may become the best.
#[derive(Clone)]
struct Candidate {
    space: Space,
    u: Vec<f64>,
    loss: f64,
}

/// Keeps the best; ties in the order they came, so that nothing depends on threads.
fn best(mut all: Vec<Candidate>) -> Vec<Candidate> {
    all.retain(|c| c.loss.is_finite());
    all.sort_by(|a, b| a.loss.total_cmp(&b.loss));
    all.truncate(KEPT);
    all
}

struct Search<'a> {
    readings: &'a Readings,
    screen: Vec<Reading>,
    options: &'a Options,
    /// The mean of f cos θ_i, the scale of everything small.
    mean: f64,
}

impl Search<'_> {
    /// Smooth, and near enough to both metrics to tell good places from bad ones.
    fn smooth(&self) -> Loss {
        Loss { scale: Scale::CubeRoot(1e-2 * self.mean), power: 1.0, delta: 0.0 }
    }

    /// From each start the best colours, which most models are linear in, then downhill in all coordinates, as the
    /// screen sees it. Where steps are costly, only from the start with the best colours.
    fn screen(&self, space: &Space, starts: Vec<Vec<f64>>) -> Vec<Candidate> {
        let loss = self.smooth();
        let all: Vec<usize> = (0..space.groups.len()).collect();
        let colours: Vec<usize> =
            all.iter().copied().filter(|&g| space.coordinates[space.groups[g].start].colour).collect();
        let walk = |c: &mut Candidate, groups: &[usize], iterations| {
            c.loss = descend(space, &self.screen, &loss, groups, iterations, &mut c.u);
        };
        let mut candidates: Vec<Candidate> =
            starts.into_iter().map(|u| Candidate { space: space.clone(), u, loss: f64::INFINITY }).collect();
        candidates.iter_mut().for_each(|c| walk(c, &colours, 4));
        if space.is_costly() {
            candidates = best(candidates);
            candidates.truncate(1);
        }
        candidates.iter_mut().for_each(|c| walk(c, &all, 12));
        best(candidates)
    }

    /// Starts of one of the terms with dim colours; the other terms are as in `u`. Numbers are well spread; where
    /// steps are cheap, each is tried at both sides of its range too while the rest stays, as most layers of a model
    /// with many are best left off.
    fn starts(&self, space: &Space, u: &[f64], lobe: usize) -> Vec<Vec<f64>> {
        let mut dim = u.to_vec();
        let own = |c: &(usize, &Coordinate)| c.1.lobe == lobe;
        let (colours, numbers): (Vec<_>, Vec<_>) =
            space.coordinates.iter().enumerate().filter(own).partition(|(_, c)| c.colour);
        colours.iter().for_each(|(k, _)| dim[*k] = 0.2);
        let costly = space.is_costly();
        // Where every step costs a table, a look at the first few must do.
        let spread = (0..self.options.starts.div_ceil(if costly { 6 } else { 1 })).map(|i| {
            let (mut u, points) = (dim.clone(), r_sequence::<32>(i));
            numbers.iter().enumerate().for_each(|(n, (k, _))| u[*k] = points[n % 32]);
            u
        });
        let sweep = numbers.iter().filter(|_| !costly).flat_map(|(k, _)| {
            [0.25, 0.75].map(|x| {
                let mut u = dim.clone();
                u[*k] = x;
                u
            })
        });
        spread.chain(sweep).collect()
    }

    /// One form of a model, from its defaults, its presets and spread starts.
    fn form(&self, kind: Kind, space: &Space) -> Vec<Candidate> {
        let mut u = vec![0.2; space.coordinates.len()];
        space.put(&mut u, 0, space.base(0));
        let mut starts = vec![u.clone()];
        let same_form = |slots: &[f32]| {
            let mut at = 0;
            kind.params().iter().all(|p| {
                at += p.width();
                !matches!(p.kind, ParamType::Choice(_)) || slots[at - 1] == space.base(0)[at - 1]
            })
        };
        for preset in kind.presets() {
            if let Ok((slots, data)) = kind.preset(preset.name, self.readings.space)
                && data.is_empty()
                && same_form(&slots)
            {
                let mut u = u.clone();
                space.put(&mut u, 0, &slots);
                starts.push(u);
            }
        }
        starts.extend(self.starts(space, &u, 0));
        self.screen(space, starts)
    }

    /// A second lobe of the model beside the best single one.
    fn second(&self, one: &Candidate) -> Vec<Candidate> {
        let terms = one.space.terms(&one.u);
        let space = one.space.clone().plus(&one.space.first());
        let mut u = one.u.clone();
        u.resize(space.coordinates.len(), 0.2);
        // A black second lobe does no harm, so that two are never worse than one.
        let mut black = u.clone();
        for (c, u) in space.coordinates.iter().zip(&mut black) {
            if c.lobe == terms.len() {
                *u = if c.colour { 0.0 } else { 0.5 };
            }
        }
        let mut starts = self.starts(&space, &u, terms.len());
        starts.push(black);
        self.screen(&space, starts)
    }

    /// All readings, first smoothly, then by the metric itself while its cusp gets sharper.
    fn refine(&self, candidate: &Candidate) -> Candidate {
        let Candidate { space, mut u, .. } = candidate.clone();
        let readings = &self.readings.all;
        let all: Vec<usize> = (0..space.groups.len()).collect();
        let judged = |u: &[f64]| {
            let mut point = Point::default();
            if space.values(u, readings, true, &mut point) {
                self.options.metric.distance(readings, &point.values)
            } else {
                f64::INFINITY
            }
        };
        let mut found = (judged(&u), u.clone());
        descend(&space, readings, &self.smooth(), &all, 20, &mut u);
        for sharpness in [None, Some(1e-1), Some(1e-2), Some(1e-3)] {
            if let Some(sharpness) = sharpness {
                let (scale, power) = match self.options.metric {
                    Metric::CubeRoot => (Scale::Identity, 1.0 / 3.0),
                    Metric::Log => (Scale::Log, 0.5),
                };
                let loss = Loss { scale, power, delta: sharpness * self.mean };
                descend(&space, readings, &loss, &all, 12, &mut u);
            }
            let error = judged(&u);
            if error < found.0 {
                found = (error, u.clone());
            }
        }
        Candidate { space, loss: found.0, u: found.1 }
    }
}

/// The best fit of each of the models to the readings, by rising error; models that cannot be made are left out.
/// `progress` hears what part of the work is done, from any thread.
///
/// # Panics
/// If there are no readings, if more than two lobes or none are asked for, or if the models were made ready for
/// another kind of material or colour space.
pub fn fit(
    readings: &Readings,
    models: &Models,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Vec<Fit> {
    assert!(!readings.all.is_empty() && (1..=2).contains(&options.lobes));
    assert!(readings.isotropic == models.isotropic && readings.space == models.space);
    let _span = tracing::info_span!("fit_models", readings = readings.all.len()).entered();
    let kinds = &models.kinds;
    let total: f64 = readings.all.iter().map(|r| f64::from(r.weight)).sum();
    let lit = |r: &Reading| f64::from(r.weight * r.wi.z * r.f.max(glam::Vec3::ZERO).element_sum() / 3.0);
    let mean = readings.all.iter().map(lit).sum::<f64>() / total;
    // Every few readings: a sequence of low discrepancy stays well spread.
    let every = readings.all.len().div_ceil(SCREEN);
    let screen = readings.all.iter().step_by(every).copied().collect();
    let search = Search { readings, screen, options, mean: mean.max(1e-9) };
    let stages = 2.0 * options.lobes as f64;
    let stage = AtomicUsize::new(0);
    let told = |n: usize| {
        let before = stage.fetch_add(1, Ordering::Relaxed) as f64;
        move |done: usize| progress((before + done as f64 / n.max(1) as f64) / stages)
    };

    let jobs = &models.forms;
    let screening = tracing::debug_span!("screen", forms = jobs.len()).entered();
    let screened = parallel(
        options.threads,
        jobs.len(),
        |j| search.form(kinds[jobs[j].0], &jobs[j].1),
        &told(jobs.len()),
    );
    drop(screening);
    let mut pools = vec![Vec::new(); kinds.len()];
    for ((k, _), candidates) in jobs.iter().zip(screened) {
        pools[*k].extend(candidates);
    }
    let refine = |pools: Vec<Vec<Candidate>>| -> Vec<Option<Candidate>> {
        let _span = tracing::debug_span!("refine").entered();
        let jobs: Vec<(usize, Candidate)> = pools
            .into_iter()
            .enumerate()
            .flat_map(|(k, p)| best(p).into_iter().map(move |c| (k, c)))
            .collect();
        let refined = parallel(options.threads, jobs.len(), |j| search.refine(&jobs[j].1), &told(jobs.len()));
        let mut pools = vec![Vec::new(); kinds.len()];
        for ((k, _), c) in jobs.iter().zip(refined) {
            pools[*k].push(c);
        }
        pools.into_iter().map(|p| best(p).into_iter().next()).collect()
    };
    let mut winners = refine(pools);
    if options.lobes == 2 {
        let pools = parallel(
            options.threads,
            winners.len(),
            |k| winners[k].as_ref().map_or_else(Vec::new, |w| search.second(w)),
            &told(winners.len()),
        );
        winners = refine(pools);
    }

    let mut fits: Vec<Fit> = winners
        .into_iter()
        .zip(kinds)
        .filter_map(|(w, &model)| {
            let w = w?;
            let mut point = Point::default();
            w.space.values(&w.u, &readings.all, true, &mut point);
            let error = |m: Metric| m.distance(&readings.all, &point.values);
            Some(Fit {
                model,
                lobes: w.space.terms(&w.u).into_iter().map(|(kind, slots)| Lobe { kind, slots }).collect(),
                free: w.u.len(),
                cube_root: error(Metric::CubeRoot),
                log: error(Metric::Log),
            })
        })
        .collect();
    fits.sort_by(|a, b| a.error(options.metric).total_cmp(&b.error(options.metric)));
    fits
}
