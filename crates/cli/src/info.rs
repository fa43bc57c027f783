//! `yugen info`: what a file holds.

mod facts;
mod motion;
mod scene;

use crate::{argument, json};
use anyhow::{Context, Result, bail};
use clap::Args;
use facts::Facts;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{self, About};
use yugen_archive::formats::mixed::Functions;
use yugen_archive::formats::motion::Loaded;
use yugen_archive::formats::relightable::{Colouring, DEFAULT_MAX_TEXELS};
use yugen_archive::formats::relit_contents::Contents;
use yugen_archive::formats::relit_files;
use yugen_archive::formats::stack::{self, Folder, Response};
use yugen_archive::formats::{
    self, FORMATS, btf, colour_chart, exif, exposures, goniometer, goniometer_csv, instrument, load_scene,
    lp, merl, neural_brdf, obj, pca_basis, ply, readings, response, rgl, serialized, wif,
};
use yugen_archive::{Error, list_folder, read_bounded};
use yugen_optics::{ColourSpace, Vec3};
use yugen_reflectance::tabulated::Goniometry;
use yugen_scene::Mesh;
use yugen_scene::nearest;

/// Tells what a file or a folder holds: a scene, a mesh, a stack of photographs, a picture, the maps of a cloth, RTI, a
/// measured table, a weave, motion, a list.
///
/// `yugen info scene.xml` says what it is, how large, and what is in it: cameras, lights, materials, textures with
/// their memory, animations; channels, colours and metadata of a picture; angles of a table.
#[derive(Args)]
pub struct Info {
    /// The file, or the folder of a stack.
    file: PathBuf,

    #[command(flatten)]
    reading: argument::Reading,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

/// Text files and tables have so many bytes at most.
const MAX_TABLE: u64 = 4 << 30;

/// What tells of a kind of file.
struct Teller {
    /// Lower case.
    extensions: &'static [&'static str],
    tell: fn(&Path) -> Result<Facts>,
}

/// Everything but scenes, folders and pictures.
const TELLERS: &[Teller] = &[
    Teller { extensions: &["obj"], tell: obj_mesh },
    Teller { extensions: &["ply"], tell: ply_mesh },
    Teller { extensions: &["serialized"], tell: serialized_mesh },
    Teller { extensions: &["btf"], tell: cloth },
    Teller { extensions: &["ptm", "rti"], tell: relightable_picture },
    Teller { extensions: &["lp"], tell: lights },
    Teller { extensions: &["wif"], tell: draft },
    Teller { extensions: &["binary"], tell: merl_table },
    Teller { extensions: &["bsdf"], tell: rgl_table },
    Teller { extensions: &["gonio"], tell: gonio_table },
    Teller { extensions: &["f32"], tell: encodings },
    Teller { extensions: &["pca"], tell: basis },
    Teller { extensions: &["bvh", "c3d", "trc", "asf", "amc", "tsv"], tell: movement },
    Teller { extensions: &["csv", "txt"], tell: list },
];

