//! `yugen brdf list`.

use super::show::{promises, range};
use crate::json;
use anyhow::Result;
use clap::Args;
use serde_json::json;
use std::fmt::Write;
use yugen_reflectance::{Data, Kind};

/// All models, a line each.
#[derive(Args)]
pub struct List {
    /// As JSON.
    #[arg(long)]
    json: bool,

    /// As the page docs/models.md, with everything `show` tells of each.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
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
                    })
                })
                .collect();
            json::print(json!(all));
            return Ok(());
        }
        if self.markdown {
            print!("{}", page());
            return Ok(());
        }
        let width = Kind::ALL.iter().map(|k| k.name().len()).max().unwrap_or(0);
        for kind in Kind::ALL {
            println!("{:width$}  {}", kind.name(), kind.source());
        }
        Ok(())
    }
}

/// A page in Markdown: every model in full.
fn page() -> String {
    let mut out = String::from(
        "# Models\n\nWritten by `yugen brdf list --markdown` from what the models say of themselves; a test keeps it \
         true. Colours are linear RGB; a range is followed by the default in brackets. The spheres, with default \
         parameters or the first preset of a model that needs data, are by `yugen brdf plot MODEL --kind sphere`, \
         which also draws lobes, slices and albedos.\n\n| model | source |\n|---|---|\n",
    );
    for kind in Kind::ALL {
        let _ = writeln!(out, "| [{0}](#{0}) | {1} |", kind.name(), cell(kind.source()));
    }
    for kind in Kind::ALL {
        let _ = write!(
            out,
            "\n## {0}\n\n![{0}](models/{0}.png)\n\n{1}\n\n{2}\n",
            kind.name(),
            kind.source(),
            kind.doc()
        );
        match kind.data() {
            Data::None => {}
            Data::Required(what) => _ = write!(out, "\nNeeds {what}.\n"),
            Data::Optional(what) => _ = write!(out, "\nCan take {what}.\n"),
        }
        if !kind.params().is_empty() {
            out.push_str("\n| parameter | range [default] | meaning |\n|---|---|---|\n");
        }
        for p in kind.params() {
            let _ = writeln!(out, "| `{}` | {} | {} |", p.name, cell(&range(p)), cell(p.doc));
        }
        if !kind.presets().is_empty() {
            out.push_str("\n| preset | |\n|---|---|\n");
        }
        for p in kind.presets() {
            let _ = writeln!(out, "| `{}` | {} |", p.name, cell(p.doc));
        }
        let _ = write!(out, "\nPromises: {}.\n", promises(*kind).join("; "));
    }
    out
}

/// Text as a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}
