//! `yugen brdf fit`.

use super::plot::sphere;
use super::subject::{Model, find};
use crate::figure::{Anchor, Figure};
use crate::{argument, json, progress};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::formats::{instrument, measured, readings};
use yugen_archive::{Error, atomic_write, check_outputs, make_folder, read_filled, will_read};
use yugen_capture::brdf_fit::{self, Fit as Found, Lobe, Models, Options, Reading, Readings, unfit};
use yugen_optics::random::Pcg32;
use yugen_optics::{ColourSpace, Vec2};
use yugen_reflectance::{Bsdf, Kind, ParamType};

/// Finds the parameters with which models come nearest to a measured BRDF, and ranks the models.
///
/// `yugen brdf fit gold.binary --ground -o report` is the common case.
///
/// Every named form of each model is tried from many starts (Levenberg-Marquardt within the parameters' ranges), so
/// that the table says what a model can do. For isotropic data, models are fitted without a grain.
#[derive(Args)]
pub struct Fit {
    /// What was measured: MERL .binary, RGL or Zemax .bsdf, WINDOW .xml, ALTA .brdf, .astm, UTIA .bin, goniometer
    /// .gonio, or .csv of lines `wi wo r g b [weight]`. Several are fitted one after the other, and the models ranked
    /// over all.
    #[arg(required = true, value_name = "DATA")]
    data: Vec<PathBuf>,

    /// A model, as `yugen brdf list` names it, or `all` that can be fitted. May be repeated. What cannot be round, as
    /// the threads of `microcylinder`, is tried on isotropic data only if it is named.
    #[arg(short, long, default_value = "all")]
    model: Vec<String>,

    /// Lobes of the same model that are added up.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=2))]
    lobes: u8,

    /// Puts a Lambertian ground under models that have none of their own, so that bare highlights compare fairly.
    #[arg(long)]
    ground: bool,

    /// What is made small and ranked by.
    #[arg(long, value_enum, default_value = "cube-root")]
    metric: Metric,

    /// Points at which tables are read: even in the root of theta_h, in sin² theta_d, and around, each with the weight
    /// of both solid angles. Of the readings of an instrument so many are drawn.
    #[arg(long, default_value_t = 2048, value_name = "N", value_parser = clap::value_parser!(u32).range(64..=1_000_000))]
    samples: u32,

    /// How far from the normal both directions may be, degrees: beyond 80, cameras saw little but noise.
    #[arg(long, default_value_t = 80.0, value_name = "DEG")]
    max_angle: f32,

    /// Starts for each form of a model.
    #[arg(long, default_value_t = 12, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    starts: u32,

    /// Says that the material of single readings looks the same however it is turned; tables tell by themselves.
    #[arg(long)]
    isotropic: bool,

    /// The linear RGB space in which the models are fitted: that in which they will be rendered.
    #[arg(long, default_value = "rec2020", value_parser = ColourSpace::ALL.map(ColourSpace::name), value_name = "SPACE")]
    space: String,

    /// Threads [default: all cores]. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// A folder for the report: the ranking (report.md, report.json), a material for scene files for each model
    /// (MODEL.toml), data and best fits on a lit sphere (spheres.png).
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Fits beside the data in spheres.png; 0 for no picture.
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=40))]
    spheres: u32,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Metric {
    /// The root of the mean of |f cos - g cos|^(2/3): ground and highlight both count.
    CubeRoot,
    /// The mean of |ln(1 + f cos) - ln(1 + g cos)|: bright highlights count more.
    Log,
}

impl Metric {
    fn name(self) -> &'static str {
        match self {
            Self::CubeRoot => "cube root",
            Self::Log => "log",
        }
    }
}

impl From<Metric> for brdf_fit::Metric {
    fn from(m: Metric) -> Self {
        match m {
            Metric::CubeRoot => Self::CubeRoot,
            Metric::Log => Self::Log,
        }
    }
}

/// One material.
struct Measured {
    name: String,
    readings: Readings,
    /// Unless there are only single readings.
    table: Option<Model>,
}

