//! `yugen capture weave`.

use super::chart;
use super::cloth::{Sample, Weaving, folder, is_draft};
use crate::{argument, json};
use anyhow::{Context, Result};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_archive::formats::{btf, wif};
use yugen_archive::{atomic_write, check_outputs};
use yugen_capture::Lights;
use yugen_capture::simulate::{Subject, fibonacci_dome};
use yugen_optics::frame::spherical;
use yugen_optics::{ColourSpace, Image, Vec3};
use yugen_reflectance::Choice;
use yugen_reflectance::btf::Texel;

/// Draws a weave and weaves the cloth: draft, chart, maps.
///
/// Writes into a folder: draft.svg and .png as weavers write them (threading, tie-up, treadling), chart.svg and .png
/// of what lies on top, draft.wif, and the cloth: a lit picture, the maps as pictures, cloth.btf with all maps as
/// numbers and height.exr.
#[derive(Args)]
pub struct Weave {
    /// A preset (karaori, kinran), silk in a named weave (plain, twill:2/1, satin:8/3, sateen:8/3) or a draft (.wif).
    what: String,

    #[command(flatten)]
    weaving: Weaving,

    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// Where the lamp of the lit picture stands: azimuth from +x and polar angle from overhead, degrees.
    #[arg(long, value_name = "AZIMUTH,POLAR", default_value = "135,40", allow_hyphen_values = true, value_parser = parse_angles)]
    light: [f32; 2],

    /// Print what the weave is like as JSON.
    #[arg(long)]
    json: bool,
}

/// All that is written.
const FILES: [&str; 15] = [
    "draft.svg",
    "draft.png",
    "chart.svg",
    "chart.png",
    "draft.wif",
    "cloth.btf",
    "height.exr",
    "lit.png",
    "diffuse.png",
    "specular.png",
    "normal.png",
    "tangent.png",
    "sigma.png",
    "height.png",
    "threads.png",
];

impl Weave {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let fabric = self.weaving.fabric(&self.what)?;
        let draft = fabric.draft();
        let space = fabric.colour_space;
        let at = |name: &str| self.output.join(name);
        check_outputs(FILES.map(at))?;
        folder(&self.output)?;
        for (name, figure) in
            [("draft", chart::draft(&draft, space)?), ("chart", chart::chart(&draft, space)?)]
        {
            atomic_write(&at(&format!("{name}.svg")), figure.svg()?.as_bytes())?;
            atomic_write(&at(&format!("{name}.png")), &figure.png(figure.width())?)?;
        }
        atomic_write(&at("draft.wif"), wif::write(&draft, space).as_bytes())?;

