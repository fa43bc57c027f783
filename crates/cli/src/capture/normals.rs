//! `yugen capture normals`: normal map, albedo and height of a stack of photographs.

use super::fit::{parts, sample_rows};
use super::stack::{Doubts, Source, blurred};
use crate::{argument, json, progress};
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::formats::btf::maps;
use yugen_archive::formats::image::{self, ReadOptions, WriteOptions};
use yugen_archive::{check_outputs, make_folder, will_read};
use yugen_capture::blur::{self, blur};
use yugen_capture::fit::compare::{NormalErrors, SURE, UNDECIDED, WRONG, angle, quantile};
use yugen_capture::normals::{
    FEWEST_READINGS, Found, Ground, Options, Surface, find, height::closure, height::integrate,
    lights_suffice,
};
use yugen_optics::{ColourSpace, Image, Vec3};

/// Finds the normal, the albedo and the height of each texel of a matte thing by photometric stereo.
///
///   yugen capture normals STACK -o relief
///
/// STACK is a folder of photographs from one place, one a light, with the list of lights beside them (lights.lp; see
/// docs/capture.md). Four lights will do, a dozen and more are better. Shadows, highlights and light from neighbouring
/// parts are told from the surface itself and left out. What the surface is, bare or below a clear coat as glazed and
/// varnished things are, is told from the photographs (--ground to say it). For metal, silk and whatever else has little but
/// highlights use `yugen capture fit`.
///
/// The folder then holds normal.png and normal.exr (+x right, +y up, as OpenGL has them; the PNG as (n + 1)/2 in 16
/// bits), albedo.png and .exr, height.exr in widths of a texel about their mean (height.png from the lowest, black, to
/// the highest, white), error.exr, by how many degrees each normal is expected to be off (error.png: 10° is white),
/// and confidence.png, 0 to 1. How near the camera stood is taken from stack.toml or Exif.
#[derive(Args)]
pub struct Normals {
    /// The stack: its folder or its list of lights (.lp).
    stack: PathBuf,

    /// A list of lights that lies elsewhere, as beside the balls that were photographed for themselves, instead of the
    /// stack's own.
    #[arg(long, value_name = "LP")]
    lights: Option<PathBuf>,

    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// What the surface is: matte, coated (glazed, varnished), rough (clay, sandstone), or as the photographs tell.
    #[arg(long, value_name = "NAME", default_value = "auto")]
    ground: AskedGround,

    /// Standard deviation of a reading, as a part of it.
    #[arg(long, value_name = "PART", default_value_t = Options::default().noise, value_parser = argument::positive)]
    noise: f32,

    /// Blur of the photographs: the standard deviation of their spot in texels, 0 for sharp ones, instead of what their steepest
    /// steps tell. It raises the expected error where texels with other normals are near.
    #[arg(long, value_name = "TEXELS", value_parser = argument::blur)]
    blur: Option<f32>,

    /// Leave the height out.
    #[arg(long)]
    no_height: bool,

    /// True normals, to compare with: channels X, Y, Z of an .exr, or a .png with (n + 1)/2.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,

    /// Memory for the photographs, in MiB: they are read in bands of rows. The maps take up to 100 bytes a texel besides.
    #[arg(long, value_name = "MIB", default_value_t = 1024)]
    memory: u64,

    /// Threads instead of one per core; the result is the same bits for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Print the report as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

/// The ground as it is asked for.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum AskedGround {
    Auto,
    Matte,
    Coated,
    Rough,
}

impl AskedGround {
    /// `None`: as the photographs tell.
    pub fn asked(self) -> Option<Ground> {
        match self {
            Self::Auto => None,
            Self::Matte => Some(Ground::Matte),
            Self::Coated => Some(Ground::Coated),
            Self::Rough => Some(Ground::Rough),
        }
    }
}

/// Degrees that are white in the picture of errors.
const WHITE: f32 = 10.0;
/// Below this the slopes are those of a surface in a mirror; shadows and noise take those of a real one down to .2.
const TURNED: f32 = -0.3;
/// Where in the median fewer of the readings agree than this, it is no matte thing.
const MATTE: f32 = 0.5;

