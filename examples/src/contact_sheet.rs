//! The contact sheet: six fabrics, gold brocade by a fire, the lecture's red ball, measured and structural colour.
//!
//! Writes `out/demo/sheet.png`, the single pictures, the scenes they were made from and a page that shows them,
//! `out/demo/index.html`. `--samples N` changes the samples a pixel, `--merl FILE` the measured material.

use anyhow::{Context, Result, bail};
use std::f32::consts::PI;
use std::path::PathBuf;
use std::time::Instant;
use yugen_archive::atomic_write;
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_archive::formats::{Options as LoadOptions, load_scene, merl};
use yugen_optics::frame::spherical;
use yugen_optics::tonemap::Curve;
use yugen_optics::{ColourSpace, Image, Vec3};
use yugen_reflectance::merl::{PHI_D, THETA_D, THETA_H, VALUES};
use yugen_reflectance::{Bsdf, Kind};
use yugen_transport::render::{Action, Budget, Job, Options};

/// One picture: file stem, captions, the pieces its scene is put together from.
struct Picture {
    name: String,
    english: &'static str,
    japanese: &'static str,
    scene: String,
}

const FABRICS: [(&str, &str, &str); 6] = [
    ("linen_plain", "Linen, plain weave", "麻・平織"),
    ("silk_crepe_de_chine", "Silk crêpe de Chine", "絹クレープデシン"),
    ("polyester_satin_charmeuse", "Polyester satin charmeuse, front", "サテン・シャルムーズ(表)"),
    ("polyester_satin_charmeuse_back", "Polyester satin charmeuse, back", "サテン・シャルムーズ(裏)"),
    ("silk_shot", "Shot silk", "玉虫織の絹"),
    ("velvet", "Velvet", "ビロード"),
];

const FABRIC: &str = include_str!("../scenes/fabric.toml");
const BALL: &str = include_str!("../scenes/red_ball.toml");
const MATERIALS: [(&str, &str, &str, &str); 2] = [
    ("mat", include_str!("../scenes/red_ball_mat.toml"), "mat", "つや消し"),
    ("glossy", include_str!("../scenes/red_ball_glossy.toml"), "glossy", "光沢"),
];
const LIGHTS: [(&str, &str, &str, &str); 3] = [
    ("surface", include_str!("../scenes/red_ball_surface.toml"), "a surface light source", "面光源"),
    ("point", include_str!("../scenes/red_ball_point.toml"), "a point light source", "点光源"),
    ("five", include_str!("../scenes/red_ball_five.toml"), "five point light sources", "五つの点光源"),
];

fn pictures() -> Vec<Picture> {
    let mut all = Vec::new();
    for (preset, english, japanese) in FABRICS {
        all.push(Picture { name: preset.into(), english, japanese, scene: FABRIC.replace("PRESET", preset) });
    }
    let single = [
        ("brocade", "Gold brocade by a fire", "火明かりの金襴", include_str!("../scenes/brocade.toml")),
        (
            "measured",
            "A measured table (MERL format)",
            "計測表(MERL形式)",
            include_str!("../scenes/measured.toml"),
        ),
        (
            "films",
            "Structural colour: morpho wing, gold leaf on lacquer",
            "構造色:モルフォ蝶と漆地の金箔",
            include_str!("../scenes/films.toml"),
        ),
    ];
    for (name, english, japanese, scene) in single {
        all.push(Picture { name: name.into(), english, japanese, scene: scene.into() });
    }
    for (material, material_toml, mat_en, mat_ja) in MATERIALS {
        for (light, light_toml, light_en, light_ja) in LIGHTS {
            all.push(Picture {
                name: format!("red_ball_{material}_{light}"),
                english: Box::leak(
                    format!("Red ball on a white desk, {mat_en}, {light_en}").into_boxed_str(),
                ),
                japanese: Box::leak(format!("白い机の赤い球・{mat_ja}・{light_ja}").into_boxed_str()),
                scene: format!("{BALL}{material_toml}{light_toml}"),
            });
        }
    }
    all
}

/// Pixels of a side of one picture, and pictures in a row.
const SIZE: usize = 320;
const COLUMNS: usize = 5;
const GAP: usize = 6;

struct Arguments {
    samples: Option<u32>,
    merl: Option<PathBuf>,
    out: PathBuf,
    only: Option<String>,
}

fn arguments() -> Result<Arguments> {
    let mut parsed = Arguments { samples: None, merl: None, out: PathBuf::from("out/demo"), only: None };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().with_context(|| format!("{word} needs a value"));
        match word.as_str() {
            "--samples" => parsed.samples = Some(value()?.parse().context("--samples needs a number")?),
            "--merl" => parsed.merl = Some(value()?.into()),
            "--out" => parsed.out = value()?.into(),
            "--only" => parsed.only = Some(value()?),
            other => {
                bail!("there is no '{other}'; there are --samples N, --merl FILE, --out FOLDER, --only NAME")
            }
        }
    }
    Ok(parsed)
}

