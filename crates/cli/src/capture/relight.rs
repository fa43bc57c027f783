//! `yugen capture relight`: photographs, RTI files and fitted cloth under new light.

mod holdout;

use super::stack::Source;
use crate::{argument, json, progress};
use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::check_outputs;
use yugen_archive::formats::relightable::{Basis, Colouring, DEFAULT_MAX_TEXELS};
use yugen_archive::formats::relit_contents::Contents;
use yugen_archive::formats::relit_files;
use yugen_archive::formats::{btf, image};
use yugen_capture::rti::Encoding;
use yugen_capture::rti::fit::{Options, choose_ridge, fit};
use yugen_capture::rti::holdout::Method;
use yugen_capture::rti::light::{self, Lamp};
use yugen_capture::rti::mixed;
use yugen_capture::rti::rbf::{Kernel, Rbf};
use yugen_optics::{ColourSpace, Image, Vec3};
use yugen_reflectance::{Kind, ParamType};

/// A picture under new light: from photographs, an RTI file or a fitted cloth.
///
/// `yugen capture relight cloth.btf --light 1,1,1 -o lit.png` is the common case.
///
/// `--light` is a direction (x right, y up, z to the camera); a white diffuser that faces it comes out as 1.
/// `--environment` is a panorama, equirectangular, whose centre lies where the camera is. With `--hold-out` nothing is
/// lit: photographs of a stack are left out, predicted from the others by every method, and compared.
#[derive(Args)]
pub struct Relight {
    /// A stack (folder or .lp), a .ptm, a .rti, a RelightLab folder, or the maps of a cloth (.btf, .exr).
    source: PathBuf,

    /// Toward the light; any length.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction, allow_hyphen_values = true, group = "task")]
    light: Option<Vec3>,

    /// A panorama to light it with: .exr or .hdr.
    #[arg(long, value_name = "FILE", group = "task")]
    environment: Option<PathBuf>,

    /// Leave out so many photographs, evenly over the list, or these: numbers from 1 on or file names, with commas; a
    /// comma after a single one.
    #[arg(long, value_name = "N|LIST", group = "task")]
    hold_out: Option<String>,

    /// The picture: .exr, .hdr, .png or .jpg.
    #[arg(
        short,
        long,
        value_name = "FILE",
        required_unless_present = "hold_out",
        conflicts_with = "hold_out"
    )]
    output: Option<PathBuf>,

    /// Turn the panorama about the vertical by so many degrees, counterclockwise from above.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        value_parser = parse_turn,
        allow_hyphen_values = true,
        requires = "environment"
    )]
    turn: f32,

    /// Cells across the panorama that light is gathered in: more are sharper and slower.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(4..=1024))]
    cells: u16,

    /// What to fit to a stack: lrgb-ptm, ptm, hsh4, hsh9, hsh16, rbf (thin plate), rbf-gaussian; with --hold-out also
    /// btf, and several with commas. Where absent hsh9, with --hold-out all of them.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = parse_method)]
    method: Vec<Method>,

    /// Values of the file, or of what is fitted to a stack, are proportional to light, not sRGB display values. Folders may
    /// say so themselves.
    #[arg(long)]
    linear: bool,

    /// True normals for --hold-out: the maps of a cloth, channels X, Y, Z (or R, G, B) of an .exr, or a .png with
    /// (n + 1)/2.
    #[arg(long, value_name = "FILE", requires = "hold_out")]
    normals: Option<PathBuf>,

    /// Pictures for --hold-out: truth, predictions and maps of their errors go into this folder.
    #[arg(long, value_name = "FOLDER", requires = "hold_out")]
    report: Option<PathBuf>,

    /// Memory for the photographs of a stack, in MiB.
    #[arg(long, value_name = "MIB", default_value_t = 4096)]
    memory: u64,

    #[command(flatten)]
    display: argument::DisplayOptions,

    /// Threads instead of one per core, for the fit of a cloth.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Print what was done as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

