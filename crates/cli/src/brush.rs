//! `yugen brush`: a brush from a photograph of a stroke.

use crate::json;
use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;
use yugen_archive::formats::image::{self, ReadOptions, WriteOptions};
use yugen_archive::{atomic_write, check_outputs, check_writable};
use yugen_ink::brush::{Bristles, photograph};
use yugen_ink::preset;
use yugen_optics::ColourSpace;

/// Makes a brush for `yugen ink` of a photograph of a real stroke.
///
/// `yugen brush stroke.jpg -o own.toml`, then `yugen ink scene.glb --preset own.toml -o picture.png`. The photograph shows one stroke on
/// light paper with paper all around; it may lie in any direction and bend a little. Its picture, straightened, is written beside
/// the preset (own.png).
#[derive(Args)]
pub struct Brush {
    /// The photograph.
    photograph: PathBuf,

    /// The preset (.toml); the picture of the brush goes beside it as .png.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// The preset that it is like but for the brush, one of those that `yugen ink --list` has.
    #[arg(long, default_value = preset::DEFAULT, value_name = "NAME")]
    preset: String,

    /// Print what was found as JSON.
    #[arg(long)]
    json: bool,
}

impl Brush {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if !preset::is_file(&self.output.to_string_lossy()) {
            bail!("{}: a preset is a text file: name it .toml", self.output.display());
        }
        let picture = self.output.with_extension("png");
        check_writable(&self.output)?;
        image::can_write(&picture)?;
        let mut preset = preset::find(&self.preset)?;
        let photo = image::read(&self.photograph, &ReadOptions::to(ColourSpace::LinearSrgb))?;
        check_outputs([&self.output, &picture])?;
        let found = photograph::find(&photo).with_context(|| self.photograph.display().to_string())?;
        let name = picture.file_name().unwrap_or_default().to_string_lossy().into_owned();
        preset.style.brush = Some(Arc::new(Bristles::new(&name, &found.strip)?));
        let measured = [("dryness", Some(found.dryness)), ("roughness", found.roughness)];
        for (control, value) in measured.into_iter().filter_map(|(control, value)| Some((control, value?))) {
            // To two digits: no photograph says more.
            preset.style.controls.set(control, (100.0 * value).round() / 100.0)?;
        }
        image::write(&picture, &found.strip, &WriteOptions::from(ColourSpace::LinearSrgb))?;
        let doc = format!("{}, with the brush of a photograph", self.preset);
        atomic_write(&self.output, preset::write(&preset.style, &doc).as_bytes())?;
        if self.json {
            json::print(json!({
                "preset": self.output.display().to_string(),
                "picture": picture.display().to_string(),
                "length": found.length,
                "half_width": found.half_width,
                "white": found.white,
                "ragged": found.ragged,
                "dryness": found.dryness,
                "roughness": found.roughness,
            }));
        } else {
            let [first, second, third] = found.white.map(|w| 100.0 * w);
            let roughness = match found.roughness {
                Some(roughness) => format!("roughness {roughness:.2}"),
                None => "roughness not known of a stroke that is dry all along".into(),
            };
            println!(
                "{}, {}: a stroke of {:.0} x {:.0} pixels, white by thirds {first:.0}, {second:.0} and {third:.0} %; dryness {:.2}, \
                 {roughness}",
                self.output.display(),
                picture.display(),
                found.length,
                2.0 * found.half_width,
                found.dryness
            );
        }
        Ok(())
    }
}
