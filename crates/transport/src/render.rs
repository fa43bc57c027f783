//! From a scene to a picture: tiles on all cores, budgets, checkpoints.
//!
//! A tile is advanced a few samples at a time and depends on nothing but its own samples, so the picture is the
//! same bits for any number of threads, and a render killed at any moment goes on from its last checkpoint to
//! the identical result.

use crate::accel::NO_INSTANCE;
use crate::camera::Lens;
use crate::film::{FilmLayout, Tile};
use crate::integrator::{FirstHit, Follow, PrepareError, World};
use crate::sampler::Sampler;
use glam::Vec2;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use yugen_archive::Scene;
use yugen_archive::scene::{Aov, Camera, Integrator};
use yugen_optics::{Fingerprint, Image};

/// Channels an AOV adds to the filtered sums; id and variance are made otherwise.
fn channels(aov: Aov) -> &'static [&'static str] {
    match aov {
        Aov::Albedo => &["albedo.R", "albedo.G", "albedo.B"],
        Aov::Normal => &["normal.X", "normal.Y", "normal.Z"],
        Aov::ShadingNormal => &["shading_normal.X", "shading_normal.Y", "shading_normal.Z"],
        Aov::Depth => &["depth.Z"],
        Aov::Position => &["position.X", "position.Y", "position.Z"],
        Aov::Uv => &["uv.U", "uv.V"],
        Aov::Id | Aov::Variance => &[],
    }
}

fn push(aov: Aov, first: &FirstHit, out: &mut Vec<f32>) {
    match aov {
        Aov::Albedo => out.extend(first.albedo.to_array()),
        Aov::Normal => out.extend(first.normal.to_array()),
        Aov::ShadingNormal => out.extend(first.shading_normal.to_array()),
        Aov::Depth => out.push(first.depth),
        Aov::Position => out.extend(first.position.to_array()),
        Aov::Uv => out.extend(first.uv.to_array()),
        Aov::Id | Aov::Variance => {}
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// After this many samples in every pixel.
    Samples(u32),
    /// After this long.
    Time(Duration),
    /// When the root mean square of the relative standard error over a tile is below this, tile by tile.
    Error(f32),
}

/// Most samples a pixel gets under an error target.
pub const MAX_SAMPLES: u32 = 1 << 16;
/// Most pixels of a picture: 16 GB of sums and moments.
const MAX_PIXELS: u64 = 1 << 28;
/// Fewest samples before the error of a tile is believed.
const MIN_SAMPLES: u32 = 32;
/// Samples per pixel of one visit to a tile.
const STEP: u32 = 16;

/// How to render a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Name of the camera; the first of the scene where absent.
    pub camera: Option<String>,
    /// Width and height instead of the camera's, as [`Camera::resize`] does it.
    pub size: Option<[u32; 2]>,
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
}

/// What an observer wants done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Go on.
    Continue,
    /// Leave it; what is done so far can be developed or stored.
    Stop,
}

/// A checkpoint could not be taken up.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ResumeError {
    /// Not a checkpoint, cut short or damaged.
    #[error("this is not a whole checkpoint: {0}")]
    Damaged(&'static str),
    /// Of another picture.
    #[error(
        "the checkpoint belongs to another scene (or one whose meshes, pictures or tables have changed since), size, seed, \
         integrator or budget; remove it to start anew"
    )]
    Other,
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
    threads: usize,
    fingerprint: u64,
    tiles: Vec<Mutex<Tile>>,
    /// Milliseconds spent by earlier runs and, once it has ended, this one.
    elapsed: AtomicU64,
}

