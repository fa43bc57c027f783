//! Least squares of a basis over the lights of a stack, texel by texel.
//!
//! Where no reading is masked all texels share one pseudo-inverse of the basis over the lights, and a fit is one
//! product with it: each reading is looked at once. Texels with masked readings and stacks with lamps near the sample
//! have their own lights, and so systems of their own.

use super::basis::{MOST, degree, evaluate};
use super::{Encoding, RtiError, readings};
use crate::lanes::{F, LANES};
use crate::rows::for_rows;
use crate::{Lights, Stack};
use glam::Vec3;
use std::sync::atomic::{AtomicUsize, Ordering};
use yugen_archive::formats::relightable::{Basis, Colouring, Relightable};
use yugen_optics::linear::{cholesky, cholesky_solve};

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

impl Fitted {
    /// A band without a texel.
    pub fn none(options: &Options) -> Self {
        let Options { basis, colouring, .. } = *options;
        let picture = Relightable { width: 0, height: 0, basis, colouring, coefficients: Vec::new() };
        Self { picture, empty: 0 }
    }
}

/// Fits every texel of a band. Same bits for any number of threads.
pub fn fit(stack: &Stack, options: &Options) -> Result<Fitted, RtiError> {
    let mut fitted = Fitted::none(options);
    fit_into(stack, options, &mut fitted)?;
    Ok(fitted)
}

/// As [`fit`], in the place of another band, whose memory serves again: the system hands out new memory about as slowly
/// as the fit fills it.
pub fn fit_into(stack: &Stack, options: &Options, fitted: &mut Fitted) -> Result<(), RtiError> {
    check(stack, options.basis)?;
    let _span = tracing::info_span!("fit_rti", texels = stack.width * stack.height).entered();
    let Options { basis, colouring, encoding, .. } = *options;
    let picture = &mut fitted.picture;
    let (width, height) = (stack.width, stack.height);
    (picture.width, picture.height, picture.basis, picture.colouring) = (width, height, basis, colouring);
    let (stride, lights) = (picture.stride(), stack.lights.len());
    picture.coefficients.resize(width * height * stride, 0.0);
    let shared = match &stack.lights {
        Lights::Distant(toward) => {
            let rows: Vec<_> = toward.iter().map(|l| evaluate(basis, *l)).collect();
            Some(Product::new(&rows, options))
        }
        Lights::Near(_) => None,
    };
    let empty = AtomicUsize::new(0);
    for_rows(&mut picture.coefficients, width * stride, |y, row| {
        let mut values = vec![[0.0; 3]; AT_ONCE * lights];
        let mut sums = [[[F::ZERO; GROUPS]; 3]; AT_ONCE];
        let mut own: Option<(Vec<bool>, Product)> = None;
        for (i, out) in row.chunks_mut(AT_ONCE * stride).enumerate() {
            let texels = out.len() / stride;
            if let Some(product) = &shared {
                // Where the product itself goes through memory, by reading and reading of several texels, it waits for
                // each line; a copy goes straight ahead, and costs a quarter of that.
                let from = &stack.values[(y * width + i * AT_ONCE) * lights..][..texels * lights];
                encode(encoding, from, &mut values);
                product.apply(&values, &mut sums[..texels]);
            }
            for (k, out) in out.chunks_exact_mut(stride).enumerate() {
                // One reading that is no number makes no number of every coefficient of its colour.
                if shared.is_some() && finite(&sums[k]) {
                    store(&sums[k], &values[k * lights..][..lights], colouring, out);
                    continue;
                }
                let x = i * AT_ONCE + k;
                let values = &mut values[k * lights..][..lights];
                readings(stack, x, y, encoding, values);
                let used: Vec<bool> = values.iter().map(|v| !v[0].is_nan()).collect();
                if !used.contains(&true) {
                    out.fill(0.0);
                    empty.fetch_add(1, Ordering::Relaxed);
                    continue;
                }
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
                    product.apply(values, &mut sums[k..][..1]);
                    store(&sums[k], values, colouring, out);
                }
            }
        }
    });
    fitted.empty = empty.into_inner();
    Ok(())
}

