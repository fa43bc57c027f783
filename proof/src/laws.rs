//! The laws, one function each. All are deterministic: same seed, same verdict.

use crate::Subject;
use crate::chi_square::{domain, guides};
use crate::integrate::{Domain, Partition, Rule};
use glam::{Vec2, Vec3};
use yugen_optics::distribution::ONE_MINUS_EPSILON;
use yugen_optics::random::Pcg32;
use yugen_optics::statistics::Moments;
use yugen_optics::warp::{uniform_hemisphere, uniform_sphere};

/// What a law measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The worst number seen; infinite where something was not finite.
    pub value: f64,
    /// The law holds where `value <= bound`.
    pub bound: f64,
    /// The law is clearly broken, not by rounding, where `value > broken`.
    pub broken: f64,
    /// Where the worst was, for people.
    pub note: String,
}

impl Finding {
    pub(crate) fn new(bound: f64, broken: f64) -> Self {
        Self { value: 0.0, bound, broken, note: String::new() }
    }

    /// Keeps the larger value. NaN counts as infinite.
    pub(crate) fn see(&mut self, value: f64, note: impl FnOnce() -> String) {
        let value = if value.is_nan() { f64::INFINITY } else { value };
        if value > self.value {
            self.value = value;
            self.note = note();
        }
    }

    /// Whether the law holds.
    pub fn holds(&self) -> bool {
        self.value <= self.bound
    }

    /// How near the bound, or how far beyond.
    pub(crate) fn strain(&self) -> f64 {
        if self.value == 0.0 { 0.0 } else { self.value / self.bound }
    }
}

fn show(w: Vec3) -> String {
    format!("({:.4}, {:.4}, {:.4})", w.x, w.y, w.z)
}

/// Uniforms that cover the cube: a Kronecker sequence of the plastic numbers (Roberts 2018, R3).
fn cube(i: usize) -> Vec3 {
    let part = |a: f64| (((i as f64 + 0.5) * a).fract() as f32).min(ONE_MINUS_EPSILON);
    Vec3::new(part(0.819_172_513_396_164_4), part(0.671_043_606_703_789_2), part(0.549_700_477_901_970_3))
}

fn random_direction(subject: &dyn Subject, rng: &mut Pcg32) -> Vec3 {
    let u = Vec2::new(rng.next_f32(), rng.next_f32());
    if subject.laws().transmits { uniform_sphere(u) } else { uniform_hemisphere(u) }
}

/// |a − b| relative to the larger, with differences below `floor` forgiven.
fn difference(a: Vec3, b: Vec3, floor: f32) -> f64 {
    let scale = a.abs().max_element().max(b.abs().max_element()).max(floor);
    f64::from((a - b).abs().max_element() / scale)
}

/// Directional albedo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Albedo {
    /// ∫ f |cos θ_i| dω_i plus Dirac peaks.
    pub value: Vec3,
    /// Standard error of the quadrature.
    pub error: f32,
}

/// Draws for Dirac peaks: stratified, so that the share of each lobe is exact to 1/n.
const PEAK_DRAWS: usize = 4096;

/// Mean weight of the Dirac peaks of `wo`, each weight multiplied by `eta^exponent`.
fn peaks(subject: &dyn Subject, wo: Vec3, exponent: i32) -> Vec3 {
    let mut sum = glam::DVec3::ZERO;
    for i in 0..PEAK_DRAWS {
        let mut u = cube(i);
        u.z = (i as f32 + 0.5) / PEAK_DRAWS as f32;
        if let Some(s) = subject.sample(wo, u).filter(|s| s.delta) {
            sum += (s.weight * s.eta.powi(exponent)).as_dvec3();
        }
    }
    (sum / PEAK_DRAWS as f64).as_vec3()
}

const FURNACE: Rule = Rule { tolerance: 2e-5, budget: 600_000 };

fn quadrature(subject: &dyn Subject, w: Vec3, rule: Rule, f: impl Fn(Vec3) -> Vec3) -> Albedo {
    let found = guides(subject, w, 1024, 7);
    let domain = domain(subject);
    // A lobe as narrow on either side takes twice as many cells.
    let budget = if domain == Domain::Sphere { 2 * rule.budget } else { rule.budget };
    let p =
        Partition::new(domain, &found, Rule { budget, ..rule }, |v| (f(v) * v.z.abs()).as_dvec3().to_array());
    let [r, g, b] = p.integral();
    Albedo { value: Vec3::new(r as f32, g as f32, b as f32), error: p.error() as f32 }
}

