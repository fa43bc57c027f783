//! `yugen render --by realtime`: the same picture by the real-time renderer, frame upon frame.

use super::interrupt::{self, Interrupt};
use super::{Denoising, Render};
use crate::{json, progress};
use anyhow::{Result, bail};
use serde_json::json;
use std::time::{Duration, Instant};
use yugen_archive::check_outputs;
use yugen_archive::formats::image;
use yugen_optics::denoise::both_halves;
use yugen_optics::{Image, parallel};
use yugen_realtime::{Gpu, Lighting, Options, Stage};
use yugen_scene::prepared::Rows;
use yugen_scene::{Aov, Camera, IntegratorKind, Scene, Strategy};
use yugen_transport::integrator::PrepareError;

/// The real-time renderer with a scene.
pub(super) struct Realtime<'a> {
    render: &'a Render,
    gpu: Gpu,
    options: Options,
    /// For other poses; of one picture they need not be kept.
    rows: Option<Rows>,
    stage: Stage,
    camera: Camera,
    /// Not even what shines is seen by a path without edges.
    dark: bool,
}

impl<'a> Realtime<'a> {
    /// Prepares for the pictures of a scene that `render` asks for.
    pub(super) fn new(render: &'a Render, scene: &Scene) -> Result<Self> {
        render.check_realtime(scene)?;
        let asked = render.options(scene)?;
        let camera = render.camera(scene)?;
        if render.denoise && render.time.is_none() && render.frames_of(&camera) < 2 {
            return Err(PrepareError::TooFewToDenoise.into());
        }
        let integrator = asked.integrator.unwrap_or_else(|| scene.integrator.clone());
        if integrator.clamp.is_some() {
            tracing::warn!("the clamp that the scene asks for is left out: the real-time renderer has none");
        }
        let gpu = Gpu::open()?;
        let film = &camera.film;
        let options = Options {
            size: film.crop.map_or([film.width, film.height], |[_, _, w, h]| [w, h]),
            filter: film.filter,
            aovs: asked.aovs,
            denoise: render.denoise,
            planned: render.time.is_none().then(|| render.frames_of(&camera)),
            trace_camera: false,
            threads: asked.threads.unwrap_or_else(parallel::threads),
            bounces: Some(integrator.most_bounces()),
            hide_emitters: integrator.hide_emitters,
            lighting: if render.lighting == "paper" { Lighting::Paper } else { Lighting::Full },
            seed: render.seed,
        };
        let dark = integrator.kind == IntegratorKind::Path && integrator.max_depth == Some(0);
        let rows = match dark {
            true => Rows::new(&without_light(scene))?,
            false => Rows::new(scene)?,
        };
        let stage = Stage::new(&gpu.device, &gpu.queue, &rows, &options)?;
        if stage.has_head_light() {
            tracing::warn!(
                "the scene has no light: it is lit from the eye, where the reference renderer sees nothing"
            );
        }
        let rows = render.is_sequence().then_some(rows);
        Ok(Self { render, gpu, options, rows, stage, camera, dark })
    }

    /// Takes over another pose of the scene.
    pub(super) fn pose(&mut self, scene: &Scene) -> Result<()> {
        self.camera = self.render.camera(scene)?;
        let Some(rows) = &mut self.rows else { return Ok(()) };
        match self.dark {
            true => rows.pose(&without_light(scene))?,
            false => rows.pose(scene)?,
        }
        if !self.stage.pose(rows)? {
            // As where a mesh has been flattened, which is no longer the same mesh.
            tracing::info!("the stage is made anew");
            self.stage = Stage::new(&self.gpu.device, &self.gpu.queue, rows, &self.options)?;
        }
        Ok(())
    }

    /// Frames that a picture gets whatever time there is: a denoiser compares halves of them.
    fn least(&self) -> u32 {
        if self.options.denoise { both_halves(self.options.planned) } else { 1 }
    }

    /// Whether a picture of so many frames is denoised: the second half has some of them.
    fn denoises(&self, frames: u32) -> bool {
        self.options.denoise && frames > self.least() / 2
    }

    /// Adds frames until the picture is as good as was asked for or `stop` says so; `tell` is told which part is done.
    /// Returns how many frames it has.
    pub(super) fn paint(&mut self, stop: &dyn Fn() -> bool, tell: &dyn Fn(f64)) -> Result<u32> {
        let time = self.render.time;
        let frames = if time.is_some() { u32::MAX } else { self.render.frames_of(&self.camera) };
        let begun = Instant::now();
        let mut done = 0;
        while done < frames && !stop() {
            done = self.stage.frame(&self.camera)?;
            self.stage.wait()?;
            let part = match time {
                Some(limit) => (begun.elapsed().as_secs_f64() / limit.as_secs_f64().max(1e-9))
                    .min(f64::from(done) / f64::from(self.least())),
                None => f64::from(done) / f64::from(frames),
            };
            tell(part.min(1.0));
            if part >= 1.0 {
                break;
            }
        }
        if self.options.denoise && !self.denoises(done) {
            tracing::warn!(
                "the picture is as rendered: a denoiser would have needed {} frames, and it has {done}",
                self.least()
            );
        }
        Ok(done)
    }

