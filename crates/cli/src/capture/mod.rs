//! `yugen capture`: from photographs to the maps of a cloth.

mod fit;

use anyhow::Result;
use clap::Subcommand;

/// From photographs under many lights to the maps of a cloth: fit.
#[derive(Subcommand)]
pub enum Capture {
    /// What each texel of a cloth reflects, from photographs under many lights.
    Fit(fit::Fit),
}

impl Capture {
    /// Does it.
    pub fn run(self) -> Result<()> {
        match self {
            Self::Fit(v) => v.run(),
        }
    }
}
