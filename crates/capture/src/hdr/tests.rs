use super::*;
use yugen_optics::random::Pcg32;

/// The curve of no camera: a toe, a shoulder and another gain a channel. Light to level.
fn film(light: f32, c: usize) -> f32 {
    let x = light.clamp(0.0, 1.0).powf([0.45, 0.5, 0.6][c]);
    x * (1.0 + 0.25 * (1.0 - x) * (x - 0.3))
}

/// The inverse, by bisection.
fn undo(level: f32, c: usize) -> f32 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if film(middle, c) < level { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

struct Camera {
    curve: fn(f32, usize) -> f32,
    full_well: f64,
    read: f32,
    max: f32,
}

impl Camera {
    fn level(&self, radiance: f32, seconds: f32, c: usize, rng: &mut Pcg32) -> f32 {
        let electrons = rng.poisson(f64::from(radiance * seconds) * self.full_well) as f32;
        let light = ((electrons + self.read * rng.normal()) / self.full_well as f32).clamp(0.0, 1.0);
        ((self.curve)(light, c) * self.max).round() / self.max
    }
}

const TIMES: [f32; 4] = [0.004, 0.016, 0.064, 0.25];

#[test]
fn a_response_is_recovered_from_noisy_codes_of_eight_bits() {
    let camera = Camera { curve: film, full_well: 20_000.0, read: 6.0, max: 255.0 };
    let mut rng = Pcg32::new(1, 1);
    let pixels: Vec<Vec<Shot>> = (0..1500)
        .map(|_| {
            let radiance = 200.0 * (2f32).powf(-9.0 * rng.next_f32());
            let shot = |seconds| Shot {
                level: std::array::from_fn(|c| camera.level(radiance, seconds, c, &mut rng)),
                seconds,
            };
            TIMES.map(shot).to_vec()
        })
        .collect();
    let response = recover_response(pixels.iter().map(Vec::as_slice)).unwrap();
    let (mut worst, mut mean) = (0f32, 0.0);
    for code in 13..=247 {
        for c in 0..3 {
            let level = code as f32 / 255.0;
            let relative = |a: f32, b: f32| a / b - 1.0;
            // Times fix ratios of light only: compare with the middle of the scale.
            let found = response.light(c, level) / response.light(c, 0.5);
            let off = relative(found, undo(level, c) / undo(0.5, c)).abs();
            worst = worst.max(off);
            mean += off / (235.0 * 3.0);
        }
    }
    println!("response: mean {mean}, worst {worst}");
    // Measured 0.3 % and 5 %, the worst where codes are few.
    assert!(mean < 0.01 && worst < 0.15, "{mean} {worst}");
    let same: Vec<Vec<Shot>> = pixels.iter().map(|p| vec![p[1], p[1]]).collect();
    assert!(recover_response(same.iter().map(Vec::as_slice)).is_none(), "one time only");
    assert!(recover_response(std::iter::empty()).is_none());
}

/// Mean relative error, mean and variance of the z-scores, and chi-square over its expectation.
fn quality(camera: &Camera, response: &Response, bits: f32, radiance: f32) -> (f64, f64, f64, f64) {
    let mut rng = Pcg32::new(7, radiance.to_bits().into());
    let n = 6000;
    let pictures: Vec<Vec<[f32; 3]>> = TIMES
        .iter()
        .map(|&t| (0..n).map(|_| std::array::from_fn(|c| camera.level(radiance, t, c, &mut rng))).collect())
        .collect();
    let noise =
        Noise { full_well: camera.full_well as f32, read: camera.read, step: 1.0 / bits, saturated: 0.99 };
    let bracket = Bracket { seconds: &TIMES, response, noise };
    let merged = bracket.merge(100, &pictures, &vec![None; TIMES.len()]);
    let mut tally = Tally::default();
    tally.add(&merged);
    assert_eq!((tally.pixels, tally.saturated), (n as u64, 0));
    let (mut bias, mut z, mut zz) = (0.0, 0.0, 0.0);
    for p in &merged {
        for c in 0..3 {
            let off = f64::from(p.value[c] - radiance);
            let score = off / f64::from(p.sigma[c]);
            bias += off / f64::from(radiance);
            z += score;
            zz += score * score;
        }
    }
    let all = 3.0 * n as f64;
    (bias / all, z / all, zz / all - (z / all).powi(2), tally.chi_square / tally.freedom.max(1) as f64)
}

#[test]
fn radiance_is_unbiased_and_knows_its_error() {
    let linear = Camera { curve: |light, _| light, full_well: 20_000.0, read: 6.0, max: 65535.0 };
    // From a few electrons in the longest exposure to saturation in all but the shortest.
    for radiance in [0.004, 0.02, 0.1, 0.4, 1.3, 3.6, 3.9, 10.0, 40.0, 200.0] {
        let (bias, z, variance, chi) = quality(&linear, &Response::Linear, 65535.0, radiance);
        println!("linear {radiance}: bias {bias:.5} z {z:.4} variance {variance:.4} chi-square {chi:.4}");
        // The mean of 18 000 z-scores strays by 0.0075, their variance by 0.011; reading that falls below zero is cut,
        // which lifts the darkest.
        assert!(z.abs() < if radiance < 0.01 { 0.3 } else { 0.05 }, "{radiance}: {z}");
        assert!((0.9..1.1).contains(&variance), "{radiance}: {variance}");
        // In the dark one exposure does nearly all, and the others join where they stray; in the brightest there is
        // but one.
        let one = !(0.01..=100.0).contains(&radiance);
        assert!(one || (0.9..1.1).contains(&chi), "{radiance}: {chi}");
    }
    let eight = Camera { curve: film, full_well: 20_000.0, read: 6.0, max: 255.0 };
    let table = (0..1024).map(|i| std::array::from_fn(|c| undo(i as f32 / 1023.0, c))).collect();
    let response = Response::table(table).unwrap();
    for radiance in [0.1, 1.3, 10.0, 40.0] {
        let (bias, _, variance, chi) = quality(&eight, &response, 255.0, radiance);
        println!("eight bits {radiance}: bias {bias:.5} variance {variance:.4} chi-square {chi:.4}");
        // Without noise to blur it, rounding is the same for every pixel: a step's part, not a random one.
        assert!(bias.abs() < 0.004, "{radiance}: {bias}");
        assert!((0.2..1.3).contains(&variance), "{radiance}: {variance}");
    }
}

#[test]
fn saturated_black_and_dark_pixels_are_told_apart() {
    let noise = Noise { full_well: 1e4, read: 5.0, step: 1.0 / 255.0, saturated: 0.99 };
    let bracket = Bracket { seconds: &[0.1, 1.0], response: &Response::Linear, noise };
    let rgb = |v: f32| [v; 3];
    let levels = [
        vec![rgb(1.0), rgb(0.0), rgb(0.05), [0.5, 1.0, 0.5], rgb(0.5)],
        vec![rgb(1.0), rgb(0.0), rgb(0.5), [1.0, 1.0, 1.0], rgb(1.0)],
    ];
    let merged = bracket.merge(5, &levels, &[None, None]);
    assert!(merged[0].value[0].is_nan() && merged[0].sigma[0].is_nan());
    assert!(merged[1].black && merged[1].value == [0.0; 3] && merged[1].sigma[0] > 0.0);
    assert!((merged[2].value[1] - 0.5).abs() < 1e-3 && !merged[2].black);
    assert!(merged[3].value.iter().all(|v| v.is_nan()), "a colour with a hole is no colour");
    assert!((merged[4].value[2] - 5.0).abs() < 1e-4);
    let mut tally = Tally::default();
    tally.add(&merged);
    assert_eq!((tally.pixels, tally.saturated, tally.black), (5, 2, 1));
    let darks = [0.002, 0.02].map(|v| Some(vec![rgb(v); 5]));
    let merged = bracket.merge(5, &levels, &darks);
    assert!((merged[2].value[0] - 0.48).abs() < 0.01, "{}", merged[2].value[0]);
    let one = Bracket { seconds: &[0.1], ..bracket };
    assert!((one.merge(5, &levels[..1], &[None])[4].value[0] - 5.0).abs() < 1e-5, "one exposure will do");
}

#[test]
fn a_moved_camera_is_noticed() {
    let (w, h) = (180, 140);
    let scene = |x: f32, y: f32| {
        0.4 + 0.1 * (0.21 * x + 0.05 * y).sin()
            + 0.1 * (0.17 * y - 0.03 * x).sin() * (0.9 * x).cos()
            + 0.15 * (-((x - 90.0).powi(2) + (y - 60.0).powi(2)) / 400.0).exp()
    };
    let picture = |dx: f32, dy: f32, seed| {
        let mut rng = Pcg32::new(seed, 1);
        (0..w * h)
            .map(|i| scene((i % w) as f32 - dx, (i / w) as f32 - dy) * (1.0 + 0.01 * rng.normal()))
            .collect::<Vec<f32>>()
    };
    let still = picture(0.0, 0.0, 1);
    for moved in [Vec2::ZERO, Vec2::new(0.3, -0.2), Vec2::new(-4.6, 3.1), Vec2::new(9.0, 8.0)] {
        let mut other = picture(moved.x, moved.y, 2);
        other[w * 20 + 30..w * 20 + 60].fill(f32::NAN);
        // As it is, and as a camera shows it whose response is not what was said.
        for (factor, power) in [(1.0, 1.0), (1.7, 1.25), (0.6, 0.7)] {
            let other: Vec<f32> = other.iter().map(|v| factor * v.powf(power)).collect();
            let found = shift(&still, &other, w, h).unwrap();
            println!("moved by {moved}, found {found}");
            assert!((found - moved).length() < 0.1, "{moved} {found} {power}");
        }
    }
    assert!(shift(&vec![0.5; w * h], &vec![0.5; w * h], w, h).is_none(), "nothing to hold on to");
}

/// Brightness that rises a thousandfold across the picture, of which two exposures share a third: most of what a shift changes
/// looks like another response, and the other way round.
#[test]
fn a_response_is_told_from_a_movement() {
    let (w, h) = (96, 72);
    let scene = |x: f32, y: f32| {
        0.1 * 1000f32.powf(x / w as f32) * (1.0 + 0.3 * (0.5 * x).sin() * (0.4 * y + 1.0).sin())
    };
    for power in [1.0, 0.6, 0.45] {
        for moved in [0.0, 3.0] {
            let exposure = |seconds: f32, dx: f32, seed| -> Vec<f32> {
                let mut rng = Pcg32::new(seed, 1);
                let pixel = |i: usize| {
                    let light = scene((i % w) as f32 - dx, (i / w) as f32) * seconds;
                    let level = (light * (1.0 + 0.01 * rng.normal())).powf(power);
                    let level = (255.0 * level).round() / 255.0;
                    if (0.02..0.99).contains(&level) { srgb_to_linear(level) / seconds } else { f32::NAN }
                };
                (0..w * h).map(pixel).collect()
            };
            let found = shift(&exposure(0.01, 0.0, 1), &exposure(0.08, moved, 2), w, h);
            println!("power {power}, moved by {moved}, found {found:?}");
            let off = found.map_or(f32::INFINITY, |f| f.distance(Vec2::new(moved, 0.0)));
            assert!(off < 0.5, "{power} {moved} {found:?}");
        }
    }
}

#[test]
fn a_chart_gives_the_matrix() {
    let truth = Mat3::from_cols_array(&[1.6, -0.2, 0.05, -0.5, 1.4, -0.3, -0.1, -0.2, 1.25]);
    let mut rng = Pcg32::new(4, 4);
    let measured: Vec<[f32; 3]> = (0..24).map(|_| rng.next_vec3().to_array()).collect();
    let known: Vec<[f32; 3]> =
        measured.iter().map(|m| (truth * glam::Vec3::from_array(*m)).to_array()).collect();
    let (matrix, error) = colour_matrix(&measured, &known).unwrap();
    assert!(matrix.abs_diff_eq(truth, 1e-4) && error < 1e-5);
    let grey: Vec<[f32; 3]> = (1..25).map(|i| [i as f32 / 24.0; 3]).collect();
    assert!(colour_matrix(&grey, &known).is_none(), "greys do not tell colours");
}

#[test]
fn tables_of_a_response_must_rise() {
    for bad in
        [vec![], vec![[0.0; 3]], vec![[0.5; 3], [0.4; 3]], vec![[0.0; 3]; 3], vec![[0.0; 3], [f32::NAN; 3]]]
    {
        assert!(Response::table(bad).is_err());
    }
    let r = Response::table(vec![[0.0; 3], [0.2; 3], [1.0; 3]]).unwrap();
    assert!((r.light(0, 0.75) - 0.6).abs() < 1e-6 && r.light(1, 2.0) == 1.0 && r.light(2, -1.0) == 0.0);
    assert!((r.slope(0, 0.25) - 0.4).abs() < 1e-4 && (r.slope(0, 1.0) - 1.6).abs() < 1e-3);
}
