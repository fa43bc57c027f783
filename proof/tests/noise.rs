//! Perlin's noise and its curl in WGSL, held against Rust.

use glam::Vec3;
use yugen_motion::noise::{NOISE_WGSL, curl_noise, noise};
use yugen_proof::gpu::Gpu;

const MAIN: &str = "
@group(0) @binding(0) var<storage, read> points: array<f32>;
@group(0) @binding(1) var<storage, read_write> results: array<f32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = 3u * id.x;
    if (i >= arrayLength(&points)) { return; }
    let p = vec3<f32>(points[i], points[i + 1u], points[i + 2u]);
    let n = noise(p);
    let c = curl_noise(p);
    let r = 7u * id.x;
    results[r] = n.value;
    results[r + 1u] = n.gradient.x;
    results[r + 2u] = n.gradient.y;
    results[r + 3u] = n.gradient.z;
    results[r + 4u] = c.x;
    results[r + 5u] = c.y;
    results[r + 6u] = c.z;
}
";

/// How far value, gradient and curl of a shader are from those of Rust, at most.
fn off(gpu: &Gpu, library: &str) -> [f32; 3] {
    // Corners, cells below zero and beyond the table's end, and points without a plan.
    let mut points =
        vec![Vec3::new(3.25, 42.0, 7.0), Vec3::splat(-0.5), Vec3::splat(255.75), Vec3::splat(-3.0)];
    let step = Vec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5);
    points.extend((1..4000).map(|i| (step * i as f32).fract() * 300.0 - Vec3::splat(100.0)));
    let flat: Vec<f32> = points.iter().flat_map(|p| p.to_array()).collect();
    let room = vec![0.0; 7 * points.len()];
    let groups = points.len().div_ceil(64) as u32;
    let results = gpu.compute(&format!("{library}{MAIN}"), &[&flat], &room, groups).expect("it runs");
    let mut worst = [0.0f32; 3];
    for (p, r) in points.iter().zip(results.chunks_exact(7)) {
        let (value, gradient) = noise(*p);
        let far = |a: Vec3, b: &[f32]| (a - Vec3::from_slice(b)).length();
        let off = [(value - r[0]).abs(), far(gradient, &r[1..4]), far(curl_noise(*p), &r[4..7])];
        for (worst, off) in worst.iter_mut().zip(off) {
            // What is not finite is wrong.
            *worst = if off <= *worst { *worst } else { off };
        }
    }
    worst
}

#[test]
fn noise_in_wgsl_is_that_of_rust_and_a_wrong_one_is_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let [value, gradient, curl] = off(gpu, NOISE_WGSL);
    println!("{value} {gradient} {curl}");
    assert!(value < 2e-6 && gradient < 1e-5 && curl < 2e-5, "{value} {gradient} {curl}");
    for (right, wrong) in [
        ("h == 12 || h == 14", "h == 12 || h == 13"),
        ("0x5b89a097u", "0x5b89a096u"),
        ("t * 6.0 - 15.0", "t * 6.0 - 15.01"),
    ] {
        assert!(NOISE_WGSL.contains(right), "{right}");
        let [value, ..] = off(gpu, &NOISE_WGSL.replace(right, wrong));
        assert!(value > 1e-4, "{wrong} is not found out: {value}");
    }
    let wrong = NOISE_WGSL.replace("g[0].z - g[2].x", "g[2].x - g[0].z");
    assert!(off(gpu, &wrong)[2] > 0.1);
}
