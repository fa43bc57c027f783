//! From a scene to a picture: tiles on all cores, budgets, checkpoints.
//!
//! Work goes in rounds. A round gives every tile a number of samples to reach, from what all tiles have seen so
//! far; within it a tile depends on nothing but its own samples. So the picture is the same bits for any number of
//! threads, and a render killed at any moment goes on from its last checkpoint to the identical result.

use crate::accel::NO_INSTANCE;
use crate::camera::Lens;
use crate::checkpoint::{self, Counting, Head, Part, ResumeError};
use crate::film::{FilmLayout, Tile};
use crate::guide::Guide;
use crate::integrator::{FirstHit, Follow, Groups, PathState, PrepareError, Radiance, World};
use crate::reuse::{GROUP, GroupScratch};
use crate::sampler::Sampler;
use glam::{Vec2, Vec3};
use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use yugen_optics::denoise::{denoise, half};
use yugen_optics::{Fingerprint, Image};
use yugen_scene::Scene;
use yugen_scene::{Aov, Camera, Film, Integrator, IntegratorKind};

fn push(aov: Aov, first: &FirstHit, out: &mut Vec<f32>) {
    match aov {
        Aov::Albedo => out.extend(first.albedo.to_array()),
        Aov::Normal => out.extend(first.normal.to_array()),
        Aov::ShadingNormal => out.extend(first.shading_normal.to_array()),
        Aov::Depth => out.push(first.depth),
        Aov::Position => out.extend(first.position.to_array()),
        Aov::Uv => out.extend(first.uv.to_array()),
        Aov::Id | Aov::Variance | Aov::Lights => {}
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// After this many samples in every pixel.
    Samples(u32),
    /// After this long; noisy tiles get more samples.
    Time(Duration),
    /// When the root mean square over the picture of relative standard errors is below this; noisy tiles get
    /// more samples.
    Error(f32),
}

/// Most samples a pixel gets under an error target.
pub const MAX_SAMPLES: u32 = 1 << 16;
/// Most pixels of a picture: 16 GB of sums and moments.
const MAX_PIXELS: u64 = 1 << 28;
/// Most light groups: each is three more sums for every pixel.
const MAX_GROUPS: usize = 64;
/// Samples of every pixel before the noise of a tile is believed.
const FIRST_ROUND: u32 = 16;
/// Samples per pixel of one visit to a tile.
const STEP: u32 = 16;
/// Part of the light of a tile that has to come by shared ends of paths for them to go on being shared.
const SHARED: f64 = 0.1;

/// How to render a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Name of the camera; the first of the scene where absent.
    pub camera: Option<String>,
    /// Width and height instead of the camera's, as [`Camera::resize`] does it.
    pub size: Option<[u32; 2]>,
    /// x, y, width, height in pixels of the part of the picture that is rendered, instead of the camera's.
    pub crop: Option<[u32; 4]>,
    /// When to stop; the camera's own number of samples where absent.
    pub budget: Option<Budget>,
    /// Same seed, same picture.
    pub seed: u32,
    /// Threads; one per core where absent.
    pub threads: Option<usize>,
    /// Integrator instead of the scene's.
    pub integrator: Option<Integrator>,
    /// What to record besides radiance.
    pub aovs: Vec<Aov>,
    /// Keep what a denoiser needs.
    pub denoise: bool,
}

/// Counts a worker that has ended when it is dropped, by a panic as well: whoever waits for it does not wait for ever.
struct Ended<'a>(&'a (Mutex<usize>, Condvar));

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        *lock(&self.0.0) += 1;
        self.0.1.notify_all();
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// In [0, 1].
    pub fraction: f64,
    /// Samples taken so far, over all pixels, by this run and those it resumed.
    pub samples: u64,
    /// Time spent, likewise.
    pub elapsed: Duration,
    /// Estimate of what remains, once there is one.
    pub remaining: Option<Duration>,
    /// Samples dropped because they were not finite.
    pub rejected: u64,
    /// Part of all light that was clamped away.
    pub clamped: f64,
}

/// What an observer wants done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Go on.
    Continue,
    /// Leave it; what is done so far can be developed or stored.
    Stop,
}

