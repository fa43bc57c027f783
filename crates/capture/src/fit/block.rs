//! The fit of eight texels in step.

use super::choice::{self, Ground, RARE, widest};
use super::confidence::confidence;
use super::descent::{Descent, Solution, chi2, ward_of};
use super::features::{self, Features};
use super::fitted::{Fitted, Kind};
use super::model::{N, linear_of, robust_weights, scale, surface};
use super::noise::{self, Tally};
use super::outcome::{Evidence, Outcome};
use super::prior::{self, Prior};
use super::profile::Profile;
use super::rays::Rays;
use super::refine::Refined;
use super::scratch::Scratch;
use super::start;
use super::tails::products;
use super::task::{BlockWork, Geometry, Task};
use crate::lanes::{F, LANES, Mask};
use crate::normals;
use glam::Vec3;
use yugen_reflectance::btf::Texel;

/// The fit.
pub(super) struct FullFit<'a> {
    pub task: &'a Task<'a>,
}

impl BlockWork for FullFit<'_> {
    type Out = Outcome;
    fn of<R: Rays>(&self, geometry: Geometry<R>, scratch: &mut Scratch) -> [Outcome; LANES] {
        block(geometry, self.task, scratch)
    }
}

/// The ground of those that are certain to have nothing else.
pub(super) struct GroundOnly<'a> {
    pub task: &'a Task<'a>,
}

impl BlockWork for GroundOnly<'_> {
    type Out = Option<Outcome>;
    fn of<R: Rays>(&self, geometry: Geometry<R>, scratch: &mut Scratch) -> [Option<Outcome>; LANES] {
        let Task { options, prior, .. } = self.task;
        let Some(surface) = &options.surface else { return Default::default() };
        let usable = scratch.usable();
        let (features, cluster) = look(geometry.rays, scratch, *prior);
        let odds = odds(*prior, &cluster);
        let mut ground = Ground::new(geometry.lights, scratch, geometry.triplets, surface);
        ground.find(scratch);
        let most = ground.most_cost(scratch);
        std::array::from_fn(|lane| {
            let settled =
                usable[lane] >= options.least_readings && ground.is_certain(lane, most.0[lane], odds[lane]);
            let fitted = settled.then(|| ground.fitted(lane, usable[lane], 1.0)).flatten()?;
            Some(Outcome { fitted, features: features[lane], ..Outcome::NONE })
        })
    }
}

/// What eight texels look like, and which cluster of the prior does as well.
fn look<R: Rays>(
    rays: R,
    scratch: &Scratch,
    prior: Option<&Prior>,
) -> ([Features; LANES], [Option<usize>; LANES]) {
    let features: [Features; LANES] = std::array::from_fn(|lane| {
        features::of(
            |i| rays.of(i, lane),
            |i| scratch.stated[i].0[lane] > 0.0,
            scratch.value.len(),
            |i| [0, 1, 2].map(|c| scratch.channels[c][i].0[lane]),
        )
    });
    let cluster = features.map(|f| prior.and_then(|p| p.nearest(&f)));
    (features, cluster)
}

/// How common texels without a highlight are among those that look alike.
fn odds(prior: Option<&Prior>, cluster: &[Option<usize>; LANES]) -> [f32; LANES] {
    cluster.map(|c| prior.zip(c).map_or(0.0, |(p, c)| p.ground(c)))
}

