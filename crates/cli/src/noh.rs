//! `yugen noh`: what a performance of Noh needs around the costume.

mod performance;

use crate::json;
use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use yugen_archive::formats::labels::Labels;
use yugen_archive::formats::{btf, gltf, toml};
use yugen_archive::{check_outputs, check_writable};
use yugen_noh::{
    Basis, DIMENSIONS, Dimension, EXPOSURE, Entry, FIRE_CANDELA, FIRE_KELVIN, Finish, FireLight, Hour,
    PRESETS, Part, Preset, Robe, RoofCover, RoofForm, Stage,
};
use yugen_optics::ColourSpace;
use yugen_reflectance::btf::Btf;

/// Builds a performance of Noh: its stage, its player.
// What a verb is for stands at its arguments.
#[derive(Subcommand)]
pub enum Noh {
    Stage(StageVerb),
    Performance(performance::PerformanceVerb),
}

impl Noh {
    /// Does it.
    pub fn run(self) -> Result<()> {
        match self {
            Self::Stage(v) => v.run(),
            Self::Performance(v) => v.run(),
        }
    }
}

/// Builds a Noh stage from a table of dimensions, every one of them marked measured or assumed.
///
/// `yugen noh stage --preset national -o stage.toml`, then `yugen render stage.toml --camera shomen -o shomen.png`: numbers are photometric
/// (a fire has 2000 candela), and the file says how pictures are shown, five stops down. `--set side=5.7` changes a dimension within
/// its range.
#[derive(Args)]
pub struct StageVerb {
    /// Which stage; `--list` has them all.
    #[arg(long, default_value = "national", value_name = "NAME")]
    preset: String,

    /// Where to: .toml (a scene; its meshes and pictures go into a folder of the same name beside it) or .glb (glTF, with
    /// the names of parts in Japanese, romaji and English).
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["list", "markdown", "json"])]
    output: Option<PathBuf>,

    /// Changes a dimension; may be repeated. `side` is width and depth.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment)]
    set: Vec<(String, f32)>,

    /// When it is.
    #[arg(long, value_parser = ["night", "dusk"], default_value = "night", value_name = "HOUR")]
    hour: String,

    /// How fires shine: as flames that flicker, as balls, as points (what glTF has), or not at all, for lights put there
    /// afterwards [default: flames in .toml, points in .glb, which has no flames].
    #[arg(long, value_parser = ["flames", "balls", "points", "out"], value_name = "HOW")]
    fires: Option<String>,

    /// Hangs a karaori of this cloth on a rack in the middle of the stage: maps (.btf, as `yugen capture weave` writes
    /// them), and how many millimetres they are wide where the file does not say, or for another size of the pattern.
    /// Cameras robe, robe_near and thread look at it. A file that does not say has 16 texels to a millimetre.
    #[arg(long, value_name = "FILE[:MM]")]
    robe: Option<String>,

    /// How the maps of the robe's cloth reflect: ward_gmd, paper (the paper's equations to the letter), ward_duer,
    /// beckmann, ggx or, to compare, the isotropic blinn_phong [default: what the file says].
    #[arg(long, value_name = "FORM", requires = "robe")]
    form: Option<String>,

    /// The presets, and every dimension with its value, range and source.
    #[arg(long)]
    list: bool,

    /// As JSON: the table; with an output, what was written.
    #[arg(long)]
    json: bool,

    /// As the page docs/stage.md.
    #[arg(long, conflicts_with_all = ["json", "list", "output"])]
    markdown: bool,
}

fn assignment(text: &str) -> Result<(String, f32), String> {
    let pair = text.split_once('=').and_then(|(k, v)| Some((k.trim().to_string(), v.trim().parse().ok()?)));
    pair.ok_or_else(|| "expected KEY=VALUE with a number, as in side=5.7".into())
}

