//! `yugen render`: a scene file to a picture.

mod parse;
mod report;

use crate::{argument, progress};
use anyhow::{Context, Result, bail};
use clap::Args;
use indicatif::HumanDuration;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use yugen_archive::formats::{self, Moment, image};
use yugen_archive::scene::{Aov, IntegratorKind};
use yugen_archive::{Scene, atomic_write, check_outputs, read_own};
use yugen_optics::{ColourSpace, Image};
use yugen_transport::render::{Action, Budget, Job, Options};

/// Renders a scene by path tracing: Mitsuba 3 XML, glTF 2.0 (.gltf, .glb) or Yugen's own TOML.
///
/// `yugen render scene.toml -o picture.exr` is the common case; `--spp`, `--time` or `--error` say how good it has to be.
/// A render that was interrupted goes on with `--resume`, to the same bits.
#[derive(Args)]
pub struct Render {
    /// The scene file.
    scene: PathBuf,

    /// The picture: .exr keeps everything (layers, wide gamut); .hdr; .png and .jpg are for display.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Width and height in pixels instead of the camera's. Where the aspect changes, the field of view stays
    /// along the axis that the scene gave it for.
    #[arg(long, value_name = "WxH", value_parser = parse::size)]
    size: Option<[u32; 2]>,

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
    /// variance; or all.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = parse::aov)]
    aov: Vec<Vec<Aov>>,

    /// Name of the camera; the first where absent.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,

    /// Go on from the checkpoint that an interrupted render left beside the output.
    #[arg(long)]
    resume: bool,

    /// Seconds between checkpoints; 0 writes none.
    #[arg(long, default_value_t = 30.0, value_name = "S", value_parser = parse::seconds)]
    checkpoint: f64,

    #[command(flatten)]
    reading: argument::Reading,

    /// The pose of a glTF scene this many seconds into its animation; as the file stands where absent.
    #[arg(long, value_name = "S", value_parser = parse::seconds)]
    at: Option<f64>,

    /// Which animation, by its name; the first where absent.
    #[arg(long, value_name = "NAME", requires = "at")]
    animation: Option<String>,

    #[command(flatten)]
    display: argument::Display,

    /// Print what was done as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

impl Render {
    /// Does it.
    pub fn run(self) -> Result<()> {
        image::can_write(&self.output)?;
        self.display.of(&self.output, ColourSpace::default())?;
        let started = Instant::now();
        let moment = |seconds| Moment { seconds: seconds as f32, animation: self.animation.clone() };
        let options = formats::Options { moment: self.at.map(moment), ..self.reading.options() };
        let scene = formats::load_scene(&self.scene, &options)?;
        let checkpoint = checkpoint_path(&self.output);
        check_outputs([&self.output, &checkpoint])?;
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

        if self.resume && !checkpoint.exists() {
            eprintln!("there is no checkpoint {}: starting from the beginning", checkpoint.display());
        } else if self.resume {
            let bytes = read_own(&checkpoint, u64::MAX)?;
            job.resume(&bytes).with_context(|| format!("{}", checkpoint.display()))?;
            if !self.json {
                eprintln!("going on from {}", checkpoint.display());
            }
        }

        let bar = progress::bar_of_parts(self.json);
        let every = Duration::from_secs_f64(self.checkpoint);
        let mut saved = Instant::now();
        let mut failure = None;
        job.run(|job, p| {
            bar.set_position((p.fraction * 1000.0) as u64);
            let left = p.remaining.map_or(String::new(), |r| format!("{} left", HumanDuration(r)));
            bar.set_message(left);
            if self.checkpoint > 0.0 && saved.elapsed() >= every {
                saved = Instant::now();
                if let Err(e) = atomic_write(&checkpoint, &job.checkpoint()) {
                    failure = Some(e);
                    return Action::Stop;
                }
            }
            Action::Continue
        });
        bar.finish_and_clear();
        if let Some(e) = failure {
            return Err(e).context("cannot write a checkpoint (--checkpoint 0 renders without)");
        }
        let picture = job.image();
        let write = image::WriteOptions {
            metadata: self.metadata(&job),
            ..self.display.of(&self.output, scene.working_space)?
        };
        image::write(&self.output, &for_format(picture, &self.output), &write)?;
        if checkpoint.exists() {
            let _ = std::fs::remove_file(&checkpoint);
        }
        self.report(&job, loaded, prepared);
        Ok(())
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
        if !aovs.is_empty() && self.output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("exr")) {
            bail!("--aov needs an .exr to keep its layers in; {} is not one", self.output.display());
        }
        Ok(Options {
            camera: self.camera.clone(),
            size: self.size,
            budget,
            seed: self.seed,
            threads: self.threads.map(usize::from),
            integrator: Some(integrator),
            aovs,
        })
    }
}

/// Display formats get the picture only.
fn for_format(picture: Image, path: &Path) -> Image {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        return picture;
    }
    picture.select(&["R", "G", "B"]).unwrap_or(picture)
}

fn checkpoint_path(output: &Path) -> PathBuf {
    let mut name = output.file_name().unwrap_or_default().to_os_string();
    name.push(".checkpoint");
    output.with_file_name(name)
}
