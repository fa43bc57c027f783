//! Every model's WGSL against its Rust. Never edited when a model is added.

use glam::{Quat, Vec2};
use std::f32::consts::{FRAC_PI_2, TAU};
use std::sync::OnceLock;
use yugen_optics::Frame;
use yugen_optics::frame::spherical;
use yugen_optics::random::Pcg32;
use yugen_proof::example_data;
use yugen_proof::gpu::Gpu;
use yugen_proof::twins::{CASES, Trial, TwinRow, compare, layout, validate};
use yugen_reflectance::btf::{Moments, Texel};
use yugen_reflectance::{Choice, Kind, Model, ParamType, wgsl_library};

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
        .replace("fn bsdf_albedo(", "fn right_albedo(")
        + "
fn bsdf_eval_pdf(kind: u32, p: u32, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    return 1.02 * right_eval_pdf(kind, p, t, wo, wi);
}
fn bsdf_sample(kind: u32, p: u32, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let s = right_sample(kind, p, t, wo, u);
    return BsdfSample(s.wi, 1.02 * s.pdf, 1.02 * s.weight, 1.02 * s.eta, s.is_delta);
}
fn bsdf_albedo(kind: u32, p: u32, t: u32) -> vec3<f32> {
    return 1.02 * right_albedo(kind, p, t);
}
";
    let library = library.replace("return bsdf_eval_pdf(", "return right_eval_pdf(");
    for row in all().run(gpu, &library).unwrap_or_else(|e| panic!("{e}")) {
        // A Dirac peak has neither f nor density.
        let seen = [&row.eval, &row.pdf].map(|w| w.error > row.tolerance.0 || row.kind.laws().delta);
        let drawn = [&row.sample_pdf, &row.weight, &row.eta, &row.albedo].map(|w| w.error > row.tolerance.0);
        assert!(!row.passed() && seen == [true; 2] && drawn == [true; 4], "{seen:?} {drawn:?}\n{row}");
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

/// Four texels of a cloth seen as one, and what that one reflects, in the form of the last number: normal, widths, slope
/// form, f.
const TEXELS: &str = "
@group(0) @binding(0) var<storage, read> cases: array<f32>;
@group(0) @binding(1) var<storage, read_write> results: array<f32>;
fn param_at(i: u32) -> f32 { return 0.0; }
fn table_at(i: u32) -> f32 { return 0.0; }
fn three(i: u32) -> vec3<f32> { return vec3<f32>(cases[i], cases[i + 1u], cases[i + 2u]); }
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = id.x * 63u;
    var sum = moments(vec4<f32>(0.0), vec4<f32>(0.0), vec4<f32>(0.0));
    for (var k = 0u; k < 4u; k++) {
        let i = at + 14u * k;
        let m = moments_of(Texel(three(i), three(i + 3u), three(i + 6u), three(i + 9u), vec2<f32>(cases[i + 12u], cases[i + 13u]), 1.0));
        sum = Moments(
            sum.diffuse + 0.25 * m.diffuse, sum.specular + 0.25 * m.specular, sum.weight + 0.25 * m.weight,
            sum.slope + 0.25 * m.slope, sum.products + 0.25 * m.products,
        );
    }
    let x = texel_of(sum);
    let frame = texel_frame(x);
    let noh = texel_noh(x, u32(cases[at + 62u]));
    let f = noh_eval(noh, 0u, to_local(frame, three(at + 56u)), to_local(frame, three(at + 59u)));
    let p = slope_form(x);
    let o = id.x * 11u;
    for (var c = 0u; c < 3u; c++) {
        results[o + c] = x.normal[c];
        results[o + 5u + c] = p[c];
        results[o + 8u + c] = f[c];
    }
    results[o + 3u] = x.sigma.x;
    results[o + 4u] = x.sigma.y;
}
";

