//! `yugen capture simulate`.

use super::cloth::{Sample, Weaving, folder};
use super::traced::Tracer;
use super::weave::{heights, picture};
use crate::{argument, json, progress};
use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::formats::image::{self, NonFinite, WriteOptions};
use yugen_archive::formats::{btf, lp, readings, stack};
use yugen_archive::{atomic_write, check_new, check_outputs, read_bounded};
use yugen_capture::simulate::{Camera, Sensor, Subject, fibonacci_dome};
use yugen_capture::{Eye, Lights};
use yugen_optics::Vec3;
use yugen_optics::frame::spherical;
use yugen_reflectance::{Choice, Kind, ParamType};

/// Photographs a cloth whose truth is known, as a machine with lights on all sides would.
///
/// Writes a stack folder that `yugen capture` reads: a linear picture (EXR) a light, lights.lp, and beside them the
/// truth: truth.exr with the maps, height.exr. With --exposures more than one: a bracket of PNGs a light, whose
/// numbers are linear, and exposures.csv with file, light and seconds. Without any option about the sensor the
/// pictures are perfect.
#[derive(Args)]
pub struct Simulate {
    /// A preset (karaori, kinran), a named weave (plain, satin:8/3), a draft (.wif) or maps (.btf, .exr).
    cloth: String,

    #[command(flatten)]
    weaving: Weaving,

    /// Heights that go with maps, in widths of a texel.
    #[arg(long, value_name = "FILE")]
    heights: Option<PathBuf>,

    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// Replace what is in the folder.
    #[arg(long)]
    force: bool,

    /// So many lights, spread evenly over a dome.
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    lights: u32,

    /// The polar angle that the dome reaches down to, degrees.
    #[arg(long, value_name = "DEG", default_value_t = 75.0, value_parser = parse_polar)]
    max_polar: f32,

    /// The lights of this list instead of a dome.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["lights", "max_polar"])]
    lp: Option<PathBuf>,

    /// Pairs of light and eye instead: lines of six numbers, toward the light and toward the eye, +x right, +y up, +z to
    /// the camera. Every eye gets a stack.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["lights", "max_polar", "lp", "view"])]
    pairs: Option<PathBuf>,

    /// Lamps this many widths of the picture from its centre, instead of light from far away; with --lp the list
    /// gives directions.
    #[arg(long, value_name = "D", value_parser = parse_distance)]
    near: Option<f32>,

    /// Where the camera stands: polar angle and azimuth in degrees. Given more than once, every view gets a stack in a
    /// folder of its own [default: 0,0].
    #[arg(long, value_name = "POLAR,AZIMUTH", allow_hyphen_values = true, value_parser = parse_view)]
    view: Vec<[f32; 2]>,

    /// How far the camera stands from the middle of the picture, in widths of it (focal length over width of the sensor),
    /// instead of far away.
    #[arg(long, value_name = "D", conflicts_with = "pairs", value_parser = parse_camera_distance)]
    camera_distance: Option<f32>,

    /// How the maps reflect: a form of the model `noh`.
    #[arg(long, value_name = "FORM", default_value = "ward_gmd", value_parser = forms())]
    form: String,

    /// Threads cast shadows and hide what lies behind them.
    #[arg(long)]
    shadows: bool,

    /// Follow light with the reference renderer, this many paths a texel: shadows, and light that bounces between
    /// threads.
    #[arg(long, value_name = "PATHS", conflicts_with = "shadows", num_args = 0..=1, default_missing_value = "64", value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    trace: Option<u32>,

    /// Exposures of each picture, the longest first.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=16))]
    exposures: u32,

    /// Stops from an exposure to the next.
    #[arg(long, value_name = "STOPS", default_value_t = 3.0, value_parser = parse_stops)]
    stops: f32,

    /// The reflectance factor that fills the sensor in the longest exposure [default: 64 for one, 2 for several].
    #[arg(long, value_name = "FACTOR", value_parser = argument::positive)]
    white: Option<f32>,

