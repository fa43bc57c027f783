//! `yugen capture hdr`.

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use yugen_archive::formats::exposures::{self, Exposure};
use yugen_archive::formats::image::rows::{Rows, Samples};
use yugen_archive::formats::image::{self, NonFinite, ReadOptions, WriteOptions};
use yugen_archive::formats::{chart, exif, lp, response, stack};
use yugen_archive::{atomic_write, read_bounded};
use yugen_capture::hdr::{
    Bracket, Noise, Radiance, Response, Shot, Tally, colour_matrix, recover_response, shift,
};
use yugen_capture::lens::{Lens, straighten};
use yugen_optics::{ColourSpace, Image, Mat3, Vec2, Vec3};

/// Merges exposure brackets to linear pictures with their uncertainty.
///
/// `yugen capture hdr IMG_1.jpg IMG_2.jpg IMG_3.jpg -o cloth.exr` merges one bracket. `yugen capture hdr FOLDER -o STACK`
/// merges a bracket a light into a stack folder for `calibrate`, `fit` and `relight`. Which picture belongs to which
/// light, and its exposure time, is read from FOLDER/exposures.csv (columns file, seconds, light); without it the time
/// comes from Exif and the light is the file's name up to the last underscore: lamp07_2.jpg is one of light lamp07.
///
/// The pictures may be JPEG, PNG or TIFF (8 or 16 bits) or linear EXR. Camera raw files are not read: develop them to
/// linear 16-bit TIFF and say `--response linear`.
#[derive(Args)]
pub struct Hdr {
    /// The pictures of one bracket, or one folder.
    #[arg(required = true)]
    input: Vec<PathBuf>,

    /// An .exr for one bracket, a folder for a folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,

    /// Times and lights instead of exposures.csv and Exif.
    #[arg(long, value_name = "CSV")]
    list: Option<PathBuf>,

    /// How the camera's levels follow light: srgb, linear, recover (found from the brackets themselves), or a table
    /// as --save-response writes it.
    #[arg(long, default_value = "srgb", value_name = "NAME|CSV")]
    response: String,

    /// Keep the response.
    #[arg(long, value_name = "CSV")]
    save_response: Option<PathBuf>,

    /// Pictures taken with the lens covered; each is taken off the exposures of its time, a single one off all.
    #[arg(long, value_name = "FILE")]
    dark: Vec<PathBuf>,

    /// A white standard that fills the picture, merged before: an .exr, or a folder with one for each light. Its shape
    /// is divided out, not its brightness. Flats for each light take the fall-off of near lamps away as well.
    #[arg(long, value_name = "PATH")]
    flat: Option<PathBuf>,

    /// Where the white reference lies in each picture, in pixels from the top left: what it reads becomes its
    /// reflectance, channel by channel and light by light.
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_delimiter = ',')]
    white: Vec<usize>,

    /// How much of the light that white reflects.
    #[arg(long, default_value_t = 0.99, value_name = "R", requires = "white")]
    white_reflectance: f32,

    /// The white faces each light in turn instead of lying level beside the sample.
    #[arg(long, requires = "white")]
    white_turns: bool,

    /// The lens, undone in the merged pictures: focal length and centre in pixels, then k1, k2, p1, p2 and k3 of Brown
    /// and Conrady, as OpenCV writes them.
    #[arg(long, value_name = "F,CX,CY,K1,K2,P1,P2,K3", value_parser = lens, allow_hyphen_values = true)]
    lens: Option<Lens>,

    /// A chart: measured and known linear colours of its patches give a 3x3 matrix.
    #[arg(long, value_name = "CSV")]
    chart: Option<PathBuf>,

    /// The space that the colours are in, with a chart that of its known colours.
    #[arg(long, default_value = "srgb", value_name = "SPACE", value_parser = ColourSpace::ALL.map(ColourSpace::name))]
    space: String,

    /// The list of lights, whose names are those of the lights or of their pictures.
    #[arg(long, value_name = "LP")]
    lights: Option<PathBuf>,

    /// Electrons of the sensor at full scale, for the noise.
    #[arg(long, default_value_t = 30_000.0, value_name = "E")]
    full_well: f32,

    /// Noise of reading in electrons.
    #[arg(long, default_value_t = 5.0, value_name = "E")]
    read_noise: f32,

    /// Levels from this part of full scale on are saturated.
    #[arg(long, default_value_t = 0.99, value_name = "PART")]
    saturated: f32,

    /// Print the report as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

