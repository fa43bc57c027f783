//! What several verbs read from the command line.

use anyhow::{Context, Result as Outcome, bail};
use clap::Args;
use std::path::{Path, PathBuf};
use yugen_archive::formats;
use yugen_archive::formats::film;
use yugen_archive::formats::image::{WriteOptions, is_for_display};
use yugen_archive::read_bounded;
use yugen_motion::garment::{self, Garment};
use yugen_optics::adaptation::Adaptation;
use yugen_optics::tonemap::Curve;
use yugen_optics::{ColourSpace, Vec3, parallel};

/// How a scene file is read.
#[derive(Args)]
pub struct Reading {
    /// Gives a parameter of the scene file a value, as in `-D spp=64`.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    define: Vec<(String, String)>,

    /// A folder in which files of the scene may lie, besides its own; may be repeated.
    #[arg(long, value_name = "DIR")]
    allow: Vec<PathBuf>,
}

impl Reading {
    /// For readers.
    pub fn options(&self) -> formats::Options {
        let (defines, folders) = (self.define.clone(), self.allow.clone());
        formats::Options { defines, folders, ..formats::Options::default() }
    }
}

/// A parameter and its value.
fn define(text: &str) -> Result<(String, String), String> {
    text.split_once('=')
        .map(|(n, v)| (n.to_string(), v.to_string()))
        .ok_or_else(|| "expected name=value".to_string())
}

/// How a picture for a display comes from light.
#[derive(Args)]
pub struct DisplayOptions {
    /// From scene light to display light, for .png, .jpg and films [default: what the scene says, else clip].
    #[arg(long, value_parser = Curve::ALL.map(Curve::name), value_name = "CURVE")]
    curve: Option<String>,

    /// Brighter by this many stops, for .png, .jpg and films [default: what the scene says, else 0].
    #[arg(long, value_name = "STOPS", value_parser = stops)]
    exposure: Option<f32>,
}

impl DisplayOptions {
    /// Whether either was asked for.
    pub fn is_asked(&self) -> bool {
        self.curve.is_some() || self.exposure.is_some()
    }

    /// How `output` is written, of colours in `space`, and as `own` where nothing was asked for; an error where it holds the light itself, as .exr does, and a
    /// display was asked for.
    pub fn of(&self, output: &Path, space: ColourSpace, own: yugen_scene::Display) -> Outcome<WriteOptions> {
        let asked = [("--curve", self.curve.is_some()), ("--exposure", self.exposure.is_some())];
        if let Some((option, _)) =
            asked.iter().find(|(_, given)| *given && !(is_for_display(output) || film::is_film(output)))
        {
            bail!(
                "{option} is for .png, .jpg and films; {} keeps the light as it is, so leave {option} out",
                output.display()
            );
        }
        let curve = self.curve.as_deref().and_then(Curve::from_name).unwrap_or(own.curve);
        let exposure = self.exposure.unwrap_or(own.exposure);
        Ok(WriteOptions { curve, exposure, ..WriteOptions::from(space) })
    }
}

/// The same of what may be a film.
#[derive(Args)]
pub struct FilmDisplayOptions {
    #[command(flatten)]
    each: DisplayOptions,

    /// What the exposure of a film follows: none, or the eye, which gets used to brighter and darker frames within some
    /// tenths of a second [default: what the scene says, else none].
    #[arg(long, value_parser = Adaptation::ALL.map(Adaptation::name), value_name = "NAME")]
    adaptation: Option<String>,
}

impl FilmDisplayOptions {
    /// Whether any was asked for.
    pub fn is_asked(&self) -> bool {
        self.each.is_asked() || self.adaptation.is_some()
    }

