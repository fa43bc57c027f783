//! A scene that moves, or a camera that goes round it, as numbered pictures or as a film: what the verbs that make pictures
//! of scenes share.

use crate::numbered::Numbered;
use crate::render::interrupt::{self, Interrupt};
use crate::render::{frames, rate, seconds};
use crate::{json, progress};
use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use indicatif::HumanDuration;
use serde_json::json;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::check_outputs;
use yugen_archive::formats::film::{self, Timing};
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_optics::{Image, Mat4, Vec3};
use yugen_scene::Scene;

/// Frames a second where nobody says: that of films.
pub const RATE: f64 = 24.0;

/// Most frames: a day of film.
const MOST: u32 = 24 * 3600 * 24;

/// Which moments of a scene are shown.
#[derive(Args, Clone, Debug, Default)]
pub struct Moments {
    /// The pose of a scene that moves this many seconds into its animation; as the file stands where absent.
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub at: Option<f64>,

    /// Which animation, by its name; the first where absent.
    #[arg(long, value_name = "NAME")]
    pub animation: Option<String>,

    /// Makes these frames, of which number N stands N / fps seconds into the animation; all of it where absent and the
    /// output is a film or has a %d in its name.
    #[arg(long, value_name = "A-B", value_parser = frames)]
    pub frames: Option<[u32; 2]>,

    /// Frames a second [default: 24].
    #[arg(long, value_name = "F", value_parser = rate)]
    pub fps: Option<f64>,

    /// The animation begins again when it has ended, as a walk does.
    #[arg(long)]
    pub cycle: bool,

    /// With every frame the camera goes on by this angle, degrees, about the upright line through the middle of the scene; to
    /// the right where it is above zero. Of a scene that does not move, frames are those of a whole turn where --frames does
    /// not name them.
    #[arg(long, value_name = "DEGREES", value_parser = degrees)]
    pub turn: Option<f64>,
}

/// An angle by which something turns.
fn degrees(text: &str) -> Result<f64, String> {
    let ok = |v: &f64| (0.001..=180.0).contains(&v.abs());
    text.parse()
        .ok()
        .filter(ok)
        .ok_or_else(|| "expected degrees, 0.001 to 180 or the same below zero, as in 0.5".into())
}

/// Draws one picture after another.
pub trait Frames {
    /// Draws a frame of the scene as it stands; `tell` is told which part is done. `false`: it was stopped.
    fn paint(&mut self, scene: &Scene, stop: &dyn Fn() -> bool, tell: &dyn Fn(f64)) -> Result<bool>;

    /// Takes note of a frame whose picture is there already.
    fn pass_by(&mut self, _: &Scene) -> Result<()> {
        Ok(())
    }

    /// Whether a frame depends on those before it, so that it must take note of all.
    fn remembers(&self) -> bool {
        false
    }

    /// All frames are done: what is to be said of them.
    fn end(&self) {}

    /// The frame that was painted last, for a film.
    fn picture(&self) -> Result<Image>;

    /// The same to a file.
    fn write(&self, path: &Path, frame: u32) -> Result<()>;
}

/// A sequence that somebody has asked for.
pub struct Sequence<'a> {
    /// Of messages.
    pub scene: &'a Path,
    /// Where to: names with the number of the frame in them, of which one may be a film's, without.
    pub outputs: &'a [PathBuf],
    /// Which frames.
    pub moments: &'a Moments,
    /// Leave the pictures that are there already.
    pub resume: bool,
    /// How a film is written.
    pub film: WriteOptions,
    /// The renderer's name, for the report.
    pub by: &'a str,
    /// Report as JSON.
    pub json: bool,
    /// Frames are of one moment, so many of them where --frames does not say which.
    pub still: Option<u32>,
}

impl Moments {
    /// Whether more than one picture is asked for.
    pub fn is_sequence(&self, outputs: &[PathBuf]) -> bool {
        let of_many = |output: &PathBuf| film::is_film(output) || Numbered::of(output).is_some();
        self.frames.is_some() || outputs.iter().any(of_many)
    }