impl Info {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let named = Facts::default().say("file", self.file.display().to_string());
        let bytes = std::fs::metadata(&self.file).map_err(|e| Error::io(&self.file, e))?;
        let named = named.say("bytes", bytes.is_file().then_some(bytes.len()));
        let told = self.tell()?;
        let facts = named.and(told);
        if self.json {
            json::print(facts.json());
        } else {
            print!("{}", facts.text());
        }
        Ok(())
    }

    fn tell(&self) -> Result<Facts> {
        let file = self.file.as_path();
        let extension = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if file.is_dir() {
            return folder(file);
        }
        if file.file_name().is_some_and(|n| n == stack::OPTIONS) {
            return folder(file.parent().unwrap_or(Path::new("")));
        }
        if relit_files::recognises(file) {
            return relightable_picture(file);
        }
        if instrument::FORMATS.iter().any(|f| f.extensions.contains(&extension.as_str()))
            && instrument::format_of(file).is_some()
        {
            return instrument_readings(file);
        }
        if FORMATS.iter().any(|f| f.extensions.contains(&extension.as_str())) {
            return self.scene(&extension);
        }
        if let Some(teller) = TELLERS.iter().find(|t| t.extensions.contains(&extension.as_str())) {
            return (teller.tell)(file);
        }
        if let Err(e) = image::check_kind(file) {
            let scenes = FORMATS.iter().flat_map(|f| f.extensions);
            let known = TELLERS.iter().flat_map(|t| t.extensions).chain(scenes).copied();
            bail!(
                "{e}{}",
                nearest(&extension, known).map_or(String::new(), |n| format!("; did you mean .{n}?"))
            );
        }
        let about = image::about(file)?;
        // The maps of a cloth are a picture as well.
        if about.channels.iter().any(|c| c.name == "sigma.X") {
            return Ok(cloth(file)?.and(picture(about)));
        }
        Ok(Facts::default().say("kind", "picture").and(picture(about)))
    }

    fn scene(&self, extension: &str) -> Result<Facts> {
        let options = self.reading.options();
        let scene = load_scene(&self.file, &options)?;
        let format = FORMATS.iter().find(|f| f.extensions.contains(&extension));
        let facts = Facts::default()
            .say("kind", "scene")
            .say("format", format.map(|f| f.name))
            .and(scene::facts(&scene));
        if !scene.moves() {
            return Ok(facts);
        }
        let moving = scene.clips().into_iter().map(|(name, [first, last])| {
            Facts::default()
                .say("name", name)
                .say("from_seconds", json!(first))
                .say("to_seconds", json!(last))
        });
        Ok(facts.list("animations", moving))
    }
}

/// A file of motion, for verbs that read it in their own way.
pub fn of_motion(file: &Path, loaded: &Loaded) -> Facts {
    Facts::default().say("file", file.display().to_string()).and(motion::facts(loaded))
}

fn movement(file: &Path) -> Result<Facts> {
    let options = formats::motion::Options { guess: true, ..Default::default() };
    let loaded = formats::motion::load(file, &options)?;
    Ok(motion::facts(&loaded))
}

fn bytes_of(file: &Path) -> Result<Vec<u8>> {
    Ok(read_bounded(file, MAX_TABLE)?)
}

fn mesh(mesh: &Mesh) -> Facts {
    let corner = |f: fn(Vec3, Vec3) -> Vec3| mesh.positions.iter().copied().reduce(f);
    let has = |what: bool| what.then_some(true);
    let mut facts = Facts::default()
        .say("vertices", mesh.positions.len())
        .say("triangles", mesh.triangles.len())
        .say("normals", has(!mesh.normals.is_empty()))
        .say("texture_coordinates", has(!mesh.uvs.is_empty()))
        .say("tangents", has(!mesh.tangents.is_empty()));
    if let (Some(low), Some(high)) = (corner(Vec3::min), corner(Vec3::max)) {
        facts = facts.group("bounds", scene::box_of([low, high]));
    }
    let attributes = mesh.attributes.iter();
    facts
        .list(
            "attributes",
            attributes
                .map(|(name, width, _)| Facts::default().say("name", name.clone()).say("width", *width)),
        )
        .say("memory_bytes", scene::mesh_bytes(mesh))
}

fn obj_mesh(file: &Path) -> Result<Facts> {
    let obj = obj::read(&bytes_of(file)?, file)?;
    let parts = obj.parts.iter().map(|p| {
        Facts::default()
            .say("material", p.material.clone().unwrap_or_else(|| "none".into()))
            .say("triangles", p.triangles.len())
    });
    let facts = Facts::default().say("kind", "mesh").say("format", "Wavefront OBJ").and(mesh(&obj.mesh));
    Ok(facts
        .list("parts", parts)
        .say("material_libraries", Some(obj.libraries.join(", ")).filter(|l| !l.is_empty())))
}

fn ply_mesh(file: &Path) -> Result<Facts> {
    Ok(Facts::default()
        .say("kind", "mesh")
        .say("format", "PLY")
        .and(mesh(&ply::read(&bytes_of(file)?, file)?)))
}

