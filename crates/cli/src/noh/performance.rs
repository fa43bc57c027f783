//! `yugen noh performance`: a player who dances on the stage by the light of its fires.

use super::{cloth, labels, part_labels};
use crate::{argument, json, progress};
use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use yugen_archive::formats::toml;
use yugen_archive::{check_outputs, check_writable, read_bounded};
use yugen_capture::weave::{Cloth, Fabric, Irregularity};
use yugen_motion::cloth::{Fabric as Material, PRESETS};
use yugen_motion::garment::Fitting;
use yugen_motion::{SkeletalMotion, dance};
use yugen_noh::player::{MASKS, Mask};
use yugen_noh::{Costume, FireLight, Hour, Performance, Preset, Robe, Stage};
use yugen_optics::ColourSpace;
use yugen_reflectance::btf::Btf;

/// What is danced where nobody brings a list: some twenty seconds.
const DANCE: &str = include_str!("dance.txt");
/// Of the cloth that is woven where nobody brings one: repeats across and up, texels across, and how wide these are made, m; three
/// times as large as they are woven, so that the figures are seen from the seats.
const REPEATS: [u32; 2] = [3, 2];
const TEXELS: usize = 512;
const WIDE: f32 = 0.09;
/// Frames of the motion a second.
const RATE: f64 = 60.0;
/// Of the robe's frames one in so many is kept.
const KEEP: usize = 2;
/// The longest dance, s: its robe takes 3 MB a second.
const LONGEST: f64 = 600.0;

/// Puts a player on a Noh stage, who dances by the light of the fires.
///
/// `yugen noh performance -o noh.toml`, then `yugen view noh.toml`, or `yugen render noh.toml --camera player --at 4 -o
/// player.png`, or `--frames 0-299 --fps 30 -o noh.mp4`. The stage is that of `yugen noh stage`.
#[derive(Args)]
pub struct PerformanceVerb {
    /// Where to: .toml; meshes, pictures and motion go into a folder of the same name beside it.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Which stage; `yugen noh stage --list` has them all.
    #[arg(long, default_value = "national", value_name = "NAME")]
    preset: String,

    /// The dance: a list of units of form, as `yugen motion dance` takes it [default: one of twenty seconds].
    #[arg(long, value_name = "FILE")]
    dance: Option<PathBuf>,

    /// The mask: of a young woman, or of a demon.
    #[arg(long, default_value = MASKS[0].name, value_parser = MASKS.iter().map(|m| m.name).collect::<Vec<_>>(), value_name = "NAME")]
    mask: String,

    /// The cloth of the robe: maps (.btf), and how many millimetres they are wide [default: kinran woven here].
    #[arg(long, value_name = "FILE[:MM]")]
    robe: Option<String>,

    /// How the maps of the robe's cloth reflect; see `yugen noh stage --help`.
    #[arg(long, value_name = "FORM")]
    form: Option<String>,

    /// The robe: a cut and measures that differ from its own, as in "kosode length=1.45", or several garments, the innermost first, as in
    /// "okuchi choken", or a file with these words; the outermost is of the robe's cloth, those below of its lining. `none` leaves the
    /// player in white.
    #[arg(long, default_value = "kosode", value_name = "CUT")]
    garment: String,

    /// What the robe weighs and how it bends.
    #[arg(long, default_value = Material::DEFAULT, value_parser = PRESETS.iter().map(|p| p.name).collect::<Vec<_>>(), value_name = "FABRIC")]
    fabric: String,

    /// Edges of the robe's triangles, mm; half as long takes some eight times as long.
    #[arg(long, default_value_t = 25.0, value_name = "MM", value_parser = argument::edge)]
    edge: f32,

    /// Threads [default: as many as there are cores]; the result does not depend on them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,

    /// When it is.
    #[arg(long, value_parser = ["night", "dusk"], default_value = "night", value_name = "HOUR")]
    hour: String,

    /// What was made, as JSON.
    #[arg(long)]
    json: bool,
}