/// Fits eight texels whose readings lie in `scratch`.
fn block<R: Rays>(geometry: Geometry<R>, task: &Task, scratch: &mut Scratch) -> [Outcome; LANES] {
    let Geometry { rays, lights, triplets } = geometry;
    let Task { options, prior, learning, twice, settle } = *task;
    scratch.weight.clone_from(&scratch.stated);
    let usable = scratch.usable();
    let (features, cluster) = look(rays, scratch, prior);
    let known = prior::known(prior, &cluster);
    let usual = cluster.map(|c| prior.zip(c).map(|(p, c)| p.shape(c)));
    let odds = odds(prior, &cluster);

    let profile = &prior.map_or(Profile::GAUSSIAN, Prior::profile);
    let start = start::best(rays, scratch, &usual, profile);
    let found_noise = &prior.map_or(*options, |p| p.noise(options));
    let descent = Descent { rays, profile, known: &known, found: found_noise };
    let mut done = descent.from(start, scratch);
    let mut ground =
        options.surface.as_ref().filter(|_| !learning).map(|s| Ground::new(lights, scratch, triplets, s));
    // The ground that is fitted with a highlight is Lambert's.
    let other_law = options.surface.is_some_and(|s| s.ground != normals::Ground::Matte);
    if let Some(ground) = ground.as_mut().filter(|_| other_law || !settle) {
        ground.find(scratch);
    }
    let compare = |ground: &mut Option<Ground>, done: &Refined, scratch: &Scratch| {
        if let Some(ground) = ground {
            ground.compare(rays, scratch, &done.theta, profile, &odds);
        }
    };
    compare(&mut ground, &done.refined, scratch);
    let doubtful = doubtful(&done, ground.as_ref(), &usable, &odds);
    if twice && doubtful.any() {
        for start in start::elsewhere(rays, scratch, &usual, &known, profile, &done.refined.theta) {
            let other = descent.from(start, scratch);
            let better = doubtful * done.posterior(&known).above(other.posterior(&known));
            done.exchange(better, other);
        }
        compare(&mut ground, &done.refined, scratch);
    }
    // From here on normals may be held to the ground's; it is the free fit that stood against the ground.
    if let Some(ground) = ground.as_ref().filter(|_| other_law) {
        hold_to_ground(
            &descent,
            &mut done,
            ground,
            ground.confidence().above(F::splat(0.5)),
            &[2, 3],
            scratch,
        );
    }
    // Threads of a kind that has highlights, which lean away from all lights: the ground tells the normal, the kind the rest.
    let leaning = ground.as_ref().map_or(F::ZERO, |ground| leaning(&done.refined, ground, &odds));
    if let Some(ground) = ground.as_ref().filter(|_| leaning.any()) {
        hold_to_ground(&descent, &mut done, ground, leaning, &[1, 2, 3, 4, 5, 6], scratch);
    }
    std::mem::swap(&mut scratch.weight, &mut done.weight);
    let (loss, done) = (done.loss, done.refined);
    robust_weights(rays, &scratch.value, &scratch.weight, &done.theta, profile, &loss, &mut scratch.counted);
    let (products, noise) = match learning {
        true => (
            products(rays, &scratch.value, &scratch.counted, &done.theta),
            noise::tally(rays, scratch, &done.theta, profile),
        ),
        false => ([F::ZERO; _], [Tally::default(); LANES]),
    };
    // The maps know Ward's fall only: the Gaussian that is most like what was found, in place and direction.
    let shown = if profile.is_gaussian() { done } else { ward_of(rays, scratch, &done, options) };

    let colours = colours(rays, scratch, &shown);
    std::array::from_fn(|lane| {
        let theta = done.theta.map(|t| t.0[lane]);
        let doubtful = doubtful.0[lane] > 0.5;
        let none = Outcome { theta, features: features[lane], doubtful, ..Outcome::NONE };
        if usable[lane] < options.least_readings && (cluster[lane].is_none() || usable[lane] < 3) {
            return none;
        }
        // Noise as found, where there is more of it than was said: then every number is as much worse.
        let chi2 = chi2(done.sums.cost.0[lane], usable[lane]);
        let information = done.sums.curvature.map(|row| row.map(|v| v.0[lane] / chi2));
        let slope = done.sums.gradient.map(|v| v.0[lane] / chi2);
        let free = with_highlight(&done, &shown, &colours, &information, usable[lane], lane);
        let widest = free.texel.sigma.max_element();
        let margin = ground.as_ref().map_or(0.0, |g| g.margin(lane, widest));
        let fitted = match &ground {
            Some(ground) if leaning.0[lane] > 0.5 => {
                let height = shown.theta[1].0[lane].exp() / scale(&shown.theta.map(|t| t.0[lane]));
                guessed(free, height, ground.confidence().0[lane])
            }
            Some(ground) => believed(free, ground, odds[lane], usable[lane], lane),
            None => free,
        };
        let evidence = learning.then(|| {
            let (products, noise) = (products.map(|p| p.0[lane]), noise[lane]);
            Box::new(Evidence { information, slope, products, noise })
        });
        Outcome { fitted, margin, evidence, ..none }
    })
}

/// Texels whose readings are described badly or do not decide, but for those that are plainly nothing but a ground.
fn doubtful(done: &Solution, ground: Option<&Ground>, usable: &[usize; LANES], odds: &[f32; LANES]) -> Mask {
    F(std::array::from_fn(|lane| {
        let poor = done.refined.sums.cost.0[lane] > 4.0 * usable[lane] as f32;
        let unsure = confidence(&done.information(lane, usable[lane]), 0.0, 0.0) < 0.8;
        let widest = widest(&done.refined.theta, lane);
        let plain = ground.is_some_and(|g| g.is_plain(lane, widest, odds[lane]));
        if usable[lane] > 0 && (poor || unsure) && !plain { 1.0 } else { 0.0 }
    }))
}

