//! Every harness must see a model that is deliberately wrong.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::atomic::{AtomicUsize, Ordering};
use yugen_optics::frame::{mirror, spherical};
use yugen_optics::statistics::sidak;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf, uniform_hemisphere};
use yugen_proof::{ChiSquare, Effort, Subject, check, chi_square, example_data, parameter_sets, references};
use yugen_reflectance::{Bsdf, Kind, Laws, Sample};

/// What is wrong with a Lambert surface of albedo 1.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    /// π off by one percent in `eval`.
    Pi,
    /// The density of `pdf` and `sample` five percent too large.
    Density,
    /// f weighs the cosine of the eye only.
    OneSided,
    /// NaN where both directions agree.
    Nan,
    /// Draws crowd towards the normal by two percent.
    Crowded,
    /// Draws leave out a wedge of azimuths, with the density to match elsewhere.
    Wedge,
    /// Draws below the surface.
    Below,
    /// A factor along the tangent.
    Turned,
    /// Weights two percent too large.
    Weight,
}

struct Wrong(Fault);

impl Wrong {
    fn sampled(&self, u: Vec3) -> Vec3 {
        let mut wi = cosine_hemisphere(u.truncate());
        match self.0 {
            Fault::Crowded => wi = Vec3::new(wi.x * 0.98, wi.y * 0.98, wi.z).normalize(),
            Fault::Wedge if wi.x > 3.0 * wi.y.abs() => wi.x = -wi.x,
            Fault::Below if u.z < 0.001 => wi.z = -wi.z,
            _ => {}
        }
        wi
    }
}

impl Subject for Wrong {
    fn laws(&self) -> Laws {
        Laws::PHYSICAL
    }
    fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        Vec3::splat(match self.0 {
            Fault::Pi => 1.0 / (PI * 0.99),
            Fault::OneSided => FRAC_1_PI * (1.0 - 0.1 * wo.z),
            Fault::Nan if wo == wi => f32::NAN,
            Fault::Turned => FRAC_1_PI * (0.9 + 0.05 * (wi.x * wi.x + wo.x * wo.x)),
            _ => FRAC_1_PI,
        })
    }
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 {
            return 0.0;
        }
        let pdf = cosine_hemisphere_pdf(wi);
        match self.0 {
            Fault::Density => 1.05 * pdf,
            Fault::Wedge if wi.x > 3.0 * wi.y.abs() => 0.0,
            Fault::Wedge if mirror(wi).x > 3.0 * wi.y.abs() => 2.0 * pdf,
            _ => pdf,
        }
    }
    fn sample(&self, wo: Vec3, u: Vec3) -> Option<Sample> {
        let wi = self.sampled(u);
        if wo.z <= 0.0 || wi.z == 0.0 {
            return None;
        }
        let pdf = self.pdf(wo, wi).max(1e-30);
        let mut weight = self.eval(wo, wi) * wi.z / pdf;
        if self.0 == Fault::Weight {
            weight *= 1.02;
        }
        Some(Sample { wi, weight: weight.max(Vec3::ZERO), pdf, delta: false, eta: 1.0 })
    }
}

/// A model of the list whose sampler is one percent off; its density says nothing of it.
#[derive(Clone, Copy, Debug)]
enum Slip {
    /// Draws crowd towards the normal: their slopes are one percent too small.
    Crowded,
    /// One draw in a hundred goes anywhere.
    Astray,
}

struct Slipped<'a>(Bsdf<'a>, Slip);

impl Subject for Slipped<'_> {
    fn laws(&self) -> Laws {
        self.0.laws()
    }
    fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.0.eval(wo, wi)
    }
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.0.pdf(wo, wi)
    }
    fn sample(&self, wo: Vec3, u: Vec3) -> Option<Sample> {
        match self.1 {
            Slip::Astray if u.x < 0.01 => {
                let wi = uniform_hemisphere(Vec2::new(100.0 * u.x, u.y));
                self.0.sample(wo, u).map(|s| Sample { wi, ..s })
            }
            Slip::Astray => self.0.sample(wo, Vec3::new((u.x - 0.01) / 0.99, u.y, u.z)),
            Slip::Crowded => self.0.sample(wo, u).map(|s| {
                let wi = Vec3::new(0.99 * s.wi.x, 0.99 * s.wi.y, s.wi.z).normalize();
                Sample { wi, ..s }
            }),
        }
    }
}