    /// Electrons that a pixel holds: photons come at random; 0 for a sensor without noise [default: 50000].
    #[arg(long, value_name = "ELECTRONS", value_parser = parse_at_least_zero)]
    full_well: Option<f32>,

    /// Standard deviation of what reading a pixel adds, in electrons [default: 3].
    #[arg(long, value_name = "ELECTRONS", value_parser = parse_at_least_zero)]
    read_noise: Option<f32>,

    /// Steps of the sensor's numbers: 2 to this power [default: 16].
    #[arg(long, value_name = "BITS", value_parser = parse_bits)]
    bits: Option<u32>,

    /// Standard deviation of the lens's blur in texels.
    #[arg(long, value_name = "TEXELS", default_value_t = 0.0, value_parser = argument::blur)]
    blur: f32,

    /// Part of the light that the corners lose; a picture of a white surface, flat.exr, is written as well.
    #[arg(long, value_name = "PART", default_value_t = 0.0, value_parser = parse_part)]
    vignetting: f32,

    /// Print what was done as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

/// What was written, counted.
#[derive(Default)]
struct Counts {
    pictures: usize,
    files: usize,
    samples: u64,
    saturated: u64,
    hidden: u64,
}

impl Simulate {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let started = Instant::now();
        let sample = self.weaving.sample(&self.cloth, self.heights.as_deref())?;
        if self.shadows && sample.heights.is_none() {
            bail!("--shadows needs heights, which maps do not hold; name them with --heights");
        }
        let form = choice(&self.form);
        let stacks = self.stacks()?;
        let camera = self.camera();

        let outputs = self.outputs(&stacks, &camera, sample.heights.is_some());
        check_outputs(&outputs)?;
        if !self.force {
            // A mask that is there would be taken for one of these pictures.
            let masks = (0..stacks.len()).map(|v| self.place(v, stacks.len()).join(stack::MASK));
            check_new(outputs.into_iter().chain(masks))?;
        }
        folder(&self.output)?;
        let about = btf::About {
            form: self.form.clone(),
            texel_mm: sample.texel_mm,
            source: format!("truth; {}", sample.source),
            ..btf::About::default()
        };
        btf::save(&self.output.join("truth.exr"), &sample.btf, &about)?;
        heights(&self.output.join("height.exr"), &sample)?;

        let shadowing = sample.heights.as_deref().filter(|_| self.shadows);
        let subject = Subject::new(&sample.btf, shadowing, form)?;
        let mut tracer = match self.trace {
            Some(n) => Some(Tracer::new(&sample.btf, sample.heights.as_deref(), &self.form, n)?),
            None => None,
        };
        let pictures = stacks.iter().map(|(_, lights)| lights.len() as u64).sum();
        let bar = progress::bar(pictures, self.json);
        let mut counts = Counts::default();
        let mut index = String::from("folder,polar,azimuth,x,y,z\n");
        for (v, (eye, lights)) in stacks.iter().enumerate() {
            let (name, view) = (view_name(v), eye.toward);
            let (polar, azimuth) = (view.z.clamp(-1.0, 1.0).acos(), view.y.atan2(view.x));
            writeln!(
                index,
                "{name},{:.3},{:.3},{},{},{}",
                polar.to_degrees(),
                azimuth.to_degrees(),
                view.x,
                view.y,
                view.z
            )?;
            let place = self.place(v, stacks.len());
            folder(&place)?;
            let mut times = String::from("file,light,seconds\n");
            for light in 0..lights.len() {
                let ideal = match &mut tracer {
                    // One seed a picture, or their noise would be the same.
                    Some(tracer) => {
                        let seed = self.weaving.seed.wrapping_add(counts.pictures as u32);
                        tracer.picture(lights, light, *eye, seed)?
                    }
                    None => subject.picture(lights, light, *eye),
                };
                counts.hidden += ideal.iter().filter(|p| p.is_nan()).count() as u64;
                let seen = camera.look(&ideal, sample.btf.width);
                self.write(&place, &sample, &camera, &seen, light, &mut times, &mut counts)?;
                bar.inc(1);
            }
            self.finish(&place, &sample, &camera, lights, *eye, &times)?;
        }
        if stacks.len() > 1 {
            atomic_write(&self.output.join("views.csv"), index.as_bytes())?;
        }
        bar.finish_and_clear();
        self.report(&sample, &counts, stacks.len(), started)
    }

