//! `yugen simulate`: cloth of a scene in motion, and garments on figures.

mod checkpoint;
mod dressed;
#[cfg(feature = "view")]
mod live;
mod on_gpu;
mod options;
mod output;
mod scene_cloth;
mod subject;

use crate::render::checkpoint::{Pace, command_to_go_on};
use crate::render::interrupt::{self, Interrupt};
use crate::{argument, json, progress};
use anyhow::{Result, bail};
use checkpoint::{Checkpoint, Progress};
use clap::Args;
#[cfg(feature = "view")]
pub use live::LiveCloth;
pub use options::ClothOptions;
use output::Output;
use serde_json::json;
use std::path::PathBuf;
use subject::Subject;
pub use subject::Task;
use yugen_archive::formats::{self, mesh};
use yugen_archive::{check_outputs, check_writable};
use yugen_motion::cloth::{Along, Spring};

/// Lets cloth of a scene fall, hang and lie, or puts a garment on a figure that moves, and writes where it goes.
///
/// `yugen simulate scene.toml --cloth robe -o robe.abc` takes every mesh and rectangle whose name begins with `robe` for cloth and all
/// other meshes and spheres for bodies. (u, v) of the cloth are its pattern: threads run along them. What an animation of the scene moves
/// as it is moves here too.
///
/// `yugen simulate dance.bvh --garment "kosode length=1.45" --fabric karaori -o robe.abc` cuts a garment, sews it, puts it on the figure
/// of a file with a skeleton that moves (.bvh, .glb, a scene) and lets the figure move in it.
///
/// Out: .abc (Alembic: mesh and movement), .pc2 (a point cache; of a garment its mesh comes as .obj beside it) or numbered meshes,
/// `-o robe_%04d.obj`, all in the world's coordinates. Ctrl-C leaves a checkpoint
/// (of a garment once it is put on), from which `--resume` goes on to the same bits.
#[derive(Args)]
pub struct Simulate {
    /// The scene, or a mesh.
    scene: PathBuf,

    /// Where to: .abc, .pc2, or .obj with %04d where the number of the frame is.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    options: ClothOptions,

    /// Frames [default: 120; of a garment as many as the animation has].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: Option<u32>,

    /// Which way is up of a mesh file.
    #[arg(long, value_name = "AXIS", value_parser = ["y", "z"])]
    up: Option<String>,

    /// Go on from the checkpoint beside the output, to the bits that it would have given at once.
    #[arg(long)]
    resume: bool,

    /// Start anew although a simulation that has not ended has left its checkpoint beside the output: it is thrown away.
    #[arg(long, conflicts_with = "resume")]
    restart: bool,

    /// Seconds between checkpoints; 0 writes none.
    #[arg(long, default_value_t = 30.0, value_name = "S", value_parser = crate::render::seconds)]
    checkpoint: f64,

    #[command(flatten)]
    reading: argument::Reading,

    /// A report as JSON.
    #[arg(long)]
    json: bool,
}

/// Frames after which pairs of contact are found anew whatever is known of them, so that a simulation may go on from there.
const AFRESH: u32 = 30;

/// Stretch of threads and crossings, of the last frame that was measured and the most of all.
#[derive(Default)]
struct Worst {
    last: (f32, usize),
    most: (f32, usize),
}

impl Worst {
    fn measure(&mut self, subject: &dyn Subject) {
        let solver = subject.solver();
        let longer = |s: &Spring| s.along != Along::Bias && subject.counts(s);
        let stretch = solver.cloth().elongation(solver.positions(), longer);
        let crossings = solver.cloth().crossings(solver.positions()).len();
        self.last = (stretch, crossings);
        self.most = (self.most.0.max(stretch), self.most.1.max(crossings));
    }
}

