//! Least squares of a basis over the lights of a stack, texel by texel.
//!
//! Where no reading is masked all texels share one pseudo-inverse of the basis over the lights, and a fit is one
//! product with it: each reading is looked at once. Texels with masked readings and stacks with lamps near the sample
//! have their own lights, and so systems of their own.

use super::basis::{MOST, degree, evaluate};
use super::solve::{cholesky, cholesky_solve};
use super::{Encoding, RtiError, readings};
use crate::rows::for_rows;
use crate::{Lights, Stack};
use glam::Vec3;
use yugen_archive::formats::relightable::{Basis, Colouring, Relightable};

/// What is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The functions of light.
    pub basis: Basis,
    /// What they make up.
    pub colouring: Colouring,
    /// What the values mean.
    pub encoding: Encoding,
    /// How strongly terms are held near zero, relative to a light and times their degree squared; see [`choose_ridge`].
    pub ridge: f64,
}

/// A fitted band.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The picture; texels without a single reading are black.
    pub picture: Relightable,
    /// How many those are.
    pub empty: usize,
}

/// Fewer lights than this say nothing about how a texel depends on light.
pub const LEAST_LIGHTS: usize = 3;

/// Even with nothing held near zero the system must have one solution.
const FLOOR: f64 = 1e-10;

/// What [`choose_ridge`] chooses from.
const RIDGES: [f64; 8] = [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];

/// Texels that [`choose_ridge`] looks at.
const SAMPLE: usize = 256;

/// Fits every texel of a band. Same bits for any number of threads.
pub fn fit(stack: &Stack, options: &Options) -> Result<Fitted, RtiError> {
    check(stack, options.basis)?;
    let Options { basis, colouring, encoding, .. } = *options;
    let (width, height) = (stack.width, stack.height);
    let mut picture = Relightable { width, height, basis, colouring, coefficients: Vec::new() };
    let (stride, terms, lights) = (picture.stride(), basis.terms(), stack.lights.len());
    picture.coefficients = vec![0.0; width * height * stride];
    let shared = match &stack.lights {
        Lights::Distant(toward) => {
            let rows: Vec<_> = toward.iter().map(|l| evaluate(basis, *l)).collect();
            Some(Product::new(&rows, options))
        }
        Lights::Near(_) => None,
    };
    for_rows(&mut picture.coefficients, width * stride, |y, row| {
        let mut values = vec![[0.0; 3]; lights];
        let mut rgb = vec![[0.0f32; 3]; terms];
        let mut own: Option<(Vec<bool>, Product)> = None;
        for (x, out) in row.chunks_exact_mut(stride).enumerate() {
            if let Some(product) = &shared {
                let mut encoded = stack.samples(x, y);
                if encoding != Encoding::Linear {
                    let all = values.as_flattened_mut().iter_mut().zip(encoded.as_flattened());
                    all.for_each(|(v, light)| *v = encoding.encode(*light));
                    encoded = &values;
                }
                product.apply(encoded.as_flattened(), &mut rgb);
                // One reading that is no number makes no number of every coefficient of its colour.
                if rgb.as_flattened().iter().all(|v| v.is_finite()) {
                    store(&rgb, encoded, colouring, out);
                    continue;
                }
            }
            readings(stack, x, y, encoding, &mut values);
            let used: Vec<bool> = values.iter().map(|v| !v[0].is_nan()).collect();
            // Neighbours often lack the same readings; lamps near the sample make every texel another.
            if shared.is_none() || own.as_ref().is_none_or(|o| o.0 != used) {
                let row = |l: usize| match used[l] {
                    true => evaluate(basis, stack.light(l, x, y).0),
                    false => [0.0; MOST],
                };
                let rows: Vec<_> = (0..lights).map(row).collect();
                own = Some((used, Product::new(&rows, options)));
            }
            values.iter_mut().filter(|v| v[0].is_nan()).for_each(|v| *v = [0.0; 3]);
            if let Some((_, product)) = &own {
                product.apply(values.as_flattened(), &mut rgb);
                store(&rgb, &values, colouring, out);
            }
        }
    });
    let empty = stack.values.chunks_exact(lights).filter(|t| t.iter().all(unusable)).count();
    Ok(Fitted { picture, empty })
}