/// A render in progress.
pub struct Job {
    world: World,
    lens: Lens,
    layout: FilmLayout,
    integrator: Integrator,
    aovs: Vec<Aov>,
    budget: Budget,
    seed: u32,
    denoise: bool,
    threads: usize,
    parts: Vec<Part>,
    tiles: Vec<Mutex<Tile>>,
    /// The budget was spent.
    finished: AtomicBool,
    /// Milliseconds spent by earlier runs and, once it has ended, this one.
    elapsed: AtomicU64,
}

impl Job {
    /// Prepares `scene`. What it is made from goes into the checkpoints, so that none is taken up by another one.
    pub fn new(scene: &Scene, options: &Options) -> Result<Self, PrepareError> {
        let camera = scene.look_through(options.camera.as_deref(), options.size, options.crop)?;
        let integrator = options.integrator.clone().unwrap_or_else(|| scene.integrator.clone());
        let mut aovs = options.aovs.clone();
        for aov in &integrator.aovs {
            if !aovs.contains(aov) {
                aovs.push(*aov);
            }
        }
        // Numbers of shapes do not average: they are added at the end.
        let averaged = aovs.iter().filter(|a| **a != Aov::Id);
        let named = averaged.flat_map(|a| a.channels()).copied();
        let mut channels: Vec<String> =
            ["R", "G", "B", "A"].into_iter().chain(named).map(String::from).collect();
        let mut groups = Vec::new();
        if aovs.contains(&Aov::Lights) {
            groups = scene.light_groups().names;
            if groups.len() > MAX_GROUPS {
                return Err(PrepareError::TooManyGroups { count: groups.len(), limit: MAX_GROUPS });
            }
            channels.extend(groups.iter().flat_map(|g| ["R", "G", "B"].map(|c| format!("light.{g}.{c}"))));
        }
        let mut layout = FilmLayout::new(&camera.film, channels);
        if options.denoise {
            layout = layout.guided();
        }
        let [_, _, width, height] = layout.window;
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            return Err(PrepareError::TooLarge { width, height, limit: MAX_PIXELS });
        }
        let budget = options.budget.unwrap_or(Budget::Samples(camera.samples_per_pixel.max(1)));
        if options.denoise && matches!(budget, Budget::Samples(1)) {
            return Err(PrepareError::TooFewToDenoise);
        }
        let mut parts = parts(scene, &camera, &integrator, &aovs, options.seed, &groups);
        if options.denoise {
            parts.push(Part::text("denoising", "on"));
        }
        let tiles = layout.tiles().into_iter().map(Mutex::new).collect();
        let cores = yugen_optics::parallel::threads();
        Ok(Self {
            world: World::new(scene, aovs.contains(&Aov::Uv))?,
            lens: Lens::new(&camera),
            layout,
            integrator,
            aovs,
            budget,
            seed: options.seed,
            denoise: options.denoise,
            threads: options.threads.unwrap_or(cores).max(1),
            parts,
            tiles,
            finished: AtomicBool::new(false),
            elapsed: AtomicU64::new(0),
        })
    }

    /// Goes on with another budget: for a picture that is watched while it grows.
    pub fn extend(&mut self, budget: Budget) {
        self.budget = budget;
        *self.finished.get_mut() = false;
    }

    /// The prepared scene.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Width and height of the picture it makes.
    pub fn size(&self) -> [u32; 2] {
        [self.layout.window[2], self.layout.window[3]]
    }

    /// Renders until the budget is spent or `observe`, called up to twenty times a second (less often for very large
    /// pictures), says stop. Returns whether the budget was spent.
    pub fn run(&self, mut observe: impl FnMut(&Self, &Progress) -> Action) -> bool {
        let _span = tracing::info_span!("render").entered();
        let clock = Clock {
            started: Instant::now(),
            before: Duration::from_millis(self.elapsed.load(Ordering::Relaxed)),
            samples_before: self.samples(),
        };
        let mut go_on = Action::Continue;
        while go_on == Action::Continue && self.plan(&clock) {
            let _span = tracing::debug_span!("round", samples_before = self.samples()).entered();
            go_on = self.round(&clock, &mut observe);
        }
        self.elapsed.store(clock.elapsed().as_millis() as u64, Ordering::Relaxed);
        self.finished.store(go_on == Action::Continue, Ordering::Relaxed);
        go_on == Action::Continue
    }

    /// Brings every tile to its goal, the one that is furthest behind first.
    fn round(&self, clock: &Clock, observe: &mut impl FnMut(&Self, &Progress) -> Action) -> Action {
        let lag = |t: &Tile| (u64::from(t.samples) << 32) / u64::from(t.goal.max(1));
        let queue: BinaryHeap<Reverse<(u64, usize)>> = self
            .tiles
            .iter()
            .enumerate()
            .filter_map(|(i, t)| {
                let t = lock(t);
                (t.samples < t.goal).then(|| Reverse((lag(&t), i)))
            })
            .collect();
        let queue = Mutex::new(queue);
        let (stop, mut action) = (AtomicBool::new(false), Action::Continue);
        let finished = (Mutex::new(0usize), Condvar::new());
        std::thread::scope(|scope| {
            for _ in 0..self.threads {
                scope.spawn(|| {
                    let _ended = Ended(&finished);
                    while !stop.load(Ordering::Relaxed) && !self.out_of_time(clock) {
                        let Some(Reverse((_, i))) = lock(&queue).pop() else { break };
                        let mut tile = lock(&self.tiles[i]);
                        self.advance(&mut tile);
                        if tile.samples < tile.goal {
                            let again = Reverse((lag(&tile), i));
                            drop(tile);
                            lock(&queue).push(again);
                        }
                    }
                });
            }
            let mut looking = Duration::ZERO;
            let mut done = lock(&finished.0);
            while *done < self.threads {
                // A look at a large picture takes its time; it shall take little of that of the work.
                let pause = (20 * looking).clamp(Duration::from_millis(50), Duration::from_secs(2));
                done = finished.1.wait_timeout(done, pause).unwrap_or_else(PoisonError::into_inner).0;
                if *done < self.threads {
                    drop(done);
                    self.elapsed.store(clock.elapsed().as_millis() as u64, Ordering::Relaxed);
                    let begun = Instant::now();
                    action = observe(self, &self.progress(clock));
                    looking = begun.elapsed();
                    if action == Action::Stop {
                        stop.store(true, Ordering::Relaxed);
                    }
                    done = lock(&finished.0);
                }
            }
        });
        if stop.into_inner() { Action::Stop } else { Action::Continue }
    }

    fn out_of_time(&self, clock: &Clock) -> bool {
        matches!(self.budget, Budget::Time(limit) if clock.elapsed() >= limit)
    }

    /// Gives every tile its next goal, unless a round is under way or the budget is spent: `false`.
    fn plan(&self, clock: &Clock) -> bool {
        if self.out_of_time(clock) {
            return false;
        }
        let behind = || self.tiles.iter().map(lock).any(|t| t.samples < t.goal);
        if behind() {
            return true;
        }
        let goals = match self.budget {
            Budget::Samples(n) => vec![n; self.tiles.len()],
            _ if self.samples() == 0 => vec![FIRST_ROUND; self.tiles.len()],
            Budget::Time(_) => Noise::of(&self.tiles).goals(0.0),
            Budget::Error(target) => Noise::of(&self.tiles).goals(target),
        };
        for (tile, goal) in self.tiles.iter().zip(goals) {
            lock(tile).goal = goal;
        }
        behind()
    }

    /// Where it stands.
    pub fn status(&self) -> Progress {
        let before = Duration::from_millis(self.elapsed.load(Ordering::Relaxed));
        self.progress_at(before, Duration::ZERO, 0)
    }

    fn samples(&self) -> u64 {
        self.tiles.iter().map(lock).map(|t| u64::from(t.samples) * u64::from(t.size[0] * t.size[1])).sum()
    }

    fn progress(&self, clock: &Clock) -> Progress {
        self.progress_at(clock.elapsed(), clock.started.elapsed(), clock.samples_before)
    }

    fn progress_at(&self, elapsed: Duration, this_run: Duration, samples_before: u64) -> Progress {
        let (mut samples, mut pixels, mut rejected) = (0u64, 0u64, 0u64);
        let (mut light, mut clamped) = (0.0, 0.0);
        for tile in &self.tiles {
            let tile = lock(tile);
            let n = u64::from(tile.size[0] * tile.size[1]);
            samples += u64::from(tile.samples) * n;
            pixels += n;
            rejected += tile.rejected;
            if self.integrator.clamp.is_some() {
                light += brought(&tile);
                clamped += tile.clamped;
            }
        }
        let fraction = match self.budget {
            Budget::Samples(n) => samples as f64 / (pixels * u64::from(n)) as f64,
            Budget::Time(limit) => elapsed.as_secs_f64() / limit.as_secs_f64().max(1e-9),
            // The square of the error falls at least like 1/n.
            Budget::Error(target) => f64::from(target / self.error()).powi(2),
        }
        .clamp(0.0, 1.0);
        let remaining = match self.budget {
            Budget::Time(limit) => Some(limit.saturating_sub(elapsed)),
            Budget::Samples(n) => {
                let taken = samples.saturating_sub(samples_before);
                let left = (pixels * u64::from(n)).saturating_sub(samples);
                (taken > 0).then(|| this_run.mul_f64(left as f64 / taken as f64))
            }
            Budget::Error(_) => (fraction > 0.01).then(|| elapsed.mul_f64((1.0 - fraction) / fraction)),
        };
        let clamped = if clamped > 0.0 { clamped / (light + clamped) } else { 0.0 };
        Progress { fraction, samples, elapsed, remaining, rejected, clamped }
    }

    /// Root mean square over the picture of standard error over value, as the samples so far tell; infinite before
    /// there are any. Dark pixels count as a hundredth of the picture's mean. An upper bound: low-discrepancy
    /// points and the reconstruction filter make the true error smaller.
    pub fn error(&self) -> f32 {
        Noise::of(&self.tiles).error()
    }

    /// Takes the next few samples of every pixel of a tile.
    fn advance(&self, tile: &mut Tile) {
        let end = tile.samples.saturating_add(STEP).min(tile.goal);
        if matches!(self.budget, Budget::Samples(_)) && end - tile.samples < STEP {
            tile.keep();
        }
        let (spread, width) = self.lens.pixel_spread();
        // The samples of a pixel share its footprint.
        let sharpen = 1.0 / (end as f32).sqrt().clamp(1.0, 8.0);
        let planned = match self.budget {
            Budget::Samples(n) => Some(n),
            _ => None,
        };
        let mut values = Vec::with_capacity(self.layout.channels.len());
        let mut visit = self.layout.visit(tile);
        let mut scratch = GroupScratch::new();
        let (mut pixels, mut positions) = (Vec::new(), Vec::new());
        let (mut paths, mut radiances) = (Vec::new(), Vec::new());
        let map = self.world.lights.group_map();
        let by_light = self.aovs.contains(&Aov::Lights);
        let sums = vec![Cell::new(Vec3::ZERO); if by_light { map.names().len() } else { 0 }];
        let follow = Follow {
            settings: &self.integrator,
            groups: by_light.then_some(Groups { map, sums: &sums }),
            albedo: self.aovs.contains(&Aov::Albedo),
            shading_normal: self.aovs.contains(&Aov::ShadingNormal),
            features: self.denoise,
            width: width * sharpen,
            spread: spread * sharpen,
        };
        let ([x0, y0], [w, h]) = (tile.origin, tile.size);
        // Where the first visit found little to share, no more is looked for.
        let sharing = self.world.can_share(&follow) && (tile.samples == 0 || worth_sharing(tile));
        let [across, down] = if sharing { GROUP } else { [1, 1] };
        let corners =
            (0..h).step_by(down as usize).flat_map(|y| (0..w).step_by(across as usize).map(move |x| [x, y]));
        for [gx, gy] in corners {
            pixels.clear();
            for y in gy..(gy + down).min(h) {
                pixels.extend((gx..(gx + across).min(w)).map(|x| [x0 + x, y0 + y]));
            }
            for index in tile.samples..end {
                positions.clear();
                paths.clear();
                for &[x, y] in &pixels {
                    let mut sampler = Sampler::new(x, y, index, self.seed);
                    let [px, py, u, v] = sampler.next_4d();
                    let position = Vec2::new(x as f32 + px, y as f32 + py);
                    positions.push(position);
                    paths.push((self.lens.ray(position, Vec2::new(u, v)), sampler));
                }
                radiances.clear();
                radiances.resize(pixels.len(), Radiance::default());
                if sharing {
                    tile.shared +=
                        self.world.radiance_of_group(&follow, &mut paths, &mut scratch, &mut radiances);
                } else {
                    let (ray, sampler) = &mut paths[0];
                    let path = &mut PathState::new(&follow, *ray);
                    self.world.radiance(&follow, path, sampler, scratch.of_one(), &mut radiances[0]);
                }
                for ((pixel, position), r) in pixels.iter().zip(&positions).zip(&radiances) {
                    tile.clamped += f64::from(r.clamped);
                    let rgb = match self.integrator.kind {
                        IntegratorKind::Depth => Vec3::splat(r.first.depth),
                        _ => r.rgb,
                    };
                    values.clear();
                    values.extend(rgb.to_array());
                    values.push(r.alpha);
                    for aov in &self.aovs {
                        push(*aov, &r.first, &mut values);
                    }
                    for sum in &sums {
                        values.extend(sum.take().to_array());
                    }
                    let usable = self.layout.add(tile, &mut visit, *pixel, position.to_array(), &values);
                    if self.denoise && usable {
                        self.layout.guide(tile, *pixel, half(index, planned), &Guide::of(r));
                    }
                }
            }
        }
        self.layout.flush(tile, &visit);
        tile.samples = end;
    }

    /// The picture as it stands: R, G, B, A, then the AOVs as `layer.channel`.
    pub fn image(&self) -> Image {
        self.image_of(&self.snapshot())
    }

    /// All tiles as they stand.
    fn snapshot(&self) -> Vec<Tile> {
        self.tiles.iter().map(|t| lock(t).clone()).collect()
    }

    fn image_of(&self, tiles: &[Tile]) -> Image {
        let mut image = self.layout.develop(tiles, self.aovs.contains(&Aov::Variance));
        if self.aovs.contains(&Aov::Id) {
            image = self.with_ids(image);
        }
        image
    }

    /// The picture denoised: R, G and B are, and kept as they were in `noisy.R`, `noisy.G` and `noisy.B`; `error.R`,
    /// `error.G` and `error.B` are estimates of the standard error that remains. Everything else is as in
    /// [`Job::image`], as is all where guides were not kept.
    pub fn denoised(&self) -> Image {
        // Picture and guides of the same samples, also while others are taken.
        let tiles = self.snapshot();
        let image = self.image_of(&tiles);
        if !self.denoise {
            return image;
        }
        let halves = self.layout.halves(&tiles);
        drop(tiles);
        let n = image.channels.len();
        let picture = std::array::from_fn(|c| image.data.iter().skip(c).step_by(n).copied().collect());
        let clean = denoise(&halves, &picture, &self.layout.pixel_filter(), self.threads);
        clean.in_place_of(&image)
    }

    /// Shape numbers do not average: one ray through each pixel's centre.
    fn with_ids(&self, image: Image) -> Image {
        let [x0, y0, ..] = self.layout.window;
        let n = image.channels.len();
        let mut out = Image {
            width: image.width,
            height: image.height,
            channels: image
                .channels
                .iter()
                .cloned()
                .chain(Aov::Id.channels().iter().map(|c| c.to_string()))
                .collect(),
            data: Vec::with_capacity(image.width * image.height * (n + 1)),
        };
        for (i, pixel) in image.data.chunks_exact(n).enumerate() {
            let (x, y) = (i % image.width, i / image.width);
            let at = Vec2::new((x0 as usize + x) as f32 + 0.5, (y0 as usize + y) as f32 + 0.5);
            let ray = self.lens.ray(at, Vec2::splat(0.5));
            let id = self
                .world
                .geometry
                .intersect(&ray)
                .map_or(0, |hit| 1 + if hit.instance == NO_INSTANCE { hit.shape } else { hit.instance });
            out.data.extend_from_slice(pixel);
            out.data.push(id as f32);
        }
        out
    }

    /// Everything needed to go on later, as bytes. Once the budget is spent, everything needed to take more samples.
    pub fn checkpoint(&self) -> Vec<u8> {
        checkpoint::write(&self.head(), &self.tiles, self.layout.channels.len() + 1)
    }

    /// What a checkpoint would say of itself now.
    pub fn head(&self) -> Head {
        Head {
            parts: self.parts.clone(),
            counting: match self.budget {
                Budget::Samples(n) => Counting::Samples(n),
                Budget::Time(_) | Budget::Error(_) => Counting::ByNoise,
            },
            finished: self.finished.load(Ordering::Relaxed),
            samples: self.tiles.iter().map(|t| lock(t).to_go_on().samples).min().unwrap_or(0),
            elapsed: Duration::from_millis(self.elapsed.load(Ordering::Relaxed)),
            tiles: self.tiles.len() as u64,
        }
    }

    /// Takes up a checkpoint of the same picture; returns what it says of itself. The budget may be another one: more
    /// samples give the bits that they would have given at once. After an error this render is of no use.
    pub fn resume(&self, bytes: &[u8]) -> Result<Head, ResumeError> {
        let accept = |head: &Head| match (head.counting, self.budget) {
            (Counting::ByNoise, Budget::Samples(_)) => Err(ResumeError::SharedOut),
            _ => Ok(()),
        };
        let head = checkpoint::read(bytes, &self.parts, &self.tiles, self.layout.channels.len() + 1, accept)?;
        let done = || self.tiles.iter().map(|t| lock(t).samples).max().unwrap_or(0);
        match (head.counting, self.budget) {
            (_, Budget::Samples(asked)) if done() > asked => {
                return Err(ResumeError::Fewer { done: done(), asked });
            }
            // The goal is set anew.
            (_, Budget::Samples(_)) => self.tiles.iter().map(lock).for_each(|mut t| t.goal = t.samples),
            (Counting::Samples(_), Budget::Time(_) | Budget::Error(_)) => {
                // Up to here all had the same number, and nobody knew that it would not go on like that.
                let goal = done().max(FIRST_ROUND);
                self.tiles.iter().for_each(|t| lock(t).goal = goal);
            }
            _ => {}
        }
        self.elapsed.store(head.elapsed.as_millis() as u64, Ordering::Relaxed);
        Ok(head)
    }
}

