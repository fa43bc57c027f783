//! `yugen brdf pca plot`.

use super::{Folder, open};
use crate::brdf::plot::{slice, sphere};
use crate::figure::chart::{Across, Chart};
use crate::figure::colours::two_sided;
use crate::figure::curve::{Curve, Look};
use crate::figure::scale::{Scale, digits};
use crate::figure::{Anchor, Colour, Figure, INK, RULE, text_width};
use crate::progress;
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use std::f32::consts::FRAC_PI_2;
use std::path::PathBuf;
use yugen_archive::formats::merl;
use yugen_archive::formats::pca_basis::Basis;
use yugen_archive::{atomic_write, check_outputs, check_writable};
use yugen_capture::pca;
use yugen_optics::{ColourSpace, Vec2};
use yugen_reflectance::importance::from_rusinkiewicz;
use yugen_reflectance::merl::VALUES;
use yugen_reflectance::{Bsdf, Kind as Model};

/// Pictures of a basis, as SVG or PNG: what its components are, how much each counts, where tables lie in it.
///
/// `yugen brdf pca plot -b merl.pca --kind bases -o bases.png`
#[derive(Args)]
pub struct Plot {
    /// The basis.
    #[arg(short, long, value_name = "BASIS.pca")]
    basis: PathBuf,

    /// What to draw.
    #[arg(long, value_enum, default_value = "bases")]
    kind: Kind,

    /// Where to: NAME.svg or NAME.png.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Components shown by bases and spheres [default: 6 slices, 3 rows of spheres].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=24))]
    components: Option<u32>,

    /// The two components of coefficients.
    #[arg(long, value_name = "I,J", value_delimiter = ',', num_args = 1, default_values_t = [1, 2])]
    axes: Vec<usize>,

    /// The folder of MERL .binary tables whose coefficients are shown.
    #[arg(long, value_name = "FOLDER")]
    tables: Option<PathBuf>,

    /// Width in pixels.
    #[arg(long, value_name = "N", default_value_t = 960, value_parser = clap::value_parser!(u32).range(64..=4096))]
    size: u32,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Each component as a Rusinkiewicz slice: by what it changes the logarithm of f cos cos.
    Bases,
    /// Spheres of the mean and of two standard deviations of each component to either side.
    Spheres,
    /// The share of the variance that each component has, and all up to it.
    Spectrum,
    /// The tables of a folder as small spheres where their coefficients lie.
    Coefficients,
}

/// Pixels a side of the spheres of a sheet, and of those among coefficients.
const SIDES: (u32, u32) = (220, 64);

impl Plot {
    pub fn run(self) -> Result<()> {
        let extension = self.output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if !["svg", "png"].contains(&extension.as_str()) {
            bail!("{}: expected the name of an .svg or a .png", self.output.display());
        }
        check_writable(&self.output)?;
        let basis = open(&self.basis)?;
        check_outputs([&self.output])?;
        let count = |default: usize| self.components.map_or(default.min(basis.components), |n| n as usize);
        if count(1) > basis.components {
            bail!("--components {}: the basis has {}", count(1), basis.components);
        }
        let figure = match self.kind {
            Kind::Bases => bases(&basis, count(6), self.size)?,
            Kind::Spheres => spheres(&basis, count(3))?,
            Kind::Spectrum => spectrum(&basis),
            Kind::Coefficients => {
                let folder = self.tables.as_deref().context("--kind coefficients needs --tables FOLDER")?;
                let [x, y] = self.axes[..] else { bail!("--axes: expected two numbers, as in 1,2") };
                if let Some(bad) = [x, y].into_iter().find(|i| !(1..=basis.components).contains(i)) {
                    bail!("--axes {x},{y}: {bad} is none of the components 1 to {}", basis.components);
                }
                coefficients(&basis, &Folder::open(folder)?, [x - 1, y - 1])?
            }
        };
        let bytes = if extension == "svg" { figure.svg()?.into_bytes() } else { figure.png(self.size)? };
        Ok(atomic_write(&self.output, &bytes)?)
    }
}

/// Standard deviation, over the columns of the tables, of a coefficient of any component.
fn deviation(basis: &Basis) -> f64 {
    1.0 / (3.0 * basis.names.len() as f64).sqrt()
}

/// The variance of each component over that of all.
fn shares(basis: &Basis) -> Vec<f64> {
    let squares = basis.singular.iter().map(|s| f64::from(*s).powi(2));
    let all: f64 = squares.clone().sum();
    squares.map(|s| s / all).collect()
}

fn share(basis: &Basis, k: usize) -> String {
    format!("{} %", digits(100.0 * shares(basis)[k] as f32))
}

