//! `yugen render`: a scene file to a picture.

pub mod checkpoint;
mod frames;
pub mod interrupt;
mod parse;
mod realtime;
mod report;

use crate::sequence::Moments;
use crate::{argument, ink, progress};
use anyhow::{Context, Result, bail};
use checkpoint::{Checkpoint, Pace, command_to_go_on};
use clap::{Args, FromArgMatches};
use indicatif::HumanDuration;
use interrupt::Interrupt;
pub use parse::{frames, rate, seconds, size};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use yugen_archive::check_outputs;
use yugen_archive::formats::mesh::Up;
use yugen_archive::formats::{self, image};
use yugen_optics::{ColourSpace, Image};
use yugen_scene::Scene;
use yugen_scene::{Aov, Camera, IntegratorKind};
use yugen_transport::render::{Action, Budget, Job, Options};

/// Renders a scene by path tracing: Mitsuba 3 XML, glTF 2.0 (.gltf, .glb) or Yugen's own TOML.
///
/// `yugen render scene.toml -o picture.exr` is the common case; `--spp`, `--time` or `--error` say how good it has to be.
/// Ctrl-C writes what there is so far, and `--resume` goes on from there, to the same bits; a second Ctrl-C ends at once.
/// `--resume` with a larger `--spp` adds samples to a picture that is done.
#[derive(Args)]
pub struct Render {
    /// The scene file, or a mesh (.obj, .ply, .serialized), which is shown under a sun and a sky, or motion (.bvh, .c3d, …),
    /// which is shown as sticks.
    scene: PathBuf,

    /// The picture: .exr keeps everything (layers, wide gamut); .hdr; .png and .jpg are for display. A scene that moves
    /// becomes numbered pictures by a name as frame_%04d.png, or a film by .mp4 (H.264) or .apng (animated PNG).
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// By which renderer: the reference is a path tracer on the processor that nothing has to be believed of; realtime
    /// is that of the stage, on the GPU (a software one will do), whose frames tend to the same picture. What it
    /// approximates is in docs/realtime.md. ink paints it with a brush, as `yugen ink` does where nothing is said of how.
    #[arg(long, default_value = "reference", value_parser = ["reference", "realtime", "ink"], value_name = "NAME")]
    by: String,

    /// How the real-time renderer lights surfaces: in full, as the reference does, or by the equations of the paper on Takigi Noh
    /// (Wakita et al.), the baseline: fires are points without shadows, highlights one value of the ambient map.
    #[arg(long, default_value = "full", value_parser = ["full", "paper"], value_name = "NAME")]
    lighting: String,

    /// Width and height in pixels instead of the camera's. Where the aspect changes, the field of view stays
    /// along the axis that the scene gave it for.
    #[arg(long, value_name = "WxH", value_parser = parse::size)]
    size: Option<[u32; 2]>,