    /// Refuses what is said of sequences and cannot be, before the scene is read. `of_one`: options that are for one picture,
    /// and whether they were given. `can_write` says of the name of a picture whether it can be written.
    pub fn check(
        &self,
        outputs: &[PathBuf],
        resume: bool,
        of_one: &[(&str, bool)],
        can_write: &dyn Fn(&Path) -> Result<()>,
    ) -> Result<()> {
        if !self.is_sequence(outputs) {
            let of_many =
                [("--fps", self.fps.is_some()), ("--cycle", self.cycle), ("--turn", self.turn.is_some())];
            if let Some((option, _)) = of_many.iter().find(|o| o.1) {
                bail!("{option} is for a sequence: give --frames, or a film (.mp4, .apng) as --output");
            }
            if self.animation.is_some() && self.at.is_none() {
                bail!("--animation says which movement, and --at or --frames at what time: give one of them");
            }
            return outputs.iter().try_for_each(|o| can_write(o));
        }
        let at = ("--at", self.at.is_some());
        if let Some((option, _)) = std::iter::once(&at).chain(of_one).find(|o| o.1) {
            bail!("{option} is for one picture, not for a sequence; leave it out");
        }
        let mut films = 0;
        for output in outputs {
            if film::is_film(output) {
                if resume {
                    bail!(
                        "a film cannot be gone on with; render to numbered pictures, which can, as in -o frame_%04d.png, \
                         and join them by 'yugen film'"
                    );
                }
                films += 1;
                film::can_write(output)?;
            } else if Numbered::of(output).is_none() {
                let extension = output.extension().map_or("png".into(), |e| e.display().to_string());
                let stem = output.file_stem().unwrap_or_default().display();
                bail!(
                    "a sequence needs the number of the frame in the name of its pictures, as in {stem}_%04d.{extension}; \
                     or name a film (.mp4, .apng)"
                );
            } else {
                can_write(output)?;
            }
        }
        if films > 1 {
            bail!("one film at a time: join numbered pictures by 'yugen film' for the other");
        }
        Ok(())
    }

    /// As [`image::can_write`], for where a name may be that of a film, too, or end as `besides` say.
    pub fn can_write_picture(output: &Path, besides: &[&str]) -> Result<()> {
        let known = image::is_picture(output);
        image::can_write(output).map_err(|e| match known {
            true => e.into(),
            false => anyhow!("{e}, .{}", [besides, &["mp4", "apng"]].concat().join(", .")),
        })
    }

    /// The scene at the moment that one picture is of. `file`: of messages.
    pub fn pose_at(&self, scene: &mut Scene, file: &Path) -> Result<()> {
        match self.at {
            Some(seconds) => scene
                .pose(self.animation.as_deref(), seconds as f32)
                .with_context(|| file.display().to_string()),
            None => Ok(()),
        }
    }

    /// Which frames, and how many a second.
    fn timing(&self, scene: &Scene) -> Result<(RangeInclusive<u32>, f64)> {
        let rate = self.fps.unwrap_or(RATE);
        if let Some([first, last]) = self.frames {
            return Ok((first..=last, rate));
        }
        if let (Some(turn), false) = (self.turn, scene.moves()) {
            // The last frame is the one before the first comes again.
            return Ok((0..=(360.0 / turn.abs() - 1e-6).ceil() as u32 - 1, rate));
        }
        // All of the animation.
        let span = scene.clip_span(self.animation.as_deref()).unwrap_or_default();
        let [first, last] = span.map(|s| f64::from(s.max(0.0)) * rate);
        // A key that lies on a frame is one, however it was rounded.
        // Its last stands where the first does where it begins again.
        let after = if self.cycle { -1e-4 } else { 1e-4 };
        let (first, last) = ((first - 1e-4).ceil(), (last + after).floor());
        if last - first >= f64::from(MOST) {
            bail!("the animation has {} frames; say which by --frames", last - first + 1.0);
        }
        Ok((first as u32..=last.max(first) as u32, rate))
    }
}

/// Cameras that go round a scene.
struct Turntable {
    /// Where cameras stand before they are turned.
    cameras: Vec<Mat4>,
    middle: Vec3,
    /// Radians a frame.
    step: f64,
}

impl Turntable {
    fn new(scene: &Scene, turn: f64) -> Self {
        let [low, high] = scene.bounds().unwrap_or_default();
        Self {
            cameras: scene.cameras.iter().map(|c| c.to_world).collect(),
            middle: 0.5 * (low + high),
            step: turn.to_radians(),
        }
    }

    /// Puts cameras back to where they stood: those that are no part of what moves.
    fn turn_back(&self, scene: &mut Scene) {
        scene.cameras.iter_mut().zip(&self.cameras).for_each(|(c, m)| c.to_world = *m);
    }

