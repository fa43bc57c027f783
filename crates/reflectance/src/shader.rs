//! WGSL from the one list: parameter structs, their loaders, and the dispatch.

use crate::{Kind, ParamType};
use std::fmt::Write;

/// The conventions and helpers every twin may use.
pub const FRAME_WGSL: &str = include_str!("frame.wgsl");

/// The WGSL struct of a model's parameters and the function that loads it, from its parameter table.
pub fn wgsl_params(kind: Kind) -> String {
    let (name, ty) = (kind.name(), wgsl_type_name(kind.name()));
    let mut fields = String::new();
    let mut loads = String::new();
    let mut at = 0;
    for p in kind.params() {
        let (wgsl, load) = match p.kind {
            ParamType::Number => ("f32", format!("param_at(p + {at}u)")),
            ParamType::Rgb => (
                "vec3<f32>",
                format!(
                    "vec3<f32>(param_at(p + {at}u), param_at(p + {}u), param_at(p + {}u))",
                    at + 1,
                    at + 2
                ),
            ),
            ParamType::Choice(_) => ("u32", format!("u32(param_at(p + {at}u))")),
        };
        let _ = write!(fields, "{}: {wgsl}, ", p.name);
        let _ = write!(loads, "{load}, ");
        at += p.width();
    }
    format!("struct {ty} {{ {fields}}}\nfn {name}_load(p: u32) -> {ty} {{ return {ty}({loads}); }}\n")
}

/// `oren_nayar` becomes `OrenNayar`.
fn wgsl_type_name(name: &str) -> String {
    name.split('_')
        .map(|word| {
            let mut c = word.chars();
            c.next().map(|first| first.to_uppercase().chain(c).collect::<String>()).unwrap_or_default()
        })
        .collect()
}

/// Everything a shader needs to evaluate `kinds`: frame, microfacet terms, parameter structs, twins, dispatch
/// (`bsdf_eval`, `bsdf_pdf`, `bsdf_sample`). The shader that includes it supplies
/// `fn param_at(i: u32) -> f32` and `fn table_at(i: u32) -> f32`. Models without a twin are left out.
pub fn wgsl_library(kinds: &[Kind]) -> String {
    let mut out = String::from(FRAME_WGSL);
    out.push_str(crate::microfacet::MICROFACET_WGSL);
    out.push_str(crate::halfway::HALFWAY_WGSL);
    out.push_str(crate::ashikhmin_g::ASHIKHMIN_G_WGSL);
    out.push_str(include_str!("lobes.wgsl"));
    out.push_str(crate::importance::IMPORTANCE_WGSL);
    let kinds: Vec<Kind> = kinds.iter().copied().filter(|k| k.wgsl().is_some()).collect();
    for kind in &kinds {
        out.push_str(&wgsl_params(*kind));
        out.push_str(kind.wgsl().unwrap_or_default());
        out.push('\n');
    }
    for (function, args, result, zero) in [
        ("eval", "wo: vec3<f32>, wi: vec3<f32>", "vec3<f32>", "vec3<f32>(0.0)"),
        ("pdf", "wo: vec3<f32>, wi: vec3<f32>", "f32", "0.0"),
        ("sample", "wo: vec3<f32>, u: vec3<f32>", "BsdfSample", "bsdf_no_sample()"),
    ] {
        let pass = if function == "sample" { "wo, u" } else { "wo, wi" };
        let _ = writeln!(
            out,
            "fn bsdf_{function}(kind: u32, p: u32, t: u32, {args}) -> {result} {{\n    switch kind {{"
        );
        for kind in &kinds {
            let name = kind.name();
            let _ = writeln!(
                out,
                "        case {}u: {{ return {name}_{function}({name}_load(p), t, {pass}); }}",
                *kind as u32
            );
        }
        let _ = writeln!(out, "        default: {{ return {zero}; }}\n    }}\n}}");
    }
    out
}
