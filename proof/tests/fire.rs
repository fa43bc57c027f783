//! The cells of a flame by the shader, held against Rust.

use glam::{UVec3, Vec3};
use yugen_motion::fire::{FIRE_WGSL, Fire, Flame, Grid};
use yugen_motion::noise::NOISE_WGSL;
use yugen_optics::ColourSpace;
use yugen_proof::gpu::Gpu;

const CELLS: UVec3 = UVec3::new(20, 40, 20);

/// How far emission and absorption of a shader are from those of Rust, at most: over the largest value of the grid, and
/// over all cells in the mean.
fn off(gpu: &Gpu, library: &str, flames: &[(Flame, Grid)]) -> [f32; 2] {
    let mut worst = [0.0f32; 2];
    for (flame, grid) in flames {
        let rows = flame.rows(CELLS);
        let room = vec![-1.0; grid.flat().len()];
        let groups = CELLS.element_product().div_ceil(64);
        let cells = gpu.compute(library, &[rows.as_flattened()], &room, groups).expect("it runs");
        for channel in 0..4 {
            let ours = grid.flat().iter().skip(channel).step_by(4);
            let theirs = cells.iter().skip(channel).step_by(4);
            let most = ours.clone().fold(0.0f32, |a, v| a.max(*v));
            assert!(most > 0.0);
            let (mut largest, mut sum) = (0.0f32, 0.0);
            for (a, b) in ours.zip(theirs) {
                let off = (a - b).abs() / most;
                // What is not finite is wrong.
                largest = if off <= largest { largest } else { off };
                sum += off;
            }
            let mean = sum / (grid.data.len() as f32);
            worst = [worst[0].max(largest), if mean <= worst[1] { worst[1] } else { mean }];
            if largest.is_nan() {
                return [f32::NAN; 2];
            }
        }
    }
    worst
}

#[test]
fn the_shader_fills_the_same_cells_and_a_wrong_one_is_caught() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let library = format!("{NOISE_WGSL}{FIRE_WGSL}");
    let fires = [
        Fire::default(),
        Fire { power: 150.0, diameter: 0.6, wind: Vec3::new(2.0, 0.0, -1.0), seed: 5, ..Fire::default() },
        Fire { foot: Vec3::new(3.0, 1.2, -4.0), up: Vec3::new(0.1, 1.0, 0.2), seed: 9, ..Fire::default() },
    ];
    let flames: Vec<(Flame, Grid)> = fires
        .iter()
        .enumerate()
        .map(|(i, fire)| {
            let flame = fire.light(ColourSpace::LinearRec2020).unwrap().at(3.7 + 100.0 * i as f64);
            let grid = flame.grid(CELLS).unwrap();
            (flame, grid)
        })
        .collect();
    let [largest, mean] = off(gpu, &library, &flames);
    println!("{largest} {mean}");
    // Measured: 3.2e-4 and 3.3e-8. Places in the noise go up to 256, where 32 bits have steps of 3e-5.
    assert!(largest < 1.3e-3 && mean < 1.3e-7, "{largest} {mean}");
    for (right, wrong) in [
        ("const HOT = 1860.0;", "const HOT = 1868.0;"),
        ("-age * rate", "age * rate"),
        ("n.gradient.z, -n.gradient.x", "-n.gradient.x, n.gradient.z"),
        ("select(1.0, 1.6, layer == 2u)", "1.0"),
        ("0.6 + 0.4 * narrow", "0.61 + 0.39 * narrow"),
        ("flame[level + 1u], flame[level + 3u], t", "flame[level + 1u], flame[level + 1u], t"),
        ("all(cell + 1u < size)", "true"),
    ] {
        assert!(FIRE_WGSL.contains(right), "{right}");
        let [largest, mean] = off(gpu, &library.replace(right, wrong), &flames);
        println!("{wrong}: {largest} {mean}");
        assert!(largest > 4e-3, "{wrong} is not found out: {largest} {mean}");
    }
}