impl Fit {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if !(10.0..=90.0).contains(&self.max_angle) {
            bail!("--max-angle {}: expected 10 to 90 degrees", self.max_angle);
        }
        let all = self.model.iter().any(|m| m == "all");
        let kinds: Vec<Kind> = if all {
            Kind::ALL.iter().copied().filter(|k| unfit(*k).is_none()).collect()
        } else {
            self.model.iter().map(|m| find(m)).collect::<Result<_>>()?
        };
        for kind in &kinds {
            if let Some(why) = unfit(*kind) {
                bail!("{} cannot be fitted: {why}", kind.name());
            }
        }
        // Before the work rather than after it.
        for file in &self.data {
            if !is_list(file) && instrument::format_of(file).is_none() {
                kind_of(file)?;
            }
            if !file.exists() {
                return Err(Error::io(file, std::io::ErrorKind::NotFound.into()).into());
            }
            will_read(file);
        }
        if let Some(folder) = &self.output {
            check_outputs(self.outputs(folder, &kinds))?;
            make_folder(folder)?;
        }
        let threads = argument::threads(self.threads);
        let options = Options {
            metric: self.metric.into(),
            lobes: usize::from(self.lobes),
            starts: self.starts as usize,
            threads,
        };
        let bar = progress::bar(1000, self.json);
        let tell = |x: f64| bar.set_position((1000.0 * x) as u64);
        // Round and brushed materials are offered different models.
        let mut ready: [Option<Models>; 2] = [None, None];
        let mut results: Vec<(String, Vec<Found>)> = Vec::new();
        let mut reports = Vec::new();
        for file in &self.data {
            let start = Instant::now();
            let measured = self.load(file)?;
            let isotropic = measured.readings.isotropic;
            let models = ready[usize::from(isotropic)].get_or_insert_with(|| {
                bar.reset();
                bar.set_message("models");
                let mut m = Models::new(&kinds, isotropic, self.space(), self.ground, threads, &tell);
                if all {
                    m.drop_grain();
                }
                m
            });
            bar.reset();
            bar.set_message(measured.name.clone());
            let fits = brdf_fit::fit(&measured.readings, models, &options, &tell);
            if fits.is_empty() {
                bail!("{}: none of the models can be fitted", file.display());
            }
            let seconds = start.elapsed().as_secs_f64();
            let report = self.report(file, &measured, &fits, seconds);
            let table = self.table(&measured, &fits, seconds);
            if !self.json {
                bar.suspend(|| println!("{table}"));
            }
            if let Some(folder) = &self.output {
                self.write(&self.folder_of(folder, file), &measured, &fits, &table, &report)?;
            }
            reports.push(report);
            results.push((measured.name, fits));
        }
        bar.finish_and_clear();
        let over_all = (results.len() > 1).then(|| self.ranking(&results));
        if let (Some(folder), Some((text, ranking))) = (&self.output, &over_all) {
            atomic_write(&folder.join("report.md"), text.as_bytes())?;
            atomic_write(&folder.join("report.json"), json::text(ranking.clone()).as_bytes())?;
        }
        match over_all {
            Some((_, ranking)) if self.json => {
                json::print(json!({ "materials": reports, "models": ranking }));
            }
            Some((text, _)) => print!("{text}"),
            None if self.json => json::print(reports.swap_remove(0)),
            None => {}
        }
        Ok(())
    }

    fn space(&self) -> ColourSpace {
        ColourSpace::from_name(&self.space).unwrap_or_default()
    }

    /// Where the report of a material goes.
    fn folder_of(&self, output: &Path, file: &Path) -> PathBuf {
        if self.data.len() > 1 { output.join(name(file)) } else { output.to_path_buf() }
    }

    /// Every file that may be written.
    fn outputs(&self, folder: &Path, kinds: &[Kind]) -> Vec<PathBuf> {
        let mut names: Vec<String> = ["report.md", "report.json", "spheres.png"].map(String::from).to_vec();
        let over_all = if self.data.len() > 1 { names[..2].to_vec() } else { Vec::new() };
        let mut materials: Vec<&str> = kinds.iter().map(|k| k.name()).collect();
        materials.sort_unstable();
        materials.dedup();
        names.extend(materials.iter().map(|m| format!("{m}.toml")));
        let each = self.data.iter().map(|file| self.folder_of(folder, file));
        let each = each.flat_map(|f| names.iter().map(move |n| f.join(n)).collect::<Vec<_>>());
        over_all.iter().map(|n| folder.join(n)).chain(each).collect()
    }

    fn load(&self, file: &Path) -> Result<Measured> {
        let name = name(file);
        let lowest = self.max_angle.to_radians().cos();
        if instrument::format_of(file).is_some() {
            return self.load_instrument(file);
        }
        if !is_list(file) {
            let kind = kind_of(file)?;
            let data = measured::read(file, kind, self.space())?;
            let slots = kind.defaults();
            let table = Model { kind, table: kind.bake(&slots, &data)?, slots };
            let readings =
                Readings::of(&table.bsdf(), self.samples as usize, self.max_angle.to_radians(), self.space());
            if readings.all.is_empty() {
                bail!("{}: has no finite value within {} degrees", file.display(), self.max_angle);
            }
            return Ok(Measured { name, readings, table: Some(table) });
        }
        let lines = readings::read(&read_filled(file, 1 << 30)?, file)?;
        let to_space = ColourSpace::LinearSrgb.matrix_to(self.space());
        let total = lines.len();
        let all: Vec<Reading> = lines
            .into_iter()
            .filter(|l| l.wi.z > lowest.max(1e-4) && l.wo.z > lowest.max(1e-4) && l.weight > 0.0)
            .map(|l| l.f.map(|f| Reading { wo: l.wo, wi: l.wi, f: to_space * f, weight: l.weight }))
            .collect::<Option<_>>()
            .with_context(|| {
                format!("{}: some lines have directions only; expected wi, wo, r, g, b", file.display())
            })?;
        if all.len() < 8 {
            bail!(
                "{}: {} of {total} readings lie within {} degrees of the normal; expected at least 8",
                file.display(),
                all.len(),
                self.max_angle
            );
        }
        let readings = Readings { all, isotropic: self.isotropic, space: self.space() };
        Ok(Measured { name, readings, table: None })
    }

    /// What an instrument wrote: its readings themselves, not the table between them.
    fn load_instrument(&self, file: &Path) -> Result<Measured> {
        let measurement = instrument::load(file, self.space())?;
        let lowest = self.max_angle.to_radians().cos();
        let mut all: Vec<Reading> = measurement
            .readings
            .iter()
            .filter(|r| r.wi.z > lowest && r.wo.z > lowest)
            .map(|r| Reading { wo: r.wo, wi: r.wi, f: r.f, weight: r.weight })
            .collect();
        if all.len() < 8 {
            bail!(
                "{}: {} of {} readings lie within {} degrees of the normal; expected at least 8",
                file.display(),
                all.len(),
                measurement.readings.len(),
                self.max_angle
            );
        }
        // Any of them, without putting back.
        let mut rng = Pcg32::new(5, 3);
        let count = (self.samples as usize).min(all.len());
        for i in 0..count {
            let rest = all.len() - i;
            let k = i + ((u64::from(rng.next_u32()) * rest as u64) >> 32) as usize;
            all.swap(i, k);
        }
        all.truncate(count);
        // Only the picture of spheres needs it.
        let table = match self.output.is_some() && self.spheres > 0 {
            true => {
                let kind = Kind::Tabulated;
                let slots = kind.defaults();
                Some(Model { kind, table: kind.bake(&slots, &measurement.table().to_data())?, slots })
            }
            false => None,
        };
        let readings =
            Readings { all, isotropic: measurement.isotropic || self.isotropic, space: self.space() };
        Ok(Measured { name: name(file), readings, table })
    }

    fn report(&self, file: &Path, measured: &Measured, fits: &[Found], seconds: f64) -> serde_json::Value {
        json!({
            "data": file.display().to_string(), "readings": measured.readings.all.len(),
            "isotropic": measured.readings.isotropic, "space": self.space, "metric": self.metric.name(),
            "max_angle": self.max_angle, "seconds": seconds,
            "fits": fits.iter().map(|f| json!({
                "model": f.model.name(), "free": f.free, "cube_root": f.cube_root, "log": f.log,
                "lobes": f.lobes.iter().map(describe).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
        })
    }

    /// The ranking of one material, as Markdown that reads as plain text too.
    fn table(&self, measured: &Measured, fits: &[Found], seconds: f64) -> String {
        let mut out = format!(
            "{}: {} readings, {}, within {} degrees; ranked by the {} metric; {seconds:.1} s\n\n\
             | {:>4} | {:26} | {:>4} | {:>9} | {:>9} | parameters\n|-----:|----------------------------|-----:|----------:|----------:|---\n",
            measured.name,
            measured.readings.all.len(),
            if measured.readings.isotropic { "isotropic" } else { "with a grain" },
            self.max_angle,
            self.metric.name(),
            "rank",
            "model",
            "free",
            "cube root",
            "log",
        );
        for (i, f) in fits.iter().enumerate() {
            let lobes: Vec<String> = f.lobes.iter().map(brief).collect();
            let _ = writeln!(
                out,
                "| {:4} | {:26} | {:4} | {:9.5} | {:9.6} | {}",
                i + 1,
                title(f),
                f.free,
                f.cube_root,
                f.log,
                lobes.join(" + ")
            );
        }
        out
    }

    /// The ranking over several materials.
    fn ranking(&self, results: &[(String, Vec<Found>)]) -> (String, serde_json::Value) {
        struct Row {
            name: String,
            errors: Vec<f64>,
            log: Vec<f64>,
            ranks: usize,
            first: usize,
        }
        let mut rows: Vec<Row> = Vec::new();
        for (_, fits) in results {
            for (rank, f) in fits.iter().enumerate() {
                let name = f.model.name();
                let at = rows.iter().position(|r| r.name == name).unwrap_or_else(|| {
                    rows.push(Row { name: name.into(), errors: vec![], log: vec![], ranks: 0, first: 0 });
                    rows.len() - 1
                });
                rows[at].errors.push(f.cube_root);
                rows[at].log.push(f.log);
                rows[at].ranks += rank + 1;
                rows[at].first += usize::from(rank == 0);
            }
        }
        let quantile = |v: &[f64], q: f64| {
            let mut v = v.to_vec();
            v.sort_by(f64::total_cmp);
            v[((v.len() - 1) as f64 * q).round() as usize]
        };
        let mean_rank = |r: &Row| r.ranks as f64 / r.errors.len() as f64;
        rows.sort_by(|a, b| mean_rank(a).total_cmp(&mean_rank(b)));
        let mut text = format!(
            "{} materials, ranked by the {} metric\n\n| {:26} | mean rank | best of | cube root: median | 90 % | log: median | 90 % |\n\
             |----------------------------|---:|---:|---:|---:|---:|---:|\n",
            results.len(),
            self.metric.name(),
            "model"
        );
        let mut all = Vec::new();
        for r in &rows {
            let q = [
                quantile(&r.errors, 0.5),
                quantile(&r.errors, 0.9),
                quantile(&r.log, 0.5),
                quantile(&r.log, 0.9),
            ];
            let _ = writeln!(
                text,
                "| {:26} | {:5.2} | {:3} | {:.5} | {:.5} | {:.6} | {:.6} |",
                r.name,
                mean_rank(r),
                r.first,
                q[0],
                q[1],
                q[2],
                q[3]
            );
            all.push(json!({
                "model": r.name, "materials": r.errors.len(), "mean_rank": mean_rank(r), "first": r.first,
                "cube_root_median": q[0], "cube_root_90": q[1], "log_median": q[2], "log_90": q[3],
            }));
        }
        (text, json!(all))
    }

    fn write(
        &self,
        folder: &Path,
        measured: &Measured,
        fits: &[Found],
        table: &str,
        report: &serde_json::Value,
    ) -> Result<()> {
        make_folder(folder)?;
        atomic_write(&folder.join("report.md"), table.as_bytes())?;
        atomic_write(&folder.join("report.json"), json::text(report.clone()).as_bytes())?;
        for f in fits {
            let path = folder.join(format!("{}.toml", f.model.name()));
            atomic_write(&path, self.material(&measured.name, f).as_bytes())?;
        }
        if self.spheres > 0 {
            let picture = self.picture(measured, &fits[..fits.len().min(self.spheres as usize)])?;
            atomic_write(&folder.join("spheres.png"), &picture)?;
        }
        Ok(())
    }

    /// A fit as materials of a scene file.
    fn material(&self, name: &str, fit: &Found) -> String {
        let name: String = name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
            .collect::<String>()
            .to_lowercase();
        let mut out = format!(
            "# Fitted by yugen brdf fit: cube root error {:.5}, log error {:.6}\n",
            fit.cube_root, fit.log
        );
        let part = |i: usize| if fit.lobes.len() == 1 { name.clone() } else { format!("{name}_{}", i + 1) };
        for (i, lobe) in fit.lobes.iter().enumerate() {
            let _ = write!(out, "[material.{}]\nmodel = \"{}\"\n", part(i), lobe.kind.name());
            for (param, value) in values(lobe) {
                let value = match (param.kind, value) {
                    (ParamType::Choice(names), v) => format!("\"{}\"", names[v[0] as usize]),
                    (ParamType::Rgb, v) => {
                        format!("{{ rgb = [{}, {}, {}], space = \"{}\" }}", v[0], v[1], v[2], self.space)
                    }
                    (ParamType::Number, v) => v[0].to_string(),
                };
                let _ = writeln!(out, "{} = {value}", param.name);
            }
            out.push('\n');
        }
        if fit.lobes.len() > 1 {
            let parts: Vec<String> = (0..fit.lobes.len()).map(|i| format!("\"{}\"", part(i))).collect();
            let _ = write!(out, "[material.{name}]\nsum = [{}]\n", parts.join(", "));
        }
        out
    }

    /// The data and the best fits side by side.
    fn picture(&self, measured: &Measured, fits: &[Found]) -> Result<Vec<u8>> {
        const SIDE: f32 = 220.0;
        let mut cells: Vec<(String, Vec<[u8; 3]>)> = Vec::new();
        let mut shown = |title: String, lobes: Vec<Bsdf>| {
            cells.push((title, sphere::pixels(&sphere::Sum(lobes), self.space(), SIDE as u32)));
        };
        if let Some(table) = &measured.table {
            shown(measured.name.clone(), vec![table.bsdf()]);
        }
        for f in fits {
            let tables: Vec<Vec<f32>> =
                f.lobes.iter().map(|l| l.kind.bake(&l.slots, &[])).collect::<Result<_, _>>()?;
            let lobes = f.lobes.iter().zip(&tables).map(|(l, t)| Bsdf::new(l.kind, &l.slots, t)).collect();
            shown(format!("{}\n{:.4}", title(f), f.error(self.metric.into())), lobes);
        }
        let across = cells.len().min(6);
        let down = cells.len().div_ceil(across);
        let (width, row) = (SIDE * across as f32, SIDE + 40.0);
        let mut figure = Figure::new(width, row * down as f32);
        for (i, (label, pixels)) in cells.iter().enumerate() {
            let at = Vec2::new(SIDE * (i % across) as f32, row * (i / across) as f32);
            figure.picture(at, Vec2::splat(SIDE), SIDE as u32, pixels)?;
            for (k, line) in label.lines().enumerate() {
                let y = at.y + SIDE + 15.0 + 17.0 * k as f32;
                figure.text(at.x + 0.5 * SIDE, y, Anchor::Middle, line.chars().take(27).collect::<String>());
            }
        }
        figure.png(width as u32)
    }
}

/// Whether a file lists single readings.
fn is_list(file: &Path) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv") || e.eq_ignore_ascii_case("txt"))
}

/// The model of a table.
fn kind_of(file: &Path) -> Result<Kind> {
    measured::kind(file).context("expected .binary, .bsdf, .gonio, a file of an instrument (.xml, .brdf, .astm, .bin), or .csv of single readings")
}

/// What a material is called.
fn name(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The terms of a fit in a word or two.
fn title(fit: &Found) -> String {
    let own = fit.lobes.iter().filter(|l| l.kind == fit.model).count();
    let times = if own > 1 { "2 x " } else { "" };
    let ground = if fit.lobes.len() > own { " + lambert" } else { "" };
    format!("{times}{}{ground}", fit.model.name())
}

/// Parameters with their slots.
fn values(lobe: &Lobe) -> Vec<(&'static yugen_reflectance::Param, &[f32])> {
    let mut at = 0;
    let slots = lobe.kind.params().iter().map(|p| {
        at += p.width();
        (p, &lobe.slots[at - p.width()..at])
    });
    slots.collect()
}

fn brief(lobe: &Lobe) -> String {
    let words: Vec<String> = values(lobe)
        .iter()
        .map(|(p, v)| match p.kind {
            ParamType::Choice(names) => names[v[0] as usize].to_string(),
            ParamType::Rgb => format!("{} {:.3} {:.3} {:.3}", p.name, v[0], v[1], v[2]),
            ParamType::Number => format!("{} {:.4}", p.name, v[0]),
        })
        .collect();
    words.join(", ")
}

fn describe(lobe: &Lobe) -> serde_json::Value {
    let params: serde_json::Map<String, serde_json::Value> = values(lobe)
        .iter()
        .map(|(p, v)| {
            let value = match p.kind {
                ParamType::Choice(names) => json!(names[v[0] as usize]),
                ParamType::Rgb => json!(v),
                ParamType::Number => json!(v[0]),
            };
            (p.name.to_string(), value)
        })
        .collect();
    json!({ "model": lobe.kind.name(), "parameters": params })
}
