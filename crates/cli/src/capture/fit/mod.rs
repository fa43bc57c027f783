//! `yugen capture fit`.

mod checkpoint;
mod page;
mod report;
mod source;

use super::normals::{AskedGround, read_normals};
use super::stack::Doubts;
use crate::argument;
use anyhow::{Context, Result, bail};
use checkpoint::Checkpoint;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use report::{Comparison, Report, Truth};
use source::{Sides, Source};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use yugen_archive::formats::btf;
use yugen_archive::formats::image::{self, ReadOptions};
use yugen_archive::formats::stack::Folder;
use yugen_archive::{check_outputs, check_writable, make_folder, will_read};
use yugen_capture::Stack;
use yugen_capture::blur::{self, blur};
use yugen_capture::fit::compare::UNDECIDED;
use yugen_capture::fit::{FEWEST_FOR_HIGHLIGHTS, Fitted, Options, Prior, Readings, fit, smooth_tangents};
use yugen_capture::normals::{self, Ground, Surface};
use yugen_optics::Vec3;
use yugen_reflectance::btf::Btf;

/// Finds what each texel of a cloth reflects: diffuse and specular colour, normal, direction and widths of the highlight.
///
/// STACK is a folder of photographs from one place, one a light, with the list of lights beside them (lights.lp, and
/// stack.toml for what the pictures do not say themselves: see docs/capture.md). The result is one OpenEXR file with the
/// channels diffuse, specular, normal, tangent, sigma and confidence, which `yugen render` takes as a material
/// (`btf = "cloth.btf"`). Confidence is 0 where the photographs cannot decide, for example because no light met the
/// highlight.
///
/// STACK may be a goniometer table instead (.csv) in which every line is a reading of one texel, with its own light and eye.
///
/// Several STACKs of the same cloth, photographed from several sides (`view` in stack.toml), are fitted together, as is
/// a folder of them that `simulate` wrote for several --view.
///
/// A texel has a highlight only where the photographs prove it: where the ground by itself, found by robust photometric
/// stereo as in `yugen capture normals`, describes them as well, it has nothing else. With 4 to 15 lights nothing more can
/// be told.
///
/// Threads repeat: what texels of one thread have in common is learned first and helps where the lights of a single texel
/// are too few (--no-prior to do without).
#[derive(Args)]
pub struct Fit {
    /// The folder of photographs, or its list of lights; one from each side. Or a table of readings, CSV with the columns
    /// x, y, theta_i, phi_i, theta_o, phi_o and factor_red, factor_green, factor_blue (or factor; or f in 1/sr).
    #[arg(required = true, value_name = "STACK")]
    stacks: Vec<PathBuf>,

    /// Of one STACK: a list of lights that lies elsewhere, as beside the balls that were photographed for themselves, instead of the
    /// stack's own.
    #[arg(long, value_name = "LP")]
    lights: Option<PathBuf>,

    /// The maps: cloth.btf, or the same as .exr.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Standard deviation of a reading as a part of it; what the camera's noise and the model's faults make together.
    #[arg(long, value_name = "PART", default_value_t = Options::default().noise)]
    noise: f32,

    /// Standard deviation of a black reading, as a reflectance.
    #[arg(long, value_name = "RHO", default_value_t = Options::default().floor)]
    floor: f32,

    /// What lies below highlights or has none: matte, coated (glazed, varnished), rough (clay, sandstone), or as the photographs
    /// tell.
    #[arg(long, value_name = "NAME", default_value = "auto")]
    ground: AskedGround,

    /// Blur of the photographs: the standard deviation of their spot in texels, 0 for sharp ones, instead of what their steepest
    /// steps tell. It lowers the confidence where texels with other normals are near.
    #[arg(long, value_name = "TEXELS", value_parser = argument::blur)]
    blur: Option<f32>,

    /// Fit every texel by itself.
    #[arg(long)]
    no_prior: bool,

    /// With --no-prior: leave tangents as each texel has them, however unsure, instead of turning those toward what
    /// neighbours have.
    #[arg(long)]
    no_smoothing: bool,

    /// Width of a texel on the cloth in millimetres, to be kept with the maps.
    #[arg(long, value_name = "MM", value_parser = argument::positive)]
    texel_mm: Option<f32>,

