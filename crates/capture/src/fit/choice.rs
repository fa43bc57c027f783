//! Whether a texel has a highlight at all.
//!
//! A wide highlight and a ground look alike, but a highlight follows the half vector and a ground the light: a matte surface
//! that is taken for a wide highlight comes out at half its tilt. And what lies in shadow or is lit by its neighbours can
//! often be described by seven numbers where three cannot. So the ground by itself, found by robust photometric stereo,
//! stands against ground and highlight, and these must describe more of the readings to be believed.

use super::fitted::{Fitted, Kind, NOTHING};
use super::model::{self, N, SIGMA};
use super::profile::Profile;
use super::rays::Rays;
use super::refine::GaussianPrior;
use super::scratch::Scratch;
use crate::lanes::{F, LANES, Mask};
use crate::normals::stereo::{self, Light, Solved, Task};
use crate::normals::{self, Surface};
use glam::Vec3;
use yugen_optics::Frame;
use yugen_reflectance::btf::Texel;

// How much hangs on these constants: each was halved and doubled, or nearly so, and the rendered matte cow (50 lights), the
// glazed one (24), kinran (20), karaori (50) and kinran through a blurred lens (50) fitted again, by `capture fit STACK -o
// x.btf --truth TRUTH --blur 0 --json` (cows: `multilight` of YUGEN_DATA; cloths: `capture simulate` and `hdr` as in
// docs/capture.md, 128 x 128). Means of normals stay
// within .001° on the matte cow and 1.58° to 1.61° on the glazed one, failed texels at 52 to 70 of 16384 (66 as it is) and
// 101 to 102; what changes more is said below. That is the blurred cloth, whose texels no highlight describes: of 16384, 6005
// are sure of themselves, and 832 of these off by more than 5°.

/// Readings that a highlight must describe which the ground does not: one for each two of its five numbers. Twice as many
/// make 52 texels of kinran fail instead of 66.
const OWED: f32 = 2.5;
/// From this width on, of the greater σ, it owes this part of all readings besides: it can pass for a ground. From .25 on, or
/// twice as much, 644 and 668 texels of the blurred cloth are sure and wrong; from .5 on, or half as much, 1955 and 1378.
const WIDE: f32 = 0.35;
const OWED_WIDE: f32 = 0.3;
/// So much it owes where it leaves this part of the level of the readings and more, and down to a quarter of it where it
/// describes them better: a law that is met to a hundredth is proof by itself. At .06 1131 texels of the blurred cloth are
/// sure and wrong.
const ROUGH: f32 = 0.03;

/// A ground is believed whose normal is expected to be off by no more degrees than the first, and not at all from the second on.
const CREDIBLE: [f32; 2] = [10.0, 20.0];
/// The margin of a ground that is not believed is at most this, however little it costs: it tells nothing of its kind.
const NO_EVIDENCE: f32 = -1.0;
/// What the confidence of a highlight is at most that is taken from its kind, or that is wide among grounds. At .6 19 texels
/// of karaori are sure and wrong, here none.
pub(super) const RARE: f32 = 0.3;
/// Odds of nineteen to one.
const NEARLY_ALL: f32 = 3.0;
/// A ground that costs less than this a reading describes nearly all of them.
const PLAIN: f32 = 0.1;
/// What costs more than this a reading leaves many undescribed.
const POOR: f32 = 0.2;

/// Whether there can be texels that [`Ground::is_certain`] of, if grounds are as common as this at most.
pub(super) fn may_settle(most_odds: f32) -> bool {
    most_odds + OWED > 0.0
}

/// The greater σ of a texel's numbers.
pub(super) fn widest(theta: &[F; N], lane: usize) -> f32 {
    model::surface(&theta.map(|t| t.0[lane])).2.max_element()
}

/// A texel that has no highlight.
pub(super) fn of_ground(normal: Vec3, albedo: Vec3, confidence: f32) -> Texel {
    let tangent = Frame::from_normal_tangent(normal, Vec3::X).s;
    Texel { diffuse: albedo, normal, tangent, confidence, ..NOTHING.texel }
}

/// The ground of eight texels beside what they were fitted with.
pub(super) struct Ground<'a> {
    /// `None` as long as no fit is so bad that the ground could be chosen.
    found: Option<Found>,
    /// What the readings cost with the ground, and with the fit.
    cost: F,
    fitted: F,
    /// By what part of their level the fit leaves readings off.
    left: F,
    readings: F,
    /// What both are judged by.
    lights: &'a [Light],
    triplets: &'a [[usize; 3]],
    usable: Vec<F>,
    task: Task,
}

/// The ground by itself.
struct Found {
    solved: Solved,
    albedo: [F; 3],
}

