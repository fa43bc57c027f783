//! `yugen motion info`: what a file of motion holds.

use super::Reading;
use crate::{info, json};
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;

/// Tells what a file of motion holds: format, rate, unit and axes and where they come from, joints or markers and bodies
/// with their gaps.
///
/// `yugen motion info take.c3d`. BVH, C3D, TRC, Acclaim ASF/AMC, glTF, and the tables that OptiTrack Motive, Vicon and
/// Qualisys export (CSV, TSV). What a file does not say is guessed here, and said to be; other verbs ask for it.
#[derive(Args)]
pub struct Info {
    /// The file.
    file: PathBuf,

    #[command(flatten)]
    reading: Reading,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

impl Info {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let loaded = self.reading.load(&self.file, true)?;
        let facts = info::of_motion(&self.file, &loaded);
        if self.json {
            json::print(facts.json());
        } else {
            print!("{}", facts.text());
        }
        Ok(())
    }
}