/// What a picture is made from, for people to whom a difference is told: what they typed first.
fn parts(
    scene: &Scene,
    camera: &Camera,
    integrator: &Integrator,
    aovs: &[Aov],
    seed: u32,
    groups: &[String],
) -> Vec<Part> {
    let Film { width, height, crop, filter } = &camera.film;
    let Integrator { kind, max_depth, rr_depth, strategy, clamp, hide_emitters, aovs: _ } = integrator;
    let or = |value: Option<String>, none: &str| value.unwrap_or_else(|| none.to_string());
    let layers: Vec<&str> = aovs.iter().map(|a| a.name()).collect();
    let mut parts = vec![
        Part::text("the size", format!("{width}x{height}")),
        Part::text("the crop", or(crop.map(|c| format!("{c:?}")), "the whole picture")),
        Part::text("the filter", format!("{filter:?}")),
        Part::text("the seed", seed),
        Part::text("the list of layers", or((!layers.is_empty()).then(|| layers.join(",")), "empty")),
        Part::text("the list of light groups", or((!groups.is_empty()).then(|| groups.join(",")), "empty")),
        Part::text("the integrator", format!("{kind:?}").to_lowercase()),
        Part::text("the way of looking for light", format!("{strategy:?}").to_lowercase()),
        Part::text("the longest path", or(max_depth.map(|d| d.to_string()), "unlimited")),
        Part::text("the length from which roulette ends paths", rr_depth),
        Part::text("the clamp", or(clamp.map(|c| c.to_string()), "none")),
        Part::text("hiding of lights", if *hide_emitters { "on" } else { "off" }),
    ];
    parts.extend(scene.parts().into_iter().map(|(name, hash)| Part::hash(name, hash)));
    let Camera { name, to_world, projection, near_far, film: _, samples_per_pixel: _ } = camera;
    let mut print = Fingerprint::default();
    print.debug(&(to_world, projection, near_far));
    parts.push(Part::hash(format!("the camera '{name}'"), print.finish()));
    parts
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic elsewhere already ends the run; the data is plain numbers.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// When a run began, and what had been done before.
struct Clock {
    started: Instant,
    before: Duration,
    samples_before: u64,
}

impl Clock {
    fn elapsed(&self) -> Duration {
        self.before + self.started.elapsed()
    }
}

/// Whether light by shared ends of paths is a good part of all light in a tile: else it is not where the noise comes
/// from, and the rays for it are better spent on more samples.
fn worth_sharing(tile: &Tile) -> bool {
    tile.shared > SHARED * brought(tile)
}

/// All light that samples have brought to a tile: the sum over them and colours.
fn brought(tile: &Tile) -> f64 {
    let of_pixel = |m: &[f32; 7]| f64::from(m[0] + m[1] + m[2]) * f64::from(m[6]);
    tile.moments.iter().map(of_pixel).sum()
}

/// How noisy each tile is.
struct Noise {
    tiles: Vec<TileNoise>,
}

struct TileNoise {
    pixels: f64,
    samples: u32,
    /// Mean over pixels of the variance of one sample, relative to the square of the pixel's value.
    variance: f64,
}

impl TileNoise {
    /// Channels below `floor` count as that much.
    fn of(tile: &Tile, floor: f32) -> Self {
        let mut variance = 0.0;
        for m in &tile.moments {
            let relative = |c: usize| m[3 + c] / (m[c] * m[c] + floor * floor);
            variance += match m[6] {
                // Nothing usable came: as uncertain as it is large, however many are thrown after it.
                n if n < 2.0 => 1.0,
                n => f64::from((relative(0) + relative(1) + relative(2)) / (3.0 * (n - 1.0))),
            };
        }
        let pixels = tile.moments.len() as f64;
        Self { pixels, samples: tile.samples, variance: variance / pixels }
    }

    /// Of one sample: what the samples are shared out by.
    fn deviation(&self) -> f64 {
        self.variance.sqrt()
    }
}

impl Noise {
    /// Tiles are looked at one by one, so that those at work are not held up.
    fn of(tiles: &[Mutex<Tile>]) -> Self {
        let (mut sum, mut pixels) = (0.0, 0.0);
        for tile in tiles.iter().map(lock) {
            sum += tile.moments.iter().map(|m| f64::from(m[0] + m[1] + m[2])).sum::<f64>();
            pixels += tile.moments.len() as f64;
        }
        let floor = (0.01 * (sum / pixels) as f32 / 3.0).max(1e-9);
        Self { tiles: tiles.iter().map(|t| TileNoise::of(&lock(t), floor)).collect() }
    }

    fn sum(&self, f: impl Fn(&TileNoise) -> f64) -> f64 {
        self.tiles.iter().map(|t| t.pixels * f(t)).sum()
    }

    fn error(&self) -> f32 {
        let mean = self.sum(|t| t.variance / f64::from(t.samples)) / self.sum(|_| 1.0);
        mean.sqrt() as f32
    }

    /// Samples per pixel that each tile shall have: as many again in all as there are now, fewer where that
    /// reaches the `target` error. For the least mean square error with a given number of samples, they are shared
    /// out in proportion to the standard deviation.
    fn goals(&self, target: f32) -> Vec<u32> {
        if self.error() <= target {
            return self.tiles.iter().map(|t| t.samples).collect();
        }
        let mean = self.sum(TileNoise::deviation) / self.sum(|_| 1.0);
        // What looks quiet after a few samples may not be: a tenth to all alike.
        let goal = |t: &TileNoise, scale: f64| {
            let wanted = scale * (t.deviation() / mean).max(0.1);
            // In fours, the smallest set of points that is stratified in two dimensions.
            let wanted = ((wanted / 4.0).round() * 4.0).min(f64::from(MAX_SAMPLES)) as u32;
            wanted.max(t.samples)
        };
        let total = self.sum(|t| f64::from(t.samples));
        let enough = |scale: f64| {
            let squared = self.sum(|t| t.variance / f64::from(goal(t, scale))) / self.sum(|_| 1.0);
            squared <= f64::from(target).powi(2) || self.sum(|t| f64::from(goal(t, scale))) >= 2.0 * total
        };
        let (mut low, mut high) = (0.0, f64::from(MAX_SAMPLES) * 10.0);
        while high - low > 0.5 {
            let scale = 0.5 * (low + high);
            if enough(scale) { high = scale } else { low = scale }
        }
        self.tiles.iter().map(|t| goal(t, high)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_with_no_usable_sample_does_not_ask_for_ever_more() {
        let usable = [1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 16.0];
        let mut moments = vec![usable; 64];
        moments[5] = [0.0; 7];
        let tile = Tile {
            origin: [0; 2],
            size: [8; 2],
            samples: 16,
            goal: 16,
            shared: 0.0,
            clamped: 0.0,
            rejected: 16,
            sums: Vec::new(),
            moments,
            before: None,
            guides: Vec::new(),
        };
        let tiles = [Mutex::new(tile)];
        let noise = Noise::of(&tiles);
        // 63 pixels of variance .5 / 15 but for the floor under dark ones, and one of 1.
        let variance = (63.0 * 0.5 / 15.0 + 1.0) / 64.0;
        assert!((f64::from(noise.error()) - (variance / 16.0f64).sqrt()).abs() < 1e-5, "{}", noise.error());
        // .05² of the squared error wants variance / .0025 samples, in fours.
        lock(&tiles[0]).samples = 12;
        assert_eq!(Noise::of(&tiles).goals(0.05), [20]);
    }
}