fn serialized_mesh(file: &Path) -> Result<Facts> {
    let bytes = bytes_of(file)?;
    let first = serialized::read(&bytes, 0, file)?;
    Ok(Facts::default()
        .say("kind", "mesh")
        .say("format", "Mitsuba serialized, its first shape")
        .say("name", Some(first.mesh.name.clone()).filter(|n| !n.is_empty()))
        .say("face_normals", first.face_normals)
        .and(mesh(&first.mesh)))
}

fn picture(about: About) -> Facts {
    let About { format, width, height, channels, codes, chromaticities, attributes, camera, .. } = about;
    let bits = codes.map(|c| 32 - c.leading_zeros());
    let each = channels.iter().map(|c| {
        Facts::default()
            .say("name", c.name.clone())
            .say("least", c.range.map_or(Value::Null, |r| json!(r[0])))
            .say("most", c.range.map_or(Value::Null, |r| json!(r[1])))
            .say("mean", json!(c.mean as f32))
            .say("negative", Some(c.negative).filter(|n| *n > 0))
            .say("not_finite", Some(c.not_finite).filter(|n| *n > 0))
    });
    // Some writers fill the field with zeros.
    let chromaticities = chromaticities.filter(|c| c.as_flattened().iter().any(|v| *v != 0.0));
    let space = chromaticities.map(|c| scene::space_name(c).unwrap_or("named by its chromaticities"));
    let metadata = attributes.iter().map(|(name, value)| {
        Facts::default().say("name", name.clone()).say("value", value.chars().take(200).collect::<String>())
    });
    Facts::default()
        .say("format", format)
        .say("size", json!([width, height]))
        .say("bits", bits)
        .say(
            "colour_space",
            space.unwrap_or("not said; linear sRGB is assumed for floats, sRGB for integers"),
        )
        .say("chromaticities", chromaticities.map_or(Value::Null, |c| json!(c.as_flattened())))
        .list("channels", each)
        .say("memory_bytes", 4 * width * height * channels.len())
        .say("exposure_seconds", camera.seconds.map_or(Value::Null, |s| json!(s)))
        .say("f_number", camera.f_number.map_or(Value::Null, |s| json!(s)))
        .say("iso", camera.iso)
        .say("focal_length_35mm", camera.focal_35mm.map_or(Value::Null, |f| json!(f)))
        .list("metadata", metadata)
}

fn cloth(file: &Path) -> Result<Facts> {
    let (maps, about) = btf::load(file, ColourSpace::LinearSrgb)?;
    let seen: Vec<f32> = maps.texels.iter().map(|t| t.confidence).filter(|c| *c > 0.0).collect();
    let mean = seen.iter().map(|c| f64::from(*c)).sum::<f64>() / seen.len().max(1) as f64;
    let widths = |f: fn(f32, f32) -> f32, start: f32| {
        maps.texels.iter().flat_map(|t| t.sigma.to_array()).fold(start, f)
    };
    Ok(Facts::default()
        .say("kind", "maps of a cloth")
        .say("size", json!([maps.width, maps.height]))
        .say("form", about.form)
        .say("texel_mm", about.texel_mm.map_or(Value::Null, |mm| json!(mm)))
        .say("lights", Some(about.lights).filter(|n| *n > 0))
        .say("source", Some(about.source).filter(|s| !s.is_empty()))
        .say("texels_without_cloth", maps.texels.len() - seen.len())
        .say("mean_confidence", json!(mean as f32))
        .say("sigma", json!([widths(f32::min, f32::INFINITY), widths(f32::max, 0.0)]))
        .say("memory_bytes", size_of_val(&maps.texels[..])))
}

fn relightable_picture(file: &Path) -> Result<Facts> {
    let picture = relit_files::read(file, DEFAULT_MAX_TEXELS)?;
    let linear = relit_files::says_linear(file, DEFAULT_MAX_TEXELS)?;
    let (basis, colouring) = match &picture {
        Contents::Terms(r) if r.colouring == Colouring::Rgb => (r.basis.name().to_string(), "rgb"),
        Contents::Terms(r) => (r.basis.name().to_string(), "lrgb"),
        Contents::Mixed(m) => match m.functions {
            Functions::Luminance(basis) => (basis.name().to_string(), "luminance"),
            Functions::Sampled { .. } => (m.functions.name(), "components"),
        },
    };
    Ok(Facts::default()
        .say("kind", "picture whose light can be moved")
        .say("basis", basis)
        .say("colouring", colouring)
        .say("values", if linear { "linear" } else { "display" })
        .say("size", json!(picture.size()))
        .say("numbers_per_texel", picture.stride())
        .say("memory_bytes", size_of_val(picture.coefficients())))
}

