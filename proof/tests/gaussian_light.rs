//! The closed form of a Gaussian light's reflection: WGSL against Rust, for every model.

use glam::{Mat3, Vec3};
use std::f32::consts::{PI, TAU};
use yugen_optics::frame::spherical;
use yugen_optics::random::Pcg32;
use yugen_proof::gpu::Gpu;
use yugen_reflectance::gaussian_light::GaussianLight;
use yugen_reflectance::{Bsdf, Kind, wgsl_library};

/// A case: direction to the eye, intensity, middle, and the covariance by columns.
const WORDS: usize = 18;
const CASES: usize = 2048;

const SHADER: &str = "
@group(0) @binding(0) var<storage, read> cases: array<f32>;
@group(0) @binding(1) var<storage, read> numbers: array<f32>;
@group(0) @binding(2) var<storage, read_write> results: array<f32>;
fn param_at(i: u32) -> f32 { return numbers[i]; }
fn table_at(i: u32) -> f32 { return numbers[i]; }
fn three(i: u32) -> vec3<f32> { return vec3<f32>(cases[i], cases[i + 1u], cases[i + 2u]); }
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = id.x * 18u;
    let covariance = mat3x3<f32>(three(at + 9u), three(at + 12u), three(at + 15u));
    let light = GaussianLight(three(at + 3u), three(at + 6u), covariance);
    let f = reflect_gaussian(KIND, 0u, TABLE, three(at), light);
    for (var c = 0u; c < 3u; c++) {
        results[3u * id.x + c] = f[c];
    }
}
";

/// The largest difference of the shader from Rust over the larger of both and a thousandth of the largest.
fn worst(gpu: &Gpu, kind: Kind, slots: &[f32], library: &str) -> f32 {
    let table = kind.bake(slots, &[]).expect("a model that needs no data");
    let bsdf = Bsdf::new(kind, slots, &table);
    let mut rng = Pcg32::new(5, 9);
    let (mut input, mut wanted) = (Vec::new(), Vec::new());
    for i in 0..CASES {
        let mut u = || rng.next_f32();
        let wo = spherical(1.4 * u(), TAU * u());
        let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
        let near = mirror + 0.5 * u() * spherical(PI * u(), TAU * u());
        let towards = if i % 4 == 0 { spherical(1.7 * u(), TAU * u()) } else { near.normalize() };
        let turn = Mat3::from_axis_angle(spherical(PI * u(), TAU * u()), 6.0 * u());
        let deviations = turn * Mat3::from_diagonal(Vec3::new(0.05 + 0.2 * u(), 0.1, 0.3 * u()));
        let light = GaussianLight {
            intensity: Vec3::new(1.0 + u(), 1.0, 2.0 * u()),
            mean: (2.0 + 4.0 * u()) * towards,
            covariance: deviations * deviations.transpose(),
        };
        let vectors = [wo, light.intensity, light.mean];
        input.extend(vectors.iter().flat_map(|v| v.to_array()).chain(light.covariance.to_cols_array()));
        wanted.extend(bsdf.reflect_gaussian(wo, &light).to_array());
    }
    assert_eq!(input.len(), WORDS * CASES);
    let numbers: Vec<f32> = slots.iter().chain(&table).copied().collect();
    let constants = format!("const KIND: u32 = {}u;\nconst TABLE: u32 = {}u;\n", kind as u32, slots.len());
    let got = gpu
        .compute(
            &format!("{constants}{SHADER}{library}"),
            &[&input, &numbers],
            &vec![f32::NAN; wanted.len()],
            (CASES / 64) as u32,
        )
        .unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
    let floor = 1e-3 * wanted.iter().fold(0.0f32, |a, b| a.max(*b));
    let off = got.iter().zip(&wanted).map(|(g, w)| (g - w).abs() / g.abs().max(w.abs()).max(floor));
    off.fold(0.0, |a, b| if b.is_nan() { f32::INFINITY } else { a.max(b) })
}

#[test]
fn the_shader_says_what_rust_says() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let mut seen = Vec::new();
    for &kind in Kind::ALL {
        let slots = kind.defaults();
        let laws = kind.laws();
        if kind.bake(&slots, &[]).is_err() || laws.delta || laws.transmits {
            continue;
        }
        let found = worst(gpu, kind, &slots, &wgsl_library(&[kind]));
        seen.push((kind, found));
    }
    assert!(seen.len() > 15, "{seen:?}");
    for (kind, found) in seen {
        // Worst seen 4.5e-5, Torrance and Sparrow.
        assert!(found < 2e-4, "{}: {found}", kind.name());
    }
}

#[test]
fn a_lobe_that_is_a_hundredth_too_wide_is_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let slots = Kind::Noh.defaults();
    let library = wgsl_library(&[Kind::Noh]);
    let right = "alpha_x * alpha_x, 0.0, alpha_y * alpha_y";
    assert!(library.contains(right), "nothing to spoil: {right}");
    let found = worst(
        gpu,
        Kind::Noh,
        &slots,
        &library.replace(right, "1.02 * alpha_x * alpha_x, 0.0, alpha_y * alpha_y"),
    );
    assert!(found > 2e-3, "{found}");
}
