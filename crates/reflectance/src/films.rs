//! Thin films and stacks of them, exact in polarisation and wavelength. Abelès 1950, "Recherches sur la
//! propagation des ondes électromagnétiques sinusoïdales dans les milieux stratifiés"; Born and Wolf, §1.6.
//!
//! Time runs as exp(−iωt), so that an absorbing index is n + ik with k > 0. Lengths are in nanometres.

use num_complex::Complex64;
use std::f64::consts::TAU;

/// A layer with parallel faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// n + ik.
    pub index: Complex64,
    /// nm.
    pub thickness: f64,
}

/// What becomes of light of intensity 1, for both polarisations.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Response {
    /// Reflected, electric field perpendicular to the plane of incidence.
    pub r_s: f64,
    /// Reflected, field in that plane.
    pub r_p: f64,
    /// Transmitted into the substrate, perpendicular.
    pub t_s: f64,
    /// Transmitted into the substrate, in the plane.
    pub t_p: f64,
}

impl Response {
    /// Of unpolarised light, the part reflected.
    pub fn reflectance(&self) -> f64 {
        0.5 * (self.r_s + self.r_p)
    }

    /// Of unpolarised light, the part transmitted.
    pub fn transmittance(&self) -> f64 {
        0.5 * (self.t_s + self.t_p)
    }
}

/// The cosine inside a medium of index `n` of light whose n₀ sin θ₀ is `tangential`: the branch that decays.
fn cosine_in(n: Complex64, tangential: f64) -> Complex64 {
    let s = tangential / n;
    let c = (1.0 - s * s).sqrt();
    let along = n * c;
    if along.im < 0.0 || (along.im == 0.0 && along.re < 0.0) { -c } else { c }
}

/// A characteristic matrix, row by row, without the factor e^`log`: thick absorbing layers would overflow.
#[derive(Clone, Copy)]
struct Matrix {
    m: [Complex64; 4],
    log: f64,
}

impl Matrix {
    const IDENTITY: Self =
        Self { m: [Complex64::ONE, Complex64::ZERO, Complex64::ZERO, Complex64::ONE], log: 0.0 };

    fn times(&self, o: &Self) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (self.m, o.m);
        let m = [a * e + b * g, a * f + b * h, c * e + d * g, c * f + d * h];
        let log = self.log + o.log;
        let size = m.iter().map(Complex64::norm_sqr).fold(0.0, f64::max).sqrt();
        if (1e-50..1e50).contains(&size) {
            Self { m, log }
        } else {
            Self { m: m.map(|x| x / size), log: log + size.ln() }
        }
    }

    fn power(mut self, mut n: u32) -> Self {
        let mut result = Self::IDENTITY;
        while n > 0 {
            if n % 2 == 1 {
                result = result.times(&self);
            }
            n /= 2;
            if n > 0 {
                self = self.times(&self);
            }
        }
        result
    }
}

/// Light of `wavelength` that comes from a clear medium of index `n0` at the cosine `cos0` onto `layers` (the
/// first met first) on a `substrate`.
pub fn stack(wavelength: f64, n0: f64, cos0: f64, layers: &[Layer], substrate: Complex64) -> Response {
    repeated_stack(wavelength, n0, cos0, layers, 1, substrate)
}

/// [`stack`] with `layers` repeated `repeats` times, at little more than the cost of one.
pub fn repeated_stack(
    wavelength: f64,
    n0: f64,
    cos0: f64,
    layers: &[Layer],
    repeats: u32,
    substrate: Complex64,
) -> Response {
    let cos0 = cos0.clamp(0.0, 1.0);
    // A wave along the surface does not enter.
    if cos0 == 0.0 {
        return Response { r_s: 1.0, r_p: 1.0, ..Response::default() };
    }
    let tangential = n0 * (1.0 - cos0 * cos0).sqrt();
    // Admittances for s and p.
    let admittances = |n: Complex64, cos: Complex64| [n * cos, n / cos];
    let mut period = [Matrix::IDENTITY; 2];
    for layer in layers {
        let cos = cosine_in(layer.index, tangential);
        let delta = layer.index * cos * (TAU * layer.thickness / wavelength);
        let turn = Complex64::cis(delta.re);
        let (forth, back) = (turn * (-2.0 * delta.im).exp(), turn.conj());
        let (cosine, i_sine) = ((forth + back) * 0.5, (forth - back) * 0.5);
        for (period, q) in period.iter_mut().zip(admittances(layer.index, cos)) {
            *period = period.times(&Matrix { m: [cosine, -i_sine / q, -i_sine * q, cosine], log: delta.im });
        }
    }
    let outer = admittances(n0.into(), cos0.into());
    let inner = admittances(substrate, cosine_in(substrate, tangential));
    let polarised = |p: usize| {
        let (q0, q_s) = (outer[p].re, inner[p]);
        let Matrix { m, log } = period[p].power(repeats);
        // Tangential fields at the first face for unit field at the last.
        let (b, c) = (m[0] + m[1] * q_s, m[2] + m[3] * q_s);
        let sum = q0 * b + c;
        (((q0 * b - c) / sum).norm_sqr(), 4.0 * q0 * q_s.re / sum.norm_sqr() * (-2.0 * log).exp())
    };
    let ((r_s, t_s), (r_p, t_p)) = (polarised(0), polarised(1));
    Response { r_s, r_p, t_s, t_p }
}