/// Texels among those whose kind has highlights that are described by a ground alone: no light met theirs.
fn leaning(done: &Refined, ground: &Ground, odds: &[f32; LANES]) -> Mask {
    F(std::array::from_fn(|lane| {
        let widest = widest(&done.theta, lane);
        let leans = choice::is_exception(odds[lane]) && ground.wins(lane, widest, odds[lane]);
        if leans { 1.0 } else { 0.0 }
    }))
}

/// Fits texels once more with the normal of their ground, the numbers of `afresh` started from what is known of them.
fn hold_to_ground<R: Rays>(
    descent: &Descent<R>,
    done: &mut Solution,
    ground: &Ground,
    taken: Mask,
    afresh: &[usize],
    scratch: &mut Scratch,
) {
    let held = ground.with_normal_prior(descent.known, taken);
    let mut start = done.refined.theta;
    for i in afresh.iter().copied() {
        start[i] = taken.choose(held.mean[i], start[i]);
    }
    let other = Descent { known: &held, ..*descent }.from(start, scratch);
    done.exchange(taken, other);
}

/// A texel as it was fitted: `done` is that, `shown` its Gaussian.
fn with_highlight(
    done: &Refined,
    shown: &Refined,
    (diffuse, specular): &([F; 3], [F; 3]),
    information: &[[f32; N]; N],
    usable: usize,
    lane: usize,
) -> Fitted {
    let seen = shown.theta.map(|t| t.0[lane]);
    let height = scale(&seen);
    let (normal, tangent, sigma) = surface(&seen);
    let residual = (done.sums.cost.0[lane] / usable as f32).sqrt();
    let texel = Texel {
        diffuse: diffuse.map(|c| c.0[lane]).into(),
        specular: specular.map(|c| c.0[lane] / height).into(),
        normal,
        tangent,
        sigma,
        confidence: confidence(information, sigma.max_element(), residual),
    };
    let (readings, passes) = (usable as u16, done.passes.0[lane] as u16);
    Fitted { kind: kind_of(&texel), texel, residual, readings, passes }
}

/// A texel whose highlight no light met, so that its normal is the ground's, of this confidence, and the highlight what its
/// kind has, as bright as this; no reading tells the colour.
fn guessed(free: Fitted, specular: f32, confidence: f32) -> Fitted {
    let specular = Vec3::splat(specular.min(BRIGHTEST));
    let texel = Texel { specular, confidence: confidence * RARE, ..free.texel };
    Fitted { kind: kind_of(&texel), texel, ..free }
}

/// What is believed of a texel: its highlight, or the ground alone.
fn believed(free: Fitted, ground: &Ground, odds: f32, usable: usize, lane: usize) -> Fitted {
    let mut fitted = free;
    let Texel { specular, sigma, confidence, .. } = free.texel;
    let widest = sigma.max_element();
    // Brighter than anything reflects: no light met the highlight, and it may be as high as it likes.
    let absurd = specular.max_element() > BRIGHTEST;
    if absurd && choice::is_exception(odds) {
        // Shape and direction are those of its kin.
        fitted.texel.specular /= specular.max_element();
        fitted.texel.confidence = confidence.min(GUESSED);
    } else if absurd || ground.wins(lane, widest, odds) {
        let left = if absurd { LEFT_BELOW_A_HIGHLIGHT } else { 1.0 };
        if let Some(found) = ground.fitted(lane, usable, left) {
            fitted = Fitted { passes: free.passes, ..found };
        }
    } else {
        fitted.texel.confidence = confidence.min(choice::most_confidence(widest, odds));
    }
    fitted
}

/// Of a texel that has a highlight.
fn kind_of(texel: &Texel) -> Kind {
    let bare = texel.diffuse.element_sum() < BARE * texel.specular.element_sum();
    if bare { Kind::Highlight } else { Kind::Both }
}

/// Less ground than this part of the highlight is none.
const BARE: f32 = 0.02;
/// Of ρ_s: twice what conserves energy.
const BRIGHTEST: f32 = 2.0;
/// What the confidence of a texel is at most whose highlight is a guess.
const GUESSED: f32 = 0.05;
/// What is left of the confidence of a ground below a highlight that no light met. Of the glazed cow (`capture fit` with
/// `--truth normals.png --blur 0`) 18 of 5564 texels that
/// are sure of themselves are off by more than 5°; with nothing taken off 26 of 5627, with half 14 of 5462.
const LEFT_BELOW_A_HIGHLIGHT: f32 = 0.8;

/// D and A of each channel.
fn colours<R: Rays>(rays: R, scratch: &Scratch, done: &Refined) -> ([F; 3], [F; 3]) {
    let [r, g, b] = &scratch.channels;
    let found = linear_of(rays, [r, g, b], &scratch.counted, &done.theta, &Profile::GAUSSIAN);
    (found.map(|(d, ..)| d), found.map(|(_, a, _)| a))
}
