//! Pictures whose coefficients have colours of their own, under new light.

use super::light::Lamp;
use super::{Encoding, evaluate};
use crate::rows::for_rows;
use glam::{DVec3, Vec3};
use yugen_archive::formats::mixed::{Between, Functions, Mixed};

/// Chrominances of JFIF as red, green and blue: ITU-R BT.601, with Y, Cb and Cr of full range.
const CB: DVec3 = DVec3::new(0.0, -0.344_136, 1.772);
const CR: DVec3 = DVec3::new(1.402, -0.714_136, 0.0);

/// RelightLab leaves weights below this part of their sum out.
const LEAST_WEIGHT: f64 = 1e-3;

/// Under light from the unit vector `light` the colour that all texels share, then that of each coefficient.
pub fn colours(functions: &Functions, light: Vec3) -> Vec<[f64; 3]> {
    match functions {
        Functions::Luminance(basis) => {
            let terms = &evaluate(*basis, light)[..basis.terms()];
            let grey = terms.iter().map(|b| [*b; 3]);
            [[0.0; 3]].into_iter().chain(grey).chain([CB.to_array(), CR.to_array()]).collect()
        }
        Functions::Sampled { between, colours } => {
            let each = functions.coefficients() + 1;
            let mut sum = vec![[0.0; 3]; each];
            for (l, weight) in weights(between, light.as_dvec3()) {
                for (sum, colour) in sum.iter_mut().zip(&colours[l * each..][..each]) {
                    (0..3).for_each(|c| sum[c] += weight * f64::from(colour[c]));
                }
            }
            sum
        }
    }
}

/// The lights that count and what each counts; the sum is one.
fn weights(between: &Between, light: DVec3) -> Vec<(usize, f64)> {
    match between {
        Between::Gaussian { lights, sigma } => {
            let distances: Vec<f64> = lights.iter().map(|l| l.as_dvec3().distance_squared(light)).collect();
            // Relative to the nearest, so that light from far aside is not zero over zero.
            let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
            let squared = f64::from(*sigma).powi(2);
            let all: Vec<f64> = distances.iter().map(|d| (-(d - nearest) / squared).exp()).collect();
            let least = LEAST_WEIGHT * all.iter().sum::<f64>();
            let some: Vec<_> = all.into_iter().enumerate().filter(|(_, w)| *w > least).collect();
            let sum: f64 = some.iter().map(|(_, w)| w).sum();
            some.into_iter().map(|(l, w)| (l, w / sum)).collect()
        }
        Between::Octahedron { side } => {
            let sum = light.abs().element_sum();
            let place = |v: f64| (v / sum + 1.0) / 2.0 * (*side - 1) as f64;
            let (x, y) = (place(light.x + light.y), place(light.y - light.x));
            let cell = |v: f64| (v.max(0.0) as usize).min(side - 2);
            let (i, j) = (cell(x), cell(y));
            let (u, v) = (x - i as f64, y - j as f64);
            let at = |i: usize, j: usize| j * side + i;
            vec![
                (at(i, j), (1.0 - u) * (1.0 - v)),
                (at(i + 1, j), u * (1.0 - v)),
                (at(i, j + 1), (1.0 - u) * v),
                (at(i + 1, j + 1), u * v),
            ]
        }
    }
}

/// Encoded value of a texel.
#[inline]
fn texel_under(texel: &[f32], colours: &[[f32; 3]]) -> [f32; 3] {
    let mut out = colours[0];
    for (k, colour) in texel.iter().zip(&colours[1..]) {
        (0..3).for_each(|c| out[c] += k * colour[c]);
    }
    out
}

fn single(colours: Vec<[f64; 3]>) -> Vec<[f32; 3]> {
    colours.into_iter().map(|c| c.map(|v| v as f32)).collect()
}

/// Encoded values of all texels under light from the unit vector `light`, as they come out of the sum.
pub fn values(picture: &Mixed, light: Vec3) -> Vec<[f32; 3]> {
    let colours = single(colours(&picture.functions, light));
    shown(picture, |texel| texel_under(texel, &colours))
}

/// The picture under lamps, linear; as [`super::light::picture`].
pub fn picture(picture: &Mixed, lamps: &[Lamp], encoding: Encoding) -> Vec<[f32; 3]> {
    let all = lamps.iter().map(|l| (colours(&picture.functions, l.toward), l.white));
    match encoding {
        Encoding::Linear => {
            let mut sum = vec![[0.0; 3]; picture.functions.coefficients() + 1];
            for (colours, white) in all {
                let white = white.as_dvec3().to_array();
                for (sum, colour) in sum.iter_mut().zip(colours) {
                    (0..3).for_each(|c| sum[c] += white[c] * colour[c]);
                }
            }
            let sum = single(sum);
            shown(picture, |texel| texel_under(texel, &sum).map(|v| v.max(0.0)))
        }
        Encoding::Srgb => {
            let all: Vec<_> = all.map(|(colours, white)| (single(colours), white)).collect();
            shown(picture, |texel| {
                let light = all.iter().map(|(colours, white)| {
                    Vec3::from_array(texel_under(texel, colours).map(|v| encoding.decode(v))) * *white
                });
                light.sum::<Vec3>().to_array()
            })
        }
    }
}

