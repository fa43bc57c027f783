//! `yugen ink`: a scene by brush.

mod finish;

use crate::sequence::{Frames, Moments, RATE, Sequence};
use crate::{argument, json, render};
use anyhow::{Context, Result, bail};
use clap::Args;
use finish::Finish;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yugen_archive::formats::mesh::Up;
use yugen_archive::formats::{self, image};
use yugen_archive::{atomic_write, check_outputs, check_writable, read_bounded};
use yugen_ink::control::CONTROLS;
use yugen_ink::mount::{MOUNTS, Mount, Mounting};
use yugen_ink::painter::{Painter, Painting, Style};
use yugen_ink::paper::PAPERS;
use yugen_ink::pigment::PIGMENTS;
use yugen_ink::preset;
use yugen_ink::wrinkle::MANNERS;
use yugen_optics::{ColourSpace, Image};
use yugen_realtime::Gpu;
use yugen_scene::{Camera, Scene};

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
    /// ca, gou, dian). Or .svg: the strokes as outlines and centrelines with width, pressure and identity. A scene that moves
    /// becomes numbered files by a name as frame_%04d.png, or a film by .mp4 (H.264) or .apng (animated PNG).
    #[arg(short, long = "output", value_name = "FILE", required_unless_present_any = ["list", "markdown"])]
    outputs: Vec<PathBuf>,

    /// A way of painting: one of those that `--list` has, or a file (.toml) with the same keys, and tables [object.NAME],
    /// [material.NAME], [mask.NAME] and [stroke.ID] for what is otherwise of single objects and materials, where a picture says
    /// so, and of single strokes.
    #[arg(long, default_value = preset::DEFAULT, value_name = "NAME|FILE")]
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

    #[command(flatten)]
    finish: Finish,

    /// By the method of the slides of Xu, Yang and Wu (2012) as it stands, to compare with. The controls contour, wrinkle,
    /// rub, wash and dot scale the ink of its five techniques; `--set rub=1` adds rubbing, which is left out where nobody asks.
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

    /// Of a sequence: leave the pictures that are there already. Strokes are followed through them, so that those that
    /// are made are what they would have been at once.
    #[arg(long)]
    resume: bool,

    #[command(flatten)]
    moments: Moments,

    /// A film of how the picture is painted, print by print: washes, wrinkles, rubbing, contours from the back to the front, dots. Five
    /// seconds where --frames does not say how long; of the moment that --at says.
    #[arg(long, conflicts_with_all = ["literal", "turn", "resume", "cycle"])]
    replay: bool,

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
fn words() -> Result<[(&'static str, Named); 5]> {
    let pairs =
        |all: Vec<(&str, &str)>| all.into_iter().map(|(n, d)| (n.to_string(), d.to_string())).collect();
    Ok([
        ("Presets", preset::presets()?.into_iter().map(|p| (p.name, p.doc)).collect()),
        ("Papers", pairs(PAPERS.iter().map(|p| (p.name, p.doc)).collect())),
        ("Pigments", pairs(PIGMENTS.iter().map(|p| (p.name, p.doc)).collect())),
        ("Manners of wrinkles", pairs(MANNERS.iter().map(|m| (m.name, m.doc)).collect())),
        ("Mountings", pairs(MOUNTS.iter().map(|m| (m.name, m.doc)).collect())),
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
        let mut style = match preset::is_file(&self.preset) {
            true => {
                let bytes = read_bounded(Path::new(&self.preset), MOST)?;
                let text = String::from_utf8(bytes).with_context(|| format!("{}: not UTF-8", self.preset))?;
                let open = |name: &str| {
                    let picture = Path::new(&self.preset).with_file_name(name);
                    let options = image::ReadOptions::to(ColourSpace::LinearSrgb);
                    image::read(&picture, &options)
                        .map(|image| (name.into(), image))
                        .map_err(|e| e.to_string())
                };
                preset::read(&text, &self.preset, &open)?.style
            }
            false => preset::find(&self.preset)?.style,
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
        style.signature = self.finish.signature()?;
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
        if self.replay {
            if !self.moments.is_sequence(&self.outputs) {
                bail!("--replay is a film: name one (.mp4, .apng), or numbered pictures as in part_%03d.png");
            }
            if let Some(svg) = self.outputs.iter().find(|o| is_svg(o)) {
                bail!("{}: vectors are of the whole painting; leave out --replay", svg.display());
            }
        }
        let of_one = [("--resume", self.resume)];
        let of_one = if self.moments.is_sequence(&self.outputs) { &[][..] } else { &of_one };
        if let Some((option, _)) = of_one.iter().find(|o| o.1) {
            bail!("{option} is for a sequence: there is nothing to go on with in one picture");
        }
        // A replay is of one moment.
        let moments = match self.replay {
            true => &Moments { at: None, ..self.moments.clone() },
            false => &self.moments,
        };
        if self.replay && self.moments.animation.is_some() && self.moments.at.is_none() {
            bail!("--replay paints one moment: --at says at what time of the --animation");
        }
        moments.check(&self.outputs, self.resume, &[], &|output| match is_svg(output) {
            true => Ok(check_writable(output)?),
            false => Moments::can_write_picture(output, &["svg"]),
        })?;
        let style = self.style()?;
        if self.literal && !style.steering.is_empty() {
            bail!(
                "{}: the slides' method knows nothing of single objects, materials and strokes, nor of masks; leave out --literal or \
                 their tables",
                self.preset
            );
        }
        let options = formats::Options {
            up: self.up.as_deref().map(|axis| if axis == "z" { Up::Z } else { Up::Y }),
            ..self.reading.options()
        };
        let mut scene = formats::load_scene(file, &options)?;
        if let Some(size) = self.size {
            scene.settle_framing(size);
        }
        let job = Job {
            scene: file,
            outputs: &self.outputs,
            style,
            literal: self.literal,
            mount: self.finish.mount(),
            size: self.size,
            crop: None,
            camera: self.camera.as_deref(),
            moments: &self.moments,
            resume: self.resume,
            replay: self.replay,
            threads: argument::threads(None),
            json: self.json,
        };
        job.run(scene)
    }
}

/// The style of `yugen ink` where nothing is said of it.
pub fn plain(seed: u32) -> Result<Style> {
    Ok(Style { seed, ..preset::find(preset::DEFAULT)?.style })
}

/// What is painted, how and where to; the names of the outputs have been checked.
pub struct Job<'a> {
    /// Of messages.
    pub scene: &'a Path,
    /// Where to.
    pub outputs: &'a [PathBuf],
    /// How.
    pub style: Style,
    /// By the method of the slides.
    pub literal: bool,
    /// What it is mounted in.
    pub mount: Option<&'static Mount>,
    /// Pixels, instead of the camera's.
    pub size: Option<[u32; 2]>,
    /// Only this part of the picture.
    pub crop: Option<[u32; 4]>,
    /// Its name.
    pub camera: Option<&'a str>,
    /// When.
    pub moments: &'a Moments,
    /// Leave frames that are there.
    pub resume: bool,
    /// Frames are parts of one painting.
    pub replay: bool,
    /// Threads that prepare.
    pub threads: usize,
    /// Report as JSON.
    pub json: bool,
}

/// A painter and what it has painted last.
struct Session<'a> {
    job: &'a Job<'a>,
    painter: Painter,
    names: Vec<String>,
    picture: Option<Image>,
    painting: Option<Painting>,
    mounting: Option<Mounting>,
    /// Frames of a replay that are made.
    shown: u32,
}

impl<'a> Session<'a> {
    fn new(job: &'a Job<'a>, scene: &Scene) -> Result<Self> {
        let gpu = Gpu::open()?;
        let (camera, style) = (job.look(scene)?, job.style.clone());
        let painter = Painter::new(&gpu.device, &gpu.queue, scene, &camera, style, job.threads)?;
        painter.unmet_names().iter().for_each(|said| tracing::warn!("{said}"));
        let names = scene.shapes.iter().map(|s| s.name.clone()).collect();
        let mounting = job.mounting(scene)?;
        Ok(Self { job, painter, names, picture: None, painting: None, mounting, shown: 0 })
    }

    /// Paints a scene in the pose that the painter has.
    fn paint(&mut self, scene: &Scene) -> Result<()> {
        let camera = self.job.look(scene)?;
        if self.job.literal {
            let picture = self.painter.paint_literally(scene, &camera)?;
            return self.mount(picture);
        }
        if !self.job.replay || self.painting.is_none() {
            self.painting = Some(self.painter.paint(&camera)?);
        }
        if self.job.replay {
            self.shown += 1;
            self.painter.repaint(f64::from(self.shown) / f64::from(self.job.parts()));
        }
        let layers = self.job.outputs.iter().any(|o| extension(o) == "exr");
        let picture = self.painter.image(layers)?;
        self.mount(picture)
    }

    fn mount(&mut self, picture: Image) -> Result<()> {
        self.picture = Some(match &self.mounting {
            Some(mounting) => mounting.frame(&picture).context("the painting does not fit its mounting")?,
            None => picture,
        });
        Ok(())
    }

    fn last(&self) -> Result<&Image> {
        self.picture.as_ref().context("nothing was painted")
    }

    fn save(&self, output: &Path, frame: Option<u32>) -> Result<()> {
        if is_svg(output) {
            let painting = self.painting.as_ref().context("nothing was painted")?;
            let name = |shape: u32| self.names.get(shape as usize - 1).cloned().unwrap_or_default();
            return Ok(atomic_write(
                output,
                self.painter.svg(painting, &name, self.mounting.as_ref(), frame).as_bytes(),
            )?);
        }
        let picture = self.last()?;
        let whole = if extension(output) == "exr" { None } else { picture.select(&["R", "G", "B"]) };
        let options = image::WriteOptions::from(ColourSpace::LinearSrgb);
        Ok(image::write(output, whole.as_ref().unwrap_or(picture), &options)?)
    }
}

impl Frames for Session<'_> {
    fn paint(&mut self, scene: &Scene, stop: &dyn Fn() -> bool, tell: &dyn Fn(f64)) -> Result<bool> {
        if !self.job.replay {
            self.painter.pose(scene)?;
        }
        Session::paint(self, scene)?;
        tell(1.0);
        Ok(!stop())
    }

    fn pass_by(&mut self, scene: &Scene) -> Result<()> {
        self.painter.pose_to_follow(scene)?;
        self.painter.follow(&self.job.look(scene)?)?;
        Ok(())
    }

    fn remembers(&self) -> bool {
        !self.job.literal
    }

    fn end(&self) {
        self.painter.unmet_strokes().iter().for_each(|said| tracing::warn!("{said}"));
    }

    fn picture(&self) -> Result<Image> {
        let picture = self.last()?;
        picture.select(&["R", "G", "B"]).context("a painting has colours")
    }

    fn write(&self, path: &Path, frame: u32) -> Result<()> {
        self.save(path, Some(frame))
    }
}

