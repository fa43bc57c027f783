//! FLIP: how different two pictures look to a person who flips between them. Andersson, Nilsson, Akenine-Möller, Oskarsson,
//! Åström and Fairchild 2020, "FLIP: A Difference Evaluator for Alternating Images", for pictures of a display (LDR).

use crate::Image;
use crate::colour::{ColourSpace, srgb_to_linear};
use glam::{DMat3, DVec3, Mat3, Vec3};
use std::f64::consts::PI;

/// Pixels in a degree of sight: a screen of 0.7 m and 3840 pixels across, seen from 0.7 m, as in the paper.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Contrast sensitivity as sums of Gaussians, (a, b) of each, in the paper's table 1: achromatic, red-green, blue-yellow.
const SENSITIVITY: [[(f64, f64); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];

/// Width of a feature in degrees.
const FEATURE: f64 = 0.082;
/// Exponent of colour differences.
const Q_COLOUR: f32 = 0.7;
/// Exponent of differences of features.
const Q_FEATURE: f32 = 0.5;
/// Part of the largest colour difference that is mapped to the first [`P_TO`] of the scale.
const P_COLOUR: f32 = 0.4;
/// See [`P_COLOUR`].
const P_TO: f32 = 0.95;

/// The difference of each pixel, 0 to 1, in one channel. Both pictures hold display values, encoded as sRGB, 0 to 1, in R, G
/// and B; what is beyond is cut off, what is no number is black. `None` where they differ in size, lack a channel or have no
/// pixels.
pub fn flip(image: &Image, reference: &Image) -> Option<Image> {
    let (w, h) = (image.width, image.height);
    if (reference.width, reference.height) != (w, h) || w * h == 0 {
        return None;
    }
    let [a, b] = [opponent(image)?, opponent(reference)?];
    let [fa, fb] = [features(&a[0], w), features(&b[0], w)];
    let [a, b] = [perceived(a, w), perceived(b, w)];
    // The largest difference that the paper's scale knows: from green to blue.
    let most = hyab(hunt(lab(Vec3::Y)), hunt(lab(Vec3::Z))).powf(Q_COLOUR);
    let knee = P_COLOUR * most;
    let mut map = Image::new(w, h, &["Y"]);
    for (i, out) in map.data.iter_mut().enumerate() {
        let d = hyab(a[i], b[i]).powf(Q_COLOUR);
        let colour =
            if d < knee { d * P_TO / knee } else { P_TO + (d - knee) / (most - knee) * (1.0 - P_TO) };
        let off = (fa[i] - fb[i]).abs().max_element();
        let feature = (off * std::f32::consts::FRAC_1_SQRT_2).powf(Q_FEATURE).clamp(0.0, 1.0);
        *out = colour.powf(1.0 - feature);
    }
    Some(map)
}

/// The mean of [`flip`] over the picture.
pub fn mean_flip(image: &Image, reference: &Image) -> Option<f64> {
    let map = flip(image, reference)?;
    Some(map.data.iter().map(|v| f64::from(*v)).sum::<f64>() / map.data.len() as f64)
}

/// Linear sRGB to XYZ over the white of the display.
fn to_relative_xyz() -> Mat3 {
    let m: DMat3 = ColourSpace::LinearSrgb.to_xyz();
    (DMat3::from_diagonal((m * DVec3::ONE).recip()) * m).as_mat3()
}

/// Y, Cx and Cz of the paper: linear opponent colours.
fn opponent(image: &Image) -> Option<[Vec<f32>; 3]> {
    let rgb = ["R", "G", "B"].map(|c| image.channel(c));
    let [Some(r), Some(g), Some(b)] = rgb else { return None };
    let m = to_relative_xyz();
    let count = image.width * image.height;
    let mut planes = [(); 3].map(|()| Vec::with_capacity(count));
    for p in image.data.chunks_exact(image.channels.len()).take(count) {
        // No number is not above zero.
        let light =
            Vec3::from([p[r], p[g], p[b]].map(|v| srgb_to_linear(if v > 0.0 { v.min(1.0) } else { 0.0 })));
        let xyz = m * light;
        for (plane, v) in
            planes.iter_mut().zip([116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z)])
        {
            plane.push(v);
        }
    }
    Some(planes)
}