/// -log10 p of the chi-square test at the default parameters, for one direction after the other until it is
/// beyond doubt; the largest.
fn doubt(kind: Kind, slip: Slip) -> f64 {
    // Beyond the bound of any report: 0.01 by Šidák over a hundred tests of every model.
    let enough = -sidak(0.01, 100 * Kind::ALL.len()).log10();
    let sets =
        parameter_sets(kind, &example_data(kind), 0).unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
    let mut worst = 0.0;
    for (theta, phi) in [(32.0f32, 0.4), (58.0, 2.3), (81.0, -2.0), (0.0, 0.0)] {
        let wo = spherical(theta.to_radians(), phi);
        let settings = ChiSquare { samples: Effort::FULL.samples, ..ChiSquare::default() };
        let p = chi_square(&Slipped(sets[0].bsdf(), slip), wo, &settings).p_value;
        worst = f64::max(worst, -p.log10());
        if worst > enough {
            return worst;
        }
    }
    panic!("{}: {slip:?} by one percent goes unseen: -log10 p = {worst:.1} of {enough:.1}", kind.name())
}

#[test]
fn one_percent_in_the_sampler_of_any_model_is_caught() {
    let kinds: Vec<Kind> = Kind::ALL.iter().copied().filter(|k| !k.laws().delta).collect();
    assert!(kinds.len() > 20, "{} models", kinds.len());
    let next = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(&kind) = kinds.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let seen = [Slip::Crowded, Slip::Astray].map(|slip| doubt(kind, slip));
                    println!("{}: -log10 p = {:.1}, {:.1}", kind.name(), seen[0], seen[1]);
                }
            });
        }
    });
}

/// A model a tenth of a percent too bright.
struct Brighter<'a>(&'a dyn Subject);

impl Subject for Brighter<'_> {
    fn laws(&self) -> Laws {
        self.0.laws()
    }
    fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        1.001 * self.0.eval(wo, wi)
    }
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.0.pdf(wo, wi)
    }
    fn sample(&self, wo: Vec3, u: Vec3) -> Option<Sample> {
        self.0.sample(wo, u)
    }
}

#[test]
fn every_published_albedo_tells_a_model_that_is_a_little_too_bright() {
    let mut count = 0;
    for reference in Kind::ALL.iter().flat_map(|k| references(*k)) {
        let found = reference.with(|s| reference.compare(&Brighter(s)));
        assert!(!found.holds(), "{}: {}", reference.label, found.note);
        count += 1;
    }
    assert!(count > 0, "no reference was read");
}

/// Names of the laws that fail.
fn caught(fault: Fault) -> Vec<&'static str> {
    check(&Wrong(fault), Effort { samples: 1_000_000, random: 0, pairs: 1024 })
        .into_iter()
        .filter(|r| !r.passed)
        .map(|r| r.law)
        .collect()
}

#[test]
fn a_right_model_passes() {
    assert_eq!(caught(Fault::None), Vec::<&str>::new());
}

#[test]
fn every_fault_is_caught_by_the_law_that_forbids_it() {
    for (fault, law) in [
        (Fault::Pi, "energy"),
        (Fault::Density, "density"),
        (Fault::Density, "chi-square"),
        (Fault::OneSided, "reciprocity"),
        (Fault::Nan, "finite"),
        (Fault::Crowded, "chi-square"),
        (Fault::Wedge, "coverage"),
        (Fault::Below, "finite"),
        (Fault::Below, "chi-square"),
        (Fault::Turned, "rotation"),
        (Fault::Weight, "weight"),
        (Fault::Weight, "coverage"),
    ] {
        let laws = caught(fault);
        assert!(laws.contains(&law), "{law} did not see {fault:?}; only {laws:?}");
    }
}

/// A model that claims to break what it keeps must be caught too.
struct Humble;

impl Subject for Humble {
    fn laws(&self) -> Laws {
        Laws {
            reciprocal: false,
            conserves_energy: false,
            isotropic: false,
            why: "it says so",
            ..Laws::PHYSICAL
        }
    }
    fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        Wrong(Fault::None).eval(wo, wi)
    }
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        Wrong(Fault::None).pdf(wo, wi)
    }
    fn sample(&self, wo: Vec3, u: Vec3) -> Option<Sample> {
        Wrong(Fault::None).sample(wo, u)
    }
}

#[test]
fn a_false_confession_is_caught() {
    let failed: Vec<_> =
        check(&Humble, Effort::QUICK).into_iter().filter(|r| !r.passed).map(|r| r.law).collect();
    assert_eq!(failed, ["reciprocity", "rotation", "energy"]);
}
