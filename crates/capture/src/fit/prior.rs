//! What texels of the same thread have in common.
//!
//! Cloth repeats: a thread shows the same widths, the same albedos and one of few directions in every repeat of the weave,
//! but its normal, and so what each light finds of its highlight, differs from texel to texel. A sample of texels is put
//! into clusters by what their readings look like before any fit; in each, the Gaussian that their numbers are drawn from
//! is found by expectation and maximisation, every texel counting by what its own readings could tell. Few lights of
//! many texels so become many lights of one thread. How highlights fall off is learned of all texels together: one texel
//! meets few half vectors of a sharp highlight, all of them meet every one.

use super::model::{COLUMNS, N, OWN, Profile, Ray, Rays, TERMS, Theta, model};
use super::refine::Known;
use super::start::solve;
use super::{Options, Outcome, Room, Task, fit_range, fit_twice, in_parallel};
use crate::Stack;
use crate::lanes::{F, LANES};
use yugen_optics::random::Pcg32;

/// What a texel looks like, in units in which a difference of one is a different thread.
pub(crate) type Features = [f32; 7];

type Matrix = [[f64; N]; N];

/// What is known of any cloth: the inverse variances of ρ_d, ln A, a, b, m, p, q. Nothing of the ground; of the rest so
/// little that three readings outweigh it.
pub(crate) const VAGUE: [f32; N] = [0.0, 0.05, 3.0, 3.0, 0.4, 0.6, 0.6];
const USUAL: Theta = [0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0];

/// The threads of a cloth, learned from a sample of its texels.
#[derive(Clone, Debug)]
pub struct Prior {
    clusters: Vec<Cluster>,
    profile: Profile,
    /// Standard deviations of readings as they were found: a part of them, and what black ones have.
    noise: [f32; 2],
}

#[derive(Clone, Debug)]
struct Cluster {
    centre: Features,
    mean: [f64; N],
    precision: Matrix,
}

/// A texel of the sample.
struct Member {
    band: usize,
    texel: usize,
    found: Outcome,
}

