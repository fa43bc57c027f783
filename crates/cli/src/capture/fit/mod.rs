//! `yugen capture fit`.

mod checkpoint;
mod report;

use anyhow::{Context, Result, bail};
use checkpoint::Checkpoint;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use report::Report;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use yugen_archive::formats::btf;
use yugen_archive::formats::stack::{Bands, Folder};
use yugen_capture::Stack;
use yugen_capture::fit::{Fitted, Options, Prior, fit, smooth_tangents};
use yugen_reflectance::btf::Btf;

/// Finds what each texel of a cloth reflects: diffuse and specular colour, normal, direction and widths of the highlight.
///
/// STACK is a folder of photographs from one place, one a light, with the list of lights beside them (lights.lp, and
/// stack.toml for what the pictures do not say themselves: see docs/capture.md). The result is one OpenEXR file with the
/// channels diffuse, specular, normal, tangent, sigma and confidence, which `yugen render` takes as a material
/// (`btf = "cloth.btf"`). Confidence is 0 where the photographs cannot decide, for example because no light met the
/// highlight.
///
/// Several STACKs of the same cloth, photographed from several sides (`view` in stack.toml), are fitted together, as is
/// a folder of them that `simulate` wrote for several --view.
///
/// Threads repeat: what texels of one thread have in common is learned first and helps where the lights of a single texel
/// are too few (--no-prior to do without).
#[derive(Args)]
pub struct Fit {
    /// The folder of photographs, or its list of lights; one from each side.
    #[arg(required = true, value_name = "STACK")]
    stacks: Vec<PathBuf>,

    /// The maps: cloth.btf, or the same as .exr.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Standard deviation of a reading as a part of it; what the camera's noise and the model's faults make together.
    #[arg(long, value_name = "PART", default_value_t = Options::default().noise)]
    noise: f32,

    /// Standard deviation of a black reading, as a reflectance.
    #[arg(long, value_name = "RHO", default_value_t = Options::default().floor)]
    floor: f32,

    /// Fit every texel by itself.
    #[arg(long)]
    no_prior: bool,

    /// Leave tangents as each texel has them, however unsure.
    #[arg(long)]
    no_smoothing: bool,

    /// Width of a texel on the cloth in millimetres, to be kept with the maps.
    #[arg(long, value_name = "MM")]
    texel_mm: Option<f32>,

    /// Mebibytes that the photographs in work may take. The maps themselves take up to 190 bytes a texel besides, at the end.
    #[arg(long, value_name = "MIB", default_value_t = 1024)]
    memory: u64,

    /// Threads instead of one per core; the result is the same bits for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Go on from the checkpoint that an interrupted fit left beside the output.
    #[arg(long)]
    resume: bool,

    /// True maps of the same size, to compare with.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,

    /// A folder for pictures of the maps, of the residual and, with --truth, of the errors.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,

    /// Print the report as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

/// Fewer lights than this leave more unknowns than readings.
const FEWEST_LIGHTS: usize = 8;
/// Rows of a band that threads are learned from.
const SAMPLE_ROWS: usize = 8;

/// What the sample may take of memory.
const SAMPLE_BYTES: usize = 512 << 20;

/// First row and height of the bands that threads are learned from: spread over the height, and the same whatever the
/// memory, so that the result is.
fn sample_rows(folder: &Folder, lights: usize) -> Vec<(usize, usize)> {
    let rows = SAMPLE_ROWS.min(folder.height);
    let each = folder.width * rows * lights * size_of::<[f32; 3]>();
    let count = (SAMPLE_BYTES / each.max(1)).clamp(1, 16).min(folder.height / rows);
    (0..count).map(|i| (i * (folder.height - rows) / (count - 1).max(1), rows)).collect()
}

/// The same rows of all stacks, side by side.
struct Sides<'a> {
    folders: &'a [Folder],
    bands: Vec<Bands<'a>>,
}

impl<'a> Sides<'a> {
    fn open(folders: &'a [Folder], rows: usize) -> Result<Self> {
        let bands = folders.iter().map(|f| f.bands(rows)).collect::<Result<_, _>>()?;
        Ok(Self { folders, bands })
    }