    /// Mebibytes that the photographs in work may take; a table is read as a whole. The maps themselves take up to 190
    /// bytes a texel besides, at the end.
    #[arg(long, value_name = "MIB", default_value_t = 1024)]
    memory: u64,

    /// Threads instead of one per core; the result is the same bits for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Go on from the checkpoint that an interrupted fit left beside the output.
    #[arg(long)]
    resume: bool,

    /// True maps of the same size, to compare with: of all there is (truth.exr of `simulate`), or a .png or .exr of normals.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,

    /// A folder for the report as a page: index.html with the maps, what texels are made of, confidence and residual, and with
    /// --truth the errors and what the confidence is worth.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,

    /// Print the report as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

/// Fewer lights than this say nothing of shadows.
const FEWEST_LIGHTS: usize = 4;
/// Rows of a band that threads are learned from.
pub(super) const SAMPLE_ROWS: usize = 8;

/// What the sample may take of memory.
const SAMPLE_BYTES: usize = 512 << 20;

/// First row and height of the bands that threads are learned from: spread over the height, and the same whatever the
/// memory, so that the result is.
pub(super) fn sample_rows(folder: &Folder, lights: usize) -> Vec<(usize, usize)> {
    let rows = SAMPLE_ROWS.min(folder.height);
    let each = folder.width * rows * lights * size_of::<[f32; 3]>();
    let count = (SAMPLE_BYTES / each.max(1)).clamp(1, 16).min(folder.height / rows);
    (0..count).map(|i| (i * (folder.height - rows) / (count - 1).max(1), rows)).collect()
}

/// How it is done.
struct Work<'a> {
    options: &'a Options,
    /// What the ground is said to be like.
    ground: Option<Ground>,
    threads: usize,
    /// Whether threads are learned.
    learns: bool,
    bar: &'a ProgressBar,
}

/// What texels have in common.
struct Learned {
    options: Options,
    surface: Surface,
    /// What threads have in common; `None` where that is not wanted or cannot be told.
    prior: Option<Prior>,
    /// Blur of the photographs in texels; 0 of a table.
    blur: f32,
    /// What photographs from one side say against their list.
    doubts: Option<Doubts>,
}

impl Work<'_> {
    fn learn(&self, sample: &[impl Readings]) -> Learned {
        self.bar.set_message("learning the threads");
        let surface = Surface::of(sample, self.ground, &normals::Options::default(), self.threads);
        let options = Options { surface: Some(surface), ..*self.options };
        let prior = self.learns.then(|| Prior::learn(sample, &options, self.threads)).flatten();
        self.bar.set_message("fitting");
        Learned { options, surface, prior, blur: 0.0, doubts: None }
    }

    fn learn_photographs(&self, sample: &[Stack], folders: &[Folder]) -> Learned {
        let mut learned = Learned { blur: blur(sample), ..self.learn(sample) };
        // From several sides photographs under near lights differ.
        if let [folder] = folders {
            let doubts = Doubts::of(sample, &learned.surface, &normals::Options::default(), self.threads);
            doubts.warn_of_brightness(folder);
            learned.doubts = Some(doubts);
        }
        learned
    }

    /// Texels from the `first` of all.
    fn fit(&self, readings: &impl Readings, first: usize, learned: &Learned) -> Vec<Fitted> {
        let Learned { options, prior, .. } = learned;
        let progress = |n| self.bar.set_position((first + n) as u64);
        fit(readings, options, prior.as_ref(), self.threads, &progress)
    }

    /// In bands of rows that take no more than `memory` bytes, from where the checkpoint ends.
    fn photographs(
        &self,
        folders: &[Folder],
        memory: u64,
        checkpoint: &mut Checkpoint,
    ) -> Result<Option<Learned>> {
        let folder = &folders[0];
        let lights = folders.iter().map(|f| f.pictures.len()).sum();
        // Each has its share, and they are put together in as much again where there are several.
        let share = memory / (2 * folders.len() as u64).saturating_sub(1).max(1);
        let rows = folders.iter().map(|f| f.rows_within(share)).min().unwrap_or(1);
        let done = checkpoint.rows();
        // A stack that is read in one go need not be read twice.
        if rows >= folder.height && done == 0 {
            let Some(stack) = Sides::open(folders, rows)?.next()? else { return Ok(None) };
            let learned = self.learn_photographs(&parts(&stack, sample_rows(folder, lights)), folders);
            checkpoint.append(&self.fit(&stack, 0, &learned))?;
            return Ok(Some(learned));
        }
        let learned = self.learn_photographs(&sample(folders, sample_rows(folder, lights))?, folders);
        let mut bands = Sides::open(folders, rows)?;
        bands.skip_rows(done)?;
        while let Some(stack) = bands.next()? {
            let fitted = self.fit(&stack, stack.first_row * stack.width, &learned);
            drop(stack);
            checkpoint.append(&fitted)?;
        }
        Ok(Some(learned))
    }
}

