//! Normals and albedo by robust photometric stereo (Woodham 1980, with the loss of Geman and McClure 1985).
//!
//! A matte texel of albedo ρ and normal n reads ρ n·l: three unknowns g = ρ n, linear in the readings. Cast shadows,
//! highlights and light from neighbouring surfaces are not noise but readings of something else, and there may be many of
//! them. So each texel starts from the best of many triplets of readings that are taken at their word (Fischler and Bolles
//! 1981), and is refined by iteratively reweighted least squares with a loss that stops growing. A reading that is darker
//! than the model may be in shadow; one that is brighter is suspicious unless its half vector stands near the normal, where
//! highlights are: without that, three readings in shadow would pass for a dark texel full of highlights.

pub mod height;
pub(crate) mod layout;
pub(crate) mod stereo;

use crate::fit::compare::quantile;
use crate::lanes::{F, LANES};
use crate::readings::Readings;
use glam::Vec3;
use layout::Layout;
use stereo::{Law, Light, Scratch, Task};
use yugen_optics::parallel::parallel_in;

/// What the light of a texel that is no highlight comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// Lambert's law.
    Matte,
    /// Lambert's law below a clear coat (glaze, varnish, plastic), which lets through 1 − (1 − cos θ)⁵ of what it lets
    /// through from straight above (Fresnel's formulas as Schlick 1994 has them, the same for every refractive index).
    Coated,
    /// Clay, sand, sandstone, unglazed ware: cavities whose walls turn to the light, so that what leans away from the eye
    /// stays bright under lights on its side (Oren and Nayar 1994).
    Rough,
}

impl Ground {
    /// For people and scripts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Matte => "matte",
            Self::Coated => "coated",
            Self::Rough => "rough",
        }
    }
}

/// How the readings are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Standard deviation of a reading, as a part of it.
    pub noise: f32,
    /// Standard deviation of a black reading, as a reflectance.
    pub floor: f32,
}

impl Default for Options {
    fn default() -> Self {
        Self { noise: 0.02, floor: 0.001 }
    }
}

/// What was found of a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Unit; +z where nothing was found.
    pub normal: Vec3,
    /// What the texel reads when it faces the light, without highlights: linear RGB.
    pub albedo: Vec3,
    /// By how many degrees the normal is expected to be off; 90 where nothing was found.
    pub error: f32,
    /// From 0, nothing is known, to 1.
    pub confidence: f32,
    /// Root mean square of model less reading over their standard deviation, of the readings that count.
    pub residual: f32,
    /// Usable readings.
    pub readings: u16,
    /// Those that agree with normal and albedo.
    pub agreeing: u16,
}

/// The texel of which nothing is known.
pub const NOTHING: Found = Found {
    normal: Vec3::Z,
    albedo: Vec3::ZERO,
    error: 90.0,
    confidence: 0.0,
    residual: 0.0,
    readings: 0,
    agreeing: 0,
};

/// Fewer readings than this do not determine a normal.
pub const FEWEST_READINGS: usize = 3;

/// Whether lights in these directions, of any length, determine a normal: not where they stand in one plane with the sample.
pub fn lights_suffice(toward: &[Vec3]) -> bool {
    let toward: Vec<Vec3> = toward.iter().map(|l| l.normalize_or_zero()).collect();
    !stereo::triplets(&toward).is_empty()
}

/// Pieces of so many texels are what threads take turns at.
const PIECE: usize = 128 * LANES;

/// Normals of all texels, in order. Same bits for any number of threads. `progress` hears how many texels are done each
/// time some are.
pub fn find(
    readings: &impl Readings,
    surface: &Surface,
    options: &Options,
    threads: usize,
    progress: &(dyn Fn(usize) + Sync),
) -> Vec<Found> {
    let texels = readings.texels();
    let _span = tracing::info_span!("find_normals", texels, ground = surface.ground.name()).entered();
    let finder = Finder::new(readings, surface, options);
    let piece = |i: usize, scratch: &mut Scratch| -> Vec<Found> {
        let end = ((i + 1) * PIECE).min(texels);
        let all: Vec<usize> = (i * PIECE..end).collect();
        all.chunks(LANES).flat_map(|t| finder.block(t, scratch).found.into_iter().take(t.len())).collect()
    };
    let done = |pieces: usize| progress((pieces * PIECE).min(texels));
    parallel_in(threads, texels.div_ceil(PIECE), piece, &done).into_iter().flatten().collect()
}