/// The coefficients of a texel as they are kept, from those of each colour and the readings.
fn store(rgb: &[[f32; 3]], values: &[[f32; 3]], colouring: Colouring, out: &mut [f32]) {
    match colouring {
        Colouring::Rgb => out.copy_from_slice(rgb.as_flattened()),
        Colouring::Lrgb => {
            let colour = main_colour(values);
            out[..3].copy_from_slice(&colour.to_array());
            let scale = colour / colour.length_squared();
            for (out, c) in out[3..].iter_mut().zip(rgb) {
                *out = scale.dot(Vec3::from_array(*c));
            }
        }
    }
}

/// The ridge under which readings that are left out, one at a time, are predicted best: Allen 1974, "The Relationship
/// Between Variable Selection and Data Augmentation and a Method for Prediction" (PRESS), over a sample of texels.
pub fn choose_ridge(stack: &Stack, basis: Basis, encoding: Encoding) -> Result<f64, RtiError> {
    check(stack, basis)?;
    let lights = stack.lights.len();
    let texels = stack.width * stack.height;
    let mut errors = [0.0; RIDGES.len()];
    let mut values = vec![[0.0; 3]; lights];
    let chosen = SAMPLE.min(texels);
    for i in 0..chosen {
        let texel = i * texels / chosen;
        let (x, y) = (texel % stack.width, texel / stack.width);
        readings(stack, x, y, encoding, &mut values);
        let used: Vec<usize> = (0..lights).filter(|l| !values[*l][0].is_nan()).collect();
        if used.len() < LEAST_LIGHTS {
            continue;
        }
        let rows: Vec<_> = used.iter().map(|l| evaluate(basis, stack.light(*l, x, y).0)).collect();
        for (error, ridge) in errors.iter_mut().zip(RIDGES) {
            let Some(system) = System::new(&rows, basis, ridge) else {
                *error = f64::INFINITY;
                continue;
            };
            let solutions = [0, 1, 2].map(|c| {
                let mut k = [0.0; MOST];
                for (row, l) in rows.iter().zip(&used) {
                    k.iter_mut().zip(row).for_each(|(k, b)| *k += b * f64::from(values[*l][c]));
                }
                system.solve(&mut k);
                k
            });
            for (row, l) in rows.iter().zip(&used) {
                let mut k = *row;
                system.solve(&mut k);
                let dot = |k: &[f64; MOST]| -> f64 { k.iter().zip(row).map(|(a, b)| a * b).sum() };
                // Where a reading decides alone both this and the error vanish, and their ratio does not: with the
                // floor under the system neither is smaller than 1e-11.
                let freedom = (1.0 - dot(&k)).max(1e-12);
                for (c, k) in solutions.iter().enumerate() {
                    *error += ((f64::from(values[*l][c]) - dot(k)) / freedom).powi(2);
                }
            }
        }
    }
    // Of equals the first: with exact data nothing is held.
    let best = errors.iter().zip(RIDGES).min_by(|a, b| a.0.total_cmp(b.0));
    Ok(best.map_or(0.0, |b| b.1))
}

fn check(stack: &Stack, basis: Basis) -> Result<(), RtiError> {
    let lights = stack.lights.len();
    if lights < LEAST_LIGHTS {
        return Err(RtiError::TooFewLights { lights, what: basis.name(), least: LEAST_LIGHTS });
    }
    Ok(())
}

fn unusable(v: &[f32; 3]) -> bool {
    v.iter().any(|v| !v.is_finite())
}

/// The colour c for which readings are nearest to multiples of it (the first singular vector, by power iteration), its
/// largest channel 1; white where all is black.
fn main_colour(values: &[[f32; 3]]) -> Vec3 {
    let (mut m, mut mean) = ([Vec3::ZERO; 3], Vec3::ZERO);
    for v in values.iter().map(|v| Vec3::from_array(*v)) {
        mean += v;
        m = [m[0] + v * v.x, m[1] + v * v.y, m[2] + v * v.z];
    }
    let mut c = mean.abs() + Vec3::splat(1e-12);
    for _ in 0..8 {
        let next = m[0] * c.x + m[1] * c.y + m[2] * c.z;
        c = next.max(Vec3::ZERO) / next.max_element().max(f32::MIN_POSITIVE);
    }
    if c.max_element() > 0.5 && c.is_finite() { c } else { Vec3::ONE }
}

/// BᵀB with a ridge, factored.
struct System {
    terms: usize,
    factor: Vec<f64>,
}