    /// The folder of a stack.
    fn place(&self, view: usize, views: usize) -> PathBuf {
        if views == 1 { self.output.clone() } else { self.output.join(view_name(view)) }
    }

    /// Every file that will be written.
    fn outputs(&self, stacks: &[(Eye, Lights)], camera: &Camera, heights: bool) -> Vec<PathBuf> {
        let brackets = camera.sensor.as_ref().map_or(1, |s| s.seconds.len());
        let mut all = vec![self.output.join("truth.exr")];
        all.extend(heights.then(|| self.output.join("height.exr")));
        all.extend((stacks.len() > 1).then(|| self.output.join("views.csv")));
        for (v, (_, lights)) in stacks.iter().enumerate() {
            let place = self.place(v, stacks.len());
            let mut names = vec![stack::LIGHTS.to_string(), stack::OPTIONS.to_string()];
            for light in 0..lights.len() {
                match brackets {
                    1 => names.push(merged(light)),
                    n => names.extend((0..n).map(|i| exposure_name(light, i))),
                }
            }
            names.extend((brackets > 1).then(|| "exposures.csv".to_string()));
            names.extend((self.vignetting > 0.0).then(|| "flat.exr".to_string()));
            all.extend(names.iter().map(|n| place.join(n)));
        }
        all
    }

    fn camera(&self) -> Camera {
        let usual = Sensor::default();
        let real = self.exposures > 1
            || self.white.is_some()
            || self.full_well.is_some()
            || self.read_noise.is_some()
            || self.bits.is_some();
        let white = self.white.unwrap_or(if self.exposures > 1 { 2.0 } else { usual.white });
        let sensor = Sensor {
            // White fills it in one second, so that light per second is the reflectance factor.
            white: 1.0,
            seconds: (0..self.exposures).map(|i| (-self.stops * i as f32).exp2() / white).collect(),
            full_well: match self.full_well {
                Some(0.0) => f32::INFINITY,
                given => given.unwrap_or(usual.full_well),
            },
            read_noise: self.read_noise.unwrap_or(usual.read_noise),
            bits: self.bits.or(usual.bits),
            seed: self.weaving.seed,
        };
        Camera { blur: self.blur, vignetting: self.vignetting, sensor: real.then_some(sensor) }
    }

    /// Where the camera stands, and the lights it sees the sample under from there.
    fn stacks(&self) -> Result<Vec<(Eye, Lights)>> {
        let lamps = |toward: Vec<Vec3>| match self.near {
            None => Lights::Distant(toward),
            Some(distance) => Lights::Near(toward.into_iter().map(|d| d * distance).collect()),
        };
        if let Some(path) = &self.pairs {
            let mut stacks: Vec<(Vec3, Vec<Vec3>)> = Vec::new();
            for (i, line) in readings::read(&read_bounded(path, 256 << 20)?, path)?.iter().enumerate() {
                for (direction, what) in [(line.wi, "light"), (line.wo, "eye")] {
                    if direction.z <= 0.0 {
                        bail!("{}: the {what} of pair {} is not above the sample", path.display(), i + 1);
                    }
                }
                match stacks.iter_mut().find(|(view, _)| *view == line.wo) {
                    Some((_, lights)) => lights.push(line.wi),
                    None => stacks.push((line.wo, vec![line.wi])),
                }
            }
            return Ok(stacks.into_iter().map(|(view, lights)| (view.into(), lamps(lights))).collect());
        }
        let toward: Vec<Vec3> = match &self.lp {
            None => fibonacci_dome(self.lights as usize, self.max_polar.to_radians()),
            Some(path) => {
                let list = lp::read(&read_bounded(path, 16 << 20)?, path, lp::Axes::default())?;
                list.iter().map(|e| e.light.normalize()).collect()
            }
        };
        if toward.is_empty() {
            bail!("the list has no light");
        }
        let lights = lamps(toward);
        let views = if self.view.is_empty() { &[[0.0, 0.0]][..] } else { &self.view };
        let distance = self.camera_distance.unwrap_or(f32::INFINITY);
        let eye = |[polar, azimuth]: &[f32; 2]| Eye {
            toward: spherical(polar.to_radians(), azimuth.to_radians()),
            distance,
        };
        Ok(views.iter().map(|angles| (eye(angles), lights.clone())).collect())
    }

