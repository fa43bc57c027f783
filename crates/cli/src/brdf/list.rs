//! `yugen brdf list`.

use anyhow::Result;
use clap::Args;
use serde_json::json;
use yugen_reflectance::Kind;

/// All models, a line each.
#[derive(Args)]
pub struct List {
    /// As JSON.
    #[arg(long)]
    json: bool,
}

impl List {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if self.json {
            let all: Vec<_> = Kind::ALL
                .iter()
                .map(|k| {
                    json!({
                        "name": k.name(),
                        "source": k.source(),
                        "presets": k.presets().iter().map(|p| p.name).collect::<Vec<_>>(),
                        "wgsl": k.wgsl().is_some(),
                    })
                })
                .collect();
            println!("{}", serde_json::to_string_pretty(&all)?);
            return Ok(());
        }
        let width = Kind::ALL.iter().map(|k| k.name().len()).max().unwrap_or(0);
        for kind in Kind::ALL {
            println!("{:width$}  {}", kind.name(), kind.source());
        }
        Ok(())
    }
}
