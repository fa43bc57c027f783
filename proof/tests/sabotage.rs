//! Every harness must see a model that is deliberately wrong.

use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};
use yugen_optics::frame::mirror;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use yugen_proof::{Effort, Subject, check};
use yugen_reflectance::{Laws, Sample};

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