/// Bands of so many rows from each first row, of photographs that were read as a whole.
pub(super) fn parts(whole: &Stack, of: Vec<(usize, usize)>) -> Vec<Stack> {
    let row = whole.width * whole.lights.len();
    let part = |(first, rows): (usize, usize)| Stack {
        first_row: first,
        height: rows,
        lights: whole.lights.clone(),
        eyes: whole.eyes.clone(),
        values: whole.values[first * row..(first + rows) * row].to_vec(),
        ..*whole
    };
    of.into_iter().map(part).collect()
}

/// The same of photographs that are read now.
fn sample(folders: &[Folder], of: Vec<(usize, usize)>) -> Result<Vec<Stack>> {
    let (mut sample, mut row) = (Vec::new(), 0);
    let mut bands = Sides::open(folders, SAMPLE_ROWS)?;
    for (first, rows) in of {
        bands.skip_rows(first - row)?;
        sample.extend(bands.next()?);
        row = first + rows;
    }
    Ok(sample)
}

/// The truth to compare with: maps, or normals alone.
fn read_truth(file: &Path, source: &Source) -> Result<Truth> {
    let (width, height) = source.size();
    let maps = |file: &Path| -> Result<bool> {
        Ok(!image::is_for_display(file)
            && image::read(file, &ReadOptions::raw())?.channel("diffuse.R").is_some())
    };
    if !maps(file)? {
        let normals = read_normals(file, width, height)?;
        if normals.iter().all(|n| *n == Vec3::ZERO) {
            bail!(
                "{}: there is no normal in it: expected unit vectors, in a .png as (n + 1)/2, or the maps of a cloth",
                file.display()
            );
        }
        return Ok(Truth::Normals(normals));
    }
    let (truth, _) = btf::load(file, source.colour_space())?;
    if (truth.width, truth.height) != (width, height) {
        bail!(
            "{}: the true maps are {} x {}, the photographs {width} x {height}",
            file.display(),
            truth.width,
            truth.height,
        );
    }
    Ok(Truth::Maps(truth))
}

impl Fit {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if !(self.noise > 0.0 && self.noise < 1.0 && self.floor > 0.0 && self.floor < 1.0) {
            bail!("--noise {} --floor {}: expected both between 0 and 1", self.noise, self.floor);
        }
        let format = self.output.extension().and_then(|e| e.to_str()).map(str::to_lowercase);
        if !matches!(format.as_deref(), Some("btf" | "exr")) {
            bail!(
                "{}: maps are written as .btf or, the same, .exr; give the file one of these names",
                self.output.display()
            );
        }
        check_writable(&self.output)?;
        let started = Instant::now();
        let options = Options { noise: self.noise, floor: self.floor, ..Options::default() };
        let source = Source::open(&self.stacks, self.lights.as_deref())?;
        self.truth.iter().for_each(|t| will_read(t));
        let pictures = self.report.iter().flat_map(|folder| report::files(folder, self.truth.is_some()));
        let outputs = [self.output.clone(), checkpoint::place(&self.output)?];
        check_outputs(outputs.into_iter().chain(pictures))?;
        if let Some(folder) = &self.report {
            make_folder(folder)?;
        }
        let (width, height) = source.size();
        let lights = source.readings();
        if lights < FEWEST_LIGHTS {
            let what = if let Source::Table { .. } = source { "readings a texel" } else { "lights" };
            bail!(
                "{}: {lights} {what} are too few to tell a surface from its shadows; expected at least {FEWEST_LIGHTS}, \
                 better 50",
                self.stacks[0].display()
            );
        }
        let truth = self.truth.as_ref().map(|file| read_truth(file, &source)).transpose()?;

