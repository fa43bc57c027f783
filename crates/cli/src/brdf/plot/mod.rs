//! `yugen brdf plot`.

mod albedo;
mod lobe;
mod polar;
mod scale;
mod slice;
pub mod sphere;

use super::subject::{Model, Subject};
use crate::figure::Colour;
use crate::{argument, progress};
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use scale::Scale;
use std::path::PathBuf;
use yugen_archive::{atomic_write, check_outputs, check_writable};
use yugen_optics::tonemap::{Curve, Display};
use yugen_optics::{ColourSpace, Vec3};

/// Pictures of a model, as SVG or PNG: lobes, a lit sphere, a Rusinkiewicz slice, albedo against angle.
#[derive(Args)]
pub struct Plot {
    #[command(flatten)]
    subject: Subject,

    /// What to draw.
    #[arg(long, value_enum, default_value = "polar")]
    kind: Kind,

    /// Where to: NAME.svg or NAME.png.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Angles of incidence in degrees, separated by commas [default: 15,45,75 for polar, 45 for lobe].
    #[arg(long, value_name = "DEG,…", value_delimiter = ',')]
    theta_i: Vec<f32>,

    /// Azimuth of the plane of incidence from the tangent, degrees (polar, lobe, albedo).
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    phi: f32,

    /// The quantity of polar and lobe.
    #[arg(long, value_enum, default_value = "f-cos")]
    value: Value,

    /// How values become lengths or brightness [default: linear; cbrt for slice].
    #[arg(long, value_enum)]
    scale: Option<Scale>,

    /// Width in pixels, of the picture within an SVG too [default: 720; 400 for sphere].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(64..=4096))]
    size: Option<u32>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// The lobe in the plane of incidence, for one or more angles.
    Polar,
    /// The lobe in three dimensions.
    Lobe,
    /// A sphere under a lamp and a soft sky.
    Sphere,
    /// Rusinkiewicz slice: half angle across, difference angle up, phi_d = 90 degrees.
    Slice,
    /// Directional albedo against angle.
    Albedo,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Value {
    /// f, 1/sr.
    F,
    /// f cos theta_i: radiance seen under unit irradiance on a plane that faces the light.
    FCos,
}

impl Value {
    fn name(self) -> &'static str {
        match self {
            Self::F => "f",
            Self::FCos => "f cos theta_i",
        }
    }
}

/// What all kinds of figure need.
struct Scene<'a> {
    model: &'a Model,
    space: ColourSpace,
    /// Model, preset and parameters as the person named them.
    title: String,
    /// Radians.
    theta_i: Vec<f32>,
    /// Radians.
    phi: f32,
    value: Value,
    scale: Scale,
    size: u32,
}

impl Scene<'_> {
    fn value(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let f = self.model.bsdf().eval(wo, wi);
        if self.value == Value::FCos { f * wi.z.abs() } else { f }
    }

    /// Linear colour of the model's space as a display shows it, cut off at one.
    fn display(&self, rgb: Vec3) -> Colour {
        bytes(Display::new(self.space, 0.0, Curve::Clip).show(rgb))
    }

    /// Whether the channels differ.
    fn coloured(rgb: Vec3) -> bool {
        rgb.max_element() - rgb.min_element() > 1e-3 * rgb.max_element()
    }
}

fn bytes(rgb: Vec3) -> Colour {
    rgb.to_array().map(|v| (255.0 * v).round() as u8)
}

impl Plot {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let extension = self.output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if !["svg", "png"].contains(&extension.as_str()) {
            bail!("{}: expected the name of an .svg or a .png", self.output.display());
        }
        if let Some(bad) = self.theta_i.iter().find(|t| !(0.0..90.0).contains(*t)) {
            bail!("--theta-i {bad}: expected 0 to less than 90 degrees");
        }
        if !self.theta_i.is_empty() && !matches!(self.kind, Kind::Polar | Kind::Lobe) {
            bail!("--theta-i is for --kind polar and --kind lobe");
        }
        if !self.phi.is_finite() {
            bail!("--phi {}: expected degrees", self.phi);
        }
        let defaults: &[f32] = match self.kind {
            Kind::Polar => &[15.0, 45.0, 75.0],
            _ => &[45.0],
        };
        let theta_i = if self.theta_i.is_empty() { defaults } else { &self.theta_i };
        if self.kind == Kind::Lobe && theta_i.len() > 1 {
            bail!("a lobe in three dimensions has one angle of incidence; --kind polar shows several");
        }
        check_writable(&self.output)?;
        let model = self.subject.build()?;
        check_outputs([&self.output])?;
        if model.bsdf().laws().delta && matches!(self.kind, Kind::Polar | Kind::Lobe | Kind::Slice) {
            bail!(
                "{} goes on in single directions only (Dirac peaks), which have no lobe to draw; try --kind sphere or \
                 --kind albedo",
                model.kind.name()
            );
        }
        let size = self.size.unwrap_or(if self.kind == Kind::Sphere { 400 } else { 720 });
        let scene = Scene {
            model: &model,
            space: self.subject.space(),
            title: self.subject.title(),
            theta_i: theta_i.iter().map(|t| t.to_radians()).collect(),
            phi: self.phi.to_radians(),
            value: self.value,
            scale: self.scale.unwrap_or(if self.kind == Kind::Slice { Scale::Cbrt } else { Scale::Linear }),
            size,
        };
        let figure = match self.kind {
            Kind::Polar => polar::draw(&scene)?,
            Kind::Lobe => lobe::draw(&scene)?,
            Kind::Sphere => sphere::draw(&scene)?,
            Kind::Slice => slice::draw(&scene)?,
            Kind::Albedo => albedo::draw(&scene)?,
        };
        let bytes = if extension == "svg" { figure.svg()?.into_bytes() } else { figure.png(size)? };
        Ok(atomic_write(&self.output, &bytes)?)
    }
}

/// Calls `work` with 0, 1, … `n − 1` on all cores; results in order. A bar shows where it takes long.
fn parallel<T: Send>(n: usize, what: &'static str, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let bar = progress::bar(n as u64, false).with_message(what);
    let all = yugen_capture::parallel::parallel(argument::threads(None), n, work, &|done| {
        bar.set_position(done as u64)
    });
    bar.finish_and_clear();
    all
}
