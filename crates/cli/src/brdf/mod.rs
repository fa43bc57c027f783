//! `yugen brdf`: what a reflectance model really does.

mod check;
mod eval;
mod list;
mod show;
mod subject;

use anyhow::Result;
use clap::Subcommand;

/// Looks into reflectance models: list, show, eval, check.
#[derive(Subcommand)]
pub enum Brdf {
    /// All models, a line each.
    List(list::List),
    /// One model: source, parameters with range and default, presets, what it promises.
    Show(show::Show),
    /// Values of f in 1/sr, without the cosine, linear RGB.
    Eval(eval::Eval),
    /// Proofs: sampling by chi-square, reciprocity, energy, furnace, edges.
    Check(check::Check),
}

impl Brdf {
    /// Does it.
    pub fn run(self) -> Result<()> {
        match self {
            Self::List(v) => v.run(),
            Self::Show(v) => v.run(),
            Self::Eval(v) => v.run(),
            Self::Check(v) => v.run(),
        }
    }
}