impl Relight {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if self.hold_out.is_some() {
            return self.compare();
        }
        let Some(output) = &self.output else { bail!("expected --output") };
        let started = Instant::now();
        image::can_write(output)?;
        let cloth = is_cloth(&self.source);
        // Gold lies outside sRGB; display values lie in it.
        let space = if cloth { ColourSpace::LinearRec2020 } else { ColourSpace::LinearSrgb };
        let write = self.display.of(output, space, Default::default())?;
        let lamps = self.lamps(space)?;
        let (width, pixels) = if cloth { self.cloth(&lamps, output)? } else { self.picture(&lamps, output)? };
        let mut picture = Image::rgb(width, pixels.len() / width);
        picture.data.copy_from_slice(pixels.as_flattened());
        image::write(output, &picture, &write)?;
        if self.json {
            json::print(json!({
                "output": output.display().to_string(), "width": width, "height": picture.height,
                "lamps": lamps.len(), "seconds": started.elapsed().as_secs_f64(),
            }));
        } else {
            println!("{}: {width}x{}", output.display(), picture.height);
        }
        Ok(())
    }

    fn encoding(&self) -> Encoding {
        if self.linear { Encoding::Linear } else { Encoding::Srgb }
    }

    fn lamps(&self, space: ColourSpace) -> Result<Vec<Lamp>> {
        if let Some(toward) = self.light {
            return Ok(vec![Lamp::unit(toward)]);
        }
        let Some(file) = &self.environment else {
            bail!(
                "say what light falls on it, with --light x,y,z or --environment FILE; or compare with --hold-out N"
            )
        };
        let panorama = image::read(file, &image::ReadOptions::to(space))?;
        let Some(panorama) = panorama.select(&["R", "G", "B"]) else {
            bail!("{}: a panorama needs the channels R, G and B", file.display());
        };
        let lamps = light::panorama(&panorama, usize::from(self.cells), self.turn.to_radians());
        if lamps.is_empty() {
            bail!("{}: no light comes from the half of the panorama in front of the sample", file.display());
        }
        Ok(lamps)
    }

    fn cloth(&self, lamps: &[Lamp], output: &Path) -> Result<(usize, Vec<[f32; 3]>)> {
        let (maps, about) = btf::load(&self.source, ColourSpace::LinearRec2020)?;
        check_outputs([output])?;
        let noh = Kind::from_name("noh")?;
        let forms = noh.params().iter().find(|p| p.name == "form").map(|p| p.kind);
        let Some(ParamType::Choice(forms)) = forms else { bail!("the model noh has no forms") };
        let Some(form) = forms.iter().position(|f| *f == about.form) else {
            bail!(
                "{}: unknown form '{}'; expected one of {}",
                self.source.display(),
                about.form,
                forms.join(", ")
            );
        };
        let form = yugen_reflectance::Choice(form as f32);
        Ok((maps.width, summed(lamps, self.json, PART, |part| Ok(light::cloth(&maps, form, part)?))?))
    }

    fn picture(&self, lamps: &[Lamp], output: &Path) -> Result<(usize, Vec<[f32; 3]>)> {
        let encoding = self.encoding();
        if relit_files::recognises(&self.source) {
            if !self.method.is_empty() {
                bail!("--method is for stacks of photographs; {} is fitted already", self.source.display());
            }
            let linear = relit_files::says_linear(&self.source, DEFAULT_MAX_TEXELS)?;
            let encoding = if linear { Encoding::Linear } else { encoding };
            let picture = relit_files::read(&self.source, DEFAULT_MAX_TEXELS)?;
            check_outputs([output])?;
            let [width, _] = picture.size();
            return Ok((width, lit(&picture, lamps, self.json, encoding)?));
        }
        let source = Source::open(&self.source, None)?;
        check_outputs([output])?;
        let stack = source.whole(self.memory << 20)?;
        let method = match self.method.as_slice() {
            [] => Method::Basis(Basis::Hsh { order: 3 }),
            [method] => *method,
            _ => bail!("--method: several are for --hold-out; expected one"),
        };
        let (basis, colouring) = match method {
            Method::Basis(basis) => (basis, Colouring::Rgb),
            Method::LrgbPtm => (Basis::Ptm, Colouring::Lrgb),
            Method::Btf => bail!("--method btf: fit the stack with `yugen capture fit`, then light the .btf"),
            Method::Rbf(kernel) => {
                let rbf = Rbf::new(&stack, kernel, encoding)?;
                let sum = summed(lamps, self.json, 1, |lamp| {
                    let Lamp { toward, white } = lamp[0];
                    let mut light = rbf.picture(|_, _| toward);
                    for v in &mut light {
                        *v = (Vec3::from_array(v.map(|v| encoding.decode(v))) * white).to_array();
                    }
                    Ok(light)
                })?;
                return Ok((stack.width, sum));
            }
        };
        let ridge = choose_ridge(&stack, basis, encoding)?;
        let fitted = fit(&stack, &Options { basis, colouring, encoding, ridge })?;
        Ok((stack.width, lit(&Contents::Terms(fitted.picture), lamps, self.json, encoding)?))
    }
}