    /// The files of one picture.
    fn write(
        &self,
        place: &Path,
        sample: &Sample,
        camera: &Camera,
        seen: &[Vec3],
        light: usize,
        times: &mut String,
        counts: &mut Counts,
    ) -> Result<()> {
        let width = sample.btf.width;
        let options =
            WriteOptions { non_finite: NonFinite::Keep, ..WriteOptions::from(sample.btf.colour_space) };
        // Numbered through all stacks: the noise of no two pictures is the same.
        let bracket = camera.bracket(seen, counts.pictures);
        counts.pictures += 1;
        counts.samples += (3 * seen.len() * bracket.len()) as u64;
        if let Some(sensor) = &camera.sensor {
            let full = |p: &Vec3| p.to_array().iter().filter(|v| **v >= 1.0).count() as u64;
            counts.saturated += bracket.iter().flatten().map(full).sum::<u64>();
            if bracket.len() > 1 {
                // Twelve bits lie in sixteen.
                let bits = if self.bits == Some(8) { 8 } else { 16 };
                let options = WriteOptions { raw: true, bits, non_finite: NonFinite::Replace, ..options };
                for (i, (exposure, seconds)) in bracket.iter().zip(&sensor.seconds).enumerate() {
                    let name = exposure_name(light, i);
                    let seen: Vec<Vec3> =
                        exposure.iter().map(|v| if v.is_nan() { Vec3::ZERO } else { *v }).collect();
                    image::write(&place.join(&name), &picture(width, &seen), &options)?;
                    writeln!(times, "{name},{:04},{seconds}", light + 1)?;
                    counts.files += 1;
                }
                return Ok(());
            }
        }
        counts.files += 1;
        let developed = camera.develop(&bracket);
        Ok(image::write(&place.join(merged(light)), &picture(width, &developed), &options)?)
    }

    /// The lists of a stack, and the white surface.
    fn finish(
        &self,
        place: &Path,
        sample: &Sample,
        camera: &Camera,
        lights: &Lights,
        eye: Eye,
        times: &str,
    ) -> Result<()> {
        let (Lights::Distant(all) | Lights::Near(all)) = lights;
        let entries: Vec<lp::Entry> =
            all.iter().enumerate().map(|(i, light)| lp::Entry { file: merged(i), light: *light }).collect();
        let bracketed = camera.sensor.as_ref().filter(|s| s.seconds.len() > 1);
        let options = stack::Options {
            near: matches!(lights, Lights::Near(_)),
            view: eye.toward,
            camera_distance: self.camera_distance,
            response: if bracketed.is_some() { stack::Response::Linear } else { stack::Response::Srgb },
            // EXR says so itself.
            colour_space: bracketed.map(|_| sample.btf.colour_space),
            ..stack::Options::default()
        };
        stack::write(place, &entries, &options)?;
        if bracketed.is_some() {
            atomic_write(&place.join("exposures.csv"), times.as_bytes())?;
        }
        if self.vignetting > 0.0 {
            let white = camera.look(&vec![Vec3::ONE; sample.btf.texels.len()], sample.btf.width);
            let options = WriteOptions::from(sample.btf.colour_space);
            image::write(&place.join("flat.exr"), &picture(sample.btf.width, &white), &options)?;
        }
        Ok(())
    }