    /// Only this part of the picture: left, top, width and height in pixels of the whole, which --size may set.
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse::crop)]
    crop: Option<[u32; 4]>,

    /// Samples per pixel instead of what the scene says. Powers of two serve best.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), group = "budget")]
    spp: Option<u32>,

    /// Render for this long: 90, 90s, 5m, 1h; noisy parts get more samples.
    #[arg(long, value_name = "TIME", value_parser = parse::time, group = "budget")]
    time: Option<Duration>,

    /// Render until the relative standard error is below this in the mean (root mean square) over the picture, for
    /// example 0.01; noisy parts get more samples.
    #[arg(long, value_name = "E", value_parser = parse::error, group = "budget")]
    error: Option<f32>,

    /// Same seed, same picture, bit for bit, for any number of threads.
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u32,

    /// Threads instead of one per core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// How light is followed, instead of what the scene says.
    #[arg(long, value_parser = ["path", "direct", "depth", "aov"], value_name = "NAME")]
    integrator: Option<String>,

    /// Longest path, counted in edges from the camera to the light; 2 is direct light.
    #[arg(long, value_name = "N")]
    max_depth: Option<u32>,

    /// Most radiance that a path may bring after more than one bounce, instead of what the scene says. Bright specks
    /// go, and some light with them: how much is stated. The picture is then no reference.
    #[arg(long, value_name = "L", value_parser = argument::positive)]
    clamp: Option<f32>,

    /// Layers to record besides the picture, for .exr: albedo, normal, shading_normal, depth, position, uv, id,
    /// variance; or all of these. Besides them lights: one layer for each name among lights and shapes that shine
    /// (light.NAME.R, G, B), which add up to the picture and so can be dimmed and coloured afterwards (by the reference
    /// only). Pixels then share no paths, and noise is higher.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = parse::aov)]
    aov: Vec<Vec<Aov>>,

    /// Take the noise out of the picture afterwards, by either renderer, guided by what is seen; docs/render.md says how far to
    /// trust it.
    /// The picture as rendered is kept beside it: in an .exr as layer noisy, with the estimated standard error as layer
    /// error; else as NAME.noisy.EXT. Of films and of numbered pictures that are no .exr it is not kept.
    #[arg(long)]
    denoise: bool,

    /// Name of the camera; the first where absent.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,

    /// Go on from the checkpoint beside the output: of a render that was interrupted, or of one that has ended, with
    /// more samples, more time or a smaller error. Samples that are added give the bits they would have given at once.
    /// Of a sequence: leave the pictures that are there already.
    #[arg(long)]
    resume: bool,

    /// Start anew although an unfinished render has left its checkpoint beside the output: it is thrown away.
    #[arg(long, conflicts_with = "resume")]
    restart: bool,

    /// Seconds between checkpoints; 0 writes none. A render that took five seconds or more keeps its last one, so that
    /// --resume can add samples; the next render to the same output replaces it.
    #[arg(long, default_value_t = 30.0, value_name = "S", value_parser = parse::seconds)]
    checkpoint: f64,

    /// Keep the checkpoint however short the render was.
    #[arg(long)]
    keep: bool,

    /// Write the picture as it grows, every five seconds or as many as are given: for viewers that reload a file.
    #[arg(long, value_name = "S", num_args = 0..=1, require_equals = true, default_missing_value = "5",
          value_parser = parse::seconds)]
    watch: Option<f64>,

    #[command(flatten)]
    reading: argument::Reading,

    /// Which way is up in a mesh (.obj, .ply, .serialized) or motion (.bvh, .c3d, …) that is rendered as it is [default: y; of
    /// motion as its file says].
    #[arg(long, value_name = "AXIS", value_parser = ["y", "z"])]
    up: Option<String>,

    #[command(flatten)]
    moments: Moments,

    #[command(flatten)]
    display: argument::FilmDisplayOptions,

    /// Print what was done as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

impl Render {
    /// Of words as they would be typed; the first is not looked at.
    pub fn parse(words: Vec<OsString>) -> Result<Self> {
        let parsed = Self::augment_args(clap::Command::new("render")).try_get_matches_from(words)?;
        Ok(Self::from_arg_matches(&parsed)?)
    }

    /// Does it.
    pub fn run(self) -> Result<()> {
        self.run_with(Self::load)
    }

    /// Does it with a scene that is there already.
    pub fn run_on(self, scene: Scene) -> Result<()> {
        self.run_with(|_| Ok(scene))
    }

    fn run_with(self, load: impl FnOnce(&Self) -> Result<Scene>) -> Result<()> {
        let of_one = [("--watch", self.watch.is_some()), ("--keep", self.keep), ("--restart", self.restart)];
        let outputs = std::slice::from_ref(&self.output);
        self.moments
            .check(outputs, self.resume, &of_one, &|output| Moments::can_write_picture(output, &[]))?;
        if self.lighting != "full" && self.by != "realtime" {
            bail!("--lighting {} is of the real-time renderer: give --by realtime as well", self.lighting);
        }
        self.display.of(&self.output, ColourSpace::default(), yugen_scene::Display::default())?;
        if self.by == "ink" {
            self.check_ink()?;
            let scene = load(&self)?;
            return self.run_ink(scene);
        }
        if self.is_sequence() {
            let scene = load(&self)?;
            return self.run_sequence(scene);
        }
        let checkpoint = Checkpoint::beside(&self.output, &self)?;
        let started = Instant::now();
        let mut scene = load(&self)?;
        self.moments.pose_at(&mut scene, &self.scene)?;
        if self.by == "realtime" {
            return self.run_realtime(&scene, started.elapsed());
        }
        check_outputs([&self.output, &checkpoint.path].into_iter().chain(&self.noisy()))?;
        let loaded = started.elapsed();
        let options = self.options(&scene)?;
        let light = !scene.lights.is_empty() || scene.shapes.iter().any(|s| s.emission.is_some());
        let looks_for = options.integrator.as_ref().map(|i| &i.kind);
        if !light && matches!(looks_for, Some(IntegratorKind::Path | IntegratorKind::Direct)) {
            tracing::warn!(
                "{}: nothing in the scene shines; the picture will be black",
                self.scene.display()
            );
        }
        let job = Job::new(&scene, &options)?;
        let prepared = started.elapsed() - loaded;

        if self.resume {
            checkpoint.resume(&job, self.json)?;
        }
        let ended = self.work(&job, &scene, &checkpoint)?;
        let samples = job.status().samples;
        let written = if samples > 0 { self.write_picture(&job, &scene) } else { Ok(None) };
        let denoising = match written {
            Ok(denoising) => denoising,
            // What cannot be written here may be written there.
            Err(e) => {
                return Err(match checkpoint.write(&job) {
                    Ok(true) => e.context(format!("what was rendered is in {}", checkpoint.path.display())),
                    _ => e,
                });
            }
        };
        let kept = if ended { checkpoint.close(&job, self.keep)? } else { checkpoint.write(&job)? };
        let kept = kept.then_some(checkpoint.path.as_path());
        self.report(&job, &Outcome { loaded, prepared, ended, kept, denoising });
        if !ended {
            if samples == 0 {
                eprintln!("interrupted before the first sample: {} is as it was", self.output.display());
            }
            if kept.is_some() {
                eprintln!("interrupted; this goes on from here, to the same result:");
                eprintln!("  {}", command_to_go_on(std::env::args()));
            }
            std::process::exit(interrupt::STATUS);
        }
        Ok(())
    }