fn shown(picture: &Mixed, show: impl Fn(&[f32]) -> [f32; 3] + Sync) -> Vec<[f32; 3]> {
    let (width, stride) = (picture.width, picture.functions.coefficients());
    let mut out = vec![[0.0; 3]; width * picture.height];
    for_rows(&mut out, width, |y, row| {
        let texels = picture.coefficients[y * width * stride..].chunks_exact(stride);
        row.iter_mut().zip(texels).for_each(|(out, texel)| *out = show(texel));
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_archive::formats::relightable::Basis;
    use yugen_optics::colour::srgb_to_linear;

    /// A shared colour and one coefficient's, which are functions of the light that interpolation keeps.
    fn sampled(between: Between, toward: &[Vec3], of: impl Fn(Vec3) -> f32) -> Functions {
        let colours = toward.iter().flat_map(|l| [[of(*l); 3], [0.5, of(*l), -of(*l)]]).collect();
        Functions::Sampled { between, colours }
    }

    /// The middles of the cells of a grid lie where the formula of the module's documentation puts them.
    #[test]
    fn the_grid_holds_the_hemisphere_as_half_an_octahedron() {
        let side = 5;
        let point = |i: usize, j: usize| {
            let (u, v) = (i as f32 / 2.0 - 1.0, j as f32 / 2.0 - 1.0);
            let (x, y) = ((u - v) / 2.0, (u + v) / 2.0);
            Vec3::new(x, y, 1.0 - x.abs() - y.abs())
        };
        let toward: Vec<Vec3> = (0..25).map(|l| point(l % 5, l / 5)).collect();
        let functions = sampled(Between::Octahedron { side }, &toward, |l| 0.3 + 0.2 * l.x - 0.1 * l.y);
        let norm = |l: Vec3| l / l.abs().element_sum();
        let mut seen = 0;
        for (l, point) in toward.iter().enumerate().filter(|(_, p)| p.z >= 0.0) {
            let light = point.normalize();
            let some: Vec<_> = weights(&Between::Octahedron { side }, light.as_dvec3())
                .into_iter()
                .filter(|w| w.1 > 1e-6)
                .collect();
            assert!(some.len() == 1 && some[0].0 == l && (some[0].1 - 1.0).abs() < 1e-6, "{l}: {some:?}");
            seen += 1;
        }
        assert_eq!(seen, 25);
        // Between them what is linear in the octahedron's plane.
        for light in [Vec3::new(0.3, 0.1, 0.9), Vec3::new(-0.6, 0.5, 0.2), Vec3::new(0.1, -0.99, 0.0)] {
            let light = light.normalize();
            let got = colours(&functions, light);
            let want = f64::from(0.3 + 0.2 * norm(light).x - 0.1 * norm(light).y);
            assert!((got[0][1] - want).abs() < 1e-6, "{light}: {got:?} {want}");
            assert!((got[1][0] - 0.5).abs() < 1e-6 && (got[1][2] + want).abs() < 1e-6);
        }
    }

    #[test]
    fn gaussians_count_the_near_lights_and_sum_to_one() {
        let lights =
            vec![Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.8, 0.0, 0.6), Vec3::new(0.0, 1.0, 0.0)];
        let between = Between::Gaussian { lights: lights.clone(), sigma: 0.4 };
        let light = Vec3::new(0.28, 0.0, 0.96);
        let d2 = |l: Vec3| f64::from(l.distance_squared(light));
        let w = [(-d2(lights[0]) / 0.16).exp(), (-d2(lights[1]) / 0.16).exp()];
        let got = weights(&between, light.as_dvec3());
        // The others weigh e⁻⁸ and less.
        assert_eq!(got.iter().map(|w| w.0).collect::<Vec<_>>(), [0, 1]);
        assert!((got[0].1 - w[0] / (w[0] + w[1])).abs() < 1e-6, "{got:?}");
        // Far from all of them, in units of sigma, the nearest counts alone.
        let narrow = Between::Gaussian { lights, sigma: 1e-3 };
        assert_eq!(weights(&narrow, DVec3::new(0.0, -0.8, 0.6)), [(0, 1.0)]);
    }

    #[test]
    fn lamps_add_up_in_light() {
        let functions = Functions::Luminance(Basis::Ptm);
        let one = [0.5, 0.1, 0.0, 0.0, 0.0, 0.0, 0.02, -0.01, 0.2, -0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0];
        let picture_of = Mixed { width: 2, height: 1, functions, coefficients: one.to_vec() };
        let light = Vec3::new(0.6, 0.0, 0.8);
        let shown = values(&picture_of, light);
        let want = [0.56 - 0.01402, 0.56 - 0.344_136 * 0.02 + 0.007_141_36, 0.56 + 0.035_44];
        assert!(shown[0].iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-6), "{shown:?} {want:?}");
        assert!(shown[1].iter().all(|v| (v - 0.14).abs() < 1e-6), "{shown:?}");
        let lamps = [Lamp::unit(light), Lamp { toward: Vec3::Z, white: Vec3::new(0.5, 1.0, 0.0) }];
        let above = values(&picture_of, Vec3::Z);
        let linear = picture(&picture_of, &lamps, Encoding::Linear);
        let srgb = picture(&picture_of, &lamps, Encoding::Srgb);
        for (i, c) in (0..2).flat_map(|i| (0..3).map(move |c| (i, c))) {
            let white = lamps[1].white[c];
            let sum = shown[i][c] + white * above[i][c];
            assert!((linear[i][c] - sum).abs() < 1e-6);
            let sum = srgb_to_linear(shown[i][c]) + white * srgb_to_linear(above[i][c]);
            assert!((srgb[i][c] - sum).abs() < 1e-5, "{i} {c}: {} {sum}", srgb[i][c]);
        }
    }
}