fn main() -> Result<()> {
    let arguments = arguments()?;
    let out = &arguments.out;
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    image::write(&out.join("hexagons.png"), &hexagons(512), &WriteOptions::from(ColourSpace::LinearSrgb))?;
    let table = match &arguments.merl {
        Some(file) => std::fs::read(file).with_context(|| file.display().to_string())?,
        None => merl::write(&bronze()?, ColourSpace::LinearSrgb),
    };
    atomic_write(&out.join("measured.binary"), &table)?;

    let started = Instant::now();
    let pictures = pictures();
    let rows = pictures.len().div_ceil(COLUMNS);
    let step = SIZE + GAP;
    let mut sheet = Image::rgb(COLUMNS * step + GAP, rows * step + GAP);
    for (i, picture) in pictures.iter().enumerate() {
        if arguments.only.as_ref().is_some_and(|name| *name != picture.name) {
            continue;
        }
        let clock = Instant::now();
        let file = out.join(format!("{}.toml", picture.name));
        atomic_write(&file, picture.scene.as_bytes())?;
        let scene = load_scene(&file, &LoadOptions::default())?;
        let options = Options { budget: arguments.samples.map(Budget::Samples), ..Options::default() };
        let job = Job::new(&scene, &options)?;
        job.run(|_, _| Action::Continue);
        let rgb = job.image().select(&["R", "G", "B"]).context("a picture has colours")?;
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
    atomic_write(&out.join("index.html"), page(&pictures).as_bytes())?;
    println!(
        "{} and {} in {:.0} s",
        out.join("sheet.png").display(),
        out.join("index.html").display(),
        started.elapsed().as_secs_f64()
    );
    Ok(())
}

fn paste(sheet: &mut Image, picture: &Image, left: usize, top: usize) {
    for y in 0..picture.height.min(SIZE) {
        for x in 0..picture.width.min(SIZE) {
            sheet.pixel_mut(left + x, top + y).copy_from_slice(picture.pixel(x, y));
        }
    }
}

/// A tile of the tortoise-shell pattern (kikkō): gold outlines and hearts of hexagons. Repeats at its edges: two
/// rows of hexagons, squeezed by 15 % so that the tile is square.
fn hexagons(size: usize) -> Image {
    let mut image = Image::new(size, size, &["R"]);
    for y in 0..size {
        for x in 0..size {
            let p = [(x as f32 + 0.5) / size as f32 * 3f32.sqrt(), (y as f32 + 0.5) / size as f32 * 3.0];
            // Distance to the nearest and second nearest centre of a triangular lattice.
            let mut nearest = [f32::MAX; 2];
            for row in -1i32..=3 {
                for column in -1i32..=2 {
                    let c = [(column as f32 + 0.5 * (row & 1) as f32) * 3f32.sqrt(), row as f32 * 1.5];
                    let d = (p[0] - c[0]).hypot(p[1] - c[1]);
                    if d < nearest[0] {
                        nearest = [d, nearest[0]];
                    } else if d < nearest[1] {
                        nearest[1] = d;
                    }
                }
            }
            let edge = nearest[1] - nearest[0];
            let gold = edge < 0.22 || nearest[0] < 0.34 || (edge > 0.42 && edge < 0.56);
            image.pixel_mut(x, y)[0] = f32::from(gold);
        }
    }
    image
}

/// A table in the resolution of the MERL database, taken from models: worn bronze, a rough metal under a thin
/// diffuse patina.
fn bronze() -> Result<Vec<f32>> {
    let metal = Kind::from_name("rough_conductor")?;
    let mut slots = metal.defaults();
    for (name, value) in [("alpha_x", 0.22), ("alpha_y", 0.22)] {
        slots[metal.param(name)?.0] = value;
    }
    let (eta, _) = metal.param("eta")?;
    slots[eta..eta + 3].copy_from_slice(&[0.35, 0.9, 1.2]);
    let (k, _) = metal.param("k")?;
    slots[k..k + 3].copy_from_slice(&[3.2, 2.4, 2.2]);
    let table = metal.bake(&slots, &[])?;
    let bsdf = Bsdf::new(metal, &slots, &table);
    let patina = Vec3::new(0.02, 0.05, 0.035) / PI;
    let mut values = vec![-1.0; VALUES];
    for h in 0..THETA_H {
        for d in 0..THETA_D {
            for p in 0..PHI_D {
                // Centres of the bins; θ_h is uniform in its root.
                let theta_h = ((h as f32 + 0.5) / THETA_H as f32).powi(2) * PI / 2.0;
                let theta_d = (d as f32 + 0.5) / THETA_D as f32 * PI / 2.0;
                let phi_d = (p as f32 + 0.5) / PHI_D as f32 * PI;
                let diff = spherical(theta_d, phi_d);
                let half = spherical(theta_h, 0.0);
                // Rusinkiewicz 1998: the incident direction is the difference turned by θ_h about y.
                let (sin, cos) = theta_h.sin_cos();
                let wi = Vec3::new(cos * diff.x + sin * diff.z, diff.y, -sin * diff.x + cos * diff.z);
                let wo = 2.0 * half.dot(wi) * half - wi;
                if wi.z > 0.0 && wo.z > 0.0 {
                    let f = bsdf.eval(wo, wi) + patina;
                    let at = 3 * ((h * THETA_D + d) * PHI_D + p);
                    values[at..at + 3].copy_from_slice(&f.to_array());
                }
            }
        }
    }
    Ok(values)
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
         <p>Each picture was path-traced from the scene it links to. \
         <span lang=\"ja\">どの絵も、リンク先の場面ファイルからパストレーシングで描いたものです。</span></p>\n\
         <main>\n{figures}</main>\n</html>\n"
    )
}