/// A picture and how long it was exposed.
struct Photograph {
    path: PathBuf,
    seconds: f32,
}

/// The bracket of a light.
struct Light {
    name: String,
    photographs: Vec<Photograph>,
}

/// What became of a light.
struct Outcome {
    file: PathBuf,
    tally: Tally,
    moved: Option<f32>,
    white: Option<Vec3>,
}

/// Rows that are merged at a time.
const BAND: usize = 64;
/// Pictures are this wide at most where motion is looked for.
const GLANCE: usize = 512;
/// Pixels that the response is recovered from.
const PIXELS: usize = 8000;
/// What pictures that cannot be read row by row may hold in memory.
const KEPT: u64 = 1 << 30;
const MAX_TEXT: u64 = 16 << 20;

impl Hdr {
    /// Does it.
    pub fn run(self) -> Result<()> {
        ensure!(
            self.full_well > 0.0 && self.read_noise >= 0.0 && (0.1..=1.0).contains(&self.saturated),
            "expected --full-well above 0, --read-noise of 0 or more and --saturated between 0.1 and 1"
        );
        ensure!(matches!(self.white.len(), 0 | 4), "--white: expected four numbers, as in 40,3010,200,200");
        if let Some(list) =
            self.input.iter().find(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")))
        {
            let folder = list.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(".".as_ref());
            bail!(
                "{}: a list, not a picture; name the folder of the pictures ({}) and the list with --list",
                list.display(),
                folder.display()
            );
        }
        let folder = self.input.len() == 1 && self.input[0].is_dir();
        if !folder {
            let exr = self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
            ensure!(exr, "{}: one bracket becomes an .exr; name one", self.output.display());
        } else {
            ensure!(
                !self.output.is_file(),
                "{} is a file; name a folder for the stack",
                self.output.display()
            );
        }
        let lights = self.photographs(folder)?;
        let entries = self.entries(&lights, folder)?;
        let space = ColourSpace::from_name(&self.space).context("no such colour space")?;
        let response = self.response(&lights)?;
        let matrix = self.chart.as_ref().map(|path| colours(path)).transpose()?;
        let darks = self.darks()?;

        if folder {
            std::fs::create_dir_all(&self.output).with_context(|| format!("{}", self.output.display()))?;
        }
        let bar = if self.json { ProgressBar::hidden() } else { ProgressBar::new(lights.len() as u64) };
        let style = ProgressStyle::with_template("{elapsed_precise} {wide_bar} {pos}/{len} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let mut outcomes = Vec::new();
        for light in &lights {
            bar.set_message(light.name.clone());
            let file =
                if folder { self.output.join(format!("{}.exr", light.name)) } else { self.output.clone() };
            let mut merged = self.merge(light, &response, &darks)?;
            if let Some(flat) = self.flat_of(light)? {
                flatten(&mut merged.image, &flat)
                    .with_context(|| format!("--flat does not fit the pictures of '{}'", light.name))?;
            }
            let white = if self.white.is_empty() {
                None
            } else {
                Some(self.balance(&mut merged.image, &light.name)?)
            };
            if let Some((matrix, _)) = matrix {
                turn(&mut merged.image, matrix);
            }
            if let Some(lens) = &self.lens {
                let image = &mut merged.image;
                image.data = straighten(&image.data, image.width, image.height, image.channels.len(), lens);
            }
            let options = WriteOptions { non_finite: NonFinite::Keep, ..WriteOptions::from(space) };
            image::write(&file, &merged.image, &options)?;
            outcomes.push(Outcome { file, tally: merged.tally, moved: merged.moved, white });
            bar.inc(1);
        }
        bar.finish_and_clear();
        if folder {
            let level_white = !self.white.is_empty() && !self.white_turns;
            let options = stack::Options { level_white, ..stack::Options::default() };
            match &entries {
                Some(entries) => stack::write(&self.output, entries, &options)?,
                // The directions are found later, by `calibrate`.
                None if level_white => {
                    atomic_write(&self.output.join(stack::OPTIONS), options.text().as_bytes())?
                }
                None => {}
            }
        }
        if let Some(path) = &self.save_response {
            let levels: Vec<[f32; 3]> = match &response {
                Response::Table(levels) => levels.clone(),
                other => (0..256).map(|i| [0, 1, 2].map(|c| other.light(c, i as f32 / 255.0))).collect(),
            };
            atomic_write(path, response::write(&levels).as_bytes())?;
        }
        self.report(&lights, &outcomes, matrix.map(|m| m.1), entries.is_some() || !folder);
        Ok(())
    }

    /// Every light with its exposures, shortest first.
    fn photographs(&self, folder: bool) -> Result<Vec<Light>> {
        let list = self.list.clone().or_else(|| {
            let usual = self.input[0].join("exposures.csv");
            (folder && usual.is_file()).then_some(usual)
        });
        let mut lights: BTreeMap<String, Vec<Photograph>> = BTreeMap::new();
        match list {
            Some(path) => {
                let all = exposures::read(&read_bounded(&path, MAX_TEXT)?, &path)?;
                let at = |name: &str| -> Result<PathBuf> {
                    let bare = Path::new(name).file_name().unwrap_or_default();
                    let found = if folder {
                        Some(self.input[0].join(bare)).filter(|p| p.is_file())
                    } else {
                        self.input.iter().find(|p| p.file_name() == Some(bare)).cloned()
                    };
                    found.with_context(|| format!("{}: the picture '{name}' is not there", path.display()))
                };
                for Exposure { file, seconds, light } in &all {
                    let name = if light.is_empty() { "merged" } else { light };
                    ensure!(
                        !name.contains(['/', '\\']) && !name.starts_with('.'),
                        "{}: the light '{name}' cannot name a file; leave out / and \\ and a dot in front",
                        path.display()
                    );
                    let photograph = Photograph { path: at(file)?, seconds: *seconds };
                    lights.entry(name.to_string()).or_default().push(photograph);
                }
                ensure!(folder || lights.len() == 1, "{}: several lights need a folder", path.display());
            }
            None => {
                for path in if folder { pictures(&self.input[0])? } else { self.input.clone() } {
                    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                    let name = match stem.rsplit_once('_') {
                        Some((light, _)) if folder && !light.is_empty() => light.to_string(),
                        _ if folder => stem,
                        _ => "merged".into(),
                    };
                    let seconds = exif::read(&path)?.seconds.with_context(|| {
                        format!(
                            "{}: there is no exposure time in it; give the times with --list (columns file, seconds, light)",
                            path.display()
                        )
                    })?;
                    lights.entry(name).or_default().push(Photograph { path, seconds });
                }
                for photographs in lights.values() {
                    same_settings(photographs)?;
                }
            }
        }
        ensure!(!lights.is_empty(), "{}: there is no picture in it", self.input[0].display());
        Ok(lights
            .into_iter()
            .map(|(name, mut photographs)| {
                photographs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
                Light { name, photographs }
            })
            .collect())
    }

    /// The list of lights of the stack, if there is one.
    fn entries(&self, lights: &[Light], folder: bool) -> Result<Option<Vec<lp::Entry>>> {
        let usual = self.input[0].join(stack::LIGHTS);
        let path = match &self.lights {
            Some(path) => path.clone(),
            None if folder && usual.is_file() => usual,
            None => return Ok(None),
        };
        ensure!(folder, "--lights is for a folder of brackets, one a light");
        let known = lp::read(&read_bounded(&path, MAX_TEXT)?, &path, lp::Axes::default())?;
        let stem = |name: &str| -> String {
            let bare = name.rsplit(['/', '\\']).next().unwrap_or(name);
            Path::new(bare).file_stem().unwrap_or_default().to_string_lossy().into_owned()
        };
        let entry = |light: &Light| {
            let named = |e: &&lp::Entry| {
                let name = stem(&e.file);
                name == light.name
                    || light.photographs.iter().any(|p| stem(&p.path.to_string_lossy()) == name)
            };
            let found = known.iter().find(named).with_context(|| {
                format!(
                    "{}: there is no light '{}'; name it so, or as one of its pictures",
                    path.display(),
                    light.name
                )
            })?;
            Ok(lp::Entry { file: format!("{}.exr", light.name), light: found.light })
        };
        lights.iter().map(entry).collect::<Result<Vec<_>>>().map(Some)
    }

    fn response(&self, lights: &[Light]) -> Result<Response> {
        Ok(match self.response.as_str() {
            "srgb" => Response::Srgb,
            "linear" => Response::Linear,
            "recover" => {
                // Some lights tell as much as all.
                let step = lights.len().div_ceil(8);
                let some: Vec<&Light> = lights.iter().step_by(step).collect();
                let mut pixels = Vec::new();
                for light in &some {
                    pixels.extend(sample(light, PIXELS / some.len())?);
                }
                recover_response(pixels.iter().map(Vec::as_slice)).context(
                    "the response cannot be recovered: it takes exposures of different times in which pixels are neither \
                     black nor saturated; say --response srgb or linear",
                )?
            }
            file => {
                let path = Path::new(file);
                if !path.exists() {
                    bail!("--response {file}: expected srgb, linear, recover or a file that exists");
                }
                let levels = response::read(&read_bounded(path, MAX_TEXT)?, path)?;
                Response::table(levels).map_err(anyhow::Error::msg).with_context(|| file.to_string())?
            }
        })
    }

    /// Dark frames with their times, where they have any.
    fn darks(&self) -> Result<Vec<(Option<f32>, PathBuf)>> {
        self.dark.iter().map(|path| Ok((exif::read(path)?.seconds, path.clone()))).collect()
    }

    /// Merges a bracket.
    fn merge(&self, light: &Light, response: &Response, darks: &[(Option<f32>, PathBuf)]) -> Result<Merged> {
        let mut allowance = KEPT;
        let mut open = |path: &Path| Rows::open(path, &ReadOptions::raw(), &mut allowance);
        let mut pictures = light.photographs.iter().map(|p| open(&p.path)).collect::<Result<Vec<_>, _>>()?;
        let dark_of = |seconds: f32| -> Option<&PathBuf> {
            let near = |t: &Option<f32>| t.is_some_and(|t| (t / seconds - 1.0).abs() < 0.02);
            darks
                .iter()
                .find(|d| near(&d.0))
                .or(Some(darks.first()?).filter(|_| darks.len() == 1))
                .map(|d| &d.1)
        };
        let mut dark_rows = Vec::new();
        for photograph in &light.photographs {
            let path = dark_of(photograph.seconds);
            if path.is_none() && !darks.is_empty() {
                bail!(
                    "{}: no dark frame was exposed for {} s; add one, or give a single one for all",
                    photograph.path.display(),
                    photograph.seconds
                );
            }
            dark_rows.push(path.map(|p| open(p)).transpose()?);
        }
        let (width, height, channels) = (pictures[0].width, pictures[0].height, pictures[0].channels);
        let kind = pictures[0].samples;
        let all = pictures.iter().zip(light.photographs.iter().map(|p| &p.path));
        let dark_files = dark_rows.iter().zip(&light.photographs);
        let dark_files = dark_files.filter_map(|(r, p)| Some((r.as_ref()?, dark_of(p.seconds)?)));
        for (rows, path) in all.chain(dark_files) {
            ensure!(
                (rows.width, rows.height, rows.channels) == (width, height, channels) && rows.samples == kind,
                "{}: the picture is {} x {} of {} channels, but '{}' is {width} x {height} of {channels}, or their bits \
                 differ; all exposures need one size and format",
                path.display(),
                rows.width,
                rows.height,
                rows.channels,
                light.photographs[0].path.display()
            );
        }
        let (step, response) = match kind {
            Samples::Codes(max) => (1.0 / max as f32, response.clone()),
            // Floating-point pictures are linear by convention.
            Samples::Floats => (0.0, Response::Linear),
        };
        let noise =
            Noise { full_well: self.full_well, read: self.read_noise, step, saturated: self.saturated };
        let seconds: Vec<f32> = light.photographs.iter().map(|p| p.seconds).collect();
        let bracket = Bracket { seconds: &seconds, response: &response, noise };
        let mut glances: Vec<Glance> = seconds.iter().map(|_| Glance::new(width, height)).collect();
        let mut image = Image::new(width, height, &["R", "G", "B", "sigma.R", "sigma.G", "sigma.B"]);
        let mut tally = Tally::default();
        for (band, out) in image.data.chunks_mut(BAND * width * 6).enumerate() {
            let rows = out.len() / (width * 6);
            let levels = read_band(&mut pictures, width, rows)?;
            let mut lights = Vec::new();
            for dark in &mut dark_rows {
                lights.push(match dark {
                    Some(dark) => {
                        let mut levels = read_band(std::slice::from_mut(dark), width, rows)?.remove(0);
                        for v in &mut levels {
                            *v = [0, 1, 2].map(|c| response.light(c, v[c]));
                        }
                        Some(levels)
                    }
                    None => None,
                });
            }
            let merged: Vec<Radiance> = bracket.merge(width, &levels, &lights);
            tally.add(&merged);
            for (glance, (levels, &t)) in glances.iter_mut().zip(levels.iter().zip(&seconds)) {
                glance.add(band * BAND, levels, |level| {
                    let open = level >= 0.02 && level < self.saturated;
                    if open { response.light(1, level) / t } else { f32::NAN }
                });
            }
            for (out, r) in out.chunks_exact_mut(6).zip(merged) {
                out[..3].copy_from_slice(&r.value);
                out[3..].copy_from_slice(&r.sigma);
            }
        }
        ensure!(
            tally.saturated < tally.pixels,
            "light '{}': every pixel is saturated in every exposure; expose for a shorter time",
            light.name
        );
        // Neighbours in time have most in common.
        let moved = glances
            .windows(2)
            .filter_map(|pair| {
                Some(shift(&pair[0].sums, &pair[1].sums, pair[0].width, pair[0].height())?.length())
            })
            .map(|v| v * glances[0].factor as f32)
            .reduce(f32::max);
        if channels == 1 {
            image = image.select(&["R", "sigma.R"]).unwrap_or(image);
            image.channels = ["Y", "sigma.Y"].map(String::from).to_vec();
        }
        Ok(Merged { image, tally, moved })
    }

    /// The flat for a light.
    fn flat_of(&self, light: &Light) -> Result<Option<Image>> {
        let Some(path) = &self.flat else { return Ok(None) };
        let file = if path.is_dir() { path.join(format!("{}.exr", light.name)) } else { path.clone() };
        let options = ReadOptions { non_finite: NonFinite::Keep, ..ReadOptions::raw() };
        Ok(Some(image::read(&file, &options)?))
    }

    /// Makes what the white reference reads its reflectance; what it read.
    fn balance(&self, image: &mut Image, name: &str) -> Result<Vec3> {
        let [x, y, w, h] = self.white[..] else { bail!("--white takes four numbers") };
        let fits = |at: usize, size: usize, all: usize| {
            size > 0 && at.checked_add(size).is_some_and(|end| end <= all)
        };
        ensure!(
            fits(x, w, image.width) && fits(y, h, image.height),
            "--white {x},{y},{w},{h} does not lie in the pictures, which are {} x {}",
            image.width,
            image.height
        );
        let planes = image.channels.len() / 2;
        let (mut sum, mut count) = (Vec3::ZERO, 0usize);
        for j in y..y + h {
            for i in x..x + w {
                let pixel = image.pixel(i, j);
                if !pixel[0].is_nan() {
                    sum += Vec3::from_array([0, 1, 2].map(|c| pixel[if planes == 1 { 0 } else { c }]));
                    count += 1;
                }
            }
        }
        ensure!(
            2 * count > w * h && sum.min_element() > 0.0,
            "light '{name}': the white reference is saturated or black; expose the bracket for it too"
        );
        let read = sum / count as f32;
        let scale = (self.white_reflectance / read).to_array();
        for pixel in image.data.chunks_exact_mut(2 * planes) {
            for (i, v) in pixel.iter_mut().enumerate() {
                *v *= scale[i % planes];
            }
        }
        Ok(read)
    }

    fn report(&self, lights: &[Light], outcomes: &[Outcome], colour: Option<f32>, calibrated: bool) {
        let fit = |t: &Tally| (t.freedom > 0).then(|| t.chi_square / t.freedom as f64);
        if self.json {
            let rows: Vec<Value> = lights
                .iter()
                .zip(outcomes)
                .map(|(light, o)| {
                    json!({
                        "light": light.name,
                        "output": o.file.display().to_string(),
                        "seconds": light.photographs.iter().map(|p| p.seconds).collect::<Vec<_>>(),
                        "pixels": o.tally.pixels,
                        "saturated": o.tally.saturated,
                        "black": o.tally.black,
                        "chi_square_per_degree": fit(&o.tally),
                        "moved_pixels": o.moved,
                        "white": o.white.map(|w| w.to_array()),
                    })
                })
                .collect();
            println!(
                "{}",
                json!({ "lights": rows, "colour_error": colour, "has_light_directions": calibrated })
            );
            return;
        }
        let mut all = Tally::default();
        for (light, o) in lights.iter().zip(outcomes) {
            all.pixels += o.tally.pixels;
            all.saturated += o.tally.saturated;
            all.black += o.tally.black;
            all.chi_square += o.tally.chi_square;
            all.freedom += o.tally.freedom;
            if let Some(moved) = o.moved.filter(|m| *m > 0.5) {
                println!(
                    "{}: something moved by {moved:.1} pixels between the exposures; take it again",
                    light.name
                );
            }
        }
        let exposures: usize = lights.iter().map(|l| l.photographs.len()).sum();
        println!("{}: {exposures} exposures of {} lights", self.output.display(), lights.len());
        let single = lights.iter().filter(|l| l.photographs.len() == 1).count();
        if single > 0 {
            println!("{single} of them have one exposure only, which gains no range");
        }
        let part = |n: u64| 100.0 * n as f64 / all.pixels.max(1) as f64;
        println!(
            "{} pixels ({:.2} %) are saturated in every exposure and masked, {} ({:.2} %) are black in every one",
            all.saturated,
            part(all.saturated),
            all.black,
            part(all.black)
        );
        if let Some(fit) = fit(&all) {
            let verdict = match fit {
                v if v > 2.0 => {
                    ": more than the noise explains; check the response, --full-well and --read-noise"
                }
                v if v < 0.5 => ": less than the noise explains; --full-well is higher or --read-noise lower",
                _ => "",
            };
            println!("the exposures differ by {fit:.2} times the variance that the noise explains{verdict}");
        }
        if let Some(error) = colour {
            println!("the chart is met within {:.1} % (root mean square)", 100.0 * error);
        }
        if !calibrated {
            println!("there is no list of lights yet: go on with `yugen capture calibrate`");
        }
    }
}

struct Merged {
    image: Image,
    tally: Tally,
    moved: Option<f32>,
}

/// The pictures of a folder by name; lists and what is hidden aside.
pub fn pictures(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| format!("{}", folder.display()))? {
        let path = entry.with_context(|| format!("{}", folder.display()))?.path();
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let known = ["jpg", "jpeg", "png", "tif", "tiff", "exr", "webp", "hdr"].contains(&extension.as_str());
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if known && path.is_file() && !name.starts_with('.') && name != stack::MASK {
            all.push(path);
        }
    }
    all.sort();
    Ok(all)
}

/// A lens as the command line names it.
pub fn lens(text: &str) -> Result<Lens, String> {
    let numbers: Option<Vec<f32>> =
        text.split(',').map(|w| w.trim().parse().ok().filter(|v: &f32| v.is_finite())).collect();
    match numbers.as_deref() {
        Some(&[focal, x, y, k1, k2, p1, p2, k3]) if focal > 0.0 => {
            Ok(Lens { focal, centre: Vec2::new(x, y), radial: [k1, k2, k3], tangential: [p1, p2] })
        }
        _ => Err("expected eight numbers: focal length and centre in pixels, k1, k2, p1, p2, k3".into()),
    }
}

/// Only the time may change within a bracket.
fn same_settings(photographs: &[Photograph]) -> Result<()> {
    let first = exif::read(&photographs[0].path)?;
    for p in &photographs[1..] {
        let settings = exif::read(&p.path)?;
        ensure!(
            settings.f_number == first.f_number && settings.iso == first.iso,
            "{}: aperture or sensitivity differ from those of '{}'; within a bracket only the time may change",
            p.path.display(),
            photographs[0].path.display()
        );
    }
    Ok(())
}

/// The next rows of each picture, the pictures side by side.
fn read_band(pictures: &mut [Rows], width: usize, rows: usize) -> Result<Vec<Vec<[f32; 3]>>> {
    std::thread::scope(|scope| {
        let workers: Vec<_> = pictures
            .iter_mut()
            .map(|picture| {
                scope.spawn(move || {
                    let mut band = vec![[0.0; 3]; width * rows];
                    band.chunks_exact_mut(width).try_for_each(|row| picture.next_row(row)).map(|()| band)
                })
            })
            .collect();
        let join = |w: std::thread::ScopedJoinHandle<'_, _>| {
            w.join().unwrap_or_else(|p| std::panic::resume_unwind(p))
        };
        workers.into_iter().map(join).collect::<Result<Vec<_>, _>>()
    })
    .map_err(Into::into)
}

