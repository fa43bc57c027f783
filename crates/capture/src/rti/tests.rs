//! Pictures whose coefficients are known come back, whatever is masked and wherever the lamps stand.

use super::fit::{Fitted, Options, choose_ridge, fit};
use super::holdout::{Method, score, split, spread};
use super::light::{Lamp, panorama, picture, values};
use super::rbf::{Kernel, Rbf};
use super::*;
use crate::simulate::fibonacci_dome;
use crate::{Eye, Lights};
use glam::{Vec2, Vec3};
use yugen_archive::formats::relightable::{Basis, Colouring, Relightable};
use yugen_optics::random::Pcg32;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::Choice;
use yugen_reflectance::btf::{Btf, Texel};

const ALL: [Basis; 4] = Basis::ALL;

/// Coefficients that fall off with the degree of their term.
fn truth(basis: Basis, colouring: Colouring, width: usize, height: usize) -> Relightable {
    let mut r = Relightable { width, height, basis, colouring, coefficients: Vec::new() };
    let mut rng = Pcg32::new(3, 4);
    for _ in 0..width * height {
        if colouring == Colouring::Lrgb {
            r.coefficients.extend([rng.next_f32(), 1.0, rng.next_f32()]);
        }
        for term in 0..basis.terms() {
            let size = 1.0 / (1 + super::basis::degree(basis, term)) as f32;
            for _ in 0..if colouring == Colouring::Rgb { 3 } else { 1 } {
                r.coefficients.push(if term == 0 { 3.0 } else { size * (rng.next_f32() - 0.5) });
            }
        }
    }
    r
}

/// What a camera would see of it.
fn photograph(r: &Relightable, lights: Lights) -> Stack {
    let (width, height) = (r.width, r.height);
    let mut stack = Stack {
        width,
        height,
        first_row: 0,
        rows: height,
        eyes: vec![Eye::ABOVE; lights.len()],
        lights,
        values: Vec::new(),
    };
    for y in 0..height {
        for x in 0..width {
            for l in 0..stack.lights.len() {
                let (toward, irradiance) = stack.light(l, x, y);
                let value = values(r, toward)[y * width + x];
                stack.values.push(value.map(|v| v * irradiance));
            }
        }
    }
    stack
}

