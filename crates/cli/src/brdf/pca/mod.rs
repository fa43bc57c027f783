//! `yugen brdf pca`.

mod directions;
mod plot;

use crate::{argument, json, progress};
use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, Subcommand};
use indicatif::ProgressBar;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::formats::image::{self, NonFinite, ReadOptions};
use yugen_archive::formats::pca_basis::{self, Basis};
use yugen_archive::formats::{merl, readings};
use yugen_archive::{atomic_write, check_outputs, check_writable, list_folder, read_bounded};
use yugen_capture::pca::{self, Observation, RIDGE, Sphere, Tables};
use yugen_optics::{ColourSpace, Vec3};

/// A basis of measured BRDFs, in which a few readings make a whole table (Nielsen, Jensen and Ramamoorthi 2015).
// What a verb is for stands at its arguments.
#[derive(Subcommand)]
pub enum Pca {
    Build(Build),
    Directions(directions::Directions),
    Reconstruct(Reconstruct),
    Plot(plot::Plot),
    Check(Check),
}

/// Makes a basis of all MERL .binary tables of a folder: two passes over the files, a band at a time.
#[derive(Args)]
pub struct Build {
    /// The folder.
    folder: PathBuf,

    /// Where to.
    #[arg(short, long, value_name = "BASIS.pca")]
    output: PathBuf,

    /// Components kept: at least as many as readings will be taken; 4.4 MB each.
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=400))]
    components: u32,

    #[command(flatten)]
    how: How,
}

/// Makes a MERL .binary of a few readings or of photographs of a sphere.
#[derive(Args)]
pub struct Reconstruct {
    /// The basis.
    #[arg(short, long, value_name = "BASIS.pca")]
    basis: PathBuf,

    /// Readings: a line each of wi, wo, r, g, b (f in 1/sr, linear sRGB), as `pca directions` lists them.
    #[arg(long, value_name = "FILE", required_unless_present = "photo", conflicts_with_all = ["photo", "light"])]
    values: Option<PathBuf>,

    /// A linear picture of a sphere of the material, from so far away that all rays are parallel; with one --light
    /// each. NaN marks pixels that are not to be used.
    #[arg(long, value_name = "FILE", requires = "light")]
    photo: Vec<PathBuf>,

    /// Towards the lamp of a photograph, far away; x right, y up, z to the camera.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = argument::direction)]
    light: Vec<Vec3>,

    /// Where the sphere is: centre and radius in pixels from the top left corner [default: fills the picture].
    #[arg(long, value_name = "X,Y,R", value_parser = circle, requires = "photo")]
    sphere: Option<[f32; 3]>,

    /// What a white diffuser that faces the lamp would show.
    #[arg(long, value_name = "V", default_value_t = 1.0)]
    white: f32,

    /// Components [default: as many as readings; all for photographs].
    #[arg(long, value_name = "N")]
    components: Option<usize>,

    /// The ridge that keeps few readings from saying too much.
    #[arg(long, value_name = "ETA", default_value_t = RIDGE)]
    ridge: f64,

    /// Where to.
    #[arg(short, long, value_name = "NAME.binary")]
    output: PathBuf,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

/// Leaves each table of a folder out and reconstructs it by the others.
#[derive(Args)]
pub struct Check {
    /// The folder of MERL .binary tables.
    folder: PathBuf,

    /// Numbers of readings.
    #[arg(short = 'n', long, value_delimiter = ',', value_name = "N,…", default_value = "1,2,5,10,20")]
    counts: Vec<usize>,

    #[command(flatten)]
    how: How,
}

#[derive(Args)]
struct How {
    /// Threads [default: all cores]. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

impl How {
    fn threads(&self) -> usize {
        argument::threads(self.threads)
    }

    fn bar(&self, what: &'static str) -> ProgressBar {
        progress::bar(1000, self.json).with_message(what)
    }
}

/// The MERL tables of a folder, by name.
struct Folder {
    files: Vec<PathBuf>,
    names: Vec<String>,
}

impl Folder {
    fn open(folder: &Path) -> Result<Self> {
        let mut files = list_folder(folder)?;
        files.retain(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("binary")));
        if files.len() < 2 {
            bail!("{}: has {} MERL .binary tables; a basis needs at least 2", folder.display(), files.len());
        }
        let names =
            files.iter().map(|f| f.file_stem().unwrap_or_default().to_string_lossy().into()).collect();
        let folder = Self { files, names };
        // A broken file is named before minutes are spent.
        (0..folder.count()).try_for_each(|m| folder.read(m, 0, &mut [0.0; 3]))?;
        Ok(folder)
    }
}

impl Tables for Folder {
    type Error = yugen_archive::Error;

