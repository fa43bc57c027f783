//! All laws of a model in one table.

use crate::laws::{Finding, coverage, delta, energy, finite, reciprocity, rotation, sampling};
use crate::{ChiSquare, Parameters, Subject, chi_square, parameter_sets};
use glam::Vec3;
use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};
use yugen_optics::frame::spherical;
use yugen_optics::statistics::sidak;
use yugen_reflectance::{Data, Kind};

/// How much to try.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Draws of the chi-square test at the default parameters; other sets get a fifth.
    pub samples: usize,
    /// Random parameter sets.
    pub random: usize,
    /// Pairs of directions for reciprocity and rotation, draws for weights.
    pub pairs: usize,
}

impl Effort {
    /// What the tests run.
    pub const FULL: Self = Self { samples: 1_000_000, random: 4, pairs: 4096 };
    /// A tenth of the draws, for work in progress.
    pub const QUICK: Self = Self { samples: 100_000, random: 2, pairs: 1024 };
}

/// One law.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the law.
    pub law: &'static str,
    /// Whether the model does as it says.
    pub passed: bool,
    /// The worst number seen.
    pub measured: f64,
    /// What it may be at most, or must be at least where the model declares that it breaks the law.
    pub bound: f64,
    /// For people: what was measured and where the worst was.
    pub sentence: String,
}

/// Every law of one model.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Which model.
    pub kind: Kind,
    /// One per law; empty where skipped.
    pub rows: Vec<Row>,
    /// Why nothing was tested.
    pub skipped: Option<String>,
}

impl Report {
    /// Whether all laws passed. A skipped report has not passed.
    pub fn passed(&self) -> bool {
        self.skipped.is_none() && !self.rows.is_empty() && self.rows.iter().all(|r| r.passed)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {}", self.kind.name(), self.kind.source())?;
        if let Some(why) = &self.skipped {
            writeln!(f, "  skipped: {why}")?;
        }
        for r in &self.rows {
            writeln!(f, "  {} {:<12} {}", if r.passed { "ok  " } else { "FAIL" }, r.law, r.sentence)?;
        }
        Ok(())
    }
}

/// All laws of `kind` at [`Effort::FULL`], without outside data.
pub fn report(kind: Kind) -> Report {
    report_with(kind, Effort::FULL, |_| None)
}

/// All laws of `kind`. `fixture` supplies the numbers that models with [`Data::Required`] need; where it has
/// none, the model's own made-up example serves.
pub fn report_with(kind: Kind, effort: Effort, fixture: impl Fn(Kind) -> Option<Vec<f32>>) -> Report {
    let skipped = |why| Report { kind, rows: Vec::new(), skipped: Some(why) };
    let data = fixture(kind).unwrap_or_else(|| kind.example());
    if let (Data::Required(what), true) = (kind.data(), data.is_empty()) {
        return skipped(format!("needs {what}"));
    }
    match parameter_sets(kind, &data, effort.random) {
        Ok(sets) => Report { kind, rows: check(&Sets(&sets), effort), skipped: None },
        Err(why) => skipped(why),
    }
}

/// Reports of several models, on all cores, in the order given.
pub fn reports(
    kinds: &[Kind],
    effort: Effort,
    fixture: impl Fn(Kind) -> Option<Vec<f32>> + Sync,
) -> Vec<Report> {
    let next = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(kinds.len());
    let mut all: Vec<(usize, Report)> = std::thread::scope(|scope| {
        let work = || {
            let mut mine = Vec::new();
            loop {
                let i = next.fetch_add(1, Ordering::Relaxed);
                let Some(&kind) = kinds.get(i) else { return mine };
                mine.push((i, report_with(kind, effort, &fixture)));
            }
        };
        let handles: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        handles.into_iter().flat_map(|h| h.join().unwrap_or_else(|e| std::panic::resume_unwind(e))).collect()
    });
    all.sort_by_key(|(i, _)| *i);
    all.into_iter().map(|(_, r)| r).collect()
}