/// Values of light as the fit wants them.
fn encode(encoding: Encoding, light: &[[f32; 3]], values: &mut [[f32; 3]]) {
    let all = values.as_flattened_mut().iter_mut().zip(light.as_flattened());
    // The choice outside the loop, so that each goes through many numbers at once.
    match encoding {
        Encoding::Linear => all.for_each(|(v, light)| *v = *light),
        Encoding::Srgb => all.for_each(|(v, light)| *v = Encoding::Srgb.encode(*light)),
    }
}

fn finite(sums: &Sums) -> bool {
    // Zero times what is not finite is not a number, and stays so in a sum.
    let zeros = sums.as_flattened().iter().fold(F::ZERO, |all, s| all + *s * 0.0);
    zeros.0 == F::ZERO.0
}

/// The coefficients of a texel as they are kept, from those of each colour and the readings.
fn store(sums: &Sums, values: &[[f32; 3]], colouring: Colouring, out: &mut [f32]) {
    let of = |term: usize| Vec3::from_array([0, 1, 2].map(|c| sums[c][term / LANES].0[term % LANES]));
    match colouring {
        Colouring::Rgb => {
            for (term, out) in out.chunks_exact_mut(3).enumerate() {
                out.copy_from_slice(&of(term).to_array());
            }
        }
        Colouring::Lrgb => {
            let colour = main_colour(values);
            out[..3].copy_from_slice(&colour.to_array());
            let scale = colour / colour.length_squared();
            for (term, out) in out[3..].iter_mut().enumerate() {
                *out = scale.dot(of(term));
            }
        }
    }
}

/// The ridge under which readings that are left out, one at a time, are predicted best: Allen 1974, "The Relationship
/// Between Variable Selection and Data Augmentation and a Method for Prediction" (PRESS), over a sample of texels.
pub fn choose_ridge(stack: &Stack, basis: Basis, encoding: Encoding) -> Result<f64, RtiError> {
    check(stack, basis)?;
    let _span = tracing::info_span!("choose_ridge").entered();
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

/// Texels that go together: the sums of four, three colours each, and the numbers of a light fill the registers of AVX.
const AT_ONCE: usize = 4;
/// Vectors that hold the terms of a basis.
const GROUPS: usize = MOST / LANES;
/// Coefficients of a texel: for each colour its terms, side by side.
type Sums = [[F; GROUPS]; 3];

/// (BᵀB + ridge)⁻¹ Bᵀ.
struct Product {
    /// Vectors that the terms fill.
    groups: usize,
    /// Light after light its factors in each term, made up with zeros.
    columns: Vec<F>,
}

impl Product {
    /// Rows of zeros are lights that do not count.
    fn new(rows: &[[f64; MOST]], options: &Options) -> Self {
        let terms = options.basis.terms();
        let groups = terms.div_ceil(LANES);
        let mut columns = vec![F::ZERO; groups * rows.len()];
        // Without a single light the system is singular, and zeros are the answer.
        if let Some(system) = System::new(rows, options.basis, options.ridge) {
            for (row, column) in rows.iter().zip(columns.chunks_exact_mut(groups)) {
                let mut k = *row;
                system.solve(&mut k);
                for (term, k) in k[..terms].iter().enumerate() {
                    column[term / LANES].0[term % LANES] = *k as f32;
                }
            }
        }
        Self { groups, columns }
    }

    /// Coefficients of texels from their readings, texel after texel. The same bits on every processor and however many
    /// texels go together: each sum is its own, light after light, fused.
    fn apply(&self, values: &[[f32; 3]], sums: &mut [Sums]) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the processor says that it has both.
            #[allow(unsafe_code)]
            return unsafe { self.apply_fma(values, sums) };
        }
        self.apply_lanes(values, sums);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn apply_fma(&self, values: &[[f32; 3]], sums: &mut [Sums]) {
        self.apply_lanes(values, sums);
    }

    #[inline(always)]
    fn apply_lanes(&self, values: &[[f32; 3]], sums: &mut [Sums]) {
        // Twelve registers of sums in either case.
        match self.groups {
            1 => self.blocks::<1, 4>(values, sums),
            _ => self.blocks::<2, 2>(values, sums),
        }
    }

    #[inline(always)]
    fn blocks<const G: usize, const N: usize>(&self, values: &[[f32; 3]], sums: &mut [Sums]) {
        let columns = self.columns.as_chunks::<G>().0;
        let (blocks, rest) = sums.as_chunks_mut::<N>();
        let (first, last) = values.split_at(blocks.len() * N * columns.len());
        for (values, sums) in first.chunks_exact(N * columns.len()).zip(blocks) {
            block(columns, values, sums);
        }
        for (values, sums) in last.chunks_exact(columns.len()).zip(rest) {
            block(columns, values, std::array::from_mut(sums));
        }
    }
}