impl StageVerb {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if self.markdown {
            print!("{}", page());
            return Ok(());
        }
        let preset = Preset::find(&self.preset)?;
        let mut dimensions = preset.dimensions();
        for (key, value) in &self.set {
            dimensions.set(key, *value)?;
        }
        dimensions.check()?;
        let Some(output) = &self.output else {
            if self.json {
                json::print(table(preset, &dimensions));
            } else {
                list(preset, &dimensions);
            }
            return Ok(());
        };
        if self.list {
            bail!("--list prints and writes nothing; leave out --list or --output");
        }
        let glb = match extension(output).as_str() {
            "glb" => true,
            "toml" => false,
            _ => bail!("{}: a stage is written as .toml or .glb", output.display()),
        };
        check_writable(output)?;
        check_outputs([output.as_path()])?;
        let mut stage = Stage::new(preset, dimensions)?;
        if let Some(robe) = &self.robe {
            if glb {
                bail!("glTF has no maps of a cloth; write a stage with a robe as .toml");
            }
            stage = stage.with_robe(cloth(robe, self.form.as_deref())?);
        }
        let light = match (self.fires.as_deref(), glb) {
            (Some("flames"), _) | (None, false) => FireLight::Flames,
            (Some("balls"), _) => FireLight::Balls,
            (Some("out"), _) => FireLight::Out,
            _ => FireLight::Points,
        };
        if glb && light == FireLight::Flames {
            bail!("glTF has no flames; write the stage as .toml, or give --fires points");
        }
        let hour = if self.hour == "dusk" { Hour::Dusk } else { Hour::Night };
        let scene = {
            let _span = tracing::info_span!("make_textures").entered();
            stage.scene(hour, light)?
        };
        let labels = labels(&stage, "stage");
        if glb {
            gltf::write(output, &scene, &labels)?;
        } else {
            toml::write(output, &scene, &labels)?;
        }
        let triangles: usize = stage.parts().iter().map(|p| p.mesh.triangles.len()).sum();
        if self.json {
            let mut report = table(preset, &stage.layout().d);
            report["file"] = json!(output.display().to_string());
            report["triangles"] = json!(triangles);
            report["parts"] = json!(
                stage
                    .parts()
                    .iter()
                    .map(|p| json!({
                        "id": p.id, "ja": p.ja, "romaji": p.romaji, "en": p.en, "basis": p.basis.name(),
                        "dimensions": p.dimensions, "material": p.finish.name(), "triangles": p.mesh.triangles.len(),
                    }))
                    .collect::<Vec<_>>()
            );
            report["fires"] = json!(
                stage
                    .fires()
                    .iter()
                    .map(|f| json!({ "foot": f.foot.to_array(), "diameter": f.diameter }))
                    .collect::<Vec<_>>()
            );
            report["cameras"] = json!(scene.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>());
            json::print(report);
        } else {
            println!("{} ({}): {} parts, {triangles} triangles", preset.en, preset.ja, stage.parts().len());
            let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
            println!("cameras: {}", names.join(", "));
            println!("written to {}", output.display());
        }
        Ok(())
    }
}

