//! How much slabs of a fire shine to each side: WGSL against Rust.

use glam::{DMat3, DVec3, UVec3};
use yugen_motion::fire::{DIRECTIVITY_WGSL, Fire};
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;
use yugen_optics::random::Pcg32;
use yugen_proof::gpu::Gpu;

const SHADER: &str = "
@group(0) @binding(0) var<storage, read> directions: array<f32>;
@group(0) @binding(1) var<storage, read> numbers: array<f32>;
@group(0) @binding(2) var<storage, read_write> results: array<f32>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = 3u * id.x;
    results[id.x] = directivity(0u, vec3<f32>(directions[at], directions[at + 1u], directions[at + 2u]));
}
";

/// The largest difference over all directions, in means, for a slab of a fire in the wind, which is alike to no two sides.
fn worst(gpu: &Gpu, library: &str) -> f32 {
    let fire = Fire { wind: glam::Vec3::new(3.0, 0.0, 1.0), ..Fire::default() };
    let burning = fire.light(ColourSpace::default()).expect("it burns");
    let mut grid = burning.at(2.0).grid(UVec3::new(24, 48, 24)).expect("a grid");
    burning.logs().fill(&mut grid);
    let slab = grid.slabs(6, 1, DVec3::Y, DMat3::IDENTITY).swap_remove(1);
    let mut rng = Pcg32::new(7, 3);
    // All around, and along the axes and the edges between octants.
    let drawn = (0..232).map(|_| {
        let (a, b) = (rng.next_f32(), rng.next_f32());
        spherical((1.0 - 2.0 * a).acos(), std::f32::consts::TAU * b).as_dvec3()
    });
    let ones = || [-1.0, 0.0, 1.0];
    let seams = ones()
        .into_iter()
        .flat_map(|x| ones().map(|y| [x, y]))
        .flat_map(|[x, y]| ones().map(|z| DVec3::new(x, y, z)));
    let mut all: Vec<DVec3> =
        drawn.chain(seams.filter(|d| *d != DVec3::ZERO).map(DVec3::normalize)).collect();
    all.truncate(256);
    let words: Vec<f32> = all.iter().flat_map(|d| d.as_vec3().to_array()).collect();
    let groups = all.len().div_ceil(64);
    let input: Vec<f32> = words.into_iter().chain(std::iter::repeat(1.0)).take(3 * 64 * groups).collect();
    let got = gpu
        .compute(
            &format!("{SHADER}{library}"),
            &[&input, slab.directivity.values()],
            &vec![f32::NAN; 64 * groups],
            groups as u32,
        )
        .expect("a result");
    let off =
        got.iter().zip(&all).map(|(got, d)| (f64::from(*got) - slab.directivity.towards(*d)).abs() as f32);
    off.fold(0.0, |a, b| if b.is_nan() { f32::INFINITY } else { a.max(b) })
}

#[test]
fn the_shader_says_what_rust_says() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let found = worst(gpu, DIRECTIVITY_WGSL);
    println!("{found:.2e}");
    assert!(found < 1e-5, "{found}");
}

#[test]
fn sides_that_are_exchanged_are_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    for (right, wrong) in [("var p = s.xz;", "var p = s.zx;"), ("abs(s.zx)", "abs(s.xz)")] {
        assert!(DIRECTIVITY_WGSL.contains(right), "nothing to spoil: {right}");
        let found = worst(gpu, &DIRECTIVITY_WGSL.replace(right, wrong));
        println!("{right}: {found:.2e}");
        assert!(found > 1e-2, "{right}: {found}");
    }
}
