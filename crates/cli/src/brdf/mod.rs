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
// What a verb is for stands at its arguments.
#[derive(Subcommand)]
pub enum Brdf {
    List(list::List),
    Show(show::Show),
    Eval(eval::Eval),
    Plot(plot::Plot),
    Check(check::Check),
    Convert(convert::Convert),
    Decode(decode::Decode),
    Fit(fit::Fit),
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
