//! `yugen brdf`: what a reflectance model really does.

mod check;
mod convert;
mod decode;
mod eval;
mod fit;
mod list;
mod pca;
mod plot;
mod show;
mod subject;

use anyhow::Result;
use clap::Subcommand;

/// Looks into reflectance models: list, show, eval, plot, check, convert, decode, fit, pca.
#[derive(Subcommand)]
pub enum Brdf {
    /// All models, a line each.
    List(list::List),
    /// One model: source, parameters with range and default, presets, what it promises.
    Show(show::Show),
    /// Values of f in 1/sr, without the cosine, linear RGB.
    Eval(eval::Eval),
    /// Pictures: lobes, a lit sphere, a Rusinkiewicz slice, albedo against angle.
    Plot(plot::Plot),
    /// Proofs: sampling by chi-square, reciprocity, energy, furnace, edges.
    Check(check::Check),
    /// Writes a model or a measurement as a MERL .binary or a goniometer .gonio.
    Convert(convert::Convert),
    /// Writes neural encodings of measurements as MERL .binary tables.
    Decode(decode::Decode),
    /// Parameters of any model that come nearest to a measured BRDF, and a table that ranks the models.
    Fit(fit::Fit),
    /// Whole tables from a few readings or a photograph, by a basis of measured materials.
    #[command(subcommand)]
    Pca(pca::Pca),
}

impl Brdf {
    /// Does it.
    pub fn run(self) -> Result<()> {
        match self {
            Self::List(v) => v.run(),
            Self::Show(v) => v.run(),
            Self::Eval(v) => v.run(),
            Self::Plot(v) => v.run(),
            Self::Check(v) => v.run(),
            Self::Convert(v) => v.run(),
            Self::Decode(v) => v.run(),
            Self::Fit(v) => v.run(),
            Self::Pca(v) => v.run(),
        }
    }
}
