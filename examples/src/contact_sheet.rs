//! The contact sheet: six fabrics, gold brocade by a fire, models from Lambert to a measurement, structural colour and
//! the lecture's red ball.
//!
//! Writes `out/demo/sheet.png`, the single pictures, a film of a performance, the scenes they were made from and a page that shows them,
//! `out/demo/index.html`. Each picture has its share of the time, gets as many samples as fit into it, and is denoised, so
//! that the sheet takes about as long on any machine and is the better the faster it is; with `--samples N` it is the same
//! on all.

mod film;

use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use std::time::Instant;
use yugen_archive::atomic_write;
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_archive::formats::{Options as LoadOptions, load_scene};
use yugen_optics::tonemap::Curve;
use yugen_optics::{ColourSpace, Image};
use yugen_scene::Scene;
use yugen_transport::render::{Action, Budget, Job, Options};

/// One picture.
struct Picture {
    /// Stem of its files.
    name: &'static str,
    english: &'static str,
    japanese: &'static str,
    scene: String,
    /// How long it takes, seconds.
    seconds: f64,
}

const FABRIC: &str = include_str!("../scenes/fabric.toml");
/// The preset of `fabric.toml`, which gives way to each of these.
const PRESET: &str = "preset = \"silk_shot\"";
const FABRICS: [(&str, &str, &str); 6] = [
    ("linen_plain", "Linen, plain weave", "麻・平織"),
    ("silk_crepe_de_chine", "Silk crêpe de Chine", "絹クレープデシン"),
    ("polyester_satin_charmeuse", "Polyester satin charmeuse, front", "サテン・シャルムーズ(表)"),
    ("polyester_satin_charmeuse_back", "Polyester satin charmeuse, back", "サテン・シャルムーズ(裏)"),
    ("silk_shot", "Shot silk", "玉虫織の絹"),
    ("velvet", "Velvet", "ビロード"),
];

/// Name, captions, scene, seconds.
const SCENES: [(&str, &str, &str, &str, f64); 9] = [
    ("brocade", "Gold brocade by a fire", "火明かりの金襴", include_str!("../scenes/brocade.toml"), 20.0),
    (
        "models",
        "Six models: Lambert, Phong, Cook-Torrance; Ward, a table, a morpho wing",
        "六つの反射モデル:ランバート、フォン、クック・トランス、ワード、計測表、モルフォ蝶",
        include_str!("../scenes/models.toml"),
        12.0,
    ),
    (
        "roughness",
        "Gold from smooth to rough",
        "滑らかな金から粗い金まで",
        include_str!("../scenes/roughness.toml"),
        8.0,
    ),
    (
        "measured",
        "Brushed copper, as if measured",
        "ヘアライン仕上げの銅(計測表)",
        include_str!("../scenes/measured.toml"),
        9.0,
    ),
    (
        "films",
        "Structural colour: morpho wing, gold leaf on lacquer",
        "構造色:モルフォ蝶と漆地の金箔",
        include_str!("../scenes/films.toml"),
        10.0,
    ),
    (
        "red_ball_glossy_surface",
        "Red ball on a white desk, glossy, a surface light source",
        "白い机の赤い球・光沢・面光源",
        include_str!("../scenes/red_ball_glossy_surface.toml"),
        7.0,
    ),
    (
        "red_ball_glossy_point",
        "The same, a point light source",
        "同じ球・点光源",
        include_str!("../scenes/red_ball_glossy_point.toml"),
        7.0,
    ),
    (
        "red_ball_glossy_five",
        "The same, five point light sources",
        "同じ球・五つの点光源",
        include_str!("../scenes/red_ball_glossy_five.toml"),
        7.0,
    ),
    (
        "red_ball_mat_surface",
        "The same ball mat, a surface light source",
        "つや消しの球・面光源",
        include_str!("../scenes/red_ball_mat_surface.toml"),
        7.0,
    ),
];
/// What the scene of the brocade reads.
const HEXAGONS: &[u8] = include_bytes!("../scenes/hexagons.png");

fn pictures() -> Vec<Picture> {
    let fabrics = FABRICS.map(|(name, english, japanese)| Picture {
        name,
        english,
        japanese,
        scene: FABRIC.replace(PRESET, &format!("preset = \"{name}\"")),
        seconds: 9.0,
    });
    let scenes = SCENES.map(|(name, english, japanese, scene, seconds)| Picture {
        name,
        english,
        japanese,
        scene: scene.into(),
        seconds,
    });
    fabrics.into_iter().chain(scenes).collect()
}

/// How long the frames of the film take, seconds.
const FILM: f64 = 90.0;

/// Pixels of a side of one picture, and pictures in a row.
const SIZE: usize = 400;
const COLUMNS: usize = 5;
const GAP: usize = 6;

struct Arguments {
    samples: Option<u32>,
    out: PathBuf,
    only: Option<String>,
}

fn arguments() -> Result<Arguments> {
    let mut parsed = Arguments { samples: None, out: PathBuf::from("out/demo"), only: None };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().with_context(|| format!("{word} needs a value"));
        match word.as_str() {
            "--samples" => parsed.samples = Some(value()?.parse().context("--samples needs a number")?),
            "--out" => parsed.out = value()?.into(),
            "--only" => parsed.only = Some(value()?),
            other => bail!("there is no '{other}'; there are --samples N, --out FOLDER, --only NAME"),
        }
    }
    Ok(parsed)
}

