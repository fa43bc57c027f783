//! `yugen ink`: a scene by brush.

use crate::{argument, json, render};
use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::formats::mesh::Up;
use yugen_archive::formats::{self, image};
use yugen_archive::{atomic_write, check_outputs, check_writable, read_bounded};
use yugen_ink::control::CONTROLS;
use yugen_ink::painter::{Painter, Style};
use yugen_ink::paper::PAPERS;
use yugen_ink::pigment::PIGMENTS;
use yugen_ink::preset;
use yugen_ink::wrinkle::MANNERS;
use yugen_optics::ColourSpace;
use yugen_realtime::Gpu;

/// Paints a scene in ink on paper: contours as strokes of a brush, washes by its light, wrinkles over its forms.
///
/// `yugen ink scene.glb -o picture.png` is the common case; whatever `yugen render` reads can be painted. `--preset dry` and
/// others are ways of painting, `--set dryness=0.8` steers one, `--list` says what there is.
#[derive(Args)]
pub struct Ink {
    /// The scene file, or a mesh (.obj, .ply, .serialized).
    #[arg(required_unless_present_any = ["list", "markdown"])]
    scene: Option<PathBuf>,

    /// Where to; may be repeated. A picture: .png and .jpg, or .exr with a layer of its own for each kind of stroke (ran, cun,
    /// gou, dian). Or .svg: the strokes as outlines and centrelines with width, pressure and identity.
    #[arg(short, long = "output", value_name = "FILE", required_unless_present_any = ["list", "markdown"])]
    outputs: Vec<PathBuf>,

    /// A way of painting: one of those that `--list` has, or a file (.toml) with the same keys.
    #[arg(long, default_value = "sumi", value_name = "NAME|FILE")]
    preset: String,

    /// Gives a control a value; may be repeated.
    #[arg(long = "set", value_name = "CONTROL=VALUE", value_parser = assignment)]
    set: Vec<(String, f32)>,

    /// The paper, instead of the preset's.
    #[arg(long, value_name = "NAME")]
    paper: Option<String>,

    /// The pigment of lines, and of the wash where the preset has none of its own.
    #[arg(long, value_name = "NAME")]
    pigment: Option<String>,

    /// The pigment of the wash.
    #[arg(long, value_name = "NAME")]
    wash_pigment: Option<String>,

    /// How wrinkles are drawn.
    #[arg(long, value_name = "NAME")]
    manner: Option<String>,

    /// Contours by the method of the slides of Xu, Yang and Wu (2012) as it stands, to compare with.
    #[arg(long)]
    literal: bool,

    /// Presets, controls, papers, pigments and manners of wrinkles.
    #[arg(long)]
    list: bool,

    /// The same as the page docs/ink.md.
    #[arg(long, conflicts_with_all = ["json", "list", "outputs"])]
    markdown: bool,

    /// Width and height in pixels instead of the camera's.
    #[arg(long, value_name = "WxH", value_parser = render::size)]
    size: Option<[u32; 2]>,

    /// Name of the camera; the first where absent.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,

    /// Same seed, same painting.
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u32,

    #[command(flatten)]
    reading: argument::Reading,

    /// Which way is up in a mesh (.obj, .ply, .serialized) that is painted as it is [default: y].
    #[arg(long, value_name = "AXIS", value_parser = ["y", "z"])]
    up: Option<String>,

    /// The pose of a scene that moves this many seconds into its animation; as the file stands where absent.
    #[arg(long, value_name = "S", value_parser = render::seconds)]
    at: Option<f64>,

    /// Which animation, by its name; the first where absent.
    #[arg(long, value_name = "NAME", requires = "at")]
    animation: Option<String>,

    /// Print what was done as JSON.
    #[arg(long)]
    json: bool,
}

fn assignment(text: &str) -> Result<(String, f32), String> {
    let pair = text.split_once('=').and_then(|(k, v)| Some((k.trim().to_string(), v.trim().parse().ok()?)));
    pair.ok_or_else(|| "expected CONTROL=VALUE with a number, as in dryness=0.7".into())
}

/// Most bytes of a preset: a page of text.
const MOST: u64 = 1 << 16;

/// Names and what they are.
type Named = Vec<(String, String)>;

