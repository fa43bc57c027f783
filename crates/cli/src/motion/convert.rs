//! `yugen motion convert`: motion from one format to another.

use super::Reading;
use crate::json;
use anyhow::Result;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use yugen_archive::formats::motion::{unit_name, written};
use yugen_archive::{atomic_write, check_outputs, check_writable};

/// Writes motion in another format: .bvh, .glb (glTF), .csv or .c3d.
///
/// `yugen motion convert take.csv -o take.c3d`, `yugen motion convert dance.bvh --unit cm -o dance.glb`. What a file does not
/// say (its unit, which axis is up, its rate) has to be said here. Everything is written in metres with +y up (C3D in
/// millimetres, BVH in centimetres); gaps stay gaps.
#[derive(Args)]
pub struct Convert {
    /// The file.
    file: PathBuf,

    /// Where to. Joints become rigid bodies in .csv and .c3d; markers and bodies have no joints, so .bvh and .glb cannot
    /// hold them.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    reading: Reading,

    /// Print what was done as JSON.
    #[arg(long)]
    json: bool,
}

impl Convert {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let format = written(&self.output)?;
        check_writable(&self.output)?;
        let loaded = self.reading.load(&self.file, false)?;
        check_outputs([&self.output])?;
        let bytes = (format.write)(&loaded.motion, &self.output)?;
        atomic_write(&self.output, &bytes)?;
        let frames = loaded.motion.frames();
        if self.json {
            json::print(json!({
                "output": self.output.display().to_string(),
                "format": format.name,
                "frames": frames,
                "unit_of_the_file": unit_name(loaded.unit.0),
                "axes_of_the_file": loaded.axes.0.to_string(),
                "bytes": bytes.len(),
            }));
        } else {
            println!("{}: {frames} frames ({})", self.output.display(), format.name);
        }
        Ok(())
    }
}