/// Pixels of a bracket, evenly spread.
fn sample(light: &Light, count: usize) -> Result<Vec<Vec<Shot>>> {
    let mut pixels: Vec<Vec<Shot>> = Vec::new();
    for photograph in &light.photographs {
        let mut rows = Rows::open(&photograph.path, &ReadOptions::raw(), &mut { KEPT })?;
        let (w, h) = (rows.width, rows.height);
        let step = (((w * h) as f64 / count.max(1) as f64).sqrt().ceil() as usize).max(1);
        let mut line = vec![[0.0; 3]; w];
        let mut at = 0;
        for y in 0..h {
            rows.next_row(&mut line)?;
            if y % step != step / 2 {
                continue;
            }
            for level in line.iter().skip(step / 2).step_by(step) {
                if at == pixels.len() {
                    pixels.push(Vec::new());
                }
                pixels[at].push(Shot { level: *level, seconds: photograph.seconds });
                at += 1;
            }
        }
    }
    Ok(pixels)
}

/// A small grey picture of an exposure, to see whether anything moved.
struct Glance {
    factor: usize,
    width: usize,
    full: usize,
    sums: Vec<f32>,
}

impl Glance {
    fn new(width: usize, height: usize) -> Self {
        let factor = width.div_ceil(GLANCE).max(1);
        let (w, h) = (width / factor, height / factor);
        Self { factor, width: w, full: width, sums: vec![0.0; w * h] }
    }

