//! `yugen capture hdr`.

mod bracket;
mod correct;
mod merge;

use crate::{argument, json, progress};
use anyhow::{Context, Result, bail, ensure};
use bracket::{Light, Listed};
use clap::Args;
use correct::{colours, flatten, turn};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{self, NonFinite, ReadOptions, WriteOptions};
use yugen_archive::formats::{exif, response, stack};
use yugen_archive::{Error, atomic_write, check_new, check_outputs, check_writable, make_folder, will_read};
use yugen_capture::hdr::{MOVED, Response, Tally};
use yugen_capture::lens::{Lens, straighten};
use yugen_capture::simulate::Sensor;
use yugen_optics::{ColourSpace, Image, Vec2, Vec3};

/// Merges exposure brackets to linear pictures with their uncertainty.
///
/// `yugen capture hdr IMG_1.jpg IMG_2.jpg IMG_3.jpg -o cloth.exr` merges one bracket. `yugen capture hdr FOLDER -o STACK`
/// merges a bracket a light into a stack folder for `calibrate`, `fit` and `relight`. What FOLDER/stack.toml says of
/// the lights, the response, white and colours is used and, where it is still true, passed on. Which picture belongs to which
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

    /// Replace the pictures and lists of a stack that is there.
    #[arg(long)]
    force: bool,

    /// Times and lights instead of exposures.csv and Exif: columns file, seconds (0.5 or 1/60), light.
    #[arg(long, value_name = "CSV")]
    list: Option<PathBuf>,

    /// How the camera's levels follow light: srgb, linear, recover (found from the brackets themselves), or a table
    /// as --save-response writes it [default: what FOLDER/stack.toml says, else srgb].
    #[arg(long, value_name = "NAME|CSV")]
    response: Option<String>,

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
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_delimiter = ',', value_parser = pixels)]
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

    /// A colour chart: measured and known linear colours of its patches give a 3x3 matrix.
    #[arg(long, value_name = "CSV")]
    chart: Option<PathBuf>,

    /// The space that the colours are in [default: what FOLDER/stack.toml says, else srgb]; with a chart that of its
    /// known colours [default: srgb].
    #[arg(long, value_name = "SPACE", value_parser = ColourSpace::ALL.map(ColourSpace::name))]
    space: Option<String>,

    /// The list of lights, whose names are those of the lights or of their pictures.
    #[arg(long, value_name = "LP")]
    lights: Option<PathBuf>,

    /// Electrons of the sensor at full scale, for the noise.
    #[arg(long, default_value_t = Sensor::default().full_well, value_name = "E")]
    full_well: f32,

    /// Noise of reading in electrons.
    #[arg(long, default_value_t = Sensor::default().read_noise, value_name = "E")]
    read_noise: f32,

    /// Levels from this part of full scale on are saturated [default: what FOLDER/stack.toml says, else 0.99].
    #[arg(long, value_name = "PART")]
    saturated: Option<f32>,

    /// Print the report as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

/// What became of a light.
struct Outcome {
    file: PathBuf,
    tally: Tally,
    moved: Option<f32>,
    white: Option<Vec3>,
}

const MAX_TEXT: u64 = 16 << 20;

/// Of a lens and a picture.
pub const BAD_LENS: &str = "--lens: no lens bends a picture of this size so; check the numbers, the focal length and the \
                            centre are in pixels";