impl System {
    /// Of the rows of B, one a light.
    fn new(rows: &[[f64; MOST]], basis: Basis, ridge: f64) -> Option<Self> {
        let terms = basis.terms();
        let mut a = vec![0.0; terms * terms];
        for row in rows {
            for i in 0..terms {
                for j in 0..terms {
                    a[i * terms + j] += row[i] * row[j];
                }
            }
        }
        let mean = (0..terms).map(|i| a[i * terms + i]).sum::<f64>() / terms as f64;
        for i in 0..terms {
            a[i * terms + i] += mean * (FLOOR + ridge * degree(basis, i).pow(2) as f64);
        }
        Some(Self { terms, factor: cholesky(a, terms)? })
    }

    fn solve(&self, b: &mut [f64; MOST]) {
        cholesky_solve(&self.factor, self.terms, &mut b[..self.terms]);
    }
}

/// Numbers side by side in [`Product::apply`]: eight lights of three colours, three registers of AVX.
const LANES: usize = 24;

/// (BᵀB + ridge)⁻¹ Bᵀ, each number three times, for red, green and blue of a light.
struct Product {
    /// Numbers of a term: three a light, made up with zeros.
    stride: usize,
    matrix: Vec<f32>,
}

impl Product {
    /// Rows of zeros are lights that do not count.
    fn new(rows: &[[f64; MOST]], options: &Options) -> Self {
        let terms = options.basis.terms();
        let stride = (3 * rows.len()).next_multiple_of(LANES);
        let mut matrix = vec![0.0; terms * stride];
        // Without a single light the system is singular, and zeros are the answer.
        if let Some(system) = System::new(rows, options.basis, options.ridge) {
            for (light, row) in rows.iter().enumerate() {
                let mut k = *row;
                system.solve(&mut k);
                for (term, k) in k[..terms].iter().enumerate() {
                    matrix[term * stride + 3 * light..][..3].fill(*k as f32);
                }
            }
        }
        Self { stride, matrix }
    }

    /// Coefficients of the readings, three numbers a light. The same bits on every processor: what differs is how many
    /// lanes it works on at a time, not their order.
    fn apply(&self, values: &[f32], out: &mut [[f32; 3]]) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor says that it has AVX2.
            #[allow(unsafe_code)]
            return unsafe { self.apply_avx2(values, out) };
        }
        self.apply_lanes(values, out);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn apply_avx2(&self, values: &[f32], out: &mut [[f32; 3]]) {
        self.apply_lanes(values, out);
    }

    #[inline(always)]
    fn apply_lanes(&self, values: &[f32], out: &mut [[f32; 3]]) {
        let (whole, rest) = values.as_chunks::<LANES>();
        let mut last = [0.0; LANES];
        last[..rest.len()].copy_from_slice(rest);
        let last = (!rest.is_empty()).then_some(&last);
        // Three terms at a time: nine registers of sums, three of readings.
        for (rows, out) in self.matrix.chunks(3 * self.stride).zip(out.chunks_mut(3)) {
            match out.len() {
                3 => self.block::<3>(rows, whole, last, out),
                2 => self.block::<2>(rows, whole, last, out),
                _ => self.block::<1>(rows, whole, last, out),
            }
        }
    }

    #[inline(always)]
    fn block<const T: usize>(
        &self,
        rows: &[f32],
        whole: &[[f32; LANES]],
        last: Option<&[f32; LANES]>,
        out: &mut [[f32; 3]],
    ) {
        let rows: [&[[f32; LANES]]; T] =
            std::array::from_fn(|t| rows[t * self.stride..][..self.stride].as_chunks::<LANES>().0);
        let mut sums = [[0.0f32; LANES]; T];
        for (i, v) in whole.iter().chain(last).enumerate() {
            for (sums, row) in sums.iter_mut().zip(&rows) {
                let row = &row[i];
                for j in 0..LANES {
                    sums[j] += row[j] * v[j];
                }
            }
        }
        // Without a wall here the compiler plans registers for the lines below, every third lane, and leaves the loop
        // above scalar.
        let sums = std::hint::black_box(sums);
        for (out, sums) in out.iter_mut().zip(&sums) {
            *out = [0, 1, 2].map(|c| (c..LANES).step_by(3).map(|j| sums[j]).sum());
        }
    }
}
