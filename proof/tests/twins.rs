//! Every model's WGSL against its Rust. Never edited when a model is added.

use yugen_proof::example_data;
use yugen_proof::gpu::Gpu;
use yugen_proof::twins::{TwinRow, compare, layout, twin, validate};
use yugen_reflectance::{Kind, ParamType, wgsl_library};

fn with_twin() -> Vec<Kind> {
    let kinds: Vec<Kind> = Kind::ALL.iter().copied().filter(|k| k.wgsl().is_some()).collect();
    assert!(!kinds.is_empty(), "no model has a twin");
    kinds
}

#[test]
fn structs_follow_the_parameter_tables() {
    let library = wgsl_library(Kind::ALL);
    for kind in with_twin() {
        layout(kind, &library).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn every_library_is_valid_alone_and_together() {
    for kind in with_twin() {
        validate(kind, &wgsl_library(&[kind])).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn values_agree() {
    let Some(gpu) = Gpu::for_tests() else { return };
    println!("{}", TwinRow::HEAD);
    let mut failed = Vec::new();
    for kind in with_twin() {
        match twin(gpu, kind, &example_data(kind)) {
            Ok(row) => {
                println!("{row}");
                if !row.passed() {
                    failed.push(kind.name());
                }
            }
            Err(e) => {
                println!("{e}");
                failed.push(kind.name());
            }
        }
    }
    assert!(failed.is_empty(), "these twins are not: {}", failed.join(", "));
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
        with_twin().into_iter().find_map(|k| Some((k, pair(k)?))).expect("a pair of colours");
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