impl Normals {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if self.noise >= 1.0 {
            bail!("--noise {}: expected a part between 0 and 1", self.noise);
        }
        let source = Source::open(&self.stack, self.lights.as_deref())?;
        self.truth.iter().for_each(|t| will_read(t));
        check_outputs(self.files())?;
        let folder = &source.folder;
        let lights = folder.pictures.len();
        if lights < FEWEST_READINGS {
            bail!(
                "{}: {lights} lights are too few for a normal; expected at least {FEWEST_READINGS}, better a dozen",
                self.stack.display()
            );
        }
        let toward = if folder.options.near { folder.positions() } else { folder.directions() };
        if !lights_suffice(&toward) {
            bail!(
                "{}: all lights stand in one plane with the sample, and the slope across it does not show; add one that \
                 stands aside",
                self.stack.display()
            );
        }
        let (width, height) = (folder.width, folder.height);
        let truth = self.truth.as_deref().map(|f| read_normals(f, width, height)).transpose()?;
        make_folder(&self.output)?;

        let options = Options { noise: self.noise, ..Options::default() };
        let threads = argument::threads(self.threads);
        let rows = folder.rows_within(self.memory << 20);
        let bar = progress::bar((width * height) as u64, self.json);
        let asked = self.ground.asked();
        bar.set_message("reading");
        let mut bands = source.bands(rows)?;
        let mut next = bands.next()?;
        // The same rows whatever the memory, so that the result is.
        let chosen = sample_rows(folder, lights);
        let sample = match &next {
            Some(whole) if whole.height == height => parts(whole, chosen),
            _ => source.sample(chosen)?,
        };
        let started = Instant::now();
        let surface = Surface::of(&sample, asked, &options, threads);
        let mut seconds = started.elapsed().as_secs_f64();
        let blur = self.blur.unwrap_or_else(|| blur(&sample));
        let doubts = Doubts::of(&sample, &surface, &options, threads);
        doubts.warn_of_list(folder);
        doubts.warn_of_brightness(folder);
        drop(sample);
        bar.set_message("finding normals");
        let mut found: Vec<Found> = Vec::with_capacity(width * height);
        while let Some(band) = next {
            let started = Instant::now();
            let first = found.len();
            found.extend(find(&band, &surface, &options, threads, &|n| bar.set_position((first + n) as u64)));
            seconds += started.elapsed().as_secs_f64();
            drop(band);
            next = bands.next()?;
        }
        doubt_blurred(&mut found, blur, width, height);
        bar.set_message("integrating");
        let started = Instant::now();
        let normals: Vec<Vec3> = found.iter().map(|f| f.normal).collect();
        let here = |f: &Found| usize::from(f.readings) >= FEWEST_READINGS;
        let trust: Vec<f32> = found.iter().map(|f| if here(f) { f.confidence } else { f32::NAN }).collect();
        let closed = closure(width, height, &normals, &trust);
        if closed < TURNED {
            tracing::warn!(
                "{}: these are the slopes of no surface, but would be with one axis of the lights turned round: say \
                 axes = \"-x y z\" or \"x -y z\" in stack.toml (whichever makes hills of hills)",
                self.stack.display()
            );
        }
        let heights = (!self.no_height).then(|| integrate(width, height, &normals, &trust));
        let integration = started.elapsed().as_secs_f64();
        bar.finish_and_clear();
        self.write(width, height, &found, heights.as_deref())?;