impl Simulate {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let task = Task {
            options: self.options.clone(),
            file: self.scene.clone(),
            frames: self.frames,
            quiet: self.json,
        };
        let output = Output::of(&self.output, task.options.garment.is_some())?;
        for file in output.files(1) {
            check_writable(&file)?;
        }
        let mut options = self.reading.options();
        options.up = self.up.as_deref().map(|up| if up == "z" { mesh::Up::Z } else { mesh::Up::Y });
        let scene = formats::load_scene(&self.scene, &options)?;
        let checkpoint = Checkpoint::beside(&self.output, &self, &scene)?;
        let begun = if self.resume { checkpoint.resume(self.json)? } else { None };
        let mut done = begun.unwrap_or_default();
        let memory = (done.frames > 0).then_some(&done.memory[..]);
        let interrupt = Interrupt::listen()?;
        let mut subject = task.begin(scene, memory, &interrupt)?;
        let frames = self.frames.unwrap_or(subject.frames());
        if done.frames > frames {
            bail!(
                "{} has {} frames already, and {frames} are asked for: ask for more, or --restart",
                checkpoint.path().display(),
                done.frames
            );
        }
        let vertices = subject.surface().uvs.len();
        let whole =
            done.samples.len() == done.frames as usize && done.samples.iter().all(|s| s.len() == vertices);
        if !matches!(output, Output::Meshes(_)) && !whole {
            bail!("{} lacks frames; --restart begins anew", checkpoint.path().display());
        }
        let files = output.files(frames);
        check_outputs(files.iter().map(PathBuf::as_path).chain([checkpoint.path()]))?;
        if let (Output::Meshes(numbered), Some(last)) = (&output, done.frames.checked_sub(1))
            && let Some(lost) = (0..=last).map(|f| numbered.frame(f)).find(|f| !f.exists())
        {
            bail!("{} was written before and is gone; --restart writes all of them again", lost.display());
        }
        let begin = done.frames;
        let mut samples = std::mem::take(&mut done.samples);
        let bar = progress::bar(frames.into(), self.json);
        bar.set_position(begin.into());
        let mut save = Pace::new(self.checkpoint);
        let mut worst = Worst::default();
        let start = std::time::Instant::now();
        for frame in begin..frames {
            if frame > 0 {
                subject.step(frame)?;
            }
            let points = subject.points();
            output.frame(frame, subject.surface(), points, &mut samples)?;
            if frame % AFRESH == 0 || frame + 1 == frames {
                worst.measure(&*subject);
            }
            if frame % AFRESH == 0 {
                subject.search_anew();
                done = Progress { frames: frame + 1, memory: subject.memory(), samples: Vec::new() };
            }
            let stop = interrupt.came();
            let keep = || {
                let all = Progress {
                    samples: samples.iter().take(done.frames as usize).cloned().collect(),
                    ..done.clone()
                };
                checkpoint.write(&all)
            };
            if stop {
                bar.finish_and_clear();
                if keep()? {
                    let words = command_to_go_on(std::env::args());
                    eprintln!(
                        "interrupted; this goes on from frame {}, to the same result:\n{words}",
                        done.frames
                    );
                }
                std::process::exit(interrupt::STATUS);
            }
            if self.checkpoint > 0.0
                && let Some(Err(e)) = save.keep(keep)
            {
                tracing::warn!("a checkpoint is not written: {e}");
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        let seconds = start.elapsed().as_secs_f64();
        output.finish(subject.surface(), samples, self.options.fps)?;
        checkpoint.remove()?;
        self.tell(&*subject, &worst, frames, seconds * 1e3 / f64::from((frames - begin).max(1)));
        Ok(())
    }

    /// What was done.
    fn tell(&self, subject: &dyn Subject, worst: &Worst, frames: u32, ms: f64) {
        let solver = subject.solver();
        let Worst { last: (stretch, crossings), most } = *worst;
        if self.json {
            let mut report = json!({
                "output": self.output, "frames": frames, "vertices": solver.positions().len(),
                "substeps": solver.substeps(), "stretch": stretch, "crossings": crossings, "ms_per_frame": ms,
                "most": { "stretch": most.0, "crossings": most.1 },
            });
            if let (Some(report), serde_json::Value::Object(more)) =
                (report.as_object_mut(), subject.report())
            {
                report.extend(more);
            }
            json::print(report);
        } else {
            println!(
                "{}: {frames} frames of {} vertices, {ms:.0} ms each; in the last, threads are stretched by {:.1} % (99.9 of 100 by less) and \
                 {crossings} edges pass through triangles; in every {AFRESH}th, at the most, {:.1} % and {}",
                self.output.display(),
                solver.positions().len(),
                stretch * 100.0,
                most.0 * 100.0,
                most.1
            );
        }
    }
}