/// What the words of a preset may be, under their titles.
fn words() -> Result<[(&'static str, Named); 4]> {
    let pairs =
        |all: Vec<(&str, &str)>| all.into_iter().map(|(n, d)| (n.to_string(), d.to_string())).collect();
    Ok([
        ("Presets", preset::presets()?.into_iter().map(|p| (p.name, p.doc)).collect()),
        ("Papers", pairs(PAPERS.iter().map(|p| (p.name, p.doc)).collect())),
        ("Pigments", pairs(PIGMENTS.iter().map(|p| (p.name, p.doc)).collect())),
        ("Manners of wrinkles", pairs(MANNERS.iter().map(|m| (m.name, m.doc)).collect())),
    ])
}

fn list() -> Result<String> {
    let mut out = String::new();
    for (title, all) in words()? {
        let _ = writeln!(out, "{title}:");
        for (name, doc) in all {
            let _ = writeln!(out, "  {name:10}  {doc}");
        }
    }
    let _ = writeln!(out, "Controls:");
    for c in CONTROLS {
        let _ = writeln!(
            out,
            "  {:10}  {} to {}, {} where nobody says: {}",
            c.name, c.min, c.max, c.default, c.doc
        );
    }
    Ok(out)
}

/// The page in Markdown.
fn page() -> Result<String> {
    let mut out = String::from(include_str!("ink.md"));
    let _ = write!(out, "\n## Controls\n\n| control | default | range | |\n| --- | --- | --- | --- |\n");
    for c in CONTROLS {
        let _ = writeln!(out, "| `{}` | {} | {} to {} | {} |", c.name, c.default, c.min, c.max, c.doc);
    }
    for (title, all) in words()? {
        let _ = write!(out, "\n## {title}\n\n| name | |\n| --- | --- |\n");
        for (name, doc) in all {
            let _ = writeln!(out, "| `{name}` | {doc} |");
        }
    }
    Ok(out)
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

fn is_svg(path: &Path) -> bool {
    extension(path) == "svg"
}

impl Ink {
    /// The preset with what is said besides.
    fn style(&self) -> Result<Style> {
        let mut style = match Path::new(&self.preset) {
            file if extension(file) == "toml" => {
                let bytes = read_bounded(file, MOST)?;
                let text = String::from_utf8(bytes).with_context(|| format!("{}: not UTF-8", self.preset))?;
                preset::read(&text, &self.preset)?.style
            }
            _ => preset::find(&self.preset)?.style,
        };
        let named = [
            ("paper", &self.paper),
            ("pigment", &self.pigment),
            ("wash_pigment", &self.wash_pigment),
            ("manner", &self.manner),
        ];
        for (key, word) in named {
            if let Some(word) = word {
                preset::set_name(&mut style, key, word)?;
            }
        }
        for (name, value) in &self.set {
            style.controls.set(name, *value)?;
        }
        style.seed = self.seed;
        Ok(style)
    }

    /// Does it.
    pub fn run(self) -> Result<()> {
        if self.list || self.markdown {
            print!("{}", if self.list { list()? } else { page()? });
            return Ok(());
        }
        // The arguments say that there is one.
        let file = self.scene.as_deref().unwrap_or(Path::new(""));
        if let (true, Some(svg)) = (self.literal, self.outputs.iter().find(|o| is_svg(o))) {
            bail!("{}: the slides' method has no strokes to be written as vectors", svg.display());
        }
        for output in &self.outputs {
            match is_svg(output) {
                true => check_writable(output)?,
                false => image::can_write(output)?,
            }
        }
        let style = self.style()?;
        let options = formats::Options {
            up: self.up.as_deref().map(|axis| if axis == "z" { Up::Z } else { Up::Y }),
            ..self.reading.options()
        };
        let mut scene = formats::load_scene(file, &options)?;
        check_outputs(&self.outputs)?;
        if let Some(size) = self.size {
            scene.settle_framing(size);
        }
        if let Some(seconds) = self.at {
            let posed = scene.pose(self.animation.as_deref(), seconds as f32);
            posed.with_context(|| file.display().to_string())?;
        }
        let camera = scene.look_through(self.camera.as_deref(), self.size, None)?;
        let gpu = Gpu::open()?;
        let started = Instant::now();
        let mut painter =
            Painter::new(&gpu.device, &gpu.queue, &scene, &camera, style, argument::threads(None))?;
        let prepared = started.elapsed();
        if self.literal {
            let picture = painter.paint_literally(&camera)?;
            let options = image::WriteOptions::from(ColourSpace::LinearSrgb);
            for output in &self.outputs {
                image::write(output, &picture, &options)?;
            }
            return Ok(());
        }
        let painting = painter.paint(&camera)?;
        let layers = self.outputs.iter().any(|o| extension(o) == "exr");
        let picture = painter.image(layers)?;
        let painted = started.elapsed() - prepared;
        for output in &self.outputs {
            if is_svg(output) {
                let name = |shape: u32| {
                    scene.shapes.get(shape as usize - 1).map_or(String::new(), |s| s.name.clone())
                };
                atomic_write(output, painter.svg(&painting, &name, None).as_bytes())?;
                continue;
            }
            let whole = if extension(output) == "exr" { None } else { picture.select(&["R", "G", "B"]) };
            let options = image::WriteOptions::from(ColourSpace::LinearSrgb);
            image::write(output, whole.as_ref().unwrap_or(&picture), &options)?;
        }
        let names = || self.outputs.iter().map(|o| o.display().to_string()).collect::<Vec<_>>();
        if self.json {
            json::print(json!({
                "outputs": names(),
                "width": picture.width,
                "height": picture.height,
                "strokes": painting.strokes.len(),
                "wrinkles": painting.wrinkles.len(),
                "stamps": painting.stamps,
                "prepare_seconds": prepared.as_secs_f64(),
                "paint_seconds": painted.as_secs_f64(),
            }));
        } else {
            println!(
                "{}: {}x{}, {} strokes in {:.2} s",
                names().join(", "),
                picture.width,
                picture.height,
                painting.strokes.len(),
                painted.as_secs_f64()
            );
        }
        Ok(())
    }
}