    fn report(&self, sample: &Sample, counts: &Counts, views: usize, started: Instant) -> Result<()> {
        let seconds = started.elapsed().as_secs_f64();
        let saturated = counts.saturated as f64 / counts.samples.max(1) as f64;
        if self.json {
            let report = json!({
                "output": self.output.display().to_string(),
                "width": sample.btf.width,
                "height": sample.btf.height,
                "texel_mm": sample.texel_mm,
                "views": views,
                "pictures": counts.pictures,
                "files": counts.files,
                "saturated": saturated,
                "hidden": counts.hidden,
                "seconds": seconds,
            });
            json::print(report);
            return Ok(());
        }
        let views = if views > 1 { format!(" from {views} sides") } else { String::new() };
        println!(
            "{} pictures of {} x {} texels{views} in {} files, {:.2} % of the samples saturated, in {seconds:.1} s",
            counts.pictures,
            sample.btf.width,
            sample.btf.height,
            counts.files,
            100.0 * saturated
        );
        println!("written to {}", self.output.display());
        Ok(())
    }
}

/// The name of a picture that all exposures become.
fn merged(light: usize) -> String {
    format!("{:04}.exr", light + 1)
}

/// The name of one of several exposures.
fn exposure_name(light: usize, i: usize) -> String {
    format!("{:04}_{}.png", light + 1, i + 1)
}

/// The name of the folder of a view.
fn view_name(view: usize) -> String {
    format!("view_{:02}", view + 1)
}

/// The forms of the model.
fn forms() -> Vec<&'static str> {
    let form = Kind::Noh.params().iter().find(|p| p.name == "form");
    match form.map(|p| p.kind) {
        Some(ParamType::Choice(names)) => names.to_vec(),
        _ => Vec::new(),
    }
}

fn choice(form: &str) -> Choice {
    Choice(forms().iter().position(|f| *f == form).unwrap_or_default() as f32)
}

fn number(text: &str, expected: &str, ok: impl Fn(f32) -> bool) -> Result<f32, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|v: &f32| v.is_finite() && ok(*v))
        .ok_or_else(|| format!("expected {expected}"))
}

fn parse_polar(text: &str) -> Result<f32, String> {
    number(text, "degrees above 0 and below 90", |v| v > 0.0 && v < 90.0)
}

fn parse_camera_distance(text: &str) -> Result<f32, String> {
    number(text, "a distance from 0.2 to 1000000 widths of the picture", |v| stack::DISTANCES.contains(&v))
}

fn parse_distance(text: &str) -> Result<f32, String> {
    number(text, "a distance from 0.1 to 1000 widths of the picture", |v| (0.1..=1000.0).contains(&v))
}

fn parse_stops(text: &str) -> Result<f32, String> {
    number(text, "stops from 0.1 to 10", |v| (0.1..=10.0).contains(&v))
}

fn parse_at_least_zero(text: &str) -> Result<f32, String> {
    number(text, "a number, zero or more", |v| v >= 0.0)
}

fn parse_part(text: &str) -> Result<f32, String> {
    number(text, "a part from 0 to 1", |v| (0.0..=1.0).contains(&v))
}

fn parse_bits(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|b| [8, 12, 16].contains(b)).ok_or_else(|| "expected 8, 12 or 16".into())
}

fn parse_view(text: &str) -> Result<[f32; 2], String> {
    argument::numbers(text)
        .filter(|[polar, _]| (0.0..90.0).contains(polar))
        .ok_or_else(|| "expected polar,azimuth in degrees, the polar angle below 90, as in 30,120".into())
}