/// The cloth of a robe, from FILE[:MM].
fn cloth(text: &str, form: Option<&str>) -> Result<Robe> {
    let (file, mm) = match text.rsplit_once(':') {
        // A colon may belong to the name.
        Some((file, mm)) if !mm.contains(['/', '\\', '.']) || mm.parse::<f32>().is_ok() => {
            let mm: f32 = mm.parse().with_context(|| {
                format!("--robe {text}: expected FILE[:MM], the millimetres that the maps are wide, as in cloth.btf:30")
            })?;
            (file, Some(mm))
        }
        _ => (text, None),
    };
    let (maps, about) = btf::load(Path::new(file), ColourSpace::default())?;
    // What `yugen capture weave` weaves where nobody says.
    let texel = about.texel_mm.unwrap_or(1.0 / 16.0);
    let width = mm.unwrap_or(texel * maps.width as f32);
    Ok(Robe::new(Arc::new(maps), 1e-3 * width, form.unwrap_or(&about.form))?)
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Names of a part, and the dimensions that shape it.
fn part_labels(stage: &Stage, p: &Part) -> Vec<(String, String)> {
    let pair = |k: &str, v: &str| (k.to_string(), v.to_string());
    let d = &stage.layout().d;
    let numbers: Vec<String> = p
        .dimensions
        .iter()
        .filter_map(|key| Some((key, d.entry(key)?)))
        .map(|(key, e)| format!("{key} = {} ({}: {})", e.value, e.basis.name(), e.source))
        .collect();
    vec![
        pair("ja", &p.ja),
        pair("romaji", &p.romaji),
        pair("en", &p.en),
        pair("basis", p.basis.name()),
        pair("dimensions", &numbers.join("; ")),
    ]
}

/// Names and remarks for the file, which a verb has made.
fn labels(stage: &Stage, verb: &str) -> Labels {
    let pair = |k: &str, v: &str| (k.to_string(), v.to_string());
    let shapes = stage.parts().iter().map(|p| part_labels(stage, p)).collect();
    // Shapes name the first material of a finish.
    let names =
        |f: &Finish| std::iter::once(f.name().to_string()).chain(vec![String::new(); f.materials() - 1]);
    let materials = stage.finishes().iter().flat_map(names).collect();
    let preset = stage.layout().preset;
    let about = vec![
        pair("stage", &format!("{} ({})", preset.en, preset.ja)),
        pair("notes", preset.notes),
        pair("made by", &format!("yugen noh {verb} {}", env!("CARGO_PKG_VERSION"))),
        pair("light", &format!("photometric: a candela is 1 W/sr; by firelight it wants {EXPOSURE} stops")),
    ];
    Labels { materials, shapes, about }
}

fn unit(d: &Dimension) -> String {
    if d.unit.is_empty() { String::new() } else { format!(" {}", d.unit) }
}

fn table(preset: &Preset, dimensions: &yugen_noh::Dimensions) -> serde_json::Value {
    let rows: Vec<_> = dimensions
        .iter()
        .map(|(d, e)| {
            json!({
                "key": d.key, "unit": d.unit, "value": e.value, "min": d.min, "max": d.max,
                "basis": e.basis.name(), "source": e.source, "meaning": d.doc,
            })
        })
        .collect();
    json!({
        "preset": preset.name, "ja": preset.ja, "en": preset.en, "notes": preset.notes,
        "measured_at": preset.measured_at.name(), "roof": roof(preset),
        "presets": PRESETS.iter().map(|p| p.name).collect::<Vec<_>>(),
        "dimensions": rows,
    })
}

fn roof(preset: &Preset) -> &'static str {
    match (preset.roof, preset.cover) {
        (RoofForm::Kirizuma, RoofCover::Bark) => "gable (kirizuma), cypress bark",
        (RoofForm::Kirizuma, RoofCover::Copper) => "gable (kirizuma), copper",
        (RoofForm::Irimoya, _) => "hipped gable in front (irimoya), gable behind, cypress bark",
    }
}

fn list(preset: &Preset, dimensions: &yugen_noh::Dimensions) {
    println!("Presets:");
    for p in PRESETS {
        println!("  {:9}  {} ({})", p.name, p.en, p.ja);
    }
    println!("\n{} ({}), measured {}:", preset.en, preset.ja, preset.measured_at.name());
    for (d, e) in dimensions.iter() {
        let value = format!("{}{}", e.value, unit(d));
        println!(
            "  {:20} {value:>12}  {:8}  {}: {} to {}; {}",
            d.key,
            e.basis.name(),
            d.doc,
            d.min,
            d.max,
            e.source
        );
    }
}

/// Text as a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