/// The sums of N texels over all lights.
#[inline(always)]
fn block<const G: usize, const N: usize>(columns: &[[F; G]], values: &[[f32; 3]], out: &mut [Sums; N]) {
    let lights = columns.len();
    let texels: [&[[f32; 3]]; N] = std::array::from_fn(|k| &values[k * lights..][..lights]);
    let mut sums = [[[F::ZERO; G]; 3]; N];
    for (l, column) in columns.iter().enumerate() {
        for k in 0..N {
            for c in 0..3 {
                let v = F::splat(texels[k][l][c]);
                for g in 0..G {
                    sums[k][c][g] = column[g].mul_add(v, sums[k][c][g]);
                }
            }
        }
    }
    for (out, sums) in out.iter_mut().zip(&sums) {
        for (out, sums) in out.iter_mut().zip(sums) {
            out[..G].copy_from_slice(sums);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::fibonacci_dome;
    use yugen_optics::random::Pcg32;

    #[test]
    fn sums_have_the_same_bits_on_any_processor_and_in_any_company() {
        const TEXELS: usize = 7;
        let mut rng = Pcg32::new(4, 4);
        for basis in Basis::ALL {
            let options =
                Options { basis, colouring: Colouring::Rgb, encoding: Encoding::Linear, ridge: 1e-3 };
            let rows: Vec<_> = fibonacci_dome(30, 1.3).into_iter().map(|l| evaluate(basis, l)).collect();
            let product = Product::new(&rows, &options);
            let values: Vec<[f32; 3]> = (0..TEXELS * 30).map(|_| rng.next_vec3().to_array()).collect();
            let none = [[F::ZERO; GROUPS]; 3];
            let (mut together, mut alone) = ([none; TEXELS], [none; TEXELS]);
            product.apply(&values, &mut together);
            for (values, sums) in values.chunks(30).zip(alone.chunks_mut(1)) {
                product.apply_lanes(values, sums);
            }
            assert_eq!(together, alone, "{}", basis.name());
            for (values, sums) in values.chunks(30).zip(&together) {
                for term in 0..basis.terms() {
                    for (c, sums) in sums.iter().enumerate() {
                        let factor =
                            |l: usize| product.columns[l * product.groups + term / LANES].0[term % LANES];
                        let want: f64 = (0..30).map(|l| f64::from(factor(l)) * f64::from(values[l][c])).sum();
                        let got = f64::from(sums[term / LANES].0[term % LANES]);
                        // Thirty roundings of sums of about 1; measured 8e-7.
                        assert!((got - want).abs() < 4e-6, "{got} {want}");
                    }
                }
            }
            let bad = [[f32::NAN, 0.5, f32::INFINITY]; 30];
            product.apply(&bad, &mut together[..1]);
            assert!(finite(&alone[0]) && !finite(&together[0]));
        }
    }
}