impl<'a> Ground<'a> {
    /// Not yet found: [`Ground::compare`] or [`Ground::find`] has to follow.
    pub fn new(
        lights: &'a [Light],
        scratch: &Scratch,
        triplets: &'a [[usize; 3]],
        surface: &Surface,
    ) -> Self {
        let usable: Vec<F> = scratch.stated.iter().map(|w| w.above(F::ZERO)).collect();
        let task = normals::task(surface, &normals::Options::default());
        let readings = usable.iter().fold(F::ZERO, |sum, u| sum + *u);
        let (cost, fitted, left) = (F::splat(f32::INFINITY), F::ZERO, F::ZERO);
        Self { found: None, cost, fitted, left, readings, lights, triplets, usable, task }
    }

    /// Whatever the fit is.
    pub fn find(&mut self, scratch: &Scratch) {
        let Self { lights, triplets, usable, task, .. } = self;
        self.found.get_or_insert_with(|| {
            let solved = stereo::solve_block(lights, &scratch.value, usable, triplets, task);
            let albedo = stereo::albedo(lights, &scratch.value, &scratch.channels, usable, &solved, task);
            Found { solved, albedo }
        });
    }

    /// Beside what was fitted, with this profile. Found only where it might be chosen.
    pub fn compare<R: Rays>(
        &mut self,
        rays: R,
        scratch: &Scratch,
        theta: &[F; N],
        profile: &Profile,
        odds: &[f32; LANES],
    ) {
        let mut seen = vec![F::ZERO; scratch.value.len()];
        model::model(rays, theta, profile, &mut seen);
        let slopes = [theta[2], theta[3]];
        let other =
            stereo::cost_of_other(self.lights, &scratch.value, &self.usable, &seen, slopes, &self.task);
        (self.fitted, self.left) = (other.cost, other.part);
        if (0..LANES).any(|lane| self.could_win(lane, widest(theta, lane), odds[lane])) {
            self.find(scratch);
        }
        if let Some(Found { solved, .. }) = &self.found {
            self.cost =
                stereo::cost(self.lights, &scratch.value, &self.usable, solved, other.slack, &self.task);
        }
    }

    /// Whether a ground that described all readings would be chosen.
    fn could_win(&self, lane: usize, widest: f32, odds: f32) -> bool {
        let widest = if is_exception(odds) { 0.0 } else { widest };
        self.readings.0[lane] > 0.0 && self.fitted.0[lane] + self.owed(lane, widest) + odds > 0.0
    }

    /// Whether it is chosen, and no second look is needed: because it describes nearly all readings, or is what most of its
    /// kind are. Of 94 578 such texels of two matte things, a glazed one and a stone, none got a highlight by a second look.
    pub fn is_plain(&self, lane: usize, widest: f32, odds: f32) -> bool {
        self.wins(lane, widest, odds) && (odds > 0.0 || self.cost.0[lane] < PLAIN * self.readings.0[lane])
    }

    /// What it says of a texel by itself that has so many readings; so much of its confidence is left.
    pub fn fitted(&self, lane: usize, readings: usize, left: f32) -> Option<Fitted> {
        let Found { solved, albedo } = self.found.as_ref()?;
        let normal = Vec3::from(solved.g.map(|g| g.0[lane])).try_normalize().filter(|n| n.z > 0.0)?;
        let albedo = Vec3::from(albedo.map(|c| c.0[lane]));
        Some(Fitted {
            kind: Kind::Ground,
            texel: of_ground(normal, albedo, solved.confidence.0[lane] * left),
            residual: solved.residual.0[lane],
            readings: readings as u16,
            passes: 0,
        })
    }

    /// How sure it is, 0 where it was not found.
    pub fn confidence(&self) -> F {
        self.found.as_ref().map_or(F::ZERO, |f| f.solved.confidence)
    }

    /// What the ground costs beside the best fit that there could be.
    pub fn most_cost(&self, scratch: &Scratch) -> F {
        let slack = stereo::least_slack(&scratch.value, &self.usable);
        match &self.found {
            Some(Found { solved, .. }) => {
                stereo::cost(self.lights, &scratch.value, &self.usable, solved, slack, &self.task)
            }
            None => self.cost,
        }
    }

    /// Whether a texel has no highlight whatever a fit makes of it: one that described all readings and were as narrow as
    /// could be would not be believed. `most` is what the ground then costs.
    pub fn is_certain(&self, lane: usize, most: f32, odds: f32) -> bool {
        let credible = self.credible(lane);
        let margin = credible * OWED - most;
        if credible > 0.0 {
            margin + odds > 0.0
        } else {
            odds > NEARLY_ALL && margin.min(NO_EVIDENCE) + odds > 0.0
        }
    }

