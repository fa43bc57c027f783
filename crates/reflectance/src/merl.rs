//! Matusik, Pfister, Brand and McMillan 2003, "A Data-Driven Reflectance Model": the MERL tables.

use crate::importance::{HalfVectorTable, from_rusinkiewicz, rusinkiewicz};
use crate::microfacet::{d_ggx, v_smith_ggx_correlated};
use crate::model::{Data, Laws, Model, ModelError, Preset, Sample, Spec, params};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI};
use yugen_optics::ColourSpace;

/// Bins of θ_h, equal in √θ_h.
pub const THETA_H: usize = 90;
/// Bins of θ_d, equal.
pub const THETA_D: usize = 90;
/// Bins of φ_d over [0, π), equal; the other half follows from reciprocity.
pub const PHI_D: usize = 180;
/// Numbers of a measurement: θ_h slowest, then θ_d, φ_d, RGB.
pub const VALUES: usize = THETA_H * THETA_D * PHI_D * 3;

const SAMPLER: HalfVectorTable = HalfVectorTable { start: VALUES, n_theta: 32, n_phi: 1, n_u: 90, n_v: 36 };

params! {
    /// A measured isotropic BRDF at the resolution of the MERL database.
    pub struct Merl {
        scale: f32 = Spec::num(1.0, 0.0, 1.0, "", "factor on the measurement"),
    }
}

/// θ_h, θ_d, φ_d at the centre of a bin, radians.
pub fn bin_centre(theta_h: usize, theta_d: usize, phi_d: usize) -> [f32; 3] {
    let h = (theta_h as f32 + 0.5) / THETA_H as f32;
    [
        h * h * FRAC_PI_2,
        (theta_d as f32 + 0.5) / THETA_D as f32 * FRAC_PI_2,
        (phi_d as f32 + 0.5) / PHI_D as f32 * PI,
    ]
}

/// A table in the order of [`VALUES`] from any isotropic reflection `f(wo, wi)`, at the centres of the bins;
/// −1 where a direction lies below the surface, as in the measurements.
pub fn tabulate(f: impl Fn(Vec3, Vec3) -> Vec3) -> Vec<f32> {
    tabulate_angles(|_, wo, wi| f(wo, wi))
}

/// As [`tabulate`], from a reflection that knows θ_h, θ_d, φ_d as well.
pub fn tabulate_angles(f: impl Fn([f32; 3], Vec3, Vec3) -> Vec3) -> Vec<f32> {
    let mut values = Vec::with_capacity(VALUES);
    for h in 0..THETA_H {
        for d in 0..THETA_D {
            for p in 0..PHI_D {
                let angles @ [th, td, pd] = bin_centre(h, d, p);
                let (wo, wi) = from_rusinkiewicz(th, td, pd);
                let value = if wo.z > 0.0 && wi.z > 0.0 { f(angles, wo, wi) } else { Vec3::NEG_ONE };
                values.extend(value.to_array());
            }
        }
    }
    values
}

fn index(theta_h: usize, theta_d: usize, phi_d: usize) -> usize {
    3 * ((theta_h * THETA_D + theta_d) * PHI_D + phi_d)
}