/// The page in Markdown.
fn page() -> String {
    let mut out = format!(
        "# The Noh stage\n\n\
         `yugen noh stage --preset NAME -o stage.toml` builds a Noh stage as a scene, `-o stage.glb` as a glTF file whose nodes \
         carry the names of parts (`extras`: `ja`, `romaji`, `en`, `basis`, `dimensions`). `--set KEY=VALUE` changes a \
         dimension within its range; numbers that cannot be together are refused with the reason. `--hour dusk` puts the last \
         light of the day in the sky, `--fires` says whether they are flames, balls, points or out, `--list` and `--json` print what \
         this page has. This page is written by `yugen noh stage --markdown` from the table that the generator itself reads; a \
         test keeps it true.\n\n\
         The origin is the middle of the main floor's surface; +y is up, +z points to the front seats, -x to the left of who \
         sits there; metres. Light is photometric, a candela being 1 W/sr: a fire has {FIRE_CANDELA} cd at {FIRE_KELVIN} K, and \
         the scene file is shown at an exposure of {EXPOSURE} stops, and pictures of the `.glb` want `--exposure {EXPOSURE} --curve agx`. \
         Cameras: the seats `shomen` (front), `waki-shomen` (side), `naka-shomen` (between), and near views; `yugen info stage.toml` lists them.\n\n\
         Every part is a closed surface. What the table marks as assumed was found in no dimensioned source; a part is measured \
         where all the dimensions that shape it are.\n\n\
         ![Four instants of the stage at night](images/stage_flicker.jpg)\n\n\
         `yugen render stage.toml --camera whole --frames 0-3 --fps 3 --size 480x270 --spp 48 --denoise -o stage_%02d.png`: the flames \
         flicker, and their light with them, and it falls off with the distance from each (Wakita et al., Fig. 12).\n\n\
         ## Presets\n\n\
         | preset | stage | roof | width and depth are measured | what is known besides |\n|---|---|---|---|---|\n"
    );
    for p in PRESETS {
        let _ = writeln!(
            out,
            "| `{}` | {} ({}) | {} | {} | {} |",
            p.name,
            p.en,
            p.ja,
            roof(p),
            p.measured_at.name(),
            cell(p.notes)
        );
    }
    out.push_str("\n## Dimensions\n\n| key | default | range | basis | what it is | source |\n|---|---|---|---|---|---|\n");
    let row = |d: &Dimension, e: Entry| {
        format!(
            "| `{}` | {}{} | {} to {} | {} | {} | {} |\n",
            d.key,
            e.value,
            unit(d),
            d.min,
            d.max,
            e.basis.name(),
            cell(d.doc),
            cell(e.source)
        )
    };
    for d in DIMENSIONS {
        out.push_str(&row(d, Entry { value: d.default, basis: d.basis, source: d.source }));
    }
    out.push_str(
        "\n## What presets change\n\n| preset | key | value | basis | source |\n|---|---|---|---|---|\n",
    );
    for p in PRESETS {
        for (key, value, basis, source) in p.values {
            let unit = DIMENSIONS.iter().find(|d| d.key == *key).map(unit).unwrap_or_default();
            let _ = writeln!(
                out,
                "| `{}` | `{key}` | {value}{unit} | {} | {} |",
                p.name,
                basis.name(),
                cell(source)
            );
        }
    }
    let head = "| name | Japanese | romaji | English | basis | material |\n|---|---|---|---|---|---|\n";
    let mut stage = Stage::preset(PRESETS[0].name).ok();
    let bare = stage.as_ref().map_or(0, |s| s.parts().len());
    let none = Btf { width: 1, height: 1, colour_space: ColourSpace::default(), texels: vec![btf::NOTHING] };
    if let Ok(robe) = Robe::new(Arc::new(none), 1e-2, &btf::About::default().form) {
        stage = stage.map(|s| s.with_robe(robe));
    }
    let _ = write!(
        out,
        "\n## Parts\n\nNames of nodes and shapes, with the basis in the preset `national`.\n\n{head}"
    );
    for (i, p) in stage.iter().flat_map(Stage::parts).enumerate() {
        if i == bare {
            let forms: Vec<String> = Robe::forms().map(|(name, _)| format!("`{name}`")).collect();
            let _ = write!(
                out,
                "\n## A robe\n\n\
                 `yugen capture weave kinran --repeats 3x2 -o kinran`, then `yugen noh stage --robe kinran/cloth.btf -o \
                 stage.toml` hangs a karaori of that cloth on a lacquered rack on the main floor, its back to the front \
                 seats, where no pillar keeps the light of the front fires from it. `--robe FILE:MM` says how many \
                 millimetres the maps are wide; without, the file's own size counts. A larger number makes a larger \
                 pattern, for what is to be seen from the seats: `cloth.btf:90` has hexagons of three centimetres \
                 instead of one.\n\n\
                 The robe is cut out of rectangles as wide as the loom wove, lined, and bent without stretching; (u, v) \
                 are metres on the cloth, the warp runs down, and every panel begins elsewhere on the bolt. Cameras: \
                 `robe` (all of it, from the front), `robe_near`, `thread` (four centimetres). They are near the light: \
                 an exposure of -6.5 stops shows the cloth. `--form` chooses how the maps reflect, so that two files \
                 that differ by it are the comparison of Wakita et al., Fig. 13: {}. \
                 Other textures become coarser where the maps are so large that a WebGPU device would not bind all at \
                 once.\n\n\
                 ![The back of the robe as blinn_phong and as ward_gmd](images/robe_forms.jpg)\n\n{head}",
                forms.join(", ")
            );
        }
        let basis = if p.basis == Basis::Measured { "measured" } else { "assumed" };
        let _ = writeln!(
            out,
            "| `{}` | {} | {} | {} | {basis} | `{}` |",
            p.id,
            p.ja,
            p.romaji,
            p.en,
            p.finish.name()
        );
    }
    out
}