/// What the texels of a thing have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// What its light comes from that is no highlight.
    pub ground: Ground,
    /// Of a rough one: standard deviation of the slope angle of its cavities in radians, as of the model `oren_nayar`; else 0.
    pub roughness: f32,
    /// By what part of the albedo a reading may be off besides its noise.
    pub slack: f32,
}

/// Texels that are looked at to tell the surface.
const SAMPLE: usize = 2048;
/// A coat is believed where it leaves less than this part of the cost, and where it then needs no more slack than this. On
/// matte surfaces it doubles the cost; on a glazed one that casts shadows on itself it leaves .85, and a slack of .015. A
/// wrong response curve looks like one, but leaves more.
const COAT: f64 = 0.93;
const COAT_SLACK: f32 = 0.05;
/// Roughness that is tried, and the part of the cost that it may leave to be believed.
const ROUGH: [f32; 5] = [0.12, 0.2, 0.3, 0.45, 0.7];
const COARSE: f64 = 0.8;
/// The least and most slack that is believed. A photograph of one light holds so much of another's light at the least; and
/// what is off by more obeys no law.
const SLACK: [f32; 2] = [0.01, 0.15];
/// Of a normal deviate the deviation over the median of the absolute value.
const OF_MEDIAN: f32 = 1.4826;

/// Groups of texels that are spread over `bands`: which band, and which of its groups.
fn spread(bands: &[impl Readings]) -> Vec<(usize, usize)> {
    let groups: Vec<(usize, usize)> = bands
        .iter()
        .enumerate()
        .flat_map(|(b, s)| (0..s.texels().div_ceil(LANES)).map(move |g| (b, g)))
        .filter(|(b, g)| bands[*b].values(g * LANES).iter().any(|v| v[0].is_finite()))
        .collect();
    let wanted = (SAMPLE / LANES).min(groups.len());
    (0..wanted).map(|i| groups[i * groups.len() / wanted]).collect()
}

/// Of a texel that is reliable enough to compare lights by, this part of the readings agrees with its ground.
const AGREEING: f32 = 0.6;
/// So many reliable texels a light needs.
const LEAST_RELIABLE: usize = 64;

/// How bright each light is beside what the others say it is: the median ratio of a reading to what the ground found under all
/// of them predicts. `None` where that is not known: of silk, metal and whatever else is no plain ground in half of its
/// texels, and meets its law with more slack than a coat may need. All of `bands` have the same lights in the same order.
pub fn brightness(
    bands: &[impl Readings],
    surface: &Surface,
    options: &Options,
    threads: usize,
) -> Vec<Option<f32>> {
    let _span = tracing::info_span!("tell_brightness").entered();
    let lights = bands.first().map_or(0, |b| if b.texels() == 0 { 0 } else { b.values(0).len() });
    if surface.slack > COAT_SLACK {
        return vec![None; lights];
    }
    let chosen = spread(bands);
    let finders: Vec<_> = bands.iter().map(|b| Finder::new(b, surface, options)).collect();
    let group = |i: usize, scratch: &mut Scratch| {
        let (band, group) = chosen[i];
        let end = ((group + 1) * LANES).min(bands[band].texels());
        let texels: Vec<usize> = (group * LANES..end).collect();
        let block = finders[band].block(&texels, scratch);
        let reliable = |f: &Found| f32::from(f.agreeing) > AGREEING * f32::from(f.readings) && f.readings > 4;
        let reliable: Vec<bool> = block.found.iter().map(reliable).collect();
        let count = reliable.iter().filter(|r| **r).count();
        (count, finders[band].ratios(&texels, scratch, &block, &reliable))
    };
    let mut ratios: Vec<Vec<f32>> = vec![Vec::new(); lights];
    let all = parallel_in(threads, chosen.len(), group, &|_| {});
    let reliable: usize = all.iter().map(|(count, _)| count).sum();
    if 2 * reliable < chosen.len() * LANES {
        return vec![None; lights];
    }
    all.into_iter().flat_map(|(_, of_group)| of_group).for_each(|(light, ratio)| ratios[light].push(ratio));
    ratios.iter_mut().map(|r| quantile(r, 0.5).filter(|_| r.len() >= LEAST_RELIABLE)).collect()
}

