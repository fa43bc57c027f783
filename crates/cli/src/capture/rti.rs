//! `yugen capture rti`: a stack of photographs to the files of RTI tools.

use super::stack::Source;
use crate::{json, progress};
use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;
use yugen_archive::check_outputs;
use yugen_archive::formats::gathered::Gathered;
use yugen_archive::formats::relight::Layout;
use yugen_archive::formats::relightable::{Basis, Colouring};
use yugen_archive::formats::relit_files;
use yugen_capture::rti::fit::{Fitted, Options, choose_ridge, fit_into};
use yugen_capture::rti::{Encoding, light};

/// Fits PTM or HSH to a stack of photographs and writes them for RTI viewers.
///
/// The name of the output says what is written: NAME.ptm holds polynomial texture maps, NAME.rti hemispherical harmonics,
/// and a name without an extension becomes a folder as RelightLab makes them for the web (info.json and plane_N.jpg, or with
/// --layout tiles, which a viewer fetches as it needs them). Values are sRGB display values, as viewers expect; with few lights the fit is smoothed, just as much as predicts single
/// photographs best from the others.
#[derive(Args)]
pub struct Rti {
    /// The stack: its folder or its list of lights (.lp).
    stack: PathBuf,

    /// A list of lights that lies elsewhere, as beside the balls that were photographed for themselves, instead of the
    /// stack's own.
    #[arg(long, value_name = "LP")]
    lights: Option<PathBuf>,

    /// NAME.ptm, NAME.rti, or a folder.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,

    /// The functions of light: ptm, hsh4, hsh9 or hsh16. Where absent what the output's name says: ptm, else hsh9.
    #[arg(long, value_name = "NAME", value_parser = parse_basis)]
    basis: Option<Basis>,

    /// One function of light for all colours, times a fixed colour: half the size. For .ptm and folders.
    #[arg(long)]
    lrgb: bool,

    /// Values proportional to light instead of display values, for programs that compute with them; viewers show them too
    /// dark.
    #[arg(long)]
    linear: bool,

    /// How a folder keeps its pictures: image (one JPEG each), deepzoom (a file a tile), tarzoom (a file for the tiles of
    /// each) or itarzoom (one file for the tiles of all).
    #[arg(long, value_name = "NAME", default_value = "image", value_parser = parse_layout)]
    layout: Layout,

    /// Memory for photographs and result, in MiB: what does not fit waits in temporary files (in the folder TMPDIR).
    #[arg(long, value_name = "MIB", default_value_t = 2048)]
    memory: u64,

    /// Print what was done as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

impl Rti {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let ptm = self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("ptm"));
        let basis = self.basis.unwrap_or(if ptm { Basis::Ptm } else { Basis::Hsh { order: 3 } });
        let colouring = if self.lrgb { Colouring::Lrgb } else { Colouring::Rgb };
        if self.lrgb && self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("rti")) {
            bail!("--lrgb: a .rti has a function of light for each colour; write a .ptm or a folder");
        }
        let encoding = if self.linear { Encoding::Linear } else { Encoding::Srgb };
        let source = Source::open(&self.stack, self.lights.as_deref())?;
        // A stack with an info.json would pass for a folder that is fitted already.
        let place = self.output.canonicalize();
        if place.is_ok() && place.ok() == source.folder.path.canonicalize().ok() {
            bail!("{}: the photographs are here; name another folder", self.output.display());
        }
        check_outputs(relit_files::files(&self.output, basis, colouring, self.layout)?)?;
        relit_files::can_write(&self.output, basis, self.layout)?;
        let (width, height) = (source.folder.width, source.folder.height);
        let bar = progress::bar(height as u64, self.json);
        // A quarter for what is fitted, the rest for a band of the photographs and what is fitted to that.
        let bytes = self.memory << 20;
        let mut picture = Gathered::new([width, height], basis, colouring, bytes / 4)?;
        picture.set_linear(self.linear);
        let lights = source.folder.pictures.len();
        let (readings, fitted) = (lights * size_of::<[f32; 3]>(), picture.stride() * size_of::<f32>());
        let share = (bytes - bytes / 4) as f64 * readings as f64 / (readings + fitted) as f64;
        let rows = source.folder.rows_within(share as u64);

        // The smoothing is one for the whole picture, chosen where the sample most likely is.
        let ridge = choose_ridge(&source.middle(rows)?, basis, encoding)?;
        let options = Options { basis, colouring, encoding, ridge };
        let mut fitted = Fitted::none(&options);
        let (mut seconds, mut empty) = (0.0, 0);
        let (mut squares, mut count) = (0.0f64, 0u64);
        let mut bands = source.bands(rows)?;
        while let Some(band) = bands.next()? {
            let started = Instant::now();
            fit_into(&band, &options, &mut fitted)?;
            seconds += started.elapsed().as_secs_f64();
            empty += fitted.empty;
            let (sum, n) = light::misfit(&band, &fitted.picture, encoding);
            squares += sum;
            count += n;
            picture.push(&fitted.picture.coefficients)?;
            bar.set_position((band.first_row + band.height) as u64);
        }
        bar.finish_and_clear();
        drop((bands, fitted));
        relit_files::write(&self.output, &mut picture, self.layout)?;

        let rms = (squares / count.max(1) as f64).sqrt();
        let rate = (width * height) as f64 / seconds.max(1e-9);
        let few = lights < basis.terms();
        if self.json {
            let report = json!({
                "output": self.output.display().to_string(),
                "basis": basis.name(),
                "terms": basis.terms(),
                "colouring": if self.lrgb { "lrgb" } else { "rgb" },
                "layout": self.layout.name(),
                "encoding": if self.linear { "linear" } else { "srgb" },
                "width": width,
                "height": height,
                "lights": lights,
                "fewer_lights_than_terms": few,
                "ridge": ridge,
                "rms_error": rms,
                "empty_texels": empty,
                "fit_seconds": seconds,
                "texels_per_second": rate,
            });
            json::print(report);
            return Ok(());
        }
        println!(
            "{}: {} of {width}x{height} texels from {lights} lights; root mean square error {:.4} of full scale",
            self.output.display(),
            basis.name(),
            rms
        );
        println!("fitted in {seconds:.2} s, {:.2} M texels/s; smoothing {ridge:.0e}", rate / 1e6);
        if few {
            println!(
                "{lights} lights are fewer than the {} terms: what lies between them is smoothed",
                basis.terms()
            );
        }
        if empty > 0 {
            println!("{empty} texels have no usable reading and are black");
        }
        Ok(())
    }
}

/// `ptm`, `hsh4`, `hsh9` or `hsh16`.
fn parse_basis(text: &str) -> Result<Basis, String> {
    let name = |b: &Basis| b.name().replace(' ', "").to_lowercase();
    let names = || Basis::ALL.iter().map(name).collect::<Vec<_>>().join(", ");
    Basis::ALL.into_iter().find(|b| name(b) == text).ok_or_else(|| format!("expected one of {}", names()))
}

fn parse_layout(text: &str) -> Result<Layout, String> {
    let names = || Layout::ALL.map(Layout::name).join(", ");
    Layout::ALL.into_iter().find(|l| l.name() == text).ok_or_else(|| format!("expected one of {}", names()))
}