fn main() -> Result<()> {
    let arguments = arguments()?;
    let out = &arguments.out;
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    atomic_write(&out.join("hexagons.png"), HEXAGONS)?;

    let started = Instant::now();
    let pictures = pictures();
    let rows = pictures.len().div_ceil(COLUMNS);
    let step = SIZE + GAP;
    let mut sheet = Image::rgb(COLUMNS * step + GAP, rows * step + GAP);
    let chosen = |p: &Picture| arguments.only.as_ref().is_none_or(|name| *name == p.name);
    if !pictures.iter().any(chosen) {
        let names: Vec<_> = pictures.iter().map(|p| p.name).collect();
        bail!("--only: expected one of {}", names.join(", "));
    }
    for (i, picture) in pictures.iter().enumerate().filter(|(_, p)| chosen(p)) {
        let clock = Instant::now();
        let file = out.join(format!("{}.toml", picture.name));
        atomic_write(&file, picture.scene.as_bytes())?;
        let scene = load_scene(&file, &LoadOptions::default())?;
        let samples = match arguments.samples {
            Some(samples) => samples,
            None => affordable(&scene, picture.seconds)?,
        };
        let rgb =
            render(&scene, samples)?.denoised().select(&["R", "G", "B"]).context("a picture has colours")?;
        let write = WriteOptions { curve: Curve::Aces, ..WriteOptions::from(scene.working_space) };
        image::write(&out.join(format!("{}.png", picture.name)), &rgb, &write)?;
        paste(&mut sheet, &rgb, GAP + (i % COLUMNS) * step, GAP + (i / COLUMNS) * step);
        println!(
            "{:2}/{}  {:<36} {:5.1} s",
            i + 1,
            pictures.len(),
            picture.name,
            clock.elapsed().as_secs_f64()
        );
    }
    let write = WriteOptions { curve: Curve::Aces, ..WriteOptions::from(ColourSpace::LinearRec2020) };
    image::write(&out.join("sheet.png"), &sheet, &write)?;
    // The picture of the README.
    image::write(&out.join("sheet.jpg"), &sheet, &write)?;
    if arguments.only.is_none() {
        film::film(out, FILM, arguments.samples.map(|s| s.clamp(2, 64)))?;
    }
    atomic_write(&out.join("index.html"), page(&pictures).as_bytes())?;
    println!(
        "{} and {} in {:.0} s",
        out.join("sheet.png").display(),
        out.join("index.html").display(),
        started.elapsed().as_secs_f64()
    );
    Ok(())
}

fn render(scene: &Scene, samples: u32) -> Result<Job> {
    let options = Options { budget: Some(Budget::Samples(samples)), denoise: true, ..Options::default() };
    let job = Job::new(scene, &options)?;
    job.run(|_, _| Action::Continue);
    Ok(job)
}

/// How many samples a pixel fit into the time, by what a few of them take. At least so many that a slow machine has a
/// picture too.
fn affordable(scene: &Scene, seconds: f64) -> Result<u32> {
    const TRIED: u32 = 4;
    let clock = Instant::now();
    render(scene, TRIED)?;
    let tried = clock.elapsed().as_secs_f64();
    Ok((f64::from(TRIED) * (seconds - tried) / tried).clamp(16.0, 1024.0) as u32)
}

fn paste(sheet: &mut Image, picture: &Image, left: usize, top: usize) {
    for y in 0..picture.height.min(SIZE) {
        for x in 0..picture.width.min(SIZE) {
            sheet.pixel_mut(left + x, top + y).copy_from_slice(picture.pixel(x, y));
        }
    }
}

fn page(pictures: &[Picture]) -> String {
    let figures: String = pictures
        .iter()
        .map(|p| {
            format!(
                "<figure><a href=\"{0}.toml\"><img src=\"{0}.png\" alt=\"{1}\" width=\"{SIZE}\" height=\"{SIZE}\"></a>\
                 <figcaption>{1}<br><span lang=\"ja\">{2}</span></figcaption></figure>\n",
                p.name, p.english, p.japanese
            )
        })
        .collect();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>Yugen 幽玄</title>\n<style>\n\
         body {{ background: #16130f; color: #e9e2d5; font: 15px/1.5 serif; margin: 2rem auto; max-width: 1700px }}\n\
         main {{ display: flex; flex-wrap: wrap; gap: 1rem }}\nfigure {{ margin: 0; width: {SIZE}px }}\n</style>\n\
         <h1>Yugen <span lang=\"ja\">幽玄</span></h1>\n\
         <p>Each picture was path-traced and denoised from the scene it links to. \
         <span lang=\"ja\">どの絵も、リンク先の場面ファイルからパストレーシングで描いたものです。</span></p>\n\
         <p><img src=\"{0}\" alt=\"A player dances by firelight\" width=\"{1}\" height=\"{2}\"><br>A player in gold brocade \
         dances by firelight. <span lang=\"ja\">薪の火明かりで金襴をまとって舞う。</span></p>\n\
         <main>\n{figures}</main>\n</html>\n",
        film::NAME,
        3 * film::SIZE[0],
        3 * film::SIZE[1],
    )
}