        let sample = self.weaving.weave(fabric, is_draft(&self.what))?;
        let about =
            btf::About { texel_mm: sample.texel_mm, source: sample.source.clone(), ..btf::About::default() };
        btf::save(&at("cloth.btf"), &sample.btf, &about)?;
        heights(&at("height.exr"), &sample)?;
        self.pictures(&sample)?;
        self.report(&sample, &draft)
    }

    fn pictures(&self, sample: &Sample) -> Result<()> {
        let at = |name: &str| self.output.join(name);
        let btf = &sample.btf;
        let lit = WriteOptions::from(btf.colour_space);
        image::write(&at("lit.png"), &picture(btf.width, &self.lit(sample)?), &lit)?;
        let map = |name: &str, raw: bool, value: &dyn Fn(usize, &Texel) -> Vec3| -> Result<()> {
            let values: Vec<Vec3> = btf.texels.iter().enumerate().map(|(i, t)| value(i, t)).collect();
            let options = WriteOptions { raw, ..lit.clone() };
            Ok(image::write(&at(name), &picture(btf.width, &values), &options)?)
        };
        map("diffuse.png", false, &|_, t| t.diffuse)?;
        map("specular.png", false, &|_, t| t.specular)?;
        // −1 to 1 as 0 to 1; a tangent is a line, shown by its end to the right.
        let signed = |v: Vec3| 0.5 * v + 0.5;
        map("normal.png", true, &|_, t| signed(t.normal))?;
        map("tangent.png", true, &|_, t| signed(if t.tangent.x < 0.0 { -t.tangent } else { t.tangent }))?;
        map("sigma.png", true, &|_, t| t.sigma.extend(0.0))?;
        let heights = sample.heights.as_deref().unwrap_or_default();
        let (low, high) =
            heights.iter().fold((f32::MAX, f32::MIN), |(low, high), h| (low.min(*h), high.max(*h)));
        let range = (high - low).max(1e-6);
        map("height.png", true, &|i, _| Vec3::splat((heights[i] - low) / range))?;
        // A hue a kind of thread, a shade a thread.
        map("threads.png", true, &|i, _| match sample.threads[i] {
            None => Vec3::ZERO,
            Some(id) => {
                let [r, g, b] = crate::figure::CURVES[id.yarn as usize % crate::figure::CURVES.len()];
                let shade = 0.7 + 0.3 * (id.index % 3) as f32 / 2.0;
                Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 255.0 * shade
            }
        })
    }

    /// Under a lamp and a soft sky, with shadows.
    fn lit(&self, sample: &Sample) -> Result<Vec<Vec3>> {
        let subject = Subject::new(&sample.btf, sample.heights.as_deref(), Choice(0.0))?;
        let [azimuth, polar] = self.light.map(f32::to_radians);
        let mut lights = vec![spherical(polar, azimuth)];
        lights.extend(fibonacci_dome(32, 1.4));
        let sky = 0.35 / (lights.len() - 1) as f32;
        let all = Lights::Distant(lights);
        let mut sum = vec![Vec3::ZERO; sample.btf.texels.len()];
        for light in 0..all.len() {
            let weight = if light == 0 { 0.9 } else { sky };
            for (s, v) in sum.iter_mut().zip(subject.picture(&all, light, Vec3::Z)) {
                // Nothing is behind the horizon of an eye overhead, but a strand may turn its face away.
                *s += if v.is_nan() { Vec3::ZERO } else { v * weight };
            }
        }
        Ok(sum)
    }

    fn report(&self, sample: &Sample, draft: &wif::Draft) -> Result<()> {
        let fabric = sample.fabric.as_ref().context("a woven sample has a fabric")?;
        let weave = &fabric.weave;
        let floats = weave.longest_floats().map(|n| (n != usize::MAX).then_some(n));
        let [ends, picks] = weave.loose().map(|l| l.len());
        let repeat = fabric.repeat();
        let shares: Vec<(String, f64)> = fabric
            .yarns
            .iter()
            .enumerate()
            .map(|(k, yarn)| {
                let on = sample.threads.iter().flatten().filter(|id| id.yarn as usize == k).count();
                (yarn.name.clone(), on as f64 / sample.threads.len() as f64)
            })
            .collect();
        if self.json {
            let report = json!({
                "name": fabric.name,
                "ends": weave.ends(),
                "picks": weave.picks(),
                "shafts": draft.shafts,
                "longest_float": { "warp": floats[0], "weft": floats[1] },
                "loose": { "ends": ends, "picks": picks },
                "repeat_mm": repeat.to_array(),
                "texel_mm": sample.texel_mm,
                "size": [sample.btf.width, sample.btf.height],
                "share": shares.iter().map(|(n, s)| json!({ "yarn": n, "share": s })).collect::<Vec<_>>(),
            });
            json::print(report);
            return Ok(());
        }
        let float = |n: Option<usize>| n.map_or("without end".into(), |n| n.to_string());
        println!(
            "{}: {} ends, {} picks, {} shafts; a repeat is {:.2} x {:.2} mm",
            fabric.name,
            weave.ends(),
            weave.picks(),
            draft.shafts,
            repeat.x,
            repeat.y
        );
        println!("longest float: warp {}, weft {}", float(floats[0]), float(floats[1]));
        if ends + picks > 0 {
            println!("not interlaced: {ends} ends, {picks} picks");
        }
        for (name, share) in shares {
            println!("{:5.1} %  {name}", 100.0 * share);
        }
        println!("written to {}", self.output.display());
        Ok(())
    }
}

/// Texels as a picture.
pub fn picture(width: usize, values: &[Vec3]) -> Image {
    Image {
        width,
        height: values.len() / width,
        channels: ["R", "G", "B"].map(String::from).to_vec(),
        data: values.iter().flat_map(|v| v.to_array()).collect(),
    }
}

/// The heights of a sample in widths of a texel, if it has any.
pub fn heights(path: &Path, sample: &Sample) -> Result<()> {
    if let Some(heights) = &sample.heights {
        let image = Image {
            width: sample.btf.width,
            height: sample.btf.height,
            channels: vec!["height.Z".into()],
            data: heights.clone(),
        };
        let unit = ("yugen.unit".to_string(), "widths of a texel".to_string());
        let options = WriteOptions { metadata: vec![unit], ..WriteOptions::from(ColourSpace::default()) };
        image::write(path, &image, &options)?;
    }
    Ok(())
}

fn parse_angles(text: &str) -> Result<[f32; 2], String> {
    argument::numbers(text)
        .filter(|[_, polar]| (0.0..90.0).contains(polar))
        .ok_or_else(|| "expected azimuth,polar in degrees, the polar angle below 90, as in 135,40".into())
}
