//! `yugen simulate`: cloth of a scene in motion, and garments on figures.

mod checkpoint;
mod dressed;
mod output;
mod scene_cloth;
mod subject;

use crate::render::checkpoint::{Pace, command_to_go_on};
use crate::render::interrupt::{self, Interrupt};
use crate::render::rate;
use crate::{argument, json, progress};
use anyhow::{Context, Result, bail};
use checkpoint::{Checkpoint, Progress};
use clap::Args;
use dressed::Dressed;
use output::Output;
use scene_cloth::SceneCloth;
use serde_json::json;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use subject::Subject;
use yugen_archive::formats::{self, mesh};
use yugen_archive::{check_outputs, check_writable};
use yugen_motion::cloth::{Along, Fabric, PRESETS, Spring};
use yugen_optics::{Fingerprint, Vec2, Vec3};
use yugen_scene::{Scene, suggest};

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

    /// Shapes of which the name begins so are cloth [default: all that a mesh file holds].
    #[arg(long, value_name = "NAME")]
    cloth: Option<String>,

    /// Garments for the figure that has the most joints, the innermost first: of each a cut, measures that differ from its own and its
    /// fabric if it is another one, as in "okuchi hemp choken length=1.1", or a file with these words. Measures that are not given fit
    /// the figure.
    #[arg(long, value_name = "CUT", conflicts_with_all = ["cloth", "pattern", "pin", "no_contact"])]
    garment: Option<String>,

    /// Edges of the garment's triangles, mm; half as long takes some eight times as long [default: 25].
    #[arg(long, value_name = "MM", value_parser = argument::edge, requires = "garment")]
    edge: Option<f32>,

    /// Which joint of the figure is what, where its name does not tell, as in left_upper_arm=Bone7: the joint at which that part begins;
    /// may be repeated.
    #[arg(long = "joint", value_name = "PART=JOINT", value_parser = joint, requires = "garment")]
    joint: Vec<(String, String)>,

    /// So many times as thick as its mesh, or as a player of Noh where it has none, the figure is under the garment.
    #[arg(long, value_name = "F", value_parser = girth, requires = "garment")]
    girth: Option<f32>,

    /// What it is made of.
    #[arg(long, default_value = Fabric::DEFAULT, value_parser = PRESETS.iter().map(|p| p.name).collect::<Vec<_>>(), value_name = "FABRIC")]
    fabric: String,

    /// Another number of the fabric, as in areal_mass=0.2; may be repeated.
    #[arg(long = "set", value_name = "QUANTITY=VALUE")]
    set: Vec<String>,

    /// Metres for a unit of u and of v [default: those that fit the mesh best].
    #[arg(long, value_name = "U,V", value_parser = scale)]
    pattern: Option<Vec2>,

    /// Vertices within R metres of X,Y,Z are attached, and go where the scene takes them; may be repeated.
    #[arg(long, value_name = "X,Y,Z,R", value_parser = pin, allow_hyphen_values = true)]
    pin: Vec<[f32; 4]>,

    /// A ground at this height, m [default: none; of a garment that on which the figure stands in the first frame].
    #[arg(long, value_name = "Y", allow_hyphen_values = true)]
    ground: Option<f32>,

    /// Velocity of the air, m/s.
    #[arg(long, value_name = "X,Y,Z", value_parser = velocity, allow_hyphen_values = true)]
    wind: Option<Vec3>,

    /// Frames [default: 120; of a garment as many as the animation has].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: Option<u32>,

    /// Frames a second.
    #[arg(long, default_value = "60", value_name = "F", value_parser = rate)]
    fps: f64,

    /// The scene's animation to play [default: the first].
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,

    /// Substeps of a frame, at the least [default: 20; of a garment 64].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    substeps: Option<u32>,

    /// Cloth does not touch cloth: faster, where it does not fold.
    #[arg(long)]
    no_contact: bool,

    /// Threads [default: as many as there are cores]; the result does not depend on them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,

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

fn scale(text: &str) -> Result<Vec2, String> {
    let both = argument::numbers::<2>(text).or_else(|| text.parse().ok().map(|v| [v; 2]));
    let both = both.filter(|v| v.iter().all(|v| *v > 0.0 && v.is_finite())).map(Vec2::from_array);
    both.ok_or_else(|| "expected metres for a unit of u and of v, as in 0.38,3.5".into())
}

fn pin(text: &str) -> Result<[f32; 4], String> {
    let good = argument::numbers::<4>(text).filter(|p| p[3] > 0.0);
    good.ok_or_else(|| "expected a place and a radius above zero, as in 0,1.5,0,0.05".into())
}

