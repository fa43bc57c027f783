//! WGSL from the one list: parameter structs, their loaders, and the dispatch.

use crate::{Kind, ParamType};
use std::fmt::Write;

/// The conventions and helpers every twin may use.
pub const FRAME_WGSL: &str = include_str!("frame.wgsl");

/// The WGSL struct of a model's parameters and the function that loads it, from its parameter table. `zeros`: slots, a bit
/// each, that are zero and not loaded.
pub fn wgsl_params(kind: Kind, zeros: u64) -> String {
    let (name, ty) = (kind.name(), wgsl_type_name(kind.name()));
    let mut fields = String::new();
    let mut loads = String::new();
    let mut at = 0;
    let slot = |i: usize| {
        if zeros >> i & 1 == 1 { "0.0".into() } else { format!("param_at(p + {i}u)") }
    };
    for p in kind.params() {
        let (wgsl, load) = match p.kind {
            ParamType::Number => ("f32", slot(at)),
            ParamType::Rgb => {
                ("vec3<f32>", format!("vec3<f32>({}, {}, {})", slot(at), slot(at + 1), slot(at + 2)))
            }
            ParamType::Choice(_) => ("u32", format!("u32({})", slot(at))),
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
/// (`bsdf_eval_pdf`, from which `bsdf_eval` and `bsdf_pdf`, `bsdf_sample`, `bsdf_albedo`, `bsdf_slope_lobe` and `reflect_gaussian`). The shader that includes it supplies
/// `fn param_at(i: u32) -> f32` and `fn table_at(i: u32) -> f32`.
///
/// Indices count numbers: what the smallest device of WebGPU binds (128 MiB) holds 33 million of them in tables, seven MERL
/// measurements; a program with more binds several buffers and chooses in `table_at`.
///
/// A driver that inlines everything compiles each function once for every call, and on a software driver the time grows
/// with the square of the reads from buffers. So include the kinds that a scene has, call `bsdf_eval_pdf` in one loop
/// over all lights, and copy the row of a material once, for all calls, into a private array of [`crate::MAX_SLOTS`]
/// numbers that `param_at` reads.
pub fn wgsl_library(kinds: &[Kind]) -> String {
    wgsl_library_where(&kinds.iter().map(|kind| (*kind, 0)).collect::<Vec<_>>())
}

/// [`wgsl_library`] where some slots of some kinds, a bit each, are known to be zero. Models switch coats, films and sheens
/// off with zeros; a compiler that knows them leaves these out, where a software driver would go through both sides of the
/// branch around them.
pub fn wgsl_library_where(kinds: &[(Kind, u64)]) -> String {
    const { assert!(crate::MAX_SLOTS <= 64) };
    let mut out = String::from(FRAME_WGSL);
    for shared in [
        crate::axis::AXIS_WGSL,
        crate::microfacet::MICROFACET_WGSL,
        crate::halfway::HALFWAY_WGSL,
        crate::ashikhmin_g::ASHIKHMIN_G_WGSL,
        include_str!("lobes.wgsl"),
        crate::importance::IMPORTANCE_WGSL,
    ] {
        out.push_str(shared);
    }
    let [mut evals, mut samples, mut albedos, mut lobes] = [const { String::new() }; 4];
    for (kind, zeros) in kinds {
        let (name, number, twin) = (kind.name(), *kind as u32, kind.wgsl());
        out.push_str(&wgsl_params(*kind, *zeros));
        out.push_str(twin);
        out.push('\n');
        if *kind == Kind::Noh {
            out.push_str(crate::btf::BTF_WGSL);
        }
        let both = if twin.contains(&format!("fn {name}_eval_pdf(")) {
            format!("return {name}_eval_pdf(m, t, wo, wi);")
        } else {
            format!("return vec4<f32>({name}_eval(m, t, wo, wi), {name}_pdf(m, t, wo, wi));")
        };
        let _ = writeln!(evals, "        case {number}u: {{ let m = {name}_load(p); {both} }}");
        let _ = writeln!(
            samples,
            "        case {number}u: {{ return {name}_sample({name}_load(p), t, wo, u); }}"
        );
        // Twin of Model::albedo, where a model says nothing else.
        let albedo = if twin.contains(&format!("fn {name}_albedo(")) {
            format!("return {name}_albedo(m, t);")
        } else {
            let f =
                if both.contains("_eval_pdf") { format!("{name}_eval_pdf") } else { format!("{name}_eval") };
            let pair = "vec3<f32>(0.0, 0.0, 1.0), vec3<f32>(0.5, 0.0, 0.8660254)";
            format!("return clamp({f}(m, t, {pair}).xyz * PI, vec3<f32>(0.0), vec3<f32>(1.0));")
        };
        let _ = writeln!(albedos, "        case {number}u: {{ let m = {name}_load(p); {albedo} }}");
        if twin.contains(&format!("fn {name}_slope_lobe(")) {
            let _ = writeln!(
                lobes,
                "        case {number}u: {{ return {name}_slope_lobe({name}_load(p), t, wo, wi); }}"
            );
        }
    }
    let _ = write!(
        out,
        "// f and, in w, the density.
fn bsdf_eval_pdf(kind: u32, p: u32, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {{
    switch kind {{
{evals}        default: {{ return vec4<f32>(0.0); }}
    }}
}}
fn bsdf_eval(kind: u32, p: u32, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {{
    return bsdf_eval_pdf(kind, p, t, wo, wi).xyz;
}}
fn bsdf_pdf(kind: u32, p: u32, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {{
    return bsdf_eval_pdf(kind, p, t, wo, wi).w;
}}
fn bsdf_sample(kind: u32, p: u32, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {{
    switch kind {{
{samples}        default: {{ return bsdf_no_sample(); }}
    }}
}}
// The colour of the surface as seen head on, roughly.
fn bsdf_albedo(kind: u32, p: u32, t: u32) -> vec3<f32> {{
    switch kind {{
{albedos}        default: {{ return vec3<f32>(0.0); }}
    }}
}}
// The narrow part of f, and the rest of it at these directions.
fn bsdf_slope_lobe(kind: u32, p: u32, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {{
    switch kind {{
{lobes}        default: {{ return no_slope_lobe(); }}
    }}
}}
"
    );
    out.push_str(crate::gaussian_light::GAUSSIAN_LIGHT_WGSL);
    out
}
