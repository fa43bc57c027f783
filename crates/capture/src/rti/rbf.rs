//! Interpolation between the lights of a stack by radial basis functions of their directions.
//!
//! What a texel shows under a new light is a weighted sum of what it showed under those of the stack. The weights
//! are the same for all texels: a smooth function through the readings, with a plane in (x, y) under it.

use super::{Encoding, RtiError, fit, readings};
use crate::rows::for_rows;
use crate::{Lights, Stack};
use glam::Vec3;
use yugen_archive::formats::relightable::{Basis, Colouring};
use yugen_optics::linear::inverse;

/// The radial function.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Kernel {
    /// r² ln r of the distance in (x, y): the surface that bends least. Duchon 1977.
    #[default]
    ThinPlate,
    /// exp(−r²/σ²) of the distance between unit vectors, σ being twice the mean distance to the nearest light.
    Gaussian,
}

impl Kernel {
    fn value(self, a: Vec3, b: Vec3, sigma: f64) -> f64 {
        let d = (a - b).as_dvec3();
        match self {
            Self::ThinPlate => {
                let r2 = d.truncate().length_squared();
                if r2 > 0.0 { 0.5 * r2 * r2.ln() } else { 0.0 }
            }
            Self::Gaussian => (-d.length_squared() / (sigma * sigma)).exp(),
        }
    }
}

/// The plane under the radial functions.
const PLANE: usize = 3;

/// A factored set of lights.
struct System {
    kernel: Kernel,
    sigma: f64,
    lights: Vec<Vec3>,
    /// Of the n + 3 conditions: through every reading, and radial parts that bend no plane.
    inverse: Vec<f64>,
}

impl System {
    fn new(kernel: Kernel, lights: &[Vec3], smoothing: f64) -> Option<Self> {
        let n = lights.len();
        let nearest = |i: usize| {
            let others = lights.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, l)| f64::from(l.distance(lights[i]))).fold(2.0, f64::min)
        };
        let sigma = (2.0 * (0..n).map(nearest).sum::<f64>() / n as f64).max(1e-3);
        let size = n + PLANE;
        let mut a = vec![0.0; size * size];
        for i in 0..n {
            for j in 0..n {
                a[i * size + j] = kernel.value(lights[i], lights[j], sigma);
            }
            // The thin plate is conditionally positive definite with this sign, as the Gaussian is.
            a[i * size + i] += smoothing;
            for (k, v) in plane(lights[i]).into_iter().enumerate() {
                a[i * size + n + k] = v;
                a[(n + k) * size + i] = v;
            }
        }
        Some(Self { kernel, sigma, lights: lights.to_vec(), inverse: inverse(a, size)? })
    }

    /// What each reading counts under a new light.
    fn weights(&self, light: Vec3) -> Vec<f32> {
        let n = self.lights.len();
        let size = n + PLANE;
        let mut b: Vec<f64> = self.lights.iter().map(|l| self.kernel.value(light, *l, self.sigma)).collect();
        b.extend(plane(light));
        (0..n).map(|i| (0..size).map(|k| b[k] * self.inverse[k * size + i]).sum::<f64>() as f32).collect()
    }
}

fn plane(l: Vec3) -> [f64; PLANE] {
    [1.0, f64::from(l.x), f64::from(l.y)]
}

/// What [`Rbf::new`] chooses the smoothing from.
const SMOOTHINGS: [f64; 6] = [0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];
/// Texels that it looks at.
const SAMPLE: usize = 64;

/// A stack ready to be interpolated.
pub struct Rbf<'a> {
    stack: &'a Stack,
    kernel: Kernel,
    encoding: Encoding,
    smoothing: f64,
    /// `None` where every texel has its own lights.
    shared: Option<System>,
    /// What fills in for masked readings.
    fallback: Option<fit::Fitted>,
}

