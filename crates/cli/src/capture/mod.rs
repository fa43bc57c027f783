//! `yugen capture`: from photographs to the maps of a cloth.

mod calibrate;
mod chart;
mod cloth;
mod export;
mod fit;
mod hdr;
mod relight;
mod rti;
mod simulate;
mod stack;
mod traced;
mod weave;

use anyhow::Result;
use clap::Subcommand;

/// From photographs under many lights to the maps of a cloth: hdr, calibrate, simulate, weave, fit, export, relight, rti.
#[derive(Subcommand)]
pub enum Capture {
    /// Exposure brackets to linear pictures: response, merge, flat field, white, colour.
    Hdr(hdr::Hdr),
    /// Light directions or positions from polished balls.
    Calibrate(calibrate::Calibrate),
    /// Photographs of a cloth whose truth is known, as a machine with lights on all sides would take them.
    Simulate(simulate::Simulate),
    /// Draws a weave and weaves the cloth: draft, chart, maps.
    Weave(weave::Weave),
    /// What each texel of a cloth reflects, from photographs under many lights.
    Fit(fit::Fit),
    /// The maps of a cloth as pictures and as a glTF material, for other programs.
    Export(export::Export),
    /// A picture under new light: from photographs, an RTI file or a fitted cloth; or how well each predicts.
    Relight(relight::Relight),
    /// Fits PTM or HSH to photographs and writes them for RTI viewers.
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
            Self::Export(v) => v.run(),
            Self::Relight(v) => v.run(),
            Self::Rti(v) => v.run(),
        }
    }
}