/// A stack, several of them, what RelightLab writes, or photographs that are no stack yet.
fn folder(path: &Path) -> Result<Facts> {
    if relit_files::recognises(path) {
        return relightable_picture(path);
    }
    let options = stack::Options::read(path)?;
    if stack::inside(path, &options.lights).is_file() {
        return opened(&Folder::open(path)?);
    }
    if path.join("views.csv").is_file() {
        let stacks = list_folder(path)?;
        let stacks = stacks.iter().filter(|p| p.join(stack::LIGHTS).is_file());
        let each =
            stacks.map(|p| Ok(Facts::default().say("folder", name_of(p)).and(opened(&Folder::open(p)?)?)));
        return Ok(Facts::default()
            .say("kind", "stacks of the same cloth from several sides")
            .list("stacks", each.collect::<Result<Vec<_>>>()?));
    }
    let files = stack::pictures(path, &[stack::MASK])?;
    if files.is_empty() {
        bail!(
            "{}: there is no picture in this folder, and no list of lights; name a file in it",
            path.display()
        );
    }
    let mut seconds: Vec<f32> = Vec::new();
    for file in &files {
        seconds.extend(exif::read(file)?.seconds);
    }
    seconds.sort_by(f32::total_cmp);
    seconds.dedup();
    Ok(Facts::default()
        .say("kind", "photographs without a list of lights")
        .say("pictures", files.len())
        .say("exposure_seconds", if seconds.is_empty() { Value::Null } else { json!(seconds) })
        .say("list_of_exposures", path.join("exposures.csv").is_file()))
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn opened(folder: &Folder) -> Result<Facts> {
    let o = &folder.options;
    let lights = folder.pictures.iter().map(|p| p.light);
    let covered =
        folder.mask.as_ref().map(|m| m.iter().filter(|m| **m).count() as f32 / m.len().max(1) as f32);
    let response = match o.response {
        Response::Srgb => "srgb".to_string(),
        Response::Linear => "linear".to_string(),
        Response::Power(p) => format!("power {p}"),
    };
    Ok(Facts::default()
        .say("kind", "stack of photographs")
        .say("pictures", folder.pictures.len())
        .say("size", json!([folder.width, folder.height]))
        .say("channels", folder.channels)
        .say("colour_space", folder.colour_space.name())
        .say("response", response)
        .group("lights", directions(lights, o.near))
        .say("view", if o.view == Vec3::Z { Value::Null } else { json!(o.view.to_array()) })
        .say("white", json!(o.white))
        .say("intensities", Some(o.intensities.len()).filter(|n| *n > 0))
        .say("ambient", o.ambient.clone())
        .say("masked_in", covered.map_or(Value::Null, |c| json!(c)))
        .say("first", folder.pictures.first().map(|p| name_of(&p.path)))
        .say("memory_bytes", 12 * folder.width * folder.height * folder.pictures.len()))
}

fn directions(lights: impl Iterator<Item = Vec3>, near: bool) -> Facts {
    let (mut count, mut polar, mut distance) = (0, [f32::INFINITY, 0.0f32], [f32::INFINITY, 0.0f32]);
    for light in lights {
        let angle = light.z.atan2(light.truncate().length()).to_degrees();
        let angle = 90.0 - angle;
        count += 1;
        polar = [polar[0].min(angle), polar[1].max(angle)];
        distance = [distance[0].min(light.length()), distance[1].max(light.length())];
    }
    Facts::default()
        .say("count", count)
        .say("near", near)
        .say("polar_degrees", if count > 0 { json!(polar) } else { Value::Null })
        .say("distance", if near { json!(distance) } else { Value::Null })
}

fn lights(file: &Path) -> Result<Facts> {
    // With its pictures it is a stack.
    if let Ok(folder) = Folder::open(file) {
        return opened(&folder);
    }
    let entries = lp::read(&bytes_of(file)?, file, lp::Axes::default())?;
    let facts = Facts::default().say("kind", "list of lights, its pictures are not beside it");
    Ok(facts.and(directions(entries.iter().map(|e| e.light), false)))
}

fn draft(file: &Path) -> Result<Facts> {
    let draft = wif::read(&bytes_of(file)?, file, ColourSpace::LinearSrgb)?;
    let colours = |threads: &[wif::Thread]| {
        let mut all: Vec<[u32; 3]> = threads.iter().map(|t| t.colour.to_array().map(f32::to_bits)).collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    };
    let side = |threads: &[wif::Thread]| {
        Facts::default()
            .say("threads", threads.len())
            .say("colours", colours(threads))
            .say("spacing_mm", threads.first().map_or(Value::Null, |t| json!(t.spacing)))
    };
    let treadles = match &draft.shedding {
        wif::Shedding::Treadles { tie_up, .. } => Some(tie_up.len()),
        wif::Shedding::LiftPlan(_) => None,
    };
    let up = draft.drawdown();
    let share = up.iter().filter(|u| **u).count() as f32 / up.len().max(1) as f32;
    Ok(Facts::default()
        .say("kind", "weaving draft")
        .say("title", Some(draft.title.clone()).filter(|t| !t.is_empty()))
        .say("shafts", draft.shafts)
        .say("treadles", treadles)
        .say("lift_plan", treadles.is_none().then_some(true))
        .say("rising_shed", draft.rising)
        .group("warp", side(&draft.warp))
        .group("weft", side(&draft.weft))
        .say("warp_on_top", json!(share)))
}

fn merl_table(file: &Path) -> Result<Facts> {
    let values = merl::read(&bytes_of(file)?, file, ColourSpace::LinearSrgb)?;
    let measured = values.chunks_exact(3).filter(|v| v[0] >= 0.0);
    let most = measured.clone().flatten().copied().fold(0.0, f32::max);
    let count = measured.count();
    Ok(table("MERL", "merl")
        .say("bins", values.len() / 3)
        .say("measured", count)
        .say("largest", json!(most))
        .say("isotropic", true))
}

fn table(format: &str, model: &str) -> Facts {
    Facts::default().say("kind", "measured reflectance").say("format", format).say("model", model)
}

fn rgl_table(file: &Path) -> Result<Facts> {
    let bytes = bytes_of(file)?;
    let m = rgl::read(&bytes, file, ColourSpace::LinearSrgb)?;
    let fields = rgl::fields(&bytes, file)?;
    let described = fields
        .iter()
        .find(|f| f.name == "description")
        .map(|f| String::from_utf8_lossy(f.bytes).into_owned());
    Ok(table("RGL", "rgl")
        .say("description", described.map(|d| d.trim_end_matches('\0').to_string()))
        .say("isotropic", m.phi.len() <= 2)
        .say("azimuths_of_the_eye", m.phi.len())
        .say("polar_angles_of_the_eye", m.theta.len())
        .list(
            "fields",
            fields.iter().map(|f| Facts::default().say("name", f.name.clone()).say("shape", json!(f.shape))),
        ))
}

fn instrument_readings(file: &Path) -> Result<Facts> {
    let m = instrument::load(file, ColourSpace::LinearSrgb)?;
    let steepest = |to: fn(&instrument::Reading) -> Vec3| {
        let lowest = m.readings.iter().map(|r| to(r).z).fold(1.0, f32::min);
        json!(lowest.clamp(-1.0, 1.0).acos().to_degrees())
    };
    let most = m.readings.iter().map(|r| r.f.max_element()).fold(0.0, f32::max);
    let left_out = (!m.left_out.is_empty()).then(|| m.left_out.clone());
    Ok(table(m.format, "tabulated")
        .say("readings", m.readings.len())
        .say("largest", json!(most))
        .say("light_up_to_degrees", steepest(|r| r.wi))
        .say("eye_up_to_degrees", steepest(|r| r.wo))
        .say("isotropic", m.isotropic)
        .say("not_read", left_out.map_or(Value::Null, |l| json!(l))))
}

fn gonio_table(file: &Path) -> Result<Facts> {
    Ok(angles("goniometer", &goniometer::read(&bytes_of(file)?, file, ColourSpace::LinearSrgb)?))
}

fn angles(format: &str, g: &Goniometry) -> Facts {
    let axis = |all: &[f32]| {
        Facts::default()
            .say("count", all.len())
            .say("from_degrees", all.first().map_or(Value::Null, |a| json!(a.to_degrees())))
            .say("to_degrees", all.last().map_or(Value::Null, |a| json!(a.to_degrees())))
    };
    let values = g.rgb.chunks_exact(3);
    let missing = values.clone().filter(|v| v[0].is_nan()).count();
    let most = g.rgb.iter().copied().filter(|v| v.is_finite()).fold(0.0, f32::max);
    table(format, "tabulated")
        .group("theta_o", axis(&g.theta_o))
        .group("phi_o", axis(&g.phi_o))
        .group("theta_i", axis(&g.theta_i))
        .group("phi_d", axis(&g.phi_d))
        .say("readings", values.len() - missing)
        .say("missing", missing)
        .say("largest", json!(most))
        .say("isotropic", g.phi_o.len() == 1)
}

fn encodings(file: &Path) -> Result<Facts> {
    let all = neural_brdf::read(&bytes_of(file)?, file)?;
    let beside = file.with_extension("names.txt");
    let names = match beside.is_file() {
        true => neural_brdf::read_names(&bytes_of(&beside)?, &beside, all.len())?,
        false => Vec::new(),
    };
    Ok(Facts::default()
        .say("kind", "neural encodings of measured reflectance")
        .say("materials", all.len())
        .say("names", if names.is_empty() { Value::Null } else { json!(names) }))
}

fn basis(file: &Path) -> Result<Facts> {
    let basis = pca_basis::read(&bytes_of(file)?, file)?;
    Ok(Facts::default()
        .say("kind", "basis of measured reflectance")
        .say("materials", basis.names.len())
        .say("components", basis.components)
        .say("rows", basis.bins.len())
        .say("singular_values", json!(basis.singular))
        .say("names", json!(basis.names)))
}

/// A text of numbers, told by its columns: the first reader that understands it.
fn list(file: &Path) -> Result<Facts> {
    let bytes = bytes_of(file)?;
    if formats::motion::recognises(&bytes, file) {
        return movement(file);
    }
    let kind = |kind: &str| Facts::default().say("kind", kind);
    if let Ok(all) = exposures::read(&bytes, file) {
        let mut lights: Vec<&str> = all.iter().map(|e| e.light.as_str()).collect();
        lights.sort_unstable();
        lights.dedup();
        let facts = kind("list of exposures").say("pictures", all.len()).say("lights", lights.len());
        let seconds = |f: fn(f32, f32) -> f32| all.iter().map(|e| e.seconds).reduce(f);
        return Ok(match (seconds(f32::min), seconds(f32::max)) {
            (Some(short), Some(long)) => facts.say("seconds", json!([short, long])),
            _ => facts,
        });
    }
    if let Ok(patches) = colour_chart::read(&bytes, file) {
        return Ok(kind("colour chart").say("patches", patches.len()));
    }
    if let Ok(texels) = goniometer_csv::read_texels(&bytes, file, ColourSpace::LinearSrgb) {
        return Ok(kind("readings of a goniometer, texel by texel")
            .say("size", json!([texels.width, texels.height]))
            .say("readings", texels.values.len()));
    }
    if let Ok(grid) = goniometer_csv::read(&bytes, file, ColourSpace::LinearSrgb) {
        return Ok(angles("goniometer table", &grid));
    }
    if let Ok(levels) = response::read(&bytes, file) {
        return Ok(kind("response of a camera").say("levels", levels.len()));
    }
    let lines = readings::read(&bytes, file).context(
        "this is no list of exposures, colour chart, goniometer table or response; as readings of reflectance",
    )?;
    let valued = lines.iter().filter(|l| l.f.is_some()).count();
    Ok(kind("readings of reflectance").say("lines", lines.len()).say("with_values", valued))
}