/// Subjects that are one model with different parameters.
pub trait Family {
    /// How many.
    fn len(&self) -> usize;
    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Calls `f` with the label and the subject of set `i`.
    fn with(&self, i: usize, f: &mut dyn FnMut(&str, &dyn Subject));
}

struct Sets<'a>(&'a [Parameters]);

impl Family for Sets<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }
    fn with(&self, i: usize, f: &mut dyn FnMut(&str, &dyn Subject)) {
        f(&self.0[i].label, &self.0[i].bsdf());
    }
}

impl<S: Subject> Family for S {
    fn len(&self) -> usize {
        1
    }
    fn with(&self, _: usize, f: &mut dyn FnMut(&str, &dyn Subject)) {
        f("as given", self);
    }
}

/// Towards the eye: head on, oblique at odd azimuths, near grazing; and from below where light passes.
fn eyes(subject: &dyn Subject) -> Vec<Vec3> {
    let mut eyes: Vec<Vec3> = [(0.0f32, 0.0), (32.0, 0.4), (58.0, 2.3), (81.0, -2.0)]
        .map(|(theta, phi): (f32, f32)| spherical(theta.to_radians(), phi))
        .to_vec();
    if subject.laws().transmits {
        eyes.extend([eyes[1], eyes[2]].map(|w| Vec3::new(w.x, w.y, -w.z)));
    }
    eyes
}

/// Collects the worst finding of a law over parameter sets and directions.
struct Law {
    name: &'static str,
    declared_broken: Option<&'static str>,
    worst: Option<Finding>,
    tried: usize,
}

impl Law {
    fn new(name: &'static str) -> Self {
        Self { name, declared_broken: None, worst: None, tried: 0 }
    }

    /// A law that the model may declare broken, with its reason.
    fn declared(name: &'static str, holds: bool, why: &'static str) -> Self {
        Self { declared_broken: (!holds).then_some(why), ..Self::new(name) }
    }

    fn add(&mut self, label: &str, mut finding: Finding) {
        self.tried += 1;
        if self.worst.as_ref().is_none_or(|w| finding.strain() > w.strain()) {
            finding.note = format!("{label}: {}", finding.note);
            self.worst = Some(finding);
        }
    }

    fn row(self, what: &str) -> Row {
        let Some(f) = self.worst else {
            return Row {
                law: self.name,
                passed: false,
                measured: f64::NAN,
                bound: f64::NAN,
                sentence: "nothing was tested".into(),
            };
        };
        let note = f.note.trim_end_matches([' ', ':']);
        match self.declared_broken {
            Some(why) => Row {
                law: self.name,
                passed: f.value > f.broken,
                measured: f.value,
                bound: f.broken,
                sentence: format!(
                    "declared broken ({why}) and {}: {what} {:.4} in {} tries, {note}",
                    if f.value > f.broken { "is" } else { "IS NOT" },
                    f.value,
                    self.tried
                ),
            },
            None => Row {
                law: self.name,
                passed: f.holds(),
                measured: f.value,
                bound: f.bound,
                sentence: format!(
                    "{what} {:.3e} of {:.3e} allowed in {} tries, {note}",
                    f.value, f.bound, self.tried
                ),
            },
        }
    }
}

/// Significance of all chi-square tests of all models together.
const SIGNIFICANCE: f64 = 0.01;

