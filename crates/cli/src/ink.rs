//! `yugen ink`: a scene by brush.

use crate::{argument, json, render};
use anyhow::{Context, Result};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::formats::mesh::Up;
use yugen_archive::formats::{self, image};
use yugen_archive::{atomic_write, check_outputs, check_writable};
use yugen_ink::painter::{Painter, Style};
use yugen_optics::ColourSpace;
use yugen_realtime::Gpu;

/// Paints a scene in ink on paper: contours as strokes of a brush.
///
/// `yugen ink scene.glb -o picture.png` is the common case; whatever `yugen render` reads can be painted.
#[derive(Args)]
pub struct Ink {
    /// The scene file, or a mesh (.obj, .ply, .serialized).
    scene: PathBuf,

    /// Where to; may be repeated. A picture: .png and .jpg, or .exr with a layer of its own for each kind of stroke (ran, cun,
    /// ca, gou, dian). Or .svg: the strokes as outlines and centrelines with width, pressure and identity.
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    outputs: Vec<PathBuf>,

    /// Gives a control a value; may be repeated.
    #[arg(long = "set", value_name = "CONTROL=VALUE", value_parser = assignment)]
    set: Vec<(String, f32)>,

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

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

fn is_svg(path: &Path) -> bool {
    extension(path) == "svg"
}

impl Ink {
    /// Does it.
    pub fn run(self) -> Result<()> {
        for output in &self.outputs {
            match is_svg(output) {
                true => check_writable(output)?,
                false => image::can_write(output)?,
            }
        }
        let mut style = Style { seed: self.seed, ..Style::default() };
        for (name, value) in &self.set {
            style.controls.set(name, *value)?;
        }
        let options = formats::Options {
            up: self.up.as_deref().map(|axis| if axis == "z" { Up::Z } else { Up::Y }),
            ..self.reading.options()
        };
        let mut scene = formats::load_scene(&self.scene, &options)?;
        check_outputs(&self.outputs)?;
        if let Some(size) = self.size {
            scene.settle_framing(size);
        }
        if let Some(seconds) = self.at {
            let posed = scene.pose(self.animation.as_deref(), seconds as f32);
            posed.with_context(|| self.scene.display().to_string())?;
        }
        let camera = scene.look_through(self.camera.as_deref(), self.size, None)?;
        let gpu = Gpu::open()?;
        let started = Instant::now();
        let mut painter =
            Painter::new(&gpu.device, &gpu.queue, &scene, &camera, style, argument::threads(None))?;
        let prepared = started.elapsed();
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