fn worst(a: &Relightable, b: &Relightable) -> f32 {
    assert_eq!(a.coefficients.len(), b.coefficients.len());
    a.coefficients.iter().zip(&b.coefficients).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn linear(basis: Basis, colouring: Colouring, stack: &Stack) -> Fitted {
    let encoding = Encoding::Linear;
    let ridge = choose_ridge(stack, basis, encoding).unwrap();
    fit(stack, &Options { basis, colouring, encoding, ridge }).unwrap()
}

#[test]
fn coefficients_come_back() {
    let dome = fibonacci_dome(40, 1.2);
    let lamps: Vec<Vec3> = dome.iter().map(|l| 2.0 * *l).collect();
    for basis in ALL {
        for colouring in [Colouring::Rgb, Colouring::Lrgb] {
            let r = truth(basis, colouring, 6, 5);
            // Measured: 8e-5 for the sixteen terms of HSH, 2e-5 else; coefficients are of the order of one.
            let far = photograph(&r, Lights::Distant(dome.clone()));
            let got = linear(basis, colouring, &far);
            assert_eq!(got.empty, 0);
            assert!(worst(&got.picture, &r) < 3e-4, "{basis:?} {colouring:?} {}", worst(&got.picture, &r));

            // Lamps near the sample: every texel has its own directions.
            let near = photograph(&r, Lights::Near(lamps.clone()));
            let got = linear(basis, colouring, &near);
            assert!(worst(&got.picture, &r) < 3e-4, "{basis:?} {colouring:?} {}", worst(&got.picture, &r));
        }
    }
}

#[test]
fn masked_readings_do_not_count_and_bands_are_parts_of_the_whole() {
    let basis = Basis::Hsh { order: 3 };
    let r = truth(basis, Colouring::Rgb, 9, 6);
    let mut stack = photograph(&r, Lights::Distant(fibonacci_dome(40, 1.2)));
    let mut rng = Pcg32::new(5, 5);
    let (masked, whole) = stack.values.split_at_mut(6 * 9 * 20);
    for v in masked.iter_mut().filter(|_| rng.next_f32() < 0.4) {
        *v = [7.0, f32::NAN, 7.0];
    }
    let last = whole.len() - 40;
    whole[last..].fill([f32::NAN; 3]);
    let got = linear(basis, Colouring::Rgb, &stack);
    assert_eq!(got.empty, 1);
    let (n, last) = (got.picture.coefficients.len() - 27, got.picture.coefficients.len());
    assert!(got.picture.coefficients[n..last].iter().all(|v| *v == 0.0));
    let error = got.picture.coefficients[..n].iter().zip(&r.coefficients).map(|(a, b)| (a - b).abs());
    let error = error.fold(0.0, f32::max);
    assert!(error < 3e-4, "{error}");

    // Two rows by themselves: the same bits, as any division of the rows among threads must give.
    let options = Options { basis, colouring: Colouring::Rgb, encoding: Encoding::Linear, ridge: 1e-4 };
    let all = fit(&stack, &options).unwrap().picture.coefficients;
    let band = Stack {
        height: 2,
        first_row: 3,
        values: stack.values[3 * 9 * 40..5 * 9 * 40].to_vec(),
        ..stack.clone()
    };
    assert_eq!(fit(&band, &options).unwrap().picture.coefficients, all[3 * 9 * 27..5 * 9 * 27]);
}

#[test]
fn few_lights_give_a_smooth_answer_and_fewer_a_sentence() {
    let r = truth(Basis::Ptm, Colouring::Rgb, 8, 8);
    let stack = photograph(&r, Lights::Distant(fibonacci_dome(60, 1.2)));
    let few = stack.select(&[3, 11, 19, 27, 40]);
    for basis in ALL {
        let got = linear(basis, Colouring::Rgb, &few).picture;
        // The readings lie about 3 and differ by up to 1.
        for toward in fibonacci_dome(50, 1.3) {
            let v = values(&got, toward);
            assert!(v.iter().flatten().all(|v| (1.0..5.0).contains(v)), "{basis:?} {toward}");
        }
    }
    let error = choose_ridge(&stack.select(&[5]), Basis::Ptm, Encoding::Srgb).unwrap_err();
    assert_eq!(error.to_string(), "PTM needs at least 3 lights; the stack has 1");
    assert!(Rbf::new(&stack.select(&[1, 2, 3]), Kernel::ThinPlate, Encoding::Srgb).is_err());
    let line = Stack {
        lights: Lights::Distant((0..5).map(|i| Vec3::new(0.1 * i as f32, 0.0, 1.0).normalize()).collect()),
        ..stack.select(&[0, 1, 2, 3, 4])
    };
    let error = Rbf::new(&line, Kernel::ThinPlate, Encoding::Srgb).err().unwrap();
    assert_eq!(error, RtiError::LightsOnALine);
}

#[test]
fn interpolation_goes_through_exact_readings_and_fills_in_masked_ones() {
    let mut r = truth(Basis::Ptm, Colouring::Rgb, 5, 5);
    // A plane over (x, y), which both kernels hold exactly.
    r.coefficients.chunks_exact_mut(18).for_each(|t| t[9..].fill(0.0));
    let dome = fibonacci_dome(30, 1.2);
    let toward = Vec3::new(0.2, -0.3, 0.9).normalize();
    let want = values(&r, toward);
    let mut stack = photograph(&r, Lights::Distant(dome.clone()));
    stack.values[70] = [f32::NAN; 3];
    stack.values[75] = [f32::NAN; 3];
    let near = photograph(&r, Lights::Near(dome.iter().map(|l| 3.0 * *l).collect()));
    for kernel in [Kernel::ThinPlate, Kernel::Gaussian] {
        for stack in [&stack, &near] {
            let rbf = Rbf::new(stack, kernel, Encoding::Linear).unwrap();
            let got = rbf.picture(|_, _| toward);
            let worst = got.as_flattened().iter().zip(want.as_flattened()).map(|(a, b)| (a - b).abs());
            let worst = worst.fold(0.0, f32::max);
            assert!(worst < 1e-4, "{kernel:?} {worst}");
        }
        let rbf = Rbf::new(&near, kernel, Encoding::Linear).unwrap();
        let got = rbf.picture(|x, y| near.light(4, x, y).0);
        assert!((got[13][1] - near.samples(3, 2)[4][1] / near.light(4, 3, 2).1).abs() < 1e-4);
    }
}

fn cloth(width: usize, height: usize) -> Btf {
    let texel = |i: usize| {
        let a = i as f32;
        let frame = yugen_optics::Frame::from_normal_tangent(
            Vec3::new(0.1 * (0.7 * a).sin(), 0.1 * (0.4 * a).cos(), 1.0).normalize(),
            Vec3::new((0.2 * a).cos(), (0.2 * a).sin(), 0.0),
        );
        Texel {
            diffuse: Vec3::new(0.2, 0.05, 0.04),
            specular: Vec3::new(0.25, 0.2, 0.1),
            normal: frame.n,
            tangent: frame.s,
            sigma: Vec2::new(0.3, 0.6),
            confidence: 1.0,
        }
    };
    let texels = (0..width * height).map(texel).collect();
    Btf { width, height, colour_space: ColourSpace::LinearSrgb, texels }
}

#[test]
fn an_even_sky_shows_albedo() {
    let mut sky = Image::rgb(64, 33);
    sky.data.fill(1.0);
    let lamps = panorama(&sky, 64, 0.3);
    let total: f32 = lamps.iter().map(|l| l.white.x * l.toward.z).sum();
    // Measured 4e-4: cells that the horizon cuts.
    assert!((total - 1.0).abs() < 2e-3, "{total}");
    let mut maps = cloth(3, 2);
    for t in &mut maps.texels {
        (t.specular, t.normal, t.tangent) = (Vec3::ZERO, Vec3::Z, Vec3::X);
    }
    for v in super::light::cloth(&maps, Choice(0.0), &lamps).unwrap() {
        assert!((Vec3::from_array(v) - Vec3::new(0.2, 0.05, 0.04)).abs().max_element() < 1e-3, "{v:?}");
    }
    // A lamp in the middle of the panorama is one at the camera; a turn by a right angle brings it to +x.
    let mut sun = Image::rgb(64, 33);
    sun.pixel_mut(31, 16).fill(1.0);
    sun.pixel_mut(32, 16).fill(1.0);
    assert!((panorama(&sun, 16, 0.0)[0].toward - Vec3::Z).length() < 0.06);
    let turned = panorama(&sun, 16, 1.5);
    assert!((turned[0].toward - Vec3::new(1.5f32.sin(), 0.0, 1.5f32.cos())).length() < 0.06, "{turned:?}");
}

#[test]
fn light_is_summed_up_before_or_after_decoding() {
    let r = truth(Basis::Hsh { order: 3 }, Colouring::Rgb, 4, 4);
    let mut small = r.clone();
    small.coefficients.iter_mut().for_each(|v| *v *= 0.2);
    let lamps: Vec<Lamp> = fibonacci_dome(7, 1.0)
        .into_iter()
        .enumerate()
        .map(|(i, toward)| Lamp { toward, white: Vec3::new(0.1, 0.2, 0.05 * i as f32) })
        .collect();
    for encoding in [Encoding::Linear, Encoding::Srgb] {
        let got = picture(&small, &lamps, encoding);
        for (i, got) in got.iter().enumerate() {
            for (c, got) in got.iter().enumerate() {
                let one = |l: &Lamp| encoding.decode(values(&small, l.toward)[i][c]) * l.white[c];
                let want: f32 = lamps.iter().map(one).sum();
                assert!((got - want).abs() < 1e-5, "{encoding:?} {got} {want}");
            }
        }
    }
    // The polynomial of the curve: 2.9e-6.
    let mut worst = 0f32;
    for i in 0..10_000 {
        let v = i as f32 / 9_000.0;
        let want = yugen_optics::colour::linear_to_srgb(v.min(1.0));
        worst = worst.max((Encoding::Srgb.encode(v) - want).abs());
    }
    println!("sRGB within {worst}");
    assert!(worst < 1e-5, "{worst}");
    assert!(Encoding::Srgb.encode(f32::NAN).is_nan());
    assert_eq!(Encoding::Srgb.encode(-1.0), 0.0);
    assert!((Encoding::Srgb.encode(f32::INFINITY) - 1.0).abs() < 1e-6);
}

/// A cloth that the BTF can say exactly is predicted better by it than by any basis.
#[test]
fn cloth_is_predicted_best_by_its_maps() {
    let maps = cloth(24, 24);
    let dome = fibonacci_dome(50, 1.2);
    let mut stack = Stack {
        width: 24,
        height: 24,
        first_row: 0,
        rows: 24,
        lights: Lights::Distant(dome.clone()),
        eyes: vec![Eye::ABOVE; dome.len()],
        values: vec![[0.0; 3]; 24 * 24 * 50],
    };
    for (l, toward) in dome.iter().enumerate() {
        let seen = super::light::cloth(&maps, Choice(0.0), &[Lamp::unit(*toward)]).unwrap();
        seen.iter().enumerate().for_each(|(i, v)| stack.values[i * 50 + l] = *v);
    }
    stack.values[50 * 30..50 * 31].fill([f32::NAN; 3]);
    let out = spread(50, 6);
    assert_eq!(out, [4, 12, 20, 29, 37, 45]);
    assert_eq!(split(&stack, &out).0.lights.len(), 44);
    let normals: Vec<Vec3> = maps.texels.iter().map(|t| t.normal).collect();
    let scores: Vec<_> = Method::ALL
        .into_iter()
        .map(|m| score(&stack, &out, m, Encoding::Srgb, Some(&normals), 2).unwrap())
        .collect();
    for s in &scores {
        let ssim = s.ssim.unwrap();
        println!(
            "{:14} {:.2} dB {ssim:.4} {:.2} {:.2}",
            s.method.name(),
            s.psnr,
            s.colour_angle,
            s.normal_angle.unwrap()
        );
        assert_eq!((s.lights.len(), s.pictures.len()), (6, 6));
        assert!(s.error[30].is_nan() && s.error[31].is_finite());
    }
    let (btf, rest) = scores.split_first().unwrap();
    assert!(btf.psnr > 50.0 && btf.normal_angle.unwrap() < 0.5, "{}", btf.psnr);
    for s in rest {
        assert!(s.psnr < btf.psnr - 10.0 && s.psnr > 20.0, "{} {}", s.method.name(), s.psnr);
        assert!(s.ssim < btf.ssim && s.normal_angle > btf.normal_angle, "{}", s.method.name());
    }
}