    /// What is known of a texel before it is fitted once more: where its coat makes a normal of Lambert's law alone lean.
    pub fn with_normal_prior(&self, known: &GaussianPrior, taken: Mask) -> GaussianPrior {
        let Some(Found { solved, .. }) = &self.found else { return *known };
        let [x, y, z] = solved.g;
        let steep = F::ONE / z.max(F::splat(1e-6));
        let slopes = [x * steep, y * steep];
        let stretch = slopes[0] * slopes[0] + slopes[1] * slopes[1] + 1.0;
        let deviation = stretch * solved.error * (std::f32::consts::PI / 180.0);
        let precision = F::ONE / (deviation * deviation).max(F::splat(1e-6));
        let mut held = *known;
        for (i, slope) in [2, 3].into_iter().zip(slopes) {
            held.mean[i] = taken.choose(slope, held.mean[i]);
            for j in 0..N {
                let own = if i == j { precision } else { F::ZERO };
                held.precision[i][j] = taken.choose(own, held.precision[i][j]);
                held.precision[j][i] = held.precision[i][j];
            }
        }
        held
    }

    /// By how much better the ground by itself describes the readings of a texel than the fit, whose highlight is as wide
    /// as this, what that owes taken off: a logarithm of odds, as costs are halves of χ² as far as they grow.
    pub fn margin(&self, lane: usize, widest: f32) -> f32 {
        // What the highlight owes it owes to a ground that can be believed: not to one of metal.
        let credible = self.credible_beside(lane, widest);
        let margin = self.fitted.0[lane] + credible * self.owed(lane, widest) - self.cost.0[lane];
        if credible > 0.0 { margin } else { margin.min(NO_EVIDENCE) }
    }

    /// What a highlight as wide as this owes to a ground.
    fn owed(&self, lane: usize, widest: f32) -> f32 {
        if widest <= WIDE {
            return OWED;
        }
        let rough = (self.left.0[lane] / ROUGH).clamp(0.25, 1.0);
        OWED + OWED_WIDE * rough * self.readings.0[lane] * (widest / WIDE).min(SIGMA[1] / WIDE)
    }

    fn credible(&self, lane: usize) -> f32 {
        let [good, bad] = CREDIBLE;
        let error = self.found.as_ref().map_or(bad, |f| f.solved.error.0[lane]);
        ((bad - error) / (bad - good)).clamp(0.0, 1.0)
    }

    /// The same against a highlight as wide as this. One that can pass for a ground and leaves many readings undescribed
    /// is no better than any ground.
    fn credible_beside(&self, lane: usize, widest: f32) -> f32 {
        let poor = self.fitted.0[lane] > POOR * self.readings.0[lane];
        if widest > WIDE && poor { 1.0 } else { self.credible(lane) }
    }

    /// Whether a texel has no highlight, if as many of its kind have none.
    pub fn wins(&self, lane: usize, widest: f32, odds: f32) -> bool {
        // Where highlights are the rule a wide one owes no more than others.
        let widest = if is_exception(odds) { 0.0 } else { widest };
        // Of two that are not believed it is the one that nearly all of its kind are.
        let believed = self.credible_beside(lane, widest) > 0.0 || odds > NEARLY_ALL;
        believed && self.margin(lane, widest) + odds > 0.0
    }
}

/// The most that the confidence of a highlight of this width may be among texels that mostly have none.
pub(super) fn most_confidence(widest: f32, odds: f32) -> f32 {
    if widest > WIDE && odds > 0.0 { RARE } else { 1.0 }
}

/// How common texels without a highlight are in each cluster of these margins, as logarithms of odds. Threads are of one
/// kind: where highlights are the rule, texels that show none were met by no light.
pub(super) fn odds(clusters: &[Vec<f32>]) -> Vec<f32> {
    let shares: Vec<f32> = clusters.iter().map(|m| share(m)).collect();
    let texels: usize = clusters.iter().map(Vec::len).sum();
    let all: f32 = clusters.iter().zip(&shares).map(|(m, s)| m.len() as f32 * s).sum();
    // Next to nothing without a highlight is what no light met, in clusters of its own: threads that lean.
    let rule = if all < SCARCE * texels as f32 { 1.0 } else { RULE };
    let logarithm = |share: f32| (share / (1.0 - share)).ln();
    shares.into_iter().map(|s| logarithm(if s < rule { RAREST } else { s })).collect()
}

/// The share that makes itself likely: expectation and maximisation, from even odds on.
fn share(margins: &[f32]) -> f32 {
    let mut share = 0.5f32;
    for _ in 0..50 {
        let odds = (share / (1.0 - share)).ln();
        let sum: f32 = margins.iter().map(|m| 1.0 / (1.0 + (-(m + odds)).exp())).sum();
        share = (sum / margins.len().max(1) as f32).clamp(RAREST, 1.0 - RAREST);
    }
    share
}

