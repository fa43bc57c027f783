//! What is done to a painting when it is done: inscription, seal, mounting.

use crate::font;
use anyhow::{Result, bail};
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use std::sync::Arc;
use yugen_archive::formats::image::{self, ReadOptions};
use yugen_ink::mount::{MOUNTS, Mount};
use yugen_ink::signature::{Carving, Corner, Design, SEAL_SIZE, SIZE, Signature};
use yugen_optics::ColourSpace;

/// Its options.
#[derive(Args)]
pub struct Finish {
    /// Mounts the painting; the picture grows by what is around it, and --size stays that of the painting.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(MOUNTS.iter().map(|m| m.name)))]
    mount: Option<String>,

    /// Writes a text on the painting, in columns from right to left; a line of the text begins a new one.
    #[arg(long, value_name = "TEXT", conflicts_with = "literal")]
    inscription: Option<String>,

    /// Side of a character of the inscription, pixels of a picture of 1080 lines.
    #[arg(long, value_name = "PIXELS", default_value_t = SIZE, value_parser = side, requires = "inscription")]
    inscription_size: f32,

    /// Presses a seal with up to sixteen characters in cinnabar, under the inscription where there is one.
    #[arg(long, value_name = "TEXT", conflicts_with = "literal")]
    seal: Option<String>,

    /// Presses a seal after a picture instead: black or coloured on white, or on nothing.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["literal", "seal", "carving"])]
    seal_image: Option<PathBuf>,

    /// Side of the seal, the longer one of a picture's, pixels of a picture of 1080 lines [default: 58].
    #[arg(long, value_name = "PIXELS", value_parser = side)]
    seal_size: Option<f32>,

    /// Characters of the seal are white in a red ground, or red in a frame.
    #[arg(long, value_name = "HOW", default_value = Carving::ALL[0].1, requires = "seal",
          value_parser = PossibleValuesParser::new(Carving::ALL.map(|c| c.1)))]
    carving: String,

    /// Where inscription and seal stand.
    #[arg(long, value_name = "WHERE", default_value = Corner::ALL[0].1,
          value_parser = PossibleValuesParser::new(Corner::ALL.map(|c| c.1)))]
    corner: String,

    /// The font of inscription and seal (.ttf, .otf, .ttc) [default: one with Japanese characters that the system has].
    #[arg(long, value_name = "FILE")]
    font: Option<PathBuf>,
}

fn side(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|v: &f32| (4.0..=540.0).contains(v));
    number.ok_or_else(|| "expected pixels, 4 to 540".into())
}

/// The value of a name that the parser has let pass.
fn named<T: Copy + Default>(all: &[(T, &str)], name: &str) -> T {
    all.iter().find(|(_, n)| *n == name).map_or(T::default(), |(value, _)| *value)
}

impl Finish {
    /// The mounting.
    pub fn mount(&self) -> Option<&'static Mount> {
        self.mount.as_deref().and_then(Mount::find)
    }

    /// Inscription and seal, where there are any.
    pub fn signature(&self) -> Result<Option<Arc<Signature>>> {
        if let Some(mount) = self.mount().filter(|m| !m.corners)
            && (self.inscription.is_some() || self.seal.is_some() || self.seal_image.is_some())
        {
            bail!(
                "--mount {} cuts off the corners, where inscription and seal stand: leave them out or mount it otherwise",
                mount.name
            );
        }
        let text = |text: &Option<String>| text.as_deref().map(str::trim).unwrap_or_default().to_string();
        let (inscription, seal) = (text(&self.inscription), text(&self.seal));
        for (option, given, text) in
            [("--inscription", &self.inscription, &inscription), ("--seal", &self.seal, &seal)]
        {
            if given.is_some() && text.is_empty() {
                bail!("{option}: there is no character in it");
            }
        }
        if self.seal_size.is_some() && self.seal.is_none() && self.seal_image.is_none() {
            bail!("--seal-size: there is no seal; say what by --seal or --seal-image");
        }
        let written = !inscription.is_empty() || !seal.is_empty();
        if !written && let Some(font) = &self.font {
            bail!(
                "--font {}: nothing is written with it; say what by --inscription or --seal",
                font.display()
            );
        }
        let design = self.seal_image.as_ref().map(|file| -> Result<Design> {
            let name = file.display().to_string();
            Ok(Design::new(&name, &image::read(file, &ReadOptions::to(ColourSpace::LinearSrgb))?)?)
        });
        let design = design.transpose()?;
        if !written && design.is_none() {
            return Ok(None);
        }
        let font = match &self.font {
            _ if !written => None,
            Some(file) => Some(font::read(file, 0)?),
            None => font::japanese(),
        };
        if written && font.is_none() {
            bail!(
                "an inscription or a seal needs a font, and none with Japanese characters was found: name one by --font FILE \
                 (Debian: apt-get install fonts-noto-cjk)"
            );
        }
        font.iter().for_each(|font| tracing::info!("characters are from {}", font.name));
        Ok(Some(Arc::new(Signature {
            inscription,
            size: self.inscription_size,
            seal,
            design,
            seal_size: self.seal_size.unwrap_or(SEAL_SIZE),
            carving: named(&Carving::ALL, &self.carving),
            corner: named(&Corner::ALL, &self.corner),
            font,
        })))
    }
}