/// Directional albedo at `wo` under a furnace of radiance 1, by adaptive quadrature: no samples, no weights.
pub fn albedo(subject: &dyn Subject, wo: Vec3) -> Albedo {
    let smooth = quadrature(subject, wo, FURNACE, |wi| subject.eval(wo, wi));
    Albedo { value: smooth.value + peaks(subject, wo, 0), ..smooth }
}

/// Directional albedo at `wo` under a furnace of radiance 1, accurate to about 1e-4.
pub fn furnace(subject: &dyn Subject, wo: Vec3) -> Vec3 {
    albedo(subject, wo).value
}

/// Value: share of draws whose weight is not f |cos θ_i| / pdf, or whose pdf is not `pdf(wo, wi)`, to 1e-3.
///
/// Where one `f32` step of the direction changes the density by more than that, four such changes are
/// allowed: no sampler can do better. Draws on an edge (a table's cell, a horizon) may differ: 2 in 1000.
pub fn sampling(subject: &dyn Subject, wo: Vec3, draws: usize, seed: u64) -> Finding {
    const TOLERANCE: f64 = 1e-3;
    let mut finding = Finding::new(2e-3, 2e-2);
    let mut rng = Pcg32::new(seed, 0x7361);
    let (mut bad, mut worst, mut at) = (0, 0.0, String::from("no draw differs"));
    for _ in 0..draws {
        let u = rng.next_vec3();
        let Some(s) = subject.sample(wo, u).filter(|s| !s.delta) else { continue };
        let (f, pdf) = subject.eval_pdf(wo, s.wi);
        let expected = f * (s.wi.z.abs() / s.pdf);
        let split = difference(f, subject.eval(wo, s.wi), 1e-6).max(difference(
            Vec3::splat(pdf),
            Vec3::splat(subject.pdf(wo, s.wi)),
            1e-6,
        ));
        // Weights below 1e-3 carry no light worth a rounding error.
        let miss = difference(s.weight, expected, 1e-3)
            .max(difference(Vec3::splat(s.pdf), Vec3::splat(pdf), 1e-6))
            .max(split);
        if miss <= TOLERANCE {
            continue;
        }
        let slack = [Vec3::X, Vec3::Y]
            .into_iter()
            .map(|axis| {
                let moved = (s.wi + axis.cross(s.wi) * f32::EPSILON).normalize();
                let (g, q) = subject.eval_pdf(wo, moved);
                difference(f, g, 1e-9).max(difference(Vec3::splat(pdf), Vec3::splat(q), 1e-9))
            })
            .fold(0.0, f64::max);
        if miss.is_nan() || miss > TOLERANCE + 4.0 * slack.min(0.05) {
            bad += 1;
            if miss.is_nan() || miss > worst {
                worst = miss;
                at = format!(
                    "worst at wo = {}, u = {u}: weight {} against {expected}, pdf {} against {pdf}",
                    show(wo),
                    s.weight,
                    s.pdf
                );
            }
        }
    }
    finding.note = at.clone();
    finding.see(f64::from(bad) / draws as f64, || at);
    finding
}

/// Value: difference between the albedo by quadrature over `eval` and by the mean weight of `sample`, over
/// what chance allows. Finds draws that miss part of the lobe, which the weights alone do not show.
pub fn coverage(subject: &dyn Subject, wo: Vec3, draws: usize, seed: u64) -> Finding {
    let mut finding = Finding::new(1.0, 2.0);
    let exact = albedo(subject, wo);
    let mut rng = Pcg32::new(seed, 0x636f);
    let mut moments = [Moments::default(); 3];
    for _ in 0..draws {
        let weight = subject.sample(wo, rng.next_vec3()).map_or(Vec3::ZERO, |s| s.weight);
        moments.iter_mut().zip(weight.to_array()).for_each(|(m, w)| m.push(f64::from(w)));
    }
    for (m, exact_value) in moments.iter().zip(exact.value.to_array()) {
        // Five standard errors; and 2e-3 of the value, since rare large weights hide from the variance.
        let exact_value = f64::from(exact_value);
        let allowed =
            5.0 * m.standard_error() + 5.0 * f64::from(exact.error) + 2e-3 * exact_value.abs() + 1e-5;
        finding.see((m.mean() - exact_value).abs() / allowed, || {
            format!(
                "at wo = {}: {:.5} by quadrature, {:.5} +- {:.5} by sampling",
                show(wo),
                exact_value,
                m.mean(),
                m.standard_error()
            )
        });
    }
    finding
}