fn bases(basis: &Basis, count: usize, size: u32) -> Result<Figure> {
    let cells = (size / 4).max(64) as usize;
    let deviation = deviation(basis) as f32;
    let rows: Vec<Option<usize>> = (0..cells * cells)
        .map(|i| {
            let (theta_h, theta_d) = slice::angles(i % cells, i / cells, cells);
            let (wo, wi) = from_rusinkiewicz(theta_h, theta_d, FRAC_PI_2);
            let above = wo.z > 0.0 && wi.z > 0.0;
            above.then(|| pca::row_of(basis, pca::bin_of(wo, wi))).flatten()
        })
        .collect();
    let value = |row: usize, k: usize| deviation * basis.q[row * basis.components + k];
    let mut sorted: Vec<f32> =
        rows.iter().flatten().flat_map(|&row| (0..count).map(move |k| value(row, k).abs())).collect();
    sorted.sort_by(f32::total_cmp);
    // A few values at the rim of a slice would take all colour from the rest.
    let top = sorted.get(sorted.len() * 98 / 100).copied().filter(|v| *v > 0.0).context("an empty basis")?;
    let panels: Vec<_> = (0..count)
        .map(|k| slice::Panel {
            name: format!("component {}: {}", k + 1, share(basis, k)),
            // Where there is nothing, grey.
            pixels: rows.iter().map(|r| r.map_or([128; 3], |r| two_sided(value(r, k) / top))).collect(),
        })
        .collect();
    let ticks = [-1.0f32, -0.5, 0.0, 0.5, 1.0].map(|t| (t * top, 0.5 + 0.5 * t)).to_vec();
    let heading = vec![
        format!("principal components of {} tables, with their shares of the variance", basis.names.len()),
        "what one standard deviation adds to ln(f cos cos), at phi_d = 90°".into(),
    ];
    let key =
        slice::Key { colour: &|t| two_sided(2.0 * t - 1.0), ticks, label: "added to the logarithm".into() };
    slice::sheet(&heading, &panels, cells, &key)
}

/// A sphere of a table in linear sRGB.
fn ball(values: &[f32], size: u32) -> Result<Vec<Colour>> {
    let slots = Model::Merl.defaults();
    let table = Model::Merl.bake(&slots, values)?;
    let lobes = sphere::Sum(vec![Bsdf::new(Model::Merl, &slots, &table)]);
    Ok(sphere::pixels(&lobes, ColourSpace::LinearSrgb, size))
}

fn spheres(basis: &Basis, count: usize) -> Result<Figure> {
    let mut pictures = Vec::new();
    let mean = ball(&pca::expand(basis, &std::array::from_fn(|_| vec![0.0; count])), SIDES.0)?;
    for k in 0..count {
        for sign in [-2.0, 0.0, 2.0] {
            if sign == 0.0 {
                pictures.push(("mean".to_string(), mean.clone()));
                continue;
            }
            let mut coefficients = vec![0.0; k + 1];
            coefficients[k] = sign * deviation(basis);
            let table = pca::expand(basis, &std::array::from_fn(|_| coefficients.clone()));
            let name = format!("component {}, {sign:+} deviations", k + 1);
            pictures.push((name, ball(&table, SIDES.0)?));
        }
    }
    sphere::sheet(&pictures, SIDES.0, 3)
}

fn spectrum(basis: &Basis) -> Figure {
    let shares = shares(basis);
    // Those without which a thousandth would be missing, and a few more.
    let mut left = 1.0;
    let needed = shares.iter().take_while(|s| {
        left -= **s;
        left > 1e-3
    });
    let count = (needed.count() + 4).min(shares.len()).max(2);
    let mut sum = 0.0;
    let together = shares[..count].iter().enumerate().map(|(i, s)| {
        sum += s;
        ((i + 1) as f32, 100.0 * sum as f32)
    });
    let together: Vec<_> = together.collect();
    let each = shares[..count].iter().enumerate().map(|(i, s)| ((i + 1) as f32, 100.0 * *s as f32)).collect();
    let curve = |name: &str, i, points| Curve { name: name.into(), look: Look::nth(i), points, peak: None };
    let curves = [
        curve("of the components up to this one together", 0, together),
        curve("of this component", 1, each),
    ];
    let chart = Chart {
        heading: vec![format!("principal components of {} tables: share of the variance", basis.names.len())],
        across: Across {
            label: "component".into(),
            low: 1.0,
            high: count as f32,
            step: [1.0, 2.0, 5.0].into_iter().find(|s| count as f32 / s <= 15.0).unwrap_or(10.0),
            unit: "",
        },
        upwards: "share, %".into(),
        scale: Scale::Linear,
        top: 104.0,
        marks: Vec::new(),
        posts: Vec::new(),
    };
    chart.draw(&curves)
}