/// Among a few hundred texels that are looked at there may always be one of another kind.
const RAREST: f32 = 0.002;
/// Fewer texels without a highlight than this part are exceptions.
const RULE: f32 = 0.25;
/// Of all texels; fewer are hardly a material of their own.
const SCARCE: f32 = 0.1;
/// Logarithms of odds below this are those of an exception.
const EXCEPTION: f32 = -5.0;

/// Whether grounds that are as common as this are exceptions.
pub(super) fn is_exception(odds: f32) -> bool {
    odds < EXCEPTION
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    /// Of fifty readings, all lanes alike: what ground and fit cost, by how much the fit leaves readings off, and by how
    /// many degrees the ground is expected to be.
    fn ground(cost: f32, fitted: f32, left: f32, error: f32) -> Ground<'static> {
        let surface = Surface { ground: normals::Ground::Matte, roughness: 0.0, slack: 0.05 };
        let [zero, one] = [F::ZERO, F::ONE];
        let solved = Solved {
            g: [zero, zero, one],
            error: F::splat(error),
            confidence: one,
            residual: zero,
            agreeing: F::splat(50.0),
            cost: zero,
        };
        Ground {
            found: Some(Found { solved, albedo: [one; 3] }),
            cost: F::splat(cost),
            fitted: F::splat(fitted),
            left: F::splat(left),
            readings: F::splat(50.0),
            lights: &[],
            triplets: &[],
            usable: Vec::new(),
            task: normals::task(&surface, &normals::Options::default()),
        }
    }

    #[test]
    fn a_wide_highlight_has_to_describe_more_than_a_narrow_one() {
        let rough = ground(10.0, 0.0, ROUGH, 1.0);
        assert!(!rough.wins(0, 0.2, 0.0) && rough.wins(0, 0.6, 0.0));
        // One that is met to a fraction of that is proof by itself; among its like a wide one owes no more than others.
        assert!(!ground(10.0, 0.0, 0.25 * ROUGH, 1.0).wins(0, 0.6, 0.0));
        assert!(!rough.wins(0, 0.6, EXCEPTION - 1.0));
        assert!(ground(0.5, 8.0, ROUGH, 1.0).wins(0, 0.6, EXCEPTION - 1.0), "met by no light");
    }

    #[test]
    fn a_ground_that_is_not_believed_needs_nearly_all_of_its_kind() {
        let metal = ground(0.1, 4.0, 0.001, CREDIBLE[1] + 5.0);
        assert_eq!(metal.margin(0, 0.2), NO_EVIDENCE);
        assert!(!metal.wins(0, 0.2, NEARLY_ALL - 0.1) && metal.wins(0, 0.2, NEARLY_ALL + 0.1));
        // Half believed: half of what is owed.
        let half = ground(0.0, 0.0, 0.0, 0.5 * (CREDIBLE[0] + CREDIBLE[1]));
        assert!((half.margin(0, 0.2) - 0.5 * OWED).abs() < 1e-5);
        // A highlight that can pass for a ground and describes few of the readings is no better than any ground.
        let poor = |fitted: f32, widest: f32| ground(12.0, fitted, ROUGH, 90.0).credible_beside(0, widest);
        assert_eq!((poor(1.1 * POOR * 50.0, 0.5), poor(0.9 * POOR * 50.0, 0.5)), (1.0, 0.0));
        assert_eq!(poor(1.1 * POOR * 50.0, 0.9 * WIDE), 0.0);
    }

    /// What is decided without a fit, or without a ground, is decided as with it.
    #[test]
    fn shortcuts_change_no_choice() {
        let mut rng = Pcg32::new(5, 5);
        let (mut certain, mut impossible) = (0, 0);
        for _ in 0..20_000 {
            let (u, v) = (rng.next_vec3(), rng.next_vec3());
            let (cost, fitted, odds) = (20.0 * u.x * u.x, 20.0 * u.y * u.y, 12.5 * u.z - 6.25);
            let (left, error, widest) = (0.06 * v.x, 30.0 * v.y, 1.2 * v.z);
            let ground = ground(cost, fitted, left, error);
            let wins = ground.wins(0, widest, odds);
            // The most that the ground may cost is no less than what it costs.
            if ground.is_certain(0, cost, odds) {
                certain += 1;
                assert!(wins, "{cost} {fitted} {odds} {left} {error} {widest}");
            }
            if !ground.could_win(0, widest, odds) {
                impossible += 1;
                assert!(!wins, "{cost} {fitted} {odds} {left} {error} {widest}");
            }
        }
        assert!(certain > 1000 && impossible > 1000, "{certain} {impossible}");
    }
}
