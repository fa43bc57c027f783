//! `yugen brdf plot`.

mod albedo;
mod cartesian;
mod lobe;
mod plane;
mod polar;
pub mod slice;
pub mod sphere;
mod term;

use super::subject::{Model, Settings};
use crate::figure::Colour;
use crate::figure::scale::Scale;
use crate::{argument, progress};
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use term::Term;
use yugen_archive::{atomic_write, check_outputs, check_writable};
use yugen_optics::tonemap::{Curve, ToneMap};
use yugen_optics::{ColourSpace, Vec3};

/// Pictures of one model or several, as SVG or PNG: curves, lobes, lit spheres, Rusinkiewicz slices, albedo against
/// angle, and the terms D, G and F.
///
/// `yugen brdf plot ward -o ward.svg`; several models with their own parameters, forms and names:
/// `yugen brdf plot lambert ward:alpha=0.1/0.3 ggx:alpha=0.2,label=GGX --kind cartesian -o three.png`. A value with
/// slashes stands for several models, and `form=all` for every form.
#[derive(Args)]
pub struct Plot {
    /// Models, as `yugen brdf list` names them, each perhaps with MODEL:NAME=VALUE,… (parameters, preset, data and
    /// label); or measured files: MERL .binary, RGL or Zemax .bsdf, WINDOW .xml, ALTA
    /// .brdf, .astm, UTIA .bin, goniometer .gonio.
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<String>,

    #[command(flatten)]
    settings: Settings,

    /// What to draw.
    #[arg(long, value_enum, default_value = "polar")]
    kind: Kind,

    /// Where to: NAME.svg or NAME.png.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Angles of incidence in degrees, separated by commas [default: 15,45,75 for one model, 45 for several].
    #[arg(long, alias = "theta-i", value_name = "DEG,…", value_delimiter = ',')]
    angle: Vec<f32>,

    /// Azimuth of the plane of incidence from the tangent, degrees.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    phi: f32,

    /// The quantity of polar, cartesian and lobe.
    #[arg(long, value_enum, default_value = "f-cos")]
    value: Value,

    /// How values become lengths or brightness [default: linear; cbrt for slice].
    #[arg(long, value_enum)]
    scale: Option<Scale>,

    /// Each curve over its own peak, to compare shapes (polar, cartesian, d).
    #[arg(long)]
    relative: bool,

    /// Width in pixels, of the picture within an SVG too [default: 720; 400 for a sphere, 960 for slices].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(64..=4096))]
    size: Option<u32>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// The lobe in the plane of incidence, as lengths in all directions.
    Polar,
    /// The same over a straight axis.
    Cartesian,
    /// The lobe in three dimensions.
    Lobe,
    /// A sphere under a lamp and a soft sky.
    Sphere,
    /// Rusinkiewicz slice: half angle across, difference angle up, phi_d = 90 degrees.
    Slice,
    /// Directional albedo against angle.
    Albedo,
    /// D of microfacet models, against the angle of the half vector.
    D,
    /// G of microfacet models, against the angle of the eye.
    G,
    /// F of microfacet models, against the angle of incidence.
    F,
}

impl Kind {
    fn has_angles(self) -> bool {
        matches!(self, Self::Polar | Self::Cartesian | Self::Lobe | Self::G)
    }
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

/// A model with what it is called in the figure.
pub struct Shown {
    name: String,
    model: Model,
}

/// What all kinds of figure need.
struct Scene {
    /// One or more.
    shown: Vec<Shown>,
    space: ColourSpace,
    /// Radians.
    theta_i: Vec<f32>,
    /// Radians.
    phi: f32,
    value: Value,
    scale: Scale,
    relative: bool,
    size: u32,
}

impl Scene {
    fn value(&self, shown: &Shown, wo: Vec3, wi: Vec3) -> Vec3 {
        let f = shown.model.bsdf().eval(wo, wi);
        if self.value == Value::FCos { f * wi.z.abs() } else { f }
    }

    /// Whether light goes through one of the models.
    fn transmits(&self) -> bool {
        self.shown.iter().any(|s| s.model.bsdf().laws().transmits)
    }

    /// The name of a model that stands alone; those of several are in the legend.
    fn titles(&self) -> Vec<String> {
        match &self.shown[..] {
            [one] => vec![one.name.clone()],
            _ => Vec::new(),
        }
    }

