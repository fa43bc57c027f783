//! `yugen brdf eval`.

use super::subject::Subject;
use crate::{argument, json};
use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use std::io::Read;
use std::path::{Path, PathBuf};
use yugen_archive::formats::readings;
use yugen_archive::read_bounded;
use yugen_optics::Vec3;

/// Values of f in 1/sr, without the cosine, linear RGB.
///
/// `yugen brdf eval ward -p alpha_x=0.1 --wi 0.5,0,0.87 --wo -0.5,0,0.87`, or with `--pairs` of many directions.
#[derive(Args)]
pub struct Eval {
    #[command(flatten)]
    subject: Subject,

    /// To the light, in the local frame (normal +z, tangent +x); any length.
    #[arg(long, value_name = "X,Y,Z", value_parser = argument::direction, allow_hyphen_values = true,
          required_unless_present = "pairs", requires = "wo")]
    wi: Option<Vec3>,

    /// To the eye, likewise.
    #[arg(long, value_name = "X,Y,Z", value_parser = argument::direction, allow_hyphen_values = true, requires = "wi")]
    wo: Option<Vec3>,

    /// Many pairs: a line each, wi then wo, separated by blanks or commas; what `brdf fit` reads will do, its values
    /// are passed over; # starts a comment; - reads standard input.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["wi", "wo"])]
    pairs: Option<PathBuf>,

    /// As JSON, with the density of sampling beside each value.
    #[arg(long)]
    json: bool,
}

impl Eval {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let model = self.subject.build()?;
        let bsdf = model.bsdf();
        let pairs = match (&self.pairs, self.wi, self.wo) {
            (Some(file), ..) => read_pairs(file)?,
            (None, Some(wi), Some(wo)) => vec![(wi, wo)],
            _ => bail!("expected --wi and --wo, or --pairs"),
        };
        let mut rows = Vec::new();
        for (wi, wo) in pairs {
            let (f, pdf) = bsdf.eval_pdf(wo, wi);
            if self.json {
                rows.push(json!({
                    "wi": wi.to_array(), "wo": wo.to_array(), "f": f.to_array(), "pdf": pdf,
                }));
            } else {
                println!("{} {} {}", f.x, f.y, f.z);
            }
        }
        if self.json {
            json::print(
                json!({ "model": model.kind.name(), "space": self.subject.settings.space, "values": rows }),
            );
        }
        Ok(())
    }
}

fn read_pairs(file: &Path) -> Result<Vec<(Vec3, Vec3)>> {
    let bytes = if file == Path::new("-") {
        let mut bytes = Vec::new();
        std::io::stdin().read_to_end(&mut bytes).context("standard input")?;
        bytes
    } else {
        read_bounded(file, 1 << 30)?
    };
    Ok(readings::read(&bytes, file)?.into_iter().map(|line| (line.wi, line.wo)).collect())
}