/// Value: worst difference between f(wo, wi) and f(wi, wo), relative to the larger. Across an interface the
/// two differ by the square of the relative index (Veach 1997, 5.2); models that leave that out are taken as
/// they are, if they do so everywhere.
pub fn reciprocity(subject: &dyn Subject, pairs: usize, seed: u64) -> Finding {
    let mut rng = Pcg32::new(seed, 0x7265);
    let mut found = Vec::with_capacity(pairs);
    for i in 0..pairs {
        let wo = random_direction(subject, &mut rng);
        // Half of the pairs from the sampler, or narrow lobes would never be met.
        let drawn = subject.sample(wo, rng.next_vec3()).filter(|s| !s.delta);
        let across = drawn.is_some_and(|s| s.wi.z * wo.z < 0.0);
        let (wi, eta) = match drawn {
            Some(s) if i % 2 == 0 || across => (s.wi, if across { s.eta } else { 1.0 }),
            _ => {
                let wi = random_direction(subject, &mut rng);
                // The index between the two sides is known from draws only.
                (if wi.z * wo.z < 0.0 { -wi } else { wi }, 1.0)
            }
        };
        // f itself may be ill-defined at the horizon, where 1/cos terms overflow.
        if wo.z.abs() > 1e-3 && wi.z.abs() > 1e-3 {
            found.push((wo, wi, subject.eval(wo, wi), subject.eval(wi, wo), eta));
        }
    }
    let floor = 1e-5 * found.iter().map(|f| f.2.abs().max_element()).fold(0.0, f32::max);
    [0, 2, -2]
        .into_iter()
        .map(|exponent| {
            // Rounding of a few dozen f32 operations; a broken law shows at 1e-2 and more.
            let mut finding = Finding::new(5e-4, 1e-2);
            for (wo, wi, a, b, eta) in &found {
                let b = *b * eta.powi(exponent);
                finding.see(difference(*a, b, floor.max(1e-12)), || {
                    format!("at {} and {}: {a} against {b}", show(*wo), show(*wi))
                });
            }
            finding
        })
        .min_by(|a, b| a.value.total_cmp(&b.value))
        .expect("three exponents")
}

/// Value: the largest share of light that leaves, over `directions`. For a reflector the directional albedo
/// of the furnace; where light passes through, the flux that leaves for light from one direction, which must
/// not exceed what came although radiance may (its solid angle shrinks by the square of the index).
pub fn energy(subject: &dyn Subject, directions: &[Vec3]) -> Finding {
    let exponents: &[i32] = if subject.laws().transmits { &[0, 2, -2] } else { &[0] };
    let smooth: Vec<Albedo> = directions
        .iter()
        .map(|&w| {
            if subject.laws().delta {
                Albedo { value: Vec3::ZERO, error: 0.0 }
            } else if subject.laws().transmits {
                quadrature(subject, w, FURNACE, |wo| subject.eval(wo, w))
            } else {
                quadrature(subject, w, FURNACE, |wi| subject.eval(w, wi))
            }
        })
        .collect();
    exponents
        .iter()
        .map(|&exponent| {
            let mut finding = Finding::new(1.0, 1.001);
            for (&w, smooth) in directions.iter().zip(&smooth) {
                let total = smooth.value + peaks(subject, w, exponent);
                // 1e-4 for f32; five standard errors of the quadrature; lobe shares to 1/n.
                let bound =
                    1.0001 + 5.0 * f64::from(smooth.error) + if total == smooth.value { 0.0 } else { 1e-3 };
                let largest = if total.is_finite() { f64::from(total.max_element()) } else { f64::INFINITY };
                if largest / bound > finding.strain() {
                    let note = format!("{total} leaves at {}", show(w));
                    finding = Finding { value: largest, bound, broken: bound + 1e-3, note };
                }
            }
            finding
        })
        .min_by(|a, b| a.strain().total_cmp(&b.strain()))
        .expect("at least one exponent")
}

/// Value: worst relative change of f and pdf when both directions turn about the normal together.
pub fn rotation(subject: &dyn Subject, pairs: usize, seed: u64) -> Finding {
    // An anisotropic model moves by far more than a percent somewhere.
    let mut finding = Finding::new(2e-3, 1e-2);
    let mut rng = Pcg32::new(seed, 0x726f);
    for i in 0..pairs {
        let wo = random_direction(subject, &mut rng);
        let drawn = subject.sample(wo, rng.next_vec3()).filter(|s| !s.delta && i % 2 == 0);
        let wi = drawn.map_or_else(|| random_direction(subject, &mut rng), |s| s.wi);
        if wo.z.abs() < 1e-2 || wi.z.abs() < 1e-2 {
            continue;
        }
        let turn = glam::Quat::from_rotation_z(std::f32::consts::TAU * rng.next_f32());
        let (f, p) = subject.eval_pdf(wo, wi);
        let (g, q) = subject.eval_pdf(turn * wo, turn * wi);
        // Values far below the diffuse level are tails where a rounded angle is a large ratio.
        finding.see(difference(f, g, 1e-3).max(difference(Vec3::splat(p), Vec3::splat(q), 1e-3)), || {
            format!("at {} and {}, turned: f {f} becomes {g}, pdf {p} becomes {q}", show(wo), show(wi))
        });
    }
    finding
}