    /// The heading of a figure of values.
    fn heading(&self, channels: bool) -> Vec<String> {
        let of = if channels { "red, green, blue" } else { "luminance" };
        let unit = if self.relative { " over its peak" } else { ", 1/sr" };
        let light = match self.theta_i[..] {
            [theta] if self.shown.len() > 1 => {
                format!("; light at {}°", crate::figure::scale::digits(theta.to_degrees()))
            }
            _ => String::new(),
        };
        let mut lines = self.titles();
        lines.push(format!("{}{unit}, {of}; {}{light}", self.value.name(), self.scale.name()));
        lines
    }

    /// Linear colour of the model's space as a display shows it, cut off at one.
    fn display(&self, rgb: Vec3) -> Colour {
        bytes(ToneMap::new(self.space, 0.0, Curve::Clip).show(rgb))
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
        if let Some(bad) = self.angle.iter().find(|t| !(0.0..90.0).contains(*t)) {
            bail!("--angle {bad}: expected 0 to less than 90 degrees");
        }
        if !self.angle.is_empty() && !self.kind.has_angles() {
            bail!("--angle is for --kind polar, cartesian, lobe and g");
        }
        if self.relative && !matches!(self.kind, Kind::Polar | Kind::Cartesian | Kind::D) {
            bail!("--relative is for --kind polar, cartesian and d");
        }
        if !self.phi.is_finite() {
            bail!("--phi {}: expected degrees", self.phi);
        }
        check_writable(&self.output)?;
        let mut shown = Vec::new();
        for model in &self.models {
            for named in self.settings.expand(model)? {
                shown.push(Shown { name: named.label.clone(), model: named.build()? });
            }
        }
        check_outputs([&self.output])?;
        let defaults: &[f32] = match self.kind {
            Kind::Polar | Kind::Cartesian if shown.len() == 1 => &[15.0, 45.0, 75.0],
            _ => &[45.0],
        };
        let theta_i = if self.angle.is_empty() { defaults } else { &self.angle };
        if self.kind == Kind::Lobe && theta_i.len() * shown.len() > 1 {
            bail!(
                "a lobe in three dimensions has one model and one angle of incidence; --kind polar shows several"
            );
        }
        let flat = matches!(self.kind, Kind::Polar | Kind::Cartesian | Kind::Lobe | Kind::Slice);
        if let Some(mirror) = shown.iter().find(|s| flat && s.model.bsdf().laws().delta) {
            bail!(
                "{} goes on in single directions only (Dirac peaks), which have no lobe to draw; try --kind sphere or \
                 --kind albedo",
                mirror.model.kind.name()
            );
        }
        let single = shown.len() == 1;
        let size = self.size.unwrap_or(match self.kind {
            Kind::Sphere if single => 400,
            Kind::Slice if !single => 960,
            _ => 720,
        });
        let scene = Scene {
            space: self.settings.space(),
            theta_i: theta_i.iter().map(|t| t.to_radians()).collect(),
            phi: self.phi.to_radians(),
            value: self.value,
            scale: self.scale.unwrap_or(if self.kind == Kind::Slice { Scale::Cbrt } else { Scale::Linear }),
            relative: self.relative,
            // Of several spheres each has its share of the width.
            size: if self.kind == Kind::Sphere { size / shown.len().clamp(1, 4) as u32 } else { size }
                .max(16),
            shown,
        };
        let figure = match self.kind {
            Kind::Polar => polar::draw(&scene)?,
            Kind::Cartesian => cartesian::draw(&scene)?,
            Kind::Lobe => lobe::draw(&scene, &scene.shown[0])?,
            Kind::Sphere => sphere::draw(&scene)?,
            Kind::Slice => slice::draw(&scene)?,
            Kind::Albedo => albedo::draw(&scene)?,
            Kind::D => term::draw(&scene, Term::D)?,
            Kind::G => term::draw(&scene, Term::G)?,
            Kind::F => term::draw(&scene, Term::F)?,
        };
        let bytes = if extension == "svg" { figure.svg()?.into_bytes() } else { figure.png(size)? };
        Ok(atomic_write(&self.output, &bytes)?)
    }
}

/// Calls `work` with 0, 1, … `n − 1` on all cores; results in order. A bar shows where it takes long.
fn parallel<T: Send>(n: usize, what: &'static str, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let bar = progress::bar(n as u64, false).with_message(what);
    let all = yugen_optics::parallel::parallel(argument::threads(None), n, work, &|done| {
        bar.set_position(done as u64)
    });
    bar.finish_and_clear();
    all
}