/// A clear coat much thicker than light stays coherent (a few micrometres), index `n`, over a base that reflects
/// `base(cosine inside the coat)`; what goes on between its faces adds as intensities. `absorption` is what one
/// perpendicular crossing leaves, 1 for a clear coat.
pub fn coat(n0: f64, cos0: f64, n: f64, absorption: f64, base: impl Fn(f64) -> Response) -> Response {
    let tangential = n0 * (1.0 - cos0 * cos0).max(0.0).sqrt();
    let outer = stack(1.0, n0, cos0, &[], n.into());
    let cos = cosine_in(n.into(), tangential);
    if cos.im > 0.0 {
        // Total reflection: the base is never reached.
        return outer;
    }
    let base = base(cos.re);
    let crossing = absorption.powf(1.0 / cos.re.max(1e-9));
    let both = |r: f64, r_base: f64, t_base: f64| {
        // In, down, up, and all the round trips between; out of a clear face as much as came in.
        let round = r * r_base * crossing * crossing;
        let through = 1.0 - r;
        (
            r + through * through * r_base * crossing * crossing / (1.0 - round),
            through * crossing * t_base / (1.0 - round),
        )
    };
    let (r_s, t_s) = both(outer.r_s, base.r_s, base.t_s);
    let (r_p, t_p) = both(outer.r_p, base.r_p, base.t_p);
    Response { r_s, r_p, t_s, t_p }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metals::Metal;

    fn layer(n: f64, k: f64, thickness: f64) -> Layer {
        Layer { index: Complex64::new(n, k), thickness }
    }

    fn degrees(angle: f64) -> f64 {
        angle.to_radians().cos()
    }

    fn near(got: f64, want: f64, tolerance: f64) {
        assert!((got - want).abs() <= tolerance, "{got} is not {want}");
    }

    #[test]
    fn a_soap_film_by_matrix_and_by_airy() {
        let n = 1.33;
        for (lambda, angle, s, p, mean) in [
            (550.0, 0.0, 0.075430, 0.075430, 0.075430),
            (550.0, 45.0, 0.091779, 0.004751, 0.048265),
            (550.0, 70.0, 0.009968, 0.001469, 0.005718),
            (450.0, 45.0, 0.188938, 0.010884, 0.099911),
            (650.0, 70.0, 0.186239, 0.032352, 0.109296),
        ] {
            let got = stack(lambda, 1.0, degrees(angle), &[layer(n, 0.0, 300.0)], Complex64::ONE);
            near(got.r_s, s, 6e-7);
            near(got.r_p, p, 6e-7);
            near(got.reflectance(), mean, 6e-7);
            near(got.r_s + got.t_s, 1.0, 1e-12);
            near(got.r_p + got.t_p, 1.0, 1e-12);
            // Airy 1833: r = (r01 + r12 e^{2iδ}) / (1 + r01 r12 e^{2iδ}).
            let cos = cosine_in(n.into(), angle.to_radians().sin()).re;
            let airy = |r01: f64| {
                let turn = Complex64::cis(2.0 * TAU * n * cos * 300.0 / lambda);
                ((r01 - r01 * turn) / (1.0 - r01 * r01 * turn)).norm_sqr()
            };
            let c0 = degrees(angle);
            near(airy((c0 - n * cos) / (c0 + n * cos)), got.r_s, 1e-12);
            near(airy((1.0 / c0 - n / cos) / (1.0 / c0 + n / cos)), got.r_p, 1e-12);
        }
    }

    #[test]
    fn quarter_wave_stacks_reach_their_closed_form() {
        let lambda = 550.0;
        let quarter = |n: f64| layer(n, 0.0, lambda / (4.0 * n));
        let high_low = |high: f64, low: f64, pairs: usize, extra: bool, substrate: f64| {
            let mut layers: Vec<Layer> = (0..pairs).flat_map(|_| [quarter(high), quarter(low)]).collect();
            if extra {
                layers.push(quarter(high));
            }
            stack(lambda, 1.0, 1.0, &layers, substrate.into()).reflectance()
        };
        let pair = [quarter(2.32), quarter(1.38)];
        for pairs in [0u32, 1, 3, 4, 11] {
            let once = high_low(2.32, 1.38, pairs as usize, false, 1.52);
            near(repeated_stack(lambda, 1.0, 1.0, &pair, pairs, 1.52.into()).reflectance(), once, 1e-12);
        }
        for (high, low, pairs, extra, substrate, want) in [
            (2.32, 1.38, 1, true, 1.52, 0.66963952),
            (2.32, 1.38, 2, true, 1.52, 0.86807876),
            (2.32, 1.38, 4, true, 1.52, 0.98245228),
            (2.32, 1.38, 8, true, 1.52, 0.99972259),
            (2.32, 1.38, 1, false, 1.52, 0.38732507),
            (2.32, 1.38, 4, false, 1.52, 0.95959498),
            (1.68, 1.43, 4, true, 1.5, 0.55430561),
            (1.68, 1.43, 8, true, 1.5, 0.85085888),
            (1.68, 1.43, 12, true, 1.5, 0.95649199),
            (1.83, 1.34, 4, true, 1.0, 0.90598183),
            (1.83, 1.34, 8, true, 1.0, 0.99187455),
        ] {
            near(high_low(high, low, pairs, extra, substrate), want, 1e-8);
        }
        // The high-reflectance band in λ₀/λ: (4/π) asin((n_H − n_L)/(n_H + n_L)).
        let layers: Vec<Layer> = (0..60).flat_map(|_| [quarter(2.32), quarter(1.38)]).collect();
        let full = |x: f64| stack(lambda / x, 1.0, 1.0, &layers, 1.52.into()).reflectance() > 0.99;
        let width = (5000..15000).filter(|&i| full(f64::from(i) * 1e-4)).count() as f64 * 1e-4;
        near(width, 0.327056, 1e-3);
        // Antireflection, and the absentee half wave.
        let n = 1.52f64.sqrt();
        near(stack(lambda, 1.0, 1.0, &[quarter(n)], 1.52.into()).reflectance(), 0.0, 1e-30);
        let half = layer(2.0, 0.0, lambda / 4.0);
        near(stack(lambda, 1.0, 1.0, &[half], 1.52.into()).reflectance(), 0.04257999, 1e-8);
        near(stack(lambda, 1.0, 1.0, &[], 1.52.into()).reflectance(), 0.04257999, 1e-8);
    }

    #[test]
    fn lacquer_on_gold_and_any_stack_agree_with_tmm() {
        let layers = [layer(1.53, 0.0, 2000.0), layer(0.3256, 2.507, 100.0)];
        let at = |angle| stack(550.0, 1.0, degrees(angle), &layers, 1.53.into());
        near(at(0.0).reflectance(), 0.77912722, 1e-8);
        near(at(0.0).transmittance(), 8.507e-3, 5e-7);
        near(at(40.0).r_s, 0.83620811, 1e-8);
        near(at(40.0).r_p, 0.76152178, 1e-8);
        near(at(75.0).r_s, 0.93478378, 1e-8);
        near(at(75.0).r_p, 0.69606900, 1e-8);
        // R_s, T_s, R_p, T_p of random stacks by tmm 0.2.0 (Byrnes, "Multilayer optical calculations"), coh_tmm.
        for (lambda, angle, n0, layers, (n, k), [r_s, t_s, r_p, t_p]) in TMM {
            let layers: Vec<Layer> = layers.iter().map(|&(n, k, d)| layer(n, k, d)).collect();
            let got = stack(*lambda, *n0, degrees(*angle), &layers, Complex64::new(*n, *k));
            for (got, want) in [(got.r_s, r_s), (got.t_s, t_s), (got.r_p, r_p), (got.t_p, t_p)] {
                near(got, *want, 2e-10);
            }
        }
    }

    #[test]
    fn thick_absorbers_do_not_overflow() {
        let gold = Metal::Gold.index(550.0);
        let bulk = stack(550.0, 1.0, 0.7, &[], gold);
        for thickness in [1e3, 1e5, 1e9] {
            let got = stack(550.0, 1.0, 0.7, &[Layer { index: gold, thickness }], 1.53.into());
            near(got.r_s, bulk.r_s, 1e-12);
            near(got.r_p, bulk.r_p, 1e-12);
            assert!(got.transmittance() >= 0.0 && got.transmittance() < 1e-20);
        }
        let pair = [Layer { index: gold, thickness: 1e7 }, layer(9.0, 1e-9, 1e7)];
        near(repeated_stack(550.0, 1.0, 0.7, &pair, 4_000_000_000, 1.0.into()).r_s, bulk.r_s, 1e-12);
        for cos in [0.0, 1e-9, 1.0] {
            let r = stack(550.0, 1.0, cos, &[layer(1.4, 0.0, 100.0)], gold).reflectance();
            assert!((0.0..=1.0).contains(&r), "{cos} {r}");
        }
    }

    #[test]
    fn a_coat_is_the_mean_of_coherent_layers_of_many_thicknesses() {
        let gold = Metal::Gold.index(550.0);
        for cos in [1.0, 0.6, 0.2] {
            let thick = coat(1.0, cos, 1.53, 1.0, |c| stack(550.0, 1.53, c, &[], gold));
            // Thicknesses over whole periods of the phase.
            let inside = cosine_in(1.53.into(), (1.0f64 - cos * cos).sqrt()).re;
            let period = 550.0 / (2.0 * 1.53 * inside);
            let n = 64;
            let mean: f64 = (0..n)
                .map(|i| {
                    stack(550.0, 1.0, cos, &[layer(1.53, 0.0, period * f64::from(i) / f64::from(n))], gold)
                        .reflectance()
                })
                .sum::<f64>()
                / f64::from(n);
            near(thick.reflectance(), mean, 1e-9);
        }
        // Nothing gets lost over a clear base, half of it does in a grey coat.
        let clear = coat(1.0, 0.5, 1.5, 1.0, |c| stack(550.0, 1.5, c, &[], 1.3.into()));
        near(clear.reflectance() + clear.transmittance(), 1.0, 1e-12);
        let grey = coat(1.0, 1.0, 1.5, 0.5, |c| stack(550.0, 1.5, c, &[], 1.5.into()));
        near(grey.reflectance(), 0.04, 1e-12);
        near(grey.transmittance(), 0.96 * 0.5, 1e-12);
        let total = coat(1.5, 0.1, 1.0, 1.0, |_| unreachable!("light does not get there"));
        near(total.reflectance(), 1.0, 1e-12);
    }

    type Case = (f64, f64, f64, &'static [(f64, f64, f64)], (f64, f64), [f64; 4]);
    /// Wavelength, angle in degrees, outer index, layers (n, k, thickness), substrate.
    #[rustfmt::skip]
    const TMM: &[Case] = &[
        (577.2, 57.5, 1.33, &[(1.818, 0.0, 175.1), (1.043, 1.663, 10.2), (2.398, 2.627, 32.0), (2.369, 0.0, 539.1)], (1.549, 0.0), [0.6426922002, 0.04351745897, 0.2176988631, 0.1162441695]),
        (702.5, 26.9, 1.0, &[(1.422, 1.122, 106.2), (1.694, 3.487, 31.1), (2.247, 0.0, 16.0), (1.201, 0.0, 304.5)], (0.647, 2.287), [0.2233198723, 0.003966537423, 0.14858875, 0.004391160652]),
        (699.6, 20.0, 1.0, &[], (1.628, 0.0), [0.06633673664, 0.9336632634, 0.04848534383, 0.9515146562]),
        (582.6, 20.1, 1.33, &[], (1.96, 3.289), [0.5409662933, 0.4590337067, 0.4953424944, 0.5046575056]),
        (656.9, 54.0, 1.0, &[(1.303, 0.0, 507.7), (2.292, 1.628, 112.7), (1.488, 0.0, 446.1), (2.021, 0.0, 281.0)], (1.61, 1.089), [0.2766689452, 0.01459440755, 0.1626652859, 0.02288322062]),
        (536.2, 67.8, 1.0, &[], (1.957, 1.567), [0.6404681824, 0.3595318176, 0.09855609771, 0.9014439023]),
        (749.5, 27.8, 1.33, &[(1.935, 0.0, 564.9), (2.068, 0.0, 486.3), (1.768, 3.398, 51.1), (1.775, 0.0, 575.3), (1.085, 0.054, 53.3)], (2.309, 0.0), [0.2648686115, 0.1141663617, 0.2770498107, 0.09945922204]),
        (590.8, 21.9, 1.0, &[(1.425, 0.0, 494.8), (1.091, 0.34, 103.7)], (1.196, 0.0), [0.02035863463, 0.5056221593, 0.01675290586, 0.4845845357]),
        (723.5, 28.7, 1.0, &[(1.328, 0.0, 519.3), (1.184, 0.276, 5.3), (0.952, 3.716, 107.3)], (1.2, 4.168), [0.8026847077, 0.0001973754008, 0.7450688179, 0.0002425226446]),
        (395.6, 12.7, 1.33, &[(1.679, 0.0, 358.5), (1.802, 0.0, 416.0)], (1.008, 0.0), [0.1187864033, 0.8812135967, 0.09867424488, 0.9013257551]),
        (526.6, 35.4, 1.0, &[(0.308, 0.908, 74.1)], (1.489, 0.0), [0.4539732895, 0.3164187683, 0.3534971876, 0.2510202873]),
        (709.6, 19.6, 1.0, &[(2.142, 0.0, 564.9)], (1.755, 2.379), [0.0703623453, 0.9296376547, 0.08111882398, 0.918881176]),
        (605.2, 41.8, 1.33, &[(2.07, 0.0, 323.3), (1.287, 0.249, 9.9), (1.773, 0.0, 500.7), (1.425, 1.988, 73.8)], (1.735, 0.0), [0.308762465, 0.05412266246, 0.210773659, 0.05389059029]),
        (406.2, 16.4, 1.0, &[(1.498, 0.0, 333.8), (1.429, 0.0, 594.3), (2.346, 0.0, 179.9), (1.514, 0.0, 32.8), (0.743, 3.452, 23.8)], (1.349, 0.0), [0.6955615828, 0.08184189262, 0.6769411432, 0.08885749145]),
        (526.1, 14.9, 1.0, &[(1.859, 0.0, 274.6), (1.274, 3.694, 28.2), (1.501, 0.0, 120.1)], (0.404, 5.645), [0.5547956358, 0.007721110847, 0.5248475976, 0.009143584801]),
        (421.8, 64.6, 1.33, &[(0.333, 0.898, 53.0), (2.377, 0.0, 534.8), (1.545, 3.69, 16.7), (1.675, 0.0, 470.1)], (1.577, 3.289), [0.763065419, 0.004900241527, 0.6350175916, 0.0134400125]),
        (390.0, 13.3, 1.0, &[(1.666, 0.0, 568.8), (2.135, 1.703, 48.0), (0.332, 1.145, 31.4)], (1.391, 2.932), [0.3698013859, 0.006165600148, 0.3505603357, 0.00622965183]),
        (759.9, 6.0, 1.0, &[(1.36, 0.0, 227.1), (1.336, 0.0, 248.8), (1.223, 0.0, 45.4), (2.021, 0.0, 160.3)], (0.748, 5.408), [0.9048031433, 0.09519685671, 0.9039203705, 0.09607962954]),
        (701.8, 22.1, 1.33, &[(1.09, 2.978, 87.0), (0.931, 1.73, 49.4), (2.146, 0.0, 204.6), (1.281, 0.0, 223.3), (1.803, 0.0, 336.5)], (1.794, 0.0), [0.6326279745, 0.004035884666, 0.5804344963, 0.003878155694]),
        (539.3, 66.7, 1.0, &[(2.151, 2.025, 115.4), (1.923, 1.918, 59.5), (1.357, 0.0, 311.1)], (0.954, 4.995), [0.6910228664, 5.835818475e-06, 0.1421019264, 2.996571824e-05]),
        (651.4, 16.7, 1.0, &[], (2.337, 0.0), [0.1725928347, 0.8274071653, 0.1487367224, 0.8512632776]),
        (529.4, 3.0, 1.33, &[], (1.266, 0.0), [0.0006112988245, 0.9993887012, 0.0006042829495, 0.9993957171]),
        (477.6, 70.2, 1.0, &[], (0.6, 5.111), [0.9712942944, 0.02870570556, 0.8104548482, 0.1895451518]),
        (752.7, 69.5, 1.0, &[], (0.327, 0.835), [0.8315691542, 0.1684308458, 0.6252176039, 0.3747823961]),
    ];
}
