//! `yugen render --frames`: a scene that moves, as numbered pictures or as a film.

use super::interrupt::{self, Interrupt};
use super::realtime::Realtime;
use super::{Render, for_format};
use crate::numbered::Numbered;
use crate::{json, progress};
use anyhow::{Context, Result, bail};
use indicatif::HumanDuration;
use serde_json::json;
use std::ops::RangeInclusive;
use std::time::Instant;
use yugen_archive::check_outputs;
use yugen_archive::formats::film::{self, Timing};
use yugen_archive::formats::image;
use yugen_optics::Image;
use yugen_scene::Scene;
use yugen_transport::render::{Action, Job};

/// Frames a second where nobody says: that of films.
pub const RATE: f64 = 24.0;

/// Most frames: a day of film.
const MOST: u32 = 24 * 3600 * 24;

/// A picture and what is said of it in its header.
type Painted = (Image, Vec<(String, String)>);

/// Draws one picture after another.
enum Painter<'a> {
    Reference,
    Realtime(Box<Realtime<'a>>),
}

impl Render {
    /// Whether more than one picture is asked for.
    pub(super) fn is_sequence(&self) -> bool {
        self.frames.is_some() || film::is_film(&self.output) || Numbered::of(&self.output).is_some()
    }

    /// Refuses what is said of sequences and cannot be, before the scene is read.
    pub(super) fn check_sequence(&self) -> Result<()> {
        if !self.is_sequence() {
            if let Some((option, _)) =
                [("--fps", self.fps.is_some()), ("--cycle", self.cycle)].iter().find(|o| o.1)
            {
                bail!("{option} is for a sequence: give --frames, or a film (.mp4, .apng) as --output");
            }
            if self.animation.is_some() && self.at.is_none() {
                bail!("--animation says which movement, and --at or --frames at what time: give one of them");
            }
            return Ok(());
        }
        let of_one = [
            ("--at", self.at.is_some()),
            ("--watch", self.watch.is_some()),
            ("--keep", self.keep),
            ("--restart", self.restart),
        ];
        if let Some((option, _)) = of_one.iter().find(|o| o.1) {
            bail!("{option} is for one picture, not for a sequence; leave it out");
        }
        if film::is_film(&self.output) {
            if self.resume {
                bail!(
                    "a film cannot be gone on with; render to numbered pictures, which can, as in -o frame_%04d.png, \
                     and join them by 'yugen film'"
                );
            }
            film::can_write(&self.output)?;
        } else if Numbered::of(&self.output).is_none() {
            let extension = self.output.extension().map_or("png".into(), |e| e.display().to_string());
            let stem = self.output.file_stem().unwrap_or_default().display();
            bail!(
                "a sequence needs the number of the frame in the name of its pictures, as in {stem}_%04d.{extension}; \
                 or name a film (.mp4, .apng)"
            );
        } else {
            image::can_write(&self.output)?;
        }
        Ok(())
    }

