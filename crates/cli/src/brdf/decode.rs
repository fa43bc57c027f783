//! `yugen brdf decode`.

use crate::{json, progress};
use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use yugen_archive::formats::{merl, neural_brdf};
use yugen_archive::{atomic_write, check_outputs, make_folder, read_bounded};
use yugen_optics::ColourSpace;
use yugen_scene::nearest;

/// Writes the materials of a file of neural encodings (Sztrajman et al. 2021) as MERL .binary tables of 35 MB each.
#[derive(Args)]
pub struct Decode {
    /// The encodings: 675 little-endian f32 a material. The names stand beside it, NAME.names.txt for NAME.f32.
    encodings: PathBuf,

    /// A material; all where absent. May be repeated.
    #[arg(long, value_name = "MATERIAL")]
    only: Vec<String>,

    /// The folder for MATERIAL.binary.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// Print what was written as JSON, and no progress.
    #[arg(long)]
    json: bool,
}

impl Decode {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let all = neural_brdf::read(&read_bounded(&self.encodings, 1 << 28)?, &self.encodings)?;
        let beside = self.encodings.with_extension("names.txt");
        let names = neural_brdf::read_names(&read_bounded(&beside, 1 << 24)?, &beside, all.len())?;
        for wanted in &self.only {
            if !names.contains(wanted) {
                let hint = nearest(wanted, names.iter().map(String::as_str))
                    .map_or(String::new(), |n| format!("; did you mean '{n}'?"));
                bail!("{}: has no material '{wanted}'{hint}", beside.display());
            }
        }
        let chosen: Vec<_> =
            names.iter().zip(&all).filter(|(n, _)| self.only.is_empty() || self.only.contains(n)).collect();
        let table = |name: &str| self.output.join(format!("{name}.binary"));
        check_outputs(chosen.iter().map(|(name, _)| table(name)))?;
        make_folder(&self.output)?;
        let bar = progress::bar(chosen.len() as u64, self.json);
        for (name, material) in &chosen {
            bar.set_message((*name).clone());
            let bytes = merl::write(&material.tabulate(), ColourSpace::LinearSrgb);
            atomic_write(&table(name), &bytes)?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        if self.json {
            let names: Vec<&String> = chosen.iter().map(|c| c.0).collect();
            json::print(json!({ "output": self.output.display().to_string(), "materials": names }));
        } else {
            println!("{}: {} tables", self.output.display(), chosen.len());
        }
        Ok(())
    }
}