        let report = Report::of(&found, heights.as_deref(), truth.as_deref());
        let rate = (width * height) as f64 / seconds.max(1e-9);
        if self.json {
            let mut all = json!({
                "output": self.output.display().to_string(),
                "width": width,
                "height": height,
                "lights": lights,
                "camera_distance": Some(folder.camera_distance).filter(|d| d.is_finite()),
                "ground": surface.ground.name(),
                "ground_asked": asked.is_some(),
                "roughness": surface.roughness,
                "slack": surface.slack,
                "blur": blur,
                "doubts": doubts.json(folder),
                "masked": report.masked,
                "undecided": report.undecided,
                "median_agreeing": report.agreeing,
                "expected_error": { "median": report.error[0], "ninety": report.error[1] },
                "median_confidence": report.confidence,
                "closure": closed,
                "fit_seconds": seconds,
                "integration_seconds": integration,
                "texels_per_second": rate,
            });
            if let Some([low, high]) = report.heights {
                all["heights"] = json!({ "lowest": low, "highest": high, "unit": "texels" });
            }
            if let Some(t) = &report.truth {
                all["errors"] = json!({
                    "texels": t.texels,
                    "mean": t.mean,
                    "median": t.median,
                    "ninety": t.ninety,
                    "sure": t.sure,
                    "sure_mean": t.sure_mean,
                    "sure_and_wrong": t.sure_and_wrong,
                    "wrong_from_degrees": WRONG,
                });
            }
            json::print(all);
            return Ok(());
        }
        println!(
            "{}: normals of {width} x {height} texels from {lights} lights in {seconds:.2} s ({:.2} M texels/s); the surface \
             {} {}",
            self.output.display(),
            rate / 1e6,
            if asked.is_some() { "was said to be" } else { "is" },
            surface.ground.name()
        );
        println!(
            "{} masked, {} undecided (confidence below {UNDECIDED}); normals are expected to be off by {:.2}° (90 % of texels \
             by less than {:.1}°)",
            report.masked, report.undecided, report.error[0], report.error[1]
        );
        println!("{}", super::stack::camera(folder.camera_distance));
        blurred(blur).iter().for_each(|line| println!("{line}"));
        if let Some([low, high]) = report.heights {
            println!(
                "heights from {low:.1} to {high:.1} widths of a texel about their mean, in {integration:.2} s"
            );
        }
        if report.agreeing < MATTE {
            println!(
                "only {:.0} % of the readings are those of a matte surface: for metal, silk and other surfaces of \
                 highlights use `yugen capture fit`",
                100.0 * report.agreeing
            );
        }
        if let Some(t) = &report.truth {
            println!(
                "against the truth: mean {:.2}°, median {:.2}°, 90 % below {:.2}°; of the {:.1} % with a confidence above \
                 {SURE} the mean is {:.2}°, and {:.2} % are off by more than {WRONG}°",
                t.mean,
                t.median,
                t.ninety,
                100.0 * t.sure as f64 / t.texels.max(1) as f64,
                t.sure_mean,
                100.0 * t.sure_and_wrong as f64 / t.sure.max(1) as f64
            );
        }
        Ok(())
    }

    fn files(&self) -> Vec<PathBuf> {
        let height = ["height.exr", "height.png"];
        let rest = [
            "normal.png",
            "normal.exr",
            "albedo.png",
            "albedo.exr",
            "error.png",
            "error.exr",
            "confidence.png",
        ];
        let height = height.into_iter().filter(|_| !self.no_height);
        rest.into_iter().chain(height).map(|name| self.output.join(name)).collect()
    }

    fn write(&self, width: usize, height: usize, found: &[Found], heights: Option<&[f32]>) -> Result<()> {
        let place = |name: &str| self.output.join(name);
        let exr = |name: &str, channels: &[&str], data: Vec<f32>| {
            let channels = channels.iter().map(|c| c.to_string()).collect();
            let picture = Image { width, height, channels, data };
            image::write(&place(name), &picture, &WriteOptions::from(ColourSpace::LinearSrgb))
        };
        let numbers = |name: &str, values: &mut dyn Iterator<Item = Vec3>| {
            maps::save_numbers(&place(name), width, height, 16, values)
        };
        numbers("normal.png", &mut found.iter().map(|f| (f.normal + 1.0) * 0.5))?;
        exr("normal.exr", &["X", "Y", "Z"], found.iter().flat_map(|f| f.normal.to_array()).collect())?;
        let mut albedo = Image::rgb(width, height);
        albedo.data = found.iter().flat_map(|f| f.albedo.to_array()).collect();
        for (name, bits) in [("albedo.png", 16), ("albedo.exr", 32)] {
            image::write(
                &place(name),
                &albedo,
                &WriteOptions { bits: bits.min(16), ..WriteOptions::from(ColourSpace::LinearSrgb) },
            )?;
        }
        numbers("error.png", &mut found.iter().map(|f| Vec3::splat(f.error / WHITE)))?;
        exr("error.exr", &["Y"], found.iter().map(|f| f.error).collect())?;
        numbers("confidence.png", &mut found.iter().map(|f| Vec3::splat(f.confidence)))?;
        if let Some(heights) = heights {
            let [low, high] = range(heights);
            let shown = |h: &f32| Vec3::splat((h - low) / (high - low).max(1e-9));
            numbers("height.png", &mut heights.iter().map(shown))?;
            exr("height.exr", &["Y"], heights.to_vec())?;
        }
        Ok(())
    }
}

