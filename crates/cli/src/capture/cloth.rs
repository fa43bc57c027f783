//! The cloth that a command is about: a preset, a draft or maps.

use crate::argument;
use anyhow::{Result, bail};
use clap::Args;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{self, ReadOptions};
use yugen_archive::formats::{btf, wif};
use yugen_archive::{make_folder, read_filled};
use yugen_capture::weave::{Cloth, Fabric, Irregularity, PRESETS, ThreadId, Weave, WeaveError};
use yugen_optics::{ColourSpace, Vec2};
use yugen_reflectance::btf::Btf;
use yugen_scene::nearest;

/// Texels per mm of a preset where nobody says.
const SCALE: f32 = 16.0;
/// Texels from thread to thread of a draft where nobody says.
const PER_THREAD: f32 = 14.0;

/// How a cloth is woven.
#[derive(Args)]
pub struct Weaving {
    /// Width and height in texels [default: 512x512].
    #[arg(long, value_name = "WxH", value_parser = parse_pair)]
    size: Option<[u32; 2]>,

    /// Texels to a millimetre [default: 16; for a draft 14 from thread to thread].
    #[arg(long, value_name = "N", value_parser = parse_scale, conflicts_with = "repeats")]
    scale: Option<f32>,

    /// So many whole repeats across and up, which tile without a seam; the height follows from the width.
    #[arg(long, value_name = "CxR", value_parser = parse_pair)]
    repeats: Option<[u32; 2]>,

    /// A figure in a named weave, as in damask: a picture, a pixel a crossing, the first pick at the bottom; what is
    /// white is woven with the other side up. Its size should be a multiple of the weave's repeat.
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,

    /// Perfectly even threads instead of real ones.
    #[arg(long)]
    even: bool,

    /// Same seed, same cloth (and same noise).
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub seed: u32,

    /// The linear space of the colours.
    #[arg(long, default_value = "rec2020", value_parser = ColourSpace::ALL.map(ColourSpace::name), value_name = "SPACE")]
    space: String,
}

/// A cloth in front of the camera.
pub struct Sample {
    pub btf: Btf,
    /// In widths of a texel; `None` for maps without.
    pub heights: Option<Vec<f32>>,
    pub threads: Vec<Option<ThreadId>>,
    /// `None` where the maps do not say.
    pub texel_mm: Option<f32>,
    /// What it came from; `None` for maps.
    pub fabric: Option<Fabric>,
    /// For people.
    pub source: String,
}

impl Weaving {
    fn space(&self) -> ColourSpace {
        ColourSpace::from_name(&self.space).unwrap_or_default()
    }

    /// The fabric of a preset or a draft.
    pub fn fabric(&self, what: &str) -> Result<Fabric> {
        let (path, space) = (Path::new(what), self.space());
        match what.parse::<Weave>() {
            Ok(ground) => {
                let weave = match &self.figure {
                    Some(figure) => damask(&ground, figure)?,
                    None => ground,
                };
                return Ok(Fabric::silk(what, weave, space));
            }
            // The name is known, its numbers are wrong.
            Err(e) if !matches!(e, WeaveError::Name(_)) => return Err(e.into()),
            Err(_) => {}
        }
        if self.figure.is_some() {
            bail!("--figure needs a named weave, such as satin:5/2, and '{what}' is none");
        }
        if let Some(fabric) = Fabric::preset(what, space) {
            return Ok(fabric);
        }
        if has_extension(path, "wif") {
            let bytes = read_filled(path, 64 << 20)?;
            let draft = wif::read(&bytes, path, space)?;
            let mut fabric = Fabric::from_draft(&draft, space);
            if fabric.name.is_empty() {
                fabric.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            }
            return Ok(fabric);
        }
        let names = PRESETS.iter().map(|p| p.name);
        let hint = match nearest(what, names.clone()) {
            Some(name) => format!("did you mean '{name}'?"),
            None => format!("the presets are {}", names.collect::<Vec<_>>().join(" and ")),
        };
        bail!(
            "'{what}' is neither a preset, nor a weave (plain, twill:2/1, satin:5/2), nor a .wif draft; {hint}"
        )
    }