impl Job {
    /// Prepares `scene`. Its fingerprint goes into the checkpoints, so that none is taken up by another one.
    pub fn new(scene: &Scene, options: &Options) -> Result<Self, PrepareError> {
        let mut camera = choose_camera(scene, options.camera.as_deref())?.clone();
        if let Some([w, h]) = options.size {
            camera.resize(w, h);
        }
        let integrator = options.integrator.clone().unwrap_or_else(|| scene.integrator.clone());
        let mut aovs = options.aovs.clone();
        for aov in &integrator.aovs {
            if !aovs.contains(aov) {
                aovs.push(*aov);
            }
        }
        let named = aovs.iter().flat_map(|a| channels(*a)).copied();
        let channels = ["R", "G", "B", "A"].into_iter().chain(named).map(String::from).collect();
        let layout = FilmLayout::new(&camera.film, channels);
        let [_, _, width, height] = layout.window;
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            return Err(PrepareError::TooLarge { width, height, limit: MAX_PIXELS });
        }
        let budget = options.budget.unwrap_or(Budget::Samples(camera.samples_per_pixel.max(1)));
        let mut print = Fingerprint::default();
        print.word(scene.fingerprint());
        print.debug(&(&camera, &integrator, &aovs, budget, options.seed, layout.window));
        let tiles = layout.tiles().into_iter().map(Mutex::new).collect();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Ok(Self {
            world: World::new(scene)?,
            lens: Lens::new(&camera),
            layout,
            integrator,
            aovs,
            budget,
            seed: options.seed,
            threads: options.threads.unwrap_or(cores).max(1),
            fingerprint: print.finish(),
            tiles,
            elapsed: AtomicU64::new(0),
        })
    }

    /// The prepared scene.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Width and height of the picture it makes.
    pub fn size(&self) -> [u32; 2] {
        [self.layout.window[2], self.layout.window[3]]
    }

    /// Renders until the budget is spent or `observe`, called a few times a second, says stop. Returns whether
    /// the budget was spent.
    pub fn run(&self, mut observe: impl FnMut(&Self, &Progress) -> Action) -> bool {
        let started = Instant::now();
        let before = Duration::from_millis(self.elapsed.load(Ordering::Relaxed));
        let before_samples = self.samples();
        let queue: BinaryHeap<Reverse<(u32, usize)>> = self
            .tiles
            .iter()
            .enumerate()
            .filter_map(|(i, t)| {
                let t = lock(t);
                (!t.done).then_some(Reverse((t.samples, i)))
            })
            .collect();
        let queue = Mutex::new((queue, 0usize));
        let (stop, stopped_early) = (AtomicBool::new(false), AtomicBool::new(false));
        let finished = (Mutex::new(0usize), Condvar::new());
        std::thread::scope(|scope| {
            for _ in 0..self.threads {
                scope.spawn(|| {
                    loop {
                        if stop.load(Ordering::Relaxed) {
                            break;
                        }
                        if let Budget::Time(limit) = self.budget
                            && before + started.elapsed() >= limit
                        {
                            break;
                        }
                        let next = {
                            let mut q = lock(&queue);
                            let next = q.0.pop();
                            if next.is_some() {
                                q.1 += 1;
                            }
                            next.ok_or(q.1)
                        };
                        match next {
                            Ok(Reverse((_, i))) => {
                                let mut tile = lock(&self.tiles[i]);
                                self.advance(&mut tile);
                                let again = (!tile.done).then_some(tile.samples);
                                drop(tile);
                                let mut q = lock(&queue);
                                q.1 -= 1;
                                if let Some(samples) = again {
                                    q.0.push(Reverse((samples, i)));
                                }
                            }
                            // Others may still put their tile back.
                            Err(busy) if busy > 0 => std::thread::sleep(Duration::from_millis(1)),
                            Err(_) => break,
                        }
                    }
                    *lock(&finished.0) += 1;
                    finished.1.notify_all();
                });
            }
            let mut done = lock(&finished.0);
            while *done < self.threads {
                done = finished
                    .1
                    .wait_timeout(done, Duration::from_millis(200))
                    .unwrap_or_else(PoisonError::into_inner)
                    .0;
                if *done < self.threads {
                    drop(done);
                    let elapsed = before + started.elapsed();
                    self.elapsed.store(elapsed.as_millis() as u64, Ordering::Relaxed);
                    let progress = self.progress(elapsed, started.elapsed(), before_samples);
                    if observe(self, &progress) == Action::Stop {
                        stop.store(true, Ordering::Relaxed);
                        stopped_early.store(true, Ordering::Relaxed);
                    }
                    done = lock(&finished.0);
                }
            }
        });
        self.elapsed.store((before + started.elapsed()).as_millis() as u64, Ordering::Relaxed);
        !stopped_early.load(Ordering::Relaxed)
    }

    /// Where it stands.
    pub fn status(&self) -> Progress {
        self.progress(Duration::from_millis(self.elapsed.load(Ordering::Relaxed)), Duration::ZERO, 0)
    }

    fn samples(&self) -> u64 {
        self.tiles
            .iter()
            .map(|t| lock(t))
            .map(|t| u64::from(t.samples) * u64::from(t.size[0] * t.size[1]))
            .sum()
    }

    fn progress(&self, elapsed: Duration, this_run: Duration, before_samples: u64) -> Progress {
        let (mut samples, mut pixels, mut rejected, mut done, mut fraction) =
            (0u64, 0u64, 0u64, 0u64, 0.0f64);
        for tile in &self.tiles {
            let tile = lock(tile);
            let n = u64::from(tile.size[0] * tile.size[1]);
            samples += u64::from(tile.samples) * n;
            pixels += n;
            rejected += tile.rejected;
            if tile.done {
                done += n;
            }
            if let Budget::Error(target) = self.budget {
                // Error falls at least like 1/√n: the share of the samples that will be needed.
                let share = if tile.done { 1.0 } else { (target / tile_error(&tile)).powi(2).min(1.0) };
                fraction += f64::from(share) * n as f64;
            }
        }
        let fraction = match self.budget {
            Budget::Samples(n) => samples as f64 / (pixels * u64::from(n)) as f64,
            Budget::Time(limit) => elapsed.as_secs_f64() / limit.as_secs_f64().max(1e-9),
            Budget::Error(_) if done == pixels => 1.0,
            Budget::Error(_) => fraction / pixels as f64,
        }
        .clamp(0.0, 1.0);
        let remaining = match self.budget {
            Budget::Time(limit) => Some(limit.saturating_sub(elapsed)),
            Budget::Samples(n) => {
                let taken = samples.saturating_sub(before_samples);
                let left = (pixels * u64::from(n)).saturating_sub(samples);
                (taken > 0).then(|| this_run.mul_f64(left as f64 / taken as f64))
            }
            Budget::Error(_) => (fraction > 0.01).then(|| elapsed.mul_f64((1.0 - fraction) / fraction)),
        };
        Progress { fraction, samples, elapsed, remaining, rejected }
    }

    /// Takes the next few samples of every pixel of a tile.
    fn advance(&self, tile: &mut Tile) {
        let limit = match self.budget {
            Budget::Samples(n) => n,
            Budget::Time(_) => u32::MAX,
            Budget::Error(_) => MAX_SAMPLES,
        };
        let end = tile.samples.saturating_add(STEP).min(limit);
        let (spread, width) = self.lens.pixel_spread();
        // The samples of a pixel share its footprint.
        let sharpen = 1.0 / (end as f32).sqrt().clamp(1.0, 8.0);
        let mut values = Vec::with_capacity(self.layout.channels.len());
        let mut visit = self.layout.visit(tile);
        let follow = Follow {
            settings: &self.integrator,
            albedo: self.aovs.contains(&Aov::Albedo),
            width: width * sharpen,
            spread: spread * sharpen,
        };
        let [x0, y0] = tile.origin;
        for y in y0..y0 + tile.size[1] {
            for x in x0..x0 + tile.size[0] {
                for index in tile.samples..end {
                    let mut sampler = Sampler::new(x, y, index, self.seed);
                    let [px, py, u, v] = sampler.next_4d();
                    let position = Vec2::new(x as f32 + px, y as f32 + py);
                    let ray = self.lens.ray(position, Vec2::new(u, v));
                    let r = self.world.radiance(&follow, ray, &mut sampler);
                    values.clear();
                    values.extend(r.rgb.to_array());
                    values.push(r.alpha);
                    for aov in &self.aovs {
                        push(*aov, &r.first, &mut values);
                    }
                    self.layout.add(tile, &mut visit, [x, y], position.to_array(), &values);
                }
            }
        }
        self.layout.flush(tile, &visit);
        tile.samples = end;
        tile.done = end >= limit
            || matches!(self.budget, Budget::Error(target) if end >= MIN_SAMPLES && tile_error(tile) <= target);
    }

    /// The picture as it stands: R, G, B, A, then the AOVs as `layer.channel`.
    pub fn image(&self) -> Image {
        let tiles: Vec<Tile> = self.tiles.iter().map(|t| lock(t).clone()).collect();
        let mut image = self.layout.develop(&tiles, self.aovs.contains(&Aov::Variance));
        if self.aovs.contains(&Aov::Id) {
            image = self.with_ids(image);
        }
        image
    }

    /// Shape numbers do not average: one ray through each pixel's centre.
    fn with_ids(&self, image: Image) -> Image {
        let [x0, y0, ..] = self.layout.window;
        let n = image.channels.len();
        let mut out = Image {
            width: image.width,
            height: image.height,
            channels: image.channels.iter().cloned().chain(["id.Y".to_string()]).collect(),
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

    /// Everything needed to go on later, as bytes.
    pub fn checkpoint(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&self.fingerprint.to_le_bytes());
        out.extend_from_slice(&self.elapsed.load(Ordering::Relaxed).to_le_bytes());
        out.extend_from_slice(&(self.tiles.len() as u64).to_le_bytes());
        for tile in &self.tiles {
            let tile = lock(tile);
            out.extend_from_slice(&tile.samples.to_le_bytes());
            out.extend_from_slice(&u32::from(tile.done).to_le_bytes());
            out.extend_from_slice(&tile.rejected.to_le_bytes());
            for s in &tile.sums {
                out.extend_from_slice(&s.to_le_bytes());
            }
            for v in tile.moments.iter().flatten() {
                out.extend_from_slice(&v.to_le_bytes());
            }
        }
        let sum = Fingerprint::of(&out);
        out.extend_from_slice(&sum.to_le_bytes());
        out
    }

    /// Takes up a checkpoint of the same job.
    pub fn resume(&self, bytes: &[u8]) -> Result<(), ResumeError> {
        let (body, sum) = bytes.split_last_chunk::<8>().ok_or(ResumeError::Damaged("too short"))?;
        let mut from =
            Reader(body.strip_prefix(MAGIC).ok_or(ResumeError::Damaged("it does not start like one"))?);
        if Fingerprint::of(body) != u64::from_le_bytes(*sum) {
            return Err(ResumeError::Damaged("its checksum is wrong"));
        }
        if u64::from_le_bytes(from.take()?) != self.fingerprint {
            return Err(ResumeError::Other);
        }
        let elapsed = u64::from_le_bytes(from.take()?);
        if u64::from_le_bytes(from.take()?) != self.tiles.len() as u64 {
            return Err(ResumeError::Other);
        }
        for tile in &self.tiles {
            let mut tile = lock(tile);
            tile.samples = u32::from_le_bytes(from.take()?);
            tile.done = u32::from_le_bytes(from.take()?) != 0;
            tile.rejected = u64::from_le_bytes(from.take()?);
            for s in &mut tile.sums {
                *s = f64::from_le_bytes(from.take()?);
            }
            for v in tile.moments.iter_mut().flatten() {
                *v = f32::from_le_bytes(from.take()?);
            }
        }
        self.elapsed.store(elapsed, Ordering::Relaxed);
        Ok(())
    }
}