    /// Which frames, and how many a second.
    fn timing(&self, scene: &Scene) -> Result<(RangeInclusive<u32>, f64)> {
        let rate = self.fps.unwrap_or(RATE);
        if let Some([first, last]) = self.frames {
            return Ok((first..=last, rate));
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

    /// Moves the scene to a frame.
    fn pose(&self, scene: &mut Scene, frame: u32, rate: f64) -> Result<()> {
        let mut seconds = f64::from(frame) / rate;
        if self.cycle
            && let Some([first, last]) = scene.clip_span(self.animation.as_deref())
            && last > first
        {
            let [first, length] = [f64::from(first), f64::from(last - first)];
            seconds = first + (seconds - first).rem_euclid(length);
        }
        scene
            .pose(self.animation.as_deref(), seconds as f32)
            .with_context(|| format!("{}: frame {frame}", self.scene.display()))
    }

    /// Renders them all.
    pub(super) fn run_sequence(&self, mut scene: Scene) -> Result<()> {
        let (frames, rate) = self.timing(&scene)?;
        // What is wrong with the scene or the options is said before any frame.
        self.pose(&mut scene, *frames.start(), rate)?;
        let numbered = Numbered::of(&self.output);
        let names = |frame: u32| numbered.as_ref().map_or(self.output.clone(), |n| n.frame(frame));
        check_outputs([names(*frames.start())])?;
        if film::is_film(&self.output) {
            let film = self.camera(&scene)?.film;
            let size = film.crop.map_or([film.width, film.height], |[_, _, w, h]| [w, h]);
            film::check_size(&self.output, size).context("--size says how large the pictures are")?;
        }
        let mut painter = match self.by.as_str() {
            "realtime" => Painter::Realtime(Box::new(Realtime::new(self, &scene)?)),
            _ => Painter::Reference,
        };
        let interrupt = Interrupt::listen()?;
        let bar = progress::bar_of_parts(self.json);
        let started = Instant::now();
        let count = frames.end() - frames.start() + 1;
        let (mut made, mut kept) = (0u32, 0u32);
        let options = self.display.of(&self.output, scene.working_space)?;

        // The next picture that is not there yet: its number, and nothing where somebody has interrupted it.
        let mut next = |frame: u32, made: u32| -> Result<Option<Painted>> {
            self.pose(&mut scene, frame, rate)?;
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
            self.paint(&mut painter, &scene, &|| interrupt.came(), &tell)
        };

        let mut interrupted = None;
        if film::is_film(&self.output) {
            let written =
                film::write(&self.output, Timing { frames: count, rate }, &options, |film| -> Result<()> {
                    for frame in frames.clone() {
                        match next(frame, made)? {
                            Some((picture, _)) => film.add(&picture)?,
                            None => {
                                interrupted = Some(frame);
                                break;
                            }
                        }
                        made += 1;
                    }
                    if interrupted.is_some() && (made == 0 || film::needs_all_frames(&self.output)) {
                        bail!("interrupted: {} is as it was", self.output.display());
                    }
                    Ok(())
                });
            if let (Err(e), Some(_)) = (&written, interrupted) {
                bar.finish_and_clear();
                eprintln!("{e}");
                std::process::exit(interrupt::STATUS);
            }
            written?;
        } else {
            for frame in frames.clone() {
                let path = names(frame);
                if self.resume && path.exists() {
                    kept += 1;
                    continue;
                }
                let Some((picture, metadata)) = next(frame, made)? else {
                    interrupted = Some(frame);
                    break;
                };
                check_outputs([&path])?;
                let options = image::WriteOptions { metadata, ..options.clone() };
                image::write(&path, &for_format(picture, &path), &options)?;
                made += 1;
            }
        }
        bar.finish_and_clear();
        let seconds = started.elapsed().as_secs_f64();
        if self.json {
            json::print(json!({
                "output": self.output.display().to_string(),
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
            println!("{}: {made} frames in {seconds:.1} s{found}", self.output.display());
        }
        if let Some(frame) = interrupted {
            match numbered {
                Some(_) => eprintln!("interrupted in frame {frame}; --resume goes on with it"),
                None => eprintln!("interrupted in frame {frame}; the film ends before it"),
            }
            std::process::exit(interrupt::STATUS);
        }
        Ok(())
    }

    /// A picture of the scene as it stands, and what is said of it in its header; `None` where it was stopped.
    fn paint(
        &self,
        painter: &mut Painter,
        scene: &Scene,
        stop: &dyn Fn() -> bool,
        tell: &dyn Fn(f64),
    ) -> Result<Option<Painted>> {
        match painter {
            Painter::Realtime(realtime) => {
                realtime.pose(scene)?;
                let frames = realtime.paint(stop, tell)?;
                if stop() {
                    return Ok(None);
                }
                Ok(Some((realtime.image()?, self.realtime_metadata(realtime.adapter(), frames))))
            }
            Painter::Reference => {
                let job = Job::new(scene, &self.options(scene)?)?;
                let ended = job.run(|_, p| {
                    tell(p.fraction);
                    if stop() { Action::Stop } else { Action::Continue }
                });
                Ok(ended.then(|| (job.denoised(), self.metadata(&job))))
            }
        }
    }
}