impl PerformanceVerb {
    /// The robe, danced in; nothing where nobody wears one.
    fn costume(&self, moved: &SkeletalMotion) -> Result<Vec<Costume>> {
        if self.garment == "none" {
            return Ok(Vec::new());
        }
        let garments = argument::outfit(&self.garment, 1.0)?;
        let fabric = Material::preset(&self.fabric).map(|p| p.fabric).context("--fabric is a preset")?;
        let fitting = Fitting {
            edge: 1e-3 * self.edge,
            fabric,
            threads: argument::threads(self.threads),
            ..Fitting::default()
        };
        let bar = progress::bar(1000, self.json);
        bar.set_message("the robe");
        let costume = Costume::simulate(&garments, moved, &fitting, KEEP, |done| {
            bar.set_position((1e3 * done) as u64);
            ControlFlow::Continue(())
        });
        bar.finish_and_clear();
        Ok(costume?)
    }

    /// Does it.
    pub fn run(self) -> Result<()> {
        if super::extension(&self.output) != "toml" {
            bail!("{}: a performance is written as .toml", self.output.display());
        }
        check_writable(&self.output)?;
        check_outputs([self.output.as_path()])?;
        let list = match &self.dance {
            Some(path) => {
                let bytes = read_bounded(path, 1 << 20)?;
                String::from_utf8(bytes).ok().with_context(|| format!("{}: no text", path.display()))?
            }
            None => DANCE.into(),
        };
        let name = self.dance.as_ref().map_or("a short one".into(), |p| p.display().to_string());
        let units = dance::parse(&list).with_context(|| name.clone())?;
        let moved = dance::dance(&units, RATE).map_err(anyhow::Error::msg)?;
        let seconds = (moved.frames - 1) as f64 / RATE;
        if seconds > LONGEST {
            bail!("{name} takes {seconds:.0} s; ten minutes are the most");
        }
        let robe = match &self.robe {
            Some(robe) => cloth(robe, self.form.as_deref())?,
            None => kinran(self.form.as_deref())?,
        };
        let preset = Preset::find(&self.preset)?;
        let mask = Mask::find(&self.mask).context("--mask is one of the masks")?;
        let stage = Stage::new(preset, preset.dimensions())?.with_player(mask, robe);
        let costume = self.costume(&moved)?;
        let performance = Performance::new(stage, moved, costume)?;
        let hour = if self.hour == "dusk" { Hour::Dusk } else { Hour::Night };
        let scene = performance.scene(hour, FireLight::Flames)?;
        let mut labels = labels(&performance.stage, "performance");
        let said =
            [("dance", &name), ("garment", &self.garment), ("fabric", &self.fabric), ("mask", &self.mask)];
        labels.about.extend(said.map(|(k, v)| (k.to_string(), v.clone())));
        let player = performance.stage.player().iter().map(|p| part_labels(&performance.stage, &p.part));
        labels.shapes.extend(player);
        toml::write(&self.output, &scene, &labels)?;
        if self.json {
            json::print(json!({
                "file": self.output, "seconds": seconds, "frames": performance.dance.frames, "fps": RATE,
                "player": performance.stage.player().iter().map(|p| json!({
                    "id": p.part.id, "ja": p.part.ja, "romaji": p.part.romaji, "en": p.part.en, "joint": p.joint,
                })).collect::<Vec<_>>(),
                "cameras": scene.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(),
            }));
        } else {
            println!("{seconds:.1} s of dance on {} ({})", preset.en, preset.ja);
            let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
            println!("cameras: {}", names.join(", "));
            println!("written to {}", self.output.display());
        }
        Ok(())
    }
}

/// Gold brocade, woven.
fn kinran(form: Option<&str>) -> Result<Robe> {
    let _span = tracing::info_span!("weave").entered();
    let space = ColourSpace::default();
    let fabric = Fabric::preset("kinran", space).context("kinran is a preset")?;
    let (size, extent) = fabric.repeats(REPEATS, TEXELS);
    let maps: Btf = Cloth::weave(&fabric, size, extent, Irregularity::default(), 0).btf;
    let form = form.unwrap_or(Robe::forms().next().map_or("", |f| f.0));
    Ok(Robe::new(Arc::new(maps), WIDE, form)?)
}