const MAGIC: &[u8] = b"yugen checkpoint 2\n";

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ResumeError> {
        let (head, rest) = self.0.split_first_chunk::<N>().ok_or(ResumeError::Damaged("cut short"))?;
        self.0 = rest;
        Ok(*head)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic elsewhere already ends the run; the data is plain numbers.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Root mean square over a tile of standard error over value; dark pixels count as a hundredth of the mean.
fn tile_error(tile: &Tile) -> f32 {
    let mean: f32 = tile.moments.iter().map(|m| m[0] + m[1] + m[2]).sum::<f32>() / tile.moments.len() as f32;
    let floor = (0.01 * mean).max(1e-6);
    let sum: f32 = tile
        .moments
        .iter()
        .map(|m| {
            let n = m[6];
            if n < 2.0 {
                return 1.0;
            }
            let variance = (m[3] + m[4] + m[5]) / (n - 1.0) / n;
            let value = (m[0] + m[1] + m[2]).max(floor);
            // Channels vary together more often than not: the error of their sum is at most √3 that.
            3.0 * variance / (value * value)
        })
        .sum();
    (sum / tile.moments.len() as f32).sqrt()
}

fn choose_camera<'a>(scene: &'a Scene, name: Option<&str>) -> Result<&'a Camera, PrepareError> {
    let found = match name {
        None => scene.cameras.first(),
        Some(name) => scene.cameras.iter().find(|c| c.name == name),
    };
    found.ok_or_else(|| {
        let known: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        let known = if known.is_empty() { "none".to_string() } else { known.join(", ") };
        PrepareError::UnknownCamera { name: name.unwrap_or("").to_string(), known }
    })
}
