//! `yugen brdf show`.

use super::subject::find;
use crate::json;
use anyhow::Result;
use clap::Args;
use serde_json::json;
use yugen_reflectance::{Data, Kind, Param, ParamType};

/// One model: source, parameters with range and default, presets, what it promises.
#[derive(Args)]
pub struct Show {
    /// The model, as `yugen brdf list` names it.
    model: String,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

impl Show {
    /// Does it.
    pub fn run(self) -> Result<()> {
        let kind = find(&self.model)?;
        if self.json {
            json::print(describe(kind));
            return Ok(());
        }
        println!("{}\n{}\n\n{}\n", kind.name(), kind.source(), kind.doc());
        println!("Parameters");
        let name = kind.params().iter().map(|p| p.name.len()).max().unwrap_or(0);
        for p in kind.params() {
            println!("  {:name$}  {:<28}  {}", p.name, range(p), p.doc);
        }
        if !kind.presets().is_empty() {
            println!("\nPresets");
            let width = kind.presets().iter().map(|p| p.name.len()).max().unwrap_or(0);
            for p in kind.presets() {
                println!("  {:width$}  {}", p.name, p.doc);
            }
        }
        match kind.data() {
            Data::None => {}
            Data::Required(what) => println!("\nNeeds {what} (--data FILE)."),
            Data::Optional(what) => println!("\nCan take {what} (--data FILE)."),
        }
        println!("\nPromises");
        for promise in promises(kind) {
            println!("  {promise}");
        }
        Ok(())
    }
}

/// What a model promises with its default parameters, a sentence each.
pub fn promises(kind: Kind) -> Vec<&'static str> {
    let laws = kind.laws();
    let pick = |holds: bool, yes, no| if holds { yes } else { no };
    let mut all = vec![
        pick(laws.reciprocal, "reciprocal: f(wo, wi) = f(wi, wo)", "not reciprocal"),
        pick(laws.conserves_energy, "reflects no more than it receives", "may reflect more than it receives"),
        pick(laws.isotropic, "isotropic by default", "anisotropic"),
    ];
    if laws.transmits {
        all.push("lets light through");
    }
    if laws.delta {
        all.push("a perfect mirror direction only (Dirac peak)");
    }
    if !laws.why.is_empty() {
        all.push(laws.why);
    }
    all
}

/// Range, unit and default of a parameter.
pub fn range(p: &Param) -> String {
    let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
    match p.kind {
        ParamType::Choice(names) => format!("{} [{}]", names.join("|"), names[p.default[0] as usize]),
        ParamType::Rgb if p.default[0] != p.default[1] || p.default[1] != p.default[2] => {
            let [r, g, b] = p.default;
            format!("rgb {}..{}{unit} [{r},{g},{b}]", p.min, p.max)
        }
        ParamType::Rgb => format!("rgb {}..{}{unit} [{}]", p.min, p.max, p.default[0]),
        ParamType::Number => format!("{}..{}{unit} [{}]", p.min, p.max, p.default[0]),
    }
}

fn describe(kind: Kind) -> serde_json::Value {
    let params: Vec<_> = kind
        .params()
        .iter()
        .map(|p| {
            let (kind, choices) = match p.kind {
                ParamType::Number => ("number", vec![]),
                ParamType::Rgb => ("rgb", vec![]),
                ParamType::Choice(names) => ("choice", names.to_vec()),
            };
            json!({
                "name": p.name, "type": kind, "choices": choices, "default": p.default_slots(),
                "min": p.min, "max": p.max, "unit": p.unit, "doc": p.doc,
            })
        })
        .collect();
    let laws = kind.laws();
    json!({
        "name": kind.name(),
        "source": kind.source(),
        "doc": kind.doc(),
        "params": params,
        "presets": kind.presets().iter().map(|p| json!({"name": p.name, "doc": p.doc})).collect::<Vec<_>>(),
        "data": match kind.data() {
            Data::None => "none",
            Data::Required(_) => "required",
            Data::Optional(_) => "optional",
        },
        "reciprocal": laws.reciprocal,
        "conserves_energy": laws.conserves_energy,
        "transmits": laws.transmits,
        "why": laws.why,
    })
}