impl Hdr {
    /// Does it.
    pub fn run(self) -> Result<()> {
        ensure!(
            self.full_well > 0.0 && self.full_well.is_finite(),
            "--full-well {}: expected electrons, above 0",
            self.full_well
        );
        ensure!(
            self.read_noise >= 0.0 && self.read_noise.is_finite(),
            "--read-noise {}: expected electrons, 0 or more",
            self.read_noise
        );
        if let Some(part) = self.saturated {
            ensure!((0.1..=1.0).contains(&part), "--saturated {part}: expected a part between 0.1 and 1");
        }
        ensure!(
            self.white_reflectance > 0.0 && self.white_reflectance <= 2.0,
            "--white-reflectance {}: expected a part of the light, above 0 and rarely above 1",
            self.white_reflectance
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
        if let Some(missing) = self.input.iter().find(|p| !p.exists()) {
            return Err(Error::io(missing, std::io::ErrorKind::NotFound.into()).into());
        }
        self.input.iter().for_each(|p| will_read(p));
        let folder = self.input.len() == 1 && self.input[0].is_dir();
        let exr = self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        if !folder {
            ensure!(exr, "{}: one bracket becomes an .exr; name one", self.output.display());
            image::can_write(&self.output)?;
        } else {
            ensure!(
                !exr,
                "{}: a folder becomes a folder, with an .exr for each light; name one",
                self.output.display()
            );
            ensure!(
                !self.output.is_file(),
                "{} is a file; name a folder for the stack",
                self.output.display()
            );
            // What it says of the exposures would be overwritten with what is true of the merged pictures.
            let same =
                self.output.canonicalize().is_ok_and(|o| self.input[0].canonicalize().is_ok_and(|i| i == o));
            ensure!(
                !same,
                "{}: the exposures are here; name another folder for the stack",
                self.output.display()
            );
        }
        let usual = if folder { stack::Options::read(&self.input[0])? } else { stack::Options::default() };
        if let Some(ambient) = &usual.ambient {
            bail!(
                "{}: hdr does not take the ambient picture '{ambient}' off; expose it as long as the others, give it with \
                 --dark and delete the key",
                self.input[0].join(stack::OPTIONS).display()
            );
        }
        let lights = self.photographs(folder)?;
        let listed = self.listed(&lights, folder, &usual)?;
        let space = match &self.space {
            Some(name) => ColourSpace::from_name(name).context("no such colour space")?,
            None => usual.colour_space.filter(|_| self.chart.is_none()).unwrap_or(ColourSpace::LinearSrgb),
        };
        let response = self.response(&lights, usual.response)?;
        let matrix = self.chart.as_ref().map(|path| colours(path)).transpose()?;
        let darks = self.darks()?;
        let saturated = self.saturated.unwrap_or(usual.saturated);

        let mask = if folder { self.mask(&usual) } else { None };
        let file = |light: &Light| match folder {
            true => self.output.join(format!("{}.exr", light.name)),
            false => self.output.clone(),
        };
        for light in &lights {
            light.photographs.iter().for_each(|p| will_read(&p.path));
            self.flat_file(light).iter().for_each(|f| will_read(f));
        }
        mask.iter().for_each(|m| will_read(m));
        let mut stack: Vec<PathBuf> = lights.iter().map(file).collect();
        if folder {
            stack.push(self.output.join(stack::OPTIONS));
            stack.extend(mask.as_ref().map(|_| self.output.join(stack::MASK)));
            stack.extend(listed.as_ref().map(|_| self.output.join(stack::LIGHTS)));
        }
        check_outputs(stack.iter().chain(&self.save_response))?;
        if folder {
            if !self.force {
                check_new(&stack)?;
            }
            make_folder(&self.output)?;
        }
        if let Some(path) = &self.save_response {
            check_writable(path)?;
        }
        let bar = progress::bar(lights.len() as u64, self.json);
        let (mut outcomes, mut size) = (Vec::new(), [0; 2]);
        for light in &lights {
            bar.set_message(light.name.clone());
            let mut merged = self.merge(light, &response, saturated, &darks)?;
            size = [merged.image.width, merged.image.height];
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
                turn(&mut merged.image, matrix)?;
            }
            self.straighten(&mut merged.image)?;
            let options = WriteOptions { non_finite: NonFinite::Keep, ..WriteOptions::from(space) };
            image::write(&file(light), &merged.image, &options)?;
            outcomes.push(Outcome { file: file(light), tally: merged.tally, moved: merged.moved, white });
            bar.inc(1);
        }
        bar.finish_and_clear();
        if folder {
            self.pass_on(&usual, &lights, size, mask.as_deref(), listed.as_ref())?;
        }
        if let Some(path) = &self.save_response {
            let levels: Vec<[f32; 3]> = match &response {
                Response::Table(levels) => levels.clone(),
                other => (0..256).map(|i| [0, 1, 2].map(|c| other.light(c, i as f32 / 255.0))).collect(),
            };
            atomic_write(path, response::write(&levels).as_bytes())?;
        }
        self.report(&lights, &outcomes, matrix.map(|m| m.1), listed.is_some() || !folder);
        Ok(())
    }