/// What the eye resolves of the colours: filtered, in CIELAB with Hunt's adjustment.
fn perceived(planes: [Vec<f32>; 3], width: usize) -> Vec<Vec3> {
    let widest = SENSITIVITY.iter().flatten().fold(0.0f64, |most, (_, b)| most.max(*b));
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i64;
    let mut filtered = planes.into_iter().zip(SENSITIVITY).map(|(plane, gaussians)| {
        // Of two dimensions, each the product of two of one: their sums weigh them.
        let parts: Vec<(f64, Vec<f64>)> = gaussians
            .iter()
            .filter(|(a, _)| *a > 0.0)
            .map(|(a, b)| {
                let at = |i: i64| (-(PI * i as f64 / PIXELS_PER_DEGREE).powi(2) / b).exp();
                (a * (PI / b).sqrt(), (-radius..=radius).map(at).collect())
            })
            .collect();
        let total: f64 = parts.iter().map(|(a, k)| a * k.iter().sum::<f64>().powi(2)).sum();
        let mut out = vec![0.0; plane.len()];
        for (a, kernel) in parts {
            let once: Vec<f32> = kernel.iter().map(|k| *k as f32).collect();
            let scaled: Vec<f32> = kernel.iter().map(|k| (k * a / total) as f32).collect();
            let part = down(&across(&plane, width, &scaled), width, &once);
            out.iter_mut().zip(part).for_each(|(o, p)| *o += p);
        }
        out
    });
    let [y, cx, cz] = [(); 3].map(|()| filtered.next().unwrap_or_default());
    let to_rgb = to_relative_xyz().inverse();
    y.iter()
        .zip(&cx)
        .zip(&cz)
        .map(|((y, cx), cz)| {
            let y = (y + 16.0) / 116.0;
            let xyz = Vec3::new(cx / 500.0 + y, y, y - cz / 200.0);
            hunt(lab((to_rgb * xyz).clamp(Vec3::ZERO, Vec3::ONE)))
        })
        .collect()
}

/// How much of an edge and of a point each pixel is.
fn features(luminance: &[f32], width: usize) -> Vec<glam::Vec2> {
    let deviation = 0.5 * FEATURE * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i64;
    let offsets = || (-radius..=radius).map(|i| i as f64);
    let gauss: Vec<f64> = offsets().map(|x| (-0.5 * (x / deviation).powi(2)).exp()).collect();
    let sum: f64 = gauss.iter().sum();
    let gauss: Vec<f64> = gauss.iter().map(|g| g / sum).collect();
    // What is above zero adds up to one, what is below to minus one.
    let balanced = |kernel: Vec<f64>| -> Vec<f32> {
        let up: f64 = kernel.iter().filter(|v| **v > 0.0).sum();
        let down: f64 = -kernel.iter().filter(|v| **v < 0.0).sum::<f64>();
        kernel.iter().map(|v| (v / if *v > 0.0 { up } else { down }) as f32).collect()
    };
    let first = balanced(offsets().zip(&gauss).map(|(x, g)| -x * g).collect());
    let second = balanced(offsets().zip(&gauss).map(|(x, g)| ((x / deviation).powi(2) - 1.0) * g).collect());
    let gauss: Vec<f32> = gauss.iter().map(|g| *g as f32).collect();
    let y: Vec<f32> = luminance.iter().map(|y| (y + 16.0) / 116.0).collect();
    let smooth_across = across(&y, width, &gauss);
    let edges = [down(&across(&y, width, &first), width, &gauss), down(&smooth_across, width, &first)];
    let points = [down(&across(&y, width, &second), width, &gauss), down(&smooth_across, width, &second)];
    (0..y.len())
        .map(|i| glam::Vec2::new(edges[0][i].hypot(edges[1][i]), points[0][i].hypot(points[1][i])))
        .collect()
}

/// Each row filtered; beyond its ends its last values go on.
fn across(plane: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let reach = kernel.len() / 2;
    let mut padded = vec![0.0; width + 2 * reach];
    let mut out = vec![0.0; plane.len()];
    for (row, to) in plane.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        padded[..reach].fill(row[0]);
        padded[reach..reach + width].copy_from_slice(row);
        padded[reach + width..].fill(row[width - 1]);
        for (k, from) in kernel.iter().zip(0..) {
            to.iter_mut().zip(&padded[from..]).for_each(|(o, v)| *o += k * v);
        }
    }
    out
}

