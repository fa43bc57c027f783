//! `yugen motion`: what was captured of a performer.

mod convert;
mod dance;
mod info;
mod preview;
mod solve;

use anyhow::Result;
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};
use yugen_archive::formats::lp::Axes;
use yugen_archive::formats::motion::{Angles, Loaded, Options, load, unit, up};

/// Reads, converts, shows and solves motion capture, and dances: BVH, C3D, TRC, Acclaim, glTF, tables of OptiTrack, Vicon and Qualisys.
// What a verb is for stands at its arguments.
#[derive(Subcommand)]
pub enum Motion {
    Info(info::Info),
    Convert(convert::Convert),
    Preview(preview::Preview),
    Solve(solve::Solve),
    Dance(dance::Dance),
}

impl Motion {
    /// Does it.
    pub fn run(self) -> Result<()> {
        match self {
            Self::Info(v) => v.run(),
            Self::Convert(v) => v.run(),
            Self::Preview(v) => v.run(),
            Self::Solve(v) => v.run(),
            Self::Dance(v) => v.run(),
        }
    }
}

/// What a file does not say, or says wrongly.
#[derive(Args)]
pub struct Reading {
    /// Unit of length of the file: m, cm, mm, in or ft, or a number of metres.
    #[arg(long, value_name = "UNIT", value_parser = length)]
    unit: Option<f64>,

    /// Which axis of the file is up, in right-handed axes.
    #[arg(long, value_parser = ["x", "y", "z"], value_name = "AXIS")]
    up: Option<String>,

    /// All axes of the file: what its x, y and z are in a world with x to the right, y up and z to the front. `x -z y`
    /// is the same as --up z; one minus more or less, as in `-x y z`, is left-handed.
    #[arg(long, value_name = "AXES", conflicts_with = "up", value_parser = axes)]
    axes: Option<Axes>,

    /// Frames a second.
    #[arg(long, value_name = "F", value_parser = rate)]
    rate: Option<f64>,

    /// What three angles of a rigid body are, where the file does not say it: an axis with its angle, or turns one after
    /// the other.
    #[arg(long, value_name = "KIND", value_parser = Angles::ALL.map(|(name, _)| name))]
    angles: Option<String>,

    /// The skeleton (.asf) of an .amc; the one beside it where absent.
    #[arg(long, value_name = "FILE")]
    skeleton: Option<PathBuf>,

    /// Which animation of a file that has several; the first where absent.
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
}

impl Reading {
    /// Reads a file; what nobody says is guessed if so wished, else asked for.
    fn load(&self, file: &Path, guess: bool) -> Result<Loaded> {
        let up = self.up.as_deref().and_then(|u| u.chars().next()).and_then(up);
        let options = Options {
            unit: self.unit,
            axes: self.axes.or(up),
            rate: self.rate,
            angles: self.angles.as_deref().and_then(Angles::from_name),
            skeleton: self.skeleton.clone(),
            animation: self.animation.clone(),
            guess,
        };
        let loaded = load(file, &options)?;
        for doubt in &loaded.doubts {
            tracing::warn!("{}: {doubt}", file.display());
        }
        Ok(loaded)
    }
}

fn length(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
    unit(text).or(number).ok_or_else(|| "expected m, cm, mm, in or ft, or metres as in 0.0254".into())
}

fn axes(text: &str) -> Result<Axes, String> {
    text.parse()
}

fn rate(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
    number.ok_or_else(|| "expected frames a second, as in 120".into())
}
