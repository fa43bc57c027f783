//! Every model's WGSL against its Rust. Never edited when a model is added.

use std::sync::OnceLock;
use yugen_proof::example_data;
use yugen_proof::gpu::Gpu;
use yugen_proof::twins::{CASES, Trial, TwinRow, compare, layout, validate};
use yugen_reflectance::{Kind, ParamType, wgsl_library};

#[test]
fn structs_follow_the_parameter_tables() {
    let library = wgsl_library(Kind::ALL);
    for &kind in Kind::ALL {
        layout(kind, &library).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn every_library_is_valid_alone_and_together() {
    for &kind in Kind::ALL {
        validate(kind, &wgsl_library(&[kind])).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// Every model, prepared once: some tables take seconds.
fn all() -> &'static Trial {
    static TRIAL: OnceLock<Trial> = OnceLock::new();
    TRIAL.get_or_init(|| Trial::new(Kind::ALL, example_data, CASES).unwrap_or_else(|e| panic!("{e}")))
}

/// All models in one shader, as a real-time renderer has them.
#[test]
fn values_agree() {
    let Some(gpu) = Gpu::for_tests() else { return };
    println!("{}", TwinRow::HEAD);
    let rows = all().run(gpu, &wgsl_library(Kind::ALL)).unwrap_or_else(|e| panic!("{e}"));
    rows.iter().for_each(|row| println!("{row}"));
    assert_eq!(rows.iter().map(|r| r.kind).collect::<Vec<_>>(), Kind::ALL);
    let failed: Vec<&str> = rows.iter().filter(|r| !r.passed()).map(|r| r.kind.name()).collect();
    assert!(failed.is_empty(), "these twins are not: {}", failed.join(", "));
}

/// Two percent in everything that the shader of all models returns, the drawn direction excepted.
#[test]
fn two_percent_in_the_twin_of_any_model_are_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let library = wgsl_library(Kind::ALL)
        .replace("fn bsdf_eval_pdf(", "fn right_eval_pdf(")
        .replace("fn bsdf_sample(", "fn right_sample(")
        + "
fn bsdf_eval_pdf(kind: u32, p: u32, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    return 1.02 * right_eval_pdf(kind, p, t, wo, wi);
}
fn bsdf_sample(kind: u32, p: u32, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let s = right_sample(kind, p, t, wo, u);
    return BsdfSample(s.wi, 1.02 * s.pdf, 1.02 * s.weight, 1.02 * s.eta, s.is_delta);
}
";
    let library = library.replace("return bsdf_eval_pdf(", "return right_eval_pdf(");
    for row in all().run(gpu, &library).unwrap_or_else(|e| panic!("{e}")) {
        // A Dirac peak has neither f nor density.
        let seen = [&row.eval, &row.pdf].map(|w| w.error > row.tolerance.0 || row.kind.laws().delta);
        let drawn = [&row.sample_pdf, &row.weight, &row.eta].map(|w| w.error > row.tolerance.0);
        assert!(!row.passed() && seen == [true; 2] && drawn == [true; 3], "{seen:?} {drawn:?}\n{row}");
        assert!(row.direction.error <= row.tolerance.0, "{row}");
    }
}

#[test]
fn a_wrong_index_of_refraction_is_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let library = wgsl_library(&[Kind::Dielectric]);
    let right = "m.specular_transmittance / (eta * eta), eta, 1u)";
    assert!(library.contains(right), "nothing to spoil: {right}");
    let row = compare(
        gpu,
        Kind::Dielectric,
        &library.replace(right, &right.replace(", eta, 1u", ", 1.0, 1u")),
        &[],
    )
    .unwrap_or_else(|e| panic!("{e}"));
    assert!(!row.passed() && row.eta.error > 0.3 && row.weight.error <= row.tolerance.0, "{row}");
}

/// The library of Lambert with one piece of text replaced.
fn spoilt(from: &str, to: &str) -> String {
    let library = wgsl_library(&[Kind::Lambert]);
    assert!(library.contains(from), "nothing to spoil: {from}");
    library.replace(from, to)
}

#[test]
fn a_wrong_twin_is_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let eval = "return m.reflectance * FRAC_1_PI;";
    let row = |library: &str| compare(gpu, Kind::Lambert, library, &[]).unwrap_or_else(|e| panic!("{e}"));
    assert!(row(&wgsl_library(&[Kind::Lambert])).passed());
    let off = row(&spoilt(eval, "return m.reflectance * FRAC_1_PI * 1.01;"));
    assert!(!off.passed() && (off.eval.error - 0.0099).abs() < 1e-3, "{off}");
    // A NaN of its own making (bit pattern, since WGSL forbids a constant NaN), for one case in many.
    let nan = row(&spoilt(
        eval,
        "if (wi.z > 0.99) { return vec3<f32>(sqrt(-wi.z)); } return m.reflectance * FRAC_1_PI;",
    ));
    assert!(!nan.passed() && nan.eval.error == f32::INFINITY, "{nan}");
    let density =
        row(&spoilt("return cosine_hemisphere_pdf(wi);", "return 1.05 * cosine_hemisphere_pdf(wi);"));
    assert!(!density.passed() && density.pdf.error > 0.04, "{density}");
    let turned = row(&spoilt("let wi = cosine_hemisphere(u.xy);", "let wi = cosine_hemisphere(u.yx);"));
    assert!(!turned.passed() && turned.disagreement > 0.5, "{turned}");
}

fn pair(kind: Kind) -> Option<[&'static str; 2]> {
    let colours: Vec<_> = kind.params().iter().filter(|p| p.kind == ParamType::Rgb).map(|p| p.name).collect();
    colours.first_chunk().copied()
}

#[test]
fn a_wrong_struct_or_loader_is_caught() {
    // Two parameters of one type, so that only the names tell.
    let (kind, [first, second]) =
        Kind::ALL.iter().find_map(|k| Some((*k, pair(*k)?))).expect("a pair of colours");
    let library = wgsl_library(&[kind]);
    layout(kind, &library).unwrap_or_else(|e| panic!("{e}"));
    let end = library.find(&format!("}}\nfn {}_load", kind.name())).expect("the loader follows the struct");
    let head = library[..end].rfind("struct ").expect("the struct");
    let fields = library[head..end]
        .replace(&format!(" {first}:"), " tmp:")
        .replace(&format!(" {second}:"), &format!(" {first}:"))
        .replace(" tmp:", &format!(" {second}:"));
    let swapped = format!("{}{fields}{}", &library[..head], &library[end..]);
    assert!(layout(kind, &swapped).unwrap_err().to_string().contains("parameter table"));
    let shifted = library.replacen("param_at(p + 1u)", "param_at(p + 2u)", 1);
    assert!(layout(kind, &shifted).unwrap_err().to_string().contains("reads the slots"));
    let undefined = library.replacen("FRAC_1_PI", "FRAC_2_PI", 2);
    assert!(validate(kind, &undefined).unwrap_err().to_string().contains("not valid"));
}