        let identity = format!(
            "{} {} {} {} {:?} {}",
            env!("CARGO_PKG_VERSION"),
            self.noise,
            self.floor,
            self.no_prior,
            self.ground.asked(),
            source.identity()
        );
        let mut checkpoint = Checkpoint::open(&self.output, &identity, width, self.resume)?;
        let done = checkpoint.rows();
        if done > 0 && !self.json {
            eprintln!("going on from row {done} of {height}");
        }
        let work = Work {
            options: &options,
            threads: argument::threads(self.threads),
            ground: self.ground.asked(),
            learns: !self.no_prior && lights >= FEWEST_FOR_HIGHLIGHTS,
            bar: &self.progress_bar((width * height) as u64),
        };
        work.bar.set_position((width * done) as u64);
        let mut learned = match &source {
            _ if done == height => None,
            Source::Photographs(folders) => work.photographs(folders, self.memory << 20, &mut checkpoint)?,
            Source::Table { texels, .. } => {
                let learned = work.learn(std::slice::from_ref(texels));
                let fitted = work.fit(texels, 0, &learned);
                checkpoint.append(&fitted[width * done..])?;
                Some(learned)
            }
        };
        // All may have been fitted before.
        let blurred = match (self.blur, &source, &learned) {
            (Some(said), ..) => said,
            (_, _, Some(learned)) => learned.blur,
            (_, Source::Photographs(folders), None) => {
                blur(&sample(folders, sample_rows(&folders[0], lights))?)
            }
            (_, Source::Table { .. }, None) => 0.0,
        };
        work.bar.finish_and_clear();
        let fitted = checkpoint.texels()?;
        let seconds = started.elapsed();

        let about = btf::About {
            texel_mm: self.texel_mm,
            lights,
            source: format!("yugen {} capture fit, {}", env!("CARGO_PKG_VERSION"), source.describe()),
            ..btf::About::default()
        };
        let residuals: Vec<f32> = fitted.iter().map(|f| f.residual).collect();
        let kinds = fitted.iter().map(|f| f.kind).collect::<Vec<_>>();
        let texels = fitted.into_iter().map(|f| f.texel).collect();
        let mut maps = Btf { width, height, colour_space: source.colour_space(), texels };
        if self.no_prior && !self.no_smoothing {
            smooth_tangents(&mut maps);
        }
        blur::doubt(&mut maps, blurred);
        btf::save(&self.output, &maps, &about)
            .context("the maps were not written; what was fitted is kept for --resume")?;
        checkpoint.remove();

        let doubts = learned.as_mut().and_then(|l| l.doubts.take());
        let report = Report {
            output: &self.output,
            maps: &maps,
            residuals: &residuals,
            blur: blurred,
            kinds: &kinds,
            lights,
            camera_distance: source.camera_distance(),
            learned: learned.as_ref().is_some_and(|l| l.prior.is_some()),
            noise: learned.as_ref().and_then(|l| Some(l.prior.as_ref()?.found_noise())),
            surface: learned.map(|l| l.surface),
            seconds: seconds.as_secs_f64(),
            comparison: truth.map(|t| Comparison::of(&maps, &t)),
        };
        // Maps that are sure of themselves prove the list.
        if let (Some(doubts), Source::Photographs(folders)) = (&doubts, &source)
            && report.median_confidence() < UNDECIDED
        {
            doubts.warn_of_list(&folders[0]);
        }
        if let Some(folder) = &self.report {
            report.write(folder)?;
        }
        report.print(self.json);
        Ok(())
    }

    fn progress_bar(&self, texels: u64) -> ProgressBar {
        if self.json {
            return ProgressBar::hidden();
        }
        let style =
            ProgressStyle::with_template("{elapsed_precise} {wide_bar} {percent:>3} %  {msg}, {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(texels).with_style(style);
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}