/// Lamps between two looks at the progress bar.
const PART: usize = 16;

fn lit(picture: &Contents, lamps: &[Lamp], quiet: bool, encoding: Encoding) -> Result<Vec<[f32; 3]>> {
    // Linear light is added up before the picture is looked at, all lamps at once.
    let part = if encoding == Encoding::Linear { lamps.len() } else { PART };
    summed(lamps, quiet, part, |lamps| {
        Ok(match picture {
            Contents::Terms(r) => light::picture(r, lamps, encoding),
            Contents::Mixed(m) => mixed::picture(m, lamps, encoding),
        })
    })
}

/// The sum of what `light` makes of parts of the lamps, with a progress bar.
fn summed(
    lamps: &[Lamp],
    quiet: bool,
    part: usize,
    light: impl Fn(&[Lamp]) -> Result<Vec<[f32; 3]>>,
) -> Result<Vec<[f32; 3]>> {
    let bar = progress::bar(lamps.len() as u64, quiet || lamps.len() <= part);
    let mut sum = Vec::new();
    for lamps in lamps.chunks(part.max(1)) {
        let values = light(lamps)?;
        if sum.is_empty() {
            sum = values;
        } else {
            let all = sum.as_flattened_mut().iter_mut().zip(values.as_flattened());
            all.for_each(|(sum, v)| *sum += v);
        }
        bar.inc(lamps.len() as u64);
    }
    bar.finish_and_clear();
    Ok(sum)
}

/// A file that is no list of lights and no RTI file.
fn is_cloth(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    ["btf", "exr"].contains(&extension.as_str()) && !path.is_dir()
}

fn parse_direction(text: &str) -> Result<Vec3, String> {
    argument::direction(text)
        .ok()
        .filter(|d| d.z > 0.0)
        .ok_or_else(|| "expected a direction with z above zero as three numbers, as in 0.5,0,0.87".into())
}

fn parse_turn(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| "expected degrees".into())
}

fn parse_method(text: &str) -> Result<Method, String> {
    let name = |m: Method| match m {
        Method::Rbf(Kernel::ThinPlate) => "rbf".into(),
        Method::Rbf(Kernel::Gaussian) => "rbf-gaussian".into(),
        Method::LrgbPtm => "lrgb-ptm".into(),
        m => m.name().replace(' ', "").to_lowercase(),
    };
    let names = || Method::ALL.map(name).join(", ");
    Method::ALL.into_iter().find(|m| name(*m) == text).ok_or_else(|| format!("expected one of {}", names()))
}
