//! A measured BRDF as the parameters of any model of the library.
//!
//! What is fitted is never a model in particular: the parameter table of [`Kind`] says what there is to choose and
//! in which range, and probing the model ([`space`]) says which of it matters, which colours scale which channel,
//! and what must be equal for the lobe to be round. Then ([`search`]) every named form is screened from
//! well-spread starts, and the best are refined by Levenberg and Marquardt's method.

mod optimise;
mod search;
mod space;

use glam::{Mat3, Vec3};
use std::f32::consts::{FRAC_PI_2, TAU};
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;
use yugen_optics::random::Pcg32;
use yugen_reflectance::importance::from_rusinkiewicz;
use yugen_reflectance::{Bsdf, Data, Kind, ParamType};

pub use search::{Models, fit, unfit};

/// One reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// To the eye, unit, in the frame of the surface.
    pub wo: Vec3,
    /// To the light.
    pub wi: Vec3,
    /// f in 1/sr, without the cosine, linear RGB.
    pub f: Vec3,
    /// How much it counts: the solid angles of both directions it stands for; any unit.
    pub weight: f32,
}

/// Readings of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct Readings {
    /// Each with both directions above the horizon and finite.
    pub all: Vec<Reading>,
    /// Whether the material looks the same however it is turned: then fits are not offered a grain.
    pub isotropic: bool,
    /// The space of the colours.
    pub space: ColourSpace,
}

/// Point `i` of the sequence of Roberts 2018 ("The Unreasonable Effectiveness of Quasirandom Sequences") in `N`
/// dimensions, each in [0, 1).
pub(crate) fn r_sequence<const N: usize>(i: usize) -> [f64; N] {
    // The root of x^(N+1) = x + 1.
    let g = (0..64).fold(2.0f64, |x, _| (1.0 + x).powf(1.0 / (N as f64 + 1.0)));
    std::array::from_fn(|k| (0.5 + g.powi(-(k as i32 + 1)) * (i as f64 + 1.0)).fract())
}

impl Readings {
    /// `n` readings of a table or a model at well-spread half and difference vectors, both directions within
    /// `steepest` radians of the normal.
    ///
    /// √θ_h is even (highlights are narrow: MERL has the same steps), sin² θ_d, φ_d and φ_h too, in a sequence of
    /// low discrepancy. A point weighs what it stands for of dω_i dω_o = 4 cos θ_d dω_h dω_d.
    pub fn of(bsdf: &Bsdf, n: usize, steepest: f32, space: ColourSpace) -> Self {
        let lowest = steepest.cos();
        let mut all = Vec::with_capacity(n);
        // At 80 degrees about four of ten points lie within reach; a bound, in case none does.
        for i in 0..64 * n {
            if all.len() == n {
                break;
            }
            let [u, s, phi_d, phi_h] = r_sequence::<4>(i).map(|x| x as f32);
            let theta_h = u * u * FRAC_PI_2;
            let (wo, wi) = from_rusinkiewicz(theta_h, s.sqrt().asin(), TAU * phi_d);
            if wo.z < lowest || wi.z < lowest {
                continue;
            }
            let turn = Mat3::from_rotation_z(TAU * phi_h);
            let (wo, wi) = (turn * wo, turn * wi);
            let f = bsdf.eval(wo, wi);
            if f.is_finite() {
                all.push(Reading { wo, wi, f, weight: theta_h.sin() * u });
            }
        }
        Self { all, isotropic: is_isotropic(bsdf), space }
    }
}

/// Whether turning both directions together changes nothing that can be seen.
pub fn is_isotropic(bsdf: &Bsdf) -> bool {
    let mut rng = Pcg32::new(11, 5);
    (0..400).all(|_| {
        let mut draw = || spherical(1.4 * rng.next_f32(), TAU * rng.next_f32());
        let (wo, wi) = (draw(), draw());
        let turn = Mat3::from_rotation_z(TAU * rng.next_f32());
        let (a, b) = (bsdf.eval(wo, wi), bsdf.eval(turn * wo, turn * wi));
        // Far above rounding, which a steep lobe multiplies, and far below any anisotropy worth the name.
        (a - b).abs().max_element() <= 1e-2 * a.max(b).max_element() + 1e-6
    })
}

/// How far a fit is from the readings. w are the weights of the readings, of sum 1; the mean over the channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// √Σ w |f cos θ_i − g cos θ_i|^(2/3): Fores, Ferwerda and Gu 2012, "Toward a Perceptually Based Metric for BRDF
    /// Modeling".
    CubeRoot,
    /// Σ w |ln(1 + f cos θ_i) − ln(1 + g cos θ_i)|: Sztrajman et al. 2021, "Neural BRDF Representation and Importance
    /// Sampling".
    Log,
}

impl Metric {
    /// Between readings and what a fit says of them, both times cos θ_i.
    fn distance(self, readings: &[Reading], fitted: &[Vec3]) -> f64 {
        let total: f64 = readings.iter().map(|r| f64::from(r.weight)).sum();
        let term = |f: f32, g: f32| match self {
            Self::CubeRoot => f64::from(f - g).abs().powf(2.0 / 3.0),
            Self::Log => (f64::from(f).ln_1p() - f64::from(g).ln_1p()).abs(),
        };
        let sum: f64 = readings
            .iter()
            .zip(fitted)
            .map(|(r, g)| {
                let f = r.f * r.wi.z;
                f64::from(r.weight) * (term(f.x, g.x) + term(f.y, g.y) + term(f.z, g.z)) / 3.0
            })
            .sum::<f64>()
            / total;
        if self == Self::CubeRoot { sum.sqrt() } else { sum }
    }

    /// Between readings and any reflection `g(wo, wi)` in 1/sr.
    pub fn between(self, readings: &Readings, g: impl Fn(Vec3, Vec3) -> Vec3) -> f64 {
        let fitted: Vec<Vec3> = readings.all.iter().map(|r| g(r.wo, r.wi) * r.wi.z).collect();
        self.distance(&readings.all, &fitted)
    }
}

/// What to try and how hard.
#[derive(Clone, Debug)]
pub struct Options {
    /// What the fit makes small, and the table is ranked by.
    pub metric: Metric,
    /// How many lobes of the same model are added up: 1 or 2.
    pub lobes: usize,
    /// Starts for each form of a model.
    pub starts: usize,
    /// Threads; the result does not depend on it.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { metric: Metric::CubeRoot, lobes: 1, starts: 12, threads: 1 }
    }
}

/// A model with its parameters, one term of a sum.
#[derive(Clone, Debug, PartialEq)]
pub struct Lobe {
    /// Which model.
    pub kind: Kind,
    /// Its parameters in table order.
    pub slots: Vec<f32>,
}

/// The best a model can do.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// What was fitted; the ground, if it was added, comes last.
    pub model: Kind,
    /// The terms of the sum.
    pub lobes: Vec<Lobe>,
    /// Numbers that were free.
    pub free: usize,
    /// [`Metric::CubeRoot`].
    pub cube_root: f64,
    /// [`Metric::Log`].
    pub log: f64,
}

impl Fit {
    /// By the metric of the fit.
    pub fn error(&self, metric: Metric) -> f64 {
        match metric {
            Metric::CubeRoot => self.cube_root,
            Metric::Log => self.log,
        }
    }
}

#[cfg(test)]
mod tests;