impl<'a> Rbf<'a> {
    /// Chooses the smoothing under which readings that are left out, one at a time, are predicted best: Rippa 1999,
    /// "An algorithm for selecting a good value for the parameter c in radial basis function interpolation".
    pub fn new(stack: &'a Stack, kernel: Kernel, encoding: Encoding) -> Result<Self, RtiError> {
        let n = stack.lights.len();
        if n < PLANE + 1 {
            return Err(RtiError::TooFewLights { lights: n, what: "RBF", least: PLANE + 1 });
        }
        let texels = stack.width * stack.height;
        let centre = |l: usize| stack.light(l, stack.width / 2, stack.height / 2).0;
        let lights: Vec<Vec3> = (0..n).map(centre).collect();
        let mut best = (f64::INFINITY, 0.0, None);
        let mut values = vec![[0.0; 3]; n];
        let size = n + PLANE;
        // The plate has no size of its own: what smooths it is relative to the spread of the lights.
        for smoothing in SMOOTHINGS {
            let signed = if kernel == Kernel::ThinPlate { -smoothing } else { smoothing };
            let Some(system) = System::new(kernel, &lights, signed) else { continue };
            let mut error = 0.0;
            let chosen = SAMPLE.min(texels);
            for i in 0..chosen {
                let texel = i * texels / chosen;
                if readings(stack, texel % stack.width, texel / stack.width, encoding, &mut values) {
                    continue;
                }
                for i in 0..n {
                    let row = &system.inverse[i * size..][..n];
                    for c in 0..3 {
                        let alpha: f64 = row.iter().zip(&values).map(|(a, v)| a * f64::from(v[c])).sum();
                        error += (alpha / row[i]).powi(2);
                    }
                }
            }
            if best.2.is_none() || error < best.0 {
                best = (error, signed, Some(system));
            }
        }
        let (_, smoothing, Some(system)) = best else { return Err(RtiError::LightsOnALine) };
        let near = matches!(stack.lights, Lights::Near(_));
        let masked = stack.values.iter().flatten().any(|v| !v.is_finite());
        let fallback = masked.then(|| -> Result<_, RtiError> {
            let basis = Basis::Ptm;
            let ridge = fit::choose_ridge(stack, basis, encoding)?;
            fit::fit(stack, &fit::Options { basis, colouring: Colouring::Rgb, encoding, ridge })
        });
        let fallback = fallback.transpose()?;
        Ok(Self { stack, kernel, encoding, smoothing, shared: (!near).then_some(system), fallback })
    }

    /// Encoded values of all texels under light from the unit vector that `toward` gives for texel (x, y); lights far
    /// away are asked for once, at (0, 0).
    pub fn picture(&self, toward: impl Fn(usize, usize) -> Vec3 + Sync) -> Vec<[f32; 3]> {
        let (width, n) = (self.stack.width, self.stack.lights.len());
        let shared = self.shared.as_ref().map(|s| s.weights(toward(0, 0)));
        let mut out = vec![[0.0; 3]; width * self.stack.height];
        for_rows(&mut out, width, |y, row| {
            let mut values = vec![[0.0; 3]; n];
            for (x, out) in row.iter_mut().enumerate() {
                if readings(self.stack, x, y, self.encoding, &mut values) {
                    self.fill(x, y, &mut values);
                }
                let own = shared.is_none().then(|| {
                    let lights: Vec<Vec3> = (0..n).map(|l| self.stack.light(l, x, y).0).collect();
                    let system = System::new(self.kernel, &lights, self.smoothing);
                    system.map_or(vec![0.0; n], |s| s.weights(toward(x, y)))
                });
                for (w, v) in own.as_ref().or(shared.as_ref()).into_iter().flatten().zip(&values) {
                    (0..3).for_each(|c| out[c] += w * v[c]);
                }
            }
        });
        out
    }

    /// Puts what a polynomial through the other readings says in place of masked ones.
    fn fill(&self, x: usize, y: usize, values: &mut [[f32; 3]]) {
        let Some(fit::Fitted { picture, .. }) = &self.fallback else { return };
        let texel = &picture.coefficients[(y * picture.width + x) * picture.stride()..][..picture.stride()];
        for (light, v) in values.iter_mut().enumerate().filter(|(_, v)| v[0].is_nan()) {
            *v = super::light::texel_under(
                picture,
                texel,
                &super::evaluate(picture.basis, self.stack.light(light, x, y).0),
            );
        }
    }
}