impl Surface {
    /// What describes the texels of `bands` best, by some that are spread over them; of the ground that is `asked` for if
    /// one is.
    pub fn of(bands: &[impl Readings], asked: Option<Ground>, options: &Options, threads: usize) -> Self {
        let _span = tracing::info_span!("tell_surface").entered();
        let chosen = spread(bands);
        // What a surface costs, and the slack that it needs.
        let tried = |surface: Self| -> (f64, Self) {
            let finders: Vec<_> = bands.iter().map(|b| Finder::new(b, &surface, options)).collect();
            let group = |i: usize, scratch: &mut Scratch| {
                let (band, group) = chosen[i];
                let end = ((group + 1) * LANES).min(bands[band].texels());
                let texels: Vec<usize> = (group * LANES..end).collect();
                let block = finders[band].block(&texels, scratch);
                (block.cost, finders[band].misfit(&texels, scratch, &block))
            };
            let all = parallel_in(threads, chosen.len(), group, &|_| {});
            let known = |(cost, misfit): ([f32; LANES], [Option<f32>; LANES])| {
                cost.into_iter().zip(misfit).filter_map(|(c, m)| Some((f64::from(c), m?)))
            };
            let (costs, mut misfits): (Vec<f64>, Vec<f32>) = all.into_iter().flat_map(known).unzip();
            let median = quantile(&mut misfits, 0.5).unwrap_or(0.0);
            (costs.iter().sum(), Self { slack: (OF_MEDIAN * median).clamp(SLACK[0], SLACK[1]), ..surface })
        };
        // Loose first, so that a law that is not quite met does not pass for many shadows.
        let settled =
            |ground: Ground, roughness: f32| tried(tried(Self { ground, roughness, slack: SLACK[1] }).1).1;
        // Two of them by the same measure, the strictest that either needs.
        let costs = |a: Self, b: Self| {
            let slack = a.slack.min(b.slack);
            [a, b].map(|surface| tried(Self { slack, ..surface }).0)
        };
        let better = |a: Self, b: Self| match costs(a, b) {
            [of_a, of_b] if of_b < of_a => b,
            _ => a,
        };
        let roughest = || ROUGH.map(|sigma| settled(Ground::Rough, sigma)).into_iter().reduce(better);
        match asked {
            Some(Ground::Rough) => roughest().unwrap_or_else(|| settled(Ground::Matte, 0.0)),
            Some(ground) => settled(ground, 0.0),
            None => {
                let matte = settled(Ground::Matte, 0.0);
                let believed = |other: &Self, part: f64| {
                    let [of_matte, of_other] = costs(matte, *other);
                    other.slack < COAT_SLACK && of_other < part * of_matte
                };
                let coated = Some(settled(Ground::Coated, 0.0)).filter(|s| believed(s, COAT));
                let rough = roughest().filter(|s| believed(s, COARSE));
                [coated, rough].into_iter().flatten().reduce(better).unwrap_or(matte)
            }
        }
    }
}

pub(crate) fn task(surface: &Surface, options: &Options) -> Task {
    let law = match surface.ground {
        Ground::Matte => Law::Lambert,
        Ground::Coated => Law::Coated,
        Ground::Rough => {
            let variance = surface.roughness * surface.roughness;
            // A and B of Oren and Nayar 1994.
            let (a, b) = (1.0 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09));
            Law::Rough(b / a)
        }
    };
    Task { law, options: *options, slack: surface.slack }
}

/// What became of up to eight texels.
struct Block {
    found: [Found; LANES],
    /// What their readings cost.
    cost: [f32; LANES],
    solved: stereo::Solved,
}

