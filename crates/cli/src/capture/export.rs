//! `yugen capture export`.

use super::cloth::folder;
use crate::json;
use anyhow::Result;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use yugen_archive::check_outputs;
use yugen_archive::formats::btf::maps::{self, Map};
use yugen_archive::formats::btf::{self, gltf};
use yugen_optics::ColourSpace;

/// Writes the maps of a cloth as pictures for other programs: diffuse, specular, normal, tangent, sigma and confidence.
///
/// PNGs have 16 bits: colours with the display curve of sRGB, vectors as (v + 1)/2, widths as they are; what is above 1
/// is cut off. EXR keeps every number. With --gltf also a material of glTF 2.0 (metallic-roughness with
/// KHR_materials_anisotropy) on a square, and how far it is from the maps.
#[derive(Args)]
pub struct Export {
    /// The maps (.btf, .exr).
    maps: PathBuf,

    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// What the pictures are.
    #[arg(long, value_name = "FORMAT", default_value = "png", value_parser = ["png", "exr"])]
    format: String,

    /// Write cloth.gltf as well.
    #[arg(long)]
    gltf: bool,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

impl Export {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let (maps, about) = btf::load(&self.maps, ColourSpace::LinearSrgb)?;
        let place = |map: Map| self.output.join(format!("{}.{}", map.name(), self.format));
        let scene = if self.gltf { gltf::files(&self.output) } else { Vec::new() };
        check_outputs(Map::ALL.into_iter().map(place).chain(scene))?;
        folder(&self.output)?;
        for map in Map::ALL {
            maps::save(&place(map), &maps, map)?;
        }
        let lost = self.gltf.then(|| gltf::save(&self.output, &maps, about.texel_mm)).transpose()?;
        if self.json {
            let gltf = lost.map(
                |l| json!({ "relative_rms_error": l.relative, "widening": l.widening, "clipped": l.clipped }),
            );
            json::print(
                json!({ "output": self.output.display().to_string(), "maps": Map::ALL.len(), "gltf": gltf }),
            );
            return Ok(());
        }
        println!(
            "{}: {} maps of {} x {} texels",
            self.output.display(),
            Map::ALL.len(),
            maps.width,
            maps.height
        );
        if let Some(l) = lost {
            println!(
                "cloth.gltf: {:.0} % off (root mean square over texels and lights, seen head on), widths times {:.2}, {} of \
                 {} texels brighter than glTF allows",
                100.0 * l.relative,
                l.widening,
                l.clipped,
                maps.texels.len()
            );
        }
        Ok(())
    }
}