    fn count(&self) -> usize {
        self.files.len()
    }

    fn read(&self, material: usize, first: usize, rgb: &mut [f32]) -> Result<(), Self::Error> {
        merl::read_bins(&self.files[material], first, rgb)
    }
}

impl Pca {
    /// Does it.
    pub fn run(self) -> Result<()> {
        match self {
            Self::Build(v) => v.run(),
            Self::Directions(v) => v.run(),
            Self::Reconstruct(v) => v.run(),
            Self::Plot(v) => v.run(),
            Self::Check(v) => v.run(),
        }
    }
}

impl Build {
    fn run(self) -> Result<()> {
        let start = Instant::now();
        check_writable(&self.output)?;
        let tables = Folder::open(&self.folder)?;
        check_outputs([&self.output])?;
        let bar = self.how.bar("basis");
        let tell = |x: f64| bar.set_position((1000.0 * x) as u64);
        let basis = pca::build(&tables, &tables.names, self.components as usize, self.how.threads(), &tell)?;
        bar.finish_and_clear();
        let basis = basis.ok_or_else(|| anyhow!("{}: {NO_BASIS}", self.folder.display()))?;
        atomic_write(&self.output, &pca_basis::write(&basis))?;
        let seconds = start.elapsed().as_secs_f64();
        let power = |s: &[f32]| s.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
        let share = power(&basis.singular[..basis.components]) / power(&basis.singular);
        if self.how.json {
            json::print(json!({
                "materials": basis.names, "rows": basis.bins.len(), "components": basis.components,
                "singular": basis.singular, "variance": share, "seconds": seconds,
            }));
        } else {
            println!(
                "{}: {} materials, {} rows, {} components with {:.2} % of the variance, {seconds:.1} s",
                self.output.display(),
                basis.names.len(),
                basis.bins.len(),
                basis.components,
                100.0 * share
            );
        }
        Ok(())
    }
}

const NO_BASIS: &str = "the tables have no bin in common that is measured in all, or do not differ";

fn open(file: &Path) -> Result<Basis> {
    Ok(pca_basis::read(&read_bounded(file, 4 << 30)?, file)?)
}

fn circle(text: &str) -> Result<[f32; 3], String> {
    let circle = argument::numbers(text).filter(|c: &[f32; 3]| c[2] >= 1.0);
    circle.ok_or_else(|| "expected a centre and a radius of at least a pixel, as in 256,256,200".into())
}

impl Reconstruct {
    fn run(self) -> Result<()> {
        if !(self.white > 0.0 && self.white.is_finite()) {
            bail!("--white {}: expected more than zero", self.white);
        }
        if !(self.ridge >= 0.0 && self.ridge.is_finite()) {
            bail!("--ridge {}: expected zero or more", self.ridge);
        }
        if self.photo.len() != self.light.len() {
            bail!(
                "{} photographs and {} lights; each photograph needs its --light",
                self.photo.len(),
                self.light.len()
            );
        }
        if self.output.extension().is_none_or(|e| e != "binary") {
            bail!("{}: expected the name of a .binary", self.output.display());
        }
        check_writable(&self.output)?;
        let basis = open(&self.basis)?;
        let (observations, used) = match &self.values {
            Some(file) => self.readings(&basis, file)?,
            None => self.photographs(&basis)?,
        };
        check_outputs([&self.output])?;
        let most =
            self.values.as_ref().map_or(basis.components, |_| observations.len()).min(basis.components);
        let components = self.components.unwrap_or(most);
        if components == 0 || components > basis.components {
            bail!("--components {components}: the basis has {}", basis.components);
        }
        let values = pca::reconstruct(&basis, &observations, components, self.ridge);
        atomic_write(&self.output, &merl::write(&values, ColourSpace::LinearSrgb))?;
        if self.json {
            json::print(
                json!({ "readings": used, "rows": observations.len(), "components": components, "ridge": self.ridge }),
            );
        } else {
            println!(
                "{}: from {used} {} in {} rows, {components} components",
                self.output.display(),
                if self.values.is_some() { "readings" } else { "pixels" },
                observations.len()
            );
        }
        Ok(())
    }

    fn readings(&self, basis: &Basis, file: &Path) -> Result<(Vec<Observation>, usize)> {
        let lines = readings::read(&read_bounded(file, 1 << 28)?, file)?;
        let mut all = Vec::new();
        for (i, line) in lines.iter().enumerate() {
            let Some(f) = line.f else {
                bail!("{}: reading {} has directions only; expected wi, wo, r, g, b", file.display(), i + 1);
            };
            let above = line.wi.z > 0.0 && line.wo.z > 0.0;
            let row = above.then(|| pca::row_of(basis, pca::bin_of(line.wo, line.wi))).flatten();
            let Some(row) = row else {
                bail!("{}: reading {} lies where the basis knows nothing", file.display(), i + 1);
            };
            all.push(Observation { row, f });
        }
        let used = all.len();
        Ok((all, used))
    }