/// Trilinear between the centres of the bins, in index space: linear in √θ_h, so that highlights do not band.
fn look_up(table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
    let angles = rusinkiewicz(wo, wi);
    let cell = |x: f32, n: usize| {
        let x = (x * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
        let i = (x as usize).min(n - 2);
        (i, x - i as f32)
    };
    let (h, x) = cell((angles.x / FRAC_PI_2).sqrt(), THETA_H);
    let (d, y) = cell(angles.y / FRAC_PI_2, THETA_D);
    // φ_d has period π by reciprocity.
    let z = angles.z / PI;
    let z = (z - z.floor()) * PHI_D as f32 - 0.5;
    let low = z.floor();
    let z = z - low;
    let p = (low as i32).rem_euclid(PHI_D as i32) as usize;
    let q = (p + 1) % PHI_D;
    let at = |h: usize, d: usize| {
        let (i, j) = (index(h, d, p), index(h, d, q));
        Vec3::from_slice(&table[i..]).lerp(Vec3::from_slice(&table[j..]), z)
    };
    at(h, d).lerp(at(h, d + 1), y).lerp(at(h + 1, d).lerp(at(h + 1, d + 1), y), x)
}

/// Puts the nearest valid value into bins without one (negative or not a number), along θ_d first, so that
/// interpolation never reaches across the border of what was measured.
fn fill_invalid(values: &mut [f32]) {
    let valid = |v: &[f32], i: usize| v[i..i + 3].iter().all(|x| x.is_finite() && *x >= 0.0);
    let copy = |v: &mut [f32], from: usize, to: usize| v.copy_within(from..from + 3, to);
    for h in 0..THETA_H {
        for p in 0..PHI_D {
            match (0..THETA_D).find(|&d| valid(values, index(h, d, p))) {
                Some(first) => {
                    (0..first).for_each(|d| copy(values, index(h, first, p), index(h, d, p)));
                    for d in first + 1..THETA_D {
                        if !valid(values, index(h, d, p)) {
                            copy(values, index(h, d - 1, p), index(h, d, p));
                        }
                    }
                }
                None if h > 0 => (0..THETA_D).for_each(|d| copy(values, index(h - 1, d, p), index(h, d, p))),
                None => (0..THETA_D).for_each(|d| values[index(h, d, p)..][..3].fill(0.0)),
            }
        }
    }
}

impl Model for Merl {
    const NAME: &'static str = "merl";
    const SOURCE: &'static str = "Matusik, Pfister, Brand and McMillan 2003, A Data-Driven Reflectance Model";
    const DOC: &'static str = "A measured isotropic material, one value per degree: reads the .binary files of the \
        MERL database. Interpolated without bands, invalid bins filled from their neighbours, sampled by \
        importance. What the camera saw beyond 80 degrees is noise; the model shows it as it is, so that some \
        measurements reflect more than they receive there.";
    const LAWS: Laws = Laws::PHYSICAL;
    const WGSL: &'static str = include_str!("merl.wgsl");
    const COSTLY: bool = true;
    const DATA: Data = Data::Required("the values of a MERL .binary file: 90 x 90 x 180 x RGB");
    const PRESETS: &'static [Preset] = &[Preset {
        name: "red_plastic",
        doc: "no measurement: red Lambert under GGX of roughness 0.15 at F0 0.05, put into a MERL table",
    }];

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let red = ColourSpace::LinearSrgb.matrix_to(space) * Vec3::new(0.5, 0.06, 0.04);
        (name == "red_plastic").then(|| {
            let f = |wo: Vec3, wi: Vec3| {
                let h = (wo + wi).normalize();
                red * FRAC_1_PI + 0.05 * d_ggx(h, 0.15, 0.15) * v_smith_ggx_correlated(wo, wi, 0.15, 0.15)
            };
            (Self::default(), tabulate(f))
        })
    }

    fn bake(&self, data: &[f32]) -> Result<Vec<f32>, ModelError> {
        if data.len() != VALUES {
            return Err(ModelError::BadTable {
                model: Self::NAME,
                problem: format!("needs {VALUES} numbers (90 x 90 x 180 bins, RGB) but got {}", data.len()),
            });
        }
        let mut table = data.to_vec();
        fill_invalid(&mut table);
        let sampler = SAMPLER.build(|wo, wi| look_up(&table, wo, wi));
        table.extend(sampler);
        Ok(table)
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        self.scale * look_up(table, wo, wi)
    }

    fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        SAMPLER.pdf(table, wo, wi)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        SAMPLER.sample_with(table, wo, u, |wo, wi| self.eval(table, wo, wi))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::frame::spherical;
    use yugen_optics::random::Pcg32;

    fn smooth(wo: Vec3, wi: Vec3) -> Vec3 {
        let h = (wo + wi).normalize();
        Vec3::new(0.2, 0.1, 0.05) + 0.3 * d_ggx(h, 0.15, 0.15) * v_smith_ggx_correlated(wo, wi, 0.15, 0.15)
    }

    fn baked() -> &'static [f32] {
        static TABLE: std::sync::OnceLock<Vec<f32>> = std::sync::OnceLock::new();
        TABLE.get_or_init(|| Merl::default().bake(&tabulate(smooth)).unwrap())
    }

    #[test]
    fn follows_the_tabulated_function_between_the_bins() {
        let (table, m) = (baked(), Merl::default());
        let mut rng = Pcg32::new(2, 2);
        let (mut worst, mut sum) = (0.0f32, 0.0f64);
        let n = 20_000;
        for _ in 0..n {
            let u = rng.next_vec3();
            let (theta_o, phi) = (1.3 * u.x, 6.2 * u.y);
            let wo = spherical(theta_o, phi);
            let wi = spherical(1.3 * u.z, phi + 6.2 * rng.next_f32());
            let (got, want) = (m.eval(table, wo, wi), smooth(wo, wi));
            let error = ((got - want) / want).abs().max_element();
            worst = worst.max(error);
            sum += f64::from(error);
        }
        // Measured: worst 3.8e-3, mean 5.7e-4.
        assert!(worst < 0.016 && sum / f64::from(n) < 2.4e-3, "{worst} {}", sum / f64::from(n));
    }

    #[test]
    fn does_not_band() {
        // Along a smooth scan, the second difference of a banded lookup is as large as the first.
        let (table, m) = (baked(), Merl::default());
        let wo = spherical(0.8, 3.0);
        let scan: Vec<f32> = (0..4000)
            .map(|i| m.eval(table, wo, spherical(0.5 + i as f32 * 1e-4, 3.0 + std::f32::consts::PI)).x)
            .collect();
        let range = scan.iter().fold(0.0f32, |a, &b| a.max(b)) - scan.iter().fold(f32::MAX, |a, &b| a.min(b));
        let step = scan.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        // Nearest-bin lookup jumps by a bin's worth, about range/20; a smooth one by the slope, range/2000.
        assert!(step < range / 500.0, "{step} {range}");
    }

    #[test]
    fn invalid_bins_take_their_neighbours_value() {
        let mut values = tabulate(|_, _| Vec3::splat(0.3));
        let holes = values.iter().filter(|v| **v < 0.0).count();
        // 1 105 588 of 1 458 000 bins lie above the horizon in the measurements, mostly by the same geometry.
        assert!((340_000 * 3..370_000 * 3).contains(&holes), "{holes}");
        for i in (0..values.len()).step_by(3 * 97) {
            values[i + i % 3] = if i % 2 == 0 { f32::NAN } else { -7.0 };
        }
        let table = Merl::default().bake(&values).unwrap();
        assert!(table[..VALUES].iter().all(|v| *v == 0.3));
        assert!(matches!(Merl::default().bake(&values[1..]), Err(ModelError::BadTable { .. })));
        let nothing = Merl::default().bake(&vec![-1.0; VALUES]).unwrap();
        assert_eq!(Merl::default().eval(&nothing, Vec3::Z, Vec3::Z), Vec3::ZERO);
    }

    #[test]
    fn is_reciprocal_and_sampled_by_importance() {
        let (table, m) = (baked(), Merl::default());
        let mut rng = Pcg32::new(7, 1);
        for theta in [0.0f32, 0.5, 1.2, 1.5] {
            let wo = spherical(theta, 1.0);
            let (mut mean, mut square, n) = (0.0f64, 0.0f64, 8000);
            for _ in 0..n {
                if let Some(s) = m.sample(table, wo, rng.next_vec3()) {
                    let swapped = m.eval(table, s.wi, wo);
                    let f = m.eval(table, wo, s.wi);
                    assert!((swapped - f).abs().max_element() <= 2e-4 * f.max_element(), "{swapped} {f}");
                    mean += f64::from(s.weight.x) / f64::from(n);
                    square += f64::from(s.weight.x).powi(2) / f64::from(n);
                }
            }
            // Relative variance of one sample: measured 0.011 to 0.026.
            assert!(square / mean.powi(2) - 1.0 < 0.1, "{theta}: {}", square / mean.powi(2) - 1.0);
        }
    }
}