    /// As [`DisplayOptions::of`]; an error also where `output` is no film and something was to be followed.
    pub fn of(&self, output: &Path, space: ColourSpace, own: yugen_scene::Display) -> Outcome<WriteOptions> {
        if self.adaptation.is_some() && !film::is_film(output) {
            bail!(
                "--adaptation is for films (.mp4, .apng), where frames follow one another; {} is none, so leave it out",
                output.display()
            );
        }
        let asked = self.adaptation.as_deref().and_then(Adaptation::from_name);
        let adaptation = asked.unwrap_or(own.adaptation);
        Ok(WriteOptions { adaptation, ..self.each.of(output, space, own)? })
    }
}

/// Length of a garment's edges, mm.
pub fn edge(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|v: &f32| (5.0..=60.0).contains(v));
    number.ok_or_else(|| "expected millimetres from 5 to 60, as in 25".into())
}

/// What `--garment` says: its words, or those of the file that it names.
pub fn garment_words(text: &str) -> Outcome<String> {
    let path = Path::new(text);
    if !path.is_file() {
        return Ok(text.into());
    }
    String::from_utf8(read_bounded(path, 1 << 16)?).ok().context("a garment is a line of text")
}

/// The garments of `--garment`, for a wearer so many times as tall as a player of Noh.
pub fn outfit(text: &str, size: f32) -> Outcome<Vec<Garment>> {
    garment::outfit(&garment_words(text)?, size).with_context(|| format!("--garment {text}"))
}

/// So many numbers with commas between them.
pub fn numbers<const N: usize>(text: &str) -> Option<[f32; N]> {
    let all: Option<Vec<f32>> =
        text.split(',').map(|w| w.trim().parse().ok().filter(|v: &f32| v.is_finite())).collect();
    <[f32; N]>::try_from(all?).ok()
}

/// A direction, made unit.
pub fn direction(text: &str) -> Result<Vec3, String> {
    let vector = numbers(text).map(Vec3::from_array).and_then(Vec3::try_normalize);
    vector.ok_or_else(|| "expected a direction as three numbers, as in 0.5,0,0.87".into())
}

/// Two whole numbers from 1 to `most` with an x between them.
pub fn pair(text: &str, most: u32) -> Option<[u32; 2]> {
    let (a, b) = text.split_once(['x', 'X'])?;
    let number = |s: &str| s.parse().ok().filter(|n| (1..=most).contains(n));
    Some([number(a)?, number(b)?])
}

/// A number above zero.
pub fn positive(text: &str) -> Result<f32, String> {
    let ok = |v: &f32| *v > 0.0 && v.is_finite();
    text.parse().ok().filter(ok).ok_or_else(|| "expected a number above zero, as in 10".into())
}

/// Stops of exposure.
pub fn stops(text: &str) -> Result<f32, String> {
    let ok = |v: &f32| (-60.0..=60.0).contains(v);
    text.parse().ok().filter(ok).ok_or_else(|| "expected stops from -60 to 60, as in 1 or -0.5".into())
}

/// So many threads as were asked for, else one for each core.
pub fn threads(asked: Option<u16>) -> usize {
    asked.map_or_else(parallel::threads, usize::from)
}

/// Standard deviation of a lens's blur, in texels.
pub fn blur(text: &str) -> Result<f32, String> {
    let value = text.trim().parse().ok().filter(|b: &f32| (0.0..=100.0).contains(b));
    value.ok_or_else(|| "expected a number from 0 to 100".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_but_the_right_count_of_numbers_will_do() {
        assert_eq!(numbers("1, -2.5,3e1"), Some([1.0, -2.5, 30.0]));
        for bad in ["1,2", "1,2,3,4", "1,,3", "1,x,2,3", "1,nan,3", "inf,1,2", ""] {
            assert_eq!(numbers::<3>(bad), None, "{bad}");
            assert!(direction(bad).is_err());
        }
        assert!(direction("0,0,0").is_err());
        assert_eq!(direction("0,-3,4"), Ok(Vec3::new(0.0, -0.6, 0.8)));
        assert_eq!(pair("640x480", 640), Some([640, 480]));
        for bad in ["640", "0x480", "641x480", "-1x2", "1x2x3", "x"] {
            assert_eq!(pair(bad, 640), None, "{bad}");
        }
    }
}
