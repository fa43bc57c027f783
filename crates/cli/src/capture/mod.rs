//! `yugen capture`: from photographs to the maps of a cloth.

mod chart;
mod cloth;
mod fit;
mod simulate;
mod traced;
mod weave;

use anyhow::Result;
use clap::Subcommand;

/// From photographs under many lights to the maps of a cloth: simulate, weave, fit.
#[derive(Subcommand)]
pub enum Capture {
    /// Photographs of a cloth whose truth is known, as a machine with lights on all sides would take them.
    Simulate(simulate::Simulate),
    /// Draws a weave and weaves the cloth: draft, chart, maps.
    Weave(weave::Weave),
    /// What each texel of a cloth reflects, from photographs under many lights.
    Fit(fit::Fit),
}

impl Capture {
    /// Does it.
    pub fn run(self) -> Result<()> {
        match self {
            Self::Simulate(v) => v.run(),
            Self::Weave(v) => v.run(),
            Self::Fit(v) => v.run(),
        }
    }
}