    fn skip_rows(&mut self, rows: usize) -> Result<()> {
        Ok(self.bands.iter_mut().try_for_each(|b| b.skip_rows(rows))?)
    }

    /// `None` after the last.
    fn next(&mut self) -> Result<Option<Stack>> {
        let mut stacks = Vec::new();
        for (folder, bands) in self.folders.iter().zip(&mut self.bands) {
            match bands.next().transpose()? {
                Some(band) => stacks.push(Stack::from_band(folder, band)),
                None => return Ok(None),
            }
        }
        Ok(if stacks.len() == 1 { stacks.pop() } else { Stack::join(&stacks) })
    }
}

/// The stacks that `views.csv` in a folder names, a line each behind its heading; `None` where there is none.
fn sides(path: &Path) -> Result<Option<Vec<PathBuf>>> {
    let list = path.join("views.csv");
    if !list.is_file() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&list).with_context(|| list.display().to_string())?;
    let names = text.lines().skip(1).filter_map(|l| l.split(',').next()).map(str::trim);
    Ok(Some(names.filter(|n| !n.is_empty()).map(|n| path.join(n)).collect()))
}

/// What threads are learned from.
fn sample(folders: &[Folder], lights: usize) -> Result<Vec<Stack>> {
    let (mut sample, mut row) = (Vec::new(), 0);
    let mut bands = Sides::open(folders, SAMPLE_ROWS)?;
    for (first, rows) in sample_rows(&folders[0], lights) {
        bands.skip_rows(first - row)?;
        sample.extend(bands.next()?);
        row = first + rows;
    }
    Ok(sample)
}

impl Fit {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if !(self.noise > 0.0 && self.noise < 1.0 && self.floor > 0.0 && self.floor < 1.0) {
            bail!("--noise {} --floor {}: expected both between 0 and 1", self.noise, self.floor);
        }
        let started = Instant::now();
        let options = Options { noise: self.noise, floor: self.floor, ..Options::default() };
        let folders = self.folders()?;
        let folder = &folders[0];
        let lights = folders.iter().map(|f| f.pictures.len()).sum::<usize>();
        if lights < FEWEST_LIGHTS {
            bail!(
                "{}: {lights} lights are too few for seven unknowns a texel; expected at least {FEWEST_LIGHTS}, better 50",
                self.stacks[0].display()
            );
        }
        let truth = self.truth.as_ref().map(|path| btf::load(path, folder.colour_space)).transpose()?;
        if let (Some((truth, _)), Some(path)) = (&truth, &self.truth)
            && (truth.width, truth.height) != (folder.width, folder.height)
        {
            bail!(
                "{}: the true maps are {} x {}, the photographs {} x {}",
                path.display(),
                truth.width,
                truth.height,
                folder.width,
                folder.height
            );
        }
        let threads = self
            .threads
            .map_or_else(|| std::thread::available_parallelism().map_or(1, |n| n.get()), usize::from);

        // Each has its share, and they are put together in as much again where there are several.
        let share = (self.memory << 20) / (2 * folders.len() as u64).saturating_sub(1).max(1);
        let rows = folders.iter().map(|f| f.rows_within(share)).min().unwrap_or(1);
        let mut checkpoint =
            Checkpoint::open(&self.output, &self.identity(&folders), folder.width, self.resume)?;
        let done = checkpoint.rows();
        if done > 0 && !self.json {
            eprintln!("going on from row {done} of {}", folder.height);
        }
        let bar = self.progress_bar((folder.width * folder.height) as u64);
        bar.set_position((folder.width * done) as u64);
        // A stack that is read in one go need not be read twice.
        let whole = (rows >= folder.height && done == 0)
            .then(|| Sides::open(&folders, rows)?.next())
            .transpose()?
            .flatten();
        bar.set_message("learning the threads");
        let prior = match (&whole, self.no_prior || done == folder.height) {
            (_, true) => None,
            (Some(stack), _) => {
                let row = stack.width * lights;
                let sample: Vec<Stack> = sample_rows(folder, lights)
                    .into_iter()
                    .map(|(first, rows)| Stack {
                        first_row: first,
                        height: rows,
                        lights: stack.lights.clone(),
                        eyes: stack.eyes.clone(),
                        values: stack.values[first * row..(first + rows) * row].to_vec(),
                        ..*stack
                    })
                    .collect();
                Prior::learn(&sample, &options, threads)
            }
            (None, _) => Prior::learn(&sample(&folders, lights)?, &options, threads),
        };
        bar.set_message("fitting");
        if let Some(stack) = whole {
            checkpoint.append(&self.fit_band(&stack, &options, prior.as_ref(), threads, &bar))?;
        } else if done < folder.height {
            let mut bands = Sides::open(&folders, rows)?;
            bands.skip_rows(done)?;
            while let Some(stack) = bands.next()? {
                let fitted = self.fit_band(&stack, &options, prior.as_ref(), threads, &bar);
                drop(stack);
                checkpoint.append(&fitted)?;
            }
        }
        bar.finish_and_clear();
        let fitted = checkpoint.texels()?;
        let seconds = started.elapsed();

