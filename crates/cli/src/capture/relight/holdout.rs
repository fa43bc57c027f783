//! `yugen capture relight --hold-out`: which method predicts photographs it has not seen.

use super::super::normals::read_normals;
use super::super::stack::Source;
use super::Relight;
use crate::{argument, json, progress};
use anyhow::{Context, Result, bail};
use serde_json::json;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image;
use yugen_archive::formats::stack::Folder;
use yugen_archive::{check_outputs, make_folder};
use yugen_capture::rti::RtiError;
use yugen_capture::rti::holdout::{Method, Score, pictures, score, split, spread};
use yugen_optics::colour::srgb_to_linear;
use yugen_optics::{ColourSpace, Image};

/// The error, in display values, that a map shows as white.
const WORST: f32 = 0.2;

impl Relight {
    pub(super) fn compare(&self) -> Result<()> {
        let source = Source::open(&self.source, None)?;
        let lights = source.folder.pictures.len();
        let left_out = parse_hold_out(self.hold_out.as_deref().unwrap_or_default(), &source.folder)?;
        if left_out.len() >= lights {
            bail!("--hold-out leaves no photograph of {lights} to learn from");
        }
        let (width, height) = (source.folder.width, source.folder.height);
        let normals = self.normals.as_deref().map(|f| read_normals(f, width, height)).transpose()?;
        let methods = if self.method.is_empty() { Method::ALL.to_vec() } else { self.method.clone() };
        let names: Vec<String> = left_out
            .iter()
            .map(|l| {
                source.folder.pictures[*l].path.file_name().unwrap_or_default().to_string_lossy().into_owned()
            })
            .collect();
        // Before the work rather than after it.
        if let Some(folder) = &self.report {
            let each = methods.iter().flat_map(|m| names.iter().map(|n| predicted(folder, n, *m)));
            let truth = names.iter().map(|n| true_picture(folder, n));
            check_outputs(truth.chain(each).chain(methods.iter().map(|m| error_map(folder, *m))))?;
            make_folder(folder)?;
        }
        let stack = source.whole(self.memory << 20)?;
        let threads = argument::threads(self.threads);

        let bar = progress::bar(methods.len() as u64, self.json);
        let (mut scores, mut failures) = (Vec::new(), Vec::new());
        for method in methods {
            bar.set_message(method.name());
            match score(&stack, &left_out, method, self.encoding(), normals.as_deref(), threads) {
                Ok(score) => scores.push(score),
                // Few lights are too few for some methods and enough for others.
                Err(e @ RtiError::TooFewLights { .. }) => failures.push((method, e)),
                Err(e) => return Err(e).context(method.name()),
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        if let Some(folder) = &self.report {
            draw(folder, &names, &pictures(&split(&stack, &left_out).1), &scores, stack.width)?;
        }
        let learned = lights - left_out.len();
        if self.json {
            let scores: Vec<_> = scores
                .iter()
                .map(|s| {
                    json!({
                        "method": s.method.name(),
                        "psnr": s.psnr,
                        "ssim": s.ssim,
                        "colour_angle": s.colour_angle,
                        "normal_angle": s.normal_angle,
                        "numbers_per_texel": s.method.numbers(learned),
                        "psnr_of_each": s.lights,
                    })
                })
                .collect();
            let failed: Vec<_> = failures
                .iter()
                .map(|(m, e)| json!({ "method": m.name(), "reason": e.to_string() }))
                .collect();
            let report = json!({
                "stack": self.source.display().to_string(),
                "width": stack.width,
                "height": stack.height,
                "lights": lights,
                "left_out": names,
                "encoding": if self.linear { "linear" } else { "srgb" },
                "scores": scores,
                "not_fitted": failed,
            });
            json::print(report);
            return Ok(());
        }
        println!(
            "{}: {}x{} texels, {learned} lights to learn from, {} left out ({})",
            self.source.display(),
            stack.width,
            stack.height,
            left_out.len(),
            names.join(", ")
        );
        let with_normals = normals.is_some();
        let title = if with_normals { "  normals" } else { "" };
        println!("{:16} {:>8} {:>8} {:>9}{title}  {:>7}", "method", "PSNR dB", "SSIM", "colour", "numbers");
        for s in &scores {
            let ssim = s.ssim.map_or("-".into(), |v| format!("{v:.4}"));
            let angle =
                s.normal_angle.filter(|_| with_normals).map_or(String::new(), |a| format!(" {a:7.2}°"));
            println!(
                "{:16} {:8.2} {ssim:>8} {:8.2}°{angle}  {:7}",
                s.method.name(),
                s.psnr,
                s.colour_angle,
                s.method.numbers(learned)
            );
        }
        for (method, e) in &failures {
            println!("{:16} {e}", method.name());
        }
        println!(
            "PSNR, SSIM: of display values. Colour: mean angle between linear colours. Numbers: stored a texel."
        );
        Ok(())
    }
}

/// A count, or numbers from 1 on and file names with commas.
fn parse_hold_out(text: &str, folder: &Folder) -> Result<Vec<usize>> {
    let lights = folder.pictures.len();
    if let Ok(n) = text.parse::<usize>() {
        if n == 0 || n >= lights {
            bail!("--hold-out {n}: expected 1 to {} of the {lights} photographs", lights.saturating_sub(1));
        }
        return Ok(spread(lights, n));
    }
    let mut chosen = Vec::new();
    for word in text.split(',').map(str::trim).filter(|w| !w.is_empty()) {
        let named = folder.pictures.iter().position(|p| p.path.file_name().is_some_and(|n| n == word));
        let numbered = word.parse::<usize>().ok().and_then(|n| n.checked_sub(1)).filter(|n| *n < lights);
        let Some(light) = named.or(numbered) else {
            bail!(
                "--hold-out: '{word}' is no photograph of the stack; expected a file name or a number from 1 to {lights}"
            );
        };
        if !chosen.contains(&light) {
            chosen.push(light);
        }
    }
    if chosen.is_empty() {
        bail!("--hold-out '{text}' names no photograph; expected a count or a list");
    }
    Ok(chosen)
}

/// Truth, predictions and errors as PNGs.
fn draw(
    folder: &Path,
    names: &[String],
    truth: &[Vec<[f32; 3]>],
    scores: &[Score],
    width: usize,
) -> Result<()> {
    let options = image::WriteOptions::from(ColourSpace::LinearSrgb);
    let save = |path: PathBuf, values: &mut dyn Iterator<Item = [f32; 3]>| -> Result<()> {
        let data: Vec<f32> = values.flat_map(|v| v.map(srgb_to_linear)).collect();
        let mut picture = Image::rgb(width, data.len() / (3 * width));
        picture.data = data;
        Ok(image::write(&path, &picture, &options)?)
    };
    let black = |v: [f32; 3]| if v[0].is_nan() { [0.0; 3] } else { v };
    for (name, picture) in names.iter().zip(truth) {
        save(true_picture(folder, name), &mut picture.iter().map(|v| black(*v)))?;
    }
    for s in scores {
        for (name, picture) in names.iter().zip(&s.pictures) {
            save(predicted(folder, name, s.method), &mut picture.iter().copied())?;
        }
        save(error_map(folder, s.method), &mut s.error.iter().map(|e| heat(e / WORST)))?;
    }
    Ok(())
}

fn stem(name: &str) -> String {
    Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn word(method: Method) -> String {
    method.name().replace(' ', "_").to_lowercase()
}

fn true_picture(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{}_truth.png", stem(name)))
}

fn predicted(folder: &Path, name: &str, method: Method) -> PathBuf {
    folder.join(format!("{}_{}.png", stem(name), word(method)))
}

fn error_map(folder: &Path, method: Method) -> PathBuf {
    folder.join(format!("error_{}.png", word(method)))
}

/// From black over red and yellow to white, as display values; blue for what is not a number.
fn heat(v: f32) -> [f32; 3] {
    if v.is_nan() {
        return [0.0, 0.0, 0.4];
    }
    [0.0, 1.0, 2.0].map(|start| (3.0 * v - start).clamp(0.0, 1.0))
}