fn velocity(text: &str) -> Result<Vec3, String> {
    let good = argument::numbers::<3>(text).map(Vec3::from_array).filter(|v| v.length() <= 100.0);
    good.ok_or_else(|| "expected a velocity of at most 100 m/s, as in 0,0,-3".into())
}

fn joint(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('=').filter(|(part, joint)| !part.is_empty() && !joint.is_empty());
    let pair = pair.map(|(part, joint)| (part.to_string(), joint.to_string()));
    pair.ok_or_else(|| "expected PART=JOINT, as in left_upper_arm=Bone7".into())
}

/// What `--girth` takes.
const GIRTH: RangeInclusive<f32> = 0.2..=3.0;

fn girth(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|v: &f32| GIRTH.contains(v));
    number.ok_or_else(|| format!("expected a number from {} to {}, as in 1.1", GIRTH.start(), GIRTH.end()))
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
        let fabric = self.fabric()?;
        let output = Output::of(&self.output, self.garment.is_some())?;
        for file in output.files(1) {
            check_writable(&file)?;
        }
        let mut options = self.reading.options();
        options.up = self.up.as_deref().map(|up| if up == "z" { mesh::Up::Z } else { mesh::Up::Y });
        let mut scene = formats::load_scene(&self.scene, &options)?;
        let checkpoint = Checkpoint::beside(&self.output, &self, &scene)?;
        let begun = if self.resume { checkpoint.resume(self.json)? } else { None };
        let mut done = begun.unwrap_or_default();
        let memory = (done.frames > 0).then_some(&done.memory[..]);
        let interrupt = Interrupt::listen()?;
        let mut subject: Box<dyn Subject + '_> = match &self.garment {
            Some(text) => Box::new(Dressed::new(&self, text, &scene, &fabric, memory, &interrupt)?),
            None => {
                self.pose(&mut scene, 0.0)?;
                Box::new(SceneCloth::new(&self, scene, &fabric, memory)?)
            }
        };
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
        output.finish(subject.surface(), samples, self.fps)?;
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

    /// Takes in every option on which the result depends.
    fn fingerprint(&self, print: &mut Fingerprint) {
        print.debug(&(
            &self.cloth,
            &self.garment,
            self.edge,
            &self.joint,
            self.girth,
            &self.fabric,
            &self.set,
        ));
        print.debug(&(
            self.pattern,
            &self.pin,
            self.ground,
            self.wind,
            self.fps,
            &self.animation,
            self.substeps,
        ));
        print.debug(&(self.no_contact, &self.up));
        let words = self.garment.as_deref().map(argument::garment_words);
        print.debug(&words.and_then(Result::ok));
    }

    fn fabric(&self) -> Result<Fabric> {
        let preset = Fabric::preset(&self.fabric).context("a fabric of the list was expected")?;
        let mut fabric = preset.fabric;
        for text in &self.set {
            let pair =
                text.split_once('=').and_then(|(k, v)| Some((k.trim(), v.trim().parse::<f32>().ok()?)));
            let Some((name, value)) = pair else {
                bail!("--set {text}: expected QUANTITY=VALUE with a number, as in areal_mass=0.2");
            };
            let Some(quantity) = yugen_motion::cloth::QUANTITIES.iter().find(|q| q.name == name) else {
                let known = yugen_motion::cloth::QUANTITIES.iter().map(|q| q.name);
                bail!("a fabric has no quantity '{name}'{}", suggest(name, known));
            };
            *(quantity.place)(&mut fabric) = value;
        }
        fabric.check()?;
        Ok(fabric)
    }

    fn pose(&self, scene: &mut Scene, seconds: f64) -> Result<()> {
        if !scene.figures.is_empty() || !scene.caches.is_empty() {
            scene.pose(self.animation.as_deref(), seconds as f32)?;
        } else if let Some(name) = &self.animation {
            bail!("there is no animation called '{name}': nothing in {} moves", self.scene.display());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_command_line_are_read_or_told() {
        assert_eq!(scale("0.5"), Ok(Vec2::splat(0.5)));
        assert_eq!(scale("0.38,3.5"), Ok(Vec2::new(0.38, 3.5)));
        assert!(scale("0,1").is_err() && scale("x").is_err());
        assert_eq!(pin("0,1.5,0,0.05"), Ok([0.0, 1.5, 0.0, 0.05]));
        assert!(pin("0,1.5,0,0").is_err() && velocity("1,2").is_err() && velocity("1e9,0,0").is_err());
    }
}