/// Seconds of a replay where nobody says.
const REPLAY: f64 = 5.0;

impl Job<'_> {
    /// Frames of a replay.
    fn parts(&self) -> u32 {
        let rate = self.moments.fps.unwrap_or(RATE);
        let frames = || (REPLAY * rate).round().max(1.0) as u32;
        self.moments.frames.map_or_else(frames, |[first, last]| last - first + 1)
    }

    fn look(&self, scene: &Scene) -> Result<Camera> {
        Ok(scene.look_through(self.camera, self.size, self.crop)?)
    }

    /// Pixels of the painting.
    fn size(&self, scene: &Scene) -> Result<[u32; 2]> {
        let film = self.look(scene)?.film;
        Ok(film.crop.map_or([film.width, film.height], |[_, _, w, h]| [w, h]))
    }

    fn mounting(&self, scene: &Scene) -> Result<Option<Mounting>> {
        let size = self.size(scene)?;
        Ok(self.mount.map(|m| m.around(size)).transpose()?)
    }

    /// Paints it.
    pub fn run(&self, mut scene: Scene) -> Result<()> {
        if self.moments.is_sequence(self.outputs) {
            if self.replay {
                self.moments.pose_at(&mut scene, self.scene)?;
            }
            let sequence = Sequence {
                still: self.replay.then(|| self.parts()),
                scene: self.scene,
                outputs: self.outputs,
                moments: self.moments,
                resume: self.resume,
                film: image::WriteOptions::from(ColourSpace::LinearSrgb),
                by: "ink",
                json: self.json,
            };
            let size = |scene: &Scene| Ok(self.mounting(scene)?.map_or(self.size(scene)?, |m| m.size));
            return sequence.run(scene, size, |scene| Session::new(self, scene));
        }
        check_outputs(self.outputs)?;
        self.moments.pose_at(&mut scene, self.scene)?;
        let started = Instant::now();
        let mut session = Session::new(self, &scene)?;
        let prepared = started.elapsed();
        Session::paint(&mut session, &scene)?;
        let painted = started.elapsed() - prepared;
        for output in self.outputs {
            session.save(output, None)?;
        }
        session.end();
        let names = || self.outputs.iter().map(|o| o.display().to_string()).collect::<Vec<_>>();
        let (picture, painting) = (session.last()?, session.painting.as_ref());
        if self.json {
            json::print(json!({
                "outputs": names(),
                "width": picture.width,
                "height": picture.height,
                "strokes": painting.map(|p| p.strokes.len()),
                "wrinkles": painting.map(|p| p.wrinkles.len()),
                "stamps": painting.map(|p| p.stamps),
                "prepare_seconds": prepared.as_secs_f64(),
                "paint_seconds": painted.as_secs_f64(),
            }));
        } else {
            println!(
                "{}: {}x{}{} in {:.2} s",
                names().join(", "),
                picture.width,
                picture.height,
                painting.map_or(String::new(), |p| format!(", {} strokes", p.strokes.len())),
                painted.as_secs_f64()
            );
        }
        Ok(())
    }
}