    /// Renders until the budget is spent, which it returns, or somebody presses Ctrl-C.
    fn work(&self, job: &Job, scene: &Scene, checkpoint: &Checkpoint) -> Result<bool> {
        let interrupt = Interrupt::listen()?;
        let bar = progress::bar_of_parts(self.json);
        let mut save = Pace::new(self.checkpoint);
        let mut watch = self.watch.map(Pace::new);
        let complain = |outcome: Result<()>, what: &str| {
            // Hours of work are not thrown away for that; the disk may have room again.
            if let Err(e) = outcome {
                tracing::warn!("{what}: {e:#}; rendering goes on");
            }
        };
        let ended = job.run(|job, p| {
            bar.set_position((p.fraction * 1000.0) as u64);
            let left = p.remaining.map_or(String::new(), |r| format!("{} left", HumanDuration(r)));
            bar.set_message(left);
            if interrupt.came() {
                return Action::Stop;
            }
            if let Some(watch) = &mut watch {
                let write = || self.write_picture(job, scene).map(|_| ());
                watch.keep(|| complain(write(), "the picture so far is not written"));
            }
            if self.checkpoint > 0.0 {
                let write = || checkpoint.write(job).map(|_| ()).map_err(Into::into);
                save.keep(|| complain(write(), "a checkpoint is not written"));
            }
            Action::Continue
        });
        bar.finish_and_clear();
        Ok(ended)
    }

    /// The picture as it stands, whole or not at all; what denoising it came to.
    fn write_picture(&self, job: &Job, scene: &Scene) -> Result<Option<Denoising>> {
        let write = image::WriteOptions {
            metadata: self.metadata(job),
            ..self.display.of(&self.output, scene.working_space, scene.display)?
        };
        let started = Instant::now();
        let picture = job.denoised();
        let denoising = self.denoise.then(|| Denoising::of(&picture, started.elapsed()));
        self.write_layers(picture, &write)?;
        Ok(denoising)
    }

    /// Where a picture that was denoised goes as it was before, if its file has no room for it.
    fn noisy(&self) -> Option<PathBuf> {
        (self.denoise && !is_exr(&self.output)).then(|| beside(&self.output, "noisy"))
    }

    /// Writes a picture with all its layers, as far as its file keeps them.
    fn write_layers(&self, picture: Image, write: &image::WriteOptions) -> Result<()> {
        if let Some(path) = self.noisy() {
            let noisy = picture.select(&["noisy.R", "noisy.G", "noisy.B"]);
            let noisy = noisy.context("a denoised picture keeps the raw one")?;
            let noisy = Image { channels: ["R", "G", "B"].map(String::from).to_vec(), ..noisy };
            image::write(&path, &noisy, write)?;
        }
        Ok(image::write(&self.output, &for_format(picture, &self.output), write)?)
    }