/// The largest difference of `library` from Rust, relative to the larger of both and a hundredth, for each of the values
/// of [`TEXELS`].
fn texels(gpu: &Gpu, library: &str) -> [f32; 4] {
    const CASES: usize = 4096;
    let mut rng = Pcg32::new(11, 0);
    let (mut input, mut wanted) = (Vec::new(), Vec::new());
    for i in 0..CASES {
        // Forms without a table, so without ashikhmin2000.
        let form = [0, 1, 2, 4, 5, 6][i % 6];
        let mut sum = Moments::default();
        let base = spherical(0.5 * rng.next_f32(), TAU * rng.next_f32());
        let along = spherical(FRAC_PI_2, TAU * rng.next_f32());
        for k in 0..4 {
            let (u, v, w) = (rng.next_vec3(), rng.next_vec3(), rng.next_vec3());
            // From four that are alike to threads that cross.
            let crooked = (i % 3) as f32 * 0.2;
            let normal = (base + crooked * (w - 0.5)).normalize();
            let turned = if i % 4 == 3 { k as f32 * FRAC_PI_2 } else { crooked * w.x };
            let frame = Frame::from_normal_tangent(normal, Quat::from_rotation_z(turned) * along);
            let sigma = Vec2::new(0.1 + 0.4 * u.x, 0.04 + 0.1 * u.y);
            let t =
                Texel { diffuse: v, specular: w, normal: frame.n, tangent: frame.s, sigma, confidence: 1.0 };
            for v in [t.diffuse, t.specular, t.normal, t.tangent] {
                input.extend(v.to_array());
            }
            input.extend(sigma.to_array());
            sum.values.iter_mut().zip(Moments::of(&t).values).for_each(|(s, v)| *s += 0.25 * v);
        }
        let t = sum.texel();
        let frame = t.frame();
        // Half of the lights near the mirror's direction.
        let wo = spherical(1.2 * rng.next_f32(), TAU * rng.next_f32());
        let near = (t.normal + 0.3 * (rng.next_vec3() - 0.5)).normalize();
        let wi =
            if i % 2 == 0 { 2.0 * wo.dot(near) * near - wo } else { spherical(1.2 * rng.next_f32(), 1.0) };
        input.extend(wo.to_array().into_iter().chain(wi.to_array()).chain([form as f32]));
        let f = t.noh(Choice(form as f32)).eval(&[], frame.to_local(wo), frame.to_local(wi));
        wanted.extend(t.normal.to_array());
        wanted.extend(t.sigma.to_array());
        wanted.extend(t.slope_form());
        wanted.extend(f.to_array());
    }
    let source = format!("{TEXELS}{library}");
    let got = gpu
        .compute(&source, &[&input], &vec![f32::NAN; wanted.len()], (CASES / 64) as u32)
        .unwrap_or_else(|e| panic!("{e}"));
    let mut worst = [0.0f32; 4];
    for (got, wanted) in got.chunks_exact(11).zip(wanted.chunks_exact(11)) {
        for (k, span) in [0..3, 3..5, 5..8, 8..11].into_iter().enumerate() {
            let (g, w) = (&got[span.clone()], &wanted[span]);
            let scale = g.iter().chain(w).fold(0.01f32, |a, v| a.max(v.abs()));
            for (g, w) in g.iter().zip(w) {
                let error = (g - w).abs() / scale;
                worst[k] = if error.is_nan() { f32::INFINITY } else { worst[k].max(error) };
            }
        }
    }
    worst
}

#[test]
fn texels_of_a_cloth_and_their_mips_agree() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let library = wgsl_library(&[Kind::Noh]);
    let worst = texels(gpu, &library);
    println!("normal, widths, slope form, f: {worst:?}");
    // A hundredth in the long width.
    let right = "vec2<f32>(sqrt(large / det), 1.0 / sqrt(large))";
    assert!(library.contains(right), "nothing to spoil: {right}");
    let wrong =
        texels(gpu, &library.replace(right, "vec2<f32>(1.01 * sqrt(large / det), 1.0 / sqrt(large))"));
    // Measured 7e-8, 2.4e-6, 8e-6, 7e-6.
    for (k, most) in [3e-7, 1e-5, 3e-5, 3e-5].into_iter().enumerate() {
        assert!(worst[k] <= most, "{worst:?}");
        assert!(wrong[k] > most || k == 0, "{wrong:?}");
    }
}