/// Expects more of an error where a blur of so many texels mixed texels with others.
fn doubt_blurred(found: &mut [Found], blur: f32, width: usize, height: usize) {
    let there = |i: usize| Some(&found[i]).filter(|f| usize::from(f.readings) >= FEWEST_READINGS);
    let turned =
        blur::turned(blur, width, height, |i| there(i).map(|f| (f.normal, f.albedo.element_sum().max(0.0))));
    for (f, degrees) in found.iter_mut().zip(turned) {
        f.error = f.error.hypot(degrees).min(90.0);
        f.confidence = f.confidence.min(blur::left(f.error));
    }
}

fn range(heights: &[f32]) -> [f32; 2] {
    let low = heights.iter().copied().fold(f32::INFINITY, f32::min);
    [low, heights.iter().copied().fold(f32::NEG_INFINITY, f32::max)]
}

/// The numbers of a run.
struct Report {
    masked: usize,
    undecided: usize,
    /// Median part of the readings that agree.
    agreeing: f32,
    /// Median and 90th percentile.
    error: [f32; 2],
    confidence: f32,
    heights: Option<[f32; 2]>,
    truth: Option<NormalErrors>,
}

impl Report {
    fn of(found: &[Found], heights: Option<&[f32]>, truth: Option<&[Vec3]>) -> Self {
        let here: Vec<&Found> = found.iter().filter(|f| usize::from(f.readings) >= FEWEST_READINGS).collect();
        let of = |value: &dyn Fn(&Found) -> f32, q: f32| {
            quantile(&mut here.iter().map(|f| value(f)).collect::<Vec<_>>(), q).unwrap_or(0.0)
        };
        Self {
            masked: found.len() - here.len(),
            undecided: here.iter().filter(|f| f.confidence < UNDECIDED).count(),
            agreeing: of(&|f| f32::from(f.agreeing) / f32::from(f.readings), 0.5),
            error: [0.5, 0.9].map(|q| of(&|f| f.error, q)),
            confidence: of(&|f| f.confidence, 0.5),
            heights: heights.map(range),
            truth: truth.and_then(|t| compared(found, t)),
        }
    }
}

fn compared(found: &[Found], truth: &[Vec3]) -> Option<NormalErrors> {
    let there = |(f, t): &(&Found, &Vec3)| usize::from(f.readings) >= FEWEST_READINGS && **t != Vec3::ZERO;
    let all = found.iter().zip(truth).filter(there).map(|(f, t)| (f.confidence, angle(f.normal, *t)));
    NormalErrors::of(&all.collect::<Vec<_>>())
}

/// Unit normals; zero where the file has none.
pub fn read_normals(file: &Path, width: usize, height: usize) -> Result<Vec<Vec3>> {
    let picture = image::read(file, &ReadOptions::raw())?;
    if (picture.width, picture.height) != (width, height) {
        bail!(
            "{}: normals of {}x{} pixels for photographs of {width}x{height}",
            file.display(),
            picture.width,
            picture.height
        );
    }
    let layers = [["X", "Y", "Z"], ["R", "G", "B"], ["normal.X", "normal.Y", "normal.Z"]];
    let Some(xyz) = layers.iter().find_map(|names| picture.select(names)) else {
        bail!(
            "{}: expected the channels X, Y, Z, or R, G, B, or normal.X, normal.Y, normal.Z",
            file.display()
        );
    };
    // Display formats hold nothing below zero.
    let signed = !image::is_for_display(file);
    let decode = |v: Vec3| if signed { v } else { 2.0 * v - 1.0 };
    let normal = |v: &[f32]| decode(Vec3::from_slice(v));
    // Black in a picture is no normal: its length would be the root of three.
    let unit = |n: Vec3| if (n.length() - 1.0).abs() < 0.2 { n.normalize() } else { Vec3::ZERO };
    Ok(xyz.data.chunks_exact(3).map(|v| unit(normal(v))).collect())
}