impl std::ops::Deref for Member {
    type Target = Outcome;
    fn deref(&self) -> &Outcome {
        &self.found
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
/// The numbers of θ that belong to the material, and those that belong to the normal.
const MATERIAL: [usize; 5] = [0, 1, 4, 5, 6];
const NORMAL: [usize; 2] = [2, 3];
/// Texels that are looked at.
const SAMPLE: usize = 6144;

impl Prior {
    /// Learns from texels spread over `bands`. `None` where there are too few of them.
    pub fn learn(bands: &[Stack], options: &Options, threads: usize) -> Option<Self> {
        let groups: Vec<(usize, usize)> = bands
            .iter()
            .enumerate()
            .flat_map(|(b, s)| (0..(s.width * s.height).div_ceil(LANES)).map(move |g| (b, g)))
            .collect();
        let wanted = (SAMPLE / LANES).min(groups.len());
        let chosen: Vec<_> = (0..wanted).map(|i| groups[i * groups.len() / wanted]).collect();
        let quantum = quantum(bands);
        let mut prior: Option<Self> = None;
        let mut centres = Vec::new();
        // The first time without a prior, then with what that taught; a highlight with tails takes longer to be told
        // from a ground.
        let (mut left, mut tails) = (3, false);
        while left > 0 {
            left -= 1;
            let task = Task { options, prior: prior.as_ref(), learning: true, twice: left < 2 };
            let outcomes = in_parallel(chosen.len(), threads, |i, room| {
                let (band, group) = chosen[i];
                let stack = &bands[band];
                let (from, to) = (group * LANES, ((group + 1) * LANES).min(stack.width * stack.height));
                fit_range(stack, &task, from..to, room)
            });
            let found = outcomes.into_iter().zip(&chosen).flat_map(|(group, &(band, first))| {
                group.into_iter().enumerate().map(move |(i, o)| Member {
                    band,
                    texel: first * LANES + i,
                    found: o,
                })
            });
            let outcomes: Vec<Member> = found.filter(|o| o.fitted.readings > 0).collect();
            if centres.is_empty() {
                if outcomes.len() < FEWEST {
                    return None;
                }
                centres = k_means(&outcomes, (outcomes.len() / (2 * FEWEST)).clamp(1, CLUSTERS));
            }
            let profile = profile_of(&outcomes);
            if !tails && !profile.is_gaussian() {
                tails = true;
                // Widths and heights mean something else now.
                prior = Some(Self { clusters: Vec::new(), profile, noise: [options.noise, options.floor] });
                left = PASSES_WITH_TAILS;
                continue;
            }
            let mut members = vec![Vec::new(); centres.len()];
            for o in &outcomes {
                members[nearest(&centres, &o.features)].push(o);
            }
            let of_some = centres.iter().zip(&members).filter(|(_, m)| m.len() >= FEWEST);
            let clusters = of_some.clone().map(|(c, m)| Cluster::of(*c, m)).collect();
            let mut found = Self { clusters, profile, noise: noise_of(&outcomes, options, quantum) };
            if left == 0 {
                let members: Vec<&[&Member]> = of_some.map(|(_, m)| m.as_slice()).collect();
                found.adopt(&members, bands, options, threads);
            }
            prior = Some(found);
        }
        prior.filter(|p| !p.clusters.is_empty())
    }

    /// What leans so far that no lamp meets its highlight cannot say what it is made of. Where its readings are as well
    /// described by what another cluster is made of, that is what it is made of as well.
    fn adopt(&mut self, members: &[&[&Member]], bands: &[Stack], options: &Options, threads: usize) {
        let sure = |c: usize| members[c].iter().filter(|m| m.fitted.texel.confidence > 0.5).count();
        let decided = |c: usize| 2 * sure(c) > members[c].len();
        // Of clusters that are made of the same, the one that most are sure of.
        let mut order: Vec<usize> = (0..members.len()).filter(|c| decided(*c)).collect();
        order.sort_by_key(|c| std::cmp::Reverse(sure(*c)));
        let mut materials: Vec<Cluster> = Vec::new();
        for c in order {
            let material = self.clusters[c].material();
            if materials.iter().all(|m| m.differs(&material)) {
                materials.push(material);
            }
        }
        for c in (0..members.len()).filter(|c| !decided(*c)) {
            let step = members[c].len().div_ceil(TRIED);
            let tried: Vec<&Member> = members[c].iter().step_by(step).copied().collect();
            let of_band = |b: usize| tried.iter().filter(|m| m.band == b).map(|m| m.texel).collect();
            let texels: Vec<(usize, Vec<usize>)> = (0..bands.len()).map(|b| (b, of_band(b))).collect();
            let mut least = MOST_DEBT;
            let mut kin = None;
            for material in &materials {
                let alone =
                    Self { clusters: vec![material.clone()], profile: self.profile, noise: self.noise };
                let task = Task { options, prior: Some(&alone), learning: false, twice: true };
                let again = in_parallel(texels.len(), threads, |i, room| {
                    let (band, texels) = &texels[i];
                    fit_twice(&bands[*band], &task, texels, room)
                });
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
                self.clusters[c] = material.leaning(self.clusters[c].centre, &again);
            }
        }
    }

    pub(crate) fn profile(&self) -> Profile {
        self.profile
    }

    /// The options with the noise that was found.
    pub(crate) fn noise(&self, options: &Options) -> Options {
        let [noise, floor] = self.noise;
        Options { noise, floor, ..*options }
    }

    pub(crate) fn nearest(&self, features: &Features) -> Option<usize> {
        let far = |c: &Cluster| distance(&c.centre, features);
        (0..self.clusters.len()).min_by(|&a, &b| far(&self.clusters[a]).total_cmp(&far(&self.clusters[b])))
    }

    /// m, p and q of a cluster's mean.
    pub(crate) fn shape(&self, cluster: usize) -> [f32; 3] {
        let mean = &self.clusters[cluster].mean;
        [mean[4], mean[5], mean[6]].map(|v| v as f32)
    }
}

/// Residuals of readings by how bright they are: how large in sum, and how many.
pub(crate) type Tally = [[f32; 2]; BINS];

/// Each is twice as bright as the one before.
const BINS: usize = 18;
/// Where the first begins.
const DARKEST: f32 = 1.0 / 16384.0;
/// Less noise than that of the numbers in a file of 16-bit floats is not believed.
const LEAST_NOISE: [f32; 2] = [5e-4, 2e-5];

/// Residuals of eight texels, without those that the robust loss takes for something else than noise.
pub(crate) fn noise<R: Rays>(rays: R, room: &Room, theta: &[F; N], profile: &Profile) -> [Tally; LANES] {
    let mut seen = vec![F::ZERO; room.value.len()];
    model(rays, theta, profile, &mut seen);
    std::array::from_fn(|lane| {
        let mut tally = Tally::default();
        for (i, seen) in seen.iter().enumerate() {
            let [seen, value, weight, counted] =
                [seen, &room.value[i], &room.weight[i], &room.counted[i]].map(|v| v.0[lane]);
            if weight > 0.0 && counted > 0.7 * weight {
                let bin = ((seen / DARKEST).max(1.0).log2() as usize).min(BINS - 1);
                tally[bin] = [tally[bin][0] + (seen - value).abs(), tally[bin][1] + 1.0];
            }
        }
        tally
    })
}

/// The step between the dark values that pictures of whole numbers have; next to nothing for others.
fn quantum(bands: &[Stack]) -> f32 {
    const DARK: f32 = 0.1;
    let all = bands.iter().flat_map(|s| &s.values).map(|v| v[0]);
    let mut dark: Vec<f32> = all.filter(|v| *v > 0.0 && *v < DARK).take(1 << 20).collect();
    dark.sort_unstable_by(f32::total_cmp);
    // Closer ones are the same whole number, computed in another way.
    let gaps = dark.windows(2).map(|w| w[1] - w[0]).filter(|gap| *gap > 1e-6);
    gaps.fold(DARK, f32::min)
}

/// The noise, as a part of the reading and of black, that makes the residuals what they are.
fn noise_of(outcomes: &[Member], options: &Options, quantum: f32) -> [f32; 2] {
    let mut h = [[0.0; 2]; 2];
    let mut g = [0.0; 2];
    for bin in 0..BINS {
        let (mut sum, mut count, mut freedom) = (0.0, 0.0, 0.0);
        for o in outcomes {
            let [s, c] = o.noise[bin].map(f64::from);
            let n = f64::from(o.fitted.readings);
            sum += s;
            count += c;
            freedom += c * (1.0 - N as f64 / n).max(0.1);
        }
        if count < 50.0 {
            continue;
        }
        // √(π/2) times the mean of |z| is the deviation of a normal deviate; a fit takes some of it up.
        let deviation: f64 = (std::f64::consts::FRAC_PI_2 / (count * freedom)).sqrt() * sum;
        let level = if bin == 0 { 0.0 } else { f64::from(DARKEST) * 1.44 * (bin as f64).exp2() };
        let w = count / (deviation * deviation + 1e-12);
        let row = [level, 1.0];
        for a in 0..2 {
            g[a] += w * row[a] * deviation;
            for b in 0..2 {
                h[a][b] += w * row[a] * row[b];
            }
        }
    }
    if h[1][1] <= 0.0 {
        return [options.noise, options.floor];
    }
    // What the readings are rounded to is noise as well, which does not show where all of them are black: a step over
    // √12, for the mean of three channels over √36.
    let least = f64::from(LEAST_NOISE[1].max(quantum / 6.0));
    let black = solve(h, g).map_or(0.0, |s| s[1]).max(least);
    let part = (g[0] - h[0][1] * black) / h[0][0];
    [(part as f32).max(LEAST_NOISE[0]), black as f32]
}

/// What is known of eight texels before they are fitted.
pub(crate) fn known(prior: Option<&Prior>, cluster: &[Option<usize>; LANES]) -> Known {
    let mut known = Known { mean: USUAL.map(F::splat), precision: [[F::ZERO; N]; N] };
    for (i, row) in known.precision.iter_mut().enumerate() {
        row[i] = F::splat(VAGUE[i]);
    }
    for (lane, cluster) in cluster.iter().enumerate() {
        let Some(cluster) = cluster.and_then(|c| prior.map(|p| &p.clusters[c])) else { continue };
        for i in 0..N {
            known.mean[i].0[lane] = cluster.mean[i] as f32;
            for j in 0..N {
                known.precision[i][j].0[lane] = cluster.precision[i][j] as f32;
            }
        }
    }
    known
}

/// The look of a texel: how bright its ground is, the hues of its darker and brighter readings, and which way half
/// vectors shine.
pub(crate) fn features(
    ray: impl Fn(usize) -> Ray,
    usable: impl Fn(usize) -> bool,
    n: usize,
    rgb: impl Fn(usize) -> [f32; 3],
) -> Features {
    let level = |i: usize| rgb(i).iter().sum::<f32>().max(0.0) / ray(i)[5];
    let (mut sum, mut count) = (0.0, 0);
    for i in (0..n).filter(|&i| usable(i)) {
        sum += level(i).sqrt();
        count += 1;
    }
    if count == 0 {
        return [0.0; 7];
    }
    // The mean of roots divides ground from highlight well enough and needs no sorting.
    let border = (sum / count as f32).powi(2);
    let (mut dark, mut bright, mut darks) = ([1e-4; 3], [1e-4; 3], 0.0);
    let (mut weight, mut first, mut second) = (1e-6, [0.0; 2], [0.0; 3]);
    for i in (0..n).filter(|&i| usable(i)) {
        let (l, c, [x, y, ..]) = (level(i), rgb(i), ray(i));
        let to = if l < border { &mut dark } else { &mut bright };
        for (to, c) in to.iter_mut().zip(c) {
            *to += c.max(0.0);
        }
        darks += if l < border { ray(i)[5] } else { 0.0 };
        weight += l;
        first = [first[0] + l * x, first[1] + l * y];
        second = [second[0] + l * x * x, second[1] + l * x * y, second[2] + l * y * y];
    }
    let hue = |c: [f32; 3]| [c[0], c[1]].map(|v| v / (c[0] + c[1] + c[2]) / 0.05);
    let ground = (dark.iter().sum::<f32>() / f32::max(darks, 1e-3)).max(1e-3).ln() / 0.5;
    let [mx, my] = first.map(|v| v / weight);
    let [xx, xy, yy] = second.map(|v| v / weight);
    let (xx, xy, yy) = (xx - mx * mx, xy - mx * my, yy - my * my);
    let long = [xx - yy, 2.0 * xy].map(|v| v / (xx + yy).max(1e-6) / 0.2);
    let ([dr, dg], [br, bg]) = (hue(dark), hue(bright));
    [ground, dr, dg, br, bg, long[0], long[1]]
}

fn distance(a: &Features, b: &Features) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn nearest(centres: &[Features], features: &Features) -> usize {
    let far = |i: &usize| distance(&centres[*i], features);
    (0..centres.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0)
}

/// Tails are believed when they leave less than this part of χ². Where there are none they save a ten thousandth.
const TAILS: f64 = 0.95;

/// And when Ward leaves more than this for each reading: readings without noise are described so well that what remains
/// says nothing.
const EXACT: f64 = 1e-3;

/// The profile that most of what is sure of itself agrees on.
fn profile_of(outcomes: &[Member]) -> Profile {
    let mut h = [[0.0; COLUMNS + 1]; COLUMNS + 1];
    let mut readings = 0.0;
    for o in outcomes {
        let weight = f64::from(o.fitted.texel.confidence);
        readings += weight * f64::from(o.fitted.readings);
        let mut at = 0;
        for a in 0..=COLUMNS {
            for b in 0..=a {
                h[a][b] += weight * f64::from(o.products[at]);
                h[b][a] = h[a][b];
                at += 1;
            }
        }
    }
    let (_, at_ward) = non_negative(&h, |c| c == 0 || c == OWN + 1);
    let (found, at_found) = non_negative(&h, |_| true);
    let total: f64 = found[1..].iter().sum();
    if total <= 0.0 || at_found > TAILS * at_ward || at_ward < EXACT * readings {
        return Profile::GAUSSIAN;
    }
    Profile::of(std::array::from_fn::<f32, TERMS, _>(|i| (found[i + 1] / total) as f32))
}

/// Non-negative least squares by coordinate descent over the columns that are let in: coefficients, and the squares
/// that remain. The last column is the right hand side.
fn non_negative(
    h: &[[f64; COLUMNS + 1]; COLUMNS + 1],
    with: impl Fn(usize) -> bool,
) -> ([f64; COLUMNS], f64) {
    let mut x = [0.0; COLUMNS];
    for _ in 0..2000 {
        for c in (0..COLUMNS).filter(|c| with(*c) && h[*c][*c] > 0.0) {
            let others: f64 = (0..COLUMNS).filter(|o| *o != c).map(|o| h[c][o] * x[o]).sum();
            x[c] = ((h[c][COLUMNS] - others) / h[c][c]).max(0.0);
        }
    }
    let quadratic: f64 = (0..COLUMNS).map(|a| (0..COLUMNS).map(|b| x[a] * h[a][b] * x[b]).sum::<f64>()).sum();
    let mixed: f64 = (0..COLUMNS).map(|c| x[c] * h[c][COLUMNS]).sum();
    (x, h[COLUMNS][COLUMNS] - 2.0 * mixed + quadratic)
}

/// Lloyd 1982, started as Arthur and Vassilvitskii 2007.
fn k_means(outcomes: &[Member], k: usize) -> Vec<Features> {
    let mut rng = Pcg32::new(1, 7);
    let mut centres = vec![outcomes[0].features];
    while centres.len() < k {
        let far = |o: &Member| distance(&centres[nearest(&centres, &o.features)], &o.features);
        let total: f32 = outcomes.iter().map(far).sum();
        if total <= 0.0 {
            break;
        }
        let mut left = rng.next_f32() * total;
        let next = outcomes.iter().find(|o| {
            left -= far(o);
            left <= 0.0
        });
        centres.push(next.unwrap_or(&outcomes[outcomes.len() - 1]).features);
    }
    for _ in 0..20 {
        let mut sums = vec![([0.0f64; 7], 0.0f64); centres.len()];
        for o in outcomes {
            let (sum, count) = &mut sums[nearest(&centres, &o.features)];
            sum.iter_mut().zip(o.features).for_each(|(s, f)| *s += f64::from(f));
            *count += 1.0;
        }
        for (centre, (sum, count)) in centres.iter_mut().zip(sums) {
            if count > 0.0 {
                *centre = sum.map(|s| (s / count) as f32);
            }
        }
    }
    centres
}

/// Standard deviations within a thread that are never undercut: 5 % of ground and highlight, a degree of the normal, some
/// percent of widths.
const SPREAD: [f64; N] = [0.01, 0.05, 0.02, 0.02, 0.05, 0.05, 0.05];

impl Cluster {
    /// The same with any normal.
    fn material(&self) -> Self {
        let mut spread = inverse(&self.precision).unwrap_or([[0.0; N]; N]);
        let mut mean = self.mean;
        for n in NORMAL {
            mean[n] = 0.0;
            for i in 0..N {
                (spread[n][i], spread[i][n]) = (0.0, 0.0);
            }
            spread[n][n] = 4.0;
        }
        Self { centre: self.centre, mean, precision: inverse(&spread).unwrap_or(self.precision) }
    }

    /// A material with the normals of texels that were fitted with it.
    fn leaning(&self, centre: Features, texels: &[Outcome]) -> Self {
        let mut spread = inverse(&self.precision).unwrap_or([[0.0; N]; N]);
        let mut mean = self.mean;
        let count = texels.len().max(1) as f64;
        let at = |o: &Outcome, n: usize| f64::from(o.theta[n]);
        for n in NORMAL {
            mean[n] = texels.iter().map(|o| at(o, n)).sum::<f64>() / count;
        }
        for n in NORMAL {
            for m in NORMAL {
                let both = texels.iter().map(|o| (at(o, n) - mean[n]) * (at(o, m) - mean[m]));
                // Room for a normal that none of the few has.
                spread[n][m] = 2.0 * both.sum::<f64>() / count + if n == m { 0.04 } else { 0.0 };
            }
        }
        Self { centre, mean, precision: inverse(&spread).unwrap_or(self.precision) }
    }

    /// Whether two are made of something else.
    fn differs(&self, other: &Self) -> bool {
        let (Some(a), Some(b)) = (inverse(&self.precision), inverse(&other.precision)) else { return true };
        let apart = MATERIAL.map(|i| (self.mean[i] - other.mean[i]).powi(2) / (a[i][i] + b[i][i]));
        apart.iter().sum::<f64>() > MATERIAL.len() as f64
    }

    /// What it costs to be another than the mean.
    fn cost(&self, theta: &Theta) -> f64 {
        let off: [f64; N] = std::array::from_fn(|i| f64::from(theta[i]) - self.mean[i]);
        (0..N).map(|i| (0..N).map(|j| off[i] * self.precision[i][j] * off[j]).sum::<f64>()).sum()
    }

    fn of(centre: Features, members: &[&Member]) -> Self {
        // What the readings of a texel say by themselves: curvature H, and H times where its parabola is lowest.
        let texels: Vec<(Matrix, [f64; N])> = members
            .iter()
            .map(|o| {
                let h = o.information.map(|row| row.map(f64::from));
                let at = o.theta.map(f64::from);
                (
                    h,
                    std::array::from_fn(|i| {
                        (0..N).map(|j| h[i][j] * at[j]).sum::<f64>() - f64::from(o.slope[i])
                    }),
                )
            })
            .collect();
        let mut mean: [f64; N] = std::array::from_fn(|i| {
            let mut all: Vec<f32> = members.iter().map(|o| o.theta[i]).collect();
            let middle = all.len() / 2;
            f64::from(*all.select_nth_unstable_by(middle, f32::total_cmp).1)
        });
        let mut spread: Matrix = [[0.0; N]; N];
        for (i, wide) in [0.1, 1.0, 0.2, 0.2, 0.7, 0.7, 0.7].into_iter().enumerate() {
            spread[i][i] = wide * wide;
        }
        let mut precision = inverse(&spread).unwrap_or(spread);
        for _ in 0..24 {
            let (mut total, mut sum, mut scatter) = (0.0, [0.0; N], [[0.0; N]; N]);
            for (h, b) in &texels {
                let both: Matrix =
                    std::array::from_fn(|i| std::array::from_fn(|j| h[i][j] + precision[i][j]));
                let Some(covariance) = inverse(&both) else { continue };
                let right: [f64; N] =
                    std::array::from_fn(|i| b[i] + (0..N).map(|j| precision[i][j] * mean[j]).sum::<f64>());
                let off: [f64; N] = std::array::from_fn(|i| {
                    (0..N).map(|j| covariance[i][j] * right[j]).sum::<f64>() - mean[i]
                });
                // Student's t with four degrees of freedom: a texel far from all others is of another thread.
                let far: f64 =
                    (0..N).map(|i| (0..N).map(|j| off[i] * precision[i][j] * off[j]).sum::<f64>()).sum();
                let w = (4.0 + N as f64) / (4.0 + far);
                total += w;
                for i in 0..N {
                    sum[i] += w * off[i];
                    for j in 0..N {
                        scatter[i][j] += w * (covariance[i][j] + off[i] * off[j]);
                    }
                }
            }
            if total <= 0.0 {
                break;
            }
            let shift = sum.map(|s| s / total);
            for i in 0..N {
                mean[i] += shift[i];
                for j in 0..N {
                    spread[i][j] = scatter[i][j] / total - shift[i] * shift[j];
                }
            }
            for (i, least) in SPREAD.into_iter().enumerate() {
                spread[i][i] += least * least;
            }
            match inverse(&spread) {
                Some(p) => precision = p,
                None => break,
            }
        }
        Self { centre, mean, precision }
    }
}

fn inverse(h: &Matrix) -> Option<Matrix> {
    let mut out = [[0.0; N]; N];
    for i in 0..N {
        let mut unit = [0.0; N];
        unit[i] = 1.0;
        let column = solve(*h, unit)?;
        for j in 0..N {
            out[j][i] = column[j];
        }
    }
    Some(out)
}
