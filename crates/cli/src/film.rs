//! `yugen film`: numbered pictures to a film.

use crate::numbered::Numbered;
use crate::render::rate;
use crate::sequence::RATE;
use crate::{argument, progress};
use anyhow::{Result, bail};
use clap::Args;
use std::path::PathBuf;
use yugen_archive::check_outputs;
use yugen_archive::formats::film::{self, Timing};
use yugen_archive::formats::image::{self, ReadOptions};
use yugen_optics::ColourSpace;

/// Joins numbered pictures to a film: .mp4 (H.264) or .apng (animated PNG).
///
/// `yugen film frame_%04d.png -o film.mp4` takes all that are there, in the order of their numbers. Pictures that hold
/// light (.exr, .hdr) are shown by --curve, --exposure and --adaptation as `yugen render` shows them.
#[derive(Args)]
pub struct Film {
    /// The pictures' name with %d, or %04d for four digits, where the number is.
    pictures: PathBuf,

    /// The film.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Frames a second [default: 24].
    #[arg(long, value_name = "F", value_parser = rate)]
    fps: Option<f64>,

    #[command(flatten)]
    display: argument::FilmDisplayOptions,
}

impl Film {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let Some(numbered) = Numbered::of(&self.pictures) else {
            bail!(
                "{} has no place for a number: name the pictures as frame_%04d.png",
                self.pictures.display()
            );
        };
        film::can_write(&self.output)?;
        let pictures = numbered.list()?;
        let (Some((first, _)), Some((last, _))) = (pictures.first_key_value(), pictures.last_key_value())
        else {
            bail!("there is no picture called {}", self.pictures.display());
        };
        let gaps = (*first..=*last).find(|n| !pictures.contains_key(n));
        if let Some(gap) = gaps {
            bail!(
                "{} is missing between frames {first} and {last}: render it (yugen render --resume does)",
                numbered.frame(gap).display()
            );
        }
        check_outputs([&self.output])?;
        let shown = pictures.values().all(|p| image::is_for_display(p));
        if shown && self.display.is_asked() {
            bail!(
                "--curve, --exposure and --adaptation are for pictures of light (.exr, .hdr); these are as a display shows them"
            );
        }
        let space = ColourSpace::LinearSrgb;
        let options = self.display.of(&self.output, space, Default::default())?;
        let bar = progress::bar(pictures.len() as u64, false);
        let timing = Timing { frames: pictures.len() as u32, rate: self.fps.unwrap_or(RATE) };
        film::write(&self.output, timing, &options, |film| -> Result<()> {
            for path in pictures.values() {
                film.add(&image::read(path, &ReadOptions::to(space))?)?;
                bar.inc(1);
            }
            Ok(())
        })?;
        bar.finish_and_clear();
        println!(
            "{}: {} frames, {:.2} s",
            self.output.display(),
            timing.frames,
            f64::from(timing.frames) / timing.rate
        );
        Ok(())
    }
}