fn coefficients(basis: &Basis, folder: &Folder, axes: [usize; 2]) -> Result<Figure> {
    const SIDE: f32 = 760.0;
    const LEFT: f32 = 80.0;
    const BALL: f32 = 46.0;
    let bar = progress::bar(folder.files.len() as u64, false).with_message("tables");
    let mut values = vec![0.0; VALUES];
    let mut found = Vec::new();
    for (file, name) in folder.files.iter().zip(&folder.names) {
        merl::read_bins(file, 0, &mut values)?;
        let c = pca::coefficients(basis, &values);
        // The mean of the three channels, in standard deviations of the tables of the basis.
        let at = axes.map(|k| (c.iter().map(|c| c[k]).sum::<f64>() / 3.0 / deviation(basis)) as f32);
        found.push((name, Vec2::from_array(at), ball(&values, SIDES.1)?));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let low = found.iter().fold(Vec2::splat(f32::MAX), |a, f| a.min(f.1));
    let high = found.iter().fold(Vec2::splat(f32::MIN), |a, f| a.max(f.1));
    let span = (high - low).max(Vec2::splat(1e-3)) * 1.16;
    let middle = 0.5 * (low + high);

    let corner = Vec2::new(LEFT, 66.0);
    let mut figure = Figure::new(LEFT + SIDE + 30.0, corner.y + SIDE + 66.0);
    let what = format!("{} tables in a basis of {}, in standard deviations", found.len(), basis.names.len());
    figure.heading(&[&what]);
    let place = |v: Vec2| {
        let t = (v - middle) / span;
        corner + SIDE * Vec2::new(0.5 + t.x, 0.5 - t.y)
    };
    for axis in 0..2 {
        let unit = [0.5, 1.0, 2.0, 5.0].into_iter().find(|s| span[axis] / s <= 9.0).unwrap_or(10.0);
        let (first, last) = ((middle - 0.5 * span)[axis] / unit, (middle + 0.5 * span)[axis] / unit);
        for v in (first.ceil() as i32..=last.floor() as i32).map(|i| i as f32 * unit) {
            let p = place(if axis == 0 { Vec2::new(v, middle.y) } else { Vec2::new(middle.x, v) });
            let width = if v == 0.0 { 1.6 } else { 0.8 };
            if axis == 0 {
                figure.line(vec![Vec2::new(p.x, corner.y), Vec2::new(p.x, corner.y + SIDE)], RULE, width);
                figure.text(p.x, corner.y + SIDE + 20.0, Anchor::Middle, digits(v));
            } else {
                figure.line(vec![Vec2::new(corner.x, p.y), Vec2::new(corner.x + SIDE, p.y)], RULE, width);
                figure.text(corner.x - 8.0, p.y + 5.0, Anchor::End, digits(v));
            }
        }
    }
    let box_of = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y, Vec2::ZERO].map(|c| corner + SIDE * c);
    figure.line(box_of.to_vec(), INK, 1.0);
    let label = |k: usize| format!("component {}, {} of the variance", k + 1, share(basis, k));
    figure.text(corner.x + 0.5 * SIDE, corner.y + SIDE + 46.0, Anchor::Middle, label(axes[0]));
    figure.upwards(22.0, corner.y + 0.5 * SIDE, label(axes[1]));
    for (_, at, pixels) in &found {
        figure.disc(place(*at) - 0.5 * BALL, BALL, SIDES.1, pixels)?;
    }
    // Names where they cover neither a sphere nor another name.
    let half = Vec2::splat(0.42 * BALL);
    let mut taken: Vec<(Vec2, Vec2)> = found.iter().map(|f| (place(f.1) - half, place(f.1) + half)).collect();
    for (name, at, _) in &found {
        let (p, width) = (place(*at) + Vec2::new(0.0, 0.5 * BALL + 11.0), text_width(name));
        let (low, high) = (p + Vec2::new(-0.5 * width, -11.0), p + Vec2::new(0.5 * width, 3.0));
        let inside = low.cmpge(corner).all() && high.cmple(corner + SIDE).all();
        if inside && !taken.iter().any(|(a, b)| a.cmplt(high).all() && low.cmplt(*b).all()) {
            figure.text(p.x, p.y, Anchor::Middle, name.as_str());
            taken.push((low, high));
        }
    }
    Ok(figure)
}
