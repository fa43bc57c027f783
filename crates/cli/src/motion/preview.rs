//! `yugen motion preview`: motion as a film of sticks.

use super::Reading;
use crate::render::Render;
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;
use yugen_archive::formats::motion::scene;

/// Shows motion as sticks: a film, numbered pictures, or a picture of a moment.
///
/// `yugen motion preview dance.bvh -o dance.mp4`; `yugen motion preview take.c3d -o moment.png --at 2 --camera side`. The left is
/// red, the right blue. `yugen view dance.bvh` shows the same in a window, to turn. Cameras: view, and front, side and
/// back without perspective. What the file does not say is guessed.
#[derive(Args)]
pub struct Preview {
    /// The file.
    file: PathBuf,

    #[command(flatten)]
    reading: Reading,

    #[command(flatten)]
    shot: Shot,
}

/// What is shown of it.
#[derive(Args)]
struct Shot {
    /// The film (.mp4 or .apng), pictures by a name as frame_%04d.png, or a picture.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Width and height in pixels.
    #[arg(long, default_value = "640x480", value_name = "WxH")]
    size: String,

    /// Which camera.
    #[arg(long, default_value = "view", value_parser = ["view", "front", "side", "back"], value_name = "NAME")]
    camera: String,

    /// A moment, in seconds; of a picture the first where absent.
    #[arg(long, value_name = "S")]
    at: Option<String>,

    /// These frames of the film only.
    #[arg(long, value_name = "A-B")]
    frames: Option<String>,

    /// Frames a second of the film [default: 24].
    #[arg(long, value_name = "F")]
    fps: Option<String>,

    /// Samples a pixel: more for softer shadows.
    #[arg(long, default_value_t = 4, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,

    /// By which renderer, as of `yugen render`.
    #[arg(long, default_value = "realtime", value_parser = ["reference", "realtime"], value_name = "NAME")]
    by: String,

    /// Print what was done as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

impl Preview {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let render = self.render()?;
        let loaded = self.reading.load(&self.file, true)?;
        render.run_on(scene(&loaded.motion, &self.file)?)
    }

    /// The same in words of `yugen render`, which checks them.
    fn render(&self) -> Result<Render> {
        let shot = &self.shot;
        let mut words = vec!["render".into(), self.file.clone().into_os_string(), "--output".into()];
        words.push(shot.output.clone().into());
        let spp = shot.spp.to_string();
        let given =
            [("--size", Some(&shot.size)), ("--camera", Some(&shot.camera)), ("--by", Some(&shot.by))];
        let more =
            [("--at", shot.at.as_ref()), ("--frames", shot.frames.as_ref()), ("--fps", shot.fps.as_ref())];
        for (name, value) in given.into_iter().chain(more).chain([("--spp", Some(&spp))]) {
            words.extend(value.map(|v| format!("{name}={v}").into()));
        }
        words.extend(shot.json.then(|| "--json".into()));
        Render::parse(words)
    }
}