    /// How far away the camera stood, as the lens or the Exif data of a photograph tell: the merged pictures have none.
    fn camera_distance(&self, photograph: &Path, [width, height]: [usize; 2]) -> Result<Option<f32>> {
        let (told, source) = match &self.lens {
            Some(lens) => (Some(lens.focal / width as f32), "--lens".to_string()),
            None => {
                let told = exif::read(photograph)?.distance(width, height);
                (told, format!("{}: Exif", photograph.display()))
            }
        };
        Ok(told.and_then(|d| stack::distance_told(d, &source)))
    }

    /// Undoes the lens, if there is one.
    fn straighten(&self, image: &mut Image) -> Result<()> {
        if let Some(lens) = &self.lens {
            ensure!(lens.fits(image.width, image.height), BAD_LENS);
            image.data = straighten(&image.data, image.width, image.height, image.channels.len(), lens);
        }
        Ok(())
    }

    /// The mask of the exposures, if they have one.
    fn mask(&self, usual: &stack::Options) -> Option<PathBuf> {
        let mask = stack::inside(&self.input[0], usual.mask.as_deref().unwrap_or(stack::MASK));
        (usual.mask.is_some() || mask.is_file()).then_some(mask)
    }

    /// Writes the lists of the stack: what the folder of the exposures says and the merge has left true.
    fn pass_on(
        &self,
        usual: &stack::Options,
        lights: &[Light],
        size: [usize; 2],
        mask: Option<&Path>,
        listed: Option<&Listed>,
    ) -> Result<()> {
        if let Some(mask) = mask {
            let mut mask = image::read(mask, &ReadOptions::raw())?;
            self.straighten(&mut mask)?;
            let options = WriteOptions { raw: true, ..WriteOptions::default() };
            image::write(&self.output.join(stack::MASK), &mask, &options)?;
        } else if self.output.join(stack::MASK).is_file() {
            tracing::warn!(
                "{}: this mask was here before and stays; delete it if it is not of these pictures",
                self.output.join(stack::MASK).display()
            );
        }
        let mut options = stack::Options { view: usual.view, ..stack::Options::default() };
        options.camera_distance = match usual.camera_distance {
            // Photographs from the side are straightened: their width is no longer the sensor's.
            None if usual.view == Vec3::Z => self.camera_distance(&lights[0].photographs[0].path, size)?,
            said => said,
        };
        match &self.white[..] {
            [] => (options.white, options.level_white) = (usual.white, usual.level_white),
            _ => options.level_white = !self.white_turns,
        }
        if let Some((entries, intensities)) = listed {
            // Flats for each light have taken away what near lamps do to the brightness across the picture.
            options.near = usual.near && !self.flat.as_ref().is_some_and(|f| f.is_dir());
            options.field_width = usual.field_width;
            // A white reference in every picture has made the lights alike.
            if self.white.is_empty() {
                options.intensities.clone_from(intensities);
            }
            stack::write(&self.output, entries, &options)?;
        } else {
            // The directions are found later, by `calibrate`.
            stack::write_options(&self.output, &options)?;
        }
        Ok(())
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
            json::print(
                json!({ "lights": rows, "colour_error": colour, "has_light_directions": calibrated }),
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
            if let Some(moved) = o.moved.filter(|m| *m > MOVED) {
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
                    ": the noise alone is not to blame; check the response, --full-well and --read-noise"
                }
                v if v < 0.5 => {
                    ": the camera is better than said; --full-well is higher or --read-noise lower"
                }
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

fn pixels(text: &str) -> Result<usize, String> {
    text.trim().parse().map_err(|_| "expected four whole numbers, as in 40,3010,200,200".into())
}

/// A lens as the command line names it.
pub fn lens(text: &str) -> Result<Lens, String> {
    let [focal, x, y, k1, k2, p1, p2, k3] = argument::numbers(text)
        .filter(|n| n[0] > 0.0)
        .ok_or("expected eight numbers: focal length and centre in pixels, k1, k2, p1, p2, k3")?;
    Ok(Lens { focal, centre: Vec2::new(x, y), radial: [k1, k2, k3], tangential: [p1, p2] })
}
