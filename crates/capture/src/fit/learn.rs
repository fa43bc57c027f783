//! What texels of the same thread have in common.
//!
//! Cloth repeats: a thread shows the same widths, the same albedos and one of few directions in every repeat of the weave,
//! but its normal, and so what each light finds of its highlight, differs from texel to texel. A sample of texels is put
//! into clusters by what their readings look like before any fit; in each, the Gaussian that their numbers are drawn from
//! is found by expectation and maximisation, every texel counting by what its own readings could tell. Few lights of
//! many texels so become many lights of one thread. How highlights fall off is learned of all texels together: one texel
//! meets few half vectors of a sharp highlight, all of them meet every one.

use super::clusters::{Cluster, Member, k_means};
use super::features::nearest;
use super::fitted::Options;
use super::fitter::Fitter;
use super::outcome::{Evidence, Outcome};
use super::prior::Prior;
use super::task::Task;
use super::{choice, noise, tails};
use crate::lanes::LANES;
use crate::readings::Readings;
use yugen_optics::parallel::parallel_in;

/// A texel of the sample.
struct Sample {
    band: usize,
    texel: usize,
    found: Outcome,
    evidence: Box<Evidence>,
}

impl std::ops::Deref for Sample {
    type Target = Outcome;
    fn deref(&self) -> &Outcome {
        &self.found
    }
}

impl Sample {
    fn member(&self) -> Member<'_> {
        Member { theta: &self.found.theta, evidence: &self.evidence }
    }
}

/// Clusters at most: warp, weft, gold and their crossings, several times over.
const CLUSTERS: usize = 16;
/// Fewer texels than this have nothing in common that could be told from chance.
const FEWEST: usize = 24;
/// After so many more passes a profile has come within a few percent of where it is going.
const PASSES_WITH_TAILS: usize = 10;
/// Members by which it is seen whether a cluster is made of what another is.
const TRIED: usize = 48;
/// By how much χ² may then rise, in the median: some two deviations of each of the five numbers of a material.
const MOST_DEBT: f64 = 20.0;
/// Texels that are looked at.
const SAMPLE: usize = 6144;

impl Prior {
    /// Learns from texels spread over `bands`. `None` where there are too few of them.
    pub fn learn(bands: &[impl Readings], options: &Options, threads: usize) -> Option<Self> {
        let _span = tracing::info_span!("learn_threads").entered();
        let groups: Vec<(usize, usize)> = bands
            .iter()
            .enumerate()
            .flat_map(|(b, s)| (0..s.texels().div_ceil(LANES)).map(move |g| (b, g)))
            .collect();
        let wanted = (SAMPLE / LANES).min(groups.len());
        let chosen: Vec<_> = (0..wanted).map(|i| groups[i * groups.len() / wanted]).collect();
        let fitters: Vec<_> = bands.iter().map(Fitter::new).collect();
        let quantum = noise::quantum(bands);
        let mut prior: Option<Self> = None;
        let mut centres = Vec::new();
        // The first time without a prior, then with what that taught; a highlight with tails takes longer to be told
        // from a ground.
        let (mut left, mut with_tails) = (3, false);
        while left > 0 {
            left -= 1;
            let task =
                Task { options, prior: prior.as_ref(), learning: true, twice: left < 2, settle: false };
            let group = |i: usize, scratch: &mut _| {
                let (band, group) = chosen[i];
                let end = ((group + 1) * LANES).min(bands[band].texels());
                fitters[band].fit(&task, &(group * LANES..end).collect::<Vec<_>>(), scratch)
            };
            let outcomes = parallel_in(threads, chosen.len(), group, &|_| {});
            let found = outcomes.into_iter().zip(&chosen).flat_map(|(group, &(band, first))| {
                group.into_iter().enumerate().filter_map(move |(i, mut found)| {
                    let evidence = found.evidence.take()?;
                    Some(Sample { band, texel: first * LANES + i, found, evidence })
                })
            });
            let outcomes: Vec<Sample> = found.collect();
            if centres.is_empty() {
                if outcomes.len() < FEWEST {
                    return None;
                }
                let features: Vec<_> = outcomes.iter().map(|o| o.features).collect();
                centres = k_means(&features, (outcomes.len() / (2 * FEWEST)).clamp(1, CLUSTERS));
            }
            let products: Vec<_> = outcomes
                .iter()
                .map(|o| (o.fitted.texel.confidence, o.fitted.readings, &o.evidence.products))
                .collect();
            let profile = tails::of_texels(&products);
            if !with_tails && !profile.is_gaussian() {
                with_tails = true;
                // Widths and heights mean something else now.
                let noise = [options.noise, options.floor];
                prior = Some(Self { clusters: Vec::new(), profile, noise, grounds: Vec::new() });
                left = PASSES_WITH_TAILS;
                continue;
            }
            let mut members = vec![Vec::new(); centres.len()];
            for o in &outcomes {
                members[nearest(&centres, &o.features)].push(o);
            }
            let of_some = centres.iter().zip(&members).filter(|(_, m)| m.len() >= FEWEST);
            let clusters: Vec<Cluster> = of_some
                .clone()
                .map(|(c, m)| Cluster::of(*c, &m.iter().map(|o| o.member()).collect::<Vec<_>>()))
                .collect();
            let tallies: Vec<_> = outcomes.iter().map(|o| (o.fitted.readings, &o.evidence.noise)).collect();
            let mut found = Self {
                clusters,
                profile,
                noise: noise::of_texels(&tallies, options, quantum, with_tails),
                grounds: Vec::new(),
            };
            if left == 0 || with_tails {
                let members: Vec<&[&Sample]> = of_some.map(|(_, m)| m.as_slice()).collect();
                found.share(&members, &fitters, options, threads);
            }
            prior = Some(found);
        }
        let mut prior = prior.filter(|p| !p.clusters.is_empty())?;
        if options.surface.is_some() {
            let task = Task { options, prior: Some(&prior), learning: false, twice: true, settle: false };
            let group = |i: usize, scratch: &mut _| {
                let (band, group) = chosen[i];
                let end = ((group + 1) * LANES).min(bands[band].texels());
                fitters[band].fit(&task, &(group * LANES..end).collect::<Vec<_>>(), scratch)
            };
            let outcomes = parallel_in(threads, chosen.len(), group, &|_| {});
            let mut margins = vec![Vec::new(); prior.clusters.len()];
            for o in outcomes.iter().flatten().filter(|o| o.fitted.readings > 0) {
                if let Some(cluster) = prior.nearest(&o.features) {
                    margins[cluster].push(o.margin);
                }
            }
            prior.grounds = choice::odds(&margins);
        }
        Some(prior)
    }

