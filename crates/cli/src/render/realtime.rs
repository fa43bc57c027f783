//! `yugen render --by realtime`: the same picture by the real-time renderer, frame upon frame.

use super::interrupt::{self, Interrupt};
use super::{Render, for_format};
use crate::{json, progress};
use anyhow::{Result, bail};
use serde_json::json;
use std::time::{Duration, Instant};
use yugen_archive::check_outputs;
use yugen_archive::formats::image;
use yugen_realtime::{Gpu, Options, Stage};
use yugen_scene::prepared::Rows;
use yugen_scene::{Aov, IntegratorKind, Scene, Strategy};

impl Render {
    /// What was asked for that the real-time renderer does not have.
    fn check_realtime(&self, scene: &Scene) -> Result<()> {
        let asked = [
            ("--error", self.error.is_some()),
            ("--clamp", self.clamp.is_some()),
            ("--denoise", self.denoise),
            ("--resume", self.resume),
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
        let aovs = self.aov.iter().flatten().filter(|a| a.channels().is_empty() || **a == Aov::Albedo);
        missing.extend(aovs.map(|a| format!("--aov {}", a.name())));
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

    /// Does it for a scene that took so long to read.
    pub(super) fn run_realtime(&self, scene: &Scene, loaded: Duration) -> Result<()> {
        self.check_realtime(scene)?;
        check_outputs([&self.output])?;
        let started = Instant::now();
        let options = self.options(scene)?;
        let camera = scene.look_through(options.camera.as_deref(), options.size, options.crop)?;
        let integrator = options.integrator.unwrap_or_else(|| scene.integrator.clone());
        if integrator.clamp.is_some() {
            tracing::warn!("the clamp that the scene asks for is left out: the real-time renderer has none");
        }
        let bounces = match integrator.kind {
            IntegratorKind::Direct => 1,
            // A path of n edges meets n − 1 surfaces.
            _ => integrator.max_depth.map_or(u32::MAX, |edges| edges.saturating_sub(1)),
        };
        // Not even what shines is seen by a path without edges.
        let no_edges = integrator.kind == IntegratorKind::Path && integrator.max_depth == Some(0);
        let dark = no_edges.then(|| without_light(scene));
        let gpu = Gpu::open()?;
        let film = &camera.film;
        let size = film.crop.map_or([film.width, film.height], |[_, _, w, h]| [w, h]);
        let rows = Rows::new(dark.as_ref().unwrap_or(scene))?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let mut stage = Stage::new(
            &gpu.device,
            &gpu.queue,
            &rows,
            &Options {
                size,
                filter: film.filter,
                aovs: options.aovs,
                trace_camera: false,
                threads: options.threads.unwrap_or(cores),
                bounces: Some(bounces),
                hide_emitters: integrator.hide_emitters,
                seed: self.seed,
            },
        )?;
        drop(rows);
        if stage.has_head_light() {
            tracing::warn!(
                "the scene has no light: it is lit from the eye, where the reference renderer sees nothing"
            );
        }
        let prepared = started.elapsed();

        let interrupt = Interrupt::listen()?;
        let bar = progress::bar_of_parts(self.json);
        let frames =
            if self.time.is_some() { u32::MAX } else { self.spp.unwrap_or(camera.samples_per_pixel).max(1) };
        let begun = Instant::now();
        let mut done = 0;
        while done < frames && !interrupt.came() {
            done = stage.frame(&camera)?;
            stage.wait()?;
            let elapsed = begun.elapsed();
            let part = match self.time {
                Some(limit) => elapsed.as_secs_f64() / limit.as_secs_f64().max(1e-9),
                None => f64::from(done) / f64::from(frames),
            };
            bar.set_position((part * 1000.0) as u64);
            if part >= 1.0 {
                break;
            }
        }
        bar.finish_and_clear();
        let seconds = begun.elapsed().as_secs_f64();
        let write = image::WriteOptions {
            metadata: vec![
                ("yugen:version".into(), env!("CARGO_PKG_VERSION").into()),
                ("yugen:scene".into(), self.scene.display().to_string()),
                ("yugen:renderer".into(), format!("realtime on {}", gpu.name)),
                ("yugen:samples".into(), done.to_string()),
            ],
            ..self.display.of(&self.output, scene.working_space)?
        };
        image::write(&self.output, &for_format(stage.image()?, &self.output), &write)?;
        let [w, h] = size;
        if self.json {
            let passes = stage.timings().iter().map(|t| (t.pass.to_string(), t.milliseconds.into()));
            json::print(json!({
                "output": self.output.display().to_string(),
                "finished": !interrupt.came(),
                "renderer": "realtime",
                "adapter": gpu.name,
                "width": w,
                "height": h,
                "samples_per_pixel": done,
                "render_seconds": seconds,
                "load_seconds": loaded.as_secs_f64(),
                "prepare_seconds": prepared.as_secs_f64(),
                "milliseconds": passes.collect::<serde_json::Map<_, _>>(),
            }));
        } else {
            println!(
                "{}: {w}x{h}, {done} frames of one sample a pixel in {seconds:.1} s on {}",
                self.output.display(),
                gpu.name
            );
        }
        if interrupt.came() {
            std::process::exit(interrupt::STATUS);
        }
        Ok(())
    }
}

fn without_light(scene: &Scene) -> Scene {
    let mut dark = scene.clone();
    dark.lights.clear();
    dark.light_names.clear();
    dark.shapes.iter_mut().for_each(|shape| shape.emission = None);
    dark
}