    /// Refuses what was asked for that a painting does not have.
    fn check_ink(&self) -> Result<()> {
        let asked = [
            ("--spp", self.spp.is_some()),
            ("--time", self.time.is_some()),
            ("--error", self.error.is_some()),
            ("--integrator", self.integrator.is_some()),
            ("--max-depth", self.max_depth.is_some()),
            ("--clamp", self.clamp.is_some()),
            ("--aov", !self.aov.is_empty()),
            ("--denoise", self.denoise),
            ("--curve, --exposure and --adaptation", self.display.is_asked()),
            ("--resume of one picture", self.resume && !self.is_sequence()),
            ("--restart", self.restart),
            ("--keep", self.keep),
            ("--watch", self.watch.is_some()),
        ];
        let given: Vec<&str> = asked.iter().filter(|o| o.1).map(|o| o.0).collect();
        if !given.is_empty() {
            bail!(
                "a painting in ink has no {}: leave that out; 'yugen ink' has the options of a brush",
                given.join(", ")
            );
        }
        Ok(())
    }

    fn run_ink(&self, scene: Scene) -> Result<()> {
        ink::Job {
            scene: &self.scene,
            outputs: std::slice::from_ref(&self.output),
            style: ink::plain(self.seed)?,
            literal: false,
            mount: None,
            size: self.size,
            crop: self.crop,
            camera: self.camera.as_deref(),
            moments: &self.moments,
            resume: self.resume,
            replay: false,
            threads: argument::threads(self.threads),
            json: self.json,
        }
        .run(scene)
    }

    fn load(&self) -> Result<Scene> {
        let options = formats::Options {
            up: self.up.as_deref().map(|axis| if axis == "z" { Up::Z } else { Up::Y }),
            ..self.reading.options()
        };
        let mut scene = formats::load_scene(&self.scene, &options)?;
        if let Some(size) = self.size {
            scene.settle_framing(size);
        }
        Ok(scene)
    }

    /// The camera that is looked through.
    fn camera(&self, scene: &Scene) -> Result<Camera> {
        Ok(scene.look_through(self.camera.as_deref(), self.size, self.crop)?)
    }

    fn options(&self, scene: &Scene) -> Result<Options> {
        let budget = match (self.spp, self.time, self.error) {
            (Some(n), ..) => Some(Budget::Samples(n)),
            (_, Some(t), _) => Some(Budget::Time(t)),
            (.., Some(e)) => Some(Budget::Error(e)),
            _ => None,
        };
        let mut integrator = scene.integrator.clone();
        if let Some(name) = &self.integrator {
            integrator.kind = match name.as_str() {
                "direct" => IntegratorKind::Direct,
                "depth" => IntegratorKind::Depth,
                "aov" => IntegratorKind::Aov,
                _ => IntegratorKind::Path,
            };
        }
        if self.max_depth.is_some() {
            integrator.max_depth = self.max_depth;
        }
        if self.clamp.is_some() {
            integrator.clamp = self.clamp;
        }
        let mut aovs = Vec::new();
        for aov in self.aov.iter().flatten() {
            if !aovs.contains(aov) {
                aovs.push(*aov);
            }
        }
        if self.denoise && !matches!(integrator.kind, IntegratorKind::Path | IntegratorKind::Direct) {
            bail!("--denoise is for light; the integrator looks for other things");
        }
        if !aovs.is_empty() && !is_exr(&self.output) {
            bail!("--aov needs an .exr to keep its layers in; {} is not one", self.output.display());
        }
        Ok(Options {
            camera: self.camera.clone(),
            size: self.size,
            crop: self.crop,
            budget,
            seed: self.seed,
            threads: self.threads.map(usize::from),
            integrator: Some(integrator),
            aovs,
            denoise: self.denoise,
        })
    }
}

/// How it went.
struct Outcome<'a> {
    /// Time for reading.
    loaded: Duration,
    /// Time for hierarchy and tables.
    prepared: Duration,
    /// The budget was spent.
    ended: bool,
    /// The checkpoint that is there now.
    kept: Option<&'a Path>,
    /// Of the picture, where it was asked for.
    denoising: Option<Denoising>,
}

/// What denoising a picture came to.
struct Denoising {
    took: Duration,
    /// Estimate of the relative standard error that remains, root mean square over the picture.
    error: f32,
}

impl Denoising {
    /// Of a denoised picture.
    fn of(picture: &Image, took: Duration) -> Self {
        Self { took, error: report::error_that_remains(picture) }
    }
}

/// Whether a file keeps layers.
fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
}

/// `picture.png` to `picture.noisy.png`.
fn beside(path: &Path, what: &str) -> PathBuf {
    path.with_extension(match path.extension() {
        Some(extension) => format!("{what}.{}", extension.display()),
        None => what.to_string(),
    })
}

/// Display formats get the picture only.
fn for_format(picture: Image, path: &Path) -> Image {
    if is_exr(path) {
        return picture;
    }
    picture.select(&["R", "G", "B"]).unwrap_or(picture)
}