/// What all texels of a band have in common.
struct Finder<'a, R> {
    readings: &'a R,
    task: Task,
    layout: Layout<Light>,
}

impl<'a, R: Readings> Finder<'a, R> {
    fn new(readings: &'a R, surface: &Surface, options: &Options) -> Self {
        let layout = Layout::new(readings, |r| Light::of(r.light, r.eye, r.irradiance), |light| *light);
        Self { readings, task: task(surface, options), layout }
    }

    /// Turns the readings of up to eight texels on their side, for lights of their own into `own`.
    fn gather<'l>(&'l self, texels: &[usize], scratch: &mut Scratch, own: &'l mut Vec<Light>) -> &'l [Light] {
        let values = |lane: usize| texels.get(lane).map(|t| self.readings.values(*t));
        if let Some((used, lights)) = &self.layout.common {
            scratch.gather(used, values);
            return lights;
        }
        let most = texels.iter().map(|t| self.readings.values(*t).len()).max().unwrap_or(0);
        scratch.gather(&(0..most).collect::<Vec<_>>(), values);
        *own = vec![Light::BESIDE; most];
        for (lane, &t) in texels.iter().enumerate() {
            for (i, to) in own.iter_mut().enumerate().take(self.readings.values(t).len()) {
                let r = self.readings.reading(t, i);
                match Light::of(r.light, r.eye, r.irradiance) {
                    Some(light) => to.put(lane, &light),
                    None => scratch.usable[i].0[lane] = 0.0,
                }
            }
        }
        own
    }

    fn block(&self, texels: &[usize], scratch: &mut Scratch) -> Block {
        let (mut own, theirs);
        own = Vec::new();
        let lights = self.gather(texels, scratch, &mut own);
        let triplets = match &self.layout.triplets {
            Some(triplets) => triplets,
            None => {
                // Readings of a table are in any order, and each texel has its own.
                theirs = stereo::triplets(&lights.iter().map(Light::toward).collect::<Vec<_>>());
                &theirs
            }
        };
        let solved = stereo::solve_block(lights, &scratch.value, &scratch.usable, triplets, &self.task);
        let albedo =
            stereo::albedo(lights, &scratch.value, &scratch.channels, &scratch.usable, &solved, &self.task);
        let found = std::array::from_fn(|lane| {
            let lane_of = |f: F| f.0[lane];
            let readings = scratch.usable.iter().filter(|u| u.0[lane] > 0.0).count();
            let g = Vec3::from(solved.g.map(lane_of));
            let Some(normal) = g.try_normalize().filter(|_| readings >= FEWEST_READINGS && g.z > 0.0) else {
                return Found { readings: readings as u16, ..NOTHING };
            };
            let albedo = Vec3::from(albedo.map(lane_of));
            Found {
                normal,
                albedo,
                error: lane_of(solved.error),
                confidence: lane_of(solved.confidence),
                residual: lane_of(solved.residual),
                readings: readings as u16,
                agreeing: lane_of(solved.agreeing).round() as u16,
            }
        });
        Block { found, cost: solved.cost.0, solved }
    }

    /// Of `reliable` texels, each light and the ratio of its reading to what the ground predicts.
    fn ratios(
        &self,
        texels: &[usize],
        scratch: &mut Scratch,
        block: &Block,
        reliable: &[bool],
    ) -> Vec<(usize, f32)> {
        let mut own = Vec::new();
        let lights = self.gather(texels, scratch, &mut own);
        let mut all = Vec::new();
        stereo::ratios(lights, scratch, &block.solved, &self.task, |lane, light, ratio| {
            if reliable[lane] && ratio.is_finite() {
                let light = self.layout.common.as_ref().map_or(light, |(used, _)| used[light]);
                all.push((light, ratio));
            }
        });
        all
    }

    fn misfit(&self, texels: &[usize], scratch: &mut Scratch, block: &Block) -> [Option<f32>; LANES] {
        let mut own = Vec::new();
        let lights = self.gather(texels, scratch, &mut own);
        stereo::misfit(lights, scratch, &block.solved, &self.task)
    }
}

#[cfg(test)]
mod tests;