    /// Weaves it; the usual scale is that of silk, or of the draft's threads.
    pub fn weave(&self, fabric: Fabric, draft: bool) -> Result<Sample> {
        let repeat = fabric.repeat();
        let [width, height] = self.size.unwrap_or([512; 2]).map(|n| n as usize);
        let (size, extent) = match self.repeats {
            Some(n) => {
                let (size, extent) = fabric.repeats(n, width);
                if size[1] > 65536 {
                    bail!(
                        "{} x {} repeats would be {} texels high; ask for a smaller --size",
                        n[0],
                        n[1],
                        size[1]
                    );
                }
                (size, extent)
            }
            None => {
                let usual = if draft { PER_THREAD * fabric.warp.len() as f32 / repeat.x } else { SCALE };
                let scale = self.scale.unwrap_or(usual);
                ([width, height], Vec2::new(width as f32, height as f32) / scale)
            }
        };
        // Threads are few beside texels unless the scale is absurd.
        let threads = extent / repeat * Vec2::new(fabric.warp.len() as f32, fabric.weft.len() as f32);
        if threads.max_element() > 65536.0 {
            bail!("{:.0} by {:.0} threads are too many; raise --scale", threads.x, threads.y);
        }
        let irregular = if self.even { Irregularity::NONE } else { Irregularity::default() };
        let Cloth { btf, heights, threads } = Cloth::weave(&fabric, size, extent, irregular, self.seed);
        let texel_mm = Some(extent.x / size[0] as f32);
        let source = format!("woven: {}, seed {}", fabric.name, self.seed);
        Ok(Sample { btf, heights: Some(heights), threads, texel_mm, fabric: Some(fabric), source })
    }

    /// The cloth in a file of maps, or woven from a preset or draft. `heights` names a picture that goes with maps.
    pub fn sample(&self, what: &str, heights: Option<&Path>) -> Result<Sample> {
        let path = Path::new(what);
        if !(has_extension(path, "btf") || has_extension(path, "exr")) {
            if heights.is_some() {
                bail!("--heights goes with maps (.btf, .exr); '{what}' has heights of its own");
            }
            return self.weave(self.fabric(what)?, is_draft(what));
        }
        let woven = [
            ("--size", self.size.is_some()),
            ("--scale", self.scale.is_some()),
            ("--repeats", self.repeats.is_some()),
            ("--figure", self.figure.is_some()),
            ("--even", self.even),
        ];
        if let Some((option, _)) = woven.iter().find(|(_, given)| *given) {
            bail!("{option} says how to weave, and the maps of {what} are woven already; leave it out");
        }
        let (btf, about) = btf::load(path, self.space())?;
        let heights = match heights {
            None => None,
            Some(path) => {
                let picture = image::read(path, &ReadOptions::raw())?;
                if (picture.width, picture.height) != (btf.width, btf.height) {
                    bail!(
                        "{} is {} x {}, but the maps are {} x {}",
                        path.display(),
                        picture.width,
                        picture.height,
                        btf.width,
                        btf.height
                    );
                }
                Some(picture.data.chunks_exact(picture.channels.len()).map(|p| p[0]).collect())
            }
        };
        let texel_mm = about.texel_mm;
        Ok(Sample { btf, heights, threads: Vec::new(), texel_mm, fabric: None, source: about.source })
    }
}

/// Whether a cloth is given by the draft in a file.
pub fn is_draft(what: &str) -> bool {
    has_extension(Path::new(what), "wif")
}

/// The weave with the other side up where a picture is white.
fn damask(ground: &Weave, figure: &Path) -> Result<Weave> {
    let picture = image::read(figure, &ReadOptions::raw())?;
    let (width, height, channels) = (picture.width, picture.height, picture.channels.len());
    if width > 16384 || height > 16384 {
        bail!("{} is {width} x {height}; a figure has at most 16384 ends and picks", figure.display());
    }
    let white = |end: usize, pick: usize| picture.data[((height - 1 - pick) * width + end) * channels] > 0.5;
    Ok(Weave::jacquard(width, height, white, &ground.opposite(), ground))
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// Makes the folder that a command writes into.
pub fn folder(path: &Path) -> Result<()> {
    Ok(make_folder(path)?)
}

fn parse_pair(text: &str) -> Result<[u32; 2], String> {
    argument::pair(text, 16384).ok_or_else(|| "expected two numbers from 1 to 16384, as in 512x512".into())
}

fn parse_scale(text: &str) -> Result<f32, String> {
    let ok = |v: &f32| (1e-2..=1e5).contains(v);
    text.parse().ok().filter(ok).ok_or_else(|| "expected texels per mm, a number from 0.01 to 100000".into())
}
