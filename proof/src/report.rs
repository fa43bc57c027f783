//! All laws of a model in one table.

use crate::laws::{Finding, coverage, delta, energy, finite, reciprocity, rotation, sampling};
use crate::parameters::{example_data, spare_sets};
use crate::{ChiSquare, Parameters, Subject, chi_square, parameter_sets, references};
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
/// none, those of the model's first preset serve.
pub fn report_with(kind: Kind, effort: Effort, fixture: impl Fn(Kind) -> Option<Vec<f32>>) -> Report {
    let skipped = |why| Report { kind, rows: Vec::new(), skipped: Some(why) };
    let data = fixture(kind).unwrap_or_else(|| example_data(kind));
    if let (Data::Required(what), true) = (kind.data(), data.is_empty()) {
        return skipped(format!("needs {what}"));
    }
    match parameter_sets(kind, &data, effort.random) {
        Ok(sets) => {
            let breaks = sets.iter().map(|s| s.bsdf().laws()).any(|l| !l.reciprocal || !l.conserves_energy);
            let spare = if breaks { spare_sets(kind, &data, SPARE) } else { Vec::new() };
            let mut rows = check(&Sets { sets: &sets, spare: &spare }, effort);
            let mut law = Law::new("furnace");
            for reference in references(kind) {
                law.add(&reference.label, reference.with(|s| reference.compare(s)));
            }
            if law.tried > 0 {
                rows.push(law.row("difference of the albedo from the published one"));
            }
            Report { kind, rows, skipped: None }
        }
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
    /// How many more there are, numbered after the others, in which to look for a law broken by declaration.
    fn spare(&self) -> usize {
        0
    }
    /// Calls `f` with the label and the subject of set `i`.
    fn with(&self, i: usize, f: &mut dyn FnMut(&str, &dyn Subject));
}

struct Sets<'a> {
    sets: &'a [Parameters],
    spare: &'a [Parameters],
}

impl Family for Sets<'_> {
    fn len(&self) -> usize {
        self.sets.len()
    }
    fn spare(&self) -> usize {
        self.spare.len()
    }
    fn with(&self, i: usize, f: &mut dyn FnMut(&str, &dyn Subject)) {
        let set = self.sets.get(i).unwrap_or_else(|| &self.spare[i - self.sets.len()]);
        f(&set.label, &set.bsdf());
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

/// Collects the worst finding of a law over parameter sets and directions: apart for those that promise to
/// keep it and those that declare that they break it.
struct Law {
    name: &'static str,
    kept: Option<Finding>,
    /// The clearest of each reason: every form that breaks a law must show it.
    broken: Vec<(&'static str, Finding)>,
    tried: usize,
}

impl Law {
    fn new(name: &'static str) -> Self {
        Self { name, kept: None, broken: Vec::new(), tried: 0 }
    }

    fn add(&mut self, label: &str, finding: Finding) {
        self.declared(label, finding, true, "");
    }

    fn declared(&mut self, label: &str, mut finding: Finding, holds: bool, why: &'static str) {
        self.tried += 1;
        finding.note = format!("{label}: {}", finding.note);
        if holds {
            if self.kept.as_ref().is_none_or(|w| finding.strain() > w.strain()) {
                self.kept = Some(finding);
            }
        } else if let Some((_, clearest)) = self.broken.iter_mut().find(|(reason, _)| *reason == why) {
            if finding.value / finding.broken > clearest.value / clearest.broken {
                *clearest = finding;
            }
        } else {
            self.broken.push((why, finding));
        }
    }

    /// Whether the law is declared broken for this reason and has not shown it yet.
    fn wants(&self, why: &str) -> bool {
        self.broken.iter().any(|(reason, f)| *reason == why && f.value <= f.broken)
    }

    fn row(self, what: &str) -> Row {
        let (mut passed, mut sentences) = (self.kept.is_some() || !self.broken.is_empty(), Vec::new());
        let (mut measured, mut bound) = (f64::NAN, f64::NAN);
        for (why, f) in &self.broken {
            let is = f.value > f.broken;
            passed &= is;
            (measured, bound) = (f.value, f.broken);
            sentences.push(format!(
                "declared broken ({why}) and {}: {what} {} where {} would show it, {}",
                if is { "is" } else { "IS NOT" },
                number(f.value),
                number(f.broken),
                tidy(&f.note)
            ));
        }
        if let Some(f) = &self.kept {
            passed &= f.holds();
            if !f.holds() || self.broken.is_empty() {
                (measured, bound) = (f.value, f.bound);
            }
            sentences.push(format!(
                "{what} {}, at most {}, {}",
                number(f.value),
                number(f.bound),
                tidy(&f.note)
            ));
        }
        if sentences.is_empty() {
            sentences.push("nothing was tested".into());
        }
        Row {
            law: self.name,
            passed,
            measured,
            bound,
            sentence: format!("{} ({} tries)", sentences.join("; "), self.tried),
        }
    }
}

fn tidy(note: &str) -> &str {
    note.trim_end_matches([' ', ':'])
}

/// Four digits, in the form that is easier to read.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-2..1e4).contains(&x.abs()) {
        let text = format!("{x:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        format!("{x:.1e}")
    }
}

/// Sets per form in which to look for a law that the form is declared to break.
const SPARE: usize = 40;

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
    let spare = |f: &mut dyn FnMut(&str, &dyn Subject)| {
        (family.len()..family.len() + family.spare()).for_each(|i| family.with(i, f));
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
                        note: format!("p = {:.3} over {} cells, {at}{fault}", r.p_value, r.cells),
                    },
                );
                // Five standard errors of the share of hits and of the quadrature, and 1e-4 for f32.
                let q = r.hit_rate;
                let allowed = 5.0 * (q * (1.0 - q) / samples as f64).sqrt() + 5.0 * r.integral_error + 1e-4;
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

        let mut law = Law::new("reciprocity");
        each(&mut |i, label, s| {
            let pairs = if i == 0 { effort.pairs } else { effort.pairs / 4 };
            law.declared(label, reciprocity(s, pairs, i as u64), s.laws().reciprocal, s.laws().why);
        });
        spare(&mut |label, s| {
            if !s.laws().reciprocal && law.wants(s.laws().why) {
                law.declared(label, reciprocity(s, effort.pairs, 1), false, s.laws().why);
            }
        });
        rows.push(law.row("relative difference of f(wo, wi) and f(wi, wo)"));

        let mut law = Law::new("rotation");
        family.with(0, &mut |label, s| {
            law.declared(label, rotation(s, effort.pairs, 3), laws.isotropic, "anisotropic");
        });
        rows.push(law.row("relative change when both directions turn"));
    }

    let mut law = Law::new("energy");
    each(&mut |_, label, s| {
        law.declared(label, energy(s, &eyes(s)), s.laws().conserves_energy, s.laws().why);
    });
    spare(&mut |label, s| {
        if !s.laws().conserves_energy && law.wants(s.laws().why) {
            law.declared(label, energy(s, &eyes(s)), false, s.laws().why);
        }
    });
    rows.push(law.row("largest share of light that leaves"));
    rows
}