    /// The picture as it stands; denoised, where that was asked for.
    pub(super) fn image(&self) -> Result<Image> {
        Ok(self.stage.denoised(self.options.threads)?)
    }

    /// Pixels across and down.
    pub(super) fn size(&self) -> [u32; 2] {
        self.options.size
    }

    /// Of the device.
    pub(super) fn adapter(&self) -> &str {
        &self.gpu.name
    }
}

fn without_light(scene: &Scene) -> Scene {
    let mut dark = scene.clone();
    dark.lights.clear();
    dark.light_names.clear();
    dark.shapes.iter_mut().for_each(|shape| shape.emission = None);
    dark
}

impl Render {
    /// What was asked for that the real-time renderer does not have.
    fn check_realtime(&self, scene: &Scene) -> Result<()> {
        let asked = [
            ("--error", self.error.is_some()),
            ("--clamp", self.clamp.is_some()),
            // Of a sequence it means the pictures that are there.
            ("--resume", self.resume && !self.is_sequence()),
            ("--restart", self.restart),
            ("--keep", self.keep),
            ("--watch", self.watch.is_some()),
        ];
        let mut missing: Vec<String> =
            asked.iter().filter(|(_, asked)| *asked).map(|(name, _)| name.to_string()).collect();
        missing.extend(
            self.integrator
                .iter()
                .filter(|i| *i == "depth" || *i == "aov")
                .map(|i| format!("--integrator {i}")),
        );
        let lights = self.aov.iter().flatten().any(|a| *a == Aov::Lights);
        missing.extend(lights.then(|| "--aov lights".to_string()));
        if scene.integrator.strategy != Strategy::Both {
            missing.push("way to look for light by one kind of samples only, as the scene asks".into());
        }
        if !missing.is_empty() {
            bail!(
                "the real-time renderer has no {}: leave that out, or render by the reference, which has",
                missing.join(", ")
            );
        }
        if self.integrator.is_none()
            && matches!(scene.integrator.kind, IntegratorKind::Depth | IntegratorKind::Aov)
        {
            bail!(
                "{} asks for depth or layers only, which the real-time renderer has no picture of; --integrator path \
                 makes one",
                self.scene.display()
            );
        }
        Ok(())
    }

    /// Frames of a picture whose budget is a count: --spp, else the camera's; at least 1.
    fn frames_of(&self, camera: &Camera) -> u32 {
        self.spp.unwrap_or(camera.samples_per_pixel).max(1)
    }

    /// What goes into the header of a picture of so many frames.
    pub(super) fn realtime_metadata(&self, adapter: &str, frames: u32) -> Vec<(String, String)> {
        vec![
            ("yugen:version".into(), env!("CARGO_PKG_VERSION").into()),
            ("yugen:scene".into(), self.scene.display().to_string()),
            ("yugen:renderer".into(), format!("realtime on {adapter}")),
            ("yugen:samples".into(), frames.to_string()),
        ]
    }

    /// Does it for a scene that took so long to read.
    pub(super) fn run_realtime(&self, scene: &Scene, loaded: Duration) -> Result<()> {
        check_outputs([&self.output].into_iter().chain(&self.noisy()))?;
        let started = Instant::now();
        let mut realtime = Realtime::new(self, scene)?;
        let prepared = started.elapsed();

        let interrupt = Interrupt::listen()?;
        let bar = progress::bar_of_parts(self.json);
        let begun = Instant::now();
        let done = realtime.paint(&|| interrupt.came(), &|part| bar.set_position((part * 1000.0) as u64))?;
        bar.finish_and_clear();
        let seconds = begun.elapsed().as_secs_f64();
        let write = image::WriteOptions {
            metadata: self.realtime_metadata(realtime.adapter(), done),
            ..self.display.of(&self.output, scene.working_space, scene.display)?
        };
        let begun = Instant::now();
        let picture = realtime.image()?;
        let denoising = realtime.denoises(done).then(|| Denoising::of(&picture, begun.elapsed()));
        self.write_layers(picture, &write)?;
        let [w, h] = realtime.size();
        if self.json {
            let times = realtime.stage.timings();
            let passes = times.iter().map(|t| (t.pass.to_string(), t.milliseconds.into()));
            json::print(json!({
                "output": self.output.display().to_string(),
                "finished": !interrupt.came(),
                "renderer": "realtime",
                "adapter": realtime.adapter(),
                "width": w,
                "height": h,
                "samples_per_pixel": done,
                "render_seconds": seconds,
                "load_seconds": loaded.as_secs_f64(),
                "prepare_seconds": prepared.as_secs_f64(),
                "denoise_seconds": denoising.as_ref().map(|d| d.took.as_secs_f64()),
                "denoised_relative_error": denoising.as_ref().map(|d| d.error),
                "milliseconds": passes.collect::<serde_json::Map<_, _>>(),
            }));
        } else {
            println!(
                "{}: {w}x{h}, {done} frames of one sample a pixel in {seconds:.1} s on {}",
                self.output.display(),
                realtime.adapter()
            );
            if let Some(Denoising { took, error }) = denoising {
                println!("denoised in {:.1} s: a relative error of about {error:.3}", took.as_secs_f64());
            }
        }
        if interrupt.came() {
            std::process::exit(interrupt::STATUS);
        }
        Ok(())
    }
}