        let about = btf::About {
            texel_mm: self.texel_mm,
            lights,
            source: format!("yugen {} capture fit, {lights} photographs", env!("CARGO_PKG_VERSION")),
            ..btf::About::default()
        };
        let residuals: Vec<f32> = fitted.iter().map(|f| f.residual).collect();
        let masked = fitted.iter().filter(|f| f.readings == 0).count();
        let (width, height) = (folder.width, folder.height);
        let texels = fitted.into_iter().map(|f| f.texel).collect();
        let mut maps = Btf { width, height, colour_space: folder.colour_space, texels };
        if !self.no_smoothing {
            smooth_tangents(&mut maps);
        }
        btf::save(&self.output, &maps, &about)?;
        checkpoint.remove();

        let report = Report {
            output: &self.output,
            maps: &maps,
            residuals: &residuals,
            masked,
            lights,
            learned: prior.is_some(),
            seconds: seconds.as_secs_f64(),
            truth: truth.as_ref().map(|t| &t.0),
        };
        if let Some(folder) = &self.report {
            report.pictures(folder)?;
        }
        report.print(self.json);
        Ok(())
    }

    fn fit_band(
        &self,
        stack: &Stack,
        options: &Options,
        prior: Option<&Prior>,
        threads: usize,
        bar: &ProgressBar,
    ) -> Vec<Fitted> {
        let before = (stack.first_row * stack.width) as u64;
        fit(stack, options, prior, threads, &|texels| bar.set_position(before + texels as u64))
    }

    /// The stacks, all of one size and kind.
    fn folders(&self) -> Result<Vec<Folder>> {
        let mut paths = Vec::new();
        for path in &self.stacks {
            match sides(path)? {
                Some(sides) => paths.extend(sides),
                None => paths.push(path.clone()),
            }
        }
        let folders: Vec<Folder> = paths.iter().map(|p| Folder::open(p)).collect::<Result<_, _>>()?;
        let Some(first) = folders.first() else { bail!("there is no stack to fit") };
        for f in &folders {
            if (f.width, f.height) != (first.width, first.height) {
                bail!(
                    "{}: the photographs are {} x {}, those of {} {} x {}; stacks from several sides show the same texels",
                    f.path.display(),
                    f.width,
                    f.height,
                    first.path.display(),
                    first.width,
                    first.height
                );
            }
            if (f.options.near, f.colour_space) != (first.options.near, first.colour_space) {
                bail!(
                    "{}: near lamps or the colour space are not those of {}; stacks from several sides have both alike",
                    f.path.display(),
                    first.path.display()
                );
            }
        }
        Ok(folders)
    }

    /// What a checkpoint must agree in to be gone on from.
    fn identity(&self, folders: &[Folder]) -> String {
        let mut text = format!(
            "{} {} {} {} {} {}",
            env!("CARGO_PKG_VERSION"),
            folders[0].width,
            folders[0].height,
            self.noise,
            self.floor,
            self.no_prior
        );
        for folder in folders {
            text.push_str(&format!("\n{:?}", folder.options));
            for p in &folder.pictures {
                let meta = std::fs::metadata(&p.path).ok();
                let (length, modified) = meta.map_or((0, None), |m| (m.len(), m.modified().ok()));
                text.push_str(&format!("\n{} {} {length} {modified:?}", p.path.display(), p.light));
            }
        }
        text
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