    fn height(&self) -> usize {
        self.sums.len() / self.width.max(1)
    }

    fn add(&mut self, first: usize, levels: &[[f32; 3]], light: impl Fn(f32) -> f32) {
        let share = 1.0 / (self.factor * self.factor) as f32;
        for (y, row) in levels.chunks_exact(self.full).enumerate() {
            let j = (first + y) / self.factor;
            if j >= self.height() {
                continue;
            }
            for (i, pixels) in row.chunks_exact(self.factor).enumerate() {
                self.sums[j * self.width + i] += share * pixels.iter().map(|p| light(p[1])).sum::<f32>();
            }
        }
    }
}

/// Divides the shape of a flat out, relative to its middle.
fn flatten(image: &mut Image, flat: &Image) -> Result<()> {
    ensure!(
        (flat.width, flat.height) == (image.width, image.height),
        "it is {} x {}, they are {} x {}",
        flat.width,
        flat.height,
        image.width,
        image.height
    );
    let planes = image.channels.len() / 2;
    for c in 0..planes {
        let name = &image.channels[c];
        let from =
            flat.channel(name).or(flat.channel("Y")).with_context(|| format!("it has no channel {name}"))?;
        let stride = flat.channels.len();
        // An eighth of the picture around its middle, without what is masked.
        let reach = Vec2::new(flat.width as f32, flat.height as f32) / 16.0;
        let middle = Vec2::new(flat.width as f32, flat.height as f32) / 2.0;
        let (mut sum, mut count) = (0.0f64, 0usize);
        for y in 0..flat.height {
            for x in 0..flat.width {
                let off = (Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - middle).abs();
                let v = flat.data[(y * flat.width + x) * stride + from];
                if off.cmple(reach.max(Vec2::splat(1.0))).all() && v.is_finite() {
                    sum += f64::from(v);
                    count += 1;
                }
            }
        }
        let mean = (sum / count.max(1) as f64) as f32;
        ensure!(mean > 0.0, "it is black or masked in the middle");
        for (pixel, white) in image.data.chunks_exact_mut(2 * planes).zip(flat.data.chunks_exact(stride)) {
            let v = white[from];
            let gain = if v > 0.0 { mean / v } else { f32::NAN };
            pixel[c] *= gain;
            pixel[planes + c] *= gain;
        }
    }
    Ok(())
}

/// The matrix of a chart, and how well it does.
fn colours(path: &Path) -> Result<(Mat3, f32)> {
    let patches = chart::read(&read_bounded(path, MAX_TEXT)?, path)?;
    let (measured, known): (Vec<[f32; 3]>, Vec<[f32; 3]>) =
        patches.iter().map(|p| (p.measured, p.known)).unzip();
    colour_matrix(&measured, &known)
        .with_context(|| format!("{}: the patches are too much alike to give a matrix", path.display()))
}

/// Turns colours, and their uncertainties as if the channels were independent.
fn turn(image: &mut Image, matrix: Mat3) {
    if image.channels.len() != 6 {
        return;
    }
    let squares = Mat3::from_cols_array(&matrix.to_cols_array().map(|v| v * v));
    for pixel in image.data.chunks_exact_mut(6) {
        let value = matrix * Vec3::from_slice(&pixel[..3]);
        let sigma = Vec3::from_slice(&pixel[3..]);
        pixel[..3].copy_from_slice(&value.to_array());
        let sigma = (squares * (sigma * sigma)).to_array().map(f32::sqrt);
        pixel[3..].copy_from_slice(&sigma);
    }
}