/// All laws over one family: the parameter sets of a model, or a single [`Subject`].
pub fn check(family: &dyn Family, effort: Effort) -> Vec<Row> {
    let mut laws = None;
    family.with(0, &mut |_, s| laws = Some(s.laws()));
    let Some(laws) = laws.filter(|_| !family.is_empty()) else { return Vec::new() };
    let each = |f: &mut dyn FnMut(usize, &str, &dyn Subject)| {
        (0..family.len()).for_each(|i| family.with(i, &mut |label, s| f(i, label, s)));
    };
    let mut rows = Vec::new();

    let mut law = Law::new("finite");
    each(&mut |_, label, s| law.add(label, finite(s)));
    rows.push(law.row("calls not finite, negative or below the surface:"));

    if laws.delta {
        let mut law = Law::new("peaks");
        each(&mut |_, label, s| eyes(s).into_iter().for_each(|wo| law.add(label, delta(s, wo))));
        rows.push(law.row("excess probability of the Dirac peaks"));
    } else {
        let mut law = Law::new("weight");
        each(&mut |i, label, s| {
            let draws = if i == 0 { effort.pairs } else { effort.pairs / 4 };
            eyes(s).into_iter().for_each(|wo| law.add(label, sampling(s, wo, draws, i as u64)));
        });
        rows.push(law.row("share of draws with weight != f cos / pdf or pdf != pdf(wo, wi)"));

        // All directions for the default set, one in turn for each other.
        let tests: Vec<(usize, usize)> = (0..family.len())
            .flat_map(|i| {
                let mut count = 0;
                family.with(i, &mut |_, s| count = eyes(s).len());
                if i == 0 { (0..count).map(|e| (0, e)).collect() } else { vec![(i, (i + 1) % count)] }
            })
            .collect();
        let significance = sidak(SIGNIFICANCE, tests.len() * Kind::ALL.len());
        let (mut law, mut density) = (Law::new("chi-square"), Law::new("density"));
        for (i, eye) in tests {
            family.with(i, &mut |label, s| {
                let wo = eyes(s)[eye];
                let samples = if i == 0 { effort.samples } else { effort.samples / 5 };
                let r = chi_square(s, wo, &ChiSquare { samples, seed: i as u64, ..ChiSquare::default() });
                let fault = r.fault.as_ref().map_or(String::new(), |f| format!(" ({f})"));
                let at = format!("at ({:.3}, {:.3}, {:.3})", wo.x, wo.y, wo.z);
                law.add(
                    label,
                    Finding {
                        value: -r.p_value.log10(),
                        bound: -significance.log10(),
                        broken: f64::INFINITY,
                        note: format!("p = {:.3} over {} cells, {at}{fault}", r.p_value, r.dof + 1.0),
                    },
                );
                // Five standard errors of the share of hits, three of the quadrature, and 1e-4 for f32.
                let q = r.hit_rate;
                let allowed = 5.0 * (q * (1.0 - q) / samples as f64).sqrt() + 3.0 * r.integral_error + 1e-4;
                let off = (r.integral - q).abs().max(r.integral - 1.0);
                density.add(
                    label,
                    Finding {
                        value: if off.is_nan() { f64::INFINITY } else { off / allowed },
                        bound: 1.0,
                        broken: f64::INFINITY,
                        note: format!(
                            "the pdf integrates to {:.5}, {:.5} of the draws give light, {at}",
                            r.integral, q
                        ),
                    },
                );
            });
        }
        rows.push(law.row("-log10 p of draws against the pdf"));
        rows.push(density.row("distance of the integral of the pdf from the hit rate, over chance,"));

        let mut law = Law::new("coverage");
        each(&mut |i, label, s| {
            let wo = eyes(s)[(i + 2) % 4];
            law.add(label, coverage(s, wo, 16 * effort.pairs, i as u64));
        });
        rows.push(law.row("albedo by quadrature against sampling, over chance,"));

        let mut law = Law::declared("reciprocity", laws.reciprocal, laws.why);
        each(&mut |i, label, s| {
            law.add(label, reciprocity(s, if i == 0 { effort.pairs } else { effort.pairs / 4 }, i as u64));
        });
        rows.push(law.row("relative difference of f(wo, wi) and f(wi, wo)"));

        let mut law = Law::declared("rotation", laws.isotropic, "anisotropic");
        family.with(0, &mut |label, s| law.add(label, rotation(s, effort.pairs, 3)));
        rows.push(law.row("relative change when both directions turn"));
    }

    let mut law = Law::declared("energy", laws.conserves_energy, laws.why);
    each(&mut |_, label, s| law.add(label, energy(s, &eyes(s))));
    rows.push(law.row("largest share of light that leaves"));
    rows
}
