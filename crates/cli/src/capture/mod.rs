//! `yugen capture`: from photographs to the maps of a cloth.

mod calibrate;
mod chart;
mod cloth;
mod export;
mod fit;
mod hdr;
mod normals;
mod relight;
mod rti;
mod simulate;
mod stack;
mod traced;
mod weave;

use anyhow::Result;
use clap::Subcommand;

/// From photographs under many lights to the maps of a cloth: hdr, calibrate, simulate, weave, fit, normals, export, relight, rti.
// What a verb is for stands at its arguments.
#[derive(Subcommand)]
pub enum Capture {
    Hdr(hdr::Hdr),
    Calibrate(calibrate::Calibrate),
    Simulate(simulate::Simulate),
    Weave(weave::Weave),
    Fit(fit::Fit),
    Normals(normals::Normals),
    Export(export::Export),
    Relight(relight::Relight),
    Rti(rti::Rti),
}

impl Capture {
    /// Does it.
    pub fn run(self) -> Result<()> {
        match self {
            Self::Hdr(v) => v.run(),
            Self::Calibrate(v) => v.run(),
            Self::Simulate(v) => v.run(),
            Self::Weave(v) => v.run(),
            Self::Fit(v) => v.run(),
            Self::Normals(v) => v.run(),
            Self::Export(v) => v.run(),
            Self::Relight(v) => v.run(),
            Self::Rti(v) => v.run(),
        }
    }
}