    fn turn(&self, scene: &mut Scene, frame: u32) {
        let angle = (f64::from(frame) * self.step).rem_euclid(std::f64::consts::TAU) as f32;
        for camera in &mut scene.cameras {
            // Upright is the axis of the world, of either sign, that is nearest to the camera's own up.
            let own = camera.to_world.y_axis.truncate();
            let axes = [Vec3::Y, Vec3::Z, Vec3::X].into_iter().flat_map(|a| [a, -a]);
            let up = axes.max_by(|a, b| a.dot(own).total_cmp(&b.dot(own))).unwrap_or(Vec3::Y);
            let about = Mat4::from_translation(self.middle) * Mat4::from_axis_angle(up, angle);
            camera.to_world = about * Mat4::from_translation(-self.middle) * camera.to_world;
        }
    }
}

impl Sequence<'_> {
    /// Moves the scene to a frame.
    fn pose(&self, scene: &mut Scene, table: Option<&Turntable>, frame: u32, rate: f64) -> Result<()> {
        let moments = self.moments;
        if self.still.is_some() {
            return Ok(());
        }
        if let Some(table) = table {
            table.turn_back(scene);
        }
        if table.is_none() || scene.moves() {
            let mut seconds = f64::from(frame) / rate;
            if moments.cycle
                && let Some([first, last]) = scene.clip_span(moments.animation.as_deref())
                && last > first
            {
                let [first, length] = [f64::from(first), f64::from(last - first)];
                seconds = first + (seconds - first).rem_euclid(length);
            }
            scene
                .pose(moments.animation.as_deref(), seconds as f32)
                .with_context(|| format!("{}: frame {frame}", self.scene.display()))?;
        }
        if let Some(table) = table {
            table.turn(scene, frame);
        }
        Ok(())
    }

    /// Makes them all. `begin` prepares for the frames of a scene in its first pose; `size` is that of its pictures.
    pub fn run<F: Frames>(
        &self,
        mut scene: Scene,
        size: impl FnOnce(&Scene) -> Result<[u32; 2]>,
        begin: impl FnOnce(&Scene) -> Result<F>,
    ) -> Result<()> {
        let (frames, rate) = match (self.still, self.moments.frames) {
            (Some(count), None) => (0..=count.max(1) - 1, self.moments.fps.unwrap_or(RATE)),
            _ => self.moments.timing(&scene)?,
        };
        let table = self.moments.turn.map(|turn| Turntable::new(&scene, turn));
        // What is wrong with the scene or the options is said before any frame.
        self.pose(&mut scene, table.as_ref(), *frames.start(), rate)?;
        let film = self.outputs.iter().find(|o| film::is_film(o));
        let numbered: Vec<Numbered> = self.outputs.iter().filter_map(|o| Numbered::of(o)).collect();
        let names = |frame: u32| numbered.iter().map(move |n| n.frame(frame));
        check_outputs(names(*frames.start()).chain(film.cloned()))?;
        if let Some(film) = film {
            film::check_size(film, size(&scene)?).context("--size says how large the pictures are")?;
        }
        let mut painter = begin(&scene)?;
        let interrupt = Interrupt::listen()?;
        let bar = progress::bar_of_parts(self.json);
        let started = Instant::now();
        let count = frames.end() - frames.start() + 1;
        let (mut made, mut kept) = (0u32, 0u32);
        let mut interrupted = None;

        let there = |frame: u32| self.resume && names(frame).all(|path| path.exists());
        // What nobody comes after need not be followed.
        let last_missing = frames.clone().rev().find(|frame| !there(*frame));
        let mut go = |add: &mut dyn FnMut(&Image) -> Result<()>| -> Result<()> {
            for frame in frames.clone() {
                if there(frame) {
                    kept += 1;
                    if painter.remembers() && last_missing.is_some_and(|last| frame < last) {
                        if interrupt.came() {
                            interrupted = Some(frame);
                            break;
                        }
                        self.pose(&mut scene, table.as_ref(), frame, rate)?;
                        painter.pass_by(&scene)?;
                    }
                    continue;
                }
                self.pose(&mut scene, table.as_ref(), frame, rate)?;
                let before = frame - frames.start();
                let tell = |part: f64| {
                    let (all, done) = (f64::from(before) + part, f64::from(made) + part);
                    bar.set_position((all / f64::from(count) * 1000.0) as u64);
                    let left = started.elapsed().mul_f64((f64::from(count) - all) / done.max(1e-9));
                    bar.set_message(match made {
                        0 => format!("frame {frame}"),
                        _ => format!("frame {frame}, {} left", HumanDuration(left)),
                    });
                };
                tell(0.0);
                if interrupt.came() || !painter.paint(&scene, &|| interrupt.came(), &tell)? {
                    interrupted = Some(frame);
                    break;
                }
                for path in names(frame) {
                    check_outputs([&path])?;
                    painter.write(&path, frame)?;
                }
                if film.is_some() {
                    add(&painter.picture()?)?;
                }
                made += 1;
            }
            Ok(())
        };
        match film {
            None => go(&mut |_| Ok(()))?,
            Some(path) => {
                let mut stopped = false;
                let written =
                    film::write(path, Timing { frames: count, rate }, &self.film, |film| -> Result<()> {
                        let mut added = 0;
                        go(&mut |picture| {
                            added += 1;
                            Ok(film.add(picture)?)
                        })?;
                        if added < count && (added == 0 || film::needs_all_frames(path)) {
                            stopped = true;
                            bail!("interrupted: {} is as it was", path.display());
                        }
                        Ok(())
                    });
                if let (Err(e), true) = (&written, stopped) {
                    bar.finish_and_clear();
                    eprintln!("{e}");
                    std::process::exit(interrupt::STATUS);
                }
                written?;
            }
        }
        bar.finish_and_clear();
        let seconds = started.elapsed().as_secs_f64();
        let output = self.outputs.iter().map(|o| o.display().to_string()).collect::<Vec<_>>().join(", ");
        if self.json {
            json::print(json!({
                "output": output,
                "finished": interrupted.is_none(),
                "renderer": self.by,
                "frames": [frames.start(), frames.end()],
                "frames_per_second": rate,
                "rendered": made,
                "found": kept,
                "render_seconds": seconds,
            }));
        } else {
            let found = if kept > 0 { format!(" ({kept} were there)") } else { String::new() };
            println!("{output}: {made} frames in {seconds:.1} s{found}");
        }
        if let Some(frame) = interrupted {
            match film {
                None if self.still.is_some() => {
                    eprintln!("interrupted in frame {frame}; it begins anew next time")
                }
                None => eprintln!("interrupted in frame {frame}; --resume goes on with it"),
                Some(_) => eprintln!("interrupted in frame {frame}; the film ends before it"),
            }
            std::process::exit(interrupt::STATUS);
        }
        painter.end();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_scene::Film;

    #[test]
    fn a_turned_camera_keeps_its_distance_and_comes_back() {
        let mut scene = Scene::default();
        scene.shapes.push(yugen_scene::Shape::new(
            "ball",
            yugen_scene::Geometry::Sphere,
            Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)),
            0,
        ));
        let film = Film { width: 64, height: 48, crop: None, filter: yugen_scene::Filter::Box };
        scene.cameras.push(scene.framing_camera(film));
        let before = scene.cameras[0].to_world;
        let table = Turntable::new(&scene, 30.0);
        let middle = Vec3::new(1.0, 2.0, 3.0);
        assert!(table.middle.distance(middle) < 1e-5);
        let eye = |scene: &Scene| scene.cameras[0].to_world.w_axis.truncate();
        let there = eye(&scene);
        table.turn(&mut scene, 3);
        let turned = eye(&scene);
        let flat = |v: Vec3| Vec3::new(v.x, 0.0, v.z);
        assert!((turned.y - there.y).abs() < 1e-4);
        assert!(flat(turned - middle).dot(flat(there - middle)).abs() < 1e-3, "a quarter turn");
        // Right of what it looks at, where +x of a camera is to the left.
        assert!((turned - there).dot(before.x_axis.truncate()) < 0.0);
        table.turn_back(&mut scene);
        table.turn(&mut scene, 12);
        assert!(scene.cameras[0].to_world.abs_diff_eq(before, 1e-5));
    }

    #[test]
    fn a_turntable_is_one_whole_turn() {
        for (turn, last) in [(0.5, 719), (-90.0, 3), (7.0, 51)] {
            let moments = Moments { turn: Some(turn), ..Moments::default() };
            assert_eq!(moments.timing(&Scene::default()).unwrap().0, 0..=last);
        }
        for bad in ["0", "x", "nan", "200"] {
            assert!(degrees(bad).is_err());
        }
    }
}