/// Each column filtered, likewise.
fn down(plane: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let (reach, height) = (kernel.len() / 2, plane.len() / width);
    let mut out = vec![0.0; plane.len()];
    for (y, to) in out.chunks_exact_mut(width).enumerate() {
        for (i, k) in kernel.iter().enumerate() {
            let from = (y + i).saturating_sub(reach).min(height - 1) * width;
            to.iter_mut().zip(&plane[from..from + width]).for_each(|(o, v)| *o += k * v);
        }
    }
    out
}

/// Linear sRGB to CIELAB.
fn lab(rgb: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let f = (to_relative_xyz() * rgb)
        .map(|t| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    Vec3::new(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z))
}

/// Colours look paler in the dark.
fn hunt(lab: Vec3) -> Vec3 {
    Vec3::new(lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z)
}

/// Abasi, Amani Tehran and Fairchild 2020: differences that may be large.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves of three colours, an edge across and a bright point.
    fn waves(turn: f64) -> Image {
        let mut image = Image::rgb(96, 64);
        for y in 0..64 {
            for x in 0..96 {
                let at = |c: usize| {
                    let phase =
                        0.11 * x as f64 * (1.0 + 0.3 * c as f64) + 0.07 * y as f64 + 2.0 * c as f64 + turn;
                    let edge = if x + y > 90 { 0.25 } else { 0.0 };
                    let point = if (x, y) == (20, 30) { 0.4 } else { 0.0 };
                    (0.35 + 0.3 * phase.sin() + edge + point).clamp(0.0, 1.0) as f32
                };
                image.pixel_mut(x, y).copy_from_slice(&[at(0), at(1), at(2)]);
            }
        }
        image
    }

    /// What `flip_evaluator` 1.7 (PyPI), `evaluate(reference, test, "LDR", inputsRGB=True)`, makes of the same pictures: the
    /// mean, and the map at three places.
    #[test]
    fn values_are_those_of_the_authors_program() {
        let reference = waves(0.0);
        let mut shifted = waves(0.15);
        let darker = Image { data: reference.data.iter().map(|v| 0.8 * v).collect(), ..reference.clone() };
        shifted.pixel_mut(70, 50).copy_from_slice(&[1.0, 0.0, 0.0]);
        for (name, image, mean, at) in [
            ("shifted", &shifted, 0.222294, [0.281231, 0.459925, 0.272795]),
            ("darker", &darker, 0.506970, [0.534396, 0.551365, 0.390258]),
        ] {
            let map = flip(image, &reference).expect("they are alike");
            let found = mean_flip(image, &reference).expect("they are alike");
            let places = [(20, 30), (70, 50), (0, 63)].map(|(x, y)| map.pixel(x, y)[0]);
            println!("{name}: {found} {places:?}");
            assert!((found - mean).abs() < 1e-4, "{name}: {found}, not {mean}");
            for (found, expected) in places.iter().zip(at) {
                assert!((found - expected).abs() < 1e-3, "{name}: {places:?}, not {at:?}");
            }
        }
    }

    #[test]
    fn the_same_is_no_difference_and_black_from_white_is_one() {
        let a = waves(0.0);
        assert_eq!(mean_flip(&a, &a), Some(0.0));
        let white = Image { data: vec![1.0; a.data.len()], ..a.clone() };
        let black = Image { data: vec![0.0; a.data.len()], ..a.clone() };
        let far = mean_flip(&white, &black).expect("they are alike");
        assert!(far > 0.9 && far <= 1.0, "{far}");
        // Beyond the display is its end, and what is no number is black.
        let beyond = Image { data: vec![7.0; a.data.len()], ..a.clone() };
        assert_eq!(mean_flip(&white, &beyond), Some(0.0));
        let nan = Image { data: vec![f32::NAN; a.data.len()], ..a.clone() };
        assert_eq!(mean_flip(&black, &nan), Some(0.0));
        assert_eq!(flip(&Image::rgb(2, 2), &a), None);
        assert_eq!(flip(&Image::new(2, 2, &["Y"]), &Image::new(2, 2, &["Y"])), None);
        assert_eq!(flip(&Image::default(), &Image::default()), None);
        assert!(mean_flip(&Image::rgb(1, 1), &Image::rgb(1, 1)) == Some(0.0));
    }
}