    /// What leans so far that no lamp meets its highlight cannot say what it is made of. Where the readings of a cluster are
    /// as well described by what another is made of, of which its texels are surer, that is what it is made of as well.
    /// Width and height of a highlight with tails are known only together, and of its flank alone not at all: then this
    /// goes for all clusters, each time before the profile is learned anew.
    fn share<R: Readings>(
        &mut self,
        members: &[&[&Sample]],
        bands: &[Fitter<R>],
        options: &Options,
        threads: usize,
    ) {
        let sure = |c: usize| members[c].iter().filter(|m| m.fitted.texel.confidence > 0.5).count();
        let mut order: Vec<usize> = (0..members.len()).collect();
        order.sort_by_key(|c| std::cmp::Reverse(sure(*c)));
        let mut materials: Vec<Cluster> = Vec::new();
        // It is highlights that are compared.
        let bare = &Options { surface: None, ..*options };
        for c in order {
            let step = members[c].len().div_ceil(TRIED);
            let tried: Vec<&Sample> = members[c].iter().step_by(step).copied().collect();
            let of_band = |b: usize| tried.iter().filter(|m| m.band == b).map(|m| m.texel).collect();
            let texels: Vec<(usize, Vec<usize>)> = (0..bands.len()).map(|b| (b, of_band(b))).collect();
            let mut least = MOST_DEBT;
            let mut kin = None;
            let decided = 2 * sure(c) > members[c].len();
            let open = !decided || !self.profile.is_gaussian();
            for material in materials.iter().filter(|_| open) {
                let alone = Self {
                    clusters: vec![material.clone()],
                    profile: self.profile,
                    noise: self.noise,
                    grounds: Vec::new(),
                };
                let prior = Some(&alone);
                let task = Task { options: bare, prior, learning: false, twice: true, settle: false };
                let band = |i: usize, scratch: &mut _| {
                    let (band, texels) = &texels[i];
                    bands[*band].fit(&task, texels, scratch)
                };
                let again = parallel_in(threads, texels.len(), band, &|_| {});
                let again: Vec<Outcome> = again.into_iter().flatten().collect();
                let cost = |o: &Outcome| f64::from(o.fitted.residual).powi(2) * f64::from(o.fitted.readings);
                let mut debts: Vec<f64> = tried
                    .iter()
                    .zip(&again)
                    .map(|(m, o)| cost(o) + material.cost(&o.theta) - cost(m))
                    .collect();
                let middle = debts.len() / 2;
                let debt = *debts.select_nth_unstable_by(middle, f64::total_cmp).1;
                if debt < least {
                    least = debt;
                    kin = Some((material, again));
                }
            }
            if let Some((material, again)) = kin {
                self.clusters[c] = material.with_normals(self.clusters[c].centre, &again);
            } else if decided || (materials.is_empty() && sure(c) >= FEWEST) {
                // Of clusters that are made of the same, the one that most are sure of.
                let material = self.clusters[c].material();
                if materials.iter().all(|m| m.differs(&material)) {
                    materials.push(material);
                }
            }
        }
    }
}
