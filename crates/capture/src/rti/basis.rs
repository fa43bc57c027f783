//! The functions of light that coefficients multiply.

use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use yugen_archive::formats::relightable::Basis;

/// The most terms of a basis.
pub(super) const MOST: usize = 16;

/// Values of the basis for light from the unit vector `light`, in the order of [`Basis`]; zeros after its terms.
pub fn evaluate(basis: Basis, light: Vec3) -> [f64; MOST] {
    match basis {
        Basis::Ptm => ptm(light.as_dvec3()),
        Basis::Hsh { order } => hsh(light.as_dvec3(), order),
    }
}

/// How far a term is from constant: the degree of the polynomial or the order of the harmonic.
pub(super) fn degree(basis: Basis, term: usize) -> usize {
    match basis {
        Basis::Ptm => [0, 1, 1, 2, 2, 2][term],
        Basis::Hsh { .. } => term.isqrt(),
    }
}

/// Malzbender, Gelb and Wolters 2001, equation 5.
fn ptm(l: DVec3) -> [f64; MOST] {
    let mut b = [0.0; MOST];
    b[..6].copy_from_slice(&[1.0, l.x, l.y, l.x * l.x, l.x * l.y, l.y * l.y]);
    b
}

/// Gautron, Křivánek, Pattanaik and Bouatouch 2004: the spherical harmonics of a polar angle stretched so that
/// 2 cos θ − 1 takes the place of cos θ, normalised on the hemisphere; the signs are those that HSH tools use.
fn hsh(l: DVec3, order: usize) -> [f64; MOST] {
    let c = l.z.clamp(0.0, 1.0);
    let d = 2.0 * c - 1.0;
    let s = (c - c * c).sqrt();
    let length = l.x.hypot(l.y);
    // At the pole all that depends on φ vanishes.
    let (cos, sin) = if length > 0.0 { (l.x / length, l.y / length) } else { (1.0, 0.0) };
    let (cos2, sin2) = (2.0 * cos * cos - 1.0, 2.0 * sin * cos);
    let (cos3, sin3) = (cos * (2.0 * cos2 - 1.0), sin * (2.0 * cos2 + 1.0));
    let norm = |n: f64| (n / PI).sqrt();
    let mut b = [0.0; MOST];
    b[0] = norm(0.5);
    if order > 1 {
        b[1] = norm(6.0) * cos * s;
        b[2] = norm(1.5) * d;
        b[3] = norm(6.0) * sin * s;
    }
    if order > 2 {
        b[4] = -norm(30.0) * cos2 * s * s;
        b[5] = norm(30.0) * cos * d * s;
        b[6] = norm(2.5) * (1.0 - 6.0 * s * s);
        b[7] = norm(30.0) * sin * d * s;
        b[8] = -norm(30.0) * sin2 * s * s;
    }
    if order > 3 {
        let q = 1.0 - 5.0 * s * s;
        b[9] = 2.0 * norm(35.0) * cos3 * s * s * s;
        b[10] = -norm(210.0) * cos2 * d * s * s;
        b[11] = 2.0 * norm(21.0) * cos * s * q;
        b[12] = norm(3.5) * d * (1.0 - 10.0 * s * s);
        b[13] = 2.0 * norm(21.0) * sin * s * q;
        b[14] = -norm(210.0) * sin2 * d * s * s;
        b[15] = 2.0 * norm(35.0) * sin3 * s * s * s;
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::quadrature::gauss_legendre;

    /// Products of two terms are trigonometric polynomials of degree 6 in φ and, as sin φ goes with the root of
    /// c − c², polynomials of degree 6 in c: quadrature is exact.
    #[test]
    fn hemispherical_harmonics_are_orthonormal() {
        let basis = Basis::Hsh { order: 4 };
        let mut product = [[0.0; MOST]; MOST];
        for (c, w) in gauss_legendre(8, 0.0, 1.0) {
            for i in 0..16 {
                let phi = 2.0 * PI * f64::from(i) / 16.0;
                let s = (1.0 - c * c).sqrt();
                let b = hsh(DVec3::new(s * phi.cos(), s * phi.sin(), c), 4);
                for (p, row) in product.iter_mut().enumerate() {
                    for (q, v) in row.iter_mut().enumerate() {
                        *v += w * PI / 8.0 * b[p] * b[q];
                    }
                }
            }
        }
        for (p, row) in product.iter().enumerate() {
            for (q, v) in row.iter().enumerate() {
                let want = f64::from(u8::from(p == q));
                assert!((v - want).abs() < 1e-12, "{p} {q} {v}");
            }
        }
        assert_eq!(basis.terms(), MOST);
    }

    /// The nine terms as they are printed in notes on HSH files, at one direction.
    #[test]
    fn terms_stand_in_the_order_and_with_the_signs_of_the_tools() {
        let (theta, phi) = (0.9f64, 2.2f64);
        let c = theta.cos();
        let l = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), c);
        let r = (c - c * c).sqrt();
        let want = [
            (1.0 / (2.0 * PI)).sqrt(),
            (6.0 / PI).sqrt() * phi.cos() * r,
            (3.0 / (2.0 * PI)).sqrt() * (2.0 * c - 1.0),
            (6.0 / PI).sqrt() * r * phi.sin(),
            (30.0 / PI).sqrt() * (2.0 * phi).cos() * (c * c - c),
            (30.0 / PI).sqrt() * phi.cos() * (2.0 * c - 1.0) * r,
            (5.0 / (2.0 * PI)).sqrt() * (1.0 - 6.0 * c + 6.0 * c * c),
            (30.0 / PI).sqrt() * (2.0 * c - 1.0) * r * phi.sin(),
            (30.0 / PI).sqrt() * (c * c - c) * (2.0 * phi).sin(),
            2.0 * (35.0 / PI).sqrt() * (3.0 * phi).cos() * (c - c * c).powf(1.5),
            (210.0 / PI).sqrt() * (2.0 * phi).cos() * (2.0 * c - 1.0) * (c * c - c),
            2.0 * (21.0 / PI).sqrt() * phi.cos() * r * (1.0 - 5.0 * c + 5.0 * c * c),
            (7.0 / (2.0 * PI)).sqrt() * (-1.0 + 12.0 * c - 30.0 * c * c + 20.0 * c * c * c),
            2.0 * (21.0 / PI).sqrt() * r * (1.0 - 5.0 * c + 5.0 * c * c) * phi.sin(),
            (210.0 / PI).sqrt() * (2.0 * c - 1.0) * (c * c - c) * (2.0 * phi).sin(),
            2.0 * (35.0 / PI).sqrt() * (c - c * c).powf(1.5) * (3.0 * phi).sin(),
        ];
        for order in 2..5 {
            let got = hsh(l, order);
            for (i, (g, w)) in got.iter().zip(want).enumerate() {
                let w = if i < order * order { w } else { 0.0 };
                assert!((g - w).abs() < 1e-12, "{order} {i}: {g} {w}");
            }
        }
        let p = evaluate(Basis::Ptm, Vec3::new(0.5, -0.25, 0.8));
        assert_eq!(p[..6], [1.0, 0.5, -0.25, 0.25, -0.125, 0.0625]);
        let degrees: Vec<usize> = (0..16).map(|t| degree(Basis::Hsh { order: 4 }, t)).collect();
        assert_eq!(degrees, [0, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3]);
    }
}
