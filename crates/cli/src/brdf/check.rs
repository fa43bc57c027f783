//! `yugen brdf check`.

use super::subject::find;
use crate::{json, progress};
use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;
use yugen_proof::{Effort, Report, report_with};
use yugen_reflectance::Kind;

/// Proves what models promise: chi-square of the sampler, weights, coverage, reciprocity, energy, rotation, edges; and
/// compares white models with published albedos.
#[derive(Args)]
pub struct Check {
    /// The models; all where absent.
    models: Vec<String>,

    /// A tenth of the samples.
    #[arg(long)]
    quick: bool,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

impl Check {
    /// Does it. Fails where a proof fails.
    pub fn run(self) -> Result<()> {
        let kinds: Vec<Kind> = if self.models.is_empty() {
            Kind::ALL.to_vec()
        } else {
            self.models.iter().map(|m| find(m)).collect::<Result<_>>()?
        };
        let effort = if self.quick { Effort::QUICK } else { Effort::FULL };
        let bar = progress::bar(kinds.len() as u64, self.json);
        let mut reports: Vec<Report> = Vec::new();
        for kind in kinds {
            bar.set_message(kind.name());
            let report = report_with(kind, effort, |_| None);
            if !self.json {
                bar.suspend(|| print!("{report}"));
            }
            reports.push(report);
            bar.inc(1);
        }
        bar.finish_and_clear();
        let failed: Vec<&str> =
            reports.iter().filter(|r| r.skipped.is_none() && !r.passed()).map(|r| r.kind.name()).collect();
        let skipped = reports.iter().filter(|r| r.skipped.is_some()).count();
        if self.json {
            let all: Vec<_> = reports
                .iter()
                .map(|r| {
                    json!({
                        "model": r.kind.name(),
                        "passed": r.passed(),
                        "skipped": r.skipped,
                        "laws": r.rows.iter().map(|row| json!({
                            "law": row.law, "passed": row.passed, "measured": row.measured, "bound": row.bound,
                            "sentence": row.sentence,
                        })).collect::<Vec<_>>(),
                    })
                })
                .collect();
            json::print(json!(all));
        } else {
            println!(
                "{} passed, {} failed, {skipped} skipped",
                reports.len() - failed.len() - skipped,
                failed.len()
            );
        }
        if !failed.is_empty() {
            bail!("{} did not pass", failed.join(", "));
        }
        Ok(())
    }
}