/// Directions where formulas break: poles, tangents, grazing, oblique, and below the surface.
pub(crate) fn edge_directions() -> Vec<Vec3> {
    let mut all = vec![Vec3::Z, -Vec3::Z, Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y];
    for z in [1e-7f32, 1e-4, 0.02, 0.5, 0.999_999] {
        for phi in [0.0f32, 0.7, 2.5, -1.5] {
            let r = (1.0 - z * z).max(0.0).sqrt();
            all.push(Vec3::new(r * phi.cos(), r * phi.sin(), z).normalize());
        }
    }
    for z in [-1e-7, -1e-3, -0.6] {
        all.push(Vec3::new((1.0f32 - z * z).sqrt() * 0.6, (1.0f32 - z * z).sqrt() * 0.8, z).normalize());
    }
    all
}

/// Value: how many calls gave something not finite, negative, or lit from the wrong side, over the edges of
/// the domain of directions and uniforms. None may.
pub fn finite(subject: &dyn Subject) -> Finding {
    let mut finding = Finding::new(0.0, 0.0);
    let laws = subject.laws();
    let directions = edge_directions();
    let mut count = 0u32;
    let mut first = String::new();
    let mut fault = |what: String| {
        count += 1;
        if count == 1 {
            first = what;
        }
    };
    let good = |v: f32| v.is_finite() && v >= 0.0;
    let all_good = |v: Vec3| v.to_array().into_iter().all(good);
    for &wo in &directions {
        for &wi in directions.iter().chain([&wo]) {
            let (f, pdf) = subject.eval_pdf(wo, wi);
            if !all_good(f) || !good(pdf) {
                fault(format!("f = {f}, pdf = {pdf} at wo = {wo}, wi = {wi}"));
            }
            if !laws.transmits && (wo.z < 0.0 || wi.z < 0.0) && (f != Vec3::ZERO || pdf != 0.0) {
                fault(format!("f = {f}, pdf = {pdf} from below: wo = {wo}, wi = {wi}"));
            }
            if laws.delta && (f != Vec3::ZERO || pdf != 0.0) {
                fault(format!("f = {f}, pdf = {pdf} of a model of Dirac peaks at wo = {wo}, wi = {wi}"));
            }
        }
        let ends = [0.0, 1e-7, 0.5, ONE_MINUS_EPSILON];
        for i in 0..64 {
            let u = Vec3::new(ends[i % 4], ends[i / 4 % 4], ends[i / 16]);
            let Some(s) = subject.sample(wo, u) else { continue };
            let unit = (s.wi.length() - 1.0).abs() < 1e-3;
            let probable = s.pdf.is_finite() && s.pdf > 0.0;
            if !unit || !probable || !all_good(s.weight) || !(1e-3..1e3).contains(&s.eta) {
                fault(format!("the draw {s:?} at wo = {wo}, u = {u}"));
            }
            if !laws.transmits && (wo.z < 0.0 || s.wi.z < 0.0) {
                fault(format!("a draw below the surface: wi = {} at wo = {wo}, u = {u}", s.wi));
            }
        }
    }
    finding.see(f64::from(count), || first);
    finding
}

/// For Dirac peaks: value is the largest deviation from a proper choice: every draw a peak, its probability
/// in (0, 1], and probabilities of the peaks met that sum to one at most.
pub fn delta(subject: &dyn Subject, wo: Vec3) -> Finding {
    let mut finding = Finding::new(1e-3, 1e-2);
    let mut peaks: Vec<(Vec3, f32)> = Vec::new();
    for i in 0..PEAK_DRAWS {
        let Some(s) = subject.sample(wo, cube(i)) else { continue };
        if !s.delta {
            finding.see(f64::INFINITY, || format!("a draw that is no Dirac peak at wo = {}", show(wo)));
        }
        if !peaks.iter().any(|(w, _)| w.distance(s.wi) < 1e-4) {
            peaks.push((s.wi, s.pdf));
        }
    }
    let sum: f32 = peaks.iter().map(|(_, p)| p).sum();
    finding.see(f64::from(sum) - 1.0, || format!("the probabilities of {} peaks sum to {sum}", peaks.len()));
    finding
}