    fn photographs(&self, basis: &Basis) -> Result<(Vec<Observation>, usize)> {
        let (mut all, mut used) = (Vec::new(), 0);
        for (file, &light) in self.photo.iter().zip(&self.light) {
            let options = ReadOptions {
                space: ColourSpace::LinearSrgb,
                non_finite: NonFinite::Keep,
                ..ReadOptions::default()
            };
            let picture = image::read(file, &options)?;
            let rgb = picture.select(&["R", "G", "B"]).or_else(|| picture.select(&["Y", "Y", "Y"]));
            let rgb = rgb.with_context(|| {
                format!("{}: has channels {}; expected R, G, B", file.display(), picture.channels.join(", "))
            })?;
            let (w, h) = (rgb.width as f32, rgb.height as f32);
            let [x, y, radius] = self.sphere.unwrap_or([0.5 * w, 0.5 * h, 0.5 * w.min(h)]);
            let pixels: Vec<Vec3> = rgb.data.chunks_exact(3).map(Vec3::from_slice).collect();
            let sphere = Sphere {
                pixels: &pixels,
                width: rgb.width,
                centre: (x, y),
                radius,
                light,
                white: self.white,
            };
            let (seen, pixels) = sphere.observations(basis);
            if pixels == 0 {
                bail!(
                    "{}: no pixel of the sphere is lit and seen within 80 degrees; is --sphere or --light wrong?",
                    file.display()
                );
            }
            used += pixels;
            all.extend(seen);
        }
        Ok((all, used))
    }
}

impl Check {
    fn run(self) -> Result<()> {
        let start = Instant::now();
        let tables = Folder::open(&self.folder)?;
        let most = 3 * (tables.count() - 1) - 1;
        if let Some(bad) = self.counts.iter().find(|n| **n == 0 || **n > most) {
            bail!("-n {bad}: with {} tables, expected 1 to {most} readings", tables.count());
        }
        let bar = self.how.bar("leave one out");
        let tell = |x: f64| bar.set_position((1000.0 * x) as u64);
        let found = pca::leave_one_out(&tables, &tables.names, &self.counts, self.how.threads(), &tell)?;
        bar.finish_and_clear();
        let report = found.ok_or_else(|| anyhow!("{}: {NO_BASIS}", self.folder.display()))?;
        let seconds = start.elapsed().as_secs_f64();
        let mut text = format!(
            "{} materials, each reconstructed by the others; {seconds:.1} s\n\n\
             | readings | log rms: median | 90 % | cube root: median | 90 % | worst\n|---:|---:|---:|---:|---:|---\n",
            tables.count()
        );
        let mut rows = Vec::new();
        let counts: Vec<usize> = std::iter::once(0).chain(report.rows.iter().map(Vec::len)).collect();
        for (i, &n) in counts.iter().enumerate() {
            let of: Vec<_> = report.errors.iter().skip(i).step_by(counts.len()).collect();
            let quantile = |q: f64, v: fn(&pca::LeftOut) -> f64| {
                let mut all: Vec<f64> = of.iter().map(|e| v(e)).collect();
                all.sort_by(f64::total_cmp);
                all[((all.len() - 1) as f64 * q).round() as usize]
            };
            let worst =
                of.iter().max_by(|a, b| a.cube_root.total_cmp(&b.cube_root)).map_or(0, |e| e.material);
            let (log, cube) = (|e: &pca::LeftOut| e.log_rms, |e: &pca::LeftOut| e.cube_root);
            let q = [quantile(0.5, log), quantile(0.9, log), quantile(0.5, cube), quantile(0.9, cube)];
            let _ = writeln!(
                text,
                "| {n} | {:.4} | {:.4} | {:.5} | {:.5} | {}",
                q[0], q[1], q[2], q[3], tables.names[worst]
            );
            rows.push(json!({
                "readings": n, "log_rms_median": q[0], "log_rms_90": q[1], "cube_root_median": q[2],
                "cube_root_90": q[3], "worst": tables.names[worst],
                "directions": i.checked_sub(1).map(|i| directions::listed(&report.basis, &report.rows[i])),
                "materials": of.iter().map(|e| json!({
                    "name": tables.names[e.material], "log_rms": e.log_rms, "cube_root": e.cube_root,
                })).collect::<Vec<_>>(),
            }));
        }
        if self.how.json {
            json::print(json!({ "seconds": seconds, "rows": rows }));
        } else {
            print!("{text}");
        }
        Ok(())
    }
}
